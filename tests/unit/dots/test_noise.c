/* ih_noise against NumPy, on frames that both sides make by the same formula. */
#include "dots/ih_bandpass.h"
#include "dots/ih_block_median.h"
#include "dots/ih_noise.h"

#include <stdlib.h>

#include "ih_test_frame.h"

struct vector_place {
    int32_t u, v;
    double noise;
};

struct vector_noise {
    struct vector_spec spec;
    int32_t columns, rows;
    const double *block;
    int32_t place_count;
    const struct vector_place *place;
};

struct vector_pair {
    struct vector_spec lit, ambient;
    const double *block;
    const uint8_t *subtract;
};

#include "noise.inc"

static struct ih_noise_scratch scratch;
static struct ih_noise noise;

void setUp(void)
{
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    memset(&noise, IH_TEST_FILL, sizeof noise);
}

void tearDown(void)
{
}

static int32_t at(int32_t u, int32_t v)
{
    const struct ih_noise_row row = ih_noise_row(&noise, v);

    return ih_noise_at(&row, u);
}

static void blocks_match_numpy(void)
{
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(vector_noises); i++) {
        const struct vector_noise *v = &vector_noises[i];

        make_frame(&v->spec);
        ih_noise_measure(&frame, NULL, &scratch, &noise);
        IH_TEST_EQUAL(v->columns, noise.columns, v->spec.name, i);
        IH_TEST_EQUAL(v->rows, noise.rows, v->spec.name, i);
        for (k = 0; k < v->columns * v->rows; k++) {
            /* Two smoothings round by half a unit each; a grey that rounds the other way moves a
             * median by a few units at most. */
            IH_TEST_WITHIN(exact_grey(&v->spec) ? 1.0 : 4.0, v->block[k],
                           noise.median[k / v->columns][k % v->columns], v->spec.name, k);
        }
    }
}

static void places_match_numpy(void)
{
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(vector_noises); i++) {
        const struct vector_noise *v = &vector_noises[i];

        make_frame(&v->spec);
        ih_noise_measure(&frame, NULL, &scratch, &noise);
        for (k = 0; k < v->place_count; k++) {
            /* As the blocks, and half a unit for each of the two interpolations. */
            IH_TEST_WITHIN(exact_grey(&v->spec) ? 2.0 : 5.0, v->place[k].noise,
                           at(v->place[k].u, v->place[k].v), v->spec.name, k);
        }
    }
}

static void pairs_match_numpy(void)
{
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(vector_pairs); i++) {
        const struct vector_pair *v = &vector_pairs[i];

        make_frame(&v->ambient);
        keep_ambient();
        make_frame(&v->lit);
        ih_noise_measure(&frame, &ambient, &scratch, &noise);
        for (k = 0; k < noise.columns * noise.rows; k++) {
            const int32_t row = k / noise.columns, column = k % noise.columns;

            IH_TEST_EQUAL(v->subtract[k], noise.subtract[row][column], v->lit.name, k);
            IH_TEST_WITHIN(exact_grey(&v->lit) ? 1.6 : 5.0, v->block[k], noise.median[row][column],
                           v->lit.name, k);
        }
    }
}

/* A dark ambient frame takes nothing away, one of noise alone does harm and is left out. */
static void useless_ambient_frames_are_left_out(void)
{
    static struct ih_noise plain;
    struct ih_test_random random = {5};
    int32_t i;

    make_frame(&vector_noises[0].spec);
    ih_noise_measure(&frame, NULL, &scratch, &plain);
    keep_ambient();
    memset(ambient8, 0, sizeof ambient8);
    ih_noise_measure(&frame, &ambient, &scratch, &noise);
    TEST_ASSERT_EQUAL_MEMORY(&plain, &noise, sizeof noise);
    for (i = 0; i < frame.width * frame.height; i++) {
        ambient8[i] = (uint8_t)ih_test_between(&random, 90, 110);
    }
    ih_noise_measure(&frame, &ambient, &scratch, &noise);
    TEST_ASSERT_EQUAL_MEMORY(&plain, &noise, sizeof noise);
    for (i = 0; i < frame.width * frame.height;
         i++) { /* the same, but light has been switched off */
        ambient8[i] = (uint8_t)(grey8[i] + 10);
    }
    ih_noise_measure(&frame, &ambient, &scratch, &noise);
    TEST_ASSERT_EQUAL_MEMORY(&plain, &noise, sizeof noise);
}

