/* app_laser: the policy against a line that can fail and an interlock that can open at any moment. */
#include "app_laser.h"
#include "unity.h"

#define FRAME_US 40000

static struct {
    bool line, taken, closed;
    bool opens_after_read; /* the interlock opens right after it was read */
    int off_failures;      /* so many calls of set(false) fail */
    bool on_fails;
    int close_count, beat_count, call_count;
    bool beat_high;      /* the heartbeat's line, whatever it began with */
    bool rise_before_on; /* it has risen while the laser was off */
} fake;

static struct app_laser laser;

static bool fake_open(void *context, struct hal_error *error)
{
    (void)context;
    (void)error;
    fake.taken = true;
    return true;
}

static void fake_close(void *context)
{
    (void)context;
    fake.taken = false;
    fake.line = false;
    fake.close_count++;
}

static bool fake_set(void *context, bool on, struct hal_error *error)
{
    (void)context;
    fake.call_count++;
    if (!on && fake.off_failures > 0) {
        fake.off_failures--;
        return hal_fail(error, "off fails");
    }
    fake.line = on;
    return on && fake.on_fails ? hal_fail(error, "on fails") : true;
}

static bool fake_beat(void *context, struct hal_error *error)
{
    (void)context;
    (void)error;
    fake.beat_count++;
    fake.beat_high = !fake.beat_high;
    fake.rise_before_on = fake.rise_before_on || (fake.beat_high && !fake.line);
    return true;
}

static bool fake_interlock(void *context, bool *closed, struct hal_error *error)
{
    (void)context;
    (void)error;
    *closed = fake.closed;
    fake.closed = fake.closed && !fake.opens_after_read;
    return true;
}

static const struct hal_strobe strobe = {NULL,     fake_open, fake_close,
                                         fake_set, fake_beat, fake_interlock};

static void start(bool enabled, int32_t duty_percent)
{
    const struct app_laser_config config = {enabled, duty_percent};
    app_laser_init(&laser, &config, &strobe, 0);
    TEST_ASSERT_TRUE(app_laser_open(&laser));
    app_laser_rig(&laser, true, 0);
    app_laser_camera(&laser, true, FRAME_US, 0);
}

void setUp(void)
{
    fake.line = fake.taken = fake.opens_after_read = fake.on_fails = false;
    fake.closed = true;
    fake.off_failures = fake.close_count = fake.beat_count = fake.call_count = 0;
}

void tearDown(void)
{
}

static void test_on_needs_everything(void)
{
    start(true, 100);
    TEST_ASSERT_FALSE(fake.line);
    app_laser_wish(&laser, true, 0);
    TEST_ASSERT_TRUE(fake.line);
    app_laser_rig(&laser, false, 0);
    TEST_ASSERT_FALSE(fake.line);
    app_laser_rig(&laser, true, 0);
    TEST_ASSERT_TRUE(fake.line);
    app_laser_camera(&laser, false, 0, 0);
    TEST_ASSERT_FALSE(fake.line);
    app_laser_camera(&laser, true, FRAME_US, 0);
    TEST_ASSERT_TRUE(fake.line);
    app_laser_wish(&laser, false, 0);
    TEST_ASSERT_FALSE(fake.line);
    app_laser_wish(&laser, true, 0);
    app_laser_close(&laser, 0);
    TEST_ASSERT_FALSE(fake.line);
    app_laser_wish(&laser, true, 0);
    TEST_ASSERT_FALSE(fake.line);
}

static void test_not_enabled_touches_nothing(void)
{
    start(false, 100);
    app_laser_wish(&laser, true, 0);
    app_laser_tick(&laser, 1000000);
    app_laser_interlock(&laser, 1000000);
    app_laser_close(&laser, 1000000);
    TEST_ASSERT_FALSE(fake.taken);
    TEST_ASSERT_EQUAL_INT(0, fake.call_count + fake.close_count + fake.beat_count);
}

/* Off no later than 3 frame times after the last frame, on again with the next one. */
static void test_silence(void)
{
    int64_t now_us = 0;
    start(true, 100);
    app_laser_wish(&laser, true, 0);
    while (fake.line) {
        int64_t wait_us = app_laser_tick(&laser, now_us);
        TEST_ASSERT_GREATER_THAN_INT64(0, wait_us);
        now_us += fake.line ? wait_us : 0;
        TEST_ASSERT_LESS_OR_EQUAL_INT64(3 * FRAME_US, now_us);
    }
    TEST_ASSERT_EQUAL_INT64(3 * FRAME_US, now_us);
    app_laser_wish(&laser, true, now_us + 100);
    TEST_ASSERT_FALSE_MESSAGE(fake.line, "on again without a frame");
    app_laser_frame(&laser, now_us + 200);
    app_laser_wish(&laser, true, now_us + 200);
    TEST_ASSERT_TRUE(fake.line);
}

