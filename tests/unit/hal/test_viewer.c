/* The live view's two sides below HTTP: the mailbox, the process and all the ways in which it fails, and
 * its jail. The process is this program, which does what the environment says. */
#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "ih_test.h"
#include "linux/hal_jail.h"
#include "linux/hal_viewer.h"

#define CONTENT 100000
#define ROLE "TEST_VIEWER_ROLE"

static struct hal_viewer_process viewer;
static struct hal_error error;
static char self[4096];

static void open_as(const char *role)
{
    setenv(ROLE, role, 1);
}

static const struct hal_viewer_config *config(void)
{
    static struct hal_viewer_config with;
    with = (struct hal_viewer_config){
        .program = self, .host = "127.0.0.1", .port = "0", .content_size = CONTENT};
    return &with;
}

void setUp(void)
{
    viewer.socket_fd = -1;
    viewer.pid = -1;
    viewer.mailbox.fd = -1;
    error.text[0] = 0;
}

/* Closing does not wait, but may find the end there already. */
static void bury_all(void)
{
    while (waitpid(-1, NULL, 0) > 0) {
    }
}

void tearDown(void)
{
    hal_viewer_close(&viewer);
    bury_all();
}

static int open_count(void)
{
    int count = 0;
    for (int fd = 0; fd < 256; fd++) {
        count += fcntl(fd, F_GETFD) >= 0 ? 1 : 0;
    }
    return count;
}

/* In place of the C library's. The process may get a processor only when nobody else wants it: its beginning is waited
 * for, however long it takes. */
int poll(struct pollfd *fds, nfds_t count, int timeout_ms)
{
    (void)timeout_ms;
    return ppoll(fds, count, NULL, NULL);
}

/* --- the process --- */

static void say(const char *text)
{
    send(HAL_VIEWER_SOCKET_FD, text, strlen(text), 0);
}

static char hear(void)
{
    char text[16] = "";
    return recv(HAL_VIEWER_SOCKET_FD, text, sizeof text, 0) > 0 ? text[0] : 0;
}

/* Wants a content, checks it, again and again; then says by its exit status how often. */
static int reader(void)
{
    struct hal_mailbox mailbox;
    int count = 0;
    if (!hal_mailbox_open(&mailbox, HAL_VIEWER_MAILBOX_FD, &error) ||
        mailbox.content_size < CONTENT) {
        say(error.text);
        return 1;
    }
    say(HAL_VIEWER_READY);
    for (hal_mailbox_want(&mailbox); hear() != 0; hal_mailbox_want(&mailbox)) {
        const unsigned char *content = hal_mailbox_content(&mailbox);
        for (int i = 0; content != NULL && i < CONTENT; i++) {
            if (content[i] != content[0]) {
                abort(); /* torn */
            }
        }
        count++;
        hal_mailbox_done(&mailbox);
    }
    return count;
}

/* Everything it was not given is away, and it cannot be stopped by a terminal. */
static int inherited(void)
{
    sigset_t blocked;
    sigprocmask(SIG_SETMASK, NULL, &blocked);
    bool good = open_count() == HAL_VIEWER_MAILBOX_FD + 1 && sigismember(&blocked, SIGINT) == 1 &&
                sigismember(&blocked, SIGTERM) == 1 && sigismember(&blocked, SIGHUP) == 1;
    for (int fd = 0; fd <= 2; fd++) {
        char byte = 0;
        good = good && read(fd, &byte, 1) == 0 && write(fd, "x", 1) == 1;
    }
    say(good ? HAL_VIEWER_READY : "more or less than it should have");
    return hear();
}

/* Broken, or worse: writes over all that is shared, and tries to make it smaller. */
static _Noreturn void rogue(void)
{
    size_t size = (size_t)lseek(HAL_VIEWER_MAILBOX_FD, 0, SEEK_END);
    unsigned char *shared =
        mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED, HAL_VIEWER_MAILBOX_FD, 0);
    bool cut = ftruncate(HAL_VIEWER_MAILBOX_FD, 0) == 0 ||
               fcntl(HAL_VIEWER_MAILBOX_FD, F_ADD_SEALS, F_SEAL_WRITE) == 0;
    say(cut ? "the mailbox can be cut" : HAL_VIEWER_READY);
    for (unsigned char value = 0;; value++) {
        const int wanted = 1;
        memset(shared, value, size);
        memcpy(shared, &wanted, sizeof wanted); /* the state comes first */
        struct timespec pause = {.tv_nsec = 100000};
        nanosleep(&pause, NULL);
    }
}

