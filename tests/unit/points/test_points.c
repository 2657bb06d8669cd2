/* ih_points: triangulation against float64; range images by what must hold for every one. */
#include "base/ih_config.h"
#include "base/ih_types.h"
#include "labels/ih_labels.h"
#include "points/ih_points.h"
#include "points/ih_windows.h"
#include "rig/ih_rig.h"

#include "ih_test.h"
#include "rigs.inc"

struct vector_point {
    int rig, slot;
    int32_t t_px_q12;
    double depth_mm, x, y;
};

#include "points.inc"

#define PIXELS_MAX (IH_FRAME_WIDTH_MAX * IH_FRAME_HEIGHT_MAX)

static struct ih_calibration calibration;
static struct ih_rig rig;
static struct ih_labels labels;
static struct ih_points_params params;
static struct ih_points points;
static uint16_t depth_mm[PIXELS_MAX];
static struct ih_frame frame;
static struct ih_window window;

void setUp(void)
{
    int32_t slot;

    ih_points_params_default(&params);
    memset(&points, IH_TEST_FILL, sizeof points);
    memset(&labels, 0, sizeof labels);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        labels.dot_of_slot[slot] = IH_NONE;
    }
}

void tearDown(void)
{
}

static void use_dot_rig(int index)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[index], &bad_slot));
}

static void triangulation_matches_float64(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_points); i++) {
        const struct vector_point *v = &vector_points[i];
        const struct ih_calibration *c = &vector_rigs[v->rig];
        const double focal =
            ih_test_from_q(c->fx_px_q16 > c->fy_px_q16 ? c->fx_px_q16 : c->fy_px_q16, 16);
        const double length = v->depth_mm * v->t_px_q12 / 4096;
        /* The length is good to focal / 2^16 + 2 / 2^8 px mm (see test_rig); half a unit of Q8. */
        const double depth = v->depth_mm * (focal / 65536 + 2.0 / 256) / length + 0.5 / 256;
        const struct ih_point *point = &points.point[v->slot];

        use_dot_rig(v->rig);
        labels.dot_of_slot[v->slot] = 0;
        labels.t_px_q12[v->slot] = v->t_px_q12;
        ih_points_from_labels(&labels, &rig, &points);
        labels.dot_of_slot[v->slot] = IH_NONE;
        IH_TEST_EQUAL(IH_POINT_SEEN, point->state, "state", i);
        IH_TEST_EQUAL(1, points.seen_count, "seen", i);
        if (v->depth_mm < c->far_mm) { /* else limited: see below */
            IH_TEST_WITHIN(depth, v->depth_mm, ih_test_from_q(point->depth_mm_q8, 8), "depth", i);
        }
        /* Two roundings to Q12 of the place in pixels, and the direction's error times t. */
        IH_TEST_WITHIN((2.0 / 4096 + (focal / 65536 + 2.0 / 256) / v->depth_mm) / focal, v->x,
                       ih_test_from_q(point->x_q28, 28), "x", i);
        IH_TEST_WITHIN((2.0 / 4096 + (focal / 65536 + 2.0 / 256) / v->depth_mm) / focal, v->y,
                       ih_test_from_q(point->y_q28, 28), "y", i);
    }
}

/* The dot seen at a depth gives back that depth: rig and points are each other's inverse. */
static void depth_comes_back_through_the_rig(void)
{
    int k;
    int32_t slot;

    for (k = 0; k < IH_TEST_COUNT(vector_rigs); k++) {
        const int32_t middle = (vector_rigs[k].near_mm + vector_rigs[k].far_mm) / 2;

        use_dot_rig(k);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            labels.dot_of_slot[slot] = (int16_t)slot;
            labels.t_px_q12[slot] = (int32_t)lround(16.0 * rig.line[slot].length_px_mm_q8 / middle);
        }
        ih_points_from_labels(&labels, &rig, &points);
        IH_TEST_EQUAL(IH_SLOTS, points.seen_count, "seen", k);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            /* t is rounded to 1/8192 px. */
            IH_TEST_WITHIN(middle / 8192.0 / ih_test_from_q(labels.t_px_q12[slot], 12) + 1.0 / 256,
                           middle, ih_test_from_q(points.point[slot].depth_mm_q8, 8), "depth",
                           slot);
        }
    }
}

