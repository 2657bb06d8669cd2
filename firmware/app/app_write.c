#include "app_write.h"

#include <inttypes.h>

static void separate(struct app_write *write)
{
    if (write->comma) {
        fputc(',', write->file);
    }
    write->comma = true;
}

void app_write_open(struct app_write *write, char bracket)
{
    separate(write);
    fputc(bracket, write->file);
    write->comma = false;
}

void app_write_close(struct app_write *write, char bracket)
{
    fputc(bracket, write->file);
    write->comma = true;
}

void app_write_key(struct app_write *write, const char *key)
{
    separate(write);
    fprintf(write->file, "\"%s\":", key);
    write->comma = false;
}

void app_write_int(struct app_write *write, int64_t value)
{
    separate(write);
    fprintf(write->file, "%" PRId64, value);
}

void app_write_decimal(struct app_write *write, struct app_decimal decimal)
{
    separate(write);
    fputs(decimal.text, write->file);
}

void app_write_bool(struct app_write *write, bool value)
{
    separate(write);
    fputs(value ? "true" : "false", write->file);
}

void app_write_null(struct app_write *write)
{
    separate(write);
    fputs("null", write->file);
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
    fputc('"', write->file);
    const unsigned char *at = (const unsigned char *)text;
    while (*at != 0) {
        int length = utf8_length(at);
        if (length == 0) {
            fputs("\\ufffd", write->file);
            length = 1;
        } else if (*at == '"' || *at == '\\') {
            fprintf(write->file, "\\%c", *at);
        } else if (*at < ' ' || *at == 0x7f) {
            fprintf(write->file, "\\u%04x", *at);
        } else {
            fwrite(at, 1, (size_t)length, write->file);
        }
        at += length;
    }
    fputc('"', write->file);
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
