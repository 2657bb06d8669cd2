#include "dots/ih_noise.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "simd/ih_lanes.h"
#include "simd/ih_words.h"

/* All of the ambient light is taken away. */
#define WHOLE_Q12 4096
/* What is left where nothing changed; noise must not be cut at 0, but the dark ghost of something
 * that moved shall be. */
#define REST_Q4 64
/* White noise, which is what is left, has more lonely maxima than texture of the same median. */
#define WHITE_Q4 19
#define SAMPLED_ROWS (IH_NOISE_BLOCK / IH_NOISE_STEP)
#define SAMPLES_MAX (SAMPLED_ROWS * IH_NOISE_BLOCK)
/* Nearly all medians are at most this, three grey levels. */
#define MOSTLY_BELOW 255

/* Twice the distance of a pixel from the first block's centre, limited to between the outermost
 * centres; a block is 2 * IH_NOISE_BLOCK of it. */
static uint32_t twice_offset(int32_t pixel, int32_t blocks)
{
    return (uint32_t)ih_clamp_s32(2 * pixel - (IH_NOISE_BLOCK - 1), 0,
                                  2 * IH_NOISE_BLOCK * (blocks - 1));
}

static int32_t between(int32_t low, int32_t high, int32_t part)
{
    return low + (((high - low) * part + 32) >> 6);
}

/* Ranges are checked without vectors. */
#if defined IH_LANES_OP && !IH_WORDS && !defined ISOHEAD_RANGE_CHECKS
/* Blocks side by side in a vector, 8 bytes of each; those whose medians are looked for at once: each step
 * waits for the step before. */
#define SIDE (IH_LANES / 4)
#define ABREAST (2 * SIDE)
_Static_assert(IH_FRAME_WIDTH_MAX % (ABREAST * IH_NOISE_BLOCK) == 0,
               "a row of R has room for whole groups of blocks");
/* Bits of a large median that are looked for last. */
#define FINE_BITS 7

struct group {
    const int16_t *above, *below; /* R of the first block in both rows */
    ih_lanes rank;                /* of the median, in the lower half of a block's 64 bits */
    ih_lanes size[SAMPLES_MAX / 8];
    ih_lanes median; /* in each byte of a block */
};

/* |R|. */
static inline ih_lanes sizes_of(ih_lanes response)
{
#ifdef __AVX2__
    return _mm256_abs_epi16(response);
#else
    return _mm_max_epi16(response, _mm_sub_epi16(_mm_setzero_si128(), response));
#endif
}

/* R of 8 pixels of each second block. */
static inline ih_lanes load_apart(const int16_t *response)
{
#ifdef __AVX2__
    const __m128i *first = (const __m128i *)(const void *)response;
    const __m128i *third = (const __m128i *)(const void *)&response[2 * IH_NOISE_BLOCK];
    return _mm256_inserti128_si256(_mm256_castsi128_si256(_mm_loadu_si128(first)),
                                   _mm_loadu_si128(third), 1);
#else
    return ih_lanes_load(response);
#endif
}

/* |R| of 8 pixels of each block without its lowest bits, less what is given, limited to 8 bits with sign. */
static inline ih_lanes limited_of(const int16_t *response, int bits, ih_lanes even_less,
                                  ih_lanes odd_less)
{
    const ih_lanes even = sizes_of(load_apart(response));
    const ih_lanes odd = sizes_of(load_apart(&response[IH_NOISE_BLOCK]));
    return IH_LANES_OP(packs_epi16)(
        IH_LANES_OP(sub_epi16)(IH_LANES_OP(srli_epi16)(even, bits), even_less),
        IH_LANES_OP(sub_epi16)(IH_LANES_OP(srli_epi16)(odd, bits), odd_less));
}

static inline void fill_group(struct group *group, int bits, ih_lanes even_less, ih_lanes odd_less)
{
    for (int32_t i = 0; i < 4; i++) {
        group->size[i] = limited_of(&group->above[8 * i], bits, even_less, odd_less);
        group->size[i + 4] = limited_of(&group->below[8 * i], bits, even_less, odd_less);
    }
}

/* How many of both are less in each byte, negative. */
static inline ih_lanes two_below(const ih_lanes size[2], ih_lanes limit)
{
    return IH_LANES_OP(add_epi8)(IH_LANES_OP(cmpgt_epi8)(limit, size[0]),
                                 IH_LANES_OP(cmpgt_epi8)(limit, size[1]));
}

