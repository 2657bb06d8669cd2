/* libgpiod 2's functions on the chips of fake_gpio. */
#include "fake_gpio.h"

#include <errno.h>
#include <gpiod.h>
#include <stdlib.h>
#include <string.h>

struct gpiod_chip_info {
    struct fake_chip *chip;
};

struct gpiod_line_info {
    struct fake_line *line;
};

struct gpiod_line_settings {
    enum gpiod_line_direction direction;
    enum gpiod_line_edge edge;
    enum gpiod_line_value value;
    bool active_low;
};

struct gpiod_line_config {
    struct gpiod_line_settings settings;
    unsigned offset;
    int line_count;
};

struct gpiod_request_config {
    const char *consumer;
};

struct gpiod_line_request {
    struct fake_line *line;
    unsigned offset;
};

struct gpiod_edge_event_buffer {
    int capacity;
};

/* One of the library's objects: all zero, or NULL with errno. */
static void *object(size_t size)
{
    if (fake_fails()) {
        return NULL;
    }
    fake.object_count++;
    return calloc(1, size);
}

static void drop(void *one)
{
    fake.object_count -= one != NULL;
    free(one);
}

struct gpiod_chip *gpiod_chip_open(const char *path)
{
    return (struct gpiod_chip *)fake_open(path);
}

void gpiod_chip_close(struct gpiod_chip *chip)
{
    fake_close((struct fake_chip *)chip);
}

struct gpiod_chip_info *gpiod_chip_get_info(struct gpiod_chip *chip)
{
    struct gpiod_chip_info *info = object(sizeof *info);

    if (info != NULL) {
        info->chip = (struct fake_chip *)chip;
    }
    return info;
}

void gpiod_chip_info_free(struct gpiod_chip_info *info)
{
    drop(info);
}

const char *gpiod_chip_info_get_name(struct gpiod_chip_info *info)
{
    return info->chip->name;
}

const char *gpiod_chip_info_get_label(struct gpiod_chip_info *info)
{
    return info->chip->label;
}

size_t gpiod_chip_info_get_num_lines(struct gpiod_chip_info *info)
{
    return (size_t)info->chip->line_count;
}

struct gpiod_line_info *gpiod_chip_get_line_info(struct gpiod_chip *chip, unsigned int offset)
{
    struct gpiod_line_info *info = NULL;

    if (offset >= (unsigned)((struct fake_chip *)chip)->line_count) {
        errno = EINVAL;
        return NULL;
    }
    info = object(sizeof *info);
    if (info != NULL) {
        info->line = &((struct fake_chip *)chip)->line[offset];
    }
    return info;
}

void gpiod_line_info_free(struct gpiod_line_info *info)
{
    drop(info);
}

const char *gpiod_line_info_get_name(struct gpiod_line_info *info)
{
    return info->line->name;
}

const char *gpiod_line_info_get_consumer(struct gpiod_line_info *info)
{
    return info->line->user;
}

bool gpiod_line_info_is_used(struct gpiod_line_info *info)
{
    return info->line->used;
}

struct gpiod_line_settings *gpiod_line_settings_new(void)
{
    return object(sizeof(struct gpiod_line_settings));
}

void gpiod_line_settings_free(struct gpiod_line_settings *settings)
{
    drop(settings);
}

int gpiod_line_settings_set_direction(struct gpiod_line_settings *settings,
                                      enum gpiod_line_direction direction)
{
    settings->direction = direction;
    return fake_fails() ? -1 : 0;
}

int gpiod_line_settings_set_edge_detection(struct gpiod_line_settings *settings,
                                           enum gpiod_line_edge edge)
{
    settings->edge = edge;
    return fake_fails() ? -1 : 0;
}

int gpiod_line_settings_set_output_value(struct gpiod_line_settings *settings,
                                         enum gpiod_line_value value)
{
    settings->value = value;
    return fake_fails() ? -1 : 0;
}

