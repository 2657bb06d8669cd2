/* app_settings - the table of all settings of isohead_board: what each is called, which values it
 * takes and where they go. The command line, the file and --help are read and written by it alone.
 */
#ifndef APP_SETTINGS_H
#define APP_SETTINGS_H

#include "app_config.h"
#include "app_write.h"

enum app_settings_place {
    APP_SETTINGS_BOTH,    /* option and key */
    APP_SETTINGS_OPTION,  /* option only */
    APP_SETTINGS_COMMAND, /* option only, and without any value */
};

struct app_setting {
    const char *name;
    const char *argument; /* as --help shows it; NULL: a flag, on or off */
    const char *expected; /* what its value is, after "expected" */
    const char *help;
    /* What is to be read, and the offset in struct app_config where it goes. False: wrong. */
    bool (*take)(const struct app_setting *setting, struct app_config *config, const char *value);
    size_t offset;
    size_t number_offset;     /* where a number goes that stands in place of a word */
    const char *const *words; /* up to NULL; the first is the default */
    const char *heading;      /* --help: above this one; NULL: none */
    int32_t minimum, maximum; /* of a number */
    int32_t decimals;         /* it is kept in 10^-decimals */
    enum app_settings_place place;
};

#define APP_SETTINGS_COUNT 34
extern const struct app_setting app_settings[];

/* Index of a setting, or -1. */
int app_settings_find(const char *name);

/* Index of the setting whose name is the most similar one, or -1 where none is similar. */
int app_settings_nearest(const char *name);

/* Put the value into the config; texts are not copied. False: *error, without the setting's name. */
bool app_settings_take(int index, struct app_config *config, const char *value,
                       struct hal_error *error);

/* An object with every setting that may stand in a file: what was given, or its default; null where there is none. */
void app_settings_write(const struct app_config *config, struct app_write *write);

/* All that is not given. */
void app_settings_default(struct app_config *config);

#endif
