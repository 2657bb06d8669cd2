/* ih_bandpass - rows of a frame through a band-pass that answers to spots of a dot's size.
 *
 * In:    rows from top to bottom, 8 to 16 bits a sample.
 * Out:   the response R of a row, IH_BANDPASS_REACH rows later; where it is above a limit, by groups of
 *        IH_BANDPASS_GROUP pixels: most have nothing, and need not be looked at again.
 * Way:   grey levels are brought to 12 bits (255 of an 8-bit sensor = 4080). With the 3x3 binomial
 *        sum I (weight 16) and the 9x9 box sum B (weight 81), edge pixels repeated outside,
 *        R = (81 I - 16 B) / 256, rounded. A constant gives 0; IH_BANDPASS_UNIT units of R are one grey
 *        level of 8 bits. Rows of bytes with 255 as full scale are summed as they are: with the sums
 *        i = I / 16 and b = B / 16 of theirs R = (81 i + 8) / 16 - b, rounded down, and that is
 *        5 i + (i + 8) / 16 - b.
 *        A row's sums of three pixels join those of the eight rows before in a running sum per pixel:
 *        three of them, three pixels apart, are B. Its sums 1-2-1 of three rows, 1-2-1 again, are I.
 * Range: grey <= 4080, 4144 after an ambient frame was subtracted (ih_noise). I <= 66,304, so
 *        81 I <= 2^22.4, less what the nine bright pixels add to the box: |R| <= 18,648, 16 bits.
 *        Sums of three pixels of nine rows <= 111,888; over 81 <= 335,664. Of bytes 81 i / 16 and
 *        b <= 20,655: everything is in 16 bits.
 * Cost:  19 rows of 16 bits; about 22 operations per pixel of 16 bits, none of which waits for its
 *        neighbour's, so that vectors take 8 or 16 at once; two pixels a word 20 a pixel.
 * Error: R within half a unit (0.006 grey levels) of the exact filter; samples deeper than 8 bits are
 *        rounded to 12 bits before.
 */
#ifndef IH_BANDPASS_H
#define IH_BANDPASS_H

#include <stdalign.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"

/* Half width of the box; rows needed before a row's response is known. */
#define IH_BANDPASS_REACH 4
#define IH_BANDPASS_ROWS (2 * IH_BANDPASS_REACH + 1)
/* One 8-bit grey level in units of R. */
#define IH_BANDPASS_UNIT 81
/* Full scale in 12 bits. */
#define IH_BANDPASS_FULL_Q4 4080

/* One row of samples; format as in struct ih_frame. */
struct ih_scanline {
    const void *samples;
    int32_t bytes_per_sample;
    int32_t maximum;
};

/* Rows of 1-2-1 that are kept. */
#define IH_BANDPASS_KEPT 8
/* Pixels that the loops take at once; what they find behind a row's end is not used. */
#define IH_BANDPASS_STEP 32
/* Sums of three pixels that are needed to the left and right of a row of R, */
#define IH_BANDPASS_SIDE (IH_BANDPASS_REACH - 1)
/* and those that there is room for to its left, so that a row's own are aligned. */
#define IH_BANDPASS_LEAD (IH_ALIGNMENT / 2)
#define IH_BANDPASS_SUMS (IH_BANDPASS_LEAD + IH_FRAME_WIDTH_MAX + IH_BANDPASS_STEP)

struct ih_bandpass {
    int32_t width;
    int32_t rows_in; /* pushed so far, repeated ones included */
    bool is_bytes;   /* sums of bytes, else of 12 bits */
    /* Of three pixels around each, from IH_BANDPASS_LEAD to the left of the frame on, edge pixels repeated
     * outside: rings of sums and of 1-2-1, and sums of the newest nine rows. */
    alignas(IH_ALIGNMENT) uint16_t three[IH_BANDPASS_ROWS][IH_BANDPASS_SUMS];
    alignas(IH_ALIGNMENT) uint16_t binomial[IH_BANDPASS_KEPT][IH_BANDPASS_SUMS];
    alignas(IH_ALIGNMENT) union {
        uint16_t of_bytes[IH_BANDPASS_SUMS];
        uint32_t of_grey_q4[IH_BANDPASS_SUMS];
    } nine;
};

IH_BEGIN_DECLS

struct ih_scanline ih_frame_scanline(const struct ih_frame *frame, int32_t v);

/* Can its samples be pushed as they are? */
bool ih_scanline_is_bytes(const struct ih_scanline *row);

/* A row's samples in 12 bits. */
void ih_scanline_grey(const struct ih_scanline *row, int32_t width, uint16_t *grey_q4);

/* Pixels of a row that are listed together. */
#define IH_BANDPASS_GROUP 32
#define IH_BANDPASS_GROUPS (IH_FRAME_WIDTH_MAX / IH_BANDPASS_GROUP)

/* Where a row of R goes, and which of its groups have something above a limit. */
struct ih_bandpass_row {
    /* [0 .. width - 1]; the last group is read to its end, and what is there already counts. */
    int16_t *response;
    /* Of each group, 0 to 32767 in both halves; or NULL: nothing is listed. */
    const uint32_t *limit;
    int32_t count;                     /* out: groups, from left to right, */
    int16_t first[IH_BANDPASS_GROUPS]; /* and the first pixel of each */
};

/* is_bytes: all rows will be pushed as bytes, else as grey levels of 12 bits. */
void ih_bandpass_begin(struct ih_bandpass *band, int32_t width, bool is_bytes);

/* Push a row. True: out is that of the row IH_BANDPASS_REACH pushes ago; else it is left as it is. */
bool ih_bandpass_push_bytes(struct ih_bandpass *band, const uint8_t *row,
                            struct ih_bandpass_row *out);
bool ih_bandpass_push_grey(struct ih_bandpass *band, const uint16_t *row_q4,
                           struct ih_bandpass_row *out);

/* Sums of the columns of the newest rows, at most IH_BANDPASS_KEPT of them. */
void ih_bandpass_columns(const struct ih_bandpass *band, int32_t rows, uint16_t *sum);

/* False only if no sum of three neighbouring columns, edge pixels repeated, of the newest IH_BANDPASS_KEPT
 * rows is greater than the limit. At least IH_BANDPASS_ROWS have been pushed. */
bool ih_bandpass_is_any_above(const struct ih_bandpass *band, int32_t limit);

/* R of the middle one of nine rows of bytes; nothing is pushed. ahead: so many bytes on from each of them
 * is one that will be looked at next, or 0. */
void ih_bandpass_bytes(struct ih_bandpass *band, const uint8_t *const row[IH_BANDPASS_ROWS],
                       int32_t width, size_t ahead, int16_t *response);

/* The newest row once more, as is done at the frame's top and bottom. */
bool ih_bandpass_repeat(struct ih_bandpass *band, struct ih_bandpass_row *out);

IH_END_DECLS

#endif
