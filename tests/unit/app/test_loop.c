/* app_loop and app_frame in a made-up world (app_world.h), every call of the HAL failing in turn. */
#include "app_frame.h"
#include "app_health.h"
#include "app_world.h"

#define COUNT(acts) ((int)(sizeof(acts) / sizeof(acts)[0]))
#define FIVE WORLD_FRAME, WORLD_FRAME, WORLD_FRAME, WORLD_FRAME, WORLD_FRAME
#define TWENTY FIVE, FIVE, FIVE, FIVE

void setUp(void)
{
}

void tearDown(void)
{
    if (world_doing != NULL) { /* what failed says so, but not in which run */
        printf("in %s\n", world_doing);
        world_doing = NULL;
    }
}

/* How often a text stands in the records. */
static int count_in_records(const char *text)
{
    int count = 0;
    for (const char *at = world.records; (at = strstr(at, text)) != NULL; at++) {
        count++;
    }
    return count;
}

static void test_gated_takes_every_frame(void)
{
    static const enum world_act acts[] = {TWENTY};
    world_init(APP_STROBE_GATED, acts, COUNT(acts));
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(20, world.lit_count);
    TEST_ASSERT_EQUAL_INT(20, world.record_count);
    TEST_ASSERT_EQUAL_INT(0, world.dark_count);
    TEST_ASSERT_EQUAL_INT(21, world.rise_count); /* one for the frame that did not come any more */
    TEST_ASSERT_EQUAL_INT(0, count_in_records("lost") + count_in_records("skipped"));
    TEST_ASSERT_EQUAL_INT(1, world.unproven_count);
    TEST_ASSERT_EQUAL_INT64(20, world.state.result_count);
    TEST_ASSERT_EQUAL_INT64(20, world.state.status.frame_count);
}

/* --check: as many frames as it takes, no record, and a status. */
static void test_check_says_whether_the_rig_fits(void)
{
    static const enum world_act acts[] = {TWENTY, TWENTY, TWENTY, TWENTY};
    static const enum app_exit exits[] = {
        [IH_ALIGN_UNKNOWN] = APP_EXIT_FAILED,
        [IH_ALIGN_FITS] = APP_EXIT_GOOD,
        [IH_ALIGN_MOVED] = APP_EXIT_FAILED,
        [IH_ALIGN_LOST] = APP_EXIT_FAILED,
    };
    for (int state = IH_ALIGN_UNKNOWN; state <= IH_ALIGN_LOST; state++) {
        world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
        world.config.check = true;
        world.config.paper = true; /* of no matter here */
        world.alignment.state = (enum ih_align_state)state;
        TEST_ASSERT_EQUAL_INT(exits[state], world_run());
        TEST_ASSERT_FALSE(world_head.params.is_paper);
        TEST_ASSERT_EQUAL_INT(APP_HEALTH_CHECKED, world.lit_count);
        TEST_ASSERT_EQUAL_INT(0, world.record_count);
    }
}

/* Without a camera, or without light, there is no answer: status 1 in time, and not by being stopped. */
static void test_check_does_not_wait_for_ever(void)
{
    static const enum world_act dark[1000] = {WORLD_INTERLOCK_OPENS};
    const int64_t end_us = 1000000 + APP_HEALTH_WAIT_US;
    for (int has_camera = 0; has_camera < 2; has_camera++) {
        world_init(APP_STROBE_ALWAYS, dark, COUNT(dark));
        world.config.check = true;
        world.unplugged_until_us = has_camera != 0 ? 0 : INT64_MAX;
        TEST_ASSERT_EQUAL_INT(APP_EXIT_FAILED, world_run());
        TEST_ASSERT_EQUAL_INT(0, world.record_count);
        TEST_ASSERT_GREATER_OR_EQUAL_INT64(end_us, world.now_us);
        TEST_ASSERT_LESS_OR_EQUAL_INT64(end_us + APP_LOOP_RETRY_MAX_US, world.now_us);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(world.unknown, "no lit frame"), world.unknown);
    }
}

/* It has not found that the rig fits, though its end was requested. */
static void test_check_that_is_stopped_has_failed(void)
{
    static const enum world_act acts[] = {TWENTY};
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    world.config.check = true;
    world.alignment.state = IH_ALIGN_FITS;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_FAILED, world_run());
    TEST_ASSERT_EQUAL_INT(20, world.lit_count);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(world.unknown, "20 of 60"), world.unknown);
}

/* Without it the loop goes on, every record says so, and the log once, also after a reload. */
static void test_a_lost_rig_is_reported(void)
{
    static const enum world_act acts[] = {TWENTY, WORLD_RELOAD, TWENTY};
    world_init(APP_STROBE_ALWAYS, acts, 20);
    world.alignment.state = IH_ALIGN_LOST;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(world.record_count, count_in_records("\"rig\":{\"state\":\"lost\""));
    TEST_ASSERT_EQUAL_INT(1, world.lost_count);
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    world.alignment.state = IH_ALIGN_LOST;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(2, world.lost_count);
}

/* A few frames that say something else are no message. */
static void test_a_rig_that_is_lost_for_moments_is_not_reported(void)
{
    struct app_state *state = &world.state;
    world_init(APP_STROBE_ALWAYS, NULL, 0);
    app_health_begin(state);
    for (int i = 0; i < 100; i++) {
        world_head.align.now = (struct ih_alignment){
            .state = i % (2 * APP_HEALTH_STEADY) < APP_HEALTH_STEADY - 1 ? IH_ALIGN_LOST
                                                                         : IH_ALIGN_FITS};
        app_health_frame(state);
    }
    TEST_ASSERT_EQUAL_INT(0, world.lost_count);
}

