#include "surface/ih_surface.h"

#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "surface/ih_multiquadric.h"
#include "surface/ih_normal_equations.h"
#include "surface/ih_normal_solve.h"
#include "surface/ih_surface_grid.h"
#include "surface/ih_surface_rows.h"

#define TERMS_MAX IH_SURFACE_TERMS_MAX

/* Scale factors of the sums are 0.995 * 2^43 / sqrt(sum), at least 2^27.4, for sums of at least 2^22. */
#define SCALE_SHIFT 43
#define SCALE_NUMERATOR ((((int64_t)1 << SCALE_SHIFT) / 1000) * 995)
/* A product with two of them is shifted in two steps to Q30. */
#define SCALE_STEP ((2 * SCALE_SHIFT - 30) / 2)
/* Scales of short rows and of sums together: unknown_scale_q29. */
#define UNKNOWN_SCALE_BITS 29
/* Residuals times their weights are limited to 2^OFF_BITS, four times the farthest sample's distance from the mean.
 * They have at least 11 fraction bits, as samples are no farther than 16 m. With a small weight the surface may be
 * farther off. */
#define OFF_BITS 27
#define OFF_FRACTION_MAX 24
#define OFF_MAX ((int64_t)1 << 31)
/* Entries of the right side stay below this. |L^-1 b| is at most 12 * 2^18 / 2.6e-3, which int32 holds. */
#define RIGHT_BITS 18
/* Coefficients below 2^28, basis below 2^26.5, 144 terms: sums below 2^61.7, twice that where they are folded. */
#define SOLUTION_BITS 28
/* Iterative refinement converges linearly: the error ratio of two steps stays the same. Another correction is made while
 * the sum of the predicted error's squares may be above 2^-8, up to a maximum number. The unknowns are measured, not
 * their effect at the samples: the fewer samples see a direction, the more it weighs. An error that only decides weights
 * may be larger. In frames one correction nearly always is enough, and the worst node is 0.05 mm off. */
#define SQUARES_LOG2_ENOUGH (-8)
#define SQUARES_LOG2_FOR_WEIGHTS 4
#define CORRECTIONS_MAX 8
#define CORRECTIONS_FEW 3
#define SQUARES_LOG2_NONE (-1000)
#define SQUARES_LOG2_MAX 1000
/* Samples nearer to the surface than FAR_EIGHTHS / 8 of the limit keep their weight; they are not checked again after
 * the last correction. */
#define FAR_EIGHTHS 6
/* Number of last rows of the factor with more bits: of samples on a lattice, the pivots of all others are small. */
#define FINE_ROWS (2 * IH_NORMAL_EQUATIONS_ROWS)

void ih_surface_params_default(struct ih_surface_params *params)
{
    *params = (struct ih_surface_params){
        .ridge_q30 = 10737, /* 1e-5 */
        .huber_mm = 60,
        .centres = IH_SURFACE_CENTRES_FEW,
        .is_moving = true,
    };
}

/* value * 2^up, or / 2^-up, rounded, limited to 2^62. */
static int64_t shift_by(int64_t value, int up)
{
    const int64_t max = (int64_t)1 << 62;
    if (up <= 0) {
        return ih_shift_round(value, ih_min_s32(-up, 62));
    }
    if (ih_bits_u64((uint64_t)ih_abs_s64(value)) + up > 62) {
        return value < 0 ? -max : value > 0 ? max : 0;
    }
    return value * ((int64_t)1 << up);
}

static int32_t mean_depth_mm_q8(const struct ih_samples *samples)
{
    int64_t sum = 0;
    for (int32_t i = 0; i < samples->sample_count; i++) {
        sum += samples->sample[i].depth_mm_q8;
    }
    return (int32_t)ih_div_round(sum, samples->sample_count);
}

