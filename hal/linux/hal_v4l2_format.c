#include "linux/hal_v4l2_format.h"

#include <errno.h>
#include <libv4l2.h>
#include <linux/videodev2.h>
#include <stdio.h>
#include <string.h>

/* Newer than some kernel headers. */
#ifndef V4L2_PIX_FMT_Y12P
#define V4L2_PIX_FMT_Y12P v4l2_fourcc('Y', '1', '2', 'P')
#endif

#define AUTO "auto"
/* No device has more formats or sizes than this; a broken driver may list them without end. */
#define LIST_MAX 64
#define LIST_TEXT_MAX 100
/* Longest text of a rate, its closing zero included. */
#define RATE_TEXT_MAX 24
/* Luma of YUV with limited range is white here. */
#define LIMITED_WHITE 235

struct choice {
    const char *name;
    uint32_t fourcc;
    enum hal_pixels_layout layout;
    int32_t maximum;
};

static const struct choice choices[] = {
    {"GREY", V4L2_PIX_FMT_GREY, HAL_PIXELS_8, UINT8_MAX},
    {"Y12", V4L2_PIX_FMT_Y12, HAL_PIXELS_16LE, 4095},
    {"Y10", V4L2_PIX_FMT_Y10, HAL_PIXELS_16LE, 1023},
    {"Y16", V4L2_PIX_FMT_Y16, HAL_PIXELS_16LE, UINT16_MAX},
    {"Y10P", V4L2_PIX_FMT_Y10P, HAL_PIXELS_10P, 1023},
    {"Y12P", V4L2_PIX_FMT_Y12P, HAL_PIXELS_12P, 4095},
    {"YUYV", V4L2_PIX_FMT_YUYV, HAL_PIXELS_YUYV, UINT8_MAX},
    {"UYVY", V4L2_PIX_FMT_UYVY, HAL_PIXELS_UYVY, UINT8_MAX},
    {"convert", V4L2_PIX_FMT_YUV420, HAL_PIXELS_8, UINT8_MAX},
};
#define CHOICE_COUNT (sizeof choices / sizeof choices[0])

struct list {
    char text[LIST_TEXT_MAX];
};

struct offer {
    bool has[CHOICE_COUNT];
    struct list others;
};

int hal_v4l2_ioctl(int fd, unsigned long request, void *argument)
{
    int result = 0;
    do {
        result = v4l2_ioctl(fd, request, argument);
    } while (result != 0 && errno == EINTR);
    return result == 0 ? 0 : -1;
}

/* One more item; a list that is full ends in dots. */
static void add_item(struct list *list, const char *item)
{
    const char *dots = ", ...";
    const size_t used = strlen(list->text);
    const char *between = used == 0 ? "" : ", ";
    if (used + strlen(between) + strlen(item) + strlen(dots) < sizeof list->text) {
        snprintf(list->text + used, sizeof list->text - used, "%s%s", between, item);
    } else if (used < strlen(dots) || strcmp(list->text + used - strlen(dots), dots) != 0) {
        snprintf(list->text + used, sizeof list->text - used, "%s", dots);
    }
}

static const char *list_text(const struct list *list)
{
    return list->text[0] == 0 ? "none" : list->text;
}

static void name_fourcc(uint32_t fourcc, char name[5])
{
    for (uint32_t k = 0; k < 4; k++) {
        const uint8_t letter = (uint8_t)(fourcc >> 8 * k);
        name[k] = '?';
        if (letter >= ' ' && letter <= '~') {
            name[k] = (char)letter;
        }
    }
    name[4] = 0;
    for (int k = 3; k > 0 && name[k] == ' '; k--) {
        name[k] = 0;
    }
}

/* Whether it is one of ours; else its four letters. */
static void note_format(const struct v4l2_fmtdesc *description, struct offer *offer)
{
    for (size_t k = 0; k < CHOICE_COUNT; k++) {
        if (choices[k].fourcc == description->pixelformat) {
            offer->has[k] = true;
            return;
        }
    }
    /* libv4lconvert's other formats are of no use to anybody here */
    if ((description->flags & V4L2_FMT_FLAG_EMULATED) == 0) {
        char name[5];
        name_fourcc(description->pixelformat, name);
        add_item(&offer->others, name);
    }
}

