/* hal_recorder - the last seconds of frames in memory, and a process that writes them to a disk.
 *
 * In:    frames that the loop has used, copied into a ring of shared memory.
 * Out:   frames directories (hal_recording.h). While nothing is to be written the oldest frames give way, at the latest after
 *        keep_us; when something is, the process writes all that is there and what comes.
 *
 * Why a process: a disk may make who writes wait, for seconds. The loop only copies, and never waits: where the process does not
 *        keep up and the ring is full, a frame is lost, and keep() says so. The process is forked before camera and laser are
 *        opened, has no descriptor of theirs, and gets the processor when nobody else wants it (SCHED_IDLE). When the program
 *        ends, or is killed, it writes what was wanted and ends; without the rest where SIGTERM comes after the program is
 *        gone, as systemd sends it, whose --laser-off waits for the end of every process.
 * The ring: bytes [tail, limit) are the process's, [limit, head) are kept. Only the process moves tail while tail < limit, only
 *        the loop while tail = limit; the loop alone moves limit.
 * Memory: memory_bytes, all of it from the beginning, so that keep() never finds it full.
 * Error: on opening: no memory, a directory that cannot be written to. Later: what the process reports, as news, once for each
 *        row of frames that it could not write; and its end, once.
 */
#ifndef HAL_RECORDER_H
#define HAL_RECORDER_H

#include <sys/types.h>

#include "hal.h"
#include "linux/hal_recording.h"

/* Frames that have to fit into the memory. */
#define HAL_RECORDER_FRAMES_MIN 4
/* At most this part of the machine's memory. */
#define HAL_RECORDER_MEMORY_PART 4
/* Longest wait for the process to begin, and for its end. */
#define HAL_RECORDER_START_MS 5000
#define HAL_RECORDER_END_MS 3000

struct hal_recorder_ring; /* what both see */

struct hal_recorder_config {
    struct hal_recording_config recording;
    int64_t memory_bytes;
    int64_t frame_bytes; /* of the largest frame */
    int64_t keep_us;     /* so old may a frame become that is not written */
};

struct hal_recorder_process {
    struct hal_recorder recorder;
    /* Private from here on. */
    struct hal_recorder_config config;
    struct hal_recorder_ring *ring;
    size_t mapped_size;
    int64_t head, limit;
    int64_t newest_us; /* time of the last frame */
    int64_t part, rig_count;
    bool writes;
    int socket_fd; /* -1: there is no process */
    pid_t pid;
};

/* The texts of config live as long as the process. False: *error, and nothing is left of it. */
bool hal_recorder_open(struct hal_recorder_process *process,
                       const struct hal_recorder_config *config, struct hal_error *error);

/* Waits for HAL_RECORDER_END_MS at most until what was to be written is written; then the process goes on alone. Closed
 * already: nothing happens. */
void hal_recorder_close(struct hal_recorder_process *process);

#endif
