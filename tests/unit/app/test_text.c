/* hal_text against snprintf, and what does not fit. */
#include "hal_text.h"

#include "ih_test.h"

static char memory[64], wanted[64];

void setUp(void)
{
    memset(memory, IH_TEST_FILL, sizeof memory);
}

void tearDown(void)
{
}

static void check_number(int64_t number, int digits)
{
    struct hal_text text = hal_text_begin(memory, sizeof memory);
    /* snprintf's precision counts digits as well, without the sign; but 0 with none is empty there
     * and here */
    const int length = snprintf(wanted, sizeof wanted, "%.*" PRId64, digits, number);

    hal_text_put_number(&text, number, digits);
    TEST_ASSERT_EQUAL_STRING(wanted, memory);
    IH_TEST_EQUAL(length, text.length, "length", number);
}

static void numbers_are_snprintfs(void)
{
    static const int64_t known[] = {0, 1, -1, 9, 10, -10, 99, 100, INT32_MIN, INT64_MAX, INT64_MIN};
    struct ih_test_random random = {3};
    int i;

    for (i = 0; i < 12 * IH_TEST_COUNT(known); i++) {
        check_number(known[i / 12], i % 12);
    }
    check_number(INT64_MIN, 20);
    check_number(7, 20);
    for (i = 0; i < 2000; i++) {
        check_number(ih_test_any_size(&random, 63), (int)ih_test_between(&random, 0, 20));
    }
}

static void hexadecimal_is_snprintfs(void)
{
    struct ih_test_random random = {4};
    int i;

    for (i = 0; i < 2000; i++) {
        const uint64_t number = ih_test_u64(&random);
        const int digits = (int)ih_test_between(&random, 1, 16);
        const uint64_t low = digits == 16 ? number : number & ((UINT64_C(1) << 4 * digits) - 1);
        struct hal_text text = hal_text_begin(memory, sizeof memory);

        hal_text_put_hex(&text, number, digits);
        snprintf(wanted, sizeof wanted, "%0*" PRIx64, digits, low);
        TEST_ASSERT_EQUAL_STRING(wanted, memory);
    }
}

/* Every size from one that holds nothing to one that holds all: cut off there, with its zero byte, and
 * not a byte behind. */
static void what_does_not_fit_is_cut_off(void)
{
    static const char whole[] = "offset -120: byte 0x0f";
    size_t size;

    for (size = 1; size < sizeof memory; size++) {
        struct hal_text text;
        const size_t fits = size - 1 < sizeof whole - 1 ? size - 1 : sizeof whole - 1;

        setUp();
        text = hal_text_begin(memory, size);
        hal_text_put(&text, "offset ");
        hal_text_put_number(&text, -120, 2);
        hal_text_put_some(&text, ": byte nothing", 7);
        hal_text_put(&text, "");
        hal_text_put(&text, "0x");
        hal_text_put_hex(&text, 0xf0f, 2);
        IH_TEST_EQUAL(fits, text.length, "length", (int64_t)size);
        IH_TEST_EQUAL(fits, hal_text_length(memory), "zero byte", (int64_t)size);
        IH_TEST_EQUAL(0, strncmp(whole, memory, fits), "text", (int64_t)size);
        IH_TEST_UNTOUCHED(memory + size, sizeof memory - size, "behind");
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(numbers_are_snprintfs);
    RUN_TEST(hexadecimal_is_snprintfs);
    RUN_TEST(what_does_not_fit_is_cut_off);
    return UNITY_END();
}
