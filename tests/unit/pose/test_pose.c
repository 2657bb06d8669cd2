/* ih_pose: beliefs against their arithmetic, and what a head, its track, its turning and time do to them. */
#include <math.h>

#include "base/ih_config.h"
#include "pose/ih_pose.h"
#include "pose/ih_pose_look.h"
#include "rig/ih_level.h"

#include "ih_test.h"
#include "ih_test_look.h"

#define RADIANS 0.017453292519943295 /* of a degree */

static struct ih_pose_likelihood likelihood;
static struct ih_pose_params params;
static struct ih_pose pose;
static struct ih_pose_scratch scratch;
static struct ih_detections detections;
static struct ih_predicted predicted;
static struct ih_tracks tracks;
static struct ih_result result;

void setUp(void)
{
    memset(&points, 0, sizeof points);
    memset(&rig, 0, sizeof rig);
    rig.is_level = true;
    memset(&likelihood, IH_TEST_FILL, sizeof likelihood);
    memset(&pose, 0, sizeof pose);
    memset(&detections, 0, sizeof detections);
    memset(&predicted, 0, sizeof predicted);
    ih_tracks_init(&tracks);
    ih_result_clear(&result);
    ih_pose_params_default(&params);
}

void tearDown(void)
{
}

static int64_t sum_of(const uint16_t *cell, int32_t count)
{
    int64_t sum = 0;
    for (int32_t i = 0; i < count; i++) {
        sum += cell[i];
    }
    return sum;
}

static void check_sums(const struct ih_pose_belief *belief)
{
    TEST_ASSERT_INT64_WITHIN(64, 65536, sum_of(belief->yaw_q16, IH_POSE_RATES * IH_POSE_YAWS));
    TEST_ASSERT_INT64_WITHIN(64, 65536, sum_of(belief->pitch_q16, IH_POSE_PITCHES));
}

/* Where the yaws of a rate of turning begin. */
enum { BACK = 0, STILL = IH_POSE_YAWS, FORTH = 2 * IH_POSE_YAWS };

/* Probability of a yaw at any rate. */
static int32_t yaw_of(const struct ih_pose_belief *belief, int32_t yaw)
{
    return belief->yaw_q16[BACK + yaw] + belief->yaw_q16[STILL + yaw] +
           belief->yaw_q16[FORTH + yaw];
}

/* Certain of one yaw, at rest, and one pitch. */
static void be_certain(struct ih_pose_belief *belief, int32_t yaw, int32_t pitch)
{
    memset(belief, 0, sizeof *belief);
    belief->yaw_q16[STILL + yaw] = belief->pitch_q16[pitch] = UINT16_MAX;
}

static void beliefs_begin_as_what_was_learnt_and_are_not_known(void)
{
    static const int32_t ahead_mm_q8[3] = {0, 0, 1 << 18};
    struct ih_pose_belief belief;
    struct ih_head_pose said;

    ih_pose_begin(7, 1234, &belief);
    TEST_ASSERT_EQUAL_INT32(7, belief.track_id);
    TEST_ASSERT_EQUAL_INT64(1234, belief.time_us);
    check_sums(&belief);
    for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
        TEST_ASSERT_EQUAL_INT32(belief.yaw_q16[STILL + i],
                                belief.yaw_q16[STILL + IH_POSE_YAWS - 1 - i]);
        TEST_ASSERT_EQUAL_INT32(belief.yaw_q16[BACK + i],
                                belief.yaw_q16[FORTH + IH_POSE_YAWS - 1 - i]);
    }
    ih_pose_conclude(&belief, &params, ahead_mm_q8, &said);
    TEST_ASSERT_FALSE(said.is_known);
}

/* Angles are against the camera's axis: a head at 45 degrees to the right that looks at the camera has turned to -X. */
static void directions_are_against_the_cameras_axis(void)
{
    static const struct {
        int32_t yaw, pitch, x_mm, z_mm, yaw_mdeg, pitch_mdeg;
    } cases[] = {
        {12, 4, 0, 1000, 7500, 0},       {11, 4, 0, 1000, -7500, 0},
        {12, 4, 1000, 1000, -37500, 0},  {12, 4, -1000, 1000, 52500, 0},
        {23, 8, 0, 1000, 172500, 40000}, {0, 0, 0, 1000, -172500, -40000},
        {0, 4, 1000, 1000, 142500, 0},   {23, 4, -1000, 1000, -142500, 0},
    };
    for (size_t i = 0; i < IH_TEST_COUNT(cases); i++) {
        const int32_t centre_mm_q8[3] = {cases[i].x_mm * 256, 0, cases[i].z_mm * 256};
        struct ih_pose_belief belief;
        struct ih_head_pose said;
        be_certain(&belief, cases[i].yaw, cases[i].pitch);
        ih_pose_conclude(&belief, &params, centre_mm_q8, &said);
        TEST_ASSERT_TRUE(said.is_known);
        TEST_ASSERT_INT32_WITHIN(3, cases[i].yaw_mdeg, said.yaw_mdeg);
        TEST_ASSERT_EQUAL_INT32(cases[i].pitch_mdeg, said.pitch_mdeg);
        TEST_ASSERT_EQUAL_INT32(params.yaw_sigma_mdeg, said.yaw_sigma_mdeg);
        TEST_ASSERT_EQUAL_INT32(params.pitch_sigma_mdeg, said.pitch_sigma_mdeg);
    }
}