static void assert_moved(int count, const char *how, const char *rotation)
{
    TEST_ASSERT_EQUAL_INT(count, world.moved_count);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(world.moved, how), world.moved);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(world.moved, rotation), world.moved);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(world.moved, "calibrate again"), world.moved);
}

/* What is no rotation is reported, too: focal length and picture, one after the other. */
static void assert_lens_is_seen(void)
{
    struct ih_alignment *now = &world_head.align.now;
    int32_t *const moves[] = {&now->focal_q30, &now->shift_px_q12[0], &now->shift_px_q12[1]};
    static const int32_t enough[] = {2254858, 2150, 2150};     /* 0.21 %, 0.525 px */
    static const int32_t too_little[] = {1932735, 1843, 1843}; /* 0.18 %, 0.45 px */
    for (int i = 0; i < 3; i++) {
        world.moved_count = 0;
        *moves[i] += too_little[i];
        app_health_frame(&world.state);
        TEST_ASSERT_EQUAL_INT(0, world.moved_count);
        *moves[i] += enough[i] - too_little[i];
        app_health_frame(&world.state);
        assert_moved(1, "at once", "(0.200, 0.000, 0.000)");
    }
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(world.moved, "0.21 %, its picture by (0.52, 0.52) px"),
                                 world.moved);
}

/* Moved before the start, by a knock, by heat: each has its own message. */
static void test_a_rig_that_moved_is_reported(void)
{
    static const enum world_act calm[] = {TWENTY, TWENTY, TWENTY, TWENTY, TWENTY, TWENTY, TWENTY};
    static const enum world_act knock[] = {TWENTY, TWENTY, TWENTY, TWENTY, WORLD_KNOCK, TWENTY};
    static const enum world_act knocked[] = {WORLD_KNOCK, TWENTY, TWENTY, TWENTY, TWENTY};
    world_init(APP_STROBE_ALWAYS, knocked, COUNT(knocked));
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    assert_moved(1, "since its calibration", "(0.200, 0.000, 0.000)");
    world_init(APP_STROBE_ALWAYS, knock, COUNT(knock));
    world.alignment.state = IH_ALIGN_FITS;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    assert_moved(1, "at once", "(0.200, 0.000, 0.000)");
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(world.moved, "depth is not known"), world.moved);
    assert_lens_is_seen();
    /* 0.07 degrees in 140 frames: one report at the beginning, one at 0.05 more. */
    world_init(APP_STROBE_ALWAYS, calm, COUNT(calm));
    world.alignment.state = IH_ALIGN_MOVED;
    world.drift_rad_q30[2] = WORLD_KNOCK_RAD_Q30 / 400;
    world.alignment.is_depth_known = true;
    world.alignment.depth_sigma_rad_q30 = 187402; /* 0.01 degrees: 175 um of 12.5 mm */
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    assert_moved(2, "slowly", "depth is known to +-14.0 mm at 1 m");
}

/* Frames in flight were exposed before the laser was on: none of them counts. */
static void test_gated_with_frames_in_flight(void)
{
    static const enum world_act acts[] = {TWENTY, TWENTY};
    for (int flight = 1; flight <= 4; flight++) {
        world_init(APP_STROBE_GATED, acts, COUNT(acts));
        world.flight = flight;
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(0, world.dark_count);
        TEST_ASSERT_GREATER_THAN_INT(20, world.lit_count);
    }
}

static void test_alternating(void)
{
    static const enum world_act acts[] = {TWENTY};
    world_init(APP_STROBE_ALTERNATING, acts, COUNT(acts));
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(10, world.lit_count);
    TEST_ASSERT_EQUAL_INT(10, world.record_count);
    TEST_ASSERT_EQUAL_INT(9, world.ambient_count); /* all lit ones but the first */
    TEST_ASSERT_EQUAL_INT(0, count_in_records("skipped"));
    for (int flight = 1; flight <= 4; flight++) {
        world_init(APP_STROBE_ALTERNATING, acts, COUNT(acts));
        world.flight = flight;
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(0, world.dark_count);
        TEST_ASSERT_GREATER_OR_EQUAL_INT(6, world.lit_count);
        TEST_ASSERT_GREATER_THAN_INT(0, world.ambient_count);
    }
}

static void test_always(void)
{
    static const enum world_act acts[] = {TWENTY};
    for (int flight = 0; flight <= 4; flight++) {
        world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
        world.flight = flight;
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(0, world.dark_count);
        if (flight < 3) {
            TEST_ASSERT_EQUAL_INT(20 - flight, world.lit_count);
            TEST_ASSERT_EQUAL_INT(1, world.rise_count);
        } else { /* the first frame comes too late for the laser to stay on until then */
            TEST_ASSERT_GREATER_OR_EQUAL_INT(20 - 2 * flight, world.lit_count);
            TEST_ASSERT_EQUAL_INT(2, world.rise_count);
        }
    }
}

