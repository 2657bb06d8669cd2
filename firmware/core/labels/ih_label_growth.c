#include "labels/ih_label_growth.h"

#include <stdbool.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "labels/ih_label_lines.h"
#include "labels/ih_label_order.h"

/* Growing raises epsilon when a pass assigned fewer than this (paper, section 2.3). */
#define FEW_ASSIGNED 5
#define PERP_WEIGHT 6

/* t in Q12 over length in Q8: 36 + 8 - 12 = 32 more bits give Q36. */
int32_t ih_label_growth_inverse_q36(const struct ih_candidate *candidate,
                                    const struct ih_line *line)
{
    const int32_t inverse_q36 = ih_saturate_s32(
        ih_div_round(candidate->t_px_q12 * ((int64_t)1 << 32), line->length_px_mm_q8));
    IH_IN_RANGE(inverse_q36, 1, IH_RANGE_INVERSE_DEPTH_Q36);
    return inverse_q36;
}

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
        /* Slots without a label are 0 and add nothing; the slot itself is one. */
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

void ih_label_growth_expect(const struct ih_labels_scratch *scratch, int32_t slot,
                            struct ih_label_expectation *out)
{
    const int32_t *at = &scratch->inverse_depth_q36[ih_label_growth_node(slot)];
    out->count = 0;
    for (int32_t dy = -1; dy <= 1; dy++) {
        for (int32_t dx = -1; dx <= 1; dx++) {
            const int32_t q = at[dy * IH_LABELS_LINE + dx];
            out->value_q36[out->count] = q; /* the slot itself is 0: at most 8 */
            out->count += q != 0;
        }
    }
    if (affine_expectation(at, &out->value_q36[out->count])) {
        out->count++;
    }
}

int32_t ih_label_growth_error_px_q12(const struct ih_candidate *candidate,
                                     const struct ih_label_expectation *expected,
                                     const struct ih_line *line)
{
    const int64_t own_q36 = ih_label_growth_inverse_q36(candidate, line);
    int64_t off_q36 = INT32_MAX;
    for (int32_t i = 0; i < expected->count; i++) {
        off_q36 = ih_min_s64(ih_abs_s64(own_q36 - expected->value_q36[i]), off_q36);
    }
    int64_t along = ih_mul_shift(off_q36, line->length_px_mm_q8, 32); /* Q36 Q8 -> Q12 */
    int64_t perp = (int64_t)PERP_WEIGHT * candidate->perp_px_q12;
    along = along > (1 << 28) ? 1 << 28 : along;
    return (int32_t)ih_isqrt_u64((uint64_t)(along * along + perp * perp));
}

/* The best free candidate of an open slot, whatever its error. False: none is free. */
static bool find_offer(const struct ih_labels_scratch *scratch, const struct ih_rig *rig,
                       int32_t slot, struct ih_labels_offer *out)
{
    struct ih_label_expectation expected = {.count = -1}; /* not computed yet */
    out->error_px_q12 = INT32_MAX;
    for (int8_t i = 0; i < scratch->candidate_count[slot]; i++) {
        if (!ih_label_is_free(scratch, slot, i)) {
            continue;
        }
        if (expected.count < 0) {
            ih_label_growth_expect(scratch, slot, &expected);
            out->choice[0] = i;
        }
        const int32_t error =
            expected.count == 0 ? INT32_MAX
                                : ih_label_growth_error_px_q12(ih_label_candidate(scratch, slot, i),
                                                               &expected, &rig->line[slot]);
        if (error < out->error_px_q12) {
            out->error_px_q12 = error;
            out->choice[0] = i;
        }
    }
    return expected.count >= 0;
}

/* A new label: offers around it are stale. */
static void set_inverse_depth(struct ih_labels_scratch *scratch, const struct ih_rig *rig,
                              int32_t slot)
{
    const int32_t node = ih_label_growth_node(slot);
    scratch->inverse_depth_q36[node] = ih_label_growth_inverse_q36(
        ih_label_candidate(scratch, slot, scratch->choice[slot]), &rig->line[slot]);
    for (int32_t dy = -2; dy <= 2; dy++) {
        for (int32_t dx = -2; dx <= 2; dx++) {
            scratch->is_stale[node + dy * IH_LABELS_LINE + dx] = true;
        }
    }
}

void ih_label_growth_begin(const struct ih_rig *rig, struct ih_labels_scratch *scratch)
{
    memset(scratch->inverse_depth_q36, 0, sizeof scratch->inverse_depth_q36);
    memset(scratch->is_stale, true, sizeof scratch->is_stale);
    scratch->open_count = 0;
    for (int32_t row = 0; row < IH_GRID; row++) {
        int32_t *inverse_q36 = &scratch->inverse_depth_q36[ih_label_growth_node(row * IH_GRID)];
        for (int32_t column = 0; column < IH_GRID; column++) {
            const int32_t slot = row * IH_GRID + column;
            const int8_t choice = scratch->choice[slot];
            if (choice == IH_NONE) {
                scratch->open[scratch->open_count++] = (int16_t)slot;
            } else {
                inverse_q36[column] = ih_label_growth_inverse_q36(
                    ih_label_candidate(scratch, slot, choice), &rig->line[slot]);
            }
        }
    }
}

/* Is an open slot's last offer still its best? Other candidates can only have been taken since. */
static bool is_fresh(const struct ih_labels_scratch *scratch, int32_t slot)
{
    return !scratch->is_stale[ih_label_growth_node(slot)] &&
           ih_label_is_free(scratch, slot, scratch->offer[slot].choice[0]);
}

int32_t ih_label_growth_pass(const struct ih_rig *rig, struct ih_labels_scratch *scratch,
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
        scratch->is_stale[ih_label_growth_node(slot)] = false;
        scratch->open[open_count++] = slot;
        if (offer->error_px_q12 < epsilon_px_q12) {
            scratch->order[count++] = ih_label_order(offer->error_px_q12, slot);
        }
    }
    scratch->open_count = open_count;
    ih_label_order_sort(scratch->order, count, scratch->sorted);
    int32_t assigned = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t slot = ih_label_order_slot(scratch->sorted[i]);
        const int8_t choice = scratch->offer[slot].choice[0];
        if (ih_label_is_free(scratch, slot, choice)) {
            ih_label_assign(scratch, slot, choice);
            set_inverse_depth(scratch, rig, slot);
            assigned++;
        }
    }
    return assigned;
}

void ih_label_growth_run(const struct ih_rig *rig, const struct ih_labels_params *params,
                         struct ih_labels_scratch *scratch)
{
    int32_t epsilon = params->epsilon_min_px_q12;
    ih_label_growth_begin(rig, scratch);
    while (epsilon <= params->epsilon_max_px_q12) {
        if (ih_label_growth_pass(rig, scratch, epsilon) < FEW_ASSIGNED) {
            epsilon += ih_max_s32(epsilon / 2, 1); /* it grows from 0, too */
        }
    }
}