/* Half on each of two neighbours: the mean between them, across the seam of the ring as well. */
static void a_mean_goes_across_the_back(void)
{
    static const int32_t ahead_mm_q8[3] = {0, 0, 1 << 18};
    for (int32_t first = 0; first < IH_POSE_YAWS; first++) {
        struct ih_pose_belief belief;
        struct ih_head_pose said;
        const int32_t between_mdeg = (first + 1) * 15000 - 180000;
        be_certain(&belief, first, 4);
        belief.yaw_q16[STILL + first] = belief.yaw_q16[BACK + (first + 1) % IH_POSE_YAWS] = 32768;
        ih_pose_conclude(&belief, &params, ahead_mm_q8, &said);
        TEST_ASSERT_INT32_WITHIN(1, between_mdeg == 180000 ? 180000 : between_mdeg, said.yaw_mdeg);
        /* 7.5 degrees on both sides, and the 4 of its own */
        TEST_ASSERT_INT32_WITHIN(
            2,
            (int32_t)lround(
                sqrt(7500.0 * 7500 + (double)params.yaw_sigma_mdeg * params.yaw_sigma_mdeg)),
            said.yaw_sigma_mdeg);
    }
}

static void two_peaks_are_not_known(void)
{
    static const int32_t ahead_mm_q8[3] = {0, 0, 1 << 18};
    struct ih_pose_belief belief;
    struct ih_head_pose said;

    be_certain(&belief, 12, 4);
    belief.yaw_q16[STILL + 12] = (uint16_t)(params.known_min_q16 - 1);
    belief.yaw_q16[FORTH + 12] = 1;
    belief.yaw_q16[STILL + 0] = (uint16_t)(65536 - params.known_min_q16);
    ih_pose_conclude(&belief, &params, ahead_mm_q8, &said);
    TEST_ASSERT_TRUE(said.is_known);
    belief.yaw_q16[STILL + 12]--;
    belief.yaw_q16[STILL + 0]++;
    ih_pose_conclude(&belief, &params, ahead_mm_q8, &said);
    TEST_ASSERT_FALSE(said.is_known);
}

/* A step of 1-2-1 adds half of a cell squared to the variance, whatever the frames' times. */
static void time_spreads_in_proportion(void)
{
    params.yaw.leak_q16 = params.pitch.leak_q16 = params.rate_side_q16 = 0;
    params.yaw.side_q16 = 16384;
    for (int64_t parts = 1; parts <= 8; parts *= 2) {
        struct ih_pose_belief belief;
        double variance = 0;
        be_certain(&belief, 12, 4);
        for (int64_t i = 1; i <= parts; i++) {
            ih_pose_wait(&belief, &params, i * 8 * params.step_us / parts);
            check_sums(&belief);
        }
        for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
            variance += (i - 12) * (i - 12) * belief.yaw_q16[STILL + i] / 65536.0;
        }
        TEST_ASSERT_DOUBLE_WITHIN(0.05, 8 * 0.5, variance);
    }
}

/* The seam is no wall; a pitch has ends. */
static void yaws_are_a_ring_and_pitches_are_not(void)
{
    struct ih_pose_belief belief;

    params.yaw.leak_q16 = params.pitch.leak_q16 = params.rate_side_q16 = 0;
    params.yaw.side_q16 = 16384;
    be_certain(&belief, 0, 0);
    ih_pose_wait(&belief, &params, params.step_us);
    TEST_ASSERT_INT32_WITHIN(1, 32768, belief.yaw_q16[STILL + 0]);
    TEST_ASSERT_INT32_WITHIN(1, 16384, belief.yaw_q16[STILL + 1]);
    TEST_ASSERT_INT32_WITHIN(1, 16384, belief.yaw_q16[STILL + IH_POSE_YAWS - 1]);
    TEST_ASSERT_EQUAL_INT32(0, belief.pitch_q16[IH_POSE_PITCHES - 1]);
    check_sums(&belief);
}

