#include "in_c.h"

#include <stdalign.h>

size_t in_c_size(void)
{
    return sizeof(struct isohead);
}

size_t in_c_alignment(void)
{
    return alignof(struct isohead);
}

size_t in_c_offset_of_result(void)
{
    return offsetof(struct isohead, result);
}

enum ih_err in_c_find(const struct ih_calibration *calibration, const struct ih_frame *frame,
                      struct ih_result *result)
{
    static struct isohead head;
    int32_t bad_slot;
    enum ih_err err = isohead_init(&head, calibration, &bad_slot);

    if (err == IH_OK) {
        err = isohead_frame(&head, frame, NULL, 0);
    }
    *result = head.result;
    return err;
}