/* A share that goes from all to nothing over a block leaves a ramp, not a step. */
static void the_share_has_no_seams(void)
{
    uint16_t lit[640], under[640];
    int32_t u, v;

    memset(&noise, 0, sizeof noise);
    noise.columns = 20;
    noise.rows = 15;
    noise.subtract[7][10] = 1;
    for (v = 0; v < 480; v++) {
        for (u = 0; u < 640; u++) {
            lit[u] = under[u] = 2064;
        }
        ih_noise_subtract(&noise, v, 640, under, lit);
        for (u = 0; u + 1 < 640; u++) {
            IH_TEST_RANGE(-64, 64, lit[u + 1] - lit[u], "step", v * 640 + u); /* 2000 / 32 */
        }
        IH_TEST_EQUAL(v < 208 || v > 271 ? 2064 : lit[336], lit[336], "column", v);
    }
    ih_noise_subtract(&noise, 239, 640, under, lit);
}

static void flat_frames_have_no_noise(void)
{
    fill8(1280, 800, 255);
    ih_noise_measure(&frame, NULL, &scratch, &noise);
    TEST_ASSERT_EQUAL_INT32(40, noise.columns);
    TEST_ASSERT_EQUAL_INT32(25, noise.rows);
    TEST_ASSERT_EQUAL_INT32(0, at(0, 0));
    TEST_ASSERT_EQUAL_INT32(0, at(1279, 799));
}

/* From one pixel to the next the noise changes by a 32nd of a block's difference, never more: no
 * seams. */
static void there_are_no_seams(void)
{
    int32_t u, v, max = 0;

    make_frame(&vector_noises[IH_TEST_COUNT(vector_noises) - 1].spec);
    ih_noise_measure(&frame, NULL, &scratch, &noise);
    for (v = 0; v < noise.rows; v++) {
        for (u = 0; u + 1 < noise.columns; u++) {
            const int32_t step = noise.median[v][u + 1] - noise.median[v][u];

            max = step > max ? step : -step > max ? -step : max;
        }
    }
    TEST_ASSERT_GREATER_THAN_INT32(100, max);
    for (v = 0; v < frame.height; v += 13) {
        for (u = 0; u + 1 < frame.width; u++) {
            IH_TEST_RANGE(-max / 32 - 2, max / 32 + 2, at(u + 1, v) - at(u, v), "step",
                          v * frame.width + u);
        }
    }
}

static int32_t block_at(int32_t row, int32_t column)
{
    return noise.median[row < noise.rows ? row : noise.rows - 1]
                       [column < noise.columns ? column : noise.columns - 1];
}

/* The minimum of the blocks around a column, in the two rows of blocks whose centres a row lies between; no pixel
 * of the column is below it. */
static void no_pixel_of_a_block_is_below_its_minimum(void)
{
    int32_t i, u, v;

    make_frame(&vector_noises[IH_TEST_COUNT(vector_noises) - 1].spec);
    ih_noise_measure(&frame, NULL, &scratch, &noise);
    for (v = 0; v < frame.height; v += 5) {
        const struct ih_noise_row row = ih_noise_row(&noise, v);

        for (u = 0; u < frame.width; u++) {
            const int32_t above = v < 16 ? 0 : (v - 16) / 32;
            int32_t min = INT32_MAX;

            for (i = 0; i < 6; i++) {
                const int32_t column = u / 32 + i % 3 - 1;
                const int32_t block = block_at(above + i / 3, column < 0 ? 0 : column);

                min = block < min ? block : min;
            }
            IH_TEST_EQUAL(min, ih_noise_min(&row, u / 32), "least", v * 10000 + u);
            IH_TEST_RANGE(min, INT32_MAX, at(u, v), "noise", v * 10000 + u);
        }
    }
}

static int compare_values(const void *a, const void *b)
{
    return *(const uint16_t *)a - *(const uint16_t *)b;
}

/* The first block's median, before it is smoothed, is the value in the middle of the sorted ones:
 * where all blocks are alike smoothing changes nothing. Small and large responses, and at the
 * frame's right border blocks of few columns. */
static void medians_are_those_of_sorted_values(void)
{
    static const int32_t heights[] = {1, 2, 5, 9, 17, 40, 100, 255};
    static int16_t out[IH_FRAME_WIDTH_MAX];
    static struct ih_bandpass band;
    const uint8_t *row[IH_BANDPASS_ROWS];
    struct ih_test_random random = {11};
    uint16_t value[64];
    int32_t i, k, u, v, period;

    for (i = 0; i < IH_TEST_COUNT(heights); i++) {
        for (period = 32; period >= 1; period /= 4) {
            fill8(352, 256, 0);
            for (v = 0; v < 16; v++) {
                for (u = 0; u < 32; u++) {
                    grey8[v * 352 + u] = (uint8_t)ih_test_between(&random, 0, heights[i]);
                }
            }
            for (v = 0; v < 256; v++) { /* periods of 16 rows and of up to 32 columns */
                for (u = 0; u < 352; u++) {
                    grey8[v * 352 + u] = grey8[v % 16 * 352 + u % period];
                }
            }
            ih_noise_measure(&frame, NULL, &scratch, &noise);
            for (k = 0; k < IH_BANDPASS_ROWS; k++) {
                row[k] = &grey8[(96 + k) * 352];
            }
            ih_bandpass_bytes(&band, row, 352, out);
            for (k = 0; k < 64; k++) {
                value[k] = (uint16_t)abs(out[128 + k % 32]);
            }
            qsort(value, 64, sizeof value[0], compare_values);
            IH_TEST_EQUAL(value[32], noise.median[3][4], "median", heights[i] * 100 + period);
        }
    }
}

