#include "pose/ih_pose.h"

#include <stdbool.h>
#include <stddef.h>

#include "base/ih_fix.h"
#include "rig/ih_level.h"

/* A belief that has spread so far says nothing any more. */
#define STEPS_MAX 12

void ih_pose_params_default(struct ih_pose_params *params)
{
    *params = (struct ih_pose_params){
        .points_min = 16,
        .yaw = {.follow_q8 = 115, .leak_q16 = 13107, .side_q16 = 16384},
        .pitch = {.follow_q8 = 90, .leak_q16 = 16384, .side_q16 = 13107},
        .step_us = 25000,
        .span = 2,
        .known_min_q16 = 49152, /* 0.75 */
        .sigma_max_mdeg = 22000,
        .yaw_sigma_mdeg = 4000,
        .pitch_sigma_mdeg = 2000,
    };
}

void ih_pose_begin(int32_t track_id, int64_t time_us, struct ih_pose_belief *out)
{
    out->track_id = track_id;
    out->time_us = time_us;
    for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
        out->yaw_q16[i] = ih_pose_prior_q16[i];
    }
    for (int32_t i = 0; i < IH_POSE_PITCHES; i++) {
        out->pitch_q16[i] = ih_pose_prior_q16[IH_POSE_YAWS + i];
    }
}

/* One step of spreading: part_q16 of each cell goes to each neighbour; yaws are a ring, pitches have ends. */
static void spread(int32_t *cell_q16, int32_t count, int32_t part_q16, bool is_ring)
{
    const int32_t first = cell_q16[0];
    int32_t before = is_ring ? cell_q16[count - 1] : first;
    for (int32_t i = 0; i < count; i++) {
        const int32_t here = cell_q16[i];
        const int32_t end = is_ring ? first : here;
        const int32_t after = i + 1 < count ? cell_q16[i + 1] : end;
        const int64_t gained = (int64_t)before + after - 2 * (int64_t)here;
        cell_q16[i] = here + (int32_t)ih_mul_shift(gained, part_q16, 16);
        before = here;
    }
}

/* The sum is 1 again: roundings add up. */
static void normalise(int32_t *cell_q16, int32_t count)
{
    int64_t sum = 0;
    for (int32_t i = 0; i < count; i++) {
        sum += cell_q16[i];
    }
    for (int32_t i = 0; i < count && sum > 0; i++) {
        cell_q16[i] = (int32_t)ih_div_round((int64_t)cell_q16[i] * 65536, sum);
    }
}

static void mix(int32_t *cell_q16, const uint16_t *with_q16, int32_t count, int32_t part_q16)
{
    for (int32_t i = 0; i < count; i++) {
        const int64_t difference = with_q16[i] - (int64_t)cell_q16[i];
        cell_q16[i] += (int32_t)ih_mul_shift(difference, part_q16, 16);
    }
    normalise(cell_q16, count);
}

void ih_pose_wait(struct ih_pose_belief *belief, const struct ih_pose_params *params,
                  int64_t time_us)
{
    const int64_t passed_us =
        ih_clamp_s64(time_us - belief->time_us, (int64_t)STEPS_MAX * params->step_us);
    const int64_t steps = (passed_us + params->step_us - 1) / params->step_us;
    for (int64_t i = 0; i < steps; i++) {
        /* All steps are alike, and together of the time that has passed. */
        const int64_t whole_us = steps * params->step_us;
        const int64_t yaw_q16 = ih_div_round(passed_us * params->yaw.side_q16, whole_us);
        const int64_t pitch_q16 = ih_div_round(passed_us * params->pitch.side_q16, whole_us);
        spread(belief->yaw_q16, IH_POSE_YAWS, (int32_t)yaw_q16, true);
        spread(belief->pitch_q16, IH_POSE_PITCHES, (int32_t)pitch_q16, false);
    }
    mix(belief->yaw_q16, ih_pose_prior_q16, IH_POSE_YAWS, params->yaw.leak_q16);
    mix(belief->pitch_q16, &ih_pose_prior_q16[IH_POSE_YAWS], IH_POSE_PITCHES,
        params->pitch.leak_q16);
    belief->time_us = time_us;
}

/* Multiply by the likelihoods to a power, relative to the largest; the sum is 1 again. */
static void multiply(int32_t *cell_q16, const int32_t *log2_q10, int32_t count, int32_t power_q8)
{
    int32_t max = log2_q10[0];
    for (int32_t i = 1; i < count; i++) {
        max = ih_max_s32(max, log2_q10[i]);
    }
    for (int32_t i = 0; i < count; i++) {
        const int64_t below_q16 = ((int64_t)max - log2_q10[i]) * power_q8 >> 2;
        cell_q16[i] = (int32_t)ih_mul_shift(cell_q16[i], ih_power_q16(below_q16), 16);
    }
    normalise(cell_q16, count);
}

void ih_pose_learn(struct ih_pose_belief *belief, const struct ih_pose_likelihood *likelihood,
                   int32_t yaw_power_q8, int32_t pitch_power_q8)
{
    multiply(belief->yaw_q16, likelihood->log2_q10, IH_POSE_YAWS, yaw_power_q8);
    multiply(belief->pitch_q16, &likelihood->log2_q10[IH_POSE_YAWS], IH_POSE_PITCHES,
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
    int32_t best = 0;
    for (int32_t i = 1; i < IH_POSE_YAWS; i++) {
        best = belief->yaw_q16[i] > belief->yaw_q16[best] ? i : best;
    }
    const int32_t first = (best - params->span + IH_POSE_YAWS) % IH_POSE_YAWS;
    const struct moments yaw = moments_of(belief->yaw_q16, first, 2 * params->span + 1,
                                          IH_POSE_YAWS, IH_POSE_YAW_STEP_MDEG);
    const struct moments pitch =
        moments_of(belief->pitch_q16, 0, IH_POSE_PITCHES, IH_POSE_PITCHES, IH_POSE_PITCH_STEP_MDEG);
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
            ih_pose_learn(belief, &scratch->likelihood, is_new ? 256 : params->yaw.follow_q8,
                          is_new ? 256 : params->pitch.follow_q8);
        }
        ih_pose_conclude(belief, params, detection->head.centre_mm_q8, &entry->pose);
        if (!rig->is_level) {
            look_back(rig, &entry->pose);
        }
    }
}
