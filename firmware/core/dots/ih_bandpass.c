#include "dots/ih_bandpass.h"

#include <string.h>

#include "base/ih_fix.h"
#include "dots/ih_bandpass_respond.h"
#include "simd/ih_simd.h"
#include "simd/ih_simd_cortexm.h"

/* Index of pixel 0 in a row of sums. */
#define LEAD IH_BANDPASS_LEAD
/* Index of the first sum, that of pixel -IH_BANDPASS_SIDE or before it, where a vector or a word begins. */
#if IH_I16_LANES > 0
#define FIRST ((LEAD - IH_BANDPASS_SIDE) / IH_I16_LANES * IH_I16_LANES)
#else
#define FIRST (LEAD - IH_BANDPASS_REACH)
#endif

/* Index behind the last sum of a row: whole steps. */
static int32_t end_of(const struct ih_bandpass *band)
{
    const int32_t needed = band->width + LEAD + IH_BANDPASS_SIDE - FIRST;
    return FIRST + (needed + IH_BANDPASS_STEP - 1) / IH_BANDPASS_STEP * IH_BANDPASS_STEP;
}

void ih_bandpass_begin(struct ih_bandpass *band, int32_t width, bool is_bytes)
{
    band->width = width;
    band->rows_in = 0;
    band->is_bytes = is_bytes;
    const size_t count = (size_t)end_of(band);
    for (int32_t row = 0; row < IH_BANDPASS_ROWS; row++) {
        memset(band->three[row], 0, count * sizeof band->three[0][0]);
    }
    memset(&band->nine, 0,
           count * (is_bytes ? sizeof band->nine.of_bytes[0] : sizeof band->nine.of_grey_q4[0]));
}

/* The ring's row for the newest scanline. */
static uint16_t *three_of(struct ih_bandpass *band)
{
    return band->three[(uint32_t)band->rows_in % IH_BANDPASS_ROWS];
}

/* The same of 1-2-1 sums; ago: scanlines before the newest. */
static uint16_t *binomial_of(struct ih_bandpass *band, int32_t ago)
{
    return band->binomial[(uint32_t)(band->rows_in + IH_BANDPASS_KEPT - ago) % IH_BANDPASS_KEPT];
}

/* take_bytes: a row joins the sums of nine, and the row whose position in the ring it takes leaves them. The
 * first sum is that of pixel[0] to pixel[2]; count is a multiple of IH_BANDPASS_STEP.
 * is_any_eight_above: is a sum of nine rows without the oldest above the limit? */
#if IH_CORTEXM
#include "dots/ih_bandpass_cortexm.h"
#elif IH_I16_LANES > 0
/* A sum of three is stored before it is used: NEON need not copy it then. */
static void take_bytes(const uint8_t *restrict pixel, int32_t count, uint16_t *restrict three,
                       uint16_t *restrict binomial, uint16_t *restrict nine)
{
    const uint8_t *left = pixel, *middle = &pixel[1], *right = &pixel[2];
    const uint16_t *oldest = three, *before = nine;
    uint16_t *to_three = three, *to_binomial = binomial, *to_nine = nine;
    for (int32_t i = 0; i < count; i += IH_BANDPASS_STEP) {
        const struct ih_u16_32 here = ih_u16_32_next_u8(&middle, i);
        struct ih_u16_32 sum = ih_u16_32_add(ih_u16_32_next_u8(&left, i), here);
        sum = ih_u16_32_add(sum, ih_u16_32_next_u8(&right, i));
        const struct ih_u16_32 leaving = ih_u16_32_next(&oldest, i);
        ih_u16_32_put(&to_three, i, &sum);
        struct ih_u16_32 all =
            ih_u16_32_add(ih_u16_32_sub(leaving, sum), ih_u16_32_next(&before, i));
        ih_u16_32_put(&to_nine, i, &all);
        struct ih_u16_32 twice = ih_u16_32_add(sum, here);
        ih_u16_32_put(&to_binomial, i, &twice);
    }
}

