/* ih_hypotheses on nests made by hand: every test alone, order, merging, and places in closed form. */
#include "base/ih_types.h"
#include "nests/ih_contours.h"
#include "nests/ih_ellipse.h"
#include "nests/ih_hypotheses.h"
#include "nests/ih_nests.h"
#include "rig/ih_camera.h"
#include "rig/ih_rig.h"
#include "surface/ih_samples.h"
#include "surface/ih_surface.h"

#include "ih_test.h"
#include "rigs.inc"

#define SIDE IH_SURFACE_GRID
#define PI 3.14159265358979323846
#define UNIT_Q28 4026532 /* 0.015 */
#define PLAIN_RIG 2      /* of vector_rigs: a lens without distortion */

static struct ih_rig rig;
static struct ih_surface surface;
static struct ih_nests nests;
static struct ih_samples samples;
static struct ih_hypotheses_params params;
static struct ih_hypotheses hypotheses;

static void use_rig(int index)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[index], &bad_slot));
}

void setUp(void)
{
    int32_t i;

    use_rig(PLAIN_RIG);
    memset(&surface, 0, sizeof surface);
    memset(&nests, 0, sizeof nests);
    memset(&samples, 0, sizeof samples);
    memset(&hypotheses, IH_TEST_FILL, sizeof hypotheses);
    ih_hypotheses_params_default(&params);
    params.points_min = 0; /* the outline has tests of its own */
    surface.valid = true;
    surface.field = (struct ih_field){1 << 20, -(1 << 21), UNIT_Q28};
    for (i = 0; i < SIDE * SIDE; i++) {
        surface.depth_mm_q8[i / SIDE][i % SIDE] = 900 << 8;
    }
}

void tearDown(void)
{
}

/* An ellipse on the grid: middle and semi-axes in steps, a towards angle_deg. */
static struct ih_ellipse make_ellipse(double x, double y, double a, double b, double angle_deg)
{
    const double c = cos(angle_deg * PI / 180), s = sin(angle_deg * PI / 180);
    struct ih_ellipse out = {0};

    out.area_q16 = (int32_t)lround(ldexp(PI * a * b, 16));
    out.x_q16 = (int32_t)lround(ldexp(x, 16));
    out.y_q16 = (int32_t)lround(ldexp(y, 16));
    out.xx_q16 = (int32_t)lround(ldexp((a * a * c * c + b * b * s * s) / 4, 16));
    out.xy_q16 = (int32_t)lround(ldexp((a * a - b * b) * c * s / 4, 16));
    out.yy_q16 = (int32_t)lround(ldexp((a * a * s * s + b * b * c * c) / 4, 16));
    out.shape_q16 = 65536;
    out.ratio_q16 = (int32_t)lround(ldexp(a > b ? a / b : b / a, 16));
    return out;
}

/* A nest of slices every 10 mm down to depth_mm whose area grows by growth mm^2 per mm. Its tip
 * stands out by TIP_MM: nothing in here may count from there. */
#define TIP_MM 37
static struct ih_nest *add_nest(double x, double y, double front_mm, int depth_mm, double growth)
{
    struct ih_nest *nest = &nests.nest[nests.nest_count++];
    int t;

    nest->front_mm_q8 = (int32_t)lround(256 * front_mm);
    nest->nearest_mm_q8 = nest->front_mm_q8 - (TIP_MM << 8);
    nest->minimum = (struct ih_vertex){(int16_t)(x * 512), (int16_t)(y * 512)};
    for (t = 10; t <= depth_mm; t += 10) {
        struct ih_slice *slice = &nest->slice[nest->slice_count++];

        slice->ellipse = make_ellipse(x, y, 5 + t / 50.0, 5 + t / 50.0, 0);
        slice->behind_mm_q8 = t << 8;
        slice->area_mm2 = (int32_t)lround(growth * t);
        slice->whole = true;
    }
    return nest;
}

static struct ih_nest *add_head(double x, double y, double front_mm)
{
    return add_nest(x, y, front_mm, 110, 250); /* 27,500 mm^2 at 110 mm */
}

static void select_heads(void)
{
    ih_hypotheses_select(&nests, &surface, &samples, &rig, &params, &hypotheses);
    IH_TEST_RANGE(0, nests.nest_count, hypotheses.hypothesis_count, "hypotheses", 0);
    IH_TEST_RANGE(0, hypotheses.hypothesis_count, hypotheses.head_count, "heads", 0);
}

static void expect_alone(int32_t rejected, const char *what)
{
    select_heads();
    IH_TEST_EQUAL(1, hypotheses.hypothesis_count, what, 0);
    IH_TEST_EQUAL(rejected, hypotheses.hypothesis[0].rejected, what, 1);
    IH_TEST_EQUAL(rejected == IH_ACCEPTED, hypotheses.head_count, what, 2);
    nests.nest_count = 0;
    memset(&nests, 0, sizeof nests);
}

