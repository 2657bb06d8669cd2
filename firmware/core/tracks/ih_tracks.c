#include "tracks/ih_tracks.h"

#include <stddef.h>
#include <string.h>

#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "detect/ih_score.h"

#define SPEED_MAX_MM_S_Q8 (3000 << 8)
#define SPEED_VARIANCE_MAX_Q8 ((int64_t)3000 * 3000 * 256)
#define PLACE_VARIANCE_MAX_Q8 ((int64_t)500 * 500 * 256)
#define START_SPEED_MM_S 300
/* 262 m: no head is seen as far. It bounds every place that comes of a track. */
#define PLACE_MAX_MM_Q8 (1 << 26)
/* Log-odds of one finding count at most this in the mean: one frame must not decide for long. */
#define LOGIT_MAX_Q10 (6 << 10)
/* A finding at the edge of the gate must be this much more probable than one at its middle. */
#define GATE_LOGIT_Q10 (4 << 10)
/* Findings less probable than this are as uncertain as UNSURE_FACTOR^2 times their variance. */
#define SURE_LOGIT_Q10 (2 << 10)
#define UNSURE_FACTOR2 4
/* Share of a finding's axes in its track's. */
#define AXES_SHARE_Q16 16384
/* A carried head slows down within this time. */
#define SLOW_US 300000
/* Two tracks nearer than this follow the same head. */
#define SAME_MM 80
#define VIEW_RAYS_MIN 4
#define FINDING_COUNT_MAX 1000
/* Heads this much less probable than the best are not chosen for their place. */
#define CHOICE_LOGIT_Q10 (3 << 10)

void ih_tracks_params_default(struct ih_tracks_params *params)
{
    *params = (struct ih_tracks_params){
        .gate_mm = 90,
        .gate_mm_per_s = 300,
        .start_logit_q10 = -1024,
        .start_head_logit_q10 = 1024,
        .mature_detections = 3,
        .accept_logit_q10 = 512,
        .drop_logit_q10 = -512,
        .keep_logit_q10 = -3072,
        .memory_q16 = 49152,
        .through_percent = 50,
        .front_percent = 30,
        .seen_min = 30,
        .carry_us = 1000000,
        .gap_us = 2000000,
        .measured_mm = 12,
        .acceleration_mm_s2 = 2500,
        .switch_frames = 3,
        .side = IH_SIDE_MIDDLE,
    };
}

void ih_tracks_init(struct ih_tracks *tracks)
{
    memset(tracks, 0, sizeof *tracks);
    tracks->selected = IH_NONE;
}

static int64_t at_most(int64_t value, int64_t limit)
{
    return value > limit ? limit : value;
}

/* Cross term when a variance is limited: cut by the same share, rounded towards 0, so that the
 * covariance stays positive. */
static int64_t limited_cross_q8(int64_t cross_q8, int64_t variance_q8, int64_t limit_q8)
{
    if (variance_q8 <= limit_q8) {
        return cross_q8;
    }
    return cross_q8 * (limit_q8 * (1 << 24) / variance_q8) / (1 << 24);
}

/* step_us below 2^21. */
static void predict(struct ih_track *track, int64_t step_us, int32_t acceleration_mm_s2)
{
    int64_t dt_q20 = ih_div_round(step_us * (1 << 20), 1000000);
    int64_t spread_q8 = (int64_t)acceleration_mm_s2 * acceleration_mm_s2 * 256;
    int64_t dt2_q20 = ih_mul_shift(dt_q20, dt_q20, 20);
    int64_t added_speed_q8 = ih_mul_shift(spread_q8, dt2_q20, 20);
    int64_t added_cross_q8 = ih_mul_shift(added_speed_q8, dt_q20, 21);
    int64_t added_place_q8 = ih_mul_shift(added_cross_q8, dt_q20, 21);
    track->place_q8 += 2 * ih_mul_shift(track->cross_q8, dt_q20, 20) +
                       ih_mul_shift(track->speed_q8, dt2_q20, 20) + added_place_q8;
    track->cross_q8 += ih_mul_shift(track->speed_q8, dt_q20, 20) + added_cross_q8;
    track->speed_q8 += added_speed_q8;
    track->cross_q8 = limited_cross_q8(track->cross_q8, track->place_q8, PLACE_VARIANCE_MAX_Q8);
    track->cross_q8 = limited_cross_q8(track->cross_q8, track->speed_q8, SPEED_VARIANCE_MAX_Q8);
    track->place_q8 = at_most(track->place_q8, PLACE_VARIANCE_MAX_Q8);
    track->speed_q8 = at_most(track->speed_q8, SPEED_VARIANCE_MAX_Q8);
    IH_IN_RANGE(track->place_q8, 0, PLACE_VARIANCE_MAX_Q8);
    IH_IN_RANGE(track->speed_q8, 0, SPEED_VARIANCE_MAX_Q8);
    IH_IN_RANGE(track->cross_q8, -IH_RANGE_CROSS_Q8, IH_RANGE_CROSS_Q8);
    for (int axis = 0; axis < 3; axis++) {
        int32_t way_q8 = (int32_t)ih_mul_shift(track->velocity_mm_s_q8[axis], dt_q20, 20);
        track->head.centre_mm_q8[axis] = ih_clamp_s32(track->head.centre_mm_q8[axis] + way_q8,
                                                      -PLACE_MAX_MM_Q8, PLACE_MAX_MM_Q8);
    }
}

