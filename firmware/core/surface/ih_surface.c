#include "surface/ih_surface.h"

#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "surface/ih_multiquadric.h"
#include "surface/ih_normal_solve.h"

/* Limits of 64 bits: compilers make no vectors of them by themselves. */
#if defined __x86_64__ && defined __AVX2__
#include <immintrin.h>
#endif

#define TERMS_MAX IH_SURFACE_TERMS_MAX
#define CENTRES_MAX IH_SURFACE_CENTRES_MAX

/* Short rows: the basis scaled column by column to IH_NORMAL_EQUATIONS_MOST, less one step that rounding and the roots'
 * errors may add. The scale in Q17 is below 2^31, as no bound is below 1. */
#define ROW_MAX (IH_NORMAL_EQUATIONS_MAX - 1)
#define ROW_SCALE_BITS 17
/* Scale factors of the sums are 0.995 * 2^43 / sqrt(sum), 2^27.4 and more, for sums of 2^22 and more. */
#define SCALE_SHIFT 43
#define SCALE_NUMERATOR ((((int64_t)1 << SCALE_SHIFT) / 1000) * 995)
/* A product with two of them is shifted in two steps to Q30. */
#define SCALE_STEP ((2 * SCALE_SHIFT - 30) / 2)
/* Scales of short rows and of sums together: unknown_scale_q29. */
#define UNKNOWN_SCALE_BITS 29
/* Residuals times their weights are limited to 2^OFF_BITS, which is four times what the farthest sample is off
 * the mean. They have 11 fraction bits or more, as samples are no farther than 16 m. Where a weight is small
 * the surface may be farther off. */
#define OFF_BITS 27
#define OFF_FRACTION_MAX 24
#define OFF_MAX ((int64_t)1 << 31)
/* Entries of the right side stay below this. |L^-1 b| is at most 12 * 2^18 / 2.6e-3, which int32 holds. */
#define RIGHT_BITS 18
/* Coefficients below 2^28, basis below 2^26.5, 144 terms: sums below 2^61.7, twice that where they are
 * folded. */
#define SOLUTION_BITS 28
/* A correction leaves an error that is to it as it is to the one before. Another one is made while the sum of
 * that error's squares may be above 2^-8, so often at the most. The unknowns are measured, not what they change
 * at the samples: the less a direction is seen by samples, the more it counts. What only decides about weights
 * may be farther off. In frames one correction nearly always is enough, and the worst node is 0.05 mm off. */
#define SQUARES_LOG2_ENOUGH (-8)
#define SQUARES_LOG2_FOR_WEIGHTS 4
#define CORRECTIONS_MAX 8
#define CORRECTIONS_FEW 3
#define SQUARES_LOG2_NONE (-1000)
#define SQUARES_LOG2_MAX 1000
/* Samples nearer to the surface than so many eighths of the limit keep their weight without being asked again after
 * the last correction. */
#define FAR_EIGHTHS 6
/* So many rows of the factor, the last ones, have more bits: of samples on a lattice, the pivots of all others are
 * small. */
#define FINE_ROWS (2 * IH_NORMAL_EQUATIONS_ROWS)
/* Steps of the table, filled up to whole lines of ih_multiquadric. */
#define TABLE_LINE IH_SURFACE_CENTRES_FEW
#define TABLE_WIDTH (6 * TABLE_LINE)

/* Differences of the basis at two nodes are stored without sign: they are below the distance of the nodes, 2^25.4. */
#define DIFFERENCE_BIAS_Q20 (1 << 26)

_Static_assert(CENTRES_MAX == IH_MULTIQUADRIC_ACROSS_MAX &&
                   TERMS_MAX == IH_NORMAL_EQUATIONS_TERMS_MAX,
               "one system");
_Static_assert(TABLE_WIDTH >= IH_SURFACE_STEPS && IH_SURFACE_STEPS % 2 == 0, "all steps");

void ih_surface_params_default(struct ih_surface_params *params)
{
    *params = (struct ih_surface_params){
        .ridge_q30 = 10737, /* 1e-5 */
        .huber_mm = 60,
        .centres = IH_SURFACE_CENTRES_FEW,
        .is_moving = true,
    };
}

/* Steps of the grid between two centres. */
static int32_t steps_of(const struct ih_surface_scratch *scratch)
{
    return IH_SURFACE_CENTRES_STEPS / scratch->centres;
}

/* Where what belongs to so many centres stands, and their places in a row or column, field units. */
static void set_centres(const struct ih_surface_params *params, struct ih_surface_scratch *scratch)
{
    const int32_t centres = params->centres;
    const bool is_few = centres == IH_SURFACE_CENTRES_FEW && params->is_moving;
    scratch->centres = centres;
    scratch->terms = centres * centres;
    scratch->normal = is_few ? scratch->of.few.normal : scratch->of.many.normal;
    scratch->factor = is_few ? scratch->of.few.normal : scratch->of.many.factor;
    scratch->kept_count = is_few ? IH_SURFACE_ROWS_KEPT : 0;
    for (int32_t k = 0; k < centres; k++) {
        const int32_t half_steps = (2 * k - (centres - 1)) * steps_of(scratch);
        scratch->centre_q16[k] =
            (int32_t)ih_div_round((int64_t)half_steps * IH_SURFACE_STEP_NUMERATOR * 65536,
                                  2 * IH_SURFACE_STEP_DENOMINATOR);
    }
}

