#include "points/ih_cloud.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "rig/ih_camera.h"

/* The pixel where a point in front of the camera is seen; IH_NONE outside the frame. */
static int32_t pixel_of(const int32_t point_mm_q8[3], const struct ih_rig *rig)
{
    int64_t limit_q28 = (int64_t)IH_RIG_TAN_MAX << 28;
    int64_t x_q28 = ih_div_round(point_mm_q8[0] * ((int64_t)1 << 28), point_mm_q8[2]);
    int64_t y_q28 = ih_div_round(point_mm_q8[1] * ((int64_t)1 << 28), point_mm_q8[2]);
    if (ih_abs_s64(x_q28) >= limit_q28 || ih_abs_s64(y_q28) >= limit_q28) {
        return IH_NONE;
    }
    int32_t u_q12, v_q12;
    ih_camera_distort(rig, (int32_t)x_q28, (int32_t)y_q28, &u_q12, &v_q12);
    int64_t u = ih_shift_round(u_q12, 12);
    int64_t v = ih_shift_round(v_q12, 12);
    const struct ih_calibration *c = &rig->calibration;
    bool inside = u >= 0 && v >= 0 && u < c->width && v < c->height;
    return inside ? (int32_t)(v * c->width + u) : IH_NONE;
}

static void draw_point(const int32_t point_mm_q8[3], const struct ih_rig *rig, uint16_t *depth_mm,
                       struct ih_cloud *out)
{
    int64_t z_mm = ih_shift_round(point_mm_q8[2], 8);
    if (z_mm < rig->calibration.near_mm) {
        out->near++;
        return;
    }
    if (z_mm > rig->calibration.far_mm) {
        out->far++;
        return;
    }
    int32_t pixel = pixel_of(point_mm_q8, rig);
    if (pixel == IH_NONE) {
        out->outside++;
    } else if (depth_mm[pixel] == 0) {
        depth_mm[pixel] = (uint16_t)z_mm;
        out->drawn++;
    } else {
        depth_mm[pixel] = (uint16_t)ih_min_s32(depth_mm[pixel], (int32_t)z_mm);
        out->hidden++;
    }
}

enum ih_err ih_cloud_draw(const int32_t (*point_mm_q8)[3], int32_t point_count,
                          const struct ih_rig *rig, uint16_t *depth_mm, struct ih_cloud *out)
{
    const struct ih_calibration *c = &rig->calibration;
    *out = (struct ih_cloud){0};
    if (c->kind != IH_RIG_RANGE) {
        return IH_ERR_KIND;
    }
    memset(depth_mm, 0, (size_t)c->width * (size_t)c->height * sizeof *depth_mm);
    for (int32_t i = 0; i < point_count; i++) {
        draw_point(point_mm_q8[i], rig, depth_mm, out);
    }
    return IH_OK;
}
