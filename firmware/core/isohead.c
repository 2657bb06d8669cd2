#include "isohead.h"

#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"

_Static_assert(sizeof(struct isohead) <= IH_RAM_MAX, "the state no longer fits its budget");

const char *ih_err_text(enum ih_err err)
{
    switch (err) {
    case IH_OK:
        return "no error";
    case IH_ERR_SIZE:
        return "size out of bounds, or not the rig's";
    case IH_ERR_FOCAL:
        return "focal length out of bounds";
    case IH_ERR_PRINCIPAL:
        return "field of view out of bounds";
    case IH_ERR_DISTORTION:
        return "lens distortion that cannot be undone within the frame";
    case IH_ERR_RANGE:
        return "near and far out of order or out of bounds";
    case IH_ERR_BASELINE:
        return "projector on the camera's centre, or too far from it";
    case IH_ERR_RAY:
        return "dot ray that is not a unit vector pointing forward";
    case IH_ERR_KIND:
        return "frame of another kind than the rig";
    case IH_ERR_NOT_POSITIVE:
        return "matrix that is not positive definite";
    case IH_ERR_BLOB_SHORT:
        return "rig blob that is too short";
    case IH_ERR_BLOB_LONG:
        return "rig blob with bytes after its end";
    case IH_ERR_BLOB_MAGIC:
        return "no rig blob: it does not begin with IHRB";
    case IH_ERR_BLOB_VERSION:
        return "rig blob of another version";
    case IH_ERR_BLOB_LENGTH:
        return "rig blob of a length that its version does not have";
    case IH_ERR_BLOB_CRC:
        return "rig blob whose bytes have changed: its CRC-32 does not fit";
    case IH_ERR_BLOB_FIELD:
        return "rig blob of an unknown kind, or of a range rig with a projector";
    case IH_ERR_UP:
        return "up that is no unit vector, or along the optical axis";
    }
    return "unknown error";
}

void ih_params_default(struct ih_params *params)
{
    params->is_paper = false;
    ih_dots_params_default(&params->dots);
    ih_labels_params_default(&params->labels);
    ih_windows_params_default(&params->windows);
    ih_points_params_default(&params->points);
    ih_samples_params_default(&params->samples);
    ih_surface_params_default(&params->surface);
    ih_nests_params_default(&params->nests);
    ih_hypotheses_params_default(&params->hypotheses);
    ih_detections_params_default(&params->detections);
    ih_tracks_params_default(&params->tracks);
    ih_pose_params_default(&params->pose);
}

void ih_params_paper(struct ih_params *params)
{
    ih_params_default(params);
    params->is_paper = true;
    params->surface.centres = IH_SURFACE_CENTRES_MAX;
    params->surface.is_moving = false;
    ih_nests_params_paper(&params->nests);
}

/* The outputs of the stages after labels are those of an empty frame. */
static void clear_found(struct isohead *head)
{
    memset(&head->expected, 0, sizeof head->expected);
    memset(&head->windows, 0, sizeof head->windows);
    memset(&head->points, 0, sizeof head->points);
    memset(&head->samples, 0, sizeof head->samples);
    memset(&head->surface, 0, sizeof head->surface);
    memset(&head->nests, 0, sizeof head->nests);
    memset(&head->hypotheses, 0, sizeof head->hypotheses);
    memset(&head->detections, 0, sizeof head->detections);
    memset(&head->predicted, 0, sizeof head->predicted);
    ih_result_clear(&head->result);
}

/* The outputs of all stages are those of an empty frame. */
static void clear_outputs(struct isohead *head)
{
    memset(&head->dots, 0, sizeof head->dots);
    memset(&head->labels, 0, sizeof head->labels);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        head->labels.dot_of_slot[slot] = IH_NONE;
    }
    clear_found(head);
}

enum ih_err isohead_init(struct isohead *head, const struct ih_calibration *calibration,
                         int32_t *bad_slot)
{
    memset(head, 0, sizeof *head);
    ih_params_default(&head->params);
    ih_tracks_init(&head->tracks);
    clear_outputs(head);
    enum ih_err err = ih_rig_init(&head->rig, calibration, bad_slot);
    if (err != IH_OK) {
        memset(&head->rig, 0, sizeof head->rig); /* no frame has the size of this rig */
    } else if (calibration->kind == IH_RIG_DOTS) {
        ih_align_init(&head->align, &head->rig);
    }
    return err;
}

