#include "linux/hal_guard.h"

#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "linux/hal_guard_child.h"

/* Longest wait for a guard to begin, and to end. */
#define GUARD_WAIT_MS 2000

/* Room for something to be read, or the end of the file; false after GUARD_WAIT_MS. */
static bool wait_readable(int fd)
{
    struct pollfd waiting = {.fd = fd, .events = POLLIN};
    int ready = 0;
    do {
        ready = poll(&waiting, 1, GUARD_WAIT_MS);
    } while (ready < 0 && errno == EINTR);
    return ready > 0;
}

/* What became of the guard; it is not waited for. */
static bool fail_gone(const struct hal_guard *guard, struct hal_error *error)
{
    int status = 0;
    siginfo_t info = {.si_pid = 0};
    if (waitid(P_PID, (id_t)guard->pid, &info, WEXITED | WSTOPPED | WNOHANG | WNOWAIT) != 0 ||
        info.si_pid == 0) {
        return hal_fail(error, "guard: process %d has let go of the laser, expected it to watch",
                        (int)guard->pid);
    }
    status = info.si_status;
    if (info.si_code == CLD_EXITED && status == GUARD_EXIT_LATE) {
        return hal_fail(error,
                        "guard: switched the laser off, no sign of life for %d ms; expected one "
                        "several times in that time",
                        (int)guard->config.timeout_ms);
    }
    return hal_fail(error, "guard: process %d has %s %d, expected it to watch", (int)guard->pid,
                    info.si_code == CLD_EXITED    ? "ended with status"
                    : info.si_code == CLD_STOPPED ? "been stopped by signal"
                                                  : "died of signal",
                    status);
}

/* Takes what the guard has said. Not the end of the file: then it is watching. */
static bool is_watching(struct hal_guard *guard)
{
    char bytes[64];
    ssize_t count = 0;
    do {
        count = recv(guard->socket_fd, bytes, sizeof bytes, MSG_DONTWAIT);
        guard->moved = guard->moved || count > 0;
    } while (count > 0 || (count < 0 && errno == EINTR));
    return count < 0 && errno == EAGAIN;
}

static bool send_byte(const struct hal_guard *guard, char byte)
{
    return send(guard->socket_fd, &byte, 1, MSG_NOSIGNAL | MSG_DONTWAIT) == 1;
}

static void stop(struct hal_guard *guard)
{
    if (guard->socket_fd < 0) {
        return;
    }
    send_byte(guard, GUARD_DONE);
    shutdown(guard->socket_fd, SHUT_WR);
    /* It closes its end in ending; one that was stopped does not. */
    struct pollfd waiting = {.fd = guard->socket_fd};
    int ready = 0;
    do {
        ready = poll(&waiting, 1, GUARD_WAIT_MS);
    } while (ready < 0 && errno == EINTR);
    if (ready <= 0) {
        kill(guard->pid, SIGKILL);
    }
    close(guard->socket_fd);
    guard->socket_fd = -1;
    /* Where SIGCHLD is ignored there is nothing to be collected, and this says so after its end. */
    while (waitpid(guard->pid, NULL, 0) < 0 && errno == EINTR) {
    }
}

/* Fork, with no signal between the fork and what the child does about signals. */
static pid_t fork_child(const struct hal_guard_config *config, int child_fd)
{
    sigset_t all, before;
    sigfillset(&all);
    sigprocmask(SIG_SETMASK, &all, &before);
    pid_t pid = fork();
    if (pid == 0) {
        hal_guard_child(config, child_fd);
    }
    int error = errno;
    sigprocmask(SIG_SETMASK, &before, NULL);
    errno = error;
    return pid;
}

