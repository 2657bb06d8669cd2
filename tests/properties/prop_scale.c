/* A scene twice as far gives the same hypotheses at half the size. What is true of it:
 *
 * 1. Nothing but the pattern's geometry decides labels: a world in which all lengths are twice as long, the
 *    baseline among them, gives the same picture, the same labels, and depths twice as great.
 * 2. Levels, areas and extents are mm, and so is the lattice that is laid over a depth image. A surface of
 *    the same shape in mm, twice as far, with grid steps half as wide in the picture, has the same contours
 *    and ellipses to the bit, in steps: half the size in pixels. Their areas in mm^2 differ by what
 *    perspective does: the step's width grows with the level's depth, by a part that is less the farther
 *    away the scene is.
 * 3. So a depth camera sees the same head twice as far away at half the size, as near as its pixels,
 *    which are twice as wide there, allow.
 * Not invariant: a rig's dots, twice as far apart on a head twice as far; clip_min_mm, 1100. */
#include "base/ih_fix.h"
#include "isohead.h"
#include "prop_scene.h"

#include "rigs.inc"

#define SIDE IH_SURFACE_GRID
#define UNIT_Q28 4000000 /* half a pitch: 13 mm at 870 mm */
/* Of a width in mm: what the fit's prior takes for one standard deviation. */
#define SIZE_PERCENT 9
#define FOUND_MIN 0.8

static struct ih_test_random random_source;

void setUp(void)
{
}

void tearDown(void)
{
}

static double random_between(double low, double high)
{
    return low + (high - low) * ih_test_unit(&random_source);
}

/* --- 1: all lengths twice as long ---------------------------------------------------------------- */

static struct ih_rig one_rig, two_rig;
static struct ih_dots dots;
static int16_t slot_of_dot[IH_DOTS_MAX];
static struct ih_labels_scratch labels_scratch;
static struct ih_dot_rows rows;
static struct ih_labels one_labels, two_labels;
static struct ih_points one_points, two_points;

static void make_twice(const struct ih_calibration *c, struct ih_calibration *out)
{
    *out = *c;
    out->near_mm *= 2;
    out->far_mm *= 2;
    for (int axis = 0; axis < 3; axis++) {
        out->origin_mm_q16[axis] *= 2;
    }
}

/* The dots that the large world shows, with the large rig, are those of the small one. */
static void check_twice(const struct ih_calibration *c, int32_t seed)
{
    const struct prop_scene scene = prop_random_person(&random_source, 100);
    const struct prop_scene large = prop_scaled(&scene, 2);
    struct ih_calibration twice;
    struct ih_labels_params params;
    int32_t bad_slot;

    make_twice(c, &twice);
    ih_labels_params_default(&params);
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&one_rig, c, &bad_slot));
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&two_rig, &twice, &bad_slot));
    prop_dots(&scene, c, &random_source, 0, &dots, slot_of_dot);
    ih_dot_rows_fill(&dots, &one_rig, &rows);
    ih_labels_assign(&dots, &rows, &one_rig, &params, &labels_scratch, &one_labels);
    prop_dots(&large, &twice, &random_source, 0, &dots, slot_of_dot);
    ih_dot_rows_fill(&dots, &two_rig, &rows);
    ih_labels_assign(&dots, &rows, &two_rig, &params, &labels_scratch, &two_labels);
    TEST_ASSERT_GREATER_THAN_INT32(150, one_labels.labelled_count);
    ih_points_from_labels(&one_labels, &one_rig, &one_points);
    ih_points_from_labels(&two_labels, &two_rig, &two_points);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const double depth = ih_test_from_q(one_points.point[slot].depth_mm_q8, 8);
        const double length = ih_test_from_q(one_rig.line[slot].length_px_mm_q8, 8);

        IH_TEST_EQUAL(one_labels.dot_of_slot[slot], two_labels.dot_of_slot[slot], "label", seed);
        /* The positions of a dot and of its line are rounded to Q12: 4 steps of t, Z^2 / length each. */
        IH_TEST_WITHIN(2 * 4 * depth * depth / length / 4096 + 0.02, 2 * depth,
                       ih_test_from_q(two_points.point[slot].depth_mm_q8, 8), "depth", slot);
    }
}

