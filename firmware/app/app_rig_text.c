#include "app_rig_text.h"

const char *app_rig_text(enum ih_align_state state)
{
    static const char *const text[] = {
        [IH_ALIGN_UNKNOWN] = "unknown",
        [IH_ALIGN_FITS] = "fits",
        [IH_ALIGN_MOVED] = "moved",
        [IH_ALIGN_LOST] = "lost",
    };
    return text[state];
}

int32_t app_rig_depth_mm_q8(const struct isohead *head)
{
    return ih_align_depth_sigma_mm_q8(&head->align, &head->rig, 1000 << 8);
}
