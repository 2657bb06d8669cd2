/* hal_iio - which way is up, by an accelerometer of Linux's Industrial I/O.
 *
 * In:    sysfs of the device: in_accel_{x,y,z}_raw; in_accel_scale and in_accel_offset, or those of an axis (without offset:
 *        0); in_accel_mount_matrix, in_mount_matrix or mount_matrix (without: none is applied). The device is named by
 *        what its file `name` says, by its directory's name, iio:deviceN, or by a path to that directory.
 * Out:   a unit vector of the camera frame (X right, Y down, Z forward) that points up.
 * Method: HAL_IIO_SAMPLES readings, (raw + offset) * scale in m/s2, and their mean. An accelerometer at rest is pushed upwards by
 *        what carries it, and reads +9.81 m/s2 along up. The mount matrix times the sensor's axes are the device's; here the
 *        device is the camera, so a board's matrix has to lead to the camera frame.
 * Error: text with the file or device, what was found and expected: no such device, or two of one name; a file that cannot be
 *        read, or is no number; a matrix that is no rotation; a mean that is not within 20 % of gravity; readings that
 *        differ from their mean by more than HAL_IIO_MOVED_MAX m/s2, as of a camera that is being moved.
 * Time:  a pause after each reading; about 0.3 s in all.
 */
#ifndef HAL_IIO_H
#define HAL_IIO_H

#include "hal.h"

#define HAL_IIO_DIR "/sys/bus/iio/devices"
#define HAL_IIO_SAMPLES 16
#define HAL_IIO_PAUSE_US 20000
#define HAL_IIO_MOVED_MAX 0.5

struct hal_iio_config {
    const char *called; /* a name, iio:deviceN, or a path, with a slash in it */
    const char *dir;    /* where devices are: HAL_IIO_DIR */
    int32_t pause_us;   /* HAL_IIO_PAUSE_US */
};

struct hal_iio_up {
    double up[3];
    double gravity_m_s2; /* the mean's length */
    char device[128];    /* its name and directory, for messages */
};

/* False: *error. */
bool hal_iio_read(const struct hal_iio_config *config, struct hal_iio_up *up,
                  struct hal_error *error);

#endif
