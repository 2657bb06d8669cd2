/* ih_ellipsoid - a head as an upright ellipsoid, and how a dot's ray meets it (ours; the paper names
 * a head model as its next step).
 *
 * In:     centre and semi-axes (across, up, deep: along the camera's X, Y, Z), a ray.
 * Out:    everything in the ellipsoid's own units, in which it is the unit sphere: the ray's
 *         nearest point to the centre (nearest) with the square of its distance (radius2: below 1 the
 *         ray hits), and the depth where it enters.
 * Method: with e = offset at the centre's depth and g = (slope_x az / ax, slope_y az / ay), the ray is
 *         (e + g tau, tau); tau = -(e.g) / (1 + g.g) is nearest, radius2 = e.e + (e.g) tau, and it
 *         enters at tau - sqrt((1 - radius2) / (1 + g.g)).
 *         The ray is a line without an end: what lies behind its origin is crossed too.
 * Overflow: semi-axes IH_ELLIPSOID_SEMI_MIN..MAX, |e| <= IH_ELLIPSOID_REACH on both axes or the ray
 *         counts as far; |g| <= 4 * 5 = 20 on each axis: sums below 2^(2 * 4.4 + 28 + 1), tau
 *         below 2^2.5. Centres and points: below 2^30 in Q8.
 * Error:  e, g and tau are rounded to Q14, and a steep ray multiplies tau's error by g. Measured
 *         on a head, slopes up to 1: positions within 2^-12.5 of the exact ones, radius2 within
 *         2^-10.6, entry depth within 0.05 mm where radius2 < 0.99 and within 0.25 mm at the rim.
 *         At the limits of slopes and semi-axes: positions 2^-10.8, radius2 2^-8.1, entry 0.1 mm.
 * Cost:   a division, one more and a square root where the ray hits; and three for the inverses.
 */
#ifndef IH_ELLIPSOID_H
#define IH_ELLIPSOID_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_rays.h"

#define IH_ELLIPSOID_SEMI_MIN_MM 40
#define IH_ELLIPSOID_SEMI_MAX_MM 200
/* Rays that pass farther away than this many semi-axes are far. */
#define IH_ELLIPSOID_REACH 8

struct ih_ellipsoid {
    int32_t centre_mm_q8[3];
    int32_t semi_mm_q8[3]; /* across, up, deep */
};

struct ih_crossing {
    int32_t nearest_q14[3];
    int32_t radius2_q14;
    int32_t entry_mm_q8; /* Z; of a ray that passes: the depth of its nearest point */
};

/* Half sides of a box around an ellipsoid's centre, at its depth. */
struct ih_ellipsoid_box {
    int32_t half_mm_q8[2];
};

IH_BEGIN_DECLS

/* The mean adult head, hair included. */
struct ih_ellipsoid ih_ellipsoid_mean(const int32_t centre_mm_q8[3]);

/* The box through which every ray passes that comes nearer than radius, with slopes up to slope_max
 * (of ih_ray_table): radius2 >= e.e / (1 + g.g). It has room for the errors above. */
struct ih_ellipsoid_box ih_ellipsoid_box(const struct ih_ellipsoid *ellipsoid,
                                         const int32_t slope_max_q20[2], int32_t radius2_q14);

/* Inverses of the semi-axes: many divisions by the same one become products. */
struct ih_fractions {
    int64_t inverse_q50[3]; /* 2^50 / semi, rounded up, or 1 more where that is exact */
};

struct ih_fractions ih_ellipsoid_fractions(const int32_t semi_mm_q8[3]);

/* Offsets farther than this are out of reach: IH_ELLIPSOID_REACH times the longest semi-axis is below it. */
#define IH_FRACTION_MAX (1 << 19)

/* ih_div_round(offset * 2^14, semi), to the last bit, for |offset| up to IH_FRACTION_MAX. The product is
 * too great by up to |offset|, 2^-17 of the quotient's last bit, and a quotient that is not on a half
 * is at least 1 / (2 semi), 2^-16.7, away from the next. One that is on a half comes out beyond it, on
 * either side of zero: rounded away from zero, as there. */
static inline int32_t ih_fraction(int64_t inverse_q50, int32_t offset)
{
    return (int32_t)((offset * inverse_q50 + ((int64_t)1 << 35)) >> 36);
}

/* The part of a crossing that depends on the ray's direction and the ellipsoid's size alone. */
struct ih_aim {
    int32_t g_q14[2];
    int64_t gg_q28; /* 1 + g.g */
};

struct ih_aim ih_ellipsoid_aim(const int32_t semi_mm_q8[3], const struct ih_fractions *fractions,
                               const struct ih_ray *ray);

/* fractions and aim: of this size. False when far away, *out is not set. */
bool ih_ellipsoid_cross(const struct ih_ellipsoid *ellipsoid, const struct ih_fractions *fractions,
                        const int32_t origin_mm_q8[3], const struct ih_ray *ray,
                        const struct ih_aim *aim, struct ih_crossing *out);

/* A point in the ellipsoid's units. False when beyond the reach on any axis. */
bool ih_ellipsoid_position(const struct ih_ellipsoid *ellipsoid,
                           const struct ih_fractions *fractions, const int32_t point_mm_q8[3],
                           int32_t position_q14[3]);

/* Distance from the surface of a point in the ellipsoid's units, to first order; negative inside.
 * False at the centre, where there is none. */
bool ih_ellipsoid_distance(const struct ih_fractions *fractions, const int32_t position_q14[3],
                           int32_t *distance_mm_q8);

IH_END_DECLS

#endif
