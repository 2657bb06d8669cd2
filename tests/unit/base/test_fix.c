/* ih_fix against exact 128-bit integers and the C library. */
#include "base/ih_fix.h"

#include <stdbool.h>

#include "ih_test.h"

__extension__ typedef __int128 int128;

#define MANY 1000000

static struct ih_test_random random_source;

void setUp(void)
{
    random_source.state = 2002;
}

void tearDown(void)
{
}

/* floor(value / 2^shift) by the definition, without a right shift of a negative number. */
static int128 floor_shift(int128 value, int shift)
{
    const int128 unit = (int128)1 << shift;
    const int128 quotient = value / unit;

    return value % unit < 0 ? quotient - 1 : quotient;
}

static int128 round_shift(int128 value, int shift)
{
    return shift == 0 ? value : floor_shift(value + ((int128)1 << (shift - 1)), shift);
}

static void check_root(uint64_t value)
{
    const uint64_t root = ih_isqrt_u64(value);

    if ((unsigned __int128)root * root > value ||
        (unsigned __int128)(root + 1) * (root + 1) <= value) {
        IH_TEST_EQUAL(value, root, "floor of the square root is wrong for", (int64_t)value);
    }
}

static void isqrt_is_exact_around_squares(void)
{
    uint64_t k;

    for (k = 0; k < 70000; k++) {
        check_root(k * k);
        check_root(k * k + 1);
        check_root(k == 0 ? 0 : k * k - 1);
    }
    for (k = UINT32_MAX; k > UINT32_MAX - 70000u; k--) {
        check_root(k * k);
        check_root(k * k + 1);
        check_root(k * k - 1);
    }
}

static void isqrt_is_exact_around_powers_of_two(void)
{
    int bit;

    for (bit = 0; bit < 64; bit++) {
        const uint64_t power = UINT64_C(1) << bit;
        const uint64_t root = ih_isqrt_u64(power);

        check_root(power - 1);
        check_root(power);
        check_root(power + 1);
        check_root(root * root - 1);
    }
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, ih_isqrt_u64(UINT64_MAX));
    TEST_ASSERT_EQUAL_UINT32(0, ih_isqrt_u64(0));
}

/* The short way, where a root changes and anywhere below 2^54. */
static void isqrt_of_54_bits_is_the_same(void)
{
    struct ih_test_random random = {7};
    uint64_t i;

    for (i = 0; i < 400000; i++) {
        const uint64_t root = ih_test_u64(&random) >> (37 + i % 27);
        const uint64_t any = ih_test_u64(&random) >> (10 + i % 54);

        TEST_ASSERT_EQUAL_UINT32(root, ih_isqrt_u54(root * root));
        if (root > 0) {
            TEST_ASSERT_EQUAL_UINT32(root - 1, ih_isqrt_u54(root * root - 1));
        }
        TEST_ASSERT_EQUAL_UINT32(ih_isqrt_u64(any), ih_isqrt_u54(any));
    }
    for (i = 0; i < 100000; i++) {
        TEST_ASSERT_EQUAL_UINT32(ih_isqrt_u64(i), ih_isqrt_u54(i));
    }
    TEST_ASSERT_EQUAL_UINT32((1U << 27) - 1, ih_isqrt_u54(((uint64_t)1 << 54) - 1));
}

static void isqrt_of_32_bits_is_the_same(void)
{
    uint32_t i;

    for (i = 1; i < 65536; i++) {
        TEST_ASSERT_EQUAL_UINT32(i, ih_isqrt_u32(i * i));
        TEST_ASSERT_EQUAL_UINT32(i - 1, ih_isqrt_u32(i * i - 1));
    }
    TEST_ASSERT_EQUAL_UINT32(0, ih_isqrt_u32(0));
    TEST_ASSERT_EQUAL_UINT32(65535, ih_isqrt_u32(UINT32_MAX));
}

static void isqrt_is_exact_for_all_sizes(void)
{
    int i;

    for (i = 0; i < 2 * MANY; i++) {
        check_root(ih_test_u64(&random_source) >> (i % 64));
    }
    for (i = 0; i < MANY; i++) {
        const uint64_t k = ih_test_u64(&random_source) >> (32 + i % 32);

        check_root(k * k);
        check_root(k == 0 ? 0 : k * k - 1);
    }
}

