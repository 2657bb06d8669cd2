/* golden_file - the file that golden_pack writes and golden reads.
 *
 * Words of 32 bits, least significant byte first: GOLDEN_MAGIC, then records, each beginning with its
 * kind.
 *   GOLDEN_RIG    the words of a calibration; frames after it are of this rig
 *   GOLDEN_FRAME  width, height, bytes per sample, maximum, then the samples row by row, those of
 *                 two bytes with the lesser first
 *   GOLDEN_END    nothing follows
 */
#ifndef GOLDEN_FILE_H
#define GOLDEN_FILE_H

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

#endif
