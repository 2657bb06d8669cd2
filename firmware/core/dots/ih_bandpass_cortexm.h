/* ih_bandpass_cortexm - the band-pass's kernels for a Cortex-M, two pixels in a word.
 *
 * Loops are unrolled by hand: gcc 12 does not unroll at -O2.
 */
#ifndef IH_BANDPASS_CORTEXM_H
#define IH_BANDPASS_CORTEXM_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_fix.h"
#include "dots/ih_bandpass.h"
#include "dots/ih_bandpass_respond.h"
#include "simd/ih_simd_cortexm.h"

/* Four pixels, the second to the fifth of p0 .. p5. */
static inline void take_four(const uint8_t *pixel, uint16_t *three, uint16_t *binomial,
                             uint16_t *nine)
{
    const uint32_t p0123 = ih_word_load_u8(pixel);
    const uint32_t p2345 = ih_word_load_u8(&pixel[2]);
    const uint32_t p13 = ih_word_odd(p0123);
    const uint32_t pair = ih_word_add_even(p13, p2345); /* p1 + p2, p3 + p4 */
    const uint32_t even = ih_word_add_even(pair, p0123);
    const uint32_t odd = ih_word_add_odd(pair, p2345);
    const uint32_t even_binomial = even + p13;
    const uint32_t odd_binomial = ih_word_add_even(odd, p2345);
    const uint32_t low = ih_word_zip_low(even, odd);
    const uint32_t high = ih_word_zip_high(even, odd);
    ih_word_store(ih_word_load(nine) + low - ih_word_load(three), nine);
    ih_word_store(ih_word_load(&nine[2]) + high - ih_word_load(&three[2]), &nine[2]);
    ih_word_store(low, three);
    ih_word_store(high, &three[2]);
    ih_word_store(ih_word_zip_low(even_binomial, odd_binomial), binomial);
    ih_word_store(ih_word_zip_high(even_binomial, odd_binomial), &binomial[2]);
}

static inline void take_bytes(const uint8_t *pixel, int32_t count, uint16_t *restrict three,
                              uint16_t *restrict binomial, uint16_t *restrict nine)
{
    for (int32_t i = 0; i < count; i += 8) {
        take_four(&pixel[i], &three[i], &binomial[i], &nine[i]);
        take_four(&pixel[i + 4], &three[i + 4], &binomial[i + 4], &nine[i + 4]);
    }
}

/* Sums of eight rows are below 2^13: with the limit below 2^13 the sign bit is set above it. */
static inline bool is_any_eight_above(const uint16_t *nine, const uint16_t *oldest, int32_t count,
                                      int32_t limit)
{
    const uint32_t min = IH_WORD_ALL(0x7fff - ih_clamp_s32(limit, 0, 0x1fff));
    uint32_t any = 0;
    for (int32_t i = 0; i < count; i += 4) {
        any |= ih_word_load(&nine[i]) - ih_word_load(&oldest[i]) + min;
        any |= ih_word_load(&nine[i + 2]) - ih_word_load(&oldest[i + 2]) + min;
    }
    return (any & IH_WORD_SIGNS) != 0;
}

/* R of two pixels. */
static inline void respond_two(const struct ih_bandpass_rows *rows, const uint16_t *nine, int32_t u,
                               uint32_t mask, int16_t *response)
{
    const uint32_t sum = ih_word_load(&rows->above[u]) + 2 * ih_word_load(&rows->middle[u]) +
                         ih_word_load(&rows->below[u]);
    const uint32_t sixteenth =
        (sum + IH_WORD_ALL(IH_BANDPASS_OUTER / 2)) / IH_BANDPASS_OUTER & mask;
    const uint32_t box = ih_word_load(&nine[u]) + ih_word_load(&nine[u + IH_BANDPASS_SIDE]) +
                         ih_word_load(&nine[u + 2 * IH_BANDPASS_SIDE]);
    const uint32_t inner = IH_BANDPASS_INNER / IH_BANDPASS_OUTER * sum + sixteenth;
    ih_word_store(ih_word_sub(inner, box), &response[u]);
}

static inline void respond_bytes(const struct ih_bandpass_rows *rows, const uint16_t *nine,
                                 int32_t first, int32_t width, int16_t *restrict response)
{
    const struct ih_bandpass_rows in = *rows;
    const uint32_t mask = ih_word_in_register(IH_WORD_ALL(0x0fff)); /* the shift is then free */
    int32_t u = first;
    for (; u + 8 <= width; u += 8) {
        respond_two(&in, nine, u, mask, response);
        respond_two(&in, nine, u + 2, mask, response);
        respond_two(&in, nine, u + 4, mask, response);
        respond_two(&in, nine, u + 6, mask, response);
    }
    while (u < width) { /* the last pair ends with the row */
        respond_two(&in, nine, ih_min_s32(u, width - 2), mask, response);
        u += 2;
    }
}

