#include "surface/ih_multiquadric.h"

#include "simd/ih_simd.h"
#include "surface/ih_multiquadric_table.h"

#define SPANS_BELOW IH_MULTIQUADRIC_SPANS_BELOW
#define SPAN_BITS IH_MULTIQUADRIC_SPAN_BITS
#define RISE_SHIFT IH_MULTIQUADRIC_RISE_SHIFT
#define PART_SHIFT IH_MULTIQUADRIC_PART_SHIFT
/* With m = s * 4^e the root of s in Q18 is sqrt(m) / 2^(9 + e), and in Q20 the table's value over 2^(5 + e). */
#define ROOT_SHIFT 5

#if IH_I16_LANES > 0

static inline ih_u32 load(const uint32_t *from)
{
    return (ih_u32)ih_i32_load((const int32_t *)from);
}

#endif

#if IH_SIMD_LANE_SHIFTS

static inline ih_u32 all_lanes(uint32_t value)
{
    return (ih_u32)ih_i32_all((int32_t)value);
}

static inline ih_u32 roots_of(ih_u32 square)
{
    const ih_u32 e = ih_u32_zero_pairs(square);
    const ih_u32 m = ih_u32_shift_left_each(square, e << 1);
    const ih_u32 at = ih_u32_shift_right(m, SPAN_BITS) - all_lanes(SPANS_BELOW);
    const struct ih_u32_neighbours root = ih_u32_look_up(ih_multiquadric_roots_q16, at);
    const ih_u32 rise = ih_u32_shift_right(root.next - root.value, RISE_SHIFT);
    const ih_u32 g = ih_u32_shift_right(m, SPAN_BITS - 16) & all_lanes(0xffff);
    const ih_u32 part = ih_u32_shift_right(rise * g, PART_SHIFT);
    return ih_u32_shift_right_each(root.value + part, e + all_lanes(ROOT_SHIFT));
}

/* The last vector ends with the line: 12 roots are two overlapping vectors of 8. */
void ih_multiquadric_roots(const uint32_t *across_q18, int32_t across_count,
                           const uint32_t *down_q18, int32_t down_count, uint32_t *root_q20)
{
    for (int32_t i = 0; i < across_count; i += IH_I32_LANES) {
        const int32_t last = across_count - IH_I32_LANES;
        const int32_t at = i < last ? i : last;
        const ih_u32 across = load(&across_q18[at]);
        for (int32_t k = 0; k < down_count; k++) {
            ih_i32_store((int32_t *)&root_q20[k * across_count + at],
                         (ih_i32)roots_of(across + all_lanes(down_q18[k])));
        }
    }
}

#else

static inline uint32_t root_of(uint32_t square_q18)
{
    const uint32_t zeros = (uint32_t)__builtin_clz(square_q18);
    const uint32_t m = square_q18 << (zeros & ~1u);
    const uint32_t *root = &ih_multiquadric_roots_q16[(m >> SPAN_BITS) - SPANS_BELOW];
    const uint32_t g = m >> (SPAN_BITS - 16) & 0xffff;
    const uint32_t rise = (root[1] - root[0]) >> RISE_SHIFT;
    return (root[0] + (rise * g >> PART_SHIFT)) >> (ROOT_SHIFT + zeros / 2);
}

void ih_multiquadric_roots(const uint32_t *across_q18, int32_t across_count,
                           const uint32_t *down_q18, int32_t down_count, uint32_t *root_q20)
{
    for (int32_t k = 0; k < down_count; k++) {
        const uint32_t here_q18 = down_q18[k];
        uint32_t *line_q20 = &root_q20[k * across_count];
        for (int32_t i = 0; i < across_count; i++) {
            line_q20[i] = root_of(across_q18[i] + here_q18);
        }
    }
}

#endif

#if IH_I16_LANES > 0

/* Vectors of half a row of nodes that are summed together, as many as registers hold. */
#define NODE_VECTORS 3

/* Sums at `vectors` of nodes side by side, which the compiler knows. */
__attribute__((always_inline)) static inline void
sum_nodes(const int32_t *coefficient, const uint32_t *const *line_q20, int32_t line_count,
          int32_t count, int32_t width, int32_t vectors, int32_t x, int64_t begin, int64_t *sum)
{
    struct ih_wide_sums sums[NODE_VECTORS];
    for (int32_t v = 0; v < vectors; v++) {
        sums[v] = ih_wide_sums_zero();
    }
    /* No count is 0: do loops, or compilers move the sums for the case that nothing is added. */
    const int32_t *const end = &coefficient[line_count * count];
    do {
        const uint32_t *basis_q20 = &(*line_q20)[x];
        const int32_t *const line_end = &coefficient[count];
        do {
            const ih_i32 factor = ih_i32_all(*coefficient);
            for (int32_t v = 0; v < vectors; v++) {
                sums[v] = ih_wide_sums_add(sums[v], load(&basis_q20[IH_I32_LANES * v]), factor);
            }
            basis_q20 = &basis_q20[width];
            coefficient = &coefficient[1];
        } while (coefficient != line_end);
        line_q20 = &line_q20[1];
    } while (coefficient != end);
    for (int32_t v = 0; v < vectors; v++) {
        ih_wide_store(&sum[x + IH_I32_LANES * v],
                      ih_wide_add(ih_wide_sums_total(sums[v]), ih_wide_all(begin)));
    }
}

