#include "app_view.h"

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