/* Terms are a multiple of 16, centres one of 4: compilers that know make whole vectors alone. */
static inline int32_t whole_blocks(int32_t terms)
{
    return terms & ~15;
}

/* Squares of a place's distances from the centres of a row, Q18: below 60^2; and `more`. */
static void square_distances(const struct ih_surface_scratch *scratch, int32_t place_q16,
                             uint32_t more_q18, uint32_t *restrict square_q18)
{
    const int32_t centres = scratch->centres & ~3;
    for (int32_t k = 0; k < centres; k++) {
        const int32_t d_q16 = place_q16 - scratch->centre_q16[k];
        square_q18[k] = (uint32_t)((uint64_t)((int64_t)d_q16 * d_q16) >> 14) + more_q18;
    }
}

/* The sample's row of the basis: sqrt(dx^2 + dy^2 + 1), Q20. */
static void fill_row(struct ih_surface_scratch *scratch, const struct ih_sample *sample,
                     uint32_t *row_q20)
{
    uint32_t dx2_q18[CENTRES_MAX];
    uint32_t dy2_q18[CENTRES_MAX];
    square_distances(scratch, sample->x_q16, 1 << 18, dx2_q18);
    square_distances(scratch, sample->y_q16, 0, dy2_q18);
    ih_multiquadric_roots(dx2_q18, scratch->centres, dy2_q18, scratch->centres, row_q20);
    IH_IN_RANGE(row_q20[0], (1 << 20) - 1, IH_RANGE_BASIS_Q20);
}

/* How many samples from i on are worked on together: their rows stand one behind the other. */
static int32_t rows_together(const struct ih_samples *samples,
                             const struct ih_surface_scratch *scratch, int32_t i)
{
    const int32_t end = ih_min_s32(samples->sample_count, scratch->kept_count);
    return i + IH_MULTIQUADRIC_ROWS <= end ? IH_MULTIQUADRIC_ROWS : 1;
}

/* Work out the row of sample i, into the place where it is kept, if there is one. */
static const uint32_t *new_row(const struct ih_samples *samples, int32_t i,
                               struct ih_surface_scratch *scratch)
{
    uint32_t *row_q20 = i < scratch->kept_count ? scratch->of.few.row_q20[i] : scratch->basis_q20;
    fill_row(scratch, &samples->sample[i], row_q20);
    return row_q20;
}