static void depth_beyond_the_range_is_limited(void)
{
    use_dot_rig(0);
    labels.dot_of_slot[7] = labels.dot_of_slot[9] = 1;
    labels.t_px_q12[7] = 1;
    labels.t_px_q12[9] = INT32_MAX;
    ih_points_from_labels(&labels, &rig, &points);
    TEST_ASSERT_EQUAL_INT32(vector_rigs[0].far_mm << 8, points.point[7].depth_mm_q8);
    TEST_ASSERT_EQUAL_INT32(1 << 8, points.point[9].depth_mm_q8); /* 1 mm */
}

static void missing_dots_stand_at_the_far_end(void)
{
    int32_t slot;

    use_dot_rig(1);
    ih_points_from_labels(&labels, &rig, &points);
    TEST_ASSERT_EQUAL_INT32(0, points.seen_count);
    TEST_ASSERT_EQUAL_MEMORY(&rig.field, &points.field, sizeof rig.field);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        int32_t x, y;

        ih_rig_dot_at(&rig, slot, rig.calibration.far_mm << 8, &x, &y);
        IH_TEST_EQUAL(IH_POINT_MISSING, points.point[slot].state, "state", slot);
        IH_TEST_EQUAL(0, points.point[slot].depth_mm_q8, "depth", slot);
        IH_TEST_EQUAL(x, points.point[slot].x_q28, "x", slot);
        IH_TEST_EQUAL(y, points.point[slot].y_q28, "y", slot);
    }
}

/* The camera looks down by 45 degrees: a ray below its own axis by a slope of 1/3 and more passes its feet, where nothing is
 * looked for and nothing is missed. */
static void rays_out_of_view_are_not_missed(void)
{
    const int32_t half_q30 = 759250125; /* sin and cos of 45 degrees */
    int32_t bad_slot, slot, unknown = 0;

    calibration = vector_rigs[0];
    calibration.up_q30[0] = 0;
    calibration.up_q30[1] = calibration.up_q30[2] = -half_q30;
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const double slope = 0.4 * (slot / IH_GRID - 9) / 9.0;

        calibration.ray_q30[slot][0] = 0;
        calibration.ray_q30[slot][1] = (int32_t)lround(slope / sqrt(1 + slope * slope) * (1 << 30));
        calibration.ray_q30[slot][2] = (int32_t)lround(1 / sqrt(1 + slope * slope) * (1 << 30));
    }
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &calibration, &bad_slot));
    for (slot = 0; slot < IH_SLOTS; slot++) {
        labels.dot_of_slot[slot] = IH_NONE;
    }
    ih_points_from_labels(&labels, &rig, &points);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const bool is_in_view = slot / IH_GRID - 9 < 9 / 0.4 / 3;

        IH_TEST_EQUAL(is_in_view ? IH_POINT_MISSING : IH_POINT_UNKNOWN, points.point[slot].state,
                      "state", slot);
        unknown += !is_in_view;
    }
    TEST_ASSERT_EQUAL_INT32(2 * IH_GRID, unknown);
}

/* A range camera without distortion; the image's diagonal is seen at about 75 degrees. */
static void use_range_rig(int32_t width, int32_t height)
{
    const int32_t focal = (width > height ? width : height) * 4 / 5;
    int32_t bad_slot;

    memset(&calibration, 0, sizeof calibration);
    calibration.kind = IH_RIG_RANGE;
    calibration.width = width;
    calibration.height = height;
    calibration.fx_px_q16 = calibration.fy_px_q16 = focal << 16;
    calibration.cx_px_q16 = (width - 1) << 15;
    calibration.cy_px_q16 = (height - 1) << 15;
    calibration.near_mm = 400;
    calibration.far_mm = 4000;
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &calibration, &bad_slot));
    frame = (struct ih_frame){depth_mm, width, height, width * 2, 2, 0};
    window = (struct ih_window){.depth_mm_q8 = 1000 << 8};
}

static void fill(uint16_t value)
{
    int32_t i;

    for (i = 0; i < frame.width * frame.height; i++) {
        depth_mm[i] = value;
    }
}

static void convert(void)
{
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_points_from_range(&frame, &rig, &params, &window, &points));
}

