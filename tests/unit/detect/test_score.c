/* ih_score with tables of the test's own: the learnt ones may change. Curves, trees and their sum against
 * tools/learn, the probability against 1 / (1 + exp(-x)). */
#include "detect/ih_evidence.h"
#include "detect/ih_score.h"

#include "ih_test.h"

static struct ih_score_tables tables;

struct vector_case {
    int32_t value_q8[12];
    double logit, together;
};

#include "score.inc"

_Static_assert(VECTOR_KINDS == 12 && VECTOR_KINDS <= IH_EVIDENCE_COUNT, "vector_case has 12");

static struct ih_evidence evidence;
static struct ih_score score;

void setUp(void)
{
    int kind;

    memset(&tables, 0, sizeof tables);
    for (kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
        tables.curve[kind].step_q8 = 256;
    }
    memset(&evidence, 0, sizeof evidence);
    memset(&score, IH_TEST_FILL, sizeof score);
}

void tearDown(void)
{
}

/* Half a unit of Q10 for each curve that is between knots. */
static void log_odds_match_what_was_learnt(void)
{
    int i, kind;

    tables.bias_q10 = VECTOR_BIAS_Q10;
    for (kind = 0; kind < VECTOR_KINDS; kind++) {
        tables.curve[kind] = vector_curves[kind];
    }
    memcpy(tables.question, vector_questions, sizeof tables.question);
    memcpy(tables.tree, vector_trees, sizeof tables.tree);
    for (i = 0; i < IH_TEST_COUNT(vector_cases); i++) {
        int32_t sum = tables.bias_q10;

        for (kind = 0; kind < VECTOR_KINDS; kind++) {
            evidence.value_q8[kind] = vector_cases[i].value_q8[kind];
        }
        ih_score_rate_by_tables(&tables, &evidence, &score);
        /* The place between two knots has 16 bits: on a rise of 2^16 another unit. */
        IH_TEST_WITHIN((VECTOR_KINDS + 2) * 0.5 / 1024, vector_cases[i].logit,
                       ih_test_from_q(score.logit_q10, 10), "logit", i);
        IH_TEST_WITHIN(0, vector_cases[i].together, ih_test_from_q(score.together_q10, 10),
                       "together", i);
        for (kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
            sum += score.part_q10[kind];
        }
        sum += score.together_q10;
        IH_TEST_EQUAL(sum, score.logit_q10, "sum of the parts", i);
        IH_TEST_EQUAL(ih_score_probability_q16(score.logit_q10), score.probability_q16,
                      "probability", i);
    }
}

static int32_t part_at(int32_t value_q8)
{
    evidence.value_q8[3] = value_q8;
    ih_score_rate_by_tables(&tables, &evidence, &score);
    return score.part_q10[3];
}

static void a_curve_goes_through_its_knots_and_is_constant_beyond(void)
{
    static const struct ih_score_curve curve = {
        -1000, 300, {-32768, 5, 32767, -7, 900, -900, 1234}};
    int k;

    tables.curve[3] = curve;
    for (k = 0; k < IH_SCORE_KNOTS; k++) {
        IH_TEST_EQUAL(curve.at_q10[k], part_at(curve.first_q8 + k * curve.step_q8), "knot", k);
    }
    for (k = 0; k < IH_SCORE_KNOTS - 1; k++) { /* halfway */
        IH_TEST_WITHIN(0.51, (curve.at_q10[k] + curve.at_q10[k + 1]) / 2.0,
                       part_at(curve.first_q8 + k * 300 + 150), "between", k);
    }
    IH_TEST_EQUAL(-32768, part_at(curve.first_q8 - 1), "before", 0);
    IH_TEST_EQUAL(-32768, part_at(INT32_MIN), "before", 1);
    IH_TEST_EQUAL(1234, part_at(curve.first_q8 + 6 * 300 + 1), "behind", 0);
    IH_TEST_EQUAL(1234, part_at(INT32_MAX), "behind", 1);
    tables.curve[3].step_q8 = 1; /* the minimum that is learnt */
    IH_TEST_EQUAL(5, part_at(curve.first_q8 + 1), "narrow", 0);
    tables.curve[3].first_q8 = INT32_MAX;
    IH_TEST_EQUAL(-32768, part_at(INT32_MIN), "farthest", 0);
}

