/* app_config: what the command line and the file of isohead_board say, and all that can be wrong
 * with them. */
#include "app_config.h"

#include <stdlib.h>
#include <unistd.h>

#include "app_settings.h"
#include "ih_test.h"

#define ARGUMENTS_MAX 40
#define ERRORS_MAX 40
#define PATH "test_config.conf"

static struct app_config config;
static char errors[ERRORS_MAX][600];
static int error_count;

static void note(void *context, const char *subject, const char *text)
{
    (void)context;
    TEST_ASSERT_LESS_THAN_INT(ERRORS_MAX, error_count);
    snprintf(errors[error_count++], sizeof errors[0], "%s: %s", subject, text);
}

static const struct hal_log log_table = {NULL, note};

void setUp(void)
{
    error_count = 0;
    memset(errors, 0, sizeof errors);
    memset(&config, IH_TEST_FILL, sizeof config);
}

void tearDown(void)
{
    remove(PATH);
}

/* Arguments after the program's name, up to NULL. */
static bool read_arguments(const char *const *arguments)
{
    char *own[ARGUMENTS_MAX] = {(char[]){"isohead_board"}};
    static char copy[ARGUMENTS_MAX][600];
    int count = 1;

    for (; *arguments != NULL; arguments++) {
        TEST_ASSERT_LESS_THAN_INT(ARGUMENTS_MAX - 1, count);
        snprintf(copy[count], sizeof copy[0], "%s", *arguments);
        own[count] = copy[count];
        count++;
    }
    error_count = 0;
    return app_config_read(&config, count, own, &log_table);
}

#define READ(...) read_arguments((const char *const[]){__VA_ARGS__, NULL})

static void write_file(const char *text, size_t size)
{
    FILE *file;

    /* Writing over an old file, some file systems wait for the disk. */
    remove(PATH);
    file = fopen(PATH, "wb");
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_EQUAL_UINT64(size, fwrite(text, 1, size, file));
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
}

static bool read_text(const char *text)
{
    write_file(text, strlen(text));
    return READ("--config", PATH);
}

static void assert_error(int index, const char *text)
{
    TEST_ASSERT_GREATER_THAN_INT_MESSAGE(index, error_count, text);
    TEST_ASSERT_EQUAL_STRING(text, errors[index]);
}

/* The only error. */
static void assert_one_error(const char *text)
{
    assert_error(0, text);
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, error_count, errors[1]);
}

static void what_is_not_given_has_its_default(void)
{
    TEST_ASSERT_TRUE(READ("--rig", "r.json"));
    TEST_ASSERT_EQUAL_INT(0, error_count);
    TEST_ASSERT_EQUAL_STRING("r.json", config.rig);
    TEST_ASSERT_EQUAL_STRING("/dev/video0", config.device);
    TEST_ASSERT_EQUAL_STRING("auto", config.format);
    TEST_ASSERT_EQUAL_INT32(0, config.rate_mhz);
    TEST_ASSERT_EQUAL_INT(APP_EXPOSURE_AUTO, config.exposure);
    TEST_ASSERT_EQUAL_INT32(0, config.exposure_us);
    TEST_ASSERT_EQUAL_INT(APP_GAIN_AUTO, config.gain);
    TEST_ASSERT_FALSE(config.laser);
    TEST_ASSERT_EQUAL_INT(APP_STROBE_ALWAYS, config.strobe);
    TEST_ASSERT_NULL(config.gpio_chip);
    TEST_ASSERT_NULL(config.laser_line);
    TEST_ASSERT_NULL(config.interlock_line);
    TEST_ASSERT_NULL(config.heartbeat_line);
    TEST_ASSERT_FALSE(config.laser_active_low);
    TEST_ASSERT_FALSE(config.interlock_active_low);
    TEST_ASSERT_EQUAL_INT32(100, config.duty_percent);
    TEST_ASSERT_EQUAL_INT32(200, config.laser_cap_ms);
    TEST_ASSERT_EQUAL_INT(APP_OUTPUT_STDOUT, config.output);
    TEST_ASSERT_EQUAL_INT(APP_MESSAGES_STDERR, config.log);
    TEST_ASSERT_EQUAL_INT32(10, config.status_s);
    TEST_ASSERT_NULL(config.watchdog);
    TEST_ASSERT_FALSE(config.paper);
    TEST_ASSERT_EQUAL_STRING("", config.view_port);
    TEST_ASSERT_NULL(config.path);
    TEST_ASSERT_FALSE(config.laser_off || config.help || config.version);
}

static void assert_all_is_read(void)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(0, error_count, errors[0]);
    TEST_ASSERT_EQUAL_STRING("r.json", config.rig);
    TEST_ASSERT_EQUAL_STRING("/dev/video7", config.device);
    TEST_ASSERT_EQUAL_STRING("Y10P", config.format);
    TEST_ASSERT_EQUAL_STRING("iio:bmi160", config.up);
    TEST_ASSERT_EQUAL_INT32(29970, config.rate_mhz);
    TEST_ASSERT_EQUAL_INT(APP_EXPOSURE_FIXED, config.exposure);
    TEST_ASSERT_EQUAL_INT32(1500, config.exposure_us);
    TEST_ASSERT_EQUAL_INT(APP_GAIN_FIXED, config.gain);
    TEST_ASSERT_EQUAL_INT32(64, config.gain_value);
    TEST_ASSERT_TRUE(config.laser);
    TEST_ASSERT_EQUAL_INT(APP_STROBE_ALTERNATING, config.strobe);
    TEST_ASSERT_EQUAL_STRING("pinctrl#1", config.gpio_chip);
    TEST_ASSERT_EQUAL_STRING("LASER EN", config.laser_line);
    TEST_ASSERT_TRUE(config.laser_active_low);
    TEST_ASSERT_EQUAL_STRING("6", config.interlock_line);
    TEST_ASSERT_TRUE(config.interlock_active_low);
    TEST_ASSERT_EQUAL_STRING("7", config.heartbeat_line);
    TEST_ASSERT_EQUAL_INT32(40, config.duty_percent);
    TEST_ASSERT_EQUAL_INT(APP_OUTPUT_UDP, config.output);
    TEST_ASSERT_EQUAL_STRING("fe80::1", config.output_host);
    TEST_ASSERT_EQUAL_STRING("5005", config.output_port);
    TEST_ASSERT_EQUAL_INT(APP_MESSAGES_SYSLOG, config.log);
    TEST_ASSERT_EQUAL_INT32(0, config.status_s);
    TEST_ASSERT_EQUAL_STRING("/dev/watchdog1", config.watchdog);
    TEST_ASSERT_TRUE(config.paper);
    TEST_ASSERT_EQUAL_STRING("10.0.0.1", config.view_host);
    TEST_ASSERT_EQUAL_STRING("8080", config.view_port);
}

