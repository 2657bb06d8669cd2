#include "detect/ih_prescreen.h"

#include "base/ih_fix.h"
#include "detect/ih_head_model.h"
#include "simd/ih_simd.h"

/* A fraction is of this many rays at least. */
#define RAYS_MIN 3
/* Nearer to the origin's depth it is not known where rays pass. */
#define DEPTH_MIN_MM_Q8 (1 << 14)
/* Above every ray, and behind every point of an empty one. */
#define NO_END_MM INT16_MAX

/* mm from the centre of a mean head. */
struct window {
    int16_t aside_mm, gap_mm; /* within; farther than, if it is not below 0 */
    int16_t above_mm, below_mm;
    int16_t before_mm, behind_mm; /* of points that are counted as a part */
};

enum { HIGH, BODY, LEVEL, WINDOW_COUNT };

/* Hundredths of a semi-axis, rounded. */
#define PART_MM(percent, semi_mm) (((percent) * (semi_mm) + 50) / 100)

static const struct window windows[WINDOW_COUNT] = {
    [HIGH] = {PART_MM(IH_HEAD_HIGH_ASIDE_PERCENT, IH_HEAD_SEMI_X_MM), -1, NO_END_MM,
              -PART_MM(IH_HEAD_HIGH_FROM_PERCENT, IH_HEAD_SEMI_Y_MM), -IH_HEAD_OPEN_MM, NO_END_MM},
    [BODY] = {IH_HEAD_BODY_ASIDE_MM, -1, -IH_HEAD_SEMI_Y_MM - IH_HEAD_BODY_TOP_MM,
              IH_HEAD_SEMI_Y_MM + IH_HEAD_BODY_BOTTOM_MM, IH_HEAD_BODY_BEFORE_MM,
              IH_HEAD_BODY_BEHIND_MM},
    [LEVEL] = {IH_HEAD_LEVEL_FAR_MM, IH_HEAD_LEVEL_NEAR_MM, IH_HEAD_SEMI_Y_MM, IH_HEAD_SEMI_Y_MM,
               IH_HEAD_LEVEL_DEPTH_MM, IH_HEAD_LEVEL_DEPTH_MM},
};

/* From the first to the second of each: slopes in Q12, depths in Q1. */
struct edges {
    int16_t x[2], gap[2], y[2], z[2];
};

struct count {
    int32_t part, all;
};

static void set_range(int32_t middle, int32_t before, int32_t behind, int16_t range[2])
{
    range[0] = ih_saturate_s16(middle - before);
    range[1] = ih_saturate_s16(middle + behind);
}

/* mm_q20: a mm at the centre's depth, as a slope. */
static void find_edges(const struct window *window, const int32_t middle_q12[2], int32_t mm_q20,
                       int32_t depth_mm_q1, struct edges *out)
{
    const int32_t aside_q12 = window->aside_mm * mm_q20 >> 8;
    const int32_t gap_q12 = window->gap_mm * mm_q20 >> 8;
    set_range(middle_q12[0], aside_q12, aside_q12, out->x);
    set_range(middle_q12[0], gap_q12, gap_q12, out->gap);
    set_range(middle_q12[1], window->above_mm * mm_q20 >> 8, window->below_mm * mm_q20 >> 8,
              out->y);
    set_range(depth_mm_q1, 2 * window->before_mm, 2 * window->behind_mm, out->z);
}

/* Rays that pass between the edges. An unknown one's x is IH_RAYS_NOWHERE, and so is an empty one's z. */
#if IH_I16_LANES > 0
static inline void count_window(const struct ih_ray_table *table, const struct edges *edges,
                                struct count *out)
{
    ih_i16 all = ih_i16_all(0), part = all;
    for (int32_t slot = 0; slot < IH_RAYS_COLUMN; slot += IH_I16_LANES) {
        const ih_i16 x = ih_i16_load(&table->slope_q12[0][slot]);
        const ih_i16 y = ih_i16_load(&table->slope_q12[1][slot]);
        const ih_i16 z = ih_i16_load(&table->point_mm_q1[2][slot]);
        const ih_i16 is_in_gap = (x > edges->gap[0]) & (x < edges->gap[1]);
        const ih_i16 is_there = (x > edges->x[0]) & (x < edges->x[1]) & (y > edges->y[0]) &
                                (y < edges->y[1]) & ~is_in_gap;
        const ih_i16 is_part = is_there & (z > edges->z[0]) & ~(z > edges->z[1]);
        all = ih_i16_sub(all, is_there);
        part = ih_i16_sub(part, is_part);
    }
    *out = (struct count){ih_i16_total(part), ih_i16_total(all)};
}

static void count_rays(const struct ih_ray_table *table, const struct edges edges[WINDOW_COUNT],
                       struct count count[WINDOW_COUNT])
{
    for (int i = 0; i < WINDOW_COUNT; i++) {
        count_window(table, &edges[i], &count[i]);
    }
}
#else
/* Without vectors a ray's height selects its window: they lie one above the other. */
static void count_rays(const struct ih_ray_table *table, const struct edges edges[WINDOW_COUNT],
                       struct count count[WINDOW_COUNT])
{
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int16_t y = table->slope_q12[1][slot];
        const int i = y < edges[HIGH].y[1] ? HIGH : y < edges[LEVEL].y[1] ? LEVEL : BODY;
        const struct edges *b = &edges[i];
        const int16_t x = table->slope_q12[0][slot];
        if (x > b->x[0] && x < b->x[1] && y > b->y[0] && y < b->y[1] &&
            (x <= b->gap[0] || x >= b->gap[1])) {
            const int16_t z = table->point_mm_q1[2][slot];
            count[i].all++;
            count[i].part += z > b->z[0] && z <= b->z[1];
        }
    }
}
#endif

static int32_t fraction_q8(struct count count)
{
    return count.part * 256 / ih_max_s32(count.all, RAYS_MIN);
}

int32_t ih_prescreen_score_q8(const struct ih_rays *rays, const int32_t centre_mm_q8[3])
{
    const int32_t depth_mm_q8 = centre_mm_q8[2] - rays->origin_mm_q8[2];
    struct count count[WINDOW_COUNT] = {[HIGH] = {0, 0}};
    if (depth_mm_q8 >= DEPTH_MIN_MM_Q8) {
        const int32_t mm_q20 = (1 << 28) / depth_mm_q8;
        int32_t middle_q12[2];
        for (int axis = 0; axis < 2; axis++) {
            const int32_t off_mm_q8 = centre_mm_q8[axis] - rays->origin_mm_q8[axis];
            middle_q12[axis] = (int32_t)((int64_t)off_mm_q8 * 4096 / depth_mm_q8);
        }
        struct edges edges[WINDOW_COUNT];
        for (int i = 0; i < WINDOW_COUNT; i++) {
            find_edges(&windows[i], middle_q12, mm_q20, centre_mm_q8[2] >> 7, &edges[i]);
        }
        count_rays(&rays->table, edges, count);
    }
    const int32_t high_q8 = (2 * count[HIGH].part + 1) * 128 / (count[HIGH].all + 1);
    return 2 * high_q8 + 3 * fraction_q8(count[BODY]) - 4 * fraction_q8(count[LEVEL]);
}
