/* ih_ellipsoid against the closed form in float64, at the extremes, and cases reasoned by hand. */
#include "base/ih_fix.h"

#include "ih_test.h"
#include "ih_test_cross.h"

struct vector_crossing {
    bool is_wild; /* slopes up to 4 and any semi-axes; else a head and slopes up to 0.5 */
    int32_t centre_mm_q8[3], semi_mm_q8[3], origin_mm_q8[3], slope_q20[2];
    bool in_reach;
    double nearest[3], radius2, entry_mm;
};

#include "ellipsoid.inc"

static const int32_t zero[3] = {0, 0, 0};

void setUp(void)
{
}

void tearDown(void)
{
}

static struct ih_ray ray_of(int32_t slope_x_q20, int32_t slope_y_q20)
{
    return (struct ih_ray){.slope_x_q20 = slope_x_q20, .slope_y_q20 = slope_y_q20};
}

static struct ih_ellipsoid ball(int32_t x_mm, int32_t y_mm, int32_t z_mm, int32_t radius_mm)
{
    return (struct ih_ellipsoid){{x_mm * 256, y_mm * 256, z_mm * 256},
                                 {radius_mm << 8, radius_mm << 8, radius_mm << 8}};
}

static void the_mean_head_is_the_references(void)
{
    const int32_t centre[3] = {-5, 7, 250000};
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(centre);
    int axis;

    for (axis = 0; axis < 3; axis++) {
        TEST_ASSERT_EQUAL_INT32(centre[axis], mean.centre_mm_q8[axis]);
        TEST_ASSERT_EQUAL_INT32(vector_mean_mm[axis] << 8, mean.semi_mm_q8[axis]);
    }
}

static void crossings_match_float64(void)
{
    int i, axis;

    for (i = 0; i < IH_TEST_COUNT(vector_crossings); i++) {
        const struct vector_crossing *v = &vector_crossings[i];
        const struct ih_ray ray = ray_of(v->slope_q20[0], v->slope_q20[1]);
        /* e, g and tau are rounded to 2^-15 each; nearest takes g times tau's and tau times g's,
         * radius2 e.g times tau's. |g| is up to 1 with a head, up to 28 with what is wild. */
        const double place = v->is_wild ? 0x1p-10 : 0x1p-13;
        const double entry = v->is_wild ? 0.12 : 0.06;
        struct ih_ellipsoid ellipsoid;
        struct ih_crossing crossing;

        memcpy(ellipsoid.centre_mm_q8, v->centre_mm_q8, sizeof v->centre_mm_q8);
        memcpy(ellipsoid.semi_mm_q8, v->semi_mm_q8, sizeof v->semi_mm_q8);
        IH_TEST_EQUAL(v->in_reach, ih_test_cross(&ellipsoid, v->origin_mm_q8, &ray, &crossing),
                      "reach", i);
        if (!v->in_reach) {
            continue;
        }
        for (axis = 0; axis < 3; axis++) {
            IH_TEST_WITHIN(place, v->nearest[axis], ih_test_from_q(crossing.nearest_q14[axis], 14),
                           "nearest", i);
        }
        IH_TEST_WITHIN(v->is_wild ? 0.005 : 0.0004, v->radius2,
                       ih_test_from_q(crossing.radius2_q14, 14), "radius2", i);
        /* A ray that just touches: the root of a small difference. */
        IH_TEST_WITHIN(v->radius2 > 0.99 && v->radius2 < 1.0 ? 0.3 : entry, v->entry_mm,
                       ih_test_from_q(crossing.entry_mm_q8, 8), "entry", i);
    }
}

/* Straight ahead at a ball: the ray enters where the circle is, and beside the ball its nearest
 * place is at the centre's depth. */
