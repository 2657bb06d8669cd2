#include "dots/ih_dots.h"

#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "simd/ih_lanes.h"
#include "simd/ih_words.h"

/* The centre is taken over so many pixels on each side of the peak, */
#define CENTRE_REACH 2
/* of a plateau over so many; */
#define PLATEAU_REACH 4
/* and its ring is at most so far from the peak. */
#define SHIFT_MAX 2
/* Columns that are worked out for a centre: those that it needs, or as many as vectors have lanes. */
#define CENTRE_SIDE (2 * CENTRE_REACH + 1)
#if IH_LANES != 0
#define CENTRE_COLUMNS 8
#else
#define CENTRE_COLUMNS CENTRE_SIDE
#endif
#define TWIN_PX_Q12 (3 * 4096)
#define GROUP IH_BANDPASS_GROUP
_Static_assert(GROUP == IH_NOISE_BLOCK, "a group has one limit, that of its column of blocks");
/* So many maxima are judged together at most. */
#define CHUNK 64
/* Rows of the frame that are asked for before they are taken: most of the time memory needs is gone then. */
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

/* What of a row of the ring no row of R is laid over: zeros around the frame. */
static void clear_outside(struct ih_dots_scratch *scratch, int32_t row)
{
    int16_t *response = scratch->rows.detection.response[row];
    const int32_t end =
        row < IH_DOTS_REACH ? 0 : IH_DOTS_SIDE + scratch->width; /* above the frame all of it */
    memset(response, 0, IH_DOTS_SIDE * sizeof response[0]);
    memset(&response[end], 0,
           sizeof scratch->rows.detection.response[0] - (size_t)end * sizeof response[0]);
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
    const uint32_t row = (uint32_t)(v + IH_DOTS_REACH);
    return &scratch->rows.detection.response[row % IH_DOTS_ROWS][IH_DOTS_SIDE];
}

/* Rows of R around some row are given as near[-IH_DOTS_REACH] to near[IH_DOTS_REACH], pixel 0 of each. */

/* The greatest of two places to both sides of a pixel. */
static inline int32_t beside_at(const int16_t *pixel, int32_t distance)
{
    return ih_max_s32(pixel[-distance], pixel[distance]);
}

/* Around a pixel of row dv. Nothing is left out when one is above the limit: which one cannot be
 * foreseen, and a wrong guess costs a processor more than all of them. */
static bool stands_alone(const int16_t *const *near, int32_t u, int32_t dv, int32_t limit)
{
    const int16_t *top = &near[dv - 4][u];
    const int16_t *bottom = &near[dv + 4][u];
    int32_t max = ih_max_s32(top[0], bottom[0]);
    max = ih_max_s32(max, beside_at(top, 2));
    max = ih_max_s32(max, beside_at(bottom, 2));
    max = ih_max_s32(max, beside_at(&near[dv - 3][u], 3));
    max = ih_max_s32(max, beside_at(&near[dv + 3][u], 3));
    max = ih_max_s32(max, beside_at(&near[dv - 2][u], 4));
    max = ih_max_s32(max, beside_at(&near[dv][u], 4));
    max = ih_max_s32(max, beside_at(&near[dv + 2][u], 4));
    return max <= limit;
}

/* Sum of R over the four pixels beside a peak; one outside the frame counts as the one opposite. */
static int32_t beside(const struct ih_dots_scratch *scratch, const int16_t *const *near, int32_t u,
                      int32_t v)
{
    const int16_t *middle = near[0];
    const int32_t left = u > 0 ? u - 1 : u + 1;
    const int32_t right = u + 1 < scratch->width ? u + 1 : u - 1;
    const int32_t above = v > 0 ? -1 : 1;
    const int32_t below = v + 1 < scratch->height ? 1 : -1;
    return middle[left] + middle[right] + near[above][u] + near[below][u];
}

/* A row's weights: (R - least)^2 where that is positive. */
static inline int32_t weight(int16_t response, int32_t min)
{
    const int32_t above = ih_max_s32(0, response - min);
    return above * above;
}

static struct ih_dot dot_at(const int16_t *const *near, int32_t u, int32_t v, int64_t weight_sum,
                            int64_t sum_u, int64_t sum_v)
{
    return (struct ih_dot){
        .u_px_q12 = u * 4096 + (int32_t)ih_div_round(sum_u * 4096, weight_sum),
        .v_px_q12 = v * 4096 + (int32_t)ih_div_round(sum_v * 4096, weight_sum),
        .peak = near[0][u],
    };
}

