/* ih_words - two pixels of 16 bits without sign in a word, for processors without vectors.
 *
 * Sums and differences of words are those of both pixels as long as neither leaves 0 .. 65535: nothing
 * is carried from one to the other. The pixel that is read first is the lower half, so they are for
 * processors that store the low byte first; words need not be aligned. Copied by the compiler's own
 * memcpy, which is one load or store; in a freestanding build memcpy is a call. Where the processor has
 * instructions for both halves they are used, and give the same.
 */
#ifndef IH_WORDS_H
#define IH_WORDS_H

#include <stdint.h>

#ifdef __ARM_FEATURE_SIMD32
#include <arm_acle.h>
#endif

/* 1: loops take words. Compilers for others make vectors of loops over pixels. */
#ifndef IH_WORDS
#if defined __ARM_ARCH_PROFILE && __ARM_ARCH_PROFILE == 'M' && \
    __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
#define IH_WORDS 1
#else
#define IH_WORDS 0
#endif
#endif

/* The same value in both. */
#define IH_WORD_BOTH(value) ((uint32_t)(value)*0x00010001u)

static inline uint32_t ih_word(const void *pixel)
{
    uint32_t word;
    __builtin_memcpy(&word, pixel, sizeof word);
    return word;
}

/* Four bytes of which the first and the third make a word. */
static inline uint32_t ih_word_of_bytes(const uint8_t *pixel)
{
    uint32_t word;
    __builtin_memcpy(&word, pixel, sizeof word);
    return word;
}

/* Instructions that turn or shift an operand on the way: gcc 12 takes two or three for each. */
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

static inline uint32_t ih_word_first(uint32_t even, uint32_t odd)
{
    uint32_t word;
    __asm__("pkhbt %0, %1, %2, lsl #16" : "=r"(word) : "r"(even), "r"(odd));
    return word;
}

static inline uint32_t ih_word_second(uint32_t even, uint32_t odd)
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
    return bytes & IH_WORD_BOTH(UINT8_MAX);
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

/* Pixels 0 to 3 of words that hold 0 and 2, 1 and 3: the first two, the other two. */
static inline uint32_t ih_word_first(uint32_t even, uint32_t odd)
{
    return (even & UINT16_MAX) | odd << 16;
}

static inline uint32_t ih_word_second(uint32_t even, uint32_t odd)
{
    return even >> 16 | (odd & ~(uint32_t)UINT16_MAX);
}
#endif

/* A number that the compiler keeps in a register, and does not fold into instructions. */
static inline uint32_t ih_word_kept(uint32_t word)
{
#ifdef __ARM_FEATURE_SIMD32
    __asm__("" : "+r"(word));
#endif
    return word;
}

/* The sign bits say which one of a is less than that of b. */
#define IH_WORD_SIGNS IH_WORD_BOTH(0x8000)

static inline uint32_t ih_word_below(uint32_t a, uint32_t b)
{
#ifdef __ARM_FEATURE_SIMD32
    return (uint32_t)__qsub16((int16x2_t)a, (int16x2_t)b);
#else
    return ((int16_t)(a & UINT16_MAX) < (int16_t)(b & UINT16_MAX) ? 0x8000u : 0) |
           ((int16_t)(a >> 16) < (int16_t)(b >> 16) ? 0x80000000u : 0);
#endif
}

/* a - b of both, with sign. */
static inline uint32_t ih_word_less(uint32_t a, uint32_t b)
{
#ifdef __ARM_FEATURE_SIMD32
    return (uint32_t)__ssub16((int16x2_t)a, (int16x2_t)b);
#else
    return ((a | IH_WORD_BOTH(0x8000)) - (b & IH_WORD_BOTH(0x7fff))) ^
           ((a ^ ~b) & IH_WORD_BOTH(0x8000));
#endif
}

static inline void ih_word_put(uint32_t word, void *pixel)
{
    __builtin_memcpy(pixel, &word, sizeof word);
}

#endif
