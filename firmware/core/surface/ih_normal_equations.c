#include "surface/ih_normal_equations.h"

#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"

/* Products of pairs of 16 bits: compilers do not find them by themselves. */
#if defined __x86_64__ && defined __SSE2__
#include <immintrin.h>
#elif defined __ARM_FEATURE_SIMD32
#include <arm_acle.h>
#endif

#define PAIRS IH_NORMAL_EQUATIONS_PAIRS
#define TERMS_MAX IH_NORMAL_EQUATIONS_TERMS_MAX
#define GROUP IH_NORMAL_EQUATIONS_GROUP

/* Rows of a block: upper parts of two rows a word, then both parts of each row. */
#define BLOCK IH_NORMAL_EQUATIONS_ROWS
#define PARTS PAIRS
/* Numbers of the factor: an upper part with 15 fraction bits, and so many more. */
#define FACTOR_BITS IH_NORMAL_EQUATIONS_FACTOR_BITS
#define LOWER_BITS (FACTOR_BITS - 15)
#define LOWER_HALF (1 << (LOWER_BITS - 1))
/* What is left behind the fine blocks is enlarged as long as it stays below this. */
#define LEFT_MAX 1030792151 /* 0.96 */
/* What is left at a pivot is above this only where a matrix was not positive. Rounded to 16 bits its root stays below
 * 2^27: quotients are shifted by 32 at the most. */
#define PIVOT_MAX_Q30 ((1 << 30) - (1 << 16))
/* Mantissas of a solution stay below this: 144 products with |F| <= 1 then sum below 2^(25 + 27 + 7.2). */
#define MANTISSA_BITS 25

_Static_assert(BLOCK % GROUP == 0, "all groups of whole blocks are whole");

/* What is done with the sum of 8 words' products: begin + sum, without a sign, over 2^shift, is added to or taken from
 * an entry. */
struct way {
    uint32_t begin;
    int shift;
    bool is_taken;
    bool is_mixed; /* lower by upper halves, and upper by lower ones */
};

/* Sums of products without a sign, rounded. */
static inline struct way plain_way(int shift, bool is_taken)
{
    return (struct way){(uint32_t)1 << (shift - 1), shift, is_taken, false};
}

/* Both parts of a row a word, rounded. With a sign: never negative with 2^31 more, of which MIXED_MORE is left. */
#define MIXED_MORE ((uint32_t)1 << (31 - LOWER_BITS))

static inline struct way mixed_way(void)
{
    return (struct way){((uint32_t)1 << 31) + LOWER_HALF, LOWER_BITS, true, true};
}

/* Upper parts of two rows a word; and what so many mixed sums take too much is given back. */
IH_WRAPPING static inline struct way upper_way(int32_t mixed)
{
    return (struct way){0 - (uint32_t)mixed * MIXED_MORE, 0, true, false};
}

/* Entries of line i, with its padding. */
static int32_t length_of(int32_t i)
{
    return (i | (GROUP - 1)) + 1;
}

int32_t ih_normal_equations_line(int32_t i)
{
    /* IH_NORMAL_EQUATIONS_LINE() of its group, and as many lengths as it has lines before it there. */
    return (length_of(i) >> 1) * (i + (i & (GROUP - 1)));
}

static inline uint32_t turned(uint32_t word)
{
    return (word & 0xffff) << 16 | word >> 16;
}

#if defined __x86_64__ && defined __SSE2__

#define WHOLE_LINES 1

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
#define LIFTED_BY(a, count) _mm256_sll_epi32(a, count)
#define XOR(a, b) _mm256_xor_si256(a, b)
#define AND(a, b) _mm256_and_si256(a, b)
#define ANDNOT(a, b) _mm256_andnot_si256(a, b)
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
#define LIFTED_BY(a, count) _mm_sll_epi32(a, count)
#define XOR(a, b) _mm_xor_si128(a, b)
#define AND(a, b) _mm_and_si128(a, b)
#define ANDNOT(a, b) _mm_andnot_si128(a, b)
#define OR(a, b) _mm_or_si128(a, b)
#endif