/* R <= 18,648, and the peak is only the greatest of nine: squared 2^28.4, five of them 2^30.8. Columns behind the
 * fifth are there for vectors and do not count. */
static struct ih_dot centred(const int16_t *const *near, int32_t u, int32_t v)
{
    const int16_t *row[CENTRE_SIDE];
    int32_t column[CENTRE_COLUMNS];
    int32_t moment[CENTRE_COLUMNS];
    for (int32_t i = 0; i < CENTRE_SIDE; i++) {
        row[i] = &near[i - CENTRE_REACH][u - CENTRE_REACH];
    }
    const int32_t min = row[CENTRE_REACH][CENTRE_REACH] / 4;
    for (int32_t i = 0; i < CENTRE_COLUMNS; i++) {
        const int32_t first = weight(row[0][i], min);
        const int32_t second = weight(row[1][i], min);
        const int32_t fourth = weight(row[3][i], min);
        const int32_t fifth = weight(row[4][i], min);
        column[i] = first + second + weight(row[2][i], min) + fourth + fifth;
        moment[i] = 2 * (fifth - first) + fourth - second;
    }
    int64_t weight_sum = 0;
    int64_t sum_v = 0;
    for (int32_t i = 0; i < CENTRE_SIDE; i++) {
        weight_sum += column[i];
        sum_v += moment[i];
    }
    const int64_t sum_u = 2 * ((int64_t)column[4] - column[0]) + column[3] - column[1];
    return dot_at(near, u, v, weight_sum, sum_u, sum_v);
}

/* Of a row of nine 2^30.8, of 81 2^34; offsets of 4 in Q12 2^48. */
static struct ih_dot centred_plateau(const int16_t *const *near, int32_t u, int32_t v)
{
    const int32_t min = near[0][u] / 4;
    int64_t weight_sum = 0;
    int64_t sum_u = 0;
    int64_t sum_v = 0;
    for (int32_t dv = -PLATEAU_REACH; dv <= PLATEAU_REACH; dv++) {
        const int16_t *row = &near[dv][u];
        int64_t row_sum = 0;
        for (int32_t du = -PLATEAU_REACH; du <= PLATEAU_REACH; du++) {
            const int32_t one = weight(row[du], min);
            row_sum += one;
            sum_u += (int64_t)one * du;
        }
        weight_sum += row_sum;
        sum_v += row_sum * dv;
    }
    return dot_at(near, u, v, weight_sum, sum_u, sum_v);
}

/* The pixel of a plateau's centre, near the peak's. */
static int32_t ring_place(int32_t centre_px_q12, int32_t peak_px)
{
    int32_t pixel = (int32_t)ih_shift_round(centre_px_q12, 12);
    return ih_clamp_s32(pixel, peak_px - SHIFT_MAX, peak_px + SHIFT_MAX);
}

static int32_t threshold_of(const struct ih_dots_scratch *scratch, int32_t noise)
{
    const int64_t wanted = ih_mul_shift(noise, scratch->params.noise_gain_q8, 8);
    return ih_max_s32(scratch->floor, ih_saturate_s32(wanted));
}

/* A maximum above its threshold. */
struct maximum {
    int16_t u;
    uint8_t row; /* of its batch */
    bool is_flat;
};

/* Rows that are judged together. */
struct batch {
    const int16_t *row[IH_DOTS_ROWS]; /* pixel 0 of the first one's near[-IH_DOTS_REACH] and on */
    int32_t first_v;
    int32_t count; /* maxima that wait */
    struct maximum maximum[CHUNK];
};

static const int16_t *const *near_of(const struct batch *batch, int32_t row)
{
    return &batch->row[row + IH_DOTS_REACH];
}

/* Of the maxima that wait those stay that may be dots, the others are counted. Which are which no processor
 * foresees, and a wrong guess costs it more than all that is asked: it is worked out for each of them. */
