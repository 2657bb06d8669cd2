#include "detect/ih_fit_equations.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "detect/ih_ellipsoid_distance.h"
#include "simd/ih_simd.h"

#define ONE_Q14 (1 << 14)
/* No row is farther out than this many radii, 3.35: with a fit's semi-axes none would have a weight. */
#define RADIUS_MAX_Q14 54886
#define PUSH_MAX_MM_Q8 (30 << 8)
#define PUSH_WEIGHT_Q16 32768 /* 0.5 */
/* Error of an entry, see ih_ellipsoid. */
#define FRONT_MM_Q8 256
/* Bits of a row's slopes by the centre, at most 1, and by ln of the axes, below 3.6; of its weighted residual. */
#define CENTRE_BITS 14
#define LN_BITS 13
#define RESIDUAL_BITS 10
/* A hundredth of ln, in IH_GRADIENT_MM. */
#define LN_HUNDREDTH_Q16 (IH_GRADIENT_MM * 65536 / 100)
#define CENTRE_MAX ((1 << CENTRE_BITS) - 1)

/* What is the same for all rays of a step. */
struct step {
    const struct ih_ellipsoid *ellipsoid;
    const int32_t *origin_mm_q8;
    struct ih_fractions fractions;
    struct ih_fit_weighting weighting;
    struct ih_ellipsoid_box box; /* rays that may hit it pass through */
    int32_t see_through_mm;
    int32_t reach_mm_q8[3]; /* points farther from the centre have no weight */
    int32_t front_mm_q8;    /* no ray enters before this depth */
};

/* A residual is at least (f - 1) times the shortest semi-axis: it has no weight from f = 1 + 5 k / a
 * on. A 64th more for rounding. */
static void begin_step(struct step *step, const struct ih_ray_table *table)
{
    const struct ih_ellipsoid *ellipsoid = step->ellipsoid;
    const int32_t *semi_mm_q8 = ellipsoid->semi_mm_q8;
    const int32_t shortest_q8 = ih_min_s32(ih_min_s32(semi_mm_q8[0], semi_mm_q8[1]), semi_mm_q8[2]);
    const int64_t reach_mm = (int64_t)IH_FIT_SCALES_MAX * step->weighting.scale_mm;
    int64_t max_q14 = ONE_Q14 + ih_div_round(reach_mm * (ONE_Q14 << 8), shortest_q8);
    max_q14 = ih_min_s64(max_q14 + max_q14 / 64, RADIUS_MAX_Q14);
    step->fractions = ih_ellipsoid_fractions(semi_mm_q8);
    step->weighting.inverses = ih_inverses_of(&step->fractions);
    step->weighting.reach2_q22 = (uint32_t)(max_q14 * max_q14 >> 6);
    step->box = ih_ellipsoid_box(ellipsoid, table->slope_max_q20, ONE_Q14);
    for (int axis = 0; axis < 3; axis++) {
        step->reach_mm_q8[axis] = (int32_t)ih_mul_shift(max_q14, semi_mm_q8[axis], 14);
    }
    step->front_mm_q8 =
        ellipsoid->centre_mm_q8[2] - semi_mm_q8[2] - FRONT_MM_Q8 + step->see_through_mm * 256;
}

/* From low to high, both included. */
struct interval {
    int16_t low, high;
};

static int16_t saturate_s16(int64_t value)
{
    return (int16_t)(value > INT16_MAX ? INT16_MAX : value < INT16_MIN ? INT16_MIN : value);
}

static struct interval interval_of(int64_t low, int64_t high)
{
    return (struct interval){saturate_s16(low), saturate_s16(high)};
}

/* Slopes of the rays that pass through the box; all where the centre is too near to the origin's
 * depth. Slopes and directions are rounded down, which is a step on either side, and half by one. */
static struct interval slopes_within(const struct step *step, int axis)
{
    const int64_t depth_q8 = (int64_t)step->ellipsoid->centre_mm_q8[2] - step->origin_mm_q8[2];
    const int64_t off_q8 = (int64_t)step->ellipsoid->centre_mm_q8[axis] - step->origin_mm_q8[axis];
    if (depth_q8 < 256) {
        return interval_of(INT16_MIN, INT16_MAX);
    }
    const int64_t half_q8 = (int64_t)step->box.half_mm_q8[axis] + 1;
    return interval_of((off_q8 - half_q8) * 4096 / depth_q8 - 2,
                       (off_q8 + half_q8) * 4096 / depth_q8 + 2);
}

