/* hal_guard - two child processes that switch the laser off when this process cannot any more.
 *
 * In:    a strobe. Out: a strobe that does the same under guard: the program uses this one only.
 *        open() opens the strobe below and forks the guards, close() ends them and closes the
 *        strobe; open() again therefore has new guards that hold the new lines, and the old ones
 *        have given the old lines back before they are taken anew (else the kernel would say EBUSY).
 * Three processes: each sees whether the others run, and each can switch off. As long as one of them
 *        runs, no two that are stopped or killed, in any order, leave the laser on:
 *        - this one stopped: the guards see no frame that was judged, and switch off after the cap;
 *        - this one dead: the guards' sockets read end of file;
 *        - a guard that is dead, or has given no sign of life for GUARD_STALE_MS: the other guard
 *          switches off, and here interlock() says "open", which its caller asks several times a
 *          second while the laser is on (firmware/app/app_laser.h).
 * A guard looks every GUARD_LOOK_MS. It switches off, and goes on, while
 *        - hal_limits refuses: cap and duty by its own sums;
 *        - the line reads high without having been announced, or the other guard shows no life;
 *        - the interlock moves: this process may be busy with a frame for as long as a slow
 *          processor needs. The event stays for this process.
 *        interlock() here then says "open" at least once, so that nobody believes the laser to be
 *        on; set(true) meanwhile does nothing.
 * A guard switches off and ends when
 *        - the socket to this process reads end of file, or this process reports that all is done;
 *        - no sign of life (hal_guard_feed) came for timeout_ms, with the laser on;
 *          while it is off a camera may take seconds to open.
 *        It has tried GUARD_OFF_TRIES times, 10 ms apart, before it gives up on a line that fails, and
 *        as often once more in ending.
 * While both live, and only then, set(true) switches on; it is undone as soon as a guard has let go.
 *        set(false) never asks the guards, only informs them, and is as safe in a signal handler as
 *        that of the strobe below.
 * The children: a session of their own, so that a terminal's keys do not reach them; every signal
 *        blocked but SIGKILL, SIGSTOP and those of their own faults, for which they have inherited the
 *        handlers of hal_signals.h; no descriptor open but their end of the socket, the line and the
 *        interlock; named isohead-guard; memory that is locked where that is allowed; they never write a word.
 *        They are copies of this process: memory-mapped buffers of a camera that is open while the
 *        strobe is opened stay mapped in them, and keep the device in use. Open the strobe first, or
 *        give the buffers MADV_DONTFORK.
 * The line: the kernel keeps it requested, and so driven low, until the guards have closed it as well;
 *        for what comes then see hal_gpio.h: low on most controllers, an input held by the board's
 *        pull-down on others. A program that is started anew within these milliseconds can get EBUSY.
 *        All three map a page of memory that is named after the line: hal_guard_end finds them by it, among
 *        processes whose names begin as ours do.
 * What it does not do: all three stopped or killed at once (a control group being killed, the machine
 *        out of memory), a kernel that stands still: for these there are the service manager's own
 *        switching off, the watchdog and the one-shot of docs/safety.md.
 */
#ifndef HAL_GUARD_H
#define HAL_GUARD_H

#include <sys/types.h>

#include "hal.h"
#include "hal_limits.h"

#define HAL_GUARD_TIMEOUT_MS 2000
#define HAL_GUARD_COUNT 2

struct hal_guard_config {
    const struct hal_strobe *strobe; /* to be guarded */
    const int *line_fd; /* the descriptor that the open strobe sets its line by; -1 in it: none */
    int32_t timeout_ms; /* at least 1; HAL_GUARD_TIMEOUT_MS where nothing speaks against it */
    /* Readable when the interlock has moved, until this process has taken the event. NULL, or -1 in
     * it: none. */
    const int *interlock_fd;
    struct hal_limits_config limits;
    const char *line_name; /* of the open strobe's line, unlike any other's on this machine */
};

struct hal_guard_process {
    int socket_fd; /* -1: there is none */
    pid_t pid;
    unsigned cut_count; /* how often it had switched off, as reported by interlock() */
};

struct hal_guard {
    struct hal_strobe strobe;
    /* Private from here on. */
    struct hal_guard_config config;
    struct hal_guard_page *page; /* NULL: there are no guards */
    struct hal_guard_process process[HAL_GUARD_COUNT];
};

/* What config points at lives as long as the guard. */
void hal_guard_init(struct hal_guard *guard, const struct hal_guard_config *config);

/* Tell that this process lives; several times per timeout_ms. Never waits. False: a guard has let
 * go, died or stands still, *error says which: the strobe has to be closed, and may be opened anew.
 * True while the strobe is closed: nothing is guarded then. */
bool hal_guard_feed(struct hal_guard *guard, struct hal_error *error);

/* End who still holds a laser's line: programs and guards of ours, stopped ones too. Ours is who maps
 * the page that is named after the line (hal_guard_page.h) and nobody else: not who has taken the line
 * by other means, nor a program of ours that has another line. What belongs to another user cannot be
 * looked into, and is left alone.
 * SIGKILL for all but this process. How many; -1: *error, /proc or a process number's descriptor is
 * not to be had. */
int hal_guard_end(const char *line_name, struct hal_error *error);

#endif
