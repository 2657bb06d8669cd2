#include "linux/hal_gpio.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "linux/hal_gpio_find.h"
#include "linux/hal_gpio_lines.h"

/* A line as the configuration has it; lines that are not wanted have no name. */
struct wish {
    const char *setting;
    const char *called;
    bool active_low;
    struct hal_gpio_line *line;
};

/* What cannot be taken is most often taken already: by whom? */
static bool fail_taking(struct gpiod_chip *chip, const struct hal_gpio_chip_info *info,
                        const struct wish *wish, unsigned offset, struct hal_error *error)
{
    int reason = errno;
    struct hal_gpio_line_info line = {.used = false};
    bool busy = reason == EBUSY && hal_gpio_line_about(chip, offset, &line) && line.used;
    return hal_fail(error, "%s: cannot take line %u ('%.31s') of %s (%s): %s%s%s", wish->setting,
                    offset, wish->called, info->name, info->label, strerror(reason),
                    busy ? ", used by " : "",
                    !busy               ? ""
                    : line.user[0] != 0 ? line.user
                                        : "the kernel");
}

static bool take_all(struct hal_gpio *gpio, const struct hal_gpio_chip_info *info,
                     const struct wish *wishes, int wish_count, struct hal_error *error)
{
    unsigned offsets[3];
    for (int i = 0; i < wish_count; i++) {
        if (!hal_gpio_find_line(gpio->chip, info, wishes[i].setting, wishes[i].called, &offsets[i],
                                error)) {
            return false;
        }
        for (int k = 0; k < i; k++) {
            if (offsets[i] == offsets[k]) {
                return hal_fail(error, "%s and %s are both line %u of %s (%s), expected two",
                                wishes[k].setting, wishes[i].setting, offsets[i], info->name,
                                info->label);
            }
        }
    }
    snprintf(gpio->line_name, sizeof gpio->line_name, "%s.%u", info->name, offsets[0]);
    for (int i = 0; i < wish_count; i++) {
        const struct hal_gpio_request request = {.offset = offsets[i],
                                                 .active_low = wishes[i].active_low,
                                                 .consumer = gpio->config.consumer};
        bool input = wishes[i].line == &gpio->interlock;
        if (!(input ? hal_gpio_line_input : hal_gpio_line_output)(wishes[i].line, gpio->chip,
                                                                  &request)) {
            return fail_taking(gpio->chip, info, &wishes[i], offsets[i], error);
        }
    }
    return true;
}

/* Not switched off: without stdio and strerror, since a signal handler may be here. */
static bool fail_off(const struct hal_gpio *gpio, int reason, struct hal_error *error)
{
    static const char before[] = ": cannot be switched off: error ";
    char digits[12];
    size_t digit_count = 0, length = strnlen(gpio->what, sizeof gpio->what - 1);
    unsigned remaining = reason < 0 ? 0 : (unsigned)reason;
    do {
        digits[digit_count++] = (char)('0' + remaining % 10);
        remaining /= 10;
    } while (remaining > 0);
    memcpy(error->text, gpio->what, length);
    memcpy(error->text + length, before, sizeof before - 1);
    length += sizeof before - 1;
    while (digit_count > 0) {
        error->text[length++] = digits[--digit_count];
    }
    error->text[length] = 0;
    return false;
}

static bool gpio_set(void *context, bool on, struct hal_error *error)
{
    struct hal_gpio *gpio = context;
    if (on) {
        return hal_gpio_line_set(&gpio->laser, true) ||
               hal_fail(error, "%s: cannot be switched on: %s", gpio->what, strerror(errno));
    }
    for (int i = 0; i < HAL_GPIO_OFF_TRIES; i++) {
        if (hal_gpio_line_set(&gpio->laser, false)) {
            return true;
        }
    }
    return fail_off(gpio, errno, error);
}

static void gpio_close(void *context)
{
    struct hal_gpio *gpio = context;
    struct hal_error ignored;
    gpio_set(gpio, false, &ignored);
    gpio->laser_fd = -1;
    gpio->interlock_fd = -1;
    hal_gpio_line_release(&gpio->laser);
    hal_gpio_line_release(&gpio->heartbeat);
    hal_gpio_line_release(&gpio->interlock);
    if (gpio->chip != NULL) {
        hal_gpio_chip_close(gpio->chip);
        gpio->chip = NULL;
    }
}

