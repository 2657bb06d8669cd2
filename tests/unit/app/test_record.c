/* app_record, app_write: records in memory, their longest, and what live cameras add. The usual ones
 * are compared whole in the simulator's tests. */
#include "app_record.h"

#include "app_rig_text.h"
#include "app_write.h"
#include "ih_test.h"

static struct isohead head;
static struct app_record record;
static struct hal_frame frame;

void setUp(void)
{
    memset(&head, 0, sizeof head);
    memset(&record, IH_TEST_FILL, sizeof record);
    record.dir = NULL;
    frame = (struct hal_frame){.name = "000007.pgm", .time_us = 280000};
    head.result.selected = IH_NONE;
    head.align.now.across_px_q12 = -1;
}

void tearDown(void)
{
}

static void assert_record(const char *wanted)
{
    TEST_ASSERT_EQUAL_UINT64(strlen(wanted), record.length);
    TEST_ASSERT_EQUAL_MEMORY(wanted, record.text, record.length);
    /* Nothing behind it. */
    TEST_ASSERT_EQUAL_HEX8(IH_TEST_FILL, record.text[record.length]);
}

#define START "{\"file\":\"000007.pgm\",\"time_us\":280000,\"dots\":0,\"labelled\":0,"
#define NOTHING "\"hypotheses\":[],\"heads\":[],\"head\":null"
#define NO_RIG                                                                                   \
    ",\"rig\":{\"state\":\"unknown\",\"across_px\":null,\"rotation_deg\":[0.000,0.000,0.000],"   \
    "\"sigma_deg\":[0.000,0.000,0.000],\"focal_percent\":0.00,\"shift_px\":[0.00,0.00],\"depth_" \
    "known\":false}"

static void live_cameras_add_what_is_not_as_usual(void)
{
    struct app_record_live live = {.lost_count = 0};

    TEST_ASSERT_TRUE(app_record_frame(&record, &frame, &head, NULL));
    assert_record(START NOTHING NO_RIG "}\n");
    setUp();
    TEST_ASSERT_TRUE(app_record_frame(&record, &frame, &head, &live));
    assert_record(START NOTHING NO_RIG "}\n");
    setUp();
    live.lost_count = 3;
    record.dir = "a\"b";
    TEST_ASSERT_TRUE(app_record_frame(&record, &frame, &head, &live));
    assert_record(START NOTHING NO_RIG ",\"lost\":3,\"dir\":\"a\\\"b\"}\n");
    setUp();
    live = (struct app_record_live){INT64_MAX, 1, "late"};
    head.dots.dots_dropped = 2;
    TEST_ASSERT_TRUE(app_record_frame(&record, &frame, &head, &live));
    assert_record(START NOTHING NO_RIG ",\"dropped\":{\"dots\":2},\"lost\":9223372036854775807,"
                                       "\"skipped\":1,\"strobe\":\"late\"}\n");
}

/* How the rig has moved: with dots, and not with the paper's method alone. */
static void dot_rigs_have_their_alignment(void)
{
    static const struct ih_alignment moved = {
        .state = IH_ALIGN_MOVED,
        .rotation_rad_q30 = {3748066, -18740330, 9371}, /* 0.2, -1, 0.0005 degrees */
        .sigma_rad_q30 = {187403, 1874033, 374807},     /* 0.01, 0.1, 0.02 degrees */
        .focal_q30 = -5368709,                          /* -0.5 % */
        .shift_px_q12 = {0, -16384},                    /* -4 px */
        .across_px_q12 = 410,
        .is_depth_known = true,
    };
    static const char wanted[] =
        ",\"rig\":{\"state\":\"moved\",\"across_px\":0.10,\"rotation_deg\":[0.200,-1.000,0.001],"
        "\"sigma_deg\":[0.010,0.100,0.020],\"focal_percent\":-0.50,\"shift_px\":[0.00,-4.00],"
        "\"depth_known\":true}";
    static const char start[] =
        "{\"file\":\"000007.pgm\",\"time_us\":280000,\"dots\":0,\"labelled\":1,";
    static const char *const states[] = {
        [IH_ALIGN_UNKNOWN] = "unknown",
        [IH_ALIGN_FITS] = "fits",
        [IH_ALIGN_MOVED] = "moved",
        [IH_ALIGN_LOST] = "lost",
    };
    const struct app_record_live live = {.lost_count = 0};
    char text[512];

    head.align.now = moved;
    head.labels.labelled_count = 1;
    snprintf(text, sizeof text, "%s%s%s}\n", start, NOTHING, wanted);
    TEST_ASSERT_TRUE(app_record_frame(&record, &frame, &head, NULL));
    assert_record(text);
    /* A live camera has the distance twice, as readers know it. */
    snprintf(text, sizeof text, "%s%s%s,\"across_px\":0.10}\n", start, NOTHING, wanted);
    memset(&record.text, IH_TEST_FILL, sizeof record.text);
    TEST_ASSERT_TRUE(app_record_frame(&record, &frame, &head, &live));
    assert_record(text);
    head.params.is_paper = true;
    snprintf(text, sizeof text, "%s%s}\n", start, NOTHING);
    memset(&record.text, IH_TEST_FILL, sizeof record.text);
    TEST_ASSERT_TRUE(app_record_frame(&record, &frame, &head, &live));
    assert_record(text);
    head.params.is_paper = false;
    head.rig.calibration.kind = IH_RIG_RANGE;
    snprintf(text, sizeof text, "%s%s,\"points\":0}\n", start, NOTHING);
    memset(&record.text, IH_TEST_FILL, sizeof record.text);
    TEST_ASSERT_TRUE(app_record_frame(&record, &frame, &head, NULL));
    assert_record(text);
    for (int state = IH_ALIGN_UNKNOWN; state <= IH_ALIGN_LOST; state++) {
        TEST_ASSERT_EQUAL_STRING(states[state], app_rig_text((enum ih_align_state)state));
    }
}

