/* The guard: real processes that die in every way, and a line that all of them see. The program under
 * guard is a child of the test; orphaned guards become children of the test too, so that their end is
 * waited for and not guessed. */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <semaphore.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "ih_test.h"
#include "linux/hal_guard.h"
#include "linux/hal_guard_child.h"
#include "linux/hal_signals.h"

#define LONG_MS (1000 * 1000)
/* A limit of time that the machine's load is not to decide: many times what anything takes. */
#define WIDE_MS 60000
/* What is to wait for so long in a call waits for a guard: tests and guards wait for less at a time. */
#define GUARD_WAIT_MIN_MS 1000

/* Seen by every process. */
struct shared {
    volatile int level;
    volatile int taken;          /* opened and not closed */
    volatile int off_fail_count; /* as many settings to off fail */
    _Atomic int off_count;       /* settings to off */
    volatile int on_count;       /* settings to on */
    volatile pid_t guard_pid[HAL_GUARD_COUNT];
    volatile int unreadable;  /* the level */
    _Atomic int locked_count; /* guards that asked for their memory to stay */
    volatile int open_fails;
    /* The guard is made to end while set(true) is under way, and held between off and its end. */
    volatile int end_while_on;
    volatile int note_off; /* each setting to off by the guard sets is_off */
    sem_t is_off, may_end;
};

static struct shared *shared;
static pid_t test_pid;
static int line_fd = -1;
static int line_ends[2] = {
    -1, -1}; /* the reading end sees its end of file when no process holds the line */
static int interlock_fd = -1;
static struct hal_guard guard;
static struct hal_error error;

static int interrupt_count; /* so many calls of poll are interrupted */
/* How long a guard is waited for counts for the one behind this descriptor, once. A guard that gets no processor is
 * waited for, however long it takes, and neither killed nor said not to have begun. */
static int limited_fd = -1;
static int pidfd_errno; /* why there is no descriptor of a process */

/* In place of the C library's. */
int poll(struct pollfd *fds, nfds_t count, int timeout_ms)
{
    if (interrupt_count > 0) {
        interrupt_count--;
        errno = EINTR;
        return -1;
    }
    if (count > 0 && timeout_ms >= GUARD_WAIT_MIN_MS) {
        /* The header declares that poll does not read what it is given. */
        const struct pollfd *volatile request = fds;
        const bool is_limited = request->fd == limited_fd;
        timeout_ms = is_limited ? timeout_ms : -1;
        limited_fd = is_limited ? -1 : limited_fd;
    }
    return ((int (*)(struct pollfd *, nfds_t, int))dlsym(RTLD_NEXT, "poll"))(fds, count,
                                                                             timeout_ms);
}

long syscall(long number, ...)
{
    long values[4];
    va_list list;

    va_start(list, number);
    for (int i = 0; i < 4; i++) {
        values[i] = va_arg(list, long);
    }
    va_end(list);
    if (number == SYS_pidfd_open && pidfd_errno != 0) {
        errno = pidfd_errno;
        return -1;
    }
    return ((long (*)(long, ...))dlsym(RTLD_NEXT, "syscall"))(number, values[0], values[1],
                                                              values[2], values[3]);
}

/* Refused, as to who has no leave. */
int mlockall(int flags)
{
    shared->locked_count += flags == MCL_CURRENT;
    errno = ENOMEM;
    return -1;
}

static pid_t bystander_pid;
static int bystander_count; /* looks into its maps */

FILE *fopen(const char *path, const char *mode)
{
    char maps[32];

    snprintf(maps, sizeof maps, "/proc/%d/maps", (int)bystander_pid);
    bystander_count += strcmp(path, maps) == 0;
    return ((FILE * (*)(const char *, const char *)) dlsym(RTLD_NEXT, "fopen"))(path, mode);
}

/* What is left of an earlier opening. */
static void close_ends(void)
{
    for (int i = 0; i < 2; i++) {
        const int fd = i == 0 ? line_ends[0] : line_fd;
        if (fd >= 0) {
            close(fd);
        }
    }
    line_ends[0] = line_fd = -1;
}

static bool line_open(void *context, struct hal_error *why)
{
    (void)context;
    if (shared->open_fails) {
        return hal_fail(why, "line: refused");
    }
    close_ends();
    TEST_ASSERT_EQUAL_INT(0, pipe(line_ends));
    line_fd = line_ends[1];
    shared->level = 0;
    shared->taken = 1;
    return true;
}

static void line_close(void *context)
{
    (void)context;
    if (line_fd >= 0) {
        shared->level = 0;
        close(line_fd);
        shared->taken = 0;
    }
    line_fd = -1;
}

