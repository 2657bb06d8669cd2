#include "tracks/ih_tracks.h"

#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "detect/ih_candidates.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_score.h"

/* Log-odds of one detection are limited to this in the mean: one frame must not decide for long. */
#define LOGIT_MAX_Q10 (6 << 10)
/* A detection at the edge of the gate needs this much more than one at its centre. */
#define GATE_LOGIT_Q10 (4 << 10)
/* A detection beyond the gate needs this much more: where a fast person's head was there is still a chest. */
#define FAST_LOGIT_Q10 (2 << 10)
/* Two heads within this are one person's: another one has no room there. */
#define OWN_ASIDE_MM 150
#define OWN_DEPTH_MM 250
/* The same of one that is expected, not measured: so far behind another one it would be hidden. */
#define HIDDEN_DEPTH_MM 450
#define ONE_Q16 65536
/* A head that fewer rays meet has left the pattern. */
#define VIEW_RAYS_MIN 4
#define DETECTION_COUNT_MAX 1000
/* A doubtful head is not chosen for its position when it is this much less probable than the best. */
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
        .drop_logit_q10 = -1536,
        .moved_mm = 25,
        .moved_logit_q10 = 1024,
        .keep_logit_q10 = -3072,
        .memory_q16 = 49152,
        .through_percent = 50,
        .front_percent = 30,
        .seen_min = 30,
        .coast_us = 1000000,
        .blind_us = 300000,
        .gap_us = 2000000,
        .measured_mm = 12,
        .acceleration_mm_s2 = 2500,
        .switch_frames = 3,
        .side = IH_SIDE_NEAREST,
    };
}

void ih_tracks_init(struct ih_tracks *tracks)
{
    memset(tracks, 0, sizeof *tracks);
    tracks->selected = IH_NONE;
}

void ih_tracks_forget(struct ih_tracks *tracks)
{
    const int32_t last_id = tracks->last_id;
    ih_tracks_init(tracks);
    tracks->last_id = last_id;
}

/* Is later 0 to gap_us after earlier? Their difference may not fit 64 bits. */
static bool is_next(int64_t earlier_us, int64_t later_us, int32_t gap_us)
{
    if (later_us < earlier_us || (earlier_us < 0 && later_us > INT64_MAX + earlier_us)) {
        return false;
    }
    return later_us - earlier_us <= gap_us;
}

/* How far apart two heads are, as a part of the limits aside and in depth, squared, at most 1: of two people. */
static int32_t apart2_q16(const struct ih_ellipsoid *head, const struct ih_ellipsoid *other,
                          int32_t depth_mm)
{
    const int32_t limit_mm[3] = {OWN_ASIDE_MM, OWN_ASIDE_MM, depth_mm};
    int64_t sum_q16 = 0;
    for (int axis = 0; axis < 3; axis++) {
        const int64_t off_q8 = (int64_t)head->centre_mm_q8[axis] - other->centre_mm_q8[axis];
        const int64_t part_q8 = ih_div_round(off_q8, limit_mm[axis]);
        sum_q16 += part_q8 * part_q8;
    }
    return (int32_t)ih_min_s64(sum_q16, ONE_Q16);
}

void ih_tracks_expect(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      int64_t time_us, struct ih_expected *expected)
{
    int64_t step_us = 0;
    if (tracks->has_time && is_next(tracks->time_us, time_us, params->gap_us)) {
        step_us = time_us - tracks->time_us;
    } else {
        tracks->track_count = 0;
        tracks->selected_id = 0;
        tracks->rival_frames = 0;
        tracks->lit_us = time_us;
    }
    tracks->has_time = true;
    tracks->time_us = time_us;
    expected->count = tracks->track_count;
    expected->last_sure_count = 0;
    for (int32_t i = 0; i < tracks->track_count; i++) {
        struct ih_track *track = &tracks->track[i];
        ih_kalman_predict(&track->filter, step_us, params->acceleration_mm_s2);
        track->index = IH_NONE;
        expected->head[i] = track->filter.head;
        if (!track->is_sure &&
            apart2_q16(&track->filter.head, &track->last_sure, HIDDEN_DEPTH_MM) < ONE_Q16) {
            expected->last_sure[expected->last_sure_count++] = track->last_sure;
        }
        track->is_sure = false;
    }
}

