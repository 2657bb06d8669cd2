/* ih_template against float64: within what 16 bits may be off by, in made scenes, at random, and where all
 * rays are alike and as good as on a limit, so that one of them on the wrong side would show. */
#include "detect/ih_template.h"

#include <math.h>
#include <stdlib.h>

#include "ih_test.h"
#include "ih_test_scene.h"

static const double pi = 3.14159265358979323846;
static const double semi_mm[3] = {78, 113, 98};

static struct ih_template_table table;

void setUp(void)
{
    memset(&rays, 0, sizeof rays);
}

void tearDown(void)
{
}

static void prepare(void)
{
    memset(&table, IH_TEST_FILL, sizeof table);
    ih_template_prepare(&rays, &table);
}

/* Values of rays: those that surely count, and then those that may, too. */
struct values {
    double sum, may[IH_SLOTS];
    int32_t count, may_count;
};

static double mean_of(double sum, int32_t count)
{
    return sum / (count < 8 ? 8 : count);
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;

    return (x > y) - (x < y);
}

/* The mean farthest to one side: of those that may count some of the best, or the worst, do. */
static double extreme_mean(struct values *values, int sign)
{
    double sum = values->sum, best = mean_of(values->sum, values->count);
    int32_t i;

    qsort(values->may, (size_t)values->may_count, sizeof values->may[0], by_size);
    for (i = 0; i < values->may_count; i++) {
        sum += values->may[sign > 0 ? values->may_count - 1 - i : i];
        if ((mean_of(sum, values->count + i + 1) - best) * sign > 0) {
            best = mean_of(sum, values->count + i + 1);
        }
    }
    return best;
}

static void add(struct values *values, bool must, double value)
{
    if (must) {
        values->sum += value;
        values->count++;
    } else {
        values->may[values->may_count++] = value;
    }
}

/* A ray against a mean head, in float64, in semi-axes; depths in mm. */
struct exact {
    double ex, ey, radius2, steep, tau, depth_mm;
};

static struct exact cross(const struct ih_ray *ray, const int32_t centre_mm_q8[3])
{
    const double away = (centre_mm_q8[2] - rays.origin_mm_q8[2]) / 256.0;
    const double slope[2] = {ray->slope_x_q20 / 1048576.0, ray->slope_y_q20 / 1048576.0};
    double e[2], eg = 0, ee = 0;
    struct exact exact = {.steep = 1, .depth_mm = ray->point_mm_q8[2] / 256.0};
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const double g = slope[axis] * semi_mm[2] / semi_mm[axis];

        e[axis] = (slope[axis] * away - (centre_mm_q8[axis] - rays.origin_mm_q8[axis]) / 256.0) /
                  semi_mm[axis];
        exact.steep += g * g;
        eg += e[axis] * g;
        ee += e[axis] * e[axis];
    }
    exact.ex = e[0];
    exact.ey = e[1];
    exact.tau = -eg / exact.steep;
    exact.radius2 = ee - eg * eg / exact.steep;
    return exact;
}

/* How far a point may be off against the entry. */
static double depth_off_mm(double away_mm)
{
    return (0.0095 + 1.12e-6 * away_mm) * semi_mm[2];
}

/* How far a point is behind where its ray enters, if radius2 is off by so much. */
static double behind_mm(const struct exact *exact, double centre_mm, double off)
{
    const double inside = 1 - exact->radius2 + off;

    return exact->depth_mm - centre_mm - semi_mm[2] * exact->tau +
           semi_mm[2] * sqrt((inside < 0 ? 0 : inside) / exact->steep);
}

