/* ih_normal_equations against sums of products one by one. */
#include "surface/ih_normal_equations.h"
#include "surface/ih_normal_solve.h"

#include "ih_test.h"

#define PAIRS IH_NORMAL_EQUATIONS_PAIRS
#define ROWS IH_NORMAL_EQUATIONS_ROWS
#define TERMS_MAX IH_NORMAL_EQUATIONS_TERMS_MAX
#define ENTRIES_MAX IH_NORMAL_EQUATIONS_LINE(TERMS_MAX)
#define MARK 0x12345678

static int32_t row[ROWS][TERMS_MAX];
static _Alignas(IH_NORMAL_EQUATIONS_ALIGNMENT) uint32_t pair[PAIRS][TERMS_MAX];
static int32_t normal[ENTRIES_MAX + 1], expected[ENTRIES_MAX + 1];
static int32_t kept[ROWS][TERMS_MAX];
static int32_t factor[ENTRIES_MAX + 1];
static _Alignas(IH_NORMAL_EQUATIONS_ALIGNMENT) uint32_t work[IH_NORMAL_EQUATIONS_WORK][TERMS_MAX];
static double matrix[TERMS_MAX][TERMS_MAX], product[TERMS_MAX][TERMS_MAX];
static struct ih_test_random random_source;
/* Every test runs with the maximum number of terms, and with fewer. */
static int32_t terms = TERMS_MAX;

static int32_t entries(void)
{
    return IH_NORMAL_EQUATIONS_LINE(terms);
}

void setUp(void)
{
    random_source.state = 91;
    memset(row, 0, sizeof row);
    memset(normal, 0, sizeof normal);
    memset(expected, 0, sizeof expected);
}

void tearDown(void)
{
}

static void fill_rows(int32_t min, int32_t max)
{
    int32_t k, i;

    for (k = 0; k < ROWS; k++) {
        for (i = 0; i < terms; i++) {
            row[k][i] = (int32_t)ih_test_between(&random_source, min, max);
        }
    }
}

static void pair_rows(void)
{
    int32_t k, i;

    for (k = 0; k < PAIRS; k++) {
        for (i = 0; i < terms; i++) {
            pair[k][i] = (uint32_t)row[2 * k][i] | (uint32_t)row[2 * k + 1][i] << 16;
        }
    }
}

/* The sum over all rows to its nearest unit, halves up. */
static int32_t product_sum(int32_t i, int32_t j, int shift)
{
    int64_t sum = 0;
    int32_t k;

    for (k = 0; k < ROWS; k++) {
        sum += (int64_t)row[k][i] * row[k][j];
    }
    return (int32_t)floor(ldexp((double)sum, -shift) + 0.5);
}

/* Entries up to the diagonal; padding behind it is undefined. */
static void check(int sign, int shift, const char *what)
{
    int32_t i, j;

    pair_rows();
    if (sign > 0) {
        ih_normal_equations_add(pair, terms, shift, normal);
    } else {
        ih_normal_equations_subtract(pair, terms, shift, normal);
    }
    for (i = 0; i < terms; i++) {
        for (j = 0; j <= i; j++) {
            const int32_t at = ih_normal_equations_line(i) + j;

            expected[at] += sign * product_sum(i, j, shift);
            if (normal[at] != expected[at]) {
                IH_TEST_EQUAL(expected[at], normal[at], what, at);
            }
        }
    }
}

static void lines_follow_each_other(void)
{
    int32_t i;

    IH_TEST_EQUAL(0, ih_normal_equations_line(0), "line", 0);
    for (i = 1; i < terms; i++) {
        const int32_t before = ih_normal_equations_line(i - 1);

        IH_TEST_RANGE(before + i, before + i + IH_NORMAL_EQUATIONS_GROUP,
                      ih_normal_equations_line(i), "line", i);
        if (i % IH_NORMAL_EQUATIONS_GROUP == 0) {
            IH_TEST_EQUAL(IH_NORMAL_EQUATIONS_LINE(i), ih_normal_equations_line(i),
                          "line of a group", i);
        }
    }
    IH_TEST_RANGE(ih_normal_equations_line(terms - 1) + terms, entries(), entries(), "size", 0);
}

static void sums_are_rounded_once_a_call(void)
{
    int shift;

    for (shift = 1; shift <= IH_NORMAL_EQUATIONS_SHIFT_MAX; shift++) {
        setUp();
        fill_rows(0, IH_NORMAL_EQUATIONS_MAX >> (shift == 1));
        check(1, shift, "sum");
        fill_rows(0, 100);
        check(1, shift, "small sum");
    }
}

