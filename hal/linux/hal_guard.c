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

/* What became of a guard; it is not waited for. */
static bool fail_gone(const struct hal_guard *guard, const struct hal_guard_process *process,
                      struct hal_error *error)
{
    int status = 0;
    siginfo_t info = {.si_pid = 0};
    if (waitid(P_PID, (id_t)process->pid, &info, WEXITED | WSTOPPED | WNOHANG | WNOWAIT) != 0 ||
        info.si_pid == 0) {
        return hal_fail(error, "guard: process %d has let go of the laser, expected it to watch",
                        (int)process->pid);
    }
    status = info.si_status;
    if (info.si_code == CLD_EXITED && status == GUARD_EXIT_LATE) {
        return hal_fail(error,
                        "guard: switched the laser off, no sign of life for %d ms; expected one "
                        "several times in that time",
                        (int)guard->config.timeout_ms);
    }
    return hal_fail(error, "guard: process %d has %s %d, expected it to watch", (int)process->pid,
                    info.si_code == CLD_EXITED    ? "ended with status"
                    : info.si_code == CLD_STOPPED ? "been stopped by signal"
                                                  : "died of signal",
                    status);
}

/* No end of the file, then it is watching. */
static bool is_watching(const struct hal_guard_process *process)
{
    char byte = 0;
    ssize_t count = 0;
    do {
        count = recv(process->socket_fd, &byte, 1, MSG_DONTWAIT);
    } while (count < 0 && errno == EINTR);
    return count < 0 && errno == EAGAIN;
}

/* The first guard that is not; NULL: all are. */
static const struct hal_guard_process *find_gone(const struct hal_guard *guard)
{
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        if (!is_watching(&guard->process[i])) {
            return &guard->process[i];
        }
    }
    return NULL;
}

static bool send_byte(const struct hal_guard_process *process, char byte)
{
    return send(process->socket_fd, &byte, 1, MSG_NOSIGNAL | MSG_DONTWAIT) == 1;
}

/* The last guard that it did not reach, or NULL. */
static const struct hal_guard_process *send_all(const struct hal_guard *guard, char byte)
{
    const struct hal_guard_process *deaf = NULL;
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        if (!send_byte(&guard->process[i], byte)) {
            deaf = &guard->process[i];
        }
    }
    return deaf;
}

/* Does a guard keep the laser off, or has it, unknown to the caller? */
static bool is_refused(const struct hal_guard *guard)
{
    const struct hal_guard_page *page = guard->page;
    int64_t now_us = hal_guard_now_us();
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        if (page->guard[i].refuses || page->guard[i].cut_count != guard->process[i].cut_count ||
            !hal_guard_page_lives(page, i, now_us)) {
            return true;
        }
    }
    return false;
}

/* It closes its end in ending; one that was stopped does not. */
static void stop_one(struct hal_guard_process *process)
{
    struct pollfd waiting = {.fd = process->socket_fd};
    int ready = 0;
    if (process->socket_fd < 0) {
        return;
    }
    do {
        ready = poll(&waiting, 1, GUARD_WAIT_MS);
    } while (ready < 0 && errno == EINTR);
    if (ready <= 0) {
        kill(process->pid, SIGKILL);
    }
    close(process->socket_fd);
    process->socket_fd = -1;
    /* Where SIGCHLD is ignored there is nothing to be collected, and this says so after its end. */
    while (waitpid(process->pid, NULL, 0) < 0 && errno == EINTR) {
    }
}

static void stop(struct hal_guard *guard)
{
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        if (guard->process[i].socket_fd >= 0) {
            send_byte(&guard->process[i], GUARD_DONE);
            shutdown(guard->process[i].socket_fd, SHUT_WR);
        }
    }
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        stop_one(&guard->process[i]);
    }
    hal_guard_page_free(guard->page);
    guard->page = NULL;
}

/* Fork, with no signal between the fork and what the child does about signals. */
static pid_t fork_child(const struct hal_guard *guard, int index, int child_fd)
{
    sigset_t all, before;
    sigfillset(&all);
    sigprocmask(SIG_SETMASK, &all, &before);
    pid_t pid = fork();
    if (pid == 0) {
        hal_guard_child(&guard->config, guard->page, index, child_fd);
    }
    int error = errno;
    sigprocmask(SIG_SETMASK, &before, NULL);
    errno = error;
    return pid;
}

static bool start_one(struct hal_guard *guard, int index, struct hal_error *error)
{
    struct hal_guard_process *process = &guard->process[index];
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
        return hal_fail(error, "guard: no socket: %s", strerror(errno));
    }
    guard->page->guard[index].life_us = hal_guard_now_us();
    process->pid = fork_child(guard, index, ends[1]);
    int reason = errno;
    close(ends[1]);
    if (process->pid < 0) {
        close(ends[0]);
        return hal_fail(error, "guard: no process: %s", strerror(reason));
    }
    process->socket_fd = ends[0];
    process->cut_count = 0;
    return true;
}