/* The second record after a disturbance at the latest is as if nothing had been. */
static void test_lost_twice_half(void)
{
    static const enum world_act disturbances[] = {WORLD_LOST, WORLD_TWICE, WORLD_HALF};
    static const char *const expected[] = {"\"lost\":1", "\"skipped\":1", "\"skipped\":1"};
    for (int i = 0; i < 3; i++) {
        enum world_act acts[] = {FIVE, disturbances[i], FIVE, FIVE};
        world_init(APP_STROBE_GATED, acts, COUNT(acts));
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(0, world.dark_count);
        TEST_ASSERT_GREATER_OR_EQUAL_INT(15, world.lit_count);
        TEST_ASSERT_EQUAL_INT(1, count_in_records(expected[i]));
        world_init(APP_STROBE_ALTERNATING, acts, COUNT(acts));
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(0, world.dark_count);
        TEST_ASSERT_GREATER_OR_EQUAL_INT(7, world.lit_count);
    }
}

/* Frames stop: off within 3 frame times (world_look_waiting sees to that), and on again. */
static void test_late(void)
{
    static const enum world_act acts[] = {FIVE,        WORLD_PAUSE, WORLD_PAUSE, WORLD_PAUSE,
                                          WORLD_PAUSE, WORLD_PAUSE, WORLD_PAUSE, TWENTY};
    for (int mode = 0; mode < 3; mode++) {
        world_init((enum app_strobe)mode, acts, COUNT(acts));
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(0, world.dark_count);
        TEST_ASSERT_EQUAL_INT(1, count_in_records("\"strobe\":\"late\""));
        TEST_ASSERT_GREATER_OR_EQUAL_INT(mode == APP_STROBE_ALTERNATING ? 11 : 23, world.lit_count);
        TEST_ASSERT_EQUAL_INT(1, world.calls[WORLD_CAMERA_OPEN]);
    }
}

/* Another program has set a frame time of 1000 s, or the camera is too slow for the cap: a message,
 * and no light. Without a laser a slow camera is none of its business. */
static void test_a_rate_that_does_not_fit_is_refused(void)
{
    static const enum world_act acts[] = {TWENTY};
    static const int32_t frame_times_us[] = {1000000000, INT32_MAX, 1000001, 999, 1, -1, 100001};
    for (int i = 0; i < COUNT(frame_times_us); i++) {
        world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
        world.frame_time_us = frame_times_us[i];
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(0, world.rise_count);
        TEST_ASSERT_EQUAL_INT(0, world.record_count);
        TEST_ASSERT_GREATER_THAN_INT_MESSAGE(1, world.calls[WORLD_CAMERA_OPEN], "not tried again");
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(world.camera_text, "a frame every"), world.camera_text);
    }
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(world.camera_text, "expected at most 100000 us, or "
                                                           "laser-cap = 201"),
                                 world.camera_text);
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    world.frame_time_us = 1000000;
    world.config.laser = false;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(20, world.record_count);
}

/* Frames of a slow processor: each is judged, and the light goes off where it would not be in time. */
static void test_frames_that_take_long(void)
{
    static const enum world_act acts[] = {TWENTY, TWENTY, TWENTY};
    for (int mode = 0; mode < 3; mode++) {
        world_init((enum app_strobe)mode, acts, COUNT(acts));
        world.busy_us = 1500 * WORLD_CAP_MS;
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_LESS_OR_EQUAL_INT_MESSAGE(1, world.busy_on_count, "the first one says it");
        TEST_ASSERT_GREATER_THAN_INT(5, world.lit_count);
    }
}

/* Frames stay away: the camera is opened anew. */
static void test_silent(void)
{
    enum world_act acts[60];
    for (int i = 0; i < COUNT(acts); i++) {
        acts[i] = i >= 5 && i < 45 ? WORLD_PAUSE : WORLD_FRAME;
    }
    world_init(APP_STROBE_GATED, acts, COUNT(acts));
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_GREATER_THAN_INT(1, world.calls[WORLD_CAMERA_OPEN]);
    TEST_ASSERT_EQUAL_INT(1, count_in_records("\"strobe\":\"reopened\""));
    TEST_ASSERT_GREATER_OR_EQUAL_INT(18, world.lit_count);
}

static void test_interlock(void)
{
    static const enum world_act acts[] = {
        FIVE, WORLD_INTERLOCK_OPENS, TWENTY, WORLD_INTERLOCK_CLOSES, FIVE, FIVE};
    for (int mode = 0; mode < 3; mode++) {
        world_init((enum app_strobe)mode, acts, COUNT(acts));
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, world.dark_count,
                                      "a dark frame was taken for an empty seat");
        TEST_ASSERT_GREATER_OR_EQUAL_INT(mode == APP_STROBE_ALTERNATING ? 7 : 14, world.lit_count);
        TEST_ASSERT_LESS_OR_EQUAL_INT(17, world.lit_count);
    }
}

static void test_interlock_blinks(void)
{
    static const enum world_act acts[] = {FIVE, WORLD_INTERLOCK_BLINKS, FIVE};
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(2, world.rise_count); /* off in between, though it was too short to see */
}

static void test_unplugged(void)
{
    static const enum world_act acts[] = {FIVE, WORLD_UNPLUGGED, TWENTY, TWENTY, TWENTY, TWENTY};
    world_init(APP_STROBE_ALTERNATING, acts, COUNT(acts));
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_GREATER_THAN_INT(2, world.calls[WORLD_CAMERA_OPEN]);
    TEST_ASSERT_LESS_THAN_INT(8, world.calls[WORLD_CAMERA_OPEN]); /* each try later than the last */
    TEST_ASSERT_EQUAL_INT(1, count_in_records("\"strobe\":\"reopened\""));
    TEST_ASSERT_GREATER_THAN_INT(20, world.lit_count);
}