/* The row of sample i, and those of the others behind it, once the rows of all have been worked out. */
static const uint32_t *row_of(const struct ih_samples *samples, int32_t i,
                              struct ih_surface_scratch *scratch)
{
    return i < scratch->kept_count ? scratch->of.few.row_q20[i] : new_row(samples, i, scratch);
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

/* A weight's square, as much enlarged as all are: 2^30 and less. */
static int64_t weight_q30(const struct ih_surface_scratch *scratch, int32_t root_weight_q15)
{
    const int64_t root_q15 = (int64_t)root_weight_q15 << scratch->weight_shift;
    return root_q15 * root_q15;
}

/* How much weights are enlarged. False when there are none. */
static bool set_weight_shift(struct ih_surface_scratch *scratch, const int32_t *root_weight_q15,
                             int32_t count)
{
    int32_t max_q15 = 0;
    for (int32_t i = 0; i < count; i++) {
        max_q15 = ih_max_s32(max_q15, root_weight_q15[i]);
    }
    scratch->weight_shift = ih_max_s32(0, 15 - ih_bits_u64((uint64_t)max_q15));
    return max_q15 > 0;
}

/* Diagonal of R^T W R: sums of weight * (dx^2 + dy^2 + 1), from the samples' moments. Returns whether one is
 * below a quarter of what it was: then short rows would be too short. */
static bool set_norms(struct ih_surface_scratch *scratch, const struct ih_samples *samples,
                      const int32_t *root_weight_q15)
{
    int64_t sum_q30 = 0, x_q46 = 0, y_q46 = 0, square_q42 = 0;
    for (int32_t i = 0; i < samples->sample_count; i++) {
        const int64_t x_q16 = samples->sample[i].x_q16, y_q16 = samples->sample[i].y_q16;
        const int64_t weight = weight_q30(scratch, root_weight_q15[i]);
        sum_q30 += weight;
        x_q46 += weight * x_q16;
        y_q46 += weight * y_q16;
        square_q42 += weight * ((x_q16 * x_q16 + y_q16 * y_q16) >> 20);
    }
    bool is_light = false;
    for (int32_t i = 0; i < scratch->terms; i++) {
        const int64_t x_q16 = scratch->centre_q16[i % scratch->centres];
        const int64_t y_q16 = scratch->centre_q16[i / scratch->centres];
        const int64_t centre_q16 = ((x_q16 * x_q16 + y_q16 * y_q16) >> 16) + (1 << 16);
        const int64_t mixed_q42 = 2 * (x_q16 * (x_q46 >> 20) + y_q16 * (y_q46 >> 20));
        const int64_t norm_q38 = (sum_q30 >> 8) * centre_q16 - (mixed_q42 >> 4) + (square_q42 >> 4);
        IH_IN_RANGE(norm_q38, 0, IH_RANGE_NORM_Q38);
        const uint32_t norm_q10 = (uint32_t)(norm_q38 >> 28);
        is_light |= norm_q10 < scratch->norm_q10[i] / 4;
        scratch->norm_q10[i] = norm_q10;
    }
    return is_light;
}

/* The samples' least and greatest places along x and y. */
struct ends {
    int32_t end_q16[2][2];
};

static struct ends box_of(const struct ih_samples *samples)
{
    struct ends box = {{{INT32_MAX, INT32_MIN}, {INT32_MAX, INT32_MIN}}};
    for (int32_t i = 0; i < samples->sample_count; i++) {
        const struct ih_sample *sample = &samples->sample[i];
        box.end_q16[0][0] = ih_min_s32(box.end_q16[0][0], sample->x_q16);
        box.end_q16[0][1] = ih_max_s32(box.end_q16[0][1], sample->x_q16);
        box.end_q16[1][0] = ih_min_s32(box.end_q16[1][0], sample->y_q16);
        box.end_q16[1][1] = ih_max_s32(box.end_q16[1][1], sample->y_q16);
    }
    return box;
}

/* Scales of short rows: no entry is greater than the basis at the farthest corner of the box around the
 * samples, nor than the root of all squares' sum. And the unit of the rows' sums: no square's sum is above ratio *
 * 2^28, with what was rounded, so that in that unit all are below 2^31. */
static void set_row_scale(struct ih_surface_scratch *scratch, const struct ih_samples *samples)
{
    uint32_t far_q18[2][CENTRES_MAX];
    uint32_t ratio = 0;
    struct ends box = box_of(samples);
    memset(far_q18, 0, sizeof far_q18);
    for (int end = 0; end < 2; end++) {
        for (int axis = 0; axis < 2; axis++) {
            uint32_t square_q18[CENTRES_MAX] = {0};
            square_distances(scratch, box.end_q16[axis][end], 0, square_q18);
            for (int32_t k = 0; k < scratch->centres; k++) {
                const uint32_t here = square_q18[k];
                far_q18[axis][k] = here > far_q18[axis][k] ? here : far_q18[axis][k];
            }
        }
    }
    for (int32_t i = 0; i < scratch->terms; i++) {
        /* Two steps more than what was cut off. */
        const uint32_t box_q10 =
            ((far_q18[0][i % scratch->centres] + far_q18[1][i / scratch->centres]) >> 8) +
            (1 << 10) + 2;
        const uint32_t norm_q10 = scratch->norm_q10[i] + 2;
        const uint32_t min_q10 = box_q10 < norm_q10 ? box_q10 : norm_q10;
        const uint64_t max_q10 = min_q10 < 1 << 10 ? 1 << 10 : min_q10;
        const uint64_t max_q16 = (uint64_t)ih_isqrt_u54(max_q10 << 22) + 1;
        const uint32_t here = (uint32_t)(norm_q10 / max_q10) + 2;
        scratch->row_scale_q17[i] =
            (uint32_t)(((uint64_t)ROW_MAX << (ROW_SCALE_BITS + 16)) / max_q16);
        ratio = here > ratio ? here : ratio;
    }
    scratch->normal_shift = ih_max_s32(1, ih_bits_u64(ratio) - 3);
}

/* A sample's row as a short one, weighted: into the lower or the upper half of
 * the words of a pair, which is the first or the second row. */
static void put_row(const struct ih_surface_scratch *scratch, const uint32_t *row_q20,
                    int32_t root_weight_q15, bool is_second, uint32_t *restrict pair)
{
    const int shift = 20 + ROW_SCALE_BITS;
    const int32_t terms = whole_blocks(scratch->terms);
    const uint32_t root_q15 = (uint32_t)root_weight_q15 << scratch->weight_shift;
    const uint32_t *scale_q17 = scratch->row_scale_q17;
    const uint32_t *taken_q20 = row_q20;
    uint32_t weighted_q20[TERMS_MAX];
    if (root_q15 != 1 << 15) {
        for (int32_t i = 0; i < terms; i++) {
            weighted_q20[i] = (uint32_t)((uint64_t)row_q20[i] * root_q15 >> 15);
        }
        taken_q20 = weighted_q20;
    }
    for (int32_t i = 0; i < terms; i++) {
        const uint64_t entry = (uint64_t)taken_q20[i] * scale_q17[i] + ((uint64_t)1 << (shift - 1));
        pair[i] =
            is_second ? pair[i] | (uint32_t)(entry >> shift) << 16 : (uint32_t)(entry >> shift);
    }
}

/* Fraction bits of residuals: as many as leave the farthest sample from the mean, and four times that, below
 * 2^OFF_BITS. */
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

/* A depth as residuals are: off_fraction bits. */
static int64_t off_of_depth(const struct ih_surface_scratch *scratch, int32_t depth_mm_q8)
{
    return depth_mm_q8 * ((int64_t)1 << (scratch->off_fraction - 8));
}

/* How far a sample at that depth behind the mean is behind the surface, by the sum of its row. */
static int64_t off_of_sum(const struct ih_surface_scratch *scratch, int64_t sum,
                          int32_t depth_mm_q8)
{
    const int up = scratch->off_fraction - 20 - scratch->coefficient_shift;
    return off_of_depth(scratch, depth_mm_q8) - ih_clamp_s64(shift_by(sum, up), OFF_MAX);
}

/* What a row is multiplied by for what it brings to the right side. */
static int32_t push_of(int64_t off, int64_t weight)
{
    return (int32_t)ih_clamp_s64(ih_mul_shift(off, weight, 30), (int64_t)1 << OFF_BITS);
}

/* Add to the right side what one row brings. */
static void add_right(struct ih_surface_scratch *scratch, const uint32_t *row_q20, int64_t off,
                      int64_t weight)
{
    int32_t push[IH_MULTIQUADRIC_ROWS] = {0};
    push[0] = push_of(off, weight);
    ih_multiquadric_add(row_q20, 1, push, scratch->right, scratch->terms);
}

/* The root weight of sample i: of one that is moved it stays as it was. */
static int32_t root_weight_of(const struct ih_samples *samples,
                              const struct ih_surface_params *params, const struct ih_surface *out,
                              int32_t i)
{
    return params->is_moving ? samples->sample[i].root_weight_q15 : out->root_weight_q15[i];
}

/* Pairs from row number `count` on add nothing. */
static void clear_pairs(uint32_t pair[IH_NORMAL_EQUATIONS_PAIRS][TERMS_MAX], int32_t count)
{
    for (int32_t at = (count + 1) / 2; at < IH_NORMAL_EQUATIONS_PAIRS; at++) {
        memset(pair[at], 0, sizeof pair[at]);
    }
}

/* The sums of all samples. */
static void sum_all(const struct ih_samples *samples, const struct ih_surface_params *params,
                    struct ih_surface_scratch *scratch, const struct ih_surface *out)
{
    const int32_t last = samples->sample_count - 1;
    memset(scratch->normal, 0,
           (size_t)IH_NORMAL_EQUATIONS_LINE(scratch->terms) * sizeof *scratch->normal);
    for (int32_t i = 0; i <= last; i++) {
        const int32_t at = i % IH_NORMAL_EQUATIONS_ROWS;
        const uint32_t *row_q20 = new_row(samples, i, scratch);
        put_row(scratch, row_q20, root_weight_of(samples, params, out, i), at % 2 != 0,
                scratch->pair[at / 2]);
        if (at + 1 == IH_NORMAL_EQUATIONS_ROWS || i == last) {
            clear_pairs(scratch->pair, at + 1);
            ih_normal_equations_add(scratch->pair, scratch->terms, scratch->normal_shift,
                                    scratch->normal);
        }
    }
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
                       (ROW_SCALE_BITS + SCALE_SHIFT - UNKNOWN_SCALE_BITS));
    }
}

