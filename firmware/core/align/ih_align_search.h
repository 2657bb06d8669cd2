/* ih_align_search - where the dots of one frame lie, if not on their lines. Private to align.
 *
 * In:     dots by row, the rig with the lines of its file.
 * Out:    the five numbers of ih_align_pairs.h.
 * Method: all pairs of a slot and a dot within 16 px of its line, from the nearest depth to infinity and 10 px more at
 *         both ends; votes over planes in bins of 0.5 px, then of 0.2 px around each of the best and for rotations of
 *         depth; a fit to the pairs within 1 px of the best one. Where dots are less than 28 px apart the 16 and 0.5 px
 *         are as much less. Depth is 0 unless it is 3 times its uncertainty, or 5 times where it is searched for alone.
 */
#ifndef IH_ALIGN_SEARCH_H
#define IH_ALIGN_SEARCH_H

#include <stdbool.h>
#include <stdint.h>

#include "align/ih_align_pairs.h"
#include "align/ih_align_vote.h"
#include "base/ih_config.h"
#include "dots/ih_dot_rows.h"
#include "rig/ih_rig.h"

/* Depth is seen where it is more than this, and than 3 times its uncertainty. */
#define IH_ALIGN_DEPTH_MIN_RAD_Q30 749606 /* 0.04 degrees */
#define IH_ALIGN_DEPTH_SIGMAS 3
/* So much moves dots of a far wall out of the working range. */
#define IH_ALIGN_DEPTH_FAR_RAD_Q30 1874016 /* 0.1 degrees */

/* Votes come first, the fit later. */
union ih_align_work {
    struct ih_align_votes votes;
    struct ih_align_pairs pairs;
};

struct ih_align_scratch {
    int16_t slope_q12[IH_SLOTS][IH_ALIGN_AXES];
    /* Distances of dots across their lines, one slot's after the other's. */
    uint8_t found_count[IH_SLOTS];
    int16_t found_px_q10[IH_ALIGN_FOUND_MAX];
    union ih_align_work at;
};

/* False: no plane has more votes than what lies beside it. */
bool ih_align_search(const struct ih_align_axes *axes, const int32_t prior_px_q12[IH_ALIGN_AXES],
                     const struct ih_rig *rig, const struct ih_dot_rows *rows,
                     struct ih_align_scratch *scratch, int32_t moved_px_q12[IH_ALIGN_AXES]);

/* Around the rig's lines as they are now, where labels are short: what is left, of it a rotation of depth. False:
 * there is none that could be the reason. */
bool ih_align_search_depth(const struct ih_align_axes *axes,
                           const int32_t prior_px_q12[IH_ALIGN_AXES], const struct ih_rig *rig,
                           const struct ih_dot_rows *rows, struct ih_align_scratch *scratch,
                           int32_t moved_px_q12[IH_ALIGN_AXES]);

#endif
