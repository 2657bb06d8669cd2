/* ih_fix's tables against their definitions: most of their last digits show in no result. */
#include "base/ih_fix.h"

#include "ih_test.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static double root_inverse(int of_256)
{
    return 32768 / sqrt(of_256 / 256.0);
}

/* How far the chord between two entries lies above the curve at most: where the curve is as steep
 * as the chord. */
static double chord_above(int of_256)
{
    const double first = of_256 / 256.0, fall = root_inverse(of_256) - root_inverse(of_256 + 1);
    const double at = pow(2 * 256 * fall / 32768, -2.0 / 3);

    return root_inverse(of_256) - (at - first) * 256 * fall - 32768 / sqrt(at);
}

/* The roots do not show it when an entry is off by one, the time that they take does. An entry is
 * the largest with which no chord at it is above the curve. */
static void inverse_roots_are_as_close_as_may_be(void)
{
    int i;

    TEST_ASSERT_EQUAL_INT(193, IH_TEST_COUNT(ih_root_inverse_q15));
    for (i = 64; i <= 256; i++) {
        const double before = i > 64 ? chord_above(i - 1) : 0;
        const double behind = i < 256 ? chord_above(i) : 0;

        IH_TEST_EQUAL(floor(root_inverse(i) - fmax(before, behind)), ih_root_inverse_q15[i - 64],
                      "entry", i);
    }
}

/* What the steps of the root take from there: never too large, and at most 2^-13.7 too small. */
static void inverse_roots_are_never_too_large(void)
{
    uint64_t m_q32;
    uint32_t i;

    for (i = 64; i < 256; i++) { /* an entry is read as it stands */
        IH_TEST_EQUAL(ih_root_inverse_q15[i - 64], ih_inverse_root_q15(i << 24), "entry", i);
    }
    for (m_q32 = UINT64_C(1) << 30; m_q32 <= UINT32_MAX; m_q32 += 4093) {
        const double exact = 32768 / sqrt(ldexp((double)m_q32, -32));
        const double off = 1 - ih_inverse_root_q15((uint32_t)m_q32) / exact;

        if (off < 0 || off > exp2(-13.7)) {
            IH_TEST_WITHIN(exp2(-14.7), exp2(-14.7), off, "inverse root too small", (int64_t)m_q32);
        }
    }
}

static void angles_of_the_steps_are_exact(void)
{
    int i;

    TEST_ASSERT_EQUAL_INT(17,
                          IH_TEST_COUNT(ih_atan_udeg)); /* the last is below the promised 2 mdeg */
    for (i = 0; i < IH_TEST_COUNT(ih_atan_udeg); i++) {
        IH_TEST_EQUAL(lround(atan(ldexp(1, -i)) * 180e6 / acos(-1.0)), ih_atan_udeg[i], "step", i);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(inverse_roots_are_as_close_as_may_be);
    RUN_TEST(inverse_roots_are_never_too_large);
    RUN_TEST(angles_of_the_steps_are_exact);
    return UNITY_END();
}
