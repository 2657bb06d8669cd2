#include "app_settings.h"

#include <limits.h>
#include <string.h>

#include "app_text.h"

#define BAUD_DEFAULT 115200
#define VIEW_LOCAL "127.0.0.1"
/* Longest part of a wrong value that is reported. */
#define QUOTE_MAX 60
/* A name with more wrong letters than this, or with no right one, is not meant. */
#define DISTANCE_MAX 2

static void *place_of(struct app_config *config, size_t offset)
{
    return (char *)config + offset;
}

/* Decimal digits, with a point and up to so many decimals; the value in 10^-decimals. */
static bool read_number(const char *text, int32_t decimals, int64_t *value)
{
    int64_t sum = 0;
    int32_t missing = decimals;
    bool point = false;
    bool digit = false;
    for (; *text != 0; text++) {
        if (*text == '.' && digit && !point && decimals > 0 && text[1] != 0) {
            point = true;
            continue;
        }
        if (*text < '0' || *text > '9' || (point && missing-- == 0) || sum > INT32_MAX) {
            return false;
        }
        digit = true;
        sum = sum * 10 + (*text - '0');
    }
    for (; missing > 0; missing--) {
        sum *= 10;
    }
    *value = sum;
    return digit;
}

static bool take_number_at(const struct app_setting *setting, struct app_config *config,
                           const char *text, size_t offset)
{
    int64_t value = 0;
    if (!read_number(text, setting->decimals, &value) || value < setting->minimum ||
        value > setting->maximum) {
        return false;
    }
    *(int32_t *)place_of(config, offset) = (int32_t)value;
    return true;
}

static bool take_number(const struct app_setting *setting, struct app_config *config,
                        const char *value)
{
    return take_number_at(setting, config, value, setting->offset);
}

/* Index of a word, or of the NULL behind the last. */
static int find_word(const char *const *words, const char *value)
{
    int index = 0;
    while (words[index] != NULL && strcmp(words[index], value) != 0) {
        index++;
    }
    return index;
}

/* Enumerations differ in type, not in size. */
static void put_choice(const struct app_setting *setting, struct app_config *config, int choice)
{
    _Static_assert(sizeof(enum app_exposure) == sizeof choice, "");
    _Static_assert(sizeof(enum app_gain) == sizeof choice, "");
    _Static_assert(sizeof(enum app_strobe) == sizeof choice, "");
    _Static_assert(sizeof(enum app_messages) == sizeof choice, "");
    _Static_assert(sizeof(enum app_repeat) == sizeof choice, "");
    _Static_assert(sizeof(enum app_record_when) == sizeof choice, "");
    memcpy(place_of(config, setting->offset), &choice, sizeof choice);
}

static bool take_choice(const struct app_setting *setting, struct app_config *config,
                        const char *value)
{
    int choice = find_word(setting->words, value);
    if (setting->words[choice] == NULL) {
        return false;
    }
    put_choice(setting, config, choice);
    return true;
}

/* A number stands for the choice behind the words. */
static bool take_choice_or_number(const struct app_setting *setting, struct app_config *config,
                                  const char *value)
{
    int choice = find_word(setting->words, value);
    int32_t *number = place_of(config, setting->number_offset);
    if (setting->words[choice] != NULL) {
        *number = 0;
    } else if (!take_number_at(setting, config, value, setting->number_offset)) {
        return false;
    }
    put_choice(setting, config, choice);
    return true;
}

static bool take_text(const struct app_setting *setting, struct app_config *config,
                      const char *value)
{
    *(const char **)place_of(config, setting->offset) = value;
    return true;
}

/* "none" is written out where a file is to say that there is none. */
static bool take_line_or_none(const struct app_setting *setting, struct app_config *config,
                              const char *value)
{
    return take_text(setting, config, strcmp(value, "none") == 0 ? NULL : value);
}

/* An accelerometer is all there is. */
static bool take_up(const struct app_setting *setting, struct app_config *config, const char *value)
{
    const size_t prefix = strlen(APP_CONFIG_IIO);
    return strncmp(value, APP_CONFIG_IIO, prefix) == 0 && value[prefix] != 0 &&
           take_text(setting, config, value);
}

static bool take_word(const struct app_setting *setting, struct app_config *config,
                      const char *value)
{
    const char *word = setting->words[find_word(setting->words, value)];
    return word != NULL && take_text(setting, config, word);
}

