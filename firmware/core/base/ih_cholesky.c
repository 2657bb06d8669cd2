#include "base/ih_cholesky.h"

#include <stdbool.h>

#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "base/ih_range.h"

/* Mantissas of a solution stay below this: six products with |L| <= 1 in Q30 then sum below 2^(25 + 30 + 2.6). */
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

/* L_ij from A_ij and the terms that are subtracted before. The residual is in Q30: half a step of it is no more than
 * half a step of A. It is at most 1, with a pivot of the same size or more: Cauchy-Schwarz. */
static inline int32_t entry_q30(int32_t a_q30, int64_t taken_q60, int32_t pivot_q30,
                                int32_t inverse, int32_t n)
{
    const int64_t residual_q30 = a_q30 - ih_shift_round(taken_q60, 30);
    const int32_t entry = ih_saturate_s32(ih_mul_shift(residual_q30, inverse, bits_of(pivot_q30)));
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

enum ih_err ih_cholesky_factor(int32_t *a_q30, int32_t n, int32_t *bad_pivot)
{
    int32_t inverse[IH_CHOLESKY_MAX];
    *bad_pivot = IH_NONE;
    for (int32_t i = 0; i < n; i++) {
        int32_t *row_q30 = &a_q30[IH_CHOLESKY_PACKED(i)];
        for (int32_t k = 0; k < i; k++) {
            const int32_t *column_q30 = row_of(a_q30, k);
            row_q30[k] = entry_q30(row_q30[k], dot_q60(row_q30, column_q30, k), column_q30[k],
                                   inverse[k], n);
        }
        if (!set_pivot(row_q30, i, &inverse[i])) {
            *bad_pivot = i;
            return IH_ERR_NOT_POSITIVE;
        }
    }
    return IH_OK;
}

/* L y = b, in b's unit. */
static void solve_forward(const int32_t *l_q30, int32_t n, const int32_t *b, int32_t *y)
{
    for (int32_t i = 0; i < n; i++) {
        const int32_t *row = row_of(l_q30, i);
        int64_t residual = (int64_t)b[i] * (1 << 30) - dot_q60(row, y, i);
        y[i] = ih_saturate_s32(ih_div_round(residual, row[i])); /* as the header says, it fits */
    }
}

/* Take what an unknown brings from the residuals of those before it. Here and below clang's analyzer does not see that
 * the first n residuals are set. */
static void take_unknown(const int32_t *row_q30, int32_t count, int32_t unknown,
                         int64_t *residual_q30)
{
    for (int32_t k = 0; k < count; k++) {
        /* NOLINTNEXTLINE(clang-analyzer-core.uninitialized.Assign) */
        residual_q30[k] -= (int64_t)row_q30[k] * unknown;
    }
}

void ih_cholesky_solve(const int32_t *l_q30, int32_t n, const int32_t *b, int32_t *x_mantissa,
                       int32_t *x_exponent)
{
    int64_t residual_q30[IH_CHOLESKY_MAX];
    solve_forward(l_q30, n, b, x_mantissa);
    for (int32_t k = 0; k < n; k++) {
        residual_q30[k] = (int64_t)x_mantissa[k] * (1 << 30);
    }
    int exponent = 0;
    for (int32_t i = n - 1; i >= 0; i--) { /* L^T x = y, in units of 2^exponent */
        const int32_t *row = row_of(l_q30, i);
        const int64_t value = ih_div_round(residual_q30[i], row[i]);
        const int grow = ih_max_s32(0, ih_bits_u64((uint64_t)ih_abs_s64(value)) - MANTISSA_BITS);
        if (grow > 0) { /* move the binary point of what is solved so far, and of what is not */
            exponent += grow;
            for (int32_t k = i + 1; k < n; k++) {
                x_mantissa[k] = (int32_t)ih_shift_round(x_mantissa[k], grow);
            }
            for (int32_t k = 0; k < i; k++) {
                /* NOLINTNEXTLINE(clang-analyzer-core.CallAndMessage) */
                residual_q30[k] = ih_shift_round(residual_q30[k], grow);
            }
        }
        x_mantissa[i] = (int32_t)ih_shift_round(value, grow);
        IH_IN_RANGE(x_mantissa[i], -IH_RANGE_MANTISSA, IH_RANGE_MANTISSA);
        take_unknown(row, i, x_mantissa[i], residual_q30);
    }
    IH_IN_RANGE(exponent, 0, IH_RANGE_EXPONENT);
    *x_exponent = exponent;
}
