/* bench_input - what is measured: rigs and the frames that follow each, read into memory before
 * anything is timed; and a clock. For the benchmark programs in C and in C++.
 *
 * In:    the names RIG.json FRAME.pgm... RIG.json FRAME.pgm..., 8-bit frames.
 * Error: a line that names the file.
 */
#ifndef BENCH_INPUT_H
#define BENCH_INPUT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

struct bench_frame {
    uint8_t *samples; /* rows without gaps */
    int32_t width, height;
    int32_t bytes_per_sample, maximum;
};

struct bench_set {
    const char *rig_path;
    int32_t frame_count;
    struct bench_frame *frame;
};

struct bench_input {
    int32_t set_count, frame_count;
    struct bench_set *sets;
    struct bench_frame *frame; /* of all sets */
};

/* False: said on standard error what was wrong. */
bool bench_input_load(int path_count, char **paths, struct bench_input *out);

/* Of a clock that never runs backwards. */
int64_t bench_now_ns(void);

#ifdef __cplusplus
}
#endif

#endif