/* Line i by the first words. */
__attribute__((always_inline)) static inline void
add_words(uint32_t word[PAIRS][TERMS_MAX], struct way way, int32_t words, int32_t i, int32_t *line)
{
    const lanes begin = ALL(way.begin);
    const __m128i count = _mm_cvtsi32_si128(way.shift);
    const int32_t length = length_of(i);
    lanes factor[PAIRS];
    for (int32_t k = 0; k < words; k++) {
        factor[k] = ALL(way.is_mixed ? turned(word[k][i]) : word[k][i]);
    }
    for (int32_t j = 0; j < length; j += LANES) {
        lanes sum = begin;
        for (int32_t k = 0; k < words; k++) {
            sum = SUM(sum, PRODUCTS(factor[k], LOAD_ROW(&word[k][j])));
        }
        sum = SHIFTED(sum, count);
        STORE(&line[j], way.is_taken ? DIFFERENCE(LOAD(&line[j]), sum) : SUM(LOAD(&line[j]), sum));
    }
}

/* The first `count` lines: of each way by itself. */
__attribute__((always_inline)) static inline void
add_lines(uint32_t word[PAIRS][TERMS_MAX], struct way way, int32_t count, int32_t *normal)
{
    int32_t *line = normal;
    for (int32_t i = 0; i < count; i++) {
        add_words(word, way, PAIRS, i, line);
        line = &line[length_of(i)];
    }
}

/* A line of sums times two scales. */
static inline void scale_line(const int32_t *line, int32_t length, const uint32_t *scale,
                              uint32_t own_scale, int step, int32_t *scaled)
{
    const lanes own = ALL(own_scale);
    const __m128i count = _mm_cvtsi32_si128(step);
    for (int32_t j = 0; j < length; j += LANES) {
        const lanes here = LOAD(&line[j]);
        const lanes sum = ANDNOT(SHIFTED_SIGNED(here, 31), here);
        const lanes other = LOAD(&scale[j]);
        const lanes even = SHIFTED_64(PRODUCT_64(sum, own), count);
        const lanes odd = SHIFTED_64(PRODUCT_64(UPPER_64(sum), own), count);
        STORE(&scaled[j], BOTH(SHIFTED_64(PRODUCT_64(even, other), count),
                               SHIFTED_64(PRODUCT_64(odd, UPPER_64(other)), count)));
    }
}

/* What is left of a line, Q30, over its pivot: times its inverse, over 2^shift, at most 32. There are only products
 * without a sign on all of x86: numbers are taken for 2^31 more. */
static inline void divide_line(int32_t *line, int32_t length, int32_t inverse, int shift)
{
    const lanes factor = ALL(inverse);
    const lanes more = ALL(INT32_MIN);
    const lanes less = ALL_64(((int64_t)1 << (shift - 1)) - ((int64_t)inverse << 31));
    const __m128i count = _mm_cvtsi32_si128(shift);
    for (int32_t j = 0; j < length; j += LANES) {
        const lanes rest = XOR(LOAD(&line[j]), more);
        const lanes even = SHIFTED_64(SUM_64(PRODUCT_64(rest, factor), less), count);
        const lanes odd = SHIFTED_64(SUM_64(PRODUCT_64(UPPER_64(rest), factor), less), count);
        STORE(&line[j], BOTH(even, odd));
    }
}

/* A row's upper parts, into a half of the words of a pair; in its place the row of the factor. With parts, the lower
 * parts stay there, and both are put into words. */
static void split_line(int32_t *line, int32_t length, int enlarged, bool is_second, uint32_t *pair,
                       uint32_t *parts)
{
    const __m128i lift = _mm_cvtsi32_si128(LOWER_BITS - enlarged);
    const lanes lower_half = ALL(LOWER_HALF), mask = ALL(0xffff);
    for (int32_t j = 0; j < length; j += LANES) {
        const lanes value = LOAD(&line[j]);
        const lanes upper = SHIFTED_SIGNED(SUM(value, lower_half), LOWER_BITS);
        const lanes half = AND(upper, mask);
        STORE(&pair[j], is_second ? OR(LOAD(&pair[j]), LIFTED(half, 16)) : half);
        if (parts != NULL) {
            const lanes lower = DIFFERENCE(value, LIFTED(upper, LOWER_BITS));
            STORE(&parts[j], OR(half, LIFTED(lower, 16)));
        } else {
            STORE(&line[j], LIFTED_BY(upper, lift));
        }
    }
}

#else

#define WHOLE_LINES 0

