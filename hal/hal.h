/* hal - what a program needs from the machine it runs on, as small tables of functions.
 *
 * A back end (hal/replay, hal/linux, ...) fills such a table and keeps its state behind `context`;
 * the program calls through the table and never sees the back end's own types. Nothing here knows
 * the firmware: a frame is handed on as a view of samples, an error as one line of English.
 *
 * Error texts name an offset, line or field, what was found and what was expected. They do not
 * name the frame: that is hal_frame.name, and the caller prints it in front.
 */
#ifndef HAL_H
#define HAL_H

#include <stdbool.h>
#include <stdint.h>

/* Longest error text, its closing zero included; longer ones are cut. */
#define HAL_ERROR_MAX 256

struct hal_error {
    char text[HAL_ERROR_MAX];
};

/* Set the text; always false, so that a failing function can return it. */
bool hal_fail(struct hal_error *error, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* One frame: an image, or a list of points; then samples is NULL and what describes them 0.
 * Samples, points and name belong to the camera and live until its next call. */
struct hal_frame {
    const void *samples;
    int32_t width, height;           /* px */
    int32_t stride_bytes;            /* from one row to the next */
    int32_t bytes_per_sample;        /* 1: uint8_t; 2: uint16_t in the processor's own byte order */
    int32_t maximum;                 /* the sample value of full scale */
    const int32_t (*point_mm_q8)[3]; /* x, y, z in the camera frame */
    int32_t point_count;
    int64_t time_us;
    bool laser; /* the dots were on */
    const char *name;
};

enum hal_next {
    HAL_NEXT_END = 0,   /* no more frames */
    HAL_NEXT_FRAME = 1, /* *frame is filled */
    HAL_NEXT_BAD = 2    /* this frame is lost: only name, time_us and laser are filled, and *error
                         * says why. The next call goes on with the frame after it. */
};

struct hal_camera {
    void *context;
    enum hal_next (*next)(void *context, struct hal_frame *frame, struct hal_error *error);
};

/* Takes what went wrong beside the frames themselves. subject: a file or device. */
struct hal_log {
    void *context;
    void (*error)(void *context, const char *subject, const char *text);
};

#endif
