/* fuzz_rig - rigs that pass ih_rig_init, made once per process, and tables of stages made up from an input, each within
 * what its header says.
 *
 * Dot rigs see 320 x 240 px, the smallest frame that the core takes, so that executions are many:
 *   0  like the paper's: 12.5 mm baseline to the left, a lens without distortion
 *   1  125 mm baseline, a barrel lens, a turned pattern
 *   2  projector above the camera, a pattern that overfills the picture, far away allowed
 *   3  projector before the camera and tilted: epipolar lines fan out
 * Range rigs see 64 x 64 px, the smallest too, and a wide flat one 128 x 72.
 */
#ifndef FUZZ_RIG_H
#define FUZZ_RIG_H

#include "fuzz.h"
#include "isohead.h"

#define FUZZ_RIGS_DOTS 4
#define FUZZ_RIGS_RANGE 2
/* Pixels of the largest of them. */
#define FUZZ_RIG_PIXELS_MAX (320 * 240)

/* A core after isohead_init with the rig; not to be changed. */
const struct isohead *fuzz_rig_dots_core(int index);
const struct isohead *fuzz_rig_range_core(int index);

const struct ih_rig *fuzz_rig_dots(int index);
const struct ih_rig *fuzz_rig_range(int index);

/* A rig of either kind. */
const struct ih_rig *fuzz_tables_rig(struct fuzz_input *input);

/* The part of the image plane of a surface, units up to a pitch of a third of a radian. */
void fuzz_tables_field(struct fuzz_input *input, struct ih_field *out);

/* Up to IH_SLOTS samples, in order of their slots: places of a lattice moved by noise, depths of a
 * scene, and some as the input says. */
void fuzz_tables_samples(struct fuzz_input *input, struct ih_samples *out);

/* A head of any place, its axes as a fit leaves them. */
void fuzz_tables_head(struct fuzz_input *input, struct ih_ellipsoid *out);

#endif
