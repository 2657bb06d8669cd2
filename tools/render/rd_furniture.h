/* rd_furniture - things of a room, and whole scenes of them without a person.
 * Upright things stand along Y (down) in the camera frame unless the scene tilts the camera.
 */
#ifndef RD_FURNITURE_H
#define RD_FURNITURE_H

#include "rd_rng.h"
#include "rd_scene.h"

/* Something or other, 100 to 400 mm large, in the air at a place: box, board, ball, post. */
void rd_furniture_thing(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec at_mm);
/* Boards with books; the place is the middle of its front. */
void rd_furniture_shelf(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec at_mm);

/* A table top with bowls, bottles, boxes, balls, looked down upon. */
void rd_furniture_table(struct rd_scene *scene, struct rd_rng *rng);
/* A room with chairs, shelves, plants, lamps, boxes. */
void rd_furniture_room(struct rd_scene *scene, struct rd_rng *rng);

/* Two to eight things that may be taken for a head, 0.5 to 1.5 m before the camera and anywhere in the pattern: on
 * posts, tables, stools and boards, or standing on the floor; with or without walls behind. Half of the cameras look
 * straight ahead, the others down by up to 40 degrees. */
void rd_clutter_build(struct rd_scene *scene, struct rd_rng *rng);

#endif
