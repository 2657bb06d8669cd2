/* ih_simd_neon - the part of ih_simd's vocabulary that needs instructions by name, for NEON.
 *
 * 64-bit ARM has more of them than 32-bit ARM; both give the same.
 */
#ifndef IH_SIMD_NEON_H
#define IH_SIMD_NEON_H

#include <arm_neon.h>

/* Products of the upper halves of the lanes: 64-bit ARM has one instruction for each. Those of the lower halves by name:
 * gcc 12 copies the lower half of a factor to a register of its own. */
#ifdef __aarch64__
#define IH_SIMD_REGISTERS 32

static inline int32x4_t ih_neon_mul_high_s16(int16x8_t a, int16x8_t b)
{
    return vmull_high_s16(a, b);
}

static inline int32x4_t ih_neon_mul_add_high_s16(int32x4_t sum, int16x8_t a, int16x8_t b)
{
    return vmlal_high_s16(sum, a, b);
}

static inline int32x4_t ih_neon_mul_low_s16(int16x8_t a, int16x8_t b)
{
    int32x4_t product;
    __asm__("smull %0.4s, %1.4h, %2.4h" : "=w"(product) : "w"(a), "w"(b));
    return product;
}

static inline int32x4_t ih_neon_mul_add_low_s16(int32x4_t sum, int16x8_t a, int16x8_t b)
{
    __asm__("smlal %0.4s, %1.4h, %2.4h" : "+w"(sum) : "w"(a), "w"(b));
    return sum;
}

static inline int64x2_t ih_neon_mul_high_s32(int32x4_t a, int32x4_t b)
{
    return vmull_high_s32(a, b);
}

static inline int64x2_t ih_neon_mul_add_high_s32(int64x2_t sum, int32x4_t a, int32x4_t b)
{
    return vmlal_high_s32(sum, a, b);
}

static inline uint64x2_t ih_neon_mul_high_u32(uint32x4_t a, uint32x4_t b)
{
    return vmull_high_u32(a, b);
}

#else
#define IH_SIMD_REGISTERS 16

static inline int32x4_t ih_neon_mul_high_s16(int16x8_t a, int16x8_t b)
{
    return vmull_s16(vget_high_s16(a), vget_high_s16(b));
}

static inline int32x4_t ih_neon_mul_add_high_s16(int32x4_t sum, int16x8_t a, int16x8_t b)
{
    return vmlal_s16(sum, vget_high_s16(a), vget_high_s16(b));
}

static inline int32x4_t ih_neon_mul_low_s16(int16x8_t a, int16x8_t b)
{
    return vmull_s16(vget_low_s16(a), vget_low_s16(b));
}

static inline int32x4_t ih_neon_mul_add_low_s16(int32x4_t sum, int16x8_t a, int16x8_t b)
{
    return vmlal_s16(sum, vget_low_s16(a), vget_low_s16(b));
}

static inline int64x2_t ih_neon_mul_high_s32(int32x4_t a, int32x4_t b)
{
    return vmull_s32(vget_high_s32(a), vget_high_s32(b));
}

static inline int64x2_t ih_neon_mul_add_high_s32(int64x2_t sum, int32x4_t a, int32x4_t b)
{
    return vmlal_s32(sum, vget_high_s32(a), vget_high_s32(b));
}

static inline uint64x2_t ih_neon_mul_high_u32(uint32x4_t a, uint32x4_t b)
{
    return vmull_u32(vget_high_u32(a), vget_high_u32(b));
}

#endif

static inline ih_i16 ih_i16_min(ih_i16 a, ih_i16 b)
{
    return (ih_i16)vminq_s16((int16x8_t)a, (int16x8_t)b);
}

static inline ih_i16 ih_i16_max(ih_i16 a, ih_i16 b)
{
    return (ih_i16)vmaxq_s16((int16x8_t)a, (int16x8_t)b);
}

static inline ih_i16 ih_i16_abs(ih_i16 a)
{
    return (ih_i16)vabsq_s16((int16x8_t)a);
}

