/* ih_scan against float64, on made scenes with a known head, and at the extremes. */
#include "detect/ih_ellipsoid.h"
#include "detect/ih_template.h"
#include "detect/ih_scan.h"

#include <stdlib.h>

#include "ih_test.h"
#include "ih_test_scene.h"

struct vector_place {
    double centre_mm[3], low, high; /* its score is between */
};

struct vector_scan {
    int32_t tried_count;
    const struct vector_place *tried;
};

#include "scan.inc"

static struct ih_scan_params params;
static struct ih_scan_scratch scratch;
static struct ih_scan scan;

void setUp(void)
{
    ih_scan_params_default(&params);
    params.deep_mm = VECTOR_DEEP_MM;
    params.spacing_mm = VECTOR_SPACING_MM;
    make_rays(&vector_rays[0]);
}

void tearDown(void)
{
}

static void find(void)
{
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    memset(&scan, IH_TEST_FILL, sizeof scan);
    ih_scan_find(&rays, &params, &scratch, &scan);
}

static int32_t score_of(int32_t slot)
{
    return ih_template_score_q12(&rays, &scratch.table, scratch.centre_mm_q8[slot]);
}

static bool is_looked_at(int32_t slot)
{
    return scratch.state[slot] == IH_SCAN_SCORED || scratch.state[slot] == IH_SCAN_WIDENED;
}

static double from_q12(int32_t score_q12)
{
    return ih_test_from_q(score_q12, 12);
}

static bool apart(const int32_t a[3], const int32_t b[3])
{
    const double b_mm[3] = {b[0] / 256.0, b[1] / 256.0, b[2] / 256.0};

    return distance_mm(a, b_mm) > params.spacing_mm;
}

static bool is_around(int32_t slot, int32_t other)
{
    return abs(slot / IH_GRID - other / IH_GRID) <= 1 && abs(slot % IH_GRID - other % IH_GRID) <= 1;
}

static bool same_block(int32_t slot, int32_t other)
{
    return slot / IH_GRID / 2 == other / IH_GRID / 2 && slot % IH_GRID / 2 == other % IH_GRID / 2;
}

/* A second scan: what is known of a slot's place is nothing or its score. */
struct second {
    bool is_known[IH_SLOTS], is_wide[IH_SLOTS], is_struck[IH_SLOTS];
    int32_t score[IH_SLOTS];
};

/* The first scan knows it, too, unless it is near one that was taken. */
static void know(struct second *second, int32_t slot)
{
    if (!second->is_known[slot] && rays.ray[slot].state == IH_RAY_SEEN) {
        second->is_known[slot] = true;
        TEST_ASSERT_TRUE(is_looked_at(slot));
        second->score[slot] = score_of(slot);
    }
}

/* The best of what is known and not struck out, of equal ones the first. */
static int32_t best_of(const struct second *second)
{
    int32_t best = IH_NONE, slot;

    for (slot = IH_SLOTS - 1; slot >= 0; slot--) {
        if (second->is_known[slot] && !second->is_struck[slot] &&
            (best == IH_NONE || second->score[slot] >= second->score[best])) {
            best = slot;
        }
    }
    return best;
}

static void strike_out(struct second *second, const int32_t taken[], int32_t count)
{
    int32_t slot, i;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        for (i = 0; i < count && second->is_known[slot]; i++) {
            second->is_struck[slot] |=
                !apart(scratch.centre_mm_q8[slot], scratch.centre_mm_q8[taken[i]]);
        }
    }
}

/* The first of each block is known; of the best what is around it gets known; or it is taken, and what is near
 * it struck out. Those taken come best first, and nothing else was looked at. */
