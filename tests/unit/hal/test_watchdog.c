/* Feeding: a real datagram socket in systemd's place, a pipe as the device, a socket as the guard, and
 * a clock that the test moves. */
#include <errno.h>
#include <linux/watchdog.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <fcntl.h>
#include <unistd.h>

#include "ih_test.h"
#include "linux/hal_watchdog.h"

static char folder[] = "/tmp/isohead_watchdog_XXXXXX";
static char socket_path[64], device_path[64];
static int systemd_fd = -1, device_fd = -1;
static int guard_ends[2];
static struct hal_guard guard;
static struct hal_watchdog_feeder feeder;
static struct hal_error error, unproven;
static int64_t time_us;
/* The device's answers. */
static struct {
    bool has_time, can_be_set;
    int time_s, min_s, max_s;
} dog;

static int64_t now_us(void *context)
{
    (void)context;
    return time_us;
}

static const struct hal_clock test_clock = {.now_us = now_us};

/* The kernel's own call. */
int ioctl(int fd, unsigned long request, ...)
{
    va_list arguments;
    va_start(arguments, request);
    int *value = va_arg(arguments, int *);
    va_end(arguments);
    TEST_ASSERT_EQUAL_INT(feeder.device_fd, fd);
    if (request == WDIOC_SETTIMEOUT && dog.can_be_set) {
        dog.time_s = *value < dog.min_s ? dog.min_s : *value > dog.max_s ? dog.max_s : *value;
        *value = dog.time_s;
        return 0;
    }
    if (request == WDIOC_GETTIMEOUT && dog.has_time) {
        *value = dog.time_s;
        return 0;
    }
    errno = ENOTTY;
    return -1;
}

/* name: with '@' for a socket without a file. */
static void be_systemd(const char *name)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};

    memcpy(address.sun_path, name, strlen(name));
    if (name[0] == '@') {
        address.sun_path[0] = 0;
    }
    systemd_fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    TEST_ASSERT_EQUAL_INT(0,
                          bind(systemd_fd, (struct sockaddr *)&address,
                               (socklen_t)(offsetof(struct sockaddr_un, sun_path) + strlen(name))));
    setenv("NOTIFY_SOCKET", name, 1);
}

/* What was received: one datagram, or "". */
static const char *heard(void)
{
    static char text[256];
    const ssize_t length = recv(systemd_fd, text, sizeof text - 1, 0);

    text[length < 0 ? 0 : length] = 0;
    return text;
}

/* All bytes that have come, as a count; the last one to *last. */
static int bytes_from(int fd, char *last)
{
    char bytes[256];
    const ssize_t count = read(fd, bytes, sizeof bytes);

    if (count <= 0) {
        return 0;
    }
    *last = bytes[count - 1];
    return (int)count;
}

static bool open_with(const char *path, struct hal_guard *guarded)
{
    const struct hal_watchdog_config config = {
        .path = path, .guard = guarded, .clock = &test_clock};

    return hal_watchdog_open(&feeder, &config, &unproven, &error);
}

static bool feed(void)
{
    return feeder.watchdog.feed(feeder.watchdog.context, &error);
}

void setUp(void)
{
    const struct hal_guard_config config = {.timeout_ms = 2000};

    time_us = 1000000;
    dog.has_time = dog.can_be_set = true;
    dog.time_s = 60;
    dog.min_s = 1;
    dog.max_s = 60;
    memset(&error, 0, sizeof error);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
    TEST_ASSERT_EQUAL_INT(0, mkfifo(device_path, 0600));
    device_fd = open(device_path, O_RDONLY | O_NONBLOCK);
    TEST_ASSERT_EQUAL_INT(0, socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, guard_ends));
    hal_guard_init(&guard, &config);
    guard.process[0].socket_fd = guard_ends[0]; /* one of them is enough here */
    feeder.notify_fd = feeder.device_fd = -1;
}

void tearDown(void)
{
    hal_watchdog_close(&feeder, false);
    close(device_fd);
    unlink(device_path);
    close(guard_ends[0]);
    if (guard_ends[1] >= 0) {
        close(guard_ends[1]);
    }
    if (systemd_fd >= 0) {
        close(systemd_fd);
        unlink(socket_path);
    }
    systemd_fd = -1;
}

