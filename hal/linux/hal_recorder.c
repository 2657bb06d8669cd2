#include "linux/hal_recorder.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "linux/hal_descriptors.h"

#define ALIGNMENT 64
#define READY "ready"
#define WAKE "wake"
#define PAUSE_MS 10

struct hal_recorder_ring {
    atomic_llong tail, limit;
    atomic_llong rig_count; /* how often the rig was read anew */
    _Alignas(ALIGNMENT) uint8_t content[];
};

_Static_assert(ATOMIC_LLONG_LOCK_FREE == 2, "a lock would be inside one of the processes");

/* --- the ring --- */

static void copy_in(const struct hal_recorder_process *process, int64_t at, const void *from,
                    int64_t count)
{
    const int64_t size = process->config.memory_bytes;
    const int64_t place = at % size;
    const int64_t first = count < size - place ? count : size - place;
    memcpy(process->ring->content + place, from, (size_t)first);
    memcpy(process->ring->content, (const uint8_t *)from + first, (size_t)(count - first));
}

static void copy_out(const struct hal_recorder_process *process, int64_t at, void *to,
                     int64_t count)
{
    const int64_t size = process->config.memory_bytes;
    const int64_t place = at % size;
    const int64_t first = count < size - place ? count : size - place;
    memcpy(to, process->ring->content + place, (size_t)first);
    memcpy((uint8_t *)to + first, process->ring->content, (size_t)(count - first));
}

static int64_t sample_bytes(const struct hal_recording_frame *frame)
{
    return (int64_t)frame->width * frame->height * frame->bytes_per_sample;
}

/* --- the process --- */

struct writer {
    const struct hal_recorder_process *process;
    struct hal_recording recording;
    uint8_t *samples;
    int64_t rig_count;
    int64_t lost_count; /* in a row */
};

static void report(const struct writer *writer, const char *text)
{
    send(writer->process->socket_fd, text, strlen(text), MSG_DONTWAIT | MSG_NOSIGNAL);
}

/* The first of a row that cannot be written has the reason, the first after it their number. */
static void write_frame(struct writer *writer, const struct hal_recording_frame *frame)
{
    struct hal_error error;
    if (!hal_recording_put(&writer->recording, frame, writer->samples, &error)) {
        if (writer->lost_count++ == 0) {
            report(writer, error.text);
        }
    } else if (writer->lost_count > 0) {
        hal_fail(&error, "goes on; %lld frames are missing", (long long)writer->lost_count);
        writer->lost_count = 0;
        report(writer, error.text);
    }
}

static void read_rig(struct writer *writer, int64_t count)
{
    struct hal_error error;
    if (count != writer->rig_count && !hal_recording_rig(&writer->recording, &error)) {
        report(writer, error.text);
    }
    writer->rig_count = count;
}

/* Soon, as the file may be edited again; but not while frames of the one before wait to be written. */
static void look_at_rig(struct writer *writer)
{
    struct hal_recorder_ring *ring = writer->process->ring;
    const int64_t count = atomic_load(&ring->rig_count);
    if (atomic_load(&ring->tail) == atomic_load(&ring->limit)) {
        read_rig(writer, count);
    }
}

static void write_all_frames(struct writer *writer)
{
    struct hal_recorder_ring *ring = writer->process->ring;
    for (;;) {
        const int64_t limit = atomic_load_explicit(&ring->limit, memory_order_acquire);
        int64_t tail = atomic_load_explicit(&ring->tail, memory_order_acquire);
        struct hal_recording_frame frame;
        if (tail >= limit) {
            return;
        }
        copy_out(writer->process, tail, &frame, sizeof frame);
        copy_out(writer->process, tail + (int64_t)sizeof frame, writer->samples,
                 sample_bytes(&frame));
        tail += (int64_t)sizeof frame + sample_bytes(&frame);
        atomic_store_explicit(&ring->tail, tail, memory_order_release);
        if (frame.rig_count >= writer->rig_count) { /* else its rig is not there any more */
            read_rig(writer, frame.rig_count);
            write_frame(writer, &frame);
        }
    }
}

