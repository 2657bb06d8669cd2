#include "ih_cholesky.h"

#include <stdbool.h>
#include <string.h>

#include "ih_fix.h"

/* Compilers do not find the products of lower halves by themselves. */
#if defined __x86_64__ && defined __SSE2__
#include <immintrin.h>
#endif

/* Mantissas of a solution stay below this: 144 products with |L| <= 1 in Q30 then sum below
 * 2^(25 + 30 + 7.2) < 2^63. */
#define MANTISSA_BITS 25

static const int32_t *row_of(const int32_t *l_q30, int32_t i)
{
    return &l_q30[IH_CHOLESKY_PACKED(i)];
}

static int64_t dot_q60(const int32_t *a_q30, const int32_t *b_q30, int32_t count)
{
    int64_t sum = 0;
    for (int32_t k = 0; k < count; k++) {
        sum += (int64_t)a_q30[k] * b_q30[k];
    }
    return sum;
}

/* Entries of so many columns at once: as many sums as registers hold. */
#if defined __x86_64__ && defined __SSE2__
#define WIDE 4
#else
#define WIDE 1
#endif

/* The vectors of SSE2 have products of numbers without a sign only, and need the sum of each row's entries. */
#if WIDE == 4 && !defined __AVX2__
#define WITH_SUMS 1
#else
#define WITH_SUMS 0
#endif

struct row {
    const int32_t *q30;
    int64_t sum_q30; /* of the entries that products are wanted of; if WITH_SUMS */
};

/* The same of two rows with WIDE others: each entry is read for several products. count: a multiple of WIDE. */
#if WIDE == 4 && defined __AVX2__

static inline __m256i four_q30(const int32_t *from_q30)
{
    return _mm256_cvtepi32_epi64(_mm_loadu_si128((const __m128i *)from_q30));
}

static inline void dots_q60(const struct row a[2], const struct row b[WIDE], int32_t count,
                            int64_t sum_q60[2][WIDE])
{
    __m256i sum[2][WIDE];
    for (int n = 0; n < WIDE; n++) {
        sum[0][n] = _mm256_setzero_si256();
        sum[1][n] = sum[0][n];
    }
    for (int32_t k = 0; k < count; k += 4) {
        const __m256i a_0 = four_q30(&a[0].q30[k]);
        const __m256i a_1 = four_q30(&a[1].q30[k]);
        for (int n = 0; n < WIDE; n++) {
            const __m256i b_n = four_q30(&b[n].q30[k]);
            sum[0][n] = _mm256_add_epi64(sum[0][n], _mm256_mul_epi32(a_0, b_n));
            sum[1][n] = _mm256_add_epi64(sum[1][n], _mm256_mul_epi32(a_1, b_n));
        }
    }
    for (int m = 0; m < 2; m++) {
        const __m256i left = _mm256_add_epi64(_mm256_unpacklo_epi64(sum[m][0], sum[m][1]),
                                              _mm256_unpackhi_epi64(sum[m][0], sum[m][1]));
        const __m256i right = _mm256_add_epi64(_mm256_unpacklo_epi64(sum[m][2], sum[m][3]),
                                               _mm256_unpackhi_epi64(sum[m][2], sum[m][3]));
        _mm256_storeu_si256((__m256i *)sum_q60[m],
                            _mm256_add_epi64(_mm256_permute2x128_si256(left, right, 0x20),
                                             _mm256_permute2x128_si256(left, right, 0x31)));
    }
}

#elif WIDE == 4

/* Entries are taken for 2^31 more, and what that brings is taken away again: 2^31 times the entries' sums; 2^62
 * an entry is nothing in 64 bits. Both pass 2^64, together they do not. */
struct four {
    __m128i even, odd;
};

static inline struct four four_more(const int32_t *from_q30)
{
    struct four out;
    out.even = _mm_xor_si128(_mm_loadu_si128((const __m128i *)from_q30), _mm_set1_epi32(INT32_MIN));
    out.odd = _mm_srli_epi64(out.even, 32);
    return out;
}

static inline __m128i with_products(__m128i sum, struct four a, struct four b)
{
    return _mm_add_epi64(_mm_add_epi64(sum, _mm_mul_epu32(a.even, b.even)),
                         _mm_mul_epu32(a.odd, b.odd));
}

