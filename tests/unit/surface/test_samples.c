/* ih_samples against a second implementation, and small cases reasoned by hand. */
#include "base/ih_config.h"
#include "base/ih_types.h"
#include "dots/ih_dots.h"
#include "points/ih_points.h"
#include "rig/ih_rig.h"
#include "surface/ih_samples.h"

#include "ih_test.h"
#include "rigs.inc"

struct vector_sample {
    int32_t slot;
    double x, y, depth_mm;
    int32_t root_weight_q15;
};

struct vector_choice {
    const struct ih_point *point;
    bool bright;
    int32_t sample_count, seen_count, filled_count, isolated_count, outside_count;
    double nearest_mm, clip_mm;
    const struct vector_sample *sample;
};

#include "samples.inc"

#define MIDDLE (IH_SLOTS / 2)

static struct ih_rig rig;
static struct ih_points points;
static struct ih_dots dots;
static struct ih_samples_params params;
static struct ih_samples samples;

/* All slots seen at one depth, on a regular lattice of 2 field units; tests change a few. */
void setUp(void)
{
    int32_t slot, bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[0], &bad_slot));
    ih_samples_params_default(&params);
    /* What the expectations below were worked out with; the defaults may be tuned. */
    params.isolated_mm = 60;
    params.clip_behind_mm = 400;
    params.clip_min_mm = 1100;
    params.fill_neighbours = 3;
    params.fill_root_weight_q15 = 17948;
    memset(&samples, IH_TEST_FILL, sizeof samples);
    memset(&dots, 0, sizeof dots);
    points.field = vector_field;
    points.seen_count = IH_SLOTS;
    for (slot = 0; slot < IH_SLOTS; slot++) {
        points.point[slot] = (struct ih_point){
            .x_q28 = vector_field.centre_x_q28 + (slot % IH_GRID - 9) * 2 * vector_field.unit_q28,
            .y_q28 = vector_field.centre_y_q28 + (slot / IH_GRID - 9) * 2 * vector_field.unit_q28,
            .depth_mm_q8 = 1000 << 8,
            .state = IH_POINT_SEEN,
        };
    }
}

void tearDown(void)
{
}

static void select_samples(void)
{
    ih_samples_select(&points, &dots, &rig, &params, &samples);
}

static void set_depth(int32_t slot, int32_t depth_mm)
{
    points.point[slot].depth_mm_q8 = depth_mm << 8;
}

static void set_missing(int32_t slot)
{
    points.point[slot].depth_mm_q8 = 0;
    points.point[slot].state = IH_POINT_MISSING;
    points.seen_count--;
}

static const struct ih_sample *sample_of(int32_t slot)
{
    int32_t i;

    for (i = 0; i < samples.sample_count; i++) {
        if (samples.sample[i].slot == slot) {
            return &samples.sample[i];
        }
    }
    return NULL;
}

static void mark_bright_left(void)
{
    int32_t row, block;

    for (row = 0; row < IH_DOTS_BLOCKS_Y; row++) {
        for (block = 0; block < VECTOR_BRIGHT_U / IH_DOTS_BLOCK; block++) {
            dots.bright[row][block / 32] |= UINT32_C(1) << (block % 32);
        }
    }
}

