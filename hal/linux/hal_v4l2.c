#include "linux/hal_v4l2.h"

#include <errno.h>
#include <fcntl.h>
#include <libv4l2.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

#include "linux/hal_clock.h"

#define US_PER_S 1000000
#define HOLD_COUNT (HAL_CAMERA_HOLD_MAX + 1)

static int64_t now_us(void)
{
    return hal_clock.now_us(hal_clock.context);
}

static bool check_capabilities(int fd, struct hal_error *error)
{
    const uint32_t needed = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    struct v4l2_capability capability = {.driver = ""};
    if (hal_v4l2_ioctl(fd, VIDIOC_QUERYCAP, &capability) != 0) {
        return hal_fail(error, "querying its capabilities: %s", strerror(errno));
    }
    /* what this node can do, where the driver distinguishes it from what the whole device can */
    const uint32_t has = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                             ? capability.device_caps
                             : capability.capabilities;
    if ((has & needed) != needed) {
        return hal_fail(error,
                        "no camera that streams: capabilities 0x%08x, expected 0x%08x among them "
                        "(a camera's further nodes give metadata only)",
                        has, needed);
    }
    return true;
}

static bool set_controls(struct hal_v4l2 *v4l2, struct hal_error *error)
{
    const struct hal_v4l2_config *config = &v4l2->config;
    bool good = true;
    v4l2->exposure = (struct hal_v4l2_exposure){.known = false};
    if (config->exposure.mode == HAL_V4L2_AUTO) {
        good = hal_v4l2_exposure_auto(v4l2->fd, error);
    } else if (config->exposure.mode == HAL_V4L2_VALUE) {
        good = hal_v4l2_exposure_set(v4l2->fd, config->width, config->exposure.value,
                                     &v4l2->exposure, error);
    }
    if (good && config->gain.mode == HAL_V4L2_AUTO) {
        good = hal_v4l2_gain_auto(v4l2->fd, error);
    } else if (good && config->gain.mode == HAL_V4L2_VALUE) {
        good = hal_v4l2_gain_set(v4l2->fd, config->gain.value, error);
    }
    return good;
}

