/* ih_label_seeds - labels of whole rectangles of four slots, where one choice of dots is clearly the best. Private to
 * labels; the method is in ih_labels.h. */
#ifndef IH_LABEL_SEEDS_H
#define IH_LABEL_SEEDS_H

#include <stdbool.h>
#include <stdint.h>

#include "labels/ih_labels.h"
#include "rig/ih_rig.h"

/* The best choice of candidates for the rectangle of four slots. False: none is below the limit, or another one
 * is nearly as good. */
bool ih_label_seeds_find(const struct ih_rig *rig, const struct ih_labels_scratch *scratch,
                         const int32_t slot[4], const struct ih_labels_params *params,
                         struct ih_labels_offer *out);

/* Labels the slots of all seeds, best first. */
void ih_label_seeds_assign(const struct ih_rig *rig, const struct ih_labels_params *params,
                           struct ih_labels_scratch *scratch);

#endif