/* Switching off and on does not start the time anew: only frames do. */
static void test_silence_is_not_forgotten(void)
{
    start(true, 100);
    for (int64_t now_us = 0; now_us < 100 * FRAME_US; now_us += FRAME_US / 4) {
        app_laser_wish(&laser, now_us / FRAME_US % 2 == 0, now_us);
        app_laser_tick(&laser, now_us);
        TEST_ASSERT_FALSE(fake.line && now_us >= 6 * FRAME_US);
    }
}

static void test_interlock(void)
{
    start(true, 100);
    app_laser_wish(&laser, true, 0);
    fake.closed = false;
    app_laser_interlock(&laser, 0);
    TEST_ASSERT_FALSE(fake.line);
    app_laser_wish(&laser, false, 0);
    app_laser_wish(&laser, true, 0);
    app_laser_frame(&laser, 0);
    app_laser_tick(&laser, 0);
    TEST_ASSERT_FALSE(fake.line);
    fake.closed = true;
    app_laser_interlock(&laser, 10);
    TEST_ASSERT_FALSE_MESSAGE(fake.line, "on while the contact may bounce");
    fake.closed = false;
    app_laser_tick(&laser, 100);
    fake.closed = true;
    int64_t now_us = 100;
    while (!fake.line && now_us < 1000000) {
        now_us += app_laser_tick(&laser, now_us);
    }
    TEST_ASSERT_INT64_WITHIN(APP_LASER_CLOSED_US, 100 + 3 * APP_LASER_CLOSED_US / 2, now_us);
}

/* It opens between the look at it and the switching on. */
static void test_interlock_race(void)
{
    start(true, 100);
    fake.opens_after_read = true;
    app_laser_wish(&laser, true, 0);
    TEST_ASSERT_FALSE(fake.line);
    TEST_ASSERT_EQUAL_INT(1, laser.on_count); /* it was on, for the time of one call */
}

/* Whatever is wished at whatever time: within any stretch of time no more than the duty and one
 * burst. Judged by adding up the line's level, not by the policy's own sums. */
static void test_duty(void)
{
    static const int32_t duties[] = {1, 10, 50, 90, 99};
    enum { STEP_US = 1000, STEPS = 6000 };
    static int64_t on_until_us[STEPS + 1];
    uint32_t random = 1;
    for (int d = 0; d < 5; d++) {
        start(true, duties[d]);
        bool wished = true;
        int64_t due_us = 0;
        on_until_us[0] = 0;
        for (int step = 0; step < STEPS; step++) {
            int64_t now_us = (int64_t)step * STEP_US;
            random = random * 1664525u + 1013904223u;
            if (step > STEPS / 2 && random >> 28 == 0) {
                wished = !wished;
            }
            app_laser_frame(&laser, now_us);
            app_laser_wish(&laser, wished, now_us);
            if (due_us <= now_us || step > STEPS / 2) {
                due_us = now_us + app_laser_tick(&laser, now_us);
            }
            on_until_us[step + 1] = on_until_us[step] + (fake.line ? STEP_US : 0);
        }
        for (int from = 0; from < STEPS; from += 7) {
            for (int to = from + 1; to <= STEPS; to += 13) {
                int64_t on_us = on_until_us[to] - on_until_us[from];
                int64_t all_us = (int64_t)(to - from) * STEP_US;
                int64_t max_us = duties[d] * (all_us + APP_LASER_BURST_US) / 100;
                /* a step of this test is as coarse as 2 ms */
                TEST_ASSERT_LESS_OR_EQUAL_INT64(max_us + 2 * STEP_US, on_us);
            }
        }
        TEST_ASSERT_GREATER_THAN_INT64_MESSAGE((int64_t)duties[d] * STEPS / 2 * STEP_US / 200,
                                               on_until_us[STEPS / 2], "the duty is hardly used");
    }
}

/* A tick that switches on says when the limits in time are reached, not the next beat. */
static void test_tick_switches_on(void)
{
    start(true, 1);
    app_laser_wish(&laser, true, 0);
    fake.closed = false;
    app_laser_interlock(&laser, 500); /* half of the burst of 1 ms is left */
    fake.closed = true;
    TEST_ASSERT_LESS_OR_EQUAL_INT64(APP_LASER_CLOSED_US, app_laser_tick(&laser, 600));
    TEST_ASSERT_FALSE(fake.line);
    int64_t wait_us = app_laser_tick(&laser, 30000);
    TEST_ASSERT_TRUE(fake.line);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(1 + APP_LASER_BURST_US / 99, wait_us);

    setUp();
    start(true, 100);
    app_laser_wish(&laser, true, 0);
    fake.closed = false;
    app_laser_interlock(&laser, 3 * FRAME_US - 1000);
    fake.closed = true;
    wait_us = app_laser_tick(&laser, 4 * FRAME_US);
    TEST_ASSERT_TRUE(fake.line);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(1000, wait_us);
}