static void check_choice(void)
{
    static struct second second;
    static bool is_found[IH_SCAN_MAX];
    int32_t taken[IH_SCAN_MAX], count = 0, slot, other, k, best;

    memset(&second, 0, sizeof second);
    memset(is_found, 0, sizeof is_found);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        bool is_first = true;

        for (other = 0; other < slot; other++) {
            is_first =
                is_first && (rays.ray[other].state != IH_RAY_SEEN || !same_block(slot, other));
        }
        if (is_first) {
            know(&second, slot);
        }
    }
    while (count < IH_SCAN_MAX && (best = best_of(&second)) != IH_NONE) {
        if (second.is_wide[best]) {
            for (k = 0; k < scan.candidate_count; k++) {
                is_found[k] |= scan.candidate[k].score_q12 == second.score[best] &&
                               memcmp(scratch.centre_mm_q8[best], scan.candidate[k].centre_mm_q8,
                                      sizeof scan.candidate[k].centre_mm_q8) == 0;
            }
            taken[count++] = best;
        } else {
            second.is_wide[best] = true;
            for (slot = 0; slot < IH_SLOTS; slot++) {
                if (is_around(slot, best)) {
                    know(&second, slot);
                }
            }
        }
        strike_out(&second, taken, count);
    }
    TEST_ASSERT_EQUAL_INT32(count, scan.candidate_count);
    for (k = 0; k < scan.candidate_count; k++) {
        TEST_ASSERT_TRUE(is_found[k]);
        TEST_ASSERT_TRUE(k == 0 || scan.candidate[k].score_q12 <= scan.candidate[k - 1].score_q12);
    }
    for (slot = 0; slot < IH_SLOTS; slot++) {
        IH_TEST_EQUAL(second.is_known[slot], is_looked_at(slot), "looked at", slot);
    }
    IH_TEST_UNTOUCHED(&scan.candidate[count],
                      (size_t)(IH_SCAN_MAX - count) * sizeof scan.candidate[0],
                      "beyond the places");
}

/* Half a step, and the vectors' digits; two means cut off to Q12. */
static void candidates_and_scores_match_float64(void)
{
    int32_t i, axis, k, slot, checked = 0;

    for (i = 0; i < SCENE_COUNT; i++) {
        const struct vector_scan *v = &vector_scans[i];

        make_scene(&vector_scenes[i]);
        find();
        for (slot = 0, k = 0; slot < IH_SLOTS; slot++) {
            if (is_looked_at(slot)) {
                const double low = v->tried[k].low, high = v->tried[k].high;

                for (axis = 0; axis < 3; axis++) {
                    IH_TEST_WITHIN(0.003, v->tried[k].centre_mm[axis],
                                   ih_test_from_q(scratch.centre_mm_q8[slot][axis], 8), "centre",
                                   k);
                }
                IH_TEST_WITHIN((high - low) / 2 + 0.0006, (high + low) / 2,
                               from_q12(score_of(slot)), vector_scenes[i].name, k);
                checked++;
            }
            k += rays.ray[slot].state == IH_RAY_SEEN;
        }
        TEST_ASSERT_EQUAL_INT32(v->tried_count, k);
        check_choice();
    }
    TEST_ASSERT_TRUE(checked > 1000);
}

/* The best place of all is the head's, and no other place is as good. A point is up to half a pitch
 * beside the middle of the head, 14 mm at 0.9 m. */
static void the_best_place_is_the_head(void)
{
    static const struct {
        const char *scene;
        double limit_mm, lead;
    } cases[] = {{"ball", 15, 0.5},         {"head", 15, 0.5}, {"person", 15, 0.2},
                 {"person_wide", 15, 0.2},  {"side", 15, 0.4}, {"shelf", 15, 0.2},
                 {"person_range", 15, 0.5}, {"near", 10, 0.4}, {"far", 40, 0.2},
                 {"hand", 25, 0.1},         {"wild", 40, 0.1}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const struct vector_scene *scene = scene_named(cases[i].scene);

        make_scene(scene);
        find();
        TEST_ASSERT_TRUE(scan.candidate_count > 1);
        IH_TEST_WITHIN(cases[i].limit_mm, 0,
                       distance_mm(scan.candidate[0].centre_mm_q8, scene->centre_mm), scene->name,
                       0);
        TEST_ASSERT_TRUE_MESSAGE(
            from_q12(scan.candidate[0].score_q12 - scan.candidate[1].score_q12) > cases[i].lead,
            scene->name);
    }
    make_scene(scene_named("wall")); /* nothing there is nearly as good */
    find();
    TEST_ASSERT_TRUE(from_q12(scan.candidate[0].score_q12) < 0.8);
}

/* A head's front at 1000 mm straight ahead, where slot 0 sees it; all others but slot 1 are out of
 * reach. The deep semi-axis, mm. */
