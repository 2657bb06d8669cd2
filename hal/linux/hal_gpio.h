/* hal_gpio - the laser's line, its interlock and a heartbeat as struct hal_strobe, through libgpiod.
 *
 * In:    a chip and lines by name, see the configuration. Only hal_gpio_v1.c and hal_gpio_v2.c know
 *        which libgpiod there is.
 * Out:   "on" and "closed" are logical: active-low lines are turned around by the kernel. The laser's
 *        line is requested as an output that is off, in one call: it is never on in between. With a
 *        push-pull output of the controller; a bias is the board's business (docs/hardware.md).
 * Interlock: both edges are watched. interlock() says "closed" only when the line is closed now and
 *        nothing has happened to it since the call before: an opening between two calls is not lost,
 *        and a bouncing contact is reported as open until it settles. One that has just closed is
 *        reported as open once more, on purpose. The kernel keeps the events, so nothing is missed
 *        between.
 * Signals: set(false) is safe in a signal handler in fact, not by promise. gpiod_line_set_value of
 *        1.6.3 and gpiod_line_request_set_value of 2.2 and 2.3, and those that read it back, compare
 *        fields of their own, fill a structure on the stack and call ioctl: no lock, no allocation, no stdio. (2.x has asserts
 *        that hold here.) On this side: one atomic pointer, which is NULL whenever the line is not
 *        taken, and an error text that is built without stdio. errno is changed.
 * Not taken: set(false) is true, as nothing here drives the line; set(true), beat(), interlock() and level() fail.
 * Read-back: after each set() the line is read, where the chip can read its outputs; open() finds that
 *        out. On after it was switched off is an error, always. Off after it was switched on is one
 *        once it has been read as on: some controllers read 0 whatever an output drives, and a line
 *        that stays dark hurts nobody.
 * Off:   is tried HAL_GPIO_OFF_TRIES times before it is reported as failed; close() tries as often, and
 *        gives the line back whatever comes of it.
 * After: the kernel does not touch the level of a line that is given back. Most controllers go on
 *        driving it, low after close(); some make it an input (pinctrl drivers that mux the pin
 *        anew), and from a reset until open() it is one anyway: a pull-down at the driver's gate has
 *        to hold it off. A process that dies by SIGKILL with the laser on leaves it on for the same
 *        reason: see hal_guard.h.
 * Error: names setting, chip and line, what was expected, and what there is when a name is unknown.
 */
#ifndef HAL_GPIO_H
#define HAL_GPIO_H

#include "hal.h"

#define HAL_GPIO_OFF_TRIES 3
/* "CHIP.OFFSET" */
#define HAL_GPIO_LINE_NAME_MAX 48

/* The texts belong to the caller and live as long as the strobe. */
struct hal_gpio_config {
    const char *chip;           /* path, name (gpiochip0) or label */
    const char *laser_line;     /* name on that chip; digits only: offset */
    bool laser_active_low;      /* low switches the laser on */
    const char *interlock_line; /* NULL: none */
    bool interlock_active_low;  /* low means closed, the laser is allowed; else high does */
    const char *heartbeat_line; /* NULL: none */
    const char *consumer;       /* shown by gpioinfo; at most 31 characters of it */
};

/* A line that is or is not taken; for hal_gpio_v1.c and hal_gpio_v2.c alone. */
struct hal_gpio_line {
    void *_Atomic handle; /* libgpiod's; NULL: not taken */
    unsigned offset;
    int fd;       /* the kernel's descriptor of the taken line; -1: not taken */
    void *events; /* buffer for events, where libgpiod wants one */
};

struct hal_gpio {
    struct hal_strobe strobe;
    /* To be waited for with POLLIN: then interlock() has news. -1: no interlock, or not taken. */
    int interlock_fd;
    /* As long as a process holds this open, the kernel keeps the line for it. -1: not taken. */
    int laser_fd;
    /* The laser's line, such as gpiochip0.17, by whatever name it was found; "" before. */
    char line_name[HAL_GPIO_LINE_NAME_MAX];
    /* Why open() has failed: the chip or a line was not found, or somebody has it who is not the consumer. */
    bool has_no_line;
    /* Private from here on. */
    struct hal_gpio_config config;
    struct gpiod_chip *chip;
    struct hal_gpio_line laser, interlock, heartbeat;
    bool beat;     /* the heartbeat's level */
    bool can_read; /* the laser's line */
    bool was_on;   /* it has been read as on */
    char what[96]; /* the laser's line in errors */
};

/* Nothing is opened yet. */
void hal_gpio_init(struct hal_gpio *gpio, const struct hal_gpio_config *config);

#endif