static void samples_match_the_second_implementation(void)
{
    int i;
    int32_t k;

    for (i = 0; i < IH_TEST_COUNT(vector_choices); i++) {
        const struct vector_choice *v = &vector_choices[i];

        memcpy(points.point, v->point, sizeof points.point);
        memset(&dots, 0, sizeof dots);
        if (v->bright) {
            mark_bright_left();
        }
        memset(&samples, IH_TEST_FILL, sizeof samples);
        select_samples();
        IH_TEST_EQUAL(v->sample_count, samples.sample_count, "samples", i);
        IH_TEST_EQUAL(v->seen_count, samples.seen_count, "seen", i);
        IH_TEST_EQUAL(v->filled_count, samples.filled_count, "filled", i);
        IH_TEST_EQUAL(v->isolated_count, samples.isolated_count, "isolated", i);
        IH_TEST_EQUAL(v->outside_count, samples.outside_count, "outside", i);
        IH_TEST_WITHIN(1.0 / 512, v->clip_mm, ih_test_from_q(samples.clip_mm_q8, 8), "clip", i);
        if (v->seen_count > 0) {
            IH_TEST_WITHIN(1.0 / 512, v->nearest_mm, ih_test_from_q(samples.nearest_mm_q8, 8),
                           "nearest", i);
        }
        for (k = 0; k < v->sample_count; k++) {
            const struct ih_sample *sample = &samples.sample[k];

            IH_TEST_EQUAL(v->sample[k].slot, sample->slot, "slot", k);
            IH_TEST_EQUAL(v->sample[k].root_weight_q15, sample->root_weight_q15, "weight", k);
            IH_TEST_WITHIN(1.0 / 512, v->sample[k].depth_mm, ih_test_from_q(sample->depth_mm_q8, 8),
                           "depth", k);
            /* Half a unit of Q16; a filled place adds dot_at's error of 2^-26 over a unit of
             * 0.015, which is 2 more. */
            IH_TEST_WITHIN(2.5 / 65536, v->sample[k].x, ih_test_from_q(sample->x_q16, 16), "x", k);
            IH_TEST_WITHIN(2.5 / 65536, v->sample[k].y, ih_test_from_q(sample->y_q16, 16), "y", k);
        }
        IH_TEST_UNTOUCHED(&samples.sample[samples.sample_count],
                          (size_t)(IH_SLOTS - samples.sample_count) * sizeof samples.sample[0],
                          "beyond the last sample");
    }
}

static void a_flat_wall_passes_whole(void)
{
    int32_t slot;

    select_samples();
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS, samples.sample_count);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS, samples.seen_count);
    TEST_ASSERT_EQUAL_INT32(0,
                            samples.filled_count + samples.isolated_count + samples.outside_count);
    TEST_ASSERT_EQUAL_INT32(1000 << 8, samples.nearest_mm_q8);
    TEST_ASSERT_EQUAL_INT32(1400 << 8, samples.clip_mm_q8);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        TEST_ASSERT_EQUAL_INT32(slot, samples.sample[slot].slot);
        TEST_ASSERT_EQUAL_INT32((slot % IH_GRID - 9) * 2 * 65536, samples.sample[slot].x_q16);
        TEST_ASSERT_EQUAL_INT32((slot / IH_GRID - 9) * 2 * 65536, samples.sample[slot].y_q16);
        TEST_ASSERT_EQUAL_INT32(32768, samples.sample[slot].root_weight_q15);
    }
}

static void a_point_far_from_all_neighbours_is_dropped(void)
{
    set_depth(MIDDLE, 1000 - 61);
    select_samples();
    TEST_ASSERT_EQUAL_INT32(1, samples.isolated_count);
    TEST_ASSERT_NULL(sample_of(MIDDLE));
    set_depth(MIDDLE, 1000 - 60); /* not more than isolated_mm */
    select_samples();
    TEST_ASSERT_EQUAL_INT32(0, samples.isolated_count);
    TEST_ASSERT_EQUAL_INT32(940 << 8, samples.nearest_mm_q8);
}

/* One friend is not enough, two are. */
static void a_pair_is_dropped_and_three_in_a_row_lose_their_ends(void)
{
    set_depth(MIDDLE, 800);
    set_depth(MIDDLE + 1, 800);
    select_samples();
    TEST_ASSERT_EQUAL_INT32(2, samples.isolated_count);
    set_depth(MIDDLE + 2, 800); /* the middle one of three now has two friends */
    select_samples();
    TEST_ASSERT_EQUAL_INT32(2, samples.isolated_count);
    TEST_ASSERT_NOT_NULL(sample_of(MIDDLE + 1));
    TEST_ASSERT_NULL(sample_of(MIDDLE));
    set_depth(MIDDLE + IH_GRID, 800);
    set_depth(MIDDLE + IH_GRID + 2, 800);
    select_samples();
    TEST_ASSERT_EQUAL_INT32(0, samples.isolated_count);
}

/* With fewer than three neighbours seen nothing can be said. */
static void a_point_with_two_neighbours_is_kept(void)
{
    set_depth(0, 800); /* a corner has three neighbours */
    select_samples();
    TEST_ASSERT_EQUAL_INT32(1, samples.isolated_count);
    set_missing(1);
    select_samples();
    TEST_ASSERT_EQUAL_INT32(0, samples.isolated_count);
    TEST_ASSERT_NOT_NULL(sample_of(0));
}

