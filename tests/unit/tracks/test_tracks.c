/* ih_tracks against whole sequences of a float64 Kalman filter with its rules, and its behaviour:
 * which tracks coast, which end, which head is selected, at any times and in any order of detections. */
#include "base/ih_config.h"
#include "base/ih_types.h"
#include "detect/ih_detections.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_evidence.h"
#include "rig/ih_rig.h"
#include "tracks/ih_tracks.h"

#include "ih_test.h"

struct vector_found {
    int32_t centre_mm_q8[3], semi_mm_q8[3];
    int32_t logit_q10;
    int32_t track_id;
};

struct vector_state {
    int32_t id, is_head, seen;
    double centre_mm[3], velocity_mm_s[3], semi_mm[3];
    double place, cross, speed, logit;
};

struct vector_frame {
    int64_t time_us;
    int32_t found_count, state_count;
    struct ih_view view; /* of every expected head */
    int32_t selected_id;
};

struct vector_sequence {
    const char *name;
    int32_t frame_count;
    const struct vector_frame *frame;
    const struct vector_found *found;
    const struct vector_state *state;
};

#include "rigs.inc"
#include "tracks.inc"

#define PLAIN_RIG 2 /* of vector_rigs: a lens without distortion */
#define FRAME_US 40000

static const struct ih_view nothing = {0, 0, 0}, hit = {1, 14, 0}, through = {16, 1, 1},
                            front = {2, 3, 12};

static struct ih_rig rig;
static struct ih_tracks tracks;
static struct ih_tracks_params params;
static struct ih_expected expected;
static struct ih_detections detections;
static struct ih_predicted predicted;
static struct ih_view view; /* of every expected head in the next frames */
static int64_t time_us;

/* The tests' own parameters, so that tuning the defaults does not touch them. */
void setUp(void)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[PLAIN_RIG], &bad_slot));
    memset(&tracks, IH_TEST_FILL, sizeof tracks);
    memset(&detections, IH_TEST_FILL, sizeof detections);
    memset(&predicted, IH_TEST_FILL, sizeof predicted);
    ih_detections_begin(&detections);
    ih_tracks_init(&tracks);
    ih_tracks_params_default(&params);
    params.gate_mm = 90;
    params.gate_mm_per_s = 300;
    params.start_logit_q10 = -1024;
    params.start_head_logit_q10 = 1024;
    params.mature_detections = 3;
    params.accept_logit_q10 = 512;
    params.drop_logit_q10 = -512;
    params.keep_logit_q10 = -3072;
    params.moved_mm = 25;
    params.moved_logit_q10 = 1024;
    params.memory_q16 = 49152;
    params.through_percent = 50;
    params.front_percent = 30;
    params.seen_min = 30;
    detections.seen_count = 300;
    params.coast_us = 1000000;
    params.blind_us = 300000;
    params.gap_us = 2000000;
    params.measured_mm = 12;
    params.acceleration_mm_s2 = 2500;
    params.switch_frames = 3;
    params.side = IH_SIDE_NEAREST;
    view = hit;
    time_us = 1000000;
}

void tearDown(void)
{
}

/* --- frames --------------------------------------------------------------------------------------
 */

static struct ih_detection *add(double x, double y, double z, double logit)
{
    struct ih_detection *detection = &detections.detection[detections.detection_count++];
    const int32_t centre[3] = {(int32_t)lround(x * 256), (int32_t)lround(y * 256),
                               (int32_t)lround(z * 256)};

    memset(detection, 0, sizeof *detection);
    detection->head = ih_ellipsoid_mean(centre);
    detection->logit_q10 = (int32_t)lround(logit * 1024);
    return detection;
}

static struct ih_verdict verdict(int32_t index)
{
    return ih_tracks_verdict(&tracks, &detections, index);
}

/* What must hold after every frame. */
static void check_tracks(void)
{
    int32_t t, k;

    IH_TEST_RANGE(0, IH_TRACKS_MAX, tracks.track_count, "tracks", 0);
    IH_TEST_RANGE(0, IH_TRACKS_MAX, predicted.count, "predicted heads", 0);
    for (t = 0; t < tracks.track_count; t++) {
        const struct ih_track *track = &tracks.track[t];
        struct ih_verdict own;

        IH_TEST_RANGE(1, INT32_MAX, track->id, "id", t);
        for (k = 0; k < t; k++) {
            TEST_ASSERT_TRUE(tracks.track[k].id != track->id);
        }
        if (track->index == IH_NONE) { /* not reported */
            TEST_ASSERT_TRUE(track->is_head && detections.seen_count < params.seen_min &&
                             tracks.time_us - track->seen_us > params.blind_us);
            continue;
        }
        own = verdict(track->index);
        IH_TEST_RANGE(0, detections.detection_count + predicted.count - 1, track->index,
                      "its index", t);
        IH_TEST_EQUAL(track->id, own.track_id, "the verdict's track", t);
        IH_TEST_EQUAL(track->is_head, own.is_head, "the verdict", t);
        IH_TEST_RANGE(0, 500 << 8, own.sigma_mm_q8, "sigma", t);
        TEST_ASSERT_TRUE(track->is_head || track->index < detections.detection_count);
    }
    for (k = 0; k < tracks.head_count; k++) {
        TEST_ASSERT_TRUE(verdict(tracks.head[k]).is_head);
        TEST_ASSERT_TRUE(k == 0 || verdict(tracks.head[k - 1]).logit_q10 >=
                                       verdict(tracks.head[k]).logit_q10);
    }
    if (tracks.selected == IH_NONE) {
        IH_TEST_EQUAL(0, tracks.head_count, "heads, none of them selected", 0);
        IH_TEST_EQUAL(0, tracks.selected_id, "selected id", 0);
    } else {
        TEST_ASSERT_TRUE(verdict(tracks.selected).is_head);
        IH_TEST_EQUAL(verdict(tracks.selected).track_id, tracks.selected_id, "selected id", 0);
    }
}

/* Detections and predicted heads of the last frame. */
static int32_t listed_count;
/* As they were before the frame's detections. */
static struct ih_tracks before;

static void frame_at(int64_t at_us)
{
    int32_t i;

    time_us = at_us;
    ih_tracks_expect(&tracks, &params, at_us, &expected);
    IH_TEST_EQUAL(tracks.track_count, expected.count, "expected", 0);
    for (i = 0; i < IH_DETECTIONS_EXPECTED_MAX; i++) {
        detections.view[i] = i < expected.count ? view : nothing;
    }
    before = tracks;
    ih_tracks_update(&tracks, &params, &rig, &detections, &predicted);
    check_tracks();
    listed_count = detections.detection_count + predicted.count;
    detections.detection_count = 0; /* they stay readable */
}

static void frame(void)
{
    frame_at(time_us + FRAME_US);
}

static void frames_with(int count, double x, double y, double z, double logit)
{
    int i;

    for (i = 0; i < count; i++) {
        add(x, y, z, logit);
        frame();
    }
}

static void frames_without(int count)
{
    int i;

    for (i = 0; i < count; i++) {
        frame();
    }
}

static double sigma_mm(int32_t track)
{
    return verdict(tracks.track[track].index).sigma_mm_q8 / 256.0;
}

static bool is_coasting(int32_t track)
{
    return tracks.track[track].index >= listed_count - predicted.count;
}

static double from_q8(int64_t value)
{
    return ih_test_from_q(value, 8);
}

/* --- against float64 -----------------------------------------------------------------------------
 */

/* Positions are rounded to 1/256 mm a few times a frame; a gain to 2^-17, which on an innovation of at
 * most 500 mm is 0.004 mm. The filter forgets within about five frames: 0.02 mm. The gain of the
 * speed is below 13 1/s, its rounding the same: 0.004 mm/s; the time step is rounded to 1 us, 25
 * ppm of 40 ms. A position error appears 13 times in the speed. Variances: steps of 25 ppm,
 * collected over some frames: 3e-4 of the value, and a gain's rounding of 2^-17 times the variance
 * before the detection. After a long step that was 250,000 mm^2, and what is left of it, 2 of 144
 * mm^2, is felt until ten sure detections have come. */
#define SURE_Q10 (2 << 10)
#define IDS_MAX 64
static int sure_since_long[IDS_MAX]; /* by the track's id */

