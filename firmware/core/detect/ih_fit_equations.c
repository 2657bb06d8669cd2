#include "detect/ih_fit_equations.h"

#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"

/* Ranges are checked without vectors. */
#if defined __x86_64__ && defined __SSE2__
#ifndef ISOHEAD_RANGE_CHECKS
#define BY_VECTORS
#include <immintrin.h>
#ifdef __AVX2__
#define WEIGHED_BY_VECTORS
#endif
#endif
#endif

#define ONE_Q14 (1 << 14)
#define ONE_Q16 (1 << 16)
/* Points farther than this many robust scales weigh less than 1/676 and are passed over. */
#define ROBUST_REACH 5
/* Places nearer to the centre than this have no direction. */
#define RADIUS_LEAST2_Q22 10481 /* 0.05 squared */
/* No row is farther out than this many radii, 3.35: of a fit's axes none would have a weight. */
#define RADIUS_MAX_Q14 54886
#define LOW_FROM_Q14 8192 /* 0.5 */
#define LOW_SPAN_Q14 4915 /* 0.3 */
/* 0.5 over 0.3: Q16 of what is lost for a step of the place, in steps of Q16, rounded up. */
#define LOW_SLOPE_Q16 436926
#define PUSH_MAX_MM_Q8 (30 << 8)
#define PUSH_WEIGHT_Q16 32768 /* 0.5 */
/* An entry may be off by this, see ih_ellipsoid. */
#define FRONT_MM_Q8 256
/* Lengths inside a gradient are in units of this, so that it is of order one. 64 mm in Q8 are 2^14:
 * s / a is an ih_fraction of s, too. */
#define GRADIENT_MM 64
#define FLAG_POINT 1
#define FLAG_PUSH 2
/* Bits of a row's slopes by the centre, at most 1, and by ln of the axes, below 3.6; of its weighted residual. */
#define CENTRE_BITS 14
#define LN_BITS 13
#define RESIDUAL_BITS 10
/* Of what stands for ln, in GRADIENT_MM. */
#define LN_HUNDREDTH_Q16 (GRADIENT_MM * 65536 / 100)
#define CENTRE_MAX ((1 << CENTRE_BITS) - 1)

static int16_t saturate_s16(int64_t value)
{
    return (int16_t)(value > INT16_MAX ? INT16_MAX : value < INT16_MIN ? INT16_MIN : value);
}

void ih_fit_equations_prepare(const struct ih_rays *space, struct ih_fit_equations_rays *out)
{
    memset(out, 0, sizeof *out);
    ih_rays_slope_max(space, out->slope_max_q20);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_ray *ray = &space->ray[slot];
        for (int axis = 0; axis < 3; axis++) {
            out->point_mm_q1[axis][slot] = saturate_s16(ray->point_mm_q8[axis] >> 7);
        }
        out->slope_q12[0][slot] = (int16_t)(ray->slope_x_q20 >> 8);
        out->slope_q12[1][slot] = (int16_t)(ray->slope_y_q20 >> 8);
        out->seen[slot] = ray->state == IH_RAY_SEEN;
        if (ray->state == IH_RAY_EMPTY) {
            out->point_mm_q1[2][slot] = IH_FIT_EQUATIONS_NOWHERE;
        }
        if (ray->state == IH_RAY_UNKNOWN) {
            out->slope_q12[0][slot] = IH_FIT_EQUATIONS_NOWHERE;
        }
    }
    for (int32_t slot = IH_SLOTS; slot < IH_FIT_EQUATIONS_RAYS; slot++) {
        out->slope_q12[0][slot] = IH_FIT_EQUATIONS_NOWHERE;
    }
}

/* a * b / 2^bits, rounded, where a 2^((33 - bits) / 2) and b 2^((32 - bits) / 2) are below 2^31: the upper
 * word of their product, which small processors have in one instruction. */
static inline uint32_t product_of(uint32_t a, uint32_t b, int bits)
{
    const int64_t a_up = (int32_t)(a << ((33 - bits) / 2));
    const int64_t b_up = (int32_t)(b << ((32 - bits) / 2));
    return (uint32_t)((a_up * b_up + ((int64_t)1 << 31)) >> 32);
}

static inline int32_t signed_as(uint32_t size, int32_t sign)
{
    return sign < 0 ? -(int32_t)size : (int32_t)size;
}

/* By the semi-axes: 2^43 / a, what makes an offset in Q8 a place, and a place s / a per GRADIENT_MM. */
struct inverses {
    uint32_t axis[3];
};

static struct inverses inverses_of(const struct ih_fractions *shares)
{
    struct inverses inverses;
    for (int axis = 0; axis < 3; axis++) {
        inverses.axis[axis] = (uint32_t)(shares->share_q50[axis] >> 7);
    }
    return inverses;
}

/* A place's gradient is along s / a; squares of both: within 8 semi-axes below 2^32. */
static inline uint32_t radius2_at(const int32_t place_q14[3])
{
    uint32_t sum_q22 = 0;
    for (int axis = 0; axis < 3; axis++) {
        const uint32_t place = (uint32_t)ih_abs_s32(place_q14[axis]);
        sum_q22 += product_of(place, place, 6);
    }
    return sum_q22;
}

/* The components are s / a, per GRADIENT_MM. */
static inline uint32_t gradient_at(const struct inverses *inverses, const int32_t place_q14[3],
                                   int32_t component_q14[3])
{
    uint32_t sum_q22 = 0;
    for (int axis = 0; axis < 3; axis++) {
        const uint32_t place = (uint32_t)ih_abs_s32(place_q14[axis]);
        const uint32_t component = product_of(place, inverses->axis[axis], 29);
        sum_q22 += product_of(component, component, 6);
        component_q14[axis] = signed_as(component, place_q14[axis]);
    }
    return sum_q22;
}

