/* ih_rays against a float64 reference, and cases reasoned by hand. */
#include "base/ih_config.h"
#include "base/ih_types.h"
#include "detect/ih_rays.h"
#include "dots/ih_dots.h"
#include "points/ih_points.h"
#include "rig/ih_rig.h"

#include "ih_test.h"
#include "rigs.inc"

struct vector_ray {
    int32_t slot;
    double slope_x, slope_y, point_mm[3];
};

struct vector_space {
    const struct ih_calibration *rig;
    bool bright;
    const struct ih_point *point;
    double origin_mm[3];
    int32_t ray_count;
    const struct vector_ray *ray;
    const int8_t *state;
};

#include "rays.inc"

#define MIDDLE (IH_SLOTS / 2)

static struct ih_rig rig;
static struct ih_points points;
static struct ih_dots dots;
static struct ih_rays_params params;
static struct ih_rays rays;

static void use_rig(const struct ih_calibration *calibration)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, calibration, &bad_slot));
}

/* The paper rig, nothing seen, nothing over-exposed. */
void setUp(void)
{
    use_rig(&vector_rigs[0]);
    ih_rays_params_default(&params);
    params.probe_mm = VECTOR_PROBE_MM;
    memset(&points, 0, sizeof points);
    memset(&dots, 0, sizeof dots);
    memset(&rays, IH_TEST_FILL, sizeof rays);
}

void tearDown(void)
{
}

static void make(bool with_dots)
{
    ih_rays_make(&points, with_dots ? &dots : NULL, &rig, &params, &rays);
}

static void mark_bright(int32_t u_below)
{
    int32_t row, block;

    for (row = 0; row < IH_DOTS_BLOCKS_Y; row++) {
        for (block = 0; block < u_below / IH_DOTS_BLOCK; block++) {
            dots.bright[row][block / 32] |= UINT32_C(1) << (block % 32);
        }
    }
}

static void see(int32_t slot, int32_t depth_mm)
{
    struct ih_point *point = &points.point[slot];

    point->state = IH_POINT_SEEN;
    point->depth_mm_q8 = depth_mm << 8;
    ih_rig_dot_at(&rig, slot, point->depth_mm_q8, &point->x_q28, &point->y_q28);
}

static int32_t count_state(enum ih_ray_state state)
{
    int32_t slot, count = 0;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        count += rays.ray[slot].state == (int32_t)state;
    }
    return count;
}

static void rays_and_states_match_float64(void)
{
    int i, axis;
    int32_t k;

    for (i = 0; i < IH_TEST_COUNT(vector_spaces); i++) {
        const struct vector_space *v = &vector_spaces[i];

        use_rig(v->rig);
        memcpy(points.point, v->point, sizeof points.point);
        memset(&dots, 0, sizeof dots);
        if (v->bright) {
            mark_bright(VECTOR_BRIGHT_U);
        }
        memset(&rays, IH_TEST_FILL, sizeof rays);
        make(v->rig->kind == IH_RIG_DOTS);
        for (axis = 0; axis < 3; axis++) { /* half a step, as all below, and the vectors' digits */
            IH_TEST_WITHIN(0.002, v->origin_mm[axis], ih_test_from_q(rays.origin_mm_q8[axis], 8),
                           "origin", i);
        }
        for (k = 0; k < v->ray_count; k++) {
            const struct vector_ray *expected = &v->ray[k];
            const struct ih_ray *ray = &rays.ray[expected->slot];

            IH_TEST_WITHIN(5.5e-7, expected->slope_x, ih_test_from_q(ray->slope_x_q20, 20), "x", k);
            IH_TEST_WITHIN(5.5e-7, expected->slope_y, ih_test_from_q(ray->slope_y_q20, 20), "y", k);
            for (axis = 0; axis < 3; axis++) {
                IH_TEST_WITHIN(0.0021, expected->point_mm[axis],
                               ih_test_from_q(ray->point_mm_q8[axis], 8), "point", k);
            }
        }
        for (k = 0; k < IH_SLOTS; k++) {
            IH_TEST_EQUAL(v->state[k], rays.ray[k].state, "state", i * 1000 + k);
        }
    }
}

