/* Every word of ih_simd.h against plain C, lane by lane, on random and extreme lanes. */
#include "simd/ih_simd.h"

#include "ih_test.h"

void setUp(void)
{
}

void tearDown(void)
{
}

#if IH_I16_LANES > 0

#define ROUNDS 3000

static struct ih_test_random source = {.state = 11};

/* Random bytes, or lanes of one width, each random, small or at an end of its range. */
static void fill(void *to, int bytes)
{
    const int width = 1 << ih_test_between(&source, 0, 3);
    const uint64_t half = (uint64_t)1 << (8 * width - 1);
    const uint64_t end[] = {0, 1, UINT64_MAX, half - 1, half};
    int at;

    for (at = 0; at < bytes; at += width) {
        const int kind = (int)ih_test_between(&source, 0, 9);
        const uint64_t lane = kind < 5   ? end[kind]
                              : kind < 7 ? (uint64_t)ih_test_any_size(&source, 16)
                                         : ih_test_u64(&source);

        memcpy((unsigned char *)to + at, &lane, (size_t)width); /* the lower bytes */
    }
}

/* word: of a and b, vectors with the lanes first[] and second[]. expected: lane k of the result, where x and y are
 * first[k] and second[k], if those exist. */
#define CHECK_TO(vector, lane, result_lane, word, expected)                  \
    do {                                                                     \
        enum { COUNT = sizeof(vector) / sizeof(lane) };                      \
        lane first[COUNT], second[COUNT];                                    \
        result_lane result[sizeof(vector) / sizeof(result_lane)];            \
        int round, k;                                                        \
        for (round = 0; round < ROUNDS; round++) {                           \
            vector a, b;                                                     \
            ih_u8 c;                                                         \
            fill(first, sizeof first);                                       \
            fill(second, sizeof second);                                     \
            memcpy(&a, first, sizeof a);                                     \
            memcpy(&b, second, sizeof b);                                    \
            c = (ih_u8)(word);                                               \
            memcpy(result, &c, sizeof c);                                    \
            for (k = 0; k < IH_TEST_COUNT(result); k++) {                    \
                const lane x = first[k % COUNT], y = second[k % COUNT];      \
                (void)x;                                                     \
                (void)y;                                                     \
                IH_TEST_EQUAL((result_lane)(expected), result[k], #word, k); \
            }                                                                \
        }                                                                    \
    } while (0)
#define CHECK(vector, lane, word, expected) CHECK_TO(vector, lane, lane, word, expected)

/* The same of a word that gives one number. */
#define CHECK_ONE(vector, lane, word, expected)                                  \
    do {                                                                         \
        lane first[sizeof(vector) / sizeof(lane)], second[IH_TEST_COUNT(first)]; \
        int round;                                                               \
        for (round = 0; round < ROUNDS; round++) {                               \
            vector a, b;                                                         \
            fill(first, sizeof first);                                           \
            fill(second, sizeof second);                                         \
            memcpy(&a, first, sizeof a);                                         \
            memcpy(&b, second, sizeof b);                                        \
            (void)b;                                                             \
            IH_TEST_EQUAL(expected, word, #word, round);                         \
        }                                                                        \
    } while (0)

#define MIN(x, y) ((x) < (y) ? (x) : (y))
#define MAX(x, y) ((x) > (y) ? (x) : (y))

static void addresses_need_no_alignment(void)
{
    unsigned char bytes[3 * IH_SIMD_BYTES], copy[sizeof bytes];
    const int size = IH_SIMD_BYTES;
    int at;

    for (at = 0; at <= size; at++) {
        void *to = &copy[at];

        fill(bytes, (int)sizeof bytes);
        memcpy(copy, bytes, sizeof bytes);
        memset(to, 0, IH_SIMD_BYTES);
        ih_i16_store(to, ih_i16_load((const void *)&bytes[at]));
        TEST_ASSERT_EQUAL_MEMORY(bytes, copy, sizeof bytes);
        if ((uintptr_t)&bytes[at] % 16 == 0) {
            memset(to, 0, IH_SIMD_BYTES);
            ih_i16_store(to, ih_i16_load_aligned((const void *)&bytes[at]));
            TEST_ASSERT_EQUAL_MEMORY(bytes, copy, sizeof bytes);
        }
        memset(to, 0, IH_SIMD_BYTES);
        ih_i32_store(to, ih_i32_load((const void *)&bytes[at]));
        TEST_ASSERT_EQUAL_MEMORY(bytes, copy, sizeof bytes);
        memset(to, 0, IH_SIMD_BYTES);
        ih_i64_store(to, ih_i64_load((const void *)&bytes[at]));
        TEST_ASSERT_EQUAL_MEMORY(bytes, copy, sizeof bytes);
        memset(to, 0, IH_SIMD_BYTES);
        ih_u8_store(to, (ih_u8)ih_u16_load((const void *)&bytes[at]));
        TEST_ASSERT_EQUAL_MEMORY(bytes, copy, sizeof bytes);
        memset(to, 0, IH_SIMD_BYTES);
        ih_u16_store(to, ih_u16_load((const void *)&bytes[at]));
        TEST_ASSERT_EQUAL_MEMORY(bytes, copy, sizeof bytes);
        memset(to, 0, IH_SIMD_BYTES);
        ih_u32_store(to, ih_u32_load((const void *)&bytes[at]));
        TEST_ASSERT_EQUAL_MEMORY(bytes, copy, sizeof bytes);
    }
}

/* Eights of both in turn, clamped. */
static int packed(const int16_t *first, const int16_t *second, int k)
{
    const int value = (k % 16 < 8 ? first : second)[k / 16 * 8 + k % 8];

    return MAX(MIN(value, INT8_MAX), INT8_MIN);
}

static unsigned sum_of_eight(const uint8_t *byte)
{
    unsigned sum = 0;
    int k;

    for (k = 0; k < 8; k++) {
        sum += byte[k];
    }
    return sum;
}

static void lanes_of_8_bits(void)
{
    CHECK(ih_u8, uint8_t, ih_u8_all(first[0]), (first[0]));
    CHECK_TO(ih_i16, int16_t, int8_t, ih_i16_pack_eights(a, b), packed(first, second, k));
    CHECK_TO(ih_u8, uint8_t, uint64_t, ih_u8_sum_eights(a), sum_of_eight(&first[8 * k]));
}

#define LANES 32 /* of struct ih_u16_32 */

/* Three times 32 lanes, as a loop takes and puts them; the lanes around stay as they are. */
static void lanes_of_a_row(void)
{
    enum { COUNT = 3 * LANES };
    uint16_t row[COUNT + 8], copy[COUNT + 8];
    uint8_t byte[COUNT + 8];
    const uint16_t *from = &row[1];
    const uint8_t *from_byte = &byte[1];
    uint16_t *to = &copy[1], *widened = &copy[1];
    int32_t i;

    fill(row, sizeof row);
    fill(byte, sizeof byte);
    memcpy(copy, row, sizeof copy);
    memset(&copy[1], 0, COUNT * sizeof copy[0]);
    for (i = 0; i < COUNT; i += LANES) {
        struct ih_u16_32 value = ih_u16_32_next(&from, i);

        ih_u16_32_put(&to, i, &value);
        TEST_ASSERT_EQUAL_MEMORY(&row[1 + i], &value, LANES * sizeof row[0]);
    }
    TEST_ASSERT_EQUAL_MEMORY(row, copy, sizeof row);
    for (i = 0; i < COUNT; i += LANES) {
        struct ih_u16_32 value = ih_u16_32_next_u8(&from_byte, i);

        ih_u16_32_put(&widened, i, &value);
    }
    for (i = 0; i < COUNT; i++) {
        IH_TEST_EQUAL(byte[1 + i], copy[1 + i], "widened", i);
    }
}

static struct ih_u16_32 lanes_from(const uint16_t *lane)
{
    return ih_u16_32_next(&lane, 0);
}

static uint16_t lane_of(struct ih_u16_32 value, int k)
{
    return value.part[k / IH_I16_LANES][k % IH_I16_LANES];
}

static void lanes_of_16_bits_in_32(void)
{
    uint16_t first[LANES], second[LANES];
    int16_t max;
    int round, k;

    for (round = 0; round < ROUNDS; round++) {
        struct ih_u16_32 a, b, sixteenth;
        ih_i16 each;

        fill(first, sizeof first);
        fill(second, sizeof second);
        a = lanes_from(first);
        b = sixteenth = lanes_from(second);
        for (k = 0; k < IH_U16_PARTS; k++) {
            sixteenth.part[k] >>= 4;
        }
        each = ih_u16_32_max(a);
        for (k = 0; k < LANES; k++) {
            const uint16_t x = first[k], y = second[k];

            IH_TEST_EQUAL((uint16_t)(x + y), lane_of(ih_u16_32_add(a, b), k), "add", k);
            IH_TEST_EQUAL((uint16_t)(x - y), lane_of(ih_u16_32_sub(a, b), k), "sub", k);
            IH_TEST_EQUAL((uint16_t)(x + 2 * y), lane_of(ih_u16_32_add_twice(a, b), k), "add_twice",
                          k);
            IH_TEST_EQUAL((uint16_t)(x + (81 * (y >> 4) + 8) / 16),
                          lane_of(ih_u16_32_add_81_16ths(a, sixteenth), k), "add_81_16ths", k);
            IH_TEST_EQUAL(MAX((int16_t)x, (int16_t)y), (int16_t)lane_of(ih_u16_32_larger(a, b), k),
                          "larger", k);
        }
        for (k = 0; k < IH_I16_LANES; k++) {
            int i;

            max = (int16_t)first[k];
            for (i = k; i < LANES; i += IH_I16_LANES) {
                max = MAX(max, (int16_t)first[i]);
            }
            IH_TEST_EQUAL(max, each[k], "max", k);
        }
    }
}

static void lanes_change_their_positions(void)
{
    int16_t table[3 * IH_I16_LANES];

    fill(table, sizeof table);
    CHECK(ih_i16, int16_t, ih_i16_load_eights(&table[1], 20), (table[1 + k / 8 * 20 + k % 8]));
    CHECK(ih_i32, int32_t, ih_i32_even_twice(a), (first[k / 2 * 2]));
}

static void lanes_of_16_bits(void)
{
    CHECK(ih_u16, uint16_t, ih_u16_all(first[0]), (first[0]));
    CHECK(ih_i16, int16_t, ih_i16_abs(a), (x < 0 ? -x : x));
    CHECK(ih_i16, int16_t, ih_i16_all(first[0]), (first[0]));
    CHECK(ih_i16, int16_t, ih_i16_add(a, b), (x + y));
    CHECK(ih_i16, int16_t, ih_i16_sub(a, b), (x - y));
    CHECK(ih_i16, int16_t, ih_i16_negate(a), (-x));
    CHECK(ih_i16, int16_t, ih_i16_min(a, b), MIN(x, y));
    CHECK(ih_i16, int16_t, ih_i16_max(a, b), MAX(x, y));
    CHECK(ih_u16, uint16_t, ih_u16_mul_high(a, b), ((uint32_t)x * y >> 16));
}

static int64_t sum_of(const int32_t lane[IH_I32_LANES])
{
    int64_t sum = 0;
    int k;

    for (k = 0; k < IH_I32_LANES; k++) {
        sum += lane[k];
    }
    return sum;
}

static void lanes_of_32_bits(void)
{
    int bits;

    CHECK(ih_i32, int32_t, ih_i32_all(first[0]), (first[0]));
    CHECK(ih_i32, int32_t, ih_i32_add(a, b), ((int64_t)x + y));
    CHECK(ih_i32, int32_t, ih_i32_sub(a, b), ((int64_t)x - y));
    CHECK(ih_i32, int32_t, ih_i32_mul(a, b), ((int64_t)x * y));
    CHECK(ih_i32, int32_t, ih_i32_mul_low(a, b & 0xffff), ((int16_t)x * (int16_t)y));
    CHECK(ih_i32, int32_t, ih_i32_min(a, b), MIN(x, y));
    CHECK(ih_i32, int32_t, ih_i32_max(a, b), MAX(x, y));
    CHECK(ih_i32, int32_t, ih_i32_pick(a > b, a, b), (x > y ? x : y));
    for (bits = 0; bits < 32; bits++) {
        CHECK(ih_i32, int32_t, ih_i32_shift_left(a, bits), ((uint32_t)x << bits));
        CHECK(ih_i32, int32_t, ih_i32_shift_right(a, bits), (x >> bits));
        CHECK(ih_u32, uint32_t, ih_u32_shift_right(a, bits), (x >> bits));
    }
    CHECK(ih_i32, int32_t, ih_i32_abs(a), (x < 0 ? 0 - (uint32_t)x : (uint32_t)x));
    CHECK_TO(ih_i32, int32_t, int16_t, ih_i32_low_halves(a, b),
             (k < IH_I32_LANES ? first[k] : second[k - IH_I32_LANES]));
    CHECK_ONE(ih_i32, int32_t, ih_i32_total_wide(a), sum_of(first));
    CHECK(ih_u32, uint32_t, ih_u32_shift_left_each(a, b & (b - b + 31)), (x << (y & 31)));
    CHECK(ih_u32, uint32_t, ih_u32_shift_right_each(a, b & (b - b + 31)), (x >> (y & 31)));
}

static void lanes_of_64_bits(void)
{
    CHECK(ih_i64, int64_t, ih_i64_all(first[0]), (first[0]));
    CHECK(ih_i64, int64_t, ih_i64_add(a, b), ((uint64_t)x + (uint64_t)y));
    CHECK(ih_i64, int64_t, ih_i64_sub(a, b), ((uint64_t)x - (uint64_t)y));
}

static int32_t pair_sum(const int16_t *x, const int16_t *y)
{
    return (int32_t)((int64_t)x[0] * y[0] + (int64_t)x[1] * y[1]);
}

static struct ih_pair_sums pair_sums_of_three(ih_i16 a, ih_i16 b)
{
    return ih_pair_sums_add(ih_pair_sums_add(ih_pair_sums_first(a, b), a, a), b, b);
}

static void sums_of_pairs(void)
{
    CHECK_TO(ih_i16, int16_t, int32_t, ih_i16_madd_pairs(a, b),
             pair_sum(&first[2 * k], &second[2 * k]));
    CHECK_TO(ih_i16, int16_t, uint32_t, ih_pair_sums_total(pair_sums_of_three(a, b)),
             ((uint32_t)pair_sum(&first[2 * k], &second[2 * k]) +
              (uint32_t)pair_sum(&first[2 * k], &first[2 * k]) +
              (uint32_t)pair_sum(&second[2 * k], &second[2 * k])));
}

static void products_of_even_lanes(void)
{
    CHECK_TO(ih_i32, int32_t, int64_t, ih_i32_mul_even(a, b),
             ((int64_t)first[2 * k] * second[2 * k]));
    CHECK_TO(ih_u32, uint32_t, uint64_t, ih_u32_mul_even(a, b),
             ((uint64_t)first[2 * k] * second[2 * k]));
}

static int32_t total_of_32(const int32_t *lane)
{
    uint32_t sum = 0;
    int k;

    for (k = 0; k < IH_I32_LANES; k++) {
        sum += (uint32_t)lane[k];
    }
    return (int32_t)sum;
}

static int64_t total_of_64(const int64_t *lane)
{
    uint64_t sum = 0;
    int k;

    for (k = 0; k < IH_I64_LANES; k++) {
        sum += (uint64_t)lane[k];
    }
    return (int64_t)sum;
}

static uint32_t bits_where_above(const int16_t *x, const int16_t *y)
{
    uint32_t bits = 0;
    int k;

    for (k = 0; k < IH_I16_LANES; k++) {
        bits |= (uint32_t)(x[k] > y[k]) << k;
        bits |= (uint32_t)(y[k] > x[k]) << (k + IH_I16_LANES);
    }
    return bits;
}

/* As often as 32 lanes have room for it. */
static uint32_t bits_of_32(ih_i16 a, ih_i16 b)
{
    ih_i16 mask[32 / IH_I16_LANES];
    int i;

    for (i = 0; i < IH_TEST_COUNT(mask); i++) {
        mask[i] = i % 2 == 0 ? a : b;
    }
    return ih_i16_bits_32(mask);
}

static uint32_t repeated(uint32_t bits)
{
    return IH_I16_LANES == 8 ? bits | bits << 16 : bits;
}

static bool is_any_above(const int16_t *lane, int16_t limit)
{
    bool above = false;
    int k;

    for (k = 0; k < IH_I16_LANES; k++) {
        above |= lane[k] > limit;
    }
    return above;
}

static void all_lanes_together(void)
{
    static const int16_t zero[IH_I16_LANES];

    CHECK_ONE(ih_i32, int32_t, ih_i32_total(a), total_of_32(first));
    CHECK_ONE(ih_i64, int64_t, ih_i64_total(a), total_of_64(first));
    CHECK_ONE(ih_i16, int16_t, ih_i16_bits(a > b, b > a), bits_where_above(first, second));
    CHECK_ONE(ih_i16, int16_t, bits_of_32(a > b, b > a), repeated(bits_where_above(first, second)));
    CHECK_ONE(ih_i16, int16_t, ih_i16_any(a), memcmp(first, zero, sizeof zero) != 0);
    CHECK_ONE(ih_i16, int16_t, ih_i16_any(a > b),
              (bits_where_above(first, second) << 16 >> 16) % (1u << IH_I16_LANES) != 0);
    CHECK_ONE(ih_i16, int16_t, ih_i16_any_above(a, second[0]), is_any_above(first, second[0]));
}

static void one_bit_is_any(void)
{
    int bit;

    TEST_ASSERT_FALSE(ih_i16_any(ih_i16_all(0)));
    for (bit = 0; bit < 8 * IH_SIMD_BYTES; bit++) {
        int16_t lane[IH_I16_LANES] = {0};

        lane[bit / 16] = (int16_t)(1 << (bit % 16));
        TEST_ASSERT_TRUE(ih_i16_any(ih_i16_load(lane)));
    }
}

/* Two vectors of 32 bits each way, so that all lanes of a struct ih_wide are seen. */
struct wide_case {
    int32_t x[IH_I32_LANES], y[IH_I32_LANES];
    ih_i32 a, b;
    int64_t before[IH_I32_LANES], after[IH_I32_LANES];
};

static struct wide_case any_wide_case(void)
{
    struct wide_case it;

    fill(it.x, sizeof it.x);
    fill(it.y, sizeof it.y);
    fill(it.before, sizeof it.before);
    memcpy(it.after, it.before, sizeof it.after);
    it.a = ih_i32_load(it.x);
    it.b = ih_i32_load(it.y);
    return it;
}

static void wide_products(void)
{
    int round, k;

    for (round = 0; round < ROUNDS; round++) {
        struct wide_case it = any_wide_case();
        int64_t stored[IH_I32_LANES];

        ih_wide_store(stored, ih_i32_mul_wide(it.a, it.b));
        for (k = 0; k < IH_I32_LANES; k++) {
            IH_TEST_EQUAL((int64_t)it.x[k] * it.y[k], stored[k], "ih_i32_mul_wide", k);
        }
        ih_wide_store(stored, ih_u32_mul_wide((ih_u32)it.a, (ih_u32)it.b));
        for (k = 0; k < IH_I32_LANES; k++) {
            IH_TEST_EQUAL((uint64_t)(uint32_t)it.x[k] * (uint32_t)it.y[k], stored[k],
                          "ih_u32_mul_wide", k);
        }
        ih_wide_add_to(it.after, ih_i32_mul_wide(it.a, it.b));
        for (k = 0; k < IH_I32_LANES; k++) {
            IH_TEST_EQUAL((uint64_t)it.before[k] + (uint64_t)((int64_t)it.x[k] * it.y[k]),
                          it.after[k], "ih_wide_add_to", k);
        }
    }
}

/* A product over a power of two, and the half that rounds it. */
static void shifted_products(void)
{
    int bits;

    for (bits = 1; bits < 64; bits++) {
        const uint64_t half = (uint64_t)1 << (bits - 1);

        CHECK(ih_u32, uint32_t, ih_u32_mul_shift(a, b, bits), ((uint64_t)x * y >> bits));
        CHECK(ih_u32, uint32_t, ih_u32_mul_shift_round(a, b, bits),
              (((uint64_t)x * y + half) >> bits));
    }
    for (bits = 1; bits <= 32; bits++) {
        const int64_t half = (int64_t)1 << (bits - 1);

        CHECK(ih_i32, int32_t, ih_i32_mul_shift_round(a, b, bits),
              (((int64_t)x * y + half) >> bits));
    }
}

static void wide_numbers(void)
{
    int round, k;

    for (round = 0; round < ROUNDS; round++) {
        const struct wide_case it = any_wide_case();
        const int bits = round % 64;
        const struct ih_wide product = ih_u32_mul_wide((ih_u32)it.a, (ih_u32)it.b);
        const struct ih_wide sum = ih_wide_add(product, ih_wide_all(it.before[0]));
        int64_t stored[IH_I32_LANES];
        uint64_t total = 0;
        uint32_t low[IH_I32_LANES];

        ih_wide_store(stored, ih_wide_shift_right(sum, bits));
        ih_i32_store((int32_t *)low, (ih_i32)ih_wide_low(sum));
        for (k = 0; k < IH_I32_LANES; k++) {
            const uint64_t expected =
                (uint64_t)(uint32_t)it.x[k] * (uint32_t)it.y[k] + (uint64_t)it.before[0];

            IH_TEST_EQUAL(expected >> bits, stored[k], "ih_wide_shift_right", k);
            IH_TEST_EQUAL((uint32_t)expected, low[k], "ih_wide_low", k);
            total += expected;
        }
        IH_TEST_EQUAL(total, ih_wide_total(sum), "ih_wide_total", round);
    }
}

/* One factor below 2^31 without sign, the other of either sign. */
static void sums_of_wide_products(void)
{
    int round, k, row;

    for (round = 0; round < ROUNDS; round++) {
        struct ih_wide_sums sums = ih_wide_sums_zero();
        uint64_t expected[IH_I32_LANES] = {0};
        int64_t stored[IH_I32_LANES];

        for (row = 0; row < 5; row++) {
            const struct wide_case it = any_wide_case();

            sums = ih_wide_sums_add(sums, (ih_u32)it.a & (ih_u32)ih_i32_all(INT32_MAX), it.b);
            for (k = 0; k < IH_I32_LANES; k++) {
                expected[k] += (uint64_t)((int64_t)(it.x[k] & INT32_MAX) * it.y[k]);
            }
        }
        ih_wide_store(stored, ih_wide_sums_total(sums));
        for (k = 0; k < IH_I32_LANES; k++) {
            IH_TEST_EQUAL(expected[k], stored[k], "ih_wide_sums_add", k);
        }
    }
}

#if IH_SIMD_LANE_SHIFTS
static void look_ups(void)
{
    uint32_t table[300];

    fill(table, sizeof table);
    CHECK(ih_u32, uint32_t, ih_u32_look_up(table, a >> 24).value, table[x >> 24]);
    CHECK(ih_u32, uint32_t, ih_u32_look_up(table, a >> 24).next, table[(x >> 24) + 1]);
}

static void look_ups_of_16_bits(void)
{
    uint16_t table[300];

    fill(table, sizeof table);
    CHECK(ih_u32, uint32_t, ih_u32_look_up_u16(table, a >> 24).value, table[x >> 24]);
    CHECK(ih_u32, uint32_t, ih_u32_look_up_u16(table, a >> 24).next, table[(x >> 24) + 1]);
}

static void pairs_of_zeros(void)
{
    CHECK(ih_u32, uint32_t, ih_u32_zero_pairs((a >> 1) | (1u << 18)),
          (__builtin_clz(x >> 1 | 1u << 18) / 2));
}
#endif

#endif

int main(void)
{
    UNITY_BEGIN();
#if IH_I16_LANES > 0
    RUN_TEST(addresses_need_no_alignment);
    RUN_TEST(lanes_of_8_bits);
    RUN_TEST(lanes_of_16_bits);
    RUN_TEST(lanes_of_a_row);
    RUN_TEST(lanes_of_16_bits_in_32);
    RUN_TEST(lanes_change_their_positions);
    RUN_TEST(lanes_of_32_bits);
    RUN_TEST(lanes_of_64_bits);
    RUN_TEST(sums_of_pairs);
    RUN_TEST(products_of_even_lanes);
    RUN_TEST(all_lanes_together);
    RUN_TEST(one_bit_is_any);
    RUN_TEST(wide_products);
    RUN_TEST(shifted_products);
    RUN_TEST(wide_numbers);
    RUN_TEST(sums_of_wide_products);
#if IH_SIMD_LANE_SHIFTS
    RUN_TEST(look_ups);
    RUN_TEST(look_ups_of_16_bits);
    RUN_TEST(pairs_of_zeros);
#endif
#endif
    return UNITY_END();
}