/* The sums scaled to diagonal 0.99, with ridge, in Q30. */
static void scale_lines(const struct ih_surface_params *params, struct ih_surface_scratch *scratch)
{
    uint32_t scale[TERMS_MAX];
    set_scale(scratch, scale);
    /* |N_ij| <= root_i root_j: below 2^30.6. Of no products' sum, rounding may leave a step below 0. */
    ih_normal_equations_scale(scratch->normal, scratch->terms, scale, SCALE_STEP, scratch->factor);
    for (int32_t i = 0; i < scratch->terms; i++) {
        int32_t *at_q30 = &scratch->factor[ih_normal_equations_line(i) + i];
        *at_q30 += (int32_t)ih_mul_shift(*at_q30, params->ridge_q30, 30);
        IH_IN_RANGE(*at_q30, 0, IH_RANGE_SCALED_Q30);
    }
}

/* With rows from fine_from on that have more bits. Returns whether it is good. The ridge is the least that a pivot's
 * square can be: one that is less has lost it to rounding. */
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

/* With more bits in all rows. Where the sums have no room of their own they are made anew. */
static void factor_fine(const struct ih_samples *samples, const struct ih_surface_params *params,
                        const struct ih_surface *out, struct ih_surface_scratch *scratch)
{
    if (scratch->factor == scratch->normal) {
        sum_all(samples, params, scratch, out);
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

/* Set the right side to the ridge's share, ridge * N_ii * c_i, or take it from what is there. */
static void set_or_take_ridge(const struct ih_surface_params *params, bool is_taken,
                              struct ih_surface_scratch *scratch)
{
    for (int32_t i = 0; i < scratch->terms; i++) {
        /* 2^58 times 2^31.4 over 2^32; in Q8 more than the coefficients */
        const int64_t share = ih_mul_wide_shift(
            (int64_t)scratch->coefficient[i] * params->ridge_q30, scratch->norm_q10[i], 32);
        const int to_right = 20 + scratch->off_fraction - 8 - scratch->coefficient_shift;
        const int64_t shifted = ih_clamp_s64(shift_by(share, to_right), (int64_t)1 << 61);
        scratch->right[i] =
            is_taken ? ih_clamp_s64(scratch->right[i], (int64_t)1 << 61) - shifted : shifted;
    }
}

/* The right side of the scaled system, entries below 2^RIGHT_BITS. Returns its fraction bits; the unit is that
 * of the right side over 2^normal_shift. */
static int scale_right(struct ih_surface_scratch *scratch)
{
    int64_t *right = scratch->right; /* scaled in place: it has served */
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

/* Add the solution, with `fraction` bits, to the coefficients: both in the finer of the two formats that hold
 * them. */
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

/* Solve for a correction of the coefficients from what is left on the right side. squares_log2: of the sum of
 * the unknowns' squares, where the samples' sums are 1, over the square of the samples' number. Returns false, and
 * leaves all as it is, when there is none, or when it is greater than limit_log2, that of the correction before: then they
 * do not come to rest. */
static bool correct(const struct ih_surface_params *params, struct ih_surface_scratch *scratch)
{
    int32_t exponent;
    set_or_take_ridge(params, true, scratch);
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

/* Corrections that grow with the coarse factor begin anew with the fine one, if that has not been tried: few samples'
 * pivots do not tell that it is not good. Returns false when nothing is left to do. */
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

/* The right side that the coefficients leave, which at first are all 0, and which samples are far from the surface. */
static void leave(const struct ih_samples *samples, const struct ih_surface_params *params,
                  const struct ih_surface *out, bool is_first, struct ih_surface_scratch *scratch)
{
    const int64_t far = (int64_t)params->huber_mm * FAR_EIGHTHS << (scratch->off_fraction - 3);
    int32_t count;
    memset(scratch->right, 0, sizeof scratch->right);
    for (int32_t first = 0; first < samples->sample_count; first += count) {
        count = rows_together(samples, scratch, first);
        const uint32_t *row_q20 = row_of(samples, first, scratch);
        int64_t sum[IH_MULTIQUADRIC_ROWS] = {0};
        int32_t push[IH_MULTIQUADRIC_ROWS];
        if (!is_first) {
            ih_multiquadric_sum(row_q20, count, scratch->coefficient, scratch->terms, sum);
        }
        for (int32_t k = 0; k < count; k++) {
            const int32_t i = first + k;
            const int64_t off = off_of_sum(scratch, sum[k],
                                           samples->sample[i].depth_mm_q8 - out->mean_mm_q8 -
                                               scratch->moved_mm_q8[i]);
            scratch->is_far[i] = ih_abs_s64(off) >= far;
            push[k] = push_of(off, weight_q30(scratch, root_weight_of(samples, params, out, i)));
        }
        ih_multiquadric_add(row_q20, count, push, scratch->right, scratch->terms);
    }
}

/* Work out all rows again, and correct the coefficients by what they leave, until that is enough. */
static void refine(const struct ih_samples *samples, const struct ih_surface_params *params,
                   const struct ih_surface *out, int32_t enough_log2,
                   struct ih_surface_scratch *scratch)
{
    /* What fewer samples than unknowns do not see is found slowly. */
    const int32_t min = samples->sample_count < scratch->terms ? CORRECTIONS_FEW : 1;
    int32_t before;
    int32_t count = 0;
    do {
        before = scratch->squares_log2;
        leave(samples, params, out, false, scratch);
        count++;
    } while (correct_or_refactor(samples, params, out, scratch) &&
             (count < min ||
              (2 * scratch->squares_log2 - before > enough_log2 && count < CORRECTIONS_MAX)));
}

/* Huber step: a sample that is too far from the surface gets less weight. Returns its weight's root. */
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

/* Exchange rows: those that stand in the first pairs for those in the pairs behind them, each of them as it was and is
 * rounded. */
static void exchange_pairs(struct ih_surface_scratch *scratch)
{
    ih_normal_equations_subtract(scratch->pair, scratch->terms, scratch->normal_shift,
                                 scratch->normal);
    ih_normal_equations_add(scratch->pair + IH_NORMAL_EQUATIONS_PAIRS, scratch->terms,
                            scratch->normal_shift, scratch->normal);
}

/* Exchange what sample number `at` of those whose weight changed had brought to the sums. */
static void exchange_sample(struct ih_surface_scratch *scratch, const uint32_t *row_q20, int32_t at,
                            int32_t before_q15, int32_t root_weight_q15)
{
    put_row(scratch, row_q20, before_q15, at % 2 != 0, scratch->pair[at / 2]);
    put_row(scratch, row_q20, root_weight_q15, at % 2 != 0,
            scratch->pair[IH_NORMAL_EQUATIONS_PAIRS + at / 2]);
    if (at + 1 == IH_NORMAL_EQUATIONS_ROWS) {
        exchange_pairs(scratch);
    }
}

/* Move sample i, which is too far off, to where it is off by huber_mm. */
static void move_sample(const struct ih_sample *sample, const struct ih_surface_params *params,
                        struct ih_surface_scratch *scratch, int32_t i, const uint32_t *row_q20,
                        int64_t off)
{
    const int64_t limit = (int64_t)params->huber_mm << scratch->off_fraction;
    const int64_t beyond = off - ih_clamp_s64(off, limit);
    scratch->moved_mm_q8[i] = (int32_t)ih_shift_round(beyond, scratch->off_fraction - 8);
    add_right(scratch, row_q20, -off_of_depth(scratch, scratch->moved_mm_q8[i]),
              weight_q30(scratch, sample->root_weight_q15));
}

/* Weights by the distance from the surface, of those samples that were far from it before the last correction.
 * Those whose weight changed are moved, or what they had brought to the sums is exchanged. The right side is that of
 * the system that is solved, which leaves no more than the ridge's share, and what is changed. Returns of how many
 * samples. */
static int32_t change_far(const struct ih_samples *samples, const struct ih_surface_params *params,
                          struct ih_surface_scratch *scratch, struct ih_surface *out)
{
    int32_t lighter = 0;
    set_or_take_ridge(params, false, scratch);
    for (int32_t i = 0; i < samples->sample_count; i++) {
        const struct ih_sample *sample = &samples->sample[i];
        if (!scratch->is_far[i]) {
            continue;
        }
        const uint32_t *row_q20 = row_of(samples, i, scratch);
        int64_t sum[IH_MULTIQUADRIC_ROWS];
        ih_multiquadric_sum(row_q20, 1, scratch->coefficient, scratch->terms, sum);
        const int64_t off = off_of_sum(scratch, sum[0], sample->depth_mm_q8 - out->mean_mm_q8);
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
                      weight_q30(scratch, root_q15) - weight_q30(scratch, sample->root_weight_q15));
            exchange_sample(scratch, row_q20, lighter % IH_NORMAL_EQUATIONS_ROWS,
                            sample->root_weight_q15, root_q15);
        }
        lighter++;
    }
    if (!params->is_moving && lighter % IH_NORMAL_EQUATIONS_ROWS != 0) {
        clear_pairs(scratch->pair, lighter % IH_NORMAL_EQUATIONS_ROWS);
        clear_pairs(scratch->pair + IH_NORMAL_EQUATIONS_PAIRS, lighter % IH_NORMAL_EQUATIONS_ROWS);
        exchange_pairs(scratch);
    }
    return lighter;
}

/* Solve for the surface. */
static bool fit_first(const struct ih_samples *samples, const struct ih_surface_params *params,
                      struct ih_surface_scratch *scratch, struct ih_surface *out)
{
    if (!set_weight_shift(scratch, out->root_weight_q15, samples->sample_count)) {
        return false;
    }
    memset(scratch->moved_mm_q8, 0, sizeof scratch->moved_mm_q8);
    memset(scratch->coefficient, 0, sizeof scratch->coefficient);
    scratch->coefficient_shift = 0;
    memset(scratch->norm_q10, 0, sizeof scratch->norm_q10);
    (void)set_norms(scratch, samples, out->root_weight_q15);
    set_row_scale(scratch, samples);
    set_off_fraction(scratch, samples, out->mean_mm_q8);
    scratch->samples_log2 = ih_bits_u64((uint64_t)(samples->sample_count + 7) / 8);
    sum_all(samples, params, scratch, out);
    leave(samples, params, out, true, scratch);
    factor(samples, params, out, scratch);
    (void)correct(params, scratch);
    refine(samples, params, out, SQUARES_LOG2_FOR_WEIGHTS, scratch);
    return true;
}

/* Sum all rows again, and scale the right side to the weights as they are enlarged now. */
static bool sum_again(const struct ih_samples *samples, const struct ih_surface_params *params,
                      struct ih_surface_scratch *scratch, const struct ih_surface *out)
{
    const int32_t before = scratch->weight_shift;
    if (!set_weight_shift(scratch, out->root_weight_q15, samples->sample_count)) {
        return false;
    }
    for (int32_t i = 0; i < scratch->terms; i++) {
        scratch->right[i] = shift_by(scratch->right[i], 2 * (scratch->weight_shift - before));
    }
    (void)set_norms(scratch, samples, out->root_weight_q15);
    set_row_scale(scratch, samples);
    sum_all(samples, params, scratch, out);
    return true;
}

/* The system of the weights as they are now, and its factor. */
static bool factor_again(const struct ih_samples *samples, const struct ih_surface_params *params,
                         struct ih_surface_scratch *scratch, const struct ih_surface *out)
{
    const bool is_light = set_norms(scratch, samples, out->root_weight_q15);
    if (is_light && !sum_again(samples, params, scratch, out)) {
        return false;
    }
    factor(samples, params, out, scratch);
    return true;
}

/* Again, with less weight for the samples that are far from it, or with those moved, if any. */
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
        /* What the first system still left is not on the right side: the next correction may be as great as its last. */
        scratch->limit_log2 = ih_max_s32(scratch->limit_log2, left_log2);
    }
    refine(samples, params, out, SQUARES_LOG2_ENOUGH, scratch);
    return true;
}

