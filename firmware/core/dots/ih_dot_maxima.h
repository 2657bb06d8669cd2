/* ih_dot_maxima - local maxima of R in the listed groups of a row; private to ih_dots.
 *
 * In:     three rows of R, and the groups of the middle one that are above their limit (ih_bandpass).
 * Out:    groups with maxima above the limit, a bit for each pixel. Of equal neighbours the first in
 *         reading order is the maximum.
 */
#ifndef IH_DOT_MAXIMA_H
#define IH_DOT_MAXIMA_H

#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_bandpass.h"

struct ih_dot_maxima {
    int32_t count;
    int16_t first[IH_BANDPASS_GROUPS]; /* pixel of the lowest bit */
    uint32_t maxima[IH_BANDPASS_GROUPS];
};

IH_BEGIN_DECLS

/* Rows from pixel 0 on; one pixel to both sides of a group is read. */
void ih_dot_maxima_mark(const struct ih_bandpass_row *listed, const int16_t *above,
                        const int16_t *middle, const int16_t *below, struct ih_dot_maxima *out);

IH_END_DECLS

#endif
