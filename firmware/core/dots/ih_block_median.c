#include "dots/ih_block_median.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "simd/ih_simd.h"
#include "simd/ih_simd_cortexm.h"

#define BLOCK IH_NOISE_BLOCK
#define ROWS IH_BLOCK_MEDIAN_ROWS
#define VALUES (ROWS * BLOCK) /* of a block */

/* count_up_to: how many of a block's values are up to the limit? */
#if IH_CORTEXM
#include "dots/ih_noise_cortexm.h"
#else
static int32_t count_up_to(const int16_t value[VALUES], int16_t limit)
{
    int16_t above = 0;
    for (int32_t i = 0; i < VALUES; i++) {
        above = (int16_t)(above + (value[i] > limit));
    }
    return VALUES - above;
}
#endif

/* The median of a block, if it is below twice this power of two; else one less than that. */
static uint16_t find_median(int16_t response[ROWS][IH_FRAME_WIDTH_MAX], int32_t first,
                            int32_t power)
{
    int16_t value[VALUES];
    int32_t low = 0;
    for (int32_t row = 0; row < ROWS; row++) {
        const int16_t *from = &response[row][first];
        int16_t *to = &value[row * BLOCK];
        for (int32_t i = 0; i < BLOCK; i++) {
            to[i] = (int16_t)ih_abs_s32(from[i]);
            IH_IN_RANGE(to[i], 0, IH_RANGE_RESPONSE);
        }
    }
    for (int32_t half = power; half > 0; half >>= 1) {
        if (count_up_to(value, (int16_t)(low + half - 1)) <= VALUES / 2) {
            low += half;
        }
    }
    return (uint16_t)low;
}

/* find_small: medians of blocks that are searched together, UINT8_MAX for larger ones. */
#if !IH_CORTEXM && IH_I16_LANES > 0
/* Blocks in a vector, eight bytes of each. Two vectors are searched together: each step of a search waits
 * for the step before. */
#define TOGETHER (2 * IH_I64_LANES)
#define SIDE (TOGETHER * BLOCK) /* their width */
/* Subtracted from 0 .. 255, so that 8 bits with a sign hold it. */
#define MIDDLE 128

struct group {
    ih_i8 value[VALUES / 8];
    ih_u8 low; /* the median is no smaller; in all eight bytes of a block */
};

/* |R| of eight pixels of each block, less MIDDLE, clamped to 8 bits. */
static inline ih_i8 load_values(const int16_t *response)
{
    const ih_i16 middle = ih_i16_all(MIDDLE);
    const ih_i16 even = ih_i16_abs(ih_i16_load_eights(response, 2 * BLOCK));
    const ih_i16 odd = ih_i16_abs(ih_i16_load_eights(&response[BLOCK], 2 * BLOCK));
    return ih_i16_pack_eights(ih_i16_sub(even, middle), ih_i16_sub(odd, middle));
}

/* A search's step: the lower limit of the half that holds the median. */
static inline ih_u8 halve(const struct group *group, ih_u8 half)
{
    const ih_i8 limit = (ih_i8)(group->low + half);
    ih_u8 below = {0}; /* values, negative */
    for (int32_t i = 0; i < VALUES / 8; i++) {
        below = below + (ih_u8)(limit > group->value[i]);
    }
    const ih_i32 count = (ih_i32)ih_u8_sum_eights((ih_u8){0} - below);
    return group->low + (half & ~(ih_u8)ih_i32_even_twice(count > VALUES / 2));
}

static inline void find_small(int16_t response[ROWS][IH_FRAME_WIDTH_MAX], int32_t first,
                              uint8_t small[TOGETHER])
{
    struct group group[2];
    uint8_t low[8 * TOGETHER];
    for (int32_t i = 0; i < VALUES / 8; i++) {
        const int16_t *from = &response[8 * i / BLOCK][first + 8 * i % BLOCK];
        group[0].value[i] = load_values(from);
        group[1].value[i] = load_values(&from[SIDE / 2]);
    }
    group[0].low = ih_u8_all(MIDDLE); /* -128 stands for 0 */
    group[1].low = ih_u8_all(MIDDLE);
    for (int32_t half = 1 << 7; half > 0; half >>= 1) {
        group[0].low = halve(&group[0], ih_u8_all((uint8_t)half));
        group[1].low = halve(&group[1], ih_u8_all((uint8_t)half));
    }
    ih_u8_store(&low[0], group[0].low);
    ih_u8_store(&low[4 * TOGETHER], group[1].low);
    for (int32_t i = 0; i < TOGETHER; i++) {
        small[i] = low[8 * i] ^ MIDDLE;
    }
}
#else
#define TOGETHER 1
#define SIDE BLOCK

static inline void find_small(int16_t response[ROWS][IH_FRAME_WIDTH_MAX], int32_t first,
                              uint8_t small[TOGETHER])
{
    small[0] = (uint8_t)find_median(response, first, 1 << 7);
}
#endif

/* Of the pixels that blocks lack one in two is 0, the others are no smaller than any: the median stays. */
static void fill_missing(int16_t response[ROWS][IH_FRAME_WIDTH_MAX], int32_t width, int32_t rows)
{
    const int32_t end = (width + SIDE - 1) / SIDE * SIDE;
    for (int32_t row = 0; row < ROWS; row++) {
        const int32_t begin = row < rows ? width : 0;
        for (int32_t u = begin; u < end; u++) {
            response[row][u] = (u - begin + row) % 2 == 0 ? 0 : IH_RANGE_RESPONSE;
        }
    }
}

void ih_block_medians(int16_t response[ROWS][IH_FRAME_WIDTH_MAX], int32_t width, int32_t rows,
                      uint16_t *median)
{
    const int32_t blocks = (width + BLOCK - 1) / BLOCK;
    fill_missing(response, width, rows);
    for (int32_t first = 0; first < blocks; first += TOGETHER) {
        uint8_t small[TOGETHER];
        find_small(response, first * BLOCK, small);
        for (int32_t i = 0; i < ih_min_s32(TOGETHER, blocks - first); i++) {
            median[first + i] = small[i] < UINT8_MAX
                                    ? small[i]
                                    : find_median(response, (first + i) * BLOCK, 1 << 14);
        }
    }
}
