/* ih_bound against ih_scan's scores: never below, and what it judges is judged as by crossing every
 * ray, in made scenes, at random, and where all rays are alike and as good as on a limit, so that one
 * of them on the wrong side would show. */
#include "ih_scan.h"

#include "ih_test.h"
#include "ih_test_cross.h"
#include "ih_test_scene.h"

static const double pi = 3.14159265358979323846;

static struct ih_scan_params params;
static struct ih_scan_scratch scratch;
static struct ih_scan scan;

void setUp(void)
{
    ih_scan_params_default(&params);
    params.place_max = 0;
    memset(&space, 0, sizeof space);
}

void tearDown(void)
{
}

/* By how much the bound of a place is above its score, which is the same to the last bit when every
 * ray is crossed with the head, as those are of which 16 bits cannot tell what they are worth. */
static int32_t slack_q12(const int32_t centre_mm_q8[3])
{
    const bool is_usable = scratch.rays.is_usable;
    const int32_t bound_q12 = ih_bound_score_q12(&space, &scratch.rays, centre_mm_q8);
    const int32_t score_q12 = ih_scan_score_q12(&space, &scratch, centre_mm_q8);

    scratch.rays.is_usable = false;
    IH_TEST_EQUAL(ih_scan_score_q12(&space, &scratch, centre_mm_q8), score_q12,
                  "with all rays crossed", 0);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS, scratch.verdict.unsure_count);
    scratch.rays.is_usable = is_usable;
    return bound_q12 - score_q12;
}

static void prepare(void)
{
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    ih_scan_find(&space, &params, &scratch, &scan);
}

/* The bound is of use: it is seldom much above the score. */
static void bounds_are_above_the_scores_by_little(void)
{
    int32_t i, slot, count = 0, wide = 0;
    double sum = 0;

    for (i = 0; i < SCENE_COUNT; i++) {
        make_scene(&vector_scenes[i]);
        prepare();
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const struct ih_ray *ray = &space.ray[slot];
            if (ray->state == IH_RAY_SEEN && ray->point_mm_q8[2] > 300 << 8 &&
                ray->point_mm_q8[2] < 3000 << 8) {
                const int32_t centre[3] = {ray->point_mm_q8[0], ray->point_mm_q8[1],
                                           ray->point_mm_q8[2] + (98 << 8)};
                const int32_t slack = slack_q12(centre);

                IH_TEST_RANGE(0, IH_BOUND_MOST_Q12 + 5571, slack, vector_scenes[i].name, slot);
                count++;
                wide += slack > 1200;
                sum += slack;
            }
        }
    }
    TEST_ASSERT_TRUE(count > 1000);
    TEST_ASSERT_TRUE(wide < count / 20);
    TEST_ASSERT_TRUE(sum / count < 450);
}

/* A ray that passes a mean head's centre at (x, y) semi-axes, at the centre's depth. */
static void aim_at(int32_t slot, const int32_t centre_mm_q8[3], double x, double y)
{
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(centre_mm_q8);
    const double depth = (double)centre_mm_q8[2] - space.origin_mm_q8[2];
    const double off_x = (double)centre_mm_q8[0] - space.origin_mm_q8[0];
    const double off_y = (double)centre_mm_q8[1] - space.origin_mm_q8[1];

    space.ray[slot].slope_x_q20 =
        (int32_t)lround((off_x + x * mean.semi_mm_q8[0]) / depth * 1048576);
    space.ray[slot].slope_y_q20 =
        (int32_t)lround((off_y + y * mean.semi_mm_q8[1]) / depth * 1048576);
}

static double random_in(struct ih_test_random *random, double low, double high)
{
    return low + (high - low) * (double)ih_test_between(random, 0, 1 << 30) / (1 << 30);
}

