/* ih_points - up to 361 points of the scene, one per slot of a 19x19 lattice (paper, section 2.1).
 *
 * In:    the dot table (triangulation), or a depth image.
 * Out:   per slot the normalised image position and the Z depth; the field on which they stand.
 * Way:   dots: t px from infinity along the line, Z = |e| / t, one division. The position is
 *        the dot's place on its line, (infinity + t dir), so that depth and position agree.
 *        Depths are limited to 1 mm .. far_mm.
 *        range image: a 19x19 lattice is laid where a head would be: its pitch is pitch_mm at the
 *        depth of the nearest tenth of the measured pixels; it hangs from the middle of the first
 *        run of pixels, row by row, that is near (within reach_mm of that depth) over top_width_mm,
 *        with headroom pitches above it. Each slot takes the valid pixel nearest to it within a
 *        quarter pitch.
 * Cost:  361 divisions; a range image is surveyed twice at about 160 x 120 pixels.
 */
#ifndef IH_POINTS_H
#define IH_POINTS_H

#include "ih_labels.h"

struct ih_points_params {
    /* range images only */
    int32_t pitch_mm_q8;  /* distance of lattice points at the depth of what is near */
    int32_t reach_mm;     /* what lies this far behind the nearest tenth is still "near" */
    int32_t headroom_q8;  /* lattice pitches above the top of what is near */
    int32_t top_width_mm; /* narrower tops than this are not looked at */
};

enum ih_point_state {
    IH_POINT_MISSING = 0, /* nothing was measured; a surface there would have been seen */
    IH_POINT_SEEN = 1,
    IH_POINT_UNKNOWN = 2, /* missing, but that says nothing: outside a range image */
};

struct ih_point {
    int32_t x_q28, y_q28; /* normalised; of a dot that is not seen its place at far_mm */
    int32_t depth_mm_q8;  /* Z; 0 when not seen */
    int32_t state;        /* enum ih_point_state */
};

struct ih_points {
    int32_t seen_count;
    struct ih_field field;
    struct ih_point point[IH_SLOTS];
};

void ih_points_params_default(struct ih_points_params *params);

void ih_points_from_labels(const struct ih_labels *labels, const struct ih_rig *rig,
                           struct ih_points *out);

enum ih_err ih_points_from_range(const struct ih_frame *frame, const struct ih_rig *rig,
                                 const struct ih_points_params *params, struct ih_points *out)
    __attribute__((warn_unused_result));

#endif