const struct ih_detection *ih_tracks_head(const struct ih_detections *detections,
                                          const struct ih_predicted *predicted, int32_t index)
{
    const int32_t count = detections->detection_count;
    return index < count ? &detections->detection[index] : &predicted->head[index - count];
}

/* The track of a head in this frame, or NULL. */
static const struct ih_track *track_of(const struct ih_tracks *tracks, int32_t index)
{
    for (int32_t t = 0; t < tracks->track_count; t++) {
        if (tracks->track[t].index == index) {
            return &tracks->track[t];
        }
    }
    return NULL;
}

struct ih_verdict ih_tracks_verdict(const struct ih_tracks *tracks,
                                    const struct ih_detections *detections, int32_t index)
{
    const struct ih_track *track = track_of(tracks, index);
    if (track == NULL) {
        return (struct ih_verdict){
            .logit_q10 = detections->detection[index].logit_q10,
            .probability_q16 = detections->detection[index].probability_q16,
        };
    }
    return (struct ih_verdict){
        .track_id = track->id,
        .is_head = track->is_head,
        .logit_q10 = track->mean_logit_q10,
        .probability_q16 = ih_score_probability_q16(track->mean_logit_q10),
        .sigma_mm_q8 = ih_kalman_sigma_mm_q8(&track->filter),
    };
}

/* Beyond the gate: a head whose person moves fast, and a detection that is one rather than not. */
static bool fits_fast(const struct ih_tracks_params *params, const struct ih_track *track,
                      const struct ih_detection *detection, int32_t *merit_q10)
{
    const int32_t own2_q16 = apart2_q16(&track->filter.head, &detection->head, HIDDEN_DEPTH_MM);
    *merit_q10 = detection->logit_q10 - FAST_LOGIT_Q10 -
                 (int32_t)ih_shift_round((int64_t)own2_q16 * GATE_LOGIT_Q10, 16);
    return track->is_head && detection->logit_q10 > params->accept_logit_q10 && own2_q16 < ONE_Q16;
}

/* How well a detection continues a track, as log-odds; false: not at all. */
static bool fits(const struct ih_tracks *tracks, const struct ih_tracks_params *params,
                 const struct ih_track *track, const struct ih_detection *detection,
                 int32_t *merit_q10)
{
    int64_t unseen_us = tracks->time_us - track->seen_us;
    int64_t gate_mm = params->gate_mm + ih_div_round(params->gate_mm_per_s * unseen_us, 1000000);
    int64_t gate2_q16 = gate_mm * gate_mm * 65536;
    int64_t distance2 =
        ih_distance2_s32(track->filter.head.centre_mm_q8, detection->head.centre_mm_q8);
    if (detection->logit_q10 < params->keep_logit_q10) {
        return false;
    }
    if (distance2 > gate2_q16) {
        return fits_fast(params, track, detection, merit_q10);
    }
    /* Within the gate the quotient is at most GATE_LOGIT. */
    int64_t loss_q10 = ih_div_round((distance2 >> 10) * GATE_LOGIT_Q10, (gate2_q16 >> 10) + 1);
    *merit_q10 = detection->logit_q10 - (int32_t)loss_q10;
    return true;
}

/* The less a detection looks like a head, the more of it is a hand or a chest, which would take the track along: its
 * variance is so many times that of a sure one. Chosen on hands before faces (E025). */
static int64_t variance_q8(int32_t logit_q10, int32_t measured_mm)
{
    static const int32_t below_q10[] = {0, 1 << 10, 2 << 10};
    static const int32_t factor[] = {49, 25, 4, 1};
    const int32_t count = (int32_t)(sizeof below_q10 / sizeof below_q10[0]);
    int32_t i = 0;
    while (i < count && logit_q10 >= below_q10[i]) {
        i++;
    }
    return (int64_t)measured_mm * measured_mm * 256 * factor[i];
}