/* 16 times the largest square, as often as the header allows. */
static void max_sums_hold(void)
{
    int32_t call;

    for (call = 0; call < 16; call++) {
        fill_rows(IH_NORMAL_EQUATIONS_MAX, IH_NORMAL_EQUATIONS_MAX);
        check(1, 5, "largest");
    }
    TEST_ASSERT_TRUE(normal[0] > 2147000000);
}

static void sums_are_subtracted(void)
{
    int round;

    for (round = 0; round < 5; round++) {
        fill_rows(0, IH_NORMAL_EQUATIONS_MAX);
        check(-1, 6, "taken away");
    }
    memset(normal, 0, sizeof normal);
    memset(expected, 0, sizeof expected);
    fill_rows(IH_NORMAL_EQUATIONS_MAX, IH_NORMAL_EQUATIONS_MAX);
    check(-1, 2, "the most taken away");
    check(1, 2, "and added again");
    TEST_ASSERT_EQUAL_INT32(0, normal[0]);
}

/* Each row at each place: none is left out, none is taken twice. */
static void every_row_counts_once(void)
{
    int32_t k, i, sign;

    for (sign = -1; sign <= 1; sign += 2) {
        for (k = 0; k < ROWS; k++) {
            memset(row, 0, sizeof row);
            for (i = 0; i < terms; i++) {
                row[k][i] = 2 * i + 1;
            }
            check(sign, 1, "one row");
        }
    }
}

/* What was added and is taken away in other company leaves no more than each rounding's half. */
static void what_was_added_can_be_subtracted(void)
{
    int32_t k, i;

    for (k = 0; k < 20; k++) {
        int32_t half;

        fill_rows(0, IH_NORMAL_EQUATIONS_MAX);
        memcpy(kept, row, sizeof row);
        check(1, 6, "added");
        for (half = 0; half < 2; half++) {
            memcpy(row, kept, sizeof row);
            for (i = 0; i < ROWS / 2; i++) {
                memset(row[2 * i + half], 0, sizeof row[0]);
            }
            check(-1, 6, "taken away");
        }
    }
    for (i = 0; i < terms; i++) {
        for (k = 0; k <= i; k++) {
            IH_TEST_RANGE(-30, 30, normal[ih_normal_equations_line(i) + k], "what is left", i);
        }
    }
}

/* A = the Gram matrix of `columns` random numbers each, diagonal below 0.99, and a ridge. smooth: rows that are
 * alike, as those of the surface are. */
static void make_system(int32_t columns, double ridge, int smooth)
{
    static double part[TERMS_MAX][3 * TERMS_MAX], left[TERMS_MAX];
    int32_t i, j, k;

    for (i = 0; i < terms; i++) {
        left[i] = 0;
        for (k = 0; k < columns; k++) {
            const double x = 12.0 * k / columns - i % 12,
                         y = (k * 7 % columns) * 12.0 / columns - (double)(i / 12);

            part[i][k] =
                smooth != 0 ? sqrt(1 + x * x + y * y) : 2 * ih_test_unit(&random_source) - 1;
            left[i] += part[i][k] * part[i][k];
        }
    }
    for (i = 0; i < terms; i++) {
        for (j = 0; j <= i; j++) {
            double sum = 0;

            for (k = 0; k < columns; k++) {
                sum += part[i][k] * part[j][k];
            }
            matrix[i][j] =
                (0.99 - 2 * ridge) * sum / sqrt(left[i] * left[j]) + (i == j ? ridge : 0);
            factor[ih_normal_equations_line(i) + j] = (int32_t)lround(ldexp(matrix[i][j], 30));
            matrix[i][j] = matrix[j][i] = ldexp(factor[ih_normal_equations_line(i) + j], -30);
        }
    }
    factor[entries()] = MARK;
}

/* product = F^T F. */
static void multiply_factor(void)
{
    int32_t i, j, k;

    for (i = 0; i < terms; i++) {
        for (j = 0; j <= i; j++) {
            double sum = 0;

            for (k = i; k < terms; k++) {
                sum += ldexp((double)factor[ih_normal_equations_line(k) + i] *
                                 factor[ih_normal_equations_line(k) + j],
                             -54);
            }
            product[i][j] = product[j][i] = sum;
        }
    }
}

/* F^T F = A: roundings of sums, 40 of 2^-31, what lower parts leave out, 32 times 2^-32, and the rounding of F times
 * its row's pivot. */
