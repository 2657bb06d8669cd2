#include "ih_samples.h"

#include <stddef.h>

#include "ih_fix.h"

#define PERCENTILE 8
#define ISOLATED_NEIGHBOURS_MIN 3
#define ISOLATED_FRIENDS_MAX 1

void ih_samples_params_default(struct ih_samples_params *params)
{
    *params = (struct ih_samples_params){
        .isolated_mm = 60,
        .clip_behind_mm = 250,
        .clip_least_mm = 1100,
        .fill_neighbours = 3,
        .fill_root_weight_q15 = 17948, /* sqrt(0.3) */
    };
}

/* The value of a rank, from 0: the range of values is halved until one is left. None is negative. */
static int32_t value_of_rank(const int32_t *value, int32_t count, int32_t rank)
{
    int32_t low = 0;
    int32_t high = INT32_MAX; /* it is in low..high */
    while (low < high) {
        int32_t middle = low + (high - low) / 2;
        int32_t at_most = 0;
        for (int32_t i = 0; i < count; i++) {
            at_most += value[i] <= middle;
        }
        if (at_most > rank) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    return low;
}

int32_t ih_samples_near_mm_q8(const struct ih_points *points)
{
    int32_t depth_mm_q8[IH_SLOTS];
    int32_t count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (points->point[slot].state == IH_POINT_SEEN) {
            depth_mm_q8[count++] = points->point[slot].depth_mm_q8;
        }
    }
    return count == 0 ? 0 : value_of_rank(depth_mm_q8, count, count * PERCENTILE / 100);
}

/* A slot's neighbour by row and column; NULL beyond the pattern's edge. */
static const struct ih_point *neighbour(const struct ih_points *points, int32_t slot, int32_t d_row,
                                        int32_t d_column)
{
    int32_t row = slot / IH_GRID + d_row;
    int32_t column = slot % IH_GRID + d_column;
    bool inside = row >= 0 && column >= 0 && row < IH_GRID && column < IH_GRID;
    return inside ? &points->point[row * IH_GRID + column] : NULL;
}

struct surroundings {
    int32_t seen;    /* of the 8 neighbours */
    int32_t friends; /* of those, at nearly the same depth */
};

static struct surroundings look_around(const struct ih_points *points, int32_t slot,
                                       int32_t clip_q8, int32_t isolated_q8)
{
    struct surroundings s = {0, 0};
    int32_t own = ih_min_s32(points->point[slot].depth_mm_q8, clip_q8);
    for (int32_t d_row = -1; d_row <= 1; d_row++) {
        for (int32_t d_column = -1; d_column <= 1; d_column++) {
            const struct ih_point *other = neighbour(points, slot, d_row, d_column);
            bool self = d_row == 0 && d_column == 0;
            if (self || other == NULL || other->state != IH_POINT_SEEN) {
                continue;
            }
            int32_t depth = ih_min_s32(other->depth_mm_q8, clip_q8);
            s.seen++;
            s.friends += ih_abs_s32(depth - own) <= isolated_q8;
        }
    }
    return s;
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
}

/* Would the dot have been seen at (x, y) if there were something to see? */
static bool place_is_visible(const struct ih_rig *rig, const struct ih_dots *dots, int32_t x_q28,
                             int32_t y_q28)
{
    int32_t u, v;
    ih_rig_distort(rig, x_q28, y_q28, &u, &v);
    return ih_rig_inside(rig, u, v) && (dots == NULL || !ih_dots_is_bright(dots, u >> 12, v >> 12));
}

static void fill_missing(const struct ih_points *points, const struct ih_dots *dots,
                         const struct ih_rig *rig, const struct ih_samples_params *params,
                         int32_t slot, const struct surroundings *around, struct ih_samples *out)
{
    const struct ih_point *point = &points->point[slot];
    if (params->fill_root_weight_q15 == 0 || around->seen >= params->fill_neighbours) {
        return;
    }
    int32_t depth_q8 = out->clip_mm_q8;
    int32_t x_q28 = point->x_q28;
    int32_t y_q28 = point->y_q28;
    if (rig->calibration.kind == IH_RIG_DOTS) {
        ih_rig_dot_at(rig, slot, depth_q8, &x_q28, &y_q28);
    }
    if (place_is_visible(rig, dots, x_q28, y_q28)) {
        add_sample(out, &points->field, x_q28, y_q28,
                   (struct ih_sample){.slot = slot,
                                      .depth_mm_q8 = depth_q8,
                                      .root_weight_q15 = params->fill_root_weight_q15,
                                      .is_filled = true});
    }
}

static void take_seen(const struct ih_points *points, const struct surroundings *around,
                      int32_t slot, struct ih_samples *out)
{
    const struct ih_point *point = &points->point[slot];
    if (around->seen >= ISOLATED_NEIGHBOURS_MIN && around->friends <= ISOLATED_FRIENDS_MAX) {
        out->isolated_count++;
        return;
    }
    int32_t depth_q8 = ih_min_s32(point->depth_mm_q8, out->clip_mm_q8);
    add_sample(
        out, &points->field, point->x_q28, point->y_q28,
        (struct ih_sample){.slot = slot, .depth_mm_q8 = depth_q8, .root_weight_q15 = 1 << 15});
    out->nearest_mm_q8 = ih_min_s32(out->nearest_mm_q8, depth_q8);
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
    out->clip_mm_q8 = ih_samples_near_mm_q8(points) + (params->clip_behind_mm << 8);
    if (rig->calibration.kind == IH_RIG_DOTS) {
        out->clip_mm_q8 = ih_max_s32(out->clip_mm_q8, params->clip_least_mm << 8);
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        struct surroundings around =
            look_around(points, slot, out->clip_mm_q8, params->isolated_mm << 8);
        if (points->point[slot].state == IH_POINT_SEEN) {
            take_seen(points, &around, slot, out);
        } else if (points->point[slot].state == IH_POINT_MISSING) {
            fill_missing(points, dots, rig, params, slot, &around, out);
        }
    }
}
