/* ih_dot_centre - sub-pixel centre of a dot; private to ih_dots.
 *
 * In:     rows of R around the peak: near[-4] to near[4], pixel 0 of each.
 * Out:    the dot with its centre and peak.
 * Method: mean position, weighted by (R - R of the peak / 4)^2 where that is positive, over 5x5 pixels;
 *         of a plateau over 9x9.
 */
#ifndef IH_DOT_CENTRE_H
#define IH_DOT_CENTRE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dots.h"

IH_BEGIN_DECLS

struct ih_dot ih_dot_centre(const int16_t *const *near, int32_t u, int32_t v);
struct ih_dot ih_dot_centre_plateau(const int16_t *const *near, int32_t u, int32_t v);

IH_END_DECLS

#endif
