#include "sim_cloud.h"

#include <inttypes.h>
#include <stddef.h>
#include <stdlib.h>

#include "app_rig.h"
#include "app_view.h"
#include "sim_report.h"
#include "points/ih_cloud.h"

static void reserve(struct sim_cloud *cloud, const struct ih_rig *rig)
{
    size_t pixels = (size_t)rig->calibration.width * (size_t)rig->calibration.height;
    if (cloud->depth_mm == NULL) {
        cloud->depth_mm = sim_report_grow(NULL, pixels, sizeof *cloud->depth_mm);
    }
}

/* Depths in units to mm, rounded; what is beyond 16 bits stays as far as they go. */
static void scale(struct sim_cloud *cloud, struct ih_frame *view)
{
    uint16_t *depth_mm = cloud->depth_mm;
    for (int32_t v = 0; v < view->height; v++) {
        const uint16_t *depth =
            (const void *)((const uint8_t *)view->samples + (ptrdiff_t)v * view->stride_bytes);
        for (int32_t u = 0; u < view->width; u++) {
            int64_t mm = ((int64_t)depth[u] * cloud->scale_q20 + APP_RIG_SCALE_ONE / 2) >> 20;
            *depth_mm++ = (uint16_t)(mm < UINT16_MAX ? mm : UINT16_MAX);
        }
    }
    view->stride_bytes = view->width * (int32_t)sizeof *depth_mm;
    view->samples = cloud->depth_mm;
    view->maximum = UINT16_MAX;
}

static bool draw(struct sim_cloud *cloud, const struct hal_frame *frame, const struct ih_rig *rig,
                 struct hal_error *error)
{
    const struct ih_calibration *c = &rig->calibration;
    struct ih_cloud count;
    reserve(cloud, rig);
    enum ih_err err =
        ih_cloud_draw(frame->point_mm_q8, frame->point_count, rig, cloud->depth_mm, &count);
    if (err != IH_OK) {
        return hal_fail(error, "%s", ih_err_text(err));
    }
    if (frame->point_count > 0 && count.drawn == 0) {
        return hal_fail(
            error,
            "none of %" PRId32 " points can be seen: %" PRId32 " are nearer than %" PRId32
            " mm, %" PRId32 " farther than %" PRId32 " mm, %" PRId32 " beside the image",
            frame->point_count, count.near, c->near_mm, count.far, c->far_mm, count.outside);
    }
    return true;
}

bool sim_cloud_view(struct sim_cloud *cloud, const struct hal_frame *frame,
                    const struct ih_rig *rig, struct ih_frame *view, struct hal_error *error)
{
    *view = app_view_of(frame);
    if (frame->samples != NULL) {
        /* What the core refuses is left as it is. */
        bool is_depth = frame->bytes_per_sample == 2 && frame->width == rig->calibration.width &&
                        frame->height == rig->calibration.height;
        if (is_depth && cloud->scale_q20 != APP_RIG_SCALE_ONE) {
            reserve(cloud, rig);
            scale(cloud, view);
        }
        return true;
    }
    if (!draw(cloud, frame, rig, error)) {
        return false;
    }
    view->samples = cloud->depth_mm;
    view->width = rig->calibration.width;
    view->height = rig->calibration.height;
    view->bytes_per_sample = (int32_t)sizeof *cloud->depth_mm;
    view->stride_bytes = view->width * view->bytes_per_sample;
    view->maximum = UINT16_MAX;
    return true;
}

void sim_cloud_free(struct sim_cloud *cloud)
{
    free(cloud->depth_mm);
    cloud->depth_mm = NULL;
}
