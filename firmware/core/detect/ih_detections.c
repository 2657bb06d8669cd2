#include "detect/ih_detections.h"

#include <string.h>

#include "base/ih_fix.h"
#include "detect/ih_candidates.h"
#include "detect/ih_score.h"
#include "rig/ih_level.h"

/* A hopeless candidate is not fitted beyond these. One that is expected is no candidate of chance: it is fitted to the end. */
#define FIRST_LOOK_STEPS 1

void ih_detections_params_default(struct ih_detections_params *params)
{
    ih_rays_params_default(&params->rays);
    ih_scan_params_default(&params->scan);
    ih_fit_params_default(&params->fit);
    params->apart_mm = 20;
    params->found_mm = 130;
    params->found_logit_q10 = 3072;
    params->hopeless_logit_q10 = -2816;
    params->spacing_mm = 80;
    params->nest_max = IH_NESTS_MAX;
    params->expected_max = IH_DETECTIONS_EXPECTED_MAX;
    params->front_min_mm = 150;
    params->move_max_mm = 40;
}

void ih_detections_begin(struct ih_detections *out)
{
    out->detection_count = 0;
    out->dropped_count = 0;
    out->seen_count = 0;
    memset(out->view, 0, sizeof out->view);
}

/* A level camera sees no axis of a head turned. */
static void outline_level(const struct ih_rig *rig, int32_t depth_q8,
                          struct ih_detection *detection)
{
    const struct ih_calibration *c = &rig->calibration;
    const struct ih_ellipsoid *head = &detection->head;
    int32_t across_q12 =
        ih_saturate_s32(ih_div_round(ih_mul_shift(head->semi_mm_q8[0], c->fx_px_q16, 4), depth_q8));
    int32_t up_q12 =
        ih_saturate_s32(ih_div_round(ih_mul_shift(head->semi_mm_q8[1], c->fy_px_q16, 4), depth_q8));
    detection->a_px_q12 = ih_max_s32(across_q12, up_q12);
    detection->b_px_q12 = ih_min_s32(across_q12, up_q12);
    detection->angle_mdeg = up_q12 > across_q12 ? 90000 : 0;
}

/* In units of half its semi-axes an ellipsoid has the second moments 1. */
static void outline_rotated(const struct ih_rig *rig, int32_t depth_q8, int32_t x_q28,
                            int32_t y_q28, struct ih_detection *detection)
{
    static const int32_t moment_q16[3][3] = {{65536, 0, 0}, {0, 65536, 0}, {0, 0, 65536}};
    const int32_t *semi = detection->head.semi_mm_q8;
    const struct ih_level_place place = {
        .x_q28 = x_q28,
        .y_q28 = y_q28,
        .step_q28 = {semi[0] * (1 << 12), semi[1] * (1 << 12), semi[2] * (1 << 12)},
        .multiple = 1 << 15, /* 2^28 over 2, and over 2^12 */
        .divisor = depth_q8};
    const struct ih_level_ellipse axes = ih_level_ellipse(rig, &place, moment_q16);
    detection->a_px_q12 = axes.a_px_q12;
    detection->b_px_q12 = axes.b_px_q12;
    detection->angle_mdeg = axes.angle_mdeg;
}

void ih_detections_outline(const struct ih_rig *rig, struct ih_detection *detection)
{
    const struct ih_ellipsoid *head = &detection->head;
    const int32_t depth_q8 = ih_max_s32(head->centre_mm_q8[2], 1 << 8);
    const int32_t x_q28 =
        ih_saturate_s32(ih_div_round((int64_t)head->centre_mm_q8[0] * (1 << 28), depth_q8));
    const int32_t y_q28 =
        ih_saturate_s32(ih_div_round((int64_t)head->centre_mm_q8[1] * (1 << 28), depth_q8));
    (void)ih_level_sees(rig, x_q28, y_q28, &detection->u_px_q12, &detection->v_px_q12);
    if (rig->is_level) {
        outline_level(rig, depth_q8, detection);
    } else {
        outline_rotated(rig, depth_q8, x_q28, y_q28, detection);
    }
    int64_t length2_q16 = 0;
    for (int axis = 0; axis < 3; axis++) {
        length2_q16 += (int64_t)head->centre_mm_q8[axis] * head->centre_mm_q8[axis];
    }
    /* A predicted head may pass the camera: then there is no surface before it. */
    detection->distance_mm_q8 = ih_max_s32(
        ih_saturate_s32((int64_t)ih_isqrt_u64((uint64_t)length2_q16) - head->semi_mm_q8[2]), 0);
}

struct context {
    const struct ih_rays *rays;
    const struct ih_rig *rig;
    const struct ih_detections_params *params;
    struct ih_detections_scratch *scratch;
    struct ih_detections *out;
};

