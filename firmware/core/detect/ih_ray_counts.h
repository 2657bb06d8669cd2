/* ih_ray_counts - how many rays pass in the regions around a head, and what they met, in vectors (ours): the
 * outer part of ih_evidence.
 *
 * In:     rays and points, an ellipsoid.
 * Out:    for each region of ih_evidence, how many rays it has and how many of them met what it is about;
 *         and the rays that 16 bits cannot decide, which ih_evidence computes one by one. Both together are
 *         the same as all rays one by one.
 * Method: a ray's offset at the centre's depth is its slope minus the centre's, times the depth: in mm
 *         and, times the inverse of a semi-axis, in semi-axes. A region is an intersection of
 *         half-planes and rings, so a ray's distance from its nearest limit is the minimum of a few
 *         differences, its slack: above the margin it is surely inside, below minus the margin outside.
 *         Depths are compared in half mm; a depth equal to a limit is not sure.
 * Limits: slopes below 1, the centre's too, depths 227 mm to 16.3 m, semi-axes 42 to 200 mm; elsewhere,
 *         and where there are no vectors, every ray is left to ih_evidence.
 * Error:  with D the depth in mm and a the shorter semi-axis, offsets are off by less than 3 + D / 1024
 *         16ths of a mm, and by 3 + D / 8a in Q11 of a semi-axis: the direction and the slope by a step
 *         of Q14 together, and the rounding. The margin is 5 + D / min(8 a, 900), and squares are
 *         compared in Q8, differences of offsets in Q10.
 * Overflow: lanes have 16 bits. Offsets are limited to 510 mm and 3.99 semi-axes, squares below 2^15 in Q10.
 * Cost:   some 350 instructions for 16 rays, of which a quarter spill registers, 720 for the
 *         candidate (x86-64-v3). Of 361 rays about 15 are not sure.
 */
#ifndef IH_RAY_COUNTS_H
#define IH_RAY_COUNTS_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_rays.h"

/* How many rays there are, and of how many something is true. */
struct ih_ray_count {
    int32_t part, all;
};

/* Regions around a head, as ih_evidence.h has them, and what their rays are about. */
enum ih_ray_region {
    IH_RAY_HIGH, /* open */
    IH_RAY_BELOW,
    IH_RAY_ABOVE,
    IH_RAY_LEFT,
    IH_RAY_RIGHT,
    IH_RAY_BODY, /* body */
    IH_RAY_WIDE,
    IH_RAY_SHOULDER_LEFT,
    IH_RAY_SHOULDER_RIGHT,
    IH_RAY_LEVEL, /* a thing at the head's depth */
    IH_RAY_REGIONS
};

struct ih_ray_counts {
    struct ih_ray_count region[IH_RAY_REGIONS];
    int32_t nothing; /* empty, of those above, left and right */
    int32_t before;
};

/* A bit for each slot. Rays of unknown state have none. */
struct ih_ray_marks {
    uint32_t unsure[IH_RAYS_WORDS]; /* not counted: 16 bits cannot decide */
    uint32_t may_hit[IH_RAYS_WORDS];
    uint32_t body[IH_RAYS_WORDS]; /* counted as a part of the body */
};

IH_BEGIN_DECLS

/* box: rays that may hit the ellipsoid pass through it. */
void ih_ray_counts_count(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                         const struct ih_ellipsoid_box *box, struct ih_ray_marks *marks,
                         struct ih_ray_counts *out);

IH_END_DECLS

#endif
