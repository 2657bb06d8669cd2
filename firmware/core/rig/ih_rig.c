#include "rig/ih_rig.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"

/* Depth in whose place the middle dot marks the middle of the surface: where a person sits. */
#define FIELD_DEPTH_MM 900
#define ONE_Q28 ((int64_t)1 << 28)
/* Enough for a lens whose iteration gains only a third a step; usual ones need five. */
#define UNDISTORT_STEPS 64
#define BROWN_MAX 16
#define RADIAL_MIN_Q28 (ONE_Q28 / 8)
#define NEWTON_STEPS 5
#define NEWTON_MAX_Q28 (1 << 25)
/* A step no longer than this is the last one: what it leaves is what the slopes are off, of usual lenses a hundredth
 * of it. Where that is too much, and where slopes are far off, one that need not be right at all. */
#define NEWTON_LAST_Q28 (1 << 14)
#define NEWTON_LAST_SHORT_Q28 (1 << 9)
/* Probes of the lens along each side of the frame, and how well they must come back. */
#define LENS_PROBES 65
#define LENS_ERROR_MAX_PX_Q12 20 /* 0.005 px */
#define LENS_ERROR_FEW_PX_Q12 2  /* what is rounded alone is 1 */
/* Rays steeper than this against the optical axis are no camera's business. */
#define RAY_FORWARD_MIN_Q30 (1 << 28)
#define RAY_LENGTH_TOLERANCE_Q30 (1 << 16) /* 6e-5 */

static int64_t product_q28(int32_t a_q28, int32_t b_q28)
{
    return ih_mul_shift(a_q28, b_q28, 28);
}

static int64_t clamp_brown_q28(int64_t value_q28)
{
    int64_t limit = BROWN_MAX * ONE_Q28;
    return value_q28 > limit ? limit : value_q28 < -limit ? -limit : value_q28;
}

/* What is not radial, of x^2, y^2 and x y. */
static void across(const struct ih_calibration *c, int64_t xx, int64_t yy, int64_t xy,
                   int64_t *dx_q28, int64_t *dy_q28)
{
    const int64_t r2 = xx + yy;
    /* 2 xy <= 8; (r2 + 2 xx) / 2 <= 8 */
    *dx_q28 = clamp_brown_q28(ih_mul_shift(2 * xy, c->p1_q24, 24) +
                              ih_mul_shift(r2 / 2 + xx, c->p2_q24, 23));
    *dy_q28 = clamp_brown_q28(ih_mul_shift(r2 / 2 + yy, c->p1_q24, 23) +
                              ih_mul_shift(2 * xy, c->p2_q24, 24));
}

/* What is radial, of the square of the radius. */
static int64_t radial_at(const struct ih_calibration *c, uint32_t r2_q28)
{
    const int64_t r2 = r2_q28;
    const int64_t r4_q25 = ih_mul_shift(r2, r2, 31);
    const int64_t r6_q22 = ih_mul_shift(r4_q25, r2, 31);
    return clamp_brown_q28(ONE_Q28 + ih_mul_shift(r2, c->k1_q24, 24) +
                           ih_mul_shift(r4_q25, c->k2_q24, 21) +
                           ih_mul_shift(r6_q22, c->k3_q24, 18));
}

/* OpenCV's Brown model. |x|, |y| <= 2, so r2 <= 8 = 2^31 in Q28, r4 <= 64 = 2^31 in Q25 and
 * r6 <= 512 = 2^31 in Q22: times a coefficient in int32 each stays below 2^62. A lens that needs
 * more than BROWN_MAX anywhere is limited to it, and then does not come back in check_lens. */
static void brown(const struct ih_calibration *c, int32_t x_q28, int32_t y_q28, int64_t *radial_q28,
                  int64_t *dx_q28, int64_t *dy_q28)
{
    const int64_t xx = product_q28(x_q28, x_q28);
    const int64_t yy = product_q28(y_q28, y_q28);
    *radial_q28 = radial_at(c, (uint32_t)(xx + yy));
    across(c, xx, yy, product_q28(x_q28, y_q28), dx_q28, dy_q28);
}

