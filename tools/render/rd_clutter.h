/* rd_clutter - nobody there, but two to eight things that may be taken for a head, 0.5 to 1.5 m before the camera
 * and anywhere in the pattern: on posts, tables, stools and boards, or standing on the floor; with or without walls
 * behind. Half of the cameras look straight ahead, the others down by up to 40 degrees.
 */
#ifndef RD_CLUTTER_H
#define RD_CLUTTER_H

#include "rd_rng.h"
#include "rd_scene.h"

void rd_clutter_build(struct rd_scene *scene, struct rd_rng *rng);

#endif
