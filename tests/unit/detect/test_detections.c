/* ih_detections: its list, the outline against the exact projection of the
 * ellipsoid, and whole scenes. Nothing here depends on the learnt weights. */
#include "detect/ih_candidates.h"

#include "ih_test.h"
#include "rigs.inc"
#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "base/ih_types.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_evidence.h"
#include "detect/ih_detections.h"
#include "detect/ih_fit.h"
#include "detect/ih_fit_equations.h"
#include "detect/ih_score.h"
#include "detect/ih_surroundings.h"
#include "dots/ih_dots.h"
#include "nests/ih_hypotheses.h"
#include "points/ih_points.h"
#include "rig/ih_rig.h"

#define PLAIN_RIG 2 /* of vector_rigs: a lens without distortion */
#define SPACING_MM 80

static struct ih_rig rig;
static struct ih_detections detections;
static struct ih_detections_params params;
static struct ih_detections_scratch scratch;
static struct ih_points points;
static struct ih_hypotheses hypotheses;
static struct ih_expected expected;

void setUp(void)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[PLAIN_RIG], &bad_slot));
    memset(&detections, IH_TEST_FILL, sizeof detections);
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    memset(&hypotheses, 0, sizeof hypotheses);
    memset(&points, 0, sizeof points);
    memset(&expected, 0, sizeof expected);
    ih_detections_params_default(&params);
    params.spacing_mm = SPACING_MM;
    params.front_min_mm = 150;
    ih_detections_begin(&detections);
}

void tearDown(void)
{
}

/* --- the list ------------------------------------------------------------------------------------
 */

static void put(double x, int32_t logit_q10)
{
    struct ih_detection detection = {.logit_q10 = logit_q10};

    detection.head.centre_mm_q8[0] = (int32_t)lround(x * 256);
    ih_candidates_insert(&detections, &detection, SPACING_MM);
}

static void expect_list(int count, const int32_t logits[], const char *what)
{
    int i;

    IH_TEST_EQUAL(count, detections.detection_count, what, -1);
    for (i = 0; i < count; i++) {
        IH_TEST_EQUAL(logits[i], detections.detection[i].logit_q10, what, i);
    }
}

static void detections_are_sorted(void)
{
    static const int32_t sorted[] = {50, 40, 40, 10, -30};

    put(0, 40);
    put(200, 10);
    put(400, 50);
    put(600, -30);
    put(800, 40);
    expect_list(5, sorted, "sorted");
    TEST_ASSERT_EQUAL_INT32(0,
                            detections.detection[1].head.centre_mm_q8[0]); /* the first of equals */
}

static void of_two_at_one_place_the_more_probable_stays(void)
{
    static const int32_t both[] = {10, 9}, three[] = {9, 8, 7};

    put(0, 9);
    put(79.9, 8);
    put(-79.9, 9); /* no better: the first stays */
    expect_list(1, both + 1, "worse ones");
    TEST_ASSERT_EQUAL_INT32(0, detections.detection[0].head.centre_mm_q8[0]);
    put(80, 8); /* spacing apart is apart */
    put(-80, 7);
    expect_list(3, three, "apart");
    put(-30, 10); /* takes the place of two, not of the third */
    expect_list(2, (const int32_t[]){10, 8}, "better");
    TEST_ASSERT_EQUAL_INT32(0, detections.dropped_count);
}

static void a_full_list_drops_the_last_one(void)
{
    int i;

    memset(detections.view, IH_TEST_FILL, sizeof detections.view);
    for (i = 0; i < IH_DETECTIONS_MAX; i++) {
        put(100 * i, 100 - i);
    }
    TEST_ASSERT_EQUAL_INT32(0, detections.dropped_count);
    put(-100, 50); /* less probable than all */
    TEST_ASSERT_EQUAL_INT32(1, detections.dropped_count);
    put(-100, 100 - (IH_DETECTIONS_MAX - 1)); /* as the last */
    TEST_ASSERT_EQUAL_INT32(2, detections.dropped_count);
    IH_TEST_EQUAL(100 * (IH_DETECTIONS_MAX - 1) * 256,
                  detections.detection[IH_DETECTIONS_MAX - 1].head.centre_mm_q8[0], "last", 0);
    put(-100, 200);
    TEST_ASSERT_EQUAL_INT32(3, detections.dropped_count);
    TEST_ASSERT_EQUAL_INT32(IH_DETECTIONS_MAX, detections.detection_count);
    TEST_ASSERT_EQUAL_INT32(200, detections.detection[0].logit_q10);
    IH_TEST_EQUAL(100 - (IH_DETECTIONS_MAX - 2),
                  detections.detection[IH_DETECTIONS_MAX - 1].logit_q10, "last", 1);
    put(-150, 300); /* in the place of another: nothing is dropped */
    TEST_ASSERT_EQUAL_INT32(3, detections.dropped_count);
    TEST_ASSERT_EQUAL_INT32(IH_DETECTIONS_MAX, detections.detection_count);
    IH_TEST_UNTOUCHED(detections.view, sizeof detections.view, "behind the table");
}

