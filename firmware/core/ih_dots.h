/* ih_dots - find projected laser dots in one grey frame (paper, section 2.2).
 *
 * In:    rows of the frame from top to bottom; pixel centres at integer coordinates.
 * Out:   dots by row, then column: sub-pixel centres in the frame's own (distorted) pixels; a map
 *        of over-exposed blocks; counters of what was dropped.
 * Way:   grey levels are brought to 12 bits (255 of an 8-bit sensor = 4080). Band-pass
 *        R = 81 * (3x3 binomial sum, weight 16) - 16 * (9x9 box sum, weight 81), edge pixels
 *        repeated outside: exact integers, R / 1296 is the response in 12-bit grey levels.
 *        R > threshold makes runs, runs that touch (8 neighbours) make blobs, the centre is the
 *        mean of the pixel centres weighted by floor(R / 256)^2. Threshold = max(floor, gain *
 *        median |R|), the median over a sparse sample of the frame (ih_dots_noise).
 * Cost:  one pass; IH_DOTS_ROWS rows of scratch, no copy of the frame. About 30 integer
 *        operations per pixel.
 * Error: centres within 0.01 px of the float64 reference (same formula; only Q12 rounding).
 * Full tables drop and count: dots_dropped, runs_dropped.
 */
#ifndef IH_DOTS_H
#define IH_DOTS_H

#include <stdbool.h>
#include <stdint.h>

#include "ih_config.h"
#include "ih_types.h"

/* Most dots kept per frame. Each costs 12 bytes here and 10 in ih_labels. */
#ifndef IH_DOTS_MAX
#define IH_DOTS_MAX 1024
#endif
#if IH_DOTS_MAX < IH_SLOTS || IH_DOTS_MAX > 4096
#error "IH_DOTS_MAX must be in 361..4096"
#endif
/* Most blobs that can be open (touch the current row) at once. Each costs 96 bytes. */
#define IH_DOTS_OPEN_MAX 256
/* Half width of the outer box; rows needed before a row's response is known. */
#define IH_DOTS_REACH 4
#define IH_DOTS_ROWS (2 * IH_DOTS_REACH + 1)
/* One 12-bit grey level in units of R. */
#define IH_DOTS_RESPONSE_UNIT 1296
/* The noise is measured to 1/16 of a 12-bit grey level, up to 16 8-bit grey levels. */
#define IH_DOTS_NOISE_BIN (IH_DOTS_RESPONSE_UNIT / 16)
#define IH_DOTS_NOISE_BINS 4096
#define IH_DOTS_NOISE_STEP 8
/* Side of the blocks of the over-exposure map. */
#define IH_DOTS_BLOCK 8
#define IH_DOTS_BLOCKS_X (IH_FRAME_WIDTH_MAX / IH_DOTS_BLOCK)
#define IH_DOTS_BLOCKS_Y (IH_FRAME_HEIGHT_MAX / IH_DOTS_BLOCK)

struct ih_dots_params {
    int32_t floor_grey_q4; /* least threshold, 8-bit grey levels in Q4 */
    int32_t noise_gain_q8; /* threshold in medians of |R| */
    int32_t area_min_px;   /* blobs outside these limits are not dots */
    int32_t area_max_px;
    int32_t extent_max_px; /* longest side of the bounding box */
    int32_t bright_grey;   /* block mean above this (0..255) = over-exposed */
};

struct ih_dot {
    int32_t u_px_q12, v_px_q12;
    int32_t peak; /* largest R */
};

struct ih_dots {
    int32_t dot_count;
    int32_t threshold; /* in units of R */
    /* blobs refused, by reason */
    int32_t small_count, large_count;
    /* lost because a table was full */
    int32_t dots_dropped, runs_dropped;
    struct ih_dot dot[IH_DOTS_MAX];
    /* bit per block, row by row: 1 = over-exposed */
    uint32_t bright[IH_DOTS_BLOCKS_Y][(IH_DOTS_BLOCKS_X + 31) / 32];
};

/* A blob being collected. */
struct ih_dots_blob {
    int64_t weight_u, weight_v, weight; /* sums of w u, w v, w; w = (R / 2^8)^2 */
    int32_t area_px, peak;
    int16_t u_min, u_max, v_min, v_max;
};

struct ih_dots_run {
    int16_t u_first, u_last;
    int16_t blob; /* index into blob[] */
};

struct ih_dots_scratch {
    uint16_t noise_histogram[IH_DOTS_NOISE_BINS];
    int32_t width, height;
    int32_t rows_in; /* pushed into the ring, repeated border rows included */
    struct ih_dots_params params;
    int32_t block_rows;                                 /* rows in block_sum */
    uint16_t incoming_q4[IH_FRAME_WIDTH_MAX];           /* the newest row */
    uint16_t grey_q4[IH_DOTS_ROWS][IH_FRAME_WIDTH_MAX]; /* ring of rows */
    uint32_t column_sum[IH_FRAME_WIDTH_MAX];            /* of the ring, for the outer box */
    uint32_t block_sum[IH_DOTS_BLOCKS_X];
    int32_t response[IH_FRAME_WIDTH_MAX];
    int32_t run_count, previous_count;
    struct ih_dots_run run[IH_DOTS_OPEN_MAX], previous[IH_DOTS_OPEN_MAX];
    struct ih_dots_blob blob[2 * IH_DOTS_OPEN_MAX];
    int16_t parent[2 * IH_DOTS_OPEN_MAX]; /* union-find; IH_NONE = free */
};

void ih_dots_params_default(struct ih_dots_params *params);

/* Median of |R| over every 8th pixel of every 8th row, in units of R: the frame's noise. Rounded
 * up to a multiple of IH_DOTS_NOISE_BIN; at most IH_DOTS_NOISE_BINS of them. */
int32_t ih_dots_noise(const struct ih_frame *frame, struct ih_dots_scratch *scratch);

/* Rows as they come: begin, then row height times, then end. noise as from ih_dots_noise, of this
 * frame or of the last one. */
void ih_dots_begin(struct ih_dots_scratch *scratch, struct ih_dots *out,
                   const struct ih_dots_params *params, int32_t width, int32_t height,
                   int32_t noise);
void ih_dots_row(struct ih_dots_scratch *scratch, struct ih_dots *out, const void *samples,
                 int32_t bytes_per_sample, int32_t maximum);
void ih_dots_end(struct ih_dots_scratch *scratch, struct ih_dots *out);

/* The whole frame in one call: noise, begin, rows, end. The frame's view has been checked. */
void ih_dots_find(const struct ih_frame *frame, const struct ih_dots_params *params,
                  struct ih_dots_scratch *scratch, struct ih_dots *out);

/* Is the frame's block at this pixel over-exposed? Outside the frame: false. */
bool ih_dots_is_bright(const struct ih_dots *dots, int32_t u_px, int32_t v_px);

#endif
