#include "isohead.h"

#include <stddef.h>
#include <string.h>

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
    }
    return "unknown error";
}

void ih_params_default(struct ih_params *params)
{
    ih_dots_params_default(&params->dots);
    ih_labels_params_default(&params->labels);
    ih_windows_params_default(&params->windows);
    ih_points_params_default(&params->points);
    ih_samples_params_default(&params->samples);
    ih_surface_params_default(&params->surface);
    ih_hypotheses_params_default(&params->hypotheses);
    ih_heads_params_default(&params->heads);
}

enum ih_err isohead_init(struct isohead *head, const struct ih_calibration *calibration,
                         int32_t *bad_slot)
{
    memset(head, 0, sizeof *head);
    ih_params_default(&head->params);
    enum ih_err err = ih_rig_init(&head->rig, calibration, bad_slot);
    if (err != IH_OK) {
        memset(&head->rig, 0, sizeof head->rig); /* no frame has the size of this rig */
    }
    return err;
}

static enum ih_err check_frame(const struct ih_frame *frame, const struct ih_calibration *c)
{
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

static void clear_outputs(struct isohead *head)
{
    size_t first = offsetof(struct isohead, dots);
    memset((uint8_t *)head + first, 0, offsetof(struct isohead, scratch) - first);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        head->labels.dot_of_slot[slot] = IH_NONE;
    }
}

enum ih_err isohead_frame(struct isohead *head, const struct ih_frame *frame)
{
    const struct ih_rig *rig = &head->rig;
    const struct ih_params *params = &head->params;
    enum ih_err err = check_frame(frame, &rig->calibration);
    clear_outputs(head);
    if (err != IH_OK) {
        return err;
    }
    bool range = rig->calibration.kind == IH_RIG_RANGE;
    if (range) {
        err = ih_windows_find(frame, rig, &params->windows, &head->scratch.windows, &head->windows);
        if (err != IH_OK || head->windows.window_count == 0) {
            return err;
        }
        err = ih_points_from_range(frame, rig, &params->points, &head->windows.window[0],
                                   &head->points);
        if (err != IH_OK) {
            return err;
        }
    } else {
        ih_dots_find(frame, &params->dots, &head->scratch.dots, &head->dots);
        ih_labels_assign(&head->dots, rig, &params->labels, &head->scratch.labels, &head->labels);
        ih_points_from_labels(&head->labels, rig, &head->points);
    }
    ih_samples_select(&head->points, range ? NULL : &head->dots, rig, &params->samples,
                      &head->samples);
    ih_surface_fit(&head->samples, &head->points.field, &params->surface, &head->scratch.surface,
                   &head->surface);
    ih_hypotheses_find(&head->surface, &params->hypotheses, &head->scratch.hypotheses,
                       &head->hypotheses);
    ih_heads_select(&head->hypotheses, &head->surface, &head->samples, rig, &params->heads,
                    &head->heads);
    return IH_OK;
}
