/* app_health - does the rig still fit? What the board's program reports of the core's alignment (ih_align.h).
 *
 * The core corrects a rig that moved by itself, in every frame. Here, after each lit frame:
 *   1. A state that APP_HEALTH_STEADY lit frames agree on is reported when it is another one than before; so is a rig
 *      that has moved on by more than 0.05 degrees, 0.2 % of focal length or 0.5 px. The message says by how much, what that
 *      leaves open in depth, and what to do. After a knock, other than with heat, the rotation is far from its mean over
 *      about 32 frames.
 *   2. With config->check the loop ends after APP_HEALTH_CHECKED lit frames and no records are written: a message
 *      says whether the rig fits and how well depth is known. The exit status is 0 if it fits as it is, else 1: also
 *      when no lit frame has come for APP_HEALTH_WAIT_US, as without a camera, and when it is ended before.
 *
 * Before a rig goes to the core its up is held against that of the accelerometer, where there is one: a rig that says
 * none gets the measured one, one that is off by more than APP_HEALTH_UP_MDEG is reported and used.
 *
 * A reloaded rig starts anew. With config->paper nothing is aligned, and nothing is reported.
 */
#ifndef APP_HEALTH_H
#define APP_HEALTH_H

#include "app_state.h"

#define APP_HEALTH_STEADY 6 /* frames */
/* Twice what is lost hardly a head for. */
#define APP_HEALTH_UP_MDEG 10000
/* Longer than any camera takes to start, and to frames at 1 Hz of which every second is lit. */
#define APP_HEALTH_WAIT_US 15000000

/* The file's calibration, before the core gets it. */
void app_health_up(const struct app_state *state, struct ih_calibration *calibration);

/* The rig has just been made from its file. */
void app_health_begin(struct app_state *state);

/* A lit frame whose result is there and not yet in a record. */
void app_health_frame(struct app_state *state);

/* Whenever the loop wakes: --check does not wait for ever. */
void app_health_tick(struct app_state *state);

#endif
