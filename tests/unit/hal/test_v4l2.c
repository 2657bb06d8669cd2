/* The camera against a scripted device: what it chooses, what it refuses and how it says so, every
 * way in which a frame can fail, and that nothing stays open or mapped, whatever fails and when. */
#include "linux/hal_v4l2.h"

#include <fcntl.h>
#include <time.h>

#include "ih_test_v4l2.h"

#define WIDTH 20
#define HEIGHT 6
#define GREY V4L2_PIX_FMT_GREY
#define Y12P v4l2_fourcc('Y', '1', '2', 'P')
#define MONOTONIC V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC

static struct hal_v4l2 v4l2;
static struct hal_v4l2_config config;
static struct hal_frame frame;
static struct hal_error error;

static const uint32_t usable[] = {
    GREY, V4L2_PIX_FMT_Y12,  V4L2_PIX_FMT_Y10,  V4L2_PIX_FMT_Y16,   V4L2_PIX_FMT_Y10P,
    Y12P, V4L2_PIX_FMT_YUYV, V4L2_PIX_FMT_UYVY, V4L2_PIX_FMT_YUV420};
static const char *const usable_name[] = {"GREY", "Y12",  "Y10",  "Y16",    "Y10P",
                                          "Y12P", "YUYV", "UYVY", "convert"};

static void add_format(uint32_t fourcc)
{
    struct fake_format *format = &fake.format[fake.format_count++];

    *format = (struct fake_format){.fourcc = fourcc, .size = {{WIDTH, HEIGHT}}, .size_count = 1};
}

static void only_format(uint32_t fourcc)
{
    fake.format_count = 0;
    add_format(fourcc);
}

static struct fake_control *add_control(uint32_t id, const char *name, int32_t minimum,
                                        int32_t maximum, int64_t value)
{
    struct fake_control *control = &fake.control[fake.control_count++];

    *control = (struct fake_control){
        .id = id, .name = name, .minimum = minimum, .maximum = maximum, .step = 1, .value = value};
    return control;
}

static struct fake_frame *add_frame(uint32_t sequence)
{
    struct fake_frame *added = &fake.frame[fake.frame_count++];

    *added = (struct fake_frame){.sequence = sequence,
                                 .flags = MONOTONIC,
                                 .bytesused = FAKE_FULL,
                                 .second = 5,
                                 .microsecond = 250000 + 1000 * (long)sequence};
    return added;
}

void setUp(void)
{
    memset(&fake, 0, sizeof fake);
    memset(&v4l2, IH_TEST_FILL, sizeof v4l2);
    fake.fd = -1;
    fake.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    fake.field = V4L2_FIELD_NONE;
    fake.rate_flags = V4L2_CAP_TIMEPERFRAME;
    fake.frame_time = (struct v4l2_fract){1, 25};
    only_format(GREY);
    config = (struct hal_v4l2_config){
        .device = "/dev/video7", .format = "auto", .width = WIDTH, .height = HEIGHT};
    error.text[0] = 0;
}

static void check_closed(void)
{
    TEST_ASSERT_EQUAL_STRING("", fake.wrong);
    TEST_ASSERT_EQUAL_INT32(0, fake.open_count);
    TEST_ASSERT_EQUAL_INT32(0, fake.mapped_count);
    TEST_ASSERT_EQUAL_INT(-1, v4l2.fd);
}

void tearDown(void)
{
    if (v4l2.camera.context == &v4l2) {
        v4l2.camera.close(&v4l2);
        check_closed();
    }
}

static bool open_camera(void)
{
    if (v4l2.camera.context != &v4l2) {
        hal_v4l2_init(&v4l2, &config);
    }
    return v4l2.camera.open(&v4l2, &error);
}

static void start(void)
{
    if (!open_camera()) {
        TEST_FAIL_MESSAGE(error.text);
    }
    TEST_ASSERT_EQUAL_STRING("", fake.wrong);
}

/* Opening fails with this text, and leaves nothing. */
static void check_refused(const char *text)
{
    memset(&v4l2, IH_TEST_FILL, sizeof v4l2);
    TEST_ASSERT_FALSE(open_camera());
    TEST_ASSERT_EQUAL_STRING(text, error.text);
    check_closed();
}

static enum hal_next next(void)
{
    memset(&frame, IH_TEST_FILL, sizeof frame);
    error.text[0] = 0;
    return v4l2.camera.next(&v4l2, &frame, &error);
}

static void expect_frame(int64_t sequence)
{
    if (next() != HAL_NEXT_FRAME) {
        TEST_FAIL_MESSAGE(error.text);
    }
    TEST_ASSERT_EQUAL_INT64(sequence, frame.sequence);
}

static void release(void)
{
    v4l2.camera.release(&v4l2, &frame);
}

/* Opening, closing, what the device can do. */

static void it_opens_the_device_without_waiting_and_closes_it(void)
{
    start();
    TEST_ASSERT_EQUAL_STRING("/dev/video7", fake.opened);
    TEST_ASSERT_EQUAL_HEX(O_RDWR | O_NONBLOCK | O_CLOEXEC, fake.open_flags);
    TEST_ASSERT_EQUAL_INT(fake.fd, v4l2.fd);
    TEST_ASSERT_TRUE(fake.streaming);
    TEST_ASSERT_EQUAL_INT32(6, fake_queued_count());
    TEST_ASSERT_EQUAL_INT32(40000, v4l2.camera.frame_time_us(&v4l2));
    v4l2.camera.close(&v4l2);
    check_closed();
    v4l2.camera.close(&v4l2);
    check_closed();
    TEST_ASSERT_EQUAL_INT32(0, v4l2.camera.frame_time_us(&v4l2));
}

static void opened_again_it_starts_anew(void)
{
    add_frame(0);
    start();
    expect_frame(0);
    start(); /* open already, a frame held */
    TEST_ASSERT_EQUAL_INT32(6, fake_queued_count());
    TEST_ASSERT_EQUAL_INT32(6, fake.mapped_count);
    fake.buffers_given = 3; /* and then not at all: nothing of the first time is undone twice */
    TEST_ASSERT_FALSE(open_camera());
    check_closed();
}

static void closed_it_says_so(void)
{
    hal_v4l2_init(&v4l2, &config);
    TEST_ASSERT_EQUAL_INT(-1, v4l2.fd);
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_GONE, next());
    TEST_ASSERT_EQUAL_STRING("the camera is not open", error.text);
    TEST_ASSERT_FALSE(v4l2.camera.set_exposure(&v4l2, 1000, &error));
    TEST_ASSERT_EQUAL_STRING("exposure 1000 us: the camera is not open", error.text);
    TEST_ASSERT_EQUAL_INT32(0, fake.call_count);
}

static void a_device_that_cannot_be_opened(void)
{
    fake.fail_call = 1;
    fake.fail_reason = ENOENT;
    check_refused("opening: No such file or directory; expected a camera: v4l2-ctl --list-devices "
                  "shows what there is");
    fake.call_count = 0;
    fake.fail_reason = EACCES;
    check_refused("opening: Permission denied; is this user in the device's group, mostly video?");
    fake.call_count = 0;
    fake.fail_reason = EBUSY;
    check_refused("opening: Device or resource busy; another program has it");
}

