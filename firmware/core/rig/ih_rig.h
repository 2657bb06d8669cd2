/* ih_rig - the calibrated camera and projector in fixed point, checked once (paper, section 2.1).
 *
 * In:    struct ih_calibration, the numbers of rig.json rounded to fixed point and nothing else.
 * Out:   struct ih_rig: the same, and what does not change from frame to frame: the lens (ih_camera),
 *        each dot's epipolar line, and for the surface the field of view in units of half a dot pitch.
 * Error: each check has its own code; bad_slot says which dot. With a rig that passes no stage divides
 *        by zero or overflows.
 * Cost:  once per rig: 361 lines, and the lens.
 *
 * The camera frame is OpenCV's: X right, Y down, Z forward, mm. The level frame is the same for a camera that hangs
 * level; else it is turned (ih_level). Normalised coordinates are
 * x = X / Z and y = Y / Z after removal of the lens distortion; "undistorted pixels" are
 * (fx x + cx, fy y + cy).
 *
 * A line is simple: dot i is the ray O + s r from the projector. At depth Z it appears at
 * X/Z = rx/rz + (Ox - Oz rx/rz) / Z, so in undistorted pixels it is at infinity + e / Z exactly:
 * its position on the line is linear in 1/Z, and depth is one division.
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
    /* Not used for a range rig. */
    int32_t origin_mm_q16[3];
    int32_t ray_q30[IH_SLOTS][3];
    /* Of any rig: unit vector that points up; all 0 is that of a level camera, (0, -1, 0). */
    int32_t up_q30[3];
};

/* One dot's epipolar line. A position t on it is the distance along dir from the dot at infinity, px. */
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

/* field, of a dot rig: centred on the middle dot at 900 mm (or the nearest depth in range), the unit from
 * the four sides of the pattern at that depth; in the level frame. A range rig has a field per frame. */
struct ih_rig {
    struct ih_calibration calibration;
    struct ih_field field;
    int32_t half_pitch_q28; /* the same unit in the camera frame */
    /* By ih_level_init. */
    bool is_level; /* both frames are the same */
    int32_t level_q30[3][3],
        level_back_q30[3][3]; /* the level frame's axes in the camera's, and the other way round */
    int32_t level_origin_mm_q16[3]; /* of the dots' rays, in the level frame */
    /* By ih_camera_init, for ih_camera_undistort. */
    int32_t inverse_q24[3];  /* series of the inverse radial distortion */
    int32_t newton_steps;    /* at most; 0: Newton is no better than the iteration alone */
    int32_t newton_last_q28; /* a step below this is the last one */
    /* By ih_rig_move: relative change of the focal length, and shift of the picture. */
    int32_t focal_q30;
    int32_t shift_px_q12[2];
    struct ih_line line[IH_SLOTS];
};

IH_BEGIN_DECLS

/* Check the calibration and fill the rig. *bad_slot is the dot that failed, or IH_NONE. */
enum ih_err ih_rig_init(struct ih_rig *rig, const struct ih_calibration *calibration,
                        int32_t *bad_slot) __attribute__((warn_unused_result));

/* How a rig has moved: the projector by up to 0.05 rad about each axis, the camera's focal length, its picture. */
struct ih_rig_motion {
    int32_t rotation_rad_q30[3];
    int32_t focal_q30; /* relative */
    int32_t shift_px_q12[2];
};

/* The lines where they are now; ray_q30: of the rig's file. A line that would leave the bounds of a rig stays, and so does
 * the field of a pattern that would. Dots are to be put where the file's camera would see them (ih_dot_rows). */
void ih_rig_move(struct ih_rig *rig, const int32_t ray_q30[IH_SLOTS][3],
                 const struct ih_rig_motion *motion);

/* Is it a unit vector? */
bool ih_rig_is_unit(const int32_t vector_q30[3]);

/* Along one axis the normalised coordinate, at a depth, of a ray with this slope. */
int32_t ih_rig_slope_at_q28(const int32_t origin_mm_q16[3], int axis, int64_t tan_q30,
                            int32_t depth_mm_q8);

/* Normalised coordinates of a dot at a depth; depth_mm_q8 > 0. */
void ih_rig_dot_at(const struct ih_rig *rig, int32_t slot, int32_t depth_mm_q8, int32_t *x_q28,
                   int32_t *y_q28);

IH_END_DECLS

#endif