/* Rows do not wrap: the last slot of a row and the first of the next are no neighbours. */
static void the_ends_of_rows_are_not_neighbours(void)
{
    int32_t row;

    for (row = 0; row < IH_GRID; row++) { /* the left column near, so that it agrees with itself */
        set_depth(row * IH_GRID, 800);
    }
    set_depth(4 * IH_GRID + 18, 800); /* its neighbours beyond the edge would be 800 too */
    select_samples();
    TEST_ASSERT_NULL(sample_of(4 * IH_GRID + 18));
    /* The column's two ends have one friend among three neighbours and go as well. */
    TEST_ASSERT_EQUAL_INT32(3, samples.isolated_count);
    TEST_ASSERT_NULL(sample_of(0));
    TEST_ASSERT_NOT_NULL(sample_of(IH_GRID));
}

static void depths_are_clipped_behind_the_nearest(void)
{
    int32_t slot;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        set_depth(slot, slot < 29 ? 700 : 2500);
    }
    select_samples(); /* 361 * 8 / 100 = 28: the 29th of the sorted depths, 700 */
    TEST_ASSERT_EQUAL_INT32(1100 << 8, samples.clip_mm_q8);
    set_depth(28, 2500); /* 28 are left: the 29th is 2500 */
    select_samples();
    TEST_ASSERT_EQUAL_INT32(2900 << 8, samples.clip_mm_q8);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        set_depth(slot, slot < 100 ? 800 : 2500);
    }
    select_samples();
    TEST_ASSERT_EQUAL_INT32(1200 << 8, samples.clip_mm_q8);
    TEST_ASSERT_EQUAL_INT32(1200 << 8, sample_of(300)->depth_mm_q8);
    TEST_ASSERT_EQUAL_INT32(800 << 8, sample_of(50)->depth_mm_q8);
}

/* A hole of n x n slots around the middle. */
static void make_hole(int32_t half)
{
    int32_t row, column;

    for (row = -half; row <= half; row++) {
        for (column = -half; column <= half; column++) {
            set_missing(MIDDLE + row * IH_GRID + column);
        }
    }
}

/* In a hole of 5 x 5 the inner 3 x 3 have no seen neighbour; corners have five, sides three. */
static void only_the_inside_of_a_hole_is_filled(void)
{
    make_hole(2);
    select_samples();
    TEST_ASSERT_EQUAL_INT32(9, samples.filled_count);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS - 25, samples.seen_count);
    TEST_ASSERT_NOT_NULL(sample_of(MIDDLE + IH_GRID + 1));
    TEST_ASSERT_NULL(sample_of(MIDDLE + 2 * IH_GRID));
    TEST_ASSERT_NULL(sample_of(MIDDLE + 2 * IH_GRID + 2));
    params.fill_neighbours = 4; /* the sides' three seen neighbours are fewer than that */
    select_samples();
    TEST_ASSERT_EQUAL_INT32(9 + 12, samples.filled_count);
    params.fill_neighbours = 0;
    select_samples();
    TEST_ASSERT_EQUAL_INT32(0, samples.filled_count);
}

static void a_filled_point_stands_on_its_ray_at_the_clip_depth(void)
{
    const struct ih_sample *sample;
    double unit, u;

    make_hole(2);
    params.fill_root_weight_q15 = 12345;
    select_samples();
    sample = sample_of(MIDDLE);
    TEST_ASSERT_NOT_NULL(sample);
    TEST_ASSERT_EQUAL_INT32(1400 << 8, sample->depth_mm_q8);
    TEST_ASSERT_EQUAL_INT32(12345, sample->root_weight_q15);
    /* X / Z of the ray from the projector, at 1400 mm. */
    u = (vector_rigs[0].origin_mm_q16[0] / 65536.0 +
         (1400 - vector_rigs[0].origin_mm_q16[2] / 65536.0) * vector_rigs[0].ray_q30[MIDDLE][0] /
             vector_rigs[0].ray_q30[MIDDLE][2]) /
        1400;
    unit = ih_test_from_q(vector_field.unit_q28, 28);
    IH_TEST_WITHIN(3.0 / 65536, (u - ih_test_from_q(vector_field.centre_x_q28, 28)) / unit,
                   ih_test_from_q(sample->x_q16, 16), "x", 0);
}

