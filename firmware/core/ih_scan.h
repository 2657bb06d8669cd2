/* ih_scan - where would a mean head fit? Candidates besides the nests (ours).
 *
 * In:    rays and points.
 * Out:   up to IH_SCAN_MAX places of a head's centre, best first, each more than spacing_mm from all
 *        before it; of equally good ones the one of the lower slot comes first. A place is there
 *        wherever something was seen, however bad its score.
 * Way:   a mean head is tried behind every point that was seen: its centre deep_mm behind the point
 *        along the ray. Score = mean over the rays through it (radius2 < 1) of
 *            1 where the surface is within 28 mm of where the ray enters, -0.15 where it is nearer,
 *            -min(behind / 60 mm, 1) where it is farther, -0.6 where the ray is empty, -0.15 where
 *            it is unknown,
 *        + 0.6 times the mean over the rays beside and above it (whose nearest place is 1.3 to 1.9
 *        radii away, and not more down than aside, in mm) of
 *            1 where the surface lies more than 60 mm behind the centre, 0.7 where the ray is empty,
 *            0 where it is unknown, else -0.6.
 *        Either mean: fewer than 8 rays count as 8. Of each block of two by two slots the first place
 *        is looked at, then those around whatever is rated: what seems best of those that were looked
 *        at, until it is. No place is rated whose bound says that it will not be kept.
 * Overflow: sums of 361 values within +-1 in Q12, times 60: 2^26.4. A centre is a point plus at
 *        most deep_mm on an axis; squares of distances 2^53.6.
 * Error: a score within 0.0005 of the float64 reference, but that a ray as good as on a limit may
 *        be counted either way (9250 scores, one in ten has such a ray); centres within 0.003 mm
 *        for slopes up to 1/2.
 * Cost:  a bound (ih_bound) for half of the points, and for what seems best the score: of some 21 places
 *        the rays that 16 bits can tell are counted, seven each are crossed with the head. 0.6 million
 *        instructions for 320 points (x86-64-v3, gcc -O3, frames of both sequences).
 */
#ifndef IH_SCAN_H
#define IH_SCAN_H

#include "ih_bound.h"

/* Places kept; each later costs a fit. */
#define IH_SCAN_MAX 8

struct ih_scan_params {
    int32_t deep_mm;    /* from a point to the centre that is tried behind it */
    int32_t spacing_mm; /* of two places */
    int32_t place_max;  /* up to IH_SCAN_MAX */
};

struct ih_scan_place {
    int32_t centre_mm_q8[3];
    int32_t score_q12;
};

struct ih_scan {
    int32_t place_count;
    struct ih_scan_place place[IH_SCAN_MAX];
};

enum ih_scan_state { IH_SCAN_LEFT, IH_SCAN_BOUND, IH_SCAN_RATED, IH_SCAN_TAKEN };

struct ih_scan_scratch {
    struct ih_scan_place tried[IH_SLOTS]; /* with its score, or with the bound of it */
    uint8_t state[IH_SLOTS];              /* enum ih_scan_state */
    int16_t slot[IH_SLOTS];               /* of a place */
    int16_t index[IH_SLOTS];              /* of a slot's place, or IH_NONE */
    struct ih_bound_rays rays;
    struct ih_bound_verdict verdict;
    int32_t rank[IH_SLOTS]; /* of what is left, by its score */
};

void ih_scan_params_default(struct ih_scan_params *params);

void ih_scan_find(const struct ih_space *space, const struct ih_scan_params *params,
                  struct ih_scan_scratch *scratch, struct ih_scan *out);

/* The score of a place, after ih_scan_find of this space with this scratch. */
int32_t ih_scan_score_q12(const struct ih_space *space, struct ih_scan_scratch *scratch,
                          const int32_t centre_mm_q8[3]);

#endif
