/* rd_parts - the bodies a person is built of that deserve a file of their own.
 * Used by rd_person.c alone.
 */
#ifndef RD_PARTS_H
#define RD_PARTS_H

#include "rd_person.h"

/* Skull, face, hair, ears, hat at the posture's head pose. */
void rd_head_build(const struct rd_person *person, const struct rd_pose *head, struct rd_scene *scene);

/* What the person wears, in the head's frame. */
void rd_gear_build(const struct rd_person *person, struct rd_scene *scene);

/* Upper arm, forearm and hand from the shoulder. `side` is -1 for the arm at -X and +1 for the other; a palm out
 * of reach is drawn as near to its place as the arm allows. */
void rd_arm_build(const struct rd_person *person, struct rd_vec shoulder_mm, const struct rd_pose *torso,
                  const struct rd_hand *hand, double side, struct rd_scene *scene);

#endif
