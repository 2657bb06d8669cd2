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
static int32_t place_q16(const struct ih_score_curve *curve, int64_t value_q8)
{
    int64_t knot_q16 = ih_div_round((value_q8 - curve->first_q8) * 65536, curve->step_q8);
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

/* What the measures add to a map's answer. */
static int32_t beside_q8(const int8_t weight_q2[IH_EVIDENCE_COUNT],
                         const int32_t knot_q16[IH_EVIDENCE_COUNT])
{
    int32_t sum_q18 = 0;
    for (int kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
        sum_q18 += weight_q2[kind] * knot_q16[kind];
    }
    return (int32_t)ih_shift_round(sum_q18, 18 - 8);
}

void ih_score_rate_by_tables(const struct ih_score_tables *tables,
                             const struct ih_evidence *evidence,
                             const int32_t answer_q8[IH_SURROUNDINGS_MAPS], struct ih_score *out)
{
    int32_t knot_q16[IH_EVIDENCE_COUNT];
    out->logit_q10 = tables->bias_q10;
    for (int kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
        const struct ih_score_curve *curve = &tables->curve[kind];
        knot_q16[kind] = place_q16(curve, evidence->value_q8[kind]);
        out->part_q10[kind] = value_at_q10(curve, knot_q16[kind]);
        out->logit_q10 += out->part_q10[kind];
    }
    for (int map = 0; map < IH_SURROUNDINGS_MAPS; map++) {
        const struct ih_score_curve *curve = &tables->curve[IH_EVIDENCE_COUNT + map];
        const int64_t sum_q8 =
            (int64_t)answer_q8[map] + beside_q8(tables->weight_q2[map], knot_q16);
        const int32_t part_q10 = value_at_q10(curve, place_q16(curve, sum_q8));
        out->part_q10[IH_EVIDENCE_COUNT + map] = part_q10;
        out->logit_q10 += part_q10;
    }
    IH_IN_RANGE(out->logit_q10, -IH_RANGE_LOGIT_Q10, IH_RANGE_LOGIT_Q10);
    out->probability_q16 = ih_score_probability_q16(out->logit_q10);
}

void ih_score_rate(const struct ih_evidence *evidence,
                   const int32_t answer_q8[IH_SURROUNDINGS_MAPS], struct ih_score *out)
{
    ih_score_rate_by_tables(&learnt, evidence, answer_q8, out);
}
