/* Labels of any subset of the true dots, their centres off as measured ones are.
 *
 * A dot gets no label but those of slots whose line it lies on. With the paper's short baseline that is
 * one slot, whatever is missing: none is ever labelled wrongly. With a long baseline it may be several,
 * and where the true dot of one of them is missing another may be taken for it: there the fraction of wrong
 * labels is bounded, no more. */
#include "labels/ih_labels.h"
#include "prop_scene.h"

#include "rigs.inc"

/* Of a centre, per axis: a median of 0.15 px off, where rendered frames have 0.13 (README). */
#define SIGMA_PX 0.13

static struct ih_rig rig;
static struct ih_labels_params params;
static struct ih_labels_scratch scratch;
static struct ih_dot_rows rows;
static struct ih_labels labels;
static struct ih_dots all, dots;
static int16_t slot_of_all[IH_DOTS_MAX], slot_of_dot[IH_DOTS_MAX];

struct label_counts {
    int64_t dots, right, wrong;
    int64_t candidates; /* of slots, as many as there are for all dots */
};

void setUp(void)
{
    ih_labels_params_default(&params);
}

void tearDown(void)
{
}

static void take_subset(struct ih_test_random *random, double fraction)
{
    dots.dot_count = 0;
    for (int32_t i = 0; i < all.dot_count; i++) {
        if (ih_test_unit(random) < fraction) {
            slot_of_dot[dots.dot_count] = slot_of_all[i];
            dots.dot[dots.dot_count++] = all.dot[i];
        }
    }
}

/* Labels of one subset; the missing ones are what is left of dots. */
static struct label_counts count(void)
{
    struct label_counts counts = {dots.dot_count, 0, 0, 0};

    ih_dot_rows_fill(&dots, &rig, &rows);
    ih_labels_assign(&dots, &rows, &rig, &params, &scratch, &labels);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int32_t dot = labels.dot_of_slot[slot];

        counts.candidates += scratch.candidate_count[slot];
        if (dot != IH_NONE) {
            counts.right += slot_of_dot[dot] == slot;
            counts.wrong += slot_of_dot[dot] != slot;
        }
    }
    IH_TEST_EQUAL(labels.labelled_count, counts.right + counts.wrong, "labels", 0);
    return counts;
}

/* min, max: fraction of the dots that are left. */
static struct label_counts try_subsets(int which, uint64_t seed, int32_t seeds, double min,
                                       double max)
{
    struct ih_test_random random = {seed};
    struct label_counts sum = {0, 0, 0, 0};
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[which], &bad_slot));
    for (int32_t i = 0; i < seeds; i++) {
        const struct prop_scene scene = prop_random_person(&random, 150);

        prop_dots(&scene, &vector_rigs[which], &random, SIGMA_PX, &all, slot_of_all);
        take_subset(&random, min + (max - min) * ih_test_unit(&random));
        const struct label_counts one = count();

        sum.dots += one.dots;
        sum.right += one.right;
        sum.wrong += one.wrong;
        sum.candidates += one.candidates;
    }
    printf("labels: rig %d, %3.0f to %3.0f %% of the dots left: %lld dots, %.2f %% labelled right, "
           "%.3f %% wrong; %.2f slots that a dot may belong to\n",
           which, 100 * min, 100 * max, (long long)sum.dots,
           100.0 * (double)sum.right / (double)sum.dots,
           100.0 * (double)sum.wrong / (double)sum.dots, (double)sum.candidates / (double)sum.dots);
    return sum;
}

/* The paper's rig of 12.5 mm, and 36 mm at 1280 x 800. Missing ones: without neighbours there is no
 * telling, from half of the dots on nearly all are found. */
static void with_a_short_baseline_no_subset_has_a_wrong_label(void)
{
    static const int short_rigs[] = {0, 3};

    for (int i = 0; i < IH_TEST_COUNT(short_rigs); i++) {
        const struct label_counts few = try_subsets(short_rigs[i], 701, prop_seeds(250), 0, 0.5);
        const struct label_counts many = try_subsets(short_rigs[i], 702, prop_seeds(250), 0.5, 0.8);
        const struct label_counts max = try_subsets(short_rigs[i], 703, prop_seeds(250), 0.8, 1);

        TEST_ASSERT_EQUAL_INT64(0, few.wrong + many.wrong + max.wrong);
        TEST_ASSERT_LESS_OR_EQUAL_INT64(max.dots, max.candidates);
        TEST_ASSERT_GREATER_OR_EQUAL_INT64(many.dots * 97 / 100, many.right);
        TEST_ASSERT_GREATER_OR_EQUAL_INT64(max.dots * 995 / 1000, max.right);
    }
}

/* 125 mm: bounds are twice what other seeds gave: 1.4, 1.8, 0.5 and 0.08 %. */
static void with_a_long_baseline_few_labels_are_wrong(void)
{
    const struct label_counts few = try_subsets(1, 711, prop_seeds(150), 0, 0.5);
    const struct label_counts many = try_subsets(1, 712, prop_seeds(150), 0.5, 0.8);
    const struct label_counts max = try_subsets(1, 713, prop_seeds(150), 0.8, 1);
    const struct label_counts every = try_subsets(1, 714, prop_seeds(150), 1, 1);

    TEST_ASSERT_LESS_OR_EQUAL_INT64(few.dots * 35 / 1000, few.wrong);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(many.dots * 35 / 1000, many.wrong);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(max.dots * 10 / 1000, max.wrong);
    TEST_ASSERT_LESS_OR_EQUAL_INT64(every.dots * 2 / 1000, every.wrong);
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(every.dots * 99 / 100, every.right);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(with_a_short_baseline_no_subset_has_a_wrong_label);
    RUN_TEST(with_a_long_baseline_few_labels_are_wrong);
    return UNITY_END();
}
