/* ih_ellipse - the ellipse of a polygon by its area moments, and the elliptical part of a contour
 * (paper, section 3.2).
 *
 * In:    a polygon on the grid; for the part also a place that it must surround.
 * Out:   area, centre and second moments; shape = 4 pi sqrt(det) / area, det that of the
 *        covariance: 1 for an ellipse and greater for everything else.
 * Way:   moments are sums over the edges, so prefix sums give those of any part closed by its
 *        chord. The contour is resampled to IH_ELLIPSE_POINTS equal steps; of all parts that wind
 *        round the place with chord <= chord_max arc, and that are elliptical, the one with the
 *        greatest arc - 1.6 chord - 8 (shape - 1) arc is taken.
 * Scaling and overflow: coordinates relative to the place, Q8 steps, below 2^13.6; edges of a
 *        contour are shorter than 1.5 steps, of a resampled one than 55; see docs/numerics.md for
 *        the bound 2^62 on the sums of third order.
 */
#ifndef IH_ELLIPSE_H
#define IH_ELLIPSE_H

#include "ih_cuts.h"

#define IH_ELLIPSE_POINTS 56

struct ih_ellipse_params {
    int32_t shape_max_q16;        /* most that shape may be for an ellipse */
    int32_t ratio_closed_max_q16; /* axis ratio of a closed contour, of a cut part */
    int32_t ratio_part_max_q16;
    int32_t chord_max_q16;        /* chord / arc of a cut part */
};

/* In grid steps. Second moments are central, per area. */
struct ih_ellipse {
    int64_t area_q16; /* signed: positive around a minimum */
    int32_t x_q16, y_q16;
    int64_t xx_q16, xy_q16, yy_q16;
    int32_t shape_q16;
    int32_t ratio_q16; /* major / minor axis, at most 255 */
};

struct ih_ellipse_scratch {
    struct ih_vertex point[IH_ELLIPSE_POINTS];
    /* prefix sums around the place, over twice the points for closed contours */
    int64_t area[2 * IH_ELLIPSE_POINTS + 1];
    int64_t first_x[2 * IH_ELLIPSE_POINTS + 1], first_y[2 * IH_ELLIPSE_POINTS + 1];
    int64_t second_xx[2 * IH_ELLIPSE_POINTS + 1], second_xy[2 * IH_ELLIPSE_POINTS + 1],
        second_yy[2 * IH_ELLIPSE_POINTS + 1];
    int32_t arc_q8[2 * IH_ELLIPSE_POINTS + 1];
    int32_t crossings[2 * IH_ELLIPSE_POINTS + 1];
};

void ih_ellipse_params_default(struct ih_ellipse_params *params);

/* Moments of a closed contour. False when it has no area. */
bool ih_ellipse_of_contour(const struct ih_cuts *cuts, const struct ih_contour *contour,
                           struct ih_ellipse *out);

/* Does the closed contour wind round the place? */
bool ih_ellipse_surrounds(const struct ih_cuts *cuts, const struct ih_contour *contour,
                          struct ih_vertex place);

/* The best elliptical part of an open or closed contour around the place. False when none. */
bool ih_ellipse_of_part(const struct ih_cuts *cuts, const struct ih_contour *contour,
                        struct ih_vertex place, const struct ih_ellipse_params *params,
                        struct ih_ellipse_scratch *scratch, struct ih_ellipse *out);

#endif