/* Fraction bits of residuals: as many as keep four times the farthest sample's distance from the mean below 2^OFF_BITS. */
static void set_off_fraction(struct ih_surface_scratch *scratch, const struct ih_samples *samples,
                             int32_t mean_mm_q8)
{
    int32_t max_mm_q8 = 0;
    for (int32_t i = 0; i < samples->sample_count; i++) {
        max_mm_q8 = ih_max_s32(max_mm_q8, ih_abs_s32(samples->sample[i].depth_mm_q8 - mean_mm_q8));
    }
    scratch->off_fraction =
        ih_min_s32(8 + OFF_BITS - 2 - ih_bits_u64((uint64_t)max_mm_q8), OFF_FRACTION_MAX);
}

/* A depth in the unit of residuals: off_fraction bits. */
static int64_t residual_of_depth(const struct ih_surface_scratch *scratch, int32_t depth_mm_q8)
{
    return depth_mm_q8 * ((int64_t)1 << (scratch->off_fraction - 8));
}

/* Residual of a sample at that depth behind the mean, by the sum of its row. */
static int64_t residual_of_sum(const struct ih_surface_scratch *scratch, int64_t sum,
                               int32_t depth_mm_q8)
{
    const int up = scratch->off_fraction - 20 - scratch->coefficient_shift;
    return residual_of_depth(scratch, depth_mm_q8) - ih_clamp_s64(shift_by(sum, up), OFF_MAX);
}

/* The factor of a row on the right side. */
static int32_t right_factor(int64_t off, int64_t weight)
{
    return (int32_t)ih_clamp_s64(ih_mul_shift(off, weight, 30), (int64_t)1 << OFF_BITS);
}

/* Add one row to the right side. */
static void add_right(struct ih_surface_scratch *scratch, const uint32_t *row_q20, int64_t off,
                      int64_t weight)
{
    int32_t push[IH_MULTIQUADRIC_ROWS] = {0};
    push[0] = right_factor(off, weight);
    ih_multiquadric_add(row_q20, 1, push, scratch->right, scratch->terms);
}

/* Scale factors from the sums' diagonal. */
static void set_scale(struct ih_surface_scratch *scratch, uint32_t scale[TERMS_MAX])
{
    for (int32_t i = 0; i < scratch->terms; i++) {
        const int32_t sum = scratch->normal[ih_normal_equations_line(i) + i];
        const uint64_t root_q11 =
            (uint64_t)ih_isqrt_u54((uint64_t)ih_max_s32(sum, 1) << 22) + 1; /* it stays < 1 */
        const uint64_t value = ((uint64_t)SCALE_NUMERATOR << 11) / root_q11;
        scale[i] = (uint32_t)(value < UINT32_MAX ? value : UINT32_MAX);
        scratch->unknown_scale_q29[i] =
            (uint32_t)((uint64_t)scratch->row_scale_q17[i] * scale[i] >>
                       (IH_SURFACE_ROW_SCALE_BITS + SCALE_SHIFT - UNKNOWN_SCALE_BITS));
    }
}

/* Scale the sums to diagonal 0.99, with ridge, in Q30. */
static void scale_lines(const struct ih_surface_params *params, struct ih_surface_scratch *scratch)
{
    uint32_t scale[TERMS_MAX];
    set_scale(scratch, scale);
    /* |N_ij| <= root_i root_j: below 2^30.6. A sum of 0 may be a step below 0 by rounding. */
    ih_normal_equations_scale(scratch->normal, scratch->terms, scale, SCALE_STEP, scratch->factor);
    for (int32_t i = 0; i < scratch->terms; i++) {
        int32_t *at_q30 = &scratch->factor[ih_normal_equations_line(i) + i];
        *at_q30 += (int32_t)ih_mul_shift(*at_q30, params->ridge_q30, 30);
        IH_IN_RANGE(*at_q30, 0, IH_RANGE_SCALED_Q30);
    }
}

/* Factor with more bits in the rows from fine_from on. Returns whether the factor is good: no pivot's square can be below
 * the ridge, but for rounding. */
static bool try_factor(const struct ih_surface_params *params, int32_t fine_from,
                       struct ih_surface_scratch *scratch)
{
    scale_lines(params, scratch);
    scratch->is_fine = fine_from == 0;
    scratch->limit_log2 = SQUARES_LOG2_MAX;
    return ih_normal_equations_factor(scratch->terms, fine_from,
                                      params->ridge_q30 - params->ridge_q30 / 4, scratch->factor,
                                      scratch->pair);
}

