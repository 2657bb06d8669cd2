#include "detect/ih_prescreen.h"

#include <stdbool.h>

#include "base/ih_config.h"
#include "base/ih_fix.h"

/* Rays of a share, at least. */
#define MIN 3
/* Nearer to the origin's depth there is no telling where rays pass. */
#define DEPTH_MIN_MM_Q8 (1 << 14)
/* As far above as no ray is, and behind as far as what is empty. */
#define NO_END_MM INT16_MAX

/* mm from the centre of a mean head. */
struct window {
    int16_t aside_mm, gap_mm; /* within; farther than, if it is not below 0 */
    int16_t above_mm, below_mm;
    int16_t before_mm, behind_mm; /* points that are a part */
};

enum { HIGH, BODY, LEVEL, WINDOW_COUNT };

static const struct window windows[WINDOW_COUNT] = {
    [HIGH] = {125, -1, NO_END_MM, -215, -60, NO_END_MM},
    [BODY] = {180, -1, -153, 373, 220, 200},
    [LEVEL] = {330, 170, 113, 113, 150, 150},
};

/* From the first to the second of each: slopes in Q12, depths in Q1. */
struct edges {
    int16_t x[2], gap[2], y[2], z[2];
};

struct share {
    int32_t part, all;
};

static void set_range(int32_t middle, int32_t less, int32_t more, int16_t range[2])
{
    range[0] = (int16_t)ih_clamp_s32(middle - less, INT16_MIN, INT16_MAX);
    range[1] = (int16_t)ih_clamp_s32(middle + more, INT16_MIN, INT16_MAX);
}

/* Where the middle is, and what a mm is, as slopes. */
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

/* Rays that pass between the edges; of an unknown one x is at IH_FIT_EQUATIONS_NOWHERE, of an empty one's point z. */
#if defined __SSE2__ || defined __ARM_NEON
/* A loop without a branch: compilers turn it into vectors. */
static void count_rays(const struct ih_fit_equations_rays *rays,
                       const struct edges edges[WINDOW_COUNT], struct share share[WINDOW_COUNT])
{
    for (int i = 0; i < WINDOW_COUNT; i++) {
        const struct edges *b = &edges[i];
        int16_t part = 0, all = 0;
        for (int32_t slot = 0; slot < IH_FIT_EQUATIONS_RAYS; slot++) {
            const int16_t x = rays->slope_q12[0][slot];
            const int16_t y = rays->slope_q12[1][slot];
            const int16_t z = rays->point_mm_q1[2][slot];
            const bool is_there = (x > b->x[0]) & (x < b->x[1]) & (y > b->y[0]) & (y < b->y[1]) &
                                  ((x <= b->gap[0]) | (x >= b->gap[1]));
            const bool is_part = is_there & (z > b->z[0]) & (z <= b->z[1]);
            all = (int16_t)(all + is_there);
            part = (int16_t)(part + is_part);
        }
        share[i] = (struct share){part, all};
    }
}
#else
/* Where there are no vectors, a ray is told by its height: the windows lie one above the other. */
static void count_rays(const struct ih_fit_equations_rays *rays,
                       const struct edges edges[WINDOW_COUNT], struct share share[WINDOW_COUNT])
{
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int16_t y = rays->slope_q12[1][slot];
        const int i = y < edges[HIGH].y[1] ? HIGH : y < edges[LEVEL].y[1] ? LEVEL : BODY;
        const struct edges *b = &edges[i];
        const int16_t x = rays->slope_q12[0][slot];
        if (x > b->x[0] && x < b->x[1] && y > b->y[0] && y < b->y[1] &&
            (x <= b->gap[0] || x >= b->gap[1])) {
            const int16_t z = rays->point_mm_q1[2][slot];
            share[i].all++;
            share[i].part += z > b->z[0] && z <= b->z[1];
        }
    }
}
#endif

static int32_t plain_q8(struct share share)
{
    return share.part * 256 / ih_max_s32(share.all, MIN);
}

int32_t ih_prescreen_score_q8(const struct ih_fit_equations_rays *rays,
                              const int32_t origin_mm_q8[3], const int32_t centre_mm_q8[3])
{
    const int32_t depth_mm_q8 = centre_mm_q8[2] - origin_mm_q8[2];
    struct share share[WINDOW_COUNT] = {[HIGH] = {0, 0}};
    if (depth_mm_q8 >= DEPTH_MIN_MM_Q8) {
        const int32_t mm_q20 = (1 << 28) / depth_mm_q8;
        int32_t middle_q12[2];
        for (int axis = 0; axis < 2; axis++) {
            const int32_t off_mm_q8 = centre_mm_q8[axis] - origin_mm_q8[axis];
            middle_q12[axis] = (int32_t)((int64_t)off_mm_q8 * 4096 / depth_mm_q8);
        }
        struct edges edges[WINDOW_COUNT];
        for (int i = 0; i < WINDOW_COUNT; i++) {
            find_edges(&windows[i], middle_q12, mm_q20, centre_mm_q8[2] >> 7, &edges[i]);
        }
        count_rays(rays, edges, share);
    }
    const int32_t high_q8 = (2 * share[HIGH].part + 1) * 128 / (share[HIGH].all + 1);
    return 2 * high_q8 + 3 * plain_q8(share[BODY]) - 4 * plain_q8(share[LEVEL]);
}
