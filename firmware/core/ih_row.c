#include "ih_row.h"

#include <string.h>

#include "ih_fix.h"

/* Compilers do not find the multiplication of lower halves by themselves, see ih_normal. Ranges are checked
 * without vectors. */
#if defined __x86_64__ && defined __SSE2__
#ifndef ISOHEAD_RANGE_CHECKS
#define BY_VECTORS
#include <immintrin.h>
#endif
#endif

#define ONE_Q14 (1 << 14)
#define ONE_Q16 (1 << 16)
/* Points farther than this many robust scales weigh less than 1/4000 and are passed over. */
#define ROBUST_REACH 8
/* Places nearer to the centre than this have no direction. */
#define RADIUS_LEAST_Q14 819 /* 0.05 */
#define LOW_FROM_Q14 8192    /* 0.5 */
#define LOW_SPAN_Q14 4915    /* 0.3 */
#define LOW_LOSS_Q16 32768   /* 0.5 */
#define PUSH_MAX_MM_Q8 (30 << 8)
#define PUSH_WEIGHT_Q16 32768 /* 0.5 */
/* An entry may be off by this, see ih_ellipsoid. */
#define FRONT_MM_Q8 256
/* Lengths inside a gradient are in units of this, so that it is of order one. 64 mm in Q8 are 2^14:
 * s / a is an ih_share of s, too. */
#define GRADIENT_MM 64
#define FLAG_POINT 1
#define FLAG_PUSH 2
/* Added to slopes and residuals, and to weighted slopes: then none is negative. Of a product these are whole
 * numbers after its shift by 14 or 8 bits, which can be taken away from the sum. */
#define LIFT_BITS 16
#define LIFT (1 << LIFT_BITS)
#define LIFT_WEIGHTED (1 << 18)

static int16_t saturate_s16(int64_t value)
{
    return (int16_t)(value > INT16_MAX ? INT16_MAX : value < INT16_MIN ? INT16_MIN : value);
}

void ih_row_prepare(const struct ih_space *space, struct ih_row_rays *out)
{
    memset(out, 0, sizeof *out);
    ih_space_slope_most(space, out->slope_most_q20);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_ray *ray = &space->ray[slot];
        for (int axis = 0; axis < 3; axis++) {
            out->point_mm_q1[axis][slot] = saturate_s16(ray->point_mm_q8[axis] >> 7);
        }
        out->slope_q12[0][slot] = (int16_t)(ray->slope_x_q20 >> 8);
        out->slope_q12[1][slot] = (int16_t)(ray->slope_y_q20 >> 8);
        out->seen[slot] = ray->state == IH_RAY_SEEN;
        if (ray->state == IH_RAY_EMPTY) {
            out->point_mm_q1[2][slot] = IH_ROW_NOWHERE;
        }
        if (ray->state == IH_RAY_UNKNOWN) {
            out->slope_q12[0][slot] = IH_ROW_NOWHERE;
        }
    }
    for (int32_t slot = IH_SLOTS; slot < IH_ROW_RAYS; slot++) {
        out->slope_q12[0][slot] = IH_ROW_NOWHERE;
    }
}

/* The gradient's direction and length at a place. */
struct gradient {
    int32_t radius_q14;
    int32_t component_q14[3]; /* s / a, per GRADIENT_MM */
    int32_t length_q14;
};

/* False: it has no direction. */
static bool find_gradient(const int32_t component_q14[3], uint64_t radius2_q28,
                          struct gradient *out)
{
    uint64_t length2_q28 = 0;
    for (int axis = 0; axis < 3; axis++) {
        const int64_t component = component_q14[axis];
        out->component_q14[axis] = component_q14[axis];
        length2_q28 += (uint64_t)(component * component);
    }
    out->radius_q14 = (int32_t)ih_isqrt_u54(radius2_q28);
    out->length_q14 = (int32_t)ih_isqrt_u54(length2_q28);
    return out->radius_q14 >= RADIUS_LEAST_Q14;
}

static uint64_t square_q28(const int32_t place_q14[3])
{
    uint64_t sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        sum += (uint64_t)((int64_t)place_q14[axis] * place_q14[axis]);
    }
    return sum;
}

