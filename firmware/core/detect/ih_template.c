#include "detect/ih_template.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "detect/ih_head_model.h"
#include "simd/ih_simd.h"

/* Values in 64ths, see ih_scan.h. */
#define VALUE_ON 64
#define VALUE_NEARER (-10) /* and of what is not known */
#define VALUE_BEHIND (-64)
#define VALUE_EMPTY (-38)
#define AROUND_OPEN 64
#define AROUND_EMPTY 45
#define AROUND_NEAR (-38)
#define RAYS_MIN 8

#define ONE_Q10 1024
#define RING_INNER2_Q10 ((int16_t)IH_HEAD_SQUARE(IH_HEAD_RING_INNER_PERCENT, 10))
#define RING_OUTER2_Q10 ((int16_t)IH_HEAD_SQUARE(IH_HEAD_RING_OUTER_PERCENT, 10))
/* Ratio of two semi-axes, rounded. */
#define RATIO_Q14(a, b) ((((a) << 14) + (b) / 2) / (b))
#define X_OVER_Y_Q14 RATIO_Q14(IH_HEAD_SEMI_X_MM, IH_HEAD_SEMI_Y_MM)
#define Z_OVER_X_Q14 RATIO_Q14(IH_HEAD_SEMI_Z_MM, IH_HEAD_SEMI_X_MM)
#define Z_OVER_Y_Q14 RATIO_Q14(IH_HEAD_SEMI_Z_MM, IH_HEAD_SEMI_Y_MM)
/* Offsets are limited to 3.4 semi-axes. */
#define OFFSET_MAX_Q11 6963
/* Fractions of OFFSET_MAX_Q11, rounded up: the ring's outer rim; a head's rim; and how far down a ray
 * of the ring can pass that is not more down than aside, in mm. */
#define RING_Q12 2326    /* 1.93 */
#define THROUGH_Q12 1229 /* 1.02 */
#define BELOW_Q12 1326   /* 1.1; it is 1.08 */
/* Depths against the centre's are limited to 1.55 semi-axes, Q1 mm, so that with t they fit 16 bits. What is 32 mm behind, or before,
 * a head's surface is within 1.33: no answer changes. */
#define DEPTH_OFF_MAX_Q1 (2 * 155 * IH_HEAD_SEMI_Z_MM / 100)
/* 64ths of a Q1 mm as a fraction of the semi-axis, Q12, of 2^16. */
#define DEPTH_Q16 (((1 << 21) + IH_HEAD_SEMI_Z_MM / 2) / IH_HEAD_SEMI_Z_MM)
#define ON_SURFACE_MM 32
/* The same as a fraction of the semi-axis. */
#define TOUCH_Q13 ((ON_SURFACE_MM * 8192 + IH_HEAD_SEMI_Z_MM / 2) / IH_HEAD_SEMI_Z_MM)
#define ONE_Q13 (1 << 13)
#define ONE_Q14 (1 << 14)
#define DEPTH_MIN_MM 227
#define DEPTH_MAX_MM 16100
/* Depth of rays without a point: before all heads, by more than the limit of depths. */
#define NOWHERE_Q1 (-400)

/* set_axis shifts a depth over the longer semi-axis by 0 or more. */
_Static_assert((DEPTH_MIN_MM << 14) / IH_HEAD_SEMI_Y_MM >= 1 << 14,
               "a factor has 15 bits at DEPTH_MIN_MM");