static void a_world_twice_as_large_looks_the_same(void)
{
    const int32_t seeds = prop_seeds(40);

    random_source.state = 1001;
    for (int32_t seed = 0; seed < seeds; seed++) {
        check_twice(&vector_rigs[seed % 2], seed);
    }
    printf("scale: %d worlds twice as large\n", (int)seeds);
}

/* --- 2: a surface twice as far ------------------------------------------------------------------- */

static struct ih_surface surfaces[2];
static struct ih_nests found[2];
static struct ih_nests_scratch scratch;

/* A head, and waves around it; at a distance, on steps of a width. */
static void make_surface(const double shape[6], int32_t distance_mm, int32_t unit_q28,
                         struct ih_surface *out)
{
    memset(out, 0, sizeof *out);
    out->valid = true;
    out->field.unit_q28 = unit_q28;
    out->nearest_mm_q8 = INT32_MAX;
    for (int32_t y = 0; y < SIDE; y++) {
        for (int32_t x = 0; x < SIDE; x++) {
            const double dx = (x - shape[0]) / shape[2], dy = (y - shape[1]) / shape[3];
            const double wave = 8 * sin(x / shape[4]) * cos(y / shape[5]);
            const double bent = 90 * (dx * dx + dy * dy);
            const double relief = (bent < 250 ? bent : 250) + wave;

            out->depth_mm_q8[y][x] = (distance_mm << 8) + (int32_t)lround(relief * 256);
            out->nearest_mm_q8 = ih_min_s32(out->nearest_mm_q8, out->depth_mm_q8[y][x]);
        }
    }
}

/* Slices of one level: the same ellipse, and an area that differs by perspective alone. */
static int32_t compare_nests(const struct ih_nest *one, const struct ih_nest *two, int32_t seed)
{
    int32_t compared = 0;

    for (int32_t i = 0; i < one->slice_count; i++) {
        for (int32_t k = 0; k < two->slice_count; k++) {
            const int32_t near = one->front_mm_q8 + one->slice[i].behind_mm_q8;
            const int32_t far = two->front_mm_q8 + two->slice[k].behind_mm_q8;

            if (near - one->nearest_mm_q8 != far - two->nearest_mm_q8) {
                continue;
            }
            const double ratio = (double)far / (2.0 * near);
            const double area = one->slice[i].area_mm2 * ratio * ratio;

            TEST_ASSERT_EQUAL_MEMORY(&one->slice[i].ellipse, &two->slice[k].ellipse,
                                     sizeof one->slice[i].ellipse);
            IH_TEST_EQUAL(one->slice[i].whole, two->slice[k].whole, "whole", seed);
            IH_TEST_WITHIN(2 + area * 1e-4, area, two->slice[k].area_mm2, "area", seed);
            compared++;
        }
    }
    return compared;
}

/* How many slices were compared. */
static int32_t compare_surfaces(const struct ih_nests_params *params, int32_t seeds)
{
    int32_t compared = 0;

    random_source.state = 1002;
    for (int32_t seed = 0; seed < seeds; seed++) {
        const int32_t distance_mm = (int32_t)random_between(500, 1500);
        const double shape[6] = {random_between(15, 30), random_between(15, 30),
                                 random_between(5, 9),   random_between(6, 11),
                                 random_between(3, 9),   random_between(3, 9)};

        make_surface(shape, distance_mm, UNIT_Q28, &surfaces[0]);
        make_surface(shape, 2 * distance_mm, UNIT_Q28 / 2, &surfaces[1]);
        for (int i = 0; i < 2; i++) {
            ih_nests_find(&surfaces[i], params, &scratch, &found[i]);
        }
        IH_TEST_EQUAL(found[0].nest_count, found[1].nest_count, "nests", seed);
        for (int32_t i = 0; i < found[0].nest_count; i++) {
            TEST_ASSERT_EQUAL_MEMORY(&found[0].nest[i].minimum, &found[1].nest[i].minimum,
                                     sizeof found[0].nest[i].minimum);
            compared += compare_nests(&found[0].nest[i], &found[1].nest[i], seed);
        }
    }
    printf("scale: %d surfaces twice as far, %d slices compared\n", (int)seeds, (int)compared);
    return compared;
}

