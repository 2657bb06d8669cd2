/* ih_arc_fans - which arcs of a contour are short of chord and compact, in 32 bits.
 *
 * In:     an outline (ih_arcs), and the limits of an ellipse's chord and spread.
 * Out:    bit k of low and high [from]: the arc from that point over k steps may be an ellipse.
 * Method: the fan of an arc is the triangles of its first point with each of its steps. Summed with products
 *         of 16 bits, several arcs side by side, they show where a chord is too long or an arc too spread,
 *         with a margin larger than the rounding. A tenth of all arcs remains for sums of full precision.
 * Scaling and overflow: coordinates in 24ths of a step. A chord of at most half the arc (fans do not judge
 *         when it may be longer) closes an arc of k steps to a border of at most 36 k. It surrounds, twice, at
 *         most 206 k^2, with first moments about a point of it, six times, of at most 4,610 k^3 and second
 *         ones, twelve times, of 79,200 k^4: a disc's, and 0.3 more. Within the border no point is farther
 *         from the first one than 18 k, so a triangle's cross product is below 2^15. Sums of arcs with longer
 *         chords wrap and are not used. This goes by the number of steps, not of points: fewer points make
 *         longer steps of the same 24 units, so what holds for 55 steps always holds.
 * Error:  rounding moves a coordinate by 0.41 units (one standard deviation) and twice the area by
 *         14 sqrt(k). The margins (4 k, a 128th of the limit, and the bits that second moments lose, which
 *         weigh more the shorter an arc is) add up to at least 4.6 standard deviations of the spread. This
 *         is no bound for every outline: curled ones, with little area for their length, are not judged.
 *         test_ellipse compares with the search of all arcs.
 * Cost:   35 instructions for each 8 (AVX2) or 4 (SSE2, NEON) arcs, or for each one without vectors.
 */
#ifndef IH_ARC_FANS_H
#define IH_ARC_FANS_H

#include <stdbool.h>
#include <stdint.h>

#include "nests/ih_arcs.h"

/* What an ellipse's arc keeps to, and what decides whether fans can judge the outline. */
struct ih_arc_fans_limits {
    int32_t chord_max_q16; /* chord / arc length */
    int64_t spread_q16;    /* trace of the second moments over the area's cube */
    int32_t half_q8;       /* half of the outline's longer side */
    int32_t vertex_count;  /* of the contour */
};

/* Fills low and high. False: fans cannot judge this outline, and nothing is set. */
bool ih_arc_fans_find(const struct ih_arc_fans_limits *limits, struct ih_arcs *arcs);

#endif
