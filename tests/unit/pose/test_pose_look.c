/* ih_pose_look: features and mean heads against a float64 reference with weights of the test's own, as the learnt ones may
 * change. */
#include "base/ih_config.h"
#include "pose/ih_pose_look.h"

#include "ih_test.h"
#include "ih_test_look.h"

static struct ih_pose_look_scratch look;
static struct ih_pose_means means;
static struct ih_pose_likelihood likelihood;

void setUp(void)
{
    memset(&points, 0, sizeof points);
    memset(&rig, 0, sizeof rig);
    memset(&look, IH_TEST_FILL, sizeof look);
    memset(&likelihood, IH_TEST_FILL, sizeof likelihood);
}

void tearDown(void)
{
}

/* As tools/oracle/pose.py has it. */
static void fill_means(void)
{
    for (int32_t i = 0; i < IH_POSE_MEANS; i++) {
        means.bias_q10[i] = (i * 1237) % 8191 - 4095;
        for (int32_t k = 0; k < IH_POSE_FEATURES; k++) {
            /* Those of pitch are their own mirror images. */
            const bool is_pitch = i >= IH_POSE_YAWS / 2 && k < IH_POSE_FEATURES - 5;
            const int32_t column = k % IH_POSE_COLUMNS;
            const int32_t twin = k - column + ih_min_s32(column, IH_POSE_COLUMNS - 1 - column);
            const int32_t at = is_pitch ? twin : k;
            means.line_q5[i][k] = (int8_t)((i * 37 + at * 101 + i * at) % 61 - 30);
            means.square_q5[i][k] = (int8_t)((i * 53 + at * 29 + i * at) % 41 - 20);
        }
    }
}

/* A step of a feature is 1/32; a point at the border of its range may fall on either side of it, so that the points of
 * the vectors keep away from it. */
static void features_are_those_of_the_reference(void)
{
    for (size_t i = 0; i < IH_TEST_COUNT(vector_looks); i++) {
        const struct vector_look *vector = &vector_looks[i];
        use_look(vector);
        TEST_ASSERT_TRUE(ih_pose_look_features(&points, &rig, &vector->head, 10, &look));
        for (int32_t k = 0; k < IH_POSE_FEATURES; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(0.06, vector->feature[k], look.feature_q5[0][k] / 32.0);
        }
    }
}

static void outputs_are_those_of_the_reference(void)
{
    fill_means();
    for (size_t i = 0; i < IH_TEST_COUNT(vector_looks); i++) {
        const struct vector_look *vector = &vector_looks[i];
        use_look(vector);
        TEST_ASSERT_TRUE(ih_pose_look_features(&points, &rig, &vector->head, 10, &look));
        ih_pose_look_weigh(&means, &look, &likelihood);
        for (int32_t k = 0; k < IH_POSE_OUTPUTS; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(0.25, vector->log2[k], likelihood.log2_q10[k] / 1024.0);
        }
    }
}

/* A head and its mirror image: yaws change sides, pitches stay. */
static void left_and_right_are_equal(void)
{
    struct ih_pose_likelihood mirrored;
    struct ih_ellipsoid head = vector_looks[0].head;

    use_look(&vector_looks[0]);
    TEST_ASSERT_TRUE(ih_pose_look_features(&points, &rig, &head, 10, &look));
    ih_pose_look_weigh(&ih_pose_means, &look, &likelihood);
    head.centre_mm_q8[0] = -head.centre_mm_q8[0];
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        points.point[slot].x_q28 = -points.point[slot].x_q28;
    }
    TEST_ASSERT_TRUE(ih_pose_look_features(&points, &rig, &head, 10, &look));
    ih_pose_look_weigh(&ih_pose_means, &look, &mirrored);
    for (int32_t i = 0; i < IH_POSE_YAWS; i++) {
        TEST_ASSERT_INT32_WITHIN(256, likelihood.log2_q10[i],
                                 mirrored.log2_q10[IH_POSE_YAWS - 1 - i]);
    }
    for (int32_t i = IH_POSE_YAWS; i < IH_POSE_OUTPUTS; i++) {
        TEST_ASSERT_INT32_WITHIN(256, likelihood.log2_q10[i], mirrored.log2_q10[i]);
    }
}

