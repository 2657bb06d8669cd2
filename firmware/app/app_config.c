#include "app_config.h"

#include <getopt.h>
#include <stdarg.h>
#include <string.h>

#include "app_settings.h"
#include "app_text.h"
#include "hal_file.h"

#define COMMAND_LINE "command line"
/* What getopt_long returns for a setting is its index above all letters. */
#define OPTION_FIRST 256
/* Longest part of a wrong text that is reported. */
#define QUOTE_MAX 60
/* Some editors begin a file with it. */
#define BYTE_ORDER_MARK "\xEF\xBB\xBF"
/* "FILE:LINE" */
#define PLACE_MAX (APP_CONFIG_VALUE_MAX + 16)

/* --help: where the explanations start, and how wide a line may be. */
#define HELP_COLUMN 34
#define HELP_WIDTH 80

struct reader {
    struct app_config *config;
    const struct hal_log *errors;
    int error_count;
    /* What was not understood may concern the laser's line. */
    bool line_unsure;
    const char *given[APP_SETTINGS_COUNT]; /* on the command line; NULL: not */
    int32_t line[APP_SETTINGS_COUNT];      /* in the file; 0: not */
};

struct place {
    char text[PLACE_MAX];
};

static struct place place_of(const struct reader *reader, int32_t line)
{
    struct place place;
    snprintf(place.text, sizeof place.text, "%s:%d", reader->config->path, (int)line);
    return place;
}