static void a_device_that_is_no_camera(void)
{
    fake.capabilities = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
    check_refused("no camera that streams: capabilities 0x04000002, expected 0x04000001 among them "
                  "(a camera's further nodes give metadata only)");
    fake.capabilities = V4L2_CAP_STREAMING;
    check_refused("no camera that streams: capabilities 0x04000000, expected 0x04000001 among them "
                  "(a camera's further nodes give metadata only)");
    fake.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_READWRITE;
    check_refused("no camera that streams: capabilities 0x01000001, expected 0x04000001 among them "
                  "(a camera's further nodes give metadata only)");
}

/* The whole device can capture, this node of it cannot; and the other way round. */
static void the_node_counts_and_not_the_device(void)
{
    fake.capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_DEVICE_CAPS;
    fake.device_capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
    check_refused("no camera that streams: capabilities 0x04800000, expected 0x04000001 among them "
                  "(a camera's further nodes give metadata only)");
    fake.capabilities = V4L2_CAP_META_CAPTURE | V4L2_CAP_DEVICE_CAPS;
    fake.device_capabilities =
        V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING | V4L2_CAP_EXT_PIX_FORMAT;
    start();
}

/* Formats and sizes. */

/* With every subset of the formats, listed in any order, the first of the header's list is taken. */
static void auto_takes_the_best_format(void)
{
    struct ih_test_random random_source = {11};
    int32_t round;

    for (round = 0; round < 300; round++) {
        int32_t best = IH_TEST_COUNT(usable), k;
        int32_t chosen[4];

        setUp();
        fake.format_count = 0;
        add_format(V4L2_PIX_FMT_MJPEG);
        for (k = 0; k < 4; k++) {
            chosen[k] = (int32_t)ih_test_between(&random_source, 0, IH_TEST_COUNT(usable) - 1);
            add_format(usable[chosen[k]]);
            best = chosen[k] < best ? chosen[k] : best;
        }
        start();
        TEST_ASSERT_EQUAL_STRING(usable_name[best], v4l2.format.name);
        TEST_ASSERT_EQUAL_HEX32(usable[best], fake.current.pixelformat);
        tearDown();
    }
}

static void a_named_format_is_taken(void)
{
    int32_t k;

    for (k = 0; k < IH_TEST_COUNT(usable); k++) {
        setUp();
        add_format(usable[k]);
        config.format = usable_name[k];
        start();
        TEST_ASSERT_EQUAL_HEX32(usable[k], fake.current.pixelformat);
        tearDown();
    }
}

static void a_named_format_that_is_not_there(void)
{
    config.format = "Y10";
    add_format(V4L2_PIX_FMT_MJPEG);
    add_format(V4L2_PIX_FMT_SBGGR8);
    add_format(V4L2_PIX_FMT_Z16);
    add_format(V4L2_PIX_FMT_RGB24);
    fake.format[4].flags = V4L2_FMT_FLAG_EMULATED;
    add_format(V4L2_PIX_FMT_YUV420);
    fake.format[5].flags = V4L2_FMT_FLAG_EMULATED;
    check_refused(
        "no format Y10; the device has: GREY, convert; and, not usable here: MJPG, BA81, Z16");
}

static void no_format_that_is_of_use(void)
{
    only_format(V4L2_PIX_FMT_MJPEG);
    add_format(v4l2_fourcc('a', ' ', 1, 0xFF));
    check_refused("none of GREY, Y12, Y10, Y16, Y10P, Y12P, YUYV, UYVY, convert; the device has: "
                  "MJPG, a ??");
    fake.format_count = 0;
    check_refused("none of GREY, Y12, Y10, Y16, Y10P, Y12P, YUYV, UYVY, convert; the device has: "
                  "none");
    config.format = "Y16";
    check_refused("no format Y16; the device has: none; and, not usable here: none");
}

static void a_format_that_nobody_knows(void)
{
    config.format = "y10";
    check_refused("format is \"y10\", expected auto or one of GREY, Y12, Y10, Y16, Y10P, Y12P, "
                  "YUYV, UYVY, convert");
    config.format = "";
    check_refused("format is \"\", expected auto or one of GREY, Y12, Y10, Y16, Y10P, Y12P, YUYV, "
                  "UYVY, convert");
}

static void a_size_that_is_not_there(void)
{
    fake.format[0] = (struct fake_format){
        .fourcc = GREY, .size = {{640, 480}, {320, 240}, {WIDTH, HEIGHT + 1}}, .size_count = 3};
    check_refused("requested GREY 20x6, the device gives GREY 640x480; its sizes in GREY: 640x480, "
                  "320x240, 20x7");
    fake.format[0] = (struct fake_format){.fourcc = GREY,
                                          .size = {{64, 48}, {1280, 800}, {8, 2}},
                                          .size_count = 3,
                                          .is_stepwise = true};
    check_refused("requested GREY 20x6, the device gives GREY 64x48; its sizes in GREY: 64x48 to "
                  "1280x800 in steps of 8x2");
}

/* A list that is too long for a text ends in dots, and one without an end is left. */
static void long_lists_are_cut(void)
{
    fake.is_endless = true;
    fake.format[0].size[0].width = WIDTH + 1000;
    check_refused("requested GREY 20x6, the device gives GREY 1020x6; its sizes in GREY: 1020x6, "
                  "1020x6, 1020x6, 1020x6, 1020x6, 1020x6, 1020x6, 1020x6, 1020x6, 1020x6, 1020x6, "
                  "1020x6, ...");
    only_format(V4L2_PIX_FMT_MJPEG);
    fake.call_count = 0;
    check_refused("none of GREY, Y12, Y10, Y16, Y10P, Y12P, YUYV, UYVY, convert; the device has: "
                  "MJPG, MJPG, MJPG, MJPG, MJPG, MJPG, MJPG, MJPG, MJPG, MJPG, MJPG, MJPG, MJPG, "
                  "MJPG, MJPG, MJPG, ...");
    TEST_ASSERT_EQUAL_INT32(1 + 1 + 64 + 1, fake.call_count);
}

/* Formats may have sizes of their own: the best of those that have the rig's size is taken. */
static void auto_goes_on_to_a_format_of_the_right_size(void)
{
    fake.format[0].size[0].width = 8;
    add_format(V4L2_PIX_FMT_YUYV);
    add_format(V4L2_PIX_FMT_Y10);
    fake.format[2].size[0].height = 8;
    start();
    TEST_ASSERT_EQUAL_STRING("YUYV", v4l2.format.name);
    tearDown();
    fake.format[1].size[0].width = 8;
    check_refused("requested GREY 20x6, the device gives GREY 8x6; its sizes in GREY: 8x6");
}

static void a_device_that_does_as_it_likes(void)
{
    fake.other_fourcc = V4L2_PIX_FMT_YUYV;
    check_refused("requested GREY 20x6, the device gives YUYV 20x6; its sizes in GREY: 20x6");
}

static void sizes_that_make_no_sense(void)
{
    config.width = 0;
    check_refused("requested frames of 0x6, expected 1..16384 each");
    config.width = WIDTH;
    config.height = 16385;
    check_refused("requested frames of 20x16385, expected 1..16384 each");
    config.width = 16385;
    config.height = HEIGHT;
    check_refused("requested frames of 16385x6, expected 1..16384 each");
}

