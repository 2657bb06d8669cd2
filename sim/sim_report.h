/* sim_report - what goes to standard error: errors, hints, and on a terminal the progress. */
#ifndef SIM_REPORT_H
#define SIM_REPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "hal.h"

struct sim_report {
    bool terminal;       /* progress is shown: standard error is a terminal, output is none */
    bool progress_shown; /* the cursor stands behind a progress line */
    int64_t start_us;    /* of the first progress; 0: none yet */
    int64_t shown_us;    /* when the line was last written */
    int error_count;     /* not 0: the exit status is 1 */
};

void sim_report_init(struct sim_report *report);

/* "host_sim: SUBJECT: TEXT" on a line; subject is the file, device or directory. */
void sim_report_error(struct sim_report *report, const char *subject, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* The same, and no error: the exit status stays. */
void sim_report_hint(struct sim_report *report, const char *subject, const char *text);

/* "NAME DONE/COUNT, RATE frames/s, TIME left" on the same line again and again, where it is shown: ten
 * times a second. The time that is left is shown from the third second on. */
void sim_report_progress(struct sim_report *report, const char *name, size_t done, size_t count);
void sim_report_progress_end(struct sim_report *report);

/* The same as a log for a back end. */
struct hal_log sim_report_log(struct sim_report *report);

/* realloc that ends the program with a message and status 1 when there is no memory. */
void *sim_report_grow(void *memory, size_t count, size_t item_size);

#endif
