/* feeder - plays the sensor: frames that come over a port go into v4l2loopback.
 *
 *   feeder PORT DEVICE WIDTH HEIGHT FOURCC
 *
 * Goes into the background as soon as the device gives frames of that kind, so that whoever starts
 * it may open the camera next, and prints its process number; ends when it is killed. On PORT: a
 * struct header, then its samples.
 *
 * Frames that are held back go together with the next one that is not, before anybody else runs on
 * the board's one processor: who reads them finds them all.
 *
 * The bytes are the device's, which has BUFFERS of them (module parameter max_buffers); they are
 * used in turn. v4l2loopback's own order of OUTPUT buffers is not asked for: it hands out the one
 * that was written last.
 */
#include <fcntl.h>
#include <linux/videodev2.h>
#include <sched.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <unistd.h>

#define BUFFERS 4

struct header {
    int64_t time_us;     /* of the frame's start; not 0, which v4l2loopback takes for "none" */
    uint32_t sequence;   /* the sensor's count of frames, lost ones included */
    uint32_t size_bytes; /* of the samples; less than a frame: what a broken transfer leaves */
    uint32_t held;       /* not 0: not before the next one; at most BUFFERS - 1 in a row */
    uint32_t unused;
};

static void fail(const char *what)
{
    perror(what);
    exit(1);
}

static void read_all(int port, void *bytes, size_t count)
{
    while (count > 0) {
        ssize_t got = read(port, bytes, count);
        if (got < 0)
            fail("feeder: read of the port");
        if (got == 0) {
            fprintf(stderr, "feeder: the port was closed\n");
            exit(1);
        }
        bytes = (char *)bytes + got;
        count -= (size_t)got;
    }
}

static void set_format(int device, char **arguments)
{
    struct v4l2_format format = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT};
    const char *fourcc = arguments[2];
    uint32_t width = (uint32_t)atoi(arguments[0]);
    uint32_t height = (uint32_t)atoi(arguments[1]);
    if (strlen(fourcc) != 4) {
        fprintf(stderr, "feeder: '%s' has not four characters\n", fourcc);
        exit(2);
    }
    format.fmt.pix.width = width;
    format.fmt.pix.height = height;
    format.fmt.pix.pixelformat = v4l2_fourcc((uint32_t)fourcc[0], (uint32_t)fourcc[1],
                                             (uint32_t)fourcc[2], (uint32_t)fourcc[3]);
    uint32_t wanted = format.fmt.pix.pixelformat;
    if (ioctl(device, VIDIOC_S_FMT, &format) != 0)
        fail("feeder: VIDIOC_S_FMT");
    if (format.fmt.pix.pixelformat != wanted || format.fmt.pix.width != width ||
        format.fmt.pix.height != height) {
        fprintf(stderr, "feeder: the device does not take %s %s %s\n", arguments[0], arguments[1],
                fourcc);
        exit(1);
    }
}

static void map_buffers(int device, char *samples[BUFFERS], uint32_t *size_bytes)
{
    struct v4l2_requestbuffers request = {
        .count = BUFFERS, .type = V4L2_BUF_TYPE_VIDEO_OUTPUT, .memory = V4L2_MEMORY_MMAP};
    if (ioctl(device, VIDIOC_REQBUFS, &request) != 0)
        fail("feeder: VIDIOC_REQBUFS");
    if (request.count != BUFFERS) {
        fprintf(stderr, "feeder: %u buffers instead of %d\n", request.count, BUFFERS);
        exit(1);
    }
    for (uint32_t i = 0; i < BUFFERS; i++) {
        struct v4l2_buffer buffer = {
            .index = i, .type = V4L2_BUF_TYPE_VIDEO_OUTPUT, .memory = V4L2_MEMORY_MMAP};
        if (ioctl(device, VIDIOC_QUERYBUF, &buffer) != 0)
            fail("feeder: VIDIOC_QUERYBUF");
        samples[i] = mmap(NULL, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, device,
                          (off_t)buffer.m.offset);
        if (samples[i] == MAP_FAILED)
            fail("feeder: mmap");
        *size_bytes = buffer.length;
    }
}

static void fill(int port, struct v4l2_buffer *buffer, char *samples, uint32_t size_bytes,
                 bool *held)
{
    struct header header;
    read_all(port, &header, sizeof header);
    if (header.size_bytes > size_bytes) {
        fprintf(stderr, "feeder: %u bytes for a buffer of %u\n", header.size_bytes, size_bytes);
        exit(1);
    }
    read_all(port, samples, header.size_bytes);
    buffer->sequence = header.sequence;
    buffer->bytesused = header.size_bytes;
    buffer->timestamp.tv_sec = header.time_us / 1000000;
    buffer->timestamp.tv_usec = header.time_us % 1000000;
    *held = header.held != 0;
}

static void feed(int port, int device, char *samples[BUFFERS], uint32_t size_bytes)
{
    struct v4l2_buffer waiting[BUFFERS];
    uint32_t count = 0;
    for (uint32_t index = 0;; index = (index + 1) % BUFFERS) {
        bool held = false;
        waiting[count] = (struct v4l2_buffer){.index = index,
                                              .type = V4L2_BUF_TYPE_VIDEO_OUTPUT,
                                              .memory = V4L2_MEMORY_MMAP,
                                              .field = V4L2_FIELD_NONE};
        fill(port, &waiting[count++], samples[index], size_bytes, &held);
        if (held && count < BUFFERS)
            continue;
        for (uint32_t i = 0; i < count; i++) {
            if (ioctl(device, VIDIOC_QBUF, &waiting[i]) != 0)
                fail("feeder: VIDIOC_QBUF");
        }
        count = 0;
    }
}

int main(int argc, char **argv)
{
    if (argc != 6) {
        fprintf(stderr, "usage: feeder PORT DEVICE WIDTH HEIGHT FOURCC\n");
        return 2;
    }
    char *samples[BUFFERS];
    uint32_t size_bytes = 0;
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    int port = open(argv[1], O_RDONLY);
    if (port < 0)
        fail(argv[1]);
    int device = open(argv[2], O_RDWR);
    if (device < 0)
        fail(argv[2]);
    set_format(device, argv + 3);
    map_buffers(device, samples, &size_bytes);
    if (ioctl(device, VIDIOC_STREAMON, &type) != 0)
        fail("feeder: VIDIOC_STREAMON");
    pid_t child = fork();
    if (child < 0)
        fail("feeder: fork");
    if (child > 0) {
        printf("%d\n", (int)child);
        return 0;
    }
    struct sched_param first = {.sched_priority = 1};
    if (sched_setscheduler(0, SCHED_FIFO, &first) != 0)
        fail("feeder: sched_setscheduler");
    close(STDOUT_FILENO); /* whoever reads the child's number waits for this */
    feed(port, device, samples, size_bytes);
    return 0;
}
