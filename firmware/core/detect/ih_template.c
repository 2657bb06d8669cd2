#include "detect/ih_template.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "simd/ih_lane16.h"

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
#define RING_INNER2_Q10 1731 /* 1.3^2 */
#define RING_OUTER2_Q10 3697 /* 1.9^2 */
#define SEMI_X_MM 78
#define SEMI_Y_MM 113
#define SEMI_Z_MM 98
#define X_OVER_Y_Q14 11309
#define Z_OVER_X_Q14 20585
#define Z_OVER_Y_Q14 14209
/* Places are cut at this, 2.75. */
#define CUT_Q11 5632
/* Semi-axes as shares of CUT_Q11, rounded up: the ring's outer rim and a head's, a little larger; and
 * how far down a ray can pass that is in the ring and not more down than aside, in mm. */
#define RING_Q12 2875    /* 1.93 */
#define THROUGH_Q12 1520 /* 1.02 */
#define BELOW_Q12 1639   /* 1.1; it is 1.08 */
/* Depths against the centre's are cut at 2 semi-axes: Q1 mm. */
#define DEPTH_CUT_Q1 (2 * 2 * SEMI_Z_MM)
/* 64ths of a Q1 mm as a share of the semi-axis, Q12, of 2^16. */
#define DEPTH_Q16 21400
#define BEHIND_CENTRE_MM 60
#define ON_SURFACE_MM 32
/* Millimetres as a share of the semi-axis. */
#define TOUCH_Q13 ((ON_SURFACE_MM * 8192 + SEMI_Z_MM / 2) / SEMI_Z_MM)
#define ONE_Q14 (1 << 14)
#define DEPTH_MIN_MM 227
#define DEPTH_MAX_MM 16100
/* Where rays without a point have one: before all heads, by more than is cut. */
#define NOWHERE_Q1 (-400)

/* Ranges are checked without vectors; and where there are none, rays are looked at one by one. */
#if defined IH_TEMPLATE_ONE_BY_ONE || defined ISOHEAD_RANGE_CHECKS
#define LANES 1
#elif defined __AVX2__
#include <immintrin.h>
#define LANES 16
typedef __m256i lanes;
#define LOAD(from) _mm256_loadu_si256((const lanes *)(const void *)(from))
#define ALL(value) _mm256_set1_epi16(value)
#define SUM(a, b) _mm256_add_epi16(a, b)
#define REST(a, b) _mm256_sub_epi16(a, b)
#define UP(a, bits) _mm256_slli_epi16(a, bits)
#define PRODUCT(a, b) _mm256_mullo_epi16(a, b)
#define HIGH_PRODUCT(a, b) _mm256_mulhi_epi16(a, b)
#define MIN(a, b) _mm256_min_epi16(a, b)
#define MAX(a, b) _mm256_max_epi16(a, b)
#define ABOVE(a, b) _mm256_cmpgt_epi16(a, b)
#define BOTH(a, b) _mm256_and_si256(a, b)
#define WITHOUT(a, b) _mm256_andnot_si256(b, a)
#define FOLD(a) _mm_add_epi16(_mm256_castsi256_si128(a), _mm256_extracti128_si256(a, 1))
#elif defined __SSE2__
#include <immintrin.h>
#define LANES 8
typedef __m128i lanes;
#define LOAD(from) _mm_loadu_si128((const lanes *)(const void *)(from))
#define ALL(value) _mm_set1_epi16(value)
#define SUM(a, b) _mm_add_epi16(a, b)
#define REST(a, b) _mm_sub_epi16(a, b)
#define UP(a, bits) _mm_slli_epi16(a, bits)
#define PRODUCT(a, b) _mm_mullo_epi16(a, b)
#define HIGH_PRODUCT(a, b) _mm_mulhi_epi16(a, b)
#define MIN(a, b) _mm_min_epi16(a, b)
#define MAX(a, b) _mm_max_epi16(a, b)
#define ABOVE(a, b) _mm_cmpgt_epi16(a, b)
#define BOTH(a, b) _mm_and_si128(a, b)
#define WITHOUT(a, b) _mm_andnot_si128(b, a)
#define FOLD(a) (a)
#elif defined __ARM_NEON
#include <arm_neon.h>
#define LANES 8
typedef int16x8_t lanes;
#define LOAD(from) vld1q_s16(from)
#define STORE(to, value) vst1q_s16(to, value)
#define ALL(value) vdupq_n_s16(value)
#define SUM(a, b) vaddq_s16(a, b)
#define REST(a, b) vsubq_s16(a, b)
#define UP(a, bits) vshlq_n_s16(a, bits)
#define PRODUCT(a, b) vmulq_s16(a, b)
/* Half of the upper half of the doubled product; none is the square of the least. */
#define HIGH_PRODUCT(a, b) vshrq_n_s16(vqdmulhq_s16(a, b), 1)
#define MIN(a, b) vminq_s16(a, b)
#define MAX(a, b) vmaxq_s16(a, b)
#define ABOVE(a, b) vreinterpretq_s16_u16(vcgtq_s16(a, b))
#define BOTH(a, b) vandq_s16(a, b)
#define WITHOUT(a, b) vbicq_s16(a, b)
#else
#define LANES 1
#endif