static void a_good_head_is_accepted(void)
{
    add_head(20, 22, 850);
    select_heads();
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.hypothesis_count);
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.head_count);
    TEST_ASSERT_EQUAL_INT32(0, hypotheses.head[0]);
    TEST_ASSERT_EQUAL_INT32(IH_ACCEPTED, hypotheses.hypothesis[0].rejected);
    TEST_ASSERT_EQUAL_INT32(27500, hypotheses.hypothesis[0].area_mm2);
    TEST_ASSERT_EQUAL_INT32(250 << 8, hypotheses.hypothesis[0].curvature_mm_q8);
    TEST_ASSERT_EQUAL_INT32(110 << 8, hypotheses.hypothesis[0].extent_mm_q8);
}

static void areas_have_their_limits(void)
{
    static const int32_t place = 5; /* the widest slice need not be the last */
    const int32_t area[] = {params.area_min_mm2 - 1, params.area_min_mm2, params.area_max_mm2,
                            params.area_max_mm2 + 1};
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(area); i++) {
        struct ih_nest *nest = add_head(20, 22, 850);

        params.curvature_min_mm = 0;
        params.curvature_max_mm = 100000;
        for (k = 0; k < nest->slice_count; k++) {
            nest->slice[k].area_mm2 = k == place ? area[i] : 100 * k;
        }
        expect_alone(i == 1 || i == 2 ? IH_ACCEPTED : IH_REJECT_AREA, "area");
    }
}

/* A straight line A = k t has the curvature k exactly. */
static void curvatures_have_their_limits(void)
{
    const double growth[] = {params.curvature_min_mm - 1, params.curvature_min_mm,
                             params.curvature_max_mm, params.curvature_max_mm + 1};
    int i;

    params.area_min_mm2 = 0;
    params.area_max_mm2 = 1000000;
    for (i = 0; i < IH_TEST_COUNT(growth); i++) {
        add_nest(20, 22, 850, 110, growth[i]);
        expect_alone(i == 1 || i == 2 ? IH_ACCEPTED : IH_REJECT_CURVATURE, "curvature");
    }
}

static void curvature_is_fitted_to_the_first_70_mm(void)
{
    struct ih_nest *nest = add_head(20, 22, 850);
    double at = 0, tt = 0;
    int k;

    for (k = 0; k < nest->slice_count; k++) {
        const double t = nest->slice[k].behind_mm_q8 / 256.0;

        nest->slice[k].area_mm2 = (int32_t)lround(40000 * (1 - (1 - t / 110) * (1 - t / 110)));
        at += t <= 70 ? nest->slice[k].area_mm2 * t : 0;
        tt += t <= 70 ? t * t : 0;
    }
    nest->slice[8].area_mm2 = 55000; /* behind 70 mm: no influence */
    select_heads();
    IH_TEST_WITHIN(1.0 / 256, at / tt, ih_test_from_q(hypotheses.hypothesis[0].curvature_mm_q8, 8),
                   "curvature", 0);
}

static void the_extent_has_its_limit(void)
{
    params.extent_min_mm = 80;
    add_nest(20, 22, 850, 80, 250);
    expect_alone(IH_ACCEPTED, "80 mm");
    add_nest(20, 22, 850, 70, 250);
    expect_alone(IH_REJECT_CURVATURE, "70 mm");
}

/* The same moments for all slices from first on; xx a power of two, so that the limit is exact. */
static void set_moments(struct ih_nest *nest, int first, int32_t xx_q16, int32_t yy_q16)
{
    int k;

    for (k = first; k < nest->slice_count; k++) {
        nest->slice[k].ellipse.xx_q16 = xx_q16;
        nest->slice[k].ellipse.yy_q16 = yy_q16;
    }
}

static void proportions_have_their_limit(void)
{
    const int64_t limit = params.upright_min_q16;
    int off;

    for (off = -2; off <= 2; off++) {
        set_moments(add_head(20, 22, 850), 0, 8 << 16, (int32_t)(8 * (limit + off)));
        select_heads();
        IH_TEST_EQUAL(limit + off, hypotheses.hypothesis[0].upright_q16, "upright", off);
        expect_alone(off >= 0 ? IH_ACCEPTED : IH_REJECT_SHAPE, "limit");
    }
}

/* Slice number k lies 10 (k + 1) mm behind the front: 0 and 1 are the nose's. */
static void proportions_are_those_of_the_deeper_slices(void)
{
    struct ih_nest *nest = add_head(20, 22, 850);

    set_moments(nest, 0, 100 << 16, 1 << 16);
    set_moments(nest, 2, 8 << 16, 9 << 16);
    expect_alone(IH_ACCEPTED, "lying up to 20 mm");
    nest = add_head(20, 22, 850);
    set_moments(nest, 0, 1 << 16, 100 << 16);
    set_moments(nest, 2, 9 << 16, 8 << 16);
    expect_alone(IH_REJECT_SHAPE, "standing up to 20 mm");
    nest = add_head(20, 22, 850);
    set_moments(nest, 0, 8 << 16, 9 << 16);
    nest->slice[2].ellipse.xx_q16 = 100 << 16; /* 9 * 9 over 8 * 8 + 100 */
    expect_alone(IH_REJECT_SHAPE, "30 mm counts");
}

