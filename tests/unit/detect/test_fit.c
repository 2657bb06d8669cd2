/* ih_fit against float64, on made scenes with a known head, and at the extremes. */
#include "detect/ih_ellipsoid.h"
#include "detect/ih_fit.h"
#include "detect/ih_fit_equations.h"

#include <stdlib.h>

#include "ih_test.h"
#include "ih_test_scene.h"

struct vector_distance {
    int32_t place_q14[3], semi_mm_q8[3];
    double distance_mm;
};

struct vector_fit {
    int32_t scene;
    struct ih_ellipsoid start;
    double centre_mm[3], semi_mm[3];
    double slack_mm; /* what rounding can make of it */
};

#include "fit.inc"

static struct ih_fit_params params;
static struct ih_fit_scratch scratch;
static struct ih_ellipsoid found;

void setUp(void)
{
    ih_fit_params_default(&params);
    params.see_through_mm = VECTOR_SEE_THROUGH_MM;
    make_rays(&vector_rays[0]);
    memset(&found, IH_TEST_FILL, sizeof found);
}

void tearDown(void)
{
}

static void fit(const struct ih_ellipsoid *start)
{
    struct ih_fit whole;

    ih_rays_fill_table(&rays);
    ih_fit_begin(start, &whole);
    ih_fit_continue(&rays, &params, params.step_count, &scratch, &whole);
    found = whole.ellipsoid;
}

/* A mean head beside the true one. */
static struct ih_ellipsoid start_beside(const double centre_mm[3], double x, double y, double z)
{
    const int32_t centre[3] = {(int32_t)lround((centre_mm[0] + x) * 256),
                               (int32_t)lround((centre_mm[1] + y) * 256),
                               (int32_t)lround((centre_mm[2] + z) * 256)};

    return ih_ellipsoid_mean(centre);
}

static double max_difference(const struct ih_ellipsoid *a, const struct ih_ellipsoid *b)
{
    double max = 0;
    int axis;

    for (axis = 0; axis < 3; axis++) {
        max = fmax(max, abs(a->centre_mm_q8[axis] - b->centre_mm_q8[axis]) / 256.0);
        max = fmax(max, abs(a->semi_mm_q8[axis] - b->semi_mm_q8[axis]) / 256.0);
    }
    return max;
}

static bool distance_of(const struct ih_ellipsoid *ellipsoid, const int32_t place_q14[3],
                        int32_t *distance_mm_q8)
{
    const struct ih_fractions fractions = ih_ellipsoid_fractions(ellipsoid->semi_mm_q8);

    return ih_ellipsoid_distance(&fractions, place_q14, distance_mm_q8);
}

static void distances_match_float64(void)
{
    int i, axis;

    for (i = 0; i < IH_TEST_COUNT(vector_distances); i++) {
        const struct vector_distance *v = &vector_distances[i];
        struct ih_ellipsoid ellipsoid = {{0, 0, 0}, {0, 0, 0}};
        double radius2 = 0;
        int32_t distance;

        memcpy(ellipsoid.semi_mm_q8, v->semi_mm_q8, sizeof v->semi_mm_q8);
        for (axis = 0; axis < 3; axis++) {
            radius2 += pow(ih_test_from_q(v->place_q14[axis], 14), 2);
        }
        TEST_ASSERT_TRUE(distance_of(&ellipsoid, v->place_q14, &distance));
        /* The radius is rounded to 2^-14 of 160 mm; the gradient, which is about 0.6 of the radius,
         * to 2^-14. */
        IH_TEST_WITHIN(0.02 + 1e-4 * fabs(v->distance_mm) / sqrt(radius2), v->distance_mm,
                       ih_test_from_q(distance, 8), "distance", i);
    }
}

static void distances_along_an_axis_are_exact_and_the_centre_has_none(void)
{
    const struct ih_ellipsoid head = ih_ellipsoid_mean((const int32_t[3]){0, 0, 0});
    int32_t axis, distance;

    for (axis = 0; axis < 3; axis++) {
        int32_t place[3] = {0, 0, 0};

        TEST_ASSERT_FALSE(distance_of(&head, place, &distance));
        place[axis] = 818;
        TEST_ASSERT_FALSE(distance_of(&head, place, &distance));
        place[axis] = -819;
        TEST_ASSERT_TRUE(distance_of(&head, place, &distance));
        TEST_ASSERT_TRUE(distance < 0);
        place[axis] = 1 << 14;
        TEST_ASSERT_TRUE(distance_of(&head, place, &distance));
        TEST_ASSERT_EQUAL_INT32(0, distance);
        place[axis] = -(3 << 13);
        TEST_ASSERT_TRUE(distance_of(&head, place, &distance));
        IH_TEST_WITHIN(0.02, head.semi_mm_q8[axis] / 512.0, ih_test_from_q(distance, 8), "half",
                       axis);
    }
}