static bool line_set(void *context, bool on, struct hal_error *why)
{
    (void)context;
    if (on) {
        if (shared->end_while_on) {
            const char done = GUARD_DONE;

            TEST_ASSERT_EQUAL_INT(1, send(guard.process[0].socket_fd, &done, 1, 0));
            sem_wait(&shared->is_off);
        }
        shared->level = 1;
        shared->on_count++;
        return true;
    }
    shared->off_count++;
    if (shared->off_fail_count > 0) {
        shared->off_fail_count--;
        return hal_fail(why, "line: stuck");
    }
    shared->level = 0;
    if (shared->note_off && getpid() != test_pid) {
        sem_post(&shared->is_off);
    }
    if (shared->end_while_on && getpid() != test_pid) {
        sem_post(&shared->is_off);
        sem_wait(&shared->may_end);
    }
    return true;
}

static bool line_beat(void *context, struct hal_error *why)
{
    (void)context;
    return hal_fail(why, "line: beat");
}

static bool line_interlock(void *context, bool *closed, struct hal_error *why)
{
    (void)context;
    (void)why;
    *closed = true;
    return true;
}

static bool line_level(void *context, bool *on, struct hal_error *why)
{
    (void)context;
    *on = shared->level == 1;
    return shared->unreadable ? hal_fail(why, "line: unreadable") : true;
}

static const struct hal_strobe line = {.open = line_open,
                                       .close = line_close,
                                       .set = line_set,
                                       .beat = line_beat,
                                       .interlock = line_interlock,
                                       .level = line_level};

static char line_name[32]; /* of this test process alone */

static void init_with_cap(int timeout_ms, int cap_ms)
{
    const struct hal_guard_config config = {
        .strobe = &line,
        .line_fd = &line_fd,
        .timeout_ms = timeout_ms,
        .interlock_fd = &interlock_fd,
        .limits = {.cap_us = (int64_t)cap_ms * 1000, .duty_percent = 100},
        .line_name = line_name,
    };

    hal_guard_init(&guard, &config);
}

/* No cap that matters. */
static void init(int timeout_ms)
{
    init_with_cap(timeout_ms, LONG_MS);
}

static bool set(bool on)
{
    return guard.strobe.set(guard.strobe.context, on, &error);
}

static bool open_it(void)
{
    return guard.strobe.open(guard.strobe.context, &error);
}

static void close_it(void)
{
    guard.strobe.close(guard.strobe.context);
}

void setUp(void)
{
    memset((void *)shared, 0, sizeof *shared);
    sem_init(&shared->is_off, 1, 0);
    sem_init(&shared->may_end, 1, 0);
    memset(&error, 0, sizeof error);
    init(LONG_MS);
}

void tearDown(void)
{
    close_it();
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    /* No process is left over. */
    TEST_ASSERT_EQUAL_INT(-1, waitpid(-1, NULL, WNOHANG));
    TEST_ASSERT_EQUAL_INT(ECHILD, errno);
}

/* The exit status of one's own child, or of a guard whose program has been collected before: only
 * then it is certain to be a child of the test. */
static int end_of(pid_t pid)
{
    int status = 0;

    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    return status;
}

static void expect_exit(pid_t pid, int code)
{
    const int status = end_of(pid);

    TEST_ASSERT_TRUE(WIFEXITED(status));
    TEST_ASSERT_EQUAL_INT(code, WEXITSTATUS(status));
}

static void expect_guards_exit(int code)
{
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        expect_exit(shared->guard_pid[i], code);
    }
}

/* For good, since nothing here collects it: a guard of this very process has ended. */
static void wait_for_end_of_own_guard(int index)
{
    siginfo_t info;

    TEST_ASSERT_EQUAL_INT(0,
                          waitid(P_PID, (id_t)guard.process[index].pid, &info, WEXITED | WNOWAIT));
}

static void wait_for_end_of_own_guards(void)
{
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        wait_for_end_of_own_guard(i);
    }
}

/* The laser's state as the program sees it: false, and off, while a guard refuses. */
static bool is_closed(void)
{
    bool closed = false;

    return guard.strobe.interlock(guard.strobe.context, &closed, &error) && closed;
}

/* On for certain: on a slow machine a guard may be late, or have let go before. In between the guards get
 * the processor. */
static void switch_on(void)
{
    do {
        bool has_failed = false;
        poll(NULL, 0, 1);
        if (is_closed()) {
            has_failed = !set(true);
        } else {
            has_failed = error.text[0] != 0;
            set(false);
        }
        if (has_failed) {
            open_it();
        }
        memset(&error, 0, sizeof error);
    } while (shared->level == 0);
}

/* The same where a guard may end at any time, which is seen by set(true). */
static bool switch_on_once(void)
{
    bool good = true;

    shared->on_count = 0;
    while ((good = set(true)) && shared->on_count == 0) {
        is_closed();
        poll(NULL, 0, 1);
    }
    return good;
}

/* Switched on once, and no sign of life after it: both guards let go. One that let go, or refused, before the laser was
 * on has made the program send off to the other, which would then wait for nothing. */
static void switch_on_and_stay_silent(void)
{
    const char on = GUARD_ON;

    switch_on_once();
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        send(guard.process[i].socket_fd, &on, 1, MSG_NOSIGNAL | MSG_DONTWAIT);
    }
}

