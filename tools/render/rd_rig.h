/* rd_rig - camera and dot projector.
 * The camera looks along Z. The projector stands beside it at the same height; both look at the point
 * 800 mm ahead, so the wider the baseline, the more the pattern is toed in.
 * The beam splitter is a grating: dots are equally spaced in direction cosines, not in angle.
 */
#ifndef RD_RIG_H
#define RD_RIG_H

#include <stdbool.h>

#include "rd_options.h"
#include "rd_vec.h"

#define RD_DOT_ROWS 19
#define RD_DOT_COUNT (RD_DOT_ROWS * RD_DOT_ROWS)

struct rd_rig {
    bool is_range; /* a depth camera: no projector, no rays */
    int width, height;
    double fx_px, fy_px, cx_px, cy_px;
    double k1, k2, p1, p2, k3; /* OpenCV's distortion */
    struct rd_vec projector_mm;
    struct rd_vec dot_rays[RD_DOT_COUNT]; /* index = row * 19 + column */
    double near_mm, far_mm;
};

void rd_rig_make(struct rd_rig *rig, const struct rd_options *options);

/* Rotates and shifts the projector and changes the camera as the options say: a calibrated rig that was knocked. */
void rd_rig_knock(struct rd_rig *rig, const struct rd_options *options);
/* The projector's rays of `start`, rotated by a fraction of the options' drift. */
void rd_rig_drift(struct rd_rig *rig, const struct rd_rig *start, const struct rd_options *options, double fraction);
/* Gives all numbers of a rig the errors of a calibration, as large as the options say. */
void rd_rig_misjudge(struct rd_rig *rig, const struct rd_options *options);

/* Pixel of a point in space. False: behind the camera or so far aside that the lens model says nothing. */
bool rd_rig_project(const struct rd_rig *rig, struct rd_vec point_mm, double *u_px, double *v_px);

/* Where a point lies in the pattern, as seen from the projector: row and column of dots from the middle one, -9 .. 9
 * within the pattern. False: behind the projector. A depth camera has a pattern that fills its picture. */
bool rd_rig_pattern_place(const struct rd_rig *rig, struct rd_vec point_mm, double *row, double *column);

/* Unit direction of what a pixel sees. */
struct rd_vec rd_rig_pixel_ray(const struct rd_rig *rig, double u_px, double v_px);

#endif
