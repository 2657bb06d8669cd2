#include "app_frame.h"

#include "app_health.h"
#include "app_live.h"
#include "app_view.h"

static int64_t now(const struct app_loop *loop)
{
    return loop->hal.clock->now_us(loop->hal.clock->context);
}

static void wish_light(struct app_loop *loop, bool on)
{
    if (on && !loop->light_wanted) {
        loop->on_frames = 0;
    }
    loop->light_wanted = on;
    app_laser_wish(&loop->laser, on && !loop->is_over, now(loop));
}

static void put_record(struct app_loop *loop, bool is_complete, const char *name)
{
    const struct hal_output *output = loop->hal.output;
    struct hal_error error;
    if (loop->config->check) {
        return;
    }
    if (!is_complete) {
        app_log_say(loop->log, APP_LOG_ERROR, "%s: its record is too long", name);
        loop->status.unsent_count++;
        return;
    }
    enum hal_sent sent =
        output->send(output->context, loop->record.text, loop->record.length, &error);
    if (sent == HAL_SENT_NOT) {
        loop->status.unsent_count++;
    } else if (sent == HAL_SENT_NEVER) {
        app_log_say(loop->log, APP_LOG_ERROR, "output: %s", error.text);
        app_loop_end(loop, APP_EXIT_FAILED);
    }
}

static void lose_frame(struct app_loop *loop, const char *name, const char *text)
{
    loop->status.bad_count++;
    app_log_say(loop->log, APP_LOG_WARNING, "frame %s: %s", name, text);
    put_record(loop, app_record_error(&loop->record, name, text), name);
}

static void release(struct app_loop *loop, const struct hal_frame *frame)
{
    const struct hal_camera *camera = loop->hal.camera;
    camera->release(camera->context, frame);
}

static void skip_frame(struct app_loop *loop, const struct hal_frame *frame)
{
    loop->status.skipped_count++;
    loop->live.skipped_count++;
    release(loop, frame);
}

/* The laser is on for the whole of an exposure, and an exposure ends within its frame. */
static void exposure_params(const struct app_loop *loop, struct ih_exposure_params *params)
{
    ih_exposure_params_default(params);
    params->duty_min_q8 = params->duty_max_q8;
    if (params->exposure_max_us > loop->frame_time_us) {
        params->exposure_max_us = (int32_t)loop->frame_time_us;
    }
}

static bool set_exposure(struct app_loop *loop)
{
    const struct hal_camera *camera = loop->hal.camera;
    struct hal_error error;
    if (camera->set_exposure(camera->context, loop->exposure.exposure_us, &error)) {
        return true;
    }
    app_log_say(loop->log, APP_LOG_WARNING, "exposure: %s; it stays as it is", error.text);
    return false;
}

static void start_steering(struct app_loop *loop)
{
    struct ih_exposure_params params;
    loop->steers = loop->config->exposure == APP_EXPOSURE_STEER;
    if (loop->steers) {
        exposure_params(loop, &params);
        ih_exposure_start(&params, APP_LOOP_EXPOSURE_US, params.duty_max_q8, &loop->exposure);
        loop->steers = set_exposure(loop);
    }
}

/* With the exposure that the camera had, what the next one should be. */
static void steer(struct app_loop *loop, const struct hal_frame *frame)
{
    struct ih_exposure_params params;
    struct ih_exposure_look look;
    if (!loop->steers) {
        return;
    }
    int32_t before_us = loop->exposure.exposure_us;
    exposure_params(loop, &params);
    ih_exposure_look(&loop->head->dots, &loop->head->labels, frame->width, frame->height, &look);
    ih_exposure_next(&params, &look, &loop->exposure);
    if (loop->exposure.exposure_us != before_us) {
        loop->steers = set_exposure(loop);
    }
}

/* For whoever waits for a frame in the live view. */
static void show(struct app_loop *loop, const struct hal_frame *frame)
{
    const struct hal_viewer *viewer = loop->hal.viewer;
    struct hal_error error;
    void *room = NULL;
    loop->result_count++;
    if (viewer == NULL) {
        return;
    }
    switch (viewer->ask(viewer->context, &room, &error)) {
    case HAL_LOOK_WANTED:
        app_live_put(room, frame, loop->head, &loop->record, loop->result_count);
        viewer->show(viewer->context);
        break;
    case HAL_LOOK_GONE:
        app_log_say(loop->log, APP_LOG_WARNING, "view: %s", error.text);
        break;
    case HAL_LOOK_NONE:
        break;
    }
}