static double pixel_u(int32_t slot)
{
    return ih_test_from_q(points.point[slot].x_q28, 28) *
               ih_test_from_q(calibration.fx_px_q16, 16) +
           ih_test_from_q(calibration.cx_px_q16, 16);
}

static double pixel_v(int32_t slot)
{
    return ih_test_from_q(points.point[slot].y_q28, 28) *
               ih_test_from_q(calibration.fy_px_q16, 16) +
           ih_test_from_q(calibration.cy_px_q16, 16);
}

static bool in_frame(int32_t slot)
{
    return pixel_u(slot) >= 0 && pixel_v(slot) >= 0 && pixel_u(slot) <= frame.width - 1 &&
           pixel_v(slot) <= frame.height - 1;
}

/* A quarter pitch, and never less than a pixel. */
static double quarter_pitch_px(void)
{
    return fmax(1.0, floor(ih_test_from_q(points.field.unit_q28, 28) / 2 *
                               ih_test_from_q(calibration.fx_px_q16, 16) +
                           0.5));
}

/* What holds for every range image. */
static void check_points(const char *what)
{
    /* A pixel that is not the slot's own; the slot's own place is rounded to a pixel first. */
    const int64_t reach =
        (int64_t)((quarter_pitch_px() + 0.51) * 65536 * (1 << 28) / (double)calibration.fx_px_q16);
    int32_t slot, seen = 0;

    TEST_ASSERT_TRUE(points.field.unit_q28 > 0);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_point *point = &points.point[slot];
        const int64_t step = 2 * (int64_t)points.field.unit_q28;
        const int64_t x = points.field.centre_x_q28 + (slot % IH_GRID - 9) * step;
        const int64_t y = points.field.centre_y_q28 + (slot / IH_GRID - 9) * step;
        const bool is_seen = point->state == IH_POINT_SEEN;

        IH_TEST_RANGE(is_seen ? x - reach : x, is_seen ? x + reach : x, point->x_q28, what, slot);
        IH_TEST_RANGE(is_seen ? y - reach : y, is_seen ? y + reach : y, point->y_q28, what, slot);
        IH_TEST_EQUAL(is_seen, point->depth_mm_q8 != 0, what, slot);
        if (!in_frame(slot)) {
            IH_TEST_EQUAL(IH_POINT_UNKNOWN, point->state, what, slot);
        } else if (window.spacing_px == 0) {
            IH_TEST_RANGE(IH_POINT_MISSING, IH_POINT_SEEN, point->state, what, slot);
        }
        seen += is_seen;
    }
    IH_TEST_EQUAL(seen, points.seen_count, what, 0);
}

static void an_empty_range_image_has_no_points(void)
{
    use_range_rig(320, 240);
    fill(0);
    convert();
    check_points("empty");
    TEST_ASSERT_EQUAL_INT32(0, points.seen_count);
}

static void a_wall_is_seen_wherever_it_is_in_view(void)
{
    static const int32_t size[][2] = {{64, 64}, {320, 240}, {240, 320}, {1280, 800}, {64, 400}};
    int i;
    int32_t slot;

    for (i = 0; i < IH_TEST_COUNT(size); i++) {
        use_range_rig(size[i][0], size[i][1]);
        fill(1000);
        convert();
        check_points("wall");
        for (slot = 0; slot < IH_SLOTS; slot++) {
            if (in_frame(slot)) {
                IH_TEST_EQUAL(1000 << 8, points.point[slot].depth_mm_q8, "wall", slot);
            }
        }
        TEST_ASSERT_TRUE(points.seen_count > 0);
        IH_TEST_WITHIN(1e-6, 1.0,
                       2000.0 * ih_test_from_q(points.field.unit_q28, 28) * 256 /
                           params.pitch_mm_q8,
                       "pitch", i);
    }
}

/* Depth that tells its column, then its row: each point must come from the pixel it stands on. */
static void a_point_has_the_depth_of_its_pixel(void)
{
    int32_t i, slot, pass;

    for (pass = 0; pass < 2; pass++) {
        use_range_rig(640, 480);
        for (i = 0; i < 640 * 480; i++) {
            depth_mm[i] = (uint16_t)(1000 + (pass == 0 ? i % 640 : i / 640));
        }
        convert();
        check_points("ramp");
        TEST_ASSERT_TRUE(points.seen_count > 100);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            if (points.point[slot].state == IH_POINT_SEEN) {
                /* The nearest pixel: half a pixel, and the rounding of the place to Q12. */
                IH_TEST_WITHIN(0.501, pass == 0 ? pixel_u(slot) : pixel_v(slot),
                               points.point[slot].depth_mm_q8 / 256 - 1000, "ramp", slot);
            }
        }
    }
}

