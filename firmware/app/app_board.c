#include "app_board.h"

#include <math.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "app_live.h"
#include "app_rig.h"
#include "app_rig_text.h"
#include "app_settings.h"
#include "app_write.h"

#define PROGRAM "isohead_board"
#define MEGABYTE INT64_C(1000000)
#define SECOND_US INT64_C(1000000)

static struct hal_v4l2_setting exposure_of(const struct app_config *config)
{
    switch (config->exposure) {
    case APP_EXPOSURE_AUTO:
        return (struct hal_v4l2_setting){.mode = HAL_V4L2_AUTO};
    case APP_EXPOSURE_FIXED:
        return (struct hal_v4l2_setting){HAL_V4L2_VALUE, config->exposure_us};
    case APP_EXPOSURE_KEEP:
    case APP_EXPOSURE_STEER: /* the loop sets it */
        break;
    }
    return (struct hal_v4l2_setting){.mode = HAL_V4L2_KEEP};
}

static struct hal_v4l2_setting gain_of(const struct app_config *config)
{
    switch (config->gain) {
    case APP_GAIN_AUTO:
        return (struct hal_v4l2_setting){.mode = HAL_V4L2_AUTO};
    case APP_GAIN_FIXED:
        return (struct hal_v4l2_setting){HAL_V4L2_VALUE, config->gain_value};
    case APP_GAIN_KEEP:
        break;
    }
    return (struct hal_v4l2_setting){.mode = HAL_V4L2_KEEP};
}

static void open_log(struct app_board *board, const struct app_config *config)
{
    hal_log_open(&board->writer, PROGRAM,
                 config->log == APP_MESSAGES_SYSLOG ? HAL_LOG_SYSLOG : NULL);
    app_log_init(&board->log, hal_log_write, &board->writer, hal_clock.now_us(hal_clock.context));
}

static enum app_exit fail(struct app_board *board, const char *what, const struct hal_error *error,
                          enum app_exit exit)
{
    app_log_say(&board->log, APP_LOG_ERROR, "%s: %s", what, error->text);
    return exit;
}

/* only_laser: another line that is wrong or in use must not keep the laser's from being made low. */
static void init_gpio(struct app_board *board, const struct app_config *config, bool only_laser)
{
    const struct hal_gpio_config gpio = {
        .chip = config->gpio_chip,
        .laser_line = config->laser_line,
        .laser_active_low = config->laser_active_low,
        .interlock_line = only_laser ? NULL : config->interlock_line,
        .interlock_active_low = config->interlock_active_low,
        .heartbeat_line = only_laser ? NULL : config->heartbeat_line,
        .consumer = "isohead",
    };
    hal_gpio_init(&board->gpio, &gpio);
    const struct hal_guard_config guard = {
        .strobe = &board->gpio.strobe,
        .line_fd = &board->gpio.laser_fd,
        .timeout_ms = HAL_GUARD_TIMEOUT_MS,
        .interlock_fd = &board->gpio.interlock_fd,
        .limits = {.cap_us = (int64_t)config->laser_cap_ms * 1000,
                   .duty_percent = config->duty_percent},
        .line_name = board->gpio.line_name,
    };
    hal_guard_init(&board->guard, &guard);
}

static void log_error(void *context, const char *subject, const char *text)
{
    struct app_board *board = context;
    app_log_say(&board->log, APP_LOG_WARNING, "%s: %s", subject, text);
}

static bool init_directory(struct app_board *board, const struct app_config *config,
                           struct hal_error *error)
{
    const bool goes_on = config->view_port[0] != 0 || config->check;
    const struct hal_directory_config directory = {
        .path = config->device,
        .rate_mhz = config->rate_mhz,
        .repeats =
            config->repeat == APP_REPEAT_ON || (config->repeat == APP_REPEAT_AUTO && goes_on),
    };
    const struct hal_log log = {board, log_error};
    return hal_directory_init(&board->directory, &directory, &log, error);
}

