#include "app_rig_text.h"

#include "app_text.h"
#include "base/ih_fix.h"
#include "hal_text.h"

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

struct app_rig_up_text app_rig_up_text(const int32_t up_q30[3])
{
    struct app_rig_up_text out = {""};
    struct hal_text text = hal_text_begin(out.text, sizeof out.text);
    const int64_t x = up_q30[0], y = up_q30[1];
    const int32_t tilt_mdeg =
        ih_atan2_mdeg(-(int64_t)up_q30[2], ih_isqrt_u64((uint64_t)(x * x + y * y)));
    for (int i = 0; i < 3; i++) {
        hal_text_put(&text, i == 0 ? "[" : ", ");
        hal_text_put(&text, app_text_fixed(up_q30[i], 30, 3).text);
    }
    hal_text_put(&text, "], tilt ");
    hal_text_put(&text, app_text_direction(tilt_mdeg).text);
    hal_text_put(&text, " and roll ");
    hal_text_put(&text, app_text_direction(ih_atan2_mdeg(x, -y)).text);
    hal_text_put(&text, " degrees");
    return out;
}
