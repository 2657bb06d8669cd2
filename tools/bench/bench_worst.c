/* bench_worst [--save OUT.pgm] RIG.json FIRST COUNT [FRAME.pgm...]
 *
 * isohead over COUNT frames from number FIRST on of worst_frames.h; or, where frames are named, over
 * those, the first of which has number 0, to the last. Each is processed within bench_worst_frame,
 * whose instructions are counted from outside (worst_count.c, callgrind). What came before FIRST in its
 * sequence is processed too, but outside. A line a frame of what was found; --save writes the last one.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "app_rig.h"
#include "bench_input.h"
#include "isohead.h"
#include "worst_frames.h"

#define FRAME_US 40000

static struct isohead head;
static uint8_t drawn[IH_FRAME_WIDTH_MAX * IH_FRAME_HEIGHT_MAX];

/* Not inlined, so that they can be found; the second ends what the first began. */
enum ih_err bench_worst_frame(const struct ih_frame *frame, int64_t time_us);
void bench_worst_end(int32_t number, const char *kind);

__attribute__((noinline)) enum ih_err bench_worst_frame(const struct ih_frame *frame,
                                                        int64_t time_us)
{
    return isohead_frame(&head, frame, NULL, time_us);
}

__attribute__((noinline)) void bench_worst_end(int32_t number, const char *kind)
{
    int32_t slices = 0;
    for (int32_t i = 0; i < head.nests.nest_count; i++) {
        slices += head.nests.nest[i].slice_count;
    }
    printf(
        "%d %s dots %d edges %d hot %d dropped %d labels %d lost %d samples %d nests %d slices %d "
        "detections %d expected %d\n",
        (int)number, kind, (int)head.dots.dot_count, (int)head.dots.edge_count,
        (int)head.dots.hot_count, (int)head.dots.dots_dropped, (int)head.labels.labelled_count,
        (int)head.labels.candidates_dropped, (int)head.samples.sample_count,
        (int)head.nests.nest_count, (int)slices, (int)head.detections.detection_count,
        (int)head.expected.count);
}

static bool load_rig(const char *path, struct ih_calibration *calibration)
{
    struct hal_error error;
    if (!app_rig_load(path, calibration, &error)) {
        fprintf(stderr, "bench_worst: %s: %s\n", path, error.text);
        return false;
    }
    return true;
}

static bool start(const struct ih_calibration *calibration)
{
    int32_t bad_slot;
    enum ih_err err = isohead_init(&head, calibration, &bad_slot);
    if (err != IH_OK) {
        fprintf(stderr, "bench_worst: the rig: %s\n", ih_err_text(err));
    }
    return err == IH_OK;
}

static struct ih_frame view_of(const uint8_t *samples)
{
    const struct ih_calibration *c = &head.rig.calibration;
    return (struct ih_frame){samples, c->width, c->height, c->width, 1, 255};
}

static bool save(const char *path, const struct ih_frame *frame)
{
    FILE *file = fopen(path, "wb");
    if (file == NULL) {
        perror(path);
        return false;
    }
    fprintf(file, "P5\n%d %d\n255\n", (int)frame->width, (int)frame->height);
    fwrite(frame->samples, 1, (size_t)frame->width * (size_t)frame->height, file);
    bool good = ferror(file) == 0;
    return fclose(file) == 0 && good;
}

/* Frames that are drawn. */
static bool run_drawn(const struct ih_calibration *calibration, int32_t first, int32_t count,
                      const char *save_path)
{
    struct ih_frame frame = {0};
    for (int32_t i = first - first % WORST_SEQUENCE; i < first + count; i++) {
        if (i % WORST_SEQUENCE == 0 && !start(calibration)) {
            return false;
        }
        worst_frame_draw(&head.rig, i, drawn);
        frame = view_of(drawn);
        int64_t time_us = (int64_t)(i % WORST_SEQUENCE) * FRAME_US;
        if (i < first) {
            if (isohead_frame(&head, &frame, NULL, time_us) != IH_OK) {
                return false;
            }
            continue;
        }
        if (bench_worst_frame(&frame, time_us) != IH_OK) {
            return false;
        }
        bench_worst_end(i, worst_frame_kind(i));
    }
    return save_path == NULL || (frame.samples != NULL && save(save_path, &frame));
}

/* Frames that are named, a sequence; those from `first` on count. */
static bool run_named(const struct ih_calibration *calibration, int32_t first,
                      const struct bench_set *set)
{
    if (!start(calibration)) {
        return false;
    }
    for (int32_t i = 0; i < set->frame_count; i++) {
        struct ih_frame frame = view_of(set->frame[i].samples);
        int64_t time_us = (int64_t)i * FRAME_US;
        if (set->frame[i].width != frame.width || set->frame[i].height != frame.height ||
            set->frame[i].bytes_per_sample != 1) {
            fprintf(stderr, "bench_worst: frame %d is not 8-bit and of the rig's size\n", (int)i);
            return false;
        }
        enum ih_err err = i < first ? isohead_frame(&head, &frame, NULL, time_us)
                                    : bench_worst_frame(&frame, time_us);
        if (err != IH_OK) {
            return false;
        }
        if (i >= first) {
            bench_worst_end(i, "rendered");
        }
    }
    return true;
}

static bool parse(const char *text, int32_t *number)
{
    char *end;
    long value = strtol(text, &end, 10);
    if (end == text || *end != 0 || value < 0 || value > 100000000) {
        fprintf(stderr, "bench_worst: %s: expected a number from 0 to 100000000\n", text);
        return false;
    }
    *number = (int32_t)value;
    return true;
}

int main(int argument_count, char **arguments)
{
    static struct ih_calibration calibration;
    const char *save_path = NULL;
    int at = 1;
    if (argument_count > 3 && strcmp(arguments[1], "--save") == 0) {
        save_path = arguments[2];
        at = 3;
    }
    if (argument_count < at + 3) {
        fputs("usage: bench_worst [--save OUT.pgm] RIG.json FIRST COUNT [FRAME.pgm...]\n", stderr);
        return 2;
    }
    int32_t first, count;
    if (!parse(arguments[at + 1], &first) || !parse(arguments[at + 2], &count)) {
        return 2;
    }
    if (!load_rig(arguments[at], &calibration)) {
        return 1;
    }
    bool good;
    if (argument_count > at + 3) {
        struct bench_input input;
        arguments[at + 2] = arguments[at]; /* the rig, before its frames */
        good = bench_input_load(argument_count - at - 2, &arguments[at + 2], &input) &&
               run_named(&calibration, first, &input.sets[0]);
    } else {
        good = run_drawn(&calibration, first, count, save_path);
    }
    return good && fflush(stdout) == 0 ? 0 : 1;
}