/* Whether later is 0 to gap_us after earlier. Their difference may not fit 64 bits. */
static bool follows(int64_t earlier_us, int64_t later_us, int32_t gap_us)
{
    if (later_us < earlier_us || (earlier_us < 0 && later_us > INT64_MAX + earlier_us)) {
        return false;
    }
    return later_us - earlier_us <= gap_us;
}

void ih_tracks_expect(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      int64_t time_us, struct ih_expected *expected)
{
    int64_t step_us = 0;
    if (tracks->has_time && follows(tracks->time_us, time_us, params->gap_us)) {
        step_us = time_us - tracks->time_us;
    } else {
        tracks->track_count = 0;
        tracks->selected_id = 0;
        tracks->rival_frames = 0;
    }
    tracks->has_time = true;
    tracks->time_us = time_us;
    expected->count = tracks->track_count;
    for (int32_t i = 0; i < tracks->track_count; i++) {
        struct ih_track *track = &tracks->track[i];
        predict(track, step_us, params->acceleration_mm_s2);
        track->detection = IH_NONE;
        expected->head[i] = track->head;
    }
}

/* How well a finding continues a track, as log-odds; false: not at all. */
static bool fits(const struct ih_tracks *tracks, const struct ih_tracks_params *params,
                 const struct ih_track *track, const struct ih_detection *detection,
                 int32_t *merit_q10)
{
    int64_t unseen_us = tracks->time_us - track->seen_us;
    int64_t gate_mm = params->gate_mm + ih_div_round(params->gate_mm_per_s * unseen_us, 1000000);
    int64_t gate2_q16 = gate_mm * gate_mm * 65536;
    int64_t distance2 = ih_distance2_s32(track->head.centre_mm_q8, detection->head.centre_mm_q8);
    if (detection->track_id != 0 || detection->logit_q10 < params->keep_logit_q10 ||
        distance2 > gate2_q16) {
        return false;
    }
    /* distances within the gate: the quotient is at most GATE_LOGIT */
    int64_t loss_q10 = ih_div_round((distance2 >> 10) * GATE_LOGIT_Q10, (gate2_q16 >> 10) + 1);
    *merit_q10 = detection->logit_q10 - (int32_t)loss_q10;
    return true;
}

static void correct(struct ih_track *track, const struct ih_detection *detection,
                    const struct ih_tracks_params *params)
{
    int64_t noise_q8 = (int64_t)params->measured_mm * params->measured_mm * 256;
    if (detection->logit_q10 < SURE_LOGIT_Q10) {
        noise_q8 *= UNSURE_FACTOR2;
    }
    int64_t sum_q8 = track->place_q8 + noise_q8;
    int64_t gain_q16 = ih_div_round(track->place_q8 * 65536, sum_q8);
    int64_t speed_gain_q16 = ih_div_round(track->cross_q8 * 65536, sum_q8); /* 1/s */
    for (int axis = 0; axis < 3; axis++) {
        int64_t off_q8 =
            (int64_t)detection->head.centre_mm_q8[axis] - track->head.centre_mm_q8[axis];
        int64_t speed = track->velocity_mm_s_q8[axis] + ih_mul_shift(off_q8, speed_gain_q16, 16);
        track->velocity_mm_s_q8[axis] =
            ih_clamp_s32(ih_saturate_s32(speed), -SPEED_MAX_MM_S_Q8, SPEED_MAX_MM_S_Q8);
        track->head.centre_mm_q8[axis] += (int32_t)ih_mul_shift(off_q8, gain_q16, 16);
        int64_t grown = (int64_t)detection->head.semi_mm_q8[axis] - track->head.semi_mm_q8[axis];
        track->head.semi_mm_q8[axis] += (int32_t)ih_mul_shift(grown, AXES_SHARE_Q16, 16);
    }
    track->speed_q8 -= ih_mul_shift(speed_gain_q16, track->cross_q8, 16);
    track->cross_q8 -= ih_mul_shift(gain_q16, track->cross_q8, 16);
    track->place_q8 -= ih_mul_shift(gain_q16, track->place_q8, 16);
    IH_IN_RANGE(track->place_q8, 0, PLACE_VARIANCE_MAX_Q8);
    IH_IN_RANGE(track->speed_q8, 0, SPEED_VARIANCE_MAX_Q8);
}

