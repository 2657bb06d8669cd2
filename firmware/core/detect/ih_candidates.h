/* ih_candidates - distances among the candidates of ih_detections: of starts and detections (ours).
 *
 * In:     centres in the level frame.
 * Out:    starts that are new, whether a head is found already, detections in their order, and which of them is the body
 *         to another one's head.
 * Overflow: centres are below 2^27 in Q8, their differences below 2^28.
 */
#ifndef IH_CANDIDATES_H
#define IH_CANDIDATES_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_detections.h"

IH_BEGIN_DECLS

/* Remember a start and give true, if none before it is as near as apart_mm. */
bool ih_candidates_add_start(struct ih_detections_starts *starts, const int32_t centre_mm_q8[3],
                             int32_t apart_mm);

/* Is a detection of these log-odds nearer than this? */
bool ih_candidates_is_found(const struct ih_detections *detections, const int32_t centre_mm_q8[3],
                            int32_t near_mm, int32_t logit_min_q10);

/* Insert, the more probable first; one nearer than spacing_mm to a more probable one is the same thing. */
void ih_candidates_insert(struct ih_detections *out, const struct ih_detection *detection,
                          int32_t spacing_mm);

/* Chest and belly are round, too, and nearer than the head. Bit i: the middle of detection i is within 150 mm aside of
 * another one's above logit_min, 200 to 400 mm below it, and from 350 mm before to 150 mm behind it. */
uint32_t ih_candidates_bodies(const struct ih_detections *detections, int32_t logit_min_q10);

IH_END_DECLS

#endif