static void with_nothing_to_tell_nothing_happens(void)
{
    TEST_ASSERT_TRUE(open_with(NULL, NULL));
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_TRUE(feed());
}

static void systemd_hears_of_the_beginning_life_and_the_end(const char *name)
{
    be_systemd(name);
    setenv("WATCHDOG_USEC", "3000000", 1);
    TEST_ASSERT_TRUE_MESSAGE(open_with(NULL, NULL), error.text);
    TEST_ASSERT_EQUAL_STRING("", heard());
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_STRING("READY=1", heard());
    time_us += 1499999;
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_STRING("", heard());
    time_us += 1;
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_STRING("WATCHDOG=1", heard());
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_STRING("", heard());
    time_us += 1500000;
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_STRING("WATCHDOG=1", heard());
    hal_watchdog_close(&feeder, false);
    TEST_ASSERT_EQUAL_STRING("STOPPING=1", heard());
    hal_watchdog_close(&feeder, false);
    TEST_ASSERT_EQUAL_STRING("", heard());
}

static void systemd_behind_a_path(void)
{
    systemd_hears_of_the_beginning_life_and_the_end(socket_path);
}

static void systemd_behind_an_abstract_name(void)
{
    char name[64];

    snprintf(name, sizeof name, "@isohead/test/%d", (int)getpid());
    systemd_hears_of_the_beginning_life_and_the_end(name);
}

static void signs_of_life_are_sent_only_where_expected(void)
{
    int i;

    for (i = 0; i < 2; i++) {
        be_systemd(socket_path);
        if (i == 1) {
            setenv("WATCHDOG_USEC", "2", 1);
            setenv("WATCHDOG_PID", "1", 1);
        }
        TEST_ASSERT_TRUE(open_with(NULL, NULL));
        TEST_ASSERT_TRUE(feed());
        TEST_ASSERT_EQUAL_STRING("READY=1", heard());
        time_us += 1000000;
        TEST_ASSERT_TRUE(feed());
        TEST_ASSERT_EQUAL_STRING("", heard());
        hal_watchdog_close(&feeder, false);
        close(systemd_fd);
        unlink(socket_path);
    }
    systemd_fd = -1;
}

static void this_process_is_meant_by_its_number(void)
{
    char number[32];

    be_systemd(socket_path);
    snprintf(number, sizeof number, "%d", (int)getpid());
    setenv("WATCHDOG_USEC", "2000", 1);
    setenv("WATCHDOG_PID", number, 1);
    TEST_ASSERT_TRUE(open_with(NULL, NULL));
    TEST_ASSERT_NULL(getenv("NOTIFY_SOCKET"));
    TEST_ASSERT_NULL(getenv("WATCHDOG_USEC"));
    TEST_ASSERT_NULL(getenv("WATCHDOG_PID"));
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_STRING("READY=1", heard());
    time_us += 1000;
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_STRING("WATCHDOG=1", heard());
}

static void a_full_socket_is_tried_again(void)
{
    int i, heard_count = 0, ready_count = 0;

    be_systemd(socket_path);
    setenv("WATCHDOG_USEC", "2", 1);
    TEST_ASSERT_TRUE(open_with(NULL, NULL));
    for (i = 0; i < 3000; i++) {
        time_us += 1;
        TEST_ASSERT_TRUE(feed());
    }
    for (const char *text = heard(); text[0] != 0; text = heard()) {
        heard_count++;
        ready_count += strcmp(text, "READY=1") == 0;
    }
    TEST_ASSERT_TRUE(heard_count > 0 && heard_count < 3000);
    TEST_ASSERT_EQUAL_INT(1, ready_count);
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_STRING("WATCHDOG=1", heard());
}

static void systemd_gone_is_an_error(void)
{
    be_systemd(socket_path);
    TEST_ASSERT_TRUE(open_with(NULL, NULL));
    close(systemd_fd);
    systemd_fd = -1;
    TEST_ASSERT_FALSE(feed());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "NOTIFY_SOCKET"), error.text);
    unlink(socket_path);
}

