#include "fuzz_check.h"

#include <string.h>

#include "golden_hash.h"

#define FRACTION_ONE_Q16 65536
#define LOGIT_MAX_Q10 (1 << 20)
/* Axes of a fitted head against the mean one's: e^0.35, and a little for rounding. */
#define SEMI_MIN_PERCENT 70
#define SEMI_MAX_PERCENT 143

void fuzz_check_dots(const struct ih_dots *dots, int32_t width, int32_t height)
{
    FUZZ_CHECK(dots->dot_count >= 0 && dots->dot_count <= IH_DOTS_MAX);
    FUZZ_CHECK(dots->edge_count >= 0 && dots->hot_count >= 0 && dots->dots_dropped >= 0);
    FUZZ_CHECK(dots->dots_dropped == 0 || dots->dot_count == IH_DOTS_MAX);
    for (int32_t i = 0; i < dots->dot_count; i++) {
        const struct ih_dot *dot = &dots->dot[i];
        FUZZ_CHECK(dot->u_px_q12 >= 0 && dot->u_px_q12 <= (width - 1) * 4096);
        FUZZ_CHECK(dot->v_px_q12 >= 0 && dot->v_px_q12 <= (height - 1) * 4096);
        FUZZ_CHECK(dot->peak > 0 && dot->peak <= 18648);
    }
    for (int32_t v = 0; v < IH_DOTS_BLOCKS_Y; v++) {
        for (int32_t u = 0; u < IH_DOTS_BLOCKS_X; u++) {
            bool inside = u * IH_DOTS_BLOCK < width && v * IH_DOTS_BLOCK < height;
            FUZZ_CHECK(inside || !ih_dots_is_bright(dots, u * IH_DOTS_BLOCK, v * IH_DOTS_BLOCK));
        }
    }
}

static void check_table(const struct ih_labels *labels, const struct ih_dots *dots,
                        const struct ih_labels_params *params)
{
    bool taken[IH_DOTS_MAX] = {false};
    int32_t count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        int32_t dot = labels->dot_of_slot[slot];
        FUZZ_CHECK(dot == IH_NONE || (dot >= 0 && dot < dots->dot_count));
        if (dot == IH_NONE) {
            continue;
        }
        FUZZ_CHECK(!taken[dot]);
        taken[dot] = true;
        count++;
        FUZZ_CHECK(abs(labels->perp_px_q12[slot]) <= params->perp_max_px_q12);
        FUZZ_CHECK(labels->t_px_q12[slot] > 0);
    }
    FUZZ_CHECK(labels->labelled_count == count);
    FUZZ_CHECK(labels->seed_count >= 0 && labels->seed_count <= count);
    FUZZ_CHECK(labels->candidates_dropped >= 0);
}

void fuzz_check_labels(const struct ih_labels *labels, const struct ih_dots *dots,
                       const struct ih_rig *rig, const struct ih_labels_params *params)
{
    check_table(labels, dots, params);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_line *line = &rig->line[slot];
        if (labels->dot_of_slot[slot] != IH_NONE) {
            FUZZ_CHECK(labels->t_px_q12[slot] >= line->t_far_px_q12 - 2048);
            FUZZ_CHECK(labels->t_px_q12[slot] <= line->t_near_px_q12 + 2048);
        }
    }
}

/* The level frame's depths are others. */
static int32_t near_mm_q8(const struct ih_rig *rig)
{
    return (rig->is_level ? rig->calibration.near_mm : IH_DEPTH_MIN_MM) << 8;
}

static int32_t far_mm_q8(const struct ih_rig *rig)
{
    return (rig->is_level ? rig->calibration.far_mm : IH_DEPTH_MAX_MM) << 8;
}

void fuzz_check_windows(const struct ih_windows *windows, const struct ih_rig *rig)
{
    FUZZ_CHECK(windows->window_count >= 0 && windows->window_count <= IH_WINDOWS_MAX);
    FUZZ_CHECK(windows->places_dropped >= 0);
    for (int32_t i = 0; i < windows->window_count; i++) {
        const struct ih_window *window = &windows->window[i];
        FUZZ_CHECK(window->score <= 1000 && window->spacing_px >= 0);
        FUZZ_CHECK(i == 0 || windows->window[i - 1].score >= window->score);
        FUZZ_CHECK(window->depth_mm_q8 >= near_mm_q8(rig) && window->depth_mm_q8 <= far_mm_q8(rig));
    }
}

