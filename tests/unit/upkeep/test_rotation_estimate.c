/* ih_rotation_estimate on made-up labels whose distances from their lines are known, in double. */
#include "labels/ih_labels.h"
#include "upkeep/ih_rotation_estimate.h"
#include "upkeep/ih_rotation_vote.h"

#include <math.h>
#include <stdlib.h>

#include "ih_test.h"
#include "rigs.inc"
#include "rotated_rig.h"

#define REACH_PX_Q12 1229
#define NOISE_PX 0.1
#define PLACE_PX 0.045 /* what a place does to its dots */

static struct ih_rig rig;
static struct ih_rotation_vote_slopes slopes;
static struct ih_rotation_estimate places;
static struct ih_rotation_estimate_result found;
static struct ih_labels labels;
static struct ih_test_random random_source;

static const int32_t straight[3] = {0, 0, 0};
static const double straight_deg[3] = {0, 0, 0};
static double standing_px[IH_SLOTS];

void setUp(void)
{
    int32_t bad_slot;

    random_source.state = 91;
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[0], &bad_slot));
    ih_rotation_vote_slopes(&rig, &slopes);
    memset(&places, IH_TEST_FILL, sizeof places);
    ih_rotation_estimate_clear(&places);
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        labels.dot_of_slot[slot] = (int16_t)slot;
        labels.t_px_q12[slot] = 40960;
        standing_px[slot] = 0;
    }
}

void tearDown(void)
{
}

static double slope_px(int slot, int axis)
{
    return slopes.px_q4[slot][axis] / 16.0;
}

static void label(int slot, const double rotation_deg[3], double error_px)
{
    double across = standing_px[slot] + error_px;

    for (int axis = 0; axis < 3; axis++) {
        across += slope_px(slot, axis) * rotation_deg[axis] * DEG;
    }
    labels.perp_px_q12[slot] = (int16_t)lround(4096 * across);
}

static void add_frame(const double rotation_deg[3])
{
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        label(slot, rotation_deg, NOISE_PX * ih_test_normal(&random_source));
    }
    ih_rotation_estimate_add(&places, &labels, &rig, &slopes, REACH_PX_Q12);
}

/* A dot that goes on has another place's error from now on. */
static void move(int slot)
{
    labels.t_px_q12[slot] += 4096;
    standing_px[slot] = PLACE_PX * ih_test_normal(&random_source);
}

static void find(const int32_t rotated_rad_q30[3], bool is_weak_known)
{
    TEST_ASSERT_TRUE(
        ih_rotation_estimate_find(&places, &rig, &slopes, rotated_rad_q30, is_weak_known, &found));
}

static double deg_of(int32_t angle_rad_q30)
{
    return angle_rad_q30 / Q30 / DEG;
}

/* Every other dot stands still and errs as if the rig were rotated about Y by 0.05 degrees more. They are seen
 * in as many frames as the others, but on one place each: 18 frames' worth against 190. */
static void what_stands_still_counts_once(void)
{
    const double rotation_deg[3] = {0.003, -0.02, 0.01};

    for (int slot = 0; slot < IH_SLOTS; slot += 2) {
        standing_px[slot] = slope_px(slot, 1) * 0.05 * DEG;
    }
    for (int frame = 0; frame < 200; frame++) {
        for (int slot = 1; slot < IH_SLOTS; slot += 2) {
            labels.t_px_q12[slot] += 4096;
        }
        add_frame(rotation_deg);
    }
    find(straight, false);
    IH_TEST_WITHIN(0.001, rotation_deg[0], deg_of(found.rotation_rad_q30[0]), "turn", 0);
    IH_TEST_WITHIN(0.05 * 18 / 208 + 0.003, rotation_deg[1], deg_of(found.rotation_rad_q30[1]),
                   "turn", 1);
    IH_TEST_WITHIN(0.003, rotation_deg[2], deg_of(found.rotation_rad_q30[2]), "turn", 2);
    TEST_ASSERT_TRUE(found.is_weak_seen);
}

/* Errors in units of the uncertainty: with dots of which a third moves now and then; and with rays that a
 * calibration got wrong by 0.1 px each for good, which nothing but the slots' own scatter can tell. */