/* Of what may be the median, from low on, the upper half or the lower one. */
static inline ih_lanes halved(const struct group *group, ih_lanes low, ih_lanes half)
{
    const ih_lanes zero = IH_LANES_BITS(setzero)();
    const ih_lanes limit = IH_LANES_OP(add_epi8)(low, half);
    const ih_lanes above =
        IH_LANES_OP(add_epi8)(two_below(&group->size[0], limit), two_below(&group->size[2], limit));
    const ih_lanes below =
        IH_LANES_OP(add_epi8)(two_below(&group->size[4], limit), two_below(&group->size[6], limit));
    const ih_lanes less = IH_LANES_OP(sub_epi8)(IH_LANES_OP(sub_epi8)(zero, above), below);
    const ih_lanes is_lower =
        IH_LANES_OP(cmpgt_epi32)(IH_LANES_OP(sad_epu8)(less, zero), group->rank);
    return IH_LANES_OP(add_epi8)(
        low, ih_lanes_without(half, IH_LANES_OP(shuffle_epi32)(is_lower, 0xa0)));
}

/* The size of that rank, from 0; -128 stands for 0. */
static inline void search(struct group group[2])
{
    const ih_lanes min = IH_LANES_OP(set1_epi8)(INT8_MIN);
    ih_lanes half = min;
    ih_lanes first = min;
    ih_lanes second = min;
    for (int32_t bit = 0; bit < 8; bit++) {
        first = halved(&group[0], first, half);
        second = halved(&group[1], second, half);
        half = IH_LANES_OP(srli_epi16)(half, 1); /* nothing comes over from the byte above */
    }
    group[0].median = IH_LANES_OP(add_epi8)(first, min);
    group[1].median = IH_LANES_OP(add_epi8)(second, min);
}

static inline bool is_any_large(const struct group group[2])
{
    const ih_lanes max = IH_LANES_OP(max_epu8)(group[0].median, group[1].median);
    return ih_lanes_is_any(IH_LANES_OP(cmpeq_epi8)(max, IH_LANES_OP(set1_epi8)(-1)));
}

static inline void put_medians(const struct group group[2], uint8_t median[8 * ABREAST])
{
    ih_lanes_store(group[0].median, &median[0]);
    ih_lanes_store(group[1].median, &median[8 * SIDE]);
}

/* What they are more than 8 bits hold, which most often is no more than that again. Else medians without
 * their lowest bits, which are those of what has no lowest bits, and then the lowest bits. What is less or
 * far greater than what is looked for is limited, and stays on its side. */
static void large_medians(struct group group[2], uint16_t median[ABREAST])
{
    const ih_lanes zero = IH_LANES_BITS(setzero)();
    const ih_lanes middle = IH_LANES_OP(set1_epi16)(128);
    const ih_lanes more = IH_LANES_OP(set1_epi16)(128 + UINT8_MAX);
    uint8_t coarse[8 * ABREAST];
    uint8_t fine[8 * ABREAST];
    int bits = 0;
    put_medians(group, coarse);
    fill_group(&group[0], 0, more, more);
    fill_group(&group[1], 0, more, more);
    search(group);
    if (is_any_large(group)) {
        bits = FINE_BITS;
        for (int32_t i = 0; i < 2; i++) {
            fill_group(&group[i], FINE_BITS, middle, middle);
        }
        search(group);
        put_medians(group, coarse);
        for (int32_t i = 0; i < 2; i++) {
            const ih_lanes low = group[i].median;
            const ih_lanes even =
                IH_LANES_OP(slli_epi16)(IH_LANES_OP(unpacklo_epi8)(low, zero), FINE_BITS);
            const ih_lanes odd =
                IH_LANES_OP(slli_epi16)(IH_LANES_OP(unpackhi_epi8)(low, zero), FINE_BITS);
            fill_group(&group[i], 0, IH_LANES_OP(add_epi16)(even, middle),
                       IH_LANES_OP(add_epi16)(odd, middle));
        }
        search(group);
    }
    put_medians(group, fine);
    for (int32_t i = 0; i < ABREAST; i++) {
        median[i] = (uint16_t)((coarse[8 * i] << bits) + fine[8 * i]);
    }
}