static void interlaced_frames_are_refused(void)
{
    fake.field = V4L2_FIELD_INTERLACED;
    check_refused("GREY 20x6 is interlaced (field 4), expected whole frames");
}

static void rows_that_are_too_short(void)
{
    fake.stride = WIDTH - 1;
    check_refused("GREY 20x6 has rows of 19 bytes, expected at least 20");
    only_format(V4L2_PIX_FMT_Y10P);
    fake.stride = 24;
    check_refused("Y10P 20x6 has rows of 24 bytes, expected at least 25");
    only_format(V4L2_PIX_FMT_Y10);
    fake.stride = 2 * WIDTH + 1;
    check_refused("Y10 20x6 has rows of 41 bytes, expected an even number");
    fake.stride = 0x80000000u;
    check_refused("Y10 20x6 has rows of 2147483648 bytes, expected at least 40");
}

static void buffers_that_are_too_small_or_too_few(void)
{
    fake.bytes_short = 1;
    check_refused("buffers of 119 bytes, expected at least 120 for GREY 20x6");
    fake.bytes_short = 0;
    fake.buffers_given = 3;
    check_refused("the device gives 3 buffers, expected at least 4");
    fake.buffers_given = 4;
    start();
    TEST_ASSERT_EQUAL_INT32(4, fake_queued_count());
    tearDown();
    setUp();
    fake.buffers_given = 40; /* more than are used */
    start();
    TEST_ASSERT_EQUAL_INT32(32, fake_queued_count());
}

/* Rate. */

static void the_rate_is_asked_for_only_when_it_is_wanted(void)
{
    fake.only_time = (struct v4l2_fract){1, 99};
    start();
    TEST_ASSERT_EQUAL_INT32(40000, v4l2.camera.frame_time_us(&v4l2));
    tearDown();
    setUp();
    config.rate_mhz = 30000;
    start();
    TEST_ASSERT_EQUAL_UINT32(30000, fake.frame_time.denominator);
    TEST_ASSERT_EQUAL_UINT32(1000, fake.frame_time.numerator);
    TEST_ASSERT_EQUAL_INT32(33333, v4l2.camera.frame_time_us(&v4l2));
}

static void a_rate_nearby_is_taken_another_is_not(void)
{
    config.rate_mhz = 30000;
    fake.only_time = (struct v4l2_fract){1001, 30000};
    start();
    TEST_ASSERT_EQUAL_INT32(33366, v4l2.camera.frame_time_us(&v4l2));
    tearDown();
    fake.only_time = (struct v4l2_fract){10, 302};
    start();
    TEST_ASSERT_EQUAL_INT32(33112, v4l2.camera.frame_time_us(&v4l2));
    tearDown();
    setUp();
    config.rate_mhz = 30000;
    fake.only_time = (struct v4l2_fract){2, 15};
    check_refused("requested 30.000 frames a second, the device gives 7.500");
    fake.only_time = (struct v4l2_fract){100, 3030};
    check_refused("requested 30.000 frames a second, the device gives 30.300");
    fake.only_time = (struct v4l2_fract){0, 1};
    check_refused("requested 30.000 frames a second, the device gives 0.000");
}

static void a_refused_rate_names_those_that_there_are(void)
{
    config.rate_mhz = 27000;
    fake.only_time = (struct v4l2_fract){1, 25};
    fake.times[0] = (struct v4l2_fract){2, 25};
    fake.times[1] = (struct v4l2_fract){1, 25};
    fake.times[2] = (struct v4l2_fract){1001, 30000};
    fake.time_count = 3;
    check_refused("requested 27.000 frames a second, the device gives 25.000; it has: 12.500, "
                  "25.000, 29.970");
    fake.times_are_stepwise = true;
    check_refused("requested 27.000 frames a second, the device gives 25.000; it has: 25.000 to "
                  "12.500");
}

static void a_device_without_a_rate(void)
{
    fake.no_parameters = EINVAL;
    start();
    TEST_ASSERT_EQUAL_INT32(0, v4l2.camera.frame_time_us(&v4l2));
    tearDown();
    fake.no_parameters = ENOTTY;
    start();
    TEST_ASSERT_EQUAL_INT32(0, v4l2.camera.frame_time_us(&v4l2));
    tearDown();
    config.rate_mhz = 12500;
    check_refused("requested 12.500 frames a second, the device's rate is fixed");
    fake.no_parameters = EIO;
    check_refused("querying its frame rate: Input/output error");
    fake.no_parameters = 0;
    fake.rate_flags = 0;
    check_refused("requested 12.500 frames a second, the device's rate is fixed");
    config.rate_mhz = -1;
    check_refused("requested -1 frames in 1000 s, expected 0 or more");
    config.rate_mhz = 0;
    fake.frame_time = (struct v4l2_fract){4000000000u, 0};
    hal_v4l2_init(&v4l2, &config);
    start();
    TEST_ASSERT_EQUAL_INT32(0, v4l2.camera.frame_time_us(&v4l2));
    tearDown();
    /* Not "does not say": the program has to refuse it. */
    fake.frame_time = (struct v4l2_fract){4000000000u, 1};
    start();
    TEST_ASSERT_EQUAL_INT32(INT32_MAX, v4l2.camera.frame_time_us(&v4l2));
    tearDown();
    fake.frame_time = (struct v4l2_fract){1, 4000000000u};
    start();
    TEST_ASSERT_EQUAL_INT32(1, v4l2.camera.frame_time_us(&v4l2));
}

/* Exposure and gain. */

static void want_exposure(enum hal_v4l2_mode mode, int32_t value)
{
    config.exposure = (struct hal_v4l2_setting){mode, value};
}

static void want_gain(enum hal_v4l2_mode mode, int32_t value)
{
    config.gain = (struct hal_v4l2_setting){mode, value};
}