/* A dot that was seen lies on its ray, with every rig and from the nearest to the farthest. */
static void a_seen_point_lies_on_its_ray(void)
{
    int i, axis;
    int32_t slot;

    for (i = 0; i < IH_TEST_COUNT(vector_rigs); i++) {
        use_rig(&vector_rigs[i]);
        memset(&points, 0, sizeof points);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            see(slot, rig.calibration.near_mm +
                          (rig.calibration.far_mm - rig.calibration.near_mm) * slot / 360);
        }
        make(true);
        TEST_ASSERT_EQUAL_INT32(IH_SLOTS, count_state(IH_RAY_SEEN));
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const struct ih_ray *ray = &rays.ray[slot];
            const int32_t slope_q20[2] = {ray->slope_x_q20, ray->slope_y_q20};
            const double depth = ih_test_from_q(ray->point_mm_q8[2] - rays.origin_mm_q8[2], 8);

            for (axis = 0; axis < 2; axis++) {
                /* Half steps of origin and point, and the slope's over 16 m: 0.008 mm. */
                IH_TEST_WITHIN(0.012,
                               ih_test_from_q(rays.origin_mm_q8[axis], 8) +
                                   depth * ih_test_from_q(slope_q20[axis], 20),
                               ih_test_from_q(ray->point_mm_q8[axis], 8), "aside", slot);
            }
        }
    }
}

/* One dot far away says that the probe is far away; the field's middle is in the picture. */
static void a_missing_dot_inside_the_picture_is_empty_unless_over_exposed(void)
{
    see(0, 2000);
    make(true);
    TEST_ASSERT_EQUAL_INT32(IH_RAY_EMPTY, rays.ray[MIDDLE].state);
    TEST_ASSERT_EQUAL_INT32(IH_RAY_SEEN, rays.ray[0].state);
    mark_bright(IH_FRAME_WIDTH_MAX);
    make(true);
    TEST_ASSERT_EQUAL_INT32(IH_RAY_UNKNOWN, rays.ray[MIDDLE].state);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS - 1, count_state(IH_RAY_UNKNOWN));
    make(false); /* without the map nothing is over-exposed */
    TEST_ASSERT_EQUAL_INT32(IH_RAY_EMPTY, rays.ray[MIDDLE].state);
}

/* With a wide baseline the pattern of a near probe is beside the frame: what is not seen there says
 * nothing. A far probe's is inside. */
static void the_probe_stands_behind_what_is_near(void)
{
    int32_t near_count, slot;

    use_rig(&vector_rigs[1]);
    see(MIDDLE, 100);
    make(true);
    near_count = count_state(IH_RAY_EMPTY);
    see(MIDDLE, 1500);
    make(true);
    TEST_ASSERT_TRUE(near_count < IH_SLOTS * 3 / 4);
    TEST_ASSERT_TRUE(count_state(IH_RAY_EMPTY) > IH_SLOTS * 9 / 10);
    /* The 8th percentile: two near ones of 30 do not count, three do. */
    for (slot = 0; slot < 30; slot++) {
        see(slot, slot < 2 ? 100 : 1500);
    }
    points.point[MIDDLE].state = IH_POINT_MISSING;
    make(true);
    TEST_ASSERT_TRUE(count_state(IH_RAY_EMPTY) > (IH_SLOTS - 30) * 9 / 10);
    see(2, 100);
    make(true);
    TEST_ASSERT_TRUE(count_state(IH_RAY_EMPTY) < IH_SLOTS * 3 / 4);
}

static void nothing_seen_is_no_division_by_zero(void)
{
    int32_t slot;

    make(true);
    TEST_ASSERT_EQUAL_INT32(0, count_state(IH_RAY_SEEN));
    TEST_ASSERT_EQUAL_INT32(IH_RAY_EMPTY, rays.ray[MIDDLE].state);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        TEST_ASSERT_EQUAL_INT32(0, rays.ray[slot].point_mm_q8[2]);
        points.point[slot].state = IH_POINT_UNKNOWN;
    }
    make(true);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS, count_state(IH_RAY_UNKNOWN));
}

