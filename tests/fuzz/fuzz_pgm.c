/* PGM images (hal/replay/hal_pgm). Input: the file. */
#include <string.h>

#include "replay/hal_pgm.h"

#include "fuzz.h"

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

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
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
        FUZZ_CHECK(error.text[0] != 0 && memchr(error.text, 0, sizeof error.text) != NULL);
    }
    free(copy);
    return 0;
}
