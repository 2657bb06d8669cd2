/* Recordings: what is on the disk after every call of the system has failed in turn, and the ring between the loop and the
 * process that writes, which is stopped, killed, too slow, or has no directory. Calls are wrapped by the linker. */
#include "linux/hal_recorder.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <signal.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "replay/hal_replay.h"
#include "unity.h"

#define WIDTH 64
#define HEIGHT 4
#define FRAME_BYTES (WIDTH * HEIGHT)
#define ENTRY_BYTES ((int)sizeof(struct hal_recording_frame) + FRAME_BYTES)
#define PERIOD_US 40000
#define SOON_MS 60000
#define RIG "{\"rig\":1}\n"

enum call { OPEN, PWRITE, RENAME, MKDIR, CLOSE, FTRUNCATE, CALLS };

static const char *const call_text[CALLS] = {"open",  "pwrite", "rename",
                                             "mkdir", "close",  "ftruncate"};

static char root[] = "/tmp/isohead_recorder_XXXXXX";
static char dir[64], rig[64];
static int counts[CALLS];
static enum call failing;
static int failing_from, failing_to; /* which calls of it, from 1 */
static bool is_counting, is_partial, allocation_fails;
static struct hal_error error;
static struct hal_recorder_process process;
static struct hal_recorder *const recorder = &process.recorder;

static bool fails(enum call call)
{
    if (!is_counting) {
        return false;
    }
    counts[call]++;
    errno = ENOSPC;
    return call == failing && counts[call] >= failing_from && counts[call] < failing_to;
}

int __real_open(const char *path, int flags, ...);
int __wrap_open(const char *path, int flags, ...);
ssize_t __real_pwrite(int fd, const void *bytes, size_t count, off_t offset);
ssize_t __wrap_pwrite(int fd, const void *bytes, size_t count, off_t offset);
int __real_rename(const char *from, const char *to);
int __wrap_rename(const char *from, const char *to);
int __real_mkdir(const char *path, mode_t mode);
int __wrap_mkdir(const char *path, mode_t mode);
int __real_close(int fd);
int __wrap_close(int fd);
int __real_posix_fallocate(int fd, off_t offset, off_t size);
int __wrap_posix_fallocate(int fd, off_t offset, off_t size);
int __real_ftruncate(int fd, off_t size);
int __wrap_ftruncate(int fd, off_t size);
int __real_poll(struct pollfd *fds, nfds_t count, int timeout_ms);
int __wrap_poll(struct pollfd *fds, nfds_t count, int timeout_ms);

int __wrap_open(const char *path, int flags, ...)
{
    va_list more;
    va_start(more, flags);
    int mode = va_arg(more, int);
    va_end(more);
    return fails(OPEN) ? -1 : __real_open(path, flags, mode);
}

/* Now and then a part of it is written before. */
ssize_t __wrap_pwrite(int fd, const void *bytes, size_t count, off_t offset)
{
    if (fails(PWRITE)) {
        if (is_partial && count > 1) {
            __real_pwrite(fd, bytes, count / 2, offset);
        }
        errno = ENOSPC;
        return -1;
    }
    return __real_pwrite(fd, bytes, is_counting && count > 100 ? 100 : count, offset);
}

int __wrap_rename(const char *from, const char *to)
{
    return fails(RENAME) ? -1 : __real_rename(from, to);
}

int __wrap_mkdir(const char *path, mode_t mode)
{
    return fails(MKDIR) ? -1 : __real_mkdir(path, mode);
}

int __wrap_close(int fd)
{
    bool bad = fails(CLOSE);
    int answer = __real_close(fd);
    return bad ? -1 : answer;
}

/* Never more than a test needs, whatever is asked for. */
int __wrap_posix_fallocate(int fd, off_t offset, off_t size)
{
    return allocation_fails || size > 1000000 ? ENOMEM : __real_posix_fallocate(fd, offset, size);
}

int __wrap_ftruncate(int fd, off_t size)
{
    return fails(FTRUNCATE) ? -1 : __real_ftruncate(fd, size);
}

/* The process gets a processor when nobody else wants it: its beginning is waited for, however long it takes. */
int __wrap_poll(struct pollfd *fds, nfds_t count, int timeout_ms)
{
    (void)timeout_ms;
    return __real_poll(fds, count, -1);
}