/* A range image: its rays start at the camera, go through the points' places and are limited. */
static void a_range_image_has_its_rays_from_the_camera(void)
{
    use_rig(&vector_range_rigs[0]);
    points.point[0] = (struct ih_point){INT32_MAX, -INT32_MAX, 0, IH_POINT_UNKNOWN};
    points.point[1] = (struct ih_point){1 << 27, -(1 << 26), 16000 << 8, IH_POINT_SEEN};
    points.point[2] = (struct ih_point){1 << 27, 0, 0, IH_POINT_MISSING};
    make(false);
    TEST_ASSERT_EQUAL_INT32(0, rays.origin_mm_q8[0] | rays.origin_mm_q8[1] | rays.origin_mm_q8[2]);
    TEST_ASSERT_EQUAL_INT32(IH_RAYS_SLOPE_MAX << 20, rays.ray[0].slope_x_q20);
    TEST_ASSERT_EQUAL_INT32(-(IH_RAYS_SLOPE_MAX << 20), rays.ray[0].slope_y_q20);
    TEST_ASSERT_EQUAL_INT32(IH_RAY_UNKNOWN, rays.ray[0].state);
    TEST_ASSERT_EQUAL_INT32(1 << 19, rays.ray[1].slope_x_q20);
    TEST_ASSERT_EQUAL_INT32(8000 << 8, rays.ray[1].point_mm_q8[0]);
    TEST_ASSERT_EQUAL_INT32(-(4000 << 8), rays.ray[1].point_mm_q8[1]);
    TEST_ASSERT_EQUAL_INT32(IH_RAY_EMPTY, rays.ray[2].state);
}

/* The steepest rays and the farthest projector that a rig may have, the largest and smallest depths
 * and places that points may have: nothing wraps, points stay within 8 times the depth. */
static void the_extremes_of_a_rig_do_not_overflow(void)
{
    static const int32_t depth_q8[] = {1, 1 << 8, 100 << 8, 16000 << 8};
    struct ih_calibration *c = &rig.calibration;
    struct ih_test_random random = {302};
    int32_t pass, slot;

    for (pass = 0; pass < 60; pass++) {
        const int32_t origin = IH_RIG_BASELINE_MAX_MM << 16;

        use_rig(&vector_rigs[pass % 3]);
        for (slot = 0; slot < 3; slot++) {
            c->origin_mm_q16[slot] = pass % 2 == 0 ? origin : -origin;
        }
        for (slot = 0; slot < IH_SLOTS; slot++) { /* r_z from 1/4 on: a slope of up to 4 */
            const double z = 0.25 + 0.75 * ih_test_unit(&random) * (pass % 5);
            const double limited = z > 1 ? 1 : z, angle = 6.2832 * ih_test_unit(&random);
            const double aside = sqrt(1 - limited * limited) * 1.00006;

            c->ray_q30[slot][0] = (int32_t)lround(cos(angle) * aside * (1 << 30));
            c->ray_q30[slot][1] = (int32_t)lround(sin(angle) * aside * (1 << 30));
            c->ray_q30[slot][2] = (int32_t)lround(limited * (1 << 30));
            rig.line[slot].slope_x_q20 =
                (int32_t)lround(ldexp(c->ray_q30[slot][0], 20) / c->ray_q30[slot][2]);
            rig.line[slot].slope_y_q20 =
                (int32_t)lround(ldexp(c->ray_q30[slot][1], 20) / c->ray_q30[slot][2]);
            points.point[slot] = (struct ih_point){
                (int32_t)ih_test_between(&random, INT32_MIN, INT32_MAX),
                ih_test_between(&random, 0, 1) == 0 ? INT32_MIN : INT32_MAX,
                depth_q8[ih_test_between(&random, 0, 3)],
                (int32_t)ih_test_between(&random, 0, 2),
            };
        }
        make(pass % 3 != 0);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const struct ih_ray *ray = &rays.ray[slot];
            const int32_t limit = IH_RAYS_SLOPE_MAX << 20;

            IH_TEST_RANGE(-limit, limit, ray->slope_x_q20, "x", slot);
            IH_TEST_RANGE(-limit, limit, ray->slope_y_q20, "y", slot);
            IH_TEST_RANGE(-(128000 << 8), 128000 << 8, ray->point_mm_q8[0], "point x", slot);
            IH_TEST_RANGE(-(128000 << 8), 128000 << 8, ray->point_mm_q8[1], "point y", slot);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(rays_and_states_match_float64);
    RUN_TEST(a_seen_point_lies_on_its_ray);
    RUN_TEST(a_missing_dot_inside_the_picture_is_empty_unless_over_exposed);
    RUN_TEST(the_probe_stands_behind_what_is_near);
    RUN_TEST(nothing_seen_is_no_division_by_zero);
    RUN_TEST(a_range_image_has_its_rays_from_the_camera);
    RUN_TEST(the_extremes_of_a_rig_do_not_overflow);
    return UNITY_END();
}
