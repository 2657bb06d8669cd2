/* ih_pose_look - where one frame's points say that a head looks (ours).
 *
 * In:     points, rig, the head's ellipsoid.
 * Out:    for each yaw and each pitch the logarithm of its likelihood.
 * Method: seen from the camera's vertical plane through the head's centre (x aside, y down, z away), its points are
 *         spread over two grids of cells, one on the head and a coarser one on the body below: bilinear
 *         weights, then 1-2-1 both ways. Each cell gives its mean depth, drawn to 0 where it has few points, and
 *         how much of the density of this rig's dots it has. With the height of the centre, the distance, the
 *         depths' uncertainty and the ellipsoid's width and height that makes IH_POSE_FEATURES numbers.
 *         Each yaw and each pitch has a mean head: for each of these numbers a line and a square, as a mean and a
 *         variance make them, less what all directions have in common. Their sum and a bias is the logarithm of
 *         the likelihood. Yaws of the other half take the mirrored numbers, so that left and right are equal.
 *         ih_pose_table.h has the mean heads and the command that made them; tools/learn/learn_pose.py says what
 *         they were learnt from: heads with hair, hats and hands.
 * Angles: yaw against the direction to the camera, positive when the face turns towards +X; pitch positive when
 *         it looks up. Cell k of yaw is at (k + 1/2) 15 - 180 degrees, of pitch at 10 k - 40.
 * Overflow: a cell has at most 361 weights of 2^8, times 2^10 of depth 2^26.5, after 1-2-1 twice 2^30.5.
 *         A sum is at most 187 times 127 * (127 * 32 + 127 * 127) = 2^28.9, and a bias of 2^15.
 * Error:  logarithms within 0.25 of the float64 reference with the same weights.
 * Cost:   361 points, 33 of them spread; 91 divisions, 33 x 374 products: at most 0.2 M instructions.
 */
#ifndef IH_POSE_LOOK_H
#define IH_POSE_LOOK_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "points/ih_points.h"
#include "rig/ih_rig.h"

#define IH_POSE_YAWS 24
#define IH_POSE_YAW_STEP_MDEG 15000
#define IH_POSE_PITCHES 9
#define IH_POSE_PITCH_STEP_MDEG 10000
#define IH_POSE_OUTPUTS (IH_POSE_YAWS + IH_POSE_PITCHES)

#define IH_POSE_COLUMNS 7 /* of both grids */
#define IH_POSE_HEAD_ROWS 9
#define IH_POSE_BODY_ROWS 4
#define IH_POSE_HEAD_CELLS (IH_POSE_COLUMNS * IH_POSE_HEAD_ROWS)
#define IH_POSE_BODY_CELLS (IH_POSE_COLUMNS * IH_POSE_BODY_ROWS)
#define IH_POSE_FEATURES (2 * IH_POSE_HEAD_CELLS + 2 * IH_POSE_BODY_CELLS + 5)
/* Those of yaw below 0 and those of pitch. */
#define IH_POSE_MEANS (IH_POSE_YAWS / 2 + IH_POSE_PITCHES)

/* How often each yaw and each pitch is in what was learnt from. */
extern const uint16_t ih_pose_prior_q16[IH_POSE_OUTPUTS];

struct ih_pose_means {
    int8_t line_q5[IH_POSE_MEANS][IH_POSE_FEATURES]; /* of logarithms to the base of 2 */
    int8_t square_q5[IH_POSE_MEANS][IH_POSE_FEATURES];
    int32_t bias_q10[IH_POSE_MEANS]; /* less the logarithm of the prior */
};

/* As they were learnt. */
extern const struct ih_pose_means ih_pose_means;

struct ih_pose_likelihood {
    int32_t log2_q10[IH_POSE_OUTPUTS]; /* yaws, then pitches; each group up to a constant */
};

/* Sums of a grid's cells: weights, and weights times depths. */
struct ih_pose_cells {
    int32_t weight_q8[IH_POSE_HEAD_CELLS];
    int32_t depth_mm_q10[IH_POSE_HEAD_CELLS];
};

struct ih_pose_look_scratch {
    struct ih_pose_cells cells;
    int8_t feature_q5[2][IH_POSE_FEATURES]; /* as seen, and mirrored */
};

IH_BEGIN_DECLS

/* The numbers that are looked at, scratch->feature_q5. False where the head's centre is not before the camera
 * or fewer than points_min points lie on the grid of the head: then nothing is known. */
bool ih_pose_look_features(const struct ih_points *points, const struct ih_rig *rig,
                           const struct ih_ellipsoid *head, int32_t points_min,
                           struct ih_pose_look_scratch *scratch);

/* From scratch->feature_q5, both rows of it. */
void ih_pose_look_weigh(const struct ih_pose_means *means,
                        const struct ih_pose_look_scratch *scratch, struct ih_pose_likelihood *out);

IH_END_DECLS

#endif
