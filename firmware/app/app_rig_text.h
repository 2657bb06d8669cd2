/* app_rig_text - how the rig has moved against its file (ih_align.h), in words and in millimetres.
 */
#ifndef APP_RIG_TEXT_H
#define APP_RIG_TEXT_H

#include "isohead.h"

/* A state in a word. */
const char *app_rig_text(enum ih_align_state state);

/* One standard deviation of depth at 1 m. A dot rig only. */
int32_t app_rig_depth_mm_q8(const struct isohead *head);

#endif