IH_WRAPPING static inline void dots_q60(const struct row a[2], const struct row b[WIDE],
                                        int32_t count, int64_t sum_q60[2][WIDE])
{
    __m128i sum[2][WIDE];
    for (int n = 0; n < WIDE; n++) {
        sum[0][n] = _mm_setzero_si128();
        sum[1][n] = sum[0][n];
    }
    for (int32_t k = 0; k < count; k += 4) {
        const struct four a_0 = four_more(&a[0].q30[k]);
        const struct four a_1 = four_more(&a[1].q30[k]);
        for (int n = 0; n < WIDE; n++) {
            const struct four b_n = four_more(&b[n].q30[k]);
            sum[0][n] = with_products(sum[0][n], a_0, b_n);
            sum[1][n] = with_products(sum[1][n], a_1, b_n);
        }
    }
    for (int m = 0; m < 2; m++) {
        for (int n = 0; n < WIDE; n++) {
            /* (a + h)(b + h) - h a - h b = a b + h h */
            const int64_t both = (a[m].sum_q30 + b[n].sum_q30) * ((int64_t)1 << 20);
            uint64_t part[2];
            _mm_storeu_si128((__m128i *)part, sum[m][n]);
            sum_q60[m][n] = IH_WRAPS(int64_t, part[0] + part[1] - IH_WRAPS(uint64_t, both) * 2048);
        }
    }
}

#else

static inline void dots_q60(const struct row a[2], const struct row b[WIDE], int32_t count,
                            int64_t sum_q60[2][WIDE])
{
    const int32_t *a_0 = a[0].q30, *a_1 = a[1].q30, *b_0 = b[0].q30;
    int64_t sum_0 = 0, sum_1 = 0;
#pragma GCC unroll 4
    for (int32_t k = 0; k < count; k++) {
        sum_0 += (int64_t)a_0[k] * b_0[k];
        sum_1 += (int64_t)a_1[k] * b_0[k];
    }
    sum_q60[0][0] = sum_0;
    sum_q60[1][0] = sum_1;
}

#endif

/* Bits of a pivot, 1..31. */
static inline int bits_of(int32_t pivot_q30)
{
    return 32 - __builtin_clz((uint32_t)pivot_q30);
}

/* 2^(30 + its bits) / pivot, between 2^30 and 2^31, for division by products. */
static int32_t inverse_of(int32_t pivot_q30)
{
    const int64_t value = ((int64_t)1 << (30 + bits_of(pivot_q30))) / pivot_q30;
    return (int32_t)ih_min_s64(value, INT32_MAX); /* 2^31 for a power of 2 */
}

/* L_ij from A_ij and what the entries before it take away. The rest in Q30: half a step of it is no more than
 * half a step of A. It is at most 1, with a pivot of the same size or more: Cauchy-Schwarz. */
static inline int32_t entry_q30(int32_t a_q30, int64_t taken_q60, int32_t pivot_q30,
                                int32_t inverse, int32_t n)
{
    const int64_t rest_q30 = a_q30 - ih_shift_round(taken_q60, 30);
    const int32_t entry = ih_saturate_s32(ih_mul_shift(rest_q30, inverse, bits_of(pivot_q30)));
    IH_IN_RANGE(entry, -(1 << 30) - n, (1 << 30) + n);
    return entry;
}

/* The last entry of a row whose others are done. */
static bool set_pivot(int32_t *row_q30, int32_t i, int32_t *inverse)
{
    int64_t pivot_q60 = (int64_t)row_q30[i] * (1 << 30) - dot_q60(row_q30, row_q30, i);
    row_q30[i] = pivot_q60 > 0 ? (int32_t)ih_isqrt_u64((uint64_t)pivot_q60) : 0;
    if (row_q30[i] == 0) {
        return false;
    }
    *inverse = inverse_of(row_q30[i]);
    return true;
}

/* Entries j .. j + WIDE - 1 of two rows, which may be the same row twice. */
static inline void set_tile(const struct row column[WIDE], const int32_t inverse[WIDE], int32_t n,
                            int32_t j, struct row row[2], int32_t *const row_q30[2])
{
    int64_t taken_q60[2][WIDE];
    dots_q60(row, column, j, taken_q60);
    int32_t entry[2][WIDE];
    for (int m = 0; m < 2; m++) {
        for (int32_t c = 0; c < WIDE; c++) {
            int64_t taken = taken_q60[m][c];
            for (int32_t d = 0; d < c; d++) {
                taken += (int64_t)entry[m][d] * column[c].q30[j + d];
            }
            entry[m][c] = entry_q30(row_q30[m][j + c], taken, column[c].q30[j + c], inverse[c], n);
            row[m].sum_q30 += WITH_SUMS ? entry[m][c] : 0;
        }
    }
    for (int m = 0; m < 2; m++) {
        memcpy(&row_q30[m][j], entry[m], sizeof entry[m]);
    }
}

/* All whole tiles of rows i and `next`. before: sums of the entries of each row up to its last whole tile; these
 * rows' are set. Returns the first column that is left. */
