/* ih_noise - how restless a frame is, place by place; what the last frame without laser takes away.
 *
 * In:    a frame; if there is one, the ambient frame, taken with the laser off shortly before.
 * Out:   a map of blocks of IH_NOISE_BLOCK pixels a side: the noise of the band-pass's response, and
 *        whether the ambient frame is subtracted there.
 * Way:   median of |R| (ih_bandpass) over every pixel of the rows 4, 20, 36, ... that pass through a
 *        block: a dot covers a fiftieth of it and does not move its median. Then 1-2-1 in both
 *        directions, outermost blocks repeated. Between the blocks' centres ih_noise_at goes
 *        linearly, so there are no seams.
 *        Ambient: it takes texture away but brings its own noise. It is subtracted in the blocks
 *        whose median is by an eighth less with it subtracted (half of the difference is looked at:
 *        nothing is cut off), and which are not darker than it by more than 2 grey levels in the
 *        mean: where something moved or light changed the block tells so itself. The share that
 *        is subtracted goes linearly between the blocks' centres: a ramp has no response. 4 grey
 *        levels are left; what is below 0 then, the dark ghost of something that moved, is 0. The
 *        noise is that of what is left, in these blocks 19/16 of it: it is white, and has more
 *        lonely maxima than texture.
 * Cost:  sums of half of the frame's rows, ih_bandpass's response of a sixteenth; three times that with an
 *        ambient frame.
 * Range: as R; 19/16 of it 22,145. Whole units of R.
 */
#ifndef IH_NOISE_H
#define IH_NOISE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "dots/ih_bandpass.h"

#define IH_NOISE_BLOCK 32
#define IH_NOISE_STEP 16 /* between the rows that are looked at */
#define IH_NOISE_BLOCKS_X ((IH_FRAME_WIDTH_MAX + IH_NOISE_BLOCK - 1) / IH_NOISE_BLOCK)
#define IH_NOISE_BLOCKS_Y ((IH_FRAME_HEIGHT_MAX + IH_NOISE_BLOCK - 1) / IH_NOISE_BLOCK)

struct ih_noise {
    int16_t columns, rows; /* blocks in use */
    uint16_t median[IH_NOISE_BLOCKS_Y][IH_NOISE_BLOCKS_X];
    uint8_t subtract[IH_NOISE_BLOCKS_Y][IH_NOISE_BLOCKS_X]; /* 1 = the ambient frame */
};

/* A row of pixels: the rows of blocks between whose centres it lies, and how far on it is, in 64ths. */
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

/* Take a row of the ambient frame from the same row of the lit one, as far as the map says. */
void ih_noise_subtract(const struct ih_noise *noise, int32_t v, int32_t width,
                       const uint16_t *ambient_q4, uint16_t *grey_q4);

/* The noise at a pixel of row v. */
struct ih_noise_row ih_noise_row(const struct ih_noise *noise, int32_t v);
int32_t ih_noise_at(const struct ih_noise_row *row, int32_t u);

/* No pixel of a column of blocks has less noise in this row, nor in the others that lie between the centres of the
 * same blocks: those change where v is IH_NOISE_BLOCK / 2 more than a multiple of IH_NOISE_BLOCK. */
int32_t ih_noise_min(const struct ih_noise_row *row, int32_t block);

IH_END_DECLS

#endif
