#include "linux/hal_output.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include "linux/hal_shared.h"

static enum hal_sent refuse(struct hal_error *error, const char *text)
{
    hal_fail(error, "%s", text);
    return HAL_SENT_NOT;
}

static bool would_wait(int number)
{
    return number == EAGAIN || number == EWOULDBLOCK;
}

/* As much as is taken at once. Returns errno, 0 when all is gone; *done counts the bytes. */
static int write_some(const struct hal_output_state *state, const char *bytes, size_t count,
                      size_t *done)
{
    *done = 0;
    while (*done < count) {
        ssize_t written = state->owned
                              ? write(state->descriptor, bytes + *done, count - *done)
                              : hal_shared_write(state->descriptor, bytes + *done, count - *done);
        if (written > 0) {
            *done += (size_t)written;
        } else if (written == 0) {
            return EAGAIN;
        } else if (errno != EINTR) {
            return errno;
        }
    }
    return 0;
}

/* What is left of the last record; errno as above. */
static int write_unsent(struct hal_output_state *state)
{
    size_t done = 0;
    int number = write_some(state, state->unsent + state->unsent_start, state->unsent_count, &done);
    state->unsent_start += done;
    state->unsent_count -= done;
    return number;
}

/* A whole record, in part into the rest; errno, 0 when nobody has to hear of it again. */
static int write_record(struct hal_output_state *state, const char *bytes, size_t count)
{
    size_t done = 0;
    int number = state->unsent_count > 0 ? write_unsent(state) : 0;
    if (number != 0) {
        return number;
    }
    number = write_some(state, bytes, count, &done);
    if (done == 0 || number == 0) {
        return number;
    }
    state->unsent_start = 0;
    state->unsent_count = count - done;
    memcpy(state->unsent, bytes + done, state->unsent_count);
    /* What else is wrong shows when the rest is written. */
    return 0;
}

static bool is_too_long(size_t count, struct hal_error *error)
{
    if (count <= HAL_OUTPUT_RECORD_MAX) {
        return false;
    }
    hal_fail(error, "a record of %zu bytes, expected at most %d", count, HAL_OUTPUT_RECORD_MAX);
    return true;
}

static enum hal_sent send_stdout(void *context, const char *bytes, size_t count,
                                 struct hal_error *error)
{
    struct hal_output_state *state = context;
    if (is_too_long(count, error)) {
        return HAL_SENT_NOT;
    }
    int number = write_record(state, bytes, count);
    if (number == 0) {
        return HAL_SENT;
    }
    if (would_wait(number)) {
        return refuse(error, "its reader is slow");
    }
    hal_fail(error, "%s", strerror(number));
    return number == ENOSPC || number == EDQUOT ? HAL_SENT_NOT : HAL_SENT_NEVER;
}

static bool send_datagram(int descriptor, const char *bytes, size_t count)
{
    ssize_t sent = -1;
    do {
        sent = send(descriptor, bytes, count, MSG_DONTWAIT | MSG_NOSIGNAL);
    } while (sent < 0 && errno == EINTR);
    return sent >= 0;
}

/* A network that fails may work again, whatever it says. That nobody listens is said of the datagram
 * before this one, which then is what has been dropped: this one goes out all the same, as somebody
 * may listen by now. */
static enum hal_sent send_udp(void *context, const char *bytes, size_t count,
                              struct hal_error *error)
{
    const struct hal_output_state *state = context;
    if (is_too_long(count, error)) {
        return HAL_SENT_NOT;
    }
    if (send_datagram(state->descriptor, bytes, count)) {
        return HAL_SENT;
    }
    int number = errno;
    if (number == ECONNREFUSED) {
        (void)send_datagram(state->descriptor, bytes, count);
    }
    return refuse(error, strerror(number));
}

static speed_t speed_of(int32_t baud)
{
    static const struct {
        int32_t baud;
        speed_t speed;
    } known[] = {
        {9600, B9600},     {19200, B19200},   {38400, B38400},   {57600, B57600},
        {115200, B115200}, {230400, B230400}, {460800, B460800}, {921600, B921600},
    };
    for (size_t i = 0; i < sizeof known / sizeof known[0]; i++) {
        if (known[i].baud == baud) {
            return known[i].speed;
        }
    }
    return B0;
}

/* Bytes as they are, 8 of 8 bits, whatever the modem lines say. */
static bool make_raw(int descriptor, int32_t baud)
{
    struct termios settings;
    speed_t speed = speed_of(baud);
    if (tcgetattr(descriptor, &settings) != 0) {
        return false;
    }
    settings.c_iflag = IGNBRK | IGNPAR;
    settings.c_oflag = 0;
    settings.c_lflag = 0;
    settings.c_cflag = CS8 | CREAD | CLOCAL;
    return cfsetispeed(&settings, speed) == 0 && cfsetospeed(&settings, speed) == 0 &&
           tcsetattr(descriptor, TCSANOW, &settings) == 0;
}

