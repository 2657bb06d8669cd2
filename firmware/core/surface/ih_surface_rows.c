#include "surface/ih_surface_rows.h"

#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "surface/ih_multiquadric.h"
#include "surface/ih_normal_equations.h"

#define TERMS_MAX IH_SURFACE_TERMS_MAX
#define CENTRES_MAX IH_SURFACE_CENTRES_MAX

/* Short rows: the basis scaled column by column to IH_NORMAL_EQUATIONS_MAX, minus one step that rounding and the roots'
 * errors may add. The scale in Q17 is below 2^31, as no bound is below 1. */
#define ROW_MAX (IH_NORMAL_EQUATIONS_MAX - 1)
#define ROW_SCALE_BITS IH_SURFACE_ROW_SCALE_BITS

_Static_assert(CENTRES_MAX == IH_MULTIQUADRIC_ACROSS_MAX &&
                   TERMS_MAX == IH_NORMAL_EQUATIONS_TERMS_MAX,
               "one system");

void ih_surface_rows_set_centres(const struct ih_surface_params *params,
                                 struct ih_surface_scratch *scratch)
{
    const int32_t centres = params->centres;
    const bool is_few = centres == IH_SURFACE_CENTRES_FEW && params->is_moving;
    scratch->centres = centres;
    scratch->terms = centres * centres;
    scratch->normal = is_few ? scratch->of.few.normal : scratch->of.many.normal;
    scratch->factor = is_few ? scratch->of.few.normal : scratch->of.many.factor;
    scratch->kept_count = is_few ? IH_SURFACE_ROWS_KEPT : 0;
    for (int32_t k = 0; k < centres; k++) {
        const int32_t half_steps = (2 * k - (centres - 1)) * ih_surface_centre_steps(scratch);
        scratch->centre_q16[k] =
            (int32_t)ih_div_round((int64_t)half_steps * IH_SURFACE_STEP_NUMERATOR * 65536,
                                  2 * IH_SURFACE_STEP_DENOMINATOR);
    }
}

/* Terms are a multiple of 16, centres one of 4: compilers that know this make whole vectors only. */
static inline int32_t whole_blocks(int32_t terms)
{
    return terms & ~15;
}

/* Squares of a position's distances from the centres of a row, Q18, each with more_q18 added: below 60^2. */
static void square_distances(const struct ih_surface_scratch *scratch, int32_t position_q16,
                             uint32_t more_q18, uint32_t *restrict square_q18)
{
    const int32_t centres = scratch->centres & ~3;
    for (int32_t k = 0; k < centres; k++) {
        const int32_t d_q16 = position_q16 - scratch->centre_q16[k];
        square_q18[k] = (uint32_t)((uint64_t)((int64_t)d_q16 * d_q16) >> 14) + more_q18;
    }
}

/* Fill a sample's row of the basis: sqrt(dx^2 + dy^2 + 1), Q20. */
void ih_surface_rows_fill(struct ih_surface_scratch *scratch, const struct ih_sample *sample,
                          uint32_t *row_q20)
{
    uint32_t dx2_q18[CENTRES_MAX];
    uint32_t dy2_q18[CENTRES_MAX];
    square_distances(scratch, sample->x_q16, 1 << 18, dx2_q18);
    square_distances(scratch, sample->y_q16, 0, dy2_q18);
    ih_multiquadric_roots(dx2_q18, scratch->centres, dy2_q18, scratch->centres, row_q20);
    IH_IN_RANGE(row_q20[0], (1 << 20) - 1, IH_RANGE_BASIS_Q20);
}

int32_t ih_surface_rows_together(const struct ih_samples *samples,
                                 const struct ih_surface_scratch *scratch, int32_t i)
{
    const int32_t end = ih_min_s32(samples->sample_count, scratch->kept_count);
    return i + IH_MULTIQUADRIC_ROWS <= end ? IH_MULTIQUADRIC_ROWS : 1;
}

/* Work out the row of sample i, where it is kept if there is room for it. */
static const uint32_t *new_row(const struct ih_samples *samples, int32_t i,
                               struct ih_surface_scratch *scratch)
{
    uint32_t *row_q20 = i < scratch->kept_count ? scratch->of.few.row_q20[i] : scratch->basis_q20;
    ih_surface_rows_fill(scratch, &samples->sample[i], row_q20);
    return row_q20;
}

const uint32_t *ih_surface_rows_of(const struct ih_samples *samples, int32_t i,
                                   struct ih_surface_scratch *scratch)
{
    return i < scratch->kept_count ? scratch->of.few.row_q20[i] : new_row(samples, i, scratch);
}

bool ih_surface_rows_set_weight_shift(struct ih_surface_scratch *scratch,
                                      const int32_t *root_weight_q15, int32_t count)
{
    int32_t max_q15 = 0;
    for (int32_t i = 0; i < count; i++) {
        max_q15 = ih_max_s32(max_q15, root_weight_q15[i]);
    }
    scratch->weight_shift = ih_max_s32(0, 15 - ih_bits_u64((uint64_t)max_q15));
    return max_q15 > 0;
}