static void any_order_gives_a_good_list(void)
{
    struct ih_test_random random = {41};
    int pass, i, k;

    for (pass = 0; pass < 300; pass++) {
        int32_t best = INT32_MIN;

        ih_detections_begin(&detections);
        for (i = 0; i < 60; i++) {
            const int32_t logit = (int32_t)ih_test_between(&random, -9999, 9999);

            best = ih_max_s32(best, logit);
            put((double)ih_test_between(&random, -1500, 1500), logit);
        }
        TEST_ASSERT_EQUAL_INT32(best, detections.detection[0].logit_q10);
        IH_TEST_RANGE(1, IH_DETECTIONS_MAX, detections.detection_count, "count", pass);
        for (i = 0; i < detections.detection_count; i++) {
            for (k = 0; k < i; k++) {
                TEST_ASSERT_TRUE(detections.detection[k].logit_q10 >=
                                 detections.detection[i].logit_q10);
                TEST_ASSERT_TRUE(ih_abs_s32(detections.detection[k].head.centre_mm_q8[0] -
                                            detections.detection[i].head.centre_mm_q8[0]) >=
                                 SPACING_MM << 8);
            }
        }
    }
}

/* --- the outline ---------------------------------------------------------------------------------
 */

struct ellipse {
    double u, v, a, b, angle_deg;
};

/* Rays that touch an ellipsoid: with D = diag(1 / axis^2) and n = D c those with
 * (d n)^2 = (d D d)(c n - 1), a conic in the picture. */
static struct ellipse project(const struct ih_ellipsoid *head)
{
    const struct ih_calibration *k = &rig.calibration;
    const double fx = k->fx_px_q16 / 65536.0, fy = k->fy_px_q16 / 65536.0;
    const double scale[3] = {1 / fx, 1 / fy, 1};
    double m[3][3], n[3], cn = 0, det, x, y, size, mean, half, w;
    struct ellipse out;
    int i, j;

    for (i = 0; i < 3; i++) {
        const double c = head->centre_mm_q8[i] / 256.0, axis = head->semi_mm_q8[i] / 256.0;

        n[i] = c / (axis * axis);
        cn += c * n[i];
    }
    for (i = 0; i < 3; i++) {
        for (j = 0; j < 3; j++) {
            const double axis = head->semi_mm_q8[i] / 256.0;

            m[i][j] = ((i == j ? (cn - 1) / (axis * axis) : 0) - n[i] * n[j]) * scale[i] * scale[j];
        }
    }
    det = m[0][0] * m[1][1] - m[0][1] * m[0][1];
    x = -(m[1][1] * m[0][2] - m[0][1] * m[1][2]) / det;
    y = -(m[0][0] * m[1][2] - m[0][1] * m[0][2]) / det;
    size = m[0][0] * x * x + 2 * m[0][1] * x * y + m[1][1] * y * y - m[2][2];
    mean = (m[0][0] + m[1][1]) / 2;
    half = hypot((m[0][0] - m[1][1]) / 2, m[0][1]);
    w = mean - half;
    out.u = x + k->cx_px_q16 / 65536.0;
    out.v = y + k->cy_px_q16 / 65536.0;
    out.a = sqrt(size / w);
    out.b = sqrt(size / (mean + half));
    out.angle_deg = atan2(w - m[0][0], m[0][1]) * 180 / acos(-1.0);
    out.angle_deg -= out.angle_deg < 0 ? -180 : out.angle_deg >= 180 ? 180 : 0;
    return out;
}