static int16_t saturate_s16(int32_t value)
{
    return (int16_t)ih_clamp_s32(value, INT16_MIN, INT16_MAX);
}

static void fill_ray(const struct ih_ray *ray, struct ih_template_rays *out, int32_t at)
{
    const bool is_seen = ray->state == IH_RAY_SEEN;
    const bool is_empty = ray->state == IH_RAY_EMPTY;
    const int32_t x_q14 = ray->slope_x_q20 >> 6;
    const int32_t y_q14 = ray->slope_y_q20 >> 6;
    /* slopes below 2^16.1 times 2^14.4; cut, so that squares fit */
    const int32_t gx_q15 = ih_clamp_s32(x_q14 * Z_OVER_X_Q14 >> 13, -(1 << 15), 1 << 15);
    const int32_t gy_q15 = ih_clamp_s32(y_q14 * Z_OVER_Y_Q14 >> 13, -(1 << 15), 1 << 15);
    const uint32_t gg_q30 = (uint32_t)(gx_q15 * gx_q15) + (uint32_t)(gy_q15 * gy_q15);
    if (gg_q30 >= 1U << 30) { /* too steep for 16 bits: it passes no head */
        out->slope_q14[0][at] = x_q14 < 0 ? INT16_MIN : INT16_MAX;
        out->slope_q14[1][at] = y_q14 < 0 ? INT16_MIN : INT16_MAX;
        return;
    }
    out->slope_q14[0][at] = (int16_t)x_q14;
    out->slope_q14[1][at] = (int16_t)y_q14;
    out->g_q15[0][at] = (int16_t)gx_q15;
    out->g_q15[1][at] = (int16_t)gy_q15;
    out->inverse_q15[at] = saturate_s16((int32_t)((1U << 30) / ((1U << 15) + (gg_q30 >> 15))));
    out->depth_mm_q1[at] = saturate_s16(is_seen ? ray->point_mm_q8[2] >> 7 : NOWHERE_Q1);
    out->inside[at] = (int16_t)(is_empty ? VALUE_EMPTY : VALUE_NEARER);
    out->around[at] = (int16_t)(is_seen ? AROUND_NEAR : is_empty ? AROUND_EMPTY : 0);
}

