/* app_laser: the policy against a line that can fail and an interlock that can open at any moment. */
#include <string.h>

#include "app_laser.h"
#include "unity.h"

#define FRAME_US 40000
#define CAP_US 200000

static struct {
    bool line, taken, closed;
    bool opens_after_read; /* the interlock opens right after it was read */
    int off_failures;      /* so many calls of set(false) fail */
    bool on_fails, judged_fails, prove_fails;
    int judged_count;
    int close_count, beat_count, call_count;
    int64_t wait_us;     /* what the last tick said */
    bool beat_high;      /* the heartbeat's line, whatever it began with */
    bool rise_before_on; /* it has risen while the laser was off */
} fake;

static struct app_laser laser;

/* A random schedule: frames, wishes, stalls, an interlock, cameras that come and go. The guard's limits
 * look every LOOK_US, also while the program stalls. Each rise and fall is noted, and judged afterwards
 * without the sums of either. */
enum { EDGES_MAX = 200000, LOOK_US = 20000 };

static struct schedule {
    uint32_t random;
    int64_t now_us, next_look_us, on_us, judged_on_us;
    int64_t silent_us, silent_max_us; /* on without a frame, and the longest such time */
    int64_t low_us;
    bool was_on;
    int cut_count, edge_count;
    struct hal_limits limits;
    int64_t edge_us[EDGES_MAX]; /* rise, fall, rise, ...; the last member */
} schedule;

static bool fake_open(void *context, struct hal_error *error)
{
    (void)context;
    (void)error;
    fake.taken = true;
    fake.line = false;
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

static bool fake_judged(void *context, struct hal_error *error)
{
    (void)context;
    fake.judged_count++;
    schedule.judged_on_us = schedule.on_us;
    return fake.judged_fails ? hal_fail(error, "judged fails") : true;
}

static bool fake_prove(void *context, struct hal_error *unproven, struct hal_error *error)
{
    (void)context;
    TEST_ASSERT_FALSE(fake.line);
    hal_fail(unproven, "made up");
    return fake.prove_fails ? hal_fail(error, "prove fails") : true;
}

static const struct hal_strobe strobe = {.open = fake_open,
                                         .close = fake_close,
                                         .set = fake_set,
                                         .beat = fake_beat,
                                         .interlock = fake_interlock,
                                         .judged = fake_judged,
                                         .prove = fake_prove};

static void start(bool enabled, int32_t duty_percent)
{
    const struct app_laser_config config = {enabled, duty_percent, CAP_US};
    app_laser_init(&laser, &config, &strobe, 0);
    struct hal_error unproven;
    TEST_ASSERT_TRUE(app_laser_open(&laser, &unproven));
    TEST_ASSERT_EQUAL_STRING(enabled ? "made up" : "", unproven.text);
    app_laser_rig(&laser, true, 0);
    app_laser_camera(&laser, true, FRAME_US, 0);
}

void setUp(void)
{
    fake.line = fake.taken = fake.opens_after_read = fake.on_fails = fake.judged_fails = false;
    fake.prove_fails = false;
    fake.closed = true;
    fake.judged_count = 0;
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

/* Nobody looks at the clock while a frame is processed, and nobody knows how long the first one
 * takes: the duty is kept there, too. */
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
                excess = excess < 0 ? 0 : excess;
                TEST_ASSERT_LESS_OR_EQUAL_INT64(max + 100, excess);
                now_us += wait_us;
                passed_us += wait_us;
            }
            app_laser_busy(&laser, true, now_us);
            app_laser_frame(&laser, now_us);
            busy_on_count += fake.line;
            excess += BUSY_US * ((fake.line ? 100 : 0) - duties[d]);
            excess = excess < 0 ? 0 : excess;
            TEST_ASSERT_LESS_OR_EQUAL_INT64(max + 100, excess);
            now_us += BUSY_US;
            app_laser_busy(&laser, false, now_us);
            app_laser_wish(&laser, true, now_us);
        }
        TEST_ASSERT_GREATER_THAN_INT64_MESSAGE(0, laser.on_us, "never on");
        TEST_ASSERT_TRUE_MESSAGE(busy_on_count > 100 || duties[d] < 90, "off though it would last");
    }
}

/* 0 .. below - 1, the same in every run of the test. */
static int64_t random_below(int64_t below)
{
    schedule.random = schedule.random * 1664525u + 1013904223u;
    return (int64_t)((uint64_t)schedule.random * (uint64_t)below >> 32);
}

