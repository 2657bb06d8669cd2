#include "app_view.h"

#include "hal_text.h"

struct ih_frame app_view_of(const struct hal_frame *frame)
{
    return (struct ih_frame){
        .samples = frame->samples,
        .width = frame->width,
        .height = frame->height,
        .stride_bytes = frame->stride_bytes,
        .bytes_per_sample = frame->bytes_per_sample,
        .maximum = frame->maximum,
    };
}

static void put_size(struct hal_text *text, int32_t width, int32_t height)
{
    hal_text_put_number(text, width, 1);
    hal_text_put(text, "x");
    hal_text_put_number(text, height, 1);
}

void app_view_explain(const struct hal_frame *frame, const struct ih_calibration *calibration,
                      enum ih_err err, struct hal_error *error)
{
    const struct ih_calibration *rig = calibration;
    struct hal_text text = hal_text_begin(error->text, sizeof error->text);
    if (frame->width != rig->width || frame->height != rig->height) {
        put_size(&text, frame->width, frame->height);
        hal_text_put(&text, " px, expected ");
        put_size(&text, rig->width, rig->height);
        hal_text_put(&text, " as in the rig");
    } else if (err == IH_ERR_KIND && rig->kind == IH_RIG_RANGE) {
        hal_text_put(&text, "maxval ");
        hal_text_put_number(&text, frame->maximum, 1);
        hal_text_put(&text, ", expected above 255: a range image has two bytes per pixel");
    } else {
        hal_text_put(&text, ih_err_text(err));
    }
}
