/* hal_events - struct hal_events by ppoll over the camera, the interlock and the signals.
 *
 * The descriptors are looked up at every wait, since they change when something is opened anew; -1
 * is not waited for.
 * Camera:    readable, or in an error state of any kind: HAL_EVENT_FRAME. A driver says POLLERR for as
 *            long as the camera is unplugged or does not stream, and the wait then returns at once,
 *            every time: next() has to say HAL_NEXT_GONE and the program to close the camera, which
 *            makes the descriptor -1. A next() that said NONE there would make the program spin.
 * Interlock: readable or in an error state: HAL_EVENT_INTERLOCK, until interlock() was asked. It fails
 *            on a line in an error state; the program closes the strobe, and the descriptor is -1.
 * Signals:   read here: SIGTERM and SIGINT are HAL_EVENT_STOP, SIGHUP is HAL_EVENT_RELOAD, SIGUSR1 HAL_EVENT_RECORD, once for
 *            any number of them. Where the terminal is gone, and with it whoever looked, SIGHUP is
 *            HAL_EVENT_STOP.
 * Error:     what the system says of waiting or of the signals' descriptor. Not to be gone on with.
 */
#ifndef HAL_EVENTS_H
#define HAL_EVENTS_H

#include "hal.h"

/* What the pointers point at lives as long as the events. */
struct hal_events_config {
    const int *camera_fd;
    const int *interlock_fd;
    const int *signal_fd;
    int terminal_fd; /* the terminal of the start, for input or messages; -1: there was none */
};

struct hal_event_source {
    struct hal_events events;
    struct hal_events_config config; /* private */
};

void hal_events_init(struct hal_event_source *source, const struct hal_events_config *config);

#endif