/* 1, or all ones to take away. */
static inline uint32_t sign_of(struct way way)
{
    return way.is_taken ? UINT32_MAX : 1;
}

IH_WRAPPING static inline int32_t changed(int32_t entry, uint32_t sum, int shift, uint32_t sign)
{
    return IH_WRAPS(int32_t, IH_WRAPS(uint32_t, entry) + (sum >> shift) * sign);
}

#if defined __ARM_FEATURE_SIMD32

static inline uint32_t add_products(uint32_t sum, uint32_t a, uint32_t b)
{
    return IH_WRAPS(uint32_t, __smlad((int16x2_t)a, (int16x2_t)b, IH_WRAPS(int32_t, sum)));
}

/* Compilers load all that they can before it is used, and then have no registers for the sums. Nothing is loaded
 * across this; it is no instruction. */
#define IN_ORDER() __atomic_signal_fence(__ATOMIC_SEQ_CST)

/* Four columns' words, and what is done with the sums of their products: begin + sum over 2^shift, times `sign`, is
 * added. */
struct panel {
    uint32_t column[4 * PAIRS];
    uint32_t begin, sign;
    int shift;
    int32_t *line;
};

/* Two entries by their sums. */
static inline void change(int32_t *entry, uint32_t sum_0, uint32_t sum_1, int shift, uint32_t sign)
{
    const int32_t first = entry[0], second = entry[1];
    IN_ORDER();
    entry[0] = changed(first, sum_0, shift, sign);
    entry[1] = changed(second, sum_1, shift, sign);
    IN_ORDER();
}

/* From line i on, two lines at a time by four columns: as many sums as a Cortex-M can hold in registers. own: the
 * lines' words. Not a part of its caller, where what stands in the panel would be loaded once and stored again. */
__attribute__((noinline)) static void add_panel(const uint32_t *own, struct panel *panel, int32_t i,
                                                int32_t count)
{
    do {
        const int32_t length = length_of(i);
        const uint32_t *end = &own[length - i];
        do {
            IN_ORDER();
            const uint32_t begin = panel->begin;
            uint32_t sum_00 = begin, sum_01 = begin, sum_02 = begin, sum_03 = begin;
            uint32_t sum_10 = begin, sum_11 = begin, sum_12 = begin, sum_13 = begin;
#pragma GCC unroll 8
            for (int32_t k = 0; k < PAIRS; k++) {
                const uint32_t *column = &panel->column[4 * k];
                IN_ORDER();
                const uint32_t a_0 = own[k * TERMS_MAX], a_1 = own[k * TERMS_MAX + 1];
                const uint32_t b_0 = column[0], b_1 = column[1];
                IN_ORDER();
                sum_00 = add_products(sum_00, a_0, b_0);
                sum_10 = add_products(sum_10, a_1, b_0);
                sum_01 = add_products(sum_01, a_0, b_1);
                sum_11 = add_products(sum_11, a_1, b_1);
                IN_ORDER();
                const uint32_t b_2 = column[2], b_3 = column[3];
                IN_ORDER();
                sum_02 = add_products(sum_02, a_0, b_2);
                sum_12 = add_products(sum_12, a_1, b_2);
                sum_03 = add_products(sum_03, a_0, b_3);
                sum_13 = add_products(sum_13, a_1, b_3);
            }
            IN_ORDER();
            const int shift = panel->shift;
            const uint32_t sign = panel->sign;
            int32_t *line = panel->line;
            change(&line[0], sum_00, sum_01, shift, sign);
            change(&line[2], sum_02, sum_03, shift, sign);
            line = &line[length];
            change(&line[0], sum_10, sum_11, shift, sign);
            change(&line[2], sum_12, sum_13, shift, sign);
            panel->line = &line[length];
            own = &own[2];
        } while (own != end);
        i = length; /* where the next group begins */
    } while (i < count);
}