static int32_t limit_tan_q28(int64_t value_q28)
{
    int64_t limit = IH_RIG_TAN_MAX * ONE_Q28;
    return (int32_t)(value_q28 > limit ? limit : value_q28 < -limit ? -limit : value_q28);
}

/* A pixel to the lens's own, distorted coordinate. Pixels beyond +-16384 are limited: in Q16 below
 * 2^32, times 2^28. */
static int32_t distorted_q28(int32_t px_q12, int32_t principal_px_q16, int32_t focal_px_q16)
{
    int64_t px_q16 = (int64_t)ih_clamp_s32(px_q12, -(1 << 26), 1 << 26) * 16;
    return limit_tan_q28(ih_div_round((px_q16 - principal_px_q16) * ONE_Q28, focal_px_q16));
}

/* Fixed-point iteration x <- (xd - dx(x)) / radial(x); each step gains a factor of about the distortion
 * itself. It stops when nothing moves any more. */
static void undistort_slowly(const struct ih_calibration *c, int32_t xd, int32_t yd, int32_t *x_q28,
                             int32_t *y_q28)
{
    int32_t x = xd;
    int32_t y = yd;
    for (int i = 0; i < UNDISTORT_STEPS; i++) {
        int64_t radial, dx, dy;
        brown(c, x, y, &radial, &dx, &dy);
        radial = radial < RADIAL_MIN_Q28 ? RADIAL_MIN_Q28 : radial;
        const int32_t next_x = limit_tan_q28(ih_div_round((xd - dx) * ONE_Q28, radial));
        const int32_t next_y = limit_tan_q28(ih_div_round((yd - dy) * ONE_Q28, radial));
        const bool still = next_x == x && next_y == y;
        x = next_x;
        y = next_y;
        if (still) {
            break;
        }
    }
    *x_q28 = x;
    *y_q28 = y;
}

/* The lens backwards, radially: a place that is seen at r2 was at scale times that; rise: of the scale, by r2. */
struct backwards {
    int32_t scale_q28, rise_q28;
};

static struct backwards backwards_at(const int32_t back_q24[3], int32_t r2_q28)
{
    const int32_t cubic = (int32_t)product_q28(back_q24[2], r2_q28); /* below 2^30 */
    const int64_t square = product_q28(back_q24[1] + cubic, r2_q28);
    const int32_t all = ih_saturate_s32(back_q24[0] + square);
    const int64_t rise_q24 = back_q24[0] + 2 * square + product_q28(cubic, r2_q28);
    return (struct backwards){
        .scale_q28 = ih_saturate_s32(ONE_Q28 + ih_mul_shift(all, r2_q28, 24)),
        .rise_q28 = ih_saturate_s32(rise_q24 * 16),
    };
}

/* Newton's steps from where the series says, less what is not radial, with the series' slopes: scale, and twice
 * its rise along the radius. One is usual; what is left of a step is what the slopes are off, at the
 * corners of usual lenses a hundredth. False when no step is small, as where the lens folds the picture. */
