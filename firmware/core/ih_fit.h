/* ih_fit - a head model fitted to the points of one candidate (ours; the paper's direct fit failed
 * because it did not know where to look).
 *
 * In:    rays and points, a start.
 * Out:   an upright ellipsoid: centre and semi-axes.
 * Way:   IH_FIT_STEPS Gauss-Newton steps on centre and logarithms of the semi-axes. With a point's
 *        place s in the ellipsoid's units and f = |s|, its residual is its distance to first order,
 *        r = (f - 1) / |grad f|. Robust weight (1 + (r / k)^2)^-2, k from 24 mm down to 8; points
 *        low on the head (s_y from 0.5 to 0.8) count half in the end: there the neck begins. A ray
 *        that hits the ellipsoid although its point lies see_through_mm behind pushes it aside:
 *        the same residual at the ray's nearest place, not beyond -30 mm, weight 0.5. Rays without
 *        a point say nothing here: hair is often dark. Priors: ln axes 0.09 around the mean head,
 *        centre 60 mm around the start, both against 6 mm for a point.
 *        A step moves at most 40 mm and 15 % on each axis; axes stay within 35 % of the mean.
 * Units: unknowns are mm and hundredths of ln, so that all derivatives are of order one.
 * Overflow: derivatives within 2^15.5 in Q14, weights 2^16: a product below 2^33.5 after its shift,
 *        361 x 2 of them below 2^43. The system, scaled by 2^-11 to a diagonal below 1, is Q30.
 * Error: within 0.5 mm of the float64 reference where the fit is well posed.
 * Cost:  steps x (361 crossings + points in reach x 27 multiply-adds), one Cholesky of 6 a step.
 */
#ifndef IH_FIT_H
#define IH_FIT_H

#include "ih_cholesky.h"
#include "ih_ellipsoid.h"

#define IH_FIT_STEPS 6
#define IH_FIT_UNKNOWNS 6

struct ih_fit_params {
    int32_t see_through_mm;
};

void ih_fit_params_default(struct ih_fit_params *params);

void ih_fit_ellipsoid(const struct ih_space *space, const struct ih_fit_params *params,
                      const struct ih_ellipsoid *start, struct ih_ellipsoid *out);

/* A place in the ellipsoid's units to its distance from the surface, to first order; negative
 * inside. False at the centre, where there is none. */
bool ih_fit_distance(const struct ih_ellipsoid *ellipsoid, const int32_t place_q14[3],
                     int32_t *distance_mm_q8);

#endif