/* Intervals that select a ray, in the units of its table. */
struct bounds {
    struct interval point[3], slope[2];
    int16_t front; /* minimum depth of a point that pushes */
};

static void find_bounds(const struct step *step, struct bounds *out)
{
    for (int axis = 0; axis < 2; axis++) {
        out->slope[axis] = slopes_within(step, axis);
    }
    out->front = saturate_s16(step->front_mm_q8 >> 7);
    for (int axis = 0; axis < 3; axis++) {
        const int32_t centre_q8 = step->ellipsoid->centre_mm_q8[axis];
        const int32_t low = (centre_q8 - step->reach_mm_q8[axis]) >> 7;
        const int32_t high = (centre_q8 + step->reach_mm_q8[axis]) >> 7;
        out->point[axis] = /* without clamped points */
            (struct interval){(int16_t)ih_clamp_s32(low, -INT16_MAX, INT16_MAX),
                              (int16_t)ih_clamp_s32(high, INT16_MIN, INT16_MAX - 1)};
    }
}

#if IH_I16_LANES > 0
_Static_assert(IH_FIT_ROWS_MAX % IH_I16_LANES == 0, "rows fill whole vectors");

static inline ih_i16 is_outside(const int16_t *from, const struct interval *interval)
{
    const ih_i16 value = ih_i16_load(from);
    return (value < interval->low) | (value > interval->high);
}

static inline ih_i16 points_in_reach(const struct ih_ray_table *table, const struct bounds *bounds,
                                     int32_t slot)
{
    const ih_i16 is_away = is_outside(&table->point_mm_q1[0][slot], &bounds->point[0]) |
                           is_outside(&table->point_mm_q1[1][slot], &bounds->point[1]) |
                           is_outside(&table->point_mm_q1[2][slot], &bounds->point[2]);
    return ih_i16_load(&table->seen[slot]) & ~is_away;
}

static inline ih_i16 rays_in_box(const struct ih_ray_table *table, const struct bounds *bounds,
                                 int32_t slot)
{
    const ih_i16 is_away = is_outside(&table->slope_q12[0][slot], &bounds->slope[0]) |
                           is_outside(&table->slope_q12[1][slot], &bounds->slope[1]) |
                           (ih_i16_load(&table->point_mm_q1[2][slot]) < bounds->front);
    return ih_i16_load(&table->seen[slot]) & ~is_away;
}

static void select_rays(const struct ih_ray_table *table, const struct bounds *bounds,
                        struct ih_fit_scratch *scratch)
{
    for (int32_t word = 0; word < IH_RAYS_WORDS; word++) {
        uint32_t may_weigh = 0, may_push = 0;
        for (int32_t bit = 0; bit < 32; bit += 2 * IH_I16_LANES) {
            const int32_t slot = 32 * word + bit;
            const int32_t next = slot + IH_I16_LANES;
            may_weigh |= ih_i16_bits(points_in_reach(table, bounds, slot),
                                     points_in_reach(table, bounds, next))
                         << bit;
            may_push |=
                ih_i16_bits(rays_in_box(table, bounds, slot), rays_in_box(table, bounds, next))
                << bit;
        }
        scratch->may_weigh[word] = may_weigh;
        scratch->may_push[word] = may_push;
    }
}

static inline ih_i16 with_sign(ih_i16 size, ih_i16 sign)
{
    return ih_i16_sub(size ^ sign, sign);
}

/* Slopes by the centre along an axis. */
static inline void find_centre_slopes(struct ih_fit_rows *rows, int axis, int32_t k, ih_u16 weight)
{
    const int32_t next = k + IH_I32_LANES;
    const ih_i32 first = ih_i32_load(&rows->component_q14[axis][k]);
    const ih_i32 second = ih_i32_load(&rows->component_q14[axis][next]);
    const ih_u32 inverse = ih_u32_load(&rows->inverse[k]);
    const ih_u32 inverse_next = ih_u32_load(&rows->inverse[next]);
    const ih_i32 size = (ih_i32)ih_u32_mul_shift_round((ih_u32)ih_i32_abs(first), inverse, 17);
    const ih_i32 size_next =
        (ih_i32)ih_u32_mul_shift_round((ih_u32)ih_i32_abs(second), inverse_next, 17);
    const ih_i16 sign = ih_i32_low_halves(first >> 31, second >> 31);
    const ih_i16 slope = ih_i16_min(ih_i32_low_halves(size, size_next), ih_i16_all(CENTRE_MAX));
    const ih_i16 weighted = (ih_i16)ih_u16_mul_high((ih_u16)slope, weight);
    ih_i16_store(&rows->slope[axis][k], with_sign(slope, sign));
    ih_i16_store(&rows->weighted[axis][k], with_sign(weighted, sign));
}

