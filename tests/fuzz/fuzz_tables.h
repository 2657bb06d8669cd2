/* fuzz_tables - tables of stages made up from an input, each within what its header says. */
#ifndef FUZZ_TABLES_H
#define FUZZ_TABLES_H

#include "fuzz_rig.h"

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
