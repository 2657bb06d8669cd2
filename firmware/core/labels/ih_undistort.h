/* ih_undistort - the lens undone for all dots of a frame at once (paper, section 2.1).
 *
 * In:    dots, rig.
 * Out:   each dot's undistorted pixel, as ih_camera_undistort and ih_camera_pixel have it, to the last bit.
 * Way:   where there are vectors of four words of 64 bits, the first of Newton's steps of ih_camera_undistort for four
 *        dots at a time. For that the lens must be one whose numbers need no limit (coefficients below 1, those
 *        across below 1/16), and the dot one that is seen within 45 degrees along each side and is there with
 *        this step; any other is left to ih_camera_undistort.
 * Bounds: |x|, |y| <= 1 where it is seen, 1.4 where it was: r^2 below 2^30 in Q28, r^4 2^29 in Q25, r^6 2^28 in Q22;
 *        across 3/4. Factors of a product are below 2^31, products below 2^62 (docs/numerics.md).
 * Cost:  without vectors that of ih_camera_undistort for each; with them a fifth of it.
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