static void every_setting_is_an_option_and_a_key(void)
{
    TEST_ASSERT_TRUE(READ("--rig", "r.json", "--device", "/dev/video7", "--format", "Y10P",
                          "--rate", "29.97", "--up", "iio:bmi160", "--exposure", "1500", "--gain",
                          "64", "--laser", "--strobe", "alternating", "--gpio-chip", "pinctrl#1",
                          "--laser-line", "LASER EN", "--laser-active-low=on", "--interlock-line=6",
                          "--interlock-active-low", "--heartbeat-line", "7", "--duty", "40",
                          "--output", "udp:[fe80::1]:5005", "--log=syslog", "--status", "0",
                          "--watchdog", "/dev/watchdog1", "--paper", "--view", "10.0.0.1:8080"));
    assert_all_is_read();
    setUp();
    /* A byte order mark, line ends of other systems, blanks and comments everywhere. */
    TEST_ASSERT_TRUE(read_text("\xEF\xBB\xBF# comment = here\n"
                               "rig=r.json\n"
                               "  device =   /dev/video7   \n"
                               "\tformat\t=\tY10P\t# comment\n"
                               "\n"
                               "   # rate = 7\n"
                               "rate = 29.970\r\n"
                               "exposure = 1500\n"
                               "gain = 64\n"
                               "up = iio:bmi160\n"
                               "laser = on\n"
                               "strobe = alternating\n"
                               "gpio-chip = pinctrl#1\n"
                               "laser-line = LASER EN\n"
                               "laser-active-low = on\n"
                               "interlock-line = 6\n"
                               "interlock-active-low = on\n"
                               "heartbeat-line = 7\n"
                               "duty = 40\n"
                               "output = udp:[fe80::1]:5005\n"
                               "log = syslog\n"
                               "status = 0\n"
                               "watchdog = /dev/watchdog1 #=\n"
                               "view = 10.0.0.1:8080\n"
                               "paper = on\n"));
    assert_all_is_read();
    TEST_ASSERT_TRUE(read_text("\xEF\xBB\xBFrig = r\n"));
    TEST_ASSERT_TRUE(READ("--rig=r", "--interlock-line=none"));
    TEST_ASSERT_NULL(config.interlock_line);
}

static void the_command_line_wins_wherever_config_stands(void)
{
    static const char text[] = "rig = file.json\nrate = 10\npaper = on\nlaser = off\n"
                               "gpio-chip = c\nlaser-line = 1\nlaser-active-low = off\n"
                               "interlock-line = none\noutput = serial:/dev/x:9600\n";

    write_file(text, strlen(text));
    TEST_ASSERT_TRUE(READ("--config", PATH, "--rate", "20", "--paper=off", "--output", "-"));
    TEST_ASSERT_EQUAL_INT32(20000, config.rate_mhz);
    TEST_ASSERT_FALSE(config.paper);
    TEST_ASSERT_EQUAL_STRING("file.json", config.rig);
    TEST_ASSERT_EQUAL_INT(APP_OUTPUT_STDOUT, config.output);
    TEST_ASSERT_TRUE(READ("--rate", "20", "--rig=own.json", "--laser", "--config=" PATH));
    TEST_ASSERT_EQUAL_INT32(20000, config.rate_mhz);
    TEST_ASSERT_TRUE(config.paper);
    TEST_ASSERT_TRUE(config.laser);
    TEST_ASSERT_EQUAL_STRING("own.json", config.rig);
    TEST_ASSERT_EQUAL_INT(APP_OUTPUT_SERIAL, config.output);
    /* Of two options the last one. */
    TEST_ASSERT_TRUE(READ("--laser", "--rate=1", "--config", PATH, "--rate=2", "--laser=off"));
    TEST_ASSERT_EQUAL_INT32(2000, config.rate_mhz);
    TEST_ASSERT_FALSE(config.laser);
    /* A wrong line is reported even where it has no effect. */
    write_file("rig = r\nrate = x\n", 17);
    TEST_ASSERT_FALSE(READ("--config", PATH, "--rate", "20"));
    TEST_ASSERT_EQUAL_INT(1, error_count);
}

/* "--laser off" must not switch it on. */
static void a_flag_takes_no_word_of_its_own(void)
{
    TEST_ASSERT_FALSE(READ("--rig", "r", "--gpio-chip=c", "--laser-line=1", "--laser", "off"));
    assert_one_error("command line: unexpected argument \"off\", expected options only; a flag is "
                     "switched off by --FLAG=off");
    TEST_ASSERT_FALSE(config.laser);
    TEST_ASSERT_FALSE(READ("--rig", "r", "--laser="));
    assert_one_error("command line: --laser: empty, expected on or off");
    TEST_ASSERT_FALSE(READ("--rig", "r", "--laser=yes"));
    assert_one_error("command line: --laser: \"yes\", expected on or off");
    TEST_ASSERT_FALSE(READ("--rig", "r", "--laser=ON"));
}

struct trial {
    const char *option;
    bool good;
    int32_t value; /* where it is good */
};

