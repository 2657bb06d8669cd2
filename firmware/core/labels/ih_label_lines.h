/* ih_label_lines - which dots lie on a slot's epipolar line: its candidates. Private to labels. */
#ifndef IH_LABEL_LINES_H
#define IH_LABEL_LINES_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "labels/ih_labels.h"
#include "rig/ih_rig.h"

static inline const struct ih_candidate *ih_label_candidate(const struct ih_labels_scratch *scratch,
                                                            int32_t slot, int32_t choice)
{
    return &scratch->candidate[slot][choice];
}

/* Has a candidate's dot no label yet? */
static inline bool ih_label_is_free(const struct ih_labels_scratch *scratch, int32_t slot,
                                    int32_t choice)
{
    return scratch->slot_of_dot[ih_label_candidate(scratch, slot, choice)->dot] == IH_NONE;
}

/* Labels a slot with one of its candidates. */
static inline void ih_label_assign(struct ih_labels_scratch *scratch, int32_t slot, int8_t choice)
{
    scratch->choice[slot] = choice;
    scratch->slot_of_dot[ih_label_candidate(scratch, slot, choice)->dot] = (int16_t)slot;
}

/* A slot's candidates are in reading order, and a full table drops the last ones: seeds and growing prefer the first
 * of equally good ones, and none of that may depend on the order of the dots. */
void ih_label_lines_add_candidate(const struct ih_dots *dots, struct ih_candidate candidate,
                                  int32_t slot, struct ih_labels_scratch *scratch,
                                  struct ih_labels *out);

/* Finds the candidates of every slot, and labels none. */
void ih_label_lines_find(const struct ih_dots *dots, const struct ih_rig *rig,
                         const struct ih_labels_params *params, struct ih_labels_scratch *scratch,
                         struct ih_labels *out);

#endif
