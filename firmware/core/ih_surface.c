#include "ih_surface.h"

#include <string.h>

#include "ih_fix.h"

#define TERMS IH_SURFACE_TERMS
#define KEPT IH_SURFACE_KEPT
#define HALF_CENTRES IH_SURFACE_HALF_CENTRES
/* Scale factors are 0.995 * 2^SCALE_SHIFT / sqrt(N_ii): with N_ii of 2^40 (a single sample, weight
 * 1, B = 1) to 2^61.5 they lie between 2^20 and 2^31. */
#define SCALE_SHIFT 51
#define SCALE_NUMERATOR ((((int64_t)1 << SCALE_SHIFT) / 1000) * 995)
#define SCALE_MAX 0x7fffffff
/* The right side keeps its norm below this, so that the forward solve stays within int32. */
#define RIGHT_BITS 30
/* Coefficients below 2^28, basis below 2^26.5, 144 terms: sums below 2^61.7, twice that where they are
 * folded. */
#define SOLUTION_BITS 28

void ih_surface_params_default(struct ih_surface_params *params)
{
    *params = (struct ih_surface_params){
        .ridge_q30 = 10737, /* 1e-5 */
        .huber_mm = 60,
    };
}

/* Places of a row or column of centres: (2 k - 11) * 20 / 11 field units. */
static void place_centres(struct ih_surface_scratch *scratch)
{
    for (int32_t k = 0; k < IH_SURFACE_CENTRES; k++) {
        int64_t place_q16 = (int64_t)(2 * k - (IH_SURFACE_CENTRES - 1)) * 20 * 65536;
        scratch->centre_q16[k] = (int32_t)ih_div_round(place_q16, IH_SURFACE_CENTRES - 1);
    }
}

/* The sample's row of the basis: sqrt(dx^2 + dy^2 + 1), Q20, rounded. dx, dy < 60 in Q16: the radicand in
 * Q32 is below 2^45. */
static void fill_row(struct ih_surface_scratch *scratch, const struct ih_sample *sample,
                     uint32_t row_q20[TERMS])
{
    uint64_t dx2_q32[IH_SURFACE_CENTRES];
    for (int32_t k = 0; k < IH_SURFACE_CENTRES; k++) {
        int64_t dx = (int64_t)sample->x_q16 - scratch->centre_q16[k];
        dx2_q32[k] = (uint64_t)(dx * dx) + ((uint64_t)1 << 32);
    }
    for (int32_t k = 0; k < IH_SURFACE_CENTRES; k++) {
        int64_t dy = (int64_t)sample->y_q16 - scratch->centre_q16[k];
        uint64_t dy2_q32 = (uint64_t)(dy * dy);
        for (int32_t column = 0; column < IH_SURFACE_CENTRES; column++) {
            scratch->square_q32[k * IH_SURFACE_CENTRES + column] = dx2_q32[column] + dy2_q32;
        }
    }
    ih_basis_roots(scratch->square_q32, TERMS, row_q20);
    IH_IN_RANGE(row_q20[0], 1 << 20, IH_RANGE_BASIS_Q20);
}

/* Weigh the sample's row, which stands in basis_q20, and put it among the rows to be summed, at number
 * `at`. */
static void weigh_row(struct ih_surface_scratch *scratch, int32_t root_weight_q15, int32_t at)
{
    uint32_t *basis_q20 = scratch->basis_q20;
    bool is_one = root_weight_q15 == 1 << 15; /* as nearly all are: nothing to round */
    for (int32_t i = 0; !is_one && i < TERMS; i++) {
        basis_q20[i] = (uint32_t)ih_mul_shift(basis_q20[i], root_weight_q15, 15);
    }
    for (int32_t i = 0; i < TERMS; i++) {
        scratch->row_q20[at][i] = basis_q20[i];
    }
}

/* Rows from `count` on add nothing. */
static void clear_rows(struct ih_surface_scratch *scratch, int32_t count)
{
    for (int32_t at = count; at < IH_NORMAL_ROWS; at++) {
        memset(scratch->row_q20[at], 0, sizeof scratch->row_q20[at]);
    }
}

/* What the weighted row in basis_q20 brings to the right side. */
static void add_right(struct ih_surface_scratch *scratch, const struct ih_sample *sample,
                      int32_t mean_mm_q8, int32_t root_weight_q15)
{
    const int32_t off_mm_q8 =
        (int32_t)ih_mul_shift((int64_t)sample->depth_mm_q8 - mean_mm_q8, root_weight_q15, 15);
    for (int32_t i = 0; i < TERMS; i++) {
        scratch->right_q28[i] += (int64_t)(int32_t)scratch->basis_q20[i] * off_mm_q8;
    }
}