static void fill_ray(const struct ih_ray *ray, struct ih_template_table *out, int32_t at)
{
    const bool is_seen = ray->state == IH_RAY_SEEN;
    const bool is_empty = ray->state == IH_RAY_EMPTY;
    const int32_t x_q13 = ray->slope_x_q20 >> 7;
    const int32_t y_q13 = ray->slope_y_q20 >> 7;
    /* slopes of 2^15 at most times 2^14.4; cut, so that squares fit */
    const int16_t gx_q14 = ih_saturate_s16(x_q13 * Z_OVER_X_Q14 >> 13);
    const int16_t gy_q14 = ih_saturate_s16(y_q13 * Z_OVER_Y_Q14 >> 13);
    const uint32_t gg_q28 = (uint32_t)(gx_q14 * gx_q14) + (uint32_t)(gy_q14 * gy_q14);
    if (gg_q28 >= 1U << 29) { /* too steep for 16 bits: it passes no head */
        out->slope_q13[0][at] = x_q13 < 0 ? INT16_MIN : INT16_MAX;
        out->slope_q13[1][at] = y_q13 < 0 ? INT16_MIN : INT16_MAX;
        return;
    }
    out->slope_q13[0][at] = (int16_t)x_q13;
    out->slope_q13[1][at] = (int16_t)y_q13;
    out->g_q14[0][at] = gx_q14;
    out->g_q14[1][at] = gy_q14;
    out->inverse_q15[at] = ih_saturate_s16((int32_t)((1U << 30) / ((1U << 15) + (gg_q28 >> 13))));
    out->depth_mm_q1[at] = ih_saturate_s16(is_seen ? ray->point_mm_q8[2] >> 7 : NOWHERE_Q1);
    out->inside[at] = (int16_t)(is_empty ? VALUE_EMPTY : VALUE_NEARER);
    out->around[at] = (int16_t)(is_seen ? AROUND_NEAR : is_empty ? AROUND_EMPTY : 0);
}

static int16_t max_s16(int16_t a, int16_t b)
{
    return (int16_t)(a > b ? a : b);
}

static int16_t min_s16(int16_t a, int16_t b)
{
    return (int16_t)(a < b ? a : b);
}

/* The maximum slope up to a line, and the minimum from it on. */
static void set_lines(struct ih_template_table *out)
{
    for (int32_t line = 0; line < IH_TEMPLATE_COLUMN; line++) {
        for (int axis = 0; axis < 2; axis++) {
            out->max_q13[axis][line] = line < IH_GRID ? INT16_MIN : INT16_MAX;
            out->min_q13[axis][line] = line < IH_GRID ? INT16_MAX : INT16_MIN;
        }
    }
    for (int32_t column = 0; column < IH_GRID; column++) {
        const int16_t *x_q13 = &out->slope_q13[0][column * IH_TEMPLATE_COLUMN];
        const int16_t *y_q13 = &out->slope_q13[1][column * IH_TEMPLATE_COLUMN];
        int16_t max_q13 = INT16_MIN, min_q13 = INT16_MAX;
        for (int32_t row = 0; row < IH_GRID; row++) {
            max_q13 = max_s16(max_q13, x_q13[row]);
            min_q13 = min_s16(min_q13, x_q13[row]);
            out->max_q13[1][row] = max_s16(out->max_q13[1][row], y_q13[row]);
            out->min_q13[1][row] = min_s16(out->min_q13[1][row], y_q13[row]);
        }
        out->max_q13[0][column] = max_q13;
        out->min_q13[0][column] = min_q13;
    }
    for (int axis = 0; axis < 2; axis++) {
        int16_t *max_q13 = out->max_q13[axis];
        int16_t *min_q13 = out->min_q13[axis];
        for (int32_t line = 1; line < IH_GRID; line++) {
            const int32_t back = IH_GRID - 1 - line;
            max_q13[line] = max_s16(max_q13[line], max_q13[line - 1]);
            min_q13[back] = min_s16(min_q13[back], min_q13[back + 1]);
        }
    }
}

