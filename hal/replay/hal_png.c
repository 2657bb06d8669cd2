#include "replay/hal_png.h"

#ifdef HAL_WITH_PNG
#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

#define BYTE_BITS 8
#define WORD_BITS 16

/* Outside of the functions that libpng jumps out of. */
struct reader {
    const uint8_t *data;
    size_t size, at;
    struct hal_png *image;
    struct hal_error *error;
    png_structp png;
    png_infop info;
    png_bytep *row;
    bool is_explained; /* *error has a reason better than libpng's */
};

static void jump_out(png_structp png, png_const_charp reason)
{
    struct reader *reader = png_get_error_ptr(png);
    if (!reader->is_explained) {
        hal_fail(reader->error, "offset %zu: damaged: %s", reader->at, reason);
    }
    png_longjmp(png, 1);
}

static void ignore(png_structp png, png_const_charp warning)
{
    (void)png, (void)warning;
}

static void take_bytes(png_structp png, png_bytep into, png_size_t count)
{
    struct reader *reader = png_get_io_ptr(png);
    if (count > reader->size - reader->at) {
        hal_fail(reader->error, "offset %zu: the file ends, expected %zu bytes more; truncated?",
                 reader->size, (size_t)count - (reader->size - reader->at));
        reader->is_explained = true;
        png_error(png, "truncated");
    }
    memcpy(into, reader->data + reader->at, count);
    reader->at += count;
}

static const char *kind_text(int kind)
{
    switch (kind) {
    case PNG_COLOR_TYPE_GRAY:
        return "grey";
    case PNG_COLOR_TYPE_GRAY_ALPHA:
        return "grey with alpha";
    case PNG_COLOR_TYPE_PALETTE:
        return "a palette";
    default:
        return "colour";
    }
}

/* The header. False, also after a jump: *error says why. */
static bool read_shape(struct reader *reader)
{
    struct hal_png *image = reader->image;
    if (setjmp(png_jmpbuf(reader->png)) != 0) {
        return false;
    }
    png_set_read_fn(reader->png, reader, take_bytes);
    png_set_user_limits(reader->png, HAL_PNG_SIDE_MAX, HAL_PNG_SIDE_MAX);
    png_read_info(reader->png, reader->info);
    const int kind = png_get_color_type(reader->png, reader->info);
    const int bits = png_get_bit_depth(reader->png, reader->info);
    if (kind != PNG_COLOR_TYPE_GRAY || (bits != BYTE_BITS && bits != WORD_BITS)) {
        return hal_fail(reader->error,
                        "%s of %d bits, expected grey of 8 or 16: ffmpeg -i this.png -pix_fmt gray "
                        "new.png (gray16be for 16)",
                        kind_text(kind), bits);
    }
    image->width = (int32_t)png_get_image_width(reader->png, reader->info);
    image->height = (int32_t)png_get_image_height(reader->png, reader->info);
    image->bytes_per_sample = bits / BYTE_BITS;
    image->maximum = bits == BYTE_BITS ? UINT8_MAX : UINT16_MAX;
    return true;
}

static bool reserve(struct reader *reader)
{
    struct hal_png *image = reader->image;
    const size_t row_bytes = (size_t)image->width * (size_t)image->bytes_per_sample;
    uint8_t *samples = malloc(row_bytes * (size_t)image->height);
    png_bytep *row = malloc((size_t)image->height * sizeof *row);
    if (samples == NULL || row == NULL) {
        free(samples);
        free(row);
        return hal_fail(reader->error, "no memory for %dx%d samples", (int)image->width,
                        (int)image->height);
    }
    for (int32_t v = 0; v < image->height; v++) {
        row[v] = samples + (size_t)v * row_bytes;
    }
    image->samples = samples;
    reader->row = row;
    return true;
}

/* False after a jump. */
static bool read_samples(struct reader *reader)
{
    static const uint16_t one = 1;
    if (setjmp(png_jmpbuf(reader->png)) != 0) {
        return false;
    }
    if (*(const uint8_t *)(const void *)&one == 1) {
        png_set_swap(reader->png); /* of two-byte samples; others stay */
    }
    (void)png_set_interlace_handling(reader->png);
    png_read_update_info(reader->png, reader->info);
    png_read_image(reader->png, reader->row);
    png_read_end(reader->png, NULL);
    return true;
}

bool hal_png_decode(const uint8_t *data, size_t size, struct hal_png *image,
                    struct hal_error *error)
{
    struct reader reader = {.data = data, .size = size, .image = image, .error = error};
    *image = (struct hal_png){.samples = NULL};
    if (size == 0) {
        return hal_fail(error, "offset 0: the file is empty, expected a PNG");
    }
    if (png_sig_cmp(data, 0, size < 8 ? size : 8) != 0) {
        return hal_fail(error, "offset 0: not a PNG, expected a grey PNG of 8 or 16 bits");
    }
    reader.png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &reader, jump_out, ignore);
    reader.info = reader.png == NULL ? NULL : png_create_info_struct(reader.png);
    bool good = reader.info != NULL
                    ? read_shape(&reader) && reserve(&reader) && read_samples(&reader)
                    : hal_fail(error, "no memory for libpng");
    png_destroy_read_struct(&reader.png, &reader.info, NULL);
    free(reader.row);
    if (!good) {
        free(image->samples);
        *image = (struct hal_png){.samples = NULL};
    }
    return good;
}

#else

bool hal_png_decode(const uint8_t *data, size_t size, struct hal_png *image,
                    struct hal_error *error)
{
    (void)data, (void)size;
    *image = (struct hal_png){.samples = NULL};
    return hal_fail(error, "this program was built without libpng: install libpng-dev and build it "
                           "again, or convert the frames to PGM");
}

#endif
