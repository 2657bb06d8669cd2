#include "detect/ih_rays.h"

#include <stdbool.h>
#include <stddef.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "points/ih_near_depth.h"
#include "rig/ih_camera.h"

void ih_rays_params_default(struct ih_rays_params *params)
{
    *params = (struct ih_rays_params){.probe_mm = 100};
}

static int32_t limited_slope_q20(int64_t slope_q20)
{
    const int64_t limit = (int64_t)IH_RAYS_SLOPE_MAX << 20;
    return (int32_t)(slope_q20 > limit ? limit : slope_q20 < -limit ? -limit : slope_q20);
}

/* Would this dot be seen on a surface at the probe's depth? */
static bool is_empty(const struct ih_rig *rig, const struct ih_dots *dots, int32_t slot,
                     int32_t probe_mm_q8)
{
    int32_t x_q28, y_q28, u_px_q12, v_px_q12;
    ih_rig_dot_at(rig, slot, probe_mm_q8, &x_q28, &y_q28);
    ih_camera_distort(rig, x_q28, y_q28, &u_px_q12, &v_px_q12);
    return ih_camera_sees(rig, u_px_q12, v_px_q12) &&
           (dots == NULL || !ih_dots_is_bright(dots, u_px_q12 >> 12, v_px_q12 >> 12));
}

void ih_rays_make(const struct ih_points *points, const struct ih_dots *dots,
                  const struct ih_rig *rig, const struct ih_rays_params *params,
                  struct ih_rays *out)
{
    bool is_range = rig->calibration.kind == IH_RIG_RANGE;
    int32_t probe_mm_q8 = ih_near_depth_mm_q8(points) + (params->probe_mm << 8);
    for (int axis = 0; axis < 3; axis++) {
        out->origin_mm_q8[axis] =
            is_range ? 0 : (int32_t)ih_shift_round(rig->calibration.origin_mm_q16[axis], 8);
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_point *point = &points->point[slot];
        struct ih_ray *ray = &out->ray[slot];
        *ray = (struct ih_ray){.state = IH_RAY_UNKNOWN};
        if (is_range) {
            ray->slope_x_q20 = limited_slope_q20(ih_shift_round(point->x_q28, 8));
            ray->slope_y_q20 = limited_slope_q20(ih_shift_round(point->y_q28, 8));
        } else {
            ray->slope_x_q20 = rig->line[slot].slope_x_q20;
            ray->slope_y_q20 = rig->line[slot].slope_y_q20;
        }
        if (point->state == IH_POINT_SEEN) {
            ray->state = IH_RAY_SEEN;
            ray->point_mm_q8[0] = (int32_t)ih_mul_shift(point->depth_mm_q8, point->x_q28, 28);
            ray->point_mm_q8[1] = (int32_t)ih_mul_shift(point->depth_mm_q8, point->y_q28, 28);
            ray->point_mm_q8[2] = point->depth_mm_q8;
            IH_IN_RANGE(ray->point_mm_q8[0], -IH_RANGE_POINT_MM_Q8, IH_RANGE_POINT_MM_Q8);
            IH_IN_RANGE(ray->point_mm_q8[1], -IH_RANGE_POINT_MM_Q8, IH_RANGE_POINT_MM_Q8);
        } else if (point->state == IH_POINT_MISSING &&
                   (is_range || is_empty(rig, dots, slot, probe_mm_q8))) {
            ray->state = IH_RAY_EMPTY;
        }
    }
}

void ih_rays_slope_max(const struct ih_rays *space, int32_t slope_max_q20[2])
{
    int32_t left = 0, right = 0, up = 0, down = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_ray *ray = &space->ray[slot];
        left = ih_min_s32(left, ray->slope_x_q20);
        right = ih_max_s32(right, ray->slope_x_q20);
        up = ih_min_s32(up, ray->slope_y_q20);
        down = ih_max_s32(down, ray->slope_y_q20);
    }
    slope_max_q20[0] = ih_max_s32(-left, right);
    slope_max_q20[1] = ih_max_s32(-up, down);
}
