/* ih_nests on surfaces whose contours are known in closed form. */
#include "nests/ih_contours.h"
#include "nests/ih_ellipse.h"
#include "nests/ih_nests.h"
#include "nests/ih_arcs.h"
#include "surface/ih_surface.h"

#include <stdlib.h>

#include "ih_test.h"

#define SIDE IH_SURFACE_GRID
#define PI 3.14159265358979323846
#define UNIT_Q28 4026532 /* 0.015: 11.6 mm a grid step at 850 mm */

/* Half an ellipsoid: middle and semi-axes on the grid in steps, front and depth in mm. */
struct half_ellipsoid {
    double x, y, a, b, front_mm, depth_mm;
};

static struct ih_surface surface;
static struct ih_nests_params params;
static struct ih_nests_scratch scratch;
static struct ih_nests nests;

void setUp(void)
{
    memset(&surface, 0, sizeof surface);
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    memset(&nests, IH_TEST_FILL, sizeof nests);
    ih_nests_params_paper(&params); /* what leaves nests out has tests of its own */
    surface.valid = true;
    surface.field.unit_q28 = UNIT_Q28;
}

void tearDown(void)
{
}

static void set_plane(double depth_mm, double per_x, double per_y)
{
    int32_t x, y;

    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            surface.depth_mm_q8[y][x] = (int32_t)lround(256 * (depth_mm + per_x * x + per_y * y));
        }
    }
}

/* Put something before what is there. */
static void put_nearer(int32_t x, int32_t y, double depth_mm)
{
    const int32_t depth_q8 = (int32_t)lround(256 * depth_mm);

    if (depth_q8 < surface.depth_mm_q8[y][x]) {
        surface.depth_mm_q8[y][x] = depth_q8;
    }
}

static void put_ellipsoid(const struct half_ellipsoid *e)
{
    int32_t x, y;

    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            const double r2 =
                (x - e->x) * (x - e->x) / (e->a * e->a) + (y - e->y) * (y - e->y) / (e->b * e->b);

            if (r2 < 1) {
                put_nearer(x, y, e->front_mm + e->depth_mm * (1 - sqrt(1 - r2)));
            }
        }
    }
}

static void find(void)
{
    int32_t i;

    surface.nearest_mm_q8 = INT32_MAX;
    for (i = 0; i < SIDE * SIDE; i++) {
        if (surface.depth_mm_q8[i / SIDE][i % SIDE] < surface.nearest_mm_q8) {
            surface.nearest_mm_q8 = surface.depth_mm_q8[i / SIDE][i % SIDE];
        }
    }
    memset(&nests, IH_TEST_FILL, sizeof nests);
    ih_nests_find(&surface, &params, &scratch, &nests);
}

/* What holds for every nest. */
static void check_nests(void)
{
    int32_t i, k;

    IH_TEST_RANGE(0, IH_NESTS_MAX, nests.nest_count, "nests", 0);
    for (i = 0; i < nests.nest_count; i++) {
        const struct ih_nest *nest = &nests.nest[i];

        IH_TEST_EQUAL(surface.depth_mm_q8[nest->minimum.y_q9 / 512][nest->minimum.x_q9 / 512],
                      nest->nearest_mm_q8, "depth of the minimum", i);
        TEST_ASSERT_TRUE(i == 0 || nest[-1].nearest_mm_q8 <= nest->nearest_mm_q8);
        IH_TEST_RANGE(0, IH_NESTS_SLICES_MAX, nest->slice_count, "slices", i);
        TEST_ASSERT_TRUE(nest->front_mm_q8 >= nest->nearest_mm_q8);
        if (nest->slice_count == 0) {
            IH_TEST_EQUAL(nest->nearest_mm_q8, nest->front_mm_q8, "front without slices", i);
        } else {
            TEST_ASSERT_TRUE(nest->slice[0].area_mm2 >= params.blunt_mm2);
        }
        for (k = 0; k < nest->slice_count; k++) {
            const struct ih_slice *slice = &nest->slice[k];

            /* the front and what lies behind it add up to a level */
            IH_TEST_EQUAL(0,
                          (nest->front_mm_q8 + slice->behind_mm_q8 - surface.nearest_mm_q8) %
                              (params.level_step_mm << 8),
                          "level", k);
            IH_TEST_RANGE(1, params.depth_max_mm << 8, slice->behind_mm_q8, "behind", k);
            TEST_ASSERT_TRUE(k == 0 || slice->behind_mm_q8 > slice[-1].behind_mm_q8);
            TEST_ASSERT_TRUE(slice->ellipse.area_q16 > 0 && slice->area_mm2 > 0);
            IH_TEST_RANGE(0, params.ellipse.shape_max_q16, slice->ellipse.shape_q16, "shape", k);
            IH_TEST_RANGE(65536 - 256,
                          slice->whole ? params.ellipse.ratio_closed_max_q16
                                       : params.ellipse.ratio_arc_max_q16,
                          slice->ellipse.ratio_q16, "ratio", k);
            /* "when its area falls below 0.6 of the slice before"; 1 mm^2 for rounding */
            TEST_ASSERT_TRUE(k == 0 || slice->area_mm2 >= 0.6 * slice[-1].area_mm2 - 1);
        }
    }
}

/* A grid step in mm at a depth. */
static double step_mm(double depth_mm)
{
    return depth_mm * ih_test_from_q(UNIT_Q28, 28) * IH_SURFACE_STEP_NUMERATOR /
           IH_SURFACE_STEP_DENOMINATOR;
}

static const struct ih_nest *nest_at(double x, double y)
{
    int32_t i;

    for (i = 0; i < nests.nest_count; i++) {
        if (hypot(nests.nest[i].minimum.x_q9 / 512.0 - x, nests.nest[i].minimum.y_q9 / 512.0 - y) <
            1) {
            return &nests.nest[i];
        }
    }
    return NULL;
}