static enum ih_err check_frame(const struct ih_frame *frame, const struct ih_calibration *c)
{
    if (frame == NULL) {
        return IH_ERR_SIZE;
    }
    int32_t bytes = frame->bytes_per_sample;
    if (bytes != 1 && bytes != 2) {
        return IH_ERR_KIND;
    }
    if (c->kind == IH_RIG_RANGE && bytes != 2) {
        return IH_ERR_KIND;
    }
    bool maximum_ok = c->kind == IH_RIG_RANGE ||
                      (frame->maximum >= 1 && frame->maximum <= (bytes == 1 ? 255 : 65535));
    bool aligned =
        (uintptr_t)frame->samples % (uintptr_t)bytes == 0 && frame->stride_bytes % bytes == 0;
    if (frame->samples == NULL || frame->width < 1 || frame->width != c->width ||
        frame->height != c->height || frame->stride_bytes < frame->width * bytes || !aligned ||
        !maximum_ok) {
        return IH_ERR_SIZE;
    }
    return IH_OK;
}

/* From points to hypotheses: the paper's method. */
static void find_nests(struct isohead *head, const struct ih_dots *dots)
{
    const struct ih_rig *rig = &head->rig;
    const struct ih_params *params = &head->params;
    ih_samples_select(&head->points, dots, rig, &params->samples, &head->samples);
    ih_surface_fit(&head->samples, &head->points.field, &params->surface, &head->scratch.surface,
                   &head->surface);
    ih_nests_find(&head->surface, &params->nests, &head->scratch.nests, &head->nests);
    ih_hypotheses_select(&head->nests, &head->surface, &head->samples, rig, &params->hypotheses,
                         &head->hypotheses);
}

/* From points to detections; the paper's method alone has none. */
static void look(struct isohead *head, const struct ih_dots *dots)
{
    find_nests(head, dots);
    if (!head->params.is_paper) {
        ih_detections_add(&head->points, dots, &head->hypotheses, &head->expected, &head->rig,
                          &head->params.detections, &head->scratch.detections, &head->detections);
    }
}

/* The best window comes last, so that the stages' outputs are those of this window. */
static enum ih_err look_at_windows(struct isohead *head, const struct ih_frame *frame)
{
    const struct ih_params *params = &head->params;
    enum ih_err err = ih_windows_find(frame, &head->rig, &params->windows, &head->scratch.windows,
                                      &head->windows);
    int32_t count = head->windows.window_count;
    if (params->is_paper && count > 1) {
        count = 1;
    }
    for (int32_t i = count - 1; i >= 0 && err == IH_OK; i--) {
        err = ih_points_from_range(frame, &head->rig, &params->points, &head->windows.window[i],
                                   &head->points);
        if (err == IH_OK) {
            look(head, NULL);
        }
    }
    return err;
}

/* Empty lists, and the heads that the tracks expect; the paper's method expects none. */
static void begin(struct isohead *head, int64_t time_us)
{
    head->expected.count = 0;
    head->expected.last_sure_count = 0;
    ih_detections_begin(&head->detections);
    head->predicted.count = 0;
    if (!head->params.is_paper) {
        ih_tracks_expect(&head->tracks, &head->params.tracks, time_us, &head->expected);
    }
}

/* A rig that has moved leaves depth less certain than its tracks say. */
static void widen_sigma(struct isohead *head)
{
    const bool is_moved = head->align.now.state == IH_ALIGN_MOVED;
    for (int32_t i = 0; i < head->result.entry_count && is_moved; i++) {
        struct ih_result_entry *entry = &head->result.entry[i];
        const int64_t own = entry->sigma_mm_q8;
        const int64_t depth = ih_align_depth_sigma_mm_q8(&head->align, &head->rig,
                                                         ih_max_s32(entry->centre_mm_q8[2], 0));
        if (own > 0 && depth > 0) {
            entry->sigma_mm_q8 =
                (int32_t)ih_isqrt_u64((uint64_t)(own * own) + (uint64_t)(depth * depth));
        }
    }
}

