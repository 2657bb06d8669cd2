/* ih_row - what the points of a candidate add to the equations of its fit (ours): the inner part of
 * ih_fit.
 *
 * In:    rays and points, an ellipsoid, the scale of the robust weights.
 * Out:   normal equations and right side, as ih_fit.h says what they are of.
 * Way:   which points may have a weight, and which rays may hit the ellipsoid, is told for all in
 *        vectors of 16 bits, for more rather than for fewer; of what is left each is looked at as
 *        ih_fit.h says. Rows are kept until there are IH_ROW_MAX, then their products are summed in
 *        vectors; sums are whole numbers, their order is nobody's business.
 *        Quotients by a semi-axis, and on x86-64 by the gradient's length, are products with an inverse
 *        that is worked out once, equal to ih_div_round's to the last bit (ih_share, ih_row.c).
 * Overflow: as in ih_fit.h. Slopes and residuals are below 2^16 and are lifted by as much, weighted slopes
 *        below 2^18 and by 2^18: products are below 2^36.
 * Cost:  5 comparisons of 16 bits twice for each of 361 rays, a step (without vectors most rays need one or
 *        two); a division and two roots for a point in reach; for one with a weight six quotients and 27
 *        products, which are vectors on x86-64. About 70 points a step are in reach, 60 have a weight: 29,000
 *        instructions (x86-64-v3).
 */
#ifndef IH_ROW_H
#define IH_ROW_H

#include "ih_cholesky.h"
#include "ih_ellipsoid.h"

#define IH_FIT_UNKNOWNS 6
/* Rows that are summed at once; each costs 84 bytes, twice as many on x86-64. */
#define IH_ROW_MAX 128
/* The slots in whole vectors. */
#define IH_ROW_RAYS ((IH_SLOTS + 15) / 16 * 16)

/* Where rays of which nothing is known pass, and how far the points of empty ones are. */
#define IH_ROW_NOWHERE INT16_MAX

/* All rays, rounded down; what does not fit is cut. Filled once for all fits. */
struct ih_row_rays {
    int16_t point_mm_q1[3][IH_ROW_RAYS];
    int16_t slope_q12[2][IH_ROW_RAYS];
    int32_t slope_most_q20[2];
    uint8_t seen[IH_ROW_RAYS];
};

/* An entry of a row, made positive, is below 2^32; on x86-64 it is as wide as its product, see ih_normal. */
#if defined __x86_64__
typedef uint64_t ih_row_entry;
typedef int64_t ih_row_number;
#else
typedef uint32_t ih_row_entry;
typedef int32_t ih_row_number;
#endif

struct ih_rows {
    int32_t count;
    /* What a row is made of: a place in semi-axes, and over them again, the gradient's length (ih_row.c). */
    ih_row_number place_q14[3][IH_ROW_MAX], component_q14[3][IH_ROW_MAX];
    ih_row_entry length[IH_ROW_MAX];
    ih_row_entry weight_q16[IH_ROW_MAX];
    /* By unknown, then the residual in mm Q8; each with its lift (ih_row.c). */
    ih_row_entry slope_q14[IH_FIT_UNKNOWNS + 1][IH_ROW_MAX];
    ih_row_entry weighted_q16[IH_FIT_UNKNOWNS][IH_ROW_MAX];
};

struct ih_row_scratch {
    struct ih_row_rays rays;
    struct ih_rows rows;
    uint8_t flag[IH_ROW_RAYS]; /* bit 0: its point may have a weight, bit 1: it may push */
};

struct ih_row_system {
    int64_t normal_q16[IH_CHOLESKY_PACKED(IH_FIT_UNKNOWNS)];
    int64_t right_q16[IH_FIT_UNKNOWNS]; /* mm */
};

/* Once for a space, before any fit. */
void ih_row_prepare(const struct ih_space *space, struct ih_row_rays *out);

/* What all points say of an ellipsoid; a point this far behind an entry is seen through it. */
void ih_row_collect(const struct ih_space *space, const struct ih_ellipsoid *ellipsoid,
                    int32_t scale_mm, int32_t see_through_mm, struct ih_row_scratch *scratch,
                    struct ih_row_system *out);

/* A place in the ellipsoid's units to its distance from the surface, to first order; negative
 * inside. False at the centre, where there is none. */
bool ih_row_distance(const struct ih_ellipsoid *ellipsoid, const int32_t place_q14[3],
                     int32_t *distance_mm_q8);

#endif