static inline ih_i32 ih_i32_abs(ih_i32 a)
{
    return (ih_i32)vabsq_s32((int32x4_t)a);
}

static inline struct ih_u16_32 ih_u16_32_add_twice(struct ih_u16_32 a, struct ih_u16_32 b)
{
    for (int k = 0; k < IH_U16_PARTS; k++) {
        a.part[k] = (ih_u16)vmlaq_n_u16((uint16x8_t)a.part[k], (uint16x8_t)b.part[k], 2);
    }
    return a;
}

static inline struct ih_u16_32 ih_u16_32_add_81_16ths(struct ih_u16_32 a, struct ih_u16_32 b)
{
    for (int k = 0; k < IH_U16_PARTS; k++) {
        const uint16x8_t whole = vmlaq_n_u16((uint16x8_t)a.part[k], (uint16x8_t)b.part[k], 5);
        a.part[k] = (ih_u16)vrsraq_n_u16(whole, (uint16x8_t)b.part[k], 4);
    }
    return a;
}

static inline struct ih_u16_32 ih_neon_widen(uint8x16_t low, uint8x16_t high)
{
    return (struct ih_u16_32){
        {(ih_u16)vmovl_u8(vget_low_u8(low)), (ih_u16)vmovl_u8(vget_high_u8(low)),
         (ih_u16)vmovl_u8(vget_low_u8(high)), (ih_u16)vmovl_u8(vget_high_u8(high))}};
}

#if defined __aarch64__ && !defined __clang__
#define IH_SIMD_LISTS 1

/* By name: of the intrinsics for them gcc 12 makes an addition for each address, and copies lists. */
struct ih_neon_memory {
    uint16_t lane[32];
};

struct ih_neon_bytes {
    uint8_t lane[32];
};

static inline struct ih_u16_32 ih_u16_32_next(const uint16_t **from, int32_t i)
{
    (void)i;
    const struct ih_neon_memory *memory = (const void *)*from;
    uint16x8x4_t list;
    __asm__("ld1 {%S0.8h - %V0.8h}, [%1], #64"
            : "=w"(list), "=r"(*from)
            : "1"(memory), "m"(*memory));
    return (struct ih_u16_32){
        {(ih_u16)list.val[0], (ih_u16)list.val[1], (ih_u16)list.val[2], (ih_u16)list.val[3]}};
}

/* The value is read from the registers that it was stored from, or gcc 12 keeps a copy for each of its parts. */
static inline void ih_u16_32_put(uint16_t **to, int32_t i, struct ih_u16_32 *value)
{
    (void)i;
    struct ih_neon_memory *memory = (void *)*to;
    uint16x8x4_t list = {{(uint16x8_t)value->part[0], (uint16x8_t)value->part[1],
                          (uint16x8_t)value->part[2], (uint16x8_t)value->part[3]}};
    __asm__("st1 {%S0.8h - %V0.8h}, [%1], #64"
            : "+w"(list), "=r"(*to), "=m"(*memory)
            : "1"(memory));
    *value = (struct ih_u16_32){
        {(ih_u16)list.val[0], (ih_u16)list.val[1], (ih_u16)list.val[2], (ih_u16)list.val[3]}};
}

static inline struct ih_u16_32 ih_u16_32_next_u8(const uint8_t **from, int32_t i)
{
    (void)i;
    const struct ih_neon_bytes *memory = (const void *)*from;
    uint8x16x2_t list;
    __asm__("ld1 {%S0.16b - %T0.16b}, [%1], #32"
            : "=w"(list), "=r"(*from)
            : "1"(memory), "m"(*memory));
    return ih_neon_widen(list.val[0], list.val[1]);
}

#else
#define IH_SIMD_LISTS 0

static inline struct ih_u16_32 ih_u16_32_next_u8(const uint8_t **from, int32_t i)
{
    const uint8x16_t low = vld1q_u8(&(*from)[i]), high = vld1q_u8(&(*from)[i + 16]);
    return ih_neon_widen(low, high);
}

