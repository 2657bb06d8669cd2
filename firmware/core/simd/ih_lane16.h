/* ih_lane16 - arithmetic of one 16-bit number with sign, as vectors have it, for loops without a branch
 * that compilers turn into them: with AVX2 16 at once, with SSE2 and NEON 8.
 *
 * Everything wraps; a mask is all bits or none.
 */
#ifndef IH_LANE16_H
#define IH_LANE16_H

#include <stdint.h>

#include "base/ih_range.h"

/* How many a vector has; 1 where there are none. */
#if defined __AVX2__
#define IH_LANE_COUNT 16
#elif defined __SSE2__ || defined __ARM_NEON
#define IH_LANE_COUNT 8
#else
#define IH_LANE_COUNT 1
#endif

typedef int16_t ih_lane;

static inline ih_lane ih_lane_wrap(int32_t value)
{
    return IH_WRAPS(ih_lane, value);
}

static inline ih_lane ih_lane_high_half(ih_lane a, ih_lane b)
{
    return ih_lane_wrap((int32_t)a * b >> 16);
}

static inline ih_lane ih_lane_min(ih_lane a, ih_lane b)
{
    if (a < b) {
        return a;
    }
    return b;
}

static inline ih_lane ih_lane_max(ih_lane a, ih_lane b)
{
    if (a > b) {
        return a;
    }
    return b;
}

static inline ih_lane ih_lane_within(ih_lane value, ih_lane limit)
{
    return ih_lane_max(ih_lane_min(value, limit), ih_lane_wrap(-limit));
}

static inline ih_lane ih_lane_is_above(ih_lane a, ih_lane b)
{
    return a > b ? -1 : 0;
}

static inline ih_lane ih_lane_size(ih_lane value)
{
    const ih_lane sign = ih_lane_is_above(0, value);
    return ih_lane_wrap(ih_lane_wrap(value ^ sign) - sign);
}

static inline ih_lane ih_lane_pick(ih_lane mask, ih_lane yes, ih_lane no)
{
    return ih_lane_wrap((yes & mask) | (no & ~mask));
}

#endif