/* (f - 1) f */
static int64_t over_q14(const struct gradient *g)
{
    return ih_mul_shift(g->radius_q14, (int64_t)g->radius_q14 - ONE_Q14, 14);
}

bool ih_row_distance(const struct ih_ellipsoid *ellipsoid, const int32_t place_q14[3],
                     int32_t *distance_mm_q8)
{
    struct gradient g;
    int32_t component_q14[3];
    for (int axis = 0; axis < 3; axis++) {
        component_q14[axis] = (int32_t)ih_div_round((int64_t)place_q14[axis] * (GRADIENT_MM << 8),
                                                    ellipsoid->semi_mm_q8[axis]);
    }
    if (!find_gradient(component_q14, square_q28(place_q14), &g)) {
        return false;
    }
    /* (f - 1) / |grad f|, grad f = (s / a) / f. */
    *distance_mm_q8 =
        ih_saturate_s32(ih_div_round(over_q14(&g) * (GRADIENT_MM << 8), g.length_q14));
    return true;
}

#ifdef BY_VECTORS
#define ALWAYS_INLINE inline __attribute__((always_inline))
#if defined __AVX2__
#define LANES 4
typedef __m256i lanes;
#define LOAD(from) _mm256_loadu_si256((const lanes *)(const void *)(from))
#define STORE(to, value) _mm256_storeu_si256((lanes *)(void *)(to), value)
#define ALL(value) _mm256_set1_epi64x((long long)(value))
#define PRODUCT(a, b) _mm256_mul_epu32(a, b)
#define SUM(a, b) _mm256_add_epi64(a, b)
#define SHIFT(a, bits) _mm256_srli_epi64(a, bits)
#define SHIFT_UP(a, bits) _mm256_slli_epi64(a, bits)
#define REST(a, b) _mm256_sub_epi64(a, b)
#define FLIP(a, b) _mm256_xor_si256(a, b)
/* All bits where it is negative, if 32 bits hold it: both halves are the upper one. */
#define SIGN(a) _mm256_shuffle_epi32(a, 0xf5)
#else
#define LANES 2
typedef __m128i lanes;
#define LOAD(from) _mm_loadu_si128((const lanes *)(const void *)(from))
#define STORE(to, value) _mm_storeu_si128((lanes *)(void *)(to), value)
#define ALL(value) _mm_set1_epi64x((long long)(value))
#define PRODUCT(a, b) _mm_mul_epu32(a, b)
#define SUM(a, b) _mm_add_epi64(a, b)
#define SHIFT(a, bits) _mm_srli_epi64(a, bits)
#define SHIFT_UP(a, bits) _mm_slli_epi64(a, bits)
#define REST(a, b) _mm_sub_epi64(a, b)
#define FLIP(a, b) _mm_xor_si128(a, b)
#define SIGN(a) _mm_shuffle_epi32(a, 0xf5)
#endif
_Static_assert(IH_ROW_MAX % LANES == 0, "rows fill whole vectors");

/* Quotients by a gradient's length L, 151 and more: 25 L once, and products that are rounded as
 * ih_div_round does. With v, too great by less than 1, instead of 2^62 / (25 L), a quotient n / d is
 * too great by n' v / 2^k - n / d < n' / 2^k (n' and k as below); it must stay below 1 / (2 d), what it
 * is away from a half at least if not on it. For f up to 5.8, the most that has a weight, L < 2^17.3 and
 * squares of places s^2 < 2^19.1. */
struct inverse {
    int64_t by_25_q62; /* 2^62 / (25 L) */
    int64_t whole_q58; /* 2^58 / L */
};

static struct inverse invert(int32_t length_q14)
{
    struct inverse inverse;
    inverse.by_25_q62 = (int64_t)(((uint64_t)1 << 62) / ((uint32_t)length_q14 * 25U)) + 1;
    inverse.whole_q58 = (inverse.by_25_q62 * 25 >> 4) + 1;
    return inverse;
}

