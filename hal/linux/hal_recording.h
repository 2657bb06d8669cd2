/* hal_recording - frames on a disk as frames directories (docs/contract.md, "recording").
 *
 * In:    frames one by one, each with its part: the number of an uninterrupted recording.
 * Out:   DIR/000001, 000002, ... from the first number that is free, one for each part; a new one too where names get longer,
 *        as frames are sorted by name. In each rig.json as it was read when the part's rig was loaded, settings.json,
 *        the frames as PGM and frames.jsonl.
 * Order: a frame is written under a hidden name, then its line, then it gets its name. What a power cut leaves is a hidden
 *        file, or a line without a frame, or one that is cut short: host_sim reports it and reads the others.
 *        After a write that failed the file is removed, and the list as long as before.
 * Bound: all files in DIR, those of before among them, are counted; a frame that would not fit is refused.
 * Error: text with what was written and why not. The next frame is tried again.
 */
#ifndef HAL_RECORDING_H
#define HAL_RECORDING_H

#include "hal.h"

#define HAL_RECORDING_PATH_MAX 1024
#define HAL_RECORDING_NAME_MAX 32
/* Largest rig file that is copied. */
#define HAL_RECORDING_RIG_MAX (1024 * 1024)

struct hal_recording_config {
    const char *dir; /* is made where only it itself is missing */
    const char *rig; /* file */
    const char *up;  /* as JSON, for a rig file that does not say it; NULL: it stays as it is */
    const char *settings; /* what settings.json has */
    int64_t bytes_max;
};

/* A frame without its samples, as it waits in memory. */
struct hal_recording_frame {
    int64_t part;
    int64_t rig_count; /* how often the rig had been read anew */
    int64_t time_us;
    int32_t width, height, bytes_per_sample, maximum;
    bool lit;
    char name[HAL_RECORDING_NAME_MAX];
};

struct hal_recording {
    struct hal_recording_config config;
    int64_t bytes; /* of all files in the directory */
    char part_dir[HAL_RECORDING_PATH_MAX];
    int64_t part;       /* 0: none is begun */
    size_t name_length; /* of its frames */
    int list_fd;
    int64_t list_bytes;
    char *rig_text;
    size_t rig_size;
};

/* The directory is there and can be written to. False: *error. */
bool hal_recording_open(struct hal_recording *recording, const struct hal_recording_config *config,
                        struct hal_error *error);

/* Read the rig's file, for parts that begin from now on. False: *error, and the one of before stays. */
bool hal_recording_rig(struct hal_recording *recording, struct hal_error *error);

/* samples: as many as the frame has, without padding, in the processor's order; they are changed. */
bool hal_recording_put(struct hal_recording *recording, const struct hal_recording_frame *frame,
                       uint8_t *samples, struct hal_error *error);

/* To the disk, with all that belongs to the part. Closed already: nothing happens. */
void hal_recording_close(struct hal_recording *recording);

#endif
