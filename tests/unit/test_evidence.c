/* ih_evidence against a float64 reference over scenes of simple bodies; each number must tell at
 * least two of them apart. */
#include "ih_evidence.h"

#include "ih_test.h"

#define KINDS 19 /* that the vectors have; later ones are not tested here */

struct vector_ray {
    int32_t depth_mm_q8, state;
};

struct vector_scene {
    const char *name;
    const struct vector_ray *ray;
    struct ih_ellipsoid head;
    int32_t start_mm_q8[3];
    struct ih_evidence_nest nest;
    double value[KINDS];
    int32_t through, hit, front;
};

#include "evidence.inc"

_Static_assert(KINDS <= IH_EVIDENCE_COUNT && IH_EVIDENCE_UPRIGHT == KINDS - 1,
               "new kinds go to the end");

static struct ih_space space;
static struct ih_evidence evidence;
static const struct ih_evidence_nest no_nest = {.present = false};

void setUp(void)
{
    memset(&space, 0, sizeof space);
    memset(&evidence, IH_TEST_FILL, sizeof evidence);
}

void tearDown(void)
{
}

static void use_scene(const struct vector_scene *scene)
{
    int slot, axis;

    memcpy(space.origin_mm_q8, vector_origin_mm_q8, sizeof space.origin_mm_q8);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        struct ih_ray *ray = &space.ray[slot];
        const int64_t along = scene->ray[slot].depth_mm_q8 - space.origin_mm_q8[2];

        *ray = (struct ih_ray){.slope_x_q20 = vector_slope_q20[slot][0],
                               .slope_y_q20 = vector_slope_q20[slot][1],
                               .state = scene->ray[slot].state};
        if (ray->state != IH_RAY_SEEN) {
            continue;
        }
        for (axis = 0; axis < 2; axis++) {
            ray->point_mm_q8[axis] =
                (int32_t)(space.origin_mm_q8[axis] +
                          ((along * vector_slope_q20[slot][axis] + (1 << 19)) >> 20));
        }
        ray->point_mm_q8[2] = scene->ray[slot].depth_mm_q8;
    }
    ih_evidence_collect(&space, &scene->head, scene->start_mm_q8, &scene->nest, &evidence);
}

/* Counts are exact: no ray is near a limit. Shares are cut to 1/256. A point's place has 2^-14 of
 * an axis in it, 0.007 mm, and its distance about twice that. The plane: 0.05 mm, see below. */
static double tolerance(int kind)
{
    switch (kind) {
    case IH_EVIDENCE_ON:
    case IH_EVIDENCE_BODY_RAYS:
    case IH_EVIDENCE_BEFORE:
    case IH_EVIDENCE_EXTENT:
        return 0;
    case IH_EVIDENCE_ROUGH:
        return 0.03;
    case IH_EVIDENCE_BULGE:
        return 0.06;
    default:
        return 1.01 / 256;
    }
}

static void scenes_match_float64(void)
{
    int i, kind;

    for (i = 0; i < IH_TEST_COUNT(vector_scenes); i++) {
        const struct vector_scene *scene = &vector_scenes[i];
        char what[64];

        use_scene(scene);
        for (kind = 0; kind < KINDS; kind++) {
            snprintf(what, sizeof what, "%s: %s", scene->name,
                     ih_evidence_text((enum ih_evidence_kind)kind));
            IH_TEST_WITHIN(tolerance(kind), scene->value[kind],
                           ih_test_from_q(evidence.value_q8[kind], 8), what, kind);
        }
        IH_TEST_EQUAL(scene->through, evidence.through_count, scene->name, 100);
        IH_TEST_EQUAL(scene->hit, evidence.hit_count, scene->name, 101);
        IH_TEST_EQUAL(scene->front, evidence.front_count, scene->name, 102);
    }
}

static double value_of(const char *name, int kind)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_scenes); i++) {
        if (strcmp(vector_scenes[i].name, name) == 0) {
            use_scene(&vector_scenes[i]);
            return ih_test_from_q(evidence.value_q8[kind], 8);
        }
    }
    TEST_FAIL_MESSAGE(name);
    return 0;
}

