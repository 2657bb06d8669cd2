#include "detect/ih_candidates.h"

#include <string.h>

#include "base/ih_fix.h"

/* The middle of a body lies in this box about the middle of its head, mm. */
static const int16_t body_low_mm[3] = {-150, 200, -350}, body_high_mm[3] = {150, 400, 150};

static int64_t square_q16(int32_t distance_mm)
{
    return (int64_t)distance_mm * distance_mm * 65536;
}

bool ih_candidates_add_start(struct ih_detections_starts *starts, const int32_t centre_mm_q8[3],
                             int32_t apart_mm)
{
    const int64_t apart2 = square_q16(apart_mm);
    for (int32_t i = 0; i < starts->count; i++) {
        if (ih_distance2_s32(starts->centre_mm_q8[i], centre_mm_q8) < apart2) {
            return false;
        }
    }
    memcpy(starts->centre_mm_q8[starts->count++], centre_mm_q8, 3 * sizeof *centre_mm_q8);
    return true;
}

bool ih_candidates_is_found(const struct ih_detections *detections, const int32_t centre_mm_q8[3],
                            int32_t near_mm, int32_t logit_min_q10)
{
    const int64_t near2 = square_q16(near_mm);
    for (int32_t i = 0; i < detections->detection_count; i++) {
        const struct ih_detection *detection = &detections->detection[i];
        if (detection->logit_q10 >= logit_min_q10 &&
            ih_distance2_s32(detection->head.centre_mm_q8, centre_mm_q8) < near2) {
            return true;
        }
    }
    return false;
}

void ih_candidates_insert(struct ih_detections *out, const struct ih_detection *detection,
                          int32_t spacing_mm)
{
    int64_t spacing2 = square_q16(spacing_mm);
    int32_t kept = 0;
    for (int32_t i = 0; i < out->detection_count; i++) {
        const struct ih_detection *other = &out->detection[i];
        bool same =
            ih_distance2_s32(other->head.centre_mm_q8, detection->head.centre_mm_q8) < spacing2;
        if (same && other->logit_q10 >= detection->logit_q10) {
            return; /* sorted: nothing was dropped before this */
        }
        if (!same) {
            out->detection[kept++] = *other;
        }
    }
    out->detection_count = kept;
    if (kept == IH_DETECTIONS_MAX) {
        out->dropped_count++;
        if (out->detection[kept - 1].logit_q10 >= detection->logit_q10) {
            return;
        }
        out->detection_count--;
    }
    int32_t at = out->detection_count++;
    for (; at > 0 && out->detection[at - 1].logit_q10 < detection->logit_q10; at--) {
        out->detection[at] = out->detection[at - 1];
    }
    out->detection[at] = *detection;
}

/* Is the second one a body to the first one's head? */
static bool is_body_of(const struct ih_detection *head, const struct ih_detection *body)
{
    bool is_inside = true;
    for (int axis = 0; axis < 3; axis++) {
        const int32_t off_mm_q8 = body->head.centre_mm_q8[axis] - head->head.centre_mm_q8[axis];
        is_inside = is_inside && off_mm_q8 > body_low_mm[axis] * 256 &&
                    off_mm_q8 < body_high_mm[axis] * 256;
    }
    return is_inside;
}

uint32_t ih_candidates_bodies(const struct ih_detections *detections, int32_t logit_min_q10)
{
    uint32_t bodies = 0;
    for (int32_t i = 0; i < detections->detection_count; i++) {
        for (int32_t j = 0; j < detections->detection_count; j++) {
            if (detections->detection[j].logit_q10 > logit_min_q10 &&
                is_body_of(&detections->detection[j], &detections->detection[i])) {
                bodies |= 1u << i;
            }
        }
    }
    return bodies;
}