static struct ih_detection outline_of(double x, double y, double z)
{
    struct ih_detection detection = {.source = 0};
    const int32_t centre[3] = {(int32_t)lround(x * 256), (int32_t)lround(y * 256),
                               (int32_t)lround(z * 256)};

    detection.head = ih_ellipsoid_mean(centre);
    ih_detections_outline(&rig, &detection);
    return detection;
}

/* What the header says of the error, at places all over the picture. */
static void outlines_are_near_the_true_projection(void)
{
    static const double slope[][2] = {{0, 0},        {0.1, 0},    {0.2, 0},  {0.3, 0},
                                      {0, 0.1},      {0, -0.2},   {0, 0.3},  {-0.3, 0},
                                      {0.15, -0.15}, {-0.2, 0.2}, {0.3, 0.3}};
    static const double depth[] = {500, 700, 900, 1500, 4000};
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(slope); i++) {
        for (k = 0; k < IH_TEST_COUNT(depth); k++) {
            const double z = depth[k], s = hypot(slope[i][0], slope[i][1]);
            const struct ih_detection detection = outline_of(slope[i][0] * z, slope[i][1] * z, z);
            const struct ellipse is = project(&detection.head);
            const double u = detection.u_px_q12 / 4096.0, v = detection.v_px_q12 / 4096.0;
            const double focal = rig.calibration.fy_px_q16 / 65536.0;
            const int at = 10 * i + k;

            /* Never too large; the depth of the head makes it larger by (98 / Z)^2 / 2, and, aside,
             * longer in that direction. */
            IH_TEST_WITHIN(0.0105 * (500 / z) * (500 / z) + 0.45 * s * s, 1,
                           1 + (is.a - detection.a_px_q12 / 4096.0) / is.a -
                               0.0105 * (500 / z) * (500 / z),
                           "a", at);
            IH_TEST_WITHIN(0.0105 * (500 / z) * (500 / z) + 0.82 * s * s, 1,
                           1 + (is.b - detection.b_px_q12 / 4096.0) / is.b -
                               0.0105 * (500 / z) * (500 / z),
                           "b", at);
            IH_TEST_WITHIN(0.05 + focal * s * 98 * 98 / (z * z - 98 * 98), 0,
                           hypot(is.u - u, is.v - v), "centre", at);
            IH_TEST_WITHIN(s == 0 ? 0.1 : 10, 90, is.angle_deg, "angle", at);
            TEST_ASSERT_EQUAL_INT32(90000, detection.angle_mdeg);
        }
    }
}

static void a_wide_head_has_its_long_axis_across(void)
{
    struct ih_detection detection = outline_of(0, 0, 800);

    detection.head.semi_mm_q8[0] = 150 << 8;
    ih_detections_outline(&rig, &detection);
    TEST_ASSERT_EQUAL_INT32(0, detection.angle_mdeg);
    TEST_ASSERT_TRUE(detection.a_px_q12 > detection.b_px_q12);
}

/* The way to the surface, along the ray through the centre. */
static void distances_are_those_of_the_front(void)
{
    static const double slope[] = {0, 0.1, 0.2, 0.3, 0.4};
    int i;

    for (i = 0; i < IH_TEST_COUNT(slope); i++) {
        const double s = slope[i], z = 900, d[3] = {s / hypot(s, 1), 0, 1 / hypot(s, 1)};
        const struct ih_detection detection = outline_of(s * z, 0, z);
        const double radius = 1 / hypot(d[0] / 78, d[2] / 98);

        /* Sideways a head is less deep than from the front. */
        IH_TEST_WITHIN(0.02 + 30 * s * s, z * hypot(s, 1) - radius,
                       detection.distance_mm_q8 / 256.0, "distance", i);
    }
}

static void outlines_exist_for_any_place(void)
{
    struct ih_test_random random = {42};
    int i, axis;

    for (i = 0; i < 20000; i++) {
        struct ih_detection detection = {.source = 0};

        for (axis = 0; axis < 3; axis++) {
            detection.head.centre_mm_q8[axis] = (int32_t)ih_test_any_size(&random, 26);
            detection.head.semi_mm_q8[axis] = (int32_t)ih_test_between(&random, 40 << 8, 200 << 8);
        }
        ih_detections_outline(&rig, &detection);
        TEST_ASSERT_TRUE(detection.a_px_q12 >= detection.b_px_q12 && detection.b_px_q12 > 0);
        TEST_ASSERT_TRUE(detection.distance_mm_q8 >= 0);
    }
}