/* With nothing as deep as 30 mm the last slice is what there is. */
static void proportions_of_a_shallow_nest_are_its_last_slices(void)
{
    int pass;

    params.extent_min_mm = 0;
    params.area_min_mm2 = 0;
    for (pass = 0; pass < 2; pass++) {
        struct ih_nest *nest = add_nest(20, 22, 850, 20, 250);

        set_moments(nest, 0, 1 << 16, pass == 0 ? 100 << 16 : 1 << 14);
        set_moments(nest, 1, 8 << 16, pass == 0 ? 4 << 16 : 16 << 16);
        select_heads();
        IH_TEST_EQUAL(pass == 0 ? 32768 : 131072, hypotheses.hypothesis[0].upright_q16, "last",
                      pass);
        expect_alone(pass == 0 ? IH_REJECT_SHAPE : IH_ACCEPTED, "shallow");
    }
}

/* Wide slices count most: sums are divided, not quotients averaged. */
static void proportions_are_sums_over_sums(void)
{
    struct ih_nest *nest = add_head(20, 22, 850);
    double vertical = 0, horizontal = 0;
    int k;

    for (k = 0; k < nest->slice_count; k++) {
        const double a = 2 + k, b = k < 6 ? 3 * a : 0.8 * a;

        nest->slice[k].ellipse = make_ellipse(20, 22, a, b, 0);
        vertical += k < 2 ? 0 : b * b;
        horizontal += k < 2 ? 0 : a * a;
    }
    select_heads();
    /* Moments are rounded to 2^-16 of at least 4, and the quotient to Q16: two units of about 2. */
    IH_TEST_WITHIN(4.0 / 65536, vertical / horizontal,
                   ih_test_from_q(hypotheses.hypothesis[0].upright_q16, 16), "sums", 0);
}

/* A rotated ellipse is as tall as yy is, as wide as xx. */
static void long_heads_stand_upright(void)
{
    const double limit = ih_test_from_q(params.upright_min_q16, 16);
    int angle_deg, k;

    for (angle_deg = 0; angle_deg < 180; angle_deg++) {
        const double c = cos(angle_deg * PI / 180), s = sin(angle_deg * PI / 180);
        const double upright = (81 * s * s + 36 * c * c) / (81 * c * c + 36 * s * s);
        struct ih_nest *nest = add_head(20, 22, 850);

        for (k = 0; k < nest->slice_count; k++) {
            nest->slice[k].ellipse = make_ellipse(20, 22, 9, 6, angle_deg);
        }
        select_heads();
        /* Moments of at least 9 rounded to 2^-16, and the quotient of up to 2.25: one unit each. */
        IH_TEST_WITHIN(2.0 / 65536, upright,
                       ih_test_from_q(hypotheses.hypothesis[0].upright_q16, 16), "upright",
                       angle_deg);
        expect_alone(upright >= limit ? IH_ACCEPTED : IH_REJECT_SHAPE, "long");
    }
}

/* The first test that fails is reported: area before curvature before shape before outline. */
static void the_first_failed_test_is_reported(void)
{
    ih_hypotheses_params_default(&params); /* there are no samples: the outline always fails */
    set_moments(add_nest(20, 22, 850, 60, 1000), 0, 2 << 16, 1 << 16);
    expect_alone(IH_REJECT_AREA, "area first");
    set_moments(add_nest(20, 22, 850, 60, 250), 0, 2 << 16, 1 << 16);
    expect_alone(IH_REJECT_CURVATURE, "then curvature");
    set_moments(add_head(20, 22, 850), 0, 2 << 16, 1 << 16);
    expect_alone(IH_REJECT_SHAPE, "then shape");
    add_head(20, 22, 850);
    expect_alone(IH_REJECT_OUTLINE, "outline last");
    TEST_ASSERT_EQUAL_STRING("area", ih_reject_text(IH_REJECT_AREA));
    TEST_ASSERT_EQUAL_STRING("curvature", ih_reject_text(IH_REJECT_CURVATURE));
    TEST_ASSERT_EQUAL_STRING("shape", ih_reject_text(IH_REJECT_SHAPE));
    TEST_ASSERT_EQUAL_STRING("outline", ih_reject_text(IH_REJECT_OUTLINE));
    TEST_ASSERT_EQUAL_STRING("score", ih_reject_text(IH_REJECT_SCORE));
    TEST_ASSERT_NULL(ih_reject_text(IH_ACCEPTED));
}

/* Normalised coordinate of a place on the grid. */
static double normalised(double steps, int32_t centre_q28)
{
    return ih_test_from_q(centre_q28, 28) + (steps - 23) * ih_test_from_q(UNIT_Q28, 28) *
                                                IH_SURFACE_STEP_NUMERATOR /
                                                IH_SURFACE_STEP_DENOMINATOR;
}