static bool refused(long result)
{
    return result == -1 && errno == EPERM;
}

static int jailed(void)
{
    char name[] = "/bin/true";
    char *const arguments[] = {name, NULL};
    const pid_t parent = getppid();
    bool good = hal_jail_enter(&error);
    good = good && fcntl(HAL_VIEWER_SOCKET_FD, F_SETFL, O_NONBLOCK | O_ASYNC) == 0 &&
           refused(fcntl(HAL_VIEWER_SOCKET_FD, F_SETOWN, parent)) &&
           refused(fcntl(HAL_VIEWER_SOCKET_FD, F_SETSIG, SIGKILL)) &&
           refused(fcntl(HAL_VIEWER_SOCKET_FD, F_DUPFD, 0)) &&
           fcntl(HAL_VIEWER_SOCKET_FD, F_SETFL, 0) == 0;
    good = good && refused(open("/dev/null", O_RDONLY)) && refused(open("/etc/passwd", O_RDONLY)) &&
           refused(socket(AF_INET, SOCK_STREAM, 0)) && refused(socket(AF_UNIX, SOCK_STREAM, 0)) &&
           refused(syscall(SYS_kill, getppid(), SIGCONT)) && refused(execv(name, arguments)) &&
           refused(syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0)) && refused(unlink("/nothing")) &&
           refused(syscall(SYS_process_vm_writev, getppid(), NULL, 0, NULL, 0, 0)) &&
           refused(syscall(SYS_ptrace, 0, 0, 0, 0)) && refused(syscall(SYS_memfd_create, "x", 0)) &&
           refused(syscall(SYS_setuid, 0)) && refused(syscall(SYS_ioctl, 0, 0, 0));
    void *memory = malloc(10 * 1000 * 1000); /* that it may */
    say(good && memory != NULL ? HAL_VIEWER_READY : "not in jail");
    _exit(hear());
}

static int child(const char *role)
{
    if (strcmp(role, "reader") == 0) {
        return reader();
    }
    if (strcmp(role, "inherited") == 0) {
        return inherited();
    }
    if (strcmp(role, "rogue") == 0) {
        rogue();
    }
    if (strcmp(role, "jailed") == 0) {
        return jailed();
    }
    if (strcmp(role, "complains") == 0) {
        say("something is wrong");
        return 1;
    }
    if (strcmp(role, "ready-and-dies") == 0) {
        say(HAL_VIEWER_READY);
        return 7;
    }
    if (strcmp(role, "lets-go") == 0) { /* but lives */
        say(HAL_VIEWER_READY);
        close(HAL_VIEWER_SOCKET_FD);
        for (;;) {
            pause();
        }
    }
    return 3; /* "dies": without a word */
}

/* --- what is said of it --- */

static void test_contents_come_whole(void)
{
    int shown = 0, port = 0;
    open_as("reader");
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, config(), &error), error.text);
    TEST_ASSERT_EQUAL_INT(1, sscanf(viewer.url, "http://127.0.0.1:%d/", &port));
    TEST_ASSERT_GREATER_THAN_INT(0, port);
    for (int round = 0; shown < 200; round++) {
        void *room = NULL;
        enum hal_look look = viewer.viewer.ask(viewer.viewer.context, &room, &error);
        TEST_ASSERT_NOT_EQUAL_MESSAGE(HAL_LOOK_GONE, look, error.text);
        TEST_ASSERT_EQUAL(look == HAL_LOOK_WANTED, room != NULL);
        if (look == HAL_LOOK_WANTED) {
            memset(room, round, CONTENT);
            viewer.viewer.show(viewer.viewer.context);
            shown++;
        } else {
            sched_yield();
        }
    }
}

static void test_nobody_wants_anything_at_first(void)
{
    void *room = NULL;
    open_as("inherited");
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, config(), &error), error.text);
    for (int i = 0; i < 100; i++) {
        TEST_ASSERT_EQUAL_INT(HAL_LOOK_NONE,
                              viewer.viewer.ask(viewer.viewer.context, &room, &error));
    }
    TEST_ASSERT_NULL(room);
}

static void test_inherits_what_it_is_given(void)
{
    int more = open("/dev/zero", O_RDONLY); /* without O_CLOEXEC */
    TEST_ASSERT_GREATER_OR_EQUAL_INT(0, more);
    open_as("inherited");
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, config(), &error), error.text);
    close(more);
}

static void test_jail(void)
{
    open_as("jailed");
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, config(), &error), error.text);
}