/* And so is its end, without which its files are not there. */
static void close_and_wait(void)
{
    const pid_t pid = process.pid;
    hal_recorder_close(&process);
    if (pid > 0) {
        waitpid(pid, NULL, 0);
    }
}

static void run(const char *command, const char *path)
{
    char text[128];
    snprintf(text, sizeof text, "%s %s", command, path);
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, system(text), text);
}

static void write_rig(const char *text)
{
    FILE *file = fopen(rig, "w");
    TEST_ASSERT_NOT_NULL(file);
    fputs(text, file);
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

void setUp(void)
{
    memset(counts, 0, sizeof counts);
    is_counting = is_partial = false;
    failing_from = failing_to = 0;
    process = (struct hal_recorder_process){.socket_fd = -1, .pid = -1};
    write_rig(RIG);
}

void tearDown(void)
{
    is_counting = false;
    if (process.pid > 0) {
        kill(process.pid, SIGCONT); /* of a test that failed */
    }
    close_and_wait();
    run("rm -rf", dir);
}

static struct hal_recording_config recording_config(int64_t bytes_max)
{
    return (struct hal_recording_config){
        .dir = dir, .rig = rig, .settings = "{}\n", .bytes_max = bytes_max};
}

static bool put(struct hal_recording *recording, int index, const char *name)
{
    struct hal_recording_frame frame = {.part = 1,
                                        .time_us = (int64_t)index * PERIOD_US,
                                        .width = WIDTH,
                                        .height = HEIGHT,
                                        .bytes_per_sample = 1,
                                        .maximum = 255,
                                        .lit = index % 2 == 0};
    uint8_t samples[FRAME_BYTES];
    memset(samples, index, sizeof samples);
    snprintf(frame.name, sizeof frame.name, "%s", name);
    return hal_recording_put(recording, &frame, samples, &error);
}

static int message_count;

/* A line without its frame. */
static void count_message(void *context, const char *subject, const char *text)
{
    (void)context, (void)subject, (void)text;
    message_count++;
}

/* Frames of a part that can be read: each as it was put, with its line; those that cannot be are counted. */
static int read_part(int number, int *bad_count)
{
    struct hal_replay replay;
    struct hal_frame frame;
    const struct hal_log log = {.error = count_message};
    char path[96];
    int count = 0;
    enum hal_next next = HAL_NEXT_END;
    snprintf(path, sizeof path, "%s/%06d", dir, number);
    message_count = 0;
    if (!hal_replay_open(&replay, path, false, &log, &error)) {
        return 0;
    }
    while ((next = replay.camera.next(&replay, &frame, &error)) != HAL_NEXT_END) {
        if (next == HAL_NEXT_BAD) {
            ++*bad_count;
            continue;
        }
        int index = (int)(frame.time_us / PERIOD_US);
        TEST_ASSERT_EQUAL_INT(index % 2 == 0, frame.laser);
        TEST_ASSERT_EACH_EQUAL_UINT8((uint8_t)index, frame.samples, FRAME_BYTES);
        replay.camera.release(&replay, &frame);
        count++;
    }
    hal_replay_close(&replay);
    *bad_count += message_count;
    return count;
}

static int read_all(int *bad_count)
{
    int count = 0;
    *bad_count = 0;
    for (int number = 1; number < 20; number++) {
        count += read_part(number, bad_count);
    }
    return count;
}

#define FRAMES 6

/* True: it was opened. *lost: frames that were refused. */
static bool record(int *lost)
{
    struct hal_recording recording;
    const struct hal_recording_config config = recording_config(1000000);
    char name[24];
    *lost = 0;
    is_counting = true;
    bool good = hal_recording_open(&recording, &config, &error);
    for (int i = 0; good && i < FRAMES; i++) {
        snprintf(name, sizeof name, "%06d.pgm", i);
        error.text[0] = 0;
        if (!put(&recording, i, name)) {
            TEST_ASSERT_TRUE(error.text[0] != 0);
            ++*lost;
        }
    }
    hal_recording_close(&recording);
    is_counting = false;
    return good;
}

/* Once: at most one frame is missing, and every other can be read. For good: nothing that is said to be written is missing. */
static void test_every_call_fails(void)
{
    int all = 0;
    for (int call = 0; call < CALLS; call++) {
        for (int variant = 0; variant < 4; variant++) {
            int from = 1, reached = 1;
            for (; reached; from++) {
                char message[64];
                int lost = 0, bad = 0;
                memset(counts, 0, sizeof counts);
                failing = (enum call)call;
                failing_from = from;
                failing_to = variant % 2 == 0 ? from + 1 : INT32_MAX;
                is_partial = variant >= 2;
                snprintf(message, sizeof message, "%s, call %d, variant %d", call_text[call], from,
                         variant);
                bool opened = record(&lost);
                reached = counts[call] >= from;
                int count = read_all(&bad);
                if (opened) {
                    TEST_ASSERT_EQUAL_INT_MESSAGE(FRAMES - lost, count, message);
                    TEST_ASSERT_TRUE_MESSAGE(variant % 2 != 0 || lost <= 1, message);
                    /* A line whose frame could not be named, or one that could not be taken back. */
                    TEST_ASSERT_LESS_OR_EQUAL_INT_MESSAGE(
                        call == RENAME || call == FTRUNCATE ? lost : 0, bad, message);
                }
                run("rm -rf", dir);
                all += reached;
            }
        }
    }
    /* ftruncate is only called where a line could not be written. */
    printf("%d calls failed\n", all);
    TEST_ASSERT_GREATER_THAN_INT(200, all);
}

/* A line that could not be written and not be taken back: the frames after it are in a part of their own. */
static void test_a_list_that_cannot_be_cut(void)
{
    struct hal_recording recording;
    const struct hal_recording_config config = recording_config(1000000);
    int bad = 0;
    TEST_ASSERT_TRUE(hal_recording_open(&recording, &config, &error));
    TEST_ASSERT_TRUE(put(&recording, 0, "000000.pgm"));
    failing = PWRITE, failing_from = 5,
    failing_to = 6; /* a head, three pieces of a frame, the line */
    is_counting = true;
    counts[FTRUNCATE] = 0;
    TEST_ASSERT_FALSE(put(&recording, 1, "000001.pgm"));
    TEST_ASSERT_EQUAL_INT(1, counts[FTRUNCATE]);
    is_counting = false;
    TEST_ASSERT_TRUE(put(&recording, 2, "000002.pgm"));
    hal_recording_close(&recording);
    TEST_ASSERT_EQUAL_INT(2, read_all(&bad));
    TEST_ASSERT_EQUAL_INT(0, bad);
}

static void test_parts_and_names(void)
{
    struct hal_recording recording;
    const struct hal_recording_config config = recording_config(1000000);
    int bad = 0;
    TEST_ASSERT_TRUE(hal_recording_open(&recording, &config, &error));
    TEST_ASSERT_TRUE(put(&recording, 0, "999998.pgm"));
    TEST_ASSERT_TRUE(put(&recording, 1, "999999.pgm"));
    TEST_ASSERT_TRUE(put(&recording, 2, "1000000.pgm")); /* would come first */
    hal_recording_close(&recording);
    TEST_ASSERT_EQUAL_INT(2, read_part(1, &bad));
    TEST_ASSERT_EQUAL_INT(1, read_part(2, &bad));
    TEST_ASSERT_EQUAL_INT(0, bad);
    TEST_ASSERT_TRUE(hal_recording_open(&recording, &config, &error)); /* behind what is there */
    TEST_ASSERT_TRUE(put(&recording, 3, "000003.pgm"));
    hal_recording_close(&recording);
    TEST_ASSERT_EQUAL_INT(1, read_part(3, &bad));
}

/* As Netpbm has it, and hal_pgm reads it. */
static void test_two_bytes(void)
{
    struct hal_recording recording;
    const struct hal_recording_config config = recording_config(1000000);
    const struct hal_recording_frame frame = {.part = 1,
                                              .width = 2,
                                              .height = 1,
                                              .bytes_per_sample = 2,
                                              .maximum = 1023,
                                              .lit = true,
                                              .name = "000000.pgm"};
    uint16_t samples[2] = {1000, 3};
    struct hal_replay replay;
    struct hal_frame found;
    const struct hal_log log = {.error = count_message};
    char path[96];
    TEST_ASSERT_TRUE(hal_recording_open(&recording, &config, &error));
    TEST_ASSERT_TRUE(hal_recording_put(&recording, &frame, (uint8_t *)samples, &error));
    hal_recording_close(&recording);
    snprintf(path, sizeof path, "%s/000001", dir);
    TEST_ASSERT_TRUE(hal_replay_open(&replay, path, false, &log, &error));
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_FRAME, replay.camera.next(&replay, &found, &error));
    TEST_ASSERT_EQUAL_INT32(1023, found.maximum);
    TEST_ASSERT_EQUAL_UINT16(1000, ((const uint16_t *)found.samples)[0]);
    TEST_ASSERT_EQUAL_UINT16(3, ((const uint16_t *)found.samples)[1]);
    replay.camera.release(&replay, &found);
    hal_replay_close(&replay);
}

