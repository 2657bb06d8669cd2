/* app_world - a camera, a laser line and time for tests of the board program's loop, all made up.
 *
 * A frame is exposed every 40 ms while the camera is open; it is lit when the laser's line is high
 * then, and comes out of the camera `flight` frames later. Time passes only in wait(). The core is a
 * double too: a frame has as many labels as its first byte says.
 *
 * Every call of the HAL goes through world_call, which counts it and lets the one that was chosen
 * fail, once or from then on. And every call looks whether the laser may be on at this moment.
 */
#ifndef APP_WORLD_H
#define APP_WORLD_H

#include <stdio.h>
#include <string.h>

#include "app_loop.h"
#include "app_rig.h"
#include "unity.h"

#define WORLD_FRAME_US 40000
#define WORLD_CAP_MS 200
#define WORLD_LIT_LABELS 200
#define WORLD_UNPLUGGED_US 300000
#define WORLD_KNOCK_RAD_Q30 3748032 /* 0.2 degrees */
#define WORLD_BUFFERS 16
#define WORLD_FAULTS 2
/* However quick, no wait takes no time. */
#define WORLD_WAIT_US 100

enum world_function {
    WORLD_CAMERA_OPEN,
    WORLD_CAMERA_NEXT_GONE,
    WORLD_CAMERA_NEXT_BAD,
    WORLD_CAMERA_NEXT_END,
    WORLD_CAMERA_NEXT_NONE,
    WORLD_CAMERA_EXPOSURE,
    WORLD_STROBE_OPEN,
    WORLD_STROBE_ON,      /* fails, and the line is low */
    WORLD_STROBE_ON_HIGH, /* fails, and the line is high all the same */
    WORLD_STROBE_OFF,
    WORLD_STROBE_BEAT,
    WORLD_STROBE_INTERLOCK,
    WORLD_STROBE_JUDGED,
    WORLD_STROBE_PROVE,
    WORLD_EVENTS_WAIT,
    WORLD_EVENTS_NOTHING, /* an event goes by unseen */
    WORLD_WATCHDOG_FEED,
    WORLD_OUTPUT_NOT,
    WORLD_OUTPUT_NEVER,
    WORLD_RECORDER_KEEP,
    WORLD_RECORDER_NEWS,
    WORLD_FUNCTIONS
};

static const char *const world_function_text[WORLD_FUNCTIONS] = {
    "camera.open",         "camera.next: gone", "camera.next: bad frame",
    "camera.next: end",    "camera.next: none", "camera.set_exposure",
    "strobe.open",         "strobe.set on",     "strobe.set on, but high",
    "strobe.set off",      "strobe.beat",       "strobe.interlock",
    "strobe.judged",       "strobe.prove",      "events.wait",
    "events.wait: unseen", "watchdog.feed",     "output.send: not",
    "output.send: never",  "recorder.keep",     "recorder.news",
};

/* What happens at a frame's time, in place of the frame or with it. */
enum world_act {
    WORLD_FRAME = 0, /* as it should be */
    WORLD_LOST,      /* the driver drops it */
    WORLD_TWICE,     /* two are delivered at once */
    WORLD_PAUSE,     /* nothing, the sequence goes on: late */
    WORLD_HALF, /* exposed while the laser was switched: half of the labels that it would have */
    WORLD_INTERLOCK_OPENS,
    WORLD_INTERLOCK_CLOSES,
    WORLD_INTERLOCK_BLINKS, /* opens and closes */
    WORLD_RELOAD,
    WORLD_RECORD,       /* somebody requests a recording */
    WORLD_RELOAD_ALONE, /* and no frame; the rig and next_rig change places */
    WORLD_KNOCK,        /* the rig moves by 0.2 degrees */
    WORLD_UNPLUGGED,    /* the camera is gone, and cannot be opened for a while */
    WORLD_STOP
};

struct world_fault {
    enum world_function function;
    int call;   /* which call of it fails, from 1; 0: none */
    bool stays; /* those after it, too */
    bool done;  /* it was reached */
};

