#include "app_recorder.h"

#include <inttypes.h>
#include <stdio.h>

#define SECOND_US INT64_C(1000000)

void app_recorder_begin(struct app_state *state)
{
    const struct hal_recorder *recorder = state->hal.recorder;
    state->recording = (struct app_recording){
        .head_us = app_state_now_us(state),
        .waits_for_head = false,
        .writes = state->config->record_when == APP_RECORD_ALWAYS,
        .reported_state = state->health.reported_state,
    };
    if (recorder != NULL && state->recording.writes) {
        recorder->write(recorder->context, true);
    }
}

/* From now on, or for longer. */
static void write(struct app_state *state, const char *why)
{
    struct app_recording *recording = &state->recording;
    const struct hal_recorder *recorder = state->hal.recorder;
    const int32_t seconds = state->config->record_s;
    if (state->config->record_when == APP_RECORD_ALWAYS) {
        return;
    }
    app_log_say(state->log, APP_LOG_INFO,
                "record: %s: the last %" PRId32 " s and the next %" PRId32 " s are written", why,
                seconds, seconds);
    recording->until_us = app_state_now_us(state) + seconds * SECOND_US;
    recording->writes = true;
    recorder->write(recorder->context, true);
}

static void look_for_head(struct app_state *state)
{
    struct app_recording *recording = &state->recording;
    const int64_t now_us = app_state_now_us(state);
    const int32_t max_s = state->config->record_no_head_s;
    if (state->head->result.head_count > 0) {
        recording->head_us = now_us;
        recording->waits_for_head = false;
    } else if (!recording->waits_for_head && now_us - recording->head_us >= max_s * SECOND_US) {
        char why[64];
        recording->waits_for_head = true;
        snprintf(why, sizeof why, "no head for %" PRId32 " s", max_s);
        write(state, why);
    }
}

static void look_at_rig(struct app_state *state)
{
    struct app_recording *recording = &state->recording;
    const enum ih_align_state now = state->health.reported_state;
    if (now != recording->reported_state && (now == IH_ALIGN_MOVED || now == IH_ALIGN_LOST)) {
        write(state, now == IH_ALIGN_MOVED ? "the rig has moved" : "the rig does not fit");
    }
    recording->reported_state = now;
}

void app_recorder_frame(struct app_state *state, const struct hal_frame *frame, bool lit)
{
    const struct hal_recorder *recorder = state->hal.recorder;
    if (recorder == NULL) {
        return;
    }
    if (!recorder->keep(recorder->context, frame, lit)) {
        state->status.unrecorded_count++;
        app_log_say(state->log, APP_LOG_WARNING,
                    "record: frame %s is lost: the disk does not keep up", frame->name);
    }
    if (lit && state->config->record_when == APP_RECORD_NO_HEAD) {
        look_for_head(state);
    } else if (lit && state->config->record_when == APP_RECORD_MOVED) {
        look_at_rig(state);
    }
}

void app_recorder_request(struct app_state *state)
{
    if (state->hal.recorder != NULL) {
        write(state, "requested");
    }
}

void app_recorder_rig(struct app_state *state)
{
    const struct hal_recorder *recorder = state->hal.recorder;
    if (recorder != NULL) {
        recorder->rig(recorder->context);
        state->recording.reported_state = IH_ALIGN_UNKNOWN;
    }
}

void app_recorder_tick(struct app_state *state)
{
    struct app_recording *recording = &state->recording;
    const struct hal_recorder *recorder = state->hal.recorder;
    struct hal_error error;
    if (recorder == NULL) {
        return;
    }
    if (recorder->news(recorder->context, &error)) {
        app_log_say(state->log, APP_LOG_WARNING, "record: %s", error.text);
    }
    const bool ends = state->config->record_when != APP_RECORD_ALWAYS &&
                      app_state_now_us(state) >= recording->until_us;
    if (recording->writes && ends) {
        recording->writes = false;
        recorder->write(recorder->context, false);
    }
}
