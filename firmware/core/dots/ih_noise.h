/* ih_noise - map of a frame's noise, and of where the ambient frame is subtracted.
 *
 * In:     a frame, and the ambient frame if there is one, taken with the laser off shortly before.
 * Out:    for each block of IH_NOISE_BLOCK pixels a side the noise of the band-pass's response, and whether
 *         the ambient frame is subtracted there.
 * Method: median of |R| (ih_bandpass) over every pixel of the rows 4, 20, 36, ... in a block. A dot covers a
 *         fiftieth of a block and does not move its median. Then 1-2-1 in both directions, outermost blocks
 *         repeated. ih_noise_at interpolates between the blocks' centres, so there are no seams.
 *         Subtracting the ambient frame removes texture but adds its noise. It is done in blocks whose
 *         median it lowers by an eighth, measured on half of the difference, which is not clipped, and whose
 *         mean is not darker than the ambient frame's by more than 2 grey levels: there something moved or
 *         the light changed. The fraction that is subtracted is interpolated between the blocks' centres: a
 *         ramp has no response. 4 grey levels stay; below 0, as in the dark ghost of something that moved,
 *         the result is 0. The noise of these blocks is that of the difference times 19/16: it is white, with
 *         more isolated local maxima than texture.
 * Cost:   sums of half of the frame's rows, ih_bandpass's response of a sixteenth; three times that with an
 *         ambient frame.
 * Range:  as R; 19/16 of it 22,145. Whole units of R.
 */
#ifndef IH_NOISE_H
#define IH_NOISE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "dots/ih_bandpass.h"

#define IH_NOISE_BLOCK 32
#define IH_NOISE_STEP 16 /* between sampled rows */
#define IH_NOISE_BLOCKS_X ((IH_FRAME_WIDTH_MAX + IH_NOISE_BLOCK - 1) / IH_NOISE_BLOCK)
#define IH_NOISE_BLOCKS_Y ((IH_FRAME_HEIGHT_MAX + IH_NOISE_BLOCK - 1) / IH_NOISE_BLOCK)

struct ih_noise {
    int16_t columns, rows; /* blocks in use */
    uint16_t median[IH_NOISE_BLOCKS_Y][IH_NOISE_BLOCKS_X];
    uint8_t subtract[IH_NOISE_BLOCKS_Y][IH_NOISE_BLOCKS_X]; /* 1 = the ambient frame */
};

/* The rows of blocks between whose centres a row of pixels lies, and its distance from the first, in 64ths. */
struct ih_noise_row {
    const uint16_t *above, *below;
    int32_t part;
    int32_t columns;
};

struct ih_noise_scratch {
    struct ih_bandpass band;
    uint16_t grey_q4[IH_FRAME_WIDTH_MAX], ambient_q4[IH_FRAME_WIDTH_MAX];
    int16_t response[IH_NOISE_BLOCK / IH_NOISE_STEP][IH_FRAME_WIDTH_MAX];
};

IH_BEGIN_DECLS

/* ambient: of the frame's width and height, or NULL. */
void ih_noise_measure(const struct ih_frame *frame, const struct ih_frame *ambient,
                      struct ih_noise_scratch *scratch, struct ih_noise *out);

/* Subtract a row of the ambient frame from the same row of the lit one, as the map says. */
void ih_noise_subtract(const struct ih_noise *noise, int32_t v, int32_t width,
                       const uint16_t *ambient_q4, uint16_t *grey_q4);

/* The noise at a pixel of row v. */
struct ih_noise_row ih_noise_row(const struct ih_noise *noise, int32_t v);
int32_t ih_noise_at(const struct ih_noise_row *row, int32_t u);

/* Minimum of ih_noise_at over a column of blocks, in this row and all rows between the centres of the same
 * blocks: those change where v is IH_NOISE_BLOCK / 2 above a multiple of IH_NOISE_BLOCK. */
int32_t ih_noise_min(const struct ih_noise_row *row, int32_t block);

IH_END_DECLS

#endif
