/* sim_score - compare what was found with the truth (docs/contract.md, "Score").
 *
 * All in integers of 1/256 mm and 1/4096 px, so that scores agree on every machine. A frame that
 * could not be processed is not scored; neither is one without truth.
 */
#ifndef SIM_SCORE_H
#define SIM_SCORE_H

#include "isohead.h"
#include "sim_truth.h"

/* A hypothesis matches a head when its centre is this near. */
#define SIM_SCORE_MATCH_MM 100
/* A detected dot is a true one when it is this near. */
#define SIM_SCORE_DOT_PX 2

enum sim_outcome {
    SIM_OUTCOME_CORRECT = 0, /* one head, and it matches */
    SIM_OUTCOME_AMBIGUOUS,   /* several, one of them matches */
    SIM_OUTCOME_WRONG,       /* one or more, none matches */
    SIM_OUTCOME_NONE         /* no head selected */
};
#define SIM_OUTCOMES 4

struct sim_verdict {
    bool scored;
    bool head_there;     /* truth has a head; else an empty seat */
    bool detected;       /* a hypothesis matches */
    bool selected_right; /* the selected head matches, or none is where none should be */
    bool error_known;    /* a matching head was selected */
    int32_t error_mm_q8; /* its distance from the truth */
    enum sim_outcome outcome;
};

/* Values whose median is wanted. */
struct sim_list {
    int32_t *value;
    size_t count, capacity;
};

/* Of frames with a head, or of those without. */
struct sim_counts {
    int32_t frame_count, detected_count, selected_right_count;
    int32_t outcome_count[SIM_OUTCOMES];
};

struct sim_score {
    struct sim_counts with_head, empty;
    struct sim_list error_mm_q8;
    /* dots, where truth has them */
    int32_t true_dot_count, found_dot_count; /* visible ones; those of them detected */
    int32_t label_count, right_label_count;
    struct sim_list dot_error_px_q12;  /* of found dots */
    struct sim_list depth_error_mm_q8; /* of right labels */
};

/* truth NULL: a frame without truth, not scored. */
struct sim_verdict sim_score_judge(const struct ih_result *result,
                                   const struct sim_truth_frame *truth);

void sim_score_add(struct sim_score *score, const struct sim_verdict *verdict);
void sim_score_add_dots(struct sim_score *score, const struct isohead *head,
                        const struct sim_truth_frame *truth);

/* Add the second to the first. */
void sim_score_merge(struct sim_score *sum, const struct sim_score *score);
void sim_score_free(struct sim_score *score);

/* The value below or at which percent of the list lie (nearest rank); sorts it. count > 0. */
int32_t sim_list_rank(struct sim_list *list, int percent);

#endif
