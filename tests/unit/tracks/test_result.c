/* ih_result: one form for both methods. */
#include "base/ih_config.h"
#include "detect/ih_detections.h"
#include "nests/ih_hypotheses.h"
#include "nests/ih_nests.h"
#include "rig/ih_rig.h"
#include "tracks/ih_result.h"
#include "tracks/ih_tracks.h"

#include "ih_test.h"

/* What the model of a head does not know, in quadrature; at most MAX_MM in all. */
#define MODEL_MM 30
#define MAX_MM 500

static struct ih_hypotheses hypotheses;
static struct ih_detections detections;
static struct ih_tracks tracks;
static struct ih_predicted predicted;
static struct ih_result result;
static struct ih_rig rig;

void setUp(void)
{
    memset(&hypotheses, 0, sizeof hypotheses);
    memset(&detections, 0, sizeof detections);
    memset(&predicted, 0, sizeof predicted);
    memset(&rig, 0, sizeof rig);
    rig.is_level = true;
    ih_tracks_init(&tracks);
    memset(&result, IH_TEST_FILL, sizeof result);
}

void tearDown(void)
{
}

static void empty_lists_give_an_empty_result(void)
{
    ih_result_clear(&result);
    TEST_ASSERT_EQUAL_INT32(0, result.entry_count);
    TEST_ASSERT_EQUAL_INT32(0, result.head_count);
    TEST_ASSERT_EQUAL_INT32(IH_NONE, result.selected);
    memset(&result, IH_TEST_FILL, sizeof result);
    ih_result_from_hypotheses(&hypotheses, &rig, &result);
    TEST_ASSERT_EQUAL_INT32(0, result.entry_count);
    TEST_ASSERT_EQUAL_INT32(IH_NONE, result.selected);
    memset(&result, IH_TEST_FILL, sizeof result);
    ih_result_from_tracks(&detections, &tracks, &predicted, &rig, &result);
    TEST_ASSERT_EQUAL_INT32(0, result.entry_count);
    TEST_ASSERT_EQUAL_INT32(IH_NONE, result.selected);
}

/* The paper's method alone selects a head only where there is one. */
static void nests_come_through_without_what_tracks_add(void)
{
    int i;

    hypotheses.hypothesis_count = IH_NESTS_MAX;
    for (i = 0; i < IH_NESTS_MAX; i++) {
        hypotheses.hypothesis[i] =
            (struct ih_hypothesis){.u_px_q12 = 100 + i,
                                   .v_px_q12 = 200 + i,
                                   .a_px_q12 = 300 + i,
                                   .b_px_q12 = 290 + i,
                                   .angle_mdeg = 400 + i,
                                   .distance_mm_q8 = 500 + i,
                                   .centre_mm_q8 = {600 + i, 700 + i, 800 + i},
                                   .rejected = IH_REJECT_AREA};
    }
    hypotheses.hypothesis[3].rejected = IH_ACCEPTED;
    hypotheses.head_count = 1;
    hypotheses.head[0] = 3;
    ih_result_from_hypotheses(&hypotheses, &rig, &result);
    TEST_ASSERT_EQUAL_INT32(IH_NESTS_MAX, result.entry_count);
    for (i = 0; i < IH_NESTS_MAX; i++) {
        const struct ih_result_entry *entry = &result.entry[i];

        IH_TEST_EQUAL(100 + i, entry->u_px_q12, "u", i);
        IH_TEST_EQUAL(200 + i, entry->v_px_q12, "v", i);
        IH_TEST_EQUAL(300 + i, entry->a_px_q12, "a", i);
        IH_TEST_EQUAL(290 + i, entry->b_px_q12, "b", i);
        IH_TEST_EQUAL(400 + i, entry->angle_mdeg, "angle", i);
        IH_TEST_EQUAL(500 + i, entry->distance_mm_q8, "distance", i);
        IH_TEST_EQUAL(800 + i, entry->centre_mm_q8[2], "z", i);
        IH_TEST_EQUAL(i == 3 ? IH_ACCEPTED : IH_REJECT_AREA, entry->rejected, "rejected", i);
        IH_TEST_EQUAL(0, entry->has_probability || entry->is_predicted, "no probability", i);
        IH_TEST_EQUAL(0, entry->track_id, "no track", i);
    }
    TEST_ASSERT_EQUAL_INT32(1, result.head_count);
    TEST_ASSERT_EQUAL_INT32(3, result.selected);
    hypotheses.head_count = 2;
    hypotheses.head[1] = 5;
    ih_result_from_hypotheses(&hypotheses, &rig, &result);
    TEST_ASSERT_EQUAL_INT32(2, result.head_count);
    TEST_ASSERT_EQUAL_INT32(5, result.head[1]);
    TEST_ASSERT_EQUAL_INT32(IH_NONE, result.selected);
}

static struct ih_detection *head_at(int32_t index)
{
    return index < detections.detection_count ? &detections.detection[index]
                                              : &predicted.head[index - detections.detection_count];
}

/* Full tables; the tracks belong to every second detection, or to the predicted heads. */
static void fill(bool is_predicted)
{
    int i;

    detections.detection_count = IH_DETECTIONS_MAX;
    predicted.count = is_predicted ? IH_TRACKS_MAX : 0;
    for (i = 0; i < detections.detection_count + predicted.count; i++) {
        struct ih_detection *detection = head_at(i);

        detection->u_px_q12 = 100 + i;
        detection->v_px_q12 = 200 + i;
        detection->a_px_q12 = 300 + i;
        detection->b_px_q12 = 290 + i;
        detection->angle_mdeg = 90000;
        detection->distance_mm_q8 = 500 + i;
        detection->head.centre_mm_q8[1] = 700 + i;
        detection->probability_q16 = 1000 + i;
    }
    tracks.track_count = IH_TRACKS_MAX;
    for (i = 0; i < IH_TRACKS_MAX; i++) {
        tracks.track[i] = (struct ih_track){.id = 10 + i,
                                            .is_head = i % 2 == 1,
                                            .mean_logit_q10 = 0, /* a probability of one half */
                                            .index = is_predicted ? IH_DETECTIONS_MAX + i : 2 * i};
        tracks.track[i].filter.position_q8 = (4 + i) * (4 + i) << 8;
    }
    tracks.head_count = 2;
    tracks.head[0] = tracks.track[7].index;
    tracks.head[1] = tracks.track[3].index;
    tracks.selected = tracks.track[3].index;
}

