#include "detect/ih_detections.h"

#include <string.h>

#include "base/ih_fix.h"
#include "detect/ih_prescreen.h"
#include "detect/ih_score.h"
#include "rig/ih_camera.h"

/* After these, what is hopeless is not fitted any further. */
#define FIRST_LOOK_STEPS 1

void ih_detections_params_default(struct ih_detections_params *params)
{
    ih_rays_params_default(&params->space);
    ih_scan_params_default(&params->scan);
    ih_fit_params_default(&params->fit);
    params->promise_min_q8 = 256;
    params->apart_mm = 20;
    params->hopeless_logit_q10 = -5632;
    params->spacing_mm = 80;
    params->nest_near_mm = 90;
    params->range_prior_q10 = -1280;
    params->nest_max = IH_NESTS_MAX;
    params->expected_max = IH_DETECTIONS_EXPECTED_MAX;
    params->front_min_mm = 150;
}

void ih_detections_begin(struct ih_detections *out)
{
    out->detection_count = 0;
    out->dropped_count = 0;
    out->seen_count = 0;
    memset(out->view, 0, sizeof out->view);
}

static int64_t square_q16(int32_t distance_mm)
{
    return (int64_t)distance_mm * distance_mm * 65536;
}

/* The nest whose centre is nearest, if it is near enough. */
static struct ih_evidence_nest nest_at(const struct ih_hypotheses *hypotheses,
                                       const int32_t centre_mm_q8[3], int32_t near_mm)
{
    struct ih_evidence_nest nest = {.present = false};
    int64_t best = square_q16(near_mm);
    for (int32_t i = 0; i < hypotheses->hypothesis_count; i++) {
        const struct ih_hypothesis *h = &hypotheses->hypothesis[i];
        int64_t distance2 = ih_distance2_s32(h->centre_mm_q8, centre_mm_q8);
        if (distance2 < best) {
            best = distance2;
            nest.present = true;
            nest.extent_mm_q8 = h->extent_mm_q8;
            nest.upright_q16 = h->upright_q16;
        }
    }
    return nest;
}

void ih_detections_outline(const struct ih_rig *rig, struct ih_detection *detection)
{
    const struct ih_calibration *c = &rig->calibration;
    const struct ih_ellipsoid *head = &detection->head;
    int64_t depth_q8 = ih_max_s32(head->centre_mm_q8[2], 1 << 8);
    int64_t x_q28 = ih_div_round((int64_t)head->centre_mm_q8[0] * (1 << 28), depth_q8);
    int64_t y_q28 = ih_div_round((int64_t)head->centre_mm_q8[1] * (1 << 28), depth_q8);
    ih_camera_distort(rig, ih_saturate_s32(x_q28), ih_saturate_s32(y_q28), &detection->u_px_q12,
                      &detection->v_px_q12);
    int32_t across_q12 =
        ih_saturate_s32(ih_div_round(ih_mul_shift(head->semi_mm_q8[0], c->fx_px_q16, 4), depth_q8));
    int32_t up_q12 =
        ih_saturate_s32(ih_div_round(ih_mul_shift(head->semi_mm_q8[1], c->fy_px_q16, 4), depth_q8));
    detection->a_px_q12 = ih_max_s32(across_q12, up_q12);
    detection->b_px_q12 = ih_min_s32(across_q12, up_q12);
    detection->angle_mdeg = up_q12 > across_q12 ? 90000 : 0;
    int64_t length2_q16 = 0;
    for (int axis = 0; axis < 3; axis++) {
        length2_q16 += (int64_t)head->centre_mm_q8[axis] * head->centre_mm_q8[axis];
    }
    /* A head that is carried on may pass the camera: then there is no surface before it. */
    detection->distance_mm_q8 = ih_max_s32(
        ih_saturate_s32((int64_t)ih_isqrt_u64((uint64_t)length2_q16) - head->semi_mm_q8[2]), 0);
}