static void numbers_have_bounds(void)
{
    static const struct trial rates[] = {
        {"--rate=1", true, 1000},         {"--rate=1000", true, 1000000},
        {"--rate=0.999", false, 0},       {"--rate=1000.001", false, 0},
        {"--rate=999.999", true, 999999}, {"--rate=25.0000", false, 0},
        {"--rate=25.", false, 0},         {"--rate=.5", false, 0},
        {"--rate=2.5.1", false, 0},       {"--rate=+25", false, 0},
        {"--rate=-25", false, 0},         {"--rate=25 ", false, 0},
        {"--rate=1e2", false, 0},         {"--rate=0x20", false, 0},
        {"--rate=00025", true, 25000},    {"--rate=99999999999999999999", false, 0},
        {"--rate=4294968", false, 0},     {"--rate=18446744073709551641", false, 0},
    };
    static const struct trial duties[] = {
        {"--duty=1", true, 1},     {"--duty=100", true, 100}, {"--duty=0", false, 0},
        {"--duty=101", false, 0},  {"--duty=50%", false, 0},  {"--duty=50.0", false, 0},
        {"--duty= 50", false, 0},  {"--duty=", false, 0},     {"--duty=4294967346", false, 0},
        {"--duty=fifty", false, 0}};
    static const struct trial caps[] = {{"--laser-cap=10", true, 10},
                                        {"--laser-cap=1000", true, 1000},
                                        {"--laser-cap=9", false, 0},
                                        {"--laser-cap=1001", false, 0}};
    static const struct trial intervals[] = {{"--status=0", true, 0},
                                             {"--status=86400", true, 86400},
                                             {"--status=86401", false, 0},
                                             {"--status=-1", false, 0}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(rates); i++) {
        TEST_ASSERT_EQUAL_MESSAGE(rates[i].good, READ("--rig=r", rates[i].option), rates[i].option);
        TEST_ASSERT_EQUAL_INT32_MESSAGE(rates[i].good ? rates[i].value : 0, config.rate_mhz,
                                        rates[i].option);
    }
    for (i = 0; i < IH_TEST_COUNT(duties); i++) {
        TEST_ASSERT_EQUAL_MESSAGE(duties[i].good, READ("--rig=r", duties[i].option),
                                  duties[i].option);
        TEST_ASSERT_EQUAL_INT32_MESSAGE(duties[i].good ? duties[i].value : 100, config.duty_percent,
                                        duties[i].option);
    }
    for (i = 0; i < IH_TEST_COUNT(caps); i++) {
        TEST_ASSERT_EQUAL_MESSAGE(caps[i].good, READ("--rig=r", caps[i].option), caps[i].option);
        TEST_ASSERT_EQUAL_INT32_MESSAGE(caps[i].good ? caps[i].value : 200, config.laser_cap_ms,
                                        caps[i].option);
    }
    for (i = 0; i < IH_TEST_COUNT(intervals); i++) {
        TEST_ASSERT_EQUAL_MESSAGE(intervals[i].good, READ("--rig=r", intervals[i].option),
                                  intervals[i].option);
        TEST_ASSERT_EQUAL_INT32_MESSAGE(intervals[i].good ? intervals[i].value : 10,
                                        config.status_s, intervals[i].option);
    }
}

static void exposure_and_gain_are_words_or_numbers(void)
{
    TEST_ASSERT_TRUE(READ("--rig=r", "--exposure=keep", "--gain=keep"));
    TEST_ASSERT_EQUAL_INT(APP_EXPOSURE_KEEP, config.exposure);
    TEST_ASSERT_EQUAL_INT(APP_GAIN_KEEP, config.gain);
    TEST_ASSERT_TRUE(READ("--rig=r", "--exposure=steer", "--gain=0"));
    TEST_ASSERT_EQUAL_INT(APP_EXPOSURE_STEER, config.exposure);
    TEST_ASSERT_EQUAL_INT(APP_GAIN_FIXED, config.gain);
    TEST_ASSERT_EQUAL_INT32(0, config.gain_value);
    TEST_ASSERT_TRUE(READ("--rig=r", "--exposure=1000000", "--gain=1000000"));
    TEST_ASSERT_EQUAL_INT32(1000000, config.exposure_us);
    TEST_ASSERT_EQUAL_INT32(1000000, config.gain_value);
    TEST_ASSERT_FALSE(READ("--rig=r", "--exposure=0"));
    TEST_ASSERT_EQUAL_INT(APP_EXPOSURE_AUTO, config.exposure);
    TEST_ASSERT_FALSE(READ("--rig=r", "--exposure=1000001"));
    TEST_ASSERT_FALSE(READ("--rig=r", "--gain=steer"));
    TEST_ASSERT_FALSE(READ("--rig=r", "--format=grey"));
    TEST_ASSERT_FALSE(READ("--rig=r", "--strobe=on"));
    TEST_ASSERT_FALSE(READ("--rig=r", "--log=syslogs"));
    /* A word of the file does not leave the number of another behind. */
    write_file("rig = r\nexposure = 200\n", 23);
    TEST_ASSERT_TRUE(READ("--config", PATH, "--exposure=auto"));
    TEST_ASSERT_EQUAL_INT(APP_EXPOSURE_AUTO, config.exposure);
    TEST_ASSERT_EQUAL_INT32(0, config.exposure_us);
}