static bool read_formats(int fd, struct offer *offer, struct hal_error *error)
{
    *offer = (struct offer){.others = {""}};
    for (uint32_t index = 0; index < LIST_MAX; index++) {
        struct v4l2_fmtdesc description = {.index = index, .type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
        if (hal_v4l2_ioctl(fd, VIDIOC_ENUM_FMT, &description) == 0) {
            note_format(&description, offer);
        } else if (errno == EINVAL) {
            break;
        } else {
            return hal_fail(error, "querying its formats: %s", strerror(errno));
        }
    }
    return true;
}

/* The sizes that the device has in a format, as far as it says. */
static void read_sizes(int fd, uint32_t fourcc, struct list *sizes)
{
    *sizes = (struct list){""};
    for (uint32_t index = 0; index < LIST_MAX; index++) {
        struct v4l2_frmsizeenum size = {.index = index, .pixel_format = fourcc};
        char item[96];
        if (hal_v4l2_ioctl(fd, VIDIOC_ENUM_FRAMESIZES, &size) != 0) {
            break;
        }
        if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
            snprintf(item, sizeof item, "%ux%u", size.discrete.width, size.discrete.height);
            add_item(sizes, item);
            continue;
        }
        snprintf(item, sizeof item, "%ux%u to %ux%u in steps of %ux%u", size.stepwise.min_width,
                 size.stepwise.min_height, size.stepwise.max_width, size.stepwise.max_height,
                 size.stepwise.step_width, size.stepwise.step_height);
        add_item(sizes, item);
        break; /* there is only one such answer */
    }
}

/* Ask for a format and size; *given is what the device makes of it. */
static bool ask_format(int fd, const struct choice *choice, int32_t width, int32_t height,
                       struct v4l2_pix_format *given, struct hal_error *error)
{
    struct v4l2_format format = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    format.fmt.pix.width = (uint32_t)width;
    format.fmt.pix.height = (uint32_t)height;
    format.fmt.pix.pixelformat = choice->fourcc;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    if (hal_v4l2_ioctl(fd, VIDIOC_S_FMT, &format) != 0) {
        return hal_fail(error, "setting format %s %dx%d: %s", choice->name, width, height,
                        strerror(errno));
    }
    *given = format.fmt.pix;
    return true;
}

static bool is_as_requested(const struct v4l2_pix_format *given, const struct choice *choice,
                            int32_t width, int32_t height)
{
    return given->pixelformat == choice->fourcc && given->width == (uint32_t)width &&
           given->height == (uint32_t)height;
}

static void explain_refusal(int fd, const struct choice *choice, int32_t width, int32_t height,
                            const struct v4l2_pix_format *given, struct hal_error *error)
{
    struct list sizes;
    char name[5];
    read_sizes(fd, choice->fourcc, &sizes);
    name_fourcc(given->pixelformat, name);
    hal_fail(error, "requested %s %dx%d, the device gives %s %ux%u; its sizes in %s: %s",
             choice->name, width, height, name, given->width, given->height, choice->name,
             list_text(&sizes));
}

static int32_t full_scale(const struct choice *choice, const struct v4l2_pix_format *given)
{
    const bool is_yuv = choice->fourcc == V4L2_PIX_FMT_YUYV ||
                        choice->fourcc == V4L2_PIX_FMT_UYVY ||
                        choice->fourcc == V4L2_PIX_FMT_YUV420;
    uint32_t range = given->quantization;
    if (range == V4L2_QUANTIZATION_DEFAULT) {
        range = given->colorspace == V4L2_COLORSPACE_JPEG ? V4L2_QUANTIZATION_FULL_RANGE
                                                          : V4L2_QUANTIZATION_LIM_RANGE;
    }
    return is_yuv && range == V4L2_QUANTIZATION_LIM_RANGE ? LIMITED_WHITE : choice->maximum;
}