static void sieve(const struct ih_dots_scratch *scratch, struct ih_dots *out, struct batch *batch)
{
    const struct ih_dots_params *params = &scratch->params;
    int32_t kept = 0;
    for (int32_t i = 0; i < batch->count; i++) {
        struct maximum one = batch->maximum[i];
        const int16_t *const *near = near_of(batch, one.row);
        const int32_t peak = near[0][one.u];
        const int32_t ring_max = (int32_t)ih_mul_shift(peak, params->ring_max_q8, 8);
        const int64_t beside_q6 =
            (int64_t)beside(scratch, near, one.u, batch->first_v + one.row) * 64;
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

/* What the sieve left: a dot, or not after all. */
static void place(const struct ih_dots_scratch *scratch, struct ih_dots *out,
                  const int16_t *const *near, int32_t u, int32_t v, bool is_flat)
{
    const struct ih_dot dot = is_flat ? centred_plateau(near, u, v) : centred(near, u, v);
    const int32_t ring_max = (int32_t)ih_mul_shift(dot.peak, scratch->params.ring_max_q8, 8);
    if ((is_flat && !stands_alone(near, ring_place(dot.u_px_q12, u),
                                  ring_place(dot.v_px_q12, v) - v, ring_max)) ||
        has_twin(out, &dot)) {
        out->edge_count++;
        return;
    }
    insert_dot(out, dot);
}

/* All that wait. */
static void judge(const struct ih_dots_scratch *scratch, struct ih_dots *out, struct batch *batch)
{
    sieve(scratch, out, batch);
    for (int32_t i = 0; i < batch->count; i++) {
        const struct maximum *one = &batch->maximum[i];
        place(scratch, out, near_of(batch, one->row), one->u, batch->first_v + one->row,
              one->is_flat);
    }
    batch->count = 0;
}

/* Where row v of R goes, and what is listed of it. */
static struct ih_bandpass_row *listed_of(struct ih_dots_scratch *scratch, int32_t v)
{
    return &scratch->rows.detection.listed[(uint32_t)v % IH_DOTS_ROWS];
}

/* What no threshold of row v is below, group by group, which are as wide as blocks of noise. It changes where v
 * comes between other blocks' centres, and holds for the rows before until they are judged. Not below 0, so
 * that nothing around the frame is above. */
static uint32_t *limits_of(struct ih_dots_scratch *scratch, int32_t v)
{
    const uint32_t cell = (uint32_t)(v + IH_NOISE_BLOCK / 2) / IH_NOISE_BLOCK;
    return scratch->rows.detection.limit[cell % 2];
}

static void lay_limits(struct ih_dots_scratch *scratch, int32_t v)
{
    const struct ih_noise_row row = ih_noise_row(&scratch->noise, v);
    uint32_t *limit = limits_of(scratch, v);
    for (int32_t i = 0; i < row.columns; i++) {
        const int32_t threshold = threshold_of(scratch, ih_noise_min(&row, i));
        limit[i] = IH_WORD_BOTH((uint32_t)ih_clamp_s32(threshold, 0, INT16_MAX));
    }
}

#if IH_LANES && !IH_WORDS
/* Maxima above the limit: as great as all that are read later, greater than all before. */
static inline ih_lanes maxima_of(const int16_t *above, const int16_t *middle, const int16_t *below,
                                 uint32_t limit)
{
    const ih_lanes peak = ih_lanes_load(middle);
    const ih_lanes before =
        ih_lanes_max(ih_lanes_max(ih_lanes_load(&above[-1]), ih_lanes_load(above)),
                     ih_lanes_max(ih_lanes_load(&above[1]), ih_lanes_load(&middle[-1])));
    const ih_lanes after =
        ih_lanes_max(ih_lanes_max(ih_lanes_load(&below[-1]), ih_lanes_load(below)),
                     ih_lanes_max(ih_lanes_load(&below[1]), ih_lanes_load(&middle[1])));
    const ih_lanes passed = ih_lanes_greater(peak, ih_lanes_max(before, ih_lanes_both(limit)));
    return ih_lanes_without(passed, ih_lanes_greater(after, peak));
}
#endif

#if !IH_LANES || IH_WORDS
/* Of equal neighbours the first in reading order is a maximum. */
static bool is_maximum(const int16_t *above, const int16_t *middle, const int16_t *below,
                       int16_t limit)
{
    const int16_t peak = middle[0];
    return peak > limit && peak > middle[-1] && peak >= middle[1] && peak > above[-1] &&
           peak > above[0] && peak > above[1] && peak >= below[-1] && peak >= below[0] &&
           peak >= below[1];
}
#endif

/* Which of GROUP pixels are maxima above the limit, the first of them in the lowest bit. */
static uint32_t mark_maxima(const int16_t *above, const int16_t *middle, const int16_t *below,
                            uint32_t limit)
{
    uint32_t maxima = 0;
#if !IH_LANES || IH_WORDS
    const int16_t one_limit = (int16_t)(limit & INT16_MAX);
#endif
#if IH_WORDS
    for (int32_t u = 0; u < GROUP; u += 2) {
        if ((ih_word_below(limit, ih_word(&middle[u])) & IH_WORD_SIGNS) != 0) {
            const int32_t next = u + 1;
            maxima |= (uint32_t)is_maximum(&above[u], &middle[u], &below[u], one_limit) << u;
            maxima |= (uint32_t)is_maximum(&above[next], &middle[next], &below[next], one_limit)
                      << next;
        }
    }
#elif IH_LANES != 0
    for (int32_t u = 0; u < GROUP; u += 2 * IH_LANES) {
        const int32_t next = u + IH_LANES;
        maxima |= ih_lanes_bits(maxima_of(&above[u], &middle[u], &below[u], limit),
                                maxima_of(&above[next], &middle[next], &below[next], limit))
                  << u;
    }
#else
    for (int32_t u = 0; u < GROUP; u++) {
        maxima |= (uint32_t)is_maximum(&above[u], &middle[u], &below[u], one_limit) << u;
    }
#endif
    return maxima;
}

/* Groups of a row that have maxima. */
struct marked {
    int32_t count;
    int16_t first[IH_BANDPASS_GROUPS];
    uint32_t maxima[IH_BANDPASS_GROUPS];
};

/* Of those that are listed; they are put down without asking. */
static void mark_row(struct ih_dots_scratch *scratch, int32_t v, struct marked *out)
{
    const struct ih_bandpass_row *listed = listed_of(scratch, v);
    const int16_t *above = response_row(scratch, v - 1);
    const int16_t *middle = response_row(scratch, v);
    const int16_t *below = response_row(scratch, v + 1);
    int32_t count = 0;
    for (int32_t i = 0; i < listed->count; i++) {
        const int16_t first = listed->first[i];
        const uint32_t maxima =
            mark_maxima(&above[first], &middle[first], &below[first], listed->limit[first / GROUP]);
        out->first[count] = first; /* the next one's place if it is none */
        out->maxima[count] = maxima;
        count += maxima != 0;
    }
    out->count = count;
}

/* The maxima of a batch's row that are above their thresholds join those that wait. */
static void find_maxima(struct ih_dots_scratch *scratch, struct ih_dots *out, struct batch *batch,
                        int32_t row)
{
    const int32_t v = batch->first_v + row;
    const int16_t *response = response_row(scratch, v);
    const struct ih_noise_row noise = ih_noise_row(&scratch->noise, v);
    struct marked marked;
    mark_row(scratch, v, &marked);
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
    const int32_t last = scratch->response_rows++ - IH_DOTS_REACH; /* has all its neighbours now */
    const int32_t rows = last % IH_DOTS_BATCH + 1;
    if (last >= 0 && (rows == IH_DOTS_BATCH || last == scratch->height - 1)) {
        find_dots(scratch, out, last + 1 - rows, rows);
    }
    if (scratch->response_rows % IH_NOISE_BLOCK == IH_NOISE_BLOCK / 2) {
        lay_limits(scratch, scratch->response_rows);
    }
}

/* Where the next row of R goes, with its limits. */
static struct ih_bandpass_row *next_row(struct ih_dots_scratch *scratch)
{
    struct ih_bandpass_row *next = listed_of(scratch, scratch->response_rows);
    next->response = response_row(scratch, scratch->response_rows);
    next->limit = limits_of(scratch, scratch->response_rows);
    return next;
}

static uint16_t max(const uint16_t *sum, int32_t count)
{
    uint16_t max = 0;
    for (int32_t i = 0; i < count; i++) {
        max = sum[i] > max ? sum[i] : max;
    }
    return max;
}

/* A row of blocks of which each column's sum is given, and what a bright column has more than. Where
 * no column is bright no block is. */
static void mark_bright(struct ih_dots *out, int32_t block_row, const uint16_t *sum, int32_t width,
                        int32_t limit)
{
    if (max(sum, width) <= limit) {
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

/* Rows of blocks before the ambient light is subtracted; without it they are known to the band. */
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
    lay_limits(scratch, 0);
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
