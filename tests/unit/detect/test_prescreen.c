/* ih_prescreen against float64 counts, for rays that are not on a limit. */
#include "base/ih_config.h"
#include "detect/ih_prescreen.h"
#include "detect/ih_rays.h"

#include <math.h>

#include "ih_test.h"

static struct ih_rays rays;
static const int32_t centre_mm_q8[3] = {40 << 8, -25 * 256, 800 << 8};

void setUp(void)
{
    memset(&rays, 0, sizeof rays); /* unknown */
    rays.origin_mm_q8[0] = 12 << 8;
}

void tearDown(void)
{
}

/* A ray past the centre, so many mm aside and below; its point so many behind the centre. */
static void look(int32_t slot, double x_mm, double y_mm, double z_mm, enum ih_ray_state state)
{
    const double off_mm[2] = {x_mm, y_mm};
    struct ih_ray *ray = &rays.ray[slot];
    const double depth_mm = (centre_mm_q8[2] - rays.origin_mm_q8[2]) / 256.0;
    double slope[2];
    int axis;

    for (axis = 0; axis < 2; axis++) {
        const double from_mm = (centre_mm_q8[axis] - rays.origin_mm_q8[axis]) / 256.0;

        slope[axis] = (from_mm + off_mm[axis]) / depth_mm;
        ray->point_mm_q8[axis] =
            (int32_t)(rays.origin_mm_q8[axis] + slope[axis] * (depth_mm + z_mm) * 256);
    }
    ray->slope_x_q20 = (int32_t)lround(slope[0] * 1048576);
    ray->slope_y_q20 = (int32_t)lround(slope[1] * 1048576);
    ray->point_mm_q8[2] = state == IH_RAY_SEEN ? centre_mm_q8[2] + (int32_t)(z_mm * 256) : 0;
    ray->state = state;
}

static int32_t promise(void)
{
    ih_rays_fill_table(&rays);
    return ih_prescreen_score_q8(&rays, centre_mm_q8);
}

static void nothing_known_says_nothing(void)
{
    int32_t slot;

    TEST_ASSERT_EQUAL_INT32(256, promise());
    for (slot = 0; slot < IH_SLOTS; slot++) { /* all of it on the head itself */
        look(slot, slot % IH_GRID * 4, slot / IH_GRID * 6, -90, IH_RAY_SEEN);
    }
    TEST_ASSERT_EQUAL_INT32(256, promise());
}

/* Each window, by four rays at its edges: inside they count, 3 mm outside they do not. */
static void windows_are_where_they_should_be(void)
{
    static const struct {
        double x_mm[2], y_mm[2], z_mm[2];
        int32_t promise; /* when it is filled */
    } windows[] = {
        {{-123, 123}, {-700, -217}, {62, 900}, 2 * (9 * 128 / 5)},
        {{-178, 178}, {155, 371}, {-218, 198}, 256 + 3 * 256},
        {{172, 328}, {-111, 111}, {-148, 148}, 256 - 4 * 256},
        {{-328, -172}, {-111, 111}, {-148, 148}, 256 - 4 * 256},
    };
    int i, corner, edge;

    for (i = 0; i < IH_TEST_COUNT(windows); i++) {
        for (edge = -1; edge < 6; edge++) {
            double x[2], y[2];
            bool outside = false;

            setUp();
            memcpy(x, windows[i].x_mm, sizeof x);
            memcpy(y, windows[i].y_mm, sizeof y);
            if (edge >= 0 && edge < 4) {
                double *moved = edge < 2 ? &x[edge] : &y[edge - 2];

                outside = i != 0 || edge != 2; /* that one has no end above */
                *moved += edge % 2 == 0 ? -5 : 5;
                /* both corners at that edge only */
                (edge < 2 ? x : y)[edge % 2 == 0 ? 1 : 0] = *moved;
            }
            for (corner = 0; corner < 4; corner++) {
                const double z = windows[i].z_mm[corner % 2];

                look(20 * corner + 7, x[corner & 1], y[corner >> 1],
                     edge == 4 + corner % 2 && !(i == 0 && corner % 2 == 1)
                         ? z + (corner % 2 == 0 ? -5 : 5)
                         : z,
                     IH_RAY_SEEN);
            }
            if (outside) {
                IH_TEST_EQUAL(256, promise(), "outside", 10 * i + edge);
            } else if (edge >= 4) { /* before or behind: two of four still count */
                const int32_t half = i == 0   ? (edge == 4 ? 2 * (5 * 128 / 5) : windows[i].promise)
                                     : i == 1 ? 256 + 3 * 128
                                              : 256 - 4 * 128;

                IH_TEST_EQUAL(half, promise(), "depth", 10 * i + edge);
            } else {
                IH_TEST_EQUAL(windows[i].promise, promise(), "inside", 10 * i + edge);
            }
        }
    }
}

