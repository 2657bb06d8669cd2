/* ih_fit_equations - the normal equations of a fit's step, summed over the points of a candidate (ours): the
 * inner part of ih_fit.
 *
 * In:     rays and points, an ellipsoid, the scale of the robust weights.
 * Out:    normal equations and right side; ih_fit.h says of what.
 * Method: comparisons of 16 bits select the points that may have a weight and the rays that may hit the
 *         ellipsoid, too many rather than too few; all other work is for those alone. Rows are kept until
 *         there are IH_FIT_ROWS_MAX, then their products are summed in vectors; sums are exact until all
 *         rows are in them: the order does not matter.
 * Overflow: as in ih_fit.h. Rows have 16 bits: slopes by the centre are at most 1 (Q14), by ln below 3.6
 *         (Q13), weighted residuals 15 mm at most, of a push (Q10). A product is below 1 * 1 in Q28, 2.6 in
 *         Q26, 1.6 in Q27 or 15 in Q24: 2^28.
 * Cost:   5 comparisons of 16 bits twice for each of 361 rays, a step (without vectors most rays need one or
 *         two); for a point in reach 12 products of 32 bits, two roots and a weight; for one with a weight 12
 *         products, and 27 of 16 bits. About 85 points a step are in reach, 70 have a weight.
 */
#ifndef IH_FIT_EQUATIONS_H
#define IH_FIT_EQUATIONS_H

#include <stdint.h>

#include "base/ih_cholesky.h"
#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_fit_weights.h"
#include "detect/ih_rays.h"

struct ih_fit_scratch {
    struct ih_fit_rows rows;
    /* A bit for each slot: its point may have a weight; its ray may push. */
    uint32_t may_weigh[IH_RAYS_WORDS], may_push[IH_RAYS_WORDS];
};

struct ih_fit_equations {
    int64_t normal_q16[IH_CHOLESKY_PACKED(IH_FIT_UNKNOWNS)];
    int64_t right_q16[IH_FIT_UNKNOWNS]; /* mm */
};

IH_BEGIN_DECLS

/* Sums over all points; a point this far behind an entry is seen through the ellipsoid. */
void ih_fit_equations_collect(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                              int32_t scale_mm, int32_t see_through_mm,
                              struct ih_fit_scratch *scratch, struct ih_fit_equations *out);

IH_END_DECLS

#endif
