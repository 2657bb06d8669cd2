/* ih_scan - where would a mean head fit? Candidates besides the nests (ours).
 *
 * In:    rays and points.
 * Out:   up to IH_SCAN_MAX places of a head's centre, best first, spacing_mm apart.
 * Way:   a mean head is tried behind every point that was seen: its centre deep_mm behind the point
 *        along the ray. Score = mean over the rays through it of
 *            1 where the surface is within 28 mm of the ellipsoid, -0.15 where it is nearer,
 *            -min(behind / 60 mm, 1) where it is farther, -0.6 where the ray is empty, -0.15 where
 *            it is unknown,
 *        + 0.6 times the mean over the rays beside and above it (1.3 to 1.9 radii) of
 *            1 where the surface lies 60 mm behind the centre or more, 0.7 where the ray is empty,
 *            0 where it is unknown, else -0.6.
 *        Fewer than 8 rays count as 8.
 * Overflow: means of values within +-1 in Q12.
 * Cost:  points x 361 crossings; those out of reach end after a division.
 */
#ifndef IH_SCAN_H
#define IH_SCAN_H

#include "ih_ellipsoid.h"

/* Places kept; each later costs a fit. */
#define IH_SCAN_MAX 8

struct ih_scan_params {
    int32_t deep_mm;
    int32_t spacing_mm;
    int32_t place_max; /* up to IH_SCAN_MAX */
};

struct ih_scan_place {
    int32_t centre_mm_q8[3];
    int32_t score_q12;
};

struct ih_scan {
    int32_t place_count;
    struct ih_scan_place place[IH_SCAN_MAX];
};

struct ih_scan_scratch {
    struct ih_scan_place tried[IH_SLOTS];
};

void ih_scan_params_default(struct ih_scan_params *params);

void ih_scan_find(const struct ih_space *space, const struct ih_scan_params *params,
                  struct ih_scan_scratch *scratch, struct ih_scan *out);

#endif