/* --- scenes --------------------------------------------------------------------------------------
 */

static const double head_mm[3] = {30, -60, 800};

static double ellipsoid_depth(double x, double y, const double c[3], const double axis[3])
{
    const double d[3] = {x / axis[0], y / axis[1], 1 / axis[2]};
    const double o[3] = {c[0] / axis[0], c[1] / axis[1], c[2] / axis[2]};
    const double a = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    const double b = d[0] * o[0] + d[1] * o[1] + d[2] * o[2];
    const double root = b * b - a * (o[0] * o[0] + o[1] * o[1] + o[2] * o[2] - 1);

    return root > 0 ? (b - sqrt(root)) / a : 3000;
}

/* A person, or only the wall, through a range camera: slots in steps of 26 mm at 800 mm. */
static void make_points(bool person, bool hand)
{
    static const double axis[3] = {78, 113, 98}, body_axis[3] = {230, 190, 110};
    const double body[3] = {head_mm[0], head_mm[1] + 310, head_mm[2] + 30};
    int slot;

    rig.calibration.kind = IH_RIG_RANGE;
    points.seen_count = IH_SLOTS;
    points.field = (struct ih_field){0, 0, 4362076}; /* half of 0.0325 */
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const double x = (slot % IH_GRID - 9) * 0.0325 + 0.04, y = (slot / IH_GRID - 9) * 0.0325;
        double z = 2200;

        if (person) {
            z = fmin(z, ellipsoid_depth(x, y, head_mm, axis));
            z = fmin(z, ellipsoid_depth(x, y, body, body_axis));
        }
        if (hand && fabs(x - 0.04) < 0.16 && fabs(y + 0.08) < 0.16) {
            z = 600;
        }
        points.point[slot] =
            (struct ih_point){(int32_t)lround(ldexp(x, 28)), (int32_t)lround(ldexp(y, 28)),
                              (int32_t)lround(z * 256), IH_POINT_SEEN};
    }
}

static double nearest_mm(void)
{
    double best = 1e9;
    int i, axis;

    for (i = 0; i < detections.detection_count; i++) {
        double sum = 0;

        for (axis = 0; axis < 3; axis++) {
            const double d =
                detections.detection[i].head.centre_mm_q8[axis] / 256.0 - head_mm[axis];

            sum += d * d;
        }
        best = fmin(best, sqrt(sum));
    }
    return best;
}

static void look(void)
{
    ih_detections_add(&points, NULL, &hypotheses, &expected, &rig, &params, &scratch, &detections);
}

static void expect_head(void)
{
    int32_t centre[3];
    int axis;

    for (axis = 0; axis < 3; axis++) {
        centre[axis] = (int32_t)(head_mm[axis] * 256);
    }
    expected.head[expected.count++] = ih_ellipsoid_mean(centre);
}

/* A nest in the middle of the head. */
static void make_nest(void)
{
    int axis;

    hypotheses.hypothesis_count = 1;
    for (axis = 0; axis < 3; axis++) {
        hypotheses.hypothesis[0].centre_mm_q8[axis] = (int32_t)(head_mm[axis] * 256);
    }
}

/* Look anew: how many detections are of each source? */
static void count_sources(int32_t count[3])
{
    int32_t i;

    memset(count, 0, 3 * sizeof *count);
    ih_detections_begin(&detections);
    look();
    for (i = 0; i < detections.detection_count; i++) {
        count[detections.detection[i].source]++;
    }
}

static void a_head_is_among_the_detections(void)
{
    make_points(true, false);
    look();
    IH_TEST_WITHIN(SPACING_MM, 0, nearest_mm(), "distance", 0);
    TEST_ASSERT_EQUAL_INT32(IH_SOURCE_SCAN, detections.detection[0].source);
    IH_TEST_EQUAL(0, detections.view[0].hit, "nothing was expected", 0);
}