/* Slopes by ln of a semi-axis: ln_inverse is a hundredth of the inverse. */
static inline ih_i32 ln_slopes(const int32_t *position_q14, ih_u32 ln_inverse)
{
    const ih_u32 size = (ih_u32)ih_i32_abs(ih_i32_load(position_q14));
    return (ih_i32)ih_u32_mul_shift_round(ih_u32_mul_shift_round(size, size, 14), ln_inverse, 18);
}

static void find_slopes(struct ih_fit_rows *rows, int32_t count)
{
    const ih_u32 hundredth_q16 = (ih_u32)ih_i32_all(LN_HUNDREDTH_Q16);
    for (int32_t k = 0; k < count; k += IH_I16_LANES) {
        const int32_t next = k + IH_I32_LANES;
        const ih_u16 weight = ih_u16_load(&rows->weight_q16[k]);
        const ih_u32 ln_inverse =
            ih_u32_mul_shift_round(ih_u32_load(&rows->inverse[k]), hundredth_q16, 16);
        const ih_u32 ln_inverse_next =
            ih_u32_mul_shift_round(ih_u32_load(&rows->inverse[next]), hundredth_q16, 16);
        for (int axis = 0; axis < 3; axis++) {
            find_centre_slopes(rows, axis, k, weight);
            const ih_i16 slope =
                ih_i32_low_halves(ln_slopes(&rows->position_q14[axis][k], ln_inverse),
                                  ln_slopes(&rows->position_q14[axis][next], ln_inverse_next));
            ih_i16_store(&rows->slope[3 + axis][k], slope);
            ih_i16_store(&rows->weighted[3 + axis][k],
                         (ih_i16)ih_u16_mul_high((ih_u16)slope, weight));
        }
    }
}

/* Sum of products of whole vectors of rows. A product is below 2^28 in size, as larger slopes lose
 * by the weight: a lane of 32 bits holds the sum of eight. */
static int64_t sum_products(const int16_t *a, const int16_t *b, int32_t count)
{
    int64_t sum = 0;
    for (int32_t first = 0; first < count; first += 4 * IH_I16_LANES) {
        const int32_t end = ih_min_s32(first + 4 * IH_I16_LANES, count);
        struct ih_pair_sums pairs =
            ih_pair_sums_first(ih_i16_load(&a[first]), ih_i16_load(&b[first]));
        for (int32_t k = first + IH_I16_LANES; k < end; k += IH_I16_LANES) {
            pairs = ih_pair_sums_add(pairs, ih_i16_load(&a[k]), ih_i16_load(&b[k]));
        }
        sum += ih_i32_total_wide(ih_pair_sums_total(pairs));
    }
    return sum;
}

#define ROWS_STEP IH_I16_LANES
#else
static bool is_within(int16_t value, const struct interval *interval)
{
    return value >= interval->low && value <= interval->high;
}

/* Without vectors one comparison rejects most rays. */
static void select_rays(const struct ih_ray_table *table, const struct bounds *bounds,
                        struct ih_fit_scratch *scratch)
{
    const struct interval *point = bounds->point, *slope = bounds->slope;
    memset(scratch->may_weigh, 0, sizeof scratch->may_weigh);
    memset(scratch->may_push, 0, sizeof scratch->may_push);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (table->seen[slot] == 0) {
            continue;
        }
        const int16_t z = table->point_mm_q1[2][slot];
        const uint32_t bit = 1U << slot % 32;
        if (is_within(table->point_mm_q1[0][slot], &point[0]) &&
            is_within(table->point_mm_q1[1][slot], &point[1]) && is_within(z, &point[2])) {
            scratch->may_weigh[slot / 32] |= bit;
        }
        if (is_within(table->slope_q12[0][slot], &slope[0]) &&
            is_within(table->slope_q12[1][slot], &slope[1]) && z >= bounds->front) {
            scratch->may_push[slot / 32] |= bit;
        }
    }
}

