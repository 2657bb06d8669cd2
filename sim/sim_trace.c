#include "sim_trace.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "hal_file.h"
#include "sim_trace_contours.h"
#include "detect/ih_score.h"
#include "detect/ih_surroundings.h"

/* An int32_t member of an array of structs as a list of its own. */
static void write_column(struct app_write *write, const char *key, const void *first, int32_t count,
                         size_t stride_bytes)
{
    const uint8_t *at = first;
    app_write_key(write, key);
    app_write_open(write, '[');
    for (int32_t i = 0; i < count; i++) {
        int32_t value = 0;
        memcpy(&value, at + (size_t)i * stride_bytes, sizeof value);
        app_write_int(write, value);
    }
    app_write_close(write, ']');
}

static void write_field(struct app_write *write, const struct ih_field *field)
{
    app_write_key(write, "field");
    app_write_open(write, '{');
    app_write_int_field(write, "centre_x_q28", field->centre_x_q28);
    app_write_int_field(write, "centre_y_q28", field->centre_y_q28);
    app_write_int_field(write, "unit_q28", field->unit_q28);
    app_write_close(write, '}');
}

/* What comes after the labels is in the level frame, where that is another one than the camera's (ih_level.h). */
static void write_level(struct app_write *write, const struct ih_rig *rig)
{
    if (!rig->is_level) {
        write_column(write, "level_q30", rig->level_q30, 9, sizeof rig->level_q30[0][0]);
    }
}

static void write_dots(struct app_write *write, const struct ih_dots *dots)
{
    const struct ih_dot *dot = dots->dot;
    app_write_key(write, "dots");
    app_write_open(write, '{');
    app_write_int_field(write, "dot_count", dots->dot_count);
    app_write_int_field(write, "edge_count", dots->edge_count);
    app_write_int_field(write, "hot_count", dots->hot_count);
    app_write_int_field(write, "dots_dropped", dots->dots_dropped);
    write_column(write, "u_px_q12", &dot->u_px_q12, dots->dot_count, sizeof *dot);
    write_column(write, "v_px_q12", &dot->v_px_q12, dots->dot_count, sizeof *dot);
    write_column(write, "peak", &dot->peak, dots->dot_count, sizeof *dot);
    app_write_close(write, '}');
}

static void write_labels(struct app_write *write, const struct ih_labels *labels)
{
    app_write_key(write, "labels");
    app_write_open(write, '{');
    app_write_int_field(write, "labelled_count", labels->labelled_count);
    app_write_int_field(write, "seed_count", labels->seed_count);
    app_write_int_field(write, "candidates_dropped", labels->candidates_dropped);
    app_write_key(write, "slot");
    app_write_open(write, '[');
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (labels->dot_of_slot[slot] == IH_NONE) {
            app_write_null(write);
            continue;
        }
        app_write_open(write, '{');
        app_write_int_field(write, "dot", labels->dot_of_slot[slot]);
        app_write_int_field(write, "t_px_q12", labels->t_px_q12[slot]);
        app_write_int_field(write, "perp_px_q12", labels->perp_px_q12[slot]);
        app_write_close(write, '}');
    }
    app_write_close(write, ']');
    app_write_close(write, '}');
}

static void write_points(struct app_write *write, const struct ih_points *points)
{
    const struct ih_point *point = points->point;
    app_write_key(write, "points");
    app_write_open(write, '{');
    app_write_int_field(write, "seen_count", points->seen_count);
    write_field(write, &points->field);
    write_column(write, "x_q28", &point->x_q28, IH_SLOTS, sizeof *point);
    write_column(write, "y_q28", &point->y_q28, IH_SLOTS, sizeof *point);
    write_column(write, "depth_mm_q8", &point->depth_mm_q8, IH_SLOTS, sizeof *point);
    write_column(write, "state", &point->state, IH_SLOTS, sizeof *point);
    app_write_close(write, '}');
}

