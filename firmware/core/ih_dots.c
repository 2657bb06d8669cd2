#include "ih_dots.h"

#include <string.h>

#include "ih_fix.h"
#include "ih_words.h"

#include "ih_lanes.h"

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
/* So many pixels are passed over at once where none is above its threshold. */
#define GROUP 32

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
    int16_t *response = scratch->rows.finding.response[row];
    const int32_t end =
        row < IH_DOTS_REACH ? 0 : IH_DOTS_SIDE + scratch->width; /* above the frame all of it */
    memset(response, 0, IH_DOTS_SIDE * sizeof response[0]);
    memset(&response[end], 0,
           sizeof scratch->rows.finding.response[0] - (size_t)end * sizeof response[0]);
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
    const uint32_t row = (uint32_t)(v + IH_DOTS_REACH);
    return &scratch->rows.finding.response[row % IH_DOTS_ROWS][IH_DOTS_SIDE];
}

/* Rows of R around one row, which is in the middle; pixel 0 of each. */
struct near {
    const int16_t *row[IH_DOTS_ROWS];
};

static void lay_near(struct ih_dots_scratch *scratch, int32_t v, struct near *out)
{
    uint32_t row = (uint32_t)v % IH_DOTS_ROWS;
    for (int32_t i = 0; i < IH_DOTS_ROWS; i++) {
        out->row[i] = &scratch->rows.finding.response[row][IH_DOTS_SIDE];
        row = row + 1 == IH_DOTS_ROWS ? 0 : row + 1;
    }
}

static const int16_t *near_row(const struct near *near, int32_t dv)
{
    return near->row[IH_DOTS_REACH + dv];
}

/* The greatest of two places to both sides of a pixel. */
static inline int32_t beside_at(const int16_t *pixel, int32_t distance)
{
    return ih_max_s32(pixel[-distance], pixel[distance]);
}

/* Around a pixel of row dv. Nothing is left out when one is above the limit: which one cannot be
 * foreseen, and a wrong guess costs a processor more than all of them. */
static bool stands_alone(const struct near *near, int32_t u, int32_t dv, int32_t limit)
{
    const int16_t *top = &near_row(near, dv - 4)[u];
    const int16_t *bottom = &near_row(near, dv + 4)[u];
    int32_t most = ih_max_s32(top[0], bottom[0]);
    most = ih_max_s32(most, beside_at(top, 2));
    most = ih_max_s32(most, beside_at(bottom, 2));
    most = ih_max_s32(most, beside_at(&near_row(near, dv - 3)[u], 3));
    most = ih_max_s32(most, beside_at(&near_row(near, dv + 3)[u], 3));
    most = ih_max_s32(most, beside_at(&near_row(near, dv - 2)[u], 4));
    most = ih_max_s32(most, beside_at(&near_row(near, dv)[u], 4));
    most = ih_max_s32(most, beside_at(&near_row(near, dv + 2)[u], 4));
    return most <= limit;
}

/* Sum of R over the four pixels beside a peak; one outside the frame counts as the one opposite. */
static int32_t beside(const struct ih_dots_scratch *scratch, const struct near *near, int32_t u,
                      int32_t v)
{
    const int16_t *middle = near_row(near, 0);
    const int32_t left = u > 0 ? u - 1 : u + 1;
    const int32_t right = u + 1 < scratch->width ? u + 1 : u - 1;
    const int32_t above = v > 0 ? -1 : 1;
    const int32_t below = v + 1 < scratch->height ? 1 : -1;
    return middle[left] + middle[right] + near_row(near, above)[u] + near_row(near, below)[u];
}

/* A row's weights: (R - least)^2 where that is positive. */
static inline int32_t weight(int16_t response, int32_t least)
{
    const int32_t above = ih_max_s32(0, response - least);
    return above * above;
}

static struct ih_dot dot_at(const struct near *near, int32_t u, int32_t v, int64_t weight_sum,
                            int64_t sum_u, int64_t sum_v)
{
    return (struct ih_dot){
        .u_px_q12 = u * 4096 + (int32_t)ih_div_round(sum_u * 4096, weight_sum),
        .v_px_q12 = v * 4096 + (int32_t)ih_div_round(sum_v * 4096, weight_sum),
        .peak = near_row(near, 0)[u],
    };
}

/* R <= 18,648, and the peak is only the greatest of nine: squared 2^28.4, five of them 2^30.8. Columns behind the
 * fifth are there for vectors and do not count. */
