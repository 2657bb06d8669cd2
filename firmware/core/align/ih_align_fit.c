#include "align/ih_align_fit.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

#include "base/ih_cholesky.h"
#include "base/ih_fix.h"

/* The weight of what is known: 512 dots that show nothing else. */
#define HELD_Q24 ((int64_t)1 << 33)
/* Bits of a unit right side, when one column of the inverse is solved for. */
#define UNIT_BITS 20

/* How wrong a rig may be, one standard deviation: 1, 0.2 and 1.2 degrees, 1.2 % of the focal length, 0.4 % of it across (4
 * px of a thousand). */
static const int32_t prior_q30[IH_ALIGN_AXES] = {18740163, 3748033, 22488196, 12884902, 4294967};

int32_t ih_align_rad_q30(int32_t px_q12, const struct ih_rig *rig)
{
    return (int32_t)ih_clamp_s64(ih_div_round(ih_clamp_s64(px_q12, 1 << 28) * ((int64_t)1 << 34),
                                              rig->calibration.fx_px_q16),
                                 INT32_MAX);
}

int32_t ih_align_px_q12(int32_t rad_q30, const struct ih_rig *rig)
{
    return (int32_t)ih_mul_shift(rad_q30, rig->calibration.fx_px_q16, 34);
}

void ih_align_prior(const struct ih_rig *rig, int32_t sigma_px_q12[IH_ALIGN_AXES])
{
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        sigma_px_q12[k] =
            ih_max_s32((int32_t)ih_mul_shift(prior_q30[k], rig->calibration.fx_px_q16, 30 + 4), 1);
    }
}

/* (1 + (r / s)^2)^-2, 0 beyond 4 s. Squares are taken in Q16; scales and distances of up to 64 px: below 2^29. */
static int32_t weight_q14(int64_t residual_px_q12, int32_t scale_px_q12)
{
    if (ih_abs_s64(residual_px_q12) > 4 * (int64_t)scale_px_q12) {
        return 0;
    }
    const uint32_t scale2 = (uint32_t)ih_shift_round((int64_t)scale_px_q12 * scale_px_q12, 8) + 1;
    const uint32_t residual2 = (uint32_t)ih_shift_round(residual_px_q12 * residual_px_q12, 8);
    const uint32_t root_q14 = (uint32_t)(((uint64_t)scale2 << 14) / (scale2 + residual2));
    return (int32_t)(root_q14 * root_q14 >> 14);
}

/* Sums are exact: rounded products would make the matrix indefinite, as the shift is hardly another number than the
 * rotation about the baseline. A weight times a slope is below 2^29 in Q26, so that every product is one of 32 bits
 * by 32; with another slope, or a distance of up to 64 px, over 1,024 pairs below 2^57. */
void ih_align_sums_add(const struct ih_align_pairs *pairs,
                       const int32_t guess_px_q12[IH_ALIGN_AXES], int32_t scale_px_q12,
                       struct ih_align_sums *sums)
{
    int64_t normal_q38[IH_ALIGN_ENTRIES] = {0}, right_px_q38[IH_ALIGN_AXES] = {0};
    for (int32_t i = 0; i < pairs->count; i++) {
        const struct ih_align_pair *pair = &pairs->pair[i];
        const int64_t residual =
            pair->across_px_q12 - ih_align_field_px_q12(pair->slope_q12, guess_px_q12);
        const int32_t weight = weight_q14(residual, scale_px_q12);
        if (weight == 0) {
            continue;
        }
        int32_t at = 0;
        sums->weight_q14 += weight;
        for (int k = 0; k < IH_ALIGN_AXES; k++) {
            const int32_t pull_q26 = weight * pair->slope_q12[k];
            right_px_q38[k] += (int64_t)pull_q26 * pair->across_px_q12;
            for (int l = 0; l <= k; l++) {
                normal_q38[at++] += (int64_t)pull_q26 * pair->slope_q12[l];
            }
        }
    }
    for (int i = 0; i < IH_ALIGN_ENTRIES; i++) {
        sums->normal_q24[i] += ih_shift_round(normal_q38[i], 14);
    }
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        sums->right_px_q24[k] += ih_shift_round(right_px_q38[k], 14);
    }
}

void ih_align_sums_hold(struct ih_align_sums *sums, enum ih_align_axis axis, int32_t value_px_q12)
{
    const int k = (int)axis;
    sums->normal_q24[k * (k + 1) / 2 + k] += HELD_Q24;
    sums->right_px_q24[k] += ih_mul_shift(HELD_Q24, value_px_q12, 12);
}