/* A program with its laser on, that then does one thing. It tells when it is about to. */
static pid_t program_with_cap(int timeout_ms, int cap_ms, void (*act)(void))
{
    int ready[2];
    char byte = 0;
    pid_t pid = 0;

    TEST_ASSERT_EQUAL_INT(0, pipe(ready));
    pid = fork();
    if (pid == 0) {
        init_with_cap(timeout_ms, cap_ms);
        open_it();
        switch_on();
        for (int i = 0; i < HAL_GUARD_COUNT; i++) {
            shared->guard_pid[i] = guard.process[i].pid;
        }
        byte = write(ready[1], "r", 1) == 1;
        act();
        for (;;) {
            pause();
        }
    }
    close(ready[1]);
    TEST_ASSERT_EQUAL_INT(1, read(ready[0], &byte, 1));
    close(ready[0]);
    return pid;
}

static pid_t program(int timeout_ms, void (*act)(void))
{
    return program_with_cap(timeout_ms, LONG_MS, act);
}

static void go_on(void)
{
}

static void leave(void)
{
    _exit(7);
}

static int64_t now_us(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

/* Until it is so; the test's own time is over after WIDE_MS. */
static void wait_until(bool (*is_so)(void))
{
    const int64_t end_us = now_us() + WIDE_MS * INT64_C(1000);
    bool good = false;

    while (!(good = is_so()) && now_us() < end_us) {
        poll(NULL, 0, 1);
    }
    TEST_ASSERT_TRUE(good);
}

static void killed_the_laser_goes_off(void)
{
    int64_t longest_us = 0;
    int i;

    for (i = 0; i < 20; i++) {
        const pid_t pid = program(LONG_MS, go_on);
        int64_t before_us, took_us;

        before_us = now_us();
        TEST_ASSERT_EQUAL_INT(0, kill(pid, SIGKILL));
        TEST_ASSERT_EQUAL_INT(SIGKILL, WTERMSIG(end_of(pid)));
        expect_guards_exit(GUARD_EXIT_GONE);
        took_us = now_us() - before_us;
        longest_us = took_us > longest_us ? took_us : longest_us;
        TEST_ASSERT_EQUAL_INT(0, shared->level);
    }
    printf("SIGKILL to guard ended, %d times: at most %lld us\n", i, (long long)longest_us);
}

static void left_without_a_word_the_laser_goes_off(void)
{
    const pid_t pid = program(LONG_MS, leave);

    expect_exit(pid, 7);
    expect_guards_exit(GUARD_EXIT_GONE);
    TEST_ASSERT_EQUAL_INT(0, shared->level);
}

static void stopped_the_laser_goes_off(void)
{
    const pid_t pid = program(50, go_on);
    struct pollfd ended[HAL_GUARD_COUNT];

    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        ended[i].fd = (int)syscall(SYS_pidfd_open, shared->guard_pid[i], 0);
        ended[i].events = POLLIN;
        TEST_ASSERT_TRUE(ended[i].fd >= 0);
    }
    TEST_ASSERT_EQUAL_INT(0, kill(pid, SIGSTOP));
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        TEST_ASSERT_EQUAL_INT(1, poll(&ended[i], 1, -1));
        close(ended[i].fd);
    }
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    TEST_ASSERT_EQUAL_INT(0, kill(pid, SIGKILL));
    end_of(pid);
    expect_guards_exit(GUARD_EXIT_LATE);
}

static void a_line_that_fails_is_tried_again(void)
{
    const pid_t pid = program(LONG_MS, go_on);

    shared->off_count = 0;
    shared->off_fail_count = 5;
    kill(pid, SIGKILL);
    end_of(pid);
    expect_guards_exit(GUARD_EXIT_GONE);
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(6, shared->off_count);
}

static void a_line_that_fails_for_good_is_given_up(void)
{
    const pid_t pid = program(LONG_MS, go_on);

    shared->off_count = 0;
    shared->off_fail_count = 1000 * 1000;
    kill(pid, SIGKILL);
    end_of(pid);
    expect_guards_exit(GUARD_EXIT_LINE);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(GUARD_OFF_TRIES, shared->off_count);
    shared->level = 0;
}