static inline bool is_any_of_16_above(const int16_t *response, uint32_t limit)
{
    uint32_t above = ih_word_below(limit, ih_word_load(response));
    above |= ih_word_below(limit, ih_word_load(&response[2]));
    above |= ih_word_below(limit, ih_word_load(&response[4]));
    above |= ih_word_below(limit, ih_word_load(&response[6]));
    above |= ih_word_below(limit, ih_word_load(&response[8]));
    above |= ih_word_below(limit, ih_word_load(&response[10]));
    above |= ih_word_below(limit, ih_word_load(&response[12]));
    above |= ih_word_below(limit, ih_word_load(&response[14]));
    return (above & IH_WORD_SIGNS) != 0;
}

static inline bool is_any_above(const int16_t *response, int16_t limit)
{
    const uint32_t word = IH_WORD_ALL(limit);
    return is_any_of_16_above(response, word) || is_any_of_16_above(&response[16], word);
}

/* Sums of three rows, and their 1-2-1. */
static inline void sum_three_rows(const uint8_t *above, const uint8_t *middle, const uint8_t *below,
                                  int32_t width, uint16_t *restrict inner,
                                  uint16_t *restrict column)
{
    int32_t u = 0;
    for (; u + 4 <= width; u += 4) {
        const uint32_t over = ih_word_load_u8(&above[u]);
        const uint32_t here = ih_word_load_u8(&middle[u]);
        const uint32_t under = ih_word_load_u8(&below[u]);
        const uint32_t even = ih_word_even(here);
        const uint32_t odd = ih_word_odd(here);
        const uint32_t even_sum = ih_word_add_even(ih_word_add_even(even, over), under);
        const uint32_t odd_sum = ih_word_add_odd(ih_word_add_odd(odd, over), under);
        const uint32_t even_inner = even_sum + even;
        const uint32_t odd_inner = odd_sum + odd;
        ih_word_store(ih_word_zip_low(even_inner, odd_inner), &inner[u]);
        ih_word_store(ih_word_zip_high(even_inner, odd_inner), &inner[u + 2]);
        ih_word_store(ih_word_zip_low(even_sum, odd_sum), &column[u]);
        ih_word_store(ih_word_zip_high(even_sum, odd_sum), &column[u + 2]);
    }
    for (; u < width; u++) {
        column[u] = (uint16_t)(above[u] + middle[u] + below[u]);
        inner[u] = (uint16_t)(column[u] + middle[u]);
    }
}

static inline void add_rows(const uint8_t *above, const uint8_t *below, int32_t width,
                            uint16_t *restrict column)
{
    int32_t u = 0;
    for (; u + 4 <= width; u += 4) {
        const uint32_t over = ih_word_load_u8(&above[u]);
        const uint32_t under = ih_word_load_u8(&below[u]);
        const uint32_t even = ih_word_add_even(ih_word_even(over), under);
        const uint32_t odd = ih_word_add_odd(ih_word_odd(over), under);
        ih_word_store(ih_word_load(&column[u]) + ih_word_zip_low(even, odd), &column[u]);
        ih_word_store(ih_word_load(&column[u + 2]) + ih_word_zip_high(even, odd), &column[u + 2]);
    }
    for (; u < width; u++) {
        column[u] = (uint16_t)(column[u] + above[u] + below[u]);
    }
}

/* Sums of nine rows, and the 1-2-1 of the three in the middle. */
static inline void sum_rows(const uint8_t *const row[IH_BANDPASS_ROWS], int32_t width,
                            uint16_t *restrict inner, uint16_t *restrict column)
{
    const int32_t middle = IH_BANDPASS_REACH;
    sum_three_rows(row[middle - 1], row[middle], row[middle + 1], width, inner, column);
    for (int32_t i = 2; i <= IH_BANDPASS_REACH; i++) {
        add_rows(row[middle - i], row[middle + i], width, column);
    }
}

static inline void sum_threes(const uint16_t *column, int32_t count, uint16_t *restrict nine)
{
    for (int32_t i = 0; i < count; i += 2) {
        ih_word_store(ih_word_load(&column[i]) + ih_word_load(&column[i + 1]) +
                          ih_word_load(&column[i + 2]),
                      &nine[i]);
    }
}

#endif