static bool take_flag(const struct app_setting *setting, struct app_config *config,
                      const char *value)
{
    bool on = strcmp(value, "on") == 0;
    if (!on && strcmp(value, "off") != 0) {
        return false;
    }
    *(bool *)place_of(config, setting->offset) = on;
    return true;
}

/* HOST:PORT, [ADDRESS]:PORT. */
static bool take_host_port(const char *value, char host[APP_CONFIG_VALUE_MAX + 1],
                           char port_text[sizeof "65535"])
{
    const char *colon = strrchr(value, ':');
    int64_t port = 0;
    if (colon == NULL || !read_number(colon + 1, 0, &port) || port < 1 || port > 65535) {
        return false;
    }
    size_t length = (size_t)(colon - value);
    /* Only in brackets may a host have colons: where it ends were not clear. */
    const char *forbidden = ":[]";
    if (length > 2 && value[0] == '[' && value[length - 1] == ']') {
        value++;
        length -= 2;
        forbidden = "[]";
    }
    if (length == 0 || strcspn(value, forbidden) < length) {
        return false;
    }
    memcpy(host, value, length);
    host[length] = 0;
    snprintf(port_text, sizeof "65535", "%d", (int)port);
    return true;
}

static bool take_udp(struct app_config *config, const char *value)
{
    if (!take_host_port(value, config->output_host, config->output_port)) {
        return false;
    }
    config->output = APP_OUTPUT_UDP;
    return true;
}

/* ADDRESS:PORT; PORT alone is for this machine only. */
static bool take_view(const struct app_setting *setting, struct app_config *config,
                      const char *value)
{
    char local[sizeof VIEW_LOCAL ":65535"];
    (void)setting;
    if (value[strspn(value, "0123456789")] != 0 || strlen(value) >= sizeof "65535") {
        return take_host_port(value, config->view_host, config->view_port);
    }
    snprintf(local, sizeof local, VIEW_LOCAL ":%s", value);
    return take_host_port(local, config->view_host, config->view_port);
}

/* PATH, PATH:BAUD; a path may have colons, and what follows its last one is no number. */
static bool take_serial(struct app_config *config, const char *value)
{
    static const int32_t known[] = {9600, 19200, 38400, 57600, 115200, 230400, 460800, 921600};
    const char *colon = strrchr(value, ':');
    size_t length = strlen(value);
    int64_t baud = BAUD_DEFAULT;
    if (colon != NULL && colon[1 + strspn(colon + 1, "0123456789")] == 0) {
        length = (size_t)(colon - value);
        if (!read_number(colon + 1, 0, &baud)) {
            return false;
        }
    }
    size_t i = 0;
    while (i < sizeof known / sizeof known[0] && known[i] != baud) {
        i++;
    }
    if (length == 0 || i == sizeof known / sizeof known[0]) {
        return false;
    }
    memcpy(config->output_path, value, length);
    config->output_path[length] = 0;
    config->output_baud = (int32_t)baud;
    config->output = APP_OUTPUT_SERIAL;
    return true;
}

static bool take_output(const struct app_setting *setting, struct app_config *config,
                        const char *value)
{
    (void)setting;
    if (strcmp(value, "-") == 0) {
        config->output = APP_OUTPUT_STDOUT;
        return true;
    }
    if (strncmp(value, "udp:", strlen("udp:")) == 0) {
        return take_udp(config, value + strlen("udp:"));
    }
    return strncmp(value, "serial:", strlen("serial:")) == 0 &&
           take_serial(config, value + strlen("serial:"));
}

static const char *const format_words[] = {"auto", "GREY", "Y10",  "Y10P",    "Y12", "Y12P",
                                           "Y16",  "YUYV", "UYVY", "convert", NULL};
static const char *const exposure_words[] = {"auto", "keep", "steer", NULL};
static const char *const repeat_words[] = {"auto", "on", "off", NULL};
static const char *const gain_words[] = {"auto", "keep", NULL};
static const char *const strobe_words[] = {"always", "gated", "alternating", NULL};
static const char *const record_words[] = {"always", "signal", "moved", NULL};
static const char *const log_words[] = {"stderr", "syslog", NULL};

