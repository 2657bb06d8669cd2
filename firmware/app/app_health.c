#include "app_health.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "app_rig_text.h"
#include "app_text.h"
#include "base/ih_fix.h"

/* A rig that moved is reported again when one of its moves differs by more than this from the last report. */
#define REPORT_RAD_Q30 937007 /* 0.05 degrees */
/* Farther than this from the mean of the last frames: not by heat. */
#define KNOCK_RAD_Q30 468504 /* 0.025 degrees */
/* As much as 0.05 degrees are 0.2 % of focal length, and 0.5 px. */
#define FOCAL_PERCENT 44
#define SHIFT_FACTOR 457
#define MEAN_SHIFT 5 /* about 32 frames */
/* What no rotation explains. */
#define ACROSS_MAX_PX_Q12 819 /* 0.2 px */
#define DEGREE_DECIMALS 3

struct health_text {
    char text[128];
};

/* Between two unit vectors. */
static int32_t angle_mdeg(const int32_t a_q30[3], const int32_t b_q30[3])
{
    int64_t along_q30 = 0;
    uint64_t across2_q60 = 0;
    for (int i = 0; i < 3; i++) {
        const int k = (i + 1) % 3;
        const int64_t across_q30 =
            ih_shift_round((int64_t)a_q30[i] * b_q30[k] - (int64_t)a_q30[k] * b_q30[i], 30);
        along_q30 += ih_shift_round((int64_t)a_q30[i] * b_q30[i], 30);
        across2_q60 += (uint64_t)(across_q30 * across_q30);
    }
    return ih_atan2_mdeg(ih_isqrt_u64(across2_q60), along_q30);
}

void app_health_up(const struct app_state *state, struct ih_calibration *calibration)
{
    const int32_t *measured = state->measured_up_q30;
    const int32_t *own = calibration->up_q30;
    if (measured == NULL) {
        return;
    }
    if (own[0] == 0 && own[1] == 0 && own[2] == 0) {
        memcpy(calibration->up_q30, measured, sizeof calibration->up_q30);
        app_log_say(state->log, APP_LOG_INFO, "%s: has no up, the accelerometer's is used",
                    state->config->rig);
    } else if (angle_mdeg(own, measured) > APP_HEALTH_UP_MDEG) {
        app_log_say(state->log, APP_LOG_WARNING,
                    "%s: its up is %s; by the accelerometer it is %s: %s degrees from it, at most "
                    "%s are good. Does the camera hang otherwise now? The rig's is used",
                    state->config->rig, app_rig_up_text(own).text, app_rig_up_text(measured).text,
                    app_text_direction(angle_mdeg(own, measured)).text,
                    app_text_direction(APP_HEALTH_UP_MDEG).text);
    }
}

void app_health_begin(struct app_state *state)
{
    memset(&state->health, 0, sizeof state->health);
    state->health.lit_us = app_state_now_us(state);
}

static struct health_text xyz_text(const int32_t angle_rad_q30[3])
{
    struct health_text out;
    snprintf(out.text, sizeof out.text, "(%s, %s, %s)",
             app_text_degrees(angle_rad_q30[0], DEGREE_DECIMALS).text,
             app_text_degrees(angle_rad_q30[1], DEGREE_DECIMALS).text,
             app_text_degrees(angle_rad_q30[2], DEGREE_DECIMALS).text);
    return out;
}

/* One standard deviation of the rotation that is depth, as depth at 1 m. */
static struct health_text depth_text(const struct isohead *head)
{
    const struct ih_alignment *now = &head->align.now;
    struct health_text out = {"depth is not known, as too few dots show it"};
    if (now->is_depth_known) {
        snprintf(out.text, sizeof out.text, "depth is known to +-%s mm at 1 m",
                 app_text_fixed(app_rig_depth_mm_q8(head), 8, 1).text);
    }
    return out;
}

/* Rotation, change of focal length and shift, as if all of them were angles. */
static void moves_of(const struct ih_alignment *now, int32_t moves_rad_q30[APP_HEALTH_MOVES])
{
    memcpy(moves_rad_q30, now->rotation_rad_q30, sizeof now->rotation_rad_q30);
    moves_rad_q30[3] = (int32_t)((int64_t)now->focal_q30 * FOCAL_PERCENT / 100);
    for (int i = 0; i < 2; i++) {
        moves_rad_q30[4 + i] = ih_saturate_s32((int64_t)now->shift_px_q12[i] * SHIFT_FACTOR);
    }
}

static bool is_near(const struct ih_alignment *now, const int32_t then_rad_q30[APP_HEALTH_MOVES],
                    int32_t max_rad_q30)
{
    int32_t now_rad_q30[APP_HEALTH_MOVES];
    bool is_near = true;
    moves_of(now, now_rad_q30);
    for (int i = 0; i < APP_HEALTH_MOVES; i++) {
        is_near = is_near && ih_abs_s64((int64_t)now_rad_q30[i] - then_rad_q30[i]) <= max_rad_q30;
    }
    return is_near;
}