/* Factor with more bits in all rows. Sums that shared their memory with the factor are summed again. */
static void factor_fine(const struct ih_samples *samples, const struct ih_surface_params *params,
                        const struct ih_surface *out, struct ih_surface_scratch *scratch)
{
    if (scratch->factor == scratch->normal) {
        ih_surface_rows_sum(samples, params, scratch, out);
    }
    (void)try_factor(params, 0, scratch);
}

static void factor(const struct ih_samples *samples, const struct ih_surface_params *params,
                   const struct ih_surface *out, struct ih_surface_scratch *scratch)
{
    if (!try_factor(params, scratch->terms - FINE_ROWS, scratch)) {
        factor_fine(samples, params, out, scratch);
    }
    scratch->squares_log2 = SQUARES_LOG2_MAX;
}

/* Set the right side to the ridge's part, ridge * N_ii * c_i, or subtract it. */
static void set_or_subtract_ridge(const struct ih_surface_params *params, bool is_subtracted,
                                  struct ih_surface_scratch *scratch)
{
    for (int32_t i = 0; i < scratch->terms; i++) {
        /* 2^58 times 2^31.4 over 2^32; in Q8 more than the coefficients */
        const int64_t part = ih_mul_wide_shift((int64_t)scratch->coefficient[i] * params->ridge_q30,
                                               scratch->norm_q10[i], 32);
        const int to_right = 20 + scratch->off_fraction - 8 - scratch->coefficient_shift;
        const int64_t shifted = ih_clamp_s64(shift_by(part, to_right), (int64_t)1 << 61);
        scratch->right[i] =
            is_subtracted ? ih_clamp_s64(scratch->right[i], (int64_t)1 << 61) - shifted : shifted;
    }
}

/* The right side of the scaled system, entries below 2^RIGHT_BITS. Returns its fraction bits; the unit is that of the
 * right side over 2^normal_shift. */
static int scale_right(struct ih_surface_scratch *scratch)
{
    int64_t *right = scratch->right; /* scaled in place: no longer needed */
    uint64_t max = 0;
    for (int32_t i = 0; i < scratch->terms; i++) {
        max |= (uint64_t)ih_abs_s64(right[i]);
    }
    const int first = ih_max_s32(0, ih_bits_u64(max) - 30);
    max = 0;
    for (int32_t i = 0; i < scratch->terms; i++) {
        right[i] = ih_shift_round(right[i], first) * (int64_t)scratch->unknown_scale_q29[i];
        max |= (uint64_t)ih_abs_s64(right[i]);
    }
    const int second = ih_max_s32(0, ih_bits_u64(max) - RIGHT_BITS);
    for (int32_t i = 0; i < scratch->terms; i++) {
        scratch->solution[i] = (int32_t)ih_shift_round(right[i], second);
    }
    return 20 + scratch->off_fraction - first + UNKNOWN_SCALE_BITS - second;
}

/* Add the solution, with `fraction` bits, to the coefficients: both in the finer of the two formats that hold them. */
static void add_solution(struct ih_surface_scratch *scratch, int fraction)
{
    uint64_t max = 0, max_before = 0;
    for (int32_t i = 0; i < scratch->terms; i++) {
        const int64_t product = (int64_t)scratch->solution[i] * scratch->unknown_scale_q29[i];
        max |= (uint64_t)ih_abs_s64(product); /* < 2^57 */
        max_before |= (uint64_t)ih_abs_s32(scratch->coefficient[i]);
    }
    const int product_shift = fraction + UNKNOWN_SCALE_BITS;
    const int own = product_shift - ih_bits_u64(max) + SOLUTION_BITS - 1;
    const int before = scratch->coefficient_shift - ih_bits_u64(max_before) + SOLUTION_BITS - 1;
    const int shift = max_before == 0 ? own : ih_min_s32(own, before);
    for (int32_t i = 0; i < scratch->terms; i++) {
        const int64_t product = (int64_t)scratch->solution[i] * scratch->unknown_scale_q29[i];
        scratch->coefficient[i] =
            (int32_t)(shift_by(scratch->coefficient[i], shift - scratch->coefficient_shift) +
                      shift_by(product, shift - product_shift));
        IH_IN_RANGE(scratch->coefficient[i], -IH_RANGE_COEFFICIENT, IH_RANGE_COEFFICIENT);
    }
    scratch->coefficient_shift = shift;
}

