/* ih_scan against float64 and against a plain second scan, on made scenes with a known head, and at the extremes. */
#include "detect/ih_scan.h"
#include "detect/ih_surroundings.h"

#include "ih_test.h"
#include "ih_test_scene.h"

struct vector_scan {
    int32_t behind_count;
    const double (*behind_mm)[3]; /* of each seen point, by slot */
};

#include "scan.inc"

static struct ih_scan_params params;
static struct ih_scan_scratch scratch;
static struct ih_scan scan;

void setUp(void)
{
    ih_scan_params_default(&params);
    params.deep_mm = VECTOR_DEEP_MM;
    memset(&rays, 0, sizeof rays);
    make_rays(&vector_rays[0]);
    ih_rays_fill_table(&rays);
}

void tearDown(void)
{
}

static void find(void)
{
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    memset(&scan, IH_TEST_FILL, sizeof scan);
    ih_scan_find(&rays, &params, &scratch, &scan);
    IH_TEST_RANGE(0, IH_SCAN_MAX, scan.candidate_count, "candidates", 0);
    IH_TEST_UNTOUCHED(&scan.candidate[scan.candidate_count],
                      (size_t)(IH_SCAN_MAX - scan.candidate_count) * sizeof scan.candidate[0],
                      "beyond the places");
}

static void use_scene(const struct vector_scene *scene)
{
    make_scene(scene);
    ih_rays_fill_table(&rays);
}

static bool apart(const int32_t a[3], const int32_t b[3])
{
    const double b_mm[3] = {b[0] / 256.0, b[1] / 256.0, b[2] / 256.0};

    return distance_mm(a, b_mm) > params.spacing_mm;
}

static bool same_block(int32_t slot, int32_t other)
{
    return slot / IH_GRID / 2 == other / IH_GRID / 2 && slot % IH_GRID / 2 == other % IH_GRID / 2;
}

/* A plain second scan: of every block the first seen slot, then as often as there are places the best one that is apart
 * from those before. */
static void check_choice(const double (*behind_mm)[3])
{
    static int32_t promise_q5[IH_SLOTS];
    static bool is_tried[IH_SLOTS];
    int32_t slot, other, axis, k, count = 0, seen = 0;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        is_tried[slot] = rays.ray[slot].state == IH_RAY_SEEN;
        seen += is_tried[slot];
        for (other = 0; other < slot; other++) {
            if (same_block(slot, other) && rays.ray[other].state == IH_RAY_SEEN) {
                is_tried[slot] = false;
            }
        }
        if (is_tried[slot]) {
            for (axis = 0; axis < 3; axis++) { /* half a step, and the vectors' digits */
                IH_TEST_WITHIN(0.003, behind_mm[seen - 1][axis],
                               ih_test_from_q(scratch.centre_mm_q8[slot][axis], 8), "centre", slot);
            }
            promise_q5[slot] = ih_surroundings_promise_q5(&rays, scratch.centre_mm_q8[slot]);
            is_tried[slot] = promise_q5[slot] >= params.promise_min_q5;
        }
    }
    for (count = 0; count < params.candidate_max; count++) {
        int32_t best = IH_NONE;

        for (slot = IH_SLOTS - 1; slot >= 0; slot--) {
            bool is_free = is_tried[slot];

            for (k = 0; k < count && is_free; k++) {
                is_free = apart(scratch.centre_mm_q8[slot], scan.candidate[k].centre_mm_q8);
            }
            if (is_free && (best == IH_NONE || promise_q5[slot] >= promise_q5[best])) {
                best = slot;
            }
        }
        if (best == IH_NONE) {
            break;
        }
        TEST_ASSERT_TRUE(count < scan.candidate_count);
        IH_TEST_EQUAL(promise_q5[best], scan.candidate[count].promise_q5, "promise", count);
        TEST_ASSERT_EQUAL_INT32_ARRAY(scratch.centre_mm_q8[best],
                                      scan.candidate[count].centre_mm_q8, 3);
    }
    IH_TEST_EQUAL(count, scan.candidate_count, "count", 0);
}

/* Everything, few, and what promises something. */
static void candidates_are_those_of_a_plain_scan(void)
{
    static const struct {
        int32_t spacing_mm, promise_min_q5;
    } cases[] = {{60, -128}, {0, INT16_MIN}, {30, -64}, {80, 0}, {400, INT16_MIN}, {20000, -128}};
    int32_t i, k, found = 0;

    for (i = 0; i < SCENE_COUNT; i++) {
        use_scene(&vector_scenes[i]);
        for (k = 0; k < IH_TEST_COUNT(cases); k++) {
            params.spacing_mm = cases[k].spacing_mm;
            params.promise_min_q5 = cases[k].promise_min_q5;
            params.candidate_max = 1 + (i + k) % IH_SCAN_MAX;
            find();
            check_choice(vector_scans[i].behind_mm);
            found += scan.candidate_count;
        }
    }
    TEST_ASSERT_TRUE(found > 100);
}

/* What a promise is learnt for: the head's centre is within 90 mm. A wall promises less. */
static void the_most_promising_place_is_the_head(void)
{
    static const char *const cases[] = {"head", "person",       "person_wide", "side",
                                        "far",  "person_range", "near"};
    int32_t wall_q5;
    int i;

    params.promise_min_q5 = INT16_MIN;
    use_scene(scene_named("wall"));
    find();
    TEST_ASSERT_TRUE(scan.candidate_count > 0);
    wall_q5 = scan.candidate[0].promise_q5;
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const struct vector_scene *scene = scene_named(cases[i]);

        use_scene(scene);
        find();
        TEST_ASSERT_TRUE_MESSAGE(scan.candidate_count > 0, scene->name);
        TEST_ASSERT_TRUE_MESSAGE(scan.candidate[0].promise_q5 > wall_q5, scene->name);
        IH_TEST_WITHIN(90, 0, distance_mm(scan.candidate[0].centre_mm_q8, scene->centre_mm),
                       scene->name, 0);
    }
}

