/* ih_surface_grid - the surface's depths at the nodes of its grid. Private to the surface.
 *
 * In:    coefficients of the basis.
 * Out:   depths, limited: see IH_SURFACE_OVERSHOOT_MM.
 * Method: all distances between nodes and centres are whole steps, so the basis is a table. Grid and centres are
 *        symmetric about the middle: sums and differences of mirrored pairs halve the products.
 * Cost:  grid x centres^2 / 2 multiply-adds, 2,300 roots.
 */
#ifndef IH_SURFACE_GRID_H
#define IH_SURFACE_GRID_H

#include "base/ih_config.h"
#include "surface/ih_samples.h"
#include "surface/ih_surface.h"
#include "surface/ih_surface_scratch.h"

IH_BEGIN_DECLS

/* Fill scratch->of.grid.table_q20: the basis at whole steps. */
void ih_surface_grid_fill_table(struct ih_surface_scratch *scratch);

/* The table and the folded coefficients replace sums and solution. */
void ih_surface_grid_evaluate(const struct ih_samples *samples, struct ih_surface_scratch *scratch,
                              struct ih_surface *out);

IH_END_DECLS

#endif
