/* ih_windows - the few places of a depth image where a head may be (ours).
 *
 * In:    a depth image, the rig.
 * Out:   up to IH_WINDOWS_MAX windows, best first: where the middle of a head would be seen, and
 *        the depth of its front there. The middle of its volume lies about 100 mm behind that.
 * Method: 1. Survey: the image, as a level camera would see it, is cut into square cells, at most IH_WINDOWS_CELLS_MAX. A
 *           cell has the depth of the measured pixel nearest to its middle, within half a cell. While
 *           fewer than 70 % of the cells that have a depth have one at their left too, pixels are
 *           rare, as where a list of points was drawn: then cells are doubled. In the end such an
 *           image is surveyed once more with cells of half that side that look a whole side far, so
 *           that places are finer than the points lie apart.
 *        2. Score: at every cell that has a depth stands a template of a head 150 mm wide, as large
 *           as a head is at that depth. Its probes within the head should be about as deep as its
 *           middle, and bulge; those around its upper part should lie well behind it, or nothing
 *           was seen there; those below should not, for there neck, chest and shoulders are. A
 *           probe beyond the image's edge counts half: a head that is cut off has its chance. Of
 *           equals the nearer one is better. Templates narrower than width_min_q8 cells are not
 *           tried.
 *        3. The best one within apart_mm, in the image and in depth, stands for all there. Its
 *           place is the mean of those around it that score nearly as much.
 *        4. What stands on a table is no head: where all that is beside the place lies in one
 *           plane, within 40 mm, and two thirds of what is below it too, there is no window, nor
 *           near it.
 *        Windows are few: one that scores score_behind_max less than the best, or less than
 *        score_min, is none.
 * Cost:  46 probes a cell with a depth, eight divisions at most; every pixel is read about once, seven or
 *        eight times where measured ones are rare. One core of a server takes 4 ms for 640 x 480 pixels
 *        and 16 ms for 1280 x 800.
 * Error: within a step of the float64 reference, apart from probes that hit another cell.
 * Bounds: focal length 2^29 in Q16 over a depth of at least 100 mm: 2^22.4 cells per mm; times
 *        260 mm 2^30.4. The sums of a place: 19,200 cells, weights of 1000, depths of 16,000:
 *        2^38.2.
 *        The plane: inverse depths 2^23.4 in Q30, times 135 mm, eight of them, times 2^16: 2^49.5.
 */
#ifndef IH_WINDOWS_H
#define IH_WINDOWS_H

#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "rig/ih_rig.h"

#define IH_WINDOWS_MAX 8
/* 160 x 120: a cell is 4 x 4 pixels of 640 x 480. Each costs 2 bytes of scratch. */
#define IH_WINDOWS_CELLS_MAX 19200
/* Places that are remembered at a time, 8 bytes each; the worst drop out and are counted. */
#define IH_WINDOWS_PLACES_MAX 64

struct ih_windows_params {
    int32_t window_max; /* 1 .. IH_WINDOWS_MAX */
    int32_t apart_mm;
    int32_t score_min, score_behind_max;
    int32_t width_min_q8; /* cells that a head of 150 mm spans at least */
};

struct ih_window {
    int32_t x_q28, y_q28; /* normalised */
    int32_t depth_mm_q8;
    int32_t score; /* up to 1000 */
    int32_t
        spacing_px; /* 0: a surface is measured nearly everywhere; else measured pixels are rare,
                         * and about one is in every square of this side */
};

struct ih_windows {
    int32_t window_count;
    int32_t places_dropped;
    struct ih_window window[IH_WINDOWS_MAX];
};

struct ih_windows_place {
    int16_t column, row;
    int16_t depth_mm, score;
};

struct ih_windows_scratch {
    int32_t column_count, row_count, cell_px;
    /* The picture that is cut: a level rig's is the frame, another's what a level camera would see of it, without
     * distortion; then left and top are from its principal point. */
    int32_t left_px, top_px, width_px, height_px;
    int32_t place_count;
    struct ih_windows_place place[IH_WINDOWS_PLACES_MAX]; /* best first */
    int16_t depth_mm
        [IH_WINDOWS_CELLS_MAX]; /* row by row; 0: nothing measured, IH_NONE: outside of the frame */
};

IH_BEGIN_DECLS

void ih_windows_params_default(struct ih_windows_params *params);

/* IH_ERR_KIND when it is no depth image, or the rig is for none. */
enum ih_err ih_windows_find(const struct ih_frame *frame, const struct ih_rig *rig,
                            const struct ih_windows_params *params,
                            struct ih_windows_scratch *scratch, struct ih_windows *out)
    __attribute__((warn_unused_result));

IH_END_DECLS

#endif