/* The greatest slope up to a line, and the least from it on. */
static void set_lines(struct ih_template_rays *out)
{
    for (int32_t line = 0; line < IH_TEMPLATE_COLUMN; line++) {
        for (int axis = 0; axis < 2; axis++) {
            out->max_q14[axis][line] = line < IH_GRID ? INT16_MIN : INT16_MAX;
            out->min_q14[axis][line] = line < IH_GRID ? INT16_MAX : INT16_MIN;
        }
    }
    for (int32_t column = 0; column < IH_GRID; column++) {
        const int16_t *x_q14 = &out->slope_q14[0][column * IH_TEMPLATE_COLUMN];
        const int16_t *y_q14 = &out->slope_q14[1][column * IH_TEMPLATE_COLUMN];
        int16_t max_q14 = INT16_MIN, min_q14 = INT16_MAX;
        for (int32_t row = 0; row < IH_GRID; row++) {
            max_q14 = ih_lane_max(max_q14, x_q14[row]);
            min_q14 = ih_lane_min(min_q14, x_q14[row]);
            out->max_q14[1][row] = ih_lane_max(out->max_q14[1][row], y_q14[row]);
            out->min_q14[1][row] = ih_lane_min(out->min_q14[1][row], y_q14[row]);
        }
        out->max_q14[0][column] = max_q14;
        out->min_q14[0][column] = min_q14;
    }
    for (int axis = 0; axis < 2; axis++) {
        int16_t *max_q14 = out->max_q14[axis];
        int16_t *min_q14 = out->min_q14[axis];
        for (int32_t line = 1; line < IH_GRID; line++) {
            const int32_t back = IH_GRID - 1 - line;
            max_q14[line] = ih_lane_max(max_q14[line], max_q14[line - 1]);
            min_q14[back] = ih_lane_min(min_q14[back], min_q14[back + 1]);
        }
    }
}

/* What may count is not farther aside, above, below: see ih_template.h. */
static void set_reach(struct ih_template_rays *out)
{
    int32_t steep_q15[2] = {0, 0};
    for (int axis = 0; axis < 2; axis++) {
        for (int32_t at = 0; at < IH_TEMPLATE_RAYS; at++) {
            steep_q15[axis] = ih_max_s32(steep_q15[axis], ih_abs_s32(out->g_q15[axis][at]));
        }
    }
    /* sqrt(1 + g2) is below 1 + g2 / 2 */
    const int32_t wide_q14 = ONE_Q14 + (steep_q15[0] * steep_q15[0] >> 17) + 1;
    const int32_t high_q14 = ONE_Q14 + (steep_q15[1] * steep_q15[1] >> 17) + 1;
    out->aside_q12 = RING_Q12 * wide_q14 >> 14;
    out->above_q12 = RING_Q12 * high_q14 >> 14;
    out->below_q12 = BELOW_Q12 * (wide_q14 + high_q14 - ONE_Q14) >> 14;
    out->through_q12 = THROUGH_Q12 * wide_q14 >> 14;
}

void ih_template_prepare(const struct ih_rays *space, struct ih_template_rays *out)
{
    memset(out, 0, sizeof *out);
    for (int32_t column = 0; column < IH_GRID; column++) {
        for (int32_t row = 0; row < IH_TEMPLATE_COLUMN; row++) {
            const int32_t at = column * IH_TEMPLATE_COLUMN + row;
            if (row < IH_GRID) {
                fill_ray(&space->ray[row * IH_GRID + column], out, at);
            } else { /* behind a column: it passes no head */
                out->slope_q14[0][at] = INT16_MAX;
                out->slope_q14[1][at] = INT16_MAX;
            }
        }
    }
    set_lines(out);
    set_reach(out);
}

/* A centre, as the loop needs it: e = (slope - direction) times share, in Q11. */
struct place {
    int16_t direction_q14[2];
    int16_t cut[2];   /* differences are cut at this */
    int16_t times[2]; /* a power of two */
    int16_t share[2]; /* 2^14 .. 2^15 */
    int16_t depth_mm_q1, open_mm_q1;
};

