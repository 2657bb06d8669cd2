/* ih_score - the probability that a candidate is a head, from its evidence (ours; the paper has
 * limits instead).
 *
 * In:     measures (ih_evidence), and answers of maps (ih_surroundings).
 * Out:    log-odds, their parts by measure and by map, and the probability.
 * Method: log-odds = bias + sum of one curve per measure + sum of one curve per map. A curve is piecewise linear over
 *         IH_SCORE_KNOTS equally spaced knots and constant beyond them, so no single number can decide alone, and the parts
 *         show what counted for or against a candidate. A map's curve is of a sum: its answer, and each measure's place on
 *         its own curve times a weight; for what is seen around a head means something else when it is near, or rough. Sums
 *         of curves of weighted sums are projection pursuit regression (Friedman and Stuetzle, 1981). tools/learn learns
 *         maps, weights and curves at once, from rendered scenes and people of true anatomy (model.py); ih_score_weights.h
 *         has them with the command that made them.
 * Overflow: PARTS curves within 2^15 in Q10 and a bias within 2^18: at most 2^21. What the measures add to an answer, 8 times
 *         2^7 times 6 knots: 2^28.6 in Q18.
 * Cost:   a quotient a curve, and a product for each map and measure: 4,200 instructions (x86-64, -O3).
 * Error:  the probability within 2^-13.
 */
#ifndef IH_SCORE_H
#define IH_SCORE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_evidence.h"
#include "detect/ih_surroundings.h"

#define IH_SCORE_KNOTS 7
#define IH_SCORE_PARTS (IH_EVIDENCE_COUNT + IH_SURROUNDINGS_MAPS)

struct ih_score_curve {
    int32_t first_q8, step_q8;      /* evidence at the first knot, and from knot to knot */
    int16_t at_q10[IH_SCORE_KNOTS]; /* part of the log-odds at each knot */
};

/* What was learnt. */
struct ih_score_tables {
    int32_t bias_q10;
    struct ih_score_curve curve[IH_SCORE_PARTS]; /* of the measures, then of the maps */
    int8_t weight_q2[IH_SURROUNDINGS_MAPS][IH_EVIDENCE_COUNT]; /* of a knot, against an answer */
};

struct ih_score {
    int32_t logit_q10;
    int32_t part_q10[IH_SCORE_PARTS]; /* of the log-odds, without the bias */
    int32_t probability_q16;
};

IH_BEGIN_DECLS

/* By what was learnt. */
void ih_score_rate(const struct ih_evidence *evidence,
                   const int32_t answer_q8[IH_SURROUNDINGS_MAPS], struct ih_score *out);

/* By other tables. */
void ih_score_rate_by_tables(const struct ih_score_tables *tables,
                             const struct ih_evidence *evidence,
                             const int32_t answer_q8[IH_SURROUNDINGS_MAPS], struct ih_score *out);

/* 1 / (1 + exp(-logit)). */
int32_t ih_score_probability_q16(int32_t logit_q10);

IH_END_DECLS

#endif