void fuzz_check_points(const struct ih_points *points, const struct ih_rig *rig)
{
    int32_t seen = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_point *point = &points->point[slot];
        FUZZ_CHECK(point->state >= IH_POINT_MISSING && point->state <= IH_POINT_UNKNOWN);
        if (point->state == IH_POINT_SEEN) {
            FUZZ_CHECK(point->depth_mm_q8 >= 1 << 8);
            FUZZ_CHECK(point->depth_mm_q8 <= far_mm_q8(rig));
            seen++;
        } else {
            FUZZ_CHECK(point->depth_mm_q8 == 0);
        }
    }
    FUZZ_CHECK(points->seen_count == seen);
    FUZZ_CHECK(points->field.unit_q28 > 0);
}

void fuzz_check_samples(const struct ih_samples *samples, const struct ih_points *points)
{
    int32_t filled = 0;
    int32_t last_slot = -1;
    FUZZ_CHECK(samples->sample_count >= 0 && samples->sample_count <= IH_SLOTS);
    for (int32_t i = 0; i < samples->sample_count; i++) {
        const struct ih_sample *sample = &samples->sample[i];
        FUZZ_CHECK(sample->slot > last_slot && sample->slot < IH_SLOTS);
        FUZZ_CHECK(abs(sample->x_q16) < IH_SAMPLES_REACH << 16);
        FUZZ_CHECK(abs(sample->y_q16) < IH_SAMPLES_REACH << 16);
        FUZZ_CHECK(sample->root_weight_q15 > 0 && sample->root_weight_q15 <= 1 << 15);
        FUZZ_CHECK(sample->depth_mm_q8 > 0 && sample->depth_mm_q8 <= samples->clip_mm_q8);
        FUZZ_CHECK(!sample->is_filled || sample->depth_mm_q8 == samples->clip_mm_q8);
        FUZZ_CHECK(sample->is_filled == (points->point[sample->slot].state != IH_POINT_SEEN));
        filled += sample->is_filled;
        last_slot = sample->slot;
    }
    FUZZ_CHECK(samples->filled_count == filled);
    FUZZ_CHECK(samples->seen_count + filled == samples->sample_count);
    FUZZ_CHECK(samples->seen_count + samples->isolated_count <= points->seen_count);
    FUZZ_CHECK(samples->seen_count + samples->isolated_count + samples->outside_count >=
               points->seen_count);
}

void fuzz_check_surface(const struct ih_surface *surface, const struct ih_samples *samples)
{
    int32_t nearest = INT32_MAX;
    FUZZ_CHECK(surface->downweighted_count >= 0);
    FUZZ_CHECK(surface->downweighted_count <= samples->sample_count);
    FUZZ_CHECK(!surface->valid || samples->sample_count >= IH_SURFACE_SAMPLES_MIN);
    for (int32_t i = 0; surface->valid && i < samples->sample_count; i++) {
        FUZZ_CHECK(surface->root_weight_q15[i] >= 0);
        FUZZ_CHECK(surface->root_weight_q15[i] <= samples->sample[i].root_weight_q15);
    }
    for (int32_t i = 0; surface->valid && i < IH_SURFACE_GRID * IH_SURFACE_GRID; i++) {
        int32_t depth = surface->depth_mm_q8[i / IH_SURFACE_GRID][i % IH_SURFACE_GRID];
        FUZZ_CHECK(depth >= 1 << 8 && depth <= IH_SURFACE_DEPTH_MAX_MM << 8);
        nearest = depth < nearest ? depth : nearest;
    }
    FUZZ_CHECK(!surface->valid || surface->nearest_mm_q8 == nearest);
}

static bool on_border(const struct ih_vertex *vertex)
{
    const int32_t end = (IH_SURFACE_GRID - 1) * 512;
    return vertex->x_q9 == 0 || vertex->y_q9 == 0 || vertex->x_q9 == end || vertex->y_q9 == end;
}

