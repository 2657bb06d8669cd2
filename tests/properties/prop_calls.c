/* No order of the calls of isohead.h, with arguments that fit and that do not, reads or writes what it must not, divides
 * by zero or leaves outputs that are no result: what fuzz_calls.c checks after each call, here of random bytes. */
#include "fuzz.h"
#include "prop_scene.h"

#define BYTES_MAX 256
#define ORDERS 400

void setUp(void)
{
}

void tearDown(void)
{
}

static void any_order_of_calls_is_safe(void)
{
    struct ih_test_random random = {601};
    const int32_t orders = prop_seeds(ORDERS);

    for (int32_t order = 0; order < orders; order++) {
        uint8_t bytes[BYTES_MAX];
        const size_t size = (size_t)ih_test_between(&random, 8, BYTES_MAX);

        for (size_t i = 0; i < size; i++) {
            bytes[i] = (uint8_t)ih_test_between(&random, 0, UINT8_MAX);
        }
        if (order % 4 != 0) { /* most begin with a good rig and its dots on a wall */
            const uint8_t start[] = {0, bytes[1] % 8, 3, 2, 20 + bytes[4] % 80};

            memcpy(bytes, start, sizeof start);
        }
        TEST_ASSERT_EQUAL_INT(0, LLVMFuzzerTestOneInput(bytes, size));
    }
    printf("calls: %d orders\n", (int)orders);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(any_order_of_calls_is_safe);
    return UNITY_END();
}
