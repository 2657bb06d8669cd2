#include "linux/hal_viewer.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include "linux/hal_descriptors.h"

/* Beyond what the process is given. */
#define FREE_FD 16
#define PATH_BYTES 4096

/* --- the listening socket --- */

static bool fail_at(const struct hal_viewer_config *config, const char *what, const char *reason,
                    struct hal_error *error)
{
    return hal_fail(error, "%s port %s: %s: %s", config->host, config->port, what, reason);
}

static int bind_to(const struct addrinfo *at)
{
    const int on = 1;
    int fd = socket(at->ai_family, at->ai_socktype | SOCK_CLOEXEC | SOCK_NONBLOCK, at->ai_protocol);
    if (fd < 0) {
        return -1;
    }
    /* Else a program that is started anew would find its own closed connections in the way. */
    if (setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on) != 0 ||
        bind(fd, at->ai_addr, at->ai_addrlen) != 0 || listen(fd, HAL_VIEWER_BACKLOG) != 0) {
        int reason = errno;
        close(fd);
        errno = reason;
        return -1;
    }
    return fd;
}

static int listen_at(const struct hal_viewer_config *config, struct hal_error *error)
{
    const struct addrinfo hints = {.ai_flags = AI_NUMERICHOST | AI_NUMERICSERV | AI_PASSIVE,
                                   .ai_socktype = SOCK_STREAM};
    struct addrinfo *at = NULL;
    int answer = getaddrinfo(config->host, config->port, &hints, &at);
    if (answer != 0) {
        fail_at(config, "expected a numeric address", gai_strerror(answer), error);
        return -1;
    }
    int fd = bind_to(at);
    int reason = errno;
    freeaddrinfo(at);
    if (fd < 0) {
        fail_at(config, "cannot listen", strerror(reason), error);
    }
    return fd;
}

/* Which port it is, where any was asked for, and the address as the system writes it. */
static bool describe(struct hal_viewer_process *process, int listen_fd, struct hal_error *error)
{
    struct sockaddr_storage at;
    socklen_t size = sizeof at;
    char host[64], port[8];
    if (getsockname(listen_fd, (struct sockaddr *)&at, &size) != 0 ||
        getnameinfo((struct sockaddr *)&at, size, host, sizeof host, port, sizeof port,
                    NI_NUMERICHOST | NI_NUMERICSERV) != 0) {
        return hal_fail(error, "the listening socket has no address");
    }
    bool is_v6 = strchr(host, ':') != NULL;
    snprintf(process->url, sizeof process->url, "http://%s%s%s:%s/%s/", is_v6 ? "[" : "", host,
             is_v6 ? "]" : "", port, hal_mailbox_token(&process->mailbox));
    process->is_local = strncmp(host, "127.", 4) == 0 || strcmp(host, "::1") == 0;
    return true;
}

/* --- the process --- */

static bool find_program(char path[PATH_BYTES])
{
    ssize_t length = readlink("/proc/self/exe", path, PATH_BYTES - sizeof HAL_VIEWER_PROGRAM);
    if (length <= 0) {
        return false;
    }
    path[length] = 0;
    char *name = strrchr(path, '/');
    if (name == NULL || (size_t)length >= PATH_BYTES - sizeof HAL_VIEWER_PROGRAM) {
        return false;
    }
    memcpy(name + 1, HAL_VIEWER_PROGRAM, sizeof HAL_VIEWER_PROGRAM);
    return true;
}

/* First out of each other's way, then to their numbers; other programs inherit the latter only. */
static bool place(const int from_fds[], int count)
{
    int away_fds[8];
    for (int i = 0; i < count; i++) {
        away_fds[i] = fcntl(from_fds[i], F_DUPFD_CLOEXEC, FREE_FD);
        if (away_fds[i] < 0) {
            return false;
        }
    }
    for (int i = 0; i < count; i++) {
        if (dup2(away_fds[i], i) < 0) {
            return false;
        }
    }
    return true;
}

static _Noreturn void become(const char *program, const int from_fds[], pid_t parent)
{
    static const int keep_fds[] = {
        0, 1, 2, HAL_VIEWER_SOCKET_FD, HAL_VIEWER_LISTEN_FD, HAL_VIEWER_MAILBOX_FD};
    const int count = sizeof keep_fds / sizeof keep_fds[0];
    char name[] = "isohead_live";
    char *const arguments[] = {name, NULL};
    struct hal_error error;
    sigset_t all;
    sigfillset(&all);
    sigprocmask(SIG_SETMASK, &all, NULL);
    if (prctl(PR_SET_PDEATHSIG, SIGKILL) != 0 || getppid() != parent || !place(from_fds, count) ||
        !hal_descriptors_keep(keep_fds, count)) {
        _exit(1);
    }
    execv(program, arguments);
    hal_fail(&error, "%.160s: %s", program, strerror(errno));
    send(HAL_VIEWER_SOCKET_FD, error.text, strlen(error.text), MSG_NOSIGNAL);
    _exit(1);
}

/* It may have closed its end alone. */
static void let_go(struct hal_viewer_process *process)
{
    kill(process->pid, SIGKILL);
    close(process->socket_fd);
    process->socket_fd = -1;
}

