/* ih_align_pairs and ih_align_fit: slopes against differences of the exact motion, the fit against float64. */
#include "align/ih_align_fit.h"
#include "align/ih_align_pairs.h"

#include "ih_test.h"
#include "moved_rig.h"
#include "rigs.inc"

/* What a slot without a dot has. */
#define UNSEEN (-32768)

struct vector_fit {
    int rig;
    const int16_t *across_px_q12; /* by slot */
    int held;                     /* which number is known; -1: none */
    double held_px;
    double moved_px[IH_ALIGN_AXES], sigma_px[IH_ALIGN_AXES];
    double rms_px;
};

#include "align.inc"

static const int32_t scale_px_q12[] = {2048, 1229, 819, 819};
#define NOISE_PX_Q12 819

static struct ih_rig rig;
static struct ih_align_axes axes;
static struct ih_align_pairs pairs;
static struct ih_align_sums sums;
static int32_t prior_px_q12[IH_ALIGN_AXES];
static struct ih_test_random random_source;

void setUp(void)
{
    random_source.state = 19;
}

void tearDown(void)
{
}

static void use_rig(int which)
{
    int32_t bad_slot;

    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &vector_rigs[which], &bad_slot));
    ih_align_axes(&rig, &axes);
    ih_align_prior(&rig, prior_px_q12);
}

/* Undistorted pixel of a dot far away, when one of the five is so many px. */
static void position_of(int which, int slot, int number, double moved_px, double at_px[2])
{
    const struct ih_calibration *c = &vector_rigs[which];
    const struct ih_line *middle = &rig.line[IH_SLOTS / 2];
    const double u = middle->dir_u_q30 / Q30, v = middle->dir_v_q30 / Q30;
    const double focal_px = c->fx_px_q16 / 65536.0, angle_deg = moved_px / focal_px / DEG;
    const double about[3][3] = {{u, v, 0}, {-v, u, 0}, {0, 0, 1}};
    double rotation_deg[3] = {0}, ray[3];

    for (int axis = 0; axis < 3 && number <= IH_ALIGN_ROLL; axis++) {
        rotation_deg[axis] = angle_deg * about[number][axis];
    }
    moved_ray(c, slot, rotation_deg, ray);
    const double scale = number == IH_ALIGN_FOCAL ? 1 + moved_px / focal_px : 1;
    const double shift_px = number == IH_ALIGN_SHIFT ? moved_px : 0;
    at_px[0] = c->fx_px_q16 * scale * ray[0] / ray[2] / 65536 - v * shift_px;
    at_px[1] = c->fy_px_q16 * scale * ray[1] / ray[2] / 65536 + u * shift_px;
}

/* Coordinates and directions have 14 bits there, of numbers up to 4; the result has 12. */
static void slopes_are_those_of_the_motion(void)
{
    for (int which = 0; which < IH_TEST_COUNT(vector_rigs); which++) {
        use_rig(which);
        for (int slot = 0; slot < IH_SLOTS; slot++) {
            int16_t slope_q12[IH_ALIGN_AXES];

            ih_align_slopes(&rig, &axes, slot, slope_q12);
            for (int k = 0; k < IH_ALIGN_AXES; k++) {
                double high[2], low[2];

                position_of(which, slot, k, 0.01, high);
                position_of(which, slot, k, -0.01, low);
                IH_TEST_WITHIN(3.0 / 4096,
                               ((high[1] - low[1]) * rig.line[slot].dir_u_q30 / Q30 -
                                (high[0] - low[0]) * rig.line[slot].dir_v_q30 / Q30) /
                                   0.02,
                               slope_q12[k] / 4096.0, "slope", 10000 * which + 10 * slot + k);
            }
        }
    }
}

/* Degrees, degrees, degrees, and fractions of the focal length: docs/numerics.md. */
static void the_prior_is_in_pixels(void)
{
    static const double prior[IH_ALIGN_AXES] = {DEG, 0.2 * DEG, 1.2 * DEG, 0.012, 0.004};

    for (int which = 0; which < IH_TEST_COUNT(vector_rigs); which++) {
        use_rig(which);
        for (int k = 0; k < IH_ALIGN_AXES; k++) {
            IH_TEST_WITHIN(0.001, prior[k] * rig.calibration.fx_px_q16 / 65536,
                           prior_px_q12[k] / 4096.0, "prior", k);
        }
    }
}

