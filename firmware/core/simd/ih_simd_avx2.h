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

/* |a|. */
static inline ih_i16 ih_i16_abs(ih_i16 a)
{
    return (ih_i16)_mm256_abs_epi16((__m256i)a);
}

static inline ih_i32 ih_i32_abs(ih_i32 a)
{
    return (ih_i32)_mm256_abs_epi32((__m256i)a);
}

/* a + 2 b */
static inline struct ih_u16_32 ih_u16_32_add_twice(struct ih_u16_32 a, struct ih_u16_32 b)
{
    return ih_u16_32_add(ih_u16_32_add(a, b), b);
}

/* a + 81 b / 16, rounded half up; b below 2^12. 81 / 16 is 8 * 20736 / 2^15. */
static inline struct ih_u16_32 ih_u16_32_add_81_16ths(struct ih_u16_32 a, struct ih_u16_32 b)
{
    const __m256i factor = _mm256_set1_epi16(81 << 8);
    for (int k = 0; k < IH_U16_PARTS; k++) {
        a.part[k] += (ih_u16)_mm256_mulhrs_epi16((__m256i)(b.part[k] << 3), factor);
    }
    return a;
}

/* Bytes i to i + 31 in the same way, one for each lane. */
static inline struct ih_u16_32 ih_u16_32_next_u8(const uint8_t **from, int32_t i)
{
    const __m128i *bytes = (const __m128i *)(const void *)&(*from)[i];
    return (struct ih_u16_32){{(ih_u16)_mm256_cvtepu8_epi16(_mm_loadu_si128(&bytes[0])),
                               (ih_u16)_mm256_cvtepu8_epi16(_mm_loadu_si128(&bytes[1]))}};
}

/* Eight lanes from there, and the next eight, where there are more, from so many lanes on. */
static inline ih_i16 ih_i16_load_eights(const int16_t *from, int32_t apart)
{
    const __m128i *first = (const __m128i *)(const void *)from;
    const __m128i *second = (const __m128i *)(const void *)&from[apart];
    return (ih_i16)_mm256_inserti128_si256(_mm256_castsi128_si256(_mm_loadu_si128(first)),
                                           _mm_loadu_si128(second), 1);
}

/* Eight lanes of a and eight of b in turn, clamped to 8 bits with sign. */
static inline ih_i8 ih_i16_pack_eights(ih_i16 a, ih_i16 b)
{
    return (ih_i8)_mm256_packs_epi16((__m256i)a, (__m256i)b);
}

/* Sums of eight bytes side by side. */
static inline ih_u64 ih_u8_sum_eights(ih_u8 a)
{
    return (ih_u64)_mm256_sad_epu8((__m256i)a, _mm256_setzero_si256());
}

/* Each even lane twice. */
static inline ih_i32 ih_i32_even_twice(ih_i32 a)
{
    return (ih_i32)_mm256_shuffle_epi32((__m256i)a, 0xa0);
}

static inline ih_u16 ih_u16_mul_high(ih_u16 a, ih_u16 b)
{
    return (ih_u16)_mm256_mulhi_epu16((__m256i)a, (__m256i)b);
}