/* Solve for a correction of the coefficients from the remaining right side. squares_log2: of the sum of the unknowns'
 * squares, where the samples' sums are 1, over the square of the samples' number. Returns false, and changes nothing, if
 * there is no solution, or if it exceeds limit_log2, that of the correction before: then corrections diverge. */
static bool correct(const struct ih_surface_params *params, struct ih_surface_scratch *scratch)
{
    int32_t exponent;
    set_or_subtract_ridge(params, true, scratch);
    /* A x = b is (right side) / 2^normal_shift: x and b have as many fraction bits more. */
    const int fraction = scale_right(scratch) + scratch->normal_shift;
    if (!ih_normal_solve(scratch->factor, scratch->terms, scratch->solution, scratch->solution,
                         &exponent)) {
        return false;
    }
    int64_t squares = 0; /* 144 * 2^50 */
    for (int32_t i = 0; i < scratch->terms; i++) {
        squares += (int64_t)scratch->solution[i] * scratch->solution[i];
    }
    const int log2 = ih_bits_u64((uint64_t)squares) - 2 * (fraction - exponent) +
                     scratch->normal_shift - 2 * scratch->samples_log2;
    if (squares != 0 && log2 > scratch->limit_log2) {
        return false;
    }
    scratch->squares_log2 = squares == 0 ? SQUARES_LOG2_NONE : log2;
    scratch->limit_log2 = scratch->squares_log2;
    add_solution(scratch, fraction - exponent);
    return true;
}

/* If corrections grow with the coarse factor start again with the fine one, once: few samples' pivots do not reveal a
 * bad factor. Returns false when no option is left. */
static bool correct_or_refactor(const struct ih_samples *samples,
                                const struct ih_surface_params *params,
                                const struct ih_surface *out, struct ih_surface_scratch *scratch)
{
    if (correct(params, scratch)) {
        return true;
    }
    if (scratch->is_fine) {
        return false;
    }
    factor_fine(samples, params, out, scratch);
    return true;
}

/* Set the right side for the present coefficients, which at first are all 0, and mark the samples far from the surface. */
static void set_right(const struct ih_samples *samples, const struct ih_surface_params *params,
                      const struct ih_surface *out, bool is_first,
                      struct ih_surface_scratch *scratch)
{
    const int64_t far = (int64_t)params->huber_mm * FAR_EIGHTHS << (scratch->off_fraction - 3);
    int32_t count;
    memset(scratch->right, 0, sizeof scratch->right);
    for (int32_t first = 0; first < samples->sample_count; first += count) {
        count = ih_surface_rows_together(samples, scratch, first);
        const uint32_t *row_q20 = ih_surface_rows_of(samples, first, scratch);
        int64_t sum[IH_MULTIQUADRIC_ROWS] = {0};
        int32_t push[IH_MULTIQUADRIC_ROWS];
        if (!is_first) {
            ih_multiquadric_sum(row_q20, count, scratch->coefficient, scratch->terms, sum);
        }
        for (int32_t k = 0; k < count; k++) {
            const int32_t i = first + k;
            const int64_t off = residual_of_sum(scratch, sum[k],
                                                samples->sample[i].depth_mm_q8 - out->mean_mm_q8 -
                                                    scratch->moved_mm_q8[i]);
            scratch->is_far[i] = ih_abs_s64(off) >= far;
            push[k] = right_factor(
                off, ih_surface_weight_q30(scratch,
                                           ih_surface_root_weight_q15(samples, params, out, i)));
        }
        ih_multiquadric_add(row_q20, count, push, scratch->right, scratch->terms);
    }
}

