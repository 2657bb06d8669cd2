#include "ih_noise.h"

#include <string.h>

#include "ih_fix.h"

#define SAMPLES_MAX (IH_NOISE_BLOCK / IH_NOISE_STEP * IH_NOISE_BLOCK)

/* The value of rank count / 2, from 0: the k-th smallest by halving the range of values. */
static uint16_t median_of(const uint16_t *value, int32_t count)
{
    int32_t low = 0;
    int32_t high = UINT16_MAX; /* the median is in low..high */
    while (low < high) {
        int32_t middle = (low + high) / 2;
        int32_t at_most = 0;
        for (int32_t i = 0; i < count; i++) {
            at_most += value[i] <= middle;
        }
        if (at_most > count / 2) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    return (uint16_t)low;
}

static uint16_t block_median(const struct ih_noise_scratch *scratch, int32_t column, int32_t rows)
{
    uint16_t value[SAMPLES_MAX];
    int32_t count = 0;
    int32_t first = column * IH_NOISE_BLOCK;
    int32_t end = ih_min_s32(first + IH_NOISE_BLOCK, scratch->band.width);
    for (int32_t row = 0; row < rows; row++) {
        for (int32_t u = first; u < end; u++) {
            value[count++] = (uint16_t)ih_abs_s32(scratch->response[row][u]);
        }
    }
    return median_of(value, count);
}

static void respond(const struct ih_frame *frame, int32_t v, struct ih_band *band,
                    int16_t *response)
{
    ih_band_begin(band, frame->width);
    for (int32_t dv = -IH_BAND_REACH; dv <= IH_BAND_REACH; dv++) {
        struct ih_row row = ih_frame_row(frame, ih_clamp_s32(v + dv, 0, frame->height - 1));
        ih_band_take(band, &row);
        (void)ih_band_push(band, response);
    }
}

/* 1-2-1 along a line of blocks, in place. */
static void smooth(uint16_t *first, int32_t count, int32_t step)
{
    int32_t before = first[0];
    for (int32_t i = 0; i < count; i++) {
        int32_t here = first[i * step];
        int32_t after = i + 1 < count ? first[(i + 1) * step] : here;
        first[i * step] = (uint16_t)((before + 2 * here + after + 2) >> 2);
        before = here;
    }
}

void ih_noise_measure(const struct ih_frame *frame, struct ih_noise_scratch *scratch,
                      struct ih_noise *out)
{
    memset(out, 0, sizeof *out);
    out->columns = (int16_t)((frame->width + IH_NOISE_BLOCK - 1) / IH_NOISE_BLOCK);
    out->rows = (int16_t)((frame->height + IH_NOISE_BLOCK - 1) / IH_NOISE_BLOCK);
    for (int32_t block_row = 0; block_row < out->rows; block_row++) {
        int32_t count = 0;
        for (int32_t v = block_row * IH_NOISE_BLOCK + IH_BAND_REACH;
             v < (block_row + 1) * IH_NOISE_BLOCK; v += IH_NOISE_STEP) {
            if (v < frame->height || count == 0) {
                respond(frame, ih_min_s32(v, frame->height - 1), &scratch->band,
                        scratch->response[count++]);
            }
        }
        for (int32_t column = 0; column < out->columns; column++) {
            out->median[block_row][column] = block_median(scratch, column, count);
        }
    }
    for (int32_t row = 0; row < out->rows; row++) {
        smooth(out->median[row], out->columns, 1);
    }
    for (int32_t column = 0; column < out->columns; column++) {
        smooth(&out->median[0][column], out->rows, IH_NOISE_BLOCKS_X);
    }
}

/* Twice the distance of a pixel from the first block's centre, limited to between the outermost
 * centres; a block is 2 * IH_NOISE_BLOCK of it. */
static int32_t twice_offset(int32_t pixel, int32_t blocks)
{
    return ih_clamp_s32(2 * pixel - (IH_NOISE_BLOCK - 1), 0, 2 * IH_NOISE_BLOCK * (blocks - 1));
}

static int32_t between(int32_t low, int32_t high, int32_t part)
{
    return low + (int32_t)ih_shift_round((int64_t)(high - low) * part, 6);
}

int32_t ih_noise_row(const struct ih_noise *noise, int32_t v, uint16_t row[IH_NOISE_BLOCKS_X])
{
    int32_t offset = twice_offset(v, noise->rows);
    int32_t above = offset / (2 * IH_NOISE_BLOCK);
    int32_t below = ih_min_s32(above + 1, noise->rows - 1);
    int32_t least = UINT16_MAX;
    for (int32_t column = 0; column < noise->columns; column++) {
        row[column] = (uint16_t)between(noise->median[above][column], noise->median[below][column],
                                        offset % (2 * IH_NOISE_BLOCK));
        least = ih_min_s32(least, row[column]);
    }
    return least;
}

int32_t ih_noise_at(const struct ih_noise *noise, const uint16_t row[IH_NOISE_BLOCKS_X], int32_t u)
{
    int32_t offset = twice_offset(u, noise->columns);
    int32_t left = offset / (2 * IH_NOISE_BLOCK);
    int32_t right = ih_min_s32(left + 1, noise->columns - 1);
    return between(row[left], row[right], offset % (2 * IH_NOISE_BLOCK));
}
