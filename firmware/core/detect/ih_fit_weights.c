#include "detect/ih_fit_weights.h"

#include "simd/ih_simd.h"

/* The root's table is looked up at a sum of Q16 shifted by 10 bits at least, which must fit 32. */
_Static_assert(1 + IH_FIT_SCALES_MAX * IH_FIT_SCALES_MAX < 64,
               "a sum of a robust weight is below 2^22");

/* With the largest scale, 24 mm, vectors divide a square and its rounding by a product. */
_Static_assert((IH_FIT_SCALES_MAX * 24 << 8) * (IH_FIT_SCALES_MAX * 24 << 8) + 24 * 24 / 2 <
                   1 << 30,
               "a quotient's dividend is below 2^30");

#if IH_I16_LANES > 0
_Static_assert(IH_FIT_ROWS_MAX % IH_I16_LANES == 0, "rows fill whole vectors");

static inline ih_i32 with_sign(ih_u32 size, ih_i32 sign)
{
    return ih_i32_sub((ih_i32)size ^ sign, sign);
}

/* Positions and gradients of offsets, as ih_ellipsoid_distance.h says. */
static void find_gradients(const struct ih_inverses *inverses, struct ih_fit_rows *rows)
{
    for (int32_t k = 0; k < rows->count; k += IH_I32_LANES) {
        ih_u32 radius2 = (ih_u32)ih_i32_all(0);
        ih_u32 length2 = radius2;
        for (int axis = 0; axis < 3; axis++) {
            const ih_u32 inverse = (ih_u32)ih_i32_all((int32_t)inverses->axis[axis]);
            const ih_i32 offset = ih_i32_load(&rows->position_q14[axis][k]);
            const ih_i32 sign = offset >> 31;
            const ih_u32 position = ih_u32_mul_shift_round((ih_u32)ih_i32_abs(offset), inverse, 29);
            const ih_u32 component = ih_u32_mul_shift_round(position, inverse, 29);
            radius2 += ih_u32_mul_shift_round(position, position, 6);
            length2 += ih_u32_mul_shift_round(component, component, 6);
            ih_i32_store(&rows->position_q14[axis][k], with_sign(position, sign));
            ih_i32_store(&rows->component_q14[axis][k], with_sign(component, sign));
        }
        ih_u32_store(&rows->radius2_q22[k], radius2);
        ih_u32_store(&rows->length2_q22[k], length2);
    }
}
#else
static void find_gradients(const struct ih_inverses *inverses, struct ih_fit_rows *rows)
{
    for (int32_t k = 0; k < rows->count; k++) {
        int32_t position_q14[3], component_q14[3];
        for (int axis = 0; axis < 3; axis++) {
            const int32_t offset = rows->position_q14[axis][k];
            const uint32_t size =
                ih_product_shift((uint32_t)ih_abs_s32(offset), inverses->axis[axis], 29);
            position_q14[axis] = ih_with_sign_of(size, offset);
        }
        rows->radius2_q22[k] = ih_radius2_q22(position_q14);
        rows->length2_q22[k] = ih_gradient_q22(inverses, position_q14, component_q14);
        for (int axis = 0; axis < 3; axis++) {
            rows->position_q14[axis][k] = position_q14[axis];
            rows->component_q14[axis][k] = component_q14[axis];
        }
    }
}
#endif

#if IH_I16_LANES > 0 && IH_SIMD_LANE_SHIFTS
/* Squares from 2^30 on, from 2^10 on: shifted left by twice *half, as ih_distance_of does it. */
static inline ih_u32 normalise(ih_u32 value, ih_u32 *half)
{
    const ih_i32 size = ih_i32_max((ih_i32)value, ih_i32_all(1 << 10));
    const ih_i32 is_small = size < ih_i32_all(1 << 18);
    const ih_u32 moved = (ih_u32)ih_i32_pick(is_small, ih_i32_shift_left(size, 8), size);
    const ih_u32 pairs = ih_u32_zero_pairs(moved);
    *half = pairs + (ih_u32)(is_small & 4);
    return ih_u32_shift_left_each(moved, pairs * 2);
}

