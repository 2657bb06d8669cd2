#include "linux/hal_serve.h"

#include <errno.h>
#include <poll.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>

#include "linux/hal_jail.h"
#include "linux/hal_mailbox.h"
#include "linux/hal_serve_answers.h"
#include "linux/hal_viewer.h"

/* Between two looks at who has had his time. */
#define LOOK_MS 250
#define SLOTS (HAL_SERVE_CONNECTIONS + HAL_SERVE_STRANGERS)
/* Strangers who make room at a time, and turns of the library in which each could have been read before; what he sends is
 * on its way for some time, too. */
#define ROOM 8
#define LOOKS_MIN 2
#define ROOM_MS 250
/* Between two turns when all slots are taken, as somebody may wait. */
#define FULL_MS 10
#define FRAME_NAME "frame"

enum visit {
    VISIT_FREE,  /* nobody */
    VISIT_OPEN,  /* asks, or is being answered: until end_ms */
    VISIT_WAIT,  /* for a frame: until end_ms */
    VISIT_FRAME, /* there is one, or he has waited too long for it: has_frame */
    VISIT_CUT    /* the library has not found it closed yet */
};

struct visitor {
    enum visit visit;
    bool has_frame;
    bool is_known;  /* has shown the token */
    int look_count; /* turns of the library since he came, up to LOOKS_MIN */
    int64_t end_ms;
    int fd;
    struct MHD_Connection *connection;
};

struct serve {
    const struct hal_serve_config *config;
    struct hal_mailbox mailbox;
    struct hal_serve_answers answers;
    struct MHD_Daemon *daemon;
    struct visitor visitor[SLOTS];
    int known_count;
    bool is_full;
};