/* What is there from before counts. */
static void test_no_more_bytes_than_allowed(void)
{
    struct hal_recording recording;
    const int64_t max = 3 * FRAME_BYTES + 400;
    const struct hal_recording_config config = recording_config(max);
    char name[24];
    int count = 0, bad = 0;
    for (int pass = 0; pass < 2; pass++) {
        TEST_ASSERT_TRUE(hal_recording_open(&recording, &config, &error));
        for (int i = 0; i < FRAMES; i++) {
            snprintf(name, sizeof name, "%06d.pgm", i);
            count += put(&recording, i, name);
        }
        TEST_ASSERT_LESS_OR_EQUAL_INT64(max, recording.bytes);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, "record-max"), error.text);
        hal_recording_close(&recording);
    }
    TEST_ASSERT_EQUAL_INT(3, count);
    TEST_ASSERT_EQUAL_INT(3, read_all(&bad));
}

/* --- the ring and its process --- */

static struct hal_recorder_config with(int frames, int64_t keep_us)
{
    return (struct hal_recorder_config){.recording = recording_config(1000000),
                                        .memory_bytes =
                                            (int64_t)frames * ENTRY_BYTES + ENTRY_BYTES / 2,
                                        .frame_bytes = FRAME_BYTES,
                                        .keep_us = keep_us};
}