/* The minimum, or the maximum, that 16 bits may make of a head, see ih_template.h; as tools/oracle/scan.py. */
static double score_end(const int32_t centre_mm_q8[3], int sign)
{
    const double centre_mm = centre_mm_q8[2] / 256.0;
    const double away = (centre_mm_q8[2] - rays.origin_mm_q8[2]) / 256.0;
    const double off2 = 8.6e-6 * away + 0.0135, off_mm = (1.58e-6 * away + 0.0009) * (78 + 113);
    const double off_depth_mm = depth_off_mm(away);
    static struct values inside, around;
    int32_t slot;

    memset(&inside, 0, sizeof inside);
    memset(&around, 0, sizeof around);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_ray *ray = &rays.ray[slot];
        const struct exact exact = cross(ray, centre_mm_q8);
        const double aside = fabs(exact.ex * 78) - exact.ey * 113;
        const bool seen = ray->state == IH_RAY_SEEN, empty = ray->state == IH_RAY_EMPTY;
        bool is_sure;

        /* Slopes are cut off at 2^-13, g at 2^-14: g.g is off by 0.001 at most. */
        if (exact.steep >= 3.001) {
            continue;
        }
        is_sure = exact.steep < 2.999;
        if (exact.radius2 < 1 + off2) {
            const double low = behind_mm(&exact, centre_mm, -off2) - off_depth_mm;
            const double high = behind_mm(&exact, centre_mm, off2) + off_depth_mm;
            const bool is_on = sign > 0 ? high > -32 && low < 32 : low > -32 && high < 32;
            const bool is_far = sign > 0 ? low >= 32 : high >= 32;

            add(&inside, is_sure && exact.radius2 < 1 - off2,
                seen    ? is_on    ? 1
                          : is_far ? -1
                                   : -10 / 64.0
                : empty ? -38 / 64.0
                        : -10 / 64.0);
        }
        if (exact.radius2 > 1.69 - off2 && exact.radius2 < 3.61 + off2 && aside > -off_mm) {
            const bool is_open = exact.depth_mm > centre_mm + 60 - sign * 1.01;

            add(&around,
                is_sure && exact.radius2 > 1.69 + off2 && exact.radius2 < 3.61 - off2 &&
                    aside > off_mm,
                seen    ? is_open ? 1 : -38 / 64.0
                : empty ? 45 / 64.0
                        : 0);
        }
    }
    return extreme_mean(&inside, sign) + 0.6 * extreme_mean(&around, sign);
}

/* Of means cut off to Q12. The width of what is allowed. */
static double check(const int32_t centre_mm_q8[3], int32_t index)
{
    const double low = score_end(centre_mm_q8, -1), high = score_end(centre_mm_q8, 1);
    const double score = ih_test_from_q(ih_template_score_q12(&rays, &table, centre_mm_q8), 12);

    IH_TEST_WITHIN((high - low) / 2 + 0.0005, (high + low) / 2, score, "score", index);
    return high - low;
}

/* What is allowed is little, most of the time. */
static void scores_are_float64s_in_scenes(void)
{
    int32_t i, slot, count = 0, wide = 0;
    double sum = 0;

    for (i = 0; i < SCENE_COUNT; i++) {
        make_scene(&vector_scenes[i]);
        prepare();
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const struct ih_ray *ray = &rays.ray[slot];
            if (ray->state == IH_RAY_SEEN && ray->point_mm_q8[2] > 300 << 8 &&
                ray->point_mm_q8[2] < 3000 << 8) {
                const int32_t centre[3] = {ray->point_mm_q8[0], ray->point_mm_q8[1],
                                           ray->point_mm_q8[2] + (98 << 8)};
                const double width = check(centre, slot);

                count++;
                wide += width > 0.4;
                sum += width;
            }
        }
    }
    TEST_ASSERT_TRUE(count > 1000);
    TEST_ASSERT_TRUE(wide < count / 20);
    TEST_ASSERT_TRUE(sum / count < 0.15);
}

/* A ray that passes a mean head's centre at (x, y) semi-axes, at the centre's depth. */
static void aim_at(int32_t slot, const int32_t centre_mm_q8[3], double x, double y)
{
    const double depth = (double)centre_mm_q8[2] - rays.origin_mm_q8[2];
    const double off_x = (double)centre_mm_q8[0] - rays.origin_mm_q8[0];
    const double off_y = (double)centre_mm_q8[1] - rays.origin_mm_q8[1];

    rays.ray[slot].slope_x_q20 = (int32_t)lround((off_x + x * 78 * 256) / depth * 1048576);
    rays.ray[slot].slope_y_q20 = (int32_t)lround((off_y + y * 113 * 256) / depth * 1048576);
}

static double random_in(struct ih_test_random *random, double low, double high)
{
    return low + (high - low) * (double)ih_test_between(random, 0, 1 << 30) / (1 << 30);
}

/* Somewhere a score is given: to 16 m, at slopes to 1 aside and to 1.5 up and down, as before a camera that looks down. */
static void random_centre(struct ih_test_random *random, int32_t centre_mm_q8[3])
{
    static const int32_t max_mm[] = {500, 1200, 4000, 16000};
    const int32_t depth =
        (int32_t)ih_test_between(random, 230 << 8, max_mm[ih_test_between(random, 0, 3)] << 8);
    int axis;

    for (axis = 0; axis < 3; axis++) {
        rays.origin_mm_q8[axis] = (int32_t)ih_test_between(random, -(200 << 8), 200 << 8);
    }
    centre_mm_q8[0] = rays.origin_mm_q8[0] + (int32_t)(depth * random_in(random, -1, 1));
    centre_mm_q8[1] = rays.origin_mm_q8[1] + (int32_t)(depth * random_in(random, -1.5, 1.5));
    centre_mm_q8[2] = rays.origin_mm_q8[2] + depth;
    if (centre_mm_q8[2] > 16090 << 8) {
        centre_mm_q8[2] = 16090 << 8;
    }
}