static void report_moved(const struct app_state *state)
{
    const struct app_health *health = &state->health;
    const struct ih_alignment *now = &state->head->align.now;
    const char *how = "slowly, as heat does it";
    const char *advice = "calibrate again if it stays so";
    if (health->frame_count < 2 << MEAN_SHIFT) {
        how = "since its calibration";
        advice = "calibrate again when you can";
    } else if (!is_near(now, health->mean_rad_q30, KNOCK_RAD_Q30)) {
        how = "at once, as a knock does it";
        advice = "calibrate again when you can";
    }
    if (now->across_px_q12 > ACROSS_MAX_PX_Q12) {
        advice = "dots still lie beside their lines: calibrate again before you trust a head";
    }
    app_log_say(
        state->log, APP_LOG_WARNING,
        "%s: the rig has moved %s: its projector by %s +-%s degrees about X, Y, Z, "
        "its focal length by %s %%, its picture by (%s, %s) px; %s; corrected for in memory, %s",
        state->config->rig, how, xyz_text(now->rotation_rad_q30).text,
        xyz_text(now->sigma_rad_q30).text,
        app_text_fixed((int64_t)now->focal_q30 * 100, 30, 2).text,
        app_text_fixed(now->shift_px_q12[0], 12, 2).text,
        app_text_fixed(now->shift_px_q12[1], 12, 2).text, depth_text(state->head).text, advice);
}

static void report(struct app_state *state)
{
    const struct ih_alignment *now = &state->head->align.now;
    switch (now->state) {
    case IH_ALIGN_MOVED:
        report_moved(state);
        break;
    case IH_ALIGN_LOST:
        app_log_say(state->log, APP_LOG_WARNING,
                    "%s: does not fit: of %" PRId32 " dots %" PRId32
                    " have a label, the others lie on no lines of this rig. Is it the file of "
                    "this camera and laser? Then they have moved too far: calibrate again",
                    state->config->rig, state->head->dots.dot_count,
                    state->head->labels.labelled_count);
        break;
    case IH_ALIGN_FITS:
        app_log_say(state->log, APP_LOG_INFO, "%s: fits", state->config->rig);
        break;
    case IH_ALIGN_UNKNOWN:
        break;
    }
    state->health.reported_state = now->state;
    moves_of(now, state->health.reported_rad_q30);
}

/* Frames that say the same, one after the other, and the mean of what they say. */
static void follow(struct app_health *health, const struct ih_alignment *now)
{
    int32_t moves_rad_q30[APP_HEALTH_MOVES];
    health->steady_count = now->state == health->last_state ? health->steady_count + 1 : 1;
    health->steady_count = ih_min_s32(health->steady_count, APP_HEALTH_STEADY);
    health->last_state = now->state;
    health->frame_count = ih_min_s32(health->frame_count + 1, INT32_MAX - 1);
    moves_of(now, moves_rad_q30);
    for (int i = 0; i < APP_HEALTH_MOVES; i++) {
        int64_t difference = (int64_t)moves_rad_q30[i] - health->mean_rad_q30[i];
        health->mean_rad_q30[i] += (int32_t)(difference / (1 << MEAN_SHIFT));
    }
}

static bool is_reported(const struct app_health *health, const struct ih_alignment *now)
{
    bool has_moved_on =
        now->state == IH_ALIGN_MOVED && !is_near(now, health->reported_rad_q30, REPORT_RAD_Q30);
    return now->state == health->reported_state && !has_moved_on;
}

/* The answer of --check, after its last frame. */
static void check(struct app_state *state)
{
    const struct isohead *head = state->head;
    const struct ih_alignment *now = &head->align.now;
    if (now->state == IH_ALIGN_UNKNOWN) {
        app_log_say(state->log, APP_LOG_ERROR,
                    "%s: cannot be determined: of %" PRId32 " dots in the last frame %" PRId32
                    " have a label, expected 200 and more",
                    state->config->rig, head->dots.dot_count, head->labels.labelled_count);
    } else if (now->state == IH_ALIGN_LOST) {
        app_log_say(state->log, APP_LOG_INFO,
                    "%s: checked %" PRId32 " frames, it does not fit, and nothing within the "
                    "limits corrects it; calibrate again",
                    state->config->rig, state->health.frame_count);
    } else {
        app_log_say(state->log, APP_LOG_INFO,
                    "%s: checked %" PRId32 " frames, %s; the projector's rotation is %s +-%s "
                    "degrees about X, Y, Z; dots lie %s px beside their lines; %s",
                    state->config->rig, state->health.frame_count,
                    now->state == IH_ALIGN_FITS ? "it fits" : "it has moved: calibrate again",
                    xyz_text(now->rotation_rad_q30).text, xyz_text(now->sigma_rad_q30).text,
                    app_text_fixed(now->across_px_q12, 12, 2).text, depth_text(head).text);
    }
    app_state_end(state, now->state == IH_ALIGN_FITS ? APP_EXIT_GOOD : APP_EXIT_FAILED);
}

void app_health_frame(struct app_state *state)
{
    struct app_health *health = &state->health;
    const struct ih_alignment *now = &state->head->align.now;
    follow(health, now);
    health->lit_us = app_state_now_us(state);
    if (health->steady_count == APP_HEALTH_STEADY && !is_reported(health, now)) {
        report(state);
    }
    if (state->config->check && health->frame_count == APP_HEALTH_CHECKED) {
        check(state);
    }
}

void app_health_tick(struct app_state *state)
{
    const struct app_health *health = &state->health;
    if (!state->config->check || state->is_over ||
        app_state_now_us(state) - health->lit_us < APP_HEALTH_WAIT_US) {
        return;
    }
    app_log_say(state->log, APP_LOG_ERROR,
                "%s: cannot be determined: no lit frame for %d s, after %" PRId32 " of %d; is the "
                "camera there, and the laser allowed?",
                state->config->rig, APP_HEALTH_WAIT_US / 1000000, health->frame_count,
                APP_HEALTH_CHECKED);
    app_state_end(state, APP_EXIT_FAILED);
}
