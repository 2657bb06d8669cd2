#include "rig/ih_camera.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"

#define ONE_Q28 ((int64_t)1 << 28)
#define BROWN_MAX_Q28 (16 * ONE_Q28)
#define TAN_MAX_Q28 (IH_RIG_TAN_MAX * ONE_Q28)
#define RADIAL_MIN_Q28 (ONE_Q28 / 8)
/* Enough for a lens whose iteration gains only a third a step; usual ones need five. */
#define ITERATIONS_MAX 64
#define NEWTON_STEPS 5
#define NEWTON_MAX_Q28 (1 << 25)
/* A step no longer than this is the last one: it leaves the error of the slopes, a hundredth of the
 * step with usual lenses. The short one is for lenses whose slopes are less accurate. */
#define NEWTON_LAST_Q28 (1 << 14)
#define NEWTON_LAST_SHORT_Q28 (1 << 9)
/* Pixels tested along each side of the frame, and their largest error after a round trip. */
#define LENS_PROBES 65
#define LENS_ERROR_MAX_PX_Q12 20 /* 0.005 px */
#define LENS_ERROR_FEW_PX_Q12 2  /* rounding alone gives 1 */

static int64_t product_q28(int32_t a_q28, int32_t b_q28)
{
    return ih_mul_shift(a_q28, b_q28, 28);
}

/* A seldom limit between constants: compilers make one comparison of both. */
static int64_t limit_brown_q28(int64_t value_q28)
{
    if (value_q28 < -BROWN_MAX_Q28 || value_q28 > BROWN_MAX_Q28) {
        return value_q28 < 0 ? -BROWN_MAX_Q28 : BROWN_MAX_Q28;
    }
    return value_q28;
}

static int32_t limit_tan_q28(int64_t value_q28)
{
    if (value_q28 < -TAN_MAX_Q28 || value_q28 > TAN_MAX_Q28) {
        return (int32_t)(value_q28 < 0 ? -TAN_MAX_Q28 : TAN_MAX_Q28);
    }
    return (int32_t)value_q28;
}

/* Tangential distortion, from x^2, y^2 and x y. */
static inline void tangential(const struct ih_calibration *c, int64_t xx, int64_t yy, int64_t xy,
                              int64_t *dx_q28, int64_t *dy_q28)
{
    const int64_t r2 = xx + yy;
    /* 2 xy <= 8; (r2 + 2 xx) / 2 <= 8 */
    *dx_q28 = limit_brown_q28(ih_mul_shift(2 * xy, c->p1_q24, 24) +
                              ih_mul_shift((r2 >> 1) + xx, c->p2_q24, 23));
    *dy_q28 = limit_brown_q28(ih_mul_shift((r2 >> 1) + yy, c->p1_q24, 23) +
                              ih_mul_shift(2 * xy, c->p2_q24, 24));
}

/* Radial factor, from the square of the radius. */
static inline int64_t radial_at(const struct ih_calibration *c, uint32_t r2_q28)
{
    const int64_t r2 = r2_q28;
    const int64_t r4_q25 = ih_mul_shift(r2, r2, 31);
    const int64_t r6_q22 = ih_mul_shift(r4_q25, r2, 31);
    return limit_brown_q28(ONE_Q28 + ih_mul_shift(r2, c->k1_q24, 24) +
                           ih_mul_shift(r4_q25, c->k2_q24, 21) +
                           ih_mul_shift(r6_q22, c->k3_q24, 18));
}

/* OpenCV's Brown model. |x|, |y| <= 2, so r2 <= 8 = 2^31 in Q28, r4 <= 64 = 2^31 in Q25 and
 * r6 <= 512 = 2^31 in Q22: times a coefficient in int32 each stays below 2^62. A lens that exceeds
 * BROWN_MAX_Q28 anywhere is limited to it, and check_lens refuses it. */