/* False: out of the limits. */
static bool set_axis(struct place *place, int axis, int64_t off_q8, int32_t depth_q8,
                     int32_t semi_mm)
{
    const int64_t direction_q14 = (off_q8 * ONE_Q14 - (off_q8 < 0 ? depth_q8 - 1 : 0)) / depth_q8;
    const int32_t share = depth_q8 * 32 / semi_mm; /* the depth over the semi-axis, Q13 */
    const int shift = ih_max_s32(17 - __builtin_clz((uint32_t)share), 0);
    place->times[axis] = (int16_t)(1 << shift);
    place->share[axis] = (int16_t)(share >> shift);
    place->cut[axis] = (int16_t)((CUT_Q11 << 16) / (place->share[axis] << shift));
    if (direction_q14 <= -ONE_Q14 || direction_q14 >= ONE_Q14) {
        return false;
    }
    place->direction_q14[axis] = (int16_t)direction_q14;
    return true;
}

static bool set_place(struct place *place, const struct ih_rays *space,
                      const int32_t centre_mm_q8[3])
{
    const int64_t depth_q8 = (int64_t)centre_mm_q8[2] - space->origin_mm_q8[2];
    if (depth_q8 < DEPTH_MIN_MM << 8 || depth_q8 > DEPTH_MAX_MM << 8 || centre_mm_q8[2] < 0 ||
        centre_mm_q8[2] > DEPTH_MAX_MM << 8) {
        return false;
    }
    place->depth_mm_q1 = (int16_t)(centre_mm_q8[2] >> 7);
    place->open_mm_q1 = (int16_t)(place->depth_mm_q1 + 2 * BEHIND_CENTRE_MM);
    return set_axis(place, 0, (int64_t)centre_mm_q8[0] - space->origin_mm_q8[0], (int32_t)depth_q8,
                    SEMI_X_MM) &&
           set_axis(place, 1, (int64_t)centre_mm_q8[1] - space->origin_mm_q8[1], (int32_t)depth_q8,
                    SEMI_Y_MM);
}

/* Columns, or rows, from one to before another. */
struct span {
    int32_t begin, end;
};

#if LANES > 1 && defined __SSE2__
static inline __m128i all_saturated(int32_t value)
{
    const __m128i words = _mm_set1_epi32(value);
    return _mm_packs_epi32(words, words);
}

/* A bit for each line in which a is above b. */
static inline uint32_t lines_above(const __m128i a[3], const __m128i b[3])
{
    const __m128i few = _mm_packs_epi16(_mm_cmpgt_epi16(a[0], b[0]), _mm_cmpgt_epi16(a[1], b[1]));
    const __m128i rest = _mm_packs_epi16(_mm_cmpgt_epi16(a[2], b[2]), _mm_setzero_si128());
    return (uint32_t)_mm_movemask_epi8(few) | (uint32_t)_mm_movemask_epi8(rest) << 16;
}

static inline void load_lines(const int16_t *slope_q14, __m128i out[3])
{
    for (int i = 0; i < 3; i++) {
        out[i] = _mm_loadu_si128((const __m128i *)(const void *)&slope_q14[8 * i]);
    }
}

/* The lines that may have a ray between two slopes, and those between them. */
static inline struct span find_span(const struct ih_template_rays *rays, int axis, int32_t low_q14,
                                    int32_t high_q14)
{
    const __m128i low = all_saturated(low_q14);
    const __m128i high = all_saturated(high_q14);
    __m128i max[3], min[3];
    load_lines(rays->max_q14[axis], max);
    load_lines(rays->min_q14[axis], min);
    const uint32_t before = lines_above((const __m128i[3]){low, low, low}, max);
    const uint32_t after = lines_above(min, (const __m128i[3]){high, high, high});
    struct span span;
    span.begin = __builtin_ctz(~before);
    span.end = ih_max_s32(__builtin_ctz(after | 1U << IH_GRID), span.begin);
    return span;
}
#else
static struct span find_span(const struct ih_template_rays *rays, int axis, int32_t low_q14,
                             int32_t high_q14)
{
    struct span span = {0, IH_GRID};
    while (span.begin < IH_GRID && rays->max_q14[axis][span.begin] < low_q14) {
        span.begin++;
    }
    while (span.end > span.begin && rays->min_q14[axis][span.end - 1] > high_q14) {
        span.end--;
    }
    return span;
}
#endif