static void note_edge(void)
{
    if (fake.line != schedule.was_on) {
        TEST_ASSERT_LESS_THAN_INT(EDGES_MAX, schedule.edge_count);
        schedule.edge_us[schedule.edge_count++] = schedule.now_us;
        schedule.was_on = fake.line;
    }
}

/* A frame comes, and is judged: the only thing that ends a silence. */
static void judge_frame(void)
{
    app_laser_frame(&laser, schedule.now_us);
    schedule.silent_us = 0;
}

/* Time passes, with the guard's looks in it. */
static void pass(int64_t time_us)
{
    int64_t end_us = schedule.now_us + time_us;
    note_edge();
    while (schedule.now_us < end_us) {
        int64_t to_us = schedule.next_look_us < end_us ? schedule.next_look_us : end_us;
        int64_t step_us = to_us - schedule.now_us;
        schedule.on_us += fake.line ? step_us : 0;
        schedule.silent_us += fake.line ? step_us : 0;
        schedule.low_us = fake.line ? 0 : schedule.low_us + step_us;
        if (schedule.low_us >= HAL_LIMITS_PAUSE_US) {
            schedule.silent_us = 0; /* it may be on once more */
        }
        if (schedule.silent_us > schedule.silent_max_us) {
            schedule.silent_max_us = schedule.silent_us;
        }
        schedule.now_us = to_us;
        if (to_us == schedule.next_look_us) {
            schedule.next_look_us += LOOK_US;
            bool allowed =
                hal_limits_allow(&schedule.limits, to_us, schedule.on_us, schedule.judged_on_us);
            schedule.cut_count += !allowed && fake.line;
            fake.line = fake.line && allowed;
            fake.closed = allowed; /* as hal_guard reports it */
            note_edge();
        }
    }
}

/* One frame: waits with ticks, then the frame, with a stall at any place. */
static void run_frame(bool stalls)
{
    int64_t wait_us = 1000 + random_below(random_below(8) == 0 ? 300000 : 60000);
    int64_t end_us = schedule.now_us + wait_us;
    while (schedule.now_us < end_us) {
        int64_t tick_us = app_laser_tick(&laser, schedule.now_us);
        TEST_ASSERT_GREATER_THAN_INT64(0, tick_us);
        pass(tick_us < end_us - schedule.now_us ? tick_us : end_us - schedule.now_us);
        if (stalls && random_below(2000) == 0) {
            pass(random_below(3000000));
        }
    }
    app_laser_tick(&laser, schedule.now_us);
    app_laser_busy(&laser, true, schedule.now_us);
    pass(random_below(10000));
    if (random_below(8) != 0) {
        judge_frame();
    }
    app_laser_wish(&laser, random_below(3) != 0, schedule.now_us);
    pass(random_below(stalls && random_below(50) == 0 ? 2000000 : 60000));
    app_laser_wish(&laser, random_below(4) != 0, schedule.now_us);
    app_laser_busy(&laser, false, schedule.now_us);
    if (random_below(100) == 0) {
        app_laser_camera(&laser, false, 0, schedule.now_us);
        pass(HAL_LIMITS_PAUSE_US + random_below(1000000));
        app_laser_camera(&laser, true, 1 + random_below(INT32_MAX), schedule.now_us);
    }
}

/* In any time from a rise to a fall, and so in any time: on for at most the duty and the burst, and
 * extra_us more. */
static void assert_duty(int32_t duty_percent, int64_t extra_us)
{
    int64_t worst_us = 0, min_before = 0, on_us = 0;
    for (int i = 0; i + 1 < schedule.edge_count; i += 2) {
        int64_t rise_us = schedule.edge_us[i], fall_us = schedule.edge_us[i + 1];
        int64_t before = 100 * on_us - duty_percent * rise_us;
        min_before = i == 0 || before < min_before ? before : min_before;
        on_us += fall_us - rise_us;
        int64_t excess = 100 * on_us - duty_percent * fall_us - min_before;
        int64_t excess_us = (excess - duty_percent * (int64_t)APP_LASER_BURST_US) / 100;
        worst_us = excess_us > worst_us ? excess_us : worst_us;
    }
    TEST_ASSERT_LESS_OR_EQUAL_INT64(extra_us, worst_us);
}

/* While a frame is processed the duty lasts for as long as the guards may let it be on: at 90 % a burst
 * of 100 ms lasts for 900 ms, and the cap with its slack takes 230 ms of them. */
