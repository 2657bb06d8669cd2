#include "rig/ih_rig.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "rig/ih_camera.h"
#include "rig/ih_level.h"

/* At this depth the middle dot is the centre of the surface: a person sits there. */
#define FIELD_DEPTH_MM 900
#define ONE_Q28 ((int64_t)1 << 28)
/* No camera sees rays that are steeper than this against its optical axis. */
#define RAY_FORWARD_MIN_Q30 (1 << 28)
#define UNIT_TOLERANCE_Q30 (1 << 16) /* 6e-5 */
#define HALF_PITCH_MIN_Q28 ((1 << 28) / 1000)

/* tan of the ray. */
static int64_t ray_tan_q30(const struct ih_calibration *c, int32_t slot, int axis)
{
    const int32_t *ray = c->ray_q30[slot];
    return ih_div_round((int64_t)ray[axis] * ((int64_t)1 << 30), ray[2]);
}

/* O - Oz r/rz: X/Z = tan + offset / Z. */
static int64_t offset_mm_q16(const int32_t origin_mm_q16[3], int axis, int64_t tan_q30)
{
    const int64_t offset = origin_mm_q16[axis] - ih_mul_shift(origin_mm_q16[2], tan_q30, 30);
    IH_IN_RANGE(offset, -IH_RANGE_OFFSET_MM_Q16, IH_RANGE_OFFSET_MM_Q16);
    return offset;
}

int32_t ih_rig_slope_at_q28(const int32_t origin_mm_q16[3], int axis, int64_t tan_q30,
                            int32_t depth_mm_q8)
{
    /* |offset| <= |O| + |Oz| |tan|: below 5000 mm = 2^28.3 in Q16, times 2^20; a quotient in
     * Q28. */
    const int64_t shift_q28 =
        ih_div_round(offset_mm_q16(origin_mm_q16, axis, tan_q30) * (1 << 20), depth_mm_q8);
    return (int32_t)ih_clamp_s64(ih_shift_round(tan_q30, 2) + shift_q28, IH_RIG_TAN_MAX * ONE_Q28);
}

void ih_rig_dot_at(const struct ih_rig *rig, int32_t slot, int32_t depth_mm_q8, int32_t *x_q28,
                   int32_t *y_q28)
{
    const struct ih_calibration *c = &rig->calibration;
    *x_q28 = ih_rig_slope_at_q28(c->origin_mm_q16, 0, ray_tan_q30(c, slot, 0), depth_mm_q8);
    *y_q28 = ih_rig_slope_at_q28(c->origin_mm_q16, 1, ray_tan_q30(c, slot, 1), depth_mm_q8);
}

bool ih_rig_is_unit(const int32_t vector_q30[3])
{
    int64_t length2_q58 = 0;
    for (int axis = 0; axis < 3; axis++) {
        int64_t part = ih_abs_s64(vector_q30[axis]) >> 1;
        length2_q58 += part * part; /* each below 2^60 */
    }
    int64_t length_q30 = 2 * (int64_t)ih_isqrt_u64((uint64_t)length2_q58);
    return ih_abs_s64(length_q30 - ((int64_t)1 << 30)) <= UNIT_TOLERANCE_Q30;
}

static enum ih_err check_projector(const struct ih_calibration *c, int32_t *bad_slot)
{
    for (int axis = 0; axis < 3; axis++) {
        if (ih_abs_s64(c->origin_mm_q16[axis]) > (int64_t)IH_RIG_BASELINE_MAX_MM << 16) {
            return IH_ERR_BASELINE;
        }
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (c->ray_q30[slot][2] < RAY_FORWARD_MIN_Q30 || !ih_rig_is_unit(c->ray_q30[slot])) {
            *bad_slot = slot;
            return IH_ERR_RAY;
        }
    }
    return IH_OK;
}

static int32_t shift_at_depth_px_q12(int32_t length_px_mm_q8, int32_t depth_mm)
{
    return (int32_t)ih_div_round((int64_t)length_px_mm_q8 << 4, depth_mm);
}

/* Direction cosines in Q30 to a slope; a dot's ray points forward, with z >= 1/4. */
static int32_t slope_q20(const int32_t ray_q30[3], int axis)
{
    return (int32_t)ih_div_round((int64_t)ray_q30[axis] * (1 << 20), ray_q30[2]);
}