/* A lit frame whose labels are there: the rest of it. began_us: when it was taken from the camera. */
static void use_lit(struct app_loop *loop, const struct hal_frame *frame, int64_t began_us)
{
    struct isohead *head = loop->head;
    bool is_fresh =
        loop->has_ambient && frame->time_us - loop->ambient.time_us <= APP_LOOP_AMBIENT_AGE_MAX_US;
    if (is_fresh) {
        struct ih_frame view = app_view_of(frame);
        struct ih_frame ambient = app_view_of(&loop->ambient);
        enum ih_err err = isohead_label(head, &view, &ambient);
        if (err != IH_OK) {
            lose_frame(loop, frame->name, ih_err_text(err));
            return;
        }
    }
    isohead_find(head, frame->time_us);
    app_health_frame(loop);
    app_status_frame(&loop->status, head->dots.dot_count, head->result.head_count,
                     now(loop) - began_us);
    put_record(loop, app_record_frame(&loop->record, frame, head, &loop->live), frame->name);
    show(loop, frame);
    loop->live = (struct app_record_live){.lost_count = 0};
    steer(loop, frame);
}

/* Give the frame back, or hold it as the ambient one. */
static void use_dark(struct app_loop *loop, const struct hal_frame *frame)
{
    bool wanted = loop->config->strobe == APP_STROBE_ALTERNATING && !loop->light_wanted;
    if (!wanted) {
        skip_frame(loop, frame);
        return;
    }
    if (loop->has_ambient) {
        release(loop, &loop->ambient);
    }
    loop->ambient = *frame;
    loop->has_ambient = true;
    wish_light(loop, true);
}

static enum app_phase_verdict judge(struct app_loop *loop)
{
    if (!loop->config->laser) {
        return APP_PHASE_LIT;
    }
    return app_phase_judge(&loop->phase, loop->head->labels.labelled_count,
                           loop->config->strobe != APP_STROBE_ALWAYS, loop->on_frames);
}

/* Lit, dark, or neither: and what the laser does next. */
static void use_frame(struct app_loop *loop, const struct hal_frame *frame)
{
    const enum app_strobe strobe = loop->config->strobe;
    int64_t began_us = now(loop);
    switch (judge(loop)) {
    case APP_PHASE_DARK:
        use_dark(loop, frame);
        break;
    case APP_PHASE_PARTIAL:
        skip_frame(loop, frame);
        break;
    case APP_PHASE_LIT:
        if (strobe == APP_STROBE_ALTERNATING) {
            wish_light(loop, false); /* the dark frame is exposed while this one is looked at */
        }
        use_lit(loop, frame, began_us);
        release(loop, frame);
        if (strobe == APP_STROBE_GATED) {
            loop->light_wanted = false; /* the next one is a new episode */
        }
        break;
    }
    if (strobe != APP_STROBE_ALTERNATING) {
        wish_light(loop, true);
    }
}

static void count_lost(struct app_loop *loop, const struct hal_frame *frame)
{
    if (loop->sequence >= 0 && frame->sequence > loop->sequence + 1) {
        int64_t lost_count = frame->sequence - loop->sequence - 1;
        loop->live.lost_count += lost_count;
        loop->status.lost_count += lost_count;
    }
    loop->sequence = frame->sequence;
}

/* No further than it matters: at 1000 frames a second an int32_t is full after 25 days. */
static void count_lit(struct app_loop *loop)
{
    if (!loop->laser.is_on || !loop->light_wanted) {
        loop->on_frames = 0;
    } else if (loop->on_frames <= APP_PHASE_FLIGHT_MAX) {
        loop->on_frames++;
    }
}

void app_frame_use(struct app_loop *loop, const struct hal_frame *frame)
{
    struct ih_frame view = app_view_of(frame);
    struct hal_error error;
    count_lost(loop, frame);
    count_lit(loop);
    if (loop->config->strobe == APP_STROBE_GATED) {
        app_laser_wish(&loop->laser, false, now(loop));
    }
    if (!loop->rig_is_valid) {
        skip_frame(loop, frame);
        return;
    }
    enum ih_err err = isohead_label(loop->head, &view, NULL);
    if (err != IH_OK) {
        app_view_explain(frame, &loop->head->rig.calibration, err, &error);
        lose_frame(loop, frame->name, error.text);
        release(loop, frame);
        wish_light(loop, true);
        return;
    }
    use_frame(loop, frame);
}

void app_frame_skip(struct app_loop *loop, const struct hal_frame *frame)
{
    count_lost(loop, frame);
    skip_frame(loop, frame);
}

void app_frame_lose(struct app_loop *loop, const struct hal_frame *frame, const char *text)
{
    count_lost(loop, frame);
    lose_frame(loop, frame->name, text);
}

void app_frame_begin(struct app_loop *loop)
{
    loop->sequence = -1;
    app_phase_init(&loop->phase);
    start_steering(loop);
}

void app_frame_light(struct app_loop *loop)
{
    loop->light_wanted = false;
    wish_light(loop, true);
}

void app_frame_forget(struct app_loop *loop)
{
    if (loop->has_ambient) {
        release(loop, &loop->ambient);
    }
    loop->has_ambient = false;
}
