/* ih_basis - the surface's multiquadrics: sqrt(dx^2 + dy^2 + 1).
 *
 * In:    squares, Q32: 1 and more, below 2^13.
 * Out:   their roots, Q20, rounded to nearest, exactly.
 * Way:   a table, one correction, and a look at the square; 32 bits all the way, so that eight fit into a
 *        vector. There is a second way of the same steps for processors without such vectors.
 * Cost:  about 8 instructions a root with vectors, 45 without.
 */
#ifndef IH_BASIS_H
#define IH_BASIS_H

#include <stdint.h>

#include "ih_config.h"
#include "ih_types.h"

/* So many at once. */
#define IH_BASIS_GROUP 8

/* count: a multiple of IH_BASIS_GROUP. */
void ih_basis_roots(const uint64_t *square_q32, int32_t count, uint32_t *root_q20);

#endif