static void places_match_the_closed_form(void)
{
    static const double at[][3] = {{23, 23, 850}, {3.25, 40.5, 500}, {44, 2, 2200}, {10, 10, 120}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(at); i++) {
        const struct ih_calibration *c = &rig.calibration;
        const struct ih_hypothesis *h = &hypotheses.hypothesis[0];
        const double x = normalised(at[i][0], surface.field.centre_x_q28);
        const double y = normalised(at[i][1], surface.field.centre_y_q28);
        const double depth = at[i][2] + params.centre_behind_mm;

        nests.nest_count = 0;
        memset(&nests.nest[0], 0, sizeof nests.nest[0]);
        add_head(at[i][0], at[i][1], at[i][2]);
        select_heads();
        /* Two units of Q8; of Q12 for pixels. */
        IH_TEST_WITHIN(2.0 / 256, x * depth, ih_test_from_q(h->centre_mm_q8[0], 8), "X", i);
        IH_TEST_WITHIN(2.0 / 256, y * depth, ih_test_from_q(h->centre_mm_q8[1], 8), "Y", i);
        IH_TEST_WITHIN(2.0 / 256, depth, ih_test_from_q(h->centre_mm_q8[2], 8), "Z", i);
        IH_TEST_WITHIN(2.0 / 4096, x * c->fx_px_q16 / 65536 + c->cx_px_q16 / 65536.0,
                       ih_test_from_q(h->u_px_q12, 12), "u", i);
        IH_TEST_WITHIN(2.0 / 4096, y * c->fy_px_q16 / 65536 + c->cy_px_q16 / 65536.0,
                       ih_test_from_q(h->v_px_q12, 12), "v", i);
        /* The surface is flat at 900 mm here. */
        IH_TEST_WITHIN(2.0 / 256, 900 * sqrt(1 + x * x + y * y),
                       ih_test_from_q(h->distance_mm_q8, 8), "distance", i);
    }
}

/* With a lens the centre in pixels is the distorted one. */
static void the_pixel_is_the_frames_own(void)
{
    double x, y;
    int32_t u, v;

    use_rig(3);
    add_head(5, 40, 850);
    select_heads();
    x = normalised(5, surface.field.centre_x_q28);
    y = normalised(40, surface.field.centre_y_q28);
    ih_camera_distort(&rig, (int32_t)lround(ldexp(x, 28)), (int32_t)lround(ldexp(y, 28)), &u, &v);
    IH_TEST_RANGE(u - 2, u + 2, hypotheses.hypothesis[0].u_px_q12, "u", 0);
    IH_TEST_RANGE(v - 2, v + 2, hypotheses.hypothesis[0].v_px_q12, "v", 0);
}

/* Between the nodes the surface's depth is bilinear; beyond the grid it is that of its border. */
static void the_distance_is_read_off_the_surface(void)
{
    int32_t i;
    double x, y;

    for (i = 0; i < SIDE * SIDE; i++) {
        surface.depth_mm_q8[i / SIDE][i % SIDE] = (700 + 3 * (i % SIDE) + 5 * (i / SIDE)) << 8;
    }
    add_head(12.3, 31.8, 700);
    select_heads();
    x = normalised(12.3, surface.field.centre_x_q28);
    y = normalised(31.8, surface.field.centre_y_q28);
    IH_TEST_WITHIN(2.0 / 256, (700 + 3 * 12.3 + 5 * 31.8) * sqrt(1 + x * x + y * y),
                   ih_test_from_q(hypotheses.hypothesis[0].distance_mm_q8, 8), "distance", 0);
}

/* The nose is not the middle of a head: where there are deeper slices, those count, by area. */
static void the_middle_is_that_of_the_deeper_slices(void)
{
    struct ih_nest *nest = add_head(20, 22, 850);
    const struct ih_calibration *c = &rig.calibration;
    double x, weight = 0, sum = 0;
    int k;

    for (k = 0; k < nest->slice_count; k++) {
        const double middle = k < 2 ? 30 : 20 + 0.2 * k;
        const double size = 4 + 0.5 * k;

        nest->slice[k].ellipse = make_ellipse(middle, 22, size, size, 0);
        sum += k < 2 ? 0 : middle * size * size;
        weight += k < 2 ? 0 : size * size;
    }
    select_heads();
    x = normalised(sum / weight, surface.field.centre_x_q28);
    /* Each of the two slices nearer than 30 mm may weigh up to a 256th of a step's area: 30 units of 2^16.
     */
    IH_TEST_WITHIN(0.02, x * c->fx_px_q16 / 65536 + c->cx_px_q16 / 65536.0,
                   ih_test_from_q(hypotheses.hypothesis[0].u_px_q12, 12), "u", 0);
}

/* Semi-axes and direction in pixels, which are not square: by the eigenvalues in double. */
static void pixel_ellipses_match_the_closed_form(void)
{
    const double step =
        ih_test_from_q(UNIT_Q28, 28) * IH_SURFACE_STEP_NUMERATOR / IH_SURFACE_STEP_DENOMINATOR;
    int pass;

    for (pass = 0; pass < 360; pass++) {
        const struct ih_hypothesis *h = &hypotheses.hypothesis[0];
        const double fx = rig.calibration.fx_px_q16 / 65536.0 * step;
        const double fy = rig.calibration.fy_px_q16 / 65536.0 * step;
        const double c = cos(pass * PI / 360), s = sin(pass * PI / 360);
        const double a = 9.5, b = 6.25;
        const double uu = fx * fx * (a * a * c * c + b * b * s * s);
        const double uv = fx * fy * (a * a - b * b) * c * s;
        const double vv = fy * fy * (a * a * s * s + b * b * c * c);
        const double root = hypot((uu - vv) / 2, uv);
        double angle = atan2(2 * uv, uu - vv) * 90 / PI;
        struct ih_nest *nest;

        nests.nest_count = 0;
        memset(&nests.nest[0], 0, sizeof nests.nest[0]);
        nest = add_head(20, 22, 850);
        nest->slice[nest->slice_count - 1].ellipse = make_ellipse(20, 22, a, b, pass / 2.0);
        select_heads();
        /* Covariances are good to 2^-16 step^2 of 10 to 20, times 16 px^2 a step^2, and rounded
         * twice more; a root halves that: 2e-5 of 40 px. The step in Q12 px adds 3e-5. */
        IH_TEST_WITHIN(0.005, sqrt((uu + vv) / 2 + root), ih_test_from_q(h->a_px_q12, 12), "a",
                       pass);
        IH_TEST_WITHIN(0.005, sqrt((uu + vv) / 2 - root), ih_test_from_q(h->b_px_q12, 12), "b",
                       pass);
        IH_TEST_RANGE(0, 179999, h->angle_mdeg, "angle's range", pass);
        angle -= h->angle_mdeg / 1000.0;
        /* 2 mdeg of atan2 halved; the covariance's error over the difference of axes: 5 mdeg. */
        IH_TEST_WITHIN(0.006, 0, remainder(angle, 180), "angle", pass);
        TEST_ASSERT_TRUE(h->a_px_q12 >= h->b_px_q12);
    }
}

