/* rd_view - from where a depth image is looked at.
 * Seed 0 stands where the depth camera stood. Every other seed draws a position for each frame, so that the same room
 * is seen in many ways: before a thing (a point of the surface, near ones more often), 0.5 to 1.4 m away and no more
 * than 0.6 m beside the depth camera's axis, turned by up to 25 degrees sideways, 15 up or down, 5 about the axis;
 * or before one of the heads, 0.6 to 1.4 m away, turned by up to 15, 10 and 4 degrees from the depth camera's
 * direction, so that the side that was measured is the one that is seen. A position is taken if nothing is nearer than
 * 350 mm, if at least 120 dots show on surfaces within 2.5 m, and at least 8 of them on the head. After 60 draws in
 * vain it is the depth camera's own.
 */
#ifndef RD_VIEW_H
#define RD_VIEW_H

#include <stdint.h>

#include "rd_range.h"
#include "rd_rig.h"

/* The camera's pose in the depth camera's frame. */
struct rd_pose rd_view_draw(const struct rd_relief *relief, const struct rd_range_frame *frame,
                            const struct rd_rig *rig, uint64_t seed, uint64_t frame_index);

#endif
