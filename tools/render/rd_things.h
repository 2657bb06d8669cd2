/* rd_things - things that a head finder may take for a head: round, on a narrow neck, above something like
 * shoulders, or at the height of a head. Upright, with -Y up and the front to -Z.
 */
#ifndef RD_THINGS_H
#define RD_THINGS_H

#include "rd_rng.h"
#include "rd_scene.h"

/* Something that stands on the pose's origin: ball, melon, pumpkin, vase, teapot, kettle, bowl, bottles, helmet,
 * backpack, boxes, plant, stuffed animal, bucket, pillow, monitor, towels or lamp. Returns its height, mm. */
double rd_thing_put(struct rd_scene *scene, struct rd_rng *rng, const struct rd_pose *foot);

/* What reaches down to the floor by itself, with what is at the height of a head at the pose's origin: a seat with a
 * headrest, an armchair with a cushion, a chair under a coat, a coat on a stand, a lamp on a post. */
void rd_thing_put_tall(struct rd_scene *scene, struct rd_rng *rng, const struct rd_pose *top, double floor_mm);

/* A material of any colour; one in five is so dark that it shows no dots beyond half a metre. */
int rd_thing_paint(struct rd_scene *scene, struct rd_rng *rng);

#endif
