/* ih_evidence against a float64 reference over scenes of simple bodies; each number must tell at
 * least two of them apart. */
#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_evidence.h"
#include "detect/ih_rays.h"

#include "ih_test.h"

#define KINDS 7 /* that the vectors have; later ones are not tested here */

struct vector_ray {
    int32_t depth_mm_q8, state;
};

struct vector_scene {
    const char *name;
    const struct vector_ray *ray;
    struct ih_ellipsoid head;
    int32_t start_mm_q8[3];
    double value[KINDS];
    int32_t through, hit, front;
};

#include "evidence.inc"

_Static_assert(KINDS <= IH_EVIDENCE_COUNT && IH_EVIDENCE_BEND_ACROSS == KINDS - 1,
               "new kinds go to the end");

static struct ih_rays rays;
static struct ih_evidence evidence, of_all;

/* And the view alone; and the same with the steepest rays, for which every ray near by may go through the head. */
static void collect(const struct ih_ellipsoid *head, const int32_t start_mm_q8[3])
{
    struct ih_view view;

    ih_rays_fill_table(&rays);
    ih_evidence_collect(&rays, head, start_mm_q8, &evidence);
    view = ih_evidence_view(&rays, head);
    TEST_ASSERT_EQUAL_MEMORY(&view, &evidence.view, sizeof view);
    rays.table.slope_max_q20[0] = rays.table.slope_max_q20[1] = IH_RAYS_SLOPE_MAX << 20;
    ih_evidence_collect(&rays, head, start_mm_q8, &of_all);
    TEST_ASSERT_EQUAL_MEMORY(&of_all, &evidence, sizeof evidence);
}

void setUp(void)
{
    memset(&rays, 0, sizeof rays);
    memset(&evidence, IH_TEST_FILL, sizeof evidence);
}

void tearDown(void)
{
}

static void use_scene(const struct vector_scene *scene)
{
    int slot, axis;

    memcpy(rays.origin_mm_q8, vector_origin_mm_q8, sizeof rays.origin_mm_q8);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        struct ih_ray *ray = &rays.ray[slot];
        const int64_t along = scene->ray[slot].depth_mm_q8 - rays.origin_mm_q8[2];

        *ray = (struct ih_ray){.slope_x_q20 = vector_slope_q20[slot][0],
                               .slope_y_q20 = vector_slope_q20[slot][1],
                               .state = scene->ray[slot].state};
        if (ray->state != IH_RAY_SEEN) {
            continue;
        }
        for (axis = 0; axis < 2; axis++) {
            ray->point_mm_q8[axis] =
                (int32_t)(rays.origin_mm_q8[axis] +
                          ((along * vector_slope_q20[slot][axis] + (1 << 19)) >> 20));
        }
        ray->point_mm_q8[2] = scene->ray[slot].depth_mm_q8;
    }
    collect(&scene->head, scene->start_mm_q8);
}

/* Counts are exact: no ray is near a limit. A point's place has 2^-14 of
 * an axis in it, 0.007 mm, and its distance about twice that. The plane: 0.05 mm, see below. */
static double tolerance(int kind)
{
    switch (kind) {
    case IH_EVIDENCE_ON:
        return 0;
    case IH_EVIDENCE_ROUGH:
        return 0.03;
    case IH_EVIDENCE_BULGE:
    case IH_EVIDENCE_BEND_DOWN: /* of three heights, each within 0.01 mm */
    case IH_EVIDENCE_BEND_ACROSS:
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

        use_scene(scene);
        for (kind = 0; kind < KINDS; kind++) {
            IH_TEST_WITHIN(tolerance(kind), scene->value[kind],
                           ih_test_from_q(evidence.value_q8[kind], 8), scene->name, kind);
        }
        IH_TEST_EQUAL(scene->through, evidence.view.through, scene->name, 100);
        IH_TEST_EQUAL(scene->hit, evidence.view.hit, scene->name, 101);
        IH_TEST_EQUAL(scene->front, evidence.view.front, scene->name, 102);
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
        const char *low, *high;
        double by;
    } cases[] = {
        {IH_EVIDENCE_ON, "dark", "head", 4},           {IH_EVIDENCE_ROUGH, "head", "rough", 3},
        {IH_EVIDENCE_BULGE, "board", "head", 6},       {IH_EVIDENCE_TALL, "small", "head", 19},
        {IH_EVIDENCE_MOVED, "head", "moved", 49},      {IH_EVIDENCE_BEND_DOWN, "head", "rough", 5},
        {IH_EVIDENCE_BEND_ACROSS, "head", "rough", 5},
    };
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const double low = value_of(cases[i].low, cases[i].kind);
        const double high = value_of(cases[i].high, cases[i].kind);

        IH_TEST_EQUAL(i, cases[i].kind, "every kind has its scenes", i);
        if (high - low < cases[i].by) {
            IH_TEST_WITHIN(0, cases[i].by, high - low, cases[i].high, i);
        }
    }
}

