#include "points/ih_windows_places.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "points/ih_windows_score.h"
#include "points/ih_windows_survey.h"

/* Places nearer than this to a better one are not remembered. */
#define MERGE_MM 70
/* What counts for the mean of a place: this near to it, at most this much worse. */
#define MEAN_REACH_MM 70
#define MEAN_BEHIND_MM 80
#define MEAN_SCORE_DROP 80

bool ih_windows_are_near(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                         const struct ih_windows_place *a, const struct ih_windows_place *b,
                         int32_t apart_mm)
{
    int64_t near_mm_q16 = (int64_t)ih_min_s32(a->depth_mm, b->depth_mm) * s->cell_px * 65536;
    int64_t x_mm = (a->column - b->column) * near_mm_q16 / rig->calibration.fx_px_q16;
    int64_t y_mm = (a->row - b->row) * near_mm_q16 / rig->calibration.fy_px_q16;
    int64_t z_mm = a->depth_mm - b->depth_mm;
    return x_mm * x_mm + y_mm * y_mm + z_mm * z_mm < (int64_t)apart_mm * apart_mm;
}

void ih_windows_remember(struct ih_windows_scratch *s, const struct ih_rig *rig,
                         const struct ih_windows_place *place, struct ih_windows *out)
{
    int32_t kept = 0;
    for (int32_t i = 0; i < s->place_count; i++) {
        bool is_near = ih_windows_are_near(s, rig, &s->place[i], place, MERGE_MM);
        if (is_near && s->place[i].score >= place->score) {
            return; /* nothing was moved yet: better ones come first */
        }
        if (!is_near) {
            s->place[kept++] = s->place[i];
        }
    }
    s->place_count = kept;
    if (kept == IH_WINDOWS_PLACES_MAX) {
        out->places_dropped++;
        if (s->place[kept - 1].score >= place->score) {
            return;
        }
        s->place_count--;
    }
    int32_t at = s->place_count++;
    for (; at > 0 && s->place[at - 1].score < place->score; at--) {
        s->place[at] = s->place[at - 1];
    }
    s->place[at] = *place;
}

struct ih_windows_place ih_windows_place_at(const struct ih_windows_scratch *s,
                                            const struct ih_rig *rig,
                                            const struct ih_windows_params *params, int32_t column,
                                            int32_t row)
{
    struct ih_windows_place place = {(int16_t)column, (int16_t)row,
                                     s->depth_mm[row * s->column_count + column], 0};
    if (place.depth_mm > 0) {
        place.score = (int16_t)ih_windows_score(s, rig, params, &place);
        IH_IN_RANGE(place.score, 0, IH_RANGE_WINDOW_SCORE);
    }
    return place;
}

static int32_t mean_px_q12(int64_t weighted, int64_t weight, const struct ih_windows_scratch *s)
{
    return (int32_t)ih_div_round(weighted * s->cell_px * 4096, weight) + s->cell_px / 2 * 4096;
}

void ih_windows_mean(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                     const struct ih_windows_params *params, const struct ih_windows_place *best,
                     struct ih_window *out)
{
    struct ih_windows_scale scale = ih_windows_scale_at(s, rig, best->depth_mm);
    int32_t reach_u = (int32_t)ih_shift_round((int64_t)MEAN_REACH_MM * scale.u_q16, 16);
    int32_t reach_v = (int32_t)ih_shift_round((int64_t)MEAN_REACH_MM * scale.v_q16, 16);
    int32_t last_u = ih_min_s32(best->column + reach_u, s->column_count - 1);
    int32_t last_v = ih_min_s32(best->row + reach_v, s->row_count - 1);
    int64_t weights = 0;
    int64_t u = 0;
    int64_t v = 0;
    int64_t depth_mm = 0;
    for (int32_t row = ih_max_s32(best->row - reach_v, 0); row <= last_v; row++) {
        for (int32_t column = ih_max_s32(best->column - reach_u, 0); column <= last_u; column++) {
            struct ih_windows_place place = ih_windows_place_at(s, rig, params, column, row);
            int32_t weight = place.score - best->score + MEAN_SCORE_DROP;
            if (weight <= 0 || ih_abs_s32(place.depth_mm - best->depth_mm) > MEAN_BEHIND_MM) {
                continue;
            }
            weights += weight;
            u += (int64_t)weight * column;
            v += (int64_t)weight * row;
            depth_mm += (int64_t)weight * place.depth_mm;
        }
    }
    ih_windows_direction(s, rig, mean_px_q12(u, weights, s), mean_px_q12(v, weights, s),
                         &out->x_q28, &out->y_q28);
    out->depth_mm_q8 = (int32_t)ih_div_round(depth_mm * 256, weights);
    IH_IN_RANGE(out->depth_mm_q8, IH_DEPTH_MIN_MM << 8, IH_DEPTH_MAX_MM << 8);
    out->score = best->score;
}