/* Signals that a terminal, a service manager or a user sends to the guard do not end it. */
static void signals_do_not_end_the_guard(void)
{
    static const int sent[] = {SIGTERM, SIGINT,  SIGHUP,  SIGQUIT, SIGUSR1, SIGUSR2,
                               SIGPIPE, SIGALRM, SIGTSTP, SIGTTIN, SIGTTOU, SIGCONT};
    const char done = GUARD_DONE;
    siginfo_t info;
    int i;

    TEST_ASSERT_TRUE_MESSAGE(open_it(), error.text);
    TEST_ASSERT_TRUE(set(true));
    for (i = 0; i < IH_TEST_COUNT(sent); i++) {
        TEST_ASSERT_EQUAL_INT(0, kill(guard.process[0].pid, sent[i]));
    }
    TEST_ASSERT_TRUE(hal_guard_feed(&guard, &error));
    switch_on();
    TEST_ASSERT_TRUE(getsid(guard.process[0].pid) == guard.process[0].pid);
    TEST_ASSERT_TRUE(getsid(0) != guard.process[0].pid);
    /* A signal that got through would come before this byte is read. */
    TEST_ASSERT_EQUAL_INT(1, send(guard.process[0].socket_fd, &done, 1, 0));
    TEST_ASSERT_EQUAL_INT(0, waitid(P_PID, (id_t)guard.process[0].pid, &info, WEXITED | WNOWAIT));
    TEST_ASSERT_EQUAL_INT(CLD_EXITED, info.si_code);
    TEST_ASSERT_EQUAL_INT(GUARD_EXIT_DONE, info.si_status);
}

static void catch_signals(void)
{
    static struct hal_signals signals;

    hal_signals_open(&signals, &guard.strobe, false, &error);
}

/* A fault in the guard itself, or what a service manager sends to all on its watchdog's behalf: the
 * handler that the guard has inherited switches off. The program must have it before the guard. */
static void dying_of_a_fault_the_guard_switches_off(void)
{
    const pid_t pid = fork();
    siginfo_t info;
    int status = 0;

    if (pid == 0) {
        catch_signals();
        if (!open_it() || !set(true)) {
            _exit(1);
        }
        kill(guard.process[0].pid, SIGABRT);
        if (waitid(P_PID, (id_t)guard.process[0].pid, &info, WEXITED | WNOWAIT) != 0) {
            _exit(2);
        }
        _exit((info.si_code != CLD_KILLED && info.si_code != CLD_DUMPED) ||
                      info.si_status != SIGABRT
                  ? 3
              : shared->level != 0 ? 4
                                   : 0);
    }
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    TEST_ASSERT_EQUAL_INT(0, status);
    /* The program has left its zombies to the test: the one, and the other that saw it die. */
    int aborted_count = 0;
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        TEST_ASSERT_TRUE(waitpid(-1, &status, 0) > 0);
        aborted_count += WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT;
    }
    TEST_ASSERT_EQUAL_INT(1, aborted_count);
}

/* The guard's off comes before the program's on: the program has to see that it is alone. Again where a
 * guard that got no processor made the other switch off, which is not the end that is meant here. */
static void switched_on_behind_the_guards_back_it_goes_off_again(void)
{
    bool is_on = true;

    for (int tries = 0; tries < 50 && is_on; tries++) {
        TEST_ASSERT_TRUE_MESSAGE(open_it(), error.text);
        sem_init(&shared->is_off, 1, 0);
        sem_init(&shared->may_end, 1, 0);
        shared->end_while_on = 1;
        is_on = switch_on_once();
        shared->end_while_on = 0;
        for (int i = 0; i < HAL_GUARD_COUNT; i++) {
            sem_post(&shared->may_end);
        }
    }
    TEST_ASSERT_FALSE(is_on);
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "has let go"), error.text);
}

static bool is_noted(void)
{
    return sem_trywait(&shared->is_off) == 0;
}

/* It moves while this process is busy, and is closed again already: the guard switches off, and this
 * process learns of both. */
static void a_moving_interlock_switches_off(void)
{
    struct pollfd event_waits = {.events = POLLIN};
    char event = 'e';
    bool closed = true;
    int ends[2];

    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    interlock_fd = event_waits.fd = ends[0];
    TEST_ASSERT_TRUE(open_it());
    switch_on();
    shared->note_off = 1;
    TEST_ASSERT_EQUAL_INT(1, write(ends[1], &event, 1));
    wait_until(is_noted);
    shared->note_off = 0;
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    TEST_ASSERT_EQUAL_INT(1, poll(&event_waits, 1, 0));
    TEST_ASSERT_TRUE_MESSAGE(hal_guard_feed(&guard, &error), error.text);
    TEST_ASSERT_TRUE(guard.strobe.interlock(guard.strobe.context, &closed, &error));
    TEST_ASSERT_FALSE_MESSAGE(closed, "the program would believe that the laser is on");
    TEST_ASSERT_EQUAL_INT(1, read(ends[0], &event, 1));
    while (!closed) {
        TEST_ASSERT_TRUE(guard.strobe.interlock(guard.strobe.context, &closed, &error));
    }
    close_it();
    interlock_fd = -1;
    close(ends[0]);
    close(ends[1]);
}

