/* ih_arcs against float64: points at equal steps, chords, and a sieve that never drops what is an
 * ellipse and drops what is far from one. */
#include "nests/ih_contours.h"
#include "nests/ih_arcs.h"

#include "ih_test.h"

#define UNIT 512

static struct ih_contours contours;
static struct ih_contour contour;
static struct ih_arcs arcs;
static uint64_t may_be[IH_ARCS_POINTS_MAX]; /* bit k: from this point over k steps */
static struct ih_ellipse_params params;
static int32_t points; /* on a contour: every test is run with the most and with fewer */

void setUp(void)
{
    memset(&contours, IH_TEST_FILL, sizeof contours);
    memset(&arcs, IH_TEST_FILL, sizeof arcs);
    ih_ellipse_params_default(&params);
    params.point_count = points;
}

void tearDown(void)
{
}

static void take(const struct ih_vertex *vertex, int32_t count, bool closed)
{
    contour = (struct ih_contour){100, (int16_t)count, closed};
    memcpy(&contours.vertex[100], vertex, (size_t)count * sizeof *vertex);
}

static bool make(void)
{
    int32_t i, last = -1;
    bool is_made;

    memset(may_be, 0, sizeof may_be);
    is_made = ih_arcs_make(&contours, &contour, &params, &arcs);
    for (i = 0; is_made && i < arcs.arc_count; i++) {
        const struct ih_arc *arc = &arcs.arc[i];

        IH_TEST_RANGE(last + 1, points * 100, arc->from * 100 + arc->steps, "order", i);
        last = arc->from * 100 + arc->steps;
        may_be[arc->from] |= UINT64_C(1) << arc->steps;
    }
    return is_made;
}

/* Around (x, y): radius 1 + lobes of depth `lobe`, stretched across by a factor. */
static void take_blob(double x, double y, double radius, double stretch, double lobe, int lobes,
                      double phase, int32_t count, bool closed)
{
    static struct ih_vertex vertex[IH_ARCS_VERTICES_MAX];
    int32_t i;

    for (i = 0; i < count; i++) {
        const double angle = (closed ? 2 : 1.7) * acos(-1.0) * i / count;
        const double r = radius * (1 + lobe * cos(lobes * angle + phase));
        const double across = x + r * stretch * cos(angle), down = y + r * sin(angle);

        vertex[i] = (struct ih_vertex){(int16_t)lround(fmax(0, fmin(46, across)) * UNIT),
                                       (int16_t)lround(fmax(0, fmin(46, down)) * UNIT)};
    }
    take(vertex, count, closed);
}

/* Of points from..from + steps closed by their chord. */
struct measured {
    double chord, area, trace, shape, ratio;
};

/* Of triangles from the first point to each edge: the chord's own is empty, so that one more point adds one triangle. */
struct sums {
    double area, x, y, xx, xy, yy;
};

static void add_triangle(struct sums *sums, double ax, double ay, double bx, double by)
{
    const double t = (ax * by - bx * ay) / 2;

    sums->area += t;
    sums->x += t * (ax + bx) / 3;
    sums->y += t * (ay + by) / 3;
    sums->xx += t * (ax * ax + ax * bx + bx * bx) / 6;
    sums->yy += t * (ay * ay + ay * by + by * by) / 6;
    sums->xy += t * (2 * ax * ay + ax * by + bx * ay + 2 * bx * by) / 12;
}

/* Where sums are those of one step less. */
static struct measured measure(struct sums *sums, int32_t from, int32_t steps)
{
    const int32_t last = from + steps;
    const double x = ih_test_from_q(arcs.x_q8[last] - arcs.x_q8[from], 8);
    const double y = ih_test_from_q(arcs.y_q8[last] - arcs.y_q8[from], 8);
    double cx, cy, xx, xy, yy, root;
    struct measured out;

    add_triangle(sums, ih_test_from_q(arcs.x_q8[last - 1] - arcs.x_q8[from], 8),
                 ih_test_from_q(arcs.y_q8[last - 1] - arcs.y_q8[from], 8), x, y);
    cx = sums->x / sums->area;
    cy = sums->y / sums->area;
    xx = sums->xx / sums->area - cx * cx;
    xy = sums->xy / sums->area - cx * cy;
    yy = sums->yy / sums->area - cy * cy;
    root = sqrt((xx - yy) * (xx - yy) / 4 + xy * xy);
    out.chord = hypot(x, y);
    out.area = sums->area;
    out.trace = xx + yy;
    out.shape = 4 * acos(-1.0) * sqrt(fmax(0, xx * yy - xy * xy)) / sums->area;
    out.ratio = sqrt((out.trace / 2 + root) / fmax(out.trace / 2 - root, 1e-9));
    return out;
}

