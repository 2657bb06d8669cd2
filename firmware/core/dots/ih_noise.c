#include "dots/ih_noise.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "dots/ih_block_median.h"
#include "dots/ih_scanline.h"

/* All of the ambient light is subtracted. */
#define WHOLE_Q12 4096
/* Grey level that stays where nothing changed: noise must not be clipped at 0, the dark ghost of something
 * that moved must be. */
#define PEDESTAL_Q4 64
/* The residual is white noise, with more isolated local maxima than texture of the same median. */
#define WHITE_Q4 19

/* Twice the distance of a pixel from the first block's centre, clamped to the outermost centres; a block is
 * 2 * IH_NOISE_BLOCK of it. */
static uint32_t twice_offset(int32_t pixel, int32_t blocks)
{
    return (uint32_t)ih_clamp_s32(2 * pixel - (IH_NOISE_BLOCK - 1), 0,
                                  2 * IH_NOISE_BLOCK * (blocks - 1));
}

static int32_t between(int32_t low, int32_t high, int32_t part)
{
    return low + (((high - low) * part + 32) >> 6);
}

/* The two blocks between whose centres a pixel lies, and its distance from the first, in 64ths. */
struct cell {
    int32_t before, after;
    int32_t part;
};

static struct cell cell_of(int32_t pixel, int32_t blocks)
{
    const uint32_t offset = twice_offset(pixel, blocks);
    const int32_t before = (int32_t)(offset / (2 * IH_NOISE_BLOCK));
    return (struct cell){
        .before = before,
        .after = ih_min_s32(before + 1, blocks - 1),
        .part = (int32_t)(offset % (2 * IH_NOISE_BLOCK)),
    };
}

static bool is_any_subtracted(const struct ih_noise *noise, int32_t above, int32_t below)
{
    uint32_t any = 0;
    for (int32_t column = 0; column < noise->columns; column++) {
        any |= noise->subtract[above][column] | noise->subtract[below][column];
    }
    return any != 0;
}

/* The fraction that a block subtracts. */
static int32_t block_fraction_q12(const struct ih_noise *noise, int32_t row, int32_t column)
{
    return noise->subtract[row][column] != 0 ? WHOLE_Q12 : 0;
}

/* Pixels first .. end - 1 lie between the centres of two blocks, the first part 64ths from the left one, each
 * further pixel 2 more. */
static void subtract_span(const uint16_t *ambient_q4, uint16_t *grey_q4, int32_t first, int32_t end,
                          int32_t from_q12, int32_t to_q12, int32_t part)
{
    if (from_q12 == 0 && to_q12 == 0) {
        return;
    }
    for (int32_t u = first; u < end; u++) {
        const int32_t fraction_q12 = from_q12 + (((to_q12 - from_q12) * part + 32) >> 6);
        const int32_t subtracted_q4 =
            ((ambient_q4[u] - PEDESTAL_Q4) * fraction_q12 + WHOLE_Q12 / 2) >> 12;
        grey_q4[u] = (uint16_t)ih_max_s32(0, grey_q4[u] - subtracted_q4);
        IH_IN_RANGE(grey_q4[u], 0, IH_RANGE_GREY_Q4);
        part += 2;
    }
}

void ih_noise_subtract(const struct ih_noise *noise, int32_t v, int32_t width,
                       const uint16_t *ambient_q4, uint16_t *grey_q4)
{
    const struct cell cell = cell_of(v, noise->rows);
    if (!is_any_subtracted(noise, cell.before, cell.after)) {
        return;
    }
    int32_t before_q12 = 0;
    int32_t first = 0;
    for (int32_t column = 0; column < noise->columns; column++) {
        int32_t here_q12 = between(block_fraction_q12(noise, cell.before, column),
                                   block_fraction_q12(noise, cell.after, column), cell.part);
        int32_t end = ih_min_s32(width, column * IH_NOISE_BLOCK + IH_NOISE_BLOCK / 2);
        subtract_span(ambient_q4, grey_q4, first, end, column == 0 ? here_q12 : before_q12,
                      here_q12, 1);
        before_q12 = here_q12;
        first = end;
    }
    subtract_span(ambient_q4, grey_q4, first, width, before_q12, before_q12, 1);
}

/* The first sampled row of a row of blocks; the last row where the frame ends above it. */
static int32_t first_row(int32_t block_row, int32_t height)
{
    return ih_min_s32(block_row * IH_NOISE_BLOCK + IH_BANDPASS_REACH, height - 1);
}