static void few_points_say_nothing(void)
{
    struct ih_ellipsoid head = {.centre_mm_q8 = {0, 0, 900 << 8},
                                .semi_mm_q8 = {20000, 29000, 25000}};

    rig.line[IH_SLOTS / 2].length_px_mm_q8 = 11500 << 8;
    points.field.unit_q28 = 1 << 22;
    TEST_ASSERT_FALSE(ih_pose_look_features(&points, &rig, &head, 10, &look));
    for (int32_t i = 0; i < 10; i++) {
        TEST_ASSERT_FALSE(ih_pose_look_features(&points, &rig, &head, 10, &look));
        points.point[i] = (struct ih_point){.depth_mm_q8 = 820 << 8, .state = IH_POINT_SEEN};
    }
    TEST_ASSERT_TRUE(ih_pose_look_features(&points, &rig, &head, 10, &look));
    points.point[3].depth_mm_q8 = 3000 << 8; /* the wall */
    TEST_ASSERT_FALSE(ih_pose_look_features(&points, &rig, &head, 10, &look));
    points.point[3].depth_mm_q8 = 820 << 8;
    head.centre_mm_q8[2] = 0; /* in the camera */
    TEST_ASSERT_FALSE(ih_pose_look_features(&points, &rig, &head, 10, &look));
}

/* All points in one cell, at every end of what a point can be: nothing overflows (make ranges), every feature is in
 * its range. */
static void the_ends_of_all_ranges_are_taken(void)
{
    static const int32_t centres_mm_q8[][3] = {
        {0, 0, 256}, {1 << 26, 1 << 26, 1 << 26}, {-(1 << 26), -(1 << 26), 1 << 20}, {5, -7, 300}};
    fill_means();
    memset(means.line_q5, 127, sizeof means.line_q5);
    memset(means.square_q5, 127, sizeof means.square_q5);
    for (size_t i = 0; i < IH_TEST_COUNT(centres_mm_q8); i++) {
        struct ih_ellipsoid head = {.semi_mm_q8 = {220 << 8, 220 << 8, 220 << 8}};
        memcpy(head.centre_mm_q8, centres_mm_q8[i], sizeof head.centre_mm_q8);
        for (int32_t kind = 0; kind < 2; kind++) {
            rig.calibration.kind = (enum ih_rig_kind)kind;
            rig.line[IH_SLOTS / 2].length_px_mm_q8 = 25600;
            points.field.unit_q28 = 67108864;
            for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
                points.point[slot] = (struct ih_point){
                    .x_q28 = (slot & 1) != 0 ? INT32_MAX : INT32_MIN,
                    .y_q28 = (slot & 2) != 0 ? INT32_MAX : INT32_MIN,
                    .depth_mm_q8 = slot < 200 ? head.centre_mm_q8[2] : 1 << 22,
                    .state = IH_POINT_SEEN,
                };
                if (slot < 200) {
                    points.point[slot].x_q28 =
                        (int32_t)((int64_t)head.centre_mm_q8[0] * (1 << 28) /
                                  ih_max_s32(head.centre_mm_q8[2], 1) % INT32_MAX);
                    points.point[slot].y_q28 =
                        (int32_t)((int64_t)head.centre_mm_q8[1] * (1 << 28) /
                                  ih_max_s32(head.centre_mm_q8[2], 1) % INT32_MAX);
                }
            }
            if (ih_pose_look_features(&points, &rig, &head, 0, &look)) {
                for (int32_t k = 0; k < IH_POSE_FEATURES; k++) {
                    TEST_ASSERT_TRUE(look.feature_q5[0][k] > -128);
                }
                ih_pose_look_weigh(&means, &look, &likelihood);
            }
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(features_are_those_of_the_reference);
    RUN_TEST(outputs_are_those_of_the_reference);
    RUN_TEST(left_and_right_are_equal);
    RUN_TEST(few_points_say_nothing);
    RUN_TEST(the_ends_of_all_ranges_are_taken);
    return UNITY_END();
}