static void remember_logit(struct ih_track *track, int32_t logit_q10, int32_t memory_q16)
{
    int32_t limited = ih_clamp_s32(logit_q10, -LOGIT_MAX_Q10, LOGIT_MAX_Q10);
    int64_t sum =
        (int64_t)track->mean_logit_q10 * memory_q16 + (int64_t)limited * (65536 - memory_q16);
    track->mean_logit_q10 = (int32_t)ih_shift_round(sum, 16);
}

static void judge(struct ih_track *track, const struct ih_tracks_params *params)
{
    int32_t limit_q10 = params->start_head_logit_q10;
    if (track->is_head) {
        limit_q10 = params->drop_logit_q10;
    } else if (track->detection_count >= params->mature_detections) {
        limit_q10 = params->accept_logit_q10;
    }
    track->is_head = track->mean_logit_q10 > limit_q10;
}

static void give(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                 struct ih_track *track, struct ih_detections *detections, int32_t index)
{
    struct ih_detection *detection = &detections->detection[index];
    detection->track_id = track->id;
    track->detection = index;
    track->seen_us = tracks->time_us;
    track->detection_count = ih_min_s32(track->detection_count + 1, FINDING_COUNT_MAX);
    correct(track, detection, params);
    remember_logit(track, detection->logit_q10, params->memory_q16);
    judge(track, params);
}

/* Do the rays go through where the head was, or is it out of the pattern? */
static bool is_gone(const struct ih_detections *detections, int32_t track,
                    const struct ih_tracks_params *params)
{
    const struct ih_view *view = &detections->view[track];
    int32_t rays = view->through + view->hit + view->front;
    if (detections->seen_count < params->seen_min) {
        return false;
    }
    if (rays < VIEW_RAYS_MIN) {
        return true;
    }
    return view->through * 100 > rays * params->through_percent &&
           view->front * 100 < rays * params->front_percent;
}

/* The best pair of a track without finding and a finding without track. */
static bool best_pair(const struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      const struct ih_detections *detections, int32_t *track, int32_t *detection)
{
    int32_t best = INT32_MIN;
    for (int32_t t = 0; t < tracks->track_count; t++) {
        bool gone = is_gone(detections, t, params);
        for (int32_t f = 0; f < detections->detection_count; f++) {
            int32_t merit;
            if (tracks->track[t].detection != IH_NONE ||
                !fits(tracks, params, &tracks->track[t], &detections->detection[f], &merit) ||
                (gone && detections->detection[f].logit_q10 < params->accept_logit_q10)) {
                continue;
            }
            if (merit > best) {
                best = merit;
                *track = t;
                *detection = f;
            }
        }
    }
    return best != INT32_MIN;
}

/* Could something before it hide the head, or was the frame lost? Else it would have been found. */
static bool may_be_hidden(const struct ih_detections *detections, int32_t track,
                          const struct ih_tracks_params *params)
{
    const struct ih_view *view = &detections->view[track];
    int32_t rays = view->through + view->hit + view->front;
    return detections->seen_count < params->seen_min ||
           view->front * 100 >= rays * params->front_percent;
}

static void slow_down(struct ih_track *track, int64_t step_us)
{
    int64_t kept_q16 = 65536 - ih_div_round(at_most(step_us, SLOW_US) * 65536, SLOW_US);
    for (int axis = 0; axis < 3; axis++) {
        track->velocity_mm_s_q8[axis] =
            (int32_t)ih_mul_shift(track->velocity_mm_s_q8[axis], kept_q16, 16);
    }
}

