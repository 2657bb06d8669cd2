/* ih_arcs - a contour as a polygon of equal steps, and which of its arcs may be ellipses.
 *
 * In:     a contour.
 * Out:    point_count points at equal steps along it; of the arcs between two of them, closed by their
 *         chords, those that may be ellipses, each with an upper bound of its merit; a box around it.
 * Method: done once for all minima that a contour may surround; ih_ellipse measures what remains. Sums over
 *         the edges about the middle of the outline give those of any arc as a difference. An arc is dropped
 *         when its chord is longer than chord_max, when its shape or axis ratio is beyond the limit, or when
 *         it is too spread for its area: an ellipse of axis ratio r and area A has a trace of its second
 *         moments of (r + 1 / r) A / 4 pi, and a polygon of shape s has s times that. No test needs a root,
 *         and every limit has a margin for rounding. ih_arc_fans drops most arcs before that.
 * Scaling and overflow: the outline lies within 2^h of its middle on each axis, h at most 13. An outline is
 *         tangled, and not judged, when the absolute values of its edges' cross products add up to more than
 *         2^(2h + 5); nor is an arc whose area, twice, is larger than the box, 2^(2h + 3). Not judged means
 *         that it may have any shape. So first moments, six times, are below 2^(3h + 6.2), second ones,
 *         twelve times, below 2^(4h + 7.8). Shifted by 3h - 24 and by twice that they are below 2^30.2 and
 *         2^29.8. Products of two first moments, and three times a second one with the area, are below
 *         2^60.4: four of those fit. Sums of areas wrap at 2^32, but twice the area of an arc is below 2^31:
 *         in a square of side s a curve of length L surrounds at most s L / 3.54, L below 2^18.2, s 2^13.6.
 * Error:  a spread is 18 a^2 times a second moment, for twice the area a: 3 a times a sum minus twice a
 *         product of first moments. An arc that ih_ellipse accepts has its centre within 93 * 256 of the
 *         outline's middle, so the shift of first moments costs a spread at most 12 a 93 * 256 >> shift, that
 *         of second ones 3 a; ih_ellipse rounds second moments by at most 49 units of Q16: 882 a^2.
 * Cost:   a square root for each vertex, and about 100 instructions for each arc that fans leave.
 */
#ifndef IH_ARCS_H
#define IH_ARCS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "nests/ih_contours.h"

/* Points on a contour, whole vectors; the work grows with the square. */
#define IH_ARCS_POINTS_MAX 56
#define IH_ARCS_POINTS_MIN 16
/* An arc has at least this many steps: fewer do not outline an ellipse. */
#define IH_ARCS_STEPS_MIN 8
/* All arcs: from each point over each number of steps. */
#define IH_ARCS_MAX (IH_ARCS_POINTS_MAX * (IH_ARCS_POINTS_MAX - IH_ARCS_STEPS_MIN))
/* Vectors load beyond the last point. */
#define IH_ARCS_FAN (2 * IH_ARCS_POINTS_MAX + 8)
/* Longer contours are not searched for an elliptical arc; it bounds the sums. */
#define IH_ARCS_VERTICES_MAX 768
/* An arc must have this much area, twice: half a grid cell. */
#define IH_ARCS_AREA2_MIN_Q16 65536
/* No simple polygon has a shape below 1, the ellipse's: below that the chord crosses the arc. 1 / 256 is the
 * margin for rounding. */
#define IH_ARCS_SHAPE_MIN_Q16 65280

struct ih_ellipse_params {
    /* On a contour, rounded down to a multiple of 8 between IH_ARCS_POINTS_MIN and _MAX. A head found by
     * nests alone needs 56; 32 find as many where other candidates stand beside them. */
    int32_t point_count;
    int32_t shape_max_q16;        /* an ellipse's, at least 1 */
    int32_t ratio_closed_max_q16; /* axis ratio of a closed contour, of an arc */
    int32_t ratio_arc_max_q16;
    int32_t chord_max_q16; /* chord / length of an arc */
};

