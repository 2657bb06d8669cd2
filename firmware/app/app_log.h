/* app_log - messages, with a limit on how often the same one comes.
 *
 * A message's kind is its format and level. In APP_LOG_INTERVAL_US from the first of a kind
 * APP_LOG_BURST are reported; further ones are counted, and at the interval's end the last of them is
 * reported with their count: "camera: short frame (last of 37 held back in 60 s)". There is room for
 * APP_LOG_KINDS_MAX kinds at a time; what comes beside them shares one more.
 *
 * Time is the last argument of app_log_time. Control characters become '?', a text that is too long
 * is cut.
 */
#ifndef APP_LOG_H
#define APP_LOG_H

#include <stdint.h>

#define APP_LOG_BURST 5
#define APP_LOG_INTERVAL_US 60000000
#define APP_LOG_KINDS_MAX 16
/* Longest message, its closing zero included. */
#define APP_LOG_TEXT_MAX 512

/* The numbers are syslog's. */
enum app_log_level {
    APP_LOG_ERROR = 3,
    APP_LOG_WARNING = 4,
    APP_LOG_INFO = 6,
};

/* What is known of a kind in its interval. */
struct app_log_kind {
    const char *format; /* NULL: free */
    enum app_log_level level;
    int64_t since_us;
    int32_t reported_count;
    int64_t held_count;
    char last[APP_LOG_TEXT_MAX]; /* of those held */
};

struct app_log {
    void (*write)(void *context, int level, const char *text);
    void *context;
    int64_t now_us;
    struct app_log_kind kind[APP_LOG_KINDS_MAX + 1]; /* the last one: all that found no room */
};

/* write: takes a line without its end, and the level. */
void app_log_init(struct app_log *log, void (*write)(void *context, int level, const char *text),
                  void *context, int64_t now_us);

/* What time it is; reports what is due. To be called whenever the loop wakes. */
void app_log_time(struct app_log *log, int64_t now_us);

/* format: a text that lives as long as the log. */
void app_log_say(struct app_log *log, enum app_log_level level, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Without limit, for what comes seldom of its own. */
void app_log_report(struct app_log *log, enum app_log_level level, const char *text);

/* All that is still held back; before the end. */
void app_log_end(struct app_log *log);

#endif
