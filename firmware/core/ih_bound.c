#include "ih_bound.h"

#include <string.h>

#include "ih_fix.h"

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
/* Places are cut at this, 3.99. */
#define CUT_Q11 8171
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
/* A square root of what is below 1 is below this. */
#define ROOT_CUT_Q11 3072
#define ONE_Q14 (1 << 14)
#define DEPTH_LEAST_MM 227
#define DEPTH_MOST_MM 16300

/* Where there are no vectors, words are shorter to work with, and rays out of reach worth a branch. */
#if defined(__SSE2__) || defined(__ARM_NEON)
typedef int16_t lane;
#define ONE_BY_ONE false
#else
typedef int32_t lane;
#define ONE_BY_ONE true
#endif

/* Arithmetic of lanes, which wraps as vectors do. */
static inline lane wrap(int32_t value)
{
    return IH_WRAPS(lane, value);
}

static inline lane high_half(lane a, lane b)
{
    return wrap((int32_t)a * b >> 16);
}

static inline lane least(lane a, lane b)
{
    if (a < b) {
        return a;
    }
    return b;
}

static inline lane most(lane a, lane b)
{
    if (a > b) {
        return a;
    }
    return b;
}

static inline lane within(lane value, lane limit)
{
    return most(least(value, limit), wrap(-limit));
}

/* All bits or none. */
static inline lane is_above(lane a, lane b)
{
    return a > b ? -1 : 0;
}

static inline lane size(lane value)
{
    const lane sign = is_above(0, value);
    return wrap(wrap(value ^ sign) - sign);
}

static inline lane pick(lane mask, lane yes, lane no)
{
    return wrap((yes & mask) | (no & ~mask));
}

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
static bool fill_ray(const struct ih_ray *ray, const int32_t semi_mm_q8[3],
                     struct ih_bound_rays *out, int32_t at)
{
    const struct ih_aim aim = ih_ellipsoid_aim(semi_mm_q8, ray);
    const bool is_usable = aim.gg_q28 < (int64_t)1 << 29;
    out->slope_q14[0][at] = saturate_s16(ray->slope_x_q20 >> 6);
    out->slope_q14[1][at] = saturate_s16(ray->slope_y_q20 >> 6);
    for (int axis = 0; axis < 2; axis++) {
        out->g_q15[axis][at] = saturate_s16((int64_t)aim.g_q14[axis] * 2);
    }
    out->inverse_q15[at] = saturate_s16(((int64_t)1 << 43) / aim.gg_q28);
    out->reach_q10[at] = saturate_s16((RING_OUTER2_Q10 * aim.gg_q28 >> 28) + REACH_MARGIN_Q10);
    fill_value(ray, out, at);
    return is_usable;
}

void ih_bound_prepare(const struct ih_space *space, struct ih_bound_rays *out)
{
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(space->origin_mm_q8);
    memset(out, 0, sizeof *out); /* no ray behind the last is within a reach of 0 */
    out->is_usable = true;
    for (int32_t column = 0; column < IH_GRID; column++) {
        out->least_q14[column] = INT16_MAX;
        out->most_q14[column] = INT16_MIN;
        for (int32_t row = 0; row < IH_GRID; row++) {
            const int32_t at = column * IH_GRID + row;
            const struct ih_ray *ray = &space->ray[row * IH_GRID + column];
            out->is_usable = fill_ray(ray, mean.semi_mm_q8, out, at) && out->is_usable;
            const int16_t slope_q14 = out->slope_q14[0][at];
            if (slope_q14 < out->least_q14[column]) {
                out->least_q14[column] = slope_q14;
            }
            if (slope_q14 > out->most_q14[column]) {
                out->most_q14[column] = slope_q14;
            }
        }
    }
}