/* How the frames lie in memory, from what the device answered. */
static bool describe(const struct choice *choice, const struct v4l2_pix_format *given,
                     struct hal_v4l2_format *format, struct hal_error *error)
{
    const int32_t row_bytes = hal_pixels_row_bytes(choice->layout, (int32_t)given->width);
    const uint32_t stride = given->bytesperline == 0 ? (uint32_t)row_bytes : given->bytesperline;
    if (given->field != V4L2_FIELD_NONE && given->field != V4L2_FIELD_ANY) {
        return hal_fail(error, "%s %ux%u is interlaced (field %u), expected whole frames",
                        choice->name, given->width, given->height, given->field);
    }
    if (stride < (uint32_t)row_bytes || stride > INT32_MAX) {
        return hal_fail(error, "%s %ux%u has rows of %u bytes, expected at least %d", choice->name,
                        given->width, given->height, stride, row_bytes);
    }
    if (choice->layout == HAL_PIXELS_16LE && stride % 2 != 0) {
        return hal_fail(error, "%s %ux%u has rows of %u bytes, expected an even number",
                        choice->name, given->width, given->height, stride);
    }
    *format = (struct hal_v4l2_format){
        .name = choice->name,
        .layout = choice->layout,
        .maximum = full_scale(choice, given),
        .stride_bytes = (int32_t)stride,
        .frame_bytes = (size_t)stride * (given->height - 1) + (size_t)row_bytes,
    };
    return true;
}

static bool is_wanted(const char *wanted, const struct choice *choice)
{
    return strcmp(wanted, AUTO) == 0 || strcmp(wanted, choice->name) == 0;
}

static bool is_name(const char *wanted)
{
    bool good = false;
    for (size_t k = 0; k < CHOICE_COUNT; k++) {
        good = good || is_wanted(wanted, &choices[k]);
    }
    return good;
}

static void explain_lack(const char *wanted, const struct offer *offer, struct hal_error *error)
{
    struct list ours = {""};
    for (size_t k = 0; k < CHOICE_COUNT; k++) {
        if (offer->has[k]) {
            add_item(&ours, choices[k].name);
        }
    }
    if (strcmp(wanted, AUTO) == 0) {
        hal_fail(error, "none of " HAL_V4L2_FORMATS "; the device has: %s",
                 list_text(&offer->others));
    } else {
        hal_fail(error, "no format %s; the device has: %s; and, not usable here: %s", wanted,
                 list_text(&ours), list_text(&offer->others));
    }
}

bool hal_v4l2_format_set(int fd, const char *wanted, int32_t width, int32_t height,
                         struct hal_v4l2_format *format, struct hal_error *error)
{
    struct offer offer;
    bool refused = false;
    if (width < 1 || width > HAL_V4L2_SIDE_MAX || height < 1 || height > HAL_V4L2_SIDE_MAX) {
        return hal_fail(error, "requested frames of %dx%d, expected 1..%d each", width, height,
                        HAL_V4L2_SIDE_MAX);
    }
    if (!is_name(wanted)) {
        return hal_fail(error, "format is \"%.40s\", expected " AUTO " or one of " HAL_V4L2_FORMATS,
                        wanted);
    }
    if (!read_formats(fd, &offer, error)) {
        return false;
    }
    for (size_t k = 0; k < CHOICE_COUNT; k++) {
        struct v4l2_pix_format given = {0};
        if (!offer.has[k] || !is_wanted(wanted, &choices[k])) {
            continue;
        }
        if (!ask_format(fd, &choices[k], width, height, &given, error)) {
            return false;
        }
        if (is_as_requested(&given, &choices[k], width, height)) {
            return describe(&choices[k], &given, format, error);
        }
        if (!refused) { /* the best one's sizes are what the user should see */
            explain_refusal(fd, &choices[k], width, height, &given, error);
            refused = true;
        }
    }
    if (!refused) {
        explain_lack(wanted, &offer, error);
    }
    return false;
}

/* rate_mhz of a time per frame; 0 where the device says none. */
static int64_t rate_of(const struct v4l2_fract *time)
{
    return time->numerator == 0 ? 0 : (int64_t)time->denominator * 1000 / time->numerator;
}

static void name_rate(int64_t rate_mhz, char *text, size_t size)
{
    snprintf(text, size, "%lld.%03lld", (long long)rate_mhz / 1000, (long long)rate_mhz % 1000);
}