/* Where a head is expected it is looked for, even if nothing else leads there. */
static void an_expected_head_is_looked_for(void)
{
    make_points(true, false);
    params.scan.spacing_mm = 100000; /* one place */
    ih_detections_begin(&detections);
    points.point[0].depth_mm_q8 = 0;
    expect_head();
    look();
    IH_TEST_WITHIN(SPACING_MM, 0, nearest_mm(), "distance", 0);
    TEST_ASSERT_TRUE(detections.view[0].hit > 15);
    IH_TEST_RANGE(0, 1, detections.view[0].through, "through", 0);
    IH_TEST_EQUAL(0, detections.view[0].front, "front", 0);
}

/* It is looked for where it was seen for sure, too, in each of so many places, and no rays are counted there. */
static void a_head_is_looked_for_where_it_was_seen(void)
{
    int pass, i;

    for (pass = 0; pass < 3; pass++) {
        int32_t count = 0;

        make_points(true, false);
        ih_detections_begin(&detections);
        params.scan.candidate_max = 0;
        params.spacing_mm = 1;
        params.expected_max = pass;
        expect_head();
        expect_head();
        expected.last_sure[0] = expected.head[0];
        expected.last_sure[1] = expected.head[1];
        expected.last_sure[1].centre_mm_q8[0] += 20 << 8;
        expected.last_sure_count = 2;
        expected.count = 0;
        look();
        for (i = 0; i < detections.detection_count; i++) {
            count += detections.detection[i].source == IH_SOURCE_EXPECTED;
        }
        IH_TEST_RANGE(pass > 0, pass, count, "found", pass);
        if (pass > 0) {
            IH_TEST_WITHIN(SPACING_MM, 0, nearest_mm(), "distance", pass);
        }
        IH_TEST_EQUAL(0, detections.view[0].hit + detections.view[0].through, "rays", pass);
    }
}

/* More heads may be expected than are looked for again: their rays are looked at all the same. */
static void only_so_many_expected_heads_are_looked_for(void)
{
    int32_t hit[3], count[3] = {0};
    int pass, i;

    for (pass = 0; pass < 3; pass++) {
        make_points(true, false);
        ih_detections_begin(&detections);
        params.scan.candidate_max = 0;
        params.spacing_mm = 1;
        params.expected_max = pass;
        expected.count = 0;
        expect_head();
        expect_head();
        expected.head[1].centre_mm_q8[0] += 20 << 8;
        look();
        hit[pass] = detections.view[0].hit + 1000 * detections.view[1].hit;
        for (i = 0; i < detections.detection_count; i++) {
            count[pass] += detections.detection[i].source == IH_SOURCE_EXPECTED;
        }
        IH_TEST_RANGE(0, pass, count[pass], "looked for", pass);
        IH_TEST_EQUAL(hit[0], hit[pass], "rays", pass);
    }
    TEST_ASSERT_TRUE(hit[0] % 1000 > 15 && hit[0] / 1000 > 15);
    TEST_ASSERT_EQUAL_INT32(1, count[1]);
}

static void views_tell_an_empty_seat_from_hands(void)
{
    make_points(false, false);
    expect_head();
    expect_head();
    expected.head[1].centre_mm_q8[0] += 150 << 8;
    look();
    TEST_ASSERT_TRUE(detections.view[0].through > 15);
    IH_TEST_EQUAL(0, detections.view[0].hit + detections.view[0].front, "hit or front", 0);
    TEST_ASSERT_TRUE(detections.view[1].through > 5);
    ih_detections_begin(&detections);
    IH_TEST_EQUAL(0, detections.view[0].through, "begin", 0);
    make_points(true, true);
    look();
    TEST_ASSERT_TRUE(detections.view[0].front > 10);
    IH_TEST_RANGE(0, 2, detections.view[0].through, "through", 1);
}

/* The same window twice: views add up, detections do not. */
static void windows_add_up(void)
{
    struct ih_view once;
    int32_t count;

    make_points(true, false);
    expect_head();
    look();
    once = detections.view[0];
    count = detections.detection_count;
    look();
    IH_TEST_EQUAL(2 * once.hit, detections.view[0].hit, "hit", 0);
    IH_TEST_EQUAL(2 * once.through, detections.view[0].through, "through", 0);
    IH_TEST_EQUAL(count, detections.detection_count, "findings", 0);
}

