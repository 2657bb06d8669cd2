/* ih_scanline - one row of a frame's pixels, and its grey levels in 12 bits.
 *
 * In:     samples of 8 to 16 bits with any full scale.
 * Out:    grey levels in Q4: 255 of an 8-bit sensor becomes 4080.
 * Error:  samples deeper than 8 bits are rounded to 12 bits.
 */
#ifndef IH_SCANLINE_H
#define IH_SCANLINE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"

/* Full scale in 12 bits. */
#define IH_SCANLINE_FULL_Q4 4080

/* Format as in struct ih_frame. */
struct ih_scanline {
    const void *samples;
    int32_t bytes_per_sample;
    int32_t maximum;
};

IH_BEGIN_DECLS

struct ih_scanline ih_frame_scanline(const struct ih_frame *frame, int32_t v);

/* Are its samples bytes with 255 as full scale? Filters then take them without conversion. */
bool ih_scanline_is_bytes(const struct ih_scanline *row);

void ih_scanline_grey(const struct ih_scanline *row, int32_t width, uint16_t *grey_q4);

IH_END_DECLS

#endif