static void a_ball_straight_ahead(void)
{
    const struct ih_ray ray = ray_of(0, 0);
    struct ih_crossing crossing;
    int32_t x;

    for (x = -800; x <= 800; x += 20) {
        const struct ih_ellipsoid at = ball(x, 0, 1000, 100);
        const double depth = x > -100 && x < 100 ? 1000 - sqrt(10000.0 - x * x) : 1000;

        TEST_ASSERT_TRUE(ih_test_cross(&at, zero, &ray, &crossing));
        IH_TEST_WITHIN(1e-4, -x / 100.0, ih_test_from_q(crossing.nearest_q14[0], 14), "near", x);
        IH_TEST_EQUAL(0, crossing.nearest_q14[1], "up", x);
        IH_TEST_EQUAL(0, crossing.nearest_q14[2], "deep", x);
        IH_TEST_WITHIN(0.02, depth, ih_test_from_q(crossing.entry_mm_q8, 8), "entry", x);
    }
}

/* The reach ends at 8 semi-axes, that included, on either axis and side. */
static void what_passes_far_away_is_not_looked_at(void)
{
    const struct ih_ray ray = ray_of(0, 0);
    struct ih_crossing crossing;
    int i;

    for (i = 0; i < 4; i++) {
        const int32_t step = i < 2 ? 1 : -1;
        struct ih_ellipsoid at = ball(0, 0, 1000, 100);

        at.centre_mm_q8[i % 2] = step * 800 * 256;
        TEST_ASSERT_TRUE(ih_test_cross(&at, zero, &ray, &crossing));
        at.centre_mm_q8[i % 2] += step;
        memset(&crossing, IH_TEST_FILL, sizeof crossing);
        TEST_ASSERT_FALSE(ih_test_cross(&at, zero, &ray, &crossing));
        IH_TEST_UNTOUCHED(&crossing, sizeof crossing, "a far crossing");
    }
}

/* Left is right in a mirror, to the last bit but one: halves round upwards. */
static void a_mirror_changes_the_sign_alone(void)
{
    struct ih_test_random random = {303};
    int i;

    for (i = 0; i < 500; i++) {
        const int32_t slope = (int32_t)ih_test_between(&random, -(1 << 19), 1 << 19);
        const int32_t x = (int32_t)ih_test_between(&random, -150, 150);
        const struct ih_ray ray = ray_of(slope, 20000), back = ray_of(-slope, 20000);
        const struct ih_ellipsoid at = ball(slope * 1000 / (1 << 20) + x, 30, 1000, 90);
        struct ih_ellipsoid mirrored = at;
        struct ih_crossing a, b;

        mirrored.centre_mm_q8[0] = -at.centre_mm_q8[0];
        TEST_ASSERT_TRUE(ih_test_cross(&at, zero, &ray, &a));
        TEST_ASSERT_TRUE(ih_test_cross(&mirrored, zero, &back, &b));
        IH_TEST_RANGE(-3, 3, a.nearest_q14[0] + b.nearest_q14[0], "nearest", i);
        IH_TEST_RANGE(-3, 3, a.nearest_q14[2] - b.nearest_q14[2], "deep", i);
        IH_TEST_RANGE(-8, 8, a.radius2_q14 - b.radius2_q14, "radius2", i);
    }
}

static void places_are_in_semi_axes(void)
{
    const struct ih_ellipsoid head = ih_ellipsoid_mean((const int32_t[3]){100, -200, 300});
    const struct ih_fractions fractions = ih_ellipsoid_fractions(head.semi_mm_q8);
    int32_t point[3], place[3], axis;

    for (axis = 0; axis < 3; axis++) {
        memcpy(point, head.centre_mm_q8, sizeof point);
        point[axis] += head.semi_mm_q8[axis];
        TEST_ASSERT_TRUE(ih_ellipsoid_position(&head, &fractions, point, place));
        TEST_ASSERT_EQUAL_INT32(1 << 14, place[axis]);
        TEST_ASSERT_EQUAL_INT32(0, place[(axis + 1) % 3] | place[(axis + 2) % 3]);
        point[axis] += 7 * head.semi_mm_q8[axis];
        TEST_ASSERT_TRUE(ih_ellipsoid_position(&head, &fractions, point, place));
        TEST_ASSERT_EQUAL_INT32(8 << 14, place[axis]);
        point[axis] += 2;
        TEST_ASSERT_FALSE(ih_ellipsoid_position(&head, &fractions, point, place));
        point[axis] = INT32_MIN;
        TEST_ASSERT_FALSE(ih_ellipsoid_position(&head, &fractions, point, place));
    }
}

