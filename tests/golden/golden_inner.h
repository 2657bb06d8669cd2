/* golden_inner - hashes of what isohead_frame works out on its way and does not keep.
 *
 * In:    the state after a frame, and the frame.
 * Out:   one number each for the map of noise and the next exposure (dots only), the contours of all
 *        levels, the ellipses of all closed contours, the rays, the places of the scan, the ellipsoids
 *        fitted there and at the nests, what speaks for them, their scores, and the answer of the
 *        paper's method alone.
 * Way:   each stage is run once more on the outputs that the state keeps, in the state's own working
 *        memory. Of a depth image these are those of its best window.
 */
#ifndef GOLDEN_INNER_H
#define GOLDEN_INNER_H

#include "ih_exposure.h"
#include "isohead.h"

struct golden_inner_view {
    struct isohead *head; /* only its scratch is written to */
    const struct ih_frame *frame, *ambient;
    struct ih_exposure *exposure; /* goes on from frame to frame */
};

struct golden_inner {
    const char *name;
    bool dots_only; /* not of a depth camera */
    uint64_t (*hash)(const struct golden_inner_view *view);
};

#define GOLDEN_INNERS 10

/* In the order of a frame's way. */
extern const struct golden_inner golden_inner[GOLDEN_INNERS];

/* Before the first frame of a rig. */
void golden_inner_start(struct ih_exposure *exposure);

#endif
