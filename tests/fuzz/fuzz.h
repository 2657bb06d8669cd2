/* fuzz - what all fuzz targets share: the engine's entry, values out of the input's bytes, a check
 * that stays in every build.
 *
 * A target is one source with LLVMFuzzerTestOneInput. libFuzzer brings its own main; fuzz_main.c is
 * the one for AFL++ and for replaying files.
 * Bytes beyond the input's end count as 0, so that every input means something and a shorter one
 * less of the same.
 */
#ifndef FUZZ_H
#define FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/* The name is the engines'. Always 0. */
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* What must hold; an engine takes the abort for a failure. */
#define FUZZ_CHECK(condition)                                                         \
    do {                                                                              \
        if (!(condition)) {                                                           \
            dprintf(2, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
            abort();                                                                  \
        }                                                                             \
    } while (0)

/* For targets whose parsers tell errors on stderr: from now on stdio's goes nowhere. What the
 * sanitizers and FUZZ_CHECK write to the descriptor itself stays. */
static inline void fuzz_quiet(void)
{
    static bool is_quiet;
    if (!is_quiet) {
        stderr = fopen("/dev/null", "w");
        FUZZ_CHECK(stderr != NULL);
        is_quiet = true;
    }
}

struct fuzz_input {
    const uint8_t *at;
    size_t left;
};

static inline uint8_t fuzz_byte(struct fuzz_input *input)
{
    if (input->left == 0) {
        return 0;
    }
    input->left--;
    return *input->at++;
}

/* All 32 bits, least significant byte first. */
static inline uint32_t fuzz_word(struct fuzz_input *input)
{
    uint32_t word = 0;
    for (int shift = 0; shift < 32; shift += 8) {
        word |= (uint32_t)fuzz_byte(input) << shift;
    }
    return word;
}

static inline int32_t fuzz_int32(struct fuzz_input *input)
{
    int64_t value = fuzz_word(input);
    return (int32_t)(value > INT32_MAX ? value - ((int64_t)1 << 32) : value);
}

static inline int64_t fuzz_int64(struct fuzz_input *input)
{
    int64_t high = fuzz_int32(input);
    return high * ((int64_t)1 << 32) + fuzz_word(input);
}

/* low .. high: one byte goes through it in 128 steps, both ends among them; a byte from 128 on says
 * that four more choose among all. */
static inline int32_t fuzz_within(struct fuzz_input *input, int32_t low, int32_t high)
{
    int64_t span = (int64_t)high - low;
    uint8_t step = fuzz_byte(input);
    int64_t offset = step < 128 ? span * step / 127 : fuzz_word(input) % (span + 1);
    return (int32_t)(low + offset);
}

/* The time of the next frame: later by a usual or an odd step, before, or anything. */
static inline int64_t fuzz_next_time_us(struct fuzz_input *input, int64_t time_us)
{
    static const int32_t step_us[8] = {40000, 0, -1, 100000, 500000, 2000000, 2000001, 1};
    uint8_t step = fuzz_byte(input);
    if (step == UINT8_MAX || time_us > INT64_MAX - 2000001 || time_us == INT64_MIN) {
        return fuzz_int64(input);
    }
    return time_us + step_us[step % 8];
}

/* A generator for what nobody wants to spell out byte by byte: 16 bits (Numerical Recipes' constants). */
static inline int32_t fuzz_noise(uint32_t *state)
{
    *state = (uint32_t)((*state * (uint64_t)1664525 + 1013904223) & UINT32_MAX);
    return (int32_t)(*state >> 16);
}

/* Files in memory for parsers that take a path, and a directory of them (fuzz_file.c).
 * A file is rewritten in place, which costs two system calls and no disk. Where something fails the
 * process ends: it is the machine's fault, not the input's. */

/* The path of a regular file with these bytes, until the next call. */
const char *fuzz_file_path(const uint8_t *bytes, size_t size);

/* The path of a directory below TMPDIR that is removed when the process ends, the same at each call.
 * Only fuzz_file_write puts something into it: links to files in memory. */
const char *fuzz_file_directory(void);

/* Write a file of that directory anew. At most FUZZ_FILES_MAX names in all, each a string constant. */
#define FUZZ_FILES_MAX 8
void fuzz_file_write(const char *name, const uint8_t *bytes, size_t size);

#endif
