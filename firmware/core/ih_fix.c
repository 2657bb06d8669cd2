#include "ih_fix.h"

#include <stdbool.h>

_Static_assert((-3 >> 1) == -2, "right shift of negative values must be arithmetic");

int64_t ih_mul_wide_shift(int64_t a, uint32_t b, int shift)
{
    /* a = high * 2^32 + low with 0 <= low < 2^32, so a * b = high * b * 2^32 + low * b. */
    int64_t high = a >> 32;
    uint64_t low = (uint64_t)a & UINT32_MAX;
    uint64_t low_product = low * b;
    /* |high| <= 2^31 and b < 2^32 keep this below 2^63; the carry adds less than 2^32. */
    int64_t upper = high * (int64_t)b + (int64_t)(low_product >> 32);
    uint64_t lower = low_product & UINT32_MAX;

    /* The product is upper * 2^32 + lower; divide by 2^shift with shift >= 32. */
    int rest = shift - 32;
    if (rest == 0) {
        return upper + (int64_t)(lower >> 31);
    }
    return ih_shift_round(upper, rest); /* lower is below half a unit of the last place or a tie's
                                         * upper side: rounding half upwards ignores it */
}

int64_t ih_div_round(int64_t numerator, int64_t denominator)
{
    int64_t half = denominator / 2;
    return (numerator >= 0 ? numerator + half : numerator - half) / denominator;
}

int ih_bits_u64(uint64_t value)
{
    return value == 0 ? 0 : 64 - __builtin_clzll(value);
}

uint32_t ih_isqrt_u64(uint64_t value)
{
    if (value < 2) {
        return (uint32_t)value;
    }
    /* Newton from above: from any start that is at least floor(root) each step comes nearer, and
     * the first whose square is not above the value is floor(root). The start is a tangent of the
     * root: with x = value / 4^half in 1/4 .. 1 it is x + 1/4 below a half, (x + 1) / 2 above, 6 %
     * too large at most. */
    int bits = ih_bits_u64(value);
    int half = (bits + 1) / 2;
    uint64_t root = bits % 2 != 0 ? (value >> half) + ((uint64_t)1 << (half - 2))
                                  : ((value >> half) + ((uint64_t)1 << half)) / 2;
    while (root * root > value) {
        root = (root + value / root) / 2;
    }
    return (uint32_t)root;
}

/* atan(2^-i) in millionths of a degree. */
static const int32_t atan_udeg[] = {45000000, 26565051, 14036243, 7125016, 3576334, 1789911,
                                    895174,   447614,   223811,   111906,  55953,   27976,
                                    13988,    6994,     3497,     1749,    874};
#define ATAN_STEPS ((int)(sizeof atan_udeg / sizeof atan_udeg[0]))

int32_t ih_atan2_mdeg(int64_t y, int64_t x)
{
    if (x == 0 && y == 0) {
        return 0;
    }
    /* CORDIC in vectoring mode: turn the vector onto the +x axis in ever smaller steps. It needs
     * x > 0; a vector in the left half is turned by half a circle first. */
    int64_t turn_udeg = 0;
    if (x < 0) {
        turn_udeg = y >= 0 ? 180000000 : -180000000;
        x = -x;
        y = -y;
    }
    /* Scale to 2^41: 20 bits below the smallest step, and room for CORDIC's growth of 1.65. */
    int shift = 41 - ih_bits_u64((uint64_t)x | (uint64_t)ih_abs_s64(y));
    x = shift >= 0 ? x * ((int64_t)1 << shift) : x >> -shift;
    y = shift >= 0 ? y * ((int64_t)1 << shift) : y >> -shift;
    int64_t angle_udeg = 0;
    for (int i = 0; i < ATAN_STEPS; i++) {
        int64_t x_part = x >> i;
        int64_t y_part = y >> i;
        bool up = y > 0;
        x += up ? y_part : -y_part;
        y += up ? -x_part : x_part;
        angle_udeg += up ? atan_udeg[i] : -atan_udeg[i];
    }
    int32_t angle_mdeg = (int32_t)ih_div_round(turn_udeg + angle_udeg, 1000);
    return angle_mdeg <= -180000 ? angle_mdeg + 360000 : angle_mdeg;
}
