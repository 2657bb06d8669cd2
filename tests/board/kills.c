/* Kills and stops at random: a program with the real policy and its guards, real processes and signals,
 * and a line that all of them see.
 *
 *     kills COUNT [SEED]
 *
 * In each run one to four signals, SIGSTOP, SIGKILL or SIGCONT, go to the three processes in any order,
 * up to 60 ms apart, while the laser is on or about to be. Afterwards the line has to be low within
 * LIMIT_MS where any of the three runs. Where none does, the line is taken as --laser-off does it, which
 * ends them. A table says how long it took. Exit status 1 where it took longer, or a process is left.
 */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include "app_laser.h"
#include "linux/hal_clock.h"
#include "linux/hal_guard.h"

#define PROCESSES (1 + HAL_GUARD_COUNT)
#define CAP_US 200000
#define FRAME_US 40000
#define TICK_US 10000
/* The program feeds as hal_watchdog does. */
#define FEED_US 400000
/* The line is seen low for so long: it stays so. */
#define CALM_US 60000
/* None over 1 s; short runs on a machine with other work have more room, and so has this process where it
 * has to act itself. */
#define LIMIT_MS 1000
#define LIMIT_SHORT_MS 10000
#define SHORT_COUNT 200

enum { STATE_RUNS, STATE_STOPPED, STATE_DEAD };
enum { READY_NOT, READY, READY_NEVER };

/* How many of the three ran on after the last signal, and how long the line was high then. */
struct row {
    int count;
    int64_t sum_us, max_us;
};

static struct shared {
    _Atomic int level;
    _Atomic int64_t fall_us; /* when it last fell */
    _Atomic int pid[PROCESSES];
    _Atomic int is_ready;
} * shared;

static uint32_t random_state;
static int line_fd = -1;
static char line_name[32];
static struct hal_guard guard;

static int64_t now_us(void)
{
    return hal_clock.now_us(hal_clock.context);
}

/* 0 .. below - 1, the same in every run of a seed. */
static int random_below(int below)
{
    random_state = random_state * 1664525u + 1013904223u;
    return (int)((uint64_t)random_state * (uint32_t)below >> 32);
}

static bool line_open(void *context, struct hal_error *error)
{
    (void)context;
    line_fd = dup(STDOUT_FILENO);
    return line_fd >= 0 || hal_fail(error, "line: %s", strerror(errno));
}

static bool line_set(void *context, bool on, struct hal_error *error)
{
    (void)context;
    (void)error;
    if (atomic_exchange(&shared->level, on) == 1 && !on) {
        shared->fall_us = now_us();
    }
    return true;
}

static void line_close(void *context)
{
    struct hal_error ignored;
    if (line_fd >= 0) {
        line_set(context, false, &ignored);
        close(line_fd);
        line_fd = -1;
    }
}

static bool line_beat(void *context, struct hal_error *error)
{
    (void)context;
    (void)error;
    return true;
}

static bool line_interlock(void *context, bool *closed, struct hal_error *error)
{
    (void)context;
    (void)error;
    *closed = true;
    return true;
}

static bool line_level(void *context, bool *on, struct hal_error *error)
{
    (void)context;
    (void)error;
    *on = shared->level == 1;
    return true;
}

static bool line_prove(void *context, struct hal_error *unproven, struct hal_error *error)
{
    (void)context;
    (void)error;
    unproven->text[0] = 0;
    return true;
}

static const struct hal_strobe line = {.open = line_open,
                                       .close = line_close,
                                       .set = line_set,
                                       .beat = line_beat,
                                       .interlock = line_interlock,
                                       .level = line_level,
                                       .prove = line_prove};

/* A board program's loop: ticks, frames that are judged, light as in the mode gated or always. */
static void run_program(void)
{
    const struct hal_guard_config config = {
        .strobe = &line,
        .line_fd = &line_fd,
        .timeout_ms = HAL_GUARD_TIMEOUT_MS,
        .limits = {.cap_us = CAP_US, .duty_percent = 100},
        .line_name = line_name,
    };
    const struct app_laser_config policy = {true, 100, CAP_US};
    bool gated = random_below(2) == 1;
    struct app_laser laser;
    struct hal_error error;
    int64_t frame_us = now_us(), feed_us = frame_us;
    hal_guard_init(&guard, &config);
    app_laser_init(&laser, &policy, &guard.strobe, frame_us);
    bool good = app_laser_open(&laser, &error);
    for (int i = 0; good && i < HAL_GUARD_COUNT; i++) {
        shared->pid[1 + i] = guard.process[i].pid;
    }
    shared->pid[0] = getpid();
    shared->is_ready = good ? READY : READY_NEVER;
    app_laser_rig(&laser, true, now_us());
    app_laser_camera(&laser, true, FRAME_US, now_us());
    while (good && laser.failed.text[0] == 0) {
        int64_t wait_us = app_laser_tick(&laser, now_us());
        poll(NULL, 0, (int)((wait_us < TICK_US ? wait_us : TICK_US) / 1000));
        app_laser_wish(&laser, true, now_us());
        if (now_us() - frame_us >= FRAME_US) {
            frame_us = now_us();
            app_laser_busy(&laser, true, frame_us);
            app_laser_wish(&laser, !gated, now_us());
            poll(NULL, 0, random_below(8));
            app_laser_frame(&laser, now_us());
            app_laser_busy(&laser, false, now_us());
        }
        if (now_us() - feed_us >= FEED_US) {
            feed_us = now_us();
            good = hal_guard_feed(&guard, &error);
        }
    }
    app_laser_close(&laser, now_us());
    _exit(good ? 0 : 1);
}

