/* ih_level against a float64 reference by Euler angles, and what a rotation is whatever the angles. */
#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "base/ih_types.h"
#include "rig/ih_level.h"
#include "rig/ih_rig.h"

#include "ih_test.h"
#include "rigs.inc"

struct vector_mount {
    int32_t rig, up_q30[3];
    double rows[9], origin_mm[3];
};

struct vector_rotated {
    int32_t mount, x_q28, y_q28;
    bool is_seen;
    double x, y, depth;
};

struct vector_level_dot {
    int32_t mount, slot, depth_mm_q8;
    double slope_x, slope_y, x, y, u_px, v_px;
};

struct vector_level_ellipse {
    int32_t mount;
    double centre_mm[3], axes_mm[3], a_px, b_px, angle_deg;
};

#include "level.inc"

static struct ih_rig rig;
static struct ih_calibration calibration;

void setUp(void)
{
    calibration = vector_rigs[0];
}

void tearDown(void)
{
}

static enum ih_err init(int32_t x_q30, int32_t y_q30, int32_t z_q30)
{
    int32_t bad_slot = 0;
    enum ih_err err;

    calibration.up_q30[0] = x_q30;
    calibration.up_q30[1] = y_q30;
    calibration.up_q30[2] = z_q30;
    err = ih_rig_init(&rig, &calibration, &bad_slot);
    TEST_ASSERT_EQUAL_INT32(IH_NONE, bad_slot);
    TEST_ASSERT_TRUE(err != IH_OK ||
                     memcmp(&calibration, &rig.calibration, sizeof calibration) == 0);
    return err;
}

static void use_mount(int index)
{
    const struct vector_mount *mount = &vector_mounts[index];

    calibration = vector_rigs[mount->rig];
    IH_TEST_EQUAL(IH_OK, init(mount->up_q30[0], mount->up_q30[1], mount->up_q30[2]), "mount",
                  index);
    TEST_ASSERT_FALSE(rig.is_level);
}

static void rotations_match_float64(void)
{
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(vector_mounts); i++) {
        const struct vector_mount *mount = &vector_mounts[i];

        use_mount(i);
        for (k = 0; k < 9; k++) {
            IH_TEST_WITHIN(ldexp(1, -28), mount->rows[k],
                           ih_test_from_q(rig.level_q30[k / 3][k % 3], 30), "entry", 9 * i + k);
            IH_TEST_EQUAL(rig.level_q30[k / 3][k % 3], rig.level_back_q30[k % 3][k / 3], "back", k);
        }
        for (k = 0; k < 3; k++) {
            IH_TEST_WITHIN(2e-5, mount->origin_mm[k],
                           ih_test_from_q(rig.level_origin_mm_q16[k], 16), "origin", 3 * i + k);
        }
    }
}

/* Slopes of 2: half a step each of numerator, and of the depth, which is at least an eighth. */
static void directions_match_float64(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_rotated); i++) {
        const struct vector_rotated *v = &vector_rotated[i];
        int32_t x = v->x_q28, y = v->y_q28, depth;

        use_mount(v->mount);
        depth = ih_level_rotate(&rig, &x, &y);
        IH_TEST_EQUAL(v->is_seen, depth > 0, "seen", i);
        TEST_ASSERT_TRUE(ih_abs_s32(x) <= 2 << 28 && ih_abs_s32(y) <= 2 << 28);
        if (!v->is_seen) {
            continue;
        }
        IH_TEST_WITHIN(2e-8, v->depth, ih_test_from_q(depth, 28), "depth", i);
        IH_TEST_WITHIN(2e-8 / v->depth, v->x, ih_test_from_q(x, 28), "x", i);
        IH_TEST_WITHIN(2e-8 / v->depth, v->y, ih_test_from_q(y, 28), "y", i);
        depth = ih_level_rotate_back(&rig, &x, &y);
        IH_TEST_WITHIN(4e-8 / v->depth, 1 / v->depth, ih_test_from_q(depth, 28), "and back", i);
        IH_TEST_WITHIN(1e-7, ih_test_from_q(v->x_q28, 28), ih_test_from_q(x, 28), "x back", i);
        IH_TEST_WITHIN(1e-7, ih_test_from_q(v->y_q28, 28), ih_test_from_q(y, 28), "y back", i);
    }
}

