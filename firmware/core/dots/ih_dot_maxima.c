#include "dots/ih_dot_maxima.h"

#include <stdbool.h>

#include "simd/ih_simd.h"
#include "simd/ih_simd_cortexm.h"

#define GROUP IH_BANDPASS_GROUP

#if !IH_CORTEXM && IH_I16_LANES > 0
/* Maxima above the limit: greater than all neighbours before, not below any after. */
static inline ih_i16 find_lanes(const int16_t *above, const int16_t *middle, const int16_t *below,
                                int16_t limit)
{
    const ih_i16 peak = ih_i16_load(middle);
    const ih_i16 before = ih_i16_max(ih_i16_max(ih_i16_load(&above[-1]), ih_i16_load(above)),
                                     ih_i16_max(ih_i16_load(&above[1]), ih_i16_load(&middle[-1])));
    const ih_i16 after = ih_i16_max(ih_i16_max(ih_i16_load(&below[-1]), ih_i16_load(below)),
                                    ih_i16_max(ih_i16_load(&below[1]), ih_i16_load(&middle[1])));
    return (peak > ih_i16_max(before, ih_i16_all(limit))) & (peak >= after);
}

static inline uint32_t find_maxima(const int16_t *above, const int16_t *middle,
                                   const int16_t *below, int16_t limit)
{
    ih_i16 is_maximum[GROUP / IH_I16_LANES];
    for (int32_t i = 0; i < GROUP / IH_I16_LANES; i++) {
        const int32_t u = i * IH_I16_LANES;
        is_maximum[i] = find_lanes(&above[u], &middle[u], &below[u], limit);
    }
    return ih_i16_bits_32(is_maximum);
}
#else
static inline bool is_maximum(const int16_t *above, const int16_t *middle, const int16_t *below,
                              int16_t limit)
{
    const int16_t peak = middle[0];
    return peak > limit && peak > middle[-1] && peak >= middle[1] && peak > above[-1] &&
           peak > above[0] && peak > above[1] && peak >= below[-1] && peak >= below[0] &&
           peak >= below[1];
}

#if IH_CORTEXM
/* Two pixels are skipped together where none is above the limit. */
static inline uint32_t find_maxima(const int16_t *above, const int16_t *middle,
                                   const int16_t *below, int16_t limit)
{
    const uint32_t word = IH_WORD_ALL(limit);
    uint32_t maxima = 0;
    for (int32_t u = 0; u < GROUP; u += 2) {
        if ((ih_word_below(word, ih_word_load(&middle[u])) & IH_WORD_SIGNS) != 0) {
            const int32_t next = u + 1;
            maxima |= (uint32_t)is_maximum(&above[u], &middle[u], &below[u], limit) << u;
            maxima |= (uint32_t)is_maximum(&above[next], &middle[next], &below[next], limit)
                      << next;
        }
    }
    return maxima;
}
#else
static inline uint32_t find_maxima(const int16_t *above, const int16_t *middle,
                                   const int16_t *below, int16_t limit)
{
    uint32_t maxima = 0;
    for (int32_t u = 0; u < GROUP; u++) {
        maxima |= (uint32_t)is_maximum(&above[u], &middle[u], &below[u], limit) << u;
    }
    return maxima;
}
#endif
#endif

/* Appended without a branch: a group without maxima is overwritten by the next. */
void ih_dot_maxima_mark(const struct ih_bandpass_row *listed, const int16_t *above,
                        const int16_t *middle, const int16_t *below, struct ih_dot_maxima *out)
{
    int32_t count = 0;
    for (int32_t i = 0; i < listed->count; i++) {
        const int32_t first = listed->first[i];
        const int16_t limit = listed->limit[(uint32_t)first / GROUP];
        const uint32_t maxima = find_maxima(&above[first], &middle[first], &below[first], limit);
        out->first[count] = (int16_t)first;
        out->maxima[count] = maxima;
        count += maxima != 0;
    }
    out->count = count;
}
