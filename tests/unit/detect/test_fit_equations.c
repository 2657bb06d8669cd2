/* ih_fit_equations against the plain way: every point, one product after the other, without vectors. To the last
 * bit. */
#include "base/ih_cholesky.h"
#include "detect/ih_fit_equations.h"

#include <stdlib.h>

#include "ih_test.h"
#include "ih_test_cross.h"
#include "ih_test_scene.h"

static struct ih_fit_scratch scratch;

void setUp(void)
{
    memset(&rays, 0, sizeof rays);
}

void tearDown(void)
{
}

/* a b / 2^bits, rounded, of sizes. */
static int64_t plain_product(int64_t a, int64_t b, int bits)
{
    return (llabs(a) * llabs(b) + (1LL << (bits - 1))) >> bits;
}

/* One point's or push's row, from its place and gradient. */
struct plain {
    int64_t component_q14[3], residual_mm_q8, inverse;
};

/* What is put before a root of 32 bits, twice as many zeros as this. */
static int zeros_of(int64_t square)
{
    int half = 0;

    while (square << (2 * half) < 1LL << 30) {
        half++;
    }
    return half;
}

static bool plain_gradient(const struct ih_ellipsoid *e, const int32_t place[3], struct plain *out)
{
    int64_t radius2 = 0, length2 = 0, square, r, root, radius;
    int axis, half;

    for (axis = 0; axis < 3; axis++) {
        const int64_t size =
            plain_product(place[axis], ((1LL << 50) / e->semi_mm_q8[axis] + 1) >> 7, 29);

        out->component_q14[axis] = place[axis] < 0 ? -size : size;
        radius2 += plain_product(place[axis], place[axis], 6);
        length2 += plain_product(size, size, 6);
    }
    if (radius2 < 10481) {
        return false;
    }
    half = zeros_of(radius2);
    square = radius2 << (2 * half);
    r = ih_inverse_root_q15((uint32_t)square);
    root = (square >> 16) * r >> 15;
    radius = ((root * 16 + (((square - root * root) >> 4) * r >> 24)) >> half) + 1;
    radius /= 2;
    half = zeros_of(length2);
    out->inverse = (int64_t)ih_inverse_root_q15((uint32_t)(length2 << (2 * half))) << half >> 3;
    out->residual_mm_q8 = ih_mul_shift(ih_mul_shift(radius, radius - 16384, 14), out->inverse, 17);
    return true;
}

/* Sums with all bits of the products; the right side's are scaled by the caller. */
static void plain_add(struct ih_fit_equations *equations, const struct plain *g,
                      const int32_t place[3], int64_t residual, int64_t weight)
{
    const int64_t ln_inverse = ih_mul_shift(g->inverse, 41943, 16);
    int64_t slope[6];
    int i, j, at = 0;

    for (i = 0; i < 3; i++) {
        const int64_t s2 = ih_mul_shift(place[i], place[i], 14);

        slope[i] = ih_mul_shift(llabs(g->component_q14[i]), g->inverse, 17);
        slope[i] = slope[i] > 16383 ? 16383 : slope[i];
        slope[i] = g->component_q14[i] < 0 ? -slope[i] : slope[i];
        slope[3 + i] = ih_mul_shift(s2, ln_inverse, 18);
    }
    for (i = 0; i < 6; i++) {
        const int64_t size = (weight > 65535 ? 65535 : weight) * llabs(slope[i]) >> 16;
        const int64_t weighted = slope[i] < 0 ? -size : size;

        for (j = 0; j <= i; j++) {
            equations->normal_q16[at++] += weighted * slope[j];
        }
        equations->right_q16[i] += ih_mul_shift(weight, residual, 14) * slope[i];
    }
}

