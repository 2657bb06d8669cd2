#include "tracks/ih_result.h"

#include <string.h>

#include "base/ih_fix.h"
#include "nests/ih_nests.h"
#include "rig/ih_level.h"

/* What the filter does not know, as it is the same in every frame: hair, helmets, a tilted head, which part of it is seen.
 * 90 % of the centres lie within twice the filter's 12 mm and 30 mm together, of people of true anatomy before each of
 * three rigs, before cameras that do not hang level, and with half of the dots missing (experiments 027, 033). */
#define MODEL_MM_Q8 (30 << 8)
/* Of the filter, too. */
#define SIGMA_MAX_MM_Q8 (500 << 8)

_Static_assert(IH_RESULT_MAX >= IH_NESTS_MAX, "every nest must find room");

/* 0: unknown. */
static int32_t with_model(int32_t sigma_mm_q8)
{
    const int64_t sum_q16 = (int64_t)sigma_mm_q8 * sigma_mm_q8 + MODEL_MM_Q8 * MODEL_MM_Q8;
    return sigma_mm_q8 == 0 ? 0
                            : ih_min_s32((int32_t)ih_isqrt_u64((uint64_t)sum_q16), SIGMA_MAX_MM_Q8);
}

void ih_result_clear(struct ih_result *out)
{
    memset(out, 0, sizeof *out);
    out->selected = IH_NONE;
}

void ih_result_from_hypotheses(const struct ih_hypotheses *hypotheses, const struct ih_rig *rig,
                               struct ih_result *out)
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
        ih_level_point_back(rig, out->entry[i].centre_mm_q8);
    }
    for (int32_t i = 0; i < hypotheses->head_count; i++) {
        out->head[out->head_count++] = hypotheses->head[i];
    }
    out->selected = out->head_count == 1 ? out->head[0] : IH_NONE;
}

void ih_result_from_tracks(const struct ih_detections *detections, const struct ih_tracks *tracks,
                           const struct ih_predicted *predicted, const struct ih_rig *rig,
                           struct ih_result *out)
{
    ih_result_clear(out);
    out->entry_count = detections->detection_count + predicted->count;
    for (int32_t i = 0; i < out->entry_count; i++) {
        const struct ih_detection *d = ih_tracks_head(detections, predicted, i);
        const struct ih_verdict verdict = ih_tracks_verdict(tracks, detections, i);
        const int32_t *centre = d->head.centre_mm_q8;
        out->entry[i] = (struct ih_result_entry){
            .u_px_q12 = d->u_px_q12,
            .v_px_q12 = d->v_px_q12,
            .a_px_q12 = d->a_px_q12,
            .b_px_q12 = d->b_px_q12,
            .angle_mdeg = d->angle_mdeg,
            .distance_mm_q8 = d->distance_mm_q8,
            .centre_mm_q8 = {centre[0], centre[1], centre[2]},
            .rejected = verdict.is_head ? IH_ACCEPTED : IH_REJECT_SCORE,
            .has_probability = true,
            .probability_q16 = verdict.probability_q16,
            .frame_probability_q16 = d->probability_q16,
            .track_id = verdict.track_id,
            .sigma_mm_q8 = with_model(verdict.sigma_mm_q8),
            .is_predicted = i >= detections->detection_count,
        };
        ih_level_point_back(rig, out->entry[i].centre_mm_q8);
    }
    for (int32_t i = 0; i < tracks->head_count; i++) {
        out->head[out->head_count++] = tracks->head[i];
    }
    out->selected = tracks->selected;
}
