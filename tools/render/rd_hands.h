/* rd_hands - the hands' part of a person's motion. Used by rd_motion.c alone.
 */
#ifndef RD_HANDS_H
#define RD_HANDS_H

#include "rd_motion.h"

/* Fills the lists of gestures. Without `hands_move` both hands stay in the lap, but for what the act needs of them. */
void rd_hands_plan(struct rd_motion *motion, uint64_t seed, enum rd_act act, bool hands_move);

/* Sets posture->hands for a frame from the posture's head and torso. */
void rd_hands_pose(const struct rd_motion *motion, const struct rd_person *person, int frame,
                   struct rd_posture *posture);

#endif
