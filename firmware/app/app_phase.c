#include "app_phase.h"

void app_phase_init(struct app_phase *phase)
{
    *phase = (struct app_phase){.typical_count = 0};
}

enum app_phase_verdict app_phase_judge(struct app_phase *phase, int32_t labelled_count,
                                       bool switches, int32_t on_frames)
{
    bool was_partial = phase->was_partial;
    bool is_few = labelled_count * 8 < phase->typical_count * APP_PHASE_PARTIAL_EIGHTHS;
    bool is_seen = labelled_count >= APP_PHASE_SEEN_MIN;
    phase->was_partial = is_seen && is_few && switches && !was_partial;
    if (phase->was_partial) {
        return APP_PHASE_PARTIAL;
    }
    if (!is_seen && on_frames <= APP_PHASE_FLIGHT_MAX) {
        return APP_PHASE_DARK;
    }
    phase->typical_count = is_seen ? labelled_count : 0;
    return APP_PHASE_LIT;
}