/* How probable a candidate is where it is now. */
static void rate(const struct context *context, const struct ih_fit *fit,
                 struct ih_detection *detection)
{
    struct ih_surroundings *surroundings = &context->scratch->surroundings;
    int32_t answer_q8[IH_SURROUNDINGS_MAPS];
    struct ih_score score;
    ih_evidence_collect(context->rays, &detection->head, fit->start_mm_q8, &detection->evidence);
    ih_surroundings_find(context->rays, &detection->head, surroundings);
    ih_surroundings_ask(surroundings, answer_q8);
    ih_score_rate(&detection->evidence, answer_q8, &score);
    detection->logit_q10 = score.logit_q10;
}

static bool is_too_near(const struct context *context, const struct ih_ellipsoid *head)
{
    return head->centre_mm_q8[2] - head->semi_mm_q8[2] < context->params->front_min_mm << 8;
}

static void fit_to_the_end(const struct context *context, struct ih_fit *fit,
                           struct ih_detection *detection)
{
    const struct ih_detections_params *params = context->params;
    ih_fit_continue(context->rays, &params->fit, params->fit.step_count, &context->scratch->fit,
                    fit);
    detection->head = fit->ellipsoid;
    if (params->fit.step_count > FIRST_LOOK_STEPS) {
        ih_surroundings_move(context->rays, params->move_max_mm, &detection->head);
    }
    rate(context, fit, detection);
}

static void try_start(const struct context *context, const struct ih_ellipsoid *start,
                      enum ih_source source)
{
    const struct ih_detections_params *params = context->params;
    struct ih_detection detection = {.source = (int32_t)source};
    struct ih_fit fit;
    bool is_worth_it = true;
    if (!ih_candidates_add_start(&context->scratch->starts, start->centre_mm_q8,
                                 params->apart_mm)) {
        return;
    }
    ih_fit_begin(start, &fit);
    if (source != IH_SOURCE_EXPECTED) {
        ih_fit_continue(context->rays, &params->fit, FIRST_LOOK_STEPS, &context->scratch->fit,
                        &fit);
        detection.head = fit.ellipsoid;
        rate(context, &fit, &detection);
        is_worth_it = detection.logit_q10 >= params->hopeless_logit_q10 &&
                      fit.step_index < params->fit.step_count;
    }
    if (is_worth_it) {
        fit_to_the_end(context, &fit, &detection);
    }
    if (is_too_near(context, &detection.head)) {
        return;
    }
    detection.probability_q16 = ih_score_probability_q16(detection.logit_q10);
    ih_detections_outline(context->rig, &detection);
    ih_candidates_insert(context->out, &detection, params->spacing_mm);
}

/* A mean head at a centre that nothing is known of. */
static void try_centre(const struct context *context, const int32_t centre_mm_q8[3],
                       enum ih_source source)
{
    const struct ih_detections_params *params = context->params;
    const struct ih_ellipsoid start = ih_ellipsoid_mean(centre_mm_q8);
    if (!ih_candidates_is_found(context->out, centre_mm_q8, params->found_mm,
                                params->found_logit_q10)) {
        try_start(context, &start, source);
    }
}

static void try_nest(const struct context *context, const int32_t centre_mm_q8[3])
{
    if (ih_surroundings_promise_q5(context->rays, centre_mm_q8) >=
        context->params->scan.promise_min_q5) {
        try_centre(context, centre_mm_q8, IH_SOURCE_NEST);
    }
}

static void view_expected(const struct context *context, const struct ih_ellipsoid *head,
                          struct ih_view *view)
{
    const struct ih_view met = ih_evidence_view(context->rays, head);
    view->through += met.through;
    view->hit += met.hit;
    view->front += met.front;
}

void ih_detections_add(const struct ih_points *points, const struct ih_dots *dots,
                       const struct ih_hypotheses *hypotheses, const struct ih_expected *expected,
                       const struct ih_rig *rig, const struct ih_detections_params *params,
                       struct ih_detections_scratch *scratch, struct ih_detections *out)
{
    const struct context context = {&scratch->rays, rig, params, scratch, out};
    if (points->seen_count == 0) {
        return;
    }
    out->seen_count += points->seen_count;
    ih_rays_make(points, dots, rig, &params->rays, &scratch->rays);
    ih_scan_find(&scratch->rays, &params->scan, &scratch->scan_scratch, &scratch->scan);
    scratch->starts.count = 0;
    for (int32_t i = 0; i < scratch->scan.candidate_count; i++) {
        try_centre(&context, scratch->scan.candidate[i].centre_mm_q8, IH_SOURCE_SCAN);
    }
    for (int32_t i = 0; i < ih_min_s32(hypotheses->hypothesis_count, params->nest_max); i++) {
        try_nest(&context, hypotheses->hypothesis[i].centre_mm_q8);
    }
    for (int32_t i = 0; i < expected->count; i++) {
        if (i < params->expected_max) {
            try_start(&context, &expected->head[i], IH_SOURCE_EXPECTED);
        }
        view_expected(&context, &expected->head[i], &out->view[i]);
    }
    for (int32_t i = 0; i < ih_min_s32(expected->last_sure_count, params->expected_max); i++) {
        try_start(&context, &expected->last_sure[i], IH_SOURCE_EXPECTED);
    }
}