static bool undistort_quickly(const struct ih_rig *rig, int32_t xd, int32_t yd, int32_t *x_q28,
                              int32_t *y_q28)
{
    const int64_t xx = product_q28(xd, xd);
    const int64_t yy = product_q28(yd, yd);
    const struct backwards back = backwards_at(rig->back_q24, ih_saturate_s32(xx + yy));
    int64_t radial, dx, dy;
    across(&rig->calibration, xx, yy, product_q28(xd, yd), &dx, &dy);
    int32_t x = limit_tan_q28(product_q28(limit_tan_q28(xd - dx), back.scale_q28));
    int32_t y = limit_tan_q28(product_q28(limit_tan_q28(yd - dy), back.scale_q28));
    for (int i = 0; i < rig->newton_steps; i++) {
        brown(&rig->calibration, x, y, &radial, &dx, &dy);
        const int64_t off_x = xd - dx - ih_mul_shift(x, radial, 28);
        const int64_t off_y = yd - dy - ih_mul_shift(y, radial, 28);
        if (radial < RADIAL_MIN_Q28 ||
            ih_max_s64(ih_abs_s64(off_x), ih_abs_s64(off_y)) > NEWTON_MAX_Q28) {
            return false;
        }
        const int64_t out = 2 * (product_q28(xd, (int32_t)off_x) + product_q28(yd, (int32_t)off_y));
        const int32_t risen = ih_saturate_s32(product_q28((int32_t)out, back.rise_q28));
        const int64_t step_x = product_q28((int32_t)off_x, back.scale_q28) + product_q28(risen, xd);
        const int64_t step_y = product_q28((int32_t)off_y, back.scale_q28) + product_q28(risen, yd);
        x = limit_tan_q28(x + step_x);
        y = limit_tan_q28(y + step_y);
        /* Where the series' slope is 0, as of lenses that pull the corners out, no step is a long one. */
        if (ih_max_s64(ih_abs_s64(step_x), ih_abs_s64(step_y)) < rig->newton_last_q28 &&
            ih_max_s64(ih_abs_s64(off_x), ih_abs_s64(off_y)) < 2 * rig->newton_last_q28) {
            *x_q28 = x;
            *y_q28 = y;
            return true;
        }
    }
    return false;
}

void ih_rig_undistort(const struct ih_rig *rig, int32_t u_px_q12, int32_t v_px_q12, int32_t *x_q28,
                      int32_t *y_q28)
{
    const struct ih_calibration *c = &rig->calibration;
    const int32_t xd = distorted_q28(u_px_q12, c->cx_px_q16, c->fx_px_q16);
    const int32_t yd = distorted_q28(v_px_q12, c->cy_px_q16, c->fy_px_q16);
    if (!undistort_quickly(rig, xd, yd, x_q28, y_q28)) {
        undistort_slowly(c, xd, yd, x_q28, y_q28);
    }
}

/* The series of the radial part backwards: r = rd (1 + b0 rd^2 + b1 rd^4 + b2 rd^6). A lens so strong that it
 * does not fit starts from where it is seen. */
static void fill_back(struct ih_rig *rig)
{
    const int64_t max = (int64_t)8 << 24;
    const int64_t k1 = rig->calibration.k1_q24;
    const int64_t k2 = rig->calibration.k2_q24;
    if (ih_abs_s64(k1) > 1 << 24 || ih_abs_s64(k2) > 1 << 24) {
        return;
    }
    const int64_t k1k1 = ih_mul_shift(k1, k1, 24);
    rig->back_q24[0] = (int32_t)-k1;
    rig->back_q24[1] = (int32_t)(3 * k1k1 - k2);
    rig->back_q24[2] = (int32_t)ih_clamp_s64(
        ih_mul_shift(k1, 8 * k2 - 12 * k1k1, 24) - rig->calibration.k3_q24, max);
}

void ih_rig_to_pixel(const struct ih_rig *rig, int32_t x_q28, int32_t y_q28, int32_t *u_px_q12,
                     int32_t *v_px_q12)
{
    const struct ih_calibration *c = &rig->calibration;
    *u_px_q12 = (int32_t)(ih_mul_shift(x_q28, c->fx_px_q16, 32) + ih_shift_round(c->cx_px_q16, 4));
    *v_px_q12 = (int32_t)(ih_mul_shift(y_q28, c->fy_px_q16, 32) + ih_shift_round(c->cy_px_q16, 4));
    IH_IN_RANGE(*u_px_q12, -IH_RANGE_PLACE_PX_Q12, IH_RANGE_PLACE_PX_Q12);
    IH_IN_RANGE(*v_px_q12, -IH_RANGE_PLACE_PX_Q12, IH_RANGE_PLACE_PX_Q12);
}