/* The rates that the device has for its format and size, as far as it says. */
static void read_rates(int fd, struct list *rates)
{
    struct v4l2_format format = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    *rates = (struct list){""};
    if (hal_v4l2_ioctl(fd, VIDIOC_G_FMT, &format) != 0) {
        return;
    }
    for (uint32_t index = 0; index < LIST_MAX; index++) {
        struct v4l2_frmivalenum time = {.index = index,
                                        .pixel_format = format.fmt.pix.pixelformat,
                                        .width = format.fmt.pix.width,
                                        .height = format.fmt.pix.height};
        char item[64];
        if (hal_v4l2_ioctl(fd, VIDIOC_ENUM_FRAMEINTERVALS, &time) != 0) {
            break;
        }
        if (time.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
            name_rate(rate_of(&time.discrete), item, sizeof item);
            add_item(rates, item);
            continue;
        }
        char slowest[RATE_TEXT_MAX];
        char quickest[RATE_TEXT_MAX];
        name_rate(rate_of(&time.stepwise.max), slowest, sizeof slowest);
        name_rate(rate_of(&time.stepwise.min), quickest, sizeof quickest);
        snprintf(item, sizeof item, "%s to %s", slowest, quickest);
        add_item(rates, item);
        break; /* there is only one such answer */
    }
}

static bool ask_rate(int fd, int32_t rate_mhz, struct v4l2_fract *time, struct hal_error *error)
{
    struct v4l2_streamparm parameters = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    parameters.parm.capture.timeperframe =
        (struct v4l2_fract){.numerator = 1000, .denominator = (uint32_t)rate_mhz};
    if (hal_v4l2_ioctl(fd, VIDIOC_S_PARM, &parameters) != 0) {
        return hal_fail(error, "setting %d.%03d frames a second: %s", rate_mhz / 1000,
                        rate_mhz % 1000, strerror(errno));
    }
    parameters = (struct v4l2_streamparm){.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    if (hal_v4l2_ioctl(fd, VIDIOC_G_PARM, &parameters) != 0) {
        return hal_fail(error, "reading the frame rate back: %s", strerror(errno));
    }
    *time = parameters.parm.capture.timeperframe;
    const int64_t given_mhz = rate_of(time);
    const int64_t beside_mhz = given_mhz > rate_mhz ? given_mhz - rate_mhz : rate_mhz - given_mhz;
    if (beside_mhz * 100 >= rate_mhz) {
        char given[RATE_TEXT_MAX];
        struct list rates;
        name_rate(given_mhz, given, sizeof given);
        read_rates(fd, &rates);
        return hal_fail(error, "requested %d.%03d frames a second, the device gives %s%s%s",
                        rate_mhz / 1000, rate_mhz % 1000, given,
                        rates.text[0] == 0 ? "" : "; it has: ", rates.text);
    }
    return true;
}

bool hal_v4l2_rate_set(int fd, int32_t rate_mhz, int32_t *frame_time_us, struct hal_error *error)
{
    struct v4l2_streamparm parameters = {.type = V4L2_BUF_TYPE_VIDEO_CAPTURE};
    const bool has_rate = hal_v4l2_ioctl(fd, VIDIOC_G_PARM, &parameters) == 0;
    struct v4l2_fract time = {0};
    if (!has_rate && errno != EINVAL && errno != ENOTTY) {
        return hal_fail(error, "querying its frame rate: %s", strerror(errno));
    }
    const bool is_free =
        has_rate && (parameters.parm.capture.capability & V4L2_CAP_TIMEPERFRAME) != 0;
    if (has_rate) {
        time = parameters.parm.capture.timeperframe;
    }
    if (rate_mhz < 0) {
        return hal_fail(error, "requested %d frames in 1000 s, expected 0 or more", rate_mhz);
    }
    if (rate_mhz != 0 && !is_free) {
        return hal_fail(error, "requested %d.%03d frames a second, the device's rate is fixed",
                        rate_mhz / 1000, rate_mhz % 1000);
    }
    if (rate_mhz != 0 && !ask_rate(fd, rate_mhz, &time, error)) {
        return false;
    }
    *frame_time_us = 0;
    if (time.denominator != 0 && time.numerator != 0) {
        const int64_t time_us = (int64_t)time.numerator * 1000000 / time.denominator;
        *frame_time_us = time_us < 1 ? 1 : time_us > INT32_MAX ? INT32_MAX : (int32_t)time_us;
    }
    return true;
}
