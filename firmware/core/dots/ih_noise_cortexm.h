/* ih_noise_cortexm - the noise's kernel for a Cortex-M, two values in a word. */
#ifndef IH_NOISE_CORTEXM_H
#define IH_NOISE_CORTEXM_H

#include <stdint.h>

#include "dots/ih_block_median.h"
#include "dots/ih_noise.h"
#include "simd/ih_simd_cortexm.h"

/* Unrolled by hand: gcc 12 does not unroll at -O2. */
static inline int32_t count_up_to(const int16_t *value, int16_t limit)
{
    const uint32_t one = ih_word_in_register(IH_WORD_ALL(1));
    const uint32_t raised = IH_WORD_ALL(limit) + IH_WORD_ALL(0x8000);
    uint32_t count = 0;
    for (int32_t i = 0; i < IH_BLOCK_MEDIAN_ROWS * IH_NOISE_BLOCK; i += 8) {
        count += (raised - ih_word_load(&value[i])) >> 15 & one;
        count += (raised - ih_word_load(&value[i + 2])) >> 15 & one;
        count += (raised - ih_word_load(&value[i + 4])) >> 15 & one;
        count += (raised - ih_word_load(&value[i + 6])) >> 15 & one;
    }
    return (int32_t)((count & UINT16_MAX) + (count >> 16));
}

#endif
