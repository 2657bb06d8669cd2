/* hal_guard - a child process that switches the laser off when this process cannot any more.
 *
 * In:    a strobe. Out: a strobe that does the same under guard: the program uses this one only.
 *        open() opens the strobe below and forks the guard, close() ends the guard and closes the
 *        strobe; open() again therefore has a new guard that holds the new lines, and the old one
 *        has given the old ones back before they are taken anew (else the kernel would say EBUSY).
 * The guard switches off and ends when
 *        - the socket to this process reads end of file: this process has died, by SIGKILL too;
 *        - no sign of life (hal_guard_feed) came for timeout_ms, with the laser on;
 *          while it is off a camera may take seconds to open;
 *        - this process reports that all is done.
 * It switches off, and goes on, when the interlock moves: this process may be busy with a frame for as
 *        long as a slow processor needs. The event stays for this process, and interlock() here says
 *        "open" once after the guard has switched off, so that nobody believes the laser to be on.
 *        This process has to look at the interlock before and after set(true) and several times a
 *        second while it is on (firmware/app/app_laser.h).
 *        It has tried GUARD_OFF_TRIES times, 10 ms apart, before it gives up on a line that fails.
 * While it lives, set(true) is refused and undone as soon as the guard has let go: whatever the order
 *        of events, the line is not on for longer without a guard than one set(true) takes.
 *        set(false) never asks the guard, only tells it, and is as safe in a signal handler as that
 *        of the strobe below.
 * The child: a session of its own, so that a terminal's keys do not reach it; every signal blocked
 *        but SIGKILL, SIGSTOP and those of its own faults, for which it has inherited the handlers
 *        of hal_signals.h; no descriptor open but its end of the socket, the line and the interlock;
 *        named
 *        isohead-guard; it never writes a word.
 *        It is a copy of this process: memory-mapped buffers of a camera that is open while the
 *        strobe is opened stay mapped in it, and keep the device in use. Open the strobe first, or
 *        give the buffers MADV_DONTFORK.
 * The line: the kernel keeps it requested, and so driven low, until the guard has closed it as well;
 *        for what comes then see hal_gpio.h: low on most controllers, an input held by the board's
 *        pull-down on others. A program that is started anew within these milliseconds can get EBUSY.
 * What it does not do: both processes killed by SIGKILL at once (a control group being killed, the
 *        machine out of memory), a kernel that stands still: for these there are the service
 *        manager's own switching off and the one-shot of docs/safety.md.
 */
#ifndef HAL_GUARD_H
#define HAL_GUARD_H

#include <sys/types.h>

#include "hal.h"

#define HAL_GUARD_TIMEOUT_MS 2000

struct hal_guard_config {
    const struct hal_strobe *strobe; /* to be guarded */
    const int *line_fd; /* the descriptor that the open strobe sets its line by; -1 in it: none */
    int32_t timeout_ms; /* at least 1; HAL_GUARD_TIMEOUT_MS where nothing speaks against it */
    /* Readable when the interlock has moved, until this process has taken the event. NULL, or -1 in
     * it: none. */
    const int *interlock_fd;
};

struct hal_guard {
    struct hal_strobe strobe;
    /* Private from here on. */
    struct hal_guard_config config;
    int socket_fd; /* -1: there is no guard */
    pid_t pid;
    bool moved; /* the guard has switched off; not reported yet */
};

/* What config points at lives as long as the guard. */
void hal_guard_init(struct hal_guard *guard, const struct hal_guard_config *config);

/* Tell that this process lives; several times per timeout_ms. Never waits. False: the guard has let
 * go, died or stands still, *error says which: the strobe has to be closed, and may be opened anew.
 * True while the strobe is closed: nothing is guarded then. */
bool hal_guard_feed(struct hal_guard *guard, struct hal_error *error);

#endif
