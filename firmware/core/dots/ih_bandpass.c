#include "dots/ih_bandpass.h"

#include <string.h>

#include "base/ih_fix.h"
#include "simd/ih_lanes.h"
#include "simd/ih_words.h"

#define INNER_WEIGHT 81 /* the outer box has 81 pixels, the inner kernel weight 16: */
#define OUTER_WEIGHT 16 /* 81 inner - 16 outer has no response to a constant */
#define RESPONSE_SHIFT 8

/* Ranges are checked without vectors. */
#if defined IH_LANES_OP && !IH_WORDS && !defined ISOHEAD_RANGE_CHECKS
#define BY_LANES 1
#else
#define BY_LANES 0
#endif

struct ih_scanline ih_frame_scanline(const struct ih_frame *frame, int32_t v)
{
    return (struct ih_scanline){
        .samples = (const uint8_t *)frame->samples + (size_t)v * (size_t)frame->stride_bytes,
        .bytes_per_sample = frame->bytes_per_sample,
        .maximum = frame->maximum,
    };
}

bool ih_scanline_is_bytes(const struct ih_scanline *row)
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

void ih_scanline_grey(const struct ih_scanline *row, int32_t width, uint16_t *grey_q4)
{
    const uint32_t maximum = (uint32_t)row->maximum;
    /* 255 of 255 and 65535 of 65535 become 4080. */
    const uint32_t gain_q16 = (IH_BANDPASS_FULL_Q4 * 65536u + maximum / 2) / maximum;
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

/* Sum 0 is that of the pixel so many to the left of the frame: sums begin where vectors do, and so does
 * what a row of R is worked out from. */
#define LEAD IH_BANDPASS_LEAD
/* The first sum that is worked out: the first that is needed, of pixel -IH_BANDPASS_SIDE, or where a vector
 * or a word begins. */
#if BY_LANES
#define FIRST ((LEAD - IH_BANDPASS_SIDE) / IH_LANES * IH_LANES)
#else
#define FIRST (LEAD - IH_BANDPASS_REACH)
#endif

/* Where the sums of a row end: whole steps. */
static int32_t end_of(const struct ih_bandpass *band)
{
    const int32_t needed = band->width + LEAD + IH_BANDPASS_SIDE - FIRST;
    return FIRST + (needed + IH_BANDPASS_STEP - 1) / IH_BANDPASS_STEP * IH_BANDPASS_STEP;
}

void ih_bandpass_begin(struct ih_bandpass *band, int32_t width, bool is_bytes)
{
    band->width = width;
    band->rows_in = 0;
    band->is_bytes = is_bytes;
    const size_t count = (size_t)end_of(band);
    for (int32_t row = 0; row < IH_BANDPASS_ROWS; row++) { /* before the first row */
        memset(band->three[row], 0, count * sizeof band->three[0][0]);
    }
    memset(&band->nine, 0,
           count * (is_bytes ? sizeof band->nine.of_bytes[0] : sizeof band->nine.of_grey_q4[0]));
}

/* The rings' rows of the newest row, or of so many rows before it; where the sums begin. */
static uint16_t *three_of(struct ih_bandpass *band)
{
    return band->three[(uint32_t)band->rows_in % IH_BANDPASS_ROWS];
}

static uint16_t *binomial_of(struct ih_bandpass *band, int32_t ago)
{
    return band->binomial[(uint32_t)(band->rows_in + IH_BANDPASS_KEPT - ago) % IH_BANDPASS_KEPT];
}

#if BY_LANES
static inline ih_lanes sum_of(ih_lanes a, ih_lanes b)
{
    return IH_LANES_OP(add_epi16)(a, b);
}

static inline ih_lanes less_of(ih_lanes a, ih_lanes b)
{
    return IH_LANES_OP(sub_epi16)(a, b);
}

/* (81 i + 8) / 16, with AVX2 as (8 i 20736 + 2^14) / 2^15. */
static inline ih_lanes inside_of(ih_lanes sum)
{
#ifdef __AVX2__
    return _mm256_mulhrs_epi16(_mm256_slli_epi16(sum, 3), _mm256_set1_epi16(INNER_WEIGHT * 256));
#else
    const __m128i half_up = _mm_add_epi16(sum, _mm_set1_epi16(OUTER_WEIGHT / 2));
    return _mm_add_epi16(_mm_add_epi16(sum, _mm_slli_epi16(sum, 2)), _mm_srli_epi16(half_up, 4));
#endif
}
#endif

#if BY_LANES && defined __AVX2__
static inline ih_lanes load_bytes(const uint8_t *pixel)
{
    return _mm256_cvtepu8_epi16(_mm_loadu_si128((const __m128i *)(const void *)pixel));
}

/* take_bytes of IH_LANES pixels; gcc 12 takes bytes by twice as many and halves them. */
static inline void take_lanes(const uint8_t *pixel, uint16_t *three, uint16_t *binomial,
                              uint16_t *nine)
{
    const ih_lanes middle = load_bytes(&pixel[1]);
    const ih_lanes sum = sum_of(sum_of(load_bytes(pixel), middle), load_bytes(&pixel[2]));
    ih_lanes_store(less_of(sum_of(sum, ih_lanes_load(nine)), ih_lanes_load(three)), nine);
    ih_lanes_store(sum, three);
    ih_lanes_store(sum_of(sum, middle), binomial);
}

/* respond_bytes of IH_LANES pixels, which are R. */
static inline ih_lanes respond_lanes(const uint16_t *above, const uint16_t *middle,
                                     const uint16_t *below, const uint16_t *nine, int16_t *response)
{
    const ih_lanes row = ih_lanes_load(middle);
    const ih_lanes sum =
        sum_of(sum_of(sum_of(row, ih_lanes_load(above)), ih_lanes_load(below)), row);
    const ih_lanes less = less_of(less_of(inside_of(sum), ih_lanes_load(nine)),
                                  ih_lanes_load(&nine[2 * IH_BANDPASS_SIDE]));
    const ih_lanes all = less_of(less, ih_lanes_load(&nine[IH_BANDPASS_SIDE]));
    ih_lanes_store(all, response);
    return all;
}
#endif

#if IH_WORDS
/* take_bytes of four pixels, which are the second to the fifth of p0 .. p5. */
static inline void take_four(const uint8_t *pixel, uint16_t *three, uint16_t *binomial,
                             uint16_t *nine)
{
    const uint32_t p0123 = ih_word_of_bytes(pixel);
    const uint32_t p2345 = ih_word_of_bytes(&pixel[2]);
    const uint32_t p13 = ih_word_odd(p0123);
    const uint32_t both = ih_word_add_even(p13, p2345); /* p1 + p2, p3 + p4 */
    const uint32_t even = ih_word_add_even(both, p0123);
    const uint32_t odd = ih_word_add_odd(both, p2345);
    const uint32_t even_binomial = even + p13;
    const uint32_t odd_binomial = ih_word_add_even(odd, p2345);
    const uint32_t first = ih_word_first(even, odd);
    const uint32_t second = ih_word_second(even, odd);
    ih_word_put(ih_word(nine) + first - ih_word(three), nine);
    ih_word_put(ih_word(&nine[2]) + second - ih_word(&three[2]), &nine[2]);
    ih_word_put(first, three);
    ih_word_put(second, &three[2]);
    ih_word_put(ih_word_first(even_binomial, odd_binomial), binomial);
    ih_word_put(ih_word_second(even_binomial, odd_binomial), &binomial[2]);
}
#endif

/* A row joins the sums of nine, and the one that is in its place in the ring leaves them. Sums begin
 * with the three pixels that are given; a whole number of IH_BANDPASS_STEP. */
static void take_bytes(const uint8_t *pixel, int32_t count, uint16_t *restrict three,
                       uint16_t *restrict binomial, uint16_t *restrict nine)
{
    int32_t i = 0;
#if IH_WORDS
    for (; i < count; i += 8) {
        take_four(&pixel[i], &three[i], &binomial[i], &nine[i]);
        take_four(&pixel[i + 4], &three[i + 4], &binomial[i + 4], &nine[i + 4]);
    }
#elif BY_LANES && defined __AVX2__
    for (; i < count; i += 2 * IH_LANES) {
        take_lanes(&pixel[i], &three[i], &binomial[i], &nine[i]);
        take_lanes(&pixel[i + IH_LANES], &three[i + IH_LANES], &binomial[i + IH_LANES],
                   &nine[i + IH_LANES]);
    }
#endif
    for (; i < count; i++) {
        const uint16_t middle = pixel[i + 1];
        const uint16_t sum = (uint16_t)(pixel[i] + middle + pixel[i + 2]);
        nine[i] = (uint16_t)(nine[i] + sum - three[i]);
        three[i] = sum;
        binomial[i] = (uint16_t)(sum + middle);
    }
}

/* Pixels that a step reads: a row's first ones, and those that are copied from its end. */
#define STEP_PIXELS (IH_BANDPASS_STEP + 2)
/* The first pixel of sum i is i - BEFORE; so many of the first step lie outside of the row. */
#define BEFORE (LEAD + 1)
#define OUTSIDE (BEFORE - FIRST)

/* All of a row of bytes; its edges with the edge pixels repeated outside. They come last: what was just
 * stored byte by byte is not there yet for vectors. */
static void take_row_bytes(struct ih_bandpass *band, const uint8_t *row)
{
    uint8_t left[STEP_PIXELS];
    uint8_t right[STEP_PIXELS + 2 * IH_BANDPASS_STEP + 2];
    uint16_t *three = three_of(band);
    uint16_t *binomial = binomial_of(band, 0);
    uint16_t *nine = band->nine.of_bytes;
    const int32_t width = band->width;
    const int32_t first = FIRST + IH_BANDPASS_STEP;
    /* Where the first step begins that needs pixels behind the row. */
    const int32_t last =
        first + (width - STEP_PIXELS + OUTSIDE) / IH_BANDPASS_STEP * IH_BANDPASS_STEP;
    const int32_t rest = width - (last - BEFORE); /* pixels from there on, less than STEP_PIXELS */
    memset(left, row[0], OUTSIDE);
    memcpy(&left[OUTSIDE], row, STEP_PIXELS - OUTSIDE);
    memset(right, row[width - 1], sizeof right);
    memcpy(&right[rest], &row[width - STEP_PIXELS], STEP_PIXELS);
    take_bytes(&row[first - BEFORE], last - first, &three[first], &binomial[first], &nine[first]);
    take_bytes(left, IH_BANDPASS_STEP, &three[FIRST], &binomial[FIRST], &nine[FIRST]);
    take_bytes(&right[STEP_PIXELS], end_of(band) - last, &three[last], &binomial[last],
               &nine[last]);
}

static void take_row_grey(struct ih_bandpass *band, const uint16_t *row_q4)
{
    uint16_t *restrict three_q4 = three_of(band);
    uint16_t *restrict binomial_q4 = binomial_of(band, 0);
    uint32_t *restrict nine_q4 = band->nine.of_grey_q4;
    const int32_t width = band->width;
    for (int32_t i = LEAD - IH_BANDPASS_SIDE; i < LEAD + width + IH_BANDPASS_SIDE; i++) {
        const int32_t u = i - LEAD;
        const uint16_t middle_q4 = row_q4[ih_clamp_s32(u, 0, width - 1)];
        const uint16_t sum_q4 = (uint16_t)(row_q4[ih_clamp_s32(u - 1, 0, width - 1)] + middle_q4 +
                                           row_q4[ih_clamp_s32(u + 1, 0, width - 1)]);
        nine_q4[i] = nine_q4[i] + sum_q4 - three_q4[i];
        three_q4[i] = sum_q4;
        binomial_q4[i] = (uint16_t)(sum_q4 + middle_q4);
    }
}

/* The newest row once more. */
static void take_again(struct ih_bandpass *band)
{
    const uint16_t *newest = band->three[(band->rows_in + IH_BANDPASS_ROWS - 1) % IH_BANDPASS_ROWS];
    uint16_t *three = three_of(band);
    const int32_t end = end_of(band);
    for (int32_t i = FIRST; i < end; i++) {
        if (band->is_bytes) {
            band->nine.of_bytes[i] = (uint16_t)(band->nine.of_bytes[i] + newest[i] - three[i]);
        } else {
            band->nine.of_grey_q4[i] = band->nine.of_grey_q4[i] + newest[i] - three[i];
        }
        three[i] = newest[i];
    }
    memcpy(&binomial_of(band, 0)[FIRST], &binomial_of(band, 1)[FIRST],
           (size_t)(end - FIRST) * sizeof three[0]);
}

#if IH_WORDS
/* respond_bytes of two pixels. */
static inline void respond_two(const uint16_t *above, const uint16_t *middle, const uint16_t *below,
                               const uint16_t *nine, uint32_t mask, int16_t *response)
{
    const uint32_t sum = ih_word(above) + 2 * ih_word(middle) + ih_word(below);
    const uint32_t sixteenth = (sum + IH_WORD_BOTH(OUTER_WEIGHT / 2)) / OUTER_WEIGHT & mask;
    const uint32_t box =
        ih_word(nine) + ih_word(&nine[IH_BANDPASS_SIDE]) + ih_word(&nine[2 * IH_BANDPASS_SIDE]);
    ih_word_put(ih_word_less(INNER_WEIGHT / OUTER_WEIGHT * sum + sixteenth, box), response);
}

/* Pixels whose loop is unrolled: gcc 12 does not at -O2. */
#define SPAN 16

static inline bool is_any_of_span_above(const int16_t *response, uint32_t limit)
{
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

/* Is one pixel of a group above a limit? */
static inline bool is_any_above(const int16_t *response, uint32_t limit)
{
#if IH_WORDS
    return is_any_of_span_above(response, limit) || is_any_of_span_above(&response[SPAN], limit);
#elif IH_LANES != 0
    ih_lanes max = ih_lanes_load(response);
    for (int32_t i = IH_LANES; i < IH_BANDPASS_GROUP; i += IH_LANES) {
        max = ih_lanes_max(max, ih_lanes_load(&response[i]));
    }
    return ih_lanes_is_any(ih_lanes_greater(max, ih_lanes_both(limit)));
#else
    int16_t max = 0;
    for (int32_t i = 0; i < IH_BANDPASS_GROUP; i++) {
        max = response[i] > max ? response[i] : max;
    }
    return max > (int16_t)(limit & INT16_MAX);
#endif
}

/* Groups from pixel u on join those that are listed. Which ones no processor foresees, and a wrong guess
 * costs more than a group: they are put down without asking. */
static void list(struct ih_bandpass_row *out, int32_t u, int32_t width, int32_t listed)
{
    int32_t count = listed;
    if (out->limit == NULL) {
        return;
    }
    for (int32_t first = u; first < width; first += IH_BANDPASS_GROUP) {
        out->first[count] = (int16_t)first; /* the next one's place if it is none */
        count += is_any_above(&out->response[first], out->limit[first / IH_BANDPASS_GROUP]);
    }
    out->count = count;
}

/* Rows of 1-2-1, above, of and below a row. */
struct rows {
    const uint16_t *above, *middle, *below;
};

/* Pixels from one on. Of grey levels of 8 bits everything is below 2^16, the sixteenth of 81 i as 5 i + i / 16. */
static void respond_bytes(const struct rows *rows, const uint16_t *nine, int32_t from,
                          int32_t width, int16_t *restrict response)
{
    const uint16_t *above = rows->above;
    const uint16_t *middle = rows->middle;
    const uint16_t *below = rows->below;
    int32_t u = from;
#if IH_WORDS
    const uint32_t mask = ih_word_kept(IH_WORD_BOTH(0x0fff)); /* so that its shift costs nothing */
    for (; u + 8 <= width; u += 8) {                          /* unrolled: gcc 12 does not at -O2 */
        respond_two(&above[u], &middle[u], &below[u], &nine[u], mask, &response[u]);
        respond_two(&above[u + 2], &middle[u + 2], &below[u + 2], &nine[u + 2], mask,
                    &response[u + 2]);
        respond_two(&above[u + 4], &middle[u + 4], &below[u + 4], &nine[u + 4], mask,
                    &response[u + 4]);
        respond_two(&above[u + 6], &middle[u + 6], &below[u + 6], &nine[u + 6], mask,
                    &response[u + 6]);
    }
#elif BY_LANES && defined __AVX2__
    for (; u + 2 * IH_LANES <= width; u += 2 * IH_LANES) {
        (void)respond_lanes(&above[u], &middle[u], &below[u], &nine[u], &response[u]);
        const int32_t next = u + IH_LANES;
        (void)respond_lanes(&above[next], &middle[next], &below[next], &nine[next],
                            &response[next]);
    }
    while (u < width) { /* the last ones end with the row, and some of them are there already */
        const int32_t at = ih_min_s32(u, width - IH_LANES);
        (void)respond_lanes(&above[at], &middle[at], &below[at], &nine[at], &response[at]);
        u = at + IH_LANES;
    }
#endif
    for (; u < width; u++) {
        const uint16_t sum = (uint16_t)(above[u] + 2 * middle[u] + below[u]);
        const uint16_t half_up = (uint16_t)(sum + OUTER_WEIGHT / 2);
        const uint16_t box =
            (uint16_t)(nine[u] + nine[u + IH_BANDPASS_SIDE] + nine[u + 2 * IH_BANDPASS_SIDE]);
        response[u] = (int16_t)(INNER_WEIGHT / OUTER_WEIGHT * sum + half_up / OUTER_WEIGHT - box);
    }
}

/* respond_bytes of all pixels, and groups are listed: where there are vectors as they come, so that R need
 * not be read again. */
static void respond_and_list(const struct rows *rows, const uint16_t *nine, int32_t width,
                             struct ih_bandpass_row *out)
{
    int32_t u = 0;
    int32_t listed = 0;
#if BY_LANES && defined __AVX2__
    const struct rows in = *rows;
    const uint32_t *limit = out->limit;
    int16_t *response = out->response;
    int16_t *first = out->first;
    for (; limit != NULL && u + IH_BANDPASS_GROUP <= width; u += IH_BANDPASS_GROUP) {
        const ih_lanes left =
            respond_lanes(&in.above[u], &in.middle[u], &in.below[u], &nine[u], &response[u]);
        const int32_t half = u + IH_LANES;
        const ih_lanes right = respond_lanes(&in.above[half], &in.middle[half], &in.below[half],
                                             &nine[half], &response[half]);
        const ih_lanes max = ih_lanes_max(left, right);
        first[listed] = (int16_t)u; /* the next one's place if it is none */
        listed +=
            ih_lanes_is_any(ih_lanes_greater(max, ih_lanes_both(limit[u / IH_BANDPASS_GROUP])));
    }
#endif
    respond_bytes(rows, nine, u, width, out->response);
    list(out, u, width, listed);
}

static void respond_grey(const struct rows *rows_q4, const uint32_t *nine_q4, int32_t width,
                         int16_t *restrict response)
{
    for (int32_t u = 0; u < width; u++) {
        const int32_t sum = rows_q4->above[u] + 2 * rows_q4->middle[u] + rows_q4->below[u];
        const int32_t box = (int32_t)(nine_q4[u] + nine_q4[u + IH_BANDPASS_SIDE] +
                                      nine_q4[u + 2 * IH_BANDPASS_SIDE]);
        response[u] =
            (int16_t)((INNER_WEIGHT * sum - OUTER_WEIGHT * box + (1 << (RESPONSE_SHIFT - 1))) >>
                      RESPONSE_SHIFT);
    }
}

/* The newest row has joined the sums. */
static bool finish_row(struct ih_bandpass *band, struct ih_bandpass_row *out)
{
    const struct rows rows = {
        .above = &binomial_of(band, IH_BANDPASS_REACH + 1)[LEAD],
        .middle = &binomial_of(band, IH_BANDPASS_REACH)[LEAD],
        .below = &binomial_of(band, IH_BANDPASS_REACH - 1)[LEAD],
    };
    const int32_t width = band->width;
    band->rows_in++;
    if (band->rows_in < IH_BANDPASS_ROWS) {
        return false;
    }
    if (!band->is_bytes) {
        respond_grey(&rows, &band->nine.of_grey_q4[LEAD - IH_BANDPASS_SIDE], width, out->response);
        list(out, 0, width, 0);
    } else {
        respond_and_list(&rows, &band->nine.of_bytes[LEAD - IH_BANDPASS_SIDE], width, out);
    }
    return true;
}

bool ih_bandpass_push_bytes(struct ih_bandpass *band, const uint8_t *row,
                            struct ih_bandpass_row *out)
{
    take_row_bytes(band, row);
    return finish_row(band, out);
}

bool ih_bandpass_push_grey(struct ih_bandpass *band, const uint16_t *row_q4,
                           struct ih_bandpass_row *out)
{
    take_row_grey(band, row_q4);
    return finish_row(band, out);
}

bool ih_bandpass_repeat(struct ih_bandpass *band, struct ih_bandpass_row *out)
{
    take_again(band);
    return finish_row(band, out);
}

void ih_bandpass_columns(const struct ih_bandpass *band, int32_t rows, uint16_t *sum)
{
    memset(sum, 0, (size_t)band->width * sizeof sum[0]);
    for (int32_t row = band->rows_in - rows; row < band->rows_in; row++) {
        const uint16_t *binomial = &band->binomial[row % IH_BANDPASS_KEPT][LEAD];
        const uint16_t *three = &band->three[row % IH_BANDPASS_ROWS][LEAD];
        for (int32_t u = 0; u < band->width; u++) {
            sum[u] = (uint16_t)(sum[u] + binomial[u] - three[u]);
        }
    }
}

bool ih_bandpass_is_any_above(const struct ih_bandpass *band, int32_t limit)
{
    const uint16_t *oldest = band->three[band->rows_in % IH_BANDPASS_ROWS];
    const uint16_t *nine = band->nine.of_bytes;
    const int32_t end = end_of(band);
    if (!band->is_bytes) {
        return true;
    }
#if IH_WORDS
    /* All are below 2^13: with a limit below it the sign says which is above. */
    const uint32_t min = IH_WORD_BOTH(0x7fff - ih_clamp_s32(limit, 0, 0x1fff));
    uint32_t any = 0;
    for (int32_t i = FIRST; i < end; i += 4) {
        any |= ih_word(&nine[i]) - ih_word(&oldest[i]) + min;
        any |= ih_word(&nine[i + 2]) - ih_word(&oldest[i + 2]) + min;
    }
    return (any & IH_WORD_SIGNS) != 0;
#else
    uint16_t max = 0;
    for (int32_t i = FIRST; i < end; i++) {
        const uint16_t eight = (uint16_t)(nine[i] - oldest[i]);
        max = eight > max ? eight : max;
    }
    return max > limit;
#endif
}

#if BY_LANES
/* Sums of nine rows of bytes, those of even and of odd pixels apart, as they come from bytes without being
 * spread; pairs are an even pixel's and the next one's. inner: 1-2-1 of the rows in the middle. */
struct halves {
    uint16_t *even, *odd, *pair;
    uint16_t *inner_even, *inner_odd;
};

/* Both bytes of each 16 bits and the upper one alone are added up; without its sum what is left is the
 * lower one's: everything is below 2^16. */
static inline ih_lanes even_of(ih_lanes both, ih_lanes odd)
{
    return less_of(both, IH_LANES_OP(slli_epi16)(odd, 8));
}

static inline ih_lanes odd_of(ih_lanes bytes)
{
    return IH_LANES_OP(srli_epi16)(bytes, 8);
}

/* A row above and one below join. */
static inline void join_rows(const uint8_t *above, const uint8_t *below, ih_lanes *both,
                             ih_lanes *odd)
{
    const ih_lanes over = ih_lanes_load(above);
    const ih_lanes under = ih_lanes_load(below);
    *both = sum_of(sum_of(*both, over), under);
    *odd = sum_of(sum_of(*odd, odd_of(over)), odd_of(under));
}

/* Of 2 * IH_LANES pixels from u on, an even one. */
static inline void sum_lanes(const uint8_t *const row[IH_BANDPASS_ROWS], int32_t u,
                             const struct halves *sums)
{
    const int32_t at = u / 2;
    const ih_lanes middle = ih_lanes_load(&row[4][u]);
    const ih_lanes middle_odd = odd_of(middle);
    ih_lanes both = middle;
    ih_lanes odd = middle_odd;
    join_rows(&row[3][u], &row[5][u], &both, &odd);
    const ih_lanes inner_odd = sum_of(odd, middle_odd);
    ih_lanes_store(even_of(sum_of(both, middle), inner_odd), &sums->inner_even[at]);
    ih_lanes_store(inner_odd, &sums->inner_odd[at]);
    join_rows(&row[2][u], &row[6][u], &both, &odd);
    join_rows(&row[1][u], &row[7][u], &both, &odd);
    join_rows(&row[0][u], &row[8][u], &both, &odd);
    const ih_lanes even = even_of(both, odd);
    ih_lanes_store(even, &sums->even[at]);
    ih_lanes_store(odd, &sums->odd[at]);
    ih_lanes_store(sum_of(even, odd), &sums->pair[at]);
}

/* R of 2 * IH_LANES pixels from u on. */
static inline void respond_halves(const struct halves *sums, int32_t u, int16_t *response)
{
    const int32_t at = u / 2;
    const ih_lanes pair = ih_lanes_load(&sums->pair[at]);
    const ih_lanes near = sum_of(sum_of(pair, ih_lanes_load(&sums->pair[at - 1])),
                                 ih_lanes_load(&sums->pair[at + 1]));
    const ih_lanes even_box = sum_of(sum_of(near, ih_lanes_load(&sums->pair[at - 2])),
                                     ih_lanes_load(&sums->even[at + 2]));
    const ih_lanes odd_box =
        sum_of(sum_of(near, ih_lanes_load(&sums->pair[at + 2])), ih_lanes_load(&sums->odd[at - 2]));
    const ih_lanes even = ih_lanes_load(&sums->inner_even[at]);
    const ih_lanes odd = ih_lanes_load(&sums->inner_odd[at]);
    const ih_lanes inner = sum_of(even, odd);
    const ih_lanes even_inner =
        sum_of(sum_of(inner, even), ih_lanes_load(&sums->inner_odd[at - 1]));
    const ih_lanes odd_inner = sum_of(sum_of(inner, odd), ih_lanes_load(&sums->inner_even[at + 1]));
    const ih_lanes even_r = less_of(inside_of(even_inner), even_box);
    const ih_lanes odd_r = less_of(inside_of(odd_inner), odd_box);
    const ih_lanes low = IH_LANES_OP(unpacklo_epi16)(even_r, odd_r);
    const ih_lanes high = IH_LANES_OP(unpackhi_epi16)(even_r, odd_r);
#ifdef __AVX2__
    __m128i *to = (__m128i *)(void *)&response[u];
    _mm_storeu_si128(&to[0], _mm256_castsi256_si128(low));
    _mm_storeu_si128(&to[1], _mm256_castsi256_si128(high));
    _mm_storeu_si128(&to[2], _mm256_extracti128_si256(low, 1));
    _mm_storeu_si128(&to[3], _mm256_extracti128_si256(high, 1));
#else
    ih_lanes_store(low, &response[u]);
    ih_lanes_store(high, &response[u + IH_LANES]);
#endif
}

/* Sums of the last column, as often as they are read behind the row. */
static void repeat_last(const uint8_t *const row[IH_BANDPASS_ROWS], int32_t width,
                        const struct halves *sums)
{
    const int32_t end = width / 2;
    uint16_t sum = 0;
    uint16_t inner = 0;
    for (int32_t i = 0; i < IH_BANDPASS_ROWS; i++) {
        const uint16_t pixel = row[i][width - 1];
        sum = (uint16_t)(sum + pixel);
        if (i >= IH_BANDPASS_REACH - 1 && i <= IH_BANDPASS_REACH + 1) {
            inner = (uint16_t)(inner + (i == IH_BANDPASS_REACH ? 2 * pixel : pixel));
        }
    }
    for (int32_t i = 0; i < 2; i++) {
        sums->even[end + i] = sum;
        sums->pair[end + i] = (uint16_t)(2 * sum);
    }
    sums->inner_even[end] = inner;
}

void ih_bandpass_bytes(struct ih_bandpass *band, const uint8_t *const row[IH_BANDPASS_ROWS],
                       int32_t width, size_t ahead, int16_t *response)
{
    const struct halves sums = {
        .even = &band->three[0][LEAD],
        .odd = &band->three[1][LEAD],
        .pair = &band->three[2][LEAD],
        .inner_even = &band->three[3][LEAD],
        .inner_odd = &band->three[4][LEAD],
    };
    const int32_t step = 2 * IH_LANES;
    const int32_t last = width / 2 * 2 - step; /* the last step ends with the row */
    band->width = width;
    band->is_bytes = true;
    sum_lanes(row, 0, &sums);
    for (int32_t i = 1; i <= 2; i++) { /* long before they are read by vectors */
        sums.odd[-i] = sums.even[0];
        sums.pair[-i] = (uint16_t)(2 * sums.even[0]);
    }
    sums.inner_odd[-1] = sums.inner_even[0];
    for (int32_t u = step; u < last; u += step) {
        sum_lanes(row, u, &sums);
    }
    sum_lanes(row, last, &sums);
    repeat_last(row, width, &sums);
    for (int32_t u = 0; u < last; u += step) {
        if (u % IH_LINE_BYTES == 0) {
            const size_t next = ahead + (size_t)u;
            __builtin_prefetch(&row[0][next]); /* no function: gcc 12 leaves out calls of it */
            __builtin_prefetch(&row[1][next]);
            __builtin_prefetch(&row[2][next]);
            __builtin_prefetch(&row[3][next]);
            __builtin_prefetch(&row[4][next]);
            __builtin_prefetch(&row[5][next]);
            __builtin_prefetch(&row[6][next]);
            __builtin_prefetch(&row[7][next]);
            __builtin_prefetch(&row[8][next]);
        }
        respond_halves(&sums, u, response);
    }
    respond_halves(&sums, last, response);
    if (width % 2 != 0) {
        const int32_t at = width / 2;
        const int32_t inner = 3 * sums.inner_even[at] + sums.inner_odd[at - 1];
        const int32_t box = sums.pair[at - 2] + sums.pair[at - 1] + 5 * sums.even[at];
        response[width - 1] =
            (int16_t)((INNER_WEIGHT * inner + OUTER_WEIGHT / 2) / OUTER_WEIGHT - box);
    }
}
#else
/* Sums of nine rows that are given, and 1-2-1 of those in the middle. */
static void sum_rows(const uint8_t *const row[IH_BANDPASS_ROWS], int32_t width,
                     uint16_t *restrict inner, uint16_t *restrict column)
{
    const uint8_t *above = row[IH_BANDPASS_REACH - 1];
    const uint8_t *middle = row[IH_BANDPASS_REACH];
    const uint8_t *below = row[IH_BANDPASS_REACH + 1];
    int32_t u = 0;
#if IH_WORDS
    for (; u + 4 <= width; u += 4) {
        const uint32_t over = ih_word_of_bytes(&above[u]);
        const uint32_t here = ih_word_of_bytes(&middle[u]);
        const uint32_t under = ih_word_of_bytes(&below[u]);
        const uint32_t even = ih_word_even(here);
        const uint32_t odd = ih_word_odd(here);
        const uint32_t even_sum = ih_word_add_even(ih_word_add_even(even, over), under);
        const uint32_t odd_sum = ih_word_add_odd(ih_word_add_odd(odd, over), under);
        const uint32_t even_inner = even_sum + even;
        const uint32_t odd_inner = odd_sum + odd;
        ih_word_put(ih_word_first(even_inner, odd_inner), &inner[u]);
        ih_word_put(ih_word_second(even_inner, odd_inner), &inner[u + 2]);
        ih_word_put(ih_word_first(even_sum, odd_sum), &column[u]);
        ih_word_put(ih_word_second(even_sum, odd_sum), &column[u + 2]);
    }
#endif
    for (; u < width; u++) {
        const uint16_t sum = (uint16_t)(above[u] + middle[u] + below[u]);
        inner[u] = (uint16_t)(sum + middle[u]);
        column[u] = sum;
    }
}

static void add_rows(const uint8_t *above, const uint8_t *below, int32_t width,
                     uint16_t *restrict column)
{
    int32_t u = 0;
#if IH_WORDS
    for (; u + 4 <= width; u += 4) {
        const uint32_t over = ih_word_of_bytes(&above[u]);
        const uint32_t under = ih_word_of_bytes(&below[u]);
        const uint32_t even = ih_word_add_even(ih_word_even(over), under);
        const uint32_t odd = ih_word_add_odd(ih_word_odd(over), under);
        ih_word_put(ih_word(&column[u]) + ih_word_first(even, odd), &column[u]);
        ih_word_put(ih_word(&column[u + 2]) + ih_word_second(even, odd), &column[u + 2]);
    }
#endif
    for (; u < width; u++) {
        column[u] = (uint16_t)(column[u] + above[u] + below[u]);
    }
}

/* Sums of a row, edge pixels repeated outside as far as the loops read. */
static void repeat_edges(uint16_t *sums, int32_t width, int32_t reach, int32_t end)
{
    for (int32_t i = 0; i < reach; i++) {
        sums[i] = sums[reach];
    }
    for (int32_t i = reach + width; i < end; i++) {
        sums[i] = sums[reach + width - 1];
    }
}

static void sum_threes(const uint16_t *column, int32_t count, uint16_t *restrict nine)
{
#if IH_WORDS
    for (int32_t i = 0; i < count; i += 2) {
        ih_word_put(ih_word(&column[i]) + ih_word(&column[i + 1]) + ih_word(&column[i + 2]),
                    &nine[i]);
    }
#else
    for (int32_t i = 0; i < count; i++) {
        nine[i] = (uint16_t)(column[i] + column[i + 1] + column[i + 2]);
    }
#endif
}

void ih_bandpass_bytes(struct ih_bandpass *band, const uint8_t *const row[IH_BANDPASS_ROWS],
                       int32_t width, size_t ahead, int16_t *response)
{
    (void)ahead;
    uint16_t *inner = band->three[0];
    uint16_t *column = band->binomial[0];
    band->width = width;
    band->is_bytes = true;
    const int32_t count =
        (width + 2 * IH_BANDPASS_SIDE + IH_BANDPASS_STEP - 1) / IH_BANDPASS_STEP * IH_BANDPASS_STEP;
    sum_rows(row, width, &inner[1], &column[IH_BANDPASS_REACH]);
    for (int32_t i = 2; i <= IH_BANDPASS_REACH; i++) {
        add_rows(row[IH_BANDPASS_REACH - i], row[IH_BANDPASS_REACH + i], width,
                 &column[IH_BANDPASS_REACH]);
    }
    repeat_edges(inner, width, 1, width + 2);
    repeat_edges(column, width, IH_BANDPASS_REACH, count + 2);
    sum_threes(column, count, band->nine.of_bytes);
    const struct rows rows = {.above = &inner[0], .middle = &inner[1], .below = &inner[2]};
    respond_bytes(&rows, band->nine.of_bytes, 0, width, response);
}
#endif