static int64_t now_ms(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

/* --- one request --- */

/* The name behind the token; NULL: not with this token. Every digit is looked at, whatever the others
 * are. */
static const char *behind_token(const struct serve *serve, const char *url)
{
    const char *token = hal_mailbox_token(&serve->mailbox);
    size_t length = url[0] == '/' ? strcspn(url + 1, "/") : 0;
    unsigned differ = length == HAL_MAILBOX_TOKEN ? 0 : 1;
    for (size_t i = 0; i < HAL_MAILBOX_TOKEN; i++) {
        differ |= (unsigned char)token[i] ^ (unsigned char)(i < length ? url[1 + i] : 0);
    }
    return differ == 0 && url[1 + length] == '/' ? url + 1 + length + 1 : NULL;
}

static bool has_body(struct MHD_Connection *connection)
{
    const char *length =
        MHD_lookup_connection_value(connection, MHD_HEADER_KIND, MHD_HTTP_HEADER_CONTENT_LENGTH);
    return (length != NULL && strcmp(length, "0") != 0) ||
           MHD_lookup_connection_value(connection, MHD_HEADER_KIND,
                                       MHD_HTTP_HEADER_TRANSFER_ENCODING) != NULL;
}

static enum MHD_Result answer_asset(const struct serve *serve, struct MHD_Connection *connection,
                                    const char *name)
{
    for (int i = 0; i < serve->config->asset_count; i++) {
        if (strcmp(serve->config->asset[i].name, name) == 0) {
            return MHD_queue_response(connection, MHD_HTTP_OK, serve->answers.asset[i]);
        }
    }
    return hal_serve_plain(&serve->answers, connection, HAL_SERVE_UNKNOWN);
}

static enum MHD_Result answer_frame(const struct serve *serve, struct visitor *visitor)
{
    visitor->visit = VISIT_OPEN;
    visitor->end_ms = now_ms() + HAL_SERVE_REQUEST_MS;
    if (!visitor->has_frame || serve->answers.frame == NULL) {
        return hal_serve_plain(&serve->answers, visitor->connection, HAL_SERVE_NOTHING);
    }
    return MHD_queue_response(visitor->connection, MHD_HTTP_OK, serve->answers.frame);
}

static enum MHD_Result wait_for_frame(const struct serve *serve, struct visitor *visitor)
{
    visitor->visit = VISIT_WAIT;
    visitor->end_ms = now_ms() + HAL_SERVE_PATIENCE_MS;
    MHD_suspend_connection(visitor->connection);
    hal_mailbox_want(&serve->mailbox);
    return MHD_YES;
}

static enum MHD_Result answer_name(struct serve *serve, struct visitor *visitor, const char *url)
{
    const char *name = behind_token(serve, url);
    if (name == NULL) {
        return hal_serve_plain(&serve->answers, visitor->connection, HAL_SERVE_FORBIDDEN);
    }
    if (!visitor->is_known && serve->known_count == HAL_SERVE_CONNECTIONS) {
        return hal_serve_plain(&serve->answers, visitor->connection, HAL_SERVE_BUSY);
    }
    serve->known_count += !visitor->is_known;
    visitor->is_known = true;
    visitor->end_ms = now_ms() + HAL_SERVE_REQUEST_MS;
    return strcmp(name, FRAME_NAME) == 0 ? wait_for_frame(serve, visitor)
                                         : answer_asset(serve, visitor->connection, name);
}

/* Called with the header of a request, where an answer means that the rest is not wanted and the
 * connection ends with it; once more at its end; and again when it goes on after it has waited. */
static enum MHD_Result
answer(void *context, struct MHD_Connection *connection, const char *url, const char *method,
       const char *version, const char *upload,
       /* NOLINTNEXTLINE(readability-non-const-parameter): the library's type */
       size_t *upload_size, void **request)
{
    struct serve *serve = context;
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    struct visitor *visitor = info == NULL ? NULL : info->socket_context;
    (void)version, (void)upload, (void)upload_size;
    if (visitor == NULL) {
        return MHD_NO; /* cuts the connection */
    }
    if (strcmp(method, MHD_HTTP_METHOD_GET) != 0) {
        return hal_serve_plain(&serve->answers, connection, HAL_SERVE_METHOD);
    }
    if (has_body(connection)) {
        return hal_serve_plain(&serve->answers, connection, HAL_SERVE_BODY);
    }
    if (*request == NULL) {
        *request = visitor;
        return MHD_YES;
    }
    return visitor->visit == VISIT_FRAME ? answer_frame(serve, visitor)
                                         : answer_name(serve, visitor, url);
}

/* --- connections --- */

/* The library finds it closed. */
static void cut(struct visitor *visitor)
{
    visitor->visit = VISIT_CUT;
    shutdown(visitor->fd, SHUT_RDWR);
}

/* The one who has not shown the token for longest, though the library had its chance to read what he sent: NULL for none. */
static struct visitor *oldest_stranger(struct serve *serve)
{
    struct visitor *oldest = NULL;
    const int64_t limit_ms = now_ms() + HAL_SERVE_TOKEN_MS - ROOM_MS;
    for (int i = 0; i < SLOTS; i++) {
        struct visitor *visitor = &serve->visitor[i];
        const bool may_go = visitor->visit == VISIT_OPEN && !visitor->is_known &&
                            visitor->look_count >= LOOKS_MIN && visitor->end_ms <= limit_ms;
        if (may_go && (oldest == NULL || visitor->end_ms < oldest->end_ms)) {
            oldest = visitor;
        }
    }
    return oldest;
}

/* When all slots are taken the library accepts nobody: then strangers make room for who waits. */
static void make_room(struct serve *serve)
{
    int taken_count = 0;
    for (int i = 0; i < SLOTS; i++) {
        struct visitor *visitor = &serve->visitor[i];
        taken_count += visitor->visit != VISIT_FREE;
        visitor->look_count += visitor->look_count < LOOKS_MIN;
    }
    serve->is_full = taken_count == SLOTS;
    for (int i = 0; i < ROOM && serve->is_full; i++) {
        struct visitor *oldest = oldest_stranger(serve);
        if (oldest != NULL) {
            cut(oldest);
        }
    }
}

static void begin_visit(struct visitor *visitor, int fd, struct MHD_Connection *connection)
{
    *visitor = (struct visitor){.visit = VISIT_OPEN,
                                .end_ms = now_ms() + HAL_SERVE_TOKEN_MS,
                                .fd = fd,
                                .connection = connection};
}

static void end_visit(struct serve *serve, struct visitor *visitor)
{
    serve->known_count -= visitor->is_known;
    *visitor = (struct visitor){.visit = VISIT_FREE};
}

static void note_connection(void *context, struct MHD_Connection *connection, void **socket_context,
                            enum MHD_ConnectionNotificationCode code)
{
    struct serve *serve = context;
    if (code == MHD_CONNECTION_NOTIFY_CLOSED) {
        struct visitor *gone = *socket_context;
        if (gone != NULL) {
            end_visit(serve, gone);
        }
        return;
    }
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_CONNECTION_FD);
    *socket_context = NULL;
    for (int i = 0; i < SLOTS && info != NULL; i++) {
        if (serve->visitor[i].visit == VISIT_FREE) {
            begin_visit(&serve->visitor[i], info->connect_fd, connection);
            *socket_context = &serve->visitor[i];
            return;
        }
    }
}

