/* hal_signals - signals as something to wait for, and none that kills with the laser on.
 *
 * SIGTERM, SIGINT, SIGHUP, and SIGUSR1 where there is something to record: blocked, to be read from fd (hal_events does).
 * SIGPIPE:  ignored, as writing says EPIPE. SIGTSTP, SIGTTIN, SIGTTOU: ignored, as a program that is
 *           stopped with its laser on is blind. (SIGSTOP cannot be: the guard is there for it.)
 * SIGCHLD:  default, so that the guard's end can be asked for even if it was ignored by the parent.
 * All others that kill: a handler on a stack of its own switches the laser off, restores the default
 *           and sends the signal with its own data again, so that exit status and core dump are those
 *           of a program without a handler. A fault inside the handler kills at once: the guard acts.
 *
 * Before the strobe is opened: the guard's process (hal_guard.h) then has the same handlers.
 * For a process with one thread: another's faults would find no stack of their own.
 */
#ifndef HAL_SIGNALS_H
#define HAL_SIGNALS_H

#include "hal.h"

struct hal_signals {
    int fd; /* a signalfd that does not block */
};

/* strobe: its set(false) is called by the handlers, whether it is open or not; it lives as long as
 * the process. NULL: there is no laser. records: SIGUSR1 is read. Once in a process. False: *error. */
bool hal_signals_open(struct hal_signals *signals, const struct hal_strobe *strobe, bool records,
                      struct hal_error *error);

#endif
