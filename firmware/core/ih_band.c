#include "ih_band.h"

#include <string.h>

#include "ih_fix.h"

#define INNER_WEIGHT 81 /* the outer box has 81 pixels, the inner kernel weight 16: */
#define OUTER_WEIGHT 16 /* 81 inner - 16 outer has no response to a constant */
#define RESPONSE_SHIFT 8
/* Pixels that are filtered together: their sums take 8 bytes each of the stack. */
#define SPAN 64

struct ih_row ih_frame_row(const struct ih_frame *frame, int32_t v)
{
    return (struct ih_row){
        .samples = (const uint8_t *)frame->samples + (size_t)v * (size_t)frame->stride_bytes,
        .bytes_per_sample = frame->bytes_per_sample,
        .maximum = frame->maximum,
    };
}

void ih_row_grey(const struct ih_row *row, int32_t width, uint16_t *grey_q4)
{
    const uint32_t maximum = (uint32_t)row->maximum;
    /* 255 of 255 and 65535 of 65535 become 4080. */
    const uint32_t gain_q16 = (IH_BAND_FULL_Q4 * 65536u + maximum / 2) / maximum;
    const uint8_t *narrow = row->samples;
    const uint16_t *wide = row->samples;
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

/* Column sums with the newest row and without the one that leaves the ring. */
static void move_ring(struct ih_band *band)
{
    const int32_t width = band->width;
    const uint16_t *from = band->incoming_q4;
    uint16_t *to = band->grey_q4[band->rows_in % IH_BAND_ROWS];
    uint16_t *sum = &band->column_sum[IH_BAND_REACH];
    if (band->rows_in == 0) {
        memset(band->column_sum, 0, sizeof band->column_sum);
    }
    if (band->rows_in < IH_BAND_ROWS) {
        memset(to, 0, (size_t)width * sizeof *to);
    }
    for (int32_t u = 0; u < width; u++) {
        sum[u] = (uint16_t)(sum[u] + from[u] - to[u]);
        IH_IN_RANGE(sum[u], 0, IH_BAND_ROWS * IH_RANGE_GREY_Q4);
    }
    memcpy(to, from, (size_t)width * sizeof *to);
    for (int32_t i = 1; i <= IH_BAND_REACH; i++) {
        sum[-i] = sum[0];
        sum[width - 1 + i] = sum[width - 1];
    }
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

static int32_t column_of(const struct rows *rows, int32_t u)
{
    return rows->above[u] + 2 * rows->middle[u] + rows->below[u];
}

/* R of count pixels from u on; box: the sum around the first of them, moved on to the pixel after
 * the last. The box's running sum has each value wait for the one before; what is done to all pixels
 * alike stands in loops of its own, which compilers turn into vectors. */
static void filter_span(const struct ih_band *band, const struct rows *rows, int32_t u,
                        int32_t count, int32_t *box, int16_t *response)
{
    int32_t box_at[SPAN];
    int32_t column[SPAN + 2]; /* one pixel more on both sides, repeated outside the frame */
    const uint16_t *sum = &band->column_sum[u]; /* of the box around pixel u: from sum[0] on */
    for (int32_t i = 0; i < count; i++) {
        box_at[i] = *box;
        *box += sum[i + IH_BAND_ROWS] - sum[i];
    }
    for (int32_t i = 0; i < count; i++) {
        column[i + 1] = column_of(rows, u + i);
    }
    column[0] = column_of(rows, ih_max_s32(u - 1, 0));
    column[count + 1] = column_of(rows, ih_min_s32(u + count, band->width - 1));
    for (int32_t i = 0; i < count; i++) {
        response[u + i] =
            (int16_t)weighed(column[i] + 2 * column[i + 1] + column[i + 2], box_at[i]);
    }
}

/* R of the ring's centre row. */
static void filter_row(const struct ih_band *band, int16_t *response)
{
    const int32_t centre = band->rows_in - IH_BAND_REACH - 1;
    const struct rows rows = {
        .above = band->grey_q4[(centre - 1) % IH_BAND_ROWS],
        .middle = band->grey_q4[centre % IH_BAND_ROWS],
        .below = band->grey_q4[(centre + 1) % IH_BAND_ROWS],
    };
    int32_t box = 0;
    for (int32_t i = 0; i < IH_BAND_ROWS; i++) {
        box += band->column_sum[i];
    }
    for (int32_t u = 0; u < band->width; u += SPAN) {
        filter_span(band, &rows, u, ih_min_s32(SPAN, band->width - u), &box, response);
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
