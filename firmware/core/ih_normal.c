#include "ih_normal.h"

/* Compilers do not find the multiplication of lower halves by themselves: they see one of 64 bits, which
 * takes three of them. */
#if defined __x86_64__ && defined __SSE2__
#include <immintrin.h>
#endif

#define ROWS IH_NORMAL_ROWS
#define TERMS IH_NORMAL_TERMS
#define GROUP IH_NORMAL_GROUP

_Static_assert(TERMS % GROUP == 0, "all groups are whole");

/* Entries of line i, with its padding. */
static int32_t length_of(int32_t i)
{
    return (i / GROUP + 1) * GROUP;
}

int32_t ih_normal_line(int32_t i)
{
    return IH_NORMAL_LINE(i - i % GROUP) + i % GROUP * length_of(i);
}

#if defined __x86_64__ && defined __SSE2__
#define BY_LINES 1

#if defined __AVX2__
#define LANES 4
typedef __m256i lanes;
#define LOAD(from) _mm256_loadu_si256((const lanes *)(from))
#define STORE(to, value) _mm256_storeu_si256((lanes *)(to), value)
#define ALL(value) _mm256_set1_epi32((int32_t)(value))
#define PRODUCT(a, b) _mm256_mul_epu32(a, b)
#define SUM(a, b) _mm256_add_epi64(a, b)
#else
#define LANES 2
typedef __m128i lanes;
#define LOAD(from) _mm_loadu_si128((const lanes *)(from))
#define STORE(to, value) _mm_storeu_si128((lanes *)(to), value)
#define ALL(value) _mm_set1_epi32((int32_t)(value))
#define PRODUCT(a, b) _mm_mul_epu32(a, b)
#define SUM(a, b) _mm_add_epi64(a, b)
#endif

/* Add the rows' products of column i with each of the first `length`. */
static inline void add_line(ih_normal_entry row[ROWS][TERMS], int32_t i, int32_t length,
                            uint64_t *line)
{
    lanes factor[ROWS];
    for (int32_t k = 0; k < ROWS; k++) {
        factor[k] = ALL(row[k][i]);
    }
    for (int32_t j = 0; j < length; j += LANES) {
        lanes sum = LOAD(&line[j]);
        for (int32_t k = 0; k < ROWS; k++) {
            sum = SUM(sum, PRODUCT(factor[k], LOAD(&row[k][j])));
        }
        STORE(&line[j], sum);
    }
}

#elif defined __ARM_NEON
#define BY_LINES 1

/* As above; compilers find these vectors by themselves. */
static inline void add_line(ih_normal_entry row[ROWS][TERMS], int32_t i, int32_t length,
                            uint64_t *line)
{
    for (int32_t j = 0; j < length; j++) {
        uint64_t sum = line[j];
        for (int32_t k = 0; k < ROWS; k++) {
            sum += (uint64_t)row[k][i] * row[k][j];
        }
        line[j] = sum;
    }
}

#endif

#ifdef BY_LINES

void ih_normal_add(ih_normal_entry row[ROWS][TERMS], int32_t first, int32_t last, uint64_t *line)
{
    uint64_t *at = line;
    for (int32_t i = first; i < last; i++) {
        add_line(row, i, length_of(i), at);
        at = &at[length_of(i)];
    }
}

#else

/* Add the products of two columns with two others: each entry that is read is for two products, and there
 * are as many sums as a Cortex-M can hold in registers. */
static void add_square(ih_normal_entry row[ROWS][TERMS], int32_t i, int32_t j, uint64_t *here,
                       uint64_t *next)
{
    const ih_normal_entry *a = &row[0][i], *b = &row[0][j];
    uint64_t sum_00 = here[0], sum_01 = here[1], sum_10 = next[0], sum_11 = next[1];
/* More at once would need more registers. */
#pragma GCC unroll 2
    for (int32_t k = 0; k < ROWS; k++) {
        const uint32_t a_0 = (uint32_t)a[0], a_1 = (uint32_t)a[1];
        const uint32_t b_0 = (uint32_t)b[0], b_1 = (uint32_t)b[1];
        sum_00 += (uint64_t)a_0 * b_0;
        sum_10 += (uint64_t)a_1 * b_0;
        sum_01 += (uint64_t)a_0 * b_1;
        sum_11 += (uint64_t)a_1 * b_1;
        a = &a[TERMS];
        b = &b[TERMS];
    }
    here[0] = sum_00;
    here[1] = sum_01;
    next[0] = sum_10;
    next[1] = sum_11;
}

void ih_normal_add(ih_normal_entry row[ROWS][TERMS], int32_t first, int32_t last, uint64_t *line)
{
    uint64_t *at = line;
    for (int32_t i = first; i < last; i += 2) {
        const int32_t length = length_of(i);
        for (int32_t j = 0; j <= i; j += 2) {
            add_square(row, i, j, &at[j], &at[length + j]);
        }
        at = &at[2 * length];
    }
}

#endif