/* Closed form: t behind the ellipsoid's front the cut is pi a b (1 - (1 - t / c)^2). */
static void check_slices(const struct ih_nest *nest, const struct half_ellipsoid *e, int32_t min)
{
    int32_t k, compared = 0;

    for (k = 0; k < nest->slice_count; k++) {
        const struct ih_slice *slice = &nest->slice[k];
        const double level = ih_test_from_q(nest->front_mm_q8 + slice->behind_mm_q8, 8);
        const double fraction = (level - e->front_mm) / e->depth_mm;
        const double area = PI * e->a * e->b * (1 - (1 - fraction) * (1 - fraction));
        const double small = sqrt(area / PI);

        if (fraction > 0.5 || small < 2) {
            continue; /* steep flanks and contours of a few cells are not what the grid can show */
        }
        TEST_ASSERT_TRUE(slice->whole);
        /* Linear interpolation moves a vertex inwards by up to f'' / (8 f') along the slope, 4 / 8
         * r at half the depth, r being the radius, and by 1 / 8 r across: 5 / 8 r in all, and
         * relative to the area twice that by r. */
        IH_TEST_WITHIN(1.25 / (small * small), 1.0,
                       ih_test_from_q(slice->ellipse.area_q16, 16) / area, "area", k);
        IH_TEST_WITHIN(1.25 / (small * small), 1.0,
                       slice->area_mm2 / (area * step_mm(level) * step_mm(level)), "area in mm^2",
                       k);
        /* The cut is symmetric; the grid is not, by a part of a cell's error above. */
        IH_TEST_WITHIN(0.1, e->x, ih_test_from_q(slice->ellipse.x_q16, 16), "x", k);
        IH_TEST_WITHIN(0.1, e->y, ih_test_from_q(slice->ellipse.y_q16, 16), "y", k);
        IH_TEST_WITHIN(1.25 / (small * small), e->b > e->a ? e->b / e->a : e->a / e->b,
                       ih_test_from_q(slice->ellipse.ratio_q16, 16), "ratio", k);
        compared++;
    }
    IH_TEST_RANGE(min, IH_NESTS_SLICES_MAX, compared, "slices compared", 0);
}

static void an_ellipsoid_before_a_wall_is_one_nest(void)
{
    static const struct half_ellipsoid hypotheses[] = {
        {23, 23, 6.5, 9.5, 850, 98}, {18.4, 15.7, 8, 8, 700, 120}, {27.2, 30.9, 10, 6.5, 1200, 90}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(hypotheses); i++) {
        set_plane(hypotheses[i].front_mm + 400, 0, 0);
        put_ellipsoid(&hypotheses[i]);
        find();
        check_nests();
        TEST_ASSERT_EQUAL_INT32(1, nests.nest_count);
        TEST_ASSERT_NOT_NULL(nest_at(hypotheses[i].x, hypotheses[i].y));
        check_slices(&nests.nest[0], &hypotheses[i], 3);
    }
}

/* Fine steps, 4.25 mm at 850 mm: so that a tip of less than blunt_mm2 spans several cells. */
#define FINE_UNIT_Q28 1476395 /* 0.0055 */
#define SPIKE_RADIUS 4.0      /* steps, where it is as high as SPIKE_HEIGHT_MM */
#define SPIKE_HEIGHT_MM 45.0

/* A spike, a paraboloid whose tip is so far before the front of a round ellipsoid. */
static void put_spiked(const struct half_ellipsoid *e, double spike_mm)
{
    int32_t x, y;

    surface.field.unit_q28 = FINE_UNIT_Q28;
    set_plane(e->front_mm + 400, 0, 0);
    put_ellipsoid(e);
    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            const double r2 =
                ((x - e->x) * (x - e->x) + (y - e->y) * (y - e->y)) / (SPIKE_RADIUS * SPIKE_RADIUS);

            if (spike_mm > 0 && r2 < 4) {
                put_nearer(x, y, e->front_mm - spike_mm + SPIKE_HEIGHT_MM * r2);
            }
        }
    }
    find();
    check_nests();
    TEST_ASSERT_NOT_NULL(nest_at(e->x, e->y));
}

/* Both are round and have one axis: the cut is the greater of the two circles, mm^2. */
static double spiked_area_mm2(const struct half_ellipsoid *e, double spike_mm, double level_mm)
{
    const double step = level_mm * ih_test_from_q(FINE_UNIT_Q28, 28) * IH_SURFACE_STEP_NUMERATOR /
                        IH_SURFACE_STEP_DENOMINATOR;
    const double t = level_mm - e->front_mm;
    const double body = t <= 0 ? 0 : e->a * e->a * (1 - pow(1 - t / e->depth_mm, 2));
    const double spike =
        spike_mm <= 0 ? 0 : SPIKE_RADIUS * SPIKE_RADIUS * (t + spike_mm) / SPIKE_HEIGHT_MM;

    return PI * fmax(body, spike) * step * step;
}

/* The front in closed form: between the levels, 10 mm apart from the tip on, before and behind
 * which the area passes blunt_mm2; less blunt_mm2 over a head's growth of 565 mm^2 per mm. */
static double spiked_front_mm(const struct half_ellipsoid *e, double spike_mm, double *passed_level)
{
    double level = e->front_mm - spike_mm, area = 0, next = 0;

    for (;; level += params.level_step_mm, area = next) {
        next = spiked_area_mm2(e, spike_mm, level + params.level_step_mm);
        if (next >= params.blunt_mm2) {
            break;
        }
    }
    *passed_level = level + params.level_step_mm;
    return fmax(e->front_mm - spike_mm,
                level + params.level_step_mm * (params.blunt_mm2 - area) / (next - area) -
                    params.blunt_mm2 / 565.0);
}