static void note_answered(void *context, struct MHD_Connection *connection, void **request,
                          enum MHD_RequestTerminationCode code)
{
    const union MHD_ConnectionInfo *info =
        MHD_get_connection_info(connection, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
    (void)context, (void)request, (void)code;
    struct visitor *visitor = info == NULL ? NULL : info->socket_context;
    if (visitor != NULL && visitor->is_known && visitor->visit != VISIT_CUT) {
        visitor->visit = VISIT_OPEN;
        visitor->end_ms = now_ms() + HAL_SERVE_REQUEST_MS;
    }
}

static void go_on(struct visitor *visitor, bool has_frame)
{
    visitor->visit = VISIT_FRAME;
    visitor->has_frame = has_frame;
    MHD_resume_connection(visitor->connection);
}

/* Who has had his time. */
static void look_around(struct serve *serve)
{
    int64_t time_ms = now_ms();
    for (int i = 0; i < SLOTS; i++) {
        struct visitor *visitor = &serve->visitor[i];
        if (time_ms < visitor->end_ms) {
            continue;
        }
        if (visitor->visit == VISIT_WAIT) {
            go_on(visitor, false);
        } else if (visitor->visit == VISIT_OPEN) {
            cut(visitor);
        }
    }
}

/* --- frames --- */

/* If the loop wants to go on it does so now, and not at the next tick. */
static void yield_to_loop(void)
{
    sched_yield();
}

/* The loop has filled the mailbox. */
static void take_frame(struct serve *serve)
{
    void *content = hal_mailbox_content(&serve->mailbox);
    if (content == NULL) {
        return;
    }
    size_t room = serve->mailbox.content_size + serve->config->answer_more;
    unsigned char *bytes = malloc(room);
    size_t size = 0;
    if (bytes != NULL) {
        size =
            serve->config->write(content, serve->mailbox.content_size, bytes, room, yield_to_loop);
    }
    hal_mailbox_done(&serve->mailbox);
    bool has_frame = bytes != NULL && hal_serve_answers_frame(&serve->answers, bytes, size);
    for (int i = 0; i < SLOTS; i++) {
        if (serve->visitor[i].visit == VISIT_WAIT) {
            go_on(&serve->visitor[i], has_frame && size > 0);
        }
    }
}

/* False: the other process has ended. */
static bool listen_to_loop(struct serve *serve)
{
    char text[sizeof HAL_VIEWER_FILLED];
    ssize_t count = recv(HAL_VIEWER_SOCKET_FD, text, sizeof text, MSG_DONTWAIT);
    if (count > 0) {
        take_frame(serve);
    }
    return count > 0 || (count < 0 && (errno == EAGAIN || errno == EINTR));
}

static int wait_ms(const struct serve *serve)
{
    MHD_UNSIGNED_LONG_LONG library_ms = 0;
    const int own_ms = serve->is_full ? FULL_MS : LOOK_MS;
    bool has_limit = MHD_get_timeout(serve->daemon, &library_ms) == MHD_YES;
    return has_limit && (int64_t)library_ms < own_ms ? (int)library_ms : own_ms;
}

static int serve_until_end(struct serve *serve)
{
    const union MHD_DaemonInfo *info = MHD_get_daemon_info(serve->daemon, MHD_DAEMON_INFO_EPOLL_FD);
    struct pollfd waiting[] = {{.fd = HAL_VIEWER_SOCKET_FD, .events = POLLIN},
                               {.fd = info->epoll_fd, .events = POLLIN}};
    for (;;) {
        poll(waiting, 2, wait_ms(serve));
        if (!listen_to_loop(serve)) {
            return 0;
        }
        MHD_run(serve->daemon);
        look_around(serve);
        make_room(serve);
    }
}

/* --- the beginning --- */

static void report_start(const char *text)
{
    send(HAL_VIEWER_SOCKET_FD, text, strlen(text), MSG_NOSIGNAL);
}

static bool begin(struct serve *serve, struct hal_error *error)
{
    if (serve->config->asset_count > HAL_SERVE_ASSETS_MAX) {
        return hal_fail(error, "%d files to be served, expected at most %d",
                        serve->config->asset_count, HAL_SERVE_ASSETS_MAX);
    }
    if (!hal_mailbox_open(&serve->mailbox, HAL_VIEWER_MAILBOX_FD, error)) {
        return false;
    }
    if (!hal_serve_answers_make(&serve->answers, serve->config)) {
        return hal_fail(error, "no memory for the answers");
    }
    serve->daemon =
        MHD_start_daemon(MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME, 0, NULL, NULL, answer, serve,
                         MHD_OPTION_LISTEN_SOCKET, HAL_VIEWER_LISTEN_FD,                    /* */
                         MHD_OPTION_CONNECTION_LIMIT, (unsigned)SLOTS,                      /* */
                         MHD_OPTION_CONNECTION_MEMORY_LIMIT, (size_t)HAL_SERVE_REQUEST_MAX, /* */
                         MHD_OPTION_NOTIFY_CONNECTION, note_connection, serve,              /* */
                         MHD_OPTION_NOTIFY_COMPLETED, note_answered, serve, MHD_OPTION_END);
    if (serve->daemon == NULL) {
        return hal_fail(error, "libmicrohttpd does not start");
    }
    return hal_jail_enter(error);
}

int hal_serve_run(const struct hal_serve_config *config)
{
    struct hal_error error;
    static struct serve serve; /* for as long as the process lives */
    serve.config = config;
    if (!begin(&serve, &error)) {
        report_start(error.text);
        return 1;
    }
    report_start(HAL_VIEWER_READY);
    return serve_until_end(&serve);
}
