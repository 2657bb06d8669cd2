/* ih_lanes - 16-bit numbers with sign side by side in a vector of x86, for what compilers make no
 * vectors of by themselves: comparisons that end in bits, and what leaves a loop early.
 *
 * IH_LANES: how many; where there are none, 0, the same is written out beside, with the same result.
 */
#ifndef IH_LANES_H
#define IH_LANES_H

#include <stdbool.h>
#include <stdint.h>

#if defined __x86_64__ && defined __SSE2__
#include <immintrin.h>
#endif

#if defined __AVX2__

#define IH_LANES 16
typedef __m256i ih_lanes;
/* Intrinsics whose names differ by the width alone. */
#define IH_LANES_OP(name) _mm256_##name
#define IH_LANES_BITS(name) _mm256_##name##_si256

static inline void ih_lanes_store(ih_lanes value, void *at)
{
    _mm256_storeu_si256(at, value);
}

static inline ih_lanes ih_lanes_load(const void *at)
{
    return _mm256_loadu_si256(at);
}

/* Two numbers of 16 bits, over and over. */
static inline ih_lanes ih_lanes_both(uint32_t both)
{
    return _mm256_set1_epi32((int32_t)both);
}

static inline ih_lanes ih_lanes_greatest(ih_lanes a, ih_lanes b)
{
    return _mm256_max_epi16(a, b);
}

static inline ih_lanes ih_lanes_greater(ih_lanes a, ih_lanes b)
{
    return _mm256_cmpgt_epi16(a, b);
}

/* a where b is not. */
static inline ih_lanes ih_lanes_without(ih_lanes a, ih_lanes b)
{
    return _mm256_andnot_si256(b, a);
}

static inline bool ih_lanes_is_any(ih_lanes a)
{
    return _mm256_testz_si256(a, a) == 0;
}

/* A bit for each lane of two, the first one lowest. */
static inline uint32_t ih_lanes_bits(ih_lanes a, ih_lanes b)
{
    const ih_lanes halves = _mm256_permute4x64_epi64(_mm256_packs_epi16(a, b), 0xd8);
    return (uint32_t)_mm256_movemask_epi8(halves);
}

#elif defined __x86_64__ && defined __SSE2__

#define IH_LANES 8
typedef __m128i ih_lanes;
/* Intrinsics whose names differ by the width alone. */
#define IH_LANES_OP(name) _mm_##name
#define IH_LANES_BITS(name) _mm_##name##_si128

static inline void ih_lanes_store(ih_lanes value, void *at)
{
    _mm_storeu_si128(at, value);
}

static inline ih_lanes ih_lanes_load(const void *at)
{
    return _mm_loadu_si128(at);
}

static inline ih_lanes ih_lanes_both(uint32_t both)
{
    return _mm_set1_epi32((int32_t)both);
}

static inline ih_lanes ih_lanes_greatest(ih_lanes a, ih_lanes b)
{
    return _mm_max_epi16(a, b);
}

static inline ih_lanes ih_lanes_greater(ih_lanes a, ih_lanes b)
{
    return _mm_cmpgt_epi16(a, b);
}

static inline ih_lanes ih_lanes_without(ih_lanes a, ih_lanes b)
{
    return _mm_andnot_si128(b, a);
}

static inline bool ih_lanes_is_any(ih_lanes a)
{
    return _mm_movemask_epi8(a) != 0;
}

static inline uint32_t ih_lanes_bits(ih_lanes a, ih_lanes b)
{
    return (uint32_t)_mm_movemask_epi8(_mm_packs_epi16(a, b));
}

#else

#define IH_LANES 0

#endif

#endif