/* Where rays are that may count: those through the head are in some of the columns only. Rows are whole
 * vectors, which end behind a column's last ray at most. */
struct box {
    struct span columns, rows;
#if LANES > 1
    struct span through;
#endif
};

static struct box find_box(const struct ih_template_rays *rays, const struct place *place)
{
    /* 3 for what is rounded off a share, off the slopes and the direction */
    const int32_t x_q14 = place->direction_q14[0];
    const int32_t y_q14 = place->direction_q14[1];
    const int32_t aside_q14 = (place->cut[0] * rays->aside_q12 >> 12) + 3;
    const int32_t above_q14 = (place->cut[1] * rays->above_q12 >> 12) + 3;
    const int32_t below_q14 = (place->cut[1] * rays->below_q12 >> 12) + 3;
    struct box box = {
        .columns = find_span(rays, 0, x_q14 - aside_q14, x_q14 + aside_q14),
        .rows = find_span(rays, 1, y_q14 - above_q14, y_q14 + below_q14),
    };
#if LANES > 1
    const int32_t through_q14 = (place->cut[0] * rays->through_q12 >> 12) + 3;
    const uint32_t rows = (uint32_t)(box.rows.end - box.rows.begin);
    const int32_t count = (int32_t)((rows + LANES - 1) / LANES * LANES);
    box.through = find_span(rays, 0, x_q14 - through_q14, x_q14 + through_q14);
    box.rows.begin = ih_min_s32(box.rows.begin, IH_TEMPLATE_COLUMN - count);
    box.rows.end = box.rows.begin + count;
#endif
    return box;
}

/* Values, in 64ths, and how many rays they are of. */
struct weighed {
    int32_t inside, inside_count;
    int32_t around, around_count;
};

#if LANES > 1

#if LANES == 16
#define SAME(v)                                                                        \
    {                                                                                  \
        (v), (v), (v), (v), (v), (v), (v), (v), (v), (v), (v), (v), (v), (v), (v), (v) \
    }
#else
#define SAME(v)                                \
    {                                          \
        (v), (v), (v), (v), (v), (v), (v), (v) \
    }
#endif
/* What does not change, whole vectors: compilers make them anew for each turn otherwise. */
static const int16_t fixed[][LANES] = {
    SAME(ONE_Q10),
    SAME(RING_INNER2_Q10),
    SAME(RING_OUTER2_Q10),
    SAME(X_OVER_Y_Q14),
    SAME(DEPTH_Q16),
    SAME(DEPTH_CUT_Q1),
    SAME(-DEPTH_CUT_Q1),
    SAME(TOUCH_Q13),
    SAME(-TOUCH_Q13),
    SAME(VALUE_ON - VALUE_NEARER),
    SAME(VALUE_BEHIND - VALUE_ON),
    SAME(AROUND_OPEN - AROUND_NEAR),
};
enum {
    ONE,
    INNER,
    OUTER,
    X_OVER_Y,
    DEPTH,
    CUT,
    MINUS_CUT,
    TOUCH,
    MINUS_TOUCH,
    ON_OVER_NEARER,
    BEHIND_OVER_ON,
    OPEN_OVER_NEAR
};
#define FIXED(name) LOAD(fixed[name])

/* A lane for each ray. */
struct sums {
    lanes inside, inside_count;
    lanes around, around_count;
};

/* How a ray passes. */
struct pass {
    lanes ex_q13, ey_q11; /* at the centre's depth */
    lanes t_q12, radius2_q10;
};

static inline lanes within(lanes value, int16_t max)
{
    return MAX(MIN(value, ALL(max)), ALL((int16_t)-max));
}