static void refused(const char *variable, const char *value)
{
    setenv(variable, value, 1);
    TEST_ASSERT_FALSE_MESSAGE(open_with(device_path, NULL), value);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, variable), error.text);
    TEST_ASSERT_EQUAL_INT(-1, feeder.notify_fd);
    TEST_ASSERT_EQUAL_INT(-1, feeder.device_fd);
}

static void wrong_variables_are_refused(void)
{
    char name[256];

    memset(name, 'x', sizeof name - 1);
    name[sizeof name - 1] = 0;
    refused("NOTIFY_SOCKET", "");
    refused("NOTIFY_SOCKET", "@");
    refused("NOTIFY_SOCKET", "vsock:2:1234");
    refused("NOTIFY_SOCKET", "/nowhere/at/all");
    name[0] = '/';
    refused("NOTIFY_SOCKET", name);
    be_systemd(socket_path);
    refused("WATCHDOG_USEC", "");
    refused("WATCHDOG_USEC", "0");
    refused("WATCHDOG_USEC", "-5");
    refused("WATCHDOG_USEC", "10s");
    refused("WATCHDOG_USEC", "99999999999999999999");
    setenv("WATCHDOG_USEC", "1000", 1);
    refused("WATCHDOG_PID", "me");
}

static void the_device_is_fed_at_times_and_stopped_at_the_end(void)
{
    char last = 0;

    TEST_ASSERT_TRUE_MESSAGE(open_with(device_path, NULL), error.text);
    TEST_ASSERT_EQUAL_INT(0, bytes_from(device_fd, &last));
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_INT(1, bytes_from(device_fd, &last));
    TEST_ASSERT_TRUE(last != 'V');
    time_us += HAL_WATCHDOG_STEP_US - 1;
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_INT(0, bytes_from(device_fd, &last));
    time_us += 1;
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_INT(1, bytes_from(device_fd, &last));
    TEST_ASSERT_TRUE(last != 'V');
    hal_watchdog_close(&feeder, false);
    TEST_ASSERT_EQUAL_INT(1, bytes_from(device_fd, &last));
    TEST_ASSERT_EQUAL_INT('V', last);
}

/* A kernel that hangs keeps the light on for as long: not for the driver's default. */
static void the_devices_time_is_set_and_read_back(void)
{
    TEST_ASSERT_TRUE_MESSAGE(open_with(device_path, NULL), error.text);
    TEST_ASSERT_EQUAL_INT(HAL_WATCHDOG_TIMEOUT_S, dog.time_s);
    TEST_ASSERT_EQUAL_STRING("", unproven.text);
}

/* Rounded by the driver, fixed, or unknown: the program says so. Too short for the feeds: an error. */
static void a_time_that_is_not_as_requested_is_reported(void)
{
    dog.min_s = 16;
    TEST_ASSERT_TRUE(open_with(device_path, NULL));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(unproven.text, "resets after 16 s, requested 10"),
                                 unproven.text);
    hal_watchdog_close(&feeder, false);
    dog.can_be_set = false;
    dog.time_s = 30;
    TEST_ASSERT_TRUE(open_with(device_path, NULL));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(unproven.text, "resets after 30 s, requested 10"),
                                 unproven.text);
    hal_watchdog_close(&feeder, false);
    dog.has_time = false;
    TEST_ASSERT_TRUE(open_with(device_path, NULL));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(unproven.text, "does not say when it resets"),
                                 unproven.text);
    hal_watchdog_close(&feeder, false);
    dog.has_time = true;
    dog.time_s = 0;
    TEST_ASSERT_FALSE(open_with(device_path, NULL));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "resets after 0 s"), error.text);
    TEST_ASSERT_EQUAL_INT(-1, feeder.device_fd);
}

/* The laser may be on: what resets the machine goes on counting. */
static void with_the_laser_on_the_device_is_not_stopped(void)
{
    char last = 0;

    TEST_ASSERT_TRUE(open_with(device_path, NULL));
    TEST_ASSERT_TRUE(feed());
    TEST_ASSERT_EQUAL_INT(1, bytes_from(device_fd, &last));
    hal_watchdog_close(&feeder, true);
    TEST_ASSERT_EQUAL_INT(0, bytes_from(device_fd, &last));
}