static void write_samples(struct app_write *write, const struct ih_samples *samples,
                          const struct ih_surface *surface)
{
    const struct ih_sample *sample = samples->sample;
    int32_t count = samples->sample_count;
    app_write_key(write, "samples");
    app_write_open(write, '{');
    app_write_int_field(write, "sample_count", count);
    app_write_int_field(write, "seen_count", samples->seen_count);
    app_write_int_field(write, "filled_count", samples->filled_count);
    app_write_int_field(write, "isolated_count", samples->isolated_count);
    app_write_int_field(write, "outside_count", samples->outside_count);
    app_write_int_field(write, "nearest_mm_q8", samples->nearest_mm_q8);
    app_write_int_field(write, "clip_mm_q8", samples->clip_mm_q8);
    write_column(write, "slot", &sample->slot, count, sizeof *sample);
    write_column(write, "x_q16", &sample->x_q16, count, sizeof *sample);
    write_column(write, "y_q16", &sample->y_q16, count, sizeof *sample);
    write_column(write, "depth_mm_q8", &sample->depth_mm_q8, count, sizeof *sample);
    write_column(write, "root_weight_q15", &sample->root_weight_q15, count, sizeof *sample);
    write_column(write, "final_root_weight_q15", surface->root_weight_q15,
                 surface->valid ? count : 0, sizeof surface->root_weight_q15[0]);
    app_write_close(write, '}');
}

static void write_surface(struct app_write *write, const struct ih_surface *surface)
{
    app_write_key(write, "surface");
    app_write_open(write, '{');
    app_write_key(write, "valid");
    app_write_bool(write, surface->valid);
    if (surface->valid) {
        app_write_int_field(write, "centres", surface->centres);
        app_write_int_field(write, "downweighted_count", surface->downweighted_count);
        app_write_int_field(write, "mean_mm_q8", surface->mean_mm_q8);
        app_write_int_field(write, "nearest_mm_q8", surface->nearest_mm_q8);
        write_field(write, &surface->field);
        app_write_key(write, "depth_mm_q8");
        app_write_open(write, '[');
        for (int32_t y = 0; y < IH_SURFACE_GRID; y++) {
            app_write_open(write, '[');
            for (int32_t x = 0; x < IH_SURFACE_GRID; x++) {
                app_write_int(write, surface->depth_mm_q8[y][x]);
            }
            app_write_close(write, ']');
        }
        app_write_close(write, ']');
    }
    app_write_close(write, '}');
}

static void write_slice(struct app_write *write, const struct ih_slice *slice)
{
    const struct ih_ellipse *ellipse = &slice->ellipse;
    app_write_open(write, '{');
    app_write_int_field(write, "behind_mm_q8", slice->behind_mm_q8);
    app_write_int_field(write, "area_mm2", slice->area_mm2);
    app_write_key(write, "whole");
    app_write_bool(write, slice->whole);
    app_write_int_field(write, "area_q16", ellipse->area_q16);
    app_write_int_field(write, "x_q16", ellipse->x_q16);
    app_write_int_field(write, "y_q16", ellipse->y_q16);
    app_write_int_field(write, "xx_q16", ellipse->xx_q16);
    app_write_int_field(write, "xy_q16", ellipse->xy_q16);
    app_write_int_field(write, "yy_q16", ellipse->yy_q16);
    app_write_int_field(write, "shape_q16", ellipse->shape_q16);
    app_write_int_field(write, "ratio_q16", ellipse->ratio_q16);
    app_write_close(write, '}');
}

static void write_nest(struct app_write *write, const struct ih_nest *nest)
{
    app_write_open(write, '{');
    app_write_int_field(write, "minimum_x_q9", nest->minimum.x_q9);
    app_write_int_field(write, "minimum_y_q9", nest->minimum.y_q9);
    app_write_int_field(write, "nearest_mm_q8", nest->nearest_mm_q8);
    app_write_int_field(write, "front_mm_q8", nest->front_mm_q8);
    app_write_key(write, "slice");
    app_write_open(write, '[');
    for (int32_t i = 0; i < nest->slice_count; i++) {
        write_slice(write, &nest->slice[i]);
    }
    app_write_close(write, ']');
    app_write_close(write, '}');
}

