/* The surface's multiquadric over the whole range of its input, against double: every basis value of a
 * sample's row, every entry of the grid's table. Strides here, all places with --all. */
#include "ih_surface.h"

#include "ih_test.h"

/* In its own words: its functions are static. */
#include "ih_surface.c"

#define PLACE_MOST ((IH_SAMPLES_REACH << 16) - 1)
#define CENTRES IH_SURFACE_CENTRES

static struct ih_surface_scratch scratch;
static bool is_all;
static double worst_steps;

void setUp(void)
{
    memset(&scratch, 0, sizeof scratch);
    worst_steps = 0;
    place_centres(&scratch);
}

void tearDown(void)
{
}

/* Half a step, and what is left of double's 53 bits. The squares are exact in double. */
static void check_basis(int64_t dx_q16, int64_t dy_q16, uint32_t basis_q20)
{
    const double square_q32 = (double)(dx_q16 * dx_q16) + (double)(dy_q16 * dy_q16) + 4294967296.0;
    const double off_steps = fabs(basis_q20 - sqrt(square_q32) * 16.0);

    worst_steps = fmax(worst_steps, off_steps);
    if (off_steps > 0.5 + 1e-6) {
        IH_TEST_WITHIN(0.5 + 1e-6, sqrt(square_q32) * 16.0, basis_q20, "basis, dx", dx_q16);
    }
}

static void check_row(int32_t x_q16, int32_t y_q16)
{
    const struct ih_sample sample = {.x_q16 = x_q16, .y_q16 = y_q16};
    uint32_t row_q20[TERMS];
    int32_t i;

    fill_row(&scratch, &sample, row_q20);
    for (i = 0; i < TERMS; i++) {
        check_basis((int64_t)x_q16 - scratch.centre_q16[i % CENTRES],
                    (int64_t)y_q16 - scratch.centre_q16[i / CENTRES], row_q20[i]);
    }
}

/* Is it the nearest whole number to 16 sqrt(square)? In whole numbers: the square of a root less or more a
 * half. */
static void check_roots(const uint64_t square_q32[IH_BASIS_GROUP])
{
    uint32_t root_q20[IH_BASIS_GROUP + 1];
    int i;

    root_q20[IH_BASIS_GROUP] = 77;
    ih_basis_roots(square_q32, IH_BASIS_GROUP, root_q20);
    for (i = 0; i < IH_BASIS_GROUP; i++) {
        const int64_t root = root_q20[i];
        const int64_t rest = (int64_t)(square_q32[i] << 8) - root * root;

        if (rest > root || rest <= -root) {
            IH_TEST_WITHIN(0.5, sqrt(ldexp((double)square_q32[i], 8)), (double)root, "root", i);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(77, root_q20[IH_BASIS_GROUP]);
}

/* Where the root changes from one whole number to the next: the squares before and behind each such
 * place, for all roots that there are. */
static void roots_change_half_way_between_squares(void)
{
    uint64_t square_q32[IH_BASIS_GROUP];
    int64_t root;
    int i;

    for (root = 1 << 20; root <= IH_RANGE_BASIS_Q20; root += is_all ? 1 : 499) {
        for (i = 0; i < IH_BASIS_GROUP; i++) {
            square_q32[i] = (uint64_t)((root * root + root) / 256 + i - IH_BASIS_GROUP / 2 + 1);
        }
        check_roots(square_q32);
    }
}

/* Places where the number of leading zeros changes, and entries of the table; the least and the greatest. */
static void roots_hold_at_the_ends_of_spans(void)
{
    const uint64_t most = (uint64_t)7201 << 32;
    uint64_t square_q32[IH_BASIS_GROUP];
    uint64_t span;
    int bit, i;

    for (bit = 32; bit <= 44; bit++) {
        for (span = 0; span < 64; span++) {
            for (i = 0; i < IH_BASIS_GROUP; i++) {
                const uint64_t at = ((64 + span) << (bit - 6)) + (uint64_t)i - IH_BASIS_GROUP / 2;

                square_q32[i] = at < (uint64_t)1 << 32 ? (uint64_t)1 << 32 : at > most ? most : at;
            }
            check_roots(square_q32);
        }
    }
}

static void centres_stand_evenly(void)
{
    int32_t k;

    for (k = 0; k < CENTRES; k++) {
        IH_TEST_WITHIN(0.5, (2.0 * k - 11) * 20 * 65536 / 11, scratch.centre_q16[k], "centre", k);
    }
}

/* x through all that ih_samples lets through, at places of y from end to end. */
static void every_place_has_its_basis(void)
{
    static const int32_t y_q16[] = {-PLACE_MOST, -1310721, 0, 1, 119156, PLACE_MOST};
    const int32_t stride = is_all ? 1 : 1021;
    int i;

    for (i = 0; i < IH_TEST_COUNT(y_q16); i++) {
        int32_t x_q16;

        for (x_q16 = -PLACE_MOST; x_q16 <= PLACE_MOST; x_q16 += stride) {
            check_row(x_q16, y_q16[i]);
        }
        check_row(PLACE_MOST, y_q16[i]);
    }
    printf("basis: at most %.7f steps off\n", worst_steps);
}

static void any_place_has_its_basis(void)
{
    struct ih_test_random random = {.state = 77};
    int i;

    for (i = 0; i < (is_all ? 10000000 : 10000); i++) {
        check_row((int32_t)ih_test_between(&random, -PLACE_MOST, PLACE_MOST),
                  (int32_t)ih_test_between(&random, -PLACE_MOST, PLACE_MOST));
    }
}

/* At and beside each centre, where the basis is least. */
static void places_near_centres_have_their_basis(void)
{
    int32_t k, off;

    for (k = 0; k < CENTRES; k++) {
        for (off = -300; off <= 300; off++) {
            check_row(scratch.centre_q16[k] + off, scratch.centre_q16[CENTRES - 1 - k] - off);
        }
    }
}

static void the_table_is_the_basis_at_whole_steps(void)
{
    int a, b;

    fill_table(&scratch);
    for (b = 0; b < IH_SURFACE_STEPS; b++) {
        for (a = 1 - IH_SURFACE_STEPS; a < IH_SURFACE_STEPS; a++) {
            const double exact = sqrt((a * a + b * b) * 100.0 / 121 + 1);

            IH_TEST_WITHIN(0.5 + 1e-6, ldexp(exact, 20),
                           scratch.of.table_q20[b][IH_SURFACE_STEPS - 1 + a], "table", b);
        }
    }
}

int main(int count, char **arguments)
{
    is_all = count == 2 && strcmp(arguments[1], "--all") == 0;
    UNITY_BEGIN();
    RUN_TEST(roots_change_half_way_between_squares);
    RUN_TEST(roots_hold_at_the_ends_of_spans);
    RUN_TEST(centres_stand_evenly);
    RUN_TEST(every_place_has_its_basis);
    RUN_TEST(any_place_has_its_basis);
    RUN_TEST(places_near_centres_have_their_basis);
    RUN_TEST(the_table_is_the_basis_at_whole_steps);
    return UNITY_END();
}
