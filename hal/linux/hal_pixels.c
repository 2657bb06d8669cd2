#include "linux/hal_pixels.h"

bool hal_pixels_is_view(enum hal_pixels_layout layout)
{
    const bool is_little_endian = __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__;
    return layout == HAL_PIXELS_8 || (layout == HAL_PIXELS_16LE && is_little_endian);
}

int32_t hal_pixels_sample_bytes(enum hal_pixels_layout layout)
{
    const bool is_wide =
        layout == HAL_PIXELS_16LE || layout == HAL_PIXELS_10P || layout == HAL_PIXELS_12P;
    return is_wide ? 2 : 1;
}

int32_t hal_pixels_row_bytes(enum hal_pixels_layout layout, int32_t width)
{
    switch (layout) {
    case HAL_PIXELS_16LE:
        return width * 2;
    case HAL_PIXELS_10P:
        return (width + 3) / 4 * 5;
    case HAL_PIXELS_12P:
        return (width + 1) / 2 * 3;
    case HAL_PIXELS_YUYV:
    case HAL_PIXELS_UYVY:
        return (width + 1) / 2 * 4;
    case HAL_PIXELS_8:
        break;
    }
    return width;
}

static void decode_16le(const uint8_t *from, int32_t width, uint16_t *to)
{
    for (int32_t x = 0; x < width; x++) {
        to[x] = (uint16_t)(from[2 * x] | from[2 * x + 1] << 8);
    }
}

static void decode_10p(const uint8_t *from, int32_t width, uint16_t *to)
{
    for (int32_t x = 0; x < width; x += 4, from += 5) {
        for (int32_t k = 0; k < 4 && x + k < width; k++) {
            to[x + k] = (uint16_t)(from[k] << 2 | (from[4] >> 2 * k & 3));
        }
    }
}

static void decode_12p(const uint8_t *from, int32_t width, uint16_t *to)
{
    for (int32_t x = 0; x < width; x += 2, from += 3) {
        to[x] = (uint16_t)(from[0] << 4 | (from[2] & 15));
        if (x + 1 < width) {
            to[x + 1] = (uint16_t)(from[1] << 4 | from[2] >> 4);
        }
    }
}

static void decode_luma(const uint8_t *from, int32_t width, uint8_t *to)
{
    for (int32_t x = 0; x < width; x++) {
        to[x] = from[2 * x];
    }
}

void hal_pixels_decode(enum hal_pixels_layout layout, const uint8_t *from, size_t stride_bytes,
                       int32_t width, int32_t height, void *to)
{
    uint8_t *to_8 = to;
    uint16_t *to_16 = to;
    for (int32_t y = 0; y < height; y++) {
        const uint8_t *row = from + (size_t)y * stride_bytes;
        const size_t done = (size_t)y * (size_t)width;
        switch (layout) {
        case HAL_PIXELS_16LE:
            decode_16le(row, width, to_16 + done);
            break;
        case HAL_PIXELS_10P:
            decode_10p(row, width, to_16 + done);
            break;
        case HAL_PIXELS_12P:
            decode_12p(row, width, to_16 + done);
            break;
        case HAL_PIXELS_YUYV:
            decode_luma(row, width, to_8 + done);
            break;
        case HAL_PIXELS_UYVY:
            decode_luma(row + 1, width, to_8 + done);
            break;
        case HAL_PIXELS_8:
            break;
        }
    }
}
