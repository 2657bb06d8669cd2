/* ih_test - what the unit tests share: repeatable pseudo-random numbers and comparisons that say
 * what was compared. Tests may use double; the core may not. */
#ifndef IH_TEST_H
#define IH_TEST_H

#include <inttypes.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "unity.h"

#define IH_TEST_COUNT(array) ((int32_t)(sizeof(array) / sizeof((array)[0])))

/* splitmix64: any seed is a good seed, the same numbers on every machine. */
struct ih_test_random {
    uint64_t state;
};

static inline uint64_t ih_test_u64(struct ih_test_random *random)
{
    uint64_t z;

    random->state += UINT64_C(0x9E3779B97F4A7C15);
    z = random->state;
    z = (z ^ (z >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94D049BB133111EB);
    return z ^ (z >> 31);
}

/* Uniform in low..high, both included. */
static inline int64_t ih_test_between(struct ih_test_random *random, int64_t low, int64_t high)
{
    const uint64_t max = (uint64_t)high - (uint64_t)low;
    const uint64_t any = ih_test_u64(random);
    const uint64_t step = max == UINT64_MAX ? any : any % (max + 1u);

    return (int64_t)((uint64_t)low + step);
}

/* Uniform in [0, 1). */
static inline double ih_test_unit(struct ih_test_random *random)
{
    return (double)(ih_test_u64(random) >> 11) / 9007199254740992.0;
}

/* Roughly normal, sigma 1: the sum of twelve uniform numbers. Never beyond 6. */
static inline double ih_test_normal(struct ih_test_random *random)
{
    double sum = -6.0;
    int i;

    for (i = 0; i < 12; i++) {
        sum += ih_test_unit(random);
    }
    return sum;
}

/* A value of either sign whose number of bits is uniform in 0..bits: small and large ones alike. */
static inline int64_t ih_test_any_size(struct ih_test_random *random, int bits)
{
    const int64_t size = ih_test_between(random, 0, bits);
    const uint64_t mask = size == 0 ? 0u : UINT64_MAX >> (64 - size);
    const int64_t value = (int64_t)(ih_test_u64(random) & mask);

    return (ih_test_u64(random) & 1u) != 0u ? -value : value;
}

static inline double ih_test_from_q(int64_t value, int fraction_bits)
{
    return ldexp((double)value, -fraction_bits);
}

/* Not Unity's own comparisons of doubles: those are a compile-time option of Unity. */
static inline void ih_test_within_at(double tolerance, double expected, double actual,
                                     const char *what, int64_t index, UNITY_LINE_TYPE line)
{
    char text[192];

    if (fabs(expected - actual) <= tolerance) {
        return;
    }
    snprintf(text, sizeof text, "%s [%" PRId64 "]: expected %.9g, was %.9g, tolerance %.3g", what,
             index, expected, actual, tolerance);
    UNITY_TEST_FAIL(line, text);
}

static inline void ih_test_equal_at(int64_t expected, int64_t actual, const char *what,
                                    int64_t index, UNITY_LINE_TYPE line)
{
    char text[192];

    if (expected == actual) {
        return;
    }
    snprintf(text, sizeof text, "%s [%" PRId64 "]: expected %" PRId64 ", was %" PRId64, what, index,
             expected, actual);
    UNITY_TEST_FAIL(line, text);
}

static inline void ih_test_range_at(int64_t low, int64_t high, int64_t actual, const char *what,
                                    int64_t index, UNITY_LINE_TYPE line)
{
    char text[192];

    if (actual >= low && actual <= high) {
        return;
    }
    snprintf(text, sizeof text, "%s [%" PRId64 "]: expected %" PRId64 "..%" PRId64 ", was %" PRId64,
             what, index, low, high, actual);
    UNITY_TEST_FAIL(line, text);
}

/* index: which of many comparisons this is; it is printed when the comparison fails. */
#define IH_TEST_WITHIN(tolerance, expected, actual, what, index) \
    ih_test_within_at((tolerance), (expected), (actual), (what), (index), __LINE__)
#define IH_TEST_EQUAL(expected, actual, what, index) \
    ih_test_equal_at((int64_t)(expected), (int64_t)(actual), (what), (index), __LINE__)
#define IH_TEST_RANGE(low, high, actual, what, index) \
    ih_test_range_at((int64_t)(low), (int64_t)(high), (int64_t)(actual), (what), (index), __LINE__)

/* Fill memory with a pattern that no result has, and see later that it is still there. */
#define IH_TEST_FILL 0xA5

static inline void ih_test_untouched_at(const void *memory, size_t size, const char *what,
                                        UNITY_LINE_TYPE line)
{
    const unsigned char *bytes = memory;
    size_t i;

    for (i = 0; i < size; i++) {
        if (bytes[i] != IH_TEST_FILL) {
            ih_test_equal_at(IH_TEST_FILL, bytes[i], what, (int64_t)i, line);
        }
    }
}

#define IH_TEST_UNTOUCHED(memory, size, what) \
    ih_test_untouched_at((memory), (size), (what), __LINE__)

#endif
