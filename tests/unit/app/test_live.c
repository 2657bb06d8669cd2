/* app_live: what the live view's process makes of a frame. That process is confined and says nothing of itself; from outside
 * it is tested by test_view.py. */
#include "app_live.h"

#include <stdlib.h>

#include "ih_test.h"
#include "rigs.inc"

#define FRAME 7
#define RECORD "{\"file\":\"000007.pgm\"}\n"
#define GREY 10 /* of the even columns; the odd ones have three times that */
#define SCALE 2 /* 752 columns: fewer than 400 */

static struct isohead head;
static struct app_record record;
static struct app_live *live;
static size_t live_size;
static unsigned char *answer;
static size_t room;
static uint8_t grey8[752 * 582];
static uint16_t grey16[752 * 582];
static struct hal_frame frame;
static int pause_count;

static void count_pause(void)
{
    pause_count++;
}

/* A bowl of a surface, one minimum in its middle: closed contours. */
static void make_surface(void)
{
    const int32_t middle = (IH_SURFACE_GRID - 1) / 2;

    head.surface.valid = true;
    head.surface.field = head.rig.field;
    head.surface.nearest_mm_q8 = 800 << 8;
    for (int32_t y = 0; y < IH_SURFACE_GRID; y++) {
        for (int32_t x = 0; x < IH_SURFACE_GRID; x++) {
            const int32_t r2 = (x - middle) * (x - middle) + (y - middle) * (y - middle);

            head.surface.depth_mm_q8[y][x] = (800 + r2) << 8;
        }
    }
}

void setUp(void)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, isohead_init(&head, &vector_rigs[0], &bad_slot));
    const int32_t width = head.rig.calibration.width, height = head.rig.calibration.height;

    TEST_ASSERT_EQUAL_INT32(752, width);
    for (int32_t i = 0; i < width * height; i++) {
        grey8[i] = i % width % 2 == 0 ? GREY : 3 * GREY;
        grey16[i] = (uint16_t)(257 * grey8[i]);
    }
    frame = (struct hal_frame){.samples = grey8,
                               .width = width,
                               .height = height,
                               .stride_bytes = width,
                               .bytes_per_sample = 1,
                               .maximum = 255};
    head.dots.dot_count = 2;
    head.dots.dot[0] = (struct ih_dot){.u_px_q12 = 4096, .v_px_q12 = 2 * 4096};
    head.dots.dot[1] = (struct ih_dot){.u_px_q12 = 4096 * 7 / 2, .v_px_q12 = 4096 / 4};
    head.labels.dot_of_slot[100] = 1;
    make_surface();
    record.length = strlen(RECORD);
    memcpy(record.text, RECORD, record.length);
    live_size = app_live_size(width, height);
    live = malloc(live_size);
    room = live_size + APP_LIVE_WRITE_MORE;
    answer = malloc(room);
    TEST_ASSERT_NOT_NULL(live);
    TEST_ASSERT_NOT_NULL(answer);
    memset(live, 0, live_size);
    pause_count = 0;
}

void tearDown(void)
{
    free(live);
    free(answer);
}

/* Length of the answer; its text begins as it should. */
static size_t write_frame(void)
{
    app_live_put(live, &frame, &head, &record, FRAME);
    return app_live_write(live, live_size, answer, room, count_pause);
}

static void check_picture(size_t length)
{
    const size_t pixels = (size_t)(752 / SCALE) * (size_t)(frame.height / SCALE);

    TEST_ASSERT_GREATER_THAN_UINT64(pixels + strlen(RECORD), length);
    for (size_t i = length - pixels; i < length; i++) {
        TEST_ASSERT_EQUAL_UINT8(2 * GREY, answer[i]); /* the mean of both columns */
    }
    TEST_ASSERT_EQUAL_MEMORY(RECORD, answer + length - pixels - strlen(RECORD), strlen(RECORD));
}

static void a_frame_is_text_record_and_picture(void)
{
    static const char start[] =
        "{\"frame\":7,\"width\":752,\"height\":582,\"scale\":2,\"rotate_deg\":0,"
        "\"dots\":[[1.00,2.00],[3.50,0.25]],\"labelled\":[1],\"contours\":[";
    const size_t length = write_frame();

    check_picture(length);
    TEST_ASSERT_EQUAL_MEMORY(start, answer, strlen(start));
    const char *line_end = memchr(answer, '\n', length);

    TEST_ASSERT_NOT_NULL(line_end);
    const char *contour = strstr((const char *)answer, "{\"level_mm\":8");

    TEST_ASSERT_TRUE(contour != NULL && contour < line_end);
    TEST_ASSERT_TRUE(strstr(contour, "\"closed\":true,\"px\":[") < line_end);
    TEST_ASSERT_GREATER_THAN_INT(frame.height / SCALE / 8, pause_count);
}