/* A camera that was never there is not one that is there again. */
static void test_plugged_in_late(void)
{
    static const enum world_act acts[] = {TWENTY, TWENTY};
    world_init(APP_STROBE_GATED, acts, COUNT(acts));
    world.unplugged_until_us = world.now_us + WORLD_UNPLUGGED_US;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_GREATER_THAN_INT(10, world.lit_count);
    TEST_ASSERT_EQUAL_INT(0, count_in_records("reopened"));
}

static void test_reload(void)
{
    static const enum world_act acts[] = {FIVE, WORLD_RELOAD, FIVE};
    world_init(APP_STROBE_GATED, acts, COUNT(acts));
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(11, world.lit_count);
}

/* The accelerometer's up for a rig that has none, and a message where one that has is off; also after a reload. */
static void test_up_by_an_accelerometer(void)
{
    static const enum world_act acts[] = {FIVE, WORLD_RELOAD, FIVE};
    static const int32_t down_30_q30[3] = {0, -929887697, -536870912};
    static const int32_t level_q30[3] = {0, -(1 << 30), 0};
    world_init(APP_STROBE_GATED, acts, COUNT(acts));
    world.state.measured_up_q30 = down_30_q30;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT32_ARRAY(down_30_q30, world_head.rig.calibration.up_q30, 3);
    TEST_ASSERT_EQUAL_INT(2, world.up_count);
    TEST_ASSERT_EQUAL_STRING("good: has no up, the accelerometer's is used", world.up);
    for (int is_off = 0; is_off < 2; is_off++) {
        world_init(APP_STROBE_GATED, acts, COUNT(acts));
        memcpy(world.rig_up_q30, level_q30, sizeof level_q30);
        world.state.measured_up_q30 = is_off ? down_30_q30 : level_q30;
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT32_ARRAY(level_q30, world_head.rig.calibration.up_q30, 3);
        TEST_ASSERT_EQUAL_INT(2 * is_off, world.up_count);
    }
    TEST_ASSERT_EQUAL_STRING(
        "good: its up is [0.000, -1.000, 0.000], tilt 0.0 and roll 0.0 degrees; by the "
        "accelerometer it is [0.000, -0.866, -0.500], tilt 30.0 and roll 0.0 degrees: 30.0 degrees "
        "from it, at most 10.0 are good. Does the camera hang otherwise now? The rig's is used",
        world.up);
    world_init(APP_STROBE_GATED, acts, COUNT(acts));
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(0, world_head.rig.calibration.up_q30[1]);
    TEST_ASSERT_EQUAL_INT(0, world.up_count);
}

/* All around, and on both sides of the limit. */
static void test_ups_apart(void)
{
    static const struct {
        double own[3], measured[3];
        int message_count;
        const char *text;
    } cases[] = {
        {{0, -1, 0}, {0.172, -0.98510, 0}, 0, ""}, /* 9.90 degrees */
        {{0, -1, 0}, {0.176, -0.98439, 0}, 1, ": 10.1 degrees"},
        {{0, -1, 0}, {0, 1, 0}, 1, ": 180.0 degrees"},
        {{1, 0, 0}, {0, 1, 0}, 1, ": 90.0 degrees"},
        {{-0.6, 0, -0.8}, {-0.6, 0, -0.8}, 0, ""},
        {{-0.6, 0, -0.8}, {-0.8, 0, -0.6}, 1, "tilt 36.9 and roll -90.0 degrees: 16.3 degrees"},
        {{0, 0.6, 0.8}, {0, 0.6, -0.8}, 1, "tilt 53.1 and roll 180.0 degrees: 106.3 degrees"},
    };
    for (int i = 0; i < COUNT(cases); i++) {
        struct ih_calibration calibration = {.width = 752};
        int32_t measured_q30[3];
        world_init(APP_STROBE_GATED, NULL, 0);
        for (int axis = 0; axis < 3; axis++) {
            calibration.up_q30[axis] = (int32_t)(cases[i].own[axis] * (1 << 30));
            measured_q30[axis] = (int32_t)(cases[i].measured[axis] * (1 << 30));
        }
        world.state.measured_up_q30 = measured_q30;
        app_health_up(&world.state, &calibration);
        TEST_ASSERT_EQUAL_INT_MESSAGE(cases[i].message_count, world.up_count, world.up);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(world.up, cases[i].text), world.up);
        TEST_ASSERT_EQUAL_INT32((int32_t)(cases[i].own[1] * (1 << 30)), calibration.up_q30[1]);
    }
}

/* The paper's method alone, if it is set, also after the rig has been read again. */
static void test_paper(void)
{
    static const enum world_act acts[] = {FIVE, WORLD_RELOAD, FIVE};
    for (int paper = 0; paper < 2; paper++) {
        world_init(APP_STROBE_GATED, acts, COUNT(acts));
        world.config.paper = paper == 1;
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(paper, world_head.params.is_paper);
    }
}

/* Not to be read, of another kind, or of another size: laser off, no records. */
static void test_reload_bad(void)
{
    static const enum world_act acts[] = {FIVE, WORLD_RELOAD, TWENTY};
    static const char *const rigs[] = {"bad", "range", "narrow"};
    for (int i = 0; i < 3; i++) {
        world_init(APP_STROBE_GATED, acts, COUNT(acts));
        world.next_rig = rigs[i];
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_LESS_OR_EQUAL_INT(6, world.lit_count);
        TEST_ASSERT_LESS_OR_EQUAL_INT(7, world.rise_count);
        TEST_ASSERT_EQUAL_INT(0, world.dark_count);
    }
}

