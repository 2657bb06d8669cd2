/* ih_surroundings - what every ray at and around a candidate says for or against a head: a learnt map (ours).
 *
 * In:     rays and points, an ellipsoid, a map.
 * Out:    log-odds; or, by slot, the place in the map that the ray asks.
 * Method: the plane at the centre's depth has cells of 64 mm, to 384 mm aside and above and 448 mm below the
 *         centre, those on the left and on the right alike. A ray asks the cell that it passes, and there one of
 *         nine ranges of depth, in which its point lies against the centre, or the tenth place when it is empty.
 *         A ray of unknown state asks nothing: what is outside of the picture, the pattern or the range
 *         speaks neither way.
 *         Log-odds = sum of what the map says to all rays, times the part of a cell that a ray stands for: the
 *         square of (spacing of the rays at this depth / 64 mm), at most 1. So a dense pattern or a near head
 *         has more rays, each of which counts less.
 *         The map is learnt together with ih_score's curves by tools/learn, with a penalty on neighbours that
 *         differ; ih_surroundings_map.h has it.
 * Overflow: a depth is below 2^27 in Q8, a slope at most 2^22: 2^49. A spacing is limited to 2^14 in Q8. The sum of
 *         361 values of 8 bits is below 2^15.5, times a weight of 2^12 2^27.5.
 * Error:  a ray that passes within 1/128 mm of a cell's edge, or a depth within half a mm of a range's, may
 *         be counted on either side. The weight 2 %, at 25 mm of spacing 0.2 %: a square of Q8.
 * Cost:   two products for each ray of known state: some 9,000 instructions for 340 of them.
 */
#ifndef IH_SURROUNDINGS_H
#define IH_SURROUNDINGS_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_rays.h"

#define IH_SURROUNDINGS_COLUMNS 6
#define IH_SURROUNDINGS_ROWS 13
#define IH_SURROUNDINGS_DEPTHS 10 /* nine ranges, and nothing */
#define IH_SURROUNDINGS_PLACES \
    (IH_SURROUNDINGS_COLUMNS * IH_SURROUNDINGS_ROWS * IH_SURROUNDINGS_DEPTHS)

struct ih_surroundings {
    int32_t weight_q12;      /* of a ray */
    int16_t place[IH_SLOTS]; /* (row * COLUMNS + column) * DEPTHS + depth, or IH_NONE */
};

IH_BEGIN_DECLS

/* By the learnt map. */
int32_t ih_surroundings_logit_q8(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid);

/* By another map. */
int32_t ih_surroundings_logit_by_map_q8(const int8_t map_q9[IH_SURROUNDINGS_PLACES],
                                        const struct ih_rays *rays,
                                        const struct ih_ellipsoid *ellipsoid);

/* What is asked, for learning and for pictures. */
void ih_surroundings_find(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                          struct ih_surroundings *out);

IH_END_DECLS

#endif
