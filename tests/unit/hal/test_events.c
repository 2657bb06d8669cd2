/* Waiting, with pipes in place of the camera and the interlock and with real signals. */
#include <signal.h>
#include <sys/signalfd.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include "ih_test.h"
#include "../app/app_terminal.h"
#include "linux/hal_clock.h"
#include "linux/hal_events.h"

static int camera[2], interlock[2]; /* pipes: what is written to [1] is to be read from [0] */
static int camera_fd, interlock_fd, signal_fd;
static struct hal_event_source source;
static struct hal_error error;

void setUp(void)
{
    const struct hal_events_config config = {.camera_fd = &camera_fd,
                                             .interlock_fd = &interlock_fd,
                                             .signal_fd = &signal_fd,
                                             .terminal_fd = -1};
    sigset_t set;

    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGHUP);
    sigprocmask(SIG_BLOCK, &set, NULL);
    signal_fd = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
    TEST_ASSERT_TRUE(signal_fd >= 0 && pipe(camera) == 0 && pipe(interlock) == 0);
    camera_fd = camera[0];
    interlock_fd = interlock[0];
    hal_events_init(&source, &config);
}

static void close_once(int *fd)
{
    if (*fd >= 0) {
        close(*fd);
    }
    *fd = -1;
}

void tearDown(void)
{
    close_once(&camera[0]);
    close_once(&camera[1]);
    close_once(&interlock[0]);
    close_once(&interlock[1]);
    close_once(&signal_fd);
}

static unsigned wait_us(int64_t timeout_us)
{
    unsigned events = ~0u;

    TEST_ASSERT_TRUE_MESSAGE(source.events.wait(source.events.context, timeout_us, &events, &error),
                             error.text);
    return events;
}

static void make_readable(int fd)
{
    TEST_ASSERT_EQUAL_INT(1, write(fd, "x", 1));
}

static void take(int fd)
{
    char byte;

    TEST_ASSERT_EQUAL_INT(1, read(fd, &byte, 1));
}

static int64_t now_us(void)
{
    return hal_clock.now_us(hal_clock.context);
}

static void nothing_happens_until_the_time_is_over(void)
{
    const int64_t before_us = now_us();

    TEST_ASSERT_EQUAL_UINT(0, wait_us(30000));
    TEST_ASSERT_TRUE(now_us() - before_us >= 30000);
    TEST_ASSERT_EQUAL_UINT(0, wait_us(0));
}

/* An hour: the test would not end if this waited. */
static void each_thing_is_its_event(void)
{
    const int64_t hour_us = INT64_C(3600) * 1000 * 1000;

    make_readable(camera[1]);
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_FRAME, wait_us(hour_us));
    take(camera[0]);
    make_readable(interlock[1]);
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_INTERLOCK, wait_us(hour_us));
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_INTERLOCK, wait_us(hour_us));
    take(interlock[0]);
    kill(getpid(), SIGTERM);
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_STOP, wait_us(hour_us));
    kill(getpid(), SIGINT);
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_STOP, wait_us(hour_us));
    kill(getpid(), SIGHUP);
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_RELOAD, wait_us(hour_us));
    TEST_ASSERT_EQUAL_UINT(0, wait_us(0));
}

/* SIGHUP of a terminal that is there is somebody's request; of one that is gone it says so. */
static void a_lost_terminal_stops(void)
{
    int master = terminal_open();
    int terminal = open(ptsname(master), O_RDWR | O_NOCTTY);

    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, terminal);
    source.config.terminal_fd = terminal;
    kill(getpid(), SIGHUP);
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_RELOAD, wait_us(0));
    close(master);
    kill(getpid(), SIGHUP);
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_STOP, wait_us(0));
    close(terminal);
}

static void all_at_once_are_reported_at_once(void)
{
    make_readable(camera[1]);
    make_readable(interlock[1]);
    kill(getpid(), SIGTERM);
    kill(getpid(), SIGINT);
    kill(getpid(), SIGHUP);
    kill(getpid(), SIGHUP);
    TEST_ASSERT_EQUAL_UINT(
        HAL_EVENT_FRAME | HAL_EVENT_INTERLOCK | HAL_EVENT_STOP | HAL_EVENT_RELOAD, wait_us(0));
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_FRAME | HAL_EVENT_INTERLOCK, wait_us(0));
}

static void what_is_closed_is_not_waited_for(void)
{
    make_readable(camera[1]);
    make_readable(interlock[1]);
    camera_fd = -1;
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_INTERLOCK, wait_us(0));
    interlock_fd = -1;
    TEST_ASSERT_EQUAL_UINT(0, wait_us(0));
    camera_fd = camera[0];
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_FRAME, wait_us(0));
}

/* A pipe's writing end whose reader is gone says POLLERR, a reading end without a writer POLLHUP, a
 * number that is not open POLLNVAL. */
static void errors_are_events(void)
{
    close_once(&camera[0]);
    camera_fd = camera[1];
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_FRAME, wait_us(0));
    close_once(&interlock[1]);
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_FRAME | HAL_EVENT_INTERLOCK, wait_us(0));
    close_once(&camera[1]);
    interlock_fd = -1;
    TEST_ASSERT_EQUAL_UINT(HAL_EVENT_FRAME, wait_us(0));
    camera_fd = -1;
    TEST_ASSERT_EQUAL_UINT(0, wait_us(0));
}

static void ignore(int number)
{
    (void)number;
}

static void interrupted_it_waits_for_the_rest(void)
{
    const struct sigaction action = {.sa_handler = ignore};
    const struct itimerval often = {{0, 5000}, {0, 5000}}, never = {{0, 0}, {0, 0}};
    int64_t before_us;

    sigaction(SIGALRM, &action, NULL);
    setitimer(ITIMER_REAL, &often, NULL);
    before_us = now_us();
    TEST_ASSERT_EQUAL_UINT(0, wait_us(60000));
    TEST_ASSERT_TRUE(now_us() - before_us >= 60000);
    setitimer(ITIMER_REAL, &never, NULL);
}

static void signals_that_cannot_be_read_are_an_error(void)
{
    unsigned events;
    const int fd = signal_fd;

    close_once(&signal_fd);
    signal_fd = fd;
    TEST_ASSERT_FALSE(source.events.wait(source.events.context, 0, &events, &error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "signals: cannot be read"), error.text);
    signal_fd = -1;
}

static void the_clock_is_the_cameras(void)
{
    struct timespec before, after;
    int64_t now;

    clock_gettime(CLOCK_MONOTONIC, &before);
    now = now_us();
    clock_gettime(CLOCK_MONOTONIC, &after);
    TEST_ASSERT_TRUE(now >= (int64_t)before.tv_sec * 1000000 + before.tv_nsec / 1000);
    TEST_ASSERT_TRUE(now <= (int64_t)after.tv_sec * 1000000 + after.tv_nsec / 1000);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(nothing_happens_until_the_time_is_over);
    RUN_TEST(each_thing_is_its_event);
    RUN_TEST(a_lost_terminal_stops);
    RUN_TEST(all_at_once_are_reported_at_once);
    RUN_TEST(what_is_closed_is_not_waited_for);
    RUN_TEST(errors_are_events);
    RUN_TEST(interrupted_it_waits_for_the_rest);
    RUN_TEST(signals_that_cannot_be_read_are_an_error);
    RUN_TEST(the_clock_is_the_cameras);
    return UNITY_END();
}