struct arc_counts {
    int32_t ellipses, kept, dropped;
};

/* Every part against the sieve. What crosses itself may be kept. */
static void compare_all(bool simple, struct arc_counts *counts)
{
    const double ratio_max = ih_test_from_q(params.ratio_arc_max_q16, 16);
    const double shape_min = ih_test_from_q(IH_ARCS_SHAPE_MIN_Q16, 16);
    const double shape_max = ih_test_from_q(params.shape_max_q16, 16);
    const double trace_max = (ratio_max + 1 / ratio_max) * shape_max / (4 * acos(-1.0));
    int32_t from, k;

    for (from = 0; from < points; from++) {
        struct sums sums = {0};

        TEST_ASSERT_TRUE(may_be[from] >> points == 0);
        for (k = 1; k < points && from + k < arcs.count; k++) {
            const struct measured m = measure(&sums, from, k);
            const double chord_max =
                ih_test_from_q(params.chord_max_q16, 16) * ih_test_from_q(arcs.length_q8[k], 8);
            const bool kept = (may_be[from] >> k & 1) != 0;

            if (k >= IH_ARCS_STEPS_MIN && m.chord < chord_max - 0.01 && m.area > 0.51 &&
                m.shape > shape_min && m.shape < shape_max && m.ratio < ratio_max) {
                counts->ellipses++;
                IH_TEST_EQUAL(1, kept, "an ellipse", from * 100 + k);
            }
            if (k < IH_ARCS_STEPS_MIN || m.chord > chord_max + 0.01 || m.area < 0.49 ||
                (simple && m.area > 4.01 && m.trace > 1.03 * trace_max * m.area)) {
                IH_TEST_EQUAL(0, kept, "no ellipse", from * 100 + k);
                counts->dropped++;
            }
            counts->kept += kept;
        }
    }
}

static int32_t bits_of(uint32_t bits)
{
    int32_t count = 0;

    for (; bits != 0; bits &= bits - 1) {
        count++;
    }
    return count;
}

/* Parts that are left by fans. */
static int32_t count_promising(void)
{
    int32_t count = 0, from;

    for (from = 0; from < points; from++) {
        count += bits_of(arcs.low[from]) + bits_of(arcs.high[from]);
    }
    return count;
}

/* Of so many arcs of 56 points: their number grows with the square. */
static int32_t scaled_count(int32_t count)
{
    return count * points * points / (IH_ARCS_POINTS_MAX * IH_ARCS_POINTS_MAX);
}

static void the_sieve_drops_no_ellipse_and_keeps_little_else(void)
{
    struct ih_test_random random = {7};
    struct arc_counts counts = {0, 0, 0};
    int32_t promising = 0;
    int i;

    for (i = 0; i < 300; i++) {
        const double radius = 0.5 + (double)ih_test_between(&random, 0, 2000) / 100;
        const double stretch = 0.4 + (double)ih_test_between(&random, 0, 160) / 100;
        const double lobe = i % 3 == 0 ? 0 : (double)ih_test_between(&random, 0, 60) / 100;

        take_blob((double)ih_test_between(&random, 0, 46), (double)ih_test_between(&random, 0, 46),
                  radius, stretch, lobe, 1 + i % 5, i, 60 + i, i % 2 == 0);
        TEST_ASSERT_TRUE(make());
        compare_all(true, &counts);
        promising += count_promising();
    }
    TEST_ASSERT_GREATER_THAN(scaled_count(2000), counts.ellipses);
    TEST_ASSERT_GREATER_THAN(scaled_count(100000), counts.dropped);
    TEST_ASSERT_LESS_THAN(8 * counts.ellipses, counts.kept);
    TEST_ASSERT_LESS_THAN(2 * counts.kept, promising); /* else fans do not sift */
}