static int32_t stand_before_a_head(void)
{
    const struct ih_ellipsoid mean = ih_ellipsoid_mean((const int32_t[3]){0, 0, 0});
    int32_t slot;

    memset(&rays, 0, sizeof rays);
    for (slot = 2; slot < IH_SLOTS; slot++) {
        rays.ray[slot].slope_x_q20 = 2 << 20;
    }
    see(0, 1000 << 8);
    params.deep_mm = mean.semi_mm_q8[2] >> 8;
    return params.deep_mm;
}

static void set_state(int32_t slot, enum ih_ray_state state, int32_t depth_mm)
{
    if (state == IH_RAY_SEEN) {
        see(slot, depth_mm << 8);
    } else {
        lose(slot, state);
    }
}

/* One more ray straight ahead: its value is an eighth of a mean over at least eight. */
static void the_values_of_single_rays(void)
{
    static const struct {
        enum ih_ray_state state;
        int32_t behind_mm;
        double value;
    } cases[] = {
        {IH_RAY_SEEN, 0, 1},
        {IH_RAY_SEEN, VECTOR_ON_SURFACE_MM - 1, 1},
        {IH_RAY_SEEN, -VECTOR_ON_SURFACE_MM + 1, 1},
        {IH_RAY_SEEN, -VECTOR_ON_SURFACE_MM - 1, VECTOR_NEARER},
        {IH_RAY_SEEN, -500, VECTOR_NEARER},
        {IH_RAY_SEEN, VECTOR_ON_SURFACE_MM + 1, VECTOR_BEHIND},
        {IH_RAY_SEEN, 15000, VECTOR_BEHIND},
        {IH_RAY_EMPTY, 0, VECTOR_EMPTY},
        {IH_RAY_UNKNOWN, 0, VECTOR_NEARER},
    };
    int32_t i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        stand_before_a_head();
        set_state(1, cases[i].state, 1000 + cases[i].behind_mm);
        find();
        IH_TEST_WITHIN(0.0005, (1 + cases[i].value) / 8, from_q12(score_of(0)), "value", i);
    }
}

/* A ray beside, above and below: what is below does not count. Places are hundredths of semi-axes
 * at the centre's depth; the nearest place is that but for 2 %. */
static void the_values_of_rays_around(void)
{
    static const struct {
        int32_t aside, down;
        enum ih_ray_state state;
        int32_t behind_mm; /* the centre */
        double value;
    } cases[] = {
        {160, 0, IH_RAY_SEEN, VECTOR_BEHIND_CENTRE_MM + 1, 1},
        {-160, 0, IH_RAY_SEEN, VECTOR_BEHIND_CENTRE_MM - 1, VECTOR_RING_NEAR},
        {0, -160, IH_RAY_SEEN, 2000, 1},
        {0, -160, IH_RAY_EMPTY, 0, VECTOR_RING_EMPTY},
        {-160, 0, IH_RAY_UNKNOWN, 0, 0},
        {0, 160, IH_RAY_SEEN, 2000, 0},
        {0, 160, IH_RAY_EMPTY, 0, 0},
        {128, 80, IH_RAY_EMPTY, 0, VECTOR_RING_EMPTY},
        {115, 88, IH_RAY_EMPTY, 0, 0},
        {128, 0, IH_RAY_EMPTY, 0, 0},
        {196, 0, IH_RAY_EMPTY, 0, 0},
        {-136, 0, IH_RAY_EMPTY, 0, VECTOR_RING_EMPTY},
        {-186, 0, IH_RAY_EMPTY, 0, VECTOR_RING_EMPTY},
    };
    const struct ih_ellipsoid mean = ih_ellipsoid_mean((const int32_t[3]){0, 0, 0});
    int32_t i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const int32_t centre_mm = 1000 + stand_before_a_head();
        const double unit = 1048576.0 / 100 / 256 / centre_mm;

        rays.ray[1].slope_x_q20 = (int32_t)lround(cases[i].aside * mean.semi_mm_q8[0] * unit);
        rays.ray[1].slope_y_q20 = (int32_t)lround(cases[i].down * mean.semi_mm_q8[1] * unit);
        set_state(1, cases[i].state, centre_mm + cases[i].behind_mm);
        find();
        IH_TEST_WITHIN(0.0005, (1 + VECTOR_RING_FRACTION * cases[i].value) / 8,
                       from_q12(score_of(0)), "value", i);
    }
}