/* Half sides of the box that holds every ray that contributes, see ih_template.h. */
static void set_reach(struct ih_template_table *out)
{
    int32_t g_max_q14[2] = {0, 0};
    for (int axis = 0; axis < 2; axis++) {
        for (int32_t at = 0; at < IH_TEMPLATE_CELLS; at++) {
            g_max_q14[axis] = ih_max_s32(g_max_q14[axis], ih_abs_s32(out->g_q14[axis][at]));
        }
    }
    /* sqrt(1 + g2) is below 1 + g2 / 2 */
    const int32_t wide_q14 = ONE_Q14 + (g_max_q14[0] * g_max_q14[0] >> 15) + 1;
    const int32_t high_q14 = ONE_Q14 + (g_max_q14[1] * g_max_q14[1] >> 15) + 1;
    out->aside_q12 = RING_Q12 * wide_q14 >> 14;
    out->above_q12 = RING_Q12 * high_q14 >> 14;
    out->below_q12 = BELOW_Q12 * (wide_q14 + high_q14 - ONE_Q14) >> 14;
    out->through_q12 = THROUGH_Q12 * wide_q14 >> 14;
}

void ih_template_prepare(const struct ih_rays *rays, struct ih_template_table *out)
{
    memset(out, 0, sizeof *out);
    for (int32_t column = 0; column < IH_GRID; column++) {
        for (int32_t row = 0; row < IH_TEMPLATE_COLUMN; row++) {
            const int32_t at = column * IH_TEMPLATE_COLUMN + row;
            if (row < IH_GRID) {
                fill_ray(&rays->ray[row * IH_GRID + column], out, at);
            } else { /* behind a column: it passes no head */
                out->slope_q13[0][at] = INT16_MAX;
            }
        }
    }
    set_lines(out);
    set_reach(out);
}

/* A centre as the loop needs it: in Q11, e = (slope - direction) power factor / 2^16. */
struct centre {
    int16_t direction_q13[2];
    int16_t offset_max[2]; /* of slopes, Q13 */
    int16_t power[2];      /* of two */
    int16_t factor[2];     /* 2^14 .. 2^15 */
    int16_t depth_mm_q1, open_mm_q1;
};

/* False outside of the limits. */
static bool set_axis(struct centre *candidate, int axis, int64_t off_q8, int32_t depth_q8,
                     int32_t semi_mm)
{
    const int64_t direction_q13 = (off_q8 * ONE_Q13 - (off_q8 < 0 ? depth_q8 - 1 : 0)) / depth_q8;
    const int32_t ratio_q14 = depth_q8 * 64 / semi_mm;
    const int shift = 17 - __builtin_clz((uint32_t)ratio_q14);
    candidate->power[axis] = (int16_t)(1 << shift);
    candidate->factor[axis] = (int16_t)(ratio_q14 >> shift);
    candidate->offset_max[axis] =
        (int16_t)((OFFSET_MAX_Q11 << 16) / (candidate->factor[axis] << shift));
    if (direction_q13 <= -2 * ONE_Q13 || direction_q13 >= 2 * ONE_Q13) {
        return false;
    }
    candidate->direction_q13[axis] = (int16_t)direction_q13;
    return true;
}

static bool set_candidate(struct centre *candidate, const struct ih_rays *rays,
                          const int32_t centre_mm_q8[3])
{
    const int64_t depth_q8 = (int64_t)centre_mm_q8[2] - rays->origin_mm_q8[2];
    if (depth_q8 < DEPTH_MIN_MM << 8 || depth_q8 > DEPTH_MAX_MM << 8 || centre_mm_q8[2] < 0 ||
        centre_mm_q8[2] > DEPTH_MAX_MM << 8) {
        return false;
    }
    candidate->depth_mm_q1 = (int16_t)(centre_mm_q8[2] >> 7);
    candidate->open_mm_q1 = (int16_t)(candidate->depth_mm_q1 + 2 * IH_HEAD_OPEN_MM);
    return set_axis(candidate, 0, (int64_t)centre_mm_q8[0] - rays->origin_mm_q8[0],
                    (int32_t)depth_q8, IH_HEAD_SEMI_X_MM) &&
           set_axis(candidate, 1, (int64_t)centre_mm_q8[1] - rays->origin_mm_q8[1],
                    (int32_t)depth_q8, IH_HEAD_SEMI_Y_MM);
}