#define AT(member) offsetof(struct app_config, member)
#define ON_OR_OFF "on or off"
#define LINE "the name of a line or its offset"

const struct app_setting app_settings[] = {
    {"rig", "FILE", "a file",
     "the calibrated rig, rig.json; must be given, but for a directory that has one",
     .take = take_text, .offset = AT(rig), .heading = "Camera"},
    {"device", "PATH", "a device or a directory",
     "the camera, default /dev/video0; or a directory with frames, which come at their own times, "
     "or at the rate; "
     "no laser then",
     .take = take_text, .offset = AT(device)},
    {"up", "iio:DEVICE", "iio: and the name of an accelerometer, its iio:deviceN or its directory",
     "which way is up, by this accelerometer, for a rig that does not say it, and to check one "
     "that "
     "does; default: none",
     .take = take_up, .offset = AT(up)},
    {"loop", NULL, "auto, on or off",
     "a directory's frames again and again: on; once: off; auto, the default, is on with a live "
     "view and for a check",
     .take = take_choice, .offset = AT(repeat), .words = repeat_words},
    {"format", "NAME", "auto, GREY, Y10, Y10P, Y12, Y12P, Y16, YUYV, UYVY or convert",
     "how the camera sends its samples: GREY, Y10, Y10P, Y12, Y12P, Y16, YUYV, UYVY, or convert, "
     "grey from what else it has; default auto, the best of them that it has",
     .take = take_word, .offset = AT(format), .words = format_words},
    {"rate", "FPS", "frames per second from 1 to 1000, with up to 3 decimals",
     "frames per second; default: as the camera is set", .take = take_number,
     .offset = AT(rate_mhz), .minimum = 1000, .maximum = 1000000, .decimals = 3},
    {"exposure", "WHAT", "auto, keep, steer or microseconds from 1 to 1000000",
     "auto, the camera's own control, the default; keep, as it is; steer, by the dots' brightness; "
     "or microseconds",
     .take = take_choice_or_number, .offset = AT(exposure), .words = exposure_words, .minimum = 1,
     .maximum = 1000000, .number_offset = AT(exposure_us)},
    {"gain", "WHAT", "auto, keep or a number from 0 to 1000000",
     "auto, the default; keep; or a number in the camera's own unit", .take = take_choice_or_number,
     .offset = AT(gain), .words = gain_words, .maximum = 1000000, .number_offset = AT(gain_value)},

    {"laser", NULL, ON_OR_OFF, "the laser may be switched on; without this it stays off",
     .take = take_flag, .offset = AT(laser), .heading = "Laser"},
    {"strobe", "MODE", "always, gated or alternating",
     "always, on while frames come, the default; gated, on for each frame's exposure; alternating, "
     "every other frame is dark",
     .take = take_choice, .offset = AT(strobe), .words = strobe_words},
    {"gpio-chip", "CHIP", "the path, name or label of a GPIO chip",
     "path, name or label of the GPIO chip that has the lines", .take = take_text,
     .offset = AT(gpio_chip)},
    {"laser-line", "LINE", LINE, "name or offset of the laser's line", .take = take_text,
     .offset = AT(laser_line)},
    {"laser-active-low", NULL, ON_OR_OFF, "low is on", .take = take_flag,
     .offset = AT(laser_active_low)},
    {"interlock-line", "LINE", LINE ", or none",
     "input that must be active for the laser to be on; or none", .take = take_line_or_none,
     .offset = AT(interlock_line)},
    {"interlock-active-low", NULL, ON_OR_OFF, "low is closed", .take = take_flag,
     .offset = AT(interlock_active_low)},
    {"heartbeat-line", "LINE", LINE, "line that is toggled for an external one-shot",
     .take = take_text, .offset = AT(heartbeat_line)},
    {"duty", "PERCENT", "percent from 1 to 100", "maximum duty cycle of the laser; default 100",
     .take = take_number, .offset = AT(duty_percent), .minimum = 1, .maximum = 100},
    {"laser-cap", "MS", "milliseconds from 10 to 1000",
     "the laser goes off when it has been on for so many milliseconds without a frame that was "
     "judged; at least two frames must fit; default 200",
     .take = take_number, .offset = AT(laser_cap_ms), .minimum = 10, .maximum = 1000},

    {"output", "WHERE",
     "-, udp:HOST:PORT or serial:PATH[:BAUD] with 9600, 19200, 38400, 57600, 115200, 230400, "
     "460800 or 921600 baud",
     "where the records go: -, standard output, the default; udp:HOST:PORT; or "
     "serial:PATH[:BAUD] with 115200 baud unless given",
     .take = take_output, .heading = "Output"},
    {"log", "WHERE", "stderr or syslog", "where messages go: stderr, the default, or syslog",
     .take = take_choice, .offset = AT(log), .words = log_words},
    {"status", "SECONDS", "seconds from 0 to 86400",
     "interval of a message with rates and counts; 0: none; default 10", .take = take_number,
     .offset = AT(status_s), .maximum = 86400},
    {"watchdog", "PATH", "a device", "watchdog device to feed, such as /dev/watchdog",
     .take = take_text, .offset = AT(watchdog)},
    {"paper", NULL, ON_OR_OFF, "the paper's method alone: every frame on its own",
     .take = take_flag, .offset = AT(paper)},
    {"view", "[ADDRESS:]PORT", "a port from 1 to 65535, or ADDRESS:PORT with a numeric address",
     "a live view for browsers at this port, of this machine alone unless an address is given; its "
     "URL "
     "is in the messages; default: none",
     .take = take_view},

    {"record", "DIR", "a directory",
     "record frames here, as directories that host_sim reads; default: none", .take = take_text,
     .offset = AT(record), .heading = "Recording"},
    {"record-when", "WHEN", "always, signal, moved or seconds from 1 to 86400",
     "always, all frames, the default; or some seconds before and after: signal, SIGUSR1 alone; "
     "moved, "
     "that the rig has moved; seconds without a head",
     .take = take_choice_or_number, .offset = AT(record_when), .words = record_words, .minimum = 1,
     .maximum = 86400, .number_offset = AT(record_no_head_s)},
    {"record-seconds", "SECONDS", "seconds from 1 to 3600",
     "so many seconds before and after; default 10", .take = take_number, .offset = AT(record_s),
     .minimum = 1, .maximum = 3600},
    {"record-memory", "MB", "megabytes from 1 to 4096",
     "memory for frames that wait to be written, or for what they are written for; default 32",
     .take = take_number, .offset = AT(record_memory_mb), .minimum = 1, .maximum = 4096},
    {"record-max", "MB", "megabytes from 1 to 1000000",
     "all files in the directory, at most; default 1000", .take = take_number,
     .offset = AT(record_max_mb), .minimum = 1, .maximum = 1000000},

    {"config", "FILE", "a file", "read settings from here too; these options win",
     .take = take_text, .offset = AT(path), .place = APP_SETTINGS_OPTION,
     .heading = "On the command line only"},
    {"laser-off", NULL, NULL, "make the laser's line inactive, give it back, and end",
     .take = take_flag, .offset = AT(laser_off), .place = APP_SETTINGS_COMMAND},
    {"check", NULL, NULL,
     "say after 60 frames whether the rig still fits, and end: with 0 if it does, else 1; no "
     "records",
     .take = take_flag, .offset = AT(check), .place = APP_SETTINGS_COMMAND},
    {"help", NULL, NULL, "this text", .take = take_flag, .offset = AT(help),
     .place = APP_SETTINGS_COMMAND},
    {"version", NULL, NULL, "the version", .take = take_flag, .offset = AT(version),
     .place = APP_SETTINGS_COMMAND},
};

