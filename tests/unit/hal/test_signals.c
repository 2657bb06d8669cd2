/* Processes that die of every deadly signal, by themselves and by real faults: the line is low, and
 * the status is that of a process without a handler. */
#include <signal.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "ih_test.h"
#include "linux/hal_signals.h"

static volatile int *level; /* seen by every process */
static char *forbidden;     /* a page that must not be touched */
static volatile int deepest;
static int signal_number;
static struct hal_signals signals;
static struct hal_error error;

static bool line_set(void *context, bool on, struct hal_error *why)
{
    (void)context;
    (void)why;
    *level = on;
    return true;
}

static const struct hal_strobe strobe = {.set = line_set};

void setUp(void)
{
}

void tearDown(void)
{
}

/* A process that opens the signals, switches on and acts; its status. */
static int run(const struct hal_strobe *laser, void (*act)(void))
{
    int status = 0;
    const pid_t pid = fork();

    if (pid == 0) {
        if (!hal_signals_open(&signals, laser, false, &error)) {
            _exit(99);
        }
        *level = 1;
        act();
        _exit(0);
    }
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    return status;
}

static void expect_death(int number, void (*act)(void))
{
    const int status = run(&strobe, act);

    IH_TEST_EQUAL(true, WIFSIGNALED(status), "died of a signal", number);
    IH_TEST_EQUAL(number, WTERMSIG(status), "signal", number);
    IH_TEST_EQUAL(0, *level, "laser", number);
}

static void send_itself(void)
{
    kill(getpid(), signal_number);
}

static void raise_it(void)
{
    raise(signal_number);
}

static void touch(void)
{
    *(volatile char *)forbidden = 1;
}

static void touch_behind_a_file(void)
{
    FILE *file = tmpfile();
    volatile char *page = mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, fileno(file), 0);

    page[0] = 1;
}

/* Each call needs some stack, so that it ends where the stack does. */
static __attribute__((noinline)) int dive(int depth)
{
    volatile char room[4096];

    room[depth % 4096] = (char)depth;
    return depth >= deepest ? room[0] : dive(depth + 1) + room[depth % 4096];
}

static void overflow(void)
{
    deepest = 1 << 30;
    *level = dive(0) == 7 ? 1 : 1;
}

static void every_deadly_signal_switches_off_and_kills(void)
{
    static const int plain[] = {SIGSEGV, SIGBUS,  SIGFPE,  SIGILL,  SIGABRT, SIGQUIT,
                                SIGSYS,  SIGTRAP, SIGUSR1, SIGUSR2, SIGALRM, SIGVTALRM,
                                SIGPROF, SIGPOLL, SIGXCPU, SIGXFSZ, SIGPWR,  SIGSTKFLT};
    int i;

    for (i = 0; i < IH_TEST_COUNT(plain); i++) {
        signal_number = plain[i];
        expect_death(signal_number, send_itself);
        expect_death(signal_number, raise_it);
    }
    for (signal_number = SIGRTMIN; signal_number <= SIGRTMAX; signal_number++) {
        expect_death(signal_number, send_itself);
    }
}

static void real_faults_switch_off_and_kill(void)
{
    expect_death(SIGABRT, abort);
    expect_death(SIGSEGV, touch);
    expect_death(SIGBUS, touch_behind_a_file);
    expect_death(SIGSEGV, overflow);
}

static void what_the_parent_had_blocked_is_caught(void)
{
    sigset_t all, before;

    sigfillset(&all);
    sigprocmask(SIG_SETMASK, &all, &before);
    signal_number = SIGQUIT;
    expect_death(SIGQUIT, send_itself);
    expect_death(SIGSEGV, touch);
    sigprocmask(SIG_SETMASK, &before, NULL);
}

static void without_a_laser_they_kill_all_the_same(void)
{
    const int status = run(NULL, touch);

    TEST_ASSERT_TRUE(WIFSIGNALED(status));
    TEST_ASSERT_EQUAL_INT(SIGSEGV, WTERMSIG(status));
}

static void be_traced_and_touch(void)
{
    ptrace(PTRACE_TRACEME, 0, NULL, NULL);
    touch();
}

