/* ih_multiquadric's table against its definition: chords of a root's curve, raised by half of what they lie below it. */
#include "surface/ih_multiquadric_table.h"

#include "ih_test.h"

#define LAST_SPAN 1024

void setUp(void)
{
}

void tearDown(void)
{
}

/* sqrt(m) * 2^16, m in spans of 2^22. */
static double root(double at)
{
    return ldexp(sqrt(at), 11 + 16);
}

/* Maximum height of the curve above the chord over a span: where both are as steep. */
static double curve_above(int span)
{
    const double rise = root(span + 1) - root(span);
    const double at = pow(root(1) / (2 * rise), 2);

    return root(at) - root(span) - (at - span) * rise;
}

/* Places, rises and products are cut off, by up to 64 at the first span's beginning and 128 at its end: an entry is
 * raised by half of the mean, rounded. */
static void entries_are_chords_raised_by_half(void)
{
    int at;

    TEST_ASSERT_EQUAL_INT(LAST_SPAN - IH_MULTIQUADRIC_SPANS_BELOW + 1,
                          IH_TEST_COUNT(ih_multiquadric_roots_q16));
    for (at = IH_MULTIQUADRIC_SPANS_BELOW; at < LAST_SPAN; at++) {
        IH_TEST_WITHIN(0.55, root(at) + curve_above(at) / 2 + 48,
                       ih_multiquadric_roots_q16[at - IH_MULTIQUADRIC_SPANS_BELOW], "value", at);
    }
    TEST_ASSERT_EQUAL_HEX32(
        UINT32_MAX,
        ih_multiquadric_roots_q16[LAST_SPAN -
                                  IH_MULTIQUADRIC_SPANS_BELOW]); /* no root passes 2^32 */
}

static void no_product_passes_32_bits(void)
{
    int at;

    for (at = 0; at + 1 < IH_TEST_COUNT(ih_multiquadric_roots_q16); at++) {
        const uint64_t rise = (ih_multiquadric_roots_q16[at + 1] - ih_multiquadric_roots_q16[at]) >>
                              IH_MULTIQUADRIC_RISE_SHIFT;

        TEST_ASSERT_TRUE(ih_multiquadric_roots_q16[at + 1] > ih_multiquadric_roots_q16[at]);
        TEST_ASSERT_TRUE(rise * 65535 <= UINT32_MAX);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(entries_are_chords_raised_by_half);
    RUN_TEST(no_product_passes_32_bits);
    return UNITY_END();
}
