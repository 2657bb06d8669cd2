/* ih_labels - which detected dot is which of the 361? (paper, section 2.3)
 *
 * In:    dots in any order, rig. Where it matters which of two comes first, it is the one that reads
 *        first in the frame.
 * Out:   the 361-slot table: per slot a dot or IH_NONE; no dot twice.
 * Way:   1. Candidates: a dot is a candidate of every slot whose epipolar line, in undistorted
 *           pixels, passes within perp_max of it, in the working range.
 *        2. Seeds: the four slots of each smallest rectangle of the pattern; a choice of
 *           candidates is an affine image of it when p00 - p01 - p10 + p11 = 0. Error
 *           sqrt(|p00 - p01 - p10 + p11|^2 / 4 + 9 (sum of perp^2) / 4); taken when below
 *           seed_max and no other choice comes within seed_margin.
 *        3. Growing: a slot with labelled neighbours expects its dot where the affine map of the
 *           5x5 around it says (weights 1/d^2), or at the depth of one of its 3x3 neighbours;
 *           error hypot(along, 6 perp) < epsilon; best pairs first. When a pass assigns fewer than
 *           5, epsilon grows by half, up to epsilon_max. What is left then is not labelled: of
 *           what 40 px instead of 8 would add half is wrong, and seeds have bridged the edges.
 * Cost:  361 x the dots in the rows of a line: a few each where lines lie along rows, all where they
 *        stand upright; growing goes through the open slots that have a free candidate a few dozen
 *        times, and asks again what is expected where something has changed. Seeding tries the
 *        candidates of three slots with each other, and of the fourth those that are near where
 *        it should be: 324 x 16^3 at the very worst, which a frame made for it can bring about, a
 *        thousand for a real one.
 * Full tables drop and count: candidates_dropped.
 */
#ifndef IH_LABELS_H
#define IH_LABELS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "rig/ih_rig.h"

/* Candidates kept per slot; each costs 8 bytes a slot. With a 125 mm baseline a line crosses the
 * places of about ten others. */
#define IH_LABELS_CANDIDATES_MAX 16

struct ih_labels_params {
    int32_t perp_max_px_q12;    /* a dot farther from the line than this is not its dot */
    int32_t seed_max_px_q12;    /* affine error of a seed */
    int32_t seed_margin_px_q12; /* the next best choice must be worse by this */
    int32_t epsilon_min_px_q12, epsilon_max_px_q12;
};

struct ih_labels {
    int32_t labelled_count;
    int32_t seed_count; /* slots labelled by seeds */
    int32_t candidates_dropped;
    int16_t dot_of_slot[IH_SLOTS]; /* index into ih_dots.dot, or IH_NONE */
    /* Where the dot is on its line, and how far beside it; valid where a dot is. */
    int32_t t_px_q12[IH_SLOTS];
    int16_t perp_px_q12[IH_SLOTS];
};

struct ih_candidate {
    int32_t t_px_q12; /* on the slot's line */
    int16_t perp_px_q12;
    int16_t dot; /* in the order of rows */
};

/* Something that may be assigned: a rectangle of four slots while seeding, one slot while growing (choice[0]
 * alone is used). */
struct ih_labels_offer {
    int32_t error_px_q12; /* INT32_MAX while growing: nothing is expected */
    int8_t choice[4];     /* candidates */
};

/* The pattern with an edge of two slots, beside a row that of the next one. */
#define IH_LABELS_EDGE 2
#define IH_LABELS_LINE (IH_GRID + IH_LABELS_EDGE)
#define IH_LABELS_NODES (IH_LABELS_LINE * (IH_GRID + 2 * IH_LABELS_EDGE) + IH_LABELS_EDGE)

struct ih_labels_scratch {
    /* Dots by row: undistorted places, their numbers in ih_dots. */
    int32_t u_px_q12[IH_DOTS_MAX], v_px_q12[IH_DOTS_MAX];
    int16_t by_row[IH_DOTS_MAX];
    int16_t slot_of_dot[IH_DOTS_MAX];
    int8_t candidate_count[IH_SLOTS];
    int8_t choice[IH_SLOTS]; /* candidate taken, or IH_NONE */
    struct ih_candidate candidate[IH_SLOTS][IH_LABELS_CANDIDATES_MAX];
    struct ih_labels_offer offer[IH_SLOTS]; /* by slot, of a rectangle by its first one */
    uint32_t order[IH_SLOTS];               /* of the offers: error and slot */
    uint32_t sorted[IH_SLOTS];
    /* Growing: inverse depths of labels, 1/mm, else 0; what an open slot offered is no longer so; open slots. */
    int32_t inverse_depth_q36[IH_LABELS_NODES];
    bool is_stale[IH_LABELS_NODES];
    int32_t open_count;
    int16_t open[IH_SLOTS];
};

IH_BEGIN_DECLS

void ih_labels_params_default(struct ih_labels_params *params);

void ih_labels_assign(const struct ih_dots *dots, const struct ih_rig *rig,
                      const struct ih_labels_params *params, struct ih_labels_scratch *scratch,
                      struct ih_labels *out);

IH_END_DECLS

#endif
