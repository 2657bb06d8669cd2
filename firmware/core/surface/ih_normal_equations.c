#include "surface/ih_normal_equations.h"

#include <stddef.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "simd/ih_simd.h"
#include "simd/ih_simd_cortexm.h"

#define PAIRS IH_NORMAL_EQUATIONS_PAIRS
#define TERMS_MAX IH_NORMAL_EQUATIONS_TERMS_MAX
#define GROUP IH_NORMAL_EQUATIONS_GROUP

/* A block of the factor has this many rows. Its words: upper parts of two rows each, then both parts of each row. */
#define BLOCK IH_NORMAL_EQUATIONS_ROWS
#define PARTS PAIRS
/* A number of the factor has an upper part with 15 fraction bits, and a lower part with LOWER_BITS more. */
#define FACTOR_BITS IH_NORMAL_EQUATIONS_FACTOR_BITS
#define LOWER_BITS (FACTOR_BITS - 15)
#define LOWER_HALF (1 << (LOWER_BITS - 1))
/* The remainder behind the fine blocks is enlarged while it stays below this. */
#define ENLARGED_MAX 1030792151 /* 0.96 */
/* A remainder at a pivot is above this only if the matrix was not positive. Rounded to 16 bits its root stays below
 * 2^27, so quotients are shifted by at most 32. */
#define PIVOT_MAX_Q30 ((1 << 30) - (1 << 16))

_Static_assert(BLOCK % GROUP == 0, "all groups of whole blocks are whole");

/* How an entry changes by the sum of 8 words' products: begin + sum, without sign, over 2^shift, is added or
 * subtracted. */
struct update {
    uint32_t begin;
    int shift;
    bool is_subtracted;
    bool is_mixed; /* lower by upper halves, and upper by lower ones */
};

/* Sums of products without sign, rounded. */
static inline struct update rounded_update(int shift, bool is_subtracted)
{
    return (struct update){(uint32_t)1 << (shift - 1), shift, is_subtracted, false};
}

/* A word has both parts of a row; rounded. The sum has a sign: 2^31 keeps it from being negative, and MIXED_EXCESS of
 * that remains. */
#define MIXED_EXCESS ((uint32_t)1 << (31 - LOWER_BITS))

static inline struct update mixed_update(void)
{
    return (struct update){((uint32_t)1 << 31) + LOWER_HALF, LOWER_BITS, true, true};
}

/* A word has upper parts of two rows. The excess of `mixed` mixed sums is added back. */
IH_WRAPPING static inline struct update upper_update(int32_t mixed)
{
    return (struct update){0 - (uint32_t)mixed * MIXED_EXCESS, 0, true, false};
}

/* Entries of line i, with its padding. */
static inline int32_t length_of(int32_t i)
{
    return (i | (GROUP - 1)) + 1;
}

int32_t ih_normal_equations_line(int32_t i)
{
    /* IH_NORMAL_EQUATIONS_LINE() of its group, and one length for each line before it there. */
    return (length_of(i) >> 1) * (i + (i & (GROUP - 1)));
}

static inline uint32_t swap_halves(uint32_t word)
{
    return (word & 0xffff) << 16 | word >> 16;
}

/* The word that multiplies those of a line. */
static inline uint32_t factor_of(struct update update, uint32_t word)
{
    return update.is_mixed ? swap_halves(word) : word;
}

#if !IH_CORTEXM && IH_I16_LANES > 0

#define HAS_WHOLE_LINES 1

static inline ih_i16 load_words(const uint32_t *word)
{
    return ih_i16_load_aligned((const void *)word);
}

/* Lines that are updated together, so that each word is loaded once for them: as many as registers hold factors of. */
#define TOGETHER (IH_SIMD_REGISTERS / 16)

