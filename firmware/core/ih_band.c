#include "ih_band.h"

#include <string.h>

#include "ih_fix.h"
#include "ih_words.h"

#define INNER_WEIGHT 81 /* the outer box has 81 pixels, the inner kernel weight 16: */
#define OUTER_WEIGHT 16 /* 81 inner - 16 outer has no response to a constant */
#define RESPONSE_SHIFT 8

struct ih_row ih_frame_row(const struct ih_frame *frame, int32_t v)
{
    return (struct ih_row){
        .samples = (const uint8_t *)frame->samples + (size_t)v * (size_t)frame->stride_bytes,
        .bytes_per_sample = frame->bytes_per_sample,
        .maximum = frame->maximum,
    };
}

bool ih_row_is_bytes(const struct ih_row *row)
{
    return row->bytes_per_sample == 1 && row->maximum == UINT8_MAX;
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

void ih_band_begin(struct ih_band *band, int32_t width, bool is_bytes)
{
    band->width = width;
    band->rows_in = 0;
    band->is_bytes = is_bytes;
    memset(band->newest, 0, sizeof band->newest); /* before the first row */
    memset(band->pair, 0, sizeof band->pair);
}

/* Sums of rows of the ring: so many rows ago and the one before it. */
struct pairs {
    const uint16_t *ago_1, *ago_3, *ago_4, *ago_5, *ago_7;
};

#if IH_WORDS
/* Both of the next for so many pixels as there are whole words; how many. */
static int32_t join_words(const uint8_t *row, int32_t width, uint16_t *newest, uint16_t *pair)
{
    int32_t u = 0;
    for (; u + 2 <= width; u += 2) {
        const uint32_t grey = ih_word_of_bytes(&row[u]);
        ih_word_put(ih_word(&newest[u]) + grey, &pair[u]);
        ih_word_put(grey, &newest[u]);
    }
    return u;
}

static int32_t sum_words(const uint16_t *newest, const struct pairs *pairs, int32_t width,
                         uint16_t *inner, uint16_t *column)
{
    const uint16_t *ago_1 = pairs->ago_1;
    const uint16_t *ago_3 = pairs->ago_3;
    const uint16_t *ago_4 = pairs->ago_4;
    const uint16_t *ago_5 = pairs->ago_5;
    const uint16_t *ago_7 = pairs->ago_7;
    int32_t u = 0;
    for (; u + 2 <= width; u += 2) {
        const uint32_t middle = ih_word(&ago_3[u]);
        ih_word_put(middle + ih_word(&ago_4[u]), &inner[u]);
        ih_word_put(ih_word(&newest[u]) + ih_word(&ago_1[u]) + middle + ih_word(&ago_5[u]) +
                        ih_word(&ago_7[u]),
                    &column[u]);
    }
    return u;
}
#endif

/* A row joins the one before, which gives way to it. Sums of the ring's rows: 1-2-1 of the three in
 * the middle, and of all nine. */
static void take_bytes(const uint8_t *row, const struct pairs *pairs, struct ih_band *restrict band,
                       uint16_t *restrict pair)
{
    const int32_t width = band->width;
    uint16_t *restrict newest = band->newest;
    uint16_t *restrict inner = &band->inner[1];
    uint16_t *restrict column = &band->column[IH_BAND_REACH];
    const uint16_t *ago_1 = pairs->ago_1;
    const uint16_t *ago_3 = pairs->ago_3;
    const uint16_t *ago_4 = pairs->ago_4;
    const uint16_t *ago_5 = pairs->ago_5;
    const uint16_t *ago_7 = pairs->ago_7;
    int32_t u = 0;
#if IH_WORDS
    (void)join_words(row, width, newest, pair);
    u = sum_words(newest, pairs, width, inner, column);
#endif
    for (; u < width; u++) {
        const uint16_t grey = row[u];
        pair[u] = (uint16_t)(newest[u] + grey);
        newest[u] = grey;
        inner[u] = (uint16_t)(ago_3[u] + ago_4[u]);
        column[u] = (uint16_t)(grey + ago_1[u] + ago_3[u] + ago_5[u] + ago_7[u]);
    }
}

static void take_grey(const uint16_t *row_q4, const struct pairs *pairs,
                      struct ih_band *restrict band, uint16_t *restrict pair_q4)
{
    const int32_t width = band->width;
    uint16_t *restrict newest_q4 = band->newest;
    uint16_t *restrict inner_q4 = &band->inner[1];
    uint16_t *restrict column_q4 = &band->column[IH_BAND_REACH];
    const uint16_t *ago_1 = pairs->ago_1;
    const uint16_t *ago_3 = pairs->ago_3;
    const uint16_t *ago_4 = pairs->ago_4;
    const uint16_t *ago_5 = pairs->ago_5;
    const uint16_t *ago_7 = pairs->ago_7;
    for (int32_t u = 0; u < width; u++) {
        const uint16_t grey = row_q4[u];
        pair_q4[u] = (uint16_t)(newest_q4[u] + grey);
        newest_q4[u] = grey;
        inner_q4[u] = (uint16_t)(ago_3[u] + ago_4[u]);
        column_q4[u] = (uint16_t)(grey + ago_1[u] + ago_3[u] + ago_5[u] + ago_7[u]);
    }
}

/* The same of rows that are given: the middle three, and then two more. */
static void sum_middle(const struct ih_row row[IH_BAND_ROWS], int32_t width,
                       uint16_t *restrict inner, uint16_t *restrict column)
{
    const uint8_t *above = row[IH_BAND_REACH - 1].samples;
    const uint8_t *middle = row[IH_BAND_REACH].samples;
    const uint8_t *below = row[IH_BAND_REACH + 1].samples;
    for (int32_t u = 0; u < width; u++) {
        const uint16_t sum = (uint16_t)(above[u] + middle[u] + below[u]);
        inner[u] = (uint16_t)(sum + middle[u]);
        column[u] = sum;
    }
}

static void add_bytes(const uint8_t *above, const uint8_t *below, int32_t width,
                      uint16_t *restrict column)
{
    for (int32_t u = 0; u < width; u++) {
        column[u] = (uint16_t)(column[u] + above[u] + below[u]);
    }
}

static void add_row(const uint16_t *row, int32_t width, uint16_t *restrict sum)
{
    int32_t u = 0;
#if IH_WORDS
    for (; u + 2 <= width; u += 2) {
        ih_word_put(ih_word(&sum[u]) + ih_word(&row[u]), &sum[u]);
    }
#endif
    for (; u < width; u++) {
        sum[u] = (uint16_t)(sum[u] + row[u]);
    }
}

/* Sums of a row, edge pixels repeated outside. */
static void repeat_edges(uint16_t *sums, int32_t width, int32_t reach)
{
    for (int32_t i = 0; i < reach; i++) {
        sums[i] = sums[reach];
        sums[reach + width + i] = sums[reach + width - 1];
    }
}

#if IH_WORDS
/* R of so many pixels as there are whole words; how many. The box's sum runs along the row. */
static int32_t respond_words(const uint16_t *inner, const uint16_t *column, int32_t width,
                             int16_t *response)
{
    /* Less the columns of both boxes, but for the last two of each. */
    uint32_t raised = IH_WORD_BOTH(0x8000);
    int32_t u = 0;
    for (int32_t i = 0; i < IH_BAND_ROWS - 2; i++) {
        raised -= ih_word(&column[i]);
    }
    for (; u + 2 <= width; u += 2) {
        const uint32_t sum =
            ih_word(&inner[u]) + 2 * ih_word(&inner[u + 1]) + ih_word(&inner[u + 2]);
        const uint32_t sixteenth =
            (sum + IH_WORD_BOTH(OUTER_WEIGHT / 2)) / OUTER_WEIGHT & IH_WORD_BOTH(0x0fff);
        raised -= ih_word(&column[u + 7]) + ih_word(&column[u + 8]);
        ih_word_put_signed(INNER_WEIGHT / OUTER_WEIGHT * sum + sixteenth + raised, &response[u]);
        raised += ih_word(&column[u]) + ih_word(&column[u + 1]);
    }
    return u;
}
#endif

/* Of grey levels of 8 bits everything is below 2^16, the sixteenth of 81 i as 5 i + i / 16. */
static void respond_bytes(const uint16_t *inner, const uint16_t *three, int32_t width,
                          int16_t *restrict response)
{
    for (int32_t u = 0; u < width; u++) {
        uint16_t sum = (uint16_t)(inner[u] + 2 * inner[u + 1] + inner[u + 2]);
        uint16_t half_up = (uint16_t)(sum + OUTER_WEIGHT / 2);
        uint16_t box = (uint16_t)(three[u] + three[u + 3] + three[u + 6]);
        response[u] = (int16_t)(INNER_WEIGHT / OUTER_WEIGHT * sum + half_up / OUTER_WEIGHT - box);
    }
}

static void respond_grey(const uint16_t *inner_q4, const uint32_t *three_q4, int32_t width,
                         int16_t *restrict response)
{
    for (int32_t u = 0; u < width; u++) {
        int32_t sum = inner_q4[u] + 2 * inner_q4[u + 1] + inner_q4[u + 2];
        int32_t box = (int32_t)(three_q4[u] + three_q4[u + 3] + three_q4[u + 6]);
        response[u] =
            (int16_t)((INNER_WEIGHT * sum - OUTER_WEIGHT * box + (1 << (RESPONSE_SHIFT - 1))) >>
                      RESPONSE_SHIFT);
    }
}

static void sum_threes_bytes(const uint16_t *column, int32_t count, uint16_t *restrict three)
{
    for (int32_t i = 0; i < count; i++) {
        three[i] = (uint16_t)(column[i] + column[i + 1] + column[i + 2]);
    }
}

static void sum_threes_grey(const uint16_t *column_q4, int32_t count, uint32_t *restrict three_q4)
{
    for (int32_t i = 0; i < count; i++) {
        three_q4[i] = (uint32_t)column_q4[i] + column_q4[i + 1] + column_q4[i + 2];
    }
}

/* All of a row of bytes. */
static void filter_bytes(struct ih_band *band, int16_t *response)
{
    int32_t first = 0;
#if IH_WORDS
    first = respond_words(band->inner, band->column, band->width, response);
#endif
    sum_threes_bytes(&band->column[first], band->width - first + 2 * IH_BAND_REACH - 2,
                     band->three.of_bytes);
    respond_bytes(&band->inner[first], band->three.of_bytes, band->width - first, &response[first]);
}

/* R of the row whose sums are there. */
static void filter(struct ih_band *band, int16_t *response)
{
    const int32_t width = band->width;
    const int32_t threes = width + 2 * IH_BAND_REACH - 2;
    repeat_edges(band->inner, width, 1);
    repeat_edges(band->column, width, IH_BAND_REACH);
    if (band->is_bytes) {
        filter_bytes(band, response);
    } else {
        sum_threes_grey(band->column, threes, band->three.of_grey_q4);
        respond_grey(band->inner, band->three.of_grey_q4, width, response);
    }
}

/* Sums of a row and the one before it, the newest or so many rows ago. */
static uint16_t *pair_of(struct ih_band *band, int32_t ago)
{
    return band->pair[(band->rows_in + IH_BAND_PAIRS - ago) % IH_BAND_PAIRS];
}

static struct pairs pairs_of(struct ih_band *band)
{
    return (struct pairs){
        .ago_1 = pair_of(band, 1),
        .ago_3 = pair_of(band, 3),
        .ago_4 = pair_of(band, 4),
        .ago_5 = pair_of(band, 5),
        .ago_7 = pair_of(band, 7),
    };
}

/* The sums are those of the row before the newest one IH_BAND_REACH rows ago. */
static bool finish_row(struct ih_band *band, int16_t *response)
{
    band->rows_in++;
    if (band->rows_in < IH_BAND_ROWS) {
        return false;
    }
    filter(band, response);
    return true;
}

bool ih_band_push_bytes(struct ih_band *band, const uint8_t *row, int16_t *response)
{
    const struct pairs pairs = pairs_of(band);
    take_bytes(row, &pairs, band, pair_of(band, 0));
    return finish_row(band, response);
}

bool ih_band_push_grey(struct ih_band *band, const uint16_t *row_q4, int16_t *response)
{
    const struct pairs pairs = pairs_of(band);
    take_grey(row_q4, &pairs, band, pair_of(band, 0));
    return finish_row(band, response);
}

bool ih_band_repeat(struct ih_band *band, int16_t *response)
{
    const struct pairs pairs = pairs_of(band);
    memcpy(band->three.of_bytes, band->newest, (size_t)band->width * sizeof band->newest[0]);
    take_grey(band->three.of_bytes, &pairs, band, pair_of(band, 0));
    return finish_row(band, response);
}

void ih_band_columns(const struct ih_band *band, int32_t rows, uint16_t *sum)
{
    memset(sum, 0, (size_t)band->width * sizeof sum[0]);
    if (rows % 2 != 0) {
        add_row(band->newest, band->width, sum);
    }
    for (int32_t row = band->rows_in - 1 - rows % 2; row >= band->rows_in - rows; row -= 2) {
        add_row(band->pair[row % IH_BAND_PAIRS], band->width, sum);
    }
}

void ih_band_bytes(struct ih_band *band, const struct ih_row row[IH_BAND_ROWS], int32_t width,
                   int16_t *response)
{
    uint16_t *column = &band->column[IH_BAND_REACH];
    band->width = width;
    band->is_bytes = true;
    sum_middle(row, width, &band->inner[1], column);
    for (int32_t i = 2; i <= IH_BAND_REACH; i++) {
        add_bytes(row[IH_BAND_REACH - i].samples, row[IH_BAND_REACH + i].samples, width, column);
    }
    filter(band, response);
}