struct world {
    /* Given. */
    const enum world_act *act; /* of each frame's time, from 0; then WORLD_STOP */
    int act_count;
    int flight;
    bool is_empty;         /* nothing is within the laser's range */
    int64_t busy_us;       /* so long a lit frame is looked at */
    int32_t frame_time_us; /* what the camera says of it */
    struct world_fault faults[WORLD_FAULTS];
    uint32_t rig_random; /* the rig "now and then" is bad by chance, until this act */
    int rig_is_good_from_act;
    const char *next_rig; /* from the next reload on; NULL: the same */
    /* The world. */
    int64_t now_us, next_us;
    int act_index;
    bool line, line_taken, interlock_closed, interlock_moved;
    int64_t interlock_us; /* when it moved */
    bool camera_open;
    int64_t unplugged_until_us;
    int64_t sequence;
    struct hal_frame queue[WORLD_BUFFERS];
    int queue_count;
    uint8_t labels[WORLD_BUFFERS];
    char names[WORLD_BUFFERS][24];
    bool held[WORLD_BUFFERS];
    unsigned events;
    /* What it saw. */
    int calls[WORLD_FUNCTIONS];
    bool reported_fault;                /* a message says that the line cannot be set */
    bool reported_output;               /* a message says that the output is closed */
    char camera_text[APP_LOG_TEXT_MAX]; /* the last message about the camera */
    int64_t excess;      /* on beyond the duty, percent x us, in the worst time until now */
    int64_t on_since_us; /* of the line, without a frame */
    int64_t last_record_us;
    int record_count, lit_count, dark_count, error_count, ambient_count;
    int rise_count, beat_count;
    int32_t exposure_max_us;       /* as the core was given it */
    int busy_on_count;             /* heads were looked for with the laser on */
    int32_t drift_rad_q30[3];      /* from one lit frame to the next */
    struct ih_alignment alignment; /* what the core says of every lit frame */
    int unproven_count;            /* messages of it */
    int up_count;                  /* messages of up; the last one */
    char up[APP_LOG_TEXT_MAX];
    int32_t rig_up_q30[3];          /* in the rig file */
    int moved_count, lost_count;    /* warnings of the rig */
    char moved[APP_LOG_TEXT_MAX];   /* the last one */
    char unknown[APP_LOG_TEXT_MAX]; /* why --check has no answer */
    size_t records_length;
    char records[131072];
    int waits;
    /* What the recorder has; frames since it began to write. */
    int kept_count, kept_dark_count, write_count, rig_count, news_count;
    int64_t write_us, end_us; /* when it last began and ended to write */
    bool writes;
    int head_count; /* heads in every lit frame */
    /* The board program. */
    struct app_config config;
    struct app_log log;
    struct app_state state;
    struct hal_camera camera;
    struct hal_strobe strobe;
    struct hal_events event_table;
    struct hal_clock clock;
    struct hal_watchdog watchdog;
    struct hal_output output;
    struct hal_recorder recorder;
};

static struct world world;
static struct isohead world_head; /* its content does not matter */
static bool world_quiet = true;
static const char *world_doing; /* what is reported where a run of many fails */

/* Doubles of the rig file and of the core. */
bool app_rig_load(const char *path, struct ih_calibration *calibration, struct hal_error *error)
{
    *calibration = (struct ih_calibration){.kind = IH_RIG_DOTS, .width = 752, .height = 582};
    calibration->kind = strcmp(path, "range") == 0 ? IH_RIG_RANGE : IH_RIG_DOTS;
    calibration->width = strcmp(path, "narrow") == 0 ? 640 : 752;
    calibration->origin_mm_q16[0] = 25 << 15; /* 12.5 mm */
    memcpy(calibration->up_q30, world.rig_up_q30, sizeof calibration->up_q30);
    bool is_bad = strcmp(path, "bad") == 0;
    TEST_ASSERT_FALSE_MESSAGE(world.line, "on while the rig is read");
    if (strcmp(path, "now and then") == 0 && world.act_index <= world.rig_is_good_from_act) {
        world.rig_random = world.rig_random * 1664525u + 1013904223u;
        is_bad = world.rig_random >> 31 != 0;
    }
    return is_bad ? hal_fail(error, "near_mm: missing") : true;
}