/* The line and the socket, and the interlock where there is one. */
static void holds_its_descriptors(bool has_interlock)
{
    char path[64], text[32] = "";
    int other[2], i, open_count = 0;
    ssize_t length;

    TEST_ASSERT_EQUAL_INT(0, pipe(other));
    interlock_fd = has_interlock ? other[0] : -1;
    TEST_ASSERT_TRUE(open_it());
    snprintf(path, sizeof path, "/proc/%d/comm", (int)guard.process[0].pid);
    i = open(path, O_RDONLY);
    length = read(i, text, sizeof text - 1);
    close(i);
    TEST_ASSERT_TRUE(length > 0);
    TEST_ASSERT_EQUAL_STRING("isohead-guard\n", text);
    for (i = 0; i < 256; i++) {
        snprintf(path, sizeof path, "/proc/%d/fd/%d", (int)guard.process[0].pid, i);
        open_count += readlink(path, text, sizeof text) >= 0;
        if (i == line_fd || (has_interlock && i == interlock_fd)) {
            TEST_ASSERT_TRUE(readlink(path, text, sizeof text) >= 0);
        }
    }
    TEST_ASSERT_EQUAL_INT(has_interlock ? 3 : 2, open_count);
    /* Not by the guard either: the end of this pipe is seen. */
    close(other[1]);
    TEST_ASSERT_EQUAL_INT(0, read(other[0], text, 1));
    close_it();
    interlock_fd = -1;
    close(other[0]);
}

static void its_memory_stays_where_it_may(void)
{
    shared->locked_count = 0;
    TEST_ASSERT_TRUE(open_it());
    TEST_ASSERT_EQUAL_INT(HAL_GUARD_COUNT, shared->locked_count);
}

static void it_is_named_and_holds_what_it_needs(void)
{
    holds_its_descriptors(false);
    holds_its_descriptors(true);
}

static void closed_the_guard_ends_and_gives_the_line_back(void)
{
    char byte;
    pid_t pid;

    TEST_ASSERT_TRUE(open_it());
    TEST_ASSERT_TRUE(set(true));
    pid = guard.process[0].pid;
    close_it();
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    TEST_ASSERT_EQUAL_INT(0, shared->taken);
    TEST_ASSERT_EQUAL_INT(0, read(line_ends[0], &byte, 1));
    TEST_ASSERT_EQUAL_INT(-1, kill(pid, 0));
    TEST_ASSERT_EQUAL_INT(ESRCH, errno);
    TEST_ASSERT_TRUE(hal_guard_feed(&guard, &error));
    TEST_ASSERT_TRUE(set(false));
    TEST_ASSERT_FALSE(set(true));
    TEST_ASSERT_EQUAL_INT(0, shared->level);
}

/* A signal comes while the program waits for its guards: it goes on waiting, and kills none. */
static void interrupted_it_goes_on_waiting(void)
{
    interrupt_count = 3;
    TEST_ASSERT_TRUE_MESSAGE(open_it(), error.text);
    TEST_ASSERT_EQUAL_INT(0, interrupt_count);
    shared->off_count = 0;
    interrupt_count = 3;
    close_it();
    TEST_ASSERT_EQUAL_INT(0, interrupt_count);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(1 + HAL_GUARD_COUNT, shared->off_count);
}

static void opened_again_the_old_guard_has_ended_first(void)
{
    pid_t first;

    TEST_ASSERT_TRUE(open_it());
    TEST_ASSERT_TRUE(set(true));
    first = guard.process[0].pid;
    TEST_ASSERT_TRUE(open_it());
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    TEST_ASSERT_TRUE(guard.process[0].pid != first);
    TEST_ASSERT_EQUAL_INT(-1, kill(first, 0));
    TEST_ASSERT_TRUE(set(true));
    TEST_ASSERT_TRUE(hal_guard_feed(&guard, &error));
}

static void an_opening_that_fails_has_no_guard(void)
{
    shared->open_fails = 1;
    TEST_ASSERT_FALSE(open_it());
    TEST_ASSERT_EQUAL_STRING("line: refused", error.text);
    TEST_ASSERT_FALSE(set(true));
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    shared->open_fails = 0;
    TEST_ASSERT_TRUE(open_it());
    TEST_ASSERT_TRUE(set(true));
    shared->open_fails = 1;
    TEST_ASSERT_FALSE(open_it());
    TEST_ASSERT_EQUAL_INT(0, shared->level);
}

/* Descriptors are used up but for a few: two are the line's, the page and the sockets need the rest. */
static void without_descriptors_the_line_is_given_back(void)
{
    int spare = 1;
    bool good = false;

    while (!good) {
        int fds[1024], count = 0;

        close_ends();
        while (count < IH_TEST_COUNT(fds) && (fds[count] = dup(STDOUT_FILENO)) >= 0) {
            count++;
        }
        TEST_ASSERT_TRUE_MESSAGE(count < IH_TEST_COUNT(fds), "no limit of descriptors was set");
        spare++;
        for (int i = 0; i < spare; i++) {
            close(fds[--count]);
        }
        good = open_it();
        while (count > 0) {
            close(fds[--count]);
        }
        if (!good) {
            TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "guard: "), error.text);
            TEST_ASSERT_EQUAL_INT(0, shared->taken);
            TEST_ASSERT_EQUAL_INT(-1, waitpid(-1, NULL, WNOHANG));
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(4, spare);
}

