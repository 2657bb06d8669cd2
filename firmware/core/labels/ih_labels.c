#include "labels/ih_labels.h"

#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "labels/ih_undistort.h"

/* A dot's centre may be off by this along the line and still belong to the working range. */
#define RANGE_MARGIN_PX_Q12 2048
/* Growing raises epsilon when a pass assigned fewer than this (paper, section 2.3). */
#define FEW_ASSIGNED 5
#define PERP_WEIGHT 6

void ih_labels_params_default(struct ih_labels_params *params)
{
    *params = (struct ih_labels_params){
        .perp_max_px_q12 = 2458,    /* 0.6 px */
        .seed_max_px_q12 = 4096,    /* 1.0 px */
        .seed_margin_px_q12 = 2048, /* 0.5 px */
        .epsilon_min_px_q12 = 6144, /* 1.5 px */
        .epsilon_max_px_q12 = 8 * 4096,
    };
}

/* A dot's undistorted place, kept in the order of rows, so that a line need not look at all. The dots come nearly so.
 * From here on a dot's number is that in this order. */
static void place_dot(struct ih_labels_scratch *scratch, int32_t dot, int32_t u_px_q12,
                      int32_t v_px_q12)
{
    int32_t at = dot;
    for (; at > 0 && scratch->v_px_q12[at - 1] > v_px_q12; at--) {
        scratch->u_px_q12[at] = scratch->u_px_q12[at - 1];
        scratch->v_px_q12[at] = scratch->v_px_q12[at - 1];
        scratch->by_row[at] = scratch->by_row[at - 1];
    }
    scratch->u_px_q12[at] = u_px_q12;
    scratch->v_px_q12[at] = v_px_q12;
    scratch->by_row[at] = (int16_t)dot;
}

static void undistort_dots(const struct ih_dots *dots, const struct ih_rig *rig,
                           struct ih_labels_scratch *scratch)
{
    ih_undistort_dots(dots, rig, scratch->u_px_q12, scratch->v_px_q12);
    for (int32_t i = 0; i < dots->dot_count; i++) {
        place_dot(scratch, i, scratch->u_px_q12[i], scratch->v_px_q12[i]);
        scratch->slot_of_dot[i] = IH_NONE;
    }
}

/* Where a dot is on a line, and how far beside it. Places are within 2^27 in Q12, those at infinity
 * within 2^27.6: a difference of 2^28.4 times a Q30 unit vector, two products, below 2^59.4. */
static int64_t along_line(const struct ih_labels_scratch *scratch, int32_t dot,
                          const struct ih_line *line)
{
    int64_t du = scratch->u_px_q12[dot] - line->infinity_u_px_q12;
    int64_t dv = scratch->v_px_q12[dot] - line->infinity_v_px_q12;
    return ih_shift_round(du * line->dir_u_q30 + dv * line->dir_v_q30, 30);
}

static int64_t beside_line(const struct ih_labels_scratch *scratch, int32_t dot,
                           const struct ih_line *line)
{
    int64_t du = scratch->u_px_q12[dot] - line->infinity_u_px_q12;
    int64_t dv = scratch->v_px_q12[dot] - line->infinity_v_px_q12;
    return ih_shift_round(dv * line->dir_u_q30 - du * line->dir_v_q30, 30);
}

/* Reading order: by row, then column. */
static bool reads_before(const struct ih_dot *a, const struct ih_dot *b)
{
    return a->v_px_q12 != b->v_px_q12 ? a->v_px_q12 < b->v_px_q12 : a->u_px_q12 < b->u_px_q12;
}

/* A slot's candidates stand in reading order, the last ones drop out of a full table: of equally good
 * ones the first is taken later, and none of that may depend on the order of the dots. */
static void add_candidate(const struct ih_dots *dots, struct ih_candidate candidate, int32_t slot,
                          struct ih_labels_scratch *scratch, struct ih_labels *out)
{
    struct ih_candidate *list = scratch->candidate[slot];
    const int16_t *by_row = scratch->by_row;
    const struct ih_dot *dot = &dots->dot[by_row[candidate.dot]];
    int8_t at = scratch->candidate_count[slot];
    if (at == IH_LABELS_CANDIDATES_MAX) {
        out->candidates_dropped++;
        at--;
        if (!reads_before(dot, &dots->dot[by_row[list[at].dot]])) {
            return;
        }
    } else {
        scratch->candidate_count[slot]++;
    }
    for (; at > 0 && reads_before(dot, &dots->dot[by_row[list[at - 1].dot]]); at--) {
        list[at] = list[at - 1];
    }
    list[at] = candidate;
}