static void check_factor(int32_t fine_from, int32_t min_q30, const char *what)
{
    int32_t i, j;

    TEST_ASSERT_TRUE_MESSAGE(ih_normal_equations_factor(terms, fine_from, min_q30, factor, work),
                             what);
    IH_TEST_EQUAL(MARK, factor[entries()], what, entries());
    multiply_factor();
    for (i = 0; i < terms; i++) {
        const double pivot = ldexp(factor[ih_normal_equations_line(i) + i], -27);
        const double rounding = pivot * ldexp(1, i >= fine_from ? -28 : -16);

        for (j = 0; j <= i; j++) {
            IH_TEST_WITHIN(40 * ldexp(1, -31) + 32 * ldexp(1, -32) +
                               (i == j ? 2.1 : 1.01) * rounding,
                           matrix[i][j], product[i][j], what, i * terms + j);
        }
    }
}

static void systems_have_their_factor(void)
{
    const int32_t fine_from[] = {0, 16, terms - 32, terms};
    static const int32_t columns[] = {300, 150};
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(fine_from); i++) {
        for (k = 0; k < IH_TEST_COUNT(columns); k++) {
            make_system(columns[k], 1e-2, 0);
            check_factor(fine_from[i], 1 << 20, "random");
        }
        make_system(300, fine_from[i] == terms ? 1e-2 : 1e-5, 1);
        check_factor(fine_from[i], 8000, "smooth");
    }
    make_system(40, 1e-5, 0);
    check_factor(0, 8000, "fewer columns than rows");
}

/* Too much for 16 bits: 16 more large pivots than fine rows, all others are the ridge's. */
static void a_factor_that_is_too_coarse_is_reported(void)
{
    make_system(48, 1e-5, 0);
    TEST_ASSERT_FALSE(ih_normal_equations_factor(terms, terms - 32, 8000, factor, work));
    make_system(300, 1e-2, 0);
    TEST_ASSERT_FALSE(ih_normal_equations_factor(terms, terms - 32, 1 << 30, factor, work));
}

/* F^T F x = b but for roundings of both steps, and 25 bits of x. */
static void systems_are_solved(void)
{
    int smooth;

    for (smooth = 0; smooth < 2; smooth++) {
        static int32_t b[TERMS_MAX], x[TERMS_MAX];
        int32_t exponent, i, j;
        double max = 0;

        make_system(300, 1e-4, smooth);
        check_factor(terms - 32, 8000, "to be solved");
        for (i = 0; i < terms; i++) {
            b[i] = (int32_t)ih_test_between(&random_source, -200000, 200000);
        }
        TEST_ASSERT_TRUE(ih_normal_solve(factor, terms, b, x, &exponent));
        for (i = 0; i < terms; i++) {
            max = fmax(max, fabs(ldexp(x[i], exponent)));
        }
        TEST_ASSERT_TRUE(exponent == 0 || max >= ldexp((1 << 24) - 1, exponent));
        for (i = 0; i < terms; i++) {
            double sum = 0;

            for (j = 0; j < terms; j++) {
                sum += product[i][j] * ldexp(x[j], exponent);
            }
            IH_TEST_WITHIN(terms * (ldexp(1, exponent) + max * ldexp(1, -26) + 1), b[i], sum,
                           "solution", i);
        }
        TEST_ASSERT_TRUE(ih_normal_solve(factor, terms, b, b, &j));
        IH_TEST_EQUAL(exponent, j, "in place", 0);
        TEST_ASSERT_EQUAL_INT32_ARRAY(x, b, terms);
        memset(b, 0, sizeof b);
        TEST_ASSERT_TRUE(ih_normal_solve(factor, terms, b, x, &exponent));
        TEST_ASSERT_EACH_EQUAL_INT32(0, x, terms);
        IH_TEST_EQUAL(0, exponent, "of nothing", 0);
    }
}

/* Unknowns that grow by 2^13 from one to the next have no common exponent: reported before it becomes too large. */
static void a_missing_solution_is_reported(void)
{
    static int32_t b[TERMS_MAX], x[TERMS_MAX];
    int32_t exponent, i;

    memset(factor, 0, sizeof factor);
    for (i = 0; i < terms; i++) {
        b[i] = i == 0;
        factor[ih_normal_equations_line(i) + i] = 1 << 14;
        if (i > 0) {
            factor[ih_normal_equations_line(i) + i - 1] = 1 << 27;
        }
    }
    TEST_ASSERT_FALSE(ih_normal_solve(factor, terms, b, x, &exponent));
}