static inline struct pass find_pass(const struct ih_template_rays *rays, const struct place *place,
                                    int32_t at)
{
    struct pass pass;
    const lanes dx =
        within(REST(LOAD(&rays->slope_q14[0][at]), ALL(place->direction_q14[0])), place->cut[0]);
    const lanes dy =
        within(REST(LOAD(&rays->slope_q14[1][at]), ALL(place->direction_q14[1])), place->cut[1]);
    pass.ey_q11 = HIGH_PRODUCT(PRODUCT(dy, ALL(place->times[1])), ALL(place->share[1]));
    pass.ex_q13 = UP(HIGH_PRODUCT(PRODUCT(dx, ALL(place->times[0])), ALL(place->share[0])), 2);
    const lanes ey_q13 = UP(pass.ey_q11, 2);
    const lanes ee_q10 = SUM(HIGH_PRODUCT(pass.ex_q13, pass.ex_q13), HIGH_PRODUCT(ey_q13, ey_q13));
    const lanes eg_q13 = UP(SUM(HIGH_PRODUCT(pass.ex_q13, LOAD(&rays->g_q15[0][at])),
                                HIGH_PRODUCT(ey_q13, LOAD(&rays->g_q15[1][at]))),
                            1);
    pass.t_q12 = HIGH_PRODUCT(eg_q13, LOAD(&rays->inverse_q15[at]));
    pass.radius2_q10 = REST(ee_q10, HIGH_PRODUCT(eg_q13, UP(pass.t_q12, 1)));
    return pass;
}

/* Rays beside or above the head. */
static inline void add_around(const struct ih_template_rays *rays, const struct place *place,
                              int32_t at, const struct pass *pass, struct sums *sums)
{
    const lanes is_open = ABOVE(LOAD(&rays->depth_mm_q1[at]), ALL(place->open_mm_q1));
    const lanes value = SUM(LOAD(&rays->around[at]), BOTH(is_open, FIXED(OPEN_OVER_NEAR)));
    const lanes size_q13 = MAX(pass->ex_q13, REST(ALL(0), pass->ex_q13));
    const lanes below = ABOVE(pass->ey_q11, HIGH_PRODUCT(size_q13, FIXED(X_OVER_Y)));
    const lanes is_in = WITHOUT(
        BOTH(ABOVE(pass->radius2_q10, FIXED(INNER)), ABOVE(FIXED(OUTER), pass->radius2_q10)),
        below);
    sums->around = SUM(sums->around, BOTH(value, is_in));
    sums->around_count = REST(sums->around_count, is_in);
}

/* Is a point less far behind the entry than this? */
static inline lanes is_before(lanes after_q13, lanes root2_q10, lanes behind_q13)
{
    const lanes root_q13 = MAX(REST(behind_q13, after_q13), ALL(0));
    return ABOVE(HIGH_PRODUCT(root_q13, root_q13), root2_q10);
}

/* Rays through it: how far a point is behind the entry says what it is worth. */
static inline void add_inside(const struct ih_template_rays *rays, const struct place *place,
                              int32_t at, const struct pass *pass, struct sums *sums)
{
    const lanes dz_q1 =
        MAX(MIN(REST(LOAD(&rays->depth_mm_q1[at]), ALL(place->depth_mm_q1)), FIXED(CUT)),
            FIXED(MINUS_CUT));
    const lanes dz_q12 = HIGH_PRODUCT(UP(dz_q1, 6), FIXED(DEPTH));
    const lanes after_q13 = UP(SUM(dz_q12, pass->t_q12), 1);
    const lanes rest_q10 = REST(FIXED(ONE), pass->radius2_q10);
    const lanes root2_q10 = HIGH_PRODUCT(UP(rest_q10, 1), LOAD(&rays->inverse_q15[at]));
    const lanes nearer = is_before(after_q13, root2_q10, FIXED(MINUS_TOUCH));
    const lanes before = is_before(after_q13, root2_q10, FIXED(TOUCH));
    const lanes more =
        SUM(WITHOUT(FIXED(ON_OVER_NEARER), nearer), WITHOUT(FIXED(BEHIND_OVER_ON), before));
    const lanes value = SUM(LOAD(&rays->inside[at]), more);
    const lanes is_in = ABOVE(rest_q10, ALL(0));
    sums->inside = SUM(sums->inside, BOTH(value, is_in));
    sums->inside_count = REST(sums->inside_count, is_in);
}

