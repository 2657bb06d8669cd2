/* ih_score - the probability that a candidate is a head, from its evidence (ours; the paper has
 * limits instead).
 *
 * In:     evidence.
 * Out:    log-odds, their parts by kind of evidence, and the probability.
 * Method: log-odds = bias + sum of one curve per kind of evidence. A curve is piecewise linear over
 *         IH_SCORE_KNOTS equally spaced knots and constant beyond them, so no single number can
 *         decide alone, and the parts show what counted for or against a candidate. The
 *         curves are learnt from rendered scenes by tools/learn; ih_score_weights.h has them with
 *         the command that made them.
 * Overflow: COUNT curves within 2^15 in Q10: below 2^20.
 * Error:  the probability within 2^-13.
 */
#ifndef IH_SCORE_H
#define IH_SCORE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_evidence.h"

#define IH_SCORE_KNOTS 7

struct ih_score_curve {
    int32_t first_q8, step_q8;      /* evidence at the first knot, and from knot to knot */
    int16_t at_q10[IH_SCORE_KNOTS]; /* part of the log-odds at each knot */
};

struct ih_score {
    int32_t logit_q10;
    int32_t part_q10[IH_EVIDENCE_COUNT]; /* of the log-odds, without the bias */
    int32_t probability_q16;
};

IH_BEGIN_DECLS

/* By the learnt curves. */
void ih_score_rate(const struct ih_evidence *evidence, struct ih_score *out);

/* By other curves, one for each kind of evidence. */
void ih_score_rate_by_curves(const struct ih_score_curve curve[IH_EVIDENCE_COUNT], int32_t bias,
                             const struct ih_evidence *evidence, struct ih_score *out);

/* 1 / (1 + exp(-logit)). */
int32_t ih_score_probability_q16(int32_t logit_q10);

IH_END_DECLS

#endif