static void check_state(const struct vector_sequence *sequence, int frame_index,
                        const struct vector_state *expected_state, const struct ih_track *track)
{
    const char *name = sequence->name;
    const double part = sure_since_long[track->id % IDS_MAX] < 10 ? 0.02 : 3e-4;
    double gain_position = 0, gain_cross = 0, speed = expected_state->speed;
    int axis;

    for (axis = 0; axis < before.track_count; axis++) {
        if (before.track[axis].id == track->id) {
            gain_position = from_q8(before.track[axis].filter.position_q8) / 65536;
            gain_cross = fabs(from_q8(before.track[axis].filter.cross_q8)) / 65536;
            speed =
                from_q8(before.track[axis].filter.velocity_q8); /* what is left is a difference */
        }
    }

    IH_TEST_EQUAL(expected_state->id, track->id, name, frame_index);
    IH_TEST_EQUAL(expected_state->is_head, track->is_head, name, frame_index);
    IH_TEST_EQUAL(!expected_state->seen, track->index >= listed_count - predicted.count, name,
                  frame_index);
    for (axis = 0; axis < 3; axis++) {
        IH_TEST_WITHIN(0.05, expected_state->centre_mm[axis],
                       from_q8(track->filter.head.centre_mm_q8[axis]), name, frame_index);
        IH_TEST_WITHIN(0.65, expected_state->velocity_mm_s[axis],
                       from_q8(track->filter.velocity_mm_s_q8[axis]), name, frame_index);
        IH_TEST_WITHIN(0.02, expected_state->semi_mm[axis],
                       from_q8(track->filter.head.semi_mm_q8[axis]), name, frame_index);
    }
    IH_TEST_WITHIN(0.05 + part * expected_state->place + gain_position, expected_state->place,
                   from_q8(track->filter.position_q8), name, frame_index);
    IH_TEST_WITHIN(1 + part * fabs(expected_state->cross) + gain_cross, expected_state->cross,
                   from_q8(track->filter.cross_q8), name, frame_index);
    IH_TEST_WITHIN(1 + part * speed + gain_cross, expected_state->speed,
                   from_q8(track->filter.velocity_q8), name, frame_index);
    IH_TEST_WITHIN(0.003, expected_state->logit, ih_test_from_q(track->mean_logit_q10, 10), name,
                   frame_index);
}

static void play(const struct vector_sequence *sequence)
{
    const struct vector_found *found = sequence->found;
    const struct vector_state *state = sequence->state;
    int i, k;

    for (i = 0; i < sequence->frame_count; i++) {
        const struct vector_frame *now = &sequence->frame[i];

        for (k = 0; k < now->found_count; k++) {
            struct ih_detection *detection = add(0, 0, 0, 0);

            memcpy(detection->head.centre_mm_q8, found[k].centre_mm_q8,
                   sizeof found[k].centre_mm_q8);
            memcpy(detection->head.semi_mm_q8, found[k].semi_mm_q8, sizeof found[k].semi_mm_q8);
            detection->logit_q10 = found[k].logit_q10;
        }
        view = now->view;
        if (now->time_us - time_us > 300000) {
            memset(sure_since_long, 0, sizeof sure_since_long);
        }
        frame_at(now->time_us);
        for (k = 0; k < now->found_count; k++) {
            IH_TEST_EQUAL(found[k].track_id, verdict(k).track_id, sequence->name, i);
            sure_since_long[verdict(k).track_id % IDS_MAX] += found[k].logit_q10 >= SURE_Q10;
        }
        IH_TEST_EQUAL(now->state_count, tracks.track_count, sequence->name, i);
        for (k = 0; k < now->state_count; k++) {
            check_state(sequence, i, &state[k], &tracks.track[k]);
        }
        IH_TEST_EQUAL(now->selected_id, tracks.selected_id, sequence->name, i);
        found += now->found_count;
        state += now->state_count;
    }
}

static void sequences_match_float64(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_sequences); i++) {
        setUp();
        play(&vector_sequences[i]);
    }
}

/* --- movement ------------------------------------------------------------------------------------
 */

/* Neither is surely a head: the one that stands, however it jitters, stays none; the other is one as soon as its
 * track is 25 mm from where it began, and stays one when it goes back. */
static void what_has_moved_needs_less(void)
{
    static const struct {
        double log_odds; /* accept_logit, 0.5, less moved_logit, 1, is -0.5 */
        bool becomes;
    } cases[] = {{0.49, true}, {-0.49, true}, {-0.51, false}};
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        bool moved = false;

        ih_tracks_init(&tracks);
        for (k = 0; k < 60; k++) {
            frames_with(1, k % 2 == 0 ? 8 : -8, 0, 800, cases[i].log_odds);
            IH_TEST_EQUAL(0, tracks.head_count, "heads of what stands", k);
        }
        for (k = 0; k < 60; k++) {
            frames_with(1, 8 + 2 * (k < 30 ? k : 60 - k), 0, 800, cases[i].log_odds);
            moved = moved || from_q8(tracks.track[0].filter.head.centre_mm_q8[0]) > 8 + 25;
            IH_TEST_EQUAL(moved && cases[i].becomes, tracks.head_count, "heads of what moves", k);
        }
        TEST_ASSERT_TRUE(moved);
    }
}

/* --- ids -----------------------------------------------------------------------------------------
 */

static void a_moving_head_keeps_its_id(void)
{
    int i;

    for (i = 0; i < 50; i++) { /* 0.5 m/s */
        add(-500 + 20 * i, -50, 800, 3);
        frame();
        TEST_ASSERT_EQUAL_INT32(1, tracks.track_count);
        TEST_ASSERT_EQUAL_INT32(1, tracks.track[0].id);
        TEST_ASSERT_EQUAL_INT32(0, tracks.selected);
        TEST_ASSERT_FALSE(is_coasting(0));
    }
    /* The speed is known: an exact line has no error but the filter's own. */
    IH_TEST_WITHIN(2, 500, from_q8(tracks.track[0].filter.velocity_mm_s_q8[0]), "speed", 0);
    IH_TEST_WITHIN(1, -500 + 20 * 49, from_q8(tracks.track[0].filter.head.centre_mm_q8[0]),
                   "position", 0);
}

static void crossing_heads_keep_their_ids(void)
{
    int i;

    for (i = 0; i < 50; i++) {
        const double x = -250 + 10 * i;

        if (i % 2 == 0) {
            add(x, -50, 700, 3);
        }
        add(-x, -50, 1000, 4);
        if (i % 2 != 0) {
            add(x, -50, 700, 3);
        }
        frame();
        TEST_ASSERT_EQUAL_INT32(2, tracks.track_count);
        TEST_ASSERT_EQUAL_INT32(i % 2 == 0 ? 1 : 2, verdict(0).track_id);
        TEST_ASSERT_EQUAL_INT32(i % 2 == 0 ? 2 : 1, verdict(1).track_id);
    }
}

/* Assignment depends on positions and log-odds. New ids follow the list, so all heads are there
 * already. */
static void the_order_of_detections_does_not_matter(void)
{
    struct ih_test_random random = {71};
    static struct ih_tracks start;
    int pass, i, k;

    for (pass = 0; pass < 300; pass++) {
        struct ih_detection drawn[12];
        int32_t track_id[12], order[12];

        setUp();
        for (i = 0; i < 4; i++) {
            add((double)ih_test_between(&random, -60, 60) + 330 * i,
                (double)ih_test_between(&random, -90, 90),
                800 + (double)ih_test_between(&random, -90, 90), 2);
        }
        frame();
        TEST_ASSERT_EQUAL_INT32(4, tracks.track_count);
        start = tracks;
        for (i = 0; i < 12; i++) {
            order[i] = i;
            drawn[i] = *add((double)ih_test_between(&random, -100, 1100) + i / 16.0,
                            (double)ih_test_between(&random, -120, 120),
                            800 + (double)ih_test_between(&random, -120, 120),
                            ih_test_unit(&random) * 10 - 5);
        }
        frame();
        for (i = 0; i < 12; i++) {
            track_id[i] = verdict(i).track_id;
        }
        for (i = 11; i > 0; i--) {
            const int32_t other = (int32_t)ih_test_between(&random, 0, i), kept = order[i];

            order[i] = order[other];
            order[other] = kept;
        }
        tracks = start;
        detections.detection_count = 12;
        for (i = 0; i < 12; i++) {
            detections.detection[i] = drawn[order[i]];
        }
        frame_at(time_us);
        for (k = 0; k < 12; k++) {
            const int32_t one = track_id[order[k]], other = verdict(k).track_id;

            if (one <= start.last_id || other <= start.last_id) {
                IH_TEST_EQUAL(one > start.last_id ? 0 : one, other > start.last_id ? 0 : other,
                              "track", pass);
            }
        }
    }
}