/* How many dots lie above a row, from a guess on: that of the slot before is seldom far off. */
static int32_t dots_above(const struct ih_labels_scratch *scratch, int32_t count, int32_t v_px_q12,
                          int32_t guess)
{
    int32_t at = guess;
    while (at > 0 && scratch->v_px_q12[at - 1] >= v_px_q12) {
        at--;
    }
    while (at < count && scratch->v_px_q12[at] < v_px_q12) {
        at++;
    }
    return at;
}

/* Rows between which a line's candidates lie: those of its ends, which the margins move by at most
 * their sum; 4 steps for what is rounded. Infinity is within 2^27.6, an end within 2^27.9 of it. */
struct row_range {
    int32_t first_px_q12, last_px_q12;
};

static struct row_range rows_of_line(const struct ih_line *line,
                                     const struct ih_labels_params *params)
{
    const int32_t margin = params->perp_max_px_q12 + RANGE_MARGIN_PX_Q12 + 4;
    const int32_t far =
        line->infinity_v_px_q12 + (int32_t)ih_mul_shift(line->t_far_px_q12, line->dir_v_q30, 30);
    const int32_t near =
        line->infinity_v_px_q12 + (int32_t)ih_mul_shift(line->t_near_px_q12, line->dir_v_q30, 30);
    return (struct row_range){ih_min_s32(far, near) - margin, ih_max_s32(far, near) + margin};
}

/* A dot that lies on the slot's line, in the working range, becomes its candidate. */
static void try_candidate(const struct ih_dots *dots, const struct ih_line *line, int32_t slot,
                          int32_t dot, const struct ih_labels_params *params,
                          struct ih_labels_scratch *scratch, struct ih_labels *out)
{
    int64_t perp = beside_line(scratch, dot, line);
    if (ih_abs_s64(perp) > params->perp_max_px_q12) {
        return;
    }
    int64_t t = along_line(scratch, dot, line);
    if (t < line->t_far_px_q12 - RANGE_MARGIN_PX_Q12 ||
        t > line->t_near_px_q12 + RANGE_MARGIN_PX_Q12 || t <= 0) {
        return;
    }
    const struct ih_candidate candidate = {
        .t_px_q12 = (int32_t)t,
        .perp_px_q12 = (int16_t)perp,
        .dot = (int16_t)dot,
    };
    IH_IN_RANGE(candidate.t_px_q12, 1, IH_RANGE_T_PX_Q12);
    add_candidate(dots, candidate, slot, scratch, out);
}

/* Candidates of one slot. first: where those of the slot before were looked for from; set to this slot's. */
static void find_candidates(const struct ih_dots *dots, const struct ih_line *line, int32_t slot,
                            const struct ih_labels_params *params, int32_t *first,
                            struct ih_labels_scratch *scratch, struct ih_labels *out)
{
    const struct row_range rows = rows_of_line(line, params);
    *first = dots_above(scratch, dots->dot_count, rows.first_px_q12, *first);
    scratch->candidate_count[slot] = 0;
    scratch->choice[slot] = IH_NONE;
    for (int32_t i = *first; i < dots->dot_count && scratch->v_px_q12[i] <= rows.last_px_q12; i++) {
        try_candidate(dots, line, slot, i, params, scratch, out);
    }
}

static const struct ih_candidate *candidate_of(const struct ih_labels_scratch *scratch,
                                               int32_t slot, int32_t choice)
{
    return &scratch->candidate[slot][choice];
}

/* Sums over the corners of a rectangle, the first and the last one counting for it, the others against. Places
 * of dots are within 2^27 in Q12 (an undistorted coordinate is limited to tan 2, the principal point to
 * 2^14 px), a second difference 2^29. */
struct corners {
    int32_t u_px_q12, v_px_q12;
    uint32_t perp2; /* sum of squares, each below 2^30 */
};

