/* ih_normal_equations_cortexm - updates of the normal equations with a Cortex-M's products of pairs.
 *
 * A part of ih_normal_equations.c, which has what it uses.
 */
#ifndef IH_NORMAL_EQUATIONS_CORTEXM_H
#define IH_NORMAL_EQUATIONS_CORTEXM_H

#include "simd/ih_simd_cortexm.h"

/* No load moves across this; it is no instruction. Compilers load everything early, and then have no registers for the
 * sums. */
#define IN_ORDER() __atomic_signal_fence(__ATOMIC_SEQ_CST)

/* Words of four columns, and how entries change by the sums of their products: begin + sum over 2^shift, times `sign`,
 * is added. */
struct panel {
    uint32_t column[4 * PAIRS];
    uint32_t begin, sign;
    int shift;
    int32_t *line;
};

/* Change two entries by their sums. */
static inline void change(int32_t *entry, uint32_t sum_0, uint32_t sum_1, int shift, uint32_t sign)
{
    const int32_t first = entry[0], second = entry[1];
    IN_ORDER();
    entry[0] = changed(first, sum_0, shift, sign);
    entry[1] = changed(second, sum_1, shift, sign);
    IN_ORDER();
}

/* Update four columns from line i on, two lines at a time: as many sums as a Cortex-M holds in registers. own: the
 * lines' words. noinline: once inlined, the compiler keeps the panel in registers and spills it. */
__attribute__((noinline)) static void update_panel(const uint32_t *own, struct panel *panel,
                                                   int32_t i, int32_t count)
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
                sum_00 = ih_word_madd(sum_00, a_0, b_0);
                sum_10 = ih_word_madd(sum_10, a_1, b_0);
                sum_01 = ih_word_madd(sum_01, a_0, b_1);
                sum_11 = ih_word_madd(sum_11, a_1, b_1);
                IN_ORDER();
                const uint32_t b_2 = column[2], b_3 = column[3];
                IN_ORDER();
                sum_02 = ih_word_madd(sum_02, a_0, b_2);
                sum_12 = ih_word_madd(sum_12, a_1, b_2);
                sum_03 = ih_word_madd(sum_03, a_0, b_3);
                sum_13 = ih_word_madd(sum_13, a_1, b_3);
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

/* Update the first `count` lines, whole groups. */
__attribute__((noinline)) static void
update_lines(uint32_t word[PAIRS][TERMS_MAX], struct update update, int32_t count, int32_t *normal)
{
    for (int32_t j = 0; j < count; j += 4) {
        struct panel panel;
        for (int32_t k = 0; k < PAIRS; k++) {
            const uint32_t *from = &word[k][j];
            uint32_t *to = &panel.column[4 * k];
            IN_ORDER();
            uint32_t w_0 = from[0], w_1 = from[1], w_2 = from[2], w_3 = from[3];
            IN_ORDER();
            if (update.is_mixed) {
                w_0 = swap_halves(w_0);
                w_1 = swap_halves(w_1);
                w_2 = swap_halves(w_2);
                w_3 = swap_halves(w_3);
            }
            to[0] = w_0;
            to[1] = w_1;
            to[2] = w_2;
            to[3] = w_3;
        }
        panel.begin = update.begin;
        panel.sign = sign_of(update);
        panel.shift = update.shift;
        panel.line = &normal[ih_normal_equations_line(j) + j];
        update_panel(&word[0][j], &panel, j, count);
    }
}

/* Update line i by the first words, with the padding of its last four entries. */
static void update_line(uint32_t word[PAIRS][TERMS_MAX], struct update update, int32_t words,
                        int32_t i, int32_t *line)
{
    const int shift = update.shift;
    const uint32_t sign = sign_of(update);
    uint32_t own[PAIRS];
    for (int32_t k = 0; k < words; k++) {
        own[k] = factor_of(update, word[k][i]);
    }
    for (int32_t j = 0; j <= i; j += 4) {
        const uint32_t *other = &word[0][j];
        uint32_t sum_0 = update.begin, sum_1 = sum_0, sum_2 = sum_0, sum_3 = sum_0;
        for (int32_t k = 0; k < words; k++) {
            const uint32_t a = own[k];
            IN_ORDER();
            const uint32_t b_0 = other[0], b_1 = other[1], b_2 = other[2], b_3 = other[3];
            IN_ORDER();
            sum_0 = ih_word_madd(sum_0, a, b_0);
            sum_1 = ih_word_madd(sum_1, a, b_1);
            sum_2 = ih_word_madd(sum_2, a, b_2);
            sum_3 = ih_word_madd(sum_3, a, b_3);
            other = &other[TERMS_MAX];
        }
        change(&line[j], sum_0, sum_1, shift, sign);
        change(&line[j + 2], sum_2, sum_3, shift, sign);
    }
}

/* a * b / 2^step, below 2^32; step 1..31. A shift of 64 bits would need code for 32 and more. */
static inline uint32_t scaled_by(uint32_t a, uint32_t b, int step)
{
    const uint64_t product = (uint64_t)a * b;
    return (uint32_t)(product >> 32) << (32 - step) | (uint32_t)(product & UINT32_MAX) >> step;
}

#endif