static void a_full_table_takes_no_further_head(void)
{
    int i, k;

    for (i = 0; i < 5; i++) {
        for (k = 0; k <= IH_TRACKS_MAX; k++) {
            add(-800 + 200 * k, 0, 900, 5 - 0.4 * k);
        }
        frame();
        TEST_ASSERT_EQUAL_INT32(IH_TRACKS_MAX, tracks.track_count);
        TEST_ASSERT_EQUAL_INT32(IH_TRACKS_MAX, tracks.head_count);
        for (k = 0; k <= IH_TRACKS_MAX; k++) {
            IH_TEST_EQUAL(k < IH_TRACKS_MAX ? k + 1 : 0, verdict(k).track_id, "track", k);
        }
    }
    TEST_ASSERT_FALSE(verdict(IH_TRACKS_MAX).is_head);
    /* One leaves: its room is free in the same frame. */
    view = through;
    for (k = 1; k <= IH_TRACKS_MAX; k++) {
        add(-800 + 200 * k, 0, 900, 5 - 0.4 * k);
    }
    frame();
    TEST_ASSERT_EQUAL_INT32(IH_TRACKS_MAX + 1, verdict(IH_TRACKS_MAX - 1).track_id);
    TEST_ASSERT_EQUAL_INT32(IH_TRACKS_MAX, tracks.track_count);
}

/* Beside a full list of detections there is room for all predicted heads. */
static void predicted_heads_have_room_beside_a_full_list(void)
{
    int k;

    for (k = 0; k < IH_TRACKS_MAX; k++) {
        add(-3000 + 200 * k, 0, 900, 3);
    }
    frame();
    for (k = 0; k < IH_DETECTIONS_MAX; k++) {
        add(200 * k, 0, 900, -0.5);
    }
    frame();
    TEST_ASSERT_EQUAL_INT32(IH_TRACKS_MAX, tracks.track_count);
    TEST_ASSERT_EQUAL_INT32(IH_DETECTIONS_MAX + IH_TRACKS_MAX, listed_count);
    for (k = 0; k < IH_TRACKS_MAX; k++) {
        IH_TEST_EQUAL(IH_DETECTIONS_MAX + k, tracks.track[k].index, "coasting", k);
        TEST_ASSERT_TRUE(is_coasting(k));
    }
}

static void ids_wrap_to_one(void)
{
    int i;

    tracks.last_id = INT32_MAX - 2;
    for (i = 0; i < 4; i++) {
        add(-300 + 200 * i, 0, 900, 3);
    }
    frame();
    TEST_ASSERT_EQUAL_INT32(INT32_MAX - 1, tracks.track[0].id);
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, tracks.track[1].id);
    TEST_ASSERT_EQUAL_INT32(1, tracks.track[2].id);
    TEST_ASSERT_EQUAL_INT32(2, tracks.track[3].id);
}

/* After the wrap an id may still be in use. */
static void an_id_in_use_is_not_given_again(void)
{
    add(-300, 0, 900, 3);
    add(-100, 0, 900, 3);
    frame(); /* 1 and 2 */
    tracks.last_id = 0;
    add(-300, 0, 900, 3);
    add(-100, 0, 900, 3);
    add(300, 0, 900, 3);
    frame();
    TEST_ASSERT_EQUAL_INT32(3, tracks.track_count);
    TEST_ASSERT_EQUAL_INT32(3, tracks.track[2].id);
}

/* Two tracks at the same position are one head: the older one's, without a gap. */
static void of_two_tracks_at_one_position_the_older_stays(void)
{
    add(-80, 0, 900, 3);
    add(80, 0, 900, 3);
    frame();
    TEST_ASSERT_EQUAL_INT32(2, tracks.track_count);
    add(-30, 0, 900, 3);
    add(30, 0, 900, 3);
    frame();
    TEST_ASSERT_EQUAL_INT32(1, tracks.track_count);
    frames_with(3, 10, 0, 900, 3);
    TEST_ASSERT_EQUAL_INT32(1, tracks.track_count);
    TEST_ASSERT_EQUAL_INT32(1, tracks.track[0].id);
}

/* --- birth and end -------------------------------------------------------------------------------
 */

static void a_weak_detection_becomes_a_head_after_evidence(void)
{
    int frames = 0;

    frames_with(3, 0, 0, 800, 0);
    TEST_ASSERT_EQUAL_INT32(1, tracks.track_count);
    TEST_ASSERT_FALSE(tracks.track[0].is_head);
    TEST_ASSERT_EQUAL_INT32(IH_NONE, tracks.selected);
    TEST_ASSERT_EQUAL_INT32(1, verdict(0).track_id);
    while (!tracks.track[0].is_head && frames < 20) {
        frames_with(1, 0, 0, 800, 2);
        frames++;
    }
    /* 2 (1 - 0.75^n) > 0.5: n = 2. */
    TEST_ASSERT_EQUAL_INT(2, frames);
    TEST_ASSERT_EQUAL_INT32(1, tracks.track[0].id);
    TEST_ASSERT_EQUAL_INT32(0, tracks.selected);
}

static void an_improbable_detection_starts_nothing(void)
{
    add(0, 0, 800, -1); /* start_logit itself */
    frame();
    TEST_ASSERT_EQUAL_INT32(0, tracks.track_count);
    TEST_ASSERT_EQUAL_INT32(0, verdict(0).track_id);
}

static void a_tentative_track_does_not_coast(void)
{
    view = front;
    frames_with(2, 0, 0, 800, 0.5);
    frame();
    TEST_ASSERT_EQUAL_INT32(0, tracks.track_count);
    TEST_ASSERT_EQUAL_INT32(0, listed_count);
}

static void a_rejected_detection_in_the_gate_is_accepted_again(void)
{
    frames_with(5, 0, 0, 800, 3);
    add(10, 0, 800, -2.5); /* alone it would start nothing */
    frame();
    TEST_ASSERT_EQUAL_INT32(1, verdict(0).track_id);
    TEST_ASSERT_TRUE(verdict(0).is_head);
    TEST_ASSERT_EQUAL_INT32(0, tracks.selected);
    TEST_ASSERT_FALSE(is_coasting(0));
    /* Below keep_logit it is not: the track coasts, the detection stays rejected. */
    add(10, 0, 800, -3.01);
    frame();
    TEST_ASSERT_EQUAL_INT32(0, verdict(0).track_id);
    TEST_ASSERT_FALSE(verdict(0).is_head);
    TEST_ASSERT_TRUE(is_coasting(0));
    /* Nor outside the gate: 90 mm, and 12 mm for 40 ms. */
    frames_with(3, 0, 0, 800, 3);
    add(110, 0, 800, -0.9);
    add(0, -110, 800, -2);
    frame();
    TEST_ASSERT_TRUE(is_coasting(0));
}

/* A head stays one until its mean falls below drop_logit, not accept_logit. */
static void a_head_that_becomes_improbable_ends_as_one(void)
{
    int frames = 0;

    frames_with(5, 0, 0, 800, 1.5);
    TEST_ASSERT_TRUE(tracks.track[0].is_head);
    while (tracks.track_count == 1 && tracks.track[0].is_head && frames < 50) {
        frames_with(1, 0, 0, 800, -2.5);
        frames++;
    }
    /* -2.5 + 4 0.75^n < -0.5: n = 3. */
    TEST_ASSERT_EQUAL_INT(3, frames);
    TEST_ASSERT_EQUAL_INT32(1, tracks.track[0].id);
    TEST_ASSERT_EQUAL_INT32(IH_NONE, tracks.selected);
}

/* One very probable frame counts at most 6. */
static void one_frame_does_not_decide_for_long(void)
{
    int frames = 0;

    add(0, 0, 800, 1000);
    frame();
    TEST_ASSERT_EQUAL_INT32(6 << 10, tracks.track[0].mean_logit_q10);
    while (tracks.track_count == 1 && tracks.track[0].is_head && frames < 50) {
        frames_with(1, 0, 0, 800, -2.5);
        frames++;
    }
    TEST_ASSERT_EQUAL_INT(6, frames); /* -2.5 + 8.5 0.75^n < -0.5 */
}

static void a_seat_that_is_seen_through_ends_at_once(void)
{
    frames_with(5, 0, 0, 800, 5);
    view = through;
    frame();
    TEST_ASSERT_EQUAL_INT32(0, tracks.track_count);
    TEST_ASSERT_EQUAL_INT32(0, listed_count);
    TEST_ASSERT_EQUAL_INT32(IH_NONE, tracks.selected);
    /* The next one there is another. */
    view = hit;
    frames_with(1, 0, 0, 800, 5);
    TEST_ASSERT_EQUAL_INT32(2, tracks.selected_id);
}

/* Looked through, a convincing detection continues the track and any other does not. */
static void what_is_seen_through_needs_a_convincing_detection(void)
{
    frames_with(5, 0, 0, 800, 5);
    view = through;
    frames_with(1, 30, 0, 800, 0.51);
    TEST_ASSERT_EQUAL_INT32(1, tracks.selected_id);
    add(30, 0, 800, 0.49);
    frame();
    TEST_ASSERT_EQUAL_INT32(1, tracks.track_count);
    TEST_ASSERT_EQUAL_INT32(2, tracks.track[0].id); /* a new one, which is not a head yet */
    TEST_ASSERT_EQUAL_INT32(IH_NONE, tracks.selected);
}