/* An ellipse without width lies along a diagonal: no rounding makes its short axis anything but
 * nothing, and its long one is twice the root of both variances' sum. */
static void an_ellipse_without_width_is_a_line(void)
{
    int32_t variance;
    int sign;

    for (variance = 1 << 12; variance < 1 << 24; variance = variance * 3 / 2) {
        for (sign = -1; sign <= 1; sign += 2) {
            struct ih_nest *nest = add_head(20, 22, 850);
            struct ih_ellipse *last = &nest->slice[nest->slice_count - 1].ellipse;
            const struct ih_hypothesis *h = &hypotheses.hypothesis[0];
            const double step =
                ldexp(UNIT_Q28, -28) * IH_SURFACE_STEP_NUMERATOR / IH_SURFACE_STEP_DENOMINATOR;
            const double wide = step * rig.calibration.fx_px_q16 / 65536;
            const double high = step * rig.calibration.fy_px_q16 / 65536;
            const double long_px = 2 * hypot(wide, high) * sqrt(ldexp(variance, -16));
            const double angle_deg = atan2(high, wide) * 180 / PI;

            last->xx_q16 = last->yy_q16 = variance;
            last->xy_q16 = sign * variance;
            select_heads();
            /* Roundings of three and a half units of a variance in Q16, before the root. */
            IH_TEST_WITHIN(2 * sqrt(3.5 / 65536), 0, ih_test_from_q(h->b_px_q12, 12), "b",
                           variance);
            IH_TEST_WITHIN(0.001 * long_px + 0.01, long_px, ih_test_from_q(h->a_px_q12, 12), "a",
                           variance);
            IH_TEST_WITHIN(0.02, sign > 0 ? angle_deg : 180 - angle_deg, h->angle_mdeg / 1000.0,
                           "angle", variance);
            memset(&nests, 0, sizeof nests);
        }
    }
}

/* Nothing up to 70 mm behind the front has no curvature, and nothing at the front itself has. */
static void without_slices_in_reach_the_curvature_is_nothing(void)
{
    int pass, k;

    for (pass = 0; pass < 2; pass++) {
        struct ih_nest *nest = add_head(20, 22, 850);

        for (k = 0; k < nest->slice_count; k++) {
            nest->slice[k].behind_mm_q8 = pass == 0 ? (71 + k) << 8 : 0;
        }
        select_heads();
        IH_TEST_EQUAL(0, hypotheses.hypothesis[0].curvature_mm_q8, "curvature", pass);
        memset(&nests, 0, sizeof nests);
    }
}

/* The outline: a head at (23, 23) whose last ellipse is a circle. */
#define RADIUS (5 + 110 / 50.0)
#define BEHIND_MM (850 + 110 + params.jump_mm)

enum sector { ABOVE = -90, BESIDE = 0, BELOW = 90 };

/* A sample at so many times the radius. The weight says nothing: it is the wrong way round. */
static void put_sample(double radius, double direction_deg, double depth_mm, bool seen)
{
    struct ih_sample *sample = &samples.sample[samples.sample_count++];
    const double angle = direction_deg * PI / 180;
    const double per_step = 10.0 / 11;

    sample->x_q16 = (int32_t)lround(ldexp(RADIUS * radius * cos(angle) * per_step, 16));
    sample->y_q16 = (int32_t)lround(ldexp(RADIUS * radius * sin(angle) * per_step, 16));
    sample->depth_mm_q8 = (int32_t)lround(256 * depth_mm);
    sample->root_weight_q15 = seen ? 17948 : 32768;
    sample->is_filled = !seen;
}

/* Samples in a bundle of 20 degrees. */
static void put_samples(int32_t count, double radius, int direction_deg, double depth_mm, bool seen)
{
    int32_t i;

    for (i = 0; i < count; i++) {
        put_sample(radius, direction_deg - 10 + 20 * (i + 0.5) / count, depth_mm, seen);
    }
}

