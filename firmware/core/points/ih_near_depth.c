#include "points/ih_near_depth.h"

#define PERCENTILE 8

/* A selection digit by digit of seven bits, the highest first: a step of it is 64 mm, and few near depths have the
 * same. Depths with another digit leave the selection. */
#define DIGIT_BITS 7
#define DIGITS_MAX 256

_Static_assert(IH_DEPTH_MAX_MM << 8 < DIGITS_MAX << (2 * DIGIT_BITS), "depths have three digits");

/* The digits so far, and the next one, of the depth of a rank, from 0, among those given. Depths with the same digits
 * stay, and the rank becomes that among them. No depth is negative. */
static uint32_t next_digit(uint32_t depth_mm_q8[IH_SLOTS], int32_t *depth_count, uint32_t begin,
                           int shift, int32_t *rank)
{
    uint16_t count[DIGITS_MAX] = {0};
    const uint32_t first = begin << DIGIT_BITS;
    for (int32_t i = 0; i < *depth_count; i++) {
        count[(depth_mm_q8[i] >> shift) - first]++;
    }
    uint32_t digit = 0;
    while (digit < DIGITS_MAX - 1 && *rank >= count[digit]) {
        *rank -= count[digit++];
    }
    int32_t kept = 0;
    for (int32_t i = 0; i < *depth_count; i++) {
        const uint32_t depth = depth_mm_q8[i];
        depth_mm_q8[kept] = depth;
        kept += depth >> shift == first + digit;
    }
    *depth_count = kept;
    return first + digit;
}

int32_t ih_near_depth_mm_q8(const struct ih_points *points)
{
    uint32_t seen_mm_q8[IH_SLOTS];
    int32_t count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        seen_mm_q8[count] = (uint32_t)points->point[slot].depth_mm_q8;
        count += points->point[slot].state == IH_POINT_SEEN;
    }
    uint32_t depth_mm_q8 = 0;
    int32_t rank = count * PERCENTILE / 100;
    for (int shift = 2 * DIGIT_BITS; count > 0 && shift >= 0; shift -= DIGIT_BITS) {
        depth_mm_q8 = next_digit(seen_mm_q8, &count, depth_mm_q8, shift, &rank);
    }
    return (int32_t)depth_mm_q8;
}
