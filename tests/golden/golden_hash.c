#include "golden_hash.h"

/* Structs that golden_add_words takes: a member of another type would change these sizes. */
#define WORDS(n) ((n) * sizeof(int32_t))
_Static_assert(sizeof(struct ih_line) == WORDS(9), "ih_line");
_Static_assert(sizeof(struct ih_field) == WORDS(3), "ih_field");
_Static_assert(sizeof(struct ih_dot) == WORDS(3), "ih_dot");
_Static_assert(sizeof(struct ih_window) == WORDS(5), "ih_window");
_Static_assert(sizeof(struct ih_point) == WORDS(4), "ih_point");
_Static_assert(sizeof(struct ih_hypothesis) == WORDS(22), "ih_hypothesis");
_Static_assert(sizeof(struct ih_ellipsoid) == WORDS(6), "ih_ellipsoid");
_Static_assert(sizeof(struct ih_evidence) == WORDS(IH_EVIDENCE_COUNT + 3), "ih_evidence");
_Static_assert(sizeof(struct ih_view) == WORDS(3), "ih_view");

uint64_t golden_hash_rig(const struct isohead *head)
{
    const struct ih_rig *rig = &head->rig;
    uint64_t hash = golden_add_words(GOLDEN_FNV_START, &rig->field, sizeof rig->field);
    return golden_add_words(hash, rig->line, sizeof rig->line);
}

static uint64_t hash_dots(const struct isohead *head)
{
    const struct ih_dots *dots = &head->dots;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, dots->dot_count);
    hash = golden_add_word(hash, dots->edge_count);
    hash = golden_add_word(hash, dots->hot_count);
    hash = golden_add_word(hash, dots->dots_dropped);
    hash = golden_add_words(hash, dots->dot, (size_t)dots->dot_count * sizeof dots->dot[0]);
    return golden_add_words(hash, dots->bright, sizeof dots->bright);
}

static uint64_t hash_labels(const struct isohead *head)
{
    const struct ih_labels *labels = &head->labels;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, labels->labelled_count);
    hash = golden_add_word(hash, labels->seed_count);
    hash = golden_add_word(hash, labels->candidates_dropped);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        hash = golden_add_word(hash, labels->dot_of_slot[slot]);
        if (labels->dot_of_slot[slot] != IH_NONE) {
            hash = golden_add_word(hash, labels->t_px_q12[slot]);
            hash = golden_add_word(hash, labels->perp_px_q12[slot]);
        }
    }
    return hash;
}

static uint64_t hash_windows(const struct isohead *head)
{
    const struct ih_windows *windows = &head->windows;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, windows->window_count);
    hash = golden_add_word(hash, windows->places_dropped);
    return golden_add_words(hash, windows->window,
                            (size_t)windows->window_count * sizeof windows->window[0]);
}

static uint64_t hash_points(const struct isohead *head)
{
    const struct ih_points *points = &head->points;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, points->seen_count);
    hash = golden_add_words(hash, &points->field, sizeof points->field);
    return golden_add_words(hash, points->point, sizeof points->point);
}

static uint64_t hash_samples(const struct isohead *head)
{
    const struct ih_samples *samples = &head->samples;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, samples->sample_count);
    hash = golden_add_word(hash, samples->seen_count);
    hash = golden_add_word(hash, samples->filled_count);
    hash = golden_add_word(hash, samples->isolated_count);
    hash = golden_add_word(hash, samples->outside_count);
    hash = golden_add_word(hash, samples->nearest_mm_q8);
    hash = golden_add_word(hash, samples->clip_mm_q8);
    for (int32_t i = 0; i < samples->sample_count; i++) {
        const struct ih_sample *sample = &samples->sample[i];
        hash = golden_add_word(hash, sample->x_q16);
        hash = golden_add_word(hash, sample->y_q16);
        hash = golden_add_word(hash, sample->depth_mm_q8);
        hash = golden_add_word(hash, sample->root_weight_q15);
        hash = golden_add_word(hash, sample->slot);
        hash = golden_add_word(hash, sample->is_filled);
    }
    return hash;
}

