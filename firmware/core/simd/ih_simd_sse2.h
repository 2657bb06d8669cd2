/* ih_simd_sse2 - the part of ih_simd's vocabulary that needs instructions by name, for SSE2. */
#ifndef IH_SIMD_SSE2_H
#define IH_SIMD_SSE2_H

#include <emmintrin.h>

static inline ih_i16 ih_i16_min(ih_i16 a, ih_i16 b)
{
    return (ih_i16)_mm_min_epi16((__m128i)a, (__m128i)b);
}

static inline ih_i16 ih_i16_max(ih_i16 a, ih_i16 b)
{
    return (ih_i16)_mm_max_epi16((__m128i)a, (__m128i)b);
}

static inline ih_i16 ih_i16_abs(ih_i16 a)
{
    return ih_i16_max(a, ih_i16_sub((ih_i16){0}, a));
}

static inline ih_i32 ih_i32_abs(ih_i32 a)
{
    const ih_i32 sign = a >> 31;
    return ih_i32_sub(a ^ sign, sign);
}

static inline struct ih_u16_32 ih_u16_32_add_twice(struct ih_u16_32 a, struct ih_u16_32 b)
{
    return ih_u16_32_add(ih_u16_32_add(a, b), b);
}

/* The average with 0 rounds half up. */
static inline struct ih_u16_32 ih_u16_32_add_81_16ths(struct ih_u16_32 a, struct ih_u16_32 b)
{
    const __m128i factor = (__m128i)ih_u16_all(81 << 9);
    for (int k = 0; k < IH_U16_PARTS; k++) {
        const __m128i twice = _mm_mulhi_epu16((__m128i)(b.part[k] << 4), factor);
        a.part[k] += (ih_u16)_mm_avg_epu16(twice, _mm_setzero_si128());
    }
    return a;
}

static inline struct ih_u16_32 ih_u16_32_next_u8(const uint8_t **from, int32_t i)
{
    const __m128i *bytes = (const __m128i *)(const void *)&(*from)[i];
    const __m128i low = _mm_loadu_si128(&bytes[0]), high = _mm_loadu_si128(&bytes[1]);
    const __m128i zero = _mm_setzero_si128();
    return (struct ih_u16_32){
        {(ih_u16)_mm_unpacklo_epi8(low, zero), (ih_u16)_mm_unpackhi_epi8(low, zero),
         (ih_u16)_mm_unpacklo_epi8(high, zero), (ih_u16)_mm_unpackhi_epi8(high, zero)}};
}

static inline ih_i16 ih_i16_load_eights(const int16_t *from, int32_t apart)
{
    (void)apart;
    return ih_i16_load(from);
}

static inline ih_i8 ih_i16_pack_eights(ih_i16 a, ih_i16 b)
{
    return (ih_i8)_mm_packs_epi16((__m128i)a, (__m128i)b);
}

static inline ih_u64 ih_u8_sum_eights(ih_u8 a)
{
    return (ih_u64)_mm_sad_epu8((__m128i)a, _mm_setzero_si128());
}

static inline ih_i32 ih_i32_even_twice(ih_i32 a)
{
    return (ih_i32)_mm_shuffle_epi32((__m128i)a, 0xa0);
}

static inline ih_u16 ih_u16_mul_high(ih_u16 a, ih_u16 b)
{
    return (ih_u16)_mm_mulhi_epu16((__m128i)a, (__m128i)b);
}

static inline ih_i16 ih_i32_low_halves(ih_i32 a, ih_i32 b)
{
    const ih_i32 first = ih_i32_shift_left(a, 16) >> 16, second = ih_i32_shift_left(b, 16) >> 16;
    return (ih_i16)_mm_packs_epi32((__m128i)first, (__m128i)second);
}

static inline ih_i32 ih_i16_madd_pairs(ih_i16 a, ih_i16 b)
{
    return (ih_i32)_mm_madd_epi16((__m128i)a, (__m128i)b);
}

static inline ih_i32 ih_i32_min(ih_i32 a, ih_i32 b)
{
    return ih_i32_pick(a < b, a, b);
}

static inline ih_i32 ih_i32_max(ih_i32 a, ih_i32 b)
{
    return ih_i32_pick(a > b, a, b);
}

static inline ih_i32 ih_i32_mul_low(ih_i32 a, ih_i32 b)
{
    return ih_i16_madd_pairs((ih_i16)a, (ih_i16)b);
}

static inline ih_u64 ih_u32_mul_even(ih_u32 a, ih_u32 b)
{
    return (ih_u64)_mm_mul_epu32((__m128i)a, (__m128i)b);
}