/* Is there an older track of the same head? */
static bool is_double(const struct ih_tracks *tracks, int32_t kept, const struct ih_track *track)
{
    for (int32_t i = 0; i < kept; i++) {
        if (ih_distance2_s32(tracks->track[i].head.centre_mm_q8, track->head.centre_mm_q8) <
            (int64_t)SAME_MM * SAME_MM * 65536) {
            return true;
        }
    }
    return false;
}

/* Drop tracks whose head is gone, was not seen for too long, or is another track's. Those that no
 * finding continued and that are no heads are not carried. */
static void prune(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                  struct ih_detections *detections)
{
    int32_t kept = 0;
    for (int32_t t = 0; t < tracks->track_count; t++) {
        struct ih_track *track = &tracks->track[t];
        int64_t unseen_us = tracks->time_us - track->seen_us;
        bool seen = track->detection != IH_NONE;
        if (!seen && !may_be_hidden(detections, t, params)) {
            remember_logit(track, params->keep_logit_q10, params->memory_q16);
            judge(track, params);
        }
        bool ended = seen ? track->mean_logit_q10 < params->keep_logit_q10
                          : !track->is_head || unseen_us > params->carry_us ||
                                is_gone(detections, t, params);
        if (ended || is_double(tracks, kept, track)) {
            if (seen) {
                detections->detection[track->detection].track_id = 0;
            }
            continue;
        }
        if (!seen) {
            slow_down(track, unseen_us);
        }
        tracks->track[kept++] = *track;
    }
    tracks->track_count = kept;
}

static bool has_id(const struct ih_tracks *tracks, int32_t id)
{
    for (int32_t t = 0; t < tracks->track_count; t++) {
        if (tracks->track[t].id == id) {
            return true;
        }
    }
    return false;
}

/* After the largest id comes 1 again, or the first one after it that no track has. */
static int32_t next_id(const struct ih_tracks *tracks)
{
    int32_t id = tracks->last_id;
    do {
        id = id == INT32_MAX ? 1 : id + 1;
    } while (has_id(tracks, id));
    return id;
}

static void start_track(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                        struct ih_detections *detections, int32_t index)
{
    struct ih_detection *detection = &detections->detection[index];
    struct ih_track *track = &tracks->track[tracks->track_count];
    *track = (struct ih_track){
        .id = next_id(tracks),
        .mean_logit_q10 = ih_clamp_s32(detection->logit_q10, -LOGIT_MAX_Q10, LOGIT_MAX_Q10),
        .head = detection->head,
        .place_q8 = (int64_t)params->measured_mm * params->measured_mm * 256,
        .speed_q8 = (int64_t)START_SPEED_MM_S * START_SPEED_MM_S * 256,
        .seen_us = tracks->time_us,
        .detection_count = 1,
        .detection = index,
    };
    if (is_double(tracks, tracks->track_count, track)) {
        return;
    }
    tracks->track_count++;
    tracks->last_id = track->id;
    detection->track_id = track->id;
    judge(track, params);
}

static void start_tracks(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                         struct ih_detections *detections)
{
    for (int32_t f = 0; f < detections->detection_count && tracks->track_count < IH_TRACKS_MAX;
         f++) {
        const struct ih_detection *detection = &detections->detection[f];
        if (detection->track_id == 0 && detection->logit_q10 > params->start_logit_q10) {
            start_track(tracks, params, detections, f);
        }
    }
}

/* A carried head among the findings. */
static void append_predicted(const struct ih_rig *rig, struct ih_track *track,
                             struct ih_detections *detections)
{
    struct ih_detection *detection = &detections->detection[detections->detection_count];
    memset(detection, 0, sizeof *detection);
    detection->head = track->head;
    detection->source = IH_SOURCE_EXPECTED;
    detection->is_predicted = true;
    detection->track_id = track->id;
    ih_detections_outline(rig, detection);
    track->detection = detections->detection_count++;
}

/* What a track knows goes into its finding. */
static void mark(const struct ih_track *track, struct ih_detections *detections)
{
    struct ih_detection *detection = &detections->detection[track->detection];
    detection->is_head = track->is_head;
    detection->logit_q10 = track->mean_logit_q10;
    detection->probability_q16 = ih_score_probability_q16(track->mean_logit_q10);
    detection->sigma_mm_q8 = (int32_t)ih_isqrt_u64((uint64_t)track->place_q8 << 8);
}

