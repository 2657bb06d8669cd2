/* ih_template - how well a mean head fits at a place, in vectors (ours).
 *
 * In:    rays and points; a centre at which a mean head is tried.
 * Out:   its rating, as ih_scan.h says.
 * Way:   in 16 bits. With e and g as in ih_ellipsoid, of a mean head, t = e.g / (1 + g.g):
 *            radius2 = e.e - (e.g) t,
 *            a point is more than b behind the entry when sqrt((1 - radius2) / (1 + g.g)) is above
 *            b - q - t, q = its depth against the centre's, all in the head's depth: squares are
 *            compared, there is no root.
 *        A centre lies on the line from the origin in its own direction c, so e is the depth times
 *        (slope - c) over the semi-axis: differences of slopes, which keep 14 bits.
 *        Rays lie column by column, and only a box is looked at. With n a ray's nearest place,
 *        (ex, ey) = n - g tau at the centre's depth and |n|, tau included, below 1.9: |ex| is below
 *        1.9 sqrt(1 + gx^2); 1 instead of 1.9 for rays through the head, which are in fewer columns.
 *        Rays beside and above are not more down than aside, in mm: as e.e is below 3.61 (1 + g.g), ey is
 *        below 1.08 sqrt(1 + g.g). g: the greatest of all.
 * Limits: rays count whose g.g is below 1. Depths 227 mm to 16.1 m, and a centre seen at a slope below 1;
 *        elsewhere there is no rating but the least.
 * Error: with D the depth in mm: e within 7.9e-7 D + 0.0009, radius2 within 4.3e-6 D + 0.0130, where
 *        the ray's nearest place is within 1.95 radii; a point's depth against the entry within
 *        0.0076 + 5.6e-7 D of the semi-axis, 1.6 mm. What is nearer to a limit may be on either side.
 * Overflow: lanes have 16 bits. e is cut at 2.75 in Q11: then e.g is below 3.9, t below 1.95, and radius2 of
 *        what is cut above 3.7. Sums of 361 values of at most 64: 23104.
 * Cost:  56 instructions for 16 rays of a box of 150, 22 more for those in columns of the head, and 400 for
 *        the box, the place and the sums: 1100 (x86-64-v3). Without vectors a ray is left as soon as it does
 *        not count.
 */
#ifndef IH_TEMPLATE_H
#define IH_TEMPLATE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_rays.h"

/* A column's rays in whole vectors, and all. */
#define IH_TEMPLATE_COLUMN 32
#define IH_TEMPLATE_RAYS (IH_GRID * IH_TEMPLATE_COLUMN)
/* No rating is less, but where there is none. */
#define IH_TEMPLATE_NONE_Q12 (-8192)

/* What is the same for all centres, column by column. */
struct ih_template_rays {
    int16_t slope_q14[2][IH_TEMPLATE_RAYS];
    int16_t g_q15[2][IH_TEMPLATE_RAYS];
    int16_t inverse_q15[IH_TEMPLATE_RAYS]; /* 1 / (1 + g.g) */
    int16_t depth_mm_q1[IH_TEMPLATE_RAYS]; /* of points; before all heads where there is none */
    int16_t inside
        [IH_TEMPLATE_RAYS]; /* values in 64ths; through the head, of what is not behind its front */
    int16_t around[IH_TEMPLATE_RAYS]; /* and beside it, of what is not far behind */
    /* Slopes across of columns, down of rows: the greatest up to one, the least from one on. */
    int16_t max_q14[2][IH_TEMPLATE_COLUMN], min_q14[2][IH_TEMPLATE_COLUMN];
    /* In 2.75 semi-axes at the centre's depth, how far from a centre rays may count; pass through. */
    int32_t aside_q12, above_q12, below_q12, through_q12;
};

IH_BEGIN_DECLS

void ih_template_prepare(const struct ih_rays *space, struct ih_template_rays *out);

/* How well a mean head fits there; IH_TEMPLATE_NONE_Q12 out of the limits. */
int32_t ih_template_score_q12(const struct ih_rays *space, const struct ih_template_rays *rays,
                              const int32_t centre_mm_q8[3]);

IH_END_DECLS

#endif