/* The lower 16 bits of the lanes of a, then of b. */
static inline ih_i16 ih_i32_low_halves(ih_i32 a, ih_i32 b)
{
    const ih_i32 low = ih_i32_all(UINT16_MAX);
    const __m256i halves = _mm256_packus_epi32((__m256i)(a & low), (__m256i)(b & low));
    return (ih_i16)_mm256_permute4x64_epi64(halves, 0xd8);
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

/* Products of the lower 16 bits of each lane, with sign; the upper 16 bits of b must be 0. */
static inline ih_i32 ih_i32_mul_low(ih_i32 a, ih_i32 b)
{
    return ih_i16_madd_pairs((ih_i16)a, (ih_i16)b);
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

/* Whether one instruction loads or stores a list of vectors, and moves the address on. */
#define IH_SIMD_LISTS 0
/* Registers for vectors. */
#define IH_SIMD_REGISTERS 16

/* Is any lane above the limit? */
static inline bool ih_i16_any_above(ih_i16 a, int16_t limit)
{
    return ih_i16_any(a > ih_i16_all(limit));
}

/* A bit for each lane of two masks, the first lane lowest: 2 * IH_I16_LANES bits. */
static inline uint32_t ih_i16_bits(ih_i16 a, ih_i16 b)
{
    const __m256i bytes = _mm256_packs_epi16((__m256i)a, (__m256i)b);
    return (uint32_t)_mm256_movemask_epi8(_mm256_permute4x64_epi64(bytes, 0xd8));
}

/* The same of a whole 32 lanes. */
static inline uint32_t ih_i16_bits_32(const ih_i16 mask[32 / IH_I16_LANES])
{
    return ih_i16_bits(mask[0], mask[1]);
}

/* Sum of all lanes. */
static inline int32_t ih_i32_total(ih_i32 a)
{
    const __m128i four =
        _mm_add_epi32(_mm256_castsi256_si128((__m256i)a), _mm256_extracti128_si256((__m256i)a, 1));
    const __m128i two = _mm_add_epi32(four, _mm_shuffle_epi32(four, 0x4e));
    return _mm_cvtsi128_si32(_mm_add_epi32(two, _mm_shuffle_epi32(two, 0xb1)));
}

/* The same in 64 bits, which do not wrap. */
static inline int64_t ih_i32_total_wide(ih_i32 a)
{
    const __m256i low = _mm256_cvtepi32_epi64(_mm256_castsi256_si128((__m256i)a));
    const __m256i high = _mm256_cvtepi32_epi64(_mm256_extracti128_si256((__m256i)a, 1));
    const __m256i four = _mm256_add_epi64(low, high);
    const __m128i two =
        _mm_add_epi64(_mm256_castsi256_si128(four), _mm256_extracti128_si256(four, 1));
    return _mm_cvtsi128_si64(_mm_add_epi64(two, _mm_unpackhi_epi64(two, two)));
}

/* Shifts of each lane by its own count and look-ups are instructions. */
#define IH_SIMD_LANE_SHIFTS 1

/* Sums of madd_pairs. */
struct ih_pair_sums {
    ih_i32 sum;
};

static inline struct ih_pair_sums ih_pair_sums_first(ih_i16 a, ih_i16 b)
{
    return (struct ih_pair_sums){ih_i16_madd_pairs(a, b)};
}

static inline struct ih_pair_sums ih_pair_sums_add(struct ih_pair_sums sums, ih_i16 a, ih_i16 b)
{
    return (struct ih_pair_sums){ih_i32_add(sums.sum, ih_i16_madd_pairs(a, b))};
}

static inline ih_i32 ih_pair_sums_total(struct ih_pair_sums sums)
{
    return sums.sum;
}

/* Here a has the even lanes of 32 bits and b the odd ones. */
static inline ih_i32 ih_i32_odd(ih_i32 a)
{
    return (ih_i32)_mm256_shuffle_epi32((__m256i)a, 0xf5);
}

/* Whole products. */
static inline struct ih_wide ih_i32_mul_wide(ih_i32 a, ih_i32 b)
{
    return (struct ih_wide){ih_i32_mul_even(a, b), ih_i32_mul_even(ih_i32_odd(a), ih_i32_odd(b))};
}

static inline struct ih_wide ih_u32_mul_wide(ih_u32 a, ih_u32 b)
{
    const ih_u32 a_odd = (ih_u32)ih_i32_odd((ih_i32)a), b_odd = (ih_u32)ih_i32_odd((ih_i32)b);
    return (struct ih_wide){(ih_i64)ih_u32_mul_even(a, b), (ih_i64)ih_u32_mul_even(a_odd, b_odd)};
}

/* The lower halves, in the order of the lanes. */
static inline ih_u32 ih_wide_low(struct ih_wide x)
{
    return (ih_u32)_mm256_blend_epi32((__m256i)x.a, _mm256_slli_epi64((__m256i)x.b, 32), 0xaa);
}

/* The numbers in the order of the lanes. */
static inline struct ih_wide ih_wide_in_order(struct ih_wide x)
{
    const __m256i first = _mm256_unpacklo_epi64((__m256i)x.a, (__m256i)x.b); /* 0 1, 4 5 */
    const __m256i last = _mm256_unpackhi_epi64((__m256i)x.a, (__m256i)x.b);  /* 2 3, 6 7 */
    return (struct ih_wide){(ih_i64)_mm256_permute2x128_si256(first, last, 0x20),
                            (ih_i64)_mm256_permute2x128_si256(first, last, 0x31)};
}

static inline int64_t ih_i64_total(ih_i64 a)
{
    const __m128i two =
        _mm_add_epi64(_mm256_castsi256_si128((__m256i)a), _mm256_extracti128_si256((__m256i)a, 1));
    return _mm_cvtsi128_si64(_mm_add_epi64(two, _mm_unpackhi_epi64(two, two)));
}

/* Sums of whole products. */
struct ih_wide_sums {
    struct ih_wide sum;
};

static inline struct ih_wide_sums ih_wide_sums_zero(void)
{
    return (struct ih_wide_sums){ih_wide_all(0)};
}

/* Add a * b; a below 2^31. */
static inline struct ih_wide_sums ih_wide_sums_add(struct ih_wide_sums sums, ih_u32 a, ih_i32 b)
{
    return (struct ih_wide_sums){ih_wide_add(sums.sum, ih_i32_mul_wide((ih_i32)a, b))};
}

static inline struct ih_wide ih_wide_sums_total(struct ih_wide_sums sums)
{
    return sums.sum;
}

/* table[at] and table[at + 1] of each lane. */
static inline struct ih_u32_neighbours ih_u32_look_up(const uint32_t *table, ih_u32 at)
{
    return (struct ih_u32_neighbours){
        (ih_u32)_mm256_i32gather_epi32((const int *)table, (__m256i)at, 4),
        (ih_u32)_mm256_i32gather_epi32((const int *)&table[1], (__m256i)at, 4)};
}

/* The same of a table of 16 bits. */
static inline struct ih_u32_neighbours ih_u32_look_up_u16(const uint16_t *table, ih_u32 at)
{
    const ih_u32 both =
        (ih_u32)_mm256_i32gather_epi32((const int *)(const void *)table, (__m256i)at, 2);
    return (struct ih_u32_neighbours){both & UINT16_MAX, both >> 16};
}

/* Half of the leading zeros, rounded down, of 2^18 .. 2^31 - 1. There is no instruction for it. */
static inline ih_u32 ih_u32_zero_pairs(ih_u32 a)
{
    ih_i32 pairs = ih_i32_all(6);
    for (int bit = 20; bit <= 30; bit += 2) {
        pairs = ih_i32_add(pairs, (ih_i32)a > ih_i32_all((1 << bit) - 1));
    }
    return (ih_u32)pairs;
}

#endif
