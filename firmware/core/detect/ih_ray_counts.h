/* ih_ray_counts - which rays lie where around a head, and what they say there, in vectors (ours): the outer
 * part of ih_evidence.
 *
 * In:    rays and points, an ellipsoid.
 * Out:   for each place around it that ih_evidence asks about, how many rays it has and how many of
 *        them say what is asked; and the rays of which 16 bits cannot tell, which ih_evidence looks at.
 *        Both together are what it would have found ray by ray.
 * Way:   a ray's offset at the centre's depth is its slope less the centre's, times the depth: in mm
 *        and, times the inverse of a semi-axis, in semi-axes. A place is an intersection of
 *        half-planes and rings, so how far a ray is from its nearest limit is the least of a few
 *        differences: above the margin it is surely in, below minus the margin it surely is not.
 *        Depths are compared in half mm; equal is not sure.
 * Limits: slopes below 1, the centre's too, depths 227 mm to 16.3 m, semi-axes 42 to 200 mm; elsewhere,
 *        and where there are no vectors, every ray is left to ih_evidence.
 * Error: with D the depth in mm and a the lesser semi-axis, offsets are off by less than 3 + D / 1024
 *        16ths of a mm, and by 3 + D / 8a in Q11 of a semi-axis: the direction and the slope by a step
 *        of Q14 together, and what is cut off. The margin is 5 + D / min(8 a, 900), and squares are
 *        compared in Q8, differences of offsets in Q10.
 * Overflow: lanes have 16 bits. Offsets are cut at 510 mm and 3.99 semi-axes, squares below 2^15 in Q10.
 * Cost:  363 instructions for 16 rays, of which a quarter keep what registers cannot, 720 for the
 *        rest (x86-64-v3). Of 361 rays about 15 are not sure.
 */
#ifndef IH_RAY_COUNTS_H
#define IH_RAY_COUNTS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_rays.h"

/* The slots in whole vectors. */
#define IH_RAY_COUNTS_RAYS ((IH_SLOTS + 15) / 16 * 16)

/* How many rays there are, and of how many something is true. */
struct ih_ray_counts_share {
    int32_t part, all;
};

/* Where is told in ih_evidence.h. */
struct ih_ray_counts {
    struct ih_ray_counts_share above, left, right, below, high; /* part: open */
    struct ih_ray_counts_share nothing;                         /* empty */
    struct ih_ray_counts_share body, wide, shoulder[2];         /* body */
    struct ih_ray_counts_share level;                           /* a thing at the head's depth */
    int32_t before;
};

/* Flags of a ray. */
#define IH_RAY_COUNTS_UNSURE 1 /* it may count somewhere, and was not counted */
#define IH_RAY_COUNTS_HIT 2    /* it may hit the ellipsoid */
#define IH_RAY_COUNTS_BODY 4   /* it was counted as a part of the body */

struct ih_ray_counts_scratch {
    int32_t slope_max_q20[2];
    bool is_usable;
    int16_t slope_q14[2][IH_RAY_COUNTS_RAYS];
    int16_t depth_mm_q1[IH_RAY_COUNTS_RAYS];
    int16_t seen[IH_RAY_COUNTS_RAYS], empty[IH_RAY_COUNTS_RAYS]; /* all bits or none */
    int16_t flag[IH_RAY_COUNTS_RAYS];
};

IH_BEGIN_DECLS

/* Once for a space. */
void ih_ray_counts_prepare(const struct ih_rays *space, struct ih_ray_counts_scratch *out);

/* box: through which rays pass that may hit the ellipsoid. Rays of unknown state have no flag. */
void ih_ray_counts_count(const struct ih_rays *space, const struct ih_ellipsoid *ellipsoid,
                         const struct ih_ellipsoid_box *box, struct ih_ray_counts_scratch *scratch,
                         struct ih_ray_counts *out);

IH_END_DECLS

#endif
