#include "dots/ih_block_median.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "simd/ih_simd.h"
#include "simd/ih_simd_cortexm.h"

#define BLOCK IH_NOISE_BLOCK
#define ROWS IH_BLOCK_MEDIAN_ROWS
#define VALUES (ROWS * BLOCK) /* of a block */

static int32_t blocks_of(int32_t width)
{
    return (width + BLOCK - 1) / BLOCK;
}

#if !IH_CORTEXM && IH_I16_LANES > 0
/* Blocks in a vector, eight bytes of each. Two vectors are searched together: each step of a search waits
 * for the step before. */
#define SIDE IH_I64_LANES
#define ABREAST (2 * SIDE)
_Static_assert(IH_FRAME_WIDTH_MAX % (ABREAST * BLOCK) == 0,
               "rows have room for whole groups of blocks");
/* Lower bits of a large median, which are searched last. */
#define FINE_BITS 7
/* Subtracted from 0 .. 255, so that 8 bits with a sign hold it. */
#define MIDDLE 128

struct group {
    const int16_t *response[ROWS]; /* R of the first block */
    ih_i32 rank;                   /* of each block's median, twice */
    ih_i8 value[VALUES / 8];
    ih_u8 median; /* in all eight bytes of a block */
};

/* |R| >> bits of eight pixels of each block, less what is given, clamped to 8 bits. */
static inline ih_i8 load_values(const int16_t *response, int bits, ih_i16 even_offset,
                                ih_i16 odd_offset)
{
    const ih_i16 even = ih_i16_abs(ih_i16_load_eights(response, 2 * BLOCK));
    const ih_i16 odd = ih_i16_abs(ih_i16_load_eights(&response[BLOCK], 2 * BLOCK));
    return ih_i16_pack_eights(ih_i16_sub(ih_i16_shift_right(even, bits), even_offset),
                              ih_i16_sub(ih_i16_shift_right(odd, bits), odd_offset));
}

/* Offsets are those of even and odd blocks. */
static inline void fill_group(struct group *group, int bits, ih_i16 even_offset, ih_i16 odd_offset)
{
    for (int32_t i = 0; i < BLOCK / 8; i++) {
        for (int32_t row = 0; row < ROWS; row++) {
            group->value[ROWS * i + row] =
                load_values(&group->response[row][8 * i], bits, even_offset, odd_offset);
        }
    }
}

/* A search's step: the lower limit of the half that holds the median. */
static inline ih_u8 halve(const struct group *group, ih_u8 low, ih_u8 half)
{
    const ih_i8 limit = (ih_i8)(low + half);
    ih_u8 below = {0}; /* values, negative */
    for (int32_t i = 0; i < VALUES / 8; i++) {
        below = below + (ih_u8)(limit > group->value[i]);
    }
    const ih_i32 count = (ih_i32)ih_u8_sum_eights((ih_u8){0} - below);
    return low + (half & ~(ih_u8)ih_i32_even_twice(count > group->rank));
}

/* The byte of each block's rank; -128 stands for 0. */
static inline void search(struct group group[2])
{
    const ih_u8 min = ih_u8_all(MIDDLE);
    ih_u8 half = min;
    ih_u8 first = min;
    ih_u8 second = min;
    for (int32_t bit = 0; bit < 8; bit++) {
        first = halve(&group[0], first, half);
        second = halve(&group[1], second, half);
        half = half >> 1;
    }
    group[0].median = first + min;
    group[1].median = second + min;
}

static inline bool is_any_large(const struct group group[2])
{
    const ih_u8 all = ih_u8_all(UINT8_MAX);
    return ih_i16_any((ih_i16)((group[0].median == all) | (group[1].median == all)));
}

static inline void store_medians(const struct group group[2], uint8_t median[8 * ABREAST])
{
    ih_u8_store(&median[0], group[0].median);
    ih_u8_store(&median[8 * SIDE], group[1].median);
}

/* Values relative to their block's median without its FINE_BITS. */
static inline void fill_fine(struct group *group, const uint8_t coarse[8 * SIDE])
{
    int16_t even[IH_I16_LANES];
    int16_t odd[IH_I16_LANES];
    for (int32_t i = 0; i < IH_I16_LANES; i++) { /* blocks in turn, by eight lanes */
        const int32_t block = 2 * (i / 8);
        even[i] = (int16_t)((coarse[8 * block] << FINE_BITS) + MIDDLE);
        odd[i] = (int16_t)((coarse[8 * (block + 1)] << FINE_BITS) + MIDDLE);
    }
    fill_group(group, 0, ih_i16_load(even), ih_i16_load(odd));
}

/* A median above 8 bits is most often below twice as much. Otherwise its upper bits are the median of the
 * values' upper bits, and its lower bits are searched last. A value that is clamped stays on its side. */