static void write_hypotheses(struct app_write *write, const struct ih_nests *nests)
{
    app_write_key(write, "hypotheses");
    app_write_open(write, '{');
    app_write_int_field(write, "minima_dropped", nests->minima_dropped);
    app_write_int_field(write, "contours_dropped", nests->contours_dropped);
    app_write_key(write, "nest");
    app_write_open(write, '[');
    for (int32_t i = 0; i < nests->nest_count; i++) {
        write_nest(write, &nests->nest[i]);
    }
    app_write_close(write, ']');
    app_write_close(write, '}');
}

static void write_outline(struct app_write *write, const struct ih_outline *outline)
{
    app_write_key(write, "outline");
    app_write_open(write, '{');
    app_write_int_field(write, "inside", outline->inside);
    app_write_int_field(write, "above", outline->above);
    app_write_int_field(write, "above_behind", outline->above_behind);
    app_write_int_field(write, "beside", outline->beside);
    app_write_int_field(write, "beside_behind", outline->beside_behind);
    app_write_int_field(write, "below", outline->below);
    app_write_int_field(write, "below_near", outline->below_near);
    app_write_close(write, '}');
}

static void write_candidate(struct app_write *write, const struct ih_hypothesis *hypothesis)
{
    app_write_open(write, '{');
    app_write_int_field(write, "nest", hypothesis->nest);
    app_write_int_field(write, "u_px_q12", hypothesis->u_px_q12);
    app_write_int_field(write, "v_px_q12", hypothesis->v_px_q12);
    app_write_int_field(write, "a_px_q12", hypothesis->a_px_q12);
    app_write_int_field(write, "b_px_q12", hypothesis->b_px_q12);
    app_write_int_field(write, "angle_mdeg", hypothesis->angle_mdeg);
    app_write_int_field(write, "distance_mm_q8", hypothesis->distance_mm_q8);
    write_column(write, "centre_mm_q8", hypothesis->centre_mm_q8, 3,
                 sizeof hypothesis->centre_mm_q8[0]);
    app_write_int_field(write, "area_mm2", hypothesis->area_mm2);
    app_write_int_field(write, "curvature_mm_q8", hypothesis->curvature_mm_q8);
    app_write_int_field(write, "extent_mm_q8", hypothesis->extent_mm_q8);
    app_write_int_field(write, "upright_q16", hypothesis->upright_q16);
    write_outline(write, &hypothesis->outline);
    app_write_key(write, "rejected");
    app_write_string_or_null(write, ih_reject_text(hypothesis->rejected));
    app_write_close(write, '}');
}

/* What the tests of hypotheses compare with. */
static void write_limits(struct app_write *write, const struct ih_hypotheses_params *params)
{
    app_write_key(write, "limits");
    app_write_open(write, '{');
    app_write_int_field(write, "area_min_mm2", params->area_min_mm2);
    app_write_int_field(write, "area_max_mm2", params->area_max_mm2);
    app_write_int_field(write, "curvature_min_mm", params->curvature_min_mm);
    app_write_int_field(write, "curvature_max_mm", params->curvature_max_mm);
    app_write_int_field(write, "extent_min_mm", params->extent_min_mm);
    app_write_int_field(write, "upright_min_q16", params->upright_min_q16);
    app_write_int_field(write, "points_min", params->points_min);
    app_write_int_field(write, "above_min_percent", params->above_min_percent);
    app_write_int_field(write, "beside_min_percent", params->beside_min_percent);
    app_write_int_field(write, "below_min_percent", params->below_min_percent);
    app_write_close(write, '}');
}

