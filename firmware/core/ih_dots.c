#include "ih_dots.h"

#include <string.h>

#include "ih_fix.h"

/* The centre is taken over so many pixels on each side of the peak, */
#define CENTRE_REACH 2
/* of a plateau over so many; */
#define PLATEAU_REACH 4
/* and its ring is at most so far from the peak. */
#define SHIFT_MAX 2
#define TWIN_PX_Q12 (3 * 4096)
#define RING_PLACES 16

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

void ih_dots_begin(struct ih_dots_scratch *scratch, struct ih_dots *out,
                   const struct ih_dots_params *params, int32_t width, int32_t height,
                   const struct ih_noise *noise)
{
    scratch->params = *params;
    scratch->height = height;
    scratch->rows_taken = 0;
    scratch->response_rows = 0;
    scratch->block_rows = 0;
    if (noise != &scratch->noise) {
        scratch->noise = *noise;
    }
    ih_band_begin(&scratch->rows.finding.band, width);
    memset(scratch->rows.finding.response, 0, sizeof scratch->rows.finding.response);
    memset(scratch->block_sum, 0, sizeof scratch->block_sum);
    out->dot_count = 0;
    out->edge_count = 0;
    out->hot_count = 0;
    out->dots_dropped = 0;
    memset(out->bright, 0, sizeof out->bright);
}

