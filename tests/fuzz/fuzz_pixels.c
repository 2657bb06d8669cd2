/* How cameras pack samples (hal/linux/hal_pixels). Input: layout, width, height, padding, rows. */
#include <string.h>

#include "linux/hal_pixels.h"

#include "fuzz.h"

#define SIDE_MAX 64
#define PADDING_MAX 16

/* One sample, by the layout's description: independent of the decoder's loops. */
static int32_t sample_of(enum hal_pixels_layout layout, const uint8_t *row, int32_t x)
{
    const uint8_t *group = NULL;
    switch (layout) {
    case HAL_PIXELS_16LE:
        return row[2 * x] + 256 * row[2 * x + 1];
    case HAL_PIXELS_10P:
        group = row + x / 4 * 5;
        return group[x % 4] * 4 + group[4] / (1 << x % 4 * 2) % 4;
    case HAL_PIXELS_12P:
        group = row + x / 2 * 3;
        return group[x % 2] * 16 + (x % 2 == 0 ? group[2] % 16 : group[2] / 16);
    case HAL_PIXELS_YUYV:
        return row[2 * x];
    case HAL_PIXELS_UYVY:
        return row[2 * x + 1];
    case HAL_PIXELS_8:
        break;
    }
    return -1;
}

static void check(enum hal_pixels_layout layout, const uint8_t *rows, size_t stride, int32_t width,
                  int32_t height, const uint8_t *to)
{
    for (int32_t y = 0; y < height; y++) {
        for (int32_t x = 0; x < width; x++) {
            size_t index = (size_t)y * (size_t)width + (size_t)x;
            int32_t sample = to[index];
            if (hal_pixels_sample_bytes(layout) == 2) {
                uint16_t wide = 0;
                memcpy(&wide, to + 2 * index, sizeof wide);
                sample = wide;
            }
            FUZZ_CHECK(sample == sample_of(layout, rows + (size_t)y * stride, x));
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_input input = {data, size};
    enum hal_pixels_layout layout =
        (enum hal_pixels_layout)fuzz_within(&input, HAL_PIXELS_16LE, HAL_PIXELS_UYVY);
    int32_t width = fuzz_within(&input, 1, SIDE_MAX);
    int32_t height = fuzz_within(&input, 1, SIDE_MAX);
    int32_t row_bytes = hal_pixels_row_bytes(layout, width);
    FUZZ_CHECK(row_bytes >= width);
    size_t stride = (size_t)(row_bytes + fuzz_within(&input, 0, PADDING_MAX));
    /* The last row has no padding behind it: nothing there may be read. */
    size_t bytes = stride * (size_t)(height - 1) + (size_t)row_bytes;
    uint8_t *rows = malloc(bytes);
    uint8_t *to = malloc((size_t)(width * height * hal_pixels_sample_bytes(layout)));
    FUZZ_CHECK(rows != NULL && to != NULL);
    for (size_t i = 0; i < bytes; i++) {
        rows[i] = fuzz_byte(&input);
    }
    hal_pixels_decode(layout, rows, stride, width, height, to);
    check(layout, rows, stride, width, height, to);
    free(to);
    free(rows);
    return 0;
}