static bool give_buffer(const struct hal_v4l2 *v4l2, uint32_t index)
{
    struct v4l2_buffer buffer = {
        .index = index, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    return hal_v4l2_ioctl(v4l2->fd, VIDIOC_QBUF, &buffer) == 0;
}

static bool map_buffer(struct hal_v4l2 *v4l2, uint32_t index, struct hal_error *error)
{
    struct v4l2_buffer buffer = {
        .index = index, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    if (hal_v4l2_ioctl(v4l2->fd, VIDIOC_QUERYBUF, &buffer) != 0) {
        return hal_fail(error, "querying buffer %u: %s", index, strerror(errno));
    }
    if (buffer.length < v4l2->format.frame_bytes) {
        return hal_fail(error, "buffers of %u bytes, expected at least %zu for %s %dx%d",
                        buffer.length, v4l2->format.frame_bytes, v4l2->format.name,
                        v4l2->config.width, v4l2->config.height);
    }
    void *start = v4l2_mmap(NULL, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, v4l2->fd,
                            (int64_t)buffer.m.offset);
    if (start == MAP_FAILED) {
        return hal_fail(error, "mapping buffer %u: %s", index, strerror(errno));
    }
    v4l2->buffer[index] = (struct hal_v4l2_buffer){start, buffer.length};
    v4l2->buffer_count = index + 1;
    return true;
}

static bool take_buffers(struct hal_v4l2 *v4l2, struct hal_error *error)
{
    struct v4l2_requestbuffers request = {.count = HAL_V4L2_BUFFERS_REQUESTED,
                                          .type = V4L2_BUF_TYPE_VIDEO_CAPTURE,
                                          .memory = V4L2_MEMORY_MMAP};
    if (hal_v4l2_ioctl(v4l2->fd, VIDIOC_REQBUFS, &request) != 0) {
        return hal_fail(error, "requesting %d buffers: %s", HAL_V4L2_BUFFERS_REQUESTED,
                        strerror(errno));
    }
    if (request.count < HAL_V4L2_BUFFERS_MIN) {
        return hal_fail(error, "the device gives %u buffers, expected at least %d", request.count,
                        HAL_V4L2_BUFFERS_MIN);
    }
    for (uint32_t index = 0; index < request.count && index < HAL_V4L2_BUFFERS_MAX; index++) {
        if (!map_buffer(v4l2, index, error)) {
            return false;
        }
        if (!give_buffer(v4l2, index)) {
            return hal_fail(error, "queueing buffer %u: %s", index, strerror(errno));
        }
    }
    return true;
}

static bool take_images(struct hal_v4l2 *v4l2, struct hal_error *error)
{
    if (hal_pixels_is_view(v4l2->format.layout)) {
        return true;
    }
    v4l2->image_bytes = (size_t)v4l2->config.width * (size_t)v4l2->config.height *
                        (size_t)hal_pixels_sample_bytes(v4l2->format.layout);
    v4l2->images = calloc(HOLD_COUNT, v4l2->image_bytes);
    return v4l2->images != NULL || hal_fail(error, "no memory for %d images of %dx%d", HOLD_COUNT,
                                            v4l2->config.width, v4l2->config.height);
}

static bool start_stream(struct hal_v4l2 *v4l2, struct hal_error *error)
{
    enum v4l2_buf_type type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    v4l2->streaming = hal_v4l2_ioctl(v4l2->fd, VIDIOC_STREAMON, &type) == 0;
    return v4l2->streaming || hal_fail(error, "starting the stream: %s", strerror(errno));
}

/* What fails here fails because the device is gone: the rest is done all the same. */
static void close_camera(void *context)
{
    struct hal_v4l2 *v4l2 = context;
    enum v4l2_buf_type type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (v4l2->fd < 0) {
        return;
    }
    if (v4l2->streaming) {
        hal_v4l2_ioctl(v4l2->fd, VIDIOC_STREAMOFF, &type);
    }
    for (uint32_t index = 0; index < v4l2->buffer_count; index++) {
        v4l2_munmap(v4l2->buffer[index].start, v4l2->buffer[index].length);
    }
    v4l2_close(v4l2->fd);
    free(v4l2->images);
    v4l2->fd = -1;
    v4l2->streaming = false;
    v4l2->buffer_count = 0;
    v4l2->images = NULL;
    v4l2->frame_time_us = 0;
    v4l2->eio_count = 0;
    v4l2->gone = false;
    memset(v4l2->hold, 0, sizeof v4l2->hold);
}

/* What else to look at, for those who set up a board. */
static const char *hint_on(int reason)
{
    switch (reason) {
    case EACCES:
        return "; is this user in the device's group, mostly video?";
    case EBUSY:
        return "; another program has it";
    default:
        return "; expected a camera: v4l2-ctl --list-devices shows what there is";
    }
}

static bool open_camera(void *context, struct hal_error *error)
{
    struct hal_v4l2 *v4l2 = context;
    const struct hal_v4l2_config *config = &v4l2->config;
    close_camera(v4l2);
    do {
        v4l2->fd = v4l2_open(config->device, O_RDWR | O_NONBLOCK | O_CLOEXEC);
    } while (v4l2->fd < 0 && errno == EINTR);
    if (v4l2->fd < 0) {
        return hal_fail(error, "opening: %s%s", strerror(errno), hint_on(errno));
    }
    if (check_capabilities(v4l2->fd, error) &&
        hal_v4l2_format_set(v4l2->fd, config->format, config->width, config->height, &v4l2->format,
                            error) &&
        hal_v4l2_rate_set(v4l2->fd, config->rate_mhz, &v4l2->frame_time_us, error) &&
        set_controls(v4l2, error) && take_images(v4l2, error) && take_buffers(v4l2, error) &&
        start_stream(v4l2, error)) {
        return true;
    }
    close_camera(v4l2);
    return false;
}

/* Nothing more will come; *error is what next answers from now on. */
static enum hal_next go(struct hal_v4l2 *v4l2, const struct hal_error *error)
{
    v4l2->gone = true;
    v4l2->gone_error = *error;
    return HAL_NEXT_GONE;
}

/* If the driver does not take it, the next call says so. */
static void return_buffer(struct hal_v4l2 *v4l2, uint32_t index)
{
    struct hal_error error;
    if (!give_buffer(v4l2, index)) {
        hal_fail(&error, "returning buffer %u: %s", index, strerror(errno));
        go(v4l2, &error);
    }
}

/* Asked first, since libv4l2 writes every EAGAIN to standard error. An error counts as ready: the
 * ioctl says which. */
static bool is_ready(int fd)
{
    struct pollfd item = {.fd = fd, .events = POLLIN};
    return poll(&item, 1, 0) != 0;
}

static struct hal_v4l2_hold *find_hold(struct hal_v4l2 *v4l2)
{
    for (size_t k = 0; k < HOLD_COUNT; k++) {
        if (!v4l2->hold[k].used) {
            return &v4l2->hold[k];
        }
    }
    return NULL;
}

/* The number of a frame, from the driver's of 32 bits. */
static void count_frame(struct hal_v4l2 *v4l2, uint32_t driver_sequence)
{
    const uint32_t step = driver_sequence - v4l2->driver_sequence;
    if (!v4l2->counted) {
        v4l2->sequence = driver_sequence;
    } else {
        v4l2->sequence += step == 0 || step > INT32_MAX ? 1 : step;
    }
    v4l2->driver_sequence = driver_sequence;
    v4l2->counted = true;
}

static int64_t time_of(const struct v4l2_buffer *buffer)
{
    const uint32_t kind = buffer->flags & V4L2_BUF_FLAG_TIMESTAMP_MASK;
    if (kind == V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC || kind == V4L2_BUF_FLAG_TIMESTAMP_COPY) {
        return (int64_t)buffer->timestamp.tv_sec * US_PER_S + buffer->timestamp.tv_usec;
    }
    return now_us();
}

static void name_frame(struct hal_v4l2 *v4l2, char name[HAL_V4L2_NAME_MAX], int64_t time_us,
                       struct hal_frame *frame)
{
    snprintf(name, HAL_V4L2_NAME_MAX, "%06lld.pgm", (long long)v4l2->sequence);
    *frame = (struct hal_frame){
        .time_us = time_us, .sequence = v4l2->sequence, .laser = true, .name = name};
}

/* No buffer came. */
static enum hal_next judge_failure(struct hal_v4l2 *v4l2, int reason, struct hal_frame *frame,
                                   struct hal_error *error)
{
    if (reason == EAGAIN) {
        return HAL_NEXT_NONE;
    }
    hal_fail(error, "taking a frame: %s", strerror(reason));
    if (reason != EIO) {
        return go(v4l2, error);
    }
    v4l2->eio_count++;
    if (v4l2->eio_count >= HAL_V4L2_EIO_MAX) {
        hal_fail(error, "taking a frame: %s, %d times in a row", strerror(reason), v4l2->eio_count);
        return go(v4l2, error);
    }
    /* the lost frame has a number of its own, whether the driver gave it one or not */
    count_frame(v4l2, v4l2->counted ? v4l2->driver_sequence + 1 : 0);
    name_frame(v4l2, v4l2->bad_name, now_us(), frame);
    return HAL_NEXT_BAD;
}

static bool check_buffer(const struct hal_v4l2 *v4l2, const struct v4l2_buffer *buffer,
                         struct hal_error *error)
{
    if ((buffer->flags & V4L2_BUF_FLAG_ERROR) != 0) {
        return hal_fail(error, "the driver marks the frame as damaged (%u of %zu bytes)",
                        buffer->bytesused, v4l2->format.frame_bytes);
    }
    if (buffer->bytesused < v4l2->format.frame_bytes) {
        return hal_fail(error, "%u bytes, expected %zu for %s %dx%d", buffer->bytesused,
                        v4l2->format.frame_bytes, v4l2->format.name, v4l2->config.width,
                        v4l2->config.height);
    }
    return true;
}

/* A good buffer as a frame, seen where it is or decoded. */
static void hand_on(struct hal_v4l2 *v4l2, const struct v4l2_buffer *buffer,
                    struct hal_v4l2_hold *hold, struct hal_frame *frame)
{
    const struct hal_v4l2_format *format = &v4l2->format;
    const int32_t hold_index = (int32_t)(hold - v4l2->hold);
    const uint8_t *samples = v4l2->buffer[buffer->index].start;
    int32_t stride_bytes = format->stride_bytes;
    hold->used = true;
    hold->has_buffer = v4l2->images == NULL;
    hold->buffer_index = buffer->index;
    name_frame(v4l2, hold->name, time_of(buffer), frame);
    if (v4l2->images != NULL) {
        uint8_t *image = v4l2->images + (size_t)hold_index * v4l2->image_bytes;
        hal_pixels_decode(format->layout, samples, (size_t)format->stride_bytes, v4l2->config.width,
                          v4l2->config.height, image);
        return_buffer(v4l2, buffer->index);
        samples = image;
        stride_bytes = v4l2->config.width * hal_pixels_sample_bytes(format->layout);
    }
    frame->samples = samples;
    frame->width = v4l2->config.width;
    frame->height = v4l2->config.height;
    frame->stride_bytes = stride_bytes;
    frame->bytes_per_sample = hal_pixels_sample_bytes(format->layout);
    frame->maximum = format->maximum;
    frame->buffer_index = hold_index;
}

static enum hal_next next_frame(void *context, struct hal_frame *frame, struct hal_error *error)
{
    struct hal_v4l2 *v4l2 = context;
    if (v4l2->fd < 0) {
        hal_fail(error, "the camera is not open");
        return HAL_NEXT_GONE;
    }
    if (v4l2->gone) {
        *error = v4l2->gone_error;
        return HAL_NEXT_GONE;
    }
    struct hal_v4l2_hold *hold = find_hold(v4l2);
    if (hold == NULL || !is_ready(v4l2->fd)) {
        return HAL_NEXT_NONE;
    }
    struct v4l2_buffer buffer = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE, .memory = V4L2_MEMORY_MMAP};
    if (hal_v4l2_ioctl(v4l2->fd, VIDIOC_DQBUF, &buffer) != 0) {
        return judge_failure(v4l2, errno, frame, error);
    }
    if (buffer.index >= v4l2->buffer_count) {
        hal_fail(error, "the device returned buffer %u of %u", buffer.index, v4l2->buffer_count);
        return go(v4l2, error);
    }
    v4l2->eio_count = 0;
    count_frame(v4l2, buffer.sequence);
    if (!check_buffer(v4l2, &buffer, error)) {
        name_frame(v4l2, v4l2->bad_name, time_of(&buffer), frame);
        return_buffer(v4l2, buffer.index);
        return HAL_NEXT_BAD;
    }
    hand_on(v4l2, &buffer, hold, frame);
    return HAL_NEXT_FRAME;
}

static void release_frame(void *context, const struct hal_frame *frame)
{
    struct hal_v4l2 *v4l2 = context;
    if (frame->buffer_index < 0 || frame->buffer_index >= HOLD_COUNT) {
        return;
    }
    struct hal_v4l2_hold *hold = &v4l2->hold[frame->buffer_index];
    if (hold->used && hold->has_buffer && !v4l2->gone) {
        return_buffer(v4l2, hold->buffer_index);
    }
    hold->used = false;
}

static bool set_exposure(void *context, int32_t exposure_us, struct hal_error *error)
{
    struct hal_v4l2 *v4l2 = context;
    if (v4l2->fd < 0) {
        return hal_fail(error, "exposure %d us: the camera is not open", exposure_us);
    }
    return hal_v4l2_exposure_set(v4l2->fd, v4l2->config.width, exposure_us, &v4l2->exposure, error);
}

static int32_t frame_time_us(void *context)
{
    const struct hal_v4l2 *v4l2 = context;
    return v4l2->frame_time_us;
}

void hal_v4l2_init(struct hal_v4l2 *v4l2, const struct hal_v4l2_config *config)
{
    *v4l2 = (struct hal_v4l2){
        .camera = {.context = v4l2,
                   .open = open_camera,
                   .close = close_camera,
                   .next = next_frame,
                   .release = release_frame,
                   .set_exposure = set_exposure,
                   .frame_time_us = frame_time_us},
        .fd = -1,
        .config = *config,
    };
}