/* Whatever stands in what is shared: only frames are written, where they should be. */
static void test_a_rogue_reader_does_no_harm(void)
{
    int wanted = 0;
    open_as("rogue");
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, config(), &error), error.text);
    for (int i = 0; i < 20000 || wanted == 0; i++) {
        void *room = NULL;
        enum hal_look look = viewer.viewer.ask(viewer.viewer.context, &room, &error);
        TEST_ASSERT_NOT_EQUAL_MESSAGE(HAL_LOOK_GONE, look, error.text);
        if (look == HAL_LOOK_WANTED) {
            memset(room, 1, CONTENT);
            viewer.viewer.show(viewer.viewer.context);
            wanted++;
        }
    }
}

/* Told once, and nothing of it is left. */
static void assert_gone(const char *how)
{
    void *room = NULL;
    enum hal_look look = HAL_LOOK_NONE;
    while (look == HAL_LOOK_NONE) {
        look = viewer.viewer.ask(viewer.viewer.context, &room, &error);
    }
    TEST_ASSERT_EQUAL_INT(HAL_LOOK_GONE, look);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, how), error.text);
    TEST_ASSERT_EQUAL_INT(HAL_LOOK_NONE, viewer.viewer.ask(viewer.viewer.context, &room, &error));
    TEST_ASSERT_EQUAL_INT(-1, waitpid(-1, NULL, WNOHANG));
    TEST_ASSERT_EQUAL_INT(ECHILD, errno);
}

static void test_it_ends(void)
{
    open_as("ready-and-dies");
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, config(), &error), error.text);
    waitid(P_PID, (id_t)viewer.pid, &(siginfo_t){.si_pid = 0}, WEXITED | WNOWAIT);
    assert_gone("status 7");
}

static void test_it_is_killed(void)
{
    open_as("reader");
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, config(), &error), error.text);
    kill(viewer.pid, SIGKILL);
    waitid(P_PID, (id_t)viewer.pid, &(siginfo_t){.si_pid = 0}, WEXITED | WNOWAIT);
    assert_gone("signal 9");
}

static void test_it_lets_go(void)
{
    open_as("lets-go");
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, config(), &error), error.text);
    assert_gone("signal 9"); /* by us */
}

/* Who waits for a frame and is stopped gets one, and no more. */
static void test_it_is_stopped(void)
{
    int wanted = 0;
    open_as("reader");
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, config(), &error), error.text);
    kill(viewer.pid, SIGSTOP);
    waitid(P_PID, (id_t)viewer.pid, &(siginfo_t){.si_pid = 0}, WSTOPPED | WNOWAIT);
    for (int i = 0; i < 1000; i++) {
        void *room = NULL;
        enum hal_look look = viewer.viewer.ask(viewer.viewer.context, &room, &error);
        TEST_ASSERT_NOT_EQUAL_MESSAGE(HAL_LOOK_GONE, look, error.text);
        if (look == HAL_LOOK_WANTED) {
            viewer.viewer.show(viewer.viewer.context);
            wanted++;
        }
    }
    TEST_ASSERT_LESS_OR_EQUAL_INT(1, wanted);
}

/* role, program: which fails; what is said. Nothing is left of it. */
static void assert_fails(const char *role, const struct hal_viewer_config *with, const char *says)
{
    int before = open_count();
    open_as(role);
    TEST_ASSERT_FALSE_MESSAGE(hal_viewer_open(&viewer, with, &error), role);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, says), error.text);
    TEST_ASSERT_EQUAL_INT(before, open_count());
    TEST_ASSERT_EQUAL_INT(-1, waitpid(-1, NULL, WNOHANG));
}

static void test_it_does_not_begin(void)
{
    struct hal_viewer_config with = *config();
    assert_fails("complains", &with, "something is wrong");
    assert_fails("dies", &with, "status 3");
    with.program = "/nothing/here";
    assert_fails("reader", &with, "/nothing/here: No such file");
    with.content_size = HAL_MAILBOX_CONTENT_MAX + 1;
    assert_fails("reader", &with, "mailbox: 16777217 bytes, expected at most 16777216");
    with.content_size = CONTENT;
    with.program = NULL; /* where a program is that has none beside it */
    assert_fails("reader", &with, "lib/isohead/isohead_live: No such file");
}

static int held_fd;