/* A head that turns goes on, across the seam as well, in proportion to the time; one at rest stays. */
static void turning_heads_go_on(void)
{
    params.yaw = (struct ih_pose_axis){.follow_q8 = 256};
    params.rate_side_q16 = 0;
    for (int64_t parts = 1; parts <= 8; parts *= 2) {
        struct ih_pose_belief belief;
        double back = 0, still = 0, forth = 0;
        be_certain(&belief, 12, 4);
        belief.yaw_q16[BACK + 1] = belief.yaw_q16[STILL + 12] = belief.yaw_q16[FORTH + 22] = 21845;
        for (int64_t i = 1; i <= parts; i++) {
            ih_pose_wait(&belief, &params, i * 8 * params.step_us / parts);
            check_sums(&belief);
        }
        for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
            const int32_t ahead = i < 12 ? i + IH_POSE_YAWS : i;
            back += (i < 12 ? i : i - IH_POSE_YAWS) * belief.yaw_q16[BACK + i] / 21845.0;
            still += i * belief.yaw_q16[STILL + i] / 21845.0;
            forth += ahead * belief.yaw_q16[FORTH + i] / 21845.0;
        }
        /* 150 degrees a second for 0.2 s */
        TEST_ASSERT_DOUBLE_WITHIN(0.05, 1.0 - 2.0, back);
        TEST_ASSERT_DOUBLE_WITHIN(0.05, 12.0, still);
        TEST_ASSERT_DOUBLE_WITHIN(0.05, 22.0 + 2.0, forth);
    }
}

/* Frames of a head that turns by 10 degrees each, 15 a second, to either side: it is said where it is, not where it was. */
static void turning_heads_are_followed_without_a_lag(void)
{
    static const int32_t ahead_mm_q8[3] = {0, 0, 1 << 18};
    for (int32_t side = -1; side <= 1; side += 2) {
        struct ih_pose_belief belief;
        ih_pose_begin(1, 0, &belief);
        for (int32_t frame = 1; frame <= 30; frame++) {
            const double yaw_deg = side * (10.0 * frame - 150.0);
            struct ih_head_pose said;
            for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
                const double away = remainder(i * 15.0 - 172.5 - yaw_deg, 360) / 20.0;
                likelihood.log2_q10[i] = (int32_t)lround(-512.0 * away * away / log(2));
            }
            memset(&likelihood.log2_q10[IH_POSE_YAWS], 0, IH_POSE_PITCHES * sizeof(int32_t));
            ih_pose_wait(&belief, &params, frame * 66667);
            ih_pose_learn(&belief, &likelihood, params.yaw.follow_q8, params.pitch.follow_q8);
            ih_pose_conclude(&belief, &params, ahead_mm_q8, &said);
            if (frame > 10) { /* half a cell */
                TEST_ASSERT_DOUBLE_WITHIN(7.5, 0, remainder(said.yaw_mdeg / 1000.0 - yaw_deg, 360));
            }
        }
    }
}

static void long_times_end_in_what_it_began_with(void)
{
    struct ih_pose_belief belief, start;

    ih_pose_begin(1, 0, &start);
    be_certain(&belief, 0, 0);
    for (int64_t i = 1; i <= 400; i++) {
        ih_pose_wait(&belief, &params, i * 1000 * (int64_t)params.step_us);
        check_sums(&belief);
    }
    for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
        /* spreading evens it out, the leak brings it back */
        TEST_ASSERT_INT32_WITHIN(3000, yaw_of(&start, i), yaw_of(&belief, i));
    }
    ih_pose_wait(&belief, &params, INT64_MAX);
    check_sums(&belief);
}

/* Bayes' rule, and its power. */
static void a_frame_multiplies(void)
{
    struct ih_pose_belief belief;

    memset(&likelihood, 0, sizeof likelihood);
    for (int32_t i = 0; i < IH_POSE_OUTPUTS; i++) {
        likelihood.log2_q10[i] = -20 * 1024;
    }
    be_certain(&belief, 3, 2);
    belief.yaw_q16[STILL + 3] = belief.yaw_q16[STILL + 9] = 32768;
    likelihood.log2_q10[3] = 5 * 1024;
    likelihood.log2_q10[9] = 3 * 1024;
    likelihood.log2_q10[IH_POSE_YAWS + 2] = 0;
    ih_pose_learn(&belief, &likelihood, 256, 256); /* 4 to 1 */
    TEST_ASSERT_INT32_WITHIN(16, 65536 * 4 / 5, belief.yaw_q16[STILL + 3]);
    TEST_ASSERT_INT32_WITHIN(16, 65536 / 5, belief.yaw_q16[STILL + 9]);
    TEST_ASSERT_EQUAL_INT32(UINT16_MAX, belief.pitch_q16[2]);
    belief.yaw_q16[STILL + 3] = belief.yaw_q16[STILL + 9] = 32768;
    ih_pose_learn(&belief, &likelihood, 128, 128); /* 2 to 1 */
    TEST_ASSERT_INT32_WITHIN(16, 65536 * 2 / 3, belief.yaw_q16[STILL + 3]);
    check_sums(&belief);
}