_Static_assert(TERMS == IH_NORMAL_TERMS && KEPT % IH_NORMAL_GROUP == 0, "lines of ih_normal");
/* The last line is the nearest to where its scaled one begins. */
_Static_assert(2 * (IH_NORMAL_LINE(TERMS) - TERMS - IH_NORMAL_LINE(KEPT)) <=
                   IH_CHOLESKY_PACKED(TERMS - 1),
               "a line that is scaled must not be in the way of one that is not yet");

static int32_t mean_depth_mm_q8(const struct ih_samples *samples)
{
    int64_t sum = 0;
    for (int32_t i = 0; i < samples->sample_count; i++) {
        sum += samples->sample[i].depth_mm_q8;
    }
    return (int32_t)ih_div_round(sum, samples->sample_count);
}

static const uint64_t *line_of(const struct ih_surface_scratch *scratch, int32_t i)
{
    const int32_t at = ih_normal_line(i);
    return i < KEPT ? &scratch->kept.q40[at] : &scratch->of.others_q40[at - IH_NORMAL_LINE(KEPT)];
}

/* Scale factors from N's diagonal. */
static void set_scale(struct ih_surface_scratch *scratch)
{
    for (int32_t i = 0; i < TERMS; i++) {
        const int64_t diagonal = (int64_t)line_of(scratch, i)[i];
        IH_IN_RANGE(diagonal, 0, IH_RANGE_NORMAL_Q40);
        int64_t root = (int64_t)ih_isqrt_u64((uint64_t)diagonal) + 1; /* it stays < 1 */
        int64_t scale = SCALE_NUMERATOR / root;
        scratch->scale[i] = (uint32_t)(scale < SCALE_MAX ? scale : SCALE_MAX);
    }
}

/* N scaled to diagonal 0.99, with ridge, in Q30, in the place of the lines of N that are not kept: from
 * the last one on, so that none is written over that is still to be read. They are copied because the
 * same bytes change type. */
static void scale_lines(const struct ih_surface_params *params, struct ih_surface_scratch *scratch)
{
    int32_t scaled[TERMS];
    set_scale(scratch);
    for (int32_t i = TERMS - 1; i >= 0; i--) {
        const uint64_t *line = line_of(scratch, i);
        for (int32_t j = 0; j <= i; j++) {
            /* |N_ij| <= root_i root_j: after the first step below 2^47 */
            int64_t half = ih_mul_wide_shift((int64_t)line[j], scratch->scale[i], 36);
            scaled[j] = ih_saturate_s32(
                ih_mul_wide_shift(half, scratch->scale[j], 2 * SCALE_SHIFT - 36 - 30));
        }
        scaled[i] += (int32_t)ih_mul_shift(scaled[i], params->ridge_q30, 30);
        IH_IN_RANGE(scaled[i], 0, IH_RANGE_SCALED_Q30);
        memcpy(&scratch->of.factor_q30[IH_CHOLESKY_PACKED(i)], scaled,
               (size_t)(i + 1) * sizeof scaled[0]);
    }
}

/* The right side in int32: fraction bits as many as its norm, sqrt(sum of z^2) at the most, allows.
 * Returns them. */
static int scale_right(const struct ih_samples *samples, int32_t mean_mm_q8,
                       struct ih_surface_scratch *scratch)
{
    uint64_t norm2_q16 = 1;
    for (int32_t i = 0; i < samples->sample_count; i++) {
        int64_t depth_q8 = (int64_t)samples->sample[i].depth_mm_q8 - mean_mm_q8;
        norm2_q16 += (uint64_t)(depth_q8 * depth_q8);
    }
    int bits = ih_bits_u64(ih_isqrt_u64(norm2_q16)); /* of the norm in Q8 */
    int fraction = ih_min_s32(8 + RIGHT_BITS - bits, 24);
    for (int32_t i = 0; i < TERMS; i++) {
        scratch->solution[i] = ih_saturate_s32(ih_mul_wide_shift(
            scratch->right_q28[i], scratch->scale[i], SCALE_SHIFT + 8 - fraction));
        IH_IN_RANGE(scratch->right_q28[i], -IH_RANGE_RIGHT_Q28, IH_RANGE_RIGHT_Q28);
    }
    return fraction;
}