static void write_heads(struct app_write *write, const struct ih_hypotheses *hypotheses,
                        const struct ih_hypotheses_params *params)
{
    app_write_key(write, "heads");
    app_write_open(write, '{');
    app_write_key(write, "hypothesis");
    app_write_open(write, '[');
    for (int32_t i = 0; i < hypotheses->hypothesis_count; i++) {
        write_candidate(write, &hypotheses->hypothesis[i]);
    }
    app_write_close(write, ']');
    write_column(write, "head", hypotheses->head, hypotheses->head_count,
                 sizeof hypotheses->head[0]);
    write_limits(write, params);
    app_write_close(write, '}');
}

/* Why a detection has its log-odds. */
struct reasons {
    int32_t view; /* whose rays */
    struct ih_surroundings surroundings;
    int32_t answer_q8[IH_SURROUNDINGS_MAPS];
    struct ih_score score;
};

static struct reasons reasons_of(const struct ih_rays *rays, int32_t view,
                                 const struct ih_detection *detection)
{
    struct reasons reasons;
    reasons.view = view;
    ih_surroundings_find(&rays[view], &detection->head, &reasons.surroundings);
    ih_surroundings_ask(&reasons.surroundings, reasons.answer_q8);
    ih_score_rate(&detection->evidence, reasons.answer_q8, &reasons.score);
    return reasons;
}

/* By the rays that it was measured by, which give its log-odds: not those of another window of a depth image, nor of lines
 * that have moved since. False where there are none. */
static bool find_reasons(const struct ih_rays *rays, int32_t rays_count,
                         const struct ih_detection *detection, struct reasons *out)
{
    for (int32_t i = 0; i < rays_count; i++) {
        *out = reasons_of(rays, i, detection);
        if (out->score.logit_q10 == detection->logit_q10) {
            return true;
        }
    }
    return false;
}

static void write_reasons(struct app_write *write, const struct reasons *reasons)
{
    write_column(write, "part_q10", reasons->score.part_q10, IH_SCORE_PARTS, sizeof(int32_t));
    write_column(write, "answer_q8", reasons->answer_q8, IH_SURROUNDINGS_MAPS, sizeof(int32_t));
    app_write_key(write, "surroundings");
    app_write_open(write, '{');
    app_write_int_field(write, "view", reasons->view);
    app_write_int_field(write, "weight_q12", reasons->surroundings.weight_q12);
    app_write_key(write, "place");
    app_write_open(write, '[');
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        app_write_int(write, reasons->surroundings.place[slot]);
    }
    app_write_close(write, ']');
    app_write_close(write, '}');
}

/* The rays of each view of the frame: of the dots, or of each window of a depth image. They are made anew, for later
 * stages have used the memory of those of the frame. Returns how many there are. */
static int32_t make_rays(const struct isohead *head, const struct ih_frame *view,
                         struct ih_rays rays[IH_WINDOWS_MAX])
{
    const struct ih_rays_params *params = &head->params.detections.rays;
    if (head->rig.calibration.kind == IH_RIG_DOTS) {
        ih_rays_make(&head->points, &head->dots, &head->rig, params, &rays[0]);
        return 1;
    }
    struct ih_points points;
    int32_t count = 0;
    for (int32_t i = 0; i < head->windows.window_count; i++) {
        if (ih_points_from_range(view, &head->rig, &head->params.points, &head->windows.window[i],
                                 &points) == IH_OK) {
            ih_rays_make(&points, NULL, &head->rig, params, &rays[count++]);
        }
    }
    return count;
}

