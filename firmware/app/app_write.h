/* app_write - JSON into memory or wherever the caller puts it, value by value, without white space.
 *
 * The writer only places commas; that brackets and keys pair up is the caller's business. Strings
 * are escaped, and bytes that are no UTF-8 become U+FFFD, since JSON has no way to say them.
 * Memory that is full takes nothing more: ask `full`.
 */
#ifndef APP_WRITE_H
#define APP_WRITE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "app_text.h"

struct app_write {
    /* Takes every piece of text, in order; NULL: memory. */
    void (*take)(void *context, const char *text, size_t length);
    void *context;
    char *memory;
    size_t size, length; /* of memory, and how much of it is written; no closing zero */
    bool full;           /* something did not fit */
    bool comma;          /* the next value needs one before it */
};

/* bracket: '{' or '[', and '}' or ']'. */
void app_write_open(struct app_write *write, char bracket);
void app_write_close(struct app_write *write, char bracket);

/* After the last bracket. */
void app_write_line_end(struct app_write *write);

/* The key of the value that follows; of a plain ASCII name. */
void app_write_key(struct app_write *write, const char *key);

void app_write_int(struct app_write *write, int64_t value);
void app_write_decimal(struct app_write *write, struct app_decimal decimal);
void app_write_bool(struct app_write *write, bool value);
void app_write_null(struct app_write *write);
void app_write_string(struct app_write *write, const char *text);
/* NULL becomes null. */
void app_write_string_or_null(struct app_write *write, const char *text);

/* "key":value. */
void app_write_int_field(struct app_write *write, const char *key, int64_t value);

#endif
