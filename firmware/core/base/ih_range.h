/* ih_range - the ranges that docs/numerics.md states, checked where a quantity is stored.
 *
 * IH_IN_RANGE(value, low, high) is nothing in an ordinary build: its arguments are not evaluated and
 * no code is made. In a build with ISOHEAD_RANGE_CHECKS (make ranges) a value outside low .. high ends
 * the program with file, line, value and range; arguments must have no side effects.
 *
 * That build also checks each cast to an integer type. IH_WRAPS(type, value) is one that may change the
 * value, on purpose. IH_WRAPPING, before a function, says that its unsigned sums pass 2^n on purpose.
 *
 * The constants are the largest values that docs/numerics.md derives, rounded up, in the unit and
 * format of their names; tests/checks/ranges_doc.py compares them with it. They hold for rigs that
 * isohead_init accepts and for parameters as ih_params_default sets them. Where a header has a constant
 * for a range, that one is used.
 */
#ifndef IH_RANGE_H
#define IH_RANGE_H

#include <stdint.h>

#include "base/ih_config.h"

#ifdef ISOHEAD_RANGE_CHECKS
IH_BEGIN_DECLS
void ih_range_check(int64_t value, int64_t low, int64_t high, const char *file, int line);
IH_END_DECLS
#define IH_IN_RANGE(value, low, high) ih_range_check((value), (low), (high), __FILE__, __LINE__)
#define IH_WRAPS(type, value) ((__typeof__(type))(value))
#else
#define IH_IN_RANGE(value, low, high) ((void)sizeof((value) + (low) + (high)))
#define IH_WRAPS(type, value) ((type)(value))
#endif

/* Only clang has a check of what C defines, and the fuzzers' builds use it too. */
#ifdef __clang__
#define IH_WRAPPING __attribute__((no_sanitize("unsigned-integer-overflow")))
#else
#define IH_WRAPPING
#endif

/* Rig. */
#define IH_RANGE_PLACE_PX_Q12 (1 << 27)    /* undistorted */
#define IH_RANGE_INFINITY_PX_Q12 197300000 /* of a line */
#define IH_RANGE_OFFSET_MM_Q16 319500000   /* of a ray from the camera's centre */
#define IH_RANGE_LENGTH_MIN_PX_MM_Q8 25600 /* |e| of a line */
#define IH_RANGE_LENGTH_MAX_PX_MM_Q8 1518500249
#define IH_RANGE_T_PX_Q12 242962089 /* on a line */
#define IH_RANGE_UNIT_Q28 (1 << 26) /* of a field */

/* Dots. */
#define IH_RANGE_GREY_Q4 4144
#define IH_RANGE_RESPONSE 18648
#define IH_RANGE_NOISE 22145

/* Labels. */
#define IH_RANGE_INVERSE_DEPTH_Q36 1031000000
#define IH_RANGE_RECTANGLE_PX_Q12 (1 << 29) /* second difference of four positions */

/* Windows. */
#define IH_RANGE_SCALE_Q16 5368710 /* cells per mm */
#define IH_RANGE_WINDOW_SCORE 1000

/* Points, samples. */
#define IH_RANGE_SAMPLE_DEPTH_MM_Q8 4160000
#define IH_RANGE_ROOT_WEIGHT_Q15 (1 << 15)

/* Surface. */
#define IH_RANGE_BASIS_Q20 88980826
#define IH_RANGE_NORM_Q38 714570000000000000 /* 361 times the basis squared */
#define IH_RANGE_SCALED_Q30 1063100000       /* entry of the scaled equations */
#define IH_RANGE_COEFFICIENT (1 << 28)
#define IH_RANGE_MANTISSA (1 << 25) /* of a solution */
#define IH_RANGE_EXPONENT 62

/* Contours, ellipses, nests. */
#define IH_RANGE_OFFSET_Q8 11776      /* on the grid, from a point on it */
#define IH_RANGE_MOMENT_Q16 144769024 /* second, of an ellipse */
#define IH_RANGE_AREA_Q16 1826600000  /* of an accepted ellipse */
#define IH_RANGE_LEVEL_MM_Q8 8371200  /* of a contour */

/* Hypotheses, detections. */
#define IH_RANGE_PX_PER_STEP_Q12 7630000
#define IH_RANGE_SURFACE_DISTANCE_MM_Q8 47100000
#define IH_RANGE_CENTRE_MM_Q8 (1 << 27) /* of a head */

/* Rays, ellipsoid, scan, fit. */
#define IH_RANGE_POINT_MM_Q8 32768000
#define IH_RANGE_PASS_Q14 185400         /* of a ray's nearest point, from the centre */
#define IH_RANGE_PROMISE_SUM_Q5 12800    /* 100 numbers of 8 bits */
#define IH_RANGE_SLOPE_Q13 29491         /* derivative by ln of what has a weight */
#define IH_RANGE_FIT_NORMAL_Q16 95000000 /* diagonal of the fit's equations */

/* Evidence, score, tracks. */
#define IH_RANGE_ON_MM_Q4 3520       /* from the centre of an ellipsoid to a point on it */
#define IH_RANGE_CENTRAL_Q8 12390400 /* central moments of such points */
#define IH_RANGE_MAP_SUM 2888        /* 361 rays of 2^3 */
#define IH_RANGE_MOVE_SUM 46208      /* 361 rays of 2^7 */
#define IH_RANGE_LOGIT_Q10 (1 << 21)
#define IH_RANGE_CROSS_Q8 384000001 /* of a track's covariance */

#endif