#endif

static inline ih_i16 ih_i16_load_eights(const int16_t *from, int32_t apart)
{
    (void)apart;
    return ih_i16_load(from);
}

static inline ih_i8 ih_i16_pack_eights(ih_i16 a, ih_i16 b)
{
    return (ih_i8)vcombine_s8(vqmovn_s16((int16x8_t)a), vqmovn_s16((int16x8_t)b));
}

static inline ih_u64 ih_u8_sum_eights(ih_u8 a)
{
    return (ih_u64)vpaddlq_u32(vpaddlq_u16(vpaddlq_u8((uint8x16_t)a)));
}

static inline ih_i32 ih_i32_even_twice(ih_i32 a)
{
    return (ih_i32)vtrnq_s32((int32x4_t)a, (int32x4_t)a).val[0];
}

static inline ih_u16 ih_u16_mul_high(ih_u16 a, ih_u16 b)
{
    const uint16x8_t x = (uint16x8_t)a, y = (uint16x8_t)b;
    const uint32x4_t low = vmull_u16(vget_low_u16(x), vget_low_u16(y));
#ifdef __aarch64__
    const uint32x4_t high = vmull_high_u16(x, y);
#else
    const uint32x4_t high = vmull_u16(vget_high_u16(x), vget_high_u16(y));
#endif
    return (ih_u16)vuzpq_u16((uint16x8_t)low, (uint16x8_t)high).val[1];
}

static inline ih_i16 ih_i32_low_halves(ih_i32 a, ih_i32 b)
{
    return (ih_i16)vuzpq_s16((int16x8_t)a, (int16x8_t)b).val[0];
}

static inline ih_i32 ih_i16_madd_pairs(ih_i16 a, ih_i16 b)
{
    const int32x4_t low = vmull_s16(vget_low_s16((int16x8_t)a), vget_low_s16((int16x8_t)b));
#ifdef __aarch64__
    return (ih_i32)vpaddq_s32(low, vmull_high_s16((int16x8_t)a, (int16x8_t)b));
#else
    const int32x4_t high = vmull_s16(vget_high_s16((int16x8_t)a), vget_high_s16((int16x8_t)b));
    return (ih_i32)vcombine_s32(vpadd_s32(vget_low_s32(low), vget_high_s32(low)),
                                vpadd_s32(vget_low_s32(high), vget_high_s32(high)));
#endif
}

static inline ih_i32 ih_i32_min(ih_i32 a, ih_i32 b)
{
    return (ih_i32)vminq_s32((int32x4_t)a, (int32x4_t)b);
}

static inline ih_i32 ih_i32_max(ih_i32 a, ih_i32 b)
{
    return (ih_i32)vmaxq_s32((int32x4_t)a, (int32x4_t)b);
}

static inline ih_i32 ih_i32_mul_low(ih_i32 a, ih_i32 b)
{
    return (ih_i32)vmull_s16(vmovn_s32((int32x4_t)a), vmovn_s32((int32x4_t)b));
}

static inline ih_i64 ih_i32_mul_even(ih_i32 a, ih_i32 b)
{
    return (ih_i64)vmull_s32(vmovn_s64((int64x2_t)a), vmovn_s64((int64x2_t)b));
}

static inline ih_u64 ih_u32_mul_even(ih_u32 a, ih_u32 b)
{
    return (ih_u64)vmull_u32(vmovn_u64((uint64x2_t)a), vmovn_u64((uint64x2_t)b));
}

static inline bool ih_i16_any(ih_i16 a)
{
    const uint32x2_t half = vqmovn_u64((uint64x2_t)a);
    return vget_lane_u64(vreinterpret_u64_u32(half), 0) != 0;
}

static inline bool ih_i16_any_above(ih_i16 a, int16_t limit)
{
#ifdef __aarch64__
    return vmaxvq_s16((int16x8_t)a) > limit;
#else
    return ih_i16_any(a > ih_i16_all(limit));
#endif
}

