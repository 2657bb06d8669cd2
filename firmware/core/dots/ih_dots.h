/* ih_dots - find projected laser dots in one grey frame (paper, section 2.2).
 *
 * In:     rows of the frame from top to bottom, pixel centres at integer coordinates; a map of the noise
 *         (ih_noise); rows of the ambient frame, if there is one.
 * Out:    dots by row, then column: sub-pixel centres in the frame's own (distorted) pixels; a map of
 *         over-exposed blocks, before the ambient frame is subtracted; counters.
 * Method: a dot is a local maximum (3x3) of the band-pass's response R (ih_bandpass) that
 *         1. is above max(floor, gain * noise at the pixel);
 *         2. is alone, unlike edges and texture: 16 pixels on a ring of radius 4 have up to ring_max of its R;
 *         3. is no hot pixel, which has 0.474: the mean R beside it is at least side_min; the sharpest dot has
 *            0.65.
 *         Its centre is the weighted mean of 5x5 pixels (ih_dot_centre). Outside the frame R is 0. An
 *         over-exposed dot is a plateau, with peaks anywhere on it: where R beside the peak is at least
 *         flat_min of it, the centre is taken over 9x9 pixels, which hold plateaus up to 7 px across, and
 *         the ring lies around the centre. Of two centres closer than 3 px in u and v the first stays.
 * Cost:   one pass; 16 rows of R. About 26 operations of 16 bits per pixel, a few hundred per maximum.
 * Error:  centres within 0.01 px of the float64 reference. A full table drops dots and counts them.
 */
#ifndef IH_DOTS_H
#define IH_DOTS_H

#include <stdalign.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "dots/ih_bandpass.h"
#include "dots/ih_noise.h"
#include "dots/ih_scanline.h"

/* Most dots kept per frame. Each costs 12 bytes here and 12 in ih_labels. */
#ifndef IH_DOTS_MAX
#define IH_DOTS_MAX 1024
#endif
#if IH_DOTS_MAX < IH_SLOTS || IH_DOTS_MAX > 4096
#error "IH_DOTS_MAX must be in 361..4096"
#endif
/* Rows of R that a maximum needs above and below: radius and shift of the ring. */
#define IH_DOTS_REACH 6
/* Rows whose maxima are judged together. Each more costs a row of R, IH_DOTS_ROW_SIZE numbers. */
#define IH_DOTS_BATCH 4
#define IH_DOTS_ROWS (2 * IH_DOTS_REACH + IH_DOTS_BATCH)
/* Zeros to the left of a row of R and to its right: IH_DOTS_REACH or more, so that rows are aligned. */
#define IH_DOTS_SIDE (IH_ALIGNMENT / 2)
#define IH_DOTS_ROW_SIZE (IH_FRAME_WIDTH_MAX + 2 * IH_DOTS_SIDE)
#define IH_DOTS_BLOCK 8 /* side of the over-exposure map's blocks */
#define IH_DOTS_BLOCKS_X (IH_FRAME_WIDTH_MAX / IH_DOTS_BLOCK)
#define IH_DOTS_BLOCKS_Y (IH_FRAME_HEIGHT_MAX / IH_DOTS_BLOCK)

struct ih_dots_params {
    int32_t floor_grey_q4; /* lowest threshold, 8-bit grey levels in Q4 */
    int32_t noise_gain_q8; /* threshold in medians of |R| */
    int32_t ring_max_q8;   /* upper limit on the ring, fraction of the peak's R */
    int32_t side_min_q8;   /* lower limit beside the peak, mean of four */
    int32_t flat_min_q8;   /* from this fraction on the peak is a plateau */
    int32_t bright_grey;   /* block mean above this (0..255) = over-exposed */
};

struct ih_dot {
    int32_t u_px_q12, v_px_q12;
    int32_t peak; /* largest R */
};

struct ih_dots {
    int32_t dot_count;
    int32_t edge_count, hot_count; /* rejected maxima, by reason */
    int32_t dots_dropped;          /* the table was full */
    struct ih_dot dot[IH_DOTS_MAX];
    uint32_t bright[IH_DOTS_BLOCKS_Y][(IH_DOTS_BLOCKS_X + 31) / 32]; /* a bit per block */
};

struct ih_dots_scratch {
    struct ih_dots_params params;
    int32_t width, height;
    int32_t rows_taken;                         /* from the caller */
    int32_t response_rows;                      /* in the ring, those below the frame included */
    int32_t floor;                              /* lowest threshold, units of R */
    uint16_t bright_column[IH_FRAME_WIDTH_MAX]; /* sums over the rows of a row of blocks */
    uint16_t grey_q4[IH_FRAME_WIDTH_MAX], ambient_q4[IH_FRAME_WIDTH_MAX];
    struct ih_noise noise;
    union {
        struct ih_noise_scratch measuring;
        struct {
            struct ih_bandpass band;
            /* Ring; row v is at (v + IH_DOTS_REACH) % IH_DOTS_ROWS. Zeros around the frame. */
            alignas(IH_ALIGNMENT) int16_t response[IH_DOTS_ROWS][IH_DOTS_ROW_SIZE];
            struct ih_bandpass_row listed[IH_DOTS_ROWS]; /* row v is at v % IH_DOTS_ROWS */
            /* Rows between two blocks' centres have the same; the next ones have the other. */
            int16_t limit[2][IH_BANDPASS_GROUPS];
        } detection;
    } rows;
};

IH_BEGIN_DECLS

void ih_dots_params_default(struct ih_dots_params *params);

/* Rows as they come: begin, row for each, end. noise: of this frame or of the last one of the same size; it
 * may be scratch->noise. */
void ih_dots_begin(struct ih_dots_scratch *scratch, struct ih_dots *out,
                   const struct ih_dots_params *params, int32_t width, int32_t height,
                   const struct ih_noise *noise);
/* All rows have one format. ambient: the same row of the ambient frame; or NULL, for all rows. */
void ih_dots_row(struct ih_dots_scratch *scratch, struct ih_dots *out,
                 const struct ih_scanline *row, const struct ih_scanline *ambient);
void ih_dots_end(struct ih_dots_scratch *scratch, struct ih_dots *out);

/* The whole frame in one call: noise, begin, rows, end. ambient: of the same width and height, or
 * NULL. Both views have been checked. */
void ih_dots_find(const struct ih_frame *frame, const struct ih_frame *ambient,
                  const struct ih_dots_params *params, struct ih_dots_scratch *scratch,
                  struct ih_dots *out);

/* Is the frame's block at this pixel over-exposed? Outside the frame: false. */
bool ih_dots_is_bright(const struct ih_dots *dots, int32_t u_px, int32_t v_px);

IH_END_DECLS

#endif