bool ih_surface_rows_set_norms(struct ih_surface_scratch *scratch, const struct ih_samples *samples,
                               const int32_t *root_weight_q15)
{
    int64_t sum_q30 = 0, x_q46 = 0, y_q46 = 0, square_q42 = 0;
    for (int32_t i = 0; i < samples->sample_count; i++) {
        const int64_t x_q16 = samples->sample[i].x_q16, y_q16 = samples->sample[i].y_q16;
        const int64_t weight = ih_surface_weight_q30(scratch, root_weight_q15[i]);
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

/* The samples' extremes along x and y. */
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

void ih_surface_rows_set_scale(struct ih_surface_scratch *scratch, const struct ih_samples *samples)
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
        /* Two steps more than rounding down cost. */
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

/* Put a sample's weighted row, rounded to a short one, into the lower or the upper half of a pair's words: the first
 * or the second row of the pair. */
static void put_row(const struct ih_surface_scratch *scratch, const uint32_t *row_q20,
                    int32_t root_weight_q15, bool is_second, uint32_t *restrict pair)
{
    const int shift = 20 + ROW_SCALE_BITS;
    const int32_t terms = whole_blocks(scratch->terms);
    const uint32_t root_q15 = (uint32_t)root_weight_q15 << scratch->weight_shift;
    const uint32_t *scale_q17 = scratch->row_scale_q17;
    const uint32_t *chosen_q20 = row_q20;
    uint32_t weighted_q20[TERMS_MAX];
    if (root_q15 != 1 << 15) {
        for (int32_t i = 0; i < terms; i++) {
            weighted_q20[i] = (uint32_t)((uint64_t)row_q20[i] * root_q15 >> 15);
        }
        chosen_q20 = weighted_q20;
    }
    for (int32_t i = 0; i < terms; i++) {
        const uint64_t entry =
            (uint64_t)chosen_q20[i] * scale_q17[i] + ((uint64_t)1 << (shift - 1));
        pair[i] =
            is_second ? pair[i] | (uint32_t)(entry >> shift) << 16 : (uint32_t)(entry >> shift);
    }
}

/* Clear the pairs from row number `count` on: they add nothing. */
static void clear_pairs(uint32_t pair[IH_NORMAL_EQUATIONS_PAIRS][TERMS_MAX], int32_t count)
{
    for (int32_t at = (count + 1) / 2; at < IH_NORMAL_EQUATIONS_PAIRS; at++) {
        memset(pair[at], 0, sizeof pair[at]);
    }
}

void ih_surface_rows_sum(const struct ih_samples *samples, const struct ih_surface_params *params,
                         struct ih_surface_scratch *scratch, const struct ih_surface *out)
{
    const int32_t last = samples->sample_count - 1;
    memset(scratch->normal, 0,
           (size_t)IH_NORMAL_EQUATIONS_LINE(scratch->terms) * sizeof *scratch->normal);
    for (int32_t i = 0; i <= last; i++) {
        const int32_t at = i % IH_NORMAL_EQUATIONS_ROWS;
        const uint32_t *row_q20 = new_row(samples, i, scratch);
        put_row(scratch, row_q20, ih_surface_root_weight_q15(samples, params, out, i), at % 2 != 0,
                scratch->pair[at / 2]);
        if (at + 1 == IH_NORMAL_EQUATIONS_ROWS || i == last) {
            clear_pairs(scratch->pair, at + 1);
            ih_normal_equations_add(scratch->pair, scratch->terms, scratch->normal_shift,
                                    scratch->normal);
        }
    }
}

/* Exchange the rows of the first pairs for those of the pairs behind them. Each is rounded as before. */
static void exchange_pairs(struct ih_surface_scratch *scratch)
{
    ih_normal_equations_subtract(scratch->pair, scratch->terms, scratch->normal_shift,
                                 scratch->normal);
    ih_normal_equations_add(scratch->pair + IH_NORMAL_EQUATIONS_PAIRS, scratch->terms,
                            scratch->normal_shift, scratch->normal);
}

void ih_surface_rows_exchange(struct ih_surface_scratch *scratch, const uint32_t *row_q20,
                              int32_t number, int32_t before_q15, int32_t after_q15)
{
    const int32_t at = number % IH_NORMAL_EQUATIONS_ROWS;
    put_row(scratch, row_q20, before_q15, at % 2 != 0, scratch->pair[at / 2]);
    put_row(scratch, row_q20, after_q15, at % 2 != 0,
            scratch->pair[IH_NORMAL_EQUATIONS_PAIRS + at / 2]);
    if (at + 1 == IH_NORMAL_EQUATIONS_ROWS) {
        exchange_pairs(scratch);
    }
}

void ih_surface_rows_finish_exchange(struct ih_surface_scratch *scratch, int32_t count)
{
    const int32_t at = count % IH_NORMAL_EQUATIONS_ROWS;
    if (at != 0) {
        clear_pairs(scratch->pair, at);
        clear_pairs(scratch->pair + IH_NORMAL_EQUATIONS_PAIRS, at);
        exchange_pairs(scratch);
    }
}
