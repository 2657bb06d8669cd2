/* The surface's multiquadric over the whole range of its input, against double: every basis value of a
 * sample's row, every entry of the grid's table. Strides here, all places with --all. */
#include "base/ih_config.h"
#include "base/ih_range.h"
#include "surface/ih_multiquadric.h"
#include "surface/ih_normal_equations.h"
#include "surface/ih_samples.h"
#include "surface/ih_surface.h"
#include "surface/ih_surface_grid.h"
#include "surface/ih_surface_rows.h"
#include "surface/ih_surface_scratch.h"

#include "ih_test.h"

#define TERMS_MAX IH_SURFACE_TERMS_MAX
#define CENTRES_MAX IH_SURFACE_CENTRES_MAX
#define POSITION_MAX ((IH_SAMPLES_REACH << 16) - 1)
#define SQUARE_MAX (7201 << 18)
/* Of ih_multiquadric.h. */
#define RELATIVE ldexp(1, -21) * 0.574 /* 2^-21.8 */

static struct ih_surface_scratch scratch;
static bool is_all;
static double worst_steps;
/* Centres in a row: every test is made with many and with few. */
static int32_t centres = IH_SURFACE_CENTRES_MAX;

void setUp(void)
{
    memset(&scratch, 0, sizeof scratch);
    worst_steps = 0;
    ih_surface_rows_set_centres(&(struct ih_surface_params){.centres = centres}, &scratch);
}

void tearDown(void)
{
}

/* One step down, the table's error, and what was cut off both squares, of Q18, as of one. */
static void check_basis(int64_t dx_q16, int64_t dy_q16, uint32_t basis_q20)
{
    const double square_q32 = (double)(dx_q16 * dx_q16) + (double)(dy_q16 * dy_q16) + 4294967296.0;
    const double exact_q20 = sqrt(square_q32) * 16.0;
    const double off_steps = basis_q20 - exact_q20;
    const double squares_steps = 2 * 16384.0 * 128 / exact_q20;

    worst_steps = fmax(worst_steps, fabs(off_steps));
    if (off_steps > RELATIVE * exact_q20 || off_steps < -1 - RELATIVE * exact_q20 - squares_steps) {
        IH_TEST_WITHIN(1 + RELATIVE * exact_q20, exact_q20, basis_q20, "basis, dx", dx_q16);
    }
}

static void check_row(int32_t x_q16, int32_t y_q16)
{
    const struct ih_sample sample = {.x_q16 = x_q16, .y_q16 = y_q16};
    uint32_t row_q20[TERMS_MAX];
    int32_t i;

    ih_surface_rows_fill(&scratch, &sample, row_q20);
    for (i = 0; i < centres * centres; i++) {
        check_basis((int64_t)x_q16 - scratch.centre_q16[i % centres],
                    (int64_t)y_q16 - scratch.centre_q16[i / centres], row_q20[i]);
    }
}

