#include "app_health.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "app_text.h"
#include "base/ih_fix.h"

/* A turn that differs by more than this from what was told is told again. */
#define TOLD_RAD_Q30 374802 /* 0.02 degrees */
#define DEG_PER_RAD_Q10 58671
#define MM2_PER_M2 1000000

struct depth_text {
    char text[80];
};

void app_health_begin(struct app_state *state)
{
    ih_health_init(&state->health, &state->head->rig);
    state->told_health = IH_HEALTH_UNKNOWN;
    memset(state->told_turn_rad_q30, 0, sizeof state->told_turn_rad_q30);
    state->checked_count = 0;
}

static struct app_decimal degrees(int32_t angle_rad_q30)
{
    return app_text_fixed((int64_t)angle_rad_q30 * DEG_PER_RAD_Q10 / 1024, 30, 3);
}

/* What one standard deviation of the turn is in depth at 1 m, in words. */
static struct depth_text depth_doubt(const struct app_state *state)
{
    const struct ih_health *health = &state->health;
    const int32_t *origin_mm_q16 = state->head->rig.calibration.origin_mm_q16;
    struct depth_text out = {"the turn across the baseline is not known, nor is depth"};
    if (health->is_weak_known) {
        int64_t x = origin_mm_q16[0];
        int64_t y = origin_mm_q16[1];
        int64_t baseline_mm_q16 = (int64_t)ih_isqrt_u64((uint64_t)(x * x + y * y)) + 1;
        int64_t turn_rad_q30 = ih_max_s32(health->sigma_rad_q30[0], health->sigma_rad_q30[1]);
        int64_t depth_mm_q4 = ih_div_round(turn_rad_q30 * MM2_PER_M2 / 1024, baseline_mm_q16);
        snprintf(out.text, sizeof out.text, "that is %s mm of depth at 1 m",
                 app_text_fixed(depth_mm_q4, 4, 1).text);
    }
    return out;
}

static void tell_turn(struct app_state *state)
{
    const struct ih_health *health = &state->health;
    const int32_t *turn = health->turn_rad_q30;
    const int32_t *sigma = health->sigma_rad_q30;
    app_log_say(state->log, APP_LOG_WARNING,
                "%s: the projector is turned by (%s, %s, %s) +-(%s, %s, %s) degrees about X, Y, Z, "
                "%s; corrected for until the end, calibrate again",
                state->config->rig, degrees(turn[0]).text, degrees(turn[1]).text,
                degrees(turn[2]).text, degrees(sigma[0]).text, degrees(sigma[1]).text,
                degrees(sigma[2]).text, depth_doubt(state).text);
    memcpy(state->told_turn_rad_q30, turn, sizeof state->told_turn_rad_q30);
}

static void tell_state(struct app_state *state)
{
    const struct ih_health *health = &state->health;
    switch (health->state) {
    case IH_HEALTH_TURNED:
        tell_turn(state);
        break;
    case IH_HEALTH_LOST:
        app_log_say(state->log, APP_LOG_WARNING,
                    "%s: does not fit: of %" PRId32 " dots %" PRId32
                    " have a label, and no turn within 0.6 degrees mends it; calibrate again",
                    state->config->rig, health->dot_count, health->labelled_count);
        break;
    case IH_HEALTH_FITS:
        app_log_say(state->log, APP_LOG_INFO, "%s: fits", state->config->rig);
        break;
    case IH_HEALTH_UNKNOWN:
        break;
    }
    state->told_health = health->state;
}

static bool is_told(const struct app_state *state)
{
    const struct ih_health *health = &state->health;
    bool same_turn = true;
    for (int i = 0; i < 3; i++) {
        int64_t more = (int64_t)health->turn_rad_q30[i] - state->told_turn_rad_q30[i];
        same_turn = same_turn && more <= TOLD_RAD_Q30 && more >= -TOLD_RAD_Q30;
    }
    return state->told_health == health->state &&
           (same_turn || health->state != IH_HEALTH_TURNED || health->stage != IH_HEALTH_WATCHING);
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

/* A turn that is still on trial is told, too. */
static const char *word_of(const struct ih_health *health)
{
    const int32_t *turn = health->turn_rad_q30;
    if (health->state == IH_HEALTH_LOST) {
        return "lost";
    }
    return turn[0] != 0 || turn[1] != 0 || turn[2] != 0 ? "turned" : NULL;
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
                    "%s: cannot be told: of %" PRId32 " dots in the last frames %" PRId32
                    " have a label, expected 200 and more",
                    state->config->rig, health->dot_count, health->labelled_count);
    } else if (health->state == IH_HEALTH_LOST) {
        app_log_say(state->log, APP_LOG_INFO,
                    "%s: checked %" PRId32
                    " frames, it does not fit; no turn is known that mends it",
                    state->config->rig, state->checked_count);
    } else {
        app_log_say(state->log, APP_LOG_INFO,
                    "%s: checked %" PRId32 " frames, %s; dots lie %s px beside their lines; "
                    "of a turn (%s, %s, %s) degrees about X, Y, Z may be left, %s",
                    state->config->rig, state->checked_count,
                    health->state == IH_HEALTH_FITS ? "it fits" : "it does not fit",
                    app_text_fixed(health->across_px_q12, 12, 2).text,
                    degrees(health->sigma_rad_q30[0]).text, degrees(health->sigma_rad_q30[1]).text,
                    degrees(health->sigma_rad_q30[2]).text, depth_doubt(state).text);
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
    if (!is_told(state)) {
        tell_state(state);
    }
    if (state->config->check) {
        check(state);
    }
}
