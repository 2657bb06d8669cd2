#include "app_loop.h"

#include <inttypes.h>

#include "app_frame.h"
#include "app_health.h"
#include "app_rig.h"
#include "app_rig_explain.h"

static int64_t now(const struct app_loop *loop)
{
    return loop->hal.clock->now_us(loop->hal.clock->context);
}

void app_loop_end(struct app_loop *loop, enum app_exit exit)
{
    app_laser_wish(&loop->laser, false, now(loop));
    loop->is_over = true;
    loop->exit = exit;
}

/* A strobe that failed ends the program, and is told even at its end: the laser may be on. */
static void watch_fault(struct app_loop *loop)
{
    const struct app_laser *laser = &loop->laser;
    if ((laser->blocks & APP_LASER_BLOCK_FAULT) != 0 && !loop->told_fault) {
        loop->told_fault = true;
        app_log_say(loop->log, APP_LOG_ERROR, "laser: %s", laser->failed.text);
        app_loop_end(loop, APP_EXIT_FAILED);
    }
}

/* Into the log and the sums: what became of the laser. */
static void watch_laser(struct app_loop *loop)
{
    struct app_laser *laser = &loop->laser;
    const unsigned quiet = APP_LASER_BLOCK_DISABLED | APP_LASER_BLOCK_DUTY;
    unsigned blocks = laser->blocks & ~quiet;
    loop->status.laser_on_us = laser->on_us;
    bool is_fault = (blocks & APP_LASER_BLOCK_FAULT) != 0; /* has a message of its own */
    if (blocks != loop->told_blocks && laser->config.enabled && !is_fault) {
        const char *why = app_laser_block_text(blocks);
        if (why != NULL) {
            app_log_say(loop->log, APP_LOG_WARNING, "laser off: %s", why);
        } else {
            app_log_say(loop->log, APP_LOG_INFO, "laser allowed");
        }
    }
    loop->told_blocks = blocks;
    watch_fault(loop);
}

static bool load_rig(struct app_loop *loop, struct hal_error *error)
{
    struct ih_calibration calibration;
    int32_t bad_slot = IH_NONE;
    if (!app_rig_load(loop->config->rig, &calibration, error)) {
        return false;
    }
    if (calibration.kind == IH_RIG_RANGE) {
        return hal_fail(error, "kind: range, expected a rig with a laser: dots");
    }
    enum ih_err err = isohead_init(loop->head, &calibration, &bad_slot);
    if (loop->config->paper) {
        ih_params_paper(&loop->head->params);
    }
    if (err != IH_OK) {
        app_rig_explain(&calibration, err, bad_slot, error);
        return false;
    }
    app_health_begin(loop);
    return true;
}

/* The camera was opened for the size of the first rig. */
static void reload_rig(struct app_loop *loop)
{
    struct hal_error error;
    app_laser_rig(&loop->laser, false, now(loop));
    loop->rig_is_valid = load_rig(loop, &error);
    const struct ih_calibration *rig = &loop->head->rig.calibration;
    if (loop->rig_is_valid && (rig->width != loop->width || rig->height != loop->height)) {
        loop->rig_is_valid = hal_fail(&error,
                                      "%" PRId32 "x%" PRId32 " px, expected %" PRId32 "x%" PRId32
                                      " as before: for another size start anew",
                                      rig->width, rig->height, loop->width, loop->height);
    }
    if (loop->rig_is_valid) {
        app_log_say(loop->log, APP_LOG_INFO, "%s: reloaded", loop->config->rig);
        app_laser_rig(&loop->laser, true, now(loop));
        app_frame_light(loop);
    } else {
        app_log_say(loop->log, APP_LOG_ERROR, "%s: %s; no records until a good one is reloaded",
                    loop->config->rig, error.text);
    }
}

static int64_t silence_max_us(const struct app_loop *loop)
{
    int64_t silence_us = APP_LOOP_SILENT_FRAMES * loop->frame_time_us;
    return silence_us > APP_LOOP_SILENT_MIN_US ? silence_us : APP_LOOP_SILENT_MIN_US;
}