/* Which dots are near a line, one by one: to infinity, however near the working range ends. */
static void dots_near_a_line_are_all_found(void)
{
    static struct ih_dot_rows rows;
    static struct ih_dots dots;

    for (int which = 0; which < IH_TEST_COUNT(vector_rigs); which++) {
        const struct ih_calibration *c = &vector_rigs[which];

        use_rig(which);
        dots.dot_count = 400;
        for (int32_t i = 0; i < dots.dot_count; i++) {
            dots.dot[i].u_px_q12 =
                (int32_t)ih_test_between(&random_source, 0, (c->width - 1) * 4096);
            dots.dot[i].v_px_q12 =
                (int32_t)ih_test_between(&random_source, 0, (c->height - 1) * 4096);
        }
        ih_dot_rows_fill(&dots, &rig, &rows);
        for (int pass = 0; pass < 4; pass++) {
            const struct ih_align_band band = {(int32_t)ih_test_between(&random_source, 1, 60000),
                                               (int32_t)ih_test_between(&random_source, 0, 40960)};
            int32_t first = 0;

            for (int slot = 0; slot < IH_SLOTS; slot++) {
                const struct ih_line *line = &rig.line[slot];
                struct ih_align_dot dot[IH_ALIGN_NEAR_MAX];
                const int32_t found = ih_align_near(&rows, line, band, &first, dot);
                int32_t count = 0;

                for (int32_t i = 0; i < rows.dot_count && count < IH_ALIGN_NEAR_MAX; i++) {
                    const int64_t along = ih_dot_rows_along_px_q12(&rows, i, line);
                    const int64_t across = ih_dot_rows_across_px_q12(&rows, i, line);

                    if (along >= -band.margin_px_q12 &&
                        along <= line->t_near_px_q12 + band.margin_px_q12 &&
                        across < band.half_px_q12 - 4 && -across < band.half_px_q12 - 4) {
                        /* Those within 4 units of the band's edge may be there or not. */
                        while (count < found && dot[count].across_px_q12 != across) {
                            count++;
                        }
                        TEST_ASSERT_LESS_THAN_INT32(found, count);
                        IH_TEST_EQUAL(along, dot[count].along_px_q12, "along", slot);
                        count++;
                    }
                }
                for (int32_t i = 0; i < found; i++) {
                    IH_TEST_RANGE(1 - band.half_px_q12, band.half_px_q12 - 1, dot[i].across_px_q12,
                                  "within the band", slot);
                }
            }
        }
    }
}

static void take_pairs(const int16_t *across_px_q12)
{
    pairs.count = 0;
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        if (across_px_q12[slot] != UNSEEN) {
            struct ih_align_pair *pair = &pairs.pair[pairs.count++];

            ih_align_slopes(&rig, &axes, slot, pair->slope_q12);
            pair->across_px_q12 = across_px_q12[slot];
        }
    }
}

/* Slopes are off by up to 3 units of 2^-12, of which dots make less: numbers differ by some hundredths of what they are
 * uncertain by. */