/* Columns, or rows, from one to before another. */
struct span {
    int32_t begin, end;
};

#if IH_I16_LANES > 0
/* A bit for each line below a limit. */
static inline uint32_t lines_below(const int16_t *slope_q13, int16_t limit_q13)
{
    uint32_t bits = 0;
    for (int32_t line = 0; line < IH_TEMPLATE_COLUMN; line += 2 * IH_I16_LANES) {
        const ih_i16 first = ih_i16_load(&slope_q13[line]) < limit_q13;
        const ih_i16 second = ih_i16_load(&slope_q13[line + IH_I16_LANES]) < limit_q13;
        bits |= ih_i16_bits(first, second) << line;
    }
    return bits;
}

/* The lines that may have a ray between two slopes, and those between them. */
static inline struct span find_span(const struct ih_template_table *table, int axis,
                                    int32_t low_q13, int32_t high_q13)
{
    const int32_t before =
        __builtin_ctz(~lines_below(table->max_q13[axis], ih_saturate_s16(low_q13)));
    const uint32_t inside = lines_below(table->min_q13[axis], ih_saturate_s16(high_q13 + 1));
    const int32_t end = __builtin_ctz(~inside | 1U << IH_GRID);
    return (struct span){before, ih_max_s32(end, before)};
}
#else
static struct span find_span(const struct ih_template_table *table, int axis, int32_t low_q13,
                             int32_t high_q13)
{
    struct span span = {0, IH_GRID};
    while (span.begin < IH_GRID && table->max_q13[axis][span.begin] < low_q13) {
        span.begin++;
    }
    while (span.end > span.begin && table->min_q13[axis][span.end - 1] > high_q13) {
        span.end--;
    }
    return span;
}
#endif

/* Where rays are that may contribute. */
struct box {
    struct span columns, rows;
};

/* Columns of the rays that pass within this fraction of OFFSET_MAX_Q11 aside. */
static struct span find_columns(const struct ih_template_table *table,
                                const struct centre *candidate, int32_t aside_q12)
{
    /* 3 for the rounding of the factor, of slopes and of the direction */
    const int32_t x_q13 = candidate->direction_q13[0];
    const int32_t aside_q13 = (candidate->offset_max[0] * aside_q12 >> 12) + 3;
    return find_span(table, 0, x_q13 - aside_q13, x_q13 + aside_q13);
}

static struct box find_box(const struct ih_template_table *table, const struct centre *candidate)
{
    const int32_t y_q13 = candidate->direction_q13[1];
    const int32_t above_q13 = (candidate->offset_max[1] * table->above_q12 >> 12) + 3;
    const int32_t below_q13 = (candidate->offset_max[1] * table->below_q12 >> 12) + 3;
    return (struct box){
        .columns = find_columns(table, candidate, table->aside_q12),
        .rows = find_span(table, 1, y_q13 - above_q13, y_q13 + below_q13),
    };
}

/* Sums of values in 64ths, and counts of their rays. */
struct ray_totals {
    int32_t inside, inside_count;
    int32_t around, around_count;
};

#if IH_I16_LANES > 0
/* A lane for each ray. */
struct sums {
    ih_i16 inside, inside_count;
    ih_i16 around, around_count;
};

/* A ray at the centre's depth (ex, ey), and its nearest point: t, radius2 of ih_template.h. */
struct crossing {
    ih_i16 ex_q13, ey_q11, t_q12, radius2_q10;
};

static inline ih_i16 find_offset(const struct ih_template_table *table,
                                 const struct centre *candidate, int axis, int32_t at)
{
    const ih_i16 off = ih_i16_sub(ih_i16_load(&table->slope_q13[axis][at]),
                                  ih_i16_all(candidate->direction_q13[axis]));
    return ih_i16_mul_high(ih_i16_mul(ih_i16_clamp(off, candidate->offset_max[axis]),
                                      ih_i16_all(candidate->power[axis])),
                           ih_i16_all(candidate->factor[axis]));
}