static void plain_scale(struct ih_fit_equations *equations)
{
    int i, j, at = 0;

    for (i = 0; i < 6; i++) {
        for (j = 0; j <= i; j++, at++) {
            equations->normal_q16[at] = ih_shift_round(equations->normal_q16[at], i < 3   ? 12
                                                                                  : j < 3 ? 11
                                                                                          : 10);
        }
        equations->right_q16[i] = ih_shift_round(equations->right_q16[i], i < 3 ? 8 : 7);
    }
}

/* By one over a root, squared twice, and what is low on the head; near what float64 says. */
static int64_t plain_weight(int64_t residual, int64_t scale, int32_t down)
{
    const double ratio = (double)residual / (double)(scale * 256);
    const double lowered = down < 8192 ? 0 : down > 8192 + 4915 ? 0.3 : (down - 8192) / 16384.0;
    const double exact = (1 - lowered * 0.5 / 0.3) / ((1 + ratio * ratio) * (1 + ratio * ratio));
    int64_t sum, low, over, r, inverse, weight;
    int half;

    if (llabs(residual) > 5 * scale * 256) {
        return 0;
    }
    sum = 65536 + ih_div_round(residual * residual, scale * scale);
    half = zeros_of(sum);
    sum <<= 2 * half;
    r = ih_inverse_root_q15((uint32_t)sum);
    inverse = r * r >> 1;
    inverse += (inverse >> 16) * ((4294967295 - ((sum * r >> 15) * r >> 15)) >> 4) >> 12;
    over = down < 8192 ? 0 : down > 8192 + 4915 ? 4915 : down - 8192;
    low = 65536 - (over * 436926 >> 16);
    weight = ih_mul_shift(ih_shift_round(inverse * inverse, 74 - 4 * half), low, 16);
    IH_TEST_WITHIN(0.00005, exact, ih_test_from_q(weight, 16), "weight", residual);
    return weight;
}

/* In the ellipsoid's units. */
static bool plain_place(const struct ih_ellipsoid *e, const int32_t point_mm_q8[3],
                        int32_t place[3])
{
    int axis;

    for (axis = 0; axis < 3; axis++) {
        const int64_t offset = (int64_t)point_mm_q8[axis] - e->centre_mm_q8[axis];
        const int64_t size =
            llabs(offset) > 1 << 23
                ? INT32_MAX
                : plain_product(offset, ((1LL << 50) / e->semi_mm_q8[axis] + 1) >> 7, 29);

        if (size > 8 * 16384) {
            return false;
        }
        place[axis] = (int32_t)(offset < 0 ? -size : size);
    }
    return true;
}

/* Rows that it added. */
static int32_t plain_collect(const struct ih_ellipsoid *e, int32_t scale_mm, int32_t see_through_mm,
                             struct ih_fit_equations *out)
{
    int32_t slot, count = 0;

    memset(out, 0, sizeof *out);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_ray *ray = &rays.ray[slot];
        struct ih_crossing crossing;
        struct plain g;
        int32_t place[3];

        if (ray->state != IH_RAY_SEEN) {
            continue;
        }
        if (plain_place(e, ray->point_mm_q8, place) && plain_gradient(e, place, &g)) {
            const int64_t residual = g.residual_mm_q8;
            const int64_t weight = plain_weight(residual, scale_mm, place[1]);

            if (weight > 0) {
                plain_add(out, &g, place, residual, weight);
                count++;
            }
        }
        if (ih_test_cross(e, rays.origin_mm_q8, ray, &crossing) && crossing.radius2_q14 < 16384 &&
            ray->point_mm_q8[2] - see_through_mm * 256 > crossing.entry_mm_q8 &&
            plain_gradient(e, crossing.nearest_q14, &g)) {
            const int64_t residual = g.residual_mm_q8;

            plain_add(out, &g, crossing.nearest_q14, residual < -30 * 256 ? -30 * 256 : residual,
                      32768);
            count++;
        }
    }
    plain_scale(out);
    return count;
}

