#include "linux/hal_v4l2_controls.h"

#include <errno.h>
#include <linux/videodev2.h>
#include <stdio.h>
#include <string.h>

#include "linux/hal_v4l2_format.h"

#define NS_PER_S 1000000000LL
#define NS_PER_US 1000
/* V4L2_CID_EXPOSURE_ABSOLUTE counts in these. */
#define EXPOSURE_UNIT_NS 100000
/* Longest text of what was asked, as "exposure 20000 us". */
#define REQUEST_MAX 40

enum found {
    FOUND_NOT = 0,
    FOUND = 1,
    FOUND_ERROR = -1 /* the device could not be queried; *error */
};

static enum found find_control(int fd, uint32_t id, struct v4l2_queryctrl *control,
                               struct hal_error *error)
{
    *control = (struct v4l2_queryctrl){.id = id};
    if (hal_v4l2_ioctl(fd, VIDIOC_QUERYCTRL, control) == 0) {
        return (control->flags & V4L2_CTRL_FLAG_DISABLED) != 0 ? FOUND_NOT : FOUND;
    }
    if (errno == EINVAL || errno == ENOTTY) {
        return FOUND_NOT;
    }
    hal_fail(error, "querying control 0x%08x: %s", id, strerror(errno));
    return FOUND_ERROR;
}

/* Set a control and read it back. A device may round to its steps. unit_ns: 0, or what a value of 1
 * is, for the text. */
static bool set_control(int fd, const struct v4l2_queryctrl *control, int64_t value,
                        const char *requested, int64_t unit_ns, struct hal_error *error)
{
    const char *name = (const char *)control->name;
    char units[48] = "";
    if (unit_ns != 0) {
        snprintf(units, sizeof units, " (of %lld ns)", (long long)unit_ns);
    }
    if (value < control->minimum || value > control->maximum) {
        return hal_fail(error, "%s: %.31s would be %lld%s, expected %d..%d", requested, name,
                        (long long)value, units, control->minimum, control->maximum);
    }
    struct v4l2_control setting = {.id = control->id, .value = (int32_t)value};
    if (hal_v4l2_ioctl(fd, VIDIOC_S_CTRL, &setting) != 0) {
        return hal_fail(error, "%s: setting %.31s to %lld%s: %s", requested, name, (long long)value,
                        units, strerror(errno));
    }
    setting = (struct v4l2_control){.id = control->id};
    if (hal_v4l2_ioctl(fd, VIDIOC_G_CTRL, &setting) != 0) {
        return hal_fail(error, "%s: reading %.31s back: %s", requested, name, strerror(errno));
    }
    const int64_t beside = setting.value > value ? setting.value - value : value - setting.value;
    const int64_t step = control->step < 1 ? 1 : control->step;
    if (beside >= step) {
        return hal_fail(error, "%s: %.31s set to %lld%s, the device says %d", requested, name,
                        (long long)value, units, setting.value);
    }
    return true;
}

/* The first of two modes that the device takes: a device has one way or the other of being
 * automatic, or manual. */
static bool set_exposure_mode(int fd, const struct v4l2_queryctrl *control, int32_t first,
                              int32_t second, const char *requested, struct hal_error *error)
{
    struct hal_error unused;
    return set_control(fd, control, first, requested, 0, error) ||
           set_control(fd, control, second, requested, 0, &unused);
}

bool hal_v4l2_exposure_auto(int fd, struct hal_error *error)
{
    struct v4l2_queryctrl control;
    const enum found found = find_control(fd, V4L2_CID_EXPOSURE_AUTO, &control, error);
    if (found == FOUND_NOT) {
        hal_fail(error, "exposure auto: the device has no automatic exposure");
    }
    return found == FOUND &&
           set_exposure_mode(fd, &control, V4L2_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY,
                             "exposure auto", error);
}

/* A control of 64 bits; 0 where there is none. */
static int64_t read_wide(int fd, uint32_t id)
{
    struct v4l2_ext_control control = {.id = id};
    struct v4l2_ext_controls controls = {
        .which = V4L2_CTRL_WHICH_CUR_VAL, .count = 1, .controls = &control};
    return hal_v4l2_ioctl(fd, VIDIOC_G_EXT_CTRLS, &controls) == 0 ? control.value64 : 0;
}