static void errors_are_records_too(void)
{
    TEST_ASSERT_TRUE(app_record_error(&record, "x\x01\xff.pgm", "no\nthing"));
    assert_record("{\"file\":\"x\\u0001\\ufffd.pgm\",\"error\":\"no\\u000athing\"}\n");
}

/* Numbers as long as their types allow, and names as long as Linux allows. */
static void the_longest_record_has_room(void)
{
    static char name[256], dir[4096], error[HAL_ERROR_MAX], word[33];
    const struct app_record_live live = {INT64_MIN, INT64_MIN, word};
    int i;

    memset(name, 0x1b, sizeof name - 1);
    memset(dir, 0x1b, sizeof dir - 1);
    memset(error, 0x1b, sizeof error - 1);
    memset(word, 0x1b, sizeof word - 1);
    frame.name = name;
    frame.time_us = INT64_MIN;
    record.dir = dir;
    head.align.now = (struct ih_alignment){
        .state = IH_ALIGN_UNKNOWN,
        .rotation_rad_q30 = {INT32_MIN, INT32_MIN, INT32_MIN},
        .sigma_rad_q30 = {INT32_MIN, INT32_MIN, INT32_MIN},
        .focal_q30 = INT32_MIN,
        .shift_px_q12 = {INT32_MIN, INT32_MIN},
        .across_px_q12 = INT32_MAX,
    };
    head.dots.dot_count = head.points.seen_count = INT32_MIN;
    head.labels.labelled_count = INT32_MAX;
    head.dots.dots_dropped = head.labels.candidates_dropped = INT32_MIN;
    head.nests.minima_dropped = head.nests.contours_dropped = INT32_MIN;
    head.windows.places_dropped = head.detections.dropped_count = INT32_MIN;
    head.result.entry_count = head.result.head_count = IH_RESULT_MAX;
    head.result.selected = IH_RESULT_MAX - 1;
    for (i = 0; i < IH_RESULT_MAX; i++) {
        head.result.head[i] = INT32_MIN;
        head.result.entry[i] = (struct ih_result_entry){
            .u_px_q12 = INT32_MIN,
            .v_px_q12 = INT32_MIN,
            .a_px_q12 = INT32_MIN,
            .b_px_q12 = INT32_MIN,
            .angle_mdeg = 179999,
            .distance_mm_q8 = INT32_MIN,
            .centre_mm_q8 = {INT32_MIN, INT32_MIN, INT32_MIN},
            .rejected = IH_REJECT_CURVATURE,
            .has_probability = true,
            .probability_q16 = INT32_MIN,
            .track_id = INT32_MIN,
            .sigma_mm_q8 = INT32_MIN,
            .is_predicted = true,
            .pose = {true, INT32_MIN, INT32_MIN, INT32_MIN, INT32_MIN},
        };
    }
    TEST_ASSERT_TRUE(app_record_frame(&record, &frame, &head, &live));
    TEST_ASSERT_EQUAL_MEMORY("\"}\n", record.text + record.length - 3, 3);
    printf("longest record: %zu bytes of %d\n", record.length, APP_RECORD_MAX);
    TEST_ASSERT_TRUE(app_record_error(&record, name, error));
    /* A name that no file has. */
    {
        static char longer[APP_RECORD_MAX];
        memset(longer, 'x', sizeof longer - 1);
        frame.name = longer;
        TEST_ASSERT_FALSE(app_record_frame(&record, &frame, &head, &live));
        TEST_ASSERT_EQUAL_UINT64(0, record.length);
        TEST_ASSERT_FALSE(app_record_error(&record, longer, error));
        TEST_ASSERT_EQUAL_UINT64(0, record.length);
    }
}

/* One byte less than is needed, and exactly as many; nothing is written beyond. */
static void memory_of_every_size_is_kept(void)
{
    static const char wanted[] = "{\"k\":[1,-2,true,null,\"a\\\\\"]}\n";
    char memory[sizeof wanted + 8];
    size_t size;

    for (size = 0; size < sizeof memory; size++) {
        struct app_write write = {.memory = memory, .size = size};
        memset(memory, IH_TEST_FILL, sizeof memory);
        app_write_open(&write, '{');
        app_write_key(&write, "k");
        app_write_open(&write, '[');
        app_write_int(&write, 1);
        app_write_int(&write, -2);
        app_write_bool(&write, true);
        app_write_null(&write);
        app_write_string(&write, "a\\");
        app_write_close(&write, ']');
        app_write_close(&write, '}');
        app_write_line_end(&write);
        TEST_ASSERT_EQUAL(size < sizeof wanted - 1, write.full);
        TEST_ASSERT_LESS_OR_EQUAL_UINT64(size, write.length);
        TEST_ASSERT_EQUAL_HEX8((char)IH_TEST_FILL, memory[write.length]);
        TEST_ASSERT_EQUAL_INT(0, memcmp(wanted, memory, write.length));
        if (!write.full) {
            TEST_ASSERT_EQUAL_UINT64(sizeof wanted - 1, write.length);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(live_cameras_add_what_is_not_as_usual);
    RUN_TEST(dot_rigs_have_their_alignment);
    RUN_TEST(errors_are_records_too);
    RUN_TEST(the_longest_record_has_room);
    RUN_TEST(memory_of_every_size_is_kept);
    return UNITY_END();
}