/* B for whole grid steps: sqrt((a^2 + b^2) 100 / 121 + 1) in Q20, b down and a to both sides, so that
 * what a centre adds to a row of nodes stands in a row. */
static void fill_table(struct ih_surface_scratch *scratch)
{
    const int64_t numerator2 = IH_SURFACE_STEP_NUMERATOR * IH_SURFACE_STEP_NUMERATOR;
    const int64_t denominator2 = IH_SURFACE_STEP_DENOMINATOR * IH_SURFACE_STEP_DENOMINATOR;
    uint32_t square_q18[TABLE_WIDTH], one_more_q18[TABLE_WIDTH];
    for (int64_t a = 0; a < TABLE_WIDTH; a++) {
        square_q18[a] = (uint32_t)ih_div_round(a * a * numerator2 * (1 << 18), denominator2);
        one_more_q18[a] = square_q18[a] + (1 << 18);
    }
    for (int32_t b = 0; b < IH_SURFACE_STEPS; b += 2) {
        for (int32_t first = 0; first < TABLE_WIDTH; first += TABLE_LINE) {
            const int32_t count = ih_min_s32(TABLE_LINE, IH_SURFACE_STEPS - first);
            uint32_t root_q20[2][TABLE_LINE];
            ih_multiquadric_roots(&square_q18[first], TABLE_LINE, &one_more_q18[b], 2, root_q20[0]);
            for (int32_t k = 0; k < 2; k++) {
                int32_t *middle = &scratch->of.grid.table_q20[b + k][IH_SURFACE_STEPS - 1];
                for (int32_t a = 0; a < count; a++) {
                    middle[first + a] = (int32_t)root_q20[k][a];
                    middle[-first - a] = (int32_t)root_q20[k][a];
                }
            }
        }
    }
}

