/* ih_normal against sums of products one by one. */
#include "ih_normal.h"

#include "ih_test.h"

#define PAIRS IH_NORMAL_PAIRS
#define ROWS IH_NORMAL_ROWS
#define TERMS IH_NORMAL_TERMS
#define ENTRIES IH_NORMAL_LINE(TERMS)
#define MARK 0x12345678

static int32_t row[ROWS][TERMS];
static _Alignas(IH_NORMAL_ALIGNMENT) uint32_t pair[PAIRS][TERMS];
static int32_t normal[ENTRIES + 1], expected[ENTRIES + 1];
static struct ih_test_random random_source;

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

static void fill_rows(int32_t least, int32_t most)
{
    int32_t k, i;

    for (k = 0; k < ROWS; k++) {
        for (i = 0; i < TERMS; i++) {
            row[k][i] = (int32_t)ih_test_between(&random_source, least, most);
        }
    }
}

static void pair_rows(void)
{
    int32_t k, i;

    for (k = 0; k < PAIRS; k++) {
        for (i = 0; i < TERMS; i++) {
            pair[k][i] = (uint32_t)row[2 * k][i] | (uint32_t)row[2 * k + 1][i] << 16;
        }
    }
}

/* The sum over all rows to its nearest unit, halves up; second: what a pair's second row counts. */
static int32_t product_sum(int32_t i, int32_t j, int second, int shift)
{
    int64_t sum = 0;
    int32_t k;

    for (k = 0; k < ROWS; k++) {
        sum += (k % 2 == 0 ? 1 : second) * (int64_t)row[k][i] * row[k][j];
    }
    return (int32_t)floor(ldexp((double)sum, -shift) + 0.5);
}

/* Entries up to the diagonal; what stands behind it is nobody's business. */
static void check(int second, int shift, const char *what)
{
    int32_t i, j;

    pair_rows();
    if (second > 0) {
        ih_normal_add(pair, shift, normal);
    } else {
        ih_normal_change(pair, shift, normal);
    }
    for (i = 0; i < TERMS; i++) {
        for (j = 0; j <= i; j++) {
            const int32_t at = ih_normal_line(i) + j;

            expected[at] += product_sum(i, j, second, shift);
            if (normal[at] != expected[at]) {
                IH_TEST_EQUAL(expected[at], normal[at], what, at);
            }
        }
    }
}

static void lines_follow_each_other(void)
{
    int32_t i;

    IH_TEST_EQUAL(0, ih_normal_line(0), "line", 0);
    for (i = 1; i < TERMS; i++) {
        const int32_t before = ih_normal_line(i - 1);

        IH_TEST_RANGE(before + i, before + i + IH_NORMAL_GROUP, ih_normal_line(i), "line", i);
        if (i % IH_NORMAL_GROUP == 0) {
            IH_TEST_EQUAL(IH_NORMAL_LINE(i), ih_normal_line(i), "line of a group", i);
        }
    }
    IH_TEST_RANGE(ih_normal_line(TERMS - 1) + TERMS, ENTRIES, ENTRIES, "size", 0);
}

static void sums_are_rounded_once_a_call(void)
{
    int shift;

    for (shift = 1; shift <= IH_NORMAL_SHIFT_MOST; shift++) {
        setUp();
        fill_rows(0, IH_NORMAL_MOST >> (shift == 1));
        check(1, shift, "sum");
        fill_rows(0, 100);
        check(1, shift, "small sum");
    }
}

/* 16 times the greatest square, as often as the header allows. */
static void greatest_sums_hold(void)
{
    int32_t call;

    for (call = 0; call < 16; call++) {
        fill_rows(IH_NORMAL_MOST, IH_NORMAL_MOST);
        check(1, 5, "greatest");
    }
    TEST_ASSERT_TRUE(normal[0] > 2147000000);
}

static void changes_take_the_second_rows_away(void)
{
    int round;

    for (round = 0; round < 5; round++) {
        fill_rows(0, IH_NORMAL_MOST);
        check(-1, 6, "change");
    }
}

/* The greatest products added and nothing taken away, and the other way round. */
static void greatest_changes_hold(void)
{
    int32_t first, k, i;

    for (first = 0; first < 2; first++) {
        for (k = 0; k < ROWS; k++) {
            for (i = 0; i < TERMS; i++) {
                row[k][i] = k % 2 == first ? IH_NORMAL_MOST : 0;
            }
        }
        check(-1, 1, "greatest change");
        check(-1, IH_NORMAL_SHIFT_MOST, "greatest change, shifted");
    }
}

/* Each row at each place: none is left out, none is taken twice. */
static void every_row_counts_once(void)
{
    int32_t k, i, second;

    for (second = -1; second <= 1; second += 2) {
        for (k = 0; k < ROWS; k++) {
            memset(row, 0, sizeof row);
            for (i = 0; i < TERMS; i++) {
                row[k][i] = 2 * i + 1;
            }
            check(second, 1, "one row");
        }
    }
}

/* What was added and is taken away leaves no more than each rounding's half. */
static void what_was_added_can_be_taken_away(void)
{
    int32_t k, i;

    for (k = 0; k < 20; k++) {
        fill_rows(0, IH_NORMAL_MOST);
        for (i = 0; i < TERMS; i++) {
            int32_t n;

            for (n = 1; n < ROWS; n += 2) {
                row[n][i] = 0;
            }
        }
        check(1, 6, "added");
        for (i = 0; i < ROWS; i += 2) {
            memcpy(row[i + 1], row[i], sizeof row[i]);
            memset(row[i], 0, sizeof row[i]);
        }
        check(-1, 6, "taken away");
    }
    for (i = 0; i < TERMS; i++) {
        for (k = 0; k <= i; k++) {
            IH_TEST_RANGE(-20, 20, normal[ih_normal_line(i) + k], "what is left", i);
        }
    }
}

static void nothing_behind_the_lines_is_touched(void)
{
    normal[ENTRIES] = MARK;
    fill_rows(1, IH_NORMAL_MOST);
    check(1, 6, "sum");
    check(-1, 6, "change");
    IH_TEST_EQUAL(MARK, normal[ENTRIES], "behind", ENTRIES);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(lines_follow_each_other);
    RUN_TEST(sums_are_rounded_once_a_call);
    RUN_TEST(greatest_sums_hold);
    RUN_TEST(changes_take_the_second_rows_away);
    RUN_TEST(greatest_changes_hold);
    RUN_TEST(every_row_counts_once);
    RUN_TEST(what_was_added_can_be_taken_away);
    RUN_TEST(nothing_behind_the_lines_is_touched);
    return UNITY_END();
}
