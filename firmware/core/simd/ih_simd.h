/* ih_simd - vectors of integers: one vocabulary for AVX2, SSE2 and NEON.
 *
 * Types: ih_u8, ih_i8, ih_i16, ih_u16, ih_i32, ih_u32, ih_i64, ih_u64, each as wide as a vector register. They are
 *        C's own vectors, an extension that gcc and clang share.
 * Lanes: IH_I16_LANES of them are 16 bits wide: 16 with AVX2, 8 with SSE2 or NEON. It is 0 where there are
 *        no vectors, while ranges are checked (ISOHEAD_RANGE_CHECKS), and with ISOHEAD_PLAIN or
 *        ISOHEAD_CORTEXM (ih_simd_cortexm.h), which are for tests. A kernel
 *        stands under #if IH_I16_LANES > 0 and has one plain twin with the same result under #else.
 * Words: load and store take any address. all fills every lane. & | ~ and comparisons work lane by lane as
 *        operators; a comparison gives all bits or none. Arithmetic goes through functions: it wraps, which
 *        C's own operators on signed lanes may not. shift_right keeps the sign of signed lanes.
 *
 * Every function gives the same on all back ends; tests/unit/simd compares them with plain C.
 */
#ifndef IH_SIMD_H
#define IH_SIMD_H

#include <stdbool.h>
#include <stdint.h>

#if defined ISOHEAD_PLAIN || defined ISOHEAD_CORTEXM || defined ISOHEAD_RANGE_CHECKS
#define IH_I16_LANES 0
#elif defined __AVX2__
#define IH_I16_LANES 16
#elif defined __SSE2__ || (defined __ARM_NEON && __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__)
#define IH_I16_LANES 8
#else
#define IH_I16_LANES 0
#endif
#define IH_U8_LANES (2 * IH_I16_LANES)
#define IH_I32_LANES (IH_I16_LANES / 2)
#define IH_I64_LANES (IH_I16_LANES / 4)
#define IH_SIMD_BYTES (2 * IH_I16_LANES)

#if IH_I16_LANES > 0

typedef uint8_t ih_u8 __attribute__((vector_size(IH_SIMD_BYTES)));
typedef int8_t ih_i8 __attribute__((vector_size(IH_SIMD_BYTES)));
typedef int16_t ih_i16 __attribute__((vector_size(IH_SIMD_BYTES)));
typedef uint16_t ih_u16 __attribute__((vector_size(IH_SIMD_BYTES)));
typedef int32_t ih_i32 __attribute__((vector_size(IH_SIMD_BYTES)));
typedef uint32_t ih_u32 __attribute__((vector_size(IH_SIMD_BYTES)));
typedef int64_t ih_i64 __attribute__((vector_size(IH_SIMD_BYTES)));
typedef uint64_t ih_u64 __attribute__((vector_size(IH_SIMD_BYTES)));

/* 8 bits */

static inline void ih_u8_store(uint8_t *to, ih_u8 value)
{
    __builtin_memcpy(to, &value, sizeof value);
}

static inline ih_u8 ih_u8_all(uint8_t value)
{
    return value - (ih_u8){0};
}

/* 16 bits */

static inline ih_u16 ih_u16_load(const uint16_t *from)
{
    ih_u16 value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
}

static inline void ih_u16_store(uint16_t *to, ih_u16 value)
{
    __builtin_memcpy(to, &value, sizeof value);
}

static inline ih_u16 ih_u16_all(uint16_t value)
{
    return value - (ih_u16){0};
}

/* 32 lanes: as many vectors as hold them. */
#define IH_U16_PARTS (32 / IH_I16_LANES)

struct ih_u16_32 {
    ih_u16 part[IH_U16_PARTS];
};

static inline struct ih_u16_32 ih_u16_32_add(struct ih_u16_32 a, struct ih_u16_32 b)
{
    for (int k = 0; k < IH_U16_PARTS; k++) {
        a.part[k] += b.part[k];
    }
    return a;
}

static inline struct ih_u16_32 ih_u16_32_sub(struct ih_u16_32 a, struct ih_u16_32 b)
{
    for (int k = 0; k < IH_U16_PARTS; k++) {
        a.part[k] -= b.part[k];
    }
    return a;
}

static inline ih_i16 ih_i16_load(const int16_t *from)
{
    ih_i16 value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
}

