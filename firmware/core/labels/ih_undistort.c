#include "labels/ih_undistort.h"

#include <stdbool.h>

#include "base/ih_fix.h"
#include "rig/ih_camera.h"
#include "simd/ih_simd.h"

static void undistort_one(const struct ih_dot *dot, const struct ih_rig *rig, int32_t *u_px_q12,
                          int32_t *v_px_q12)
{
    int32_t x_q28, y_q28;
    ih_camera_undistort(rig, dot->u_px_q12, dot->v_px_q12, &x_q28, &y_q28);
    ih_camera_pixel(rig, x_q28, y_q28, u_px_q12, v_px_q12);
}

#if IH_I16_LANES > 0
#define LANES IH_I64_LANES

#define ONE_Q28 ((int64_t)1 << 28)
#define RADIAL_MAX_Q24 (1 << 24)      /* of k1, k2, k3 */
#define TANGENTIAL_MAX_Q24 (1 << 20)  /* of p1, p2 */
#define UNDISTORTED_MAX_Q28 375809638 /* 1.4 */
#define RISE_MAX_Q24 ((1 << 27) - 1)
/* Limits of the radial factor: the lower one as in ih_camera.c, the upper one half of it. */
#define FACTOR_MIN_Q28 (ONE_Q28 / 8)
#define FACTOR_MAX_Q28 (8 * ONE_Q28)

/* Of factors that fit 32 bits. */
static inline ih_i64 product(ih_i64 a, ih_i64 b)
{
    return ih_i32_mul_even((ih_i32)a, (ih_i32)b);
}

static inline ih_i64 product_round(ih_i64 a, ih_i64 b, int shift)
{
    return ih_i64_shift_round(product(a, b), shift);
}

static inline ih_i64 twice(ih_i64 value)
{
    return ih_i64_add(value, value);
}

/* The sign bit is set where a value is not within -max .. max; 64-bit comparisons are slow with SSE2. */
static inline ih_i64 is_beyond(ih_i64 value, int64_t max)
{
    return ih_i64_add(value, ih_i64_all(max)) | ih_i64_sub(ih_i64_all(max), value);
}

/* A focal length of e bits; the inverse has 28 + shift bits of fraction, truncated, and is below 2^31. */
struct focal {
    int64_t principal_px_q16, focal_px_q16;
    int64_t inverse;
    int shift;
};

static struct focal focal_of(int32_t focal_px_q16, int32_t principal_px_q16)
{
    const int shift = ih_bits_u64((uint64_t)focal_px_q16) + 1;
    return (struct focal){principal_px_q16, focal_px_q16,
                          ((int64_t)1 << (28 + shift)) / focal_px_q16, shift};
}

/* A lens whose numbers need no limits, each in all lanes. */
struct lens {
    struct focal x, y;
    ih_i64 k1, k2, k3, p1, p2;
    ih_i64 inverse[3];
    int64_t last_q28;
};

static bool is_mild(const struct ih_rig *rig)
{
    const struct ih_calibration *c = &rig->calibration;
    return rig->newton_steps > 0 && ih_abs_s64(c->k1_q24) < RADIAL_MAX_Q24 &&
           ih_abs_s64(c->k2_q24) < RADIAL_MAX_Q24 && ih_abs_s64(c->k3_q24) < RADIAL_MAX_Q24 &&
           ih_abs_s64(c->p1_q24) < TANGENTIAL_MAX_Q24 && ih_abs_s64(c->p2_q24) < TANGENTIAL_MAX_Q24;
}

static inline struct lens lens_of(const struct ih_rig *rig)
{
    const struct ih_calibration *c = &rig->calibration;
    const int32_t *inverse = rig->inverse_q24;
    return (struct lens){
        .x = focal_of(c->fx_px_q16, c->cx_px_q16),
        .y = focal_of(c->fy_px_q16, c->cy_px_q16),
        .k1 = ih_i64_all(c->k1_q24),
        .k2 = ih_i64_all(c->k2_q24),
        .k3 = ih_i64_all(c->k3_q24),
        .p1 = ih_i64_all(c->p1_q24),
        .p2 = ih_i64_all(c->p2_q24),
        .inverse = {ih_i64_all(inverse[0]), ih_i64_all(inverse[1]), ih_i64_all(inverse[2])},
        .last_q28 = rig->newton_last_q28,
    };
}

/* A pixel's offset over the focal length, as ih_div_round. The inverse makes the quotient of an offset within 45
 * degrees too small by less than 2, so the remainder, with the half that rounds, is below twice the focal
 * length, and fits 31 bits. *beyond: farther than that. */