/* The first `count` lines, whole groups. */
__attribute__((noinline)) static void add_lines(uint32_t word[PAIRS][TERMS_MAX], struct way way,
                                                int32_t count, int32_t *normal)
{
    for (int32_t j = 0; j < count; j += 4) {
        struct panel panel;
        for (int32_t k = 0; k < PAIRS; k++) {
            const uint32_t *from = &word[k][j];
            uint32_t *to = &panel.column[4 * k];
            IN_ORDER();
            uint32_t w_0 = from[0], w_1 = from[1], w_2 = from[2], w_3 = from[3];
            IN_ORDER();
            if (way.is_mixed) {
                w_0 = turned(w_0);
                w_1 = turned(w_1);
                w_2 = turned(w_2);
                w_3 = turned(w_3);
            }
            to[0] = w_0;
            to[1] = w_1;
            to[2] = w_2;
            to[3] = w_3;
        }
        panel.begin = way.begin;
        panel.sign = sign_of(way);
        panel.shift = way.shift;
        panel.line = &normal[ih_normal_equations_line(j) + j];
        add_panel(&word[0][j], &panel, j, count);
    }
}

/* Line i by the first words, and what of its padding is in the last four. */
static void add_words(uint32_t word[PAIRS][TERMS_MAX], struct way way, int32_t words, int32_t i,
                      int32_t *line)
{
    const int shift = way.shift;
    const uint32_t sign = sign_of(way);
    uint32_t own[PAIRS];
    for (int32_t k = 0; k < words; k++) {
        own[k] = way.is_mixed ? turned(word[k][i]) : word[k][i];
    }
    for (int32_t j = 0; j <= i; j += 4) {
        const uint32_t *other = &word[0][j];
        uint32_t sum_0 = way.begin, sum_1 = sum_0, sum_2 = sum_0, sum_3 = sum_0;
        for (int32_t k = 0; k < words; k++) {
            const uint32_t a = own[k];
            IN_ORDER();
            const uint32_t b_0 = other[0], b_1 = other[1], b_2 = other[2], b_3 = other[3];
            IN_ORDER();
            sum_0 = add_products(sum_0, a, b_0);
            sum_1 = add_products(sum_1, a, b_1);
            sum_2 = add_products(sum_2, a, b_2);
            sum_3 = add_products(sum_3, a, b_3);
            other = &other[TERMS_MAX];
        }
        change(&line[j], sum_0, sum_1, shift, sign);
        change(&line[j + 2], sum_2, sum_3, shift, sign);
    }
}

/* a * b / 2^step, which is below 2^32; step 1..31. Shifts of 64 bits by 32 and more would be asked for. */
static inline uint32_t scaled_by(uint32_t a, uint32_t b, int step)
{
    const uint64_t product = (uint64_t)a * b;
    return (uint32_t)(product >> 32) << (32 - step) | (uint32_t)(product & UINT32_MAX) >> step;
}

#else

static inline int32_t lower_of(uint32_t word)
{
    return (int32_t)((word & 0xffff) ^ 0x8000) - 0x8000;
}

static inline int32_t upper_of(uint32_t word)
{
    return (int32_t)(word >> 16 ^ 0x8000) - 0x8000;
}

IH_WRAPPING static inline uint32_t add_products(uint32_t sum, uint32_t a, uint32_t b)
{
    return sum + IH_WRAPS(uint32_t, lower_of(a) * lower_of(b)) +
           IH_WRAPS(uint32_t, upper_of(a) * upper_of(b));
}

/* Columns of two lines with four others. */
static inline void add_tile(const uint32_t *a, const uint32_t *b, struct way way,
                            int32_t *const line[2])
{
    const int shift = way.shift;
    const uint32_t sign = sign_of(way);
    uint32_t sum_00 = way.begin, sum_01 = sum_00, sum_02 = sum_00, sum_03 = sum_00;
    uint32_t sum_10 = sum_00, sum_11 = sum_00, sum_12 = sum_00, sum_13 = sum_00;
    for (int32_t k = 0; k < PAIRS; k++) {
        const uint32_t a_0 = a[2 * k], a_1 = a[2 * k + 1];
        const uint32_t b_0 = b[k * TERMS_MAX];
        sum_00 = add_products(sum_00, a_0, b_0);
        sum_10 = add_products(sum_10, a_1, b_0);
        const uint32_t b_1 = b[k * TERMS_MAX + 1];
        sum_01 = add_products(sum_01, a_0, b_1);
        sum_11 = add_products(sum_11, a_1, b_1);
        const uint32_t b_2 = b[k * TERMS_MAX + 2];
        sum_02 = add_products(sum_02, a_0, b_2);
        sum_12 = add_products(sum_12, a_1, b_2);
        const uint32_t b_3 = b[k * TERMS_MAX + 3];
        sum_03 = add_products(sum_03, a_0, b_3);
        sum_13 = add_products(sum_13, a_1, b_3);
    }
    line[0][0] = changed(line[0][0], sum_00, shift, sign);
    line[0][1] = changed(line[0][1], sum_01, shift, sign);
    line[0][2] = changed(line[0][2], sum_02, shift, sign);
    line[0][3] = changed(line[0][3], sum_03, shift, sign);
    line[1][0] = changed(line[1][0], sum_10, shift, sign);
    line[1][1] = changed(line[1][1], sum_11, shift, sign);
    line[1][2] = changed(line[1][2], sum_12, shift, sign);
    line[1][3] = changed(line[1][3], sum_13, shift, sign);
}

