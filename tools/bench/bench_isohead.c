/* bench_isohead --turns|--once|--results RIG.json FRAME.pgm... [RIG.json FRAME.pgm...]
 *
 * isohead in its default mode over frames that are in memory; each rig's frames are a sequence.
 *   --turns    for every line of standard input a line of JSON: nanoseconds a frame, the whole frame
 *              without timers inside and, from a second run, each stage
 *   --once     runs once, to be counted from outside; prints each frame's count of dots and labels
 *   --results  what was found, a line of JSON a frame: dots, labels, nodes of the surface,
 *              its centres in a row, points on a contour, the head
 */
#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "app_rig.h"
#include "bench_input.h"
#include "isohead.h"

/* The core's stages are timed without a line in the core: the linker sends the calls that isohead.c makes
 * (-Wl,--wrap=NAME, CMakeLists.txt) to a timer that makes them. What is timed is the shipped code in the
 * shipped order, and a stage that is no longer called shows. */
enum bench_stage {
    BENCH_DOTS,
    BENCH_ALIGN,
    BENCH_LABELS,
    BENCH_POINTS,
    BENCH_SURFACE,
    BENCH_NESTS,
    BENCH_HYPOTHESES,
    BENCH_DETECTIONS,
    BENCH_TRACKS,
    BENCH_STAGES
};

struct bench_times {
    bool is_on; /* false: the calls go straight through */
    int64_t stage_ns[BENCH_STAGES];
    int32_t calls[BENCH_STAGES];
};

static struct bench_times bench_times;

/* The name that the report uses. */
static const char *stage_name(int stage)
{
    static const char *const names[BENCH_STAGES] = {
        [BENCH_DOTS] = "dots",        [BENCH_ALIGN] = "align",         [BENCH_LABELS] = "labels",
        [BENCH_POINTS] = "points",    [BENCH_SURFACE] = "surface",     [BENCH_NESTS] = "nests",
        [BENCH_HYPOTHESES] = "heads", [BENCH_DETECTIONS] = "findings", [BENCH_TRACKS] = "tracks",
    };
    return names[stage];
}

static int64_t start(void)
{
    return bench_times.is_on ? bench_now_ns() : 0;
}

static void stop(enum bench_stage stage, int64_t started_ns)
{
    if (bench_times.is_on) {
        bench_times.stage_ns[stage] += bench_now_ns() - started_ns;
        bench_times.calls[stage]++;
    }
}

/* WRAP(stage, name, parameters, arguments): what the linker calls instead of name, and name itself. */
#define WRAP(stage, name, parameters, arguments) \
    void __real_##name parameters;               \
    void __wrap_##name parameters;               \
    void __wrap_##name parameters                \
    {                                            \
        int64_t started_ns = start();            \
        __real_##name arguments;                 \
        stop(stage, started_ns);                 \
    }

WRAP(BENCH_DOTS, ih_dots_find,
     (const struct ih_frame *frame, const struct ih_frame *ambient,
      const struct ih_dots_params *params, struct ih_dots_scratch *scratch, struct ih_dots *out),
     (frame, ambient, params, scratch, out))
WRAP(BENCH_ALIGN, ih_align_find,
     (struct ih_align * align, const struct ih_dots *dots, struct ih_rig *rig,
      struct ih_dot_rows *rows, struct ih_align_scratch *scratch),
     (align, dots, rig, rows, scratch))
WRAP(BENCH_ALIGN, ih_align_learn,
     (struct ih_align * align, const struct ih_labels *labels, struct ih_rig *rig,
      struct ih_align_scratch *scratch),
     (align, labels, rig, scratch))
WRAP(BENCH_LABELS, ih_labels_assign,
     (const struct ih_dots *dots, const struct ih_dot_rows *rows, const struct ih_rig *rig,
      const struct ih_labels_params *params, struct ih_labels_scratch *scratch,
      struct ih_labels *out),
     (dots, rows, rig, params, scratch, out))
