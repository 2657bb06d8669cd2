/* hal_text - text put together piece by piece, without the C library: where there is none, messages and
 * numbers look the same.
 *
 * What does not fit is cut off; the text always ends with a zero byte.
 */
#ifndef HAL_TEXT_H
#define HAL_TEXT_H

#include <stddef.h>
#include <stdint.h>

struct hal_text {
    char *text;    /* the caller's memory */
    size_t size;   /* of it, at least 1 */
    size_t length; /* of the text, without its zero byte */
};

struct hal_text hal_text_begin(char *memory, size_t size);

void hal_text_put(struct hal_text *to, const char *text);
void hal_text_put_some(struct hal_text *to, const char *bytes, size_t count);

/* In decimal, with a minus sign where it is negative; at least digits digits. */
void hal_text_put_number(struct hal_text *to, int64_t number, int digits);

/* So many of the lowest hexadecimal digits, small letters. */
void hal_text_put_hex(struct hal_text *to, uint64_t number, int digits);

/* Without strlen, which is more of the C library than memcpy and its kin. */
size_t hal_text_length(const char *text);

#endif
