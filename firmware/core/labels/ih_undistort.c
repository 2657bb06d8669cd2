#include "labels/ih_undistort.h"

#include <stdbool.h>

#include "base/ih_fix.h"
#include "rig/ih_camera.h"

#if defined __AVX2__
#include <immintrin.h>
#define LANES 4
#endif

static void undo_one(const struct ih_dot *dot, const struct ih_rig *rig, int32_t *u_px_q12,
                     int32_t *v_px_q12)
{
    int32_t x_q28, y_q28;
    ih_camera_undistort(rig, dot->u_px_q12, dot->v_px_q12, &x_q28, &y_q28);
    ih_camera_pixel(rig, x_q28, y_q28, u_px_q12, v_px_q12);
}

#ifdef LANES

typedef __m256i lanes; /* four numbers of 64 bits */

#define ONE_Q28 ((int64_t)1 << 28)
#define COEFFICIENT_MAX_Q24 (1 << 24)
#define ACROSS_MAX_Q24 (1 << 20)
#define UNDONE_MAX_Q28 375809638 /* 1.4 */
/* As in ih_rig.c; its upper limit of what is radial is 16. */
#define RADIAL_MIN_Q28 (ONE_Q28 / 8)
#define RADIAL_MAX_Q28 (8 * ONE_Q28)

static inline lanes all(int64_t value)
{
    return _mm256_set1_epi64x(value);
}

static inline lanes add(lanes a, lanes b)
{
    return _mm256_add_epi64(a, b);
}

static inline lanes less(lanes a, lanes b)
{
    return _mm256_sub_epi64(a, b);
}

/* Of factors that fit 32 bits. */
static inline lanes product(lanes a, lanes b)
{
    return _mm256_mul_epi32(a, b);
}

/* ih_shift_round of what is below 2^62: enlarged by that, it has no sign. */
static inline lanes shifted(lanes value, int shift)
{
    const int64_t more = ((int64_t)1 << 62) + ((int64_t)1 << (shift - 1));
    return less(_mm256_srli_epi64(add(value, all(more)), shift), all((int64_t)1 << (62 - shift)));
}

static inline lanes product_q28(lanes a_q28, lanes b_q28)
{
    return shifted(product(a_q28, b_q28), 28);
}

static inline lanes twice(lanes value)
{
    return add(value, value);
}

/* All bits where it is so. */
static inline lanes is_above(lanes a, lanes b)
{
    return _mm256_cmpgt_epi64(a, b);
}

static inline lanes is_within(lanes value, int64_t max)
{
    return _mm256_andnot_si256(is_above(value, all(max)), is_above(value, all(-max - 1)));
}

static inline lanes both(lanes a, lanes b)
{
    return _mm256_and_si256(a, b);
}

/* For quotients by a focal length of e bits: the inverse is cut off at 28 + inverse_shift bits, and below 2^31. */
struct focal {
    int64_t principal_px_q16, focal_px_q16;
    int64_t inverse;
    int inverse_shift;
};

static struct focal focal_of(int32_t focal_px_q16, int32_t principal_px_q16)
{
    const int shift = ih_bits_u64((uint64_t)focal_px_q16) + 1;
    return (struct focal){principal_px_q16, focal_px_q16,
                          ((int64_t)1 << (28 + shift)) / focal_px_q16, shift};
}

/* A lens whose numbers need no limit, and where each is in all lanes. */
struct lens {
    struct focal x, y;
    lanes k1, k2, k3, p1, p2;
    lanes back[3];
    int64_t last_q28;
};

static bool is_mild(const struct ih_rig *rig)
{
    const struct ih_calibration *c = &rig->calibration;
    return rig->newton_steps > 0 && ih_abs_s64(c->k1_q24) < COEFFICIENT_MAX_Q24 &&
           ih_abs_s64(c->k2_q24) < COEFFICIENT_MAX_Q24 &&
           ih_abs_s64(c->k3_q24) < COEFFICIENT_MAX_Q24 && ih_abs_s64(c->p1_q24) < ACROSS_MAX_Q24 &&
           ih_abs_s64(c->p2_q24) < ACROSS_MAX_Q24;
}

