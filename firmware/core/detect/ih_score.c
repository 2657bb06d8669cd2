#include "detect/ih_score.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "detect/ih_score_weights.h"

int32_t ih_score_probability_q16(int32_t logit_q10)
{
    /* exp(-|logit|) = 2^-(|logit| / ln 2) */
    int64_t small_q16 = ih_power_q16(ih_mul_shift(ih_abs_s64(logit_q10), 94548, 10));
    int64_t likely_q16 = ih_div_round((int64_t)1 << 32, 65536 + small_q16);
    IH_IN_RANGE(likely_q16, 32768, 65536);
    return (int32_t)(logit_q10 >= 0 ? likely_q16 : 65536 - likely_q16);
}

/* Where a value lies on its curve, in knots. */
static int32_t place_q16(const struct ih_score_curve *curve, int32_t value_q8)
{
    int64_t knot_q16 = ih_div_round(((int64_t)value_q8 - curve->first_q8) * 65536, curve->step_q8);
    const int64_t last_q16 = (int64_t)(IH_SCORE_KNOTS - 1) << 16;
    return (int32_t)(knot_q16 < 0 ? 0 : knot_q16 > last_q16 ? last_q16 : knot_q16);
}

static int32_t value_at_q10(const struct ih_score_curve *curve, int32_t knot_q16)
{
    int32_t knot = knot_q16 >> 16;
    if (knot == IH_SCORE_KNOTS - 1) {
        return curve->at_q10[knot];
    }
    int64_t rise = (int64_t)curve->at_q10[knot + 1] - curve->at_q10[knot];
    return curve->at_q10[knot] + (int32_t)ih_mul_shift(rise, knot_q16 & 0xffff, 16);
}

static int32_t leaf_q8(const struct ih_score_tables *tables, const struct ih_score_tree *tree,
                       const uint8_t place[IH_EVIDENCE_COUNT])
{
    int32_t at = 0;
    while (at < IH_SCORE_BRANCHES) {
        const struct ih_score_question *question = &tables->question[tree->question[at]];
        at = 2 * at + 1 + (place[question->kind] >= question->limit);
    }
    return tree->leaf_q8[at - IH_SCORE_BRANCHES];
}

void ih_score_rate_by_tables(const struct ih_score_tables *tables,
                             const struct ih_evidence *evidence, struct ih_score *out)
{
    uint8_t place[IH_EVIDENCE_COUNT];
    out->logit_q10 = tables->bias_q10;
    for (int kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
        const struct ih_score_curve *curve = &tables->curve[kind];
        int32_t knot_q16 = place_q16(curve, evidence->value_q8[kind]);
        place[kind] = (uint8_t)(knot_q16 >> (16 - IH_SCORE_PLACES_LOG2));
        out->part_q10[kind] = value_at_q10(curve, knot_q16);
        out->logit_q10 += out->part_q10[kind];
    }
    int32_t together_q8 = 0;
    for (int i = 0; i < IH_SCORE_TREES; i++) {
        together_q8 += leaf_q8(tables, &tables->tree[i], place);
    }
    out->together_q10 = together_q8 * 4;
    out->logit_q10 += out->together_q10;
    IH_IN_RANGE(out->logit_q10, -IH_RANGE_LOGIT_Q10, IH_RANGE_LOGIT_Q10);
    out->probability_q16 = ih_score_probability_q16(out->logit_q10);
}

void ih_score_rate(const struct ih_evidence *evidence, struct ih_score *out)
{
    ih_score_rate_by_tables(&learnt, evidence, out);
}