/* Time passes; over any time the laser is on for no more than its duty of that and of one burst. */
static void world_pass(int64_t passed_us)
{
    int32_t duty = world.config.duty_percent;
    world.now_us += passed_us;
    world.excess += passed_us * ((world.line ? 100 : 0) - duty);
    world.excess = world.excess > 0 ? world.excess : 0;
    TEST_ASSERT_LESS_OR_EQUAL_INT64_MESSAGE((int64_t)duty * APP_LASER_BURST_US +
                                                100 * 2 * WORLD_WAIT_US,
                                            world.excess, "on for more than the duty");
}

enum ih_err isohead_init(struct isohead *head, const struct ih_calibration *calibration,
                         int32_t *bad_slot)
{
    *bad_slot = IH_NONE;
    head->rig.calibration = *calibration;
    head->params.is_paper = false;
    return IH_OK;
}

void ih_params_paper(struct ih_params *params)
{
    params->is_paper = true;
}

enum ih_err isohead_label(struct isohead *head, const struct ih_frame *frame,
                          const struct ih_frame *ambient)
{
    if (frame->width != head->rig.calibration.width) {
        return IH_ERR_SIZE;
    }
    world.on_since_us = world.now_us;
    head->labels.labelled_count = *(const uint8_t *)frame->samples;
    head->dots.dot_count = head->labels.labelled_count;
    if (ambient != NULL) {
        TEST_ASSERT_EQUAL_INT(0, *(const uint8_t *)ambient->samples);
        world.ambient_count++;
    }
    return IH_OK;
}

void isohead_find(struct isohead *head, int64_t time_us)
{
    (void)time_us;
    world.busy_on_count += world.line;
    world_pass(world.busy_us);
    head->result.entry_count = 0;
    head->result.head_count = world.head_count;
    head->result.selected = IH_NONE;
    head->align.now = world.alignment;
    for (int i = 0; i < 3; i++) {
        world.alignment.rotation_rad_q30[i] += world.drift_rad_q30[i];
    }
    if (head->labels.labelled_count > 0) {
        world.lit_count++;
    } else {
        world.dark_count++;
    }
}

void ih_exposure_params_default(struct ih_exposure_params *params)
{
    *params = (struct ih_exposure_params){.exposure_max_us = 20000, .duty_max_q8 = 256};
}

void ih_exposure_start(const struct ih_exposure_params *params, int32_t exposure_us,
                       int32_t duty_q8, struct ih_exposure *state)
{
    world.exposure_max_us = params->exposure_max_us;
    *state = (struct ih_exposure){.exposure_us = exposure_us, .duty_q8 = duty_q8};
}

void ih_exposure_look(const struct ih_dots *dots, const struct ih_labels *labels, int32_t width,
                      int32_t height, struct ih_exposure_look *out)
{
    (void)dots;
    (void)width;
    (void)height;
    out->labelled_count = labels->labelled_count;
}

/* Another one for every second frame. */
void ih_exposure_next(const struct ih_exposure_params *params, const struct ih_exposure_look *look,
                      struct ih_exposure *state)
{
    TEST_ASSERT_EQUAL_INT32(256, params->duty_min_q8);
    TEST_ASSERT_EQUAL_INT(world_head.labels.labelled_count, look->labelled_count);
    state->exposure_us += world.lit_count % 2 * 100;
}

const char *ih_err_text(enum ih_err err)
{
    return err == IH_ERR_SIZE ? "size" : "error";
}

const char *ih_reject_text(int32_t reject)
{
    (void)reject;
    return NULL;
}

/* May the laser be on now? Silence is measured as the policy promises it: while it is on. */
static void world_look(void)
{
    if (!world.line) {
        return;
    }
    TEST_ASSERT_TRUE_MESSAGE(world.config.laser, "on though it is not enabled");
    TEST_ASSERT_TRUE_MESSAGE(world.line_taken, "on though the line was given back");
}

/* What holds whenever the loop waits, and no later. */
static void world_look_waiting(void)
{
    world_look();
    if (!world.line) {
        return;
    }
    TEST_ASSERT_TRUE_MESSAGE(world.camera_open, "on without a camera");
    TEST_ASSERT_TRUE_MESSAGE(world.interlock_closed, "on with the interlock open");
    TEST_ASSERT_TRUE_MESSAGE(world.now_us - world.on_since_us <= 3 * WORLD_FRAME_US,
                             "on for more than 3 frame times without a frame that was judged");
}