/* From an address that is a multiple of 16 bytes: SSE2 then needs no instruction for it. */
static inline ih_i16 ih_i16_load_aligned(const int16_t *from)
{
    return ih_i16_load(__builtin_assume_aligned(from, 16));
}

static inline void ih_i16_store(int16_t *to, ih_i16 value)
{
    __builtin_memcpy(to, &value, sizeof value);
}

static inline ih_i16 ih_i16_all(int16_t value)
{
    return value - (ih_i16){0};
}

static inline ih_i16 ih_i16_add(ih_i16 a, ih_i16 b)
{
    return (ih_i16)((ih_u16)a + (ih_u16)b);
}

static inline ih_i16 ih_i16_sub(ih_i16 a, ih_i16 b)
{
    return (ih_i16)((ih_u16)a - (ih_u16)b);
}

static inline ih_i16 ih_i16_negate(ih_i16 a)
{
    return ih_i16_sub(ih_i16_all(0), a);
}

/* 32 bits */

static inline ih_i32 ih_i32_load(const int32_t *from)
{
    ih_i32 value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
}

static inline void ih_i32_store(int32_t *to, ih_i32 value)
{
    __builtin_memcpy(to, &value, sizeof value);
}

static inline ih_u32 ih_u32_load(const uint32_t *from)
{
    ih_u32 value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
}

static inline void ih_u32_store(uint32_t *to, ih_u32 value)
{
    __builtin_memcpy(to, &value, sizeof value);
}

static inline ih_i32 ih_i32_all(int32_t value)
{
    return value - (ih_i32){0};
}

static inline ih_i32 ih_i32_add(ih_i32 a, ih_i32 b)
{
    return (ih_i32)((ih_u32)a + (ih_u32)b);
}

static inline ih_i32 ih_i32_sub(ih_i32 a, ih_i32 b)
{
    return (ih_i32)((ih_u32)a - (ih_u32)b);
}

/* The lower halves of the products. */
static inline ih_i32 ih_i32_mul(ih_i32 a, ih_i32 b)
{
    return (ih_i32)((ih_u32)a * (ih_u32)b);
}

static inline ih_i32 ih_i32_shift_left(ih_i32 a, int bits)
{
    return (ih_i32)((ih_u32)a << bits);
}

static inline ih_i32 ih_i32_shift_right(ih_i32 a, int bits)
{
    return a >> bits;
}

static inline ih_u32 ih_u32_shift_right(ih_u32 a, int bits)
{
    return a >> bits;
}

/* Lanes of a where the mask has all bits, of b where it has none. */
static inline ih_i32 ih_i32_pick(ih_i32 mask, ih_i32 a, ih_i32 b)
{
    return (mask & a) | (~mask & b);
}

/* 64 bits */

static inline ih_i64 ih_i64_load(const int64_t *from)
{
    ih_i64 value;
    __builtin_memcpy(&value, from, sizeof value);
    return value;
}

static inline void ih_i64_store(int64_t *to, ih_i64 value)
{
    __builtin_memcpy(to, &value, sizeof value);
}

static inline ih_i64 ih_i64_all(int64_t value)
{
    return value - (ih_i64){0};
}

static inline ih_i64 ih_i64_add(ih_i64 a, ih_i64 b)
{
    return (ih_i64)((ih_u64)a + (ih_u64)b);
}

static inline ih_i64 ih_i64_sub(ih_i64 a, ih_i64 b)
{
    return (ih_i64)((ih_u64)a - (ih_u64)b);
}

/* Each lane shifted by its own count, below 32. One instruction where IH_SIMD_LANE_SHIFTS is 1. */
static inline ih_u32 ih_u32_shift_left_each(ih_u32 a, ih_u32 bits)
{
    return a << bits;
}

static inline ih_u32 ih_u32_shift_right_each(ih_u32 a, ih_u32 bits)
{
    return a >> bits;
}

/* A 64-bit number for each lane of 32 bits. Which member holds which lane is the back end's own matter. */
struct ih_wide {
    ih_i64 a, b;
};

static inline struct ih_wide ih_wide_all(int64_t value)
{
    return (struct ih_wide){ih_i64_all(value), ih_i64_all(value)};
}

static inline struct ih_wide ih_wide_add(struct ih_wide x, struct ih_wide y)
{
    return (struct ih_wide){ih_i64_add(x.a, y.a), ih_i64_add(x.b, y.b)};
}

