/* ih_points - up to 361 points of the scene, one per slot of a 19x19 lattice (paper, section 2.1).
 *
 * In:    the dot table (triangulation), or a depth image.
 * Out:   per slot the normalised image position and the Z depth; the field on which they stand.
 * Way:   dots: t px from infinity along the line, Z = |e| / t, one division. The position is
 *        the dot's place on its line, (infinity + t dir), so that depth and position agree.
 *        range image: a 19x19 lattice is laid over the image part of interest: its pitch is a
 *        head's (pitch_mm at the depth of the nearest tenth of the measured pixels), its centre
 *        the middle of what is near. Each slot takes the nearest valid pixel within a quarter
 *        pitch, nearest to the slot first.
 * Cost:  361 divisions; a range image is read once at every IH_POINTS_STEP-th pixel.
 */
#ifndef IH_POINTS_H
#define IH_POINTS_H

#include "ih_labels.h"

struct ih_points_params {
    int32_t pitch_mm_q8; /* range images: distance of lattice points at the depth of interest */
    int32_t reach_mm;    /* range images: what lies this far behind the nearest is "near" */
};

enum ih_point_state {
    IH_POINT_MISSING = 0,  /* nothing was measured; a surface there would have been seen */
    IH_POINT_SEEN = 1,
    IH_POINT_UNKNOWN = 2,  /* missing, but that says nothing: outside the frame or over-exposed */
};

struct ih_point {
    int32_t x_q28, y_q28; /* normalised; for one that is not seen its place at far_mm */
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