static void open_with(int frames, int64_t keep_us)
{
    const struct hal_recorder_config config = with(frames, keep_us);
    TEST_ASSERT_TRUE_MESSAGE(hal_recorder_open(&process, &config, &error), error.text);
}

/* Rows with something between them. */
static bool keep_frame(int index)
{
    static uint8_t samples[HEIGHT][WIDTH + 8];
    char name[24];
    memset(samples, 0xee, sizeof samples);
    for (int row = 0; row < HEIGHT; row++) {
        memset(samples[row], index, WIDTH);
    }
    snprintf(name, sizeof name, "%06d.pgm", index);
    const struct hal_frame frame = {.samples = samples,
                                    .width = WIDTH,
                                    .height = HEIGHT,
                                    .stride_bytes = WIDTH + 8,
                                    .bytes_per_sample = 1,
                                    .maximum = 255,
                                    .time_us = (int64_t)index * PERIOD_US,
                                    .name = name};
    return recorder->keep(recorder->context, &frame, index % 2 == 0);
}

static void wait_until(bool (*is_so)(void), const char *what)
{
    const struct timespec pause = {.tv_nsec = 1000000};
    for (int i = 0; i < SOON_MS && !is_so(); i++) {
        nanosleep(&pause, NULL);
    }
    TEST_ASSERT_TRUE_MESSAGE(is_so(), what);
}

/* Taken out of the ring; the disk may still have to do. */
static bool is_taken(void)
{
    return process.ring != NULL && *(volatile long long *)process.ring ==
                                       (long long)process.limit; /* its tail comes first */
}

static bool is_heard;

static bool has_news(void)
{
    is_heard = is_heard || recorder->news(recorder->context, &error);
    return is_heard;
}

static void wait_for_news(const char *text)
{
    is_heard = false;
    wait_until(has_news, text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, text), error.text);
    TEST_ASSERT_FALSE(recorder->news(recorder->context, &error));
}

static bool has_first(void)
{
    char path[96];
    snprintf(path, sizeof path, "%s/000001/000000.pgm", dir);
    return access(path, F_OK) == 0;
}

static void test_all_is_written(void)
{
    int bad = 0;
    open_with(4, PERIOD_US);
    recorder->write(recorder->context, true);
    for (int i = 0; i < 50; i++) {
        TEST_ASSERT_TRUE(keep_frame(i));
        wait_until(is_taken, "a frame is written");
    }
    close_and_wait();
    TEST_ASSERT_EQUAL_INT(50, read_part(1, &bad));
    TEST_ASSERT_EQUAL_INT(0, bad);
}