static void the_tip_is_passed_over(void)
{
    static const struct half_ellipsoid head = {23, 23, 19, 19, 850, 98};
    int32_t spike, compared = 0;

    for (spike = 0; spike <= 66; spike += 3) {
        double level;
        const double front = spiked_front_mm(&head, spike, &level);
        const double area = spiked_area_mm2(&head, spike, level);
        const struct ih_nest *nest;

        if (fabs(area / params.blunt_mm2 - 1) < 0.2 ||
            fabs(spiked_area_mm2(&head, spike, level - 10) / params.blunt_mm2 - 1) < 0.2) {
            continue; /* the grid may see either side of the limit */
        }
        put_spiked(&head, spike);
        nest = nest_at(head.x, head.y);
        TEST_ASSERT_NOT_NULL(nest);
        TEST_ASSERT_TRUE(nest->slice_count >= 5);
        IH_TEST_EQUAL((850 - spike) << 8, nest->nearest_mm_q8, "nearest", spike);
        IH_TEST_WITHIN(0.02, level,
                       ih_test_from_q(nest->front_mm_q8 + nest->slice[0].behind_mm_q8, 8),
                       "first slice that is not the tip's", spike);
        /* Areas of 4 to 8 steps' radius are good to 1.25 / r^2 (as above): 3 to 8 % of up to
         * 2000 mm^2 at the tip and of 2500 to 7000 mm^2 behind it. Of the 10 mm between them the
         * limit lies at a part that is then good to 8 %. */
        IH_TEST_WITHIN(0.8, front, ih_test_from_q(nest->front_mm_q8, 8), "front", spike);
        /* That is the ellipsoid's front, not the spike's tip. A sphere of 19 steps grows by 390 mm
         * a mm, not by 565: it needs 5.2 mm, of which 3.5 are allowed for. */
        IH_TEST_WITHIN(2, head.front_mm, ih_test_from_q(nest->front_mm_q8, 8), "true front", spike);
        compared++;
    }
    TEST_ASSERT_TRUE(compared >= 15);
}

/* With nothing to pass over a nest begins at its minimum. */
static void without_a_limit_there_is_no_tip(void)
{
    static const struct half_ellipsoid head = {23, 23, 19, 19, 850, 98};
    const struct ih_nest *nest = &nests.nest[0];

    params.blunt_mm2 = 0;
    put_spiked(&head, 40);
    TEST_ASSERT_TRUE(nest == nest_at(head.x, head.y));
    TEST_ASSERT_EQUAL_INT32(810 << 8, nest->nearest_mm_q8);
    TEST_ASSERT_EQUAL_INT32(nest->nearest_mm_q8, nest->front_mm_q8);
    TEST_ASSERT_EQUAL_INT32(10 << 8, nest->slice[0].behind_mm_q8);
}

/* 75 mm: the cut is still the spike's 70 mm behind its tip and the ellipsoid's at 80. */
static void a_tip_that_is_too_long_ends_the_nest(void)
{
    static const struct half_ellipsoid head = {23, 23, 19, 19, 850, 98};
    static const int32_t max[] = {70, 69, 100, 40};
    int i;

    for (i = 0; i < IH_TEST_COUNT(max); i++) {
        const struct ih_nest *nest;

        params.tip_max_mm = max[i];
        put_spiked(&head, 75);
        nest = nest_at(head.x, head.y);
        TEST_ASSERT_NOT_NULL(nest);
        IH_TEST_EQUAL(max[i] < 70, nest->slice_count == 0, "tip", max[i]);
        TEST_ASSERT_TRUE(nest->ended);
    }
    params.tip_max_mm = 70;
    put_spiked(&head, 85); /* 80 mm and still thin */
    TEST_ASSERT_EQUAL_INT32(0, nest_at(head.x, head.y)->slice_count);
    TEST_ASSERT_TRUE(nest_at(head.x, head.y)->ended);
}

static void two_ellipsoids_are_two_nests(void)
{
    static const struct half_ellipsoid near = {12, 20, 6.5, 9, 800, 100};
    static const struct half_ellipsoid far = {34, 24, 7, 8, 953, 110};

    set_plane(1500, 0, 0);
    put_ellipsoid(&near);
    put_ellipsoid(&far);
    find();
    check_nests();
    TEST_ASSERT_EQUAL_INT32(2, nests.nest_count);
    TEST_ASSERT_TRUE(nest_at(near.x, near.y) == &nests.nest[0]);
    TEST_ASSERT_TRUE(nest_at(far.x, far.y) == &nests.nest[1]);
    check_slices(&nests.nest[0], &near, 4);
    check_slices(&nests.nest[1], &far, 4);
}

/* A pit is a maximum of depth: its contours shrink with depth, nothing may stand on them. The flat
 * plate round it may count as a minimum. */
static void a_pit_supports_nothing(void)
{
    int32_t x, y, i;

    set_plane(900, 0, 0);
    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            const double r2 = ((x - 23) * (x - 23) + (y - 23) * (y - 23)) / 144.0;

            surface.depth_mm_q8[y][x] += r2 < 1 ? (int32_t)(256 * 100 * (1 - r2)) : 0;
        }
    }
    find();
    check_nests();
    for (i = 0; i < nests.nest_count; i++) {
        IH_TEST_EQUAL(0, nests.nest[i].slice_count, "slices", i);
    }
}

/* The same pit in a plate that is bent towards the camera in its middle row: minima beside the pit
 * exist, but no slice may be centred in the pit. */
static void a_pit_in_a_bulge_is_no_slice(void)
{
    int32_t x, y, i, k;

    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            const double r2 = (x - 23) * (x - 23) + (y - 23) * (y - 23);

            surface.depth_mm_q8[y][x] =
                (int32_t)(256 * (900 + 0.3 * r2 + 60 * exp(-r2 / 18) + 0.1 * x));
        }
    }
    find();
    check_nests();
    TEST_ASSERT_TRUE(nests.nest_count > 0);
    for (i = 0; i < nests.nest_count; i++) {
        for (k = 0; k < nests.nest[i].slice_count; k++) {
            const struct ih_slice *slice = &nests.nest[i].slice[k];
            const double radius = sqrt(ih_test_from_q(slice->ellipse.area_q16, 16) / PI);
            const double away = hypot(ih_test_from_q(slice->ellipse.x_q16, 16) - 23,
                                      ih_test_from_q(slice->ellipse.y_q16, 16) - 23);

            /* Either beside the pit, or all round it: the pit's rim has a radius of 6 steps. */
            TEST_ASSERT_TRUE(away > 2 || radius > 6);
        }
    }
}

