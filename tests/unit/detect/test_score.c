/* ih_score with tables of the test's own: the learnt ones may change. Curves, weighted sums and all together against
 * tools/learn, the probability against 1 / (1 + exp(-x)). */
#include "detect/ih_evidence.h"
#include "detect/ih_score.h"
#include "detect/ih_surroundings.h"

#include "ih_test.h"

static struct ih_score_tables tables;

struct vector_case {
    int32_t value_q8[IH_EVIDENCE_COUNT], answer_q8[IH_SURROUNDINGS_MAPS];
    double logit;
};

#include "score.inc"

_Static_assert(sizeof vector_curves == sizeof tables.curve, "a curve for each part");
_Static_assert(sizeof vector_weights == sizeof tables.weight_q2, "weights of each map");

static struct ih_evidence evidence;
static int32_t answer_q8[IH_SURROUNDINGS_MAPS];
static struct ih_score score;

void setUp(void)
{
    int part;

    memset(&tables, 0, sizeof tables);
    for (part = 0; part < IH_SCORE_PARTS; part++) {
        tables.curve[part].step_q8 = 256;
    }
    memset(&evidence, 0, sizeof evidence);
    memset(answer_q8, 0, sizeof answer_q8);
    memset(&score, IH_TEST_FILL, sizeof score);
}

void tearDown(void)
{
}

/* Half a unit of Q10 for each curve that is between knots. A place between two knots has 16 bits, on a rise of 2^16 another
 * unit; what measures add to an answer, 8 such places times 2^7 and a rounding to Q8, is off by a unit of Q8 at most, of a
 * step. */
static void log_odds_match_what_was_learnt(void)
{
    int i, part;
    double error = 2 + IH_SCORE_PARTS * 0.5;

    tables.bias_q10 = VECTOR_BIAS_Q10;
    memcpy(tables.curve, vector_curves, sizeof tables.curve);
    memcpy(tables.weight_q2, vector_weights, sizeof tables.weight_q2);
    for (part = IH_EVIDENCE_COUNT; part < IH_SCORE_PARTS; part++) {
        const struct ih_score_curve *curve = &tables.curve[part];
        int32_t steepest = 0;
        int k;

        for (k = 1; k < IH_SCORE_KNOTS; k++) {
            steepest =
                (int32_t)fmax(steepest, fabs((double)curve->at_q10[k] - curve->at_q10[k - 1]));
        }
        error += (double)steepest / curve->step_q8;
    }
    for (i = 0; i < IH_TEST_COUNT(vector_cases); i++) {
        int32_t sum = tables.bias_q10;

        memcpy(evidence.value_q8, vector_cases[i].value_q8, sizeof evidence.value_q8);
        ih_score_rate_by_tables(&tables, &evidence, vector_cases[i].answer_q8, &score);
        IH_TEST_WITHIN(error / 1024, vector_cases[i].logit, ih_test_from_q(score.logit_q10, 10),
                       "logit", i);
        for (part = 0; part < IH_SCORE_PARTS; part++) {
            sum += score.part_q10[part];
        }
        IH_TEST_EQUAL(sum, score.logit_q10, "sum of the parts", i);
        IH_TEST_EQUAL(ih_score_probability_q16(score.logit_q10), score.probability_q16,
                      "probability", i);
    }
}

