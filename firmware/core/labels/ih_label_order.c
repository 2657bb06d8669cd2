#include "labels/ih_label_order.h"

#include "base/ih_config.h"

_Static_assert(IH_SLOTS <= 1 << IH_LABEL_ORDER_SLOT_BITS, "a slot has its bits in the order");

/* A bin for each 64th of a pixel of error, up to a pixel, the limit of seeds. */
#define ORDER_BINS 64
#define ORDER_BIN_SHIFT (IH_LABEL_ORDER_SLOT_BITS + 6)

static uint32_t bin_of(uint32_t order)
{
    const uint32_t bin = order >> ORDER_BIN_SHIFT;
    return bin < ORDER_BINS ? bin : ORDER_BINS - 1;
}

/* First into bins, then by insertion, which moves each but a little; errors beyond a pixel, which growth has, share the
 * last bin. */
void ih_label_order_sort(const uint32_t *order, int32_t count, uint32_t *sorted)
{
    int16_t begin[ORDER_BINS] = {0};
    for (int32_t i = 0; i < count; i++) {
        begin[bin_of(order[i])]++;
    }
    int16_t all = 0;
    for (int32_t bin = 0; bin < ORDER_BINS; bin++) {
        const int16_t here = begin[bin];
        begin[bin] = all;
        all = (int16_t)(all + here);
    }
    for (int32_t i = 0; i < count; i++) {
        sorted[begin[bin_of(order[i])]++] = order[i];
    }
    for (int32_t i = 1; i < count; i++) {
        const uint32_t moved = sorted[i];
        int32_t at = i;
        for (; at > 0 && sorted[at - 1] > moved; at--) {
            sorted[at] = sorted[at - 1];
        }
        sorted[at] = moved;
    }
}