void ih_rig_distort(const struct ih_rig *rig, int32_t x_q28, int32_t y_q28, int32_t *u_px_q12,
                    int32_t *v_px_q12)
{
    const struct ih_calibration *c = &rig->calibration;
    const int32_t x = limit_tan_q28(x_q28);
    const int32_t y = limit_tan_q28(y_q28);
    int64_t radial, dx, dy;
    brown(c, x, y, &radial, &dx, &dy);
    /* Far outside the frame a strong lens can go anywhere: keep the result in the format. */
    ih_rig_to_pixel(rig, limit_tan_q28(ih_mul_shift(x, radial, 28) + dx),
                    limit_tan_q28(ih_mul_shift(y, radial, 28) + dy), u_px_q12, v_px_q12);
}

bool ih_rig_inside(const struct ih_rig *rig, int32_t u_px_q12, int32_t v_px_q12)
{
    const struct ih_calibration *c = &rig->calibration;
    return u_px_q12 >= 0 && v_px_q12 >= 0 && u_px_q12 <= (c->width - 1) * 4096 &&
           v_px_q12 <= (c->height - 1) * 4096;
}

/* tan of the ray and its offset O - Oz r/rz: X/Z = tan + offset / Z. */
static void ray_line(const struct ih_calibration *c, int32_t slot, int axis, int64_t *tan_q30,
                     int64_t *offset_mm_q16)
{
    const int32_t *ray = c->ray_q30[slot];
    *tan_q30 = ih_div_round((int64_t)ray[axis] * ((int64_t)1 << 30), ray[2]);
    *offset_mm_q16 = c->origin_mm_q16[axis] - ih_mul_shift(c->origin_mm_q16[2], *tan_q30, 30);
    IH_IN_RANGE(*offset_mm_q16, -IH_RANGE_OFFSET_MM_Q16, IH_RANGE_OFFSET_MM_Q16);
}

void ih_rig_dot_at(const struct ih_rig *rig, int32_t slot, int32_t depth_mm_q8, int32_t *x_q28,
                   int32_t *y_q28)
{
    int32_t *out[2] = {x_q28, y_q28};
    for (int axis = 0; axis < 2; axis++) {
        int64_t tan_q30, offset_mm_q16;
        ray_line(&rig->calibration, slot, axis, &tan_q30, &offset_mm_q16);
        /* |offset| <= |O| + |Oz| |tan|: below 5000 mm = 2^28.3 in Q16, times 2^20; a quotient in
         * Q28. */
        int64_t shift_q28 = ih_div_round(offset_mm_q16 * (1 << 20), depth_mm_q8);
        *out[axis] = limit_tan_q28(ih_shift_round(tan_q30, 2) + shift_q28);
    }
}

/* Are both ends of a side within the widest angle? The principal point itself may lie outside the
 * frame: a range image may be cropped. */
static bool side_in_view(int32_t side_px, int32_t principal_px_q16, int32_t focal_px_q16)
{
    int64_t limit_q16 = (int64_t)IH_RIG_TAN_MAX * focal_px_q16;
    return principal_px_q16 <= limit_q16 &&
           (int64_t)side_px * 65536 - principal_px_q16 <= limit_q16;
}