/* A good one after a bad one: the very next frame is lit. A camera that waits for the laser sends none
 * without. */
static void test_reload_good_again(void)
{
    static const enum world_act acts[] = {FIVE, WORLD_RELOAD_ALONE, WORLD_FRAME, WORLD_RELOAD_ALONE,
                                          FIVE};
    for (int mode = 0; mode < 3; mode++) {
        world_init((enum app_strobe)mode, acts, COUNT(acts));
        world.next_rig = "bad";
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(0, world.dark_count);
        TEST_ASSERT_EQUAL_INT(mode == APP_STROBE_ALTERNATING ? 6 : 10, world.lit_count);
    }
}

static void test_no_rig(void)
{
    static const enum world_act acts[] = {FIVE};
    world_init(APP_STROBE_GATED, acts, COUNT(acts));
    world.config.rig = "bad";
    TEST_ASSERT_EQUAL_INT(APP_EXIT_USAGE, world_run());
    TEST_ASSERT_EQUAL_INT(0, world.calls[WORLD_STROBE_OPEN]);
}

static void test_without_laser(void)
{
    static const enum world_act acts[] = {TWENTY};
    world_init(APP_STROBE_ALTERNATING, acts, COUNT(acts));
    world.config.laser = false;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(20, world.dark_count); /* every frame is taken */
    TEST_ASSERT_EQUAL_INT(0, world.calls[WORLD_STROBE_OPEN]);
    TEST_ASSERT_EQUAL_INT(0, world.rise_count);
}

/* No frame shows dots, as in an empty hall: still a record now and then, saying so. In always mode
 * for every frame, once the laser has been on for longer than frames are in flight. */
static void test_nothing_in_range(void)
{
    static const enum world_act acts[] = {TWENTY, TWENTY};
    static const int records[] = {[APP_STROBE_ALWAYS] = 40 - APP_PHASE_FLIGHT_MAX,
                                  [APP_STROBE_GATED] = 40 / (APP_PHASE_FLIGHT_MAX + 1),
                                  [APP_STROBE_ALTERNATING] = 40 / (APP_PHASE_FLIGHT_MAX + 2)};
    for (int mode = 0; mode < 3; mode++) {
        world_init((enum app_strobe)mode, acts, COUNT(acts));
        world.is_empty = true;
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(0, world.lit_count);
        TEST_ASSERT_EQUAL_INT(records[mode], world.dark_count);
    }
}

/* An exposure ends within its frame, and one that differs is sent to the camera: every second one. */
static void test_exposure(void)
{
    static const enum world_act acts[] = {FIVE};
    static const int32_t frame_times_us[] = {WORLD_FRAME_US, 20001, 19999, 10000};
    static const int32_t max_us[] = {20000, 20000, 19999, 10000};
    for (int i = 0; i < COUNT(frame_times_us); i++) {
        world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
        world.config.exposure = APP_EXPOSURE_STEER;
        world.frame_time_us = frame_times_us[i];
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT32(max_us[i], world.exposure_max_us);
        if (i == 0) {
            TEST_ASSERT_EQUAL_INT(5, world.lit_count);
            TEST_ASSERT_EQUAL_INT(1 + 3, world.calls[WORLD_CAMERA_EXPOSURE]);
        }
    }
}

/* A camera that refuses is not opened again. */
static void test_exposure_refused(void)
{
    static const enum world_act acts[] = {TWENTY};
    for (int call = 1; call <= 2; call++) {
        world_init(APP_STROBE_GATED, acts, COUNT(acts));
        world.config.exposure = APP_EXPOSURE_STEER;
        world.faults[0] = (struct world_fault){WORLD_CAMERA_EXPOSURE, call, .stays = true};
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(call, world.calls[WORLD_CAMERA_EXPOSURE]);
        TEST_ASSERT_EQUAL_INT(20, world.lit_count);
    }
}

/* 1000 frames a second for 25 days: still lit, whatever it shows. */
static void test_on_for_long(void)
{
    static const enum world_act acts[] = {WORLD_FRAME};
    static const uint8_t nothing = 0;
    struct hal_frame frame = {.samples = &nothing, .width = 752, .height = 582, .name = ""};
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    world.state.laser.is_on = world.state.light_wanted = true;
    world.state.on_frames = INT32_MAX;
    world.held[0] = true;
    app_frame_use(&world.state, &frame);
    TEST_ASSERT_GREATER_THAN_INT32(APP_PHASE_FLIGHT_MAX, world.state.on_frames);
    TEST_ASSERT_EQUAL_INT(1, world.dark_count);
    /* One of another size is lost, with a record that says so, and is given back. */
    frame.width = 640;
    world.held[0] = true;
    app_frame_use(&world.state, &frame);
    TEST_ASSERT_EQUAL_INT(1, world.error_count);
    TEST_ASSERT_FALSE(world.held[0]);
}

/* Nobody sees anything in frames that cannot be read: they do not keep the laser on. A good one does
 * again. */
static void test_bad_frames_only(void)
{
    static const enum world_act acts[] = {FIVE, TWENTY};
    for (int mode = 0; mode < 3; mode++) {
        for (int flight = 0; flight <= 2; flight += 2) {
            world_init((enum app_strobe)mode, acts, COUNT(acts));
            world.flight = flight;
            world.faults[0] = (struct world_fault){WORLD_CAMERA_NEXT_BAD, 4, .stays = true};
            TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
            TEST_ASSERT_GREATER_THAN_INT(15, world.error_count);
            TEST_ASSERT_EQUAL_INT(1, world.calls[WORLD_CAMERA_OPEN]);
        }
    }
}

