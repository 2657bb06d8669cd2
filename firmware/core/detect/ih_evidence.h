/* ih_evidence - measurements of a fitted head's surface and surroundings, which the score weighs (ours; the
 * paper's limits on size, curvature and extent are among them).
 *
 * In:     rays and points, the fitted ellipsoid, how far the fit moved, the nest at the same position.
 * Out:    IH_EVIDENCE_COUNT numbers, each with its meaning and unit below, all in Q8.
 * Method: offsets are taken where a ray passes the centre's depth, in semi-axes (e) or mm; a point's
 *         depth against the centre's (dz). The ring around the head (1.25 to 1.9 semi-axes) counts every
 *         ray of known state: "open" when its point lies more than 60 mm behind the centre or it is
 *         empty, "closed" otherwise. Open fractions are (open + 0.5) / (all + 1), so that few
 *         rays change little; other fractions are of 1 to 3 rays at least. "Body" is dz -220 .. 200 mm.
 *         Rays of unknown state count nowhere. "On" are points of rays through the ellipsoid
 *         (radius2 below 0.9): without its edge, where depths are uncertain. Regions: ih_head_model.h.
 *         A point's height is how far it lies outside of the ellipsoid, (radius^2 - 1) / 2 times the semi-axis of depth. A
 *         bend is |h1 - 2 h2 + h3|, 20 mm at most, of three neighbours in the pattern that all lie before the centre and
 *         within 1.4 semi-axes of it; their mean is with one more of 12 mm, so that few change little. A face and hair
 *         bend more than a limb, a bag or a ball, above all from brow to chin.
 * Overflow: points and centres below 2^26 in Q8. Moments are of points on the ellipsoid, 220 mm at
 *         most from its centre: products 2^23.6 in Q8, 361 of them 2^32.1, squared sums 2^40.6;
 *         central ones 2^23.6, their determinants 2^48.2, times 2^12 2^60.2. Heights are within half of the longest
 *         semi-axis, 16 bits.
 * Error:  counts are exact but where a ray passes within 2^-10 of a limit; rough within 0.03 mm, bulge
 *         within 0.06 mm.
 * Cost:   vectors count the rays (ih_ray_counts) but for some 15 of 361; a crossing for some 33
 *         that may hit the ellipsoid: 33,000 instructions (x86-64-v3). The bends pass over all points:
 *         13,000 (x86-64, -O2). Without vectors two products for each ray.
 */
#ifndef IH_EVIDENCE_H
#define IH_EVIDENCE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_rays.h"

enum ih_evidence_kind {
    IH_EVIDENCE_ON,          /* points within 20 mm of the ellipsoid: count */
    IH_EVIDENCE_ROUGH,       /* their root mean square distance: mm */
    IH_EVIDENCE_BULGE,       /* that of their best plane, minus ROUGH: mm; a board has none */
    IH_EVIDENCE_TALL,        /* semi-axis up, above the mean head's: % */
    IH_EVIDENCE_MOVED,       /* from the start of the fit: mm */
    IH_EVIDENCE_ABOVE,       /* open above: fraction */
    IH_EVIDENCE_BESIDE,      /* open on the side that is less open: fraction */
    IH_EVIDENCE_BELOW,       /* open below, where the neck is: fraction */
    IH_EVIDENCE_HIGH,        /* open farther above (beyond 1.9 semi-axes): fraction */
    IH_EVIDENCE_NOTHING,     /* empty rays around and above: fraction of all there */
    IH_EVIDENCE_BODY,        /* body 40 to 260 mm below the chin: fraction of the rays there */
    IH_EVIDENCE_BODY_RAYS,   /* those rays: count, at most 30 */
    IH_EVIDENCE_BODY_DEPTH,  /* mean dz of the body below: mm */
    IH_EVIDENCE_WIDE,        /* body there, but 300 mm aside or more, as a table has: fraction */
    IH_EVIDENCE_LEVEL,       /* things 170 to 330 mm aside at the head's height: fraction */
    IH_EVIDENCE_SHOULDER,    /* body at the shoulder with less of it: fraction */
    IH_EVIDENCE_BEFORE,      /* points around, 60 mm and more before the front, as hands: count */
    IH_EVIDENCE_EXTENT,      /* of the nest at this position: mm, 0 without one */
    IH_EVIDENCE_UPRIGHT,     /* of that nest: height^2 / width^2, 1 without one */
    IH_EVIDENCE_BEND_DOWN,   /* how uneven the surface is from dot to dot, downwards: mm */
    IH_EVIDENCE_BEND_ACROSS, /* and across */
    IH_EVIDENCE_SURROUNDINGS, /* what all rays there say by the learnt map (ih_surroundings): log-odds */
    IH_EVIDENCE_DISTANCE, /* depth of the centre: mm; near and far heads show themselves otherwise */
    IH_EVIDENCE_COUNT
};

/* The nest at the candidate's position. */
struct ih_evidence_nest {
    bool present;
    int32_t extent_mm_q8;
    int32_t upright_q16;
};

struct ih_evidence {
    int32_t value_q8[IH_EVIDENCE_COUNT];
    /* For following a head over time: of the rays through it, those that went through it, that saw
     * its surface, that were stopped before it. */
    int32_t through_count, hit_count, front_count;
};

IH_BEGIN_DECLS

void ih_evidence_collect(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                         const int32_t start_mm_q8[3], const struct ih_evidence_nest *nest,
                         struct ih_evidence *out);

/* Name of a kind, for tables and traces. */
const char *ih_evidence_text(enum ih_evidence_kind kind);

IH_END_DECLS

#endif