/* SSE2 multiplies without sign alone: what a sign adds to the upper half is taken off. */
static inline ih_i64 ih_i32_mul_even(ih_i32 a, ih_i32 b)
{
    const ih_i32 signs = ih_i32_add((a >> 31) & b, (b >> 31) & a);
    return ih_i64_sub((ih_i64)ih_u32_mul_even((ih_u32)a, (ih_u32)b),
                      (ih_i64)_mm_slli_epi64((__m128i)signs, 32));
}

static inline bool ih_i16_any(ih_i16 a)
{
    return _mm_movemask_epi8(_mm_cmpeq_epi8((__m128i)a, _mm_setzero_si128())) != 0xffff;
}

#define IH_SIMD_LISTS 0
#define IH_SIMD_REGISTERS 16

static inline bool ih_i16_any_above(ih_i16 a, int16_t limit)
{
    return ih_i16_any(a > ih_i16_all(limit));
}

static inline uint32_t ih_i16_bits(ih_i16 a, ih_i16 b)
{
    return (uint32_t)_mm_movemask_epi8(_mm_packs_epi16((__m128i)a, (__m128i)b));
}

static inline uint32_t ih_i16_bits_32(const ih_i16 mask[32 / IH_I16_LANES])
{
    return ih_i16_bits(mask[0], mask[1]) | ih_i16_bits(mask[2], mask[3]) << 16;
}

static inline int32_t ih_i32_total(ih_i32 a)
{
    const __m128i two = _mm_add_epi32((__m128i)a, _mm_shuffle_epi32((__m128i)a, 0x4e));
    return _mm_cvtsi128_si32(_mm_add_epi32(two, _mm_shuffle_epi32(two, 0xb1)));
}

static inline int64_t ih_i32_total_wide(ih_i32 a)
{
    const __m128i sign = (__m128i)(a >> 31);
    const __m128i low = _mm_unpacklo_epi32((__m128i)a, sign);
    const __m128i two = _mm_add_epi64(low, _mm_unpackhi_epi32((__m128i)a, sign));
    int64_t lane[2];
    __builtin_memcpy(lane, &two, sizeof lane);
    return lane[0] + lane[1];
}

#define IH_SIMD_LANE_SHIFTS 0

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
static inline ih_u32 ih_u32_odd(ih_u32 a)
{
    return (ih_u32)_mm_srli_epi64((__m128i)a, 32);
}

static inline struct ih_wide ih_u32_mul_wide(ih_u32 a, ih_u32 b)
{
    return (struct ih_wide){(ih_i64)ih_u32_mul_even(a, b),
                            (ih_i64)ih_u32_mul_even(ih_u32_odd(a), ih_u32_odd(b))};
}

static inline struct ih_wide ih_i32_mul_wide(ih_i32 a, ih_i32 b)
{
    return (struct ih_wide){ih_i32_mul_even(a, b), ih_i32_mul_even((ih_i32)ih_u32_odd((ih_u32)a),
                                                                   (ih_i32)ih_u32_odd((ih_u32)b))};
}

static inline ih_u32 ih_wide_low(struct ih_wide x)
{
    return ((ih_u32)x.a & (ih_u32)ih_i64_all(UINT32_MAX)) |
           (ih_u32)_mm_slli_epi64((__m128i)x.b, 32);
}

static inline struct ih_wide ih_wide_in_order(struct ih_wide x)
{
    return (struct ih_wide){(ih_i64)_mm_unpacklo_epi64((__m128i)x.a, (__m128i)x.b),
                            (ih_i64)_mm_unpackhi_epi64((__m128i)x.a, (__m128i)x.b)};
}

static inline int64_t ih_i64_total(ih_i64 a)
{
    const __m128i high = _mm_unpackhi_epi64((__m128i)a, (__m128i)a);
    int64_t lane[2];
    ih_i64_store(lane, ih_i64_add(a, (ih_i64)high));
    return lane[0];
}

/* Products without sign, and what they are too large by where b is negative: a times 2^32. */
struct ih_wide_sums {
    struct ih_wide sum;
    ih_i32 excess;
};

static inline struct ih_wide_sums ih_wide_sums_zero(void)
{
    return (struct ih_wide_sums){ih_wide_all(0), ih_i32_all(0)};
}

static inline struct ih_wide_sums ih_wide_sums_add(struct ih_wide_sums sums, ih_u32 a, ih_i32 b)
{
    return (struct ih_wide_sums){ih_wide_add(sums.sum, ih_u32_mul_wide(a, (ih_u32)b)),
                                 ih_i32_add(sums.excess, (b >> 31) & (ih_i32)a)};
}

static inline struct ih_wide ih_wide_sums_total(struct ih_wide_sums sums)
{
    const ih_i64 even = (ih_i64)_mm_slli_epi64((__m128i)sums.excess, 32);
    const ih_i64 odd = (ih_i64)sums.excess & ih_i64_all(-((int64_t)1 << 32));
    return (struct ih_wide){ih_i64_sub(sums.sum.a, even), ih_i64_sub(sums.sum.b, odd)};
}

#endif