/* The last three frame times before, what comes after; and once more, as a recording of its own. */
static void test_the_last_ones_are_written_when_wanted(void)
{
    int bad = 0;
    open_with(10, 3 * PERIOD_US);
    for (int i = 0; i < 100; i++) {
        TEST_ASSERT_TRUE(keep_frame(i));
    }
    recorder->write(recorder->context, true);
    TEST_ASSERT_TRUE(keep_frame(100));
    recorder->write(recorder->context, false);
    wait_until(is_taken, "what was wanted is written");
    for (int i = 101; i < 104; i++) {
        TEST_ASSERT_TRUE(keep_frame(i));
    }
    recorder->write(recorder->context, true);
    close_and_wait();
    TEST_ASSERT_EQUAL_INT(5, read_part(1, &bad));
    TEST_ASSERT_EQUAL_INT(3, read_part(2, &bad));
    TEST_ASSERT_EQUAL_INT(0, bad);
}

/* By room, not by age. */
static void test_memory_is_bounded(void)
{
    int bad = 0;
    open_with(10, 1000 * PERIOD_US);
    for (int i = 0; i < 200; i++) {
        TEST_ASSERT_TRUE(keep_frame(i));
    }
    recorder->write(recorder->context, true);
    close_and_wait();
    TEST_ASSERT_EQUAL_INT(10, read_part(1, &bad));
}

/* The loop goes on, and keep() says so; what fits is written later. */
static void test_a_disk_that_stands_still(void)
{
    int kept = 0, bad = 0;
    open_with(10, 1000 * PERIOD_US);
    TEST_ASSERT_EQUAL_INT(0, kill(process.pid, SIGSTOP));
    TEST_ASSERT_EQUAL_INT(
        0, waitid(P_PID, (id_t)process.pid, &(siginfo_t){.si_pid = 0}, WSTOPPED | WNOWAIT));
    recorder->write(recorder->context, true);
    for (int i = 0; i < 5000; i++) { /* more than its socket takes */
        kept += keep_frame(i % 256);
    }
    TEST_ASSERT_EQUAL_INT(10, kept);
    TEST_ASSERT_EQUAL_INT(0, kill(process.pid, SIGCONT));
    wait_until(is_taken, "what was kept is written");
    TEST_ASSERT_TRUE(keep_frame(10));
    close_and_wait();
    TEST_ASSERT_EQUAL_INT(11, read_part(1, &bad));
}

static void test_a_process_that_is_killed(void)
{
    open_with(4, PERIOD_US);
    recorder->write(recorder->context, true);
    TEST_ASSERT_FALSE(recorder->news(recorder->context, &error));
    TEST_ASSERT_EQUAL_INT(0, kill(process.pid, SIGKILL));
    wait_for_news("has ended");
    for (int i = 0; i < 20; i++) {
        TEST_ASSERT_TRUE(keep_frame(i)); /* not lost for want of room: that was reported */
    }
    recorder->write(recorder->context, false);
    recorder->rig(recorder->context);
}

#define WAITING 10

static void keep_waiting_frames(void)
{
    open_with(WAITING, 1000 * PERIOD_US);
    kill(process.pid, SIGSTOP);
    waitid(P_PID, (id_t)process.pid, &(siginfo_t){.si_pid = 0}, WSTOPPED | WNOWAIT);
    recorder->write(recorder->context, true);
    for (int i = 0; i < WAITING; i++) {
        keep_frame(i);
    }
}

/* Its process, which has stopped and has frames to write; this process collects it. */
static pid_t die_with_frames_waiting(void)
{
    pid_t writer = -1;
    int ends[2];
    TEST_ASSERT_EQUAL_INT(0, prctl(PR_SET_CHILD_SUBREAPER, 1));
    TEST_ASSERT_EQUAL_INT(0, pipe(ends));
    pid_t program = fork();
    if (program == 0) {
        keep_waiting_frames();
        (void)!write(ends[1], &process.pid, sizeof process.pid);
        raise(SIGKILL);
    }
    TEST_ASSERT_EQUAL_INT64(sizeof writer, read(ends[0], &writer, sizeof writer));
    TEST_ASSERT_EQUAL_INT(program, waitpid(program, NULL, 0));
    close(ends[0]);
    close(ends[1]);
    return writer;
}

