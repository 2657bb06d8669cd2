/* ih_normal_equations - the Gram matrix N = R^T R of small whole numbers, 16 rows at a time; the factor of such a
 * matrix.
 *
 * In:    rows of term_count entries 0 .. IH_NORMAL_EQUATIONS_MAX, two to a word: the first in its lower half, the
 *        second in its upper half. A missing row is zero.
 * Out:   lines of N's lower triangle, in units of 2^shift: the sum over 16 rows is exact, then rounded and
 *        added. So it does not depend on the processor, but on which rows come together.
 * Overflow: 16 products are below 2^32 with the rounding. Sums stay below 2^31 if the squares of the largest column
 *        over 2^shift do, with half a unit a call.
 * Error: half a unit a call.
 * Cost:  rows x n (n + 8) / 2 multiply-adds, n = term_count. One instruction does 16 with AVX2, 8 with SSE2, 4 with
 *        NEON, 2 on a Cortex-M with DSP.
 */
#ifndef IH_NORMAL_EQUATIONS_H
#define IH_NORMAL_EQUATIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"

/* term_count: a multiple of 16 up to this. Memory grows with its square. */
#define IH_NORMAL_EQUATIONS_TERMS_MAX 144
#define IH_NORMAL_EQUATIONS_PAIRS 8
#define IH_NORMAL_EQUATIONS_ROWS (2 * IH_NORMAL_EQUATIONS_PAIRS)
#define IH_NORMAL_EQUATIONS_MAX 16383 /* 16 of its squares, and 2^15 for rounding, are below 2^32 */
#define IH_NORMAL_EQUATIONS_SHIFT_MAX 16
/* Lines of N are padded to whole groups of this many entries, which fill the widest vectors. Padding behind the diagonal
 * is not used, but loops need no code for a partial group. */
#define IH_NORMAL_EQUATIONS_GROUP 8
/* Index at which line i of N begins, i a multiple of IH_NORMAL_EQUATIONS_GROUP; of line term_count: the size of N. */
#define IH_NORMAL_EQUATIONS_LINE(i) ((i) * ((i) + IH_NORMAL_EQUATIONS_GROUP) / 2)

IH_BEGIN_DECLS

/* Index of entry (i, 0) of N. */
int32_t ih_normal_equations_line(int32_t i);

/* Alignment of rows in bytes: SSE2 then multiplies from memory. */
#define IH_NORMAL_EQUATIONS_ALIGNMENT 16

/* Add the products of all rows. shift 1..IH_NORMAL_EQUATIONS_SHIFT_MAX. */
void ih_normal_equations_add(
    uint32_t pair[IH_NORMAL_EQUATIONS_PAIRS][IH_NORMAL_EQUATIONS_TERMS_MAX], int32_t term_count,
    int shift, int32_t *normal);

/* Subtract them. */
void ih_normal_equations_subtract(
    uint32_t pair[IH_NORMAL_EQUATIONS_PAIRS][IH_NORMAL_EQUATIONS_TERMS_MAX], int32_t term_count,
    int shift, int32_t *normal);

/* Entries (i, j) times scale[i] and scale[j], each time over 2^step and rounded down; negative ones become 0. The first
 * product is below 2^32. */
void ih_normal_equations_scale(const int32_t *normal, int32_t term_count, const uint32_t *scale,
                               int step, int32_t *scaled);

/* Factor A = F^T F: A in lines like N's, Q30, diagonal at most 0.995; F replaces it, Q27, row by row. Unknowns are
 * eliminated from the last one on, so the remainder, and a row of F, always is the beginning of lines. Returns whether
 * the squares of all pivots were at least min_q30.
 *
 * Method: blocks of 16 rows. A number of F has two parts, of 16 bits and of 12. Products of 16 bits suffice then, which
 *        processors do several at a time: of upper parts in pairs of rows, and both mixed products of a row. Those
 *        of lower parts are omitted. Rows before fine_from, a multiple of 16, have upper parts only: the remainder for
 *        them is enlarged by a power of 4 as far as it goes.
 * Overflow: sums of products of columns are below 1 by Cauchy-Schwarz, 2^30; mixed ones below 2^30. Were A not
 *        positive, numbers wrap around, on all processors alike.
 * Error: of an entry of A in a fine row 2^-28 times its pivot and 2^-32 a row; in another row 2^-16 times its pivot,
 *        over the root of the enlargement; 2^-31 a block. So a matrix whose pivots do not soon become small has no
 *        factor with coarse rows, though a positive one has a factor with fine_from 0. A pivot's square below
 *        IH_NORMAL_EQUATIONS_PIVOT_Q30 is taken as that.
 * Cost:  n^3/6 products, twice as many more of fine rows, n^2/2 products of 64 bits, n square roots and divisions.
 */
#define IH_NORMAL_EQUATIONS_WORK (IH_NORMAL_EQUATIONS_PAIRS + IH_NORMAL_EQUATIONS_ROWS)
#define IH_NORMAL_EQUATIONS_PIVOT_Q30 1024
#define IH_NORMAL_EQUATIONS_FACTOR_BITS 27

bool ih_normal_equations_factor(
    int32_t term_count, int32_t fine_from, int32_t min_q30, int32_t *line,
    uint32_t work[IH_NORMAL_EQUATIONS_WORK][IH_NORMAL_EQUATIONS_TERMS_MAX]);

IH_END_DECLS

#endif
