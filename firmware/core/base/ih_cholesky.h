/* ih_cholesky - packed in-place factor and solve of a symmetric positive definite system.
 *
 * In:    a_q30, the lower triangle row by row (entry (i, j), j <= i, at i (i + 1) / 2 + j), scaled
 *        so that every diagonal entry is at most 1.0: then |a_ij| <= 1 as well.
 * Out:   the factor L in place, A = L L^T, diagonal included.
 * Scaling and overflow: sum_k L_ik L_jk <= sqrt(A_ii A_jj) <= 1 by Cauchy-Schwarz, so a Q60 sum
 *        stays below 2^60 + n 2^30 and the 64-bit accumulator needs no guard. A pivot (of A)
 *        that is not at least 2^-60 is zero or negative: IH_ERR_NOT_POSITIVE, *bad_pivot says
 *        which.
 * Method: entries are divided by a pivot by its inverse of 31 bits.
 * Error: a residual of about n 2^-30; docs/numerics.md has the measured figure.
 * Cost:  n^3/6 multiply-adds, n^2/2 products, n square roots and divisions.
 */
#ifndef IH_CHOLESKY_H
#define IH_CHOLESKY_H

#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"

/* Largest system: six unknowns of a head that is fitted. */
#define IH_CHOLESKY_MAX 6
#define IH_CHOLESKY_PACKED(n) ((n) * ((n) + 1) / 2)

IH_BEGIN_DECLS

/* n 1..IH_CHOLESKY_MAX. */
enum ih_err ih_cholesky_factor(int32_t *a_q30, int32_t n, int32_t *bad_pivot)
    __attribute__((warn_unused_result));

/* Solve L L^T x = b. b: any common scale, |b_i| <= 2^31 - 1, and so small that |L^-1 b| stays
 * within int32; else it is saturated. x: mantissas below 2^25 with
 * x_i = mantissa_i * 2^exponent in b's unit, exponent >= 0 as small as that allows. b and x may be
 * the same array. */
void ih_cholesky_solve(const int32_t *l_q30, int32_t n, const int32_t *b, int32_t *x_mantissa,
                       int32_t *x_exponent);

IH_END_DECLS

#endif