/* Bounding box of the vertices. */
struct ih_box {
    int32_t left_q9, right_q9, top_q9, bottom_q9;
};

/* From point `from` over the steps. */
struct ih_arc {
    int32_t merit_max_q8; /* upper bound of the merit that ih_ellipse measures */
    uint8_t from, steps;
};

/* [k]: sums over the edges before point k, about the outline's middle. */
struct ih_arcs_sums {
    uint32_t area2_q16[2 * IH_ARCS_POINTS_MAX];                             /* twice; wraps */
    int64_t x_q24[2 * IH_ARCS_POINTS_MAX], y_q24[2 * IH_ARCS_POINTS_MAX];   /* 6 times */
    int64_t trace_q32[2 * IH_ARCS_POINTS_MAX];                              /* 12 times, x and y */
    int64_t xx_q32[2 * IH_ARCS_POINTS_MAX], xy_q32[2 * IH_ARCS_POINTS_MAX]; /* 12 and 24 times */
};

struct ih_arcs {
    bool closed;
    int32_t point_count; /* at equal steps along the contour */
    int32_t count;       /* points in use: a closed contour goes round twice */
    int32_t x_q8[2 * IH_ARCS_POINTS_MAX], y_q8[2 * IH_ARCS_POINTS_MAX]; /* on the grid */
    int32_t length_q8[IH_ARCS_POINTS_MAX];                              /* of an arc, by steps */
    int32_t arc_count;
    struct ih_arc arc[IH_ARCS_MAX]; /* by point, then by steps */
    /* scratch */
    int32_t edge_length_q9[IH_ARCS_VERTICES_MAX];
    int32_t dx_q8[2 * IH_ARCS_POINTS_MAX], dy_q8[2 * IH_ARCS_POINTS_MAX]; /* from the middle */
    int32_t square_q16[2 * IH_ARCS_POINTS_MAX];                           /* of that distance */
    int32_t chord2_end_q16[IH_ARCS_POINTS_MAX]; /* by steps: squares of chords are below */
    uint32_t low[IH_ARCS_POINTS_MAX], high[IH_ARCS_POINTS_MAX]; /* bits of ih_arc_fans */
    uint32_t fan[IH_ARCS_FAN], normal[IH_ARCS_FAN]; /* pairs (x, y), and (-y, x), in fan units */
    int32_t chord2_end[IH_ARCS_POINTS_MAX];         /* as chord2_end_q16, in fan units */
    struct ih_arcs_sums sums;
};

IH_BEGIN_DECLS

void ih_ellipse_params_default(struct ih_ellipse_params *params);

struct ih_box ih_arcs_box(const struct ih_contours *contours, const struct ih_contour *contour);

/* Is the point inside the box, with a margin of 2 in Q9 for resampling? No contour winds round one outside. */
bool ih_box_holds(const struct ih_box *box, struct ih_vertex point);

/* Square of the chord from one point to another. */
static inline int32_t ih_arcs_chord2_q16(const struct ih_arcs *arcs, int32_t from, int32_t to)
{
    int32_t dx = arcs->x_q8[to] - arcs->x_q8[from];
    int32_t dy = arcs->y_q8[to] - arcs->y_q8[from];
    return dx * dx + dy * dy; /* at most 2 (46 * 256)^2 = 2^28.1 */
}

/* An arc's merit: length - 1.6 chord - 8 (shape - 1) length. */
int32_t ih_arcs_merit_q8(int32_t length_q8, int32_t chord_q8, int32_t shape_q16);

/* False: the contour has too few or too many vertices. */
bool ih_arcs_make(const struct ih_contours *contours, const struct ih_contour *contour,
                  const struct ih_ellipse_params *params, struct ih_arcs *out);

IH_END_DECLS

#endif