static void list_heads(struct ih_tracks *tracks, const struct ih_detections *detections)
{
    tracks->head_count = 0;
    for (int32_t t = 0; t < tracks->track_count; t++) {
        if (!tracks->track[t].is_head) {
            continue;
        }
        int32_t own = tracks->track[t].detection;
        int32_t at = tracks->head_count++;
        for (; at > 0 && detections->detection[tracks->head[at - 1]].logit_q10 <
                             detections->detection[own].logit_q10;
             at--) {
            tracks->head[at] = tracks->head[at - 1];
        }
        tracks->head[at] = own;
    }
}

/* Where the middle dot's ray is at a depth; for a range rig the optical axis. */
static int64_t middle_x_mm_q8(const struct ih_rig *rig, int32_t depth_mm_q8)
{
    const struct ih_calibration *c = &rig->calibration;
    const int32_t *ray_q30 = c->ray_q30[IH_SLOTS / 2];
    if (c->kind == IH_RIG_RANGE) {
        return 0;
    }
    int64_t way_q8 = depth_mm_q8 - ih_shift_round(c->origin_mm_q16[2], 8);
    return ih_shift_round(c->origin_mm_q16[0], 8) + ih_div_round(way_q8 * ray_q30[0], ray_q30[2]);
}

/* How far from the wanted side, as a slope; less is better. */
static int64_t aside_q28(const struct ih_detection *detection, const struct ih_rig *rig,
                         int32_t side)
{
    int32_t depth_q8 = ih_max_s32(detection->head.centre_mm_q8[2], 1 << 8);
    int64_t x_q8 = detection->head.centre_mm_q8[0];
    if (side == IH_SIDE_MIDDLE) {
        x_q8 = ih_abs_s64(x_q8 - middle_x_mm_q8(rig, depth_q8));
    } else if (side == IH_SIDE_RIGHT) {
        x_q8 = -x_q8;
    }
    return ih_div_round(x_q8 * (1 << 28), depth_q8);
}

static int32_t choose(const struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      const struct ih_rig *rig, const struct ih_detections *detections)
{
    const struct ih_detection *best = NULL;
    int32_t chosen = IH_NONE;
    for (int32_t i = 0; i < tracks->head_count; i++) {
        const struct ih_detection *detection = &detections->detection[tracks->head[i]];
        const struct ih_detection *first = &detections->detection[tracks->head[0]];
        if (detection->logit_q10 < first->logit_q10 - CHOICE_LOGIT_Q10) {
            break;
        }
        bool is_better =
            best == NULL || (best->is_predicted && !detection->is_predicted) ||
            (best->is_predicted == detection->is_predicted &&
             aside_q28(detection, rig, params->side) < aside_q28(best, rig, params->side));
        if (is_better) {
            best = detection;
            chosen = tracks->head[i];
        }
    }
    return chosen;
}

/* The head of the selected track stays selected until another was better for some frames. */
static void select_head(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                        const struct ih_rig *rig, const struct ih_detections *detections)
{
    int32_t wanted = choose(tracks, params, rig, detections);
    int32_t current = IH_NONE;
    for (int32_t i = 0; i < tracks->head_count; i++) {
        if (detections->detection[tracks->head[i]].track_id == tracks->selected_id) {
            current = tracks->head[i];
        }
    }
    if (current != IH_NONE && wanted != current) {
        int32_t rival_id = detections->detection[wanted].track_id;
        tracks->rival_frames = rival_id == tracks->rival_id ? tracks->rival_frames + 1 : 1;
        tracks->rival_id = rival_id;
        if (tracks->rival_frames < params->switch_frames) {
            wanted = current;
        }
    } else {
        tracks->rival_frames = 0;
        tracks->rival_id = 0;
    }
    tracks->selected = wanted;
    tracks->selected_id = wanted == IH_NONE ? 0 : detections->detection[wanted].track_id;
}

void ih_tracks_update(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      const struct ih_rig *rig, struct ih_detections *detections)
{
    int32_t track, detection;
    while (best_pair(tracks, params, detections, &track, &detection)) {
        give(tracks, params, &tracks->track[track], detections, detection);
    }
    prune(tracks, params, detections);
    start_tracks(tracks, params, detections);
    for (int32_t t = 0; t < tracks->track_count; t++) {
        if (tracks->track[t].detection == IH_NONE) {
            append_predicted(rig, &tracks->track[t], detections);
        }
        mark(&tracks->track[t], detections);
    }
    list_heads(tracks, detections);
    select_head(tracks, params, rig, detections);
}
