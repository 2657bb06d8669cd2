/* golden_inner - hashes of intermediate results that isohead_frame does not keep.
 *
 * In:    the state after a frame, and the frame.
 * Out:   one number each for the map of noise and the next exposure (dots only), the contours of all
 *        levels, the ellipses of all closed contours, the rays, the candidates of the scan, the ellipsoids
 *        fitted there and at the nests, what speaks for them, their scores, and the surface and the
 *        answer of the paper's method alone.
 * Method: each stage is run once more on the outputs that the state keeps, in the state's own working
 *        memory. Of a depth image these are those of its best window. The paper's method has other
 *        parameters from the surface on: its stages are run last, in place of the outputs.
 */
#ifndef GOLDEN_INNER_H
#define GOLDEN_INNER_H

#include "isohead.h"
#include "upkeep/ih_exposure.h"

enum golden_inner {
    GOLDEN_NOISE, /* of dots only, as the next */
    GOLDEN_EXPOSURE,
    GOLDEN_CONTOURS,
    GOLDEN_ELLIPSES,
    GOLDEN_RAYS,
    GOLDEN_SCAN,
    GOLDEN_FIT,
    GOLDEN_EVIDENCE,
    GOLDEN_SCORE,
    GOLDEN_PAPER,
    GOLDEN_INNERS
};

extern const char *const golden_inner_name[GOLDEN_INNERS];

/* exposure: goes on from frame to frame; golden_inner_start before a rig's first. Of head the
 * scratch is written to, and last the surface, the hypotheses and the heads. */
void golden_inner_start(struct ih_exposure *exposure);
void golden_inner_hash(struct isohead *head, const struct ih_frame *frame,
                       const struct ih_frame *ambient, struct ih_exposure *exposure,
                       uint64_t hash[GOLDEN_INNERS]);

#endif
