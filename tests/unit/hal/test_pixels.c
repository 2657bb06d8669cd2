/* Layouts of a camera's memory, against bytes that were laid out by hand and by bit position. */
#include "linux/hal_pixels.h"

#include <stdlib.h>

#include "ih_test.h"

#define WIDTH_MAX 23
#define HEIGHT 3
#define STRIDE_MAX 96

static uint8_t bytes[HEIGHT * STRIDE_MAX];
static uint16_t wanted[HEIGHT][WIDTH_MAX];
static uint16_t got[HEIGHT * WIDTH_MAX + 8];
static struct ih_test_random random_source;

void setUp(void)
{
    random_source.state = 7;
}

void tearDown(void)
{
}

/* The kernel's table for Y10P: Y0[9:2] Y1[9:2] Y2[9:2] Y3[9:2] Y3[1:0]Y2[1:0]Y1[1:0]Y0[1:0]. */
static void ten_bits_are_packed_as_mipi_does(void)
{
    const uint8_t group[5] = {0xFF, 0x00, 0x80, 0x2A, 0xE4};
    const uint16_t samples[4] = {0x3FC, 0x001, 0x202, 0x0AB};

    hal_pixels_decode(HAL_PIXELS_10P, group, sizeof group, 4, 1, got);
    TEST_ASSERT_EQUAL_HEX16_ARRAY(samples, got, 4);
}

/* Y12P: Y0[11:4] Y1[11:4] Y1[3:0]Y0[3:0]. */
static void twelve_bits_are_packed_as_mipi_does(void)
{
    const uint8_t groups[6] = {0xAB, 0x12, 0x3C, 0x00, 0xFF, 0xF0};
    const uint16_t samples[4] = {0xABC, 0x123, 0x000, 0xFFF};

    hal_pixels_decode(HAL_PIXELS_12P, groups, sizeof groups, 4, 1, got);
    TEST_ASSERT_EQUAL_HEX16_ARRAY(samples, got, 4);
}

static void two_bytes_have_the_low_one_first(void)
{
    const uint8_t pairs[6] = {0x34, 0x12, 0xFF, 0x03, 0x00, 0x80};
    const uint16_t samples[3] = {0x1234, 0x03FF, 0x8000};

    hal_pixels_decode(HAL_PIXELS_16LE, pairs, sizeof pairs, 3, 1, got);
    TEST_ASSERT_EQUAL_HEX16_ARRAY(samples, got, 3);
}

static void luma_is_every_second_byte(void)
{
    const uint8_t pairs[8] = {10, 128, 20, 129, 30, 130, 40, 131};
    const uint8_t even[4] = {10, 20, 30, 40}, odd[4] = {128, 129, 130, 131};
    uint8_t luma[4];

    hal_pixels_decode(HAL_PIXELS_YUYV, pairs, sizeof pairs, 4, 1, luma);
    TEST_ASSERT_EQUAL_UINT8_ARRAY(even, luma, 4);
    hal_pixels_decode(HAL_PIXELS_UYVY, pairs, sizeof pairs, 4, 1, luma);
    TEST_ASSERT_EQUAL_UINT8_ARRAY(odd, luma, 4);
}

/* Where bit number `bit` of sample x of a row is: a bit position counted from the row's first
 * byte's lowest. Written from the tables, one bit at a time. */
static int32_t bit_place(enum hal_pixels_layout layout, int32_t x, int32_t bit)
{
    int32_t byte;

    switch (layout) {
    case HAL_PIXELS_16LE:
        return 16 * x + bit;
    case HAL_PIXELS_10P:
        byte = x / 4 * 5;
        return bit >= 2 ? (byte + x % 4) * 8 + bit - 2 : (byte + 4) * 8 + x % 4 * 2 + bit;
    case HAL_PIXELS_12P:
        byte = x / 2 * 3;
        return bit >= 4 ? (byte + x % 2) * 8 + bit - 4 : (byte + 2) * 8 + x % 2 * 4 + bit;
    case HAL_PIXELS_UYVY:
        return 16 * x + 8 + bit;
    default:
        return 16 * x + bit;
    }
}

static int32_t depth_bits(enum hal_pixels_layout layout)
{
    return layout == HAL_PIXELS_16LE  ? 16
           : layout == HAL_PIXELS_12P ? 12
           : layout == HAL_PIXELS_10P ? 10
                                      : 8;
}

/* Random samples among random bytes, so that what stands between and behind them matters if read. */
static void lay_out(enum hal_pixels_layout layout, int32_t width, int32_t stride)
{
    int32_t x, y, bit;

    for (x = 0; x < (int32_t)sizeof bytes; x++) {
        bytes[x] = (uint8_t)ih_test_u64(&random_source);
    }
    for (y = 0; y < HEIGHT; y++) {
        for (x = 0; x < width; x++) {
            wanted[y][x] =
                (uint16_t)(ih_test_u64(&random_source) & ((1u << depth_bits(layout)) - 1u));
            for (bit = 0; bit < depth_bits(layout); bit++) {
                const int32_t place = bit_place(layout, x, bit);
                const uint32_t value = (uint32_t)wanted[y][x] >> bit & 1u;
                uint8_t *byte = &bytes[y * stride + place / 8];

                *byte = (uint8_t)((*byte & ~(1u << place % 8)) | value << place % 8);
            }
        }
    }
}