static void nothing_at_the_lens_is_a_head(void)
{
    int i;

    make_points(true, false);
    for (params.front_min_mm = 600; params.front_min_mm <= 800; params.front_min_mm += 200) {
        ih_detections_begin(&detections);
        look();
        for (i = 0; i < detections.detection_count; i++) {
            const struct ih_ellipsoid *head = &detections.detection[i].head;

            TEST_ASSERT_TRUE(head->centre_mm_q8[2] - head->semi_mm_q8[2] >= params.front_min_mm
                                                                                << 8);
        }
        /* The head's own front is at 702 mm. */
        IH_TEST_EQUAL(params.front_min_mm < 702, nearest_mm() < 30, "found", params.front_min_mm);
    }
    ih_detections_begin(&detections);
    params.front_min_mm = 3000;
    expect_head();
    look();
    TEST_ASSERT_EQUAL_INT32(0, detections.detection_count);
    TEST_ASSERT_TRUE(detections.view[0].hit > 15); /* its rays are looked at all the same */
}

/* Log-odds are those of its evidence and of what is around it, whatever the rig is; the probability is theirs. */
static void detections_are_rated_by_their_evidence(void)
{
    static struct ih_dots dots;
    int pass, i;

    for (pass = 0; pass < 2; pass++) {
        make_points(true, false);
        rig.calibration.kind = pass == 0 ? IH_RIG_RANGE : IH_RIG_DOTS;
        ih_detections_begin(&detections);
        expected.count = 0;
        expect_head();
        ih_detections_add(&points, &dots, &hypotheses, &expected, &rig, &params, &scratch,
                          &detections);
        IH_TEST_RANGE(1, IH_DETECTIONS_MAX, detections.detection_count, "findings", pass);
        for (i = 0; i < detections.detection_count; i++) {
            const struct ih_detection *detection = &detections.detection[i];
            struct ih_surroundings surroundings;
            int32_t answer_q8[IH_SURROUNDINGS_MAPS];
            struct ih_score score;

            ih_surroundings_find(&scratch.rays, &detection->head, &surroundings);
            ih_surroundings_ask(&surroundings, answer_q8);
            ih_score_rate(&detection->evidence, answer_q8, &score);
            IH_TEST_EQUAL(score.logit_q10, detection->logit_q10, "log-odds", pass);
            IH_TEST_WITHIN(0.002, 1 / (1 + exp(-detection->logit_q10 / 1024.0)),
                           detection->probability_q16 / 65536.0, "probability", pass);
        }
    }
}

/* A head as it is expected, not fitted: its front is 702 mm away. */
static void a_front_may_be_as_near_as_its_limit(void)
{
    make_points(true, false);
    params.fit.step_count = 0;
    params.scan.candidate_max = 0;
    expect_head();
    params.front_min_mm = 702;
    look();
    TEST_ASSERT_EQUAL_INT32(1, detections.detection_count);
    ih_detections_begin(&detections);
    params.front_min_mm = 703;
    look();
    TEST_ASSERT_EQUAL_INT32(0, detections.detection_count);
}

/* What is not before the lens is drawn as if it were 1 mm away. */
static void outlines_end_a_millimetre_before_the_lens(void)
{
    static const double z_mm[] = {1, 0.5, 0, -700};
    const double fy = rig.calibration.fy_px_q16 / 65536.0;
    int i;

    for (i = 0; i < IH_TEST_COUNT(z_mm); i++) {
        const struct ih_detection detection = outline_of(0, 0, z_mm[i]);

        IH_TEST_WITHIN(1, 113 * fy, detection.a_px_q12 / 4096.0, "a", i);
        IH_TEST_WITHIN(0.01, rig.calibration.cx_px_q16 / 65536.0, detection.u_px_q12 / 4096.0, "u",
                       i);
    }
}

/* A fitted head is moved by what is around it, as far as is allowed. */
static void expect_moved(const struct ih_ellipsoid *fitted, const struct ih_ellipsoid *head)
{
    struct ih_ellipsoid moved = *fitted;

    ih_surroundings_move(&scratch.rays, params.move_max_mm, &moved);
    TEST_ASSERT_TRUE(memcmp(&moved, fitted, sizeof moved) != 0);
    TEST_ASSERT_EQUAL_MEMORY(&moved, head, sizeof moved);
}

/* Hopeless after a step: left there. Not hopeless: as if it had been fitted at once, then moved and measured there, as is
 * what is expected, hopeless or not. */
