/* rd_output - a frames directory on disk.
 * rig.json is taken away first and written last: where it is, the directory is complete.
 * A function that returns false has printed the file and the reason on standard error. Failed writes to the lists
 * show when they are closed.
 */
#ifndef RD_OUTPUT_H
#define RD_OUTPUT_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "rd_dots.h"
#include "rd_rig.h"

#define RD_PATH_MAX 4096

#define RD_HEADS_MAX 16
#define RD_NOBODY (-1)

struct rd_head_truth {
    struct rd_vec centre_mm, semi_axes_mm;
    bool angles_known;
    double yaw_deg, pitch_deg, roll_deg;
};

struct rd_truth {
    struct rd_head_truth heads[RD_HEADS_MAX];
    int head_count;
    int head;     /* the one to find, or RD_NOBODY */
    bool several; /* all heads are listed too */
    bool board_known;
    struct rd_pose board;
};

struct rd_output {
    const char *dir;
    FILE *frames, *truth;
};

/* Makes the directory (and those above it) if needed. */
bool rd_output_open(struct rd_output *output, const char *dir);
/* What the list says of a frame. */
struct rd_frame_note {
    int64_t time_us;
    bool laser;
    const char *source; /* what it was made of, or NULL */
};

bool rd_output_frame(struct rd_output *output, int frame, const struct rd_frame_note *note, const struct rd_rig *rig,
                     int max_value, const uint16_t *samples);
/* `dots`: NULL with a depth camera. */
void rd_output_truth(struct rd_output *output, int frame, const struct rd_truth *truth, const struct rd_dot_list *dots);
/* Removes an earlier run's frames other than first .. end - 1, closes the lists and writes rig.json. */
bool rd_output_finish(struct rd_output *output, const struct rd_rig *rig, int first, int end);
/* Gives up: closes what is open. */
void rd_output_abandon(struct rd_output *output);

#endif
