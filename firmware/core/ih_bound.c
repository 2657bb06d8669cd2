#include "ih_bound.h"

#include <stddef.h>
#include <string.h>

#include "ih_fix.h"
#include "ih_lane16.h"

/* Values of ih_scan in 64ths, rounded up. */
#define VALUE_ON 64
#define VALUE_NEARER (-9)
#define VALUE_BEHIND (-29) /* 28 mm and more */
#define VALUE_FAR (-64)    /* 60 mm and more */
#define VALUE_EMPTY (-38)
#define VALUE_UNKNOWN (-9)
#define AROUND_OPEN 64
#define AROUND_EMPTY 45
#define AROUND_NEAR (-38)
#define RAYS_LEAST 8
/* Two divisions in ih_scan that cut off. */
#define CUT_Q12 2

#define RING_INNER2_Q10 1731 /* 1.3^2 */
#define RING_OUTER2_Q10 3697 /* 1.9^2, rounded up */
/* What is added to e.e for depths up to 16 m. */
#define REACH_MARGIN_Q10 128
#define SEMI_X_MM 78
#define SEMI_Y_MM 113
#define SEMI_Z_MM 98
#define X_OVER_Y_Q15 22619
#define Z_OVER_X_Q14 20585
#define Z_OVER_Y_Q14 14209
/* Places are cut at this, 3.99. */
#define CUT_Q11 8171
/* Semi-axes as shares of CUT_Q11, rounded up: the ring's outer rim and a head's, a little larger; and
 * how far down a nearest place can be that is in the ring and not more down than aside, in mm. */
#define RING_Q12 1985    /* 1.93 */
#define THROUGH_Q12 1049 /* 1.02 */
#define BELOW_Q12 1142   /* 1.11; it is 1.08 */
/* Depths against the centre's are cut at 4 semi-axes: Q1 mm. */
#define DEPTH_CUT_Q1 (2 * 4 * SEMI_Z_MM)
/* 2^11 / (2 SEMI_Z_MM), its whole and its part. */
#define DEPTH_WHOLE 10
#define DEPTH_PART_Q16 29425
#define BEHIND_CENTRE_MM 60
/* Millimetres as a share of the semi-axis, rounded towards the better. */
#define NEARER_Q11 (-((28 + IH_BOUND_DEPTH_MM) * 2048 / SEMI_Z_MM + 1))
#define BEHIND_Q11 ((28 + IH_BOUND_DEPTH_MM) * 2048 / SEMI_Z_MM + 1)
#define FAR_Q11 ((60 + IH_BOUND_DEPTH_MM) * 2048 / SEMI_Z_MM + 1)
#define ON_Q11 ((28 - IH_BOUND_DEPTH_MM) * 2048 / SEMI_Z_MM) /* surely on it */
/* A square root of what is below 1 is below this. */
#define ROOT_CUT_Q11 3072
#define ONE_Q14 (1 << 14)
#define ONE_Q30 ((int64_t)1 << 30)
#define DEPTH_LEAST_MM 227
#define DEPTH_MOST_MM 16300

/* Where there are no vectors, rays are looked at one by one. */
#if defined(IH_BOUND_ONE_BY_ONE)
#define LANES 1
#else
#define LANES IH_LANE_COUNT
#endif

static int16_t saturate_s16(int64_t value)
{
    return (int16_t)(value > INT16_MAX ? INT16_MAX : value < INT16_MIN ? INT16_MIN : value);
}

static void fill_value(const struct ih_ray *ray, struct ih_bound_rays *out, int32_t at)
{
    const bool is_seen = ray->state == IH_RAY_SEEN;
    const bool is_empty = ray->state == IH_RAY_EMPTY;
    out->seen[at] = is_seen ? -1 : 0;
    out->depth_mm_q1[at] = saturate_s16(ray->point_mm_q8[2] >> 7);
    out->inside[at] = (int16_t)(is_seen ? 0 : is_empty ? VALUE_EMPTY : VALUE_UNKNOWN);
    out->around[at] = is_empty ? AROUND_EMPTY : 0;
}

/* False: the ray is too steep for 16 bits. */
static bool fill_ray(const struct ih_ray *ray, struct ih_bound_rays *out, int32_t at)
{
    /* slopes below 2^22.1 times 2^14.4 */
    const int64_t gx_q15 = ih_mul_shift(ray->slope_x_q20, Z_OVER_X_Q14, 19);
    const int64_t gy_q15 = ih_mul_shift(ray->slope_y_q20, Z_OVER_Y_Q14, 19);
    const int64_t gg_q30 = ONE_Q30 + gx_q15 * gx_q15 + gy_q15 * gy_q15;
    const bool is_usable = gg_q30 < 2 * ONE_Q30;
    const int32_t gg_q15 = is_usable ? (int32_t)(gg_q30 >> 15) : 2 << 15;
    out->slope_q14[0][at] = saturate_s16(ray->slope_x_q20 >> 6);
    out->slope_q14[1][at] = saturate_s16(ray->slope_y_q20 >> 6);
    out->g_q15[0][at] = saturate_s16(gx_q15);
    out->g_q15[1][at] = saturate_s16(gy_q15);
    out->inverse_q15[at] = saturate_s16((1 << 30) / gg_q15);
    out->reach_q10[at] = saturate_s16((RING_OUTER2_Q10 * gg_q15 >> 15) + REACH_MARGIN_Q10);
    fill_value(ray, out, at);
    return is_usable;
}

