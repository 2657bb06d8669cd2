#include "detect/ih_ray_counts.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_fix.h"
#include "detect/ih_head_model.h"
#include "detect/ih_ray_limits.h"
#include "simd/ih_simd.h"

/* Every ray of known state is left to ih_evidence. */
static void leave_all(const struct ih_rays *rays, struct ih_ray_marks *marks)
{
    memset(marks, 0, sizeof *marks);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (rays->ray[slot].state != IH_RAY_UNKNOWN) {
            marks->unsure[slot / 32] |= 1U << slot % 32;
            marks->may_hit[slot / 32] |= 1U << slot % 32;
        }
    }
}

#if IH_I16_LANES > 0
#define RING_INNER2_Q10 ((int16_t)IH_HEAD_SQUARE(IH_HEAD_RING_INNER_PERCENT, 10))
#define RING_OUTER2_Q10 ((int16_t)IH_HEAD_SQUARE(IH_HEAD_RING_OUTER_PERCENT, 10))
#define AROUND2_Q10 ((int16_t)IH_HEAD_SQUARE(IH_HEAD_AROUND_PERCENT, 10))
#define BELOW_Q15 ((int16_t)IH_HEAD_PART(IH_HEAD_RING_BELOW_TENTHS * 10, 15))
#define ABOVE_Q15 ((int16_t)IH_HEAD_PART(IH_HEAD_RING_ABOVE_TENTHS * 10, 15))
/* A slack like a region's, but only the points before the front are counted there. */
#define BEFORE IH_RAY_REGIONS
#define SLACKS (IH_RAY_REGIONS + 1)

/* Counts of a lane's rays in each region, and of those that met what the region is about. */
struct sums {
    ih_i16 all[IH_RAY_REGIONS], part[IH_RAY_REGIONS];
    ih_i16 nothing, before;
};

static inline ih_i16 min3(ih_i16 a, ih_i16 b, ih_i16 c)
{
    return ih_i16_min(ih_i16_min(a, b), c);
}

/* value - limit, and limit - value. */
static inline ih_i16 above(ih_i16 value, int16_t limit)
{
    return ih_i16_sub(value, ih_i16_all(limit));
}

static inline ih_i16 below(ih_i16 value, int16_t limit)
{
    return ih_i16_sub(ih_i16_all(limit), value);
}

static inline ih_i16 scaled(ih_i16 difference, const struct ih_ray_scale *scale)
{
    const ih_i16 clamped = ih_i16_clamp(difference, scale->limit);
    const ih_i16 product =
        ih_i16_mul_high(ih_i16_mul(clamped, ih_i16_all(scale->power)), ih_i16_all(scale->factor));
    return ih_i16_add(product, ih_i16_all(1)); /* nearer to the middle of what is rounded down */
}

struct offset {
    ih_i16 dx_q14, dy_q14;
    ih_i16 x, y; /* mm Q4 */
    ih_i16 ex_q11, aside_q12, ey_q11, ee_q10;
    ih_i16 ring, down; /* slack in the ring; by how much more down than aside */
};

static inline struct offset offset_of(const struct ih_ray_limits *candidate,
                                      const struct ih_ray_table *table, int32_t slot)
{
    struct offset at;
    at.dx_q14 = above(ih_i16_load(&table->slope_q14[0][slot]), candidate->direction_q14[0]);
    at.dy_q14 = above(ih_i16_load(&table->slope_q14[1][slot]), candidate->direction_q14[1]);
    at.x = scaled(at.dx_q14, &candidate->mm[0]);
    at.y = scaled(at.dy_q14, &candidate->mm[1]);
    at.ex_q11 = scaled(at.dx_q14, &candidate->semi[0]);
    at.ey_q11 = scaled(at.dy_q14, &candidate->semi[1]);
    const ih_i16 ex_q13 = ih_i16_shift_left(at.ex_q11, 2);
    const ih_i16 ey_q13 = ih_i16_shift_left(at.ey_q11, 2);
    at.ee_q10 = ih_i16_add(ih_i16_mul_high(ex_q13, ex_q13), ih_i16_mul_high(ey_q13, ey_q13));
    at.aside_q12 = ih_i16_shift_left(ih_i16_abs(at.ex_q11), 1);
    at.ring = ih_i16_shift_right(
        ih_i16_min(above(at.ee_q10, RING_INNER2_Q10), below(at.ee_q10, RING_OUTER2_Q10)), 2);
    at.down = ih_i16_shift_right(
        ih_i16_sub(at.ey_q11, ih_i16_mul_high(at.aside_q12, ih_i16_all(BELOW_Q15))), 1);
    return at;
}