/* Nearer than this no node can be: see IH_SURFACE_OVERSHOOT_MM. */
static int32_t min_depth_mm_q8(const struct ih_samples *samples)
{
    int32_t nearest_q8 = INT32_MAX;
    for (int32_t i = 0; i < samples->sample_count; i++) {
        nearest_q8 = ih_min_s32(nearest_q8, samples->sample[i].depth_mm_q8);
    }
    return ih_max_s32(nearest_q8 - (IH_SURFACE_OVERSHOOT_MM << 8), 1 << 8);
}

/* Centre k is at so many grid steps from the grid's first node. */
static int32_t centre_node(const struct ih_surface_scratch *scratch, int32_t centre)
{
    const int32_t steps = steps_of(scratch);
    return (IH_SURFACE_GRID - 1) / 2 - steps * (scratch->centres - 1) / 2 + steps * centre;
}

/* Centres k and centres - 1 - k of a row stand alike on both sides of the middle, and so do nodes x and
 * GRID - 1 - x: with p and q what a centre's basis is at both nodes, c and d the coefficients of both
 * centres, c p + d q at the one and c q + d p at the other are half of (c + d) (p + q) plus and less
 * (c - d) (p - q). */
static void fold_table(struct ih_surface_scratch *scratch)
{
    for (int32_t b = 0; b < IH_SURFACE_STEPS; b++) {
        const int32_t *middle = &scratch->of.grid.table_q20[b][IH_SURFACE_STEPS - 1];
        for (int32_t k = 0; k < scratch->centres / 2; k++) {
            const int32_t *here = &middle[-centre_node(scratch, k)];
            const int32_t *there = &middle[-centre_node(scratch, scratch->centres - 1 - k)];
            for (int32_t x = 0; x < IH_SURFACE_HALF; x++) {
                scratch->of.grid.sum_q20[b][k][x] = (uint32_t)(here[x] + there[x]);
                scratch->of.grid.difference_q20[b][k][x] =
                    (uint32_t)(here[x] - there[x] + DIFFERENCE_BIAS_Q20);
            }
        }
    }
}

