#include "sim_image.h"

#include <stdlib.h>
#include <turbojpeg.h>

#include "sim_report.h"

/* Dots are still points, and dark places may be brightened; most of the noise is gone. */
#define QUALITY 80
/* Near is not white, so that lines show on it; the farthest that was measured is not yet black. */
#define DEPTH_LEVEL_MAX 170
#define DEPTH_LEVEL_MIN 40

static int32_t sample_at(const struct ih_frame *frame, int32_t x, int32_t y)
{
    const uint8_t *row = (const uint8_t *)frame->samples + (size_t)y * (size_t)frame->stride_bytes;
    return frame->bytes_per_sample == 1 ? row[x] : ((const uint16_t *)(const void *)row)[x];
}

/* The mean of a square of pixels. At most 16 of 16 bits. */
static uint8_t camera_level(const struct ih_frame *frame, int32_t x, int32_t y, int32_t factor)
{
    int64_t sum = 0;
    for (int32_t dy = 0; dy < factor; dy++) {
        for (int32_t dx = 0; dx < factor; dx++) {
            sum += sample_at(frame, x * factor + dx, y * factor + dy);
        }
    }
    int64_t level = sum * 255 / ((int64_t)factor * factor * frame->maximum);
    return (uint8_t)(level > 255 ? 255 : level);
}

/* No mean: depths are not mixed with what was not measured. */
static uint8_t depth_level(const struct ih_frame *frame, const struct ih_calibration *rig,
                           int32_t x, int32_t y)
{
    int32_t depth_mm = sample_at(frame, x, y);
    if (depth_mm == 0) {
        return 0;
    }
    depth_mm = depth_mm < rig->near_mm ? rig->near_mm : depth_mm;
    depth_mm = depth_mm > rig->far_mm ? rig->far_mm : depth_mm;
    int32_t range_mm = rig->far_mm - rig->near_mm;
    int64_t darker = (int64_t)(DEPTH_LEVEL_MAX - DEPTH_LEVEL_MIN) * (depth_mm - rig->near_mm);
    return (uint8_t)(DEPTH_LEVEL_MAX - darker / range_mm);
}

bool sim_image_encode(struct sim_image *image, const struct ih_frame *frame,
                      const struct ih_rig *rig, struct hal_error *error)
{
    int32_t factor = (frame->width + SIM_IMAGE_WIDTH_MAX - 1) / SIM_IMAGE_WIDTH_MAX;
    int32_t width = frame->width / factor;
    int32_t height = frame->height / factor;
    image->grey = sim_report_grow(image->grey, (size_t)width * (size_t)height, 1);
    for (int32_t y = 0; y < height; y++) {
        for (int32_t x = 0; x < width; x++) {
            image->grey[(size_t)y * (size_t)width + (size_t)x] =
                rig->calibration.kind == IH_RIG_RANGE
                    ? depth_level(frame, &rig->calibration, x * factor, y * factor)
                    : camera_level(frame, x, y, factor);
        }
    }
    if (image->handle == NULL) {
        image->handle = tjInitCompress();
    }
    unsigned long size = tjBufSize(width, height, TJSAMP_GRAY);
    if (size > image->jpeg_capacity) {
        image->jpeg_capacity = size;
        image->jpeg = sim_report_grow(image->jpeg, size, 1);
    }
    if (image->handle == NULL ||
        tjCompress2(image->handle, image->grey, width, 0, height, TJPF_GRAY, &image->jpeg, &size,
                    TJSAMP_GRAY, QUALITY, TJFLAG_NOREALLOC | TJFLAG_PROGRESSIVE) != 0) {
        return hal_fail(error, "its image for the report: %s", tjGetErrorStr2(image->handle));
    }
    image->jpeg_size = size;
    return true;
}

void sim_image_free(struct sim_image *image)
{
    if (image->handle != NULL) {
        tjDestroy(image->handle);
    }
    free(image->grey);
    free(image->jpeg);
    *image = (struct sim_image){.grey = NULL};
}