static void find_large(struct group group[2], uint16_t median[ABREAST])
{
    const ih_i16 middle = ih_i16_all(MIDDLE);
    const ih_i16 above = ih_i16_all(MIDDLE + UINT8_MAX);
    uint8_t coarse[8 * ABREAST];
    uint8_t fine[8 * ABREAST];
    int bits = 0;
    store_medians(group, coarse);
    for (int32_t i = 0; i < 2; i++) {
        fill_group(&group[i], 0, above, above);
    }
    search(group);
    if (is_any_large(group)) {
        bits = FINE_BITS;
        for (int32_t i = 0; i < 2; i++) {
            fill_group(&group[i], FINE_BITS, middle, middle);
        }
        search(group);
        store_medians(group, coarse);
        for (int32_t i = 0; i < 2; i++) {
            fill_fine(&group[i], &coarse[8 * SIDE * i]);
        }
        search(group);
    }
    store_medians(group, fine);
    for (int32_t i = 0; i < ABREAST; i++) {
        median[i] = (uint16_t)((coarse[8 * i] << bits) + fine[8 * i]);
    }
}

/* Pixels that a block lacks are larger than any. */
static void fill_missing(int16_t response[ROWS][IH_FRAME_WIDTH_MAX], int32_t width, int32_t rows)
{
    const int32_t group = ABREAST * BLOCK;
    const int32_t end = (width + group - 1) / group * group;
    for (int32_t row = 0; row < ROWS; row++) {
        for (int32_t u = row < rows ? width : 0; u < end; u++) {
            response[row][u] = INT16_MAX;
        }
    }
}

/* Ranks of blocks with so many pixels a row in all; -1 behind them, so that these have no large median. */
static inline ih_i32 ranks_of(int32_t width, int32_t rows)
{
    int32_t rank[2 * SIDE];
    if (width >= SIDE * BLOCK) {
        return ih_i32_all(rows * BLOCK / 2);
    }
    for (int32_t i = 0; i < SIDE; i++) {
        const int32_t own = ih_min_s32(BLOCK, width - i * BLOCK);
        rank[2 * i] = own > 0 ? rows * own / 2 : -1;
        rank[2 * i + 1] = rank[2 * i];
    }
    return ih_i32_load(rank);
}

void ih_block_medians(int16_t response[ROWS][IH_FRAME_WIDTH_MAX], int32_t width, int32_t rows,
                      uint16_t *median)
{
    const ih_i16 middle = ih_i16_all(MIDDLE);
    const int32_t blocks = blocks_of(width);
    fill_missing(response, width, rows);
    for (int32_t first = 0; first < blocks; first += ABREAST) {
        const int32_t abreast = ih_min_s32(ABREAST, blocks - first);
        uint8_t small[8 * ABREAST];
        struct group group[2];
        for (int32_t i = 0; i < 2; i++) {
            const int32_t u = (first + i * SIDE) * BLOCK;
            for (int32_t row = 0; row < ROWS; row++) {
                group[i].response[row] = &response[row][u];
            }
            group[i].rank = ranks_of(width - u, rows);
            fill_group(&group[i], 0, middle, middle);
        }
        search(group);
        if (is_any_large(group)) {
            uint16_t large[ABREAST];
            find_large(group, large);
            memcpy(&median[first], large, (size_t)abreast * sizeof median[0]);
            continue;
        }
        store_medians(group, small);
        for (int32_t i = 0; i < abreast; i++) {
            median[first + i] = small[8 * i];
        }
    }
}
#else
/* count_up_to: how many of a block's values, all below 2^15, are up to the limit? */
#if IH_CORTEXM
#include "dots/ih_noise_cortexm.h"
#else
static int32_t count_up_to(const uint16_t value[VALUES], uint16_t limit)
{
    uint16_t count = 0;
    for (int32_t i = 0; i < VALUES; i++) {
        count = (uint16_t)(count + (value[i] <= limit));
    }
    return count;
}
#endif

/* Values behind count are larger than any. */
static uint16_t search(const uint16_t value[VALUES], int32_t count)
{
    int32_t low = 0;
    int32_t high = UINT8_MAX;
    if (count_up_to(value, UINT8_MAX) <= count / 2) {
        low = UINT8_MAX + 1;
        high = INT16_MAX;
    }
    while (low < high) { /* the median is in low .. high */
        const int32_t middle = (low + high) / 2;
        if (count_up_to(value, (uint16_t)middle) > count / 2) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    return (uint16_t)low;
}

/* The median of a block of so many pixels a row. */
static uint16_t find_median(const int16_t response[ROWS][IH_FRAME_WIDTH_MAX], int32_t first,
                            int32_t width, int32_t rows)
{
    uint16_t value[VALUES];
    int32_t count = 0;
    for (int32_t row = 0; row < rows; row++) {
        for (int32_t u = first; u < first + width; u++) {
            value[count++] = (uint16_t)ih_abs_s32(response[row][u]);
            IH_IN_RANGE(value[count - 1], 0, IH_RANGE_RESPONSE);
        }
    }
    for (int32_t i = count; i < VALUES; i++) {
        value[i] = INT16_MAX;
    }
    return search(value, count);
}

void ih_block_medians(int16_t response[ROWS][IH_FRAME_WIDTH_MAX], int32_t width, int32_t rows,
                      uint16_t *median)
{
    const int32_t blocks = blocks_of(width);
    for (int32_t block = 0; block < blocks; block++) {
        const int32_t first = block * BLOCK;
        median[block] = find_median((const int16_t(*)[IH_FRAME_WIDTH_MAX])response, first,
                                    ih_min_s32(BLOCK, width - first), rows);
    }
}
#endif
