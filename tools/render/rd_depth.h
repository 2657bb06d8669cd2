/* rd_depth - the depth image that a sensor of structured light gives: shadow, steps, noise, holes and false edges.
 * It looks for each pixel's neighbourhood in its projector's picture, so what it measures is disparity. Where nearer
 * things cover the projector's sight nothing is known; near an edge the nearer depth spreads or nothing is known; dark
 * and slanted surfaces that are far away have holes. It looks at squares of two pixels.
 */
#ifndef RD_DEPTH_H
#define RD_DEPTH_H

#include <stdint.h>

#include "rd_options.h"
#include "rd_rig.h"
#include "rd_scene.h"

#define RD_DEPTH_SQUARE 2
#define RD_DEPTH_MAX 65535

struct rd_depth {
    int columns, rows;      /* of squares */
    double product;         /* disparity in squares times depth in mm */
    double noise;           /* of disparity, in squares */
    double dark_loss;       /* 0 none .. 1: how easily dark surfaces are lost */
    double near_mm, far_mm; /* what the sensor measures at all */
    int side;               /* 1 or -1: where its projector is */
    int edge;               /* squares by which what is near spreads */
    uint64_t seed;
    float *disparity; /* true; 0: nothing is there */
    float *light;     /* what comes back, relative */
};

/* False: out of memory. */
bool rd_depth_make(struct rd_depth *depth, const struct rd_options *options, const struct rd_rig *rig);
void rd_depth_free(struct rd_depth *depth);

/* Z in whole mm by pixel, 0 where it is not known. */
void rd_depth_expose(struct rd_depth *depth, const struct rd_rig *rig, const struct rd_scene *scene, int frame,
                     uint16_t *depth_mm);

#endif
