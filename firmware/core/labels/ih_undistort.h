/* ih_undistort - the lens undone for all dots of a frame (paper, section 2.1).
 *
 * In:     dots, rig.
 * Out:    each dot's undistorted pixel, as ih_camera_undistort and ih_camera_pixel give it, to the last bit.
 * Method: the first of Newton's steps of ih_camera_undistort without its limits. The lens must be mild (radial
 *         coefficients below 1, tangential ones below 1/16), the dot within 45 degrees along each axis, and
 *         one step must do; ih_camera_undistort does the others.
 * Bounds: |x|, |y| <= 1 distorted, 1.4 undistorted: r^2 below 2^30 in Q28, r^4 2^29 in Q25, r^6 2^28 in Q22;
 *         tangential shift 3/4. Factors of a product are below 2^31, products below 2^62 (docs/numerics.md).
 * Cost:   about 350 instructions a dot, two thirds of ih_camera_undistort's, which a Cortex-M takes for all dots.
 */
#ifndef IH_UNDISTORT_H
#define IH_UNDISTORT_H

#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "rig/ih_rig.h"

IH_BEGIN_DECLS

void ih_undistort_dots(const struct ih_dots *dots, const struct ih_rig *rig,
                       int32_t u_px_q12[IH_DOTS_MAX], int32_t v_px_q12[IH_DOTS_MAX]);

IH_END_DECLS

#endif