/* Each lane's own bit of a byte: a sum of eight of them is the bits of eight lanes. */
static inline uint8x16_t ih_neon_bit_bytes(ih_i16 a, ih_i16 b)
{
    const uint8x8_t bit = vcreate_u8(0x8040201008040201u);
    const uint8x16_t masks = vcombine_u8(vmovn_u16((uint16x8_t)a), vmovn_u16((uint16x8_t)b));
    return vandq_u8(masks, vcombine_u8(bit, bit));
}

static inline uint32_t ih_i16_bits(ih_i16 a, ih_i16 b)
{
    const uint8x16_t bytes = ih_neon_bit_bytes(a, b);
    const uint8x8_t four = vpadd_u8(vget_low_u8(bytes), vget_high_u8(bytes));
    const uint8x8_t two = vpadd_u8(four, four);
    return vget_lane_u16(vreinterpret_u16_u8(vpadd_u8(two, two)), 0);
}

static inline uint32_t ih_i16_bits_32(const ih_i16 mask[32 / IH_I16_LANES])
{
    const uint8x16_t first = ih_neon_bit_bytes(mask[0], mask[1]);
    const uint8x16_t last = ih_neon_bit_bytes(mask[2], mask[3]);
#ifdef __aarch64__
    const uint8x16_t four = vpaddq_u8(first, last);
    const uint8x16_t pairs = vpaddq_u8(four, four);
    return vgetq_lane_u32(vreinterpretq_u32_u8(vpaddq_u8(pairs, pairs)), 0);
#else
    const uint8x8_t low = vpadd_u8(vget_low_u8(first), vget_high_u8(first));
    const uint8x8_t high = vpadd_u8(vget_low_u8(last), vget_high_u8(last));
    const uint8x8_t two = vpadd_u8(low, high);
    return vget_lane_u32(vreinterpret_u32_u8(vpadd_u8(two, two)), 0);
#endif
}

static inline int32_t ih_i32_total(ih_i32 a)
{
    const int64x2_t sums = vpaddlq_s32((int32x4_t)a);
    return (int32_t)(vgetq_lane_s64(sums, 0) + vgetq_lane_s64(sums, 1));
}

static inline int64_t ih_i32_total_wide(ih_i32 a)
{
    const int64x2_t sums = vpaddlq_s32((int32x4_t)a);
    return vgetq_lane_s64(sums, 0) + vgetq_lane_s64(sums, 1);
}

#define IH_SIMD_LANE_SHIFTS 1

/* The first half of the lanes and the second: their sums of pairs are added once, at the end. */
struct ih_pair_sums {
    int32x4_t first, second;
};

static inline struct ih_pair_sums ih_pair_sums_first(ih_i16 a, ih_i16 b)
{
    const int16x8_t x = (int16x8_t)a, y = (int16x8_t)b;
    return (struct ih_pair_sums){ih_neon_mul_low_s16(x, y), ih_neon_mul_high_s16(x, y)};
}

static inline struct ih_pair_sums ih_pair_sums_add(struct ih_pair_sums sums, ih_i16 a, ih_i16 b)
{
    const int16x8_t x = (int16x8_t)a, y = (int16x8_t)b;
    return (struct ih_pair_sums){ih_neon_mul_add_low_s16(sums.first, x, y),
                                 ih_neon_mul_add_high_s16(sums.second, x, y)};
}

static inline ih_i32 ih_pair_sums_total(struct ih_pair_sums sums)
{
#ifdef __aarch64__
    return (ih_i32)vpaddq_s32(sums.first, sums.second);
#else
    return (ih_i32)vcombine_s32(vpadd_s32(vget_low_s32(sums.first), vget_high_s32(sums.first)),
                                vpadd_s32(vget_low_s32(sums.second), vget_high_s32(sums.second)));
#endif
}

