#include "sim_truth.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "base/ih_config.h"
#include "hal_file.h"
#include "replay/hal_lines.h"

#define TRUTH_NAME "truth.jsonl"
#define AXES 3
/* index, u, v, z */
#define DOT_NUMBERS 4

/* An array of exactly count numbers below the limit in size. */
static bool read_numbers(const cJSON *array, int count, double limit, double *value)
{
    if (!cJSON_IsArray(array) || cJSON_GetArraySize(array) != count) {
        return false;
    }
    int index = 0;
    const cJSON *item = NULL;
    cJSON_ArrayForEach(item, array)
    {
        if (!cJSON_IsNumber(item) || !(fabs(item->valuedouble) <= limit)) {
            return false;
        }
        value[index++] = item->valuedouble;
    }
    return true;
}

static bool read_head(const cJSON *line, struct sim_truth_frame *frame, struct hal_error *error)
{
    const cJSON *head = cJSON_GetObjectItemCaseSensitive(line, "head");
    const cJSON *hypotheses = cJSON_GetObjectItemCaseSensitive(line, "heads");
    double centre_mm[AXES] = {0};
    double semi_axes_mm[AXES] = {0};
    bool several = cJSON_IsArray(hypotheses) && cJSON_GetArraySize(hypotheses) > 0;
    if (cJSON_IsNull(head) || (head == NULL && several)) {
        frame->head = several ? SIM_TRUTH_UNSCORED : SIM_TRUTH_NOBODY;
        return true;
    }
    if (!cJSON_IsObject(head)) {
        return hal_fail(error, "%s", head == NULL ? "no head" : "head: expected an object or null");
    }
    if (!read_numbers(cJSON_GetObjectItemCaseSensitive(head, "centre_mm"), AXES, SIM_TRUTH_MM_MAX,
                      centre_mm)) {
        return hal_fail(error, "head.centre_mm: expected 3 numbers within +-%d", SIM_TRUTH_MM_MAX);
    }
    const cJSON *axes = cJSON_GetObjectItemCaseSensitive(head, "semi_axes_mm");
    if (axes != NULL && (!read_numbers(axes, AXES, SIM_TRUTH_MM_MAX, semi_axes_mm) ||
                         !(semi_axes_mm[0] > 0 && semi_axes_mm[1] > 0 && semi_axes_mm[2] > 0))) {
        return hal_fail(error, "head.semi_axes_mm: expected 3 numbers above 0");
    }
    frame->head = SIM_TRUTH_HEAD;
    for (int i = 0; i < AXES; i++) {
        frame->centre_mm_q8[i] = (int32_t)llround(centre_mm[i] * 256);
    }
    return true;
}

static bool read_dot(const cJSON *item, struct sim_truth_dot *dot)
{
    double number[DOT_NUMBERS];
    if (!read_numbers(item, DOT_NUMBERS, SIM_TRUTH_PX_MAX, number)) {
        return false;
    }
    if (!(number[0] >= 0 && number[0] < IH_SLOTS) || number[0] != floor(number[0]) ||
        !(number[3] > 0)) {
        return false;
    }
    dot->slot = (int32_t)number[0];
    dot->u_px_q12 = (int32_t)llround(number[1] * 4096);
    dot->v_px_q12 = (int32_t)llround(number[2] * 4096);
    dot->depth_mm_q8 = (int32_t)llround(number[3] * 256);
    return true;
}

static bool read_dots(const cJSON *line, struct sim_truth_frame *frame, struct hal_error *error)
{
    const cJSON *dots = cJSON_GetObjectItemCaseSensitive(line, "dots");
    if (dots == NULL) {
        return true;
    }
    if (!cJSON_IsArray(dots) || cJSON_GetArraySize(dots) > IH_SLOTS) {
        return hal_fail(error, "dots: expected an array of at most %d dots", IH_SLOTS);
    }
    frame->has_dots = true;
    bool taken[IH_SLOTS] = {false};
    frame->dot = sim_report_grow(NULL, IH_SLOTS, sizeof *frame->dot);
    const cJSON *item = NULL;
    cJSON_ArrayForEach(item, dots)
    {
        struct sim_truth_dot *dot = &frame->dot[frame->dot_count];
        if (!read_dot(item, dot)) {
            return hal_fail(error, "dots[%zu]: expected [index below %d, u, v, z_mm above 0]",
                            frame->dot_count, IH_SLOTS);
        }
        if (taken[dot->slot]) {
            return hal_fail(error, "dots[%zu]: index %ld again, expected each index once",
                            frame->dot_count, (long)dot->slot);
        }
        taken[dot->slot] = true;
        frame->dot_count++;
    }
    return true;
}

static void free_frame(struct sim_truth_frame *frame)
{
    free(frame->name);
    free(frame->dot);
}

/* One line as a frame; without a name when there is no such frame. On failure it has no name, or is one that is not
 * scored. */
