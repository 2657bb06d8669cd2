/* libgpiod 1's functions on the chips of fake_gpio. */
#include "fake_gpio.h"

#include <errno.h>
#include <gpiod.h>
#include <linux/gpio.h>
#include <stdarg.h>
#include <stddef.h>
#include <sys/ioctl.h>

/* The library's types are incomplete: chips and lines of the fake are handed out as such. */
static struct fake_chip *chip_of(struct gpiod_chip *chip)
{
    return (struct fake_chip *)chip;
}

static struct fake_line *line_of(struct gpiod_line *line)
{
    return (struct fake_line *)line;
}

struct gpiod_chip *gpiod_chip_open(const char *path)
{
    return (struct gpiod_chip *)fake_open(path);
}

void gpiod_chip_close(struct gpiod_chip *chip)
{
    fake_close(chip_of(chip));
}

const char *gpiod_chip_name(struct gpiod_chip *chip)
{
    return chip_of(chip)->name;
}

const char *gpiod_chip_label(struct gpiod_chip *chip)
{
    return chip_of(chip)->label;
}

unsigned int gpiod_chip_num_lines(struct gpiod_chip *chip)
{
    return (unsigned)chip_of(chip)->line_count;
}

struct gpiod_line *gpiod_chip_get_line(struct gpiod_chip *chip, unsigned int offset)
{
    if (fake_fails()) {
        return NULL;
    }
    if (offset >= gpiod_chip_num_lines(chip)) {
        errno = EINVAL;
        return NULL;
    }
    return (struct gpiod_line *)&chip_of(chip)->line[offset];
}

const char *gpiod_line_name(struct gpiod_line *line)
{
    return line_of(line)->name;
}

const char *gpiod_line_consumer(struct gpiod_line *line)
{
    return line_of(line)->user;
}

bool gpiod_line_is_used(struct gpiod_line *line)
{
    return line_of(line)->used;
}

int gpiod_line_request_output_flags(struct gpiod_line *line, const char *consumer, int flags,
                                    int default_val)
{
    const bool active_low = flags == GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW;

    fake.misuse_count += flags != 0 && !active_low;
    return fake_take(line_of(line), true, active_low, default_val, consumer) ? 0 : -1;
}

int gpiod_line_request_both_edges_events_flags(struct gpiod_line *line, const char *consumer,
                                               int flags)
{
    const bool active_low = flags == GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW;

    fake.misuse_count += flags != 0 && !active_low;
    return fake_take(line_of(line), false, active_low, 0, consumer) ? 0 : -1;
}

int gpiod_line_event_get_fd(struct gpiod_line *line)
{
    return fake_fails() ? -1 : line_of(line)->fd;
}

void gpiod_line_release(struct gpiod_line *line)
{
    fake_release(line_of(line));
}

int gpiod_line_set_value(struct gpiod_line *line, int value)
{
    return fake_set(line_of(line), value) ? 0 : -1;
}

int gpiod_line_get_value(struct gpiod_line *line)
{
    return fake_get(line_of(line));
}

int gpiod_line_event_wait(struct gpiod_line *line, const struct timespec *timeout)
{
    fake.misuse_count += timeout == NULL || timeout->tv_sec != 0 || timeout->tv_nsec != 0;
    return fake_fails() ? -1 : line_of(line)->event_count > 0;
}

int gpiod_line_event_read_multiple(struct gpiod_line *line, struct gpiod_line_event *events,
                                   unsigned int num_events)
{
    (void)events;
    return fake_read_events(line_of(line), (int)num_events);
}

/* The kernel's own call, for the descriptor of a line that is taken as an output. */
int ioctl(int fd, unsigned long request, ...)
{
    va_list arguments;
    int i, k;

    va_start(arguments, request);
    struct gpiohandle_data *levels = va_arg(arguments, struct gpiohandle_data *);
    va_end(arguments);
    fake.misuse_count += request != GPIOHANDLE_GET_LINE_VALUES_IOCTL;
    for (i = 0; i < FAKE_CHIPS; i++) {
        for (k = 0; k < FAKE_LINES; k++) {
            const struct fake_line *line = &fake.chip[i].line[k];
            if (line->taken && line->output && line->fd == fd) {
                levels->values[0] = (unsigned char)(line->level ^ line->active_low);
                return 0;
            }
        }
    }
    errno = ENOTTY;
    return -1;
}
