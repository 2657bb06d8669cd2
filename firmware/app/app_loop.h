/* app_loop - the board program between its HAL and the core: frames in, records out, the laser
 * in between.
 *
 * One thread, one loop: wait for the camera, a signal, the interlock or the next limit in time; take
 * the newest frame; decide from its labels whether the laser lit it (app_phase); find the heads in
 * it; hand on the record; say what the laser shall do next.
 *
 * Strobe modes (app_config.strobe):
 *   always       on while the camera streams.
 *   gated        on until a frame comes, off while it is looked at. A frame that turns out dark was
 *                in flight before: on again.
 *   alternating  on until a frame is seen lit, off until one is seen dark, and so on. That keeps
 *                in step with any camera: without frames in flight every second one is lit, with
 *                them runs of both. Lit ones all count, the last dark one is subtracted as ambient
 *                light.
 * Without laser every frame is taken as lit by something else.
 *
 * Frames that wait behind a newer one are given back unseen: the newest counts. What was lost or
 * skipped on the way to a frame stands in its record.
 *
 * Errors: a frame that cannot be used has an error record. A camera that is gone, silent for
 * APP_LOOP_SILENT_FRAMES frame times, or of a rate that cannot be believed in or is too slow for the
 * laser's cap (APP_LASER_CAP_FRAMES) is closed and opened again, at first soon, then every few
 * seconds; the laser is off meanwhile. A rig that cannot be read at SIGHUP: laser off and no records
 * until the next SIGHUP with a good one. What fails of strobe, guard, events or output for good ends
 * the program, laser off.
 */
#ifndef APP_LOOP_H
#define APP_LOOP_H

#include "app_state.h"

/* After so many frame times without a frame, but not sooner than this, the camera is opened anew. */
#define APP_LOOP_SILENT_FRAMES 10
#define APP_LOOP_SILENT_MIN_US 1000000
/* Between two tries to open the camera. */
#define APP_LOOP_RETRY_MIN_US 250000
#define APP_LOOP_RETRY_MAX_US 4000000
/* Max frames that are given back for a newer one at a time; a camera has fewer buffers. */
#define APP_LOOP_DRAIN_MAX 32
/* Between frames of a camera that does not say. */
#define APP_LOOP_FRAME_TIME_US 40000
/* Between frames of one that does: nothing else is believed. */
#define APP_LOOP_FRAME_TIME_MIN_US 1000
#define APP_LOOP_FRAME_TIME_MAX_US 1000000

/* Until requested to end, or until it cannot go on. All but the given is set here. The camera is closed
 * and the laser off when it returns. */
enum app_exit app_loop_run(struct app_state *state);

#endif