static void uncertainties_are_what_errors_come_to(void)
{
    const double rotation_deg[3] = {0.0002, -0.01, 0.002};
    const double ray_px[] = {0, 0.1};

    for (int which = 0; which < 2; which++) {
        double square[3] = {0, 0, 0};
        double own_px[IH_SLOTS];
        for (int run = 0; run < 60; run++) {
            setUp();
            random_source.state = (uint64_t)(1000 * which + run);
            for (int slot = 0; slot < IH_SLOTS; slot++) {
                move(slot);
                own_px[slot] = ray_px[which] * ih_test_normal(&random_source);
                standing_px[slot] += own_px[slot];
            }
            for (int frame = 0; frame < 40; frame++) {
                for (int slot = 0; slot < IH_SLOTS; slot += 3) {
                    move(slot);
                    standing_px[slot] += own_px[slot];
                }
                add_frame(rotation_deg);
            }
            find(straight, false);
            for (int axis = 0; axis < 3; axis++) {
                double error = deg_of(found.rotation_rad_q30[axis]) - rotation_deg[axis];
                square[axis] += pow(error / deg_of(found.sigma_rad_q30[axis]), 2);
            }
        }
        for (int axis = 0; axis < 3; axis++) {
            IH_TEST_WITHIN(0.45, 0.9, sqrt(square[axis] / 60), "sigmas", 10 * which + axis);
        }
    }
}

/* Of the middle rows and columns none shows a turn about Y. */
static void only_middle_dots(void)
{
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        int row = slot / IH_GRID - IH_GRID / 2;
        int column = slot % IH_GRID - IH_GRID / 2;
        if (abs(row) > 1 && abs(column) > 1) {
            labels.dot_of_slot[slot] = IH_NONE;
        }
    }
}

static void what_is_not_seen_is_held(void)
{
    const double rotation_deg[3] = {0.003, 0.01, -0.01};
    int32_t rotated_rad_q30[3];

    rotation_of((const double[3]){0.1, 0.2, 0}, rotated_rad_q30);
    only_middle_dots();
    for (int frame = 0; frame < 12; frame++) {
        add_frame(rotation_deg);
    }
    for (int is_known = 0; is_known < 2; is_known++) {
        find(rotated_rad_q30, is_known != 0);
        TEST_ASSERT_FALSE(found.is_weak_seen);
        IH_TEST_WITHIN(0.003, rotation_deg[0], deg_of(found.rotation_rad_q30[0]), "turn", 0);
        IH_TEST_WITHIN(0.001, is_known ? 0 : -0.2, deg_of(found.rotation_rad_q30[1]), "held",
                       is_known);
        IH_TEST_WITHIN(0.01, rotation_deg[2], deg_of(found.rotation_rad_q30[2]), "turn", 2);
    }
}

/* Turned by what was found nothing is left to find, and as much is known as before. */
static void a_turn_that_is_taken_leaves_nothing(void)
{
    const double rotation_deg[3] = {0.003, 0.05, -0.004};
    struct ih_rotation_estimate_result first;

    for (int frame = 0; frame < 60; frame++) {
        add_frame(rotation_deg);
    }
    find(straight, false);
    first = found;
    ih_rotation_estimate_rotate(&places, &slopes, found.rotation_rad_q30);
    find(first.rotation_rad_q30, true);
    for (int axis = 0; axis < 3; axis++) {
        IH_TEST_WITHIN(1e-4, 0, deg_of(found.rotation_rad_q30[axis]), "left", axis);
        IH_TEST_WITHIN(0.02 * first.sigma_rad_q30[axis], first.sigma_rad_q30[axis],
                       found.sigma_rad_q30[axis], "sigma", axis);
    }
}

/* The same dots in the image on the lines of a rotated rig, and then further along by that. */
static void relabel(const struct ih_rig *now, double further_px)
{
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_line *from = &rig.line[slot];
        const struct ih_line *to = &now->line[slot];
        double du_px = (from->infinity_u_px_q12 - (double)to->infinity_u_px_q12) / 4096;
        double dv_px = (from->infinity_v_px_q12 - (double)to->infinity_v_px_q12) / 4096;
        double along_px = (du_px * to->dir_u_q30 + dv_px * to->dir_v_q30) / Q30 + further_px;
        labels.t_px_q12[slot] += (int32_t)lround(4096 * along_px);
    }
    rig = *now;
    ih_rotation_vote_slopes(&rig, &slopes);
}

static int32_t slots_that_left(void)
{
    int32_t count = 0;

    for (int slot = 0; slot < IH_SLOTS; slot++) {
        count += places.slot[slot].at[IH_ROTATION_ESTIMATE_KNOWN].weight_q8 > 0;
    }
    return count;
}

/* By 0.05 degrees about Y all lines begin 0.8 px further along. No dot is elsewhere for that; and those that went
 * 0.4 px before it and go as far after it are, as without it. */
