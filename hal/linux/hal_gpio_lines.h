/* hal_gpio_lines - the part of libgpiod that hal_gpio needs, the same for its versions 1 and 2.
 *
 * hal_gpio_v1.c or hal_gpio_v2.c implements it: CMake chooses (ISOHEAD_GPIOD). Nothing waits.
 * Error: errno, after false, NULL or -1.
 */
#ifndef HAL_GPIO_LINES_H
#define HAL_GPIO_LINES_H

#include "linux/hal_gpio.h"

/* The kernel's limit for names, its closing zero included. */
#define HAL_GPIO_NAME_MAX 32

struct gpiod_chip;

struct hal_gpio_chip_info {
    char name[HAL_GPIO_NAME_MAX];
    char label[HAL_GPIO_NAME_MAX];
    unsigned line_count;
};

struct hal_gpio_line_info {
    char name[HAL_GPIO_NAME_MAX]; /* "": it has none */
    char user[HAL_GPIO_NAME_MAX]; /* who has taken it, may be "" */
    bool used;
};

struct hal_gpio_request {
    unsigned offset;
    bool active_low;
    const char *consumer;
};

struct gpiod_chip *hal_gpio_chip_open(const char *path);
void hal_gpio_chip_close(struct gpiod_chip *chip);
bool hal_gpio_chip_about(struct gpiod_chip *chip, struct hal_gpio_chip_info *info);
bool hal_gpio_line_about(struct gpiod_chip *chip, unsigned offset, struct hal_gpio_line_info *info);

/* As an output that is inactive from the first moment, or an input whose both edges are events.
 * *line is not taken before. The chip stays open for as long as the line is taken. */
bool hal_gpio_line_output(struct hal_gpio_line *line, struct gpiod_chip *chip,
                          const struct hal_gpio_request *request);
bool hal_gpio_line_input(struct hal_gpio_line *line, struct gpiod_chip *chip,
                         const struct hal_gpio_request *request);

/* For a taken line. Setting to inactive is safe in a signal handler; for one that is not taken it is
 * true and does nothing. */
bool hal_gpio_line_set(struct hal_gpio_line *line, bool active);
/* 0, 1, or -1. */
int hal_gpio_line_get(struct hal_gpio_line *line);
/* Take up to HAL_GPIO_EVENTS_MAX events from the kernel: their number, or -1. */
#define HAL_GPIO_EVENTS_MAX 16
int hal_gpio_line_drain(struct hal_gpio_line *line);
/* Not taken: nothing happens. */
void hal_gpio_line_release(struct hal_gpio_line *line);

/* hal_gpio_find.c: a chip and a line on it by what a person calls them.
 * A chip: a path when there is a slash in it, else its name (gpiochip0) or its label, looked for
 * among /dev/gpiochip*. A line: its offset when it is digits only, else its name. A label or name
 * that two have is refused: the wrong line could be one that switches something on.
 * Error: which setting, what was expected, and what there is. */

/* NULL: *error. To be closed by the caller; *info describes it. */
struct gpiod_chip *hal_gpio_find_chip(const char *called, struct hal_gpio_chip_info *info,
                                      struct hal_error *error);

/* setting: its name, for errors. False: *error. */
bool hal_gpio_find_line(struct gpiod_chip *chip, const struct hal_gpio_chip_info *info,
                        const char *setting, const char *called, unsigned *offset,
                        struct hal_error *error);

#endif
