#include "ih_labels.h"

#include <string.h>

#include "ih_fix.h"

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

static void undistort_dots(const struct ih_dots *dots, const struct ih_rig *rig,
                           struct ih_labels_scratch *scratch)
{
    for (int32_t i = 0; i < dots->dot_count; i++) {
        int32_t x_q28, y_q28;
        ih_rig_undistort(rig, dots->dot[i].u_px_q12, dots->dot[i].v_px_q12, &x_q28, &y_q28);
        ih_rig_to_pixel(rig, x_q28, y_q28, &scratch->u_px_q12[i], &scratch->v_px_q12[i]);
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
    const struct ih_dot *dot = &dots->dot[candidate.dot];
    int8_t at = scratch->candidate_count[slot];
    if (at == IH_LABELS_CANDIDATES_MAX) {
        out->candidates_dropped++;
        at--;
        if (!reads_before(dot, &dots->dot[list[at].dot])) {
            return;
        }
    } else {
        scratch->candidate_count[slot]++;
    }
    for (; at > 0 && reads_before(dot, &dots->dot[list[at - 1].dot]); at--) {
        list[at] = list[at - 1];
    }
    list[at] = candidate;
}

/* The dots' numbers in the order of their undistorted rows, so that a line need not look at all. The
 * dots come nearly so. */
static void order_dots(int32_t count, struct ih_labels_scratch *scratch)
{
    for (int32_t i = 0; i < count; i++) {
        int32_t at = i;
        for (; at > 0 && scratch->v_px_q12[scratch->by_row[at - 1]] > scratch->v_px_q12[i]; at--) {
            scratch->by_row[at] = scratch->by_row[at - 1];
        }
        scratch->by_row[at] = (int16_t)i;
    }
}

/* How many dots lie above a row, from a guess on: that of the slot before is seldom far off. */
static int32_t dots_above(const struct ih_labels_scratch *scratch, int32_t count, int64_t v_px_q12,
                          int32_t guess)
{
    int32_t at = guess;
    while (at > 0 && scratch->v_px_q12[scratch->by_row[at - 1]] >= v_px_q12) {
        at--;
    }
    while (at < count && scratch->v_px_q12[scratch->by_row[at]] < v_px_q12) {
        at++;
    }
    return at;
}

/* Rows between which a line's candidates lie: those of its ends, which the margins move by at most
 * their sum; 4 steps for what is rounded. */
struct row_range {
    int64_t first_px_q12, last_px_q12;
};

static struct row_range rows_of_line(const struct ih_line *line,
                                     const struct ih_labels_params *params)
{
    const int64_t margin = (int64_t)params->perp_max_px_q12 + RANGE_MARGIN_PX_Q12 + 4;
    const int64_t far =
        line->infinity_v_px_q12 + ih_mul_shift(line->t_far_px_q12, line->dir_v_q30, 30);
    const int64_t near =
        line->infinity_v_px_q12 + ih_mul_shift(line->t_near_px_q12, line->dir_v_q30, 30);
    return (struct row_range){(far < near ? far : near) - margin,
                              (far < near ? near : far) + margin};
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
    struct ih_candidate candidate = {
        /* t in Q12 over length in Q8: 36 + 8 - 12 = 32 more bits give Q36 */
        .inverse_depth_q36 =
            ih_saturate_s32(ih_div_round(t * ((int64_t)1 << 32), line->length_px_mm_q8)),
        .perp_px_q12 = (int16_t)perp,
        .dot = (int16_t)dot,
    };
    IH_IN_RANGE(candidate.inverse_depth_q36, 1, IH_RANGE_INVERSE_DEPTH_Q36);
    add_candidate(dots, candidate, slot, scratch, out);
}

/* Dots in the order of rows, from one to before another. */
struct dot_range {
    int32_t begin, end;
};

/* Candidates of one slot. near: where those of the slot before were looked for; set to this slot's. */
static void find_candidates(const struct ih_dots *dots, const struct ih_line *line, int32_t slot,
                            const struct ih_labels_params *params, struct dot_range *near,
                            struct ih_labels_scratch *scratch, struct ih_labels *out)
{
    const struct row_range rows = rows_of_line(line, params);
    near->begin = dots_above(scratch, dots->dot_count, rows.first_px_q12, near->begin);
    near->end = dots_above(scratch, dots->dot_count, rows.last_px_q12 + 1, near->end);
    scratch->candidate_count[slot] = 0;
    scratch->choice[slot] = IH_NONE;
    for (int32_t i = near->begin; i < near->end; i++) {
        try_candidate(dots, line, slot, scratch->by_row[i], params, scratch, out);
    }
}

static const struct ih_candidate *candidate_of(const struct ih_labels_scratch *scratch,
                                               int32_t slot, int32_t choice)
{
    return &scratch->candidate[slot][choice];
}

/* Square of the seed's error. Places of dots are within 2^27 in Q12 (an undistorted coordinate is
 * limited to tan 2, the principal point to 2^14 px), a second difference 2^29: 2^59 in all. */
static uint64_t rectangle_error2(const struct ih_labels_scratch *scratch,
                                 const struct ih_candidate *const corner[4])
{
    int64_t u = 0;
    int64_t v = 0;
    int64_t perp2 = 0;
    for (int i = 0; i < 4; i++) {
        int64_t sign = i == 0 || i == 3 ? 1 : -1;
        u += sign * scratch->u_px_q12[corner[i]->dot];
        v += sign * scratch->v_px_q12[corner[i]->dot];
        perp2 += (int64_t)corner[i]->perp_px_q12 * corner[i]->perp_px_q12;
    }
    IH_IN_RANGE(u, -IH_RANGE_RECTANGLE_PX_Q12, IH_RANGE_RECTANGLE_PX_Q12);
    IH_IN_RANGE(v, -IH_RANGE_RECTANGLE_PX_Q12, IH_RANGE_RECTANGLE_PX_Q12);
    return (uint64_t)((u * u + v * v + 9 * perp2) / 4);
}

/* The best and the second best choice of candidates for a rectangle; the last corner's candidates in
 * the order of their places on its line. */
struct seed_search {
    uint64_t best2, second2;
    int8_t choice[4];
    const struct ih_line *line; /* of the last corner */
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
    *out = (struct seed_search){.best2 = UINT64_MAX, .second2 = UINT64_MAX, .line = line};
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
static int64_t expected_t_px_q12(const struct ih_labels_scratch *scratch,
                                 const struct ih_candidate *const corner[4],
                                 const struct ih_line *line)
{
    const int32_t *u = scratch->u_px_q12;
    const int32_t *v = scratch->v_px_q12;
    const int64_t u_px_q12 = (int64_t)u[corner[1]->dot] + u[corner[2]->dot] - u[corner[0]->dot];
    const int64_t v_px_q12 = (int64_t)v[corner[1]->dot] + v[corner[2]->dot] - v[corner[0]->dot];
    return ih_shift_round((u_px_q12 - line->infinity_u_px_q12) * line->dir_u_q30 +
                              (v_px_q12 - line->infinity_v_px_q12) * line->dir_v_q30,
                          30);
}

/* Try the candidates of the last corner with the three that are chosen. */
static void try_last_corner(const struct ih_labels_scratch *scratch, int32_t slot,
                            const struct ih_candidate *corner[4], int8_t choice[4],
                            struct seed_search *search)
{
    const int64_t expected = expected_t_px_q12(scratch, corner, search->line);
    int32_t i = 0;
    while (i < search->last_count && search->last_t_px_q12[i] < expected - search->reach_px_q12) {
        i++;
    }
    for (; i < search->last_count && search->last_t_px_q12[i] <= expected + search->reach_px_q12;
         i++) {
        corner[3] = candidate_of(scratch, slot, search->last_choice[i]);
        if (corner[3]->dot == corner[0]->dot || corner[3]->dot == corner[1]->dot ||
            corner[3]->dot == corner[2]->dot) {
            continue;
        }
        uint64_t error2 = rectangle_error2(scratch, corner);
        if (error2 < search->best2) {
            choice[3] = search->last_choice[i];
            search->second2 = search->best2;
            search->best2 = error2;
            memcpy(search->choice, choice, sizeof search->choice);
        } else if (error2 < search->second2) {
            search->second2 = error2;
        }
    }
}

/* The best choice of candidates for the rectangle of four slots. False when there is none below the
 * limit, or when another choice is nearly as good. */
static bool find_seed(const struct ih_rig *rig, const struct ih_labels_scratch *scratch,
                      const int32_t slot[4], const struct ih_labels_params *params,
                      struct ih_labels_offer *out)
{
    struct seed_search search;
    const struct ih_candidate *corner[4];
    int8_t i[4];
    begin_search(scratch, &rig->line[slot[3]], slot[3], params, &search);
    for (i[0] = 0; i[0] < scratch->candidate_count[slot[0]]; i[0]++) {
        corner[0] = candidate_of(scratch, slot[0], i[0]);
        for (i[1] = 0; i[1] < scratch->candidate_count[slot[1]]; i[1]++) {
            corner[1] = candidate_of(scratch, slot[1], i[1]);
            for (i[2] = 0; i[2] < scratch->candidate_count[slot[2]]; i[2]++) {
                corner[2] = candidate_of(scratch, slot[2], i[2]);
                bool distinct = corner[0]->dot != corner[1]->dot &&
                                corner[0]->dot != corner[2]->dot &&
                                corner[1]->dot != corner[2]->dot;
                if (distinct) {
                    try_last_corner(scratch, slot[3], corner, i, &search);
                }
            }
        }
    }
    const int64_t most = ih_max_s32(params->seed_max_px_q12, 0);
    if (search.best2 >= (uint64_t)(most * most)) {
        return false;
    }
    const int64_t best = ih_isqrt_u64(search.best2);
    const int64_t least = ih_max_s64(best + params->seed_margin_px_q12 + 1, 0); /* of the second */
    memcpy(out->choice, search.choice, sizeof out->choice);
    out->error_px_q12 = (int32_t)best;
    return search.second2 >= (uint64_t)(least * least);
}

/* Shell sort by error, then slot: the order of equal errors must not depend on anything else. */
static bool offer_before(const struct ih_labels_offer *a, const struct ih_labels_offer *b)
{
    return a->error_px_q12 != b->error_px_q12 ? a->error_px_q12 < b->error_px_q12
                                              : a->slot < b->slot;
}

static void sort_offers(struct ih_labels_offer *offer, int32_t count)
{
    static const int32_t gaps[] = {132, 57, 23, 10, 4, 1};
    for (size_t g = 0; g < sizeof gaps / sizeof gaps[0]; g++) {
        int32_t gap = gaps[g];
        for (int32_t i = gap; i < count; i++) {
            struct ih_labels_offer moved = offer[i];
            int32_t at = i;
            while (at >= gap && offer_before(&moved, &offer[at - gap])) {
                offer[at] = offer[at - gap];
                at -= gap;
            }
            offer[at] = moved;
        }
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
    int32_t count = 0;
    for (int32_t first = 0; first < IH_SLOTS - IH_GRID - 1; first++) {
        int32_t slot[4];
        rectangle_slots(first, slot);
        if (first % IH_GRID != IH_GRID - 1 &&
            find_seed(rig, scratch, slot, params, &scratch->offer[count])) {
            scratch->offer[count++].slot = (int16_t)first;
        }
    }
    sort_offers(scratch->offer, count);
    for (int32_t i = 0; i < count; i++) {
        const struct ih_labels_offer *offer = &scratch->offer[i];
        int32_t slot[4];
        rectangle_slots(offer->slot, slot);
        bool possible = true;
        for (int k = 0; k < 4; k++) {
            possible = possible && can_assign(scratch, slot[k], offer->choice[k]);
        }
        for (int k = 0; possible && k < 4; k++) {
            assign(scratch, slot[k], offer->choice[k]);
        }
    }
}

static bool labelled_inverse_depth(const struct ih_labels_scratch *scratch, int32_t row,
                                   int32_t column, int32_t *inverse_depth_q36)
{
    if (row < 0 || column < 0 || row >= IH_GRID || column >= IH_GRID) {
        return false;
    }
    int32_t slot = row * IH_GRID + column;
    if (scratch->choice[slot] == IH_NONE) {
        return false;
    }
    *inverse_depth_q36 = candidate_of(scratch, slot, scratch->choice[slot])->inverse_depth_q36;
    return true;
}

/* What the neighbours of a slot expect of it. */
struct expectation {
    int32_t count;        /* values of inverse depth, 1/mm */
    int32_t value_q36[9]; /* of the up to 8 nearest neighbours, and of the affine map */
};

/* The affine map of inverse depth over the labelled slots of the 5x5 around (row, column),
 * evaluated in its middle: for planes 1/Z is affine in the image. Weights 40 / d^2, so that they
 * are whole. Sums: weights 364 in all, second order at most 480, inverse depths below 2^31: the
 * three products below 2^(9 + 31 + 18) each. */
static bool affine_expectation(const struct ih_labels_scratch *scratch, int32_t row, int32_t column,
                               int32_t *value_q36)
{
    static const int8_t weight_of_d2[9] = {0, 40, 20, 0, 10, 8, 0, 0, 5};
    int64_t s = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, syy = 0, sq = 0, sxq = 0, syq = 0;
    for (int32_t dy = -2; dy <= 2; dy++) {
        for (int32_t dx = -2; dx <= 2; dx++) {
            int32_t q;
            if ((dx == 0 && dy == 0) ||
                !labelled_inverse_depth(scratch, row + dy, column + dx, &q)) {
                continue;
            }
            int64_t w = weight_of_d2[dx * dx + dy * dy];
            s += w;
            sx += w * dx;
            sy += w * dy;
            sxx += w * dx * dx;
            sxy += w * dx * dy;
            syy += w * dy * dy;
            sq += w * q;
            sxq += w * dx * q;
            syq += w * dy * q;
        }
    }
    int64_t c0 = sxx * syy - sxy * sxy;
    int64_t c1 = sxy * sy - sx * syy;
    int64_t c2 = sx * sxy - sxx * sy;
    int64_t determinant = s * c0 + sx * c1 + sy * c2;
    if (determinant <= 0) { /* fewer than three, or all on one line */
        return false;
    }
    *value_q36 = ih_saturate_s32(ih_div_round(sq * c0 + sxq * c1 + syq * c2, determinant));
    return true;
}

static void expect(const struct ih_labels_scratch *scratch, int32_t slot, struct expectation *out)
{
    int32_t row = slot / IH_GRID;
    int32_t column = slot % IH_GRID;
    out->count = 0;
    for (int32_t dy = -1; dy <= 1; dy++) {
        for (int32_t dx = -1; dx <= 1; dx++) {
            if ((dx != 0 || dy != 0) && labelled_inverse_depth(scratch, row + dy, column + dx,
                                                               &out->value_q36[out->count])) {
                out->count++;
            }
        }
    }
    if (affine_expectation(scratch, row, column, &out->value_q36[out->count])) {
        out->count++;
    }
}

/* hypot(along, 6 perp) against the expectation that suits the candidate best. */
static int32_t growth_error(const struct ih_candidate *candidate,
                            const struct expectation *expected, int32_t length_px_mm_q8)
{
    int64_t off_q36 = INT32_MAX;
    for (int32_t i = 0; i < expected->count; i++) {
        int64_t difference =
            ih_abs_s64((int64_t)candidate->inverse_depth_q36 - expected->value_q36[i]);
        off_q36 = difference < off_q36 ? difference : off_q36;
    }
    int64_t along = ih_mul_shift(off_q36, length_px_mm_q8, 32); /* Q36 Q8 -> Q12 */
    int64_t perp = (int64_t)PERP_WEIGHT * candidate->perp_px_q12;
    along = along > (1 << 28) ? 1 << 28 : along;
    return (int32_t)ih_isqrt_u64((uint64_t)(along * along + perp * perp));
}

static bool has_free_candidate(const struct ih_labels_scratch *scratch, int32_t slot)
{
    for (int32_t i = 0; i < scratch->candidate_count[slot]; i++) {
        if (scratch->slot_of_dot[candidate_of(scratch, slot, i)->dot] == IH_NONE) {
            return true;
        }
    }
    return false;
}

/* The best free candidate of an open slot; false when none is below epsilon. */
static bool find_offer(const struct ih_labels_scratch *scratch, const struct ih_rig *rig,
                       int32_t slot, int32_t epsilon_px_q12, struct ih_labels_offer *out)
{
    struct expectation expected;
    expect(scratch, slot, &expected);
    out->error_px_q12 = epsilon_px_q12;
    out->slot = (int16_t)slot;
    bool found = false;
    for (int8_t i = 0; expected.count > 0 && i < scratch->candidate_count[slot]; i++) {
        const struct ih_candidate *candidate = candidate_of(scratch, slot, i);
        if (scratch->slot_of_dot[candidate->dot] != IH_NONE) {
            continue;
        }
        int32_t error = growth_error(candidate, &expected, rig->line[slot].length_px_mm_q8);
        if (error < out->error_px_q12) {
            out->error_px_q12 = error;
            out->choice[0] = i;
            found = true;
        }
    }
    return found;
}

/* One pass over all open slots; returns how many were labelled. */
static int32_t grow_once(const struct ih_rig *rig, struct ih_labels_scratch *scratch,
                         int32_t epsilon_px_q12)
{
    int32_t count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (scratch->choice[slot] == IH_NONE && has_free_candidate(scratch, slot) &&
            find_offer(scratch, rig, slot, epsilon_px_q12, &scratch->offer[count])) {
            count++;
        }
    }
    sort_offers(scratch->offer, count);
    int32_t assigned = 0;
    for (int32_t i = 0; i < count; i++) {
        const struct ih_labels_offer *offer = &scratch->offer[i];
        if (can_assign(scratch, offer->slot, offer->choice[0])) {
            assign(scratch, offer->slot, offer->choice[0]);
            assigned++;
        }
    }
    return assigned;
}

static void grow(const struct ih_rig *rig, const struct ih_labels_params *params,
                 struct ih_labels_scratch *scratch)
{
    int32_t epsilon = params->epsilon_min_px_q12;
    while (epsilon <= params->epsilon_max_px_q12) {
        if (grow_once(rig, scratch, epsilon) < FEW_ASSIGNED) {
            epsilon += ih_max_s32(epsilon / 2, 1); /* it grows from any start */
        }
    }
}

static void write_table(const struct ih_labels_scratch *scratch, const struct ih_rig *rig,
                        struct ih_labels *out)
{
    out->labelled_count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        out->dot_of_slot[slot] = IH_NONE;
        out->t_px_q12[slot] = 0;
        out->perp_px_q12[slot] = 0;
        if (scratch->choice[slot] != IH_NONE) {
            const struct ih_candidate *c = candidate_of(scratch, slot, scratch->choice[slot]);
            out->dot_of_slot[slot] = c->dot;
            out->t_px_q12[slot] = (int32_t)along_line(scratch, c->dot, &rig->line[slot]);
            IH_IN_RANGE(out->t_px_q12[slot], 1, IH_RANGE_T_PX_Q12);
            out->perp_px_q12[slot] = c->perp_px_q12;
            out->labelled_count++;
        }
    }
}

void ih_labels_assign(const struct ih_dots *dots, const struct ih_rig *rig,
                      const struct ih_labels_params *params, struct ih_labels_scratch *scratch,
                      struct ih_labels *out)
{
    struct dot_range near = {0, 0};
    out->candidates_dropped = 0;
    undistort_dots(dots, rig, scratch);
    order_dots(dots->dot_count, scratch);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        find_candidates(dots, &rig->line[slot], slot, params, &near, scratch, out);
    }
    seed(rig, params, scratch);
    out->seed_count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        out->seed_count += scratch->choice[slot] != IH_NONE;
    }
    grow(rig, params, scratch);
    write_table(scratch, rig, out);
}
