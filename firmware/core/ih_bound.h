/* ih_bound - how much a place of the scan can score at most, and most of what it scores, in vectors
 * (ours).
 *
 * In:    rays and points; a centre at which a mean head is tried.
 * Out:   a bound that the score of ih_scan never exceeds. It decides what is looked at closely and
 *        nothing else: of 320 places about 21 are. Of these, which rays surely count as what, and
 *        those of which that is not sure, seven of a hundred.
 * Way:   what ih_scan does, in 16 bits, with everything that rounding leaves open taken for the
 *        better. With e and g as in ih_ellipsoid, of a mean head, t = e.g / (1 + g.g):
 *            radius2 = e.e - (e.g) t,
 *            a point is more than b behind the entry when sqrt((1 - radius2) / (1 + g.g)) is above
 *            b - q - t, q = its depth against the centre's, all in the head's depth: squares are
 *            compared, there is no root.
 *        A centre lies on the line from the origin in its own direction c, so e is the depth times
 *        (slope - c) over the semi-axis: differences of slopes, which keep 14 bits.
 *        A ray surely in counts with its value, one that may be in counts if that is positive; the
 *        sums are then divided by the fewest rays, or the most when they are negative.
 *        Rays lie column by column, and only a box is looked at. With n a ray's nearest place,
 *        (ex, ey) = n - g tau at the centre's depth and |n|, tau included, below 1.9: |ex| is below
 *        1.9 sqrt(1 + gx^2); 1 instead of 1.9 for rays through the head, which are in fewer columns.
 *        Rays beside and above are not more down than aside in mm, so ny is below 1.08; with
 *        tau = -(nx gx + ny gy), ey is below 1.08 (1 + gy^2) + 1.9 |gx gy|. g: the greatest of all.
 * Limits: slopes whose g.g is below 1, depths 226 mm to 16.3 m, and a centre seen at a slope below 1;
 *        elsewhere the bound is the greatest score.
 * Error: with D the depth in mm: e within 7.9e-7 D + 0.0009, radius2 within 4.3e-6 D + 0.0130, where
 *        the ray's nearest place is within 1.95 radii: IH_BOUND_MARGIN_Q10. A point's depth against
 *        the entry: 0.0076 + 5.6e-7 D of the semi-axis, 1.6 mm: IH_BOUND_DEPTH_MM. Places beside and
 *        below: 2.0e-6 D + 0.0046 of a semi-axis, half of the margin.
 * Overflow: lanes have 16 bits. e is cut at 3.99 in Q11; rays within the limit have e below 2.74,
 *        e.g and t below that. Beyond the limit e.g may wrap: such rays are masked. Sums of 361
 *        values of at most 64: 23104.
 * Cost:  a bound: 66 vector instructions for 16 rays of a box of 150, 95 more for those in columns
 *        of the head: 1850 (x86-64-v3). A verdict twice that. Without vectors a ray is left as soon as
 *        it does not count.
 */
#ifndef IH_BOUND_H
#define IH_BOUND_H

#include "ih_ellipsoid.h"

/* A column's rays in whole vectors, and all. */
#define IH_BOUND_COLUMN 32
#define IH_BOUND_RAYS (IH_GRID * IH_BOUND_COLUMN)
/* Added to limits of radius2 and taken from them: this and the depth in mm over 200. */
#define IH_BOUND_MARGIN_Q10 15
/* Added to limits of depth. */
#define IH_BOUND_DEPTH_MM 2
/* No score is greater: 1 + 0.6. */
#define IH_BOUND_MOST_Q12 6554

/* What is the same for all centres, column by column. */
struct ih_bound_rays {
    int16_t slope_q14[2][IH_BOUND_RAYS];
    int16_t g_q15[2][IH_BOUND_RAYS];
    int16_t inverse_q15[IH_BOUND_RAYS]; /* 1 / (1 + g.g) */
    int16_t reach_q10[IH_BOUND_RAYS];   /* e.e of rays that may count is below */
    int16_t depth_mm_q1[IH_BOUND_RAYS];
    int16_t seen[IH_BOUND_RAYS];   /* all bits or none */
    int16_t inside[IH_BOUND_RAYS]; /* value of a ray without a point, in 64ths; through the head */
    int16_t around[IH_BOUND_RAYS]; /* and beside it */
    int16_t least_q14[2][IH_GRID], most_q14[2][IH_GRID]; /* slope across of columns, down of rows */
    /* In 3.99 semi-axes at the centre's depth, how far from a centre rays may count; pass through. */
    int32_t aside_q12, above_q12, below_q12, through_q12;
    bool is_usable;
};

/* What the rays are worth of which 16 bits can tell, as ih_scan counts them, and the others. */
struct ih_bound_verdict {
    int32_t on, nearer, empty, far; /* through the head; unknown ones are worth as much as nearer */
    int32_t open, open_empty, closed, unknown; /* beside and above it */
    int32_t unsure_count;
    int16_t unsure[IH_SLOTS];         /* slots */
    int16_t is_unsure[IH_BOUND_RAYS]; /* all bits or none */
};

void ih_bound_prepare(const struct ih_space *space, struct ih_bound_rays *out);

/* At least what ih_scan_score_q12 says of a mean head there. */
int32_t ih_bound_score_q12(const struct ih_space *space, const struct ih_bound_rays *rays,
                           const int32_t centre_mm_q8[3]);

/* All rays that may count are counted or listed. */
void ih_bound_judge(const struct ih_space *space, const struct ih_bound_rays *rays,
                    const int32_t centre_mm_q8[3], struct ih_bound_verdict *out);

#endif