/* With looser limits more is kept; without any, all that has an area. */
static void limits_are_those_of_the_parameters(void)
{
    struct arc_counts counts = {0, 0, 0};
    int i;

    for (i = 0; i < 4; i++) {
        params.shape_max_q16 = 65536 + (i << 13);
        params.ratio_arc_max_q16 = (4 + i) << 15;
        params.chord_max_q16 = (1 + i) << 14;
        take_blob(23, 23, 18, 1.1, 0.15, 3, 1, 200, true);
        TEST_ASSERT_TRUE(make());
        compare_all(true, &counts);
    }
    params.ratio_arc_max_q16 = 200 << 16;
    take_blob(23, 23, 5, 4.5, 0, 1, 0, 200, true);
    TEST_ASSERT_TRUE(make());
    TEST_ASSERT_TRUE(may_be[0] >> (points - 6) & 1);
    params.ratio_arc_max_q16 = 0; /* as 1 */
    TEST_ASSERT_TRUE(make());
    TEST_ASSERT_FALSE(may_be[0] >> (points - 6) & 1);
}

/* Walks all over the grid: their arcs cross themselves as much as can be. */
static void walks_do_not_overflow(void)
{
    static struct ih_vertex vertex[IH_ARCS_VERTICES_MAX];
    struct ih_test_random random = {83};
    struct arc_counts counts = {0, 0, 0};
    int32_t i, pass;

    for (pass = 0; pass < 60; pass++) {
        int32_t x = 23 * UNIT, y = 23 * UNIT;

        for (i = 0; i < IH_ARCS_VERTICES_MAX; i++) { /* in steps of at most one cell */
            x += (int32_t)ih_test_between(&random, pass % 2 == 0 ? -UNIT : -UNIT / 3, UNIT);
            y += (int32_t)ih_test_between(&random, -UNIT, pass % 3 == 0 ? UNIT / 3 : UNIT);
            x = x < 0 ? 0 : x > 46 * UNIT ? 46 * UNIT : x;
            y = y < 0 ? 0 : y > 46 * UNIT ? 46 * UNIT : y;
            vertex[i] = (struct ih_vertex){(int16_t)x, (int16_t)y};
        }
        take(vertex, IH_ARCS_VERTICES_MAX, pass % 4 < 2);
        TEST_ASSERT_TRUE(make());
        compare_all(false, &counts);
    }
    TEST_ASSERT_GREATER_THAN(scaled_count(10000), counts.dropped);
}

static int16_t on_grid_q9(double steps)
{
    return (int16_t)lround(UNIT * fmin(46, fmax(0, steps)));
}

/* Two loops of opposite turns, as an eight: next to no area, but moments as great as there are; the trace
 * is below zero where the far loop is the negative one. */
static void loops_that_cancel_do_not_overflow(void)
{
    static struct ih_vertex vertex[400];
    struct ih_test_random random = {84};
    struct arc_counts counts = {0, 0, 0};
    int32_t pass, i;

    for (pass = 0; pass < 400; pass++) {
        const double near = 1 + (double)ih_test_between(&random, 0, 1000) / 100;
        const double far = near * (double)ih_test_between(&random, 800, 1100) / 1000;
        const double phase = (double)ih_test_between(&random, 0, 628) / 100;
        const double apart = (double)ih_test_between(&random, 0, 2200) / 100;

        for (i = 0; i < 200; i++) {
            const double angle = 2 * acos(-1.0) * i / 200;

            vertex[i] =
                (struct ih_vertex){on_grid_q9(23 - apart * cos(phase) + near * cos(phase + angle)),
                                   on_grid_q9(23 - apart * sin(phase) + near * sin(phase + angle))};
            vertex[200 + i] =
                (struct ih_vertex){on_grid_q9(23 + apart * cos(phase) - far * cos(phase - angle)),
                                   on_grid_q9(23 + apart * sin(phase) - far * sin(phase - angle))};
        }
        take(vertex, 400, true);
        TEST_ASSERT_TRUE(make());
        compare_all(false, &counts);
    }
    TEST_ASSERT_GREATER_THAN(scaled_count(10000), counts.dropped);
}

/* On a circle of many vertices the points are equal shares of its length apart; an open one ends at its last
 * vertex, a closed one goes round twice. */
