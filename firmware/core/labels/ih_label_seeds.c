#include "labels/ih_label_seeds.h"

#include <string.h>

#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "labels/ih_label_lines.h"
#include "labels/ih_label_order.h"

/* Sums over the corners of a rectangle: first and last positive, the others negative. Positions of dots are within
 * 2^27 in Q12 (an undistorted coordinate is limited to tan 2, the principal point to 2^14 px), a second
 * difference 2^29. */
struct corners {
    int32_t u_px_q12, v_px_q12;
    uint32_t perp2; /* sum of squares, each below 2^30 */
};

static inline struct corners corner_of(const struct ih_labels_scratch *scratch,
                                       const struct ih_candidate *candidate)
{
    return (struct corners){scratch->rows->u_px_q12[candidate->dot],
                            scratch->rows->v_px_q12[candidate->dot],
                            (uint32_t)(candidate->perp_px_q12 * candidate->perp_px_q12)};
}

static inline struct corners sub_corner(struct corners sum, struct corners corner)
{
    return (struct corners){sum.u_px_q12 - corner.u_px_q12, sum.v_px_q12 - corner.v_px_q12,
                            sum.perp2 + corner.perp2};
}

/* Square of the seed's error, from the sums and the last corner: below 2^59. */
static inline uint64_t rectangle_error2(struct corners sum, struct corners last)
{
    const int64_t u = sum.u_px_q12 + last.u_px_q12;
    const int64_t v = sum.v_px_q12 + last.v_px_q12;
    IH_IN_RANGE(u, -IH_RANGE_RECTANGLE_PX_Q12, IH_RANGE_RECTANGLE_PX_Q12);
    IH_IN_RANGE(v, -IH_RANGE_RECTANGLE_PX_Q12, IH_RANGE_RECTANGLE_PX_Q12);
    return (uint64_t)(u * u + v * v + 9 * (int64_t)(sum.perp2 + last.perp2)) / 4;
}

/* The best and second best choice of candidates for a rectangle; the last corner's candidates in the order of their
 * positions on its line. */
struct seed_search {
    uint64_t best2, second2;
    int8_t choice[4];
    int16_t dot[3];       /* of the first corners */
    int64_t reach_px_q12; /* of the last corner from its expected position */
    int32_t last_count;
    int64_t last_t_px_q12[IH_LABELS_CANDIDATES_MAX];
    int8_t last_choice[IH_LABELS_CANDIDATES_MAX];
};

/* An error beyond seed_max + seed_margin does not matter: such a choice is neither a seed nor too good a
 * second best. The error is at least half of the last corner's distance; 4 units for rounding. */
static void begin_search(const struct ih_labels_scratch *scratch, const struct ih_line *line,
                         int32_t slot, const struct ih_labels_params *params,
                         struct seed_search *out)
{
    out->best2 = UINT64_MAX;
    out->second2 = UINT64_MAX;
    out->last_count = 0;
    out->reach_px_q12 =
        2 * ((int64_t)params->seed_max_px_q12 + ih_max_s32(params->seed_margin_px_q12, 0)) + 4;
    for (int8_t i = 0; i < scratch->candidate_count[slot]; i++) {
        const int64_t t = ih_dot_rows_along_px_q12(scratch->rows,
                                                   ih_label_candidate(scratch, slot, i)->dot, line);
        int32_t at = out->last_count++;
        for (; at > 0 && out->last_t_px_q12[at - 1] > t; at--) {
            out->last_t_px_q12[at] = out->last_t_px_q12[at - 1];
            out->last_choice[at] = out->last_choice[at - 1];
        }
        out->last_t_px_q12[at] = t;
        out->last_choice[at] = i;
    }
}

/* The last corner's position on its line that three chosen ones predict. */
static int64_t expected_t_px_q12(struct corners sum, const struct ih_line *line)
{
    const int64_t du = -(int64_t)sum.u_px_q12 - line->infinity_u_px_q12;
    const int64_t dv = -(int64_t)sum.v_px_q12 - line->infinity_v_px_q12;
    return ih_shift_round(du * line->dir_u_q30 + dv * line->dir_v_q30, 30);
}

/* Try the candidates of the last corner with three chosen ones. */
static void try_last_corner(const struct ih_labels_scratch *scratch, const struct ih_line *line,
                            int32_t slot, struct corners sum, const int8_t choice[3],
                            struct seed_search *search)
{
    const int64_t expected = expected_t_px_q12(sum, line);
    int32_t i = 0;
    while (i < search->last_count && search->last_t_px_q12[i] < expected - search->reach_px_q12) {
        i++;
    }
    for (; i < search->last_count && search->last_t_px_q12[i] <= expected + search->reach_px_q12;
         i++) {
        const struct ih_candidate *last = ih_label_candidate(scratch, slot, search->last_choice[i]);
        if (last->dot == search->dot[0] || last->dot == search->dot[1] ||
            last->dot == search->dot[2]) {
            continue;
        }
        const uint64_t error2 = rectangle_error2(sum, corner_of(scratch, last));
        if (error2 < search->best2) {
            search->second2 = search->best2;
            search->best2 = error2;
            memcpy(search->choice, choice, 3);
            search->choice[3] = search->last_choice[i];
        } else if (error2 < search->second2) {
            search->second2 = error2;
        }
    }
}

