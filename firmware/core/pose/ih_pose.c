#include "pose/ih_pose.h"

#include <stdbool.h>
#include <stddef.h>

#include "base/ih_fix.h"
#include "rig/ih_level.h"

/* A belief that has spread so far says nothing any more. */
#define STEPS_MAX 12

/* How often a head turns to -X, hardly, and to +X before anything is known of it. */
static const uint16_t rate_prior_q16[IH_POSE_RATES] = {15664, 34208, 15664};

void ih_pose_params_default(struct ih_pose_params *params)
{
    *params = (struct ih_pose_params){
        .points_min = 16,
        .yaw = {.follow_q8 = 154, .leak_q16 = 6554, .side_q16 = 6554},
        .pitch = {.follow_q8 = 90, .leak_q16 = 16384, .side_q16 = 13107},
        .step_us = 25000,
        .rate_q16 = 16384, /* 150 degrees a second */
        .rate_side_q16 = 3277,
        .span = 2,
        .known_min_q16 = 53740, /* 0.82 */
        .sigma_max_mdeg = 22000,
        .yaw_sigma_mdeg = 4000,
        .pitch_sigma_mdeg = 2000,
    };
}

static int32_t yaw_prior_q16(int32_t rate, int32_t yaw)
{
    return (int32_t)ih_mul_shift(ih_pose_prior_q16[yaw], rate_prior_q16[rate], 16);
}

void ih_pose_begin(int32_t track_id, int64_t time_us, struct ih_pose_belief *out)
{
    out->track_id = track_id;
    out->time_us = time_us;
    for (int32_t rate = 0; rate < IH_POSE_RATES; rate++) {
        for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
            out->yaw_q16[rate * IH_POSE_YAWS + i] = (uint16_t)yaw_prior_q16(rate, i);
        }
    }
    for (int32_t i = 0; i < IH_POSE_PITCHES; i++) {
        out->pitch_q16[i] = ih_pose_prior_q16[IH_POSE_YAWS + i];
    }
}

/* A line of cells, `stride` apart. */
struct cells {
    uint16_t *cell_q16;
    int32_t count, stride;
    bool is_ring; /* else it has ends */
};

/* One step of spreading: so much of each cell goes to the one after it, and to the one before. */
static void spread(const struct cells *cells, int64_t forth_q16, int64_t back_q16)
{
    uint16_t *cell_q16 = cells->cell_q16;
    const int32_t first = cell_q16[0];
    int32_t before = cells->is_ring ? cell_q16[(cells->count - 1) * cells->stride] : first;
    for (int32_t i = 0; i < cells->count; i++) {
        const int32_t at = i * cells->stride;
        const int32_t here = cell_q16[at];
        const int32_t end = cells->is_ring ? first : here;
        const int32_t after = i + 1 < cells->count ? cell_q16[at + cells->stride] : end;
        const int64_t gained_q32 =
            ((int64_t)before - here) * forth_q16 + ((int64_t)after - here) * back_q16;
        cell_q16[at] = (uint16_t)(here + ih_shift_round(gained_q32, 16));
        before = here;
    }
}

/* The sum is 1 again: roundings add up. */
static void normalise(uint16_t *cell_q16, int32_t count)
{
    int64_t sum = 0;
    for (int32_t i = 0; i < count; i++) {
        sum += cell_q16[i];
    }
    for (int32_t i = 0; i < count && sum > 0; i++) {
        const int64_t part_q16 = ih_div_round((int64_t)cell_q16[i] * 65536, sum);
        cell_q16[i] = (uint16_t)ih_min_s64(part_q16, UINT16_MAX);
    }
}

/* Both in Q16. */
static void mix(uint16_t *cell, int64_t with, int32_t part)
{
    *cell = (uint16_t)(*cell + ih_mul_shift(with - *cell, part, 16));
}

static void leak(struct ih_pose_belief *belief, const struct ih_pose_params *params)
{
    for (int32_t rate = 0; rate < IH_POSE_RATES; rate++) {
        for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
            mix(&belief->yaw_q16[rate * IH_POSE_YAWS + i], yaw_prior_q16(rate, i),
                params->yaw.leak_q16);
        }
    }
    for (int32_t i = 0; i < IH_POSE_PITCHES; i++) {
        mix(&belief->pitch_q16[i], ih_pose_prior_q16[IH_POSE_YAWS + i], params->pitch.leak_q16);
    }
    normalise(belief->yaw_q16, IH_POSE_RATES * IH_POSE_YAWS);
    normalise(belief->pitch_q16, IH_POSE_PITCHES);
}

