/* control - a camera's control by its name: print it, or set it first; or its frame time.
 *
 *   control DEVICE NAME [VALUE]
 *   control DEVICE frame-time SECONDS
 *
 * The button "Disconnect" of the kernel's virtual camera (vivid) pulls its plug: every call of every
 * program that has it open fails from then on as with a camera that was pulled out. It comes back
 * when the last of them has closed it. Buttons have no value: nothing is printed.
 */
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>

static int fail(const char *what)
{
    fprintf(stderr, "control: ");
    perror(what);
    return 1;
}

int main(int argc, char **argv)
{
    if (argc != 3 && argc != 4) {
        fprintf(stderr, "usage: control DEVICE NAME [VALUE]\n");
        return 2;
    }
    int device = open(argv[1], O_RDWR);
    if (device < 0)
        return fail(argv[1]);
    if (argc == 4 && strcmp(argv[2], "frame-time") == 0) {
        struct v4l2_streamparm parameters = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
        parameters.parm.capture.timeperframe.numerator = (uint32_t)atoi(argv[3]);
        parameters.parm.capture.timeperframe.denominator = 1;
        return ioctl(device, VIDIOC_S_PARM, &parameters) == 0 ? 0 : fail(argv[2]);
    }
    struct v4l2_queryctrl query = {.id = V4L2_CTRL_FLAG_NEXT_CTRL};
    while (ioctl(device, VIDIOC_QUERYCTRL, &query) == 0) {
        struct v4l2_control control = {.id = query.id};
        if (strcmp((const char *)query.name, argv[2]) != 0) {
            query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
            continue;
        }
        if (argc == 4) {
            control.value = atoi(argv[3]);
            if (ioctl(device, VIDIOC_S_CTRL, &control) != 0)
                return fail(argv[2]);
        }
        if (query.type == V4L2_CTRL_TYPE_BUTTON)
            return 0;
        if (ioctl(device, VIDIOC_G_CTRL, &control) != 0)
            return fail(argv[2]);
        printf("%d\n", control.value);
        return 0;
    }
    fprintf(stderr, "control: %s has no control \"%s\"\n", argv[1], argv[2]);
    return 1;
}