static void average_logit(struct ih_track *track, int32_t logit_q10, int32_t memory_q16)
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
    if (track->has_moved) {
        limit_q10 -= params->moved_logit_q10;
    }
    track->is_head = track->mean_logit_q10 > limit_q10;
}

/* Is it away from where the track began? */
static bool has_moved(const struct ih_track *track, const struct ih_tracks_params *params)
{
    return ih_distance2_s32(track->filter.head.centre_mm_q8, track->start_mm_q8) >
           (int64_t)params->moved_mm * params->moved_mm * 65536;
}

/* A track continues with a detection. */
static void assign(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                   struct ih_track *track, const struct ih_detection *detection, int32_t index)
{
    track->is_sure = detection->logit_q10 > params->accept_logit_q10;
    if (track->is_sure) {
        track->last_sure = detection->head;
    }
    track->index = index;
    track->seen_us = tracks->time_us;
    track->detection_count = ih_min_s32(track->detection_count + 1, DETECTION_COUNT_MAX);
    ih_kalman_correct(&track->filter, &detection->head,
                      variance_q8(detection->logit_q10, params->measured_mm));
    track->has_moved = track->has_moved || has_moved(track, params);
    average_logit(track, detection->logit_q10, params->memory_q16);
    judge(track, params);
}

/* Do the rays go through where the head was, or is it out of the pattern? */
static bool is_gone(const struct ih_detections *detections, int32_t track,
                    const struct ih_tracks_params *params)
{
    const struct ih_view *view = &detections->view[track];
    int32_t rays = view->through + view->hit + view->front;
    return detections->seen_count >= params->seen_min &&
           (rays < VIEW_RAYS_MIN || (view->through * 100 > rays * params->through_percent &&
                                     view->front * 100 < rays * params->front_percent));
}

/* The best pair of a track without detection and a detection without track that is no body. */
static bool best_pair(const struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      const struct ih_detections *detections, uint32_t bodies, int32_t *best_track,
                      int32_t *best_index)
{
    int32_t best = INT32_MIN;
    for (int32_t t = 0; t < tracks->track_count; t++) {
        const struct ih_track *track = &tracks->track[t];
        bool gone = is_gone(detections, t, params);
        for (int32_t i = 0; i < detections->detection_count; i++) {
            const struct ih_detection *detection = &detections->detection[i];
            int32_t merit;
            if (track->index != IH_NONE || track_of(tracks, i) != NULL || (bodies >> i & 1) != 0 ||
                !fits(tracks, params, track, detection, &merit) ||
                (gone && detection->logit_q10 < params->accept_logit_q10)) {
                continue;
            }
            if (merit > best) {
                best = merit;
                *best_track = t;
                *best_index = i;
            }
        }
    }
    return best != INT32_MIN;
}

/* Is the person whose head was expected here measured elsewhere? */
static bool is_elsewhere(const struct ih_tracks *tracks, const struct ih_track *track)
{
    for (int32_t t = 0; t < tracks->track_count; t++) {
        const struct ih_track *other = &tracks->track[t];
        if (other->index != IH_NONE && other->is_head &&
            apart2_q16(&track->filter.head, &other->filter.head, HIDDEN_DEPTH_MM) < ONE_Q16) {
            return true;
        }
    }
    return false;
}

/* Could something in front of the head hide it, or was the frame lost? */
static bool may_be_hidden(const struct ih_detections *detections, int32_t track,
                          const struct ih_tracks_params *params)
{
    const struct ih_view *view = &detections->view[track];
    int32_t rays = view->through + view->hit + view->front;
    return detections->seen_count < params->seen_min ||
           view->front * 100 >= rays * params->front_percent;
}

/* Is there an older track of the same head? */
static bool is_double(const struct ih_tracks *tracks, int32_t kept, const struct ih_track *track)
{
    for (int32_t i = 0; i < kept; i++) {
        if (apart2_q16(&tracks->track[i].filter.head, &track->filter.head, OWN_DEPTH_MM) <
            ONE_Q16) {
            return true;
        }
    }
    return false;
}