/* Everything at the limits that the headers name, in every combination of signs and at random: the
 * sanitizers watch, and what is said stays within what follows from the reach. */
static void the_extremes_do_not_overflow(void)
{
    static const int32_t semi_mm[] = {IH_ELLIPSOID_SEMI_MIN_MM, IH_ELLIPSOID_SEMI_MAX_MM};
    const int32_t slope_max = IH_RAYS_SLOPE_MAX << 20;
    struct ih_test_random random = {304};
    int32_t i, axis, hits = 0;

    for (i = 0; i < 40000; i++) {
        struct ih_ellipsoid at;
        struct ih_crossing crossing;
        int32_t origin[3], slope[2];

        for (axis = 0; axis < 3; axis++) {
            at.semi_mm_q8[axis] = semi_mm[ih_test_between(&random, 0, 1)] << 8;
            origin[axis] = (i & 1 << axis) != 0 ? 1000 << 8 : -(1000 << 8);
        }
        at.centre_mm_q8[2] = (i & 8) != 0 ? (int32_t)ih_test_any_size(&random, 26)
                                          : (int32_t)ih_test_between(&random, 0, 16000 << 8);
        for (axis = 0; axis < 2; axis++) {
            slope[axis] = (i & 16) != 0 ? slope_max : (int32_t)ih_test_any_size(&random, 22);
            slope[axis] = ih_test_between(&random, 0, 1) == 0 ? slope[axis] : -slope[axis];
            at.centre_mm_q8[axis] =
                (int32_t)(origin[axis] +
                          ((int64_t)(at.centre_mm_q8[2] - origin[2]) * slope[axis] >> 20) +
                          ih_test_any_size(&random, 19));
        }
        const struct ih_ray ray = ray_of(slope[0], slope[1]);

        if ((i & 32) != 0) { /* through the middle, which is only before or behind */
            for (axis = 0; axis < 2; axis++) {
                at.centre_mm_q8[axis] =
                    (int32_t)(origin[axis] +
                              ((int64_t)(at.centre_mm_q8[2] - origin[2]) * slope[axis] >> 20));
            }
            at.centre_mm_q8[2] += (int32_t)ih_test_any_size(&random, 10);
        }
        if (!ih_test_cross(&at, origin, &ray, &crossing)) {
            continue;
        }
        hits += crossing.radius2_q14 < 1 << 14;
        for (axis = 0; axis < 2; axis++) {
            IH_TEST_RANGE(-(12 << 14), 12 << 14, crossing.nearest_q14[axis], "nearest", i);
        }
        /* |tau| <= |e| |g| / (1 + g^2) <= |e| / 2. */
        IH_TEST_RANGE(-(6 << 14), 6 << 14, crossing.nearest_q14[2], "deep", i);
        IH_TEST_RANGE(0, 128 << 14, crossing.radius2_q14, "radius2", i);
        IH_TEST_RANGE(-7 * at.semi_mm_q8[2], 6 * at.semi_mm_q8[2],
                      crossing.entry_mm_q8 - at.centre_mm_q8[2], "entry", i);
    }
    TEST_ASSERT_TRUE(hits > 1000);
}

/* Does the ray pass through the box at the centre's depth? */
static bool is_in_box(const struct ih_ellipsoid *at, const struct ih_ellipsoid_box *box,
                      const int32_t origin_mm_q8[3], const struct ih_ray *ray)
{
    const double slope[2] = {ray->slope_x_q20 / 1048576.0, ray->slope_y_q20 / 1048576.0};
    const double depth = at->centre_mm_q8[2] - origin_mm_q8[2];
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const double aside = origin_mm_q8[axis] + depth * slope[axis] - at->centre_mm_q8[axis];

        if (fabs(aside) > box->half_mm_q8[axis]) {
            return false;
        }
    }
    return true;
}

/* Whatever comes nearer than the radius passes through the box; of what passes far away, most does
 * not, or the box would be of no use. */
