/* ih_normal_solve - the unknowns of factored normal equations.
 *
 * In:    the factor F of ih_normal_equations, Q27, and a right side b. |F^-T b| stays within int32, or is saturated.
 * Out:   x with F^T F x = b: mantissas below 2^25 with x_i = mantissa_i * 2^exponent in b's unit. The exponent is the
 *        smallest that allows this, and at least 0.
 * Cost:  term_count^2 products, 2 term_count divisions.
 */
#ifndef IH_NORMAL_SOLVE_H
#define IH_NORMAL_SOLVE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"

IH_BEGIN_DECLS

#define IH_NORMAL_SOLVE_EXPONENT_MAX 62

/* b and x may be the same array. Returns false, and x is undefined, if the exponent would exceed
 * IH_NORMAL_SOLVE_EXPONENT_MAX: the matrix was not positive. */
bool ih_normal_solve(const int32_t *line, int32_t term_count, const int32_t *b, int32_t *x_mantissa,
                     int32_t *x_exponent);

IH_END_DECLS

#endif