/* Sums of eight rows are below 2^13: lanes with a sign will do. */
static bool is_any_eight_above(const uint16_t *nine, const uint16_t *oldest, int32_t count,
                               int32_t limit)
{
    ih_i16 min = {0};
    for (int32_t i = 0; i < count; i += IH_BANDPASS_STEP) {
        const struct ih_u16_32 all = ih_u16_32_next(&nine, i);
        const struct ih_u16_32 eight = ih_u16_32_add(all, ih_u16_32_next(&oldest, i));
        for (int32_t k = 0; k < IH_U16_PARTS; k++) {
            min = ih_i16_min(min, (ih_i16)eight.part[k]);
        }
    }
    return ih_i16_any_above(ih_i16_negate(min), (int16_t)ih_clamp_s32(limit, 0, INT16_MAX));
}
#else
static void take_bytes(const uint8_t *pixel, int32_t count, uint16_t *restrict three,
                       uint16_t *restrict binomial, uint16_t *restrict nine)
{
    for (int32_t i = 0; i < count; i++) {
        const uint16_t middle = pixel[i + 1];
        const uint16_t sum = (uint16_t)(pixel[i] + middle + pixel[i + 2]);
        nine[i] = (uint16_t)(nine[i] + sum - three[i]);
        three[i] = sum;
        binomial[i] = (uint16_t)(sum + middle);
    }
}

static bool is_any_eight_above(const uint16_t *nine, const uint16_t *oldest, int32_t count,
                               int32_t limit)
{
    uint16_t max = 0;
    for (int32_t i = 0; i < count; i++) {
        const uint16_t eight = (uint16_t)(nine[i] - oldest[i]);
        max = eight > max ? eight : max;
    }
    return max > limit;
}
#endif

/* Pixels that a step reads: a row's first ones, and those that are copied from its end. */
#define STEP_PIXELS (IH_BANDPASS_STEP + 2)
/* Sum i begins with pixel i - BEFORE; the first step with so many pixels outside of the row. */
#define BEFORE (LEAD + 1)
#define OUTSIDE (BEFORE - FIRST)

/* Edge pixels are repeated outside. Edges come last: a vector load right after byte stores fails store
 * forwarding. */
static void take_row_bytes(struct ih_bandpass *band, const uint8_t *row)
{
    uint8_t left[STEP_PIXELS];
    uint8_t right[STEP_PIXELS + 2 * IH_BANDPASS_STEP + 2];
    uint16_t *three = three_of(band);
    uint16_t *binomial = binomial_of(band, 0);
    uint16_t *nine = band->nine.of_bytes;
    const int32_t width = band->width;
    const int32_t first = FIRST + IH_BANDPASS_STEP;
    /* The first step that reads pixels behind the row. */
    const int32_t last =
        first + (width - STEP_PIXELS + OUTSIDE) / IH_BANDPASS_STEP * IH_BANDPASS_STEP;
    const int32_t inside = width - (last - BEFORE); /* its pixels in the row, below STEP_PIXELS */
    memset(left, row[0], OUTSIDE);
    memcpy(&left[OUTSIDE], row, STEP_PIXELS - OUTSIDE);
    memset(right, row[width - 1], sizeof right);
    memcpy(&right[inside], &row[width - STEP_PIXELS], STEP_PIXELS);
    take_bytes(&row[first - BEFORE], last - first, &three[first], &binomial[first], &nine[first]);
    take_bytes(left, IH_BANDPASS_STEP, &three[FIRST], &binomial[FIRST], &nine[FIRST]);
    take_bytes(&right[STEP_PIXELS], end_of(band) - last, &three[last], &binomial[last],
               &nine[last]);
}

