/* hal_limits - how long the laser may be on at most, judged by somebody else than who switches it.
 *
 * In:    at each look the time, for how long the line has been high since the beginning, and for how
 *        long it had been when the last frame was judged.
 * Out:   may it be on?
 *        - since the last frame that was judged, or the last pause, it has been high for at most
 *          cap_us + HAL_LIMITS_SLACK_US;
 *        - in any time T it is high for at most duty_percent of (T + HAL_LIMITS_BURST_US), and
 *          HAL_LIMITS_SLACK_US more.
 *        Both hold to the time between two looks. In 10 s that is duty x 10.1 s + 0.03 s, in an hour
 *        duty x 3600.1 s + 0.03 s. Once exceeded, the cap needs a frame or a pause, and the duty half
 *        of what it may use at once.
 * Trust: none. Sums that cannot be count as high for the whole time since the last look, and a frame
 *        judged in the future as none.
 */
#ifndef HAL_LIMITS_H
#define HAL_LIMITS_H

#include "hal.h"

/* The time whose duty may be used at once, after a rest. */
#define HAL_LIMITS_BURST_US 100000
/* Who switches the laser keeps the same limits, and gets so much time to do it. */
#define HAL_LIMITS_SLACK_US 30000
/* Low for so long: it may be on once more without a frame. */
#define HAL_LIMITS_PAUSE_US 500000

struct hal_limits_config {
    int64_t cap_us;
    int32_t duty_percent; /* 1 .. 100 */
};

struct hal_limits {
    struct hal_limits_config config;
    int64_t look_us; /* when the last look was */
    int64_t on_us;   /* what the sum was then; -1: nonsense */
    int64_t judged_on_us;
    int64_t silent_us; /* high since the last frame or pause */
    int64_t low_us;    /* low since so long */
    int64_t credit;    /* left of the duty, percent x us */
    bool duty_is_used_up;
};

void hal_limits_init(struct hal_limits *limits, const struct hal_limits_config *config,
                     int64_t now_us);

/* on_us: high until now. judged_on_us: high until the last frame was judged. */
bool hal_limits_allow(struct hal_limits *limits, int64_t now_us, int64_t on_us,
                      int64_t judged_on_us);

#endif