static void every_number_tells_scenes_apart(void)
{
    static const struct {
        int kind;
        const char *less, *more;
        double by;
    } cases[] = {
        {IH_EVIDENCE_ON, "dark", "head", 4},
        {IH_EVIDENCE_ROUGH, "head", "rough", 3},
        {IH_EVIDENCE_BULGE, "board", "head", 6},
        {IH_EVIDENCE_TALL, "small", "head", 19},
        {IH_EVIDENCE_MOVED, "head", "moved", 49},
        {IH_EVIDENCE_ABOVE, "before_a_wall", "head", 0.5},
        {IH_EVIDENCE_BESIDE, "before_a_wall", "head", 0.5},
        {IH_EVIDENCE_BELOW, "headrest", "alone", 0.4},
        {IH_EVIDENCE_HIGH, "before_a_wall", "head", 0.5},
        {IH_EVIDENCE_NOTHING, "head", "before_nothing", 0.9},
        {IH_EVIDENCE_BODY, "alone", "head", 0.9},
        {IH_EVIDENCE_BODY_RAYS, "unknown", "head", 20},
        {IH_EVIDENCE_BODY_DEPTH, "leaning", "head", 50},
        {IH_EVIDENCE_WIDE, "head", "table", 0.9},
        {IH_EVIDENCE_LEVEL, "head", "neighbours", 0.3},
        {IH_EVIDENCE_SHOULDER, "alone", "head", 0.3},
        {IH_EVIDENCE_BEFORE, "head", "hand", 3},
        {IH_EVIDENCE_EXTENT, "head", "moved", 120},
        {IH_EVIDENCE_UPRIGHT, "head", "moved", 0.6},
    };
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const double less = value_of(cases[i].less, cases[i].kind);
        const double more = value_of(cases[i].more, cases[i].kind);

        IH_TEST_EQUAL(i, cases[i].kind, "every kind has its scenes", i);
        if (more - less < cases[i].by) {
            IH_TEST_WITHIN(0, cases[i].by, more - less, ih_evidence_text(cases[i].kind), i);
        }
    }
}

/* What the tracks ask: is the head there, hidden, or gone? */
static void rays_through_a_head_tell_seen_hidden_and_gone(void)
{
    TEST_ASSERT_TRUE(value_of("head", 0) > 10);
    TEST_ASSERT_TRUE(evidence.hit_count > 10 && evidence.through_count <= 1 &&
                     evidence.front_count == 0);
    value_of("hand", 0);
    TEST_ASSERT_TRUE(evidence.front_count >= 3 && evidence.through_count <= 1);
    value_of("gone", 0);
    TEST_ASSERT_TRUE(evidence.hit_count == 0 && evidence.through_count > 10);
    value_of("unknown", 0);
    TEST_ASSERT_TRUE(evidence.hit_count + evidence.through_count + evidence.front_count == 0);
}

/* Nothing seen: every share says that it knows nothing. */
static void without_rays_nothing_is_known(void)
{
    value_of("unknown", 0);
    IH_TEST_EQUAL(128, evidence.value_q8[IH_EVIDENCE_ABOVE], "above", 0);
    IH_TEST_EQUAL(128, evidence.value_q8[IH_EVIDENCE_BESIDE], "beside", 0);
    IH_TEST_EQUAL(128, evidence.value_q8[IH_EVIDENCE_HIGH], "high", 0);
    IH_TEST_EQUAL(0, evidence.value_q8[IH_EVIDENCE_BODY], "body", 0);
    IH_TEST_EQUAL(0, evidence.value_q8[IH_EVIDENCE_BULGE], "bulge", 0);
    IH_TEST_EQUAL(256, evidence.value_q8[IH_EVIDENCE_UPRIGHT], "upright", 0);
}

/* --- the plane -----------------------------------------------------------------------------------
 */

/* Root mean square distance along Z from the best plane: the three normal equations about the mean,
 * in double. */
static double plane_rms(int count, double p[][3])
{
    double mean[3] = {0}, c[3][3] = {{0}}, det, a, b;
    int i, j, k;

    for (i = 0; i < count; i++) {
        for (j = 0; j < 3; j++) {
            mean[j] += p[i][j] / count;
        }
    }
    for (i = 0; i < count; i++) {
        for (j = 0; j < 3; j++) {
            for (k = 0; k < 3; k++) {
                c[j][k] += (p[i][j] - mean[j]) * (p[i][k] - mean[k]) / count;
            }
        }
    }
    det = c[0][0] * c[1][1] - c[0][1] * c[0][1];
    a = (c[0][2] * c[1][1] - c[1][2] * c[0][1]) / det;
    b = (c[1][2] * c[0][0] - c[0][2] * c[0][1]) / det;
    return sqrt(fmax(0, c[2][2] - a * c[0][2] - b * c[1][2]));
}