/* Update lines i to i + lines - 1, of one length, by the first words. */
__attribute__((always_inline)) static inline void update_together(uint32_t word[PAIRS][TERMS_MAX],
                                                                  struct update update,
                                                                  int32_t words, int32_t i,
                                                                  int32_t lines, int32_t *line)
{
    const ih_i32 begin = ih_i32_all((int32_t)update.begin);
    const int32_t length = length_of(i);
    ih_i16 factor[TOGETHER][PAIRS];
    for (int32_t k = 0; k < words; k++) {
        for (int32_t n = 0; n < lines; n++) {
            factor[n][k] = (ih_i16)ih_i32_all((int32_t)factor_of(update, word[k][i + n]));
        }
    }
    for (int32_t j = 0; j < length; j += IH_I32_LANES) {
        struct ih_pair_sums sums[TOGETHER];
        for (int32_t n = 0; n < lines; n++) {
            sums[n] = ih_pair_sums_first(factor[n][0], load_words(&word[0][j]));
        }
        for (int32_t k = 1; k < words; k++) {
            for (int32_t n = 0; n < lines; n++) {
                sums[n] = ih_pair_sums_add(sums[n], factor[n][k], load_words(&word[k][j]));
            }
        }
        for (int32_t n = 0; n < lines; n++) {
            int32_t *to = &line[n * length + j];
            const ih_u32 total = (ih_u32)ih_i32_add(ih_pair_sums_total(sums[n]), begin);
            const ih_i32 change = (ih_i32)ih_u32_shift_right(total, update.shift);
            const ih_i32 before = ih_i32_load(to);
            ih_i32_store(to, update.is_subtracted ? ih_i32_sub(before, change)
                                                  : ih_i32_add(before, change));
        }
    }
}

static inline void update_line(uint32_t word[PAIRS][TERMS_MAX], struct update update, int32_t words,
                               int32_t i, int32_t *line)
{
    update_together(word, update, words, i, 1, line);
}

/* Update the first `count` lines. Inlined: each update has code of its own. */
__attribute__((always_inline)) static inline void
update_lines(uint32_t word[PAIRS][TERMS_MAX], struct update update, int32_t count, int32_t *normal)
{
    int32_t *line = normal;
    for (int32_t i = 0; i < count; i += TOGETHER) {
        update_together(word, update, PAIRS, i, TOGETHER, line);
        line = &line[TOGETHER * length_of(i)];
    }
}

/* A line of sums times two scales. */
static inline void scale_line(const int32_t *line, int32_t length, const uint32_t *scale,
                              uint32_t own_scale, int step, int32_t *scaled)
{
    const ih_u32 own = (ih_u32)ih_i32_all((int32_t)own_scale);
    for (int32_t j = 0; j < length; j += IH_I32_LANES) {
        const ih_i32 sum = ih_i32_load(&line[j]);
        const ih_u32 positive = (ih_u32)(sum & ~ih_i32_shift_right(sum, 31));
        const ih_u32 other = (ih_u32)ih_i32_load((const int32_t *)&scale[j]);
        const ih_u32 once = ih_wide_low(ih_wide_shift_right(ih_u32_mul_wide(positive, own), step));
        ih_i32_store(&scaled[j],
                     (ih_i32)ih_wide_low(ih_wide_shift_right(ih_u32_mul_wide(once, other), step)));
    }
}

/* Divide the remainder of a line, Q30, by its pivot: times its inverse, over 2^shift, at most 32. So the lower halves
 * are right without the sign, too. */
static inline void divide_line(int32_t *line, int32_t length, int32_t inverse, int shift)
{
    const ih_i32 factor = ih_i32_all(inverse);
    const struct ih_wide half = ih_wide_all((int64_t)1 << (shift - 1));
    for (int32_t j = 0; j < length; j += IH_I32_LANES) {
        const struct ih_wide product = ih_i32_mul_wide(ih_i32_load(&line[j]), factor);
        ih_i32_store(&line[j],
                     (ih_i32)ih_wide_low(ih_wide_shift_right(ih_wide_add(product, half), shift)));
    }
}

/* Split a row into parts: the upper ones fill a half of the words of a pair, and replace the row. With `parts` the row
 * stays as it is, and both parts fill words. */
