#include "points/ih_windows.h"

#include <stdbool.h>

#include "points/ih_windows_places.h"
#include "points/ih_windows_score.h"
#include "points/ih_windows_survey.h"

void ih_windows_params_default(struct ih_windows_params *params)
{
    *params = (struct ih_windows_params){
        .window_max = IH_WINDOWS_MAX,
        .apart_mm = 200,
        .score_min = 720,
        .score_behind_max = 130,
        .width_min_q8 = 640,
    };
}

static void collect_places(struct ih_windows_scratch *s, const struct ih_rig *rig,
                           const struct ih_windows_params *params, struct ih_windows *out)
{
    s->place_count = 0;
    for (int32_t row = 0; row < s->row_count; row++) {
        for (int32_t column = 0; column < s->column_count; column++) {
            struct ih_windows_place place = ih_windows_place_at(s, rig, params, column, row);
            if (place.score >= params->score_min && place.score > 0) {
                ih_windows_remember(s, rig, &place, out);
            }
        }
    }
}

/* Is one of the better places, a window or not, the same thing? */
static bool has_better(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                       const struct ih_windows_params *params, int32_t index)
{
    for (int32_t i = 0; i < index; i++) {
        if (ih_windows_are_near(s, rig, &s->place[i], &s->place[index], params->apart_mm)) {
            return true;
        }
    }
    return false;
}

enum ih_err ih_windows_find(const struct ih_frame *frame, const struct ih_rig *rig,
                            const struct ih_windows_params *params,
                            struct ih_windows_scratch *scratch, struct ih_windows *out)
{
    out->window_count = 0;
    out->places_dropped = 0;
    if (rig->calibration.kind != IH_RIG_RANGE || frame->bytes_per_sample != 2) {
        return IH_ERR_KIND;
    }
    int32_t spacing_px = ih_windows_survey(frame, rig, scratch);
    collect_places(scratch, rig, params, out);
    for (int32_t i = 0; i < scratch->place_count && out->window_count < params->window_max; i++) {
        const struct ih_windows_place *place = &scratch->place[i];
        bool is_good = scratch->place[0].score - place->score <= params->score_behind_max;
        if (is_good && !has_better(scratch, rig, params, i) &&
            !ih_windows_stands_on_plane(scratch, rig, place)) {
            struct ih_window *window = &out->window[out->window_count++];
            ih_windows_mean(scratch, rig, params, place, window);
            window->spacing_px = spacing_px;
        }
    }
    return IH_OK;
}
