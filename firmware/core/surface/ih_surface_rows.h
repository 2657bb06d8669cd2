/* ih_surface_rows - the samples' rows of the basis, and the sums of their products. Private to the surface.
 *
 * In:    samples and their weights.
 * Out:   rows of full precision, Q20; their norms and scales; sums of products of rows as short ones, weighted.
 * Error: half a step of a short row, and half a unit of the sums a call: see ih_normal_equations.
 */
#ifndef IH_SURFACE_ROWS_H
#define IH_SURFACE_ROWS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "surface/ih_samples.h"
#include "surface/ih_surface.h"
#include "surface/ih_surface_scratch.h"

#define IH_SURFACE_ROW_SCALE_BITS 17

IH_BEGIN_DECLS

/* Grid steps between two centres. */
static inline int32_t ih_surface_centre_steps(const struct ih_surface_scratch *scratch)
{
    return IH_SURFACE_CENTRES_STEPS / scratch->centres;
}

/* A weight, enlarged as all are: at most 2^30. */
static inline int64_t ih_surface_weight_q30(const struct ih_surface_scratch *scratch,
                                            int32_t root_weight_q15)
{
    const int64_t root_q15 = (int64_t)root_weight_q15 << scratch->weight_shift;
    return root_q15 * root_q15;
}

/* The root weight of sample i. That of a moved one stays as it was. */
static inline int32_t ih_surface_root_weight_q15(const struct ih_samples *samples,
                                                 const struct ih_surface_params *params,
                                                 const struct ih_surface *out, int32_t i)
{
    return params->is_moving ? samples->sample[i].root_weight_q15 : out->root_weight_q15[i];
}

/* Set the positions of the centres, and the memory of sums, factor and rows. */
void ih_surface_rows_set_centres(const struct ih_surface_params *params,
                                 struct ih_surface_scratch *scratch);

/* Fill a sample's row of the basis: sqrt(dx^2 + dy^2 + 1), Q20. */
void ih_surface_rows_fill(struct ih_surface_scratch *scratch, const struct ih_sample *sample,
                          uint32_t *row_q20);

/* The number of samples from i on whose rows follow each other in memory, up to IH_MULTIQUADRIC_ROWS. */
int32_t ih_surface_rows_together(const struct ih_samples *samples,
                                 const struct ih_surface_scratch *scratch, int32_t i);

/* The row of sample i, once ih_surface_rows_sum has worked out all rows. */
const uint32_t *ih_surface_rows_of(const struct ih_samples *samples, int32_t i,
                                   struct ih_surface_scratch *scratch);

/* Choose the enlargement of the weights. Returns false when all are 0. */
bool ih_surface_rows_set_weight_shift(struct ih_surface_scratch *scratch,
                                      const int32_t *root_weight_q15, int32_t count);

/* Diagonal of R^T W R: sums of weight * (dx^2 + dy^2 + 1), from the samples' moments. Returns whether one is below a
 * quarter of what it was: then short rows would be too short. */
bool ih_surface_rows_set_norms(struct ih_surface_scratch *scratch, const struct ih_samples *samples,
                               const int32_t *root_weight_q15);

/* Scales of short rows: no entry exceeds the basis at the farthest corner of the box around the samples, nor the root of
 * all squares' sum. And the unit of the rows' sums: no square's sum exceeds ratio * 2^28, with rounding, so that in that
 * unit all are below 2^31. */
void ih_surface_rows_set_scale(struct ih_surface_scratch *scratch,
                               const struct ih_samples *samples);

/* Work out all rows, and the sums of their products. */
void ih_surface_rows_sum(const struct ih_samples *samples, const struct ih_surface_params *params,
                         struct ih_surface_scratch *scratch, const struct ih_surface *out);

/* Exchange the contribution of a row to the sums: its root weight was before_q15. number: 0, 1 and so on. Groups of
 * IH_NORMAL_EQUATIONS_ROWS are exchanged at once; finish, with the count of all, exchanges the last ones. */
void ih_surface_rows_exchange(struct ih_surface_scratch *scratch, const uint32_t *row_q20,
                              int32_t number, int32_t before_q15, int32_t after_q15);
void ih_surface_rows_finish_exchange(struct ih_surface_scratch *scratch, int32_t count);

IH_END_DECLS

#endif
