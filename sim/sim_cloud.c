#include "sim_cloud.h"

#include <inttypes.h>
#include <stdlib.h>

#include "app_view.h"
#include "sim_report.h"
#include "points/ih_cloud.h"

static bool draw(struct sim_cloud *cloud, const struct hal_frame *frame, const struct ih_rig *rig,
                 struct hal_error *error)
{
    const struct ih_calibration *c = &rig->calibration;
    struct ih_cloud count;
    size_t pixels = (size_t)c->width * (size_t)c->height;
    if (cloud->depth_mm == NULL) {
        cloud->depth_mm = sim_report_grow(NULL, pixels, sizeof *cloud->depth_mm);
    }
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