/* False when the projector sits on the camera's centre, where the dot does not move with depth, or too far from it. */
static bool fill_line(struct ih_rig *rig, int32_t slot)
{
    const struct ih_calibration *c = &rig->calibration;
    struct ih_line *line = &rig->line[slot];
    const int64_t tan_q30[2] = {ray_tan_q30(c, slot, 0), ray_tan_q30(c, slot, 1)};

    line->slope_x_q20 = slope_q20(c->ray_q30[slot], 0);
    line->slope_y_q20 = slope_q20(c->ray_q30[slot], 1);

    /* tan below 4 in Q30, focal below 2^29 in Q16: products below 2^61. */
    line->infinity_u_px_q12 =
        (int32_t)(ih_mul_shift(tan_q30[0], c->fx_px_q16, 34) + ih_shift_round(c->cx_px_q16, 4));
    line->infinity_v_px_q12 =
        (int32_t)(ih_mul_shift(tan_q30[1], c->fy_px_q16, 34) + ih_shift_round(c->cy_px_q16, 4));

    /* e = focal * offset is below 2^13 px * 5000 mm = 2^26, and limited to 2^22, in Q8 2^30, so that its
     * square is below 2^60. */
    int64_t e_u_q8 = ih_mul_shift(c->fx_px_q16, offset_mm_q16(c->origin_mm_q16, 0, tan_q30[0]), 24);
    int64_t e_v_q8 = ih_mul_shift(c->fy_px_q16, offset_mm_q16(c->origin_mm_q16, 1, tan_q30[1]), 24);
    if (ih_abs_s64(e_u_q8) >= (int64_t)1 << 30 || ih_abs_s64(e_v_q8) >= (int64_t)1 << 30) {
        return false;
    }
    uint64_t length2_q16 = (uint64_t)(e_u_q8 * e_u_q8) + (uint64_t)(e_v_q8 * e_v_q8);
    int64_t length_q8 = ih_isqrt_u64(length2_q16);
    if (length_q8 < (int64_t)100 << 8) { /* 100 px mm: a tenth of a pixel at a metre */
        return false;
    }
    line->length_px_mm_q8 = (int32_t)length_q8;
    line->dir_u_q30 = (int32_t)ih_div_round(e_u_q8 * ((int64_t)1 << 30), length_q8);
    line->dir_v_q30 = (int32_t)ih_div_round(e_v_q8 * ((int64_t)1 << 30), length_q8);
    line->t_far_px_q12 = shift_at_depth_px_q12(line->length_px_mm_q8, c->far_mm);
    line->t_near_px_q12 = shift_at_depth_px_q12(line->length_px_mm_q8, c->near_mm);
    IH_IN_RANGE(line->infinity_u_px_q12, -IH_RANGE_INFINITY_PX_Q12, IH_RANGE_INFINITY_PX_Q12);
    IH_IN_RANGE(line->infinity_v_px_q12, -IH_RANGE_INFINITY_PX_Q12, IH_RANGE_INFINITY_PX_Q12);
    IH_IN_RANGE(length_q8, IH_RANGE_LENGTH_MIN_PX_MM_Q8, IH_RANGE_LENGTH_MAX_PX_MM_Q8);
    IH_IN_RANGE(line->t_near_px_q12, line->t_far_px_q12, IH_RANGE_T_PX_Q12);
    return true;
}

/* w x v; both below 2^30.1. */
static void cross_q30(const int32_t w_q30[3], const int32_t v_q30[3], int32_t out_q30[3])
{
    for (int axis = 0; axis < 3; axis++) {
        const int next = (axis + 1) % 3;
        const int last = (axis + 2) % 3;
        out_q30[axis] = (int32_t)ih_shift_round(
            (int64_t)w_q30[next] * v_q30[last] - (int64_t)w_q30[last] * v_q30[next], 30);
    }
}