static void bits_counts_up_to_the_highest_one(void)
{
    int bit;

    TEST_ASSERT_EQUAL_INT(0, ih_bits_u64(0));
    for (bit = 0; bit < 64; bit++) {
        const uint64_t power = UINT64_C(1) << bit;

        TEST_ASSERT_EQUAL_INT(bit + 1, ih_bits_u64(power));
        TEST_ASSERT_EQUAL_INT(bit, ih_bits_u64(power - 1));
        TEST_ASSERT_EQUAL_INT(bit + 1, ih_bits_u64(power | (power >> 1) | 1u));
    }
    TEST_ASSERT_EQUAL_INT(64, ih_bits_u64(UINT64_MAX));
}

static void shift_round_takes_halves_upwards(void)
{
    int shift;

    TEST_ASSERT_TRUE(ih_shift_round(1, 1) == 1);
    TEST_ASSERT_TRUE(ih_shift_round(-1, 1) == 0);
    TEST_ASSERT_TRUE(ih_shift_round(-3, 1) == -1);
    TEST_ASSERT_TRUE(ih_shift_round(5, 1) == 3);
    TEST_ASSERT_TRUE(ih_shift_round(-7, 0) == -7);
    for (shift = 1; shift <= 62; shift++) {
        const int64_t half = INT64_C(1) << (shift - 1);

        IH_TEST_EQUAL(1, ih_shift_round(half, shift), "+1/2", shift);
        IH_TEST_EQUAL(0, ih_shift_round(half - 1, shift), "less than +1/2", shift);
        IH_TEST_EQUAL(0, ih_shift_round(-half, shift), "-1/2", shift);
        IH_TEST_EQUAL(-1, ih_shift_round(-half - 1, shift), "beyond -1/2", shift);
    }
}

static void shift_round_is_exact_up_to_its_limits(void)
{
    int i;

    for (i = 0; i < MANY; i++) {
        const int shift = i % 63;
        const int64_t value = ih_test_any_size(&random_source, 62);

        IH_TEST_EQUAL(round_shift(value, shift), ih_shift_round(value, shift), "shift", shift);
    }
    for (i = 1; i <= 62; i++) {
        const int64_t max = INT64_MAX - (INT64_C(1) << (i - 1));

        IH_TEST_EQUAL(round_shift(max, i), ih_shift_round(max, i), "greatest", i);
        IH_TEST_EQUAL(round_shift(-max, i), ih_shift_round(-max, i), "least", i);
    }
}

static void mul_shift_is_exact(void)
{
    int i;

    for (i = 0; i < MANY; i++) {
        const int shift = i % 62;
        const int bits = (int)ih_test_between(&random_source, 0, 62);
        const int64_t a = ih_test_any_size(&random_source, bits);
        const int64_t b = ih_test_any_size(&random_source, 62 - bits);

        IH_TEST_EQUAL(round_shift((int128)a * b, shift), ih_mul_shift(a, b, shift), "shift", shift);
    }
}

static void check_wide(int64_t a, uint32_t b, int shift)
{
    const int128 exact = round_shift((int128)a * b, shift);

    if (exact >= INT64_MIN / 2 && exact <= INT64_MAX / 2) {
        IH_TEST_EQUAL(exact, ih_mul_wide_shift(a, b, shift), "wide product, shift", shift);
    }
}

static void mul_wide_shift_is_exact(void)
{
    int i;

    for (i = 0; i < 2 * MANY; i++) {
        const int64_t a = ih_test_any_size(&random_source, 63);
        const uint32_t b = (uint32_t)(ih_test_u64(&random_source) >> (32 + i % 32));

        check_wide(a, b, 32 + i % 31);
    }
}

