/* prop_scene - made-up people for the property tests: a head on a neck above shoulders, before a wall,
 * as ellipsoids, in double; and what a rig sees of them. */
#ifndef PROP_SCENE_H
#define PROP_SCENE_H

#include "base/ih_types.h"
#include "dots/ih_dots.h"
#include "rig/ih_rig.h"

#include "ih_test.h"

#define PROP_BODIES 3 /* head, neck, shoulders */

struct prop_body {
    double centre_mm[3], semi_mm[3];
};

struct prop_scene {
    struct prop_body body[PROP_BODIES]; /* the head first */
    double wall_mm;
};

/* A person whose head's centre and semi-axes are given, before a wall; otherwise a mean one. */
struct prop_scene prop_person(double x_mm, double y_mm, double z_mm, double size, double wall_mm);

/* A random one: head 650 to 1100 mm away, up to aside_mm from the axis, of 0.9 to 1.1 times the mean
 * size; the wall 400 to 1200 mm behind it. */
struct prop_scene prop_random_person(struct ih_test_random *random, double aside_mm);

/* All lengths times a factor; the scene moved. */
struct prop_scene prop_scaled(const struct prop_scene *scene, double factor);
struct prop_scene prop_moved(const struct prop_scene *scene, const double by_mm[3]);

/* Z of the first thing on the line from + s towards, s > 0. body: NULL, or which it is (PROP_BODIES: the
 * wall). */
double prop_depth_mm(const struct prop_scene *scene, const double from_mm[3],
                     const double towards[3], int *body);

/* Where the dot of a slot falls and where the camera sees it. */
struct prop_dot {
    bool seen; /* in the frame, in the rig's range, not hidden from the camera */
    double point_mm[3];
    double u_px, v_px;
    int body;
};

struct prop_dot prop_dot_of(const struct prop_scene *scene, const struct ih_calibration *c,
                            int32_t slot);

/* Camera frame to distorted pixel, OpenCV's model. */
void prop_project(const struct ih_calibration *c, const double point_mm[3], double *u_px,
                  double *v_px);

/* Dots by row, then column, as ih_dots gives them; slot_of_dot goes with them. */
void prop_sort(struct ih_dots *dots, int16_t slot_of_dot[IH_DOTS_MAX]);

/* All dots that are seen, centres off by a normal error; in order. */
void prop_dots(const struct prop_scene *scene, const struct ih_calibration *c,
               struct ih_test_random *random, double sigma_px, struct ih_dots *dots,
               int16_t slot_of_dot[IH_DOTS_MAX]);

/* A camera frame of 8 bits: the dots as Gaussians on grey with a little noise. */
void prop_paint(const struct prop_scene *scene, const struct ih_calibration *c,
                struct ih_test_random *random, uint8_t *grey, struct ih_frame *frame);

/* A depth camera without lens distortion, and its picture of a scene. */
void prop_range_rig(struct ih_calibration *c, int32_t width, int32_t height, double focal_px);
void prop_paint_range(const struct prop_scene *scene, const struct ih_calibration *c,
                      uint16_t *depth_mm, struct ih_frame *frame);

/* How many seeds: count, times ISOHEAD_SEEDS if the environment has it. */
int32_t prop_seeds(int32_t count);

#endif
