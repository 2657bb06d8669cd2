/* ih_kalman against the textbook's equations in float64, one step at a time; whole sequences are in
 * test_tracks. */
#include "detect/ih_ellipsoid.h"
#include "tracks/ih_kalman.h"

#include "ih_test.h"

static struct ih_kalman filter;

static struct ih_ellipsoid head_at(int32_t x_mm_q8)
{
    const int32_t centre_mm_q8[3] = {x_mm_q8, -2560, 900 << 8};

    return ih_ellipsoid_mean(centre_mm_q8);
}

void setUp(void)
{
    const struct ih_ellipsoid head = head_at(0);

    memset(&filter, IH_TEST_FILL, sizeof filter);
    ih_kalman_start(&head, 12, &filter);
}

void tearDown(void)
{
}

static void starts_at_rest_as_it_was_measured(void)
{
    const struct ih_ellipsoid head = head_at(0);

    TEST_ASSERT_EQUAL_MEMORY(&head, &filter.head, sizeof head);
    TEST_ASSERT_EQUAL_INT32(0, filter.velocity_mm_s_q8[0]);
    TEST_ASSERT_EQUAL_INT32(12 << 8, ih_kalman_sigma_mm_q8(&filter));
    TEST_ASSERT_TRUE(filter.cross_q8 == 0);
}

/* P = F P F' + Q of a white acceleration, with steps from 1 ms to 0.2 s. */
static void predicts_as_in_float64(void)
{
    static const int32_t step_us[] = {1000, 40000, 33333, 200000, 90000};
    double x = 0, v = 250, p = 144, c = 0, s = 90000;
    int i;

    filter.velocity_mm_s_q8[0] = 250 << 8;
    for (i = 0; i < IH_TEST_COUNT(step_us); i++) {
        const double dt = step_us[i] / 1e6, q = 2500.0 * 2500.0;

        x += v * dt;
        p += 2 * c * dt + s * dt * dt + q * dt * dt * dt * dt / 4;
        c += s * dt + q * dt * dt * dt / 2;
        s += q * dt * dt;
        ih_kalman_predict(&filter, step_us[i], 2500);
        IH_TEST_WITHIN(0.02, x, ih_test_from_q(filter.head.centre_mm_q8[0], 8), "position", i);
        IH_TEST_WITHIN(0.05 + 3e-4 * p, p, ih_test_from_q(filter.position_q8, 8), "variance", i);
        IH_TEST_WITHIN(1 + 3e-4 * c, c, ih_test_from_q(filter.cross_q8, 8), "cross term", i);
        IH_TEST_WITHIN(1 + 3e-4 * s, s, ih_test_from_q(filter.velocity_q8, 8), "velocity", i);
    }
}

/* K = P / (P + R), and what it does to state and covariance. Gains are rounded to 2^-17. */
static void corrects_as_in_float64(void)
{
    const double measured = 30, r = 144;
    struct ih_ellipsoid head = head_at(30 << 8);
    double p, c, s, gain, velocity_gain;

    ih_kalman_predict(&filter, 100000, 2500);
    p = ih_test_from_q(filter.position_q8, 8);
    c = ih_test_from_q(filter.cross_q8, 8);
    s = ih_test_from_q(filter.velocity_q8, 8);
    gain = p / (p + r);
    velocity_gain = c / (p + r);
    head.semi_mm_q8[1] += 4 << 8;
    ih_kalman_correct(&filter, &head, (int64_t)r * 256);
    IH_TEST_WITHIN(0.01, gain * measured, ih_test_from_q(filter.head.centre_mm_q8[0], 8),
                   "position", 0);
    IH_TEST_WITHIN(0.01, velocity_gain * measured, ih_test_from_q(filter.velocity_mm_s_q8[0], 8),
                   "velocity", 0);
    IH_TEST_WITHIN(0.01 + p / 131072, p * (1 - gain), ih_test_from_q(filter.position_q8, 8),
                   "variance", 0);
    IH_TEST_WITHIN(0.01 + c / 131072, c * (1 - gain), ih_test_from_q(filter.cross_q8, 8),
                   "cross term", 0);
    IH_TEST_WITHIN(0.01 + c / 131072, s - velocity_gain * c, ih_test_from_q(filter.velocity_q8, 8),
                   "variance of the velocity", 0);
    /* A quarter of the difference. */
    TEST_ASSERT_EQUAL_INT32(head.semi_mm_q8[1] - (3 << 8), filter.head.semi_mm_q8[1]);
}

static void slows_down_within_100_ms(void)
{
    filter.velocity_mm_s_q8[2] = 600 << 8;
    ih_kalman_slow_down(&filter, 0);
    TEST_ASSERT_EQUAL_INT32(600 << 8, filter.velocity_mm_s_q8[2]);
    ih_kalman_slow_down(&filter, 25000);
    IH_TEST_WITHIN(0.01, 450, ih_test_from_q(filter.velocity_mm_s_q8[2], 8), "after a quarter", 0);
    ih_kalman_slow_down(&filter, 900000);
    TEST_ASSERT_EQUAL_INT32(0, filter.velocity_mm_s_q8[2]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(starts_at_rest_as_it_was_measured);
    RUN_TEST(predicts_as_in_float64);
    RUN_TEST(corrects_as_in_float64);
    RUN_TEST(slows_down_within_100_ms);
    return UNITY_END();
}
