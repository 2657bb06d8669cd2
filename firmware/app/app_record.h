/* app_record - a frame's result as one line of JSON (docs/contract.md, "A record").
 *
 * Printed from integers: pixels with 2 decimals, mm and degrees with 1, so that the same frames
 * give the same bytes on every machine. Beyond the contract's fields:
 *   "dir"      the frames directory, where a run has several
 *   "points"   measured points; range images only, which have no dots and labels
 *   "dropped"  what did not fit into a full table, by kind; only where something was dropped
 */
#ifndef APP_RECORD_H
#define APP_RECORD_H

#include <stdio.h>

#include "hal.h"
#include "isohead.h"

struct app_record {
    FILE *file;
    const char *dir; /* NULL: the run has one directory only */
};

void app_record_frame(const struct app_record *record, const struct hal_frame *frame,
                      const struct isohead *head);

/* A frame that could not be processed. */
void app_record_error(const struct app_record *record, const char *name, const char *error);

#endif
