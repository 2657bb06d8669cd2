#include "dots/ih_dots.h"

#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "dots/ih_dot_centre.h"
#include "dots/ih_dot_maxima.h"

/* Distance in pixels of a plateau's ring from its peak. */
#define SHIFT_MAX 2
#define CLOSE_PX_Q12 (3 * 4096)
#define GROUP IH_BANDPASS_GROUP
_Static_assert(GROUP == IH_NOISE_BLOCK, "a group has one limit, that of its column of blocks");
/* Maxima that are judged together. */
#define CHUNK 64
/* Rows are prefetched so far ahead that memory has delivered them when they are taken. */
#define ROWS_AHEAD 20

void ih_dots_params_default(struct ih_dots_params *params)
{
    *params = (struct ih_dots_params){
        .floor_grey_q4 = 29,   /* 1.8 grey levels */
        .noise_gain_q8 = 1178, /* 4.6: 3.1 sigma of Gaussian noise */
        .ring_max_q8 = 128,
        .side_min_q8 = 138,
        .flat_min_q8 = 225, /* a Gaussian dot has 0.78, and 0.86 with the widest beam and lens */
        .bright_grey = 200,
    };
}

/* Zeros around the frame: the parts of the ring's row that no row of R overwrites. */
static void clear_outside(struct ih_dots_scratch *scratch, int32_t row)
{
    int16_t *response = scratch->rows.detection.response[row];
    const int32_t end =
        row < IH_DOTS_REACH ? 0 : IH_DOTS_SIDE + scratch->width; /* above the frame: all of it */
    memset(response, 0, IH_DOTS_SIDE * sizeof response[0]);
    memset(&response[end], 0,
           sizeof scratch->rows.detection.response[0] - (size_t)end * sizeof response[0]);
}

static bool has_close_dot(const struct ih_dots *dots, const struct ih_dot *dot)
{
    for (int32_t i = dots->dot_count - 1;
         i >= 0 && dots->dot[i].v_px_q12 > dot->v_px_q12 - CLOSE_PX_Q12; i--) {
        if (ih_abs_s32(dots->dot[i].u_px_q12 - dot->u_px_q12) < CLOSE_PX_Q12 &&
            dots->dot[i].v_px_q12 < dot->v_px_q12 + CLOSE_PX_Q12) {
            return true;
        }
    }
    return false;
}

/* Keep the dots sorted by v, then u; peaks come nearly in that order. */
static void insert_dot(struct ih_dots *out, struct ih_dot dot)
{
    IH_IN_RANGE(dot.u_px_q12, 0, (IH_FRAME_WIDTH_MAX - 1) * 4096);
    IH_IN_RANGE(dot.v_px_q12, 0, (IH_FRAME_HEIGHT_MAX - 1) * 4096);
    IH_IN_RANGE(dot.peak, 1, IH_RANGE_RESPONSE);
    if (out->dot_count == IH_DOTS_MAX) {
        out->dots_dropped++;
        return;
    }
    int32_t at = out->dot_count++;
    while (at > 0 && (out->dot[at - 1].v_px_q12 > dot.v_px_q12 ||
                      (out->dot[at - 1].v_px_q12 == dot.v_px_q12 &&
                       out->dot[at - 1].u_px_q12 > dot.u_px_q12))) {
        out->dot[at] = out->dot[at - 1];
        at--;
    }
    out->dot[at] = dot;
}

/* R of row v, its first pixel at [0]; IH_DOTS_REACH pixels beyond the frame may be read. */
static int16_t *response_row(struct ih_dots_scratch *scratch, int32_t v)
{
    const uint32_t row = (uint32_t)(v + IH_DOTS_REACH);
    return &scratch->rows.detection.response[row % IH_DOTS_ROWS][IH_DOTS_SIDE];
}

/* Rows of R around some row are given as near[-IH_DOTS_REACH] to near[IH_DOTS_REACH], pixel 0 of each. */

/* The larger R at a distance to both sides of a pixel. */
static inline int32_t max_beside(const int16_t *pixel, int32_t distance)
{
    return ih_max_s32(pixel[-distance], pixel[distance]);
}

