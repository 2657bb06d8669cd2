/* hal - what a program needs from the machine it runs on, as small tables of functions.
 *
 * A back end (hal/replay, hal/linux, ...) fills such a table and keeps its state behind `context`;
 * the program calls through the table and never sees the back end's own types. Nothing here knows
 * the firmware: a frame is handed on as a view of samples, an error as one line of English.
 *
 * Error texts name an offset, line or field, what was found and what was expected. They do not
 * name the frame or device: that is hal_frame.name, or known to the caller, who prints it in front.
 *
 * No function waits, but hal_events.wait, for at most the time it is given; opening may take as
 * long as the system does. None switches anything on by itself.
 */
#ifndef HAL_H
#define HAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Longest error text, its closing zero included; longer ones are cut. */
#define HAL_ERROR_MAX 256

struct hal_error {
    char text[HAL_ERROR_MAX];
};

/* More to the end of a text, after "; " where there is some. */
void hal_add(struct hal_error *error, const char *text);

/* Set the text; always false, so that a failing function can return it. */
bool hal_fail(struct hal_error *error, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* One frame: an image, or a list of points; then samples is NULL and what describes them 0.
 * Samples, points and name belong to the camera and live until the frame is released. */
struct hal_frame {
    const void *samples;
    int32_t width, height;           /* px */
    int32_t stride_bytes;            /* from one row to the next */
    int32_t bytes_per_sample;        /* 1: uint8_t; 2: uint16_t in the processor's own byte order */
    int32_t maximum;                 /* the sample value of full scale */
    const int32_t (*point_mm_q8)[3]; /* x, y, z in the camera frame */
    int32_t point_count;
    int64_t time_us;
    int64_t sequence; /* rises by 1 from frame to frame; by more where frames were lost */
    bool laser;       /* the dots were on, as far as the camera knows; a live one says true */
    const char *name;
    int32_t buffer_index; /* the camera's own */
};

enum hal_next {
    HAL_NEXT_END = 0,   /* no more frames */
    HAL_NEXT_FRAME = 1, /* *frame is filled and to be released */
    HAL_NEXT_BAD = 2,  /* this frame is lost: only name, time_us, sequence and laser are filled, and
                         * *error says why. The next call goes on with the frame after it. */
    HAL_NEXT_NONE = 3, /* live cameras: no frame is ready */
    HAL_NEXT_GONE = 4, /* live cameras: the device is gone or broken, *error says why. Release what
                         * is held, close, and open again later. */
};

/* Frames that may be held, not released, while the next one is taken. */
#define HAL_CAMERA_HOLD_MAX 2

struct hal_camera {
    void *context;
    /* A live camera: open the device and let it stream. False: *error, and it is closed. */
    bool (*open)(void *context, struct hal_error *error);
    /* Nothing that was handed on may be looked at any more. Closed already: nothing happens. */
    void (*close)(void *context);
    enum hal_next (*next)(void *context, struct hal_frame *frame, struct hal_error *error);
    void (*release)(void *context, const struct hal_frame *frame);
    /* From a later frame on. False: the camera cannot, or refused. */
    bool (*set_exposure)(void *context, int32_t exposure_us, struct hal_error *error);
    /* What the camera says of itself once it is open: 0 when it does not. */
    int32_t (*frame_time_us)(void *context);
    bool
        waits; /* no live camera: a frame waits until it is taken, so that none is late or to be skipped */
};

/* The laser's line, and what speaks against switching it on. */
struct hal_strobe {
    void *context;
    /* Take the lines; the laser's is low, that is off, afterwards. Taken already: take them anew.
     * False: *error, and none is taken. */
    bool (*open)(void *context, struct hal_error *error);
    /* Off, then give the lines back. Never fails visibly; closed already: nothing happens. */
    void (*close)(void *context);
    /* Safe in a signal handler when on is false. */
    bool (*set)(void *context, bool on, struct hal_error *error);
    /* Toggle the line that feeds an external one-shot; without such a line nothing happens. */
    bool (*beat)(void *context, struct hal_error *error);
    /* Is the interlock closed, so that the laser may be on? True where none is configured. False
     * too when somebody else has switched off: then the laser is not on any more. */
    bool (*interlock)(void *context, bool *closed, struct hal_error *error);
    /* A frame was taken and judged: whoever limits the time without one starts anew. */
    bool (*judged)(void *context, struct hal_error *error);
    /* What the laser's line reads, whatever it was set to. False: *error, it cannot be read. */
    bool (*level)(void *context, bool *on, struct hal_error *error);
    /* Right after opening, with the laser off: try what can be tried of the lines. *unproven: what
     * could not be shown to work, ""  where all could. False: *error, something does not work. */
    bool (*prove)(void *context, struct hal_error *unproven, struct hal_error *error);
};

/* What can be waited for; a set. */
enum hal_event {
    HAL_EVENT_FRAME = 1,     /* camera.next has something to say */
    HAL_EVENT_INTERLOCK = 2, /* the interlock opened or closed, perhaps several times */
    HAL_EVENT_STOP = 4,      /* end the program */
    HAL_EVENT_RELOAD = 8,    /* read the rig again */
    HAL_EVENT_RECORD = 16,   /* write what the recorder has */
};

struct hal_events {
    void *context;
    /* Until something happens or the time is over; then *events is 0. timeout_us >= 0. */
    bool (*wait)(void *context, int64_t timeout_us, unsigned *events, struct hal_error *error);
};

struct hal_clock {
    void *context;
    int64_t (*now_us)(void *context); /* never runs backwards; the clock of live frames */
};

/* Acts when it has heard for a while no sign that the program is alive. */
struct hal_watchdog {
    void *context;
    bool (*feed)(void *context, struct hal_error *error);
};

enum hal_sent {
    HAL_SENT = 1,
    HAL_SENT_NOT = 0,   /* the receiver is slow or not there: the bytes are dropped, all of them */
    HAL_SENT_NEVER = -1 /* it will not work again; *error */
};

/* Where records go; never waits. */
struct hal_output {
    void *context;
    enum hal_sent (*send)(void *context, const char *bytes, size_t count, struct hal_error *error);
};

enum hal_look {
    HAL_LOOK_NONE = 0,   /* nobody waits for a frame */
    HAL_LOOK_WANTED = 1, /* *room is to be filled, then show() called */
    HAL_LOOK_GONE = -1   /* reported once: nobody ever will; *error */
};

/* Whoever wants to see what is going on; never waits. */
struct hal_viewer {
    void *context;
    enum hal_look (*ask)(void *context, void **room, struct hal_error *error);
    void (*show)(void *context);
};

/* Keeps frames in memory, and writes them where that is wanted; never waits. */
struct hal_recorder {
    void *context;
    /* Into the memory: a frame that is used, lit or not. The oldest give way while nothing is written. False: there is no room,
     * and it is lost. */
    bool (*keep)(void *context, const struct hal_frame *frame, bool lit);
    /* true: what is in the memory is written, and what comes, as one recording; false: only what is there already. */
    void (*write)(void *context, bool on);
    /* The rig was read anew: what is kept is forgotten, and another recording begins. */
    void (*rig)(void *context);
    /* True: *error is something to report. */
    bool (*news)(void *context, struct hal_error *error);
};

/* Takes what went wrong beside the frames themselves. subject: a file or device. */
struct hal_log {
    void *context;
    void (*error)(void *context, const char *subject, const char *text);
};

#endif