/* A ray's slope has 20 bits, the rest is as above. */
static void dots_match_float64(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_level_dots); i++) {
        const struct vector_level_dot *v = &vector_level_dots[i];
        int32_t x, y, u, v_px;

        use_mount(v->mount);
        TEST_ASSERT_TRUE(ih_level_ray(&rig, v->slot, &x, &y));
        IH_TEST_WITHIN(5e-6, v->slope_x, ih_test_from_q(x, 28), "slope x", i);
        IH_TEST_WITHIN(5e-6, v->slope_y, ih_test_from_q(y, 28), "slope y", i);
        ih_level_dot_at(&rig, v->slot, v->depth_mm_q8, &x, &y);
        IH_TEST_WITHIN(5e-6, v->x, ih_test_from_q(x, 28), "x", i);
        IH_TEST_WITHIN(5e-6, v->y, ih_test_from_q(y, 28), "y", i);
        if (v->u_px > 1 && v->v_px > 1 && v->u_px < rig.calibration.width - 2 &&
            v->v_px < rig.calibration.height - 2) {
            TEST_ASSERT_TRUE(ih_level_sees(&rig, x, y, &u, &v_px));
            IH_TEST_WITHIN(0.01, v->u_px, ih_test_from_q(u, 12), "u", i);
            IH_TEST_WITHIN(0.01, v->v_px, ih_test_from_q(v_px, 12), "v", i);
        }
    }
}

static void ellipses_match_float64(void)
{
    static const int32_t unit_q16[3][3] = {{65536, 0, 0}, {0, 65536, 0}, {0, 0, 65536}};
    int i, axis;

    for (i = 0; i < IH_TEST_COUNT(vector_level_ellipses); i++) {
        const struct vector_level_ellipse *v = &vector_level_ellipses[i];
        struct ih_level_place place = {
            .x_q28 = (int32_t)lrint(ldexp(v->centre_mm[0] / v->centre_mm[2], 28)),
            .y_q28 = (int32_t)lrint(ldexp(v->centre_mm[1] / v->centre_mm[2], 28)),
            .multiple = 1,
            .divisor = 1,
        };
        struct ih_level_ellipse found;
        double off_deg;

        use_mount(v->mount);
        for (axis = 0; axis < 3; axis++) {
            place.step_q28[axis] =
                (int32_t)lrint(ldexp(v->axes_mm[axis] / 2 / v->centre_mm[2], 28));
        }
        found = ih_level_ellipse(&rig, &place, unit_q16);
        IH_TEST_WITHIN(0.01 + 1e-4 * v->a_px, v->a_px, ih_test_from_q(found.a_px_q12, 12), "a", i);
        IH_TEST_WITHIN(0.01 + 1e-4 * v->b_px, v->b_px, ih_test_from_q(found.b_px_q12, 12), "b", i);
        off_deg = fmod(fabs(found.angle_mdeg / 1000.0 - v->angle_deg), 180);
        /* The rounder, the less certain. */
        IH_TEST_WITHIN(0.01 + 2.0 / (v->a_px - v->b_px + 0.01), 0, fmin(off_deg, 180 - off_deg),
                       "angle", i);
    }
}

/* Nothing said is a level camera, and a level camera is turned by nothing. */
static void level_cameras_are_not_rotated(void)
{
    const int32_t up_y_q30[2] = {0, -(1 << 30)};
    int i, k;

    for (i = 0; i < 2; i++) {
        int32_t point[3] = {123456, -654321, 777777}, x = INT32_MAX, y = INT32_MIN, other_x,
                other_y;

        IH_TEST_EQUAL(IH_OK, init(0, up_y_q30[i], 0), "up", i);
        TEST_ASSERT_TRUE(rig.is_level);
        for (k = 0; k < 9; k++) {
            IH_TEST_EQUAL(k % 4 == 0 ? 1 << 30 : 0, rig.level_q30[k / 3][k % 3], "entry", k);
        }
        IH_TEST_EQUAL(1 << 28, ih_level_rotate(&rig, &x, &y), "turn", i);
        IH_TEST_EQUAL(1 << 28, ih_level_rotate_back(&rig, &x, &y), "turn back", i);
        TEST_ASSERT_EQUAL_INT32(INT32_MAX, x);
        TEST_ASSERT_EQUAL_INT32(INT32_MIN, y);
        ih_level_point_back(&rig, point);
        TEST_ASSERT_EQUAL_INT32(123456, point[0]);
        TEST_ASSERT_EQUAL_INT32(-654321, point[1]);
        TEST_ASSERT_EQUAL_INT32(777777, point[2]);
        for (k = 0; k < IH_SLOTS; k++) {
            ih_rig_dot_at(&rig, k, 900 << 8, &x, &y);
            ih_level_dot_at(&rig, k, 900 << 8, &other_x, &other_y);
            IH_TEST_EQUAL(x, other_x, "x", k);
            IH_TEST_EQUAL(y, other_y, "y", k);
        }
        TEST_ASSERT_EQUAL_INT32(rig.half_pitch_q28, rig.field.unit_q28);
    }
}

