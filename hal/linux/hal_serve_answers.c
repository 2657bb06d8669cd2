#include "linux/hal_serve_answers.h"

#include <stdlib.h>

#define OPAQUE "application/octet-stream"

static const unsigned status_of[HAL_SERVE_PLAIN_COUNT] = {
    [HAL_SERVE_NOTHING] = MHD_HTTP_NO_CONTENT,     [HAL_SERVE_FORBIDDEN] = MHD_HTTP_FORBIDDEN,
    [HAL_SERVE_UNKNOWN] = MHD_HTTP_NOT_FOUND,      [HAL_SERVE_METHOD] = MHD_HTTP_METHOD_NOT_ALLOWED,
    [HAL_SERVE_BODY] = MHD_HTTP_CONTENT_TOO_LARGE, [HAL_SERVE_BUSY] = MHD_HTTP_SERVICE_UNAVAILABLE,
};

/* The page may load what is served here and nothing else, may not be framed, leaves no copy and tells
 * nobody the address that has the token in it. */
static const char *const header[][2] = {
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src data:; "
     "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
    {"X-Content-Type-Options", "nosniff"},
    {"X-Frame-Options", "DENY"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cross-Origin-Opener-Policy", "same-origin"},
    {"Cache-Control", "no-store"},
};

static struct MHD_Response *make(const void *bytes, size_t size, enum MHD_ResponseMemoryMode mode,
                                 const char *type)
{
    struct MHD_Response *answer =
        MHD_create_response_from_buffer(size, (void *)(uintptr_t)bytes, mode);
    bool good = answer != NULL;
    for (size_t i = 0; good && i < sizeof header / sizeof header[0]; i++) {
        good = MHD_add_response_header(answer, header[i][0], header[i][1]) == MHD_YES;
    }
    if (good && type != NULL) {
        good = MHD_add_response_header(answer, MHD_HTTP_HEADER_CONTENT_TYPE, type) == MHD_YES;
    }
    if (!good && answer != NULL) {
        MHD_destroy_response(answer);
    }
    return good ? answer : NULL;
}

bool hal_serve_answers_make(struct hal_serve_answers *answers,
                            const struct hal_serve_config *config)
{
    *answers = (struct hal_serve_answers){.frame = NULL};
    for (int i = 0; i < HAL_SERVE_PLAIN_COUNT; i++) {
        answers->plain[i] = make("", 0, MHD_RESPMEM_PERSISTENT, NULL);
        if (answers->plain[i] == NULL) {
            return false;
        }
    }
    for (int i = 0; i < config->asset_count; i++) {
        const struct hal_serve_asset *asset = &config->asset[i];
        answers->asset[i] = make(asset->bytes, asset->size, MHD_RESPMEM_PERSISTENT, asset->type);
        if (answers->asset[i] == NULL) {
            return false;
        }
    }
    return MHD_add_response_header(answers->plain[HAL_SERVE_METHOD], MHD_HTTP_HEADER_ALLOW,
                                   MHD_HTTP_METHOD_GET) == MHD_YES;
}

bool hal_serve_answers_frame(struct hal_serve_answers *answers, void *bytes, size_t size)
{
    if (answers->frame != NULL) {
        MHD_destroy_response(answers->frame); /* once it has been sent to the last who gets it */
    }
    answers->frame = make(bytes, size, MHD_RESPMEM_MUST_FREE, OPAQUE);
    return answers->frame != NULL;
}

enum MHD_Result hal_serve_plain(const struct hal_serve_answers *answers,
                                struct MHD_Connection *connection, enum hal_serve_plain which)
{
    return MHD_queue_response(connection, status_of[which], answers->plain[which]);
}
