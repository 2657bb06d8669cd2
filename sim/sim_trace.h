/* sim_trace - every stage's results of one frame as a JSON file, raw integers.
 *
 * File:  OUT/LABEL/FRAME.json, LABEL the last part of the frames directory's path, FRAME the
 *        frame's name without its suffix, if no other frame shares that. Folders are made as needed;
 *        files are overwritten, so that OUT/LABEL must not be a frames directory.
 * Keys:  the names of the core's struct members with unit and format; a key per stage.
 * Error: what could not be made or written, and why.
 */
#ifndef SIM_TRACE_H
#define SIM_TRACE_H

#include "app_write.h"
#include "hal.h"
#include "isohead.h"

struct sim_trace {
    const char *out;
    const char *label;
    size_t stem_length; /* of the frame's name: as much of it as names its file (hal_replay_stem) */
};

/* OUT/LABEL in new memory; NULL: there is none. */
char *sim_trace_folder(const struct sim_trace *trace);

/* Makes OUT/LABEL before the first frame. False: *error says why nothing can be written there. */
bool sim_trace_prepare(const struct sim_trace *trace, struct hal_error *error);

/* `view` is what the core was given. Uses head->scratch to trace the contours again. False: *error says why. */
bool sim_trace_frame(const struct sim_trace *trace, const struct hal_frame *frame,
                     const struct ih_frame *view, struct isohead *head, struct hal_error *error);

/* What goes into the file, to wherever the caller wants it. */
void sim_trace_write(struct app_write *write, const struct hal_frame *frame,
                     const struct ih_frame *view, struct isohead *head);

#endif