/* The limits of "gone": more than half through and less than 30 % before, or fewer than 4 rays. A
 * frame in which too little was seen says nothing. */
static void a_seat_is_empty_by_its_limits(void)
{
    static const struct {
        struct ih_view view;
        bool gone;
    } cases[] = {{{0, 3, 0}, true},  {{4, 0, 0}, true},   {{5, 5, 0}, false}, {{6, 4, 0}, true},
                 {{7, 0, 3}, false}, {{71, 0, 29}, true}, {{0, 0, 0}, true},  {{0, 0, 20}, false},
                 {{2, 2, 0}, false}, {{3, 1, 0}, true},   {{0, 4, 0}, false}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        setUp();
        frames_with(5, 0, 0, 800, 5);
        view = cases[i].view;
        frame();
        IH_TEST_EQUAL(!cases[i].gone, tracks.track_count, "coasting", i);
        setUp();
        frames_with(5, 0, 0, 800, 5);
        view = cases[i].view;
        detections.seen_count = 29;
        frame();
        IH_TEST_EQUAL(1, tracks.track_count, "coasts through a lost frame", i);
    }
}

/* What nothing hides, and nobody finds, is no head for long: 5, then 5 0.75^n - 3 (1 - 0.75^n). */
static void a_head_in_plain_view_does_not_coast(void)
{
    int frames = 0;

    frames_with(5, 0, 0, 800, 5);
    view = hit;
    while (tracks.head_count == 1 && frames < 50) {
        frame();
        frames++;
    }
    TEST_ASSERT_EQUAL_INT(5, frames); /* below -0.5 after the fifth */
    setUp();
    frames_with(5, 0, 0, 800, 5);
    view = hit;
    view.front = 20; /* hidden: for a whole second */
    for (frames = 0; frames < 50 && tracks.head_count == 1; frames++) {
        frame();
    }
    TEST_ASSERT_EQUAL_INT(1000000 / FRAME_US + 1, frames);
}

/* Hidden begins at 30 % of all rays, whatever the others say: its log-odds stay what they were. */
static void hidden_begins_at_its_limit(void)
{
    static const struct {
        struct ih_view view;
        bool hidden;
    } cases[] = {{{0, 70, 30}, true},    {{0, 71, 29}, false}, {{35, 35, 30}, true},
                 {{35, 36, 29}, false},  {{0, 0, 10}, true},   {{0, 700, 300}, true},
                 {{0, 702, 298}, false}, {{0, 99, 1}, false}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        int32_t logit_q10;

        setUp();
        frames_with(5, 0, 0, 800, 5);
        logit_q10 = tracks.track[0].mean_logit_q10;
        view = cases[i].view;
        frame();
        IH_TEST_EQUAL(1, tracks.track_count, "coasting", i);
        IH_TEST_EQUAL(cases[i].hidden, tracks.track[0].mean_logit_q10 == logit_q10, "hidden", i);
    }
}

/* Heads at once, later, not yet: by the log-odds of a new track and of one that was found thrice. */
static void evidence_makes_a_head(void)
{
    frames_with(1, 0, 0, 800, 1.1);
    TEST_ASSERT_EQUAL_INT32(1, tracks.head_count);
    setUp();
    frames_with(2, 0, 0, 800, 0.9);
    TEST_ASSERT_EQUAL_INT32(0, tracks.head_count);
    frames_with(1, 0, 0, 800, 0.9);
    TEST_ASSERT_EQUAL_INT32(1, tracks.head_count);
    setUp();
    frames_with(20, 0, 0, 800, 0.4);
    TEST_ASSERT_EQUAL_INT32(1, tracks.track_count);
    TEST_ASSERT_EQUAL_INT32(0, tracks.head_count);
}

/* --- coasting ------------------------------------------------------------------------------------
 */

static void hands_before_a_head_do_not_end_it(void)
{
    int i;

    frames_with(10, 0, 0, 800, 3);
    view = front;
    for (i = 0; i < 3; i++) {
        frame();
        TEST_ASSERT_EQUAL_INT32(1, tracks.track_count);
        TEST_ASSERT_TRUE(is_coasting(0));
        TEST_ASSERT_EQUAL_INT32(1, listed_count);
        TEST_ASSERT_EQUAL_INT32(0, tracks.selected);
        TEST_ASSERT_EQUAL_INT32(1, verdict(0).track_id);
        TEST_ASSERT_TRUE(verdict(0).is_head);
        IH_TEST_WITHIN(0.1, 800, from_q8(predicted.head[0].head.centre_mm_q8[2]), "depth", i);
        TEST_ASSERT_TRUE(predicted.head[0].a_px_q12 > 0);
        TEST_ASSERT_TRUE(verdict(0).probability_q16 > 32768);
    }
    view = hit;
    frames_with(1, 40, 0, 800, 3);
    TEST_ASSERT_EQUAL_INT32(1, tracks.selected_id);
    TEST_ASSERT_FALSE(is_coasting(0));
}

/* A predicted head has nothing of a detection that was in the table before. */
static void a_predicted_head_has_no_evidence(void)
{
    int kind;

    frames_with(10, 0, 0, 800, 3);
    view = front;
    memset(predicted.head, IH_TEST_FILL, sizeof predicted.head);
    frame();
    TEST_ASSERT_TRUE(is_coasting(0));
    for (kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
        IH_TEST_EQUAL(0, predicted.head[0].evidence.value_q8[kind], "evidence", kind);
    }
    IH_TEST_EQUAL(0, predicted.head[0].evidence.view.hit, "hits", 0);
    IH_TEST_EQUAL(IH_SOURCE_EXPECTED, predicted.head[0].source, "source", 0);
}

static void a_track_coasts_for_coast_us_at_most(void)
{
    int i;

    for (i = 0; i < 2; i++) { /* hidden; a lost frame */
        setUp();
        frames_with(10, 0, 0, 800, 5);
        view = i == 0 ? front : through;
        detections.seen_count = i == 0 ? 300 : 10;
        frames_without(25); /* 1 s */
        IH_TEST_EQUAL(1, tracks.track_count, "after coast_us", i);
        frame_at(time_us + 1);
        IH_TEST_EQUAL(0, tracks.track_count, "longer", i);
    }
}

/* Of a room beyond the range nothing is seen when its visitor has left: no head is reported for long. It is the same
 * person's when it comes back. */
static void a_head_is_reported_for_blind_us_where_nothing_is_seen(void)
{
    int is_hidden;

    for (is_hidden = 0; is_hidden < 2; is_hidden++) {
        setUp();
        frames_with(10, 0, 0, 800, 5);
        view = front;
        detections.seen_count = is_hidden ? 30 : 29;
        frames_without(7); /* 280 ms */
        frame_at(time_us + 20000);
        IH_TEST_EQUAL(1, tracks.head_count, "heads after blind_us", is_hidden);
        IH_TEST_EQUAL(0, tracks.selected, "selected", is_hidden);
        frame_at(time_us + 1);
        IH_TEST_EQUAL(is_hidden, tracks.head_count, "heads, longer", is_hidden);
        IH_TEST_EQUAL(is_hidden, predicted.count, "predicted, longer", is_hidden);
        IH_TEST_EQUAL(is_hidden ? 0 : IH_NONE, tracks.selected, "selected, longer", is_hidden);
        IH_TEST_EQUAL(1, tracks.track_count, "tracks, longer", is_hidden);
        view = hit;
        detections.seen_count = 300;
        frames_with(1, 0, 0, 800, 5);
        IH_TEST_EQUAL(1, tracks.selected_id, "the same person's", is_hidden);
    }
    view = front; /* hidden for longer, and then one lost frame */
    frames_without(12);
    detections.seen_count = 29;
    frame();
    IH_TEST_EQUAL(0, tracks.selected, "selected in one lost frame", 0);
    frames_with(12, 0, 0, 800, 5); /* found in lost frames, and then not once */
    frame();
    IH_TEST_EQUAL(0, tracks.selected, "selected after lost frames", 0);
}

/* It moves on, and slows down within 0.1 s. */
static void a_coasting_track_slows_down(void)
{
    double x, last = 0;
    int i;

    for (i = 0; i < 30; i++) {
        add(-300 + 20 * i, 0, 800, 3);
        frame();
    }
    view = front;
    x = from_q8(tracks.track[0].filter.head.centre_mm_q8[0]);
    for (i = 0; i < 8; i++) {
        double moved;

        frame();
        moved = from_q8(tracks.track[0].filter.head.centre_mm_q8[0]) - x;
        TEST_ASSERT_TRUE(i == 0 ? moved > 15 : moved < last || moved == 0);
        last = moved;
        x += moved;
    }
    TEST_ASSERT_EQUAL_INT32(0, tracks.track[0].filter.velocity_mm_s_q8[0]);
    IH_TEST_RANGE(280 + 20, 280 + 50, (int64_t)x, "position", 0);
}

