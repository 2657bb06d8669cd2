/* ih_test_v4l2 - a camera of V4L2 made of paper: libv4l2's functions, defined here instead of linked.
 *
 * A test describes the device in `fake` and lists what its frames are; the functions answer as a
 * driver would, note in fake.wrong what no program may do, and fail on request.
 * A buffer is memory of its own, freed when unmapped: the sanitizer sees every look at it later.
 */
#ifndef IH_TEST_V4L2_H
#define IH_TEST_V4L2_H

#include <errno.h>
#include <libv4l2.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdlib.h>
#include <sys/eventfd.h>
#include <sys/mman.h>

#include "ih_test.h"

#define FAKE_FORMATS 8
#define FAKE_SIZES 4
#define FAKE_CONTROLS 8
#define FAKE_FRAMES 64
#define FAKE_BUFFERS 40
#define FAKE_FULL UINT32_MAX

struct fake_format {
    uint32_t fourcc, flags;
    struct {
        uint32_t width, height;
    } size[FAKE_SIZES];
    int32_t size_count;
    bool is_stepwise; /* size[0] to size[1] in steps of size[2] */
};

struct fake_control {
    uint32_t id, flags;
    const char *name;
    int32_t minimum, maximum, step;
    int64_t value;
    int refuse;       /* errno of every setting */
    bool is_stubborn; /* takes every setting and stays as it is */
    bool has_refused; /* one value that is refused with EINVAL: */
    int32_t refused;
};

struct fake_frame {
    int reason; /* errno of taking it; then there is no buffer */
    uint32_t sequence, flags, bytesused;
    long second, microsecond;
    bool bad_index;
};

static struct {
    /* the device */
    uint32_t capabilities, device_capabilities;
    struct fake_format format[FAKE_FORMATS];
    int32_t format_count;
    bool is_endless; /* lists its formats, and their sizes, over and over */
    struct fake_control control[FAKE_CONTROLS];
    int32_t control_count;
    uint32_t padding, field, quantization, colorspace;
    bool no_stride;         /* bytesperline is 0 */
    uint32_t stride;        /* not 0: bytesperline, right or wrong */
    uint32_t buffers_given; /* 0: as many as asked */
    uint32_t bytes_short;   /* buffers are so much too small */
    uint32_t other_fourcc;  /* not 0: what every format becomes */
    int no_parameters;      /* not 0: errno of every rate */
    uint32_t rate_flags;
    struct v4l2_fract frame_time, only_time; /* only_time: not 0: what every rate becomes */
    struct v4l2_fract times[3];              /* that it lists for its format and size */
    uint32_t time_count;
    bool times_are_stepwise; /* all from times[0] to times[1] */
    struct fake_frame frame[FAKE_FRAMES];
    int32_t frame_count, frame_next;
    /* faults */
    int32_t fail_call; /* 0: none; else which of all calls fails, with this errno */
    int fail_reason;
    bool failed;
    bool unplugged;
    /* state */
    int fd;
    int32_t call_count, open_count, mapped_count;
    bool streaming;
    struct v4l2_pix_format current;
    uint32_t buffer_count, buffer_bytes;
    uint8_t *buffer[FAKE_BUFFERS];
    bool queued[FAKE_BUFFERS];
    char opened[64];
    int open_flags;
    char wrong[200];
} fake;

static void fake_wrong(const char *what)
{
    if (fake.wrong[0] == 0) {
        snprintf(fake.wrong, sizeof fake.wrong, "%s (call %" PRId32 ")", what, fake.call_count);
    }
}

static int fake_fail(int reason)
{
    errno = reason;
    return -1;
}

/* Is this the call that is to fail? */
static bool fake_fault(void)
{
    fake.call_count++;
    if (fake.call_count == fake.fail_call) {
        fake.failed = true;
        errno = fake.fail_reason;
        return true;
    }
    return false;
}

static int32_t fake_queued_count(void)
{
    int32_t count = 0;
    uint32_t k;

    for (k = 0; k < fake.buffer_count; k++) {
        count += fake.queued[k];
    }
    return count;
}

/* The descriptor can be polled, and is ready as long as the script goes on. */
static void fake_set_ready(bool ready)
{
    eventfd_t count;

    (void)eventfd_read(fake.fd, &count);
    if (ready) {
        (void)eventfd_write(fake.fd, 1);
    }
}

int v4l2_open(const char *file, int oflag, ...)
{
    if (fake_fault()) {
        return -1;
    }
    if (fake.open_count != 0) {
        fake_wrong("opened twice");
    }
    snprintf(fake.opened, sizeof fake.opened, "%s", file);
    fake.open_flags = oflag;
    fake.open_count++;
    fake.fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    fake_set_ready(fake.frame_count > 0);
    return fake.fd;
}