/* Random points on the front of random ellipsoids, 6 to 60 of them. */
static void bulges_match_the_best_plane(void)
{
    struct ih_test_random random = {52};
    int pass;

    for (pass = 0; pass < 3000; pass++) {
        const int32_t centre[3] = {(int32_t)ih_test_between(&random, -100000, 100000),
                                   (int32_t)ih_test_between(&random, -100000, 100000), 400 << 8};
        struct ih_ellipsoid head = ih_ellipsoid_mean(centre);
        const int wanted = (int)ih_test_between(&random, 6, 60);
        double point[60][3], rms, error;
        int axis, count = 0;

        for (axis = 0; axis < 3; axis++) {
            head.semi_mm_q8[axis] = (int32_t)ih_test_between(&random, 50 << 8, 152 << 8);
        }
        memset(&space, 0, sizeof space);
        while (count < wanted) {
            struct ih_ray *ray = &space.ray[count];
            double s[3], place[3], f;

            s[0] = 1.6 * ih_test_unit(&random) - 0.8;
            s[1] = 1.6 * ih_test_unit(&random) - 0.8;
            f = 1 - s[0] * s[0] - s[1] * s[1];
            if (f < 0.25) {
                continue;
            }
            s[2] = -sqrt(f);
            for (axis = 0; axis < 3; axis++) {
                place[axis] = (centre[axis] + s[axis] * head.semi_mm_q8[axis]) / 256.0 +
                              (axis == 2 ? ih_test_normal(&random) * 2 : 0);
                ray->point_mm_q8[axis] = (int32_t)lround(place[axis] * 256);
            }
            ray->slope_x_q20 = (int32_t)lround(ldexp(place[0] / place[2], 20));
            ray->slope_y_q20 = (int32_t)lround(ldexp(place[1] / place[2], 20));
            ray->state = IH_RAY_SEEN;
            for (axis = 0; axis < 3; axis++) {
                point[count][axis] = (ray->point_mm_q8[axis] - centre[axis]) / 256.0;
            }
            count++;
        }
        ih_evidence_collect(&space, &head, centre, &no_nest, &evidence);
        if (evidence.hit_count != count) {
            continue; /* a ray along the edge */
        }
        rms = plane_rms(count, point);
        error =
            ih_test_from_q(
                evidence.value_q8[IH_EVIDENCE_BULGE] + evidence.value_q8[IH_EVIDENCE_ROUGH], 8) -
            rms;
        /* Measured: 0.024 mm at most. */
        IH_TEST_WITHIN(0.05, rms, rms + error, "rms", pass);
    }
}

/* Points in one line have a plane through all of them. */
static void a_line_has_no_bulge(void)
{
    static const int32_t centre[3] = {0, 0, 700 << 8};
    const struct ih_ellipsoid head = ih_ellipsoid_mean(centre);
    int i, pass;

    for (pass = 0; pass < 3; pass++) {
        memset(&space, 0, sizeof space);
        for (i = 0; i < 9; i++) {
            struct ih_ray *ray = &space.ray[i * IH_GRID + i];
            const double along = (i - 4) * 0.15;
            const double at[2] = {pass == 1 ? 0 : along, pass == 0 ? 0 : along};
            const double z = 700 - 98 * sqrt(1 - at[0] * at[0] - at[1] * at[1]);

            ray->point_mm_q8[0] = (int32_t)lround(at[0] * 78 * 256);
            ray->point_mm_q8[1] = (int32_t)lround(at[1] * 113 * 256);
            ray->point_mm_q8[2] = (int32_t)lround(z * 256);
            ray->slope_x_q20 = (int32_t)lround(ldexp(at[0] * 78 / z, 20));
            ray->slope_y_q20 = (int32_t)lround(ldexp(at[1] * 113 / z, 20));
            ray->state = IH_RAY_SEEN;
        }
        ih_evidence_collect(&space, &head, centre, &no_nest, &evidence);
        IH_TEST_EQUAL(9, evidence.hit_count, "on", pass);
        IH_TEST_RANGE(0, 35 << 8,
                      evidence.value_q8[IH_EVIDENCE_BULGE] + evidence.value_q8[IH_EVIDENCE_ROUGH],
                      "plane", pass);
    }
}

