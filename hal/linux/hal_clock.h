/* hal_clock - CLOCK_MONOTONIC, the clock of V4L2's timestamps and of the kernel's line events.
 *
 * It stands still while the machine sleeps. It does not fail on any kernel this runs on.
 */
#ifndef HAL_CLOCK_H
#define HAL_CLOCK_H

#include "hal.h"

extern const struct hal_clock hal_clock;

#endif