static inline void brown(const struct ih_calibration *c, int32_t x_q28, int32_t y_q28,
                         int64_t *radial_q28, int64_t *dx_q28, int64_t *dy_q28)
{
    const int64_t xx = product_q28(x_q28, x_q28);
    const int64_t yy = product_q28(y_q28, y_q28);
    *radial_q28 = radial_at(c, (uint32_t)(xx + yy));
    tangential(c, xx, yy, product_q28(x_q28, y_q28), dx_q28, dy_q28);
}

/* Pixel to distorted normalised coordinate. Pixels beyond +-16384 are limited: in Q16 below 2^32,
 * times 2^28. */
static int32_t distorted_q28(int32_t px_q12, int32_t principal_px_q16, int32_t focal_px_q16)
{
    int64_t px_q16 = (int64_t)ih_clamp_s32(px_q12, -(1 << 26), 1 << 26) * 16;
    return limit_tan_q28(ih_div_round((px_q16 - principal_px_q16) * ONE_Q28, focal_px_q16));
}

/* Fixed-point iteration x <- (xd - dx(x)) / radial(x), until x stays the same. Each step reduces the
 * error by a factor of about the distortion itself. */
static void undistort_by_iteration(const struct ih_calibration *c, int32_t xd, int32_t yd,
                                   int32_t *x_q28, int32_t *y_q28)
{
    int32_t x = xd;
    int32_t y = yd;
    for (int i = 0; i < ITERATIONS_MAX; i++) {
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

/* The inverse of the radial distortion at a distorted radius: its factor, and the factor's derivative by
 * r^2. */
struct inverse {
    int32_t scale_q28, rise_q28;
};

static struct inverse inverse_at(const int32_t inverse_q24[3], int32_t r2_q28)
{
    const int32_t cubic = (int32_t)product_q28(inverse_q24[2], r2_q28); /* below 2^30 */
    const int64_t square = product_q28(inverse_q24[1] + cubic, r2_q28);
    const int32_t all = ih_saturate_s32(inverse_q24[0] + square);
    const int64_t rise_q24 = inverse_q24[0] + 2 * square + product_q28(cubic, r2_q28);
    return (struct inverse){
        .scale_q28 = ih_saturate_s32(ONE_Q28 + ih_mul_shift(all, r2_q28, 24)),
        .rise_q28 = ih_saturate_s32(rise_q24 * 16),
    };
}

/* Newton's method. It starts at the series' value minus the tangential part and takes its slopes from the
 * series: the factor, and twice its derivative along the radius. One step is usual; it leaves the
 * slopes' error, a hundredth of it at the corners of usual lenses. False when no step is small, as where
 * the lens folds the picture. */
static bool undistort_by_newton(const struct ih_rig *rig, int32_t xd, int32_t yd, int32_t *x_q28,
                                int32_t *y_q28)
{
    const int64_t xx = product_q28(xd, xd);
    const int64_t yy = product_q28(yd, yd);
    const struct inverse inverse = inverse_at(rig->inverse_q24, ih_saturate_s32(xx + yy));
    int64_t radial, dx, dy;
    tangential(&rig->calibration, xx, yy, product_q28(xd, yd), &dx, &dy);
    int32_t x = limit_tan_q28(product_q28(limit_tan_q28(xd - dx), inverse.scale_q28));
    int32_t y = limit_tan_q28(product_q28(limit_tan_q28(yd - dy), inverse.scale_q28));
    for (int i = 0; i < rig->newton_steps; i++) {
        brown(&rig->calibration, x, y, &radial, &dx, &dy);
        const int64_t off_x = xd - dx - ih_mul_shift(x, radial, 28);
        const int64_t off_y = yd - dy - ih_mul_shift(y, radial, 28);
        if (radial < RADIAL_MIN_Q28 ||
            ih_max_s64(ih_abs_s64(off_x), ih_abs_s64(off_y)) > NEWTON_MAX_Q28) {
            return false;
        }
        const int64_t out = 2 * (product_q28(xd, (int32_t)off_x) + product_q28(yd, (int32_t)off_y));
        const int32_t risen = ih_saturate_s32(product_q28((int32_t)out, inverse.rise_q28));
        const int64_t step_x =
            product_q28((int32_t)off_x, inverse.scale_q28) + product_q28(risen, xd);
        const int64_t step_y =
            product_q28((int32_t)off_y, inverse.scale_q28) + product_q28(risen, yd);
        x = limit_tan_q28(x + step_x);
        y = limit_tan_q28(y + step_y);
        /* The step alone says too little: it is short wherever the series' slope is 0, as with
         * pincushion lenses. */
        if (ih_max_s64(ih_abs_s64(step_x), ih_abs_s64(step_y)) < rig->newton_last_q28 &&
            ih_max_s64(ih_abs_s64(off_x), ih_abs_s64(off_y)) < 2 * rig->newton_last_q28) {
            *x_q28 = x;
            *y_q28 = y;
            return true;
        }
    }
    return false;
}

void ih_camera_undistort(const struct ih_rig *rig, int32_t u_px_q12, int32_t v_px_q12,
                         int32_t *x_q28, int32_t *y_q28)
{
    const struct ih_calibration *c = &rig->calibration;
    const int32_t xd = distorted_q28(u_px_q12, c->cx_px_q16, c->fx_px_q16);
    const int32_t yd = distorted_q28(v_px_q12, c->cy_px_q16, c->fy_px_q16);
    if (!undistort_by_newton(rig, xd, yd, x_q28, y_q28)) {
        undistort_by_iteration(c, xd, yd, x_q28, y_q28);
    }
}

/* Series of the inverse radial distortion, r = rd (1 + b0 rd^2 + b1 rd^4 + b2 rd^6). A lens too strong for
 * the format has zeros, and Newton's method starts at the distorted coordinate. */
static void fill_inverse(struct ih_rig *rig)
{
    const int64_t max = (int64_t)8 << 24;
    const int64_t k1 = rig->calibration.k1_q24;
    const int64_t k2 = rig->calibration.k2_q24;
    if (ih_abs_s64(k1) > 1 << 24 || ih_abs_s64(k2) > 1 << 24) {
        return;
    }
    const int64_t k1k1 = ih_mul_shift(k1, k1, 24);
    rig->inverse_q24[0] = (int32_t)-k1;
    rig->inverse_q24[1] = (int32_t)(3 * k1k1 - k2);
    rig->inverse_q24[2] = (int32_t)ih_clamp_s64(
        ih_mul_shift(k1, 8 * k2 - 12 * k1k1, 24) - rig->calibration.k3_q24, max);
}

static inline void pixel_of(const struct ih_calibration *c, int32_t x_q28, int32_t y_q28,
                            int32_t *u_px_q12, int32_t *v_px_q12)
{
    *u_px_q12 = (int32_t)(ih_mul_shift(x_q28, c->fx_px_q16, 32) + ih_shift_round(c->cx_px_q16, 4));
    *v_px_q12 = (int32_t)(ih_mul_shift(y_q28, c->fy_px_q16, 32) + ih_shift_round(c->cy_px_q16, 4));
    IH_IN_RANGE(*u_px_q12, -IH_RANGE_PLACE_PX_Q12, IH_RANGE_PLACE_PX_Q12);
    IH_IN_RANGE(*v_px_q12, -IH_RANGE_PLACE_PX_Q12, IH_RANGE_PLACE_PX_Q12);
}

void ih_camera_undistort_pixel(const struct ih_rig *rig, int32_t u_px_q12, int32_t v_px_q12,
                               int32_t *undistorted_u_px_q12, int32_t *undistorted_v_px_q12)
{
    int32_t x_q28, y_q28;
    ih_camera_undistort(rig, u_px_q12, v_px_q12, &x_q28, &y_q28);
    pixel_of(&rig->calibration, x_q28, y_q28, undistorted_u_px_q12, undistorted_v_px_q12);
}

void ih_camera_distort(const struct ih_rig *rig, int32_t x_q28, int32_t y_q28, int32_t *u_px_q12,
                       int32_t *v_px_q12)
{
    const struct ih_calibration *c = &rig->calibration;
    const int32_t x = limit_tan_q28(x_q28);
    const int32_t y = limit_tan_q28(y_q28);
    int64_t radial, dx, dy;
    brown(c, x, y, &radial, &dx, &dy);
    /* Limits, as a strong lens maps coordinates far outside the frame to anything. */
    pixel_of(c, limit_tan_q28(ih_mul_shift(x, radial, 28) + dx),
             limit_tan_q28(ih_mul_shift(y, radial, 28) + dy), u_px_q12, v_px_q12);
}

bool ih_camera_sees(const struct ih_rig *rig, int32_t u_px_q12, int32_t v_px_q12)
{
    const struct ih_calibration *c = &rig->calibration;
    return u_px_q12 >= 0 && v_px_q12 >= 0 && u_px_q12 <= (c->width - 1) * 4096 &&
           v_px_q12 <= (c->height - 1) * 4096;
}

/* Are both ends of a side within the widest angle? The principal point itself may lie outside the
 * frame: a range image may be cropped. */
static bool is_side_in_view(int32_t side_px, int32_t principal_px_q16, int32_t focal_px_q16)
{
    int64_t limit_q16 = (int64_t)IH_RIG_TAN_MAX * focal_px_q16;
    return principal_px_q16 <= limit_q16 &&
           (int64_t)side_px * 65536 - principal_px_q16 <= limit_q16;
}

static enum ih_err check_numbers(const struct ih_calibration *c)
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
    if (!is_side_in_view(c->width, c->cx_px_q16, c->fx_px_q16) ||
        !is_side_in_view(c->height, c->cy_px_q16, c->fy_px_q16)) {
        return IH_ERR_PRINCIPAL;
    }
    if (c->near_mm < IH_DEPTH_MIN_MM || c->far_mm > IH_DEPTH_MAX_MM || c->near_mm >= c->far_mm) {
        return IH_ERR_RANGE;
    }
    return IH_OK;
}

/* Does undistorting and distorting give each pixel of a grid over the frame again? */
static bool is_reversible(const struct ih_rig *rig, int32_t error_max_px_q12)
{
    const struct ih_calibration *c = &rig->calibration;
    for (int32_t row = 0; row < LENS_PROBES; row++) {
        for (int32_t column = 0; column < LENS_PROBES; column++) {
            int32_t u = (c->width - 1) * 4096 / (LENS_PROBES - 1) * column;
            int32_t v = (c->height - 1) * 4096 / (LENS_PROBES - 1) * row;
            int32_t x, y, back_u, back_v;
            ih_camera_undistort(rig, u, v, &x, &y);
            ih_camera_distort(rig, x, y, &back_u, &back_v);
            if (ih_abs_s32(back_u - u) > error_max_px_q12 ||
                ih_abs_s32(back_v - v) > error_max_px_q12) {
                return false;
            }
        }
    }
    return true;
}

/* A lens that is not reversible cannot be used. With a large k3 and a long focal length r^6 in Q22 is too
 * coarse for Newton's method, which then stops beside the solution; the iteration does not. */
static enum ih_err check_lens(struct ih_rig *rig)
{
    rig->newton_steps = NEWTON_STEPS;
    rig->newton_last_q28 = NEWTON_LAST_Q28;
    if (is_reversible(rig, LENS_ERROR_FEW_PX_Q12)) {
        return IH_OK;
    }
    rig->newton_last_q28 = NEWTON_LAST_SHORT_Q28;
    if (is_reversible(rig, LENS_ERROR_MAX_PX_Q12)) {
        return IH_OK;
    }
    rig->newton_steps = 0;
    return is_reversible(rig, LENS_ERROR_MAX_PX_Q12) ? IH_OK : IH_ERR_DISTORTION;
}

enum ih_err ih_camera_init(struct ih_rig *rig)
{
    const enum ih_err err = check_numbers(&rig->calibration);
    if (err != IH_OK) {
        return err;
    }
    fill_inverse(rig);
    return check_lens(rig);
}
