/* ih_health on dots of rotated projectors, labelled by the core as it goes. */
#include "labels/ih_labels.h"
#include "upkeep/ih_health.h"
#include "upkeep/ih_rotation_vote.h"

#include <stdlib.h>

#include "ih_test.h"
#include "rigs.inc"
#include "rotated_rig.h"

#define WALL_MM 1200.0
#define FRAMES_TO_FIND 50
#define FRAMES_TO_SETTLE 20
#define PEACE_FRAMES 470

static struct ih_rig rig, before;
static struct ih_labels_params params;
static struct ih_labels_scratch labels_scratch;
static struct ih_labels labels;
static struct ih_dots dots;
static struct ih_health health;
static struct ih_health_scratch scratch;
static struct ih_calibration wrong;
static struct ih_test_random random_source;
static int changed_count;

static const double straight_deg[3] = {0, 0, 0};

void setUp(void)
{
    random_source.state = 81;
    changed_count = 0;
    ih_labels_params_default(&params);
    memset(&health, IH_TEST_FILL, sizeof health);
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
}

void tearDown(void)
{
}

static void use_calibration(const struct ih_calibration *calibration)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, calibration, &bad_slot));
    before = rig;
    ih_health_init(&health, &rig);
}

static void look(void)
{
    ih_labels_assign(&dots, &rig, &params, &labels_scratch, &labels);
    changed_count += ih_health_frame(&health, &dots, &labels, &rig, &scratch);
}

static void run(const struct ih_calibration *seen, const double rotation_deg[3], int frames)
{
    for (int i = 0; i < frames; i++) {
        see_dots(seen, rotation_deg, WALL_MM, 0.1, &random_source, &dots);
        look();
    }
}

static void assert_untouched(void)
{
    TEST_ASSERT_EQUAL_INT(0, changed_count);
    TEST_ASSERT_EQUAL_MEMORY(&before, &rig, sizeof rig);
}

/* The weak axis (Y: both baselines are horizontal) within 0.02 degrees: 0.3 px of a dot's depth. */
static void assert_rotation(const double rotation_deg[3], int index)
{
    static const double limit_deg[3] = {0.002, 0.02, 0.006};

    for (int axis = 0; axis < 3; axis++) {
        IH_TEST_WITHIN(limit_deg[axis], rotation_deg[axis],
                       health.rotation_rad_q30[axis] / Q30 / DEG, "turn", 10 * index + axis);
    }
    TEST_ASSERT_EQUAL_INT(IH_HEALTH_ROTATED, health.state);
}

static void a_rig_that_fits_is_left_alone(void)
{
    for (int which = 0; which < 2; which++) {
        use_calibration(&vector_rigs[which]);
        TEST_ASSERT_EQUAL_INT(IH_HEALTH_UNKNOWN, health.state);
        run(&vector_rigs[which], straight_deg, 300);
        TEST_ASSERT_EQUAL_INT(IH_HEALTH_FITS, health.state);
        assert_untouched();
        /* Mean size of what is normal with sigma 0.1: 0.08. */
        IH_TEST_WITHIN(0.02, 0.08, health.across_px_q12 / 4096.0, "across", which);
    }
}

static void a_knock_is_found_within_fifty_frames(void)
{
    static const double rotations_deg[][3] = {
        {0.3, 0, 0},        {-0.3, 0, 0},     {0, 0.3, 0},      {0, 0, -0.3},
        {0.17, -0.2, 0.15}, {-0.2, 0.2, 0.1}, {0.5, 0.1, -0.3}, {0.05, 0, 0}};

    for (int which = 0; which < 2; which++) {
        for (int i = 0; i < IH_TEST_COUNT(rotations_deg); i++) {
            use_calibration(&vector_rigs[which]);
            run(&vector_rigs[which], rotations_deg[i], FRAMES_TO_FIND);
            assert_rotation(rotations_deg[i], 10 * which + i);
            TEST_ASSERT_GREATER_THAN_INT32(health.dot_count * 3 / 4, health.labelled_count);
        }
    }
}

/* Only dots of the middle row and columns. */
static void run_middle(const double rotation_deg[3], int frames)
{
    for (int frame = 0; frame < frames; frame++) {
        see_dots(&vector_rigs[0], rotation_deg, WALL_MM, 0.1, &random_source, &dots);
        TEST_ASSERT_EQUAL_INT32(IH_SLOTS, dots.dot_count);
        dots.dot_count = 0;
        for (int slot = 0; slot < IH_SLOTS; slot++) {
            int row = slot / IH_GRID - IH_GRID / 2;
            int column = slot % IH_GRID - IH_GRID / 2;
            if (row == 0 || abs(column) <= 1) {
                dots.dot[dots.dot_count++] = dots.dot[slot];
            }
        }
        look();
    }
}

