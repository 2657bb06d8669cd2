/* ih_arcs - a contour as a polygon of equal steps, and which of its parts may be ellipses.
 *
 * In:    a contour.
 * Out:   a box around it; point_count points at equal steps along it; of the parts between two of
 *        them, closed by their chords, those that are worth a closer look, each with the most merit
 *        that it can have.
 * Way:   what is the same for all minima that a contour may surround is worked out here once;
 *        ih_ellipse measures what is left. Sums over the edges about the middle of the outline give
 *        those of any part. One is left out when its chord is longer than chord_max; when it is too
 *        spread for its area: an ellipse of axis ratio r and area A has a trace of its second moments
 *        of (r + 1 / r) A / 4 pi, and a polygon of shape s has s times that; and when its shape or
 *        its ratio is beyond the limit. None of it needs a root, and what is rounded is allowed for.
 *        Most parts are left out before that, by fans: the triangles that a part's first point has with
 *        its steps, in 32 bits with products of 16, many parts side by side. Their sums tell where a
 *        chord is too long or a part too spread, with more than rounding may be left to it, so that
 *        sums of full precision are only formed for a tenth of all parts.
 * Scaling and overflow: the outline lies within 2^h of its middle on each axis, h at most 13. The
 *        edges' cross products must have absolute values that sum up to at most 2^(2h + 5), else (it
 *        is tangled) no part is judged; nor is a part of more area, twice, than the box,
 *        which is 2^(2h + 3). So first moments, six times, are below 2^(3h + 6.2), second ones, twelve
 *        times, below 2^(4h + 7.8). Shifted by 3h - 24, and by twice that, they are below 2^30.2 and
 *        2^29.8 (of small outlines nothing is shifted, and they are smaller). Products of two first
 *        moments, and three times a second one with the area, are below 2^60.4: four of those fit.
 *        What is not judged is a part that may have any shape. Sums of areas are kept modulo 2^32:
 *        twice the area of a part is less. What a curve of length L surrounds w times counts w times;
 *        where it is at least w times round has an area of at most s^2 in a square of side s, and a
 *        border of at least 3.54 times its area over s. Borders add up to L, below 2^18.2, so areas to
 *        at most s L / 3.54, with s below 2^13.6: twice that is below 2^31.
 * Error: a spread is 18 a^2 times a second moment, for twice the area a: 3 a times a sum less twice a
 *        product of first moments. A part that ih_ellipse accepts has its centre within 93 * 256 of
 *        the outline's middle, so what the shift takes from first moments is at most 12 a 93 * 256 >>
 *        shift of a spread, what it takes from second ones 3 a. ih_ellipse rounds second moments by at
 *        most 49 units of Q16: 882 a^2. All three are left to a part beside the limits.
 *        Fans: places in 24ths of a step. A chord of at most half the arc (fans are not judged by when it may be
 *        longer) closes a part of k steps to a border of 36 k at most, which surrounds, twice, at most
 *        206 k^2, with first moments about a point of it, six times, of at most 4,610 k^3 and second ones,
 *        twelve times, of 79,200 k^4: a disc's, and 0.3 more. Within the border nothing is farther from
 *        its first point than 18 k, so that a triangle's cross product is below 2^15. What is summed up
 *        modulo 2^32 for longer chords is not used.
 *        All of it is by the number of steps, not by that of points: of fewer points parts have fewer of
 *        the longer steps, and each step has the same 24 units; whatever is shown for 55 steps holds.
 *        Rounding moves a place by 0.41 of such a unit (one standard deviation), and twice the area by 14
 *        root k; 4 k, a 128th of the limit, and what second moments lack as they are cut off, which is
 *        more the shorter a part is, are together 4.6 standard deviations of the spread or more. It is no
 *        bound that holds for anything: curled outlines, which have small areas for their length, are
 *        not judged by fans. test_ellipse compares with looking at all parts.
 * Cost:  a square root for each vertex; 35 instructions for each 8 (4, 1) of the parts, about 100 for
 *        each one that fans leave.
 */
#ifndef IH_ARCS_H
#define IH_ARCS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "nests/ih_contours.h"

/* Points on a contour: a whole number of vectors; what there is to do grows with its square. */
#define IH_ARCS_POINTS_MAX 56
#define IH_ARCS_POINTS_MIN 16
/* A part has at least this many of the steps: fewer are no ellipse's outline. */
#define IH_ARCS_STEPS_MIN 8
/* All that there are: from each point over each number of steps. */
#define IH_ARCS_MAX (IH_ARCS_POINTS_MAX * (IH_ARCS_POINTS_MAX - IH_ARCS_STEPS_MIN))
/* Lanes of a vector reach beyond the points. */
#define IH_ARCS_FAN (2 * IH_ARCS_POINTS_MAX + 8)
/* Longer contours are not searched for an elliptical part; it bounds the sums. */
#define IH_ARCS_VERTICES_MAX 768
/* A part must have this much area, twice: half a grid cell. */
#define IH_ARCS_AREA2_MIN_Q16 65536

