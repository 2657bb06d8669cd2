/* ih_dots - find projected laser dots in one grey frame (paper, section 2.2).
 *
 * In:    rows of the frame from top to bottom; pixel centres at integer coordinates; a map of the
 *        noise (ih_noise). If there is one, the rows of the ambient frame: they are subtracted
 *        where the map says so, before anything but the map of over-exposed blocks.
 * Out:   dots by row, then column: sub-pixel centres in the frame's own (distorted) pixels; a map
 *        of over-exposed blocks; counters of what was refused or dropped.
 * Way:   a dot is a local maximum (3x3) of the band-pass's response R (ih_bandpass) that
 *        1. is above max(floor, gain * noise at that place);
 *        2. stands alone: none of 16 places on a ring of radius 4 around it has more than
 *           ring_max of it. Edges, stripes and texture fail here;
 *        3. is no single hot pixel: R beside it, mean of four, is at least side_min of it. A
 *           single pixel has 0.474, the sharpest dot about 0.65.
 *        Its centre is the mean of the 5x5 pixels around it, weighted by (R - R of the peak / 4)^2
 *        where that is positive. Outside the frame R counts as 0.
 *        A dot that is over-exposed is a plateau of full scale, and so nearly is R: the peak is
 *        anywhere on it, and there may be several. Where R beside the peak is flat_min of it or
 *        more, the centre is taken over 9x9 pixels, which hold the plateau's rim, and the ring is
 *        laid around the centre, at most 2 px from the peak. This finds plateaus up to 7 px across.
 *        Of two centres less than 3 px apart in u and v the first stays.
 *        The threshold falls with the place's own noise, so that dots in quiet places are not lost
 *        to texture elsewhere; tests 2 and 3 keep what is no dot out, so that it can be low.
 * Cost:  one pass; ih_bandpass's rows and 16 of R. About 26 operations of 16 bits per pixel, a few
 *        hundred for each of some thousand maxima. Of four rows the maxima are judged together, each by
 *        all tests but the last: what a processor cannot foresee it shall not guess.
 * Error: centres within 0.01 px of the float64 reference.
 * A full table drops and counts: dots_dropped.
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

/* Most dots kept per frame. Each costs 12 bytes here and 12 in ih_labels. */
#ifndef IH_DOTS_MAX
#define IH_DOTS_MAX 1024
#endif
#if IH_DOTS_MAX < IH_SLOTS || IH_DOTS_MAX > 4096
#error "IH_DOTS_MAX must be in 361..4096"
#endif
/* Radius of the ring and what it may be shifted by: rows of R above and below a maximum that are
 * needed. */
#define IH_DOTS_REACH 6
/* Rows whose maxima are judged together. Each more costs a row of R, IH_DOTS_ROW_SIZE numbers. */
#define IH_DOTS_BATCH 4
#define IH_DOTS_ROWS (2 * IH_DOTS_REACH + IH_DOTS_BATCH)
/* Zeros to the left of a row of R and to its right: IH_DOTS_REACH or more, so that rows are aligned. */
#define IH_DOTS_SIDE (IH_ALIGNMENT / 2)
#define IH_DOTS_ROW_SIZE (IH_FRAME_WIDTH_MAX + 2 * IH_DOTS_SIDE)
/* Side of the blocks of the over-exposure map. */
#define IH_DOTS_BLOCK 8
#define IH_DOTS_BLOCKS_X (IH_FRAME_WIDTH_MAX / IH_DOTS_BLOCK)
#define IH_DOTS_BLOCKS_Y (IH_FRAME_HEIGHT_MAX / IH_DOTS_BLOCK)

struct ih_dots_params {
    int32_t floor_grey_q4; /* least threshold, 8-bit grey levels in Q4 */
    int32_t noise_gain_q8; /* threshold in medians of |R| */
    int32_t ring_max_q8;   /* most of the peak's R on the ring */
    int32_t side_min_q8;   /* least of the peak's R beside it, mean of four */
    int32_t flat_min_q8;   /* from there on it is a plateau */
    int32_t bright_grey;   /* block mean above this (0..255) = over-exposed */
};

struct ih_dot {
    int32_t u_px_q12, v_px_q12;
    int32_t peak; /* largest R */
};

struct ih_dots {
    int32_t dot_count;
    /* maxima above the threshold that were refused, by reason */
    int32_t edge_count, hot_count;
    int32_t dots_dropped; /* lost because the table was full */
    struct ih_dot dot[IH_DOTS_MAX];
    /* bit per block, row by row: 1 = over-exposed */
    uint32_t bright[IH_DOTS_BLOCKS_Y][(IH_DOTS_BLOCKS_X + 31) / 32];
};

struct ih_dots_scratch {
    struct ih_dots_params params;
    int32_t width, height;
    int32_t rows_taken;                         /* from the caller */
    int32_t response_rows;                      /* in the ring, those below the frame included */
    int32_t floor;                              /* least threshold, units of R */
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
            /* For the rows of R between two rows of blocks' centres, and for those between the next two. */
            uint32_t limit[2][IH_BANDPASS_GROUPS];
        } detection;
    } rows;
};

IH_BEGIN_DECLS

void ih_dots_params_default(struct ih_dots_params *params);

/* Rows as they come: begin, then row height times, then end. noise as from ih_noise_measure, of
 * this frame or of the last one, which was of the same size; it may be scratch->noise. */
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
