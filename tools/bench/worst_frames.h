/* worst_frames - frames that are meant to cost much, the same on every machine.
 *
 * In:    a rig, a number.
 * Out:   an 8-bit frame: dots that a surface of many bumps sends back, all or some, with texture; dots
 *        at several depths of every line, or in rows along the lines; lattices and crowds of dots of all
 *        sizes and strengths, most of them near the threshold; noise, stripes and checks of all sizes.
 *        A hundred numbers on end are of one kind. Those of bumps are a sequence that changes little from
 *        frame to frame, so that tracks live; of all others each frame is drawn anew.
 * Integers only.
 */
#ifndef WORST_FRAMES_H
#define WORST_FRAMES_H

#include <stdint.h>

#include "rig/ih_rig.h"

#define WORST_SEQUENCE 100

/* The name of the frame's kind. */
const char *worst_frame_kind(int32_t number);

void worst_frame_draw(const struct ih_rig *rig, int32_t number, uint8_t *samples);

#endif