/* What is missing is as large as any. */
static void fill_up(struct ih_noise_scratch *scratch, int32_t columns, int32_t rows)
{
    const int32_t group = ABREAST * IH_NOISE_BLOCK;
    const int32_t end = (columns + ABREAST - 1) / ABREAST * group;
    for (int32_t row = 0; row < SAMPLED_ROWS; row++) {
        for (int32_t u = row < rows ? scratch->band.width : 0; u < end; u++) {
            scratch->response[row][u] = INT16_MAX;
        }
    }
}

/* Of blocks with so many pixels a row in all; less than 0 behind them, so that these do not look large. */
static inline ih_lanes ranks_of(int32_t width, int32_t rows)
{
    int32_t rank[2 * SIDE];
    if (width >= SIDE * IH_NOISE_BLOCK) {
        return IH_LANES_OP(set1_epi32)(rows * IH_NOISE_BLOCK / 2);
    }
    for (int32_t i = 0; i < SIDE; i++) {
        const int32_t own = ih_min_s32(IH_NOISE_BLOCK, width - i * IH_NOISE_BLOCK);
        rank[2 * i] = own > 0 ? rows * own / 2 : -1;
        rank[2 * i + 1] = rank[2 * i];
    }
    return ih_lanes_load(rank);
}

/* Medians of a row of blocks. Nearly all are small: they are looked for in 8 bits. */
static void block_medians(struct ih_noise_scratch *scratch, int32_t columns, int32_t rows,
                          uint16_t *median)
{
    const ih_lanes middle = IH_LANES_OP(set1_epi16)(128);
    fill_up(scratch, columns, rows);
    for (int32_t first = 0; first < columns; first += ABREAST) {
        const int32_t abreast = ih_min_s32(ABREAST, columns - first);
        uint8_t small[8 * ABREAST];
        struct group group[2];
        for (int32_t i = 0; i < 2; i++) {
            const int32_t u = (first + i * SIDE) * IH_NOISE_BLOCK;
            group[i].above = &scratch->response[0][u];
            group[i].below = &scratch->response[1][u];
            group[i].rank = ranks_of(scratch->band.width - u, rows);
            fill_group(&group[i], 0, middle, middle);
        }
        search(group);
        if (is_any_large(group)) {
            uint16_t large[ABREAST];
            large_medians(group, large);
            memcpy(&median[first], large, (size_t)abreast * sizeof median[0]);
            continue;
        }
        put_medians(group, small);
        for (int32_t i = 0; i < abreast; i++) {
            median[first + i] = small[8 * i];
        }
    }
}
#else
/* How many of the values of a block are at most so large; all are below 2^15. */
static int32_t at_most(const uint16_t value[SAMPLES_MAX], uint16_t limit)
{
#if IH_WORDS
    const uint32_t one = ih_word_kept(IH_WORD_BOTH(1));
    const uint32_t raised = IH_WORD_BOTH(limit) + IH_WORD_BOTH(0x8000);
    uint32_t count = 0;
    for (int32_t i = 0; i < SAMPLES_MAX; i += 8) { /* unrolled: gcc 12 does not at -O2 */
        count += (raised - ih_word(&value[i])) >> 15 & one;
        count += (raised - ih_word(&value[i + 2])) >> 15 & one;
        count += (raised - ih_word(&value[i + 4])) >> 15 & one;
        count += (raised - ih_word(&value[i + 6])) >> 15 & one;
    }
    return (int32_t)((count & UINT16_MAX) + (count >> 16));
#else
    uint16_t count = 0;
    for (int32_t i = 0; i < SAMPLES_MAX; i++) {
        count = (uint16_t)(count + (value[i] <= limit));
    }
    return count;
#endif
}

/* The value of rank count / 2, from 0: the k-th smallest by halving the range of values, most often
 * the first few hundred of them. What is behind count is larger than any. */
static uint16_t median_of(const uint16_t value[SAMPLES_MAX], int32_t count)
{
    int32_t low = 0;
    int32_t high = MOSTLY_BELOW;
    if (at_most(value, MOSTLY_BELOW) <= count / 2) {
        low = MOSTLY_BELOW + 1;
        high = INT16_MAX;
    }
    while (low < high) { /* the median is in low..high */
        int32_t middle = (low + high) / 2;
        if (at_most(value, (uint16_t)middle) > count / 2) {
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
            IH_IN_RANGE(value[count - 1], 0, IH_RANGE_RESPONSE);
        }
    }
    for (int32_t i = count; i < SAMPLES_MAX; i++) {
        value[i] = INT16_MAX;
    }
    return median_of(value, count);
}