/* Up to so long until the line is, and stays, low; when it fell. */
static bool wait_dark(int64_t limit_us, int64_t from_us, int64_t *took_us)
{
    int64_t end_us = now_us() + limit_us, low_us = -1;
    while (now_us() < end_us) {
        low_us = shared->level == 1 ? -1 : low_us < 0 ? now_us() : low_us;
        if (low_us >= 0 && now_us() - low_us >= CALM_US) {
            int64_t fall_us = shared->fall_us;
            *took_us = fall_us > from_us ? fall_us - from_us : 0;
            return true;
        }
        poll(NULL, 0, 2);
    }
    return false;
}

/* By descriptors, as the program collects its guards: their numbers may be others' by then. */
static int process_fd[PROCESSES];

static bool open_processes(void)
{
    bool good = true;
    for (int i = 0; i < PROCESSES; i++) {
        process_fd[i] = (int)syscall(SYS_pidfd_open, shared->pid[i], 0);
        good = good && process_fd[i] >= 0;
    }
    return good;
}

static bool send_signal(int process, int number)
{
    return syscall(SYS_pidfd_send_signal, process_fd[process], number, NULL, 0) == 0;
}

/* Whatever is left ends. */
static void end_all(void)
{
    for (int i = 0; i < PROCESSES; i++) {
        if (process_fd[i] >= 0) {
            send_signal(i, SIGKILL);
            close(process_fd[i]);
        }
    }
    while (waitpid(-1, NULL, 0) > 0 || errno == EINTR) {
    }
}

static void send_signals(int state[PROCESSES])
{
    static const int signals[] = {SIGSTOP, SIGSTOP, SIGKILL, SIGKILL, SIGCONT};
    int count = 1 + random_below(4);
    for (int i = 0; i < count; i++) {
        int victim = random_below(PROCESSES), number = signals[random_below(5)];
        if (state[victim] != STATE_DEAD && send_signal(victim, number)) {
            state[victim] = number == SIGSTOP   ? STATE_STOPPED
                            : number == SIGCONT ? STATE_RUNS
                                                : STATE_DEAD;
        }
        if (i + 1 < count) {
            poll(NULL, 0, random_below(60));
        }
    }
}

/* Again where it could not begin: a machine so busy that a guard needs seconds says nothing. */
static void begin_program(void)
{
    do {
        memset(shared, 0, sizeof *shared);
        if (fork() == 0) {
            run_program();
        }
        while (shared->is_ready == READY_NOT) {
            poll(NULL, 0, 1);
        }
        if (shared->is_ready == READY) {
            if (open_processes()) {
                return;
            }
            end_all();
        } else {
            waitpid(-1, NULL, 0);
        }
    } while (true);
}

static bool run_once(struct row rows[PROCESSES + 1], int64_t limit_us)
{
    int state[PROCESSES] = {STATE_RUNS};
    struct hal_error error;
    begin_program();
    poll(NULL, 0, random_below(80));
    send_signals(state);
    int64_t from_us = now_us(), took_us = 0;
    int running_count = 0;
    for (int i = 0; i < PROCESSES; i++) {
        running_count += state[i] == STATE_RUNS;
    }
    bool good = true;
    limit_us = running_count == 0 ? LIMIT_SHORT_MS * INT64_C(1000) : limit_us;
    if (running_count == PROCESSES) { /* continued before anybody minded: nothing is wrong */
        took_us = 0;
    } else if (running_count == 0) {
        good = hal_guard_end(line_name, &error) >= 0;
        line_set(NULL, false, &error); /* as taking the line does */
        took_us = now_us() - from_us;
    } else {
        good = wait_dark(limit_us, from_us, &took_us);
    }
    struct row *row = &rows[running_count];
    row->count++;
    row->sum_us += took_us;
    row->max_us = took_us > row->max_us ? took_us : row->max_us;
    if (!good || took_us > limit_us) {
        printf("program %d, guards %d and %d (0 runs, 1 stopped, 2 dead): high for %lld ms, %s\n",
               state[0], state[1], state[2], (long long)took_us / 1000,
               shared->level == 1 ? "and still" : "then low");
        good = false;
    }
    end_all();
    return good;
}

int main(int argument_count, char **arguments)
{
    struct row rows[PROCESSES + 1] = {{0}};
    long run_count = argument_count > 1 ? strtol(arguments[1], NULL, 10) : 0;
    long seed = argument_count > 2 ? strtol(arguments[2], NULL, 10) : 1;
    int bad_count = 0;
    if (run_count <= 0) {
        fprintf(stderr, "usage: kills COUNT [SEED]\n");
        return 2;
    }
    shared = mmap(NULL, sizeof *shared, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (shared == MAP_FAILED || prctl(PR_SET_CHILD_SUBREAPER, 1) != 0) {
        perror("kills");
        return 1;
    }
    snprintf(line_name, sizeof line_name, "kills.%d", (int)getpid());
    for (long run = 0; run < run_count; run++) {
        random_state = (uint32_t)(seed * 1000000 + run) * 2654435761u;
        bad_count +=
            !run_once(rows, (run_count > SHORT_COUNT ? LIMIT_MS : LIMIT_SHORT_MS) * INT64_C(1000));
    }
    printf("%ld runs; still running of program and two guards, runs, ms until dark: mean, max\n",
           run_count);
    for (int i = 0; i <= PROCESSES; i++) {
        double count = rows[i].count > 0 ? rows[i].count : 1;
        printf("  %d %6d %8.1f %8.1f\n", i, rows[i].count, (double)rows[i].sum_us / count / 1000,
               (double)rows[i].max_us / 1000);
    }
    printf("%d against the limit\n", bad_count);
    return bad_count > 0 ? 1 : 0;
}
