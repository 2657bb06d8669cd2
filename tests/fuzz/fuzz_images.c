/* Images of frames: PNG (hal/replay/hal_png) where the first byte says so, else PGM (hal/replay/hal_pgm). Input: the file. */
#include <string.h>

#include "replay/hal_pgm.h"
#include "replay/hal_png.h"

#include "fuzz.h"

#define PNG_FIRST 0x89

static void check_samples(const uint8_t *file, const uint8_t *samples, size_t size,
                          const struct hal_pgm *pgm)
{
    size_t count = (size_t)pgm->width * (size_t)pgm->height;
    size_t bytes = count * (size_t)pgm->bytes_per_sample;
    FUZZ_CHECK(bytes < size);
    const uint8_t *from = file + (size - bytes);
    for (size_t i = 0; i < count && pgm->bytes_per_sample == 2; i++) {
        uint16_t sample = 0;
        memcpy(&sample, samples + 2 * i, sizeof sample);
        FUZZ_CHECK(sample == from[2 * i] * 256 + from[2 * i + 1]);
    }
    FUZZ_CHECK(pgm->bytes_per_sample == 2 || memcmp(from, samples, count) == 0);
}

static void check_error(const struct hal_error *error)
{
    FUZZ_CHECK(error->text[0] != 0 && memchr(error->text, 0, sizeof error->text) != NULL);
}

static void decode_pgm(const uint8_t *data, size_t size)
{
    struct hal_pgm pgm = {0};
    struct hal_error error = {""};
    uint8_t *copy = malloc(size > 0 ? size : 1);
    FUZZ_CHECK(copy != NULL);
    memcpy(copy, data, size);
    if (hal_pgm_decode(copy, size, &pgm, &error)) {
        FUZZ_CHECK(pgm.width >= 1 && pgm.width <= HAL_PGM_SIDE_MAX);
        FUZZ_CHECK(pgm.height >= 1 && pgm.height <= HAL_PGM_SIDE_MAX);
        FUZZ_CHECK(pgm.maximum >= 1 && pgm.maximum <= 65535);
        FUZZ_CHECK(pgm.bytes_per_sample == (pgm.maximum > 255 ? 2 : 1));
        check_samples(data, copy, size, &pgm);
    } else {
        check_error(&error);
    }
    free(copy);
}

static void decode_png(const uint8_t *data, size_t size)
{
    struct hal_png png = {.samples = NULL};
    struct hal_error error = {""};
    if (hal_png_decode(data, size, &png, &error)) {
        FUZZ_CHECK(png.width >= 1 && png.width <= HAL_PNG_SIDE_MAX);
        FUZZ_CHECK(png.height >= 1 && png.height <= HAL_PNG_SIDE_MAX);
        FUZZ_CHECK(png.maximum == (png.bytes_per_sample == 2 ? 65535 : 255));
        size_t bytes = (size_t)png.width * (size_t)png.height * (size_t)png.bytes_per_sample;
        uint8_t *copy = malloc(bytes);
        FUZZ_CHECK(copy != NULL);
        memcpy(copy, png.samples, bytes); /* all of it is there */
        free(copy);
    } else {
        check_error(&error);
        FUZZ_CHECK(png.samples == NULL);
    }
    free(png.samples);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size > 0 && data[0] == PNG_FIRST) {
        decode_png(data, size);
    } else {
        decode_pgm(data, size);
    }
    return 0;
}
