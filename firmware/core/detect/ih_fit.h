/* ih_fit - a head model fitted to the points of one candidate (ours; the paper's direct fit failed
 * because it did not know where to start).
 *
 * In:     rays and points, a start: its semi-axes within a factor e^0.35 of the mean head's, as any
 *         result has.
 * Out:    an upright ellipsoid: centre and semi-axes.
 * Method: IH_FIT_STEPS Gauss-Newton steps on centre and logarithms of the semi-axes. With a point's
 *         position s in the ellipsoid's units and f = |s|, its residual is its distance to first
 *         order, r = (f - 1) / |grad f| = (f - 1) f / |s/a|. Its derivatives are those of f over
 *         |grad f|: -(s/a) / |s/a| by the centre, -s_i^2 / |s/a| by ln a_i. Robust weights
 *         (ih_fit_weights.h), k = 24, 16 and then 8 mm. Points within 0.05 of the centre have no
 *         direction, points outside of IH_ELLIPSOID_REACH no weight.
 *         A ray that hits the ellipsoid although its point lies more than see_through_mm behind the
 *         entry pushes it aside: the same residual at the ray's nearest point, not beyond -30 mm,
 *         weight 0.5, not robust. A point may be used both ways, as one on the ellipsoid's back is.
 *         Rays without a point add nothing here: hair is often dark. Priors: ln axes 0.09 around the
 *         mean head, centre 60 mm around the start on each axis, both against 6 mm for a point.
 *         ih_fit_equations sums a step's points. A step moves the centre at most 40 mm and
 *         a logarithm 0.15 on each axis; the logarithms stay within 0.35 of the mean's.
 * Units:  unknowns are mm and hundredths of ln, so that all derivatives are of order one.
 * Overflow: derivatives of points with a weight are below 3.6; rows as in ih_fit_equations.h. A point
 *         adds at most 2.6 to an entry of the diagonal, its push 1.3: 361 of both
 *         1408, and scaled by 2^-11 to 0.69 in Q30. The right side's root mean square of weighted
 *         residuals is below 470 mm, in the solver's units 2^23.4.
 * Error:  against the float64 reference, starts some 35 mm off a head in made scenes (330 fits):
 *         worst 0.02 mm, median 0.005; with a fifth of dots wrong 0.05. Before a bare wall, where
 *         little but the prior holds it, 0.25 mm in 19 of 20 (30 fits), worst 1.1. From starts some
 *         100 mm off a fit may run away and end 12 mm elsewhere: a point more or less decides there.
 *         Against the truth in these scenes, starts 35 mm off: at most 5 mm for a mean head, 10 for
 *         one a tenth larger in every direction. A fifth of all dots anywhere between 0.5 and 2.5 m:
 *         17 mm (median of 30 fits; worst 56), because wrong dots behind the head push.
 * Cost:   steps x (ih_fit_equations, one Cholesky of 6). 0.12 million instructions a fit of six steps with 320
 *         points (x86-64-v3, gcc -O3, frames of both sequences).
 */
#ifndef IH_FIT_H
#define IH_FIT_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_fit_equations.h"
#include "detect/ih_rays.h"

#define IH_FIT_STEPS 6

struct ih_fit_params {
    int32_t see_through_mm; /* a point this far behind the entry is seen through the ellipsoid */
    int32_t step_count;     /* up to IH_FIT_STEPS; 0: the start as it is */
};

IH_BEGIN_DECLS

void ih_fit_params_default(struct ih_fit_params *params);

/* A fit in progress: it is valid after any step, and may end there. */
struct ih_fit {
    struct ih_ellipsoid ellipsoid;
    int32_t ln_q16[3]; /* the axes are the mean head's times exp(ln), hundredths */
    int32_t start_mm_q8[3];
    int32_t step_index; /* of the next step */
};

void ih_fit_begin(const struct ih_ellipsoid *start, struct ih_fit *out);

/* Continue until so many steps are done, or params->step_count. */
void ih_fit_continue(const struct ih_rays *rays, const struct ih_fit_params *params,
                     int32_t step_count, struct ih_fit_scratch *scratch, struct ih_fit *fit);

IH_END_DECLS

#endif
