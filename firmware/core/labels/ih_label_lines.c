#include "labels/ih_label_lines.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"

/* A dot's centre may be off by this along the line and still belong to the working range. */
#define RANGE_MARGIN_PX_Q12 2048

/* Reading order: by row, then column. */
static bool reads_before(const struct ih_dot *a, const struct ih_dot *b)
{
    return a->v_px_q12 != b->v_px_q12 ? a->v_px_q12 < b->v_px_q12 : a->u_px_q12 < b->u_px_q12;
}

void ih_label_lines_add_candidate(const struct ih_dots *dots, struct ih_candidate candidate,
                                  int32_t slot, struct ih_labels_scratch *scratch,
                                  struct ih_labels *out)
{
    struct ih_candidate *list = scratch->candidate[slot];
    const int16_t *by_row = scratch->rows->dot;
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

/* The rows of a line's candidates: those of its ends, which the margins move by at most their sum; 4 units
 * for rounding. Infinity is within 2^27.6, an end within 2^27.9 of it. */
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
    int64_t perp = ih_dot_rows_across_px_q12(scratch->rows, dot, line);
    if (ih_abs_s64(perp) > params->perp_max_px_q12) {
        return;
    }
    int64_t t = ih_dot_rows_along_px_q12(scratch->rows, dot, line);
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
    ih_label_lines_add_candidate(dots, candidate, slot, scratch, out);
}

void ih_label_lines_find(const struct ih_dots *dots, const struct ih_rig *rig,
                         const struct ih_labels_params *params, struct ih_labels_scratch *scratch,
                         struct ih_labels *out)
{
    int32_t first = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_line *line = &rig->line[slot];
        const struct row_range range = rows_of_line(line, params);
        first = ih_dot_rows_count_above(scratch->rows, range.first_px_q12, first);
        scratch->candidate_count[slot] = 0;
        scratch->choice[slot] = IH_NONE;
        for (int32_t i = first;
             i < dots->dot_count && scratch->rows->v_px_q12[i] <= range.last_px_q12; i++) {
            try_candidate(dots, line, slot, i, params, scratch, out);
        }
    }
}
