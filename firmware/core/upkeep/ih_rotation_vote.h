/* ih_rotation_vote - a projector that a knock or heat has turned against the camera by less than a degree.
 *
 * In:    a rig, and dots that need not lie on its lines.
 * Out:   what a turn does to each dot across its line; the rig's calibration turned; by vote of the
 *        dots, about which turn it is.
 * Method: A turn w (rad, about the axes of the camera frame, through the projector's origin) moves
 *        the dot at infinity (x, y) by
 *            (-x y wx + (1 + x^2) wy - y wz,  -(1 + y^2) wx + x y wy + x wz);
 *        the part of it across the line, in px per rad, is the dot's slope. What goes along
 *        the line looks like another depth and is not seen. So of a turn across the baseline only
 *        x y is seen: 20 px per rad where a turn along it moves all dots by 900 (docs/health.md).
 *        A vote: each slot shows how far across its line dots lie, and each of 61 x 7 x 13 turns
 *        within the limit gets points from the slots that have a dot where it says. No label is needed.
 * Cost:  a vote: dots x 361 line tests and 361 x 5551 look-ups; 361 divisions for slopes.
 * Error: a turn elected is within a step of its lattice: 0.02 degrees along the baseline, 0.2 across
 *        it, 0.1 about the camera's axis. A turned ray is off by |w|^3 / 6: 1e-6 of its length.
 * Bounds: a rig's tangents are below 4, so with a focal length of 2^13 px slopes are below 2^18 px a
 *        radian, 2^22 in Q4, times a turn of 2^23.5 in Q30.
 */
#ifndef IH_ROTATION_VOTE_H
#define IH_ROTATION_VOTE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "rig/ih_rig.h"

/* Largest rotation about each axis: 0.6 degrees. Beyond it neighbouring columns of dots are mistaken for
 * each other. */
#define IH_ROTATION_VOTE_MAX_RAD_Q30 11244049

/* Steps of the votes' lattice: about the baseline, across it, about the camera's axis. */
#define IH_ROTATION_VOTE_STEPS_ALONG 61
#define IH_ROTATION_VOTE_STEPS_ACROSS 7
#define IH_ROTATION_VOTE_STEPS_ROLL 13
#define IH_ROTATION_VOTE_VOTES \
    (IH_ROTATION_VOTE_STEPS_ALONG * IH_ROTATION_VOTE_STEPS_ACROSS * IH_ROTATION_VOTE_STEPS_ROLL)
/* How far across its line a slot looks: quarters of a pixel on both sides. */
#define IH_ROTATION_VOTE_REACH 128

struct ih_rotation_vote_slopes {
    int32_t px_q4[IH_SLOTS][3]; /* px across per rad */
};

struct ih_rotation_vote_votes {
    uint16_t vote[IH_ROTATION_VOTE_VOTES]; /* roll by roll, then across, then along */
};

struct ih_rotation_vote_scratch {
    int32_t u_px_q12[IH_DOTS_MAX], v_px_q12[IH_DOTS_MAX]; /* undistorted */
    uint8_t there[2 * IH_ROTATION_VOTE_REACH]; /* points of a slot, by place across its line */
};

struct ih_rotation_vote_winner {
    int32_t rotation_rad_q30[3];
    int32_t vote, vote_of_none, vote_mean; /* its own, those of no turn at all, all turns' */
};

IH_BEGIN_DECLS

/* The axes in the camera's X and Y along the middle dot's line, about which a turn is seen best, and
 * across it, about which it is seen worst. */
void ih_rotation_vote_axes(const struct ih_rig *rig, int32_t axis_q30[2][2]);

void ih_rotation_vote_slopes(const struct ih_rig *rig, struct ih_rotation_vote_slopes *out);

/* The nominal calibration with its rays turned. */
void ih_rotation_vote_calibration(const struct ih_calibration *nominal,
                                  const int32_t rotation_rad_q30[3], struct ih_calibration *out);

/* Add a frame's dots to the votes, which are all 0 at first; up to 11 frames: 16 points of each slot. */
void ih_rotation_vote_vote(const struct ih_dots *dots, const struct ih_rig *rig,
                           const struct ih_rotation_vote_slopes *slopes,
                           struct ih_rotation_vote_scratch *scratch,
                           struct ih_rotation_vote_votes *votes);

/* Of equal ones the first. */
void ih_rotation_vote_elect(const struct ih_rotation_vote_votes *votes, const struct ih_rig *rig,
                            struct ih_rotation_vote_winner *out);

IH_END_DECLS

#endif
