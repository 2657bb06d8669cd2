#include "app_frame.h"

#include "app_health.h"
#include "app_live.h"
#include "app_recorder.h"
#include "app_view.h"

static void wish_light(struct app_state *state, bool on)
{
    if (on && !state->light_wanted) {
        state->on_frames = 0;
    }
    state->light_wanted = on;
    app_laser_wish(&state->laser, on && !state->is_over, app_state_now_us(state));
}

static void put_record(struct app_state *state, bool is_complete, const char *name)
{
    const struct hal_output *output = state->hal.output;
    struct hal_error error;
    if (state->config->check) {
        return;
    }
    if (!is_complete) {
        app_log_say(state->log, APP_LOG_ERROR, "%s: its record is too long", name);
        state->status.unsent_count++;
        return;
    }
    enum hal_sent sent =
        output->send(output->context, state->record.text, state->record.length, &error);
    if (sent == HAL_SENT_NOT) {
        state->status.unsent_count++;
    } else if (sent == HAL_SENT_NEVER) {
        app_log_say(state->log, APP_LOG_ERROR, "output: %s", error.text);
        app_state_end(state, APP_EXIT_FAILED);
    }
}

static void lose_frame(struct app_state *state, const char *name, const char *text)
{
    state->status.bad_count++;
    app_log_say(state->log, APP_LOG_WARNING, "frame %s: %s", name, text);
    put_record(state, app_record_error(&state->record, name, text), name);
}

static void release(struct app_state *state, const struct hal_frame *frame)
{
    const struct hal_camera *camera = state->hal.camera;
    camera->release(camera->context, frame);
}

static void skip_frame(struct app_state *state, const struct hal_frame *frame)
{
    state->status.skipped_count++;
    state->live.skipped_count++;
    release(state, frame);
}

/* The laser is on for the whole of an exposure, and an exposure ends within its frame. */
static void exposure_params(const struct app_state *state, struct ih_exposure_params *params)
{
    ih_exposure_params_default(params);
    params->duty_min_q8 = params->duty_max_q8;
    if (params->exposure_max_us > state->frame_time_us) {
        params->exposure_max_us = (int32_t)state->frame_time_us;
    }
}

static bool set_exposure(struct app_state *state)
{
    const struct hal_camera *camera = state->hal.camera;
    struct hal_error error;
    if (camera->set_exposure(camera->context, state->exposure.exposure_us, &error)) {
        return true;
    }
    app_log_say(state->log, APP_LOG_WARNING, "exposure: %s; it stays as it is", error.text);
    return false;
}

static void start_steering(struct app_state *state)
{
    struct ih_exposure_params params;
    state->steers = state->config->exposure == APP_EXPOSURE_STEER;
    if (state->steers) {
        exposure_params(state, &params);
        ih_exposure_start(&params, APP_FRAME_EXPOSURE_US, params.duty_max_q8, &state->exposure);
        state->steers = set_exposure(state);
    }
}

/* With the exposure that the camera had, what the next one should be. */
static void steer(struct app_state *state, const struct hal_frame *frame)
{
    struct ih_exposure_params params;
    struct ih_exposure_look look;
    if (!state->steers) {
        return;
    }
    int32_t before_us = state->exposure.exposure_us;
    exposure_params(state, &params);
    ih_exposure_look(&state->head->dots, &state->head->labels, frame->width, frame->height, &look);
    ih_exposure_next(&params, &look, &state->exposure);
    if (state->exposure.exposure_us != before_us) {
        state->steers = set_exposure(state);
    }
}

/* For whoever waits for a frame in the live view. */
static void show(struct app_state *state, const struct hal_frame *frame)
{
    const struct hal_viewer *viewer = state->hal.viewer;
    struct hal_error error;
    void *room = NULL;
    state->result_count++;
    if (viewer == NULL) {
        return;
    }
    switch (viewer->ask(viewer->context, &room, &error)) {
    case HAL_LOOK_WANTED:
        app_live_put(room, frame, state->head, &state->record, state->result_count);
        viewer->show(viewer->context);
        break;
    case HAL_LOOK_GONE:
        app_log_say(state->log, APP_LOG_WARNING, "view: %s", error.text);
        break;
    case HAL_LOOK_NONE:
        break;
    }
}

/* Labels may move the rig's lines. Frames without a record must not, so that a recording of the others gives the same. */
static void remember_rig(struct app_state *state)
{
    state->align_before = state->head->align;
    state->rig_before = state->head->rig;
}

static void recall_rig(const struct app_state *state)
{
    state->head->align = state->align_before;
    state->head->rig = state->rig_before;
}

