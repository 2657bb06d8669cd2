/* ih_fix - fixed-point arithmetic: numbers change their format here only.
 *
 * A name ending in _qN carries N fraction bits; the C type gives the width. Right shifts round to
 * nearest, halves upwards (towards plus infinity), on every target alike: C leaves the right shift of
 * negative values open, and a static assertion in ih_fix.c demands an arithmetic one.
 */
#ifndef IH_FIX_H
#define IH_FIX_H

#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_range.h"

/* value / 2^shift, rounded. shift 0..62; |value| <= 2^63 - 1 - 2^(shift-1). */
static inline int64_t ih_shift_round(int64_t value, int shift)
{
    IH_IN_RANGE(shift, 0, 62);
    if (shift == 0) {
        return value;
    }
    return (value + ((int64_t)1 << (shift - 1))) >> shift;
}

/* a * b / 2^shift, rounded; the product must stay below 2^62. */
static inline int64_t ih_mul_shift(int64_t a, int64_t b, int shift)
{
    return ih_shift_round(a * b, shift);
}

/* a * b / 2^shift, rounded, where the product may need 95 bits but the result fits 63.
 * b is not negative; shift 32..62. Done in two 64-bit halves, exact to the last bit. */
static inline int64_t ih_mul_wide_shift(int64_t a, uint32_t b, int shift)
{
    IH_IN_RANGE(shift, 32, 62);
    /* a = high * 2^32 + low with 0 <= low < 2^32, so a * b = high * b * 2^32 + low * b. */
    int64_t high = a >> 32;
    uint64_t low = IH_WRAPS(uint64_t, a) & UINT32_MAX; /* the low half of two's complement */
    uint64_t low_product = low * b;
    /* |high| <= 2^31 and b < 2^32 keep this below 2^63; the carry adds less than 2^32. */
    int64_t upper = high * (int64_t)b + (int64_t)(low_product >> 32);
    uint64_t lower = low_product & UINT32_MAX;

    /* The product is upper * 2^32 + lower; divide by 2^shift with shift >= 32. */
    int left = shift - 32;
    if (left == 0) {
        return upper + (int64_t)(lower >> 31);
    }
    return ih_shift_round(upper, left); /* lower is below half a unit of the last place or a tie's
                                         * upper side: rounding half upwards ignores it */
}

/* numerator / denominator rounded to nearest, halves away from zero; denominator > 0,
 * |numerator| + denominator / 2 < 2^63. */
static inline int64_t ih_div_round(int64_t numerator, int64_t denominator)
{
    IH_IN_RANGE(denominator, 1, INT64_MAX);
    const int64_t half = denominator >> 1; /* not negative: no division of a number with a sign */
    /* Some denominators are sums over a loop that runs at least once, which the analyzer cannot know;
     * the build of `make ranges` checks each. NOLINTNEXTLINE(clang-analyzer-core.DivideZero) */
    return (numerator >= 0 ? numerator + half : numerator - half) / denominator;
}

/* value limited to the range of int32_t. */
static inline int32_t ih_saturate_s32(int64_t value)
{
    const int32_t low = IH_WRAPS(int32_t, value);
    if (low == value) {
        return low;
    }
    return value < 0 ? INT32_MIN : INT32_MAX;
}

static inline int32_t ih_min_s32(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

static inline int64_t ih_min_s64(int64_t a, int64_t b)
{
    return a < b ? a : b;
}

static inline int64_t ih_max_s64(int64_t a, int64_t b)
{
    return a > b ? a : b;
}

static inline int32_t ih_max_s32(int32_t a, int32_t b)
{
    return a > b ? a : b;
}

static inline int32_t ih_clamp_s32(int32_t value, int32_t low, int32_t high)
{
    return ih_min_s32(ih_max_s32(value, low), high);
}

static inline int16_t ih_saturate_s16(int32_t value)
{
    return (int16_t)ih_clamp_s32(value, INT16_MIN, INT16_MAX);
}

/* value limited to -max .. max. */
static inline int64_t ih_clamp_s64(int64_t value, int64_t max)
{
    return value < -max ? -max : value > max ? max : value;
}

static inline int64_t ih_abs_s64(int64_t value)
{
    return value < 0 ? -value : value;
}

static inline int32_t ih_abs_s32(int32_t value)
{
    return value < 0 ? -value : value;
}

/* Square of the distance of two points whose coordinates differ by less than 2^30.7. */
static inline int64_t ih_distance2_s32(const int32_t a[3], const int32_t b[3])
{
    int64_t sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        int64_t d = (int64_t)a[axis] - b[axis];
        sum += d * d;
    }
    return sum;
}

IH_BEGIN_DECLS

/* floor(sqrt(value)), exact for all 2^64 inputs. */
uint32_t ih_isqrt_u64(uint64_t value);

/* The same for values below 2^54, in half the time. */
uint32_t ih_isqrt_u54(uint64_t value);

/* The same for 32 bits; the fastest below 2^24. */
uint32_t ih_isqrt_u32(uint32_t value);

/* 1 / sqrt of 64/256, 65/256 .. 256/256. */
extern const uint16_t ih_root_inverse_q15[193];

/* 1 / sqrt(m), m in Q32 from 1/4 on: never too large, and at most 2^-13.7 of it too small. */
static inline uint32_t ih_inverse_root_q15(uint32_t m_q32)
{
    const uint32_t at = (m_q32 >> 24) - 64;
    const uint32_t fraction_q16 = m_q32 >> 8 & 0xffff;
    const uint32_t entry = ih_root_inverse_q15[at];
    /* The difference is rounded up, so that the result is never too large. */
    return entry - (((entry - ih_root_inverse_q15[at + 1]) * fraction_q16 + 0xffff) >> 16);
}

/* 2^-x, x >= 0 in Q16: within 2^-13. */
int32_t ih_power_q16(int64_t x_q16);

/* Number of bits needed for value; 0 for 0. */
static inline int ih_bits_u64(uint64_t value)
{
    return value == 0 ? 0 : 64 - __builtin_clzll(value);
}

#define IH_ATAN_STEPS 17
extern const int32_t ih_atan_udeg[IH_ATAN_STEPS];

/* Angle of (x, y) from +x towards +y in thousandths of a degree, (-180000, 180000]; 0 for (0, 0).
 * |x|, |y| <= 2^40. Within 2 mdeg of atan2. */
int32_t ih_atan2_mdeg(int64_t y, int64_t x);

IH_END_DECLS

#endif