/* Around a pixel of row dv. No early exit: the branch is unpredictable, and a misprediction costs more than
 * all comparisons. */
static bool stands_alone(const int16_t *const *near, int32_t u, int32_t dv, int32_t limit)
{
    const int16_t *top = &near[dv - 4][u];
    const int16_t *bottom = &near[dv + 4][u];
    int32_t max = ih_max_s32(top[0], bottom[0]);
    max = ih_max_s32(max, max_beside(top, 2));
    max = ih_max_s32(max, max_beside(bottom, 2));
    max = ih_max_s32(max, max_beside(&near[dv - 3][u], 3));
    max = ih_max_s32(max, max_beside(&near[dv + 3][u], 3));
    max = ih_max_s32(max, max_beside(&near[dv - 2][u], 4));
    max = ih_max_s32(max, max_beside(&near[dv][u], 4));
    max = ih_max_s32(max, max_beside(&near[dv + 2][u], 4));
    return max <= limit;
}

/* Sum of R over the four pixels beside a peak; outside the frame the opposite pixel is taken. */
static int32_t sum_beside(const struct ih_dots_scratch *scratch, const int16_t *const *near,
                          int32_t u, int32_t v)
{
    const int16_t *middle = near[0];
    const int32_t left = u > 0 ? u - 1 : u + 1;
    const int32_t right = u + 1 < scratch->width ? u + 1 : u - 1;
    const int32_t above = v > 0 ? -1 : 1;
    const int32_t below = v + 1 < scratch->height ? 1 : -1;
    return middle[left] + middle[right] + near[above][u] + near[below][u];
}

/* The pixel of a plateau's centre, near the peak's. */
static int32_t ring_pixel(int32_t centre_px_q12, int32_t peak_px)
{
    int32_t pixel = (int32_t)ih_shift_round(centre_px_q12, 12);
    return ih_clamp_s32(pixel, peak_px - SHIFT_MAX, peak_px + SHIFT_MAX);
}

static int32_t threshold_of(const struct ih_dots_scratch *scratch, int32_t noise)
{
    const int64_t scaled = ih_mul_shift(noise, scratch->params.noise_gain_q8, 8);
    return ih_max_s32(scratch->floor, ih_saturate_s32(scaled));
}

/* A maximum above its threshold. */
struct maximum {
    int16_t u;
    uint8_t row; /* of its batch */
    bool is_flat;
};

/* Rows that are judged together. */
struct batch {
    const int16_t *row[IH_DOTS_ROWS]; /* from near[-IH_DOTS_REACH] of the first row on */
    int32_t first_v;
    int32_t count; /* pending maxima */
    struct maximum maximum[CHUNK];
};

static const int16_t *const *near_of(const struct batch *batch, int32_t row)
{
    return &batch->row[row + IH_DOTS_REACH];
}

/* Of the pending maxima possible dots stay, the others are counted. Without branches: the outcome is
 * unpredictable, and a misprediction costs more than all tests. */
static void filter_maxima(const struct ih_dots_scratch *scratch, struct ih_dots *out,
                          struct batch *batch)
{
    const struct ih_dots_params *params = &scratch->params;
    int32_t kept = 0;
    for (int32_t i = 0; i < batch->count; i++) {
        struct maximum one = batch->maximum[i];
        const int16_t *const *near = near_of(batch, one.row);
        const int32_t peak = near[0][one.u];
        const int32_t ring_max = (int32_t)ih_mul_shift(peak, params->ring_max_q8, 8);
        const int64_t beside_q6 =
            (int64_t)sum_beside(scratch, near, one.u, batch->first_v + one.row) * 64;
        const uint32_t is_hot = beside_q6 < (int64_t)peak * params->side_min_q8;
        const uint32_t is_flat = beside_q6 >= (int64_t)peak * params->flat_min_q8;
        const uint32_t is_alone = stands_alone(near, one.u, 0, ring_max);
        const uint32_t is_spot = (is_flat | is_alone) & (is_hot ^ 1u);
        one.is_flat = is_flat != 0;
        batch->maximum[kept] = one;
        kept += (int32_t)is_spot;
        out->hot_count += (int32_t)is_hot;
        out->edge_count += (int32_t)((is_hot | is_spot) ^ 1u);
    }
    batch->count = kept;
}