/* What is up in the picture comes to the top: on its left after a quarter clockwise. */
static void the_side_that_is_up_comes_to_the_top(void)
{
    static const struct {
        double up[3];
        int rotate_deg;
    } cases[] = {{{0, 0, 0}, 0},         {{0, -1, 0}, 0},         {{0, -0.6, -0.8}, 0},
                 {{0.28, -0.96, 0}, 0},  {{0.6, -0.64, 0.48}, 0}, {{1, 0, 0}, 270},
                 {{0.8, 0, 0.6}, 270},   {{-1, 0, 0}, 90},        {{-0.64, 0.6, 0.48}, 90},
                 {{-0.64, -0.6, 0}, 90}, {{0, 1, 0}, 180},        {{0.28, 0.96, 0}, 180}};
    for (size_t i = 0; i < IH_TEST_COUNT(cases); i++) {
        char said[32];
        for (int axis = 0; axis < 3; axis++) {
            head.rig.calibration.up_q30[axis] = (int32_t)(cases[i].up[axis] * (1 << 30));
        }
        check_picture(write_frame());
        (void)snprintf(said, sizeof said, "\"rotate_deg\":%d,\"dots\"", cases[i].rotate_deg);
        TEST_ASSERT_NOT_NULL(strstr((const char *)answer, said));
    }
}

static void samples_of_two_bytes_give_the_same_picture(void)
{
    frame.samples = grey16;
    frame.stride_bytes *= 2;
    frame.bytes_per_sample = 2;
    frame.maximum = 65535;
    check_picture(write_frame());
    frame.maximum = 256 * GREY; /* what is above it is white */
    const size_t length = write_frame();
    TEST_ASSERT_EQUAL_UINT8(255, answer[length - 1]);
}

static void a_frame_without_a_surface_has_no_contours(void)
{
    head.surface.valid = false;
    check_picture(write_frame());
    TEST_ASSERT_NOT_NULL(strstr((const char *)answer, "\"contours\":[]}\n"));
}

/* However little room there is: nothing, and nothing behind it. */
static void an_answer_that_has_no_room_is_none(void)
{
    const size_t length = write_frame();
    const size_t rooms[] = {0, 1, length / 4, length / 2, length - 1};

    for (int32_t i = 0; i < IH_TEST_COUNT(rooms); i++) {
        unsigned char *small = malloc(rooms[i] + 1);

        TEST_ASSERT_NOT_NULL(small);
        app_live_put(live, &frame, &head, &record, FRAME);
        TEST_ASSERT_EQUAL_UINT64(0, app_live_write(live, live_size, small, rooms[i], count_pause));
        free(small);
    }
}

/* Counts and sizes that no loop writes: they are no frame. */
static void what_is_no_frame_is_not_written(void)
{
    struct ih_test_random random = {7};
    int32_t *const number[] = {&live->width, &live->height, &live->maximum,
                               &live->head.dots.dot_count};

    for (int32_t i = 0; i < 400; i++) {
        app_live_put(live, &frame, &head, &record, FRAME);
        int32_t *const wrong = number[i % IH_TEST_COUNT(number)];
        const bool is_negative = i % 8 < 4;

        *wrong = (int32_t)(is_negative ? ih_test_between(&random, INT32_MIN, -1)
                                       : ih_test_between(&random, 65536, INT32_MAX));
        TEST_ASSERT_EQUAL_UINT64(0, app_live_write(live, live_size, answer, room, count_pause));
    }
    app_live_put(live, &frame, &head, &record, FRAME);
    live->record_length = sizeof live->record + 1;
    TEST_ASSERT_EQUAL_UINT64(0, app_live_write(live, live_size, answer, room, count_pause));
    live->record_length = 0;
    TEST_ASSERT_EQUAL_UINT64(0, app_live_write(live, live_size, answer, room, count_pause));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_frame_is_text_record_and_picture);
    RUN_TEST(the_side_that_is_up_comes_to_the_top);
    RUN_TEST(samples_of_two_bytes_give_the_same_picture);
    RUN_TEST(a_frame_without_a_surface_has_no_contours);
    RUN_TEST(an_answer_that_has_no_room_is_none);
    RUN_TEST(what_is_no_frame_is_not_written);
    return UNITY_END();
}
