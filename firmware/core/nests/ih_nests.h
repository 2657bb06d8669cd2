/* ih_nests - nests of growing ellipses around the minima of depth (paper, section 3.2).
 *
 * In:    the surface.
 * Out:   per minimum the sequence of ellipses (slices) that supports it.
 * Method: every minimum of the grid starts a nest. Levels go from the nearest node back in steps
 *        of level_step; at each level the contour that winds round the minimum supports the nest:
 *        whole when it is closed and elliptical, else by its elliptical part. Contours around a
 *        maximum (shrinking) have negative area and support nothing. A head is blunt, the nearest
 *        node is often the tip of a nose, a finger or of noise: slices smaller than blunt_mm2 are
 *        the tip and are passed over, until it is longer than tip_max_mm; the front of the nest is
 *        where the area grows past blunt_mm2. A nest ends depth_max behind its front, when its area
 *        falls below 0.6 of the slice before, when it jumps by more than 3.2 times and 2500 mm^2
 *        beyond end_depth, or after more than gap_max levels without support.
 * Fewer: ours; with everything on a nest is one candidate of many, so less will do
 *        (not with ih_nests_params_paper). A head stands out: to the left, to the right and above a
 *        minimum the surface falls off, or ends, within free_mm, else it is a fold of clothes or the
 *        background's, and starts no nest. A closed contour smaller than blunt_mm2 is the tip's whatever
 *        its shape, and no part of it is searched for. Nests that have come to the same ellipse are the
 *        same thing from there on: the nearest goes on, the others end without slices. And gap_max is 2
 *        instead of 8, level_step 20 mm instead of 10, depth_max 80 mm instead of 110: what is wider there is the
 *        neck's and the body's.
 * Cost:  levels x (cells + minima x contours); the chord search only where no whole ellipse is.
 * Full tables drop and count: minima_dropped (the farthest), contours_dropped (at levels
 * that a nest waits for: others are not cut).
 */
#ifndef IH_NESTS_H
#define IH_NESTS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "nests/ih_arcs.h"
#include "nests/ih_contours.h"
#include "nests/ih_ellipse.h"
#include "surface/ih_surface.h"

/* Minima that are followed. Each nest costs 800 bytes, most of them slices. */
#define IH_NESTS_MAX 16
#define IH_NESTS_SLICES_MAX 16

struct ih_nests_params {
    struct ih_ellipse_params ellipse;
    int32_t level_step_mm;
    int32_t levels_behind_mm; /* last level: this far behind the nearest node */
    int32_t blunt_mm2;        /* slices smaller than this belong to the tip */
    int32_t tip_max_mm;       /* a longer tip is no head's */
    int32_t depth_max_mm;     /* a nest reaches this far behind its front */
    int32_t end_depth_mm;     /* from here a jump in area ends the nest */
    int32_t gap_max;          /* levels in a row */
    /* Ours, to leave out what only nests that must be heads by themselves need: see Fewer. */
    int32_t
        free_mm; /* a minimum is free to the left, the right and above within this; 0: may lie anywhere */
    int32_t free_behind_mm; /* free: so far behind the minimum */
    bool is_tip_any;        /* the tip's contours may have any shape */
    bool is_merging;        /* of nests with the same ellipse the nearest goes on */
};

struct ih_slice {
    struct ih_ellipse ellipse;
    int32_t behind_mm_q8; /* depth of the cut behind the front */
    int32_t area_mm2;
    bool whole; /* a closed contour; false: an elliptical part */
};

struct ih_nest {
    struct ih_vertex minimum; /* a node */
    int32_t nearest_mm_q8;    /* depth of the minimum */
    int32_t front_mm_q8; /* depth at which the tip ends; the minimum's while there is no slice */
    int32_t tip_level_mm_q8, tip_area_mm2; /* the last slice of the tip */
    int32_t slice_count;
    int32_t gap;
    bool ended;
    struct ih_slice slice[IH_NESTS_SLICES_MAX];
};

struct ih_nests {
    int32_t nest_count;
    int32_t minima_dropped, contours_dropped;
    struct ih_nest nest[IH_NESTS_MAX];
};

/* What supports a nest at a level. */
struct ih_support {
    bool wanted, found;
    bool whole;      /* the last word: a closed contour */
    int32_t contour; /* of the level */
    struct ih_ellipse ellipse;
};

struct ih_nests_scratch {
    struct ih_contours contours;
    struct ih_arcs arcs; /* of one contour at a time */
    struct ih_ellipse_scratch ellipse;
    struct ih_support support[IH_NESTS_MAX];
};

IH_BEGIN_DECLS

void ih_nests_params_default(struct ih_nests_params *params);
/* For nests that must be heads by themselves. */
void ih_nests_params_paper(struct ih_nests_params *params);

void ih_nests_find(const struct ih_surface *surface, const struct ih_nests_params *params,
                   struct ih_nests_scratch *scratch, struct ih_nests *out);

/* The depth of level number index for this surface; false beyond the last. For tracing. */
bool ih_nests_level(const struct ih_surface *surface, const struct ih_nests_params *params,
                    int32_t index, int32_t *level_mm_q8);

IH_END_DECLS

#endif