/* A bump on the floor of a crater in a plate that comes nearer outwards, so that it has no minimum
 * of its own: the contours of the crater run round the bump as well, the other way. */
static void a_bump_in_a_crater_stands_on_its_own_contours(void)
{
    static const struct half_ellipsoid bump = {23, 23, 7, 8, 900, 90};
    int32_t x, y;

    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            const double r = hypot(x - 23, y - 23);

            surface.depth_mm_q8[y][x] = (int32_t)(256 * (r > 18 ? 900 - 3 * r : 1050));
        }
    }
    put_ellipsoid(&bump);
    find();
    check_nests();
    TEST_ASSERT_NOT_NULL(nest_at(bump.x, bump.y));
    check_slices(nest_at(bump.x, bump.y), &bump, 3);
}

static int32_t below_tip_q8(const struct ih_nest *nest, int32_t slice)
{
    return nest->front_mm_q8 + nest->slice[slice].behind_mm_q8 - nest->nearest_mm_q8;
}

/* Depth behind the tip at which a five-lobed body is as wide as r in direction angle: round at the
 * tip and from 120 mm on, lobed in between, ever wider. */
static double lobed_depth_mm(double r, double angle)
{
    double t = 0;

    for (t = 0; t < 300; t += 0.25) {
        const double lobe = t > 20 && t < 120 ? pow(sin(PI * (t - 20) / 100), 2) : 0;

        if ((2 + 0.1 * t) * (1 + 0.25 * lobe * cos(5 * angle)) > r) {
            break;
        }
    }
    return t;
}

/* From 70 to 90 mm its contours are no ellipses (shape 1.05 to 1.12) and have no part that is one. */
static void a_nest_bridges_as_many_levels_as_it_may(void)
{
    const struct ih_nest *nest = &nests.nest[0];
    int32_t x, y, k, between = 0;

    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            surface.depth_mm_q8[y][x] = (int32_t)lround(
                256 * (800 + lobed_depth_mm(hypot(x - 23, y - 23), atan2(y - 23, x - 23)) +
                       0.05 * hypot(x - 23, y - 23)));
        }
    }
    find();
    check_nests();
    TEST_ASSERT_EQUAL_INT32(1, nests.nest_count);
    for (k = 0; k < nest->slice_count; k++) {
        between += below_tip_q8(nest, k) > 75 << 8 && below_tip_q8(nest, k) < 85 << 8;
    }
    TEST_ASSERT_EQUAL_INT32(0, between);
    TEST_ASSERT_TRUE(below_tip_q8(nest, nest->slice_count - 1) >= 110 << 8);
    params.gap_max = 1;
    find();
    TEST_ASSERT_TRUE(nest->ended);
    TEST_ASSERT_TRUE(below_tip_q8(nest, nest->slice_count - 1) < 80 << 8);
}

/* A five-lobed body that widens by 0.12 steps per mm: its outline at t is 3 + 0.12 t times
 * 1 + e cos 5a. The lobes swell and vanish twice, about 50 and about 120 mm behind the tip. */
static double lobes_at(double t)
{
    if (t > 20 && t < 80) {
        return 0.25 * pow(sin(PI * (t - 20) / 60), 2);
    }
    return t > 80 && t < 160 ? 0.25 * pow(sin(PI * (t - 80) / 80), 2) : 0;
}

/* Its shape, 4 pi sqrt(det) / area, with area pi R^2 (1 + e^2 / 2) and fourth moment
 * pi R^4 / 4 (1 + 3 e^2 + 3 e^4 / 8) in either direction. */
static double lobed_shape(double e)
{
    return (1 + 3 * e * e + 3 * pow(e, 4) / 8) / pow(1 + e * e / 2, 2);
}

static void put_twice_lobed(void)
{
    int32_t x, y;

    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            const double r = hypot(x - 23, y - 23), angle = atan2(y - 23, x - 23);
            double t = 0;

            while (t < 300 && (3 + 0.12 * t) * (1 + lobes_at(t) * cos(5 * angle)) <= r) {
                t += 0.25;
            }
            surface.depth_mm_q8[y][x] = (int32_t)lround(256 * (800 + t + 0.02 * r));
        }
    }
}

/* Two gaps of three levels: a nest that may bridge three gets over both, one after the other. */
static void a_bridged_gap_is_forgotten(void)
{
    const struct ih_nest *nest = &nests.nest[0];
    int32_t t, k = 0, missing = 0;

    params.ellipse.chord_max_q16 = 0; /* no arcs: the closed contour or nothing */
    params.depth_max_mm = 155;
    params.end_depth_mm = 1000; /* after a gap the area is three times as large */
    params.gap_max = 3;
    put_twice_lobed();
    find();
    check_nests();
    TEST_ASSERT_EQUAL_INT32(1, nests.nest_count);
    for (t = 10; t <= 150; t += 10) {
        const bool elliptical =
            lobed_shape(lobes_at(t)) <= ih_test_from_q(params.ellipse.shape_max_q16, 16);

        missing += !elliptical;
        if (elliptical) {
            TEST_ASSERT_TRUE(k < nest->slice_count);
            IH_TEST_EQUAL(t << 8, below_tip_q8(nest, k), "level of a slice", t);
            k++;
        }
    }
    TEST_ASSERT_EQUAL_INT32(6, missing); /* 40, 50, 60 and 110, 120, 130 */
    TEST_ASSERT_EQUAL_INT32(k, nest->slice_count);
    params.gap_max = 2;
    find();
    TEST_ASSERT_TRUE(nest->ended);
    TEST_ASSERT_EQUAL_INT32(3, nest->slice_count); /* 10, 20, 30 */
}

