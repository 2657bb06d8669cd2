/* ih_scanline - what the points of a candidate add to the equations of its fit (ours): the inner part of
 * ih_fit.
 *
 * In:    rays and points, an ellipsoid, the scale of the robust weights.
 * Out:   normal equations and right side, as ih_fit.h says what they are of.
 * Way:   which points may have a weight, and which rays may hit the ellipsoid, is told for all in
 *        vectors of 16 bits, for more rather than for fewer; of what is left each is looked at as
 *        ih_fit.h says. Rows are kept until there are IH_FIT_EQUATIONS_MAX, then their products are summed in
 *        vectors; sums are exact until all rows are in them: the order is nobody's business.
 *        Quotients by a semi-axis are products with an inverse of 32 bits. The root of a place's square and
 *        one over the gradient's length come from the table of ih_fix, the root with one correction: within
 *        a unit of Q14, 2^-13.7. So does a weight, one over a sum squared: the table's root squared, and
 *        corrected once. Scales up to 24 mm.
 * Overflow: as in ih_fit.h. Rows have 16 bits: slopes by the centre are at most 1 (Q14), by ln below 3.6
 *        (Q13), weighted residuals 15 mm at most, of a push (Q10). A product is below 1 * 1 in Q28, 2.6 in
 *        Q26, 1.6 in Q27 or 15 in Q24: 2^28.
 * Cost:  5 comparisons of 16 bits twice for each of 361 rays, a step (without vectors most rays need one or
 *        two); for a point in reach 12 products of 32 bits, two roots and a weight, with AVX2 of eight points
 *        at once; for one with a weight 12 products, and 27 of 16 bits. About 85 points a step are in reach,
 *        70 have a weight.
 */
#ifndef IH_FIT_EQUATIONS_H
#define IH_FIT_EQUATIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_cholesky.h"
#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_rays.h"

#define IH_FIT_UNKNOWNS 6
/* Rows that are summed at once; each costs 26 bytes, on x86-64 64. */
#define IH_FIT_EQUATIONS_MAX 128
/* The slots in whole vectors. */
#define IH_FIT_EQUATIONS_RAYS ((IH_SLOTS + 15) / 16 * 16)

/* Where rays of which nothing is known pass, and how far the points of empty ones are. */
#define IH_FIT_EQUATIONS_NOWHERE INT16_MAX

/* All rays, rounded down; what does not fit is cut. Filled once for all fits. */
struct ih_fit_equations_rays {
    int16_t point_mm_q1[3][IH_FIT_EQUATIONS_RAYS];
    int16_t slope_q12[2][IH_FIT_EQUATIONS_RAYS];
    int32_t slope_max_q20[2];
    uint8_t seen[IH_FIT_EQUATIONS_RAYS];
};

struct ih_fit_equations {
    int32_t count;
#ifdef __x86_64__
    /* What slopes are made of (ih_fit_equations.c), vectors at once. */
    int32_t place_q14[3][IH_FIT_EQUATIONS_MAX], component_q14[3][IH_FIT_EQUATIONS_MAX];
    uint32_t radius2_q22[IH_FIT_EQUATIONS_MAX], length2_q22[IH_FIT_EQUATIONS_MAX],
        inverse[IH_FIT_EQUATIONS_MAX];
    uint16_t weight_q16[IH_FIT_EQUATIONS_MAX];
#endif
    /* By unknown, with 14 bits by the centre and 13 by ln of the axes; and residuals. */
    int16_t slope[IH_FIT_UNKNOWNS][IH_FIT_EQUATIONS_MAX];
    int16_t weighted[IH_FIT_UNKNOWNS][IH_FIT_EQUATIONS_MAX];
    int16_t residual_mm_q10[IH_FIT_EQUATIONS_MAX]; /* weighted */
};

struct ih_fit_equations_scratch {
    struct ih_fit_equations_rays rays;
    struct ih_fit_equations rows;
    uint8_t
        flag[IH_FIT_EQUATIONS_RAYS]; /* bit 0: its point may have a weight, bit 1: it may push */
};

struct ih_fit_equations_system {
    int64_t normal_q16[IH_CHOLESKY_PACKED(IH_FIT_UNKNOWNS)];
    int64_t right_q16[IH_FIT_UNKNOWNS]; /* mm */
};

IH_BEGIN_DECLS

/* Once for a space, before any fit. */
void ih_fit_equations_prepare(const struct ih_rays *space, struct ih_fit_equations_rays *out);

/* What all points say of an ellipsoid; a point this far behind an entry is seen through it. */
void ih_fit_equations_collect(const struct ih_rays *space, const struct ih_ellipsoid *ellipsoid,
                              int32_t scale_mm, int32_t see_through_mm,
                              struct ih_fit_equations_scratch *scratch,
                              struct ih_fit_equations_system *out);

/* A place in the ellipsoid's units to its distance from the surface, to first order; negative
 * inside. False at the centre, where there is none. */
bool ih_fit_equations_distance(const struct ih_fractions *shares, const int32_t place_q14[3],
                               int32_t *distance_mm_q8);

IH_END_DECLS

#endif
