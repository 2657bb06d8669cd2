/* fake_gpio - GPIO chips that are not there: what fake_gpiod1.c and fake_gpiod2.c make libgpiod's
 * functions act on, and what a test sets up and looks at.
 *
 * Three chips: gpiochip0 (pl061) with 8 lines, and gpiochip1 and gpiochip2 (both soc) with 2:
 * see fake_gpio.c for their names. Descriptors are real ones, so that leaks and polling are real.
 */
#ifndef FAKE_GPIO_H
#define FAKE_GPIO_H

#include <stdbool.h>

#define FAKE_CHIPS 3
#define FAKE_LINES 8
#define FAKE_TRACE 64

struct fake_line {
    const char *name; /* NULL: none */
    const char *user; /* NULL: none */
    bool used;        /* by somebody else */
    bool taken, output, active_low;
    int fd;
    int level;     /* of the wire: 0 or 1 */
    bool is_stuck; /* the wire stays, whatever it is driven to */
    int event_count;
    char consumer[32];
    char trace[FAKE_TRACE]; /* levels that it was driven to as an output, '0' and '1' */
};

struct fake_chip {
    const char *name, *label;
    int line_count;
    int open_count;
    struct fake_line line[FAKE_LINES];
};

struct fake_gpio {
    struct fake_chip chip[FAKE_CHIPS];
    int chip_count;     /* as many are in /dev */
    int calls;          /* that can fail, so far */
    int fail_at;        /* this one fails, counted from 1; 0: none does */
    bool fail_for_good; /* all from then on do */
    int fail_errno;
    int object_count; /* of libgpiod's, not freed yet */
    int misuse_count; /* calls that libgpiod does not allow */
    bool unreadable;  /* outputs cannot be read */
    bool opens_more;  /* a request opens something else before the line, and keeps it */
    int more_fd;      /* that; -1: none */
};

extern struct fake_gpio fake;

void fake_reset(void);

/* The wire changes from outside; pulses: there and back. */
void fake_drive(struct fake_line *line, int level);

/* For the fakes of libgpiod. fake_fails: this call fails, errno is set. */
bool fake_fails(void);
struct fake_chip *fake_open(const char *path);
void fake_close(struct fake_chip *chip);
bool fake_take(struct fake_line *line, bool output, bool active_low, int value,
               const char *consumer);
void fake_release(struct fake_line *line);
bool fake_set(struct fake_line *line, int value);
int fake_get(struct fake_line *line);
int fake_read_events(struct fake_line *line, int event_max);

#endif
