/* ih_cloud: where points are drawn, against float64; and what becomes of those that are not. */
#include "base/ih_config.h"
#include "base/ih_types.h"
#include "points/ih_cloud.h"
#include "rig/ih_rig.h"

#include "ih_test.h"

struct vector_cloud_point {
    int rig;
    int32_t point_mm_q8[3];
    int column, row, depth_mm; /* column IH_NONE: it is not seen */
};

#include "cloud.inc"

#define PIXELS_MAX (640 * 480)

static const struct ih_calibration *const calibrations[] = {&vector_cloud_rig_0,
                                                            &vector_cloud_rig_1};
static struct ih_rig rig;
static struct ih_cloud cloud;
/* A guard behind the image. */
static uint16_t depth_mm[PIXELS_MAX + 32];

void setUp(void)
{
    memset(depth_mm, IH_TEST_FILL, sizeof depth_mm);
    memset(&cloud, IH_TEST_FILL, sizeof cloud);
}

void tearDown(void)
{
}

static void use_rig(int index)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, calibrations[index], &bad_slot));
}

static int32_t pixel_count(void)
{
    return rig.calibration.width * rig.calibration.height;
}

/* What holds for every list. */
static void draw(const int32_t (*point_mm_q8)[3], int32_t count, const char *what)
{
    int32_t i, drawn = 0;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_cloud_draw(point_mm_q8, count, &rig, depth_mm, &cloud));
    IH_TEST_EQUAL(count, cloud.drawn + cloud.hidden + cloud.near + cloud.far + cloud.outside, what,
                  0);
    for (i = 0; i < pixel_count(); i++) {
        drawn += depth_mm[i] != 0;
        if (depth_mm[i] != 0) {
            IH_TEST_RANGE(rig.calibration.near_mm, rig.calibration.far_mm, depth_mm[i], what, i);
        }
    }
    IH_TEST_EQUAL(drawn, cloud.drawn, what, 1);
    IH_TEST_UNTOUCHED(&depth_mm[pixel_count()],
                      sizeof depth_mm - (size_t)pixel_count() * sizeof depth_mm[0], what);
}

static void pixels_match_float64(void)
{
    int32_t i;

    for (i = 0; i < IH_TEST_COUNT(vector_cloud_points); i++) {
        const struct vector_cloud_point *v = &vector_cloud_points[i];

        use_rig(v->rig);
        setUp();
        draw(&v->point_mm_q8, 1, "one point");
        IH_TEST_EQUAL(v->column != IH_NONE, cloud.drawn, "drawn", i);
        if (v->column != IH_NONE) {
            IH_TEST_EQUAL(v->depth_mm, depth_mm[v->row * rig.calibration.width + v->column],
                          "depth", i);
        } else {
            const int32_t z_mm = v->point_mm_q8[2] / 256;

            IH_TEST_EQUAL(z_mm < rig.calibration.near_mm, cloud.near, "near", i);
            IH_TEST_EQUAL(z_mm >= rig.calibration.far_mm, cloud.far, "far", i);
        }
    }
}

static void the_nearest_wins_in_either_order(void)
{
    static const int32_t up[][3] = {{0, 0, 900 << 8}, {10, -10, 800 << 8}, {0, 0, 1000 << 8}};
    static const int32_t down[][3] = {{0, 0, 1000 << 8}, {10, -10, 800 << 8}, {0, 0, 800 << 8}};

    use_rig(1);
    draw(up, 3, "up");
    TEST_ASSERT_EQUAL_INT32(1, cloud.drawn);
    TEST_ASSERT_EQUAL_INT32(2, cloud.hidden);
    TEST_ASSERT_EQUAL_UINT16(800, depth_mm[98 * 320 + 163]);
    draw(down, 3, "down");
    TEST_ASSERT_EQUAL_INT32(1, cloud.drawn);
    TEST_ASSERT_EQUAL_UINT16(800, depth_mm[98 * 320 + 163]);
}

/* Half a pixel and half a millimetre beyond the last ones is the end. */
static void the_ends_of_the_image_and_the_range_are_met(void)
{
    static const struct {
        double u, v, z_mm;
        int32_t drawn;
    } end[] = {{0, 0, 1000, 1},        {-0.49, 0, 1000, 1},    {-0.51, 0, 1000, 0},
               {0, -0.49, 1000, 1},    {0, -0.51, 1000, 0},    {639.49, 479.49, 1000, 1},
               {639.51, 479, 1000, 0}, {639, 479.51, 1000, 0}, {300, 300, 399.6, 1},
               {300, 300, 399.4, 0},   {300, 300, 4000.4, 1},  {300, 300, 4000.6, 0}};
    int32_t i;

    use_rig(0);
    for (i = 0; i < IH_TEST_COUNT(end); i++) {
        const double x = (end[i].u - 319.5) / 525, y = (end[i].v - 239.5) / 525;
        const int32_t point[1][3] = {{(int32_t)lround(x * end[i].z_mm * 256),
                                      (int32_t)lround(y * end[i].z_mm * 256),
                                      (int32_t)lround(end[i].z_mm * 256)}};

        draw(point, 1, "end");
        IH_TEST_EQUAL(end[i].drawn, cloud.drawn, "end", i);
    }
}

static void no_points_make_an_empty_image(void)
{
    use_rig(0);
    draw(NULL, 0, "none");
    TEST_ASSERT_EQUAL_INT32(0, cloud.drawn);
}

/* Coordinates of all sizes and both signs, the largest there are among them. */
static void every_coordinate_is_survived(void)
{
    static const int32_t end[] = {INT32_MIN, INT32_MIN + 1, -1, 0, 1, 255, INT32_MAX};
    static int32_t point[20000][3];
    struct ih_test_random random = {5};
    int32_t i, axis;

    for (i = 0; i < IH_TEST_COUNT(point); i++) {
        for (axis = 0; axis < 3; axis++) {
            point[i][axis] = i < 343 ? end[(i / (axis == 0   ? 1
                                                 : axis == 1 ? 7
                                                             : 49)) %
                                           7]
                                     : (int32_t)ih_test_any_size(&random, 31);
        }
    }
    for (i = 0; i < IH_TEST_COUNT(calibrations); i++) {
        use_rig(i);
        setUp();
        draw((const int32_t(*)[3])point, IH_TEST_COUNT(point), "any size");
        TEST_ASSERT_TRUE(cloud.drawn > 0);
    }
}

static void a_dot_rig_is_refused(void)
{
    static const int32_t point[1][3] = {{0, 0, 1000 << 8}};

    use_rig(0);
    rig.calibration.kind = IH_RIG_DOTS;
    TEST_ASSERT_EQUAL_INT(IH_ERR_KIND, ih_cloud_draw(point, 1, &rig, depth_mm, &cloud));
    IH_TEST_UNTOUCHED(depth_mm, sizeof depth_mm, "image");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(pixels_match_float64);
    RUN_TEST(the_nearest_wins_in_either_order);
    RUN_TEST(the_ends_of_the_image_and_the_range_are_met);
    RUN_TEST(no_points_make_an_empty_image);
    RUN_TEST(every_coordinate_is_survived);
    RUN_TEST(a_dot_rig_is_refused);
    return UNITY_END();
}