/* Stopped by the fault, and by what the handler sends again: both say the same. */
static void expect_fault(pid_t pid)
{
    siginfo_t info;
    int status = 0;

    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    TEST_ASSERT_TRUE(WIFSTOPPED(status));
    TEST_ASSERT_EQUAL_INT(SIGSEGV, WSTOPSIG(status));
    TEST_ASSERT_EQUAL_INT(0, ptrace(PTRACE_GETSIGINFO, pid, NULL, &info));
    TEST_ASSERT_EQUAL_INT(SEGV_ACCERR, info.si_code);
    TEST_ASSERT_EQUAL_PTR(forbidden, info.si_addr);
}

static void the_signal_keeps_its_data(void)
{
    int status = 0;
    const pid_t pid = fork();

    if (pid == 0) {
        hal_signals_open(&signals, &strobe, false, &error);
        *level = 1;
        be_traced_and_touch();
        _exit(0);
    }
    expect_fault(pid);
    TEST_ASSERT_EQUAL_INT(1, *level);
    TEST_ASSERT_EQUAL_INT(0, ptrace(PTRACE_CONT, pid, NULL, SIGSEGV));
    expect_fault(pid);
    TEST_ASSERT_EQUAL_INT(0, *level);
    TEST_ASSERT_EQUAL_INT(0, ptrace(PTRACE_CONT, pid, NULL, SIGSEGV));
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    TEST_ASSERT_TRUE(WIFSIGNALED(status));
    TEST_ASSERT_EQUAL_INT(SIGSEGV, WTERMSIG(status));
}

/* In a child: these change the process. The exit status is the line that failed. */
#define OR_EXIT(condition)             \
    do {                               \
        if (!(condition)) {            \
            _exit(__LINE__ % 251 + 1); \
        }                              \
    } while (0)

static void receive_orderly_signals(void)
{
    static const int harmless[] = {SIGPIPE, SIGTSTP, SIGTTIN, SIGTTOU, SIGCONT, SIGURG, SIGWINCH};
    char bytes[4096];
    int i, ends[2];

    for (i = 0; i < IH_TEST_COUNT(harmless); i++) {
        kill(getpid(), harmless[i]);
    }
    OR_EXIT(read(signals.fd, bytes, sizeof bytes) == -1);
    OR_EXIT(pipe(ends) == 0);
    close(ends[0]);
    OR_EXIT(write(ends[1], "", 1) == -1);
    kill(getpid(), SIGTERM);
    kill(getpid(), SIGINT);
    kill(getpid(), SIGHUP);
    /* Three records of 128 bytes; the kernel's own size. */
    OR_EXIT(read(signals.fd, bytes, sizeof bytes) == 3 * 128);
    OR_EXIT(*level == 1);
    OR_EXIT(signal(SIGCHLD, SIG_DFL) == SIG_DFL);
}

static void orderly_signals_are_read_and_harmless_ones_do_nothing(void)
{
    const pid_t pid = fork();
    int status = 0;

    if (pid == 0) {
        signal(SIGCHLD, SIG_IGN); /* as inherited; in the test itself a quick child would be lost */
        OR_EXIT(hal_signals_open(&signals, &strobe, false, &error));
        *level = 1;
        receive_orderly_signals();
        _exit(0);
    }
    TEST_ASSERT_EQUAL_INT(pid, waitpid(pid, &status, 0));
    TEST_ASSERT_EQUAL_INT(0, status);
}

int main(void)
{
    const struct rlimit none = {0, 0}, small = {1 << 20, RLIM_INFINITY};

    UNITY_BEGIN();
    /* No core files; and a stack that overflows soon. */
    setrlimit(RLIMIT_CORE, &none);
    setrlimit(RLIMIT_STACK, &small);
    level = mmap(NULL, 4096, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    forbidden = mmap(NULL, 4096, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (level == MAP_FAILED || forbidden == MAP_FAILED) {
        return 1;
    }
    RUN_TEST(every_deadly_signal_switches_off_and_kills);
    RUN_TEST(real_faults_switch_off_and_kill);
    RUN_TEST(what_the_parent_had_blocked_is_caught);
    RUN_TEST(without_a_laser_they_kill_all_the_same);
    RUN_TEST(the_signal_keeps_its_data);
    RUN_TEST(orderly_signals_are_read_and_harmless_ones_do_nothing);
    return UNITY_END();
}