/* ih_div_round(over * 2^14, L), |over| < 2^19.4 and 15 L: off by 2.6 |over| / 2^44 < 1 / (2 L). */
static int32_t by_length_q8(const struct inverse *inverse, int64_t over)
{
    return (int32_t)((over * inverse->whole_q58 + ((int64_t)1 << 43)) >> 44);
}

/* A gradient's residual; of its length what find_slopes divides by. */
static int32_t find_residual(const struct gradient *g, ih_row_entry *length)
{
    const struct inverse inverse = invert(g->length_q14);
    *length = (uint64_t)inverse.by_25_q62;
    return by_length_q8(&inverse, over_q14(g));
}

/* (a * b + 2^(bits - 1)) / 2^bits of an a below 2^32, all below 2^64. */
static inline lanes product_shift(lanes a, lanes b, int bits)
{
    const lanes high = SHIFT_UP(PRODUCT(a, SHIFT(b, 32)), 32);
    return SHIFT(SUM(SUM(PRODUCT(a, b), high), ALL((int64_t)1 << (bits - 1))), bits);
}

/* The lifted slope of unknown i in whole vectors, and what its weighted one is. */
static inline void set_slope(struct ih_rows *rows, int32_t k, int i, lanes slope, lanes weight,
                             lanes lift_q30)
{
    const lanes raised = REST(ALL(LIFT), slope);
    STORE(&rows->slope_q14[i][k], raised);
    STORE(&rows->weighted_q16[i][k], SHIFT(SUM(PRODUCT(weight, raised), lift_q30), 14));
}

static void find_slopes(struct ih_rows *rows, int32_t count)
{
    for (int32_t k = 0; k < count; k += LANES) {
        const lanes by_25 = LOAD(&rows->length[k]);
        const lanes whole = SUM(SUM(SHIFT_UP(by_25, 4), SHIFT_UP(by_25, 3)), by_25);
        const lanes weight = LOAD(&rows->weight_q16[k]);
        const lanes lift_q30 =
            REST(ALL(((int64_t)LIFT_WEIGHTED << 14) + (1 << 13)), SHIFT_UP(weight, LIFT_BITS));
        for (int axis = 0; axis < 3; axis++) {
            const lanes component = LOAD(&rows->component_q14[axis][k]);
            const lanes sign = SIGN(component);
            const lanes part = product_shift(REST(FLIP(component, sign), sign), whole, 48);
            set_slope(rows, k, axis, REST(FLIP(part, sign), sign), weight, lift_q30);
            const lanes place = LOAD(&rows->place_q14[axis][k]);
            const lanes place_sign = SIGN(place);
            const lanes size = REST(FLIP(place, place_sign), place_sign);
            const lanes square = SHIFT(SUM(PRODUCT(size, size), ALL(1 << 13)), 14);
            set_slope(rows, k, 3 + axis, product_shift(square, by_25, 44), weight, lift_q30);
        }
    }
}

static inline uint64_t sum_lanes(lanes value)
{
    uint64_t lane[LANES], sum = 0;
    STORE(lane, value);
    for (int k = 0; k < LANES; k++) {
        sum += lane[k];
    }
    return sum;
}

static uint64_t sum_entries(const ih_row_entry *entry, int32_t count)
{
    lanes sum = ALL(0);
    for (int32_t k = 0; k < count; k += LANES) {
        sum = SUM(sum, LOAD(&entry[k]));
    }
    return sum_lanes(sum);
}