static void expect_verdict(const struct ih_result_entry *entry, int index, int track)
{
    const bool is_tracked = track != IH_NONE;

    IH_TEST_EQUAL(is_tracked ? 10 + track : 0, entry->track_id, "track", index);
    IH_TEST_WITHIN(1, is_tracked ? 256 * hypot(4 + track, MODEL_MM) : 0, entry->sigma_mm_q8,
                   "sigma", index);
    IH_TEST_EQUAL(is_tracked ? 32768 : 1000 + index, entry->probability_q16, "probability", index);
    IH_TEST_EQUAL(is_tracked && track % 2 == 1 ? IH_ACCEPTED : IH_REJECT_SCORE, entry->rejected,
                  "rejected", index);
}

/* From the smallest that a filter can have to its limit. */
static void sigma_has_what_the_model_does_not_know(void)
{
    for (int mm = 1; mm <= MAX_MM; mm++) {
        fill(false);
        tracks.track[0].filter.position_q8 = (int64_t)mm * mm * 256;
        ih_result_from_tracks(&detections, &tracks, &predicted, &rig, &result);
        IH_TEST_WITHIN(1, 256 * fmin(hypot(mm, MODEL_MM), MAX_MM), result.entry[0].sigma_mm_q8,
                       "sigma", mm);
    }
}

static void full_tables_come_through(void)
{
    int pass, i;

    for (pass = 0; pass < 2; pass++) {
        setUp();
        fill(pass == 1);
        ih_result_from_tracks(&detections, &tracks, &predicted, &rig, &result);
        TEST_ASSERT_EQUAL_INT32(pass == 1 ? IH_RESULT_MAX : IH_DETECTIONS_MAX, result.entry_count);
        for (i = 0; i < result.entry_count; i++) {
            const struct ih_result_entry *entry = &result.entry[i];
            const bool is_predicted = i >= IH_DETECTIONS_MAX;
            const int of_detection = pass == 0 && i % 2 == 0 ? i / 2 : IH_NONE;

            IH_TEST_EQUAL(100 + i, entry->u_px_q12, "u", i);
            IH_TEST_EQUAL(200 + i, entry->v_px_q12, "v", i);
            IH_TEST_EQUAL(300 + i, entry->a_px_q12, "a", i);
            IH_TEST_EQUAL(290 + i, entry->b_px_q12, "b", i);
            IH_TEST_EQUAL(90000, entry->angle_mdeg, "angle", i);
            IH_TEST_EQUAL(500 + i, entry->distance_mm_q8, "distance", i);
            IH_TEST_EQUAL(700 + i, entry->centre_mm_q8[1], "y", i);
            IH_TEST_EQUAL(1, entry->has_probability, "has probability", i);
            IH_TEST_EQUAL(is_predicted, entry->is_predicted, "predicted", i);
            IH_TEST_EQUAL(1000 + i, entry->frame_probability_q16, "by its frame", i);
            expect_verdict(entry, i, is_predicted ? i - IH_DETECTIONS_MAX : of_detection);
        }
        TEST_ASSERT_EQUAL_INT32(2, result.head_count);
        TEST_ASSERT_EQUAL_INT32(tracks.track[7].index, result.head[0]);
        TEST_ASSERT_EQUAL_INT32(tracks.track[3].index, result.head[1]);
        TEST_ASSERT_EQUAL_INT32(tracks.track[3].index, result.selected);
    }
}

/* Lists are in the level frame, the result in the camera's, here one that hangs upside down. */
static void centres_are_rotated_back(void)
{
    int i;

    rig.is_level = false;
    rig.level_back_q30[0][0] = rig.level_back_q30[1][1] = -(1 << 30);
    rig.level_back_q30[2][2] = 1 << 30;
    fill(true);
    ih_result_from_tracks(&detections, &tracks, &predicted, &rig, &result);
    for (i = 0; i < result.entry_count; i++) {
        const int32_t *level = ih_tracks_head(&detections, &predicted, i)->head.centre_mm_q8;

        IH_TEST_EQUAL(-level[0], result.entry[i].centre_mm_q8[0], "x", i);
        IH_TEST_EQUAL(-level[1], result.entry[i].centre_mm_q8[1], "y", i);
        IH_TEST_EQUAL(level[2], result.entry[i].centre_mm_q8[2], "z", i);
        IH_TEST_EQUAL(100 + i, result.entry[i].u_px_q12, "u", i);
    }
    hypotheses.hypothesis_count = 1;
    hypotheses.hypothesis[0].centre_mm_q8[0] = 77;
    ih_result_from_hypotheses(&hypotheses, &rig, &result);
    TEST_ASSERT_EQUAL_INT32(-77, result.entry[0].centre_mm_q8[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(empty_lists_give_an_empty_result);
    RUN_TEST(nests_come_through_without_what_tracks_add);
    RUN_TEST(sigma_has_what_the_model_does_not_know);
    RUN_TEST(full_tables_come_through);
    RUN_TEST(centres_are_rotated_back);
    return UNITY_END();
}
