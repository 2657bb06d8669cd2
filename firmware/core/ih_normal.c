#include "ih_normal.h"

#include <string.h>

#include "ih_fix.h"

/* Products of pairs of 16 bits: compilers do not find them by themselves. */
#if defined __x86_64__ && defined __SSE2__
#include <immintrin.h>
#elif defined __ARM_FEATURE_SIMD32
#include <arm_acle.h>
#endif

#define PAIRS IH_NORMAL_PAIRS
#define TERMS IH_NORMAL_TERMS
#define GROUP IH_NORMAL_GROUP

/* Rows of a block: upper parts of two rows a word, then both parts of each row. */
#define BLOCK IH_NORMAL_BLOCK
#define BLOCK_PAIRS (IH_NORMAL_BLOCK / 2)
/* Numbers of the factor: an upper part with 15 fraction bits, and so many more. */
#define FACTOR_BITS IH_NORMAL_FACTOR_BITS
#define LOWER_BITS (FACTOR_BITS - 15)
/* Mantissas of a solution stay below this: 144 products with |F| <= 1 then sum below 2^(25 + 27 + 7.2). */
#define MANTISSA_BITS 25
#define LOWER_HALF (1 << (LOWER_BITS - 1))

_Static_assert(TERMS % GROUP == 0 && TERMS % BLOCK == 0, "all groups and blocks are whole");

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

static inline uint32_t add_products(uint32_t sum, uint32_t a, uint32_t b)
{
    return sum + (a & 0xffff) * (b & 0xffff) + (a >> 16) * (b >> 16);
}

static inline void add_lines(uint32_t pair[PAIRS][TERMS], int shift, bool is_taken, int32_t *normal)
{
    int32_t *line = normal;
    for (int32_t i = 0; i < TERMS; i++) {
        const int32_t length = length_of(i);
        for (int32_t j = 0; j < length; j++) {
            uint32_t sum = (uint32_t)1 << (shift - 1);
            for (int32_t k = 0; k < PAIRS; k++) {
                sum = add_products(sum, pair[k][i], pair[k][j]);
            }
            line[j] += is_taken ? -(int32_t)(sum >> shift) : (int32_t)(sum >> shift);
        }
        line = &line[length];
    }
}

static inline int32_t lower_of(uint32_t word)
{
    return (int32_t)((word & 0xffff) ^ 0x8000) - 0x8000;
}

static inline int32_t upper_of(uint32_t word)
{
    return (int32_t)(word >> 16 ^ 0x8000) - 0x8000;
}

/* Products of lower by lower and upper by upper halves, added to a sum; and of lower by upper ones. */
IH_WRAPPING static inline uint32_t add_alike(uint32_t a, uint32_t b, uint32_t sum)
{
    return sum + IH_WRAPS(uint32_t, lower_of(a) * lower_of(b)) +
           IH_WRAPS(uint32_t, upper_of(a) * upper_of(b));
}

IH_WRAPPING static inline uint32_t add_mixed(uint32_t a, uint32_t b, uint32_t sum)
{
    return sum + IH_WRAPS(uint32_t, lower_of(a) * upper_of(b)) +
           IH_WRAPS(uint32_t, upper_of(a) * lower_of(b));
}

/* An entry less both sums. */
IH_WRAPPING static inline int32_t less(int32_t entry, uint32_t sum, uint32_t mixed)
{
    const uint32_t both = sum + IH_WRAPS(uint32_t, IH_WRAPS(int32_t, mixed) >> LOWER_BITS);
    return IH_WRAPS(int32_t, IH_WRAPS(uint32_t, entry) - both);
}

/* What the first `done` rows of a block take away from line i. */
static void take_from(uint32_t work[IH_NORMAL_WORK][TERMS], int32_t done, int32_t i, int32_t *line)
{
    for (int32_t j = 0; j <= i; j++) {
        uint32_t sum = 0, mixed = LOWER_HALF;
        for (int32_t k = 0; k < (done + 1) / 2; k++) {
            sum = add_alike(work[k][i], work[k][j], sum);
        }
        for (int32_t k = BLOCK_PAIRS; k < BLOCK_PAIRS + done; k++) {
            mixed = add_mixed(work[k][i], work[k][j], mixed);
        }
        line[j] = less(line[j], sum, mixed);
    }
}