/* Correct the coefficients by the right side they leave, with full rows, until that is enough. */
static void refine(const struct ih_samples *samples, const struct ih_surface_params *params,
                   const struct ih_surface *out, int32_t enough_log2,
                   struct ih_surface_scratch *scratch)
{
    /* With fewer samples than unknowns some directions converge slowly. */
    const int32_t min = samples->sample_count < scratch->terms ? CORRECTIONS_FEW : 1;
    int32_t before;
    int32_t count = 0;
    do {
        before = scratch->squares_log2;
        set_right(samples, params, out, false, scratch);
        count++;
    } while (correct_or_refactor(samples, params, out, scratch) &&
             (count < min ||
              (2 * scratch->squares_log2 - before > enough_log2 && count < CORRECTIONS_MAX)));
}

/* Huber step: a sample too far from the surface gets a smaller weight. Returns the root of its weight. */
static int32_t reweight(const struct ih_sample *sample, const struct ih_surface_params *params,
                        int64_t off_mm_q11)
{
    const int64_t limit_q11 = (int64_t)params->huber_mm << 11;
    const int64_t off_q11 = ih_abs_s64(off_mm_q11);
    if (off_q11 <= limit_q11) {
        return sample->root_weight_q15;
    }
    /* sqrt(limit / off) in Q15 */
    const int64_t root_q15 = ih_isqrt_u64((uint64_t)ih_div_round(limit_q11 * (1 << 30), off_q11));
    return (int32_t)ih_mul_shift(sample->root_weight_q15, root_q15, 15);
}

/* Move sample i, which is too far off, to where its residual is huber_mm. */
static void move_sample(const struct ih_sample *sample, const struct ih_surface_params *params,
                        struct ih_surface_scratch *scratch, int32_t i, const uint32_t *row_q20,
                        int64_t off)
{
    const int64_t limit = (int64_t)params->huber_mm << scratch->off_fraction;
    const int64_t excess = off - ih_clamp_s64(off, limit);
    scratch->moved_mm_q8[i] = (int32_t)ih_shift_round(excess, scratch->off_fraction - 8);
    add_right(scratch, row_q20, -residual_of_depth(scratch, scratch->moved_mm_q8[i]),
              ih_surface_weight_q30(scratch, sample->root_weight_q15));
}

/* New weights by the distance from the surface, of the samples that were far from it before the last correction. Those
 * whose weight changed are moved, or their rows in the sums are exchanged. The right side is that of the solved system,
 * which leaves the ridge's part only, and the changes. Returns the number of changed samples. */
static int32_t change_far(const struct ih_samples *samples, const struct ih_surface_params *params,
                          struct ih_surface_scratch *scratch, struct ih_surface *out)
{
    int32_t changed_count = 0;
    set_or_subtract_ridge(params, false, scratch);
    for (int32_t i = 0; i < samples->sample_count; i++) {
        const struct ih_sample *sample = &samples->sample[i];
        if (!scratch->is_far[i]) {
            continue;
        }
        const uint32_t *row_q20 = ih_surface_rows_of(samples, i, scratch);
        int64_t sum[IH_MULTIQUADRIC_ROWS];
        ih_multiquadric_sum(row_q20, 1, scratch->coefficient, scratch->terms, sum);
        const int64_t off = residual_of_sum(scratch, sum[0], sample->depth_mm_q8 - out->mean_mm_q8);
        const int32_t root_q15 =
            reweight(sample, params, ih_shift_round(off, scratch->off_fraction - 11));
        out->root_weight_q15[i] = root_q15;
        if (root_q15 == sample->root_weight_q15) {
            continue;
        }
        if (params->is_moving) {
            move_sample(sample, params, scratch, i, row_q20, off);
        } else {
            add_right(scratch, row_q20, off,
                      ih_surface_weight_q30(scratch, root_q15) -
                          ih_surface_weight_q30(scratch, sample->root_weight_q15));
            ih_surface_rows_exchange(scratch, row_q20, changed_count, sample->root_weight_q15,
                                     root_q15);
        }
        changed_count++;
    }
    if (!params->is_moving) {
        ih_surface_rows_finish_exchange(scratch, changed_count);
    }
    return changed_count;
}