/* Sums and differences of the coefficients of both centres of a pair, where the solution was: it has served. */
static void fold_coefficients(struct ih_surface_scratch *scratch, int32_t **between)
{
    const int32_t centres = scratch->centres, half = centres / 2;
    int32_t *both = scratch->solution;
    *between = &both[centres * half];
    for (int32_t row = 0; row < centres; row++) {
        const int32_t *coefficient = &scratch->coefficient[row * centres];
        for (int32_t k = 0; k < half; k++) {
            const int32_t other = coefficient[centres - 1 - k];
            both[row * half + k] = coefficient[k] + other;
            (*between)[row * half + k] = coefficient[k] - other;
        }
    }
}

/* Twice sum_n c_n B_n along half a row of nodes, but for what changes its sign in the other half, and that. */
static void sum_row(const struct ih_surface_scratch *scratch, const int32_t *between,
                    int64_t odd_begin, int32_t y, int64_t even[IH_SURFACE_HALF],
                    int64_t odd[IH_SURFACE_HALF])
{
    const int32_t centres = scratch->centres;
    const uint32_t *sum_q20[CENTRES_MAX], *difference_q20[CENTRES_MAX];
    for (int32_t row = 0; row < centres; row++) {
        const int32_t b = ih_abs_s32(y - centre_node(scratch, row));
        sum_q20[row] = scratch->of.grid.sum_q20[b][0];
        difference_q20[row] = scratch->of.grid.difference_q20[b][0];
    }
    ih_multiquadric_lines(scratch->solution, sum_q20, centres, centres / 2, IH_SURFACE_HALF, 0,
                          even);
    ih_multiquadric_lines(between, difference_q20, centres, centres / 2, IH_SURFACE_HALF, odd_begin,
                          odd);
}

/* How sums become depths: sum_n c_n B_n in Q8 is 2^-shift of one. */
struct depth_way {
    int shift;
    int32_t mean_mm_q8, min_mm_q8, max_mm_q8;
};

static inline int32_t depth_of_sum(const struct depth_way *way, int64_t sum)
{
    const int64_t depth_q8 = way->shift > 0 ? ih_shift_round(sum, way->shift) : INT32_MAX;
    return ih_clamp_s32(ih_saturate_s32(way->mean_mm_q8 + depth_q8), way->min_mm_q8,
                        way->max_mm_q8);
}

#if defined __x86_64__ && defined __AVX2__
/* With a greater shift 64 bits might not hold the limits beside the sums: below 2^60 they are, those below 2^62.7. */
#define SHIFT_MAX 36
_Static_assert(IH_SURFACE_HALF % 8 == 0, "vectors of eight nodes");

/* Four sums, so much behind the least depth that they are never negative: Q8, limited. */
static inline __m256i limited(const struct depth_way *way, __m256i sum)
{
    const int64_t half = (int64_t)1 << (way->shift - 1);
    const int64_t unit = (int64_t)1 << way->shift;
    const __m256i more =
        _mm256_set1_epi64x(half + ((int64_t)way->mean_mm_q8 - way->min_mm_q8) * unit);
    const __m256i max = _mm256_set1_epi64x(((int64_t)way->max_mm_q8 - way->min_mm_q8) * unit);
    const __m256i behind = _mm256_add_epi64(sum, more);
    const __m256i min =
        _mm256_andnot_si256(_mm256_cmpgt_epi64(_mm256_setzero_si256(), behind), behind);
    const __m256i value = _mm256_blendv_epi8(min, max, _mm256_cmpgt_epi64(min, max));
    return _mm256_srl_epi64(value, _mm_cvtsi32_si128(way->shift));
}