static void points_stand_at_equal_steps(void)
{
    const double step = 2 * acos(-1.0) * 20 / points;
    int32_t k;

    take_blob(23, 23, 20, 1, 0, 1, 0, 700, true);
    TEST_ASSERT_TRUE(make());
    TEST_ASSERT_EQUAL(2 * points, arcs.count);
    for (k = 0; k < arcs.count; k++) {
        const double angle = 2 * acos(-1.0) * k / points;

        IH_TEST_WITHIN(0.08, 23 + 20 * cos(angle), ih_test_from_q(arcs.x_q8[k], 8), "x", k);
        IH_TEST_WITHIN(0.08, 23 + 20 * sin(angle), ih_test_from_q(arcs.y_q8[k], 8), "y", k);
        if (k < points) {
            IH_TEST_WITHIN(0.01 * step * k + 0.01, step * k, ih_test_from_q(arcs.length_q8[k], 8),
                           "arc", k);
        }
    }
    TEST_ASSERT_EQUAL(arcs.x_q8[0] * 2, contours.vertex[100].x_q9);
    take_blob(23, 23, 20, 1, 0, 1, 0, 700, false);
    TEST_ASSERT_TRUE(make());
    TEST_ASSERT_EQUAL(points, arcs.count);
    IH_TEST_WITHIN(0.03, contours.vertex[799].x_q9 / 512.0,
                   ih_test_from_q(arcs.x_q8[points - 1], 8), "last x", 0);
    IH_TEST_WITHIN(0.03, contours.vertex[799].y_q9 / 512.0,
                   ih_test_from_q(arcs.y_q8[points - 1], 8), "last y", 0);
}

static void a_box_holds_what_is_in_it_and_a_step_more(void)
{
    static const struct ih_vertex vertex[] = {{1000, 3000}, {4000, 2500}, {2000, 7000}};
    static const struct ih_vertex inside[] = {{1000, 2500}, {4000, 7000}, {998, 5000},
                                              {4002, 5000}, {2000, 2498}, {2000, 7002}};
    static const struct ih_vertex outside[] = {
        {997, 5000}, {4003, 5000}, {2000, 2497}, {2000, 7003}, {0, 0}};
    struct ih_box box;
    int i;

    take(vertex, 3, true);
    box = ih_arcs_box(&contours, &contour);
    for (i = 0; i < IH_TEST_COUNT(inside); i++) {
        IH_TEST_EQUAL(1, ih_box_holds(&box, inside[i]), "inside", i);
    }
    for (i = 0; i < IH_TEST_COUNT(outside); i++) {
        IH_TEST_EQUAL(0, ih_box_holds(&box, outside[i]), "outside", i);
    }
}

static void too_few_or_too_many_vertices_are_not_searched(void)
{
    take_blob(23, 23, 20, 1, 0, 1, 0, IH_ARCS_STEPS_MIN - 1, true);
    TEST_ASSERT_FALSE(make());
    take_blob(23, 23, 20, 1, 0, 1, 0, IH_ARCS_STEPS_MIN, true);
    TEST_ASSERT_TRUE(make());
    take_blob(23, 23, 20, 1, 0, 1, 0, IH_ARCS_VERTICES_MAX, true);
    TEST_ASSERT_TRUE(make());
    contour.vertex_count++;
    TEST_ASSERT_FALSE(make());
}

/* The number of points is a whole number of vectors within its bounds, whatever is given. */
static void the_number_of_points_is_bounded(void)
{
    static const int32_t given_count[] = {INT32_MIN, 0,  15, 16, 23, 31,
                                          32,        39, 55, 56, 57, INT32_MAX};
    static const int32_t given[] = {16, 16, 16, 16, 16, 24, 32, 32, 48, 56, 56, 56};
    int i;

    for (i = 0; i < IH_TEST_COUNT(given_count); i++) {
        params.point_count = given_count[i];
        take_blob(23, 23, 20, 1, 0, 1, 0, 200, false);
        TEST_ASSERT_TRUE(ih_arcs_make(&contours, &contour, &params, &arcs));
        IH_TEST_EQUAL(given[i], arcs.point_count, "points", given_count[i]);
        IH_TEST_EQUAL(given[i], arcs.count, "in use", given_count[i]);
    }
}

int main(void)
{
    static const int32_t counts[] = {IH_ARCS_POINTS_MAX, 32, IH_ARCS_POINTS_MIN};
    int i;

    UNITY_BEGIN();
    for (i = 0; i < IH_TEST_COUNT(counts); i++) {
        points = counts[i];
        RUN_TEST(the_sieve_drops_no_ellipse_and_keeps_little_else);
        RUN_TEST(limits_are_those_of_the_parameters);
        RUN_TEST(walks_do_not_overflow);
        RUN_TEST(loops_that_cancel_do_not_overflow);
        RUN_TEST(points_stand_at_equal_steps);
    }
    RUN_TEST(the_number_of_points_is_bounded);
    RUN_TEST(a_box_holds_what_is_in_it_and_a_step_more);
    RUN_TEST(too_few_or_too_many_vertices_are_not_searched);
    return UNITY_END();
}
