#include "ih_band.h"

#include <string.h>

#include "ih_fix.h"

#define INNER_WEIGHT 81 /* the outer box has 81 pixels, the inner kernel weight 16: */
#define OUTER_WEIGHT 16 /* 81 inner - 16 outer has no response to a constant */
#define RESPONSE_SHIFT 8
/* Pixels that are filtered together: their sums take 4 bytes each of the stack. */
#define SPAN 128

struct ih_row ih_frame_row(const struct ih_frame *frame, int32_t v)
{
    return (struct ih_row){
        .samples = (const uint8_t *)frame->samples + (size_t)v * (size_t)frame->stride_bytes,
        .bytes_per_sample = frame->bytes_per_sample,
        .maximum = frame->maximum,
    };
}

/* The same where there is nothing to round, as with 8 bits: products of 16 bits. */
static void grey_whole(const uint8_t *narrow, int32_t width, uint16_t maximum, uint16_t gain,
                       uint16_t *grey_q4)
{
    for (int32_t u = 0; u < width; u++) {
        uint16_t sample = narrow[u] < maximum ? narrow[u] : maximum;
        grey_q4[u] = (uint16_t)(sample * gain);
    }
}

void ih_row_grey(const struct ih_row *row, int32_t width, uint16_t *grey_q4)
{
    const uint32_t maximum = (uint32_t)row->maximum;
    /* 255 of 255 and 65535 of 65535 become 4080. */
    const uint32_t gain_q16 = (IH_BAND_FULL_Q4 * 65536u + maximum / 2) / maximum;
    const uint8_t *narrow = row->samples;
    const uint16_t *wide = row->samples;
    if (row->bytes_per_sample == 1 && gain_q16 % 65536u == 0) {
        grey_whole(narrow, width, (uint16_t)maximum, (uint16_t)(gain_q16 >> 16), grey_q4);
        return;
    }
    for (int32_t u = 0; u < width; u++) {
        uint32_t sample = row->bytes_per_sample == 1 ? narrow[u] : wide[u];
        if (sample > maximum) {
            sample = maximum;
        }
        grey_q4[u] = (uint16_t)((sample * gain_q16 + 32768u) >> 16);
    }
}

void ih_band_begin(struct ih_band *band, int32_t width)
{
    band->width = width;
    band->rows_in = 0;
}

/* Take the newest row into the box, and out of it the one that leaves the ring: sums over nine pixels
 * of a row, threes first and then three of those. */
static void move_box(struct ih_band *band)
{
    const int32_t width = band->width;
    uint16_t *padded_q4 = band->padded_q4;
    uint16_t *across = band->across[band->rows_in % IH_BAND_ROWS];
    if (band->rows_in < IH_BAND_ROWS) {
        memset(across, 0, (size_t)width * sizeof *across);
    }
    memcpy(&padded_q4[IH_BAND_REACH], band->incoming_q4, (size_t)width * sizeof *padded_q4);
    for (int32_t i = 0; i < IH_BAND_REACH; i++) {
        padded_q4[i] = band->incoming_q4[0];
        padded_q4[IH_BAND_REACH + width + i] = band->incoming_q4[width - 1];
    }
    for (int32_t i = 0; i < width + 2 * IH_BAND_REACH - 2; i++) {
        band->three[i] = (uint16_t)(padded_q4[i] + padded_q4[i + 1] + padded_q4[i + 2]);
    }
    for (int32_t u = 0; u < width; u++) {
        uint16_t sum = (uint16_t)(band->three[u] + band->three[u + 3] + band->three[u + 6]);
        IH_IN_RANGE(sum, 0, IH_BAND_ROWS * IH_RANGE_GREY_Q4);
        band->box[u] = band->box[u] + sum - across[u];
        across[u] = sum;
    }
}

static void move_ring(struct ih_band *band)
{
    if (band->rows_in == 0) {
        memset(band->box, 0, (size_t)band->width * sizeof band->box[0]);
    }
    move_box(band);
    memcpy(band->grey_q4[band->rows_in % IH_BAND_GREY_ROWS], band->incoming_q4,
           (size_t)band->width * sizeof band->incoming_q4[0]);
    band->rows_in++;
}

static int32_t weighed(int32_t inner, int32_t box)
{
    return (INNER_WEIGHT * inner - OUTER_WEIGHT * box + (1 << (RESPONSE_SHIFT - 1))) >>
           RESPONSE_SHIFT;
}

/* Three rows' sum, weights 1-2-1, at each pixel. */
struct rows {
    const uint16_t *above, *middle, *below;
};

static uint16_t column_of(const struct rows *rows, int32_t u)
{
    return (uint16_t)(rows->above[u] + 2 * rows->middle[u] + rows->below[u]);
}

/* R of count pixels from u on. */
static void filter_span(const struct ih_band *band, const struct rows *rows, int32_t u,
                        int32_t count, int16_t *response)
{
    uint16_t column[SPAN + 2]; /* one pixel more on both sides, repeated outside the frame */
    for (int32_t i = 0; i < count; i++) {
        column[i + 1] = column_of(rows, u + i);
    }
    column[0] = column_of(rows, ih_max_s32(u - 1, 0));
    column[count + 1] = column_of(rows, ih_min_s32(u + count, band->width - 1));
    for (int32_t i = 0; i < count; i++) {
        response[u + i] = (int16_t)weighed(column[i] + 2 * column[i + 1] + column[i + 2],
                                           (int32_t)band->box[u + i]);
    }
}

/* R of the ring's centre row. */
static void filter_row(const struct ih_band *band, int16_t *response)
{
    const int32_t centre = band->rows_in - IH_BAND_REACH - 1;
    const struct rows rows = {
        .above = band->grey_q4[(centre - 1) % IH_BAND_GREY_ROWS],
        .middle = band->grey_q4[centre % IH_BAND_GREY_ROWS],
        .below = band->grey_q4[(centre + 1) % IH_BAND_GREY_ROWS],
    };
    for (int32_t u = 0; u < band->width; u += SPAN) {
        filter_span(band, &rows, u, ih_min_s32(SPAN, band->width - u), response);
    }
}

bool ih_band_push(struct ih_band *band, int16_t *response)
{
    move_ring(band);
    if (band->rows_in < IH_BAND_ROWS) {
        return false;
    }
    filter_row(band, response);
    return true;
}