/* Dots of the middle row and columns hardly show a turn about Y. Nothing that votes made up of it may stay, and it
 * is said. */
static void what_dots_do_not_show_is_not_taken(void)
{
    static const double rotations_deg[][3] = {{0.3, 0, 0}, {-0.2, 0.2, 0}, {0.15, -0.3, 0}};

    for (int i = 0; i < IH_TEST_COUNT(rotations_deg); i++) {
        use_calibration(&vector_rigs[0]);
        run_middle(rotations_deg[i], 2 * FRAMES_TO_FIND);
        TEST_ASSERT_EQUAL_INT(IH_HEALTH_ROTATED, health.state);
        TEST_ASSERT_FALSE(health.is_weak_known);
        IH_TEST_WITHIN(0.003, rotations_deg[i][0], health.rotation_rad_q30[0] / Q30 / DEG, "turn",
                       i);
        IH_TEST_WITHIN(0.001, 0, health.rotation_rad_q30[1] / Q30 / DEG, "across", i);
        IH_TEST_WITHIN(0.01, rotations_deg[i][2], health.rotation_rad_q30[2] / Q30 / DEG, "turn",
                       20 + i);
        IH_TEST_WITHIN(0.001, 0.6, health.sigma_rad_q30[1] / Q30 / DEG, "sigma", i);
    }
}

/* However small the turn that they show: what is near the calibration is not known to be there. */
static void a_small_turn_makes_nothing_else_known(void)
{
    static const double rotations_deg[][3] = {
        {0, 0, 0}, {0, 0.1, 0}, {0.02, 0.3, 0}, {0.03, -0.3, 0}, {0.045, 0.3, 0}};

    for (int i = 0; i < IH_TEST_COUNT(rotations_deg); i++) {
        for (int seed = 0; seed < 6; seed++) {
            random_source.state = (uint64_t)seed;
            use_calibration(&vector_rigs[0]);
            run_middle(rotations_deg[i], 2 * FRAMES_TO_FIND);
            TEST_ASSERT_FALSE(health.is_weak_known);
            IH_TEST_WITHIN(0.001, 0.6, health.sigma_rad_q30[1] / Q30 / DEG, "sigma", 10 * i + seed);
        }
    }
}

/* Frames add up after the turn is found. */
static void more_frames_make_it_better(void)
{
    static const double rotation_deg[3] = {-0.2, 0.2, 0.1};

    for (int which = 0; which < 2; which++) {
        use_calibration(&vector_rigs[which]);
        run(&vector_rigs[which], rotation_deg, FRAMES_TO_FIND);
        int32_t basis_count = health.basis_count;
        TEST_ASSERT_GREATER_THAN_INT32(20, basis_count);
        run(&vector_rigs[which], rotation_deg, 200);
        TEST_ASSERT_GREATER_THAN_INT32(5 * basis_count, health.basis_count);
        IH_TEST_WITHIN(0.004, rotation_deg[1], health.rotation_rad_q30[1] / Q30 / DEG, "turn",
                       which);
    }
}

/* However long the peace, and wherever in a look the knock. */
static void a_knock_after_a_long_stable_period_is_found_as_soon(void)
{
    static const double rotations_deg[][3] = {
        {0, 0.1, 0},     {0, -0.1, 0},          {0, 0, 0.05}, {0, 0, -0.1},       {0, 0, 0.2},
        {0.03, 0, 0},    {-0.1, 0, 0},          {0, 0.3, 0},  {0.05, 0.05, 0.05}, {0.02, 0.02, 0},
        {0, 0.06, 0.06}, {-0.03, -0.09, 0.025}, {-0.03, 0, 0}};
    static struct ih_health peaceful;

    for (int which = 0; which < 2; which++) {
        use_calibration(&vector_rigs[which]);
        run(&vector_rigs[which], straight_deg, PEACE_FRAMES);
        assert_untouched();
        for (int i = 0; i < IH_TEST_COUNT(rotations_deg); i++) {
            peaceful = health;
            run(&vector_rigs[which], rotations_deg[i], FRAMES_TO_FIND);
            TEST_ASSERT_EQUAL_INT_MESSAGE(IH_HEALTH_ROTATED, health.state, "told");
            run(&vector_rigs[which], rotations_deg[i], FRAMES_TO_SETTLE);
            assert_rotation(rotations_deg[i], 20 * which + i);
            TEST_ASSERT_TRUE(health.is_weak_known);
            health = peaceful;
            rig = before;
            run(&vector_rigs[which], straight_deg, 1);
        }
        changed_count = 0;
    }
}