static int32_t check(const struct ih_ellipsoid *e, int32_t scale_mm, const char *what,
                     int64_t index)
{
    struct ih_fit_equations expected, found;
    const int32_t see_through_mm = 60;
    const int32_t count = plain_collect(e, scale_mm, see_through_mm, &expected);
    int i;

    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    memset(&found, IH_TEST_FILL, sizeof found);
    ih_rays_fill_table(&rays);
    ih_fit_equations_collect(&rays, e, scale_mm, see_through_mm, &scratch, &found);
    for (i = 0; i < IH_CHOLESKY_PACKED(IH_FIT_UNKNOWNS); i++) {
        IH_TEST_EQUAL(expected.normal_q16[i], found.normal_q16[i], what, index);
    }
    for (i = 0; i < IH_FIT_UNKNOWNS; i++) {
        IH_TEST_EQUAL(expected.right_q16[i], found.right_q16[i], what, index);
    }
    return count;
}

/* Semi-axes that a fit may have; powers of two among them, of which the inverses are exact. */
static void random_axes(struct ih_test_random *random, struct ih_ellipsoid *e)
{
    static const int32_t mean_mm[3] = {78, 113, 98};
    int axis;

    for (axis = 0; axis < 3; axis++) {
        e->semi_mm_q8[axis] =
            ih_test_between(random, 0, 9) == 0
                ? 1 << (axis == 1 ? 15 : 14)
                : (int32_t)ih_test_between(random, mean_mm[axis] * 181, mean_mm[axis] * 363);
    }
}

static int32_t random_scale(struct ih_test_random *random)
{
    static const int32_t scale_mm[] = {24, 16, 8};

    return scale_mm[ih_test_between(random, 0, 2)];
}

/* Heads at and around places of made scenes. */
static void scenes_give_the_plain_sums(void)
{
    struct ih_test_random random = {511};
    int32_t i, pass, axis, rows = 0;

    for (i = 0; i < SCENE_COUNT; i++) {
        make_scene(&vector_scenes[i]);
        for (pass = 0; pass < 40; pass++) {
            const struct ih_ray *ray = &rays.ray[ih_test_between(&random, 0, IH_SLOTS - 1)];
            struct ih_ellipsoid e;

            random_axes(&random, &e);
            for (axis = 0; axis < 3; axis++) {
                e.centre_mm_q8[axis] = ray->point_mm_q8[axis] +
                                       (int32_t)ih_test_between(&random, -(150 << 8), 150 << 8);
            }
            rows += check(&e, random_scale(&random), vector_scenes[i].name, pass);
        }
    }
    TEST_ASSERT_TRUE(rows > 10000);
}

/* Points all over a head's surroundings, so dense that rows fill their room several times; places
 * that are on a half of the last bit, and the ends of reaches. */
static void points_around_give_the_plain_sums(void)
{
    struct ih_test_random random = {512};
    int32_t pass, slot, axis, max = 0;

    for (pass = 0; pass < 1500; pass++) {
        const int32_t around_q8 = (int32_t)ih_test_between(&random, 60, 400) << 8;
        const int32_t scale_mm = random_scale(&random);
        struct ih_ellipsoid e;
        int32_t count;

        random_axes(&random, &e);
        for (axis = 0; axis < 3; axis++) {
            rays.origin_mm_q8[axis] = (int32_t)ih_test_between(&random, -(99 << 8), 99 << 8);
            e.centre_mm_q8[axis] =
                (int32_t)ih_test_between(&random, axis == 2 ? 100 << 8 : -(500 << 8), 1600 << 8);
        }
        for (slot = 0; slot < IH_SLOTS; slot++) {
            struct ih_ray *ray = &rays.ray[slot];

            ray->state = ih_test_between(&random, 0, 9) == 0 ? IH_RAY_EMPTY : IH_RAY_SEEN;
            ray->slope_x_q20 = (int32_t)ih_test_between(&random, -(1 << 20), 1 << 20);
            ray->slope_y_q20 = (int32_t)ih_test_between(&random, -(1 << 20), 1 << 20);
            for (axis = 0; axis < 3; axis++) {
                ray->point_mm_q8[axis] =
                    e.centre_mm_q8[axis] + (int32_t)ih_test_between(&random, -around_q8, around_q8);
            }
            if (ih_test_between(&random, 0, 3) == 0) { /* just where a weight ends, on an axis */
                const int32_t semi_q8 = e.semi_mm_q8[slot % 3];

                for (axis = 0; axis < 3; axis++) {
                    ray->point_mm_q8[axis] = e.centre_mm_q8[axis];
                }
                ray->point_mm_q8[slot % 3] +=
                    semi_q8 + 5 * scale_mm * 256 + (int32_t)ih_test_between(&random, -9, 9);
            }
        }
        count = check(&e, scale_mm, "around", pass);
        max = count > max ? count : max;
    }
    TEST_ASSERT_TRUE(max > 2 * IH_FIT_ROWS_MAX);
}

