/* ih_align_pairs - how far across its epipolar line a dot lies, and what moves it there. Private to align.
 *
 * A pair is a slot with a dot near its line. Five numbers move dots across their lines: rotations of the projector about
 * the baseline (which they show best), about the axis across it (which is depth, and which only the pattern's keystone
 * shows) and about the camera's axis, the focal length, and a shift of the picture across the baseline, which is hardly
 * another thing than the first. In pixels: angle or relative change times the focal length in px.
 */
#ifndef IH_ALIGN_PAIRS_H
#define IH_ALIGN_PAIRS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dot_rows.h"
#include "rig/ih_rig.h"

enum ih_align_axis {
    IH_ALIGN_BASELINE,
    IH_ALIGN_DEPTH,
    IH_ALIGN_ROLL,
    IH_ALIGN_FOCAL,
    IH_ALIGN_SHIFT
};
#define IH_ALIGN_AXES 5

/* Pairs that a search and a fit take; more are dropped, as in a picture full of noise. With a baseline of 125 mm all 361
 * dots have 3,400. */
#define IH_ALIGN_FOUND_MAX 4096
#define IH_ALIGN_PAIRS_MAX 1024
/* Dots near one slot's line; more are dropped. Of 880 dots a search with 125 mm has up to 39. */
#define IH_ALIGN_NEAR_MAX 48

struct ih_align_pair {
    int32_t across_px_q12;
    int16_t slope_q12[IH_ALIGN_AXES]; /* of the distance, by the five */
};

struct ih_align_pairs {
    int32_t count;
    struct ih_align_pair pair[IH_ALIGN_PAIRS_MAX];
};

/* The camera's X and Y along the baseline, as the middle dot's line shows it. */
struct ih_align_axes {
    int32_t along_q14[2];
    int32_t aspect_q14; /* fy over fx */
};

/* Where a dot lies: along a line from its point at infinity, and across it. */
struct ih_align_dot {
    int32_t along_px_q12, across_px_q12;
};

/* Dots within half a band of a line, from the nearest depth of the working range to infinity, both widened by a margin: a
 * wall beyond the range shows where the lines are, too. */
struct ih_align_band {
    int32_t half_px_q12, margin_px_q12;
};

void ih_align_axes(const struct ih_rig *rig, struct ih_align_axes *out);

void ih_align_slopes(const struct ih_rig *rig, const struct ih_align_axes *axes, int32_t slot,
                     int16_t slope_q12[IH_ALIGN_AXES]);

static inline int64_t ih_align_field_px_q12(const int16_t slope_q12[IH_ALIGN_AXES],
                                            const int32_t moved_px_q12[IH_ALIGN_AXES])
{
    int64_t sum_q24 = 0;
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        sum_q24 += (int64_t)slope_q12[k] * moved_px_q12[k];
    }
    return (sum_q24 + 2048) >> 12;
}

/* Dots at a line. *first: of the rows, kept from slot to slot. Returns how many. */
int32_t ih_align_near(const struct ih_dot_rows *rows, const struct ih_line *line,
                      struct ih_align_band band, int32_t *first,
                      struct ih_align_dot dot[IH_ALIGN_NEAR_MAX]);

#endif
