#include "ih_cholesky.h"

#include <stdbool.h>

#include "ih_fix.h"

/* Mantissas of a solution stay below this: 144 products with |L| <= 1 in Q30 then sum below
 * 2^(25 + 30 + 7.2) < 2^63. */
#define MANTISSA_MAX (1 << 25)

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

/* The same of two rows with two others: each entry is read for two products. */
static void four_dots_q60(const int32_t *const a_q30[2], const int32_t *const b_q30[2],
                          int32_t count, int64_t sum_q60[2][2])
{
    const int32_t *a_0 = a_q30[0], *a_1 = a_q30[1], *b_0 = b_q30[0], *b_1 = b_q30[1];
    int64_t sum_00 = 0, sum_01 = 0, sum_10 = 0, sum_11 = 0;
    for (int32_t k = 0; k < count; k++) {
        sum_00 += (int64_t)a_0[k] * b_0[k];
        sum_10 += (int64_t)a_1[k] * b_0[k];
        sum_01 += (int64_t)a_0[k] * b_1[k];
        sum_11 += (int64_t)a_1[k] * b_1[k];
    }
    sum_q60[0][0] = sum_00;
    sum_q60[0][1] = sum_01;
    sum_q60[1][0] = sum_10;
    sum_q60[1][1] = sum_11;
}

/* L_ij from A_ij and what the entries before it take away. */
static int32_t entry_q30(int32_t a_q30, int64_t taken_q60, int32_t pivot_q30, int32_t n)
{
    int64_t rest_q60 = (int64_t)a_q30 * (1 << 30) - taken_q60;
    int32_t entry = ih_saturate_s32(ih_div_round(rest_q60, pivot_q30));
    IH_IN_RANGE(entry, -(1 << 30) - n, (1 << 30) + n);
    return entry;
}

/* The last entry of a row whose others are done. */
static bool set_pivot(int32_t *row_q30, int32_t i)
{
    int64_t pivot_q60 = (int64_t)row_q30[i] * (1 << 30) - dot_q60(row_q30, row_q30, i);
    row_q30[i] = pivot_q60 > 0 ? (int32_t)ih_isqrt_u64((uint64_t)pivot_q60) : 0;
    return row_q30[i] != 0;
}

/* Entries j and j + 1 of two rows, which may be the same row twice. */
static void set_four(const int32_t *a_q30, int32_t n, int32_t j, int32_t *const row_q30[2])
{
    const int32_t *const column_q30[2] = {row_of(a_q30, j), row_of(a_q30, j + 1)};
    int64_t taken_q60[2][2];
    four_dots_q60((const int32_t *const[2]){row_q30[0], row_q30[1]}, column_q30, j, taken_q60);
    int32_t here_q30[2], next_q30[2];
    for (int m = 0; m < 2; m++) {
        here_q30[m] = entry_q30(row_q30[m][j], taken_q60[m][0], column_q30[0][j], n);
        const int64_t more_q60 = (int64_t)here_q30[m] * column_q30[1][j];
        next_q30[m] =
            entry_q30(row_q30[m][j + 1], taken_q60[m][1] + more_q60, column_q30[1][j + 1], n);
    }
    for (int m = 0; m < 2; m++) {
        row_q30[m][j] = here_q30[m];
        row_q30[m][j + 1] = next_q30[m];
    }
}

/* Two rows at a time: all entries but the last three first. */
enum ih_err ih_cholesky_factor(int32_t *a_q30, int32_t n, int32_t *bad_pivot)
{
    *bad_pivot = IH_NONE;
    for (int32_t i = 0; i < n; i += 2) {
        const bool is_last = i + 1 == n;
        int32_t *row = &a_q30[IH_CHOLESKY_PACKED(i)];
        int32_t *next = &a_q30[IH_CHOLESKY_PACKED(is_last ? i : i + 1)]; /* or the same again */
        for (int32_t j = 0; j < i; j += 2) {
            set_four(a_q30, n, j, (int32_t *const[2]){row, next});
        }
        if (!set_pivot(row, i)) {
            *bad_pivot = i;
            return IH_ERR_NOT_POSITIVE;
        }
        if (!is_last) {
            next[i] = entry_q30(next[i], dot_q60(next, row, i), row[i], n);
            if (!set_pivot(next, i + 1)) {
                *bad_pivot = i + 1;
                return IH_ERR_NOT_POSITIVE;
            }
        }
    }
    return IH_OK;
}

/* Move the binary point of what is solved so far, x[from .. n - 1]. */
static void rescale(int32_t *x, int32_t from, int32_t n, int shift)
{
    for (int32_t k = from; k < n; k++) {
        x[k] = (int32_t)ih_shift_round(x[k], shift);
    }
}

void ih_cholesky_solve(const int32_t *l_q30, int32_t n, const int32_t *b, int32_t *x_mantissa,
                       int32_t *x_exponent)
{
    for (int32_t i = 0; i < n; i++) { /* L y = b */
        const int32_t *row = row_of(l_q30, i);
        int64_t rest = (int64_t)b[i] * (1 << 30) - dot_q60(row, x_mantissa, i);
        int64_t value = ih_div_round(rest, row[i]);
        IH_IN_RANGE(value, INT32_MIN, INT32_MAX);
        x_mantissa[i] = ih_saturate_s32(value);
    }
    int exponent = 0;
    for (int32_t i = n - 1; i >= 0; i--) { /* L^T x = y, in units of 2^exponent */
        int64_t sum = 0;
        for (int32_t k = i + 1; k < n; k++) {
            sum += (int64_t)row_of(l_q30, k)[i] * x_mantissa[k];
        }
        int64_t rest = ih_shift_round((int64_t)x_mantissa[i] * (1 << 30), exponent) - sum;
        int64_t value = ih_div_round(rest, row_of(l_q30, i)[i]);
        int grow = 0;
        while ((ih_abs_s64(value) >> grow) >= MANTISSA_MAX) {
            grow++;
        }
        if (grow > 0) {
            exponent += grow;
            rescale(x_mantissa, i + 1, n, grow);
        }
        x_mantissa[i] = (int32_t)ih_shift_round(value, grow);
        IH_IN_RANGE(x_mantissa[i], -IH_RANGE_MANTISSA, IH_RANGE_MANTISSA);
    }
    IH_IN_RANGE(exponent, 0, IH_RANGE_EXPONENT);
    *x_exponent = exponent;
}