/* The last tests, and the centre. */
static void add_dot(const struct ih_dots_scratch *scratch, struct ih_dots *out,
                    const int16_t *const *near, int32_t u, int32_t v, bool is_flat)
{
    const struct ih_dot dot =
        is_flat ? ih_dot_centre_plateau(near, u, v) : ih_dot_centre(near, u, v);
    const int32_t ring_max = (int32_t)ih_mul_shift(dot.peak, scratch->params.ring_max_q8, 8);
    if ((is_flat && !stands_alone(near, ring_pixel(dot.u_px_q12, u),
                                  ring_pixel(dot.v_px_q12, v) - v, ring_max)) ||
        has_close_dot(out, &dot)) {
        out->edge_count++;
        return;
    }
    insert_dot(out, dot);
}

/* All pending maxima. */
static void judge(const struct ih_dots_scratch *scratch, struct ih_dots *out, struct batch *batch)
{
    filter_maxima(scratch, out, batch);
    for (int32_t i = 0; i < batch->count; i++) {
        const struct maximum *one = &batch->maximum[i];
        add_dot(scratch, out, near_of(batch, one->row), one->u, batch->first_v + one->row,
                one->is_flat);
    }
    batch->count = 0;
}

/* Row v of R and its listed groups. */
static struct ih_bandpass_row *listed_of(struct ih_dots_scratch *scratch, int32_t v)
{
    return &scratch->rows.detection.listed[(uint32_t)v % IH_DOTS_ROWS];
}

/* The lowest threshold of each group of row v. It changes where v passes blocks' centres; the earlier limits
 * are kept until their rows are judged. At least 0, so that no zero around the frame is above. */
static int16_t *limits_of(struct ih_dots_scratch *scratch, int32_t v)
{
    const uint32_t cell = (uint32_t)(v + IH_NOISE_BLOCK / 2) / IH_NOISE_BLOCK;
    return scratch->rows.detection.limit[cell % 2];
}

static void set_limits(struct ih_dots_scratch *scratch, int32_t v)
{
    const struct ih_noise_row row = ih_noise_row(&scratch->noise, v);
    int16_t *limit = limits_of(scratch, v);
    for (int32_t i = 0; i < row.columns; i++) {
        const int32_t threshold = threshold_of(scratch, ih_noise_min(&row, i));
        limit[i] = (int16_t)ih_clamp_s32(threshold, 0, INT16_MAX);
    }
}

/* The maxima of a batch's row that are above their thresholds become pending. */
static void find_maxima(struct ih_dots_scratch *scratch, struct ih_dots *out, struct batch *batch,
                        int32_t row)
{
    const int32_t v = batch->first_v + row;
    const int16_t *response = response_row(scratch, v);
    const struct ih_noise_row noise = ih_noise_row(&scratch->noise, v);
    struct ih_dot_maxima marked;
    ih_dot_maxima_mark(listed_of(scratch, v), response_row(scratch, v - 1), response,
                       response_row(scratch, v + 1), &marked);
    for (int32_t i = 0; i < marked.count; i++) {
        for (uint32_t maxima = marked.maxima[i]; maxima != 0; maxima &= maxima - 1) {
            const int32_t u = marked.first[i] + __builtin_ctz(maxima);
            if (batch->count == CHUNK) {
                judge(scratch, out, batch);
            }
            batch->maximum[batch->count] = (struct maximum){.u = (int16_t)u, .row = (uint8_t)row};
            batch->count += response[u] > threshold_of(scratch, ih_noise_at(&noise, u));
        }
    }
}

/* Rows from v on, at most a batch, that have all their neighbours in the ring. */
static void find_dots(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t v, int32_t rows)
{
    struct batch batch;
    batch.first_v = v;
    batch.count = 0;
    for (int32_t i = 0; i < IH_DOTS_ROWS; i++) {
        batch.row[i] = response_row(scratch, v + i - IH_DOTS_REACH);
    }
    for (int32_t row = 0; row < rows; row++) {
        find_maxima(scratch, out, &batch, row);
    }
    judge(scratch, out, &batch);
}