static void a_turn_moves_no_dot_to_another_place(void)
{
    static struct ih_calibration rotated;
    static struct ih_rig now;
    int32_t rotation_rad_q30[3];
    int32_t bad_slot;

    add_frame(straight_deg);
    rotation_of((const double[3]){0, 0.05, 0}, rotation_rad_q30);
    ih_rotation_vote_calibration(&rig.calibration, rotation_rad_q30, &rotated);
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&now, &rotated, &bad_slot));
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        labels.t_px_q12[slot] += 1638;
    }
    add_frame(straight_deg);
    ih_rotation_estimate_rotate(&places, &slopes, rotation_rad_q30);
    relabel(&now, 0);
    add_frame(straight_deg);
    TEST_ASSERT_EQUAL_INT32(0, slots_that_left());
    relabel(&now, 0.4);
    add_frame(straight_deg);
    TEST_ASSERT_GREATER_THAN_INT32(IH_SLOTS * 9 / 10, slots_that_left());
}

static void move_all(double by_px)
{
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        labels.t_px_q12[slot] += (int32_t)lround(4096 * by_px);
    }
}

/* Away for some frames and back the dots are where they were; a third place takes that of the fewer frames. */
static void a_wall_stays_known_while_an_arm_passes(void)
{
    for (int frame = 0; frame < 30; frame++) {
        bool is_arm = frame % 10 >= 7;
        move_all(is_arm ? 8 : 0);
        add_frame(straight_deg);
        move_all(is_arm ? -8 : 0);
    }
    TEST_ASSERT_EQUAL_INT32(0, slots_that_left());
    move_all(20);
    add_frame(straight_deg);
    TEST_ASSERT_GREATER_THAN_INT32(IH_SLOTS * 9 / 10, slots_that_left());
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        TEST_ASSERT_LESS_THAN_INT32(9 << 8,
                                    places.slot[slot].at[IH_ROTATION_ESTIMATE_KNOWN].weight_q8);
    }
}

/* Of every twelfth slot the dots lie 0.2 px off for good, as if the rig were rotated about Y: by 0.025 degrees,
 * were they trusted as much as the others; 0.007 are left. */
static void slots_that_are_far_off_hardly_count(void)
{
    for (int slot = 0; slot < IH_SLOTS; slot += 12) {
        standing_px[slot] = slope_px(slot, 1) > 0 ? 0.2 : -0.2;
    }
    for (int frame = 0; frame < 100; frame++) {
        add_frame(straight_deg);
    }
    find(straight, false);
    IH_TEST_WITHIN(0.01, 0, deg_of(found.rotation_rad_q30[1]), "turn", 1);
}

/* Beyond a pixel nothing is kept. */
static void a_great_turn_starts_anew(void)
{
    int32_t rotation_rad_q30[3];

    add_frame(straight_deg);
    rotation_of((const double[3]){0.3, 0, 0}, rotation_rad_q30);
    ih_rotation_estimate_rotate(&places, &slopes, rotation_rad_q30);
    TEST_ASSERT_EQUAL_INT32(0, places.frame_count);
    TEST_ASSERT_FALSE(
        ih_rotation_estimate_find(&places, &rig, &slopes, rotation_rad_q30, true, &found));
}

static void frames_of_long_ago_count_less(void)
{
    const double rotation_deg[3] = {0.01, 0.02, 0.01};
    struct ih_rotation_estimate_result before;

    for (int frame = 0; frame < IH_ROTATION_ESTIMATE_FRAMES_MAX - 1; frame++) {
        add_frame(rotation_deg);
    }
    ih_rotation_estimate_forget(&places);
    TEST_ASSERT_EQUAL_INT32(IH_ROTATION_ESTIMATE_FRAMES_MAX - 1, places.frame_count);
    add_frame(rotation_deg);
    find(straight, false);
    before = found;
    ih_rotation_estimate_forget(&places);
    TEST_ASSERT_EQUAL_INT32(IH_ROTATION_ESTIMATE_FRAMES_MAX * 3 / 4, places.frame_count);
    find(straight, false);
    for (int axis = 0; axis < 3; axis++) {
        IH_TEST_WITHIN(1e-3, deg_of(before.rotation_rad_q30[axis]),
                       deg_of(found.rotation_rad_q30[axis]), "turn", axis);
    }
}

static void a_straight_rig_is_not_surely_rotated(void)
{
    for (int run = 0; run < 20; run++) {
        setUp();
        random_source.state = (uint64_t)run;
        for (int slot = 0; slot < IH_SLOTS; slot++) {
            move(slot);
        }
        for (int frame = 0; frame < 60; frame++) {
            add_frame(straight_deg);
        }
        find(straight, false);
        TEST_ASSERT_EQUAL_INT32(0, found.sure_rad_q30);
    }
    setUp();
    for (int frame = 0; frame < 6; frame++) {
        add_frame((const double[3]){0.01, 0, 0});
    }
    find(straight, false);
    TEST_ASSERT_GREATER_THAN_INT32(0, found.sure_rad_q30);
}