void gpiod_line_settings_set_active_low(struct gpiod_line_settings *settings, bool active_low)
{
    settings->active_low = active_low;
}

struct gpiod_line_config *gpiod_line_config_new(void)
{
    return object(sizeof(struct gpiod_line_config));
}

void gpiod_line_config_free(struct gpiod_line_config *config)
{
    drop(config);
}

int gpiod_line_config_add_line_settings(struct gpiod_line_config *config,
                                        const unsigned int *offsets, size_t num_offsets,
                                        struct gpiod_line_settings *settings)
{
    fake.misuse_count += num_offsets != 1 || config->line_count != 0;
    config->settings = *settings;
    config->offset = offsets[0];
    config->line_count = 1;
    return fake_fails() ? -1 : 0;
}

struct gpiod_request_config *gpiod_request_config_new(void)
{
    return object(sizeof(struct gpiod_request_config));
}

void gpiod_request_config_free(struct gpiod_request_config *config)
{
    drop(config);
}

void gpiod_request_config_set_consumer(struct gpiod_request_config *config, const char *consumer)
{
    config->consumer = consumer;
}

struct gpiod_line_request *gpiod_chip_request_lines(struct gpiod_chip *chip,
                                                    struct gpiod_request_config *req_cfg,
                                                    struct gpiod_line_config *line_cfg)
{
    const struct gpiod_line_settings *settings = &line_cfg->settings;
    struct fake_line *line = &((struct fake_chip *)chip)->line[line_cfg->offset];
    const bool output = settings->direction == GPIOD_LINE_DIRECTION_OUTPUT;
    struct gpiod_line_request *request = NULL;

    fake.misuse_count += settings->direction != GPIOD_LINE_DIRECTION_OUTPUT &&
                         settings->direction != GPIOD_LINE_DIRECTION_INPUT;
    fake.misuse_count += !output && settings->edge != GPIOD_LINE_EDGE_BOTH;
    if (!fake_take(line, output, settings->active_low, settings->value, req_cfg->consumer)) {
        return NULL;
    }
    request = calloc(1, sizeof *request);
    fake.object_count++;
    request->line = line;
    request->offset = line_cfg->offset;
    return request;
}

void gpiod_line_request_release(struct gpiod_line_request *request)
{
    fake_release(request->line);
    drop(request);
}

int gpiod_line_request_get_fd(struct gpiod_line_request *request)
{
    return request->line->fd;
}

int gpiod_line_request_set_value(struct gpiod_line_request *request, unsigned int offset,
                                 enum gpiod_line_value value)
{
    fake.misuse_count += offset != request->offset;
    return fake_set(request->line, value) ? 0 : -1;
}

enum gpiod_line_value gpiod_line_request_get_value(struct gpiod_line_request *request,
                                                   unsigned int offset)
{
    fake.misuse_count += offset != request->offset;
    return (enum gpiod_line_value)fake_get(request->line);
}

int gpiod_line_request_wait_edge_events(struct gpiod_line_request *request, int64_t timeout_ns)
{
    fake.misuse_count += timeout_ns != 0;
    return fake_fails() ? -1 : request->line->event_count > 0;
}

int gpiod_line_request_read_edge_events(struct gpiod_line_request *request,
                                        struct gpiod_edge_event_buffer *buffer, size_t max_events)
{
    fake.misuse_count += (int)max_events > buffer->capacity;
    return fake_read_events(request->line, (int)max_events);
}

struct gpiod_edge_event_buffer *gpiod_edge_event_buffer_new(size_t capacity)
{
    struct gpiod_edge_event_buffer *buffer = object(sizeof *buffer);

    if (buffer != NULL) {
        buffer->capacity = (int)capacity;
    }
    return buffer;
}

void gpiod_edge_event_buffer_free(struct gpiod_edge_event_buffer *buffer)
{
    drop(buffer);
}
