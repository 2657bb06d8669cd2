/* app_board - the settings made into a Linux board: the only file of the program that knows hal/linux.
 *
 * What is opened stands in one struct of the caller's and is closed before app_board_run returns,
 * the laser first. The strobe is opened before the camera: the guard process that it starts then
 * has nothing of the camera's. The live view's process is started before both, and before signals have
 * handlers: it has nothing of either.
 */
#ifndef APP_BOARD_H
#define APP_BOARD_H

#include "app_config.h"
#include "app_log.h"
#include "app_loop.h"
#include "linux/hal_clock.h"
#include "linux/hal_directory.h"
#include "linux/hal_events.h"
#include "linux/hal_gpio.h"
#include "linux/hal_guard.h"
#include "linux/hal_iio.h"
#include "linux/hal_log.h"
#include "linux/hal_output.h"
#include "linux/hal_recorder.h"
#include "linux/hal_signals.h"
#include "linux/hal_v4l2.h"
#include "linux/hal_viewer.h"
#include "linux/hal_watchdog.h"

/* How long --laser-off tries to take a line that others of ours still hold, ... */
#define APP_BOARD_OFF_TRIES 100
#define APP_BOARD_OFF_PAUSE_MS 20
/* ... and when it begins to end them: a dying program's guards need no more. */
#define APP_BOARD_OFF_PATIENCE 5

/* All settings as JSON: their values, and twice as much for names. */
#define APP_BOARD_SETTINGS_MAX (3 * APP_CONFIG_TEXT_MAX)

/* The largest first, so that little is lost between them. */
struct app_board {
    struct isohead head;
    struct hal_log_writer writer;
    struct hal_event_source events;
    struct hal_watchdog_feeder watchdog;
    struct hal_guard guard;
    struct hal_viewer_process viewer;
    struct hal_recorder_process recorder;
    struct hal_gpio gpio;
    struct hal_v4l2 v4l2;
    struct hal_directory directory; /* in place of v4l2, where the device is one */
    struct app_log log;
    struct app_state state;
    struct hal_output_state output;
    struct hal_signals signals;
    /* Which way is up, by an accelerometer: measured_up_q30 of the state, and as a recording has it; "": not known. */
    int32_t up_q30[3];
    char up_text[64];
    char settings[APP_BOARD_SETTINGS_MAX]; /* as a recording has them */
};

/* Frames in, records out, until requested to end. */
enum app_exit app_board_run(struct app_board *board, const struct app_config *config);

/* Only make the laser's line low and give it back. Whoever of ours holds the line is ended for it, the
 * program that uses it and guards that stand still; others are not, which is APP_EXIT_NO_LINE, as is a line that is
 * not there. Without chip and line that is wrong usage; but good where a configuration file was read that has none and
 * no laser. */
enum app_exit app_board_laser_off(struct app_board *board, const struct app_config *config);

#endif
