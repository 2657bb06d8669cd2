#include "fake_gpio.h"

#include <dirent.h>
#include <errno.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

struct fake_gpio fake;

static const struct fake_gpio fresh = {
    .chip_count = FAKE_CHIPS,
    .fail_errno = EIO,
    .chip = {{.name = "gpiochip0",
              .label = "pl061",
              .line_count = 8,
              .line = {{.name = NULL},
                       {.name = "beat"},
                       {.name = "fan", .used = true, .user = "fan driver"},
                       {.name = "power", .used = true},
                       {.name = "twin"},
                       {.name = "twin"},
                       {.name = "laser", .level = 1},
                       {.name = "interlock"}}},
             {.name = "gpiochip1", .label = "soc", .line_count = 2},
             {.name = "gpiochip2", .label = "soc", .line_count = 2}}};

void fake_reset(void)
{
    fake = fresh;
}

bool fake_fails(void)
{
    fake.calls++;
    if (fake.fail_at > 0 &&
        (fake.calls == fake.fail_at || (fake.fail_for_good && fake.calls > fake.fail_at))) {
        errno = fake.fail_errno;
        return true;
    }
    return false;
}

/* In place of the C library's: what there is in /dev. */
int scandir(const char *dir, struct dirent ***list, int (*filter)(const struct dirent *),
            int (*compare)(const struct dirent **, const struct dirent **))
{
    static const char *const others[] = {".", "..", "null", "gpiomem"};
    int count = 0, i;

    (void)compare; /* they come in order */
    if (strcmp(dir, "/dev") != 0) {
        fake.misuse_count++;
    }
    if (fake_fails()) {
        return -1;
    }
    *list = malloc((FAKE_CHIPS + 4) * sizeof **list);
    for (i = 0; i < fake.chip_count + 4; i++) {
        struct dirent *entry = calloc(1, sizeof *entry);

        snprintf(entry->d_name, sizeof entry->d_name, "%s",
                 i < 4 ? others[i] : fake.chip[i - 4].name);
        if (filter(entry)) {
            (*list)[count++] = entry;
        } else {
            free(entry);
        }
    }
    return count;
}

struct fake_chip *fake_open(const char *path)
{
    int i;

    if (fake_fails()) {
        return NULL;
    }
    for (i = 0; i < fake.chip_count; i++) {
        struct fake_chip *chip = &fake.chip[i];

        if (strncmp(path, "/dev/", 5) == 0 && strcmp(path + 5, chip->name) == 0) {
            chip->open_count++;
            return chip;
        }
    }
    errno = ENOENT;
    return NULL;
}

void fake_close(struct fake_chip *chip)
{
    int i;

    fake.misuse_count += chip->open_count <= 0;
    chip->open_count--;
    for (i = 0; i < chip->line_count; i++) {
        fake.misuse_count += chip->line[i].taken; /* 2.x allows it, 1.x releases it */
    }
}

static void trace(struct fake_line *line, int level)
{
    size_t length = strlen(line->trace);

    line->level = line->is_stuck ? line->level : level;
    if (length + 1 < sizeof line->trace) {
        line->trace[length] = (char)('0' + level);
    }
}

bool fake_take(struct fake_line *line, bool output, bool active_low, int value,
               const char *consumer)
{
    if (fake_fails()) {
        return false;
    }
    if (line->used || line->taken) {
        errno = EBUSY;
        return false;
    }
    if (fake.opens_more && fake.more_fd < 0) {
        fake.more_fd = eventfd(0, EFD_CLOEXEC);
    }
    line->fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    line->taken = true;
    line->output = output;
    line->active_low = active_low;
    snprintf(line->consumer, sizeof line->consumer, "%s", consumer);
    if (output) {
        trace(line, value ^ active_low);
    }
    return true;
}

void fake_release(struct fake_line *line)
{
    fake.misuse_count += !line->taken;
    line->taken = false;
    close(line->fd);
}

bool fake_set(struct fake_line *line, int value)
{
    fake.misuse_count += !line->taken || !line->output;
    if (fake_fails()) {
        return false;
    }
    trace(line, value ^ line->active_low);
    return true;
}

int fake_get(struct fake_line *line)
{
    fake.misuse_count += !line->taken;
    if (fake.unreadable && line->output) {
        errno = EIO;
        return -1;
    }
    return fake_fails() ? -1 : line->level ^ line->active_low;
}

void fake_drive(struct fake_line *line, int level)
{
    const uint64_t one = 1;

    line->level = level;
    if (line->taken && !line->output) {
        line->event_count++;
        fake.misuse_count += write(line->fd, &one, sizeof one) != sizeof one;
    }
}

int fake_read_events(struct fake_line *line, int event_max)
{
    uint64_t count = 0;
    const int given = line->event_count < event_max ? line->event_count : event_max;

    fake.misuse_count += !line->taken || line->output || given == 0; /* it would wait for ever */
    if (fake_fails()) {
        return -1;
    }
    line->event_count -= given;
    if (line->event_count == 0) {
        fake.misuse_count += read(line->fd, &count, sizeof count) != sizeof count;
    }
    return given;
}