/* What has a record, and what was its ambient light: nothing else, or a replay would give other records. */
static void test_what_is_used_is_recorded(void)
{
    static const enum world_act acts[] = {TWENTY, WORLD_TWICE,  WORLD_HALF,
                                          TWENTY, WORLD_RELOAD, TWENTY};
    for (int mode = 0; mode < 3; mode++) {
        for (int flight = 0; flight <= 2; flight += 2) {
            world_init((enum app_strobe)mode, acts, COUNT(acts));
            world.flight = flight;
            TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
            TEST_ASSERT_EQUAL_INT(world.record_count, world.kept_count);
            TEST_ASSERT_EQUAL_INT(mode == APP_STROBE_ALTERNATING, world.kept_dark_count > 0);
            TEST_ASSERT_EQUAL_INT(1, world.write_count);
            TEST_ASSERT_TRUE(world.writes);
            TEST_ASSERT_EQUAL_INT(1, world.rig_count);
        }
    }
}

static void test_without_a_recorder(void)
{
    static const enum world_act acts[] = {TWENTY, WORLD_RECORD, WORLD_RELOAD, TWENTY};
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    world.state.hal.recorder = NULL;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(0, world.kept_count + world.write_count);
}

/* Two seconds from its request on, and from a second one during it. */
static void test_a_recording_is_requested(void)
{
    static const enum world_act acts[] = {TWENTY, WORLD_RECORD, TWENTY, WORLD_RECORD,
                                          TWENTY, TWENTY,       TWENTY, TWENTY};
    const int64_t second_us = 42 * WORLD_FRAME_US;
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    world.config.record_when = APP_RECORD_SIGNAL;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(2, world.write_count);
    TEST_ASSERT_FALSE(world.writes);
    TEST_ASSERT_EQUAL_INT(world.record_count, world.kept_count); /* in memory, all of them */
    TEST_ASSERT_INT64_WITHIN(WORLD_FRAME_US, 1000000 + second_us + 2000000, world.end_us);
}

/* Once for the rig that moved, and not again while it stays so. */
static void test_a_rig_that_moves_is_recorded(void)
{
    static const enum world_act acts[] = {TWENTY, WORLD_RECORD, TWENTY, TWENTY, TWENTY, WORLD_KNOCK,
                                          TWENTY, TWENTY,       TWENTY, TWENTY, TWENTY};
    for (int is_lost = 0; is_lost < 2; is_lost++) {
        world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
        world.config.record_when = APP_RECORD_MOVED;
        world.alignment.state = is_lost ? IH_ALIGN_LOST : IH_ALIGN_FITS;
        TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
        TEST_ASSERT_EQUAL_INT(is_lost ? 3 : 2, world.write_count); /* lost, requested, moved */
        TEST_ASSERT_FALSE(world.writes);
    }
}

/* Once a second has passed without a head; again only after one was there. */
static void test_a_head_that_is_missed_is_recorded(void)
{
    static const enum world_act acts[] = {TWENTY, TWENTY, TWENTY, TWENTY,
                                          TWENTY, TWENTY, TWENTY, TWENTY};
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    world.config.record_when = APP_RECORD_NO_HEAD;
    world.config.record_no_head_s = 1;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(1, world.write_count);
    TEST_ASSERT_INT64_WITHIN(2 * WORLD_FRAME_US, 1000000 + 1000000, world.write_us);
    TEST_ASSERT_INT64_WITHIN(2 * WORLD_FRAME_US, world.write_us + 2000000, world.end_us);
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    world.config.record_when = APP_RECORD_NO_HEAD;
    world.config.record_no_head_s = 1;
    world.head_count = 1;
    world_head.result.head[0] = 0;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(0, world.write_count);
}

/* A disk that does not keep up, or is full: the log has it, and nothing else changes. */
static void test_a_recorder_that_fails_changes_no_record(void)
{
    static const enum world_act acts[] = {TWENTY, TWENTY};
    static char records[sizeof world.records];
    world_init(APP_STROBE_ALTERNATING, acts, COUNT(acts));
    world_run();
    memcpy(records, world.records, sizeof records);
    int rise_count = world.rise_count;
    world_init(APP_STROBE_ALTERNATING, acts, COUNT(acts));
    world.faults[0] = (struct world_fault){WORLD_RECORDER_KEEP, 2, .stays = true};
    world.faults[1] = (struct world_fault){WORLD_RECORDER_NEWS, 3, .stays = false};
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_STRING(records, world.records);
    TEST_ASSERT_EQUAL_INT(rise_count, world.rise_count);
    TEST_ASSERT_EQUAL_INT(1, world.kept_count + world.kept_dark_count);
    TEST_ASSERT_GREATER_THAN_INT64(10, world.state.status.unrecorded_count);
    TEST_ASSERT_EQUAL_INT(1, world.news_count);
}