static void outputs_are_taken_apart(void)
{
    static const struct {
        const char *option, *host, *port; /* host NULL: refused */
    } udp[] = {
        {"--output=udp:localhost:1", "localhost", "1"},
        {"--output=udp:10.0.0.1:65535", "10.0.0.1", "65535"},
        {"--output=udp:[::1]:080", "::1", "80"},
        {"--output=udp:localhost", NULL, NULL},
        {"--output=udp:localhost:", NULL, NULL},
        {"--output=udp:localhost:0", NULL, NULL},
        {"--output=udp:localhost:65536", NULL, NULL},
        {"--output=udp:localhost:http", NULL, NULL},
        {"--output=udp::5005", NULL, NULL},
        {"--output=udp:[]:5005", NULL, NULL},
        {"--output=udp:[:5005", NULL, NULL},
        {"--output=udp:]:5005", NULL, NULL},
        {"--output=udp:[::1:5005", NULL, NULL},
        {"--output=udp:[[::1]]:5005", NULL, NULL},
        {"--output=udp:::1:5005", NULL, NULL},
        {"--output=udp:[::1]", NULL, NULL},
        {"--output=udp:", NULL, NULL},
        {"--output=UDP:localhost:1", NULL, NULL},
        {"--output=udp", NULL, NULL},
    };
    static const struct {
        const char *option, *path; /* path NULL: refused */
        int32_t baud;
    } serial[] = {
        {"--output=serial:/dev/ttyS0", "/dev/ttyS0", 115200},
        {"--output=serial:/dev/ttyS0:9600", "/dev/ttyS0", 9600},
        {"--output=serial:/dev/ttyS0:921600", "/dev/ttyS0", 921600},
        {"--output=serial:/dev/by-path/pci-0:1.0-port0", "/dev/by-path/pci-0:1.0-port0", 115200},
        {"--output=serial:a:9600:9600", "a:9600", 9600},
        {"--output=serial:/dev/ttyS0:", NULL, 0},
        {"--output=serial:/dev/ttyS0:9601", NULL, 0},
        {"--output=serial:/dev/ttyS0:0", NULL, 0},
        {"--output=serial:/dev/ttyS0:4294976896", NULL, 0},
        {"--output=serial::9600", NULL, 0},
        {"--output=serial:", NULL, 0},
        {"--output=-:", NULL, 0},
        {"--output=stdout", NULL, 0},
    };
    int i;

    for (i = 0; i < IH_TEST_COUNT(udp); i++) {
        TEST_ASSERT_EQUAL_MESSAGE(udp[i].host != NULL, READ("--rig=r", udp[i].option),
                                  udp[i].option);
        if (udp[i].host != NULL) {
            TEST_ASSERT_EQUAL_INT(APP_OUTPUT_UDP, config.output);
            TEST_ASSERT_EQUAL_STRING(udp[i].host, config.output_host);
            TEST_ASSERT_EQUAL_STRING(udp[i].port, config.output_port);
        }
    }
    for (i = 0; i < IH_TEST_COUNT(serial); i++) {
        TEST_ASSERT_EQUAL_MESSAGE(serial[i].path != NULL, READ("--rig=r", serial[i].option),
                                  serial[i].option);
        if (serial[i].path != NULL) {
            TEST_ASSERT_EQUAL_INT(APP_OUTPUT_SERIAL, config.output);
            TEST_ASSERT_EQUAL_STRING(serial[i].path, config.output_path);
            TEST_ASSERT_EQUAL_INT32(serial[i].baud, config.output_baud);
        }
    }
}

static void all_errors_of_a_file_are_reported(void)
{
    static const char text[] = "rig = r\n"
                               "rate = fast\n"
                               "rte = 3\n"
                               "laser = off\n"
                               "laser = on\n"
                               "foo\n"
                               "device = # none\n"
                               "help = on\n"
                               "something-else = 1\n"
                               "= 3\n"
                               "duty = 5\x01\n"
                               "log = sys\0log\n";

    write_file(text, sizeof text - 1);
    TEST_ASSERT_FALSE(READ("--config", PATH));
    assert_error(0, PATH ":2: rate: \"fast\", expected frames per second from 1 to 1000, with up "
                         "to 3 decimals");
    assert_error(1, PATH ":3: unknown key \"rte\", perhaps \"rate\" is meant");
    assert_error(2, PATH ":5: laser: a second time, after line 4, expected once");
    assert_error(3, PATH ":6: \"foo\", expected \"key = value\"");
    assert_error(4, PATH ":7: device: empty, expected a device or a directory");
    assert_error(5, PATH ":8: help: in a file, expected on the command line only");
    assert_error(6, PATH ":9: unknown key \"something-else\", --help lists all");
    assert_error(7, PATH ":10: unknown key \"\", --help lists all");
    assert_error(8, PATH ":11: duty: control character 1, expected percent from 1 to 100");
    assert_error(9, PATH ":12: zero byte at column 10, expected text");
    TEST_ASSERT_EQUAL_INT(10, error_count);
    TEST_ASSERT_FALSE(config.laser);
}

static void very_many_errors_are_cut_short(void)
{
    char text[8 * 40] = "";
    int i;

    for (i = 0; i < 40; i++) {
        snprintf(text + strlen(text), sizeof text - strlen(text), "bad %d\n", i % 10);
    }
    TEST_ASSERT_FALSE(read_text(text));
    TEST_ASSERT_EQUAL_INT(APP_CONFIG_ERRORS_MAX + 1, error_count);
    assert_error(19, PATH ":20: \"bad 9\", expected \"key = value\"");
    assert_error(20, PATH ":21: further errors are not reported");
}