static void test_the_duty_before_a_frame(void)
{
    for (int64_t late_us = 0; late_us < 2; late_us++) {
        const int64_t end_us = 10 * INT64_C(90000) - CAP_US - HAL_LIMITS_SLACK_US + late_us;
        setUp();
        start(true, 90);
        app_laser_wish(&laser, true, 0);
        for (int64_t now_us = 0; now_us < end_us; now_us += FRAME_US) {
            app_laser_frame(&laser, now_us);
        }
        app_laser_frame(&laser, end_us);
        TEST_ASSERT_TRUE(fake.line);
        app_laser_busy(&laser, true, end_us);
        TEST_ASSERT_EQUAL(late_us == 0, fake.line);
        /* Off it stays off until the duty is made up for. */
        app_laser_busy(&laser, false, end_us + 1);
        app_laser_tick(&laser, end_us + 1);
        TEST_ASSERT_EQUAL(late_us == 0, fake.line);
    }
}

/* Of several reasons the weightiest; none for what has a message of its own. */
static void test_reasons_have_texts(void)
{
    static const struct {
        unsigned block;
        const char *part;
    } reasons[] = {
        {APP_LASER_BLOCK_DUTY, "duty"},           {APP_LASER_BLOCK_SILENCE, "no frames"},
        {APP_LASER_BLOCK_CAMERA, "camera"},       {APP_LASER_BLOCK_RIG, "rig"},
        {APP_LASER_BLOCK_INTERLOCK, "interlock"}, {APP_LASER_BLOCK_DISABLED, "not enabled"},
    };
    unsigned blocks = 0;
    TEST_ASSERT_NULL(app_laser_block_text(0));
    TEST_ASSERT_NULL(app_laser_block_text(APP_LASER_BLOCK_FAULT));
    for (size_t i = 0; i < sizeof reasons / sizeof reasons[0]; i++) {
        blocks |= reasons[i].block;
        TEST_ASSERT_NOT_NULL(strstr(app_laser_block_text(reasons[i].block), reasons[i].part));
        TEST_ASSERT_NOT_NULL(strstr(app_laser_block_text(blocks), reasons[i].part));
    }
}

/* Half an hour of each. */
static void test_any_schedule(void)
{
    static const int32_t duties[] = {1, 5, 10, 30, 50, 80, 90, 99, 100};
    for (int run = 0; run < 36; run++) {
        int32_t duty = duties[run % 9];
        bool stalls = run >= 9;
        const struct hal_limits_config limits = {CAP_US, duty};
        setUp();
        schedule = (struct schedule){.random = (uint32_t)run, .next_look_us = LOOK_US};
        hal_limits_init(&schedule.limits, &limits, 0);
        start(true, duty);
        app_laser_wish(&laser, true, 0);
        while (schedule.now_us < 1800 * INT64_C(1000000)) {
            run_frame(stalls);
        }
        app_laser_close(&laser, schedule.now_us);
        note_edge();
        /* Without stalls the program keeps them by itself; else the guard does, at its next look. */
        int64_t late_us = HAL_LIMITS_SLACK_US + LOOK_US;
        assert_duty(duty, stalls ? late_us : 100);
        TEST_ASSERT_LESS_OR_EQUAL_INT64(CAP_US + (stalls ? late_us : 0), schedule.silent_max_us);
        TEST_ASSERT_GREATER_THAN_INT64(0, laser.on_us);
        TEST_ASSERT_TRUE(stalls ? schedule.cut_count > 0 : schedule.cut_count == 0);
    }
}

/* Which bits of a member can flip: all of a flag's one, and not those whose sums would overflow. */
struct member {
    const char *name;
    size_t offset;
    int bit_count;
};
#define MEMBER(name, bits)                            \
    {                                                 \
#name, offsetof(struct app_laser, name), bits \
    }

static const struct member members[] = {
    MEMBER(config.enabled, 1),
    MEMBER(config.duty_percent, 7),
    MEMBER(config.cap_us, 55),
    MEMBER(wished, 1),
    MEMBER(is_on, 1),
    MEMBER(blocks, 32),
    MEMBER(is_open, 1),
    MEMBER(silent_us, 55),
    MEMBER(silent_max_us, 55),
    MEMBER(off_us, 55),
    MEMBER(tick_us, 48),
    MEMBER(credit, 55),
    MEMBER(stage_us, 55),
    MEMBER(stage_max_us[0], 55),
    MEMBER(stage_max_us[1], 55),
    MEMBER(stage_max_us[2], 55),
    MEMBER(open_us, 55),
    MEMBER(beat_us, 55),
    MEMBER(on_us, 55),
    MEMBER(on_count, 55),
    MEMBER(may_be_on, 1),
};