/* Rays of all slopes that graze the ellipsoid or go through it, points behind; and origins beside,
 * behind and within. */
static void pushes_give_the_plain_sums(void)
{
    struct ih_test_random random = {513};
    int32_t pass, slot, axis, rows = 0;

    for (pass = 0; pass < 1500; pass++) {
        struct ih_ellipsoid e;

        random_axes(&random, &e);
        for (axis = 0; axis < 3; axis++) {
            rays.origin_mm_q8[axis] = (int32_t)ih_test_between(&random, -(900 << 8), 900 << 8);
            e.centre_mm_q8[axis] = (int32_t)ih_test_between(&random, -(900 << 8), 900 << 8);
        }
        e.centre_mm_q8[2] = rays.origin_mm_q8[2] +
                            (pass % 5 == 0 ? (int32_t)ih_test_between(&random, -2000, 2000)
                                           : (int32_t)ih_test_between(&random, 0, 15000 << 8));
        for (slot = 0; slot < IH_SLOTS; slot++) {
            struct ih_ray *ray = &rays.ray[slot];
            const int64_t depth = (int64_t)e.centre_mm_q8[2] - rays.origin_mm_q8[2];
            int32_t slope[2];

            for (axis = 0; axis < 2; axis++) { /* at the centre's depth, 1.4 semi-axes around it */
                const int64_t off = (int64_t)e.centre_mm_q8[axis] - rays.origin_mm_q8[axis] +
                                    ih_test_between(&random, -7, 7) * e.semi_mm_q8[axis] / 5;

                slope[axis] = ih_saturate_s32(ih_div_round(off * 1048576, depth > 0 ? depth : 1));
                slope[axis] = ih_clamp_s32(slope[axis], -(4 << 20), 4 << 20);
            }
            ray->slope_x_q20 = slope[0];
            ray->slope_y_q20 = slope[1];
            see(slot, e.centre_mm_q8[2] + (int32_t)ih_test_between(&random, -(150 << 8), 400 << 8));
        }
        rows += check(&e, random_scale(&random), "push", pass);
    }
    TEST_ASSERT_TRUE(rows > 100000);
}

static void nothing_seen_adds_nothing(void)
{
    struct ih_ellipsoid e = ih_ellipsoid_mean((const int32_t[3]){0, 0, 900 << 8});

    IH_TEST_EQUAL(0, check(&e, 24, "nothing", 0), "rows", 0);
    see(360, 900 << 8); /* at the centre: no direction */
    IH_TEST_EQUAL(0, check(&e, 24, "centre", 0), "rows", 0);
    see(360, 802 << 8);
    IH_TEST_EQUAL(1, check(&e, 8, "front", 0), "rows", 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(scenes_give_the_plain_sums);
    RUN_TEST(points_around_give_the_plain_sums);
    RUN_TEST(pushes_give_the_plain_sums);
    RUN_TEST(nothing_seen_adds_nothing);
    return UNITY_END();
}
