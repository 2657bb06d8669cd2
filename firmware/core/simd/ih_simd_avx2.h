/* ih_simd_avx2 - the part of ih_simd's vocabulary that needs instructions by name, for AVX2. */
#ifndef IH_SIMD_AVX2_H
#define IH_SIMD_AVX2_H

#include <immintrin.h>

static inline ih_i16 ih_i16_min(ih_i16 a, ih_i16 b)
{
    return (ih_i16)_mm256_min_epi16((__m256i)a, (__m256i)b);
}

static inline ih_i16 ih_i16_max(ih_i16 a, ih_i16 b)
{
    return (ih_i16)_mm256_max_epi16((__m256i)a, (__m256i)b);
}

/* The upper halves of the products. */
static inline ih_i16 ih_i16_mul_high(ih_i16 a, ih_i16 b)
{
    return (ih_i16)_mm256_mulhi_epi16((__m256i)a, (__m256i)b);
}

/* Sums of two products side by side, 32 bits each. */
static inline ih_i32 ih_i16_madd_pairs(ih_i16 a, ih_i16 b)
{
    return (ih_i32)_mm256_madd_epi16((__m256i)a, (__m256i)b);
}

static inline ih_i32 ih_i32_min(ih_i32 a, ih_i32 b)
{
    return (ih_i32)_mm256_min_epi32((__m256i)a, (__m256i)b);
}

static inline ih_i32 ih_i32_max(ih_i32 a, ih_i32 b)
{
    return (ih_i32)_mm256_max_epi32((__m256i)a, (__m256i)b);
}

/* Whole products of the even lanes, 64 bits each. */
static inline ih_i64 ih_i32_mul_even(ih_i32 a, ih_i32 b)
{
    return (ih_i64)_mm256_mul_epi32((__m256i)a, (__m256i)b);
}

static inline ih_u64 ih_u32_mul_even(ih_u32 a, ih_u32 b)
{
    return (ih_u64)_mm256_mul_epu32((__m256i)a, (__m256i)b);
}

/* Is any bit of any lane set? */
static inline bool ih_i16_any(ih_i16 a)
{
    return _mm256_testz_si256((__m256i)a, (__m256i)a) == 0;
}

/* A bit for each lane of two masks, the first lane lowest: 2 * IH_I16_LANES bits. */
static inline uint32_t ih_i16_bits(ih_i16 a, ih_i16 b)
{
    const __m256i bytes = _mm256_packs_epi16((__m256i)a, (__m256i)b);
    return (uint32_t)_mm256_movemask_epi8(_mm256_permute4x64_epi64(bytes, 0xd8));
}

/* Sum of all lanes. */
static inline int32_t ih_i32_total(ih_i32 a)
{
    const __m128i four =
        _mm_add_epi32(_mm256_castsi256_si128((__m256i)a), _mm256_extracti128_si256((__m256i)a, 1));
    const __m128i two = _mm_add_epi32(four, _mm_shuffle_epi32(four, 0x4e));
    return _mm_cvtsi128_si32(_mm_add_epi32(two, _mm_shuffle_epi32(two, 0xb1)));
}

static inline int32_t ih_i16_total(ih_i16 a)
{
    return ih_i32_total(ih_i16_madd_pairs(a, ih_i16_all(1)));
}

#endif
