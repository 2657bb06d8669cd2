/* hal_directory - a frames directory as a live camera, so that a board's program runs without hardware.
 *
 * In:    a directory as hal_replay.h reads it.
 * Out:   its frames, at the distances in time that it says, or at a rate of the caller's. A step longer than
 *        HAL_DIRECTORY_STEP_MAX_US is waited for no longer than that, so that no gap looks like a camera that has failed.
 *        A frame waits until it is taken, and the next one is due its step later: none is skipped.
 *        name, sequence: as a camera's (hal_v4l2.h), counted from 0. time_us, laser: as the directory says; from the
 *        second pass on times go on a step after the last one. Error texts begin with the file's name.
 * End:   HAL_NEXT_END, or from the first frame on again.
 * Error: on init: that of hal_replay_open; what is wrong in frames.jsonl goes to the log. A frame that cannot be read is
 *        HAL_NEXT_BAD. set_exposure is refused.
 */
#ifndef HAL_DIRECTORY_H
#define HAL_DIRECTORY_H

#include "hal.h"
#include "replay/hal_replay.h"

#define HAL_DIRECTORY_STEP_MAX_US 500000
/* The shortest time between frames that is said. */
#define HAL_DIRECTORY_STEP_MIN_US 1000
#define HAL_DIRECTORY_NAME_MAX 32

struct hal_directory_config {
    const char *path;
    int32_t rate_mhz; /* frames in 1000 s; 0: at their own times */
    bool repeats;
};

/* A frame that is out. */
struct hal_directory_hold {
    bool used;
    char name[HAL_DIRECTORY_NAME_MAX];
};

struct hal_directory {
    struct hal_camera camera;
    int fd; /* readable when a frame is due; -1 while closed */
    /* Private from here on. */
    struct hal_directory_config config;
    struct hal_replay replay;
    struct hal_directory_hold hold[HAL_CAMERA_HOLD_MAX + 1];
    int64_t due_us;    /* by the clock */
    int64_t passed_us; /* of the passes before this one */
    bool has_first;    /* a frame was read: */
    int64_t first_us;  /* time of the first one, in the directory */
    int64_t last_us;   /* and of the last one, as handed on */
    int64_t sequence;
    char bad_name[HAL_DIRECTORY_NAME_MAX];
};

/* Reads the list of files; config.path stays the caller's. False: *error, and there is nothing to free. */
bool hal_directory_init(struct hal_directory *directory, const struct hal_directory_config *config,
                        const struct hal_log *log, struct hal_error *error);
void hal_directory_free(struct hal_directory *directory);

#endif
