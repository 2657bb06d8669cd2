/* ih_cholesky against scipy, against its own definition L L^T = A in exact integers, and with
 * matrices that have no factor. */
#include "base/ih_cholesky.h"
#include "base/ih_types.h"

#include "ih_test.h"

struct vector_system {
    const char *name;
    int32_t n;
    double condition;
    const int32_t *a_q30, *b;
    const double *last_row, *diagonal, *x; /* NULL: too ill-conditioned to be compared */
};

#include "cholesky.inc"

__extension__ typedef __int128 int128;

#define PACKED_MAX IH_CHOLESKY_PACKED(IH_CHOLESKY_MAX)
#define GUARD 16
#define DIAGONAL_Q30 1063004406 /* 0.99 */

static int32_t matrix[PACKED_MAX];
static int32_t factor[PACKED_MAX + GUARD];
static int32_t right[IH_CHOLESKY_MAX];
static int32_t mantissa[IH_CHOLESKY_MAX + GUARD];
static int32_t bad_pivot, exponent;
static struct ih_test_random random_source;

void setUp(void)
{
    random_source.state = 31;
    bad_pivot = 4711;
    memset(factor, IH_TEST_FILL, sizeof factor);
    memset(mantissa, IH_TEST_FILL, sizeof mantissa);
}

void tearDown(void)
{
}

static int32_t at(const int32_t *packed, int32_t i, int32_t j)
{
    return j <= i ? packed[i * (i + 1) / 2 + j] : packed[j * (j + 1) / 2 + i];
}

static void factorise(const int32_t *a_q30, int32_t n, const char *what)
{
    memcpy(factor, a_q30, (size_t)IH_CHOLESKY_PACKED(n) * sizeof *a_q30);
    IH_TEST_EQUAL(IH_OK, ih_cholesky_factor(factor, n, &bad_pivot), what, n);
    IH_TEST_UNTOUCHED(&factor[IH_CHOLESKY_PACKED(n)], GUARD * sizeof *factor, what);
}

/* Every entry of L L^T, summed without rounding, against A. Each of the n products may carry half
 * a unit of Q30 from each of its factors, which are at most 1: n units; one more for A's own. */
static void check_factor(const int32_t *a_q30, int32_t n, const char *what)
{
    int32_t i, j, k;

    for (i = 0; i < n; i++) {
        for (j = 0; j <= i; j++) {
            int128 sum_q60 = 0;

            for (k = 0; k <= j; k++) {
                sum_q60 += (int128)at(factor, i, k) * at(factor, j, k);
            }
            IH_TEST_WITHIN(n + 1.0, at(a_q30, i, j), (double)sum_q60 / 1073741824.0, what, i);
        }
        TEST_ASSERT_TRUE(at(factor, i, i) > 0);
    }
}

/* The residual of A x = b in the unit of b. x is rounded to its mantissa's unit, which a row of A
 * (each entry at most 1) passes on; L's own error is n units of Q30 per entry of A. */
static void check_solution(const int32_t *a_q30, int32_t n, const int32_t *b, const char *what)
{
    double largest = 0;
    int32_t i, j;

    for (i = 0; i < n; i++) {
        largest = fmax(largest, fabs(ldexp(mantissa[i], exponent)));
    }
    for (i = 0; i < n; i++) {
        double sum = 0;

        for (j = 0; j < n; j++) {
            sum += ih_test_from_q(at(a_q30, i, j), 30) * ldexp(mantissa[j], exponent);
        }
        IH_TEST_WITHIN(n * ldexp(1, exponent) + n * n * ldexp(largest, -30) + n, b[i], sum, what,
                       i);
    }
}

static void check_exponent_is_min(int32_t n, const char *what)
{
    int64_t largest = 0;
    int32_t i;

    for (i = 0; i < n; i++) {
        const int64_t size = mantissa[i] < 0 ? -(int64_t)mantissa[i] : mantissa[i];

        largest = size > largest ? size : largest;
    }
    IH_TEST_RANGE(0, 62, exponent, what, n);
    /* Mantissas have 25 bits: an exponent that one bit less would have served was not needed. */
    TEST_ASSERT_TRUE(exponent == 0 || largest >= (1 << 24) - 1);
}

/* Perturbation theory: a relative error e of A moves L and x by at most condition * e. Where that
 * is too much to say anything, check_factor and check_solution still do. */
static void factors_match_scipy(void)
{
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(vector_systems); i++) {
        const struct vector_system *v = &vector_systems[i];
        const double tolerance = v->condition * v->n * ldexp(1, -30);

        factorise(v->a_q30, v->n, v->name);
        check_factor(v->a_q30, v->n, v->name);
        for (k = 0; k < v->n && v->x != NULL; k++) {
            IH_TEST_WITHIN(tolerance, v->diagonal[k], ih_test_from_q(at(factor, k, k), 30), v->name,
                           k);
            IH_TEST_WITHIN(tolerance, v->last_row[k], ih_test_from_q(at(factor, v->n - 1, k), 30),
                           v->name, k);
        }
    }
}

