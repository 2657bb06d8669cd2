/* hal_output - records to standard output, a UDP receiver or a serial device, without ever waiting.
 *
 * A record leaves whole or not at all. A stream may take a part of one: the rest is kept here and
 * goes first at the next call; until it is gone newer records are refused, so that a slow reader
 * gets whole and recent ones. A UDP datagram is one record. Where the receiver's machine says that
 * nobody listens, it says so of the datagram before: HAL_SENT_NOT then stands for that one, and the
 * new one is on its way; the first one that somebody hears is no longer lost.
 *
 * Standard output is shared with others, so it is not made non-blocking (hal_shared).
 *
 * A serial device is raw, 8 bits, no parity, no flow control. When it is gone it is opened again, at
 * most once a second. Whenever it is opened sending starts with an empty line, as the last record of
 * before may be cut: what the device has not sent by the time that it is closed is thrown away.
 *
 * Error: HAL_SENT_NOT has its reason in *error too. HAL_SENT_NEVER only from standard output: its
 *        reader has gone, it is closed or broken. HAL_SENT does not say that it has arrived.
 * SIGPIPE is ignored from hal_output_stdout on, for the whole process.
 */
#ifndef HAL_OUTPUT_H
#define HAL_OUTPUT_H

#include <sys/types.h>

#include "hal.h"

/* Longest record: what fits into a UDP datagram; the same for all. */
#define HAL_OUTPUT_RECORD_MAX 65507
/* Longest path of a serial device, its closing zero included. */
#define HAL_OUTPUT_PATH_MAX 256
#define HAL_OUTPUT_REOPEN_US 1000000

struct hal_output_state {
    struct hal_output output; /* the table; after one of the three functions below */
    int descriptor;           /* -1: none */
    bool owned;               /* not standard output: non-blocking, and to be closed */
    /* The rest of a record that is on its way. */
    char unsent[HAL_OUTPUT_RECORD_MAX];
    size_t unsent_start, unsent_count;
    /* Serial. */
    char path[HAL_OUTPUT_PATH_MAX];
    int32_t baud;
    const struct hal_clock *clock;
    int64_t tried_us;
};

/* Each fills state->output; the state must stay where it is. False: *error. */

bool hal_output_stdout(struct hal_output_state *state, struct hal_error *error);

/* host: a name or address; port: a number. The name is looked up once, which may take its time. */
bool hal_output_udp(struct hal_output_state *state, const char *host, const char *port,
                    struct hal_error *error);

/* baud: 9600, 19200, 38400, 57600, 115200, 230400, 460800 or 921600. */
bool hal_output_serial(struct hal_output_state *state, const char *path, int32_t baud,
                       const struct hal_clock *clock, struct hal_error *error);

/* What is still kept goes out if that is possible at once; see above for a serial device. */
void hal_output_close(struct hal_output_state *state);

#endif
