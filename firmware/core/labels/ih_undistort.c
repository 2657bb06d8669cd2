#include "labels/ih_undistort.h"

#include <stdbool.h>

#include "base/ih_fix.h"
#include "rig/ih_camera.h"
#include "simd/ih_simd_cortexm.h"

/* The single step takes 2 kB of code, which a microcontroller's flash has no room for. */
#if !IH_CORTEXM
#define ONE_Q28 ((int64_t)1 << 28)
#define RADIAL_MAX_Q24 (1 << 24)      /* of k1, k2, k3 */
#define TANGENTIAL_MAX_Q24 (1 << 20)  /* of p1, p2 */
#define UNDISTORTED_MAX_Q28 375809638 /* 1.4 */
#define RISE_MAX_Q24 ((1 << 27) - 1)
/* Limits of the radial factor: the lower one as in ih_camera.c, the upper one half of it. */
#define FACTOR_MIN_Q28 (ONE_Q28 / 8)
#define FACTOR_MAX_Q28 (8 * ONE_Q28)

/* Of factors that fit 32 bits: one multiplication on a Cortex-M. */
static int64_t product(int64_t a, int64_t b, int shift)
{
    return ih_shift_round((int64_t)(int32_t)a * (int32_t)b, shift);
}

static bool is_within(int64_t value, int64_t max)
{
    return value >= -max && value <= max;
}

static bool is_mild(const struct ih_rig *rig)
{
    const struct ih_calibration *c = &rig->calibration;
    return rig->newton_steps > 0 && ih_abs_s64(c->k1_q24) < RADIAL_MAX_Q24 &&
           ih_abs_s64(c->k2_q24) < RADIAL_MAX_Q24 && ih_abs_s64(c->k3_q24) < RADIAL_MAX_Q24 &&
           ih_abs_s64(c->p1_q24) < TANGENTIAL_MAX_Q24 && ih_abs_s64(c->p2_q24) < TANGENTIAL_MAX_Q24;
}

/* The tangential shift, at most 3/4. */
static void tangential_shift(const struct ih_calibration *c, int64_t xx, int64_t yy, int64_t xy,
                             int64_t shift_q28[2])
{
    const int64_t half = (xx + yy) >> 1;
    shift_q28[0] = product(2 * xy, c->p1_q24, 24) + product(half + xx, c->p2_q24, 23);
    shift_q28[1] = product(half + yy, c->p1_q24, 23) + product(2 * xy, c->p2_q24, 24);
}

static int64_t radial_factor(const struct ih_calibration *c, int64_t r2_q28)
{
    const int64_t r4_q25 = product(r2_q28, r2_q28, 31);
    const int64_t r6_q22 = product(r4_q25, r2_q28, 31);
    return ONE_Q28 + product(r2_q28, c->k1_q24, 24) + product(r4_q25, c->k2_q24, 21) +
           product(r6_q22, c->k3_q24, 18);
}

/* The first of Newton's steps of ih_camera_undistort. False where it needs a limit or another step. */
static bool undistort_once(const struct ih_rig *rig, int64_t xd, int64_t yd, int32_t *x_q28,
                           int32_t *y_q28)
{
    const struct ih_calibration *c = &rig->calibration;
    const int32_t *inverse = rig->inverse_q24;
    const int64_t last = rig->newton_last_q28;
    int64_t shift[2];
    if (!is_within(xd, ONE_Q28) || !is_within(yd, ONE_Q28)) {
        return false;
    }
    int64_t xx = product(xd, xd, 28);
    int64_t yy = product(yd, yd, 28);
    const int64_t r2 = xx + yy;
    const int64_t cubic = product(inverse[2], r2, 28);
    const int64_t square = product(inverse[1] + cubic, r2, 28);
    const int64_t rise_q24 = inverse[0] + 2 * square + product(cubic, r2, 28);
    const int64_t rise = rise_q24 * 16;
    const int64_t scale = ONE_Q28 + product(inverse[0] + square, r2, 24);
    if (!is_within(rise_q24, RISE_MAX_Q24) || !is_within(scale, INT32_MAX)) {
        return false;
    }
    tangential_shift(c, xx, yy, product(xd, yd, 28), shift);
    const int64_t x = product(xd - shift[0], scale, 28);
    const int64_t y = product(yd - shift[1], scale, 28);
    if (!is_within(x, UNDISTORTED_MAX_Q28) || !is_within(y, UNDISTORTED_MAX_Q28)) {
        return false;
    }
    xx = product(x, x, 28);
    yy = product(y, y, 28);
    const int64_t factor = radial_factor(c, xx + yy);
    if (factor < FACTOR_MIN_Q28 || factor >= FACTOR_MAX_Q28) {
        return false;
    }
    tangential_shift(c, xx, yy, product(x, y, 28), shift);
    const int64_t error_x = xd - shift[0] - product(x, factor, 28);
    const int64_t error_y = yd - shift[1] - product(y, factor, 28);
    if (!is_within(error_x, 2 * last - 1) || !is_within(error_y, 2 * last - 1)) {
        return false;
    }
    const int64_t risen =
        product(2 * (product(xd, error_x, 28) + product(yd, error_y, 28)), rise, 28);
    const int64_t step_x = product(error_x, scale, 28) + product(risen, xd, 28);
    const int64_t step_y = product(error_y, scale, 28) + product(risen, yd, 28);
    if (!is_within(step_x, last - 1) || !is_within(step_y, last - 1)) {
        return false;
    }
    *x_q28 = (int32_t)(x + step_x);
    *y_q28 = (int32_t)(y + step_y);
    return true;
}

/* False: left to ih_camera_undistort. */
static bool undistort_dot(const struct ih_rig *rig, const struct ih_dot *dot, int32_t *x_q28,
                          int32_t *y_q28)
{
    const struct ih_calibration *c = &rig->calibration;
    const int64_t u = ((int64_t)dot->u_px_q12 * 16 - c->cx_px_q16) * ONE_Q28;
    const int64_t v = ((int64_t)dot->v_px_q12 * 16 - c->cy_px_q16) * ONE_Q28;
    return undistort_once(rig, ih_div_round(u, c->fx_px_q16), ih_div_round(v, c->fy_px_q16), x_q28,
                          y_q28);
}
#else
static bool is_mild(const struct ih_rig *rig)
{
    (void)rig;
    return false;
}

static bool undistort_dot(const struct ih_rig *rig, const struct ih_dot *dot, int32_t *x_q28,
                          int32_t *y_q28)
{
    (void)rig, (void)dot, (void)x_q28, (void)y_q28;
    return false;
}
#endif

void ih_undistort_dots(const struct ih_dots *dots, const struct ih_rig *rig,
                       int32_t u_px_q12[IH_DOTS_MAX], int32_t v_px_q12[IH_DOTS_MAX])
{
    const bool may_be_single = is_mild(rig);
    for (int32_t i = 0; i < dots->dot_count; i++) {
        const struct ih_dot *dot = &dots->dot[i];
        int32_t x_q28, y_q28;
        if (!may_be_single || !undistort_dot(rig, dot, &x_q28, &y_q28)) {
            ih_camera_undistort(rig, dot->u_px_q12, dot->v_px_q12, &x_q28, &y_q28);
        }
        ih_camera_pixel(rig, x_q28, y_q28, &u_px_q12[i], &v_px_q12[i]);
    }
}