/* --- extremes ------------------------------------------------------------------------------------
 */

/* Rays, points and ellipsoids as far as they can be: a point at most 16 m away at a slope of 8, a
 * head as far as fits move it. The sanitizers watch. */
static void extremes_do_not_overflow(void)
{
    struct ih_test_random random = {53};
    int pass, slot, axis;

    for (pass = 0; pass < 400; pass++) {
        struct ih_ellipsoid head;
        int32_t start[3];
        const int32_t near = pass % 4 == 0 ? 300 << 8 : 1 << 25;
        const struct ih_evidence_nest nest = {true, INT32_MAX, INT32_MAX};

        for (axis = 0; axis < 3; axis++) {
            head.centre_mm_q8[axis] = (int32_t)ih_test_between(&random, -near, near);
            start[axis] = (int32_t)ih_test_between(&random, -(1 << 26), 1 << 26);
            head.semi_mm_q8[axis] = pass % 2 == 0
                                        ? (axis + pass) % 3 == 0 ? IH_ELLIPSOID_SEMI_MAX_MM << 8
                                                                 : IH_ELLIPSOID_SEMI_MIN_MM << 8
                                        : (int32_t)ih_test_between(&random, 40 << 8, 200 << 8);
            space.origin_mm_q8[axis] = (int32_t)ih_test_between(&random, -256000, 256000);
        }
        for (slot = 0; slot < IH_SLOTS; slot++) {
            struct ih_ray *ray = &space.ray[slot];

            ray->slope_x_q20 = (int32_t)ih_test_between(&random, -(4 << 20), 4 << 20);
            ray->slope_y_q20 = (int32_t)ih_test_between(&random, -(4 << 20), 4 << 20);
            ray->state = (int32_t)ih_test_between(&random, 0, 2);
            for (axis = 0; axis < 3; axis++) {
                const int32_t away = (int32_t)ih_test_between(&random, -(220 << 8), 220 << 8);

                ray->point_mm_q8[axis] =
                    pass % 3 == 0 ? (int32_t)ih_test_between(&random, -(1 << 25), 1 << 25)
                                  : head.centre_mm_q8[axis] + away;
            }
            if (pass % 5 == 0) { /* all on one side of it */
                ray->slope_x_q20 = 0;
                ray->slope_y_q20 = 0;
            }
        }
        ih_evidence_collect(&space, &head, start, &nest, &evidence);
        IH_TEST_RANGE(0, 256, evidence.value_q8[IH_EVIDENCE_ABOVE], "share", pass);
        IH_TEST_RANGE(0, IH_SLOTS << 8, evidence.value_q8[IH_EVIDENCE_ON], "count", pass);
        IH_TEST_RANGE(0, 30 << 8, evidence.value_q8[IH_EVIDENCE_BODY_RAYS], "count", pass);
    }
}

static void every_kind_has_a_word_of_its_own(void)
{
    int kind, other;

    for (kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
        TEST_ASSERT_NOT_NULL(ih_evidence_text((enum ih_evidence_kind)kind));
        for (other = 0; other < kind; other++) {
            TEST_ASSERT_TRUE(strcmp(ih_evidence_text((enum ih_evidence_kind)kind),
                                    ih_evidence_text((enum ih_evidence_kind)other)) != 0);
        }
    }
    TEST_ASSERT_NULL(ih_evidence_text(IH_EVIDENCE_COUNT));
    TEST_ASSERT_NULL(ih_evidence_text((enum ih_evidence_kind) - 1));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(scenes_match_float64);
    RUN_TEST(every_number_tells_scenes_apart);
    RUN_TEST(rays_through_a_head_tell_seen_hidden_and_gone);
    RUN_TEST(without_rays_nothing_is_known);
    RUN_TEST(bulges_match_the_best_plane);
    RUN_TEST(a_line_has_no_bulge);
    RUN_TEST(extremes_do_not_overflow);
    RUN_TEST(every_kind_has_a_word_of_its_own);
    return UNITY_END();
}
