/* Every word of ih_pair.h against plain C, on random and extreme halves. */
#include "simd/ih_pair.h"

#include "ih_test.h"

void setUp(void)
{
}

void tearDown(void)
{
}

static int16_t any_half(struct ih_test_random *random)
{
    static const int16_t end[] = {0, 1, -1, INT16_MAX, INT16_MIN};
    const int64_t kind = ih_test_between(random, 0, 9);

    return kind < 5 ? end[kind] : (int16_t)ih_test_between(random, INT16_MIN, INT16_MAX);
}

static void words_of_pairs(void)
{
    struct ih_test_random random = {.state = 17};
    int pass;

    for (pass = 0; pass < 20000; pass++) {
        const int16_t a[2] = {any_half(&random), any_half(&random)};
        const int16_t b[2] = {any_half(&random), any_half(&random)};
        const uint32_t first = ih_pair_make(a[0], a[1]), second = ih_pair_make(b[0], b[1]);
        const uint32_t sum = ih_pair_add(first, second), difference = ih_pair_sub(first, second);
        const int64_t dot = (int64_t)a[0] * b[0] + (int64_t)a[1] * b[1];
        const int64_t cross = (int64_t)a[0] * b[1] - (int64_t)a[1] * b[0];

        IH_TEST_EQUAL(a[0], ih_pair_first(first), "ih_pair_first", pass);
        IH_TEST_EQUAL(a[1], ih_pair_second(first), "ih_pair_second", pass);
        IH_TEST_EQUAL((int16_t)(a[0] + b[0]), ih_pair_first(sum), "ih_pair_add", pass);
        IH_TEST_EQUAL((int16_t)(a[1] + b[1]), ih_pair_second(sum), "ih_pair_add", pass);
        IH_TEST_EQUAL((int16_t)(a[0] - b[0]), ih_pair_first(difference), "ih_pair_sub", pass);
        IH_TEST_EQUAL((int16_t)(a[1] - b[1]), ih_pair_second(difference), "ih_pair_sub", pass);
        if (dot <= INT32_MAX) { /* all but twice the square of the lowest number */
            IH_TEST_EQUAL(dot, ih_pair_dot(first, second), "ih_pair_dot", pass);
        }
        if (cross <= INT32_MAX && cross >= INT32_MIN) {
            IH_TEST_EQUAL(cross, ih_pair_cross(first, second), "ih_pair_cross", pass);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(words_of_pairs);
    return UNITY_END();
}