/* Every second pixel in both directions is a hole: the next one is at most 1 px away each way. */
static void small_holes_are_bridged(void)
{
    int32_t i, slot;

    use_range_rig(640, 480);
    for (i = 0; i < 640 * 480; i++) {
        depth_mm[i] = (uint16_t)(i % 2 == 0 && i / 640 % 2 == 0 ? 1000 + i % 640 : 0);
    }
    convert();
    check_points("holes");
    TEST_ASSERT_TRUE(points.seen_count > 100);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        if (in_frame(slot) && pixel_u(slot) < 638 && pixel_v(slot) < 478) {
            IH_TEST_EQUAL(IH_POINT_SEEN, points.point[slot].state, "bridged", slot);
            /* The place is that of the pixel. */
            IH_TEST_WITHIN(0.501, pixel_u(slot), points.point[slot].depth_mm_q8 / 256 - 1000,
                           "bridged", slot);
        }
    }
}

#define HOLE_SLOT (11 * IH_GRID + 13)

/* A hole of four pitches stays a hole. */
static void large_holes_stay_missing(void)
{
    int32_t slot, u, v, missing = 0;
    double hole_u, hole_v, half;

    use_range_rig(640, 480);
    fill(1000);
    convert();
    hole_u = pixel_u(HOLE_SLOT);
    hole_v = pixel_v(HOLE_SLOT);
    half = 2 * (pixel_u(HOLE_SLOT + 1) - hole_u);
    for (v = 0; v < 480; v++) {
        for (u = 0; u < 640; u++) {
            if (fabs(u - hole_u) < half && fabs(v - hole_v) < half) {
                depth_mm[v * 640 + u] = 0;
            }
        }
    }
    convert();
    check_points("hole");
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const double out = fmax(fabs(pixel_u(slot) - hole_u), fabs(pixel_v(slot) - hole_v)) - half;

        /* A quarter pitch and the rounding of both ends to whole pixels. */
        if (in_frame(slot) && out < -half / 8 - 2) {
            IH_TEST_EQUAL(IH_POINT_MISSING, points.point[slot].state, "hole", slot);
            missing++;
        } else if (in_frame(slot) && out > 1) {
            IH_TEST_EQUAL(IH_POINT_SEEN, points.point[slot].state, "beside the hole", slot);
        }
    }
    TEST_ASSERT_EQUAL_INT32(9, missing);
}

static void depths_out_of_range_are_no_measurement(void)
{
    static const uint16_t out_of_range[] = {1, 399, 4001, 65535};
    int i;

    for (i = 0; i < IH_TEST_COUNT(out_of_range); i++) {
        use_range_rig(320, 240);
        fill(out_of_range[i]);
        convert();
        check_points("out of range");
        IH_TEST_EQUAL(0, points.seen_count, "seen", out_of_range[i]);
    }
    fill(400);
    convert();
    TEST_ASSERT_TRUE(points.seen_count > 0);
    fill(4000);
    convert();
    TEST_ASSERT_TRUE(points.seen_count > 0);
}

/* With lower_q8 of one pitch the slot above the middle one stands where the window is. */
static void the_lattice_lies_where_the_window_is(void)
{
    static const int32_t middle = 9 * IH_GRID + 9;
    static const int32_t depths_mm[] = {400, 850, 4000};
    int i;

    use_range_rig(640, 480);
    fill(1000);
    for (i = 0; i < IH_TEST_COUNT(depths_mm); i++) {
        window = (struct ih_window){12345678, -23456789, depths_mm[i] << 8, 0, 0};
        convert();
        check_points("window");
        IH_TEST_EQUAL(params.lower_q8, 1 << 8, "lower", i);
        IH_TEST_RANGE(-1, 1, points.point[middle - IH_GRID].x_q28 - window.x_q28, "x", i);
        IH_TEST_RANGE(-1, 1, points.point[middle - IH_GRID].y_q28 - window.y_q28, "y", i);
        IH_TEST_WITHIN(
            2.0 / (1 << 28), params.pitch_mm_q8 / 256.0 / depths_mm[i],
            ih_test_from_q(points.point[middle + 1].x_q28 - (int64_t)points.point[middle].x_q28,
                           28),
            "pitch", i);
    }
}