/* The camera has to have the rig's size. False: what is wrong is in the log. */
static bool init_camera(struct app_board *board, const struct app_config *config)
{
    struct ih_calibration calibration;
    struct hal_error error;
    if (!app_rig_load(config->rig, &calibration, &error)) {
        fail(board, config->rig, &error, APP_EXIT_USAGE);
        return false;
    }
    const struct hal_v4l2_config v4l2 = {
        .device = config->device,
        .format = config->format,
        .width = calibration.width,
        .height = calibration.height,
        .rate_mhz = config->rate_mhz,
        .exposure = exposure_of(config),
        .gain = gain_of(config),
    };
    hal_v4l2_init(&board->v4l2, &v4l2);
    if (config->is_directory && !init_directory(board, config, &error)) {
        fail(board, config->device, &error, APP_EXIT_USAGE);
        return false;
    }
    return true;
}

/* By the core's own rule; what else may be wrong with a rig is for the loop to say. */
static bool has_sides(struct app_board *board, const struct app_config *config)
{
    struct ih_calibration calibration;
    struct hal_error ignored;
    int32_t bad_slot = IH_NONE;
    if (!app_rig_load(config->rig, &calibration, &ignored)) {
        return true;
    }
    memcpy(calibration.up_q30, board->up_q30, sizeof board->up_q30);
    return isohead_init(&board->head, &calibration, &bad_slot) != IH_ERR_UP;
}

static bool read_up(struct app_board *board, const struct app_config *config,
                    struct hal_iio_up *measured, struct hal_error *error)
{
    const struct hal_iio_config iio = {
        .called = config->up + strlen(APP_CONFIG_IIO),
        .dir = HAL_IIO_DIR,
        .pause_us = HAL_IIO_PAUSE_US,
    };
    if (!hal_iio_read(&iio, measured, error)) {
        return false;
    }
    for (int axis = 0; axis < 3; axis++) {
        board->up_q30[axis] = (int32_t)lround(ldexp(measured->up[axis], 30));
    }
    return has_sides(board, config) ||
           hal_fail(error,
                    "%s: the camera looks straight up or down, so that no side of its "
                    "picture is up",
                    measured->device);
}

/* Once, before the camera is opened. Without it the program goes on. */
static void measure_up(struct app_board *board, const struct app_config *config)
{
    struct hal_iio_up measured;
    struct hal_error error;
    board->up_text[0] = 0;
    if (config->up == NULL) {
        return;
    }
    if (!read_up(board, config, &measured, &error)) {
        app_log_say(&board->log, APP_LOG_WARNING,
                    "up: %s: %s; the rig's is used, or that of a level camera where it has none",
                    config->up, error.text);
        return;
    }
    snprintf(board->up_text, sizeof board->up_text, "[%.10f,%.10f,%.10f]",
             ldexp(board->up_q30[0], -30), ldexp(board->up_q30[1], -30),
             ldexp(board->up_q30[2], -30));
    app_log_say(&board->log, APP_LOG_INFO, "up: %s reads %.2f m/s2: up is %s", measured.device,
                measured.gravity_m_s2, app_rig_up_text(board->up_q30).text);
}

static void free_camera(struct app_board *board, const struct app_config *config)
{
    if (config->is_directory) {
        hal_directory_free(&board->directory);
    }
}

static bool open_output(struct app_board *board, const struct app_config *config,
                        struct hal_error *error)
{
    switch (config->output) {
    case APP_OUTPUT_UDP:
        return hal_output_udp(&board->output, config->output_host, config->output_port, error);
    case APP_OUTPUT_SERIAL:
        return hal_output_serial(&board->output, config->output_path, config->output_baud,
                                 &hal_clock, error);
    case APP_OUTPUT_STDOUT:
        break;
    }
    return hal_output_stdout(&board->output, error);
}

/* Before the laser's line is taken. */
static bool open_viewer(struct app_board *board, const struct app_config *config,
                        struct hal_error *error)
{
    const struct hal_v4l2_config *camera = &board->v4l2.config;
    const struct hal_viewer_config viewer = {
        .host = config->view_host,
        .port = config->view_port,
        .content_size = app_live_size(camera->width, camera->height),
    };
    if (!hal_viewer_open(&board->viewer, &viewer, error)) {
        return false;
    }
    app_log_say(&board->log, APP_LOG_INFO, "live view: %s%s", board->viewer.url,
                board->viewer.is_local
                    ? ""
                    : " (without encryption: whoever can read along on the network sees it too)");
    return true;
}