/* What may count is not farther aside, above, below: see ih_bound.h. */
static void set_reach(const int32_t steep2_q14[2], int32_t both_q14, struct ih_bound_rays *out)
{
    const int32_t wide_q14 = ONE_Q14 + steep2_q14[0] / 2 + 1;
    const int32_t high_q14 = ONE_Q14 + steep2_q14[1] / 2 + 1;
    out->aside_q12 = RING_Q12 * wide_q14 >> 14;
    out->above_q12 = RING_Q12 * high_q14 >> 14;
    out->below_q12 = (BELOW_Q12 * (ONE_Q14 + steep2_q14[1] + 1) + RING_Q12 * both_q14) >> 14;
    out->through_q12 = THROUGH_Q12 * wide_q14 >> 14;
}

void ih_bound_prepare(const struct ih_space *space, struct ih_bound_rays *out)
{
    int32_t steep2_q14[2] = {0, 0};
    int32_t both_q14 = 0;
    memset(out, 0, sizeof *out);
    out->is_usable = true;
    for (int32_t at = 0; at < IH_BOUND_RAYS; at++) {
        out->reach_q10[at] = -REACH_MARGIN_Q10; /* behind a column: no ray is within it */
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int32_t line[2] = {slot % IH_GRID, slot / IH_GRID};
        const int32_t at = line[0] * IH_BOUND_COLUMN + line[1];
        out->is_usable = fill_ray(&space->ray[slot], out, at) && out->is_usable;
        for (int axis = 0; axis < 2; axis++) {
            const int32_t g_q15 = out->g_q15[axis][at];
            const int16_t slope_q14 = out->slope_q14[axis][at];
            int16_t *least_q14 = &out->least_q14[axis][line[axis]];
            int16_t *most_q14 = &out->most_q14[axis][line[axis]];
            const bool is_first = line[1 - axis] == 0;
            if (is_first || slope_q14 < *least_q14) {
                *least_q14 = slope_q14;
            }
            if (is_first || slope_q14 > *most_q14) {
                *most_q14 = slope_q14;
            }
            steep2_q14[axis] = ih_max_s32(steep2_q14[axis], (g_q15 * g_q15 >> 16) + 1);
        }
        const int32_t g2_q14 = out->g_q15[0][at] * out->g_q15[1][at] >> 16;
        both_q14 = ih_max_s32(both_q14, ih_abs_s32(g2_q14) + 1);
    }
    set_reach(steep2_q14, both_q14, out);
}

/* A centre, as the loop needs it: e = (slope - direction) times share, in Q11. */
struct place {
    int16_t direction_q14[2];
    int16_t cut[2];   /* differences are cut at this */
    int16_t times[2]; /* a power of two */
    int16_t share[2]; /* 2^14 .. 2^15 */
    int16_t depth_mm_q1, open_mm_q1;
    int16_t margin_q10;
    int32_t aside_q14, above_q14, below_q14, through_q14; /* slopes within which rays may count */
};

/* False: out of the limits. */
static bool set_axis(struct place *place, int axis, int64_t off_q8, int32_t depth_q8,
                     int32_t semi_mm)
{
    const int64_t direction_q14 = (off_q8 * ONE_Q14 - (off_q8 < 0 ? depth_q8 - 1 : 0)) / depth_q8;
    const int32_t share = depth_q8 * 32 / semi_mm; /* the depth over the semi-axis, Q13 */
    const int shift = ih_max_s32(ih_bits_u64((uint64_t)share) - 15, 0);
    place->times[axis] = (int16_t)(1 << shift);
    place->share[axis] = (int16_t)ih_max_s32(share >> shift, 1);
    place->cut[axis] = (int16_t)(((int64_t)CUT_Q11 << 16) / ((int64_t)place->share[axis] << shift));
    place->direction_q14[axis] = saturate_s16(direction_q14);
    return ih_abs_s64(direction_q14) < ONE_Q14;
}

/* A share of a cut, in slopes; 3 for what is rounded off it, off the slopes and the direction. */
static int32_t reach_q14(int16_t cut_q14, int32_t share_q12)
{
    return (cut_q14 * share_q12 >> 12) + 3;
}