static void the_box_misses_nothing(void)
{
    struct ih_test_random random = {305};
    int32_t i, axis, near = 0, far = 0, far_in_box = 0;

    for (i = 0; i < 100000; i++) {
        const int32_t steepest = i % 2 == 0 ? 1 << 19 : IH_RAYS_SLOPE_MAX << 20;
        const int32_t slope_max[2] = {steepest, steepest / 2};
        const int32_t radius2_q14 = (int32_t)ih_test_between(&random, 1 << 12, 4 << 14);
        const int32_t origin[3] = {0, 12 << 8, (int32_t)ih_test_between(&random, -2000, 2000)};
        struct ih_ellipsoid at = {.centre_mm_q8[2] =
                                      (int32_t)ih_test_between(&random, 300 << 8, 4000 << 8)};
        const struct ih_ray ray =
            ray_of((int32_t)ih_test_between(&random, -slope_max[0], slope_max[0]),
                   (int32_t)ih_test_between(&random, -slope_max[1], slope_max[1]));
        const int32_t slope[2] = {ray.slope_x_q20, ray.slope_y_q20};
        struct ih_crossing crossing;

        for (axis = 0; axis < 3; axis++) {
            at.semi_mm_q8[axis] = (int32_t)ih_test_between(&random, IH_ELLIPSOID_SEMI_MIN_MM << 8,
                                                           IH_ELLIPSOID_SEMI_MAX_MM << 8);
        }
        for (axis = 0; axis < 2; axis++) {
            at.centre_mm_q8[axis] =
                (int32_t)(origin[axis] +
                          ((int64_t)(at.centre_mm_q8[2] - origin[2]) * slope[axis] >> 20) +
                          ih_test_between(&random, -(600 << 8), 600 << 8));
        }
        const struct ih_ellipsoid_box box = ih_ellipsoid_box(&at, slope_max, radius2_q14);
        const bool in_box = is_in_box(&at, &box, origin, &ray);

        if (ih_test_cross(&at, origin, &ray, &crossing) && crossing.radius2_q14 < radius2_q14) {
            TEST_ASSERT_TRUE(in_box);
            near++;
        } else if (i % 2 == 0) {
            far++;
            far_in_box += in_box;
        }
    }
    TEST_ASSERT_GREATER_THAN(5000, near);
    TEST_ASSERT_LESS_THAN(far / 3, far_in_box);
}

/* Products with an inverse against divisions: every semi-axis, offsets around halves of the last bit, on
 * them where there are such, at the ends and anywhere. */
static void fractions_are_the_quotients(void)
{
    struct ih_test_random random = {99};
    int32_t semi, i, near;

    for (semi = IH_ELLIPSOID_SEMI_MIN_MM << 8; semi <= IH_ELLIPSOID_SEMI_MAX_MM << 8; semi++) {
        const int32_t semis[3] = {semi, semi, semi};
        const int64_t inverse_q50 = ih_ellipsoid_fractions(semis).inverse_q50[semi % 3];
        const int32_t step = (semi & (semi - 1)) == 0 ? 1 : 20000;

        for (i = -IH_FRACTION_MAX; i <= IH_FRACTION_MAX; i += step) {
            const int64_t half = 2 * ih_test_between(&random, 0, 1 << 17) + 1;
            const int32_t at = (int32_t)(half * semi / 32768);

            TEST_ASSERT_EQUAL_INT64(ih_div_round((int64_t)i * 16384, semi),
                                    ih_fraction(inverse_q50, i));
            for (near = at - 1; near <= at + 1 && near <= IH_FRACTION_MAX; near++) {
                TEST_ASSERT_EQUAL_INT64(ih_div_round((int64_t)near * 16384, semi),
                                        ih_fraction(inverse_q50, near));
                TEST_ASSERT_EQUAL_INT64(ih_div_round(-(int64_t)near * 16384, semi),
                                        ih_fraction(inverse_q50, -near));
            }
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_mean_head_is_the_references);
    RUN_TEST(crossings_match_float64);
    RUN_TEST(a_ball_straight_ahead);
    RUN_TEST(what_passes_far_away_is_not_looked_at);
    RUN_TEST(a_mirror_changes_the_sign_alone);
    RUN_TEST(places_are_in_semi_axes);
    RUN_TEST(the_extremes_do_not_overflow);
    RUN_TEST(the_box_misses_nothing);
    RUN_TEST(fractions_are_the_quotients);
    return UNITY_END();
}