static void take_row_grey(struct ih_bandpass *band, const uint16_t *row_q4)
{
    uint16_t *restrict three_q4 = three_of(band);
    uint16_t *restrict binomial_q4 = binomial_of(band, 0);
    uint32_t *restrict nine_q4 = band->nine.of_grey_q4;
    const int32_t width = band->width;
    for (int32_t i = LEAD - IH_BANDPASS_SIDE; i < LEAD + width + IH_BANDPASS_SIDE; i++) {
        const int32_t u = i - LEAD;
        const uint16_t middle_q4 = row_q4[ih_clamp_s32(u, 0, width - 1)];
        const uint16_t sum_q4 = (uint16_t)(row_q4[ih_clamp_s32(u - 1, 0, width - 1)] + middle_q4 +
                                           row_q4[ih_clamp_s32(u + 1, 0, width - 1)]);
        nine_q4[i] = nine_q4[i] + sum_q4 - three_q4[i];
        three_q4[i] = sum_q4;
        binomial_q4[i] = (uint16_t)(sum_q4 + middle_q4);
    }
}

/* Push the newest row once more. */
static void take_again(struct ih_bandpass *band)
{
    const uint16_t *newest = band->three[(band->rows_in + IH_BANDPASS_ROWS - 1) % IH_BANDPASS_ROWS];
    uint16_t *three = three_of(band);
    const int32_t end = end_of(band);
    for (int32_t i = FIRST; i < end; i++) {
        if (band->is_bytes) {
            band->nine.of_bytes[i] =
                (uint16_t)(band->nine.of_bytes[i] + IH_BANDPASS_NINE_SIGN * (newest[i] - three[i]));
        } else {
            band->nine.of_grey_q4[i] = band->nine.of_grey_q4[i] + newest[i] - three[i];
        }
        three[i] = newest[i];
    }
    memcpy(&binomial_of(band, 0)[FIRST], &binomial_of(band, 1)[FIRST],
           (size_t)(end - FIRST) * sizeof three[0]);
}

/* The newest row has joined the sums. */
static bool finish_row(struct ih_bandpass *band, struct ih_bandpass_row *out)
{
    const struct ih_bandpass_rows rows = {
        .above = &binomial_of(band, IH_BANDPASS_REACH + 1)[LEAD],
        .middle = &binomial_of(band, IH_BANDPASS_REACH)[LEAD],
        .below = &binomial_of(band, IH_BANDPASS_REACH - 1)[LEAD],
    };
    const int32_t first = LEAD - IH_BANDPASS_SIDE;
    band->rows_in++;
    if (band->rows_in < IH_BANDPASS_ROWS) {
        return false;
    }
    if (band->is_bytes) {
        ih_bandpass_respond_bytes(&rows, &band->nine.of_bytes[first], band->width, out);
    } else {
        ih_bandpass_respond_grey(&rows, &band->nine.of_grey_q4[first], band->width, out);
    }
    return true;
}

bool ih_bandpass_push_bytes(struct ih_bandpass *band, const uint8_t *row,
                            struct ih_bandpass_row *out)
{
    take_row_bytes(band, row);
    return finish_row(band, out);
}

bool ih_bandpass_push_grey(struct ih_bandpass *band, const uint16_t *row_q4,
                           struct ih_bandpass_row *out)
{
    take_row_grey(band, row_q4);
    return finish_row(band, out);
}

bool ih_bandpass_repeat(struct ih_bandpass *band, struct ih_bandpass_row *out)
{
    take_again(band);
    return finish_row(band, out);
}

void ih_bandpass_columns(const struct ih_bandpass *band, int32_t rows, uint16_t *sum)
{
    memset(sum, 0, (size_t)band->width * sizeof sum[0]);
    for (int32_t row = band->rows_in - rows; row < band->rows_in; row++) {
        const uint16_t *binomial = &band->binomial[row % IH_BANDPASS_KEPT][LEAD];
        const uint16_t *three = &band->three[row % IH_BANDPASS_ROWS][LEAD];
        for (int32_t u = 0; u < band->width; u++) {
            sum[u] = (uint16_t)(sum[u] + binomial[u] - three[u]);
        }
    }
}

bool ih_bandpass_is_any_above(const struct ih_bandpass *band, int32_t limit)
{
    const uint16_t *oldest = band->three[band->rows_in % IH_BANDPASS_ROWS];
    return !band->is_bytes || is_any_eight_above(&band->nine.of_bytes[FIRST], &oldest[FIRST],
                                                 end_of(band) - FIRST, limit);
}
