/* ih_bandpass against scipy.ndimage, on frames that both sides make by the same formula. */
#include "base/ih_fix.h"
#include "dots/ih_bandpass.h"
#include "dots/ih_scanline.h"

#include <stdlib.h>

#include "ih_test_frame.h"

struct vector_response {
    int32_t u, v;
    double r;
};

struct vector_band {
    struct vector_spec spec;
    int32_t response_count;
    const struct vector_response *response;
};

#include "bandpass.inc"

static struct ih_bandpass band;
static int16_t response[IH_FRAME_HEIGHT_MAX][IH_FRAME_WIDTH_MAX];

static struct ih_bandpass_row listed; /* of the newest row of R */

void setUp(void)
{
    memset(&band, IH_TEST_FILL, sizeof band);
    memset(response, IH_TEST_FILL, sizeof response);
    memset(&listed, IH_TEST_FILL, sizeof listed);
    listed.limit = NULL;
}

void tearDown(void)
{
}

/* A row of the frame, in the format that its samples allow. */
static bool push(int32_t v, int16_t *out)
{
    static uint16_t grey_q4[IH_FRAME_WIDTH_MAX];
    const struct ih_scanline row = ih_frame_scanline(&frame, v);

    listed.response = out;
    if (band.is_bytes) {
        return ih_bandpass_push_bytes(&band, row.samples, &listed);
    }
    ih_scanline_grey(&row, frame.width, grey_q4);
    return ih_bandpass_push_grey(&band, grey_q4, &listed);
}

/* The newest row once more. */
static bool repeat(int16_t *out)
{
    listed.response = out;
    return ih_bandpass_repeat(&band, &listed);
}

/* The whole frame, its first and last row repeated outside. */
static void filter_as(bool is_bytes)
{
    int32_t v, rows = 0;

    ih_bandpass_begin(&band, frame.width, is_bytes);
    TEST_ASSERT_FALSE(push(0, response[0]));
    for (v = 1; v <= IH_BANDPASS_REACH; v++) {
        TEST_ASSERT_FALSE(repeat(response[0]));
    }
    for (v = 1; v < frame.height; v++) {
        rows += push(v, response[rows]);
    }
    for (v = 0; v < IH_BANDPASS_REACH; v++) {
        rows += repeat(response[rows]);
    }
    TEST_ASSERT_EQUAL_INT32(frame.height, rows);
}

static void filter(void)
{
    const struct ih_scanline row = ih_frame_scanline(&frame, 0);

    filter_as(ih_scanline_is_bytes(&row));
}

static void responses_match_scipy(void)
{
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(vector_bands); i++) {
        const struct vector_band *v = &vector_bands[i];

        make_frame(&v->spec);
        filter();
        for (k = 0; k < v->response_count; k++) {
            const struct vector_response *r = &v->response[k];

            /* Rounded to whole units. Deeper greys may be half a 12-bit level off where the
             * multiplication rounds the other way: at most (81 * 16 + 16 * 81) / 512 more. */
            IH_TEST_WITHIN(exact_grey(&v->spec) ? 0.5 : 5.6, r->r, response[r->v][r->u],
                           v->spec.name, k);
        }
    }
}

static void constants_have_no_response(void)
{
    static const uint8_t levels[] = {0, 1, 127, 254, 255};
    int32_t i, u, v;

    for (i = 0; i < IH_TEST_COUNT(levels); i++) {
        fill8(321, 241, levels[i]);
        filter();
        for (v = 0; v < 241; v++) {
            for (u = 0; u < 321; u++) {
                IH_TEST_EQUAL(0, response[v][u], "R", levels[i]);
            }
        }
    }
}

/* A slope has none either, away from the borders. */
static void slopes_have_no_response(void)
{
    int32_t u, v;

    fill8(320, 240, 0);
    for (v = 0; v < 240; v++) {
        for (u = 0; u < 320; u++) {
            grey8[v * 320 + u] = (uint8_t)(u / 4 + v / 2);
        }
    }
    filter();
    for (v = 4; v < 236; v++) {
        for (u = 4; u < 316; u++) {
            IH_TEST_RANGE(-IH_BANDPASS_UNIT / 2, IH_BANDPASS_UNIT / 2, response[v][u], "R",
                          v * 320 + u);
        }
    }
}

