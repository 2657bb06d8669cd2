/* hal_log - messages to standard error or to syslog, without ever waiting.
 *
 * Standard error: "isohead_board: TEXT"; where it leads to systemd's journal (JOURNAL_STREAM names
 * it) "<LEVEL>TEXT", which the journal understands. Syslog: a datagram to /dev/log, facility daemon.
 * The C library's syslog() would wait for a daemon that hangs; here the message goes to standard
 * error instead, and if that takes none either it is counted and the next one that gets through
 * says so. A terminal that is stuck may take a part of one.
 *
 * SIGPIPE is ignored from hal_log_open on, for the whole process.
 */
#ifndef HAL_LOG_H
#define HAL_LOG_H

#include "hal.h"

struct hal_log_writer {
    const char *program;
    bool journal;            /* standard error leads there */
    const char *socket_path; /* of syslog; NULL: standard error */
    int descriptor;          /* of the socket; -1: none */
    int64_t dropped_count;
};

/* socket_path: NULL for standard error, else where syslog listens, HAL_LOG_SYSLOG. Cannot fail: a
 * daemon that is not there may come. */
#define HAL_LOG_SYSLOG "/dev/log"
void hal_log_open(struct hal_log_writer *writer, const char *program, const char *socket_path);
void hal_log_close(struct hal_log_writer *writer);

/* A line without its end; context: the writer. level: syslog's, 3 error, 4 warning, 6 information. */
void hal_log_write(void *context, int level, const char *text);

#endif
