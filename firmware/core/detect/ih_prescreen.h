/* ih_prescreen - coarse pre-filter: is a centre worth a fit? (ours)
 *
 * In:     the table of rays, the candidate centre of a mean head.
 * Out:    how much the surroundings are a head's: 2 high + 3 body - 4 level, Q8; -4 .. 5.
 * Method: three fractions, with the most information before a fit. Of the rays whose state is known, by where they
 *         pass the centre's depth (ih_head_model.h):
 *             high   open, farther above than 1.9 semi-axes, as (open + 0.5) / (all + 1)
 *             body   a body, 40 to 260 mm below the chin and at most 180 mm aside
 *             level  something within 150 mm of the centre's depth, 170 to 330 mm aside
 *         Without any ray the sum is 1. Less than that is evidence against a head: a wall or a shelf.
 * Overflow: 16 bits, saturated.
 * Error:  a ray near a limit may be counted either way, by 2^-12 of the depth and half a millimetre.
 * Cost:   8 comparisons of 16 bits thrice for each of 361 rays (without vectors most need one or two): a
 *         fortieth of a step and its evidence. Of 12,000 centres in 970 frames it rejects half, of those
 *         that would end above log-odds -3 about one in five hundred.
 */
#ifndef IH_PRESCREEN_H
#define IH_PRESCREEN_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_rays.h"

IH_BEGIN_DECLS

int32_t ih_prescreen_score_q8(const struct ih_rays *rays, const int32_t centre_mm_q8[3]);

IH_END_DECLS

#endif
