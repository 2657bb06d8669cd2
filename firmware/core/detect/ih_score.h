/* ih_score - the probability that a candidate is a head, from its evidence (ours; the paper has
 * limits instead).
 *
 * In:     evidence.
 * Out:    log-odds, their parts by kind of evidence and of what kinds say together, and the probability.
 * Method: log-odds = bias + sum of one curve per kind of evidence + sum of one leaf per tree. A curve is piecewise
 *         linear over IH_SCORE_KNOTS equally spaced knots and constant beyond them, so no single number can
 *         decide alone, and the parts show what counted for or against a candidate. A question asks whether
 *         one kind lies beyond a limit on its curve; a tree asks three out of one list that all trees share, so
 *         that a tree is 15 bytes: what a kind means may depend on others, as few points on a head mean
 *         something else near than far. Curves first, then trees for what they leave, are learnt by tools/learn
 *         from rendered scenes and people of true anatomy; ih_score_weights.h has them with the command that
 *         made them.
 * Overflow: COUNT curves within 2^15 and TREES leaves within 2^9 in Q10: below 2^20.
 * Cost:   three comparisons a tree and a quotient a curve: 7,900 instructions (x86-64, -O3).
 * Error:  the probability within 2^-13.
 */
#ifndef IH_SCORE_H
#define IH_SCORE_H

#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_evidence.h"

#define IH_SCORE_KNOTS 7
#define IH_SCORE_QUESTIONS 256
#define IH_SCORE_TREES 150
/* Branches of a tree: the first one, and from branch i on 2i + 1 follows where the answer is no, 2i + 2 where it is yes.
 * Its leaves, from no to yes. */
#define IH_SCORE_BRANCHES 7
#define IH_SCORE_LEAVES (IH_SCORE_BRANCHES + 1)
/* Parts of a knot's step in which limits are given. */
#define IH_SCORE_PLACES_LOG2 5

struct ih_score_curve {
    int32_t first_q8, step_q8;      /* evidence at the first knot, and from knot to knot */
    int16_t at_q10[IH_SCORE_KNOTS]; /* part of the log-odds at each knot */
};

struct ih_score_question {
    uint8_t kind;
    uint8_t limit; /* yes: the kind's place on its curve, 0 to 6 * 32, is this one or beyond */
};

struct ih_score_tree {
    uint8_t question[IH_SCORE_BRANCHES];
    int8_t leaf_q8[IH_SCORE_LEAVES];
};

/* What was learnt. */
struct ih_score_tables {
    int32_t bias_q10;
    struct ih_score_curve curve[IH_EVIDENCE_COUNT];
    struct ih_score_question question[IH_SCORE_QUESTIONS];
    struct ih_score_tree tree[IH_SCORE_TREES];
};

struct ih_score {
    int32_t logit_q10;
    int32_t part_q10[IH_EVIDENCE_COUNT]; /* of the log-odds, without the bias and the trees */
    int32_t together_q10;                /* the trees' part */
    int32_t probability_q16;
};

IH_BEGIN_DECLS

/* By what was learnt. */
void ih_score_rate(const struct ih_evidence *evidence, struct ih_score *out);

/* By other tables. */
void ih_score_rate_by_tables(const struct ih_score_tables *tables,
                             const struct ih_evidence *evidence, struct ih_score *out);

/* 1 / (1 + exp(-logit)). */
int32_t ih_score_probability_q16(int32_t logit_q10);

IH_END_DECLS

#endif
