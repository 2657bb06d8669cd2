#include "dots/ih_dot_maxima.h"

#include <stdbool.h>

#include "simd/ih_simd.h"
#include "simd/ih_simd_cortexm.h"

#define GROUP IH_BANDPASS_GROUP

#if !IH_CORTEXM && IH_I16_LANES > 0
static inline struct ih_u16_32 load(const int16_t *response)
{
    const uint16_t *from = (const uint16_t *)response;
    return ih_u16_32_next(&from, 0);
}

static inline struct ih_u16_32 largest_of(const int16_t *row, const int16_t *beside)
{
    const struct ih_u16_32 two = ih_u16_32_larger(load(&row[-1]), load(row));
    return ih_u16_32_larger(ih_u16_32_larger(two, load(&row[1])), load(beside));
}

/* Maxima above the limit: greater than all neighbours before, not below any after. */
__attribute__((always_inline)) static inline uint32_t
find_maxima(const int16_t *above, const int16_t *middle, const int16_t *below, int16_t limit)
{
    const struct ih_u16_32 before = largest_of(above, &middle[-1]);
    const struct ih_u16_32 after = largest_of(below, &middle[1]);
    const struct ih_u16_32 all = load(middle);
    ih_i16 is_maximum[IH_U16_PARTS];
    for (int32_t k = 0; k < IH_U16_PARTS; k++) {
        const ih_i16 peak = (ih_i16)all.part[k];
        is_maximum[k] = (peak > ih_i16_max((ih_i16)before.part[k], ih_i16_all(limit))) &
                        (peak >= (ih_i16)after.part[k]);
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