/* What was wanted is written, but not where whoever ends the program's processes waits for it. */
static void test_a_program_that_is_killed(void)
{
    int bad = 0;
    pid_t writer = die_with_frames_waiting();
    TEST_ASSERT_EQUAL_INT(0, kill(writer, SIGCONT));
    TEST_ASSERT_EQUAL_INT(writer, waitpid(writer, NULL, 0));
    TEST_ASSERT_EQUAL_INT(WAITING, read_part(1, &bad));
    run("rm -rf", dir);
    writer = die_with_frames_waiting();
    TEST_ASSERT_EQUAL_INT(0, kill(writer, SIGTERM));
    TEST_ASSERT_EQUAL_INT(0, kill(writer, SIGCONT));
    TEST_ASSERT_EQUAL_INT(writer, waitpid(writer, NULL, 0));
    TEST_ASSERT_EQUAL_INT(0, read_part(1, &bad));
    TEST_ASSERT_EQUAL_INT(0, bad);
}

/* The program lives, and is about to end: everything is written. */
static void test_sigterm_while_the_program_lives(void)
{
    int bad = 0;
    keep_waiting_frames();
    TEST_ASSERT_EQUAL_INT(0, kill(process.pid, SIGTERM));
    TEST_ASSERT_EQUAL_INT(0, kill(process.pid, SIGCONT));
    close_and_wait();
    TEST_ASSERT_EQUAL_INT(WAITING, read_part(1, &bad));
    TEST_ASSERT_EQUAL_INT(0, bad);
}

/* A row of frames that cannot be written is two messages, and no more. */
static void test_failures_are_reported_once(void)
{
    char path[96], away[96];
    int bad = 0;
    snprintf(away, sizeof away, "%s/away", root);
    open_with(4, PERIOD_US);
    recorder->write(recorder->context, true);
    TEST_ASSERT_TRUE(keep_frame(0));
    wait_until(has_first, "the first");
    snprintf(path, sizeof path, "%s/000001", dir);
    TEST_ASSERT_EQUAL_INT(0, rename(path, away));
    for (int i = 1; i < 4; i++) {
        TEST_ASSERT_TRUE(keep_frame(i));
        wait_until(is_taken, "one that cannot be written");
    }
    wait_for_news("making");
    TEST_ASSERT_EQUAL_INT(0, rename(away, path));
    TEST_ASSERT_TRUE(keep_frame(4));
    wait_for_news("frames are missing");
    close_and_wait();
    /* The last of them may have been late enough. */
    TEST_ASSERT_INT_WITHIN(1, 3, read_part(1, &bad));
}

static bool has_second(void)
{
    char path[96];
    snprintf(path, sizeof path, "%s/000002/000001.pgm", dir);
    return access(path, F_OK) == 0;
}

static bool has_text(int number, const char *name, const char *wanted)
{
    char path[128], text[64] = "";
    snprintf(path, sizeof path, "%s/%06d/%s", dir, number, name);
    FILE *file = fopen(path, "r");
    TEST_ASSERT_NOT_NULL_MESSAGE(file, path);
    text[fread(text, 1, sizeof text - 1, file)] = 0;
    fclose(file);
    return strcmp(text, wanted) == 0;
}

/* Each part has the rig that was in use; what was kept with another one is forgotten. */
static void test_a_rig_that_is_read_anew(void)
{
    int bad = 0;
    open_with(10, 100 * PERIOD_US);
    TEST_ASSERT_TRUE(keep_frame(0));
    write_rig("edited, not yet in use");
    recorder->write(recorder->context, true);
    wait_until(is_taken, "the first part");
    write_rig("second");
    recorder->rig(recorder->context);
    TEST_ASSERT_TRUE(keep_frame(1));
    recorder->write(recorder->context, false);
    wait_until(has_second, "the second part");
    TEST_ASSERT_TRUE(keep_frame(2));
    recorder->rig(recorder->context);
    TEST_ASSERT_TRUE(keep_frame(3));
    recorder->write(recorder->context, true);
    close_and_wait();
    TEST_ASSERT_EQUAL_INT(1, read_part(1, &bad));
    TEST_ASSERT_EQUAL_INT(1, read_part(2, &bad));
    TEST_ASSERT_EQUAL_INT(1, read_part(3, &bad));
    TEST_ASSERT_TRUE(has_text(1, "rig.json", RIG));
    TEST_ASSERT_TRUE(has_text(2, "rig.json", "second"));
    TEST_ASSERT_TRUE(has_text(2, "settings.json", "{}\n"));
}

