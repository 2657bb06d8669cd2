/* ih_rotation_solve - a rotation from the normal equations of ih_rotation_estimate.
 *
 * In:    sums over slots; how far the rig is rotated from its calibration already.
 * Out:   the rotation, and the equations that its uncertainty is computed from.
 * Method: least squares with a prior about the calibration. The prior is wide at first, then as wide as
 *        the whole rotation that was found with it.
 * Overflow: stands at each product.
 *
 * Private to upkeep and its tests.
 */
#ifndef IH_ROTATION_SOLVE_H
#define IH_ROTATION_SOLVE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"

/* Sums over slots, each with its weight. */
struct ih_rotation_sums {
    int64_t normal_q16[6]; /* weight times slope times slope: xx, xy, xz, yy, yz, zz */
    int64_t right_q24[3];  /* weight times slope times distance */
};

/* Index of a row and a column in normal_q16. */
extern const int8_t ih_rotation_packed[3][3];

/* The equations in units in which the diagonal is 1, and their cofactors. */
struct ih_rotation_equations {
    int64_t root_q8[3]; /* of the diagonal: px per rad and root of the dots' number */
    int64_t right_px_q16[3];
    int64_t cofactor_q30[3][3];
    int64_t determinant_q30;
};

IH_BEGIN_DECLS

/* As in ih_fix.h, but functions: inlined a dozen times they take too much flash. */
int64_t ih_rotation_div_round(int64_t numerator, int64_t denominator);
int64_t ih_rotation_limit(int64_t value, int64_t max);

/* False: about some axis the rotation cannot be determined. wide: the equations with the wide prior. */
bool ih_rotation_solve(const struct ih_rotation_sums *sums, int64_t noise_px_q12,
                       const int32_t from_rad_q30[3], struct ih_rotation_equations *wide,
                       int32_t rotation_rad_q30[3]);

/* How much a slot's weighted distance rotates the solution about an axis, in units of its root. */
int64_t ih_rotation_lever_q26(const struct ih_rotation_equations *e, const int32_t slope_px_q4[3],
                              int axis);

IH_END_DECLS

#endif
