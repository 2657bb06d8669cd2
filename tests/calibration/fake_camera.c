/* fake_camera - /dev/video7, a camera of V4L2 without a kernel's help: to be named in LD_PRELOAD.
 *
 * Opening it opens memory; what a driver answers to ioctl() is answered here. The environment says what it is:
 *   FAKE_CAMERA_FRAMES  a folder with 000.pgm, 001.pgm, ...: what it shows, one after the other
 *   FAKE_CAMERA_FORMAT  GREY or YUYV
 *   FAKE_CAMERA_END     behind the last one: gone (the device is unplugged) or still (no frame comes any more)
 *   FAKE_CAMERA_BUSY    set: another program streams from it
 * All pictures have one size. It is offered beside 640x480, which shows their upper left corner; whoever asks for another
 * size gets 640x480, as drivers do.
 */
#define _GNU_SOURCE
#undef _FILE_OFFSET_BITS /* open and open64 are two */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/select.h>
#include <sys/types.h>
#include <time.h>
#include <unistd.h>

#define DEVICE "/dev/video7"
#define FILES_MAX 8
#define BUFFERS 4
#define SMALL_WIDTH 640
#define SMALL_HEIGHT 480
#define PIXELS_MAX (1280 * 800)
#define SAMPLE_BYTES_MAX 2
#define BUFFER_BYTES ((uint32_t)(PIXELS_MAX * SAMPLE_BYTES_MAX))

static struct {
    int file[FILES_MAX]; /* descriptors that are this device */
    int file_count;
    uint32_t width, height, shown;
    bool is_still;
    uint32_t queue[BUFFERS], queue_count;
} camera = {.width = SMALL_WIDTH, .height = SMALL_HEIGHT};

static bool is_camera(int file)
{
    for (int i = 0; i < camera.file_count; i++) {
        if (camera.file[i] == file)
            return true;
    }
    return false;
}

static const char *setting(const char *name)
{
    const char *value = getenv(name);
    return value != NULL ? value : "";
}

static bool is_grey(void)
{
    return strcmp(setting("FAKE_CAMERA_FORMAT"), "GREY") == 0;
}

static bool read_picture(uint32_t number, unsigned char *samples, uint32_t *width, uint32_t *height)
{
    char path[4096];
    (void)snprintf(path, sizeof path, "%s/%03u.pgm", setting("FAKE_CAMERA_FRAMES"), number);
    FILE *file = fopen(path, "rb");
    if (file == NULL)
        return false;
    bool good = fscanf(file, "P5 %u %u 255", width, height) == 2 && fgetc(file) == '\n' &&
                *width * *height <= PIXELS_MAX && fread(samples, *width * *height, 1, file) == 1;
    (void)fclose(file);
    return good;
}

/* Luma has its full range; colours are none. */
static bool show(int file, uint32_t buffer)
{
    static unsigned char samples[PIXELS_MAX], bytes[BUFFER_BYTES];
    uint32_t width = 0, height = 0, count = 0;
    if (!read_picture(camera.shown, samples, &width, &height))
        return false;
    camera.shown++;
    for (uint32_t v = 0; v < camera.height; v++) {
        for (uint32_t u = 0; u < camera.width; u++) {
            bytes[count++] = samples[v * width + u];
            if (!is_grey())
                bytes[count++] = 128;
        }
    }
    return pwrite(file, bytes, count, (off_t)(buffer * BUFFER_BYTES)) == (ssize_t)count;
}

static int fail(int reason)
{
    errno = reason;
    return -1;
}

static int set_format(struct v4l2_format *format, bool is_set)
{
    static unsigned char samples[PIXELS_MAX];
    struct v4l2_pix_format *pix = &format->fmt.pix;
    uint32_t width = 0, height = 0;
    uint32_t fourcc = is_grey() ? V4L2_PIX_FMT_GREY : V4L2_PIX_FMT_YUYV;
    if (is_set && *setting("FAKE_CAMERA_BUSY") != '\0')
        return fail(EBUSY);
    bool is_whole = is_set && read_picture(0, samples, &width, &height) && pix->width == width &&
                    pix->height == height;
    if (is_set) {
        camera.width = is_whole ? width : SMALL_WIDTH;
        camera.height = is_whole ? height : SMALL_HEIGHT;
    }
    *pix = (struct v4l2_pix_format){.width = camera.width,
                                    .height = camera.height,
                                    .pixelformat = fourcc,
                                    .field = V4L2_FIELD_NONE,
                                    .bytesperline = camera.width * (is_grey() ? 1U : 2U)};
    pix->sizeimage = pix->bytesperline * pix->height;
    return 0;
}