/* Sums of the weighted entries' products with the first slopes, and with the residuals behind them. */
static ALWAYS_INLINE void sum_products(const struct ih_rows *rows, int32_t count, int i,
                                       uint64_t sum[IH_FIT_UNKNOWNS + 1])
{
    const lanes half_q30 = ALL(1 << 13);
    const lanes half_q24 = ALL(1 << 7);
    lanes part[IH_FIT_UNKNOWNS];
    lanes residual = ALL(0);
    for (int j = 0; j <= i; j++) {
        part[j] = ALL(0);
    }
    for (int32_t k = 0; k < count; k += LANES) {
        const lanes weighted = LOAD(&rows->weighted_q16[i][k]);
        for (int j = 0; j <= i; j++) {
            const lanes product = PRODUCT(weighted, LOAD(&rows->slope_q14[j][k]));
            part[j] = SUM(part[j], SHIFT(SUM(product, half_q30), 14));
        }
        const lanes product = PRODUCT(weighted, LOAD(&rows->slope_q14[IH_FIT_UNKNOWNS][k]));
        residual = SUM(residual, SHIFT(SUM(product, half_q24), 8));
    }
    for (int j = 0; j <= i; j++) {
        sum[j] = sum_lanes(part[j]);
    }
    sum[IH_FIT_UNKNOWNS] = sum_lanes(residual);
}
#else
#define ALWAYS_INLINE
#define LANES 1
/* n * 2^(first + second) / d, rounded, in 32 bits: n * 2^first, d * 2^second and what comes out must fit. */
static uint32_t quotient(uint32_t n, int first, int second, uint32_t d)
{
    const uint32_t high = n << first;
    const uint32_t whole = high / d;
    return (whole << second) + (((high - whole * d) << second) + d / 2) / d;
}

/* As a number that is rounded away from zero on either side. */
static int32_t with_sign(uint32_t size, int64_t number)
{
    return number < 0 ? -(int32_t)size : (int32_t)size;
}

/* (f - 1) f over the gradient's length, mm; for f up to 5.9 the one is below 2^19, the other below
 * 2^17.4. */
static int32_t find_residual(const struct gradient *g, ih_row_entry *length)
{
    const int64_t over = over_q14(g);
    *length = (uint32_t)g->length_q14;
    return with_sign(quotient((uint32_t)ih_abs_s64(over), 12, 2, (uint32_t)g->length_q14), over);
}

static void set_slope(struct ih_rows *rows, int32_t k, int i, int32_t slope_q14, uint64_t lift_q30)
{
    const uint32_t raised = (uint32_t)(LIFT - slope_q14);
    IH_IN_RANGE(slope_q14, -IH_RANGE_SLOPE_Q14, IH_RANGE_SLOPE_Q14);
    rows->slope_q14[i][k] = raised;
    rows->weighted_q16[i][k] =
        (ih_row_entry)(((uint64_t)rows->weight_q16[k] * raised + lift_q30) >> 14);
}

static void find_slopes(struct ih_rows *rows, int32_t count)
{
    for (int32_t k = 0; k < count; k++) {
        const uint32_t length = (uint32_t)rows->length[k];
        const uint64_t lift_q30 = ((uint64_t)LIFT_WEIGHTED << 14) + (1 << 13) -
                                  ((uint64_t)rows->weight_q16[k] << LIFT_BITS);
        for (int axis = 0; axis < 3; axis++) {
            const int32_t place = (int32_t)rows->place_q14[axis][k];
            const int32_t component = (int32_t)rows->component_q14[axis][k];
            /* a component is at most the length, below 2^17.4; a square below 2^19.2 */
            const uint32_t part = (((uint32_t)ih_abs_s32(component) << 14) + length / 2) / length;
            const uint32_t square = (uint32_t)ih_mul_shift(place, place, 14);
            set_slope(rows, k, axis, with_sign(part, component), lift_q30);
            set_slope(rows, k, 3 + axis, (int32_t)quotient(square, 12, 6, 25 * length), lift_q30);
        }
    }
}

static uint64_t sum_entries(const ih_row_entry *entry, int32_t count)
{
    uint32_t sum = 0; /* of 128 that are below 2^19 */
    for (int32_t k = 0; k < count; k++) {
        sum += (uint32_t)entry[k];
    }
    return sum;
}

/* Sums of the weighted entries' products with the first slopes, and with the residuals behind them. A
 * product is below 2^36: 128 of them, shifted by 14, below 2^29. */
static void sum_products(const struct ih_rows *rows, int32_t count, int i,
                         uint64_t sum[IH_FIT_UNKNOWNS + 1])
{
    const ih_row_entry *weighted = rows->weighted_q16[i];
    for (int j = 0; j <= i; j++) {
        const ih_row_entry *slope = rows->slope_q14[j];
        uint32_t part = 0;
        for (int32_t k = 0; k < count; k++) {
            part += (uint32_t)(((uint64_t)weighted[k] * slope[k] + (1 << 13)) >> 14);
        }
        sum[j] = part;
    }
    const ih_row_entry *residual = rows->slope_q14[IH_FIT_UNKNOWNS];
    sum[IH_FIT_UNKNOWNS] = 0;
    for (int32_t k = 0; k < count; k++) {
        sum[IH_FIT_UNKNOWNS] += ((uint64_t)weighted[k] * residual[k] + (1 << 7)) >> 8;
    }
}
#endif