static void a_dead_guard_is_noticed(void)
{
    TEST_ASSERT_TRUE(open_it());
    TEST_ASSERT_TRUE(hal_guard_feed(&guard, &error));
    TEST_ASSERT_TRUE(set(true));
    kill(guard.process[0].pid, SIGKILL);
    wait_for_end_of_own_guard(0);
    TEST_ASSERT_FALSE(hal_guard_feed(&guard, &error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "died of signal 9"), error.text);
    TEST_ASSERT_FALSE(hal_guard_feed(&guard, &error));
    /* It cannot be switched on, and is off after trying. */
    TEST_ASSERT_FALSE(set(true));
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    TEST_ASSERT_TRUE(open_it());
    TEST_ASSERT_TRUE(set(true));
}

static void a_guard_that_was_stopped_is_noticed(void)
{
    siginfo_t info;

    TEST_ASSERT_TRUE(open_it());
    kill(guard.process[0].pid, SIGSTOP);
    TEST_ASSERT_EQUAL_INT(0, waitid(P_PID, (id_t)guard.process[0].pid, &info, WSTOPPED | WNOWAIT));
    TEST_ASSERT_FALSE(hal_guard_feed(&guard, &error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "stopped by signal"), error.text);
    kill(guard.process[0].pid, SIGCONT);
    TEST_ASSERT_EQUAL_INT(0, waitid(P_PID, (id_t)guard.process[0].pid, &info, WCONTINUED));
    TEST_ASSERT_TRUE_MESSAGE(hal_guard_feed(&guard, &error), error.text);
}

/* It takes as long as a guard is waited for. */
static void a_guard_that_was_stopped_can_be_replaced(void)
{
    TEST_ASSERT_TRUE(open_it());
    TEST_ASSERT_TRUE(set(true));
    kill(guard.process[0].pid, SIGSTOP);
    limited_fd = guard.process[0].socket_fd;
    TEST_ASSERT_TRUE(open_it());
    TEST_ASSERT_EQUAL_INT_MESSAGE(-1, limited_fd, "it was not waited for");
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    TEST_ASSERT_TRUE(set(true));
}

static void without_signs_of_life_it_lets_go(void)
{
    init(1);
    TEST_ASSERT_TRUE(open_it());
    switch_on_and_stay_silent();
    wait_for_end_of_own_guards();
    TEST_ASSERT_EQUAL_INT(0, shared->level);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(2, shared->off_count); /* in opening, and by the guard */
    TEST_ASSERT_FALSE(hal_guard_feed(&guard, &error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "no sign of life for 1 ms"), error.text);
    TEST_ASSERT_FALSE(set(true));
    TEST_ASSERT_EQUAL_INT(0, shared->level);
}

/* A camera that takes seconds to open does so with the laser off: no reason to let go. */
static void while_off_it_needs_no_sign_of_life(void)
{
    const int timeout_ms = 100;
    bool good = false;

    init(1);
    TEST_ASSERT_TRUE(open_it());
    poll(NULL, 0, 50);
    TEST_ASSERT_TRUE_MESSAGE(hal_guard_feed(&guard, &error), error.text);
    close_it();
    /* Again, where the machine was so slow that the guard was right to end between on and off. */
    for (int tries = 0; tries < 50 && !good; tries++) {
        init(timeout_ms);
        TEST_ASSERT_TRUE(open_it());
        good = set(true) && set(false);
        poll(NULL, 0, 2 * timeout_ms);
        good = good && hal_guard_feed(&guard, &error);
        close_it();
    }
    TEST_ASSERT_TRUE_MESSAGE(good, error.text);
}

/* The time starts anew with every sign of life. A machine that is so slow that a guard may have been right
 * to end before the sign says nothing, and is asked again. */
static void a_sign_of_life_starts_the_time_anew(void)
{
    const int timeout_ms = 500;
    int tries;

    for (tries = 0; tries < 50; tries++) {
        int64_t begun_us, fed_us;

        init(timeout_ms);
        TEST_ASSERT_TRUE(open_it());
        begun_us = now_us();
        switch_on_and_stay_silent();
        poll(NULL, 0, timeout_ms / 2);
        fed_us = now_us();
        if (hal_guard_feed(&guard, &error) && now_us() - begun_us < timeout_ms * 1000) {
            wait_for_end_of_own_guards();
            TEST_ASSERT_TRUE(now_us() - fed_us >= timeout_ms * 1000);
            return;
        }
        close_it();
    }
    TEST_FAIL_MESSAGE("in 50 tries no sign of life came in time");
}

static void the_rest_is_the_strobe_below(void)
{
    TEST_ASSERT_TRUE(open_it());
    wait_until(is_closed);
    TEST_ASSERT_FALSE(guard.strobe.beat(guard.strobe.context, &error));
    TEST_ASSERT_EQUAL_STRING("line: beat", error.text);
}