/* The extremes that the header names: nine bright pixels on black, nine black ones on white. */
static void the_largest_responses_fit(void)
{
    fill8(320, 240, 0);
    paint_block(100, 100, 3, 3, 255);
    filter();
    TEST_ASSERT_EQUAL_INT16(18360, response[101][101]);
    fill8(320, 240, 255);
    paint_block(100, 100, 3, 3, 0);
    filter();
    TEST_ASSERT_EQUAL_INT16(-18360, response[101][101]);
}

/* Noise, lines, single pixels, areas that are full and empty, at all borders. */
static void fill_hard(int32_t width, int32_t height, uint32_t seed)
{
    struct ih_test_random random = {seed};
    int32_t u, v;

    fill8(width, height, 0);
    for (v = 0; v < height; v++) {
        for (u = 0; u < width; u++) {
            const int32_t kind = (u / 40 + v / 24) % 6;
            const int32_t noise = (int32_t)ih_test_between(&random, 0, 255);

            grey8[v * width + u] = (uint8_t)(kind == 0   ? noise
                                             : kind == 1 ? (u % 7 < 3) * 255
                                             : kind == 2 ? (v % 5 < 2) * 255
                                             : kind == 3 ? (noise > 250) * 255
                                             : kind == 4 ? 255 - (noise > 250) * 255
                                                         : (u * 3 + v + noise / 16) % 256);
        }
    }
}

/* What the header says, pixel by pixel, in 12 bits. */
static int32_t plain(int32_t u, int32_t v)
{
    int32_t du, dv, inner = 0, box = 0;

    for (dv = -4; dv <= 4; dv++) {
        for (du = -4; du <= 4; du++) {
            const int32_t at_u = u + du < 0 ? 0 : u + du >= frame.width ? frame.width - 1 : u + du;
            const int32_t at_v = v + dv < 0               ? 0
                                 : v + dv >= frame.height ? frame.height - 1
                                                          : v + dv;
            const int32_t grey_q4 = 16 * grey8[at_v * frame.width + at_u];
            const bool is_inner = du >= -1 && du <= 1 && dv >= -1 && dv <= 1;

            box += grey_q4;
            inner += is_inner ? grey_q4 * (du == 0 ? 2 : 1) * (dv == 0 ? 2 : 1) : 0;
        }
    }
    return (81 * inner - 16 * box + 128) >> 8;
}

/* Of bytes, of their grey levels in 12 bits, and of nine rows alone: the same to the bit, for widths
 * that no vector divides too. */
static void all_ways_give_what_the_header_says(void)
{
    static const int32_t widths[] = {320, 321, 333, 350, 367, 751, 1279, 1280};
    static int16_t row_response[IH_FRAME_WIDTH_MAX];
    const uint8_t *row[IH_BANDPASS_ROWS];
    int32_t i, k, u, v;

    for (i = 0; i < IH_TEST_COUNT(widths); i++) {
        fill_hard(widths[i], 240, (uint32_t)i + 1);
        filter_as(true);
        for (v = 0; v < 240; v += v < 12 || v > 225 ? 1 : 11) {
            for (u = 0; u < widths[i]; u++) {
                IH_TEST_EQUAL(plain(u, v), response[v][u], "bytes", v * 10000 + u);
            }
        }
        for (v = 0; v < 240; v++) {
            for (k = 0; k < IH_BANDPASS_ROWS; k++) {
                const int32_t at = v + k - IH_BANDPASS_REACH;

                row[k] = &grey8[(at < 0 ? 0 : at > 239 ? 239 : at) * widths[i]];
            }
            ih_bandpass_bytes(&band, row, widths[i], row_response);
            TEST_ASSERT_EQUAL_MEMORY(response[v], row_response,
                                     (size_t)widths[i] * sizeof row_response[0]);
        }
        memset(&band, IH_TEST_FILL, sizeof band);
        memset(response, IH_TEST_FILL, sizeof response);
        filter_as(false);
        for (v = 0; v < 240; v += v < 12 || v > 225 ? 1 : 11) {
            for (u = 0; u < widths[i]; u++) {
                IH_TEST_EQUAL(plain(u, v), response[v][u], "grey", v * 10000 + u);
            }
        }
    }
}

