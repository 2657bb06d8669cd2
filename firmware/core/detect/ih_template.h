/* ih_template - how well a mean head fits at a centre, in vectors (ours).
 *
 * In:     rays and points; a centre at which a mean head is tried.
 * Out:    its score, as ih_scan.h says.
 * Method: in 16 bits. With e and g as in ih_ellipsoid, of a mean head, t = e.g / (1 + g.g):
 *             radius2 = e.e - (e.g) t,
 *             a point is more than b behind the entry when sqrt((1 - radius2) / (1 + g.g)) is above
 *             b - q - t, q = its depth against the centre's, all in semi-axes of depth: squares are
 *             compared, so there is no root.
 *         A centre lies on the line from the origin in its own direction c, so e is the depth times
 *         (slope - c) over the semi-axis: differences of slopes, which keep 13 bits.
 *         Rays lie column by column, and only those of a bounding box are computed. With n a ray's
 *         nearest point to the centre, (ex, ey) = n - g tau at the centre's depth and |n|, tau
 *         included, below 1.9: |ex| is below 1.9 sqrt(1 + gx^2); 1 instead of 1.9 for rays through the
 *         head, which are in fewer columns. Rays beside and above are not more down than aside, in mm:
 *         as e.e is below 3.61 (1 + g.g), ey is below 1.08 sqrt(1 + g.g). g: the maximum of all rays.
 * Limits: only rays with g.g below 2: up to 58 degrees above or below the horizon, 48 to the side. Depths 227 mm to
 *         16.1 m, and a centre seen at a slope below 2; elsewhere the score is IH_TEMPLATE_NONE_Q12.
 * Error:  with D the depth in mm: e within 1.58e-6 D + 0.0009, radius2 within 8.6e-6 D + 0.0135, where
 *         the ray's nearest point is within 1.95 radii; a point's depth against the entry within
 *         0.0095 + 1.12e-6 D of the semi-axis, 2.7 mm. What is nearer to a limit may be on either side.
 * Overflow: lanes have 16 bits. e is limited to 3.4 in Q11: then e.g is below 6.8, t below 2.41, and
 *         radius2 of what was limited is above 3.75, beyond the ring. What follows from a radius2 above 1 may wrap in the
 *         lanes of rays that pass beside the head; these do not count. Sums of 361 values of at most 64: 23104.
 * Cost:   58 instructions for 16 rays of a box of 150, 22 more for those in columns of the head, and 400
 *         for the box, the candidate and the sums: 1100 (x86-64-v3). Without vectors a ray ends at its
 *         first failed comparison.
 */
#ifndef IH_TEMPLATE_H
#define IH_TEMPLATE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_rays.h"

/* Cells of a column in whole vectors, and of all columns; IH_GRID of a column hold a ray. */
#define IH_TEMPLATE_COLUMN 32
#define IH_TEMPLATE_CELLS (IH_GRID * IH_TEMPLATE_COLUMN)
/* Below every score: the centre is outside of the limits. */
#define IH_TEMPLATE_NONE_Q12 (-8192)

/* The rays in 16 bits, column by column: the same for all centres. */
struct ih_template_table {
    int16_t slope_q13[2][IH_TEMPLATE_CELLS];
    int16_t g_q14[2][IH_TEMPLATE_CELLS];
    int16_t inverse_q15[IH_TEMPLATE_CELLS]; /* 1 / (1 + g.g) */
    int16_t depth_mm_q1[IH_TEMPLATE_CELLS]; /* of points; before all heads where there is none */
    int16_t inside[IH_TEMPLATE_CELLS];      /* 64ths: of a ray through the head, nearer than it */
    int16_t around[IH_TEMPLATE_CELLS];      /* 64ths: of a ray beside it, not open */
    /* Slopes across of columns, down of rows: the maximum up to one, the minimum from one on. */
    int16_t max_q13[2][IH_TEMPLATE_COLUMN], min_q13[2][IH_TEMPLATE_COLUMN];
    /* Half sides of a box around a centre, in 3.4 semi-axes; of the rays through the head. */
    int32_t aside_q12, above_q12, below_q12, through_q12;
};

IH_BEGIN_DECLS

void ih_template_prepare(const struct ih_rays *rays, struct ih_template_table *out);

/* How well a mean head fits there; IH_TEMPLATE_NONE_Q12 outside of the limits. */
int32_t ih_template_score_q12(const struct ih_rays *rays, const struct ih_template_table *table,
                              const int32_t centre_mm_q8[3]);

IH_END_DECLS

#endif