/* Every way through a tree ends at its own leaf, and what lies on a limit is beyond it. */
static void a_tree_asks_three_questions(void)
{
    static const struct ih_score_question of_branch[IH_SCORE_BRANCHES] = {
        {1, 1}, {2, 192}, {3, 40}, {4, 7}, {5, 8}, {6, 9}, {7, 10}};
    static const struct ih_score_tree tree = {{255, 0, 77, 254, 13, 128, 9},
                                              {1, 2, -3, 4, 5, -128, 127, 8}};
    int leaf, beside, branch;

    for (branch = 0; branch < IH_SCORE_BRANCHES; branch++) {
        tables.question[tree.question[branch]] = of_branch[branch];
    }
    tables.tree[9] = tree;
    for (leaf = 0; leaf < IH_SCORE_LEAVES; leaf++) {
        for (beside = 0; beside < 2; beside++) {
            int level, at = 0;

            memset(&evidence, 0, sizeof evidence);
            for (level = 2; level >= 0; level--) {
                const int yes = leaf >> level & 1;
                /* 8 in Q8 a place; one less is not beyond the limit. */
                evidence.value_q8[of_branch[at].kind] =
                    yes ? 8 * of_branch[at].limit + 7 * beside
                        : 8 * of_branch[at].limit - 1 - 7 * beside;
                at = 2 * at + 1 + yes;
            }
            ih_score_rate_by_tables(&tables, &evidence, &score);
            IH_TEST_EQUAL(4 * tree.leaf_q8[leaf], score.together_q10, "leaf", leaf);
            IH_TEST_EQUAL(score.together_q10, score.logit_q10, "log-odds", leaf);
        }
    }
}

/* All curves and leaves at an end, and a bias beyond them. */
static void the_largest_sums_fit(void)
{
    int kind, k;

    for (kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
        for (k = 0; k < IH_SCORE_KNOTS; k++) {
            tables.curve[kind].at_q10[k] = INT16_MIN;
        }
    }
    memset(tables.tree, 0, sizeof tables.tree);
    for (k = 0; k < IH_SCORE_TREES; k++) {
        memset(tables.tree[k].leaf_q8, INT8_MIN, sizeof tables.tree[k].leaf_q8);
    }
    tables.bias_q10 = -(1 << 19);
    ih_score_rate_by_tables(&tables, &evidence, &score);
    IH_TEST_EQUAL(-(1 << 19) - IH_EVIDENCE_COUNT * 32768 - IH_SCORE_TREES * 512, score.logit_q10,
                  "sum", 0);
    IH_TEST_EQUAL(0, score.probability_q16, "probability", 0);
}

/* Every log-odds from -40 to 40; beyond that all digits are those of 0 or 1. */
static void probabilities_match_the_closed_form(void)
{
    double worst = 0;
    int32_t logit, last = 0;

    for (logit = -40960; logit <= 40960; logit++) {
        const int32_t probability_q16 = ih_score_probability_q16(logit);
        const double error = fabs(1 / (1 + exp(-logit / 1024.0)) - probability_q16 / 65536.0);

        worst = fmax(worst, error);
        IH_TEST_RANGE(last, 65536, probability_q16, "monotone", logit);
        IH_TEST_EQUAL(65536, probability_q16 + ih_score_probability_q16(-logit), "symmetric",
                      logit);
        last = probability_q16;
    }
    IH_TEST_WITHIN(1.0 / 8192, 0, worst, "worst", 0);
    TEST_ASSERT_EQUAL_INT32(32768, ih_score_probability_q16(0));
}

static void probabilities_are_monotone_to_the_ends(void)
{
    int32_t last = 0;
    int64_t logit;

    for (logit = INT32_MIN; logit <= INT32_MAX; logit += 1000003) {
        const int32_t probability_q16 = ih_score_probability_q16((int32_t)logit);

        IH_TEST_RANGE(last, 65536, probability_q16, "probability", logit);
        last = probability_q16;
    }
    TEST_ASSERT_EQUAL_INT32(0, ih_score_probability_q16(INT32_MIN));
    TEST_ASSERT_EQUAL_INT32(65536, ih_score_probability_q16(INT32_MAX));
}

/* Log-odds by what was learnt are a sum of their parts and a bias that is the same for any evidence. */
static void the_learnt_tables_are_used(void)
{
    static const int32_t value_q8[] = {0, 25600, -25600};
    int32_t bias[IH_TEST_COUNT(value_q8)];
    int i, kind;

    for (i = 0; i < IH_TEST_COUNT(value_q8); i++) {
        for (kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
            evidence.value_q8[kind] = value_q8[i];
        }
        ih_score_rate(&evidence, &score);
        bias[i] = score.logit_q10 - score.together_q10;
        for (kind = 0; kind < IH_EVIDENCE_COUNT; kind++) {
            bias[i] -= score.part_q10[kind];
        }
        IH_TEST_EQUAL(bias[0], bias[i], "bias", i);
    }
    TEST_ASSERT_TRUE(bias[0] != 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(log_odds_match_what_was_learnt);
    RUN_TEST(a_curve_goes_through_its_knots_and_is_constant_beyond);
    RUN_TEST(the_largest_sums_fit);
    RUN_TEST(probabilities_match_the_closed_form);
    RUN_TEST(probabilities_are_monotone_to_the_ends);
    RUN_TEST(a_tree_asks_three_questions);
    RUN_TEST(the_learnt_tables_are_used);
    return UNITY_END();
}
