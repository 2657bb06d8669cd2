/* app_laser - the laser's policy: the only place that switches it on.
 *
 * In:    what the loop wishes, what it sees (frames, the interlock's events, the time), and what
 *        may be wrong (rig, camera).
 * Out:   the strobe line. It is high only while the loop wishes it and nothing speaks against it:
 *        - it is enabled (app_laser_config.enabled);
 *        - the rig is valid (app_laser_rig) and the camera streams (app_laser_camera);
 *        - since the last frame that was judged it has been on for less than APP_LASER_SILENT_FRAMES
 *          frame times, and for less than the cap, whatever the camera says of its rate. A camera that
 *          is opened after the laser has been off for HAL_LIMITS_PAUSE_US begins anew;
 *        - the interlock is closed, after a movement for APP_LASER_CLOSED_US: contacts bounce. It is
 *          read before switching on and once more afterwards, so that one that opens in between is
 *          seen here or comes as an event later; and at every tick, which is also how the guard tells
 *          that it has switched off;
 *        - the duty is kept: over any time T the laser is on for at most duty_percent of
 *          (T + APP_LASER_BURST_US). While a frame is processed nobody looks: the laser stays on
 *          only where duty and cap last. For the duty that means for as long as the guard lets it
 *          be on (HAL_LIMITS_SLACK_US beyond the cap), for the cap as long as any frame took;
 *        - no call of the strobe has failed. After a failure it is switched off by every means there
 *          is (again, then by giving the lines back) and stays off: the caller ends.
 * Time:  app_laser_tick looks at the clock. The loop calls it before it waits and does not wait for
 *        longer than what it returns, so that a limit in time is kept to the timer's precision while
 *        the loop waits. While a frame is processed (app_laser_busy) the guard looks at the interlock
 *        and for life (hal/linux/hal_guard.h, docs/safety.md).
 * Errors: app_laser.failed, with the text; reported once through the caller.
 */
#ifndef APP_LASER_H
#define APP_LASER_H

#include "hal_limits.h"

/* The time whose duty may be used at once, after a rest. */
#define APP_LASER_BURST_US HAL_LIMITS_BURST_US
/* Between two edges for an external one-shot while the laser is on; there is a rising one just before
 * it is switched on. The one-shot has to bridge the processing of a frame too. */
#define APP_LASER_BEAT_US 10000
/* Without a frame for so many frame times it goes off. */
#define APP_LASER_SILENT_FRAMES 3
/* The cap is at least so many frame times, or frames would come too late for it. */
#define APP_LASER_CAP_FRAMES 2
/* A wait that nothing limits; the watchdogs want a sign of life several times in 2 s. */
#define APP_LASER_NEVER_US 400000
/* So long the interlock has been closed and has not moved before the laser is on again. */
#define APP_LASER_CLOSED_US 20000
/* How often switching off is tried before the lines are given back. */
#define APP_LASER_OFF_TRIES 3

/* What can speak against the laser; a set. */
enum app_laser_block {
    APP_LASER_BLOCK_DISABLED = 1,   /* not enabled */
    APP_LASER_BLOCK_RIG = 2,        /* no valid rig */
    APP_LASER_BLOCK_CAMERA = 4,     /* the camera does not stream */
    APP_LASER_BLOCK_SILENCE = 8,    /* frames have stopped coming */
    APP_LASER_BLOCK_INTERLOCK = 16, /* the interlock is open, or a guard keeps it off */
    APP_LASER_BLOCK_DUTY = 32,      /* on for too long, will be over soon */
    APP_LASER_BLOCK_FAULT = 64      /* the strobe failed; never taken back */
};

struct app_laser_config {
    bool enabled;         /* false: the strobe is never touched */
    int32_t duty_percent; /* 1 .. 100 */
    int64_t cap_us;       /* max time on without a frame that was judged */
};

/* What the loop does with a frame; nobody looks at the clock meanwhile. */
enum app_laser_stage {
    APP_LASER_IDLE,   /* nothing: it waits */
    APP_LASER_JUDGES, /* finds out whether it is lit */
    APP_LASER_FINDS,  /* finds the heads */
    APP_LASER_STAGES
};

struct app_laser {
    struct app_laser_config config;
    const struct hal_strobe *strobe;
    bool wished;
    bool is_on;            /* the last state that was set */
    unsigned blocks;       /* of enum app_laser_block */
    bool is_open;          /* the lines are taken */
    int64_t silent_us;     /* on without a frame, */
    int64_t silent_max_us; /* and its limit */
    int64_t off_us;        /* off since so long */
    int64_t tick_us;       /* when time was last accounted for */
    int64_t credit;        /* left of the duty, percent x us */
    enum app_laser_stage stage;
    int64_t stage_us;                       /* since when */
    int64_t stage_max_us[APP_LASER_STAGES]; /* longest so far */
    int64_t open_us;                        /* when the interlock was last seen open */
    int64_t beat_us;                        /* last edge for the one-shot */
    int64_t on_us;                          /* sum of all times with the laser on */
    int64_t on_count;                       /* how often it was switched on */
    struct hal_error failed;                /* why APP_LASER_BLOCK_FAULT */
    bool may_be_on; /* it could not be switched off, only its lines given back */
};

/* Off, with everything against it that can be; strobe and config's values are kept. */
void app_laser_init(struct app_laser *laser, const struct app_laser_config *config,
                    const struct hal_strobe *strobe, int64_t now_us);

/* Take the lines and try them; *unproven: what could not be shown to work, or "". False: failed, and
 * the lines are given back. Not enabled: nothing happens. */
bool app_laser_open(struct app_laser *laser, struct hal_error *unproven);

/* Off by every means, lines given back. May be called at any time, several times. If it could not be
 * switched off before: failed. */
void app_laser_close(struct app_laser *laser, int64_t now_us);

/* The loop's wish. */
void app_laser_wish(struct app_laser *laser, bool on, int64_t now_us);

void app_laser_rig(struct app_laser *laser, bool is_valid, int64_t now_us);

/* The camera streams, a frame every frame_time_us, or it does not: then the time does not matter. */
void app_laser_camera(struct app_laser *laser, bool streams, int64_t frame_time_us, int64_t now_us);

/* A frame was judged: lit, dark or neither. */
void app_laser_frame(struct app_laser *laser, int64_t now_us);

/* The loop is busy with a frame from now on, or has been until now: no time to tick. Where duty or
 * cap might not last it goes off before. */
void app_laser_busy(struct app_laser *laser, bool busy, int64_t now_us);

/* The interlock has moved, or might have. */
void app_laser_interlock(struct app_laser *laser, int64_t now_us);

/* Keep the limits in time. How long one may wait until the next call, in us, at least 1. */
int64_t app_laser_tick(struct app_laser *laser, int64_t now_us);

/* What speaks against it, the weightiest; for messages. NULL: nothing, or what app_laser.failed says. */
const char *app_laser_block_text(unsigned blocks);

#endif
