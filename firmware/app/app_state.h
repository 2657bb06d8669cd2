/* app_state - what the parts of the board's program share: the devices, the laser, the frames so far.
 *
 * app_loop runs it, app_frame uses its frames, app_health watches its rig; they know this header, and
 * of each other only what they call.
 */
#ifndef APP_STATE_H
#define APP_STATE_H

#include "app_config.h"
#include "app_laser.h"
#include "app_log.h"
#include "app_phase.h"
#include "app_record.h"
#include "app_status.h"
#include "hal.h"
#include "isohead.h"
#include "upkeep/ih_exposure.h"

enum app_exit {
    APP_EXIT_GOOD = 0,   /* ended as requested */
    APP_EXIT_FAILED = 1, /* could not go on */
    APP_EXIT_USAGE = 2,  /* wrong usage, configuration or rig */
    APP_EXIT_NO_LINE = 3 /* --laser-off alone: the line was not found, or somebody else has it */
};

struct app_hal {
    const struct hal_camera *camera;
    const struct hal_strobe *strobe;
    const struct hal_events *events;
    const struct hal_clock *clock;
    const struct hal_watchdog *watchdog;
    const struct hal_output *output;
    const struct hal_viewer *viewer;     /* NULL: none */
    const struct hal_recorder *recorder; /* NULL: none */
};

#define APP_HEALTH_MOVES 6
#define APP_HEALTH_CHECKED 60 /* lit frames of --check */

/* What the log knows of the rig; app_health.h. */
struct app_health {
    int64_t lit_us;       /* when the last lit frame came, or the rig was loaded */
    int32_t frame_count;  /* lit ones since the rig was loaded */
    int32_t steady_count; /* frames of this state, one after the other */
    enum ih_align_state last_state;
    int32_t mean_rad_q30[APP_HEALTH_MOVES]; /* over the last frames */
    enum ih_align_state reported_state;
    int32_t reported_rad_q30[APP_HEALTH_MOVES];
};

/* app_recorder.h. */
struct app_recording {
    bool writes;
    int64_t until_us;    /* it writes; not with APP_RECORD_ALWAYS */
    int64_t head_us;     /* when the last head was found */
    bool waits_for_head; /* written for its want; not again before there is one */
    enum ih_align_state reported_state;
};

struct app_state {
    /* Given. */
    const struct app_config *config;
    struct app_hal hal;
    struct app_log *log;
    struct isohead *head;
    const int32_t *measured_up_q30; /* by an accelerometer; NULL: none */
    /* Its own. */
    struct app_laser laser;
    unsigned reported_blocks; /* of the laser, in the log */
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
    /* Before a frame was judged: what that changed is undone where the frame is not used as it was judged. */
    struct ih_align align_before;
    struct ih_rig rig_before;
    struct ih_exposure exposure;
    bool steers;                 /* the exposure */
    struct app_record_live live; /* since the last record */
    int64_t result_count;        /* frames with a result */
    struct app_health health;
    struct app_recording recording;

    bool rig_is_valid;
    int32_t width, height; /* of the first rig */
    bool is_over;
    bool reported_fault; /* the laser's, in the log */
    enum app_exit exit;
    struct app_record record;
};

/* The clock of the board. */
int64_t app_state_now_us(const struct app_state *state);

/* Laser off, and the loop ends with this turn. A --check that has no answer yet has failed, even if its end was
 * requested. */
void app_state_end(struct app_state *state, enum app_exit exit);

#endif