static int32_t part_at(int32_t value_q8)
{
    evidence.value_q8[3] = value_q8;
    ih_score_rate_by_tables(&tables, &evidence, answer_q8, &score);
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

/* Measures at a knot, half a knot farther, before the first and beyond the last one: each adds its weight times its place to
 * the map that has the weight, and nothing to others. */
static void measures_are_weighed_before_the_curve_of_a_map(void)
{
    static const struct {
        int32_t value_q8, place_q1;
    } cases[] = {{0, 0},         {256, 2},      {384, 3},       {-5000, 0},
                 {INT32_MIN, 0}, {6 * 256, 12}, {INT32_MAX, 12}};
    static const int8_t weights[] = {-128, -1, 1, 127};
    static const struct {
        int map, kind;
    } pairs[] = {{0, 0}, {5, 2}, {IH_SURROUNDINGS_MAPS - 1, IH_EVIDENCE_COUNT - 1}};
    int i, k, pair, map;

    /* A straight line through 0: a unit of Q10 for 64 in Q8, knots 64,000 apart. */
    for (map = 0; map < IH_SURROUNDINGS_MAPS; map++) {
        tables.curve[IH_EVIDENCE_COUNT + map] =
            (struct ih_score_curve){-3 * 64000, 64000, {-3000, -2000, -1000, 0, 1000, 2000, 3000}};
        answer_q8[map] = 64 * map;
    }
    for (pair = 0; pair < IH_TEST_COUNT(pairs); pair++) {
        for (i = 0; i < IH_TEST_COUNT(cases); i++) {
            for (k = 0; k < IH_TEST_COUNT(weights); k++) {
                memset(tables.weight_q2, 0, sizeof tables.weight_q2);
                memset(&evidence, 0, sizeof evidence);
                tables.weight_q2[pairs[pair].map][pairs[pair].kind] = weights[k];
                evidence.value_q8[pairs[pair].kind] = cases[i].value_q8;
                ih_score_rate_by_tables(&tables, &evidence, answer_q8, &score);
                for (map = 0; map < IH_SURROUNDINGS_MAPS; map++) {
                    /* Q2 times half a knot is Q3, of which a unit is 32 in Q8. */
                    const double beside =
                        map == pairs[pair].map ? weights[k] * cases[i].place_q1 / 2.0 : 0;

                    IH_TEST_WITHIN(0.51, map + beside, score.part_q10[IH_EVIDENCE_COUNT + map],
                                   "part", 100 * pair + 10 * i + k);
                }
            }
        }
    }
}

/* All curves at an end, and a bias beyond them; sums as large as they can be. */
static void the_largest_sums_fit(void)
{
    int part, k, sign;

    for (part = 0; part < IH_SCORE_PARTS; part++) {
        for (k = 0; k < IH_SCORE_KNOTS; k++) {
            tables.curve[part].at_q10[k] = (int16_t)(k == 0 ? INT16_MIN : INT16_MAX);
        }
        tables.curve[part].step_q8 = 1;
    }
    for (sign = -1; sign <= 1; sign += 2) {
        memset(tables.weight_q2, sign < 0 ? INT8_MIN : INT8_MAX, sizeof tables.weight_q2);
        tables.bias_q10 = sign * (1 << 18);
        for (k = 0; k < IH_EVIDENCE_COUNT; k++) {
            /* so that all measures are at their last knot: the weights count whole */
            tables.curve[k].at_q10[IH_SCORE_KNOTS - 1] =
                (int16_t)(sign < 0 ? INT16_MIN : INT16_MAX);
            evidence.value_q8[k] = INT32_MAX;
        }
        for (k = 0; k < IH_SURROUNDINGS_MAPS; k++) {
            answer_q8[k] = sign < 0 ? INT32_MIN : INT32_MAX;
        }
        ih_score_rate_by_tables(&tables, &evidence, answer_q8, &score);
        IH_TEST_EQUAL(sign * (1 << 18) + IH_SCORE_PARTS * (sign < 0 ? INT16_MIN : INT16_MAX),
                      score.logit_q10, "sum", sign);
        IH_TEST_EQUAL(sign < 0 ? 0 : 65536, score.probability_q16, "probability", sign);
    }
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
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(value_q8); i++) {
        for (k = 0; k < IH_EVIDENCE_COUNT; k++) {
            evidence.value_q8[k] = value_q8[i];
        }
        for (k = 0; k < IH_SURROUNDINGS_MAPS; k++) {
            answer_q8[k] = value_q8[i];
        }
        ih_score_rate(&evidence, answer_q8, &score);
        bias[i] = score.logit_q10;
        for (k = 0; k < IH_SCORE_PARTS; k++) {
            bias[i] -= score.part_q10[k];
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
    RUN_TEST(measures_are_weighed_before_the_curve_of_a_map);
    RUN_TEST(the_learnt_tables_are_used);
    return UNITY_END();
}
