#include "linux/hal_watchdog.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <linux/watchdog.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

/* A socket that sends to systemd's; its name begins with '/', or with '@' when it has no file. */
static bool connect_notify(int *fd, const char *name, struct hal_error *error)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    size_t length = strlen(name);
    if ((name[0] != '/' && name[0] != '@') || length < 2 || length >= sizeof address.sun_path) {
        return hal_fail(error,
                        "NOTIFY_SOCKET: '%.120s', expected a path or @name of at most %zu bytes",
                        name, sizeof address.sun_path - 1);
    }
    memcpy(address.sun_path, name, length);
    if (name[0] == '@') {
        address.sun_path[0] = 0;
    }
    *fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (*fd < 0 || connect(*fd, (const struct sockaddr *)&address,
                           (socklen_t)(offsetof(struct sockaddr_un, sun_path) + length)) != 0) {
        return hal_fail(error, "NOTIFY_SOCKET: '%.120s': %s", name, strerror(errno));
    }
    return true;
}

/* A positive number, or false. */
static bool read_number(const char *text, int64_t *value)
{
    char *end = NULL;
    errno = 0;
    *value = strtoll(text, &end, 10);
    return errno == 0 && end != text && *end == 0 && *value > 0;
}

/* Are signs of life expected, and how often? */
static bool read_period(struct hal_watchdog_feeder *feeder, struct hal_error *error)
{
    const char *period = getenv("WATCHDOG_USEC");
    const char *whose = getenv("WATCHDOG_PID");
    int64_t period_us = 0, pid = getpid();
    if (period == NULL) {
        return true;
    }
    if (!read_number(period, &period_us)) {
        return hal_fail(error, "WATCHDOG_USEC: '%.40s', expected a number of microseconds", period);
    }
    if (whose != NULL && !read_number(whose, &pid)) {
        return hal_fail(error, "WATCHDOG_PID: '%.40s', expected a process number", whose);
    }
    feeder->is_life_needed = pid == getpid();
    feeder->notify.step_us = period_us / 2;
    return true;
}

static bool open_notify(struct hal_watchdog_feeder *feeder, struct hal_error *error)
{
    const char *name = getenv("NOTIFY_SOCKET");
    if (name == NULL) {
        return true;
    }
    if (!connect_notify(&feeder->notify_fd, name, error) || !read_period(feeder, error)) {
        return false;
    }
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
    unsetenv("WATCHDOG_PID");
    return true;
}

/* Its time is set, and what it says of it afterwards counts. */
static bool set_time(int fd, const char *path, struct hal_error *unproven, struct hal_error *error)
{
    int wanted_s = HAL_WATCHDOG_TIMEOUT_S, time_s = 0;
    bool is_set = ioctl(fd, WDIOC_SETTIMEOUT, &wanted_s) == 0;
    if (ioctl(fd, WDIOC_GETTIMEOUT, &time_s) != 0) {
        hal_fail(unproven, "watchdog: '%.80s' does not say when it resets", path);
    } else if ((int64_t)time_s * 1000000 < 2 * HAL_WATCHDOG_STEP_US) {
        return hal_fail(error, "'%.120s' resets after %d s, expected %d", path, time_s,
                        HAL_WATCHDOG_TIMEOUT_S);
    } else if (!is_set || time_s != HAL_WATCHDOG_TIMEOUT_S) {
        hal_fail(unproven, "watchdog: '%.80s' resets after %d s, requested %d", path, time_s,
                 HAL_WATCHDOG_TIMEOUT_S);
    }
    return true;
}

static bool open_device(struct hal_watchdog_feeder *feeder, struct hal_error *unproven,
                        struct hal_error *error)
{
    const char *path = feeder->config.path;
    if (path == NULL) {
        return true;
    }
    feeder->device_fd = open(path, O_WRONLY | O_CLOEXEC | O_NONBLOCK);
    if (feeder->device_fd < 0) {
        return hal_fail(error, "'%.120s': %s; expected a device like /dev/watchdog", path,
                        strerror(errno));
    }
    return set_time(feeder->device_fd, path, unproven, error);
}

/* Is the next feed due? */
static bool is_due(const struct hal_watchdog_schedule *schedule, int64_t now_us)
{
    return now_us >= schedule->next_us;
}

