/* laser_skips - each instruction of the laser's policy, left out once in a call. A part of test_laser.c.
 *
 * For a 64-bit ARM, where each instruction is as long as a no-op, and with the policy in a section of that
 * name (tests/checks/laser_skips.sh). The guards' limits run beside it, as in the test's other schedules.
 *
 * A call that does not come back is the end of the program, at which the line goes low (hal_signals), or
 * an endless loop, in which it stays as it is. A tick that says a longer wait than it should is believed.
 */
#ifndef LASER_SKIPS_H
#define LASER_SKIPS_H

#include <setjmp.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <unistd.h>

#define NO_OP 0xd503201fu
#define BREAK 0xd4200000u
/* In processor time, which a loaded machine does not change. A call takes some microseconds. */
#define LOOPS_US 50000
#define RUN_LOOPS_US 500000
/* Half a second with frames, and one without, which is longer than cap and slack. */
#define AFTER_US 1500000
#define BLOCK 16
#define SKIP_CALLS (3 * FRAME_CALLS)

/* Of two frames and a third that does not come: each kind of call, and the waiting without a frame. The
 * environment's LASER_SKIPS_ALL has all of them tried. */
static const bool is_in_short[SKIP_CALLS] = {[4] = true,  [5] = true,  [6] = true,  [7] = true,
                                             [11] = true, [16] = true, [19] = true, [22] = true};

extern uint32_t __start_policy[], __stop_policy[];
static sigjmp_buf before_call;
enum { CAME_BACK = -1, RUNS_ON = -1 };

/* All that a call can change. Edges are only added. */
struct situation {
    struct app_laser laser;
    unsigned char fake[sizeof fake];
    unsigned char schedule[offsetof(struct schedule, edge_us)];
};

static void keep(struct situation *situation)
{
    situation->laser = laser;
    memcpy(situation->fake, &fake, sizeof fake);
    memcpy(situation->schedule, &schedule, sizeof situation->schedule);
}

static void restore(const struct situation *situation)
{
    laser = situation->laser;
    memcpy(&fake, situation->fake, sizeof fake);
    memcpy(&schedule, situation->schedule, sizeof situation->schedule);
}

static bool is_as_in(const struct situation *situation)
{
    return memcmp(&laser, &situation->laser, sizeof laser) == 0 &&
           memcmp(&fake, situation->fake, sizeof fake) == 0 &&
           memcmp(&schedule, situation->schedule, sizeof situation->schedule) == 0;
}

/* Instructions of the policy, and what they were. */
static uint32_t kept[BLOCK];

/* Code cannot be written to while it runs, as on a board: a wild write ends the program. */
static void set_writable(bool is_writable)
{
    uintptr_t page = (uintptr_t)sysconf(_SC_PAGESIZE);
    uintptr_t begin = (uintptr_t)__start_policy / page * page;
    if (mprotect((void *)begin, (uintptr_t)__stop_policy - begin,
                 PROT_READ | (is_writable ? PROT_WRITE : PROT_EXEC)) != 0) {
        abort();
    }
}

static void replace(uint32_t *at, int count, uint32_t instruction)
{
    set_writable(true);
    for (int i = 0; i < count; i++) {
        kept[i] = at[i];
        at[i] = instruction;
    }
    __builtin___clear_cache((char *)at, (char *)(at + count));
    set_writable(false);
}

static void put_back(uint32_t *at, int count)
{
    set_writable(true);
    memcpy(at, kept, (size_t)count * sizeof *at);
    __builtin___clear_cache((char *)at, (char *)(at + count));
    set_writable(false);
}

static void come_back(int number)
{
    siglongjmp(before_call, number);
}

static __attribute__((noinline)) void call_with_room(int call, bool has_frame)
{
    volatile char room[1024]; /* for a function without its prologue to write to */
    room[0] = 0;
    if (call == RUNS_ON) {
        run_flipped(schedule.now_us + AFTER_US);
    } else {
        call_policy(call, has_frame);
    }
    room[1] = room[0];
}

/* 0, or the signal that ended it. Registers and stack are those before the call, whatever it did to them. */
static int call_and_come_back(int call, bool has_frame)
{
    const struct itimerval none = {.it_value = {0}};
    const struct itimerval limit = {
        .it_value = {.tv_usec = call == RUNS_ON ? RUN_LOOPS_US : LOOPS_US}};
    volatile int ended_by = sigsetjmp(before_call, 1);
    if (ended_by == 0) {
        setitimer(ITIMER_VIRTUAL, &limit, NULL);
        call_with_room(call, has_frame);
        siglongjmp(before_call, CAME_BACK);
    }
    setitimer(ITIMER_VIRTUAL, &none, NULL);
    return ended_by == CAME_BACK ? 0 : ended_by;
}