/* The longer it was not seen, the farther off it may be found. */
static void the_gate_grows_while_coasting(void)
{
    frames_with(10, 0, 0, 800, 3);
    view = front;
    frames_without(1);
    add(170, 0, 800, -0.99); /* 90 + 300 * 0.08 */
    frame();
    TEST_ASSERT_EQUAL_INT32(2, verdict(0).track_id);
    setUp();
    frames_with(10, 0, 0, 800, 3);
    view = front;
    frames_without(9);
    add(170, 0, 800, -0.99); /* 90 + 300 * 0.4 */
    frame();
    TEST_ASSERT_EQUAL_INT32(1, verdict(0).track_id);
}

static void sigma_grows_while_coasting_and_shrinks_when_seen(void)
{
    double last = 1000;
    int i;

    for (i = 0; i < 10; i++) {
        frames_with(1, 0, 0, 800, 3);
        last = sigma_mm(0);
    }
    TEST_ASSERT_TRUE(last < 12); /* better than one detection */
    view = front;
    for (i = 0; i < 25; i++) {
        frames_without(1);
        TEST_ASSERT_TRUE(sigma_mm(0) > last);
        last = sigma_mm(0);
    }
    view = hit;
    frames_with(1, 0, 0, 800, 3);
    TEST_ASSERT_TRUE(sigma_mm(0) < 13);
    frames_with(10, 0, 0, 800, 3);
    last = sigma_mm(0);
    frames_with(10, 0, 0, 800, 1.5); /* below log-odds of 2 a detection is less certain */
    TEST_ASSERT_TRUE(sigma_mm(0) > last + 1);
}

/* --- limits --------------------------------------------------------------------------------------
 */

/* Of 100 points a frame must have as many as that to say anything. */
static void a_frame_is_lost_with_fewer_points_than_its_limit(void)
{
    int32_t seen;

    params.seen_min = 100;
    for (seen = 99; seen <= 100; seen++) {
        ih_tracks_init(&tracks);
        view = hit;
        detections.seen_count = seen;
        frames_with(5, 0, 0, 800, 5);
        view = through;
        frame();
        IH_TEST_EQUAL(seen == 99, tracks.track_count, "coasts, though seen through", seen);
        ih_tracks_init(&tracks);
        view = hit;
        frames_with(1, 0, 0, 800, 5);
        frame(); /* in plain view: log-odds fall, unless the frame says nothing */
        IH_TEST_EQUAL(seen == 99, tracks.track[0].mean_logit_q10 == 5 << 10, "log-odds", seen);
    }
}

/* At a gate's end a detection still belongs to the track: 30 mm, and 100 mm/s for 40 ms. */
static void a_gate_reaches_as_far_as_it_says(void)
{
    int far_side;

    params.gate_mm = 30;
    params.gate_mm_per_s = 100;
    for (far_side = 0; far_side <= 1; far_side++) {
        ih_tracks_init(&tracks);
        add(0, 0, 800, 5);
        frame();
        add(0, 34 + far_side / 256.0, 800, -2);
        frame();
        IH_TEST_EQUAL(far_side == 0, verdict(0).track_id != 0, "in the gate", far_side);
    }
}

/* A detection at the gate's end is worth 4 less than one at its middle, in proportion to the square of the
 * distance: at half of it, 1 less. */
static void a_near_detection_is_better_than_a_probable_one(void)
{
    static const struct {
        double more, y_mm;
        int32_t own; /* the detection that the track takes */
    } cases[] = {{3.99, 90, 0}, {4.01, 90, 1}, {0.99, 45, 0}, {1.01, 45, 1}};
    int i;

    params.gate_mm_per_s = 0;
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        ih_tracks_init(&tracks);
        add(0, 0, 800, 2);
        frame();
        add(0, 0, 800, -2.5);
        add(0, cases[i].y_mm, 800, -2.5 + cases[i].more);
        frame();
        IH_TEST_EQUAL(cases[i].own, tracks.track[0].index, "detection", i);
    }
}

/* Nobody has two heads: within an ellipsoid of 150 mm aside and 250 mm in depth there is one track. */
static void two_tracks_are_as_far_apart_as_two_people(void)
{
    static const struct {
        double x_mm, y_mm, z_mm;
        bool is_own;
    } cases[] = {
        {149, 0, 0, true},   {151, 0, 0, false},   {-151, 0, 0, false},  {0, 149, 0, true},
        {0, 151, 0, false},  {0, 0, 249, true},    {0, 0, 251, false},   {0, 0, -249, true},
        {105, 0, 175, true}, {107, 0, 178, false}, {86, -86, 143, true}, {88, 88, -146, false},
    };
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        setUp();
        add(0, 0, 1000, 5);
        add(cases[i].x_mm, cases[i].y_mm, 1000 + cases[i].z_mm, 4);
        frame();
        IH_TEST_EQUAL(1, verdict(0).track_id, "first", i);
        IH_TEST_EQUAL(cases[i].is_own ? 0 : 2, verdict(1).track_id, "second", i);
    }
}

/* Where are heads looked for besides their predictions? */
static void check_last_sure(int count, double first_mm, int pass)
{
    IH_TEST_EQUAL(count, expected.last_sure_count, "last sure places", pass);
    if (count > 0) {
        IH_TEST_EQUAL((int32_t)(first_mm * 256), expected.last_sure[0].centre_mm_q8[0], "where",
                      pass);
    }
}

/* A doubtful detection may be a hand's: the head is looked for where it was seen for sure until it is again. */
static void an_unsure_track_is_looked_for_where_it_was_sure(void)
{
    static const struct {
        double x_mm, logit; /* of this frame's detection; none with log-odds 0 */
        int count;          /* of last sure places, */
        double last_mm;     /* where */
    } frames[] = {
        {3, 0.5, 0, 0}, {9, 3, 1, 3},   {20, 0.5, 0, 0}, {20, 0.501, 1, 9}, {25, 0, 0, 0},
        {25, 0, 1, 20}, {12, 2, 1, 20}, {12, 2, 0, 0},   {12, 0, 0, 0},     {12, 2, 1, 12},
    };
    int i;

    view = front;
    for (i = 0; i < IH_TEST_COUNT(frames); i++) {
        if (frames[i].logit > 0) {
            add(frames[i].x_mm, 0, 900, frames[i].logit);
        }
        frame();
        check_last_sure(frames[i].count, frames[i].last_mm, i);
    }
    ih_tracks_forget(&tracks);
    frame();
    check_last_sure(0, 0, i);
}

/* Each track has a place of its own; one that is sure from its first frame on has none. */
static void last_sure_places_are_those_of_unsure_tracks(void)
{
    int pass;

    for (pass = 0; pass < 2; pass++) {
        setUp();
        add(-300, 0, 900, 3);
        add(300, 0, 900, 3);
        frame();
        add(-300, 0, 900, pass == 0 ? 3 : 0);
        add(300, 0, 900, pass == 0 ? 0 : 3);
        frame();
        check_last_sure(0, 0, pass);
        frame();
        check_last_sure(1, pass == 0 ? 300 : -300, pass);
    }
    frame_at(time_us + params.gap_us + 1);
    check_last_sure(0, 0, pass);
}

/* Who has walked on is not where the last sure detection was. */
static void a_last_sure_place_is_near(void)
{
    int i;

    view = front;
    frames_with(2, 0, 0, 900, 3);
    for (i = 1; i <= 12; i++) {
        add(30 * i, 0, 900, 0.3);
        frame();
        check_last_sure(i > 1 && expected.head[0].centre_mm_q8[0] < 150 * 256, 0, i);
    }
    TEST_ASSERT_TRUE(expected.head[0].centre_mm_q8[0] > 150 * 256);
    TEST_ASSERT_EQUAL_INT32(1, tracks.track_count);
}

/* Each verdict needs more than its limit. */
static void verdicts_need_more_than_their_limits(void)
{
    ih_tracks_init(&tracks);
    frames_with(1, 0, 0, 800, 1); /* start_head */
    TEST_ASSERT_FALSE(tracks.track[0].is_head);
    ih_tracks_init(&tracks);
    frames_with(1, 0, 0, 800, 1025.0 / 1024);
    TEST_ASSERT_TRUE(tracks.track[0].is_head);
    ih_tracks_init(&tracks);
    frames_with(4, 0, 0, 800, 0.5); /* accept, when mature */
    TEST_ASSERT_FALSE(tracks.track[0].is_head);
    ih_tracks_init(&tracks);
    frames_with(3, 0, 0, 800, 513.0 / 1024);
    TEST_ASSERT_TRUE(tracks.track[0].is_head);
    params.memory_q16 = 0; /* its mean is its last detection's */
    frames_with(1, 0, 0, 800, -511.0 / 1024);
    TEST_ASSERT_TRUE(tracks.track[0].is_head);
    frames_with(1, 0, 0, 800, -0.5); /* drop */
    TEST_ASSERT_FALSE(tracks.track[0].is_head);
}