static void rays_far_off(const int32_t centre_mm_q8[3])
{
    int32_t slot;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot].slope_x_q20 = centre_mm_q8[0] > 0 ? -(1 << 19) : 1 << 19;
    }
}

static void random_state(struct ih_test_random *random, int32_t slot, int32_t centre_mm_q8)
{
    const int64_t state = ih_test_between(random, 0, 3);

    if (state < 2) {
        lose(slot, state == 0 ? IH_RAY_EMPTY : IH_RAY_UNKNOWN);
    } else {
        see(slot, centre_mm_q8 + (int32_t)ih_test_between(random, -(250 << 8), 250 << 8));
    }
}

/* Sixty rays side by side that pass just beside a limit: 1, 1.3 or 1.9 radii away, or between beside and
 * below. Beyond what 16 bits may be off by they are all on one side. */
static void rays_that_pass_beside_a_limit(void)
{
    static const double radius2[] = {1, 1, 1.69, 3.61, 2.56};
    struct ih_test_random random = {411};
    int32_t pass, slot, tight = 0, steep = 0;

    for (pass = 0; pass < 4000; pass++) {
        const int32_t kind = (int32_t)ih_test_between(&random, 0, 4);
        const int side = ih_test_between(&random, 0, 1) == 0 ? 1 : -1;
        const double angle =
            kind == 4 ? (pass % 2 == 0 ? 1 : -1) * pi / 2 + pi / 2 : random_in(&random, -pi, pi);
        double off2, reach2;
        int32_t centre[3];

        memset(&rays, 0, sizeof rays);
        random_centre(&random, centre);
        rays_far_off(centre);
        off2 = 8.6e-6 * (centre[2] - rays.origin_mm_q8[2]) / 256 + 0.0136;
        reach2 = radius2[kind] + (kind == 4 ? 0 : side * off2 * random_in(&random, 1, 1.5));
        for (slot = 0; slot < 60; slot++) {
            const double off_angle = kind == 4
                                         ? atan2(78, 113) + side * random_in(&random, 0.01, 0.03)
                                         : random_in(&random, -0.004, 0.004);
            const double x = kind == 4 ? cos(angle) * cos(off_angle) : cos(angle + off_angle);
            const double y = kind == 4 ? sin(off_angle) : sin(angle + off_angle);
            double reach = sqrt(reach2);
            int32_t i;

            for (i = 0; i < 12; i++) { /* as far from the centre as wanted, by its nearest place */
                aim_at(slot, centre, reach * x, reach * y);
                reach *= sqrt(reach2 / cross(&rays.ray[slot], centre).radius2);
            }
            random_state(&random, slot, centre[2]);
        }
        prepare();
        tight += check(centre, pass) < 0.3 && cross(&rays.ray[0], centre).steep < 3;
        steep += cross(&rays.ray[0], centre).steep > 2 && cross(&rays.ray[0], centre).steep < 3;
    }
    TEST_ASSERT_GREATER_THAN_INT(2000, tight);
    TEST_ASSERT_GREATER_THAN_INT(500, steep);
}

