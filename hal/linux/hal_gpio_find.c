#include "linux/hal_gpio_lines.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* More to the end of an error; what does not fit is cut by its last three characters, "...". */
static void add(struct hal_error *error, const char *text)
{
    size_t length = strlen(error->text);
    size_t room = sizeof error->text - length;
    if ((size_t)snprintf(error->text + length, room, "%s", text) >= room) {
        memcpy(error->text + sizeof error->text - 4, "...", 4);
    }
}

/* The same for one of a list: a name, and what is to be said of it. */
static void add_chip(struct hal_error *list, const char *name, const char *about)
{
    add(list, " ");
    add(list, name);
    add(list, " (");
    add(list, about);
    add(list, ")");
}

static int is_gpiochip(const struct dirent *entry)
{
    return strncmp(entry->d_name, "gpiochip", strlen("gpiochip")) == 0;
}

/* Open one and ask who it is. */
static struct gpiod_chip *open_path(const char *path, struct hal_gpio_chip_info *info)
{
    struct gpiod_chip *chip = hal_gpio_chip_open(path);
    if (chip != NULL && !hal_gpio_chip_about(chip, info)) {
        int error = errno;
        hal_gpio_chip_close(chip);
        errno = error;
        return NULL;
    }
    return chip;
}

struct search {
    const char *called;
    struct gpiod_chip *chip; /* the one found */
    struct hal_gpio_chip_info info;
    int found_count;
    struct hal_error all; /* what there is, as a list */
};

static void look_at(struct search *search, const char *name)
{
    char path[sizeof "/dev/" + 255];
    struct hal_gpio_chip_info info;
    snprintf(path, sizeof path, "/dev/%s", name);
    struct gpiod_chip *chip = open_path(path, &info);
    if (chip == NULL) {
        add_chip(&search->all, name, strerror(errno));
        return;
    }
    add_chip(&search->all, info.name, info.label);
    bool same = search->called[0] != 0 &&
                (strcmp(info.name, search->called) == 0 || strcmp(info.label, search->called) == 0);
    if (!same) {
        hal_gpio_chip_close(chip);
        return;
    }
    search->found_count++;
    if (search->chip != NULL) {
        hal_gpio_chip_close(chip);
        return;
    }
    search->chip = chip;
    search->info = info;
}

static struct gpiod_chip *search_dev(const char *called, struct hal_gpio_chip_info *info,
                                     struct hal_error *error)
{
    struct search search = {.called = called};
    struct dirent **entries = NULL;
    int count = scandir("/dev", &entries, is_gpiochip, alphasort);
    if (count < 0) {
        hal_fail(error, "gpio-chip: cannot read /dev: %s", strerror(errno));
        return NULL;
    }
    for (int i = 0; i < count; i++) {
        look_at(&search, entries[i]->d_name);
        free(entries[i]);
    }
    free(entries);
    if (search.found_count == 1) {
        *info = search.info;
        return search.chip;
    }
    if (search.found_count > 1) {
        hal_gpio_chip_close(search.chip);
        hal_fail(error, "gpio-chip: %d chips are called '%.40s', expected one:%s",
                 search.found_count, called, search.all.text);
    } else {
        hal_fail(error, "gpio-chip: no chip has the name or label '%.40s'; there %s%s", called,
                 count == 0 ? "is none, no /dev/gpiochip*" : "are:", search.all.text);
    }
    return NULL;
}

struct gpiod_chip *hal_gpio_find_chip(const char *called, struct hal_gpio_chip_info *info,
                                      struct hal_error *error)
{
    if (strchr(called, '/') == NULL) {
        return search_dev(called, info, error);
    }
    struct gpiod_chip *chip = open_path(called, info);
    if (chip == NULL) {
        hal_fail(error, "gpio-chip: '%.80s': %s; expected a GPIO chip like /dev/gpiochip0", called,
                 strerror(errno));
    }
    return chip;
}

/* A line's name to the list, and whether it is the one. False: the chip does not answer. */
static bool compare(struct gpiod_chip *chip, unsigned offset, const char *called,
                    struct hal_error *all, bool *same)
{
    struct hal_gpio_line_info info;
    if (!hal_gpio_line_about(chip, offset, &info)) {
        return false;
    }
    *same = info.name[0] != 0 && strcmp(info.name, called) == 0;
    char entry[HAL_GPIO_NAME_MAX + 4];
    if (info.name[0] != 0) {
        snprintf(entry, sizeof entry, " '%s'", info.name);
    } else {
        snprintf(entry, sizeof entry, " %u", offset);
    }
    add(all, entry);
    return true;
}

static bool find_name(struct gpiod_chip *chip, const struct hal_gpio_chip_info *info,
                      const char *setting, const char *called, unsigned *offset,
                      struct hal_error *error)
{
    struct hal_error all = {""};
    int found_count = 0;
    for (unsigned i = 0; i < info->line_count; i++) {
        bool same = false;
        if (!compare(chip, i, called, &all, &same)) {
            return hal_fail(error, "%s: line %u of %s (%s) does not answer: %s", setting, i,
                            info->name, info->label, strerror(errno));
        }
        if (same) {
            found_count++;
            *offset = i;
        }
    }
    if (found_count == 1) {
        return true;
    }
    if (found_count > 1) {
        return hal_fail(error,
                        "%s: %d lines of %s (%s) are called '%.31s', expected one: give its "
                        "offset 0..%u",
                        setting, found_count, info->name, info->label, called,
                        info->line_count - 1);
    }
    hal_fail(error, "%s: no line of %s (%s) is called '%.31s'; it has:", setting, info->name,
             info->label, called);
    add(error, all.text);
    return false;
}

bool hal_gpio_find_line(struct gpiod_chip *chip, const struct hal_gpio_chip_info *info,
                        const char *setting, const char *called, unsigned *offset,
                        struct hal_error *error)
{
    if (called[strspn(called, "0123456789")] != 0 || called[0] == 0) {
        return find_name(chip, info, setting, called, offset, error);
    }
    /* More digits than any offset has would overflow. */
    unsigned long number = strlen(called) > 9 ? ~0ul : strtoul(called, NULL, 10);
    if (number >= info->line_count) {
        return hal_fail(error, "%s: line %.20s, expected 0..%u: %s (%s) has %u lines", setting,
                        called, info->line_count - 1, info->name, info->label, info->line_count);
    }
    *offset = (unsigned)number;
    return true;
}
