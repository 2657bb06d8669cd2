/* golden_hash - one number for what a stage put out.
 *
 * Over the output's members in the order of their declaration (golden_fnv.h). Of a table only the
 * entries that its count says are there, of a slot without a dot only that it has none.
 */
#ifndef GOLDEN_HASH_H
#define GOLDEN_HASH_H

#include "isohead.h"

struct golden_stage {
    const char *name;
    uint64_t (*hash)(const struct isohead *head);
};

#define GOLDEN_STAGES 14

/* In the order of processing. */
extern const struct golden_stage golden_stage[GOLDEN_STAGES];

/* The rig as isohead_init derived it. */
uint64_t golden_hash_rig(const struct isohead *head);

#endif