/* Which way is up goes into a rig file that does not say it, and into no other. */
static void test_up(void)
{
    static const struct {
        const char *rig, *up, *copy;
    } cases[] = {
        {RIG, "[0,1,0]", "{\"up\":[0,1,0],\"rig\":1}\n"},
        {" \n{ \"a\": {\"up\": 1}}", "[0,1,0]", " \n{\"up\":[0,1,0], \"a\": {\"up\": 1}}"},
        {"{\"rig\":1,\"up\":[1,0,0]}", "[0,1,0]", "{\"rig\":1,\"up\":[1,0,0]}"},
        {RIG, NULL, RIG},
        {"[1]", "[0,1,0]", "[1]"},
        {"no JSON {", "[0,1,0]", "no JSON {"},
        {"", "[0,1,0]", ""},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct hal_recording recording;
        struct hal_recording_config config = recording_config(1000000);
        config.up = cases[i].up;
        write_rig(cases[i].rig);
        TEST_ASSERT_TRUE_MESSAGE(hal_recording_open(&recording, &config, &error), error.text);
        TEST_ASSERT_TRUE_MESSAGE(put(&recording, 0, "000000.pgm"), error.text);
        hal_recording_close(&recording);
        TEST_ASSERT_TRUE_MESSAGE(has_text(1, "rig.json", cases[i].copy), cases[i].copy);
        run("rm -rf", dir);
    }
}

static void refuse(const struct hal_recorder_config *config, const char *text)
{
    TEST_ASSERT_FALSE(hal_recorder_open(&process, config, &error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error.text, text), error.text);
    TEST_ASSERT_EQUAL_INT(-1, process.socket_fd);
    TEST_ASSERT_EQUAL_INT(-1, process.pid);
    TEST_ASSERT_NULL(process.ring);
}

/* posix_fallocate is a double: what is refused too late takes no memory here either. */
static void refuse_memory(const struct hal_recorder_config *config)
{
    allocation_fails = true;
    refuse(config, "of this machine's memory");
    allocation_fails = false;
}

static void test_what_cannot_be_opened(void)
{
    struct hal_recorder_config config = with(4, PERIOD_US);
    config.recording.dir = "/proc/none/dir";
    refuse(&config, "No such file or directory");
    config.recording.dir = "/proc";
    refuse(&config, "making /proc/.isohead.part");
    config.recording.dir = rig;
    refuse(&config, "Not a directory");
    config = with(4, PERIOD_US);
    config.recording.rig = "/nowhere/rig.json";
    refuse(&config, "/nowhere/rig.json: No such file");
    config = with(3, PERIOD_US);
    refuse(&config, "expected at least 4 frames");
    config = with(4, PERIOD_US);
    allocation_fails = true;
    refuse(&config, "record-memory: no memory");
    allocation_fails = false;
    config.memory_bytes =
        (int64_t)sysconf(_SC_PHYS_PAGES) * sysconf(_SC_PAGESIZE); /* it must not even be tried */
    TEST_ASSERT_TRUE(config.memory_bytes > 0);
    refuse_memory(&config);
}

int main(void)
{
    TEST_ASSERT_NOT_NULL(mkdtemp(root));
    snprintf(dir, sizeof dir, "%s/out", root);
    snprintf(rig, sizeof rig, "%s/rig.json", root);
    UNITY_BEGIN();
    RUN_TEST(test_every_call_fails);
    RUN_TEST(test_a_list_that_cannot_be_cut);
    RUN_TEST(test_parts_and_names);
    RUN_TEST(test_two_bytes);
    RUN_TEST(test_no_more_bytes_than_allowed);
    RUN_TEST(test_all_is_written);
    RUN_TEST(test_the_last_ones_are_written_when_wanted);
    RUN_TEST(test_memory_is_bounded);
    RUN_TEST(test_a_disk_that_stands_still);
    RUN_TEST(test_a_process_that_is_killed);
    RUN_TEST(test_a_program_that_is_killed);
    RUN_TEST(test_sigterm_while_the_program_lives);
    RUN_TEST(test_failures_are_reported_once);
    RUN_TEST(test_a_rig_that_is_read_anew);
    RUN_TEST(test_up);
    RUN_TEST(test_what_cannot_be_opened);
    int failures = UNITY_END();
    run("rm -rf", root);
    return failures;
}