/* Undo the scaling of the unknowns: coefficient_i = x_i * scale_i / 2^31 with fraction bits. */
static void unscale_solution(struct ih_surface_scratch *scratch, int fraction)
{
    uint64_t largest = 0;
    for (int32_t i = 0; i < TERMS; i++) {
        int64_t product = (int64_t)scratch->solution[i] * scratch->scale[i]; /* < 2^56 */
        largest |= (uint64_t)ih_abs_s64(product);
    }
    int shift = ih_max_s32(0, ih_bits_u64(largest) - SOLUTION_BITS);
    for (int32_t i = 0; i < TERMS; i++) {
        int64_t product = (int64_t)scratch->solution[i] * scratch->scale[i];
        scratch->solution[i] = (int32_t)ih_shift_round(product, shift);
        IH_IN_RANGE(scratch->solution[i], -IH_RANGE_COEFFICIENT, IH_RANGE_COEFFICIENT);
    }
    scratch->solution_shift = fraction + (SCALE_SHIFT - 20) - shift;
}

static bool solve(const struct ih_samples *samples, int32_t mean_mm_q8,
                  struct ih_surface_scratch *scratch)
{
    int32_t bad_pivot, exponent;
    int32_t *factor = scratch->of.factor_q30;
    if (ih_cholesky_factor(factor, TERMS, &bad_pivot) != IH_OK) {
        return false;
    }
    int fraction = scale_right(samples, mean_mm_q8, scratch);
    ih_cholesky_solve(factor, TERMS, scratch->solution, scratch->solution, &exponent);
    unscale_solution(scratch, fraction - exponent);
    return true;
}

/* sum_n c_n B_n in Q8 from a sum in Q(20 + solution_shift). */
static int32_t depth_of_sum(const struct ih_surface_scratch *scratch, int32_t mean_mm_q8,
                            int64_t sum)
{
    int shift = 20 + scratch->solution_shift - 8;
    int64_t depth_q8 = shift >= 0 ? ih_shift_round(sum, ih_min_s32(shift, 62)) : INT32_MAX;
    return ih_saturate_s32(mean_mm_q8 + depth_q8);
}

/* Huber step: a sample that is too far from the surface gets less weight. basis_q20 is its row, not
 * yet weighted. False when it is near enough. */
static bool reweight(const struct ih_surface_scratch *scratch, const struct ih_sample *sample,
                     const struct ih_surface_params *params, int32_t mean_mm_q8,
                     int32_t *root_weight_q15)
{
    int64_t limit_q8 = (int64_t)params->huber_mm << 8;
    int64_t sum = 0;
    for (int32_t k = 0; k < TERMS; k++) {
        sum += (int64_t)scratch->solution[k] * (int32_t)scratch->basis_q20[k];
    }
    int64_t off_q8 =
        ih_abs_s64((int64_t)sample->depth_mm_q8 - depth_of_sum(scratch, mean_mm_q8, sum));
    if (off_q8 <= limit_q8) {
        return false;
    }
    /* sqrt(limit / off) in Q15 */
    int64_t root_q15 = ih_isqrt_u64((uint64_t)ih_div_round(limit_q8 * (1 << 30), off_q8));
    *root_weight_q15 = (int32_t)ih_mul_shift(sample->root_weight_q15, root_q15, 15);
    return true;
}

/* The normal equations of all samples: all lines, or with huber only those that are not kept, and then
 * samples that are too far from the surface that was solved last get less weight first. Returns how
 * many do. */
static int32_t sum_rows(const struct ih_samples *samples, const struct ih_surface_params *huber,
                        struct ih_surface_scratch *scratch, struct ih_surface *out)
{
    int32_t lighter = 0;
    memset(scratch->of.others_q40, 0, sizeof scratch->of.others_q40);
    memset(scratch->right_q28, 0, sizeof scratch->right_q28);
    for (int32_t first = 0; first < samples->sample_count; first += IH_NORMAL_ROWS) {
        const int32_t count = ih_min_s32(samples->sample_count - first, IH_NORMAL_ROWS);
        for (int32_t at = 0; at < count; at++) {
            const struct ih_sample *sample = &samples->sample[first + at];
            int32_t *root_weight_q15 = &out->root_weight_q15[first + at];
            fill_row(scratch, sample, scratch->basis_q20);
            lighter +=
                huber != NULL && reweight(scratch, sample, huber, out->mean_mm_q8, root_weight_q15);
            weigh_row(scratch, *root_weight_q15, at);
            add_right(scratch, sample, out->mean_mm_q8, *root_weight_q15);
        }
        clear_rows(scratch, count);
        if (huber == NULL) {
            ih_normal_add(scratch->row_q20, 0, KEPT, scratch->kept.q40);
        }
        ih_normal_add(scratch->row_q20, KEPT, TERMS, scratch->of.others_q40);
    }
    return lighter;
}