/* What is reported must not steer a terminal, nor be endless. */
static void wrong_texts_are_tamed_and_cut(void)
{
    char text[2000];
    int i;

    TEST_ASSERT_FALSE(read_text("rig = r\n\033[2Jrate = 3\n"));
    assert_one_error(PATH ":2: unknown key \"?[2Jrate\", --help lists all");
    memset(text, 'x', sizeof text);
    memcpy(text, "rig = ", 6);
    text[6 + APP_CONFIG_VALUE_MAX] = '\n';
    text[6 + APP_CONFIG_VALUE_MAX + 1] = 0;
    TEST_ASSERT_TRUE(read_text(text));
    TEST_ASSERT_EQUAL_UINT64(APP_CONFIG_VALUE_MAX, strlen(config.rig));
    memcpy(text + 6 + APP_CONFIG_VALUE_MAX, "x\n", 3);
    TEST_ASSERT_FALSE(read_text(text));
    assert_one_error(PATH ":1: rig: 256 bytes, expected at most 255");
    memset(text, 'y', sizeof text);
    text[sizeof text - 1] = 0;
    TEST_ASSERT_FALSE(read_text(text));
    TEST_ASSERT_EQUAL_INT(1, error_count);
    TEST_ASSERT_LESS_THAN_UINT64(120, strlen(errors[0]));
    /* Long values of each setting. */
    for (i = 0; i < APP_SETTINGS_COUNT; i++) {
        if (app_settings[i].place != APP_SETTINGS_COMMAND) {
            memset(text, '9', 300);
            snprintf(text, 300, "--%s=", app_settings[i].name);
            text[strlen(text)] = '9';
            text[APP_CONFIG_VALUE_MAX + strlen(app_settings[i].name) + 3] = 0;
            (void)READ(text);
            text[APP_CONFIG_VALUE_MAX + strlen(app_settings[i].name) + 3] = '9';
            text[APP_CONFIG_VALUE_MAX + strlen(app_settings[i].name) + 4] = 0;
            TEST_ASSERT_FALSE_MESSAGE(READ(text), app_settings[i].name);
        }
    }
}

static void the_view_is_local_unless_requested(void)
{
    static const struct {
        const char *option, *host, *port; /* host NULL: refused */
    } cases[] = {
        {"--view=8080", "127.0.0.1", "8080"},
        {"--view=1", "127.0.0.1", "1"},
        {"--view=65535", "127.0.0.1", "65535"},
        {"--view=080", "127.0.0.1", "80"},
        {"--view=0.0.0.0:80", "0.0.0.0", "80"},
        {"--view=[::1]:8080", "::1", "8080"},
        {"--view=[::]:8080", "::", "8080"},
        {"--view=0", NULL, NULL},
        {"--view=65536", NULL, NULL},
        {"--view=999999999999999999999", NULL, NULL},
        {"--view=-1", NULL, NULL},
        {"--view=8080x", NULL, NULL},
        {"--view=:8080", NULL, NULL},
        {"--view=::1:8080", NULL, NULL},
        {"--view=127.0.0.1:", NULL, NULL},
        {"--view=127.0.0.1:0", NULL, NULL},
        {"--view=on", NULL, NULL},
        {"--view=", NULL, NULL},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        setUp();
        bool good = READ("--rig=r", cases[i].option);
        TEST_ASSERT_EQUAL_MESSAGE(cases[i].host != NULL, good, cases[i].option);
        if (good) {
            TEST_ASSERT_EQUAL_STRING(cases[i].host, config.view_host);
            TEST_ASSERT_EQUAL_STRING(cases[i].port, config.view_port);
        } else {
            TEST_ASSERT_EQUAL_STRING("", config.view_port);
        }
    }
}

static void options_are_checked_too(void)
{
    TEST_ASSERT_FALSE(READ("--rigg=4", "--zzzzzz", "-x", "--version=4", "--", "stray"));
    assert_error(0, "command line: unknown option \"rigg\", perhaps \"rig\" is meant");
    assert_error(1, "command line: unknown option \"zzzzzz\", --help lists all");
    assert_error(2, "command line: unknown option \"x\", --help lists all");
    assert_error(3, "command line: --version: a value, expected none");
    assert_error(4, "command line: unexpected argument \"stray\", expected options only");
    TEST_ASSERT_EQUAL_INT(5, error_count);
    TEST_ASSERT_FALSE(READ("--rig"));
    assert_error(0, "command line: --rig: no value, expected a file");
    TEST_ASSERT_FALSE(READ("--rig", ""));
    assert_error(0, "command line: --rig: empty, expected a file");
    /* Not the beginning of any of several. */
    TEST_ASSERT_FALSE(READ("--rig=r", "--lase"));
    TEST_ASSERT_FALSE(config.laser);
}

static void files_that_are_none_are_reported(void)
{
    static char big[APP_CONFIG_TEXT_MAX + 1];

    TEST_ASSERT_FALSE(READ("--config", "no/such.conf"));
    assert_one_error("no/such.conf: No such file or directory");
    TEST_ASSERT_FALSE(READ("--config", "."));
    assert_one_error(".: a directory, expected a file");
    TEST_ASSERT_FALSE(READ("--config", ""));
    assert_one_error("command line: --config: empty, expected a file");
    memset(big, '#', sizeof big);
    write_file(big, sizeof big);
    TEST_ASSERT_FALSE(READ("--config", PATH));
    TEST_ASSERT_EQUAL_INT(1, error_count);
    memcpy(big, "rig = r\n", 8);
    big[sizeof big - 2] = '\n';
    write_file(big, sizeof big - 1);
    TEST_ASSERT_TRUE(READ("--config", PATH));
    TEST_ASSERT_FALSE(read_text(""));
    assert_one_error(
        PATH ": rig: missing, expected the file with the calibration; --help lists all settings");
}