static void report(struct reader *reader, const char *where, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

static void report(struct reader *reader, const char *where, const char *format, ...)
{
    struct hal_error error = {"further errors are not reported"};
    reader->error_count++;
    if (reader->error_count > APP_CONFIG_ERRORS_MAX + 1) {
        return;
    }
    if (reader->error_count <= APP_CONFIG_ERRORS_MAX) {
        va_list arguments;
        va_start(arguments, format);
        vsnprintf(error.text, sizeof error.text, format, arguments);
        va_end(arguments);
        app_text_tame(error.text);
    }
    reader->errors->error(reader->errors->context, where, error.text);
}

/* Something that is none of the settings: it may have been meant to be any. */
static void report_unknown(struct reader *reader, const char *where, const char *what,
                           const char *name)
{
    int nearest = app_settings_nearest(name);
    reader->line_unsure = true;
    if (nearest >= 0) {
        report(reader, where, "unknown %s \"%.*s\", perhaps \"%s\" is meant", what, QUOTE_MAX, name,
               app_settings[nearest].name);
    } else {
        report(reader, where, "unknown %s \"%.*s\", --help lists all", what, QUOTE_MAX, name);
    }
}

static bool concerns_line(int index)
{
    size_t offset = app_settings[index].offset;
    return offset == offsetof(struct app_config, gpio_chip) ||
           offset == offsetof(struct app_config, laser_line) ||
           offset == offsetof(struct app_config, laser_active_low) ||
           offset == offsetof(struct app_config, path);
}

/* A setting is called as it is written there. */
static const char *dashes_at(const char *where)
{
    return strcmp(where, COMMAND_LINE) == 0 ? "--" : "";
}

static void take(struct reader *reader, const char *where, int index, const char *value)
{
    struct hal_error error;
    if (!app_settings_take(index, reader->config, value, &error)) {
        reader->line_unsure = reader->line_unsure || concerns_line(index);
        report(reader, where, "%s%s: %s", dashes_at(where), app_settings[index].name, error.text);
    }
}

static void list_options(struct option options[APP_SETTINGS_COUNT + 1])
{
    for (int i = 0; i < APP_SETTINGS_COUNT; i++) {
        const struct app_setting *setting = &app_settings[i];
        int argument = setting->argument != NULL ? required_argument : optional_argument;
        if (setting->place == APP_SETTINGS_COMMAND) {
            argument = no_argument;
        }
        options[i] = (struct option){setting->name, argument, NULL, OPTION_FIRST + i};
    }
    options[APP_SETTINGS_COUNT] = (struct option){NULL, 0, NULL, 0};
}

static void refuse_option(struct reader *reader, int option, const char *argument)
{
    char name[QUOTE_MAX] = {(char)optopt};
    if (optopt >= OPTION_FIRST) {
        const struct app_setting *setting = &app_settings[optopt - OPTION_FIRST];
        reader->line_unsure = true;
        if (option == ':') {
            report(reader, COMMAND_LINE, "--%s: no value, expected %s", setting->name,
                   setting->expected);
        } else {
            report(reader, COMMAND_LINE, "--%s: a value, expected none", setting->name);
        }
        return;
    }
    if (optopt == 0) {
        /* A long one, unknown or short for several. */
        argument += strspn(argument, "-");
        snprintf(name, sizeof name, "%.*s", (int)strcspn(argument, "="), argument);
    }
    report_unknown(reader, COMMAND_LINE, "option", name);
}

/* Values are kept until the file is read; of an option that stands there twice the last one. */
static void read_arguments(struct reader *reader, int count, char **arguments)
{
    struct option options[APP_SETTINGS_COUNT + 1];
    int option = 0;
    list_options(options);
    opterr = 0;
    optind = 0; /* from the start, also at a second call */
    /* The leading ':' distinguishes a missing argument from an unknown option. */
    while ((option = getopt_long(count, arguments, ":", options, NULL)) != -1) {
        if (option < OPTION_FIRST) {
            refuse_option(reader, option, arguments[optind - 1]);
        } else {
            reader->given[option - OPTION_FIRST] = optarg != NULL ? optarg : "on";
        }
    }
    for (int i = optind; i < count; i++) {
        reader->line_unsure = true;
        report(reader, COMMAND_LINE, "unexpected argument \"%.*s\", expected options only%s",
               QUOTE_MAX, arguments[i],
               strcmp(arguments[i], "off") == 0 ? "; a flag is switched off by --FLAG=off" : "");
    }
}

/* Those that may stand in a file, too, or the others. */
static void take_arguments(struct reader *reader, bool in_file)
{
    for (int i = 0; i < APP_SETTINGS_COUNT; i++) {
        if (reader->given[i] != NULL && in_file == (app_settings[i].place == APP_SETTINGS_BOTH)) {
            take(reader, COMMAND_LINE, i, reader->given[i]);
        }
    }
}

static bool is_blank(char letter)
{
    return letter == ' ' || letter == '\t' || letter == '\r';
}

/* Without blanks at both ends; cuts the text. */
static char *trim(char *text)
{
    while (is_blank(*text)) {
        text++;
    }
    size_t length = strlen(text);
    while (length > 0 && is_blank(text[length - 1])) {
        length--;
    }
    text[length] = 0;
    return text;
}

static void cut_comment(char *line)
{
    for (char *at = line; *at != 0; at++) {
        if (*at == '#' && (at == line || is_blank(at[-1]))) {
            *at = 0;
            return;
        }
    }
}

static void read_setting(struct reader *reader, int32_t line, const char *key, const char *value)
{
    struct place place = place_of(reader, line);
    int index = app_settings_find(key);
    if (index < 0) {
        report_unknown(reader, place.text, "key", key);
    } else if (app_settings[index].place != APP_SETTINGS_BOTH) {
        report(reader, place.text, "%s: in a file, expected on the command line only", key);
    } else if (reader->line[index] != 0) {
        reader->line_unsure = reader->line_unsure || concerns_line(index);
        report(reader, place.text, "%s: a second time, after line %d, expected once", key,
               (int)reader->line[index]);
    } else {
        reader->line[index] = line;
        take(reader, place.text, index, value);
    }
}

static void read_line(struct reader *reader, int32_t line, char *text, size_t length)
{
    struct place place = place_of(reader, line);
    if (strlen(text) != length) {
        reader->line_unsure = true;
        report(reader, place.text, "zero byte at column %zu, expected text", strlen(text) + 1);
        return;
    }
    cut_comment(text);
    char *key = trim(text);
    if (*key == 0) {
        return;
    }
    char *equals = strchr(key, '=');
    if (equals == NULL) {
        reader->line_unsure = true;
        report(reader, place.text, "\"%.*s\", expected \"key = value\"", QUOTE_MAX, key);
        return;
    }
    *equals = 0;
    read_setting(reader, line, trim(key), trim(equals + 1));
}

/* Its number may lack digits, and the lines behind it their limits. */
static void refuse_cut_line(struct reader *reader, int32_t line)
{
    struct place place = place_of(reader, line);
    reader->line_unsure = true;
    report(reader, place.text, "the last line has no line end: the file may be cut");
}

static void read_text(struct reader *reader, size_t size)
{
    char *at = reader->config->text;
    char *end = at + size;
    *end = 0;
    at += strncmp(at, BYTE_ORDER_MARK, strlen(BYTE_ORDER_MARK)) == 0 ? strlen(BYTE_ORDER_MARK) : 0;
    for (int32_t line = 1; at < end; line++) {
        char *line_end = memchr(at, '\n', (size_t)(end - at));
        if (line_end == NULL) {
            refuse_cut_line(reader, line);
            return;
        }
        *line_end = 0;
        read_line(reader, line, at, (size_t)(line_end - at));
        at = line_end + 1;
    }
}

static void read_file(struct reader *reader)
{
    struct app_config *config = reader->config;
    struct hal_error error;
    FILE *file = hal_file_open(config->path, APP_CONFIG_TEXT_MAX, &error);
    bool good = file != NULL;
    size_t size = 0;
    if (good) {
        size = fread(config->text, 1, APP_CONFIG_TEXT_MAX, file);
        good = !ferror(file);
        fclose(file);
        hal_fail(&error, "cannot be read");
    }
    if (good) {
        read_text(reader, size);
    } else {
        reader->line_unsure = true;
        report(reader, config->path, "%s", error.text);
    }
}

/* Where a setting got its value; one that nobody gave would be looked for in the file. */
static struct place place_of_setting(const struct reader *reader, const char *name)
{
    int index = app_settings_find(name);
    struct place place = {COMMAND_LINE};
    if (reader->given[index] == NULL && reader->line[index] != 0) {
        place = place_of(reader, reader->line[index]);
    } else if (reader->given[index] == NULL && reader->config->path != NULL) {
        snprintf(place.text, sizeof place.text, "%s", reader->config->path);
    }
    return place;
}

static void demand(struct reader *reader, bool good, const char *name, const char *text)
{
    if (!good) {
        struct place place = place_of_setting(reader, name);
        report(reader, place.text, "%s%s: %s", dashes_at(place.text), name, text);
    }
}

static bool same_line(const char *one, const char *other)
{
    return one != NULL && other != NULL && strcmp(one, other) == 0;
}

static void check_lines(struct reader *reader)
{
    const struct app_config *config = reader->config;
    bool chip = config->gpio_chip != NULL;
    const char *const no_chip = "given, but no gpio-chip, expected both";
    demand(reader, chip || config->laser_line == NULL, "laser-line", no_chip);
    demand(reader, chip || config->interlock_line == NULL, "interlock-line", no_chip);
    demand(reader, chip || config->heartbeat_line == NULL, "heartbeat-line", no_chip);
    demand(reader, !config->laser_active_low || config->laser_line != NULL, "laser-active-low",
           "on, but no laser-line, expected both");
    demand(reader, !config->interlock_active_low || config->interlock_line != NULL,
           "interlock-active-low", "on, but no interlock-line, expected both");
    demand(reader, !same_line(config->interlock_line, config->laser_line), "interlock-line",
           "the laser-line too, expected another line");
    demand(reader, !same_line(config->heartbeat_line, config->laser_line), "heartbeat-line",
           "the laser-line too, expected another line");
    demand(reader, !same_line(config->heartbeat_line, config->interlock_line), "heartbeat-line",
           "the interlock-line too, expected another line");
}

/* A device that is not there may be plugged in later. */
static void check_device(struct reader *reader)
{
    struct app_config *config = reader->config;
    enum hal_file_kind kind = hal_file_kind(config->device);
    config->is_directory = kind == HAL_FILE_DIRECTORY;
    demand(reader, kind != HAL_FILE_OTHER, "device",
           "neither a camera nor a directory, expected /dev/videoN or a directory with frames");
    demand(reader, !config->is_directory || !config->laser, "laser",
           "on, but the device is a directory, expected laser off: old frames show nothing of what "
           "the laser does");
    if (config->is_directory && config->rig == NULL) {
        snprintf(config->directory_rig, sizeof config->directory_rig, "%s/rig.json",
                 config->device);
        config->rig = config->directory_rig;
    }
}

static void check(struct reader *reader)
{
    const struct app_config *config = reader->config;
    check_device(reader);
    demand(reader, config->rig != NULL, "rig",
           "missing, expected the file with the calibration; --help lists all settings");
    demand(reader, !config->laser || config->laser_line != NULL, "laser",
           "on, but no laser-line, expected the line that switches it");
    demand(reader, config->laser || config->strobe != APP_STROBE_ALTERNATING, "strobe",
           "alternating without laser, expected always, gated or laser on");
    demand(reader, config->record != NULL || config->record_when == APP_RECORD_ALWAYS,
           "record-when", "given, but no record, expected the directory too");
    check_lines(reader);
}

bool app_config_read(struct app_config *config, int argument_count, char **arguments,
                     const struct hal_log *errors)
{
    struct reader reader = {.config = config, .errors = errors};
    app_settings_default(config);
    read_arguments(&reader, argument_count, arguments);
    take_arguments(&reader, false);
    if (config->help || config->version) {
        return reader.error_count == 0;
    }
    if (config->path != NULL) {
        read_file(&reader);
    }
    take_arguments(&reader, true);
    if (!config->laser_off && reader.error_count == 0) {
        check(&reader);
    }
    if (reader.line_unsure) {
        /* With its polarity misread, "off" would be on. */
        config->laser_line = NULL;
        config->laser = false;
    }
    return reader.error_count == 0;
}

/* Words in lines of HELP_WIDTH, from the column on; the first line is there already. */
static void print_wrapped(FILE *file, const char *text)
{
    int column = HELP_COLUMN;
    while (*text != 0) {
        int length = (int)strcspn(text, " ");
        if (column + length > HELP_WIDTH) {
            fprintf(file, "\n%*s", HELP_COLUMN, "");
            column = HELP_COLUMN;
        }
        fprintf(file, "%.*s", length, text);
        text += length;
        column += length;
        if (*text == ' ') {
            text++;
            column++;
            fputs(*text != 0 && column + (int)strcspn(text, " ") <= HELP_WIDTH ? " " : "", file);
        }
    }
    fputc('\n', file);
}

void app_config_help(FILE *file)
{
    fputs("isohead_board [options]\n"
          "Find a person's head in 3-D in the frames of a camera; a JSON record per frame.\n",
          file);
    for (int i = 0; i < APP_SETTINGS_COUNT; i++) {
        const struct app_setting *setting = &app_settings[i];
        if (setting->heading != NULL) {
            fprintf(file, "\n%s\n", setting->heading);
        }
        int width = fprintf(file, "  --%s", setting->name);
        if (setting->argument != NULL) {
            width += fprintf(file, " %s", setting->argument);
        } else if (setting->place == APP_SETTINGS_BOTH) {
            width += fprintf(file, "[=on|off]");
        }
        fprintf(file, "%*s", HELP_COLUMN - width, "");
        print_wrapped(file, setting->help);
    }
    fputs("\n"
          "In a configuration file each is a line `name = value`, flags `name = on` or\n"
          "`off`; '#' starts a comment.\n"
          "Exit status: 0 ended as requested, 1 could not go on, 2 wrong usage or settings;\n"
          "3 of --laser-off: there is no such chip or line, or somebody else has it.\n",
          file);
}