int v4l2_close(int fd)
{
    uint32_t k;

    fake.call_count++;
    if (fd != fake.fd || fake.open_count != 1) {
        fake_wrong("closed what is not open");
        return -1;
    }
    if (fake.mapped_count != 0) {
        fake_wrong("closed while buffers are mapped");
    }
    if (fake.streaming && !fake.unplugged && !fake.failed) {
        fake_wrong("closed while streaming");
    }
    fake.open_count--;
    fake.streaming = false;
    fake.buffer_count = 0;
    for (k = 0; k < FAKE_BUFFERS; k++) {
        fake.queued[k] = false;
    }
    (void)close(fd);
    fake.fd = -1;
    return 0;
}

void *v4l2_mmap(void *start, size_t length, int prot, int flags, int fd, int64_t offset)
{
    const uint32_t index = (uint32_t)(offset / 4096);

    if (fake_fault() && fake.fail_reason != EINTR) { /* mmap has no such error */
        return MAP_FAILED;
    }
    if (start != NULL || fd != fake.fd || prot != (PROT_READ | PROT_WRITE) || flags != MAP_SHARED ||
        index >= fake.buffer_count || fake.buffer[index] != NULL || length != fake.buffer_bytes) {
        fake_wrong("mapped something else than a buffer");
        return MAP_FAILED;
    }
    fake.buffer[index] = calloc(1, length);
    fake.mapped_count++;
    return fake.buffer[index];
}

int v4l2_munmap(void *start, size_t length)
{
    uint32_t k;

    fake.call_count++;
    for (k = 0; k < FAKE_BUFFERS; k++) {
        if (fake.buffer[k] == start && start != NULL && length == fake.buffer_bytes) {
            free(start);
            fake.buffer[k] = NULL;
            fake.mapped_count--;
            return 0;
        }
    }
    fake_wrong("unmapped what is not mapped");
    return -1;
}

static struct fake_format *fake_find_format(uint32_t fourcc)
{
    int32_t k;

    for (k = 0; k < fake.format_count; k++) {
        if (fake.format[k].fourcc == fourcc) {
            return &fake.format[k];
        }
    }
    return NULL;
}

static int fake_enum_format(struct v4l2_fmtdesc *description)
{
    const uint32_t count = (uint32_t)fake.format_count;
    const uint32_t index = fake.is_endless ? description->index % count : description->index;

    if (description->type != V4L2_BUF_TYPE_VIDEO_CAPTURE || index >= count) {
        return fake_fail(EINVAL);
    }
    description->pixelformat = fake.format[index].fourcc;
    description->flags = fake.format[index].flags;
    return 0;
}

static int fake_enum_size(struct v4l2_frmsizeenum *size)
{
    const struct fake_format *format = fake_find_format(size->pixel_format);
    const uint32_t count = format == NULL        ? 0
                           : format->is_stepwise ? 1
                                                 : (uint32_t)format->size_count;
    const uint32_t index = fake.is_endless ? size->index % count : size->index;

    if (index >= count) {
        return fake_fail(EINVAL);
    }
    if (!format->is_stepwise) {
        size->type = V4L2_FRMSIZE_TYPE_DISCRETE;
        size->discrete.width = format->size[index].width;
        size->discrete.height = format->size[index].height;
        return 0;
    }
    size->type = V4L2_FRMSIZE_TYPE_STEPWISE;
    size->stepwise = (struct v4l2_frmsize_stepwise){format->size[0].width,  format->size[1].width,
                                                    format->size[2].width,  format->size[0].height,
                                                    format->size[1].height, format->size[2].height};
    return 0;
}