/* A diagonal of squares has its roots; a number that is not positive becomes the smallest pivot. */
static void pivots_have_a_min_value(void)
{
    int32_t i;

    memset(factor, 0, sizeof factor);
    for (i = 0; i < terms; i++) {
        factor[ih_normal_equations_line(i) + i] = i % 3 == 0   ? 1 << 28
                                                  : i % 3 == 1 ? 0
                                                               : -(1 << 29);
    }
    TEST_ASSERT_FALSE(ih_normal_equations_factor(terms, 0, 1, factor, work));
    for (i = 0; i < terms; i++) {
        IH_TEST_EQUAL(i % 3 == 0 ? 1 << 26 : 1 << 17, factor[ih_normal_equations_line(i) + i],
                      "root", i);
    }
}

/* Sums that wrapped around leave anything at a pivot: where 16 bits would round it to 1, what is below 0 in its row must
 * stay so on all processors. */
static void a_pivot_of_one_keeps_signs(void)
{
    int32_t i;

    for (i = 0; i < terms; i++) {
        memset(factor, 0, sizeof factor);
        factor[ih_normal_equations_line(terms - 1) + i] = -(1 << 27);
        factor[ih_normal_equations_line(terms - 1) + terms - 1] =
            i % 2 == 0 ? (1 << 30) - 1 : INT32_MAX;
        (void)ih_normal_equations_factor(terms, terms, 1, factor, work);
        if (i < terms - 1) {
            /* half a step of 16 bits, and what a pivot less than 1 is */
            IH_TEST_WITHIN(1 << 12, -(1 << 24), factor[ih_normal_equations_line(terms - 1) + i],
                           "entry", i);
        }
    }
}

/* The same bits on all processors, also where a matrix is none that has a factor. */
static void factors_have_the_same_bits(void)
{
    static const uint32_t expected_hash[2][3] = {{485617988, 2567137089, 3852012110},
                                                 {78990270, 3451190644, 2704101879}};
    int kind;

    for (kind = 0; kind < 3; kind++) {
        uint32_t hash = 2166136261u;
        int32_t i, j;

        memset(factor, 0, sizeof factor);
        random_source.state = 7;
        for (i = 0; i < terms; i++) {
            for (j = 0; j < i; j++) {
                const int32_t max = kind == 0 ? 1 << 20 : kind == 1 ? 1 << 24 : 1 << 29;

                factor[ih_normal_equations_line(i) + j] =
                    (int32_t)ih_test_between(&random_source, -max, max);
            }
            factor[ih_normal_equations_line(i) + i] = kind == 2 ? -i : 1000000000 - i;
        }
        (void)ih_normal_equations_factor(terms, kind == 0 ? 0 : terms - 32, 1, factor, work);
        for (i = 0; i < terms; i++) {
            for (j = 0; j <= i; j++) {
                hash = (uint32_t)((uint64_t)(hash ^
                                             (uint32_t)factor[ih_normal_equations_line(i) + j]) *
                                  16777619u);
            }
        }
        IH_TEST_EQUAL(expected_hash[terms == TERMS_MAX ? 0 : 1][kind], hash, "hash", kind);
    }
}

static void nothing_behind_the_lines_is_touched(void)
{
    normal[entries()] = MARK;
    fill_rows(1, IH_NORMAL_EQUATIONS_MAX);
    check(1, 6, "sum");
    check(-1, 6, "change");
    IH_TEST_EQUAL(MARK, normal[entries()], "behind", entries());
}

int main(void)
{
    static const int32_t counts[] = {TERMS_MAX, 64};
    int pass;

    UNITY_BEGIN();
    for (pass = 0; pass < IH_TEST_COUNT(counts); pass++) {
        terms = counts[pass];
        RUN_TEST(lines_follow_each_other);
        RUN_TEST(sums_are_rounded_once_a_call);
        RUN_TEST(max_sums_hold);
        RUN_TEST(sums_are_subtracted);
        RUN_TEST(every_row_counts_once);
        RUN_TEST(what_was_added_can_be_subtracted);
        RUN_TEST(nothing_behind_the_lines_is_touched);
        RUN_TEST(systems_have_their_factor);
        RUN_TEST(a_factor_that_is_too_coarse_is_reported);
        RUN_TEST(systems_are_solved);
        RUN_TEST(a_missing_solution_is_reported);
        RUN_TEST(pivots_have_a_min_value);
        RUN_TEST(a_pivot_of_one_keeps_signs);
        RUN_TEST(factors_have_the_same_bits);
    }
    return UNITY_END();
}