/* A port that nobody is given meanwhile: bound here, though not listened at, and who binds to it by name may. */
static const char *hold_port(void)
{
    static char port[8];
    const int on = 1;
    struct sockaddr_in at = {.sin_family = AF_INET, .sin_addr = {htonl(INADDR_LOOPBACK)}};
    socklen_t size = sizeof at;
    held_fd = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    TEST_ASSERT_EQUAL_INT(0, setsockopt(held_fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on));
    TEST_ASSERT_EQUAL_INT(0, bind(held_fd, (struct sockaddr *)&at, size));
    TEST_ASSERT_EQUAL_INT(0, getsockname(held_fd, (struct sockaddr *)&at, &size));
    snprintf(port, sizeof port, "%d", (int)ntohs(at.sin_port));
    return port;
}

static void test_addresses(void)
{
    struct hal_viewer_config with = *config();
    with.host = "localhost";
    assert_fails("reader", &with, "localhost port 0: expected a numeric address");
    with.host = "192.0.2.1"; /* for documentation: nobody's */
    assert_fails("reader", &with, "192.0.2.1 port 0: cannot listen: Cannot assign");
    with.host = "0.0.0.0";
    with.port = hold_port();
    open_as("reader");
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, &with, &error), error.text);
    TEST_ASSERT_FALSE(viewer.is_local);
    char address[64];
    snprintf(address, sizeof address, "http://0.0.0.0:%s/", with.port);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(viewer.url, address), viewer.url);
    struct hal_viewer_process first = viewer;
    with.host = "127.0.0.1";
    setUp();
    TEST_ASSERT_FALSE(hal_viewer_open(&viewer, &with, &error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "Address already in use"), error.text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, with.port), error.text);
    pid_t pid = first.pid;
    hal_viewer_close(&first);
    bury_all();
    TEST_ASSERT_EQUAL_INT(-1, kill(pid, 0));
    TEST_ASSERT_TRUE_MESSAGE(hal_viewer_open(&viewer, &with, &error), error.text);
    TEST_ASSERT_TRUE(viewer.is_local);
    close(held_fd);
}

/* Another one each time, which is what its digits are for. */
static void test_tokens_differ(void)
{
    char tokens[20][HAL_MAILBOX_TOKEN + 1];
    for (int i = 0; i < 20; i++) {
        struct hal_mailbox mailbox;
        TEST_ASSERT_TRUE(hal_mailbox_create(&mailbox, 1, &error));
        strcpy(tokens[i], hal_mailbox_token(&mailbox));
        hal_mailbox_close(&mailbox);
        TEST_ASSERT_EQUAL_UINT64(HAL_MAILBOX_TOKEN, strspn(tokens[i], "0123456789abcdef"));
        TEST_ASSERT_EQUAL_UINT64(HAL_MAILBOX_TOKEN, strlen(tokens[i]));
        for (int k = 0; k < i; k++) {
            TEST_ASSERT_NOT_EQUAL(0, strcmp(tokens[i], tokens[k]));
        }
    }
}

static void test_mailbox_of_somebody_else(void)
{
    struct hal_mailbox mailbox;
    int fd = memfd_create("small", MFD_CLOEXEC);
    TEST_ASSERT_EQUAL_INT(0, ftruncate(fd, 10));
    TEST_ASSERT_FALSE(hal_mailbox_open(&mailbox, fd, &error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "10 bytes, expected more than"), error.text);
    TEST_ASSERT_EQUAL_INT(-1, fcntl(fd, F_GETFD)); /* it was the mailbox's */
    TEST_ASSERT_FALSE(hal_mailbox_open(&mailbox, 250, &error));
    TEST_ASSERT_EQUAL_INT(-1, mailbox.fd);
}

int main(int argument_count, char **arguments)
{
    const char *role = getenv(ROLE);
    if (strcmp(arguments[0], "isohead_live") == 0 && argument_count == 1) {
        return child(role);
    }
    TEST_ASSERT_NOT_NULL(realpath("/proc/self/exe", self));
    UNITY_BEGIN();
    RUN_TEST(test_contents_come_whole);
    RUN_TEST(test_nobody_wants_anything_at_first);
    RUN_TEST(test_inherits_what_it_is_given);
    RUN_TEST(test_jail);
    RUN_TEST(test_a_rogue_reader_does_no_harm);
    RUN_TEST(test_it_ends);
    RUN_TEST(test_it_is_killed);
    RUN_TEST(test_it_lets_go);
    RUN_TEST(test_it_is_stopped);
    RUN_TEST(test_it_does_not_begin);
    RUN_TEST(test_addresses);
    RUN_TEST(test_tokens_differ);
    RUN_TEST(test_mailbox_of_somebody_else);
    return UNITY_END();
}
