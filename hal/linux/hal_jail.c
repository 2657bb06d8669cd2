#include "linux/hal_jail.h"

#include <errno.h>
#include <fcntl.h>
#include <grp.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <signal.h>
#include <stddef.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#define NOBODY 65534

#if defined(__x86_64__)
#define ARCHITECTURE AUDIT_ARCH_X86_64
#elif defined(__aarch64__)
#define ARCHITECTURE AUDIT_ARCH_AARCH64
#elif defined(__arm__)
#define ARCHITECTURE AUDIT_ARCH_ARM
#else
#error "hal_jail does not know this processor's calling convention: add it here"
#endif

/* What serving takes, under all the names that the C library may use for it. */
static const int allowed[] = {
    SYS_read,
    SYS_write,
    SYS_readv,
    SYS_writev,
    SYS_recvfrom,
    SYS_recvmsg,
    SYS_sendto,
    SYS_sendmsg,
    SYS_accept4,
    SYS_shutdown,
    SYS_close,
    SYS_getsockname,
    SYS_getpeername,
    SYS_getsockopt,
    SYS_setsockopt,
    SYS_epoll_ctl,
    SYS_epoll_pwait,
    SYS_ppoll,
    SYS_clock_gettime,
    SYS_gettimeofday,
    SYS_futex,
    SYS_brk,
    SYS_munmap,
    SYS_mremap,
    SYS_madvise,
    SYS_rt_sigreturn,
    SYS_rt_sigprocmask,
    SYS_restart_syscall,
    SYS_exit_group,
    SYS_sched_yield,
#ifdef SYS_accept
    SYS_accept,
#endif
#ifdef SYS_recv
    SYS_recv,
    SYS_send,
#endif
#ifdef SYS_epoll_wait
    SYS_epoll_wait,
#endif
#ifdef SYS_poll
    SYS_poll,
#endif
#ifdef SYS_mmap
    SYS_mmap,
#endif
#ifdef SYS_mmap2
    SYS_mmap2,
#endif
#ifdef SYS_time
    SYS_time,
#endif
#ifdef SYS_sigreturn
    SYS_sigreturn,
#endif
#ifdef SYS_clock_gettime64
    SYS_clock_gettime64,
    SYS_ppoll_time64,
    SYS_futex_time64,
#endif
};

/* Of a descriptor its flags alone: whoever may name its owner and its signal can have the kernel kill the
 * program, as it runs as the same user. */
static const int descriptor_calls[] = {
    SYS_fcntl,
#ifdef SYS_fcntl64
    SYS_fcntl64,
#endif
};
static const int descriptor_commands[] = {F_GETFD, F_SETFD, F_GETFL, F_SETFL};

#define ALLOWED_COUNT (sizeof allowed / sizeof allowed[0])
#define CALL_COUNT (sizeof descriptor_calls / sizeof descriptor_calls[0])
#define COMMAND_COUNT (sizeof descriptor_commands / sizeof descriptor_commands[0])
/* Rules for one of them: its command, and what that may be. */
#define CALL_RULES (2 * COMMAND_COUNT + 2)
#define LOAD(member) \
    (struct sock_filter) BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, member))
#define UNLESS(value, skipped) \
    (struct sock_filter) BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (value), 0, (skipped))
#define RETURN(what) (struct sock_filter) BPF_STMT(BPF_RET | BPF_K, (what))

/* Appended to the rules; how many there are then. The kernel takes the lower half of the argument, which
 * comes first on these processors. */
static size_t filter_descriptor_calls(struct sock_filter rule[], size_t count)
{
    for (size_t i = 0; i < CALL_COUNT; i++) {
        rule[count++] = UNLESS((uint32_t)descriptor_calls[i], CALL_RULES);
        rule[count++] = LOAD(args[1]);
        for (size_t k = 0; k < COMMAND_COUNT; k++) {
            rule[count++] = UNLESS((uint32_t)descriptor_commands[k], 1);
            rule[count++] = RETURN(SECCOMP_RET_ALLOW);
        }
        rule[count++] = RETURN(SECCOMP_RET_ERRNO | EPERM);
    }
    return count;
}

static bool filter_calls(struct hal_error *error)
{
    struct sock_filter rule[2 * ALLOWED_COUNT + CALL_COUNT * (1 + CALL_RULES) + 5];
    size_t count = 0;
    rule[count++] = LOAD(arch);
    /* Skipped: the next one. */
    rule[count] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, ARCHITECTURE, 1, 0);
    count++;
    rule[count++] = RETURN(SECCOMP_RET_KILL_PROCESS);
    rule[count++] = LOAD(nr);
    for (size_t i = 0; i < ALLOWED_COUNT; i++) {
        rule[count++] = UNLESS((uint32_t)allowed[i], 1);
        rule[count++] = RETURN(SECCOMP_RET_ALLOW);
    }
    count = filter_descriptor_calls(rule, count);
    rule[count++] = RETURN(SECCOMP_RET_ERRNO | EPERM);
    const struct sock_fprog program = {.len = (unsigned short)count, .filter = rule};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
        prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0) {
        return hal_fail(error,
                        "its system calls cannot be limited: %s, expected a kernel with seccomp",
                        strerror(errno));
    }
    return true;
}

bool hal_jail_enter(struct hal_error *error)
{
    const struct sched_param none = {.sched_priority = 0};
    if (geteuid() == 0 && (setgroups(0, NULL) != 0 || setresgid(NOBODY, NOBODY, NOBODY) != 0 ||
                           setresuid(NOBODY, NOBODY, NOBODY) != 0)) {
        return hal_fail(error, "root's rights cannot be given up: %s", strerror(errno));
    }
    /* The second again: the kernel forgets it when the user changes. */
    if (prctl(PR_SET_DUMPABLE, 0) != 0 || prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) {
        return hal_fail(error, "it cannot be kept from dumping core or outliving the program: %s",
                        strerror(errno));
    }
    /* Late: its beginning is waited for, and from here on it takes as long as others want the processor. */
    if (sched_setscheduler(0, SCHED_IDLE, &none) != 0) {
        return hal_fail(error, "its priority cannot be lowered: %s", strerror(errno));
    }
    return filter_calls(error);
}