/* ih_inverse_root_q15 of each lane. */
static inline ih_u32 inverse_roots(ih_u32 square)
{
    const struct ih_u32_neighbours at =
        ih_u32_look_up_u16(ih_root_inverse_q15, (square >> 24) - 64);
    const ih_u32 part = square >> 8 & UINT16_MAX;
    return at.value - (((at.value - at.next) * part + UINT16_MAX) >> 16);
}

/* ih_distance_of each lane: the inverses, and the residuals. */
static inline ih_u32 find_distances(ih_u32 radius2, ih_u32 length2, ih_i32 *residual_mm_q8)
{
    ih_u32 half, length_half;
    const ih_u32 square = normalise(radius2, &half);
    const ih_u32 length_square = normalise(length2, &length_half);
    const ih_u32 r = inverse_roots(square);
    const ih_u32 root = ((square >> 16) * r) >> 15;
    const ih_u32 root_q20 = (root << 4) + (((square - root * root) >> 4) * r >> 24);
    const ih_i32 radius = (ih_i32)((ih_u32_shift_right_each(root_q20, half) + 1) >> 1);
    const ih_i32 product = ih_i32_mul(radius, ih_i32_sub(radius, ih_i32_all(1 << 14)));
    const ih_i32 over = ih_i32_add(product, ih_i32_all(1 << 13)) >> 14;
    const ih_u32 inverse = ih_u32_shift_left_each(inverse_roots(length_square), length_half) >> 3;
    *residual_mm_q8 = ih_i32_mul_shift_round(over, (ih_i32)inverse, 17);
    return inverse;
}

/* A divisor of numbers below 2^30, as a factor: its smallest power of two not below it, times 2^30, over the
 * divisor, rounded up. The excess is below 1, times 2^30 below that power. */
struct divisor {
    ih_u32 factor, half;
    int bits;
};

static struct divisor divisor_of(uint32_t value)
{
    const int bits = 30 + 32 - __builtin_clz(value);
    const uint64_t factor = (((uint64_t)1 << bits) + value - 1) / value;
    return (struct divisor){(ih_u32)ih_i32_all((int32_t)factor),
                            (ih_u32)ih_i32_all((int32_t)(value / 2)), bits};
}

/* ih_fit_robust_weight_q16 of each lane, without its limit. */
static inline ih_u32 robust_weights(const struct divisor *scale2, ih_u32 size_q8)
{
    const ih_u32 sum_q16 =
        ih_u32_mul_shift(size_q8 * size_q8 + scale2->half, scale2->factor, scale2->bits) +
        (1 << 16);
    const ih_i32 fewer = ih_i32_add((ih_i32)sum_q16 > ih_i32_all((1 << 18) - 1),
                                    (ih_i32)sum_q16 > ih_i32_all((1 << 20) - 1));
    const ih_u32 half = (ih_u32)ih_i32_add(ih_i32_all(7), fewer);
    const ih_u32 sum = ih_u32_shift_left_each(sum_q16, half * 2);
    const ih_u32 r = inverse_roots(sum);
    const ih_u32 residual = ~ih_u32_mul_shift(ih_u32_mul_shift(sum, r, 15), r, 15);
    const ih_u32 first = (r * r) >> 1;
    const ih_u32 inverse = first + (((first >> 16) * (residual >> 4)) >> 12);
    /* One bit more than the weight, then that one rounded. */
    const ih_u32 twice =
        ih_u32_shift_right_each(ih_u32_mul_shift(inverse, inverse, 45), 28 - half * 4);
    return (twice + 1) >> 1;
}

/* ih_fit_lowered_weight_q16 of each lane. */
static inline ih_u32 lowered_weights(ih_u32 weight_q16, ih_i32 down_q14)
{
    const ih_i32 below = ih_i32_sub(down_q14, ih_i32_all(IH_FIT_LOW_FROM_Q14));
    const ih_i32 over =
        ih_i32_min(ih_i32_max(below, ih_i32_all(0)), ih_i32_all(IH_FIT_LOW_SPAN_Q14));
    const ih_u32 lost = ((ih_u32)over * IH_FIT_LOW_SLOPE_Q16) >> 16;
    return weight_q16 - ((weight_q16 * lost + ((1 << 15) - 1)) >> 16);
}