/* How far a place is out, and what its row is divided by. */
struct distance {
    int32_t residual_mm_q8;
    uint32_t inverse; /* 2^17 over the gradient's length; below 2^17.4 where there is a weight */
};

/* Roots from a table: of a square v 2^n from 2^30 on. With r a little below 1 / root, v r is the root but for
 * 2^-13.7 of it, and half of what its square is short by, times r, is nearly all of that. For 1 over a length r
 * itself is good enough: a row's slopes have 14 bits. False: the place has no direction. */
static inline bool find_distance(uint32_t radius2_q22, uint32_t length2_q22, struct distance *out)
{
    if (radius2_q22 < RADIUS_LEAST2_Q22) {
        return false;
    }
    const int half = __builtin_clz(radius2_q22) / 2;
    const uint32_t square = radius2_q22 << (2 * half);
    const uint32_t r_q15 = ih_inverse_root_q15(square);
    const uint32_t root_q16 = (square >> 16) * r_q15 >> 15;
    const uint32_t rest = square - root_q16 * root_q16; /* below 2^19.7: the root is short by 10 */
    const uint32_t root_q20 = root_q16 * 16 + ((rest >> 4) * r_q15 >> 24);
    const int32_t radius_q14 = (int32_t)(((root_q20 >> half) + 1) / 2);
    const int length_half = __builtin_clz(length2_q22) / 2;
    out->inverse = (ih_inverse_root_q15(length2_q22 << (2 * length_half)) << length_half) >> 3;
    /* (f - 1) / |grad f|, grad f = (s / a) / f: (f - 1) f over the length, for f up to 5.9 below 2^19.4 */
    const int64_t over_q14 = ih_mul_shift(radius_q14, radius_q14 - ONE_Q14, 14);
    out->residual_mm_q8 = (int32_t)ih_mul_shift(over_q14, out->inverse, 17);
    return true;
}

bool ih_fit_equations_distance(const struct ih_fractions *shares, const int32_t place_q14[3],
                               int32_t *distance_mm_q8)
{
    const struct inverses inverses = inverses_of(shares);
    int32_t component_q14[3];
    struct distance distance;
    const uint32_t length2_q22 = gradient_at(&inverses, place_q14, component_q14);
    if (!find_distance(radius2_at(place_q14), length2_q22, &distance)) {
        return false;
    }
    *distance_mm_q8 = distance.residual_mm_q8;
    return true;
}

#ifdef BY_VECTORS
#if defined __AVX2__
#define LANES 16
typedef __m256i lanes;
#define LOAD(from) _mm256_loadu_si256((const lanes *)(const void *)(from))
/* Elements of 16 bits with those behind them. */
#define TWO_AT(from, at) _mm256_i32gather_epi32((const int *)(const void *)(from), at, 2)
#define STORE(to, value) _mm256_storeu_si256((lanes *)(void *)(to), value)
#define ALL_64(value) _mm256_set1_epi64x(value)
#define ALL_16(value) _mm256_set1_epi16(value)
#define SUM_64(a, b) _mm256_add_epi64(a, b)
#define SUM_32(a, b) _mm256_add_epi32(a, b)
#define REST_32(a, b) _mm256_sub_epi32(a, b)
#define REST_16(a, b) _mm256_sub_epi16(a, b)
#define UP_64(a, bits) _mm256_slli_epi64(a, bits)
#define DOWN_64(a, bits) _mm256_srli_epi64(a, bits)
#define SIGN_32(a) _mm256_srai_epi32(a, 31)
#define BOTH(a, b) _mm256_or_si256(a, b)
#define FLIP(a, b) _mm256_xor_si256(a, b)
#define MIN_16(a, b) _mm256_min_epi16(a, b)
#define PRODUCT(a, b) _mm256_mul_epu32(a, b)
#define HIGH_PRODUCT(a, b) _mm256_mulhi_epu16(a, b)
#define PAIR_PRODUCT(a, b) _mm256_madd_epi16(a, b)
#define PACK(a, b) _mm256_permute4x64_epi64(_mm256_packs_epi32(a, b), 0xd8)
#define WIDE_LOW(a) _mm256_cvtepi32_epi64(_mm256_castsi256_si128(a))
#define WIDE_HIGH(a) _mm256_cvtepi32_epi64(_mm256_extracti128_si256(a, 1))
#else
#define LANES 8
typedef __m128i lanes;
#define LOAD(from) _mm_loadu_si128((const lanes *)(const void *)(from))
#define STORE(to, value) _mm_storeu_si128((lanes *)(void *)(to), value)
#define ALL_64(value) _mm_set1_epi64x(value)
#define ALL_16(value) _mm_set1_epi16(value)
#define SUM_64(a, b) _mm_add_epi64(a, b)
#define SUM_32(a, b) _mm_add_epi32(a, b)
#define REST_32(a, b) _mm_sub_epi32(a, b)
#define REST_16(a, b) _mm_sub_epi16(a, b)
#define UP_64(a, bits) _mm_slli_epi64(a, bits)
#define DOWN_64(a, bits) _mm_srli_epi64(a, bits)
#define SIGN_32(a) _mm_srai_epi32(a, 31)
#define BOTH(a, b) _mm_or_si128(a, b)
#define FLIP(a, b) _mm_xor_si128(a, b)
#define MIN_16(a, b) _mm_min_epi16(a, b)
#define PRODUCT(a, b) _mm_mul_epu32(a, b)
#define HIGH_PRODUCT(a, b) _mm_mulhi_epu16(a, b)
#define PAIR_PRODUCT(a, b) _mm_madd_epi16(a, b)
#define PACK(a, b) _mm_packs_epi32(a, b)
#define WIDE_LOW(a) _mm_unpacklo_epi32(a, SIGN_32(a))
#define WIDE_HIGH(a) _mm_unpackhi_epi32(a, SIGN_32(a))
#endif

