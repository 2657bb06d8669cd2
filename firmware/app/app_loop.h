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
 * Errors: a frame that cannot be used has an error record. A camera that is gone, or silent for
 * APP_LOOP_SILENT_FRAMES frame times, is closed and opened again, at first soon, then every few
 * seconds; the laser is off meanwhile. A rig that cannot be read at SIGHUP: laser off and no records
 * until the next SIGHUP with a good one. What fails of strobe, guard, events or output for good ends
 * the program, laser off.
 */
#ifndef APP_LOOP_H
#define APP_LOOP_H

#include "app_config.h"
#include "app_laser.h"
#include "app_log.h"
#include "app_phase.h"
#include "app_record.h"
#include "app_status.h"
#include "hal.h"
#include "upkeep/ih_exposure.h"
#include "upkeep/ih_health.h"

/* After so many frame times without a frame, but not sooner than this, the camera is opened anew. */
#define APP_LOOP_SILENT_FRAMES 10
#define APP_LOOP_SILENT_MIN_US 1000000
/* Between two tries to open the camera. */
#define APP_LOOP_RETRY_MIN_US 250000
#define APP_LOOP_RETRY_MAX_US 4000000
/* Most frames that are given back for a newer one at a time; a camera has fewer buffers. */
#define APP_LOOP_DRAIN_MAX 32
/* An ambient frame older than this says too little about the scene: at 1 m/s somebody has moved by
 * 200 mm. */
#define APP_LOOP_AMBIENT_AGE_MAX_US 200000

/* Between frames of a camera that does not say. */
#define APP_LOOP_FRAME_TIME_US 40000
/* The first exposure when it is steered. */
#define APP_LOOP_EXPOSURE_US 4000

enum app_exit {
    APP_EXIT_GOOD = 0,   /* ended as asked */
    APP_EXIT_FAILED = 1, /* could not go on */
    APP_EXIT_USAGE = 2   /* wrong usage, configuration or rig */
};

struct app_hal {
    const struct hal_camera *camera;
    const struct hal_strobe *strobe;
    const struct hal_events *events;
    const struct hal_clock *clock;
    const struct hal_watchdog *watchdog;
    const struct hal_output *output;
    const struct hal_viewer *viewer; /* NULL: none */
};

struct app_loop {
    /* Given. */
    const struct app_config *config;
    struct app_hal hal;
    struct app_log *log;
    struct isohead *head;
    /* Its own. */
    struct app_laser laser;
    unsigned told_blocks; /* of the laser, in the log */
    struct app_phase phase;
    struct app_status status;
    bool is_streaming; /* the camera is open */
    bool light_wanted; /* the next frame shall be lit */
    int32_t on_frames; /* frames since then with the laser on, up to APP_PHASE_FLIGHT_MAX + 1 */
    int64_t frame_time_us;
    int64_t frame_us; /* when the last frame came */
    int64_t retry_us; /* when the camera is to be opened */
    int64_t retry_wait_us;
    int64_t sequence; /* of the last frame; -1: none */
    bool has_ambient;
    struct hal_frame ambient; /* held */
    struct ih_exposure exposure;
    bool steers;                 /* the exposure */
    struct app_record_live live; /* since the last record */
    int64_t result_count;        /* frames with a result */
    struct ih_health health;     /* app_health.h */
    struct ih_health_scratch health_scratch;
    enum ih_health_state told_health; /* in the log */
    int32_t told_turn_rad_q30[3];
    int32_t checked_count; /* frames, with config->check */

    bool rig_is_valid;
    int32_t width, height; /* of the first rig */
    bool is_over;
    bool told_fault; /* the laser's, in the log */
    enum app_exit exit;
    struct app_record record;
};

/* Until asked to end, or until it cannot go on. All but the given is set here. The camera is closed
 * and the laser off when it returns. */
enum app_exit app_loop_run(struct app_loop *loop);

/* For app_frame: laser off, and the loop ends with this turn. */
void app_loop_end(struct app_loop *loop, enum app_exit exit);

#endif