static struct ih_dot centred(const struct near *near, int32_t u, int32_t v)
{
    const int16_t *row[CENTRE_SIDE];
    int32_t column[CENTRE_COLUMNS];
    int32_t moment[CENTRE_COLUMNS];
    for (int32_t i = 0; i < CENTRE_SIDE; i++) {
        row[i] = &near_row(near, i - CENTRE_REACH)[u - CENTRE_REACH];
    }
    const int32_t least = row[CENTRE_REACH][CENTRE_REACH] / 4;
    for (int32_t i = 0; i < CENTRE_COLUMNS; i++) {
        const int32_t first = weight(row[0][i], least);
        const int32_t second = weight(row[1][i], least);
        const int32_t fourth = weight(row[3][i], least);
        const int32_t fifth = weight(row[4][i], least);
        column[i] = first + second + weight(row[2][i], least) + fourth + fifth;
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
static struct ih_dot centred_plateau(const struct near *near, int32_t u, int32_t v)
{
    const int32_t least = near_row(near, 0)[u] / 4;
    int64_t weight_sum = 0;
    int64_t sum_u = 0;
    int64_t sum_v = 0;
    for (int32_t dv = -PLATEAU_REACH; dv <= PLATEAU_REACH; dv++) {
        const int16_t *row = &near_row(near, dv)[u];
        int64_t row_sum = 0;
        for (int32_t du = -PLATEAU_REACH; du <= PLATEAU_REACH; du++) {
            const int32_t one = weight(row[du], least);
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

static int32_t threshold_of(const struct ih_dots_params *params, int32_t noise)
{
    int32_t floor = (int32_t)ih_mul_shift(params->floor_grey_q4, IH_BAND_UNIT, 4);
    return ih_max_s32(floor, ih_saturate_s32(ih_mul_shift(noise, params->noise_gain_q8, 8)));
}

/* A maximum above its threshold: a dot, or why not. */
static void judge(const struct ih_dots_scratch *scratch, struct ih_dots *out,
                  const struct near *near, int32_t u, int32_t v)
{
    const struct ih_dots_params *params = &scratch->params;
    const int32_t peak = near_row(near, 0)[u];
    const int32_t ring_max = (int32_t)ih_mul_shift(peak, params->ring_max_q8, 8);
    const int64_t beside_q6 = (int64_t)beside(scratch, near, u, v) * 64;
    const bool flat = beside_q6 >= (int64_t)peak * params->flat_min_q8;
    if (beside_q6 < (int64_t)peak * params->side_min_q8) {
        out->hot_count++;
        return;
    }
    if (!flat && !stands_alone(near, u, 0, ring_max)) {
        out->edge_count++;
        return;
    }
    const struct ih_dot dot = flat ? centred_plateau(near, u, v) : centred(near, u, v);
    if ((flat && !stands_alone(near, ring_place(dot.u_px_q12, u), ring_place(dot.v_px_q12, v) - v,
                               ring_max)) ||
        has_twin(out, &dot)) {
        out->edge_count++;
        return;
    }
    insert_dot(out, dot);
}

/* What no threshold of row v is below, and what none is above; they change from block to block. Nothing
 * behind the frame is above. */
static void lay_limits(struct ih_dots_scratch *scratch, int32_t v)
{
    int16_t *least = scratch->rows.finding.least;
    int32_t u = 0;
    int32_t block = 0;
    while (u < scratch->width) {
        const int32_t end = ih_min_s32(block * IH_NOISE_BLOCK + IH_NOISE_BLOCK / 2, scratch->width);
        const int32_t threshold =
            threshold_of(&scratch->params, ih_noise_least(&scratch->noise, u, v));
        scratch->rows.finding.most[block] =
            threshold_of(&scratch->params, ih_noise_most(&scratch->noise, u, v));
        for (; u < end; u++) {
            least[u] = (int16_t)ih_clamp_s32(threshold, INT16_MIN, INT16_MAX);
        }
        block++;
    }
    for (; u < IH_FRAME_WIDTH_MAX; u++) {
        least[u] = INT16_MAX;
    }
}

/* Is R above the threshold of its place? Most often its neighbourhood tells. */
static bool is_above_threshold(const struct ih_dots_scratch *scratch, int32_t response, int32_t u,
                               int32_t v)
{
    return response > scratch->rows.finding.most[(u + IH_NOISE_BLOCK / 2) / IH_NOISE_BLOCK] ||
           response > threshold_of(&scratch->params, ih_noise_at(&scratch->noise, u, v));
}

#if IH_LANES && !IH_WORDS
/* What of IH_LANES pixels is above. */
static inline ih_lanes is_above(const int16_t *response, const int16_t *least)
{
    return ih_lanes_greater(ih_lanes_load(response), ih_lanes_load(least));
}

/* Maxima above the least threshold: as great as all that are read later, greater than all before. */
static inline ih_lanes maxima_of(const int16_t *above, const int16_t *middle, const int16_t *below,
                                 const int16_t *least)
{
    const ih_lanes peak = ih_lanes_load(middle);
    const ih_lanes before =
        ih_lanes_greatest(ih_lanes_greatest(ih_lanes_load(&above[-1]), ih_lanes_load(above)),
                          ih_lanes_greatest(ih_lanes_load(&above[1]), ih_lanes_load(&middle[-1])));
    const ih_lanes after =
        ih_lanes_greatest(ih_lanes_greatest(ih_lanes_load(&below[-1]), ih_lanes_load(below)),
                          ih_lanes_greatest(ih_lanes_load(&below[1]), ih_lanes_load(&middle[1])));
    const ih_lanes passed = ih_lanes_greater(peak, ih_lanes_greatest(before, ih_lanes_load(least)));
    return ih_lanes_without(passed, ih_lanes_greater(after, peak));
}
#endif

#if IH_WORDS
/* The least threshold is the same for so many pixels from a multiple of them on. */
#define SPAN (IH_NOISE_BLOCK / 2)

/* Unrolled: gcc 12 does not at -O2. */
static inline bool is_any_of_span_above(const int16_t *response, const int16_t *least)
{
    const uint32_t limit = ih_word(least);
    uint32_t above = ih_word_below(limit, ih_word(response));
    above |= ih_word_below(limit, ih_word(&response[2]));
    above |= ih_word_below(limit, ih_word(&response[4]));
    above |= ih_word_below(limit, ih_word(&response[6]));
    above |= ih_word_below(limit, ih_word(&response[8]));
    above |= ih_word_below(limit, ih_word(&response[10]));
    above |= ih_word_below(limit, ih_word(&response[12]));
    above |= ih_word_below(limit, ih_word(&response[14]));
    return (above & IH_WORD_SIGNS) != 0;
}
#endif

/* Is one of GROUP pixels above what no threshold is below? */
static inline bool is_any_above(const int16_t *response, const int16_t *least)
{
#if IH_WORDS
    return is_any_of_span_above(response, least) ||
           is_any_of_span_above(&response[SPAN], &least[SPAN]);
#elif IH_LANES != 0
    ih_lanes any = is_above(response, least);
    for (int32_t i = IH_LANES; i < GROUP; i += IH_LANES) {
        any = ih_lanes_or(any, is_above(&response[i], &least[i]));
    }
    return ih_lanes_is_any(any);
#else
    uint16_t any = 0;
    for (int32_t i = 0; i < GROUP; i++) {
        const uint16_t above = response[i] > least[i] ? UINT16_MAX : 0;
        any = any | above;
    }
    return any != 0;
#endif
}

#if !IH_LANES || IH_WORDS
/* Of equal neighbours the first in reading order is a maximum. */
static bool is_maximum(const int16_t *above, const int16_t *middle, const int16_t *below,
                       int16_t least)
{
    const int16_t peak = middle[0];
    return peak > least && peak > middle[-1] && peak >= middle[1] && peak > above[-1] &&
           peak > above[0] && peak > above[1] && peak >= below[-1] && peak >= below[0] &&
           peak >= below[1];
}
#endif

/* Which of GROUP pixels are maxima above the least threshold, the first of them in the lowest bit. */
static uint32_t mark_maxima(const int16_t *above, const int16_t *middle, const int16_t *below,
                            const int16_t *least)
{
    uint32_t maxima = 0;
#if IH_WORDS
    for (int32_t u = 0; u < GROUP; u += 2) {
        if ((ih_word_below(ih_word(&least[u]), ih_word(&middle[u])) & IH_WORD_SIGNS) != 0) {
            const int32_t next = u + 1;
            maxima |= (uint32_t)is_maximum(&above[u], &middle[u], &below[u], least[u]) << u;
            maxima |= (uint32_t)is_maximum(&above[next], &middle[next], &below[next], least[next])
                      << next;
        }
    }
#elif IH_LANES != 0
    for (int32_t u = 0; u < GROUP; u += 2 * IH_LANES) {
        const int32_t next = u + IH_LANES;
        maxima |= ih_lanes_bits(maxima_of(&above[u], &middle[u], &below[u], &least[u]),
                                maxima_of(&above[next], &middle[next], &below[next], &least[next]))
                  << u;
    }
#else
    for (int32_t u = 0; u < GROUP; u++) {
        maxima |= (uint32_t)is_maximum(&above[u], &middle[u], &below[u], least[u]) << u;
    }
#endif
    return maxima;
}

/* Groups of a row that have maxima. */
struct marked {
    int32_t count;
    int16_t first[IH_FRAME_WIDTH_MAX / GROUP];
    uint32_t maxima[IH_FRAME_WIDTH_MAX / GROUP];
};

/* Most groups have nothing above any threshold, most of the others no maximum. Which ones cannot be
 * foreseen, and a wrong guess costs a processor more than a group: they are put down without asking. */
static void mark_row(struct ih_dots_scratch *scratch, int32_t v, struct marked *out)
{
    const int16_t *above = response_row(scratch, v - 1);
    const int16_t *middle = response_row(scratch, v);
    const int16_t *below = response_row(scratch, v + 1);
    const int16_t *least = scratch->rows.finding.least;
    const int32_t width = scratch->width;
    int32_t candidates = 0;
    for (int32_t first = 0; first < width; first += GROUP) {
        out->first[candidates] = (int16_t)first; /* the next one's place if it is none */
        candidates += is_any_above(&middle[first], &least[first]);
    }
    int32_t count = 0;
    for (int32_t i = 0; i < candidates; i++) {
        const int16_t first = out->first[i];
        const uint32_t maxima =
            mark_maxima(&above[first], &middle[first], &below[first], &least[first]);
        out->first[count] = first;
        out->maxima[count] = maxima;
        count += maxima != 0;
    }
    out->count = count;
}

/* Row v has all its neighbours in the ring. */
static void find_dots(struct ih_dots_scratch *scratch, struct ih_dots *out, int32_t v)
{
    const int16_t *response = response_row(scratch, v);
    struct marked marked;
    struct near near;
    if (v % IH_NOISE_BLOCK == IH_NOISE_BLOCK / 2 || v == 0) {
        lay_limits(scratch, v);
    }
    mark_row(scratch, v, &marked);
    if (marked.count == 0) {
        return;
    }
    lay_near(scratch, v, &near);
    for (int32_t i = 0; i < marked.count; i++) {
        for (uint32_t maxima = marked.maxima[i]; maxima != 0; maxima &= maxima - 1) {
            const int32_t u = marked.first[i] + __builtin_ctz(maxima);
            if (is_above_threshold(scratch, response[u], u, v)) {
                judge(scratch, out, &near, u, v);
            }
        }
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

static uint16_t greatest(const uint16_t *sum, int32_t count)
{
    uint16_t most = 0;
    for (int32_t i = 0; i < count; i++) {
        most = sum[i] > most ? sum[i] : most;
    }
    return most;
}

/* A row of blocks of which each column's sum is given, and what a bright column has more than. Where
 * no column is bright no block is. */
static void mark_bright(struct ih_dots *out, int32_t block_row, const uint16_t *sum, int32_t width,
                        int32_t limit)
{
    if (greatest(sum, width) <= limit) {
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
    const struct ih_band *band = &scratch->rows.finding.band;
    const int32_t rows = v % IH_DOTS_BLOCK + 1;
    const int32_t grey = band->is_bytes ? 1 : 16; /* one level of 8 bits */
    const int32_t limit = scratch->params.bright_grey * grey * rows;
    if (is_in_band && rows == IH_DOTS_BLOCK && !ih_band_is_any_above(band, 2 * limit)) {
        return;
    }
    if (is_in_band) {
        ih_band_columns(band, rows, scratch->bright_column);
    }
    mark_bright(out, v / IH_DOTS_BLOCK, scratch->bright_column, scratch->width, limit);
}

static void repeat_row(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    if (ih_band_repeat(&scratch->rows.finding.band,
                       response_row(scratch, scratch->response_rows))) {
        advance(scratch, out);
    }
}

void ih_dots_row(struct ih_dots_scratch *scratch, struct ih_dots *out, const struct ih_row *row,
                 const struct ih_row *ambient)
{
    struct ih_band *band = &scratch->rows.finding.band;
    const int32_t v = scratch->rows_taken++;
    const bool is_bytes = ambient == NULL && ih_row_is_bytes(row);
    int16_t *response = response_row(scratch, scratch->response_rows);
    bool complete = false;
    if (v == 0) {
        ih_band_begin(band, scratch->width, is_bytes);
    }
    if (is_bytes) {
        complete = ih_band_push_bytes(band, row->samples, response);
    } else {
        ih_row_grey(row, scratch->width, scratch->grey_q4);
        if (ambient != NULL) {
            add_bright(scratch, v);
            ih_row_grey(ambient, scratch->width, scratch->ambient_q4);
            ih_noise_subtract(&scratch->noise, v, scratch->width, scratch->ambient_q4,
                              scratch->grey_q4);
        }
        complete = ih_band_push_grey(band, scratch->grey_q4, response);
    }
    if (v % IH_DOTS_BLOCK == IH_DOTS_BLOCK - 1 || v == scratch->height - 1) {
        finish_blocks(scratch, out, v, ambient == NULL);
    }
    if (complete) {
        advance(scratch, out);
    }
    for (int32_t i = 0; v == 0 && i < IH_BAND_REACH; i++) { /* repeat the first row upwards */
        repeat_row(scratch, out);
    }
}

void ih_dots_end(struct ih_dots_scratch *scratch, struct ih_dots *out)
{
    for (int32_t i = 0; i < IH_BAND_REACH; i++) { /* repeat the last row downwards */
        repeat_row(scratch, out);
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