static int take(int file, struct v4l2_buffer *buffer)
{
    if (camera.queue_count == 0)
        return fail(EAGAIN);
    uint32_t index = camera.queue[0];
    if (!show(file, index)) {
        camera.is_still = strcmp(setting("FAKE_CAMERA_END"), "still") == 0;
        return fail(camera.is_still ? EAGAIN : ENODEV);
    }
    camera.queue_count--;
    memmove(camera.queue, camera.queue + 1, camera.queue_count * sizeof camera.queue[0]);
    buffer->index = index;
    buffer->length = BUFFER_BYTES;
    buffer->bytesused = camera.width * camera.height * (is_grey() ? 1U : 2U);
    buffer->flags = 0;
    return 0;
}

static int describe(int file, struct v4l2_capability *capability)
{
    (void)file;
    memset(capability, 0, sizeof *capability);
    (void)snprintf((char *)capability->driver, sizeof capability->driver, "fake");
    (void)snprintf((char *)capability->card, sizeof capability->card, "fake camera");
    capability->capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
    return 0;
}

static int answer(int file, unsigned long request, void *argument)
{
    struct v4l2_buffer *buffer = argument;
    switch (request) {
    case VIDIOC_QUERYCAP:
        return describe(file, argument);
    case VIDIOC_G_FMT:
        return set_format(argument, false);
    case VIDIOC_S_FMT:
        return set_format(argument, true);
    case VIDIOC_REQBUFS:
        ((struct v4l2_requestbuffers *)argument)->count =
            ((struct v4l2_requestbuffers *)argument)->count > 0 ? BUFFERS : 0;
        camera.queue_count = 0;
        return 0;
    case VIDIOC_QUERYBUF:
        buffer->length = BUFFER_BYTES;
        buffer->m.offset = buffer->index * BUFFER_BYTES;
        return 0;
    case VIDIOC_QBUF:
        camera.queue[camera.queue_count++] = buffer->index;
        return 0;
    case VIDIOC_DQBUF:
        return take(file, buffer);
    case VIDIOC_STREAMOFF:
        camera.queue_count = 0;
        return 0;
    case VIDIOC_STREAMON:
        return 0;
    default:
        return fail(ENOTTY);
    }
}

static int open_memory(void)
{
    int file = memfd_create("camera", MFD_CLOEXEC);
    if (file < 0 || camera.file_count == FILES_MAX ||
        ftruncate(file, (off_t)BUFFERS * BUFFER_BYTES) != 0)
        return fail(ENOMEM);
    camera.file[camera.file_count++] = file;
    return file;
}

/* O_TMPFILE has the bit of O_DIRECTORY in it. */
static bool has_mode(int flags)
{
    return (flags & O_CREAT) != 0 || (flags & O_TMPFILE) == O_TMPFILE;
}

int open(const char *path, int flags, ...)
{
    int (*next)(const char *, int, ...) = (int (*)(const char *, int, ...))dlsym(RTLD_NEXT, "open");
    va_list remainder;
    va_start(remainder, flags);
    mode_t mode = has_mode(flags) ? va_arg(remainder, mode_t) : 0;
    va_end(remainder);
    return strcmp(path, DEVICE) == 0 ? open_memory() : next(path, flags, mode);
}

int open64(const char *path, int flags, ...)
{
    va_list remainder;
    va_start(remainder, flags);
    mode_t mode = has_mode(flags) ? va_arg(remainder, mode_t) : 0;
    va_end(remainder);
    return open(path, flags | O_LARGEFILE, mode);
}

int close(int file)
{
    int (*next)(int) = (int (*)(int))dlsym(RTLD_NEXT, "close");
    for (int i = 0; i < camera.file_count; i++) {
        if (camera.file[i] == file)
            camera.file[i] = camera.file[--camera.file_count];
    }
    return next(file);
}

int ioctl(int file, unsigned long request, ...)
{
    int (*next)(int, unsigned long, ...) =
        (int (*)(int, unsigned long, ...))dlsym(RTLD_NEXT, "ioctl");
    va_list remainder;
    va_start(remainder, request);
    void *argument = va_arg(remainder, void *);
    va_end(remainder);
    return is_camera(file) ? answer(file, request, argument) : next(file, request, argument);
}

/* Memory is always ready. */
int select(int count, fd_set *readable, fd_set *writable, fd_set *odd, struct timeval *limit)
{
    int (*next)(int, fd_set *, fd_set *, fd_set *, struct timeval *) =
        (int (*)(int, fd_set *, fd_set *, fd_set *, struct timeval *))dlsym(RTLD_NEXT, "select");
    if (!camera.is_still)
        return next(count, readable, writable, odd, limit);
    struct timespec pause = {.tv_sec = limit->tv_sec, .tv_nsec = limit->tv_usec * 1000};
    (void)nanosleep(&pause, NULL);
    return 0;
}
