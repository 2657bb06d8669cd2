/* ih_normal - the Gram matrix N = R^T R of small whole numbers, 16 rows at a time.
 *
 * In:    rows of IH_NORMAL_TERMS entries 0 .. IH_NORMAL_MOST, two to a word: the first in its lower half, the
 *        second in its upper half. A row that is not there is zero.
 * Out:   lines of N's lower triangle, in units of 2^shift: the sum over 16 rows is exact, then rounded and
 *        added. So it does not depend on the processor, but on which rows come together.
 * Overflow: 16 products are below 2^32 with the rounding; the difference of 8 and 8 is within 2^31. Sums
 *        stay below 2^31 if the greatest column's squares over 2^shift do, with half a unit a call.
 * Error: half a unit a call.
 * Cost:  rows x 10,944 multiply-adds, of which x86 does 16 or 8 with one instruction, Cortex-M with DSP two.
 */
#ifndef IH_NORMAL_H
#define IH_NORMAL_H

#include <stdbool.h>
#include <stdint.h>

#include "ih_config.h"
#include "ih_types.h"

#define IH_NORMAL_TERMS 144
#define IH_NORMAL_PAIRS 8
#define IH_NORMAL_ROWS (2 * IH_NORMAL_PAIRS)
#define IH_NORMAL_MOST 16383 /* 16 of its squares, and 2^15 for rounding, are below 2^32 */
#define IH_NORMAL_SHIFT_MOST 16
/* Lines of N are padded to whole groups of so many entries, which fill the widest vectors: what stands
 * behind the diagonal is not used, but loops need no end of their own for what is left of a group. */
#define IH_NORMAL_GROUP 8
/* Where line i of N begins, i a multiple of IH_NORMAL_GROUP; line IH_NORMAL_TERMS: the size of N. */
#define IH_NORMAL_LINE(i) ((i) * ((i) + IH_NORMAL_GROUP) / 2)

/* Where entry (i, 0) of N stands. */
int32_t ih_normal_line(int32_t i);

/* What rows must be aligned to: SSE2 then multiplies from memory. */
#define IH_NORMAL_ALIGNMENT 16

/* Add the products of all rows. shift 1..IH_NORMAL_SHIFT_MOST. */
void ih_normal_add(uint32_t pair[IH_NORMAL_PAIRS][IH_NORMAL_TERMS], int shift, int32_t *normal);

/* Add those of each pair's first row, take away those of its second. */
void ih_normal_change(uint32_t pair[IH_NORMAL_PAIRS][IH_NORMAL_TERMS], int shift, int32_t *normal);

#endif
