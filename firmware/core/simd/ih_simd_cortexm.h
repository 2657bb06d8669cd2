/* ih_simd_cortexm - two lanes of 16 bits in a 32-bit word, for a Cortex-M, which has no vector registers.
 *
 * Lanes: the lane at the lower address is the lower half. They are unsigned unless a word says otherwise.
 *        C's own + and - of words add both lanes as long as no lane leaves 0 .. 65535: nothing carries.
 * Words: load and store take any address. They use the compiler's own memcpy, one load or store: in a
 *        freestanding build the function memcpy would be called.
 * Cost:  one instruction each where the processor has the DSP extension; elsewhere plain C that gives the
 *        same, so that tests run these kernels on any little-endian host (ISOHEAD_CORTEXM).
 */
#ifndef IH_SIMD_CORTEXM_H
#define IH_SIMD_CORTEXM_H

#include <stdint.h>

#include "base/ih_range.h"

#ifdef __ARM_FEATURE_SIMD32
#include <arm_acle.h>
#endif

/* 1: kernels take their Cortex-M body. */
#if defined ISOHEAD_CORTEXM || (defined __ARM_ARCH_PROFILE && __ARM_ARCH_PROFILE == 'M' && \
                                __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__)
#define IH_CORTEXM 1
#else
#define IH_CORTEXM 0
#endif

/* The same value in both lanes. */
#define IH_WORD_ALL(value) ((uint32_t)(value)*0x00010001u)

static inline uint32_t ih_word_load(const void *pixel)
{
    uint32_t word;
    __builtin_memcpy(&word, pixel, sizeof word);
    return word;
}

/* Four bytes: even and odd spread them to two words of two lanes. */
static inline uint32_t ih_word_load_u8(const uint8_t *pixel)
{
    uint32_t word;
    __builtin_memcpy(&word, pixel, sizeof word);
    return word;
}

/* Instructions that rotate or shift an operand at no cost. By name: gcc 12 takes two or three for each. */
#ifdef __ARM_FEATURE_SIMD32
static inline uint32_t ih_word_odd(uint32_t bytes)
{
    uint32_t word;
    __asm__("uxtb16 %0, %1, ror #8" : "=r"(word) : "r"(bytes));
    return word;
}

static inline uint32_t ih_word_add_odd(uint32_t sum, uint32_t bytes)
{
    uint32_t word;
    __asm__("uxtab16 %0, %1, %2, ror #8" : "=r"(word) : "r"(sum), "r"(bytes));
    return word;
}

static inline uint32_t ih_word_zip_low(uint32_t even, uint32_t odd)
{
    uint32_t word;
    __asm__("pkhbt %0, %1, %2, lsl #16" : "=r"(word) : "r"(even), "r"(odd));
    return word;
}

static inline uint32_t ih_word_zip_high(uint32_t even, uint32_t odd)
{
    uint32_t word;
    __asm__("pkhtb %0, %1, %2, asr #16" : "=r"(word) : "r"(odd), "r"(even));
    return word;
}
#endif

static inline uint32_t ih_word_even(uint32_t bytes)
{
#ifdef __ARM_FEATURE_SIMD32
    return __uxtb16(bytes);
#else
    return bytes & IH_WORD_ALL(UINT8_MAX);
#endif
}

static inline uint32_t ih_word_add_even(uint32_t sum, uint32_t bytes)
{
#ifdef __ARM_FEATURE_SIMD32
    return __uxtab16(sum, bytes);
#else
    return sum + ih_word_even(bytes);
#endif
}

#ifndef __ARM_FEATURE_SIMD32
/* The second and the fourth of four bytes. */
static inline uint32_t ih_word_odd(uint32_t bytes)
{
    return ih_word_even(bytes >> 8);
}

static inline uint32_t ih_word_add_odd(uint32_t sum, uint32_t bytes)
{
    return sum + ih_word_odd(bytes);
}

/* Of lanes 0 and 2, 1 and 3: lanes 0 and 1, lanes 2 and 3. */
static inline uint32_t ih_word_zip_low(uint32_t even, uint32_t odd)
{
    return (even & UINT16_MAX) | odd << 16;
}

static inline uint32_t ih_word_zip_high(uint32_t even, uint32_t odd)
{
    return even >> 16 | (odd & ~(uint32_t)UINT16_MAX);
}
#endif

/* A constant that the compiler keeps in a register instead of in instructions. */
static inline uint32_t ih_word_in_register(uint32_t word)
{
#ifdef __ARM_FEATURE_SIMD32
    __asm__("" : "+r"(word));
#endif
    return word;
}

/* The sign bit of each signed lane: is a less than b? */
#define IH_WORD_SIGNS IH_WORD_ALL(0x8000)

static inline uint32_t ih_word_below(uint32_t a, uint32_t b)
{
#ifdef __ARM_FEATURE_SIMD32
    return (uint32_t)__qsub16((int16x2_t)a, (int16x2_t)b);
#else
    return ((int16_t)(a & UINT16_MAX) < (int16_t)(b & UINT16_MAX) ? 0x8000u : 0) |
           ((int16_t)(a >> 16) < (int16_t)(b >> 16) ? 0x80000000u : 0);
#endif
}

/* a - b of signed lanes; it wraps. */
static inline uint32_t ih_word_sub(uint32_t a, uint32_t b)
{
#ifdef __ARM_FEATURE_SIMD32
    return (uint32_t)__ssub16((int16x2_t)a, (int16x2_t)b);
#else
    return ((a | IH_WORD_ALL(0x8000)) - (b & IH_WORD_ALL(0x7fff))) ^
           ((a ^ ~b) & IH_WORD_ALL(0x8000));
#endif
}

#ifdef __ARM_FEATURE_SIMD32
/* sum plus the products of both signed lanes; it wraps. */
static inline uint32_t ih_word_madd(uint32_t sum, uint32_t a, uint32_t b)
{
    return (uint32_t)__smlad((int16x2_t)a, (int16x2_t)b, (int32_t)sum);
}
#else
static inline int32_t ih_word_lane(uint32_t half)
{
    return (int32_t)(half ^ 0x8000) - 0x8000;
}

IH_WRAPPING static inline uint32_t ih_word_madd(uint32_t sum, uint32_t a, uint32_t b)
{
    return sum + IH_WRAPS(uint32_t, ih_word_lane(a & UINT16_MAX) * ih_word_lane(b & UINT16_MAX)) +
           IH_WRAPS(uint32_t, ih_word_lane(a >> 16) * ih_word_lane(b >> 16));
}
#endif

static inline void ih_word_store(uint32_t word, void *pixel)
{
    __builtin_memcpy(pixel, &word, sizeof word);
}

#endif