static uint64_t hash_surface(const struct isohead *head)
{
    const struct ih_surface *surface = &head->surface;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, surface->valid);
    if (!surface->valid) {
        return hash;
    }
    size_t count = (size_t)head->samples.sample_count;
    hash = golden_add_word(hash, surface->downweighted_count);
    hash = golden_add_word(hash, surface->mean_mm_q8);
    hash = golden_add_words(hash, &surface->field, sizeof surface->field);
    hash = golden_add_word(hash, surface->nearest_mm_q8);
    hash = golden_add_words(hash, surface->root_weight_q15,
                            count * sizeof surface->root_weight_q15[0]);
    return golden_add_words(hash, surface->depth_mm_q8, sizeof surface->depth_mm_q8);
}

static uint64_t add_slice(uint64_t hash, const struct ih_slice *slice)
{
    const struct ih_ellipse *ellipse = &slice->ellipse;
    hash = golden_add(hash, ellipse->area_q16, 8);
    hash = golden_add_word(hash, ellipse->x_q16);
    hash = golden_add_word(hash, ellipse->y_q16);
    hash = golden_add(hash, ellipse->xx_q16, 8);
    hash = golden_add(hash, ellipse->xy_q16, 8);
    hash = golden_add(hash, ellipse->yy_q16, 8);
    hash = golden_add_word(hash, ellipse->shape_q16);
    hash = golden_add_word(hash, ellipse->ratio_q16);
    hash = golden_add_word(hash, ellipse->merit_q8);
    hash = golden_add_word(hash, slice->behind_mm_q8);
    hash = golden_add_word(hash, slice->area_mm2);
    return golden_add_word(hash, slice->whole);
}

static uint64_t hash_hypotheses(const struct isohead *head)
{
    const struct ih_nests *nests = &head->nests;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, nests->nest_count);
    hash = golden_add_word(hash, nests->minima_dropped);
    hash = golden_add_word(hash, nests->contours_dropped);
    for (int32_t i = 0; i < nests->nest_count; i++) {
        const struct ih_nest *nest = &nests->nest[i];
        hash = golden_add_word(hash, nest->minimum.x_q9);
        hash = golden_add_word(hash, nest->minimum.y_q9);
        hash = golden_add_word(hash, nest->nearest_mm_q8);
        hash = golden_add_word(hash, nest->front_mm_q8);
        hash = golden_add_word(hash, nest->tip_level_mm_q8);
        hash = golden_add_word(hash, nest->tip_area_mm2);
        hash = golden_add_word(hash, nest->slice_count);
        hash = golden_add_word(hash, nest->gap);
        hash = golden_add_word(hash, nest->ended);
        for (int32_t k = 0; k < nest->slice_count; k++) {
            hash = add_slice(hash, &nest->slice[k]);
        }
    }
    return hash;
}

static uint64_t hash_heads(const struct isohead *head)
{
    const struct ih_hypotheses *hypotheses = &head->hypotheses;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, hypotheses->hypothesis_count);
    hash = golden_add_word(hash, hypotheses->head_count);
    hash = golden_add_words(hash, hypotheses->head,
                            (size_t)hypotheses->head_count * sizeof hypotheses->head[0]);
    return golden_add_words(hash, hypotheses->hypothesis,
                            (size_t)hypotheses->hypothesis_count *
                                sizeof hypotheses->hypothesis[0]);
}

static uint64_t hash_expected(const struct isohead *head)
{
    const struct ih_expected *expected = &head->expected;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, expected->count);
    hash =
        golden_add_words(hash, expected->head, (size_t)expected->count * sizeof expected->head[0]);
    hash = golden_add_word(hash, expected->last_sure_count);
    return golden_add_words(hash, expected->last_sure,
                            (size_t)expected->last_sure_count * sizeof expected->last_sure[0]);
}

