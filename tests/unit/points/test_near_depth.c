/* ih_near_depth against a count of the nearer depths. */
#include "base/ih_config.h"
#include "points/ih_near_depth.h"
#include "points/ih_points.h"

#include "ih_test.h"

static struct ih_points points;

void setUp(void)
{
    memset(&points, 0, sizeof points); /* missing */
}

void tearDown(void)
{
}

static void see(int32_t slot, int32_t depth_mm_q8)
{
    points.point[slot].state = IH_POINT_SEEN;
    points.point[slot].depth_mm_q8 = depth_mm_q8;
}

/* 8 in 100 points are nearer than it; alone it is the point itself. */
static void the_nearest_is_a_percentile(void)
{
    int32_t slot, count;

    for (count = 0; count <= 60; count++) {
        int32_t nearer = 0, near;

        setUp();
        for (slot = 0; slot < count; slot++) { /* in no order: 37 n modulo 61 is each number once */
            see(slot * 5, (1000 + slot * 37 % 61) << 8);
        }
        near = ih_near_depth_mm_q8(&points) >> 8;
        for (slot = 0; slot < count; slot++) {
            nearer += 1000 + slot * 37 % 61 < near;
        }
        IH_TEST_EQUAL(count * 8 / 100, nearer, "nearer", count);
        IH_TEST_EQUAL(near << 8, ih_near_depth_mm_q8(&points), "a point's own depth", count);
        IH_TEST_EQUAL(count == 0, near == 0, "of none", count);
    }
}

/* Depths that differ in any bit, up to the farthest, and points that were not seen. */
static void random_depths_are_ranked(void)
{
    struct ih_test_random random = {707};
    int32_t pass, slot;

    for (pass = 0; pass < 500; pass++) {
        int32_t seen = 0, nearer = 0, as_near = 0, near;

        setUp();
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const int32_t depth = (int32_t)ih_test_between(&random, 1, IH_DEPTH_MAX_MM << 8);

            points.point[slot].depth_mm_q8 = 0;
            if (ih_test_between(&random, 0, 3) > 0) {
                see(slot, pass % 2 == 0 ? depth : (500 << 8) + (depth & 0x3fff));
                seen++;
            }
        }
        near = ih_near_depth_mm_q8(&points);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            if (points.point[slot].state == IH_POINT_SEEN) {
                nearer += points.point[slot].depth_mm_q8 < near;
                as_near += points.point[slot].depth_mm_q8 <= near;
            }
        }
        IH_TEST_RANGE(0, seen * 8 / 100, nearer, "nearer", pass);
        IH_TEST_RANGE(seen * 8 / 100 + 1, seen, as_near, "as near", pass);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_nearest_is_a_percentile);
    RUN_TEST(random_depths_are_ranked);
    return UNITY_END();
}