static inline int32_t set_tiles(int32_t *a_q30, int32_t n, int32_t i, int32_t next,
                                const int32_t *inverse, int64_t *before)
{
    int32_t *const row_q30[2] = {&a_q30[IH_CHOLESKY_PACKED(i)], &a_q30[IH_CHOLESKY_PACKED(next)]};
    struct row row[2] = {{row_q30[0], 0}, {row_q30[1], 0}};
    int32_t j = 0;
    for (; j + WIDE <= i; j += WIDE) {
        struct row column[WIDE];
        for (int32_t c = 0; c < WIDE; c++) {
            column[c] = (struct row){row_of(a_q30, j + c), WITH_SUMS ? before[j + c] : 0};
        }
        set_tile(column, &inverse[j], n, j, row, row_q30);
    }
    if (WITH_SUMS) {
        before[i] = row[0].sum_q30;
        before[next] = row[1].sum_q30;
    }
    return j;
}

/* Entries from j on of a row, one by one, and the last. */
static bool end_row(int32_t *a_q30, int32_t n, int32_t i, int32_t j, int32_t *inverse)
{
    int32_t *row_q30 = &a_q30[IH_CHOLESKY_PACKED(i)];
    for (int32_t k = j; k < i; k++) {
        const int32_t *column_q30 = row_of(a_q30, k);
        row_q30[k] =
            entry_q30(row_q30[k], dot_q60(row_q30, column_q30, k), column_q30[k], inverse[k], n);
    }
    return set_pivot(row_q30, i, &inverse[i]);
}

/* Two rows at a time: all whole tiles first. */
enum ih_err ih_cholesky_factor(int32_t *a_q30, int32_t n, int32_t *bad_pivot)
{
    int32_t inverse[IH_CHOLESKY_MAX];
    int64_t before[WITH_SUMS ? IH_CHOLESKY_MAX : 1];
    *bad_pivot = IH_NONE;
    for (int32_t i = 0; i < n; i += 2) {
        const int32_t next = ih_min_s32(i + 1, n - 1); /* or the same again */
        const int32_t j = set_tiles(a_q30, n, i, next, inverse, before);
        for (int32_t at = i; at <= next; at++) {
            if (!end_row(a_q30, n, at, j, inverse)) {
                *bad_pivot = at;
                return IH_ERR_NOT_POSITIVE;
            }
        }
    }
    return IH_OK;
}

/* L y = b, in b's unit. */
static void solve_forward(const int32_t *l_q30, int32_t n, const int32_t *b, int32_t *y)
{
    for (int32_t i = 0; i < n; i++) {
        const int32_t *row = row_of(l_q30, i);
        int64_t rest = (int64_t)b[i] * (1 << 30) - dot_q60(row, y, i);
        y[i] = ih_saturate_s32(ih_div_round(rest, row[i])); /* as the header says, it fits */
    }
}

/* Take what an unknown brings from the rests of those before it. Here and below clang's analyzer does not see that
 * the first n rests are set. */
static void take_unknown(const int32_t *row_q30, int32_t count, int32_t unknown, int64_t *rest_q30)
{
#pragma GCC unroll 4
    for (int32_t k = 0; k < count; k++) {
        /* NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign) */
        rest_q30[k] -= (int64_t)row_q30[k] * unknown;
    }
}

void ih_cholesky_solve(const int32_t *l_q30, int32_t n, const int32_t *b, int32_t *x_mantissa,
                       int32_t *x_exponent)
{
    int64_t rest_q30[IH_CHOLESKY_MAX];
    solve_forward(l_q30, n, b, x_mantissa);
    for (int32_t k = 0; k < n; k++) {
        rest_q30[k] = (int64_t)x_mantissa[k] * (1 << 30);
    }
    int exponent = 0;
    for (int32_t i = n - 1; i >= 0; i--) { /* L^T x = y, in units of 2^exponent */
        const int32_t *row = row_of(l_q30, i);
        const int64_t value = ih_div_round(rest_q30[i], row[i]);
        const int grow = ih_max_s32(0, ih_bits_u64((uint64_t)ih_abs_s64(value)) - MANTISSA_BITS);
        if (grow > 0) { /* move the binary point of what is solved so far, and of what is not */
            exponent += grow;
            for (int32_t k = i + 1; k < n; k++) {
                x_mantissa[k] = (int32_t)ih_shift_round(x_mantissa[k], grow);
            }
            for (int32_t k = 0; k < i; k++) {
                /* NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage) */
                rest_q30[k] = ih_shift_round(rest_q30[k], grow);
            }
        }
        x_mantissa[i] = (int32_t)ih_shift_round(value, grow);
        IH_IN_RANGE(x_mantissa[i], -IH_RANGE_MANTISSA, IH_RANGE_MANTISSA);
        take_unknown(row, i, x_mantissa[i], rest_q30);
    }
    IH_IN_RANGE(exponent, 0, IH_RANGE_EXPONENT);
    *x_exponent = exponent;
}
