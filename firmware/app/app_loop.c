#include "app_loop.h"

#include <inttypes.h>

#include "app_frame.h"
#include "app_health.h"
#include "app_recorder.h"
#include "app_rig.h"

/* A strobe that failed ends the program, and is reported even at its end: the laser may be on. */
static void watch_fault(struct app_state *state)
{
    const struct app_laser *laser = &state->laser;
    if ((laser->blocks & APP_LASER_BLOCK_FAULT) != 0 && !state->reported_fault) {
        state->reported_fault = true;
        app_log_say(state->log, APP_LOG_ERROR, "laser: %s", laser->failed.text);
        app_state_end(state, APP_EXIT_FAILED);
    }
}

/* Into the log and the sums: what became of the laser. */
static void watch_laser(struct app_state *state)
{
    struct app_laser *laser = &state->laser;
    const unsigned quiet = APP_LASER_BLOCK_DISABLED | APP_LASER_BLOCK_DUTY;
    unsigned blocks = laser->blocks & ~quiet;
    state->status.laser_on_us = laser->on_us;
    bool is_fault = (blocks & APP_LASER_BLOCK_FAULT) != 0; /* has a message of its own */
    if (blocks != state->reported_blocks && laser->config.enabled && !is_fault) {
        const char *why = app_laser_block_text(blocks);
        if (why != NULL) {
            app_log_say(state->log, APP_LOG_WARNING, "laser off: %s", why);
        } else {
            app_log_say(state->log, APP_LOG_INFO, "laser allowed");
        }
    }
    state->reported_blocks = blocks;
    watch_fault(state);
}

static bool load_rig(struct app_state *state, struct hal_error *error)
{
    struct ih_calibration calibration;
    int32_t bad_slot = IH_NONE;
    if (!app_rig_load(state->config->rig, &calibration, error)) {
        return false;
    }
    if (calibration.kind == IH_RIG_RANGE) {
        return hal_fail(error, "kind: range, expected a rig with a laser: dots");
    }
    app_health_up(state, &calibration);
    enum ih_err err = isohead_init(state->head, &calibration, &bad_slot);
    if (state->config->paper && !state->config->check) {
        ih_params_paper(&state->head->params);
    }
    if (err != IH_OK) {
        app_rig_explain(&calibration, err, bad_slot, error);
        return false;
    }
    app_health_begin(state);
    return true;
}

/* The camera was opened for the size of the first rig. */
static void reload_rig(struct app_state *state)
{
    struct hal_error error;
    app_laser_rig(&state->laser, false, app_state_now_us(state));
    state->rig_is_valid = load_rig(state, &error);
    const struct ih_calibration *rig = &state->head->rig.calibration;
    if (state->rig_is_valid && (rig->width != state->width || rig->height != state->height)) {
        state->rig_is_valid = hal_fail(&error,
                                       "%" PRId32 "x%" PRId32 " px, expected %" PRId32 "x%" PRId32
                                       " as before: for another size start anew",
                                       rig->width, rig->height, state->width, state->height);
    }
    if (state->rig_is_valid) {
        app_log_say(state->log, APP_LOG_INFO, "%s: reloaded", state->config->rig);
        app_recorder_rig(state);
        app_laser_rig(&state->laser, true, app_state_now_us(state));
        app_frame_light(state);
    } else {
        app_log_say(state->log, APP_LOG_ERROR, "%s: %s; no records until a good one is reloaded",
                    state->config->rig, error.text);
    }
}

static int64_t silence_max_us(const struct app_state *state)
{
    int64_t silence_us = APP_LOOP_SILENT_FRAMES * state->frame_time_us;
    return silence_us > APP_LOOP_SILENT_MIN_US ? silence_us : APP_LOOP_SILENT_MIN_US;
}

static void close_camera(struct app_state *state)
{
    const struct hal_camera *camera = state->hal.camera;
    app_laser_camera(&state->laser, false, 0, app_state_now_us(state));
    app_frame_forget(state);
    camera->close(camera->context);
    state->is_streaming = false;
}

/* Laser off, and again later. */
static void lose_camera(struct app_state *state, const char *why)
{
    if (state->is_streaming) {
        state->live.strobe = "reopened";
    }
    close_camera(state);
    app_log_say(state->log, APP_LOG_ERROR, "%s: %s; trying again", state->config->device, why);
    state->retry_us = app_state_now_us(state) + state->retry_wait_us;
    state->retry_wait_us *= 2;
    if (state->retry_wait_us > APP_LOOP_RETRY_MAX_US) {
        state->retry_wait_us = APP_LOOP_RETRY_MAX_US;
    }
}