/* So many of a hundred above and beside lie behind, so many below do not. */
static void expect_outline(int32_t inside, int32_t above, int32_t beside, int32_t below,
                           int32_t rejected, const char *what)
{
    const double far_mm = BEHIND_MM + 50, near_mm = BEHIND_MM - 50;
    const struct ih_outline *o = &hypotheses.hypothesis[0].outline;

    ih_hypotheses_params_default(&params);
    memset(&nests, 0, sizeof nests);
    samples.sample_count = 0;
    add_head(23, 23, 850);
    put_samples(inside, 0.5, ABOVE, 900, true);
    put_samples(above, 1.5, ABOVE, far_mm, true);
    put_samples(100 - above, 1.4, ABOVE, near_mm, true);
    put_samples(beside, 1.5, BESIDE, far_mm, true);
    put_samples(100 - beside, 1.4, BESIDE + 180, near_mm, true);
    put_samples(100 - below, 1.5, BELOW, far_mm, true);
    put_samples(below, 1.4, BELOW, near_mm, true);
    select_heads();
    IH_TEST_EQUAL(inside, o->inside, what, 1);
    IH_TEST_EQUAL(100, o->above, what, 2);
    IH_TEST_EQUAL(above, o->above_behind, what, 3);
    IH_TEST_EQUAL(100, o->beside, what, 4);
    IH_TEST_EQUAL(beside, o->beside_behind, what, 5);
    IH_TEST_EQUAL(100, o->below, what, 6);
    IH_TEST_EQUAL(below, o->below_near, what, 7);
    IH_TEST_EQUAL(rejected, hypotheses.hypothesis[0].rejected, what, 0);
    IH_TEST_EQUAL(rejected == IH_ACCEPTED, hypotheses.head_count, what, 8);
}

static void a_head_stands_out_from_what_is_round_it(void)
{
    struct ih_hypotheses_params min;

    ih_hypotheses_params_default(&min);
    expect_outline(30, 100, 100, 100, IH_ACCEPTED, "a clear case");
    expect_outline(min.points_min, min.above_min_percent, min.beside_min_percent,
                   min.below_min_percent, IH_ACCEPTED, "all at their limits");
}

static void each_part_of_the_outline_rejects_alone(void)
{
    struct ih_hypotheses_params min;

    ih_hypotheses_params_default(&min);
    expect_outline(min.points_min, 100, 100, 100, IH_ACCEPTED, "just enough points");
    expect_outline(min.points_min - 1, 100, 100, 100, IH_REJECT_OUTLINE, "too few points");
    expect_outline(30, min.above_min_percent, 100, 100, IH_ACCEPTED, "above, just");
    expect_outline(30, min.above_min_percent - 1, 100, 100, IH_REJECT_OUTLINE, "above");
    expect_outline(30, 100, min.beside_min_percent, 100, IH_ACCEPTED, "beside, just");
    expect_outline(30, 100, min.beside_min_percent - 1, 100, IH_REJECT_OUTLINE, "beside");
    expect_outline(30, 100, 100, min.below_min_percent, IH_ACCEPTED, "below, just");
    expect_outline(30, 100, 100, min.below_min_percent - 1, IH_REJECT_OUTLINE, "below");
}

/* A head at the pattern's edge has nothing on that side: that is no reason against it. */
static void an_empty_side_rejects_nothing(void)
{
    ih_hypotheses_params_default(&params);
    add_head(23, 23, 850);
    put_samples(params.points_min, 0.5, ABOVE, 900, true);
    expect_alone(IH_ACCEPTED, "nothing around");
}

/* Above is steeper than one in two, below steeper than one in one; all round, degree by degree. */
static void the_sides_have_their_borders(void)
{
    int degree;

    for (degree = 0; degree < 360; degree++) {
        const struct ih_outline *o = &hypotheses.hypothesis[0].outline;
        const double dx = cos(degree * PI / 180), dy = sin(degree * PI / 180);
        const bool above = 2 * dy<-fabs(dx), below = dy> fabs(dx);

        if (fabs(dy - fabs(dx)) < 0.01) {
            continue; /* on the border itself rounding decides */
        }
        memset(&nests, 0, sizeof nests);
        samples.sample_count = 0;
        add_head(23, 23, 850);
        put_sample(1.5, degree, 900, true);
        select_heads();
        IH_TEST_EQUAL(above, o->above, "above", degree);
        IH_TEST_EQUAL(below, o->below, "below", degree);
        IH_TEST_EQUAL(!above && !below, o->beside, "beside", degree);
    }
}

static void what_was_not_seen_lies_behind(void)
{
    add_head(23, 23, 850);
    put_samples(5, 1.5, ABOVE, 860, false);
    put_samples(5, 1.5, BELOW, 860, false);
    put_samples(5, 0.5, BELOW, 860, false);
    select_heads();
    TEST_ASSERT_EQUAL_INT32(5, hypotheses.hypothesis[0].outline.above_behind);
    TEST_ASSERT_EQUAL_INT32(5, hypotheses.hypothesis[0].outline.below);
    TEST_ASSERT_EQUAL_INT32(0, hypotheses.hypothesis[0].outline.below_near);
    TEST_ASSERT_EQUAL_INT32(0, hypotheses.hypothesis[0].outline.inside);
}