/* True: it has ended, *error says what by. options: of waitpid. */
static bool bury(struct hal_viewer_process *process, int options, struct hal_error *error)
{
    int status = 0;
    pid_t dead = 0;
    do {
        dead = waitpid(process->pid, &status, options);
    } while (dead < 0 && errno == EINTR);
    if (dead == 0) {
        return false;
    }
    process->pid = -1;
    hal_fail(error, "its process has ended (%s %d); no live view until the program is restarted",
             WIFSIGNALED(status) ? "signal" : "status",
             WIFSIGNALED(status) ? WTERMSIG(status) : WEXITSTATUS(status));
    return true;
}

static bool start(struct hal_viewer_process *process, const char *program, int listen_fd,
                  struct hal_error *error)
{
    int ends[2];
    pid_t parent = getpid();
    int null_fd = open("/dev/null", O_RDWR | O_CLOEXEC);
    if (null_fd < 0) {
        return hal_fail(error, "/dev/null: %s", strerror(errno));
    }
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
        close(null_fd);
        return hal_fail(error, "no socket: %s", strerror(errno));
    }
    process->pid = fork();
    if (process->pid == 0) {
        const int from_fds[] = {null_fd, null_fd, null_fd, ends[1], listen_fd, process->mailbox.fd};
        become(program, from_fds, parent);
    }
    int reason = errno;
    close(null_fd);
    close(ends[1]);
    if (process->pid < 0) {
        close(ends[0]);
        return hal_fail(error, "no process: %s", strerror(reason));
    }
    process->socket_fd = ends[0];
    return true;
}

static bool wait_until_ready(struct hal_viewer_process *process, struct hal_error *error)
{
    char text[HAL_ERROR_MAX];
    struct pollfd waiting = {.fd = process->socket_fd, .events = POLLIN};
    int ready = 0;
    do {
        ready = poll(&waiting, 1, HAL_VIEWER_START_MS);
    } while (ready < 0 && errno == EINTR);
    ssize_t length = ready > 0 ? recv(process->socket_fd, text, sizeof text - 1, MSG_DONTWAIT) : -1;
    if (length == (ssize_t)strlen(HAL_VIEWER_READY) &&
        memcmp(text, HAL_VIEWER_READY, (size_t)length) == 0) {
        return true;
    }
    let_go(process);
    bury(process, 0, error); /* there is time: nothing runs yet */
    if (length > 0) {
        text[length] = 0;
        return hal_fail(error, "%s", text);
    }
    return ready > 0
               ? false
               : hal_fail(error, "its process did not begin within %d ms", HAL_VIEWER_START_MS);
}

/* --- the table --- */

/* It says nothing more: whatever comes is its end. */
static bool has_ended(const struct hal_viewer_process *process)
{
    char byte = 0;
    ssize_t count = recv(process->socket_fd, &byte, 1, MSG_DONTWAIT);
    return count >= 0 || (errno != EAGAIN && errno != EINTR);
}

static enum hal_look ask(void *context, void **room, struct hal_error *error)
{
    struct hal_viewer_process *process = context;
    if (process->socket_fd >= 0 && !has_ended(process)) {
        *room = hal_mailbox_room(&process->mailbox);
        return *room != NULL ? HAL_LOOK_WANTED : HAL_LOOK_NONE;
    }
    if (process->socket_fd >= 0) {
        let_go(process);
    }
    /* On a busy processor it takes its time to die, too: it is not waited for. */
    return process->pid > 0 && bury(process, WNOHANG, error) ? HAL_LOOK_GONE : HAL_LOOK_NONE;
}

static void show(void *context)
{
    struct hal_viewer_process *process = context;
    hal_mailbox_fill(&process->mailbox);
    /* Where it has ended ask says so. */
    send(process->socket_fd, HAL_VIEWER_FILLED, strlen(HAL_VIEWER_FILLED),
         MSG_DONTWAIT | MSG_NOSIGNAL);
}

static bool open_with(struct hal_viewer_process *process, const struct hal_viewer_config *config,
                      int listen_fd, struct hal_error *error)
{
    char found[PATH_BYTES];
    if (config->program == NULL && !find_program(found)) {
        return hal_fail(error, "/proc/self/exe: cannot be read; is /proc mounted?");
    }
    return hal_mailbox_create(&process->mailbox, config->content_size, error) &&
           describe(process, listen_fd, error) &&
           start(process, config->program != NULL ? config->program : found, listen_fd, error) &&
           wait_until_ready(process, error);
}

bool hal_viewer_open(struct hal_viewer_process *process, const struct hal_viewer_config *config,
                     struct hal_error *error)
{
    *process = (struct hal_viewer_process){
        .viewer = {process, ask, show}, .mailbox = {.fd = -1}, .socket_fd = -1, .pid = -1};
    int listen_fd = listen_at(config, error);
    if (listen_fd < 0) {
        return false;
    }
    bool good = open_with(process, config, listen_fd, error);
    close(listen_fd); /* the process has its own */
    if (!good) {
        hal_viewer_close(process);
    }
    return good;
}

void hal_viewer_close(struct hal_viewer_process *process)
{
    struct hal_error ignored;
    if (process->socket_fd >= 0) {
        let_go(process);
    }
    if (process->pid > 0) {
        bury(process, WNOHANG, &ignored);
        process->pid = -1;
    }
    hal_mailbox_close(&process->mailbox);
}
