/* hal_limits: what the guard allows, whatever the sums say. */
#include "hal_limits.h"
#include "ih_test.h"

#define CAP_US 200000
#define STEP_US 10000

static struct hal_limits limits;

static void start(int32_t duty_percent)
{
    const struct hal_limits_config config = {CAP_US, duty_percent};

    hal_limits_init(&limits, &config, 0);
}

void setUp(void)
{
    start(100);
}

void tearDown(void)
{
}

/* High from 0 on, looked at in steps: when it is refused. */
static int64_t refused_us(int64_t judged_on_us)
{
    int64_t now_us = 0;

    while (hal_limits_allow(&limits, now_us, now_us, judged_on_us) && now_us < 100 * CAP_US) {
        now_us += STEP_US;
    }
    return now_us;
}

static void without_a_frame_it_is_the_cap(void)
{
    TEST_ASSERT_EQUAL_INT64(CAP_US + HAL_LIMITS_SLACK_US + STEP_US, refused_us(0));
}

static void a_frame_starts_it_anew(void)
{
    const int64_t now_us = refused_us(0);

    TEST_ASSERT_TRUE(hal_limits_allow(&limits, now_us, now_us, now_us - CAP_US));
    TEST_ASSERT_TRUE(hal_limits_allow(&limits, now_us + STEP_US, now_us + STEP_US, now_us));
}

/* As do half a second of rest, and no less. */
static void a_rest_starts_it_anew(void)
{
    const int64_t now_us = refused_us(0);

    TEST_ASSERT_FALSE(hal_limits_allow(&limits, now_us + HAL_LIMITS_PAUSE_US - 1, now_us, 0));
    TEST_ASSERT_TRUE(hal_limits_allow(&limits, now_us + HAL_LIMITS_PAUSE_US, now_us, 0));
}

/* Off and on without a frame adds up. */
static void switching_starts_nothing_anew(void)
{
    int64_t now_us = 0, on_us = 0;

    while (hal_limits_allow(&limits, now_us, on_us, 0) && now_us < 100 * CAP_US) {
        now_us += 2 * STEP_US;
        on_us += STEP_US;
    }
    TEST_ASSERT_EQUAL_INT64(CAP_US + HAL_LIMITS_SLACK_US + STEP_US, on_us);
}

/* A sum that goes back, jumps or is nonsense counts as high, and a frame of the future as none. */
static void what_cannot_be_counts_as_high(void)
{
    static const int64_t sums_us[] = {-1, INT64_MIN, INT64_MAX, INT64_MAX / 2, 1000 * CAP_US};
    int i;

    for (i = 0; i < IH_TEST_COUNT(sums_us); i++) {
        int64_t now_us = 0;

        start(100);
        while (hal_limits_allow(&limits, now_us, now_us / STEP_US % 2 == 0 ? sums_us[i] : 0,
                                sums_us[i]) &&
               now_us < 100 * CAP_US) {
            now_us += STEP_US;
        }
        IH_TEST_EQUAL(true, now_us <= CAP_US + HAL_LIMITS_SLACK_US + STEP_US, "refused", i);
    }
    start(100);
    TEST_ASSERT_EQUAL_INT64(CAP_US + HAL_LIMITS_SLACK_US + STEP_US, refused_us(INT64_MAX));
    start(100);
    TEST_ASSERT_EQUAL_INT64(CAP_US + HAL_LIMITS_SLACK_US + STEP_US, refused_us(100 * CAP_US));
}

/* A clock that stands or goes back gives no light, and does not overflow. */
static void a_clock_that_goes_back_is_no_rest(void)
{
    int64_t now_us = refused_us(0);
    int i;

    for (i = 0; i < 1000; i++) {
        now_us -= STEP_US;
        IH_TEST_EQUAL(false, hal_limits_allow(&limits, now_us, 0, 0), "allowed", i);
    }
}

/* High whenever it may be: in 10 s and in an hour no more than the header says, and hardly less. */
static void the_duty_holds(void)
{
    static const int32_t duties[] = {1, 10, 50, 99};
    static const int64_t windows_us[] = {10000000, 3600000000};
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(duties); i++) {
        for (k = 0; k < 2; k++) {
            const int64_t max_us = duties[i] * (windows_us[k] + HAL_LIMITS_BURST_US) / 100 +
                                   HAL_LIMITS_SLACK_US + STEP_US;
            int64_t now_us = 0, on_us = 0;

            start(duties[i]);
            while (now_us < windows_us[k]) {
                const bool allowed = hal_limits_allow(&limits, now_us, on_us, on_us);

                now_us += STEP_US;
                on_us += allowed ? STEP_US : 0;
            }
            IH_TEST_EQUAL(true, on_us <= max_us, "at most", i);
            IH_TEST_EQUAL(true, on_us >= max_us - max_us / 5 - 2 * HAL_LIMITS_SLACK_US, "at least",
                          i);
        }
    }
}

/* Used up, it needs half of what may be used at once: 50 % of the burst and the slack are 8,000,000. */
static void a_used_up_duty_needs_half(void)
{
    int64_t now_us = 0;
    int steps;

    start(50);
    while (hal_limits_allow(&limits, now_us, now_us, now_us)) {
        now_us += STEP_US;
    }
    TEST_ASSERT_EQUAL_INT64(17 * STEP_US, now_us);
    const int64_t on_us = now_us;
    for (steps = 1; steps < 9; steps++) {
        IH_TEST_EQUAL(false, hal_limits_allow(&limits, now_us + steps * STEP_US, on_us, on_us),
                      "allowed", steps);
    }
    TEST_ASSERT_TRUE(hal_limits_allow(&limits, now_us + steps * STEP_US, on_us, on_us));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(without_a_frame_it_is_the_cap);
    RUN_TEST(a_frame_starts_it_anew);
    RUN_TEST(a_rest_starts_it_anew);
    RUN_TEST(switching_starts_nothing_anew);
    RUN_TEST(what_cannot_be_counts_as_high);
    RUN_TEST(a_clock_that_goes_back_is_no_rest);
    RUN_TEST(the_duty_holds);
    RUN_TEST(a_used_up_duty_needs_half);
    return UNITY_END();
}