/* By default levels are twice as far apart, and nests fewer and shorter. */
static void a_surface_twice_as_far_has_the_same_ellipses(void)
{
    const int32_t seeds = prop_seeds(40);
    struct ih_nests_params params;

    ih_nests_params_paper(&params);
    TEST_ASSERT_GREATER_THAN_INT32(4 * seeds, compare_surfaces(&params, seeds));
    ih_nests_params_default(&params);
    TEST_ASSERT_GREATER_THAN_INT32(2 * seeds, compare_surfaces(&params, seeds));
}

/* --- 3: a depth camera --------------------------------------------------------------------------- */

static struct isohead head;
static uint16_t depth_mm[IH_FRAME_WIDTH_MAX * IH_FRAME_HEIGHT_MAX];

static const struct ih_result_entry *look(const struct prop_scene *scene,
                                          const struct ih_calibration *c)
{
    struct ih_frame frame;
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, isohead_init(&head, c, &bad_slot));
    prop_paint_range(scene, c, depth_mm, &frame);
    TEST_ASSERT_EQUAL_INT(IH_OK, isohead_frame(&head, &frame, NULL, 0));
    return head.result.selected == IH_NONE ? NULL : &head.result.entry[head.result.selected];
}

static void a_person_twice_as_far_is_half_the_size(void)
{
    const int32_t seeds = prop_seeds(15);
    int32_t both = 0;
    double off_sum_mm = 0, worst_percent = 0;
    struct ih_calibration c;

    prop_range_rig(&c, 640, 480, 525);
    random_source.state = 1003;
    for (int32_t seed = 0; seed < seeds; seed++) {
        const double z = random_between(750, 1000);
        const struct prop_scene scene =
            prop_person(random_between(-60, 60), random_between(-40, 40), z,
                        random_between(0.95, 1.05), z + 800);
        const double away[3] = {0, 0, z};
        const struct prop_scene far = prop_moved(&scene, away);
        const struct ih_result_entry *entry = look(&scene, &c);
        struct ih_result_entry near;

        if (entry == NULL) {
            continue;
        }
        near = *entry;
        entry = look(&far, &c);
        if (entry == NULL) {
            continue;
        }
        both++;
        for (int axis = 0; axis < 3; axis++) {
            const double off = ih_test_from_q(entry->centre_mm_q8[axis], 8) -
                               ih_test_from_q(near.centre_mm_q8[axis], 8) - away[axis];

            IH_TEST_WITHIN(head.params.detections.spacing_mm, 0, off, "centre", seed);
            off_sum_mm += fabs(off) / 3;
        }
        /* The sizes of both in mm: pixels times the centre's depth over the focal length. */
        const double near_a = ih_test_from_q(near.b_px_q12, 12) * near.centre_mm_q8[2];
        const double far_a = ih_test_from_q(entry->b_px_q12, 12) * entry->centre_mm_q8[2];
        const double percent = 100 * fabs(far_a / near_a - 1);

        worst_percent = percent > worst_percent ? percent : worst_percent;
        IH_TEST_WITHIN(SIZE_PERCENT, 0, percent, "width in mm, percent", seed);
    }
    printf("scale: %d of %d persons found at both distances, centres off by %.1f mm (mean), width "
           "in mm "
           "by %.1f %% at most\n",
           (int)both, (int)seeds, off_sum_mm / both, worst_percent);
    IH_TEST_RANGE((int64_t)(FOUND_MIN * seeds), seeds, both, "persons found", 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_world_twice_as_large_looks_the_same);
    RUN_TEST(a_surface_twice_as_far_has_the_same_ellipses);
    RUN_TEST(a_person_twice_as_far_is_half_the_size);
    return UNITY_END();
}