static void close_camera(struct app_loop *loop)
{
    const struct hal_camera *camera = loop->hal.camera;
    app_laser_camera(&loop->laser, false, 0, now(loop));
    app_frame_forget(loop);
    camera->close(camera->context);
    loop->is_streaming = false;
}

/* Laser off, and again later. */
static void lose_camera(struct app_loop *loop, const char *why)
{
    if (loop->is_streaming) {
        loop->live.strobe = "reopened";
    }
    close_camera(loop);
    app_log_say(loop->log, APP_LOG_ERROR, "%s: %s; trying again", loop->config->device, why);
    loop->retry_us = now(loop) + loop->retry_wait_us;
    loop->retry_wait_us *= 2;
    if (loop->retry_wait_us > APP_LOOP_RETRY_MAX_US) {
        loop->retry_wait_us = APP_LOOP_RETRY_MAX_US;
    }
}

static void open_camera(struct app_loop *loop)
{
    const struct hal_camera *camera = loop->hal.camera;
    struct hal_error error;
    if (!camera->open(camera->context, &error)) {
        lose_camera(loop, error.text);
        return;
    }
    loop->is_streaming = true;
    loop->frame_time_us = camera->frame_time_us(camera->context);
    if (loop->frame_time_us <= 0) { /* it does not say, and then it took no rate either */
        loop->frame_time_us = APP_LOOP_FRAME_TIME_US;
    }
    loop->frame_us = now(loop);
    app_frame_begin(loop);
    app_log_say(loop->log, APP_LOG_INFO, "%s: open, a frame every %" PRId64 " us",
                loop->config->device, loop->frame_time_us);
    app_laser_camera(&loop->laser, true, loop->frame_time_us, now(loop));
    app_frame_light(loop);
}

/* A frame came, whatever becomes of it. */
static void note_frame(struct app_loop *loop)
{
    int64_t now_us = now(loop);
    bool is_late = now_us - loop->frame_us > APP_LASER_SILENT_FRAMES * loop->frame_time_us;
    if (loop->sequence >= 0 && is_late) {
        loop->live.strobe = "late";
    }
    loop->frame_us = now_us;
    loop->retry_wait_us = APP_LOOP_RETRY_MIN_US;
}

/* The newest frame that waits, or what is wrong. */
static void take_frames(struct app_loop *loop)
{
    const struct hal_camera *camera = loop->hal.camera;
    struct hal_error error;
    struct hal_frame newest = {.samples = NULL};
    bool has_newest = false;
    enum hal_next next = HAL_NEXT_FRAME;
    for (int i = 0; i < APP_LOOP_DRAIN_MAX && next != HAL_NEXT_NONE && loop->is_streaming; i++) {
        struct hal_frame frame;
        next = camera->next(camera->context, &frame, &error);
        if (next == HAL_NEXT_GONE || next == HAL_NEXT_END) {
            break;
        }
        if (next == HAL_NEXT_NONE) {
            continue;
        }
        note_frame(loop);
        if (next == HAL_NEXT_BAD) {
            /* The camera lives, but nobody has seen anything: no frame to the laser. */
            app_frame_lose(loop, &frame, error.text);
            continue;
        }
        app_laser_frame(&loop->laser, now(loop));
        if (has_newest) {
            app_frame_skip(loop, &newest);
        }
        newest = frame;
        has_newest = true;
    }
    if (next == HAL_NEXT_GONE || next == HAL_NEXT_END) {
        if (has_newest) {
            camera->release(camera->context, &newest);
        }
        lose_camera(loop, next == HAL_NEXT_GONE ? error.text : "no more frames");
    } else if (has_newest) {
        app_laser_busy(&loop->laser, true, now(loop));
        app_frame_use(loop, &newest);
        app_laser_busy(&loop->laser, false, now(loop));
        loop->frame_us = now(loop);
    }
}