static void fits_match_float64(void)
{
    int i, axis;

    for (i = 0; i < IH_TEST_COUNT(vector_fits); i++) {
        const struct vector_fit *v = &vector_fits[i];
        const struct vector_scene *scene = &vector_scenes[v->scene];
        /* Residuals are rounded to 1/256 mm and places to 1/100 mm; dozens of points average that
         * out, six steps add it up: measured 0.01 mm. */
        const double tolerance = 0.02 + v->slack_mm;

        make_scene(scene);
        fit(&v->start);
        for (axis = 0; axis < 3; axis++) {
            IH_TEST_WITHIN(tolerance, v->centre_mm[axis],
                           ih_test_from_q(found.centre_mm_q8[axis], 8), scene->name, i);
            IH_TEST_WITHIN(tolerance, v->semi_mm[axis], ih_test_from_q(found.semi_mm_q8[axis], 8),
                           scene->name, i);
        }
    }
}

/* From 30 mm off on any side. A head that is larger than the mean by 8 mm is made smaller by the
 * prior: only its front is seen, so its centre comes nearer. */
static void heads_are_recovered(void)
{
    static const struct {
        const char *scene;
        double limit_mm;
    } cases[] = {{"ball", 3}, {"head", 10},         {"person", 5}, {"person_wide", 10},
                 {"hand", 6}, {"person_range", 10}, {"side", 2},   {"shelf", 3},
                 {"near", 4}, {"far", 5},           {"wild", 20}};
    int i, side;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const struct vector_scene *scene = scene_named(cases[i].scene);

        make_scene(scene);
        for (side = 0; side < 6; side++) {
            const double off = side < 3 ? 30 : -30;
            const struct ih_ellipsoid start =
                start_beside(scene->centre_mm, side % 3 == 0 ? off : 0, side % 3 == 1 ? off : 0,
                             side % 3 == 2 ? off : 0);

            fit(&start);
            IH_TEST_WITHIN(cases[i].limit_mm, 0, distance_mm(found.centre_mm_q8, scene->centre_mm),
                           scene->name, side);
        }
    }
}

/* Points that are off by more than the robust scale hardly count: a fifth of a head's points moved
 * 40 to 300 mm to the front, as by a hand, changes little. */
static void points_in_front_change_little(void)
{
    const struct vector_scene *scene = scene_named("person_wide");
    const struct ih_ellipsoid start = start_beside(scene->centre_mm, 20, 10, -20);
    struct ih_ellipsoid clean;
    struct ih_test_random random = {305};
    int32_t slot, moved = 0;

    make_scene(scene);
    fit(&start);
    clean = found;
    for (slot = 0; slot < IH_SLOTS; slot++) {
        if (rays.ray[slot].state == IH_RAY_SEEN && rays.ray[slot].point_mm_q8[2] < 1000 << 8 &&
            ih_test_between(&random, 0, 4) == 0) {
            see(slot, rays.ray[slot].point_mm_q8[2] -
                          (int32_t)ih_test_between(&random, 40 << 8, 300 << 8));
            moved++;
        }
    }
    TEST_ASSERT_TRUE(moved > 6);
    fit(&start);
    IH_TEST_WITHIN(4, 0, max_difference(&clean, &found), "hand", moved);
}

/* A wall seen through the left half of where a head was thought to be, and nothing known of the
 * right half: it moves to the right. A wall that is not far enough behind does nothing. */
static void what_is_seen_through_pushes(void)
{
    const double centre[3] = {0, 0, 900};
    const struct ih_ellipsoid start = start_beside(centre, 0, 0, 0);
    int32_t slot;

    make_rays(&vector_rays[2]);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        if (slot % IH_GRID < IH_GRID / 2) {
            see(slot, 1300 << 8);
        }
    }
    fit(&start);
    /* Until the rays pass: the last column seen is 26 mm left of the middle, 23 on the head. */
    IH_TEST_WITHIN(10, start.semi_mm_q8[0] / 256.0 - 23, found.centre_mm_q8[0] / 256.0, "aside", 0);
    TEST_ASSERT_EQUAL_INT32(0, found.centre_mm_q8[1]);
    IH_TEST_WITHIN(5, 900, found.centre_mm_q8[2] / 256.0, "deep", 0);
    params.see_through_mm = 1300;
    fit(&start);
    TEST_ASSERT_EQUAL_MEMORY(&start, &found, sizeof start);
}

