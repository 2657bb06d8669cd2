/* sim_write - JSON onto a stream, value by value, without white space.
 *
 * The writer only places commas; that brackets and keys pair up is the caller's business. Strings
 * are escaped, and bytes that are no UTF-8 become U+FFFD, since JSON has no way to say them.
 * Write errors stay in the stream: ask ferror or fclose at the end.
 */
#ifndef SIM_WRITE_H
#define SIM_WRITE_H

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

#include "sim_text.h"

struct sim_write {
    FILE *file;
    bool comma; /* the next value needs one before it */
};

/* bracket: '{' or '[', and '}' or ']'. */
void sim_write_open(struct sim_write *write, char bracket);
void sim_write_close(struct sim_write *write, char bracket);

/* The key of the value that follows; of a plain ASCII name. */
void sim_write_key(struct sim_write *write, const char *key);

void sim_write_int(struct sim_write *write, int64_t value);
void sim_write_decimal(struct sim_write *write, struct sim_decimal decimal);
void sim_write_bool(struct sim_write *write, bool value);
void sim_write_null(struct sim_write *write);
void sim_write_string(struct sim_write *write, const char *text);
/* NULL becomes null. */
void sim_write_string_or_null(struct sim_write *write, const char *text);

/* "key":value. */
void sim_write_int_field(struct sim_write *write, const char *key, int64_t value);

#endif