/* False: the program is gone. */
static bool wait_for_more(const struct writer *writer)
{
    char text[16];
    ssize_t count = 0;
    do {
        count = recv(writer->process->socket_fd, text, sizeof text, 0);
    } while (count < 0 && errno == EINTR);
    return count > 0;
}

/* A handler gets no context. */
static volatile pid_t program_pid;

/* systemd makes the laser's line low when every process is gone, so nobody waits for a disk when the program
 * has died. One that is about to end in order has switched off, and its frames are still written. */
static void end_with_program(int number)
{
    (void)number;
    if (getppid() != program_pid) {
        _exit(0);
    }
}

static void block_signals(void)
{
    const struct sigaction action = {.sa_handler = end_with_program, .sa_flags = SA_RESTART};
    sigset_t set;
    sigaction(SIGTERM, &action, NULL);
    sigfillset(&set);
    sigdelset(&set, SIGTERM);
    sigprocmask(SIG_SETMASK, &set, NULL);
}

static bool prepare(struct writer *writer, struct hal_error *error)
{
    const struct hal_recorder_config *config = &writer->process->config;
    const struct sched_param none = {.sched_priority = 0};
    const int keep_fds[] = {0, 1, 2, writer->process->socket_fd};
    block_signals();
    prctl(PR_SET_NAME, "isohead-record");
    writer->samples = malloc((size_t)config->frame_bytes);
    if (writer->samples == NULL) {
        return hal_fail(error, "no memory for a frame");
    }
    if (!hal_descriptors_keep(keep_fds, sizeof keep_fds / sizeof keep_fds[0])) {
        return hal_fail(error, "its process cannot be set up: %s", strerror(errno));
    }
    if (!hal_recording_open(&writer->recording, &config->recording, error)) {
        return false;
    }
    /* Last: its beginning is waited for, and from here on it takes as long as others want the processor. */
    return sched_setscheduler(0, SCHED_IDLE, &none) == 0 ||
           hal_fail(error, "its priority cannot be lowered: %s", strerror(errno));
}

static _Noreturn void run_writer(const struct hal_recorder_process *process)
{
    struct writer writer = {.process = process};
    struct hal_error error;
    if (!prepare(&writer, &error)) {
        report(&writer, error.text);
        _exit(1);
    }
    report(&writer, READY);
    while (wait_for_more(&writer)) {
        write_all_frames(&writer);
        look_at_rig(&writer);
    }
    write_all_frames(&writer);
    hal_recording_close(&writer.recording);
    _exit(0);
}

/* --- the loop's side --- */

static void wake(const struct hal_recorder_process *process)
{
    /* Where there is no room it has not seen the last one yet. */
    send(process->socket_fd, WAKE, strlen(WAKE), MSG_DONTWAIT | MSG_NOSIGNAL);
}

static void set_limit(struct hal_recorder_process *process, int64_t limit)
{
    process->limit = limit;
    atomic_store_explicit(&process->ring->limit, limit, memory_order_release);
}

/* Nothing waits to be written: what is kept may be moved. */
static bool owns_all(const struct hal_recorder_process *process)
{
    return atomic_load_explicit(&process->ring->tail, memory_order_acquire) == process->limit;
}

/* In this order: the process never sees a limit that is not its own beyond the tail. */
static void drop_until(struct hal_recorder_process *process, int64_t tail)
{
    atomic_store_explicit(&process->ring->tail, tail, memory_order_release);
    set_limit(process, tail);
}

/* The oldest ones, for want of room or for their age. */
static void drop_old(struct hal_recorder_process *process, int64_t needed, int64_t time_us)
{
    int64_t tail = process->limit;
    while (tail < process->head) {
        struct hal_recording_frame frame;
        copy_out(process, tail, &frame, sizeof frame);
        const bool is_old =
            frame.time_us < time_us - process->config.keep_us || frame.time_us > time_us;
        if (!is_old && process->head - tail + needed <= process->config.memory_bytes) {
            break;
        }
        tail += (int64_t)sizeof frame + sample_bytes(&frame);
    }
    drop_until(process, tail);
}