static void reset(struct app_loop *loop)
{
    const struct app_config *config = loop->config;
    const struct app_laser_config laser = {config->laser, config->duty_percent};
    int64_t now_us = now(loop);
    app_laser_init(&loop->laser, &laser, loop->hal.strobe, now_us);
    app_phase_init(&loop->phase);
    app_status_init(&loop->status, config->status_s, now_us);
    loop->told_blocks = loop->laser.blocks;
    loop->told_fault = false;
    loop->light_wanted = false;
    loop->on_frames = 0;
    loop->is_streaming = false;
    loop->retry_us = now_us;
    loop->retry_wait_us = APP_LOOP_RETRY_MIN_US;
    loop->sequence = -1;
    loop->has_ambient = false;
    loop->steers = false;
    loop->live = (struct app_record_live){.lost_count = 0};
    loop->result_count = 0;
    loop->record.dir = NULL;
    loop->is_over = false;
    loop->exit = APP_EXIT_GOOD;
}

/* A frame is due, or the camera is. */
static int64_t camera_wait_us(const struct app_loop *loop, int64_t now_us)
{
    int64_t at_us = loop->is_streaming ? loop->frame_us + silence_max_us(loop) : loop->retry_us;
    return at_us > now_us ? at_us - now_us : 0;
}

static void run_camera(struct app_loop *loop, unsigned events)
{
    if (!loop->is_streaming) {
        if (now(loop) >= loop->retry_us) {
            open_camera(loop);
        }
        return;
    }
    if ((events & HAL_EVENT_FRAME) != 0) {
        take_frames(loop);
    }
    if (loop->is_streaming && now(loop) - loop->frame_us >= silence_max_us(loop)) {
        lose_camera(loop, "no frames");
    }
}

/* False: time or something that cannot be mended. */
static bool wait(struct app_loop *loop, unsigned *events)
{
    const struct app_hal *hal = &loop->hal;
    struct hal_error error;
    int64_t now_us = now(loop);
    int64_t wait_us = app_laser_tick(&loop->laser, now_us);
    int64_t camera_us = camera_wait_us(loop, now_us);
    watch_laser(loop);
    if (loop->is_over) {
        return false;
    }
    wait_us = camera_us < wait_us ? camera_us : wait_us;
    if (!hal->events->wait(hal->events->context, wait_us, events, &error)) {
        app_log_say(loop->log, APP_LOG_ERROR, "waiting: %s", error.text);
        app_loop_end(loop, APP_EXIT_FAILED);
        return false;
    }
    if (!hal->watchdog->feed(hal->watchdog->context, &error)) {
        app_log_say(loop->log, APP_LOG_ERROR, "watchdog: %s", error.text);
        app_loop_end(loop, APP_EXIT_FAILED);
        return false;
    }
    return true;
}

static void turn(struct app_loop *loop)
{
    char line[APP_STATUS_TEXT_MAX];
    unsigned events = 0;
    if (!wait(loop, &events)) {
        return;
    }
    app_log_time(loop->log, now(loop));
    if ((events & HAL_EVENT_STOP) != 0) {
        app_loop_end(loop, APP_EXIT_GOOD);
        return;
    }
    if ((events & HAL_EVENT_INTERLOCK) != 0) {
        app_laser_interlock(&loop->laser, now(loop));
    }
    if ((events & HAL_EVENT_RELOAD) != 0) {
        reload_rig(loop);
    }
    run_camera(loop, events);
    watch_laser(loop);
    if (app_status_line(&loop->status, now(loop), line)) {
        app_log_tell(loop->log, APP_LOG_INFO, line);
    }
}

enum app_exit app_loop_run(struct app_loop *loop)
{
    struct hal_error error;
    reset(loop);
    loop->rig_is_valid = load_rig(loop, &error);
    if (!loop->rig_is_valid) {
        app_log_say(loop->log, APP_LOG_ERROR, "%s: %s", loop->config->rig, error.text);
        return APP_EXIT_USAGE;
    }
    loop->width = loop->head->rig.calibration.width;
    loop->height = loop->head->rig.calibration.height;
    app_laser_rig(&loop->laser, true, now(loop));
    if (app_laser_open(&loop->laser)) {
        while (!loop->is_over) {
            turn(loop);
        }
    } else {
        watch_laser(loop);
    }
    close_camera(loop);
    app_laser_close(&loop->laser, now(loop));
    watch_fault(loop);
    app_log_end(loop->log);
    return loop->exit;
}
