#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "base/ih_config.h"
#include "dots/ih_bandpass.h"
#include "dots/ih_bandpass_respond.h"
#include "simd/ih_simd.h"
#include "simd/ih_simd_cortexm.h"

#define INNER IH_BANDPASS_INNER
#define OUTER IH_BANDPASS_OUTER
#define REACH IH_BANDPASS_REACH
#define LEAD IH_BANDPASS_LEAD

#if !IH_CORTEXM && IH_I16_LANES > 0
#define STEP IH_U8_LANES /* pixels of a vector of bytes */

/* Sums of nine rows of bytes, even and odd pixels apart: bytes need no widening. pair: an even pixel's sum
 * and the next one's. inner: 1-2-1 of the three rows in the middle. */
struct halves {
    uint16_t *even, *odd, *pair;
    uint16_t *inner_even, *inner_odd;
};

static inline ih_u16 load_pairs(const uint8_t *pixel)
{
    return (ih_u16)ih_u8_load(pixel);
}

/* A row above and one below join. Whole 16-bit lanes and their upper bytes are summed; the sum of the lower
 * bytes is their difference, as every sum of bytes is below 2^16. */
static inline void add_rows(const uint8_t *above, const uint8_t *below, ih_u16 *whole, ih_u16 *odd)
{
    const ih_u16 over = load_pairs(above);
    const ih_u16 under = load_pairs(below);
    *whole = *whole + over + under;
    *odd = *odd + (over >> 8) + (under >> 8);
}

/* STEP pixels from u on; u is even. */
static inline void sum_rows(const uint8_t *const *row, int32_t u, const struct halves *sums)
{
    const int32_t at = u / 2;
    const ih_u16 middle = load_pairs(&row[4][u]);
    const ih_u16 middle_odd = middle >> 8;
    ih_u16 whole = middle;
    ih_u16 odd = middle_odd;
    add_rows(&row[3][u], &row[5][u], &whole, &odd);
    const ih_u16 inner_odd = odd + middle_odd;
    ih_u16_store(&sums->inner_even[at], whole + middle - (inner_odd << 8));
    ih_u16_store(&sums->inner_odd[at], inner_odd);
    add_rows(&row[2][u], &row[6][u], &whole, &odd);
    add_rows(&row[1][u], &row[7][u], &whole, &odd);
    add_rows(&row[0][u], &row[8][u], &whole, &odd);
    const ih_u16 even = whole - (odd << 8);
    ih_u16_store(&sums->even[at], even);
    ih_u16_store(&sums->odd[at], odd);
    ih_u16_store(&sums->pair[at], even + odd);
}

/* (81 i + 8) / 16 - b; 81 / 16 is 8 * 20736 / 2^15. */
static inline ih_i16 respond_lanes(ih_u16 inner, ih_u16 box)
{
    return (ih_i16)(ih_u16_mul_round(inner << 3, ih_u16_all(INNER << 8)) - box);
}

/* R of STEP pixels from u on. */
static inline void respond_halves(const struct halves *sums, int32_t u, int16_t *response)
{
    const int32_t at = u / 2;
    const ih_u16 near = ih_u16_load(&sums->pair[at]) + ih_u16_load(&sums->pair[at - 1]) +
                        ih_u16_load(&sums->pair[at + 1]);
    const ih_u16 even_box =
        near + ih_u16_load(&sums->pair[at - 2]) + ih_u16_load(&sums->even[at + 2]);
    const ih_u16 odd_box =
        near + ih_u16_load(&sums->pair[at + 2]) + ih_u16_load(&sums->odd[at - 2]);
    const ih_u16 even = ih_u16_load(&sums->inner_even[at]);
    const ih_u16 odd = ih_u16_load(&sums->inner_odd[at]);
    const ih_u16 inner = even + odd;
    const ih_u16 even_inner = inner + even + ih_u16_load(&sums->inner_odd[at - 1]);
    const ih_u16 odd_inner = inner + odd + ih_u16_load(&sums->inner_even[at + 1]);
    ih_i16_store_zip(&response[u], respond_lanes(even_inner, even_box),
                     respond_lanes(odd_inner, odd_box));
}

/* Sums of the last column, repeated as far as vectors read. */
static void repeat_last(const uint8_t *const row[IH_BANDPASS_ROWS], int32_t width,
                        const struct halves *sums)
{
    const int32_t end = width / 2;
    uint16_t sum = 0;
    for (int32_t i = 0; i < IH_BANDPASS_ROWS; i++) {
        sum = (uint16_t)(sum + row[i][width - 1]);
    }
    for (int32_t i = 0; i < 2; i++) {
        sums->even[end + i] = sum;
        sums->pair[end + i] = (uint16_t)(2 * sum);
    }
    sums->inner_even[end] = (uint16_t)(row[REACH - 1][width - 1] + 2 * row[REACH][width - 1] +
                                       row[REACH + 1][width - 1]);
}

