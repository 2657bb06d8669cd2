/* ih_fit_axes - logarithms of a fit's semi-axes, and what holds them (ours): a part of ih_fit, for its tests, too.
 *
 * Units: hundredths of ln.
 * Error: exp within 3e-6, ln within 3e-4 hundredths at 35 %, and half a step each.
 */
#ifndef IH_FIT_AXES_H
#define IH_FIT_AXES_H

#include <stdint.h>

#include "base/ih_fix.h"

/* The mean head's semi-axes times and over e^0.35. */
#define IH_FIT_LN_MAX_Q16 (35 << 16)
/* (6 mm)^2 over the priors' variances, Q16: 60 mm; 9 hundredths of ln. */
#define IH_FIT_PRIOR_CENTRE_Q16 655
#define IH_FIT_PRIOR_AXES_Q16 29127

/* exp(x) for |x| <= 0.35: the series to x^5, its remainder is below 3e-6. */
static inline int32_t ih_fit_exp_q16(int32_t ln_q16)
{
    int64_t x_q24 = ih_div_round((int64_t)ln_q16 * 256, 100);
    int64_t sum_q24 = 1 << 24;
    for (int n = 5; n >= 1; n--) {
        sum_q24 = (1 << 24) + ih_div_round(ih_mul_shift(sum_q24, x_q24, 24), n);
    }
    return (int32_t)ih_shift_round(sum_q24, 8);
}

/* 100 ln(a / m) = 200 (x + x^3/3 + x^5/5), x = (a - m) / (a + m); its remainder is below 3e-4 at 35 %. */
static inline int32_t ih_fit_ln_ratio_q16(int32_t a_mm_q8, int32_t m_mm_q8)
{
    int64_t x_q24 = ih_div_round(((int64_t)a_mm_q8 - m_mm_q8) * (1 << 24), a_mm_q8 + m_mm_q8);
    int64_t xx_q24 = ih_mul_shift(x_q24, x_q24, 24);
    int64_t series_q24 = ih_div_round(xx_q24, 5) + ih_div_round(1 << 24, 3);
    series_q24 = (1 << 24) + ih_mul_shift(series_q24, xx_q24, 24);
    int64_t ln_q16 = ih_mul_shift(200 * x_q24, series_q24, 32);
    return ih_clamp_s32(ih_saturate_s32(ln_q16), -IH_FIT_LN_MAX_Q16, IH_FIT_LN_MAX_Q16);
}

#endif
