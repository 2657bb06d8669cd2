#include "ih_glance.h"

#include "ih_fix.h"

/* mm around the centre of a mean head. */
#define HIGH_FROM_MM 215
#define HIGH_ASIDE_MM 125
#define OPEN_MM 60
#define BODY_FROM_MM 153
#define BODY_TO_MM 373
#define BODY_ASIDE_MM 180
#define BODY_BEFORE_MM 220
#define BODY_BEHIND_MM 200
#define LEVEL_UP_MM 113
#define LEVEL_FROM_MM 170
#define LEVEL_TO_MM 330
#define LEVEL_DEEP_MM 150
/* Over a depth in Q8 it is a slope in Q12. */
#define ONE_MM_Q20 (1 << 20)
/* Rays of a share, at least. */
#define LEAST 3
/* Nearer to the origin's depth there is no telling where rays pass. */
#define DEPTH_LEAST_MM_Q8 (1 << 8)

/* Without its ends. */
struct between {
    int16_t low, high;
};

struct bounds {
    struct between high_x, body_x, body_y, level_x, level_y, body_z, level_z;
    struct between level_gap_x; /* too near for level */
    int16_t high_y, open_z;
};

struct share {
    int32_t part, all;
};

struct shares {
    struct share high, body, level;
};

static int16_t saturate_s16(int64_t value)
{
    return (int16_t)(value > INT16_MAX ? INT16_MAX : value < INT16_MIN ? INT16_MIN : value);
}

/* Slopes of the rays that pass between two offsets, of which the middle's is given. */
static struct between slopes(int64_t middle_q12, int32_t low_mm, int32_t high_mm,
                             int32_t depth_mm_q8)
{
    return (struct between){saturate_s16(middle_q12 + low_mm * ONE_MM_Q20 / depth_mm_q8),
                            saturate_s16(middle_q12 + high_mm * ONE_MM_Q20 / depth_mm_q8)};
}

static struct between depths(int32_t centre_mm_q8, int32_t before_mm, int32_t behind_mm)
{
    return (struct between){saturate_s16((centre_mm_q8 >> 7) - 2 * before_mm),
                            saturate_s16((centre_mm_q8 >> 7) + 2 * behind_mm)};
}

static void find_bounds(const int32_t origin_mm_q8[3], const int32_t centre_mm_q8[3],
                        int32_t depth_mm_q8, struct bounds *out)
{
    const int64_t x_q12 = ((int64_t)centre_mm_q8[0] - origin_mm_q8[0]) * 4096 / depth_mm_q8;
    const int64_t y_q12 = ((int64_t)centre_mm_q8[1] - origin_mm_q8[1]) * 4096 / depth_mm_q8;
    out->high_x = slopes(x_q12, -HIGH_ASIDE_MM, HIGH_ASIDE_MM, depth_mm_q8);
    out->high_y = slopes(y_q12, -HIGH_FROM_MM, 0, depth_mm_q8).low;
    out->open_z = depths(centre_mm_q8[2], 0, OPEN_MM).high;
    out->body_x = slopes(x_q12, -BODY_ASIDE_MM, BODY_ASIDE_MM, depth_mm_q8);
    out->body_y = slopes(y_q12, BODY_FROM_MM, BODY_TO_MM, depth_mm_q8);
    out->body_z = depths(centre_mm_q8[2], BODY_BEFORE_MM, BODY_BEHIND_MM);
    out->level_x = slopes(x_q12, -LEVEL_TO_MM, LEVEL_TO_MM, depth_mm_q8);
    out->level_gap_x = slopes(x_q12, -LEVEL_FROM_MM, LEVEL_FROM_MM, depth_mm_q8);
    out->level_y = slopes(y_q12, -LEVEL_UP_MM, LEVEL_UP_MM, depth_mm_q8);
    out->level_z = depths(centre_mm_q8[2], LEVEL_DEEP_MM, LEVEL_DEEP_MM);
}