/* True: this call is to fail. */
static bool world_call(enum world_function function)
{
    world_look();
    world.calls[function]++;
    bool fails = false;
    for (int i = 0; i < WORLD_FAULTS; i++) {
        struct world_fault *fault = &world.faults[i];
        int over = world.calls[function] - fault->call;
        bool hit = fault->call != 0 && function == fault->function &&
                   (over == 0 || (over > 0 && fault->stays));
        fault->done |= hit;
        fails |= hit;
    }
    return fails;
}

static bool world_camera_open(void *context, struct hal_error *error)
{
    (void)context;
    TEST_ASSERT_FALSE(world.camera_open);
    TEST_ASSERT_FALSE_MESSAGE(world.line, "on while the camera is opened");
    if (world_call(WORLD_CAMERA_OPEN) || world.now_us < world.unplugged_until_us) {
        return hal_fail(error, "no such device");
    }
    world.camera_open = true;
    world.queue_count = 0;
    world.sequence = 0;
    world.next_us = world.now_us + WORLD_FRAME_US;
    world.events &= ~(unsigned)HAL_EVENT_FRAME;
    return true;
}

static void world_camera_close(void *context)
{
    (void)context;
    TEST_ASSERT_FALSE_MESSAGE(world.line, "on while the camera is closed");
    for (int i = 0; i < WORLD_BUFFERS; i++) {
        TEST_ASSERT_FALSE_MESSAGE(world.held[i], "a frame is held beyond the camera's end");
    }
    world.camera_open = false;
    world.queue_count = 0;
    world.events &= ~(unsigned)HAL_EVENT_FRAME;
}

static enum hal_next world_camera_next(void *context, struct hal_frame *frame,
                                       struct hal_error *error)
{
    (void)context;
    TEST_ASSERT_TRUE(world.camera_open);
    if (world_call(WORLD_CAMERA_NEXT_GONE) || world.now_us < world.unplugged_until_us) {
        hal_fail(error, "no such device");
        return HAL_NEXT_GONE;
    }
    if (world_call(WORLD_CAMERA_NEXT_END)) {
        return HAL_NEXT_END;
    }
    if (world_call(WORLD_CAMERA_NEXT_NONE) || world.queue_count <= world.flight) {
        return HAL_NEXT_NONE;
    }
    *frame = world.queue[0];
    world.queue_count--;
    memmove(&world.queue[0], &world.queue[1], (size_t)world.queue_count * sizeof world.queue[0]);
    if (world_call(WORLD_CAMERA_NEXT_BAD)) {
        hal_fail(error, "short frame");
        frame->samples = NULL;
        return HAL_NEXT_BAD;
    }
    int held = 0;
    world.held[frame->buffer_index] = true;
    for (int i = 0; i < WORLD_BUFFERS; i++) {
        held += world.held[i];
    }
    TEST_ASSERT_LESS_OR_EQUAL_INT(HAL_CAMERA_HOLD_MAX + 1, held);
    return HAL_NEXT_FRAME;
}

static void world_camera_release(void *context, const struct hal_frame *frame)
{
    (void)context;
    TEST_ASSERT_TRUE_MESSAGE(world.held[frame->buffer_index], "released twice");
    world.held[frame->buffer_index] = false;
}

static bool world_camera_exposure(void *context, int32_t exposure_us, struct hal_error *error)
{
    (void)context;
    TEST_ASSERT_GREATER_THAN_INT32(0, exposure_us);
    return world_call(WORLD_CAMERA_EXPOSURE) ? hal_fail(error, "busy") : true;
}

static int32_t world_camera_frame_time(void *context)
{
    (void)context;
    return world.frame_time_us;
}

static bool world_strobe_open(void *context, struct hal_error *error)
{
    (void)context;
    if (world_call(WORLD_STROBE_OPEN)) {
        return hal_fail(error, "line 3: busy");
    }
    world.line_taken = true;
    world.line = false;
    return true;
}

/* The line falls with its pull-down. */
static void world_strobe_close(void *context)
{
    (void)context;
    world.line = false;
    world.line_taken = false;
}