/* More than the duty was used between two ticks: it does not go on before the duty is made up for. */
static void test_duty_used_without_a_tick(void)
{
    start(true, 10);
    app_laser_wish(&laser, true, 0);
    app_laser_wish(&laser, false, APP_LASER_BURST_US);
    app_laser_frame(&laser, APP_LASER_BURST_US);
    app_laser_wish(&laser, true, APP_LASER_BURST_US + 1);
    TEST_ASSERT_FALSE(fake.line);
    app_laser_tick(&laser, 10 * APP_LASER_BURST_US - 10);
    TEST_ASSERT_FALSE(fake.line);
    app_laser_tick(&laser, 10 * APP_LASER_BURST_US);
    TEST_ASSERT_TRUE(fake.line);
}

/* One wait, neither shorter nor longer, and what was used up is there again. */
static void test_duty_is_made_up_for_in_time(void)
{
    start(true, 20);
    app_laser_wish(&laser, true, 0);
    int64_t now_us = 0, wait_us = 0;
    while (fake.line && now_us < 1000000) {
        now_us += wait_us;
        wait_us = app_laser_tick(&laser, now_us);
    }
    TEST_ASSERT_INT64_WITHIN(1, APP_LASER_BURST_US * 20 / 80, now_us);
    TEST_ASSERT_INT64_WITHIN(5, APP_LASER_BURST_US, wait_us);
    app_laser_tick(&laser, now_us + wait_us - 10);
    TEST_ASSERT_FALSE(fake.line);
    app_laser_tick(&laser, now_us + wait_us);
    TEST_ASSERT_TRUE(fake.line);
}

/* Whatever switches it off: the time until then counts as on, the time after it as off. */
static void test_time_is_accounted_for(void)
{
    for (int how = 0; how < 5; how++) {
        setUp();
        start(true, 50);
        app_laser_wish(&laser, true, 0);
        switch (how) {
        case 0:
            app_laser_wish(&laser, false, 50000);
            break;
        case 1:
            app_laser_rig(&laser, false, 50000);
            break;
        case 2:
            app_laser_camera(&laser, false, 0, 50000);
            break;
        case 3:
            fake.closed = false;
            app_laser_interlock(&laser, 50000);
            break;
        default:
            app_laser_close(&laser, 50000);
            break;
        }
        TEST_ASSERT_FALSE(fake.line);
        app_laser_tick(&laser, 70000);
        TEST_ASSERT_EQUAL_INT64(50000, laser.on_us);
        TEST_ASSERT_EQUAL_INT64(50 * (APP_LASER_BURST_US - 50000 + 20000), laser.credit);
    }
}

/* Nobody looks at the clock while a frame is processed. From the second one on it is known how long
 * that takes, and the duty is kept there, too. */
static void test_duty_while_busy(void)
{
    static const int32_t duties[] = {1, 10, 50, 90, 99};
    enum { BUSY_US = 30000 };
    for (int d = 0; d < 5; d++) {
        int64_t now_us = 0, excess = 0;
        int busy_on_count = 0;
        const int64_t max = (int64_t)duties[d] * APP_LASER_BURST_US;
        start(true, duties[d]);
        app_laser_wish(&laser, true, now_us);
        for (int frame = 0; frame < 300; frame++) {
            for (int64_t passed_us = 0; passed_us < FRAME_US - BUSY_US;) {
                int64_t wait_us = app_laser_tick(&laser, now_us);
                int64_t left_us = FRAME_US - BUSY_US - passed_us;
                wait_us = wait_us < left_us ? wait_us : left_us;
                excess += wait_us * ((fake.line ? 100 : 0) - duties[d]);
                excess = excess < 0 || frame == 0 ? 0 : excess;
                TEST_ASSERT_LESS_OR_EQUAL_INT64(max + 100, excess);
                now_us += wait_us;
                passed_us += wait_us;
            }
            app_laser_frame(&laser, now_us);
            app_laser_busy(&laser, true, now_us);
            busy_on_count += fake.line;
            excess += BUSY_US * ((fake.line ? 100 : 0) - duties[d]);
            excess = excess < 0 || frame == 0 ? 0 : excess;
            TEST_ASSERT_LESS_OR_EQUAL_INT64(max + 100, excess);
            now_us += BUSY_US;
            app_laser_busy(&laser, false, now_us);
            app_laser_wish(&laser, true, now_us);
        }
        TEST_ASSERT_GREATER_THAN_INT64_MESSAGE(0, laser.on_us, "never on");
        TEST_ASSERT_TRUE_MESSAGE(busy_on_count > 100 || duties[d] < 90, "off though it would last");
    }
}

