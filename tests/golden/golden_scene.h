/* golden_scene - frames made up in integers, the same on every processor.
 *
 * For a rig of dots: nothing but black, white or noise; one dot; 361 dots in a lattice that is none of
 * the pattern's; dots on the border and beyond it; the pattern on a wall and on a bump before it;
 * the latter in noise, with the noise alone as ambient frame. For a depth camera: nothing, full scale,
 * noise, a wall, one pixel, the frame's border alone, a head above shoulders of which one pixel in 49
 * was measured, and the same that moves, all of it measured.
 */
#ifndef GOLDEN_SCENE_H
#define GOLDEN_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_types.h"
#include "rig/ih_rig.h"

/* Bytes of the largest frame that can be made or read, and of the largest ambient one. */
#define GOLDEN_FRAME_BYTES (2 * 752 * 582)
#define GOLDEN_AMBIENT_BYTES (752 * 582)

#define GOLDEN_DOT_SCENES 10
#define GOLDEN_RANGE_SCENES 10

/* Make a scene of a rig; samples has room for GOLDEN_FRAME_BYTES. Returns its name. Where there
 * is an ambient frame it is put to ambient_samples and *has_ambient is true. */
const char *golden_scene_dots(int index, const struct ih_rig *rig, uint16_t *samples,
                              uint16_t *ambient_samples, struct ih_frame *frame, bool *has_ambient);

/* The depth camera, and its scenes. */
void golden_scene_range_rig(struct ih_calibration *calibration);
const char *golden_scene_range(int index, const struct ih_calibration *calibration,
                               uint16_t *samples, struct ih_frame *frame);

#endif
