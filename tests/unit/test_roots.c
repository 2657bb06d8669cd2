/* ih_basis's table against its definition: chords of a root's curve, raised by half of what they lie below it. */
#include "ih_basis.c"

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

/* How far the curve lies above the chord over a span at the most: where it is as steep. */
static double curve_above(int span)
{
    const double rise = root(span + 1) - root(span);
    const double at = pow(root(1) / (2 * rise), 2);

    return root(at) - root(span) - (at - span) * rise;
}

/* Places and products are cut off, by 64 of 2^22 and by one: half a step of each, and one of rounding. */
static void entries_are_chords_raised_by_half(void)
{
    int at;

    TEST_ASSERT_EQUAL_INT(LAST_SPAN - SPANS_BELOW, IH_TEST_COUNT(spans));
    for (at = SPANS_BELOW; at < LAST_SPAN; at++) {
        const struct span *entry = &spans[at - SPANS_BELOW];
        const double rise = root(at + 1) - root(at);
        const double lost = at + 1 == LAST_SPAN ? 64 : 0; /* so that no root passes 2^32 */

        IH_TEST_WITHIN(0.5, rise / 64, entry->rise, "rise", at);
        IH_TEST_WITHIN(rise / 65536 + 32 + 1 + lost, root(at) + curve_above(at) / 2, entry->value,
                       "value", at);
    }
}

static void no_root_passes_32_bits(void)
{
    int at;

    for (at = 0; at < IH_TEST_COUNT(spans); at++) {
        const uint64_t most = (uint64_t)spans[at].rise * 65535;

        TEST_ASSERT_TRUE(most <= UINT32_MAX);
        TEST_ASSERT_TRUE(spans[at].value + (most >> RISE_SHIFT) <= UINT32_MAX);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(entries_are_chords_raised_by_half);
    RUN_TEST(no_root_passes_32_bits);
    return UNITY_END();
}