static void solutions_match_scipy(void)
{
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(vector_systems); i++) {
        const struct vector_system *v = &vector_systems[i];
        double largest = 0;

        factorise(v->a_q30, v->n, v->name);
        ih_cholesky_solve(factor, v->n, v->b, mantissa, &exponent);
        IH_TEST_UNTOUCHED(&mantissa[v->n], GUARD * sizeof *mantissa, v->name);
        check_solution(v->a_q30, v->n, v->b, v->name);
        check_exponent_is_min(v->n, v->name);
        for (k = 0; k < v->n && v->x != NULL; k++) {
            largest = fmax(largest, fabs(v->x[k]));
        }
        for (k = 0; k < v->n && v->x != NULL; k++) {
            /* As for the factor; and the rounding of x and, times the condition, of b. */
            IH_TEST_WITHIN(v->condition * (v->n * ldexp(largest, -30) + 1) + ldexp(1, exponent),
                           v->x[k], ldexp(mantissa[k], exponent), v->name, k);
        }
    }
}

/* Columns of small integers give a matrix that is known exactly; the ridge keeps it definite. */
static void make_matrix(int32_t n, int32_t columns, int32_t ridge_q30)
{
    static int32_t part[IH_CHOLESKY_MAX][2 * IH_CHOLESKY_MAX];
    int32_t i, j, k;

    for (i = 0; i < n; i++) {
        for (k = 0; k < columns; k++) {
            part[i][k] = (int32_t)ih_test_between(&random_source, -1000, 1000);
        }
    }
    for (i = 0; i < n; i++) {
        for (j = 0; j <= i; j++) {
            double sum = 0, left = 0, above = 0;

            for (k = 0; k < columns; k++) {
                sum += (double)part[i][k] * part[j][k];
                left += (double)part[i][k] * part[i][k];
                above += (double)part[j][k] * part[j][k];
            }
            matrix[i * (i + 1) / 2 + j] =
                (int32_t)lround((DIAGONAL_Q30 - ridge_q30) * sum / sqrt(left * above));
        }
        matrix[i * (i + 1) / 2 + i] += ridge_q30;
    }
}

static void any_positive_matrix_has_its_factor(void)
{
    static const int32_t sizes[] = {1, 2, 3, 4, 5, IH_CHOLESKY_MAX};
    int i, j;

    for (i = 0; i < IH_TEST_COUNT(sizes); i++) {
        const int32_t n = sizes[i];

        /* Half as many columns as rows: without its ridge this matrix would be singular. */
        make_matrix(n, n % 2 == 0 ? 2 * n : (n + 1) / 2, 1 << 20);
        factorise(matrix, n, "random");
        check_factor(matrix, n, "random");
        for (j = 0; j < n; j++) {
            right[j] = (int32_t)ih_test_between(&random_source, -4000, 4000);
        }
        ih_cholesky_solve(factor, n, right, mantissa, &exponent);
        check_solution(matrix, n, right, "random");
        check_exponent_is_min(n, "random");
    }
}

static void set_diagonal(int32_t n, int32_t value)
{
    int32_t i;

    memset(matrix, 0, sizeof matrix);
    for (i = 0; i < n; i++) {
        matrix[i * (i + 1) / 2 + i] = value;
    }
}

/* Closed form: L = sqrt(a) I, x = b / a. */
static void a_diagonal_matrix_is_its_roots(void)
{
    const int32_t n = IH_CHOLESKY_MAX;
    int32_t i, j;

    set_diagonal(n, 1 << 28); /* 1/4 */
    factorise(matrix, n, "quarter");
    for (i = 0; i < n; i++) {
        for (j = 0; j <= i; j++) {
            IH_TEST_EQUAL(i == j ? 1 << 29 : 0, at(factor, i, j), "quarter", i);
        }
        right[i] = 1000 * (i - 3);
    }
    ih_cholesky_solve(factor, n, right, mantissa, &exponent);
    IH_TEST_EQUAL(0, exponent, "exponent", 0);
    for (i = 0; i < n; i++) {
        IH_TEST_EQUAL(4000 * (i - 3), mantissa[i], "x", i);
    }
}

static void the_unit_diagonal_is_the_upper_limit(void)
{
    set_diagonal(5, 1 << 30);
    factorise(matrix, 5, "unit matrix");
    check_factor(matrix, 5, "unit matrix");
}

