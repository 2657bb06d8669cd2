/* ih_rig - the calibrated camera and projector in fixed point, checked once (paper, section 2.1).
 *
 * In:    struct ih_calibration, the numbers of rig.json rounded to fixed point and nothing else.
 * Out:   struct ih_rig: the same, plus everything that is the same for every frame: for each dot
 *        its epipolar line, for the surface the field of view in units of half a dot pitch.
 * Error: each check has its own code; index says which dot. A rig that passes is safe for all
 *        stages: no later stage divides by zero or overflows because of it.
 * Cost:  once per rig. 361 lines, and 65 x 65 probes of the lens, rarely twice. ih_rig_undistort: nearly always one of
 *        Newton's steps from a series, without a division: of a lens for which that is enough at all probes.
 *
 * The camera frame is OpenCV's: X right, Y down, Z forward, mm. Normalised coordinates are
 * x = X / Z and y = Y / Z after removal of the lens distortion; "undistorted pixels" are
 * (fx x + cx, fy y + cy).
 *
 * Why a line is so simple: dot i is the ray O + s r from the projector. At depth Z it appears at
 * X/Z = rx/rz + (Ox - Oz rx/rz) / Z, so in undistorted pixels it is at infinity + e / Z exactly:
 * its place on the line is linear in 1/Z and depth is one division.
 */
#ifndef IH_RIG_H
#define IH_RIG_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"

enum ih_rig_kind { IH_RIG_DOTS = 0, IH_RIG_RANGE = 1 };

/* Bounds on a calibration; all are far outside what a real rig has. */
#define IH_RIG_FOCAL_MAX_PX 8192
#define IH_RIG_BASELINE_MAX_MM 1000
/* |x| and |y| of a normalised coordinate anywhere in the frame: a field of view of 127 degrees. */
#define IH_RIG_TAN_MAX 2

struct ih_calibration {
    enum ih_rig_kind kind;
    int32_t width, height; /* px */
    int32_t fx_px_q16, fy_px_q16, cx_px_q16, cy_px_q16;
    int32_t k1_q24, k2_q24, p1_q24, p2_q24, k3_q24; /* OpenCV's order, |k| < 128 */
    int32_t near_mm, far_mm;
    /* The rest is unused for a range rig. */
    int32_t origin_mm_q16[3];
    int32_t ray_q30[IH_SLOTS][3];
};

/* One dot's epipolar line. A place on it is t, px from the dot's place at infinity along dir. */
struct ih_line {
    int32_t infinity_u_px_q12, infinity_v_px_q12; /* undistorted pixels */
    int32_t dir_u_q30, dir_v_q30;                 /* unit vector towards nearer depth */
    int32_t length_px_mm_q8;                      /* |e|: t = |e| / Z */
    int32_t t_far_px_q12, t_near_px_q12;          /* the working range, t_far <= t_near */
    int32_t slope_x_q20, slope_y_q20;             /* of the dot's ray in space, by z */
};

/* The part of the image plane on which the surface stands, in normalised coordinates. */
struct ih_field {
    int32_t centre_x_q28, centre_y_q28;
    int32_t unit_q28; /* one field unit = half a dot pitch */
};

/* Dots: centre at the middle dot's place at 900 mm (or the nearest depth in range), unit from the
 * four sides of the pattern at that depth. Fixed per rig. Range images choose theirs per frame. */
struct ih_rig {
    struct ih_calibration calibration;
    struct ih_field field;
    int32_t back_q24[3];  /* the lens backwards, from where ih_rig_undistort starts */
    int32_t newton_steps; /* at the most; 0: they end beside the pixel, slow iteration does not */
    int32_t newton_last_q28; /* no step is taken after one below this */
    struct ih_line line[IH_SLOTS];
};

IH_BEGIN_DECLS

/* Check the calibration and fill the rig. *bad_slot is the dot that failed, or IH_NONE. */
enum ih_err ih_rig_init(struct ih_rig *rig, const struct ih_calibration *calibration,
                        int32_t *bad_slot) __attribute__((warn_unused_result));

/* Frame pixel -> normalised coordinates. Inside the frame ih_rig_distort brings it back within
 * 0.005 px: ih_rig_init refuses a lens for which this does not hold. */
void ih_rig_undistort(const struct ih_rig *rig, int32_t u_px_q12, int32_t v_px_q12, int32_t *x_q28,
                      int32_t *y_q28);

/* Normalised coordinates -> frame pixel. |x|, |y| are limited to IH_RIG_TAN_MAX first. */
void ih_rig_distort(const struct ih_rig *rig, int32_t x_q28, int32_t y_q28, int32_t *u_px_q12,
                    int32_t *v_px_q12);

/* Normalised coordinates -> undistorted pixel (fx x + cx, fy y + cy). */
void ih_rig_to_pixel(const struct ih_rig *rig, int32_t x_q28, int32_t y_q28, int32_t *u_px_q12,
                     int32_t *v_px_q12);

/* Normalised coordinates of a dot at a depth; depth_mm_q8 > 0. */
void ih_rig_dot_at(const struct ih_rig *rig, int32_t slot, int32_t depth_mm_q8, int32_t *x_q28,
                   int32_t *y_q28);

/* Is the pixel's centre inside the frame? */
bool ih_rig_inside(const struct ih_rig *rig, int32_t u_px_q12, int32_t v_px_q12);

IH_END_DECLS

#endif