/* The weights of as many rows as there are lanes; *residual with them. */
static inline ih_i32 weigh_lanes(const struct ih_fit_weighting *weighting,
                                 const struct divisor *scale2, struct ih_fit_rows *rows, int32_t k,
                                 ih_i32 *residual)
{
    const ih_u32 radius2 = ih_u32_load(&rows->radius2_q22[k]);
    ih_i32 distance_q8;
    const ih_u32 inverse =
        find_distances(radius2, ih_u32_load(&rows->length2_q22[k]), &distance_q8);
    const ih_i32 size = ih_i32_abs(distance_q8);
    const ih_i32 is_far = (size > ih_i32_all(IH_FIT_SCALES_MAX * weighting->scale_mm << 8)) |
                          ((ih_i32)radius2 > ih_i32_all((int32_t)weighting->reach2_q22));
    const ih_i32 is_used = ~is_far & ((ih_i32)radius2 > ih_i32_all(IH_RADIUS_MIN2_Q22 - 1));
    const ih_u32 robust = robust_weights(scale2, (ih_u32)(size & is_used));
    const ih_i32 lowered = (ih_i32)lowered_weights(robust, ih_i32_load(&rows->position_q14[1][k]));
    const ih_i32 weight = lowered & is_used;
    ih_u32_store(&rows->inverse[k], inverse & (ih_u32)(weight != 0));
    *residual = ih_i32_add(ih_i32_mul(weight, distance_q8), ih_i32_all(1 << 13)) >> 14;
    return ih_i32_min(weight, ih_i32_all(UINT16_MAX));
}

void ih_fit_weigh_rows(const struct ih_fit_weighting *weighting, struct ih_fit_rows *rows)
{
    const struct divisor scale2 = divisor_of((uint32_t)(weighting->scale_mm * weighting->scale_mm));
    find_gradients(&weighting->inverses, rows);
    for (int32_t k = 0; k < rows->count; k += IH_I16_LANES) {
        const int32_t next = k + IH_I32_LANES;
        ih_i32 residual, residual_next;
        const ih_i32 weight = weigh_lanes(weighting, &scale2, rows, k, &residual);
        const ih_i32 weight_next = weigh_lanes(weighting, &scale2, rows, next, &residual_next);
        ih_u16_store(&rows->weight_q16[k], (ih_u16)ih_i32_low_halves(weight, weight_next));
        ih_i16_store(&rows->residual_mm_q10[k], ih_i32_low_halves(residual, residual_next));
    }
}
#else
/* Move a row up to the rows that are kept. */
static void move_row(struct ih_fit_rows *rows, int32_t from, int32_t to)
{
    for (int axis = 0; axis < 3; axis++) {
        rows->position_q14[axis][to] = rows->position_q14[axis][from];
        rows->component_q14[axis][to] = rows->component_q14[axis][from];
    }
}

void ih_fit_weigh_rows(const struct ih_fit_weighting *weighting, struct ih_fit_rows *rows)
{
    int32_t kept = 0;
    find_gradients(&weighting->inverses, rows);
    for (int32_t k = 0; k < rows->count; k++) {
        struct ih_distance distance;
        if (rows->radius2_q22[k] > weighting->reach2_q22 ||
            !ih_distance_of(rows->radius2_q22[k], rows->length2_q22[k], &distance)) {
            continue;
        }
        const int32_t robust_q16 =
            ih_fit_robust_weight_q16(distance.residual_mm_q8, weighting->scale_mm);
        const int32_t weight_q16 = ih_fit_lowered_weight_q16(robust_q16, rows->position_q14[1][k]);
        if (weight_q16 > 0) {
            move_row(rows, k, kept);
            rows->inverse[kept] = distance.inverse;
            rows->weight_q16[kept] = (uint16_t)ih_min_s32(weight_q16, UINT16_MAX);
            rows->residual_mm_q10[kept] =
                ih_fit_weighted_residual_q10(weight_q16, distance.residual_mm_q8);
            kept++;
        }
    }
    rows->count = kept;
}
#endif