static bool gpio_open(void *context, struct hal_error *error)
{
    struct hal_gpio *gpio = context;
    const struct hal_gpio_config *config = &gpio->config;
    struct hal_gpio_chip_info info;
    struct wish wishes[3];
    int count = 0;
    /* The laser first: the sooner it is driven low. */
    wishes[count++] =
        (struct wish){"laser-line", config->laser_line, config->laser_active_low, &gpio->laser};
    if (config->heartbeat_line != NULL) {
        wishes[count++] =
            (struct wish){"heartbeat-line", config->heartbeat_line, false, &gpio->heartbeat};
    }
    if (config->interlock_line != NULL) {
        wishes[count++] = (struct wish){"interlock-line", config->interlock_line,
                                        config->interlock_active_low, &gpio->interlock};
    }
    gpio_close(gpio);
    gpio->chip = hal_gpio_find_chip(config->chip, &info, error);
    if (gpio->chip == NULL) {
        return false;
    }
    if (!take_all(gpio, &info, wishes, count, error)) {
        gpio_close(gpio);
        return false;
    }
    snprintf(gpio->what, sizeof gpio->what, "laser-line: '%.20s' of %.30s", config->laser_line,
             info.name);
    gpio->laser_fd = gpio->laser.fd;
    gpio->interlock_fd = gpio->interlock.fd;
    gpio->beat = false;
    return true;
}

static bool gpio_beat(void *context, struct hal_error *error)
{
    struct hal_gpio *gpio = context;
    if (gpio->config.heartbeat_line == NULL) {
        return true;
    }
    if (gpio->heartbeat.handle == NULL) {
        return hal_fail(error, "heartbeat-line: not taken, expected an open strobe");
    }
    if (!hal_gpio_line_set(&gpio->heartbeat, !gpio->beat)) {
        return hal_fail(error, "heartbeat-line: cannot set '%.31s' of %.80s: %s",
                        gpio->config.heartbeat_line, gpio->config.chip, strerror(errno));
    }
    gpio->beat = !gpio->beat;
    return true;
}

static bool gpio_interlock(void *context, bool *closed, struct hal_error *error)
{
    struct hal_gpio *gpio = context;
    *closed = gpio->config.interlock_line == NULL;
    if (*closed) {
        return true;
    }
    if (gpio->interlock.handle == NULL) {
        return hal_fail(error, "interlock-line: not taken, expected an open strobe");
    }
    /* The events before the level: one that comes in between is kept for the next call. */
    int event_count = hal_gpio_line_drain(&gpio->interlock);
    int level = event_count < 0 ? -1 : hal_gpio_line_get(&gpio->interlock);
    if (level < 0) {
        return hal_fail(error, "interlock-line: cannot read '%.31s' of %.80s: %s",
                        gpio->config.interlock_line, gpio->config.chip, strerror(errno));
    }
    *closed = level == 1 && event_count == 0;
    return true;
}

/* A line has no limits. */
static bool gpio_judged(void *context, struct hal_error *error)
{
    (void)context;
    (void)error;
    return true;
}

static bool gpio_level(void *context, bool *on, struct hal_error *error)
{
    struct hal_gpio *gpio = context;
    int level = gpio->laser.handle == NULL ? -1 : hal_gpio_line_get(&gpio->laser);
    *on = level == 1;
    return level >= 0 || hal_fail(error, "%s: cannot be read: %s", gpio->what, strerror(errno));
}

void hal_gpio_init(struct hal_gpio *gpio, const struct hal_gpio_config *config)
{
    *gpio = (struct hal_gpio){.strobe = {gpio, gpio_open, gpio_close, gpio_set, gpio_beat,
                                         gpio_interlock, gpio_judged, gpio_level},
                              .interlock_fd = -1,
                              .laser_fd = -1,
                              .config = *config,
                              .laser = {.fd = -1},
                              .interlock = {.fd = -1},
                              .heartbeat = {.fd = -1},
                              .what = "laser-line: not taken"};
}