static bool is_dark(void)
{
    return shared->level == 0;
}

static bool is_refused(void)
{
    return !is_closed();
}

/* One guard stands still, the program is killed: the other guard acts. Either of the two. */
static void with_one_guard_stopped_the_other_acts(void)
{
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        const pid_t pid = program(LONG_MS, go_on);

        kill(shared->guard_pid[i], SIGSTOP);
        kill(pid, SIGKILL);
        end_of(pid);
        expect_exit(shared->guard_pid[1 - i], GUARD_EXIT_GONE);
        TEST_ASSERT_EQUAL_INT(0, shared->level);
        kill(shared->guard_pid[i], SIGKILL);
        end_of(shared->guard_pid[i]);
    }
}

/* The program stands still, one guard is killed. */
static void with_one_guard_killed_the_other_acts(void)
{
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        const pid_t pid = program(LONG_MS, go_on);

        kill(pid, SIGSTOP);
        kill(shared->guard_pid[i], SIGKILL);
        wait_until(is_dark);
        kill(pid, SIGKILL);
        end_of(pid);
        expect_exit(shared->guard_pid[1 - i], GUARD_EXIT_GONE);
        TEST_ASSERT_EQUAL_INT(SIGKILL, WTERMSIG(end_of(shared->guard_pid[i])));
    }
}

/* Both guards stand still: the program sees it before any feed. */
static void with_both_guards_stopped_the_program_sees_it(void)
{
    TEST_ASSERT_TRUE(open_it());
    switch_on();
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        siginfo_t info;
        kill(guard.process[i].pid, SIGSTOP);
        TEST_ASSERT_EQUAL_INT(0,
                              waitid(P_PID, (id_t)guard.process[i].pid, &info, WSTOPPED | WNOWAIT));
    }
    is_closed(); /* reports what a guard has switched off before it was stopped */
    wait_until(is_refused);
    TEST_ASSERT_TRUE(set(true));
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, shared->level, "on without a guard that lives");
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        kill(guard.process[i].pid, SIGCONT);
    }
    switch_on();
    TEST_ASSERT_TRUE_MESSAGE(hal_guard_feed(&guard, &error), error.text);
}

/* A loop that lives, feeds and never judges a frame. */
static void without_a_frame_the_guards_switch_off(void)
{
    init_with_cap(LONG_MS, 100);
    TEST_ASSERT_TRUE(open_it());
    switch_on();
    const int64_t before_us = now_us();
    wait_until(is_dark);
    printf("a cap of 100 ms: dark after %lld us\n", (long long)(now_us() - before_us));
    const int on_count = shared->on_count;
    TEST_ASSERT_TRUE(set(true));
    TEST_ASSERT_EQUAL_INT_MESSAGE(on_count, shared->on_count, "on again without a frame");
    TEST_ASSERT_TRUE(set(false));
    TEST_ASSERT_TRUE(guard.strobe.judged(guard.strobe.context, &error));
    switch_on();
    TEST_ASSERT_TRUE_MESSAGE(hal_guard_feed(&guard, &error), "a guard has ended");
}

/* With frames it stays on, for many times the cap. A machine that stands still for half a second makes the
 * guards right to switch off, and says nothing. */
static void with_frames_it_stays_on(void)
{
    int rise_count = 60;

    init_with_cap(LONG_MS, 500);
    TEST_ASSERT_TRUE(open_it());
    for (int tries = 0; tries < 20 && rise_count >= 20; tries++) {
        switch_on();
        rise_count = 1;
        for (int i = 0; i < 60; i++) {
            poll(NULL, 0, 30);
            struct hal_guard_view before, after;
            hal_guard_page_read(guard.page, now_us(), &before);
            TEST_ASSERT_TRUE(guard.strobe.judged(guard.strobe.context, &error));
            hal_guard_page_read(guard.page, now_us(), &after);
            TEST_ASSERT_TRUE(before.on_us <= after.judged_on_us &&
                             after.judged_on_us <= after.on_us);
            rise_count += shared->level == 0;
            switch_on();
        }
    }
    TEST_ASSERT_LESS_THAN_INT(20, rise_count);
}

/* Somebody else drives the line, or a bit of the program has changed. */
static void a_line_that_was_not_announced_goes_off(void)
{
    TEST_ASSERT_TRUE(open_it());
    shared->level = 1;
    wait_until(is_dark);
    TEST_ASSERT_FALSE(is_closed());
    switch_on();
}

/* A chip that cannot read its outputs: the guards go by what is announced. */
static void a_line_that_cannot_be_read_is_guarded_too(void)
{
    shared->unreadable = 1;
    init_with_cap(LONG_MS, 100);
    TEST_ASSERT_TRUE(open_it());
    switch_on();
    wait_until(is_dark);
}