/* Mean distance of the pattern's columns and rows in normalised coordinates, halved: the unit. */
static int32_t half_pitch_q28(const struct ih_rig *rig, bool is_level_frame, int32_t depth_mm_q8)
{
    const int32_t ends[4][2] = {{0, IH_GRID - 1},
                                {IH_SLOTS - IH_GRID, IH_SLOTS - 1},
                                {0, IH_SLOTS - IH_GRID},
                                {IH_GRID - 1, IH_SLOTS - 1}};
    int64_t sum_q28 = 0;
    for (int i = 0; i < 4; i++) {
        int32_t x[2], y[2];
        for (int k = 0; k < 2; k++) {
            if (is_level_frame) {
                (void)ih_level_dot_at(rig, ends[i][k], depth_mm_q8, &x[k], &y[k]);
            } else {
                ih_rig_dot_at(rig, ends[i][k], depth_mm_q8, &x[k], &y[k]);
            }
        }
        int64_t dx = x[1] - (int64_t)x[0];
        int64_t dy = y[1] - (int64_t)y[0];
        sum_q28 += ih_isqrt_u64((uint64_t)(dx * dx) + (uint64_t)(dy * dy));
    }
    return (int32_t)ih_div_round(sum_q28, 4 * (IH_GRID - 1) * 2);
}

/* False, and all as it was, when dots are closer than 2 mrad: not a 19x19 pattern. The level frame's are when a tilted
 * camera's pattern leaves its view. */
static bool fill_field(struct ih_rig *rig)
{
    const struct ih_calibration *c = &rig->calibration;
    const int32_t depth_q8 = ih_clamp_s32(FIELD_DEPTH_MM, c->near_mm, c->far_mm) << 8;
    const int32_t half_q28 = half_pitch_q28(rig, false, depth_q8);
    const int32_t unit_q28 = half_pitch_q28(rig, true, depth_q8);
    if (ih_min_s32(half_q28, unit_q28) < HALF_PITCH_MIN_Q28) {
        return false;
    }
    rig->half_pitch_q28 = half_q28;
    rig->field.unit_q28 = unit_q28;
    (void)ih_level_dot_at(rig, IH_SLOTS / 2, depth_q8, &rig->field.centre_x_q28,
                          &rig->field.centre_y_q28);
    IH_IN_RANGE(rig->field.unit_q28, HALF_PITCH_MIN_Q28, IH_RANGE_UNIT_Q28);
    return true;
}

enum ih_err ih_rig_init(struct ih_rig *rig, const struct ih_calibration *calibration,
                        int32_t *bad_slot)
{
    *bad_slot = IH_NONE;
    *rig = (struct ih_rig){0};
    rig->calibration = *calibration;
    enum ih_err err = ih_camera_init(rig);
    if (err == IH_OK) {
        err = ih_level_init(rig);
    }
    if (err != IH_OK || calibration->kind == IH_RIG_RANGE) {
        return err;
    }
    err = check_projector(calibration, bad_slot);
    if (err != IH_OK) {
        return err;
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (!fill_line(rig, slot)) {
            *bad_slot = slot;
            return IH_ERR_BASELINE;
        }
    }
    return fill_field(rig) ? IH_OK : IH_ERR_RAY;
}

/* To second order; the third is below 2e-5 of a ray's length. */
void ih_rig_move(struct ih_rig *rig, const int32_t ray_q30[IH_SLOTS][3],
                 const struct ih_rig_motion *motion)
{
    rig->focal_q30 = motion->focal_q30;
    memcpy(rig->shift_px_q12, motion->shift_px_q12, sizeof rig->shift_px_q12);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_line before = rig->line[slot];
        int32_t *ray = rig->calibration.ray_q30[slot];
        const int32_t ray_before[3] = {ray[0], ray[1], ray[2]};
        int32_t first_q30[3], second_q30[3];
        cross_q30(motion->rotation_rad_q30, ray_q30[slot], first_q30);
        cross_q30(motion->rotation_rad_q30, first_q30, second_q30);
        for (int axis = 0; axis < 3; axis++) {
            ray[axis] = ray_q30[slot][axis] + first_q30[axis] +
                        (int32_t)ih_shift_round(second_q30[axis], 1);
        }
        if (ray[2] < RAY_FORWARD_MIN_Q30 || !fill_line(rig, slot)) {
            rig->line[slot] = before;
            memcpy(ray, ray_before, sizeof ray_before);
        }
    }
    (void)fill_field(rig);
}