/* The time that a frame takes is no silence, however long. */
static void test_busy_is_no_silence(void)
{
    start(true, 100);
    app_laser_wish(&laser, true, 0);
    app_laser_busy(&laser, true, 1000);
    TEST_ASSERT_TRUE(fake.line);
    app_laser_busy(&laser, false, 10 * FRAME_US);
    app_laser_tick(&laser, 10 * FRAME_US);
    app_laser_busy(&laser, true, 10 * FRAME_US);
    TEST_ASSERT_TRUE_MESSAGE(fake.line, "off though there is no limit");
    app_laser_busy(&laser, false, 10 * FRAME_US);
    app_laser_tick(&laser, 13 * FRAME_US);
    TEST_ASSERT_FALSE(fake.line);
}

/* Whatever level the heartbeat's line has: a one-shot that has run out lets light through from now on. */
static void test_a_rising_edge_comes_before_the_light(void)
{
    start(true, 100);
    for (int i = 0; i < 4; i++) {
        fake.beat_high = i % 2 == 0;
        fake.rise_before_on = false;
        app_laser_wish(&laser, true, i);
        TEST_ASSERT_TRUE(fake.line);
        TEST_ASSERT_TRUE(fake.rise_before_on);
        app_laser_wish(&laser, false, i);
    }
}

static void test_beats_while_on(void)
{
    start(true, 100);
    app_laser_wish(&laser, true, 0);
    for (int64_t now_us = 0; now_us < 100000; now_us += 1000) {
        app_laser_frame(&laser, now_us);
        TEST_ASSERT_LESS_OR_EQUAL_INT64(APP_LASER_BEAT_US, app_laser_tick(&laser, now_us));
    }
    TEST_ASSERT_INT_WITHIN(1, 2 + 10, fake.beat_count);
    app_laser_wish(&laser, false, 100000);
    int beats = fake.beat_count;
    app_laser_tick(&laser, 200000);
    TEST_ASSERT_EQUAL_INT(beats, fake.beat_count);
}

/* Off fails once: tried again. For good: the lines are given back. Either way it is over. */
static void test_off_fails(void)
{
    for (int failures = 1; failures <= 100; failures += 99) {
        setUp();
        start(true, 100);
        app_laser_wish(&laser, true, 0);
        fake.off_failures = failures;
        app_laser_wish(&laser, false, 0);
        TEST_ASSERT_FALSE(fake.line);
        TEST_ASSERT_FALSE(fake.taken);
        TEST_ASSERT_BITS_HIGH(APP_LASER_BLOCK_FAULT, laser.blocks);
        TEST_ASSERT_EQUAL_STRING("off fails", laser.failed.text);
        app_laser_wish(&laser, true, 0);
        app_laser_interlock(&laser, 0);
        app_laser_frame(&laser, 0);
        app_laser_tick(&laser, 0);
        app_laser_close(&laser, 0);
        TEST_ASSERT_FALSE(fake.line);
    }
}

static void test_on_fails(void)
{
    start(true, 100);
    fake.on_fails = true;
    app_laser_wish(&laser, true, 0);
    TEST_ASSERT_FALSE(fake.line);
    TEST_ASSERT_FALSE(fake.taken);
    TEST_ASSERT_BITS_HIGH(APP_LASER_BLOCK_FAULT, laser.blocks);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_on_needs_everything);
    RUN_TEST(test_not_enabled_touches_nothing);
    RUN_TEST(test_silence);
    RUN_TEST(test_silence_is_not_forgotten);
    RUN_TEST(test_interlock);
    RUN_TEST(test_interlock_race);
    RUN_TEST(test_duty);
    RUN_TEST(test_tick_switches_on);
    RUN_TEST(test_duty_used_without_a_tick);
    RUN_TEST(test_duty_is_made_up_for_in_time);
    RUN_TEST(test_time_is_accounted_for);
    RUN_TEST(test_duty_while_busy);
    RUN_TEST(test_busy_is_no_silence);
    RUN_TEST(test_a_rising_edge_comes_before_the_light);
    RUN_TEST(test_beats_while_on);
    RUN_TEST(test_off_fails);
    RUN_TEST(test_on_fails);
    return UNITY_END();
}