/* Is row v one of the sampled rows, of which count came before? */
static bool is_sampled(int32_t count, int32_t v, int32_t height)
{
    return count < IH_BLOCK_MEDIAN_ROWS && v < height;
}

/* Grey levels of a row of both frames. */
static void take_rows(const struct ih_frame *frame, const struct ih_frame *ambient, int32_t v,
                      struct ih_noise_scratch *scratch)
{
    struct ih_scanline row = ih_frame_scanline(frame, v);
    struct ih_scanline under = ih_frame_scanline(ambient, v);
    ih_scanline_grey(&row, frame->width, scratch->grey_q4);
    ih_scanline_grey(&under, frame->width, scratch->ambient_q4);
}

/* R of row v of the frame. */
static void filter_bytes(const struct ih_frame *frame, int32_t v, struct ih_bandpass *band,
                         int16_t *response)
{
    const uint8_t *samples = frame->samples;
    const uint8_t *row[IH_BANDPASS_ROWS];
    for (int32_t i = 0; i < IH_BANDPASS_ROWS; i++) {
        const int32_t at = ih_clamp_s32(v + i - IH_BANDPASS_REACH, 0, frame->height - 1);
        row[i] = &samples[(size_t)at * (size_t)frame->stride_bytes];
    }
    ih_bandpass_bytes(band, row, frame->width, response);
}

/* R of row v; an ambient frame is subtracted as the map says. */
static void filter_grey(const struct ih_frame *frame, const struct ih_frame *ambient, int32_t v,
                        const struct ih_noise *noise, struct ih_noise_scratch *scratch,
                        struct ih_bandpass_row *out)
{
    ih_bandpass_begin(&scratch->band, frame->width, false);
    for (int32_t i = -IH_BANDPASS_REACH; i <= IH_BANDPASS_REACH; i++) {
        const int32_t at = ih_clamp_s32(v + i, 0, frame->height - 1);
        if (ambient != NULL) {
            take_rows(frame, ambient, at, scratch);
            ih_noise_subtract(noise, at, frame->width, scratch->ambient_q4, scratch->grey_q4);
        } else {
            const struct ih_scanline row = ih_frame_scanline(frame, at);
            ih_scanline_grey(&row, frame->width, scratch->grey_q4);
        }
        (void)ih_bandpass_push_grey(&scratch->band, scratch->grey_q4, out);
    }
}

static void measure(const struct ih_frame *frame, const struct ih_frame *ambient,
                    struct ih_noise_scratch *scratch, struct ih_noise *out)
{
    const struct ih_scanline row = ih_frame_scanline(frame, 0);
    const bool is_bytes = ambient == NULL && ih_scanline_is_bytes(&row);
    for (int32_t block_row = 0; block_row < out->rows; block_row++) {
        int32_t count = 0;
        for (int32_t v = first_row(block_row, frame->height); is_sampled(count, v, frame->height);
             v += IH_NOISE_STEP) {
            struct ih_bandpass_row filtered = {.response = scratch->response[count++]};
            if (is_bytes) {
                filter_bytes(frame, v, &scratch->band, filtered.response);
            } else {
                filter_grey(frame, ambient, v, out, scratch, &filtered);
            }
        }
        ih_block_medians(scratch->response, frame->width, count, out->median[block_row]);
    }
}

/* Half of the difference of both rows, around the middle of the range: no value is clipped. */
static void halve_difference(struct ih_noise_scratch *scratch)
{
    uint16_t *grey_q4 = scratch->grey_q4;
    for (int32_t u = 0; u < scratch->band.width; u++) {
        grey_q4[u] = (uint16_t)((grey_q4[u] + IH_SCANLINE_FULL_Q4 - scratch->ambient_q4[u]) >> 1);
    }
}

/* A row joins the sum of each block. */
static void add_row(const uint16_t *grey_q4, int32_t width, int32_t sum[IH_NOISE_BLOCKS_X])
{
    for (int32_t u = 0; u < width; u++) {
        sum[u / IH_NOISE_BLOCK] += grey_q4[u] - IH_SCANLINE_FULL_Q4 / 2;
    }
}

/* In a row of blocks: is it quieter by an eighth without the ambient light, and not darker than the
 * ambient frame? median holds the noise with it. */