/* (a * b + 2^(bits - 1)) / 2^bits in lanes of 32 bits, which it must fit. */
static inline lanes product_shift(lanes a, lanes b, int bits)
{
    const lanes half = ALL_64((long long)1 << (bits - 1));
    const lanes even = DOWN_64(SUM_64(PRODUCT(a, b), half), bits);
    const lanes odd = DOWN_64(SUM_64(PRODUCT(DOWN_64(a, 32), DOWN_64(b, 32)), half), bits);
    return BOTH(even, UP_64(odd, 32));
}

static inline lanes size_of(lanes value)
{
    const lanes sign = SIGN_32(value);
    return REST_32(FLIP(value, sign), sign);
}

/* Slopes of half a vector's rows as set_slope says. */
static inline lanes ln_slopes(const int32_t *place_q14, const uint32_t *inverse)
{
    const lanes hundredth_q16 = ALL_64((int64_t)LN_HUNDREDTH_Q16 << 32 | (int64_t)LN_HUNDREDTH_Q16);
    const lanes size = size_of(LOAD(place_q14));
    return product_shift(product_shift(size, size, 14),
                         product_shift(LOAD(inverse), hundredth_q16, 16), 18);
}

/* What gradient_at and place_of say of offsets, which their places take. */
static void find_gradients(const struct inverses *inverses, struct ih_fit_equations *rows,
                           int32_t count)
{
    for (int32_t k = 0; k < count; k += LANES / 2) {
        lanes radius2 = ALL_64(0);
        lanes length2 = ALL_64(0);
        for (int axis = 0; axis < 3; axis++) {
            const int64_t inverse = inverses->axis[axis];
            const lanes all = ALL_64((int64_t)((uint64_t)inverse << 32) | inverse);
            const lanes off = LOAD(&rows->place_q14[axis][k]);
            const lanes sign = SIGN_32(off);
            const lanes place = product_shift(size_of(off), all, 29);
            const lanes component = product_shift(place, all, 29);
            radius2 = SUM_32(radius2, product_shift(place, place, 6));
            length2 = SUM_32(length2, product_shift(component, component, 6));
            STORE(&rows->place_q14[axis][k], REST_32(FLIP(place, sign), sign));
            STORE(&rows->component_q14[axis][k], REST_32(FLIP(component, sign), sign));
        }
        STORE(&rows->radius2_q22[k], radius2);
        STORE(&rows->length2_q22[k], length2);
    }
}

static void find_slopes(struct ih_fit_equations *rows, int32_t count)
{
    for (int32_t k = 0; k < count; k += LANES) {
        const int32_t next = k + LANES / 2;
        const lanes weight = LOAD(&rows->weight_q16[k]);
        const lanes inverse = LOAD(&rows->inverse[k]);
        const lanes inverse_next = LOAD(&rows->inverse[next]);
        for (int axis = 0; axis < 3; axis++) {
            const lanes component = LOAD(&rows->component_q14[axis][k]);
            const lanes component_next = LOAD(&rows->component_q14[axis][next]);
            const lanes sign = PACK(SIGN_32(component), SIGN_32(component_next));
            const lanes size =
                MIN_16(PACK(product_shift(size_of(component), inverse, 17),
                            product_shift(size_of(component_next), inverse_next, 17)),
                       ALL_16(CENTRE_MAX));
            STORE(&rows->slope[axis][k], REST_16(FLIP(size, sign), sign));
            STORE(&rows->weighted[axis][k], REST_16(FLIP(HIGH_PRODUCT(size, weight), sign), sign));
            const lanes ln_slope =
                PACK(ln_slopes(&rows->place_q14[axis][k], &rows->inverse[k]),
                     ln_slopes(&rows->place_q14[axis][next], &rows->inverse[next]));
            STORE(&rows->slope[3 + axis][k], ln_slope);
            STORE(&rows->weighted[3 + axis][k], HIGH_PRODUCT(ln_slope, weight));
        }
    }
}

/* Sums of products of rows, of which there are whole vectors. A product is below 2^28 in size, as a weight
 * takes from the greater slopes: eight of them fit 32 bits. */
static int64_t sum_products(const int16_t *a, const int16_t *b, int32_t count)
{
    lanes sum = ALL_64(0);
    for (int32_t first = 0; first < count; first += 4 * LANES) {
        const int32_t end = ih_min_s32(first + 4 * LANES, count);
        lanes part = ALL_64(0);
        for (int32_t k = first; k < end; k += LANES) {
            part = SUM_32(part, PAIR_PRODUCT(LOAD(&a[k]), LOAD(&b[k])));
        }
        sum = SUM_64(sum, SUM_64(WIDE_LOW(part), WIDE_HIGH(part)));
    }
    int64_t lane[LANES / 4], total = 0;
    STORE(lane, sum);
    for (int i = 0; i < LANES / 4; i++) {
        total += lane[i];
    }
    return total;
}

/* Rows of nothing add nothing. */
static void clear_row(struct ih_fit_equations *rows, int32_t at)
{
    for (int axis = 0; axis < 3; axis++) {
        rows->place_q14[axis][at] = 0;
        rows->component_q14[axis][at] = 0;
    }
    rows->inverse[at] = 0;
    rows->weight_q16[at] = 0;
    rows->residual_mm_q10[at] = 0;
}