void fuzz_check_contours(const struct ih_contours *contours)
{
    int32_t used = 0;
    FUZZ_CHECK(contours->contour_count >= 0 && contours->contour_count <= IH_CONTOURS_CONTOURS_MAX);
    FUZZ_CHECK(contours->vertex_count >= 0 && contours->vertex_count <= IH_CONTOURS_VERTICES_MAX);
    FUZZ_CHECK(contours->contours_dropped >= 0);
    for (int32_t i = 0; i < contours->vertex_count; i++) {
        const struct ih_vertex *vertex = &contours->vertex[i];
        FUZZ_CHECK(vertex->x_q9 >= 0 && vertex->x_q9 <= (IH_SURFACE_GRID - 1) * 512);
        FUZZ_CHECK(vertex->y_q9 >= 0 && vertex->y_q9 <= (IH_SURFACE_GRID - 1) * 512);
        FUZZ_CHECK(vertex->x_q9 % 512 == 0 || vertex->y_q9 % 512 == 0);
    }
    for (int32_t i = 0; i < contours->contour_count; i++) {
        const struct ih_contour *contour = &contours->contour[i];
        FUZZ_CHECK(contour->first == used && contour->vertex_count >= 2);
        used += contour->vertex_count;
        FUZZ_CHECK(used <= contours->vertex_count);
        FUZZ_CHECK(contour->closed || (on_border(&contours->vertex[contour->first]) &&
                                       on_border(&contours->vertex[used - 1])));
    }
    FUZZ_CHECK(used == contours->vertex_count);
}

static void check_slice(const struct ih_nest *nest, int32_t index,
                        const struct ih_nests_params *params)
{
    const struct ih_slice *slice = &nest->slice[index];
    const struct ih_ellipse *ellipse = &slice->ellipse;
    int32_t ratio_max =
        slice->whole ? params->ellipse.ratio_closed_max_q16 : params->ellipse.ratio_arc_max_q16;
    FUZZ_CHECK(ellipse->area_q16 > 0 && slice->area_mm2 >= 0);
    FUZZ_CHECK(index > 0 || slice->area_mm2 >= params->blunt_mm2);
    FUZZ_CHECK(ellipse->shape_q16 <= params->ellipse.shape_max_q16);
    FUZZ_CHECK(ellipse->ratio_q16 >= 65536 && ellipse->ratio_q16 <= ratio_max);
    FUZZ_CHECK(ellipse->xx_q16 > 0 && ellipse->yy_q16 > 0);
    FUZZ_CHECK(slice->behind_mm_q8 >= 0);
    FUZZ_CHECK(slice->behind_mm_q8 <= params->depth_max_mm << 8 || index == 0);
    FUZZ_CHECK(index == 0 || slice->behind_mm_q8 > nest->slice[index - 1].behind_mm_q8);
}

void fuzz_check_hypotheses(const struct ih_nests *nests, const struct ih_surface *surface,
                           const struct ih_nests_params *params)
{
    FUZZ_CHECK(nests->nest_count >= 0 && nests->nest_count <= IH_NESTS_MAX);
    FUZZ_CHECK(nests->minima_dropped >= 0 && nests->contours_dropped >= 0);
    FUZZ_CHECK(nests->minima_dropped == 0 || nests->nest_count == IH_NESTS_MAX);
    FUZZ_CHECK(surface->valid || nests->nest_count == 0);
    for (int32_t i = 0; i < nests->nest_count; i++) {
        const struct ih_nest *nest = &nests->nest[i];
        int32_t x = nest->minimum.x_q9 / 512, y = nest->minimum.y_q9 / 512;
        FUZZ_CHECK(nest->minimum.x_q9 % 512 == 0 && nest->minimum.y_q9 % 512 == 0);
        FUZZ_CHECK(x > 0 && y > 0 && x < IH_SURFACE_GRID - 1 && y < IH_SURFACE_GRID - 1);
        FUZZ_CHECK(nest->nearest_mm_q8 == surface->depth_mm_q8[y][x]);
        FUZZ_CHECK(i == 0 || nests->nest[i - 1].nearest_mm_q8 <= nest->nearest_mm_q8);
        FUZZ_CHECK(nest->front_mm_q8 >= nest->nearest_mm_q8);
        FUZZ_CHECK(nest->slice_count >= 0 && nest->slice_count <= IH_NESTS_SLICES_MAX);
        for (int32_t k = 0; k < nest->slice_count; k++) {
            check_slice(nest, k, params);
        }
    }
}

