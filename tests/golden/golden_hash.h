/* golden_hash - one number for what a stage put out.
 *
 * FNV-1a, 64 bits, over the output's members in the order of their declaration, each as its value,
 * least significant byte first: neither padding nor the processor's byte order matter. Of a table
 * only the entries that its count says are there, of a slot without a dot only that it has none.
 */
#ifndef GOLDEN_HASH_H
#define GOLDEN_HASH_H

#include "isohead.h"

struct golden_stage {
    const char *name;
    uint64_t (*hash)(const struct isohead *head);
};

#define GOLDEN_STAGES 12

/* In the order of a frame's way. */
extern const struct golden_stage golden_stage[GOLDEN_STAGES];

/* The rig as isohead_init derived it. */
uint64_t golden_hash_rig(const struct isohead *head);

#endif
