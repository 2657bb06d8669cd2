/* ih_windows_survey - the depth image in square cells, the first step of ih_windows.
 *
 * Private to points and its tests.
 */
#ifndef IH_WINDOWS_SURVEY_H
#define IH_WINDOWS_SURVEY_H

#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "points/ih_windows.h"
#include "rig/ih_rig.h"

IH_BEGIN_DECLS

/* Fill the cells. Returns the spacing of measured pixels, as in struct ih_window. */
int32_t ih_windows_survey(const struct ih_frame *frame, const struct ih_rig *rig,
                          struct ih_windows_scratch *s);

/* The direction, in the level frame, of a place in the picture that is cut. */
void ih_windows_direction(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                          int32_t u_px_q12, int32_t v_px_q12, int32_t *x_q28, int32_t *y_q28);

/* Percentage of the cells with a depth, without the first column, whose left neighbour has one too;
 * 100 where there are none. */
int32_t ih_windows_connected_percent(const struct ih_windows_scratch *s);

/* The measured pixel (its depth in the working range) nearest to (*u_px, *v_px), at most reach_px
 * away in u and in v; of equals the first in reading order. Its depth in mm, and its place in *u_px
 * and *v_px; 0 when there is none. (*u_px, *v_px) lies in the frame. */
int32_t ih_windows_pixel(const struct ih_frame *frame, const struct ih_rig *rig, int32_t reach_px,
                         int32_t *u_px, int32_t *v_px);

IH_END_DECLS

#endif
