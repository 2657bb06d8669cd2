/* ih_surroundings - what the rays at and around a candidate say by several learnt maps: is a fit worth its while, is it a
 * head, and where is the head's centre (ours).
 *
 * In:     rays and points, a centre or an ellipsoid, the maps.
 * Out:    the promise of a centre; by slot, the place in the maps that the ray asks; an answer by each map; the ellipsoid
 *         moved.
 * Method: the plane at the centre's depth has cells of 64 mm, from 384 mm above the centre to 448 mm below it and to 384 mm
 *         aside, those on the left and on the right alike. Far from the head some are one: the two highest, the four
 *         lowest in pairs, and all from 128 mm outwards. A ray asks the cell that it passes, and there one of
 *         seven ranges of depth, in which its point lies against the centre, or the eighth place when it is empty.
 *         A ray of unknown state asks nothing: what is outside of the picture, the pattern or the range
 *         speaks neither way.
 *         A map's answer = sum of what it says of all rays, times the part of a cell that a ray stands for: the
 *         square of (spacing of the rays at this depth / 64 mm), at most 1. So a dense pattern or a near head
 *         has more rays, each of which counts less.
 *         tools/learn learns all of them at once with the curves of ih_score behind them: what a map is about is not given
 *         to it, and its unit means nothing. ih_surroundings_map.h has them.
 *         A fit does not know hair from skull, nor where a head ends that bends over its chest or turns aside: it is off where
 *         a model cannot tell. So three more maps say, in mm, how far aside, below and behind the fitted centre the head's is:
 *         aside what a ray on the right says counts to the right, on the left to the left. They are learnt from heads alone
 *         (tools/learn), by least squares.
 *         Before anything is fitted, one more map says how much a centre promises, by a quarter of the rays: all of them
 *         rank centres no better. It is learnt by logistic regression from the centres that ih_scan tries, whether a head's
 *         is within 90 mm.
 * Overflow: a depth is below 2^27 in Q8, a slope at most 2^22: 2^49. A spacing is limited to 2^14 in Q8. A sum of 361
 *         numbers, -8 to 7 each, is below 2^11.5, times a weight of 2^12 2^23.5; of the moves, of 8 bits, 2^15.5, times a step,
 *         1 mm at most, 2^27.5, times a weight 2^39.5. A promise is 100 numbers of 8 bits, 2^13.7, times a weight 2^25.7.
 * Error:  a ray that passes within 1/128 mm of a cell's edge, aside also of the centre, or a depth within half a mm of a
 *         range's, may be counted on either side. The weight 2 %, at 25 mm of spacing 0.2 %: a square of Q8. A move as the
 *         weight.
 * Cost:   two products for each ray of known state, and 24 sums of two maps each: 18,000 and 37,000 instructions (x86-64,
 *         -O3); a move 23,000; a promise 4,300.
 */
#ifndef IH_SURROUNDINGS_H
#define IH_SURROUNDINGS_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_rays.h"

#define IH_SURROUNDINGS_MAPS 48
/* A place of all maps is six words: of each map a number of so many bits, the first map's lowest, less this zero. */
#define IH_SURROUNDINGS_BITS 4
#define IH_SURROUNDINGS_ZERO 8
#define IH_SURROUNDINGS_WORDS (IH_SURROUNDINGS_MAPS * IH_SURROUNDINGS_BITS / 32)
#define IH_SURROUNDINGS_COLUMNS 3
#define IH_SURROUNDINGS_ROWS 10
#define IH_SURROUNDINGS_DEPTHS 8 /* seven ranges, and nothing */
#define IH_SURROUNDINGS_PLACES \
    (IH_SURROUNDINGS_COLUMNS * IH_SURROUNDINGS_ROWS * IH_SURROUNDINGS_DEPTHS)

struct ih_surroundings {
    int32_t weight_q12;      /* of a ray */
    int16_t place[IH_SLOTS]; /* (row * COLUMNS + column) * DEPTHS + depth, or IH_NONE */
};

/* How far off a fitted centre is: at each place the steps aside, to the side on which the ray passes the centre, down, and away
 * from the camera. */
struct ih_surroundings_moves {
    int32_t step_mm_q12[3]; /* above 0, at most 1 mm */
    int8_t steps[IH_SURROUNDINGS_PLACES][3];
};

/* What the promise is made of: log-odds of a head anywhere, and the part of each place. */
struct ih_surroundings_promise {
    int32_t bias_q5;
    int8_t part_q5[IH_SURROUNDINGS_PLACES];
};

IH_BEGIN_DECLS

/* Log-odds that a head's centre is within 90 mm, as far as every other ray of every other line can tell. */
int32_t ih_surroundings_promise_q5(const struct ih_rays *rays, const int32_t centre_mm_q8[3]);

/* By another map. */
int32_t ih_surroundings_promise_by_q5(const struct ih_surroundings_promise *promise,
                                      const struct ih_rays *rays, const int32_t centre_mm_q8[3]);

/* What is asked where. */
void ih_surroundings_find(const struct ih_rays *rays, const struct ih_ellipsoid *ellipsoid,
                          struct ih_surroundings *out);

/* By the learnt maps. */
void ih_surroundings_ask(const struct ih_surroundings *found,
                         int32_t answer_q8[IH_SURROUNDINGS_MAPS]);

/* By other maps. */
void ih_surroundings_ask_maps(const uint32_t maps[IH_SURROUNDINGS_PLACES][IH_SURROUNDINGS_WORDS],
                              const struct ih_surroundings *found,
                              int32_t answer_q8[IH_SURROUNDINGS_MAPS]);

/* Moved aside, down and away as learnt, by max_mm (up to 1000) at most each. */
void ih_surroundings_move(const struct ih_rays *rays, int32_t max_mm,
                          struct ih_ellipsoid *ellipsoid);

/* By other moves. */
void ih_surroundings_move_by(const struct ih_surroundings_moves *moves, const struct ih_rays *rays,
                             int32_t max_mm, struct ih_ellipsoid *ellipsoid);

IH_END_DECLS

#endif
