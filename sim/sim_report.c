#include "sim_report.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#include "app_text.h"

/* Longest message; longer ones are cut. Paths may be of 4096 bytes. */
#define MESSAGE_MAX 5120

/* The line of progress is written at most this often; it has a rate, and the time that is left, once
 * they mean something. */
#define SHOW_EVERY_US 100000
#define RATE_AFTER_US 500000
#define LEFT_AFTER_US 2000000

void sim_report_init(struct sim_report *report)
{
    /* On one terminal with the results the two would mix, and results are progress enough. */
    *report = (struct sim_report){.terminal = isatty(STDERR_FILENO) && !isatty(STDOUT_FILENO)};
}

static void put(struct sim_report *report, char *message)
{
    app_text_tame(message);
    sim_report_progress_end(report);
    fprintf(stderr, "host_sim: %s\n", message);
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
    put(report, message);
    report->error_count++;
}

void sim_report_hint(struct sim_report *report, const char *subject, const char *text)
{
    char message[MESSAGE_MAX];
    snprintf(message, sizeof message, "%s: %s", subject, text);
    put(report, message);
}

static int64_t now_us(void)
{
    struct timespec now = {.tv_sec = 0};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

/* What is behind the counts: the rate, and the time that is left at this rate. */
static void write_rate(char *text, size_t size, int64_t run_us, size_t done, size_t count)
{
    text[0] = 0;
    if (run_us < RATE_AFTER_US || done == 0) {
        return;
    }
    double run_s = (double)run_us / 1e6;
    double frame_s = run_s / (double)done;
    int length = frame_s < 1 ? snprintf(text, size, ", %.0f frames/s", 1 / frame_s)
                             : snprintf(text, size, ", %.1f s a frame", frame_s);
    if (length > 0 && run_us >= LEFT_AFTER_US && done < count) {
        double left_s = frame_s * (double)(count - done) + 1;
        snprintf(text + length, size - (size_t)length, ", %.0f:%02d min left", floor(left_s / 60),
                 (int)fmod(left_s, 60));
    }
}

void sim_report_progress(struct sim_report *report, const char *name, size_t done, size_t count)
{
    if (!report->terminal) {
        return;
    }
    int64_t time_us = now_us();
    report->start_us = report->start_us == 0 ? time_us : report->start_us;
    if (report->progress_shown && time_us - report->shown_us < SHOW_EVERY_US) {
        return;
    }
    report->shown_us = time_us;
    char line[160];
    char rate[80];
    write_rate(rate, sizeof rate, time_us - report->start_us, done, count);
    snprintf(line, sizeof line, "%.30s %zu/%zu%s", name, done, count, rate);
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
