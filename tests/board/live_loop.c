/* live_loop - the board program's loop with frames from a directory instead of a camera, for the tests
 * of the live view.
 *
 *     live_loop DIR COUNT RATE [PROGRAM PORT]
 *
 * COUNT frames (0: until the end of standard input), over and over the ones of DIR, RATE a second (0: one after the other); records go to
 * standard output. With PROGRAM, isohead_live, and PORT (0: any) there is a live view, whose URL is the
 * first line of standard error. The last line says what it took: "frames N cpu_us N real_us N", of the
 * loop's process alone.
 */
#include <inttypes.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include "app_live.h"
#include "app_loop.h"
#include "linux/hal_clock.h"
#include "linux/hal_viewer.h"
#include "replay/hal_replay.h"

#define FRAME_US 40000

static struct hal_replay replay;
static struct hal_camera camera;
static struct app_config config;
static struct app_log messages;
static struct isohead head;
static struct app_state state;
static struct hal_viewer_process viewer;
static int64_t frame_count, given_count, period_us, next_us, passed_us, last_us;
static bool is_due;

static void die(const char *what, const char *text)
{
    fprintf(stderr, "live_loop: %s: %s\n", what, text);
    exit(1);
}

static bool camera_open(void *context, struct hal_error *error)
{
    (void)context, (void)error;
    return true;
}

static void camera_close(void *context)
{
    (void)context;
}

/* The longest that is believed, so that no frame counts as late on a busy machine: that stands in the records. */
static int32_t camera_frame_time(void *context)
{
    (void)context;
    return 1000 * 1000;
}

static bool is_over(void)
{
    struct pollfd input = {.fd = STDIN_FILENO, .events = POLLIN};
    return frame_count > 0 ? given_count == frame_count : poll(&input, 1, 0) > 0;
}

/* One frame per turn of the loop, and from the first on again after the last, in a time that goes on. */
static enum hal_next camera_next(void *context, struct hal_frame *frame, struct hal_error *error)
{
    (void)context;
    if (!is_due) {
        return HAL_NEXT_NONE;
    }
    is_due = false;
    enum hal_next next = replay.camera.next(replay.camera.context, frame, error);
    if (next == HAL_NEXT_END) {
        replay.next_index = 0;
        passed_us = last_us + FRAME_US;
        next = replay.camera.next(replay.camera.context, frame, error);
    }
    if (next != HAL_NEXT_FRAME) {
        die("frames", next == HAL_NEXT_BAD ? error->text : "none");
    }
    frame->time_us += passed_us;
    last_us = frame->time_us;
    frame->sequence = given_count++;
    return next;
}

static void camera_release(void *context, const struct hal_frame *frame)
{
    (void)context;
    replay.camera.release(replay.camera.context, frame);
}

static bool wait_for(void *context, int64_t timeout_us, unsigned *events, struct hal_error *error)
{
    (void)context, (void)timeout_us, (void)error;
    int64_t left_us = next_us - hal_clock.now_us(hal_clock.context);
    if (is_over()) {
        *events = HAL_EVENT_STOP;
        return true;
    }
    if (left_us > 0) {
        const struct timespec pause = {left_us / 1000000, left_us % 1000000 * 1000};
        nanosleep(&pause, NULL);
    }
    next_us += period_us;
    is_due = true;
    *events = HAL_EVENT_FRAME;
    return true;
}

static bool feed(void *context, struct hal_error *error)
{
    (void)context, (void)error;
    return true;
}

static enum hal_sent send_record(void *context, const char *bytes, size_t count,
                                 struct hal_error *error)
{
    (void)context, (void)error;
    fwrite(bytes, 1, count, stdout);
    fflush(stdout); /* the test counts them */
    return HAL_SENT;
}

/* The strobe is never asked for, as the laser is not enabled. */
static bool strobe_good(void *context, struct hal_error *error)
{
    (void)context, (void)error;
    return true;
}