static uint64_t hash_detections(const struct isohead *head)
{
    const struct ih_detections *detections = &head->detections;
    const struct ih_predicted *predicted = &head->predicted;
    const int32_t count = detections->detection_count + predicted->count;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, count);
    hash = golden_add_word(hash, detections->dropped_count);
    hash = golden_add_word(hash, detections->seen_count);
    for (int32_t i = 0; i < count; i++) {
        const struct ih_detection *detection = ih_tracks_head(detections, predicted, i);
        const struct ih_verdict verdict = ih_tracks_verdict(&head->tracks, detections, i);
        hash = golden_add_words(hash, &detection->head, sizeof detection->head);
        hash = golden_add_words(hash, &detection->evidence, sizeof detection->evidence);
        hash = golden_add_word(hash, verdict.logit_q10);
        hash = golden_add_word(hash, verdict.probability_q16);
        hash = golden_add_word(hash, detection->source);
        hash = golden_add_word(hash, verdict.track_id);
        hash = golden_add_word(hash, verdict.sigma_mm_q8);
        hash = golden_add_word(hash, verdict.is_head);
        hash = golden_add_word(hash, i >= detections->detection_count);
        hash = golden_add_word(hash, detection->u_px_q12);
        hash = golden_add_word(hash, detection->v_px_q12);
        hash = golden_add_word(hash, detection->a_px_q12);
        hash = golden_add_word(hash, detection->b_px_q12);
        hash = golden_add_word(hash, detection->angle_mdeg);
        hash = golden_add_word(hash, detection->distance_mm_q8);
    }
    return golden_add_words(hash, detections->view, sizeof detections->view);
}

static uint64_t add_track(uint64_t hash, const struct ih_track *track)
{
    const struct ih_kalman *filter = &track->filter;
    hash = golden_add_word(hash, track->id);
    hash = golden_add_word(hash, track->is_head);
    hash = golden_add_word(hash, track->mean_logit_q10);
    hash = golden_add_words(hash, &filter->head, sizeof filter->head);
    hash = golden_add_words(hash, filter->velocity_mm_s_q8, sizeof filter->velocity_mm_s_q8);
    hash = golden_add(hash, filter->position_q8, 8);
    hash = golden_add(hash, filter->cross_q8, 8);
    hash = golden_add(hash, filter->velocity_q8, 8);
    hash = golden_add(hash, track->seen_us, 8);
    hash = golden_add_word(hash, track->detection_count);
    return golden_add_word(hash, track->index);
}

static uint64_t hash_tracks(const struct isohead *head)
{
    const struct ih_tracks *tracks = &head->tracks;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, tracks->has_time);
    hash = golden_add(hash, tracks->time_us, 8);
    hash = golden_add_word(hash, tracks->last_id);
    hash = golden_add_word(hash, tracks->track_count);
    for (int32_t i = 0; i < tracks->track_count; i++) {
        hash = add_track(hash, &tracks->track[i]);
    }
    hash = golden_add_word(hash, tracks->selected_id);
    hash = golden_add_word(hash, tracks->rival_id);
    hash = golden_add_word(hash, tracks->rival_frames);
    hash = golden_add_word(hash, tracks->head_count);
    hash =
        golden_add_words(hash, tracks->head, (size_t)tracks->head_count * sizeof tracks->head[0]);
    return golden_add_word(hash, tracks->selected);
}

