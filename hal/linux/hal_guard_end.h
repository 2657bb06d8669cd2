/* hal_guard_end - end who still holds a laser's line: programs and guards of ours, stopped ones too.
 *
 * Ours is who maps the page that is named after the line (hal_guard_page.h) and nobody else: not who
 * has taken the line by other means, nor a program of ours that has another line. What belongs to
 * another user cannot be looked into, and is left alone.
 */
#ifndef HAL_GUARD_END_H
#define HAL_GUARD_END_H

#include "hal.h"

/* SIGKILL for all but this process. How many; -1: *error, /proc or a process number's descriptor is
 * not to be had. */
int hal_guard_end(const char *line_name, struct hal_error *error);

#endif
