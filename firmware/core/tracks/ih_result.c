#include "tracks/ih_result.h"

#include <string.h>

#include "base/ih_config.h"
#include "nests/ih_nests.h"

_Static_assert(IH_RESULT_MAX >= IH_NESTS_MAX, "every nest must find room");

void ih_result_clear(struct ih_result *out)
{
    memset(out, 0, sizeof *out);
    out->selected = IH_NONE;
}

void ih_result_from_heads(const struct ih_hypotheses *hypotheses, struct ih_result *out)
{
    ih_result_clear(out);
    for (int32_t i = 0; i < hypotheses->hypothesis_count; i++) {
        const struct ih_hypothesis *h = &hypotheses->hypothesis[i];
        out->entry[out->entry_count++] = (struct ih_result_entry){
            .u_px_q12 = h->u_px_q12,
            .v_px_q12 = h->v_px_q12,
            .a_px_q12 = h->a_px_q12,
            .b_px_q12 = h->b_px_q12,
            .angle_mdeg = h->angle_mdeg,
            .distance_mm_q8 = h->distance_mm_q8,
            .centre_mm_q8 = {h->centre_mm_q8[0], h->centre_mm_q8[1], h->centre_mm_q8[2]},
            .rejected = h->rejected,
        };
    }
    for (int32_t i = 0; i < hypotheses->head_count; i++) {
        out->head[out->head_count++] = hypotheses->head[i];
    }
    out->selected = out->head_count == 1 ? out->head[0] : IH_NONE;
}

void ih_result_from_tracks(const struct ih_detections *detections, const struct ih_tracks *tracks,
                           struct ih_result *out)
{
    ih_result_clear(out);
    for (int32_t i = 0; i < detections->detection_count; i++) {
        const struct ih_detection *f = &detections->detection[i];
        const int32_t *centre = f->head.centre_mm_q8;
        out->entry[out->entry_count++] = (struct ih_result_entry){
            .u_px_q12 = f->u_px_q12,
            .v_px_q12 = f->v_px_q12,
            .a_px_q12 = f->a_px_q12,
            .b_px_q12 = f->b_px_q12,
            .angle_mdeg = f->angle_mdeg,
            .distance_mm_q8 = f->distance_mm_q8,
            .centre_mm_q8 = {centre[0], centre[1], centre[2]},
            .rejected = f->is_head ? IH_ACCEPTED : IH_REJECT_SCORE,
            .has_probability = true,
            .probability_q16 = f->probability_q16,
            .track_id = f->track_id,
            .sigma_mm_q8 = f->sigma_mm_q8,
            .is_predicted = f->is_predicted,
        };
    }
    for (int32_t i = 0; i < tracks->head_count; i++) {
        out->head[out->head_count++] = tracks->head[i];
    }
    out->selected = tracks->selected;
}