static void copy_frame(struct hal_recorder_process *process, const struct hal_frame *frame,
                       bool lit)
{
    struct hal_recording_frame head = {.part = process->part,
                                       .rig_count = process->rig_count,
                                       .time_us = frame->time_us,
                                       .width = frame->width,
                                       .height = frame->height,
                                       .bytes_per_sample = frame->bytes_per_sample,
                                       .maximum = frame->maximum,
                                       .lit = lit};
    const int64_t row_bytes = (int64_t)frame->width * frame->bytes_per_sample;
    int64_t at = process->head + (int64_t)sizeof head;
    snprintf(head.name, sizeof head.name, "%s", frame->name);
    copy_in(process, process->head, &head, sizeof head);
    if (frame->stride_bytes == row_bytes) {
        copy_in(process, at, frame->samples, row_bytes * frame->height);
    } else {
        for (int32_t row = 0; row < frame->height; row++) {
            copy_in(process, at + row * row_bytes,
                    (const uint8_t *)frame->samples + (int64_t)row * frame->stride_bytes,
                    row_bytes);
        }
    }
    process->head = at + row_bytes * frame->height;
}

static bool keep(void *context, const struct hal_frame *frame, bool lit)
{
    struct hal_recorder_process *process = context;
    const int64_t needed = (int64_t)sizeof(struct hal_recording_frame) +
                           (int64_t)frame->width * frame->height * frame->bytes_per_sample;
    if (process->socket_fd < 0) {
        return true; /* reported once, when it ended */
    }
    if (!process->writes && owns_all(process)) {
        drop_old(process, needed, frame->time_us);
    }
    const int64_t tail = atomic_load_explicit(&process->ring->tail, memory_order_acquire);
    if (needed > process->config.memory_bytes - (process->head - tail) ||
        needed - (int64_t)sizeof(struct hal_recording_frame) > process->config.frame_bytes) {
        return false;
    }
    copy_frame(process, frame, lit);
    if (process->writes) {
        set_limit(process, process->head);
        wake(process);
    }
    return true;
}

static void write_on(void *context, bool on)
{
    struct hal_recorder_process *process = context;
    if (on && !process->writes && process->socket_fd >= 0) {
        set_limit(process, process->head);
        wake(process);
    }
    /* What comes after the end, and is written one day, is another recording. */
    process->part += !on && process->writes;
    process->writes = on;
}

static void change_rig(void *context)
{
    struct hal_recorder_process *process = context;
    if (process->socket_fd < 0) {
        return;
    }
    if (owns_all(process)) {
        drop_until(process, process->head);
    }
    process->part++;
    process->rig_count++;
    atomic_store(&process->ring->rig_count, process->rig_count);
    wake(process);
}

static void bury(struct hal_recorder_process *process)
{
    close(process->socket_fd);
    process->socket_fd = -1;
    waitpid(process->pid, NULL, WNOHANG);
    process->pid = -1;
}

static bool news(void *context, struct hal_error *error)
{
    struct hal_recorder_process *process = context;
    char text[HAL_ERROR_MAX];
    if (process->socket_fd < 0) {
        return false;
    }
    ssize_t count = recv(process->socket_fd, text, sizeof text - 1, MSG_DONTWAIT);
    if (count > 0) {
        text[count] = 0;
        hal_fail(error, "%s", text);
        return true;
    }
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) {
        return false;
    }
    bury(process);
    hal_fail(error,
             "its process has ended; nothing more is recorded until the program is restarted");
    return true;
}

/* --- open and close --- */

/* All of the ring is taken at once, and asking the kernel for more than there is ends other programs, not this one: so it is
 * refused before it is asked for. */
