/* ih_multiquadric - the surface's multiquadrics sqrt(dx^2 + dy^2 + 1), and sums of them.
 *
 * In:    squares, Q18: 1 and more, below 2^13; coefficients.
 * Out:   their roots, Q20, rounded down; sums of products, exact.
 * Method: a table of chords. 32 bits suffice throughout, so vectors have 4 or 8 roots. Plain C takes the same steps.
 * Error: relative 2^-21.8, and one step down.
 * Cost:  5 instructions a root with AVX2, 7 with NEON, 20 in plain C.
 */
#ifndef IH_MULTIQUADRIC_H
#define IH_MULTIQUADRIC_H

#include <stdint.h>

#include "base/ih_config.h"

/* Squares in a line: 8 or 12. Vectors have 4 or 8. */
#define IH_MULTIQUADRIC_ACROSS_MAX 12
/* Maximum number of entries of a sample's row. */
#define IH_MULTIQUADRIC_TERMS_MAX (IH_MULTIQUADRIC_ACROSS_MAX * IH_MULTIQUADRIC_ACROSS_MAX)

IH_BEGIN_DECLS

/* The roots of across[i] + down[k], line by line: one line for each of down. */
void ih_multiquadric_roots(const uint32_t *across_q18, int32_t across_count,
                           const uint32_t *down_q18, int32_t down_count, uint32_t *root_q20);

/* Maximum number of rows of one call; they follow each other in memory. */
#define IH_MULTIQUADRIC_ROWS 4

/* The sum of each row's basis[i] * coefficient[i], i below term_count, a multiple of 16. The sum of the positive products and
 * that of the negative ones are below 2^62. */
void ih_multiquadric_sum(const uint32_t *basis_q20, int32_t row_count, const int32_t *coefficient,
                         int32_t term_count, int64_t sum[IH_MULTIQUADRIC_ROWS]);

/* Add each row's basis[i] times its factor to sum[i]. */
void ih_multiquadric_add(const uint32_t *basis_q20, int32_t row_count,
                         const int32_t factor[IH_MULTIQUADRIC_ROWS], int64_t *sum,
                         int32_t term_count);

/* Sums along half a row of nodes, `width` of them, a multiple of 8: begin, and coefficient[k * count + i] *
 * line[k][i * width + x] for each k below line_count and i below count, an even number. Lines are below 2^31, and all
 * sums below 2^63 in size. */
void ih_multiquadric_lines(const int32_t *coefficient, const uint32_t *const *line_q20,
                           int32_t line_count, int32_t count, int32_t width, int64_t begin,
                           int64_t *sum);

IH_END_DECLS

#endif