static bool write_settings(struct app_board *board, const struct app_config *config,
                           struct hal_error *error)
{
    struct app_write write = {.memory = board->settings, .size = sizeof board->settings - 1};
    app_write_open(&write, '{');
    app_write_key(&write, "version");
    app_write_string(&write, ISOHEAD_VERSION);
    app_write_key(&write, "settings");
    app_settings_write(config, &write);
    app_write_close(&write, '}');
    app_write_line_end(&write);
    board->settings[write.length] = 0;
    return !write.full || hal_fail(error, "the settings are too long");
}

/* Before camera and laser, too. */
static bool open_recorder(struct app_board *board, const struct app_config *config,
                          struct hal_error *error)
{
    const struct hal_v4l2_config *camera = &board->v4l2.config;
    const struct hal_recorder_config recorder = {
        .recording = {.dir = config->record,
                      .rig = config->rig,
                      .up = board->up_text[0] != 0 ? board->up_text : NULL,
                      .settings = board->settings,
                      .bytes_max = config->record_max_mb * MEGABYTE},
        .memory_bytes = config->record_memory_mb * MEGABYTE,
        .frame_bytes = (int64_t)camera->width * camera->height * 2,
        .keep_us = config->record_s * SECOND_US,
    };
    return write_settings(board, config, error) &&
           hal_recorder_open(&board->recorder, &recorder, error);
}

static enum app_exit run_loop(struct app_board *board, const struct app_config *config)
{
    const struct hal_events_config events = {
        .camera_fd = config->is_directory ? &board->directory.fd : &board->v4l2.fd,
        .interlock_fd = &board->gpio.interlock_fd,
        .signal_fd = &board->signals.fd,
        .terminal_fd = isatty(STDIN_FILENO) == 1    ? STDIN_FILENO
                       : isatty(STDERR_FILENO) == 1 ? STDERR_FILENO
                                                    : -1,
    };
    hal_events_init(&board->events, &events);
    board->state.config = config;
    board->state.log = &board->log;
    board->state.head = &board->head;
    board->state.measured_up_q30 = board->up_text[0] != 0 ? board->up_q30 : NULL;
    board->state.hal = (struct app_hal){
        .camera = config->is_directory ? &board->directory.camera : &board->v4l2.camera,
        .strobe = &board->guard.strobe,
        .events = &board->events.events,
        .clock = &hal_clock,
        .watchdog = &board->watchdog.watchdog,
        .output = &board->output.output,
        .viewer = config->view_port[0] != 0 ? &board->viewer.viewer : NULL,
        .recorder = config->record != NULL ? &board->recorder.recorder : NULL,
    };
    return app_loop_run(&board->state);
}

/* A line that is stuck on is left to the watchdog that runs from before: opening it would be a sign of
 * life, and ending without a laser that could be on would stop it. */
static bool is_laser_off(const struct app_board *board, const struct app_config *config,
                         struct hal_error *error)
{
    const struct hal_strobe *strobe = &board->gpio.strobe;
    if (!config->laser) {
        return true;
    }
    if (!strobe->open(strobe->context, error)) {
        return false;
    }
    strobe->close(strobe->context);
    return true;
}

static enum app_exit run_with_output(struct app_board *board, const struct app_config *config)
{
    struct hal_error error, unproven;
    const struct hal_watchdog_config watchdog = {
        .path = config->watchdog,
        .guard = config->laser ? &board->guard : NULL,
        .clock = &hal_clock,
    };
    if (!hal_signals_open(&board->signals, config->laser ? &board->guard.strobe : NULL,
                          config->record != NULL, &error)) {
        return fail(board, "signals", &error, APP_EXIT_FAILED);
    }
    if (!is_laser_off(board, config, &error)) {
        return fail(board, "laser", &error, APP_EXIT_FAILED);
    }
    if (!hal_watchdog_open(&board->watchdog, &watchdog, &unproven, &error)) {
        return fail(board, "watchdog", &error, APP_EXIT_FAILED);
    }
    if (unproven.text[0] != 0) {
        app_log_say(&board->log, APP_LOG_WARNING, "%s", unproven.text);
    }
    enum app_exit exit = run_loop(board, config);
    hal_watchdog_close(&board->watchdog, board->state.laser.may_be_on);
    return exit;
}

