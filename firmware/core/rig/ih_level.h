/* ih_level - a virtual camera that hangs level, at the real one's centre of projection (ours).
 *
 * In:    up of the calibration, a unit vector of the camera frame; all 0 is level, as (0, -1, 0).
 * Out:   a rotation from the camera frame to the level frame. What looks for heads works in that frame, from points to
 *        tracks; dots, alignment and labels know nothing of it. Results are turned back.
 * Method: the roll is taken out wholly, the tilt up to 45 degrees: slopes are tangents, and grow without bound
 *        with it. What is seen at a slope of IH_RIG_TAN_MAX or more in the level frame is out of view there. A level
 *        camera's rotation is none: every coordinate stays as it is.
 * Cost:  nothing for a level camera; else nine products and two divisions a point.
 * Error: x, y: 3 steps at a slope of 2; the rotation 2^-29 in each entry.
 * Overflow: x and y below 8 in Q28, 2^31, times 2^30: three terms 2^62.2.
 */
#ifndef IH_LEVEL_H
#define IH_LEVEL_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "rig/ih_rig.h"

IH_BEGIN_DECLS

/* Fill the rotation of rig->calibration.up_q30; IH_ERR_UP when that is no unit vector, or nearly along the optical axis. */
enum ih_err ih_level_init(struct ih_rig *rig);

/* Normalised coordinates of the camera to those of the level frame, in place. Returns a depth of 1 in the camera frame
 * as a depth in the level one, Q28; 0 when it is out of view there, x and y are limited then. */
int32_t ih_level_rotate(const struct ih_rig *rig, int32_t *x_q28, int32_t *y_q28);

/* And back; 0 when it is out of the camera's view. */
int32_t ih_level_rotate_back(const struct ih_rig *rig, int32_t *x_q28, int32_t *y_q28);

/* The slopes of a dot's ray in the level frame; false when it is out of view there. */
bool ih_level_ray(const struct ih_rig *rig, int32_t slot, int32_t *slope_x_q28,
                  int32_t *slope_y_q28);

/* Normalised coordinates of a dot at a depth, both in the level frame; depth_mm_q8 > 0. False when its ray is out of view
 * there: a camera that looks down has rays that pass its feet. */
bool ih_level_dot_at(const struct ih_rig *rig, int32_t slot, int32_t depth_mm_q8, int32_t *x_q28,
                     int32_t *y_q28);

/* The frame's pixel where a direction of the level frame is seen; false outside of the frame. */
bool ih_level_sees(const struct ih_rig *rig, int32_t x_q28, int32_t y_q28, int32_t *u_px_q12,
                   int32_t *v_px_q12);

/* A point of the level frame as one of the camera's, in place. */
void ih_level_point_back(const struct ih_rig *rig, int32_t point_mm_q8[3]);

/* Where second moments are taken, and their unit along each axis of the level frame, as a fraction of the depth there:
 * step_q28 times multiple / divisor. */
struct ih_level_place {
    int32_t x_q28, y_q28;
    int32_t step_q28[3];
    int32_t multiple, divisor;
};

struct ih_level_ellipse {
    int32_t a_px_q12, b_px_q12; /* semi-axes, a >= b */
    int32_t angle_mdeg;         /* of a, from +u towards +v, 0 .. 179999 */
};

/* The ellipse of these second moments as the picture shows it, without the lens' distortion. */
struct ih_level_ellipse ih_level_ellipse(const struct ih_rig *rig,
                                         const struct ih_level_place *place,
                                         const int32_t moment_q16[3][3]);

IH_END_DECLS

#endif
