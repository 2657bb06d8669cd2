/* ih_rotation_estimate - the turn of a projector that labelled dots of many frames show, and how sure that is.
 *
 * In:    labels, and what a turn does to each slot's dot (ih_rotation_vote_slopes); frame by frame.
 * Out:   a turn against the rig that gave the labels, its uncertainty, and whether it is more than
 *        chance.
 * Method: Least squares of the dots' distances from their lines, three parameters, Tukey's weights.
 *        A dot's distance has two parts: noise that is another in each frame, and what the surface
 *        below it does to its centre, which is the same as long as the dot stays on its place: 0.2
 *        to 0.6 of the noise. Where walls stand still, and the pattern's corners, which alone show
 *        a turn across the baseline, mostly lie on walls, frames add nothing to the second part. So
 *        of each slot the frames of one place are taken together, as one distance with the weight
 *        n / (1 + n / 20) of n frames, the best linear estimate where a place errs by 0.22 of the noise.
 *        A dot that is IH_ROTATION_ESTIMATE_MOVE away along its line is on another place, in the image, where no turn of the
 *        rig moves it. A slot remembers two, so that a wall is the same again when whoever passes has gone: with one,
 *        walls counted ten times in 1000 frames.
 *        Most slots err by 0.02 px, on edges some by 0.1 px and more: solved three times more, each slot with
 *        Cauchy's weight of what the turn before left of its mean, against how far slots scatter.
 *        Uncertainty: from what each slot's own distance leaves unexplained, with nothing assumed
 *        of how slots err but that they do so independently (the sandwich of White, 1980); so
 *        it counts rays that were calibrated badly, too. 0.03 px that no frame shows are added.
 *        A prior as wide as the turn itself keeps what is hardly seen near 0; the uncertainty is that
 *        with a prior as wide as the limit, so that what is only held is not taken for seen. If the
 *        turn across the baseline is less certain than IH_ROTATION_ESTIMATE_SIGMA_MAX it is not estimated but held
 *        where it is known to be, else at the calibration's, and the others are estimated with that.
 *        As weights fall where what is left grows, the turn moves by more than they say: 1 / (2 v - 1) for weights v.
 * Cost:  adding, 361 slots; finding, a dozen sums over them and 3x3 equations.
 * Error: against float64 on the same frames (tools/oracle/knock.py): docs/numerics.md.
 * Memory: constant, 12 kB; IH_ROTATION_ESTIMATE_FRAMES_MAX frames, then older ones count three quarters.
 */
#ifndef IH_ROTATION_ESTIMATE_H
#define IH_ROTATION_ESTIMATE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "labels/ih_labels.h"
#include "rig/ih_rig.h"
#include "upkeep/ih_rotation_vote.h"

/* So far along its line a dot is on another place of the surface. */
#define IH_ROTATION_ESTIMATE_MOVE_PX_Q12 1229 /* 0.3 px */
/* No axis may be less certain than this: 45 mm of depth at 800 mm with a baseline of 12.5 mm. */
#define IH_ROTATION_ESTIMATE_SIGMA_MAX_RAD_Q30 937004 /* 0.05 degrees */
/* Sums are made less by a quarter at so many frames: 30 s at 30 frames/s. More would pass 64 bits. */
#define IH_ROTATION_ESTIMATE_FRAMES_MAX 900

/* Over dots: weight, and weight times distance in px. */
struct ih_dot_place_sums {
    int32_t weight_q8, pull_q20;
};

/* Of a slot's labelled dots: the two places with most frames, by where in the image the first dot on each was; and
 * last those that were left for others, each with its weight. */
#define IH_ROTATION_ESTIMATE_KNOWN 2
struct ih_dot_place {
    int32_t along_px_q12[IH_ROTATION_ESTIMATE_KNOWN];
    struct ih_dot_place_sums at[IH_ROTATION_ESTIMATE_KNOWN + 1];
};

struct ih_rotation_estimate {
    int32_t frame_count;
    int64_t weight_q8, rise_q8, square_q32; /* of all dots, places or not */
    struct ih_dot_place slot[IH_SLOTS];
};

struct ih_rotation_estimate_result {
    int32_t rotation_rad_q30[3]; /* against the rig of the labels */
    int32_t
        sigma_rad_q30[3]; /* one standard deviation; of no use across the baseline if not seen */
    bool
        is_weak_seen; /* the turn across the baseline; if not, it is held where it is known to be, or at
                        * the calibration's */
    int32_t
        sure_rad_q30; /* the turn about those axes where it is 5 times its uncertainty, with 0.12 px
                           * for each slot (of a change 0.06 px); 0: none */
};

IH_BEGIN_DECLS

void ih_rotation_estimate_clear(struct ih_rotation_estimate *places);

/* rig: of the labels, as the slopes are. Dots farther from their line than reach say nothing. */
void ih_rotation_estimate_add(struct ih_rotation_estimate *places, const struct ih_labels *labels,
                              const struct ih_rig *rig,
                              const struct ih_rotation_vote_slopes *slopes, int32_t reach_px_q12);

/* False: too few dots, or they do not show the turn along the baseline or about the camera's axis.
 * turned: the rig against its calibration, about which the prior is; is_weak_known: also across the
 * baseline, from earlier frames. */
bool ih_rotation_estimate_find(const struct ih_rotation_estimate *places, const struct ih_rig *rig,
                               const struct ih_rotation_vote_slopes *slopes,
                               const int32_t rotated_rad_q30[3], bool is_weak_known,
                               struct ih_rotation_estimate_result *out);

/* How late frames differ from all, among which they are, as a turn; what slots err by in both, from
 * calibration or because they stand still, is not counted. A turn that late dots do not show is 0. False: as
 * above. */
bool ih_rotation_estimate_change(const struct ih_rotation_estimate *late,
                                 const struct ih_rotation_estimate *all, const struct ih_rig *rig,
                                 const struct ih_rotation_vote_slopes *slopes,
                                 struct ih_rotation_estimate *scratch,
                                 struct ih_rotation_estimate_result *out);

/* What takes the part of a turn across the baseline back. */
void ih_rotation_estimate_hold(const struct ih_rig *rig, const int32_t rotated_rad_q30[3],
                               int32_t back_rad_q30[3]);

/* The rig was turned by so much: what is known stays, against the new lines. */
void ih_rotation_estimate_rotate(struct ih_rotation_estimate *places,
                                 const struct ih_rotation_vote_slopes *slopes,
                                 const int32_t by_rad_q30[3]);

/* What was long ago counts less: the rig may drift. */
void ih_rotation_estimate_forget(struct ih_rotation_estimate *places);

IH_END_DECLS

#endif
