/* libgpiod 1.6. */
#include "linux/hal_gpio_lines.h"

#include <errno.h>
#include <gpiod.h>
#include <linux/gpio.h>
#include <stdio.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <unistd.h>

struct gpiod_chip *hal_gpio_chip_open(const char *path)
{
    return gpiod_chip_open(path);
}

void hal_gpio_chip_close(struct gpiod_chip *chip)
{
    gpiod_chip_close(chip);
}

bool hal_gpio_chip_about(struct gpiod_chip *chip, struct hal_gpio_chip_info *info)
{
    snprintf(info->name, sizeof info->name, "%s", gpiod_chip_name(chip));
    snprintf(info->label, sizeof info->label, "%s", gpiod_chip_label(chip));
    info->line_count = gpiod_chip_num_lines(chip);
    return true;
}

bool hal_gpio_line_about(struct gpiod_chip *chip, unsigned offset, struct hal_gpio_line_info *info)
{
    struct gpiod_line *line = gpiod_chip_get_line(chip, offset);
    if (line == NULL) {
        return false;
    }
    const char *name = gpiod_line_name(line);
    const char *user = gpiod_line_consumer(line);
    snprintf(info->name, sizeof info->name, "%s", name != NULL ? name : "");
    snprintf(info->user, sizeof info->user, "%s", user != NULL ? user : "");
    info->used = gpiod_line_is_used(line);
    return true;
}

/* This library does not give the descriptor of an output. The kernel gives out the lowest free
 * number, and this process has one thread: what is free before the request is the line's after it.
 * That a line is there now is made sure of: the guard sets it when this process is dead. */
static int lowest_free_fd(void)
{
    int fd = eventfd(0, EFD_CLOEXEC);
    if (fd >= 0) {
        close(fd);
    }
    return fd;
}

static bool is_line(int fd)
{
    struct gpiohandle_data levels;
    return ioctl(fd, GPIOHANDLE_GET_LINE_VALUES_IOCTL, &levels) == 0;
}

bool hal_gpio_line_output(struct hal_gpio_line *line, struct gpiod_chip *chip,
                          const struct hal_gpio_request *request)
{
    struct gpiod_line *handle = gpiod_chip_get_line(chip, request->offset);
    int fd = handle == NULL ? -1 : lowest_free_fd();
    if (fd < 0) {
        return false;
    }
    int flags = request->active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
    if (gpiod_line_request_output_flags(handle, request->consumer, flags, 0) != 0) {
        return false;
    }
    if (!is_line(fd)) {
        int error = errno;
        gpiod_line_release(handle);
        errno = error;
        return false;
    }
    line->offset = request->offset;
    line->fd = fd;
    line->handle = handle;
    return true;
}

bool hal_gpio_line_input(struct hal_gpio_line *line, struct gpiod_chip *chip,
                         const struct hal_gpio_request *request)
{
    struct gpiod_line *handle = gpiod_chip_get_line(chip, request->offset);
    int flags = request->active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
    if (handle == NULL ||
        gpiod_line_request_both_edges_events_flags(handle, request->consumer, flags) != 0) {
        return false;
    }
    int fd = gpiod_line_event_get_fd(handle);
    if (fd < 0) {
        gpiod_line_release(handle);
        return false;
    }
    line->offset = request->offset;
    line->fd = fd;
    line->handle = handle;
    return true;
}

bool hal_gpio_line_set(struct hal_gpio_line *line, bool active)
{
    struct gpiod_line *handle = line->handle;
    if (handle == NULL) {
        errno = EBADF;
        return !active;
    }
    return gpiod_line_set_value(handle, active) == 0;
}

int hal_gpio_line_get(struct hal_gpio_line *line)
{
    return gpiod_line_get_value(line->handle);
}

int hal_gpio_line_drain(struct hal_gpio_line *line)
{
    const struct timespec at_once = {0};
    struct gpiod_line_event events[HAL_GPIO_EVENTS_MAX];
    int ready = gpiod_line_event_wait(line->handle, &at_once);
    if (ready <= 0) {
        return ready;
    }
    return gpiod_line_event_read_multiple(line->handle, events, HAL_GPIO_EVENTS_MAX);
}

void hal_gpio_line_release(struct hal_gpio_line *line)
{
    struct gpiod_line *handle = line->handle;
    if (handle != NULL) {
        line->handle = NULL;
        line->fd = -1;
        gpiod_line_release(handle);
    }
}