static bool world_strobe_set(void *context, bool on, struct hal_error *error)
{
    (void)context;
    TEST_ASSERT_TRUE(world.line_taken);
    if (!on) {
        if (world_call(WORLD_STROBE_OFF)) {
            return hal_fail(error, "cannot be set"); /* and the line is as it was */
        }
        world.line = false;
        return true;
    }
    if (world_call(WORLD_STROBE_ON)) {
        return hal_fail(error, "cannot be set");
    }
    TEST_ASSERT_TRUE_MESSAGE(world.now_us - world.interlock_us >= APP_LASER_CLOSED_US,
                             "on while the interlock's contact may bounce");
    world.rise_count += !world.line;
    world.on_since_us = world.line ? world.on_since_us : world.now_us;
    world.line = true;
    return world_call(WORLD_STROBE_ON_HIGH) ? hal_fail(error, "no answer") : true;
}

static bool world_strobe_beat(void *context, struct hal_error *error)
{
    (void)context;
    world.beat_count++;
    return world_call(WORLD_STROBE_BEAT) ? hal_fail(error, "cannot be set") : true;
}

static bool world_strobe_interlock(void *context, bool *closed, struct hal_error *error)
{
    (void)context;
    if (world_call(WORLD_STROBE_INTERLOCK)) {
        return hal_fail(error, "cannot be read");
    }
    *closed = world.interlock_closed && !world.interlock_moved;
    world.interlock_moved = false;
    return true;
}

static bool world_strobe_judged(void *context, struct hal_error *error)
{
    (void)context;
    return world_call(WORLD_STROBE_JUDGED) ? hal_fail(error, "cannot be passed on") : true;
}

static bool world_strobe_prove(void *context, struct hal_error *unproven, struct hal_error *error)
{
    (void)context;
    TEST_ASSERT_TRUE(world.line_taken && !world.line);
    hal_fail(unproven, "interlock-line: closed since the start");
    return world_call(WORLD_STROBE_PROVE) ? hal_fail(error, "does not move") : true;
}

static void world_push(bool is_half)
{
    struct hal_frame *frame = &world.queue[world.queue_count];
    int buffer = 0;
    bool used = true;
    while (used) { /* a buffer that is neither held nor waiting */
        used = world.held[buffer];
        for (int i = 0; i < world.queue_count; i++) {
            used |= world.queue[i].buffer_index == buffer;
        }
        buffer += used;
    }
    TEST_ASSERT_LESS_THAN_INT(WORLD_BUFFERS, buffer);
    world.labels[buffer] =
        (uint8_t)(world.line && !world.is_empty ? WORLD_LIT_LABELS / (is_half ? 5 : 1) : 0);
    snprintf(world.names[buffer], sizeof world.names[buffer], "%06lld.pgm",
             (long long)world.sequence);
    *frame = (struct hal_frame){
        .samples = &world.labels[buffer],
        .width = 752,
        .height = 582,
        .stride_bytes = 752,
        .bytes_per_sample = 1,
        .maximum = 255,
        .time_us = world.now_us,
        .sequence = world.sequence,
        .laser = true,
        .name = world.names[buffer],
        .buffer_index = buffer,
    };
    world.queue_count++;
}

/* To closed or open, with an event in any case. */
static void world_move_interlock(bool closed)
{
    world.interlock_closed = closed;
    world.interlock_moved = true;
    world.interlock_us = world.now_us;
    world.events |= HAL_EVENT_INTERLOCK;
}