static void flip(const struct member *member, int bit)
{
    ((uint8_t *)&laser)[member->offset + (size_t)bit / 8] ^= (uint8_t)(1u << bit % 8);
}

/* The calls of a frame, one at a time. */
enum { FRAME_CALLS = 8 };

static void call_policy(int call, bool has_frame)
{
    switch (call % FRAME_CALLS) {
    case 4:
        app_laser_busy(&laser, true, schedule.now_us);
        break;
    case 5:
        if (has_frame) {
            judge_frame();
        }
        break;
    case 6:
        app_laser_wish(&laser, random_below(8) != 0, schedule.now_us);
        break;
    case 7:
        app_laser_busy(&laser, false, schedule.now_us);
        break;
    default:
        fake.wait_us = app_laser_tick(&laser, schedule.now_us);
        break;
    }
}

static void pass_after(int call)
{
    pass(call % FRAME_CALLS < 4 || call % FRAME_CALLS == 5 ? APP_LASER_BEAT_US : 0);
}

/* A processor that was hit goes on with whatever is in its memory. */
static void run_flipped(int64_t end_us)
{
    for (int call = 0; schedule.now_us < end_us || call % FRAME_CALLS != 0; call++) {
        /* the last second has no frame */
        call_policy(call, random_below(8) != 0 && end_us - schedule.now_us > 1000000);
        pass_after(call);
    }
}

static void start_flipped(int32_t duty, uint32_t random)
{
    const struct hal_limits_config limits = {CAP_US, duty};
    setUp();
    schedule = (struct schedule){.random = random, .next_look_us = LOOK_US};
    hal_limits_init(&schedule.limits, &limits, 0);
    start(true, duty);
    app_laser_wish(&laser, true, 0);
    run_flipped(2000000 + random_below(100000));
}

/* It may be on still. */
static void end_flipped(void)
{
    note_edge();
    schedule.edge_us[schedule.edge_count] = schedule.now_us;
    schedule.edge_count += schedule.edge_count % 2;
}

/* Any bit of the policy's state: cap and duty hold all the same, as the guards keep sums of their own. */
static void test_any_bit_flips(void)
{
    static const int32_t duties[] = {30, 100};
    const int64_t late_us = HAL_LIMITS_SLACK_US + LOOK_US;
    int flip_count = 0, cut_count = 0;
    for (size_t m = 0; m < sizeof members / sizeof members[0]; m++) {
        for (int bit = 0; bit < members[m].bit_count; bit++) {
            int32_t duty = duties[bit % 2];
            start_flipped(duty, (uint32_t)bit);
            flip(&members[m], bit);
            run_flipped(6000000);
            end_flipped();
            if (schedule.silent_max_us > CAP_US + late_us) {
                TEST_FAIL_MESSAGE(members[m].name);
            }
            assert_duty(duty, late_us);
            flip_count++;
            cut_count += schedule.cut_count > 0;
        }
    }
    printf("%d bits of the policy flipped: cap and duty hold, %d times by the guards\n", flip_count,
           cut_count);
    TEST_ASSERT_GREATER_THAN_INT(20, cut_count);
}

#ifdef LASER_SKIPS
#include "laser_skips.h"
#endif

/* What a camera says of its rate, 1000 s here, changes nothing: off at the cap. */
static void test_the_cap_needs_no_frame_time(void)
{
    int64_t now_us = 0;
    start(true, 100);
    app_laser_camera(&laser, true, 1000000000, 0);
    app_laser_wish(&laser, true, 0);
    while (fake.line && now_us < 10 * CAP_US) {
        int64_t wait_us = app_laser_tick(&laser, now_us);
        now_us += fake.line ? wait_us : 0;
    }
    TEST_ASSERT_EQUAL_INT64(CAP_US, now_us);
    /* A camera that is opened again at once has no more light; after a rest it has. */
    app_laser_camera(&laser, false, 0, now_us);
    app_laser_camera(&laser, true, 1000000000, now_us + HAL_LIMITS_PAUSE_US - 1);
    TEST_ASSERT_FALSE(fake.line);
    app_laser_camera(&laser, true, 1000000000, now_us + HAL_LIMITS_PAUSE_US);
    TEST_ASSERT_TRUE(fake.line);
}