#if !IH_WORDS
/* Blocks whose medians are looked for at once: each step of one waits for the step before. */
#define ABREAST 8

/* How many of the values of a block are at most so large. */
static int32_t at_most_of_bytes(const uint8_t value[SAMPLES_MAX], uint8_t limit)
{
    uint8_t count = 0;
    for (int32_t i = 0; i < SAMPLES_MAX; i++) {
        count = (uint8_t)(count + (value[i] <= limit));
    }
    return count;
}

/* |R| of a block's pixels, limited to 8 bits, and how many they are; what is missing is as large as any. */
static int32_t limit_block(const struct ih_noise_scratch *scratch, int32_t column, int32_t rows,
                           uint8_t limited[SAMPLES_MAX])
{
    const int32_t first = column * IH_NOISE_BLOCK;
    const int32_t width = ih_min_s32(IH_NOISE_BLOCK, scratch->band.width - first);
    memset(limited, UINT8_MAX, SAMPLES_MAX);
    for (int32_t row = 0; row < rows; row++) {
        const int16_t *response = &scratch->response[row][first];
        for (int32_t u = 0; u < width; u++) {
            const int16_t size = (int16_t)(response[u] < 0 ? -response[u] : response[u]);
            limited[row * IH_NOISE_BLOCK + u] = (uint8_t)(size < UINT8_MAX ? size : UINT8_MAX);
        }
    }
    return rows * width;
}

/* Medians of a row of blocks. Nearly all are small: they are looked for in 8 bits. */
static void block_medians(struct ih_noise_scratch *scratch, int32_t columns, int32_t rows,
                          uint16_t *median)
{
    for (int32_t first = 0; first < columns; first += ABREAST) {
        const int32_t abreast = ih_min_s32(ABREAST, columns - first);
        uint8_t limited[ABREAST][SAMPLES_MAX];
        int32_t count[ABREAST];
        int32_t low[ABREAST] = {0};
        for (int32_t i = 0; i < abreast; i++) {
            count[i] = limit_block(scratch, first + i, rows, limited[i]);
        }
        for (int32_t half = (UINT8_MAX + 1) / 2; half > 0; half /= 2) {
            for (int32_t i = 0; i < abreast; i++) {
                const uint8_t last = (uint8_t)(low[i] + half - 1);
                low[i] += at_most_of_bytes(limited[i], last) > count[i] / 2 ? 0 : half;
            }
        }
        for (int32_t i = 0; i < abreast; i++) {
            median[first + i] =
                low[i] < UINT8_MAX ? (uint16_t)low[i] : block_median(scratch, first + i, rows);
        }
    }
}
#else
static void block_medians(struct ih_noise_scratch *scratch, int32_t columns, int32_t rows,
                          uint16_t *median)
{
    for (int32_t column = 0; column < columns; column++) {
        median[column] = block_median(scratch, column, rows);
    }
}
#endif
#endif

static bool is_any_subtracted(const struct ih_noise *noise, int32_t above, int32_t below)
{
    uint32_t any = 0;
    for (int32_t column = 0; column < noise->columns; column++) {
        any |= noise->subtract[above][column] | noise->subtract[below][column];
    }
    return any != 0;
}

/* The share that a block wants. */
static int32_t share_q12(const struct ih_noise *noise, int32_t row, int32_t column)
{
    return noise->subtract[row][column] != 0 ? WHOLE_Q12 : 0;
}

/* Pixels first .. end - 1 lie behind one block's centre and before the next one's, the first of them
 * part 64ths of the way on, each further one 2 more. */
static void subtract_span(const uint16_t *ambient_q4, uint16_t *grey_q4, int32_t first, int32_t end,
                          int32_t from_q12, int32_t to_q12, int32_t part)
{
    if (from_q12 == 0 && to_q12 == 0) {
        return;
    }
    for (int32_t u = first; u < end; u++) {
        int32_t share = from_q12 + (((to_q12 - from_q12) * part + 32) >> 6);
        int32_t taken = ((ambient_q4[u] - REST_Q4) * share + WHOLE_Q12 / 2) >> 12;
        grey_q4[u] = (uint16_t)ih_max_s32(0, grey_q4[u] - taken);
        IH_IN_RANGE(grey_q4[u], 0, IH_RANGE_GREY_Q4);
        part += 2;
    }
}

