/* ih_band - rows of a frame through a band-pass that answers to spots of a dot's size.
 *
 * In:    rows from top to bottom, 8 to 16 bits a sample.
 * Out:   the response R of a row, IH_BAND_REACH rows later.
 * Way:   grey levels are brought to 12 bits (255 of an 8-bit sensor = 4080). With the 3x3 binomial
 *        sum I (weight 16) and the 9x9 box sum B (weight 81), edge pixels repeated outside,
 *        R = (81 I - 16 B) / 256, rounded. A constant gives 0; IH_BAND_UNIT units of R are one grey
 *        level of 8 bits.
 * Range: grey <= 4080, 4144 after an ambient frame was subtracted (ih_noise). I <= 66,304, so
 *        81 I <= 2^22.4, less what the nine bright pixels add to the box: |R| <= 18,648, 16 bits.
 *        Sums over nine pixels of a row <= 37,296, 16 bits without sign; over 81 <= 335,664.
 * Cost:  fifteen rows of 16 bits; about 20 operations per pixel, none of which waits for its
 *        neighbour's, so that vectors take 8 or 16 at once.
 * Error: R within half a unit (0.006 grey levels) of the exact filter; samples deeper than 8 bits are
 *        rounded to 12 bits before.
 */
#ifndef IH_BAND_H
#define IH_BAND_H

#include <stdbool.h>
#include <stdint.h>

#include "ih_config.h"
#include "ih_types.h"

/* Half width of the box; rows needed before a row's response is known. */
#define IH_BAND_REACH 4
#define IH_BAND_ROWS (2 * IH_BAND_REACH + 1)
/* One 8-bit grey level in units of R. */
#define IH_BAND_UNIT 81
/* Full scale in 12 bits. */
#define IH_BAND_FULL_Q4 4080

/* One row of samples; format as in struct ih_frame. */
struct ih_row {
    const void *samples;
    int32_t bytes_per_sample;
    int32_t maximum;
};

/* The inner kernel's rows stand so far behind the newest one. */
#define IH_BAND_GREY_ROWS (IH_BAND_REACH + 2)

struct ih_band {
    int32_t width;
    int32_t rows_in;                          /* pushed so far, repeated ones included */
    uint16_t incoming_q4[IH_FRAME_WIDTH_MAX]; /* the newest row */
    uint16_t grey_q4[IH_BAND_GREY_ROWS][IH_FRAME_WIDTH_MAX]; /* ring of rows */
    uint16_t across[IH_BAND_ROWS][IH_FRAME_WIDTH_MAX];       /* ring: nine pixels of a row */
    uint32_t box[IH_FRAME_WIDTH_MAX];                        /* B: sum over the rows in across */
    /* Of the newest row: edge pixels repeated outside, sums of three. */
    uint16_t padded_q4[IH_FRAME_WIDTH_MAX + 2 * IH_BAND_REACH];
    uint16_t three[IH_FRAME_WIDTH_MAX + 2 * IH_BAND_REACH];
};

struct ih_row ih_frame_row(const struct ih_frame *frame, int32_t v);

void ih_band_begin(struct ih_band *band, int32_t width);

/* A row's samples in 12 bits. */
void ih_row_grey(const struct ih_row *row, int32_t width, uint16_t *grey_q4);

/* Push what incoming_q4 holds, filled by the caller. True: response[0 .. width - 1] is that of the
 * row IH_BAND_REACH pushes ago. Rows repeated at the frame's top and bottom are pushed by the caller. */
bool ih_band_push(struct ih_band *band, int16_t *response);

#endif