/* Zeros come in from the left. */
static inline struct ih_wide ih_wide_shift_right(struct ih_wide x, int bits)
{
    return (struct ih_wide){(ih_i64)((ih_u64)x.a >> bits), (ih_i64)((ih_u64)x.b >> bits)};
}

/* Two vectors of 32 bits: neighbours of a table. */
struct ih_u32_neighbours {
    ih_u32 value, next;
};

#if defined __AVX2__
#include "simd/ih_simd_avx2.h"
#elif defined __SSE2__
#include "simd/ih_simd_sse2.h"
#else
#include "simd/ih_simd_neon.h"
#endif

#if !IH_SIMD_LISTS
/* Lanes i to i + 31 of an array that a loop goes through, i = 0, 32, 64 and so on: with lists NEON moves the address on
 * instead of using i. */
static inline struct ih_u16_32 ih_u16_32_next(const uint16_t **from, int32_t i)
{
    struct ih_u16_32 value;
    for (int k = 0; k < IH_U16_PARTS; k++) {
        value.part[k] = ih_u16_load(&(*from)[i + IH_I16_LANES * k]);
    }
    return value;
}

/* Store them there; the value stays. */
static inline void ih_u16_32_put(uint16_t **to, int32_t i, struct ih_u16_32 *value)
{
    for (int k = 0; k < IH_U16_PARTS; k++) {
        ih_u16_store(&(*to)[i + IH_I16_LANES * k], value->part[k]);
    }
}
#endif

/* The larger of each two lanes, with sign. */
static inline struct ih_u16_32 ih_u16_32_larger(struct ih_u16_32 a, struct ih_u16_32 b)
{
    for (int k = 0; k < IH_U16_PARTS; k++) {
        a.part[k] = (ih_u16)ih_i16_max((ih_i16)a.part[k], (ih_i16)b.part[k]);
    }
    return a;
}

/* Each lane's largest of all parts, with sign. */
static inline ih_i16 ih_u16_32_max(struct ih_u16_32 a)
{
    ih_i16 max = (ih_i16)a.part[0];
    for (int k = 1; k < IH_U16_PARTS; k++) {
        max = ih_i16_max(max, (ih_i16)a.part[k]);
    }
    return max;
}

/* a * b / 2^bits, rounded down; then half up. The lower 32 bits of the quotient. */
static inline ih_u32 ih_u32_mul_shift(ih_u32 a, ih_u32 b, int bits)
{
    return ih_wide_low(ih_wide_shift_right(ih_u32_mul_wide(a, b), bits));
}

static inline ih_u32 ih_u32_mul_shift_round(ih_u32 a, ih_u32 b, int bits)
{
    const struct ih_wide half = ih_wide_all((int64_t)1 << (bits - 1));
    return ih_wide_low(ih_wide_shift_right(ih_wide_add(ih_u32_mul_wide(a, b), half), bits));
}

/* bits: at most 32. */
static inline ih_i32 ih_i32_mul_shift_round(ih_i32 a, ih_i32 b, int bits)
{
    const struct ih_wide half = ih_wide_all((int64_t)1 << (bits - 1));
    return (ih_i32)ih_wide_low(ih_wide_shift_right(ih_wide_add(ih_i32_mul_wide(a, b), half), bits));
}

/* Add each number to an array. */
static inline void ih_wide_add_to(int64_t *to, struct ih_wide x)
{
    int64_t *next = &to[IH_I64_LANES];
    const struct ih_wide ordered = ih_wide_in_order(x);
    ih_i64_store(to, ih_i64_add(ih_i64_load(to), ordered.a));
    ih_i64_store(next, ih_i64_add(ih_i64_load(next), ordered.b));
}

static inline void ih_wide_store(int64_t *to, struct ih_wide x)
{
    const struct ih_wide ordered = ih_wide_in_order(x);
    ih_i64_store(to, ordered.a);
    ih_i64_store(&to[IH_I64_LANES], ordered.b);
}

/* Sum of all numbers. */
static inline int64_t ih_wide_total(struct ih_wide x)
{
    return ih_i64_total(ih_i64_add(x.a, x.b));
}

#else
#define IH_SIMD_LANE_SHIFTS 0
#endif

#endif