static void catch_ends(void)
{
    static const int ends[] = {SIGSEGV, SIGBUS, SIGILL, SIGTRAP, SIGFPE, SIGABRT, SIGVTALRM};
    static char room[65536];
    const stack_t stack = {.ss_sp = room, .ss_size = sizeof room};
    const struct sigaction action = {.sa_handler = come_back, .sa_flags = SA_ONSTACK};
    TEST_ASSERT_EQUAL_INT(0, sigaltstack(&stack, NULL));
    for (size_t i = 0; i < sizeof ends / sizeof ends[0]; i++) {
        TEST_ASSERT_EQUAL_INT(0, sigaction(ends[i], &action, NULL));
    }
}

static struct {
    int call_count, all, with_effect, ended, looped, cut;
    int64_t worst_us;
} skips;

/* The wait that a tick returned, where that is longer than the right wait. */
static void pass_the_wait(int call, const struct situation *after)
{
    int64_t right_us;
    memcpy(&right_us, after->fake + ((char *)&fake.wait_us - (char *)&fake), sizeof right_us);
    if (fake.wait_us == right_us) {
        pass_after(call);
    } else {
        pass(fake.wait_us < 0 || fake.wait_us > AFTER_US ? AFTER_US : fake.wait_us);
    }
}

/* What becomes of the laser after a call with a skip in it that ended so. */
static void judge_skip(int32_t duty, int call, int ended_by, const struct situation *after,
                       int instruction)
{
    const int64_t late_us = HAL_LIMITS_SLACK_US + LOOK_US;
    int cut_count = schedule.cut_count;
    skips.with_effect++;
    if (ended_by == 0) {
        pass_the_wait(call, after);
        ended_by = call_and_come_back(RUNS_ON, false); /* what is left may end it later */
    }
    if (ended_by != 0) {
        fake.line = fake.line && ended_by == SIGVTALRM;
        pass(AFTER_US);
    }
    skips.looped += ended_by == SIGVTALRM;
    skips.ended += ended_by != 0 && ended_by != SIGVTALRM;
    end_flipped();
    skips.cut += schedule.cut_count > cut_count;
    skips.worst_us =
        schedule.silent_max_us > skips.worst_us ? schedule.silent_max_us : skips.worst_us;
    char where[80];
    snprintf(where, sizeof where, "duty %d, call %d, without instruction %d of the policy",
             (int)duty, call, instruction);
    TEST_ASSERT_LESS_OR_EQUAL_INT64_MESSAGE(CAP_US + late_us, schedule.silent_max_us, where);
    assert_duty(duty, late_us);
}

/* Is one of these instructions reached in this call? */
static bool is_reached(uint32_t *at, int count, int call, bool has_frame)
{
    replace(at, count, BREAK);
    int ended_by = call_and_come_back(call, has_frame);
    put_back(at, count);
    return ended_by != 0;
}

static void skip_in_call(int32_t duty, int call, bool has_frame)
{
    static struct situation before, after;
    keep(&before);
    call_policy(call, has_frame);
    keep(&after);
    for (uint32_t *block = __start_policy; block < __stop_policy; block += BLOCK) {
        int count = __stop_policy - block < BLOCK ? (int)(__stop_policy - block) : BLOCK;
        restore(&before);
        bool reached = is_reached(block, count, call, has_frame);
        for (int i = 0; i < count && reached; i++) {
            restore(&before);
            replace(&block[i], 1, NO_OP);
            int ended_by = call_and_come_back(call, has_frame);
            put_back(&block[i], 1);
            skips.all++;
            if (ended_by != 0 || !is_as_in(&after)) {
                judge_skip(duty, call, ended_by, &after, (int)(&block[i] - __start_policy));
            }
        }
    }
    restore(&after);
    skips.call_count++;
}

/* Cap and duty hold, whichever instruction is left out. */
static void test_any_instruction_is_skipped(void)
{
    catch_ends();
    for (int32_t duty = 30; duty <= 100; duty += 70) {
        start_flipped(duty, (uint32_t)duty);
        for (int call = 0; call < SKIP_CALLS; call++) {
            bool has_frame = call < 2 * FRAME_CALLS;
            if (is_in_short[call] || getenv("LASER_SKIPS_ALL") != NULL) {
                skip_in_call(duty, call, has_frame);
            } else {
                call_policy(call, has_frame);
            }
            pass_after(call);
        }
    }
    printf(
        "%d instructions of the policy, %d calls, %d skips, %d with an effect: the program ends %d "
        "times and loops %d times; the guards switch off %d times; on without a frame for at most "
        "%lld ms\n",
        (int)(__stop_policy - __start_policy), skips.call_count, skips.all, skips.with_effect,
        skips.ended, skips.looped, skips.cut, (long long)skips.worst_us / 1000);
    TEST_ASSERT_GREATER_THAN_INT(0, skips.cut);
}

#endif
