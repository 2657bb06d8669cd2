#include "replay/hal_pgm.h"

#include <string.h>

#include "hal_text.h"

#define MAXVAL_MAX 65535
#define BYTE_MAX 255
/* A number with more digits than this is too large whatever it is. */
#define DIGITS_MAX 9

/* Place in the file while its header is read. */
struct cursor {
    const uint8_t *data;
    size_t size, at;
};

static bool is_space(uint8_t byte)
{
    return byte == ' ' || (byte >= '\t' && byte <= '\r');
}

static bool is_digit(uint8_t byte)
{
    return byte >= '0' && byte <= '9';
}

static void skip_blanks(struct cursor *cursor)
{
    while (cursor->at < cursor->size) {
        uint8_t byte = cursor->data[cursor->at];
        if (byte == '#') {
            while (cursor->at < cursor->size && cursor->data[cursor->at] != '\n' &&
                   cursor->data[cursor->at] != '\r') {
                cursor->at++;
            }
        } else if (is_space(byte)) {
            cursor->at++;
        } else {
            return;
        }
    }
}

static void put_offset(struct hal_text *text, size_t offset)
{
    hal_text_put(text, "offset ");
    hal_text_put_number(text, (int64_t)offset, 1);
    hal_text_put(text, ": ");
}

static bool fail_at(struct hal_error *error, size_t offset, const char *found, const char *expected)
{
    struct hal_text text = hal_text_begin(error->text, sizeof error->text);
    put_offset(&text, offset);
    hal_text_put(&text, found);
    hal_text_put(&text, ", expected ");
    hal_text_put(&text, expected);
    return false;
}

/* What stands at the cursor, for an error text. */
static const char *describe(const struct cursor *cursor, char *memory, size_t size)
{
    struct hal_text text = hal_text_begin(memory, size);
    if (cursor->at >= cursor->size) {
        return "the file ends";
    }
    uint8_t byte = cursor->data[cursor->at];
    if (byte > ' ' && byte < 0x7f) {
        hal_text_put(&text, "'");
        hal_text_put_some(&text, (const char *)&byte, 1);
        hal_text_put(&text, "'");
    } else {
        hal_text_put(&text, "byte 0x");
        hal_text_put_hex(&text, byte, 2);
    }
    return memory;
}

static bool read_magic(struct cursor *cursor, struct hal_error *error)
{
    if (cursor->size == 0) {
        return fail_at(error, 0, "the file is empty", "a binary PGM (P5)");
    }
    if (cursor->size >= 2 && cursor->data[0] == 'P' && is_digit(cursor->data[1]) &&
        cursor->data[1] != '5') {
        char found[32];
        struct hal_text text = hal_text_begin(found, sizeof found);
        hal_text_put(&text, "format ");
        hal_text_put_some(&text, (const char *)cursor->data, 2);
        return fail_at(error, 0, found, "a binary PGM (P5)");
    }
    if (cursor->size < 3 || memcmp(cursor->data, "P5", 2) != 0 ||
        (!is_space(cursor->data[2]) && cursor->data[2] != '#')) {
        return fail_at(error, 0, "not a PGM", "a binary PGM (P5)");
    }
    cursor->at = 2;
    return true;
}

/* One decimal number of 1..maximum, called name in error texts. */
static bool read_number(struct cursor *cursor, const char *name, int32_t maximum, int32_t *value,
                        struct hal_error *error)
{
    char found[32];
    char expected[64];
    skip_blanks(cursor);
    size_t start = cursor->at;
    int32_t number = 0;
    while (cursor->at < cursor->size && is_digit(cursor->data[cursor->at]) &&
           cursor->at - start < DIGITS_MAX) {
        number = number * 10 + (cursor->data[cursor->at] - '0');
        cursor->at++;
    }
    struct hal_text wanted = hal_text_begin(expected, sizeof expected);
    if (cursor->at == start) {
        hal_text_put(&wanted, name);
        hal_text_put(&wanted, " in decimal");
        return fail_at(error, start, describe(cursor, found, sizeof found), expected);
    }
    bool longer = cursor->at < cursor->size && is_digit(cursor->data[cursor->at]);
    if (longer || number < 1 || number > maximum) {
        struct hal_text text = hal_text_begin(found, sizeof found);
        hal_text_put(&text, name);
        hal_text_put(&text, " ");
        hal_text_put_some(&text, (const char *)cursor->data + start, cursor->at - start);
        hal_text_put(&text, longer ? "..." : "");
        hal_text_put(&wanted, "1 to ");
        hal_text_put_number(&wanted, maximum, 1);
        return fail_at(error, start, found, expected);
    }
    *value = number;
    return true;
}

static bool read_header(struct cursor *cursor, struct hal_pgm *pgm, struct hal_error *error)
{
    if (!read_magic(cursor, error) ||
        !read_number(cursor, "width", HAL_PGM_SIDE_MAX, &pgm->width, error) ||
        !read_number(cursor, "height", HAL_PGM_SIDE_MAX, &pgm->height, error) ||
        !read_number(cursor, "maxval", MAXVAL_MAX, &pgm->maximum, error)) {
        return false;
    }
    if (cursor->at >= cursor->size || !is_space(cursor->data[cursor->at])) {
        char found[32];
        return fail_at(error, cursor->at, describe(cursor, found, sizeof found),
                       "one white space character after maxval");
    }
    cursor->at++;
    pgm->bytes_per_sample = pgm->maximum > BYTE_MAX ? 2 : 1;
    return true;
}

/* Move the samples to the front; in the forward direction no source is overwritten before it was
 * read, because the header is in front of it. */
static void unpack(uint8_t *data, size_t offset, const struct hal_pgm *pgm, size_t byte_count)
{
    if (pgm->bytes_per_sample == 1) {
        memmove(data, data + offset, byte_count);
        return;
    }
    for (size_t i = 0; i < byte_count; i += 2) {
        uint16_t sample = (uint16_t)(data[offset + i] << 8 | data[offset + i + 1]);
        memcpy(data + i, &sample, sizeof sample);
    }
}

static size_t sample_bytes(const struct hal_pgm *pgm)
{
    return (size_t)pgm->width * (size_t)pgm->height * (size_t)pgm->bytes_per_sample;
}

static bool fail_size(struct hal_error *error, size_t offset, size_t found,
                      const struct hal_pgm *pgm)
{
    struct hal_text text = hal_text_begin(error->text, sizeof error->text);
    put_offset(&text, offset);
    hal_text_put_number(&text, (int64_t)found, 1);
    hal_text_put(&text, " bytes of samples, expected ");
    hal_text_put_number(&text, (int64_t)sample_bytes(pgm), 1);
    hal_text_put(&text, " (");
    hal_text_put_number(&text, pgm->width, 1);
    hal_text_put(&text, "x");
    hal_text_put_number(&text, pgm->height, 1);
    hal_text_put(&text, pgm->bytes_per_sample == 1 ? ", 1 byte each)" : ", 2 bytes each)");
    hal_text_put(&text, found < sample_bytes(pgm) ? "; truncated?" : "; more than one image?");
    return false;
}

bool hal_pgm_decode(uint8_t *data, size_t size, struct hal_pgm *pgm, struct hal_error *error)
{
    struct cursor cursor = {data, size, 0};
    if (!read_header(&cursor, pgm, error)) {
        return false;
    }
    size_t expected = sample_bytes(pgm);
    size_t found = size - cursor.at;
    if (found != expected) {
        return fail_size(error, cursor.at, found, pgm);
    }
    unpack(data, cursor.at, pgm, expected);
    return true;
}
