/* ih_near_depth - how near the nearest of the scene is: a percentile of the points' depths (ours).
 *
 * In:     points by slot.
 * Out:    the 8th percentile of the seen depths: the sorted depths' entry number count * 8 / 100.
 * Cost:   a depth is counted once, the few near the percentile again.
 */
#ifndef IH_NEAR_DEPTH_H
#define IH_NEAR_DEPTH_H

#include <stdint.h>

#include "base/ih_config.h"
#include "points/ih_points.h"

IH_BEGIN_DECLS

/* 0 when nothing was seen. */
int32_t ih_near_depth_mm_q8(const struct ih_points *points);

IH_END_DECLS

#endif
