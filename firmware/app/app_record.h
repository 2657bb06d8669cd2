/* app_record - a frame's result as one line of JSON (docs/contract.md, "A record").
 *
 * Out:   record->text, length bytes, the line's end among them and no closing zero; where it goes is
 *        the caller's business.
 * Printed from integers: pixels with 2 decimals, mm and degrees with 1, so that the same frames
 * give the same bytes on every machine. Beyond the contract's fields:
 *   "dir"      the frames directory, where a run has several
 *   "points"   measured points; range images only, which have no dots and labels
 *   "dropped"  what did not fit into a full table, by kind; only where something was dropped
 *   "rig"      how the rig has moved against its file (ih_align.h): angles with 3 decimals, per cent and pixels with 2; dot
 *              rigs only, and not with the paper's method alone
 *   "lost", "skipped", "strobe"   live cameras: struct app_record_live
 *   "across_px"   live cameras: the one of "rig"; only where a dot is labelled
 * Error: false where a record is longer than APP_RECORD_MAX; then length is 0. No file of Linux has
 *        a name that makes it so.
 */
#ifndef APP_RECORD_H
#define APP_RECORD_H

#include "hal.h"
#include "isohead.h"

/* The longest hypothesis, all numbers as long as 32 bits allow, with its place in "heads". */
#define APP_RECORD_ENTRY_MAX 400
/* A byte of a string takes up to 6: \u001b. Linux has names of up to 255 bytes and paths of up to
 * 4095. */
#define APP_RECORD_NAME_MAX (6 * 255)
#define APP_RECORD_DIR_MAX (6 * 4095)
/* Everything else: keys, counts, an error of HAL_ERROR_MAX bytes. */
#define APP_RECORD_OTHER_MAX (512 + 6 * HAL_ERROR_MAX)
/* Longest record: 38 KiB; of a board, which has no directory, about a third. */
#define APP_RECORD_MAX                                                                 \
    (IH_RESULT_MAX * APP_RECORD_ENTRY_MAX + APP_RECORD_NAME_MAX + APP_RECORD_DIR_MAX + \
     APP_RECORD_OTHER_MAX)

struct app_record {
    const char *dir; /* NULL: the run has one directory only */
    size_t length;
    char text[APP_RECORD_MAX];
};

/* What a live camera adds; each is printed only where there is something to say. */
struct app_record_live {
    int64_t lost_count;    /* frames missing in the camera's sequence since the last record */
    int64_t skipped_count; /* frames not used since then: dark or half lit ones beyond what the
                            * strobe's mode lets expect */
    const char *strobe;    /* a word on how the strobe stands; NULL: as it should */
};

/* live: NULL for frames from a file. */
bool app_record_frame(struct app_record *record, const struct hal_frame *frame,
                      const struct isohead *head, const struct app_record_live *live)
    __attribute__((warn_unused_result));

/* A frame that could not be processed. */
bool app_record_error(struct app_record *record, const char *name, const char *error)
    __attribute__((warn_unused_result));

#endif