static void mul_wide_shift_is_exact_at_the_ends_and_at_halves(void)
{
    static const int64_t a[] = {0,
                                1,
                                -1,
                                INT32_MAX,
                                INT32_MIN,
                                INT64_MAX,
                                2,
                                INT64_C(1) << 62,
                                -INT64_MAX,
                                -(INT64_C(1) << 62),
                                INT64_MIN + 1};
    static const uint32_t b[] = {0, 1, 2, 3, UINT32_C(1) << 31, UINT32_MAX - 1, UINT32_MAX};
    int i, j, shift;

    for (shift = 32; shift <= 62; shift++) {
        for (i = 0; i < IH_TEST_COUNT(a); i++) {
            for (j = 0; j < IH_TEST_COUNT(b); j++) {
                check_wide(a[i], b[j], shift);
            }
        }
        for (i = -9; i <= 9; i++) { /* odd multiples of a half, and their neighbours */
            const int64_t half = i * (INT64_C(1) << (shift - 1)) / 2;

            check_wide(half - 1, 2, shift);
            check_wide(half, 2, shift);
            check_wide(half + 1, 2, shift);
        }
    }
}

static int128 divide_round(int128 numerator, int128 denominator)
{
    const int128 size = numerator < 0 ? -numerator : numerator;
    const int128 quotient = (2 * size + denominator) / (2 * denominator);

    return numerator < 0 ? -quotient : quotient;
}

static void div_round_takes_halves_away_from_zero(void)
{
    TEST_ASSERT_TRUE(ih_div_round(1, 2) == 1);
    TEST_ASSERT_TRUE(ih_div_round(-1, 2) == -1);
    TEST_ASSERT_TRUE(ih_div_round(3, 2) == 2);
    TEST_ASSERT_TRUE(ih_div_round(-3, 2) == -2);
    TEST_ASSERT_TRUE(ih_div_round(1, 3) == 0);
    TEST_ASSERT_TRUE(ih_div_round(-2, 3) == -1);
    TEST_ASSERT_TRUE(ih_div_round(0, INT64_MAX) == 0);
}

static void div_round_is_exact_up_to_its_limits(void)
{
    int i;

    for (i = 0; i < MANY; i++) {
        const int64_t numerator = ih_test_any_size(&random_source, 62);
        const int64_t size = ih_test_any_size(&random_source, 61);
        const int64_t denominator = size < 0 ? -size : size + 1;

        IH_TEST_EQUAL(divide_round(numerator, denominator), ih_div_round(numerator, denominator),
                      "quotient", denominator);
    }
    for (i = 1; i < 63; i++) {
        const int64_t denominator = (INT64_C(1) << i) - 1;
        const int64_t numerator = INT64_MAX - denominator / 2 - 1;

        IH_TEST_EQUAL(divide_round(numerator, denominator), ih_div_round(numerator, denominator),
                      "greatest", i);
        IH_TEST_EQUAL(divide_round(-numerator, denominator), ih_div_round(-numerator, denominator),
                      "least", i);
    }
}

static void saturate_and_clamp_keep_what_fits(void)
{
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, ih_saturate_s32(INT64_MAX));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, ih_saturate_s32(INT64_MIN));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, ih_saturate_s32((int64_t)INT32_MAX + 1));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX - 1, ih_saturate_s32((int64_t)INT32_MAX - 1));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, ih_saturate_s32((int64_t)INT32_MIN - 1));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN + 1, ih_saturate_s32((int64_t)INT32_MIN + 1));
    TEST_ASSERT_EQUAL_INT32(-5, ih_clamp_s32(-6, -5, 9));
    TEST_ASSERT_EQUAL_INT32(9, ih_clamp_s32(10, -5, 9));
    TEST_ASSERT_EQUAL_INT32(3, ih_clamp_s32(3, -5, 9));
    TEST_ASSERT_EQUAL_INT32(INT32_MIN, ih_min_s32(INT32_MIN, INT32_MAX));
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, ih_max_s32(INT32_MIN, INT32_MAX));
    TEST_ASSERT_TRUE(ih_abs_s64(-INT64_MAX) == INT64_MAX);
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, ih_abs_s32(-INT32_MAX));
}

/* Angles are equal when they differ by whole turns: -179999.9 and 180000 are 0.1 mdeg apart. */
static void check_angle(int64_t y, int64_t x)
{
    const double exact_mdeg = atan2((double)y, (double)x) * 180000.0 / acos(-1.0);
    const int32_t angle_mdeg = ih_atan2_mdeg(y, x);

    IH_TEST_RANGE(-179999, 180000, angle_mdeg, "angle's range, x", x);
    /* 2 mdeg as the header promises. */
    IH_TEST_WITHIN(2.0, 0.0, remainder(exact_mdeg - angle_mdeg, 360000.0), "angle of x", x);
}