static enum app_exit run_with_recorder(struct app_board *board, const struct app_config *config)
{
    struct hal_error error;
    if (config->record == NULL) {
        return run_with_output(board, config);
    }
    if (!open_recorder(board, config, &error)) {
        return fail(board, "record", &error, APP_EXIT_FAILED);
    }
    enum app_exit exit = run_with_output(board, config);
    hal_recorder_close(&board->recorder);
    return exit;
}

static enum app_exit run_with_view(struct app_board *board, const struct app_config *config)
{
    struct hal_error error;
    if (config->view_port[0] == 0) {
        return run_with_recorder(board, config);
    }
    if (!open_viewer(board, config, &error)) {
        return fail(board, "view", &error, APP_EXIT_FAILED);
    }
    enum app_exit exit = run_with_recorder(board, config);
    hal_viewer_close(&board->viewer);
    return exit;
}

static enum app_exit run_with_camera(struct app_board *board, const struct app_config *config)
{
    struct hal_error error;
    if (!open_output(board, config, &error)) {
        return fail(board, "output", &error, APP_EXIT_FAILED);
    }
    enum app_exit exit = run_with_view(board, config);
    hal_output_close(&board->output);
    return exit;
}

enum app_exit app_board_run(struct app_board *board, const struct app_config *config)
{
    enum app_exit exit = APP_EXIT_USAGE;
    open_log(board, config);
    init_gpio(board, config, false);
    if (init_camera(board, config)) {
        measure_up(board, config);
        exit = run_with_camera(board, config);
        free_camera(board, config);
    }
    hal_log_close(&board->writer);
    return exit;
}

/* Take the line, which makes it low, from whoever of ours has it. */
static bool take_line(struct app_board *board, struct hal_error *error)
{
    const struct timespec pause = {.tv_nsec = APP_BOARD_OFF_PAUSE_MS * 1000000L};
    const struct hal_strobe *strobe = &board->gpio.strobe;
    for (int i = 0; i < APP_BOARD_OFF_TRIES; i++) {
        if (strobe->open(strobe->context, error)) {
            return true;
        }
        if (i >= APP_BOARD_OFF_PATIENCE && board->gpio.line_name[0] != 0) {
            int ended_count = hal_guard_end(board->gpio.line_name, error);
            if (ended_count < 0) {
                return false;
            }
            if (ended_count > 0) {
                app_log_say(&board->log, APP_LOG_WARNING,
                            "laser: %d processes that held its line were ended", ended_count);
            }
        }
        nanosleep(&pause, NULL);
    }
    return false;
}

enum app_exit app_board_laser_off(struct app_board *board, const struct app_config *config)
{
    const struct hal_strobe *strobe = &board->gpio.strobe;
    struct hal_error error = {
        "gpio-chip and laser-line: missing or in doubt, so that nothing was switched off"};
    enum app_exit exit = APP_EXIT_USAGE;
    if (config->path != NULL && !config->laser && config->gpio_chip == NULL &&
        config->laser_line == NULL) {
        return APP_EXIT_GOOD; /* a board without a laser: what its service runs after each end */
    }
    open_log(board, config);
    if (config->gpio_chip != NULL && config->laser_line != NULL) {
        init_gpio(board, config, true);
        exit = take_line(board, &error)  ? APP_EXIT_GOOD
               : board->gpio.has_no_line ? APP_EXIT_NO_LINE
                                         : APP_EXIT_FAILED;
        strobe->close(strobe->context);
    }
    if (exit != APP_EXIT_GOOD) {
        fail(board, "laser", &error, exit);
    }
    hal_log_close(&board->writer);
    return exit;
}
