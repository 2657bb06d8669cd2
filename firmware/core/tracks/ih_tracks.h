/* ih_tracks - heads over time: one track per person, and which head is the selected one (the paper's
 * second next step).
 *
 * In:    detections of this frame, its time; the tracks so far.
 * Out:   tracks; a verdict on each detection: its track, accepted or not; heads in order of
 *        probability, and the selected one. A head whose track coasts through an occlusion or a lost
 *        frame follows the detections as a predicted one.
 * Method: each track has a Kalman filter (ih_kalman). ih_tracks_expect moves the tracks to the
 *        frame's time and says where heads are expected; ih_tracks_update then
 *        1. assigns detections to tracks, the best pair first: within the gate and above keep_logit. One with a
 *           possible head above it, above start_logit, is a body (ih_candidates) and gets and starts no track.
 *           A head may be beyond its gate, too: a detection above accept_logit within an ellipsoid of
 *           150 mm aside and 450 mm in depth, in which a second person would be hidden, for 2 log-odds more.
 *        2. ends a track without a convincing detection when more than through_percent of the rays
 *           through its head go on and fewer than front_percent are stopped before it, as over an empty
 *           seat, or when fewer than 4 rays meet it: it has left the pattern. A frame with fewer than
 *           seen_min points is lost and shows neither. It ends, too, when a measured head is in that
 *           ellipsoid around it: nobody has two.
 *        3. lets the other tracks coast, slowing down, for at most coast_us. Their heads are reported, but not
 *           when all frames of the last blind_us were lost and did not show them: the laser may have failed, or
 *           somebody has left a room whose walls are beyond the range. Where nothing hides the head and the frame
 *           is not lost, that counts as a detection with log-odds keep_logit. A track that is no head yet ends
 *           with the first frame without a detection. Nobody has two heads: of two tracks within 150 mm aside and
 *           250 mm in depth, where another head has no room, the younger ends.
 *        4. starts tracks with the remaining detections above start_logit that are not so near another track,
 *           while there is room.
 *        A hand before a head may draw its track away. So a head without a detection above accept_logit in the
 *        frame before is looked for where it had the last one, too, if that is within the ellipsoid of 1.
 *        A detection moves its track by the less, the less it looks like a head: it may be a hand before it.
 *        A track's log-odds are a running mean of its detections'. A head ends as one only when the mean says
 *        so clearly, below drop_logit: what moves on smoothly from a head is more probably one than a new thing
 *        that looks the same. Rooms stand still: what was moved_mm away from where its track began needs
 *        moved_logit less, to become a head and to stay one.
 *        The selected head is the one nearest to the camera (or the leftmost or rightmost in the
 *        picture, by side), a detected one before a predicted one; not one below accept_logit that is much
 *        less probable than the best. Another one replaces it after switch_frames frames.
 * Time:  frames may come late, be lost, or jump: a step back, or forward by more than gap_us,
 *        removes all tracks; ids go on, after the largest from 1 again.
 * Overflow: centres are below 2^27 in Q8, squared distances below 2^57.6.
 * Cost:  tracks x detections distances.
 */
#ifndef IH_TRACKS_H
#define IH_TRACKS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_detections.h"
#include "rig/ih_rig.h"
#include "tracks/ih_kalman.h"

#define IH_TRACKS_MAX IH_DETECTIONS_EXPECTED_MAX

enum ih_side { IH_SIDE_NEAREST, IH_SIDE_LEFT, IH_SIDE_RIGHT };

struct ih_tracks_params {
    int32_t gate_mm, gate_mm_per_s;          /* a gate's radius after a detection, and its growth */
    int32_t start_logit_q10, keep_logit_q10; /* detections above these start, continue a track */
    int32_t start_head_logit_q10;            /* a new track above this is a head at once, */
    int32_t mature_detections, accept_logit_q10; /* after so many detections one above this, */
    int32_t drop_logit_q10;                      /* until it falls below this */
    int32_t moved_mm, moved_logit_q10;           /* what has moved so far needs so much less */
    int32_t memory_q16;                          /* weight of the old mean in the new one */
    int32_t through_percent, front_percent;      /* of the rays that meet it: gone, hidden */
    int32_t seen_min;                            /* points; a frame with fewer is lost */
    int32_t coast_us, blind_us;
    int32_t gap_us;             /* up to 2 s; -1: every frame on its own */
    int32_t measured_mm;        /* standard deviation of a detection's centre; 4 .. 500 */
    int32_t acceleration_mm_s2; /* of heads, standard deviation; 0 .. 8191 */
    int32_t switch_frames;
    int32_t side; /* enum ih_side */
};

struct ih_track {
    int32_t id;
    bool is_head;
    int32_t mean_logit_q10;
    struct ih_kalman filter;
    int32_t start_mm_q8[3]; /* of the first detection */
    bool has_moved;
    bool is_sure;                  /* its last frame had a detection above accept_logit; */
    struct ih_ellipsoid last_sure; /* the last one of those, or the first of all */
    int64_t seen_us;
    int32_t detection_count; /* so far, at most 1000 */
    int32_t index; /* of its head in this frame, as for ih_tracks_head; IH_NONE: none is reported */
};

struct ih_tracks {
    bool has_time;
    int64_t time_us, lit_us; /* of this frame, and of the last one that was not lost */
    int32_t last_id, track_count;
    struct ih_track track[IH_TRACKS_MAX];
    int32_t selected_id, rival_id, rival_frames; /* id 0: none */
    /* Of this frame: indices as for ih_tracks_head, most probable first. */
    int32_t head_count;
    int32_t head[IH_TRACKS_MAX];
    int32_t selected; /* such an index, or IH_NONE */
};

/* Heads that no detection shows, where their tracks predict them; without evidence. */
struct ih_predicted {
    int32_t count;
    struct ih_detection head[IH_TRACKS_MAX];
};

/* The tracks' verdict on a head. */
struct ih_verdict {
    int32_t track_id;                   /* 0: none */
    bool is_head;                       /* accepted */
    int32_t logit_q10, probability_q16; /* the track's; without one the detection's */
    int32_t sigma_mm_q8;                /* of the centre along each axis; 0: unknown */
};

IH_BEGIN_DECLS

void ih_tracks_params_default(struct ih_tracks_params *params);

/* No track; ids begin at 1. */
void ih_tracks_init(struct ih_tracks *tracks);

/* All tracks end; the next one gets a number that none had. */
void ih_tracks_forget(struct ih_tracks *tracks);

void ih_tracks_expect(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      int64_t time_us, struct ih_expected *expected);

void ih_tracks_update(struct ih_tracks *tracks, const struct ih_tracks_params *params,
                      const struct ih_rig *rig, const struct ih_detections *detections,
                      struct ih_predicted *predicted);

/* The heads of a frame in one list: first the detections, then the predicted ones. The index is
 * below the sum of both counts; the verdict is that of the frame of the last ih_tracks_update. */
const struct ih_detection *ih_tracks_head(const struct ih_detections *detections,
                                          const struct ih_predicted *predicted, int32_t index);
struct ih_verdict ih_tracks_verdict(const struct ih_tracks *tracks,
                                    const struct ih_detections *detections, int32_t index);

IH_END_DECLS

#endif
