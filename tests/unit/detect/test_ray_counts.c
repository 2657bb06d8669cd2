/* ih_ray_counts against ih_evidence looking at each ray by itself: at random, with rays and points as good
 * as on a limit, so that one of them on the wrong side would show; and that few rays are left. */
#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_evidence.h"
#include "detect/ih_rays.h"
#include "detect/ih_ray_counts.h"
#include "simd/ih_simd.h"

#include "ih_test.h"

/* Rays left, on the average; where there are no vectors all are. */
#define LEFT_MAX (IH_I16_LANES > 0 ? 25 : IH_SLOTS)

static struct ih_rays rays;
static struct ih_ellipsoid head;
static struct ih_ray_marks marks;
static struct ih_ray_counts counts;
static struct ih_test_random random_state;

void setUp(void)
{
    memset(&rays, 0, sizeof rays);
    memset(&head, 0, sizeof head);
    random_state = (struct ih_test_random){617};
}

void tearDown(void)
{
}

static int32_t between(int32_t low, int32_t high)
{
    return (int32_t)ih_test_between(&random_state, low, high);
}

static void place_head(int32_t depth_mm, int32_t semi_min_mm, int32_t semi_max_mm)
{
    int axis;

    for (axis = 0; axis < 3; axis++) {
        rays.origin_mm_q8[axis] = between(-(200 << 8), 200 << 8);
        head.semi_mm_q8[axis] = between(semi_min_mm << 8, semi_max_mm << 8);
    }
    head.centre_mm_q8[2] = rays.origin_mm_q8[2] + (depth_mm << 8) + between(0, 255);
    for (axis = 0; axis < 2; axis++) {
        head.centre_mm_q8[axis] =
            rays.origin_mm_q8[axis] + between(-(depth_mm << 7), depth_mm << 7);
    }
}

/* A ray that passes here at the head's depth, in mm from its centre; its point is so far behind it. */
static void put(int32_t slot, const double at_mm[2], int32_t state, int32_t dz_mm_q8)
{
    struct ih_ray *ray = &rays.ray[slot];
    const double depth_q8 = head.centre_mm_q8[2] - rays.origin_mm_q8[2];
    double slope[2];
    int axis;

    for (axis = 0; axis < 2; axis++) {
        slope[axis] =
            (at_mm[axis] * 256 + head.centre_mm_q8[axis] - rays.origin_mm_q8[axis]) / depth_q8;
        slope[axis] = slope[axis] > 0.9999 ? 0.9999 : slope[axis] < -0.9999 ? -0.9999 : slope[axis];
    }
    *ray = (struct ih_ray){.slope_x_q20 = (int32_t)(slope[0] * (1 << 20)),
                           .slope_y_q20 = (int32_t)(slope[1] * (1 << 20)),
                           .state = state};
    if (state == IH_RAY_SEEN) {
        ray->point_mm_q8[0] = head.centre_mm_q8[0] + (int32_t)(at_mm[0] * 256);
        ray->point_mm_q8[1] = head.centre_mm_q8[1] + (int32_t)(at_mm[1] * 256);
        ray->point_mm_q8[2] = head.centre_mm_q8[2] + dz_mm_q8;
    }
}

static bool is_marked(const uint32_t *bits, int32_t slot)
{
    return (bits[slot / 32] >> slot % 32 & 1) != 0;
}

/* The same numbers with the counts, and ray by ray, as in a field too wide for 16 bits. How many rays the counts
 * left to ih_evidence. */
static int32_t compare(int what)
{
    static const struct ih_evidence_nest no_nest = {.present = false};
    static struct ih_evidence with, without;
    struct ih_ellipsoid_box box;
    int32_t slot, left = 0;

    ih_rays_fill_table(&rays);
    ih_evidence_collect(&rays, &head, head.centre_mm_q8, &no_nest, &with);
    box = ih_ellipsoid_box(&head, rays.table.slope_max_q20, 1 << 14);
    memset(&marks, IH_TEST_FILL, sizeof marks);
    ih_ray_counts_count(&rays, &head, &box, &marks, &counts);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        left += is_marked(marks.unsure, slot);
    }
    rays.table.slope_max_q20[1] = IH_RAYS_SLOPE_MAX << 20;
    ih_evidence_collect(&rays, &head, head.centre_mm_q8, &no_nest, &without);
    for (slot = 0; slot < IH_EVIDENCE_COUNT; slot++) {
        IH_TEST_EQUAL(without.value_q8[slot], with.value_q8[slot],
                      ih_evidence_text((enum ih_evidence_kind)slot), what);
    }
    IH_TEST_EQUAL(without.through_count, with.through_count, "through", what);
    IH_TEST_EQUAL(without.hit_count, with.hit_count, "hit", what);
    IH_TEST_EQUAL(without.front_count, with.front_count, "front", what);
    return left;
}

static void random_heads_are_the_same(void)
{
    int pass, slot;

    for (pass = 0; pass < 600; pass++) {
        const int bits = between(0, 16);

        place_head(between(227, 227 + (16000 >> (16 - bits) % 7)), 42, 200);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const double at_mm[2] = {between(-900, 900) + slot / 400.0,
                                     between(-600, 600) + slot / 700.0};

            put(slot, at_mm, between(0, 2), between(-(400 << 8), 400 << 8));
        }
        compare(pass);
    }
}