static void set_slopes(struct ih_fit_equations *rows, const int32_t component_q14[3],
                       uint32_t inverse, const int32_t place_q14[3], uint32_t weight_q16)
{
    for (int axis = 0; axis < 3; axis++) {
        rows->place_q14[axis][rows->count] = place_q14[axis];
        rows->component_q14[axis][rows->count] = component_q14[axis];
    }
    rows->inverse[rows->count] = inverse;
    rows->weight_q16[rows->count] = (uint16_t)weight_q16;
}
#else
#define LANES 4
/* Made of what is positive, so that what is symmetric stays so. */
static void set_slope(struct ih_fit_equations *rows, int i, int32_t size, int32_t sign,
                      uint32_t weight_q16)
{
    const int32_t weighted = (int32_t)((uint32_t)size * weight_q16 >> 16);
    rows->slope[i][rows->count] = (int16_t)(sign * size);
    rows->weighted[i][rows->count] = (int16_t)(sign * weighted);
}

static void set_slopes(struct ih_fit_equations *rows, const int32_t component_q14[3],
                       uint32_t inverse, const int32_t place_q14[3], uint32_t weight_q16)
{
    const uint32_t ln_inverse = product_of(inverse, LN_HUNDREDTH_Q16, 16);
    for (int axis = 0; axis < 3; axis++) {
        const uint32_t size = (uint32_t)ih_abs_s32(component_q14[axis]);
        const uint32_t place = (uint32_t)ih_abs_s32(place_q14[axis]);
        const int32_t slope = (int32_t)product_of(size, inverse, 17);
        const int32_t ln_slope = (int32_t)product_of(product_of(place, place, 14), ln_inverse, 18);
        IH_IN_RANGE(ln_slope, 0, IH_RANGE_SLOPE_Q13);
        set_slope(rows, axis, ih_min_s32(slope, CENTRE_MAX), component_q14[axis] < 0 ? -1 : 1,
                  weight_q16);
        set_slope(rows, 3 + axis, ln_slope, 1, weight_q16);
    }
}

static void find_slopes(struct ih_fit_equations *rows, int32_t count)
{
    (void)rows;
    (void)count;
}

static int64_t sum_products(const int16_t *a, const int16_t *b, int32_t count)
{
    int64_t sum = 0;
    for (int32_t k = 0; k < count; k += LANES) {
        sum += a[k] * b[k];
        sum += a[k + 1] * b[k + 1];
        sum += a[k + 2] * b[k + 2];
        sum += a[k + 3] * b[k + 3];
    }
    return sum;
}

/* Rows of nothing add nothing. */
static void clear_row(struct ih_fit_equations *rows, int32_t at)
{
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        rows->slope[i][at] = 0;
        rows->weighted[i][at] = 0;
    }
    rows->residual_mm_q10[at] = 0;
}
#endif
_Static_assert(IH_FIT_EQUATIONS_MAX % LANES == 0, "rows fill whole vectors");

static int slope_bits(int unknown)
{
    return unknown < 3 ? CENTRE_BITS : LN_BITS;
}

/* The sums keep the products' bits until all rows are in them. */
static void flush_rows(struct ih_fit_equations *rows, struct ih_fit_equations_system *system)
{
    int32_t count = rows->count;
    while (count % LANES != 0) {
        clear_row(rows, count++);
    }
    find_slopes(rows, count);
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        for (int j = 0; j <= i; j++) {
            system->normal_q16[IH_CHOLESKY_PACKED(i) + j] +=
                sum_products(rows->weighted[i], rows->slope[j], count);
        }
        system->right_q16[i] += sum_products(rows->residual_mm_q10, rows->slope[i], count);
    }
    rows->count = 0;
}

static void scale_system(struct ih_fit_equations_system *system)
{
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        for (int j = 0; j <= i; j++) {
            int64_t *entry = &system->normal_q16[IH_CHOLESKY_PACKED(i) + j];
            *entry = ih_shift_round(*entry, slope_bits(i) + slope_bits(j) - 16);
        }
        system->right_q16[i] =
            ih_shift_round(system->right_q16[i], slope_bits(i) + RESIDUAL_BITS - 16);
    }
}

static int16_t residual_of(int32_t weight_q16, int32_t residual_mm_q8)
{
    return (int16_t)ih_mul_shift(weight_q16, residual_mm_q8, 14);
}

static void add_row(struct ih_fit_equations *rows, struct ih_fit_equations_system *system,
                    const int32_t component_q14[3], const struct distance *distance,
                    const int32_t place_q14[3], int32_t weight_q16)
{
    set_slopes(rows, component_q14, distance->inverse, place_q14,
               (uint32_t)ih_min_s32(weight_q16, UINT16_MAX));
    rows->residual_mm_q10[rows->count] = residual_of(weight_q16, distance->residual_mm_q8);
    rows->count++;
    if (rows->count == IH_FIT_EQUATIONS_MAX) {
        flush_rows(rows, system);
    }
}

/* The root's table is looked up at a sum of Q16 shifted by 10 bits at the least, which must fit 32. */
_Static_assert(1 + ROBUST_REACH * ROBUST_REACH < 64, "a sum of a robust weight is below 2^22");
/* And with the greatest scale, 24 mm, vectors divide a square and what rounds it by a product. */
_Static_assert((ROBUST_REACH * 24 << 8) * (ROBUST_REACH * 24 << 8) + 24 * 24 / 2 < 1 << 30,
               "a quotient's dividend is below 2^30");

/* (1 + (r / k)^2)^-2, rounded; 0 where that is next to nothing. One over the sum is the square of one over its
 * root, from the table, and what that is short by to first order: 2^-25 of it. */