/* Nothing seen, whether that says something or not: the centre stays, the axes go to the mean's. */
static void with_nothing_seen_only_the_prior_is_left(void)
{
    const int32_t centre[3] = {-12345, 6789, 256000};
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(centre);
    struct ih_ellipsoid start = mean;
    int32_t slot, pass;

    for (pass = 0; pass < 2; pass++) {
        for (slot = 0; slot < IH_SLOTS; slot++) {
            lose(slot, pass == 0 ? IH_RAY_UNKNOWN : IH_RAY_EMPTY);
        }
        fit(&mean);
        TEST_ASSERT_EQUAL_MEMORY(&mean, &found, sizeof mean);
        start.semi_mm_q8[0] = 100 << 8;
        start.semi_mm_q8[1] = 85 << 8;
        start.semi_mm_q8[2] = 138 << 8;
        fit(&start);
        TEST_ASSERT_EQUAL_INT32_ARRAY(centre, found.centre_mm_q8, 3);
        IH_TEST_WITHIN(0.01, 0, max_difference(&mean, &found), "axes", pass);
    }
}

/* One point 20 mm before the surface pulls towards itself, and not beyond; a point in the middle,
 * where no direction is, does nothing; many equal ones bring the surface to where they are. */
static void single_and_equal_points(void)
{
    const int32_t centre[3] = {0, 0, 256000};
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(centre);
    const int32_t place[3] = {0, 0, 256000 - mean.semi_mm_q8[2] - (20 << 8)};
    const double front = (centre[2] - mean.semi_mm_q8[2]) / 256.0;
    double reached;
    int32_t slot;

    memset(rays.origin_mm_q8, 0, sizeof rays.origin_mm_q8);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot] = (struct ih_ray){.state = IH_RAY_UNKNOWN};
    }
    rays.ray[7].state = IH_RAY_SEEN;
    memcpy(rays.ray[7].point_mm_q8, place, sizeof place);
    fit(&mean);
    reached = (found.centre_mm_q8[2] - found.semi_mm_q8[2]) / 256.0;
    TEST_ASSERT_TRUE(reached < front && reached > front - 20);
    TEST_ASSERT_EQUAL_INT32(0, found.centre_mm_q8[0]);
    TEST_ASSERT_EQUAL_INT32(0, found.centre_mm_q8[1]);

    memcpy(rays.ray[7].point_mm_q8, centre, sizeof centre);
    fit(&mean);
    TEST_ASSERT_EQUAL_MEMORY(&mean, &found, sizeof mean);

    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot].state = IH_RAY_SEEN;
        memcpy(rays.ray[slot].point_mm_q8, place, sizeof place);
    }
    fit(&mean);
    IH_TEST_WITHIN(0.1, front - 20, (found.centre_mm_q8[2] - found.semi_mm_q8[2]) / 256.0, "front",
                   0);
}

/* Left is right in a mirror. Roundings of halves differ, six steps long. */
static void a_mirrored_scene_gives_a_mirrored_fit(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_fits); i++) {
        const struct vector_fit *v = &vector_fits[i];
        struct ih_ellipsoid start = v->start, straight;

        make_scene(&vector_scenes[v->scene]);
        fit(&start);
        straight = found;
        straight.centre_mm_q8[0] = -straight.centre_mm_q8[0];
        mirror_rays();
        start.centre_mm_q8[0] = -start.centre_mm_q8[0];
        fit(&start);
        IH_TEST_WITHIN(0.02 + v->slack_mm, 0, max_difference(&straight, &found), "mirror", i);
    }
}

/* The scene with its projector somewhere else: differences are all that counts, to the last bit.
 * And so is the order in which the slots come. */