static void check_roots(const uint32_t square_q18[IH_MULTIQUADRIC_ACROSS_MAX])
{
    static const uint32_t down_q18[2] = {0, 0};
    uint32_t root_q20[2 * IH_MULTIQUADRIC_ACROSS_MAX + 1];
    int i;

    root_q20[2 * centres] = 77;
    ih_multiquadric_roots(square_q18, centres, down_q18, 2, root_q20);
    for (i = 0; i < 2 * centres; i++) {
        const double exact_q20 = sqrt(square_q18[i % centres]) * 2048;
        const double off_steps = root_q20[i] - exact_q20;

        if (off_steps > RELATIVE * exact_q20 || off_steps < -1 - RELATIVE * exact_q20) {
            IH_TEST_WITHIN(1 + RELATIVE * exact_q20, exact_q20, root_q20[i], "root",
                           square_q18[i % centres]);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(77, root_q20[2 * centres]);
}

/* Squares from end to end. */
static void every_square_has_its_root(void)
{
    uint32_t square_q18[IH_MULTIQUADRIC_ACROSS_MAX];
    int64_t square;
    int i;

    for (square = 1 << 18; square <= SQUARE_MAX; square += is_all ? centres : 9973) {
        for (i = 0; i < centres; i++) {
            square_q18[i] = (uint32_t)(square + i < SQUARE_MAX ? square + i : SQUARE_MAX);
        }
        check_roots(square_q18);
    }
}

/* Squares where the number of leading zeros changes, and at entries of the table; the smallest and the largest. */
static void roots_hold_at_the_ends_of_spans(void)
{
    uint32_t square_q18[IH_MULTIQUADRIC_ACROSS_MAX];
    uint64_t span;
    int bit, i;

    for (bit = 18; bit <= 30; bit++) {
        for (span = 0; span < 512; span++) {
            for (i = 0; i < centres; i++) {
                const uint64_t at =
                    ((512 + span) << bit >> 9) + (uint64_t)i - (uint64_t)(centres / 2);

                square_q18[i] = (uint32_t)(at < 1 << 18      ? 1 << 18
                                           : at > SQUARE_MAX ? SQUARE_MAX
                                                             : at);
            }
            check_roots(square_q18);
        }
    }
}

/* Each line has its own second square. */
static void lines_are_roots_of_sums(void)
{
    uint32_t across_q18[IH_MULTIQUADRIC_ACROSS_MAX], down_q18[4],
        together_q18[IH_MULTIQUADRIC_ACROSS_MAX];
    uint32_t root_q20[4 * IH_MULTIQUADRIC_ACROSS_MAX], expected_q20[2 * IH_MULTIQUADRIC_ACROSS_MAX];
    static const uint32_t none[2] = {0, 0};
    int32_t i, k;

    for (i = 0; i < centres; i++) {
        across_q18[i] = (uint32_t)((i + 1) * (i + 1)) << 20;
    }
    for (k = 0; k < 4; k++) {
        down_q18[k] = (uint32_t)(k * k) << 21;
    }
    ih_multiquadric_roots(across_q18, centres, down_q18, 4, root_q20);
    for (k = 0; k < 4; k++) {
        for (i = 0; i < centres; i++) {
            together_q18[i] = across_q18[i] + down_q18[k];
        }
        ih_multiquadric_roots(together_q18, centres, none, 2, expected_q20);
        TEST_ASSERT_EQUAL_UINT32_ARRAY(expected_q20, &root_q20[k * centres], (uint32_t)centres);
    }
}

/* Sums of products against whole numbers one by one, at both ends of their factors, of one row and of several. */
static void sums_are_exact(void)
{
    static uint32_t basis_q20[IH_MULTIQUADRIC_ROWS * IH_MULTIQUADRIC_TERMS_MAX];
    static int32_t coefficient[IH_MULTIQUADRIC_TERMS_MAX];
    static int64_t added[IH_MULTIQUADRIC_TERMS_MAX + 1], expected[IH_MULTIQUADRIC_TERMS_MAX];
    struct ih_test_random random = {.state = 5};
    const int32_t terms = centres * centres;
    int round, i, k;

    memset(added, 0, sizeof added);
    memset(expected, 0, sizeof expected);
    for (round = 0; round < 400; round++) {
        const int32_t rows = 1 + round % IH_MULTIQUADRIC_ROWS;
        const bool is_end = round / IH_MULTIQUADRIC_ROWS % 5 == 0;
        const int32_t max = is_end ? 1 << 28 : 1 << (round % 28);
        const int32_t end = round % 8 < 4 ? max : -max;
        int64_t sum[IH_MULTIQUADRIC_ROWS], expected_sum[IH_MULTIQUADRIC_ROWS] = {0};
        int32_t factor[IH_MULTIQUADRIC_ROWS];

        for (i = 0; i < terms; i++) {
            coefficient[i] = is_end ? end : (int32_t)ih_test_between(&random, -max, max);
        }
        for (k = 0; k < rows; k++) {
            factor[k] = is_end ? end / 2 : (int32_t)ih_test_between(&random, -(1 << 27), 1 << 27);
            for (i = 0; i < terms; i++) {
                const int32_t basis =
                    is_end ? IH_RANGE_BASIS_Q20
                           : (int32_t)ih_test_between(&random, 0, IH_RANGE_BASIS_Q20);

                basis_q20[k * terms + i] = (uint32_t)basis;
                expected_sum[k] += (int64_t)basis * coefficient[i];
                expected[i] += (int64_t)basis * factor[k];
            }
        }
        ih_multiquadric_sum(basis_q20, rows, coefficient, terms, sum);
        for (k = 0; k < rows; k++) {
            IH_TEST_EQUAL(expected_sum[k], sum[k], "sum", round);
        }
        added[terms] = 77;
        ih_multiquadric_add(basis_q20, rows, factor, added, terms);
        for (i = 0; i < terms; i++) {
            IH_TEST_EQUAL(expected[i], added[i], "added", i);
        }
        IH_TEST_EQUAL(77, added[terms], "behind what was added", round);
    }
}

/* Half a row of nodes, of widths with whole blocks of vectors and others. */
static void sums_along_nodes_are_exact(void)
{
    static uint32_t line_q20[CENTRES_MAX][IH_SURFACE_HALF_CENTRES_MAX * 32];
    static int32_t coefficient[TERMS_MAX / 2];
    const uint32_t *lines_q20[CENTRES_MAX];
    struct ih_test_random random = {.state = 6};
    const int32_t half = centres / 2;
    int round, i, k, x;

    for (round = 0; round < 100; round++) {
        const int32_t width = 8 * (1 + round % 4);
        const int32_t max = round % 4 == 0 ? 1 << 28 : 1 << (round % 28);
        const int64_t begin = ih_test_between(&random, -((int64_t)1 << 60), (int64_t)1 << 60);
        int64_t sum[33];

        for (k = 0; k < centres; k++) {
            lines_q20[k] = line_q20[k];
            for (i = 0; i < half * width; i++) {
                line_q20[k][i] = round % 5 == 0 ? 1u << (28 - k % 2)
                                                : (uint32_t)ih_test_between(&random, 0, 1 << 28);
            }
            for (i = 0; i < half; i++) {
                coefficient[k * half + i] = round % 5 == 0
                                                ? (k % 2 == 0 ? max : -max)
                                                : (int32_t)ih_test_between(&random, -max, max);
            }
        }
        sum[width] = 77;
        ih_multiquadric_lines(coefficient, lines_q20, centres, half, width, begin, sum);
        for (x = 0; x < width; x++) {
            int64_t expected = begin;

            for (k = 0; k < centres; k++) {
                for (i = 0; i < half; i++) {
                    expected += (int64_t)coefficient[k * half + i] * line_q20[k][i * width + x];
                }
            }
            IH_TEST_EQUAL(expected, sum[x], "along nodes", x);
        }
        IH_TEST_EQUAL(77, sum[width], "behind the nodes", round);
    }
}

static void centres_stand_evenly(void)
{
    int32_t k;

    for (k = 0; k < centres; k++) {
        IH_TEST_WITHIN(0.5, (2.0 * k - (centres - 1)) * (24.0 / centres) * 65536 * 10 / 11,
                       scratch.centre_q16[k], "centre", k);
    }
}

/* x through all that ih_samples lets through, at places of y from end to end. */
static void every_place_has_its_basis(void)
{
    static const int32_t y_q16[] = {-POSITION_MAX, -1310721, 0, 1, 119156, POSITION_MAX};
    const int32_t stride = is_all ? 1 : 1021;
    int i;

    for (i = 0; i < IH_TEST_COUNT(y_q16); i++) {
        int32_t x_q16;

        for (x_q16 = -POSITION_MAX; x_q16 <= POSITION_MAX; x_q16 += stride) {
            check_row(x_q16, y_q16[i]);
        }
        check_row(POSITION_MAX, y_q16[i]);
    }
    printf("basis: at most %.7f steps off\n", worst_steps);
}

static void any_place_has_its_basis(void)
{
    struct ih_test_random random = {.state = 77};
    int i;

    for (i = 0; i < (is_all ? 10000000 : 10000); i++) {
        check_row((int32_t)ih_test_between(&random, -POSITION_MAX, POSITION_MAX),
                  (int32_t)ih_test_between(&random, -POSITION_MAX, POSITION_MAX));
    }
}

/* At and beside each centre, where the basis is least. */
static void places_near_centres_have_their_basis(void)
{
    int32_t k, off;

    for (k = 0; k < centres; k++) {
        for (off = -300; off <= 300; off++) {
            check_row(scratch.centre_q16[k] + off, scratch.centre_q16[centres - 1 - k] - off);
        }
    }
}

static void the_table_is_the_basis_at_whole_steps(void)
{
    int a, b;

    ih_surface_grid_fill_table(&scratch);
    for (b = 0; b < IH_SURFACE_STEPS; b++) {
        for (a = 1 - IH_SURFACE_STEPS; a < IH_SURFACE_STEPS; a++) {
            const double exact_q20 = ldexp(sqrt((a * a + b * b) * 100.0 / 121 + 1), 20);

            /* Half a step of both squares, as of one; one down; the table's error. */
            IH_TEST_WITHIN(0.5 + RELATIVE * exact_q20 + 4194304 / exact_q20, exact_q20 - 0.5,
                           scratch.of.grid.table_q20[b][IH_SURFACE_STEPS - 1 + a], "table", b);
        }
    }
}

/* One sample in ten has a third of its root weight. */
static int32_t changed_weight(const struct ih_samples *samples, int32_t i)
{
    const int32_t root_q15 = samples->sample[i].root_weight_q15;

    return i % 10 == 3 ? root_q15 / 3 : root_q15;
}

/* Rows are subtracted and added as short rows: the exchanged sums differ from new ones by the rounding of each call
 * only, half a unit. */
static void exchanged_sums_are_those_of_the_new_weights(void)
{
    static struct ih_samples samples;
    static struct ih_surface out;
    static int32_t exchanged[IH_NORMAL_EQUATIONS_LINE(TERMS_MAX)];
    struct ih_surface_params params;
    struct ih_test_random source = {5};
    int32_t i, calls, count = 0;

    ih_surface_params_default(&params);
    params.centres = centres;
    params.is_moving = false;
    ih_surface_rows_set_centres(&params, &scratch);
    samples.sample_count = 340;
    for (i = 0; i < samples.sample_count; i++) {
        samples.sample[i] = (struct ih_sample){
            .x_q16 = (int32_t)ldexp(2.0 * (i % IH_GRID - 9) + 0.3 * ih_test_unit(&source), 16),
            .y_q16 = (int32_t)ldexp(2.0 * (i / IH_GRID - 9) + 0.3 * ih_test_unit(&source), 16),
            .depth_mm_q8 = 1000 << 8,
            .root_weight_q15 = i % 7 == 0 ? 18000 : 1 << 15,
        };
        out.root_weight_q15[i] = samples.sample[i].root_weight_q15;
    }
    TEST_ASSERT_TRUE(ih_surface_rows_set_weight_shift(&scratch, out.root_weight_q15, 340));
    (void)ih_surface_rows_set_norms(&scratch, &samples, out.root_weight_q15);
    ih_surface_rows_set_scale(&scratch, &samples);
    ih_surface_rows_sum(&samples, &params, &scratch, &out);
    for (i = 0; i < samples.sample_count; i++) {
        const int32_t before_q15 = out.root_weight_q15[i];

        out.root_weight_q15[i] = changed_weight(&samples, i);
        if (out.root_weight_q15[i] != before_q15) {
            ih_surface_rows_exchange(&scratch, ih_surface_rows_of(&samples, i, &scratch), count++,
                                     before_q15, out.root_weight_q15[i]);
        }
    }
    ih_surface_rows_finish_exchange(&scratch, count);
    calls = (count + IH_NORMAL_EQUATIONS_PAIRS - 1) / IH_NORMAL_EQUATIONS_PAIRS;
    IH_TEST_RANGE(2, 40, calls, "calls that exchange", 0);
    memcpy(exchanged, scratch.normal,
           (size_t)IH_NORMAL_EQUATIONS_LINE(scratch.terms) * sizeof exchanged[0]);
    ih_surface_rows_sum(&samples, &params, &scratch, &out);
    calls += 2 * ((samples.sample_count + IH_NORMAL_EQUATIONS_ROWS - 1) / IH_NORMAL_EQUATIONS_ROWS);
    for (i = 0; i < scratch.terms; i++) {
        const int32_t at = ih_normal_equations_line(i);
        int32_t j;

        for (j = 0; j <= i; j++) {
            IH_TEST_WITHIN(calls / 2.0, scratch.normal[at + j], exchanged[at + j], "sum",
                           i * scratch.terms + j);
        }
    }
}

int main(int count, char **arguments)
{
    int pass;

    is_all = count == 2 && strcmp(arguments[1], "--all") == 0;
    UNITY_BEGIN();
    for (pass = 0; pass < 2; pass++) {
        centres = pass == 0 ? IH_SURFACE_CENTRES_MAX : IH_SURFACE_CENTRES_FEW;
        RUN_TEST(every_square_has_its_root);
        RUN_TEST(roots_hold_at_the_ends_of_spans);
        RUN_TEST(lines_are_roots_of_sums);
        RUN_TEST(sums_are_exact);
        RUN_TEST(sums_along_nodes_are_exact);
        RUN_TEST(centres_stand_evenly);
        RUN_TEST(every_place_has_its_basis);
        RUN_TEST(any_place_has_its_basis);
        RUN_TEST(places_near_centres_have_their_basis);
        RUN_TEST(the_table_is_the_basis_at_whole_steps);
        RUN_TEST(exchanged_sums_are_those_of_the_new_weights);
    }
    return UNITY_END();
}
