/* ih_ellipsoid - a head as an upright ellipsoid, and how a dot's ray meets it (ours; the paper names
 * a head model as its next step).
 *
 * In:    centre and semi-axes (across, up, deep: along the camera's X, Y, Z), a ray.
 * Out:   everything in the ellipsoid's own units, in which it is the unit sphere: where the ray
 *        passes the centre's depth (at), its nearest place to the centre (nearest) with the square
 *        of its distance (radius2: below 1 the ray hits), and the depth where it enters.
 * Way:   with e = offset at the centre's depth and g = (slope_x az / ax, slope_y az / ay), the ray is
 *        (e + g tau, tau); tau = -(e.g) / (1 + g.g) is nearest, radius2 = e.e + (e.g) tau, and it
 *        enters at tau - sqrt((1 - radius2) / (1 + g.g)).
 * Overflow: semi-axes IH_ELLIPSOID_SEMI_MIN..MAX, |e| <= IH_ELLIPSOID_REACH or the ray is said to be
 *        far; |g| <= 4 * 5 = 20: sums below 2^(2 * 4.4 + 28 + 1).
 * Error: places within 2^-12 of the exact ones, entry depth within 0.1 mm where radius2 < 0.99.
 * Cost:  one or two divisions, one square root where the ray hits.
 */
#ifndef IH_ELLIPSOID_H
#define IH_ELLIPSOID_H

#include "ih_space.h"

#define IH_ELLIPSOID_SEMI_MIN_MM 40
#define IH_ELLIPSOID_SEMI_MAX_MM 200
/* Rays that pass farther away than this many semi-axes are not looked at. */
#define IH_ELLIPSOID_REACH 8

struct ih_ellipsoid {
    int32_t centre_mm_q8[3];
    int32_t semi_mm_q8[3]; /* across, up, deep */
};

struct ih_crossing {
    int32_t at_q14[2];
    int32_t nearest_q14[3];
    int32_t radius2_q14;
    int32_t entry_mm_q8; /* Z; of a ray that passes: the depth of its nearest place */
};

/* The mean adult head, hair included. */
struct ih_ellipsoid ih_ellipsoid_mean(const int32_t centre_mm_q8[3]);

/* False: far away, *out is not set. */
bool ih_ellipsoid_cross(const struct ih_ellipsoid *ellipsoid, const int32_t origin_mm_q8[3],
                        const struct ih_ray *ray, struct ih_crossing *out);

/* A point in the ellipsoid's units. False when beyond the reach on any axis. */
bool ih_ellipsoid_place(const struct ih_ellipsoid *ellipsoid, const int32_t point_mm_q8[3],
                        int32_t place_q14[3]);

#endif
