/* ih_tracks - heads over time: one track per person, and which head is the one (the paper's second
 * next step).
 *
 * In:    findings of this frame, its time; the tracks so far.
 * Out:   tracks; findings marked with their track, accepted or not; heads in order of probability,
 *        and the selected one. A head that is carried through an occlusion or a lost frame is
 *        appended to the findings as a predicted one.
 * Way:   per track a constant-velocity Kalman filter, one variance for all axes. ih_tracks_expect
 *        moves the tracks to the frame's time and says where heads are expected; ih_tracks_update
 *        then
 *        1. gives findings to tracks, the best pair first: within the gate, and log-odds above
 *           keep_logit even if it would not start a track.
 *        2. ends a track that found nothing convincing when more than through_percent of the rays
 *           through it go on and fewer than front_percent are stopped before it: the seat is empty;
 *           or when fewer than 4 rays meet it: it has left the pattern. A frame in which fewer than
 *           seen_min points were seen says neither: it is lost.
 *        3. carries the other heads, slowing down, for at most carry_us. If fewer than front_percent
 *           of the rays are stopped before it and the frame is not lost, nothing hides it: that
 *           counts as a finding with log-odds keep_logit. A track that is no head yet ends with the
 *           first frame in which it finds nothing, and so does the younger of two tracks within
 *           80 mm.
 *        4. starts tracks with what is left and above start_logit, while there is room.
 *        A track's log-odds are a running mean of its findings'; it is a head above start_head_logit,
 *        from its mature_findings-th finding on above accept_logit, until it falls below drop_logit.
 *        The selected head is the one nearest the middle of the pattern (or the leftmost or
 *        rightmost in the picture, by side), of those not much less probable than the best, and one
 *        that is seen before one that is carried; another takes its place after switch_frames frames.
 * Time:  frames may come late, be lost, or jump: a step back, or forward by more than gap_us,
 *        forgets all tracks; ids go on, after the largest from 1 again.
 * Overflow: steps up to 2 s = 2^21 in Q20, accelerations below 2^13 mm/s^2: what a step adds to a
 *        variance is below 2^30 mm^2, 2^38 in Q8, times 2^21 2^59. Then standard deviations are
 *        limited to 500 mm and 3 m/s: 2^26 and 2^31.2 in Q8; the cross term, 2^36.3 at most, is cut
 *        by the same share, 2^24, so that the covariance stays positive. Predicted places are limited
 *        to 2^26 in Q8, centres of findings below 2^27, speeds at most 3 m/s: squared distances below
 *        2^57.6.
 * Error: place within 0.05 mm, speed 0.65 mm/s of a float64 filter's; variances 0.03 %, and 2 % in
 *        the ten frames after a step of 0.3 s or more (a gain has 16 bits).
 * Cost:  tracks x findings distances.
 */
#ifndef IH_TRACKS_H
#define IH_TRACKS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_detections.h"
#include "detect/ih_ellipsoid.h"
#include "rig/ih_rig.h"

#define IH_TRACKS_MAX IH_DETECTIONS_EXPECTED_MAX

enum ih_side { IH_SIDE_MIDDLE, IH_SIDE_LEFT, IH_SIDE_RIGHT };

struct ih_tracks_params {
    int32_t gate_mm;                             /* a finding this near belongs to the track .. */
    int32_t gate_mm_per_s;                       /* .. and farther, the longer it was not seen */
    int32_t start_logit_q10;                     /* findings above this start a track */
    int32_t start_head_logit_q10;                /* a new track above this is a head at once .. */
    int32_t mature_detections, accept_logit_q10; /* .. later above this .. */
    int32_t drop_logit_q10;                      /* .. until it falls below this */
    int32_t keep_logit_q10;                      /* findings above this continue a track */
    int32_t memory_q16;                          /* share of the old mean in the new one */
    int32_t through_percent, front_percent;      /* of the rays that meet it: gone, hidden */
    int32_t seen_min;                            /* points; a frame with fewer is lost */
    int32_t carry_us;
    int32_t gap_us;             /* up to 2 s; -1: every frame on its own */
    int32_t measured_mm;        /* standard deviation of a finding's centre; 4 .. 500 */
    int32_t acceleration_mm_s2; /* of heads, standard deviation; 0 .. 8191 */
    int32_t switch_frames;
    int32_t side; /* enum ih_side */
};

struct ih_track {
    int32_t id;
    bool is_head;
    int32_t mean_logit_q10;
    struct ih_ellipsoid head; /* filtered */
    int32_t velocity_mm_s_q8[3];
    /* covariance of place and velocity along each axis: mm^2, mm^2/s, mm^2/s^2 */
    int64_t place_q8, cross_q8, speed_q8;
    int64_t seen_us;
    int32_t detection_count; /* so far, at most 1000 */
    int32_t detection;       /* of this frame, or IH_NONE */
};

struct ih_tracks {
    bool has_time;
    int64_t time_us;
    int32_t last_id;
    int32_t track_count;
    struct ih_track track[IH_TRACKS_MAX];
    int32_t selected_id; /* 0: none */
    int32_t rival_id, rival_frames;
    /* Of this frame: indices into findings, most probable first. */
    int32_t head_count;
    int32_t head[IH_TRACKS_MAX];
    int32_t selected; /* index into findings, or IH_NONE */
};

IH_BEGIN_DECLS

void ih_tracks_params_default(struct ih_tracks_params *params);

/* No track; ids begin at 1. */
void ih_tracks_init(struct ih_tracks *tracks);

void ih_tracks_expect(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      int64_t time_us, struct ih_expected *expected);

void ih_tracks_update(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      const struct ih_rig *rig, struct ih_detections *detections);

IH_END_DECLS

#endif