/* A detection of keep_logit itself continues a track, whose mean may be as low; what is seen through takes
 * one of accept_logit. */
static void a_track_is_continued_down_to_its_limits(void)
{
    frames_with(1, 0, 0, 800, 5);
    params.memory_q16 = 0;
    frames_with(1, 0, 0, 800, -3);
    TEST_ASSERT_EQUAL_INT32(1, tracks.track_count);
    TEST_ASSERT_EQUAL_INT32(1, verdict(0).track_id);
    ih_tracks_init(&tracks);
    frames_with(1, 0, 0, 800, 5);
    frames_with(1, 0, 0, 800, -3073.0 / 1024);
    TEST_ASSERT_EQUAL_INT32(0, verdict(0).track_id);
    ih_tracks_init(&tracks);
    params.memory_q16 = 49152;
    frames_with(1, 0, 0, 800, 5);
    view = through;
    frames_with(1, 0, 0, 800, 0.5);
    TEST_ASSERT_EQUAL_INT32(1, verdict(0).track_id);
    frames_with(1, 0, 0, 800, 511.0 / 1024);
    TEST_ASSERT_EQUAL_INT32(2, verdict(0).track_id);
}

/* A head is not chosen for its position where it is 3 less probable than the best, and below accept_logit. */
static void a_head_is_chosen_for_its_position_within_three(void)
{
    static const struct {
        double best, other; /* log-odds */
        bool chosen;
    } cases[] = {
        {5, 0.5, true}, {5, 0.5 - 1 / 1024.0, false}, {3, 0, true}, {3, -1 / 1024.0, false}};
    int i;

    params.side = IH_SIDE_LEFT;
    params.start_head_logit_q10 = -1024;
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        ih_tracks_init(&tracks);
        add(0, 0, 800, cases[i].best);
        add(-300, 0, 800, cases[i].other);
        frame();
        IH_TEST_EQUAL(2, tracks.head_count, "heads", i);
        IH_TEST_EQUAL(cases[i].chosen, tracks.selected, "selected", i);
    }
}

/* Both detections of each pair are above start_logit but the last one's, and the second is more probable. */
static void a_body_gets_no_track(void)
{
    static const struct {
        double x, y, z, head_logit; /* from head to body */
        bool is_body;
    } cases[] = {
        {0, 300, -100, 1.5, true},    {149, 300, -100, 1.5, true}, {150, 300, -100, 1.5, false},
        {-149, 300, -100, 1.5, true}, {-150, 300, 0, 1.5, false},  {0, 201, -100, 1.5, true},
        {0, 200, -100, 1.5, false},   {0, 399, -100, 1.5, true},   {0, 400, -100, 1.5, false},
        {0, 300, -349, 1.5, true},    {0, 300, -350, 1.5, false},  {0, 300, 149, 1.5, true},
        {0, 300, 150, 1.5, false},    {0, -300, -100, 1.5, false}, {0, 300, -100, -0.999, true},
        {0, 300, -100, -1, false},
    };
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        setUp();
        add(cases[i].x, cases[i].y, 900 + cases[i].z, 3);
        add(0, 0, 900, cases[i].head_logit);
        frame();
        IH_TEST_EQUAL(!cases[i].is_body, ih_tracks_verdict(&tracks, &detections, 0).track_id != 0,
                      "track of the body", i);
    }
}

/* Nor does it continue the track of its head. */
static void a_body_continues_no_track(void)
{
    frames_with(3, 0, 0, 900, 3);
    add(0, 210, 900, 5);
    add(0, 0, 900, 1);
    frame();
    IH_TEST_EQUAL(1, tracks.track_count, "tracks", 0);
    IH_TEST_EQUAL(0, ih_tracks_verdict(&tracks, &detections, 0).track_id, "track of the body", 0);
    IH_TEST_EQUAL(1, ih_tracks_verdict(&tracks, &detections, 1).track_id, "track of the head", 0);
}

/* Detections are counted up to 1000. */
static void detections_of_a_track_are_counted(void)
{
    int i;

    for (i = 1; i <= 1002; i++) {
        frames_with(1, 0, 0, 800, 5);
        IH_TEST_EQUAL(i < 1000 ? i : 1000, tracks.track[0].detection_count, "detections", i);
    }
}

/* A position is known to 500 mm at worst, a speed to 3 m/s, and no head is faster. */
static void uncertainty_has_its_limits(void)
{
    params.acceleration_mm_s2 = 8191;
    params.coast_us = INT32_MAX;
    params.blind_us = INT32_MAX;
    detections.seen_count = 0; /* lost frames: it coasts */
    frames_with(1, 0, 0, 800, 5);
    frame_at(time_us + 2000000);
    frame_at(time_us + 2000000);
    TEST_ASSERT_EQUAL_INT32(1, tracks.track_count);
    TEST_ASSERT_TRUE(tracks.track[0].filter.position_q8 == (int64_t)500 * 500 * 256);
    TEST_ASSERT_TRUE(tracks.track[0].filter.velocity_q8 == (int64_t)3000 * 3000 * 256);
    IH_TEST_EQUAL(500 << 8, verdict(tracks.track[0].index).sigma_mm_q8, "sigma", 0);
}

/* --- time ----------------------------------------------------------------------------------------
 */

static void the_same_time_again_is_another_look(void)
{
    int64_t position_q8;

    frames_with(5, 0, 0, 800, 3);
    position_q8 = tracks.track[0].filter.position_q8;
    add(4, 0, 800, 3);
    frame_at(time_us);
    TEST_ASSERT_EQUAL_INT32(1, tracks.selected_id);
    TEST_ASSERT_TRUE(tracks.track[0].filter.position_q8 <
                     position_q8); /* twice seen is better known */
    IH_TEST_RANGE(0, 4 << 8, tracks.track[0].filter.head.centre_mm_q8[0], "between", 0);
    view = front;
    frame_at(time_us);
    TEST_ASSERT_TRUE(is_coasting(0));
}

static void late_frames_keep_the_track(void)
{
    static const int64_t steps_us[] = {1, 40000, 500000, 1000000, 2000000, 39999};
    int i;

    frames_with(5, 0, 0, 800, 3);
    for (i = 0; i < IH_TEST_COUNT(steps_us); i++) {
        add(0, 0, 800, 3);
        frame_at(time_us + steps_us[i]);
        IH_TEST_EQUAL(1, tracks.selected_id, "id", i);
    }
}

static void a_step_back_or_a_long_gap_forgets(void)
{
    static const int64_t steps_us[] = {-1, -1000000, 2000001, 10000000};
    int i;

    for (i = 0; i < IH_TEST_COUNT(steps_us); i++) {
        setUp();
        frames_with(5, 0, 0, 800, 3);
        add(0, 0, 800, 3);
        frame_at(time_us + steps_us[i]);
        IH_TEST_EQUAL(1, tracks.track_count, "tracks", i);
        IH_TEST_EQUAL(2, tracks.selected_id, "another id", i);
        setUp();
        frames_with(5, 0, 0, 800, 3);
        view = front;
        frame_at(time_us + steps_us[i]);
        IH_TEST_EQUAL(0, tracks.track_count, "no track stays", i);
        IH_TEST_EQUAL(IH_NONE, tracks.selected, "selected", i);
    }
}

/* Differences of these do not fit 64 bits. */
static void times_may_be_anything(void)
{
    static const int64_t times_us[] = {0,         INT64_MAX,     INT64_MIN, INT64_MAX - 1,
                                       INT64_MAX, INT64_MAX,     -1,        INT64_MAX,
                                       INT64_MIN, INT64_MIN + 1, -2,        INT64_MAX - 1};
    static const int32_t ids[] = {1, 2, 3, 4, 4, 4, 5, 6, 7, 7, 8, 9};
    int i;

    for (i = 0; i < IH_TEST_COUNT(times_us); i++) {
        add(0, 0, 800, 3);
        frame_at(times_us[i]);
        IH_TEST_EQUAL(ids[i], tracks.selected_id, "id", i);
    }
}

static void frames_may_come_at_the_end_of_time(void)
{
    int i;

    for (i = 0; i < 4; i++) {
        setUp();
        time_us = (i % 2 == 0 ? INT64_MIN : INT64_MAX - 30 * FRAME_US);
        frames_with(10, 0, 0, 800, 3);
        view = front;
        frames_without(8);
        IH_TEST_EQUAL(1, tracks.selected_id, "id", i);
    }
}

