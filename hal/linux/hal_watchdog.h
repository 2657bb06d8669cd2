/* hal_watchdog - signs of life for whoever watches the program: systemd, the machine's watchdog, the
 * guard of the laser.
 *
 * feed() may be called as often as one likes, and has to be at least every HAL_WATCHDOG_STEP_US;
 * each watcher is fed only as often as it needs:
 * systemd:  where NOTIFY_SOCKET is set: READY=1 with the first feed, STOPPING=1 at the end. Where
 *           WATCHDOG_USEC is set too, and meant for this process (WATCHDOG_PID): WATCHDOG=1 as often
 *           as half of it. Both variables are removed from the environment, so that no child speaks
 *           for this process. The protocol is one datagram of text to a socket, promised to stay
 *           (sd_notify(3), "Notes"); the fifty lines for it here replace a library and its
 *           dependencies in packages and cross builds.
 * machine:  a device like /dev/watchdog, set to reset the machine after HAL_WATCHDOG_TIMEOUT_S: a byte
 *           each HAL_WATCHDOG_STEP_US, and 'V' at the orderly end with the laser off, which stops it
 *           (a driver set to nowayout goes on and resets the machine). The driver may round the time,
 *           or have one that cannot be set: what it says then is reported. Below two steps is an
 *           error.
 * guard:    hal_guard_feed each HAL_WATCHDOG_STEP_US, or four times per its timeout.
 *
 * Error:    the guard comes first: without it nobody else is fed, and they act. The others are both
 *           fed before one that failed is reported. A full socket of systemd is no error: it is tried
 *           again with the next feed.
 */
#ifndef HAL_WATCHDOG_H
#define HAL_WATCHDOG_H

#include "linux/hal_guard.h"

#define HAL_WATCHDOG_STEP_US 400000
/* Longer than a USB camera takes to open or to fail; the unit's WatchdogSec, too. */
#define HAL_WATCHDOG_TIMEOUT_S 10

struct hal_watchdog_config {
    const char *path;        /* a watchdog device; NULL: none */
    struct hal_guard *guard; /* NULL: none */
    const struct hal_clock *clock;
};

/* When a watcher is fed next. */
struct hal_watchdog_schedule {
    int64_t step_us; /* 0: with each feed */
    int64_t next_us;
};

struct hal_watchdog_feeder {
    struct hal_watchdog watchdog;
    /* Private from here on. */
    struct hal_watchdog_config config;
    int device_fd, notify_fd; /* -1: none */
    bool ready;               /* READY=1 has been sent */
    bool is_life_needed;      /* systemd expects WATCHDOG=1 */
    struct hal_watchdog_schedule device, notify, guard;
};

/* False: *error names the variable or device, what was found and expected; nothing is open. Opening
 * the device starts it. *unproven: what is not known of its time, or "". */
bool hal_watchdog_open(struct hal_watchdog_feeder *feeder, const struct hal_watchdog_config *config,
                       struct hal_error *unproven, struct hal_error *error);
/* The orderly end. Without it the watchers act, as they should: so does the machine's where the laser
 * may be on. */
void hal_watchdog_close(struct hal_watchdog_feeder *feeder, bool may_be_on);

#endif