/* All rays within half of slopes x and y. */
static void aim(double x, double y, double half)
{
    int slot, axis;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        const double ray[3] = {x + half * (slot % IH_GRID - 9) / 9.0,
                               y + half * (slot / IH_GRID - 9) / 9.0, 1};
        const double length = sqrt(ray[0] * ray[0] + ray[1] * ray[1] + 1);
        for (axis = 0; axis < 3; axis++) {
            calibration.ray_q30[slot][axis] = (int32_t)lround(ray[axis] / length * (1 << 30));
        }
    }
}

/* A camera that looks down by 45 degrees has what is below a slope of 1/3 at a tangent of 2 and more in the level frame:
 * (1 + y) / (1 - y). */
static void rays_at_the_cameras_feet_are_out_of_view(void)
{
    const int32_t half_q30 = 759250125; /* sin and cos of 45 degrees */
    int32_t x, y;
    int slot;

    aim(0, 0, 0.4);
    IH_TEST_EQUAL(IH_OK, init(0, -half_q30, -half_q30), "to the floor", 0);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        const double slope = 0.4 * (slot / IH_GRID - 9) / 9.0;
        const bool is_in_view = (1 + slope) / (1 - slope) < 2;

        IH_TEST_EQUAL(is_in_view, ih_level_ray(&rig, slot, &x, &y), "ray", slot);
        IH_TEST_EQUAL(is_in_view, ih_level_dot_at(&rig, slot, 900 << 8, &x, &y), "dot", slot);
    }
}

static void a_pattern_at_the_cameras_feet_is_refused(void)
{
    const int32_t half_q30 = 759250125;

    calibration.origin_mm_q16[0] = calibration.origin_mm_q16[1] = -(900 << 16);
    calibration.origin_mm_q16[2] = 0;
    aim(0.9, 0.9, 0.15);
    IH_TEST_EQUAL(IH_OK, init(0, -(1 << 30), 0), "level", 0);
    IH_TEST_EQUAL(IH_ERR_RAY, init(0, -half_q30, -half_q30), "to the floor", 0);
}

static void up_is_a_unit_vector_aside_of_the_axis(void)
{
    const double limit = 10.0 / 180 * acos(-1);
    const int32_t one = 1 << 30;
    int sign;

    TEST_ASSERT_EQUAL_INT(IH_ERR_UP, init(0, -one / 2, 0));
    TEST_ASSERT_EQUAL_INT(IH_ERR_UP, init(0, 0, 1));
    TEST_ASSERT_EQUAL_INT(IH_ERR_UP, init(INT32_MIN, INT32_MIN, INT32_MIN));
    TEST_ASSERT_EQUAL_INT(IH_ERR_UP, init(INT32_MAX, 0, 0));
    TEST_ASSERT_EQUAL_INT(IH_ERR_UP, init(0, INT32_MIN, 0));
    TEST_ASSERT_EQUAL_INT(IH_OK, init(0, -one + 65530, 0));
    TEST_ASSERT_EQUAL_INT(IH_ERR_UP, init(0, -one + 65540, 0));
    TEST_ASSERT_EQUAL_INT(IH_OK, init(0, one, 0));
    TEST_ASSERT_FALSE(rig.is_level);
    for (sign = -1; sign <= 1; sign += 2) {
        const double in = limit - 1e-5, out = limit + 1e-5;

        IH_TEST_EQUAL(IH_ERR_UP,
                      init(0, (int32_t)(-sin(in) * one), (int32_t)(sign * cos(in) * one)), "along",
                      sign);
        IH_TEST_EQUAL(IH_OK, init((int32_t)(sin(out) * one), 0, (int32_t)(sign * cos(out) * one)),
                      "beside", sign);
        TEST_ASSERT_EQUAL_INT(IH_ERR_UP, init(0, 0, sign * one));
    }
    calibration.kind = IH_RIG_RANGE;
    TEST_ASSERT_EQUAL_INT(IH_ERR_UP, init(0, 0, one));
}