/* --- which head ----------------------------------------------------------------------------------
 */

static int32_t selected_of_three(int32_t side)
{
    setUp();
    params.side = side;
    add(-250, 0, 800, 3);
    add(10, 0, 900, 1.5);
    add(260, 0, 1000, 4);
    frame();
    return tracks.selected_id;
}

static void the_head_is_chosen_by_side(void)
{
    TEST_ASSERT_EQUAL_INT32(1, selected_of_three(IH_SIDE_NEAREST));
    TEST_ASSERT_EQUAL_INT32(1, selected_of_three(IH_SIDE_LEFT));
    TEST_ASSERT_EQUAL_INT32(3, selected_of_three(IH_SIDE_RIGHT));
}

/* In the picture, not in space: farther away is nearer to its middle. */
static void sides_are_those_of_the_picture(void)
{
    params.side = IH_SIDE_LEFT;
    add(-250, 0, 1600, 3);
    add(-200, 0, 800, 3);
    frame();
    TEST_ASSERT_EQUAL_INT32(2, tracks.selected_id);
}

/* From the camera, not along its axis; of equals the first. */
static void the_nearest_head_is_selected(void)
{
    add(300, 0, 700, 3);
    add(0, -60, 730, 3);
    frame();
    TEST_ASSERT_EQUAL_INT32(2, tracks.selected_id);
    setUp();
    add(200, 0, 800, 3);
    add(-200, 0, 800, 3);
    frame();
    TEST_ASSERT_EQUAL_INT32(1, tracks.selected_id);
}

/* --- somebody fast -------------------------------------------------------------------------------
 */

/* The second of two frames, with a head that has jumped. */
static void jump_by(double x, double y, double z, double logit)
{
    setUp();
    view = front;
    frames_with(3, 0, 0, 1000, 3);
    add(x, y, 1000 + z, logit);
    frame();
}

static void a_head_that_jumps_stays_the_same_within_its_limits(void)
{
    static const struct {
        double x, y, z, logit;
        int32_t id;
    } jumps[] = {
        {0, 0, -449, 3, 1},   {0, 0, -451, 3, 2},  {0, 0, 449, 3, 1},   {149, 0, 0, 3, 1},
        {151, 0, 0, 3, 2},    {0, -149, 0, 3, 1},  {0, -151, 0, 3, 2},  {105, 105, 0, 3, 1},
        {107, 107, 0, 3, 2},  {0, 105, 316, 3, 1}, {0, 107, 320, 3, 2}, {0, 0, -400, 0.51, 1},
        {0, 0, -400, 0.5, 2},
    };
    for (int i = 0; i < IH_TEST_COUNT(jumps); i++) {
        jump_by(jumps[i].x, jumps[i].y, jumps[i].z, jumps[i].logit);
        IH_TEST_EQUAL(jumps[i].id, verdict(0).track_id, "track", i);
    }
}

/* Somebody comes 250 mm nearer in a frame. Where the head was is a chest now: the track goes on with the one that is more
 * of a head by 2 log-odds and the 4 parts of its squared distance over the limit's, 250 / 450. */
static void what_is_where_a_fast_head_was_does_not_keep_its_track(void)
{
    static const struct {
        double chest;
        bool goes;
    } cases[] = {{-2.5, true}, {-0.25, true}, {-0.22, false}, {2.5, false}};
    for (int i = 0; i < IH_TEST_COUNT(cases); i++) {
        setUp();
        frames_with(1, 0, 0, 1400, 3);
        add(0, 0, 1400, cases[i].chest);
        add(0, 0, 1150, 3);
        frame();
        IH_TEST_EQUAL(cases[i].goes ? 1 : 2, verdict(1).track_id, "the near head's track", i);
        IH_TEST_EQUAL(cases[i].goes ? 0 : 1, verdict(0).track_id == 1, "the chest keeps it", i);
    }
}

/* What hides a predicted head is the person's own one, measured. */
static void a_prediction_ends_beside_a_measured_head_of_its_person(void)
{
    view = front;
    frames_with(3, 0, 0, 1400, 3);
    for (int i = 0; i < 3; i++) {
        add(0, 0, 940, 3); /* too far for the same track, then it stays before it */
        frame();
    }
    IH_TEST_EQUAL(2, tracks.track_count, "tracks, the first one hidden", 0);
    add(0, 0, 1010, 3);
    frame();
    IH_TEST_EQUAL(1, tracks.track_count, "tracks, the first one ended", 0);
    IH_TEST_EQUAL(2, tracks.selected_id, "selected", 0);
    setUp();
    view = front;
    frames_with(3, 0, 0, 1400, 3);
    add(200, 0, 1300, 3); /* somebody beside */
    frame();
    IH_TEST_EQUAL(2, tracks.track_count, "tracks of two people", 0);
}

/* What hardly looks like a head, as a hand before it, takes its track along by so much less. After one frame the variances
 * are 12 and 300, squared; 40 ms later that of the place is 144 + (300 * 0.04)^2 + (2500 * 0.04^2 / 2)^2 = 292 mm^2. */
static void a_doubtful_detection_hardly_moves_its_track(void)
{
    static const struct {
        double logit, factor;
    } rows[] = {{INT32_MAX / 1024.0, 1}, {2.5, 1}, {1.5, 4}, {0.5, 25}, {-1, 49}};
    for (int i = 0; i < IH_TEST_COUNT(rows); i++) {
        const double gain = 292 / (292 + 144 * rows[i].factor);
        setUp();
        frames_with(1, 0, 0, 900, 3);
        add(0, 60, 900, rows[i].logit);
        frame();
        IH_TEST_EQUAL(1, tracks.track_count, "tracks", i);
        IH_TEST_WITHIN(0.05, 60 * gain, from_q8(tracks.track[0].filter.head.centre_mm_q8[1]),
                       "moved, mm", i);
    }
}

static void a_doubtful_head_is_not_chosen_for_its_position(void)
{
    frames_with(1, 0, 0, 900, 1.5);
    add(0, 0, 900, -3);
    add(300, 0, 900, 6);
    frame();
    /* 0.75 1.5 - 0.25 3 < 0.5, but the first one is selected already. */
    TEST_ASSERT_EQUAL_INT32(1, tracks.selected_id);
    add(0, 0, 900, 0);
    add(300, 0, 900, 6);
    frame();
    add(0, 0, 900, 0);
    add(300, 0, 900, 6);
    frame();
    TEST_ASSERT_EQUAL_INT32(2, tracks.selected_id); /* the third frame in a row */
    setUp();
    add(0, 0, 900, 1.1);
    add(300, 0, 900, 6);
    frame();
    TEST_ASSERT_EQUAL_INT32(1, tracks.selected_id); /* by itself it is no doubtful one */
}

/* Another head takes over in the switch_frames-th frame in a row in which it is the better one. */
static void the_selected_head_changes_slowly(void)
{
    static const struct {
        double x;
        int32_t selected;
    } frames[] = {{200, 1}, {60, 1}, {60, 1},  {200, 1}, {60, 1},
                  {60, 1},  {60, 2}, {200, 2}, {200, 2}, {200, 1}};
    int i;

    params.gate_mm = 300; /* it jumps */
    for (i = 0; i < IH_TEST_COUNT(frames); i++) {
        add(-120, 0, 800, 3);
        add(frames[i].x, 0, 800, 3);
        frame();
        IH_TEST_EQUAL(frames[i].selected, tracks.selected_id, "selected", i);
    }
    params.switch_frames = 1;
    add(-120, 0, 800, 3);
    add(60, 0, 800, 3);
    frame();
    TEST_ASSERT_EQUAL_INT32(2, tracks.selected_id);
    /* When the selected one is gone there is nothing to wait for. */
    params.switch_frames = 3;
    view = through;
    add(-120, 0, 800, 3);
    frame();
    TEST_ASSERT_EQUAL_INT32(1, tracks.selected_id);
}

/* --- numbers -------------------------------------------------------------------------------------
 */

/* As far as a detection can be: 16 m away at a slope of 8. */
static void extreme_positions_do_not_overflow(void)
{
    static const double far[][3] = {{131000, 131000, 16000},
                                    {-131000, 131000, 16000},
                                    {131000, -131000, 150},
                                    {-131000, -131000, 16300}};
    int i, k;

    params.gate_mm = 1 << 20; /* everything is near */
    for (i = 0; i < 8; i++) {
        for (k = 0; k < 4; k++) {
            add(far[(i + k) % 4][0], far[(i + k) % 4][1], far[(i + k) % 4][2],
                k % 2 == 0 ? 600 : 3);
        }
        frame();
        TEST_ASSERT_TRUE(tracks.track_count >= 1);
        IH_TEST_RANGE(-3000 * 256, 3000 * 256, tracks.track[0].filter.velocity_mm_s_q8[0], "speed",
                      i);
    }
    view = front;
    frames_without(20);
}

