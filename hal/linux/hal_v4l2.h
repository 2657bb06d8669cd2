/* hal_v4l2 - a Linux camera, through libv4l2.
 *
 * In:    a device of V4L2 with video capture and streaming, and what is wanted of it.
 * Out:   a hal_camera. A frame of GREY, Y10, Y12, Y16 or YU12 is a view of the driver's own buffer,
 *        never copied; a packed or YUYV one is decoded (hal_pixels.h) into one of
 *        HAL_CAMERA_HOLD_MAX + 1 images, allocated when the camera is opened, and the driver has
 *        its buffer back at once. While HAL_CAMERA_HOLD_MAX + 1 frames are out, none is ready.
 *        name: sequence as "%06lld.pgm", what a recording of the frame would be called.
 *        laser: true, since a camera does not know.
 *        sequence: the driver's, carried beyond 32 bits. A number that is not after the one before
 *        it tells nothing, and the frame counts as the next: so drivers that always say 0 are
 *        counted for, and a device that starts anew when opened again carries on where it was.
 *        time_us: the driver's timestamp if it is of the monotonic clock, or was copied from what
 *        fed the device; otherwise the monotonic clock when the frame is taken out.
 * Memory: the caller's struct, and the images above. Nothing is allocated per frame.
 * Error: on opening: as text that names what was asked and what the device offers or answered; then
 *        nothing stays open or mapped.
 *        HAL_NEXT_BAD: the driver marks the frame as damaged; it is shorter than the image; EIO,
 *        which V4L2 also gives for passing trouble like a lost signal.
 *        HAL_NEXT_GONE: HAL_V4L2_EIO_MAX times EIO with no frame between, any other error, a buffer
 *        that cannot be given back. It stays so until the camera is closed.
 *
 * Format: that of the configuration, or with "auto" the first of HAL_V4L2_FORMATS that the device
 * has in exactly the wanted size:
 *   GREY          half of the bytes of any other on the bus and in the cache, and quite enough: a
 *                 dot's place comes from its slopes, where the light's own noise is above one step
 *                 of 8 bits
 *   Y12, Y10      the same dots in finer steps: more in dark scenes, at no work but the bytes
 *   Y16           a view too, but V4L2 lets a 10-bit sensor fill the low bits only, and nothing
 *                 tells: then the image is as good as black. Taken when no surer one is there
 *   Y10P, Y12P    as Y10 and Y12, but unpacked by the processor, frame by frame
 *   YUYV, UYVY    8 bits with colours that nobody wants, thinned out by the processor
 *   convert       YU12's luma, as a rule made by libv4lconvert from JPEG or a colour mosaic: many
 *                 times the work, and dots smeared by both
 *
 * Rate: asked of the driver where it is not 0, and refused where the answer is 1 % or more beside.
 *
 * Exposure: V4L2_CID_EXPOSURE_ABSOLUTE, in units of 100 us. Sensors that have V4L2_CID_EXPOSURE
 * instead, which counts rows, are served when the device also has V4L2_CID_HBLANK and
 * V4L2_CID_PIXEL_RATE: a row takes (width + hblank) / pixel rate. A time is rounded to the nearest
 * unit and must lie in the control's range. Automatic exposure is switched off before. Setting it
 * waits for the device's answer: over USB that takes some milliseconds.
 * Gain: V4L2_CID_GAIN, or else V4L2_CID_ANALOGUE_GAIN, in the device's own units, after
 * V4L2_CID_AUTOGAIN was switched off where there is one. All are read back: another answer than what
 * was asked, by a step or more, is an error.
 */
#ifndef HAL_V4L2_H
#define HAL_V4L2_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal.h"
#include "linux/hal_v4l2_controls.h"
#include "linux/hal_v4l2_format.h"

/* What the driver is asked for: one being filled, one filled, one to spare, and those held. */
#define HAL_V4L2_BUFFERS_REQUESTED 6
/* It may give fewer, but not fewer than this, or more; further ones are not used. */
#define HAL_V4L2_BUFFERS_MIN 4
#define HAL_V4L2_BUFFERS_MAX 32
/* So many EIO in a row, with no frame between, and the device counts as broken. */
#define HAL_V4L2_EIO_MAX 8
/* "%06lld.pgm" of any number. */
#define HAL_V4L2_NAME_MAX 32

/* The texts are the caller's, and stay while the camera is used. */
struct hal_v4l2_config {
    const char *device;               /* /dev/video0 */
    const char *format;               /* "auto" or one of HAL_V4L2_FORMATS */
    int32_t width, height;            /* px, 1 .. HAL_V4L2_SIDE_MAX: the rig's */
    int32_t rate_mhz;                 /* frames in 1000 s; 0: whatever the camera is set to */
    struct hal_v4l2_setting exposure; /* value in us */
    struct hal_v4l2_setting gain;     /* value in the camera's own units */
};

struct hal_v4l2_buffer {
    uint8_t *start;
    size_t length;
};

/* A frame that is out. */
struct hal_v4l2_hold {
    bool used;
    bool has_buffer; /* of the driver: to be given back */
    uint32_t buffer_index;
    char name[HAL_V4L2_NAME_MAX];
};

struct hal_v4l2 {
    struct hal_camera camera;
    int fd; /* readable when camera.next has something to say; -1 while closed */
    struct hal_v4l2_config config;
    struct hal_v4l2_format format;
    struct hal_v4l2_exposure exposure;
    int32_t frame_time_us; /* 0: the camera does not say */

    struct hal_v4l2_buffer buffer[HAL_V4L2_BUFFERS_MAX];
    uint32_t buffer_count;
    bool streaming;
    uint8_t *images; /* one for each hold; NULL where frames are views */
    size_t image_bytes;
    struct hal_v4l2_hold hold[HAL_CAMERA_HOLD_MAX + 1];

    bool counted; /* a frame was seen: the two numbers hold, also over closing and opening */
    uint32_t driver_sequence;
    int64_t sequence;
    char bad_name[HAL_V4L2_NAME_MAX];
    int32_t eio_count;
    bool gone;
    struct hal_error gone_error;
};

/* Fills in .camera, closed. Nothing is opened. */
void hal_v4l2_init(struct hal_v4l2 *v4l2, const struct hal_v4l2_config *config);

#endif
