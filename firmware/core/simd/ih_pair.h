/* ih_pair - two integers of 16 bits in a word, for processors without vectors.
 *
 * The first one is the lower half. Sums and differences wrap. A Cortex-M with DSP instructions does each in one of them.
 */
#ifndef IH_PAIR_H
#define IH_PAIR_H

#include <stdint.h>

#include "base/ih_range.h"

#ifdef __ARM_FEATURE_SIMD32
#include <arm_acle.h>
#endif

static inline int32_t ih_pair_first(uint32_t pair)
{
    return IH_WRAPS(int16_t, pair);
}

static inline int32_t ih_pair_second(uint32_t pair)
{
    return IH_WRAPS(int16_t, pair >> 16);
}

static inline uint32_t ih_pair_make(int32_t first, int32_t second)
{
    return (IH_WRAPS(uint32_t, first) & 0xffff) | (IH_WRAPS(uint32_t, second) & 0xffff) << 16;
}

#ifdef __ARM_FEATURE_SIMD32
static inline uint32_t ih_pair_add(uint32_t a, uint32_t b)
{
    return (uint32_t)__sadd16((int16x2_t)a, (int16x2_t)b);
}

static inline uint32_t ih_pair_sub(uint32_t a, uint32_t b)
{
    return (uint32_t)__ssub16((int16x2_t)a, (int16x2_t)b);
}

/* first * first + second * second, which must fit 32 bits. */
static inline int32_t ih_pair_dot(uint32_t a, uint32_t b)
{
    return __smuad((int16x2_t)a, (int16x2_t)b);
}

/* a's first * b's second - a's second * b's first, which must fit 32 bits. */
static inline int32_t ih_pair_cross(uint32_t a, uint32_t b)
{
    return __smusdx((int16x2_t)a, (int16x2_t)b);
}
#else
static inline uint32_t ih_pair_add(uint32_t a, uint32_t b)
{
    return ih_pair_make(ih_pair_first(a) + ih_pair_first(b), ih_pair_second(a) + ih_pair_second(b));
}

static inline uint32_t ih_pair_sub(uint32_t a, uint32_t b)
{
    return ih_pair_make(ih_pair_first(a) - ih_pair_first(b), ih_pair_second(a) - ih_pair_second(b));
}

static inline int32_t ih_pair_dot(uint32_t a, uint32_t b)
{
    return ih_pair_first(a) * ih_pair_first(b) + ih_pair_second(a) * ih_pair_second(b);
}

static inline int32_t ih_pair_cross(uint32_t a, uint32_t b)
{
    return ih_pair_first(a) * ih_pair_second(b) - ih_pair_second(a) * ih_pair_first(b);
}
#endif

#endif