static inline int32_t robust_weight_q16(int32_t residual_mm_q8, int32_t scale_mm)
{
    const uint32_t size_q8 = (uint32_t)ih_abs_s32(residual_mm_q8);
    const uint32_t scale2 = (uint32_t)(scale_mm * scale_mm);
    if (size_q8 > (uint32_t)(ROBUST_REACH * scale_mm << 8)) {
        return 0;
    }
    const uint32_t sum_q16 = ONE_Q16 + (size_q8 * size_q8 + scale2 / 2) / scale2; /* up to 26 */
    const int half = 7 - (sum_q16 >= 1U << 18) - (sum_q16 >= 1U << 20);
    const uint32_t sum = sum_q16 << (2 * half);
    const uint32_t r_q15 = ih_inverse_root_q15(sum);
    const uint32_t root_q32 = (uint32_t)((uint64_t)sum * r_q15 >> 15);
    const uint32_t rest_q32 = UINT32_MAX - (uint32_t)((uint64_t)root_q32 * r_q15 >> 15);
    uint32_t inverse_q29 = r_q15 * r_q15 >> 1;
    inverse_q29 += (inverse_q29 >> 16) * (rest_q32 >> 4) >> 12;
    const uint64_t square_q58 = (uint64_t)inverse_q29 * inverse_q29;
    return (int32_t)((square_q58 + ((uint64_t)1 << (73 - 4 * half))) >> (74 - 4 * half));
}

/* A weight, less for what is low on the head. */
static inline int32_t lowered_q16(int32_t weight_q16, int32_t down_q14)
{
    const int32_t over = ih_clamp_s32(down_q14 - LOW_FROM_Q14, 0, LOW_SPAN_Q14);
    const uint32_t lost_q16 = (uint32_t)over * LOW_SLOPE_Q16 >> 16;
    return weight_q16 - (int32_t)(((uint32_t)weight_q16 * lost_q16 + (1U << 15) - 1) >> 16);
}

/* What a step's ellipsoid is asked for at every ray. */
struct step {
    const struct ih_ellipsoid *ellipsoid;
    const int32_t *origin_mm_q8;
    struct ih_fractions shares;
    struct inverses inverses;
    struct ih_ellipsoid_box box; /* rays that may hit it pass through */
    int32_t scale_mm, see_through_mm;
    int32_t reach_mm_q8[3]; /* points farther from the centre have no weight */
    uint32_t reach2_q22;    /* nor has what is farther in semi-axes, squared */
    int32_t front_mm_q8;    /* nothing is entered before */
};

/* A residual is at least (f - 1) times the shortest semi-axis: it has no weight from f = 1 + 5 k / a
 * on. A 64th more for what is rounded. */
static void begin_step(struct step *step, const struct ih_fit_equations_rays *rays)
{
    const struct ih_ellipsoid *ellipsoid = step->ellipsoid;
    const int32_t *semi_mm_q8 = ellipsoid->semi_mm_q8;
    const int32_t shortest_q8 = ih_min_s32(ih_min_s32(semi_mm_q8[0], semi_mm_q8[1]), semi_mm_q8[2]);
    int64_t max_q14 =
        ONE_Q14 +
        ih_div_round((int64_t)ROBUST_REACH * step->scale_mm * (ONE_Q14 << 8), shortest_q8);
    max_q14 = ih_min_s64(max_q14 + max_q14 / 64, RADIUS_MAX_Q14);
    step->shares = ih_ellipsoid_fractions(semi_mm_q8);
    step->inverses = inverses_of(&step->shares);
    step->box = ih_ellipsoid_box(ellipsoid, rays->slope_max_q20, ONE_Q14);
    for (int axis = 0; axis < 3; axis++) {
        step->reach_mm_q8[axis] = (int32_t)ih_mul_shift(max_q14, semi_mm_q8[axis], 14);
    }
    step->reach2_q22 = (uint32_t)(max_q14 * max_q14 >> 6);
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
        const int32_t low = (centre_q8 - step->reach_mm_q8[axis]) >> 7;
        const int32_t high = (centre_q8 + step->reach_mm_q8[axis]) >> 7;
        out->point[axis] = /* without those that are cut */
            (struct interval){(int16_t)ih_clamp_s32(low, -INT16_MAX, INT16_MAX),
                              (int16_t)ih_clamp_s32(high, INT16_MIN, INT16_MAX - 1)};
    }
}

