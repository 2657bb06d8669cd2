#include "linux/hal_guard_child.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

#include "linux/hal_descriptors.h"

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

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* Takes what the other process has said. Why to end; -1: it lives. */
static int listen_to(int socket_fd, bool *on)
{
    char bytes[64];
    ssize_t count = recv(socket_fd, bytes, sizeof bytes, MSG_DONTWAIT);
    if (count == 0 || (count < 0 && errno != EINTR && errno != EAGAIN)) {
        return GUARD_EXIT_GONE;
    }
    for (ssize_t i = 0; i < count; i++) {
        if (bytes[i] == GUARD_DONE) {
            return GUARD_EXIT_DONE;
        }
        if (bytes[i] == GUARD_ON || bytes[i] == GUARD_OFF) {
            *on = bytes[i] == GUARD_ON;
        }
    }
    return -1;
}

/* Why to switch off for good: waits for it. An interlock that moves switches off too, for now,
 * whatever its level is by then. The event is left to the other process; until it has been taken this
 * goes on every GUARD_LOOK_MS, since waiting for it would return at once. */
static enum guard_exit wait_for_the_end(const struct hal_guard_config *config, int socket_fd)
{
    const char message = GUARD_MOVED;
    int64_t end_ms = 0;
    bool moved = false, on = false;
    for (;;) {
        struct pollfd waiting[] = {
            {.fd = socket_fd, .events = POLLIN},
            {.fd = moved || config->interlock_fd == NULL ? -1 : *config->interlock_fd,
             .events = POLLIN}};
        int64_t left_ms = on ? end_ms - now_ms() : config->timeout_ms;
        if (left_ms <= 0) {
            return GUARD_EXIT_LATE;
        }
        poll(waiting, 2, moved && left_ms > GUARD_LOOK_MS ? GUARD_LOOK_MS : (int)left_ms);
        moved = waiting[1].revents != 0;
        if (moved) {
            switch_off(config->strobe);
            /* Full: the same message waits there already. */
            send(socket_fd, &message, 1, MSG_NOSIGNAL | MSG_DONTWAIT);
        }
        if (waiting[0].revents != 0) {
            int why = listen_to(socket_fd, &on);
            if (why >= 0) {
                return (enum guard_exit)why;
            }
            end_ms = now_ms() + config->timeout_ms;
        }
    }
}

_Noreturn void hal_guard_child(const struct hal_guard_config *config, int socket_fd)
{
    const char ready = GUARD_READY;
    let_faults_through();
    prctl(PR_SET_NAME, "isohead-guard");
    const int *interlock_fd = config->interlock_fd;
    const int keep_fds[] = {socket_fd, *config->line_fd, interlock_fd == NULL ? -1 : *interlock_fd};
    if (setsid() < 0 || !hal_descriptors_keep(keep_fds, 3) ||
        send(socket_fd, &ready, 1, MSG_NOSIGNAL) != 1) {
        _exit(GUARD_EXIT_SETUP);
    }
    enum guard_exit why = wait_for_the_end(config, socket_fd);
    /* In this order: who switches on and then still finds the socket open was before this. */
    shutdown(socket_fd, SHUT_RDWR);
    _exit(switch_off(config->strobe) ? (int)why : GUARD_EXIT_LINE);
}
