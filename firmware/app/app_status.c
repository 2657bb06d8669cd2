#include "app_status.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define SECOND_US 1000000

/* value in tenths, rounded to nearest. */
static int64_t tenths(int64_t sum, int64_t count)
{
    return (sum * 10 + count / 2) / count;
}

static void start(struct app_status *status, int64_t now_us)
{
    const struct app_status before = *status;
    memset(status, 0, sizeof *status);
    status->interval_us = before.interval_us;
    status->since_us = now_us;
    status->laser_before_us = before.laser_on_us;
    status->laser_on_us = before.laser_on_us;
}

void app_status_init(struct app_status *status, int32_t interval_s, int64_t now_us)
{
    memset(status, 0, sizeof *status);
    status->interval_us = (int64_t)interval_s * SECOND_US;
    start(status, now_us);
}

void app_status_frame(struct app_status *status, int32_t dot_count, int32_t head_count,
                      int64_t process_us)
{
    status->frame_count++;
    status->dot_sum += dot_count;
    status->head_sum += head_count;
    if (process_us > status->process_max_us) {
        status->process_max_us = process_us;
    }
}

static void print_line(const struct app_status *status, int64_t passed_us, char *text)
{
    int64_t count = status->frame_count;
    int64_t laser_us = status->laser_on_us - status->laser_before_us;
    int64_t rate = tenths(count * SECOND_US, passed_us);
    size_t room = APP_STATUS_TEXT_MAX;
    size_t length = 0;
    length +=
        (size_t)snprintf(text, room, "%" PRId64 ".%" PRId64 " frames/s", rate / 10, rate % 10);
    if (count > 0) {
        int64_t hypotheses = tenths(status->head_sum, count);
        length += (size_t)snprintf(
            text + length, room - length, ", %" PRId64 " dots, %" PRId64 ".%" PRId64 " heads",
            (status->dot_sum + count / 2) / count, hypotheses / 10, hypotheses % 10);
    }
    length += (size_t)snprintf(text + length, room - length,
                               ", lost %" PRId64 ", skipped %" PRId64 ", bad %" PRId64
                               ", unsent %" PRId64 ", laser on %" PRId64 " %%",
                               status->lost_count, status->skipped_count, status->bad_count,
                               status->unsent_count, (laser_us * 100 + passed_us / 2) / passed_us);
    if (status->unrecorded_count > 0) {
        length += (size_t)snprintf(text + length, room - length, ", unrecorded %" PRId64,
                                   status->unrecorded_count);
    }
    if (count > 0) {
        snprintf(text + length, room - length, ", frame %" PRId64 " ms",
                 (status->process_max_us + 999) / 1000);
    }
}

bool app_status_line(struct app_status *status, int64_t now_us, char text[APP_STATUS_TEXT_MAX])
{
    int64_t passed_us = now_us - status->since_us;
    if (status->interval_us == 0 || passed_us < status->interval_us) {
        return false;
    }
    print_line(status, passed_us, text);
    start(status, now_us);
    return true;
}