/* Scaled to a diagonal of 1 by the roots of its own; false: no number can be solved for. */
static bool factor(const struct ih_align_sums *sums, const int32_t prior_px_q12[IH_ALIGN_AXES],
                   int32_t noise_px_q12, int64_t root_q12[IH_ALIGN_AXES],
                   int32_t factor_q30[IH_ALIGN_ENTRIES])
{
    int64_t normal[IH_ALIGN_ENTRIES];
    int32_t at = 0;
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        for (int l = 0; l <= k; l++) {
            normal[at] = sums->normal_q24[at];
            at++;
        }
        const int64_t ratio_q12 = ih_div_round((int64_t)noise_px_q12 << 12, prior_px_q12[k]);
        normal[at - 1] += ratio_q12 * ratio_q12 + 1;
        root_q12[k] = (int64_t)ih_isqrt_u64((uint64_t)normal[at - 1]) + 1;
    }
    /* No entry is larger than the largest root's square. */
    int64_t root_max_q12 = 1;
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        root_max_q12 = ih_max_s64(root_max_q12, root_q12[k]);
    }
    const int bits = ih_min_s32(30, 62 - ih_bits_u64((uint64_t)(root_max_q12 * root_max_q12)));
    at = 0;
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        for (int l = 0; l <= k; l++) {
            const int64_t ratio =
                ih_div_round(normal[at] * ((int64_t)1 << bits), root_q12[k] * root_q12[l]);
            factor_q30[at] = (int32_t)ih_clamp_s64(ratio * (1 << (30 - bits)), 1 << 30);
            at++;
        }
    }
    int32_t bad;
    return ih_cholesky_factor(factor_q30, IH_ALIGN_AXES, &bad) == IH_OK;
}

static int64_t value_of(int32_t mantissa, int32_t exponent)
{
    return ih_clamp_s64((int64_t)mantissa * ((int64_t)1 << ih_min_s32(exponent, 20)),
                        (int64_t)1 << 40);
}

void ih_align_solve(const struct ih_align_sums *sums, const int32_t prior_px_q12[IH_ALIGN_AXES],
                    int32_t noise_px_q12, int32_t moved_px_q12[IH_ALIGN_AXES],
                    int32_t sigma_px_q12[IH_ALIGN_AXES])
{
    int64_t root_q12[IH_ALIGN_AXES];
    int32_t factor_q30[IH_ALIGN_ENTRIES], right[IH_ALIGN_AXES], x[IH_ALIGN_AXES], exponent;
    const bool is_solved = factor(sums, prior_px_q12, noise_px_q12, root_q12, factor_q30);
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        right[k] = ih_saturate_s32(ih_div_round(sums->right_px_q24[k] * (1 << 4), root_q12[k]));
        moved_px_q12[k] = 0;
    }
    if (is_solved) {
        ih_cholesky_solve(factor_q30, IH_ALIGN_AXES, right, x, &exponent);
        for (int k = 0; k < IH_ALIGN_AXES; k++) {
            moved_px_q12[k] =
                ih_saturate_s32(ih_div_round(value_of(x[k], exponent) * (1 << 8), root_q12[k]));
        }
    }
    for (int k = 0; k < IH_ALIGN_AXES && sigma_px_q12 != NULL; k++) {
        sigma_px_q12[k] = prior_px_q12[k];
        if (is_solved) {
            for (int l = 0; l < IH_ALIGN_AXES; l++) {
                right[l] = l == k ? 1 << UNIT_BITS : 0;
            }
            ih_cholesky_solve(factor_q30, IH_ALIGN_AXES, right, x, &exponent);
            const int64_t inverse = ih_max_s64(value_of(x[k], exponent), 0);
            const int64_t sigma = (int64_t)ih_isqrt_u64((uint64_t)inverse << UNIT_BITS) *
                                  noise_px_q12; /* Q20, px Q12 */
            sigma_px_q12[k] =
                ih_min_s32(ih_saturate_s32(ih_div_round(ih_shift_round(sigma, 8), root_q12[k])),
                           prior_px_q12[k]);
        }
    }
}

void ih_align_step(const struct ih_align_pairs *pairs, const int32_t prior_px_q12[IH_ALIGN_AXES],
                   int32_t scale_px_q12, struct ih_align_sums *sums,
                   int32_t moved_px_q12[IH_ALIGN_AXES], int32_t sigma_px_q12[IH_ALIGN_AXES])
{
    memset(sums, 0, sizeof *sums);
    ih_align_sums_add(pairs, moved_px_q12, scale_px_q12, sums);
    ih_align_solve(sums, prior_px_q12, IH_ALIGN_NOISE_PX_Q12, moved_px_q12, sigma_px_q12);
}

int32_t ih_align_rms_px_q12(const struct ih_align_sums *sums,
                            const int32_t moved_px_q12[IH_ALIGN_AXES])
{
    int64_t sum_px2_q24 = 0; /* times the weight */
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        int64_t pull_px_q24 = 0;
        for (int l = 0; l < IH_ALIGN_AXES; l++) {
            pull_px_q24 += ih_mul_shift(ih_align_entry(sums, k, l), moved_px_q12[l], 12);
        }
        sum_px2_q24 += ih_mul_shift(pull_px_q24, moved_px_q12[k], 12);
    }
    const int64_t mean_q24 = ih_div_round(ih_max_s64(sum_px2_q24, 0), (sums->weight_q14 >> 14) + 1);
    return (int32_t)ih_isqrt_u64((uint64_t)mean_q24);
}
