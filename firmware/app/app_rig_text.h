/* app_rig_text - how the rig has moved against its file (ih_align.h), in words and in millimetres, and how it hangs.
 */
#ifndef APP_RIG_TEXT_H
#define APP_RIG_TEXT_H

#include "isohead.h"

/* A state in a word. */
const char *app_rig_text(enum ih_align_state state);

/* One standard deviation of depth at 1 m. A dot rig only. */
int32_t app_rig_depth_mm_q8(const struct isohead *head);

/* Room for a direction in words. */
#define APP_RIG_TEXT_UP 96

struct app_rig_up_text {
    char text[APP_RIG_TEXT_UP];
};

/* Which way is up: the unit vector, and how the camera hangs: down by the tilt, heads' tops to the right by the roll. */
struct app_rig_up_text app_rig_up_text(const int32_t up_q30[3]);

#endif