static void sum_halves(const uint8_t *const row[IH_BANDPASS_ROWS], int32_t width,
                       const struct halves *sums)
{
    const int32_t last = width / 2 * 2 - STEP; /* the last step ends with the row */
    const uint8_t *own[IH_BANDPASS_ROWS];      /* in registers: no store can change them */
    memcpy(own, row, sizeof own);
    sum_rows(own, 0, sums);
    for (int32_t i = 1; i <= 2; i++) { /* long before vectors read them: see ih_bandpass.c */
        sums->odd[-i] = sums->even[0];
        sums->pair[-i] = (uint16_t)(2 * sums->even[0]);
    }
    sums->inner_odd[-1] = sums->inner_even[0];
    for (int32_t u = STEP; u < last; u += STEP) {
        sum_rows(own, u, sums);
    }
    sum_rows(own, last, sums);
    repeat_last(row, width, sums);
}

void ih_bandpass_bytes(struct ih_bandpass *band, const uint8_t *const row[IH_BANDPASS_ROWS],
                       int32_t width, size_t prefetch, int16_t *response)
{
    const struct halves sums = {
        .even = &band->three[0][LEAD],
        .odd = &band->three[1][LEAD],
        .pair = &band->three[2][LEAD],
        .inner_even = &band->three[3][LEAD],
        .inner_odd = &band->three[4][LEAD],
    };
    const int32_t last = width / 2 * 2 - STEP;
    band->width = width;
    band->is_bytes = true;
    sum_halves(row, width, &sums);
    for (int32_t u = 0; u < last; u += STEP) {
        if (u % IH_LINE_BYTES == 0) {
            for (int32_t i = 0; i < IH_BANDPASS_ROWS;
                 i++) { /* no function: gcc 12 drops its calls */
                __builtin_prefetch(&row[i][prefetch + (size_t)u]);
            }
        }
        respond_halves(&sums, u, response);
    }
    respond_halves(&sums, last, response);
    if (width % 2 != 0) {
        const int32_t at = width / 2;
        const int32_t inner = 3 * sums.inner_even[at] + sums.inner_odd[at - 1];
        const int32_t box = sums.pair[at - 2] + sums.pair[at - 1] + 5 * sums.even[at];
        response[width - 1] = (int16_t)((INNER * inner + OUTER / 2) / OUTER - box);
    }
}
#else
#if IH_CORTEXM
#include "dots/ih_bandpass_cortexm.h"
#else
/* Sums of three rows, and their 1-2-1. */
static void sum_rows(const uint8_t *above, const uint8_t *middle, const uint8_t *below,
                     int32_t width, uint16_t *restrict inner, uint16_t *restrict column)
{
    for (int32_t u = 0; u < width; u++) {
        const uint16_t sum = (uint16_t)(above[u] + middle[u] + below[u]);
        inner[u] = (uint16_t)(sum + middle[u]);
        column[u] = sum;
    }
}

static void add_rows(const uint8_t *above, const uint8_t *below, int32_t width,
                     uint16_t *restrict column)
{
    for (int32_t u = 0; u < width; u++) {
        column[u] = (uint16_t)(column[u] + above[u] + below[u]);
    }
}

static void sum_threes(const uint16_t *column, int32_t count, uint16_t *restrict nine)
{
    for (int32_t i = 0; i < count; i++) {
        nine[i] = (uint16_t)(column[i] + column[i + 1] + column[i + 2]);
    }
}
#endif

/* Edge sums are repeated outside the row, as far as loops read. */
static void repeat_edges(uint16_t *sums, int32_t width, int32_t reach, int32_t end)
{
    for (int32_t i = 0; i < reach; i++) {
        sums[i] = sums[reach];
    }
    for (int32_t i = reach + width; i < end; i++) {
        sums[i] = sums[reach + width - 1];
    }
}

void ih_bandpass_bytes(struct ih_bandpass *band, const uint8_t *const row[IH_BANDPASS_ROWS],
                       int32_t width, size_t prefetch, int16_t *response)
{
    (void)prefetch;
    uint16_t *inner = band->three[0];
    uint16_t *column = band->binomial[0];
    const int32_t count =
        (width + 2 * IH_BANDPASS_SIDE + IH_BANDPASS_STEP - 1) / IH_BANDPASS_STEP * IH_BANDPASS_STEP;
    struct ih_bandpass_row out = {.response = response, .limit = NULL};
    band->width = width;
    band->is_bytes = true;
    sum_rows(row[REACH - 1], row[REACH], row[REACH + 1], width, &inner[1], &column[REACH]);
    for (int32_t i = 2; i <= REACH; i++) {
        add_rows(row[REACH - i], row[REACH + i], width, &column[REACH]);
    }
    repeat_edges(inner, width, 1, width + 2);
    repeat_edges(column, width, REACH, count + 2);
    sum_threes(column, count, band->nine.of_bytes);
    const struct ih_bandpass_rows rows = {
        .above = &inner[0], .middle = &inner[1], .below = &inner[2]};
    ih_bandpass_respond_bytes(&rows, band->nine.of_bytes, width, &out);
}
#endif