/* Each ray within half a mm of some limit, in both directions, and each depth within a few steps. */
static void rays_at_limits_are_the_same(void)
{
    static const int32_t dz_mm[] = {60, -220, 200, -150, 150, -60, 50, -30};
    int pass, slot;

    for (pass = 0; pass < 600; pass++) {
        place_head(between(400, pass % 2 == 0 ? 1200 : 16000), 55, 161);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const double a = head.semi_mm_q8[0] / 256.0, b = head.semi_mm_q8[1] / 256.0;
            const double x_mm[] = {100, 170, 180, 260, 300, 330, 1.6 * a, 8 * a, 0};
            const double y_mm[] = {40 + b,  240 + b, 260 + b, 160 + b, b,
                                   0.9 * b, 1.9 * b, 8 * b,   0};
            const double round[] = {1.25, 1.9, 2.5};
            const double off_mm = between(-500, 500) / 1000.0;
            const int sign = between(0, 1) * 2 - 1;
            double at_mm[2] = {between(-400, 400), between(-300, 400)};

            switch (slot % 4) {
            case 0:
                at_mm[0] = sign * x_mm[between(0, 8)] + off_mm;
                break;
            case 1:
                at_mm[1] = sign * y_mm[between(0, 8)] + off_mm;
                break;
            case 2: {
                const double angle = between(0, 6283) / 1000.0;
                const double r = round[between(0, 2)] + off_mm / 100;

                at_mm[0] = a * r * cos(angle);
                at_mm[1] = b * r * sin(angle);
                break;
            }
            default: /* as much down, or up, as aside */
                at_mm[0] = sign * between(50, 190) / 100.0 * a;
                at_mm[1] = fabs(at_mm[0] / a) * (between(0, 1) == 0 ? 0.9 : -0.8) * b + off_mm;
                break;
            }
            put(slot, at_mm, between(0, 5) == 0 ? IH_RAY_EMPTY : IH_RAY_SEEN,
                dz_mm[between(0, 7)] * 256 - (slot % 3 == 0 ? head.semi_mm_q8[2] : 0) +
                    between(-3, 3) * (1 << between(0, 7)));
        }
        compare(pass);
    }
}

/* A pattern before a head at 0.9 m: what is left is seldom more than a few rays. */
static void few_rays_are_left(void)
{
    int pass, slot;
    int32_t left = 0;

    for (pass = 0; pass < 200; pass++) {
        place_head(900, 78, 110);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            const double at_mm[2] = {(slot % IH_GRID - 9) * 28.3 + between(-3000, 3000) / 1000.0,
                                     (slot / IH_GRID - 9) * 28.3 + between(-3000, 3000) / 1000.0};

            put(slot, at_mm, between(0, 7) == 0 ? IH_RAY_EMPTY : IH_RAY_SEEN,
                between(-(300 << 8), 900 << 8));
        }
        left += compare(pass);
    }
    IH_TEST_RANGE(1, LEFT_MAX * 200, left, "rays left", 0);
}

static void check_all_left(const char *what, int index)
{
    int32_t slot;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        const bool is_known = slot % 3 != IH_RAY_UNKNOWN;

        IH_TEST_EQUAL(is_known, is_marked(marks.unsure, slot), what, index);
        IH_TEST_EQUAL(is_known, is_marked(marks.may_hit, slot), what, index);
        IH_TEST_EQUAL(false, is_marked(marks.body, slot), what, index);
    }
}

/* Where 16 bits do not suffice every ray of known state is left, and may hit. */
static void outside_of_the_limits_all_are_left(void)
{
    static const struct {
        int32_t depth_mm, aside_mm, semi_mm;
        bool is_counted;
    } cases[] = {{226, 0, 80, false},   {228, 0, 80, true},      {16301, 0, 80, false},
                 {16299, 0, 80, true},  {1000, 1001, 80, false}, {1000, -1001, 80, false},
                 {1000, 999, 80, true}, {1000, 0, 41, false},    {1000, 0, 43, true},
                 {1000, 0, 201, false}, {1000, 0, 199, true}};
    const struct ih_ellipsoid_box box = {{20000, 20000}};
    int i, slot;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const double at_mm[2] = {40, 40};

        head = (struct ih_ellipsoid){
            .centre_mm_q8 = {cases[i].aside_mm * 256, 0, cases[i].depth_mm * 256},
            .semi_mm_q8 = {cases[i].semi_mm << 8, cases[i].semi_mm << 8, 80 << 8}};
        for (slot = 0; slot < IH_SLOTS; slot++) {
            put(slot, at_mm, slot % 3, 0);
        }
        ih_rays_fill_table(&rays);
        memset(&marks, IH_TEST_FILL, sizeof marks);
        ih_ray_counts_count(&rays, &head, &box, &marks, &counts);
        if (!cases[i].is_counted || IH_I16_LANES == 0) {
            check_all_left("left", i);
        }
        for (slot = 0; slot < IH_SLOTS; slot += 3) {
            IH_TEST_EQUAL(false, is_marked(marks.unsure, slot), "unknown", slot);
        }
    }
    rays.ray[1].slope_x_q20 = 1 << 20;
    ih_rays_fill_table(&rays);
    ih_ray_counts_count(&rays, &head, &box, &marks, &counts);
    check_all_left("steep", 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(random_heads_are_the_same);
    RUN_TEST(rays_at_limits_are_the_same);
    RUN_TEST(few_rays_are_left);
    RUN_TEST(outside_of_the_limits_all_are_left);
    return UNITY_END();
}
