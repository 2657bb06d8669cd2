#include "surface/ih_normal_solve.h"

#include <stdint.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "surface/ih_normal_equations.h"

#define TERMS_MAX IH_NORMAL_EQUATIONS_TERMS_MAX
#define FACTOR_BITS IH_NORMAL_EQUATIONS_FACTOR_BITS
/* Mantissas of a solution stay below this: 144 products with |F| <= 1 then sum below 2^(25 + 27 + 7.2). */
#define MANTISSA_BITS 25

/* If the matrix was not positive numbers may be large: then sums wrap around, and quotients are limited. */
__attribute__((noinline)) static int64_t quotient(int64_t remainder, int32_t pivot)
{
    return ih_div_round(ih_clamp_s64(remainder, (int64_t)1 << 62), pivot);
}

/* An unknown from the remainder of the right side. */
static int32_t solve_one(uint64_t remainder, int32_t pivot)
{
    return (int32_t)ih_clamp_s64(quotient(IH_WRAPS(int64_t, remainder), pivot), INT32_MAX);
}

/* Solve F^T v = b, in b's unit: v replaces b. */
IH_WRAPPING static void solve_transposed(const int32_t *line, int32_t term_count, int32_t *b)
{
    const int32_t last = term_count - 1;
    uint64_t remainder[TERMS_MAX];
    for (int32_t k = 0; k <= last; k++) {
        remainder[k] = IH_WRAPS(uint64_t, (int64_t)b[k] * (1 << FACTOR_BITS));
    }
    /* Two at a time: the remainder is loaded and stored half as often. */
    for (int32_t p = last; p > 0; p -= 2) {
        const int32_t *row = &line[ih_normal_equations_line(p)],
                      *next = &line[ih_normal_equations_line(p - 1)];
        b[p] = solve_one(remainder[p], row[p]);
        const int32_t negative = -b[p];
        b[p - 1] = solve_one(remainder[p - 1] + IH_WRAPS(uint64_t, (int64_t)row[p - 1] * negative),
                             next[p - 1]);
        const int32_t next_negative = -b[p - 1];
        for (int32_t k = 0; k < p - 1; k++) {
            remainder[k] += IH_WRAPS(uint64_t, (int64_t)row[k] * negative) +
                            IH_WRAPS(uint64_t, (int64_t)next[k] * next_negative);
        }
    }
}

IH_WRAPPING static int64_t dot_product(const int32_t *a, const int32_t *b, int32_t count)
{
    uint64_t sum = 0;
    for (int32_t k = 0; k < count; k++) {
        sum += IH_WRAPS(uint64_t, (int64_t)a[k] * b[k]);
    }
    return IH_WRAPS(int64_t, sum);
}

bool ih_normal_solve(const int32_t *line, int32_t term_count, const int32_t *b, int32_t *x_mantissa,
                     int32_t *x_exponent)
{
    int exponent = 0;
    memmove(x_mantissa, b, (size_t)term_count * sizeof *b);
    solve_transposed(line, term_count, x_mantissa);
    for (int32_t p = 0; p < term_count; p++) { /* F x = v, in units of 2^exponent */
        const int32_t *row = &line[ih_normal_equations_line(p)];
        const int64_t v = ih_shift_round((int64_t)x_mantissa[p] * (1 << FACTOR_BITS), exponent);
        const int64_t solved = ih_clamp_s64(dot_product(row, x_mantissa, p), (int64_t)1 << 62);
        const int64_t value = quotient(v - solved, row[p]);
        const int grow = ih_max_s32(0, ih_bits_u64((uint64_t)ih_abs_s64(value)) - MANTISSA_BITS);
        if (grow > 0) { /* move the binary point of the unknowns so far */
            exponent += grow;
            if (exponent > IH_NORMAL_SOLVE_EXPONENT_MAX) {
                return false;
            }
            for (int32_t k = 0; k < p; k++) {
                x_mantissa[k] = (int32_t)ih_shift_round(x_mantissa[k], grow);
            }
        }
        x_mantissa[p] = (int32_t)ih_shift_round(value, grow);
        IH_IN_RANGE(x_mantissa[p], -IH_RANGE_MANTISSA, IH_RANGE_MANTISSA);
    }
    IH_IN_RANGE(exponent, 0, IH_RANGE_EXPONENT);
    *x_exponent = exponent;
    return true;
}
