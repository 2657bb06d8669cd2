#include "ih_normal.h"

#include "ih_range.h"

/* Products of pairs of 16 bits: compilers do not find them by themselves. */
#if defined __x86_64__ && defined __SSE2__
#include <immintrin.h>
#elif defined __ARM_FEATURE_SIMD32
#include <arm_acle.h>
#endif

#define PAIRS IH_NORMAL_PAIRS
#define TERMS IH_NORMAL_TERMS
#define GROUP IH_NORMAL_GROUP
/* A sum that products are taken away from begins here, so that it never is negative: shifts and words
 * without a sign serve both ways. */
#define CHANGE_BEGIN ((uint32_t)1 << 31)

_Static_assert(TERMS % GROUP == 0, "all groups are whole");

/* Entries of line i, with its padding. */
static int32_t length_of(int32_t i)
{
    return (i / GROUP + 1) * GROUP;
}

int32_t ih_normal_line(int32_t i)
{
    return IH_NORMAL_LINE(i - i % GROUP) + i % GROUP * length_of(i);
}

#if !(defined __x86_64__ && defined __SSE2__) && !defined __ARM_FEATURE_SIMD32

/* sum is never below 0: CHANGE_BEGIN is 8 of the greatest products. */
static inline uint32_t add_products(uint32_t sum, uint32_t a, uint32_t b, bool is_change)
{
    const uint32_t first = (a & 0xffff) * (b & 0xffff), second = (a >> 16) * (b >> 16);
    return is_change ? sum + first - second : sum + first + second;
}

static inline void add_lines(uint32_t pair[PAIRS][TERMS], int shift, bool is_change,
                             int32_t *normal)
{
    const uint32_t begin = (is_change ? CHANGE_BEGIN : 0) + ((uint32_t)1 << (shift - 1));
    const int32_t before = is_change ? (int32_t)(CHANGE_BEGIN >> shift) : 0;
    int32_t *line = normal;
    for (int32_t i = 0; i < TERMS; i++) {
        const int32_t length = length_of(i);
        for (int32_t j = 0; j < length; j++) {
            uint32_t sum = begin;
            for (int32_t k = 0; k < PAIRS; k++) {
                sum = add_products(sum, pair[k][i], pair[k][j], is_change);
            }
            line[j] += (int32_t)(sum >> shift) - before;
        }
        line = &line[length];
    }
}

#else

#if defined __x86_64__

#if defined __AVX2__
#define LANES 8
typedef __m256i lanes;
#define LOAD(from) _mm256_loadu_si256((const lanes *)(from))
#define LOAD_ROW(from) LOAD(from)
#define STORE(to, value) _mm256_storeu_si256((lanes *)(to), value)
#define ALL(value) _mm256_set1_epi32(IH_WRAPS(int32_t, value))
#define PRODUCTS(a, b) _mm256_madd_epi16(a, b)
#define SUM(a, b) _mm256_add_epi32(a, b)
#define DIFFERENCE(a, b) _mm256_sub_epi32(a, b)
#define SHIFTED(a, count) _mm256_srl_epi32(a, count)
#else
#define LANES 4
typedef __m128i lanes;
#define LOAD(from) _mm_loadu_si128((const lanes *)(from))
#define LOAD_ROW(from) _mm_load_si128((const lanes *)(from))
#define STORE(to, value) _mm_storeu_si128((lanes *)(to), value)
#define ALL(value) _mm_set1_epi32(IH_WRAPS(int32_t, value))
#define PRODUCTS(a, b) _mm_madd_epi16(a, b)
#define SUM(a, b) _mm_add_epi32(a, b)
#define DIFFERENCE(a, b) _mm_sub_epi32(a, b)
#define SHIFTED(a, count) _mm_srl_epi32(a, count)
#endif

/* The second number of a pair with its sign turned round. */
static inline uint32_t turn_second(uint32_t pair)
{
    return (pair & 0xffff) | ((0x10000 - (pair >> 16)) & 0xffff) << 16;
}

