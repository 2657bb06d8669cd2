/* Settings of isohead_board (firmware/app/app_config). Input: lines; those that begin with '-' are
 * arguments of the command line, all from the first other one on are the configuration file. */
#include <string.h>

#include "app_config.h"
#include "app_settings.h"

#include "fuzz.h"

#define ARGUMENTS_MAX 16

static void count_error(void *context, const char *subject, const char *text)
{
    FUZZ_CHECK(subject != NULL && subject[0] != 0 && text[0] != 0);
    ++*(int *)context;
}

static bool is_text(const char *text)
{
    return text == NULL || (strlen(text) > 0 && strlen(text) <= APP_CONFIG_VALUE_MAX);
}

static void check_values(const struct app_config *c)
{
    FUZZ_CHECK(is_text(c->rig) && is_text(c->device) && is_text(c->format) &&
               is_text(c->gpio_chip) && is_text(c->laser_line) && is_text(c->interlock_line) &&
               is_text(c->heartbeat_line) && is_text(c->watchdog) && is_text(c->path));
    FUZZ_CHECK(c->rate_mhz == 0 || (c->rate_mhz >= 1000 && c->rate_mhz <= 1000000));
    FUZZ_CHECK((int)c->exposure >= 0 && c->exposure <= APP_EXPOSURE_FIXED);
    FUZZ_CHECK(c->exposure == APP_EXPOSURE_FIXED ? c->exposure_us >= 1 && c->exposure_us <= 1000000
                                                 : c->exposure_us == 0);
    FUZZ_CHECK((int)c->gain >= 0 && c->gain <= APP_GAIN_FIXED);
    FUZZ_CHECK(c->gain == APP_GAIN_FIXED ? c->gain_value >= 0 && c->gain_value <= 1000000
                                         : c->gain_value == 0);
    FUZZ_CHECK((int)c->strobe >= 0 && c->strobe <= APP_STROBE_ALTERNATING);
    FUZZ_CHECK(c->duty_percent >= 1 && c->duty_percent <= 100);
    FUZZ_CHECK(c->laser_cap_ms >= 10 && c->laser_cap_ms <= 1000);
    FUZZ_CHECK((int)c->output >= 0 && c->output <= APP_OUTPUT_SERIAL);
    FUZZ_CHECK((int)c->log >= 0 && c->log <= APP_MESSAGES_SYSLOG);
    FUZZ_CHECK(c->status_s >= 0 && c->status_s <= 86400);
    if (c->output == APP_OUTPUT_UDP) {
        long port = strtol(c->output_port, NULL, 10);
        FUZZ_CHECK(c->output_host[0] != 0 && port >= 1 && port <= 65535);
    }
    FUZZ_CHECK(c->output != APP_OUTPUT_SERIAL ||
               (c->output_path[0] != 0 && c->output_baud >= 9600 && c->output_baud <= 921600));
}

/* What must hold between settings once all of them were right. */
static void check_good(const struct app_config *c)
{
    bool needed = !c->laser_off && !c->help && !c->version;
    FUZZ_CHECK(!needed || c->rig != NULL);
    FUZZ_CHECK(!needed || !c->laser || (c->laser_line != NULL && c->gpio_chip != NULL));
    FUZZ_CHECK(!needed || c->laser_line == NULL || c->interlock_line == NULL ||
               strcmp(c->laser_line, c->interlock_line) != 0);
}

/* The lines that begin with '-' become arguments, in place; returns what follows them. */
static char *take_arguments(char *text, char *end, char **arguments, int *count)
{
    char *at = text;
    while (at < end && *at == '-' && *count < ARGUMENTS_MAX - 1) {
        char *line_end = memchr(at, '\n', (size_t)(end - at));
        arguments[(*count)++] = at;
        if (line_end == NULL) {
            return end;
        }
        *line_end = 0;
        at = line_end + 1;
    }
    return at;
}

static void read_settings(int count, char **arguments)
{
    static struct app_config config;
    int errors = 0;
    const struct hal_log log = {&errors, count_error};
    bool good = app_config_read(&config, count, arguments, &log);
    FUZZ_CHECK(good == (errors == 0));
    FUZZ_CHECK(errors <= APP_CONFIG_ERRORS_MAX + 1);
    check_values(&config);
    if (good) {
        check_good(&config);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    char *arguments[ARGUMENTS_MAX + 1] = {"isohead_board"};
    char file_argument[64];
    int count = 1;
    char *text = malloc(size + 1);
    FUZZ_CHECK(text != NULL);
    memcpy(text, data, size);
    text[size] = 0;
    char *file = take_arguments(text, text + size, arguments, &count);
    if (file < text + size) {
        snprintf(file_argument, sizeof file_argument, "--config=%s",
                 fuzz_file_path((const uint8_t *)file, (size_t)(text + size - file)));
        arguments[count++] = file_argument;
    }
    read_settings(count, arguments);
    free(text);
    return 0;
}