/* What happens at a frame's time. */
static void world_step(void)
{
    enum world_act act =
        world.act_index < world.act_count ? world.act[world.act_index] : WORLD_STOP;
    world.act_index++;
    world.next_us += WORLD_FRAME_US;
    switch (act) {
    case WORLD_STOP:
        world.events |= HAL_EVENT_STOP;
        return;
    case WORLD_UNPLUGGED:
        world.unplugged_until_us = world.now_us + WORLD_UNPLUGGED_US;
        world.events |= HAL_EVENT_FRAME;
        return;
    case WORLD_RELOAD:
        world.config.rig = world.next_rig != NULL ? world.next_rig : world.config.rig;
        world.events |= HAL_EVENT_RELOAD;
        break;
    case WORLD_RELOAD_ALONE: {
        const char *rig = world.config.rig;
        world.config.rig = world.next_rig != NULL ? world.next_rig : rig;
        world.next_rig = rig;
        world.events |= HAL_EVENT_RELOAD;
        return;
    }
    case WORLD_RECORD:
        world.events |= HAL_EVENT_RECORD;
        break;
    case WORLD_KNOCK:
        world.alignment.state = IH_ALIGN_MOVED;
        world.alignment.rotation_rad_q30[0] += WORLD_KNOCK_RAD_Q30;
        break;
    case WORLD_INTERLOCK_OPENS:
        world_move_interlock(false);
        break;
    case WORLD_INTERLOCK_BLINKS:
        world_move_interlock(world.interlock_closed);
        break;
    case WORLD_INTERLOCK_CLOSES:
        world_move_interlock(true);
        break;
    default:
        break;
    }
    if (!world.camera_open) {
        return;
    }
    if (act == WORLD_PAUSE) {
        return;
    }
    if (act != WORLD_LOST) {
        world_push(act == WORLD_HALF);
    }
    world.sequence++;
    if (act == WORLD_TWICE) {
        world_push(false);
        world.sequence++;
    }
    if (world.queue_count > world.flight) {
        world.events |= HAL_EVENT_FRAME;
    }
}

static bool world_wait(void *context, int64_t timeout_us, unsigned *events, struct hal_error *error)
{
    (void)context;
    TEST_ASSERT_GREATER_OR_EQUAL_INT64(0, timeout_us);
    TEST_ASSERT_LESS_THAN_INT_MESSAGE(100000, ++world.waits, "the loop does not end");
    if (world_call(WORLD_EVENTS_WAIT)) {
        return hal_fail(error, "bad descriptor");
    }
    int64_t until_us = world.now_us + timeout_us;
    if (world.events == 0 && world.next_us <= until_us) {
        world_pass(world.next_us > world.now_us ? world.next_us - world.now_us : 0);
        world_look_waiting();
        world_step();
    } else if (world.events == 0) {
        world_pass(timeout_us);
        world_look_waiting();
    }
    world_pass(WORLD_WAIT_US);
    *events = world.events;
    /* a signal that was seen is gone; frames stay until they are taken */
    world.events &= world.queue_count > world.flight ? (unsigned)HAL_EVENT_FRAME : 0;
    if (world_call(WORLD_EVENTS_NOTHING) && (*events & HAL_EVENT_STOP) == 0) {
        *events = 0;
    }
    return true;
}

static int64_t world_now(void *context)
{
    (void)context;
    return world.now_us;
}

static bool world_feed(void *context, struct hal_error *error)
{
    (void)context;
    return world_call(WORLD_WATCHDOG_FEED) ? hal_fail(error, "the guard is gone") : true;
}

static enum hal_sent world_send(void *context, const char *bytes, size_t count,
                                struct hal_error *error)
{
    (void)context;
    TEST_ASSERT_EQUAL_INT('\n', bytes[count - 1]);
    if (world_call(WORLD_OUTPUT_NOT)) {
        return HAL_SENT_NOT;
    }
    if (world_call(WORLD_OUTPUT_NEVER)) {
        hal_fail(error, "closed");
        return HAL_SENT_NEVER;
    }
    world.record_count++;
    world.last_record_us = world.now_us;
    size_t length = world.records_length;
    TEST_ASSERT_LESS_THAN_UINT(sizeof world.records, length + count + 1);
    memcpy(world.records + length, bytes, count);
    world.records[length + count] = '\0';
    world.records_length += count;
    world.error_count += strstr(world.records + length, "\"error\"") != NULL;
    return HAL_SENT;
}

/* Whoever keeps a frame looks at all of it, and at nothing afterwards. */
static bool world_keep(void *context, const struct hal_frame *frame, bool lit)
{
    (void)context;
    TEST_ASSERT_TRUE_MESSAGE(world.held[frame->buffer_index], "recorded after it was released");
    TEST_ASSERT_TRUE(lit || *(const uint8_t *)frame->samples == 0);
    if (world_call(WORLD_RECORDER_KEEP)) {
        return false;
    }
    world.kept_count += lit;
    world.kept_dark_count += !lit;
    return true;
}

static void world_record(void *context, bool on)
{
    (void)context;
    world.write_count += on;
    *(on ? &world.write_us : &world.end_us) = world.now_us;
    world.writes = on;
}