/* What the lifts bring into a sum of shifted products, from the sums of their factors. */
static int64_t lifted(int64_t weighted, int64_t slopes, int32_t count, int shift)
{
    return weighted * (LIFT >> shift) + slopes * (LIFT_WEIGHTED >> shift) -
           (int64_t)count * (LIFT_WEIGHTED >> shift) * LIFT;
}

/* A line of the lower triangle, and its right side. */
static ALWAYS_INLINE void sum_line(const struct ih_rows *rows, int32_t count, int i,
                                   const int64_t slopes[], struct ih_row_system *system)
{
    const int64_t weighted = (int64_t)sum_entries(rows->weighted_q16[i], count);
    int64_t *line = &system->normal_q16[IH_CHOLESKY_PACKED(i)];
    uint64_t sum[IH_FIT_UNKNOWNS + 1];
    sum_products(rows, count, i, sum);
    for (int j = 0; j <= i; j++) {
        line[j] += (int64_t)sum[j] - lifted(weighted, slopes[j], count, 14);
    }
    system->right_q16[i] -=
        (int64_t)sum[IH_FIT_UNKNOWNS] - lifted(weighted, slopes[IH_FIT_UNKNOWNS], count, 8);
}

/* Of whole groups of rows. */
static void sum_rows(const struct ih_rows *rows, int32_t count, struct ih_row_system *system)
{
    int64_t slopes[IH_FIT_UNKNOWNS + 1];
    for (int i = 0; i <= IH_FIT_UNKNOWNS; i++) {
        slopes[i] = (int64_t)sum_entries(rows->slope_q14[i], count);
    }
#ifdef BY_VECTORS
    sum_line(rows, count, 0, slopes, system); /* one by one: then a line's sums are in registers */
    sum_line(rows, count, 1, slopes, system);
    sum_line(rows, count, 2, slopes, system);
    sum_line(rows, count, 3, slopes, system);
    sum_line(rows, count, 4, slopes, system);
    sum_line(rows, count, 5, slopes, system);
#else
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        sum_line(rows, count, i, slopes, system);
    }
#endif
}

static void flush_rows(struct ih_rows *rows, struct ih_row_system *system)
{
    int32_t count = rows->count;
    while ((count & (LANES - 1)) != 0) { /* rows of nothing add nothing; LANES is a power of two */
        for (int axis = 0; axis < 3; axis++) {
            rows->place_q14[axis][count] = 0;
            rows->component_q14[axis][count] = 0;
        }
        rows->length[count] = 0;
        rows->weight_q16[count] = 0;
        rows->slope_q14[IH_FIT_UNKNOWNS][count] = LIFT;
        count++;
    }
    find_slopes(rows, count);
    sum_rows(rows, count, system);
    rows->count = 0;
}

static void add_row(struct ih_rows *rows, struct ih_row_system *system, const struct gradient *g,
                    ih_row_entry length, const int32_t place_q14[3], int32_t residual_mm_q8,
                    int32_t weight_q16)
{
    const int32_t at = rows->count++;
    for (int axis = 0; axis < 3; axis++) {
        rows->place_q14[axis][at] = place_q14[axis];
        rows->component_q14[axis][at] = g->component_q14[axis];
    }
    rows->length[at] = length;
    rows->weight_q16[at] = (uint32_t)weight_q16;
    rows->slope_q14[IH_FIT_UNKNOWNS][at] = (uint32_t)(residual_mm_q8 + LIFT);
    if (rows->count == IH_ROW_MAX) {
        flush_rows(rows, system);
    }
}