/* The result of all stages. */
static void conclude(struct isohead *head)
{
    if (head->params.is_paper) {
        ih_result_from_hypotheses(&head->hypotheses, &head->rig, &head->result);
    } else {
        ih_tracks_update(&head->tracks, &head->params.tracks, &head->rig, &head->detections,
                         &head->predicted);
        ih_result_from_tracks(&head->detections, &head->tracks, &head->predicted, &head->rig,
                              &head->result);
        ih_pose_update(&head->pose, &head->params.pose, &head->points, &head->rig,
                       &head->detections, &head->predicted, &head->tracks, &head->scratch.pose,
                       &head->result);
    }
}

static enum ih_err frame_of_range(struct isohead *head, const struct ih_frame *frame,
                                  int64_t time_us)
{
    clear_outputs(head);
    enum ih_err err = check_frame(frame, &head->rig.calibration);
    if (err == IH_OK) {
        begin(head, time_us);
        err = look_at_windows(head, frame);
        conclude(head);
    }
    return err;
}

/* The paper's method alone takes the rig's file at its word. */
static void find_rows(struct isohead *head)
{
    struct ih_dot_rows *rows = &head->scratch.labels.rows;
    if (head->params.is_paper) {
        ih_dot_rows_fill(&head->dots, &head->rig, rows);
    } else {
        ih_align_find(&head->align, &head->dots, &head->rig, rows, &head->scratch.labels.at.align);
    }
}

/* Dots and labels; the other stages' outputs stay as they were. */
static enum ih_err label(struct isohead *head, const struct ih_frame *frame,
                         const struct ih_frame *ambient)
{
    const struct ih_params *params = &head->params;
    enum ih_err err = check_frame(frame, &head->rig.calibration);
    if (err == IH_OK && ambient != NULL) {
        err = check_frame(ambient, &head->rig.calibration);
    }
    if (err == IH_OK) {
        ih_dots_find(frame, ambient, &params->dots, &head->scratch.dots, &head->dots);
        find_rows(head);
        ih_labels_assign(&head->dots, &head->scratch.labels.rows, &head->rig, &params->labels,
                         &head->scratch.labels.at.labels, &head->labels);
    }
    return err;
}

enum ih_err isohead_label(struct isohead *head, const struct ih_frame *frame,
                          const struct ih_frame *ambient)
{
    const bool is_range = head->rig.calibration.kind == IH_RIG_RANGE;
    const enum ih_err err = is_range ? IH_ERR_KIND : label(head, frame, ambient);
    if (err == IH_OK) {
        clear_found(head);
    } else {
        clear_outputs(head);
    }
    return err;
}

void isohead_find(struct isohead *head, int64_t time_us)
{
    const struct ih_calibration *c = &head->rig.calibration;
    if (c->kind == IH_RIG_RANGE || c->width == 0) {
        return; /* isohead_label or isohead_init was refused: the outputs are cleared, and no line is set */
    }
    if (head->align.is_depth_new) { /* tracks have the depths of another rig */
        ih_tracks_forget(&head->tracks);
        head->align.is_depth_new = false;
    }
    begin(head, time_us);
    ih_points_from_labels(&head->labels, &head->rig, &head->points);
    look(head, &head->dots);
    conclude(head);
    if (!head->params.is_paper) {
        widen_sigma(head);
        ih_align_learn(&head->align, &head->labels, &head->rig, &head->scratch.labels.at.align);
    }
}

/* A frame of dots needs no clearing: each stage sets its own outputs, and windows has none. */
enum ih_err isohead_frame(struct isohead *head, const struct ih_frame *frame,
                          const struct ih_frame *ambient, int64_t time_us)
{
    if (head->rig.calibration.kind == IH_RIG_RANGE) {
        return frame_of_range(head, frame, time_us);
    }
    enum ih_err err = label(head, frame, ambient);
    if (err == IH_OK) {
        isohead_find(head, time_us);
    } else {
        clear_outputs(head);
    }
    return err;
}
