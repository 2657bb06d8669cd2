/* app_phase: frames with and without dots, in the orders that cameras bring them. */
#include "app_phase.h"
#include "unity.h"

#define LIT APP_PHASE_LIT
#define DARK APP_PHASE_DARK
#define PARTIAL APP_PHASE_PARTIAL

static struct app_phase phase;

void setUp(void)
{
    app_phase_init(&phase);
}

void tearDown(void)
{
}

static void judged(enum app_phase_verdict verdict, int32_t labelled_count, bool switches,
                   int32_t on_frames)
{
    TEST_ASSERT_EQUAL_INT(verdict, app_phase_judge(&phase, labelled_count, switches, on_frames));
}

/* What was commanded does not matter where dots are seen. */
static void test_dots_are_believed(void)
{
    judged(LIT, 300, true, 1);
    judged(LIT, 300, true, 0);
    judged(LIT, APP_PHASE_SEEN_MIN, false, 0);
}

static void test_no_dots_are_dark(void)
{
    judged(DARK, 0, true, 0);
    judged(DARK, APP_PHASE_SEEN_MIN - 1, true, 1);
    judged(DARK, 0, true, APP_PHASE_FLIGHT_MAX);
    judged(DARK, 0, false, APP_PHASE_FLIGHT_MAX);
}

/* On for longer than any frame is in flight, and still nothing: nothing is there. */
static void test_nothing_in_range(void)
{
    judged(LIT, 0, true, APP_PHASE_FLIGHT_MAX + 1);
    judged(LIT, 0, false, 1000);
    judged(DARK, 0, true, 0);
}

/* Half exposed: many labels fewer. Once; twice in a row is a scene that has changed. */
static void test_partial(void)
{
    judged(LIT, 300, true, 1);
    judged(PARTIAL, 149, true, 1);
    judged(LIT, 300, true, 2);
    judged(PARTIAL, 100, true, 1);
    judged(LIT, 100, true, 2);
    judged(LIT, 100, true, 1);
    judged(LIT, 300, true, 1); /* more is never partial */
    judged(LIT, 150, true, 1); /* just half */
}

static void test_always_on_has_no_partial(void)
{
    judged(LIT, 300, false, 20);
    judged(LIT, 20, false, 21);
    judged(LIT, 300, false, 22);
}

/* A dark frame between two partial ones does not make the second a change of the scene. */
static void test_partial_after_dark(void)
{
    judged(LIT, 300, true, 1);
    judged(PARTIAL, 100, true, 1);
    judged(DARK, 0, true, 2);
    judged(PARTIAL, 100, true, 3);
    judged(LIT, 100, true, 4);
}

/* After an empty room the first few dots are no half of anything. */
static void test_after_nothing(void)
{
    judged(LIT, 300, true, 1);
    judged(LIT, 0, true, APP_PHASE_FLIGHT_MAX + 1);
    judged(LIT, 20, true, 1);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_dots_are_believed);
    RUN_TEST(test_no_dots_are_dark);
    RUN_TEST(test_nothing_in_range);
    RUN_TEST(test_partial);
    RUN_TEST(test_always_on_has_no_partial);
    RUN_TEST(test_partial_after_dark);
    RUN_TEST(test_after_nothing);
    return UNITY_END();
}