/* What the tracks ask: is the head there, hidden, or gone? */
static void rays_through_a_head_tell_seen_hidden_and_gone(void)
{
    TEST_ASSERT_TRUE(value_of("head", 0) > 10);
    TEST_ASSERT_TRUE(evidence.view.hit > 10 && evidence.view.through <= 1 &&
                     evidence.view.front == 0);
    value_of("hand", 0);
    TEST_ASSERT_TRUE(evidence.view.front >= 3 && evidence.view.through <= 1);
    value_of("gone", 0);
    TEST_ASSERT_TRUE(evidence.view.hit == 0 && evidence.view.through > 10);
    value_of("unknown", 0);
    TEST_ASSERT_TRUE(evidence.view.hit + evidence.view.through + evidence.view.front == 0);
}

/* Nothing seen: every number says that it knows nothing. */
static void without_rays_nothing_is_known(void)
{
    value_of("unknown", 0);
    IH_TEST_EQUAL(0, evidence.value_q8[IH_EVIDENCE_ON], "on", 0);
    IH_TEST_EQUAL(0, evidence.value_q8[IH_EVIDENCE_ROUGH], "rough", 0);
    IH_TEST_EQUAL(0, evidence.value_q8[IH_EVIDENCE_BULGE], "bulge", 0);
    IH_TEST_EQUAL(12 << 8, evidence.value_q8[IH_EVIDENCE_BEND_DOWN], "bend down", 0);
    IH_TEST_EQUAL(12 << 8, evidence.value_q8[IH_EVIDENCE_BEND_ACROSS], "bend across", 0);
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
        memset(&rays, 0, sizeof rays);
        while (count < wanted) {
            struct ih_ray *ray = &rays.ray[count];
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
        collect(&head, centre);
        if (evidence.view.hit != count) {
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
        memset(&rays, 0, sizeof rays);
        for (i = 0; i < 9; i++) {
            struct ih_ray *ray = &rays.ray[i * IH_GRID + i];
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
        collect(&head, centre);
        IH_TEST_EQUAL(9, evidence.view.hit, "on", pass);
        IH_TEST_RANGE(0, 35 << 8,
                      evidence.value_q8[IH_EVIDENCE_BULGE] + evidence.value_q8[IH_EVIDENCE_ROUGH],
                      "plane", pass);
    }
}

/* --- limits, to the last unit --------------------------------------------------------------------
 */

/* A ball of 64 mm, 1024 mm ahead: a slope of 4 n in Q20 passes its centre's depth n / 256 mm aside,
 * which is n in semi-axes too, in Q14. */
#define BALL_MM_Q8 (64 << 8)
#define BALL_Z_MM_Q8 (1024 << 8)
#define NO_POINT INT32_MAX

static void cast_ray(int32_t slot, int32_t x_mm_q8, int32_t y_mm_q8, int32_t dz_mm_q8)
{
    rays.ray[slot] = (struct ih_ray){
        .slope_x_q20 = 4 * x_mm_q8, .slope_y_q20 = 4 * y_mm_q8, .state = IH_RAY_EMPTY};
    if (dz_mm_q8 != NO_POINT) {
        const double depth = (double)BALL_Z_MM_Q8 + dz_mm_q8;

        rays.ray[slot].state = IH_RAY_SEEN;
        rays.ray[slot].point_mm_q8[0] = (int32_t)lround(x_mm_q8 * depth / BALL_Z_MM_Q8);
        rays.ray[slot].point_mm_q8[1] = (int32_t)lround(y_mm_q8 * depth / BALL_Z_MM_Q8);
        rays.ray[slot].point_mm_q8[2] = BALL_Z_MM_Q8 + dz_mm_q8;
    }
}

static void forget_rays(void)
{
    int slot;

    memset(&rays, 0, sizeof rays);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot].state = IH_RAY_UNKNOWN;
    }
}

static void collect_ball(void)
{
    static const struct ih_ellipsoid ball = {.centre_mm_q8 = {0, 0, BALL_Z_MM_Q8},
                                             .semi_mm_q8 = {BALL_MM_Q8, BALL_MM_Q8, BALL_MM_Q8}};

    collect(&ball, ball.centre_mm_q8);
}

/* A lattice of rays 20 mm apart at the ball, its rows down the camera's y, or its x where it is rotated. Points lie height
 * mm outside of the ball's front, measured as the evidence does, or are not seen (HOLE). */