/* Somewhere a bound is given: to 16 m, at slopes to 0.7. */
static void random_centre(struct ih_test_random *random, int32_t centre_mm_q8[3])
{
    static const int32_t most_mm[] = {500, 1200, 4000, 16000};
    const int32_t depth =
        (int32_t)ih_test_between(random, 230 << 8, most_mm[ih_test_between(random, 0, 3)] << 8);
    int axis;

    for (axis = 0; axis < 3; axis++) {
        space.origin_mm_q8[axis] = (int32_t)ih_test_between(random, -(200 << 8), 200 << 8);
    }
    centre_mm_q8[0] = space.origin_mm_q8[0] + (int32_t)(depth * random_in(random, -0.6, 0.6));
    centre_mm_q8[1] = space.origin_mm_q8[1] + (int32_t)(depth * random_in(random, -0.6, 0.6));
    centre_mm_q8[2] = space.origin_mm_q8[2] + depth;
    if (centre_mm_q8[2] > 16290 << 8) {
        centre_mm_q8[2] = 16290 << 8;
    }
}

/* Sixty rays side by side that pass just about where a limit is: 1, 1.3 or 1.9 radii away, or between
 * beside and below. */
static void rays_that_pass_at_a_limit(void)
{
    static const double radius[] = {1, 1, 1.3, 1.9, 1.6};
    struct ih_test_random random = {411};
    int32_t pass, slot;

    for (pass = 0; pass < 4000; pass++) {
        const int32_t kind = (int32_t)ih_test_between(&random, 0, 4);
        const double angle = kind == 4
                                 ? atan2(78, 113) * (ih_test_between(&random, 0, 1) == 0 ? 1 : -1) +
                                       (ih_test_between(&random, 0, 1) == 0 ? 0 : pi)
                                 : random_in(&random, -pi, pi);
        int32_t centre[3];
        double reach = radius[kind];

        memset(&space, 0, sizeof space);
        random_centre(&random, centre);
        for (slot = 0; slot < IH_SLOTS; slot++) { /* far off, by default */
            space.ray[slot].slope_x_q20 = centre[0] > 0 ? -(1 << 19) : 1 << 19;
        }
        /* What is r radii from the centre passes its depth a little farther off, out of the axis. */
        for (slot = 0; slot < 12; slot++) {
            struct ih_crossing crossing;
            const struct ih_ellipsoid mean = ih_ellipsoid_mean(centre);

            aim_at(0, centre, reach * cos(angle), reach * sin(angle));
            if (!ih_test_cross(&mean, space.origin_mm_q8, &space.ray[0], &crossing)) {
                break;
            }
            reach *= radius[kind] / sqrt(crossing.radius2_q14 / 16384.0);
        }
        for (slot = 0; slot < 60; slot++) {
            const double off = random_in(&random, -0.004, 0.004);
            const double turn = random_in(&random, -0.004, 0.004);
            const int64_t state = ih_test_between(&random, 0, 3);

            aim_at(slot, centre, (reach + off) * cos(angle + turn),
                   (reach + off) * sin(angle + turn));
            if (state < 2) {
                lose(slot, state == 0 ? IH_RAY_EMPTY : IH_RAY_UNKNOWN);
            } else {
                see(slot, centre[2] + (int32_t)ih_test_between(&random, -(250 << 8), 250 << 8));
            }
        }
        prepare();
        IH_TEST_RANGE(0, INT32_MAX, slack_q12(centre), "slack", pass);
    }
}

/* Sixty rays through the head whose points are just about as far behind the entry as a limit says. */
static void points_at_a_limit_of_depth(void)
{
    static const double limit_mm[] = {-28, 28, 60};
    struct ih_test_random random = {412};
    int32_t pass, slot;

    for (pass = 0; pass < 4000; pass++) {
        const double behind = limit_mm[ih_test_between(&random, 0, 2)];
        const double angle = random_in(&random, -pi, pi);
        const double reach = pass % 3 == 0 ? random_in(&random, 0.97, 1) : random_in(&random, 0, 1);
        int32_t centre[3];

        memset(&space, 0, sizeof space);
        random_centre(&random, centre);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            space.ray[slot].slope_x_q20 = centre[0] > 0 ? -(1 << 19) : 1 << 19;
        }
        for (slot = 0; slot < 60; slot++) {
            const struct ih_ellipsoid mean = ih_ellipsoid_mean(centre);
            struct ih_crossing crossing;

            aim_at(slot, centre, (reach + random_in(&random, -0.004, 0.004)) * cos(angle),
                   reach * sin(angle));
            if (ih_test_cross(&mean, space.origin_mm_q8, &space.ray[slot], &crossing)) {
                see(slot, (int32_t)(crossing.entry_mm_q8 +
                                    256 * (behind + random_in(&random, -0.6, 0.6))));
            }
        }
        prepare();
        IH_TEST_RANGE(0, INT32_MAX, slack_q12(centre), "slack", pass);
    }
}

