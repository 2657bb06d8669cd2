#include "ih_dots.h"

#include <string.h>

#include "ih_fix.h"

#define GREY_FULL_Q4 4080 /* 255 in Q4 */
#define INNER_WEIGHT 81   /* the outer box has 81 pixels, the inner kernel weight 16: */
#define OUTER_WEIGHT 16   /* R = 81 inner - 16 outer has no response to a constant */
/* The centre is weighted by (R / 2^8)^2: for a spot in white noise that comes close to the maximum
 * likelihood; weighting by R itself measured a tenth worse. */
#define WEIGHT_SHIFT 8
#define RING_CENTRE_LAG (IH_DOTS_REACH + 1)

void ih_dots_params_default(struct ih_dots_params *params)
{
    *params = (struct ih_dots_params){
        .floor_grey_q4 = 29,   /* 1.8 grey levels */
        .noise_gain_q8 = 1708, /* 4.5 x 1.4826: 4.5 sigma of Gaussian noise */
        .area_min_px = 4,
        .area_max_px = 120,
        .extent_max_px = 16,
        .bright_grey = 200,
    };
}

/* Multiplier that brings a sample to 12 bits: 255 of 255 and 65535 of 65535 become 4080. */
static uint32_t grey_gain_q16(int32_t maximum)
{
    return (uint32_t)((GREY_FULL_Q4 * 65536u + (uint32_t)maximum / 2) / (uint32_t)maximum);
}

static uint16_t grey_q4(uint32_t sample, uint32_t maximum, uint32_t gain_q16)
{
    if (sample > maximum) {
        sample = maximum;
    }
    return (uint16_t)((sample * gain_q16 + 32768u) >> 16);
}

static uint16_t frame_grey_q4(const struct ih_frame *frame, int32_t u, int32_t v, uint32_t gain_q16)
{
    u = ih_clamp_s32(u, 0, frame->width - 1);
    v = ih_clamp_s32(v, 0, frame->height - 1);
    const uint8_t *row = (const uint8_t *)frame->samples + (size_t)v * (size_t)frame->stride_bytes;
    uint32_t sample =
        frame->bytes_per_sample == 1 ? row[u] : ((const uint16_t *)(const void *)row)[u];
    return grey_q4(sample, (uint32_t)frame->maximum, gain_q16);
}

/* R at one place, straight from the frame; the rows' way gives the same number. */
static int32_t response_at(const struct ih_frame *frame, int32_t u, int32_t v, uint32_t gain_q16)
{
    static const int32_t binomial[3] = {1, 2, 1};
    int32_t inner = 0;
    int32_t outer = 0;
    for (int32_t dv = -IH_DOTS_REACH; dv <= IH_DOTS_REACH; dv++) {
        for (int32_t du = -IH_DOTS_REACH; du <= IH_DOTS_REACH; du++) {
            int32_t grey = frame_grey_q4(frame, u + du, v + dv, gain_q16);
            outer += grey;
            if (ih_abs_s32(du) <= 1 && ih_abs_s32(dv) <= 1) {
                inner += binomial[du + 1] * binomial[dv + 1] * grey;
            }
        }
    }
    return INNER_WEIGHT * inner - OUTER_WEIGHT * outer;
}

int32_t ih_dots_noise(const struct ih_frame *frame, struct ih_dots_scratch *scratch)
{
    uint16_t *histogram = scratch->noise_histogram;
    memset(histogram, 0, sizeof scratch->noise_histogram);
    uint32_t gain_q16 = grey_gain_q16(frame->maximum);
    int32_t count = 0;
    for (int32_t v = 0; v < frame->height; v += IH_DOTS_NOISE_STEP) {
        for (int32_t u = 0; u < frame->width; u += IH_DOTS_NOISE_STEP) {
            int32_t bin = ih_abs_s32(response_at(frame, u, v, gain_q16)) / IH_DOTS_NOISE_BIN;
            histogram[ih_min_s32(bin, IH_DOTS_NOISE_BINS - 1)]++; /* at most 16,000 in all */
            count++;
        }
    }
    int32_t below = 0;
    int32_t bin = 0;
    while (bin < IH_DOTS_NOISE_BINS - 1 && below + histogram[bin] <= count / 2) {
        below += histogram[bin];
        bin++;
    }
    return (bin + 1) * IH_DOTS_NOISE_BIN;
}