void ih_noise_subtract(const struct ih_noise *noise, int32_t v, int32_t width,
                       const uint16_t *ambient_q4, uint16_t *grey_q4)
{
    const uint32_t offset_v = twice_offset(v, noise->rows);
    const int32_t above = (int32_t)(offset_v / (2 * IH_NOISE_BLOCK));
    const int32_t below = ih_min_s32(above + 1, noise->rows - 1);
    if (!is_any_subtracted(noise, above, below)) {
        return;
    }
    int32_t before_q12 = 0;
    int32_t first = 0;
    for (int32_t column = 0; column < noise->columns; column++) {
        int32_t here_q12 = between(share_q12(noise, above, column), share_q12(noise, below, column),
                                   (int32_t)(offset_v % (2 * IH_NOISE_BLOCK)));
        int32_t end = ih_min_s32(width, column * IH_NOISE_BLOCK + IH_NOISE_BLOCK / 2);
        subtract_span(ambient_q4, grey_q4, first, end, column == 0 ? here_q12 : before_q12,
                      here_q12, 1);
        before_q12 = here_q12;
        first = end;
    }
    subtract_span(ambient_q4, grey_q4, first, width, before_q12, before_q12, 1);
}

/* The first row that is looked at in a row of blocks, even if the frame ends above it. */
static int32_t first_row(int32_t block_row, int32_t height)
{
    return ih_min_s32(block_row * IH_NOISE_BLOCK + IH_BANDPASS_REACH, height - 1);
}

/* Are there so many, and does the frame reach this one? */
static bool is_sampled(int32_t count, int32_t v, int32_t height)
{
    return count < SAMPLED_ROWS && v < height;
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

/* R of row v as it is in the frame. */
static void filter_bytes(const struct ih_frame *frame, int32_t v, struct ih_bandpass *band,
                         int16_t *response)
{
    const uint8_t *samples = frame->samples;
    const uint8_t *row[IH_BANDPASS_ROWS];
    for (int32_t i = 0; i < IH_BANDPASS_ROWS; i++) {
        const int32_t at = ih_clamp_s32(v + i - IH_BANDPASS_REACH, 0, frame->height - 1);
        row[i] = &samples[(size_t)at * (size_t)frame->stride_bytes];
    }
    const bool is_last = v + IH_NOISE_STEP + IH_BANDPASS_REACH >= frame->height;
    ih_bandpass_bytes(band, row, frame->width,
                      is_last ? 0 : IH_NOISE_STEP * (size_t)frame->stride_bytes, response);
}

/* R of row v, without the ambient frame, if there is one, where the map says so. */
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
        block_medians(scratch, out->columns, count, out->median[block_row]);
    }
}

/* Half of the difference of both rows, from the middle of the range: not cut on either side. */
static void halve_difference(struct ih_noise_scratch *scratch)
{
    uint16_t *grey_q4 = scratch->grey_q4;
    for (int32_t u = 0; u < scratch->band.width; u++) {
        grey_q4[u] = (uint16_t)((grey_q4[u] + IH_BANDPASS_FULL_Q4 - scratch->ambient_q4[u]) >> 1);
    }
}

/* Sum over a row's part in each block. */
static void add_row(const uint16_t *grey_q4, int32_t width, int32_t sum[IH_NOISE_BLOCKS_X])
{
    for (int32_t u = 0; u < width; u++) {
        sum[u / IH_NOISE_BLOCK] += grey_q4[u] - IH_BANDPASS_FULL_Q4 / 2;
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
    block_medians(scratch, out->columns, count, half_median);
    for (int32_t column = 0; column < out->columns; column++) {
        int32_t width = ih_min_s32(IH_NOISE_BLOCK, frame->width - column * IH_NOISE_BLOCK);
        bool quieter = 16 * half_median[column] < 7 * out->median[block_row][column];
        bool darker = half_sum[column] < -(REST_Q4 / 4) * width * count;
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

/* Two blocks of a column or row between whose centres a pixel lies, and how far on it is, in 64ths. */
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

int32_t ih_noise_min(const struct ih_noise_row *row, int32_t block)
{
    const int32_t last = ih_min_s32(block + 1, row->columns - 1);
    int32_t min = ih_min_s32(row->above[block], row->below[block]);
    for (int32_t i = ih_max_s32(block - 1, 0); i <= last; i++) {
        min = ih_min_s32(min, ih_min_s32(row->above[i], row->below[i]));
    }
    return min;
}
