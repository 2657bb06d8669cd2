/* app_health - does the rig still fit? What the board's program does with the core's ih_health.
 *
 * After each lit frame: a projector that is turned by up to 0.6 degrees is corrected for, in memory
 * alone, from the next frame on. It is never done silently: a warning says the turn, its uncertainty and
 * what that is in depth; each record has "rig" (app_record.h) while it lasts. A rig that no turn mends
 * is warned of. A reloaded rig starts anew.
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