static bool set_place(struct place *place, const struct ih_space *space,
                      const struct ih_bound_rays *rays, const int32_t centre_mm_q8[3])
{
    const int64_t depth_q8 = (int64_t)centre_mm_q8[2] - space->origin_mm_q8[2];
    if (!rays->is_usable || depth_q8 < DEPTH_LEAST_MM << 8 || depth_q8 > DEPTH_MOST_MM << 8 ||
        centre_mm_q8[2] < 0 || centre_mm_q8[2] > DEPTH_MOST_MM << 8) {
        return false;
    }
    const int32_t depth_mm = (int32_t)depth_q8 >> 8;
    place->depth_mm_q1 = (int16_t)(centre_mm_q8[2] >> 7);
    place->open_mm_q1 = (int16_t)(place->depth_mm_q1 + 2 * BEHIND_CENTRE_MM - 1);
    place->margin_q10 = (int16_t)(IH_BOUND_MARGIN_Q10 + depth_mm / 200);
    if (!set_axis(place, 0, (int64_t)centre_mm_q8[0] - space->origin_mm_q8[0], (int32_t)depth_q8,
                  SEMI_X_MM) ||
        !set_axis(place, 1, (int64_t)centre_mm_q8[1] - space->origin_mm_q8[1], (int32_t)depth_q8,
                  SEMI_Y_MM)) {
        return false;
    }
    place->aside_q14 = reach_q14(place->cut[0], rays->aside_q12);
    place->above_q14 = reach_q14(place->cut[1], rays->above_q12);
    place->below_q14 = reach_q14(place->cut[1], rays->below_q12);
    place->through_q14 = reach_q14(place->cut[0], rays->through_q12);
    return true;
}

/* Columns, or rows, from one to before another. */
struct span {
    int32_t begin, end;
};

/* The lines of a span that may have a ray between two slopes, and those between them. */
static struct span find_span(const struct ih_bound_rays *rays, int axis, struct span span,
                             int32_t low_q14, int32_t high_q14)
{
    const int16_t *least_q14 = rays->least_q14[axis];
    const int16_t *most_q14 = rays->most_q14[axis];
    while (span.begin < span.end &&
           (most_q14[span.begin] < low_q14 || least_q14[span.begin] > high_q14)) {
        span.begin++;
    }
    while (span.begin < span.end &&
           (most_q14[span.end - 1] < low_q14 || least_q14[span.end - 1] > high_q14)) {
        span.end--;
    }
    return span;
}

/* Where rays are that may count: those through the head are in some of the columns only. Rows are whole
 * vectors, which end behind a column's last ray at most. */
struct box {
    struct span columns, through, rows;
};

static struct box find_box(const struct ih_bound_rays *rays, const struct place *place)
{
    const int32_t x_q14 = place->direction_q14[0];
    const int32_t y_q14 = place->direction_q14[1];
    const struct span all = {0, IH_GRID};
    struct box box;
    box.columns = find_span(rays, 0, all, x_q14 - place->aside_q14, x_q14 + place->aside_q14);
    box.through =
        find_span(rays, 0, box.columns, x_q14 - place->through_q14, x_q14 + place->through_q14);
    box.rows = find_span(rays, 1, all, y_q14 - place->above_q14, y_q14 + place->below_q14);
    const int32_t count = (box.rows.end - box.rows.begin + LANES - 1) / LANES * LANES;
    if (LANES > 1) {
        box.rows.begin = ih_min_s32(box.rows.begin, IH_BOUND_COLUMN - count);
    }
    box.rows.end = box.rows.begin + count;
    return box;
}

/* Sums of values, in 64ths, and how many rays they are of, at least and at most. */
struct weighed {
    int32_t inside, inside_least, inside_most;
    int32_t around, around_least, around_most;
};

/* A mean is greatest over the fewest rays when the sum is positive, over the most when it is not;
 * rounded up. */
static int32_t mean_q12(int32_t sum_q6, int32_t count_least, int32_t count_most, int32_t share_q6)
{
    int32_t count = ih_max_s32(sum_q6 > 0 ? count_least : count_most, RAYS_LEAST);
    return sum_q6 * share_q6 / count + 1;
}

#if LANES > 1

/* clang 14 takes so few turns for too few to make vectors of. Where a sanitizer is in the way there are
 * none, and no need to say so. */
#ifdef __clang__
#pragma clang diagnostic ignored "-Wpass-failed"
#endif
#if defined __clang__ && LANES == 16
#define AS_VECTORS _Pragma("clang loop vectorize_width(16) interleave_count(1)")
#elif defined __clang__
#define AS_VECTORS _Pragma("clang loop vectorize_width(8) interleave_count(1)")
#else
#define AS_VECTORS
#endif
/* Or clang makes one loop of those around and through the head, which then asks at each turn. */
#define ALWAYS_INLINE inline __attribute__((always_inline))

/* The same, a lane for each ray. */
struct sums {
    ih_lane inside[LANES], inside_least[LANES], inside_most[LANES];
    ih_lane around[LANES], around_least[LANES], around_most[LANES];
};

/* How a ray passes. */
struct pass {
    ih_lane ex_q11, ey_q11; /* at the centre's depth */
    ih_lane gx_q15, gy_q15;
    ih_lane t_q11, inverse_q15, radius2_q10;
    ih_lane room_q10; /* to the reach */
    ih_lane seen, depth_q1;
};