/* A driver never refuses a size but gives the nearest; here: the first where there is no such. */
static int fake_set_format(struct v4l2_format *wanted)
{
    const struct fake_format *format = fake_find_format(wanted->fmt.pix.pixelformat);
    struct v4l2_pix_format *pixels = &wanted->fmt.pix;
    uint32_t row_bytes;
    int32_t k, taken = 0;

    if (fake.buffer_count != 0) {
        return fake_fail(EBUSY);
    }
    format = format == NULL ? &fake.format[0] : format;
    for (k = 0; k < format->size_count; k++) {
        if (format->size[k].width == pixels->width && format->size[k].height == pixels->height) {
            taken = k;
        }
    }
    pixels->width = format->size[taken].width;
    pixels->height = format->size[taken].height;
    pixels->pixelformat = fake.other_fourcc != 0 ? fake.other_fourcc : format->fourcc;
    row_bytes = pixels->width;
    if (format->fourcc == V4L2_PIX_FMT_Y10P) {
        row_bytes = (pixels->width + 3) / 4 * 5;
    } else if (format->fourcc == v4l2_fourcc('Y', '1', '2', 'P')) {
        row_bytes = (pixels->width + 1) / 2 * 3;
    } else if (format->fourcc != V4L2_PIX_FMT_GREY && format->fourcc != V4L2_PIX_FMT_YUV420) {
        row_bytes = pixels->width * 2;
    }
    pixels->bytesperline = row_bytes + fake.padding;
    pixels->sizeimage = pixels->bytesperline * pixels->height;
    if (format->fourcc == V4L2_PIX_FMT_YUV420) {
        pixels->sizeimage += pixels->sizeimage / 2;
    }
    fake.buffer_bytes = pixels->sizeimage - fake.bytes_short;
    pixels->bytesperline = fake.no_stride     ? 0
                           : fake.stride != 0 ? fake.stride
                                              : pixels->bytesperline;
    pixels->field = fake.field;
    pixels->quantization = fake.quantization;
    pixels->colorspace = fake.colorspace;
    fake.current = *pixels;
    return 0;
}

static int fake_parameters(struct v4l2_streamparm *parameters, bool set)
{
    if (fake.no_parameters != 0) {
        return fake_fail(fake.no_parameters);
    }
    if (set) {
        fake.frame_time = fake.only_time.denominator != 0 ? fake.only_time
                                                          : parameters->parm.capture.timeperframe;
    }
    parameters->parm.capture.capability = fake.rate_flags;
    parameters->parm.capture.timeperframe = fake.frame_time;
    return 0;
}

static int fake_get_format(struct v4l2_format *format)
{
    format->fmt.pix = fake.current;
    return 0;
}

static int fake_enum_time(struct v4l2_frmivalenum *time)
{
    if (time->pixel_format != fake.current.pixelformat || time->width != fake.current.width ||
        time->height != fake.current.height ||
        time->index >= (fake.times_are_stepwise ? 1 : fake.time_count)) {
        return fake_fail(EINVAL);
    }
    time->type = V4L2_FRMIVAL_TYPE_DISCRETE;
    time->discrete = fake.times[time->index];
    if (fake.times_are_stepwise) {
        time->type = V4L2_FRMIVAL_TYPE_CONTINUOUS;
        time->stepwise = (struct v4l2_frmival_stepwise){fake.times[0], fake.times[1], {1, 1}};
    }
    return 0;
}

static struct fake_control *fake_find_control(uint32_t id)
{
    int32_t k;

    for (k = 0; k < fake.control_count; k++) {
        if (fake.control[k].id == id) {
            return &fake.control[k];
        }
    }
    return NULL;
}

static int fake_query_control(struct v4l2_queryctrl *query)
{
    const struct fake_control *control = fake_find_control(query->id);

    if (control == NULL) {
        return fake_fail(EINVAL);
    }
    snprintf((char *)query->name, sizeof query->name, "%s", control->name);
    query->minimum = control->minimum;
    query->maximum = control->maximum;
    query->step = control->step;
    query->flags = control->flags;
    return 0;
}

static int fake_set_control(const struct v4l2_control *setting)
{
    struct fake_control *control = fake_find_control(setting->id);

    if (control == NULL) {
        return fake_fail(EINVAL);
    }
    if (control->refuse != 0 || (control->has_refused && control->refused == setting->value)) {
        return fake_fail(control->refuse != 0 ? control->refuse : EINVAL);
    }
    if (!control->is_stubborn) { /* rounded down to a step */
        control->value =
            control->minimum + (setting->value - control->minimum) / control->step * control->step;
    }
    return 0;
}

static int fake_get_control(struct v4l2_control *setting)
{
    const struct fake_control *control = fake_find_control(setting->id);

    if (control == NULL) {
        return fake_fail(EINVAL);
    }
    setting->value = (int32_t)control->value;
    return 0;
}

static int fake_get_wide(struct v4l2_ext_controls *controls)
{
    const struct fake_control *control = fake_find_control(controls->controls[0].id);

    if (controls->count != 1 || control == NULL) {
        return fake_fail(EINVAL);
    }
    controls->controls[0].value64 = control->value;
    return 0;
}

static int fake_request_buffers(struct v4l2_requestbuffers *request)
{
    if (request->type != V4L2_BUF_TYPE_VIDEO_CAPTURE || request->memory != V4L2_MEMORY_MMAP) {
        return fake_fail(EINVAL);
    }
    request->count = fake.buffers_given != 0 ? fake.buffers_given : request->count;
    fake.buffer_count = request->count;
    return 0;
}

