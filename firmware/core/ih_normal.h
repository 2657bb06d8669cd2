/* ih_normal - normal equations N = R^T R of rows without a sign, a few rows at a time.
 *
 * In:    IH_NORMAL_ROWS rows of R, IH_NORMAL_TERMS entries each.
 * Out:   lines of N's lower triangle, to which the rows' products are added. Sums of 64 bits are exact,
 *        so they do not depend on the order.
 * Overflow: none while the squares in a column, of all rows that are in N, sum below 2^64: no other
 *        sum is greater.
 * Cost:  rows x 10,944 multiply-adds. Several rows at a time because each entry of N, of 84 kB, is
 *        then read and written the less often.
 */
#ifndef IH_NORMAL_H
#define IH_NORMAL_H

#include <stdbool.h>
#include <stdint.h>

#include "ih_config.h"
#include "ih_types.h"

#define IH_NORMAL_TERMS 144
/* Lines of N are padded to whole groups of so many entries, which fill the widest vectors: what stands
 * behind the diagonal is not used, but loops need no end of their own for what is left of a group. */
#define IH_NORMAL_GROUP 8
/* Where line i of N begins, i a multiple of IH_NORMAL_GROUP; line IH_NORMAL_TERMS: the size of N. */
#define IH_NORMAL_LINE(i) ((i) * ((i) + IH_NORMAL_GROUP) / 2)

/* An entry of a row is below 2^32. The vectors of x86 multiply the lower halves of 64 bits: there rows
 * are kept as wide as that, half as many in the same room. Told by the processor, not by whether a file may
 * use vectors: all files must see the same. */
#if defined __x86_64__
#define IH_NORMAL_ROWS 8
typedef uint64_t ih_normal_entry;
#else
#define IH_NORMAL_ROWS 16
typedef uint32_t ih_normal_entry;
#endif

/* Where entry (i, 0) of N stands. */
int32_t ih_normal_line(int32_t i);

/* Add the rows' products to N's lines first .. last - 1, both multiples of IH_NORMAL_GROUP. line: where
 * line `first` begins, the others follow. To take products away that were added before, turn all bits of
 * these lines round, before and after: ~(~N + P) = N - P. */
void ih_normal_add(ih_normal_entry row[IH_NORMAL_ROWS][IH_NORMAL_TERMS], int32_t first,
                   int32_t last, uint64_t *line);

#endif
