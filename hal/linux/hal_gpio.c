#include "linux/hal_gpio.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#include "linux/hal_gpio_lines.h"

/* A line as the configuration has it; lines that are not wanted have no name. */
struct wish {
    const char *setting;
    const char *called;
    bool active_low;
    struct hal_gpio_line *line;
};

/* What cannot be taken is most often taken already: by whom? */
static bool fail_taking(struct hal_gpio *gpio, const struct hal_gpio_chip_info *info,
                        const struct wish *wish, unsigned offset, struct hal_error *error)
{
    int reason = errno;
    struct hal_gpio_line_info line = {.used = false};
    bool busy = reason == EBUSY && hal_gpio_line_about(gpio->chip, offset, &line) && line.used;
    gpio->has_no_line =
        busy && strncmp(line.user, gpio->config.consumer, HAL_GPIO_NAME_MAX - 1) != 0;
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
    unsigned offsets[3] = {0};
    for (int i = 0; i < wish_count; i++) {
        if (!hal_gpio_find_line(gpio->chip, info, wishes[i].setting, wishes[i].called, &offsets[i],
                                error)) {
            gpio->has_no_line = true;
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
            return fail_taking(gpio, info, &wishes[i], offsets[i], error);
        }
    }
    return true;
}

/* Not switched off: without stdio and strerror, since a signal handler may be here. reason 0: it was
 * set, and reads as on. */
static bool fail_off(const struct hal_gpio *gpio, int reason, struct hal_error *error)
{
    static const char refused[] = ": cannot be switched off: error ";
    static const char reads_on[] = ": switched off, and reads as on";
    const char *text = reason == 0 ? reads_on : refused;
    char digits[12];
    size_t digit_count = 0, length = strnlen(gpio->what, sizeof gpio->what - 1);
    for (int remaining = reason; remaining > 0; remaining /= 10) {
        digits[digit_count++] = (char)('0' + remaining % 10);
    }
    memcpy(error->text, gpio->what, length);
    memcpy(error->text + length, text, strlen(text));
    length += strlen(text);
    while (digit_count > 0) {
        error->text[length++] = digits[--digit_count];
    }
    error->text[length] = 0;
    return false;
}

/* Set, and read back. False: errno, 0 where the line reads otherwise. */
static bool set_line(struct hal_gpio *gpio, bool on)
{
    if (!hal_gpio_line_set(&gpio->laser, on)) {
        return false;
    }
    if (!gpio->can_read || gpio->laser.handle == NULL) {
        return true;
    }
    int level = hal_gpio_line_get(&gpio->laser);
    if (level < 0) {
        return false;
    }
    errno = 0;
    gpio->was_on = gpio->was_on || (on && level == 1);
    return level == on || (on && !gpio->was_on);
}

static bool gpio_set(void *context, bool on, struct hal_error *error)
{
    struct hal_gpio *gpio = context;
    if (on) {
        return set_line(gpio, true) || hal_fail(error, "%s: cannot be switched on: %s", gpio->what,
                                                errno == 0 ? "it reads as off" : strerror(errno));
    }
    for (int i = 0; i < HAL_GPIO_OFF_TRIES; i++) {
        if (set_line(gpio, false)) {
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
    gpio->has_no_line = gpio->chip == NULL;
    if (gpio->has_no_line) {
        return false;
    }
    if (!take_all(gpio, &info, wishes, count, error)) {
        gpio_close(gpio);
        return false;
    }
    snprintf(gpio->what, sizeof gpio->what, "laser-line: '%.20s' of %.30s", config->laser_line,
             info.name);
    int level = hal_gpio_line_get(&gpio->laser);
    if (level == 1) {
        gpio_close(gpio);
        return hal_fail(error, "%s: taken as off, and reads as on", gpio->what);
    }
    gpio->can_read = level == 0;
    gpio->was_on = false;
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

/* Both levels, read back. What hangs on the line cannot be seen from here. */
static bool prove_heartbeat(struct hal_gpio *gpio, struct hal_error *unproven,
                            struct hal_error *error)
{
    bool is_read = true;
    for (int edge = 0; edge < 2; edge++) {
        if (!gpio_beat(gpio, error)) {
            return false;
        }
        int level = hal_gpio_line_get(&gpio->heartbeat);
        if (level >= 0 && level != gpio->beat) {
            return hal_fail(error, "heartbeat-line: '%.31s' of %.80s was set to %d and reads %d",
                            gpio->config.heartbeat_line, gpio->config.chip, gpio->beat, level);
        }
        is_read = is_read && level >= 0;
    }
    hal_add(unproven, is_read ? "heartbeat-line: moves, but not that its one-shot acts"
                              : "heartbeat-line: cannot be read back");
    return true;
}

static bool prove_interlock(struct hal_gpio *gpio, struct hal_error *unproven,
                            struct hal_error *error)
{
    bool closed = false;
    if (!gpio_interlock(gpio, &closed, error)) {
        return false;
    }
    if (closed) {
        hal_add(unproven, "interlock-line: closed since the start, not that it opens");
    }
    return true;
}

static bool gpio_prove(void *context, struct hal_error *unproven, struct hal_error *error)
{
    struct hal_gpio *gpio = context;
    unproven->text[0] = 0;
    if (!gpio->can_read) {
        hal_add(unproven, "laser-line: cannot be read back");
    }
    return (gpio->config.heartbeat_line == NULL || prove_heartbeat(gpio, unproven, error)) &&
           (gpio->config.interlock_line == NULL || prove_interlock(gpio, unproven, error));
}

void hal_gpio_init(struct hal_gpio *gpio, const struct hal_gpio_config *config)
{
    *gpio = (struct hal_gpio){.strobe = {gpio, gpio_open, gpio_close, gpio_set, gpio_beat,
                                         gpio_interlock, gpio_judged, gpio_level, gpio_prove},
                              .interlock_fd = -1,
                              .laser_fd = -1,
                              .config = *config,
                              .laser = {.fd = -1},
                              .interlock = {.fd = -1},
                              .heartbeat = {.fd = -1},
                              .what = "laser-line: not taken"};
}
