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

/* The whole scene as grey levels (of 255, may exceed it), width x height, row by row. */
void rd_ambient_frame(struct rd_ambient *ambient, const struct rd_scene *scene, const struct rd_light *light,
                      float *grey);

#endif