static inline ih_i64 divide_by_focal(ih_i64 px_q16, const struct focal *focal, ih_i64 *beyond)
{
    const ih_i64 f = ih_i64_all(focal->focal_px_q16);
    const ih_i64 offset = ih_i64_sub(px_q16, ih_i64_all(focal->principal_px_q16));
    const ih_i64 sign = (ih_i64)ih_i32_shift_right((ih_i32)offset, 31); /* offset fits 32 bits */
    const ih_i64 size = ih_i64_sub(offset ^ sign, sign);
    *beyond |= is_beyond(offset, focal->focal_px_q16);
    const ih_i64 guess =
        (ih_i64)ih_u64_shift_right((ih_u64)product(size, ih_i64_all(focal->inverse)), focal->shift);
    const ih_i64 half = ih_i64_all(focal->focal_px_q16 / 2);
    const ih_i64 remainder =
        ih_i64_sub(ih_i64_add(ih_i64_shift_left(size, 28), half), product(guess, f));
    const ih_i32 is_low = (ih_i32)remainder >= (ih_i32)f;
    const ih_i64 quotient = ih_i64_add(guess, (ih_i64)is_low & ih_i64_all(1));
    return ih_i64_sub(quotient ^ sign, sign);
}

/* The tangential shift, at most 3/4. */
static inline void tangential_shift(const struct lens *lens, ih_i64 xx, ih_i64 yy, ih_i64 xy,
                                    ih_i64 *dx, ih_i64 *dy)
{
    const ih_i64 half = (ih_i64)ih_u64_shift_right((ih_u64)ih_i64_add(xx, yy), 1);
    const ih_i64 xy2 = twice(xy);
    *dx = ih_i64_add(product_round(xy2, lens->p1, 24),
                     product_round(ih_i64_add(half, xx), lens->p2, 23));
    *dy = ih_i64_add(product_round(ih_i64_add(half, yy), lens->p1, 23),
                     product_round(xy2, lens->p2, 24));
}

static inline ih_i64 radial_factor(const struct lens *lens, ih_i64 r2_q28)
{
    const ih_i64 r4_q25 = product_round(r2_q28, r2_q28, 31);
    const ih_i64 r6_q22 = product_round(r4_q25, r2_q28, 31);
    const ih_i64 low = ih_i64_add(ih_i64_all(ONE_Q28), product_round(r2_q28, lens->k1, 24));
    const ih_i64 high =
        ih_i64_add(product_round(r4_q25, lens->k2, 21), product_round(r6_q22, lens->k3, 18));
    return ih_i64_add(low, high);
}

/* The first of Newton's steps of ih_camera_undistort. Returns the sign bit where it needs a limit or another step. */
static inline ih_i64 undistort_once(const struct lens *lens, ih_i64 u_px_q16, ih_i64 v_px_q16,
                                    ih_i64 *x_q28, ih_i64 *y_q28)
{
    ih_i64 dx, dy, beyond = {0};
    const ih_i64 xd = divide_by_focal(u_px_q16, &lens->x, &beyond);
    const ih_i64 yd = divide_by_focal(v_px_q16, &lens->y, &beyond);
    ih_i64 xx = product_round(xd, xd, 28);
    ih_i64 yy = product_round(yd, yd, 28);
    const ih_i64 r2 = ih_i64_add(xx, yy);
    const ih_i64 cubic = product_round(lens->inverse[2], r2, 28);
    const ih_i64 square = product_round(ih_i64_add(lens->inverse[1], cubic), r2, 28);
    const ih_i64 rise_q24 =
        ih_i64_add(ih_i64_add(lens->inverse[0], twice(square)), product_round(cubic, r2, 28));
    const ih_i64 rise = ih_i64_shift_left(rise_q24, 4);
    const ih_i64 scale = ih_i64_add(ih_i64_all(ONE_Q28),
                                    product_round(ih_i64_add(lens->inverse[0], square), r2, 24));
    tangential_shift(lens, xx, yy, product_round(xd, yd, 28), &dx, &dy);
    const ih_i64 x = product_round(ih_i64_sub(xd, dx), scale, 28);
    const ih_i64 y = product_round(ih_i64_sub(yd, dy), scale, 28);
    beyond |= is_beyond(rise_q24, RISE_MAX_Q24) | is_beyond(scale, INT32_MAX) |
              is_beyond(x, UNDISTORTED_MAX_Q28) | is_beyond(y, UNDISTORTED_MAX_Q28);

    xx = product_round(x, x, 28);
    yy = product_round(y, y, 28);
    const ih_i64 factor = radial_factor(lens, ih_i64_add(xx, yy));
    tangential_shift(lens, xx, yy, product_round(x, y, 28), &dx, &dy);
    const ih_i64 error_x = ih_i64_sub(ih_i64_sub(xd, dx), product_round(x, factor, 28));
    const ih_i64 error_y = ih_i64_sub(ih_i64_sub(yd, dy), product_round(y, factor, 28));
    const ih_i64 radial =
        twice(ih_i64_add(product_round(xd, error_x, 28), product_round(yd, error_y, 28)));
    const ih_i64 risen = product_round(radial, rise, 28);
    const ih_i64 step_x =
        ih_i64_add(product_round(error_x, scale, 28), product_round(risen, xd, 28));
    const ih_i64 step_y =
        ih_i64_add(product_round(error_y, scale, 28), product_round(risen, yd, 28));
    beyond |= ih_i64_sub(factor, ih_i64_all(FACTOR_MIN_Q28)) |
              ih_i64_sub(ih_i64_all(FACTOR_MAX_Q28 - 1), factor) |
              is_beyond(error_x, 2 * lens->last_q28 - 1) |
              is_beyond(error_y, 2 * lens->last_q28 - 1) | is_beyond(step_x, lens->last_q28 - 1) |
              is_beyond(step_y, lens->last_q28 - 1);
    *x_q28 = ih_i64_add(x, step_x);
    *y_q28 = ih_i64_add(y, step_y);
    return beyond;
}