/* The ring is 1.2 to 1.9 times the ellipse; its squared sizes are kept in sixteenths. */
static void only_the_ring_is_looked_at(void)
{
    const struct ih_outline *o = &hypotheses.hypothesis[0].outline;

    add_head(23, 23, 850);
    put_samples(3, 0.9, ABOVE, 900, true);
    put_samples(3, 1.15, ABOVE, 900, true);
    put_samples(3, 1.25, ABOVE, 900, true);
    put_samples(3, 1.85, ABOVE, 900, true);
    put_samples(3, 1.95, ABOVE, 900, true);
    put_samples(3, 3.0, ABOVE, 900, true);
    select_heads();
    TEST_ASSERT_EQUAL_INT32(3, o->inside);
    TEST_ASSERT_EQUAL_INT32(6, o->above);
    TEST_ASSERT_EQUAL_INT32(0, o->above_behind + o->beside + o->below);
}

static void behind_begins_beyond_the_jump(void)
{
    add_head(23, 23, 850);
    put_samples(1, 1.5, ABOVE, BEHIND_MM, true);
    put_samples(1, 1.5, ABOVE, BEHIND_MM + 1.0 / 256, true);
    select_heads();
    TEST_ASSERT_EQUAL_INT32(2, hypotheses.hypothesis[0].outline.above);
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.hypothesis[0].outline.above_behind);
}

/* The ring follows the ellipse: twice as high as wide, what is one step beside it is in the ring
 * and what is one step above it is not. */
static void the_ring_follows_a_rotated_ellipse(void)
{
    const double long_axis = 10, short_axis = 5;
    int angle_deg;

    for (angle_deg = 0; angle_deg < 180; angle_deg += 15) {
        const double c = cos(angle_deg * PI / 180), s = sin(angle_deg * PI / 180);
        struct ih_nest *nest;
        int i;

        memset(&nests, 0, sizeof nests);
        samples.sample_count = 4;
        nest = add_head(23, 23, 850);
        nest->slice[nest->slice_count - 1].ellipse =
            make_ellipse(23, 23, long_axis, short_axis, angle_deg);
        for (i = 0; i < 4; i++) {
            const double along = i < 2 ? (i == 0 ? 1.15 : 1.25) * long_axis : 0;
            const double across = i < 2 ? 0 : (i == 2 ? 1.15 : 1.25) * short_axis;

            samples.sample[i].x_q16 =
                (int32_t)lround(ldexp((along * c - across * s) * 10 / 11, 16));
            samples.sample[i].y_q16 =
                (int32_t)lround(ldexp((along * s + across * c) * 10 / 11, 16));
            samples.sample[i].depth_mm_q8 = 900 << 8;
            samples.sample[i].root_weight_q15 = 32768;
        }
        select_heads();
        IH_TEST_EQUAL(2,
                      hypotheses.hypothesis[0].outline.above +
                          hypotheses.hypothesis[0].outline.beside +
                          hypotheses.hypothesis[0].outline.below,
                      "in the ring", angle_deg);
    }
}

static void nothing_gives_nothing(void)
{
    select_heads();
    TEST_ASSERT_EQUAL_INT32(0, hypotheses.hypothesis_count);
    TEST_ASSERT_EQUAL_INT32(0, hypotheses.head_count);
    nests.nest_count = 3; /* minima that nothing supports */
    select_heads();
    TEST_ASSERT_EQUAL_INT32(0, hypotheses.hypothesis_count);
}

/* Accepted before rejected, then by extent, then the nearer. */
static void the_best_comes_first(void)
{
    add_nest(5, 5, 700, 110, 20);   /* rejected: area */
    add_nest(40, 5, 800, 90, 250);  /* accepted */
    add_nest(5, 40, 900, 110, 250); /* accepted, the largest extent */
    add_nest(40, 40, 950, 90, 250); /* accepted, as deep as the second but farther */
    add_nest(23, 23, 990, 40, 250); /* rejected: area */
    select_heads();
    TEST_ASSERT_EQUAL_INT32(5, hypotheses.hypothesis_count);
    TEST_ASSERT_EQUAL_INT32(2, hypotheses.hypothesis[0].nest);
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.hypothesis[1].nest);
    TEST_ASSERT_EQUAL_INT32(3, hypotheses.hypothesis[2].nest);
    TEST_ASSERT_EQUAL_INT32(0, hypotheses.hypothesis[3].nest);
    TEST_ASSERT_EQUAL_INT32(4, hypotheses.hypothesis[4].nest);
    TEST_ASSERT_EQUAL_INT32(3, hypotheses.head_count);
    TEST_ASSERT_EQUAL_INT32(0, hypotheses.head[0]);
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.head[1]);
    TEST_ASSERT_EQUAL_INT32(2, hypotheses.head[2]);
}

/* Distances of centres just below and above merge_mm, along Z where they are simplest. */
static void centres_closer_than_merge_mm_are_one(void)
{
    add_nest(23, 23, 800, 100, 250);
    add_nest(23, 23, 800 + params.merge_mm - 0.01, 110, 250);
    select_heads();
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.hypothesis_count);
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.head_count);
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.hypothesis[0].nest); /* the deeper one is the better */
    memset(&nests, 0, sizeof nests);
    surface.field.centre_x_q28 = surface.field.centre_y_q28 = 0; /* on the axis: only Z differs */
    add_nest(23, 23, 800, 100, 250);
    add_nest(23, 23, 800 + params.merge_mm, 110, 250);
    select_heads();
    TEST_ASSERT_EQUAL_INT32(2, hypotheses.hypothesis_count);
}