static inline struct crossing find_crossing(const struct ih_template_table *table,
                                            const struct centre *candidate, int32_t at)
{
    const ih_i16 ex_q13 = ih_i16_shift_left(find_offset(table, candidate, 0, at), 2);
    const ih_i16 ey_q11 = find_offset(table, candidate, 1, at);
    const ih_i16 ey_q13 = ih_i16_shift_left(ey_q11, 2);
    const ih_i16 ee_q10 =
        ih_i16_add(ih_i16_mul_high(ex_q13, ex_q13), ih_i16_mul_high(ey_q13, ey_q13));
    const ih_i16 eg_q11 = ih_i16_add(ih_i16_mul_high(ex_q13, ih_i16_load(&table->g_q14[0][at])),
                                     ih_i16_mul_high(ey_q13, ih_i16_load(&table->g_q14[1][at])));
    const ih_i16 eg_q12 = ih_i16_shift_left(eg_q11, 1);
    const ih_i16 t_q11 = ih_i16_mul_high(eg_q12, ih_i16_load(&table->inverse_q15[at]));
    const ih_i16 t_q12 = ih_i16_shift_left(t_q11, 1);
    const ih_i16 product_q9 = ih_i16_mul_high(eg_q12, ih_i16_shift_left(t_q11, 2));
    const ih_i16 product_q10 = ih_i16_shift_left(product_q9, 1);
    return (struct crossing){ex_q13, ey_q11, t_q12, ih_i16_sub(ee_q10, product_q10)};
}

/* Rays beside or above the head. */
static inline void add_around(const struct ih_template_table *table, const struct centre *candidate,
                              int32_t at, const struct crossing *crossing, struct sums *sums)
{
    const ih_i16 is_open = ih_i16_load(&table->depth_mm_q1[at]) > candidate->open_mm_q1;
    const ih_i16 value =
        ih_i16_add(ih_i16_load(&table->around[at]), is_open & (AROUND_OPEN - AROUND_NEAR));
    const ih_i16 size_q13 = ih_i16_abs(crossing->ex_q13);
    const ih_i16 is_below = crossing->ey_q11 > ih_i16_mul_high(size_q13, ih_i16_all(X_OVER_Y_Q14));
    const ih_i16 is_in = (crossing->radius2_q10 > RING_INNER2_Q10) &
                         (crossing->radius2_q10 < RING_OUTER2_Q10) & ~is_below;
    sums->around = ih_i16_add(sums->around, value & is_in);
    sums->around_count = ih_i16_sub(sums->around_count, is_in);
}

/* Lanes of points that are nearer than this behind the entry. */
static inline ih_i16 is_before(ih_i16 after_q13, ih_i16 root2_q10, int16_t behind_q13)
{
    const ih_i16 root_q13 =
        ih_i16_max(ih_i16_sub(ih_i16_all(behind_q13), after_q13), ih_i16_all(0));
    return ih_i16_mul_high(root_q13, root_q13) > root2_q10;
}