#define HOLE 1000
static void ball_lattice(bool is_rotated, const int (*height_mm)[IH_GRID])
{
    int slot;

    forget_rays();
    for (slot = 0; slot < IH_SLOTS; slot++) {
        struct ih_ray *ray = &rays.ray[slot];
        const int row = slot / IH_GRID - IH_GRID / 2, column = slot % IH_GRID - IH_GRID / 2;
        const double x = 20.0 * 256 * (is_rotated ? row : column);
        const double y = 20.0 * 256 * (is_rotated ? column : row);
        const int height = height_mm[slot / IH_GRID][slot % IH_GRID];
        const double radius2 = 1 + 2.0 * height * 256 / BALL_MM_Q8;
        const double z2 = radius2 - (x * x + y * y) / BALL_MM_Q8 / BALL_MM_Q8;

        ray->slope_x_q20 = (int32_t)lround(x * (1 << 20) / BALL_Z_MM_Q8);
        ray->slope_y_q20 = (int32_t)lround(y * (1 << 20) / BALL_Z_MM_Q8);
        if (height == HOLE || z2 < 0) {
            continue;
        }
        ray->state = IH_RAY_SEEN;
        ray->point_mm_q8[0] = (int32_t)lround(x);
        ray->point_mm_q8[1] = (int32_t)lround(y);
        ray->point_mm_q8[2] = (int32_t)lround(BALL_Z_MM_Q8 - BALL_MM_Q8 * sqrt(z2));
    }
}

static void bends_are(int down_q8, int across_q8, const char *what, int i)
{
    collect_ball();
    IH_TEST_WITHIN(4, down_q8, evidence.value_q8[IH_EVIDENCE_BEND_DOWN], what, i);
    IH_TEST_WITHIN(4, across_q8, evidence.value_q8[IH_EVIDENCE_BEND_ACROSS], what, i);
}

/* Around the middle of the pattern, of which each case sets some points. */
static void bends_are_of_three_neighbours(void)
{
    static int height[IH_GRID][IH_GRID];
    const int mid = IH_GRID / 2;
    int rotated, row, column;

    for (rotated = 0; rotated < 2; rotated++) {
        const bool is_rotated = rotated == 1;
        for (row = 0; row < IH_GRID; row++) {
            for (column = 0; column < IH_GRID; column++) {
                height[row][column] = HOLE;
            }
        }
        height[mid][mid] = height[mid + 1][mid] = 0;
        ball_lattice(is_rotated, height);
        bends_are(12 << 8, 12 << 8, "two points", rotated);
        /* |3 - 2 * 0 + 5| = 8, with the 12 of nobody: 10. */
        height[mid][mid] = 3;
        height[mid + 2][mid] = 5;
        ball_lattice(is_rotated, height);
        bends_are(is_rotated ? 12 << 8 : 10 << 8, is_rotated ? 10 << 8 : 12 << 8,
                  "three in a column", rotated);
        /* 20 at most: 16. */
        height[mid][mid] = 15;
        height[mid + 2][mid] = 15;
        ball_lattice(is_rotated, height);
        bends_are(is_rotated ? 12 << 8 : 16 << 8, is_rotated ? 16 << 8 : 12 << 8, "a large bend",
                  rotated);
        /* A ramp has no bend. */
        height[mid][mid] = -6;
        height[mid + 2][mid] = 6;
        ball_lattice(is_rotated, height);
        bends_are(is_rotated ? 12 << 8 : 6 << 8, is_rotated ? 6 << 8 : 12 << 8, "a ramp", rotated);
    }
}

/* The last two columns and the next row's first are no neighbours, nor is a point that is too far out. */
static void bends_end_with_the_pattern_and_the_head(void)
{
    static int height[IH_GRID][IH_GRID];
    int row, column, slot;

    for (row = 0; row < IH_GRID; row++) {
        for (column = 0; column < IH_GRID; column++) {
            height[row][column] = HOLE;
        }
    }
    ball_lattice(false, height);
    for (slot = IH_GRID - 2; slot <= IH_GRID; slot++) { /* on the ball, wherever their rays go */
        rays.ray[slot].state = IH_RAY_SEEN;
        rays.ray[slot].point_mm_q8[0] = 0;
        rays.ray[slot].point_mm_q8[1] = 0;
        rays.ray[slot].point_mm_q8[2] = BALL_Z_MM_Q8 - BALL_MM_Q8;
    }
    bends_are(12 << 8, 12 << 8, "around a row's end", 0);
    for (row = 0; row < 2; row++) {
        /* Straight before the ball's centre, just within 1.4 semi-axes and just beyond. */
        const int32_t front_q8 = (int32_t)(BALL_MM_Q8 * (row == 0 ? 1.399 : 1.401));
        ball_lattice(false, height);
        for (slot = 0; slot < 3; slot++) {
            rays.ray[slot].state = IH_RAY_SEEN;
            rays.ray[slot].point_mm_q8[0] = rays.ray[slot].point_mm_q8[1] = 0;
            rays.ray[slot].point_mm_q8[2] = BALL_Z_MM_Q8 - (slot == 1 ? front_q8 : BALL_MM_Q8);
        }
        bends_are(12 << 8, row == 0 ? 16 << 8 : 12 << 8, "1.4 semi-axes", row);
    }
    ball_lattice(false, height);
    for (slot = 0; slot < 3; slot++) {
        rays.ray[slot].state = IH_RAY_SEEN;
        rays.ray[slot].point_mm_q8[2] = BALL_Z_MM_Q8 + (slot == 1 ? 256 : -256);
    }
    bends_are(12 << 8, 12 << 8, "behind the centre", 0);
}

