#include "upkeep/ih_rotation_solve.h"

#include "base/ih_fix.h"
#include "upkeep/ih_rotation_vote.h"

/* The prior is at least as wide as this. */
#define PRIOR_MIN_RAD_Q30 107374 /* 0.1 mrad */
/* Min determinant of the correlations: below it an axis is not seen at all. */
#define DETERMINANT_MIN_Q30 (1 << 20)

const int8_t ih_rotation_packed[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

int64_t ih_rotation_div_round(int64_t numerator, int64_t denominator)
{
    return ih_div_round(numerator, denominator);
}

int64_t ih_rotation_limit(int64_t value, int64_t max)
{
    return value > max ? max : value < -max ? -max : value;
}

static void fill_cofactors(const int64_t c_q30[3][3], struct ih_rotation_equations *out)
{
    for (int row = 0; row < 3; row++) {
        int r1 = (row + 1) % 3;
        int r2 = (row + 2) % 3;
        for (int column = 0; column < 3; column++) {
            int c1 = (column + 1) % 3;
            int c2 = (column + 2) % 3;
            out->cofactor_q30[row][column] =
                ih_shift_round(c_q30[r1][c1] * c_q30[r2][c2] - c_q30[r1][c2] * c_q30[r2][c1], 30);
        }
    }
    out->determinant_q30 = 0;
    for (int column = 0; column < 3; column++) {
        out->determinant_q30 += ih_mul_shift(c_q30[0][column], out->cofactor_q30[0][column], 30);
    }
}

/* Sums with a prior of that precision about the calibration, from which the rig is turned already. An
 * entry of the matrix is at most the product of its roots, so entries over roots stay below 2^31. */
static void scale(const struct ih_rotation_sums *sums, int64_t precision_q16,
                  const int32_t rotated_rad_q30[3], struct ih_rotation_equations *out)
{
    int64_t c_q30[3][3];
    for (int i = 0; i < 3; i++) {
        int64_t diagonal_q16 = sums->normal_q16[ih_rotation_packed[i][i]] + precision_q16;
        int64_t pull_q24 = ih_mul_shift(precision_q16 >> 8, rotated_rad_q30[i], 14);
        out->root_q8[i] = (int64_t)ih_isqrt_u64((uint64_t)diagonal_q16) + 1;
        out->right_px_q16[i] =
            ih_rotation_div_round(sums->right_q24[i] - pull_q24, out->root_q8[i]);
    }
    for (int row = 0; row < 3; row++) {
        c_q30[row][row] = (int64_t)1 << 30;
        for (int column = row + 1; column < 3; column++) {
            int64_t part_q8 = ih_rotation_div_round(
                sums->normal_q16[ih_rotation_packed[row][column]], out->root_q8[row]);
            c_q30[row][column] =
                ih_rotation_div_round(part_q8 * ((int64_t)1 << 30), out->root_q8[column]);
            c_q30[column][row] = c_q30[row][column];
        }
    }
    fill_cofactors(c_q30, out);
}

/* Right sides are below 2^7.5 px times the root of the dots' number, 2^24 in Q16; three products with
 * cofactors of up to 2 in Q30: 2^57. */
static void solve(const struct ih_rotation_equations *e, int32_t rotation_rad_q30[3])
{
    for (int i = 0; i < 3; i++) {
        int64_t sum_q46 = 0;
        for (int k = 0; k < 3; k++) {
            sum_q46 += e->cofactor_q30[i][k] * e->right_px_q16[k];
        }
        int64_t part_px_q16 = ih_rotation_div_round(sum_q46, e->determinant_q30);
        rotation_rad_q30[i] = ih_clamp_s32(
            ih_saturate_s32(ih_rotation_div_round(part_px_q16 * (1 << 22), e->root_q8[i])),
            -2 * IH_ROTATION_VOTE_MAX_RAD_Q30, 2 * IH_ROTATION_VOTE_MAX_RAD_Q30);
    }
}

static int64_t length_rad_q30(const int32_t a_rad_q30[3], const int32_t b_rad_q30[3])
{
    int64_t sum = 0;
    for (int i = 0; i < 3; i++) {
        int64_t part = (int64_t)a_rad_q30[i] + b_rad_q30[i];
        sum += part * part;
    }
    return (int64_t)ih_isqrt_u64((uint64_t)sum);
}

/* A weight is at least a step, so slopes over roots are at most 16; with cofactors of 2 in Q30: 2^62.6
 * for three. */
int64_t ih_rotation_lever_q26(const struct ih_rotation_equations *e, const int32_t slope_px_q4[3],
                              int axis)
{
    int64_t sum_q56 = 0;
    for (int k = 0; k < 3; k++) {
        int64_t part_q26 =
            ih_rotation_div_round(slope_px_q4[k] * ((int64_t)1 << 30), e->root_q8[k]);
        sum_q56 += e->cofactor_q30[axis][k] * part_q26;
    }
    return ih_rotation_limit(ih_rotation_div_round(sum_q56, e->determinant_q30), (int64_t)1 << 32);
}

/* The turn with a prior of that width about the calibration. False: an axis is not seen at all. */
static bool solve_with(const struct ih_rotation_sums *sums, int64_t noise_px_q12,
                       int64_t prior_rad_q30, const int32_t from_rad_q30[3],
                       struct ih_rotation_equations *equations, int32_t rotation_rad_q30[3])
{
    int64_t root_q8 = ih_rotation_div_round(noise_px_q12 * (1 << 26), prior_rad_q30);
    scale(sums, root_q8 * root_q8, from_rad_q30, equations);
    if (equations->determinant_q30 < DETERMINANT_MIN_Q30) {
        return false;
    }
    solve(equations, rotation_rad_q30);
    return true;
}

bool ih_rotation_solve(const struct ih_rotation_sums *sums, int64_t noise_px_q12,
                       const int32_t from_rad_q30[3], struct ih_rotation_equations *wide,
                       int32_t rotation_rad_q30[3])
{
    const int32_t none[3] = {0, 0, 0};
    const int32_t limit[3] = {IH_ROTATION_VOTE_MAX_RAD_Q30, IH_ROTATION_VOTE_MAX_RAD_Q30,
                              IH_ROTATION_VOTE_MAX_RAD_Q30};
    struct ih_rotation_equations narrow;
    bool is_solved = solve_with(sums, noise_px_q12, length_rad_q30(limit, none), from_rad_q30, wide,
                                rotation_rad_q30);
    for (int i = 0; is_solved && i < 2; i++) {
        int64_t prior_rad_q30 = length_rad_q30(from_rad_q30, rotation_rad_q30);
        prior_rad_q30 = prior_rad_q30 > PRIOR_MIN_RAD_Q30 ? prior_rad_q30 : PRIOR_MIN_RAD_Q30;
        is_solved =
            solve_with(sums, noise_px_q12, prior_rad_q30, from_rad_q30, &narrow, rotation_rad_q30);
    }
    return is_solved;
}