/* So much of a step's spreading, and of how far a turn goes in a step. */
static void spread_all(struct ih_pose_belief *belief, const struct ih_pose_params *params,
                       int64_t step_q16)
{
    const int64_t yaw_q16 = ih_mul_shift(params->yaw.side_q16, step_q16, 16);
    const int64_t pitch_q16 = ih_mul_shift(params->pitch.side_q16, step_q16, 16);
    const int64_t rate_q16 = ih_mul_shift(params->rate_side_q16, step_q16, 16);
    const int64_t rotated_q16 = ih_mul_shift(params->rate_q16, step_q16, 16);
    for (int32_t rate = 0; rate < IH_POSE_RATES; rate++) {
        const struct cells yaws = {&belief->yaw_q16[rate * IH_POSE_YAWS], IH_POSE_YAWS, 1, true};
        spread(&yaws, yaw_q16 + (rate == IH_POSE_RATES - 1 ? rotated_q16 : 0),
               yaw_q16 + (rate == 0 ? rotated_q16 : 0));
    }
    for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
        const struct cells rates = {&belief->yaw_q16[i], IH_POSE_RATES, IH_POSE_YAWS, false};
        spread(&rates, rate_q16, rate_q16);
    }
    const struct cells pitches = {belief->pitch_q16, IH_POSE_PITCHES, 1, false};
    spread(&pitches, pitch_q16, pitch_q16);
}

void ih_pose_wait(struct ih_pose_belief *belief, const struct ih_pose_params *params,
                  int64_t time_us)
{
    const int64_t passed_us =
        ih_clamp_s64(time_us - belief->time_us, (int64_t)STEPS_MAX * params->step_us);
    const int64_t steps = (passed_us + params->step_us - 1) / params->step_us;
    for (int64_t i = 0; i < steps; i++) {
        /* All steps are alike, and together of the time that has passed. */
        spread_all(belief, params, ih_div_round(passed_us * 65536, steps * params->step_us));
    }
    leak(belief, params);
    belief->time_us = time_us;
}

static int32_t max_of(const int32_t *value, int32_t count)
{
    int32_t max = value[0];
    for (int32_t i = 1; i < count; i++) {
        max = ih_max_s32(max, value[i]);
    }
    return max;
}

/* Multiply by the likelihoods to a power, relative to the largest; the sum is 1 again. Cells are `rows` times as many. */
static void multiply(uint16_t *cell_q16, int32_t rows, const int32_t *log2_q10, int32_t count,
                     int32_t power_q8)
{
    const int32_t max = max_of(log2_q10, count);
    for (int32_t i = 0; i < count; i++) {
        const int64_t below_q16 = ((int64_t)max - log2_q10[i]) * power_q8 >> 2;
        const int64_t times_q16 = ih_power_q16(below_q16);
        for (int32_t row = 0; row < rows; row++) {
            uint16_t *cell = &cell_q16[row * count + i];
            *cell = (uint16_t)ih_mul_shift(*cell, times_q16, 16);
        }
    }
    normalise(cell_q16, rows * count);
}

void ih_pose_learn(struct ih_pose_belief *belief, const struct ih_pose_likelihood *likelihood,
                   int32_t yaw_power_q8, int32_t pitch_power_q8)
{
    multiply(belief->yaw_q16, IH_POSE_RATES, likelihood->log2_q10, IH_POSE_YAWS, yaw_power_q8);
    multiply(belief->pitch_q16, 1, &likelihood->log2_q10[IH_POSE_YAWS], IH_POSE_PITCHES,
             pitch_power_q8);
}

/* Mean and variance of probabilities at steps from the first one. */
struct moments {
    int64_t sum_q16, mean_mdeg, variance_mdeg2;
};