static void world_new_rig(void *context)
{
    (void)context;
    world.rig_count++;
}

static bool world_news(void *context, struct hal_error *error)
{
    (void)context;
    return world_call(WORLD_RECORDER_NEWS) ? !hal_fail(error, "the disk is full") : false;
}

static void world_write(void *context, int level, const char *text)
{
    (void)context;
    world.reported_fault |= strstr(text, "laser: cannot be set") != NULL;
    world.reported_output |= strstr(text, "output: closed") != NULL;
    world.unproven_count += strstr(text, "not proven at the start: interlock-line") != NULL;
    world.lost_count += strstr(text, "good: does not fit") != NULL;
    world.news_count += strstr(text, "record: the disk is full") != NULL;
    if (strncmp(text, "made up: ", 9) == 0) {
        snprintf(world.camera_text, sizeof world.camera_text, "%s", text);
    }
    if (strstr(text, "accelerometer") != NULL) {
        world.up_count++;
        snprintf(world.up, sizeof world.up, "%s", text);
    }
    if (strstr(text, "the rig has moved") != NULL) {
        world.moved_count++;
        snprintf(world.moved, sizeof world.moved, "%s", text);
    }
    if (strstr(text, "cannot be determined") != NULL) {
        snprintf(world.unknown, sizeof world.unknown, "%s", text);
    }
    if (!world_quiet) {
        printf("%lld <%d> %s\n", (long long)world.now_us, level, text);
    }
}

/* A world at its beginning; the caller changes what it wants before world_run. */
static void world_init(enum app_strobe strobe, const enum world_act *act, int act_count)
{
    memset(&world, 0, sizeof world);
    world.act = act;
    world.act_count = act_count;
    world.now_us = 1000000;
    world.next_us = world.now_us + WORLD_FRAME_US;
    world.interlock_closed = true;
    world.config.rig = "good";
    world.config.device = "made up";
    world.config.rate_mhz = 25000;
    world.config.laser = true;
    world.config.strobe = strobe;
    world.config.duty_percent = 100;
    world.config.laser_cap_ms = WORLD_CAP_MS;
    world.frame_time_us = WORLD_FRAME_US;
    world.config.exposure = APP_EXPOSURE_KEEP;
    app_log_init(&world.log, world_write, NULL, world.now_us);
    world.camera = (struct hal_camera){
        .open = world_camera_open,
        .close = world_camera_close,
        .next = world_camera_next,
        .release = world_camera_release,
        .set_exposure = world_camera_exposure,
        .frame_time_us = world_camera_frame_time,
    };
    world.strobe = (struct hal_strobe){
        .open = world_strobe_open,
        .close = world_strobe_close,
        .set = world_strobe_set,
        .beat = world_strobe_beat,
        .interlock = world_strobe_interlock,
        .judged = world_strobe_judged,
        .prove = world_strobe_prove,
    };
    world.event_table = (struct hal_events){.wait = world_wait};
    world.clock = (struct hal_clock){.now_us = world_now};
    world.watchdog = (struct hal_watchdog){.feed = world_feed};
    world.output = (struct hal_output){.send = world_send};
    world.recorder = (struct hal_recorder){
        .keep = world_keep,
        .write = world_record,
        .rig = world_new_rig,
        .news = world_news,
    };
    world.config.record_s = 2;
    world.state.config = &world.config;
    world.state.log = &world.log;
    world.state.head = &world_head;
    world.state.hal = (struct app_hal){
        .camera = &world.camera,
        .strobe = &world.strobe,
        .events = &world.event_table,
        .clock = &world.clock,
        .watchdog = &world.watchdog,
        .output = &world.output,
        .recorder = &world.recorder,
    };
}

/* Until it ends; then the line is low and nothing is held. */
static enum app_exit world_run(void)
{
    enum app_exit exit = app_loop_run(&world.state);
    TEST_ASSERT_FALSE_MESSAGE(world.line, "the laser is on at the end");
    TEST_ASSERT_FALSE_MESSAGE(world.line_taken, "the line is still taken at the end");
    TEST_ASSERT_FALSE_MESSAGE(world.camera_open, "the camera is open at the end");
    return exit;
}

#endif