/* A centre, as the loop needs it: e = (slope - direction) times share, in Q11. */
struct place {
    int16_t direction_q14[2];
    int16_t cut[2];   /* differences are cut at this */
    int16_t times[2]; /* a power of two */
    int16_t share[2]; /* 2^14 .. 2^15 */
    int16_t depth_mm_q1, open_mm_q1;
    int16_t margin_q10;
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

static bool set_place(struct place *place, const struct ih_space *space,
                      const int32_t centre_mm_q8[3])
{
    const int64_t depth_q8 = (int64_t)centre_mm_q8[2] - space->origin_mm_q8[2];
    if (depth_q8 < DEPTH_LEAST_MM << 8 || depth_q8 > DEPTH_MOST_MM << 8 || centre_mm_q8[2] < 0 ||
        centre_mm_q8[2] > DEPTH_MOST_MM << 8) {
        return false;
    }
    const int32_t depth_mm = (int32_t)depth_q8 >> 8;
    place->depth_mm_q1 = (int16_t)(centre_mm_q8[2] >> 7);
    place->open_mm_q1 = (int16_t)(place->depth_mm_q1 + 2 * BEHIND_CENTRE_MM - 1);
    place->margin_q10 = (int16_t)(IH_BOUND_MARGIN_Q10 + depth_mm / 200);
    return set_axis(place, 0, (int64_t)centre_mm_q8[0] - space->origin_mm_q8[0], (int32_t)depth_q8,
                    SEMI_X_MM) &&
           set_axis(place, 1, (int64_t)centre_mm_q8[1] - space->origin_mm_q8[1], (int32_t)depth_q8,
                    SEMI_Y_MM);
}

/* The rays of all columns that may be in reach, 2.74 of 3.99, in whole vectors. */
static void find_columns(const struct ih_bound_rays *rays, const struct place *place,
                         int32_t *begin, int32_t *end)
{
    const int32_t reach = place->cut[0] * 11 / 16 + 1;
    int32_t first = IH_GRID;
    int32_t last = -1;
    for (int32_t column = 0; column < IH_GRID; column++) {
        if (rays->most_q14[column] >= place->direction_q14[0] - reach &&
            rays->least_q14[column] <= place->direction_q14[0] + reach) {
            first = ih_min_s32(first, column);
            last = column;
        }
    }
    *begin = first * IH_GRID / 16 * 16;
    *end = ((last + 1) * IH_GRID + 15) / 16 * 16;
}

/* Sums of values, in 64ths, and how many rays they are of, at least and at most. */
struct lanes {
    lane inside, inside_least, inside_most;
    lane around, around_least, around_most;
};

/* How a ray passes. */
struct pass {
    lane ex_q11, ey_q11; /* at the centre's depth */
    lane gx_q15, gy_q15;
    lane t_q11, inverse_q15, radius2_q10;
    lane near; /* within reach */
    lane seen, depth_q1;
};

/* A ray beside or above the head, by its nearest place. */
static inline void add_around(const struct place *place, const struct pass *pass, lane unseen,
                              struct lanes *sums)
{
    const lane margin = place->margin_q10;
    if (ONE_BY_ONE && (pass->radius2_q10 <= RING_INNER2_Q10 - margin ||
                       pass->radius2_q10 >= RING_OUTER2_Q10 + margin)) {
        return;
    }
    const lane t_q12 = wrap(pass->t_q11 * 2);
    const lane x_q12 = wrap(wrap(pass->ex_q11 - high_half(t_q12, pass->gx_q15)) * 2);
    const lane y_q11 = wrap(pass->ey_q11 - high_half(t_q12, pass->gy_q15));
    const lane beside_q11 = wrap(high_half(size(x_q12), X_OVER_Y_Q15) - y_q11);
    if (ONE_BY_ONE && beside_q11 <= -margin) {
        return;
    }
    const lane is_open = is_above(pass->depth_q1, place->open_mm_q1);
    const lane value = wrap((pick(is_open, AROUND_OPEN, AROUND_NEAR) & pass->seen) | unseen);
    const lane may = wrap(pass->near & is_above(pass->radius2_q10, wrap(RING_INNER2_Q10 - margin)) &
                          is_above(wrap(RING_OUTER2_Q10 + margin), pass->radius2_q10) &
                          is_above(beside_q11, wrap(-margin)));
    const lane must = wrap(
        pass->near & is_above(pass->radius2_q10, wrap(RING_INNER2_Q10 + margin)) &
        is_above(wrap(RING_OUTER2_Q10 - margin), pass->radius2_q10) & is_above(beside_q11, margin));
    sums->around = wrap(sums->around + wrap((most(value, 0) & may) + (least(value, 0) & must)));
    sums->around_least = wrap(sums->around_least - must);
    sums->around_most = wrap(sums->around_most - may);
}

/* How far a ray's point is behind the entry says what it is worth. */
static inline lane depth_value(const struct place *place, const struct pass *pass)
{
    const lane margin = place->margin_q10;
    const lane dz_q1 = within(wrap(pass->depth_q1 - place->depth_mm_q1), DEPTH_CUT_Q1);
    const lane dz_q11 = wrap(wrap(dz_q1 * DEPTH_WHOLE) + high_half(dz_q1, DEPTH_PART_Q16));
    const lane before_q11 = wrap(-wrap(dz_q11 + pass->t_q11));
    const lane root2_q10 =
        wrap(high_half(wrap(wrap(1024 - pass->radius2_q10) * 16), pass->inverse_q15) >> 3);
    const lane nearer = wrap(least(most(wrap(before_q11 + NEARER_Q11), 0), ROOT_CUT_Q11) * 4);
    const lane may_touch = is_above(wrap(root2_q10 + margin), high_half(nearer, nearer));
    if (ONE_BY_ONE && may_touch == 0) {
        return VALUE_NEARER;
    }
    const lane behind = wrap(least(most(wrap(before_q11 + BEHIND_Q11), 0), ROOT_CUT_Q11) * 4);
    const lane is_behind = is_above(wrap(root2_q10 - margin), high_half(behind, behind));
    if (ONE_BY_ONE && is_behind == 0) {
        return VALUE_ON;
    }
    const lane far = wrap(least(most(wrap(before_q11 + FAR_Q11), 0), ROOT_CUT_Q11) * 4);
    const lane is_far = is_above(wrap(root2_q10 - margin), high_half(far, far));
    return pick(may_touch, pick(is_behind, pick(is_far, VALUE_FAR, VALUE_BEHIND), VALUE_ON),
                VALUE_NEARER);
}

/* A ray through it. */
static inline void add_inside(const struct place *place, const struct pass *pass, lane unseen,
                              struct lanes *sums)
{
    const lane margin = place->margin_q10;
    lane value = unseen;
    if (!ONE_BY_ONE || pass->seen != 0) {
        value = wrap((depth_value(place, pass) & pass->seen) | unseen);
    }
    const lane may = wrap(pass->near & is_above(wrap(1024 + margin), pass->radius2_q10));
    lane must = wrap(pass->near & is_above(wrap(1024 - margin), pass->radius2_q10));
    must = wrap(must | (may & is_above(value, 0))); /* a value of 1 lowers no mean */
    sums->inside = wrap(sums->inside + (value & must));
    sums->inside_least = wrap(sums->inside_least - must);
    sums->inside_most = wrap(sums->inside_most - may);
}

/* A loop without a branch where there are vectors: compilers turn it into them. */
static void add_rays(const struct ih_bound_rays *rays, const struct place *place, int32_t begin,
                     int32_t end, struct lanes *out)
{
    struct lanes sums = {0, 0, 0, 0, 0, 0};
    for (int32_t i = begin; i < end; i++) {
        struct pass pass;
        lane dx = wrap(rays->slope_q14[0][i] - place->direction_q14[0]);
        lane dy = wrap(rays->slope_q14[1][i] - place->direction_q14[1]);
        if (ONE_BY_ONE && (size(dx) > place->cut[0] || size(dy) > place->cut[1])) {
            continue;
        }
        dx = within(dx, place->cut[0]);
        dy = within(dy, place->cut[1]);
        pass.ex_q11 = high_half(wrap(dx * place->times[0]), place->share[0]);
        pass.ey_q11 = high_half(wrap(dy * place->times[1]), place->share[1]);
        const lane ex_q13 = wrap(pass.ex_q11 * 4);
        const lane ey_q13 = wrap(pass.ey_q11 * 4);
        const lane ee_q10 = wrap(high_half(ex_q13, ex_q13) + high_half(ey_q13, ey_q13));
        pass.near = is_above(rays->reach_q10[i], ee_q10);
        if (ONE_BY_ONE && pass.near == 0) {
            continue;
        }
        pass.gx_q15 = rays->g_q15[0][i];
        pass.gy_q15 = rays->g_q15[1][i];
        pass.inverse_q15 = rays->inverse_q15[i];
        const lane eg_q12 = wrap(high_half(ex_q13, pass.gx_q15) + high_half(ey_q13, pass.gy_q15));
        pass.t_q11 = high_half(eg_q12, pass.inverse_q15);
        pass.radius2_q10 = wrap(ee_q10 - high_half(wrap(eg_q12 * 2), wrap(pass.t_q11 * 4)));
        pass.seen = rays->seen[i];
        pass.depth_q1 = rays->depth_mm_q1[i];
        if (!ONE_BY_ONE || pass.radius2_q10 > 1024 + place->margin_q10) {
            add_around(place, &pass, rays->around[i], &sums);
        }
        if (!ONE_BY_ONE || pass.radius2_q10 <= 1024 + place->margin_q10) {
            add_inside(place, &pass, rays->inside[i], &sums);
        }
    }
    *out = sums;
}

/* A mean is greatest over the fewest rays when the sum is positive, over the most when it is not;
 * rounded up. */
static int32_t mean_q12(int32_t sum_q6, int32_t count_least, int32_t count_most, int32_t share_q6)
{
    int32_t count = ih_max_s32(sum_q6 > 0 ? count_least : count_most, RAYS_LEAST);
    return sum_q6 * share_q6 / count + 1;
}

int32_t ih_bound_score_q12(const struct ih_space *space, const struct ih_bound_rays *rays,
                           const int32_t centre_mm_q8[3])
{
    struct place place;
    struct lanes sums;
    int32_t begin, end;
    if (!rays->is_usable || !set_place(&place, space, centre_mm_q8)) {
        return IH_BOUND_MOST_Q12;
    }
    find_columns(rays, &place, &begin, &end);
    add_rays(rays, &place, begin, end, &sums);
    /* 0.6 of 64 is 38.4 */
    int32_t around_q12 = sums.around > 0
                             ? mean_q12(sums.around * 3, sums.around_least, sums.around_most, 13)
                             : mean_q12(sums.around, sums.around_least, sums.around_most, 38);
    return mean_q12(sums.inside, sums.inside_least, sums.inside_most, 64) + around_q12 + CUT_Q12;
}