/* The first `count` lines, an even number. */
static void add_lines(uint32_t word[PAIRS][TERMS_MAX], struct way way, int32_t count,
                      int32_t *normal)
{
    int32_t *line = normal;
    for (int32_t i = 0; i < count; i += 2) {
        const int32_t length = length_of(i);
        uint32_t factor[2 * PAIRS];
        for (int32_t k = 0; k < 2 * PAIRS; k++) {
            const uint32_t here = word[k / 2][i + k % 2];
            factor[k] = way.is_mixed ? turned(here) : here;
        }
        for (int32_t j = 0; j <= i; j += 4) {
            add_tile(factor, &word[0][j], way, (int32_t *const[2]){&line[j], &line[length + j]});
        }
        line = &line[2 * length];
    }
}

/* Line i by the first words. */
static void add_words(uint32_t word[PAIRS][TERMS_MAX], struct way way, int32_t words, int32_t i,
                      int32_t *line)
{
    for (int32_t j = 0; j <= i; j++) {
        uint32_t sum = way.begin;
        for (int32_t k = 0; k < words; k++) {
            sum = add_products(sum, way.is_mixed ? turned(word[k][i]) : word[k][i], word[k][j]);
        }
        line[j] = changed(line[j], sum, way.shift, sign_of(way));
    }
}

/* a * b / 2^step, which is below 2^32. */
static inline uint32_t scaled_by(uint32_t a, uint32_t b, int step)
{
    return (uint32_t)((uint64_t)a * b >> step);
}

#endif

/* A line of sums times two scales. */
static inline void scale_line(const int32_t *line, int32_t length, const uint32_t *scale,
                              uint32_t own_scale, int step, int32_t *scaled)
{
    for (int32_t j = 0; j < length; j++) {
        const uint32_t sum = (uint32_t)ih_max_s32(line[j], 0);
        scaled[j] = (int32_t)scaled_by(scaled_by(sum, own_scale, step), scale[j], step);
    }
}

/* What is left of a line, Q30, over its pivot: times its inverse, over 2^shift. */
IH_WRAPPING static void divide_line(int32_t *line, int32_t length, int32_t inverse, int shift)
{
    for (int32_t j = 0; j < length; j++) {
        line[j] = IH_WRAPS(int32_t, ih_mul_shift(line[j], inverse, shift));
    }
}

/* A row's upper parts, into a half of the words of a pair; in its place the row of the factor. With parts, the lower
 * parts stay there, and both are put into words. */
IH_WRAPPING static void split_line(int32_t *line, int32_t length, int enlarged, bool is_second,
                                   uint32_t *pair, uint32_t *parts)
{
    for (int32_t j = 0; j < length; j++) {
        const uint32_t value = IH_WRAPS(uint32_t, line[j]);
        const uint32_t upper =
            IH_WRAPS(uint32_t, IH_WRAPS(int32_t, value + LOWER_HALF) >> LOWER_BITS);
        const uint32_t half = upper & 0xffff;
        pair[j] = is_second ? pair[j] | half << 16 : half;
        if (parts != NULL) {
            const uint32_t lower = value - upper * (1u << LOWER_BITS);
            parts[j] = half | (lower & 0xffff) << 16;
        } else {
            line[j] = IH_WRAPS(int32_t, upper * (1u << (LOWER_BITS - enlarged)));
        }
    }
}

#endif

void ih_normal_equations_add(uint32_t pair[PAIRS][TERMS_MAX], int32_t term_count, int shift,
                             int32_t *normal)
{
    add_lines(pair, plain_way(shift, false), term_count, normal);
}