/* Where a ray passes the ring, by how much more it is aside than down, at its nearest place. */
static inline ih_lane beside_of(const struct pass *pass)
{
    const ih_lane t_q12 = ih_lane_wrap(pass->t_q11 * 2);
    const ih_lane x_q12 =
        ih_lane_wrap(ih_lane_wrap(pass->ex_q11 - ih_lane_high_half(t_q12, pass->gx_q15)) * 2);
    const ih_lane y_q11 = ih_lane_wrap(pass->ey_q11 - ih_lane_high_half(t_q12, pass->gy_q15));
    return ih_lane_wrap(ih_lane_high_half(ih_lane_size(x_q12), X_OVER_Y_Q15) - y_q11);
}

/* How far a ray's place is from the next limit of where it counts: above the margin it surely does,
 * below minus the margin it surely does not. e.e and radius2 in Q10, beside in Q11. */
static inline ih_lane room_in_ring(const struct pass *pass, ih_lane beside_q11)
{
    const ih_lane ring = ih_lane_least(ih_lane_wrap(pass->radius2_q10 - RING_INNER2_Q10),
                                       ih_lane_wrap(RING_OUTER2_Q10 - pass->radius2_q10));
    return ih_lane_least(ih_lane_least(ring, beside_q11), pass->room_q10);
}

static inline ih_lane room_inside(const struct pass *pass)
{
    return ih_lane_least(ih_lane_wrap(1024 - pass->radius2_q10), pass->room_q10);
}

/* A ray beside or above the head, by its nearest place. */
static inline void add_around(const struct place *place, const struct pass *pass, ih_lane unseen,
                              struct sums *sums, int32_t k)
{
    const ih_lane margin = place->margin_q10;
    const ih_lane is_open = ih_lane_is_above(pass->depth_q1, place->open_mm_q1);
    const ih_lane value =
        ih_lane_wrap((ih_lane_pick(is_open, AROUND_OPEN, AROUND_NEAR) & pass->seen) | unseen);
    const ih_lane room = room_in_ring(pass, beside_of(pass));
    const ih_lane may = ih_lane_is_above(room, ih_lane_wrap(-margin));
    const ih_lane must = ih_lane_is_above(room, margin);
    sums->around[k] =
        ih_lane_wrap(sums->around[k] + ih_lane_wrap((ih_lane_most(value, 0) & may) +
                                                    (ih_lane_least(value, 0) & must)));
    sums->around_least[k] = ih_lane_wrap(sums->around_least[k] - must);
    sums->around_most[k] = ih_lane_wrap(sums->around_most[k] - may);
}

/* How far a ray's point is from where it enters: the square of half the way through the head, and what
 * is compared with its root. */
struct entry {
    ih_lane before_q11; /* how much nearer than the ray's nearest place the point is */
    ih_lane root2_q10;
};

static inline struct entry entry_of(const struct place *place, const struct pass *pass)
{
    const ih_lane dz_q1 =
        ih_lane_within(ih_lane_wrap(pass->depth_q1 - place->depth_mm_q1), DEPTH_CUT_Q1);
    const ih_lane dz_q11 =
        ih_lane_wrap(ih_lane_wrap(dz_q1 * DEPTH_WHOLE) + ih_lane_high_half(dz_q1, DEPTH_PART_Q16));
    return (struct entry){
        .before_q11 = ih_lane_wrap(-ih_lane_wrap(dz_q11 + pass->t_q11)),
        .root2_q10 = ih_lane_wrap(
            ih_lane_high_half(ih_lane_wrap(ih_lane_wrap(1024 - pass->radius2_q10) * 16),
                              pass->inverse_q15) >>
            3),
    };
}

/* Is the point, with its margin, farther behind the entry than this? */
static inline ih_lane is_behind(const struct entry *entry, ih_lane behind_q11, ih_lane margin)
{
    const ih_lane root = ih_lane_wrap(
        ih_lane_least(ih_lane_most(ih_lane_wrap(entry->before_q11 + behind_q11), 0), ROOT_CUT_Q11) *
        4);
    return ih_lane_is_above(ih_lane_wrap(entry->root2_q10 + margin), ih_lane_high_half(root, root));
}

/* How far a ray's point is behind the entry says what it is worth. */
static inline ih_lane depth_value(const struct place *place, const struct pass *pass)
{
    const ih_lane margin = place->margin_q10;
    const struct entry entry = entry_of(place, pass);
    const ih_lane may_touch = is_behind(&entry, NEARER_Q11, margin);
    const ih_lane behind = is_behind(&entry, BEHIND_Q11, ih_lane_wrap(-margin));
    const ih_lane far = is_behind(&entry, FAR_Q11, ih_lane_wrap(-margin));
    return ih_lane_pick(may_touch,
                        ih_lane_pick(behind, ih_lane_pick(far, VALUE_FAR, VALUE_BEHIND), VALUE_ON),
                        VALUE_NEARER);
}

