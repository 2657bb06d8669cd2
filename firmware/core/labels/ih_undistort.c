#include "labels/ih_undistort.h"

#include "rig/ih_camera.h"

void ih_undistort_dots(const struct ih_dots *dots, const struct ih_rig *rig,
                       int32_t u_px_q12[IH_DOTS_MAX], int32_t v_px_q12[IH_DOTS_MAX])
{
    for (int32_t i = 0; i < dots->dot_count; i++) {
        int32_t x_q28, y_q28;
        ih_camera_undistort(rig, dots->dot[i].u_px_q12, dots->dot[i].v_px_q12, &x_q28, &y_q28);
        ih_camera_pixel(rig, x_q28, y_q28, &u_px_q12[i], &v_px_q12[i]);
    }
}