/* A directory's frames wait: one at a time, none late, and their end is a good one. */
static void test_a_camera_that_waits(void)
{
    static const enum world_act acts[] = {TWENTY,      WORLD_TWICE, WORLD_PAUSE, WORLD_PAUSE,
                                          WORLD_PAUSE, WORLD_PAUSE, WORLD_PAUSE, TWENTY};
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    world.config.laser = false;
    world.camera.waits = true;
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(42, world.record_count);
    TEST_ASSERT_EQUAL_INT(0, count_in_records("skipped") + count_in_records("late"));
    world_init(APP_STROBE_ALWAYS, acts, COUNT(acts));
    world.faults[0] = (struct world_fault){WORLD_CAMERA_NEXT_END, 5, .stays = true};
    TEST_ASSERT_EQUAL_INT(APP_EXIT_GOOD, world_run());
    TEST_ASSERT_EQUAL_INT(1, world.calls[WORLD_CAMERA_OPEN]);
    TEST_ASSERT_LESS_THAN_INT(10, world.act_index);
}

/* Every kind of thing that can happen, for the faults. */
static const enum world_act eventful[] = {
    FIVE,         WORLD_LOST,
    WORLD_FRAME,  WORLD_TWICE,
    WORLD_FRAME,  WORLD_HALF,
    WORLD_FRAME,  WORLD_INTERLOCK_OPENS,
    WORLD_FRAME,  WORLD_INTERLOCK_CLOSES,
    FIVE,         WORLD_PAUSE,
    WORLD_PAUSE,  WORLD_PAUSE,
    WORLD_PAUSE,  WORLD_PAUSE,
    WORLD_FRAME,  WORLD_RELOAD,
    WORLD_RECORD, WORLD_INTERLOCK_BLINKS,
    FIVE,         WORLD_UNPLUGGED,
    FIVE,         FIVE,
};

static void init_eventful(int mode, int flight)
{
    world_init((enum app_strobe)mode, eventful, COUNT(eventful));
    world.flight = flight;
    world.config.exposure = APP_EXPOSURE_STEER;
    world.config.duty_percent = 90;
}

/* After what faults nothing is known any more: the program ends. */
static bool is_fatal(enum world_function function)
{
    switch (function) {
    case WORLD_STROBE_OPEN:
    case WORLD_STROBE_ON:
    case WORLD_STROBE_ON_HIGH:
    case WORLD_STROBE_BEAT:
    case WORLD_STROBE_INTERLOCK:
    case WORLD_STROBE_JUDGED:
    case WORLD_STROBE_PROVE:
    case WORLD_EVENTS_WAIT:
    case WORLD_WATCHDOG_FEED:
    case WORLD_OUTPUT_NEVER:
        return true;
    default:
        return false;
    }
}

/* Runs with a fault at each call of a function; false in counts: none at all. */
static int fail_each_call(enum world_function function, int mode, int flight, bool stays)
{
    init_eventful(mode, flight);
    world_run();
    int calls = world.calls[function];
    for (int call = 1; call <= calls; call++) {
        static char message[128]; /* reported after a failure */
        init_eventful(mode, flight);
        world.faults[0] = (struct world_fault){function, call, .stays = stays};
        snprintf(message, sizeof message, "%s, call %d, mode %d, flight %d, %s",
                 world_function_text[function], call, mode, flight, stays ? "for good" : "once");
        world_doing = message;
        enum app_exit exit = world_run();
        TEST_ASSERT_TRUE_MESSAGE(world.faults[0].done, message);
        /* Off may have been tried again with success. For good: a message has to say so. */
        if (function != WORLD_STROBE_OFF || stays) {
            bool failed = is_fatal(function) || function == WORLD_STROBE_OFF;
            TEST_ASSERT_EQUAL_INT_MESSAGE(failed ? APP_EXIT_FAILED : APP_EXIT_GOOD, exit, message);
            TEST_ASSERT_TRUE_MESSAGE(world.reported_fault || function != WORLD_STROBE_OFF, message);
            TEST_ASSERT_EQUAL_MESSAGE(function == WORLD_OUTPUT_NEVER, world.reported_output,
                                      message);
        }
    }
    world_doing = NULL;
    return calls;
}

static void test_every_call_fails(void)
{
    int all = 0;
    printf("faults injected: calls of each function, three modes, without and with 2 frames in "
           "flight,\nonce and for good; line low after every one\n");
    for (int function = 0; function < WORLD_FUNCTIONS; function++) {
        int sum = 0;
        for (int mode = 0; mode < 3; mode++) {
            for (int flight = 0; flight <= 2; flight += 2) {
                int calls = fail_each_call((enum world_function)function, mode, flight, false);
                TEST_ASSERT_GREATER_THAN_INT_MESSAGE(0, calls, world_function_text[function]);
                sum += calls + fail_each_call((enum world_function)function, mode, flight, true);
            }
        }
        printf("  %-24s %5d\n", world_function_text[function], sum);
        all += sum;
    }
    printf("  %-24s %5d\n", "all", all);
}

/* 0 .. below - 1, the same in every run of the test. */
static int random_below(uint32_t *state, int below)
{
    *state = *state * 1664525u + 1013904223u;
    return (int)((uint64_t)*state * (uint32_t)below >> 32);
}

