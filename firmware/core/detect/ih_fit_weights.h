/* ih_fit_weights - how far the points of a fit are from its ellipsoid, and how much each weighs (ours).
 *
 * In:     an ellipsoid's inverses, the scale of the robust weights; rows with the offsets of points.
 * Out:    per row the point's position in semi-axes and gradient (ih_ellipsoid_distance.h), its weight, and its
 *         weighted residual. Rows without weight are dropped, or are all zero.
 * Method: (1 + (r / k)^2)^-2, 0 beyond 5 k; less for points low on the head, linearly from all at s_y = 0.5 to
 *         half at 0.8 and below: there the neck begins. One over the sum is the square of one over its
 *         root, from the table of ih_fix, and corrected once: 2^-25 of it.
 * Overflow: scales up to 24 mm: a residual that has a weight is below 120 mm. Positions within 3.35 semi-axes.
 */
#ifndef IH_FIT_WEIGHTS_H
#define IH_FIT_WEIGHTS_H

#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "detect/ih_ellipsoid_distance.h"

#define IH_FIT_UNKNOWNS 6
/* Rows that are summed at once; each costs 64 bytes. */
#define IH_FIT_ROWS_MAX 128
/* Points farther than this many robust scales have no weight: it would be below 1/676. */
#define IH_FIT_SCALES_MAX 5

/* A row of the equations for each point and each push, as columns. */
struct ih_fit_rows {
    int32_t count;
    int32_t position_q14[3][IH_FIT_ROWS_MAX]; /* of a new point: offset, mm in Q8 */
    int32_t component_q14[3][IH_FIT_ROWS_MAX];
    uint32_t radius2_q22[IH_FIT_ROWS_MAX], length2_q22[IH_FIT_ROWS_MAX];
    uint32_t inverse[IH_FIT_ROWS_MAX];
    uint16_t weight_q16[IH_FIT_ROWS_MAX];
    int16_t residual_mm_q10[IH_FIT_ROWS_MAX]; /* weighted */
    /* By unknown, with 14 bits by the centre and 13 by ln of the axes. */
    int16_t slope[IH_FIT_UNKNOWNS][IH_FIT_ROWS_MAX];
    int16_t weighted[IH_FIT_UNKNOWNS][IH_FIT_ROWS_MAX];
};

/* What is the same for all points of a step. */
struct ih_fit_weighting {
    struct ih_inverses inverses;
    int32_t scale_mm;
    uint32_t reach2_q22; /* positions farther from the centre have no weight: squared */
};

/* (1 + (r / k)^2)^-2, rounded; 0 beyond IH_FIT_SCALES_MAX k. */
static inline int32_t ih_fit_robust_weight_q16(int32_t residual_mm_q8, int32_t scale_mm)
{
    const uint32_t size_q8 = (uint32_t)ih_abs_s32(residual_mm_q8);
    const uint32_t scale2 = (uint32_t)(scale_mm * scale_mm);
    if (size_q8 > (uint32_t)(IH_FIT_SCALES_MAX * scale_mm << 8)) {
        return 0;
    }
    const uint32_t sum_q16 = (1U << 16) + (size_q8 * size_q8 + scale2 / 2) / scale2; /* up to 26 */
    const int half = 7 - (sum_q16 >= 1U << 18) - (sum_q16 >= 1U << 20);
    const uint32_t sum = sum_q16 << (2 * half);
    const uint32_t r_q15 = ih_inverse_root_q15(sum);
    const uint32_t root_q32 = (uint32_t)((uint64_t)sum * r_q15 >> 15);
    const uint32_t residual_q32 = UINT32_MAX - (uint32_t)((uint64_t)root_q32 * r_q15 >> 15);
    uint32_t inverse_q29 = r_q15 * r_q15 >> 1;
    inverse_q29 += (inverse_q29 >> 16) * (residual_q32 >> 4) >> 12;
    const uint64_t square_q58 = (uint64_t)inverse_q29 * inverse_q29;
    return (int32_t)((square_q58 + ((uint64_t)1 << (73 - 4 * half))) >> (74 - 4 * half));
}

#define IH_FIT_LOW_FROM_Q14 8192 /* 0.5 */
#define IH_FIT_LOW_SPAN_Q14 4915 /* 0.3 */
/* 0.5 over 0.3: Q16 of the loss for a step of the position, in steps of Q16, rounded up. */
#define IH_FIT_LOW_SLOPE_Q16 436926

/* A weight, less for points low on the head. */
static inline int32_t ih_fit_lowered_weight_q16(int32_t weight_q16, int32_t down_q14)
{
    const int32_t over = ih_clamp_s32(down_q14 - IH_FIT_LOW_FROM_Q14, 0, IH_FIT_LOW_SPAN_Q14);
    const uint32_t lost_q16 = (uint32_t)over * IH_FIT_LOW_SLOPE_Q16 >> 16;
    return weight_q16 - (int32_t)(((uint32_t)weight_q16 * lost_q16 + (1U << 15) - 1) >> 16);
}

static inline int16_t ih_fit_weighted_residual_q10(int32_t weight_q16, int32_t residual_mm_q8)
{
    return (int16_t)ih_mul_shift(weight_q16, residual_mm_q8, 14);
}

IH_BEGIN_DECLS

/* Weigh all rows; they hold offsets of points. */
void ih_fit_weigh_rows(const struct ih_fit_weighting *weighting, struct ih_fit_rows *rows);

IH_END_DECLS

#endif