static bool start(struct hal_guard *guard, struct hal_error *error)
{
    int ends[2];
    char byte = 0;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
        return hal_fail(error, "guard: no socket: %s", strerror(errno));
    }
    guard->pid = fork_child(&guard->config, ends[1]);
    int reason = errno;
    close(ends[1]);
    if (guard->pid < 0) {
        close(ends[0]);
        return hal_fail(error, "guard: no process: %s", strerror(reason));
    }
    guard->socket_fd = ends[0];
    guard->moved = false;
    if (!wait_readable(guard->socket_fd) || recv(guard->socket_fd, &byte, 1, MSG_DONTWAIT) != 1 ||
        byte != GUARD_READY) {
        stop(guard);
        return hal_fail(error,
                        "guard: the process did not begin, expected it within %d ms; is "
                        "/proc mounted?",
                        GUARD_WAIT_MS);
    }
    return true;
}

bool hal_guard_feed(struct hal_guard *guard, struct hal_error *error)
{
    siginfo_t info = {.si_pid = 0};
    if (guard->socket_fd < 0) {
        return true;
    }
    /* One that was stopped still has its socket open. */
    bool stands = waitid(P_PID, (id_t)guard->pid, &info, WSTOPPED | WNOHANG | WNOWAIT) == 0 &&
                  info.si_pid != 0;
    if (stands || !is_watching(guard) || !send_byte(guard, GUARD_ALIVE)) {
        return fail_gone(guard, error);
    }
    return true;
}

static bool guard_open(void *context, struct hal_error *error)
{
    struct hal_guard *guard = context;
    const struct hal_strobe *strobe = guard->config.strobe;
    strobe->set(strobe->context, false, error);
    stop(guard);
    if (!strobe->open(strobe->context, error)) {
        return false;
    }
    if (!start(guard, error)) {
        strobe->close(strobe->context);
        return false;
    }
    return true;
}

static void guard_close(void *context)
{
    struct hal_guard *guard = context;
    const struct hal_strobe *strobe = guard->config.strobe;
    struct hal_error ignored;
    strobe->set(strobe->context, false, &ignored);
    stop(guard);
    strobe->close(strobe->context);
}

static bool guard_set(void *context, bool on, struct hal_error *error)
{
    struct hal_guard *guard = context;
    const struct hal_strobe *strobe = guard->config.strobe;
    if (!on) {
        if (!strobe->set(strobe->context, false, error)) {
            return false;
        }
        if (guard->socket_fd >= 0) {
            send_byte(guard, GUARD_OFF); /* else it goes on to expect signs of life */
        }
        return true;
    }
    if (guard->socket_fd < 0) {
        return hal_fail(error, "guard: none, expected an open strobe");
    }
    if (is_watching(guard) && send_byte(guard, GUARD_ON)) {
        if (!strobe->set(strobe->context, true, error)) {
            return false;
        }
        /* It may have let go, and switched off, before the line went on: then it is on unguarded. */
        if (is_watching(guard)) {
            return true;
        }
    }
    strobe->set(strobe->context, false, error);
    return fail_gone(guard, error);
}

static bool guard_beat(void *context, struct hal_error *error)
{
    const struct hal_strobe *strobe = ((struct hal_guard *)context)->config.strobe;
    return strobe->beat(strobe->context, error);
}

/* One that has ended is noticed here, too: sooner than by the next sign of life. */
static bool guard_interlock(void *context, bool *closed, struct hal_error *error)
{
    struct hal_guard *guard = context;
    const struct hal_strobe *strobe = guard->config.strobe;
    if (!strobe->interlock(strobe->context, closed, error)) {
        return false;
    }
    if (guard->socket_fd >= 0 && !is_watching(guard)) {
        *closed = false;
        return fail_gone(guard, error);
    }
    *closed = *closed && !guard->moved;
    guard->moved = false;
    return true;
}

void hal_guard_init(struct hal_guard *guard, const struct hal_guard_config *config)
{
    *guard = (struct hal_guard){
        .strobe = {guard, guard_open, guard_close, guard_set, guard_beat, guard_interlock},
        .config = *config,
        .socket_fd = -1,
        .pid = -1};
}