/* As ih_camera_pixel. */
static inline void store_pixels(ih_i64 q28, const struct focal *focal, int32_t px_q12[LANES])
{
    int64_t px[LANES];
    const ih_i64 principal = ih_i64_all(ih_shift_round(focal->principal_px_q16, 4));
    ih_i64_store(px,
                 ih_i64_add(product_round(q28, ih_i64_all(focal->focal_px_q16), 32), principal));
    for (int i = 0; i < LANES; i++) {
        px_q12[i] = (int32_t)px[i];
    }
}

static void undistort_vector(const struct ih_dot *dot, const struct ih_rig *rig,
                             const struct lens *lens, int32_t u_px_q12[LANES],
                             int32_t v_px_q12[LANES])
{
    int64_t u_px_q16[LANES], v_px_q16[LANES], beyond[LANES];
    ih_i64 x_q28, y_q28;
    for (int i = 0; i < LANES; i++) {
        u_px_q16[i] = (int64_t)dot[i].u_px_q12 * 16;
        v_px_q16[i] = (int64_t)dot[i].v_px_q12 * 16;
    }
    const ih_i64 signs =
        undistort_once(lens, ih_i64_load(u_px_q16), ih_i64_load(v_px_q16), &x_q28, &y_q28);
    store_pixels(x_q28, &lens->x, u_px_q12);
    store_pixels(y_q28, &lens->y, v_px_q12);
    if (!ih_i16_any((ih_i16)ih_u64_shift_right((ih_u64)signs, 63))) {
        return;
    }
    ih_i64_store(beyond, signs);
    for (int i = 0; i < LANES; i++) {
        if (beyond[i] < 0) {
            undistort_one(&dot[i], rig, &u_px_q12[i], &v_px_q12[i]);
        }
    }
}

/* Undistorts whole vectors of dots. Returns how many dots those are. */
static int32_t undistort_vectors(const struct ih_dots *dots, const struct ih_rig *rig,
                                 int32_t *u_px_q12, int32_t *v_px_q12)
{
    int32_t first = 0;
    if (!is_mild(rig)) {
        return 0;
    }
    const struct lens lens = lens_of(rig);
    for (; first + LANES <= dots->dot_count; first += LANES) {
        undistort_vector(&dots->dot[first], rig, &lens, &u_px_q12[first], &v_px_q12[first]);
    }
    return first;
}

#else

static int32_t undistort_vectors(const struct ih_dots *dots, const struct ih_rig *rig,
                                 int32_t *u_px_q12, int32_t *v_px_q12)
{
    (void)dots, (void)rig, (void)u_px_q12, (void)v_px_q12;
    return 0;
}

#endif

void ih_undistort_dots(const struct ih_dots *dots, const struct ih_rig *rig,
                       int32_t u_px_q12[IH_DOTS_MAX], int32_t v_px_q12[IH_DOTS_MAX])
{
    for (int32_t i = undistort_vectors(dots, rig, u_px_q12, v_px_q12); i < dots->dot_count; i++) {
        undistort_one(&dots->dot[i], rig, &u_px_q12[i], &v_px_q12[i]);
    }
}
