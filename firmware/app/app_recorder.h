/* app_recorder - what is recorded, and when it is written (hal/linux/hal_recorder.h writes).
 *
 * In:    every frame that is used: a lit one with its result, one that is kept as the ambient frame.
 * Out:   with record-when = always all of them are written. Else the last record-seconds wait in memory, and are written with
 *        those of as many seconds more at SIGUSR1, and
 *        moved      when the log reports that the rig has moved or is lost (app_health.h);
 *        a number   when no head has been found for so many seconds: once, until one has been found again.
 *        What happens while it is written makes it go on for longer.
 * Frames that were skipped are not recorded: the others, replayed, give the same records (docs/contract.md). Frames that the
 * recorder had no room for are counted, and the log says so, as it says what the recorder reports.
 */
#ifndef APP_RECORDER_H
#define APP_RECORDER_H

#include "app_state.h"

/* The loop begins, a rig is loaded. */
void app_recorder_begin(struct app_state *state);

/* A frame that is used; before it is released. A lit one has its result. */
void app_recorder_frame(struct app_state *state, const struct hal_frame *frame, bool lit);

/* Somebody wants it written. */
void app_recorder_request(struct app_state *state);

/* The rig was read anew, and is another from now on. */
void app_recorder_rig(struct app_state *state);

/* Whenever the loop wakes. */
void app_recorder_tick(struct app_state *state);

#endif