static void what_is_hopeless_is_fitted_for_a_step(void)
{
    static const int32_t hopeless_q10[] = {1 << 20, -(1 << 20), 1 << 20};
    int pass;

    struct ih_ellipsoid start;

    make_points(true, false);
    expect_head();
    expected.head[0].centre_mm_q8[0] += 30 << 8;
    start = expected.head[0];
    params.scan.promise_min_q5 = INT16_MIN;
    params.scan.candidate_max = 0;
    for (pass = 0; pass < 3; pass++) {
        struct ih_detections once;

        expected.count = pass == 2;
        hypotheses.hypothesis_count = pass < 2;
        memcpy(hypotheses.hypothesis[0].centre_mm_q8, start.centre_mm_q8,
               sizeof start.centre_mm_q8);
        params.move_max_mm = 40;
        params.hopeless_logit_q10 = hopeless_q10[pass];
        params.fit.step_count = IH_FIT_STEPS;
        ih_detections_begin(&detections);
        look();
        once = detections;
        params.hopeless_logit_q10 = hopeless_q10[0];
        params.fit.step_count = 1;
        expected.count = 0;
        hypotheses.hypothesis_count = 1;
        ih_detections_begin(&detections);
        look();
        TEST_ASSERT_EQUAL_INT32(1, detections.detection_count);
        TEST_ASSERT_EQUAL_INT32(1, once.detection_count);
        IH_TEST_EQUAL(pass == 0,
                      memcmp(&once.detection[0].head, &detections.detection[0].head,
                             sizeof once.detection[0].head) == 0,
                      "left after a step", pass);
        params.fit.step_count = IH_FIT_STEPS;
        expected.count = pass == 2;
        hypotheses.hypothesis_count = pass < 2;
        if (pass > 0) { /* and then moved */
            struct ih_evidence evidence;
            struct ih_fit whole;

            ih_fit_begin(&start, &whole);
            ih_fit_continue(&scratch.rays, &params.fit, IH_FIT_STEPS, &scratch.fit, &whole);
            expect_moved(&whole.ellipsoid, &once.detection[0].head);
            ih_evidence_collect(&scratch.rays, &once.detection[0].head, whole.start_mm_q8,
                                &evidence);
            TEST_ASSERT_EQUAL_MEMORY(&evidence, &once.detection[0].evidence, sizeof evidence);
            params.hopeless_logit_q10 = hopeless_q10[pass];
            params.move_max_mm = 1;
            ih_detections_begin(&detections);
            look();
            expect_moved(&whole.ellipsoid, &detections.detection[0].head);
            params.move_max_mm = 0;
            ih_detections_begin(&detections);
            look();
            TEST_ASSERT_EQUAL_MEMORY(&whole.ellipsoid, &detections.detection[0].head,
                                     sizeof whole.ellipsoid);
        }
    }
}

/* Of two starts near each other the first is tried. */
static void near_starts_are_tried_once(void)
{
    static const struct {
        double off_mm;
        int32_t count;
    } cases[] = {{0, 1}, {19.9, 1}, {20.1, 2}};
    int i;

    make_points(true, false);
    params.scan.candidate_max = 0;
    params.spacing_mm = 0;
    params.fit.step_count = 0;
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        expected.count = 0;
        expect_head();
        expect_head();
        expected.head[1].centre_mm_q8[1] += (int32_t)(cases[i].off_mm * 256);
        ih_detections_begin(&detections);
        look();
        IH_TEST_EQUAL(cases[i].count, detections.detection_count, "starts", i);
    }
}

/* Nests and places of the scan must promise something, expected heads need not. */
static void what_promises_nothing_is_passed_over(void)
{
    int pass;

    make_points(true, false);
    make_nest();
    expect_head();
    expected.head[0].centre_mm_q8[0] += 60 << 8;
    params.spacing_mm = 0;
    params.found_logit_q10 = INT32_MAX;
    for (pass = 0; pass < 2; pass++) {
        int32_t count[3];

        params.scan.promise_min_q5 = pass == 0 ? INT16_MIN : INT16_MAX;
        count_sources(count);
        IH_TEST_EQUAL(pass == 0, count[IH_SOURCE_SCAN] > 0, "scan", pass);
        IH_TEST_EQUAL(pass == 0, count[IH_SOURCE_NEST], "nest", pass);
        IH_TEST_EQUAL(1, count[IH_SOURCE_EXPECTED], "expected", pass);
    }
}