/* Products of sizes, so that opposite rows stay opposite. */
static void set_slope(struct ih_fit_rows *rows, int unknown, int32_t k, int32_t size, int32_t sign)
{
    const int32_t weighted = (int32_t)((uint32_t)size * rows->weight_q16[k] >> 16);
    rows->slope[unknown][k] = (int16_t)(sign * size);
    rows->weighted[unknown][k] = (int16_t)(sign * weighted);
}

static void find_slopes(struct ih_fit_rows *rows, int32_t count)
{
    for (int32_t k = 0; k < count; k++) {
        const uint32_t inverse = rows->inverse[k];
        const uint32_t ln_inverse = ih_product_shift(inverse, LN_HUNDREDTH_Q16, 16);
        for (int axis = 0; axis < 3; axis++) {
            const int32_t component = rows->component_q14[axis][k];
            const uint32_t size = (uint32_t)ih_abs_s32(component);
            const uint32_t position = (uint32_t)ih_abs_s32(rows->position_q14[axis][k]);
            const int32_t slope = (int32_t)ih_product_shift(size, inverse, 17);
            const uint32_t square = ih_product_shift(position, position, 14);
            const int32_t ln_slope = (int32_t)ih_product_shift(square, ln_inverse, 18);
            IH_IN_RANGE(ln_slope, 0, IH_RANGE_SLOPE_Q13);
            set_slope(rows, axis, k, ih_min_s32(slope, CENTRE_MAX), component < 0 ? -1 : 1);
            set_slope(rows, 3 + axis, k, ln_slope, 1);
        }
    }
}

static int64_t sum_products(const int16_t *a, const int16_t *b, int32_t count)
{
    int64_t sum = 0;
    for (int32_t k = 0; k < count; k += 4) {
        sum += a[k] * b[k];
        sum += a[k + 1] * b[k + 1];
        sum += a[k + 2] * b[k + 2];
        sum += a[k + 3] * b[k + 3];
    }
    return sum;
}

#define ROWS_STEP 4
#endif

/* A row of zeros adds nothing. */
static void clear_row(struct ih_fit_rows *rows, int32_t at)
{
    for (int axis = 0; axis < 3; axis++) {
        rows->position_q14[axis][at] = 0;
        rows->component_q14[axis][at] = 0;
    }
    rows->inverse[at] = 0;
    rows->weight_q16[at] = 0;
    rows->residual_mm_q10[at] = 0;
}

/* The sums keep the products' bits until all rows are in them. */
static void flush_rows(struct ih_fit_rows *rows, struct ih_fit_equations *equations)
{
    int32_t count = rows->count;
    while (count % ROWS_STEP != 0) {
        clear_row(rows, count++);
    }
    find_slopes(rows, count);
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        for (int j = 0; j <= i; j++) {
            equations->normal_q16[IH_CHOLESKY_PACKED(i) + j] +=
                sum_products(rows->weighted[i], rows->slope[j], count);
        }
        equations->right_q16[i] += sum_products(rows->residual_mm_q10, rows->slope[i], count);
    }
    rows->count = 0;
}

static int slope_bits(int unknown)
{
    return unknown < 3 ? CENTRE_BITS : LN_BITS;
}

static void scale_equations(struct ih_fit_equations *equations)
{
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        for (int j = 0; j <= i; j++) {
            int64_t *entry = &equations->normal_q16[IH_CHOLESKY_PACKED(i) + j];
            *entry = ih_shift_round(*entry, slope_bits(i) + slope_bits(j) - 16);
        }
        equations->right_q16[i] =
            ih_shift_round(equations->right_q16[i], slope_bits(i) + RESIDUAL_BITS - 16);
    }
}

