/* ih_camera - from pixels to normalised coordinates and back: camera matrix and lens (OpenCV's Brown
 * model).
 *
 * In:    a rig's calibration, which ih_camera_init has checked.
 * Out:   pixels or normalised coordinates, see ih_rig.h.
 * Method: undistorting takes Newton's method from a series of the inverse radial distortion, with one
 *        step and no division for nearly all lenses; where it does not converge, a fixed-point iteration.
 * Error: in the frame a pixel comes back within 0.005 px; ih_camera_init refuses any other lens.
 * Cost:  distorting 20 multiplications, undistorting 60; ih_camera_init 65 x 65 pixels, rarely twice or
 *        three times.
 */
#ifndef IH_CAMERA_H
#define IH_CAMERA_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "rig/ih_rig.h"

IH_BEGIN_DECLS

/* Check the camera of rig->calibration and fill what ih_camera_undistort needs. */
enum ih_err ih_camera_init(struct ih_rig *rig);

/* Frame pixel -> normalised coordinates. */
void ih_camera_undistort(const struct ih_rig *rig, int32_t u_px_q12, int32_t v_px_q12,
                         int32_t *x_q28, int32_t *y_q28);

/* Normalised coordinates -> frame pixel. |x|, |y| are limited to IH_RIG_TAN_MAX first. */
void ih_camera_distort(const struct ih_rig *rig, int32_t x_q28, int32_t y_q28, int32_t *u_px_q12,
                       int32_t *v_px_q12);

/* Frame pixel -> the pixel that a camera without distortion would show it at (fx x + cx, fy y + cy). */
void ih_camera_undistort_pixel(const struct ih_rig *rig, int32_t u_px_q12, int32_t v_px_q12,
                               int32_t *undistorted_u_px_q12, int32_t *undistorted_v_px_q12);

/* Is the pixel's centre inside the frame? */
bool ih_camera_sees(const struct ih_rig *rig, int32_t u_px_q12, int32_t v_px_q12);

IH_END_DECLS

#endif