static int fake_query_buffer(struct v4l2_buffer *buffer)
{
    if (buffer->index >= fake.buffer_count) {
        return fake_fail(EINVAL);
    }
    buffer->length = fake.buffer_bytes;
    buffer->m.offset = buffer->index * 4096;
    return 0;
}

static int fake_queue(const struct v4l2_buffer *buffer)
{
    if (buffer->index >= fake.buffer_count || fake.buffer[buffer->index] == NULL ||
        buffer->type != V4L2_BUF_TYPE_VIDEO_CAPTURE || buffer->memory != V4L2_MEMORY_MMAP) {
        fake_wrong("queued what is no buffer");
        return fake_fail(EINVAL);
    }
    if (fake.queued[buffer->index]) {
        fake_wrong("queued a buffer twice");
        return fake_fail(EINVAL);
    }
    fake.queued[buffer->index] = true;
    return 0;
}

static int fake_dequeue(struct v4l2_buffer *buffer)
{
    const struct fake_frame *frame = &fake.frame[fake.frame_next];
    uint32_t index = 0;

    if (!fake.streaming || buffer->type != V4L2_BUF_TYPE_VIDEO_CAPTURE ||
        buffer->memory != V4L2_MEMORY_MMAP) {
        fake_wrong("dequeued without a stream");
        return fake_fail(EINVAL);
    }
    if (fake.frame_next == fake.frame_count || fake_queued_count() == 0) {
        return fake_fail(EAGAIN);
    }
    fake.frame_next++;
    fake_set_ready(fake.frame_next < fake.frame_count);
    if (frame->reason != 0) {
        return fake_fail(frame->reason);
    }
    while (!fake.queued[index]) {
        index++;
    }
    fake.queued[index] = false;
    buffer->index = frame->bad_index ? fake.buffer_count : index;
    buffer->sequence = frame->sequence;
    buffer->flags = frame->flags;
    buffer->bytesused = frame->bytesused == FAKE_FULL ? fake.buffer_bytes : frame->bytesused;
    buffer->timestamp.tv_sec = frame->second;
    buffer->timestamp.tv_usec = frame->microsecond;
    return 0;
}

static int fake_stream(const enum v4l2_buf_type *type, bool on)
{
    if (*type != V4L2_BUF_TYPE_VIDEO_CAPTURE || fake.streaming == on) {
        fake_wrong("stream on or off at the wrong time");
    }
    fake.streaming = on;
    return 0;
}

static int fake_answer(unsigned long request, void *argument)
{
    struct v4l2_capability *capability = argument;

    switch (request) {
    case VIDIOC_QUERYCAP:
        capability->capabilities = fake.capabilities;
        capability->device_caps = fake.device_capabilities;
        return 0;
    case VIDIOC_ENUM_FMT:
        return fake_enum_format(argument);
    case VIDIOC_ENUM_FRAMESIZES:
        return fake_enum_size(argument);
    case VIDIOC_S_FMT:
        return fake_set_format(argument);
    case VIDIOC_G_FMT:
        return fake_get_format(argument);
    case VIDIOC_ENUM_FRAMEINTERVALS:
        return fake_enum_time(argument);
    case VIDIOC_S_PARM:
        return fake_parameters(argument, true);
    case VIDIOC_G_PARM:
        return fake_parameters(argument, false);
    case VIDIOC_QUERYCTRL:
        return fake_query_control(argument);
    case VIDIOC_S_CTRL:
        return fake_set_control(argument);
    case VIDIOC_G_CTRL:
        return fake_get_control(argument);
    case VIDIOC_G_EXT_CTRLS:
        return fake_get_wide(argument);
    case VIDIOC_REQBUFS:
        return fake_request_buffers(argument);
    case VIDIOC_QUERYBUF:
        return fake_query_buffer(argument);
    case VIDIOC_QBUF:
        return fake_queue(argument);
    case VIDIOC_DQBUF:
        return fake_dequeue(argument);
    case VIDIOC_STREAMON:
        return fake_stream(argument, true);
    case VIDIOC_STREAMOFF:
        return fake_stream(argument, false);
    default:
        fake_wrong("an ioctl that no camera knows");
        return fake_fail(ENOTTY);
    }
}

int v4l2_ioctl(int fd, unsigned long int request, ...)
{
    va_list arguments;
    void *argument;

    va_start(arguments, request);
    argument = va_arg(arguments, void *);
    va_end(arguments);
    if (fake_fault()) {
        return -1;
    }
    if (fd != fake.fd || fake.open_count != 1) {
        fake_wrong("an ioctl on what is not open");
        return fake_fail(EBADF);
    }
    return fake.unplugged ? fake_fail(ENODEV) : fake_answer(request, argument);
}

#endif
