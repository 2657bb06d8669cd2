/* app_view - a camera's frame as the core sees it: the same samples, nothing copied; and why the core
 * refuses one. */
#ifndef APP_VIEW_H
#define APP_VIEW_H

#include "hal.h"
#include "base/ih_types.h"
#include "rig/ih_rig.h"

/* Good for as long as the frame is held. */
struct ih_frame app_view_of(const struct hal_frame *frame);

/* err: as from isohead_frame. */
void app_view_explain(const struct hal_frame *frame, const struct ih_calibration *calibration,
                      enum ih_err err, struct hal_error *error);

#endif