/* A point in any slot of a block stands for it, if those before it in the block saw none. */
static void a_block_is_tried_once(void)
{
    static const int32_t block[] = {200, 201, 219, 220};
    int32_t i, k;

    params.promise_min_q5 = INT16_MIN;
    params.spacing_mm = 0;
    for (i = 3; i >= 0; i--) {
        see(block[i], 900 << 8);
        ih_rays_fill_table(&rays);
        find();
        TEST_ASSERT_EQUAL_INT32(1, scan.candidate_count);
        TEST_ASSERT_EQUAL_INT32_ARRAY(scratch.centre_mm_q8[block[i]],
                                      scan.candidate[0].centre_mm_q8, 3);
    }
    for (k = 0; k < IH_SLOTS; k++) { /* the last line and slot have blocks of one and two */
        lose(k, IH_RAY_EMPTY);
    }
    see(IH_SLOTS - 1, 900 << 8);
    find();
    TEST_ASSERT_EQUAL_INT32(1, scan.candidate_count);
}

/* What promises just the minimum is kept; what is just as far as the spacing is near. */
static void limits_of_promise_and_spacing(void)
{
    int32_t off;

    params.promise_min_q5 = INT16_MIN;
    see(0, 1000 << 8);
    find();
    params.promise_min_q5 = scan.candidate[0].promise_q5;
    find();
    TEST_ASSERT_EQUAL_INT32(1, scan.candidate_count);
    params.promise_min_q5++;
    find();
    TEST_ASSERT_EQUAL_INT32(0, scan.candidate_count);
    params.promise_min_q5 = INT16_MIN;
    for (off = 0; off <= 1; off++) {
        rays.ray[0] = rays.ray[2] = (struct ih_ray){.slope_x_q20 = 0};
        see(0, 1000 << 8);
        see(2, ((1000 + params.spacing_mm) << 8) + off);
        find();
        IH_TEST_EQUAL(1 + off, scan.candidate_count, "places", off);
    }
}

static void no_point_and_equal_points(void)
{
    int32_t slot;

    find();
    TEST_ASSERT_EQUAL_INT32(0, scan.candidate_count);
    params.promise_min_q5 = INT16_MIN;
    see(200, 900 << 8);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot] = rays.ray[200];
    }
    find();
    TEST_ASSERT_EQUAL_INT32(1, scan.candidate_count);
    params.candidate_max = 0;
    find();
    TEST_ASSERT_EQUAL_INT32(0, scan.candidate_count);
}

/* The centre stands deep_mm behind the point along the ray, not along Z. */
static void the_centre_is_behind_the_point_along_its_ray(void)
{
    static const int32_t slope_q20[] = {0, 1 << 19, -(1 << 20), 4 << 20, -(4 << 20)};
    int32_t i, axis;

    params.promise_min_q5 = INT16_MIN;
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

/* What stands elsewhere together with its projector is the same to the last bit. */
static void a_moved_scene_gives_the_same(void)
{
    static const int32_t by[3] = {-250001, 77777, 999999};
    int32_t i, axis, k;

    for (i = 0; i < SCENE_COUNT; i++) {
        struct ih_scan before;

        use_scene(&vector_scenes[i]);
        find();
        before = scan;
        move_rays(by);
        find();
        IH_TEST_EQUAL(before.candidate_count, scan.candidate_count, vector_scenes[i].name, 0);
        for (k = 0; k < scan.candidate_count; k++) {
            IH_TEST_EQUAL(before.candidate[k].promise_q5, scan.candidate[k].promise_q5, "promise",
                          k);
            for (axis = 0; axis < 3; axis++) {
                IH_TEST_EQUAL(before.candidate[k].centre_mm_q8[axis] + by[axis],
                              scan.candidate[k].centre_mm_q8[axis], "centre", axis);
            }
        }
    }
}

/* As far as rays and points can be. The sanitizers watch. */
static void extremes_do_not_overflow(void)
{
    struct ih_test_random random = {17};
    int32_t pass, slot, axis;

    params.promise_min_q5 = INT16_MIN;
    for (pass = 0; pass < 100; pass++) {
        for (axis = 0; axis < 3; axis++) {
            rays.origin_mm_q8[axis] = (int32_t)ih_test_between(&random, -256000, 256000);
        }
        for (slot = 0; slot < IH_SLOTS; slot++) {
            rays.ray[slot] = (struct ih_ray){
                .slope_x_q20 = (int32_t)ih_test_between(&random, -(4 << 20), 4 << 20),
                .slope_y_q20 = (int32_t)ih_test_between(&random, -(4 << 20), 4 << 20),
                .state = IH_RAY_SEEN};
            for (axis = 0; axis < 3; axis++) {
                rays.ray[slot].point_mm_q8[axis] =
                    (int32_t)ih_test_between(&random, -(1 << 25), 1 << 25);
            }
        }
        ih_rays_fill_table(&rays);
        find();
        TEST_ASSERT_EQUAL_INT32(IH_SCAN_MAX, scan.candidate_count);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(candidates_are_those_of_a_plain_scan);
    RUN_TEST(the_most_promising_place_is_the_head);
    RUN_TEST(a_block_is_tried_once);
    RUN_TEST(limits_of_promise_and_spacing);
    RUN_TEST(no_point_and_equal_points);
    RUN_TEST(the_centre_is_behind_the_point_along_its_ray);
    RUN_TEST(a_moved_scene_gives_the_same);
    RUN_TEST(extremes_do_not_overflow);
    return UNITY_END();
}