/* Where 16 bits do not reach there is no bound but the greatest score. */
static void out_of_the_limits_any_score_is_possible(void)
{
    static const int32_t centre_mm[][3] = {{0, 0, 200},     {0, 0, 226},      {0, 0, 16301},
                                           {1001, 0, 1000}, {0, -1001, 1000}, {0, 0, -500}};
    int32_t i, axis;

    for (i = 0; i < IH_TEST_COUNT(centre_mm); i++) {
        int32_t centre[3];

        for (axis = 0; axis < 3; axis++) {
            centre[axis] = centre_mm[i][axis] * 256;
        }
        prepare();
        IH_TEST_EQUAL(IH_BOUND_MOST_Q12, ih_bound_score_q12(&space, &scratch.rays, centre),
                      "centre", i);
    }
    prepare();
    TEST_ASSERT_TRUE(scratch.rays.is_usable);
    TEST_ASSERT_TRUE(
        ih_bound_score_q12(&space, &scratch.rays, (const int32_t[3]){0, 0, 1000 << 8}) < 0);
    space.ray[360].slope_y_q20 = 1209000; /* g just below 1 */
    prepare();
    TEST_ASSERT_TRUE(scratch.rays.is_usable);
    space.ray[360].slope_y_q20 = 1209300;
    prepare();
    TEST_ASSERT_FALSE(scratch.rays.is_usable);
    IH_TEST_EQUAL(IH_BOUND_MOST_Q12,
                  ih_bound_score_q12(&space, &scratch.rays, (const int32_t[3]){0, 0, 1000 << 8}),
                  "steep ray", 0);
}

/* Rays, origins and depths of all sizes. */
static void random_spaces_are_bounded(void)
{
    struct ih_test_random random = {413};
    int32_t pass, slot, axis;

    for (pass = 0; pass < 300; pass++) {
        const int bits = (int)ih_test_between(&random, 14, 22);

        for (axis = 0; axis < 3; axis++) {
            space.origin_mm_q8[axis] =
                (int32_t)ih_test_between(&random, -(1000 << 8), 1000 << 8) >> (pass % 3 * 8);
        }
        for (slot = 0; slot < IH_SLOTS; slot++) {
            struct ih_ray *ray = &space.ray[slot];

            ray->slope_x_q20 = (int32_t)ih_test_any_size(&random, bits);
            ray->slope_y_q20 = (int32_t)ih_test_any_size(&random, bits);
            if (ih_test_between(&random, 0, 2) == 0) {
                lose(slot, ih_test_between(&random, 0, 1) == 0 ? IH_RAY_EMPTY : IH_RAY_UNKNOWN);
            } else {
                see(slot, (int32_t)ih_test_between(&random, 1 << 8, 16000 << 8) >> (pass % 5));
            }
        }
        prepare();
        for (slot = pass % 7; slot < IH_SLOTS; slot += 7) {
            const int32_t *point = space.ray[slot].point_mm_q8;
            const int32_t centre[3] = {point[0], point[1], point[2] + (98 << 8)};

            IH_TEST_RANGE(0, INT32_MAX, slack_q12(centre), "slack", slot);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(bounds_are_above_the_scores_by_little);
    RUN_TEST(rays_that_pass_at_a_limit);
    RUN_TEST(points_at_a_limit_of_depth);
    RUN_TEST(out_of_the_limits_any_score_is_possible);
    RUN_TEST(random_spaces_are_bounded);
    return UNITY_END();
}