/* A ray through it. */
static inline void add_inside(const struct place *place, const struct pass *pass, ih_lane unseen,
                              struct sums *sums, int32_t k)
{
    const ih_lane margin = place->margin_q10;
    const ih_lane value = ih_lane_wrap((depth_value(place, pass) & pass->seen) | unseen);
    const ih_lane room = room_inside(pass);
    const ih_lane may = ih_lane_is_above(room, ih_lane_wrap(-margin));
    ih_lane must = ih_lane_is_above(room, margin);
    must =
        ih_lane_wrap(must | (may & ih_lane_is_above(value, 0))); /* a value of 1 lowers no mean */
    sums->inside[k] = ih_lane_wrap(sums->inside[k] + (value & must));
    sums->inside_least[k] = ih_lane_wrap(sums->inside_least[k] - must);
    sums->inside_most[k] = ih_lane_wrap(sums->inside_most[k] - may);
}

static inline struct pass find_pass(const struct ih_bound_rays *rays, const struct place *place,
                                    int32_t at)
{
    struct pass pass;
    ih_lane dx = ih_lane_wrap(rays->slope_q14[0][at] - place->direction_q14[0]);
    ih_lane dy = ih_lane_wrap(rays->slope_q14[1][at] - place->direction_q14[1]);
    dx = ih_lane_within(dx, place->cut[0]);
    dy = ih_lane_within(dy, place->cut[1]);
    pass.ex_q11 = ih_lane_high_half(ih_lane_wrap(dx * place->times[0]), place->share[0]);
    pass.ey_q11 = ih_lane_high_half(ih_lane_wrap(dy * place->times[1]), place->share[1]);
    const ih_lane ex_q13 = ih_lane_wrap(pass.ex_q11 * 4);
    const ih_lane ey_q13 = ih_lane_wrap(pass.ey_q11 * 4);
    const ih_lane ee_q10 =
        ih_lane_wrap(ih_lane_high_half(ex_q13, ex_q13) + ih_lane_high_half(ey_q13, ey_q13));
    pass.room_q10 = ih_lane_wrap(rays->reach_q10[at] - ee_q10);
    pass.gx_q15 = rays->g_q15[0][at];
    pass.gy_q15 = rays->g_q15[1][at];
    pass.inverse_q15 = rays->inverse_q15[at];
    const ih_lane eg_q12 = ih_lane_wrap(ih_lane_high_half(ex_q13, pass.gx_q15) +
                                        ih_lane_high_half(ey_q13, pass.gy_q15));
    pass.t_q11 = ih_lane_high_half(eg_q12, pass.inverse_q15);
    pass.radius2_q10 = ih_lane_wrap(
        ee_q10 - ih_lane_high_half(ih_lane_wrap(eg_q12 * 2), ih_lane_wrap(pass.t_q11 * 4)));
    pass.seen = rays->seen[at];
    pass.depth_q1 = rays->depth_mm_q1[at];
    return pass;
}

/* Rays of some columns, around the head or through it. Loops of LANES turns become vectors. */
static ALWAYS_INLINE void add_rays(const struct ih_bound_rays *rays, const struct place *place,
                                   struct span columns, struct span rows, bool is_inside,
                                   struct sums *sums)
{
    for (int32_t row = rows.begin; row < rows.end; row += LANES) {
        for (int32_t column = columns.begin; column < columns.end; column++) {
            AS_VECTORS
            for (int32_t k = 0; k < LANES; k++) {
                const int32_t at = column * IH_BOUND_COLUMN + row + k;
                const struct pass pass = find_pass(rays, place, at);
                if (is_inside) {
                    add_inside(place, &pass, rays->inside[at], sums, k);
                } else {
                    add_around(place, &pass, rays->around[at], sums, k);
                }
            }
        }
    }
}

static int32_t total(const ih_lane lanes[LANES])
{
    ih_lane sum = 0;
    for (int32_t k = 0; k < LANES; k++) {
        sum = ih_lane_wrap(sum + lanes[k]);
    }
    return sum;
}

/* What rays count as, a lane for each of them. */
struct counts {
    ih_lane on[LANES], nearer[LANES], empty[LANES], far[LANES];
    ih_lane open[LANES], open_empty[LANES], closed[LANES], unknown[LANES];
};

/* A ray beside or above: all bits when it may count, and that is not sure. */
static inline ih_lane judge_around(const struct ih_bound_rays *rays, const struct place *place,
                                   int32_t at, const struct pass *pass, struct counts *counts,
                                   int32_t k)
{
    const ih_lane margin = place->margin_q10;
    const ih_lane room = room_in_ring(pass, beside_of(pass));
    const ih_lane may = ih_lane_is_above(room, ih_lane_wrap(-margin));
    const ih_lane open = ih_lane_is_above(pass->depth_q1, ih_lane_wrap(place->open_mm_q1 + 1));
    const ih_lane closed = ih_lane_is_above(ih_lane_wrap(place->open_mm_q1 + 1), pass->depth_q1);
    const ih_lane must =
        ih_lane_wrap(ih_lane_is_above(room, margin) & (open | closed | ~pass->seen));
    const ih_lane seen = ih_lane_wrap(must & pass->seen);
    const ih_lane unseen = ih_lane_wrap(must & ~pass->seen);
    const ih_lane empty = ih_lane_is_above(rays->around[at], 0);
    counts->open[k] = ih_lane_wrap(counts->open[k] - (seen & open));
    counts->closed[k] = ih_lane_wrap(counts->closed[k] - (seen & closed));
    counts->open_empty[k] = ih_lane_wrap(counts->open_empty[k] - (unseen & empty));
    counts->unknown[k] = ih_lane_wrap(counts->unknown[k] - (unseen & ~empty));
    return ih_lane_wrap(may & ~must);
}