/* Can frames of this rate be believed in, and come in time for the laser's cap? */
static bool check_rate(const struct app_state *state, struct hal_error *error)
{
    int64_t cap_us = state->laser.config.cap_us;
    int64_t frame_us = state->frame_time_us;
    if (frame_us < APP_LOOP_FRAME_TIME_MIN_US || frame_us > APP_LOOP_FRAME_TIME_MAX_US) {
        return hal_fail(error, "a frame every %" PRId64 " us, expected 1 to 1000 frames a second",
                        frame_us);
    }
    if (state->laser.config.enabled && APP_LASER_CAP_FRAMES * frame_us > cap_us) {
        return hal_fail(error,
                        "a frame every %" PRId64 " us, too slow for laser-cap = %" PRId64
                        ": expected at most %" PRId64 " us, or laser-cap = %" PRId64
                        " (at most 1000)",
                        frame_us, cap_us / 1000, cap_us / APP_LASER_CAP_FRAMES,
                        (APP_LASER_CAP_FRAMES * frame_us + 999) / 1000);
    }
    return true;
}

static void open_camera(struct app_state *state)
{
    const struct hal_camera *camera = state->hal.camera;
    struct hal_error error;
    if (!camera->open(camera->context, &error)) {
        lose_camera(state, error.text);
        return;
    }
    state->frame_time_us = camera->frame_time_us(camera->context);
    if (state->frame_time_us == 0) { /* it does not say, and then it took no rate either */
        state->frame_time_us = APP_LOOP_FRAME_TIME_US;
    }
    if (!check_rate(state, &error)) {
        lose_camera(state, error.text);
        return;
    }
    state->is_streaming = true;
    state->frame_us = app_state_now_us(state);
    app_frame_begin(state);
    app_log_say(state->log, APP_LOG_INFO, "%s: open, a frame every %" PRId64 " us",
                state->config->device, state->frame_time_us);
    app_laser_camera(&state->laser, true, state->frame_time_us, app_state_now_us(state));
    app_frame_light(state);
}

/* A frame came, whatever becomes of it. */
static void note_frame(struct app_state *state)
{
    int64_t now_us = app_state_now_us(state);
    bool is_late = now_us - state->frame_us > APP_LASER_SILENT_FRAMES * state->frame_time_us;
    if (state->sequence >= 0 && is_late && !state->hal.camera->waits) {
        state->live.strobe = "late";
    }
    state->frame_us = now_us;
    state->retry_wait_us = APP_LOOP_RETRY_MIN_US;
}

/* A camera that is gone may come back; the end of a directory is that of the program. */
static void end_frames(struct app_state *state, enum hal_next next, const char *why)
{
    if (next == HAL_NEXT_GONE) {
        lose_camera(state, why);
    } else {
        app_log_say(state->log, APP_LOG_INFO, "%s: no more frames", state->config->device);
        app_state_end(state, APP_EXIT_GOOD);
    }
}

/* The newest frame that waits, or what is wrong. */
static void take_frames(struct app_state *state)
{
    const struct hal_camera *camera = state->hal.camera;
    struct hal_error error;
    struct hal_frame newest = {.samples = NULL};
    bool has_newest = false;
    enum hal_next next = HAL_NEXT_FRAME;
    const int drain_max = camera->waits ? 1 : APP_LOOP_DRAIN_MAX;
    for (int i = 0; i < drain_max && next != HAL_NEXT_NONE && state->is_streaming; i++) {
        struct hal_frame frame;
        next = camera->next(camera->context, &frame, &error);
        if (next == HAL_NEXT_GONE || next == HAL_NEXT_END) {
            break;
        }
        if (next == HAL_NEXT_NONE) {
            continue;
        }
        note_frame(state);
        if (next == HAL_NEXT_BAD) {
            app_frame_lose(state, &frame, error.text);
            continue;
        }
        if (has_newest) {
            app_frame_skip(state, &newest);
        }
        newest = frame;
        has_newest = true;
    }
    if (next == HAL_NEXT_GONE || next == HAL_NEXT_END) {
        if (has_newest) {
            camera->release(camera->context, &newest);
        }
        end_frames(state, next, error.text);
    } else if (has_newest) {
        app_laser_busy(&state->laser, true, app_state_now_us(state));
        app_frame_use(state, &newest);
        app_laser_busy(&state->laser, false, app_state_now_us(state));
        state->frame_us = app_state_now_us(state);
    }
}