/* Two faults in one run, at any of their calls. The second may come while the first is dealt with. */
static void test_two_calls_fail(void)
{
    enum { RUNS = 25000 };
    int calls[3][2][WORLD_FUNCTIONS];
    int both_count = 0;
    uint32_t random = 20;
    for (int mode = 0; mode < 3; mode++) {
        for (int flight = 0; flight < 2; flight++) {
            init_eventful(mode, 2 * flight);
            world_run();
            memcpy(calls[mode][flight], world.calls, sizeof world.calls);
        }
    }
    for (int run = 0; run < RUNS; run++) {
        int mode = random_below(&random, 3), flight = random_below(&random, 2);
        static char message[160]; /* reported after a failure */
        init_eventful(mode, 2 * flight);
        for (int i = 0; i < WORLD_FAULTS; i++) {
            int function = random_below(&random, WORLD_FUNCTIONS);
            world.faults[i] = (struct world_fault){
                (enum world_function)function,
                1 + random_below(&random, calls[mode][flight][function]),
                .stays = random_below(&random, 4) == 0,
            };
        }
        const struct world_fault *faults = world.faults;
        snprintf(message, sizeof message, "run %d: %s, call %d; %s, call %d", run,
                 world_function_text[faults[0].function], faults[0].call,
                 world_function_text[faults[1].function], faults[1].call);
        world_doing = message;
        world_run();
        both_count += faults[0].done && faults[1].done;
    }
    world_doing = NULL;
    printf("two faults in each of %d runs, %d times both were reached; line low after every one\n",
           RUNS, both_count);
    TEST_ASSERT_GREATER_THAN_INT(RUNS / 4, both_count);
}

/* Anything in any order. Then all is well again for long enough: there are records. */
static void test_anything_happens(void)
{
    enum { RUNS = 3000, ACTS = 80, CALM = 200 };
    static const int32_t duties[] = {1, 10, 30, 50, 90, 100};
    static enum world_act acts[ACTS + CALM];
    uint32_t random = 4;
    for (int run = 0; run < RUNS; run++) {
        static char message[80]; /* reported after a failure */
        int wild = 1 + random_below(&random, 8);
        for (int i = 0; i < ACTS; i++) {
            acts[i] = random_below(&random, 8) >= wild
                          ? WORLD_FRAME
                          : (enum world_act)random_below(&random, WORLD_STOP);
        }
        for (int i = ACTS; i < ACTS + CALM; i++) {
            acts[i] = i == ACTS       ? WORLD_INTERLOCK_CLOSES
                      : i == ACTS + 1 ? WORLD_RELOAD
                                      : WORLD_FRAME;
        }
        int mode = random_below(&random, 3);
        world_init((enum app_strobe)mode, acts, ACTS + CALM);
        world.flight = random_below(&random, 5);
        world.config.duty_percent = duties[random_below(&random, COUNT(duties))];
        world.busy_us = random_below(&random, 3) * 10000;
        world.config.exposure = random_below(&random, 2) ? APP_EXPOSURE_STEER : APP_EXPOSURE_KEEP;
        world.next_rig = "now and then";
        world.rig_random = random;
        world.rig_is_good_from_act = ACTS;
        snprintf(message, sizeof message, "run %d: mode %d, flight %d, duty %d", run, mode,
                 world.flight, (int)world.config.duty_percent);
        world_doing = message;
        TEST_ASSERT_EQUAL_INT_MESSAGE(APP_EXIT_GOOD, world_run(), message);
        TEST_ASSERT_TRUE_MESSAGE(world.last_record_us > world.now_us - 20 * WORLD_FRAME_US ||
                                     world.config.duty_percent < 50,
                                 message);
    }
    world_doing = NULL;
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(test_gated_takes_every_frame);
    RUN_TEST(test_check_says_whether_the_rig_fits);
    RUN_TEST(test_check_does_not_wait_for_ever);
    RUN_TEST(test_check_that_is_stopped_has_failed);
    RUN_TEST(test_a_lost_rig_is_reported);
    RUN_TEST(test_a_rig_that_is_lost_for_moments_is_not_reported);
    RUN_TEST(test_a_rig_that_moved_is_reported);
    RUN_TEST(test_gated_with_frames_in_flight);
    RUN_TEST(test_alternating);
    RUN_TEST(test_always);
    RUN_TEST(test_lost_twice_half);
    RUN_TEST(test_late);
    RUN_TEST(test_a_rate_that_does_not_fit_is_refused);
    RUN_TEST(test_frames_that_take_long);
    RUN_TEST(test_silent);
    RUN_TEST(test_interlock);
    RUN_TEST(test_interlock_blinks);
    RUN_TEST(test_unplugged);
    RUN_TEST(test_plugged_in_late);
    RUN_TEST(test_reload);
    RUN_TEST(test_up_by_an_accelerometer);
    RUN_TEST(test_ups_apart);
    RUN_TEST(test_paper);
    RUN_TEST(test_reload_bad);
    RUN_TEST(test_reload_good_again);
    RUN_TEST(test_no_rig);
    RUN_TEST(test_without_laser);
    RUN_TEST(test_nothing_in_range);
    RUN_TEST(test_exposure);
    RUN_TEST(test_exposure_refused);
    RUN_TEST(test_on_for_long);
    RUN_TEST(test_bad_frames_only);
    RUN_TEST(test_what_is_used_is_recorded);
    RUN_TEST(test_without_a_recorder);
    RUN_TEST(test_a_recording_is_requested);
    RUN_TEST(test_a_rig_that_moves_is_recorded);
    RUN_TEST(test_a_head_that_is_missed_is_recorded);
    RUN_TEST(test_a_recorder_that_fails_changes_no_record);
    RUN_TEST(test_a_camera_that_waits);
    RUN_TEST(test_every_call_fails);
    RUN_TEST(test_two_calls_fail);
    RUN_TEST(test_anything_happens);
    return UNITY_END();
}
