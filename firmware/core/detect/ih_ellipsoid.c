#include "detect/ih_ellipsoid.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "detect/ih_ellipsoid_distance.h"
#include "detect/ih_head_model.h"

#define REACH_Q14 (IH_ELLIPSOID_REACH << 14)

struct ih_ellipsoid ih_ellipsoid_mean(const int32_t centre_mm_q8[3])
{
    return (struct ih_ellipsoid){
        .centre_mm_q8 = {centre_mm_q8[0], centre_mm_q8[1], centre_mm_q8[2]},
        .semi_mm_q8 = {IH_HEAD_SEMI_X_MM << 8, IH_HEAD_SEMI_Y_MM << 8, IH_HEAD_SEMI_Z_MM << 8},
    };
}

/* Room for the errors of radius2 and the box's own rounding: 2^-6, and two steps. */
#define BOX_RADIUS2_Q14 (1 << 8)
#define BOX_MM_Q8 2

struct ih_ellipsoid_box ih_ellipsoid_box(const struct ih_ellipsoid *ellipsoid,
                                         const int32_t slope_max_q20[2], int32_t radius2_q14)
{
    uint64_t sum_q14 = 1 << 14; /* 1 + g.g; g is at most 20 on each axis */
    for (int axis = 0; axis < 2; axis++) {
        int64_t g_q14 =
            ih_div_round(ih_shift_round((int64_t)slope_max_q20[axis] * ellipsoid->semi_mm_q8[2], 6),
                         ellipsoid->semi_mm_q8[axis]);
        sum_q14 += (uint64_t)(g_q14 * g_q14 >> 14) + 1;
    }
    int64_t max_q14 =
        (int64_t)ih_isqrt_u64((uint64_t)(radius2_q14 + BOX_RADIUS2_Q14) * sum_q14) + 1;
    struct ih_ellipsoid_box box;
    for (int axis = 0; axis < 2; axis++) {
        int64_t half_q8 = ih_mul_shift(max_q14, ellipsoid->semi_mm_q8[axis], 14);
        box.half_mm_q8[axis] = (int32_t)half_q8 + BOX_MM_Q8;
    }
    return box;
}

static bool in_reach(int64_t position_q14)
{
    return ih_abs_s64(position_q14) <= REACH_Q14;
}

struct ih_aim ih_ellipsoid_aim(const int32_t semi_mm_q8[3], const struct ih_fractions *fractions,
                               const struct ih_ray *ray)
{
    const int32_t slope_q20[2] = {ray->slope_x_q20, ray->slope_y_q20};
    struct ih_aim aim = {.gg_q28 = (int64_t)1 << 28};
    for (int axis = 0; axis < 2; axis++) {
        /* deep over this semi-axis, at most 5: no division for a ray */
        const int32_t ratio_q24 = (int32_t)(semi_mm_q8[2] * fractions->inverse_q50[axis] >> 26);
        aim.g_q14[axis] = (int32_t)ih_mul_shift(slope_q20[axis], ratio_q24, 30);
        aim.gg_q28 += (int64_t)aim.g_q14[axis] * aim.g_q14[axis];
    }
    return aim;
}