/* Drop tracks whose head is gone, was not seen for too long, or is another track's (method 2 and 3). */
static void prune(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                  const struct ih_detections *detections)
{
    int32_t kept = 0;
    for (int32_t t = 0; t < tracks->track_count; t++) {
        struct ih_track *track = &tracks->track[t];
        int64_t unseen_us = tracks->time_us - track->seen_us;
        bool seen = track->index != IH_NONE;
        if (!seen && !may_be_hidden(detections, t, params)) {
            average_logit(track, params->keep_logit_q10, params->memory_q16);
            judge(track, params);
        }
        bool ended = seen ? track->mean_logit_q10 < params->keep_logit_q10
                          : !track->is_head || unseen_us > params->coast_us ||
                                is_gone(detections, t, params) || is_elsewhere(tracks, track);
        if (ended || is_double(tracks, kept, track)) {
            continue;
        }
        if (!seen) {
            ih_kalman_slow_down(&track->filter, unseen_us);
        }
        tracks->track[kept++] = *track;
    }
    tracks->track_count = kept;
}

/* The next id that no track has; after the largest comes 1 again. */
static int32_t next_id(const struct ih_tracks *tracks)
{
    int32_t id = tracks->last_id;
    bool is_taken;
    do {
        id = id == INT32_MAX ? 1 : id + 1;
        is_taken = false;
        for (int32_t t = 0; t < tracks->track_count; t++) {
            is_taken = is_taken || tracks->track[t].id == id;
        }
    } while (is_taken);
    return id;
}

static void start_track(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                        const struct ih_detection *detection, int32_t index)
{
    struct ih_track *track = &tracks->track[tracks->track_count];
    *track = (struct ih_track){
        .id = next_id(tracks),
        .mean_logit_q10 = ih_clamp_s32(detection->logit_q10, -LOGIT_MAX_Q10, LOGIT_MAX_Q10),
        .seen_us = tracks->time_us,
        .detection_count = 1,
        .index = index,
        .is_sure = detection->logit_q10 > params->accept_logit_q10,
        .last_sure = detection->head,
    };
    memcpy(track->start_mm_q8, detection->head.centre_mm_q8, sizeof track->start_mm_q8);
    ih_kalman_start(&detection->head, params->measured_mm, &track->filter);
    if (is_double(tracks, tracks->track_count, track)) {
        return;
    }
    tracks->track_count++;
    tracks->last_id = track->id;
    judge(track, params);
}

static void start_tracks(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                         const struct ih_detections *detections, uint32_t bodies)
{
    for (int32_t i = 0; i < detections->detection_count && tracks->track_count < IH_TRACKS_MAX;
         i++) {
        const struct ih_detection *detection = &detections->detection[i];
        if (track_of(tracks, i) == NULL && detection->logit_q10 > params->start_logit_q10 &&
            (bodies >> i & 1) == 0) {
            start_track(tracks, params, detection, i);
        }
    }
}

/* The head of a track without detection. */
static void append_predicted(const struct ih_rig *rig, struct ih_track *track,
                             const struct ih_detections *detections, struct ih_predicted *predicted)
{
    struct ih_detection *head = &predicted->head[predicted->count];
    memset(head, 0, sizeof *head);
    head->head = track->filter.head;
    head->source = IH_SOURCE_EXPECTED;
    ih_detections_outline(rig, head);
    track->index = detections->detection_count + predicted->count++;
}

static void list_heads(struct ih_tracks *tracks)
{
    tracks->head_count = 0;
    for (int32_t t = 0; t < tracks->track_count; t++) {
        const struct ih_track *track = &tracks->track[t];
        if (!track->is_head || track->index == IH_NONE) {
            continue;
        }
        int32_t at = tracks->head_count++;
        for (; at > 0 &&
               track_of(tracks, tracks->head[at - 1])->mean_logit_q10 < track->mean_logit_q10;
             at--) {
            tracks->head[at] = tracks->head[at - 1];
        }
        tracks->head[at] = track->index;
    }
}