static struct moments moments_of(const int32_t *cell_q16, int32_t first, int32_t count,
                                 int32_t ring, int32_t step_mdeg)
{
    struct moments out = {0};
    int64_t sum = 0;
    for (int32_t i = 0; i < count; i++) {
        out.sum_q16 += cell_q16[(first + i) % ring];
        sum += (int64_t)cell_q16[(first + i) % ring] * i * step_mdeg;
    }
    if (out.sum_q16 == 0) {
        return out;
    }
    out.mean_mdeg = ih_div_round(sum, out.sum_q16);
    sum = 0;
    for (int32_t i = 0; i < count; i++) {
        const int64_t away = (int64_t)i * step_mdeg - out.mean_mdeg;
        sum += cell_q16[(first + i) % ring] * (away * away);
    }
    out.variance_mdeg2 = ih_div_round(sum, out.sum_q16);
    return out;
}

static int32_t wrap_mdeg(int64_t angle_mdeg)
{
    const int64_t rotated = angle_mdeg % 360000;
    return (int32_t)(rotated > 180000     ? rotated - 360000
                     : rotated <= -180000 ? rotated + 360000
                                          : rotated);
}

/* A vector turned by an angle within half a circle, from +x towards +y; 1.65 times as long. CORDIC in rotation mode. */
static void rotate(int64_t *x, int64_t *y, int32_t angle_mdeg)
{
    int64_t angle_udeg = (int64_t)angle_mdeg * 1000;
    if (angle_mdeg > 90000 || angle_mdeg < -90000) {
        angle_udeg += angle_mdeg > 0 ? -180000000 : 180000000;
        *x = -*x;
        *y = -*y;
    }
    for (int i = 0; i < IH_ATAN_STEPS; i++) {
        const int64_t x_part = *x >> i;
        const int64_t y_part = *y >> i;
        const bool is_left = angle_udeg > 0;
        *x += is_left ? -y_part : y_part;
        *y += is_left ? x_part : -x_part;
        angle_udeg += is_left ? -ih_atan_udeg[i] : ih_atan_udeg[i];
    }
}

/* From the level frame to the camera's, which has other axes where it does not hang level. */
static void look_back(const struct ih_rig *rig, struct ih_head_pose *pose)
{
    int64_t ahead = 1 << 24; /* along the level, then towards the camera */
    int64_t up = 0;
    int64_t aside = 0;
    rotate(&ahead, &up, pose->pitch_mdeg);
    rotate(&ahead, &aside, pose->yaw_mdeg);
    /* Only what lies on the level has been rotated twice, and is 1.6468 times longer for it. */
    up = ih_mul_shift(up, 107922, 16);
    int32_t face[3] = {(int32_t)aside, (int32_t)-up, (int32_t)-ahead};
    ih_level_point_back(rig, face);
    const int64_t x = face[0];
    const int64_t z = face[2];
    pose->yaw_mdeg = ih_atan2_mdeg(x, -z);
    pose->pitch_mdeg = ih_atan2_mdeg(-(int64_t)face[1], ih_isqrt_u64((uint64_t)(x * x + z * z)));
}

static int32_t sigma_mdeg(int64_t variance_mdeg2, int64_t own_mdeg)
{
    return (int32_t)ih_isqrt_u64((uint64_t)(variance_mdeg2 + own_mdeg * own_mdeg));
}