/* A ray through it. */
static inline ih_lane judge_inside(const struct ih_bound_rays *rays, const struct place *place,
                                   int32_t at, const struct pass *pass, struct counts *counts,
                                   int32_t k)
{
    const ih_lane margin = place->margin_q10;
    const ih_lane room = room_inside(pass);
    const ih_lane may = ih_lane_is_above(room, ih_lane_wrap(-margin));
    const ih_lane must = ih_lane_is_above(room, margin);
    const ih_lane unseen = ih_lane_wrap(must & ~pass->seen);
    const ih_lane empty = ih_lane_wrap(unseen & ih_lane_is_above(rays->around[at], 0));
    const struct entry entry = entry_of(place, pass);
    const ih_lane seen = ih_lane_wrap(must & pass->seen);
    const ih_lane nearer = ih_lane_wrap(seen & ~is_behind(&entry, NEARER_Q11, margin));
    const ih_lane far = ih_lane_wrap(seen & is_behind(&entry, FAR_Q11, ih_lane_wrap(-margin)));
    const ih_lane on = ih_lane_wrap(seen & is_behind(&entry, -ON_Q11, ih_lane_wrap(-margin)) &
                                    ~is_behind(&entry, ON_Q11, margin));
    counts->on[k] = ih_lane_wrap(counts->on[k] - on);
    counts->nearer[k] = ih_lane_wrap(counts->nearer[k] - nearer - (unseen & ~empty));
    counts->empty[k] = ih_lane_wrap(counts->empty[k] - empty);
    counts->far[k] = ih_lane_wrap(counts->far[k] - far);
    return ih_lane_wrap(may & ~(unseen | nearer | far | on));
}

static ALWAYS_INLINE void judge_rays(const struct ih_bound_rays *rays, const struct place *place,
                                     struct span columns, struct span rows, bool is_inside,
                                     struct counts *counts, int16_t is_unsure[IH_BOUND_RAYS])
{
    for (int32_t row = rows.begin; row < rows.end; row += LANES) {
        for (int32_t column = columns.begin; column < columns.end; column++) {
            AS_VECTORS
            for (int32_t k = 0; k < LANES; k++) {
                const int32_t at = column * IH_BOUND_COLUMN + row + k;
                const struct pass pass = find_pass(rays, place, at);
                if (is_inside) {
                    is_unsure[at] = ih_lane_wrap(is_unsure[at] |
                                                 judge_inside(rays, place, at, &pass, counts, k));
                } else {
                    is_unsure[at] = judge_around(rays, place, at, &pass, counts, k);
                }
            }
        }
    }
}

/* The slots of unsure rays; four are passed over at once. */
static void list_unsure(const struct box *box, struct ih_bound_verdict *out)
{
    for (int32_t column = box->columns.begin; column < box->columns.end; column++) {
        for (int32_t row = box->rows.begin; row < box->rows.end; row += 4) {
            const int16_t *unsure = &out->is_unsure[column * IH_BOUND_COLUMN + row];
            uint64_t any;
            memcpy(&any, unsure, sizeof any);
            for (int32_t k = 0; any != 0 && k < 4; k++) {
                if (unsure[k] != 0) {
                    out->unsure[out->unsure_count++] = (int16_t)((row + k) * IH_GRID + column);
                }
            }
        }
    }
}

static void sum_up(const struct ih_bound_rays *rays, const struct place *place,
                   const struct box *box, struct weighed *out)
{
    struct sums sums;
    memset(&sums, 0, sizeof sums);
    add_rays(rays, place, box->columns, box->rows, false, &sums);
    add_rays(rays, place, box->through, box->rows, true, &sums);
    *out = (struct weighed){
        .inside = total(sums.inside),
        .inside_least = total(sums.inside_least),
        .inside_most = total(sums.inside_most),
        .around = total(sums.around),
        .around_least = total(sums.around_least),
        .around_most = total(sums.around_most),
    };
}

static void judge(const struct ih_bound_rays *rays, const struct place *place,
                  const struct box *box, struct ih_bound_verdict *out)
{
    struct counts counts;
    memset(&counts, 0, sizeof counts);
    judge_rays(rays, place, box->columns, box->rows, false, &counts, out->is_unsure);
    judge_rays(rays, place, box->through, box->rows, true, &counts, out->is_unsure);
    list_unsure(box, out);
    out->on = total(counts.on);
    out->nearer = total(counts.nearer);
    out->empty = total(counts.empty);
    out->far = total(counts.far);
    out->open = total(counts.open);
    out->open_empty = total(counts.open_empty);
    out->closed = total(counts.closed);
    out->unknown = total(counts.unknown);
}

#else

