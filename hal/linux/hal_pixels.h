/* hal_pixels - how samples lie in a camera's memory, and grey samples out of it.
 *
 * In:    rows of a frame as V4L2 delivers them, each of at least hal_pixels_row_bytes.
 * Out:   the layouts that the firmware cannot read where they are, decoded: uint8_t samples, or
 *        uint16_t ones in the processor's own byte order, rows without padding.
 * Cost:  one pass; a frame of 752x480 takes well under a millisecond on a desktop.
 * Error: none. A packed group of pixels at a row's end may be incomplete, its bytes are all there.
 */
#ifndef HAL_PIXELS_H
#define HAL_PIXELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum hal_pixels_layout {
    HAL_PIXELS_8,    /* a byte a sample; whatever follows the rows, chroma say, is not looked at */
    HAL_PIXELS_16LE, /* two bytes a sample, the low one first; unused high bits are 0 */
    HAL_PIXELS_10P,  /* MIPI: the high 8 bits of 4 samples, then a byte of their low 2 bits, the
                      * first sample's lowest */
    HAL_PIXELS_12P,  /* MIPI: the high 8 bits of 2 samples, then a byte of their low 4 bits, the
                      * first sample's lowest */
    HAL_PIXELS_YUYV, /* luma in the even bytes, chroma in the odd ones */
    HAL_PIXELS_UYVY, /* the other way round */
};

/* Can the firmware read such samples where they are? Two bytes a sample only in its own order. */
bool hal_pixels_is_view(enum hal_pixels_layout layout);

/* Of a decoded sample: 1 or 2. */
int32_t hal_pixels_sample_bytes(enum hal_pixels_layout layout);

/* Bytes that a row takes before padding. width: 1 .. 2^28 px. */
int32_t hal_pixels_row_bytes(enum hal_pixels_layout layout, int32_t width);

/* from: rows stride_bytes apart. to: width * height samples, suitably aligned.
 * Not for HAL_PIXELS_8, which is a view on every machine. */
void hal_pixels_decode(enum hal_pixels_layout layout, const uint8_t *from, size_t stride_bytes,
                       int32_t width, int32_t height, void *to);

#endif
