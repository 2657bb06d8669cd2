/* ih_samples - what the surface is to be fitted to: points cleaned, missing dots filled in
 * (paper, section 3.1: "outliers have no influence"; the filling is ours).
 *
 * In:    points by slot, the dots' over-exposure map (NULL for a range image), rig.
 * Out:   up to 361 rows (place in field units, depth, weight) for the least-squares fit.
 * Way:   1. Clip: depth := min(depth, p8 + clip_behind), p8 the 8th percentile of the seen depths
 *           (the sorted depths' entry number count * 8 / 100): the surface has no business with the
 *           far wall, and the higher its step beside a head, the more it rings. With a dot rig the
 *           clip is at clip_min or farther: there the dots stand the denser the nearer they are,
 *           and a near hand must not clip the head behind it. A range image's lattice has the same
 *           pitch at any depth.
 *        2. Isolated: a point with at least 3 of 8 neighbours whose clipped depth differs by more
 *           than isolated_mm from all but one of them is dropped.
 *        3. Missing dots: a dot that is not seen says that nothing is there: it enters as a far
 *           point at the clip depth, at the place where its ray shows there, with a small weight.
 *           Only where fewer than fill_neighbours of its 8 neighbours are seen (a hole inside a
 *           dark face is no hole), where its place is inside the picture and not over-exposed.
 * Cost:  a depth is counted once, the few near the percentile again; of 8 neighbours two tell most points.
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
    int32_t nearest_mm_q8, clip_mm_q8;
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
