/* hal_png - decode one grey PNG image, through libpng.
 *
 * In:    a whole file in memory: grey of 8 or 16 bits a sample, interlaced or not. Gamma, transparency and other
 *        notes in it change no sample.
 * Out:   the samples, two-byte ones in the processor's byte order, rows without gaps.
 * Error: everything else: colour or a palette, grey with alpha, fewer bits, sides beyond HAL_PNG_SIDE_MAX, a file
 *        that is damaged or ends early. A program that was built without libpng refuses every file.
 */
#ifndef HAL_PNG_H
#define HAL_PNG_H

#include <stddef.h>

#include "hal.h"

/* Longest side accepted: at most 128 MB of samples, whatever a small file unpacks to. */
#define HAL_PNG_SIDE_MAX 8192
#define HAL_PNG_FILE_MAX ((size_t)2 * HAL_PNG_SIDE_MAX * HAL_PNG_SIDE_MAX + 65536)

struct hal_png {
    uint8_t *samples;         /* to be freed */
    int32_t width, height;    /* px */
    int32_t maximum;          /* 255 or 65535 */
    int32_t bytes_per_sample; /* 1 or 2 */
};

/* False: *error says why, and there is nothing to free. */
bool hal_png_decode(const uint8_t *data, size_t size, struct hal_png *image,
                    struct hal_error *error);

#endif
