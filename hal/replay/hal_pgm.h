/* hal_pgm - decode one binary PGM image (P5), strictly.
 *
 * In:    a whole file in memory. The header is Netpbm's: "P5", width, height and maxval in decimal,
 *        apart by white space, with comments from # to the end of the line before maxval; then
 *        exactly one white space character, then the samples: one byte each for maxval up to 255,
 *        else two, most significant first.
 * Out:   the samples at the start of the same memory, two-byte ones in the processor's byte order,
 *        rows without gaps.
 * Error: everything else, with the offset in the file: other formats, sizes of 0 or beyond
 *        HAL_PGM_SIDE_MAX, maxval outside 1..65535, too few bytes, bytes after the image (a second
 *        image is legal PGM, but no frame).
 */
#ifndef HAL_PGM_H
#define HAL_PGM_H

#include <stddef.h>

#include "hal.h"

/* Longest side accepted. Bounds the image to 2 * 8192^2 bytes, so that no size overflows. */
#define HAL_PGM_SIDE_MAX 8192
/* Longest file that can be a frame: the largest image, and room for comments. */
#define HAL_PGM_FILE_MAX ((size_t)2 * HAL_PGM_SIDE_MAX * HAL_PGM_SIDE_MAX + 65536)

struct hal_pgm {
    int32_t width, height;    /* px */
    int32_t maximum;          /* 1..65535 */
    int32_t bytes_per_sample; /* 1 or 2 */
};

/* data: aligned for uint16_t; overwritten by the samples. False: *error says why. */
bool hal_pgm_decode(uint8_t *data, size_t size, struct hal_pgm *pgm, struct hal_error *error);

#endif
