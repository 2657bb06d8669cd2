/* hal_mailbox - one piece of memory between two processes, handed to and fro without a lock.
 *
 * The writer is the program that has the laser; the reader is trusted with nothing. There is room for
 * one content, and it belongs to one side at a time:
 *
 *     IDLE --reader: want--> WANTED --writer: fill--> FULL --reader: done--> IDLE
 *
 * so that neither ever waits, and a side that dies leaves the other with "nothing to do". The writer
 * reads nothing from this memory but that state: whatever a broken reader writes into it, the worst is
 * a copy of a frame that nobody looks at.
 * Memory: a sealed memory file: the reader cannot make it smaller, which would be a SIGBUS for the
 *         writer, and all of it is there from the beginning, so that writing never finds memory full.
 */
#ifndef HAL_MAILBOX_H
#define HAL_MAILBOX_H

#include "hal.h"

/* Hexadecimal digits of what a request has to know: 128 bits. */
#define HAL_MAILBOX_TOKEN 32

/* Most bytes of a content. All of it is taken at once, and asking the kernel for more than there is ends
 * other programs, not this one: so it is refused before it is asked for. */
#define HAL_MAILBOX_CONTENT_MAX (16 * 1024 * 1024)

struct hal_mailbox_shared; /* what both see */

struct hal_mailbox {
    int fd;              /* of the memory; -1: closed */
    size_t content_size; /* bytes; as agreed at the beginning, not as the memory says */
    size_t mapped_size;
    struct hal_mailbox_shared *shared;
};

/* --- the writer --- */

/* With a new token from the system's random numbers. fd is not inherited by other programs. */
bool hal_mailbox_create(struct hal_mailbox *mailbox, size_t content_size, struct hal_error *error);

/* Where the next content goes, if the reader wants one; else NULL. Never waits. */
void *hal_mailbox_room(const struct hal_mailbox *mailbox);

/* The room is filled: from now on it is the reader's. */
void hal_mailbox_fill(const struct hal_mailbox *mailbox);

/* --- the reader --- */

/* What was created elsewhere; fd is the mailbox's from now on. */
bool hal_mailbox_open(struct hal_mailbox *mailbox, int fd, struct hal_error *error);

/* One content more, when there is one. Asked already: nothing happens. */
void hal_mailbox_want(const struct hal_mailbox *mailbox);

/* The content, which stays as it is until done; NULL: there is none. It may be written to. */
void *hal_mailbox_content(const struct hal_mailbox *mailbox);
void hal_mailbox_done(const struct hal_mailbox *mailbox);

/* --- both --- */

/* HAL_MAILBOX_TOKEN digits and a zero. */
const char *hal_mailbox_token(const struct hal_mailbox *mailbox);

/* Closed already: nothing happens. */
void hal_mailbox_close(struct hal_mailbox *mailbox);

#endif
