/* ih_evidence - measures of a fitted head's surface, which the score weighs (ours; the paper's limits on size and curvature
 * are among them).
 *
 * In:     rays and points, the ellipsoid, fitted and moved, where the fit began.
 * Out:    IH_EVIDENCE_COUNT numbers, each with its meaning and unit below, all in Q8.
 * Method: the surface: "on" are points of rays through the ellipsoid (radius2 below 0.9): without its edge,
 *         where depths are uncertain. What is around it is left to the learnt maps of ih_surroundings.
 *         A point's height is how far it lies outside of the ellipsoid, (radius^2 - 1) / 2 times the semi-axis of depth. A
 *         bend is |h1 - 2 h2 + h3|, 20 mm at most, of three neighbours in the pattern that all lie before the centre and
 *         within 1.4 semi-axes of it; their mean is with one more of 12 mm, so that few change little. A face and hair
 *         bend more than a limb, a bag or a ball, above all from brow to chin.
 *         Rays of unknown state count nowhere.
 * Overflow: points are below 2^25 in Q8, centres below 2^27: squares of differences 2^57.6. Moments are of points on
 *         the ellipsoid, 220 mm at most from its centre: products 2^23.6 in Q8, 361 of them 2^32.1, squared sums 2^40.6;
 *         central ones 2^23.6, their determinants 2^48.2, times 2^12 2^60.2. Heights are within half of the longest
 *         semi-axis, 16 bits.
 * Error:  counts are exact but where a ray passes within 2^-10 of a limit; rough within 0.03 mm, bulge
 *         within 0.06 mm.
 * Cost:   two products for each ray, a crossing for those that may hit the ellipsoid (90 of a head at 0.7 m), a position
 *         for each point before it (150): 63,000 instructions (x86-64, -O3).
 */
#ifndef IH_EVIDENCE_H
#define IH_EVIDENCE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_rays.h"

enum ih_evidence_kind {
    IH_EVIDENCE_ON,          /* points within 20 mm of the ellipsoid: count */
    IH_EVIDENCE_ROUGH,       /* their root mean square distance: mm */
    IH_EVIDENCE_BULGE,       /* that of their best plane, minus ROUGH: mm; a board has none */
    IH_EVIDENCE_TALL,        /* semi-axis up, above the mean head's: % */
    IH_EVIDENCE_MOVED,       /* from the start of the fit, with the move by its surroundings: mm */
    IH_EVIDENCE_BEND_DOWN,   /* how uneven the surface is from dot to dot, downwards: mm */
    IH_EVIDENCE_BEND_ACROSS, /* and across */
    IH_EVIDENCE_DISTANCE, /* depth of the centre: mm; near and far heads show themselves otherwise */
    IH_EVIDENCE_COUNT
};

/* For following a head over time: counts of the rays through it, by what they met: something behind it or nothing,
 * its surface, something before it. */
struct ih_view {
    int32_t through, hit, front;
};

struct ih_evidence {
    int32_t value_q8[IH_EVIDENCE_COUNT];
    struct ih_view view;
};

IH_BEGIN_DECLS

void ih_evidence_collect(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                         const int32_t start_mm_q8[3], struct ih_evidence *out);

/* The view alone, for half of the cost. */
struct ih_view ih_evidence_view(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid);

IH_END_DECLS

#endif