/* What was known across the baseline is not known after a knock that does not show it. */
static void a_knock_makes_what_is_not_seen_unknown(void)
{
    for (int seed = 0; seed < 3; seed++) {
        random_source.state = (uint64_t)seed;
        use_calibration(&vector_rigs[0]);
        run(&vector_rigs[0], (const double[3]){0, 0.2, 0}, 100);
        TEST_ASSERT_TRUE(health.is_weak_known);
        run_middle((const double[3]){0, 0.2, 0.1}, 2 * FRAMES_TO_FIND);
        TEST_ASSERT_FALSE(health.is_weak_known);
        TEST_ASSERT_EQUAL_INT(IH_HEALTH_ROTATED, health.state);
        IH_TEST_WITHIN(0.001, 0, health.rotation_rad_q30[1] / Q30 / DEG, "across", seed);
        IH_TEST_WITHIN(0.02, 0.1, health.rotation_rad_q30[2] / Q30 / DEG, "turn", seed);
        IH_TEST_WITHIN(0.001, 0.6, health.sigma_rad_q30[1] / Q30 / DEG, "sigma", seed);
    }
}

/* Frames of another turn while the dots vote, none when it is tried: everything is as before, and what was seen
 * before still counts. */
static void a_search_in_vain_leaves_what_was_known(void)
{
    static const double rotation_deg[3] = {-0.2, 0.2, 0.1};
    static const double other_deg[3] = {0.1, 0.2, 0.1};
    static struct ih_health known;

    use_calibration(&vector_rigs[0]);
    run(&vector_rigs[0], rotation_deg, 150);
    while (health.look.frame_count != 0) {
        run(&vector_rigs[0], rotation_deg, 1);
    }
    known = health;
    before = rig;
    for (int i = 0; i < 30 && health.stage != IH_HEALTH_SETTLING; i++) {
        run(&vector_rigs[0], other_deg, 1);
    }
    TEST_ASSERT_EQUAL_INT(IH_HEALTH_SETTLING, health.stage);
    TEST_ASSERT_FALSE(health.is_weak_known);
    for (int i = 0; i < 30 && health.stage != IH_HEALTH_WATCHING; i++) {
        run(&vector_rigs[0], rotation_deg, 1);
    }
    TEST_ASSERT_EQUAL_MEMORY(&before, &rig, sizeof rig);
    TEST_ASSERT_EQUAL_INT32(known.basis_count, health.basis_count);
    TEST_ASSERT_TRUE(health.is_weak_known);
    TEST_ASSERT_EQUAL_INT32_ARRAY(known.sigma_rad_q30, health.sigma_rad_q30, 3);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(known.all.frame_count, health.all.frame_count);
    /* No turn of few frames comes instead. */
    run(&vector_rigs[0], rotation_deg, 2 * IH_HEALTH_LOOK);
    TEST_ASSERT_GREATER_OR_EQUAL_INT32(known.basis_count, health.basis_count);
}

static void a_second_knock_and_one_back(void)
{
    static const double rotations_deg[][3] = {{0.2, 0.05, 0}, {-0.1, 0, 0.2}, {0.01, 0, 0}};

    use_calibration(&vector_rigs[1]);
    for (int i = 0; i < IH_TEST_COUNT(rotations_deg); i++) {
        run(&vector_rigs[1], rotations_deg[i],
            2 * FRAMES_TO_FIND + IH_HEALTH_PAUSE * IH_HEALTH_LOOK);
        assert_rotation(rotations_deg[i], i);
    }
}

static void a_rotation_beyond_the_limit_is_reported_and_not_taken(void)
{
    for (int which = 0; which < 2; which++) {
        use_calibration(&vector_rigs[which]);
        run(&vector_rigs[which], (const double[3]){1.1, 0, 0}, 200);
        TEST_ASSERT_TRUE(health.state != IH_HEALTH_FITS);
        for (int axis = 0; axis < 3; axis++) {
            TEST_ASSERT_LESS_OR_EQUAL_INT32(IH_ROTATION_VOTE_MAX_RAD_Q30,
                                            abs(health.rotation_rad_q30[axis]));
        }
    }
}

/* Dots anywhere, as sunlight makes them. */
static void chance_turns_nothing(void)
{
    for (int which = 0; which < 2; which++) {
        setUp();
        use_calibration(&vector_rigs[which]);
        /* On to the end of a trial, if there is one. */
        for (int i = 0; i < 200 || health.stage != IH_HEALTH_WATCHING; i++) {
            dots.dot_count = 250;
            for (int32_t k = 0; k < dots.dot_count; k++) {
                dots.dot[k].u_px_q12 = (int32_t)ih_test_between(&random_source, 0, 751 * 4096);
                dots.dot[k].v_px_q12 = (int32_t)ih_test_between(&random_source, 0, 581 * 4096);
            }
            look();
        }
        TEST_ASSERT_TRUE(health.state != IH_HEALTH_ROTATED);
        TEST_ASSERT_TRUE(health.state != IH_HEALTH_FITS);
        TEST_ASSERT_EQUAL_MEMORY(&before, &rig, sizeof rig);
    }
}

