/* A directory as a camera: names, times and turns of its frames, and every call of the system that fails. The clock and
 * the timer are doubles: time passes when a test says so. */
#include "linux/hal_directory.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/timerfd.h>
#include <unistd.h>

#include "linux/hal_clock.h"
#include "unity.h"

#define COUNT 4
#define LIST "frames.jsonl"

static char dir[] = "/tmp/isohead_directory_XXXXXX";
/* 30 ms, then a gap of 10 s, then a bad frame with the time of the one before it. */
static const int64_t times_us[COUNT] = {1000, 31000, 10031000, 10031000};
static const bool lasers[COUNT] = {true, false, true, true};

static int64_t now, timer_us;
static bool create_fails, set_fails;
static struct hal_directory directory;
static struct hal_camera *const camera = &directory.camera;
static struct hal_error error;
static int log_count;

int __wrap_timerfd_create(int clock, int flags);
int __wrap_timerfd_settime(int fd, int flags, const struct itimerspec *new, struct itimerspec *old);
int __wrap_clock_gettime(clockid_t clock, struct timespec *at);

int __wrap_timerfd_create(int clock, int flags)
{
    TEST_ASSERT_EQUAL_INT(CLOCK_MONOTONIC, clock);
    TEST_ASSERT_EQUAL_INT(TFD_CLOEXEC | TFD_NONBLOCK, flags);
    if (create_fails) {
        errno = EMFILE;
        return -1;
    }
    return dup(STDOUT_FILENO);
}

int __wrap_timerfd_settime(int fd, int flags, const struct itimerspec *new, struct itimerspec *old)
{
    TEST_ASSERT_EQUAL_INT(directory.fd, fd);
    TEST_ASSERT_EQUAL_INT(TFD_TIMER_ABSTIME, flags);
    TEST_ASSERT_NULL(old);
    timer_us = (int64_t) new->it_value.tv_sec * 1000000 + new->it_value.tv_nsec / 1000;
    TEST_ASSERT_GREATER_THAN_INT64_MESSAGE(0, timer_us, "this stops the timer");
    errno = ECANCELED;
    return set_fails ? -1 : 0;
}

int __wrap_clock_gettime(clockid_t clock, struct timespec *at)
{
    TEST_ASSERT_EQUAL_INT(CLOCK_MONOTONIC, clock);
    *at = (struct timespec){(time_t)(now / 1000000), (long)(now % 1000000 * 1000)};
    return 0;
}

static void count_message(void *context, const char *subject, const char *text)
{
    (void)context, (void)subject, (void)text;
    log_count++;
}

static const struct hal_log messages = {.error = count_message};

static void make_file(const char *name, const char *text)
{
    char path[128];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    FILE *file = fopen(path, "w");
    TEST_ASSERT_NOT_NULL(file);
    fputs(text, file);
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

static void make_files(void)
{
    char list[512] = "";
    for (int i = 0; i < COUNT; i++) {
        char name[24];
        size_t length = strlen(list);
        snprintf(name, sizeof name, "take%d.pgm", i);
        make_file(name, i == COUNT - 1 ? "P6" : "P5 1 1 255 x");
        snprintf(list + length, sizeof list - length,
                 "{\"file\":\"%s\",\"time_us\":%lld,\"laser\":%s}\n", name, (long long)times_us[i],
                 lasers[i] ? "true" : "false");
    }
    make_file(LIST, list);
}

static void open_with(int32_t rate_mhz, bool repeats)
{
    const struct hal_directory_config config = {dir, rate_mhz, repeats};
    TEST_ASSERT_TRUE_MESSAGE(hal_directory_init(&directory, &config, &messages, &error),
                             error.text);
    TEST_ASSERT_EQUAL_INT(-1, directory.fd);
    TEST_ASSERT_TRUE(camera->open(camera->context, &error));
    TEST_ASSERT_TRUE(camera->waits);
}

void setUp(void)
{
    now = 5000000;
    create_fails = set_fails = false;
    log_count = 0;
}

void tearDown(void)
{
    hal_directory_free(&directory);
}

static enum hal_next next(struct hal_frame *frame)
{
    memset(frame, 0, sizeof *frame);
    return camera->next(camera->context, frame, &error);
}

/* It comes when it is due, not before, and is like this. */
static void assert_due(int64_t due_us, int index, int64_t sequence, int64_t time_us)
{
    struct hal_frame frame;
    char name[24];
    TEST_ASSERT_EQUAL_INT64(due_us, timer_us);
    now = due_us - 1;
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_NONE, next(&frame));
    now = due_us;
    enum hal_next got = next(&frame);
    snprintf(name, sizeof name, "%06d.pgm", (int)sequence);
    TEST_ASSERT_EQUAL_STRING(name, frame.name);
    TEST_ASSERT_EQUAL_INT64(sequence, frame.sequence);
    TEST_ASSERT_EQUAL_INT64(time_us, frame.time_us);
    TEST_ASSERT_EQUAL_INT(lasers[index], frame.laser);
    if (index == COUNT - 1) {
        TEST_ASSERT_EQUAL_INT(HAL_NEXT_BAD, got);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, strncmp(error.text, "take3.pgm: ", 11), error.text);
    } else {
        TEST_ASSERT_EQUAL_INT(HAL_NEXT_FRAME, got);
        TEST_ASSERT_EQUAL_INT('x', *(const char *)frame.samples);
        camera->release(camera->context, &frame);
    }
}

