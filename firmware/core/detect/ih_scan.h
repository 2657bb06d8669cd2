/* ih_scan - where a fit is worth its while: candidates besides the nests (ours).
 *
 * In:     rays and points.
 * Out:    up to IH_SCAN_MAX candidate centres of a head, the most promising first, each more than spacing_mm from all
 *         before it; of equally good ones the one of the lower slot comes first.
 * Method: a centre is tried behind the first seen point of each block of two by two slots: deep_mm behind the
 *         point along the ray. What promises less than promise_min_q5 by the learnt map of ih_surroundings is dropped. A fit
 *         ends at the head from 100 mm and more away, so that a finer search finds no more.
 * Overflow: a centre is a point plus at most deep_mm on an axis; squares of distances 2^53.6. Promises are below 2^14, times
 *         512.
 * Error:  centres within 0.003 mm for slopes up to 1/2.
 * Cost:   a promise for a quarter of the points: 0.42 million instructions for 320 points (x86-64, gcc -O2, frames of both
 *         sequences).
 */
#ifndef IH_SCAN_H
#define IH_SCAN_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_rays.h"

/* Candidates kept; each later costs a fit. */
#define IH_SCAN_MAX 6

/* Blocks of two by two slots. */
#define IH_SCAN_TRIED_MAX (((IH_GRID + 1) / 2) * ((IH_GRID + 1) / 2))

struct ih_scan_params {
    int32_t deep_mm;        /* from a point to the centre that is tried behind it */
    int32_t promise_min_q5; /* log-odds */
    int32_t spacing_mm;     /* of two candidates */
    int32_t candidate_max;  /* up to IH_SCAN_MAX */
};

struct ih_scan_candidate {
    int32_t centre_mm_q8[3];
    int32_t promise_q5;
};

struct ih_scan {
    int32_t candidate_count;
    struct ih_scan_candidate candidate[IH_SCAN_MAX];
};

struct ih_scan_scratch {
    int32_t centre_mm_q8[IH_SLOTS][3]; /* by slot, of a centre that was tried */
    int32_t rank_count;
    /* Promising enough and not near a kept one, in no order: promise and slot in one. */
    int32_t rank[IH_SCAN_TRIED_MAX];
};

IH_BEGIN_DECLS

void ih_scan_params_default(struct ih_scan_params *params);

void ih_scan_find(const struct ih_rays *rays, const struct ih_scan_params *params,
                  struct ih_scan_scratch *scratch, struct ih_scan *out);

IH_END_DECLS

#endif