/* Dots of a few rows, and more where the sun makes some, which stand still. */
static void sunlight_turns_nothing(void)
{
    static struct ih_dots sun;

    for (int seed = 0; seed < 24; seed++) {
        setUp();
        random_source.state = (uint64_t)seed;
        use_calibration(&vector_rigs[seed % 2]);
        int32_t kept_count = 45 + 5 * (seed % 5);
        sun.dot_count = 75;
        for (int32_t k = 0; k < sun.dot_count; k++) {
            sun.dot[k].u_px_q12 = (int32_t)ih_test_between(&random_source, 0, 751 * 4096);
            sun.dot[k].v_px_q12 = (int32_t)ih_test_between(&random_source, 0, 581 * 4096);
        }
        for (int i = 0; i < 200; i++) {
            see_dots(&vector_rigs[seed % 2], straight_deg, WALL_MM, 0.1, &random_source, &dots);
            dots.dot_count = kept_count;
            for (int32_t k = 0; k < sun.dot_count; k++) {
                dots.dot[dots.dot_count++] = sun.dot[k];
            }
            look();
        }
        assert_untouched();
    }
}

static void few_dots_say_nothing(void)
{
    use_calibration(&vector_rigs[0]);
    for (int i = 0; i < 100; i++) {
        see_dots(&vector_rigs[0], straight_deg, WALL_MM, 0.1, &random_source, &dots);
        dots.dot_count = i % 2;
        look();
    }
    TEST_ASSERT_EQUAL_INT(IH_HEALTH_UNKNOWN, health.state);
    assert_untouched();
}

/* Rays that a calibration got wrong by 0.01 degrees each err in every frame alike: no turn. */
static void a_calibrations_errors_are_no_turn(void)
{
    for (int seed = 0; seed < 6; seed++) {
        setUp();
        random_source.state = (uint64_t)seed;
        wrong = vector_rigs[seed % 2];
        for (int slot = 0; slot < IH_SLOTS; slot++) {
            double length = 0;
            for (int axis = 0; axis < 2; axis++) {
                wrong.ray_q30[slot][axis] +=
                    (int32_t)lround(0.01 * DEG * Q30 / sqrt(2.0) * ih_test_normal(&random_source));
                length += pow(wrong.ray_q30[slot][axis] / Q30, 2);
            }
            wrong.ray_q30[slot][2] = (int32_t)lround(Q30 * sqrt(1 - length));
        }
        use_calibration(&wrong);
        run(&vector_rigs[seed % 2], straight_deg, 120);
        TEST_ASSERT_EQUAL_INT(IH_HEALTH_FITS, health.state);
        assert_untouched();
    }
}

/* All fields at their ends: nothing overflows (sanitizers), every state is one of the four. */
static void anything_labelled_is_survived(void)
{
    use_calibration(&vector_rigs[5]);
    for (int i = 0; i < 600; i++) {
        dots.dot_count = IH_DOTS_MAX;
        labels.labelled_count = IH_SLOTS;
        for (int slot = 0; slot < IH_SLOTS; slot++) {
            labels.dot_of_slot[slot] = (int16_t)slot;
            labels.perp_px_q12[slot] = (int16_t)(i % 3 == 0 ? 2458 : i % 3 == 1 ? -2458 : 300);
        }
        (void)ih_health_frame(&health, &dots, &labels, &rig, &scratch);
        TEST_ASSERT_TRUE(health.state >= IH_HEALTH_UNKNOWN && health.state <= IH_HEALTH_LOST);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_rig_that_fits_is_left_alone);
    RUN_TEST(a_knock_is_found_within_fifty_frames);
    RUN_TEST(what_dots_do_not_show_is_not_taken);
    RUN_TEST(a_small_turn_makes_nothing_else_known);
    RUN_TEST(more_frames_make_it_better);
    RUN_TEST(a_knock_after_a_long_stable_period_is_found_as_soon);
    RUN_TEST(a_knock_makes_what_is_not_seen_unknown);
    RUN_TEST(a_search_in_vain_leaves_what_was_known);
    RUN_TEST(a_second_knock_and_one_back);
    RUN_TEST(a_rotation_beyond_the_limit_is_reported_and_not_taken);
    RUN_TEST(chance_turns_nothing);
    RUN_TEST(sunlight_turns_nothing);
    RUN_TEST(few_dots_say_nothing);
    RUN_TEST(a_calibrations_errors_are_no_turn);
    RUN_TEST(anything_labelled_is_survived);
    return UNITY_END();
}
