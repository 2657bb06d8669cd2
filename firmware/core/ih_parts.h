/* ih_parts - a contour as a polygon of equal steps, and which of its parts may be ellipses.
 *
 * In:    a contour.
 * Out:   a box around it; IH_PARTS_POINTS points at equal steps along it; for each pair of them
 *        whether the part between, closed by its chord, is worth a closer look.
 * Way:   what is the same for all minima that a contour may surround is worked out here once;
 *        ih_ellipse measures what is left. A part is left out when its chord is longer than
 *        chord_max, or when its outline is too spread for its area: an ellipse of axis ratio r and
 *        area A has a trace of its second moments of (r + 1 / r) A / 4 pi, and a polygon of shape s
 *        has s times that. Both limits together bound the trace, so that no root and no division
 *        is needed. 1/64 of it is left for what is rounded here and there.
 *        All sums of a part are relative to its first point: then the chord adds nothing to them.
 * Scaling and overflow: points differ by at most 46 * 256 = 2^13.53 in Q8 on each axis, 2^14.03 in
 *        all; a step is at most IH_PARTS_VERTICES_MAX / 55 * 1.42 grid steps = 2^12.4. An edge's
 *        cross product is below 2^26.5, its second-order term below 2^56.1: 112 of them 2^62.9.
 *        Area twice, a: b bits. With first moments (6 times) shifted by b - 15 and second ones (12
 *        times) by twice that, those of a simple polygon stay below 2^30.2 and 2^(60.7 - b); others
 *        are not judged here, nor are those with a trace below 0. 3 a times the trace and twice the
 *        squares of the others: not negative, below 2^62.7, so their difference fits.
 * Error: of the trace at most 3 units of Q16 here and 98 in ih_ellipse, of at least 43,600 for parts
 *        of 4 grid cells; smaller ones are not judged by it. That is a fourth of the 1/64.
 * Cost:  a square root for each vertex; 56 x 55 edges' sums at the very most.
 */
#ifndef IH_PARTS_H
#define IH_PARTS_H

#include "ih_cuts.h"

#define IH_PARTS_POINTS 56
/* A part has at least this many of the steps: fewer are no ellipse's outline. */
#define IH_PARTS_STEPS_MIN 8
/* Longer contours are not searched for an elliptical part; it bounds the sums. */
#define IH_PARTS_VERTICES_MAX 768
/* A part must have this much area, twice: half a grid cell. */
#define IH_PARTS_AREA2_MIN_Q16 65536

struct ih_ellipse_params {
    int32_t shape_max_q16;        /* most that shape may be for an ellipse, at least 1 */
    int32_t ratio_closed_max_q16; /* axis ratio of a closed contour, of a cut part */
    int32_t ratio_part_max_q16;
    int32_t chord_max_q16; /* chord / arc of a cut part */
};

/* Around all vertices. */
struct ih_box {
    int32_t left_q9, right_q9, top_q9, bottom_q9;
};

struct ih_parts {
    bool closed;
    bool has_parts; /* any bit of may_be is set */
    int32_t count;  /* points in use: a closed contour goes round twice */
    int32_t x_q8[2 * IH_PARTS_POINTS], y_q8[2 * IH_PARTS_POINTS]; /* places on the grid */
    /* By steps: length of a part; square of its longest chord, and one more. */
    int32_t arc_q8[IH_PARTS_POINTS];
    int32_t chord2_end_q16[IH_PARTS_POINTS];
    /* [from], bit k: the part from point `from` over k steps may be an ellipse. */
    uint64_t may_be[IH_PARTS_POINTS];
};

void ih_ellipse_params_default(struct ih_ellipse_params *params);

struct ih_box ih_parts_box(const struct ih_cuts *cuts, const struct ih_contour *contour);

/* Is the place inside the box? Outside nothing winds round it. The box is wider by 2 in Q9, what
 * resampling may round. */
bool ih_box_holds(const struct ih_box *box, struct ih_vertex place);

/* Square of the chord from one point to another. */
static inline int32_t ih_parts_chord2_q16(const struct ih_parts *parts, int32_t from, int32_t to)
{
    int32_t dx = parts->x_q8[to] - parts->x_q8[from];
    int32_t dy = parts->y_q8[to] - parts->y_q8[from];
    return dx * dx + dy * dy; /* at most 2 (46 * 256)^2 = 2^28.1 */
}

/* False when the contour is not searched: too few vertices, or too many. */
bool ih_parts_make(const struct ih_cuts *cuts, const struct ih_contour *contour,
                   const struct ih_ellipse_params *params, struct ih_parts *out);

#endif
