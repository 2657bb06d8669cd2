#include "linux/hal_guard_child.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "linux/hal_descriptors.h"

struct watch {
    const struct hal_guard_config *config;
    struct hal_guard_page *page;
    int index, socket_fd;
    struct hal_limits limits;
    bool expects_life; /* signs of life are expected */
    bool moved;        /* the interlock's event waits to be taken */
    int64_t end_us;    /* of the time without a sign of life */
};

/* Everything stays blocked but the signals of own faults: blocked, they would kill without the
 * handler that switches off. */
static void let_faults_through(void)
{
    static const int faults[] = {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGTRAP, SIGSYS};
    sigset_t set;
    sigemptyset(&set);
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++) {
        sigaddset(&set, faults[i]);
    }
    sigprocmask(SIG_UNBLOCK, &set, NULL);
}

static bool switch_off(const struct hal_strobe *strobe)
{
    const struct timespec pause = {.tv_nsec = 10 * 1000 * 1000};
    struct hal_error ignored;
    for (int i = 0; i < GUARD_OFF_TRIES; i++) {
        if (strobe->set(strobe->context, false, &ignored)) {
            return true;
        }
        nanosleep(&pause, NULL);
    }
    return false;
}

/* For now. The program knows by the count, and before the line is low. */
static bool cut(struct watch *watch)
{
    watch->page->guard[watch->index].cut_count++;
    return switch_off(watch->config->strobe);
}

/* Takes what the other process has said. Why to end; -1: it lives. */
static int listen_to(struct watch *watch)
{
    char bytes[64];
    ssize_t count = recv(watch->socket_fd, bytes, sizeof bytes, MSG_DONTWAIT);
    if (count == 0 || (count < 0 && errno != EINTR && errno != EAGAIN)) {
        return GUARD_EXIT_GONE;
    }
    for (ssize_t i = 0; i < count; i++) {
        if (bytes[i] == GUARD_DONE) {
            return GUARD_EXIT_DONE;
        }
        if (bytes[i] == GUARD_ON || bytes[i] == GUARD_OFF) {
            watch->expects_life = bytes[i] == GUARD_ON;
        }
    }
    if (count > 0) {
        watch->end_us = hal_guard_now_us() + watch->config->timeout_ms * INT64_C(1000);
    }
    return -1;
}

static bool reads_high(const struct hal_strobe *strobe)
{
    struct hal_error ignored;
    bool on = false;
    return strobe->level(strobe->context, &on, &ignored) && on;
}

/* At the limits, the line and the other guard. False: the line cannot be made low. */
static bool look(struct watch *watch)
{
    struct hal_guard_page *page = watch->page;
    int64_t now_us = hal_guard_now_us();
    struct hal_guard_view view, after;
    bool good = hal_guard_page_read(page, now_us, &view);
    bool is_high = reads_high(watch->config->strobe);
    good = good && hal_guard_page_read(page, now_us, &after) && after.writes == view.writes;
    /* What is being written counts as on since the last look. */
    bool allowed = hal_limits_allow(&watch->limits, now_us, good ? view.on_us : -1,
                                    good ? view.judged_on_us : -1);
    bool is_unannounced = good && is_high && !view.is_on;
    bool refuses = !allowed || is_unannounced ||
                   !hal_guard_page_lives(page, HAL_GUARD_COUNT - 1 - watch->index, now_us);
    page->guard[watch->index].refuses = refuses;
    page->guard[watch->index].life_us = now_us;
    return !refuses || !(is_high || !good || view.is_on) || cut(watch);
}

/* An interlock that moves switches off, whatever its level is by then. The event is left to the other
 * process; until it has been taken this looks again every GUARD_EVENT_MS, since waiting for it would
 * return at once. False: the line cannot be made low. */
static bool wait(struct watch *watch)
{
    const int *interlock_fd = watch->config->interlock_fd;
    struct pollfd waiting[] = {
        {.fd = watch->socket_fd, .events = POLLIN},
        {.fd = watch->moved || interlock_fd == NULL ? -1 : *interlock_fd, .events = POLLIN}};
    int64_t left_ms =
        watch->expects_life ? (watch->end_us - hal_guard_now_us()) / 1000 : GUARD_LOOK_MS;
    int64_t wait_ms = watch->moved ? GUARD_EVENT_MS : GUARD_LOOK_MS;
    wait_ms = left_ms < wait_ms ? left_ms : wait_ms;
    poll(waiting, 2, wait_ms < 0 ? 0 : (int)wait_ms);
    watch->moved = waiting[1].revents != 0;
    return !watch->moved || cut(watch);
}

/* Why to switch off for good: waits for it. */
static enum guard_exit wait_for_the_end(struct watch *watch)
{
    for (;;) {
        if (!wait(watch)) {
            return GUARD_EXIT_LINE;
        }
        int why = listen_to(watch);
        if (why >= 0) {
            return (enum guard_exit)why;
        }
        if (watch->expects_life && hal_guard_now_us() >= watch->end_us) {
            return GUARD_EXIT_LATE;
        }
        if (!look(watch)) {
            return GUARD_EXIT_LINE;
        }
    }
}

_Noreturn void hal_guard_child(const struct hal_guard_config *config, struct hal_guard_page *page,
                               int index, int socket_fd)
{
    const char ready = GUARD_READY;
    struct watch watch = {.config = config, .page = page, .index = index, .socket_fd = socket_fd};
    let_faults_through();
    prctl(PR_SET_NAME, "isohead-guard");
    hal_limits_init(&watch.limits, &config->limits, hal_guard_now_us());
    const int *interlock_fd = config->interlock_fd;
    const int keep_fds[] = {socket_fd, *config->line_fd, interlock_fd == NULL ? -1 : *interlock_fd};
    /* Where memory is short its code would have to be read from the disk first. Without leave it goes on. */
    mlockall(MCL_CURRENT);
    if (setsid() < 0 || !hal_descriptors_keep(keep_fds, 3) ||
        send(socket_fd, &ready, 1, MSG_NOSIGNAL) != 1) {
        _exit(GUARD_EXIT_SETUP);
    }
    enum guard_exit why = wait_for_the_end(&watch);
    /* In this order: who switches on and then still finds the socket open was before this. */
    shutdown(socket_fd, SHUT_RDWR);
    _exit(switch_off(config->strobe) ? (int)why : GUARD_EXIT_LINE);
}