/* More probable first; what is nearer than spacing to a more probable one is the same thing. */
static void insert(struct ih_detections *out, const struct ih_detection *detection,
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

struct work {
    const struct ih_rays *space;
    const struct ih_hypotheses *hypotheses;
    const struct ih_rig *rig;
    const struct ih_detections_params *params;
    struct ih_detections_scratch *scratch;
    struct ih_detections *out;
};

/* How probable a candidate is where its fit is now. */
static void rate(const struct work *work, const struct ih_fit *fit, struct ih_detection *detection)
{
    struct ih_score score;
    detection->head = fit->ellipsoid;
    struct ih_evidence_nest nest =
        nest_at(work->hypotheses, detection->head.centre_mm_q8, work->params->nest_near_mm);
    ih_evidence_collect(work->space, &work->scratch->tally, &detection->head, fit->start_mm_q8,
                        &nest, &detection->evidence);
    ih_score_rate(&detection->evidence, &score);
    detection->logit_q10 = score.logit_q10;
    if (work->rig->calibration.kind == IH_RIG_RANGE) {
        detection->logit_q10 += work->params->range_prior_q10;
    }
}

static bool is_too_near(const struct work *work, const struct ih_ellipsoid *head)
{
    return head->centre_mm_q8[2] - head->semi_mm_q8[2] < work->params->front_min_mm << 8;
}

/* Remember a start, if none before it was as near as apart_mm. */
static bool is_new_start(const struct work *work, const int32_t centre_mm_q8[3])
{
    struct ih_detections_starts *starts = &work->scratch->starts;
    const int64_t apart2 = square_q16(work->params->apart_mm);
    for (int32_t i = 0; i < starts->count; i++) {
        if (ih_distance2_s32(starts->centre_mm_q8[i], centre_mm_q8) < apart2) {
            return false;
        }
    }
    memcpy(starts->centre_mm_q8[starts->count++], centre_mm_q8, 3 * sizeof *centre_mm_q8);
    return true;
}

static void try_start(const struct work *work, const struct ih_ellipsoid *start,
                      enum ih_source source)
{
    const struct ih_detections_params *params = work->params;
    struct ih_detection detection = {.source = (int32_t)source};
    struct ih_fit fit;
    if (!is_new_start(work, start->centre_mm_q8)) {
        return;
    }
    ih_fit_begin(start, &fit);
    ih_fit_continue(work->space, &params->fit, FIRST_LOOK_STEPS, &work->scratch->rows, &fit);
    rate(work, &fit, &detection);
    if (detection.logit_q10 >= params->hopeless_logit_q10 &&
        fit.step_index < params->fit.step_count) {
        ih_fit_continue(work->space, &params->fit, params->fit.step_count, &work->scratch->rows,
                        &fit);
        rate(work, &fit, &detection);
    }
    if (is_too_near(work, &detection.head)) {
        return;
    }
    detection.probability_q16 = ih_score_probability_q16(detection.logit_q10);
    ih_detections_outline(work->rig, &detection);
    insert(work->out, &detection, params->spacing_mm);
}

static void try_place(const struct work *work, const int32_t centre_mm_q8[3], enum ih_source source)
{
    const struct ih_ellipsoid start = ih_ellipsoid_mean(centre_mm_q8);
    if (ih_prescreen_score_q8(&work->scratch->rows.rays, work->space->origin_mm_q8, centre_mm_q8) <
        work->params->promise_min_q8) {
        return;
    }
    try_start(work, &start, source);
}

static void view_expected(const struct work *work, const struct ih_ellipsoid *head,
                          struct ih_view *view)
{
    const struct ih_evidence_nest no_nest = {.present = false};
    struct ih_evidence evidence;
    ih_evidence_collect(work->space, &work->scratch->tally, head, head->centre_mm_q8, &no_nest,
                        &evidence);
    view->through += evidence.through_count;
    view->hit += evidence.hit_count;
    view->front += evidence.front_count;
}

void ih_detections_add(const struct ih_points *points, const struct ih_dots *dots,
                       const struct ih_hypotheses *hypotheses, const struct ih_expected *expected,
                       const struct ih_rig *rig, const struct ih_detections_params *params,
                       struct ih_detections_scratch *scratch, struct ih_detections *out)
{
    const struct work work = {&scratch->space, hypotheses, rig, params, scratch, out};
    if (points->seen_count == 0) {
        return;
    }
    out->seen_count += points->seen_count;
    ih_rays_make(points, dots, rig, &params->space, &scratch->space);
    ih_scan_find(&scratch->space, &params->scan, &scratch->scan_scratch, &scratch->scan);
    ih_fit_equations_prepare(&scratch->space, &scratch->rows.rays);
    ih_ray_counts_prepare(&scratch->space, &scratch->tally);
    scratch->starts.count = 0;
    for (int32_t i = 0; i < ih_min_s32(hypotheses->hypothesis_count, params->nest_max); i++) {
        try_place(&work, hypotheses->hypothesis[i].centre_mm_q8, IH_SOURCE_NEST);
    }
    for (int32_t i = 0; i < scratch->scan.place_count; i++) {
        try_place(&work, scratch->scan.place[i].centre_mm_q8, IH_SOURCE_SCAN);
    }
    for (int32_t i = 0; i < expected->count; i++) {
        if (i < params->expected_max) {
            try_start(&work, &expected->head[i], IH_SOURCE_EXPECTED);
        }
        view_expected(&work, &expected->head[i], &out->view[i]);
    }
}