static struct fake_control *add_exposure(void)
{
    add_control(V4L2_CID_EXPOSURE_AUTO, "Auto Exposure", 0, 3, V4L2_EXPOSURE_APERTURE_PRIORITY);
    return add_control(V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute", 3, 2047, 157);
}

static void what_is_to_be_kept_is_not_touched(void)
{
    add_exposure();
    add_control(V4L2_CID_GAIN, "Gain", 0, 100, 55);
    fake.control[0].refuse = fake.control[1].refuse = fake.control[2].refuse = EACCES;
    start();
    TEST_ASSERT_EQUAL_INT64(157, fake.control[1].value);
}

static void exposure_is_set_in_its_units_after_the_automatic_is_off(void)
{
    add_exposure();
    want_exposure(HAL_V4L2_VALUE, 4000);
    start();
    TEST_ASSERT_EQUAL_INT64(V4L2_EXPOSURE_MANUAL, fake.control[0].value);
    TEST_ASSERT_EQUAL_INT64(40, fake.control[1].value);
    TEST_ASSERT_TRUE(v4l2.camera.set_exposure(&v4l2, 349, &error));
    TEST_ASSERT_EQUAL_INT64(3, fake.control[1].value);
    TEST_ASSERT_TRUE(v4l2.camera.set_exposure(&v4l2, 350, &error));
    TEST_ASSERT_EQUAL_INT64(4, fake.control[1].value);
    TEST_ASSERT_TRUE(v4l2.camera.set_exposure(&v4l2, 204700, &error));
    TEST_ASSERT_EQUAL_INT64(2047, fake.control[1].value);
    TEST_ASSERT_FALSE(v4l2.camera.set_exposure(&v4l2, 204800, &error));
    TEST_ASSERT_EQUAL_STRING("exposure 204800 us: Exposure Time, Absolute would be 2048 (of 100000 "
                             "ns), expected 3..2047",
                             error.text);
    TEST_ASSERT_FALSE(v4l2.camera.set_exposure(&v4l2, -5000000, &error));
    TEST_ASSERT_EQUAL_INT64(2047, fake.control[1].value);
}

/* Kept on opening, then set: the automatic is switched off then. */
static void the_first_exposure_may_come_later(void)
{
    add_exposure();
    start();
    TEST_ASSERT_EQUAL_INT64(V4L2_EXPOSURE_APERTURE_PRIORITY, fake.control[0].value);
    TEST_ASSERT_TRUE(v4l2.camera.set_exposure(&v4l2, 1000, &error));
    TEST_ASSERT_EQUAL_INT64(V4L2_EXPOSURE_MANUAL, fake.control[0].value);
    TEST_ASSERT_EQUAL_INT64(10, fake.control[1].value);
}

/* What was there on opening need not stay, as with a device that is unplugged. */
static void exposure_of_a_device_that_changes(void)
{
    add_exposure();
    want_exposure(HAL_V4L2_VALUE, 1000);
    start();
    fake.control[1].flags = V4L2_CTRL_FLAG_DISABLED;
    TEST_ASSERT_FALSE(v4l2.camera.set_exposure(&v4l2, 1000, &error));
    TEST_ASSERT_EQUAL_STRING("exposure 1000 us: the device's control of exposure is gone",
                             error.text);
    fake.unplugged = true;
    TEST_ASSERT_FALSE(v4l2.camera.set_exposure(&v4l2, 1000, &error));
    TEST_ASSERT_EQUAL_STRING("querying control 0x009a0902: No such device", error.text);
}

/* Devices have one of two ways to be automatic, and to be manual. */
static void the_other_automatic_and_the_other_manual(void)
{
    add_exposure();
    fake.control[0].has_refused = true;
    fake.control[0].refused = V4L2_EXPOSURE_AUTO;
    want_exposure(HAL_V4L2_AUTO, 0);
    start();
    TEST_ASSERT_EQUAL_INT64(V4L2_EXPOSURE_APERTURE_PRIORITY, fake.control[0].value);
    tearDown();
    fake.control[0].refused = V4L2_EXPOSURE_MANUAL;
    setUp();
    add_exposure();
    fake.control[0].has_refused = true;
    fake.control[0].refused = V4L2_EXPOSURE_MANUAL;
    want_exposure(HAL_V4L2_VALUE, 1000);
    start();
    TEST_ASSERT_EQUAL_INT64(V4L2_EXPOSURE_SHUTTER_PRIORITY, fake.control[0].value);
}

static void exposure_that_cannot_be_set(void)
{
    struct fake_control *time = add_exposure();

    want_exposure(HAL_V4L2_VALUE, 200);
    check_refused("exposure 200 us: Exposure Time, Absolute would be 2 (of 100000 ns), expected "
                  "3..2047");
    want_exposure(HAL_V4L2_VALUE, 5000);
    time->refuse = EACCES;
    check_refused("exposure 5000 us: setting Exposure Time, Absolute to 50 (of 100000 ns): "
                  "Permission denied");
    time->refuse = 0;
    time->is_stubborn = true;
    check_refused("exposure 5000 us: Exposure Time, Absolute set to 50 (of 100000 ns), the device "
                  "says 157");
    fake.control[0].is_stubborn = true;
    fake.control[0].value = V4L2_EXPOSURE_APERTURE_PRIORITY;
    check_refused("exposure 5000 us: Auto Exposure set to 1, the device says 3");
    fake.control[0].is_stubborn = false;
    time->flags = V4L2_CTRL_FLAG_DISABLED;
    check_refused("exposure 5000 us: the device has no control of exposure");
    fake.control_count = 0;
    check_refused("exposure 5000 us: the device has no control of exposure");
    want_exposure(HAL_V4L2_AUTO, 0);
    check_refused("exposure auto: the device has no automatic exposure");
}

/* A step of the device is no disobedience, more is. */
static void steps_are_allowed(void)
{
    struct fake_control *time = add_exposure();

    time->step = 5; /* 3, 8, 13, ..., 53 */
    want_exposure(HAL_V4L2_VALUE, 5700);
    start();
    TEST_ASSERT_EQUAL_INT64(53, time->value);
    tearDown();
    time->is_stubborn = true;
    time->value = 61;
    start();
    tearDown();
    time->value = 62;
    check_refused("exposure 5700 us: Exposure Time, Absolute set to 57 (of 100000 ns), the device "
                  "says 62");
    time->step = 0; /* does not say: 1 */
    time->value = 58;
    check_refused("exposure 5700 us: Exposure Time, Absolute set to 57 (of 100000 ns), the device "
                  "says 58");
    time->step = 5;
    time->value = 52;
    check_refused("exposure 5700 us: Exposure Time, Absolute set to 57 (of 100000 ns), the device "
                  "says 52");
}

/* A sensor that counts rows: 1280 + 720 pixels at 100 MHz are 20 us a row. */
static void exposure_in_rows(void)
{
    struct fake_control *rows = add_control(V4L2_CID_EXPOSURE, "Exposure", 4, 1000, 100);

    want_exposure(HAL_V4L2_VALUE, 5000);
    check_refused(
        "exposure 5000 us: the device counts exposure in rows and does not report how long "
        "a row takes (controls pixel rate and horizontal blanking)");
    add_control(V4L2_CID_HBLANK, "Horizontal Blanking", 0, 9999, 2000 - WIDTH);
    check_refused(
        "exposure 5000 us: the device counts exposure in rows and does not report how long "
        "a row takes (controls pixel rate and horizontal blanking)");
    add_control(V4L2_CID_PIXEL_RATE, "Pixel Rate", 0, 0, 100000000);
    fake.control[1].id = V4L2_CID_VBLANK; /* the other one is not there */
    check_refused(
        "exposure 5000 us: the device counts exposure in rows and does not report how long "
        "a row takes (controls pixel rate and horizontal blanking)");
    fake.control[1].id = V4L2_CID_HBLANK;
    start();
    TEST_ASSERT_EQUAL_INT64(250, rows->value);
    TEST_ASSERT_TRUE(v4l2.camera.set_exposure(&v4l2, 1009, &error));
    TEST_ASSERT_EQUAL_INT64(50, rows->value);
    TEST_ASSERT_FALSE(v4l2.camera.set_exposure(&v4l2, 20011, &error));
    TEST_ASSERT_EQUAL_STRING("exposure 20011 us: Exposure would be 1001 (of 20000 ns), expected "
                             "4..1000",
                             error.text);
}

static void gain_by_any_of_its_controls(void)
{
    add_control(V4L2_CID_ANALOGUE_GAIN, "Analogue Gain", 16, 255, 16);
    want_gain(HAL_V4L2_VALUE, 40);
    start();
    TEST_ASSERT_EQUAL_INT64(40, fake.control[0].value);
    tearDown();
    add_control(V4L2_CID_GAIN, "Gain", 0, 100, 1);
    add_control(V4L2_CID_AUTOGAIN, "Gain, Automatic", 0, 1, 1);
    want_gain(HAL_V4L2_VALUE, 50);
    hal_v4l2_init(&v4l2, &config);
    start();
    TEST_ASSERT_EQUAL_INT64(40, fake.control[0].value);
    TEST_ASSERT_EQUAL_INT64(50, fake.control[1].value);
    TEST_ASSERT_EQUAL_INT64(0, fake.control[2].value);
    tearDown();
    want_gain(HAL_V4L2_AUTO, 0);
    hal_v4l2_init(&v4l2, &config);
    start();
    TEST_ASSERT_EQUAL_INT64(1, fake.control[2].value);
    TEST_ASSERT_EQUAL_INT64(50, fake.control[1].value);
}

static void gain_that_cannot_be_set(void)
{
    want_gain(HAL_V4L2_VALUE, 500);
    check_refused("gain 500: the device has no control of gain");
    add_control(V4L2_CID_GAIN, "Gain", 0, 100, 1);
    check_refused("gain 500: Gain would be 500, expected 0..100");
    want_gain(HAL_V4L2_AUTO, 0);
    check_refused("gain auto: the device has no automatic gain");
    add_control(V4L2_CID_AUTOGAIN, "Gain, Automatic", 0, 1, 1)->refuse = EBUSY;
    want_gain(HAL_V4L2_VALUE, 50);
    check_refused("gain 50: setting Gain, Automatic to 0: Device or resource busy");
}

/* Frames. */

static void a_grey_frame_is_a_view(void)
{
    fake.padding = 12;
    add_frame(41);
    start();
    expect_frame(41);
    TEST_ASSERT_EQUAL_PTR(fake.buffer[0], frame.samples);
    TEST_ASSERT_EQUAL_INT32(WIDTH, frame.width);
    TEST_ASSERT_EQUAL_INT32(HEIGHT, frame.height);
    TEST_ASSERT_EQUAL_INT32(WIDTH + 12, frame.stride_bytes);
    TEST_ASSERT_EQUAL_INT32(1, frame.bytes_per_sample);
    TEST_ASSERT_EQUAL_INT32(255, frame.maximum);
    TEST_ASSERT_NULL(frame.point_mm_q8);
    TEST_ASSERT_EQUAL_INT32(0, frame.point_count);
    TEST_ASSERT_EQUAL_INT64(5291000, frame.time_us);
    TEST_ASSERT_TRUE(frame.laser);
    TEST_ASSERT_EQUAL_STRING("000041.pgm", frame.name);
    TEST_ASSERT_EQUAL_INT32(5, fake_queued_count());
    release();
    TEST_ASSERT_EQUAL_INT32(6, fake_queued_count());
    release(); /* again: nothing */
    TEST_ASSERT_EQUAL_STRING("", fake.wrong);
}

static void a_device_that_does_not_tell_its_stride(void)
{
    fake.no_stride = true;
    add_frame(0);
    start();
    expect_frame(0);
    TEST_ASSERT_EQUAL_INT32(WIDTH, frame.stride_bytes);
}

/* Two bytes are a view on this machine where it is little-endian. In all formats sample (x, y) of
 * the frame is what was laid out, and full scale is the format's. */
static void every_format_hands_on_its_samples(void)
{
    const int32_t maximum[] = {255, 4095, 1023, 65535, 1023, 4095, 235, 235, 235};
    const int32_t sample_bytes[] = {1, 2, 2, 2, 2, 2, 1, 1, 1};
    int32_t kind, x, y;

    for (kind = 0; kind < IH_TEST_COUNT(usable); kind++) {
        setUp();
        only_format(usable[kind]);
        fake.padding = 6;
        add_frame(0);
        start();
        for (x = 0; x < (int32_t)fake.buffer_bytes; x++) {
            fake.buffer[0][x] = (uint8_t)(x * 7 + x / 256);
        }
        expect_frame(0);
        TEST_ASSERT_EQUAL_INT32(maximum[kind], frame.maximum);
        TEST_ASSERT_EQUAL_INT32(sample_bytes[kind], frame.bytes_per_sample);
        for (y = 0; y < HEIGHT; y++) {
            const uint8_t *row = (const uint8_t *)frame.samples + y * frame.stride_bytes;
            const uint8_t *raw = fake.buffer[0] + (uint32_t)y * fake.current.bytesperline;

            for (x = 0; x < WIDTH; x++) {
                const int32_t got =
                    frame.bytes_per_sample == 1 ? row[x] : ((const uint16_t *)(const void *)row)[x];
                int32_t want = raw[x];

                if (usable[kind] == V4L2_PIX_FMT_Y10P) {
                    want = raw[x / 4 * 5 + x % 4] * 4 + (raw[x / 4 * 5 + 4] >> x % 4 * 2) % 4;
                } else if (usable[kind] == Y12P) {
                    want = raw[x / 2 * 3 + x % 2] * 16 + (raw[x / 2 * 3 + 2] >> x % 2 * 4) % 16;
                } else if (usable[kind] == V4L2_PIX_FMT_YUYV) {
                    want = raw[2 * x];
                } else if (usable[kind] == V4L2_PIX_FMT_UYVY) {
                    want = raw[2 * x + 1];
                } else if (sample_bytes[kind] == 2) {
                    want = raw[2 * x] + 256 * raw[2 * x + 1];
                }
                IH_TEST_EQUAL(want, got, usable_name[kind], y * WIDTH + x);
            }
        }
        tearDown();
    }
}

/* A decoded frame's buffer goes back at once, and its image is its own while it is held. */
static void decoded_frames_do_not_share_images(void)
{
    struct hal_frame held[3];
    int32_t k;

    only_format(V4L2_PIX_FMT_YUYV);
    for (k = 0; k < 5; k++) {
        add_frame((uint32_t)k);
    }
    start();
    for (k = 0; k < 3; k++) {
        memset(fake.buffer[0], 10 + k, fake.buffer_bytes);
        expect_frame(k);
        held[k] = frame;
        TEST_ASSERT_EQUAL_INT32(6, fake_queued_count());
        TEST_ASSERT_EQUAL_INT32(WIDTH, frame.stride_bytes);
    }
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_NONE, next());
    for (k = 0; k < 3; k++) {
        TEST_ASSERT_EACH_EQUAL_UINT8(10 + k, held[k].samples, WIDTH * HEIGHT);
        TEST_ASSERT_EQUAL_INT64(k, atoi(held[k].name));
    }
    v4l2.camera.release(&v4l2, &held[1]);
    memset(fake.buffer[0], 99, fake.buffer_bytes);
    expect_frame(3);
    TEST_ASSERT_EQUAL_PTR(held[1].samples, frame.samples);
    TEST_ASSERT_EACH_EQUAL_UINT8(10, held[0].samples, WIDTH * HEIGHT);
    TEST_ASSERT_EACH_EQUAL_UINT8(12, held[2].samples, WIDTH * HEIGHT);
    TEST_ASSERT_EACH_EQUAL_UINT8(99, frame.samples, WIDTH * HEIGHT);
    TEST_ASSERT_EQUAL_STRING("000000.pgm", held[0].name);
    TEST_ASSERT_EQUAL_STRING("000003.pgm", frame.name);
}

