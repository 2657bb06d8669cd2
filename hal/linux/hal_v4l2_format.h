/* hal_v4l2_format - which of a V4L2 device's formats, in which size and at which rate.
 *
 * In:    an open device, the names of hal_v4l2.h.
 * Out:   the device set to it, and how its frames lie in memory.
 * Error: as text: no such format or size, with the list of those that there are; a rate that the
 *        device does not take, with the one that it gives and those that there are; rows too short for the width.
 */
#ifndef HAL_V4L2_FORMAT_H
#define HAL_V4L2_FORMAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal.h"
#include "linux/hal_pixels.h"

/* In the order of preference; hal_v4l2.h says why. */
#define HAL_V4L2_FORMATS "GREY, Y12, Y10, Y16, Y10P, Y12P, YUYV, UYVY, convert"
/* Longest side of an image; px. */
#define HAL_V4L2_SIDE_MAX 16384

struct hal_v4l2_format {
    const char *name;
    enum hal_pixels_layout layout;
    int32_t maximum; /* the sample value of full scale */
    int32_t stride_bytes;
    size_t frame_bytes; /* from the first sample's byte to the last one's */
};

/* An ioctl through libv4l2, again when a signal comes between. 0, or -1 with errno. */
int hal_v4l2_ioctl(int fd, unsigned long request, void *argument);

/* wanted: "auto" or a name. */
bool hal_v4l2_format_set(int fd, const char *wanted, int32_t width, int32_t height,
                         struct hal_v4l2_format *format, struct hal_error *error);

/* rate_mhz 0: the rate is left as it is. *frame_time_us is 0 where the device does not say, else what it
 * says, believable or not, cut to 1 .. INT32_MAX. */
bool hal_v4l2_rate_set(int fd, int32_t rate_mhz, int32_t *frame_time_us, struct hal_error *error);

#endif
