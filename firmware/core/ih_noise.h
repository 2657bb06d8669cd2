/* ih_noise - how restless a frame is, place by place.
 *
 * In:    a frame.
 * Out:   a map of blocks of IH_NOISE_BLOCK pixels a side: the noise of the band-pass's response.
 * Way:   median of |R| (ih_band) over every pixel of the rows 4, 20, 36, ... that pass through a
 *        block: a dot covers a fiftieth of it and does not move its median. Then 1-2-1 in both
 *        directions, outermost blocks repeated. Between the blocks' centres ih_noise_at_row and
 *        the caller go linearly, so there are no seams.
 * Cost:  half of the frame's rows through ih_band's sums, a sixteenth through its filter.
 * Range: as R, 18,360; Q0 units of R.
 */
#ifndef IH_NOISE_H
#define IH_NOISE_H

#include "ih_band.h"

#define IH_NOISE_BLOCK 32
#define IH_NOISE_STEP 16 /* between the rows that are looked at */
#define IH_NOISE_BLOCKS_X ((IH_FRAME_WIDTH_MAX + IH_NOISE_BLOCK - 1) / IH_NOISE_BLOCK)
#define IH_NOISE_BLOCKS_Y ((IH_FRAME_HEIGHT_MAX + IH_NOISE_BLOCK - 1) / IH_NOISE_BLOCK)

struct ih_noise {
    int16_t columns, rows; /* blocks in use */
    uint16_t median[IH_NOISE_BLOCKS_Y][IH_NOISE_BLOCKS_X];
};

struct ih_noise_scratch {
    struct ih_band band;
    int16_t response[IH_NOISE_BLOCK / IH_NOISE_STEP][IH_FRAME_WIDTH_MAX];
};

void ih_noise_measure(const struct ih_frame *frame, struct ih_noise_scratch *scratch,
                      struct ih_noise *out);

/* The noise in a row at the blocks' centres, column by column; the smallest of them is returned. */
int32_t ih_noise_row(const struct ih_noise *noise, int32_t v, uint16_t row[IH_NOISE_BLOCKS_X]);

/* The noise at a pixel of that row. */
int32_t ih_noise_at(const struct ih_noise *noise, const uint16_t row[IH_NOISE_BLOCKS_X], int32_t u);

#endif