/* Try all choices of different dots for the first three corners. */
static void try_corners(const struct ih_rig *rig, const struct ih_labels_scratch *scratch,
                        const int32_t slot[4], struct seed_search *search)
{
    int8_t i[3];
    for (i[0] = 0; i[0] < scratch->candidate_count[slot[0]]; i[0]++) {
        const struct ih_candidate *first = ih_label_candidate(scratch, slot[0], i[0]);
        const struct corners one = corner_of(scratch, first);
        search->dot[0] = first->dot;
        for (i[1] = 0; i[1] < scratch->candidate_count[slot[1]]; i[1]++) {
            const struct ih_candidate *second = ih_label_candidate(scratch, slot[1], i[1]);
            if (second->dot == first->dot) {
                continue;
            }
            const struct corners two = sub_corner(one, corner_of(scratch, second));
            search->dot[1] = second->dot;
            for (i[2] = 0; i[2] < scratch->candidate_count[slot[2]]; i[2]++) {
                const struct ih_candidate *third = ih_label_candidate(scratch, slot[2], i[2]);
                if (third->dot != first->dot && third->dot != second->dot) {
                    search->dot[2] = third->dot;
                    try_last_corner(scratch, &rig->line[slot[3]], slot[3],
                                    sub_corner(two, corner_of(scratch, third)), i, search);
                }
            }
        }
    }
}

/* One candidate a corner, as in most rectangles: no search. A last corner beyond reach has an error too large for a seed. */
static void take_only_choice(const struct ih_labels_scratch *scratch, const int32_t slot[4],
                             struct seed_search *out)
{
    const struct ih_candidate *first = ih_label_candidate(scratch, slot[0], 0);
    const struct ih_candidate *second = ih_label_candidate(scratch, slot[1], 0);
    const struct ih_candidate *third = ih_label_candidate(scratch, slot[2], 0);
    const struct ih_candidate *last = ih_label_candidate(scratch, slot[3], 0);
    const bool is_distinct = first->dot != second->dot && first->dot != third->dot &&
                             first->dot != last->dot && second->dot != third->dot &&
                             second->dot != last->dot && third->dot != last->dot;
    const struct corners sum =
        sub_corner(sub_corner(corner_of(scratch, first), corner_of(scratch, second)),
                   corner_of(scratch, third));
    out->best2 = is_distinct ? rectangle_error2(sum, corner_of(scratch, last)) : UINT64_MAX;
    out->second2 = UINT64_MAX;
    memset(out->choice, 0, sizeof out->choice);
}

bool ih_label_seeds_find(const struct ih_rig *rig, const struct ih_labels_scratch *scratch,
                         const int32_t slot[4], const struct ih_labels_params *params,
                         struct ih_labels_offer *out)
{
    struct seed_search search;
    int32_t many = 0;
    for (int k = 0; k < 4; k++) {
        if (scratch->candidate_count[slot[k]] == 0) {
            return false;
        }
        many |= scratch->candidate_count[slot[k]] - 1;
    }
    if (many == 0) {
        take_only_choice(scratch, slot, &search);
    } else {
        begin_search(scratch, &rig->line[slot[3]], slot[3], params, &search);
        try_corners(rig, scratch, slot, &search);
    }
    const int64_t max = ih_max_s32(params->seed_max_px_q12, 0);
    if (search.best2 >= (uint64_t)(max * max)) {
        return false;
    }
    const int64_t best = search.best2 <= UINT32_MAX ? ih_isqrt_u32((uint32_t)search.best2)
                                                    : ih_isqrt_u64(search.best2);
    const int64_t min = ih_max_s64(best + params->seed_margin_px_q12 + 1, 0); /* of the second */
    memcpy(out->choice, search.choice, sizeof out->choice);
    out->error_px_q12 = (int32_t)best;
    return search.second2 >= (uint64_t)(min * min);
}

static bool can_assign(const struct ih_labels_scratch *scratch, int32_t slot, int8_t choice)
{
    if (scratch->choice[slot] != IH_NONE) {
        return scratch->choice[slot] == choice;
    }
    return ih_label_is_free(scratch, slot, choice);
}

static void rectangle_slots(int32_t first, int32_t slot[4])
{
    slot[0] = first;
    slot[1] = first + 1;
    slot[2] = first + IH_GRID;
    slot[3] = first + IH_GRID + 1;
}

void ih_label_seeds_assign(const struct ih_rig *rig, const struct ih_labels_params *params,
                           struct ih_labels_scratch *scratch)
{
    int32_t slot[4];
    int32_t count = 0;
    for (int32_t row = 0; row < IH_GRID - 1; row++) {
        for (int32_t first = row * IH_GRID; first < (row + 1) * IH_GRID - 1; first++) {
            rectangle_slots(first, slot);
            if (ih_label_seeds_find(rig, scratch, slot, params, &scratch->offer[first])) {
                scratch->order[count++] = ih_label_order(scratch->offer[first].error_px_q12, first);
            }
        }
    }
    ih_label_order_sort(scratch->order, count, scratch->sorted);
    for (int32_t i = 0; i < count; i++) {
        const int32_t first = ih_label_order_slot(scratch->sorted[i]);
        const struct ih_labels_offer *offer = &scratch->offer[first];
        rectangle_slots(first, slot);
        bool possible = true;
        for (int k = 0; k < 4; k++) {
            possible = possible && can_assign(scratch, slot[k], offer->choice[k]);
        }
        for (int k = 0; possible && k < 4; k++) {
            ih_label_assign(scratch, slot[k], offer->choice[k]);
        }
    }
}