static void atan2_is_exact_on_the_axes_and_diagonals(void)
{
    int shift;

    TEST_ASSERT_EQUAL_INT32(0, ih_atan2_mdeg(0, 0));
    for (shift = 0; shift <= 40; shift++) {
        const int64_t r = INT64_C(1) << shift;

        IH_TEST_EQUAL(0, ih_atan2_mdeg(0, r), "+x", shift);
        IH_TEST_EQUAL(90000, ih_atan2_mdeg(r, 0), "+y", shift);
        IH_TEST_EQUAL(180000, ih_atan2_mdeg(0, -r), "-x", shift);
        IH_TEST_EQUAL(-90000, ih_atan2_mdeg(-r, 0), "-y", shift);
        check_angle(r, r);
        check_angle(r, -r);
        check_angle(-r, r);
        check_angle(-r, -r);
    }
}

static void atan2_follows_libm_round_the_circle(void)
{
    int i, shift;

    for (shift = 1; shift <= 39; shift++) {
        for (i = 0; i < 7200; i++) {
            const double angle = i * acos(-1.0) / 3600.0;

            check_angle(llround(ldexp(sin(angle), shift)), llround(ldexp(cos(angle), shift)));
        }
    }
}

static void atan2_follows_libm_for_any_size(void)
{
    const int64_t r = INT64_C(1) << 40;
    int i;

    for (i = 0; i < MANY; i++) {
        check_angle(ih_test_any_size(&random_source, 40), ih_test_any_size(&random_source, 40));
    }
    check_angle(1, -r);
    check_angle(-1, -r);
    check_angle(-1, r);
    check_angle(r, 1);
    check_angle(-r, -1);
}

/* --- whole ranges: in strides here, all of it with --all (make exhaustive; minutes, gcc -O2) --- */

static bool is_all;

/* The last value before each place where the root changes, and the first behind it: with these exact,
 * and roots that do not fall in between, it is exact for all 2^64 values. */
static void isqrt_changes_exactly_at_squares(void)
{
    const uint64_t stride = is_all ? 1 : 4099;
    uint64_t k;

    for (k = 1; k <= UINT32_MAX; k += stride) {
        if (ih_isqrt_u64(k * k) != k || ih_isqrt_u64(k * k - 1) != k - 1) {
            IH_TEST_EQUAL(k, ih_isqrt_u64(k * k), "root of a square", (int64_t)k);
            IH_TEST_EQUAL(k - 1, ih_isqrt_u64(k * k - 1), "root below a square", (int64_t)k);
        }
    }
}

/* double has 53 bits: its root is exact enough for every value of 32 bits, and every number of bits
 * above it. */
static void isqrt_is_doubles_root_cut_off(void)
{
    const uint64_t stride = is_all ? 1 : 2053;
    uint64_t value;
    int shift;

    for (value = 0; value <= UINT32_MAX; value += stride) {
        if (ih_isqrt_u64(value) != (uint32_t)sqrt((double)value)) {
            IH_TEST_EQUAL(sqrt((double)value), ih_isqrt_u64(value), "root", (int64_t)value);
        }
    }
    for (shift = 1; shift <= 20; shift++) {
        for (value = 0; value <= UINT32_MAX; value += stride * 997) {
            check_root(value << shift);
            IH_TEST_EQUAL(sqrt((double)(value << shift)), ih_isqrt_u64(value << shift), "root",
                          (int64_t)value);
        }
    }
}

/* Quotients of integers as small as these are exact in double where they are halves. */
static void div_round_is_doubles_quotient_rounded(void)
{
    const int64_t max = is_all ? 20000 : 1000;
    int64_t n, d;

    for (d = 1; d <= max; d++) {
        for (n = -max; n <= max; n++) {
            if (ih_div_round(n, d) != llround((double)n / (double)d)) {
                IH_TEST_EQUAL(llround((double)n / (double)d), ih_div_round(n, d), "quotient", d);
            }
        }
    }
}

/* Powers of two and their neighbours. */
#define NEAR_POWERS (63 * 3)

static int64_t near_power(int index)
{
    return (INT64_C(1) << (index / 3)) + index % 3 - 1;
}