/* An accepted one is better than a rejected one that is deeper. */
static void a_rejected_one_does_not_swallow_an_accepted_one(void)
{
    add_nest(23, 23, 800, 130, 100000);
    add_nest(24, 23, 805, 90, 250);
    select_heads();
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.hypothesis_count);
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.head_count);
    TEST_ASSERT_EQUAL_INT32(1, hypotheses.hypothesis[0].nest);
}

static void a_full_table_of_nests_is_judged(void)
{
    int i;

    for (i = 0; i < IH_NESTS_MAX; i++) {
        add_head(3 + 13.0 * (i % 4), 3 + 13.0 * (double)(i / 4), 800 + i);
    }
    select_heads();
    TEST_ASSERT_EQUAL_INT32(IH_NESTS_MAX, hypotheses.hypothesis_count);
    TEST_ASSERT_EQUAL_INT32(IH_NESTS_MAX, hypotheses.head_count);
}

/* A level may happen to lie a 256th of a millimetre behind a minimum. */
static void a_slice_at_the_minimum_is_survived(void)
{
    int32_t t;

    for (t = 1; t <= 4; t++) {
        struct ih_nest *nest = add_nest(20, 22, 850, 10, 250);

        nest->slice[0].behind_mm_q8 = t;
        nest->slice[0].area_mm2 = 20000;
        select_heads();
        TEST_ASSERT_EQUAL_INT32(1, hypotheses.hypothesis_count);
        TEST_ASSERT_EQUAL_INT32(IH_REJECT_CURVATURE, hypotheses.hypothesis[0].rejected);
        memset(&nests, 0, sizeof nests);
    }
}

static void the_ends_of_all_ranges_are_survived(void)
{
    struct ih_nest *nest = add_nest(46, 46, 16000, 130, 100000);

    nest->slice[5].area_mm2 = INT32_MAX;
    nest->slice[12].ellipse = make_ellipse(46, 46, 46, 46, 0);
    add_nest(0, 0, -3000, 130, 0)->slice[12].ellipse = make_ellipse(0, 0, 30, 0.02, 45);
    surface.field = (struct ih_field){INT32_MAX / 2, INT32_MIN / 2, 1 << 26};
    surface.depth_mm_q8[0][0] = surface.depth_mm_q8[SIDE - 1][SIDE - 1] = 1 << 23;
    samples.sample_count = 2;
    samples.sample[0] = (struct ih_sample){
        .x_q16 = -2621439, .y_q16 = -2621439, .depth_mm_q8 = 1, .root_weight_q15 = 32768};
    samples.sample[1] = (struct ih_sample){.x_q16 = 2621439,
                                           .y_q16 = 2621439,
                                           .depth_mm_q8 = 16000 << 8,
                                           .root_weight_q15 = 1,
                                           .slot = 1,
                                           .is_filled = true};
    select_heads();
    TEST_ASSERT_EQUAL_INT32(2, hypotheses.hypothesis_count);
    TEST_ASSERT_EQUAL_INT32(0, hypotheses.head_count);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_good_head_is_accepted);
    RUN_TEST(areas_have_their_limits);
    RUN_TEST(curvatures_have_their_limits);
    RUN_TEST(curvature_is_fitted_to_the_first_70_mm);
    RUN_TEST(the_extent_has_its_limit);
    RUN_TEST(proportions_have_their_limit);
    RUN_TEST(proportions_are_those_of_the_deeper_slices);
    RUN_TEST(proportions_of_a_shallow_nest_are_its_last_slices);
    RUN_TEST(proportions_are_sums_over_sums);
    RUN_TEST(long_heads_stand_upright);
    RUN_TEST(the_first_failed_test_is_reported);
    RUN_TEST(places_match_the_closed_form);
    RUN_TEST(the_pixel_is_the_frames_own);
    RUN_TEST(the_distance_is_read_off_the_surface);
    RUN_TEST(the_middle_is_that_of_the_deeper_slices);
    RUN_TEST(pixel_ellipses_match_the_closed_form);
    RUN_TEST(an_ellipse_without_width_is_a_line);
    RUN_TEST(without_slices_in_reach_the_curvature_is_nothing);
    RUN_TEST(a_head_stands_out_from_what_is_round_it);
    RUN_TEST(each_part_of_the_outline_rejects_alone);
    RUN_TEST(an_empty_side_rejects_nothing);
    RUN_TEST(the_sides_have_their_borders);
    RUN_TEST(what_was_not_seen_lies_behind);
    RUN_TEST(only_the_ring_is_looked_at);
    RUN_TEST(behind_begins_beyond_the_jump);
    RUN_TEST(the_ring_follows_a_rotated_ellipse);
    RUN_TEST(nothing_gives_nothing);
    RUN_TEST(the_best_comes_first);
    RUN_TEST(centres_closer_than_merge_mm_are_one);
    RUN_TEST(a_rejected_one_does_not_swallow_an_accepted_one);
    RUN_TEST(a_full_table_of_nests_is_judged);
    RUN_TEST(the_ends_of_all_ranges_are_survived);
    RUN_TEST(a_slice_at_the_minimum_is_survived);
    return UNITY_END();
}