static void check_outline(const struct ih_outline *o, const struct ih_samples *samples)
{
    FUZZ_CHECK(o->inside >= 0 && o->above_behind >= 0 && o->beside_behind >= 0 &&
               o->below_near >= 0);
    FUZZ_CHECK(o->above_behind <= o->above && o->beside_behind <= o->beside);
    FUZZ_CHECK(o->below_near <= o->below);
    FUZZ_CHECK(o->inside + o->above + o->beside + o->below <= samples->sample_count);
}

/* An ellipse in the frame, and how far it is. */
static void check_ellipse(int32_t a_px_q12, int32_t b_px_q12, int32_t angle_mdeg,
                          int32_t distance_mm_q8)
{
    FUZZ_CHECK(b_px_q12 >= 0 && a_px_q12 >= b_px_q12);
    FUZZ_CHECK(angle_mdeg >= 0 && angle_mdeg <= 179999);
    FUZZ_CHECK(distance_mm_q8 >= 0);
}

void fuzz_check_heads(const struct ih_hypotheses *hypotheses, const struct ih_nests *nests,
                      const struct ih_samples *samples)
{
    int32_t accepted = 0;
    FUZZ_CHECK(hypotheses->hypothesis_count >= 0);
    FUZZ_CHECK(hypotheses->hypothesis_count <= nests->nest_count);
    for (int32_t i = 0; i < hypotheses->hypothesis_count; i++) {
        const struct ih_hypothesis *h = &hypotheses->hypothesis[i];
        check_ellipse(h->a_px_q12, h->b_px_q12, h->angle_mdeg, h->distance_mm_q8);
        FUZZ_CHECK(h->nest >= 0 && h->nest < nests->nest_count);
        FUZZ_CHECK(nests->nest[h->nest].slice_count > 0);
        FUZZ_CHECK(h->area_mm2 >= 0 && h->extent_mm_q8 >= 0 && h->upright_q16 >= 0);
        FUZZ_CHECK(h->rejected >= IH_ACCEPTED && h->rejected < IH_REJECT_SCORE);
        FUZZ_CHECK((ih_reject_text(h->rejected) == NULL) == (h->rejected == IH_ACCEPTED));
        check_outline(&h->outline, samples);
        if (h->rejected == IH_ACCEPTED) {
            FUZZ_CHECK(accepted < hypotheses->head_count && hypotheses->head[accepted] == i);
            accepted++;
        }
    }
    FUZZ_CHECK(hypotheses->head_count == accepted);
}

static void check_head(const struct ih_ellipsoid *head)
{
    static const int32_t mean_mm[3] = {78, 113, 98};
    for (int axis = 0; axis < 3; axis++) {
        int32_t semi_mm_q8 = head->semi_mm_q8[axis];
        FUZZ_CHECK(abs(head->centre_mm_q8[axis]) <= 1 << 26);
        FUZZ_CHECK(semi_mm_q8 >= mean_mm[axis] * 256 * SEMI_MIN_PERCENT / 100);
        FUZZ_CHECK(semi_mm_q8 <= mean_mm[axis] * 256 * SEMI_MAX_PERCENT / 100);
    }
}

void fuzz_check_detections(const struct ih_detections *detections)
{
    FUZZ_CHECK(detections->detection_count >= 0 &&
               detections->detection_count <= IH_DETECTIONS_MAX);
    FUZZ_CHECK(detections->dropped_count >= 0 && detections->seen_count >= 0);
    for (int32_t i = 0; i < detections->detection_count; i++) {
        const struct ih_detection *f = &detections->detection[i];
        const struct ih_evidence *e = &f->evidence;
        check_head(&f->head);
        check_ellipse(f->a_px_q12, f->b_px_q12, f->angle_mdeg, f->distance_mm_q8);
        FUZZ_CHECK(i == 0 || detections->detection[i - 1].logit_q10 >= f->logit_q10);
        FUZZ_CHECK(abs(f->logit_q10) <= LOGIT_MAX_Q10);
        FUZZ_CHECK(f->probability_q16 >= 0 && f->probability_q16 <= FRACTION_ONE_Q16);
        FUZZ_CHECK(f->source >= IH_SOURCE_SCAN && f->source <= IH_SOURCE_EXPECTED);
        FUZZ_CHECK(e->view.through >= 0 && e->view.hit >= 0 && e->view.front >= 0);
        /* A point on the ellipsoid's far side, seen through it, counts twice. */
        FUZZ_CHECK(e->view.through <= IH_SLOTS && e->view.hit <= IH_SLOTS);
        FUZZ_CHECK(e->view.through + e->view.front <= IH_SLOTS);
        FUZZ_CHECK(e->value_q8[IH_EVIDENCE_ON] >= 0);
        FUZZ_CHECK(e->value_q8[IH_EVIDENCE_ON] <= IH_SLOTS << 8);
        FUZZ_CHECK(e->value_q8[IH_EVIDENCE_ROUGH] >= 0 && e->value_q8[IH_EVIDENCE_MOVED] >= 0);
    }
    for (int32_t i = 0; i < IH_DETECTIONS_EXPECTED_MAX; i++) {
        const struct ih_view *view = &detections->view[i];
        FUZZ_CHECK(view->through >= 0 && view->hit >= 0 && view->front >= 0);
    }
}