static inline struct corners corner_of(const struct ih_labels_scratch *scratch,
                                       const struct ih_candidate *candidate)
{
    return (struct corners){scratch->u_px_q12[candidate->dot], scratch->v_px_q12[candidate->dot],
                            (uint32_t)(candidate->perp_px_q12 * candidate->perp_px_q12)};
}

static inline struct corners less_corner(struct corners sum, struct corners corner)
{
    return (struct corners){sum.u_px_q12 - corner.u_px_q12, sum.v_px_q12 - corner.v_px_q12,
                            sum.perp2 + corner.perp2};
}

/* Square of the seed's error, of the sums without the last corner and of it: 2^59 in all. */
static inline uint64_t rectangle_error2(struct corners sum, struct corners last)
{
    const int64_t u = sum.u_px_q12 + last.u_px_q12;
    const int64_t v = sum.v_px_q12 + last.v_px_q12;
    IH_IN_RANGE(u, -IH_RANGE_RECTANGLE_PX_Q12, IH_RANGE_RECTANGLE_PX_Q12);
    IH_IN_RANGE(v, -IH_RANGE_RECTANGLE_PX_Q12, IH_RANGE_RECTANGLE_PX_Q12);
    return (uint64_t)(u * u + v * v + 9 * (int64_t)(sum.perp2 + last.perp2)) / 4;
}

/* The best and the second best choice of candidates for a rectangle; the last corner's candidates in
 * the order of their places on its line. */
struct seed_search {
    uint64_t best2, second2;
    int8_t choice[4];
    int16_t dot[3];       /* of the first corners */
    int64_t reach_px_q12; /* a last corner farther than this from where it should be is none */
    int32_t last_count;
    int64_t last_t_px_q12[IH_LABELS_CANDIDATES_MAX];
    int8_t last_choice[IH_LABELS_CANDIDATES_MAX];
};

/* An error beyond seed_max + seed_margin decides nothing: such a choice is no seed, and no second best
 * one that is too near. The error is at least half of the last corner's distance; 4 steps for what is
 * rounded. */
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
        const int64_t t = along_line(scratch, candidate_of(scratch, slot, i)->dot, line);
        int32_t at = out->last_count++;
        for (; at > 0 && out->last_t_px_q12[at - 1] > t; at--) {
            out->last_t_px_q12[at] = out->last_t_px_q12[at - 1];
            out->last_choice[at] = out->last_choice[at - 1];
        }
        out->last_t_px_q12[at] = t;
        out->last_choice[at] = i;
    }
}

/* Where the last corner should be on its line, for three that are chosen. */
static int64_t expected_t_px_q12(struct corners sum, const struct ih_line *line)
{
    const int64_t du = -(int64_t)sum.u_px_q12 - line->infinity_u_px_q12;
    const int64_t dv = -(int64_t)sum.v_px_q12 - line->infinity_v_px_q12;
    return ih_shift_round(du * line->dir_u_q30 + dv * line->dir_v_q30, 30);
}

/* Try the candidates of the last corner with the three that are chosen. */
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
        const struct ih_candidate *last = candidate_of(scratch, slot, search->last_choice[i]);
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
        const struct ih_candidate *first = candidate_of(scratch, slot[0], i[0]);
        const struct corners one = corner_of(scratch, first);
        search->dot[0] = first->dot;
        for (i[1] = 0; i[1] < scratch->candidate_count[slot[1]]; i[1]++) {
            const struct ih_candidate *second = candidate_of(scratch, slot[1], i[1]);
            if (second->dot == first->dot) {
                continue;
            }
            const struct corners two = less_corner(one, corner_of(scratch, second));
            search->dot[1] = second->dot;
            for (i[2] = 0; i[2] < scratch->candidate_count[slot[2]]; i[2]++) {
                const struct ih_candidate *third = candidate_of(scratch, slot[2], i[2]);
                if (third->dot != first->dot && third->dot != second->dot) {
                    search->dot[2] = third->dot;
                    try_last_corner(scratch, &rig->line[slot[3]], slot[3],
                                    less_corner(two, corner_of(scratch, third)), i, search);
                }
            }
        }
    }
}

