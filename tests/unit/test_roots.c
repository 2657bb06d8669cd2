/* ih_basis's table against its definition: an entry's last place shows in no root. */
#include "ih_basis.c"

#include "ih_test.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* 2^30 / sqrt(m), m in spans of 2^23. */
static double root_inverse(double spans)
{
    return ldexp(1, 30) / sqrt(ldexp(spans, 23));
}

static double fall_over(int span)
{
    return root_inverse(span) - root_inverse(span + 1);
}

/* How far the chord over a span lies above the curve at the most: where the curve is as steep as it. */
static double chord_above(int span)
{
    const double fall = fall_over(span);
    const double at = pow(root_inverse(1) / (2 * fall), 2.0 / 3);

    return root_inverse(span) - (at - span) * fall - root_inverse(at);
}

static void inverse_roots_lie_between_chord_and_curve(void)
{
    int span;

    TEST_ASSERT_EQUAL_INT(256 - SPANS_BELOW, IH_TEST_COUNT(inverse_root));
    for (span = SPANS_BELOW; span < 256; span++) {
        const uint32_t entry = inverse_root[span - SPANS_BELOW];

        IH_TEST_EQUAL(floor(8 * (root_inverse(span) - chord_above(span) / 2) + 0.5) + 4,
                      entry >> 12, "beginning", span);
        IH_TEST_EQUAL(floor(8 * fall_over(span) + 0.5), entry & 4095, "fall", span);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(inverse_roots_lie_between_chord_and_curve);
    return UNITY_END();
}