static void planes_have_no_minimum(void)
{
    static const double slopes[][2] = {{0, 0}, {5, 0}, {0, -4}, {3, 7}, {-0.01, 0.02}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(slopes); i++) {
        set_plane(1000, slopes[i][0], slopes[i][1]);
        find();
        IH_TEST_EQUAL(0, nests.nest_count, "plane", i);
        IH_TEST_EQUAL(0, nests.minima_dropped, "plane", i);
    }
}

/* Of equal nodes the first counts, so that a flat top is one minimum. */
static void a_flat_top_is_one_minimum(void)
{
    int32_t x, y;

    set_plane(1000, 0, 0);
    for (y = 20; y < 24; y++) {
        for (x = 18; x < 25; x++) {
            put_nearer(x, y, 800);
        }
    }
    find();
    check_nests();
    TEST_ASSERT_EQUAL_INT32(1, nests.nest_count);
    TEST_ASSERT_EQUAL_INT16(18 * 512, nests.nest[0].minimum.x_q9);
    TEST_ASSERT_EQUAL_INT16(20 * 512, nests.nest[0].minimum.y_q9);
}

/* A head on a body that leaves the grid below: behind the chin the contours are open and the head's
 * part is cut out of them. */
static void a_head_on_shoulders_is_cut_out(void)
{
    static const struct half_ellipsoid head = {23, 16, 6.5, 9, 850, 100};
    static const struct half_ellipsoid body = {23, 44, 19, 22, 870, 120};
    int32_t k, arcs = 0;

    set_plane(1400, 0, 0);
    put_ellipsoid(&body);
    put_ellipsoid(&head);
    find();
    check_nests();
    TEST_ASSERT_NOT_NULL(nest_at(head.x, head.y));
    for (k = 0; k < nest_at(head.x, head.y)->slice_count; k++) {
        const struct ih_slice *slice = &nest_at(head.x, head.y)->slice[k];

        arcs += !slice->whole;
        /* Within the head, or its outline with a part of the neck. */
        IH_TEST_WITHIN(1, head.x, ih_test_from_q(slice->ellipse.x_q16, 16), "x", k);
        IH_TEST_WITHIN(3, head.y, ih_test_from_q(slice->ellipse.y_q16, 16), "y", k);
        TEST_ASSERT_TRUE(slice->ellipse.area_q16 < (int64_t)(65536 * 1.3 * PI * head.a * head.b));
    }
    TEST_ASSERT_TRUE(arcs >= 2);
}

/* Ellipses of width x 11 steps that grow out of a minimum near their upper end, whole at 45 mm; behind
 * them, at 55 mm, a plate that begins in row top_row and leaves the grid on three sides. */
static void put_egg_on_plate(double width, double top_row)
{
    int32_t x, y;

    set_plane(2000, 0, 0);
    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            double t = 0;

            /* at t the ellipse's middle is 7 s below the minimum, its axes width s and 11 s */
            while (t < 46 &&
                   pow((x - 23) / width, 2) + pow((y - 13 - 7 * t / 45) / 11, 2) > pow(t / 45, 2)) {
                t += 0.125;
            }
            if (t < 46) {
                put_nearer(x, y, 850 + t);
            }
            /* a ramp of one step, so that the edge lies where it is wanted */
            if (y >= top_row - 1) {
                put_nearer(x, y, 910 - fmin(y - top_row, 1) * 5);
            }
        }
    }
}

/* The part of the level's contours that supports the nest best, mm^2; 0 when there is none. */
static double part_mm2(const struct ih_nest *nest, double level_mm)
{
    static struct ih_contours contours;
    static struct ih_arcs parts_of_contour;
    static struct ih_ellipse_scratch ellipse_scratch;
    struct ih_ellipse arc, best = {0};
    int32_t i, arcs = 0;

    ih_contours_level(&surface, (int32_t)lround(256 * level_mm), &contours);
    for (i = 0; i < contours.contour_count; i++) {
        if (ih_arcs_make(&contours, &contours.contour[i], &params.ellipse, &parts_of_contour) &&
            ih_ellipse_of_part(&parts_of_contour, nest->minimum, &params.ellipse, &ellipse_scratch,
                               &arc)) {
            best = arc;
            arcs++;
        }
    }
    TEST_ASSERT_TRUE(arcs <= 1); /* else it would have to be the better one */
    return ih_test_from_q(best.area_q16, 16) * step_mm(level_mm) * step_mm(level_mm);
}

/* At 60 mm the cut is the egg and the plate, and only the egg's upper end is elliptical: the less,
 * the higher the plate reaches. */
static void a_nest_that_shrinks_ends(void)
{
    double max_ended = 0, min_kept = 1;
    int i;

    params.blunt_mm2 = 0;
    params.ellipse.shape_max_q16 = 70779; /* 1.08: half an ellipse has 1.058 */
    for (i = 0; i < 25 * 32; i++) {
        const struct ih_nest *nest;
        double arc, proportion;

        put_egg_on_plate(6 + 0.05 * (i / 32), 22 + i % 32 / 16.0);
        find();
        check_nests();
        nest = nest_at(23, 13);
        TEST_ASSERT_NOT_NULL(nest);
        TEST_ASSERT_TRUE(nest->slice_count >= 5); /* 10 .. 50 mm, the egg alone */
        TEST_ASSERT_TRUE(nest->slice[4].whole);
        arc = part_mm2(nest, 910);
        proportion = arc / nest->slice[4].area_mm2;
        if (arc <= 0 || fabs(proportion - 0.6) < 0.0005) {
            continue; /* areas are rounded to whole mm^2 of 16,000 to 35,000 */
        }
        IH_TEST_EQUAL(proportion < 0.6, nest->slice_count == 5, "shrinks",
                      lround(1e4 * proportion));
        TEST_ASSERT_TRUE(proportion > 0.6 || nest->ended);
        if (proportion < 0.6) {
            max_ended = fmax(max_ended, proportion);
        } else {
            min_kept = fmin(min_kept, proportion);
        }
    }
    /* Both sides were there, and close by. */
    TEST_ASSERT_TRUE(max_ended > 0.59 && min_kept < 0.61);
}

