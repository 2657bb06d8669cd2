/* ih_exposure - how long to expose the next frame, and how much of that time the laser is on.
 *
 * In:    dots and labels of a frame that was taken with the exposure and duty in the state.
 * Out:   the same two for the next frame, within their limits.
 * Method: ih_exposure_look sums a frame up: how many dots are labelled, how high the weak and the
 *        strong ones among them are (a quarter and nine tenths up the distribution of R), and how
 *        many are lost to over-exposure: missing slots whose place, the mean of at least 3 labelled
 *        ones in the 5x5 around it, is over-exposed. It is at least an eighth of the fraction of
 *        over-exposed blocks: in the middle of a large burnt area no place is known.
 *        ih_exposure_next then takes the first that holds:
 *        1. More lost than lost_max: a shorter exposure, and as much more duty, so that the dots stay
 *           as high while the ambient light falls; with all the duty only as long as weak dots have
 *           half of weak_grey. The new exposure is a ceiling for the next IH_EXPOSURE_RETRY frames.
 *        2. Few labels: more duty, at its limit more exposure, until dots show.
 *        3. Weak dots below weak_grey, strong ones not above strong_grey: the same, by half of what
 *           is missing; the exposure only while hardly any is lost.
 *        4. Strong dots above strong_grey, weak ones high enough: less duty, at its limit less
 *           exposure, by half of what is too much.
 *        A step is at least 0.8 and at most 1.25, or one more where that is greater. Between raising and lowering there is a
 *        gap (an eighth of either aim), and a raise that loses dots is not tried again at once:
 *        in a still scene the values come to rest.
 * Cost:  361 slots, and each block of the dots' bright areas: 16,000 of 1280x800 pixels.
 * Error: none: a rule. What it proposes differs from the float64 reference by rounding alone.
 * Pure: the same state and look give the same next state. The caller owns the state.
 */
#ifndef IH_EXPOSURE_H
#define IH_EXPOSURE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "labels/ih_labels.h"

/* Fewer labels than this say nothing about how high dots are. */
#define IH_EXPOSURE_LABELLED_MIN 24
/* Frames for which an exposure that lost dots is not reached again. */
#define IH_EXPOSURE_RETRY 256

struct ih_exposure_params {
    int32_t exposure_min_us, exposure_max_us; /* 1 .. 1,000,000 */
    int32_t duty_min_q8, duty_max_q8; /* fraction of the exposure with the laser on, 1 .. 256 */
    int32_t weak_grey_q4;             /* R in 8-bit grey levels that weak dots should have */
    int32_t strong_grey_q4;           /* and that strong ones should not exceed */
    int32_t lost_max;                 /* slots lost to over-exposure that are accepted */
};

struct ih_exposure_look {
    int32_t labelled_count;
    int32_t weak, strong; /* R; 0 with few labels */
    int32_t lost_count;   /* of IH_SLOTS */
};

struct ih_exposure {
    int32_t exposure_us;
    int32_t duty_q8;
    int32_t ceiling_us;     /* the exposure is not raised above it */
    int32_t ceiling_frames; /* for so many frames to come */
};

IH_BEGIN_DECLS

void ih_exposure_params_default(struct ih_exposure_params *params);

/* Where to begin; limited to the parameters' limits. */
void ih_exposure_start(const struct ih_exposure_params *params, int32_t exposure_us,
                       int32_t duty_q8, struct ih_exposure *state);

/* width, height: of the frame. */
void ih_exposure_look(const struct ih_dots *dots, const struct ih_labels *labels, int32_t width,
                      int32_t height, struct ih_exposure_look *out);

void ih_exposure_next(const struct ih_exposure_params *params, const struct ih_exposure_look *look,
                      struct ih_exposure *state);

IH_END_DECLS

#endif