/* No simple polygon has a shape below 1, the ellipse's: less means that the chord crosses the arc.
 * 1 / 256 is left for rounding. */
#define IH_ARCS_SHAPE_MIN_Q16 65280

struct ih_ellipse_params {
    /* On a contour, taken down to a multiple of 8 between IH_ARCS_POINTS_MIN and _MAX. A head found
     * by itself takes 56; where other evidence is weighed with it, 32 find as many. */
    int32_t point_count;
    int32_t shape_max_q16;        /* most that shape may be for an ellipse, at least 1 */
    int32_t ratio_closed_max_q16; /* axis ratio of a closed contour, of a cut part */
    int32_t ratio_part_max_q16;
    int32_t chord_max_q16; /* chord / arc of a cut part */
};

/* Around all vertices. */
struct ih_box {
    int32_t left_q9, right_q9, top_q9, bottom_q9;
};

/* From point `from` over the steps. */
struct ih_arc {
    int32_t merit_max_q8; /* none that ih_ellipse measures is greater */
    uint8_t from, steps;
};

/* [k]: sums over the edges before point k, about the outline's middle. */
struct ih_arcs_sums {
    uint32_t area2_q16[2 * IH_ARCS_POINTS_MAX]; /* twice; modulo 2^32, see above */
    int64_t x_q24[2 * IH_ARCS_POINTS_MAX], y_q24[2 * IH_ARCS_POINTS_MAX];   /* 6 times */
    int64_t trace_q32[2 * IH_ARCS_POINTS_MAX];                              /* 12 times, x and y */
    int64_t xx_q32[2 * IH_ARCS_POINTS_MAX], xy_q32[2 * IH_ARCS_POINTS_MAX]; /* 12 and 24 times */
};

struct ih_arcs {
    bool closed;
    int32_t point_count; /* at equal steps along the contour */
    int32_t count;       /* points in use: a closed contour goes round twice */
    int32_t x_q8[2 * IH_ARCS_POINTS_MAX], y_q8[2 * IH_ARCS_POINTS_MAX]; /* places on the grid */
    int32_t arc_q8[IH_ARCS_POINTS_MAX]; /* length of a part, by steps */
    int32_t part_count;
    struct ih_arc part[IH_ARCS_MAX]; /* by point, then by steps */
    /* scratch: of edges, their lengths; of points, the place from the middle and the square of its
     * distance; of parts of k steps, the square that their chords must be below, and as fans; of
     * points, the place in a fan as a pair of 16 bits, x lower, and (-y, x); bit k of [from], low
     * and high: the part over k steps is worth a closer look */
    int32_t length_q9[IH_ARCS_VERTICES_MAX];
    int32_t dx_q8[2 * IH_ARCS_POINTS_MAX], dy_q8[2 * IH_ARCS_POINTS_MAX];
    int32_t square_q16[2 * IH_ARCS_POINTS_MAX];
    uint32_t low[IH_ARCS_POINTS_MAX], high[IH_ARCS_POINTS_MAX];
    uint32_t fan[IH_ARCS_FAN], turned[IH_ARCS_FAN];
    int32_t chord2_end[IH_ARCS_POINTS_MAX], chord2_end_q16[IH_ARCS_POINTS_MAX];
    struct ih_arcs_sums sums;
};

IH_BEGIN_DECLS

void ih_ellipse_params_default(struct ih_ellipse_params *params);

struct ih_box ih_arcs_box(const struct ih_contours *cuts, const struct ih_contour *contour);

/* Is the place inside the box? Outside nothing winds round it. The box is wider by 2 in Q9, what
 * resampling may round. */
bool ih_box_holds(const struct ih_box *box, struct ih_vertex place);

/* Square of the chord from one point to another. */
static inline int32_t ih_arcs_chord2_q16(const struct ih_arcs *parts, int32_t from, int32_t to)
{
    int32_t dx = parts->x_q8[to] - parts->x_q8[from];
    int32_t dy = parts->y_q8[to] - parts->y_q8[from];
    return dx * dx + dy * dy; /* at most 2 (46 * 256)^2 = 2^28.1 */
}

/* A part's merit: arc - 1.6 chord - 8 (shape - 1) arc. */
int32_t ih_arcs_merit_q8(int32_t arc_q8, int32_t chord_q8, int32_t shape_q16);

/* False when the contour is not searched: too few vertices, or too many. */
bool ih_arcs_make(const struct ih_contours *cuts, const struct ih_contour *contour,
                  const struct ih_ellipse_params *params, struct ih_arcs *out);

IH_END_DECLS

#endif