/* A head twice as high as the mean one is 100 per cent taller, to the last unit; one as high as that is not. */
static void tallness_is_in_hundredths_of_the_mean(void)
{
    static const int32_t times[] = {1, 2, 3};
    int i;

    for (i = 0; i < IH_TEST_COUNT(times); i++) {
        struct ih_ellipsoid head = ih_ellipsoid_mean((const int32_t[3]){0, 0, BALL_Z_MM_Q8});

        head.semi_mm_q8[1] *= times[i];
        forget_rays();
        collect(&head, head.centre_mm_q8);
        IH_TEST_EQUAL(100 * (times[i] - 1) << 8, evidence.value_q8[IH_EVIDENCE_TALL], "tall", i);
        IH_TEST_EQUAL(head.centre_mm_q8[2], evidence.value_q8[IH_EVIDENCE_DISTANCE], "distance", i);
    }
}

/* A ray through the middle enters 64 mm before it. */
static void rays_through_the_middle_have_their_limits(void)
{
    enum { MM = 256 };
    static const struct {
        int32_t dz_mm_q8, through, front, hit;
    } cases[] = {
        {-64 * MM, 0, 0, 1},           {-14 * MM, 0, 0, 0},           {-14 * MM + 1, 1, 0, 0},
        {-94 * MM, 0, 0, 0},           {-94 * MM - 1, 0, 1, 0},       {-64 * MM - 19 * MM, 0, 0, 1},
        {-64 * MM - 21 * MM, 0, 0, 0}, {-64 * MM + 19 * MM, 0, 0, 1}, {NO_POINT, 1, 0, 0},
    };
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        forget_rays();
        cast_ray(180, 0, 0, cases[i].dz_mm_q8);
        collect_ball();
        IH_TEST_EQUAL(cases[i].through, evidence.view.through, "through", i);
        IH_TEST_EQUAL(cases[i].front, evidence.view.front, "front", i);
        IH_TEST_EQUAL(cases[i].hit, evidence.view.hit, "hit", i);
        IH_TEST_EQUAL(cases[i].hit << 8, evidence.value_q8[IH_EVIDENCE_ON], "on", i);
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

        for (axis = 0; axis < 3; axis++) {
            head.centre_mm_q8[axis] = (int32_t)ih_test_between(&random, -near, near);
            start[axis] = (int32_t)ih_test_between(&random, -(1 << 26), 1 << 26);
            head.semi_mm_q8[axis] = pass % 2 == 0
                                        ? (axis + pass) % 3 == 0 ? IH_ELLIPSOID_SEMI_MAX_MM << 8
                                                                 : IH_ELLIPSOID_SEMI_MIN_MM << 8
                                        : (int32_t)ih_test_between(&random, 40 << 8, 200 << 8);
            rays.origin_mm_q8[axis] = (int32_t)ih_test_between(&random, -256000, 256000);
        }
        for (slot = 0; slot < IH_SLOTS; slot++) {
            struct ih_ray *ray = &rays.ray[slot];

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
        collect(&head, start);
        IH_TEST_RANGE(0, IH_SLOTS << 8, evidence.value_q8[IH_EVIDENCE_ON], "count", pass);
        IH_TEST_RANGE(0, 20 << 8, evidence.value_q8[IH_EVIDENCE_BEND_DOWN], "bend", pass);
        IH_TEST_RANGE(0, 20 << 8, evidence.value_q8[IH_EVIDENCE_BEND_ACROSS], "bend", pass);
    }
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
    RUN_TEST(bends_are_of_three_neighbours);
    RUN_TEST(bends_end_with_the_pattern_and_the_head);
    RUN_TEST(tallness_is_in_hundredths_of_the_mean);
    RUN_TEST(rays_through_the_middle_have_their_limits);
    RUN_TEST(extremes_do_not_overflow);
    return UNITY_END();
}