/* Whatever is found where a fast head is expected, hour after hour: its position stays in its format. */
static void a_head_that_runs_away_stays_in_the_format(void)
{
    int i;

    frames_with(5, 0, 0, 800, 5);
    TEST_ASSERT_EQUAL_INT(1, tracks.track_count);
    tracks.track[0].filter.velocity_mm_s_q8[0] = -(3000 << 8);
    tracks.track[0].filter.velocity_mm_s_q8[2] = 3000 << 8;
    for (i = 0; i < 3000; i++) {
        ih_tracks_expect(&tracks, &params, time_us += 2000000, &expected);
        IH_TEST_EQUAL(1, expected.count, "expected", i);
        IH_TEST_RANGE(-(1 << 26), 0, expected.head[0].centre_mm_q8[0], "x", i);
        IH_TEST_RANGE(800 << 8, 1 << 26, expected.head[0].centre_mm_q8[2], "z", i);
        add(0, 0, 0, 5)->head = expected.head[0];
        ih_tracks_update(&tracks, &params, &rig, &detections, &predicted);
        detections.detection_count = 0;
    }
    IH_TEST_EQUAL(1 << 26, expected.head[0].centre_mm_q8[2], "z at its end", 0);
}

/* A step of some seconds' tenths limits variances: their cross term must be limited with them, or a
 * detection makes the remainder negative. */
static void rare_frames_keep_the_variances_positive(void)
{
    int i;

    for (i = 0; i < 40; i++) {
        add(5 * (i % 2), 0, 800, 3);
        frame_at(time_us + 2000000);
        IH_TEST_EQUAL(1, tracks.selected_id, "id", i);
        TEST_ASSERT_TRUE(tracks.track[0].filter.position_q8 > 0);
        TEST_ASSERT_TRUE(tracks.track[0].filter.velocity_q8 > 0);
        IH_TEST_RANGE(1, 13 << 8, verdict(0).sigma_mm_q8, "sigma", i);
        /* 5 mm in 2 s */
        IH_TEST_RANGE(-20 * 256, 20 * 256, tracks.track[0].filter.velocity_mm_s_q8[0], "speed", i);
    }
}

static void the_covariance_stays_positive(void)
{
    struct ih_test_random random = {70};
    double min = 1;
    int i;

    for (i = 0; i < 100000; i++) {
        const int kind = (int)ih_test_between(&random, 0, 9);
        const int64_t step = kind == 0   ? 0
                             : kind == 1 ? ih_test_between(&random, 0, 2000000)
                             : kind == 2 ? ih_test_between(&random, 0, 100)
                                         : ih_test_between(&random, 20000, 90000);
        const struct ih_track *track = &tracks.track[0];

        if (i % 1000 == 0) { /* other parameters, within their ranges */
            params.measured_mm = (int32_t)ih_test_between(&random, 4, i % 3000 == 0 ? 500 : 30);
            params.acceleration_mm_s2 =
                (int32_t)ih_test_between(&random, 0, i % 2000 == 0 ? 8191 : 3000);
        }
        if (ih_test_unit(&random) < 0.8) {
            add(ih_test_normal(&random) * 15, 0, 800, ih_test_unit(&random) * 4);
        }
        view = front;
        ih_tracks_expect(&tracks, &params, time_us += step, &expected);
        ih_tracks_update(&tracks, &params, &rig, &detections, &predicted);
        detections.detection_count = 0;
        if (tracks.track_count == 0) {
            continue;
        }
        {
            const double place = from_q8(track->filter.position_q8),
                         cross = from_q8(track->filter.cross_q8);
            const double speed = from_q8(track->filter.velocity_q8);
            /* Steps of Q8 collected over frames, the squared time's half step of 2^-21 s^2, and a
             * gain's of 2^-17. */
            const double position_more = place + 0.2 + speed / 1048576;
            const double speed_more = speed + 2 + fabs(cross) / 32768;

            IH_TEST_RANGE(0, 250000 << 8, track->filter.position_q8, "position", i);
            IH_TEST_RANGE(0, (int64_t)9000000 << 8, track->filter.velocity_q8, "speed", i);
            if (position_more * speed_more < cross * cross) {
                IH_TEST_WITHIN(0, position_more * speed_more, cross * cross, "determinant", i);
            }
            min = fmin(min, place);
        }
    }
    TEST_ASSERT_TRUE(min >= 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(sequences_match_float64);
    RUN_TEST(what_has_moved_needs_less);
    RUN_TEST(a_moving_head_keeps_its_id);
    RUN_TEST(crossing_heads_keep_their_ids);
    RUN_TEST(the_order_of_detections_does_not_matter);
    RUN_TEST(a_full_table_takes_no_further_head);
    RUN_TEST(predicted_heads_have_room_beside_a_full_list);
    RUN_TEST(ids_wrap_to_one);
    RUN_TEST(an_id_in_use_is_not_given_again);
    RUN_TEST(of_two_tracks_at_one_position_the_older_stays);
    RUN_TEST(a_weak_detection_becomes_a_head_after_evidence);
    RUN_TEST(an_improbable_detection_starts_nothing);
    RUN_TEST(a_tentative_track_does_not_coast);
    RUN_TEST(a_rejected_detection_in_the_gate_is_accepted_again);
    RUN_TEST(a_head_that_becomes_improbable_ends_as_one);
    RUN_TEST(one_frame_does_not_decide_for_long);
    RUN_TEST(a_seat_that_is_seen_through_ends_at_once);
    RUN_TEST(what_is_seen_through_needs_a_convincing_detection);
    RUN_TEST(a_seat_is_empty_by_its_limits);
    RUN_TEST(a_head_in_plain_view_does_not_coast);
    RUN_TEST(hidden_begins_at_its_limit);
    RUN_TEST(evidence_makes_a_head);
    RUN_TEST(hands_before_a_head_do_not_end_it);
    RUN_TEST(a_predicted_head_has_no_evidence);
    RUN_TEST(a_track_coasts_for_coast_us_at_most);
    RUN_TEST(a_head_is_reported_for_blind_us_where_nothing_is_seen);
    RUN_TEST(a_coasting_track_slows_down);
    RUN_TEST(a_frame_is_lost_with_fewer_points_than_its_limit);
    RUN_TEST(a_gate_reaches_as_far_as_it_says);
    RUN_TEST(a_near_detection_is_better_than_a_probable_one);
    RUN_TEST(two_tracks_are_as_far_apart_as_two_people);
    RUN_TEST(an_unsure_track_is_looked_for_where_it_was_sure);
    RUN_TEST(last_sure_places_are_those_of_unsure_tracks);
    RUN_TEST(a_last_sure_place_is_near);
    RUN_TEST(verdicts_need_more_than_their_limits);
    RUN_TEST(a_track_is_continued_down_to_its_limits);
    RUN_TEST(a_head_is_chosen_for_its_position_within_three);
    RUN_TEST(a_body_gets_no_track);
    RUN_TEST(a_body_continues_no_track);
    RUN_TEST(detections_of_a_track_are_counted);
    RUN_TEST(uncertainty_has_its_limits);
    RUN_TEST(the_gate_grows_while_coasting);
    RUN_TEST(sigma_grows_while_coasting_and_shrinks_when_seen);
    RUN_TEST(the_same_time_again_is_another_look);
    RUN_TEST(late_frames_keep_the_track);
    RUN_TEST(a_step_back_or_a_long_gap_forgets);
    RUN_TEST(times_may_be_anything);
    RUN_TEST(frames_may_come_at_the_end_of_time);
    RUN_TEST(the_head_is_chosen_by_side);
    RUN_TEST(sides_are_those_of_the_picture);
    RUN_TEST(the_nearest_head_is_selected);
    RUN_TEST(a_head_that_jumps_stays_the_same_within_its_limits);
    RUN_TEST(what_is_where_a_fast_head_was_does_not_keep_its_track);
    RUN_TEST(a_prediction_ends_beside_a_measured_head_of_its_person);
    RUN_TEST(a_doubtful_detection_hardly_moves_its_track);
    RUN_TEST(a_doubtful_head_is_not_chosen_for_its_position);
    RUN_TEST(the_selected_head_changes_slowly);
    RUN_TEST(extreme_positions_do_not_overflow);
    RUN_TEST(a_head_that_runs_away_stays_in_the_format);
    RUN_TEST(rare_frames_keep_the_variances_positive);
    RUN_TEST(the_covariance_stays_positive);
    return UNITY_END();
}