void ih_dots_begin(struct ih_dots_scratch *scratch, struct ih_dots *out,
                   const struct ih_dots_params *params, int32_t width, int32_t height,
                   int32_t noise)
{
    scratch->width = width;
    scratch->height = height;
    scratch->params = *params;
    scratch->rows_in = 0;
    scratch->block_rows = 0;
    scratch->run_count = 0;
    memset(scratch->column_sum, 0, sizeof scratch->column_sum);
    memset(scratch->grey_q4, 0, sizeof scratch->grey_q4);
    memset(scratch->block_sum, 0, sizeof scratch->block_sum);
    for (int32_t i = 0; i < 2 * IH_DOTS_OPEN_MAX; i++) {
        scratch->parent[i] = IH_NONE;
    }
    out->dot_count = 0;
    out->small_count = 0;
    out->large_count = 0;
    out->dots_dropped = 0;
    out->runs_dropped = 0;
    memset(out->bright, 0, sizeof out->bright);
    /* Noise at most 4096 bins of 81 = 2^18.4: the threshold fits for gains below 2^20. */
    int32_t floor = params->floor_grey_q4 * IH_DOTS_RESPONSE_UNIT;
    out->threshold = ih_max_s32(floor, (int32_t)ih_mul_shift(noise, params->noise_gain_q8, 8));
}

