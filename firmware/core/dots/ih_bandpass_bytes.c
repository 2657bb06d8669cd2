#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_bandpass.h"
#include "dots/ih_bandpass_respond.h"
#include "simd/ih_simd_cortexm.h"

#define REACH IH_BANDPASS_REACH

#if IH_CORTEXM
#include "dots/ih_bandpass_cortexm.h"
#else
/* Sums of nine rows, and the 1-2-1 of the three in the middle. */
static void sum_rows(const uint8_t *const row[IH_BANDPASS_ROWS], int32_t width,
                     uint16_t *restrict inner, uint16_t *restrict column)
{
    const uint8_t *above = row[REACH - 1], *middle = row[REACH], *below = row[REACH + 1];
    const uint8_t *above_2 = row[REACH - 2], *above_3 = row[REACH - 3], *above_4 = row[REACH - 4];
    const uint8_t *below_2 = row[REACH + 2], *below_3 = row[REACH + 3], *below_4 = row[REACH + 4];
    for (int32_t u = 0; u < width; u++) {
        const uint16_t three = (uint16_t)(above[u] + middle[u] + below[u]);
        inner[u] = (uint16_t)(three + middle[u]);
        column[u] = (uint16_t)(three + above_2[u] + above_3[u] + above_4[u] + below_2[u] +
                               below_3[u] + below_4[u]);
    }
}

static void sum_threes(const uint16_t *column, int32_t count, uint16_t *restrict nine)
{
    for (int32_t i = 0; i < count; i++) {
        nine[i] = (uint16_t)(IH_BANDPASS_NINE_SIGN * (column[i] + column[i + 1] + column[i + 2]));
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
                       int32_t width, int16_t *response)
{
    uint16_t *inner = band->three[0];
    uint16_t *column = band->binomial[0];
    const int32_t count =
        (width + 2 * IH_BANDPASS_SIDE + IH_BANDPASS_STEP - 1) / IH_BANDPASS_STEP * IH_BANDPASS_STEP;
    struct ih_bandpass_row out = {.limit = NULL};
    out.response = response;
    band->width = width;
    band->is_bytes = true;
    sum_rows(row, width, &inner[1], &column[REACH]);
    repeat_edges(inner, width, 1, width + 2);
    repeat_edges(column, width, REACH, count + 2);
    sum_threes(column, count, band->nine.of_bytes);
    const struct ih_bandpass_rows rows = {
        .above = &inner[0], .middle = &inner[1], .below = &inner[2]};
    ih_bandpass_respond_bytes(&rows, band->nine.of_bytes, width, &out);
}