static void div_round_is_exact_near_powers_of_two(void)
{
    int i, j;

    for (i = 0; i < NEAR_POWERS; i++) {
        for (j = 2; j < NEAR_POWERS; j++) {
            const int64_t n = near_power(i), d = near_power(j);

            if ((int128)n + d / 2 <= INT64_MAX) {
                IH_TEST_EQUAL(divide_round(n, d), ih_div_round(n, d), "quotient", j);
                IH_TEST_EQUAL(divide_round(-n, d), ih_div_round(-n, d), "negative", j);
            }
        }
    }
}

static void shift_round_is_doubles_floor(void)
{
    const int64_t max = is_all ? 1 << 20 : 1 << 14;
    int64_t value;
    int shift;

    for (shift = 0; shift <= 24; shift++) {
        for (value = -max; value <= max; value++) {
            const double exact = floor(ldexp((double)value, -shift) + 0.5);

            if ((double)ih_shift_round(value, shift) != exact) {
                IH_TEST_EQUAL(exact, ih_shift_round(value, shift), "shifted", value);
            }
        }
    }
}

static void products_are_exact_near_powers_of_two(void)
{
    int i, j, shift;

    for (i = 0; i < NEAR_POWERS; i++) {
        for (j = 0; j < NEAR_POWERS; j++) {
            const int64_t a = near_power(i), b = near_power(j);

            for (shift = 0; shift <= 62; shift += is_all ? 1 : 7) {
                if ((int128)a * b < (int128)1 << 62) {
                    IH_TEST_EQUAL(round_shift((int128)a * b, shift), ih_mul_shift(a, b, shift),
                                  "product", shift);
                    IH_TEST_EQUAL(round_shift((int128)-a * b, shift), ih_mul_shift(-a, b, shift),
                                  "negative product", shift);
                }
                if (shift >= 32 && b <= UINT32_MAX) {
                    check_wide(a, (uint32_t)b, shift);
                    check_wide(-a, (uint32_t)b, shift);
                }
            }
        }
    }
}

/* Every direction that two integers of ten bits have; with --all, of twelve. */
static void atan2_follows_libm_in_every_direction(void)
{
    const int64_t max = is_all ? 4095 : 400;
    int64_t x, y;

    for (y = -max; y <= max; y++) {
        for (x = -max; x <= max; x++) {
            if (x != 0 || y != 0) {
                check_angle(y, x);
            }
        }
    }
}

int main(int count, char **arguments)
{
    is_all = count == 2 && strcmp(arguments[1], "--all") == 0;
    UNITY_BEGIN();
    RUN_TEST(isqrt_is_exact_around_squares);
    RUN_TEST(isqrt_is_exact_around_powers_of_two);
    RUN_TEST(isqrt_of_54_bits_is_the_same);
    RUN_TEST(isqrt_of_32_bits_is_the_same);
    RUN_TEST(isqrt_is_exact_for_all_sizes);
    RUN_TEST(bits_counts_up_to_the_highest_one);
    RUN_TEST(shift_round_takes_halves_upwards);
    RUN_TEST(shift_round_is_exact_up_to_its_limits);
    RUN_TEST(mul_shift_is_exact);
    RUN_TEST(mul_wide_shift_is_exact);
    RUN_TEST(mul_wide_shift_is_exact_at_the_ends_and_at_halves);
    RUN_TEST(div_round_takes_halves_away_from_zero);
    RUN_TEST(div_round_is_exact_up_to_its_limits);
    RUN_TEST(saturate_and_clamp_keep_what_fits);
    RUN_TEST(atan2_is_exact_on_the_axes_and_diagonals);
    RUN_TEST(atan2_follows_libm_round_the_circle);
    RUN_TEST(atan2_follows_libm_for_any_size);
    RUN_TEST(isqrt_changes_exactly_at_squares);
    RUN_TEST(isqrt_is_doubles_root_cut_off);
    RUN_TEST(div_round_is_doubles_quotient_rounded);
    RUN_TEST(div_round_is_exact_near_powers_of_two);
    RUN_TEST(shift_round_is_doubles_floor);
    RUN_TEST(products_are_exact_near_powers_of_two);
    RUN_TEST(atan2_follows_libm_in_every_direction);
    return UNITY_END();
}
