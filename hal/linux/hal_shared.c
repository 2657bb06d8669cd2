#include "linux/hal_shared.h"

#include <errno.h>
#include <limits.h>
#include <poll.h>
#include <string.h>
#include <unistd.h>

/* Linux's terminals have buffers of 256 bytes and more: one that has any room takes this. */
#define TERMINAL_PIECE 128

static size_t smaller(size_t a, size_t b)
{
    return a < b ? a : b;
}

/* A terminal asks for room anew after the text before a line's end, and waits if that was the last. */
static size_t terminal_piece(const char *bytes, size_t count)
{
    const char *line_end = memchr(bytes, '\n', count);
    if (line_end != NULL) {
        count = line_end == bytes ? 1 : (size_t)(line_end - bytes);
    }
    return smaller(count, TERMINAL_PIECE);
}

ssize_t hal_shared_write(int descriptor, const char *bytes, size_t count)
{
    struct pollfd requested = {.fd = descriptor, .events = POLLOUT};
    int answers = poll(&requested, 1, 0);
    if (answers <= 0) {
        errno = answers == 0 ? EAGAIN : errno;
        return -1;
    }
    count = isatty(descriptor) ? terminal_piece(bytes, count) : smaller(count, PIPE_BUF);
    return write(descriptor, bytes, count);
}
