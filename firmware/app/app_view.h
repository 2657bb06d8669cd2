/* app_view - a camera's frame as the core sees it: the same samples, nothing copied. */
#ifndef APP_VIEW_H
#define APP_VIEW_H

#include "hal.h"
#include "ih_types.h"

/* Good for as long as the frame is held. */
struct ih_frame app_view_of(const struct hal_frame *frame);

#endif
