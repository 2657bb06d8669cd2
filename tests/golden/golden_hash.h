/* golden_hash - one number for what a stage put out.
 *
 * FNV-1a, 64 bits, over the output's members in the order of their declaration: each number as its value,
 * least significant byte first, so that neither padding nor the processor's byte order matter. Of a table
 * only the entries that its count says are there, of a slot without a dot only that it has none.
 */
#ifndef GOLDEN_HASH_H
#define GOLDEN_HASH_H

#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "isohead.h"
#include "upkeep/ih_exposure.h"

#define GOLDEN_FNV_START 0xcbf29ce484222325u
#define GOLDEN_FNV_PRIME 0x100000001b3u

static inline uint64_t golden_add(uint64_t hash, int64_t value, int bytes)
{
    for (int i = 0; i < bytes; i++) {
        hash = (hash ^ (((uint64_t)value >> (8 * i)) & 0xff)) * GOLDEN_FNV_PRIME;
    }
    return hash;
}

static inline uint64_t golden_add_word(uint64_t hash, int32_t value)
{
    return golden_add(hash, value, 4);
}

/* An array of 32-bit integers, or a struct that has no other members. */
static inline uint64_t golden_add_words(uint64_t hash, const void *first, size_t size)
{
    for (size_t at = 0; at < size; at += sizeof(int32_t)) {
        int32_t value = 0;
        memcpy(&value, (const char *)first + at, sizeof value);
        hash = golden_add_word(hash, value);
    }
    return hash;
}

struct golden_stage {
    const char *name;
    uint64_t (*hash)(const struct isohead *head);
};

#define GOLDEN_STAGES 14

/* In the order of processing. */
extern const struct golden_stage golden_stage[GOLDEN_STAGES];

/* The rig as isohead_init derived it. */
uint64_t golden_hash_rig(const struct isohead *head);

/* golden_inner.c: hashes of intermediate results that isohead_frame does not keep.
 *
 * In:    the state after a frame, and the frame.
 * Out:   one number each for the map of noise and the next exposure (dots only), the contours of all
 *        levels, the ellipses of all closed contours, the rays, the candidates of the scan, the ellipsoids
 *        fitted there and at the nests, what speaks for them, their scores, and the surface and the
 *        answer of the paper's method alone.
 * Method: each stage is run once more on the outputs that the state keeps, in the state's own working
 *        memory. Of a depth image these are those of its best window. The paper's method has other
 *        parameters from the surface on: its stages are run last, in place of the outputs. */
enum golden_inner {
    GOLDEN_NOISE, /* of dots only, as the next */
    GOLDEN_EXPOSURE,
    GOLDEN_CONTOURS,
    GOLDEN_ELLIPSES,
    GOLDEN_RAYS,
    GOLDEN_SCAN,
    GOLDEN_FIT,
    GOLDEN_EVIDENCE,
    GOLDEN_SCORE,
    GOLDEN_PAPER,
    GOLDEN_INNERS
};

extern const char *const golden_inner_name[GOLDEN_INNERS];

/* exposure: goes on from frame to frame; golden_inner_start before a rig's first. Of head the
 * scratch is written to, and last the surface, the hypotheses and the heads. */
void golden_inner_start(struct ih_exposure *exposure);
void golden_inner_hash(struct isohead *head, const struct ih_frame *frame,
                       const struct ih_frame *ambient, struct ih_exposure *exposure,
                       uint64_t hash[GOLDEN_INNERS]);

#endif