void ih_normal_equations_take(uint32_t pair[PAIRS][TERMS_MAX], int32_t term_count, int shift,
                              int32_t *normal)
{
    add_lines(pair, plain_way(shift, true), term_count, normal);
}

void ih_normal_equations_scale(const int32_t *normal, int32_t term_count, const uint32_t *scale,
                               int step, int32_t *scaled)
{
    for (int32_t i = 0; i < term_count; i++) {
        const int32_t at = ih_normal_equations_line(i);
        /* Behind the diagonal nothing is asked for: there may be no sums. */
        scale_line(&normal[at], WHOLE_LINES ? length_of(i) : i + 1, scale, scale[i], step,
                   &scaled[at]);
    }
}

/* Row p of the factor from what is left of line p: row number `at` of a block. What is left was enlarged by
 * 4^enlarged. */
static void finish_row(uint32_t work[IH_NORMAL_EQUATIONS_WORK][TERMS_MAX], int32_t at, int32_t p,
                       bool is_fine, int enlarged, int32_t *line)
{
    const int32_t square_q30 =
        ih_clamp_s32(line[p], IH_NORMAL_EQUATIONS_PIVOT_Q30 << (2 * enlarged), PIVOT_MAX_Q30);
    int32_t pivot = (int32_t)ih_isqrt_u54((uint64_t)square_q30 << (2 * FACTOR_BITS - 30));
    if (!is_fine) {
        pivot = ((pivot + LOWER_HALF) >> LOWER_BITS) << LOWER_BITS;
    }
    const int bits = ih_bits_u64((uint64_t)pivot);
    const int32_t inverse = (int32_t)(((int64_t)1 << (29 + bits)) / pivot);
    divide_line(line, length_of(p), inverse, bits + 29 - (2 * FACTOR_BITS - 30));
    line[p] = pivot;
    split_line(line, length_of(p), enlarged, at % 2 != 0, work[at / 2],
               is_fine ? work[PARTS + at] : NULL);
}

/* Enlarge the first `count` lines by a power of 4, so that 16 bits have more of them. Returns its logarithm. */
static int enlarge(int32_t count, int32_t *normal)
{
    int32_t max = IH_NORMAL_EQUATIONS_PIVOT_Q30;
    for (int32_t i = 0; i < count; i++) {
        max = ih_max_s32(max, normal[ih_normal_equations_line(i) + i]);
    }
    int enlarged = 0;
    while (max <= LEFT_MAX >> (2 * enlarged + 2)) {
        enlarged++;
    }
    for (int32_t k = 0; k < IH_NORMAL_EQUATIONS_LINE(count) && enlarged > 0; k++) {
        normal[k] = IH_WRAPS(int32_t, (int64_t)normal[k] * (1 << (2 * enlarged)));
    }
    return enlarged;
}

/* What a block's rows that are done take from line p. */
static void take_from_line(uint32_t work[IH_NORMAL_EQUATIONS_WORK][TERMS_MAX], bool is_fine,
                           int32_t done, int32_t p, int32_t *line)
{
    if (done > 0) {
        const int32_t mixed = is_fine ? (done + PAIRS - 1) / PAIRS : 0;
        add_words(work, upper_way(mixed), (done + 1) / 2, p, line);
    }
    for (int32_t at = 0; is_fine && at < done; at += PAIRS) {
        add_words(&work[PARTS + at], mixed_way(), ih_min_s32(done - at, PAIRS), p, line);
    }
}

/* What all of them take from the first `count` lines. */
static void take_from_lines(uint32_t work[IH_NORMAL_EQUATIONS_WORK][TERMS_MAX], bool is_fine,
                            int32_t count, int32_t *normal)
{
    add_lines(work, upper_way(is_fine ? BLOCK / PAIRS : 0), count, normal);
    for (int32_t at = 0; is_fine && at < BLOCK; at += PAIRS) {
        add_lines(&work[PARTS + at], mixed_way(), count, normal);
    }
}