static void test_frames_come_at_their_own_times(void)
{
    struct hal_frame frame;
    open_with(0, false);
    assert_due(5000000, 0, 0, 1000);
    assert_due(5030000, 1, 1, 31000);
    assert_due(5530000, 2, 2, 10031000); /* a gap is waited for no longer than this */
    TEST_ASSERT_EQUAL_INT64(5530000, timer_us);
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_BAD, next(&frame));
    now += HAL_REPLAY_STEP_US;
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_END, next(&frame));
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_END, next(&frame));
    TEST_ASSERT_EQUAL_INT(0, log_count);
    /* (30 + 500 + 0 + 40) / 4 */
    TEST_ASSERT_EQUAL_INT32(142500, camera->frame_time_us(camera->context));
}

static void test_again_and_again_at_a_rate(void)
{
    const int64_t pass_us = 10031000 + HAL_REPLAY_STEP_US - 1000;
    open_with(50000, true);
    TEST_ASSERT_EQUAL_INT32(20000, camera->frame_time_us(camera->context));
    for (int64_t i = 0; i < 5 * COUNT; i++) {
        assert_due(5000000 + 20000 * i, (int)(i % COUNT), i,
                   times_us[i % COUNT] + i / COUNT * pass_us);
    }
}

/* Who takes frames late gets every one, each a step after the one before. */
static void test_a_frame_waits_until_it_is_taken(void)
{
    struct hal_frame frame;
    open_with(50000, true);
    for (int64_t i = 0; i < COUNT - 1; i++) {
        now += 1000000;
        TEST_ASSERT_EQUAL_INT(HAL_NEXT_FRAME, next(&frame));
        TEST_ASSERT_EQUAL_INT64(i, frame.sequence);
        TEST_ASSERT_EQUAL_INT64(now, timer_us);
        camera->release(camera->context, &frame);
    }
}

static void test_no_more_frames_are_out_than_may_be(void)
{
    struct hal_frame frames[HAL_CAMERA_HOLD_MAX + 1], more;
    open_with(1000000, true);
    for (int i = 0; i < HAL_CAMERA_HOLD_MAX + 1; i++) {
        TEST_ASSERT_EQUAL_INT(HAL_NEXT_FRAME, next(&frames[i]));
        now += 1000;
    }
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_NONE, next(&more));
    TEST_ASSERT_EQUAL_STRING("000000.pgm", frames[0].name); /* not another's */
    for (int i = 0; i < HAL_CAMERA_HOLD_MAX + 1; i++) {
        camera->release(camera->context, &frames[i]);
    }
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_BAD, next(&more));
    TEST_ASSERT_FALSE(camera->set_exposure(camera->context, 4000, &error));
}

static void test_a_timer_that_fails(void)
{
    struct hal_frame frame;
    open_with(0, true);
    set_fails = true;
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_GONE, next(&frame)); /* and the frame is not leaked */
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "timer"), error.text);
    TEST_ASSERT_FALSE(camera->open(camera->context, &error));
    TEST_ASSERT_EQUAL_INT(-1, directory.fd);
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_GONE, next(&frame));
    set_fails = false, create_fails = true;
    TEST_ASSERT_FALSE(camera->open(camera->context, &error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, strerror(EMFILE)), error.text);
    create_fails = false;
    TEST_ASSERT_TRUE(camera->open(camera->context, &error));
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_FRAME, next(&frame)); /* goes on behind the one that was lost */
    TEST_ASSERT_EQUAL_INT64(1, frame.sequence);
    camera->release(camera->context, &frame);
}

/* 2^53 us a pass: before times overflow they start anew. */
static void test_times_do_not_overflow(void)
{
    struct hal_frame frame;
    int64_t last_us = 0;
    int back_count = 0;
    make_file(LIST, "{\"file\":\"take0.pgm\",\"time_us\":-9007199254740992}\n"
                    "{\"file\":\"take1.pgm\",\"time_us\":9007199254740992}\n");
    open_with(0, true);
    for (int i = 0; i < 4 * 600; i++) {
        now += HAL_DIRECTORY_STEP_MAX_US;
        if (next(&frame) == HAL_NEXT_FRAME) {
            back_count += frame.time_us < last_us;
            last_us = frame.time_us;
            camera->release(camera->context, &frame);
        }
    }
    TEST_ASSERT_LESS_OR_EQUAL_INT(8, back_count);
    make_files();
}

static void test_what_is_no_directory_with_frames(void)
{
    const struct hal_directory_config config = {"/nowhere", 0, false};
    TEST_ASSERT_FALSE(hal_directory_init(&directory, &config, &messages, &error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, strerror(ENOENT)), error.text);
}

int main(void)
{
    TEST_ASSERT_NOT_NULL(mkdtemp(dir));
    make_files();
    UNITY_BEGIN();
    RUN_TEST(test_frames_come_at_their_own_times);
    RUN_TEST(test_again_and_again_at_a_rate);
    RUN_TEST(test_a_frame_waits_until_it_is_taken);
    RUN_TEST(test_no_more_frames_are_out_than_may_be);
    RUN_TEST(test_a_timer_that_fails);
    RUN_TEST(test_times_do_not_overflow);
    RUN_TEST(test_what_is_no_directory_with_frames);
    int failures = UNITY_END();
    char command[64];
    snprintf(command, sizeof command, "rm -r %s", dir);
    return system(command) != 0 || failures != 0;
}