static bool read_frame(const cJSON *line, const struct hal_replay *replay,
                       struct sim_truth_frame *frame, struct hal_error *error)
{
    const char *name = cJSON_GetStringValue(cJSON_GetObjectItemCaseSensitive(line, "file"));
    if (name == NULL) {
        return hal_fail(error, "no file, expected the name of a frame");
    }
    if (!hal_replay_has(replay, name)) {
        return true; /* truth of frames that were left out does no harm */
    }
    size_t size = strlen(name) + 1;
    frame->name = sim_report_grow(NULL, size, 1);
    memcpy(frame->name, name, size);
    if (!read_head(line, frame, error) || !read_dots(line, frame, error)) {
        frame->head = SIM_TRUTH_UNSCORED;
        frame->has_dots = false;
        return false;
    }
    return true;
}

static void add_frame(struct sim_truth *truth, const struct sim_truth_frame *frame)
{
    if (truth->frame_count == truth->frame_capacity) {
        truth->frame_capacity = truth->frame_capacity == 0 ? 64 : truth->frame_capacity * 2;
        truth->frame = sim_report_grow(truth->frame, truth->frame_capacity, sizeof *truth->frame);
    }
    truth->frame[truth->frame_count++] = *frame;
}

static void read_lines(struct sim_truth *truth, struct hal_lines *lines,
                       const struct hal_replay *replay, struct sim_report *report)
{
    struct hal_error error;
    cJSON *line = NULL;
    enum hal_lines_next next = HAL_LINES_END;
    while ((next = hal_lines_next(lines, &line, &error)) != HAL_LINES_END) {
        if (next == HAL_LINES_BAD) {
            sim_report_error(report, truth->path, "%s", error.text);
            continue;
        }
        struct sim_truth_frame frame = {.line = lines->number};
        if (!read_frame(line, replay, &frame, &error)) {
            sim_report_error(report, truth->path, "line %ld: %s", lines->number, error.text);
        }
        if (frame.name != NULL) {
            add_frame(truth, &frame);
        }
        cJSON_Delete(line);
    }
}

static int compare_frames(const void *left, const void *right)
{
    const struct sim_truth_frame *a = left;
    const struct sim_truth_frame *b = right;
    int order = strcmp(a->name, b->name);
    return order != 0 ? order : (a->line > b->line) - (a->line < b->line);
}

/* Of several lines for one frame only the first stays. */
static void drop_doubles(struct sim_truth *truth, struct sim_report *report)
{
    size_t kept = 0;
    for (size_t i = 0; i < truth->frame_count; i++) {
        struct sim_truth_frame *frame = &truth->frame[i];
        if (kept > 0 && strcmp(truth->frame[kept - 1].name, frame->name) == 0) {
            sim_report_error(report, truth->path, "line %ld: %s has truth in line %ld already",
                             frame->line, frame->name, truth->frame[kept - 1].line);
            free_frame(frame);
        } else {
            truth->frame[kept++] = *frame;
        }
    }
    truth->frame_count = kept;
}

void sim_truth_load(struct sim_truth *truth, const char *dir, const struct hal_replay *replay,
                    struct sim_report *report)
{
    struct hal_lines lines;
    struct hal_error error;
    *truth = (struct sim_truth){.path = hal_file_join(dir, TRUTH_NAME)};
    if (truth->path == NULL) {
        sim_report_error(report, dir, "no memory for the truth");
        return;
    }
    truth->present = hal_file_exists(truth->path);
    if (!truth->present) {
        return;
    }
    if (!hal_lines_open(&lines, truth->path, &error)) {
        sim_report_error(report, truth->path, "%s", error.text);
        truth->present = false;
        return;
    }
    read_lines(truth, &lines, replay, report);
    hal_lines_close(&lines);
    if (truth->frame_count > 0) {
        qsort(truth->frame, truth->frame_count, sizeof *truth->frame, compare_frames);
    }
    drop_doubles(truth, report);
}

void sim_truth_note_unknown(struct sim_truth *truth, const char *name)
{
    truth->unknown_name = truth->unknown_count == 0 ? name : truth->unknown_name;
    truth->unknown_count++;
}

void sim_truth_report(const struct sim_truth *truth, struct sim_report *report)
{
    if (truth->unknown_count == 1) {
        sim_report_error(report, truth->path, "no line for %s", truth->unknown_name);
    } else if (truth->unknown_count > 1) {
        sim_report_error(report, truth->path, "no line for %zu frames, the first is %s",
                         truth->unknown_count, truth->unknown_name);
    }
}

void sim_truth_free(struct sim_truth *truth)
{
    for (size_t i = 0; i < truth->frame_count; i++) {
        free_frame(&truth->frame[i]);
    }
    free(truth->frame);
    free(truth->path);
    *truth = (struct sim_truth){.present = false};
}

const struct sim_truth_frame *sim_truth_find(const struct sim_truth *truth, const char *name)
{
    size_t low = 0;
    size_t high = truth->frame_count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        int order = strcmp(truth->frame[middle].name, name);
        if (order == 0) {
            return &truth->frame[middle];
        }
        if (order < 0) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    return NULL;
}