/* What is nowhere, or has no end, is at IH_ROW_NOWHERE, which is between nothing. */
#if defined __SSE2__ || defined __ARM_NEON
/* A loop without a branch: compilers turn it into vectors. */
static void count_rays(const struct ih_row_rays *rays, const struct bounds *bounds,
                       struct shares *out)
{
    const struct bounds b = *bounds;
    int16_t high_all = 0, high = 0, body_all = 0, body = 0, level_all = 0, level = 0;
    for (int32_t slot = 0; slot < IH_ROW_RAYS; slot++) {
        const int16_t x = rays->slope_q12[0][slot];
        const int16_t y = rays->slope_q12[1][slot];
        const int16_t z = rays->point_mm_q1[2][slot];
        const int16_t is_high = (x > b.high_x.low) & (x < b.high_x.high) & (y < b.high_y);
        const int16_t is_below =
            (x > b.body_x.low) & (x < b.body_x.high) & (y > b.body_y.low) & (y < b.body_y.high);
        const int16_t is_beside = (x > b.level_x.low) & (x < b.level_x.high) &
                                  ((x <= b.level_gap_x.low) | (x >= b.level_gap_x.high)) &
                                  (y > b.level_y.low) & (y < b.level_y.high);
        high_all = (int16_t)(high_all + is_high);
        high = (int16_t)(high + (is_high & (z >= b.open_z)));
        body_all = (int16_t)(body_all + is_below);
        body = (int16_t)(body + (is_below & (z > b.body_z.low) & (z < b.body_z.high)));
        level_all = (int16_t)(level_all + is_beside);
        level = (int16_t)(level + (is_beside & (z > b.level_z.low) & (z < b.level_z.high)));
    }
    *out = (struct shares){{high, high_all}, {body, body_all}, {level, level_all}};
}
#else
static bool is_between(int16_t value, const struct between *between)
{
    return value > between->low && value < between->high;
}

static void count(struct share *share, bool part)
{
    share->all++;
    share->part += part;
}

/* Where there are no vectors, most rays are told by one comparison or two. */
static void count_rays(const struct ih_row_rays *rays, const struct bounds *b, struct shares *out)
{
    *out = (struct shares){.high = {0, 0}};
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int16_t x = rays->slope_q12[0][slot];
        if (!is_between(x, &b->level_x)) { /* the widest */
            continue;
        }
        const int16_t y = rays->slope_q12[1][slot];
        const int16_t z = rays->point_mm_q1[2][slot];
        if (y < b->high_y) {
            if (is_between(x, &b->high_x)) {
                count(&out->high, z >= b->open_z);
            }
        } else if (is_between(y, &b->level_y)) {
            if (!is_between(x, &b->level_gap_x)) {
                count(&out->level, is_between(z, &b->level_z));
            }
        } else if (is_between(y, &b->body_y) && is_between(x, &b->body_x)) {
            count(&out->body, is_between(z, &b->body_z));
        }
    }
}
#endif

static int32_t plain_q8(struct share share)
{
    return share.part * 256 / ih_max_s32(share.all, LEAST);
}

int32_t ih_glance_promise_q8(const struct ih_row_rays *rays, const int32_t origin_mm_q8[3],
                             const int32_t centre_mm_q8[3])
{
    const int32_t depth_mm_q8 = centre_mm_q8[2] - origin_mm_q8[2];
    struct shares shares = {.high = {0, 0}};
    if (depth_mm_q8 >= DEPTH_LEAST_MM_Q8) {
        struct bounds bounds;
        find_bounds(origin_mm_q8, centre_mm_q8, depth_mm_q8, &bounds);
        count_rays(rays, &bounds, &shares);
    }
    const int32_t high_q8 = (2 * shares.high.part + 1) * 128 / (shares.high.all + 1);
    return 2 * high_q8 + 3 * plain_q8(shares.body) - 4 * plain_q8(shares.level);
}