/* Keep the dots sorted by v, then u; blobs end nearly in that order. */
static void insert_dot(struct ih_dots *out, struct ih_dot dot)
{
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

static void close_blob(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t index)
{
    const struct ih_dots_blob *blob = &scratch->blob[index];
    const struct ih_dots_params *params = &scratch->params;
    int32_t extent = ih_max_s32(blob->u_max - blob->u_min, blob->v_max - blob->v_min) + 1;
    scratch->parent[index] = IH_NONE;
    if (blob->area_px < params->area_min_px) {
        out->small_count++;
    } else if (blob->area_px > params->area_max_px || extent > params->extent_max_px) {
        out->large_count++;
    } else {
        /* At most 2^10 pixels (area_max): weights below 2^40, times 2^11 px times 2^12: 2^63 is not
         * reached because R stays below 2^22.4, a weight below 2^28.8. */
        insert_dot(out, (struct ih_dot){
                            .u_px_q12 = (int32_t)ih_div_round(blob->weight_u * 4096, blob->weight),
                            .v_px_q12 = (int32_t)ih_div_round(blob->weight_v * 4096, blob->weight),
                            .peak = blob->peak,
                        });
    }
}

static int16_t find_root(struct ih_dots_scratch *scratch, int16_t blob)
{
    while (scratch->parent[blob] != blob) {
        blob = scratch->parent[blob];
    }
    return blob;
}

static void add_blob(struct ih_dots_blob *to, const struct ih_dots_blob *from)
{
    to->weight += from->weight;
    to->weight_u += from->weight_u;
    to->weight_v += from->weight_v;
    to->area_px += from->area_px;
    to->peak = ih_max_s32(to->peak, from->peak);
    to->u_min = (int16_t)ih_min_s32(to->u_min, from->u_min);
    to->u_max = (int16_t)ih_max_s32(to->u_max, from->u_max);
    to->v_min = (int16_t)ih_min_s32(to->v_min, from->v_min);
    to->v_max = (int16_t)ih_max_s32(to->v_max, from->v_max);
}

/* The blob of a run: that of the runs it touches in the row above, joined into one; or a new
 * one. */
static int16_t blob_of_run(struct ih_dots_scratch *scratch, const struct ih_dots_run *run,
                           int32_t *first_previous)
{
    int16_t blob = IH_NONE;
    int32_t i = *first_previous;
    while (i < scratch->previous_count && scratch->previous[i].u_last + 1 < run->u_first) {
        i++;
    }
    *first_previous = i; /* runs further right cannot touch what lies left of here */
    for (; i < scratch->previous_count && scratch->previous[i].u_first <= run->u_last + 1; i++) {
        int16_t other = find_root(scratch, scratch->previous[i].blob);
        if (blob == IH_NONE) {
            blob = other;
        } else if (other != blob) {
            add_blob(&scratch->blob[blob], &scratch->blob[other]);
            scratch->parent[other] = blob;
        }
    }
    for (int16_t k = 0; blob == IH_NONE; k++) {
        if (scratch->parent[k] == IH_NONE) { /* one is free: 2 x OPEN_MAX > runs of two rows */
            blob = k;
            scratch->parent[k] = k;
            scratch->blob[k] = (struct ih_dots_blob){
                .u_min = INT16_MAX, .v_min = INT16_MAX, .u_max = -1, .v_max = -1};
        }
    }
    return blob;
}

/* Sum a run of the row's response. Weights below 2^30 at u < 2^11, over at most 2^20 pixels of a
 * frame: below 2^61. */
static struct ih_dots_blob measure_run(const struct ih_dots_scratch *scratch,
                                       const struct ih_dots_run *run, int32_t row)
{
    struct ih_dots_blob sum = {.area_px = run->u_last - run->u_first + 1,
                               .u_min = run->u_first,
                               .u_max = run->u_last,
                               .v_min = (int16_t)row,
                               .v_max = (int16_t)row};
    for (int32_t u = run->u_first; u <= run->u_last; u++) {
        int64_t response = scratch->response[u] >> WEIGHT_SHIFT;
        int64_t weight = response * response;
        sum.weight += weight;
        sum.weight_u += weight * u;
        sum.peak = ih_max_s32(sum.peak, scratch->response[u]);
    }
    sum.weight_v = sum.weight * row;
    return sum;
}

static void find_runs(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    memcpy(scratch->previous, scratch->run, sizeof scratch->run);
    scratch->previous_count = scratch->run_count;
    scratch->run_count = 0;
    for (int32_t u = 0; u < scratch->width; u++) {
        if (scratch->response[u] <= out->threshold) {
            continue;
        }
        int32_t first = u;
        while (u + 1 < scratch->width && scratch->response[u + 1] > out->threshold) {
            u++;
        }
        if (scratch->run_count == IH_DOTS_OPEN_MAX) {
            out->runs_dropped++;
            continue;
        }
        scratch->run[scratch->run_count++] =
            (struct ih_dots_run){.u_first = (int16_t)first, .u_last = (int16_t)u, .blob = IH_NONE};
    }
}

/* End the blobs of the row above that this row does not continue, and free those joined away. */
static void end_blobs(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t row)
{
    for (int32_t i = 0; i < scratch->run_count; i++) {
        scratch->run[i].blob = find_root(scratch, scratch->run[i].blob);
    }
    for (int32_t i = 0; i < scratch->previous_count; i++) {
        int16_t blob = scratch->previous[i].blob;
        if (scratch->parent[blob] == blob && scratch->blob[blob].v_max < row) {
            close_blob(scratch, out, blob);
        }
    }
    for (int32_t i = 0; i < scratch->previous_count; i++) {
        int16_t blob = scratch->previous[i].blob;
        if (scratch->parent[blob] != blob) {
            scratch->parent[blob] = IH_NONE;
        }
    }
}

static void link_runs(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t row)
{
    int32_t first_previous = 0;
    for (int32_t i = 0; i < scratch->run_count; i++) {
        struct ih_dots_run *run = &scratch->run[i];
        run->blob = blob_of_run(scratch, run, &first_previous);
        struct ih_dots_blob sum = measure_run(scratch, run, row);
        add_blob(&scratch->blob[run->blob], &sum);
    }
    end_blobs(scratch, out, row);
}

/* R of the ring's centre row. Inner sums below 2^16, outer below 2^19: R below 2^23. */
static void filter_row(struct ih_dots_scratch *scratch)
{
    const int32_t width = scratch->width;
    const int32_t centre = scratch->rows_in - RING_CENTRE_LAG;
    const uint16_t *above = scratch->grey_q4[(centre - 1) % IH_DOTS_ROWS];
    const uint16_t *middle = scratch->grey_q4[centre % IH_DOTS_ROWS];
    const uint16_t *below = scratch->grey_q4[(centre + 1) % IH_DOTS_ROWS];
    int32_t box = 0;
    for (int32_t u = -IH_DOTS_REACH; u <= IH_DOTS_REACH; u++) {
        box += (int32_t)scratch->column_sum[ih_clamp_s32(u, 0, width - 1)];
    }
    int32_t left = above[0] + 2 * middle[0] + below[0];
    int32_t here = left;
    for (int32_t u = 0; u < width; u++) {
        int32_t next = ih_min_s32(u + 1, width - 1);
        int32_t right = above[next] + 2 * middle[next] + below[next];
        scratch->response[u] = INNER_WEIGHT * (left + 2 * here + right) - OUTER_WEIGHT * box;
        left = here;
        here = right;
        box += (int32_t)scratch->column_sum[ih_min_s32(u + IH_DOTS_REACH + 1, width - 1)] -
               (int32_t)scratch->column_sum[ih_max_s32(u - IH_DOTS_REACH, 0)];
    }
}

/* A row is in the ring's newest place: bring the column sums up to date, and handle the centre row
 * once it has all its neighbours. */
static void advance(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    scratch->rows_in++;
    if (scratch->rows_in < IH_DOTS_ROWS) {
        return;
    }
    filter_row(scratch);
    find_runs(scratch, out);
    link_runs(scratch, out, scratch->rows_in - IH_DOTS_ROWS);
}

/* Make the ring's oldest place the newest, holding a copy of the row from. */
static void push_row(struct ih_dots_scratch *scratch, const uint16_t *from)
{
    uint16_t *to = scratch->grey_q4[scratch->rows_in % IH_DOTS_ROWS];
    for (int32_t u = 0; u < scratch->width; u++) {
        scratch->column_sum[u] += (uint32_t)from[u] - to[u]; /* modulo 2^32; the sum is >= 0 */
        to[u] = from[u];
    }
}

static void finish_blocks(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t block_row)
{
    for (int32_t block = 0; block * IH_DOTS_BLOCK < scratch->width; block++) {
        int32_t columns = ih_min_s32(IH_DOTS_BLOCK, scratch->width - block * IH_DOTS_BLOCK);
        int32_t pixels = columns * scratch->block_rows;
        if ((int32_t)scratch->block_sum[block] > scratch->params.bright_grey * 16 * pixels) {
            out->bright[block_row][block / 32] |= 1u << (block % 32);
        }
    }
    memset(scratch->block_sum, 0, sizeof scratch->block_sum);
    scratch->block_rows = 0;
}

static void add_to_blocks(struct ih_dots_scratch *scratch, struct ih_dots *out,
                          const uint16_t *row_q4, int32_t row)
{
    for (int32_t u = 0; u < scratch->width; u++) {
        scratch->block_sum[u / IH_DOTS_BLOCK] += row_q4[u];
    }
    scratch->block_rows++;
    if (scratch->block_rows == IH_DOTS_BLOCK || row == scratch->height - 1) {
        finish_blocks(scratch, out, row / IH_DOTS_BLOCK);
    }
}

void ih_dots_row(struct ih_dots_scratch *scratch, struct ih_dots *out, const void *samples,
                 int32_t bytes_per_sample, int32_t maximum)
{
    uint16_t *row_q4 = scratch->incoming_q4;
    uint32_t gain_q16 = grey_gain_q16(maximum);
    for (int32_t u = 0; u < scratch->width; u++) {
        uint32_t sample =
            bytes_per_sample == 1 ? ((const uint8_t *)samples)[u] : ((const uint16_t *)samples)[u];
        row_q4[u] = grey_q4(sample, (uint32_t)maximum, gain_q16);
    }
    int32_t row = ih_max_s32(0, scratch->rows_in - IH_DOTS_REACH);
    add_to_blocks(scratch, out, row_q4, row);
    int32_t copies = scratch->rows_in == 0 ? IH_DOTS_REACH + 1 : 1; /* repeat the first upwards */
    for (int32_t i = 0; i < copies; i++) {
        push_row(scratch, row_q4);
        advance(scratch, out);
    }
}

void ih_dots_end(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    for (int32_t i = 0; i < IH_DOTS_REACH; i++) { /* repeat the last row downwards */
        push_row(scratch, scratch->incoming_q4);
        advance(scratch, out);
    }
    /* An empty row below the frame ends what is still open. */
    memset(scratch->response, 0, sizeof scratch->response);
    find_runs(scratch, out);
    link_runs(scratch, out, scratch->height);
}

void ih_dots_find(const struct ih_frame *frame, const struct ih_dots_params *params,
                  struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    int32_t noise = ih_dots_noise(frame, scratch);
    ih_dots_begin(scratch, out, params, frame->width, frame->height, noise);
    for (int32_t v = 0; v < frame->height; v++) {
        const uint8_t *row =
            (const uint8_t *)frame->samples + (size_t)v * (size_t)frame->stride_bytes;
        ih_dots_row(scratch, out, row, frame->bytes_per_sample, frame->maximum);
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