/* However sure one was, a few frames that say otherwise suffice: some of the beginning stays for each. */
static void frames_may_overrule(void)
{
    struct ih_pose_belief belief;
    int32_t frames = 0;

    for (int32_t i = 0; i < IH_POSE_OUTPUTS; i++) {
        likelihood.log2_q10[i] = -30 * 1024;
    }
    likelihood.log2_q10[0] = likelihood.log2_q10[IH_POSE_YAWS] = 0;
    be_certain(&belief, 12, 8);
    for (; yaw_of(&belief, 0) < params.known_min_q16 && frames < 10; frames++) {
        ih_pose_wait(&belief, &params, belief.time_us + 1);
        ih_pose_learn(&belief, &likelihood, params.yaw.follow_q8, params.pitch.follow_q8);
        check_sums(&belief);
    }
    TEST_ASSERT_LESS_THAN_INT32(3, frames);
}

/* A head of a track before the camera, as far as ih_pose looks at it. */
static void add_head(int32_t track_id, bool is_predicted)
{
    const struct ih_ellipsoid head = vector_looks[0].head;
    struct ih_result_entry *entry = &result.entry[result.entry_count];
    if (is_predicted) {
        predicted.head[predicted.count++].head = head;
    } else {
        detections.detection[detections.detection_count++].head = head;
    }
    tracks.track[tracks.track_count++].id = track_id;
    *entry = (struct ih_result_entry){.track_id = track_id, .is_predicted = is_predicted};
    memcpy(entry->centre_mm_q8, head.centre_mm_q8, sizeof entry->centre_mm_q8);
    result.entry_count++;
}

static void update(int64_t time_us)
{
    tracks.time_us = time_us;
    ih_pose_update(&pose, &params, &points, &rig, &detections, &predicted, &tracks, &scratch,
                   &result);
}

static void beliefs_come_and_go_with_their_tracks(void)
{
    use_look(&vector_looks[0]);
    for (int32_t i = 0; i < IH_TRACKS_MAX; i++) {
        add_head(i + 5, false);
    }
    update(1000);
    TEST_ASSERT_EQUAL_INT32(IH_TRACKS_MAX, pose.belief_count);
    update(2000);
    TEST_ASSERT_EQUAL_INT32(IH_TRACKS_MAX, pose.belief_count);
    TEST_ASSERT_EQUAL_INT64(2000, pose.belief[3].time_us);
    tracks.track[0].id = 99; /* the first ended, another began */
    result.entry[0].track_id = 99;
    update(3000);
    TEST_ASSERT_EQUAL_INT32(IH_TRACKS_MAX, pose.belief_count);
    TEST_ASSERT_EQUAL_INT32(6, pose.belief[0].track_id);
    TEST_ASSERT_EQUAL_INT32(99, pose.belief[IH_TRACKS_MAX - 1].track_id);
    tracks.track_count = 0;
    result.entry_count = 0;
    update(4000);
    TEST_ASSERT_EQUAL_INT32(0, pose.belief_count);
}

static void what_is_no_head_has_no_pose(void)
{
    use_look(&vector_looks[0]);
    add_head(1, false);
    result.entry[0].rejected = IH_REJECT_SCORE;
    update(1000);
    TEST_ASSERT_EQUAL_INT32(0, pose.belief_count);
    TEST_ASSERT_FALSE(result.entry[0].pose.is_known);
    result.entry[0].rejected = IH_ACCEPTED;
    result.entry[0].track_id = 0;
    update(2000);
    TEST_ASSERT_EQUAL_INT32(0, pose.belief_count);
}

