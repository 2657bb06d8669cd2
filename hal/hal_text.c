#include "hal_text.h"

#include <string.h>

/* Of 64 bits. */
#define DIGITS_MAX 20

struct hal_text hal_text_begin(char *memory, size_t size)
{
    memory[0] = 0;
    return (struct hal_text){.text = memory, .size = size, .length = 0};
}

size_t hal_text_length(const char *text)
{
    size_t length = 0;
    while (text[length] != 0) {
        length++;
    }
    return length;
}

void hal_text_put_some(struct hal_text *to, const char *bytes, size_t count)
{
    size_t room = to->size - 1 - to->length;
    if (count > room) {
        count = room;
    }
    memcpy(to->text + to->length, bytes, count);
    to->length += count;
    to->text[to->length] = 0;
}

void hal_text_put(struct hal_text *to, const char *text)
{
    hal_text_put_some(to, text, hal_text_length(text));
}

void hal_text_put_number(struct hal_text *to, int64_t number, int digits)
{
    char digit[DIGITS_MAX];
    int at = DIGITS_MAX;
    uint64_t remaining = number < 0 ? (uint64_t) - (number + 1) + 1 : (uint64_t)number;
    if (number < 0) {
        hal_text_put(to, "-");
    }
    while (remaining > 0 || (at > DIGITS_MAX - digits && at > 0)) {
        digit[--at] = (char)('0' + remaining % 10);
        remaining /= 10;
    }
    hal_text_put_some(to, digit + at, (size_t)(DIGITS_MAX - at));
}

void hal_text_put_hex(struct hal_text *to, uint64_t number, int digits)
{
    for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) {
        hal_text_put_some(to, &"0123456789abcdef"[number >> shift & 15], 1);
    }
}