static void split_line(int32_t *line, int32_t length, int enlarged, bool is_second, uint32_t *pair,
                       uint32_t *parts)
{
    const ih_i32 lower_half = ih_i32_all(LOWER_HALF), mask = ih_i32_all(0xffff);
    for (int32_t j = 0; j < length; j += IH_I32_LANES) {
        const ih_i32 value = ih_i32_load(&line[j]);
        const ih_i32 upper = ih_i32_shift_right(ih_i32_add(value, lower_half), LOWER_BITS);
        const ih_i32 half = upper & mask;
        int32_t *to = (int32_t *)&pair[j];
        ih_i32_store(to, is_second ? ih_i32_load(to) | ih_i32_shift_left(half, 16) : half);
        if (parts != NULL) {
            const ih_i32 lower = ih_i32_sub(value, ih_i32_shift_left(upper, LOWER_BITS));
            ih_i32_store((int32_t *)&parts[j], half | ih_i32_shift_left(lower, 16));
        } else {
            ih_i32_store(&line[j], ih_i32_shift_left(upper, LOWER_BITS - enlarged));
        }
    }
}

#else

#define HAS_WHOLE_LINES 0

/* 1, or all ones to subtract. */
static inline uint32_t sign_of(struct update update)
{
    return update.is_subtracted ? UINT32_MAX : 1;
}

IH_WRAPPING static inline int32_t changed(int32_t entry, uint32_t sum, int shift, uint32_t sign)
{
    return IH_WRAPS(int32_t, IH_WRAPS(uint32_t, entry) + (sum >> shift) * sign);
}

/* 32-bit ARM has the same products of pairs. */
#if IH_CORTEXM || defined __ARM_FEATURE_SIMD32
#include "surface/ih_normal_equations_cortexm.h"
#else