/* For a row of R: limits that a group's maximum meets, which is not above, or exceeds by one. */
static void lay_limits(const int16_t *row, int32_t parity, int16_t *limit)
{
    int32_t max = 0, u;

    for (u = 0; u < frame.width; u++) {
        max = u % IH_BANDPASS_GROUP == 0 || row[u] > max ? row[u] : max;
        limit[u / IH_BANDPASS_GROUP] =
            (int16_t)ih_max_s32(0, max - (u / IH_BANDPASS_GROUP + parity) % 2);
    }
}

/* Groups of a row that have something above their limit; behind the row nothing is. */
static int32_t expect_groups(const int16_t *row, const int16_t *limit, int16_t *first)
{
    int32_t count = 0, u;

    for (u = 0; u < frame.width; u++) {
        const int16_t group = (int16_t)(u / IH_BANDPASS_GROUP * IH_BANDPASS_GROUP);

        if (row[u] > limit[u / IH_BANDPASS_GROUP] && (count == 0 || first[count - 1] != group)) {
            first[count++] = group;
        }
    }
    return count;
}

/* Whatever the width, as rows are pushed and as they are repeated. */
static void groups_above_their_limits_are_listed(void)
{
    static const int32_t widths[] = {320, 321, 335, 350, 367, 751, 1279, 1280};
    static int16_t row[IH_FRAME_WIDTH_MAX + IH_BANDPASS_GROUP];
    int16_t limit[IH_BANDPASS_GROUPS];
    int16_t first[IH_BANDPASS_GROUPS];
    int32_t count, i, total, v;

    for (i = 0; i < 2 * IH_TEST_COUNT(widths); i++) {
        fill_hard(widths[i / 2], 240, (uint32_t)i);
        listed.limit = NULL;
        filter_as(i % 2 == 0);
        ih_bandpass_begin(&band, frame.width, i % 2 == 0);
        listed.limit = limit;
        memset(row, 0, sizeof row);
        total = 0;
        for (v = 0; v < 240 + IH_BANDPASS_REACH; v++) {
            const int32_t middle = v - IH_BANDPASS_REACH;

            lay_limits(response[ih_max_s32(0, middle)], v, limit);
            if (!(v < 240 ? push(v, row) : repeat(row)) || middle < IH_BANDPASS_REACH) {
                continue;
            }
            count = expect_groups(response[middle], limit, first);
            IH_TEST_EQUAL(count, listed.count, "groups", i * 1000 + v);
            TEST_ASSERT_EQUAL_MEMORY(first, listed.first, (size_t)count * sizeof first[0]);
            total += count;
        }
        IH_TEST_RANGE(1000, 236 * (frame.width / IH_BANDPASS_GROUP), total, "all groups", i);
    }
}

/* The address sanitizer sees a pixel outside of them. */
static void nine_rows_are_read_to_their_ends(void)
{
    static const int32_t widths[] = {320, 321, 335, 751, 1280};
    static int16_t together[IH_FRAME_WIDTH_MAX], apart[IH_FRAME_WIDTH_MAX];
    const uint8_t *row[IH_BANDPASS_ROWS];
    uint8_t *copy[IH_BANDPASS_ROWS];
    int32_t i, k;

    for (i = 0; i < IH_TEST_COUNT(widths); i++) {
        const size_t bytes = (size_t)widths[i];

        fill_hard(widths[i], 240, (uint32_t)i + 91);
        for (k = 0; k < IH_BANDPASS_ROWS; k++) {
            row[k] = &grey8[k * widths[i]];
        }
        ih_bandpass_bytes(&band, row, widths[i], together);
        for (k = 0; k < IH_BANDPASS_ROWS; k++) {
            copy[k] = malloc(bytes);
            TEST_ASSERT_NOT_NULL(copy[k]);
            memcpy(copy[k], row[k], bytes);
            row[k] = copy[k];
        }
        ih_bandpass_bytes(&band, row, widths[i], apart);
        TEST_ASSERT_EQUAL_MEMORY(together, apart, bytes * sizeof apart[0]);
        for (k = 0; k < IH_BANDPASS_ROWS; k++) {
            free(copy[k]);
        }
    }
}