/* A predicted head is not looked at: it only becomes less certain. */
static void predicted_heads_are_not_looked_at(void)
{
    use_look(&vector_looks[0]);
    params.yaw = (struct ih_pose_axis){.side_q16 = 16384};
    params.rate_side_q16 = 0;
    add_head(1, true);
    pose.belief_count = 1;
    be_certain(&pose.belief[0], 12, 4);
    pose.belief[0].track_id = 1;
    update(params.step_us);
    TEST_ASSERT_INT32_WITHIN(2500, 32768, pose.belief[0].yaw_q16[STILL + 12]);
    TEST_ASSERT_INT32_WITHIN(2500, 16384, pose.belief[0].yaw_q16[STILL + 11]);
    update((int64_t)60 * params.step_us);
    update((int64_t)120 * params.step_us);
    TEST_ASSERT_FALSE(result.entry[0].pose.is_known);
}

/* A frame that is less sure of the head says less of its yaw. */
static void a_doubtful_head_says_less(void)
{
    int32_t below_q16 = 0;
    use_look(&vector_looks[0]);
    for (int32_t probability_q16 = 0; probability_q16 <= 65536; probability_q16 += 16384) {
        int32_t largest_q16 = 0;
        memset(&pose, 0, sizeof pose);
        detections.detection_count = tracks.track_count = result.entry_count = 0;
        add_head(1, false);
        result.entry[0].frame_probability_q16 = probability_q16;
        update(1000);
        for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
            largest_q16 = ih_max_s32(largest_q16, yaw_of(&pose.belief[0], i));
        }
        TEST_ASSERT_GREATER_THAN_INT32(below_q16, largest_q16);
        below_q16 = largest_q16;
    }
}

/* A camera that is tilted by 30 degrees down, or rolled, sees the same face at other angles: those of its direction in its
 * own frame, by double arithmetic. */
static void directions_are_those_of_the_camera(void)
{
    static const double ups[][3] = {
        {0, -0.8, -0.6}, {0, -0.8, 0.6}, {0.28, -0.96, 0}, {-0.48, -0.6, 0.64}};
    for (size_t i = 0; i < IH_TEST_COUNT(ups); i++) {
        for (int32_t yaw = 0; yaw < IH_POSE_YAWS; yaw++) {
            const int32_t pitch = (yaw * 5) % IH_POSE_PITCHES;
            const double a = (yaw * 15.0 - 172.5) * RADIANS, b = (pitch * 10.0 - 40.0) * RADIANS;
            const double level[3] = {sin(a) * cos(b), -sin(b), -cos(a) * cos(b)};
            double face[3] = {0, 0, 0};
            struct ih_head_pose *said = &result.entry[0].pose;
            setUp();
            for (int axis = 0; axis < 3; axis++) {
                rig.calibration.up_q30[axis] = (int32_t)lround(ups[i][axis] * (1 << 30));
            }
            TEST_ASSERT_EQUAL_INT(IH_OK, ih_level_init(&rig));
            for (int axis = 0; axis < 3; axis++) {
                for (int k = 0; k < 3; k++) {
                    face[axis] += rig.level_q30[k][axis] / (double)(1 << 30) * level[k];
                }
            }
            params.yaw.leak_q16 = params.pitch.leak_q16 = 0;
            add_head(1, true);
            predicted.head[0].head.centre_mm_q8[0] = 0;
            pose.belief_count = 1;
            be_certain(&pose.belief[0], yaw, pitch);
            pose.belief[0].track_id = 1;
            update(0);
            TEST_ASSERT_TRUE(said->is_known);
            TEST_ASSERT_DOUBLE_WITHIN(
                0.02, 0,
                remainder(atan2(face[0], -face[2]) / RADIANS - said->yaw_mdeg / 1000.0, 360));
            TEST_ASSERT_DOUBLE_WITHIN(0.02, asin(-face[1]) / RADIANS, said->pitch_mdeg / 1000.0);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(beliefs_begin_as_what_was_learnt_and_are_not_known);
    RUN_TEST(directions_are_against_the_cameras_axis);
    RUN_TEST(a_mean_goes_across_the_back);
    RUN_TEST(two_peaks_are_not_known);
    RUN_TEST(time_spreads_in_proportion);
    RUN_TEST(yaws_are_a_ring_and_pitches_are_not);
    RUN_TEST(long_times_end_in_what_it_began_with);
    RUN_TEST(turning_heads_go_on);
    RUN_TEST(turning_heads_are_followed_without_a_lag);
    RUN_TEST(a_frame_multiplies);
    RUN_TEST(frames_may_overrule);
    RUN_TEST(beliefs_come_and_go_with_their_tracks);
    RUN_TEST(what_is_no_head_has_no_pose);
    RUN_TEST(a_doubtful_head_says_less);
    RUN_TEST(directions_are_those_of_the_camera);
    RUN_TEST(predicted_heads_are_not_looked_at);
    return UNITY_END();
}
