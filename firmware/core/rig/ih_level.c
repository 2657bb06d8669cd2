#include "rig/ih_level.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "rig/ih_camera.h"

#define ONE_Q28 ((int64_t)1 << 28)
#define ONE_Q30 ((int64_t)1 << 30)
#define TAN_MAX_Q28 (IH_RIG_TAN_MAX * ONE_Q28)
/* The tilt that is taken out at most: sine and cosine of 45 degrees. */
#define TILT_SIN_Q30 759250125
#define TILT_COS_Q30 759250125
/* Nearer to the optical axis than 10 degrees the roll is uncertain: the sine of that. */
#define ASIDE_MIN_Q30 186453111
/* What is less deep than this in the other frame is out of view there. */
#define DEPTH_MIN_Q28 ((int64_t)1 << 25)

/* A vector below 2^31 in each of its axes, in the frame whose axes the rows are. */
static void rotate_vector(const int32_t rows_q30[3][3], const int32_t in[3], int64_t out[3])
{
    for (int row = 0; row < 3; row++) {
        int64_t sum = 0;
        for (int i = 0; i < 3; i++) {
            sum += (int64_t)rows_q30[row][i] * in[i];
        }
        out[row] = ih_shift_round(sum, 30);
    }
}

/* Sine or cosine. */
static int32_t fraction_q30(int64_t part, int64_t whole)
{
    return (int32_t)ih_div_round(part * ONE_Q30, whole);
}

static int64_t root_of_squares(int64_t a, int64_t b)
{
    return ih_isqrt_u64((uint64_t)(a * a + b * b));
}

/* Right and back lie in the picture, back away from up; the tilt turns back and the optical axis to down and forward. */
static void fill_rotation(struct ih_rig *rig, const int32_t up_q30[3], int64_t aside)
{
    const int64_t length = root_of_squares(aside, up_q30[2]);
    const int32_t roll_sine = fraction_q30(up_q30[0], aside);
    const int32_t roll_cosine = fraction_q30(-(int64_t)up_q30[1], aside);
    int32_t sine = fraction_q30(up_q30[2], length), cosine = fraction_q30(aside, length);
    if (cosine < TILT_COS_Q30) {
        sine = sine < 0 ? -TILT_SIN_Q30 : TILT_SIN_Q30;
        cosine = TILT_COS_Q30;
    }
    const int32_t right[3] = {roll_cosine, roll_sine, 0};
    const int32_t back[3] = {-roll_sine, roll_cosine, 0};
    for (int i = 0; i < 3; i++) {
        rig->level_q30[0][i] = right[i];
        rig->level_q30[1][i] = (int32_t)ih_mul_shift(cosine, back[i], 30);
        rig->level_q30[2][i] = (int32_t)ih_mul_shift(sine, back[i], 30);
    }
    rig->level_q30[1][2] = -sine;
    rig->level_q30[2][2] = cosine;
    for (int i = 0; i < 9; i++) {
        rig->level_back_q30[i % 3][i / 3] = rig->level_q30[i / 3][i % 3];
    }
}

enum ih_err ih_level_init(struct ih_rig *rig)
{
    static const int32_t level_q30[3] = {0, -(1 << 30), 0};
    const int32_t *up = rig->calibration.up_q30;
    if (up[0] == 0 && up[1] == 0 && up[2] == 0) {
        up = level_q30;
    }
    const int64_t aside = ih_rig_is_unit(up) ? root_of_squares(up[0], up[1]) : 0;
    if (aside < ASIDE_MIN_Q30) {
        return IH_ERR_UP;
    }
    rig->is_level = up[0] == 0 && up[2] == 0 && up[1] < 0;
    fill_rotation(rig, up, aside);
    int64_t origin[3];
    rotate_vector(rig->level_q30, rig->calibration.origin_mm_q16, origin);
    for (int axis = 0; axis < 3; axis++) {
        rig->level_origin_mm_q16[axis] = (int32_t)origin[axis];
    }
    return IH_OK;
}

static int32_t rotate_direction(const int32_t rows_q30[3][3], int32_t *x_q28, int32_t *y_q28)
{
    const int32_t in[3] = {*x_q28, *y_q28, (int32_t)ONE_Q28};
    int64_t out[3];
    int32_t slope_q28[2];
    rotate_vector(rows_q30, in, out);
    int64_t depth_q28 = out[2];
    for (int axis = 0; axis < 2; axis++) {
        const int64_t slope = ih_div_round(out[axis] * ONE_Q28, ih_max_s64(out[2], DEPTH_MIN_Q28));
        slope_q28[axis] = (int32_t)ih_clamp_s64(slope, TAN_MAX_Q28);
        depth_q28 = slope == slope_q28[axis] ? depth_q28 : 0;
    }
    *x_q28 = slope_q28[0];
    *y_q28 = slope_q28[1];
    return depth_q28 < DEPTH_MIN_Q28 ? 0 : (int32_t)depth_q28;
}

int32_t ih_level_rotate(const struct ih_rig *rig, int32_t *x_q28, int32_t *y_q28)
{
    return rig->is_level ? (int32_t)ONE_Q28 : rotate_direction(rig->level_q30, x_q28, y_q28);
}

int32_t ih_level_rotate_back(const struct ih_rig *rig, int32_t *x_q28, int32_t *y_q28)
{
    return rig->is_level ? (int32_t)ONE_Q28 : rotate_direction(rig->level_back_q30, x_q28, y_q28);
}

