#include "app_write.h"

#include <string.h>

#include "hal_text.h"

static void put(struct app_write *write, const char *text, size_t length)
{
    if (write->take != NULL) {
        write->take(write->context, text, length);
        return;
    }
    /* Once full it stays so: a text that ends early is better than one with a hole. */
    write->full = write->full || length > write->size - write->length;
    if (!write->full) {
        memcpy(write->memory + write->length, text, length);
        write->length += length;
    }
}

static void put_text(struct app_write *write, const char *text)
{
    put(write, text, hal_text_length(text));
}

static void put_char(struct app_write *write, char letter)
{
    put(write, &letter, 1);
}

static void separate(struct app_write *write)
{
    if (write->comma) {
        put_char(write, ',');
    }
    write->comma = true;
}

void app_write_open(struct app_write *write, char bracket)
{
    separate(write);
    put_char(write, bracket);
    write->comma = false;
}

void app_write_close(struct app_write *write, char bracket)
{
    put_char(write, bracket);
    write->comma = true;
}

void app_write_line_end(struct app_write *write)
{
    put_char(write, '\n');
    write->comma = false;
}

void app_write_key(struct app_write *write, const char *key)
{
    separate(write);
    put_char(write, '"');
    put_text(write, key);
    put_text(write, "\":");
    write->comma = false;
}

void app_write_int(struct app_write *write, int64_t value)
{
    separate(write);
    char memory[sizeof "-9223372036854775808"];
    struct hal_text text = hal_text_begin(memory, sizeof memory);
    hal_text_put_number(&text, value, 1);
    put(write, text.text, text.length);
}

void app_write_decimal(struct app_write *write, struct app_decimal decimal)
{
    separate(write);
    put_text(write, decimal.text);
}

void app_write_bool(struct app_write *write, bool value)
{
    separate(write);
    put_text(write, value ? "true" : "false");
}

void app_write_null(struct app_write *write)
{
    separate(write);
    put_text(write, "null");
}

/* Length of the UTF-8 sequence at text, 0 when it is none: overlong forms, surrogates and code
 * points beyond U+10FFFF are refused. Reads no further than the closing zero. */
static int utf8_length(const unsigned char *text)
{
    unsigned char lead = text[0];
    int length = 0;
    unsigned char second_min = 0x80;
    unsigned char second_max = 0xbf;
    if (lead < 0x80) {
        return 1;
    }
    if (lead >= 0xc2 && lead <= 0xdf) {
        length = 2;
    } else if (lead >= 0xe0 && lead <= 0xef) {
        length = 3;
        second_min = lead == 0xe0 ? 0xa0 : 0x80;
        second_max = lead == 0xed ? 0x9f : 0xbf;
    } else if (lead >= 0xf0 && lead <= 0xf4) {
        length = 4;
        second_min = lead == 0xf0 ? 0x90 : 0x80;
        second_max = lead == 0xf4 ? 0x8f : 0xbf;
    } else {
        return 0;
    }
    if (text[1] < second_min || text[1] > second_max) {
        return 0;
    }
    for (int i = 2; i < length; i++) {
        if (text[i] < 0x80 || text[i] > 0xbf) {
            return 0;
        }
    }
    return length;
}

void app_write_string(struct app_write *write, const char *text)
{
    separate(write);
    put_char(write, '"');
    const unsigned char *at = (const unsigned char *)text;
    while (*at != 0) {
        int length = utf8_length(at);
        if (length == 0) {
            put_text(write, "\\ufffd");
            length = 1;
        } else if (*at == '"' || *at == '\\') {
            put_char(write, '\\');
            put_char(write, (char)*at);
        } else if (*at < ' ' || *at == 0x7f) {
            char memory[sizeof "\\u0000"];
            struct hal_text escape = hal_text_begin(memory, sizeof memory);
            hal_text_put(&escape, "\\u");
            hal_text_put_hex(&escape, *at, 4);
            put(write, escape.text, escape.length);
        } else {
            put(write, (const char *)at, (size_t)length);
        }
        at += length;
    }
    put_char(write, '"');
}

void app_write_string_or_null(struct app_write *write, const char *text)
{
    if (text == NULL) {
        app_write_null(write);
    } else {
        app_write_string(write, text);
    }
}

void app_write_int_field(struct app_write *write, const char *key, int64_t value)
{
    app_write_key(write, key);
    app_write_int(write, value);
}