WRAP(BENCH_POINTS, ih_points_from_labels,
     (const struct ih_labels *labels, const struct ih_rig *rig, struct ih_points *out),
     (labels, rig, out))
WRAP(BENCH_POINTS, ih_samples_select,
     (const struct ih_points *points, const struct ih_dots *dots, const struct ih_rig *rig,
      const struct ih_samples_params *params, struct ih_samples *out),
     (points, dots, rig, params, out))
WRAP(BENCH_SURFACE, ih_surface_fit,
     (const struct ih_samples *samples, const struct ih_field *field,
      const struct ih_surface_params *params, struct ih_surface_scratch *scratch,
      struct ih_surface *out),
     (samples, field, params, scratch, out))
WRAP(BENCH_NESTS, ih_nests_find,
     (const struct ih_surface *surface, const struct ih_nests_params *params,
      struct ih_nests_scratch *scratch, struct ih_nests *out),
     (surface, params, scratch, out))
WRAP(BENCH_HYPOTHESES, ih_hypotheses_select,
     (const struct ih_nests *nests, const struct ih_surface *surface,
      const struct ih_samples *samples, const struct ih_rig *rig,
      const struct ih_hypotheses_params *params, struct ih_hypotheses *out),
     (nests, surface, samples, rig, params, out))
WRAP(BENCH_DETECTIONS, ih_detections_add,
     (const struct ih_points *points, const struct ih_dots *dots,
      const struct ih_hypotheses *hypotheses, const struct ih_expected *expected,
      const struct ih_rig *rig, const struct ih_detections_params *params,
      struct ih_detections_scratch *scratch, struct ih_detections *out),
     (points, dots, hypotheses, expected, rig, params, scratch, out))
WRAP(BENCH_TRACKS, ih_tracks_expect,
     (const struct ih_tracks *tracks, const struct ih_tracks_params *params, int64_t time_us,
      struct ih_expected *out),
     (tracks, params, time_us, out))
WRAP(BENCH_TRACKS, ih_tracks_update,
     (struct ih_tracks * tracks, const struct ih_tracks_params *params, const struct ih_rig *rig,
      const struct ih_detections *detections, struct ih_predicted *predicted),
     (tracks, params, rig, detections, predicted))

#define FRAME_US 40000

static struct isohead head;

static bool start_set(const struct bench_set *set)
{
    static struct ih_calibration calibration;
    struct hal_error error;
    int32_t bad_slot;
    if (!app_rig_load(set->rig_path, &calibration, &error)) {
        fprintf(stderr, "bench_isohead: %s: %s\n", set->rig_path, error.text);
        return false;
    }
    enum ih_err err = isohead_init(&head, &calibration, &bad_slot);
    if (err != IH_OK) {
        fprintf(stderr, "bench_isohead: %s: %s\n", set->rig_path, ih_err_text(err));
    }
    return err == IH_OK;
}

static bool run_frame(const struct bench_set *set, int32_t index)
{
    const struct bench_frame *f = &set->frame[index];
    struct ih_frame view = {f->samples,          f->width,
                            f->height,           f->width * f->bytes_per_sample,
                            f->bytes_per_sample, f->maximum};
    enum ih_err err = isohead_frame(&head, &view, NULL, (int64_t)index * FRAME_US);
    if (err != IH_OK) {
        fprintf(stderr, "bench_isohead: %s, frame %d: %s\n", set->rig_path, (int)index,
                ih_err_text(err));
    }
    return err == IH_OK;
}

/* All frames; their time together. handle: NULL, or called after each. */
static bool run_all(const struct bench_input *input, void (*handle)(void), int64_t *whole_ns)
{
    *whole_ns = 0;
    for (int32_t s = 0; s < input->set_count; s++) {
        const struct bench_set *set = &input->sets[s];
        if (!start_set(set)) {
            return false;
        }
        for (int32_t i = 0; i < set->frame_count; i++) {
            int64_t started_ns = bench_now_ns();
            bool good = run_frame(set, i);
            *whole_ns += bench_now_ns() - started_ns;
            if (!good) {
                return false;
            }
            if (handle != NULL) {
                handle();
            }
        }
    }
    return true;
}

