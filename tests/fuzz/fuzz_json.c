/* The files of JSON lines in a frames directory: frames.jsonl (hal/replay) and truth.jsonl (sim), by
 * way of hal_lines. Input: the first byte says which, the rest is the file; both name frames f0.pgm
 * .. f3.pgm, f1.xyz. */
#include <string.h>

#include "base/ih_config.h"
#include "replay/hal_lines.h"
#include "replay/hal_replay.h"
#include "sim_truth.h"

#include "fuzz.h"

#define PIXELS 4

static const char image[] = "P5 2 2 255\nabcd";
static const char points[] = "1 2 300\n";

static void count_error(void *context, const char *subject, const char *text)
{
    FUZZ_CHECK(subject[0] != 0 && text[0] != 0);
    ++*(long *)context;
}

static void make_directory(void)
{
    static const char *const names[] = {"f0.pgm", "f1.pgm", "f2.pgm", "f3.pgm"};
    static bool is_made;
    if (is_made) {
        return;
    }
    for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
        fuzz_file_write(names[i], (const uint8_t *)image, sizeof image - 1);
    }
    fuzz_file_write("f1.xyz", (const uint8_t *)points, sizeof points - 1);
    fuzz_file_write("frames.jsonl", (const uint8_t *)"", 0);
    fuzz_file_write("truth.jsonl", (const uint8_t *)"", 0);
    is_made = true;
}

/* All frames of the directory, in order, each once. Their times rise from one to the next; behind a frame
 * that is lost they may start anew, since one slip in a recording costs one frame. */
static void walk(struct hal_replay *replay)
{
    struct hal_frame frame;
    struct hal_error error = {""};
    const char *before = NULL; /* names live until the replay is closed */
    bool has_time = false;
    int64_t time_us = 0;
    enum hal_next next = HAL_NEXT_END;
    size_t count = 0;
    while ((next = replay->camera.next(replay->camera.context, &frame, &error)) != HAL_NEXT_END) {
        FUZZ_CHECK(next == HAL_NEXT_FRAME || next == HAL_NEXT_BAD);
        FUZZ_CHECK(before == NULL || strcmp(before, frame.name) < 0);
        before = frame.name;
        count++;
        if (next == HAL_NEXT_BAD) {
            FUZZ_CHECK(error.text[0] != 0);
            has_time = false;
            continue;
        }
        FUZZ_CHECK(!has_time || frame.time_us >= time_us);
        FUZZ_CHECK(llabs(frame.time_us) <= (int64_t)1 << 53);
        has_time = true;
        time_us = frame.time_us;
        FUZZ_CHECK((frame.samples != NULL && frame.width * frame.height == PIXELS) ||
                   frame.point_count == 1);
        replay->camera.release(replay->camera.context, &frame);
    }
    FUZZ_CHECK(count == replay->entry_count && count >= 4);
}

static void read_frames(bool with_lists)
{
    struct hal_replay replay;
    struct hal_error error = {""};
    long errors = 0;
    const struct hal_log log = {&errors, count_error};
    FUZZ_CHECK(hal_replay_open(&replay, fuzz_file_directory(), with_lists, &log, &error));
    FUZZ_CHECK(replay.listed);
    walk(&replay);
    hal_replay_close(&replay);
}

static void check_truth(const struct sim_truth *truth)
{
    for (size_t i = 0; i < truth->frame_count; i++) {
        const struct sim_truth_frame *frame = &truth->frame[i];
        FUZZ_CHECK(i == 0 || strcmp(truth->frame[i - 1].name, frame->name) < 0);
        FUZZ_CHECK(sim_truth_find(truth, frame->name) == frame);
        FUZZ_CHECK((int)frame->head >= 0 && frame->head <= SIM_TRUTH_UNSCORED);
        FUZZ_CHECK(frame->dot_count <= IH_SLOTS);
        for (size_t k = 0; k < frame->dot_count; k++) {
            FUZZ_CHECK(!frame->has_dots ||
                       (frame->dot[k].slot >= 0 && frame->dot[k].slot < IH_SLOTS));
        }
    }
    FUZZ_CHECK(truth->frame_count <= 4);
}

static void read_truth(void)
{
    struct hal_replay replay;
    struct hal_error error = {""};
    struct sim_report report = {.terminal = false};
    struct sim_truth truth;
    long errors = 0;
    const struct hal_log log = {&errors, count_error};
    FUZZ_CHECK(hal_replay_open(&replay, fuzz_file_directory(), false, &log, &error));
    sim_truth_load(&truth, fuzz_file_directory(), &replay, &report);
    FUZZ_CHECK(truth.present);
    check_truth(&truth);
    sim_truth_free(&truth);
    hal_replay_close(&replay);
}

/* Line by line; numbers rise, and there are no more than lines. */
static void read_lines(const uint8_t *data, size_t size)
{
    struct hal_lines lines;
    struct hal_error error = {""};
    cJSON *object = NULL;
    long last = 0;
    size_t count = 0;
    enum hal_lines_next next = HAL_LINES_END;
    FUZZ_CHECK(hal_lines_open(&lines, fuzz_file_path(data, size), &error));
    while ((next = hal_lines_next(&lines, &object, &error)) != HAL_LINES_END) {
        FUZZ_CHECK(lines.number > last);
        FUZZ_CHECK(next == HAL_LINES_OBJECT ? cJSON_IsObject(object)
                                            : object == NULL && error.text[0] != 0);
        last = lines.number;
        cJSON_Delete(object);
        object = NULL;
        count++;
    }
    FUZZ_CHECK(count <= size);
    hal_lines_close(&lines);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct fuzz_input input = {data, size};
    uint8_t which = fuzz_byte(&input) % 4;
    fuzz_quiet();
    make_directory();
    if (which == 0) {
        read_lines(input.at, input.left);
    } else if (which == 1) {
        fuzz_file_write("truth.jsonl", input.at, input.left);
        read_truth();
    } else {
        fuzz_file_write("frames.jsonl", input.at, input.left);
        read_frames(which == 3);
        fuzz_file_write("frames.jsonl", (const uint8_t *)"", 0);
    }
    return 0;
}