/* As many as may be held and one more; then nothing, until one is released. Any order. */
static void views_are_held_and_released_in_any_order(void)
{
    struct hal_frame held[3];
    int32_t k;

    for (k = 0; k < 5; k++) {
        add_frame((uint32_t)k);
    }
    start();
    for (k = 0; k < 3; k++) {
        expect_frame(k);
        held[k] = frame;
    }
    TEST_ASSERT_EQUAL_INT32(3, fake_queued_count());
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_NONE, next());
    v4l2.camera.release(&v4l2, &held[2]);
    v4l2.camera.release(&v4l2, &held[0]);
    TEST_ASSERT_EQUAL_INT32(5, fake_queued_count());
    TEST_ASSERT_FALSE(fake.queued[1]);
    TEST_ASSERT_EQUAL_STRING("000001.pgm", held[1].name);
    expect_frame(3);
    TEST_ASSERT_EQUAL_STRING("000001.pgm", held[1].name);
    TEST_ASSERT_NOT_EQUAL(held[1].samples, frame.samples);
}

static void full_range_luma_is_taken_at_its_word(void)
{
    only_format(V4L2_PIX_FMT_YUYV);
    fake.quantization = V4L2_QUANTIZATION_FULL_RANGE;
    start();
    TEST_ASSERT_EQUAL_INT32(255, v4l2.format.maximum);
    tearDown();
    fake.quantization = V4L2_QUANTIZATION_DEFAULT;
    fake.colorspace = V4L2_COLORSPACE_JPEG;
    start();
    TEST_ASSERT_EQUAL_INT32(255, v4l2.format.maximum);
    tearDown();
    setUp();
    fake.quantization = V4L2_QUANTIZATION_LIM_RANGE; /* of grey: no such thing */
    start();
    TEST_ASSERT_EQUAL_INT32(255, v4l2.format.maximum);
}

