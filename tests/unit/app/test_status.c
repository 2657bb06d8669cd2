/* app_status: figures of an interval as one line. */
#include "app_status.h"

#include "ih_test.h"

static struct app_status status;
static char text[APP_STATUS_TEXT_MAX];

void setUp(void)
{
    memset(&status, IH_TEST_FILL, sizeof status);
    memset(text, 0, sizeof text);
}

void tearDown(void)
{
}

static void a_line_comes_when_the_interval_is_over(void)
{
    int i;

    app_status_init(&status, 10, 7000000);
    for (i = 0; i < 250; i++) {
        app_status_frame(&status, 311 + i % 3, i < 230, 20000 + (i == 100 ? 20001 : 0));
    }
    TEST_ASSERT_FALSE(app_status_line(&status, 16999999, text));
    TEST_ASSERT_TRUE(app_status_line(&status, 17000000, text));
    TEST_ASSERT_EQUAL_STRING("25.0 frames/s, 312 dots, 0.9 heads, lost 0, skipped 0, bad 0, unsent "
                             "0, laser on 0 %, frame 41 ms",
                             text);
    /* All anew; and how long it really was counts. */
    TEST_ASSERT_FALSE(app_status_line(&status, 26999999, text));
    app_status_frame(&status, 10, 2, 999);
    status.lost_count += 3;
    status.skipped_count += 4;
    status.bad_count += 5;
    status.unsent_count += 6;
    TEST_ASSERT_TRUE(app_status_line(&status, 37000000, text));
    TEST_ASSERT_EQUAL_STRING("0.1 frames/s, 10 dots, 2.0 heads, lost 3, skipped 4, bad 5, unsent "
                             "6, laser on 0 %, frame 1 ms",
                             text);
    TEST_ASSERT_TRUE(app_status_line(&status, 47000000, text));
    TEST_ASSERT_EQUAL_STRING("0.0 frames/s, lost 0, skipped 0, bad 0, unsent 0, laser on 0 %",
                             text);
}

static void without_interval_there_is_no_line(void)
{
    app_status_init(&status, 0, 0);
    app_status_frame(&status, 1, 1, 1);
    TEST_ASSERT_FALSE(app_status_line(&status, INT64_MAX, text));
}

static const char *laser_part(void)
{
    const char *part = strstr(text, "laser on ");

    TEST_ASSERT_NOT_NULL(part);
    return part;
}

static void the_lasers_share_is_since_the_line_before(void)
{
    app_status_init(&status, 1, 0);
    status.laser_on_us = 380000;
    TEST_ASSERT_TRUE(app_status_line(&status, 1000000, text));
    TEST_ASSERT_EQUAL_STRING("laser on 38 %", laser_part());
    status.laser_on_us += 404999;
    TEST_ASSERT_TRUE(app_status_line(&status, 2000000, text));
    TEST_ASSERT_EQUAL_STRING("laser on 40 %", laser_part());
    TEST_ASSERT_TRUE(app_status_line(&status, 3000000, text));
    TEST_ASSERT_EQUAL_STRING("laser on 0 %", laser_part());
    status.laser_on_us += 6000000;
    TEST_ASSERT_TRUE(app_status_line(&status, 9000000, text));
    TEST_ASSERT_EQUAL_STRING("laser on 100 %", laser_part());
}

static void the_longest_line_has_room(void)
{
    app_status_init(&status, 1, 0);
    app_status_frame(&status, INT32_MAX, INT32_MAX, INT64_MAX - 1000);
    status.lost_count = INT64_MIN;
    status.skipped_count = INT64_MIN;
    status.bad_count = INT64_MIN;
    status.unsent_count = INT64_MIN;
    status.laser_on_us = 1000000;
    TEST_ASSERT_TRUE(app_status_line(&status, 1000000, text));
    TEST_ASSERT_EQUAL_STRING(" ms", text + strlen(text) - 3);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_line_comes_when_the_interval_is_over);
    RUN_TEST(without_interval_there_is_no_line);
    RUN_TEST(the_lasers_share_is_since_the_line_before);
    RUN_TEST(the_longest_line_has_room);
    return UNITY_END();
}