static void check_track(const struct ih_tracks *tracks, int32_t index, int32_t count)
{
    const struct ih_track *track = &tracks->track[index];
    const struct ih_kalman *filter = &track->filter;
    FUZZ_CHECK(track->id > 0 && track->detection_count >= 1);
    for (int32_t i = 0; i < index; i++) {
        FUZZ_CHECK(tracks->track[i].id != track->id);
        FUZZ_CHECK(tracks->track[i].index != track->index || track->index == IH_NONE);
    }
    FUZZ_CHECK(track->index < count);
    FUZZ_CHECK(track->index >= 0 ||
               (track->index == IH_NONE && track->is_head && track->seen_us < tracks->time_us &&
                tracks->lit_us < tracks->time_us));
    FUZZ_CHECK(filter->position_q8 >= 0 && filter->velocity_q8 >= 0);
    FUZZ_CHECK(filter->position_q8 <= (int64_t)500 * 500 * 256);
    FUZZ_CHECK(filter->velocity_q8 <= (int64_t)3000 * 3000 * 256);
    for (int axis = 0; axis < 3; axis++) {
        FUZZ_CHECK(abs(filter->velocity_mm_s_q8[axis]) <= 3000 << 8);
    }
    FUZZ_CHECK(track->seen_us <= tracks->time_us);
}

void fuzz_check_tracks(const struct ih_tracks *tracks, const struct ih_detections *detections,
                       const struct ih_predicted *predicted)
{
    const int32_t count = detections->detection_count + predicted->count;
    int32_t hypotheses = 0;
    FUZZ_CHECK(tracks->track_count >= 0 && tracks->track_count <= IH_TRACKS_MAX);
    FUZZ_CHECK(predicted->count >= 0 && predicted->count <= IH_TRACKS_MAX);
    for (int32_t i = 0; i < tracks->track_count; i++) {
        check_track(tracks, i, count);
        hypotheses += tracks->track[i].is_head && tracks->track[i].index != IH_NONE;
    }
    FUZZ_CHECK(tracks->head_count == hypotheses);
    bool is_listed = tracks->selected == IH_NONE;
    int32_t before_q10 = INT32_MAX;
    for (int32_t i = 0; i < hypotheses; i++) {
        int32_t index = tracks->head[i];
        FUZZ_CHECK(index >= 0 && index < count);
        const struct ih_verdict verdict = ih_tracks_verdict(tracks, detections, index);
        FUZZ_CHECK(verdict.is_head && verdict.logit_q10 <= before_q10);
        before_q10 = verdict.logit_q10;
        is_listed = is_listed || index == tracks->selected;
    }
    FUZZ_CHECK(is_listed && (tracks->selected == IH_NONE) == (hypotheses == 0));
    FUZZ_CHECK((tracks->selected == IH_NONE) == (tracks->selected_id == 0));
}

