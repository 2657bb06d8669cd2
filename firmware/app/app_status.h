/* app_status - how the program is doing, as one line every few seconds.
 *
 * "25.0 frames/s, 312 dots, 0.9 heads, lost 0, skipped 0, bad 0, unsent 0, laser on 38 %, frame 41 ms"
 * Frames are those with a result, dots and heads their means, frame the longest time that one took;
 * without frames these three are left out; ", unrecorded N" is there only where frames were. All of it is since the line before.
 */
#ifndef APP_STATUS_H
#define APP_STATUS_H

#include <stdbool.h>
#include <stdint.h>

/* Room for any line. */
#define APP_STATUS_TEXT_MAX 320

struct app_status {
    int64_t interval_us; /* 0: no lines */
    int64_t since_us;
    int64_t frame_count, dot_sum, head_sum;
    int64_t process_max_us;
    int64_t laser_before_us; /* laser_on_us at the last line */
    /* The caller adds to these. */
    int64_t laser_on_us;      /* time with the laser on, since ever */
    int64_t lost_count;       /* missing in the camera's sequence */
    int64_t skipped_count;    /* not used: dark or half lit */
    int64_t bad_count;        /* could not be read or processed */
    int64_t unsent_count;     /* records that the output did not take */
    int64_t unrecorded_count; /* frames that the recorder had no room for */
};

/* interval_s: 0, no lines, or 1 .. 86400. */
void app_status_init(struct app_status *status, int32_t interval_s, int64_t now_us);

/* A frame with a result, and how long that took. */
void app_status_frame(struct app_status *status, int32_t dot_count, int32_t head_count,
                      int64_t process_us);

/* True when a line is due: it stands in text, and counting starts anew. */
bool app_status_line(struct app_status *status, int64_t now_us, char text[APP_STATUS_TEXT_MAX]);

#endif
