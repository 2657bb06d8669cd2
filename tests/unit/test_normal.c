/* ih_normal against sums of products one by one. */
#include "ih_normal.h"

#include "ih_test.h"

#define ROWS IH_NORMAL_ROWS
#define TERMS IH_NORMAL_TERMS
#define ENTRIES IH_NORMAL_LINE(TERMS)
#define MARK 0x123456789ABCDEF0u

static ih_normal_entry row[ROWS][TERMS];
static uint64_t normal[ENTRIES + 1], expected[ENTRIES + 1];
static struct ih_test_random random_source;

void setUp(void)
{
    random_source.state = 91;
    memset(normal, 0, sizeof normal);
    memset(expected, 0, sizeof expected);
}

void tearDown(void)
{
}

static void fill_rows(uint32_t most)
{
    int32_t k, i;

    for (k = 0; k < ROWS; k++) {
        for (i = 0; i < TERMS; i++) {
            row[k][i] = (uint32_t)ih_test_between(&random_source, 0, most);
        }
    }
}

static uint64_t product_sum(int32_t i, int32_t j)
{
    uint64_t sum = 0;
    int32_t k;

    for (k = 0; k < ROWS; k++) {
        sum += (uint64_t)row[k][i] * row[k][j];
    }
    return sum;
}

/* Entries up to the diagonal; what stands behind it is nobody's business. */
static void check_lines(const char *what)
{
    int32_t i, j;

    for (i = 0; i < TERMS; i++) {
        for (j = 0; j <= i; j++) {
            const int32_t at = ih_normal_line(i) + j;

            if (normal[at] != expected[at]) {
                IH_TEST_EQUAL((int64_t)expected[at], (int64_t)normal[at], what, at);
            }
        }
    }
}

static void expect_rows(int32_t first, int32_t last)
{
    int32_t i, j;

    for (i = first; i < last; i++) {
        for (j = 0; j <= i; j++) {
            expected[ih_normal_line(i) + j] += product_sum(i, j);
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

static void sums_are_exact(void)
{
    int32_t round;

    for (round = 0; round < 5; round++) {
        fill_rows(88980803); /* the surface's greatest basis value */
        expect_rows(0, TERMS);
        ih_normal_add(row, 0, TERMS, normal);
        check_lines("sum");
    }
}

/* All bits of an entry count, and what is greater than 2^32 when it is multiplied. */
static void greatest_entries_are_multiplied_whole(void)
{
    int32_t i;

    memset(row, 0, sizeof row);
    for (i = 0; i < TERMS; i++) {
        row[ROWS - 1][i] = UINT32_MAX - (uint32_t)i;
    }
    expect_rows(0, TERMS);
    ih_normal_add(row, 0, TERMS, normal);
    check_lines("greatest");
}

/* Each row at each place: none is left out, none is taken twice. */
static void every_row_counts_once(void)
{
    int32_t k, i;

    for (k = 0; k < ROWS; k++) {
        memset(row, 0, sizeof row);
        for (i = 0; i < TERMS; i++) {
            row[k][i] = (uint32_t)(i + 1);
        }
        expect_rows(0, TERMS);
        ih_normal_add(row, 0, TERMS, normal);
        check_lines("one row");
    }
}

static void only_the_lines_asked_for_are_touched(void)
{
    static const int32_t part[][2] = {{0, 8}, {8, 120}, {120, TERMS}, {64, 64}, {0, TERMS}};
    int i;
    int32_t at;

    fill_rows(1 << 26);
    for (i = 0; i < IH_TEST_COUNT(part); i++) {
        const int32_t first = part[i][0], last = part[i][1];

        for (at = 0; at <= ENTRIES; at++) {
            normal[at] = expected[at] = MARK;
        }
        expect_rows(first, last);
        ih_normal_add(row, first, last, &normal[IH_NORMAL_LINE(first)]);
        check_lines("part");
        for (at = 0; at <= ENTRIES; at++) {
            if (at < IH_NORMAL_LINE(first) || at >= IH_NORMAL_LINE(last)) {
                IH_TEST_EQUAL((int64_t)MARK, (int64_t)normal[at], "outside", at);
            }
        }
    }
}

/* As the header says it: with all bits turned round, adding is taking away. */
static void what_was_added_can_be_taken_away(void)
{
    int32_t at;

    fill_rows(88980803);
    expect_rows(0, TERMS);
    ih_normal_add(row, 0, TERMS, normal);
    fill_rows(88980803);
    ih_normal_add(row, 0, TERMS, normal);
    for (at = 0; at < ENTRIES; at++) {
        normal[at] = ~normal[at];
    }
    ih_normal_add(row, 0, TERMS, normal);
    for (at = 0; at < ENTRIES; at++) {
        normal[at] = ~normal[at];
    }
    check_lines("taken away");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(lines_follow_each_other);
    RUN_TEST(sums_are_exact);
    RUN_TEST(greatest_entries_are_multiplied_whole);
    RUN_TEST(every_row_counts_once);
    RUN_TEST(only_the_lines_asked_for_are_touched);
    RUN_TEST(what_was_added_can_be_taken_away);
    return UNITY_END();
}
