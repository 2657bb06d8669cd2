/* ih_rotation_vote: slopes and rotated rays against double, votes of dots that lie beside their lines. */
#include "upkeep/ih_rotation_vote.h"

#include "ih_test.h"
#include "rigs.inc"
#include "rotated_rig.h"

static struct ih_rig rig;
static struct ih_rotation_vote_slopes slopes;
static struct ih_rotation_vote_votes votes;
static struct ih_rotation_vote_scratch scratch;
static struct ih_calibration rotated;
static struct ih_dots dots;
static struct ih_test_random random_source;

void setUp(void)
{
    random_source.state = 71;
    memset(&votes, 0, sizeof votes);
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
}

void tearDown(void)
{
}

static void use_rig(int index)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[index], &bad_slot));
    ih_rotation_vote_slopes(&rig, &slopes);
}

static void rays_turn_as_rodrigues_says(void)
{
    static const double rotations_deg[][3] = {{0, 0, 0},   {0.6, 0, 0},      {0, -0.6, 0},
                                              {0, 0, 0.6}, {0.3, -0.2, 0.1}, {0.6, 0.6, 0.6}};
    int i, slot, axis;

    for (i = 0; i < IH_TEST_COUNT(rotations_deg); i++) {
        int32_t rotation_rad_q30[3];
        rotation_of(rotations_deg[i], rotation_rad_q30);
        ih_rotation_vote_calibration(&vector_rigs[1], rotation_rad_q30, &rotated);
        for (slot = 0; slot < IH_SLOTS; slot++) {
            double ray[3];
            rotated_ray(&vector_rigs[1], slot, rotations_deg[i], ray);
            for (axis = 0; axis < 3; axis++) {
                IH_TEST_WITHIN(1.2e-6, ray[axis], rotated.ray_q30[slot][axis] / Q30, "ray", slot);
            }
        }
    }
}

/* Places by double of a dot at some depth, before and after a small turn, against the line of before. */
static void slopes_are_what_a_turn_moves_across(void)
{
    const int rigs[] = {0, 1, 4, 5};
    int i, slot, axis;

    for (i = 0; i < IH_TEST_COUNT(rigs); i++) {
        use_rig(rigs[i]);
        for (slot = 0; slot < IH_SLOTS; slot += 7) {
            for (axis = 0; axis < 3; axis++) {
                double rotation_deg[3] = {0, 0, 0};
                const struct ih_line *line = &rig.line[slot];
                double place[2], across;
                rotation_deg[axis] = 0.001;
                place_at_infinity(&vector_rigs[rigs[i]], slot, rotation_deg, place);
                across = (place[1] - line->infinity_v_px_q12 / 4096.0) * line->dir_u_q30 / Q30 -
                         (place[0] - line->infinity_u_px_q12 / 4096.0) * line->dir_v_q30 / Q30;
                /* The line itself is rounded: 2 steps of 1/4096 px over 17 microradians. */
                IH_TEST_WITHIN(35.0, across / (0.001 * DEG), slopes.px_q4[slot][axis] / 16.0,
                               "slope", slot);
            }
        }
    }
}

static void dots_elect_the_rotation(void)
{
    static const double rotations_deg[][3] = {{0.3, 0, 0},      {-0.3, 0, 0},
                                              {0, 0, 0.3},      {0.17, -0.2, 0.15},
                                              {-0.2, 0.2, 0.1}, {0.5, 0.1, -0.3}};
    int which, i, axis;

    for (which = 0; which < 2; which++) {
        use_rig(which);
        for (i = 0; i < IH_TEST_COUNT(rotations_deg); i++) {
            /* Steps of the lattice, and half as much again: the weak axis is 0.2 degrees coarse. */
            static const double limit_deg[3] = {0.03, 0.4, 0.11};
            struct ih_rotation_vote_winner winner;
            memset(&votes, 0, sizeof votes);
            see_dots(&vector_rigs[which], rotations_deg[i], 1200.0, 0.1, &random_source, &dots);
            ih_rotation_vote_vote(&dots, &rig, &slopes, &scratch, &votes);
            ih_rotation_vote_elect(&votes, &rig, &winner);
            for (axis = 0; axis < 3; axis++) {
                IH_TEST_WITHIN(limit_deg[axis], rotations_deg[i][axis],
                               winner.rotation_rad_q30[axis] / Q30 / DEG, "turn", 10 * i + axis);
            }
            TEST_ASSERT_GREATER_THAN_INT32(winner.vote_of_none * 5 / 4, winner.vote);
        }
    }
}

static void a_rig_that_fits_elects_hardly_another(void)
{
    struct ih_rotation_vote_winner winner;

    use_rig(0);
    see_dots(&vector_rigs[0], (const double[3]){0, 0, 0}, 1200.0, 0.1, &random_source, &dots);
    ih_rotation_vote_vote(&dots, &rig, &slopes, &scratch, &votes);
    ih_rotation_vote_elect(&votes, &rig, &winner);
    TEST_ASSERT_LESS_THAN_INT32(winner.vote_of_none * 5 / 4, winner.vote);
}

static void no_dots_no_votes(void)
{
    struct ih_rotation_vote_winner winner;

    use_rig(0);
    dots.dot_count = 0;
    ih_rotation_vote_vote(&dots, &rig, &slopes, &scratch, &votes);
    ih_rotation_vote_elect(&votes, &rig, &winner);
    TEST_ASSERT_EQUAL_INT32(0, winner.vote);
    TEST_ASSERT_EQUAL_INT32(0, winner.vote_of_none);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(rays_turn_as_rodrigues_says);
    RUN_TEST(slopes_are_what_a_turn_moves_across);
    RUN_TEST(dots_elect_the_rotation);
    RUN_TEST(a_rig_that_fits_elects_hardly_another);
    RUN_TEST(no_dots_no_votes);
    return UNITY_END();
}