/* Add those samples whose weight changed to the lines that are kept, with the weight that they had before
 * or with the one that they have now. */
static void sum_changed(const struct ih_samples *samples, const struct ih_surface *out,
                        bool is_before, struct ih_surface_scratch *scratch)
{
    int32_t count = 0;
    for (int32_t i = 0; i < samples->sample_count; i++) {
        const int32_t before_q15 = samples->sample[i].root_weight_q15;
        const int32_t now_q15 = out->root_weight_q15[i];
        if (now_q15 != before_q15) {
            fill_row(scratch, &samples->sample[i], scratch->basis_q20);
            weigh_row(scratch, is_before ? before_q15 : now_q15, count);
            count++;
        }
        if (count == IH_NORMAL_ROWS || (count > 0 && i + 1 == samples->sample_count)) {
            clear_rows(scratch, count);
            ih_normal_add(scratch->row_q20, 0, KEPT, scratch->kept.q40);
            count = 0;
        }
    }
}

static void turn_bits(uint64_t *value, int32_t count)
{
    for (int32_t i = 0; i < count; i++) {
        value[i] = ~value[i];
    }
}

/* Lines that are kept: samples whose weight changed are taken away with the one that they had, and added
 * with the one that they have. */
static void change_kept(const struct ih_samples *samples, const struct ih_surface *out,
                        struct ih_surface_scratch *scratch)
{
    turn_bits(scratch->kept.q40, IH_NORMAL_LINE(KEPT));
    sum_changed(samples, out, true, scratch);
    turn_bits(scratch->kept.q40, IH_NORMAL_LINE(KEPT));
    sum_changed(samples, out, false, scratch);
}

/* Solve for the surface. */
static bool fit_first(const struct ih_samples *samples, const struct ih_surface_params *params,
                      struct ih_surface_scratch *scratch, struct ih_surface *out)
{
    memset(scratch->kept.q40, 0, sizeof scratch->kept.q40);
    sum_rows(samples, NULL, scratch, out);
    scale_lines(params, scratch);
    return solve(samples, out->mean_mm_q8, scratch);
}

/* Again, with less weight for the samples that are far from it, if any. */
static bool fit_again(const struct ih_samples *samples, const struct ih_surface_params *params,
                      struct ih_surface_scratch *scratch, struct ih_surface *out)
{
    out->downweighted_count = sum_rows(samples, params, scratch, out);
    if (out->downweighted_count == 0) {
        return true;
    }
    change_kept(samples, out, scratch);
    scale_lines(params, scratch);
    return solve(samples, out->mean_mm_q8, scratch);
}

/* B for whole grid steps: sqrt((a^2 + b^2) 100 / 121 + 1) in Q20, b down and a to both sides, so that
 * what a centre adds to a row of nodes stands in a row. */
static void fill_table(struct ih_surface_scratch *scratch)
{
    const int64_t numerator2 = IH_SURFACE_STEP_NUMERATOR * IH_SURFACE_STEP_NUMERATOR;
    const int64_t denominator2 = IH_SURFACE_STEP_DENOMINATOR * IH_SURFACE_STEP_DENOMINATOR;
    for (int64_t b = 0; b < IH_SURFACE_STEPS; b++) {
        int32_t *middle = &scratch->of.table_q20[b][IH_SURFACE_STEPS - 1];
        for (int64_t a = 0; a < IH_SURFACE_STEPS; a++) {
            int64_t radicand_q42 = ih_div_round(
                ((a * a + b * b) * numerator2 + denominator2) * ((int64_t)1 << 42), denominator2);
            middle[a] = (int32_t)((ih_isqrt_u64((uint64_t)radicand_q42) + 1) >> 1);
            middle[-a] = middle[a];
        }
    }
}

/* Nearer than this no node can be: see IH_SURFACE_OVERSHOOT_MM. */
static int32_t least_depth_mm_q8(const struct ih_samples *samples)
{
    int32_t nearest_q8 = INT32_MAX;
    for (int32_t i = 0; i < samples->sample_count; i++) {
        nearest_q8 = ih_min_s32(nearest_q8, samples->sample[i].depth_mm_q8);
    }
    return ih_max_s32(nearest_q8 - (IH_SURFACE_OVERSHOOT_MM << 8), 1 << 8);
}