/* Here a has the first half of the lanes of 32 bits and b the second. */
static inline struct ih_wide ih_i32_mul_wide(ih_i32 a, ih_i32 b)
{
    const int32x4_t x = (int32x4_t)a, y = (int32x4_t)b;
    return (struct ih_wide){(ih_i64)vmull_s32(vget_low_s32(x), vget_low_s32(y)),
                            (ih_i64)ih_neon_mul_high_s32(x, y)};
}

static inline struct ih_wide ih_u32_mul_wide(ih_u32 a, ih_u32 b)
{
    const uint32x4_t x = (uint32x4_t)a, y = (uint32x4_t)b;
    return (struct ih_wide){(ih_i64)vmull_u32(vget_low_u32(x), vget_low_u32(y)),
                            (ih_i64)ih_neon_mul_high_u32(x, y)};
}

static inline ih_u32 ih_wide_low(struct ih_wide x)
{
    const int32x2_t first = vmovn_s64((int64x2_t)x.a);
#ifdef __aarch64__
    return (ih_u32)vmovn_high_s64(first, (int64x2_t)x.b);
#else
    return (ih_u32)vcombine_s32(first, vmovn_s64((int64x2_t)x.b));
#endif
}

static inline struct ih_wide ih_wide_in_order(struct ih_wide x)
{
    return x;
}

static inline int64_t ih_i64_total(ih_i64 a)
{
    return (int64_t)(vgetq_lane_u64((uint64x2_t)a, 0) + vgetq_lane_u64((uint64x2_t)a, 1));
}

struct ih_wide_sums {
    struct ih_wide sum;
};

static inline struct ih_wide_sums ih_wide_sums_zero(void)
{
    return (struct ih_wide_sums){ih_wide_all(0)};
}

static inline struct ih_wide_sums ih_wide_sums_add(struct ih_wide_sums sums, ih_u32 a, ih_i32 b)
{
    const int32x4_t x = (int32x4_t)a, y = (int32x4_t)b;
    return (struct ih_wide_sums){
        {(ih_i64)vmlal_s32((int64x2_t)sums.sum.a, vget_low_s32(x), vget_low_s32(y)),
         (ih_i64)ih_neon_mul_add_high_s32((int64x2_t)sums.sum.b, x, y)}};
}

static inline struct ih_wide ih_wide_sums_total(struct ih_wide_sums sums)
{
    return sums.sum;
}

/* Loads of 64 bits scale an index by 8 or not at all: offsets in bytes take fewer instructions. */
static inline uint32x2_t ih_neon_pair_at(const uint32_t *table, uint32_t offset)
{
    uint32x2_t pair;
    __builtin_memcpy(&pair, (const uint8_t *)table + offset, sizeof pair);
    return pair;
}

static inline struct ih_u32_neighbours ih_u32_look_up(const uint32_t *table, ih_u32 at)
{
    const ih_u32 offset = at << 2;
    const uint32x4_t first =
        vcombine_u32(ih_neon_pair_at(table, offset[0]), ih_neon_pair_at(table, offset[1]));
    const uint32x4_t last =
        vcombine_u32(ih_neon_pair_at(table, offset[2]), ih_neon_pair_at(table, offset[3]));
    const uint32x4x2_t both = vuzpq_u32(first, last);
    return (struct ih_u32_neighbours){(ih_u32)both.val[0], (ih_u32)both.val[1]};
}

static inline struct ih_u32_neighbours ih_u32_look_up_u16(const uint16_t *table, ih_u32 at)
{
    ih_u32 both;
    for (int lane = 0; lane < IH_I32_LANES; lane++) {
        uint32_t pair;
        __builtin_memcpy(&pair, &table[at[lane]], sizeof pair);
        both[lane] = pair;
    }
    return (struct ih_u32_neighbours){both & UINT16_MAX, both >> 16};
}

static inline ih_u32 ih_u32_zero_pairs(ih_u32 a)
{
    return (ih_u32)vclzq_u32((uint32x4_t)a) >> 1;
}

#endif