/* A window at the image's edge, and one whose lattice would reach beyond every number: slots beyond
 * the edge are unknown, none wraps round. */
static void windows_at_the_ends_are_survived(void)
{
    static const int32_t far_out[] = {INT32_MIN, -(2 << 28), 0, 2 << 28, INT32_MAX};
    int i, k;

    use_range_rig(64, 64);
    fill(400);
    for (i = 0; i < IH_TEST_COUNT(far_out); i++) {
        for (k = 0; k < IH_TEST_COUNT(far_out); k++) {
            window = (struct ih_window){far_out[i], far_out[k], 100 << 8, 0, 0};
            convert();
            IH_TEST_RANGE(0, IH_SLOTS, points.seen_count, "seen", i);
            if (far_out[i] != 0 || far_out[k] != 0) {
                IH_TEST_EQUAL(
                    IH_POINT_UNKNOWN,
                    points.point[far_out[i] < 0 || far_out[k] < 0 ? 0 : IH_SLOTS - 1].state,
                    "beyond the edge", i * 5 + k);
            }
        }
    }
}

/* One measured pixel, so many pixels beside the place of the middle slot: at 10 px from dot to dot it
 * is the slot's own within 6, and up to 12 it tells that a surface there might not have been seen. */
static void a_rare_pixel_is_seen_or_leaves_unknown(void)
{
    int32_t off, v;

    use_range_rig(640, 480);
    window.spacing_px = 10;
    fill(0);
    convert();
    v = (int32_t)rint(ih_test_from_q(points.field.centre_y_q28, 28) * 512 + 239.5);
    for (off = -15; off <= 15; off++) {
        const int32_t away = off < 0 ? -off : off;

        fill(0);
        depth_mm[v * 640 + 320 + off] = 1000;
        convert();
        IH_TEST_EQUAL(away <= 6    ? IH_POINT_SEEN
                      : away <= 12 ? IH_POINT_UNKNOWN
                                   : IH_POINT_MISSING,
                      points.point[IH_SLOTS / 2].state, "state", off);
    }
}

/* The same off in both directions: seen within a circle, known within a square. */
static void a_rare_pixel_may_be_on_a_diagonal(void)
{
    static const struct {
        int32_t du, dv;
        enum ih_point_state state;
    } cases[] = {
        {4, 4, IH_POINT_SEEN},       {-4, 4, IH_POINT_SEEN},      {3, -5, IH_POINT_SEEN},
        {-5, -3, IH_POINT_SEEN},     {5, 4, IH_POINT_UNKNOWN},    {-4, 5, IH_POINT_UNKNOWN},
        {6, 1, IH_POINT_UNKNOWN},    {-1, -6, IH_POINT_UNKNOWN},  {12, 12, IH_POINT_UNKNOWN},
        {-12, 12, IH_POINT_UNKNOWN}, {12, -13, IH_POINT_MISSING}, {13, 12, IH_POINT_MISSING}};
    int32_t v;
    int i;

    use_range_rig(640, 480);
    window.spacing_px = 10;
    fill(0);
    convert();
    v = (int32_t)rint(ih_test_from_q(points.field.centre_y_q28, 28) * 512 + 239.5);
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        fill(0);
        depth_mm[(v + cases[i].dv) * 640 + 320 + cases[i].du] = 1000;
        convert();
        IH_TEST_EQUAL(cases[i].state, points.point[IH_SLOTS / 2].state, "state", i);
    }
}

/* Only every tenth pixel of every tenth row is measured; the pitch is 13.3 px. A slot takes one
 * within half of that, and where none is near it is not known that there is nothing, unless no
 * pixel lies within 12.5 px. */