/* 360 rays where one ray was: their mean shows the last unit of a value of 64 parts. */
static void many_rays_show_the_last_unit_of_a_value(void)
{
    static const struct {
        enum ih_ray_state state;
        int32_t behind_mm;
        double value;
    } inside[] = {{IH_RAY_SEEN, 0, 1},
                  {IH_RAY_SEEN, -100, VECTOR_NEARER},
                  {IH_RAY_SEEN, 100, VECTOR_BEHIND},
                  {IH_RAY_EMPTY, 0, VECTOR_EMPTY},
                  {IH_RAY_UNKNOWN, 0, VECTOR_NEARER}},
      around[] = {{IH_RAY_SEEN, VECTOR_BEHIND_CENTRE_MM + 1, 1},
                  {IH_RAY_SEEN, VECTOR_BEHIND_CENTRE_MM, VECTOR_RING_NEAR},
                  {IH_RAY_EMPTY, 0, VECTOR_RING_EMPTY},
                  {IH_RAY_UNKNOWN, 0, 0}};
    const struct ih_ellipsoid mean = ih_ellipsoid_mean((const int32_t[3]){0, 0, 0});
    int32_t i, slot;

    for (i = 0; i < IH_TEST_COUNT(inside); i++) {
        stand_before_a_head();
        for (slot = 1; slot < IH_SLOTS; slot++) {
            rays.ray[slot].slope_x_q20 = 0;
            set_state(slot, inside[i].state, 1000 + inside[i].behind_mm);
        }
        find();
        IH_TEST_EQUAL(trunc(4096 * (1 + 360 * inside[i].value) / 361), score_of(0), "inside", i);
    }
    for (i = 0; i < IH_TEST_COUNT(around); i++) {
        const int32_t centre_mm = 1000 + stand_before_a_head();

        for (slot = 1; slot < IH_SLOTS; slot++) {
            rays.ray[slot].slope_x_q20 =
                (int32_t)lround(1.6 * mean.semi_mm_q8[0] * 4096 / centre_mm);
            set_state(slot, around[i].state, centre_mm + around[i].behind_mm);
        }
        find();
        IH_TEST_EQUAL(4096 / 8 + trunc(0.6 * 4096 * around[i].value), score_of(0), "around", i);
    }
}

/* Fewer than eight rays count as eight: the mean of n good ones. */
static void few_rays_count_as_eight(void)
{
    const struct ih_ellipsoid mean = ih_ellipsoid_mean((const int32_t[3]){0, 0, 0});
    int32_t count, slot;

    for (count = 1; count <= 12; count++) {
        int32_t centre_mm;

        stand_before_a_head();
        rays.ray[1].slope_x_q20 = 2 << 20;
        for (slot = 1; slot < count; slot++) {
            rays.ray[slot].slope_x_q20 = 0;
            see(slot, 1000 << 8);
        }
        find();
        IH_TEST_EQUAL(4096 * (count < 8 ? count : 8) / 8, score_of(0), "inside", count);
        centre_mm = 1000 + stand_before_a_head();
        for (slot = 1; slot <= count; slot++) {
            rays.ray[slot].slope_x_q20 =
                (int32_t)lround(-1.6 * mean.semi_mm_q8[0] * 4096 / centre_mm);
            see(slot, 5000 << 8);
        }
        find();
        IH_TEST_EQUAL(512 + floor(0.6 * 4096 * (count < 8 ? count : 8) / 8), score_of(0), "around",
                      count);
    }
}

/* A place just as far as the spacing from a better one is near it. */
static void places_are_farther_apart_than_the_spacing(void)
{
    int32_t off;

    for (off = 0; off <= 1; off++) {
        memset(&rays, 0, sizeof rays);
        rays.ray[1].slope_x_q20 = 0;
        see(0, 1000 << 8);
        see(1, (1080 << 8) + off);
        find();
        IH_TEST_EQUAL(1 + off, scan.candidate_count, "places", off);
    }
}