static void place_and_order_do_not_matter(void)
{
    static const int32_t by[3] = {300000, -123456, 3000001};
    int i, axis;

    for (i = 0; i < IH_TEST_COUNT(vector_fits); i++) {
        const struct vector_fit *v = &vector_fits[i];
        struct ih_ellipsoid start = v->start, before;
        int32_t slot;

        make_scene(&vector_scenes[v->scene]);
        fit(&start);
        before = found;
        for (slot = 0; slot < IH_SLOTS / 2; slot++) {
            const struct ih_ray swap = rays.ray[slot];

            rays.ray[slot] = rays.ray[IH_SLOTS - 1 - slot];
            rays.ray[IH_SLOTS - 1 - slot] = swap;
        }
        fit(&start);
        TEST_ASSERT_EQUAL_MEMORY(&before, &found, sizeof found);
        move_rays(by);
        for (axis = 0; axis < 3; axis++) {
            start.centre_mm_q8[axis] += by[axis];
            before.centre_mm_q8[axis] += by[axis];
        }
        fit(&start);
        TEST_ASSERT_EQUAL_MEMORY(&before, &found, sizeof found);
    }
}

/* Points, slopes, origins and starts of all sizes that the stages before can give. The result keeps
 * to the limits of six steps and of the axes; the sanitizers watch the rest. */
static void random_input_stays_within_the_limits(void)
{
    struct ih_test_random random = {306};
    const struct ih_ellipsoid mean = ih_ellipsoid_mean((const int32_t[3]){0, 0, 0});
    int32_t pass, slot, axis;

    for (pass = 0; pass < 300; pass++) {
        const int32_t spread = (int32_t)ih_test_between(&random, 4, 26);
        struct ih_ellipsoid start;

        for (axis = 0; axis < 3; axis++) {
            rays.origin_mm_q8[axis] = (int32_t)ih_test_between(&random, -(1000 << 8), 1000 << 8);
            start.centre_mm_q8[axis] =
                (int32_t)ih_test_between(&random, axis < 2 ? -(64000 << 8) : 0, 64000 << 8) >>
                (pass % 7);
            start.semi_mm_q8[axis] = (int32_t)lround(
                mean.semi_mm_q8[axis] *
                exp(VECTOR_LN_MAX * (pass % 3 == 0   ? 1
                                     : pass % 3 == 1 ? -1
                                                     : 2 * ih_test_unit(&random) - 1)));
        }
        for (slot = 0; slot < IH_SLOTS; slot++) {
            struct ih_ray *ray = &rays.ray[slot];

            ray->state = (int32_t)ih_test_between(&random, 0, 5) == 0 ? IH_RAY_EMPTY : IH_RAY_SEEN;
            for (axis = 0; axis < 3; axis++) { /* around the start, near or far */
                ray->point_mm_q8[axis] =
                    (int32_t)(start.centre_mm_q8[axis] + ih_test_any_size(&random, spread));
            }
            ray->slope_x_q20 = (int32_t)ih_test_any_size(&random, 22);
            ray->slope_y_q20 = (int32_t)ih_test_any_size(&random, 22);
            if (slot % 2 == 0) { /* a ray through the start */
                const double depth = start.centre_mm_q8[2] - rays.origin_mm_q8[2] + 0.5;
                double x = (start.centre_mm_q8[0] - rays.origin_mm_q8[0] +
                            (double)ih_test_any_size(&random, 15)) /
                           depth;

                x = x > 4 ? 4 : x < -4 ? -4 : x;
                ray->slope_x_q20 = (int32_t)lround(x * 1048576);
            }
        }
        fit(&start);
        for (axis = 0; axis < 3; axis++) {
            IH_TEST_RANGE(-(240 << 8), 240 << 8,
                          found.centre_mm_q8[axis] - start.centre_mm_q8[axis], "centre", pass);
            IH_TEST_WITHIN(VECTOR_LN_MAX + 1e-4, 0,
                           log((double)found.semi_mm_q8[axis] / mean.semi_mm_q8[axis]), "axis",
                           pass);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(distances_match_float64);
    RUN_TEST(distances_along_an_axis_are_exact_and_the_centre_has_none);
    RUN_TEST(fits_match_float64);
    RUN_TEST(heads_are_recovered);
    RUN_TEST(points_in_front_change_little);
    RUN_TEST(what_is_seen_through_pushes);
    RUN_TEST(with_nothing_seen_only_the_prior_is_left);
    RUN_TEST(single_and_equal_points);
    RUN_TEST(a_mirrored_scene_gives_a_mirrored_fit);
    RUN_TEST(place_and_order_do_not_matter);
    RUN_TEST(random_input_stays_within_the_limits);
    return UNITY_END();
}