static inline struct lens lens_of(const struct ih_rig *rig)
{
    const struct ih_calibration *c = &rig->calibration;
    return (struct lens){
        .x = focal_of(c->fx_px_q16, c->cx_px_q16),
        .y = focal_of(c->fy_px_q16, c->cy_px_q16),
        .k1 = all(c->k1_q24),
        .k2 = all(c->k2_q24),
        .k3 = all(c->k3_q24),
        .p1 = all(c->p1_q24),
        .p2 = all(c->p2_q24),
        .back = {all(rig->inverse_q24[0]), all(rig->inverse_q24[1]), all(rig->inverse_q24[2])},
        .last_q28 = rig->newton_last_q28,
    };
}

/* A pixel's place by its focal length, ih_div_round. By the inverse, of which less than 1 is cut off, the quotient of a
 * place within 45 degrees (*is_near) is too small by 2^e / 2^(e + 1) and by what its own bits cut off, less than 1:
 * what is left, with the half that rounds, is below twice the focal length. */
static inline lanes seen_q28(lanes px_q12, const struct focal *focal, lanes *is_near)
{
    const lanes f = all(focal->focal_px_q16);
    const lanes off = less(_mm256_slli_epi64(px_q12, 4), all(focal->principal_px_q16));
    const lanes sign = is_above(_mm256_setzero_si256(), off);
    const lanes far = less(_mm256_xor_si256(off, sign), sign);
    *is_near = is_within(off, focal->focal_px_q16);
    const lanes guess = _mm256_srl_epi64(product(far, all(focal->inverse)),
                                         _mm_cvtsi32_si128(focal->inverse_shift));
    const lanes rest =
        less(add(_mm256_slli_epi64(far, 28), all(focal->focal_px_q16 / 2)), product(guess, f));
    const lanes quotient = less(guess, is_above(rest, all(focal->focal_px_q16 - 1)));
    return less(_mm256_xor_si256(quotient, sign), sign);
}

/* What is not radial; across in ih_rig.c. */
static inline void across(const struct lens *lens, lanes xx, lanes yy, lanes xy, lanes *dx,
                          lanes *dy)
{
    const lanes half = _mm256_srli_epi64(add(xx, yy), 1);
    const lanes xy2 = twice(xy);
    *dx = add(shifted(product(xy2, lens->p1), 24), shifted(product(add(half, xx), lens->p2), 23));
    *dy = add(shifted(product(add(half, yy), lens->p1), 23), shifted(product(xy2, lens->p2), 24));
}

static inline lanes radial_at(const struct lens *lens, lanes r2_q28)
{
    const lanes r4_q25 = shifted(product(r2_q28, r2_q28), 31);
    const lanes r6_q22 = shifted(product(r4_q25, r2_q28), 31);
    return add(add(all(ONE_Q28), shifted(product(r2_q28, lens->k1), 24)),
               add(shifted(product(r4_q25, lens->k2), 21), shifted(product(r6_q22, lens->k3), 18)));
}