/* Sixty rays through the head whose points are just beside a limit of how far behind the entry. */
static void points_beside_a_limit_of_depth(void)
{
    static const double limit_mm[] = {-32, 32};
    struct ih_test_random random = {412};
    int32_t pass, slot, tight = 0, steep = 0;

    for (pass = 0; pass < 4000; pass++) {
        const double limit = limit_mm[ih_test_between(&random, 0, 1)];
        const int side = ih_test_between(&random, 0, 1) == 0 ? 1 : -1;
        const double angle = random_in(&random, -pi, pi);
        const double reach =
            pass % 3 == 0 ? random_in(&random, 0.8, 0.9) : random_in(&random, 0, 0.8);
        int32_t centre[3];

        memset(&rays, 0, sizeof rays);
        random_centre(&random, centre);
        rays_far_off(centre);
        for (slot = 0; slot < 60; slot++) {
            const double off_angle = angle + random_in(&random, -0.004, 0.004);
            const double away = (centre[2] - rays.origin_mm_q8[2]) / 256.0;
            const double off2 = 8.6e-6 * away + 0.0135, off_mm = depth_off_mm(away) + 0.1;
            struct exact exact;
            double behind;

            aim_at(slot, centre, reach * cos(off_angle), reach * sin(off_angle));
            see(slot, centre[2]);
            exact = cross(&rays.ray[slot], centre);
            behind = behind_mm(&exact, centre[2] / 256.0, side > 0 ? -off2 : off2);
            see(slot, centre[2] + (int32_t)((limit - behind +
                                             side * random_in(&random, off_mm, off_mm + 1.3)) *
                                            256));
        }
        prepare();
        tight += check(centre, pass) < 0.3 && cross(&rays.ray[0], centre).steep < 3;
        steep += cross(&rays.ray[0], centre).steep > 2 && cross(&rays.ray[0], centre).steep < 3;
    }
    TEST_ASSERT_GREATER_THAN_INT(2000, tight);
    TEST_ASSERT_GREATER_THAN_INT(500, steep);
}

/* A ring's points are beyond the centre or not, to half a millimetre. */
static void points_beside_the_limit_of_what_is_open(void)
{
    int32_t off, slot;

    for (off = -2; off <= 2; off++) {
        const int32_t centre[3] = {0, 0, 1000 << 8};

        memset(&rays, 0, sizeof rays);
        rays_far_off(centre);
        for (slot = 0; slot < 60; slot++) {
            aim_at(slot, centre, 1.6, 0);
            see(slot, (1060 << 8) + off * 128);
        }
        prepare();
        IH_TEST_EQUAL(off > 0 ? 2457 : -1459, ih_template_score_q12(&rays, &table, centre), "open",
                      off);
    }
}

/* Where 16 bits do not reach there is no score, and rays that are too steep do not count. */
static void out_of_the_limits_there_is_no_score(void)
{
    static const int32_t centre_mm[][3] = {{0, 0, 200},     {0, 0, 226},      {0, 0, 16101},
                                           {2001, 0, 1000}, {0, -2001, 1000}, {0, 0, -500}};
    static const int32_t ahead[3] = {0, 0, 1000 << 8}, aside[3] = {0, 1625 << 8, 1000 << 8};
    int32_t i, axis, slot;

    prepare();
    for (i = 0; i < IH_TEST_COUNT(centre_mm); i++) {
        int32_t centre[3];

        for (axis = 0; axis < 3; axis++) {
            centre[axis] = centre_mm[i][axis] * 256;
        }
        IH_TEST_EQUAL(IH_TEMPLATE_NONE_Q12, ih_template_score_q12(&rays, &table, centre), "centre",
                      i);
    }
    IH_TEST_EQUAL(-640, ih_template_score_q12(&rays, &table, ahead), "unknown", 0);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot].slope_y_q20 = 1709600; /* g just below the root of 2 */
    }
    prepare();
    TEST_ASSERT_TRUE(ih_template_score_q12(&rays, &table, aside) != 0);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot].slope_y_q20 = 1710100;
    }
    prepare();
    IH_TEST_EQUAL(0, ih_template_score_q12(&rays, &table, aside), "steep rays", 0);
}

/* Rays, origins and depths of all sizes. */
static void random_spaces_are_scored(void)
{
    struct ih_test_random random = {413};
    int32_t pass, slot, axis;

    for (pass = 0; pass < 300; pass++) {
        const int bits = (int)ih_test_between(&random, 14, 22);

        for (axis = 0; axis < 3; axis++) {
            rays.origin_mm_q8[axis] =
                (int32_t)ih_test_between(&random, -(1000 << 8), 1000 << 8) >> (pass % 3 * 8);
        }
        for (slot = 0; slot < IH_SLOTS; slot++) {
            struct ih_ray *ray = &rays.ray[slot];

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
            const int32_t *point = rays.ray[slot].point_mm_q8;
            const int32_t centre[3] = {point[0], point[1], point[2] + (98 << 8)};

            if (ih_template_score_q12(&rays, &table, centre) != IH_TEMPLATE_NONE_Q12) {
                check(centre, slot);
            }
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(scores_are_float64s_in_scenes);
    RUN_TEST(rays_that_pass_beside_a_limit);
    RUN_TEST(points_beside_a_limit_of_depth);
    RUN_TEST(points_beside_the_limit_of_what_is_open);
    RUN_TEST(out_of_the_limits_there_is_no_score);
    RUN_TEST(random_spaces_are_scored);
    return UNITY_END();
}