_Static_assert(sizeof app_settings / sizeof app_settings[0] == APP_SETTINGS_COUNT, "");

int app_settings_find(const char *name)
{
    for (int i = 0; i < APP_SETTINGS_COUNT; i++) {
        if (strcmp(app_settings[i].name, name) == 0) {
            return i;
        }
    }
    return -1;
}

int app_settings_nearest(const char *name)
{
    int nearest = -1;
    int min = DISTANCE_MAX + 1;
    if (strlen(name) > APP_TEXT_NAME_MAX) {
        return -1;
    }
    for (int i = 0; i < APP_SETTINGS_COUNT; i++) {
        int letters = app_text_distance(name, app_settings[i].name);
        if (letters < min && letters < (int)strlen(name)) {
            min = letters;
            nearest = i;
        }
    }
    return nearest;
}

bool app_settings_take(int index, struct app_config *config, const char *value,
                       struct hal_error *error)
{
    const struct app_setting *setting = &app_settings[index];
    size_t length = strlen(value);
    if (length == 0) {
        return hal_fail(error, "empty, expected %s", setting->expected);
    }
    if (length > APP_CONFIG_VALUE_MAX) {
        return hal_fail(error, "%zu bytes, expected at most %d", length, APP_CONFIG_VALUE_MAX);
    }
    for (size_t i = 0; i < length; i++) {
        if ((unsigned char)value[i] < ' ' || value[i] == 0x7f) {
            return hal_fail(error, "control character %d, expected %s", value[i],
                            setting->expected);
        }
    }
    if (!setting->take(setting, config, value)) {
        return hal_fail(error, "\"%.*s\", expected %s", QUOTE_MAX, value, setting->expected);
    }
    return true;
}