static void what_does_not_go_together_is_reported(void)
{
    static const struct {
        const char *text, *error;
    } trials[] = {
        {"laser = on\n", ":2: laser: on, but no laser-line, expected the line that switches it"},
        {"laser-line = 3\nlaser-active-low = off\n",
         ":2: laser-line: given, but no gpio-chip, expected both"},
        {"interlock-line = 3\n", ":2: interlock-line: given, but no gpio-chip, expected both"},
        {"heartbeat-line = 3\n", ":2: heartbeat-line: given, but no gpio-chip, expected both"},
        {"laser-active-low = on\n", ":2: laser-active-low: on, but no laser-line, expected both"},
        {"interlock-active-low = on\n",
         ":2: interlock-active-low: on, but no interlock-line, expected both"},
        {"strobe = alternating\n",
         ":2: strobe: alternating without laser, expected always, gated or laser on"},
        {"gpio-chip=c\nlaser-line=3\nlaser-active-low=off\ninterlock-line=3\n",
         ":5: interlock-line: the laser-line too, expected another line"},
        {"gpio-chip=c\nlaser-line=3\nlaser-active-low=off\nheartbeat-line=3\n",
         ":5: heartbeat-line: the laser-line too, expected another line"},
        {"gpio-chip=c\nheartbeat-line=x\ninterlock-line=x\n",
         ":3: heartbeat-line: the interlock-line too, expected another line"},
        {"duty = 50", ":2: the last line has no line end: the file may be cut"},
    };
    char text[200], wanted[200];
    int i;

    for (i = 0; i < IH_TEST_COUNT(trials); i++) {
        snprintf(text, sizeof text, "rig = r\n%s", trials[i].text);
        snprintf(wanted, sizeof wanted, PATH "%s", trials[i].error);
        TEST_ASSERT_FALSE_MESSAGE(read_text(text), trials[i].text);
        assert_one_error(wanted);
    }
    write_file("rig = r\n", 8);
    TEST_ASSERT_FALSE(READ("--config", PATH, "--laser"));
    assert_one_error(
        "command line: --laser: on, but no laser-line, expected the line that switches "
        "it");
    TEST_ASSERT_FALSE(READ("--device=x"));
    assert_one_error("command line: --rig: missing, expected the file with the calibration; --help "
                     "lists all settings");
}

/* Frames from a directory: with its rig, never with the laser; a device that is not there may come later. */
static void a_device_may_be_a_directory(void)
{
    TEST_ASSERT_TRUE(READ("--device=/tmp"));
    TEST_ASSERT_TRUE(config.is_directory);
    TEST_ASSERT_EQUAL_STRING("/tmp/rig.json", config.rig);
    TEST_ASSERT_EQUAL_INT(APP_REPEAT_AUTO, config.repeat);
    TEST_ASSERT_TRUE(READ("--device=/tmp", "--rig=r", "--loop"));
    TEST_ASSERT_EQUAL_STRING("r", config.rig);
    TEST_ASSERT_EQUAL_INT(APP_REPEAT_ON, config.repeat);
    TEST_ASSERT_TRUE(READ("--device=/tmp", "--loop=off"));
    TEST_ASSERT_EQUAL_INT(APP_REPEAT_OFF, config.repeat);
    TEST_ASSERT_FALSE(READ("--device=/tmp", "--laser", "--gpio-chip=c", "--laser-line=3"));
    assert_one_error(
        "command line: --laser: on, but the device is a directory, expected laser off: old frames "
        "show nothing of what the laser does");
    write_file("rig = r\n", 8);
    TEST_ASSERT_FALSE(READ("--rig=r", "--device=" PATH));
    assert_one_error("command line: --device: neither a camera nor a directory, expected "
                     "/dev/videoN or a directory "
                     "with frames");
    TEST_ASSERT_TRUE(READ("--rig=r", "--device=/dev/null"));
    TEST_ASSERT_FALSE(config.is_directory);
    TEST_ASSERT_TRUE(READ("--rig=r", "--device=/nowhere/video0"));
    TEST_ASSERT_FALSE(config.is_directory);
}

#define LINE "gpio-chip = c\nlaser-line = 3\nlaser-active-low = on\n"

/* To switch the laser off its line is wanted even from a file that is wrong elsewhere, but not when
 * what is wrong could be its line, or whether low is on. */
static void laser_off_knows_the_line_or_says_so(void)
{
    static const char *const unsure[] = {
        "gpio-chip = c\nlaser-line = 3\nlaser-activ-low = on\n",
        "gpio-chip = c\nlaser-line = 3\nlaser-active-low on\n",
        "gpio-chip = c\nlaser-line = 3\nlaser-active-low = yes\n",
        "gpio-chip = c\nlaser-line = 3\nlaser-active-low =\n",
        LINE "laser-active-low = off\n",
        LINE "laser-line = 4\n",
        LINE "gpio-chip = d\n",
        "gpio-chip = c\nlaser-active-low = off\nlaser-line = 1",
    };
    int i;

    TEST_ASSERT_TRUE(READ("--laser-off"));
    TEST_ASSERT_TRUE(config.laser_off);
    TEST_ASSERT_NULL(config.laser_line);
    write_file(LINE "rate = fast\nduty = 0\nrate = 3\n", sizeof LINE - 1 + 30);
    TEST_ASSERT_FALSE(READ("--laser-off", "--config", PATH));
    TEST_ASSERT_EQUAL_INT(3, error_count);
    TEST_ASSERT_TRUE(config.laser_off);
    TEST_ASSERT_EQUAL_STRING("c", config.gpio_chip);
    TEST_ASSERT_EQUAL_STRING("3", config.laser_line);
    TEST_ASSERT_TRUE(config.laser_active_low);
    TEST_ASSERT_TRUE(read_text(LINE "rig = r\n"));
    TEST_ASSERT_EQUAL_STRING("3", config.laser_line);
    for (i = 0; i < IH_TEST_COUNT(unsure); i++) {
        write_file(unsure[i], strlen(unsure[i]));
        TEST_ASSERT_FALSE_MESSAGE(READ("--config", PATH, "--laser-off"), unsure[i]);
        TEST_ASSERT_TRUE(config.laser_off);
        TEST_ASSERT_NULL_MESSAGE(config.laser_line, unsure[i]);
    }
    TEST_ASSERT_FALSE(READ("--laser-off", "--gpio-chip=c", "--laser-line=1", "--config", "none"));
    TEST_ASSERT_NULL(config.laser_line);
    TEST_ASSERT_FALSE(READ("--laser-off", "--gpio-chip=c", "--laser-line=1", "--laser-activ-lo"));
    TEST_ASSERT_NULL(config.laser_line);
}