/* Rays through the head: the value follows from how far a point is behind the entry. */
static inline void add_inside(const struct ih_template_table *table, const struct centre *candidate,
                              int32_t at, const struct crossing *crossing, struct sums *sums)
{
    const ih_i16 dz_q1 = ih_i16_clamp(
        ih_i16_sub(ih_i16_load(&table->depth_mm_q1[at]), ih_i16_all(candidate->depth_mm_q1)),
        DEPTH_OFF_MAX_Q1);
    const ih_i16 dz_q12 = ih_i16_mul_high(ih_i16_shift_left(dz_q1, 6), ih_i16_all(DEPTH_Q16));
    const ih_i16 after_q13 = ih_i16_shift_left(ih_i16_add(dz_q12, crossing->t_q12), 1);
    const ih_i16 inside_q10 = ih_i16_sub(ih_i16_all(ONE_Q10), crossing->radius2_q10);
    const ih_i16 root2_q10 =
        ih_i16_mul_high(ih_i16_shift_left(inside_q10, 1), ih_i16_load(&table->inverse_q15[at]));
    const ih_i16 is_nearer = is_before(after_q13, root2_q10, -TOUCH_Q13);
    const ih_i16 is_on = is_before(after_q13, root2_q10, TOUCH_Q13);
    const ih_i16 value = ih_i16_add(
        ih_i16_load(&table->inside[at]),
        ih_i16_add(~is_nearer & (VALUE_ON - VALUE_NEARER), ~is_on & (VALUE_BEHIND - VALUE_ON)));
    const ih_i16 is_in = inside_q10 > 0;
    sums->inside = ih_i16_add(sums->inside, value & is_in);
    sums->inside_count = ih_i16_sub(sums->inside_count, is_in);
}

/* The rows in whole vectors, which may end behind a column's last ray. */
static struct span whole_vectors(struct span rows)
{
    const uint32_t count = (uint32_t)(rows.end - rows.begin);
    const int32_t whole = (int32_t)((count + IH_I16_LANES - 1) / IH_I16_LANES * IH_I16_LANES);
    const int32_t begin = ih_min_s32(rows.begin, IH_TEMPLATE_COLUMN - whole);
    return (struct span){begin, begin + whole};
}

/* Columns beside the head have no ray through it. */
static void sum_values(const struct ih_template_table *table, const struct centre *candidate,
                       const struct box *box, struct ray_totals *out)
{
    const struct span through = find_columns(table, candidate, table->through_q12);
    const struct span beside[2] = {{box->columns.begin, through.begin},
                                   {through.end, box->columns.end}};
    const struct span rows = whole_vectors(box->rows);
    struct sums sums = {ih_i16_all(0), ih_i16_all(0), ih_i16_all(0), ih_i16_all(0)};
    for (int32_t row = rows.begin; row < rows.end; row += IH_I16_LANES) {
        for (int side = 0; side < 2; side++) {
            for (int32_t column = beside[side].begin; column < beside[side].end; column++) {
                const int32_t at = column * IH_TEMPLATE_COLUMN + row;
                const struct crossing crossing = find_crossing(table, candidate, at);
                add_around(table, candidate, at, &crossing, &sums);
            }
        }
        for (int32_t column = through.begin; column < through.end; column++) {
            const int32_t at = column * IH_TEMPLATE_COLUMN + row;
            const struct crossing crossing = find_crossing(table, candidate, at);
            add_around(table, candidate, at, &crossing, &sums);
            add_inside(table, candidate, at, &crossing, &sums);
        }
    }
    *out = (struct ray_totals){ih_i16_total(sums.inside), ih_i16_total(sums.inside_count),
                               ih_i16_total(sums.around), ih_i16_total(sums.around_count)};
}

#else

static bool is_before(int32_t after_q13, int32_t root2_q10, int32_t behind_q13)
{
    const int32_t root_q13 = ih_max_s32(behind_q13 - after_q13, 0);
    return root_q13 * root_q13 >> 16 > root2_q10;
}

static int32_t value_inside(const struct ih_template_table *table, const struct centre *candidate,
                            int32_t at, int32_t t_q12, int32_t radius2_q10)
{
    const int32_t dz_q1 = ih_clamp_s32(table->depth_mm_q1[at] - candidate->depth_mm_q1,
                                       -DEPTH_OFF_MAX_Q1, DEPTH_OFF_MAX_Q1);
    const int32_t after_q13 = 2 * ((dz_q1 * 64 * DEPTH_Q16 >> 16) + t_q12);
    const int32_t root2_q10 = 2 * (ONE_Q10 - radius2_q10) * table->inverse_q15[at] >> 16;
    if (is_before(after_q13, root2_q10, -TOUCH_Q13)) {
        return table->inside[at];
    }
    return is_before(after_q13, root2_q10, TOUCH_Q13) ? VALUE_ON : VALUE_BEHIND;
}