void ih_multiquadric_lines(const int32_t *coefficient, const uint32_t *const *line_q20,
                           int32_t line_count, int32_t count, int32_t width, int64_t begin,
                           int64_t *sum)
{
    const int32_t together = NODE_VECTORS * IH_I32_LANES;
    int32_t x = 0;
    for (; x + together <= width; x += together) {
        sum_nodes(coefficient, line_q20, line_count, count, width, NODE_VECTORS, x, begin, sum);
    }
    for (; x < width; x += IH_I32_LANES) {
        sum_nodes(coefficient, line_q20, line_count, count, width, 1, x, begin, sum);
    }
}

/* Sums of `rows` rows, which the compiler knows. */
__attribute__((always_inline)) static inline void sum_rows(const uint32_t *basis_q20, int32_t rows,
                                                           const int32_t *coefficient,
                                                           int32_t term_count, int64_t *sum)
{
    struct ih_wide_sums sums[IH_MULTIQUADRIC_ROWS];
    for (int32_t k = 0; k < rows; k++) {
        sums[k] = ih_wide_sums_zero();
    }
    for (int32_t i = 0; i < term_count; i += IH_I32_LANES) {
        const ih_i32 factor = ih_i32_load(&coefficient[i]);
        for (int32_t k = 0; k < rows; k++) {
            sums[k] = ih_wide_sums_add(sums[k], load(&basis_q20[k * term_count + i]), factor);
        }
    }
    for (int32_t k = 0; k < rows; k++) {
        sum[k] = ih_wide_total(ih_wide_sums_total(sums[k]));
    }
}

/* Add `rows` rows, which the compiler knows. */
__attribute__((always_inline)) static inline void add_rows(const uint32_t *basis_q20, int32_t rows,
                                                           const int32_t *factor, int64_t *sum,
                                                           int32_t term_count)
{
    ih_i32 each[IH_MULTIQUADRIC_ROWS];
    for (int32_t k = 0; k < rows; k++) {
        each[k] = ih_i32_all(factor[k]);
    }
    for (int32_t i = 0; i < term_count; i += IH_I32_LANES) {
        struct ih_wide_sums sums = ih_wide_sums_zero();
        for (int32_t k = 0; k < rows; k++) {
            sums = ih_wide_sums_add(sums, load(&basis_q20[k * term_count + i]), each[k]);
        }
        ih_wide_add_to(&sum[i], ih_wide_sums_total(sums));
    }
}

void ih_multiquadric_sum(const uint32_t *basis_q20, int32_t row_count, const int32_t *coefficient,
                         int32_t term_count, int64_t sum[IH_MULTIQUADRIC_ROWS])
{
    if (row_count == IH_MULTIQUADRIC_ROWS) {
        sum_rows(basis_q20, IH_MULTIQUADRIC_ROWS, coefficient, term_count, sum);
        return;
    }
    for (int32_t k = 0; k < row_count; k++) {
        sum_rows(&basis_q20[k * term_count], 1, coefficient, term_count, &sum[k]);
    }
}

void ih_multiquadric_add(const uint32_t *basis_q20, int32_t row_count,
                         const int32_t factor[IH_MULTIQUADRIC_ROWS], int64_t *sum,
                         int32_t term_count)
{
    if (row_count == IH_MULTIQUADRIC_ROWS) {
        add_rows(basis_q20, IH_MULTIQUADRIC_ROWS, factor, sum, term_count);
        return;
    }
    for (int32_t k = 0; k < row_count; k++) {
        add_rows(&basis_q20[k * term_count], 1, &factor[k], sum, term_count);
    }
}

#else

/* Two centres at a time: sums are loaded and stored half as often. */
void ih_multiquadric_lines(const int32_t *coefficient, const uint32_t *const *line_q20,
                           int32_t line_count, int32_t count, int32_t width, int64_t begin,
                           int64_t *sum)
{
    for (int32_t x = 0; x < width; x++) {
        sum[x] = begin;
    }
    for (int32_t k = 0; k < line_count; k++) {
        const uint32_t *here_q20 = line_q20[k];
        for (int32_t i = 0; i < count; i += 2) {
            const uint32_t *next_q20 = &here_q20[width];
            const int32_t first = coefficient[0], second = coefficient[1];
            for (int32_t x = 0; x < width; x++) {
                sum[x] +=
                    (int64_t)first * (int32_t)here_q20[x] + (int64_t)second * (int32_t)next_q20[x];
            }
            coefficient = &coefficient[2];
            here_q20 = &next_q20[width];
        }
    }
}

static int64_t sum_row(const uint32_t *basis_q20, const int32_t *coefficient, int32_t term_count)
{
    int64_t sum = 0;
#pragma GCC unroll 4
    for (int32_t i = 0; i < term_count; i++) {
        sum += (int64_t)(int32_t)basis_q20[i] * coefficient[i];
    }
    return sum;
}

static void add_row(const uint32_t *basis_q20, int32_t factor, int64_t *sum, int32_t term_count)
{
#pragma GCC unroll 4
    for (int32_t i = 0; i < term_count; i++) {
        sum[i] += (int64_t)(int32_t)basis_q20[i] * factor;
    }
}

void ih_multiquadric_sum(const uint32_t *basis_q20, int32_t row_count, const int32_t *coefficient,
                         int32_t term_count, int64_t sum[IH_MULTIQUADRIC_ROWS])
{
    for (int32_t k = 0; k < row_count; k++) {
        sum[k] = sum_row(&basis_q20[k * term_count], coefficient, term_count);
    }
}

void ih_multiquadric_add(const uint32_t *basis_q20, int32_t row_count,
                         const int32_t factor[IH_MULTIQUADRIC_ROWS], int64_t *sum,
                         int32_t term_count)
{
    for (int32_t k = 0; k < row_count; k++) {
        add_row(&basis_q20[k * term_count], factor[k], sum, term_count);
    }
}

#endif
