/* app_frame - what a frame is used for: lit, dark or neither; its record; what the laser does next.
 *
 * Part of the loop (app_loop.h has the modes and the state); it knows frames, app_loop knows time
 * and devices. Every frame that goes in here is released here, but one that is held as the ambient
 * one: that is released for the next, or by app_frame_forget.
 */
#ifndef APP_FRAME_H
#define APP_FRAME_H

#include "app_state.h"

/* An ambient frame older than this is not used: at 1 m/s somebody has moved by 200 mm. */
#define APP_FRAME_AMBIENT_AGE_MAX_US 200000
/* The first exposure when it is controlled. */
#define APP_FRAME_EXPOSURE_US 4000

/* The camera has just been opened, frame_time_us is known. */
void app_frame_begin(struct app_state *state);

/* Ask for light, as the mode wants it before a first frame. */
void app_frame_light(struct app_state *state);

/* A frame whose content could not be read: it has no samples and is not to be released. */
void app_frame_lose(struct app_state *state, const struct hal_frame *frame, const char *text);

/* A frame that a newer one makes useless. */
void app_frame_skip(struct app_state *state, const struct hal_frame *frame);

void app_frame_use(struct app_state *state, const struct hal_frame *frame);

/* Before the camera is closed: give back what is held. */
void app_frame_forget(struct app_state *state);

#endif