/* The time of a sensor's row; 0 where the device does not report it. */
static int64_t read_row_ns(int fd, int32_t width)
{
    struct v4l2_control blank = {.id = V4L2_CID_HBLANK};
    const int64_t rate_hz = read_wide(fd, V4L2_CID_PIXEL_RATE);
    if (rate_hz <= 0 || hal_v4l2_ioctl(fd, VIDIOC_G_CTRL, &blank) != 0 || blank.value < 0) {
        return 0;
    }
    return ((int64_t)width + blank.value) * NS_PER_S / rate_hz;
}

/* The control that sets the exposure, and its unit. */
static bool find_exposure(int fd, int32_t width, const char *requested,
                          struct v4l2_queryctrl *control, int64_t *unit_ns, struct hal_error *error)
{
    enum found found = find_control(fd, V4L2_CID_EXPOSURE_ABSOLUTE, control, error);
    *unit_ns = EXPOSURE_UNIT_NS;
    if (found == FOUND_NOT) {
        found = find_control(fd, V4L2_CID_EXPOSURE, control, error);
        *unit_ns = found == FOUND ? read_row_ns(fd, width) : 0;
        if (found == FOUND_NOT) {
            hal_fail(error, "%s: the device has no control of exposure", requested);
        } else if (found == FOUND && *unit_ns == 0) {
            return hal_fail(error,
                            "%s: the device counts exposure in rows and does not report how long a "
                            "row takes (controls pixel rate and horizontal blanking)",
                            requested);
        }
    }
    return found == FOUND;
}

static bool set_exposure_manual(int fd, const char *requested, struct hal_error *error)
{
    struct v4l2_queryctrl control;
    const enum found found = find_control(fd, V4L2_CID_EXPOSURE_AUTO, &control, error);
    return found == FOUND_NOT ||
           (found == FOUND && set_exposure_mode(fd, &control, V4L2_EXPOSURE_MANUAL,
                                                V4L2_EXPOSURE_SHUTTER_PRIORITY, requested, error));
}

bool hal_v4l2_exposure_set(int fd, int32_t width, int32_t exposure_us,
                           struct hal_v4l2_exposure *exposure, struct hal_error *error)
{
    struct v4l2_queryctrl control;
    char requested[REQUEST_MAX];
    snprintf(requested, sizeof requested, "exposure %d us", exposure_us);
    if (!exposure->known) {
        int64_t unit_ns = 0;
        if (!set_exposure_manual(fd, requested, error) ||
            !find_exposure(fd, width, requested, &control, &unit_ns, error)) {
            return false;
        }
        *exposure = (struct hal_v4l2_exposure){true, control.id, unit_ns};
    } else {
        const enum found found = find_control(fd, exposure->control, &control, error);
        if (found != FOUND) {
            return found == FOUND_NOT &&
                   hal_fail(error, "%s: the device's control of exposure is gone", requested);
        }
    }
    const int64_t value =
        ((int64_t)exposure_us * NS_PER_US + exposure->unit_ns / 2) / exposure->unit_ns;
    return set_control(fd, &control, value, requested, exposure->unit_ns, error);
}

static bool set_autogain(int fd, bool on, const char *requested, struct hal_error *error)
{
    struct v4l2_queryctrl control;
    const enum found found = find_control(fd, V4L2_CID_AUTOGAIN, &control, error);
    if (found == FOUND_NOT && on) {
        return hal_fail(error, "%s: the device has no automatic gain", requested);
    }
    return found == FOUND_NOT ||
           (found == FOUND && set_control(fd, &control, on ? 1 : 0, requested, 0, error));
}

bool hal_v4l2_gain_auto(int fd, struct hal_error *error)
{
    return set_autogain(fd, true, "gain auto", error);
}

bool hal_v4l2_gain_set(int fd, int32_t gain, struct hal_error *error)
{
    struct v4l2_queryctrl control;
    char requested[REQUEST_MAX];
    snprintf(requested, sizeof requested, "gain %d", gain);
    if (!set_autogain(fd, false, requested, error)) {
        return false;
    }
    enum found found = find_control(fd, V4L2_CID_GAIN, &control, error);
    if (found == FOUND_NOT) {
        found = find_control(fd, V4L2_CID_ANALOGUE_GAIN, &control, error);
    }
    if (found == FOUND_NOT) {
        hal_fail(error, "%s: the device has no control of gain", requested);
    }
    return found == FOUND && set_control(fd, &control, gain, requested, 0, error);
}