static void write_number(const struct app_setting *setting, int32_t value, struct app_write *write)
{
    struct app_decimal decimal;
    int32_t unit = 1;
    for (int32_t i = 0; i < setting->decimals; i++) {
        unit *= 10;
    }
    if (setting->decimals == 0) {
        app_write_int(write, value);
        return;
    }
    snprintf(decimal.text, sizeof decimal.text, "%d.%0*d", (int)(value / unit),
             (int)setting->decimals, (int)(value % unit));
    app_write_decimal(write, decimal);
}

static void write_output(const struct app_config *config, struct app_write *write)
{
    char text[APP_CONFIG_VALUE_MAX + 32] = "-";
    if (config->output == APP_OUTPUT_UDP) {
        snprintf(text, sizeof text, "udp:[%s]:%s", config->output_host, config->output_port);
    } else if (config->output == APP_OUTPUT_SERIAL) {
        snprintf(text, sizeof text, "serial:%s:%d", config->output_path, (int)config->output_baud);
    }
    app_write_string(write, text);
}

static void write_view(const struct app_config *config, struct app_write *write)
{
    char text[APP_CONFIG_VALUE_MAX + 32];
    snprintf(text, sizeof text, "[%s]:%s", config->view_host, config->view_port);
    app_write_string_or_null(write, config->view_port[0] != 0 ? text : NULL);
}

static int32_t number_at(const struct app_config *config, size_t offset)
{
    int32_t number = 0;
    memcpy(&number, (const char *)config + offset, sizeof number);
    return number;
}

static const char *text_at(const struct app_config *config, size_t offset)
{
    const char *text = NULL;
    memcpy(&text, (const char *)config + offset, sizeof text);
    return text;
}

static void write_value(const struct app_setting *setting, const struct app_config *config,
                        struct app_write *write)
{
    if (setting->take == take_output) {
        write_output(config, write);
    } else if (setting->take == take_view) {
        write_view(config, write);
    } else if (setting->take == take_flag) {
        app_write_bool(write, *((const char *)config + setting->offset) != 0);
    } else if (setting->take == take_number) {
        write_number(setting, number_at(config, setting->offset), write);
    } else if (setting->take == take_text || setting->take == take_word ||
               setting->take == take_line_or_none || setting->take == take_up) {
        app_write_string_or_null(write, text_at(config, setting->offset));
    } else if (setting->words[number_at(config, setting->offset)] != NULL) {
        app_write_string(write, setting->words[number_at(config, setting->offset)]);
    } else {
        app_write_int(write, number_at(config, setting->number_offset));
    }
}

void app_settings_write(const struct app_config *config, struct app_write *write)
{
    app_write_open(write, '{');
    for (int i = 0; i < APP_SETTINGS_COUNT; i++) {
        if (app_settings[i].place == APP_SETTINGS_BOTH) {
            app_write_key(write, app_settings[i].name);
            write_value(&app_settings[i], config, write);
        }
    }
    app_write_close(write, '}');
}

void app_settings_default(struct app_config *config)
{
    memset(config, 0, sizeof *config);
    config->device = "/dev/video0";
    config->format = format_words[0];
    config->rate_mhz = 0;
    config->duty_percent = 100;
    config->laser_cap_ms = 200;
    config->output_baud = BAUD_DEFAULT;
    config->status_s = 10;
    config->record_s = 10;
    config->record_memory_mb = 32;
    config->record_max_mb = 1000;
}