static void write_detection(struct app_write *write, const struct ih_rays *rays, int32_t rays_count,
                            const struct ih_detection *detection, const struct ih_verdict *verdict,
                            bool is_predicted)
{
    struct reasons reasons;
    app_write_open(write, '{');
    write_column(write, "centre_mm_q8", detection->head.centre_mm_q8, 3, sizeof(int32_t));
    write_column(write, "semi_mm_q8", detection->head.semi_mm_q8, 3, sizeof(int32_t));
    app_write_int_field(write, "source", detection->source);
    app_write_int_field(write, "track", verdict->track_id);
    app_write_key(write, "predicted");
    app_write_bool(write, is_predicted);
    app_write_key(write, "head");
    app_write_bool(write, verdict->is_head);
    app_write_int_field(write, "logit_q10", verdict->logit_q10);
    app_write_int_field(write, "probability_q16", verdict->probability_q16);
    write_column(write, "evidence_q8", detection->evidence.value_q8, IH_EVIDENCE_COUNT,
                 sizeof(int32_t));
    app_write_int_field(write, "through_count", detection->evidence.view.through);
    app_write_int_field(write, "hit_count", detection->evidence.view.hit);
    app_write_int_field(write, "front_count", detection->evidence.view.front);
    app_write_int_field(write, "sigma_mm_q8", verdict->sigma_mm_q8);
    app_write_int_field(write, "u_px_q12", detection->u_px_q12);
    app_write_int_field(write, "v_px_q12", detection->v_px_q12);
    app_write_int_field(write, "a_px_q12", detection->a_px_q12);
    app_write_int_field(write, "b_px_q12", detection->b_px_q12);
    app_write_int_field(write, "angle_mdeg", detection->angle_mdeg);
    app_write_int_field(write, "distance_mm_q8", detection->distance_mm_q8);
    if (!is_predicted && find_reasons(rays, rays_count, detection, &reasons)) {
        write_reasons(write, &reasons);
    }
    app_write_close(write, '}');
}

static const char *const evidence_name[] = {
    "on", "rough", "bulge", "tall", "moved", "bend_down", "bend_across", "distance",
};

_Static_assert(sizeof evidence_name / sizeof evidence_name[0] == IH_EVIDENCE_COUNT,
               "every kind has a name");

static void write_rays(struct app_write *write, const struct ih_rays *rays)
{
    const struct ih_ray *ray = rays->ray;
    app_write_open(write, '{');
    write_column(write, "origin_mm_q8", rays->origin_mm_q8, 3, sizeof(int32_t));
    app_write_int_field(write, "pitch_q20", rays->table.pitch_q20);
    write_column(write, "slope_x_q20", &ray->slope_x_q20, IH_SLOTS, sizeof *ray);
    write_column(write, "slope_y_q20", &ray->slope_y_q20, IH_SLOTS, sizeof *ray);
    write_column(write, "x_mm_q8", &ray->point_mm_q8[0], IH_SLOTS, sizeof *ray);
    write_column(write, "y_mm_q8", &ray->point_mm_q8[1], IH_SLOTS, sizeof *ray);
    write_column(write, "z_mm_q8", &ray->point_mm_q8[2], IH_SLOTS, sizeof *ray);
    write_column(write, "state", &ray->state, IH_SLOTS, sizeof *ray);
    app_write_close(write, '}');
}

static void write_detections(struct app_write *write, const struct isohead *head,
                             const struct ih_frame *view)
{
    const int32_t count = head->detections.detection_count;
    struct ih_rays rays[IH_WINDOWS_MAX];
    const int32_t rays_count = make_rays(head, view, rays);
    app_write_key(write, "rays");
    app_write_open(write, '[');
    for (int32_t i = 0; i < rays_count; i++) {
        write_rays(write, &rays[i]);
    }
    app_write_close(write, ']');
    app_write_key(write, "evidence");
    app_write_open(write, '[');
    for (int kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
        app_write_string(write, evidence_name[kind]);
    }
    app_write_close(write, ']');
    app_write_key(write, "findings");
    app_write_open(write, '[');
    for (int32_t i = 0; i < count + head->predicted.count; i++) {
        const struct ih_verdict verdict = ih_tracks_verdict(&head->tracks, &head->detections, i);
        write_detection(write, rays, rays_count,
                        ih_tracks_head(&head->detections, &head->predicted, i), &verdict,
                        i >= count);
    }
    app_write_close(write, ']');
}

