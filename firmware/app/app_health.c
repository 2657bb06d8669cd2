#include "app_health.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "app_text.h"
#include "base/ih_fix.h"

/* A rotation is reported again when it differs by more than this from the last report. */
#define REPORT_RAD_Q30 374802 /* 0.02 degrees */
#define DEG_PER_RAD_Q10 58671
#define MM2_PER_M2 1000000

struct depth_text {
    char text[80];
};

void app_health_begin(struct app_state *state)
{
    ih_health_init(&state->health, &state->head->rig);
    state->reported_health = IH_HEALTH_UNKNOWN;
    memset(state->reported_rotation_rad_q30, 0, sizeof state->reported_rotation_rad_q30);
    state->checked_count = 0;
}

static struct app_decimal degrees(int32_t angle_rad_q30)
{
    return app_text_fixed((int64_t)angle_rad_q30 * DEG_PER_RAD_Q10 / 1024, 30, 3);
}

/* One standard deviation of the rotation as depth at 1 m, in words. */
static struct depth_text depth_uncertainty(const struct app_state *state)
{
    const struct ih_health *health = &state->health;
    const int32_t *origin_mm_q16 = state->head->rig.calibration.origin_mm_q16;
    struct depth_text out = {"the rotation across the baseline is not known, nor is depth"};
    if (health->is_weak_known) {
        int64_t x = origin_mm_q16[0];
        int64_t y = origin_mm_q16[1];
        int64_t baseline_mm_q16 = (int64_t)ih_isqrt_u64((uint64_t)(x * x + y * y)) + 1;
        int64_t sigma_rad_q30 = ih_max_s32(health->sigma_rad_q30[0], health->sigma_rad_q30[1]);
        int64_t depth_mm_q4 = ih_div_round(sigma_rad_q30 * MM2_PER_M2 / 1024, baseline_mm_q16);
        snprintf(out.text, sizeof out.text, "that is %s mm of depth at 1 m",
                 app_text_fixed(depth_mm_q4, 4, 1).text);
    }
    return out;
}

static void report_rotation(struct app_state *state)
{
    const struct ih_health *health = &state->health;
    const int32_t *rotation = health->rotation_rad_q30;
    const int32_t *sigma = health->sigma_rad_q30;
    app_log_say(
        state->log, APP_LOG_WARNING,
        "%s: the projector is rotated by (%s, %s, %s) +-(%s, %s, %s) degrees about X, Y, Z, "
        "%s; corrected for until the end, calibrate again",
        state->config->rig, degrees(rotation[0]).text, degrees(rotation[1]).text,
        degrees(rotation[2]).text, degrees(sigma[0]).text, degrees(sigma[1]).text,
        degrees(sigma[2]).text, depth_uncertainty(state).text);
    memcpy(state->reported_rotation_rad_q30, rotation, sizeof state->reported_rotation_rad_q30);
}

static void report_state(struct app_state *state)
{
    const struct ih_health *health = &state->health;
    switch (health->state) {
    case IH_HEALTH_ROTATED:
        report_rotation(state);
        break;
    case IH_HEALTH_LOST:
        app_log_say(
            state->log, APP_LOG_WARNING,
            "%s: does not fit: of %" PRId32 " dots %" PRId32
            " have a label, and no rotation within 0.6 degrees corrects it; calibrate again",
            state->config->rig, health->dot_count, health->labelled_count);
        break;
    case IH_HEALTH_FITS:
        app_log_say(state->log, APP_LOG_INFO, "%s: fits", state->config->rig);
        break;
    case IH_HEALTH_UNKNOWN:
        break;
    }
    state->reported_health = health->state;
}

static bool is_reported(const struct app_state *state)
{
    const struct ih_health *health = &state->health;
    bool is_same = true;
    for (int i = 0; i < 3; i++) {
        int64_t difference =
            (int64_t)health->rotation_rad_q30[i] - state->reported_rotation_rad_q30[i];
        is_same = is_same && ih_abs_s64(difference) <= REPORT_RAD_Q30;
    }
    return state->reported_health == health->state &&
           (is_same || health->state != IH_HEALTH_ROTATED || health->stage != IH_HEALTH_WATCHING);
}

/* Of this frame; 0: no labels. */
static int32_t mean_across_px_q12(const struct ih_labels *labels)
{
    int64_t sum = 0;
    int32_t count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (labels->dot_of_slot[slot] != IH_NONE) {
            int32_t across = labels->perp_px_q12[slot];
            sum += across < 0 ? -across : across;
            count++;
        }
    }
    return count == 0 ? 0 : (int32_t)((sum + count / 2) / count);
}

/* A rotation that is still on trial is reported, too. */
static const char *word_of(const struct ih_health *health)
{
    const int32_t *rotation = health->rotation_rad_q30;
    if (health->state == IH_HEALTH_LOST) {
        return "lost";
    }
    return rotation[0] != 0 || rotation[1] != 0 || rotation[2] != 0 ? "turned" : NULL;
}

static void check(struct app_state *state)
{
    const struct ih_health *health = &state->health;
    state->checked_count++;
    if (state->checked_count < IH_HEALTH_ENOUGH) {
        return;
    }
    if (health->state == IH_HEALTH_UNKNOWN) {
        app_log_say(state->log, APP_LOG_ERROR,
                    "%s: cannot be determined: of %" PRId32 " dots in the last frames %" PRId32
                    " have a label, expected 200 and more",
                    state->config->rig, health->dot_count, health->labelled_count);
    } else if (health->state == IH_HEALTH_LOST) {
        app_log_say(state->log, APP_LOG_INFO,
                    "%s: checked %" PRId32
                    " frames, it does not fit; no known rotation corrects it",
                    state->config->rig, state->checked_count);
    } else {
        app_log_say(state->log, APP_LOG_INFO,
                    "%s: checked %" PRId32 " frames, %s; dots lie %s px beside their lines; "
                    "a rotation of up to (%s, %s, %s) degrees about X, Y, Z is possible, %s",
                    state->config->rig, state->checked_count,
                    health->state == IH_HEALTH_FITS ? "it fits" : "it does not fit",
                    app_text_fixed(health->across_px_q12, 12, 2).text,
                    degrees(health->sigma_rad_q30[0]).text, degrees(health->sigma_rad_q30[1]).text,
                    degrees(health->sigma_rad_q30[2]).text, depth_uncertainty(state).text);
    }
    app_state_end(state, health->state == IH_HEALTH_FITS ? APP_EXIT_GOOD : APP_EXIT_FAILED);
}

void app_health_frame(struct app_state *state)
{
    struct isohead *head = state->head;
    state->live.across_px_q12 = mean_across_px_q12(&head->labels);
    (void)ih_health_frame(&state->health, &head->dots, &head->labels, &head->rig,
                          &state->health_scratch);
    state->live.rig = word_of(&state->health);
    if (!is_reported(state)) {
        report_state(state);
    }
    if (state->config->check) {
        check(state);
    }
}
