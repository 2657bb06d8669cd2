#include "dots/ih_scanline.h"

#include <stddef.h>

struct ih_scanline ih_frame_scanline(const struct ih_frame *frame, int32_t v)
{
    return (struct ih_scanline){
        .samples = (const uint8_t *)frame->samples + (size_t)v * (size_t)frame->stride_bytes,
        .bytes_per_sample = frame->bytes_per_sample,
        .maximum = frame->maximum,
    };
}

bool ih_scanline_is_bytes(const struct ih_scanline *row)
{
    return row->bytes_per_sample == 1 && row->maximum == UINT8_MAX;
}

/* Bytes times a whole number: nothing is rounded, and products fit in 16 bits. */
static void multiply_bytes(const uint8_t *bytes, int32_t width, uint16_t maximum, uint16_t gain,
                           uint16_t *grey_q4)
{
    for (int32_t u = 0; u < width; u++) {
        const uint16_t sample = bytes[u] < maximum ? bytes[u] : maximum;
        grey_q4[u] = (uint16_t)(sample * gain);
    }
}

void ih_scanline_grey(const struct ih_scanline *row, int32_t width, uint16_t *grey_q4)
{
    const uint32_t maximum = (uint32_t)row->maximum;
    const uint32_t gain_q16 = (IH_SCANLINE_FULL_Q4 * 65536u + maximum / 2) / maximum;
    const uint8_t *bytes = row->samples;
    const uint16_t *words = row->samples;
    if (row->bytes_per_sample == 1 && gain_q16 % 65536u == 0) {
        multiply_bytes(bytes, width, (uint16_t)maximum, (uint16_t)(gain_q16 >> 16), grey_q4);
        return;
    }
    for (int32_t u = 0; u < width; u++) {
        uint32_t sample = row->bytes_per_sample == 1 ? bytes[u] : words[u];
        if (sample > maximum) {
            sample = maximum;
        }
        grey_q4[u] = (uint16_t)((sample * gain_q16 + 32768u) >> 16);
    }
}