/* Closing would wait for what the line has not sent yet: half a minute where it stands still. */
static void shut(struct hal_output_state *state)
{
    if (state->descriptor >= 0) {
        (void)tcflush(state->descriptor, TCOFLUSH); /* nothing to do for a datagram */
        close(state->descriptor);
    }
    state->descriptor = -1;
    state->unsent_count = 0;
}

/* Whoever is at the other end may have half a record of before: an empty line ends it. */
static bool open_serial(struct hal_output_state *state, struct hal_error *error)
{
    state->tried_us = state->clock->now_us(state->clock->context);
    state->descriptor = open(state->path, O_WRONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (state->descriptor < 0) {
        return hal_fail(error, "%s: %s", state->path, strerror(errno));
    }
    if (!make_raw(state->descriptor, state->baud)) {
        hal_fail(error, "%s: %s, expected a serial device", state->path, strerror(errno));
        shut(state);
        return false;
    }
    state->unsent[0] = '\n';
    state->unsent_start = 0;
    state->unsent_count = 1;
    return true;
}

static bool reopen_serial(struct hal_output_state *state, struct hal_error *error)
{
    int64_t passed_us = state->clock->now_us(state->clock->context) - state->tried_us;
    if (passed_us < HAL_OUTPUT_REOPEN_US) {
        return hal_fail(error, "%s is gone", state->path);
    }
    return open_serial(state, error);
}

static enum hal_sent send_serial(void *context, const char *bytes, size_t count,
                                 struct hal_error *error)
{
    struct hal_output_state *state = context;
    if (is_too_long(count, error) || (state->descriptor < 0 && !reopen_serial(state, error))) {
        return HAL_SENT_NOT;
    }
    int number = write_record(state, bytes, count);
    if (number == 0) {
        return HAL_SENT;
    }
    if (would_wait(number)) {
        return refuse(error, "the line is slower than the records, or stopped");
    }
    hal_fail(error, "%s: %s", state->path, strerror(number));
    shut(state);
    return HAL_SENT_NOT;
}

static void start(struct hal_output_state *state,
                  enum hal_sent (*send)(void *context, const char *bytes, size_t count,
                                        struct hal_error *error))
{
    memset(state, 0, sizeof *state);
    state->descriptor = -1;
    state->output = (struct hal_output){.context = state, .send = send};
}

bool hal_output_stdout(struct hal_output_state *state, struct hal_error *error)
{
    start(state, send_stdout);
    if (fcntl(STDOUT_FILENO, F_GETFL) < 0) {
        return hal_fail(error, "standard output: %s", strerror(errno));
    }
    signal(SIGPIPE, SIG_IGN);
    state->descriptor = STDOUT_FILENO;
    return true;
}

/* The first of the addresses that can be had. */
static int connect_first(const struct addrinfo *list)
{
    int number = EADDRNOTAVAIL;
    for (const struct addrinfo *at = list; at != NULL; at = at->ai_next) {
        int descriptor = socket(at->ai_family, at->ai_socktype | SOCK_CLOEXEC, at->ai_protocol);
        if (descriptor >= 0 && connect(descriptor, at->ai_addr, at->ai_addrlen) == 0) {
            return descriptor;
        }
        number = errno;
        if (descriptor >= 0) {
            close(descriptor);
        }
    }
    errno = number;
    return -1;
}

bool hal_output_udp(struct hal_output_state *state, const char *host, const char *port,
                    struct hal_error *error)
{
    const struct addrinfo wanted = {.ai_socktype = SOCK_DGRAM, .ai_flags = AI_NUMERICSERV};
    struct addrinfo *list = NULL;
    start(state, send_udp);
    int number = getaddrinfo(host, port, &wanted, &list);
    if (number != 0) {
        return hal_fail(error, "%s port %s: %s", host, port,
                        number == EAI_SYSTEM ? strerror(errno) : gai_strerror(number));
    }
    state->descriptor = connect_first(list);
    if (state->descriptor < 0) {
        hal_fail(error, "%s port %s: %s", host, port, strerror(errno));
    }
    freeaddrinfo(list);
    state->owned = true;
    return state->descriptor >= 0;
}

bool hal_output_serial(struct hal_output_state *state, const char *path, int32_t baud,
                       const struct hal_clock *clock, struct hal_error *error)
{
    start(state, send_serial);
    if (strlen(path) >= sizeof state->path) {
        return hal_fail(error, "a path of %zu bytes, expected at most %d", strlen(path),
                        HAL_OUTPUT_PATH_MAX - 1);
    }
    if (speed_of(baud) == B0) {
        return hal_fail(error, "%d baud, expected 9600, 19200, ... or 921600", (int)baud);
    }
    memcpy(state->path, path, strlen(path) + 1);
    state->baud = baud;
    state->clock = clock;
    state->owned = true;
    return open_serial(state, error);
}

void hal_output_close(struct hal_output_state *state)
{
    if (state->descriptor >= 0 && state->unsent_count > 0) {
        (void)write_unsent(state);
    }
    if (state->owned) {
        shut(state);
    }
    state->descriptor = -1;
}
