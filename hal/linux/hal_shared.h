/* hal_shared - writing to standard output or error without waiting.
 *
 * Both are shared with whoever gave them to us, and O_NONBLOCK would be theirs, too. So the system is
 * asked (poll) and given pieces so small that they fit where it says that there is room: PIPE_BUF
 * bytes for a pipe or socket; for a terminal fewer, and a line's end, which it turns into two
 * characters, on its own. A file never waits. If somebody else fills the same pipe between the
 * question and the piece, that piece waits.
 */
#ifndef HAL_SHARED_H
#define HAL_SHARED_H

#include <sys/types.h>

/* As write() on a descriptor that does not wait: a part may be taken, EAGAIN where nothing is. */
ssize_t hal_shared_write(int descriptor, const char *bytes, size_t count);

#endif
