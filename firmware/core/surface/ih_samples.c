#include "surface/ih_samples.h"

#include <stddef.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "points/ih_near_depth.h"
#include "rig/ih_level.h"

#define ISOLATED_NEIGHBOURS_MIN 3
#define ISOLATED_FRIENDS_MAX 1

void ih_samples_params_default(struct ih_samples_params *params)
{
    *params = (struct ih_samples_params){
        .isolated_mm = 60,
        .clip_behind_mm = 250,
        .clip_min_mm = 1100,
        .fill_neighbours = 3,
        .fill_root_weight_q15 = 17948, /* sqrt(0.3) */
    };
}

/* A range of depths, both ends included. */
struct depths {
    int32_t min_q8, max_q8;
};

static const struct depths any_depth = {0, INT32_MAX};

/* Is a neighbour seen, with a depth in that range? */
static inline bool is_seen_within(const struct ih_point *other, int32_t clip_q8,
                                  struct depths depths)
{
    const int32_t depth_q8 = ih_min_s32(other->depth_mm_q8, clip_q8);
    return other->state == IH_POINT_SEEN && depth_q8 >= depths.min_q8 && depth_q8 <= depths.max_q8;
}

/* The 8 neighbours; those in the same row or column first, as they are likelier to decide. */
static const int8_t step_around[8] = {-1,           1,           -IH_GRID,   IH_GRID, -IH_GRID - 1,
                                      -IH_GRID + 1, IH_GRID - 1, IH_GRID + 1};

/* At an edge a step may leave the table, or reach the other end of a row. */
static bool is_step_inside(int32_t slot, int32_t step)
{
    const int32_t at = slot + step;
    return at >= 0 && at < IH_SLOTS && ih_abs_s32(at % IH_GRID - slot % IH_GRID) <= 1;
}

static bool is_at_edge(int32_t slot)
{
    const int32_t row = slot / IH_GRID;
    const int32_t column = slot % IH_GRID;
    return row == 0 || column == 0 || row == IH_GRID - 1 || column == IH_GRID - 1;
}

/* Count the neighbours that are seen with a depth in that range, up to max. */
static int32_t count_around(const struct ih_points *points, int32_t slot, int32_t clip_q8,
                            struct depths depths, int32_t max)
{
    const struct ih_point *point = &points->point[slot];
    const bool is_edge = is_at_edge(slot);
    int32_t count = 0;
    for (int i = 0; i < 8 && count < max; i++) {
        if (!is_edge || is_step_inside(slot, step_around[i])) {
            count += is_seen_within(&point[step_around[i]], clip_q8, depths);
        }
    }
    return count;
}

_Static_assert(ISOLATED_FRIENDS_MAX < 2,
               "two near neighbours suffice for a point that is not isolated");

/* Does a point differ from all but one neighbour? Of most points the two beside them decide. */
static bool is_isolated(const struct ih_points *points, int32_t slot, int32_t clip_q8,
                        int32_t isolated_q8)
{
    const struct ih_point *point = &points->point[slot];
    const int32_t own_q8 = ih_min_s32(point->depth_mm_q8, clip_q8);
    const struct depths near = {own_q8 - isolated_q8, own_q8 + isolated_q8};
    const int32_t column = slot % IH_GRID;
    if (column > 0 && column < IH_GRID - 1 && is_seen_within(&point[-1], clip_q8, near) &&
        is_seen_within(&point[1], clip_q8, near)) {
        return false;
    }
    return count_around(points, slot, clip_q8, near, ISOLATED_FRIENDS_MAX + 1) <=
               ISOLATED_FRIENDS_MAX &&
           count_around(points, slot, clip_q8, any_depth, ISOLATED_NEIGHBOURS_MIN) ==
               ISOLATED_NEIGHBOURS_MIN;
}

static bool in_field(int64_t x_q16, int64_t y_q16)
{
    int64_t limit = (int64_t)IH_SAMPLES_REACH << 16;
    return ih_abs_s64(x_q16) < limit && ih_abs_s64(y_q16) < limit;
}