static void the_fit_is_that_of_float64(void)
{
    for (int i = 0; i < IH_TEST_COUNT(vector_fits); i++) {
        const struct vector_fit *vector = &vector_fits[i];
        int32_t moved_px_q12[IH_ALIGN_AXES] = {0}, sigma_px_q12[IH_ALIGN_AXES];

        use_rig(vector->rig);
        take_pairs(vector->across_px_q12);
        for (int step = 0; step < IH_TEST_COUNT(scale_px_q12); step++) {
            memset(&sums, 0, sizeof sums);
            ih_align_sums_add(&pairs, moved_px_q12, scale_px_q12[step], &sums);
            ih_align_solve(&sums, prior_px_q12, NOISE_PX_Q12, moved_px_q12, sigma_px_q12);
        }
        const struct ih_align_sums seen = sums;
        if (vector->held >= 0) {
            ih_align_sums_hold(&sums, (enum ih_align_axis)vector->held,
                               (int32_t)lround(vector->held_px * 4096));
            ih_align_solve(&sums, prior_px_q12, NOISE_PX_Q12, moved_px_q12, NULL);
        }
        for (int k = 0; k < IH_ALIGN_AXES; k++) {
            IH_TEST_WITHIN(0.02 * vector->sigma_px[k], vector->moved_px[k],
                           moved_px_q12[k] / 4096.0, "moved", 10 * i + k);
            IH_TEST_WITHIN(0.01 * vector->sigma_px[k] + 1.0 / 4096, vector->sigma_px[k],
                           sigma_px_q12[k] / 4096.0, "sigma", 10 * i + k);
        }
        IH_TEST_WITHIN(0.01, vector->rms_px, ih_align_rms_px_q12(&seen, moved_px_q12) / 4096.0,
                       "root mean square", i);
    }
}

/* Of nothing, or of outliers alone, nothing follows. */
static void without_dots_the_prior_stays(void)
{
    int32_t moved_px_q12[IH_ALIGN_AXES] = {0}, sigma_px_q12[IH_ALIGN_AXES];

    for (int pass = 0; pass < 2; pass++) {
        use_rig(pass);
        pairs.count = pass;
        pairs.pair[0] = (struct ih_align_pair){5 * 4096, {4096, 0, 0, 0, 4096}};
        memset(&sums, 0, sizeof sums);
        ih_align_sums_add(&pairs, moved_px_q12, NOISE_PX_Q12, &sums);
        ih_align_solve(&sums, prior_px_q12, NOISE_PX_Q12, moved_px_q12, sigma_px_q12);
        for (int k = 0; k < IH_ALIGN_AXES; k++) {
            IH_TEST_EQUAL(0, moved_px_q12[k], "moved", k);
            IH_TEST_WITHIN(0.03 * prior_px_q12[k], prior_px_q12[k], sigma_px_q12[k], "sigma", k);
        }
        IH_TEST_EQUAL(0, ih_align_rms_px_q12(&sums, moved_px_q12), "root mean square", pass);
    }
}

/* Full tables at the ends of their ranges: nothing overflows (sanitizers), sigmas stay between 0 and the prior. */
static void any_pairs_are_survived(void)
{
    for (int pass = 0; pass < 200; pass++) {
        int32_t moved_px_q12[IH_ALIGN_AXES] = {0}, sigma_px_q12[IH_ALIGN_AXES];

        use_rig(pass % IH_TEST_COUNT(vector_rigs));
        pairs.count = IH_ALIGN_PAIRS_MAX;
        for (int i = 0; i < pairs.count; i++) {
            struct ih_align_pair *pair = &pairs.pair[i];

            pair->across_px_q12 = (int32_t)ih_test_any_size(&random_source, 16);
            for (int k = 0; k < IH_ALIGN_AXES; k++) {
                pair->slope_q12[k] = (int16_t)ih_test_any_size(&random_source, pass % 2 ? 13 : 15);
            }
        }
        for (int step = 0; step < 3; step++) {
            memset(&sums, 0, sizeof sums);
            ih_align_sums_add(&pairs, moved_px_q12, 64 * 4096, &sums);
            ih_align_solve(&sums, prior_px_q12, NOISE_PX_Q12, moved_px_q12, sigma_px_q12);
            for (int k = 0; k < IH_ALIGN_AXES; k++) {
                IH_TEST_RANGE(0, prior_px_q12[k], sigma_px_q12[k], "sigma", k);
            }
            TEST_ASSERT_GREATER_OR_EQUAL_INT32(0, ih_align_rms_px_q12(&sums, moved_px_q12));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(slopes_are_those_of_the_motion);
    RUN_TEST(the_prior_is_in_pixels);
    RUN_TEST(dots_near_a_line_are_all_found);
    RUN_TEST(the_fit_is_that_of_float64);
    RUN_TEST(without_dots_the_prior_stays);
    RUN_TEST(any_pairs_are_survived);
    return UNITY_END();
}
