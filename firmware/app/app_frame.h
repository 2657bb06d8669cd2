/* app_frame - what a frame is used for: lit, dark or neither; its record; what the laser does next.
 *
 * Part of the loop (app_loop.h has the modes and the state); it knows frames, app_loop knows time
 * and devices. Every frame that goes in here is released here, but one that is held as the ambient
 * one: that is released for the next, or by app_frame_forget.
 */
#ifndef APP_FRAME_H
#define APP_FRAME_H

#include "app_loop.h"

/* The camera has just been opened, frame_time_us is known. */
void app_frame_begin(struct app_loop *loop);

/* Ask for light, as the mode wants it before a first frame. */
void app_frame_light(struct app_loop *loop);

/* A frame whose content could not be read: it has no samples and is not to be released. */
void app_frame_lose(struct app_loop *loop, const struct hal_frame *frame, const char *text);

/* A frame that a newer one makes useless. */
void app_frame_skip(struct app_loop *loop, const struct hal_frame *frame);

void app_frame_use(struct app_loop *loop, const struct hal_frame *frame);

/* Before the camera is closed: give back what is held. */
void app_frame_forget(struct app_loop *loop);

#endif