#ifdef __LP64__
/* s^-2, rounded. */
static int32_t inverse_square_q16(uint64_t s_q16)
{
    const uint64_t square_q32 = s_q16 * s_q16;
    return (int32_t)((((uint64_t)1 << 48) + square_q32 / 2) / square_q32);
}
#else
/* The same for s from 1 to 65 without a division of 64 bits, which is a long one here. 2^40 / s less than
 * 1 too small has a square that is, over 2^32, up to 2^-15 times the root of the result too small, and by
 * what is cut off: less than 2. */
static int32_t inverse_square_q16(uint32_t s_q16)
{
    const uint32_t one_q31 = (uint32_t)1 << 31;
    const uint32_t high = one_q31 / s_q16;
    const uint32_t inverse_q24 = (high << 9) + (((one_q31 - high * s_q16) << 9) / s_q16);
    const uint64_t square_q32 = (uint64_t)s_q16 * s_q16;
    uint32_t result = (uint32_t)((uint64_t)inverse_q24 * inverse_q24 >> 32);
    uint64_t rest = ((uint64_t)1 << 48) + square_q32 / 2 - result * square_q32;
    while (rest >= square_q32) {
        rest -= square_q32;
        result++;
    }
    return (int32_t)result;
}
#endif

/* (1 + (r / k)^2)^-2; 0 where that is next to nothing. */
static int32_t robust_weight_q16(int32_t residual_mm_q8, int32_t scale_mm)
{
    const int32_t size_q8 = ih_abs_s32(residual_mm_q8);
    if (size_q8 > ROBUST_REACH * scale_mm << 8) {
        return 0;
    }
    const uint32_t scale2 = (uint32_t)(scale_mm * scale_mm);
    const uint32_t ratio2_q16 = ((uint32_t)size_q8 * (uint32_t)size_q8 + scale2 / 2) / scale2;
    return inverse_square_q16(ONE_Q16 + ratio2_q16);
}

/* A weight, less for what is low on the head. */
static int32_t lowered_q16(int32_t weight_q16, int32_t down_q14)
{
    if (down_q14 <= LOW_FROM_Q14) {
        return weight_q16;
    }
    const uint32_t over = (uint32_t)ih_min_s32(down_q14 - LOW_FROM_Q14, LOW_SPAN_Q14);
    const int32_t low_q16 = ONE_Q16 - (int32_t)(LOW_LOSS_Q16 * over / LOW_SPAN_Q14);
    return (int32_t)ih_mul_shift(weight_q16, low_q16, 16);
}

/* What a step's ellipsoid is asked for at every ray. */
struct step {
    const struct ih_ellipsoid *ellipsoid;
    const int32_t *origin_mm_q8;
    struct ih_shares shares;
    struct ih_ellipsoid_box box; /* rays that may hit it pass through */
    int32_t scale_mm, see_through_mm;
    int32_t reach_mm_q8[3]; /* points farther from the centre have no weight */
    uint64_t reach2_q28;    /* nor has what is farther in semi-axes, squared */
    int32_t front_mm_q8;    /* nothing is entered before */
};

/* A residual is at least (f - 1) times the shortest semi-axis: it has no weight from f = 1 + 8 k / a
 * on. A 64th more for what is rounded. */
static void begin_step(struct step *step, const struct ih_row_rays *rays)
{
    const struct ih_ellipsoid *ellipsoid = step->ellipsoid;
    const int32_t *semi_mm_q8 = ellipsoid->semi_mm_q8;
    const int32_t shortest_q8 = ih_min_s32(ih_min_s32(semi_mm_q8[0], semi_mm_q8[1]), semi_mm_q8[2]);
    int64_t most_q14 =
        ONE_Q14 +
        ih_div_round((int64_t)ROBUST_REACH * step->scale_mm * (ONE_Q14 << 8), shortest_q8);
    most_q14 += most_q14 / 64;
    step->shares = ih_ellipsoid_shares(semi_mm_q8);
    step->box = ih_ellipsoid_box(ellipsoid, rays->slope_most_q20, ONE_Q14);
    for (int axis = 0; axis < 3; axis++) {
        step->reach_mm_q8[axis] = (int32_t)ih_mul_shift(most_q14, semi_mm_q8[axis], 14);
    }
    step->reach2_q28 = (uint64_t)(most_q14 * most_q14);
    step->front_mm_q8 =
        ellipsoid->centre_mm_q8[2] - semi_mm_q8[2] - FRONT_MM_Q8 + step->see_through_mm * 256;
}