static void rare_points_leave_slots_unknown(void)
{
    int32_t i, slot, count[3] = {0, 0, 0};

    use_range_rig(640, 480);
    window.spacing_px = 10;
    fill(0);
    for (i = 0; i < 640 * 480; i++) {
        const int32_t u = i % 640, v = i / 640;

        if (u % 10 == 0 && v % 10 == 0 && u < 400) {
            depth_mm[i] = (uint16_t)(1000 + u);
        }
    }
    convert();
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const int64_t step = 2 * (int64_t)points.field.unit_q28;
        const double u =
            rint(ih_test_from_q(points.field.centre_x_q28 + (slot % IH_GRID - 9) * step, 28) * 512 +
                 319.5);
        const double v =
            rint(ih_test_from_q(points.field.centre_y_q28 + (slot / IH_GRID - 9) * step, 28) * 512 +
                 239.5);
        const double found_u = fmin(390, 10 * rint(u / 10)), found_v = 10 * rint(v / 10);
        const double away = hypot(found_u - u, found_v - v);
        const double square = fmax(fabs(found_u - u), fabs(found_v - v));
        const enum ih_point_state state = away <= 6      ? IH_POINT_SEEN
                                          : square <= 12 ? IH_POINT_UNKNOWN
                                                         : IH_POINT_MISSING;

        IH_TEST_EQUAL(state, points.point[slot].state, "state", slot);
        count[state]++;
        if (state == IH_POINT_SEEN && fabs(found_u - u) != 5 && fabs(found_v - v) != 5) {
            IH_TEST_EQUAL(1000 + (int32_t)found_u, points.point[slot].depth_mm_q8 / 256, "depth",
                          slot);
            IH_TEST_WITHIN(away > 0 ? 0.001 : 0.501, found_u, pixel_u(slot), "u", slot);
            IH_TEST_WITHIN(away > 0 ? 0.001 : 0.501, found_v, pixel_v(slot), "v", slot);
        }
    }
    TEST_ASSERT_TRUE(count[0] > 5 && count[1] > 5 && count[2] > 5);
}

static void the_stride_is_followed(void)
{
    static struct ih_points tight;
    int32_t i;

    use_range_rig(320, 240);
    for (i = 0; i < 320 * 240; i++) {
        depth_mm[i] = (uint16_t)(700 + i % 320 + i / 320);
    }
    convert();
    tight = points;
    for (i = 239; i >= 0; i--) {
        memmove(&depth_mm[i * 400], &depth_mm[i * 320], 640);
        memset(&depth_mm[i * 400 + 320], 0x02, 160); /* 514 mm: nearer than all */
    }
    frame.stride_bytes = 800;
    convert();
    TEST_ASSERT_EQUAL_MEMORY(tight.point, points.point, sizeof tight.point);
}

static void the_wrong_kind_is_refused(void)
{
    use_range_rig(320, 240);
    frame.bytes_per_sample = 1;
    frame.stride_bytes = 320;
    TEST_ASSERT_EQUAL_INT(IH_ERR_KIND,
                          ih_points_from_range(&frame, &rig, &params, &window, &points));
    use_range_rig(320, 240);
    use_dot_rig(0);
    TEST_ASSERT_EQUAL_INT(IH_ERR_KIND,
                          ih_points_from_range(&frame, &rig, &params, &window, &points));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(triangulation_matches_float64);
    RUN_TEST(depth_comes_back_through_the_rig);
    RUN_TEST(depth_beyond_the_range_is_limited);
    RUN_TEST(missing_dots_stand_at_the_far_end);
    RUN_TEST(rays_out_of_view_are_not_missed);
    RUN_TEST(an_empty_range_image_has_no_points);
    RUN_TEST(a_wall_is_seen_wherever_it_is_in_view);
    RUN_TEST(a_point_has_the_depth_of_its_pixel);
    RUN_TEST(small_holes_are_bridged);
    RUN_TEST(large_holes_stay_missing);
    RUN_TEST(depths_out_of_range_are_no_measurement);
    RUN_TEST(the_lattice_lies_where_the_window_is);
    RUN_TEST(windows_at_the_ends_are_survived);
    RUN_TEST(rare_points_leave_slots_unknown);
    RUN_TEST(a_rare_pixel_is_seen_or_leaves_unknown);
    RUN_TEST(a_rare_pixel_may_be_on_a_diagonal);
    RUN_TEST(the_stride_is_followed);
    RUN_TEST(the_wrong_kind_is_refused);
    return UNITY_END();
}
