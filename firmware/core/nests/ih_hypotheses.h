/* ih_hypotheses - which hypotheses are heads? (paper, section 3.3)
 *
 * In:    nests, and the samples that the surface was fitted to.
 * Out:   candidates in the frame's pixels and in mm, each accepted or with the first test that it
 *        failed; the accepted ones in order, best first.
 * Tests, none of them in absolute depth:
 *        area       of the widest slice, in mm^2
 *        curvature  k = sum(A t) / sum(t^2) over slices at most 70 mm behind the front: the
 *                   growth of the area A with the depth t of the cut, mm^2/mm; and the extent, the
 *                   depth over which the nest keeps growing
 *        shape      a head is about as tall as wide, or taller: a headrest is not
 *        outline    ours, not the paper's: the surface is smooth everywhere, the scene is not. At
 *                   least points_min points carry the head, and around its last ellipse, between
 *                   1.2 and 1.9 times its size, most points above it (2 dy < -|dx|) and beside it
 *                   lie at least jump_mm behind it, or nothing was seen there, and most below it
 *                   (dy > |dx|) do not: there the neck and the body are. Bowls on a table and
 *                   bulges of a body end gently.
 * Nests whose centres are within merge_mm of a better one are the same thing and are dropped.
 * The centre of the head's volume lies centre_behind_mm behind the front, on the ray through the
 * middle of its ellipses: the mean, by area, of those at least 30 mm behind the front; the last one
 * always counts.
 */
#ifndef IH_HYPOTHESES_H
#define IH_HYPOTHESES_H

#include <stdint.h>

#include "base/ih_config.h"
#include "nests/ih_nests.h"
#include "rig/ih_rig.h"
#include "surface/ih_samples.h"
#include "surface/ih_surface.h"

enum ih_reject {
    IH_ACCEPTED = 0,
    IH_REJECT_AREA,
    IH_REJECT_CURVATURE,
    IH_REJECT_SHAPE,
    IH_REJECT_OUTLINE,
    IH_REJECT_SCORE /* by ih_tracks: not probable enough */
};

struct ih_hypotheses_params {
    int32_t area_min_mm2, area_max_mm2;
    int32_t curvature_min_mm, curvature_max_mm; /* mm^2 per mm */
    int32_t extent_min_mm;
    int32_t upright_min_q16; /* height^2 / width^2 over the deeper slices */
    int32_t points_min;
    int32_t jump_mm;
    int32_t above_min_percent, beside_min_percent, below_min_percent;
    int32_t merge_mm;
    int32_t centre_behind_mm;
};

/* What the samples say about a hypothesis; counts of samples. */
struct ih_outline {
    int32_t inside;              /* seen, within the last ellipse */
    int32_t above, above_behind; /* around it: all, and those that lie behind it */
    int32_t beside, beside_behind;
    int32_t below, below_near; /* all, and those that do not */
};

struct ih_hypothesis {
    int32_t u_px_q12, v_px_q12; /* centre of the ellipse in the frame (distorted pixels) */
    int32_t a_px_q12, b_px_q12; /* semi-axes, a >= b */
    int32_t angle_mdeg;         /* of a, from +u towards +v, 0 .. 179999 */
    int32_t distance_mm_q8;     /* camera's centre to the surface at the ellipse's centre */
    int32_t centre_mm_q8[3];    /* of the head's volume, level frame */
    int32_t area_mm2;           /* of the widest slice */
    int32_t curvature_mm_q8;
    int32_t extent_mm_q8;
    int32_t upright_q16;
    struct ih_outline outline;
    int32_t rejected; /* enum ih_reject */
    int32_t nest;     /* index into ih_nests.nest */
};

struct ih_hypotheses {
    int32_t hypothesis_count;
    int32_t head_count;
    int32_t head[IH_NESTS_MAX]; /* indices of the accepted ones, best first */
    struct ih_hypothesis hypothesis[IH_NESTS_MAX];
};

IH_BEGIN_DECLS

void ih_hypotheses_params_default(struct ih_hypotheses_params *params);

void ih_hypotheses_select(const struct ih_nests *nests, const struct ih_surface *surface,
                          const struct ih_samples *samples, const struct ih_rig *rig,
                          const struct ih_hypotheses_params *params, struct ih_hypotheses *out);

/* The word that the record uses: "area", "curvature", "shape", "outline", "score"; NULL for an accepted
 * one. */
const char *ih_reject_text(int32_t reject);

IH_END_DECLS

#endif
