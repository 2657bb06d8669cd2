/* unplug - pulls the plug of the kernel's virtual camera (vivid): its "Disconnect" button, after
 * which every call of every program that has it open fails as with a camera that was pulled out.
 *
 *   unplug DEVICE
 *
 * vivid comes back when the last of them has closed it.
 */
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdio.h>
#include <string.h>
#include <sys/ioctl.h>

int main(int argc, char **argv)
{
    if (argc != 2) {
        fprintf(stderr, "usage: unplug DEVICE\n");
        return 2;
    }
    int device = open(argv[1], O_RDWR);
    if (device < 0) {
        perror(argv[1]);
        return 1;
    }
    struct v4l2_queryctrl query = {.id = V4L2_CTRL_FLAG_NEXT_CTRL};
    while (ioctl(device, VIDIOC_QUERYCTRL, &query) == 0) {
        if (strcmp((const char *)query.name, "Disconnect") == 0) {
            struct v4l2_control control = {.id = query.id, .value = 1};
            if (ioctl(device, VIDIOC_S_CTRL, &control) == 0)
                return 0;
            perror("unplug: VIDIOC_S_CTRL");
            return 1;
        }
        query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    }
    fprintf(stderr, "unplug: %s has no button \"Disconnect\": is it vivid?\n", argv[1]);
    return 1;
}
