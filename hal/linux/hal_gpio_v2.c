/* libgpiod 2. */
#include "linux/hal_gpio_lines.h"

#include <errno.h>
#include <gpiod.h>
#include <stdio.h>

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
    struct gpiod_chip_info *about = gpiod_chip_get_info(chip);
    if (about == NULL) {
        return false;
    }
    snprintf(info->name, sizeof info->name, "%s", gpiod_chip_info_get_name(about));
    snprintf(info->label, sizeof info->label, "%s", gpiod_chip_info_get_label(about));
    info->line_count = (unsigned)gpiod_chip_info_get_num_lines(about);
    gpiod_chip_info_free(about);
    return true;
}

bool hal_gpio_line_about(struct gpiod_chip *chip, unsigned offset, struct hal_gpio_line_info *info)
{
    struct gpiod_line_info *about = gpiod_chip_get_line_info(chip, offset);
    if (about == NULL) {
        return false;
    }
    const char *name = gpiod_line_info_get_name(about);
    const char *user = gpiod_line_info_get_consumer(about);
    snprintf(info->name, sizeof info->name, "%s", name != NULL ? name : "");
    snprintf(info->user, sizeof info->user, "%s", user != NULL ? user : "");
    info->used = gpiod_line_info_is_used(about);
    gpiod_line_info_free(about);
    return true;
}

static bool fill_settings(struct gpiod_line_settings *settings, bool output, bool active_low)
{
    gpiod_line_settings_set_active_low(settings, active_low);
    if (output) {
        return gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_OUTPUT) == 0 &&
               gpiod_line_settings_set_output_value(settings, GPIOD_LINE_VALUE_INACTIVE) == 0;
    }
    return gpiod_line_settings_set_direction(settings, GPIOD_LINE_DIRECTION_INPUT) == 0 &&
           gpiod_line_settings_set_edge_detection(settings, GPIOD_LINE_EDGE_BOTH) == 0;
}

static struct gpiod_line_request *take(struct gpiod_chip *chip, bool output,
                                       const struct hal_gpio_request *wanted)
{
    struct gpiod_line_request *request = NULL;
    struct gpiod_line_settings *settings = gpiod_line_settings_new();
    struct gpiod_line_config *lines = gpiod_line_config_new();
    struct gpiod_request_config *whole = gpiod_request_config_new();
    if (settings != NULL && lines != NULL && whole != NULL &&
        fill_settings(settings, output, wanted->active_low) &&
        gpiod_line_config_add_line_settings(lines, &wanted->offset, 1, settings) == 0) {
        gpiod_request_config_set_consumer(whole, wanted->consumer);
        request = gpiod_chip_request_lines(chip, whole, lines);
    }
    int error = errno;
    gpiod_request_config_free(whole);
    gpiod_line_config_free(lines);
    gpiod_line_settings_free(settings);
    errno = error;
    return request;
}

static bool keep(struct hal_gpio_line *line, struct gpiod_line_request *request, unsigned offset)
{
    if (request == NULL) {
        return false;
    }
    line->offset = offset;
    line->fd = gpiod_line_request_get_fd(request);
    line->handle = request;
    return true;
}

bool hal_gpio_line_output(struct hal_gpio_line *line, struct gpiod_chip *chip,
                          const struct hal_gpio_request *request)
{
    return keep(line, take(chip, true, request), request->offset);
}

bool hal_gpio_line_input(struct hal_gpio_line *line, struct gpiod_chip *chip,
                         const struct hal_gpio_request *request)
{
    line->events = gpiod_edge_event_buffer_new(HAL_GPIO_EVENTS_MAX);
    if (line->events == NULL) {
        return false;
    }
    if (!keep(line, take(chip, false, request), request->offset)) {
        int error = errno;
        gpiod_edge_event_buffer_free(line->events);
        line->events = NULL;
        errno = error;
        return false;
    }
    return true;
}

bool hal_gpio_line_set(struct hal_gpio_line *line, bool active)
{
    struct gpiod_line_request *handle = line->handle;
    if (handle == NULL) {
        errno = EBADF;
        return !active;
    }
    return gpiod_line_request_set_value(handle, line->offset,
                                        active ? GPIOD_LINE_VALUE_ACTIVE
                                               : GPIOD_LINE_VALUE_INACTIVE) == 0;
}

int hal_gpio_line_get(struct hal_gpio_line *line)
{
    return gpiod_line_request_get_value(line->handle, line->offset);
}

int hal_gpio_line_drain(struct hal_gpio_line *line)
{
    int ready = gpiod_line_request_wait_edge_events(line->handle, 0);
    if (ready <= 0) {
        return ready;
    }
    return gpiod_line_request_read_edge_events(line->handle, line->events, HAL_GPIO_EVENTS_MAX);
}

void hal_gpio_line_release(struct hal_gpio_line *line)
{
    struct gpiod_line_request *handle = line->handle;
    if (handle != NULL) {
        line->handle = NULL;
        line->fd = -1;
        gpiod_line_request_release(handle);
        gpiod_edge_event_buffer_free(line->events);
        line->events = NULL;
    }
}
