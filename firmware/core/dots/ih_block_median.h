/* ih_block_median - medians of |R| in a row of blocks; private to ih_noise.
 *
 * In:     rows of R, at most IH_BLOCK_MEDIAN_ROWS, cut into blocks of IH_NOISE_BLOCK pixels.
 * Out:    of each block the value of rank count / 2, from 0, of its count values.
 * Method: halving the range of values. Nearly all medians are below 255: 8 bits are searched first, and all
 *         of a block's that has a larger one.
 */
#ifndef IH_BLOCK_MEDIAN_H
#define IH_BLOCK_MEDIAN_H

#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_noise.h"

/* Rows of R in a block. */
#define IH_BLOCK_MEDIAN_ROWS (IH_NOISE_BLOCK / IH_NOISE_STEP)

IH_BEGIN_DECLS

/* The first rows of response are valid up to width; behind it they may be overwritten. */
void ih_block_medians(int16_t response[IH_BLOCK_MEDIAN_ROWS][IH_FRAME_WIDTH_MAX], int32_t width,
                      int32_t rows, uint16_t *median);

IH_END_DECLS

#endif