/* Of two heads the one with the smaller number is selected: squared distance from the camera, or slope in X. */
static int64_t order_of(const struct ih_ellipsoid *head, int32_t side)
{
    static const int32_t camera_mm_q8[3] = {0, 0, 0};
    if (side == IH_SIDE_NEAREST) {
        return ih_distance2_s32(head->centre_mm_q8, camera_mm_q8);
    }
    const int32_t depth_q8 = ih_max_s32(head->centre_mm_q8[2], 1 << 8);
    const int64_t slope_q28 = ih_div_round((int64_t)head->centre_mm_q8[0] * (1 << 28), depth_q8);
    return side == IH_SIDE_RIGHT ? -slope_q28 : slope_q28;
}

/* A detected head is better than a predicted one; then the nearer one, or the wanted side. */
static int32_t choose(const struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      const struct ih_detections *detections, const struct ih_predicted *predicted)
{
    int32_t chosen = IH_NONE;
    bool is_chosen_predicted = false;
    int64_t chosen_order = 0;
    for (int32_t i = 0; i < tracks->head_count; i++) {
        const int32_t index = tracks->head[i];
        const int32_t best_q10 = track_of(tracks, tracks->head[0])->mean_logit_q10;
        if (track_of(tracks, index)->mean_logit_q10 <
            ih_min_s32(best_q10 - CHOICE_LOGIT_Q10, params->accept_logit_q10)) {
            break;
        }
        const bool is_predicted = index >= detections->detection_count;
        const struct ih_detection *head = ih_tracks_head(detections, predicted, index);
        const int64_t order = order_of(&head->head, params->side);
        if (chosen == IH_NONE || (is_chosen_predicted && !is_predicted) ||
            (is_chosen_predicted == is_predicted && order < chosen_order)) {
            chosen = index;
            is_chosen_predicted = is_predicted;
            chosen_order = order;
        }
    }
    return chosen;
}

/* The head of the selected track stays selected until another was better for some frames. */
static void select_head(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                        int32_t wanted)
{
    int32_t current = IH_NONE;
    int32_t next = wanted;
    for (int32_t i = 0; i < tracks->head_count; i++) {
        if (track_of(tracks, tracks->head[i])->id == tracks->selected_id) {
            current = tracks->head[i];
        }
    }
    if (current != IH_NONE && wanted != current) {
        int32_t rival_id = track_of(tracks, wanted)->id;
        tracks->rival_frames = rival_id == tracks->rival_id ? tracks->rival_frames + 1 : 1;
        tracks->rival_id = rival_id;
        if (tracks->rival_frames < params->switch_frames) {
            next = current;
        }
    } else {
        tracks->rival_frames = 0;
        tracks->rival_id = 0;
    }
    tracks->selected = next;
    tracks->selected_id = next == IH_NONE ? 0 : track_of(tracks, next)->id;
}

void ih_tracks_update(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      const struct ih_rig *rig, const struct ih_detections *detections,
                      struct ih_predicted *predicted)
{
    const uint32_t bodies = ih_candidates_bodies(detections, params->start_logit_q10);
    int32_t t, index;
    while (best_pair(tracks, params, detections, bodies, &t, &index)) {
        assign(tracks, params, &tracks->track[t], &detections->detection[index], index);
    }
    prune(tracks, params, detections);
    start_tracks(tracks, params, detections, bodies);
    predicted->count = 0;
    const bool is_lost = detections->seen_count < params->seen_min;
    tracks->lit_us = is_lost ? tracks->lit_us : tracks->time_us;
    for (t = 0; t < tracks->track_count; t++) {
        const int64_t shown_us = ih_max_s64(tracks->lit_us, tracks->track[t].seen_us);
        if (tracks->track[t].index == IH_NONE && tracks->time_us - shown_us <= params->blind_us) {
            append_predicted(rig, &tracks->track[t], detections, predicted);
        }
    }
    list_heads(tracks);
    select_head(tracks, params, choose(tracks, params, detections, predicted));
}
