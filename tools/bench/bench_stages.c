#include "bench_stages.h"

#include "bench_input.h"
#include "isohead.h"

struct bench_times bench_times;

const char *bench_stage_name(int stage)
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