/* Only frames that were judged count, and each is passed on. */
static void test_a_frame_that_is_not_judged_is_none(void)
{
    start(true, 100);
    app_laser_wish(&laser, true, 0);
    for (int64_t now_us = 0; now_us < 3 * FRAME_US; now_us += 1000) {
        app_laser_busy(&laser, true, now_us);
        app_laser_busy(&laser, false, now_us + 500);
        app_laser_tick(&laser, now_us + 500);
    }
    app_laser_tick(&laser, 3 * FRAME_US);
    TEST_ASSERT_FALSE(fake.line);
    TEST_ASSERT_EQUAL_INT(0, fake.judged_count);
    app_laser_frame(&laser, 3 * FRAME_US);
    TEST_ASSERT_EQUAL_INT(1, fake.judged_count);
    app_laser_tick(&laser, 3 * FRAME_US);
    TEST_ASSERT_TRUE(fake.line);
    fake.judged_fails = true;
    app_laser_frame(&laser, 3 * FRAME_US);
    TEST_ASSERT_FALSE(fake.line || fake.taken);
    TEST_ASSERT_EQUAL_STRING("judged fails", laser.failed.text);
}

/* What a frame took so long it may take again: the laser goes off before where the cap would not last,
 * and comes back for the wait. Before it is judged, and after. */
static void test_the_cap_while_busy(void)
{
    static const int64_t takes_us[][2] = {{CAP_US + 1, 0}, {0, CAP_US + 1}, {CAP_US - 2000, 0}};
    for (int i = 0; i < 3; i++) {
        int64_t now_us = 0;
        setUp();
        start(true, 100);
        app_laser_wish(&laser, true, 0);
        for (int frame = 0; frame < 5; frame++) {
            bool lasts = frame == 0 || i == 2;
            bool is_used_up = i == 1 && frame == 1;
            app_laser_tick(&laser, now_us);
            TEST_ASSERT_EQUAL(!is_used_up, fake.line);
            now_us += 1000;
            app_laser_busy(&laser, true, now_us);
            TEST_ASSERT_EQUAL(lasts || (i == 1 && !is_used_up), fake.line);
            now_us += takes_us[i][0];
            app_laser_frame(&laser, now_us);
            TEST_ASSERT_EQUAL(lasts, fake.line);
            app_laser_wish(&laser, true, now_us);
            TEST_ASSERT_EQUAL(lasts || i == 0, fake.line);
            now_us += takes_us[i][1];
            app_laser_busy(&laser, false, now_us);
        }
    }
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
        TEST_ASSERT_EQUAL(failures > 1 + APP_LASER_OFF_TRIES, laser.may_be_on);
        app_laser_wish(&laser, true, 0);
        app_laser_interlock(&laser, 0);
        app_laser_frame(&laser, 0);
        app_laser_tick(&laser, 0);
        app_laser_close(&laser, 0);
        TEST_ASSERT_FALSE(fake.line);
    }
}

/* What does not work at the start is never switched on. */
static void test_prove_fails(void)
{
    const struct app_laser_config config = {true, 100, CAP_US};
    struct hal_error unproven;
    fake.prove_fails = true;
    app_laser_init(&laser, &config, &strobe, 0);
    TEST_ASSERT_FALSE(app_laser_open(&laser, &unproven));
    TEST_ASSERT_FALSE(fake.taken);
    TEST_ASSERT_EQUAL_STRING("prove fails", laser.failed.text);
    app_laser_rig(&laser, true, 0);
    app_laser_camera(&laser, true, FRAME_US, 0);
    app_laser_wish(&laser, true, 0);
    TEST_ASSERT_FALSE(fake.line);
    TEST_ASSERT_FALSE(laser.may_be_on);
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
#ifdef LASER_SKIPS
    RUN_TEST(test_any_instruction_is_skipped);
    return UNITY_END();
#else
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
    RUN_TEST(test_the_duty_before_a_frame);
    RUN_TEST(test_reasons_have_texts);
    RUN_TEST(test_any_schedule);
    RUN_TEST(test_any_bit_flips);
    RUN_TEST(test_the_cap_needs_no_frame_time);
    RUN_TEST(test_a_frame_that_is_not_judged_is_none);
    RUN_TEST(test_the_cap_while_busy);
    RUN_TEST(test_a_rising_edge_comes_before_the_light);
    RUN_TEST(test_beats_while_on);
    RUN_TEST(test_off_fails);
    RUN_TEST(test_prove_fails);
    RUN_TEST(test_on_fails);
    return UNITY_END();
#endif
}
