/* hal_serve - a few fixed files and the newest frame over HTTP, for whoever knows the token.
 *
 * The other side of hal_viewer, in a program of its own: its descriptors are those of hal_viewer.h.
 * GET /TOKEN/NAME gives the asset of that name, GET /TOKEN/frame the next frame: the request waits
 * until the loop has put one into the mailbox, and a frame answers all that wait by then. So a slow
 * link gets fewer frames and not older ones, and a frame that nobody waits for is never copied.
 * Answers: 200; 204 where no frame came for HAL_SERVE_PATIENCE_MS; 403 whatever is asked without the
 *        right token, which is compared in a time that does not depend on it; 404 any other name; 405
 *        any other method; 413 a request with a body; 503 when HAL_SERVE_CONNECTIONS have shown the
 *        token. libmicrohttpd itself refuses what is no HTTP, and a request line and header longer than
 *        HAL_SERVE_REQUEST_MAX.
 * Limits: a connection that has shown the token keeps its slot, HAL_SERVE_CONNECTIONS of them at a time.
 *        From the last answer its request has HAL_SERVE_REQUEST_MS to be asked whole and answered
 *        whole, its waiting for a frame not counted: then the connection is cut, at whatever pace its
 *        bytes drip. Others have HAL_SERVE_TOKEN_MS to show it, and HAL_SERVE_STRANGERS slots at least.
 *        When all slots are taken those of them that came first are cut, after a quarter of a second in which
 *        what they sent could come and be read, so that newcomers get in: who holds connections without the
 *        token keeps nobody out.
 *        Those who wait to be accepted stand in the system's queue, HAL_VIEWER_BACKLOG long.
 * Memory: an answer per frame, shared by all that get it, so at most one more than connections.
 * The processor: whoever is let go on by the kernel's clock keeps the processor until its next tick, up
 *        to 10 ms later, as unimportant as he may be. So the work on a frame is done in short pieces, each
 *        followed by asking whether somebody else wants to (sched_yield): on a board with one processor
 *        that is what the loop may have to wait.
 * One thread. Before a byte from outside is read the process goes to jail (hal_jail.h).
 * Library: libmicrohttpd.
 */
#ifndef HAL_SERVE_H
#define HAL_SERVE_H

#include "hal.h"

#define HAL_SERVE_CONNECTIONS 8
#define HAL_SERVE_STRANGERS 16
/* Of a connection's memory: the request, and the header of its answer. */
#define HAL_SERVE_REQUEST_MAX 4096
#define HAL_SERVE_REQUEST_MS 10000
#define HAL_SERVE_TOKEN_MS 3000
#define HAL_SERVE_PATIENCE_MS 3000

struct hal_serve_asset {
    const char *name; /* "": of the folder itself */
    const char *type; /* as in Content-Type */
    const void *bytes;
    size_t size;
};

struct hal_serve_config {
    const struct hal_serve_asset *asset;
    int asset_count;
    /* The answer from a content of the mailbox, which may be changed. Its length; 0: it has none. It
     * calls yield_to_loop() about every 100 us. */
    size_t (*write)(void *content, size_t content_size, unsigned char *answer, size_t size,
                    void (*yield_to_loop)(void));
    size_t answer_more; /* most bytes that an answer has more than a content */
};

/* Until the other process ends. What is wrong before it can serve is reported to that one. The exit status. */
int hal_serve_run(const struct hal_serve_config *config);

#endif