/* Of the newest rows, whatever their count. */
static void columns_are_sums_of_rows(void)
{
    static uint16_t sum[IH_FRAME_WIDTH_MAX];
    int32_t i, rows, u, v;

    fill_hard(333, 240, 77);
    ih_bandpass_begin(&band, frame.width, true);
    for (v = 0; v < 40; v++) {
        (void)push(v, response[0]);
        for (rows = 1; rows <= 8 && rows <= v; rows++) {
            ih_bandpass_columns(&band, rows, sum);
            for (u = 0; u < frame.width; u++) {
                int32_t expected = 0;

                for (i = 0; i < rows; i++) {
                    expected += grey8[(v - i) * frame.width + u];
                }
                IH_TEST_EQUAL(expected, sum[u], "columns", rows * 10000 + u);
            }
        }
    }
}

/* The largest sum of three columns is found, one of them may be outside. */
static void the_brightest_columns_are_known(void)
{
    static uint16_t sum[IH_FRAME_WIDTH_MAX];
    int32_t u, v;

    fill_hard(333, 240, 78);
    ih_bandpass_begin(&band, frame.width, true);
    for (v = 0; v < 40; v++) {
        int32_t max = 0;

        (void)push(v, response[0]);
        if (v < IH_BANDPASS_ROWS) {
            continue;
        }
        ih_bandpass_columns(&band, IH_BANDPASS_KEPT, sum);
        for (u = 0; u < frame.width; u++) {
            const int32_t three =
                sum[u > 0 ? u - 1 : 0] + sum[u] + sum[u + 1 < frame.width ? u + 1 : u];

            max = three > max ? three : max;
        }
        max = 3 * sum[0] > max ? 3 * sum[0] : max;
        max = 3 * sum[frame.width - 1] > max ? 3 * sum[frame.width - 1] : max;
        TEST_ASSERT_TRUE(ih_bandpass_is_any_above(&band, max - 1));
        TEST_ASSERT_FALSE(ih_bandpass_is_any_above(&band, max));
    }
}

/* Nothing of the frame before is left. */
static void a_second_frame_starts_afresh(void)
{
    static int16_t first[240][IH_FRAME_WIDTH_MAX];

    make_frame(&vector_bands[0].spec);
    filter();
    memcpy(first, response, sizeof first);
    fill8(400, 300, 255);
    filter();
    make_frame(&vector_bands[0].spec);
    filter();
    TEST_ASSERT_EQUAL_MEMORY(first[239], response[239], 320 * sizeof first[0][0]);
    TEST_ASSERT_EQUAL_MEMORY(first[0], response[0], 320 * sizeof first[0][0]);
}

/* What is right of the frame's width in the row buffers is never read or written. */
static void pixels_beyond_the_width_do_not_matter(void)
{
    fill8(320, 240, 77);
    filter();
    IH_TEST_UNTOUCHED(&band.three[0][IH_BANDPASS_LEAD + 320 + IH_BANDPASS_STEP],
                      sizeof band.three[0][0], "sums");
    IH_TEST_UNTOUCHED(&response[3][320], sizeof response[0][0], "response");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(responses_match_scipy);
    RUN_TEST(constants_have_no_response);
    RUN_TEST(slopes_have_no_response);
    RUN_TEST(the_largest_responses_fit);
    RUN_TEST(all_ways_give_what_the_header_says);
    RUN_TEST(groups_above_their_limits_are_listed);
    RUN_TEST(nine_rows_are_read_to_their_ends);
    RUN_TEST(columns_are_sums_of_rows);
    RUN_TEST(the_brightest_columns_are_known);
    RUN_TEST(a_second_frame_starts_afresh);
    RUN_TEST(pixels_beyond_the_width_do_not_matter);
    return UNITY_END();
}