/* A knob on a dish: where the cut reaches the dish its area jumps to fourteen times. Before end_depth
 * a nest may grow like that, later it ends. The knob is thin: the tip has tests of its own. */
static void put_knob_on_dish(double knob_mm)
{
    const struct half_ellipsoid knob = {23, 23, 4, 4.5, 850, knob_mm};
    int32_t x, y;

    set_plane(3000, 0, 0);
    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            put_nearer(x, y, 850 + knob_mm + 1 + 0.25 * hypot(x - 23, y - 23));
        }
    }
    put_ellipsoid(&knob);
}

static void a_jump_in_area_ends_a_nest_once_it_is_deep(void)
{
    const struct ih_nest *nest = &nests.nest[0];

    params.blunt_mm2 = 0;
    put_knob_on_dish(75);
    find();
    check_nests();
    TEST_ASSERT_EQUAL_INT32(1, nests.nest_count);
    TEST_ASSERT_EQUAL_INT32(7, nest->slice_count); /* 10 .. 70 mm */
    TEST_ASSERT_TRUE(nest->ended);
    put_knob_on_dish(45); /* the jump is at 50 mm, which is end_depth */
    find();
    TEST_ASSERT_EQUAL_INT32(50, params.end_depth_mm);
    TEST_ASSERT_EQUAL_INT32(4, nest->slice_count);
    TEST_ASSERT_TRUE(nest->ended);
    params.end_depth_mm = 51;
    find();
    TEST_ASSERT_TRUE(nest->slice_count >= 5);
    TEST_ASSERT_TRUE(nest->slice[4].ellipse.area_q16 > 8 * nest->slice[3].ellipse.area_q16);
}

static void a_nest_reaches_no_deeper_than_it_may(void)
{
    static const struct half_ellipsoid deep = {23, 23, 20, 20, 800, 600};

    set_plane(2000, 0, 0);
    put_ellipsoid(&deep);
    params.depth_max_mm = 85;
    find();
    check_nests();
    TEST_ASSERT_EQUAL_INT32(8, nests.nest[0].slice_count); /* 10 .. 80 mm */
    params.depth_max_mm = 100000;                          /* now the table is what ends it */
    params.levels_behind_mm = 300;
    find();
    TEST_ASSERT_EQUAL_INT32(IH_NESTS_SLICES_MAX, nests.nest[0].slice_count);
    params.levels_behind_mm = 30;
    find();
    TEST_ASSERT_EQUAL_INT32(3, nests.nest[0].slice_count);
}

/* 25 separate bumps, each at its own depth: the nearest 16 are followed. */
static void the_nearest_minima_are_kept(void)
{
    int32_t i;

    set_plane(2000, 0, 0);
    for (i = 0; i < 25; i++) {
        const int32_t order = i * 7 % 25;
        const struct half_ellipsoid bump = {
            4.0 + i % 5 * 9, 4.0 + (double)(i / 5) * 9, 3, 3, 800 + 9.0 * order, 100};

        put_ellipsoid(&bump);
    }
    find();
    check_nests();
    TEST_ASSERT_EQUAL_INT32(IH_NESTS_MAX, nests.nest_count);
    TEST_ASSERT_EQUAL_INT32(25 - IH_NESTS_MAX, nests.minima_dropped);
    for (i = 0; i < IH_NESTS_MAX; i++) {
        IH_TEST_EQUAL((800 + 9 * i) << 8, nests.nest[i].nearest_mm_q8, "nearest", i);
    }
}

static void a_minimum_at_the_border_is_none(void)
{
    static const struct half_ellipsoid cut_off = {0, 20, 6, 8, 800, 100};

    set_plane(1500, 0, 0);
    put_ellipsoid(&cut_off);
    find();
    TEST_ASSERT_EQUAL_INT32(0, nests.nest_count);
}

/* One step from it is. */
static void a_minimum_beside_the_border_is_one(void)
{
    static const int32_t place[][2] = {{1, 1}, {1, SIDE - 2}, {SIDE - 2, 1}, {SIDE - 2, SIDE - 2}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(place); i++) {
        set_plane(1500, 0, 0);
        put_nearer(place[i][0], place[i][1], 900);
        find();
        IH_TEST_EQUAL(1, nests.nest_count, "minima", i);
        IH_TEST_EQUAL(place[i][0] * 512, nests.nest[0].minimum.x_q9, "x", i);
        IH_TEST_EQUAL(place[i][1] * 512, nests.nest[0].minimum.y_q9, "y", i);
    }
}

/* Without a tip levels stand at tens of millimetres behind the front: the last is as deep as may be. */
static void the_last_slice_is_as_deep_as_it_may_be(void)
{
    static const struct half_ellipsoid deep = {23, 23, 20, 20, 800, 600};
    int32_t max;

    params.blunt_mm2 = 0;
    set_plane(2000, 0, 0);
    put_ellipsoid(&deep);
    for (max = 79; max <= 81; max++) {
        params.depth_max_mm = max;
        find();
        IH_TEST_EQUAL(max < 80 ? 7 : 8, nests.nest[0].slice_count, "slices", max);
        TEST_ASSERT_TRUE(nests.nest[0].ended);
    }
}

/* The nearest nest ends before the others begin: these have all their slices. */
static void a_nest_does_not_wait_for_nearer_ones(void)
{
    static const struct half_ellipsoid near = {12, 20, 6.5, 9, 800, 100};
    static const struct half_ellipsoid far = {34, 24, 7, 8, 1203, 110};

    set_plane(2000, 0, 0);
    put_ellipsoid(&near);
    put_ellipsoid(&far);
    params.levels_behind_mm = 1000;
    find();
    check_nests();
    TEST_ASSERT_EQUAL_INT32(2, nests.nest_count);
    check_slices(&nests.nest[0], &near, 4);
    check_slices(&nests.nest[1], &far, 4);
}