/* Numbers and times. */

static void sequence_goes_beyond_32_bits(void)
{
    const uint32_t numbers[] = {0xFFFFFFFE, 0xFFFFFFFF, 0, 1, 5};
    const int64_t wanted[] = {4294967294, 4294967295, 4294967296, 4294967297, 4294967301};
    int32_t k;

    for (k = 0; k < IH_TEST_COUNT(numbers); k++) {
        add_frame(numbers[k])->microsecond = 0;
    }
    start();
    for (k = 0; k < IH_TEST_COUNT(numbers); k++) {
        expect_frame(wanted[k]);
        release();
    }
    TEST_ASSERT_EQUAL_STRING("4294967301.pgm", frame.name);
}

static void gaps_are_seen(void)
{
    add_frame(3);
    add_frame(4);
    add_frame(9);
    add_frame(9 + (uint32_t)INT32_MAX);
    start();
    expect_frame(3);
    release();
    expect_frame(4);
    release();
    expect_frame(9);
    release();
    expect_frame(9 + (int64_t)INT32_MAX);
}

static void a_driver_that_does_not_count_is_counted_for(void)
{
    int32_t k;

    for (k = 0; k < 9; k++) {
        add_frame(0);
    }
    start();
    for (k = 0; k < 9; k++) {
        expect_frame(k);
        release();
    }
}

/* A device that was away counts from 0 again, or goes on: the numbers rise in both cases. */
static void numbers_go_on_when_opened_again(void)
{
    const uint32_t numbers[] = {100, 101, 0, 1, 2};
    const int64_t wanted[] = {100, 101, 102, 103, 104};
    int32_t k;

    for (k = 0; k < IH_TEST_COUNT(numbers); k++) {
        add_frame(numbers[k]);
    }
    start();
    for (k = 0; k < IH_TEST_COUNT(numbers); k++) {
        if (k == 2) {
            v4l2.camera.close(&v4l2);
            start();
        }
        expect_frame(wanted[k]);
        release();
    }
    v4l2.camera.close(&v4l2);
    add_frame(12);
    start();
    expect_frame(114);
}

static int64_t monotonic_us(void)
{
    struct timespec now;

    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

static void times_of_three_kinds(void)
{
    int64_t before;

    add_frame(0);
    add_frame(1)->flags = V4L2_BUF_FLAG_TIMESTAMP_COPY | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
    add_frame(2)->flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
    add_frame(3)->second = 9000000000; /* beyond 32 bits of seconds, and of us */
    start();
    expect_frame(0);
    TEST_ASSERT_EQUAL_INT64(5250000, frame.time_us);
    release();
    expect_frame(1);
    TEST_ASSERT_EQUAL_INT64(5251000, frame.time_us);
    release();
    before = monotonic_us();
    expect_frame(2);
    IH_TEST_RANGE(before, monotonic_us(), frame.time_us, "time", 2);
    release();
    expect_frame(3);
    TEST_ASSERT_EQUAL_INT64(9000000000253000, frame.time_us);
}

/* What goes wrong with frames. */

/* Only name, time, number and laser are filled in, and the driver has its buffer back. */
static void check_bad(int64_t sequence, int64_t time_us, const char *text)
{
    char name[32];

    TEST_ASSERT_EQUAL_INT(HAL_NEXT_BAD, next());
    TEST_ASSERT_EQUAL_STRING(text, error.text);
    TEST_ASSERT_EQUAL_INT64(sequence, frame.sequence);
    if (time_us >= 0) {
        TEST_ASSERT_EQUAL_INT64(time_us, frame.time_us);
    }
    snprintf(name, sizeof name, "%06" PRId64 ".pgm", sequence);
    TEST_ASSERT_EQUAL_STRING(name, frame.name);
    TEST_ASSERT_TRUE(frame.laser);
    TEST_ASSERT_NULL(frame.samples);
    TEST_ASSERT_EQUAL_INT32(0, frame.width);
    TEST_ASSERT_EQUAL_INT32(6, fake_queued_count());
}

static void check_gone(const char *text)
{
    int32_t k, calls;

    TEST_ASSERT_EQUAL_INT(HAL_NEXT_GONE, next());
    TEST_ASSERT_EQUAL_STRING(text, error.text);
    calls = fake.call_count;
    for (k = 0; k < 3; k++) { /* and stays so, without asking the device */
        TEST_ASSERT_EQUAL_INT(HAL_NEXT_GONE, next());
        TEST_ASSERT_EQUAL_STRING(text, error.text);
    }
    TEST_ASSERT_EQUAL_INT32(calls, fake.call_count);
}

/* No ioctl is made when nothing is there: libv4l2 would write a line to standard error. */
static void nothing_there_is_no_frame(void)
{
    int32_t calls;

    start();
    calls = fake.call_count;
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_NONE, next());
    TEST_ASSERT_EQUAL_INT32(calls, fake.call_count);
    fake_set_ready(true); /* and when there is nothing after all */
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_NONE, next());
    TEST_ASSERT_EQUAL_INT32(calls + 1, fake.call_count);
}