static void add_sample(struct ih_samples *out, const struct ih_field *field, int32_t x_q28,
                       int32_t y_q28, struct ih_sample sample)
{
    int64_t x_q16 = ih_div_round(((int64_t)x_q28 - field->centre_x_q28) * 65536, field->unit_q28);
    int64_t y_q16 = ih_div_round(((int64_t)y_q28 - field->centre_y_q28) * 65536, field->unit_q28);
    if (!in_field(x_q16, y_q16)) {
        out->outside_count++;
        return;
    }
    sample.x_q16 = (int32_t)x_q16;
    sample.y_q16 = (int32_t)y_q16;
    IH_IN_RANGE(sample.depth_mm_q8, 1 << 8, IH_RANGE_SAMPLE_DEPTH_MM_Q8);
    IH_IN_RANGE(sample.root_weight_q15, 1, IH_RANGE_ROOT_WEIGHT_Q15);
    out->sample[out->sample_count++] = sample;
    out->filled_count += sample.is_filled;
    out->seen_count += !sample.is_filled;
    out->nearest_mm_q8 = ih_min_s32(out->nearest_mm_q8, sample.depth_mm_q8);
}

/* Would a surface at (x, y) show a dot? */
static bool is_visible_at(const struct ih_rig *rig, const struct ih_dots *dots, int32_t x_q28,
                          int32_t y_q28)
{
    int32_t u, v;
    return ih_level_sees(rig, x_q28, y_q28, &u, &v) &&
           (dots == NULL || !ih_dots_is_bright(dots, u >> 12, v >> 12));
}

static void fill_missing(const struct ih_points *points, const struct ih_dots *dots,
                         const struct ih_rig *rig, const struct ih_samples_params *params,
                         int32_t slot, struct ih_samples *out)
{
    const struct ih_point *point = &points->point[slot];
    if (params->fill_root_weight_q15 == 0 ||
        count_around(points, slot, out->clip_mm_q8, any_depth, params->fill_neighbours) >=
            params->fill_neighbours) {
        return;
    }
    int32_t depth_q8 = out->clip_mm_q8;
    int32_t x_q28 = point->x_q28;
    int32_t y_q28 = point->y_q28;
    if (rig->calibration.kind == IH_RIG_DOTS) {
        (void)ih_level_dot_at(rig, slot, depth_q8, &x_q28, &y_q28);
    }
    if (is_visible_at(rig, dots, x_q28, y_q28)) {
        add_sample(out, &points->field, x_q28, y_q28,
                   (struct ih_sample){.slot = slot,
                                      .depth_mm_q8 = depth_q8,
                                      .root_weight_q15 = params->fill_root_weight_q15,
                                      .is_filled = true});
    }
}

static void add_seen(const struct ih_points *points, int32_t isolated_q8, int32_t slot,
                     struct ih_samples *out)
{
    const struct ih_point *point = &points->point[slot];
    if (is_isolated(points, slot, out->clip_mm_q8, isolated_q8)) {
        out->isolated_count++;
        return;
    }
    int32_t depth_q8 = ih_min_s32(point->depth_mm_q8, out->clip_mm_q8);
    add_sample(
        out, &points->field, point->x_q28, point->y_q28,
        (struct ih_sample){.slot = slot, .depth_mm_q8 = depth_q8, .root_weight_q15 = 1 << 15});
}

void ih_samples_select(const struct ih_points *points, const struct ih_dots *dots,
                       const struct ih_rig *rig, const struct ih_samples_params *params,
                       struct ih_samples *out)
{
    out->sample_count = 0;
    out->seen_count = 0;
    out->filled_count = 0;
    out->isolated_count = 0;
    out->outside_count = 0;
    out->nearest_mm_q8 = INT32_MAX;
    out->clip_mm_q8 = ih_near_depth_mm_q8(points) + (params->clip_behind_mm << 8);
    if (rig->calibration.kind == IH_RIG_DOTS) {
        out->clip_mm_q8 = ih_max_s32(out->clip_mm_q8, params->clip_min_mm << 8);
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (points->point[slot].state == IH_POINT_SEEN) {
            add_seen(points, params->isolated_mm << 8, slot, out);
        } else if (points->point[slot].state == IH_POINT_MISSING) {
            fill_missing(points, dots, rig, params, slot, out);
        }
    }
}