/* By how much a ray is inside of each region. */
static inline void find_slack_around(const struct ih_ray_limits *candidate, const struct offset *at,
                                     ih_i16 slack[SLACKS])
{
    const ih_i16 limit = ih_i16_mul_high(at->aside_q12, ih_i16_all(ABOVE_Q15));
    const ih_i16 up = ih_i16_shift_right(ih_i16_negate(ih_i16_add(at->ey_q11, limit)), 1);
    const ih_i16 beside = ih_i16_min(at->ring, ih_i16_negate(at->down));
    const ih_i16 side = ih_i16_min(beside, ih_i16_negate(up));
    slack[IH_RAY_HIGH] = min3(ih_i16_negate(ih_i16_add(at->y, ih_i16_all(candidate->high_y))),
                              below(ih_i16_abs(at->x), candidate->high_x),
                              below(ih_i16_abs(at->dy_q14), candidate->reach_q14[1]));
    slack[IH_RAY_BELOW] = ih_i16_min(at->ring, at->down);
    slack[IH_RAY_ABOVE] = ih_i16_min(beside, up);
    slack[IH_RAY_LEFT] = ih_i16_min(side, ih_i16_negate(at->ex_q11));
    slack[IH_RAY_RIGHT] = ih_i16_min(side, at->ex_q11);
    slack[BEFORE] = ih_i16_shift_right(below(at->ee_q10, AROUND2_Q10), 2);
}

static inline void find_slack_below(const struct ih_ray_limits *candidate, const struct offset *at,
                                    ih_i16 slack[SLACKS])
{
    const ih_i16 aside = ih_i16_abs(at->x);
    const ih_i16 under = above(at->y, candidate->body_top_y);
    const ih_i16 shoulder = ih_i16_min(min3(above(at->y, candidate->shoulder_top_y),
                                            below(at->y, candidate->shoulder_bottom_y),
                                            above(aside, IH_RAY_MM_Q4(IH_HEAD_SHOULDER_NEAR_MM))),
                                       below(aside, IH_RAY_MM_Q4(IH_HEAD_SHOULDER_FAR_MM)));
    slack[IH_RAY_BODY] = min3(under, below(at->y, candidate->body_bottom_y),
                              below(aside, IH_RAY_MM_Q4(IH_HEAD_BODY_ASIDE_MM)));
    slack[IH_RAY_WIDE] = ih_i16_min(min3(under, below(at->y, candidate->wide_bottom_y),
                                         above(aside, IH_RAY_MM_Q4(IH_HEAD_WIDE_ASIDE_MM))),
                                    below(ih_i16_abs(at->dx_q14), candidate->reach_q14[0]));
    slack[IH_RAY_LEVEL] = min3(below(ih_i16_abs(at->y), candidate->semi_y),
                               above(aside, IH_RAY_MM_Q4(IH_HEAD_LEVEL_NEAR_MM)),
                               below(aside, IH_RAY_MM_Q4(IH_HEAD_LEVEL_FAR_MM)));
    slack[IH_RAY_SHOULDER_LEFT] = ih_i16_min(shoulder, ih_i16_negate(at->x));
    slack[IH_RAY_SHOULDER_RIGHT] = ih_i16_min(shoulder, at->x);
}

/* What rays returned; unsure: a depth on a limit. */
struct returns {
    ih_i16 known, empty, is_open, is_body, is_level, is_before, unsure;
};

static inline struct returns returns_of(const struct ih_ray_limits *candidate,
                                        const struct ih_ray_table *table, int32_t slot)
{
    const ih_i16 seen = ih_i16_load(&table->seen[slot]);
    const ih_i16 empty = ih_i16_load(&table->empty[slot]);
    const ih_i16 depth = ih_i16_load(&table->point_mm_q1[2][slot]);
    const ih_i16 on_limit = (depth == candidate->open) | (depth == candidate->body_min) |
                            (depth == candidate->body_max) | (depth == candidate->level_min) |
                            (depth == candidate->level_max) | (depth == candidate->before);
    return (struct returns){
        .known = seen | empty,
        .empty = empty,
        .is_open = empty | (depth > candidate->open),
        .is_body = seen & (depth > candidate->body_min) & ~(depth > candidate->body_max),
        .is_level = seen & (depth > candidate->level_min) & ~(depth > candidate->level_max),
        .is_before = seen & ~(depth > candidate->before),
        .unsure = seen & on_limit,
    };
}