static void a_damaged_frame_is_bad(void)
{
    add_frame(7);
    add_frame(8)->flags = MONOTONIC | V4L2_BUF_FLAG_ERROR;
    fake.frame[1].bytesused = 17;
    add_frame(9);
    start();
    expect_frame(7);
    release();
    check_bad(8, 5258000, "the driver marks the frame as damaged (17 of 120 bytes)");
    expect_frame(9);
}

static void a_short_frame_is_bad(void)
{
    fake.padding = 4; /* the last row's may be missing */
    add_frame(0)->bytesused = (WIDTH + 4) * HEIGHT - 4;
    add_frame(1)->bytesused = (WIDTH + 4) * HEIGHT - 5;
    add_frame(2)->bytesused = 0;
    start();
    expect_frame(0);
    release();
    check_bad(1, 5251000, "139 bytes, expected 140 for GREY 20x6");
    check_bad(2, 5252000, "0 bytes, expected 140 for GREY 20x6");
}

static void add_failures(int reason, int32_t count)
{
    int32_t k;

    for (k = 0; k < count; k++) {
        add_frame(0)->reason = reason;
    }
}

/* A frame that was lost so has a number of its own, and the numbers rise by one over it, whether the
 * driver counted it (5) or not (6 after it). */
static void eio_is_a_lost_frame(void)
{
    add_frame(3);
    add_failures(EIO, 1);
    add_frame(5);
    add_failures(EIO, 1);
    add_frame(6);
    start();
    expect_frame(3);
    release();
    check_bad(4, -1, "taking a frame: Input/output error");
    expect_frame(5);
    release();
    check_bad(6, -1, "taking a frame: Input/output error");
    expect_frame(7);
}

static void eio_too_often_is_a_broken_device(void)
{
    int32_t k;

    add_failures(EIO, 7);
    add_frame(20);
    add_failures(EIO, 8);
    start();
    for (k = 0; k < 7; k++) {
        check_bad(k, -1, "taking a frame: Input/output error");
    }
    expect_frame(20);
    release();
    for (k = 0; k < 7; k++) {
        check_bad(21 + k, -1, "taking a frame: Input/output error");
    }
    check_gone("taking a frame: Input/output error, 8 times in a row");
    v4l2.camera.close(&v4l2); /* opened again, all is forgiven */
    add_failures(EIO, 7);
    start();
    for (k = 0; k < 7; k++) {
        check_bad(28 + k, -1, "taking a frame: Input/output error");
    }
}

static void other_errors_are_the_end(void)
{
    const int reasons[] = {ENODEV, ENXIO, EPIPE, EINVAL, EBADF, ENOMEM};
    const char *const texts[] = {
        "taking a frame: No such device",      "taking a frame: No such device or address",
        "taking a frame: Broken pipe",         "taking a frame: Invalid argument",
        "taking a frame: Bad file descriptor", "taking a frame: Cannot allocate memory"};
    int32_t k;

    for (k = 0; k < IH_TEST_COUNT(reasons); k++) {
        setUp();
        add_frame(0);
        add_failures(reasons[k], 1);
        add_frame(1);
        start();
        expect_frame(0);
        check_gone(texts[k]);
        release();
        tearDown();
    }
}

static void signals_do_no_harm(void)
{
    add_failures(EINTR, 5);
    add_frame(6);
    start();
    expect_frame(6);
}

static void a_buffer_that_does_not_exist(void)
{
    add_frame(0)->bad_index = true;
    start();
    check_gone("the device returned buffer 6 of 6");
}

static void unplugged_and_back(void)
{
    add_frame(0);
    add_frame(1);
    add_frame(2);
    start();
    expect_frame(0);
    fake.unplugged = true;
    release();
    check_gone("returning buffer 0: No such device");
    v4l2.camera.close(&v4l2);
    check_closed();
    TEST_ASSERT_FALSE(open_camera());
    TEST_ASSERT_EQUAL_STRING("querying its capabilities: No such device", error.text);
    check_closed();
    fake.unplugged = false;
    start();
    expect_frame(1);
}

/* A buffer that cannot be given back is reported by the next call, whatever it was that gave it back. */
static void a_buffer_that_cannot_be_given_back(void)
{
    add_frame(0)->bytesused = 1;
    add_frame(1);
    start();
    fake.fail_call = fake.call_count + 2;
    fake.fail_reason = ENODEV;
    TEST_ASSERT_EQUAL_INT(HAL_NEXT_BAD, next());
    check_gone("returning buffer 0: No such device");
    tearDown();
    setUp();
    only_format(V4L2_PIX_FMT_UYVY);
    add_frame(0);
    add_frame(1);
    start();
    fake.fail_call = fake.call_count + 2;
    fake.fail_reason = EIO;
    expect_frame(0);
    check_gone("returning buffer 0: Input/output error");
    release();
}

/* A frame from before closing, or none at all, is released without harm. */
static void releases_that_come_too_late(void)
{
    add_frame(0);
    start();
    expect_frame(0);
    v4l2.camera.close(&v4l2);
    release();
    start();
    release();
    frame.buffer_index = 3;
    release();
    frame.buffer_index = -1;
    release();
    TEST_ASSERT_EQUAL_INT32(6, fake_queued_count());
}

/* Every call fails once. */

static const int reasons[] = {EIO, ENODEV, EINVAL, ENOTTY, EBUSY, ENOMEM, EACCES, EINTR, EAGAIN};

static void prepare(int32_t kind)
{
    setUp();
    if (kind == 1) { /* everything is to be set */
        only_format(V4L2_PIX_FMT_Y10P);
        add_exposure();
        add_control(V4L2_CID_GAIN, "Gain", 0, 100, 1);
        add_control(V4L2_CID_AUTOGAIN, "Gain, Automatic", 0, 1, 1);
        want_exposure(HAL_V4L2_VALUE, 1000);
        want_gain(HAL_V4L2_VALUE, 50);
        config.rate_mhz = 50000;
    } else if (kind == 2) { /* a sensor that counts rows; the other automatic gain */
        only_format(V4L2_PIX_FMT_YUYV);
        add_control(V4L2_CID_EXPOSURE, "Exposure", 4, 1000, 100);
        add_control(V4L2_CID_HBLANK, "Horizontal Blanking", 0, 9999, 2000 - WIDTH);
        add_control(V4L2_CID_PIXEL_RATE, "Pixel Rate", 0, 0, 100000000);
        add_control(V4L2_CID_ANALOGUE_GAIN, "Analogue Gain", 16, 255, 16);
        want_exposure(HAL_V4L2_VALUE, 5000);
        want_gain(HAL_V4L2_VALUE, 50);
    } else if (kind == 3) { /* automatic; the first format has another size */
        fake.format[0].size[0].width = 8;
        add_format(V4L2_PIX_FMT_UYVY);
        add_exposure();
        add_control(V4L2_CID_AUTOGAIN, "Gain, Automatic", 0, 1, 0);
        want_exposure(HAL_V4L2_AUTO, 0);
        want_gain(HAL_V4L2_AUTO, 0);
    } else if (kind == 4) { /* refused in the end */
        fake.format[0].size[0].width = 8;
    }
}

