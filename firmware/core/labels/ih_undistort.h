/* ih_undistort - the lens undone for all dots of a frame (paper, section 2.1).
 *
 * In:     dots, rig.
 * Out:    each dot's undistorted pixel, as ih_camera_undistort and ih_camera_pixel give it.
 * Cost:   that of ih_camera_undistort for each dot. Vectors of 64-bit products took 40 % of it with NEON and a
 *         fifth with AVX2: 1 % and 2.8 % of a frame, too little for 220 lines (docs/experiments/020).
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