/* What a ray is worth; twice that, and 1 more when it surely counts, is where it is counted. */
enum worth {
    ON,
    NEARER,
    BEHIND,
    FAR,
    EMPTY,
    UNKNOWN,
    AROUND_WORTHS, /* from here on beside and above */
    OPEN = AROUND_WORTHS,
    CLOSED,
    OPEN_EMPTY,
    OPEN_UNKNOWN,
    WORTHS
};
#define NOTHING (2 * WORTHS) /* where rays are counted that do not count */

/* How a ray passes. */
struct pass {
    int32_t ex_q11, ey_q11; /* at the centre's depth */
    int32_t room_q10, t_q11, radius2_q10;
};

static inline int32_t beside_of(const struct ih_bound_rays *rays, int32_t at,
                                const struct pass *pass)
{
    const int32_t x_q12 = 2 * (pass->ex_q11 - (pass->t_q11 * rays->g_q15[0][at] >> 15));
    const int32_t y_q11 = pass->ey_q11 - (pass->t_q11 * rays->g_q15[1][at] >> 15);
    return (ih_abs_s32(x_q12) * X_OVER_Y_Q15 >> 16) - y_q11;
}

static inline int32_t look_around(const struct ih_bound_rays *rays, const struct place *place,
                                  int32_t at, const struct pass *pass, bool is_exact)
{
    const int32_t margin = place->margin_q10;
    int32_t room =
        ih_min_s32(pass->radius2_q10 - RING_INNER2_Q10, RING_OUTER2_Q10 - pass->radius2_q10);
    room = ih_min_s32(room, pass->room_q10);
    if (room <= -margin) {
        return NOTHING;
    }
    room = ih_min_s32(room, beside_of(rays, at, pass));
    if (room <= -margin) {
        return NOTHING;
    }
    bool is_sure = room > margin;
    enum worth worth = rays->around[at] > 0 ? OPEN_EMPTY : OPEN_UNKNOWN;
    if (rays->seen[at] != 0) {
        const int32_t behind = rays->depth_mm_q1[at] - place->open_mm_q1;
        worth = behind > 0 ? OPEN : CLOSED;
        is_sure = is_sure && !(is_exact && behind == 1);
    }
    return 2 * (int32_t)worth + is_sure;
}

/* Is a point, with its margin, farther behind the entry than this? */
static inline bool is_behind(int32_t root2_q10, int32_t before_q11, int32_t behind_q11)
{
    const int32_t root_q11 = ih_min_s32(ih_max_s32(before_q11 + behind_q11, 0), ROOT_CUT_Q11);
    return root2_q10 > root_q11 * root_q11 >> 12;
}

static inline int32_t look_inside(const struct ih_bound_rays *rays, const struct place *place,
                                  int32_t at, const struct pass *pass, bool is_exact)
{
    const int32_t margin = place->margin_q10;
    const bool is_sure = ih_min_s32(1024 - pass->radius2_q10, pass->room_q10) > margin;
    if (rays->seen[at] == 0) {
        return 2 * (int32_t)(rays->around[at] > 0 ? EMPTY : UNKNOWN) + is_sure;
    }
    const int32_t dz_q1 =
        ih_clamp_s32(rays->depth_mm_q1[at] - place->depth_mm_q1, -DEPTH_CUT_Q1, DEPTH_CUT_Q1);
    const int32_t before_q11 =
        -((dz_q1 * (DEPTH_WHOLE * 65536 + DEPTH_PART_Q16) >> 16) + pass->t_q11);
    const int32_t root2_q10 = (1024 - pass->radius2_q10) * 16 * rays->inverse_q15[at] >> 19;
    enum worth worth = ON;
    if (!is_behind(root2_q10 + margin, before_q11, NEARER_Q11)) {
        worth = NEARER;
    } else if (is_behind(root2_q10 - margin, before_q11, BEHIND_Q11)) {
        worth = is_behind(root2_q10 - margin, before_q11, FAR_Q11) ? FAR : BEHIND;
    } else if (is_exact && (!is_behind(root2_q10 - margin, before_q11, -ON_Q11) ||
                            is_behind(root2_q10 + margin, before_q11, ON_Q11))) {
        worth = BEHIND;
    }
    return 2 * (int32_t)worth + is_sure;
}

/* Of all rays in a box: where they are counted; exact: what may be on either side of a limit is not ON
 * nor sure. Then those that are not sure are listed, too. */