static void take_blocks(uint32_t work[IH_NORMAL_WORK][TERMS], int32_t first, int32_t *normal)
{
    for (int32_t i = 0; i < first; i++) {
        take_from(work, BLOCK, i, &normal[ih_normal_line(i)]);
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
#define SHIFTED_SIGNED(a, count) _mm256_srai_epi32(a, count)
#define SHIFTED_64(a, count) _mm256_srl_epi64(a, count)
#define SUM_64(a, b) _mm256_add_epi64(a, b)
#define PRODUCT_64(a, b) _mm256_mul_epu32(a, b)
#define UPPER_64(a) _mm256_srli_epi64(a, 32)
#define ALL_64(value) _mm256_set1_epi64x(value)
#define BOTH(even, odd) _mm256_blend_epi32(even, _mm256_slli_epi64(odd, 32), 0xaa)
#define LIFTED(a, count) _mm256_slli_epi32(a, count)
#define XOR(a, b) _mm256_xor_si256(a, b)
#define AND(a, b) _mm256_and_si256(a, b)
#define OR(a, b) _mm256_or_si256(a, b)
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
#define SHIFTED_SIGNED(a, count) _mm_srai_epi32(a, count)
#define SHIFTED_64(a, count) _mm_srl_epi64(a, count)
#define SUM_64(a, b) _mm_add_epi64(a, b)
#define PRODUCT_64(a, b) _mm_mul_epu32(a, b)
#define UPPER_64(a) _mm_srli_epi64(a, 32)
#define ALL_64(value) _mm_set1_epi64x(value)
#define BOTH(even, odd) \
    _mm_or_si128(_mm_and_si128(even, _mm_set1_epi64x(UINT32_MAX)), _mm_slli_epi64(odd, 32))
#define LIFTED(a, count) _mm_slli_epi32(a, count)
#define XOR(a, b) _mm_xor_si128(a, b)
#define AND(a, b) _mm_and_si128(a, b)
#define OR(a, b) _mm_or_si128(a, b)
#endif

static inline void add_lines(uint32_t pair[PAIRS][TERMS], int shift, bool is_taken, int32_t *normal)
{
    const lanes begin = ALL((uint32_t)1 << (shift - 1));
    const __m128i count = _mm_cvtsi32_si128(shift);
    int32_t *line = normal;
    for (int32_t i = 0; i < TERMS; i++) {
        const int32_t length = length_of(i);
        lanes factor[PAIRS];
        for (int32_t k = 0; k < PAIRS; k++) {
            factor[k] = ALL(pair[k][i]);
        }
        for (int32_t j = 0; j < length; j += LANES) {
            lanes sum = begin;
            for (int32_t k = 0; k < PAIRS; k++) {
                sum = SUM(sum, PRODUCTS(factor[k], LOAD_ROW(&pair[k][j])));
            }
            sum = SHIFTED(sum, count);
            STORE(&line[j], is_taken ? DIFFERENCE(LOAD(&line[j]), sum) : SUM(sum, LOAD(&line[j])));
        }
        line = &line[length];
    }
}

/* What a block's rows take away from line i. */
static inline void take_block(uint32_t work[IH_NORMAL_WORK][TERMS], int32_t i, int32_t *line)
{
    const int32_t length = length_of(i);
    lanes factor[IH_NORMAL_WORK];
    for (int32_t k = 0; k < BLOCK_PAIRS; k++) {
        factor[k] = ALL(work[k][i]);
    }
    for (int32_t k = BLOCK_PAIRS; k < IH_NORMAL_WORK; k++) {
        factor[k] = ALL(work[k][i] << 16 | work[k][i] >> 16);
    }
    for (int32_t j = 0; j < length; j += LANES) {
        lanes sum = PRODUCTS(factor[0], LOAD_ROW(&work[0][j]));
        lanes mixed = ALL(LOWER_HALF);
        for (int32_t k = 1; k < BLOCK_PAIRS; k++) {
            sum = SUM(sum, PRODUCTS(factor[k], LOAD_ROW(&work[k][j])));
        }
        for (int32_t k = BLOCK_PAIRS; k < IH_NORMAL_WORK; k++) {
            mixed = SUM(mixed, PRODUCTS(factor[k], LOAD_ROW(&work[k][j])));
        }
        sum = SUM(sum, SHIFTED_SIGNED(mixed, LOWER_BITS));
        STORE(&line[j], DIFFERENCE(LOAD(&line[j]), sum));
    }
}

/* The same of rows that are done; those that are not are zero. */
static void take_from(uint32_t work[IH_NORMAL_WORK][TERMS], int32_t done, int32_t i, int32_t *line)
{
    if (done > 0) {
        take_block(work, i, line);
    }
}

static void take_blocks(uint32_t work[IH_NORMAL_WORK][TERMS], int32_t first, int32_t *normal)
{
    for (int32_t i = 0; i < first; i++) {
        take_block(work, i, &normal[ih_normal_line(i)]);
    }
}

#else

/* What such a sum adds to an entry. */
static inline int32_t added(int32_t sum, int shift, bool is_taken)
{
    const int32_t value = (int32_t)(IH_WRAPS(uint32_t, sum) >> shift);
    return is_taken ? -value : value;
}

/* Columns of two lines with four others: as many sums as a Cortex-M can hold in registers. They pass 2^31 as
 * whole numbers with a sign, and come back as such without. */
static inline void add_tile(const uint32_t *a, const uint32_t *b, int shift, bool is_taken,
                            int32_t *const line[2])
{
    const uint32_t begin = (uint32_t)1 << (shift - 1);
    int32_t sum_00 = IH_WRAPS(int32_t, begin), sum_01 = sum_00, sum_02 = sum_00, sum_03 = sum_00;
    int32_t sum_10 = sum_00, sum_11 = sum_00, sum_12 = sum_00, sum_13 = sum_00;
#pragma GCC unroll 8
    for (int32_t k = 0; k < PAIRS; k++) {
        const int16x2_t a_0 = (int16x2_t)a[k * TERMS], a_1 = (int16x2_t)a[k * TERMS + 1];
        const int16x2_t b_0 = (int16x2_t)b[k * TERMS];
        sum_00 = __smlad(a_0, b_0, sum_00);
        sum_10 = __smlad(a_1, b_0, sum_10);
        const int16x2_t b_1 = (int16x2_t)b[k * TERMS + 1];
        sum_01 = __smlad(a_0, b_1, sum_01);
        sum_11 = __smlad(a_1, b_1, sum_11);
        const int16x2_t b_2 = (int16x2_t)b[k * TERMS + 2];
        sum_02 = __smlad(a_0, b_2, sum_02);
        sum_12 = __smlad(a_1, b_2, sum_12);
        const int16x2_t b_3 = (int16x2_t)b[k * TERMS + 3];
        sum_03 = __smlad(a_0, b_3, sum_03);
        sum_13 = __smlad(a_1, b_3, sum_13);
    }
    line[0][0] += added(sum_00, shift, is_taken);
    line[0][1] += added(sum_01, shift, is_taken);
    line[0][2] += added(sum_02, shift, is_taken);
    line[0][3] += added(sum_03, shift, is_taken);
    line[1][0] += added(sum_10, shift, is_taken);
    line[1][1] += added(sum_11, shift, is_taken);
    line[1][2] += added(sum_12, shift, is_taken);
    line[1][3] += added(sum_13, shift, is_taken);
}

static inline void add_lines(uint32_t pair[PAIRS][TERMS], int shift, bool is_taken, int32_t *normal)
{
    int32_t *line = normal;
    for (int32_t i = 0; i < TERMS; i += 2) {
        const int32_t length = length_of(i);
        for (int32_t j = 0; j <= i; j += 4) {
            add_tile(&pair[0][i], &pair[0][j], shift, is_taken,
                     (int32_t *const[2]){&line[j], &line[length + j]});
        }
        line = &line[2 * length];
    }
}

/* Products of lower by lower and upper by upper halves, added to a sum; and of lower by upper ones. */
static inline uint32_t add_alike(uint32_t a, uint32_t b, uint32_t sum)
{
    return IH_WRAPS(uint32_t, __smlad((int16x2_t)a, (int16x2_t)b, IH_WRAPS(int32_t, sum)));
}

static inline uint32_t add_mixed(uint32_t a, uint32_t b, uint32_t sum)
{
    return IH_WRAPS(uint32_t, __smladx((int16x2_t)a, (int16x2_t)b, IH_WRAPS(int32_t, sum)));
}

/* An entry less both sums. */
IH_WRAPPING static inline int32_t less(int32_t entry, uint32_t sum, uint32_t mixed)
{
    const uint32_t both = sum + IH_WRAPS(uint32_t, IH_WRAPS(int32_t, mixed) >> LOWER_BITS);
    return IH_WRAPS(int32_t, IH_WRAPS(uint32_t, entry) - both);
}

/* What the first `done` rows of a block take away from line i. */
static void take_from(uint32_t work[IH_NORMAL_WORK][TERMS], int32_t done, int32_t i, int32_t *line)
{
    for (int32_t j = 0; j <= i; j++) {
        uint32_t sum = 0, mixed = LOWER_HALF;
        for (int32_t k = 0; k < (done + 1) / 2; k++) {
            sum = add_alike(work[k][i], work[k][j], sum);
        }
        for (int32_t k = BLOCK_PAIRS; k < BLOCK_PAIRS + done; k++) {
            mixed = add_mixed(work[k][i], work[k][j], mixed);
        }
        line[j] = less(line[j], sum, mixed);
    }
}

/* What a block's rows take away from columns j and j + 1 of two lines. */
static inline void take_tile(const uint32_t *a, const uint32_t *b, int32_t *const line[2])
{
    uint32_t sum_00 = 0, sum_01 = 0, sum_10 = 0, sum_11 = 0;
    uint32_t mixed_00 = LOWER_HALF, mixed_01 = LOWER_HALF;
    uint32_t mixed_10 = LOWER_HALF, mixed_11 = LOWER_HALF;
#pragma GCC unroll 4
    for (int32_t k = 0; k < BLOCK_PAIRS; k++) {
        const uint32_t a_0 = a[k * TERMS], a_1 = a[k * TERMS + 1];
        const uint32_t b_0 = b[k * TERMS], b_1 = b[k * TERMS + 1];
        sum_00 = add_alike(a_0, b_0, sum_00);
        sum_01 = add_alike(a_0, b_1, sum_01);
        sum_10 = add_alike(a_1, b_0, sum_10);
        sum_11 = add_alike(a_1, b_1, sum_11);
    }
#pragma GCC unroll 8
    for (int32_t k = BLOCK_PAIRS; k < IH_NORMAL_WORK; k++) {
        const uint32_t a_0 = a[k * TERMS], a_1 = a[k * TERMS + 1];
        const uint32_t b_0 = b[k * TERMS], b_1 = b[k * TERMS + 1];
        mixed_00 = add_mixed(a_0, b_0, mixed_00);
        mixed_01 = add_mixed(a_0, b_1, mixed_01);
        mixed_10 = add_mixed(a_1, b_0, mixed_10);
        mixed_11 = add_mixed(a_1, b_1, mixed_11);
    }
    line[0][0] = less(line[0][0], sum_00, mixed_00);
    line[0][1] = less(line[0][1], sum_01, mixed_01);
    line[1][0] = less(line[1][0], sum_10, mixed_10);
    line[1][1] = less(line[1][1], sum_11, mixed_11);
}

/* The same of both lines up to their diagonals: i is even. */
static void take_lines(uint32_t work[IH_NORMAL_WORK][TERMS], int32_t i, int32_t *line)
{
    const int32_t length = length_of(i);
    for (int32_t j = 0; j <= i; j += 2) {
        take_tile(&work[0][i], &work[0][j], (int32_t *const[2]){&line[j], &line[length + j]});
    }
}

static void take_blocks(uint32_t work[IH_NORMAL_WORK][TERMS], int32_t first, int32_t *normal)
{
    for (int32_t i = 0; i < first; i += 2) {
        take_lines(work, i, &normal[ih_normal_line(i)]);
    }
}

#endif
#endif

#if defined __x86_64__ && defined __SSE2__

/* What is left of a line, Q30, over its pivot: times its inverse, over 2^shift, at most 32. There are only products
 * without a sign on all of x86: numbers are taken for 2^31 more. */
static inline void divide_line(int32_t *line, int32_t length, int32_t inverse, int shift)
{
    const lanes factor = ALL(inverse), more = ALL(INT32_MIN);
    const lanes less = ALL_64(((int64_t)1 << (shift - 1)) - ((int64_t)inverse << 31));
    const __m128i count = _mm_cvtsi32_si128(shift);
    for (int32_t j = 0; j < length; j += LANES) {
        const lanes rest = XOR(LOAD(&line[j]), more);
        const lanes even = SHIFTED_64(SUM_64(PRODUCT_64(rest, factor), less), count);
        const lanes odd = SHIFTED_64(SUM_64(PRODUCT_64(UPPER_64(rest), factor), less), count);
        STORE(&line[j], BOTH(even, odd));
    }
}

/* A row's numbers in two parts: into a half of the words of a pair, and both into one word. */
static inline void split_line(const int32_t *line, int32_t length, bool is_second, uint32_t *pair,
                              uint32_t *parts)
{
    const lanes lower_half = ALL(LOWER_HALF), mask = ALL(0xffff);
    for (int32_t j = 0; j < length; j += LANES) {
        const lanes value = LOAD(&line[j]);
        const lanes upper = SHIFTED_SIGNED(SUM(value, lower_half), LOWER_BITS);
        const lanes lower = DIFFERENCE(value, LIFTED(upper, LOWER_BITS));
        const lanes half = AND(upper, mask);
        STORE(&pair[j], is_second ? OR(LOAD(&pair[j]), LIFTED(half, 16)) : half);
        STORE(&parts[j], OR(half, LIFTED(lower, 16)));
    }
}

#else

/* What is left of a line, Q30, over its pivot: times its inverse, over 2^shift. */
IH_WRAPPING static void divide_line(int32_t *line, int32_t length, int32_t inverse, int shift)
{
    for (int32_t j = 0; j < length; j++) {
        line[j] = IH_WRAPS(int32_t, ih_mul_shift(line[j], inverse, shift));
    }
}

/* A row's numbers in two parts: into a half of the words of a pair, and both into one word. */
IH_WRAPPING static void split_line(const int32_t *line, int32_t length, bool is_second,
                                   uint32_t *pair, uint32_t *parts)
{
    for (int32_t j = 0; j < length; j++) {
        const uint32_t value = IH_WRAPS(uint32_t, line[j]);
        const uint32_t upper =
            IH_WRAPS(uint32_t, IH_WRAPS(int32_t, value + LOWER_HALF) >> LOWER_BITS);
        const uint32_t half = upper & 0xffff;
        pair[j] = is_second ? pair[j] | half << 16 : half;
        parts[j] = half | (value - (upper << LOWER_BITS)) << 16;
    }
}

#endif

void ih_normal_add(uint32_t pair[PAIRS][TERMS], int shift, int32_t *normal)
{
    add_lines(pair, shift, false, normal);
}

void ih_normal_take(uint32_t pair[PAIRS][TERMS], int shift, int32_t *normal)
{
    add_lines(pair, shift, true, normal);
}

/* Row p of the factor from what is left of line p, also in its two parts: row number `at` of a block. */
static void finish_row(uint32_t work[IH_NORMAL_WORK][TERMS], int32_t at, int32_t p, int32_t *line)
{
    const int32_t square_q30 = ih_clamp_s32(line[p], IH_NORMAL_PIVOT_Q30, (1 << 30) - 1);
    const int32_t pivot = (int32_t)ih_isqrt_u54((uint64_t)square_q30 << (2 * FACTOR_BITS - 30));
    const int bits = ih_bits_u64((uint64_t)pivot);
    const int32_t inverse = (int32_t)(((int64_t)1 << (29 + bits)) / pivot);
    divide_line(line, length_of(p), inverse, bits + 29 - (2 * FACTOR_BITS - 30));
    line[p] = pivot;
    split_line(line, length_of(p), at % 2 != 0, work[at / 2], work[BLOCK_PAIRS + at]);
}

void ih_normal_factor(int32_t *line, uint32_t work[IH_NORMAL_WORK][TERMS])
{
    for (int32_t first = TERMS - BLOCK; first >= 0; first -= BLOCK) {
        memset(work[0], 0, IH_NORMAL_WORK * sizeof work[0]);
        for (int32_t at = 0; at < BLOCK; at++) {
            const int32_t p = first + BLOCK - 1 - at;
            int32_t *here = &line[ih_normal_line(p)];
            take_from(work, at, p, here);
            finish_row(work, at, p, here);
        }
        take_blocks(work, first, line);
    }
}

/* F^T v = b, in b's unit: v in b's place. */
static void solve_first(const int32_t *line, int32_t *b)
{
    int64_t rest[TERMS];
    for (int32_t k = 0; k < TERMS; k++) {
        rest[k] = (int64_t)b[k] * (1 << FACTOR_BITS);
    }
    for (int32_t p = TERMS - 1; p >= 0; p--) {
        const int32_t *row = &line[ih_normal_line(p)];
        const int32_t v = ih_saturate_s32(ih_div_round(rest[p], row[p]));
        b[p] = v;
#pragma GCC unroll 4
        for (int32_t k = 0; k < p; k++) {
            rest[k] -= (int64_t)row[k] * v;
        }
    }
}

static int64_t dot(const int32_t *a, const int32_t *b, int32_t count)
{
    int64_t sum = 0;
    for (int32_t k = 0; k < count; k++) {
        sum += (int64_t)a[k] * b[k];
    }
    return sum;
}

void ih_normal_solve(const int32_t *line, const int32_t *b, int32_t *x_mantissa,
                     int32_t *x_exponent)
{
    int exponent = 0;
    memmove(x_mantissa, b, TERMS * sizeof *b);
    solve_first(line, x_mantissa);
    for (int32_t p = 0; p < TERMS; p++) { /* F x = v, in units of 2^exponent */
        const int32_t *row = &line[ih_normal_line(p)];
        const int64_t v = ih_shift_round((int64_t)x_mantissa[p] * (1 << FACTOR_BITS), exponent);
        const int64_t value = ih_div_round(v - dot(row, x_mantissa, p), row[p]);
        const int grow = ih_max_s32(0, ih_bits_u64((uint64_t)ih_abs_s64(value)) - MANTISSA_BITS);
        if (grow > 0) { /* move the binary point of what is solved so far */
            exponent += grow;
            for (int32_t k = 0; k < p; k++) {
                x_mantissa[k] = (int32_t)ih_shift_round(x_mantissa[k], grow);
            }
        }
        x_mantissa[p] = (int32_t)ih_shift_round(value, grow);
        IH_IN_RANGE(x_mantissa[p], -IH_RANGE_MANTISSA, IH_RANGE_MANTISSA);
    }
    IH_IN_RANGE(exponent, 0, IH_RANGE_EXPONENT);
    *x_exponent = exponent;
}