/* Rays that were calibrated wrong by 0.1 px each are in both; that every slot is on another place is chance. */
static void a_change_is_found_and_chance_is_none(void)
{
    static struct ih_rotation_estimate late, difference;
    const double rotations_deg[][3] = {{0, 0, 0}, {0, 0.1, 0}, {0, 0, -0.03}, {0.005, 0, 0}};
    double square[3] = {0, 0, 0};

    for (int run = 0; run < 80; run++) {
        const double *rotation_deg = rotations_deg[run % 4];
        double own_px[IH_SLOTS];
        setUp();
        random_source.state = (uint64_t)run;
        for (int slot = 0; slot < IH_SLOTS; slot++) {
            own_px[slot] = 0.1 * ih_test_normal(&random_source);
            standing_px[slot] = own_px[slot] + PLACE_PX * ih_test_normal(&random_source);
        }
        for (int frame = 0; frame < 200; frame++) {
            add_frame(straight_deg);
        }
        ih_rotation_estimate_clear(&late);
        for (int slot = 0; slot < IH_SLOTS; slot++) {
            move(slot);
            standing_px[slot] += own_px[slot];
        }
        for (int frame = 0; frame < 6; frame++) {
            add_frame(rotation_deg);
            ih_rotation_estimate_add(&late, &labels, &rig, &slopes, REACH_PX_Q12);
        }
        memset(&difference, IH_TEST_FILL, sizeof difference);
        TEST_ASSERT_TRUE(
            ih_rotation_estimate_change(&late, &places, &rig, &slopes, &difference, &found));
        TEST_ASSERT_TRUE(found.is_weak_seen);
        TEST_ASSERT_TRUE((found.sure_rad_q30 > 0) == (run % 4 > 0));
        for (int axis = 0; axis < 3; axis++) {
            double part_deg = deg_of(found.rotation_rad_q30[axis]);
            if (run % 4 == 0) {
                square[axis] += pow(part_deg / deg_of(found.sigma_rad_q30[axis]), 2) / 20;
            } else if (rotation_deg[axis] != 0) {
                /* Tukey's weights are not linear: half too much, which settling takes back. */
                IH_TEST_WITHIN(0.45, 1.25, part_deg / rotation_deg[axis], "share", run);
            }
        }
    }
    for (int axis = 0; axis < 3; axis++) {
        IH_TEST_WITHIN(0.4, 0.9, sqrt(square[axis]), "sigmas", axis);
    }
}

/* Only axes that are sure count: one that hardly shows may be anywhere. */
static void what_is_sure_is_marked(void)
{
    const double rotation_deg[3] = {0.01, 0.03, 0};

    for (int frame = 0; frame < 60; frame++) {
        add_frame(rotation_deg);
    }
    find(straight, false);
    TEST_ASSERT_GREATER_THAN_INT32(found.rotation_rad_q30[0], found.rotation_rad_q30[1]);
    TEST_ASSERT_INT32_WITHIN(1, found.rotation_rad_q30[0], found.sure_rad_q30);
}

static void few_dots_say_nothing(void)
{
    TEST_ASSERT_FALSE(ih_rotation_estimate_find(&places, &rig, &slopes, straight, false, &found));
    for (int slot = 20; slot < IH_SLOTS; slot++) {
        labels.dot_of_slot[slot] = IH_NONE;
    }
    /* However often 20 slots are seen, their scatter tells nothing. */
    for (int frame = 0; frame < 400; frame++) {
        add_frame(straight_deg);
    }
    TEST_ASSERT_FALSE(ih_rotation_estimate_find(&places, &rig, &slopes, straight, false, &found));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(what_stands_still_counts_once);
    RUN_TEST(uncertainties_are_what_errors_come_to);
    RUN_TEST(what_is_not_seen_is_held);
    RUN_TEST(a_turn_that_is_taken_leaves_nothing);
    RUN_TEST(a_turn_moves_no_dot_to_another_place);
    RUN_TEST(a_wall_stays_known_while_an_arm_passes);
    RUN_TEST(slots_that_are_far_off_hardly_count);
    RUN_TEST(a_great_turn_starts_anew);
    RUN_TEST(frames_of_long_ago_count_less);
    RUN_TEST(a_straight_rig_is_not_surely_rotated);
    RUN_TEST(a_change_is_found_and_chance_is_none);
    RUN_TEST(what_is_sure_is_marked);
    RUN_TEST(few_dots_say_nothing);
    return UNITY_END();
}