/* Program killed, guards stopped: nobody acts. What --laser-off does ends them, and no one else. */
static void who_holds_the_line_can_be_ended(void)
{
    const pid_t pid = program(LONG_MS, go_on);
    char other_name[sizeof line_name + 1];

    TEST_ASSERT_TRUE(open_it());
    snprintf(other_name, sizeof other_name, "%s0", line_name);
    TEST_ASSERT_EQUAL_INT(0, hal_guard_end(other_name, &error));
    close_it();
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        kill(shared->guard_pid[i], SIGSTOP);
    }
    /* One that ends by itself meanwhile is none; one that cannot be ended is an error. */
    pidfd_errno = ESRCH;
    TEST_ASSERT_EQUAL_INT(0, hal_guard_end(line_name, &error));
    pidfd_errno = EPERM;
    TEST_ASSERT_EQUAL_INT(-1, hal_guard_end(line_name, &error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "cannot be ended"), error.text);
    pidfd_errno = 0;
    TEST_ASSERT_EQUAL_INT(0, waitpid(pid, NULL, WNOHANG));
    TEST_ASSERT_EQUAL_INT(1 + HAL_GUARD_COUNT, hal_guard_end(line_name, &error));
    TEST_ASSERT_EQUAL_INT(SIGKILL, WTERMSIG(end_of(pid)));
    for (int i = 0; i < HAL_GUARD_COUNT; i++) {
        TEST_ASSERT_EQUAL_INT(SIGKILL, WTERMSIG(end_of(shared->guard_pid[i])));
    }
    TEST_ASSERT_EQUAL_INT(0, hal_guard_end(line_name, &error));
    shared->level = 0;
}

/* Whose memory the kernel has locked would keep --laser-off waiting. */
static void nobody_else_is_looked_into(void)
{
    prctl(PR_SET_NAME, "bystander");
    bystander_pid = fork();
    if (bystander_pid == 0) {
        pause();
    }
    TEST_ASSERT_EQUAL_INT(0, hal_guard_end(line_name, &error));
    kill(bystander_pid, SIGKILL);
    TEST_ASSERT_EQUAL_INT(SIGKILL, WTERMSIG(end_of(bystander_pid)));
    TEST_ASSERT_EQUAL_INT(0, bystander_count);
    bystander_pid = 0;
}

int main(void)
{
    const struct rlimit files = {.rlim_cur = 200, .rlim_max = 200}, no_core = {0, 0};

    UNITY_BEGIN();
    test_pid = getpid();
    snprintf(line_name, sizeof line_name, "test.%d", (int)test_pid);
    setrlimit(RLIMIT_NOFILE, &files);
    setrlimit(RLIMIT_CORE, &no_core);
    prctl(PR_SET_CHILD_SUBREAPER, 1);
    shared = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED) {
        return 1;
    }
    RUN_TEST(killed_the_laser_goes_off);
    RUN_TEST(left_without_a_word_the_laser_goes_off);
    RUN_TEST(stopped_the_laser_goes_off);
    RUN_TEST(a_line_that_fails_is_tried_again);
    RUN_TEST(a_line_that_fails_for_good_is_given_up);
    RUN_TEST(signals_do_not_end_the_guard);
    RUN_TEST(dying_of_a_fault_the_guard_switches_off);
    RUN_TEST(switched_on_behind_the_guards_back_it_goes_off_again);
    RUN_TEST(a_moving_interlock_switches_off);
    RUN_TEST(it_is_named_and_holds_what_it_needs);
    RUN_TEST(its_memory_stays_where_it_may);
    RUN_TEST(closed_the_guard_ends_and_gives_the_line_back);
    RUN_TEST(interrupted_it_goes_on_waiting);
    RUN_TEST(opened_again_the_old_guard_has_ended_first);
    RUN_TEST(an_opening_that_fails_has_no_guard);
    RUN_TEST(without_descriptors_the_line_is_given_back);
    RUN_TEST(a_dead_guard_is_noticed);
    RUN_TEST(a_guard_that_was_stopped_is_noticed);
    RUN_TEST(a_guard_that_was_stopped_can_be_replaced);
    RUN_TEST(without_signs_of_life_it_lets_go);
    RUN_TEST(while_off_it_needs_no_sign_of_life);
    RUN_TEST(a_sign_of_life_starts_the_time_anew);
    RUN_TEST(the_rest_is_the_strobe_below);
    RUN_TEST(with_one_guard_stopped_the_other_acts);
    RUN_TEST(with_one_guard_killed_the_other_acts);
    RUN_TEST(with_both_guards_stopped_the_program_sees_it);
    RUN_TEST(without_a_frame_the_guards_switch_off);
    RUN_TEST(with_frames_it_stays_on);
    RUN_TEST(a_line_that_was_not_announced_goes_off);
    RUN_TEST(a_line_that_cannot_be_read_is_guarded_too);
    RUN_TEST(who_holds_the_line_can_be_ended);
    RUN_TEST(nobody_else_is_looked_into);
    return UNITY_END();
}