static uint64_t hash_result(const struct isohead *head)
{
    const struct ih_result *result = &head->result;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, result->entry_count);
    hash = golden_add_word(hash, result->head_count);
    hash =
        golden_add_words(hash, result->head, (size_t)result->head_count * sizeof result->head[0]);
    hash = golden_add_word(hash, result->selected);
    for (int32_t i = 0; i < result->entry_count; i++) {
        const struct ih_result_entry *entry = &result->entry[i];
        hash = golden_add_word(hash, entry->u_px_q12);
        hash = golden_add_word(hash, entry->v_px_q12);
        hash = golden_add_word(hash, entry->a_px_q12);
        hash = golden_add_word(hash, entry->b_px_q12);
        hash = golden_add_word(hash, entry->angle_mdeg);
        hash = golden_add_word(hash, entry->distance_mm_q8);
        hash = golden_add_words(hash, entry->centre_mm_q8, sizeof entry->centre_mm_q8);
        hash = golden_add_word(hash, entry->rejected);
        hash = golden_add_word(hash, entry->has_probability);
        hash = golden_add_word(hash, entry->probability_q16);
        hash = golden_add_word(hash, entry->frame_probability_q16);
        hash = golden_add_word(hash, entry->track_id);
        hash = golden_add_word(hash, entry->sigma_mm_q8);
        hash = golden_add_word(hash, entry->is_predicted);
    }
    return hash;
}

/* Where the rig is for the next frame, too. */
static uint64_t hash_align(const struct isohead *head)
{
    const struct ih_align *align = &head->align;
    const struct ih_alignment *now = &align->now;
    uint64_t hash = golden_add_word(golden_hash_rig(head), (int32_t)now->state);
    hash = golden_add_words(hash, now->rotation_rad_q30, sizeof now->rotation_rad_q30);
    hash = golden_add_word(hash, now->focal_q30);
    hash = golden_add_words(hash, now->shift_px_q12, sizeof now->shift_px_q12);
    hash = golden_add_words(hash, now->sigma_rad_q30, sizeof now->sigma_rad_q30);
    hash = golden_add_word(hash, now->across_px_q12);
    hash = golden_add_word(hash, now->depth_sigma_rad_q30);
    hash = golden_add_word(hash, now->is_depth_known);
    for (int32_t i = 0; i < IH_ALIGN_ENTRIES; i++) {
        hash = golden_add(hash, align->mean.normal_q24[i], 8);
    }
    for (int32_t i = 0; i < IH_ALIGN_AXES; i++) {
        hash = golden_add(hash, align->mean.right_px_q24[i], 8);
    }
    return hash;
}

/* What is believed, and what the result says of it. */
static uint64_t hash_pose(const struct isohead *head)
{
    const struct ih_pose *pose = &head->pose;
    uint64_t hash = golden_add_word(GOLDEN_FNV_START, pose->belief_count);
    for (int32_t i = 0; i < pose->belief_count; i++) {
        const struct ih_pose_belief *belief = &pose->belief[i];
        hash = golden_add_word(hash, belief->track_id);
        hash = golden_add(hash, belief->time_us, 8);
        for (int32_t k = 0; k < IH_POSE_RATES * IH_POSE_YAWS; k++) {
            hash = golden_add(hash, belief->yaw_q16[k], 2);
        }
        for (int32_t k = 0; k < IH_POSE_PITCHES; k++) {
            hash = golden_add(hash, belief->pitch_q16[k], 2);
        }
    }
    for (int32_t i = 0; i < head->result.entry_count; i++) {
        const struct ih_head_pose *said = &head->result.entry[i].pose;
        hash = golden_add_word(hash, said->is_known);
        hash = golden_add_word(hash, said->yaw_mdeg);
        hash = golden_add_word(hash, said->pitch_mdeg);
        hash = golden_add_word(hash, said->yaw_sigma_mdeg);
        hash = golden_add_word(hash, said->pitch_sigma_mdeg);
    }
    return hash;
}

const struct golden_stage golden_stage[GOLDEN_STAGES] = {
    {"dots", hash_dots},
    {"labels", hash_labels},
    {"windows", hash_windows},
    {"points", hash_points},
    {"samples", hash_samples},
    {"surface", hash_surface},
    {"hypotheses", hash_hypotheses},
    {"heads", hash_heads},
    {"expected", hash_expected},
    {"findings", hash_detections},
    {"tracks", hash_tracks},
    {"result", hash_result},
    {"align", hash_align},
    {"pose", hash_pose},
};
