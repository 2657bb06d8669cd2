/* ih_points - up to 361 points of the scene, one per slot of a 19x19 lattice (paper, section 2.1).
 *
 * In:    the dot table (triangulation); or a depth image and a window of it, where a head may be.
 * Out:   per slot the normalised image position and the Z depth; the field on which they stand.
 * Method: dots: t px from infinity along the line, Z = |e| / t, one division. The position is
 *        the dot's place on its line, (infinity + t dir), so that depth and position agree.
 *        Depths are limited to 1 mm .. far_mm; turned to the level frame, to IH_DEPTH_MAX_MM.
 *        range image: a 19x19 lattice is laid over the window, its pitch pitch_mm at the window's
 *        depth, its middle lower_q8 pitches below the window's. A slot takes the measured pixel
 *        nearest to it within a quarter pitch (at least a pixel), and that pixel's place; without
 *        one it is missing. Where measured pixels are rare (ih_windows) it takes one within half a
 *        pitch, and is missing only where none lies within 1.25 times their spacing, else unknown.
 * Cost:  361 divisions; of a range image at most 65 x 65 pixels a slot are read, and few where most are
 *        measured; where they are rare, the square of 2.5 times their spacing.
 * Bounds: a window's depth is at least 100 mm, so a pitch below 2^28 in Q28, saturated with its
 *        place; half of it times a focal length of 2^29 in Q16: 2^56.
 */
#ifndef IH_POINTS_H
#define IH_POINTS_H

#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "labels/ih_labels.h"
#include "points/ih_windows.h"
#include "rig/ih_rig.h"

struct ih_points_params {
    /* range images only */
    int32_t pitch_mm_q8; /* distance of lattice points at the window's depth, below 100 mm */
    int32_t lower_q8;    /* pitches; 0: the middle of the head is the middle of the lattice */
};

enum ih_point_state {
    IH_POINT_MISSING = 0, /* nothing was measured; a surface there would have been seen */
    IH_POINT_SEEN = 1,
    /* missing, but that says nothing: outside a range image, too rare, or a ray out of the level frame's view */
    IH_POINT_UNKNOWN = 2,
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

IH_BEGIN_DECLS

void ih_points_params_default(struct ih_points_params *params);

void ih_points_from_labels(const struct ih_labels *labels, const struct ih_rig *rig,
                           struct ih_points *out);

enum ih_err ih_points_from_range(const struct ih_frame *frame, const struct ih_rig *rig,
                                 const struct ih_points_params *params,
                                 const struct ih_window *window, struct ih_points *out)
    __attribute__((warn_unused_result));

IH_END_DECLS

#endif
