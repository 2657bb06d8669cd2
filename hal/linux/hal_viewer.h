/* hal_viewer - frames for whoever looks at them in a browser, by a process of its own.
 *
 * In:    an address and a port, room for one content (hal_mailbox), the program that serves it.
 * Out:   a hal_viewer: the loop asks it per frame, and copies a frame only when somebody waits for one.
 *
 * Why a process and not a thread: what reads from the network must not be able to touch the laser or
 * to stop the loop, whatever is wrong with it. A thread's fault would end this process, and its memory
 * is ours. This one shares a mailbox with us and nothing else; what libraries it needs are not loaded
 * here. It is another program, not a copy of this one: it has no handler, no camera's buffer and no
 * descriptor of ours. Started before laser and camera are opened, it never sees them.
 * The process: listening socket, mailbox and one end of a socket pair at fixed numbers, /dev/null as
 *        standard streams, every signal blocked, killed by the kernel when this process dies, and
 *        further confined by itself (hal_jail.h). It stays in our session: with a session of its own the
 *        kernel's grouping by session would give it as much of the processor as us.
 * When it has died: ask says so once, then that nobody is looking. It is not started again.
 * Cost:  of ask, one system call and one look at the mailbox.
 */
#ifndef HAL_VIEWER_H
#define HAL_VIEWER_H

#include <sys/types.h>

#include "hal.h"
#include "linux/hal_mailbox.h"

/* Where the program finds what it is given. */
#define HAL_VIEWER_SOCKET_FD 3
#define HAL_VIEWER_LISTEN_FD 4
#define HAL_VIEWER_MAILBOX_FD 5

/* What is said on the socket pair: by the program once it serves, or what is wrong instead; then by
 * us per content. */
#define HAL_VIEWER_READY "ready"
#define HAL_VIEWER_FILLED "filled"

/* From the folder of the program that is running. */
#define HAL_VIEWER_PROGRAM "../lib/isohead/isohead_live"

/* Longest wait for it to begin. */
#define HAL_VIEWER_START_MS 5000
/* Connections that wait to be accepted; what the system allows may be less. */
#define HAL_VIEWER_BACKLOG 1024

#define HAL_VIEWER_URL_MAX 160

struct hal_viewer_config {
    const char *program; /* NULL: HAL_VIEWER_PROGRAM */
    const char *host;    /* a numeric address, IPv6 without brackets */
    const char *port;    /* decimal; 0: any that is free */
    size_t content_size; /* bytes */
};

struct hal_viewer_process {
    struct hal_viewer viewer;
    char url[HAL_VIEWER_URL_MAX]; /* with the token: who knows it may look */
    bool is_local;                /* reached from this machine only */
    /* Private from here on. */
    struct hal_mailbox mailbox;
    int socket_fd; /* -1: there is no process */
    pid_t pid;
};

/* False: *error, and nothing is left of it. */
bool hal_viewer_open(struct hal_viewer_process *process, const struct hal_viewer_config *config,
                     struct hal_error *error);

/* Kills the process, and does not wait for its end, which on a busy processor may take long; the system
 * buries it after ours. Closed already: nothing happens. */
void hal_viewer_close(struct hal_viewer_process *process);

#endif
