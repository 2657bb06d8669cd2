/* ih_undistort against ih_camera_undistort for each dot: whatever the lens, wherever the dot, however many. */
#include "base/ih_types.h"
#include "dots/ih_dots.h"
#include "labels/ih_undistort.h"
#include "rig/ih_camera.h"
#include "rig/ih_rig.h"

#include "ih_test.h"
#include "rigs.inc"

#define RIG_COUNT IH_TEST_COUNT(vector_rigs)

static struct ih_rig rig;
static struct ih_calibration calibration;
static struct ih_dots dots;
static int32_t u_px_q12[IH_DOTS_MAX], v_px_q12[IH_DOTS_MAX];
static struct ih_test_random random_source;

void setUp(void)
{
    random_source.state = 20;
}

void tearDown(void)
{
}

static int32_t between(int64_t low, int64_t high)
{
    return (int32_t)ih_test_between(&random_source, low, high);
}

/* Some on whole pixels, some at the corners. */
static void put_dots(int32_t count)
{
    const int32_t right = (rig.calibration.width - 1) * 4096;
    const int32_t bottom = (rig.calibration.height - 1) * 4096;
    int32_t i;

    dots.dot_count = count;
    for (i = 0; i < count; i++) {
        const int32_t kind = between(0, 7);
        struct ih_dot *dot = &dots.dot[i];

        *dot = (struct ih_dot){between(0, right), between(0, bottom), 1};
        if (kind == 0) {
            *dot = (struct ih_dot){dot->u_px_q12 & ~4095, dot->v_px_q12 & ~4095, 1};
        } else if (kind == 1) {
            *dot = (struct ih_dot){between(0, 1) * right, between(0, 1) * bottom, 1};
        }
    }
}

static void check_dots(const char *what, int index)
{
    int32_t i;

    memset(u_px_q12, IH_TEST_FILL, sizeof u_px_q12);
    memset(v_px_q12, IH_TEST_FILL, sizeof v_px_q12);
    ih_undistort_dots(&dots, &rig, u_px_q12, v_px_q12);
    for (i = 0; i < dots.dot_count; i++) {
        int32_t x, y, u, v;

        ih_camera_undistort(&rig, dots.dot[i].u_px_q12, dots.dot[i].v_px_q12, &x, &y);
        ih_camera_pixel(&rig, x, y, &u, &v);
        IH_TEST_EQUAL(u, u_px_q12[i], what, index);
        IH_TEST_EQUAL(v, v_px_q12[i], what, index);
    }
}

static bool use(int index)
{
    int32_t bad_slot;

    return ih_rig_init(&rig, &calibration, &bad_slot) == IH_OK && index >= 0;
}

static void rigs_of_all_kinds(void)
{
    int i, pass;

    for (i = 0; i < RIG_COUNT; i++) {
        calibration = vector_rigs[i];
        TEST_ASSERT_TRUE(use(i));
        for (pass = 0; pass < 20; pass++) {
            put_dots(IH_DOTS_MAX);
            check_dots("rig", i);
        }
    }
}

/* What is beyond a number that is not a multiple of anything stays as it was. */
static void any_number_of_dots(void)
{
    int32_t count, filler;

    memset(&filler, IH_TEST_FILL, sizeof filler);
    calibration = vector_rigs[0];
    TEST_ASSERT_TRUE(use(0));
    for (count = 0; count < 20; count++) {
        put_dots(count);
        check_dots("count", count);
        IH_TEST_EQUAL(filler, u_px_q12[count], "u beyond", count);
        IH_TEST_EQUAL(filler, v_px_q12[count], "v beyond", count);
    }
}

/* Coefficients from mild to what folds the picture, principal points beside the frame, wide fields. */
static void lenses_of_any_strength(void)
{
    int pass, used = 0;

    for (pass = 0; pass < 600; pass++) {
        const int64_t max = (int64_t)1 << (14 + pass % 12);

        calibration = vector_rigs[2];
        calibration.kind = IH_RIG_RANGE;
        calibration.near_mm = 400;
        calibration.far_mm = 8000;
        calibration.width = between(320, 1280);
        calibration.height = between(240, 800);
        calibration.fx_px_q16 = between(300 << 16, pass % 3 == 0 ? 8192 << 16 : 1200 << 16);
        calibration.fy_px_q16 = calibration.fx_px_q16 + between(-65536, 65536);
        calibration.cx_px_q16 =
            between(pass % 4 == 0 ? -300 * 65536 : 0, calibration.width * 65536);
        calibration.cy_px_q16 = between(0, calibration.height * 65536);
        calibration.k1_q24 = between(-max, max);
        calibration.k2_q24 = between(-max, max);
        calibration.k3_q24 = between(-max, max);
        calibration.p1_q24 = between(-max / 8, max / 8);
        calibration.p2_q24 = between(-max / 8, max / 8);
        if (use(pass)) {
            put_dots(200);
            check_dots("lens", pass);
            used++;
        }
    }
    IH_TEST_RANGE(250, 599, used, "lenses that come back", 0);
}

/* Halves of the division by the focal length, and places at 45 degrees from the axis, where vectors end. */
static void quotients_are_rounded_as_everywhere(void)
{
    int32_t focal, i;

    for (focal = 0; focal < 40; focal++) {
        calibration = vector_rigs[2];
        calibration.kind = IH_RIG_RANGE;
        calibration.near_mm = 400;
        calibration.far_mm = 8000;
        calibration.width = 1280;
        calibration.height = 800;
        calibration.fx_px_q16 = calibration.fy_px_q16 =
            focal < 20 ? (400 << 16) + focal - 10 : 1 << (25 + focal % 5);
        calibration.cx_px_q16 = (640 << 16) + focal % 2 * 9; /* over 2^29 in Q16: a half */
        calibration.cy_px_q16 = 400 << 16;
        calibration.k1_q24 = calibration.k2_q24 = calibration.k3_q24 = 0;
        calibration.p1_q24 = calibration.p2_q24 = 0;
        TEST_ASSERT_TRUE(use(focal));
        put_dots(IH_DOTS_MAX);
        for (i = 0; i < 400; i++) {
            dots.dot[i].u_px_q12 = (640 + (i % 2 == 0 ? 400 : -400)) * 4096 + between(-40, 40);
        }
        check_dots("focal", focal);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(rigs_of_all_kinds);
    RUN_TEST(any_number_of_dots);
    RUN_TEST(lenses_of_any_strength);
    RUN_TEST(quotients_are_rounded_as_everywhere);
    return UNITY_END();
}
