#include "sim_score.h"

#include <stdlib.h>

#include "base/ih_fix.h"
#include "sim_report.h"

static void add_value(struct sim_list *list, int32_t value)
{
    if (list->count == list->capacity) {
        list->capacity = list->capacity == 0 ? 64 : list->capacity * 2;
        list->value = sim_report_grow(list->value, list->capacity, sizeof *list->value);
    }
    list->value[list->count++] = value;
}

static int compare_values(const void *left, const void *right)
{
    int32_t a = *(const int32_t *)left;
    int32_t b = *(const int32_t *)right;
    return (a > b) - (a < b);
}

int32_t sim_list_rank(struct sim_list *list, int percent)
{
    qsort(list->value, list->count, sizeof *list->value, compare_values);
    size_t rank = (list->count * (size_t)percent + 99) / 100;
    return list->value[rank == 0 ? 0 : rank - 1];
}

/* Distance of a hypothesis from the true head. Coordinates below 2^26, so squares fit. */
static int32_t distance_mm_q8(const struct ih_result_entry *entry,
                              const struct sim_truth_frame *truth)
{
    uint64_t sum = 0;
    for (int axis = 0; axis < 3; axis++) {
        int64_t difference = (int64_t)entry->centre_mm_q8[axis] - truth->centre_mm_q8[axis];
        sum += (uint64_t)(difference * difference);
    }
    return ih_saturate_s32(ih_isqrt_u64(sum));
}

static bool matches(const struct ih_result_entry *entry, const struct sim_truth_frame *truth)
{
    return truth->head == SIM_TRUTH_HEAD &&
           distance_mm_q8(entry, truth) <= SIM_SCORE_MATCH_MM * 256;
}

static enum sim_outcome judge_selection(const struct ih_result *result,
                                        const struct sim_truth_frame *truth)
{
    if (result->head_count == 0) {
        return SIM_OUTCOME_NONE;
    }
    for (int32_t i = 0; i < result->head_count; i++) {
        if (matches(&result->entry[result->head[i]], truth)) {
            return result->head_count == 1 ? SIM_OUTCOME_CORRECT : SIM_OUTCOME_AMBIGUOUS;
        }
    }
    return SIM_OUTCOME_WRONG;
}

struct sim_verdict sim_score_judge(const struct ih_result *result,
                                   const struct sim_truth_frame *truth)
{
    struct sim_verdict verdict = {.scored = false};
    if (truth == NULL || truth->head == SIM_TRUTH_UNSCORED) {
        return verdict;
    }
    verdict.scored = true;
    verdict.head_there = truth->head == SIM_TRUTH_HEAD;
    for (int32_t i = 0; i < result->entry_count; i++) {
        verdict.detected = verdict.detected || matches(&result->entry[i], truth);
    }
    verdict.outcome = judge_selection(result, truth);
    int32_t selected = result->selected;
    if (selected == IH_NONE) {
        verdict.selected_right = !verdict.head_there;
    } else if (matches(&result->entry[selected], truth)) {
        verdict.selected_right = true;
        verdict.error_known = true;
        verdict.error_mm_q8 = distance_mm_q8(&result->entry[selected], truth);
    }
    return verdict;
}

void sim_score_add(struct sim_score *score, const struct sim_verdict *verdict)
{
    if (!verdict->scored) {
        return;
    }
    struct sim_counts *counts = verdict->head_there ? &score->with_head : &score->empty;
    counts->frame_count++;
    counts->detected_count += verdict->detected;
    counts->selected_right_count += verdict->selected_right;
    counts->outcome_count[verdict->outcome]++;
    if (verdict->error_known) {
        add_value(&score->error_mm_q8, verdict->error_mm_q8);
    }
}

static int32_t dot_distance_px_q12(const struct ih_dot *dot, const struct sim_truth_dot *truth)
{
    int64_t du = (int64_t)dot->u_px_q12 - truth->u_px_q12;
    int64_t dv = (int64_t)dot->v_px_q12 - truth->v_px_q12;
    return ih_saturate_s32(ih_isqrt_u64((uint64_t)(du * du) + (uint64_t)(dv * dv)));
}

void sim_score_add_dots(struct sim_score *score, const struct isohead *head,
                        const struct sim_truth_frame *truth)
{
    const int32_t near_px_q12 = SIM_SCORE_DOT_PX * 4096;
    score->label_count += head->labels.labelled_count;
    for (size_t i = 0; i < truth->dot_count; i++) {
        const struct sim_truth_dot *true_dot = &truth->dot[i];
        int32_t nearest_px_q12 = INT32_MAX;
        for (int32_t k = 0; k < head->dots.dot_count; k++) {
            nearest_px_q12 =
                ih_min_s32(nearest_px_q12, dot_distance_px_q12(&head->dots.dot[k], true_dot));
        }
        score->true_dot_count++;
        if (nearest_px_q12 <= near_px_q12) {
            score->found_dot_count++;
            add_value(&score->dot_error_px_q12, nearest_px_q12);
        }
        int32_t label = head->labels.dot_of_slot[true_dot->slot];
        if (label != IH_NONE &&
            dot_distance_px_q12(&head->dots.dot[label], true_dot) <= near_px_q12) {
            score->right_label_count++;
            add_value(
                &score->depth_error_mm_q8,
                ih_abs_s32(head->points.point[true_dot->slot].depth_mm_q8 - true_dot->depth_mm_q8));
        }
    }
}

static void merge_lists(struct sim_list *sum, const struct sim_list *list)
{
    for (size_t i = 0; i < list->count; i++) {
        add_value(sum, list->value[i]);
    }
}

static void merge_counts(struct sim_counts *sum, const struct sim_counts *counts)
{
    sum->frame_count += counts->frame_count;
    sum->detected_count += counts->detected_count;
    sum->selected_right_count += counts->selected_right_count;
    for (int i = 0; i < SIM_OUTCOMES; i++) {
        sum->outcome_count[i] += counts->outcome_count[i];
    }
}

void sim_score_merge(struct sim_score *sum, const struct sim_score *score)
{
    merge_counts(&sum->with_head, &score->with_head);
    merge_counts(&sum->empty, &score->empty);
    merge_lists(&sum->error_mm_q8, &score->error_mm_q8);
    sum->true_dot_count += score->true_dot_count;
    sum->found_dot_count += score->found_dot_count;
    sum->label_count += score->label_count;
    sum->right_label_count += score->right_label_count;
    merge_lists(&sum->dot_error_px_q12, &score->dot_error_px_q12);
    merge_lists(&sum->depth_error_mm_q8, &score->depth_error_mm_q8);
}

void sim_score_free(struct sim_score *score)
{
    free(score->error_mm_q8.value);
    free(score->dot_error_px_q12.value);
    free(score->depth_error_mm_q8.value);
    *score = (struct sim_score){.true_dot_count = 0};
}