bool ih_ellipsoid_cross(const struct ih_ellipsoid *ellipsoid, const struct ih_fractions *fractions,
                        const int32_t origin_mm_q8[3], const struct ih_ray *ray,
                        const struct ih_aim *aim, struct ih_crossing *out)
{
    const int32_t slope_q20[2] = {ray->slope_x_q20, ray->slope_y_q20};
    const int64_t g_q14[2] = {aim->g_q14[0], aim->g_q14[1]};
    const int64_t gg_q28 = aim->gg_q28;
    int64_t depth_q8 = (int64_t)ellipsoid->centre_mm_q8[2] - origin_mm_q8[2];
    int32_t deep_q8 = ellipsoid->semi_mm_q8[2];
    int64_t e_q14[2];
    for (int axis = 0; axis < 2; axis++) {
        int64_t offset_q8 = origin_mm_q8[axis] + ih_mul_shift(depth_q8, slope_q20[axis], 20) -
                            ellipsoid->centre_mm_q8[axis];
        if (ih_abs_s64(offset_q8) > IH_FRACTION_MAX) {
            return false;
        }
        e_q14[axis] = ih_fraction(fractions->inverse_q50[axis], (int32_t)offset_q8);
        if (!in_reach(e_q14[axis])) {
            return false;
        }
    }
    int64_t eg_q28 = e_q14[0] * g_q14[0] + e_q14[1] * g_q14[1];
    int64_t ee_q28 = e_q14[0] * e_q14[0] + e_q14[1] * e_q14[1];
    int64_t tau_q14 = -ih_div_round(eg_q28 * (1 << 14), gg_q28);
    int64_t radius2_q28 = ee_q28 + ih_mul_shift(eg_q28, tau_q14, 14);
    radius2_q28 = radius2_q28 < 0 ? 0 : radius2_q28;
    for (int axis = 0; axis < 2; axis++) {
        out->nearest_q14[axis] = (int32_t)(e_q14[axis] + ih_mul_shift(g_q14[axis], tau_q14, 14));
        IH_IN_RANGE(ellipsoid->semi_mm_q8[axis], IH_ELLIPSOID_SEMI_MIN_MM << 8,
                    IH_ELLIPSOID_SEMI_MAX_MM << 8);
        IH_IN_RANGE(out->nearest_q14[axis], -IH_RANGE_PASS_Q14, IH_RANGE_PASS_Q14);
    }
    out->nearest_q14[2] = (int32_t)tau_q14;
    out->radius2_q14 = (int32_t)ih_shift_round(radius2_q28, 14);
    int64_t enter_q14 = tau_q14;
    int64_t inside_q28 = ((int64_t)1 << 28) - radius2_q28;
    if (inside_q28 > 0) {
        enter_q14 -=
            ih_isqrt_u32((uint32_t)ih_div_round(inside_q28 * (1 << 28), gg_q28)); /* 2^28 */
    }
    out->entry_mm_q8 = ellipsoid->centre_mm_q8[2] + (int32_t)ih_mul_shift(enter_q14, deep_q8, 14);
    return true;
}

struct ih_fractions ih_ellipsoid_fractions(const int32_t semi_mm_q8[3])
{
    struct ih_fractions fractions;
    for (int axis = 0; axis < 3; axis++) {
        fractions.inverse_q50[axis] = ((int64_t)1 << 50) / semi_mm_q8[axis] + 1;
    }
    return fractions;
}

bool ih_ellipsoid_position(const struct ih_ellipsoid *ellipsoid,
                           const struct ih_fractions *fractions, const int32_t point_mm_q8[3],
                           int32_t position_q14[3])
{
    for (int axis = 0; axis < 3; axis++) {
        const int64_t offset_q8 = (int64_t)point_mm_q8[axis] - ellipsoid->centre_mm_q8[axis];
        if (ih_abs_s64(offset_q8) > IH_FRACTION_MAX) {
            return false;
        }
        position_q14[axis] = ih_fraction(fractions->inverse_q50[axis], (int32_t)offset_q8);
        if (!in_reach(position_q14[axis])) {
            return false;
        }
    }
    return true;
}

bool ih_ellipsoid_gradient(const struct ih_inverses *inverses, const int32_t position_q14[3],
                           int32_t component_q14[3], struct ih_distance *out)
{
    const uint32_t length2_q22 = ih_gradient_q22(inverses, position_q14, component_q14);
    return ih_distance_of(ih_radius2_q22(position_q14), length2_q22, out);
}

bool ih_ellipsoid_distance(const struct ih_fractions *fractions, const int32_t position_q14[3],
                           int32_t *distance_mm_q8)
{
    const struct ih_inverses inverses = ih_inverses_of(fractions);
    int32_t component_q14[3];
    struct ih_distance distance;
    if (!ih_ellipsoid_gradient(&inverses, position_q14, component_q14, &distance)) {
        return false;
    }
    *distance_mm_q8 = distance.residual_mm_q8;
    return true;
}