/* The whole life of a camera. Frames are taken three at a time and given back in turn. */
static void live(void)
{
    struct hal_frame held[HAL_CAMERA_HOLD_MAX + 1];
    int32_t count = 0, k;

    for (k = 0; k < 20; k++) {
        const enum hal_next got = next();

        if (got == HAL_NEXT_FRAME) {
            held[count++] = frame;
            TEST_ASSERT_EQUAL_INT32(WIDTH, frame.width);
        } else if (got == HAL_NEXT_BAD || got == HAL_NEXT_GONE) {
            TEST_ASSERT_NOT_EQUAL(0, error.text[0]);
        }
        if (count == HAL_CAMERA_HOLD_MAX + 1 || k == 19) {
            while (count > 0) {
                v4l2.camera.release(&v4l2, &held[--count]);
            }
        }
        if (k == 10) {
            (void)v4l2.camera.set_exposure(&v4l2, 2000, &error);
        }
    }
    if (!v4l2.gone) { /* nothing is mislaid */
        TEST_ASSERT_EQUAL_INT32((int32_t)v4l2.buffer_count, fake_queued_count());
    }
}

static void every_call_fails_once(void)
{
    int32_t kind, reason, call, runs = 0, refusals = 0;

    for (kind = 0; kind < 5; kind++) {
        for (reason = 0; reason < IH_TEST_COUNT(reasons); reason++) {
            for (call = 1;; call++) {
                int32_t k, opening;
                bool good;

                prepare(kind);
                for (k = 0; k < 12; k++) {
                    add_frame((uint32_t)k);
                }
                fake.frame[4].flags |= V4L2_BUF_FLAG_ERROR;
                fake.frame[7].bytesused = 1;
                fake.fail_call = call;
                fake.fail_reason = reasons[reason];
                memset(&v4l2, IH_TEST_FILL, sizeof v4l2);
                good = open_camera();
                opening = fake.call_count;
                if (good) {
                    live();
                    v4l2.camera.close(&v4l2);
                } else {
                    TEST_ASSERT_NOT_EQUAL(0, error.text[0]);
                    refusals++;
                }
                check_closed();
                /* where nothing has a second choice, a device that goes away is noticed at once */
                if (reasons[reason] == ENODEV && (kind == 0 || kind == 2)) {
                    TEST_ASSERT_EQUAL_INT(call > opening, good);
                }
                if (reasons[reason] == EINTR) { /* signals change nothing */
                    TEST_ASSERT_EQUAL_INT(kind != 4, good);
                }
                runs++;
                if (!fake.failed) {
                    break;
                }
            }
            TEST_ASSERT_TRUE(call > 6);
        }
    }
    printf("%d lives of a camera, %d not begun\n", (int)runs, (int)refusals);
}

/* The device goes away before any call, and stays away. */
static void unplugged_at_every_call(void)
{
    int32_t kind, frames, k;

    for (kind = 0; kind < 4; kind++) {
        for (frames = 0; frames <= 12; frames++) {
            struct hal_frame held[3];
            int32_t count = 0;

            prepare(kind);
            for (k = 0; k < 12; k++) {
                add_frame((uint32_t)k);
            }
            memset(&v4l2, IH_TEST_FILL, sizeof v4l2);
            start();
            for (k = 0; k < frames; k++) {
                if (count == 3) {
                    v4l2.camera.release(&v4l2, &held[--count]);
                }
                expect_frame(k);
                held[count++] = frame;
            }
            fake.unplugged = true;
            fake_set_ready(true);
            if (count == 3) {
                v4l2.camera.release(&v4l2, &held[--count]);
            }
            TEST_ASSERT_EQUAL_INT(HAL_NEXT_GONE, next());
            TEST_ASSERT_FALSE(v4l2.camera.set_exposure(&v4l2, 2000, &error));
            while (count > 0) {
                v4l2.camera.release(&v4l2, &held[--count]);
            }
            v4l2.camera.close(&v4l2);
            check_closed();
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(it_opens_the_device_without_waiting_and_closes_it);
    RUN_TEST(opened_again_it_starts_anew);
    RUN_TEST(closed_it_says_so);
    RUN_TEST(a_device_that_cannot_be_opened);
    RUN_TEST(a_device_that_is_no_camera);
    RUN_TEST(the_node_counts_and_not_the_device);
    RUN_TEST(auto_takes_the_best_format);
    RUN_TEST(a_named_format_is_taken);
    RUN_TEST(a_named_format_that_is_not_there);
    RUN_TEST(no_format_that_is_of_use);
    RUN_TEST(a_format_that_nobody_knows);
    RUN_TEST(a_size_that_is_not_there);
    RUN_TEST(long_lists_are_cut);
    RUN_TEST(auto_goes_on_to_a_format_of_the_right_size);
    RUN_TEST(a_device_that_does_as_it_likes);
    RUN_TEST(sizes_that_make_no_sense);
    RUN_TEST(interlaced_frames_are_refused);
    RUN_TEST(rows_that_are_too_short);
    RUN_TEST(buffers_that_are_too_small_or_too_few);
    RUN_TEST(the_rate_is_asked_for_only_when_it_is_wanted);
    RUN_TEST(a_rate_nearby_is_taken_another_is_not);
    RUN_TEST(a_refused_rate_names_those_that_there_are);
    RUN_TEST(a_device_without_a_rate);
    RUN_TEST(what_is_to_be_kept_is_not_touched);
    RUN_TEST(exposure_is_set_in_its_units_after_the_automatic_is_off);
    RUN_TEST(the_first_exposure_may_come_later);
    RUN_TEST(exposure_of_a_device_that_changes);
    RUN_TEST(the_other_automatic_and_the_other_manual);
    RUN_TEST(exposure_that_cannot_be_set);
    RUN_TEST(steps_are_allowed);
    RUN_TEST(exposure_in_rows);
    RUN_TEST(gain_by_any_of_its_controls);
    RUN_TEST(gain_that_cannot_be_set);
    RUN_TEST(a_grey_frame_is_a_view);
    RUN_TEST(a_device_that_does_not_tell_its_stride);
    RUN_TEST(every_format_hands_on_its_samples);
    RUN_TEST(decoded_frames_do_not_share_images);
    RUN_TEST(views_are_held_and_released_in_any_order);
    RUN_TEST(full_range_luma_is_taken_at_its_word);
    RUN_TEST(sequence_goes_beyond_32_bits);
    RUN_TEST(gaps_are_seen);
    RUN_TEST(a_driver_that_does_not_count_is_counted_for);
    RUN_TEST(numbers_go_on_when_opened_again);
    RUN_TEST(times_of_three_kinds);
    RUN_TEST(nothing_there_is_no_frame);
    RUN_TEST(a_damaged_frame_is_bad);
    RUN_TEST(a_short_frame_is_bad);
    RUN_TEST(eio_is_a_lost_frame);
    RUN_TEST(eio_too_often_is_a_broken_device);
    RUN_TEST(other_errors_are_the_end);
    RUN_TEST(signals_do_no_harm);
    RUN_TEST(a_buffer_that_does_not_exist);
    RUN_TEST(unplugged_and_back);
    RUN_TEST(a_buffer_that_cannot_be_given_back);
    RUN_TEST(releases_that_come_too_late);
    RUN_TEST(every_call_fails_once);
    RUN_TEST(unplugged_at_every_call);
    return UNITY_END();
}