static void an_invalid_surface_has_no_hypotheses(void)
{
    int32_t level;
    static const struct half_ellipsoid head = {23, 23, 6.5, 9.5, 850, 98};

    set_plane(1200, 0, 0);
    put_ellipsoid(&head);
    surface.valid = false;
    find();
    TEST_ASSERT_EQUAL_INT32(0, nests.nest_count);
    TEST_ASSERT_EQUAL_INT32(0, nests.minima_dropped + nests.contours_dropped);
    TEST_ASSERT_FALSE(ih_nests_level(&surface, &params, 0, &level));
}

static void levels_go_back_from_the_nearest_node(void)
{
    int32_t index, level;

    set_plane(800, 1, 0);
    find();
    for (index = 0; index < 70; index++) {
        TEST_ASSERT_TRUE(ih_nests_level(&surface, &params, index, &level));
        TEST_ASSERT_EQUAL_INT32((800 + 10 * (index + 1)) << 8, level);
    }
    TEST_ASSERT_FALSE(ih_nests_level(&surface, &params, 70, &level));
    TEST_ASSERT_FALSE(ih_nests_level(&surface, &params, -1, &level));
}

/* Noise of any size: full tables, many minima, contours of all kinds. */
static void rough_surfaces_are_survived(void)
{
    struct ih_test_random random = {91};
    int32_t pass, i;

    for (pass = 0; pass < 20; pass++) {
        for (i = 0; i < SIDE * SIDE; i++) {
            surface.depth_mm_q8[i / SIDE][i % SIDE] =
                (1000 << 8) + (int32_t)ih_test_any_size(&random, 6 + pass % 12);
        }
        find();
        check_nests();
        TEST_ASSERT_TRUE(nests.minima_dropped > 0);
    }
}

/* What the surface can be at its worst: from before the camera's centre to 30 m behind it. */
static void extreme_depths_are_survived(void)
{
    static const struct half_ellipsoid head = {23, 23, 6.5, 9.5, -4000, 98};

    surface.field.unit_q28 = 1 << 26;
    set_plane(30000, 0, 0);
    put_ellipsoid(&head);
    find();
    IH_TEST_EQUAL(1, nests.nest_count, "nests", 0);
    ih_nests_params_default(&params);
    find();
    IH_TEST_EQUAL(1, nests.nest_count, "nests", 1);
}

/* Fewer nests: a minimum at (23, 23) with walls where they are wanted, 11.6 mm a step at 850 mm. */
static void put_minimum_between(int32_t left, int32_t right, int32_t above, double behind_mm)
{
    int32_t x, y;

    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            const bool falls = x <= 23 - left || x >= 23 + right || y <= 23 - above;

            surface.depth_mm_q8[y][x] =
                256 * 850 + 256 * (x == 23 && y == 23 ? 0 : 1) +
                (falls ? (int32_t)lround(256 * (behind_mm - 1)) : abs(x - 23) + y);
        }
    }
    find();
}

static int32_t nests_at_the_middle(void)
{
    return nest_at(23, 23) != NULL;
}

/* A step is 850 mm * 0.015 * 10 / 11 = 11.59 mm: 17 of them are less than 200 mm, 18 are more. */
static void a_minimum_must_be_free_on_three_sides(void)
{
    ih_nests_params_default(&params);
    TEST_ASSERT_EQUAL_INT32(200, params.free_mm);
    TEST_ASSERT_EQUAL_INT32(80, params.free_behind_mm);
    put_minimum_between(17, 17, 17, 80.1);
    TEST_ASSERT_EQUAL_INT32(1, nests_at_the_middle());
    put_minimum_between(18, 17, 17, 80.1);
    TEST_ASSERT_EQUAL_INT32(0, nests_at_the_middle());
    put_minimum_between(17, 18, 17, 80.1);
    TEST_ASSERT_EQUAL_INT32(0, nests_at_the_middle());
    put_minimum_between(17, 17, 18, 80.1);
    TEST_ASSERT_EQUAL_INT32(0, nests_at_the_middle());
    put_minimum_between(17, 17, 17, 80);
    TEST_ASSERT_EQUAL_INT32(0, nests_at_the_middle());
    params.free_mm = 0; /* then it may be anywhere */
    find();
    TEST_ASSERT_EQUAL_INT32(1, nests_at_the_middle());
    params.free_mm = 300; /* beyond the border, too, nothing is known to be in the way */
    put_minimum_between(24, 24, 24, 80);
    TEST_ASSERT_EQUAL_INT32(1, nests_at_the_middle());
    params.free_mm = 250;
    put_minimum_between(24, 24, 24, 80);
    TEST_ASSERT_EQUAL_INT32(0, nests_at_the_middle());
}

/* A cross that widens to a head: no contour of the cross is an ellipse, nor has it an elliptical part
 * around the minimum; its arms are so long that the tip is soon at the limit. */
static void put_cross_on_head(double arm, double half)
{
    const struct half_ellipsoid head = {23, 23, 19, 19, 880, 98};
    int32_t x, y;

    surface.field.unit_q28 = FINE_UNIT_Q28;
    set_plane(1250, 0, 0);
    put_ellipsoid(&head);
    for (y = 0; y < SIDE; y++) {
        for (x = 0; x < SIDE; x++) {
            const double dx = abs(x - 23), dy = abs(y - 23);
            const double low = fmin(dx, dy), high = fmax(dx, dy);

            if (high < 2 * arm) {
                put_nearer(x, y, 850 + 30 * fmax(low / half, high / arm));
            }
        }
    }
    find();
    check_nests();
}