static void print_counts(void)
{
    printf("dots %d labels %d detections %d\n", (int)head.dots.dot_count,
           (int)head.labels.labelled_count, (int)head.detections.detection_count);
}

static void print_dots(void)
{
    printf("{\"dots\":[");
    for (int32_t i = 0; i < head.dots.dot_count; i++) {
        printf("%s[%.4f,%.4f]", i > 0 ? "," : "", ldexp(head.dots.dot[i].u_px_q12, -12),
               ldexp(head.dots.dot[i].v_px_q12, -12));
    }
    printf("],\"labels\":[");
    const char *comma = "";
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (head.labels.dot_of_slot[slot] != IH_NONE) {
            printf("%s[%d,%d,%.3f]", comma, (int)slot, (int)head.labels.dot_of_slot[slot],
                   ldexp(head.points.point[slot].depth_mm_q8, -8));
            comma = ",";
        }
    }
    printf("]");
}

static void print_result(void)
{
    print_dots();
    printf(",\"surface\":[");
    for (int32_t y = 0; head.surface.valid && y < IH_SURFACE_GRID; y++) {
        for (int32_t x = 0; x < IH_SURFACE_GRID; x++) {
            printf("%s%.2f", x + y > 0 ? "," : "", ldexp(head.surface.depth_mm_q8[y][x], -8));
        }
    }
    printf("],\"centres\":%d,\"points\":%d,\"head\":", (int)head.surface.centres,
           (int)head.params.nests.ellipse.point_count);
    if (head.result.selected == IH_NONE) {
        puts("null}");
        return;
    }
    const int32_t *centre = head.result.entry[head.result.selected].centre_mm_q8;
    printf("[%.2f,%.2f,%.2f]}\n", ldexp(centre[0], -8), ldexp(centre[1], -8), ldexp(centre[2], -8));
}

/* One turn: warm up after the others' turns, then the whole frame without timers inside, then the stages. */
static bool take_turn(const struct bench_input *input)
{
    int64_t cold_ns, whole_ns, timed_ns;
    bench_times = (struct bench_times){.is_on = false};
    if (!run_all(input, NULL, &cold_ns) || !run_all(input, NULL, &whole_ns)) {
        return false;
    }
    bench_times.is_on = true;
    if (!run_all(input, NULL, &timed_ns)) {
        return false;
    }
    int64_t remaining_ns = timed_ns;
    printf("{\"whole\":%.0f", (double)whole_ns / input->frame_count);
    for (int i = 0; i < BENCH_STAGES; i++) {
        if (bench_times.calls[i] == 0) {
            fprintf(stderr, "bench_isohead: the stage %s was never called\n", stage_name(i));
            return false;
        }
        remaining_ns -= bench_times.stage_ns[i];
        printf(",\"%s\":%.0f", stage_name(i), (double)bench_times.stage_ns[i] / input->frame_count);
    }
    printf(",\"rest\":%.0f}\n", (double)remaining_ns / input->frame_count);
    return fflush(stdout) == 0;
}

int main(int argument_count, char **arguments)
{
    struct bench_input input;
    int64_t whole_ns;
    const char *mode = argument_count > 1 ? arguments[1] : "";
    bool is_turns = strcmp(mode, "--turns") == 0;
    bool is_results = strcmp(mode, "--results") == 0;
    if (!is_turns && !is_results && strcmp(mode, "--once") != 0) {
        fputs("usage: bench_isohead --turns|--once|--results RIG.json FRAME.pgm...\n", stderr);
        return 2;
    }
    if (!bench_input_load(argument_count - 2, arguments + 2, &input)) {
        return 1;
    }
    bool good = true;
    if (is_turns) {
        char line[16];
        while (good && fgets(line, sizeof line, stdin) != NULL) {
            good = take_turn(&input);
        }
    } else {
        good = run_all(&input, is_results ? print_result : print_counts, &whole_ns);
    }
    return good && fflush(stdout) == 0 ? 0 : 1;
}