/* Update entries of two lines and four columns. */
static inline void update_tile(const uint32_t *a, const uint32_t *b, struct update update,
                               int32_t *const line[2])
{
    const int shift = update.shift;
    const uint32_t sign = sign_of(update);
    uint32_t sum_00 = update.begin, sum_01 = sum_00, sum_02 = sum_00, sum_03 = sum_00;
    uint32_t sum_10 = sum_00, sum_11 = sum_00, sum_12 = sum_00, sum_13 = sum_00;
    for (int32_t k = 0; k < PAIRS; k++) {
        const uint32_t a_0 = a[2 * k], a_1 = a[2 * k + 1];
        const uint32_t b_0 = b[k * TERMS_MAX];
        sum_00 = ih_word_madd(sum_00, a_0, b_0);
        sum_10 = ih_word_madd(sum_10, a_1, b_0);
        const uint32_t b_1 = b[k * TERMS_MAX + 1];
        sum_01 = ih_word_madd(sum_01, a_0, b_1);
        sum_11 = ih_word_madd(sum_11, a_1, b_1);
        const uint32_t b_2 = b[k * TERMS_MAX + 2];
        sum_02 = ih_word_madd(sum_02, a_0, b_2);
        sum_12 = ih_word_madd(sum_12, a_1, b_2);
        const uint32_t b_3 = b[k * TERMS_MAX + 3];
        sum_03 = ih_word_madd(sum_03, a_0, b_3);
        sum_13 = ih_word_madd(sum_13, a_1, b_3);
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

/* Update the first `count` lines, an even number. */
static void update_lines(uint32_t word[PAIRS][TERMS_MAX], struct update update, int32_t count,
                         int32_t *normal)
{
    int32_t *line = normal;
    for (int32_t i = 0; i < count; i += 2) {
        const int32_t length = length_of(i);
        uint32_t factor[2 * PAIRS];
        for (int32_t k = 0; k < 2 * PAIRS; k++) {
            const uint32_t here = word[k / 2][i + k % 2];
            factor[k] = factor_of(update, here);
        }
        for (int32_t j = 0; j <= i; j += 4) {
            update_tile(factor, &word[0][j], update,
                        (int32_t *const[2]){&line[j], &line[length + j]});
        }
        line = &line[2 * length];
    }
}

/* Update line i by the first words. */
static void update_line(uint32_t word[PAIRS][TERMS_MAX], struct update update, int32_t words,
                        int32_t i, int32_t *line)
{
    for (int32_t j = 0; j <= i; j++) {
        uint32_t sum = update.begin;
        for (int32_t k = 0; k < words; k++) {
            sum = ih_word_madd(sum, factor_of(update, word[k][i]), word[k][j]);
        }
        line[j] = changed(line[j], sum, update.shift, sign_of(update));
    }
}

/* a * b / 2^step, below 2^32. */
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

/* Divide the remainder of a line, Q30, by its pivot: times its inverse, over 2^shift. */
IH_WRAPPING static void divide_line(int32_t *line, int32_t length, int32_t inverse, int shift)
{
    for (int32_t j = 0; j < length; j++) {
        line[j] = IH_WRAPS(int32_t, ih_mul_shift(line[j], inverse, shift));
    }
}

/* Split a row into parts: the upper ones fill a half of the words of a pair, and replace the row. With `parts` the row
 * stays as it is, and both parts fill words. */
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
    update_lines(pair, rounded_update(shift, false), term_count, normal);
}

void ih_normal_equations_subtract(uint32_t pair[PAIRS][TERMS_MAX], int32_t term_count, int shift,
                                  int32_t *normal)
{
    update_lines(pair, rounded_update(shift, true), term_count, normal);
}

void ih_normal_equations_scale(const int32_t *normal, int32_t term_count, const uint32_t *scale,
                               int step, int32_t *scaled)
{
    for (int32_t i = 0; i < term_count; i++) {
        const int32_t at = ih_normal_equations_line(i);
        /* Padding is not needed, and may be uninitialised: only vectors scale it. */
        scale_line(&normal[at], HAS_WHOLE_LINES ? length_of(i) : i + 1, scale, scale[i], step,
                   &scaled[at]);
    }
}

/* Row p of the factor, number `at` of its block, from the remainder of line p, which was enlarged by 4^enlarged. */
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

/* Enlarge the first `count` lines by a power of 4, so that 16 bits have more of them. Returns its logarithm to base
 * 4. */
static int enlarge(int32_t count, int32_t *normal)
{
    int32_t max = IH_NORMAL_EQUATIONS_PIVOT_Q30;
    for (int32_t i = 0; i < count; i++) {
        max = ih_max_s32(max, normal[ih_normal_equations_line(i) + i]);
    }
    int enlarged = 0;
    while (max <= ENLARGED_MAX >> (2 * enlarged + 2)) {
        enlarged++;
    }
    for (int32_t k = 0; k < IH_NORMAL_EQUATIONS_LINE(count) && enlarged > 0; k++) {
        normal[k] = IH_WRAPS(int32_t, (int64_t)normal[k] * (1 << (2 * enlarged)));
    }
    return enlarged;
}

/* Subtract from line p what the block's rows that are done contribute. */
static void subtract_from_line(uint32_t work[IH_NORMAL_EQUATIONS_WORK][TERMS_MAX], bool is_fine,
                               int32_t done, int32_t p, int32_t *line)
{
    if (done > 0) {
        const int32_t mixed = is_fine ? (done + PAIRS - 1) / PAIRS : 0;
        update_line(work, upper_update(mixed), (done + 1) / 2, p, line);
    }
    for (int32_t at = 0; is_fine && at < done; at += PAIRS) {
        update_line(&work[PARTS + at], mixed_update(), ih_min_s32(done - at, PAIRS), p, line);
    }
}

/* Subtract from the first `count` lines what a whole block contributes. */
static void subtract_from_lines(uint32_t work[IH_NORMAL_EQUATIONS_WORK][TERMS_MAX], bool is_fine,
                                int32_t count, int32_t *normal)
{
    update_lines(work, upper_update(is_fine ? BLOCK / PAIRS : 0), count, normal);
    for (int32_t at = 0; is_fine && at < BLOCK; at += PAIRS) {
        update_lines(&work[PARTS + at], mixed_update(), count, normal);
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
            subtract_from_line(work, is_fine, at, p, here);
            is_good &= here[p] >> (2 * enlarged) >= min_q30;
            finish_row(work, at, p, is_fine, enlarged, here);
        }
        subtract_from_lines(work, is_fine, first, line);
        if (first == fine_from) {
            enlarged = enlarge(first, line);
        }
    }
    return is_good;
}
