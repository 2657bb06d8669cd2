/* bench_stages - times the core's stages without a line in the core: the linker sends the calls that
 * isohead.c makes (-Wl,--wrap=NAME, CMakeLists.txt) to a timer that makes them. What is timed is the
 * shipped code in the shipped order, and a stage that is no longer called shows.
 */
#ifndef BENCH_STAGES_H
#define BENCH_STAGES_H

#include <stdbool.h>
#include <stdint.h>

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

extern struct bench_times bench_times;

/* The name that the report uses. */
const char *bench_stage_name(int stage);

#endif