static void b_and_x_may_be_the_same_array(void)
{
    const struct vector_system *v = &vector_systems[IH_TEST_COUNT(vector_systems) - 1];
    int32_t apart_exponent;

    factorise(v->a_q30, v->n, v->name);
    ih_cholesky_solve(factor, v->n, v->b, mantissa, &apart_exponent);
    memcpy(right, v->b, (size_t)v->n * sizeof *right);
    ih_cholesky_solve(factor, v->n, right, right, &exponent);
    IH_TEST_EQUAL(apart_exponent, exponent, "exponent", 0);
    TEST_ASSERT_EQUAL_INT32_ARRAY(mantissa, right, v->n);
}

static void a_zero_right_side_gives_zero(void)
{
    const struct vector_system *v = &vector_systems[2];

    memset(right, 0, sizeof right);
    factorise(v->a_q30, v->n, v->name);
    ih_cholesky_solve(factor, v->n, right, mantissa, &exponent);
    IH_TEST_EQUAL(0, exponent, "exponent", 0);
    TEST_ASSERT_EACH_EQUAL_INT32(0, mantissa, v->n);
}

/* The largest right side: b = L y with |y| near 2^31 - 1 in the first place alone. */
static void the_largest_right_side_is_solved(void)
{
    int32_t sign;

    for (sign = -1; sign <= 1; sign += 2) {
        set_diagonal(3, 1 << 30);
        factorise(matrix, 3, "unit matrix");
        right[0] = sign * INT32_MAX;
        right[1] = 0;
        right[2] = -sign * INT32_MAX;
        ih_cholesky_solve(factor, 3, right, mantissa, &exponent);
        check_solution(matrix, 3, right, "largest b");
        /* A quarter on the diagonal: x = 4 b does not fit 32 bits without an exponent. */
        set_diagonal(3, 1 << 28);
        factorise(matrix, 3, "quarter");
        right[0] = sign * (INT32_MAX / 2);
        right[2] = -sign * (INT32_MAX / 2);
        ih_cholesky_solve(factor, 3, right, mantissa, &exponent);
        check_exponent_is_min(3, "quarter, largest b");
        check_solution(matrix, 3, right, "quarter, largest b");
    }
}

static void expect_not_positive(int32_t n, int32_t pivot, const char *what)
{
    memcpy(factor, matrix, sizeof matrix);
    bad_pivot = -99;
    IH_TEST_EQUAL(IH_ERR_NOT_POSITIVE, ih_cholesky_factor(factor, n, &bad_pivot), what, n);
    IH_TEST_EQUAL(pivot, bad_pivot, what, n);
}

static void the_bad_pivot_is_reported(void)
{
    int32_t k;

    for (k = 0; k < IH_CHOLESKY_MAX; k++) {
        set_diagonal(IH_CHOLESKY_MAX, DIAGONAL_Q30);
        matrix[k * (k + 1) / 2 + k] = 0;
        expect_not_positive(IH_CHOLESKY_MAX, k, "zero");
        matrix[k * (k + 1) / 2 + k] = -DIAGONAL_Q30;
        expect_not_positive(IH_CHOLESKY_MAX, k, "negative");
    }
    set_diagonal(1, 0);
    expect_not_positive(1, 0, "n = 1");
}

/* Two equal rows: the second pivot is exactly zero. An indefinite pair: it is negative. */
static void dependent_rows_are_found(void)
{
    const int32_t n = IH_CHOLESKY_MAX;
    int32_t k;

    for (k = 0; k + 1 < n; k++) {
        const int32_t below = (k + 1) * (k + 2) / 2 + k;

        set_diagonal(n, DIAGONAL_Q30);
        matrix[below] = DIAGONAL_Q30; /* has no exact root: only rounding is left of the pivot */
        expect_not_positive(n, k + 1, "equal rows of 0.99");
        set_diagonal(n, 1 << 28);
        matrix[below] = 1 << 28;
        expect_not_positive(n, k + 1, "equal rows");
        matrix[below] = (1 << 28) + 1000;
        expect_not_positive(n, k + 1, "indefinite");
        matrix[below] = -(1 << 28) - 1000;
        expect_not_positive(n, k + 1, "indefinite, negative");
        matrix[below] = (1 << 28) - 1000;
        memcpy(factor, matrix, sizeof matrix);
        TEST_ASSERT_EQUAL_INT(IH_OK, ih_cholesky_factor(factor, n, &bad_pivot));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(factors_match_scipy);
    RUN_TEST(solutions_match_scipy);
    RUN_TEST(any_positive_matrix_has_its_factor);
    RUN_TEST(a_diagonal_matrix_is_its_roots);
    RUN_TEST(the_unit_diagonal_is_the_upper_limit);
    RUN_TEST(b_and_x_may_be_the_same_array);
    RUN_TEST(a_zero_right_side_gives_zero);
    RUN_TEST(the_largest_right_side_is_solved);
    RUN_TEST(the_bad_pivot_is_reported);
    RUN_TEST(dependent_rows_are_found);
    return UNITY_END();
}