/* A lit frame whose labels are there. began_us: when it was taken from the camera. */
static void use_lit(struct app_state *state, const struct hal_frame *frame, int64_t began_us)
{
    struct isohead *head = state->head;
    bool is_fresh = state->has_ambient &&
                    frame->time_us - state->ambient.time_us <= APP_FRAME_AMBIENT_AGE_MAX_US;
    if (is_fresh) {
        struct ih_frame view = app_view_of(frame);
        struct ih_frame ambient = app_view_of(&state->ambient);
        recall_rig(state);
        enum ih_err err = isohead_label(head, &view, &ambient);
        if (err != IH_OK) {
            lose_frame(state, frame->name, ih_err_text(err));
            return;
        }
    }
    isohead_find(head, frame->time_us);
    app_health_frame(state);
    app_recorder_frame(state, frame, true);
    app_status_frame(&state->status, head->dots.dot_count, head->result.head_count,
                     app_state_now_us(state) - began_us);
    put_record(state, app_record_frame(&state->record, frame, head, &state->live), frame->name);
    show(state, frame);
    state->live = (struct app_record_live){.lost_count = 0};
    steer(state, frame);
}

/* Give the frame back, or hold it as the ambient one. */
static void use_dark(struct app_state *state, const struct hal_frame *frame)
{
    bool wanted = !state->config->laser ||
                  (state->config->strobe == APP_STROBE_ALTERNATING && !state->light_wanted);
    if (!wanted) {
        skip_frame(state, frame);
        return;
    }
    if (state->has_ambient) {
        release(state, &state->ambient);
    }
    state->ambient = *frame;
    state->has_ambient = true;
    app_recorder_frame(state, frame, false);
    wish_light(state, true);
}

/* Without a laser of ours the camera knows, or all are lit by something else. */
static enum app_phase_verdict judge(struct app_state *state, const struct hal_frame *frame)
{
    enum app_phase_verdict verdict = frame->laser ? APP_PHASE_LIT : APP_PHASE_DARK;
    if (state->config->laser) {
        verdict = app_phase_judge(&state->phase, state->head->labels.labelled_count,
                                  state->config->strobe != APP_STROBE_ALWAYS, state->on_frames);
    }
    app_laser_frame(&state->laser, app_state_now_us(state));
    return verdict;
}

/* Lit, dark, or neither: and what the laser does next. */
static void use_frame(struct app_state *state, const struct hal_frame *frame)
{
    const enum app_strobe strobe = state->config->strobe;
    int64_t began_us = app_state_now_us(state);
    switch (judge(state, frame)) {
    case APP_PHASE_DARK:
        recall_rig(state);
        use_dark(state, frame);
        break;
    case APP_PHASE_PARTIAL:
        recall_rig(state);
        skip_frame(state, frame);
        break;
    case APP_PHASE_LIT:
        if (strobe == APP_STROBE_ALTERNATING) {
            wish_light(state, false); /* the dark frame is exposed while this one is looked at */
        }
        use_lit(state, frame, began_us);
        release(state, frame);
        if (strobe == APP_STROBE_GATED) {
            state->light_wanted = false; /* the next one is a new episode */
        }
        break;
    }
    if (strobe != APP_STROBE_ALTERNATING) {
        wish_light(state, true);
    }
}

static void count_lost(struct app_state *state, const struct hal_frame *frame)
{
    if (state->sequence >= 0 && frame->sequence > state->sequence + 1) {
        int64_t lost_count = frame->sequence - state->sequence - 1;
        state->live.lost_count += lost_count;
        state->status.lost_count += lost_count;
    }
    state->sequence = frame->sequence;
}

/* No further than it matters: at 1000 frames a second an int32_t is full after 25 days. */
static void count_lit(struct app_state *state)
{
    if (!state->laser.is_on || !state->light_wanted) {
        state->on_frames = 0;
    } else if (state->on_frames <= APP_PHASE_FLIGHT_MAX) {
        state->on_frames++;
    }
}

void app_frame_use(struct app_state *state, const struct hal_frame *frame)
{
    struct ih_frame view = app_view_of(frame);
    struct hal_error error;
    count_lost(state, frame);
    count_lit(state);
    if (state->config->strobe == APP_STROBE_GATED) {
        app_laser_wish(&state->laser, false, app_state_now_us(state));
    }
    if (!state->rig_is_valid) {
        skip_frame(state, frame);
        return;
    }
    remember_rig(state);
    enum ih_err err = isohead_label(state->head, &view, NULL);
    if (err != IH_OK) {
        app_view_explain(frame, &state->head->rig.calibration, err, &error);
        lose_frame(state, frame->name, error.text);
        release(state, frame);
        wish_light(state, true);
        return;
    }
    use_frame(state, frame);
}

void app_frame_skip(struct app_state *state, const struct hal_frame *frame)
{
    count_lost(state, frame);
    skip_frame(state, frame);
}

void app_frame_lose(struct app_state *state, const struct hal_frame *frame, const char *text)
{
    count_lost(state, frame);
    lose_frame(state, frame->name, text);
}

void app_frame_begin(struct app_state *state)
{
    state->sequence = -1;
    app_phase_init(&state->phase);
    start_steering(state);
}

void app_frame_light(struct app_state *state)
{
    state->light_wanted = false;
    wish_light(state, true);
}

void app_frame_forget(struct app_state *state)
{
    if (state->has_ambient) {
        release(state, &state->ambient);
    }
    state->has_ambient = false;
}