static enum ih_err check_camera(const struct ih_calibration *c)
{
    bool range = c->kind == IH_RIG_RANGE;
    if (!range && c->kind != IH_RIG_DOTS) {
        return IH_ERR_KIND;
    }
    if (c->width > IH_FRAME_WIDTH_MAX ||
        c->height > (range ? IH_FRAME_WIDTH_MAX : IH_FRAME_HEIGHT_MAX) ||
        c->width < (range ? IH_RANGE_SIDE_MIN : IH_FRAME_WIDTH_MIN) ||
        c->height < (range ? IH_RANGE_SIDE_MIN : IH_FRAME_HEIGHT_MIN)) {
        return IH_ERR_SIZE;
    }
    int32_t focal_max = IH_RIG_FOCAL_MAX_PX << 16;
    if (c->fx_px_q16 <= 0 || c->fy_px_q16 <= 0 || c->fx_px_q16 > focal_max ||
        c->fy_px_q16 > focal_max) {
        return IH_ERR_FOCAL;
    }
    if (!side_in_view(c->width, c->cx_px_q16, c->fx_px_q16) ||
        !side_in_view(c->height, c->cy_px_q16, c->fy_px_q16)) {
        return IH_ERR_PRINCIPAL;
    }
    if (c->near_mm < IH_DEPTH_MIN_MM || c->far_mm > IH_DEPTH_MAX_MM || c->near_mm >= c->far_mm) {
        return IH_ERR_RANGE;
    }
    return IH_OK;
}

/* Undistort and distort again over the whole frame: does it come back? */
static bool comes_back(const struct ih_rig *rig, int32_t error_max_px_q12)
{
    const struct ih_calibration *c = &rig->calibration;
    for (int32_t row = 0; row < LENS_PROBES; row++) {
        for (int32_t column = 0; column < LENS_PROBES; column++) {
            int32_t u = (c->width - 1) * 4096 / (LENS_PROBES - 1) * column;
            int32_t v = (c->height - 1) * 4096 / (LENS_PROBES - 1) * row;
            int32_t x, y, back_u, back_v;
            ih_rig_undistort(rig, u, v, &x, &y);
            ih_rig_distort(rig, x, y, &back_u, &back_v);
            if (ih_abs_s32(back_u - u) > error_max_px_q12 ||
                ih_abs_s32(back_v - v) > error_max_px_q12) {
                return false;
            }
        }
    }
    return true;
}

/* What does not come back cannot be measured. Where a great k3 makes steps of r^6 in Q22 longer than the probes may
 * miss, as with long focal lengths, Newton's steps stop beside what distorts to the pixel, and the slow way does not. */
static enum ih_err check_lens(struct ih_rig *rig)
{
    rig->newton_steps = NEWTON_STEPS;
    rig->newton_last_q28 = NEWTON_LAST_Q28;
    if (comes_back(rig, LENS_ERROR_FEW_PX_Q12)) {
        return IH_OK;
    }
    rig->newton_last_q28 = NEWTON_LAST_SHORT_Q28;
    if (comes_back(rig, LENS_ERROR_MAX_PX_Q12)) {
        return IH_OK;
    }
    rig->newton_steps = 0;
    return comes_back(rig, LENS_ERROR_MAX_PX_Q12) ? IH_OK : IH_ERR_DISTORTION;
}

