/* hal_serve_answers - what hal_serve can answer: made once, but for frames. */
#ifndef HAL_SERVE_ANSWERS_H
#define HAL_SERVE_ANSWERS_H

#include <microhttpd.h>

#include "linux/hal_serve.h"

#define HAL_SERVE_ASSETS_MAX 8

/* The answers without content. */
enum hal_serve_plain {
    HAL_SERVE_NOTHING,   /* 204 */
    HAL_SERVE_FORBIDDEN, /* 403 */
    HAL_SERVE_UNKNOWN,   /* 404 */
    HAL_SERVE_METHOD,    /* 405 */
    HAL_SERVE_BODY,      /* 413 */
    HAL_SERVE_BUSY,      /* 503 */
    HAL_SERVE_PLAIN_COUNT
};

struct hal_serve_answers {
    struct MHD_Response *plain[HAL_SERVE_PLAIN_COUNT];
    struct MHD_Response *asset[HAL_SERVE_ASSETS_MAX];
    struct MHD_Response *frame; /* the newest; NULL: none yet */
};

/* False: no memory. */
bool hal_serve_answers_make(struct hal_serve_answers *answers,
                            const struct hal_serve_config *config);

/* The newest frame from now on. What is still being sent of others goes on. bytes: from malloc, the
 * answer's from now on. False: no memory, and there is no newest one. */
bool hal_serve_answers_frame(struct hal_serve_answers *answers, void *bytes, size_t size);

enum MHD_Result hal_serve_plain(const struct hal_serve_answers *answers,
                                struct MHD_Connection *connection, enum hal_serve_plain which);

#endif