/* Indices of detections, or with the paper's method alone of heads.hypothesis. */
static void write_result(struct app_write *write, const struct isohead *head)
{
    const struct ih_result *result = &head->result;
    app_write_key(write, "result");
    app_write_open(write, '{');
    app_write_key(write, "paper");
    app_write_bool(write, head->params.is_paper);
    write_column(write, "head", result->head, result->head_count, sizeof result->head[0]);
    app_write_key(write, "selected");
    if (result->selected == IH_NONE) {
        app_write_null(write);
    } else {
        app_write_int(write, result->selected);
    }
    app_write_close(write, '}');
}

static void take_text(void *file, const char *text, size_t length)
{
    fwrite(text, 1, length, file); /* an error stays in the file */
}

void sim_trace_write(struct app_write *write, const struct hal_frame *frame,
                     const struct ih_frame *view, struct isohead *head)
{
    app_write_open(write, '{');
    app_write_key(write, "file");
    app_write_string(write, frame->name);
    app_write_int_field(write, "time_us", frame->time_us);
    write_level(write, &head->rig);
    write_dots(write, &head->dots);
    write_labels(write, &head->labels);
    write_points(write, &head->points);
    write_samples(write, &head->samples, &head->surface);
    write_surface(write, &head->surface);
    sim_trace_contours(write, head);
    write_hypotheses(write, &head->nests);
    write_heads(write, &head->hypotheses, &head->params.hypotheses);
    write_detections(write, head, view);
    write_result(write, head);
    app_write_close(write, '}');
    app_write_line_end(write);
}

static bool fail(struct hal_error *error, const char *path)
{
    snprintf(error->text, sizeof error->text, "trace %.150s: %s", path, strerror(errno));
    return false;
}

/* The folders above the last part of the path, which is changed meanwhile. */
static void make_parents(char *path)
{
    for (char *slash = strchr(path + 1, '/'); slash != NULL; slash = strchr(slash + 1, '/')) {
        *slash = 0;
        /* Whether it worked shows when the file is opened. */
        (void)mkdir(path, 0777);
        *slash = '/';
    }
}

char *sim_trace_folder(const struct sim_trace *trace)
{
    return hal_file_join(trace->out, trace->label);
}

/* OUT/LABEL/FRAME.json in new memory. */
static char *make_path(const struct sim_trace *trace, const char *name)
{
    size_t size = strlen(trace->out) + strlen(trace->label) + trace->stem_length + sizeof "//.json";
    char *path = malloc(size);
    if (path != NULL) {
        snprintf(path, size, "%s/%s/%.*s.json", trace->out, trace->label, (int)trace->stem_length,
                 name);
    }
    return path;
}

bool sim_trace_prepare(const struct sim_trace *trace, struct hal_error *error)
{
    char *path = make_path(trace, "");
    if (path == NULL) {
        return fail(error, trace->label);
    }
    make_parents(path);
    *strrchr(path, '/') = 0;
    DIR *folder = opendir(path);
    bool good = folder != NULL && access(path, W_OK | X_OK) == 0;
    if (!good) {
        fail(error, path);
    }
    if (folder != NULL) {
        closedir(folder);
    }
    free(path);
    return good;
}

bool sim_trace_frame(const struct sim_trace *trace, const struct hal_frame *frame,
                     const struct ih_frame *view, struct isohead *head, struct hal_error *error)
{
    char *path = make_path(trace, frame->name);
    if (path == NULL) {
        return fail(error, frame->name);
    }
    make_parents(path);
    FILE *file = fopen(path, "w");
    bool good = file != NULL;
    if (good) {
        struct app_write write = {.take = take_text, .context = file};
        sim_trace_write(&write, frame, view, head);
        good = !ferror(file);
        /* Closing writes what is buffered, so it can fail too; it must be done in any case. */
        good = fclose(file) == 0 && good;
    }
    if (!good) {
        fail(error, path);
    }
    free(path);
    return good;
}
