/* ih_lanes - 16-bit numbers with sign side by side in a vector of x86 or of a 64-bit ARM, for what
 * compilers make no vectors of by themselves: comparisons that end in bits, and what leaves a loop early.
 *
 * IH_LANES: how many; where there are none, 0, the same is written out beside, with the same result.
 * IH_LANES_OP, on x86 alone: other instructions, as those of both widths differ by their names' beginning.
 */
#ifndef IH_LANES_H
#define IH_LANES_H

#include <stdbool.h>
#include <stdint.h>

#if defined __x86_64__ && defined __SSE2__
#include <immintrin.h>
#elif defined __aarch64__ && defined __ARM_NEON && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
#include <arm_neon.h>
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

static inline ih_lanes ih_lanes_max(ih_lanes a, ih_lanes b)
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

static inline ih_lanes ih_lanes_max(ih_lanes a, ih_lanes b)
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

#elif defined __aarch64__ && defined __ARM_NEON && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__

#define IH_LANES 8
typedef int16x8_t ih_lanes;

static inline ih_lanes ih_lanes_load(const int16_t *at)
{
    return vld1q_s16(at);
}

static inline ih_lanes ih_lanes_both(uint32_t both)
{
    return vreinterpretq_s16_u32(vdupq_n_u32(both));
}

static inline ih_lanes ih_lanes_max(ih_lanes a, ih_lanes b)
{
    return vmaxq_s16(a, b);
}

static inline ih_lanes ih_lanes_greater(ih_lanes a, ih_lanes b)
{
    return vreinterpretq_s16_u16(vcgtq_s16(a, b));
}

static inline ih_lanes ih_lanes_without(ih_lanes a, ih_lanes b)
{
    return vbicq_s16(a, b);
}

static inline bool ih_lanes_is_any(ih_lanes a)
{
    return vmaxvq_u16(vreinterpretq_u16_s16(a)) != 0;
}

/* There is no instruction for it: each lane leaves its own bit of a byte, and all of a half are added. */
static inline uint32_t ih_lanes_bits(ih_lanes a, ih_lanes b)
{
    const uint8x8_t bit = vcreate_u8(0x8040201008040201u);
    const uint32_t first = vaddv_u8(vand_u8(vmovn_u16(vreinterpretq_u16_s16(a)), bit));
    const uint32_t second = vaddv_u8(vand_u8(vmovn_u16(vreinterpretq_u16_s16(b)), bit));
    return first | second << 8;
}

#else

#define IH_LANES 0

#endif

#endif