/* Centre k is at so many grid steps from the grid's first node. */
static int32_t centre_node(int32_t centre)
{
    return (IH_SURFACE_GRID - 1) / 2 - IH_SURFACE_STEPS_PER_CENTRE * (IH_SURFACE_CENTRES - 1) / 2 +
           IH_SURFACE_STEPS_PER_CENTRE * centre;
}

/* Centres k and CENTRES - 1 - k of a row stand alike on both sides of the middle, and so do nodes x and
 * GRID - 1 - x: with p and q what a centre's basis is at both nodes, c and d the coefficients of both
 * centres, c p + d q at the one and c q + d p at the other are half of (c + d) (p + q) plus and less
 * (c - d) (p - q). */
static void fold_table(struct ih_surface_scratch *scratch)
{
    for (int32_t b = 0; b < IH_SURFACE_STEPS; b++) {
        const int32_t *middle = &scratch->of.table_q20[b][IH_SURFACE_STEPS - 1];
        for (int32_t k = 0; k < HALF_CENTRES; k++) {
            const int32_t *here = &middle[-centre_node(k)];
            const int32_t *there = &middle[-centre_node(IH_SURFACE_CENTRES - 1 - k)];
            for (int32_t x = 0; x < IH_SURFACE_HALF; x++) {
                scratch->kept.folded.sum_q20[b][k][x] = here[x] + there[x];
                scratch->kept.folded.difference_q20[b][k][x] = here[x] - there[x];
            }
        }
    }
}

/* Add what a row of centres brings, folded, to half a row of nodes. */
static void add_half(const int32_t coefficient[HALF_CENTRES],
                     int32_t basis_q20[HALF_CENTRES][IH_SURFACE_HALF], int64_t sum[IH_SURFACE_HALF])
{
    for (int32_t x = 0; x < IH_SURFACE_HALF; x++) {
        int64_t here = sum[x];
#pragma GCC unroll 6
        for (int32_t k = 0; k < HALF_CENTRES; k++) {
            here += (int64_t)coefficient[k] * basis_q20[k][x];
        }
        sum[x] = here;
    }
}

/* sum_n c_n B_n along a row of nodes. */
static void sum_row(struct ih_surface_scratch *scratch, int32_t y, int64_t sum[IH_SURFACE_GRID])
{
    int64_t even[IH_SURFACE_HALF] = {0};
    int64_t odd[IH_SURFACE_HALF] = {0};
    for (int32_t row = 0; row < IH_SURFACE_CENTRES; row++) {
        const int32_t *solution = &scratch->solution[row * IH_SURFACE_CENTRES];
        const int32_t b = ih_abs_s32(y - centre_node(row));
        int32_t both[HALF_CENTRES];
        int32_t between[HALF_CENTRES];
        for (int32_t k = 0; k < HALF_CENTRES; k++) {
            both[k] = solution[k] + solution[IH_SURFACE_CENTRES - 1 - k];
            between[k] = solution[k] - solution[IH_SURFACE_CENTRES - 1 - k];
        }
        add_half(both, scratch->kept.folded.sum_q20[b], even);
        add_half(between, scratch->kept.folded.difference_q20[b], odd);
    }
    for (int32_t x = 0; x < IH_SURFACE_HALF; x++) {
        sum[x] = (even[x] + odd[x]) / 2; /* without a rest */
        sum[IH_SURFACE_GRID - 1 - x] = (even[x] - odd[x]) / 2;
    }
}

static void evaluate(const struct ih_samples *samples, struct ih_surface_scratch *scratch,
                     struct ih_surface *out)
{
    int32_t least_q8 = least_depth_mm_q8(samples);
    out->nearest_mm_q8 = INT32_MAX;
    for (int32_t y = 0; y < IH_SURFACE_GRID; y++) {
        int64_t sum[IH_SURFACE_GRID];
        sum_row(scratch, y, sum);
        for (int32_t x = 0; x < IH_SURFACE_GRID; x++) {
            int32_t depth_q8 = depth_of_sum(scratch, out->mean_mm_q8, sum[x]);
            out->depth_mm_q8[y][x] = ih_clamp_s32(depth_q8, least_q8, IH_SURFACE_DEPTH_MAX_MM << 8);
            out->nearest_mm_q8 = ih_min_s32(out->nearest_mm_q8, out->depth_mm_q8[y][x]);
        }
    }
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
    place_centres(scratch);
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
