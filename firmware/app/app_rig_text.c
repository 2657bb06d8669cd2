#include "app_rig_text.h"

#include "base/ih_fix.h"

#define MM2_PER_M2 1000000

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

int64_t app_rig_depth_mm_q8(const struct isohead *head)
{
    const int64_t x = head->rig.calibration.origin_mm_q16[0];
    const int64_t y = head->rig.calibration.origin_mm_q16[1];
    const int64_t baseline_mm_q16 = (int64_t)ih_isqrt_u64((uint64_t)(x * x + y * y)) + 1;
    const int64_t sigma_mm2_q24 = (int64_t)head->align.now.depth_sigma_rad_q30 * MM2_PER_M2 / 64;
    return ih_div_round(sigma_mm2_q24, baseline_mm_q16);
}