/* Eight nodes, in an order. */
static inline __m256i depths_of(const struct depth_way *way, __m256i first, __m256i last,
                                __m256i order)
{
    const __m256i both =
        _mm256_or_si256(limited(way, first), _mm256_slli_epi64(limited(way, last), 32));
    return _mm256_add_epi32(_mm256_permutevar8x32_epi32(both, order),
                            _mm256_set1_epi32(way->min_mm_q8));
}

/* The same as below. */
static int32_t set_depths_of_vectors(const struct depth_way *way,
                                     const int64_t even[IH_SURFACE_HALF],
                                     const int64_t odd[IH_SURFACE_HALF], int32_t *depth_mm_q8)
{
    const __m256i forward = _mm256_setr_epi32(0, 2, 4, 6, 1, 3, 5, 7);
    const __m256i back = _mm256_setr_epi32(7, 5, 3, 1, 6, 4, 2, 0);
    __m256i nearest = _mm256_set1_epi32(INT32_MAX);
    for (int32_t x = 0; x < IH_SURFACE_HALF; x += 8) {
        const __m256i even_0 = _mm256_loadu_si256((const __m256i *)&even[x]);
        const __m256i even_4 = _mm256_loadu_si256((const __m256i *)&even[x + 4]);
        const __m256i odd_0 = _mm256_loadu_si256((const __m256i *)&odd[x]);
        const __m256i odd_4 = _mm256_loadu_si256((const __m256i *)&odd[x + 4]);
        const __m256i left = depths_of(way, _mm256_add_epi64(even_0, odd_0),
                                       _mm256_add_epi64(even_4, odd_4), forward);
        const __m256i right =
            depths_of(way, _mm256_sub_epi64(even_0, odd_0), _mm256_sub_epi64(even_4, odd_4), back);
        _mm256_storeu_si256((__m256i *)&depth_mm_q8[x], left);
        _mm256_storeu_si256((__m256i *)&depth_mm_q8[IH_SURFACE_GRID - 8 - x], right);
        nearest = _mm256_min_epi32(nearest, _mm256_min_epi32(left, right));
    }
    int32_t lane[8];
    _mm256_storeu_si256((__m256i *)lane, nearest);
    for (int32_t k = 1; k < 8; k++) {
        lane[0] = ih_min_s32(lane[0], lane[k]);
    }
    return lane[0];
}
#endif

/* A row of nodes from both halves' sums. Returns the nearest one. */
static int32_t set_depths(const struct depth_way *way, const int64_t even[IH_SURFACE_HALF],
                          const int64_t odd[IH_SURFACE_HALF], int32_t *depth_mm_q8)
{
#ifdef SHIFT_MAX
    if (way->shift >= 1 && way->shift <= SHIFT_MAX) {
        return set_depths_of_vectors(way, even, odd, depth_mm_q8);
    }
#endif
    int32_t nearest_q8 = INT32_MAX;
    for (int32_t x = 0; x < IH_SURFACE_HALF; x++) {
        const int32_t mirrored = IH_SURFACE_GRID - 1 - x;
        depth_mm_q8[x] = depth_of_sum(way, even[x] + odd[x]);
        depth_mm_q8[mirrored] = depth_of_sum(way, even[x] - odd[x]);
        nearest_q8 = ih_min_s32(nearest_q8, ih_min_s32(depth_mm_q8[x], depth_mm_q8[mirrored]));
    }
    return nearest_q8;
}

static int64_t sum_of(const int32_t *number, int32_t count)
{
    int64_t sum = 0;
    for (int32_t i = 0; i < count; i++) {
        sum += number[i];
    }
    return sum;
}

static void evaluate(const struct ih_samples *samples, struct ih_surface_scratch *scratch,
                     struct ih_surface *out)
{
    const struct depth_way way = {
        .shift = ih_min_s32(20 + scratch->coefficient_shift - 7, 62), /* sums are twice as great */
        .mean_mm_q8 = out->mean_mm_q8,
        .min_mm_q8 = min_depth_mm_q8(samples),
        .max_mm_q8 = IH_SURFACE_DEPTH_MAX_MM << 8,
    };
    int32_t *between;
    int32_t nearest_q8 = INT32_MAX;
    fold_coefficients(scratch, &between);
    const int64_t odd_begin = -DIFFERENCE_BIAS_Q20 * sum_of(between, scratch->terms / 2);
    for (int32_t y = 0; y < IH_SURFACE_GRID; y++) {
        int64_t even[IH_SURFACE_HALF], odd[IH_SURFACE_HALF];
        sum_row(scratch, between, odd_begin, y, even, odd);
        nearest_q8 = ih_min_s32(nearest_q8, set_depths(&way, even, odd, out->depth_mm_q8[y]));
    }
    out->nearest_mm_q8 = nearest_q8;
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
    set_centres(params, scratch);
    out->centres = params->centres;
    out->mean_mm_q8 = mean_depth_mm_q8(samples);
    for (int32_t i = 0; i < samples->sample_count; i++) {
        out->root_weight_q15[i] = samples->sample[i].root_weight_q15;
    }
    if (!fit_first(samples, params, scratch, out) || !fit_again(samples, params, scratch, out)) {
        return;
    }
    fill_table(scratch);
    fold_table(scratch);
    evaluate(samples, scratch, out);
    out->valid = true;
}