static bool strobe_set(void *context, bool on, struct hal_error *error)
{
    (void)context, (void)error;
    if (on) {
        die("laser", "switched on");
    }
    return true;
}

static bool strobe_interlock(void *context, bool *closed, struct hal_error *error)
{
    (void)context, (void)error;
    *closed = true;
    return true;
}

static void write_message(void *context, int level, const char *text)
{
    (void)context;
    if (level != APP_LOG_INFO) {
        fprintf(stderr, "%s\n", text);
    }
}

static void report_error(void *context, const char *subject, const char *text)
{
    (void)context;
    die(subject, text);
}

static int64_t cpu_us(void)
{
    struct rusage used;
    getrusage(RUSAGE_SELF, &used);
    return ((int64_t)used.ru_utime.tv_sec + used.ru_stime.tv_sec) * 1000000 +
           used.ru_utime.tv_usec + used.ru_stime.tv_usec;
}

static void run(bool has_viewer)
{
    static const struct hal_strobe strobe = {.open = strobe_good,
                                             .close = camera_close,
                                             .set = strobe_set,
                                             .beat = strobe_good,
                                             .interlock = strobe_interlock,
                                             .judged = strobe_good};
    static const struct hal_events events = {NULL, wait_for};
    static const struct hal_watchdog watchdog = {NULL, feed};
    static const struct hal_output output = {NULL, send_record};
    camera = (struct hal_camera){.open = camera_open,
                                 .close = camera_close,
                                 .next = camera_next,
                                 .release = camera_release,
                                 .frame_time_us = camera_frame_time};
    app_log_init(&messages, write_message, NULL, hal_clock.now_us(hal_clock.context));
    state.config = &config;
    state.log = &messages;
    state.head = &head;
    state.hal = (struct app_hal){.camera = &camera,
                                 .strobe = &strobe,
                                 .events = &events,
                                 .clock = &hal_clock,
                                 .watchdog = &watchdog,
                                 .output = &output,
                                 .viewer = has_viewer ? &viewer.viewer : NULL};
    int64_t began_us = hal_clock.now_us(hal_clock.context), began_cpu_us = cpu_us();
    next_us = began_us;
    if (app_loop_run(&state) != APP_EXIT_GOOD) {
        die("loop", "did not end well");
    }
    fprintf(stderr, "frames %" PRId64 " cpu_us %" PRId64 " real_us %" PRId64 "\n", given_count,
            cpu_us() - began_cpu_us, hal_clock.now_us(hal_clock.context) - began_us);
}

int main(int argument_count, char **arguments)
{
    static char rig[4096];
    struct hal_error error;
    const struct hal_log log = {NULL, report_error};
    if (argument_count != 4 && argument_count != 6) {
        die("usage", "live_loop DIR COUNT RATE [PROGRAM PORT]");
    }
    snprintf(rig, sizeof rig, "%s/rig.json", arguments[1]);
    config.rig = rig;
    config.device = arguments[1];
    config.duty_percent = 100;
    config.laser_cap_ms = 200;
    frame_count = strtol(arguments[2], NULL, 10);
    long rate = strtol(arguments[3], NULL, 10);
    period_us = rate > 0 ? 1000000 / rate : 0;
    if (!hal_replay_open(&replay, arguments[1], false, &log, &error)) {
        die(arguments[1], error.text);
    }
    bool has_viewer = argument_count == 6;
    if (has_viewer) {
        const struct hal_viewer_config with = {.program = arguments[4],
                                               .host = "127.0.0.1",
                                               .port = arguments[5],
                                               .content_size = app_live_size(752, 582)};
        if (!hal_viewer_open(&viewer, &with, &error)) {
            die("view", error.text);
        }
        fprintf(stderr, "%s\n", viewer.url);
    }
    run(has_viewer);
    if (has_viewer) {
        hal_viewer_close(&viewer);
    }
    hal_replay_close(&replay);
    return 0;
}
