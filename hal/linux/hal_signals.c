#include "linux/hal_signals.h"

#include <errno.h>
#include <signal.h>
#include <string.h>
#include <sys/signalfd.h>
#include <sys/syscall.h>
#include <unistd.h>

/* Plenty for a handler, with the registers of processors that save the most. */
#define SIGNAL_STACK_BYTES (64 * 1024)

/* A handler gets no context: what it needs has to be here. */
static const struct hal_strobe *volatile laser;
static char signal_stack[SIGNAL_STACK_BYTES];

static void set_default(int number)
{
    struct sigaction action = {.sa_handler = SIG_DFL};
    sigaction(number, &action, NULL);
}

static void die_switched_off(int number, siginfo_t *info, void *frame)
{
    const struct hal_strobe *strobe = laser;
    struct hal_error ignored;
    sigset_t set;
    (void)frame;
    if (strobe != NULL) {
        strobe->set(strobe->context, false, &ignored);
    }
    set_default(number);
    if (syscall(SYS_rt_tgsigqueueinfo, getpid(), syscall(SYS_gettid), number, info) != 0) {
        raise(number);
    }
    sigemptyset(&set);
    sigaddset(&set, number);
    sigprocmask(SIG_UNBLOCK, &set, NULL);
}

static bool is_one_of(int number, const int *list, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (list[i] == number) {
            return true;
        }
    }
    return false;
}

/* Those that cannot be caught, have no deadly default, or are read from the descriptor. */
static bool needs_no_handler(int number)
{
    static const int others[] = {SIGKILL, SIGSTOP, SIGCONT, SIGCHLD, SIGURG, SIGWINCH, SIGPIPE,
                                 SIGTSTP, SIGTTIN, SIGTTOU, SIGTERM, SIGINT, SIGHUP};
    return is_one_of(number, others, sizeof others / sizeof others[0]);
}

static bool catch_deadly(struct hal_error *error)
{
    const stack_t stack = {.ss_sp = signal_stack, .ss_size = sizeof signal_stack};
    struct sigaction action = {.sa_sigaction = die_switched_off,
                               .sa_flags = SA_SIGINFO | SA_ONSTACK};
    if (sigaltstack(&stack, NULL) != 0) {
        return hal_fail(error, "no stack for the handler: %s", strerror(errno));
    }
    /* Nothing else may interrupt the handler. */
    sigfillset(&action.sa_mask);
    for (int number = 1; number <= SIGRTMAX; number++) {
        /* Between the last usual one and SIGRTMIN are some that the C library keeps for itself. */
        bool reserved = number >= 32 && number < SIGRTMIN;
        if (!reserved && !needs_no_handler(number) && sigaction(number, &action, NULL) != 0) {
            return hal_fail(error, "cannot catch signal %d: %s", number, strerror(errno));
        }
    }
    return true;
}

static void ignore_some(void)
{
    static const int ignored[] = {SIGPIPE, SIGTSTP, SIGTTIN, SIGTTOU};
    const struct sigaction action = {.sa_handler = SIG_IGN};
    for (size_t i = 0; i < sizeof ignored / sizeof ignored[0]; i++) {
        sigaction(ignored[i], &action, NULL);
    }
    set_default(SIGCHLD);
}

bool hal_signals_open(struct hal_signals *signals, const struct hal_strobe *strobe, bool records,
                      struct hal_error *error)
{
    sigset_t read_ones;
    sigemptyset(&read_ones);
    sigaddset(&read_ones, SIGTERM);
    sigaddset(&read_ones, SIGINT);
    sigaddset(&read_ones, SIGHUP);
    if (records) {
        sigaddset(&read_ones, SIGUSR1);
    }
    signals->fd = -1;
    laser = strobe;
    ignore_some();
    /* Not SIG_BLOCK: what the parent had blocked, faults among it, would never come to a handler. */
    if (!catch_deadly(error)) {
        return false;
    }
    if (sigprocmask(SIG_SETMASK, &read_ones, NULL) != 0) {
        return hal_fail(error, "cannot block: %s", strerror(errno));
    }
    signals->fd = signalfd(-1, &read_ones, SFD_CLOEXEC | SFD_NONBLOCK);
    if (signals->fd < 0) {
        return hal_fail(error, "no descriptor to read them from: %s", strerror(errno));
    }
    return true;
}