/* One candidate a corner, as most rectangles have: far from where it should be, the last one's error is no seed's. */
static void take_only_choice(const struct ih_labels_scratch *scratch, const int32_t slot[4],
                             struct seed_search *out)
{
    const struct ih_candidate *first = candidate_of(scratch, slot[0], 0);
    const struct ih_candidate *second = candidate_of(scratch, slot[1], 0);
    const struct ih_candidate *third = candidate_of(scratch, slot[2], 0);
    const struct ih_candidate *last = candidate_of(scratch, slot[3], 0);
    const bool is_distinct = first->dot != second->dot && first->dot != third->dot &&
                             first->dot != last->dot && second->dot != third->dot &&
                             second->dot != last->dot && third->dot != last->dot;
    const struct corners sum =
        less_corner(less_corner(corner_of(scratch, first), corner_of(scratch, second)),
                    corner_of(scratch, third));
    out->best2 = is_distinct ? rectangle_error2(sum, corner_of(scratch, last)) : UINT64_MAX;
    out->second2 = UINT64_MAX;
    memset(out->choice, 0, sizeof out->choice);
}

/* The best choice of candidates for the rectangle of four slots. False when there is none below the
 * limit, or when another choice is nearly as good. */
static bool find_seed(const struct ih_rig *rig, const struct ih_labels_scratch *scratch,
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

/* The order of offers: by error, then slot, of which there are at most 2^9. Of errors beyond 1024 px the slot alone decides. */
#define ORDER_SLOT_BITS 9
#define ORDER_ERROR_MAX ((1 << 22) - 1)

_Static_assert(IH_SLOTS <= 1 << ORDER_SLOT_BITS, "a slot has its bits in the order");

static uint32_t order_of(int32_t error_px_q12, int32_t slot)
{
    return (uint32_t)ih_min_s32(error_px_q12, ORDER_ERROR_MAX) << ORDER_SLOT_BITS | (uint32_t)slot;
}

static int32_t slot_in_order(uint32_t order)
{
    return (int32_t)(order % (1u << ORDER_SLOT_BITS));
}

/* Errors of a 64th of a pixel have a bin each, up to a pixel, which is what seeds have at most. */
#define ORDER_BINS 64
#define ORDER_BIN_SHIFT (ORDER_SLOT_BITS + 6)

static uint32_t bin_of(uint32_t order)
{
    const uint32_t bin = order >> ORDER_BIN_SHIFT;
    return bin < ORDER_BINS ? bin : ORDER_BINS - 1;
}

/* By bins, and then each to its place, which is near; no two are equal. */
static void sort_order(const uint32_t *order, int32_t count, uint32_t *sorted)
{
    int16_t begin[ORDER_BINS] = {0};
    for (int32_t i = 0; i < count; i++) {
        begin[bin_of(order[i])]++;
    }
    int16_t all = 0;
    for (int32_t bin = 0; bin < ORDER_BINS; bin++) {
        const int16_t here = begin[bin];
        begin[bin] = all;
        all = (int16_t)(all + here);
    }
    for (int32_t i = 0; i < count; i++) {
        sorted[begin[bin_of(order[i])]++] = order[i];
    }
    for (int32_t i = 1; i < count; i++) {
        const uint32_t moved = sorted[i];
        int32_t at = i;
        for (; at > 0 && sorted[at - 1] > moved; at--) {
            sorted[at] = sorted[at - 1];
        }
        sorted[at] = moved;
    }
}

static bool can_assign(const struct ih_labels_scratch *scratch, int32_t slot, int8_t choice)
{
    if (scratch->choice[slot] != IH_NONE) {
        return scratch->choice[slot] == choice;
    }
    return scratch->slot_of_dot[candidate_of(scratch, slot, choice)->dot] == IH_NONE;
}

static void assign(struct ih_labels_scratch *scratch, int32_t slot, int8_t choice)
{
    scratch->choice[slot] = choice;
    scratch->slot_of_dot[candidate_of(scratch, slot, choice)->dot] = (int16_t)slot;
}

static void rectangle_slots(int32_t first, int32_t slot[4])
{
    slot[0] = first;
    slot[1] = first + 1;
    slot[2] = first + IH_GRID;
    slot[3] = first + IH_GRID + 1;
}

static void seed(const struct ih_rig *rig, const struct ih_labels_params *params,
                 struct ih_labels_scratch *scratch)
{
    int32_t slot[4];
    int32_t count = 0;
    for (int32_t row = 0; row < IH_GRID - 1; row++) {
        for (int32_t first = row * IH_GRID; first < (row + 1) * IH_GRID - 1; first++) {
            rectangle_slots(first, slot);
            if (find_seed(rig, scratch, slot, params, &scratch->offer[first])) {
                scratch->order[count++] = order_of(scratch->offer[first].error_px_q12, first);
            }
        }
    }
    sort_order(scratch->order, count, scratch->sorted);
    for (int32_t i = 0; i < count; i++) {
        const int32_t first = slot_in_order(scratch->sorted[i]);
        const struct ih_labels_offer *offer = &scratch->offer[first];
        rectangle_slots(first, slot);
        bool possible = true;
        for (int k = 0; k < 4; k++) {
            possible = possible && can_assign(scratch, slot[k], offer->choice[k]);
        }
        for (int k = 0; possible && k < 4; k++) {
            assign(scratch, slot[k], offer->choice[k]);
        }
    }
}

/* Where a slot's inverse depth is kept: 0 while it has no label, and all around the pattern, so that no neighbour
 * needs to be asked whether it is there. What is to the right of a row is to the left of the next one, too. */
static int32_t node_of(int32_t slot)
{
    return (IH_LABELS_EDGE + slot / IH_GRID) * IH_LABELS_LINE + IH_LABELS_EDGE + slot % IH_GRID;
}

static const int32_t *inverse_depth_at(const struct ih_labels_scratch *scratch, int32_t slot)
{
    return &scratch->inverse_depth_q36[node_of(slot)];
}

/* 1/mm; t in Q12 over length in Q8: 36 + 8 - 12 = 32 more bits give Q36. */
static int32_t inverse_depth_q36(const struct ih_candidate *candidate, const struct ih_line *line)
{
    const int32_t inverse_q36 = ih_saturate_s32(
        ih_div_round(candidate->t_px_q12 * ((int64_t)1 << 32), line->length_px_mm_q8));
    IH_IN_RANGE(inverse_q36, 1, IH_RANGE_INVERSE_DEPTH_Q36);
    return inverse_q36;
}

/* What the neighbours of a slot expect of it. */
struct expectation {
    int32_t count;        /* values of inverse depth, 1/mm */
    int32_t value_q36[9]; /* of the up to 8 nearest neighbours, and of the affine map */
};

/* The affine map of inverse depth over the labelled slots of the 5x5 around a slot, evaluated in its
 * middle: for planes 1/Z is affine in the image. Weights 40 / d^2, so that they are whole. Sums: weights
 * 364 in all, second order at most 480, inverse depths below 2^31: the three products below
 * 2^(9 + 31 + 18) each. */
static bool affine_expectation(const int32_t *inverse_depth_q36, int32_t *value_q36)
{
    /* by |dy|, then |dx| */
    static const int8_t weight[3][3] = {{0, 40, 10}, {40, 20, 8}, {10, 8, 5}};
    int32_t s = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0;
    int64_t sq = 0, sxq = 0, syq = 0;
    for (int32_t dy = -2; dy <= 2; dy++) {
        /* What has no label is 0, and adds nothing; the slot itself has none. */
        const int32_t *q = &inverse_depth_q36[dy * IH_LABELS_LINE];
        const int8_t *w = weight[ih_abs_s32(dy)];
        const int32_t left = q[-1] != 0, right = q[1] != 0;
        const int32_t far_left = q[-2] != 0, far_right = q[2] != 0;
        const int32_t beside = w[1] * (left + right);
        const int32_t beyond = w[2] * (far_left + far_right);
        const int32_t row = w[0] * (q[0] != 0) + beside + beyond;
        const int32_t row_x = w[1] * (right - left) + 2 * w[2] * (far_right - far_left);
        const int64_t row_q =
            w[0] * (int64_t)q[0] + w[1] * ((int64_t)q[-1] + q[1]) + w[2] * ((int64_t)q[-2] + q[2]);
        s += row;
        sx += row_x;
        sy += dy * row;
        sxx += beside + 4 * beyond;
        sxy += dy * row_x;
        syy += dy * dy * row;
        sq += row_q;
        sxq += w[1] * ((int64_t)q[1] - q[-1]) + 2 * w[2] * ((int64_t)q[2] - q[-2]);
        syq += dy * row_q;
    }
    const int32_t c0 = sxx * syy - sxy * sxy;
    const int32_t c1 = sxy * sy - sx * syy;
    const int32_t c2 = sx * sxy - sxx * sy;
    const int32_t determinant = s * c0 + sx * c1 + sy * c2;
    if (determinant <= 0) { /* fewer than three, or all on one line */
        return false;
    }
    *value_q36 = ih_saturate_s32(ih_div_round(sq * c0 + sxq * c1 + syq * c2, determinant));
    return true;
}

static void expect(const struct ih_labels_scratch *scratch, int32_t slot, struct expectation *out)
{
    const int32_t *at = inverse_depth_at(scratch, slot);
    out->count = 0;
    for (int32_t dy = -1; dy <= 1; dy++) {
        for (int32_t dx = -1; dx <= 1; dx++) {
            const int32_t q = at[dy * IH_LABELS_LINE + dx];
            out->value_q36[out->count] = q; /* the slot itself has none: 8 at most */
            out->count += q != 0;
        }
    }
    if (affine_expectation(at, &out->value_q36[out->count])) {
        out->count++;
    }
}

/* hypot(along, 6 perp) against the expectation that suits the candidate best. */
static int32_t growth_error(const struct ih_candidate *candidate,
                            const struct expectation *expected, const struct ih_line *line)
{
    const int64_t own_q36 = inverse_depth_q36(candidate, line);
    int64_t off_q36 = INT32_MAX;
    for (int32_t i = 0; i < expected->count; i++) {
        off_q36 = ih_min_s64(ih_abs_s64(own_q36 - expected->value_q36[i]), off_q36);
    }
    int64_t along = ih_mul_shift(off_q36, line->length_px_mm_q8, 32); /* Q36 Q8 -> Q12 */
    int64_t perp = (int64_t)PERP_WEIGHT * candidate->perp_px_q12;
    along = along > (1 << 28) ? 1 << 28 : along;
    return (int32_t)ih_isqrt_u64((uint64_t)(along * along + perp * perp));
}

static bool is_free(const struct ih_labels_scratch *scratch, int32_t slot, int32_t choice)
{
    return scratch->slot_of_dot[candidate_of(scratch, slot, choice)->dot] == IH_NONE;
}

/* The best free candidate of an open slot, whatever its error; false when none is free. */
static bool find_offer(const struct ih_labels_scratch *scratch, const struct ih_rig *rig,
                       int32_t slot, struct ih_labels_offer *out)
{
    struct expectation expected = {.count = -1}; /* not asked yet */
    out->error_px_q12 = INT32_MAX;
    for (int8_t i = 0; i < scratch->candidate_count[slot]; i++) {
        if (!is_free(scratch, slot, i)) {
            continue;
        }
        if (expected.count < 0) {
            expect(scratch, slot, &expected);
            out->choice[0] = i;
        }
        const int32_t error = expected.count == 0 ? INT32_MAX
                                                  : growth_error(candidate_of(scratch, slot, i),
                                                                 &expected, &rig->line[slot]);
        if (error < out->error_px_q12) {
            out->error_px_q12 = error;
            out->choice[0] = i;
        }
    }
    return expected.count >= 0;
}

/* A label in its place among those that expect; what was expected around it is no longer so. */
static void set_inverse_depth(struct ih_labels_scratch *scratch, const struct ih_rig *rig,
                              int32_t slot)
{
    const int32_t node = node_of(slot);
    scratch->inverse_depth_q36[node] =
        inverse_depth_q36(candidate_of(scratch, slot, scratch->choice[slot]), &rig->line[slot]);
    for (int32_t dy = -2; dy <= 2; dy++) {
        for (int32_t dx = -2; dx <= 2; dx++) {
            scratch->is_stale[node + dy * IH_LABELS_LINE + dx] = true;
        }
    }
}

/* After the seeds: inverse depths of what has a label, and a list of what has none. */
static void begin_growing(const struct ih_rig *rig, struct ih_labels_scratch *scratch)
{
    memset(scratch->inverse_depth_q36, 0, sizeof scratch->inverse_depth_q36);
    memset(scratch->is_stale, true, sizeof scratch->is_stale);
    scratch->open_count = 0;
    for (int32_t row = 0; row < IH_GRID; row++) {
        int32_t *inverse_q36 = &scratch->inverse_depth_q36[node_of(row * IH_GRID)];
        for (int32_t column = 0; column < IH_GRID; column++) {
            const int32_t slot = row * IH_GRID + column;
            const int8_t choice = scratch->choice[slot];
            if (choice == IH_NONE) {
                scratch->open[scratch->open_count++] = (int16_t)slot;
            } else {
                inverse_q36[column] =
                    inverse_depth_q36(candidate_of(scratch, slot, choice), &rig->line[slot]);
            }
        }
    }
}

/* Is what an open slot offered before still its best? Other candidates can only have been taken since. */
static bool is_fresh(const struct ih_labels_scratch *scratch, int32_t slot)
{
    return !scratch->is_stale[node_of(slot)] &&
           is_free(scratch, slot, scratch->offer[slot].choice[0]);
}

/* One pass over all open slots; returns how many were labelled. One without a free candidate stays open for ever, and
 * is not looked at again. */
static int32_t grow_once(const struct ih_rig *rig, struct ih_labels_scratch *scratch,
                         int32_t epsilon_px_q12)
{
    int32_t open_count = 0;
    int32_t count = 0;
    for (int32_t i = 0; i < scratch->open_count; i++) {
        const int16_t slot = scratch->open[i];
        struct ih_labels_offer *offer = &scratch->offer[slot];
        if (scratch->choice[slot] != IH_NONE ||
            (!is_fresh(scratch, slot) && !find_offer(scratch, rig, slot, offer))) {
            continue;
        }
        scratch->is_stale[node_of(slot)] = false;
        scratch->open[open_count++] = slot;
        if (offer->error_px_q12 < epsilon_px_q12) {
            scratch->order[count++] = order_of(offer->error_px_q12, slot);
        }
    }
    scratch->open_count = open_count;
    sort_order(scratch->order, count, scratch->sorted);
    int32_t assigned = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t slot = slot_in_order(scratch->sorted[i]);
        const int8_t choice = scratch->offer[slot].choice[0];
        if (is_free(scratch, slot, choice)) {
            assign(scratch, slot, choice);
            set_inverse_depth(scratch, rig, slot);
            assigned++;
        }
    }
    return assigned;
}