static bool fit_first(const struct ih_samples *samples, const struct ih_surface_params *params,
                      struct ih_surface_scratch *scratch, struct ih_surface *out)
{
    if (!ih_surface_rows_set_weight_shift(scratch, out->root_weight_q15, samples->sample_count)) {
        return false;
    }
    memset(scratch->moved_mm_q8, 0, sizeof scratch->moved_mm_q8);
    memset(scratch->coefficient, 0, sizeof scratch->coefficient);
    scratch->coefficient_shift = 0;
    memset(scratch->norm_q10, 0, sizeof scratch->norm_q10);
    (void)ih_surface_rows_set_norms(scratch, samples, out->root_weight_q15);
    ih_surface_rows_set_scale(scratch, samples);
    set_off_fraction(scratch, samples, out->mean_mm_q8);
    scratch->samples_log2 = ih_bits_u64((uint64_t)(samples->sample_count + 7) / 8);
    ih_surface_rows_sum(samples, params, scratch, out);
    set_right(samples, params, out, true, scratch);
    factor(samples, params, out, scratch);
    (void)correct(params, scratch);
    refine(samples, params, out, SQUARES_LOG2_FOR_WEIGHTS, scratch);
    return true;
}

/* Sum all rows again, and scale the right side to the present enlargement of the weights. */
static bool sum_again(const struct ih_samples *samples, const struct ih_surface_params *params,
                      struct ih_surface_scratch *scratch, const struct ih_surface *out)
{
    const int32_t before = scratch->weight_shift;
    if (!ih_surface_rows_set_weight_shift(scratch, out->root_weight_q15, samples->sample_count)) {
        return false;
    }
    for (int32_t i = 0; i < scratch->terms; i++) {
        scratch->right[i] = shift_by(scratch->right[i], 2 * (scratch->weight_shift - before));
    }
    (void)ih_surface_rows_set_norms(scratch, samples, out->root_weight_q15);
    ih_surface_rows_set_scale(scratch, samples);
    ih_surface_rows_sum(samples, params, scratch, out);
    return true;
}

/* Factor the system of the present weights. */
static bool factor_again(const struct ih_samples *samples, const struct ih_surface_params *params,
                         struct ih_surface_scratch *scratch, const struct ih_surface *out)
{
    const bool is_light = ih_surface_rows_set_norms(scratch, samples, out->root_weight_q15);
    if (is_light && !sum_again(samples, params, scratch, out)) {
        return false;
    }
    factor(samples, params, out, scratch);
    return true;
}

/* Solve again with smaller weights for the samples far from the surface, or with those moved, if any. */
static bool fit_again(const struct ih_samples *samples, const struct ih_surface_params *params,
                      struct ih_surface_scratch *scratch, struct ih_surface *out)
{
    const int32_t left_log2 = scratch->squares_log2;
    out->downweighted_count = change_far(samples, params, scratch, out);
    if (out->downweighted_count > 0) {
        if (params->is_moving) {
            scratch->limit_log2 = SQUARES_LOG2_MAX;
        } else if (!factor_again(samples, params, scratch, out)) {
            return false;
        }
        (void)correct(params, scratch);
        /* The right side lacks the residual of the first system: the next correction may be as large as its last one. */
        scratch->limit_log2 = ih_max_s32(scratch->limit_log2, left_log2);
    }
    refine(samples, params, out, SQUARES_LOG2_ENOUGH, scratch);
    return true;
}

void ih_surface_fit(const struct ih_samples *samples, const struct ih_field *field,
                    const struct ih_surface_params *params, struct ih_surface_scratch *scratch,
                    struct ih_surface *out)
{
    memset(out, 0, sizeof *out);
    out->field = *field;
    if (samples->sample_count < IH_SURFACE_SAMPLES_MIN) {
        return;
    }
    ih_surface_rows_set_centres(params, scratch);
    out->centres = params->centres;
    out->mean_mm_q8 = mean_depth_mm_q8(samples);
    for (int32_t i = 0; i < samples->sample_count; i++) {
        out->root_weight_q15[i] = samples->sample[i].root_weight_q15;
    }
    if (!fit_first(samples, params, scratch, out) || !fit_again(samples, params, scratch, out)) {
        return;
    }
    ih_surface_grid_evaluate(samples, scratch, out);
    out->valid = true;
}
