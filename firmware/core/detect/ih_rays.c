#include "detect/ih_rays.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "points/ih_near_depth.h"
#include "rig/ih_level.h"

/* Slots whose rays span a part of the pattern that is nearly even, so many steps wide and high. */
#define FIRST_LINE 4
#define LAST_LINE 14
#define SPAN (LAST_LINE - FIRST_LINE)

void ih_rays_params_default(struct ih_rays_params *params)
{
    *params = (struct ih_rays_params){.probe_mm = 100};
}

static int32_t limited_slope_q20(int64_t slope_q20)
{
    return (int32_t)ih_clamp_s64(slope_q20, (int64_t)IH_RAYS_SLOPE_MAX << 20);
}

/* Would this dot be seen on a surface at the probe's depth? */
static bool is_empty(const struct ih_rig *rig, const struct ih_dots *dots, int32_t slot,
                     int32_t probe_mm_q8)
{
    int32_t x_q28, y_q28, u_px_q12, v_px_q12;
    (void)ih_level_dot_at(rig, slot, probe_mm_q8, &x_q28, &y_q28);
    return ih_level_sees(rig, x_q28, y_q28, &u_px_q12, &v_px_q12) &&
           (dots == NULL || !ih_dots_is_bright(dots, u_px_q12 >> 12, v_px_q12 >> 12));
}

static void fill_slot(const struct ih_ray *ray, int32_t slot, struct ih_ray_table *out)
{
    const int32_t slope_q20[2] = {ray->slope_x_q20, ray->slope_y_q20};
    for (int axis = 0; axis < 2; axis++) {
        out->slope_q12[axis][slot] = (int16_t)(slope_q20[axis] >> 8);
        out->slope_max_q20[axis] =
            ih_max_s32(out->slope_max_q20[axis], ih_abs_s32(slope_q20[axis]));
    }
    for (int axis = 0; axis < 3; axis++) {
        out->point_mm_q1[axis][slot] = ih_saturate_s16(ray->point_mm_q8[axis] >> 7);
    }
    out->seen[slot] = ray->state == IH_RAY_SEEN ? -1 : 0;
    if (ray->state == IH_RAY_EMPTY) {
        out->point_mm_q1[2][slot] = IH_RAYS_NOWHERE;
    }
    if (ray->state == IH_RAY_UNKNOWN) {
        out->slope_q12[0][slot] = IH_RAYS_NOWHERE;
    }
}

/* The area of a quadrilateral is half the cross product of its diagonals. */
static int32_t pitch_q20(const struct ih_ray ray[IH_SLOTS])
{
    const struct ih_ray *a = &ray[FIRST_LINE * IH_GRID + FIRST_LINE];
    const struct ih_ray *b = &ray[FIRST_LINE * IH_GRID + LAST_LINE];
    const struct ih_ray *c = &ray[LAST_LINE * IH_GRID + LAST_LINE];
    const struct ih_ray *d = &ray[LAST_LINE * IH_GRID + FIRST_LINE];
    const int64_t across_q20[2] = {(int64_t)c->slope_x_q20 - a->slope_x_q20,
                                   (int64_t)d->slope_x_q20 - b->slope_x_q20};
    const int64_t down_q20[2] = {(int64_t)c->slope_y_q20 - a->slope_y_q20,
                                 (int64_t)d->slope_y_q20 - b->slope_y_q20};
    const int64_t twice_q40 = ih_abs_s64(across_q20[0] * down_q20[1] - across_q20[1] * down_q20[0]);
    return (int32_t)ih_isqrt_u64((uint64_t)twice_q40 / (2 * SPAN * SPAN));
}

void ih_rays_fill_table(struct ih_rays *rays)
{
    struct ih_ray_table *table = &rays->table;
    memset(table, 0, sizeof *table);
    table->pitch_q20 = pitch_q20(rays->ray);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        fill_slot(&rays->ray[slot], slot, table);
    }
    for (int32_t slot = IH_SLOTS; slot < IH_RAYS_COLUMN; slot++) {
        table->slope_q12[0][slot] = IH_RAYS_NOWHERE;
    }
}

void ih_rays_make(const struct ih_points *points, const struct ih_dots *dots,
                  const struct ih_rig *rig, const struct ih_rays_params *params,
                  struct ih_rays *out)
{
    bool is_range = rig->calibration.kind == IH_RIG_RANGE;
    int32_t probe_mm_q8 = ih_near_depth_mm_q8(points) + (params->probe_mm << 8);
    for (int axis = 0; axis < 3; axis++) {
        out->origin_mm_q8[axis] =
            is_range ? 0 : (int32_t)ih_shift_round(rig->level_origin_mm_q16[axis], 8);
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_point *point = &points->point[slot];
        struct ih_ray *ray = &out->ray[slot];
        *ray = (struct ih_ray){.state = IH_RAY_UNKNOWN};
        int32_t x_q28 = point->x_q28, y_q28 = point->y_q28;
        const bool is_in_view = is_range || ih_level_ray(rig, slot, &x_q28, &y_q28);
        ray->slope_x_q20 = limited_slope_q20(ih_shift_round(x_q28, 8));
        ray->slope_y_q20 = limited_slope_q20(ih_shift_round(y_q28, 8));
        if (!is_in_view) {
            continue;
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
    ih_rays_fill_table(out);
}