static bool start(struct hal_guard *guard, struct hal_error *error)
{
    guard->page = hal_guard_page_new(guard->config.line_name);
    if (guard->page == NULL) {
        return hal_fail(error, "guard: no memory to share: %s", strerror(errno));
    }
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        if (!start_one(guard, i, error)) {
            return false;
        }
    }
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        char byte = 0;
        int fd = guard->process[i].socket_fd;
        if (!wait_readable(fd) || recv(fd, &byte, 1, MSG_DONTWAIT) != 1 || byte != GUARD_READY) {
            return hal_fail(error,
                            "guard: the process did not begin, expected it within %d ms; is "
                            "/proc mounted?",
                            GUARD_WAIT_MS);
        }
    }
    return true;
}

bool hal_guard_feed(struct hal_guard *guard, struct hal_error *error)
{
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        const struct hal_guard_process *process = &guard->process[i];
        siginfo_t info = {.si_pid = 0};
        if (process->socket_fd < 0) {
            continue;
        }
        bool stands = waitid(P_PID, (id_t)process->pid, &info, WSTOPPED | WNOHANG | WNOWAIT) == 0 &&
                      info.si_pid != 0;
        if (stands || !is_watching(process) || !send_byte(process, GUARD_ALIVE)) {
            return fail_gone(guard, process, error);
        }
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
        stop(guard);
        strobe->close(strobe->context);
        return false;
    }
    return true;
}

static bool set_off(const struct hal_guard *guard, struct hal_error *error)
{
    const struct hal_strobe *strobe = guard->config.strobe;
    if (!strobe->set(strobe->context, false, error)) {
        return false;
    }
    if (guard->page != NULL) {
        hal_guard_page_announce(guard->page, false);
        send_all(guard, GUARD_OFF); /* else they go on to expect signs of life */
    }
    return true;
}

static void guard_close(void *context)
{
    struct hal_guard *guard = context;
    const struct hal_strobe *strobe = guard->config.strobe;
    struct hal_error ignored;
    set_off(guard, &ignored);
    stop(guard);
    strobe->close(strobe->context);
}

static bool guard_set(void *context, bool on, struct hal_error *error)
{
    struct hal_guard *guard = context;
    const struct hal_strobe *strobe = guard->config.strobe;
    struct hal_error ignored;
    if (!on) {
        return set_off(guard, error);
    }
    if (guard->page == NULL) {
        return hal_fail(error, "guard: none, expected an open strobe");
    }
    const struct hal_guard_process *gone = find_gone(guard);
    gone = gone == NULL ? send_all(guard, GUARD_ON) : gone;
    if (gone != NULL) {
        set_off(guard, &ignored);
        return fail_gone(guard, gone, error);
    }
    if (is_refused(guard)) {
        return set_off(guard, error); /* interlock() says so */
    }
    hal_guard_page_announce(guard->page, true);
    bool is_on = strobe->set(strobe->context, true, error);
    /* One may have let go, and switched off, before the line went on: then it is on unguarded. */
    gone = find_gone(guard);
    if (gone != NULL) {
        set_off(guard, &ignored);
        return fail_gone(guard, gone, error);
    }
    /* A guard that was quicker may be why the line does not read as it was set. */
    return is_refused(guard) ? set_off(guard, error) : is_on;
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
    if (guard->page == NULL) {
        return true;
    }
    const struct hal_guard_process *gone = find_gone(guard);
    if (gone != NULL) {
        *closed = false;
        return fail_gone(guard, gone, error);
    }
    unsigned counts[HAL_GUARD_COUNT];
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        counts[i] = guard->page->guard[i].cut_count; /* those that come later are reported later */
    }
    *closed = *closed && !is_refused(guard);
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        guard->process[i].cut_count = counts[i];
    }
    return true;
}

static bool guard_judged(void *context, struct hal_error *error)
{
    const struct hal_guard *guard = context;
    (void)error;
    if (guard->page != NULL) {
        hal_guard_page_judged(guard->page);
    }
    return true;
}

static bool guard_level(void *context, bool *on, struct hal_error *error)
{
    const struct hal_strobe *strobe = ((struct hal_guard *)context)->config.strobe;
    return strobe->level(strobe->context, on, error);
}

static bool guard_prove(void *context, struct hal_error *unproven, struct hal_error *error)
{
    const struct hal_strobe *strobe = ((struct hal_guard *)context)->config.strobe;
    return strobe->prove(strobe->context, unproven, error);
}

void hal_guard_init(struct hal_guard *guard, const struct hal_guard_config *config)
{
    *guard = (struct hal_guard){.strobe = {guard, guard_open, guard_close, guard_set, guard_beat,
                                           guard_interlock, guard_judged, guard_level, guard_prove},
                                .config = *config};
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        guard->process[i] = (struct hal_guard_process){.socket_fd = -1, .pid = -1};
    }
}
