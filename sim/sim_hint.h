/* sim_hint - frames and rig file do not fit: what is wrong, in one line at the end of a directory.
 *
 * A frame that is read can still be of another rig. Three cases are reported, on standard error; the exit status stays:
 *   dots    of the frames with 60 dots and more, more than half have labels for fewer than a fifth of them, or by chance
 *           alone (fewer than half, beside the lines of a rig that has moved): the file of another rig, or one that moved
 *           beyond what ih_align corrects. If dots of most of these frames lie on the lines of the rig's file, what is seen
 *           is nearer or farther than the working range, or the projector stands elsewhere along the baseline; not with
 *           --paper, which does not look.
 *   depth   of the measured pixels of all frames fewer than 2 % lie within near_mm .. far_mm: another working range, or
 *           another unit. When 80 % would lie there with another unit, that unit is named. Samples with their bytes
 *           swapped are spread over all values, so there fewer than a third within the range are enough.
 *   unread  files that may hold frames, but in a format that is not read: how many, and how to convert the first.
 * Frames where hardly a pixel is measured, with the background cut away, say nothing.
 */
#ifndef SIM_HINT_H
#define SIM_HINT_H

#include <stdbool.h>
#include <stdint.h>

#include "isohead.h"
#include "sim_report.h"

struct sim_hint {
    int32_t dotted_count, bare_count; /* frames with dots; those of them with hardly a label */
    int32_t on_lines_count;           /* of the latter, those whose dots lie on the file's lines */
    int64_t pixel_count;              /* of all range frames */
    int64_t *depth_count;             /* pixels of each depth in mm; NULL: no range frame yet */
    int32_t scale_q20;                /* by which they came to mm (app_rig.h) */
};

/* view: what the core was given. */
void sim_hint_frame(struct sim_hint *hint, const struct isohead *head, const struct ih_frame *view);

/* dir, rig: paths. */
void sim_hint_report(const struct sim_hint *hint, const struct isohead *head, const char *dir,
                     const char *rig, struct sim_report *report);

/* with_lists: lists of points are frames. */
void sim_hint_unread(const char *dir, bool with_lists, struct sim_report *report);

void sim_hint_free(struct sim_hint *hint);

#endif