/* Four places of pixels; a bit for each that is right. */
static inline int undo_four(const struct lens *lens, lanes u_px_q12, lanes v_px_q12, lanes *x_q28,
                            lanes *y_q28)
{
    lanes is_near_x, is_near_y, dx, dy;
    const lanes xd = seen_q28(u_px_q12, &lens->x, &is_near_x);
    const lanes yd = seen_q28(v_px_q12, &lens->y, &is_near_y);
    lanes xx = product_q28(xd, xd);
    lanes yy = product_q28(yd, yd);
    const lanes r2 = add(xx, yy);
    const lanes cubic = product_q28(lens->back[2], r2);
    const lanes square = product_q28(add(lens->back[1], cubic), r2);
    const lanes rise_q24 = add(add(lens->back[0], twice(square)), product_q28(cubic, r2));
    const lanes rise = _mm256_slli_epi64(rise_q24, 4);
    const lanes scale = add(all(ONE_Q28), shifted(product(add(lens->back[0], square), r2), 24));
    across(lens, xx, yy, product_q28(xd, yd), &dx, &dy);
    const lanes x = product_q28(less(xd, dx), scale);
    const lanes y = product_q28(less(yd, dy), scale);
    lanes is_right = both(both(is_near_x, is_near_y), is_within(rise_q24, (1 << 27) - 1));
    is_right = both(is_right, is_within(scale, INT32_MAX));
    is_right = both(is_right, both(is_within(x, UNDONE_MAX_Q28), is_within(y, UNDONE_MAX_Q28)));

    xx = product_q28(x, x);
    yy = product_q28(y, y);
    const lanes radial = radial_at(lens, add(xx, yy));
    across(lens, xx, yy, product_q28(x, y), &dx, &dy);
    const lanes off_x = less(less(xd, dx), product_q28(x, radial));
    const lanes off_y = less(less(yd, dy), product_q28(y, radial));
    const lanes out = twice(add(product_q28(xd, off_x), product_q28(yd, off_y)));
    const lanes risen = product_q28(out, rise);
    const lanes step_x = add(product_q28(off_x, scale), product_q28(risen, xd));
    const lanes step_y = add(product_q28(off_y, scale), product_q28(risen, yd));
    is_right = both(is_right, both(is_above(radial, all(RADIAL_MIN_Q28 - 1)),
                                   is_above(all(RADIAL_MAX_Q28), radial)));
    is_right = both(is_right, both(is_within(off_x, 2 * lens->last_q28 - 1),
                                   is_within(off_y, 2 * lens->last_q28 - 1)));
    is_right = both(is_right, both(is_within(step_x, lens->last_q28 - 1),
                                   is_within(step_y, lens->last_q28 - 1)));
    *x_q28 = add(x, step_x);
    *y_q28 = add(y, step_y);
    return _mm256_movemask_pd(_mm256_castsi256_pd(is_right));
}

/* ih_camera_pixel. */
static inline void store_pixels(lanes q28, int32_t focal_px_q16, int32_t principal_px_q16,
                                int32_t px_q12[LANES])
{
    const lanes px =
        add(shifted(product(q28, all(focal_px_q16)), 32), all(ih_shift_round(principal_px_q16, 4)));
    const __m256i words =
        _mm256_permutevar8x32_epi32(px, _mm256_setr_epi32(0, 2, 4, 6, 0, 0, 0, 0));
    _mm_storeu_si128((__m128i *)(void *)px_q12, _mm256_castsi256_si128(words));
}

/* The dots by fours; how many that were. */
static int32_t undo_fours(const struct ih_dots *dots, const struct ih_rig *rig, int32_t *u_px_q12,
                          int32_t *v_px_q12)
{
    const struct ih_calibration *c = &rig->calibration;
    const struct lens lens = lens_of(rig);
    int32_t first = 0;
    for (; first + LANES <= dots->dot_count; first += LANES) {
        const struct ih_dot *dot = &dots->dot[first];
        lanes x, y;
        const int right = undo_four(
            &lens,
            _mm256_setr_epi64x(dot[0].u_px_q12, dot[1].u_px_q12, dot[2].u_px_q12, dot[3].u_px_q12),
            _mm256_setr_epi64x(dot[0].v_px_q12, dot[1].v_px_q12, dot[2].v_px_q12, dot[3].v_px_q12),
            &x, &y);
        store_pixels(x, c->fx_px_q16, c->cx_px_q16, &u_px_q12[first]);
        store_pixels(y, c->fy_px_q16, c->cy_px_q16, &v_px_q12[first]);
        for (int i = 0; right != (1 << LANES) - 1 && i < LANES; i++) {
            if ((right >> i & 1) == 0) {
                undo_one(&dot[i], rig, &u_px_q12[first + i], &v_px_q12[first + i]);
            }
        }
    }
    return first;
}

#endif

void ih_undistort_dots(const struct ih_dots *dots, const struct ih_rig *rig,
                       int32_t u_px_q12[IH_DOTS_MAX], int32_t v_px_q12[IH_DOTS_MAX])
{
    int32_t i = 0;
#ifdef LANES
    if (is_mild(rig)) {
        i = undo_fours(dots, rig, u_px_q12, v_px_q12);
    }
#endif
    for (; i < dots->dot_count; i++) {
        undo_one(&dots->dot[i], rig, &u_px_q12[i], &v_px_q12[i]);
    }
}
