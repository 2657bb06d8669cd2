/* ih_ellipse - the ellipse of a polygon by its area moments, and the elliptical part of a contour
 * (paper, section 3.2).
 *
 * In:    a polygon on the grid; for the part its outline, and a place that it must surround.
 * Out:   area, centre and second moments; shape = 4 pi sqrt(det) / area, det that of the
 *        covariance: 1 for an ellipse and greater for everything else.
 * Method: moments are sums over the edges. Of all arcs (IH_ARCS_STEPS_MIN of the outline's steps at
 *        least, chord <= chord_max arc) that wind round the place and are elliptical, the one with the
 *        largest arc - 1.6 chord - 8 (shape - 1) arc is taken, of equal ones the first, the shortest
 *        of those. ih_arcs says which may be some and what they can have at most: the most
 *        promising one is measured first, then only those that may have as much.
 *        No simple polygon has a shape below 1: a part with less (1/256 is left for rounding)
 *        crosses its own chord and is refused, as is an area below half a grid cell.
 * Scaling and overflow: coordinates relative to the place, Q8 steps: |p| below 46 * 256 * 1.42 =
 *        2^14.1. An edge's cross product is at most |p| |edge|, its second-order factor at most
 *        3 * 2^27.1. Edges of a contour are shorter than 1.42 steps = 2^8.6: 2048 terms of
 *        2^(14.1 + 8.6 + 28.7) sum below 2^62.4. However many points a resampled one has, its edges,
 *        twice round, add up to at most 2 IH_ARCS_VERTICES_MAX 1.42 steps = 2^19.1: terms below
 *        2^61.9. About the middle of an outline, from where sums are moved to the place, coordinates
 *        are half as great.
 * Cost:  a closed contour: 40 operations a vertex. A part: some 100, 20 in 32 bits a step, and eight
 *        divisions.
 */
#ifndef IH_ELLIPSE_H
#define IH_ELLIPSE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "nests/ih_arcs.h"
#include "nests/ih_contours.h"

/* In grid steps. Second moments are central, per area. */
struct ih_ellipse {
    int32_t area_q16; /* signed: positive around a minimum */
    int32_t x_q16, y_q16;
    int32_t xx_q16, xy_q16, yy_q16;
    int32_t shape_q16;
    int32_t ratio_q16; /* major / minor axis, at most 255 */
    int32_t merit_q8;  /* of a part: arc - 1.6 chord - 8 (shape - 1) arc, steps */
};

/* Sums over the edges of a polygon around a place, coordinates in Q8 steps; see ih_ellipse.c. */
struct ih_moments {
    int64_t area2_q16;              /* twice the area */
    int64_t x_q24, y_q24;           /* 6 times the first moments */
    int64_t xx_q32, xy_q32, yy_q32; /* 12 times the second moments */
};

struct ih_ellipse_scratch {
    int32_t winding[2 * IH_ARCS_POINTS_MAX]; /* of an outline's edges before each point */
    struct ih_arc arc;                       /* the one that was found */
};

IH_BEGIN_DECLS

/* Moments of a closed contour. False when it has no area. */
bool ih_ellipse_of_contour(const struct ih_contours *contours, const struct ih_contour *contour,
                           struct ih_ellipse *out);

/* How often the contour, closed by a chord if it is open, winds round the place: 1 around a
 * minimum, -1 around a maximum, 0 beside. */
int32_t ih_ellipse_winding(const struct ih_contours *contours, const struct ih_contour *contour,
                           struct ih_vertex place);

/* The best elliptical part of an outline around the place, a whole number of Q8 as a node is; params
 * as the outline was made with. False when none. */
bool ih_ellipse_of_part(const struct ih_arcs *arcs, struct ih_vertex place,
                        const struct ih_ellipse_params *params, struct ih_ellipse_scratch *scratch,
                        struct ih_ellipse *out);

IH_END_DECLS

#endif
