/* ih_kalman - a constant-velocity Kalman filter for the centre of a head.
 *
 * In:    the time since the last step; a measured ellipsoid and its variance.
 * Out:   position and velocity, their covariance. The three axes share one covariance.
 *        The semi-axes are smoothed too, by a fixed gain.
 * Overflow: steps up to 2 s are 2^21 in Q20, accelerations stay below 2^13 mm/s^2: a step adds at
 *        most 2^30 mm^2 to a variance, 2^38 in Q8, times 2^21 2^59. Then standard deviations are
 *        limited to 500 mm and 3 m/s: 2^26 and 2^31.2 in Q8. The cross term, at most 2^36.3, is
 *        reduced by the same factor, 2^24, so that the covariance stays positive. Predicted
 *        positions are limited to 2^26 in Q8, measured ones to 2^27, speeds to 3 m/s.
 * Error: against a float64 filter, position 0.05 mm, speed 0.65 mm/s; variances 0.03 %, and 2 % in
 *        the ten frames after a step of 0.3 s or more, as a gain has 16 bits.
 * Cost:  a prediction four divisions and 20 multiplications, a correction two and 20.
 */
#ifndef IH_KALMAN_H
#define IH_KALMAN_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"

struct ih_kalman {
    struct ih_ellipsoid head;
    int32_t velocity_mm_s_q8[3];
    /* Covariance along each axis: mm^2, mm^2/s, mm^2/s^2. */
    int64_t position_q8, cross_q8, velocity_q8;
};

IH_BEGIN_DECLS

/* At rest where it was measured. */
void ih_kalman_start(const struct ih_ellipsoid *measured, int32_t measured_mm,
                     struct ih_kalman *filter);

/* Go on by step_us, below 2^21; acceleration_mm_s2 is a standard deviation. */
void ih_kalman_predict(struct ih_kalman *filter, int64_t step_us, int32_t acceleration_mm_s2);

/* variance_q8 is that of the measured centre along each axis, mm^2. */
void ih_kalman_correct(struct ih_kalman *filter, const struct ih_ellipsoid *measured,
                       int64_t variance_q8);

/* Reduce the velocity of a head that is not measured; it is 0 after IH_KALMAN_SLOW_US. A new track's may be that of a
 * hand before the head: it must not lead away from the head behind. */
#define IH_KALMAN_SLOW_US 100000
void ih_kalman_slow_down(struct ih_kalman *filter, int64_t unseen_us);

/* Standard deviation of the centre along each axis. */
int32_t ih_kalman_sigma_mm_q8(const struct ih_kalman *filter);

IH_END_DECLS

#endif