void ih_pose_conclude(const struct ih_pose_belief *belief, const struct ih_pose_params *params,
                      const int32_t centre_mm_q8[3], struct ih_head_pose *out)
{
    int32_t yaw_q16[IH_POSE_YAWS]; /* at any rate */
    int32_t pitch_q16[IH_POSE_PITCHES];
    int32_t best = 0;
    for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
        yaw_q16[i] = 0;
        for (int32_t rate = 0; rate < IH_POSE_RATES; rate++) {
            yaw_q16[i] += belief->yaw_q16[rate * IH_POSE_YAWS + i];
        }
        best = yaw_q16[i] > yaw_q16[best] ? i : best;
    }
    for (int32_t i = 0; i < IH_POSE_PITCHES; i++) {
        pitch_q16[i] = belief->pitch_q16[i];
    }
    const int32_t first = (best - params->span + IH_POSE_YAWS) % IH_POSE_YAWS;
    const struct moments yaw =
        moments_of(yaw_q16, first, 2 * params->span + 1, IH_POSE_YAWS, IH_POSE_YAW_STEP_MDEG);
    const struct moments pitch =
        moments_of(pitch_q16, 0, IH_POSE_PITCHES, IH_POSE_PITCHES, IH_POSE_PITCH_STEP_MDEG);
    /* Cells are from -180 degrees on; the camera's direction is that from the head. */
    const int64_t towards_mdeg = ih_atan2_mdeg(centre_mm_q8[0], centre_mm_q8[2]);
    const int64_t first_mdeg =
        (int64_t)first * IH_POSE_YAW_STEP_MDEG + IH_POSE_YAW_STEP_MDEG / 2 - 180000;
    *out = (struct ih_head_pose){
        .yaw_mdeg = wrap_mdeg(first_mdeg + yaw.mean_mdeg - towards_mdeg),
        .pitch_mdeg = (int32_t)pitch.mean_mdeg - IH_POSE_PITCHES / 2 * IH_POSE_PITCH_STEP_MDEG,
        .yaw_sigma_mdeg = sigma_mdeg(yaw.variance_mdeg2, params->yaw_sigma_mdeg),
        .pitch_sigma_mdeg = sigma_mdeg(pitch.variance_mdeg2, params->pitch_sigma_mdeg),
    };
    out->is_known =
        yaw.sum_q16 >= params->known_min_q16 && out->yaw_sigma_mdeg <= params->sigma_max_mdeg;
}

static bool has_track(const struct ih_tracks *tracks, int32_t track_id)
{
    bool found = false;
    for (int32_t i = 0; i < tracks->track_count; i++) {
        found = found || tracks->track[i].id == track_id;
    }
    return found;
}

static void forget(struct ih_pose *pose, const struct ih_tracks *tracks)
{
    int32_t kept = 0;
    for (int32_t i = 0; i < pose->belief_count; i++) {
        if (has_track(tracks, pose->belief[i].track_id)) {
            pose->belief[kept++] = pose->belief[i];
        }
    }
    pose->belief_count = kept;
}

/* The belief of a track, NULL when it is new. */
static struct ih_pose_belief *find(struct ih_pose *pose, int32_t track_id)
{
    for (int32_t i = 0; i < pose->belief_count; i++) {
        if (pose->belief[i].track_id == track_id) {
            return &pose->belief[i];
        }
    }
    return NULL;
}

void ih_pose_update(struct ih_pose *pose, const struct ih_pose_params *params,
                    const struct ih_points *points, const struct ih_rig *rig,
                    const struct ih_detections *detections, const struct ih_predicted *predicted,
                    const struct ih_tracks *tracks, struct ih_pose_scratch *scratch,
                    struct ih_result *result)
{
    forget(pose, tracks);
    for (int32_t i = 0; i < result->entry_count; i++) {
        struct ih_result_entry *entry = &result->entry[i];
        if (entry->track_id == 0 || entry->rejected != IH_ACCEPTED) {
            continue;
        }
        const struct ih_detection *detection = ih_tracks_head(detections, predicted, i);
        struct ih_pose_belief *belief = find(pose, entry->track_id);
        const bool is_new = belief == NULL;
        if (is_new) {
            /* There are as many beliefs as tracks, and those of ended tracks are gone. */
            belief = &pose->belief[pose->belief_count++];
            ih_pose_begin(entry->track_id, tracks->time_us, belief);
        } else {
            ih_pose_wait(belief, params, tracks->time_us);
        }
        if (!entry->is_predicted && ih_pose_look_features(points, rig, &detection->head,
                                                          params->points_min, &scratch->look)) {
            ih_pose_look_weigh(&ih_pose_means, &scratch->look, &scratch->likelihood);
            const int32_t yaw_q8 = is_new ? 256 : params->yaw.follow_q8;
            ih_pose_learn(belief, &scratch->likelihood,
                          (int32_t)ih_mul_shift(yaw_q8, entry->frame_probability_q16, 16),
                          is_new ? 256 : params->pitch.follow_q8);
        }
        ih_pose_conclude(belief, params, detection->head.centre_mm_q8, &entry->pose);
        if (!rig->is_level) {
            look_back(rig, &entry->pose);
        }
    }
}