static void reset(struct app_state *state)
{
    const struct app_config *config = state->config;
    const struct app_laser_config laser = {
        .enabled = config->laser,
        .duty_percent = config->duty_percent,
        .cap_us = (int64_t)config->laser_cap_ms * 1000,
    };
    int64_t now_us = app_state_now_us(state);
    app_laser_init(&state->laser, &laser, state->hal.strobe, now_us);
    app_phase_init(&state->phase);
    app_status_init(&state->status, config->status_s, now_us);
    state->reported_blocks = state->laser.blocks;
    state->reported_fault = false;
    state->light_wanted = false;
    state->on_frames = 0;
    state->is_streaming = false;
    state->retry_us = now_us;
    state->retry_wait_us = APP_LOOP_RETRY_MIN_US;
    state->sequence = -1;
    state->has_ambient = false;
    state->steers = false;
    state->live = (struct app_record_live){.lost_count = 0};
    state->result_count = 0;
    state->record.dir = NULL;
    state->is_over = false;
    state->exit = APP_EXIT_GOOD;
}

/* A frame is due, or the camera is. */
static int64_t camera_wait_us(const struct app_state *state, int64_t now_us)
{
    int64_t at_us = state->is_streaming ? state->frame_us + silence_max_us(state) : state->retry_us;
    return at_us > now_us ? at_us - now_us : 0;
}

static void run_camera(struct app_state *state, unsigned events)
{
    if (!state->is_streaming) {
        if (app_state_now_us(state) >= state->retry_us) {
            open_camera(state);
        }
        return;
    }
    if ((events & HAL_EVENT_FRAME) != 0) {
        take_frames(state);
    }
    if (state->is_streaming && app_state_now_us(state) - state->frame_us >= silence_max_us(state)) {
        lose_camera(state, "no frames");
    }
}

/* False: the loop ends. */
static bool wait(struct app_state *state, unsigned *events)
{
    const struct app_hal *hal = &state->hal;
    struct hal_error error;
    int64_t now_us = app_state_now_us(state);
    int64_t wait_us = app_laser_tick(&state->laser, now_us);
    int64_t camera_us = camera_wait_us(state, now_us);
    watch_laser(state);
    if (state->is_over) {
        return false;
    }
    wait_us = camera_us < wait_us ? camera_us : wait_us;
    if (!hal->events->wait(hal->events->context, wait_us, events, &error)) {
        app_log_say(state->log, APP_LOG_ERROR, "waiting: %s", error.text);
        app_state_end(state, APP_EXIT_FAILED);
        return false;
    }
    if (!hal->watchdog->feed(hal->watchdog->context, &error)) {
        app_log_say(state->log, APP_LOG_ERROR, "watchdog: %s", error.text);
        app_state_end(state, APP_EXIT_FAILED);
        return false;
    }
    return true;
}

static void run_once(struct app_state *state)
{
    char line[APP_STATUS_TEXT_MAX];
    unsigned events = 0;
    if (!wait(state, &events)) {
        return;
    }
    app_log_time(state->log, app_state_now_us(state));
    if ((events & HAL_EVENT_STOP) != 0) {
        app_state_end(state, APP_EXIT_GOOD);
        return;
    }
    if ((events & HAL_EVENT_INTERLOCK) != 0) {
        app_laser_interlock(&state->laser, app_state_now_us(state));
    }
    if ((events & HAL_EVENT_RELOAD) != 0) {
        reload_rig(state);
    }
    if ((events & HAL_EVENT_RECORD) != 0) {
        app_recorder_request(state);
    }
    run_camera(state, events);
    app_recorder_tick(state);
    app_health_tick(state);
    watch_laser(state);
    if (app_status_line(&state->status, app_state_now_us(state), line)) {
        app_log_report(state->log, APP_LOG_INFO, line);
    }
}

enum app_exit app_loop_run(struct app_state *state)
{
    struct hal_error error;
    reset(state);
    state->rig_is_valid = load_rig(state, &error);
    if (!state->rig_is_valid) {
        app_log_say(state->log, APP_LOG_ERROR, "%s: %s", state->config->rig, error.text);
        return APP_EXIT_USAGE;
    }
    state->width = state->head->rig.calibration.width;
    state->height = state->head->rig.calibration.height;
    app_recorder_begin(state);
    app_laser_rig(&state->laser, true, app_state_now_us(state));
    if (app_laser_open(&state->laser, &error)) {
        if (error.text[0] != 0) {
            app_log_say(state->log, APP_LOG_WARNING, "laser: not proven at the start: %s",
                        error.text);
        }
        while (!state->is_over) {
            run_once(state);
        }
    } else {
        watch_laser(state);
    }
    close_camera(state);
    app_laser_close(&state->laser, app_state_now_us(state));
    watch_fault(state);
    app_log_end(state->log);
    return state->exit;
}
