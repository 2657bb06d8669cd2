#include "bench_input.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "hal_file.h"
#include "replay/hal_pgm.h"

int64_t bench_now_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000000 + now.tv_nsec;
}

static bool is_rig(const char *path)
{
    size_t length = strlen(path);
    return length > 5 && strcmp(path + length - 5, ".json") == 0;
}

static bool load_frame(const char *path, struct bench_frame *frame)
{
    struct hal_error error;
    struct hal_pgm pgm;
    size_t size = 0;
    if (!hal_file_read(path, HAL_PGM_FILE_MAX, &frame->samples, &size, &error) ||
        !hal_pgm_decode(frame->samples, size, &pgm, &error)) {
        fprintf(stderr, "bench: %s: %s\n", path, error.text);
        return false;
    }
    frame->width = pgm.width;
    frame->height = pgm.height;
    frame->bytes_per_sample = pgm.bytes_per_sample;
    frame->maximum = pgm.maximum;
    return true;
}

bool bench_input_load(int path_count, char **paths, struct bench_input *out)
{
    *out = (struct bench_input){0};
    if (path_count < 2 || !is_rig(paths[0]) || is_rig(paths[path_count - 1])) {
        fputs("bench: expected RIG.json FRAME.pgm... for each rig\n", stderr);
        return false;
    }
    out->frame = calloc((size_t)path_count, sizeof *out->frame);
    out->sets = calloc((size_t)path_count, sizeof *out->sets);
    if (out->frame == NULL || out->sets == NULL) {
        fputs("bench: no memory for the list of frames\n", stderr);
        return false;
    }
    for (int i = 0; i < path_count; i++) {
        if (is_rig(paths[i])) {
            out->sets[out->set_count++] =
                (struct bench_set){paths[i], 0, &out->frame[out->frame_count]};
        } else if (load_frame(paths[i], &out->frame[out->frame_count])) {
            out->sets[out->set_count - 1].frame_count++;
            out->frame_count++;
        } else {
            return false;
        }
    }
    return true;
}