static void schedule_next(struct hal_watchdog_schedule *schedule, int64_t now_us)
{
    schedule->next_us = now_us + schedule->step_us;
}

static bool feed_notify(struct hal_watchdog_feeder *feeder, int64_t now_us, struct hal_error *error)
{
    const char *text = feeder->ready ? "WATCHDOG=1" : "READY=1";
    if (feeder->notify_fd < 0 || (feeder->ready && !feeder->is_life_needed) ||
        !is_due(&feeder->notify, now_us)) {
        return true;
    }
    if (send(feeder->notify_fd, text, strlen(text), MSG_NOSIGNAL) < 0) {
        return errno == EAGAIN || errno == ENOBUFS ||
               hal_fail(error, "NOTIFY_SOCKET: cannot send to it: %s", strerror(errno));
    }
    feeder->ready = true;
    schedule_next(&feeder->notify, now_us);
    return true;
}

static bool feed_device(struct hal_watchdog_feeder *feeder, int64_t now_us, struct hal_error *error)
{
    if (feeder->device_fd < 0 || !is_due(&feeder->device, now_us)) {
        return true;
    }
    if (write(feeder->device_fd, "", 1) != 1) {
        return hal_fail(error, "'%.120s' cannot be written: %s", feeder->config.path,
                        strerror(errno));
    }
    schedule_next(&feeder->device, now_us);
    return true;
}

static bool feed_guard(struct hal_watchdog_feeder *feeder, int64_t now_us, struct hal_error *error)
{
    if (feeder->config.guard == NULL || !is_due(&feeder->guard, now_us)) {
        return true;
    }
    if (!hal_guard_feed(feeder->config.guard, error)) {
        return false;
    }
    schedule_next(&feeder->guard, now_us);
    return true;
}

static bool watchdog_feed(void *context, struct hal_error *error)
{
    struct hal_watchdog_feeder *feeder = context;
    const struct hal_clock *clock = feeder->config.clock;
    int64_t now_us = clock->now_us(clock->context);
    struct hal_error ignored;
    if (!feed_guard(feeder, now_us, error)) {
        return false;
    }
    bool device_fed = feed_device(feeder, now_us, error);
    return feed_notify(feeder, now_us, device_fed ? error : &ignored) && device_fed;
}

/* A guard with a short timeout needs a feed more often than the others. */
static int64_t guard_step_us(const struct hal_guard *guard)
{
    int64_t quarter_us = guard == NULL ? INT64_MAX : (int64_t)guard->config.timeout_ms * 250;
    return quarter_us < HAL_WATCHDOG_STEP_US ? quarter_us : HAL_WATCHDOG_STEP_US;
}

static void close_all(struct hal_watchdog_feeder *feeder)
{
    if (feeder->notify_fd >= 0) {
        close(feeder->notify_fd);
    }
    if (feeder->device_fd >= 0) {
        close(feeder->device_fd);
    }
    feeder->notify_fd = feeder->device_fd = -1;
}

bool hal_watchdog_open(struct hal_watchdog_feeder *feeder, const struct hal_watchdog_config *config,
                       struct hal_error *unproven, struct hal_error *error)
{
    unproven->text[0] = 0;
    *feeder = (struct hal_watchdog_feeder){.watchdog = {feeder, watchdog_feed},
                                           .config = *config,
                                           .device_fd = -1,
                                           .notify_fd = -1,
                                           .device = {HAL_WATCHDOG_STEP_US, INT64_MIN},
                                           .notify = {0, INT64_MIN},
                                           .guard = {guard_step_us(config->guard), INT64_MIN}};
    /* The device last: it runs from its opening on. */
    if (!open_notify(feeder, error) || !open_device(feeder, unproven, error)) {
        close_all(feeder);
        return false;
    }
    return true;
}

void hal_watchdog_close(struct hal_watchdog_feeder *feeder, bool may_be_on)
{
    static const char stopping[] = "STOPPING=1";
    if (feeder->notify_fd >= 0) {
        /* Nobody to hear it: nothing is lost, the end is seen anyway. */
        (void)send(feeder->notify_fd, stopping, sizeof stopping - 1, MSG_NOSIGNAL);
    }
    if (feeder->device_fd >= 0 && !may_be_on && write(feeder->device_fd, "V", 1) != 1) {
        /* The device then resets the machine, as it is there to do. */
    }
    close_all(feeder);
}
