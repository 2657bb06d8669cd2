/* ih_samples - the samples that the surface is fitted to: points cleaned, missing dots filled in
 * (paper, section 3.1: "outliers have no influence"; the filling is ours).
 *
 * In:    points by slot, the dots' over-exposure map (NULL for a range image), rig.
 * Out:   up to 361 samples (position in field units, depth, weight) for a least-squares fit.
 * Method: 1. Clip: depth := min(depth, p8 + clip_behind), p8 the 8th percentile of the seen depths
 *           (the sorted depths' entry number count * 8 / 100): the far wall is of no interest, and the larger its
 *           step beside a head, the more the surface rings. With a dot rig the clip depth is at least clip_min: there
 *           dots are denser the nearer they are, and a near hand must not clip the head behind it. A range image's
 *           lattice has the same pitch at any depth.
 *        2. Isolated: a point with at least 3 of 8 neighbours whose clipped depth differs by more
 *           than isolated_mm from all but one of them is dropped.
 *        3. Missing dots: a dot that is not seen means that nothing is near: it becomes a far point at the clip
 *           depth, where its ray has that depth, with a small weight. Only if fewer than fill_neighbours of its 8
 *           neighbours are seen (a hole inside a dark face is no hole), and if its pixel is inside the picture and not
 *           over-exposed.
 * Cost:  each depth is counted once, those near the percentile again; for most points two of 8 neighbours decide.
 */
#ifndef IH_SAMPLES_H
#define IH_SAMPLES_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "points/ih_points.h"
#include "rig/ih_rig.h"

struct ih_samples_params {
    int32_t isolated_mm;
    int32_t clip_behind_mm, clip_min_mm;
    int32_t fill_neighbours;
    int32_t fill_root_weight_q15; /* square root of the weight; 0 = missing dots are ignored */
};

struct ih_sample {
    int32_t x_q16, y_q16; /* field units from the field's centre */
    int32_t depth_mm_q8;
    int32_t root_weight_q15; /* the row is scaled by this, <= 1 */
    int32_t slot;
    bool is_filled; /* a missing dot that was filled in */
};

struct ih_samples {
    int32_t sample_count;
    int32_t seen_count, filled_count;
    int32_t isolated_count; /* dropped as isolated */
    int32_t outside_count;  /* dropped: farther than IH_SAMPLES_REACH from the field's centre */
    int32_t nearest_mm_q8;  /* of all samples; INT32_MAX without any */
    int32_t clip_mm_q8;
    struct ih_sample sample[IH_SLOTS];
};

/* |x| and |y| of a sample in field units are below this, which bounds every basis value. */
#define IH_SAMPLES_REACH 40

IH_BEGIN_DECLS

void ih_samples_params_default(struct ih_samples_params *params);

void ih_samples_select(const struct ih_points *points, const struct ih_dots *dots,
                       const struct ih_rig *rig, const struct ih_samples_params *params,
                       struct ih_samples *out);

IH_END_DECLS

#endif