/* As many as a frame can afford. */
static void half_of_the_places_are_scored(void)
{
    int32_t i, slot, seen = 0, rated = 0;

    for (i = 0; i < SCENE_COUNT; i++) {
        make_scene(&vector_scenes[i]);
        find();
        for (slot = 0; slot < IH_SLOTS; slot++) {
            seen += rays.ray[slot].state == IH_RAY_SEEN;
            rated += is_looked_at(slot);
        }
    }
    TEST_ASSERT_TRUE(rated > seen / 3);
    TEST_ASSERT_TRUE(rated < seen * 2 / 3);
}

static void no_point_one_point_and_equal_points(void)
{
    int32_t slot;

    find();
    TEST_ASSERT_EQUAL_INT32(0, scan.candidate_count);
    see(200, 900 << 8);
    find();
    TEST_ASSERT_EQUAL_INT32(1, scan.candidate_count);
    check_choice();
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot] = rays.ray[200];
    }
    find();
    TEST_ASSERT_EQUAL_INT32(1, scan.candidate_count);
    IH_TEST_WITHIN(0.001, 1, from_q12(scan.candidate[0].score_q12), "score", 0);
    check_choice();
}

/* The centre stands deep_mm behind the point along the ray, not along Z. */
static void the_centre_is_behind_the_point_along_its_ray(void)
{
    static const int32_t slope_q20[] = {0, 1 << 19, -(1 << 20), 4 << 20, -(4 << 20)};
    int32_t i, axis;

    for (i = 0; i < 25; i++) {
        const double x = slope_q20[i % 5] / 1048576.0, y = slope_q20[i / 5] / 1048576.0;
        const double step = VECTOR_DEEP_MM / sqrt(1 + x * x + y * y);
        const double expected[3] = {step * x, step * y, step};

        memset(&rays, 0, sizeof rays);
        rays.ray[3].slope_x_q20 = slope_q20[i % 5];
        rays.ray[3].slope_y_q20 = slope_q20[i / 5];
        see(3, 700 << 8);
        find();
        TEST_ASSERT_EQUAL_INT32(1, scan.candidate_count);
        for (axis = 0; axis < 3; axis++) { /* the step's half, times the slope, and half a step */
            IH_TEST_WITHIN(0.011, rays.ray[3].point_mm_q8[axis] / 256.0 + expected[axis],
                           scan.candidate[0].centre_mm_q8[axis] / 256.0, "centre", i);
        }
    }
}

static void places_keep_their_distance_and_come_best_first(void)
{
    static const int32_t spacing_mm[] = {0, 30, 80, 400, 20000};
    int i;
    int32_t k, j, pass;

    for (i = 0; i < SCENE_COUNT; i += 3) {
        make_scene(&vector_scenes[i]);
        for (pass = 0; pass < IH_TEST_COUNT(spacing_mm); pass++) {
            params.spacing_mm = spacing_mm[pass];
            find();
            check_choice();
            TEST_ASSERT_TRUE(scan.candidate_count > 0);
            TEST_ASSERT_TRUE(pass < 4 || scan.candidate_count == 1);
            for (k = 1; k < scan.candidate_count; k++) {
                TEST_ASSERT_TRUE(scan.candidate[k].score_q12 <= scan.candidate[k - 1].score_q12);
                for (j = 0; j < k; j++) {
                    TEST_ASSERT_TRUE(
                        apart(scan.candidate[k].centre_mm_q8, scan.candidate[j].centre_mm_q8));
                }
            }
        }
    }
}

/* Left is right in a mirror, but for rays that are on a limit. And what stands elsewhere together
 * with its projector is the same to the last bit, if it is whole half millimetres farther off. */
