/* ih_words - two pixels of 16 bits without sign in a word, for processors without vectors.
 *
 * Sums and differences of words are those of both pixels as long as neither leaves 0 .. 65535: nothing
 * is carried from one to the other. The pixel that is read first stands first in memory, whatever the
 * order of bytes; words need not be aligned. Copied by the compiler's own memcpy, which is one load or
 * store; in a freestanding build memcpy is a call.
 */
#ifndef IH_WORDS_H
#define IH_WORDS_H

#include <stdint.h>

/* 1: loops take words. Compilers for others make vectors of loops over pixels. */
#ifndef IH_WORDS
#if defined __ARM_ARCH_PROFILE && __ARM_ARCH_PROFILE == 'M'
#define IH_WORDS 1
#else
#define IH_WORDS 0
#endif
#endif

/* The same value in both. */
#define IH_WORD_BOTH(value) ((uint32_t)(value)*0x00010001u)

static inline uint32_t ih_word(const uint16_t *pixel)
{
    uint32_t word;
    __builtin_memcpy(&word, pixel, sizeof word);
    return word;
}

static inline uint32_t ih_word_of_bytes(const uint8_t *pixel)
{
    uint16_t both;
    __builtin_memcpy(&both, pixel, sizeof both);
    return (both | (uint32_t)both << 8) & IH_WORD_BOTH(UINT8_MAX);
}

static inline void ih_word_put(uint32_t word, uint16_t *pixel)
{
    __builtin_memcpy(pixel, &word, sizeof word);
}

/* Of sums that stand IH_WORD_BOTH(0x8000) higher, so that they cannot be negative. */
static inline void ih_word_put_signed(uint32_t raised, int16_t *pixel)
{
    const uint32_t word = raised ^ IH_WORD_BOTH(0x8000);
    __builtin_memcpy(pixel, &word, sizeof word);
}

#endif