/* Any up: rows are unit vectors at right angles, up itself leans by what is beyond 45 degrees, and only forwards. */
static void any_up_gives_a_rotation(void)
{
    struct ih_test_random random = {9};
    int round, i, k;

    for (round = 0; round < 500; round++) {
        double up[3], length = 0, level_up[3] = {0, 0, 0}, tilt;

        for (i = 0; i < 3; i++) {
            up[i] = (double)ih_test_between(&random, -1000000, 1000000);
            length += up[i] * up[i];
        }
        length = sqrt(length);
        tilt = asin(up[2] / length) * 180 / acos(-1);
        if (fabs(tilt) > 79.9 || !(length > 1000)) {
            continue;
        }
        IH_TEST_EQUAL(IH_OK,
                      init((int32_t)lrint(ldexp(up[0] / length, 30)),
                           (int32_t)lrint(ldexp(up[1] / length, 30)),
                           (int32_t)lrint(ldexp(up[2] / length, 30))),
                      "init", round);
        for (i = 0; i < 3; i++) {
            for (k = 0; k < 3; k++) {
                const double product = ih_test_from_q(rig.level_q30[i][0], 30) *
                                           ih_test_from_q(rig.level_q30[k][0], 30) +
                                       ih_test_from_q(rig.level_q30[i][1], 30) *
                                           ih_test_from_q(rig.level_q30[k][1], 30) +
                                       ih_test_from_q(rig.level_q30[i][2], 30) *
                                           ih_test_from_q(rig.level_q30[k][2], 30);

                IH_TEST_WITHIN(1e-8, i == k, product, "product", 9 * round + 3 * i + k);
                level_up[i] += ih_test_from_q(rig.level_q30[i][k], 30) * up[k] / length;
            }
        }
        IH_TEST_WITHIN(1e-8, 0, level_up[0], "up leans aside", round);
        IH_TEST_WITHIN(1e-6, fmax(fabs(tilt) - 45, 0), asin(fabs(level_up[2])) * 180 / acos(-1),
                       "tilt left", round);
        TEST_ASSERT_TRUE(level_up[1] < 0);
    }
}

/* A point and its direction, whichever way they are turned back. */
static void points_come_back(void)
{
    struct ih_test_random random = {10};
    int i, round, axis;

    for (i = 0; i < IH_TEST_COUNT(vector_mounts); i++) {
        use_mount(i);
        for (round = 0; round < 50; round++) {
            const double z_mm = (double)ih_test_between(&random, 300, 4000);
            int32_t x = (int32_t)ih_test_between(&random, -(1 << 26), 1 << 26);
            int32_t y = (int32_t)ih_test_between(&random, -(1 << 26), 1 << 26);
            const double point[3] = {ih_test_from_q(x, 28) * z_mm, ih_test_from_q(y, 28) * z_mm,
                                     z_mm};
            const double depth = ih_test_from_q(ih_level_rotate(&rig, &x, &y), 28) * z_mm;
            int32_t back[3];

            TEST_ASSERT_TRUE(depth > 0);
            back[0] = (int32_t)lrint(ldexp(ih_test_from_q(x, 28) * depth, 8));
            back[1] = (int32_t)lrint(ldexp(ih_test_from_q(y, 28) * depth, 8));
            back[2] = (int32_t)lrint(ldexp(depth, 8));
            ih_level_point_back(&rig, back);
            for (axis = 0; axis < 3; axis++) {
                IH_TEST_WITHIN(0.01, point[axis], ih_test_from_q(back[axis], 8), "axis", axis);
            }
        }
    }
}

/* The field of a camera on its side is that of a level one, its place turned; its lines are where they were. */
static void the_field_turns_with_the_camera(void)
{
    static struct ih_rig level;
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&level, &calibration, &bad_slot));
    TEST_ASSERT_EQUAL_INT(IH_OK, init(1 << 30, 0, 0));
    IH_TEST_WITHIN(4, level.field.unit_q28, rig.field.unit_q28, "unit", 0);
    IH_TEST_WITHIN(400, level.field.centre_y_q28, rig.field.centre_x_q28, "x", 0);
    IH_TEST_WITHIN(400, -level.field.centre_x_q28, rig.field.centre_y_q28, "y", 0);
    TEST_ASSERT_EQUAL_INT32(level.half_pitch_q28, rig.half_pitch_q28);
    TEST_ASSERT_EQUAL_MEMORY(level.line, rig.line, sizeof rig.line);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(rotations_match_float64);
    RUN_TEST(directions_match_float64);
    RUN_TEST(dots_match_float64);
    RUN_TEST(ellipses_match_float64);
    RUN_TEST(level_cameras_are_not_rotated);
    RUN_TEST(rays_at_the_cameras_feet_are_out_of_view);
    RUN_TEST(a_pattern_at_the_cameras_feet_is_refused);
    RUN_TEST(up_is_a_unit_vector_aside_of_the_axis);
    RUN_TEST(any_up_gives_a_rotation);
    RUN_TEST(points_come_back);
    RUN_TEST(the_field_turns_with_the_camera);
    return UNITY_END();
}