static inline void add_lines(uint32_t pair[PAIRS][TERMS], int shift, bool is_change,
                             int32_t *normal)
{
    const lanes begin = ALL((is_change ? CHANGE_BEGIN : 0) + ((uint32_t)1 << (shift - 1)));
    const lanes before = ALL(CHANGE_BEGIN >> shift);
    const __m128i count = _mm_cvtsi32_si128(shift);
    int32_t *line = normal;
    for (int32_t i = 0; i < TERMS; i++) {
        const int32_t length = length_of(i);
        lanes factor[PAIRS];
        for (int32_t k = 0; k < PAIRS; k++) {
            factor[k] = ALL(is_change ? turn_second(pair[k][i]) : pair[k][i]);
        }
        for (int32_t j = 0; j < length; j += LANES) {
            lanes sum = begin;
            for (int32_t k = 0; k < PAIRS; k++) {
                sum = SUM(sum, PRODUCTS(factor[k], LOAD_ROW(&pair[k][j])));
            }
            sum = SUM(SHIFTED(sum, count), LOAD(&line[j]));
            STORE(&line[j], is_change ? DIFFERENCE(sum, before) : sum);
        }
        line = &line[length];
    }
}

#else

/* Both products of two pairs added to a sum; with is_change the second taken away. */
static inline int32_t add_products(int16x2_t a, int16x2_t b, int32_t sum, bool is_change)
{
    return is_change ? __smlsd(a, b, sum) : __smlad(a, b, sum);
}

/* What such a sum adds to an entry. */
static inline int32_t added(int32_t sum, int shift, bool is_change)
{
    const int32_t before = is_change ? (int32_t)(CHANGE_BEGIN >> shift) : 0;
    return (int32_t)(IH_WRAPS(uint32_t, sum) >> shift) - before;
}

/* Columns of two lines with four others: as many sums as a Cortex-M can hold in registers. They pass 2^31 as
 * whole numbers with a sign, and come back as such without. */
static inline void add_tile(const uint32_t *a, const uint32_t *b, int shift, bool is_change,
                            int32_t *const line[2])
{
    const uint32_t begin = (is_change ? CHANGE_BEGIN : 0) + ((uint32_t)1 << (shift - 1));
    int32_t sum_00 = IH_WRAPS(int32_t, begin), sum_01 = sum_00, sum_02 = sum_00, sum_03 = sum_00;
    int32_t sum_10 = sum_00, sum_11 = sum_00, sum_12 = sum_00, sum_13 = sum_00;
#pragma GCC unroll 8
    for (int32_t k = 0; k < PAIRS; k++) {
        const int16x2_t a_0 = (int16x2_t)a[k * TERMS], a_1 = (int16x2_t)a[k * TERMS + 1];
        const int16x2_t b_0 = (int16x2_t)b[k * TERMS];
        sum_00 = add_products(a_0, b_0, sum_00, is_change);
        sum_10 = add_products(a_1, b_0, sum_10, is_change);
        const int16x2_t b_1 = (int16x2_t)b[k * TERMS + 1];
        sum_01 = add_products(a_0, b_1, sum_01, is_change);
        sum_11 = add_products(a_1, b_1, sum_11, is_change);
        const int16x2_t b_2 = (int16x2_t)b[k * TERMS + 2];
        sum_02 = add_products(a_0, b_2, sum_02, is_change);
        sum_12 = add_products(a_1, b_2, sum_12, is_change);
        const int16x2_t b_3 = (int16x2_t)b[k * TERMS + 3];
        sum_03 = add_products(a_0, b_3, sum_03, is_change);
        sum_13 = add_products(a_1, b_3, sum_13, is_change);
    }
    line[0][0] += added(sum_00, shift, is_change);
    line[0][1] += added(sum_01, shift, is_change);
    line[0][2] += added(sum_02, shift, is_change);
    line[0][3] += added(sum_03, shift, is_change);
    line[1][0] += added(sum_10, shift, is_change);
    line[1][1] += added(sum_11, shift, is_change);
    line[1][2] += added(sum_12, shift, is_change);
    line[1][3] += added(sum_13, shift, is_change);
}

static inline void add_lines(uint32_t pair[PAIRS][TERMS], int shift, bool is_change,
                             int32_t *normal)
{
    int32_t *line = normal;
    for (int32_t i = 0; i < TERMS; i += 2) {
        const int32_t length = length_of(i);
        for (int32_t j = 0; j <= i; j += 4) {
            add_tile(&pair[0][i], &pair[0][j], shift, is_change,
                     (int32_t *const[2]){&line[j], &line[length + j]});
        }
        line = &line[2 * length];
    }
}

#endif
#endif

void ih_normal_add(uint32_t pair[PAIRS][TERMS], int shift, int32_t *normal)
{
    add_lines(pair, shift, false, normal);
}

void ih_normal_change(uint32_t pair[PAIRS][TERMS], int shift, int32_t *normal)
{
    add_lines(pair, shift, true, normal);
}