static void a_device_that_is_not_there_is_reported(void)
{
    be_systemd(socket_path);
    TEST_ASSERT_FALSE(open_with("/nowhere/watchdog", NULL));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "'/nowhere/watchdog': No such file"),
                                 error.text);
    TEST_ASSERT_EQUAL_INT(-1, feeder.notify_fd);
}

/* The guard is fed all the same; without it nobody is. */
static void without_the_guard_nobody_is_fed(void)
{
    char last = 0;

    be_systemd(socket_path);
    TEST_ASSERT_TRUE(open_with("/dev/full", &guard));
    TEST_ASSERT_FALSE(feed());
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "'/dev/full' cannot be written: No space"),
                                 error.text);
    TEST_ASSERT_EQUAL_STRING("READY=1", heard());
    TEST_ASSERT_EQUAL_INT(1, bytes_from(guard_ends[1], &last));
    hal_watchdog_close(&feeder, false);
    setenv("NOTIFY_SOCKET", socket_path, 1);
    TEST_ASSERT_TRUE(open_with(device_path, &guard));
    close(guard_ends[1]);
    guard_ends[1] = -1;
    for (int i = 0; i < 2; i++) {
        TEST_ASSERT_FALSE(feed());
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "guard:"), error.text);
        TEST_ASSERT_EQUAL_INT(0, bytes_from(device_fd, &last));
    }
    TEST_ASSERT_EQUAL_STRING("STOPPING=1", heard()); /* of the first */
    TEST_ASSERT_EQUAL_STRING("", heard());
}

static void the_guard_is_fed_four_times_per_timeout_at_least(void)
{
    static const int timeouts_ms[] = {2000, 1600, 100, 1};
    int i;

    for (i = 0; i < IH_TEST_COUNT(timeouts_ms); i++) {
        const int64_t quarter_us = timeouts_ms[i] * 250;
        const int64_t step_us =
            quarter_us < HAL_WATCHDOG_STEP_US ? quarter_us : HAL_WATCHDOG_STEP_US;
        char last = 0;

        guard.config.timeout_ms = timeouts_ms[i];
        TEST_ASSERT_TRUE(open_with(NULL, &guard));
        TEST_ASSERT_TRUE(feed());
        TEST_ASSERT_EQUAL_INT(1, bytes_from(guard_ends[1], &last));
        time_us += step_us - 1;
        TEST_ASSERT_TRUE(feed());
        TEST_ASSERT_EQUAL_INT(0, bytes_from(guard_ends[1], &last));
        time_us += 1;
        TEST_ASSERT_TRUE(feed());
        TEST_ASSERT_EQUAL_INT(1, bytes_from(guard_ends[1], &last));
        hal_watchdog_close(&feeder, false);
    }
}

int main(void)
{
    int result;

    if (mkdtemp(folder) == NULL) {
        return 1;
    }
    snprintf(socket_path, sizeof socket_path, "%s/notify", folder);
    snprintf(device_path, sizeof device_path, "%s/device", folder);
    UNITY_BEGIN();
    RUN_TEST(with_nothing_to_tell_nothing_happens);
    RUN_TEST(systemd_behind_a_path);
    RUN_TEST(systemd_behind_an_abstract_name);
    RUN_TEST(signs_of_life_are_sent_only_where_expected);
    RUN_TEST(this_process_is_meant_by_its_number);
    RUN_TEST(a_full_socket_is_tried_again);
    RUN_TEST(systemd_gone_is_an_error);
    RUN_TEST(wrong_variables_are_refused);
    RUN_TEST(the_device_is_fed_at_times_and_stopped_at_the_end);
    RUN_TEST(a_device_that_is_not_there_is_reported);
    RUN_TEST(the_devices_time_is_set_and_read_back);
    RUN_TEST(a_time_that_is_not_as_requested_is_reported);
    RUN_TEST(with_the_laser_on_the_device_is_not_stopped);
    RUN_TEST(without_the_guard_nobody_is_fed);
    RUN_TEST(the_guard_is_fed_four_times_per_timeout_at_least);
    result = UNITY_END();
    rmdir(folder);
    return result;
}