static bool check_memory(const struct hal_recorder_config *config, struct hal_error *error)
{
    const int64_t frame_bytes = config->frame_bytes + (int64_t)sizeof(struct hal_recording_frame);
    const int64_t max_bytes =
        (int64_t)sysconf(_SC_PHYS_PAGES) * sysconf(_SC_PAGESIZE) / HAL_RECORDER_MEMORY_PART;
    if (config->memory_bytes > max_bytes) {
        return hal_fail(
            error,
            "record-memory: %lld bytes, expected at most %lld, 1/%d of this machine's memory",
            (long long)config->memory_bytes, (long long)max_bytes, HAL_RECORDER_MEMORY_PART);
    }
    if (config->memory_bytes < HAL_RECORDER_FRAMES_MIN * frame_bytes) {
        return hal_fail(error, "record-memory: %lld bytes, expected at least %d frames of %lld",
                        (long long)config->memory_bytes, HAL_RECORDER_FRAMES_MIN,
                        (long long)frame_bytes);
    }
    return true;
}

static bool make_ring(struct hal_recorder_process *process, struct hal_error *error)
{
    const struct hal_recorder_config *config = &process->config;
    process->mapped_size = sizeof(struct hal_recorder_ring) + (size_t)config->memory_bytes;
    int fd = memfd_create("isohead-record", MFD_CLOEXEC);
    int reason = fd < 0 ? errno : posix_fallocate(fd, 0, (off_t)process->mapped_size);
    void *memory = MAP_FAILED;
    if (reason == 0) {
        memory = mmap(NULL, process->mapped_size, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
        reason = errno;
    }
    if (fd >= 0) {
        close(fd);
    }
    if (memory == MAP_FAILED) {
        return hal_fail(error, "record-memory: no memory for %zu bytes: %s", process->mapped_size,
                        strerror(reason));
    }
    process->ring = memory;
    return true;
}

static bool start(struct hal_recorder_process *process, struct hal_error *error)
{
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends) != 0) {
        return hal_fail(error, "no socket: %s", strerror(errno));
    }
    program_pid = getpid();
    process->pid = fork();
    if (process->pid == 0) {
        process->socket_fd = ends[1];
        run_writer(process);
    }
    int reason = errno;
    close(ends[1]);
    process->socket_fd = ends[0];
    if (process->pid < 0) {
        return hal_fail(error, "no process: %s", strerror(reason));
    }
    /* Guards that are forked later have nothing to do with it. */
    madvise(process->ring, process->mapped_size, MADV_DONTFORK);
    return true;
}

static bool wait_until_ready(struct hal_recorder_process *process, struct hal_error *error)
{
    struct pollfd waiting = {.fd = process->socket_fd, .events = POLLIN};
    int ready = 0;
    do {
        ready = poll(&waiting, 1, HAL_RECORDER_START_MS);
    } while (ready < 0 && errno == EINTR);
    if (ready <= 0 || !news(process, error)) {
        return hal_fail(error, "its process did not begin within %d ms", HAL_RECORDER_START_MS);
    }
    return strcmp(error->text, READY) == 0;
}

bool hal_recorder_open(struct hal_recorder_process *process,
                       const struct hal_recorder_config *config, struct hal_error *error)
{
    *process =
        (struct hal_recorder_process){.recorder = {process, keep, write_on, change_rig, news},
                                      .config = *config,
                                      .part = 1,
                                      .socket_fd = -1,
                                      .pid = -1};
    if (check_memory(config, error) && make_ring(process, error) && start(process, error) &&
        wait_until_ready(process, error)) {
        return true;
    }
    if (process->pid > 0) {
        kill(process->pid, SIGKILL);
    }
    hal_recorder_close(process);
    return false;
}

void hal_recorder_close(struct hal_recorder_process *process)
{
    const struct timespec pause = {.tv_nsec = PAUSE_MS * 1000000L};
    if (process->socket_fd >= 0) {
        close(process->socket_fd);
        process->socket_fd = -1;
    }
    bool is_over = process->pid <= 0;
    for (int i = 0; !is_over && i < HAL_RECORDER_END_MS / PAUSE_MS; i++) {
        pid_t dead = waitpid(process->pid, NULL, WNOHANG);
        is_over = dead == process->pid || (dead < 0 && errno != EINTR);
        if (!is_over) {
            nanosleep(&pause, NULL);
        }
    }
    process->pid = -1;
    if (process->ring != NULL) {
        munmap(process->ring, process->mapped_size);
        process->ring = NULL;
    }
}