/* With a head that is sure to be found, places about it are not tried again; one just as far as the limit is, and one
 * about what is less sure. */
static void what_is_found_is_not_tried_again(void)
{
    static const struct {
        int32_t off_mm_q8, logit_q10;
        bool is_found;
    } cases[] = {{0, 3072, true},  {(130 << 8) - 1, 3072, true},  {130 << 8, 3072, false},
                 {0, 3071, false}, {-(130 << 8) + 1, 9000, true}, {-(130 << 8), 9000, false}};
    int i, axis;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        for (axis = 0; axis < 3; axis++) {
            const int32_t centre_mm_q8[3] = {1000, -2000, 256000};

            ih_detections_begin(&detections);
            detections.detection_count = 1;
            detections.detection[0] = (struct ih_detection){.logit_q10 = cases[i].logit_q10};
            memcpy(detections.detection[0].head.centre_mm_q8, centre_mm_q8, sizeof centre_mm_q8);
            detections.detection[0].head.centre_mm_q8[axis] += cases[i].off_mm_q8;
            IH_TEST_EQUAL(cases[i].is_found,
                          ih_candidates_is_found(&detections, centre_mm_q8, 130, 3072), "found", i);
        }
    }
}

/* Nests and places of the scan that are near a head are left out, expected heads are not. */
static void a_found_head_leaves_out_nests_and_places(void)
{
    int32_t count[2][3];
    int pass;

    make_points(true, false);
    make_nest();
    expect_head();
    expected.head[0].centre_mm_q8[0] += 25 << 8;
    params.spacing_mm = 0;
    params.apart_mm = 0;
    params.scan.promise_min_q5 = INT16_MIN;
    params.found_mm = 100000;
    for (pass = 0; pass < 2; pass++) {
        params.found_logit_q10 = pass == 0 ? INT32_MIN : INT32_MAX;
        count_sources(count[pass]);
    }
    TEST_ASSERT_EQUAL_INT32(1, count[0][IH_SOURCE_SCAN]);
    TEST_ASSERT_EQUAL_INT32(0, count[0][IH_SOURCE_NEST]);
    TEST_ASSERT_EQUAL_INT32(1, count[0][IH_SOURCE_EXPECTED]);
    TEST_ASSERT_TRUE(count[1][IH_SOURCE_SCAN] > 1);
    TEST_ASSERT_EQUAL_INT32(1, count[1][IH_SOURCE_NEST]);
}

static void no_points_give_no_detections(void)
{
    rig.calibration.kind = IH_RIG_RANGE;
    expect_head();
    look();
    TEST_ASSERT_EQUAL_INT32(0, detections.detection_count);
    TEST_ASSERT_EQUAL_INT32(0, detections.dropped_count);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(detections_are_sorted);
    RUN_TEST(of_two_at_one_place_the_more_probable_stays);
    RUN_TEST(a_full_list_drops_the_last_one);
    RUN_TEST(any_order_gives_a_good_list);
    RUN_TEST(outlines_are_near_the_true_projection);
    RUN_TEST(a_wide_head_has_its_long_axis_across);
    RUN_TEST(distances_are_those_of_the_front);
    RUN_TEST(outlines_exist_for_any_place);
    RUN_TEST(a_head_is_among_the_detections);
    RUN_TEST(an_expected_head_is_looked_for);
    RUN_TEST(a_head_is_looked_for_where_it_was_seen);
    RUN_TEST(only_so_many_expected_heads_are_looked_for);
    RUN_TEST(views_tell_an_empty_seat_from_hands);
    RUN_TEST(windows_add_up);
    RUN_TEST(nothing_at_the_lens_is_a_head);
    RUN_TEST(detections_are_rated_by_their_evidence);
    RUN_TEST(a_front_may_be_as_near_as_its_limit);
    RUN_TEST(outlines_end_a_millimetre_before_the_lens);
    RUN_TEST(what_is_hopeless_is_fitted_for_a_step);
    RUN_TEST(near_starts_are_tried_once);
    RUN_TEST(what_promises_nothing_is_passed_over);
    RUN_TEST(what_is_found_is_not_tried_again);
    RUN_TEST(a_found_head_leaves_out_nests_and_places);
    RUN_TEST(no_points_give_no_detections);
    return UNITY_END();
}