bool ih_normal_equations_factor(int32_t term_count, int32_t fine_from, int32_t min_q30,
                                int32_t *line, uint32_t work[IH_NORMAL_EQUATIONS_WORK][TERMS_MAX])
{
    int enlarged = 0;
    bool is_good = true;
    for (int32_t first = term_count - BLOCK; first >= 0; first -= BLOCK) {
        const bool is_fine = first >= fine_from;
        for (int32_t at = 0; at < BLOCK; at++) {
            const int32_t p = first + BLOCK - 1 - at;
            int32_t *here = &line[ih_normal_equations_line(p)];
            take_from_line(work, is_fine, at, p, here);
            is_good &= here[p] >> (2 * enlarged) >= min_q30;
            finish_row(work, at, p, is_fine, enlarged, here);
        }
        take_from_lines(work, is_fine, first, line);
        if (first == fine_from) {
            enlarged = enlarge(first, line);
        }
    }
    return is_good;
}

/* Numbers of a matrix that was not positive may be great: sums wrap around then, and quotients are limited. */
__attribute__((noinline)) static int64_t quotient(int64_t rest, int32_t pivot)
{
    return ih_div_round(ih_clamp_s64(rest, (int64_t)1 << 62), pivot);
}

/* An unknown from what is left of the right side. */
static int32_t solved(uint64_t rest, int32_t pivot)
{
    return (int32_t)ih_clamp_s64(quotient(IH_WRAPS(int64_t, rest), pivot), INT32_MAX);
}

/* F^T v = b, in b's unit: v in b's place. */
IH_WRAPPING static void solve_first(const int32_t *line, int32_t term_count, int32_t *b)
{
    const int32_t last = term_count - 1;
    uint64_t rest[TERMS_MAX];
    for (int32_t k = 0; k <= last; k++) {
        rest[k] = IH_WRAPS(uint64_t, (int64_t)b[k] * (1 << FACTOR_BITS));
    }
    /* Two at a time: what is left is loaded and stored half as often. */
    for (int32_t p = last; p > 0; p -= 2) {
        const int32_t *row = &line[ih_normal_equations_line(p)],
                      *next = &line[ih_normal_equations_line(p - 1)];
        b[p] = solved(rest[p], row[p]);
        const int32_t less = -b[p];
        b[p - 1] =
            solved(rest[p - 1] + IH_WRAPS(uint64_t, (int64_t)row[p - 1] * less), next[p - 1]);
        const int32_t next_less = -b[p - 1];
        for (int32_t k = 0; k < p - 1; k++) {
            rest[k] += IH_WRAPS(uint64_t, (int64_t)row[k] * less) +
                       IH_WRAPS(uint64_t, (int64_t)next[k] * next_less);
        }
    }
}

IH_WRAPPING static int64_t dot(const int32_t *a, const int32_t *b, int32_t count)
{
    uint64_t sum = 0;
    for (int32_t k = 0; k < count; k++) {
        sum += IH_WRAPS(uint64_t, (int64_t)a[k] * b[k]);
    }
    return IH_WRAPS(int64_t, sum);
}

bool ih_normal_equations_solve(const int32_t *line, int32_t term_count, const int32_t *b,
                               int32_t *x_mantissa, int32_t *x_exponent)
{
    int exponent = 0;
    memmove(x_mantissa, b, (size_t)term_count * sizeof *b);
    solve_first(line, term_count, x_mantissa);
    for (int32_t p = 0; p < term_count; p++) { /* F x = v, in units of 2^exponent */
        const int32_t *row = &line[ih_normal_equations_line(p)];
        const int64_t v = ih_shift_round((int64_t)x_mantissa[p] * (1 << FACTOR_BITS), exponent);
        const int64_t taken = ih_clamp_s64(dot(row, x_mantissa, p), (int64_t)1 << 62);
        const int64_t value = quotient(v - taken, row[p]);
        const int grow = ih_max_s32(0, ih_bits_u64((uint64_t)ih_abs_s64(value)) - MANTISSA_BITS);
        if (grow > 0) { /* move the binary point of what is solved so far */
            exponent += grow;
            if (exponent > IH_NORMAL_EQUATIONS_EXPONENT_MAX) {
                return false;
            }
            for (int32_t k = 0; k < p; k++) {
                x_mantissa[k] = (int32_t)ih_shift_round(x_mantissa[k], grow);
            }
        }
        x_mantissa[p] = (int32_t)ih_shift_round(value, grow);
        IH_IN_RANGE(x_mantissa[p], -IH_RANGE_MANTISSA, IH_RANGE_MANTISSA);
    }
    IH_IN_RANGE(exponent, 0, IH_RANGE_EXPONENT);
    *x_exponent = exponent;
    return true;
}