static void grow(const struct ih_rig *rig, const struct ih_labels_params *params,
                 struct ih_labels_scratch *scratch)
{
    int32_t epsilon = params->epsilon_min_px_q12;
    begin_growing(rig, scratch);
    while (epsilon <= params->epsilon_max_px_q12) {
        if (grow_once(rig, scratch, epsilon) < FEW_ASSIGNED) {
            epsilon += ih_max_s32(epsilon / 2, 1); /* it grows from any start */
        }
    }
}

static void write_table(const struct ih_labels_scratch *scratch, struct ih_labels *out)
{
    out->labelled_count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        out->dot_of_slot[slot] = IH_NONE;
        out->t_px_q12[slot] = 0;
        out->perp_px_q12[slot] = 0;
        if (scratch->choice[slot] != IH_NONE) {
            const struct ih_candidate *c = candidate_of(scratch, slot, scratch->choice[slot]);
            out->dot_of_slot[slot] = scratch->by_row[c->dot];
            out->t_px_q12[slot] = c->t_px_q12;
            out->perp_px_q12[slot] = c->perp_px_q12;
            out->labelled_count++;
        }
    }
}

void ih_labels_assign(const struct ih_dots *dots, const struct ih_rig *rig,
                      const struct ih_labels_params *params, struct ih_labels_scratch *scratch,
                      struct ih_labels *out)
{
    int32_t first = 0;
    out->candidates_dropped = 0;
    undistort_dots(dots, rig, scratch);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        find_candidates(dots, &rig->line[slot], slot, params, &first, scratch, out);
    }
    seed(rig, params, scratch);
    out->seed_count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        out->seed_count += scratch->choice[slot] != IH_NONE;
    }
    grow(rig, params, scratch);
    write_table(scratch, out);
}
