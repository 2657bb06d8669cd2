/* golden - the core over a fixed set of frames, a hash of every stage's output after every frame.
 *
 * In:    a file that golden_pack wrote (below): rigs and recorded frames; for each of them
 *        the made-up frames of golden_scene follow, and a depth camera with its own at the end.
 * Out:   text, one line per frame and stage: "SET FRAME STAGE HASH". Every processor and compiler
 *        must write the same bytes.
 * Needs: no C library but memcpy and its kin, so that it runs where nothing else does. What it is
 *        built into gives it the two functions at the end.
  *
 * The file: words of 32 bits, least significant byte first: GOLDEN_MAGIC, then records, each beginning
 * with its kind.
 *   GOLDEN_RIG    the words of a calibration; frames after it are of this rig
 *   GOLDEN_FRAME  width, height, bytes per sample, maximum, then the samples row by row, those of
 *                 two bytes with the lesser first
 *   GOLDEN_END    nothing follows
 */
#ifndef GOLDEN_H
#define GOLDEN_H

#include <stdbool.h>
#include <stddef.h>

#include "base/ih_config.h"
#include "rig/ih_rig.h"

#define GOLDEN_MAGIC 0x31474849u /* "IHG1" */

enum golden_record { GOLDEN_END = 0, GOLDEN_RIG = 1, GOLDEN_FRAME = 2 };

/* Words of a calibration after its kind: all its other members. */
#define GOLDEN_RIG_WORDS (19 + 3 * IH_SLOTS)
_Static_assert(sizeof(struct ih_calibration) - offsetof(struct ih_calibration, width) ==
                   GOLDEN_RIG_WORDS * sizeof(int32_t),
               "a calibration has other members than were counted here");

/* Where they stand. */
static inline void *golden_rig_words(struct ih_calibration *calibration)
{
    return (char *)calibration + offsetof(struct ih_calibration, width);
}

/* True: all frames were hashed. False: a line "golden: ..." has said why not. */
bool golden_run(void);

/* The next size bytes of the file; false when there are fewer. */
bool golden_read(void *data, size_t size);

/* Append to the output; false when it cannot be written. */
bool golden_write(const char *text, size_t size);

#endif
