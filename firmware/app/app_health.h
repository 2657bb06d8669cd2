/* app_health - does the rig still fit? What the board's program does with the core's ih_health.
 *
 * After each lit frame: a rotation of the projector by up to 0.6 degrees is corrected for, in memory
 * only, from the next frame on. A warning reports the rotation, its uncertainty and what that is in
 * depth; each record has "rig" (app_record.h) while it lasts. A warning reports a rig that no rotation
 * corrects, too. A reloaded rig starts anew.
 *
 * With config->check the loop ends after IH_HEALTH_ENOUGH lit frames and no records are written: a
 * message says whether the rig fits and how well that is known, and the exit status is 0 if it does as
 * it is, else 1.
 */
#ifndef APP_HEALTH_H
#define APP_HEALTH_H

#include "app_state.h"

/* The rig has just been made from its file. */
void app_health_begin(struct app_state *state);

/* A lit frame whose result is there and not yet in a record. */
void app_health_frame(struct app_state *state);

#endif