/* Sums of all lanes; each fits 16 bits. */
#ifdef __SSE2__
static inline void total(const struct sums *sums, struct weighed *out)
{
    const __m128i ones = _mm_set1_epi16(1);
    const __m128i inside = _mm_madd_epi16(FOLD(sums->inside), ones);
    const __m128i inside_count = _mm_madd_epi16(FOLD(sums->inside_count), ones);
    const __m128i around = _mm_madd_epi16(FOLD(sums->around), ones);
    const __m128i around_count = _mm_madd_epi16(FOLD(sums->around_count), ones);
    const __m128i first = _mm_add_epi32(_mm_unpacklo_epi32(inside, inside_count),
                                        _mm_unpackhi_epi32(inside, inside_count));
    const __m128i second = _mm_add_epi32(_mm_unpacklo_epi32(around, around_count),
                                         _mm_unpackhi_epi32(around, around_count));
    int32_t all[4];
    _mm_storeu_si128((__m128i *)(void *)all, _mm_add_epi32(_mm_unpacklo_epi64(first, second),
                                                           _mm_unpackhi_epi64(first, second)));
    *out = (struct weighed){all[0], all[1], all[2], all[3]};
}
#else
static int32_t total_of(lanes sums)
{
    int16_t lane[LANES];
    int32_t sum = 0;
    STORE(lane, sums);
    for (int32_t k = 0; k < LANES; k++) {
        sum += lane[k];
    }
    return sum;
}

static void total(const struct sums *sums, struct weighed *out)
{
    *out = (struct weighed){total_of(sums->inside), total_of(sums->inside_count),
                            total_of(sums->around), total_of(sums->around_count)};
}
#endif

static void sum_up(const struct ih_template_rays *rays, const struct place *place,
                   const struct box *box, struct weighed *out)
{
    const struct span beside[2] = {{box->columns.begin, box->through.begin},
                                   {box->through.end, box->columns.end}};
    struct sums sums = {ALL(0), ALL(0), ALL(0), ALL(0)};
    for (int32_t row = box->rows.begin; row < box->rows.end; row += LANES) {
        for (int side = 0; side < 2; side++) {
            for (int32_t column = beside[side].begin; column < beside[side].end; column++) {
                const int32_t at = column * IH_TEMPLATE_COLUMN + row;
                const struct pass pass = find_pass(rays, place, at);
                add_around(rays, place, at, &pass, &sums);
            }
        }
        for (int32_t column = box->through.begin; column < box->through.end; column++) {
            const int32_t at = column * IH_TEMPLATE_COLUMN + row;
            const struct pass pass = find_pass(rays, place, at);
            add_around(rays, place, at, &pass, &sums);
            add_inside(rays, place, at, &pass, &sums);
        }
    }
    total(&sums, out);
}

#else

static bool is_before(int32_t after_q13, int32_t root2_q10, int32_t behind_q13)
{
    const int32_t root_q13 = ih_max_s32(behind_q13 - after_q13, 0);
    return root_q13 * root_q13 >> 16 > root2_q10;
}

