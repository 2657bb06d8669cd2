/* A person moved sideways or up and down: the head that is found moves by the same.
 *
 * Bounds. Across: both sides of a head stand before the wall, each outline known to within half the pitch
 * of the dots, so the middle between them too; of two positions the errors differ by at most a pitch. Up and
 * down: the head goes on into the neck, and the fit has a second, lower optimum there. Whichever it takes,
 * two centres within spacing_mm are the same head to the method (ih_detections), no more is promised. Mostly
 * both fits are in the upper one, and the error is that of a dot's depth, a millimetre or two. */
#include "isohead.h"
#include "prop_scene.h"

#include <stdlib.h>

#include "rigs.inc"

#define SCENES_MAX 2000
#define FOUND_MIN 0.6
/* Half of all scenes move the head by what they moved themselves to within this, along each axis. */
#define MEDIAN_MM 2.5

static struct isohead head;
static uint8_t grey[IH_FRAME_WIDTH_MAX * IH_FRAME_HEIGHT_MAX];
static uint16_t depth_mm[IH_FRAME_WIDTH_MAX * IH_FRAME_HEIGHT_MAX];
static double off_mm[3][SCENES_MAX];
static struct ih_test_random random_source;

void setUp(void)
{
}

void tearDown(void)
{
}

/* The head in a frame of its own; false: none is selected. */
static bool find(const struct prop_scene *scene, const struct ih_calibration *c,
                 double centre_mm[3])
{
    struct ih_frame frame;
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, isohead_init(&head, c, &bad_slot));
    if (c->kind == IH_RIG_DOTS) {
        prop_paint(scene, c, &random_source, grey, &frame);
    } else {
        prop_paint_range(scene, c, depth_mm, &frame);
    }
    TEST_ASSERT_EQUAL_INT(IH_OK, isohead_frame(&head, &frame, NULL, 0));
    for (int axis = 0; axis < 3 && head.result.selected != IH_NONE; axis++) {
        centre_mm[axis] =
            ih_test_from_q(head.result.entry[head.result.selected].centre_mm_q8[axis], 8);
    }
    return head.result.selected != IH_NONE;
}

static int compare(const void *a, const void *b)
{
    return *(const double *)a < *(const double *)b ? -1 : *(const double *)a > *(const double *)b;
}

static double random_between(double low, double high)
{
    return low + (high - low) * ih_test_unit(&random_source);
}

/* The dots' pitch at a depth, mm: two units of the field. */
static double pitch_mm(const struct ih_calibration *c, double at_mm)
{
    struct ih_rig rig;
    int32_t bad_slot;

    if (c->kind == IH_RIG_RANGE) {
        return 26;
    }
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, c, &bad_slot));
    return 2 * ih_test_from_q(rig.field.unit_q28, 28) * at_mm;
}

static void check(const struct ih_calibration *c, const char *name, uint64_t seed, int32_t scenes)
{
    int32_t found = 0;

    random_source.state = seed;
    TEST_ASSERT_LESS_OR_EQUAL_INT32(SCENES_MAX, scenes);
    for (int32_t i = 0; i < scenes; i++) {
        const double z = random_between(750, 1000);
        const struct prop_scene scene =
            prop_person(random_between(-40, 40), random_between(-20, 40), z,
                        random_between(0.9, 1.1), z + random_between(400, 1200));
        const double by_mm[3] = {random_between(-40, 40), random_between(-40, 40), 0};
        const struct prop_scene moved = prop_moved(&scene, by_mm);
        double before[3], after[3];

        if (!find(&scene, c, before) || !find(&moved, c, after)) {
            continue;
        }
        for (int axis = 0; axis < 3; axis++) {
            off_mm[axis][found] = fabs(after[axis] - before[axis] - by_mm[axis]);
        }
        IH_TEST_WITHIN(pitch_mm(c, z), 0, off_mm[0][found], name, i);
        IH_TEST_WITHIN(head.params.detections.spacing_mm, 0, off_mm[1][found], name, i);
        IH_TEST_WITHIN(head.params.detections.spacing_mm, 0, off_mm[2][found], name, i);
        found++;
    }
    IH_TEST_RANGE((int64_t)(FOUND_MIN * scenes), scenes, found, name, scenes);
    printf("shift: %s, %d scenes, found in both %d; off by mm, median and worst:", name,
           (int)scenes, (int)found);
    for (int axis = 0; axis < 3; axis++) {
        qsort(off_mm[axis], (size_t)found, sizeof off_mm[axis][0], compare);
        printf(" %c %.1f %.1f", "xyz"[axis], off_mm[axis][found / 2], off_mm[axis][found - 1]);
        IH_TEST_WITHIN(MEDIAN_MM, 0, off_mm[axis][found / 2], name, axis);
    }
    printf("\n");
}

static void a_shifted_scene_shifts_the_head(void)
{
    struct ih_calibration range;

    prop_range_rig(&range, 640, 480, 525);
    check(&vector_rigs[0], "12.5 mm baseline", 801, prop_seeds(80));
    check(&vector_rigs[1], "125 mm baseline", 802, prop_seeds(80));
    check(&range, "depth camera", 803, prop_seeds(80));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_shifted_scene_shifts_the_head);
    return UNITY_END();
}