/* With any shape the cross is a tip: 20 mm of it make no gap, and its area places the front. */
static void a_tip_may_have_any_shape(void)
{
    const struct ih_nest *nest;
    int32_t tip_mm2;

    params.gap_max = 1;
    put_cross_on_head(7, 2);
    TEST_ASSERT_NOT_NULL(nest_at(23, 23));
    TEST_ASSERT_EQUAL_INT32(0, nest_at(23, 23)->slice_count);
    params.is_tip_any = true;
    put_cross_on_head(7, 2);
    nest = nest_at(23, 23);
    TEST_ASSERT_NOT_NULL(nest);
    TEST_ASSERT_TRUE(nest->slice_count >= 4);
    TEST_ASSERT_EQUAL_INT32(880 << 8, nest->tip_level_mm_q8);
    tip_mm2 = nest->tip_area_mm2;
    IH_TEST_RANGE(params.blunt_mm2 / 2, params.blunt_mm2 - 1, tip_mm2, "area of the tip", 0);
    params.blunt_mm2 = tip_mm2; /* not smaller than that: no tip any more */
    put_cross_on_head(7, 2);
    TEST_ASSERT_TRUE(nest_at(23, 23)->tip_level_mm_q8 < 880 << 8);
}

/* Two bumps on one ellipsoid: once a cut goes round both it is one thing. */
static void nests_of_one_ellipse_are_merged(void)
{
    static const struct half_ellipsoid body = {23, 23, 9, 11, 850, 98};
    static const struct half_ellipsoid left = {19, 23, 3.5, 3.5, 842, 30};
    static const struct half_ellipsoid right = {27, 23, 3.5, 3.5, 838, 30};
    int32_t apart, i;

    set_plane(1250, 0, 0);
    put_ellipsoid(&body);
    put_ellipsoid(&left);
    put_ellipsoid(&right);
    find();
    TEST_ASSERT_EQUAL_INT32(3, nests.nest_count); /* the third is between them */
    for (i = 0; i < 3; i++) {
        IH_TEST_RANGE(5, IH_NESTS_SLICES_MAX, nests.nest[i].slice_count, "apart", i);
    }
    apart = nests.nest[0].slice_count;
    params.is_merging = true;
    find();
    check_nests();
    TEST_ASSERT_EQUAL_INT32(3, nests.nest_count);
    TEST_ASSERT_TRUE(nest_at(right.x, right.y) == &nests.nest[0]); /* the nearer */
    TEST_ASSERT_EQUAL_INT32(apart, nests.nest[0].slice_count);
    for (i = 1; i < 3; i++) {
        TEST_ASSERT_TRUE(nests.nest[i].ended);
        IH_TEST_EQUAL(0, nests.nest[i].slice_count, "merged", i);
    }
    /* what is side by side stays two */
    set_plane(1250, 0, 0);
    for (i = 0; i < 2; i++) {
        const struct half_ellipsoid one = {i == 0 ? 12 : 34, 23, 8, 9, 850, 98};

        put_ellipsoid(&one);
    }
    find();
    TEST_ASSERT_EQUAL_INT32(2, nests.nest_count);
    TEST_ASSERT_TRUE(nests.nest[0].slice_count >= 5);
    TEST_ASSERT_TRUE(nests.nest[1].slice_count >= 5);
}

/* All that holds for nests holds with everything left out that may be. */
static void rough_surfaces_are_survived_by_fewer_nests(void)
{
    struct ih_test_random random = {92};
    int32_t pass, i, found = 0;

    ih_nests_params_default(&params);
    for (pass = 0; pass < 40; pass++) {
        for (i = 0; i < SIDE * SIDE; i++) {
            const double x = i % SIDE - 23, y = i / SIDE - 23.0;

            surface.depth_mm_q8[i / SIDE][i % SIDE] =
                (int32_t)(256 * (1000 + (x * x + y * y) * (pass % 4) / 4)) +
                (int32_t)ih_test_any_size(&random, 6 + pass % 12);
        }
        find();
        check_nests();
        found += nests.nest_count;
    }
    TEST_ASSERT_GREATER_THAN(40, found);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(an_ellipsoid_before_a_wall_is_one_nest);
    RUN_TEST(the_tip_is_passed_over);
    RUN_TEST(without_a_limit_there_is_no_tip);
    RUN_TEST(a_tip_that_is_too_long_ends_the_nest);
    RUN_TEST(two_ellipsoids_are_two_nests);
    RUN_TEST(a_pit_supports_nothing);
    RUN_TEST(a_pit_in_a_bulge_is_no_slice);
    RUN_TEST(a_bump_in_a_crater_stands_on_its_own_contours);
    RUN_TEST(a_nest_bridges_as_many_levels_as_it_may);
    RUN_TEST(a_bridged_gap_is_forgotten);
    RUN_TEST(planes_have_no_minimum);
    RUN_TEST(a_flat_top_is_one_minimum);
    RUN_TEST(a_head_on_shoulders_is_cut_out);
    RUN_TEST(a_nest_that_shrinks_ends);
    RUN_TEST(a_jump_in_area_ends_a_nest_once_it_is_deep);
    RUN_TEST(a_nest_reaches_no_deeper_than_it_may);
    RUN_TEST(the_nearest_minima_are_kept);
    RUN_TEST(a_minimum_at_the_border_is_none);
    RUN_TEST(a_minimum_beside_the_border_is_one);
    RUN_TEST(the_last_slice_is_as_deep_as_it_may_be);
    RUN_TEST(a_nest_does_not_wait_for_nearer_ones);
    RUN_TEST(an_invalid_surface_has_no_hypotheses);
    RUN_TEST(levels_go_back_from_the_nearest_node);
    RUN_TEST(rough_surfaces_are_survived);
    RUN_TEST(extreme_depths_are_survived);
    RUN_TEST(a_minimum_must_be_free_on_three_sides);
    RUN_TEST(a_tip_may_have_any_shape);
    RUN_TEST(nests_of_one_ellipse_are_merged);
    RUN_TEST(rough_surfaces_are_survived_by_fewer_nests);
    return UNITY_END();
}
