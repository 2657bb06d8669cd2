/* ih_scan - where would a mean head fit? Candidates besides the nests (ours).
 *
 * In:     rays and points.
 * Out:    up to IH_SCAN_MAX candidate centres of a head, best first, each more than spacing_mm from all
 *         before it; of equally good ones the one of the lower slot comes first. There is a candidate
 *         wherever something was seen, however bad its score.
 * Method: a mean head is tried behind points that were seen: its centre deep_mm behind the point along
 *         the ray. Score = mean over the rays through it (radius2 < 1) of
 *             1 where the surface is within 32 mm of where the ray enters, -10/64 where it is nearer,
 *             -1 where it is farther, -38/64 where the ray is empty, -10/64 where it is unknown,
 *         + 0.6 times the mean over the rays beside and above it (whose nearest point is 1.3 to 1.9
 *         radii away, and which at the centre's depth are not more down than aside, in mm) of
 *             1 where the surface lies more than 60 mm behind the centre, 45/64 where the ray is empty,
 *             0 where it is unknown, else -38/64.
 *         Either mean: fewer than 8 rays count as 8. Scores (ih_template) only rank candidates: 16 bits
 *         suffice. Of each block of two by two slots the first seen one is scored, then the neighbours
 *         of the best one scored, until the best one has no neighbour left.
 * Overflow: scores are below 2^13, times 512. A centre is a point plus at most deep_mm on an axis;
 *         squares of distances 2^53.6.
 * Error:  a score is float64's but for rays nearer to a limit than 16 bits resolve (ih_template.h),
 *         which may be counted either way: 0.11 on the average if all of them were. Centres within 0.003 mm
 *         for slopes up to 1/2.
 * Cost:   a score for half of the points. 0.24 million instructions for 320 points (x86-64-v3, gcc -O3,
 *         frames of both sequences).
 */
#ifndef IH_SCAN_H
#define IH_SCAN_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_rays.h"
#include "detect/ih_template.h"

/* Candidates kept; each later costs a fit. */
#define IH_SCAN_MAX 8

struct ih_scan_params {
    int32_t deep_mm;       /* from a point to the centre that is tried behind it */
    int32_t spacing_mm;    /* of two candidates */
    int32_t candidate_max; /* up to IH_SCAN_MAX */
};

struct ih_scan_candidate {
    int32_t centre_mm_q8[3];
    int32_t score_q12;
};

struct ih_scan {
    int32_t candidate_count;
    struct ih_scan_candidate candidate[IH_SCAN_MAX];
};

/* Slots without a point; not scored; scored; scored with all neighbours. */
enum ih_scan_state { IH_SCAN_NOTHING, IH_SCAN_LEFT, IH_SCAN_SCORED, IH_SCAN_WIDENED };

struct ih_scan_scratch {
    int32_t centre_mm_q8[IH_SLOTS][3]; /* by slot, of a candidate that is scored */
    uint8_t state[IH_SLOTS];           /* by slot: enum ih_scan_state */
    int32_t rank_count;
    int32_t rank[IH_SLOTS]; /* scored and not too near, in no order: score and slot in one */
    struct ih_template_table table;
};

IH_BEGIN_DECLS

void ih_scan_params_default(struct ih_scan_params *params);

void ih_scan_find(const struct ih_rays *rays, const struct ih_scan_params *params,
                  struct ih_scan_scratch *scratch, struct ih_scan *out);

IH_END_DECLS

#endif