static void over_exposed_and_unknown_places_are_not_filled(void)
{
    make_hole(2);
    memset(dots.bright, 0xFF, sizeof dots.bright);
    select_samples();
    TEST_ASSERT_EQUAL_INT32(0, samples.filled_count);
    memset(dots.bright, 0, sizeof dots.bright);
    points.point[MIDDLE].state = IH_POINT_UNKNOWN;
    select_samples();
    TEST_ASSERT_EQUAL_INT32(8, samples.filled_count);
    TEST_ASSERT_NULL(sample_of(MIDDLE));
}

static void without_weight_nothing_is_filled(void)
{
    make_hole(2);
    params.fill_root_weight_q15 = 0;
    select_samples();
    TEST_ASSERT_EQUAL_INT32(0, samples.filled_count);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS - 25, samples.sample_count);
}

/* The frame ends at the outer pixels' centres: dots beyond are not missing but out of sight. */
static void places_outside_the_picture_are_not_filled(void)
{
    int32_t slot;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        set_missing(slot);
    }
    select_samples();
    TEST_ASSERT_TRUE(samples.filled_count > 300);
    rig.calibration.width = 376; /* only the left half is left */
    select_samples();
    TEST_ASSERT_TRUE(samples.filled_count > 150 && samples.filled_count < 210);
}

static void without_points_there_are_no_samples(void)
{
    int32_t slot;

    for (slot = 0; slot < IH_SLOTS; slot++) {
        set_missing(slot);
        points.point[slot].state = IH_POINT_UNKNOWN;
    }
    select_samples();
    TEST_ASSERT_EQUAL_INT32(0, samples.sample_count);
    TEST_ASSERT_EQUAL_INT32(params.clip_min_mm << 8, samples.clip_mm_q8);
}

static void what_is_too_far_from_the_field_is_dropped(void)
{
    const int32_t unit = vector_field.unit_q28;

    points.point[0].x_q28 = vector_field.centre_x_q28 + 39 * unit;
    points.point[1].x_q28 = vector_field.centre_x_q28 + 40 * unit;
    points.point[2].y_q28 = vector_field.centre_y_q28 - 40 * unit;
    points.point[3].y_q28 = INT32_MIN;
    points.point[4].x_q28 = INT32_MAX;
    select_samples();
    TEST_ASSERT_EQUAL_INT32(4, samples.outside_count);
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS - 4, samples.sample_count);
    TEST_ASSERT_NOT_NULL(sample_of(0));
    TEST_ASSERT_NULL(sample_of(1));
}

/* A range image has no map of over-exposed blocks and no rays: missing points stand where they
 * are. */
static void a_range_rig_fills_at_the_lattice_point(void)
{
    struct ih_calibration calibration = vector_rigs[0];
    int32_t bad_slot;

    calibration.kind = IH_RIG_RANGE;
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &calibration, &bad_slot));
    make_hole(2);
    ih_samples_select(&points, NULL, &rig, &params, &samples);
    TEST_ASSERT_EQUAL_INT32(9, samples.filled_count);
    TEST_ASSERT_EQUAL_INT32(0, sample_of(MIDDLE)->x_q16);
    TEST_ASSERT_EQUAL_INT32(2 << 16, sample_of(MIDDLE + 1)->x_q16);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(samples_match_the_second_implementation);
    RUN_TEST(a_flat_wall_passes_whole);
    RUN_TEST(a_point_far_from_all_neighbours_is_dropped);
    RUN_TEST(a_pair_is_dropped_and_three_in_a_row_lose_their_ends);
    RUN_TEST(a_point_with_two_neighbours_is_kept);
    RUN_TEST(the_ends_of_rows_are_not_neighbours);
    RUN_TEST(depths_are_clipped_behind_the_nearest);
    RUN_TEST(only_the_inside_of_a_hole_is_filled);
    RUN_TEST(a_filled_point_stands_on_its_ray_at_the_clip_depth);
    RUN_TEST(over_exposed_and_unknown_places_are_not_filled);
    RUN_TEST(without_weight_nothing_is_filled);
    RUN_TEST(places_outside_the_picture_are_not_filled);
    RUN_TEST(without_points_there_are_no_samples);
    RUN_TEST(what_is_too_far_from_the_field_is_dropped);
    RUN_TEST(a_range_rig_fills_at_the_lattice_point);
    return UNITY_END();
}