#if defined __SSE2__ || defined __ARM_NEON
/* A loop without a branch: compilers turn it into vectors. */
static void flag_rays(const struct bounds *bounds, struct ih_fit_equations_scratch *scratch)
{
    const struct ih_fit_equations_rays *rays = &scratch->rays;
    const struct interval x = bounds->point[0], y = bounds->point[1], z = bounds->point[2];
    const struct interval dx = bounds->slope[0], dy = bounds->slope[1];
    const int16_t front = bounds->front;
    for (int32_t slot = 0; slot < IH_FIT_EQUATIONS_RAYS; slot++) {
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
static void flag_rays(const struct bounds *bounds, struct ih_fit_equations_scratch *scratch)
{
    const struct ih_fit_equations_rays *rays = &scratch->rays;
    const struct interval *point = bounds->point, *slope = bounds->slope;
    for (int32_t slot = 0; slot < IH_FIT_EQUATIONS_RAYS; slot++) {
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

/* Of eight rays, a byte each. */
static uint64_t flags_of(const struct ih_fit_equations_scratch *scratch, int32_t first,
                         uint8_t flag)
{
    uint64_t flags;
    memcpy(&flags, &scratch->flag[first], sizeof flags);
    return flags & flag * (UINT64_MAX / UINT8_MAX);
}

#ifdef BY_VECTORS
#ifdef WEIGHED_BY_VECTORS
/* Squares from 2^30 on, as find_distance has them by counting zeros: moved up by twice as much as *half. */
static inline lanes square_of(lanes value, lanes *half)
{
    lanes square = _mm256_max_epu32(value, _mm256_set1_epi32(1));
    *half = _mm256_setzero_si256();
    for (int bits = 16; bits > 1; bits /= 2) {
        const lanes is_small =
            _mm256_cmpeq_epi32(_mm256_srli_epi32(square, 32 - bits), _mm256_setzero_si256());
        const lanes up = _mm256_and_si256(is_small, _mm256_set1_epi32(bits));
        square = _mm256_sllv_epi32(square, up);
        *half = _mm256_add_epi32(*half, _mm256_srli_epi32(up, 1));
    }
    return square;
}

/* ih_inverse_root_q15 of eight. An entry and the next are one word. */
static inline lanes inverse_root(lanes square)
{
    const lanes at = _mm256_sub_epi32(_mm256_srli_epi32(square, 24), _mm256_set1_epi32(64));
    const lanes both = TWO_AT(ih_root_inverse_q15, at);
    const lanes here = _mm256_and_si256(both, _mm256_set1_epi32(0xffff));
    const lanes fall = _mm256_sub_epi32(here, _mm256_srli_epi32(both, 16));
    const lanes part = _mm256_and_si256(_mm256_srli_epi32(square, 8), _mm256_set1_epi32(0xffff));
    return _mm256_sub_epi32(
        here, _mm256_srli_epi32(
                  _mm256_add_epi32(_mm256_mullo_epi32(fall, part), _mm256_set1_epi32(0xffff)), 16));
}

/* product_shift of a number with a sign, in 32 bits. */
static inline lanes signed_product_shift(lanes a, lanes b, int bits)
{
    const lanes half = ALL_64((long long)1 << (bits - 1));
    const lanes even = DOWN_64(SUM_64(_mm256_mul_epi32(a, b), half), bits);
    const lanes odd = DOWN_64(SUM_64(_mm256_mul_epi32(DOWN_64(a, 32), DOWN_64(b, 32)), half), bits);
    return _mm256_blend_epi32(even, UP_64(odd, 32), 0xaa);
}

/* a * b / 2^bits, cut off. */
static inline lanes cut_product(lanes a, lanes b, int bits)
{
    const lanes even = DOWN_64(PRODUCT(a, b), bits);
    const lanes odd = DOWN_64(PRODUCT(DOWN_64(a, 32), DOWN_64(b, 32)), bits);
    return _mm256_blend_epi32(even, UP_64(odd, 32), 0xaa);
}

static inline lanes all_32(int32_t value)
{
    return _mm256_set1_epi32(value);
}

/* What a step's residuals are divided by: a quotient of less than 2^30 is a product. */
struct divisor {
    lanes factor, half;
    int bits;
};

/* The least power of two from the divisor on, times 2^30, over it, and rounded up: too great by less than one,
 * times 2^30 less than that power. */
static struct divisor divisor_of(uint32_t value)
{
    const int bits = 30 + 32 - __builtin_clz(value);
    const uint64_t factor = (((uint64_t)1 << bits) + value - 1) / value;
    return (struct divisor){all_32((int32_t)factor), all_32((int32_t)(value / 2)), bits};
}

/* robust_weight_q16 of eight; those that are not to be looked at as if on the surface. */
static inline lanes robust_weights(const struct divisor *scale2, lanes size, lanes is_of_use)
{
    const lanes near = _mm256_and_si256(size, is_of_use);
    const lanes ratio2 = cut_product(SUM_32(_mm256_mullo_epi32(near, near), scale2->half),
                                     scale2->factor, scale2->bits);
    const lanes sum_q16 = SUM_32(ratio2, all_32(ONE_Q16));
    const lanes half = SUM_32(SUM_32(all_32(7), _mm256_cmpgt_epi32(sum_q16, all_32((1 << 18) - 1))),
                              _mm256_cmpgt_epi32(sum_q16, all_32((1 << 20) - 1)));
    const lanes sum = _mm256_sllv_epi32(sum_q16, _mm256_slli_epi32(half, 1));
    const lanes r = inverse_root(sum);
    const lanes rest = _mm256_xor_si256(cut_product(cut_product(sum, r, 15), r, 15), all_32(-1));
    lanes inverse = _mm256_srli_epi32(_mm256_mullo_epi32(r, r), 1);
    inverse = SUM_32(inverse, _mm256_srli_epi32(_mm256_mullo_epi32(_mm256_srli_epi32(inverse, 16),
                                                                   _mm256_srli_epi32(rest, 4)),
                                                12));
    /* A place more than is wanted, then that one rounded. */
    const lanes bits = REST_32(all_32(73), _mm256_slli_epi32(half, 2));
    const lanes odd = DOWN_64(inverse, 32);
    const lanes even_square =
        _mm256_srlv_epi64(PRODUCT(inverse, inverse), _mm256_and_si256(bits, ALL_64(UINT32_MAX)));
    const lanes odd_square = _mm256_srlv_epi64(PRODUCT(odd, odd), DOWN_64(bits, 32));
    const lanes twice = _mm256_blend_epi32(even_square, UP_64(odd_square, 32), 0xaa);
    return _mm256_srli_epi32(SUM_32(twice, all_32(1)), 1);
}

/* find_distance of eight rows: what they are divided by, and their residuals. */
static inline lanes find_distances(const struct ih_fit_equations *rows, int32_t k, lanes *residual)
{
    lanes half, length_half;
    const lanes square = square_of(LOAD(&rows->radius2_q22[k]), &half);
    const lanes length_square = square_of(LOAD(&rows->length2_q22[k]), &length_half);
    const lanes r = inverse_root(square);
    const lanes root = _mm256_srli_epi32(_mm256_mullo_epi32(_mm256_srli_epi32(square, 16), r), 15);
    const lanes rest = REST_32(square, _mm256_mullo_epi32(root, root));
    const lanes root_q20 =
        SUM_32(_mm256_slli_epi32(root, 4),
               _mm256_srli_epi32(_mm256_mullo_epi32(_mm256_srli_epi32(rest, 4), r), 24));
    const lanes radius = _mm256_srli_epi32(SUM_32(_mm256_srlv_epi32(root_q20, half), all_32(1)), 1);
    const lanes over = _mm256_mullo_epi32(radius, REST_32(radius, all_32(ONE_Q14)));
    const lanes inverse =
        _mm256_srli_epi32(_mm256_sllv_epi32(inverse_root(length_square), length_half), 3);
    *residual =
        signed_product_shift(_mm256_srai_epi32(SUM_32(over, all_32(1 << 13)), 14), inverse, 17);
    return inverse;
}

/* The weights of eight rows; *residual with them. */
static inline lanes weigh_eight(const struct step *step, const struct divisor *scale2,
                                struct ih_fit_equations *rows, int32_t k, lanes *residual)
{
    const lanes inverse = find_distances(rows, k, residual);
    const lanes radius2 = LOAD(&rows->radius2_q22[k]);
    const lanes size = size_of(*residual);
    const lanes is_out =
        _mm256_or_si256(_mm256_cmpgt_epi32(size, all_32(ROBUST_REACH * step->scale_mm << 8)),
                        _mm256_cmpgt_epi32(radius2, all_32((int32_t)step->reach2_q22)));
    const lanes is_of_use =
        _mm256_andnot_si256(is_out, _mm256_cmpgt_epi32(radius2, all_32(RADIUS_LEAST2_Q22 - 1)));
    const lanes robust = robust_weights(scale2, size, is_of_use);
    const lanes down = REST_32(LOAD(&rows->place_q14[1][k]), all_32(LOW_FROM_Q14));
    const lanes over = _mm256_min_epi32(_mm256_max_epi32(down, all_32(0)), all_32(LOW_SPAN_Q14));
    const lanes lost = _mm256_srli_epi32(_mm256_mullo_epi32(over, all_32(LOW_SLOPE_Q16)), 16);
    const lanes less =
        _mm256_srli_epi32(SUM_32(_mm256_mullo_epi32(robust, lost), all_32((1 << 15) - 1)), 16);
    const lanes weight = _mm256_and_si256(is_of_use, REST_32(robust, less));
    STORE(&rows->inverse[k], _mm256_andnot_si256(_mm256_cmpeq_epi32(weight, all_32(0)), inverse));
    *residual =
        _mm256_srai_epi32(SUM_32(_mm256_mullo_epi32(weight, *residual), all_32(1 << 13)), 14);
    return weight;
}

/* What points weigh of which rows have the offsets. Of what has no weight nothing is left. */
static void weigh_points(const struct step *step, struct ih_fit_equations *rows)
{
    const struct divisor scale2 = divisor_of((uint32_t)(step->scale_mm * step->scale_mm));
    find_gradients(&step->inverses, rows, rows->count);
    for (int32_t k = 0; k < rows->count; k += LANES) {
        lanes residual, residual_next;
        const lanes weight = weigh_eight(step, &scale2, rows, k, &residual);
        const lanes weight_next = weigh_eight(step, &scale2, rows, k + LANES / 2, &residual_next);
        STORE(&rows->weight_q16[k],
              _mm256_permute4x64_epi64(_mm256_packus_epi32(weight, weight_next), 0xd8));
        STORE(&rows->residual_mm_q10[k], PACK(residual, residual_next));
    }
}
#else
/* What points weigh of which rows have the offsets. Of what has no weight nothing is left. */
static void weigh_points(const struct step *step, struct ih_fit_equations *rows)
{
    find_gradients(&step->inverses, rows, rows->count);
    for (int32_t k = 0; k < rows->count; k++) {
        struct distance distance = {0, 0};
        int32_t weight_q16 = 0;
        if (rows->radius2_q22[k] <= step->reach2_q22 &&
            find_distance(rows->radius2_q22[k], rows->length2_q22[k], &distance)) {
            weight_q16 = lowered_q16(robust_weight_q16(distance.residual_mm_q8, step->scale_mm),
                                     rows->place_q14[1][k]);
        }
        rows->inverse[k] = weight_q16 > 0 ? distance.inverse : 0;
        rows->weight_q16[k] = (uint16_t)ih_min_s32(weight_q16, UINT16_MAX);
        const int16_t residual = residual_of(weight_q16, distance.residual_mm_q8);
        rows->residual_mm_q10[k] = residual; /* 0 without weight */
    }
}

#endif

/* Offsets of all points that may have a weight; what they weigh says what is out of reach. */
static void add_points(const struct step *step, const struct ih_rays *space,
                       struct ih_fit_equations_scratch *scratch,
                       struct ih_fit_equations_system *system)
{
    struct ih_fit_equations *rows = &scratch->rows;
    const int32_t *centre_mm_q8 = step->ellipsoid->centre_mm_q8;
    for (int32_t first = 0; first < IH_FIT_EQUATIONS_RAYS; first += 8) {
        for (uint64_t left = flags_of(scratch, first, FLAG_POINT); left != 0; left &= left - 1) {
            const struct ih_ray *ray = &space->ray[first + __builtin_ctzll(left) / 8];
            const int32_t at = rows->count;
            rows->place_q14[0][at] = ray->point_mm_q8[0] - centre_mm_q8[0];
            rows->place_q14[1][at] = ray->point_mm_q8[1] - centre_mm_q8[1];
            rows->place_q14[2][at] = ray->point_mm_q8[2] - centre_mm_q8[2];
            rows->count = at + 1;
            if (rows->count == IH_FIT_EQUATIONS_MAX) {
                weigh_points(step, rows);
                flush_rows(rows, system);
            }
        }
    }
    weigh_points(step, rows);
}
#else
static void add_offset(const struct step *step, const int32_t off_q8[3],
                       struct ih_fit_equations *rows, struct ih_fit_equations_system *system)
{
    int32_t place_q14[3], component_q14[3];
    struct distance distance;
    for (int axis = 0; axis < 3; axis++) {
        const uint32_t off = (uint32_t)ih_abs_s32(off_q8[axis]);
        place_q14[axis] = signed_as(product_of(off, step->inverses.axis[axis], 29), off_q8[axis]);
    }
    const uint32_t radius2_q22 = radius2_at(place_q14);
    if (radius2_q22 > step->reach2_q22) {
        return;
    }
    const uint32_t length2_q22 = gradient_at(&step->inverses, place_q14, component_q14);
    if (find_distance(radius2_q22, length2_q22, &distance)) {
        const int32_t weight_q16 = robust_weight_q16(distance.residual_mm_q8, step->scale_mm);
        if (weight_q16 > 0) {
            add_row(rows, system, component_q14, &distance, place_q14,
                    lowered_q16(weight_q16, place_q14[1]));
        }
    }
}

static void add_point(const struct step *step, const struct ih_ray *ray,
                      struct ih_fit_equations *rows, struct ih_fit_equations_system *system)
{
    int32_t off_q8[3];
    for (int axis = 0; axis < 3; axis++) {
        off_q8[axis] = ray->point_mm_q8[axis] - step->ellipsoid->centre_mm_q8[axis];
        if (ih_abs_s32(off_q8[axis]) > step->reach_mm_q8[axis]) {
            return;
        }
    }
    add_offset(step, off_q8, rows, system);
}

static void add_points(const struct step *step, const struct ih_rays *space,
                       struct ih_fit_equations_scratch *scratch,
                       struct ih_fit_equations_system *system)
{
    for (int32_t first = 0; first < IH_FIT_EQUATIONS_RAYS; first += 8) {
        const uint64_t points = flags_of(scratch, first, FLAG_POINT);
        for (int32_t slot = first; points != 0 && slot < first + 8; slot++) {
            if ((scratch->flag[slot] & FLAG_POINT) != 0) {
                add_point(step, &space->ray[slot], &scratch->rows, system);
            }
        }
    }
}
#endif

/* A point seen behind the ellipsoid, through it. */
static void add_push(const struct step *step, const struct ih_ray *ray,
                     struct ih_fit_equations *rows, struct ih_fit_equations_system *system)
{
    const struct ih_ellipsoid *ellipsoid = step->ellipsoid;
    struct ih_crossing crossing;
    if (ray->point_mm_q8[2] < step->front_mm_q8 ||
        !ih_ellipsoid_in_box(ellipsoid, &step->box, step->origin_mm_q8, ray)) {
        return;
    }
    const struct ih_aim aim = ih_ellipsoid_aim(ellipsoid->semi_mm_q8, &step->shares, ray);
    if (!ih_ellipsoid_cross(ellipsoid, &step->shares, step->origin_mm_q8, ray, &aim, &crossing) ||
        crossing.radius2_q14 >= ONE_Q14 ||
        ray->point_mm_q8[2] - step->see_through_mm * 256 <= crossing.entry_mm_q8) {
        return;
    }
    int32_t component_q14[3];
    struct distance distance;
    const uint32_t length2_q22 = gradient_at(&step->inverses, crossing.nearest_q14, component_q14);
    if (find_distance(radius2_at(crossing.nearest_q14), length2_q22, &distance)) {
        distance.residual_mm_q8 = ih_max_s32(distance.residual_mm_q8, -PUSH_MAX_MM_Q8);
        add_row(rows, system, component_q14, &distance, crossing.nearest_q14, PUSH_WEIGHT_Q16);
    }
}

void ih_fit_equations_collect(const struct ih_rays *space, const struct ih_ellipsoid *ellipsoid,
                              int32_t scale_mm, int32_t see_through_mm,
                              struct ih_fit_equations_scratch *scratch,
                              struct ih_fit_equations_system *out)
{
    struct step step = {.ellipsoid = ellipsoid,
                        .origin_mm_q8 = space->origin_mm_q8,
                        .scale_mm = scale_mm,
                        .see_through_mm = see_through_mm};
    struct bounds bounds;
    begin_step(&step, &scratch->rays);
    find_bounds(&step, &bounds);
    flag_rays(&bounds, scratch);
    memset(out, 0, sizeof *out);
    scratch->rows.count = 0;
    add_points(&step, space, scratch, out);
    for (int32_t first = 0; first < IH_FIT_EQUATIONS_RAYS; first += 8) {
        const uint64_t pushes = flags_of(scratch, first, FLAG_PUSH);
        for (int32_t slot = first; pushes != 0 && slot < first + 8; slot++) {
            if ((scratch->flag[slot] & FLAG_PUSH) != 0) {
                add_push(&step, &space->ray[slot], &scratch->rows, out);
            }
        }
    }
    flush_rows(&scratch->rows, out);
    scale_system(out);
}