static void check_entry(const struct ih_result_entry *entry, int32_t sigma_max_mm)
{
    check_ellipse(entry->a_px_q12, entry->b_px_q12, entry->angle_mdeg, entry->distance_mm_q8);
    FUZZ_CHECK(entry->rejected >= IH_ACCEPTED && entry->rejected <= IH_REJECT_SCORE);
    FUZZ_CHECK(entry->probability_q16 >= 0 && entry->probability_q16 <= FRACTION_ONE_Q16);
    FUZZ_CHECK(entry->track_id >= 0 && entry->sigma_mm_q8 >= 0);
    FUZZ_CHECK(entry->sigma_mm_q8 <= sigma_max_mm << 8);
    FUZZ_CHECK(!entry->is_predicted || entry->track_id > 0);
    FUZZ_CHECK(!entry->pose.is_known || (entry->track_id > 0 && entry->rejected == IH_ACCEPTED));
    FUZZ_CHECK(entry->pose.yaw_mdeg > -180000 && entry->pose.yaw_mdeg <= 180000);
    FUZZ_CHECK(entry->pose.pitch_mdeg >= -90000 && entry->pose.pitch_mdeg <= 90000);
    FUZZ_CHECK(entry->pose.yaw_sigma_mdeg >= 0 && entry->pose.pitch_sigma_mdeg >= 0);
}

void fuzz_check_result(const struct ih_result *result, int32_t sigma_max_mm)
{
    int32_t accepted = 0;
    bool is_listed = result->selected == IH_NONE;
    FUZZ_CHECK(result->entry_count >= 0 && result->entry_count <= IH_RESULT_MAX);
    for (int32_t i = 0; i < result->entry_count; i++) {
        check_entry(&result->entry[i], sigma_max_mm);
        accepted += result->entry[i].rejected == IH_ACCEPTED;
    }
    FUZZ_CHECK(result->head_count == accepted);
    for (int32_t i = 0; i < result->head_count; i++) {
        FUZZ_CHECK(result->head[i] >= 0 && result->head[i] < result->entry_count);
        FUZZ_CHECK(result->entry[result->head[i]].rejected == IH_ACCEPTED);
        is_listed = is_listed || result->head[i] == result->selected;
    }
    FUZZ_CHECK(is_listed);
}

/* Lines have moved since the labels were made where the frame says that the rig has. */
void fuzz_check_core(const struct isohead *core)
{
    const struct ih_rig *rig = &core->rig;
    bool is_dots = rig->calibration.kind == IH_RIG_DOTS;
    if (is_dots) {
        fuzz_check_dots(&core->dots, rig->calibration.width, rig->calibration.height);
        check_table(&core->labels, &core->dots, &core->params.labels);
        /* Out of a level camera's view a dot is none of its points. */
        FUZZ_CHECK(core->points.seen_count <= core->labels.labelled_count);
        FUZZ_CHECK(!rig->is_level || core->points.seen_count == core->labels.labelled_count);
    } else {
        fuzz_check_windows(&core->windows, rig);
    }
    if (is_dots || core->windows.window_count > 0) {
        fuzz_check_points(&core->points, rig);
        fuzz_check_samples(&core->samples, &core->points);
        fuzz_check_surface(&core->surface, &core->samples);
        fuzz_check_hypotheses(&core->nests, &core->surface, &core->params.nests);
        fuzz_check_heads(&core->hypotheses, &core->nests, &core->samples);
    }
    if (!core->params.is_paper) {
        fuzz_check_tracks(&core->tracks, &core->detections, &core->predicted);
    }
    /* Of a rig that has moved the depth, which may be off by all of the range, is in it: 16,008 mm together. */
    fuzz_check_result(&core->result, core->align.now.state == IH_ALIGN_MOVED ? IH_DEPTH_MAX_MM + 8
                                                                             : FUZZ_SIGMA_MAX_MM);
}

void fuzz_check_empty(const struct isohead *core)
{
    FUZZ_CHECK(core->dots.dot_count == 0 && core->labels.labelled_count == 0);
    FUZZ_CHECK(core->points.seen_count == 0 && core->samples.sample_count == 0);
    FUZZ_CHECK(!core->surface.valid && core->nests.nest_count == 0);
    FUZZ_CHECK(core->hypotheses.hypothesis_count == 0 && core->detections.detection_count == 0);
    FUZZ_CHECK(core->result.entry_count == 0 && core->result.head_count == 0);
    FUZZ_CHECK(core->result.selected == IH_NONE);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        FUZZ_CHECK(core->labels.dot_of_slot[slot] == IH_NONE);
    }
}

void fuzz_check_same(const struct isohead *a, const struct isohead *b)
{
    for (int i = 0; i < GOLDEN_STAGES; i++) {
        FUZZ_CHECK(golden_stage[i].hash(a) == golden_stage[i].hash(b));
    }
}
