/* ih_prescreen - is a place worth a fit? (ours)
 *
 * In:    rays rounded down (ih_fit_equations_prepare), the place of a mean head's centre.
 * Out:   how much the surroundings are a head's: 2 high + 3 body - 4 level, Q8; -4 .. 5.
 * Way:   three of the shares that ih_evidence counts, as they tell the most before anything is fitted, with
 *        about the weights that ih_score's curves have. Of the rays that say something, by where they pass
 *        the centre's depth:
 *            high   open, farther above than 1.9 semi-axes, as (open + 0.5) / (all + 1)
 *            body   a body, 40 to 260 mm below the chin and at most 180 mm aside
 *            level  something within 150 mm of the centre's depth, 170 to 330 mm aside
 *        Without any ray the sum is 1. Less than that speaks against a head: with a wall or a shelf around.
 * Overflow: 16 bits, saturated.
 * Error: a ray near a limit may be counted either way, by 2^-12 of the depth and half a millimetre.
 * Cost:  8 comparisons of 16 bits thrice for each of 361 rays (without vectors most need one or two): a
 *        fiftieth of a step and its evidence. Of 12,000 places in 970 frames it passes over half, of those
 *        that would end above log-odds -3 about one in five hundred.
 */
#ifndef IH_PRESCREEN_H
#define IH_PRESCREEN_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_fit_equations.h"

IH_BEGIN_DECLS

int32_t ih_prescreen_score_q8(const struct ih_fit_equations_rays *rays,
                              const int32_t origin_mm_q8[3], const int32_t centre_mm_q8[3]);

IH_END_DECLS

#endif
