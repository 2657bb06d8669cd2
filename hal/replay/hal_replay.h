/* hal_replay - a frames directory as a camera.
 *
 * In:    the directory's *.pgm and *.png, in upper or lower case, and, if it is there, its frames.jsonl
 *        (docs/contract.md); its *.xyz too, lists of points (hal_xyz.h), for a program that asks for them.
 * Out:   the frames in the lexicographic (byte) order of their names. Without frames.jsonl the
 *        laser is on and frames are HAL_REPLAY_STEP_US apart.
 * Error: on opening: no directory, one that cannot be read to its end, no frames, no memory. To the log: what is wrong in frames.jsonl
 *        and cannot be tied to a frame; how many listed frames are not there, in one line. As HAL_NEXT_BAD,
 *        in the frame's place: a frame that cannot be read; a frame that frames.jsonl does not list; one
 *        whose line has a bad time_us or laser, or a time before that of the frame before it.
 *
 * frames.jsonl line by line: empty lines are skipped; `laser` may be left out and is true; of two
 * lines for one frame the first counts and the second goes to the log; a line that is no JSON
 * object or has no usable `file` goes to the log, and the frame that it meant is then unlisted.
 * When frames.jsonl is there but cannot be opened, that goes to the log and the frames get the
 * times that they would have without it.
 */
#ifndef HAL_REPLAY_H
#define HAL_REPLAY_H

#include <stddef.h>

#include "hal.h"

#define HAL_REPLAY_STEP_US 40000

struct hal_replay_entry {
    char *name;
    int64_t time_us;
    bool laser;
    bool listed; /* frames.jsonl has a line for it */
    bool bad;    /* cannot be handed on, because of its line */
    char *error; /* why */
};

struct hal_replay {
    struct hal_camera camera; /* the way to the frames: next and release, nothing else */
    char *dir;
    struct hal_replay_entry *entry; /* sorted by name */
    size_t entry_count, entry_capacity;
    size_t next_index;
    bool with_lists; /* *.xyz are frames too */
    bool listed;     /* there is a frames.jsonl */
    /* what it lists and is not there: how many, and the first one's line */
    size_t absent_count;
    long absent_line;
};

/* log is used during this call only. False: *error says why, and there is nothing to close. */
bool hal_replay_open(struct hal_replay *replay, const char *dir, bool with_lists,
                     const struct hal_log *log, struct hal_error *error);
void hal_replay_close(struct hal_replay *replay);

/* Would a file of this name be a frame? */
bool hal_replay_is_frame(const char *name, bool with_lists);

/* Is a frame of this name on the disk? */
bool hal_replay_has(const struct hal_replay *replay, const char *name);

/* Length of the part of a frame's name that other files of the frame are named by: without its suffix, but with it where
 * another frame would have the same name (a.pgm, a.png), or has it (a.pgm and a.pgm.png). No two frames share one. */
size_t hal_replay_stem(const struct hal_replay *replay, const char *name);

#endif