static bool has_twin(const struct ih_dots *dots, const struct ih_dot *dot)
{
    for (int32_t i = dots->dot_count - 1;
         i >= 0 && dots->dot[i].v_px_q12 > dot->v_px_q12 - TWIN_PX_Q12; i--) {
        if (ih_abs_s32(dots->dot[i].u_px_q12 - dot->u_px_q12) < TWIN_PX_Q12 &&
            dots->dot[i].v_px_q12 < dot->v_px_q12 + TWIN_PX_Q12) {
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
    return &scratch->rows.finding.response[(v + IH_DOTS_REACH) % IH_DOTS_ROWS][IH_DOTS_REACH];
}

/* Of equal neighbours the first in reading order is the maximum. */
static bool is_maximum(struct ih_dots_scratch *scratch, int32_t u, int32_t v)
{
    const int16_t *above = response_row(scratch, v - 1);
    const int16_t *middle = response_row(scratch, v);
    const int16_t *below = response_row(scratch, v + 1);
    const int32_t peak = middle[u];
    return peak > above[u - 1] && peak > above[u] && peak > above[u + 1] && peak > middle[u - 1] &&
           peak >= middle[u + 1] && peak >= below[u - 1] && peak >= below[u] &&
           peak >= below[u + 1];
}

static bool stands_alone(struct ih_dots_scratch *scratch, int32_t u, int32_t v, int32_t limit)
{
    static const int8_t ring[RING_PLACES][2] = {
        {4, 0},  {4, 2},   {3, 3},   {2, 4},   {0, 4},  {-2, 4}, {-3, 3}, {-4, 2},
        {-4, 0}, {-4, -2}, {-3, -3}, {-2, -4}, {0, -4}, {2, -4}, {3, -3}, {4, -2},
    };
    for (int32_t i = 0; i < RING_PLACES; i++) {
        if (response_row(scratch, v + ring[i][1])[u + ring[i][0]] > limit) {
            return false;
        }
    }
    return true;
}

/* Sum of R over the four pixels beside a peak; one outside the frame counts as the one opposite. */
static int32_t beside(struct ih_dots_scratch *scratch, int32_t u, int32_t v)
{
    const int32_t width = scratch->rows.finding.band.width;
    const int16_t *middle = response_row(scratch, v);
    int32_t left = u > 0 ? u - 1 : u + 1;
    int32_t right = u + 1 < width ? u + 1 : u - 1;
    int32_t above = v > 0 ? v - 1 : v + 1;
    int32_t below = v + 1 < scratch->height ? v + 1 : v - 1;
    return middle[left] + middle[right] + response_row(scratch, above)[u] +
           response_row(scratch, below)[u];
}

/* Weights: R <= 18,648, squared 2^28.4; 81 of them 2^34.8; offsets of 4 in Q12 2^49. */
static struct ih_dot centred(struct ih_dots_scratch *scratch, int32_t u, int32_t v, int32_t reach)
{
    const int32_t peak = response_row(scratch, v)[u];
    int64_t weight_sum = 0;
    int64_t sum_u = 0;
    int64_t sum_v = 0;
    for (int32_t dv = -reach; dv <= reach; dv++) {
        const int16_t *row = response_row(scratch, v + dv);
        for (int32_t du = -reach; du <= reach; du++) {
            int64_t above = ih_max_s32(0, row[u + du] - peak / 4);
            weight_sum += above * above;
            sum_u += above * above * du;
            sum_v += above * above * dv;
        }
    }
    return (struct ih_dot){
        .u_px_q12 = u * 4096 + (int32_t)ih_div_round(sum_u * 4096, weight_sum),
        .v_px_q12 = v * 4096 + (int32_t)ih_div_round(sum_v * 4096, weight_sum),
        .peak = peak,
    };
}

/* The pixel of a plateau's centre, near the peak's. */
static int32_t ring_place(int32_t centre_px_q12, int32_t peak_px)
{
    int32_t pixel = (int32_t)ih_shift_round(centre_px_q12, 12);
    return ih_clamp_s32(pixel, peak_px - SHIFT_MAX, peak_px + SHIFT_MAX);
}

static int32_t threshold_of(const struct ih_dots_params *params, int32_t noise)
{
    int32_t floor = (int32_t)ih_mul_shift(params->floor_grey_q4, IH_BAND_UNIT, 4);
    return ih_max_s32(floor, ih_saturate_s32(ih_mul_shift(noise, params->noise_gain_q8, 8)));
}

/* A maximum above its threshold: a dot, or why not. */
static void judge(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t u, int32_t v)
{
    const struct ih_dots_params *params = &scratch->params;
    const int32_t peak = response_row(scratch, v)[u];
    const int32_t ring_max = (int32_t)ih_mul_shift(peak, params->ring_max_q8, 8);
    const int64_t beside_q6 = (int64_t)beside(scratch, u, v) * 64;
    const bool flat = beside_q6 >= (int64_t)peak * params->flat_min_q8;
    if (beside_q6 < (int64_t)peak * params->side_min_q8) {
        out->hot_count++;
        return;
    }
    if (!flat && !stands_alone(scratch, u, v, ring_max)) {
        out->edge_count++;
        return;
    }
    struct ih_dot dot = centred(scratch, u, v, flat ? PLATEAU_REACH : CENTRE_REACH);
    if ((flat && !stands_alone(scratch, ring_place(dot.u_px_q12, u), ring_place(dot.v_px_q12, v),
                               ring_max)) ||
        has_twin(out, &dot)) {
        out->edge_count++;
        return;
    }
    insert_dot(out, dot);
}

/* The greatest R of so many pixels. */
static int32_t greatest(const int16_t *response, int32_t count)
{
    int16_t most = INT16_MIN;
    for (int32_t u = 0; u < count; u++) {
        if (response[u] > most) {
            most = response[u];
        }
    }
    return most;
}

/* Pixels of a row between the centres of two blocks of the noise. */
struct span {
    int32_t v, first, end;
    int32_t least; /* no threshold in between is lower */
};

static void find_in_span(struct ih_dots_scratch *scratch, struct ih_dots *out,
                         const struct span *span, const uint16_t noise[IH_NOISE_BLOCKS_X])
{
    const int32_t v = span->v;
    const int16_t *response = response_row(scratch, v);
    for (int32_t u = span->first; u < span->end; u++) {
        if (response[u] > span->least && is_maximum(scratch, u, v) &&
            response[u] > threshold_of(&scratch->params, ih_noise_at(&scratch->noise, noise, u))) {
            judge(scratch, out, u, v);
        }
    }
}

/* Row v has all its neighbours in the ring. Most of its spans have nothing above any threshold. */
static void find_dots(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t v)
{
    uint16_t noise[IH_NOISE_BLOCKS_X];
    const int32_t width = scratch->rows.finding.band.width;
    const int32_t last = scratch->noise.columns - 1;
    struct span span = {.v = v};
    (void)ih_noise_row(&scratch->noise, v, noise);
    int32_t column = 0;
    while (span.first < width) {
        const int32_t left = noise[ih_max_s32(column - 1, 0)];
        const int32_t right = noise[ih_min_s32(column, last)];
        span.end = ih_min_s32(column * IH_NOISE_BLOCK + IH_NOISE_BLOCK / 2, width);
        span.least = threshold_of(&scratch->params, ih_min_s32(left, right));
        if (greatest(&response_row(scratch, v)[span.first], span.end - span.first) > span.least) {
            find_in_span(scratch, out, &span, noise);
        }
        span.first = span.end;
        column++;
    }
}

/* The row of R after the last one in the ring is complete. */
static void advance(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    int32_t v = scratch->response_rows++ - IH_DOTS_REACH;
    if (v >= 0) {
        find_dots(scratch, out, v);
    }
}

static void push_row(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    if (ih_band_push(&scratch->rows.finding.band, response_row(scratch, scratch->response_rows))) {
        advance(scratch, out);
    }
}

static void finish_blocks(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t block_row)
{
    const int32_t width = scratch->rows.finding.band.width;
    for (int32_t block = 0; block * IH_DOTS_BLOCK < width; block++) {
        int32_t columns = ih_min_s32(IH_DOTS_BLOCK, width - block * IH_DOTS_BLOCK);
        int32_t pixels = columns * scratch->block_rows;
        if ((int32_t)scratch->block_sum[block] > scratch->params.bright_grey * 16 * pixels) {
            out->bright[block_row][block / 32] |= 1u << (block % 32);
        }
    }
    memset(scratch->block_sum, 0, sizeof scratch->block_sum);
    scratch->block_rows = 0;
}

static void add_to_blocks(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t row)
{
    const struct ih_band *band = &scratch->rows.finding.band;
    const int32_t whole = band->width / IH_DOTS_BLOCK;
    const uint16_t *grey_q4 = band->incoming_q4;
    for (int32_t block = 0; block < whole; block++) {
        uint32_t sum = 0;
        for (int32_t i = 0; i < IH_DOTS_BLOCK; i++) {
            sum += *grey_q4++;
        }
        scratch->block_sum[block] += sum;
    }
    for (int32_t u = whole * IH_DOTS_BLOCK; u < band->width; u++) { /* what is left of a block */
        scratch->block_sum[whole] += *grey_q4++;
    }
    scratch->block_rows++;
    if (scratch->block_rows == IH_DOTS_BLOCK || row == scratch->height - 1) {
        finish_blocks(scratch, out, row / IH_DOTS_BLOCK);
    }
}

void ih_dots_row(struct ih_dots_scratch *scratch, struct ih_dots *out, const struct ih_row *row,
                 const struct ih_row *ambient)
{
    struct ih_band *band = &scratch->rows.finding.band;
    int32_t v = scratch->rows_taken++;
    int32_t copies = v == 0 ? IH_BAND_REACH + 1 : 1; /* repeat the first upwards */
    ih_row_grey(row, band->width, band->incoming_q4);
    add_to_blocks(scratch, out, v);
    if (ambient != NULL) {
        ih_row_grey(ambient, band->width, scratch->ambient_q4);
        ih_noise_subtract(&scratch->noise, v, band->width, scratch->ambient_q4, band->incoming_q4);
    }
    for (int32_t i = 0; i < copies; i++) {
        push_row(scratch, out);
    }
}

void ih_dots_end(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    for (int32_t i = 0; i < IH_BAND_REACH; i++) { /* repeat the last row downwards */
        push_row(scratch, out);
    }
    for (int32_t i = 0; i < IH_DOTS_REACH; i++) { /* nothing below the frame */
        memset(
            scratch->rows.finding.response[(scratch->response_rows + IH_DOTS_REACH) % IH_DOTS_ROWS],
            0, sizeof scratch->rows.finding.response[0]);
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
        struct ih_row row = ih_frame_row(frame, v);
        struct ih_row under = ih_frame_row(ambient != NULL ? ambient : frame, v);
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
