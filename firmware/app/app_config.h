/* app_config - the settings of isohead_board, from its command line and a file.
 *
 * In:    the command line; --config FILE names a file of `key = value` lines. A key is the long
 *        option's name: one table of settings (app_settings) serves both, so that names, checks and
 *        the text of --help cannot differ. The command line wins over the file, wherever --config
 *        stands; of an option that is given twice the last one counts, a key that stands twice in
 *        the file is an error.
 * File:  '#' starts a comment at the start of a line or after a blank. Blanks around key and value
 *        do not count. At most APP_CONFIG_TEXT_MAX bytes. A file may be cut, so the last line needs its
 *        line end.
 * Flags: `on` or `off` in the file; on the command line --laser, --laser=on or --laser=off.
 * Error: each is reported with its position, what was found and what was expected, up to
 *        APP_CONFIG_ERRORS_MAX; then what contradicts itself across settings (laser on, but no line).
 * Memory: texts point into `text` or into the arguments, so the struct must not be copied.
 */
#ifndef APP_CONFIG_H
#define APP_CONFIG_H

#include <stdio.h>

#include "hal.h"

/* Longest configuration file: ten times the installed one would fit. */
#define APP_CONFIG_TEXT_MAX (32 * 1024)
/* Longest value. */
#define APP_CONFIG_VALUE_MAX 255
/* What stands before an accelerometer's name. */
#define APP_CONFIG_IIO "iio:"
/* Errors reported at most; then a line says that there are more. */
#define APP_CONFIG_ERRORS_MAX 20

enum app_exposure {
    APP_EXPOSURE_AUTO,  /* the camera's own control */
    APP_EXPOSURE_KEEP,  /* as it is */
    APP_EXPOSURE_STEER, /* by the dots (core, ih_exposure) */
    APP_EXPOSURE_FIXED, /* exposure_us */
};

enum app_gain {
    APP_GAIN_AUTO,
    APP_GAIN_KEEP,
    APP_GAIN_FIXED, /* gain_value, in the camera's own unit */
};

enum app_repeat {
    APP_REPEAT_AUTO, /* with a live view, and for --check */
    APP_REPEAT_ON,
    APP_REPEAT_OFF,
};

enum app_strobe {
    APP_STROBE_ALWAYS,      /* on while frames come */
    APP_STROBE_GATED,       /* on for the exposure of each frame */
    APP_STROBE_ALTERNATING, /* every other frame is dark */
};

enum app_output {
    APP_OUTPUT_STDOUT,
    APP_OUTPUT_UDP,    /* output_host, output_port */
    APP_OUTPUT_SERIAL, /* output_path, output_baud */
};

enum app_record_when {
    APP_RECORD_ALWAYS,
    APP_RECORD_SIGNAL,
    APP_RECORD_MOVED,
    APP_RECORD_NO_HEAD, /* for record_no_head_s */
};

enum app_messages {
    APP_MESSAGES_STDERR,
    APP_MESSAGES_SYSLOG,
};

/* Texts are NULL where a setting is not given and no default is named here. */
struct app_config {
    const char *rig;        /* file; never NULL after success without laser_off, help or version */
    const char *device;     /* default /dev/video0 */
    const char *up;         /* APP_CONFIG_IIO and an accelerometer (hal_iio.h); NULL: none */
    bool is_directory;      /* the device is one, with frames; the laser is not enabled then */
    enum app_repeat repeat; /* a directory's frames */
    const char *format;     /* auto (default), GREY, Y10, ..., convert */
    int32_t rate_mhz; /* frames per 1000 s, 1000 .. 1000000; default 0: as the camera is set */
    enum app_exposure exposure;
    int32_t exposure_us; /* 1 .. 1000000 with APP_EXPOSURE_FIXED, else 0 */
    enum app_gain gain;
    int32_t gain_value; /* 0 .. 1000000 with APP_GAIN_FIXED, else 0 */

    bool laser; /* may be switched on; default false */
    enum app_strobe strobe;
    const char *gpio_chip;      /* path, name or label */
    const char *laser_line;     /* name or offset */
    const char *interlock_line; /* name or offset; NULL: none */
    const char *heartbeat_line; /* name or offset; NULL: none */
    bool laser_active_low;
    bool interlock_active_low;
    int32_t duty_percent; /* 1 .. 100, default 100 */
    int32_t laser_cap_ms; /* 10 .. 1000, default 200 */

    enum app_output output;
    char output_host[APP_CONFIG_VALUE_MAX + 1]; /* without the brackets of an IPv6 address */
    char output_port[sizeof "65535"];           /* decimal, 1 .. 65535 */
    char output_path[APP_CONFIG_VALUE_MAX + 1];
    int32_t output_baud; /* default 115200 */

    enum app_messages log;
    int32_t status_s;     /* 0: none, .. 86400; default 10 */
    const char *watchdog; /* device; NULL: none */
    bool paper;
    char view_host[APP_CONFIG_VALUE_MAX + 1]; /* a numeric address; default 127.0.0.1 */
    char view_port[sizeof "65535"]; /* decimal, 1 .. 65535; empty (default): no live view */

    const char *record; /* directory; NULL: nothing is recorded */
    enum app_record_when record_when;
    int32_t record_no_head_s; /* 1 .. 86400 with APP_RECORD_NO_HEAD, else 0 */
    int32_t record_s;         /* before and after what it is for; 1 .. 3600, default 10 */
    int32_t record_memory_mb; /* 1 .. 4096, default 32 */
    int32_t record_max_mb;    /* on the disk, 1 .. 1000000, default 1000 */

    /* Of the command line only. */
    const char *path; /* of the file; NULL: none */
    bool laser_off;   /* only make the laser's line low and end */
    bool check;       /* say whether the rig still fits and end */
    bool help, version;

    char directory_rig[APP_CONFIG_VALUE_MAX + sizeof "/rig.json"]; /* where rig is not given */
    char text[APP_CONFIG_TEXT_MAX + 1];                            /* of the file */
};

/* False: something was wrong and reported in errors, subject "FILE:LINE", "FILE" or "command line".
 * Whatever was right stands in *config even then: --laser-off with a broken file still knows the
 * laser's line, if that is right. With laser_off, help or version nothing is required, and with the
 * latter two the file is not read. */
bool app_config_read(struct app_config *config, int argument_count, char **arguments,
                     const struct hal_log *errors);

/* The text of --help. */
void app_config_help(FILE *file);

#endif