/* From here to there, both included. */
struct interval {
    int16_t low, high;
};

static struct interval interval_of(int64_t low, int64_t high)
{
    return (struct interval){saturate_s16(low), saturate_s16(high)};
}

/* Slopes of the rays that pass within half of the centre; all where it is too near to the origin's
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

/* What a ray must be within, to be looked at. */
struct bounds {
    struct interval point[3], slope[2];
    int16_t front; /* of a point that pushes, at least */
};

static void find_bounds(const struct step *step, struct bounds *out)
{
    for (int axis = 0; axis < 2; axis++) {
        out->slope[axis] = slopes_within(step, axis);
    }
    out->front = saturate_s16(step->front_mm_q8 >> 7);
    for (int axis = 0; axis < 3; axis++) {
        const int32_t centre_q8 = step->ellipsoid->centre_mm_q8[axis];
        out->point[axis] = interval_of((centre_q8 - step->reach_mm_q8[axis]) >> 7,
                                       (centre_q8 + step->reach_mm_q8[axis]) >> 7);
    }
}

#if defined __SSE2__ || defined __ARM_NEON
/* A loop without a branch: compilers turn it into vectors. */
static void flag_rays(const struct bounds *bounds, struct ih_row_scratch *scratch)
{
    const struct ih_row_rays *rays = &scratch->rays;
    const struct interval x = bounds->point[0], y = bounds->point[1], z = bounds->point[2];
    const struct interval dx = bounds->slope[0], dy = bounds->slope[1];
    const int16_t front = bounds->front;
    for (int32_t slot = 0; slot < IH_ROW_RAYS; slot++) {
        const int16_t at_x = rays->point_mm_q1[0][slot];
        const int16_t at_y = rays->point_mm_q1[1][slot];
        const int16_t at_z = rays->point_mm_q1[2][slot];
        const int16_t slope_x = rays->slope_q12[0][slot];
        const int16_t slope_y = rays->slope_q12[1][slot];
        const uint8_t seen = rays->seen[slot];
        uint8_t in_reach = (at_x >= x.low) & (at_x <= x.high) & (at_y >= y.low) & (at_y <= y.high) &
                           (at_z >= z.low) & (at_z <= z.high);
        uint8_t may_push = (slope_x >= dx.low) & (slope_x <= dx.high) & (slope_y >= dy.low) &
                           (slope_y <= dy.high) & (at_z >= front);
        scratch->flag[slot] = seen & in_reach;
        scratch->flag[slot] |= (uint8_t)((seen & may_push) << 1);
    }
}
#else
static bool is_within(int16_t value, const struct interval *interval)
{
    return value >= interval->low && value <= interval->high;
}

/* Where there are no vectors, most rays are told by one comparison. */
static void flag_rays(const struct bounds *bounds, struct ih_row_scratch *scratch)
{
    const struct ih_row_rays *rays = &scratch->rays;
    const struct interval *point = bounds->point, *slope = bounds->slope;
    for (int32_t slot = 0; slot < IH_ROW_RAYS; slot++) {
        uint8_t flag = 0;
        if (rays->seen[slot] != 0) {
            const int16_t at_z = rays->point_mm_q1[2][slot];
            if (is_within(rays->point_mm_q1[0][slot], &point[0]) &&
                is_within(rays->point_mm_q1[1][slot], &point[1]) && is_within(at_z, &point[2])) {
                flag = FLAG_POINT;
            }
            if (is_within(rays->slope_q12[0][slot], &slope[0]) &&
                is_within(rays->slope_q12[1][slot], &slope[1]) && at_z >= bounds->front) {
                flag |= FLAG_PUSH;
            }
        }
        scratch->flag[slot] = flag;
    }
}
#endif

