/* ih_labels - which detected dot is which of the 361? (paper, section 2.3)
 *
 * In:     dots in any order, rig. Ties go to the dot that comes first in reading order.
 * Out:    the 361-slot table: per slot a dot or IH_NONE; no dot twice.
 * Method: 1. Candidates: a dot is a candidate of every slot whose epipolar line, in undistorted pixels, passes
 *            within perp_max of it, in the working range.
 *         2. Seeds: the four slots of each smallest rectangle of the pattern; a choice of candidates is an
 *            affine image of it when p00 - p01 - p10 + p11 = 0. Error
 *            sqrt(|p00 - p01 - p10 + p11|^2 / 4 + 9 (sum of perp^2) / 4); accepted below seed_max, when no
 *            other choice comes within seed_margin.
 *         3. Growing: a slot with labelled neighbours expects its dot where the affine map of the 5x5 around
 *            it predicts it (weights 1/d^2), or at the depth of one of its 3x3 neighbours; error
 *            hypot(along, 6 perp) < epsilon; best pairs first. When a pass assigns fewer than 5, epsilon
 *            grows by half, up to epsilon_max; slots still open then get no label. An epsilon_max of 40 px
 *            instead of 8 would add labels of which half are wrong, and seeds have bridged the edges.
 * Cost:   361 x the dots in the rows of a line: a few each where lines run along rows, all where they are
 *         upright. Growing visits the open slots that have a free candidate a few dozen times, and computes
 *         an expectation again only after a change. Seeding tries the candidates of three slots with each
 *         other, and walks those of the fourth for one near the predicted position: 324 x 16^4 comparisons at
 *         worst, for a frame made to provoke it, a thousand trials for a real one.
 * Full tables drop and count: candidates_dropped.
 */
#ifndef IH_LABELS_H
#define IH_LABELS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dot_rows.h"
#include "dots/ih_dots.h"
#include "rig/ih_rig.h"

/* Candidates kept per slot; each costs 8 bytes a slot. With a 125 mm baseline a line passes about ten other
 * dots. */
#define IH_LABELS_CANDIDATES_MAX 16

struct ih_labels_params {
    int32_t perp_max_px_q12;    /* of a dot from its line */
    int32_t seed_max_px_q12;    /* affine error of a seed */
    int32_t seed_margin_px_q12; /* the second best choice must be worse by this */
    int32_t epsilon_min_px_q12, epsilon_max_px_q12;
};

struct ih_labels {
    int32_t labelled_count;
    int32_t seed_count; /* slots labelled by seeds */
    int32_t candidates_dropped;
    int16_t dot_of_slot[IH_SLOTS]; /* index into ih_dots.dot, or IH_NONE */
    /* Position of the dot along its line, and distance beside it; valid where there is a dot. */
    int32_t t_px_q12[IH_SLOTS];
    int16_t perp_px_q12[IH_SLOTS];
};

struct ih_candidate {
    int32_t t_px_q12; /* on the slot's line */
    int16_t perp_px_q12;
    int16_t dot; /* in the order of rows */
};

/* A possible assignment: of a rectangle of four slots while seeding, of one slot while growing (choice[0]). */
struct ih_labels_offer {
    int32_t error_px_q12; /* INT32_MAX while growing: no expectation */
    int8_t choice[4];     /* candidates */
};

/* The pattern with a border of two slots; rows share the border beside them. */
#define IH_LABELS_EDGE 2
#define IH_LABELS_LINE (IH_GRID + IH_LABELS_EDGE)
#define IH_LABELS_NODES (IH_LABELS_LINE * (IH_GRID + 2 * IH_LABELS_EDGE) + IH_LABELS_EDGE)

struct ih_labels_scratch {
    const struct ih_dot_rows *rows; /* of this frame */
    int16_t slot_of_dot[IH_DOTS_MAX];
    int8_t candidate_count[IH_SLOTS];
    int8_t choice[IH_SLOTS]; /* candidate taken, or IH_NONE */
    struct ih_candidate candidate[IH_SLOTS][IH_LABELS_CANDIDATES_MAX];
    struct ih_labels_offer offer[IH_SLOTS]; /* by slot, of a rectangle by its first one */
    uint32_t order[IH_SLOTS];               /* of the offers: error and slot */
    uint32_t sorted[IH_SLOTS];
    /* Growing: inverse depths of labels, 1/mm, else 0; must an open slot's offer be computed again? open slots. */
    int32_t inverse_depth_q36[IH_LABELS_NODES];
    bool is_stale[IH_LABELS_NODES];
    int32_t open_count;
    int16_t open[IH_SLOTS];
};

IH_BEGIN_DECLS

void ih_labels_params_default(struct ih_labels_params *params);

/* rows: of those dots. */
void ih_labels_assign(const struct ih_dots *dots, const struct ih_dot_rows *rows,
                      const struct ih_rig *rig, const struct ih_labels_params *params,
                      struct ih_labels_scratch *scratch, struct ih_labels *out);

IH_END_DECLS

#endif
