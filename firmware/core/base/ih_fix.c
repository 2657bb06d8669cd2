#include "base/ih_fix.h"

#include <stdbool.h>

_Static_assert((-3 >> 1) == -2, "right shift of negative values must be arithmetic");

/* 1 / sqrt(m) in Q15 at m = 64/256, 65/256 .. 256/256, lowered by the distance of a chord between two
 * entries from the curve: an interpolated value is never too large, and at most 2^-13.7 too small.
 * Written by tools/oracle/root_tables.py. */
const uint16_t ih_root_inverse_q15[193] = {
    65534, 65028, 64533, 64050, 63577, 63115, 62663, 62220, 61786, 61362, 60946, 60538, 60138,
    59747, 59362, 58986, 58616, 58253, 57897, 57547, 57203, 56866, 56534, 56208, 55888, 55573,
    55264, 54959, 54660, 54365, 54075, 53790, 53509, 53232, 52960, 52692, 52428, 52168, 51911,
    51659, 51410, 51164, 50922, 50684, 50449, 50217, 49988, 49762, 49540, 49320, 49103, 48889,
    48678, 48470, 48264, 48061, 47860, 47662, 47466, 47273, 47082, 46893, 46707, 46522, 46340,
    46160, 45982, 45807, 45633, 45461, 45291, 45123, 44957, 44792, 44630, 44469, 44310, 44152,
    43997, 43842, 43690, 43539, 43390, 43242, 43096, 42951, 42807, 42665, 42525, 42386, 42248,
    42111, 41976, 41842, 41709, 41578, 41448, 41319, 41191, 41065, 40939, 40815, 40692, 40570,
    40449, 40329, 40210, 40093, 39976, 39860, 39746, 39632, 39519, 39407, 39296, 39187, 39078,
    38969, 38862, 38756, 38650, 38546, 38442, 38339, 38237, 38136, 38035, 37936, 37837, 37738,
    37641, 37544, 37449, 37353, 37259, 37165, 37072, 36980, 36888, 36797, 36707, 36617, 36528,
    36440, 36352, 36265, 36179, 36093, 36008, 35923, 35839, 35756, 35673, 35590, 35509, 35428,
    35347, 35267, 35187, 35108, 35030, 34952, 34875, 34798, 34721, 34645, 34570, 34495, 34421,
    34347, 34273, 34200, 34128, 34056, 33984, 33913, 33842, 33772, 33702, 33633, 33564, 33495,
    33427, 33359, 33292, 33225, 33158, 33092, 33026, 32961, 32896, 32832, 32767,
};

uint32_t ih_isqrt_u64(uint64_t value)
{
    if (value == 0) {
        return 0;
    }
    /* No division, which is slow on small processors. The value is shifted up to 2^62 .. 2^64 by
     * 4^half; its root there is in 2^31 .. 2^32. With r slightly below 1 / root, and d the difference
     * of the value and root^2, root + d r / 2 is a better root, and again not too large. The error of
     * the first is 2^-13.7 of it, that of the second 1.5 times the square of that, 36; that of the
     * third 1, and its own rounding below 1. */
    const int half = (64 - ih_bits_u64(value)) / 2;
    const uint64_t square = value << (2 * half);
    const uint64_t r_q15 = ih_inverse_root_q15((uint32_t)(square >> 32));
    uint64_t root = ((square >> 32) * r_q15) >> 15;
    root += ((square - root * root) >> 16) * r_q15 >> 32;
    root += (square - root * root) * r_q15 >> 48;
    for (uint64_t left = square - root * root; left > 2 * root; left -= 2 * root - 1) {
        root++;
    }
    return (uint32_t)(root >> half);
}

uint32_t ih_isqrt_u54(uint64_t value)
{
    if (value == 0) {
        return 0;
    }
    /* As above, but with one correction: at 2^31 .. 2^32 the root is too small by 36 and the truncation,
     * and of a value this small by 36 / 2^5 and 1. */
    const int half = (64 - ih_bits_u64(value)) / 2;
    const uint64_t shifted = value << (2 * half);
    const uint64_t r_q15 = ih_inverse_root_q15((uint32_t)(shifted >> 32));
    uint64_t wide = ((shifted >> 32) * r_q15) >> 15;
    wide += ((shifted - wide * wide) >> 16) * r_q15 >> 32;
    uint64_t root = wide >> half;
    while ((root + 1) * (root + 1) <= value) {
        root++;
    }
    return (uint32_t)root;
}

uint32_t ih_isqrt_u32(uint32_t value)
{
    if (value == 0) {
        return 0;
    }
    /* As above, without a correction: at 2^15 .. 2^16 the root is too small by 2^-13.7 and 2^-14 of it, 9,
     * and the truncation; half shifts reduce that. */
    const int half = __builtin_clz(value) / 2;
    const uint32_t shifted = value << (2 * half);
    uint32_t root = ((shifted >> 16) * ih_inverse_root_q15(shifted)) >> (15 + half);
    for (uint32_t left = value - root * root; left > 2 * root; left -= 2 * root - 1) {
        root++;
    }
    return root;
}

/* atan(2^-i) in millionths of a degree. */
const int32_t ih_atan_udeg[IH_ATAN_STEPS] = {
    45000000, 26565051, 14036243, 7125016, 3576334, 1789911, 895174, 447614, 223811,
    111906,   55953,    27976,    13988,   6994,    3497,    1749,   874};

int32_t ih_atan2_mdeg(int64_t y, int64_t x)
{
    if (x == 0 && y == 0) {
        return 0;
    }
    /* CORDIC in vectoring mode: rotate the vector onto the +x axis in ever smaller steps. It needs
     * x > 0; a vector in the left half is rotated by half a circle first. */
    int64_t rotated_udeg = 0;
    if (x < 0) {
        rotated_udeg = y >= 0 ? 180000000 : -180000000;
        x = -x;
        y = -y;
    }
    /* Scale to 2^41: 20 bits below the smallest step, and room for CORDIC's growth of 1.65. */
    int shift = 41 - ih_bits_u64((uint64_t)x | (uint64_t)ih_abs_s64(y));
    x = shift >= 0 ? x * ((int64_t)1 << shift) : x >> -shift;
    y = shift >= 0 ? y * ((int64_t)1 << shift) : y >> -shift;
    int64_t angle_udeg = 0;
    for (int i = 0; i < IH_ATAN_STEPS; i++) {
        int64_t x_part = x >> i;
        int64_t y_part = y >> i;
        bool up = y > 0;
        x += up ? y_part : -y_part;
        y += up ? -x_part : x_part;
        angle_udeg += up ? ih_atan_udeg[i] : -ih_atan_udeg[i];
    }
    int32_t angle_mdeg = (int32_t)ih_div_round(rotated_udeg + angle_udeg, 1000);
    IH_IN_RANGE(angle_mdeg, -180001, 180001);
    return angle_mdeg <= -180000 ? angle_mdeg + 360000 : angle_mdeg;
}

int32_t ih_power_q16(int64_t x_q16)
{
    const int64_t fraction = x_q16 & 0xffff;
    const int64_t whole = x_q16 >> 16;
    int64_t sum = -ih_mul_shift(fraction, 2560, 16) + 15145; /* of exp(-x ln 2): x^3, x^2 */
    sum = ih_mul_shift(sum, fraction, 16) - 45353;
    return whole > 30 ? 0 : (int32_t)(65536 + ih_mul_shift(sum, fraction, 16)) >> whole;
}