static void choose(const struct ih_frame *frame, const struct ih_frame *ambient,
                   struct ih_noise_scratch *scratch, struct ih_noise *out, int32_t block_row)
{
    int32_t half_sum[IH_NOISE_BLOCKS_X] = {0};
    int32_t count = 0;
    for (int32_t v = first_row(block_row, frame->height); is_sampled(count, v, frame->height);
         v += IH_NOISE_STEP) {
        struct ih_bandpass_row filtered = {.response = scratch->response[count]};
        ih_bandpass_begin(&scratch->band, frame->width, false);
        for (int32_t at = v - IH_BANDPASS_REACH; at <= v + IH_BANDPASS_REACH; at++) {
            take_rows(frame, ambient, ih_clamp_s32(at, 0, frame->height - 1), scratch);
            halve_difference(scratch);
            if (at == v) {
                add_row(scratch->grey_q4, frame->width, half_sum);
            }
            (void)ih_bandpass_push_grey(&scratch->band, scratch->grey_q4, &filtered);
        }
        count++;
    }
    uint16_t half_median[IH_NOISE_BLOCKS_X];
    ih_block_medians(scratch->response, frame->width, count, half_median);
    for (int32_t column = 0; column < out->columns; column++) {
        int32_t width = ih_min_s32(IH_NOISE_BLOCK, frame->width - column * IH_NOISE_BLOCK);
        bool quieter = 16 * half_median[column] < 7 * out->median[block_row][column];
        bool darker = half_sum[column] < -(PEDESTAL_Q4 / 4) * width * count;
        out->subtract[block_row][column] = quieter && !darker;
    }
}

static void raise_white(struct ih_noise *out)
{
    for (int32_t row = 0; row < out->rows; row++) {
        for (int32_t column = 0; column < out->columns; column++) {
            if (out->subtract[row][column] != 0) {
                out->median[row][column] =
                    (uint16_t)ih_shift_round(out->median[row][column] * WHITE_Q4, 4);
            }
        }
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

void ih_noise_measure(const struct ih_frame *frame, const struct ih_frame *ambient,
                      struct ih_noise_scratch *scratch, struct ih_noise *out)
{
    memset(out, 0, sizeof *out);
    out->columns = (int16_t)((frame->width + IH_NOISE_BLOCK - 1) / IH_NOISE_BLOCK);
    out->rows = (int16_t)((frame->height + IH_NOISE_BLOCK - 1) / IH_NOISE_BLOCK);
    measure(frame, NULL, scratch, out);
    if (ambient != NULL) {
        for (int32_t row = 0; row < out->rows; row++) {
            choose(frame, ambient, scratch, out, row);
        }
        measure(frame, ambient, scratch, out);
        raise_white(out);
    }
    for (int32_t row = 0; row < out->rows; row++) {
        smooth(out->median[row], out->columns, 1);
    }
    for (int32_t column = 0; column < out->columns; column++) {
        smooth(&out->median[0][column], out->rows, IH_NOISE_BLOCKS_X);
    }
}

struct ih_noise_row ih_noise_row(const struct ih_noise *noise, int32_t v)
{
    const struct cell cell = cell_of(v, noise->rows);
    return (struct ih_noise_row){
        .above = noise->median[cell.before],
        .below = noise->median[cell.after],
        .part = cell.part,
        .columns = noise->columns,
    };
}

int32_t ih_noise_at(const struct ih_noise_row *row, int32_t u)
{
    const struct cell cell = cell_of(u, row->columns);
    const int32_t left = between(row->above[cell.before], row->below[cell.before], row->part);
    const int32_t right = between(row->above[cell.after], row->below[cell.after], row->part);
    IH_IN_RANGE(left, 0, IH_RANGE_NOISE);
    IH_IN_RANGE(right, 0, IH_RANGE_NOISE);
    return between(left, right, cell.part);
}

static inline int32_t min_of_rows(const struct ih_noise_row *row, int32_t block)
{
    return ih_min_s32(row->above[block], row->below[block]);
}

int32_t ih_noise_min(const struct ih_noise_row *row, int32_t block)
{
    const int32_t before = min_of_rows(row, ih_max_s32(block - 1, 0));
    const int32_t after = min_of_rows(row, ih_min_s32(block + 1, row->columns - 1));
    return ih_min_s32(min_of_rows(row, block), ih_min_s32(before, after));
}