static void a_mirrored_and_a_moved_scene_give_the_same(void)
{
    static const int32_t by[3] = {-250001, 77777, 7813 * 128};
    static int32_t rated[IH_SLOTS];
    int32_t i, axis, k, slot;

    for (i = 0; i < SCENE_COUNT; i++) {
        static struct ih_scan_scratch before;

        make_scene(&vector_scenes[i]);
        find();
        before = scratch;
        for (slot = 0; slot < IH_SLOTS; slot++) {
            rated[slot] = is_looked_at(slot) ? score_of(slot) : 0;
        }
        mirror_rays();
        find();
        for (slot = 0, k = 0; slot < IH_SLOTS; slot++) {
            const struct vector_place *place = &vector_scans[i].tried[k];

            k += rays.ray[slot].state == IH_RAY_SEEN;
            if (before.state[slot] >= IH_SCAN_SCORED && is_looked_at(slot)) {
                const int32_t *centre = before.centre_mm_q8[slot];

                IH_TEST_RANGE(-2, 2, centre[0] + scratch.centre_mm_q8[slot][0], "x", slot);
                IH_TEST_WITHIN(0.002 + place->high - place->low, from_q12(rated[slot]),
                               from_q12(score_of(slot)), vector_scenes[i].name, slot);
            }
        }
        mirror_rays();
        move_rays(by);
        find();
        for (slot = 0; slot < IH_SLOTS; slot++) {
            IH_TEST_EQUAL(before.state[slot], scratch.state[slot], "state", slot);
            if (is_looked_at(slot)) {
                IH_TEST_EQUAL(rated[slot], score_of(slot), "score", slot);
                for (axis = 0; axis < 3; axis++) {
                    IH_TEST_EQUAL(before.centre_mm_q8[slot][axis] + by[axis],
                                  scratch.centre_mm_q8[slot][axis], "centre", slot);
                }
            }
        }
    }
}

/* Rays, origins and depths of all sizes that the stages before can give. Scores are means of values
 * within 1, 0.6 of one of them; the sanitizers watch the rest. Few rays meet, so ties abound. */
static void random_input_stays_within_the_limits(void)
{
    static const int32_t depth_q8[] = {1 << 8, 100 << 8, 1000 << 8, 16000 << 8};
    struct ih_test_random random = {307};
    int32_t pass, slot, axis;

    for (pass = 0; pass < 60; pass++) {
        const int bits = (int)ih_test_between(&random, 10, 22);

        for (axis = 0; axis < 3; axis++) {
            rays.origin_mm_q8[axis] =
                (int32_t)ih_test_between(&random, -(1000 << 8), 1000 << 8) >> (pass % 3 * 8);
        }
        for (slot = 0; slot < IH_SLOTS; slot++) {
            struct ih_ray *ray = &rays.ray[slot];

            ray->slope_x_q20 = (int32_t)ih_test_any_size(&random, bits);
            ray->slope_y_q20 = pass % 4 == 0 ? 4 << 20 : (int32_t)ih_test_any_size(&random, bits);
            if (ih_test_between(&random, 0, 2) == 0) {
                lose(slot, ih_test_between(&random, 0, 1) == 0 ? IH_RAY_EMPTY : IH_RAY_UNKNOWN);
            } else if (pass % 2 == 0) {
                see(slot, depth_q8[ih_test_between(&random, 0, 3)]);
            } else {
                see(slot, (int32_t)ih_test_between(&random, 1 << 8, 16000 << 8) >> (pass % 5));
            }
        }
        find();
        check_choice();
        for (slot = 0; slot < IH_SLOTS; slot++) {
            if (is_looked_at(slot) && score_of(slot) != IH_TEMPLATE_NONE_Q12) {
                IH_TEST_RANGE(-4096 * 136 / 100 - 1, 4096 * 16 / 10, score_of(slot), "score", slot);
            }
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(candidates_and_scores_match_float64);
    RUN_TEST(the_best_place_is_the_head);
    RUN_TEST(the_values_of_single_rays);
    RUN_TEST(the_values_of_rays_around);
    RUN_TEST(many_rays_show_the_last_unit_of_a_value);
    RUN_TEST(few_rays_count_as_eight);
    RUN_TEST(places_are_farther_apart_than_the_spacing);
    RUN_TEST(half_of_the_places_are_scored);
    RUN_TEST(no_point_one_point_and_equal_points);
    RUN_TEST(the_centre_is_behind_the_point_along_its_ray);
    RUN_TEST(places_keep_their_distance_and_come_best_first);
    RUN_TEST(a_mirrored_and_a_moved_scene_give_the_same);
    RUN_TEST(random_input_stays_within_the_limits);
    return UNITY_END();
}
