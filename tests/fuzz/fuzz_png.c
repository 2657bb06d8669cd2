/* PNG images (hal/replay/hal_png). Input: the file. */
#include <string.h>

#include "replay/hal_png.h"

#include "fuzz.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
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
        FUZZ_CHECK(error.text[0] != 0 && memchr(error.text, 0, sizeof error.text) != NULL);
        FUZZ_CHECK(png.samples == NULL);
    }
    free(png.samples);
    return 0;
}