/* Rows of all points that may have a weight. */
static void add_points(const struct step *step, const struct ih_rays *rays,
                       struct ih_fit_scratch *scratch, struct ih_fit_equations *equations)
{
    struct ih_fit_rows *rows = &scratch->rows;
    const int32_t *centre_mm_q8 = step->ellipsoid->centre_mm_q8;
    for (int32_t word = 0; word < IH_RAYS_WORDS; word++) {
        for (uint32_t left = scratch->may_weigh[word]; left != 0; left &= left - 1) {
            const int32_t *point_mm_q8 = rays->ray[32 * word + __builtin_ctz(left)].point_mm_q8;
            const int32_t at = rows->count++;
            rows->position_q14[0][at] = point_mm_q8[0] - centre_mm_q8[0];
            rows->position_q14[1][at] = point_mm_q8[1] - centre_mm_q8[1];
            rows->position_q14[2][at] = point_mm_q8[2] - centre_mm_q8[2];
            if (rows->count == IH_FIT_ROWS_MAX) {
                ih_fit_weigh_rows(&step->weighting, rows);
                flush_rows(rows, equations);
            }
        }
    }
    ih_fit_weigh_rows(&step->weighting, rows);
}

static void add_row(struct ih_fit_rows *rows, struct ih_fit_equations *equations,
                    const struct ih_distance *distance, const int32_t position_q14[3],
                    const int32_t component_q14[3])
{
    const int32_t at = rows->count++;
    for (int axis = 0; axis < 3; axis++) {
        rows->position_q14[axis][at] = position_q14[axis];
        rows->component_q14[axis][at] = component_q14[axis];
    }
    rows->inverse[at] = distance->inverse;
    rows->weight_q16[at] = PUSH_WEIGHT_Q16;
    rows->residual_mm_q10[at] =
        ih_fit_weighted_residual_q10(PUSH_WEIGHT_Q16, distance->residual_mm_q8);
    if (rows->count == IH_FIT_ROWS_MAX) {
        flush_rows(rows, equations);
    }
}

/* A row for a point behind the ellipsoid, seen through it. */
static void add_push(const struct step *step, const struct ih_ray *ray, struct ih_fit_rows *rows,
                     struct ih_fit_equations *equations)
{
    const struct ih_ellipsoid *ellipsoid = step->ellipsoid;
    struct ih_crossing crossing;
    const struct ih_aim aim = ih_ellipsoid_aim(ellipsoid->semi_mm_q8, &step->fractions, ray);
    if (!ih_ellipsoid_cross(ellipsoid, &step->fractions, step->origin_mm_q8, ray, &aim,
                            &crossing) ||
        crossing.radius2_q14 >= ONE_Q14 ||
        ray->point_mm_q8[2] - step->see_through_mm * 256 <= crossing.entry_mm_q8) {
        return;
    }
    const int32_t *nearest_q14 = crossing.nearest_q14;
    int32_t component_q14[3];
    struct ih_distance distance;
    if (ih_ellipsoid_gradient(&step->weighting.inverses, nearest_q14, component_q14, &distance)) {
        distance.residual_mm_q8 = ih_max_s32(distance.residual_mm_q8, -PUSH_MAX_MM_Q8);
        add_row(rows, equations, &distance, nearest_q14, component_q14);
    }
}

static void add_pushes(const struct step *step, const struct ih_rays *rays,
                       struct ih_fit_scratch *scratch, struct ih_fit_equations *equations)
{
    for (int32_t word = 0; word < IH_RAYS_WORDS; word++) {
        for (uint32_t left = scratch->may_push[word]; left != 0; left &= left - 1) {
            const struct ih_ray *ray = &rays->ray[32 * word + __builtin_ctz(left)];
            add_push(step, ray, &scratch->rows, equations);
        }
    }
}

void ih_fit_equations_collect(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                              int32_t scale_mm, int32_t see_through_mm,
                              struct ih_fit_scratch *scratch, struct ih_fit_equations *out)
{
    struct step step = {.ellipsoid = ellipsoid,
                        .origin_mm_q8 = rays->origin_mm_q8,
                        .weighting = {.scale_mm = scale_mm},
                        .see_through_mm = see_through_mm};
    struct bounds bounds;
    begin_step(&step, &rays->table);
    find_bounds(&step, &bounds);
    select_rays(&rays->table, &bounds, scratch);
    memset(out, 0, sizeof *out);
    scratch->rows.count = 0;
    add_points(&step, rays, scratch, out);
    add_pushes(&step, rays, scratch, out);
    flush_rows(&scratch->rows, out);
    scale_equations(out);
}