static void sum_values(const struct ih_template_table *table, const struct centre *candidate,
                       const struct box *box, struct ray_totals *out)
{
    const int32_t scale[2] = {candidate->power[0] * candidate->factor[0],
                              candidate->power[1] * candidate->factor[1]};
    const int32_t reach_q13[2] = {(candidate->offset_max[0] * table->aside_q12 >> 12) + 3,
                                  (candidate->offset_max[1] * table->above_q12 >> 12) + 3};
    const int32_t min_q13[2] = {candidate->direction_q13[0] - reach_q13[0],
                                candidate->direction_q13[1] - reach_q13[1]};
    const uint32_t sides_q13[2] = {2 * (uint32_t)reach_q13[0], 2 * (uint32_t)reach_q13[1]};
    struct ray_totals sums = {0, 0, 0, 0};
    for (int32_t column = box->columns.begin; column < box->columns.end; column++) {
        for (int32_t row = box->rows.begin; row < box->rows.end; row++) {
            const int32_t at = column * IH_TEMPLATE_COLUMN + row;
            const int32_t x_q13 = table->slope_q13[0][at] - min_q13[0];
            const int32_t y_q13 = table->slope_q13[1][at] - min_q13[1];
            if (IH_WRAPS(uint32_t, x_q13) > sides_q13[0] ||
                IH_WRAPS(uint32_t, y_q13) > sides_q13[1]) {
                continue;
            }
            const int32_t ex_q11 = (x_q13 - reach_q13[0]) * scale[0] >> 16;
            const int32_t ey_q11 = (y_q13 - reach_q13[1]) * scale[1] >> 16;
            const int32_t eg_q11 =
                (ex_q11 * table->g_q14[0][at] >> 14) + (ey_q11 * table->g_q14[1][at] >> 14);
            const int32_t t_q11 = eg_q11 * table->inverse_q15[at] >> 15;
            const int32_t t_q12 = 2 * t_q11;
            const int32_t radius2_q10 =
                (ex_q11 * ex_q11 >> 12) + (ey_q11 * ey_q11 >> 12) - 2 * (eg_q11 * t_q11 >> 13);
            if (radius2_q10 < ONE_Q10) {
                sums.inside += value_inside(table, candidate, at, t_q12, radius2_q10);
                sums.inside_count++;
            } else if (radius2_q10 > RING_INNER2_Q10 && radius2_q10 < RING_OUTER2_Q10 &&
                       ey_q11 <= ih_abs_s32(ex_q11) * X_OVER_Y_Q14 >> 14) {
                sums.around += table->depth_mm_q1[at] > candidate->open_mm_q1 ? AROUND_OPEN
                                                                              : table->around[at];
                sums.around_count++;
            }
        }
    }
    *out = sums;
}

#endif

int32_t ih_template_score_q12(const struct ih_rays *rays, const struct ih_template_table *table,
                              const int32_t centre_mm_q8[3])
{
    struct centre candidate;
    struct ray_totals totals;
    if (!set_candidate(&candidate, rays, centre_mm_q8)) {
        return IH_TEMPLATE_NONE_Q12;
    }
    const struct box box = find_box(table, &candidate);
    sum_values(table, &candidate, &box, &totals);
    /* 0.6 times 64 is 192 / 5 */
    const int32_t score_q12 = totals.inside * 64 / ih_max_s32(totals.inside_count, RAYS_MIN) +
                              totals.around * 192 / (5 * ih_max_s32(totals.around_count, RAYS_MIN));
    IH_IN_RANGE(score_q12, IH_RANGE_TEMPLATE_SCORE_MIN_Q12, IH_RANGE_TEMPLATE_SCORE_MAX_Q12);
    return score_q12;
}
