/* ih_align - where the rig is now, against its file: heat, a knock or a lens that was refocused moves all dots off
 * their epipolar lines together.
 *
 * In:     dots, rig; after the labels, which dot is whose.
 * Out:    the rig's lines where the dots are, the dots by row, and how the rig has moved: a rotation of the projector, a
 *         change of focal length and a shift of the picture, with uncertainty.
 * Method: 1. Look: dots within 0.3 px of the lines, against those 0.6 to 1.2 px beside them. If nearly as many of all dots
 *            lie on the lines as did since the last search, or hardly one beside them, the rig is where it was. Lines are
 *            looked at from the near end of the working range to infinity: of a room beyond the range no dot gets a
 *            label, but all show where the lines are. Every second slot is looked at, and all of them where these do
 *            not show it.
 *         2. If not, search (ih_align_search): back at the file's lines, or around them. The result is taken when more dots
 *            lie on its lines than before. After searches in vain there are pauses of up to 8 frames. If dots lie on
 *            the lines and in the working range, widened by 7 px, but less than three quarters as many get labels, depth
 *            alone is searched for before all else, and must be 5 times its uncertainty. In one frame a wrong motion may have the
 *            most dots, and its own labels keep it: in each of the 16 frames after a search lines go back to where they
 *            were if no fewer dots lie there, or are searched for again, unless hardly a dot lies beside them.
 *         3. Learn, after the labels, if they are at least a quarter as many as the dots on the lines: a fit to how far
 *            labelled dots lie across their lines, averaged with those of up to 16 frames before. A frame that differs
 *            starts the mean anew. Frames of fewer than 30 dots teach nothing. The lines move when the mean is 0.1 px
 *            off them (0.05 px once they have moved), or when depth is: 0.04 degrees and 3 times its uncertainty (then
 *            0.01 degrees and once).
 *         Where the rig is right nothing changes, to the last bit.
 *         The rotation about the axis across the baseline is depth. Dots show it by the pattern's keystone alone: to
 *         0.02 degrees in a frame of a room, 0.2 where half of the dots are missing.
 * Limits: 12 px across a line, 1 degree about the camera's axis, 0.8 of depth, 1 % of focal length. Not seen: a shift along the
 *         baseline, and of the principal point along it.
 * Cost:   looking and learning 0.12 to 0.16 M instructions, a search 0.6 to 0.85 M (x86-64-v3): docs/performance.md.
 * Error:  against float64 on the same dots: docs/numerics.md.
 */
#ifndef IH_ALIGN_H
#define IH_ALIGN_H

#include <stdbool.h>
#include <stdint.h>

#include "align/ih_align_fit.h"
#include "align/ih_align_pairs.h"
#include "align/ih_align_search.h"
#include "base/ih_config.h"
#include "dots/ih_dot_rows.h"
#include "dots/ih_dots.h"
#include "labels/ih_labels.h"
#include "rig/ih_rig.h"

enum ih_align_state {
    IH_ALIGN_UNKNOWN, /* too few dots were ever seen */
    IH_ALIGN_FITS,    /* dots lie on the lines of the rig's file */
    IH_ALIGN_MOVED,   /* the rig has moved, and lines with it */
    IH_ALIGN_LOST,    /* dots are there, but lie on no lines within the limits */
};

/* How the rig has moved against its file. */
struct ih_alignment {
    enum ih_align_state state;   /* of the last frame with enough dots */
    int32_t rotation_rad_q30[3]; /* of the projector about the camera's axes */
    int32_t focal_q30;           /* relative change of the focal length */
    int32_t shift_px_q12[2];     /* of the picture */
    int32_t sigma_rad_q30[3];    /* one standard deviation */
    /* Mean distance of this frame's labelled dots from their lines; -1: none. */
    int32_t across_px_q12;
    int32_t depth_sigma_rad_q30; /* of the rotation that is depth */
    bool is_depth_known;
};

struct ih_align {
    struct ih_alignment now;
    int32_t ray_q30[IH_SLOTS][3]; /* of the rig's file */
    struct ih_align_axes axes;
    int32_t prior_px_q12[IH_ALIGN_AXES];
    int32_t moved_px_q12[IH_ALIGN_AXES]; /* the rig's lines, against its file */
    struct ih_align_sums mean;           /* over frame_count frames */
    int32_t frame_count;
    int32_t odd;         /* slots of the last frame, after the first frames */
    int32_t excess;      /* of this frame: dots on the lines, less those that chance puts there */
    int32_t near_excess; /* the same of dots that are no more than 7 px beyond the range */
    bool is_short;       /* the last frame had labels for less than three quarters of the latter */
    bool is_depth_new;   /* depths have changed by more than tracks follow; the caller clears it */
    int32_t vain_count;  /* searches that found nothing, one after the other */
    int32_t pause;       /* frames until the next one */
    int32_t trusted_q8;  /* fraction of the dots on the lines that is good enough */
    /* Frames since a search moved the lines, and where they were before; 0: what it found is not questioned any more. */
    int32_t unsettled_frames, settled_px_q12[IH_ALIGN_AXES];
};

IH_BEGIN_DECLS

/* rig: as ih_rig_init made it. */
void ih_align_init(struct ih_align *align, const struct ih_rig *rig);

/* Before the labels. Fills rows, and moves the rig's lines if dots lie elsewhere. */
void ih_align_find(struct ih_align *align, const struct ih_dots *dots, struct ih_rig *rig,
                   struct ih_dot_rows *rows, struct ih_align_scratch *scratch);

/* After the labels of a frame that is used; for the next one. */
void ih_align_learn(struct ih_align *align, const struct ih_labels *labels, struct ih_rig *rig,
                    struct ih_align_scratch *scratch);

/* What the uncertainty of the rotation, of which more than 0.9 degrees count as 0.9, is at a depth, one standard
 * deviation; at most IH_DEPTH_MAX_MM. */
int32_t ih_align_depth_sigma_mm_q8(const struct ih_align *align, const struct ih_rig *rig,
                                   int32_t depth_mm_q8);

IH_END_DECLS

#endif