static void walk(const struct ih_bound_rays *rays, const struct place *place, const struct box *box,
                 struct ih_bound_verdict *exact, int32_t count[NOTHING + 1])
{
    const int32_t scale[2] = {place->times[0] * place->share[0], place->times[1] * place->share[1]};
    const int32_t least_q14[2] = {place->direction_q14[0] - place->cut[0],
                                  place->direction_q14[1] - place->cut[1]};
    const uint32_t sides_q14[2] = {2 * (uint32_t)place->cut[0], 2 * (uint32_t)place->cut[1]};
    const int32_t margin = place->margin_q10;
    for (int32_t column = box->columns.begin; column < box->columns.end; column++) {
        for (int32_t row = box->rows.begin; row < box->rows.end; row++) {
            const int32_t at = column * IH_BOUND_COLUMN + row;
            const int32_t x_q14 = rays->slope_q14[0][at] - least_q14[0];
            const int32_t y_q14 = rays->slope_q14[1][at] - least_q14[1];
            struct pass pass;
            if (IH_WRAPS(uint32_t, x_q14) > sides_q14[0] ||
                IH_WRAPS(uint32_t, y_q14) > sides_q14[1]) {
                continue;
            }
            pass.ex_q11 = (x_q14 - place->cut[0]) * scale[0] >> 16;
            pass.ey_q11 = (y_q14 - place->cut[1]) * scale[1] >> 16;
            const int32_t ee_q10 =
                (pass.ex_q11 * pass.ex_q11 >> 12) + (pass.ey_q11 * pass.ey_q11 >> 12);
            pass.room_q10 = rays->reach_q10[at] - ee_q10;
            if (pass.room_q10 <= -margin) {
                continue;
            }
            const int32_t eg_q12 =
                (pass.ex_q11 * rays->g_q15[0][at] >> 14) + (pass.ey_q11 * rays->g_q15[1][at] >> 14);
            pass.t_q11 = eg_q12 * rays->inverse_q15[at] >> 16;
            pass.radius2_q10 = ee_q10 - (eg_q12 * pass.t_q11 >> 13);
            const int32_t as = pass.radius2_q10 >= 1024 + margin
                                   ? look_around(rays, place, at, &pass, exact != NULL)
                                   : look_inside(rays, place, at, &pass, exact != NULL);
            count[as]++;
            if (exact != NULL && as != NOTHING && (as % 2 == 0 || as == 2 * (int32_t)BEHIND + 1)) {
                exact->unsure[exact->unsure_count++] = (int16_t)(row * IH_GRID + column);
            }
        }
    }
}

static void sum_up(const struct ih_bound_rays *rays, const struct place *place,
                   const struct box *box, struct weighed *out)
{
    static const int8_t value[WORTHS] = {
        VALUE_ON,      VALUE_NEARER, VALUE_BEHIND, VALUE_FAR,    VALUE_EMPTY,
        VALUE_UNKNOWN, AROUND_OPEN,  AROUND_NEAR,  AROUND_EMPTY, 0,
    };
    int32_t count[NOTHING + 1] = {0};
    walk(rays, place, box, NULL, count);
    *out = (struct weighed){0};
    count[2 * ON + 1] += count[2 * ON]; /* a value of 1 lowers no mean */
    count[2 * ON] = 0;
    for (int32_t worth = 0; worth < WORTHS; worth++) {
        const int32_t sure = count[2 * worth + 1];
        const int32_t all = sure + count[2 * worth];
        const int32_t sum = value[worth] * (value[worth] > 0 ? all : sure);
        if (worth < (int32_t)AROUND_WORTHS) {
            out->inside += sum;
            out->inside_least += sure;
            out->inside_most += all;
        } else {
            out->around += sum;
            out->around_least += sure;
            out->around_most += all;
        }
    }
}

static void judge(const struct ih_bound_rays *rays, const struct place *place,
                  const struct box *box, struct ih_bound_verdict *out)
{
    int32_t count[NOTHING + 1] = {0};
    walk(rays, place, box, out, count);
    out->on = count[2 * ON + 1];
    out->nearer = count[2 * NEARER + 1] + count[2 * UNKNOWN + 1];
    out->empty = count[2 * EMPTY + 1];
    out->far = count[2 * FAR + 1];
    out->open = count[2 * OPEN + 1];
    out->open_empty = count[2 * OPEN_EMPTY + 1];
    out->closed = count[2 * CLOSED + 1];
    out->unknown = count[2 * OPEN_UNKNOWN + 1];
}

#endif

int32_t ih_bound_score_q12(const struct ih_space *space, const struct ih_bound_rays *rays,
                           const int32_t centre_mm_q8[3])
{
    struct place place;
    struct weighed weighed;
    if (!set_place(&place, space, rays, centre_mm_q8)) {
        return IH_BOUND_MOST_Q12;
    }
    const struct box box = find_box(rays, &place);
    sum_up(rays, &place, &box, &weighed);
    /* 0.6 of 64 is 38.4 */
    const int32_t around_q12 =
        weighed.around > 0
            ? mean_q12(weighed.around * 3, weighed.around_least, weighed.around_most, 13)
            : mean_q12(weighed.around, weighed.around_least, weighed.around_most, 38);
    return mean_q12(weighed.inside, weighed.inside_least, weighed.inside_most, 64) + around_q12 +
           CUT_Q12;
}

void ih_bound_judge(const struct ih_space *space, const struct ih_bound_rays *rays,
                    const int32_t centre_mm_q8[3], struct ih_bound_verdict *out)
{
    struct place place;
    out->unsure_count = 0;
    if (set_place(&place, space, rays, centre_mm_q8)) {
        const struct box box = find_box(rays, &place);
        judge(rays, &place, &box, out);
        return;
    }
    *out = (struct ih_bound_verdict){.unsure_count = 0};
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        out->unsure[out->unsure_count++] = (int16_t)slot;
    }
}