static void check_decoded(enum hal_pixels_layout layout, int32_t width)
{
    const int32_t sample_bytes = hal_pixels_sample_bytes(layout);
    const uint8_t *narrow = (const uint8_t *)got;
    int32_t x, y;

    for (y = 0; y < HEIGHT; y++) {
        for (x = 0; x < width; x++) {
            const int32_t at = y * width + x;

            IH_TEST_EQUAL(wanted[y][x], sample_bytes == 2 ? got[at] : narrow[at], "sample", at);
        }
    }
    IH_TEST_UNTOUCHED((uint8_t *)got + HEIGHT * width * sample_bytes,
                      sizeof got - (size_t)(HEIGHT * width * sample_bytes), "behind the samples");
}

/* Every width up to several groups, so every remainder, and strides with and without padding. The
 * bytes end where the last row's do: the sanitizer sees a step beyond. */
static void every_width_and_stride(void)
{
    const enum hal_pixels_layout layouts[] = {HAL_PIXELS_16LE, HAL_PIXELS_10P, HAL_PIXELS_12P,
                                              HAL_PIXELS_YUYV, HAL_PIXELS_UYVY};
    int32_t kind, width, padding;

    for (kind = 0; kind < IH_TEST_COUNT(layouts); kind++) {
        for (width = 1; width <= WIDTH_MAX; width++) {
            for (padding = 0; padding <= 7; padding++) {
                const int32_t row = hal_pixels_row_bytes(layouts[kind], width);
                const int32_t stride = row + padding;
                const size_t size = (size_t)(stride * (HEIGHT - 1) + row);
                uint8_t *exact = malloc(size);

                TEST_ASSERT_NOT_NULL(exact);
                TEST_ASSERT_TRUE(HEIGHT * stride <= (int32_t)sizeof bytes);
                lay_out(layouts[kind], width, stride);
                memcpy(exact, bytes, size);
                memset(got, IH_TEST_FILL, sizeof got);
                hal_pixels_decode(layouts[kind], exact, (size_t)stride, width, HEIGHT, got);
                free(exact);
                check_decoded(layouts[kind], width);
            }
        }
    }
}

static void rows_take_whole_groups(void)
{
    /* of 752, 753, 754, 755 pixels */
    const int32_t ten[4] = {940, 945, 945, 945};
    const int32_t twelve[4] = {1128, 1131, 1131, 1134};
    int32_t k;

    for (k = 0; k < 4; k++) {
        TEST_ASSERT_EQUAL_INT32(752 + k, hal_pixels_row_bytes(HAL_PIXELS_8, 752 + k));
        TEST_ASSERT_EQUAL_INT32(1504 + 2 * k, hal_pixels_row_bytes(HAL_PIXELS_16LE, 752 + k));
        TEST_ASSERT_EQUAL_INT32(ten[k], hal_pixels_row_bytes(HAL_PIXELS_10P, 752 + k));
        TEST_ASSERT_EQUAL_INT32(twelve[k], hal_pixels_row_bytes(HAL_PIXELS_12P, 752 + k));
        TEST_ASSERT_EQUAL_INT32(1504 + (k + 1) / 2 * 4,
                                hal_pixels_row_bytes(HAL_PIXELS_YUYV, 752 + k));
    }
}

/* Two bytes are read as they are only where the machine would store them so. */
static void what_is_read_in_place(void)
{
    const uint16_t one = 1;
    uint8_t first;

    memcpy(&first, &one, 1);
    TEST_ASSERT_TRUE(hal_pixels_is_view(HAL_PIXELS_8));
    TEST_ASSERT_EQUAL_INT(first == 1, hal_pixels_is_view(HAL_PIXELS_16LE));
    TEST_ASSERT_FALSE(hal_pixels_is_view(HAL_PIXELS_10P));
    TEST_ASSERT_FALSE(hal_pixels_is_view(HAL_PIXELS_12P));
    TEST_ASSERT_FALSE(hal_pixels_is_view(HAL_PIXELS_YUYV));
    TEST_ASSERT_FALSE(hal_pixels_is_view(HAL_PIXELS_UYVY));
    TEST_ASSERT_EQUAL_INT32(1, hal_pixels_sample_bytes(HAL_PIXELS_8));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(ten_bits_are_packed_as_mipi_does);
    RUN_TEST(twelve_bits_are_packed_as_mipi_does);
    RUN_TEST(two_bytes_have_the_low_one_first);
    RUN_TEST(luma_is_every_second_byte);
    RUN_TEST(every_width_and_stride);
    RUN_TEST(rows_take_whole_groups);
    RUN_TEST(what_is_read_in_place);
    return UNITY_END();
}
