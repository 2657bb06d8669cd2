#include "linux/hal_events.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "linux/hal_clock.h"

static unsigned event_of(const struct hal_events_config *config, uint32_t signal)
{
    switch (signal) {
    case SIGHUP:
        return config->terminal_fd >= 0 && isatty(config->terminal_fd) != 1 ? HAL_EVENT_STOP
                                                                            : HAL_EVENT_RELOAD;
    case SIGUSR1:
        return HAL_EVENT_RECORD;
    default:
        return HAL_EVENT_STOP;
    }
}

/* All signals that are there become events. */
static bool read_signals(const struct hal_events_config *config, unsigned *events,
                         struct hal_error *error)
{
    for (;;) {
        struct signalfd_siginfo info;
        ssize_t count = read(*config->signal_fd, &info, sizeof info);
        if (count == (ssize_t)sizeof info) {
            *events |= event_of(config, info.ssi_signo);
        } else if (count < 0 && errno == EAGAIN) {
            return true;
        } else if (count >= 0 || errno != EINTR) {
            return hal_fail(error, "signals: cannot be read: %s",
                            count < 0 ? strerror(errno) : "an incomplete record");
        }
    }
}

/* ppoll for what is left of the time, again and again when it is interrupted. */
static int poll_until(struct pollfd *waiting, nfds_t count, int64_t end_us)
{
    for (;;) {
        int64_t left_us = end_us - hal_clock.now_us(hal_clock.context);
        left_us = left_us < 0 ? 0 : left_us;
        struct timespec left = {.tv_sec = (time_t)(left_us / 1000000),
                                .tv_nsec = (long)(left_us % 1000000 * 1000)};
        int ready = ppoll(waiting, count, &left, NULL);
        if (ready >= 0 || errno != EINTR) {
            return ready;
        }
    }
}

static bool events_wait(void *context, int64_t timeout_us, unsigned *events,
                        struct hal_error *error)
{
    const struct hal_events_config *config = &((struct hal_event_source *)context)->config;
    struct pollfd waiting[] = {{.fd = *config->camera_fd, .events = POLLIN},
                               {.fd = *config->interlock_fd, .events = POLLIN},
                               {.fd = *config->signal_fd, .events = POLLIN}};
    *events = 0;
    if (poll_until(waiting, 3, hal_clock.now_us(hal_clock.context) + timeout_us) < 0) {
        return hal_fail(error, "events: cannot wait: %s", strerror(errno));
    }
    if (waiting[0].revents != 0) {
        *events |= HAL_EVENT_FRAME;
    }
    if (waiting[1].revents != 0) {
        *events |= HAL_EVENT_INTERLOCK;
    }
    return waiting[2].revents == 0 || read_signals(config, events, error);
}

void hal_events_init(struct hal_event_source *source, const struct hal_events_config *config)
{
    *source = (struct hal_event_source){.events = {source, events_wait}, .config = *config};
}
