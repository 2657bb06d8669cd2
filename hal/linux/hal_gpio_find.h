/* hal_gpio_find - a chip and a line on it by what a person calls them.
 *
 * A chip: a path when there is a slash in it, else its name (gpiochip0) or its label, looked for
 * among /dev/gpiochip*. A line: its offset when it is digits only, else its name. A label or name
 * that two have is refused: the wrong line could be one that switches something on.
 * Error: which setting, what was expected, and what there is.
 */
#ifndef HAL_GPIO_FIND_H
#define HAL_GPIO_FIND_H

#include "linux/hal_gpio_lines.h"

/* NULL: *error. To be closed by the caller; *info describes it. */
struct gpiod_chip *hal_gpio_find_chip(const char *called, struct hal_gpio_chip_info *info,
                                      struct hal_error *error);

/* setting: its name, for errors. False: *error. */
bool hal_gpio_find_line(struct gpiod_chip *chip, const struct hal_gpio_chip_info *info,
                        const char *setting, const char *called, unsigned *offset,
                        struct hal_error *error);

#endif
