#include "sim_report.h"

#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "app_text.h"

/* Longest message; longer ones are cut. Paths may be of 4096 bytes. */
#define MESSAGE_MAX 5120

void sim_report_init(struct sim_report *report)
{
    /* On one terminal with the results the two would mix, and results are progress enough. */
    *report = (struct sim_report){.terminal = isatty(STDERR_FILENO) && !isatty(STDOUT_FILENO)};
}

void sim_report_error(struct sim_report *report, const char *subject, const char *format, ...)
{
    char message[MESSAGE_MAX];
    int length = snprintf(message, sizeof message, "%s: ", subject);
    if (length >= 0 && (size_t)length < sizeof message) {
        va_list arguments;
        va_start(arguments, format);
        vsnprintf(message + length, sizeof message - (size_t)length, format, arguments);
        va_end(arguments);
    }
    app_text_tame(message);
    sim_report_progress_end(report);
    fprintf(stderr, "host_sim: %s\n", message);
    report->error_count++;
}

void sim_report_progress(struct sim_report *report, const char *name, size_t done, size_t count)
{
    if (!report->terminal) {
        return;
    }
    char line[80];
    snprintf(line, sizeof line, "%.40s %zu/%zu", name, done, count);
    app_text_tame(line);
    fprintf(stderr, "\r\033[K%s", line);
    fflush(stderr);
    report->progress_shown = true;
}

void sim_report_progress_end(struct sim_report *report)
{
    if (report->progress_shown) {
        fputs("\r\033[K", stderr);
        report->progress_shown = false;
    }
}

static void log_error(void *context, const char *subject, const char *text)
{
    sim_report_error(context, subject, "%s", text);
}

struct hal_log sim_report_log(struct sim_report *report)
{
    return (struct hal_log){.context = report, .error = log_error};
}

void *sim_report_grow(void *memory, size_t count, size_t item_size)
{
    void *grown = count > SIZE_MAX / item_size ? NULL : realloc(memory, count * item_size);
    if (grown == NULL) {
        fputs("host_sim: out of memory\n", stderr);
        exit(EXIT_FAILURE);
    }
    return grown;
}
