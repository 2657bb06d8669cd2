#include "detect/ih_fit.h"

#include <string.h>

#include "base/ih_cholesky.h"
#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "base/ih_types.h"
#include "detect/ih_fit_axes.h"

/* Robust scale by step, mm. */
static const int8_t robust_mm[IH_FIT_STEPS] = {24, 16, 8, 8, 8, 8};
#define STEP_MAX_MM_Q16 (40 << 16)
#define STEP_MAX_LN_Q16 (15 << 16) /* hundredths */
#define SYSTEM_SCALE_BITS 11
#define RIGHT_BITS 20

void ih_fit_params_default(struct ih_fit_params *params)
{
    *params = (struct ih_fit_params){.see_through_mm = 60, .step_count = IH_FIT_STEPS};
}

static void add_priors(struct ih_fit_equations *equations, const struct ih_fit *fit)
{
    for (int axis = 0; axis < 3; axis++) {
        int64_t moved_q8 = (int64_t)fit->ellipsoid.centre_mm_q8[axis] - fit->start_mm_q8[axis];
        equations->normal_q16[IH_CHOLESKY_PACKED(axis + 1) - 1] += IH_FIT_PRIOR_CENTRE_Q16;
        equations->right_q16[axis] -= ih_mul_shift(IH_FIT_PRIOR_CENTRE_Q16, moved_q8, 8);
        equations->normal_q16[IH_CHOLESKY_PACKED(axis + 4) - 1] += IH_FIT_PRIOR_AXES_Q16;
        equations->right_q16[3 + axis] -=
            ih_mul_shift(IH_FIT_PRIOR_AXES_Q16, fit->ln_q16[axis], 16);
    }
}

_Static_assert(IH_FIT_UNKNOWNS <= IH_CHOLESKY_MAX, "the solver has room for all of them");

/* Solve for the step, mm and hundredths of ln in Q16. */
static void solve(const struct ih_fit_equations *equations, int32_t step_q16[IH_FIT_UNKNOWNS])
{
    int32_t a_q30[IH_CHOLESKY_PACKED(IH_FIT_UNKNOWNS)];
    int32_t right[IH_FIT_UNKNOWNS];
    int32_t bad_pivot, exponent;
    for (int32_t i = 0; i < IH_CHOLESKY_PACKED(IH_FIT_UNKNOWNS); i++) {
        a_q30[i] = ih_saturate_s32(equations->normal_q16[i] * (1 << (14 - SYSTEM_SCALE_BITS)));
    }
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        right[i] = ih_saturate_s32(
            ih_shift_round(equations->right_q16[i] * (1 << (RIGHT_BITS - 16)), SYSTEM_SCALE_BITS));
        IH_IN_RANGE(equations->normal_q16[IH_CHOLESKY_PACKED(i + 1) - 1], 1,
                    IH_RANGE_FIT_NORMAL_Q16);
    }
    memset(step_q16, 0, IH_FIT_UNKNOWNS * sizeof *step_q16);
    /* The priors keep it positive; if rounding should ever break that, the fit stays where it is. */
    if (ih_cholesky_factor(a_q30, IH_FIT_UNKNOWNS, &bad_pivot) != IH_OK) {
        return;
    }
    ih_cholesky_solve(a_q30, IH_FIT_UNKNOWNS, right, right, &exponent);
    for (int i = 0; i < IH_FIT_UNKNOWNS; i++) {
        int64_t scaled = exponent < 32 ? (int64_t)right[i] * ((int64_t)1 << exponent) : 0;
        step_q16[i] = ih_saturate_s32(ih_shift_round(scaled, RIGHT_BITS - 16));
    }
}

static void take_step(struct ih_fit *fit, const int32_t step_q16[IH_FIT_UNKNOWNS])
{
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(fit->ellipsoid.centre_mm_q8);
    for (int axis = 0; axis < 3; axis++) {
        int32_t move_q16 = ih_clamp_s32(step_q16[axis], -STEP_MAX_MM_Q16, STEP_MAX_MM_Q16);
        fit->ellipsoid.centre_mm_q8[axis] += (int32_t)ih_shift_round(move_q16, 8);
        int32_t grow_q16 = ih_clamp_s32(step_q16[3 + axis], -STEP_MAX_LN_Q16, STEP_MAX_LN_Q16);
        fit->ln_q16[axis] =
            ih_clamp_s32(fit->ln_q16[axis] + grow_q16, -IH_FIT_LN_MAX_Q16, IH_FIT_LN_MAX_Q16);
        fit->ellipsoid.semi_mm_q8[axis] =
            (int32_t)ih_mul_shift(mean.semi_mm_q8[axis], ih_fit_exp_q16(fit->ln_q16[axis]), 16);
        IH_IN_RANGE(fit->ellipsoid.centre_mm_q8[axis], -IH_RANGE_CENTRE_MM_Q8,
                    IH_RANGE_CENTRE_MM_Q8);
        IH_IN_RANGE(fit->ellipsoid.semi_mm_q8[axis], IH_ELLIPSOID_SEMI_MIN_MM << 8,
                    IH_ELLIPSOID_SEMI_MAX_MM << 8);
    }
}

void ih_fit_begin(const struct ih_ellipsoid *start, struct ih_fit *out)
{
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(start->centre_mm_q8);
    *out = (struct ih_fit){.ellipsoid = *start};
    for (int axis = 0; axis < 3; axis++) {
        out->ln_q16[axis] = ih_fit_ln_ratio_q16(start->semi_mm_q8[axis], mean.semi_mm_q8[axis]);
        out->start_mm_q8[axis] = start->centre_mm_q8[axis];
    }
}

void ih_fit_continue(const struct ih_rays *rays, const struct ih_fit_params *params,
                     int32_t step_count, struct ih_fit_scratch *scratch, struct ih_fit *fit)
{
    const int32_t end = ih_min_s32(step_count, params->step_count);
    for (; fit->step_index < end; fit->step_index++) {
        struct ih_fit_equations equations;
        int32_t step_q16[IH_FIT_UNKNOWNS];
        ih_fit_equations_collect(rays, &fit->ellipsoid, robust_mm[fit->step_index],
                                 params->see_through_mm, scratch, &equations);
        add_priors(&equations, fit);
        solve(&equations, step_q16);
        take_step(fit, step_q16);
    }
}