static void add_point(const struct step *step, const struct ih_ray *ray, struct ih_rows *rows,
                      struct ih_row_system *system)
{
    const struct ih_ellipsoid *ellipsoid = step->ellipsoid;
    int32_t place_q14[3];
    int32_t component_q14[3];
    struct gradient g;
    for (int axis = 0; axis < 3; axis++) {
        const int32_t off_q8 = ray->point_mm_q8[axis] - ellipsoid->centre_mm_q8[axis];
        if (ih_abs_s32(off_q8) > step->reach_mm_q8[axis]) {
            return;
        }
        place_q14[axis] = ih_share(step->shares.share_q50[axis], off_q8);
        component_q14[axis] = ih_share(step->shares.share_q50[axis], place_q14[axis]);
    }
    const uint64_t radius2_q28 = square_q28(place_q14);
    if (radius2_q28 > step->reach2_q28 || !find_gradient(component_q14, radius2_q28, &g)) {
        return;
    }
    ih_row_entry length;
    const int32_t residual_mm_q8 = find_residual(&g, &length);
    const int32_t weight_q16 = robust_weight_q16(residual_mm_q8, step->scale_mm);
    if (weight_q16 > 0) {
        add_row(rows, system, &g, length, place_q14, residual_mm_q8,
                lowered_q16(weight_q16, place_q14[1]));
    }
}

/* A point seen behind the ellipsoid, through it. */
static void add_push(const struct step *step, const struct ih_ray *ray, struct ih_rows *rows,
                     struct ih_row_system *system)
{
    const struct ih_ellipsoid *ellipsoid = step->ellipsoid;
    int32_t component_q14[3];
    struct ih_crossing crossing;
    struct gradient g;
    if (ray->point_mm_q8[2] < step->front_mm_q8 ||
        !ih_ellipsoid_in_box(ellipsoid, &step->box, step->origin_mm_q8, ray)) {
        return;
    }
    const struct ih_aim aim = ih_ellipsoid_aim(ellipsoid->semi_mm_q8, ray);
    if (!ih_ellipsoid_cross_aimed(ellipsoid, &step->shares, step->origin_mm_q8, ray, &aim,
                                  &crossing) ||
        crossing.radius2_q14 >= ONE_Q14 ||
        ray->point_mm_q8[2] - step->see_through_mm * 256 <= crossing.entry_mm_q8) {
        return;
    }
    for (int axis = 0; axis < 3; axis++) {
        component_q14[axis] = ih_share(step->shares.share_q50[axis], crossing.nearest_q14[axis]);
    }
    if (find_gradient(component_q14, square_q28(crossing.nearest_q14), &g)) {
        ih_row_entry length;
        const int32_t residual_mm_q8 = find_residual(&g, &length);
        add_row(rows, system, &g, length, crossing.nearest_q14,
                ih_max_s32(residual_mm_q8, -PUSH_MAX_MM_Q8), PUSH_WEIGHT_Q16);
    }
}

void ih_row_collect(const struct ih_space *space, const struct ih_ellipsoid *ellipsoid,
                    int32_t scale_mm, int32_t see_through_mm, struct ih_row_scratch *scratch,
                    struct ih_row_system *out)
{
    struct step step = {.ellipsoid = ellipsoid,
                        .origin_mm_q8 = space->origin_mm_q8,
                        .scale_mm = scale_mm,
                        .see_through_mm = see_through_mm};
    begin_step(&step, &scratch->rays);
    struct bounds bounds;
    find_bounds(&step, &bounds);
    flag_rays(&bounds, scratch);
    memset(out, 0, sizeof *out);
    scratch->rows.count = 0;
    for (int32_t first = 0; first < IH_SLOTS; first += 8) {
        uint64_t any; /* of eight slots */
        memcpy(&any, &scratch->flag[first], sizeof any);
        for (int32_t slot = first; any != 0 && slot < ih_min_s32(first + 8, IH_SLOTS); slot++) {
            const uint8_t flag = scratch->flag[slot];
            if ((flag & FLAG_POINT) != 0) {
                add_point(&step, &space->ray[slot], &scratch->rows, out);
            }
            if ((flag & FLAG_PUSH) != 0) {
                add_push(&step, &space->ray[slot], &scratch->rows, out);
            }
        }
    }
    flush_rows(&scratch->rows, out);
}
