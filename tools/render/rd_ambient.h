/* rd_ambient - the picture without the laser: one ray per pixel, softened by the lens.
 * What stands still is rendered once; each frame casts only rays that may meet a moving shape. Tiles of the image
 * know which shapes they can see.
 * Cost:  about 40 ms for a frame of 752x582 with a person in it.
 */
#ifndef RD_AMBIENT_H
#define RD_AMBIENT_H

#include "rd_light.h"
#include "rd_rig.h"

struct rd_ambient;

/* NULL: out of memory. */
struct rd_ambient *rd_ambient_new(const struct rd_rig *rig);
void rd_ambient_free(struct rd_ambient *ambient);

/* Renders the scene's still shapes; needed after each change of them, and of the others where they throw shadows. */
void rd_ambient_still(struct rd_ambient *ambient, const struct rd_scene *scene, const struct rd_light *light);

/* Still shapes' pixels that differ much from a neighbour, as the mean of 4x4 rays: edges where they belong, to a small
 * part of a pixel. For still scenes of sharp patterns; after rd_ambient_still. */
void rd_ambient_edges(struct rd_ambient *ambient, const struct rd_rig *rig, const struct rd_scene *scene,
                      const struct rd_light *light);

/* Out of focus: a Gaussian of this standard deviation over the whole frame. */
void rd_ambient_blur(struct rd_ambient *ambient, double sigma_px, float *grey);

/* The whole scene as grey levels (of 255, may exceed it), width x height, row by row. */
void rd_ambient_frame(struct rd_ambient *ambient, const struct rd_scene *scene, const struct rd_light *light,
                      float *grey);

#endif