static enum ih_err check_projector(const struct ih_calibration *c, int32_t *bad_slot)
{
    for (int axis = 0; axis < 3; axis++) {
        if (ih_abs_s64(c->origin_mm_q16[axis]) > (int64_t)IH_RIG_BASELINE_MAX_MM << 16) {
            return IH_ERR_BASELINE;
        }
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int32_t *ray = c->ray_q30[slot];
        int64_t length2_q58 = 0;
        for (int axis = 0; axis < 3; axis++) {
            int64_t part = ih_abs_s64(ray[axis]) >> 1;
            length2_q58 += part * part; /* each below 2^60 */
        }
        int64_t length_q30 = 2 * (int64_t)ih_isqrt_u64((uint64_t)length2_q58);
        if (ray[2] < RAY_FORWARD_MIN_Q30 ||
            ih_abs_s64(length_q30 - ((int64_t)1 << 30)) > RAY_LENGTH_TOLERANCE_Q30) {
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

/* Direction cosines in Q30 to a slope; a dot's ray points forward, its z is a quarter at least. */
static int32_t slope_q20(const int32_t ray_q30[3], int axis)
{
    return (int32_t)ih_div_round((int64_t)ray_q30[axis] * (1 << 20), ray_q30[2]);
}

/* False when the projector sits on the camera's centre: the dot does not move with depth. */
static bool fill_line(struct ih_rig *rig, int32_t slot)
{
    const struct ih_calibration *c = &rig->calibration;
    struct ih_line *line = &rig->line[slot];
    int64_t tan_q30[2], offset_mm_q16[2];
    ray_line(c, slot, 0, &tan_q30[0], &offset_mm_q16[0]);
    ray_line(c, slot, 1, &tan_q30[1], &offset_mm_q16[1]);

    line->slope_x_q20 = slope_q20(c->ray_q30[slot], 0);
    line->slope_y_q20 = slope_q20(c->ray_q30[slot], 1);

    /* tan below 4 in Q30, focal below 2^29 in Q16: products below 2^61. */
    line->infinity_u_px_q12 =
        (int32_t)(ih_mul_shift(tan_q30[0], c->fx_px_q16, 34) + ih_shift_round(c->cx_px_q16, 4));
    line->infinity_v_px_q12 =
        (int32_t)(ih_mul_shift(tan_q30[1], c->fy_px_q16, 34) + ih_shift_round(c->cy_px_q16, 4));

    /* e = focal * offset: below 2^13 px * 5000 mm = 2^26; in Q8, its square below 2^69: use Q4 less
     * for the length's square and take the root in Q8 from Q16. */
    int64_t e_u_q8 = ih_mul_shift(c->fx_px_q16, offset_mm_q16[0], 24);
    int64_t e_v_q8 = ih_mul_shift(c->fy_px_q16, offset_mm_q16[1], 24);
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

/* Mean distance of the pattern's columns and rows in normalised coordinates, halved: the unit. */
static void fill_field(struct ih_rig *rig)
{
    const struct ih_calibration *c = &rig->calibration;
    const int32_t ends[4][2] = {{0, IH_GRID - 1},
                                {IH_SLOTS - IH_GRID, IH_SLOTS - 1},
                                {0, IH_SLOTS - IH_GRID},
                                {IH_GRID - 1, IH_SLOTS - 1}};
    int32_t depth_q8 = ih_clamp_s32(FIELD_DEPTH_MM, c->near_mm, c->far_mm) << 8;
    int64_t sum_q28 = 0;
    for (int i = 0; i < 4; i++) {
        int32_t x0, y0, x1, y1;
        ih_rig_dot_at(rig, ends[i][0], depth_q8, &x0, &y0);
        ih_rig_dot_at(rig, ends[i][1], depth_q8, &x1, &y1);
        int64_t dx = x1 - (int64_t)x0;
        int64_t dy = y1 - (int64_t)y0;
        sum_q28 += ih_isqrt_u64((uint64_t)(dx * dx) + (uint64_t)(dy * dy));
    }
    ih_rig_dot_at(rig, IH_SLOTS / 2, depth_q8, &rig->field.centre_x_q28, &rig->field.centre_y_q28);
    rig->field.unit_q28 = (int32_t)ih_div_round(sum_q28, 4 * (IH_GRID - 1) * 2);
    IH_IN_RANGE(rig->field.unit_q28, 0, IH_RANGE_UNIT_Q28);
}

enum ih_err ih_rig_init(struct ih_rig *rig, const struct ih_calibration *calibration,
                        int32_t *bad_slot)
{
    *bad_slot = IH_NONE;
    *rig = (struct ih_rig){0};
    rig->calibration = *calibration;
    enum ih_err err = check_camera(calibration);
    if (err == IH_OK) {
        fill_back(rig);
        err = check_lens(rig);
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
    fill_field(rig);
    if (rig->field.unit_q28 < (1 << 28) / 1000) { /* dots closer than 2 mrad: not a 19x19 pattern */
        return IH_ERR_RAY;
    }
    return IH_OK;
}
