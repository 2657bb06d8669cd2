/* ih_band against scipy.ndimage, on frames that both sides make by the same formula. */
#include "ih_band.h"

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

#include "band.inc"

static struct ih_band band;
static int16_t response[IH_FRAME_HEIGHT_MAX][IH_FRAME_WIDTH_MAX];

void setUp(void)
{
    memset(&band, IH_TEST_FILL, sizeof band);
    memset(response, IH_TEST_FILL, sizeof response);
}

void tearDown(void)
{
}

/* The whole frame, its first and last row repeated outside. */
static void filter(void)
{
    int32_t v, rows = 0;

    ih_band_begin(&band, frame.width);
    for (v = -IH_BAND_REACH; v < frame.height + IH_BAND_REACH; v++) {
        const int32_t inside = v < 0 ? 0 : v >= frame.height ? frame.height - 1 : v;
        const struct ih_row row = ih_frame_row(&frame, inside);

        ih_row_grey(&row, frame.width, band.incoming_q4);
        rows += ih_band_push(&band, response[rows]);
    }
    TEST_ASSERT_EQUAL_INT32(frame.height, rows);
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
            IH_TEST_RANGE(-IH_BAND_UNIT / 2, IH_BAND_UNIT / 2, response[v][u], "R", v * 320 + u);
        }
    }
}

/* The extremes that the header names: nine bright pixels on black, nine black ones on white. */
static void the_greatest_responses_fit(void)
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
    IH_TEST_UNTOUCHED(&band.grey_q4[3][320], sizeof band.grey_q4[0][0], "ring");
    IH_TEST_UNTOUCHED(&response[3][320], sizeof response[0][0], "response");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(responses_match_scipy);
    RUN_TEST(constants_have_no_response);
    RUN_TEST(slopes_have_no_response);
    RUN_TEST(the_greatest_responses_fit);
    RUN_TEST(a_second_frame_starts_afresh);
    RUN_TEST(pixels_beyond_the_width_do_not_matter);
    return UNITY_END();
}
