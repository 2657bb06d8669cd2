/* ih_label_growth - labels beside labels: where the neighbours of a slot expect its dot. Private to labels; the method is
 * in ih_labels.h. */
#ifndef IH_LABEL_GROWTH_H
#define IH_LABEL_GROWTH_H

#include <stdint.h>

#include "base/ih_config.h"
#include "labels/ih_labels.h"
#include "rig/ih_rig.h"

/* The values of inverse depth that the neighbours of a slot expect of it, 1/mm. */
struct ih_label_expectation {
    int32_t count;
    int32_t value_q36[9]; /* of up to 8 adjacent neighbours, and of the affine map */
};

/* Index of a slot's inverse depth. It is 0 where there is no label, and on a border around the pattern, so that
 * neighbours need no bounds check. The border right of a row is also the border left of the next one. */
static inline int32_t ih_label_growth_node(int32_t slot)
{
    return (IH_LABELS_EDGE + slot / IH_GRID) * IH_LABELS_LINE + IH_LABELS_EDGE + slot % IH_GRID;
}

/* 1/mm. */
int32_t ih_label_growth_inverse_q36(const struct ih_candidate *candidate,
                                    const struct ih_line *line);

void ih_label_growth_expect(const struct ih_labels_scratch *scratch, int32_t slot,
                            struct ih_label_expectation *out);

/* hypot(along, 6 perp) against the expectation that is nearest to the candidate. */
int32_t ih_label_growth_error_px_q12(const struct ih_candidate *candidate,
                                     const struct ih_label_expectation *expected,
                                     const struct ih_line *line);

/* After the seeds: sets the inverse depths of labels and the list of open slots. */
void ih_label_growth_begin(const struct ih_rig *rig, struct ih_labels_scratch *scratch);

/* One pass over the open slots. Returns how many were labelled. A slot without a free candidate leaves the list: none can
 * become free. */
int32_t ih_label_growth_pass(const struct ih_rig *rig, struct ih_labels_scratch *scratch,
                             int32_t epsilon_px_q12);

void ih_label_growth_run(const struct ih_rig *rig, const struct ih_labels_params *params,
                         struct ih_labels_scratch *scratch);

#endif
