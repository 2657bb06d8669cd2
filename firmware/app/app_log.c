#include "app_log.h"

#include <inttypes.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "app_text.h"

#define SECOND_US 1000000

static void put(struct app_log *log, enum app_log_level level, char *text)
{
    app_text_tame(text);
    log->write(log->context, (int)level, text);
}

/* The end of a kind's interval: what was held back. */
static void close_kind(struct app_log *log, struct app_log_kind *kind)
{
    if (kind->held_count > 0) {
        char more[64];
        char text[APP_LOG_TEXT_MAX];
        int64_t passed_s = (log->now_us - kind->since_us + SECOND_US / 2) / SECOND_US;
        int length =
            snprintf(more, sizeof more, " (last of %" PRId64 " held back in %" PRId64 " s)",
                     kind->held_count, passed_s);
        snprintf(text, sizeof text, "%.*s%s", (int)sizeof text - 1 - length, kind->last, more);
        put(log, kind->level, text);
    }
    kind->format = NULL;
}

static bool is_over(const struct app_log *log, const struct app_log_kind *kind)
{
    return log->now_us - kind->since_us >= APP_LOG_INTERVAL_US;
}

/* The entry of a kind, a free one, or the one that all others share. */
static struct app_log_kind *find_kind(struct app_log *log, enum app_log_level level,
                                      const char *format)
{
    struct app_log_kind *free_kind = &log->kind[APP_LOG_KINDS_MAX];
    for (int i = APP_LOG_KINDS_MAX - 1; i >= 0; i--) {
        struct app_log_kind *kind = &log->kind[i];
        if (kind->format == NULL) {
            free_kind = kind;
        } else if (kind->level == level && strcmp(kind->format, format) == 0) {
            return kind;
        }
    }
    return free_kind;
}

void app_log_init(struct app_log *log, void (*write)(void *context, int level, const char *text),
                  void *context, int64_t now_us)
{
    memset(log, 0, sizeof *log);
    log->write = write;
    log->context = context;
    log->now_us = now_us;
}

void app_log_time(struct app_log *log, int64_t now_us)
{
    log->now_us = now_us;
    for (int i = 0; i <= APP_LOG_KINDS_MAX; i++) {
        if (log->kind[i].format != NULL && is_over(log, &log->kind[i])) {
            close_kind(log, &log->kind[i]);
        }
    }
}

void app_log_say(struct app_log *log, enum app_log_level level, const char *format, ...)
{
    char text[APP_LOG_TEXT_MAX];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    struct app_log_kind *kind = find_kind(log, level, format);
    if (kind->format == NULL) {
        kind->format = format;
        kind->since_us = log->now_us;
        kind->reported_count = 0;
        kind->held_count = 0;
        kind->level = level;
    }
    if (kind->reported_count < APP_LOG_BURST) {
        kind->reported_count++;
        put(log, level, text);
        return;
    }
    kind->held_count++;
    if (level <= kind->level || kind->held_count == 1) {
        kind->level = level;
        memcpy(kind->last, text, sizeof text);
    }
}

void app_log_report(struct app_log *log, enum app_log_level level, const char *text)
{
    char own[APP_LOG_TEXT_MAX];
    snprintf(own, sizeof own, "%s", text);
    put(log, level, own);
}

void app_log_end(struct app_log *log)
{
    for (int i = 0; i <= APP_LOG_KINDS_MAX; i++) {
        if (log->kind[i].format != NULL) {
            close_kind(log, &log->kind[i]);
        }
    }
}