static int32_t value_inside(const struct ih_template_rays *rays, const struct place *place,
                            int32_t at, int32_t t_q12, int32_t radius2_q10)
{
    const int32_t dz_q1 =
        ih_clamp_s32(rays->depth_mm_q1[at] - place->depth_mm_q1, -DEPTH_CUT_Q1, DEPTH_CUT_Q1);
    const int32_t after_q13 = 2 * ((dz_q1 * 64 * DEPTH_Q16 >> 16) + t_q12);
    const int32_t root2_q10 = 2 * (ONE_Q10 - radius2_q10) * rays->inverse_q15[at] >> 16;
    if (is_before(after_q13, root2_q10, -TOUCH_Q13)) {
        return rays->inside[at];
    }
    return is_before(after_q13, root2_q10, TOUCH_Q13) ? VALUE_ON : VALUE_BEHIND;
}

static void sum_up(const struct ih_template_rays *rays, const struct place *place,
                   const struct box *box, struct weighed *out)
{
    const int32_t scale[2] = {place->times[0] * place->share[0], place->times[1] * place->share[1]};
    const int32_t min_q14[2] = {place->direction_q14[0] - place->cut[0],
                                place->direction_q14[1] - place->cut[1]};
    const uint32_t sides_q14[2] = {2 * (uint32_t)place->cut[0], 2 * (uint32_t)place->cut[1]};
    struct weighed sums = {0, 0, 0, 0};
    for (int32_t column = box->columns.begin; column < box->columns.end; column++) {
        for (int32_t row = box->rows.begin; row < box->rows.end; row++) {
            const int32_t at = column * IH_TEMPLATE_COLUMN + row;
            const int32_t x_q14 = rays->slope_q14[0][at] - min_q14[0];
            const int32_t y_q14 = rays->slope_q14[1][at] - min_q14[1];
            if (IH_WRAPS(uint32_t, x_q14) > sides_q14[0] ||
                IH_WRAPS(uint32_t, y_q14) > sides_q14[1]) {
                continue;
            }
            const int32_t ex_q11 = (x_q14 - place->cut[0]) * scale[0] >> 16;
            const int32_t ey_q11 = (y_q14 - place->cut[1]) * scale[1] >> 16;
            const int32_t eg_q12 =
                (ex_q11 * rays->g_q15[0][at] >> 14) + (ey_q11 * rays->g_q15[1][at] >> 14);
            const int32_t t_q12 = eg_q12 * rays->inverse_q15[at] >> 15;
            const int32_t radius2_q10 =
                (ex_q11 * ex_q11 >> 12) + (ey_q11 * ey_q11 >> 12) - (eg_q12 * t_q12 >> 14);
            if (radius2_q10 < ONE_Q10) {
                sums.inside += value_inside(rays, place, at, t_q12, radius2_q10);
                sums.inside_count++;
            } else if (radius2_q10 > RING_INNER2_Q10 && radius2_q10 < RING_OUTER2_Q10 &&
                       ey_q11 <= ih_abs_s32(ex_q11) * X_OVER_Y_Q14 >> 14) {
                sums.around +=
                    rays->depth_mm_q1[at] > place->open_mm_q1 ? AROUND_OPEN : rays->around[at];
                sums.around_count++;
            }
        }
    }
    *out = sums;
}

#endif

int32_t ih_template_score_q12(const struct ih_rays *space, const struct ih_template_rays *rays,
                              const int32_t centre_mm_q8[3])
{
    struct place place;
    struct weighed weighed;
    if (!set_place(&place, space, centre_mm_q8)) {
        return IH_TEMPLATE_NONE_Q12;
    }
    const struct box box = find_box(rays, &place);
    sum_up(rays, &place, &box, &weighed);
    /* 0.6 times 64 is 192 / 5 */
    const int32_t rating_q12 =
        weighed.inside * 64 / ih_max_s32(weighed.inside_count, RAYS_MIN) +
        weighed.around * 192 / (5 * ih_max_s32(weighed.around_count, RAYS_MIN));
    IH_IN_RANGE(rating_q12, IH_RANGE_RATING_MIN_Q12, IH_RANGE_RATING_MAX_Q12);
    return rating_q12;
}
