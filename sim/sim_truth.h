/* sim_truth - truth.jsonl: where the head and the dots really are.
 *
 * In:    a JSON object per line (docs/contract.md): file, head, dots.
 * Out:   the frames sorted by name, in the core's units and formats.
 * Error: reported with file and line, and the other lines stay. A line is lost that is no
 *        JSON object, or names a frame that had a line before; one with a malformed head or dots leaves its frame
 *        unscored. A file that cannot be read is no truth. A line for a frame that is not in the directory is ignored.
 * Note:  a line with a "heads" list (several people) in place of a head says nothing about one
 *        head: its frame is not scored.
 */
#ifndef SIM_TRUTH_H
#define SIM_TRUTH_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "replay/hal_replay.h"
#include "sim_report.h"

/* Coordinates beyond this are refused. */
#define SIM_TRUTH_MM_MAX 100000
#define SIM_TRUTH_PX_MAX 100000

struct sim_truth_dot {
    int32_t slot;
    int32_t u_px_q12, v_px_q12; /* distorted pixels */
    int32_t depth_mm_q8;
};

enum sim_truth_head { SIM_TRUTH_NOBODY = 0, SIM_TRUTH_HEAD, SIM_TRUTH_UNSCORED };

struct sim_truth_frame {
    char *name;
    long line;
    enum sim_truth_head head;
    int32_t centre_mm_q8[3];
    bool has_dots;
    struct sim_truth_dot *dot;
    size_t dot_count;
};

struct sim_truth {
    bool present; /* there is a truth.jsonl */
    char *path;
    struct sim_truth_frame *frame; /* sorted by name */
    size_t frame_count, frame_capacity;
    /* frames without a line: how many, and the first one's name */
    size_t unknown_count;
    const char *unknown_name;
};

/* The truth of a directory, empty when it has none. */
void sim_truth_load(struct sim_truth *truth, const char *dir, const struct hal_replay *replay,
                    struct sim_report *report);
/* A frame that has no line; name: good until the report. */
void sim_truth_note_unknown(struct sim_truth *truth, const char *name);
/* In one line how many there were. */
void sim_truth_report(const struct sim_truth *truth, struct sim_report *report);
void sim_truth_free(struct sim_truth *truth);

/* The frame of this name, or NULL. */
const struct sim_truth_frame *sim_truth_find(const struct sim_truth *truth, const char *name);

#endif
