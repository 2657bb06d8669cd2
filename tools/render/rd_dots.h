/* rd_dots - the laser's dots in the picture.
 * Each beam is a bundle of sub-rays with a Gaussian profile. Every sub-ray lands on the first surface in its way
 * and shows as a small spot if the camera sees that point. So dots widen on slanted surfaces, split at depth edges
 * and go out where the camera's view is blocked. A spot's light falls with distance squared, with the cosine
 * towards the camera and with the albedo; speckle makes it uneven.
 */
#ifndef RD_DOTS_H
#define RD_DOTS_H

#include <stdbool.h>

#include "rd_options.h"
#include "rd_rig.h"
#include "rd_scene.h"

/* A dot counts as visible from this peak above the picture around it, grey levels of 255; below it, as dim. */
#define RD_VISIBLE_GREY 6.0
/* Grey levels beyond this are lost. */
#define RD_FULL_GREY 255.0

struct rd_laser {
    double power_grey;         /* peak on a white surface at 1 m that faces the camera, for a spot of 1.2 px */
    double optics_px;          /* width (sigma) that the lens gives a point, picture middle */
    double field_blur;         /* relative growth of that towards the corners */
    double beam_mm;            /* beam width (sigma) at the projector */
    double divergence;         /* growth of that, mm per mm */
    double reach_mm;           /* farther surfaces show no dots */
    double speckle;            /* 0 none .. 1 full */
    double missing;            /* fraction of dots that are not there */
    double gain[RD_DOT_COUNT]; /* the grating does not split the light evenly */
    uint64_t seed;
};

struct rd_dot {
    int index;
    bool is_dim;
    double u_px, v_px, z_mm;
};

struct rd_dot_list {
    struct rd_dot dots[RD_DOT_COUNT];
    int dot_count;
};

void rd_laser_make(struct rd_laser *laser, const struct rd_options *options, const struct rd_rig *rig);

/* Adds all dots to `grey` and lists those whose middle rays' points the camera sees, with these true positions. */
void rd_dots_cast(const struct rd_laser *laser, const struct rd_rig *rig, const struct rd_scene *scene, int frame,
                  float *grey, struct rd_dot_list *seen);

#endif
