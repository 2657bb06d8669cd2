/* ih_pose - where heads look: yaw and pitch of each followed head, or that it is not known (ours).
 *
 * In:     points, rig, detections, tracks, the time of the frame; what was believed before.
 * Out:    in each entry of the result that is a head: yaw, pitch, a standard deviation each, and whether they are
 *         known.
 * Method: a belief for each track, probabilities of IH_POSE_YAWS yaws at IH_POSE_RATES rates of turning, and of
 *         IH_POSE_PITCHES pitches. It begins as the distribution that was learnt from. Time turns it by the rates
 *         and spreads it, in steps in proportion to the time, and mixes in leak of the beginning, so that a
 *         frame may overrule what was before. A detected head multiplies it by the frame's likelihood
 *         (ih_pose_look), to the power follow once there was a frame before: errors of successive frames are
 *         alike. The power of yaw is multiplied by how probable the head is by this frame: where it may be none, or
 *         is cut off, looks err most. A predicted head only spreads. The yaw is the mean over span cells on both
 *         sides of the most probable one, known when these hold known_min of the belief and the standard deviation
 *         is at most sigma_max; front and back under long hair make two peaks, and it is not known. The pitch is
 *         the mean. Beliefs are of the level frame (ih_level), what is said of the camera's; pitches are within
 *         40 degrees of the level.
 *         Of a depth image with several windows the points are those of the best one: a head that only another
 *         window has may look anywhere.
 * Overflow: probabilities are at most 2^16 in Q16; a power of 2 is 2^16 in Q16: products 2^32, sums of 72 2^38.2.
 *         A cell's distance from the mean is at most 60000 mdeg, its square times 2^16 2^47.8.
 * Error:  probabilities within 2^-10, angles within 0.2 degrees of the float64 reference.
 * Cost:   ih_pose_look for each head that is detected; 12 steps of 153 cells at most.
 */
#ifndef IH_POSE_H
#define IH_POSE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_detections.h"
#include "points/ih_points.h"
#include "pose/ih_pose_look.h"
#include "rig/ih_rig.h"
#include "tracks/ih_result.h"
#include "tracks/ih_tracks.h"

/* Towards -X, none, towards +X. */
#define IH_POSE_RATES 3

struct ih_pose_axis {
    int32_t follow_q8; /* power of a frame's likelihood after another */
    int32_t leak_q16;  /* of the beginning in what was believed before; above 0 */
    int32_t side_q16;  /* of a cell goes to each neighbour in a step; up to a quarter */
};

struct ih_pose_params {
    int32_t points_min; /* on the head, for a look */
    struct ih_pose_axis yaw, pitch;
    int32_t step_us;       /* of time that one step of spreading stands for */
    int32_t rate_q16;      /* of a cell that a turning head's yaw goes on in a step; up to a half */
    int32_t rate_side_q16; /* of a rate goes to each neighbour in a step; up to a quarter */
    int32_t span; /* cells on each side of the most probable yaw; 0 .. IH_POSE_YAWS / 2 - 1 */
    int32_t known_min_q16;
    int32_t sigma_max_mdeg;
    int32_t yaw_sigma_mdeg, pitch_sigma_mdeg; /* of what a belief does not know of; below 2^17 */
};

struct ih_pose_belief {
    int32_t track_id;
    /* Probabilities, the yaws of one rate after those of another; a certain one is the largest number. */
    uint16_t yaw_q16[IH_POSE_RATES * IH_POSE_YAWS], pitch_q16[IH_POSE_PITCHES];
    int64_t time_us;
};

struct ih_pose {
    int32_t belief_count;
    struct ih_pose_belief belief[IH_TRACKS_MAX];
};

struct ih_pose_scratch {
    struct ih_pose_look_scratch look;
    struct ih_pose_likelihood likelihood;
};

IH_BEGIN_DECLS

void ih_pose_params_default(struct ih_pose_params *params);

/* result: of this frame, from the detections and the tracks. */
void ih_pose_update(struct ih_pose *pose, const struct ih_pose_params *params,
                    const struct ih_points *points, const struct ih_rig *rig,
                    const struct ih_detections *detections, const struct ih_predicted *predicted,
                    const struct ih_tracks *tracks, struct ih_pose_scratch *scratch,
                    struct ih_result *result);

/* The parts, for tests: a new belief; one after a time; one after a frame; what it says. */
void ih_pose_begin(int32_t track_id, int64_t time_us, struct ih_pose_belief *out);
void ih_pose_wait(struct ih_pose_belief *belief, const struct ih_pose_params *params,
                  int64_t time_us);
void ih_pose_learn(struct ih_pose_belief *belief, const struct ih_pose_likelihood *likelihood,
                   int32_t yaw_power_q8, int32_t pitch_power_q8);
void ih_pose_conclude(const struct ih_pose_belief *belief, const struct ih_pose_params *params,
                      const int32_t centre_mm_q8[3], struct ih_head_pose *out);

IH_END_DECLS

#endif
