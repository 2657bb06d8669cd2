/* hal_v4l2_controls - exposure and gain of a V4L2 device, set and read back.
 *
 * What is done with which control stands in hal_v4l2.h.
 * Error: as text that names the control, what was asked, and the range or what the device answered.
 */
#ifndef HAL_V4L2_CONTROLS_H
#define HAL_V4L2_CONTROLS_H

#include <stdbool.h>
#include <stdint.h>

#include "hal.h"

enum hal_v4l2_mode {
    HAL_V4L2_KEEP = 0, /* nothing is touched */
    HAL_V4L2_AUTO,     /* the camera's own automatic */
    HAL_V4L2_VALUE,
};

struct hal_v4l2_setting {
    enum hal_v4l2_mode mode;
    int32_t value;
};

/* How exposure is set; found out when it is first set after opening. */
struct hal_v4l2_exposure {
    bool known; /* and automatic exposure is off */
    uint32_t control;
    int64_t unit_ns; /* of the control's value */
};

bool hal_v4l2_exposure_auto(int fd, struct hal_error *error);

/* width: of the frames. *exposure: zeroed after opening, then this function's own. */
bool hal_v4l2_exposure_set(int fd, int32_t width, int32_t exposure_us,
                           struct hal_v4l2_exposure *exposure, struct hal_error *error);

bool hal_v4l2_gain_auto(int fd, struct hal_error *error);
bool hal_v4l2_gain_set(int fd, int32_t gain, struct hal_error *error);

#endif