/* The row of R after the last one in the ring is complete. */
static void advance(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    const int32_t last =
        scratch->response_rows - IH_DOTS_REACH; /* all its neighbours are in the ring */
    const int32_t rows = last % IH_DOTS_BATCH + 1;
    scratch->response_rows++;
    if (last >= 0 && (rows == IH_DOTS_BATCH || last == scratch->height - 1)) {
        find_dots(scratch, out, last + 1 - rows, rows);
    }
    if (scratch->response_rows % IH_NOISE_BLOCK == IH_NOISE_BLOCK / 2) {
        set_limits(scratch, scratch->response_rows);
    }
}

/* The next row of R, with its limits. */
static struct ih_bandpass_row *next_row(struct ih_dots_scratch *scratch)
{
    struct ih_bandpass_row *next = listed_of(scratch, scratch->response_rows);
    next->response = response_row(scratch, scratch->response_rows);
    next->limit = limits_of(scratch, scratch->response_rows);
    return next;
}

static uint16_t max_of(const uint16_t *sum, int32_t count)
{
    uint16_t max = 0;
    for (int32_t i = 0; i < count; i++) {
        max = sum[i] > max ? sum[i] : max;
    }
    return max;
}

/* Blocks whose columns' sums have a mean above the limit. Without a bright column there is none. */
static void mark_bright(struct ih_dots *out, int32_t block_row, const uint16_t *sum, int32_t width,
                        int32_t limit)
{
    if (max_of(sum, width) <= limit) {
        return;
    }
    for (int32_t first = 0; first < width; first += IH_DOTS_BLOCK) {
        const int32_t columns = ih_min_s32(IH_DOTS_BLOCK, width - first);
        int32_t block_sum = 0;
        for (int32_t i = 0; i < columns; i++) {
            block_sum += sum[first + i];
        }
        if (block_sum > limit * columns) {
            const int32_t block = first / IH_DOTS_BLOCK;
            out->bright[block_row][block / 32] |= 1u << (block % 32);
        }
    }
}

/* A row joins the columns' sums before the ambient frame is subtracted. Without one the band-pass has them. */
static void add_bright(struct ih_dots_scratch *scratch, int32_t v)
{
    uint16_t *column = scratch->bright_column;
    if (v % IH_DOTS_BLOCK == 0) {
        memset(column, 0, sizeof scratch->bright_column);
    }
    for (int32_t u = 0; u < scratch->width; u++) {
        column[u] = (uint16_t)(column[u] + scratch->grey_q4[u]);
    }
}

/* Row v is the last one of a row of blocks. */
static void finish_blocks(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t v,
                          bool is_in_band)
{
    const struct ih_bandpass *band = &scratch->rows.detection.band;
    const int32_t rows = v % IH_DOTS_BLOCK + 1;
    const int32_t grey = band->is_bytes ? 1 : 16; /* one level of 8 bits */
    const int32_t limit = scratch->params.bright_grey * grey * rows;
    if (is_in_band && rows == IH_DOTS_BLOCK && !ih_bandpass_is_any_above(band, 2 * limit)) {
        return;
    }
    if (is_in_band) {
        ih_bandpass_columns(band, rows, scratch->bright_column);
    }
    mark_bright(out, v / IH_DOTS_BLOCK, scratch->bright_column, scratch->width, limit);
}

static void repeat_row(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    if (ih_bandpass_repeat(&scratch->rows.detection.band, next_row(scratch))) {
        advance(scratch, out);
    }
}

void ih_dots_begin(struct ih_dots_scratch *scratch, struct ih_dots *out,
                   const struct ih_dots_params *params, int32_t width, int32_t height,
                   const struct ih_noise *noise)
{
    scratch->params = *params;
    scratch->width = width;
    scratch->height = height;
    scratch->rows_taken = 0;
    scratch->response_rows = 0;
    if (noise != &scratch->noise) {
        scratch->noise = *noise;
    }
    for (int32_t row = 0; row < IH_DOTS_ROWS; row++) {
        clear_outside(scratch, row);
    }
    scratch->floor = (int32_t)ih_mul_shift(params->floor_grey_q4, IH_BANDPASS_UNIT, 4);
    set_limits(scratch, 0);
    out->dot_count = 0;
    out->edge_count = 0;
    out->hot_count = 0;
    out->dots_dropped = 0;
    memset(out->bright, 0, sizeof out->bright);
}