bool ih_level_ray(const struct ih_rig *rig, int32_t slot, int32_t *slope_x_q28,
                  int32_t *slope_y_q28)
{
    *slope_x_q28 = rig->line[slot].slope_x_q20 * (1 << 8);
    *slope_y_q28 = rig->line[slot].slope_y_q20 * (1 << 8);
    return ih_level_rotate(rig, slope_x_q28, slope_y_q28) > 0;
}

bool ih_level_dot_at(const struct ih_rig *rig, int32_t slot, int32_t depth_mm_q8, int32_t *x_q28,
                     int32_t *y_q28)
{
    if (rig->is_level) {
        ih_rig_dot_at(rig, slot, depth_mm_q8, x_q28, y_q28);
        return true;
    }
    int32_t tan_q28[2];
    const bool is_in_view = ih_level_ray(rig, slot, &tan_q28[0], &tan_q28[1]);
    *x_q28 = ih_rig_slope_at_q28(rig->level_origin_mm_q16, 0, tan_q28[0] * (int64_t)4, depth_mm_q8);
    *y_q28 = ih_rig_slope_at_q28(rig->level_origin_mm_q16, 1, tan_q28[1] * (int64_t)4, depth_mm_q8);
    return is_in_view;
}

bool ih_level_sees(const struct ih_rig *rig, int32_t x_q28, int32_t y_q28, int32_t *u_px_q12,
                   int32_t *v_px_q12)
{
    const bool is_in_view = ih_level_rotate_back(rig, &x_q28, &y_q28) > 0;
    ih_camera_distort(rig, x_q28, y_q28, u_px_q12, v_px_q12);
    return is_in_view && ih_camera_sees(rig, *u_px_q12, *v_px_q12);
}

void ih_level_point_back(const struct ih_rig *rig, int32_t point_mm_q8[3])
{
    int64_t out[3];
    if (rig->is_level) {
        return;
    }
    rotate_vector(rig->level_back_q30, point_mm_q8, out);
    for (int axis = 0; axis < 3; axis++) {
        point_mm_q8[axis] = (int32_t)out[axis];
    }
}

/* Pixels, along u and v, for a step along an axis of the level frame. u = fx X / Z + cx: along a unit vector e its slope is
 * fx (e_x - e_z X / Z) / Z. */
static void fill_steps(const struct ih_rig *rig, const struct ih_level_place *place,
                       int64_t step_px_q12[3][2])
{
    const int32_t focal_px_q16[2] = {rig->calibration.fx_px_q16, rig->calibration.fy_px_q16};
    int32_t at_q28[2] = {place->x_q28, place->y_q28};
    const int64_t depth_q28 =
        ih_max_s64(ih_level_rotate_back(rig, &at_q28[0], &at_q28[1]), DEPTH_MIN_Q28);
    for (int k = 0; k < 6; k++) {
        const int axis = k / 2, i = k % 2;
        const int32_t *e_q30 = rig->level_q30[axis];
        const int64_t across_q30 = e_q30[i] - ih_mul_shift(at_q28[i], e_q30[2], 28);
        const int64_t px_q16 =
            ih_div_round(ih_mul_shift(focal_px_q16[i], across_q30, 30) * ONE_Q28, depth_q28);
        const int64_t scaled = ih_mul_shift(place->step_q28[axis], px_q16, 32) * place->multiple;
        step_px_q12[axis][i] =
            ih_clamp_s64(ih_div_round(scaled, place->divisor), IH_RANGE_PX_PER_STEP_Q12);
    }
}

/* Semi-axis = 2 sqrt(variance); the variance in Q16 px^2 less drop bits, below 2^32. */
static int32_t semi_axis_px_q12(int64_t variance, int drop)
{
    uint64_t variance_q24 = variance > 0 ? (uint64_t)variance << (8 + drop) : 0;
    return ih_saturate_s32(2 * (int64_t)ih_isqrt_u64(variance_q24));
}

struct ih_level_ellipse ih_level_ellipse(const struct ih_rig *rig,
                                         const struct ih_level_place *place,
                                         const int32_t moment_q16[3][3])
{
    int64_t step_px_q12[3][2];
    int64_t px_q16[2][2] = {{0, 0}, {0, 0}}; /* uu, uv, -, vv */
    uint64_t all = 0;
    fill_steps(rig, place, step_px_q12);
    for (int k = 0; k < 4; k++) {
        for (int m = 0; m < 9; m++) {
            px_q16[k / 2][k % 2] +=
                ih_mul_shift(ih_mul_shift(moment_q16[m / 3][m % 3], step_px_q12[m / 3][k / 2], 12),
                             step_px_q12[m % 3][k % 2], 12);
        }
        all |= (uint64_t)ih_abs_s64(px_q16[k / 2][k % 2]);
    }
    /* Squares of the variances must fit: drop bits that a large ellipse does not need. */
    const int drop = ih_max_s32(0, ih_bits_u64(all) - 30);
    const int64_t uu = ih_shift_round(px_q16[0][0], drop);
    const int64_t uv = ih_shift_round(px_q16[0][1], drop);
    const int64_t vv = ih_shift_round(px_q16[1][1], drop);
    const int64_t half = (uu - vv) / 2;
    const int64_t root = ih_isqrt_u64((uint64_t)(half * half + uv * uv));
    const int32_t angle = (int32_t)ih_div_round(ih_atan2_mdeg(2 * uv, uu - vv), 2);
    return (struct ih_level_ellipse){
        .a_px_q12 = semi_axis_px_q12((uu + vv) / 2 + root, drop),
        .b_px_q12 = semi_axis_px_q12((uu + vv) / 2 - root, drop),
        .angle_mdeg = angle < 0 ? angle + 180000 : angle,
    };
}