/* A ray that is unsure in one region is counted in none. */
static inline ih_i16 find_unsure(const ih_i16 slack[SLACKS], int16_t margin,
                                 const struct returns *found)
{
    ih_i16 nearest = ih_i16_abs(slack[0]);
    for (int region = 1; region < SLACKS; region++) {
        nearest = ih_i16_min(nearest, ih_i16_abs(slack[region]));
    }
    return found->known & (found->unsure | ~(nearest > margin));
}

static inline void add(struct sums *sums, int region, ih_i16 slack, ih_i16 counts, ih_i16 part)
{
    const ih_i16 is_in = slack > 0;
    sums->all[region] = ih_i16_sub(sums->all[region], is_in & counts);
    sums->part[region] = ih_i16_sub(sums->part[region], is_in & part);
}

/* Masks of ih_ray_marks. */
struct masks {
    ih_i16 unsure, may_hit, body;
};

static inline struct masks count_lanes(const struct ih_ray_limits *candidate,
                                       const struct ih_ray_table *table, int32_t slot,
                                       struct sums *sums)
{
    ih_i16 slack[SLACKS];
    const struct offset at = offset_of(candidate, table, slot);
    const struct returns found = returns_of(candidate, table, slot);
    find_slack_around(candidate, &at, slack);
    find_slack_below(candidate, &at, slack);
    const ih_i16 unsure = find_unsure(slack, candidate->margin, &found);
    const ih_i16 counts = found.known & ~unsure;
    const ih_i16 open = counts & found.is_open;
    const ih_i16 body = counts & found.is_body;
    const ih_i16 beside = ih_i16_min(at.ring, ih_i16_negate(at.down)) > 0;
    for (int region = 0; region < IH_RAY_LEVEL; region++) {
        add(sums, region, slack[region], counts, region < IH_RAY_BODY ? open : body);
    }
    add(sums, IH_RAY_LEVEL, slack[IH_RAY_LEVEL], counts, counts & found.is_level);
    sums->nothing = ih_i16_sub(sums->nothing, beside & counts & found.empty);
    sums->before = ih_i16_sub(sums->before, (slack[BEFORE] > 0) & counts & found.is_before);
    return (struct masks){.unsure = unsure,
                          .may_hit = found.known & (at.ee_q10 < candidate->hit_q10),
                          .body = (slack[IH_RAY_BODY] > 0) & body};
}

static void count_rays(const struct ih_ray_limits *candidate, const struct ih_ray_table *table,
                       struct ih_ray_marks *marks, struct sums *sums)
{
    memset(marks, 0, sizeof *marks);
    memset(sums, 0, sizeof *sums);
    for (int32_t slot = 0; slot < IH_RAYS_COLUMN; slot += 2 * IH_I16_LANES) {
        const struct masks first = count_lanes(candidate, table, slot, sums);
        const struct masks second = count_lanes(candidate, table, slot + IH_I16_LANES, sums);
        const int32_t word = slot / 32;
        const int32_t bit = slot % 32;
        marks->unsure[word] |= ih_i16_bits(first.unsure, second.unsure) << bit;
        marks->may_hit[word] |= ih_i16_bits(first.may_hit, second.may_hit) << bit;
        marks->body[word] |= ih_i16_bits(first.body, second.body) << bit;
    }
}

static bool try_count(const struct ih_rays *rays, const struct ih_ray_limits *candidate,
                      struct ih_ray_marks *marks, struct ih_ray_counts *out)
{
    struct sums sums;
    count_rays(candidate, &rays->table, marks, &sums);
    for (int region = 0; region < IH_RAY_REGIONS; region++) {
        out->region[region].part = ih_i16_total(sums.part[region]);
        out->region[region].all = ih_i16_total(sums.all[region]);
    }
    out->nothing = ih_i16_total(sums.nothing);
    out->before = ih_i16_total(sums.before);
    return true;
}
#else
/* One by one, rays are counted by ih_evidence with fewer instructions. */
static bool try_count(const struct ih_rays *rays, const struct ih_ray_limits *candidate,
                      struct ih_ray_marks *marks, struct ih_ray_counts *out)
{
    (void)rays;
    (void)candidate;
    (void)marks;
    (void)out;
    return false;
}
#endif

void ih_ray_counts_count(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                         const struct ih_ellipsoid_box *box, struct ih_ray_marks *marks,
                         struct ih_ray_counts *out)
{
    struct ih_ray_limits candidate;
    if (!ih_ray_limits_set(&candidate, rays, ellipsoid, box) ||
        !try_count(rays, &candidate, marks, out)) {
        *out = (struct ih_ray_counts){.before = 0};
        leave_all(rays, marks);
    }
}
