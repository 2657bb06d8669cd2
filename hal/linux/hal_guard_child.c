#include "linux/hal_guard_child.h"

#include <dirent.h>
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

/* All but two. The kernel lists what is open; a limit to count up to could be a thousand million. */
static bool close_others(int keep_fd, int keep_too_fd)
{
    DIR *list = opendir("/proc/self/fd");
    if (list == NULL) {
        return false;
    }
    for (const struct dirent *entry = readdir(list); entry != NULL; entry = readdir(list)) {
        int fd = (int)strtol(entry->d_name, NULL, 10);
        bool number = entry->d_name[0] != '.';
        if (number && fd != keep_fd && fd != keep_too_fd && fd != dirfd(list)) {
            close(fd);
        }
    }
    closedir(list);
    return true;
}

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

/* Why to switch off: waits for it. */
static enum guard_exit wait_for_the_end(int socket_fd, int timeout_ms)
{
    for (;;) {
        struct pollfd waiting = {.fd = socket_fd, .events = POLLIN};
        char bytes[64];
        int ready = poll(&waiting, 1, timeout_ms);
        if (ready == 0) {
            return GUARD_EXIT_LATE;
        }
        ssize_t count = ready < 0 ? -1 : recv(socket_fd, bytes, sizeof bytes, MSG_DONTWAIT);
        if (count == 0 || (count < 0 && errno != EINTR && errno != EAGAIN)) {
            return GUARD_EXIT_GONE;
        }
        for (ssize_t i = 0; i < count; i++) {
            if (bytes[i] == GUARD_DONE) {
                return GUARD_EXIT_DONE;
            }
        }
    }
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

_Noreturn void hal_guard_child(const struct hal_guard_config *config, int socket_fd)
{
    const char ready = GUARD_READY;
    let_faults_through();
    prctl(PR_SET_NAME, "isohead-guard");
    if (setsid() < 0 || !close_others(socket_fd, *config->line_fd) ||
        send(socket_fd, &ready, 1, MSG_NOSIGNAL) != 1) {
        _exit(GUARD_EXIT_SETUP);
    }
    enum guard_exit why = wait_for_the_end(socket_fd, config->timeout_ms);
    /* In this order: who switches on and then still finds the socket open was before this. */
    shutdown(socket_fd, SHUT_RDWR);
    _exit(switch_off(config->strobe) ? (int)why : GUARD_EXIT_LINE);
}
