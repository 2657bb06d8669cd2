/* ih_bandpass - scanlines through a band-pass filter that responds to spots of a dot's size.
 *
 * In:     scanlines from top to bottom, 8 to 16 bits a sample.
 * Out:    the response R of a scanline, IH_BANDPASS_REACH scanlines later, and the groups of
 *         IH_BANDPASS_GROUP pixels with an R above a limit. Most groups have none and are never read again.
 * Method: with the 3x3 binomial sum I (weight 16) and the 9x9 box sum B (weight 81) of grey levels in
 *         12 bits (255 of an 8-bit sensor = 4080), edge pixels repeated outside,
 *         R = (81 I - 16 B) / 256, rounded. A constant gives 0; IH_BANDPASS_UNIT units of R are one grey
 *         level of 8 bits. Bytes with 255 as full scale are summed as they are: with their own sums
 *         i = I / 16 and b = B / 16, R = (81 i + 8) / 16 - b, rounded down, or 5 i + (i + 8) / 16 - b.
 *         Each scanline's sums of three pixels join those of the eight before in a running sum per pixel;
 *         three of these, three pixels apart, are B. Sums 1-2-1 of three scanlines, 1-2-1 again, are I.
 * Range:  grey <= 4080, 4144 after an ambient frame was subtracted (ih_noise). I <= 66,304, so
 *         81 I <= 2^22.4. The nine bright pixels are in the box, too: |R| <= 18,648, 16 bits.
 *         Sums of three pixels of nine scanlines <= 111,888; over 81 <= 335,664. Of bytes 81 i / 16 and
 *         b <= 20,655: everything is in 16 bits.
 * Cost:   19 rows of 16 bits; about 22 operations of 16 bits per pixel. None waits for its neighbour's,
 *         so that vectors take 8 or 16 pixels at once; a Cortex-M takes two.
 * Error:  R within half a unit (0.006 grey levels) of the exact filter.
 */
#ifndef IH_BANDPASS_H
#define IH_BANDPASS_H

#include <stdalign.h>
#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"

/* Half width of the box, and the delay of R in scanlines. */
#define IH_BANDPASS_REACH 4
#define IH_BANDPASS_ROWS (2 * IH_BANDPASS_REACH + 1)
/* One 8-bit grey level in units of R. */
#define IH_BANDPASS_UNIT 81
/* Rows of 1-2-1 sums in their ring. */
#define IH_BANDPASS_KEPT 8
/* Pixels of a kernel's step. Steps may reach beyond a row's end; nothing there is used. */
#define IH_BANDPASS_STEP 32
/* Sums of three pixels that R needs to the left and right of a row. */
#define IH_BANDPASS_SIDE (IH_BANDPASS_REACH - 1)
/* Room for sums to the left of a row, so that its own are aligned. */
#define IH_BANDPASS_LEAD (IH_ALIGNMENT / 2)
#define IH_BANDPASS_SUMS (IH_BANDPASS_LEAD + IH_FRAME_WIDTH_MAX + IH_BANDPASS_STEP)

struct ih_bandpass {
    int32_t width;
    int32_t rows_in; /* pushed so far, repeated ones included */
    bool is_bytes;   /* sums of bytes, else of 12 bits */
    /* Rings of sums of three pixels and of 1-2-1 sums, and the sums of three over the newest nine rows.
     * Index IH_BANDPASS_LEAD is pixel 0; edge pixels are repeated outside. The last have a sign
     * (IH_BANDPASS_NINE_SIGN). */
    alignas(IH_ALIGNMENT) uint16_t three[IH_BANDPASS_ROWS][IH_BANDPASS_SUMS];
    alignas(IH_ALIGNMENT) uint16_t binomial[IH_BANDPASS_KEPT][IH_BANDPASS_SUMS];
    alignas(IH_ALIGNMENT) union {
        uint16_t of_bytes[IH_BANDPASS_SUMS];
        uint32_t of_grey_q4[IH_BANDPASS_SUMS];
    } nine;
};

/* Pixels of a row that are listed together. */
#define IH_BANDPASS_GROUP 32
#define IH_BANDPASS_GROUPS (IH_FRAME_WIDTH_MAX / IH_BANDPASS_GROUP)

/* A row of R, and its groups with an R above their limit. */
struct ih_bandpass_row {
    /* [0 .. width - 1]; the last group is read to its end: what the caller put there counts. */
    int16_t *response;
    const int16_t *limit;              /* of each group, from 0 on; NULL: no group is listed */
    int32_t count;                     /* out: listed groups, from left to right, */
    int16_t first[IH_BANDPASS_GROUPS]; /* and the first pixel of each */
};

IH_BEGIN_DECLS

/* is_bytes: all rows will be pushed as bytes, else as grey levels of 12 bits. */
void ih_bandpass_begin(struct ih_bandpass *band, int32_t width, bool is_bytes);

/* Push a row. True: out holds the row IH_BANDPASS_REACH pushes ago; false: out is unchanged. */
bool ih_bandpass_push_bytes(struct ih_bandpass *band, const uint8_t *row,
                            struct ih_bandpass_row *out);
bool ih_bandpass_push_grey(struct ih_bandpass *band, const uint16_t *row_q4,
                           struct ih_bandpass_row *out);

/* Push the newest row once more, as at the frame's top and bottom. */
bool ih_bandpass_repeat(struct ih_bandpass *band, struct ih_bandpass_row *out);

/* Sums of the columns of the newest rows, at most IH_BANDPASS_KEPT of them. */
void ih_bandpass_columns(const struct ih_bandpass *band, int32_t rows, uint16_t *sum);

/* False only if no sum of three neighbouring columns, edge pixels repeated, of the newest IH_BANDPASS_KEPT
 * rows is above the limit. At least IH_BANDPASS_ROWS have been pushed. */
bool ih_bandpass_is_any_above(const struct ih_bandpass *band, int32_t limit);

/* R of the middle one of nine rows of bytes; nothing is pushed. */
void ih_bandpass_bytes(struct ih_bandpass *band, const uint8_t *const row[IH_BANDPASS_ROWS],
                       int32_t width, int16_t *response);

IH_END_DECLS

#endif