static void help_tells_every_setting_in_80_columns(void)
{
    static char text[10000];
    char name[60];
    FILE *file = tmpfile();
    char *line;
    int i;

    TEST_ASSERT_TRUE(READ("--help", "--config", "none"));
    TEST_ASSERT_TRUE(config.help);
    TEST_ASSERT_TRUE(READ("--version"));
    TEST_ASSERT_TRUE(config.version);
    TEST_ASSERT_NOT_NULL(file);
    app_config_help(file);
    rewind(file);
    text[fread(text, 1, sizeof text - 1, file)] = 0;
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
    for (i = 0; i < APP_SETTINGS_COUNT; i++) {
        snprintf(name, sizeof name, "\n  --%s%s", app_settings[i].name,
                 app_settings[i].argument != NULL             ? " "
                 : app_settings[i].place == APP_SETTINGS_BOTH ? "[=on|off] "
                                                              : "  ");
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, name), name);
        /* Each word of a setting with words is explained. */
        if (app_settings[i].words != NULL) {
            int w;
            for (w = 0; app_settings[i].words[w] != NULL; w++) {
                TEST_ASSERT_NOT_NULL(strstr(app_settings[i].help, app_settings[i].words[w]));
                TEST_ASSERT_NOT_NULL(strstr(app_settings[i].expected, app_settings[i].words[w]));
            }
        }
    }
    for (line = strtok(text, "\n"); line != NULL; line = strtok(NULL, "\n")) {
        TEST_ASSERT_LESS_OR_EQUAL_UINT64_MESSAGE(80, strlen(line), line);
        TEST_ASSERT_NOT_EQUAL_MESSAGE(' ', line[strlen(line) - 1], line);
    }
}

static void the_nearest_name_is_found(void)
{
    int i;

    for (i = 0; i < APP_SETTINGS_COUNT; i++) {
        char name[64];
        TEST_ASSERT_EQUAL_INT(i, app_settings_find(app_settings[i].name));
        TEST_ASSERT_EQUAL_INT(i, app_settings_nearest(app_settings[i].name));
        snprintf(name, sizeof name, "%sx", app_settings[i].name);
        TEST_ASSERT_EQUAL_INT(i, app_settings_nearest(name));
    }
    TEST_ASSERT_EQUAL_STRING("laser-line", app_settings[app_settings_nearest("laserline")].name);
    TEST_ASSERT_EQUAL_STRING("gpio-chip", app_settings[app_settings_nearest("gpoi-chip")].name);
    TEST_ASSERT_EQUAL_INT(-1, app_settings_nearest("abc"));
    TEST_ASSERT_EQUAL_INT(-1, app_settings_nearest(""));
    TEST_ASSERT_EQUAL_INT(-1, app_settings_nearest("interlock-active-low-interlock-active-low"));
}

static size_t load_example(char *text, size_t size)
{
    FILE *file = fopen(ISOHEAD_CONF, "rb");
    size_t length;

    TEST_ASSERT_NOT_NULL_MESSAGE(file, ISOHEAD_CONF);
    length = fread(text, 1, size - 1, file);
    TEST_ASSERT_EQUAL_INT(0, fclose(file));
    TEST_ASSERT_LESS_THAN_UINT64(size - 1, length);
    text[length] = 0;
    return length;
}

/* As installed, and with all that is commented out: the defaults, and examples that fit together. */
static void the_installed_file_has_every_key(void)
{
    static char text[APP_CONFIG_TEXT_MAX];
    static struct app_config wanted;
    size_t length = load_example(text, sizeof text);
    size_t i;
    int k;

    TEST_ASSERT_TRUE_MESSAGE(read_text(text), errors[0]);
    TEST_ASSERT_FALSE(config.laser);
    TEST_ASSERT_EQUAL_STRING("/etc/isohead/rig.json", config.rig);
    TEST_ASSERT_NULL(config.laser_line);
    for (i = 0; i + 1 < length; i++) {
        if (text[i] == '#' && (i == 0 || text[i - 1] == '\n') && text[i + 1] >= 'a' &&
            text[i + 1] <= 'z') {
            text[i] = ' ';
        }
    }
    for (k = 0; k < APP_SETTINGS_COUNT; k++) {
        char given[64], example[64];
        bool stands;
        snprintf(given, sizeof given, "\n%s = ", app_settings[k].name);
        snprintf(example, sizeof example, "\n %s = ", app_settings[k].name);
        stands = strstr(text, given) != NULL || strstr(text, example) != NULL;
        TEST_ASSERT_EQUAL_MESSAGE(app_settings[k].place == APP_SETTINGS_BOTH, stands,
                                  app_settings[k].name);
    }
    TEST_ASSERT_TRUE_MESSAGE(read_text(text), errors[0]);
    TEST_ASSERT_NOT_NULL(config.gpio_chip);
    TEST_ASSERT_NOT_NULL(config.laser_line);
    TEST_ASSERT_NOT_NULL(config.interlock_line);
    TEST_ASSERT_NOT_NULL(config.heartbeat_line);
    TEST_ASSERT_NOT_NULL(config.watchdog);
    config.gpio_chip = config.laser_line = config.interlock_line = config.heartbeat_line = NULL;
    config.watchdog = NULL;
    TEST_ASSERT_NOT_NULL(config.record);
    TEST_ASSERT_EQUAL_INT(APP_RECORD_NO_HEAD, config.record_when);
    config.record = NULL;
    config.record_when = APP_RECORD_ALWAYS;
    config.record_no_head_s = 0;
    TEST_ASSERT_EQUAL_STRING("iio:bmi160", config.up);
    config.up = NULL;
    TEST_ASSERT_EQUAL_STRING("8080", config.view_port);
    memset(config.view_host, 0, sizeof config.view_host);
    memset(config.view_port, 0, sizeof config.view_port);
    TEST_ASSERT_EQUAL_INT32(25000, config.rate_mhz);
    config.rate_mhz = 0;
    /* All else is the default. */
    app_settings_default(&wanted);
    TEST_ASSERT_EQUAL_STRING(wanted.device, config.device);
    wanted.rig = config.rig;
    wanted.path = config.path;
    wanted.device = config.device;
    TEST_ASSERT_EQUAL_MEMORY(&wanted, &config, offsetof(struct app_config, text));
}