/* Blocks at the right border lack columns, those at the lower border rows. */
static void medians_do_not_count_pixels_that_blocks_lack(void)
{
    static const int32_t widths[] = {320, 321, 335, 350, 351, 352, 385, 479, 751, 1279, 1280};
    static const int32_t largest[] = {3, 200, 300, 18360};
    struct ih_test_random random = {13};
    uint16_t value[64], median[IH_NOISE_BLOCKS_X];
    int32_t i, k, u, count, row, rows;

    for (i = 0; i < IH_TEST_COUNT(widths) * IH_TEST_COUNT(largest); i++) {
        const int32_t width = widths[i / IH_TEST_COUNT(largest)];
        const int32_t max = largest[i % IH_TEST_COUNT(largest)];

        for (rows = 1; rows <= IH_BLOCK_MEDIAN_ROWS; rows++) {
            static int16_t response[IH_BLOCK_MEDIAN_ROWS][IH_FRAME_WIDTH_MAX], copy[2][1280];

            for (k = 0; k < rows * width; k++) {
                copy[k / width][k % width] = (int16_t)ih_test_between(&random, -max, max);
            }
            memset(response, IH_TEST_FILL, sizeof response);
            memcpy(response[0], copy[0], (size_t)width * sizeof copy[0][0]);
            memcpy(response[rows - 1], copy[rows - 1], (size_t)width * sizeof copy[0][0]);
            ih_block_medians(response, width, rows, median);
            for (k = 0; k < (width + 31) / 32; k++) {
                count = 0;
                for (row = 0; row < rows; row++) {
                    for (u = 32 * k; u < width && u < 32 * k + 32; u++) {
                        value[count++] = (uint16_t)abs(copy[row][u]);
                    }
                }
                qsort(value, (size_t)count, sizeof value[0], compare_values);
                IH_TEST_EQUAL(value[count / 2], median[k], "median", width * 100 + k);
            }
        }
    }
}

/* A bright dot in every block, as close as the pattern comes: the noise stays that of the frame. */
static void dots_are_no_noise(void)
{
    int32_t u, v, plain;
    struct ih_test_random random = {3};

    fill8(640, 480, 0);
    for (v = 0; v < 480 * 640; v++) {
        grey8[v] = (uint8_t)(60 + ih_test_between(&random, -4, 4));
    }
    ih_noise_measure(&frame, NULL, &scratch, &noise);
    plain = at(320, 240);
    for (v = 12; v < 470; v += 28) {
        for (u = 12; u < 630; u += 28) {
            paint_block(u - 1, v - 1, 3, 3, 250);
        }
    }
    ih_noise_measure(&frame, NULL, &scratch, &noise);
    IH_TEST_RANGE(plain * 9 / 10, plain * 13 / 10, at(320, 240), "noise", 0);
}

static void the_hardest_frames_fit(void)
{
    int32_t i;

    fill8(1280, 800, 0);
    for (i = 0; i < PIXELS_MAX; i++) {
        grey8[i] = (i % 1280 / 3 + i / 1280 / 3) % 4 == 0 ? 255 : 0;
    }
    ih_noise_measure(&frame, NULL, &scratch, &noise);
    for (i = 0; i < 1280; i += 5) {
        IH_TEST_RANGE(0, 18360, at(i, i * 5 / 8), "noise", i);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(blocks_match_numpy);
    RUN_TEST(places_match_numpy);
    RUN_TEST(pairs_match_numpy);
    RUN_TEST(useless_ambient_frames_are_left_out);
    RUN_TEST(the_share_has_no_seams);
    RUN_TEST(flat_frames_have_no_noise);
    RUN_TEST(there_are_no_seams);
    RUN_TEST(no_pixel_of_a_block_is_below_its_minimum);
    RUN_TEST(medians_are_those_of_sorted_values);
    RUN_TEST(medians_do_not_count_pixels_that_blocks_lack);
    RUN_TEST(dots_are_no_noise);
    RUN_TEST(the_hardest_frames_fit);
    return UNITY_END();
}