/* An empty ray is open above, and neither a body nor beside. */
static void empty_rays_are_open(void)
{
    int32_t slot;

    for (slot = 0; slot < 9; slot++) {
        look(slot, -40 + 10 * slot, -250, 0, IH_RAY_EMPTY);
        look(20 + slot, 200 + 10 * slot, 0, 0, IH_RAY_EMPTY);
        look(40 + slot, 10 * slot, 200, 0, IH_RAY_EMPTY);
    }
    TEST_ASSERT_EQUAL_INT32(2 * (19 * 128 / 10), promise());
}

/* A place that is not before the rays' origin says nothing; no place is too far off for 16 bits. */
static void any_place_is_looked_at(void)
{
    struct ih_test_random random = {602};
    int32_t pass, slot, axis;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        look(slot, (slot % IH_GRID - 9) * 40, (slot / IH_GRID - 9) * 40, slot - 180, IH_RAY_SEEN);
    }
    ih_rays_fill_table(&rays);
    for (pass = 0; pass < 2000; pass++) {
        int32_t place[3];

        for (axis = 0; axis < 3; axis++) {
            place[axis] = (int32_t)ih_test_any_size(&random, 26);
        }
        const int32_t found = ih_prescreen_score_q8(&rays, place);
        IH_TEST_RANGE(-4 * 256, 5 * 256, found, "promise", pass);
        if (place[2] < 64 << 8) {
            IH_TEST_EQUAL(256, found, "before the origin", pass);
        }
    }
}

static bool within(double value, double low, double high)
{
    return value > low && value < high;
}

/* Rays anywhere, seen, empty and unknown, none within 3 mm of a limit. */
static void counts_match_float64(void)
{
    static const double limit_x[] = {125, 170, 180, 330}, limit_y[] = {-215, -113, 113, 153, 373},
                        limit_z[] = {-220, -150, 60, 150, 200};
    struct ih_test_random random = {601};
    int pass, i;

    for (pass = 0; pass < 300; pass++) {
        int32_t slot, high = 0, high_all = 0, body = 0, body_all = 0, level = 0, level_all = 0;

        for (slot = 0; slot < IH_SLOTS; slot++) {
            const double x = 900 * ih_test_unit(&random) - 450,
                         y = 900 * ih_test_unit(&random) - 450,
                         z = 800 * ih_test_unit(&random) - 400;
            const int32_t state = (int32_t)ih_test_between(&random, 0, 5);
            const bool is_seen = state > 1, is_empty = state == 0;
            bool is_near = false;

            for (i = 0; i < IH_TEST_COUNT(limit_x); i++) {
                is_near = is_near || fabs(fabs(x) - limit_x[i]) < 3;
            }
            for (i = 0; i < IH_TEST_COUNT(limit_y); i++) {
                is_near = is_near || fabs(y - limit_y[i]) < 3 || fabs(z - limit_z[i]) < 3;
            }
            look(slot, x, y, z,
                 is_near || state == 1 ? IH_RAY_UNKNOWN
                 : is_empty            ? IH_RAY_EMPTY
                                       : IH_RAY_SEEN);
            if (is_near || state == 1) {
                continue;
            }
            if (fabs(x) < 125 && y < -215) {
                high_all++;
                high += is_empty || z > 60;
            }
            if (fabs(x) < 180 && within(y, 153, 373)) {
                body_all++;
                body += is_seen && within(z, -220, 200);
            }
            if (within(fabs(x), 170, 330) && fabs(y) < 113) {
                level_all++;
                level += is_seen && fabs(z) < 150;
            }
        }
        IH_TEST_EQUAL(2 * ((2 * high + 1) * 128 / (high_all + 1)) +
                          3 * (body * 256 / (body_all < 3 ? 3 : body_all)) -
                          4 * (level * 256 / (level_all < 3 ? 3 : level_all)),
                      promise(), "scene", pass);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(nothing_known_says_nothing);
    RUN_TEST(windows_are_where_they_should_be);
    RUN_TEST(empty_rays_are_open);
    RUN_TEST(any_place_is_looked_at);
    RUN_TEST(counts_match_float64);
    return UNITY_END();
}
