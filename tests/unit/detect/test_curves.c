/* The functions of one number in ih_fit, ih_fit_weights and ih_score over the whole range of their input, against
 * double: exp, ln, the robust weight, the probability. */
#include "detect/ih_ellipsoid.h"
#include "detect/ih_fit_axes.h"
#include "detect/ih_fit_weights.h"
#include "detect/ih_score.h"

#include "ih_test.h"

void setUp(void)
{
}

void tearDown(void)
{
}

/* The rest of the series below 3e-6, as the source says, and half a step. */
static void exp_follows_libm(void)
{
    double worst = 0;
    int32_t ln_q16;

    for (ln_q16 = -IH_FIT_LN_MAX_Q16; ln_q16 <= IH_FIT_LN_MAX_Q16; ln_q16++) {
        const double off = fabs(ih_fit_exp_q16(ln_q16) / 65536.0 - exp(ln_q16 / 6553600.0));

        worst = fmax(worst, off);
    }
    printf("exp: at most %.3g off\n", worst);
    IH_TEST_WITHIN(3e-6 + 0.5 / 65536, 0, worst, "exp", 0);
}

/* Every semi-axis that a fit can have, against each of the mean head's. 3e-4 hundredths, as the source
 * says, and a step of the semi-axis's quotient. */
static void ln_follows_libm(void)
{
    static const int32_t origin_mm_q8[3] = {0};
    const struct ih_ellipsoid mean = ih_ellipsoid_mean(origin_mm_q8);
    double worst = 0;
    int axis;

    for (axis = 0; axis < 3; axis++) {
        const int32_t m = mean.semi_mm_q8[axis];
        int32_t a;

        for (a = (int32_t)ceil(m * exp(-0.35)); a <= m * exp(0.35); a++) {
            worst =
                fmax(worst, fabs(ih_fit_ln_ratio_q16(a, m) / 65536.0 - 100 * log((double)a / m)));
        }
    }
    printf("ln: at most %.3g hundredths off\n", worst);
    IH_TEST_WITHIN(3e-4 + 1.0 / 65536, 0, worst, "ln", 0);
}

static void robust_weights_follow_double(void)
{
    static const int32_t robust_mm[] = {24, 16, 8};
    int step;

    for (step = 0; step < 3; step++) {
        const int32_t k = robust_mm[step];
        const int32_t reach = IH_FIT_SCALES_MAX * k << 8;
        int32_t r;

        for (r = -reach; r <= reach; r++) {
            const double ratio = r / 256.0 / k;
            const double exact = 65536 / ((1 + ratio * ratio) * (1 + ratio * ratio));

            /* half a step of the result, and of its quotient: a half of 2^-16 of (r / k)^2, whose
             * weight falls by at most twice as much */
            IH_TEST_WITHIN(0.5 + 1.0, exact, (double)ih_fit_robust_weight_q16(r, k), "weight", r);
        }
        TEST_ASSERT_TRUE(ih_fit_robust_weight_q16(reach + 1, k) == 0);
        TEST_ASSERT_TRUE(ih_fit_robust_weight_q16(-reach - 1, k) == 0);
    }
}

/* Linear from all at 0.5 semi-axes below the middle to half at 0.8. A unit of Q14 more or less of either
 * end is 6 of Q16. */
static void low_points_count_half(void)
{
    int32_t down_q14;

    for (down_q14 = -131072; down_q14 <= 131072; down_q14++) {
        const double part = (down_q14 / 16384.0 - 0.5) / 0.3;
        const double exact = 65536 * (1 - 0.5 * fmin(fmax(part, 0), 1));

        if (fabs(exact - (double)ih_fit_lowered_weight_q16(65536, down_q14)) > 3) {
            IH_TEST_WITHIN(3, exact, (double)ih_fit_lowered_weight_q16(65536, down_q14), "weight",
                           down_q14);
        }
    }
}

/* A prior's weight is the square of its part of a point's 6 mm: 60 mm of the centre, 0.09 of a logarithm, of
 * which a hundredth is a unit. */
static void priors_weigh_what_they_should(void)
{
    TEST_ASSERT_EQUAL_INT32(floor(65536 * (6.0 / 60) * (6.0 / 60)), IH_FIT_PRIOR_CENTRE_Q16);
    TEST_ASSERT_EQUAL_INT32(floor(65536 * (6.0 / 9) * (6.0 / 9)), IH_FIT_PRIOR_AXES_Q16);
}

/* Monotone, so that what is beyond the ends of the loop lies between them and 0 or 1. */
static void probabilities_follow_libm(void)
{
    int32_t before = -1, logit;
    double worst = 0;

    for (logit = -(1 << 20); logit <= 1 << 20; logit++) {
        const int32_t probability = ih_score_probability_q16(logit);

        TEST_ASSERT_TRUE(probability >= before);
        before = probability;
        worst = fmax(worst, fabs(probability / 65536.0 - 1 / (1 + exp(-logit / 1024.0))));
    }
    printf("probability: at most 2^%.2f off\n", log2(worst));
    IH_TEST_WITHIN(1.0 / 8192, 0, worst, "probability", 0);
    IH_TEST_EQUAL(0, ih_score_probability_q16(-(1 << 20)), "min", 0);
    IH_TEST_EQUAL(0, ih_score_probability_q16(INT32_MIN), "min", 0);
    IH_TEST_EQUAL(65536, ih_score_probability_q16(1 << 20), "max", 0);
    IH_TEST_EQUAL(65536, ih_score_probability_q16(INT32_MAX), "max", 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(exp_follows_libm);
    RUN_TEST(ln_follows_libm);
    RUN_TEST(robust_weights_follow_double);
    RUN_TEST(low_points_count_half);
    RUN_TEST(priors_weigh_what_they_should);
    RUN_TEST(probabilities_follow_libm);
    return UNITY_END();
}