void ih_dots_row(struct ih_dots_scratch *scratch, struct ih_dots *out,
                 const struct ih_scanline *row, const struct ih_scanline *ambient)
{
    struct ih_bandpass *band = &scratch->rows.detection.band;
    const int32_t v = scratch->rows_taken++;
    const bool is_bytes = ambient == NULL && ih_scanline_is_bytes(row);
    bool complete = false;
    if (v == 0) {
        ih_bandpass_begin(band, scratch->width, is_bytes);
    }
    if (is_bytes) {
        complete = ih_bandpass_push_bytes(band, row->samples, next_row(scratch));
    } else {
        ih_scanline_grey(row, scratch->width, scratch->grey_q4);
        if (ambient != NULL) {
            add_bright(scratch, v);
            ih_scanline_grey(ambient, scratch->width, scratch->ambient_q4);
            ih_noise_subtract(&scratch->noise, v, scratch->width, scratch->ambient_q4,
                              scratch->grey_q4);
        }
        complete = ih_bandpass_push_grey(band, scratch->grey_q4, next_row(scratch));
    }
    if (v % IH_DOTS_BLOCK == IH_DOTS_BLOCK - 1 || v == scratch->height - 1) {
        finish_blocks(scratch, out, v, ambient == NULL);
    }
    if (complete) {
        advance(scratch, out);
    }
    for (int32_t i = 0; v == 0 && i < IH_BANDPASS_REACH; i++) { /* repeat the first row upwards */
        repeat_row(scratch, out);
    }
}

void ih_dots_end(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    for (int32_t i = 0; i < IH_BANDPASS_REACH; i++) { /* repeat the last row downwards */
        repeat_row(scratch, out);
    }
    for (int32_t i = 0; i < IH_DOTS_REACH; i++) { /* nothing below the frame */
        memset(scratch->rows.detection
                   .response[(scratch->response_rows + IH_DOTS_REACH) % IH_DOTS_ROWS],
               0, sizeof scratch->rows.detection.response[0]);
        advance(scratch, out);
    }
}

void ih_dots_find(const struct ih_frame *frame, const struct ih_frame *ambient,
                  const struct ih_dots_params *params, struct ih_dots_scratch *scratch,
                  struct ih_dots *out)
{
    ih_noise_measure(frame, ambient, &scratch->rows.measuring, &scratch->noise);
    ih_dots_begin(scratch, out, params, frame->width, frame->height, &scratch->noise);
    for (int32_t v = 0; v < frame->height; v++) {
        if (v + ROWS_AHEAD < frame->height) {
            const struct ih_scanline ahead = ih_frame_scanline(frame, v + ROWS_AHEAD);
            const uint8_t *samples = ahead.samples;
            const int32_t bytes = frame->width * frame->bytes_per_sample;
#pragma GCC unroll 4
            for (int32_t i = 0; i < bytes; i += IH_LINE_BYTES) {
                __builtin_prefetch(&samples[i]); /* no function: gcc 12 leaves out calls of it */
            }
        }
        struct ih_scanline row = ih_frame_scanline(frame, v);
        struct ih_scanline under = ih_frame_scanline(ambient != NULL ? ambient : frame, v);
        ih_dots_row(scratch, out, &row, ambient != NULL ? &under : NULL);
    }
    ih_dots_end(scratch, out);
}

bool ih_dots_is_bright(const struct ih_dots *dots, int32_t u_px, int32_t v_px)
{
    if (u_px < 0 || v_px < 0 || u_px >= IH_FRAME_WIDTH_MAX || v_px >= IH_FRAME_HEIGHT_MAX) {
        return false;
    }
    int32_t block = u_px / IH_DOTS_BLOCK;
    return (dots->bright[v_px / IH_DOTS_BLOCK][block / 32] >> (block % 32) & 1u) != 0;
}