/* The installed file with all that is commented out; it switches a laser on that is active-low. */
static size_t load_filled(char *text, size_t size)
{
    static const char *const changes[][2] = {
        {"\nlaser-active-low = off", "\nlaser-active-low = on "},
        {"\nlaser = off", "\nlaser = on "}};
    size_t length = load_example(text, size);
    size_t i;
    int c;

    for (i = 0; i + 1 < length; i++) {
        if (text[i] == '#' && text[i + 1] >= 'a' && text[i + 1] <= 'z') {
            memmove(text + i, text + i + 1, length - i);
            length--;
        }
    }
    for (c = 0; c < IH_TEST_COUNT(changes); c++) {
        char *at = strstr(text, changes[c][0]);
        TEST_ASSERT_NOT_NULL_MESSAGE(at, changes[c][0]);
        memcpy(at, changes[c][1], strlen(changes[c][1]));
    }
    return length;
}

/* However much of it is left, it is refused or has no laser on, and --laser-off knows the line or says
 * that it does not. */
static void a_cut_file_does_not_switch_the_laser_on(void)
{
    static char text[APP_CONFIG_TEXT_MAX];
    size_t length = load_filled(text, sizeof text);
    size_t left;

    TEST_ASSERT_TRUE_MESSAGE(read_text(text), errors[0]);
    TEST_ASSERT_TRUE(config.laser && config.laser_active_low);
    for (left = 0; left < length; left++) {
        bool good;
        write_file(text, left);
        good = READ("--config", PATH);
        TEST_ASSERT_FALSE_MESSAGE(good && config.laser, text + left);
        (void)READ("--config", PATH, "--laser-off");
        TEST_ASSERT_TRUE_MESSAGE(
            config.laser_line == NULL ||
                (strcmp(config.laser_line, "17") == 0 && config.laser_active_low),
            text + left);
    }
}

/* Whatever a file says, it is read to its end; what is accepted keeps its promises. */
static void files_of_rubbish_do_no_harm(void)
{
    static char text[APP_CONFIG_TEXT_MAX], base[APP_CONFIG_TEXT_MAX];
    static const char *const pieces[] = {"\n", "=",  "#",    " ",       "laser = on\n", "\r\n",
                                         "on", "\t", "rate", "\n\n\n=", "udp:[",        "serial::"};
    struct ih_test_random random = {2024};
    size_t base_length = load_example(base, sizeof base);
    int good_count = 0;
    size_t i;
    int round, change;

    for (i = 0; i + 1 < base_length; i++) {
        if (base[i] == '#' && base[i + 1] >= 'a' && base[i + 1] <= 'z') {
            base[i] = ' ';
        }
    }
    for (round = 0; round < 4000; round++) {
        size_t length = base_length;
        bool good;
        memcpy(text, base, length);
        for (change = (int)ih_test_between(&random, 0, 8); change > 0; change--) {
            size_t at = (size_t)ih_test_between(&random, 0, (int64_t)length - 1);
            const char *piece = pieces[ih_test_between(&random, 0, IH_TEST_COUNT(pieces) - 1)];
            switch (ih_test_between(&random, 0, 3)) {
            case 0:
                text[at] = (char)ih_test_between(&random, -128, 127);
                break;
            case 1:
                length = ih_test_between(&random, 0, 3) == 0 ? at + 1 : length;
                break;
            case 2:
                memmove(text + at, text + at + 1, length - at - 1);
                length -= length > 1;
                break;
            default:
                memmove(text + at + strlen(piece), text + at, length - at);
                memcpy(text + at, piece, strlen(piece));
                length += strlen(piece);
                break;
            }
        }
        write_file(text, length);
        good = READ("--config", PATH);
        good_count += good;
        TEST_ASSERT_EQUAL(good, error_count == 0);
        TEST_ASSERT_LESS_OR_EQUAL_INT(APP_CONFIG_ERRORS_MAX + 1, error_count);
        TEST_ASSERT_TRUE(config.duty_percent >= 1 && config.duty_percent <= 100);
        TEST_ASSERT_TRUE(config.rate_mhz == 0 ||
                         (config.rate_mhz >= 1000 && config.rate_mhz <= 1000000));
        TEST_ASSERT_TRUE(!good || config.rig != NULL);
        TEST_ASSERT_TRUE(!good || !config.laser || (config.laser_line && config.gpio_chip));
        TEST_ASSERT_TRUE((int)config.strobe >= 0 && config.strobe <= APP_STROBE_ALTERNATING);
    }
    /* Both happen often, or the trial says little. */
    TEST_ASSERT_GREATER_THAN_INT(400, good_count);
    TEST_ASSERT_LESS_THAN_INT(3600, good_count);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(what_is_not_given_has_its_default);
    RUN_TEST(every_setting_is_an_option_and_a_key);
    RUN_TEST(the_command_line_wins_wherever_config_stands);
    RUN_TEST(a_flag_takes_no_word_of_its_own);
    RUN_TEST(numbers_have_bounds);
    RUN_TEST(exposure_and_gain_are_words_or_numbers);
    RUN_TEST(outputs_are_taken_apart);
    RUN_TEST(all_errors_of_a_file_are_reported);
    RUN_TEST(very_many_errors_are_cut_short);
    RUN_TEST(wrong_texts_are_tamed_and_cut);
    RUN_TEST(the_view_is_local_unless_requested);
    RUN_TEST(options_are_checked_too);
    RUN_TEST(files_that_are_none_are_reported);
    RUN_TEST(what_does_not_go_together_is_reported);
    RUN_TEST(a_device_may_be_a_directory);
    RUN_TEST(laser_off_knows_the_line_or_says_so);
    RUN_TEST(help_tells_every_setting_in_80_columns);
    RUN_TEST(the_nearest_name_is_found);
    RUN_TEST(the_installed_file_has_every_key);
    RUN_TEST(a_cut_file_does_not_switch_the_laser_on);
    RUN_TEST(files_of_rubbish_do_no_harm);
    return UNITY_END();
}
