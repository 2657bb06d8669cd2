/* ih_label_order - offers sorted by error, then slot; the best come first. Private to labels. */
#ifndef IH_LABEL_ORDER_H
#define IH_LABEL_ORDER_H

#include <stdint.h>

#include "base/ih_fix.h"

/* An offer's rank is its error, then its slot. Beyond 1024 px only the slot matters. */
#define IH_LABEL_ORDER_SLOT_BITS 9
#define IH_LABEL_ORDER_ERROR_MAX ((1 << 22) - 1)

static inline uint32_t ih_label_order(int32_t error_px_q12, int32_t slot)
{
    const int32_t error = ih_min_s32(error_px_q12, IH_LABEL_ORDER_ERROR_MAX);
    return (uint32_t)error << IH_LABEL_ORDER_SLOT_BITS | (uint32_t)slot;
}

static inline int32_t ih_label_order_slot(uint32_t order)
{
    return (int32_t)(order % (1u << IH_LABEL_ORDER_SLOT_BITS));
}

/* No two may be equal. */
void ih_label_order_sort(const uint32_t *order, int32_t count, uint32_t *sorted);

#endif
