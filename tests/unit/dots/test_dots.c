/* ih_dots against scipy.ndimage, on frames that both sides make by the same formula. */
#include "base/ih_fix.h"
#include "dots/ih_bandpass.h"
#include "dots/ih_scanline.h"
#include "dots/ih_dots.h"
#include "dots/ih_noise.h"

#include <stdlib.h>

#include "ih_test_frame.h"

struct vector_dot {
    double u, v, peak;
};

struct vector_frame {
    struct vector_spec spec;
    int32_t edge_count, hot_count, dot_count;
    const struct vector_dot *dot;
};

struct vector_crowd {
    struct vector_spec spec;
    int32_t dot_count;
};

struct vector_pair {
    struct vector_frame lit;
    struct vector_spec ambient;
};

#include "dots.inc"

static struct ih_dots_params params;
static struct ih_dots_scratch scratch;
static struct ih_dots dots;

void setUp(void)
{
    ih_dots_params_default(&params);
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    memset(&dots, IH_TEST_FILL, sizeof dots);
}

void tearDown(void)
{
}

static void make(const struct vector_spec *spec)
{
    make_frame(spec);
    params.floor_grey_q4 = spec->floor_grey_q4;
    params.noise_gain_q8 = spec->noise_gain_q8;
}

static void find(void)
{
    ih_dots_find(&frame, NULL, &params, &scratch, &dots);
}

static const struct vector_frame *frame_named(const char *name)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_frames); i++) {
        if (strcmp(vector_frames[i].spec.name, name) == 0) {
            return &vector_frames[i];
        }
    }
    TEST_FAIL_MESSAGE(name);
    return &vector_frames[0];
}

static void compare(const struct vector_frame *v, int i)
{
    int k;

    IH_TEST_EQUAL(v->dot_count, dots.dot_count, v->spec.name, i);
    IH_TEST_EQUAL(v->edge_count, dots.edge_count, v->spec.name, i);
    IH_TEST_EQUAL(v->hot_count, dots.hot_count, v->spec.name, i);
    IH_TEST_EQUAL(0, dots.dots_dropped, v->spec.name, i);
    for (k = 0; k < v->dot_count; k++) {
        /* 0.01 px as the header promises. */
        IH_TEST_WITHIN(0.01, v->dot[k].u, ih_test_from_q(dots.dot[k].u_px_q12, 12), v->spec.name,
                       k);
        IH_TEST_WITHIN(0.01, v->dot[k].v, ih_test_from_q(dots.dot[k].v_px_q12, 12), v->spec.name,
                       k);
        /* Whole units on both sides; deeper greys are rounded to 12 bits by a multiplication, half
         * a level off here and there. */
        IH_TEST_WITHIN(exact_grey(&v->spec) ? 0 : 5, v->dot[k].peak, dots.dot[k].peak, v->spec.name,
                       k);
    }
    IH_TEST_UNTOUCHED(&dots.dot[dots.dot_count],
                      (size_t)(IH_DOTS_MAX - dots.dot_count) * sizeof dots.dot[0], v->spec.name);
}

static void dots_match_scipy(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_frames); i++) {
        make(&vector_frames[i].spec);
        memset(&dots, IH_TEST_FILL, sizeof dots);
        find();
        compare(&vector_frames[i], i);
    }
}

static void find_with_ambient(void)
{
    memset(&dots, IH_TEST_FILL, sizeof dots);
    ih_dots_find(&frame, &ambient, &params, &scratch, &dots);
}

static void dots_with_an_ambient_frame_match_scipy(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_pairs); i++) {
        make(&vector_pairs[i].ambient);
        keep_ambient();
        make(&vector_pairs[i].lit.spec);
        find_with_ambient();
        compare(&vector_pairs[i].lit, i);
    }
}

static void all_361_dots_are_found_in_order(void)
{
    int k;

    make(&frame_named("pattern")->spec);
    find();
    TEST_ASSERT_EQUAL_INT32(IH_SLOTS, dots.dot_count);
    for (k = 1; k < dots.dot_count; k++) {
        const struct ih_dot *one = &dots.dot[k - 1], *next = &dots.dot[k];

        TEST_ASSERT_TRUE(one->v_px_q12 < next->v_px_q12 ||
                         (one->v_px_q12 == next->v_px_q12 && one->u_px_q12 < next->u_px_q12));
    }
}

static void full_tables_are_counted(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_crowds); i++) {
        const struct vector_crowd *v = &vector_crowds[i];

        make(&v->spec);
        find();
        IH_TEST_EQUAL(IH_DOTS_MAX, dots.dot_count, v->spec.name, i);
        IH_TEST_EQUAL(v->dot_count - IH_DOTS_MAX, dots.dots_dropped, v->spec.name, i);
    }
}

static void flat_frames_have_no_dots(void)
{
    static const uint8_t levels[] = {0, 1, 127, 200, 254, 255};
    int i;

    for (i = 0; i < IH_TEST_COUNT(levels); i++) {
        fill8(640, 480, levels[i]);
        find();
        IH_TEST_EQUAL(0, dots.dot_count, "dots", levels[i]);
        IH_TEST_EQUAL(0, dots.edge_count + dots.hot_count, "maxima", levels[i]);
        IH_TEST_EQUAL(0, dots.dots_dropped, "dropped", levels[i]);
        IH_TEST_EQUAL(levels[i] > params.bright_grey, ih_dots_is_bright(&dots, 639, 479), "bright",
                      levels[i]);
    }
}

/* A spot of a Gaussian shape, sigma in px, on what is there; farther away it is rounded to nothing. */
static void add_spot(double u, double v, double sigma, double height)
{
    const int32_t reach = (int32_t)ceil(sigma * sqrt(2 * log(2 * height + 1))) + 1;
    int32_t iu, iv;

    for (iv = ih_max_s32(0, (int32_t)v - reach);
         iv <= ih_min_s32(frame.height - 1, (int32_t)v + reach + 1); iv++) {
        for (iu = ih_max_s32(0, (int32_t)u - reach);
             iu <= ih_min_s32(frame.width - 1, (int32_t)u + reach + 1); iu++) {
            const double r2 = (iu - u) * (iu - u) + (iv - v) * (iv - v);
            const double sum = grey8[iv * frame.width + iu] +
                               floor(height * exp(-0.5 * r2 / (sigma * sigma)) + 0.5);

            grey8[iv * frame.width + iu] = (uint8_t)(sum > 255.0 ? 255.0 : sum);
        }
    }
}

/* Closed form: one pixel of height h gives R = (81 * 4 h - 16 h) / 256 in 1/16 levels at itself and
 * 81 * 2 h - 16 h beside it, 0.474 of it: a hot pixel. */
static void one_bright_pixel_is_hot(void)
{
    fill8(320, 240, 0);
    grey8[100 * 320 + 200] = 100;
    find();
    TEST_ASSERT_EQUAL_INT32(0, dots.dot_count);
    TEST_ASSERT_EQUAL_INT32(1, dots.hot_count);
    params.side_min_q8 = 121; /* 0.4727 */
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.dot_count);
    TEST_ASSERT_EQUAL_INT32(200 * 4096, dots.dot[0].u_px_q12);
    TEST_ASSERT_EQUAL_INT32(100 * 4096, dots.dot[0].v_px_q12);
    TEST_ASSERT_EQUAL_INT32((81 * 4 - 16) * 100 * 16 / 256, dots.dot[0].peak);
    params.side_min_q8 = 122; /* 0.4766 */
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.hot_count);
}

static void a_block_of_equal_pixels_is_centred_between_them(void)
{
    fill8(320, 240, 0);
    grey8[100 * 320 + 200] = grey8[100 * 320 + 201] = 80;
    grey8[101 * 320 + 200] = grey8[101 * 320 + 201] = 80;
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.dot_count);
    IH_TEST_WITHIN(0.02, 200.5, ih_test_from_q(dots.dot[0].u_px_q12, 12), "u", 0);
    IH_TEST_WITHIN(0.02, 100.5, ih_test_from_q(dots.dot[0].v_px_q12, 12), "v", 0);
}

/* Wherever in its pixel a spot lies, from the sharpest to the widest. The window of 5x5 cuts wide
 * spots off, on one side more than on the other. */
static void spots_of_all_widths_are_centred(void)
{
    static const double sigma[] = {0.8, 1.0, 1.3, 1.7, 2.0};
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(sigma); i++) {
        for (k = 0; k < 25; k++) {
            const double u = 100 + 0.2 * (k % 5 - 2), v = 90 + 0.2 * (double)(k / 5 - 2);

            fill8(320, 240, 20);
            add_spot(u, v, sigma[i], 120);
            find();
            IH_TEST_EQUAL(1, dots.dot_count, "width", i);
            IH_TEST_WITHIN(sigma[i] < 1.5 ? 0.06 : 0.12, u,
                           ih_test_from_q(dots.dot[0].u_px_q12, 12), "u", i * 25 + k);
            IH_TEST_WITHIN(sigma[i] < 1.5 ? 0.06 : 0.12, v,
                           ih_test_from_q(dots.dot[0].v_px_q12, 12), "v", i * 25 + k);
        }
    }
}

/* Twice to sixteen times over-exposed, on dark and on bright ground: one dot, not several, and in the
 * middle of its plateau. */
static void over_exposed_spots_are_plateaus(void)
{
    static const struct {
        uint8_t ground;
        double sigma, height;
    } spot[] = {{40, 1.2, 430},  {40, 1.2, 1700},  {40, 1.2, 3400},  {40, 1.6, 860}, {40, 2.0, 430},
                {180, 1.2, 860}, {180, 1.2, 1700}, {180, 1.2, 3400}, {180, 1.6, 430}};
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(spot); i++) {
        for (k = 0; k < 25; k++) {
            const double u = 100 + 0.2 * (k % 5 - 2), v = 90 + 0.2 * (double)(k / 5 - 2);

            fill8(320, 240, spot[i].ground);
            add_spot(u, v, spot[i].sigma, spot[i].height);
            find();
            IH_TEST_EQUAL(1, dots.dot_count, "dots", i * 25 + k);
            IH_TEST_WITHIN(0.3, u, ih_test_from_q(dots.dot[0].u_px_q12, 12), "u", i * 25 + k);
            IH_TEST_WITHIN(0.3, v, ih_test_from_q(dots.dot[0].v_px_q12, 12), "v", i * 25 + k);
        }
    }
}

/* Texture of 40 levels in rows of 640, moved to the right. */
static void paint_texture(int32_t shift)
{
    int32_t u, v;

    fill8(640, 480, 0);
    for (v = 0; v < 480; v++) {
        for (u = 0; u < 640; u++) {
            const struct vector_spec spec = {.noise = 40, .loud = 40, .seed = 1};

            grey8[v * 640 + u] = (uint8_t)(100 + hash_noise(&spec, u - shift, v));
        }
    }
}

static void add_spots(double height)
{
    int32_t u, v;

    for (v = 30; v < 460; v += 40) {
        for (u = 30; u < 620; u += 40) {
            add_spot(u, v, 1.2, height);
        }
    }
}

/* How many of the spots are found, and how many others. */
static int32_t count_spots(int32_t *others)
{
    int32_t k, found = 0;

    for (k = 0; k < dots.dot_count; k++) {
        const int32_t u = (dots.dot[k].u_px_q12 + 2048) / 4096;
        const int32_t v = (dots.dot[k].v_px_q12 + 2048) / 4096;

        found += u % 40 >= 29 && u % 40 <= 31 && v % 40 >= 29 && v % 40 <= 31;
    }
    *others = dots.dot_count - found;
    return found;
}

/* What both frames show alike is taken away: dots that drown in texture come up. */
static void the_ambient_frame_takes_texture_away(void)
{
    int32_t others;

    paint_texture(0);
    keep_ambient();
    add_spots(20);
    find();
    IH_TEST_RANGE(0, 40, count_spots(&others), "without", 0);
    find_with_ambient();
    IH_TEST_EQUAL(11 * 15, count_spots(&others), "with", 0);
    IH_TEST_EQUAL(0, others, "others", 0);
}

/* The texture has moved by 3 px: the ambient frame is of no use, and does no harm. */
static void an_ambient_frame_that_moved_does_no_harm(void)
{
    static struct ih_dots plain;

    paint_texture(3);
    keep_ambient();
    paint_texture(0);
    add_spots(20);
    find();
    plain = dots;
    find_with_ambient();
    /* A block at the border, which has few pixels, may look quieter by chance. */
    IH_TEST_RANGE(plain.dot_count * 9 / 10, plain.dot_count * 11 / 10, dots.dot_count, "dots", 0);
}

/* A bright thing has moved before a still texture: its two ghosts, the dark and the bright, are no
 * dots, and the dots beside them stay. */
static void ghosts_are_no_dots(void)
{
    int32_t others, shift, found;

    for (shift = 1; shift <= 24; shift += 5) {
        paint_texture(0);
        paint_block(200 + shift, 150, 90, 160, 220);
        keep_ambient();
        paint_texture(0);
        paint_block(200, 150, 90, 160, 220);
        add_spots(25);
        find_with_ambient();
        found = count_spots(&others);
        IH_TEST_RANGE(150, 165, found, "found", shift);
        IH_TEST_RANGE(0, 30, others, "others", shift);
    }
}

/* The map of over-exposed blocks is that of the lit frame. */
static void subtracted_blocks_stay_over_exposed(void)
{
    fill8(320, 240, 255);
    keep_ambient();
    find_with_ambient();
    TEST_ASSERT_TRUE(ih_dots_is_bright(&dots, 100, 100));
    TEST_ASSERT_EQUAL_INT32(0, dots.dot_count);
    fill8(320, 240, 100);
    find_with_ambient();
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, 100, 100));
    TEST_ASSERT_EQUAL_INT32(0, dots.dot_count);
}

/* R > threshold, strictly; in a frame without noise the floor alone counts. One pixel of 4 gives
 * R = 308 * 64 / 256 = 77. */
static void the_threshold_itself_is_not_above(void)
{
    fill8(320, 240, 0);
    grey8[100 * 320 + 200] = 4;
    params.side_min_q8 = 0;
    params.floor_grey_q4 = 16; /* 81 */
    find();
    TEST_ASSERT_EQUAL_INT32(0, dots.dot_count);
    params.floor_grey_q4 = 15; /* 75.9, rounded 76 */
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.dot_count);
    params.floor_grey_q4 = 0;
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.dot_count); /* nothing else is above 0 */
}

/* What is bright along a line is no dot, however bright; a spot beside it is. */
static void edges_stripes_and_boards_are_no_dots(void)
{
    int32_t kind, u, v;

    for (kind = 0; kind < 5; kind++) {
        fill8(400, 300, 0);
        for (v = 0; v < 300; v++) {
            for (u = 0; u < 400; u++) {
                const bool on = kind == 0   ? u > 200
                                : kind == 1 ? v % 40 < 4
                                : kind == 2 ? (u + v) % 30 < 4
                                : kind == 3 ? ((u / 8 ^ v / 8) & 1) != 0
                                            : ((u ^ v) & 1) != 0;

                grey8[v * 400 + u] = on ? 150 : 50;
            }
        }
        find();
        for (u = 0; u < dots.dot_count; u++) { /* what ends in a corner of the frame is a spot */
            IH_TEST_RANGE(-12, 12, abs(dots.dot[u].u_px_q12 / 4096 - 200) - 200, "u", kind);
            IH_TEST_RANGE(-12, 12, abs(dots.dot[u].v_px_q12 / 4096 - 150) - 150, "v", kind);
        }
    }
    fill8(400, 300, 50);
    for (v = 0; v < 300; v++) {
        memset(&grey8[v * 400 + 200], 150, 200);
    }
    add_spot(180, 100, 1.2, 60);
    add_spot(220, 200, 1.2, 60);
    find();
    TEST_ASSERT_EQUAL_INT32(2, dots.dot_count);
}

/* A textured half costs the quiet half nothing. */
static void texture_elsewhere_hides_no_dot(void)
{
    struct ih_test_random random = {7};
    int32_t u, v, quiet = 0, k;

    fill8(640, 480, 60);
    for (v = 0; v < 480; v++) {
        for (u = 0; u < 640; u++) {
            const int64_t noise =
                u < 320 ? ih_test_between(&random, -1, 1) : ih_test_between(&random, -50, 50);

            grey8[v * 640 + u] = (uint8_t)(60 + noise);
        }
    }
    for (v = 30; v < 460; v += 40) {
        for (u = 30; u < 260; u += 40) {
            add_spot(u, v, 1.2, 8);
        }
    }
    find();
    for (k = 0; k < dots.dot_count; k++) {
        quiet += dots.dot[k].u_px_q12 < 270 * 4096;
    }
    TEST_ASSERT_EQUAL_INT32(11 * 6, quiet);
}

/* The same scene at 8 and at 16 bits: 65535 = 257 * 255 exactly. */
static void bit_depth_does_not_matter(void)
{
    static struct ih_dots eight;
    int32_t i;

    make(&frame_named("grey8")->spec);
    find();
    eight = dots;
    for (i = 0; i < frame.width * frame.height; i++) {
        grey16[i] = (uint16_t)(257 * grey8[i]);
    }
    view(frame.width, frame.height, 65535);
    find();
    TEST_ASSERT_EQUAL_INT32(eight.dot_count, dots.dot_count);
    for (i = 0; i < dots.dot_count; i++) {
        /* Rounded to 12 bits both times; the 16-bit gain is off by 6e-5 of a level at most. */
        IH_TEST_WITHIN(0.002, ih_test_from_q(eight.dot[i].u_px_q12, 12),
                       ih_test_from_q(dots.dot[i].u_px_q12, 12), "u", i);
        IH_TEST_WITHIN(0.002, ih_test_from_q(eight.dot[i].v_px_q12, 12),
                       ih_test_from_q(dots.dot[i].v_px_q12, 12), "v", i);
    }
}

static void samples_above_the_maximum_are_full_scale(void)
{
    static struct ih_dots limited;
    int32_t i;

    make(&frame_named("grey10")->spec); /* maximum 1023 */
    for (i = 0; i < frame.width * frame.height; i += 97) {
        grey16[i] = 1023;
    }
    find();
    limited = dots;
    for (i = 0; i < frame.width * frame.height; i += 97) {
        grey16[i] = (uint16_t)(1024 + i % 60000);
    }
    find();
    TEST_ASSERT_EQUAL_MEMORY(limited.dot, dots.dot, (size_t)dots.dot_count * sizeof dots.dot[0]);
    TEST_ASSERT_EQUAL_MEMORY(limited.bright, dots.bright, sizeof dots.bright);
    TEST_ASSERT_EQUAL_INT32(limited.dot_count, dots.dot_count);
}

static void a_stride_skips_what_lies_between_rows(void)
{
    static struct ih_dots tight;
    static uint8_t padded[240 * 400];
    int32_t v;

    make(&frame_named("grey8")->spec);
    find();
    tight = dots;
    memset(padded, 255, sizeof padded);
    for (v = 0; v < 240; v++) {
        memcpy(&padded[v * 400], &grey8[v * 320], 320);
    }
    frame.samples = padded;
    frame.stride_bytes = 400;
    find();
    TEST_ASSERT_EQUAL_INT32(tight.dot_count, dots.dot_count);
    TEST_ASSERT_EQUAL_MEMORY(tight.dot, dots.dot, (size_t)dots.dot_count * sizeof dots.dot[0]);
    TEST_ASSERT_EQUAL_MEMORY(tight.bright, dots.bright, sizeof dots.bright);
}

/* All rows come in the same place. */
static void row_by_row_is_the_same_as_the_whole_frame(void)
{
    static struct ih_dots whole;
    static struct ih_noise noise;
    static uint8_t newest[IH_FRAME_WIDTH_MAX];
    int32_t v;

    make(&frame_named("loud")->spec);
    find();
    whole = dots;
    ih_noise_measure(&frame, NULL, &scratch.rows.measuring, &noise);
    memset(&dots, 0, sizeof dots);
    memset(&scratch, IH_TEST_FILL, sizeof scratch);
    ih_dots_begin(&scratch, &dots, &params, frame.width, frame.height, &noise);
    for (v = 0; v < frame.height; v++) {
        struct ih_scanline row = ih_frame_scanline(&frame, v);

        memcpy(newest, row.samples, (size_t)frame.width);
        row.samples = newest;
        ih_dots_row(&scratch, &dots, &row, NULL);
        memset(newest, v % 2 * 255, sizeof newest);
    }
    ih_dots_end(&scratch, &dots);
    TEST_ASSERT_EQUAL_INT32(whole.dot_count, dots.dot_count);
    TEST_ASSERT_EQUAL_INT32(whole.edge_count, dots.edge_count);
    TEST_ASSERT_EQUAL_INT32(whole.hot_count, dots.hot_count);
    TEST_ASSERT_EQUAL_MEMORY(whole.dot, dots.dot, (size_t)dots.dot_count * sizeof dots.dot[0]);
}

/* Noise that differs from place to place, lines, single pixels, full and empty areas, spots; the same in
 * the corners and on the borders. */
static void fill_hard(int32_t width, int32_t height, uint32_t seed)
{
    struct ih_test_random random = {seed};
    int32_t i, u, v;

    fill8(width, height, 0);
    for (v = 0; v < height; v++) {
        for (u = 0; u < width; u++) {
            const int32_t kind = (u / 56 + v / 40 + (int32_t)seed) % 7;
            const int32_t noise = (int32_t)ih_test_between(&random, 0, 255);

            grey8[v * width + u] = (uint8_t)(kind == 0   ? noise
                                             : kind == 1 ? (u % 9 < 2) * 255
                                             : kind == 2 ? (v % 11 < 3) * 180 + noise / 8
                                             : kind == 3 ? (noise > 252) * 255
                                             : kind == 4 ? 255 - (noise > 250) * 255
                                             : kind == 5 ? 20 + noise / 64 + noise % 3
                                                         : (u * 2 + v + noise / 16) % 256);
        }
    }
    for (i = 0; i < 200; i++) {
        const int32_t spot_u = (int32_t)ih_test_between(&random, 0, width - 1);
        const int32_t spot_v = (int32_t)ih_test_between(&random, 0, height - 1);

        add_spot(i % 9 == 0   ? 0
                 : i % 9 == 1 ? width - 1
                              : spot_u,
                 i % 9 == 2   ? 0
                 : i % 9 == 3 ? height - 1
                              : spot_v,
                 1.2, 3 * i % 250);
    }
}

/* Lowest and highest R, and limits of all kinds, around the frame and where none of its rows came yet. */
static void what_was_in_memory_does_not_matter(void)
{
    static const int32_t sizes[][2] = {{320, 240}, {333, 247}, {1279, 242}};
    static const int32_t fills[] = {0, 1, 0x7f, 0x80, 0xff};
    static struct ih_dots first;
    int32_t i, k;

    for (i = 0; i < IH_TEST_COUNT(sizes); i++) {
        fill_hard(sizes[i][0], sizes[i][1], (uint32_t)i + 17);
        for (k = 0; k < IH_TEST_COUNT(fills); k++) {
            memset(&scratch, fills[k], sizeof scratch);
            memset(&dots, 0, sizeof dots);
            find();
            if (k == 0) {
                first = dots;
            }
            IH_TEST_EQUAL(first.edge_count, dots.edge_count, "edges", i * 1000 + fills[k]);
            TEST_ASSERT_EQUAL_MEMORY(&first, &dots, sizeof dots);
        }
    }
}

/* R with a border of zeros. */
static int16_t plain[IH_FRAME_HEIGHT_MAX + 2][IH_FRAME_WIDTH_MAX + 2];

static void filter_whole(void)
{
    static struct ih_bandpass band;
    const uint8_t *row[IH_BANDPASS_ROWS];
    int32_t i, v;

    memset(plain, 0, sizeof plain);
    for (v = 0; v < frame.height; v++) {
        for (i = 0; i < IH_BANDPASS_ROWS; i++) {
            row[i] =
                ih_frame_scanline(&frame, ih_clamp_s32(v + i - 4, 0, frame.height - 1)).samples;
        }
        ih_bandpass_bytes(&band, row, frame.width, &plain[v + 1][1]);
    }
}

static int32_t plain_maxima(void)
{
    int32_t count = 0, i, u, v;

    for (v = 0; v < frame.height; v++) {
        const struct ih_noise_row noise = ih_noise_row(&scratch.noise, v);

        for (u = 0; u < frame.width; u++) {
            const int16_t peak = plain[v + 1][u + 1];
            const int32_t floor = (params.floor_grey_q4 * IH_BANDPASS_UNIT + 8) >> 4;
            const int32_t noisy = (ih_noise_at(&noise, u) * params.noise_gain_q8 + 128) >> 8;
            bool is_maximum = peak > floor && peak > noisy;

            for (i = 0; i < 9; i++) {
                const int16_t other = plain[v + i / 3][u + i % 3];

                is_maximum = is_maximum && (i < 4 ? peak > other : peak >= other);
            }
            count += is_maximum;
        }
    }
    return count;
}

/* What is passed over in groups has no maximum above its own threshold: every one that a plain search
 * finds is a dot or was refused for a reason. */
static void no_maximum_is_passed_over(void)
{
    static const int32_t sizes[][2] = {{320, 240}, {321, 247}, {383, 256}, {752, 300}, {1280, 241}};
    static const int32_t gains[] = {0, 300, 1178, 4000};
    int32_t i, k;

    for (i = 0; i < IH_TEST_COUNT(sizes); i++) {
        fill_hard(sizes[i][0], sizes[i][1], (uint32_t)i);
        filter_whole();
        for (k = 0; k < IH_TEST_COUNT(gains); k++) {
            params.noise_gain_q8 = gains[k];
            params.floor_grey_q4 = k == 1 ? 0 : 29;
            find();
            IH_TEST_EQUAL(plain_maxima(),
                          dots.dot_count + dots.edge_count + dots.hot_count + dots.dots_dropped,
                          "maxima", i * 10 + k);
        }
    }
}

/* Whole blocks and those that the frame cuts off, with the ambient frame and without. */
static void bright_blocks_are_those_of_a_bright_mean(void)
{
    static const int32_t sizes[][2] = {{320, 240}, {321, 241}, {327, 247}, {753, 301}};
    static const int32_t limits[] = {-1, 0, 60, 127, 200, 254, 255};
    int32_t i, k, u, v, column, row, bright = 0;

    for (i = 0; i < 2 * IH_TEST_COUNT(sizes); i++) {
        const int32_t width = sizes[i / 2][0], height = sizes[i / 2][1];

        fill_hard(width, height, (uint32_t)i);
        keep_ambient();
        for (k = 0; k < IH_TEST_COUNT(limits); k++) {
            params.bright_grey = limits[k];
            if (i % 2 == 0) {
                find();
            } else {
                find_with_ambient();
            }
            for (row = 0; row < height; row += 8) {
                for (column = 0; column < width; column += 8) {
                    int32_t sum = 0, count = 0;

                    for (v = row; v < row + 8 && v < height; v++) {
                        for (u = column; u < column + 8 && u < width; u++) {
                            sum += grey8[v * width + u];
                            count++;
                        }
                    }
                    IH_TEST_EQUAL(sum > limits[k] * count, ih_dots_is_bright(&dots, column, row),
                                  "bright", row * 10000 + column);
                    bright += sum > limits[k] * count;
                }
            }
        }
    }
    TEST_ASSERT_GREATER_THAN_INT32(10000, bright);
}

/* Turned by 180 degrees, a picture has the same dots at the mirrored places. */
static void a_turned_frame_has_turned_dots(void)
{
    static struct ih_dots upright;
    int32_t i, last;

    make(&frame_named("border")->spec); /* no noise: other rows are looked at for it */
    find();
    upright = dots;
    last = frame.width * frame.height - 1;
    for (i = 0; i < last - i; i++) {
        const uint8_t swap = grey8[i];

        grey8[i] = grey8[last - i];
        grey8[last - i] = swap;
    }
    find();
    TEST_ASSERT_EQUAL_INT32(upright.dot_count, dots.dot_count);
    for (i = 0; i < dots.dot_count; i++) {
        const struct ih_dot *rotated = &dots.dot[dots.dot_count - 1 - i];

        /* A unit each: halves are rounded away from zero on both sides. */
        IH_TEST_RANGE((frame.width - 1) * 4096 - upright.dot[i].u_px_q12 - 1,
                      (frame.width - 1) * 4096 - upright.dot[i].u_px_q12 + 1, rotated->u_px_q12,
                      "u", i);
        IH_TEST_RANGE((frame.height - 1) * 4096 - upright.dot[i].v_px_q12 - 1,
                      (frame.height - 1) * 4096 - upright.dot[i].v_px_q12 + 1, rotated->v_px_q12,
                      "v", i);
        IH_TEST_EQUAL(upright.dot[i].peak, rotated->peak, "peak", i);
    }
}

static void bright_blocks_are_those_above_the_limit(void)
{
    fill8(323, 245, 0); /* the last blocks have 3 columns and 5 rows */
    paint_block(16, 24, 8, 8, 201);
    paint_block(32, 24, 8, 8, 200);
    paint_block(320, 40, 3, 8, 201);
    paint_block(80, 240, 8, 5, 201);
    paint_block(320, 240, 3, 5, 255);
    find();
    TEST_ASSERT_TRUE(ih_dots_is_bright(&dots, 16, 24));
    TEST_ASSERT_TRUE(ih_dots_is_bright(&dots, 23, 31));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, 24, 31));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, 15, 24));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, 16, 32));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, 32, 24)); /* 200 is not above 200 */
    TEST_ASSERT_TRUE(ih_dots_is_bright(&dots, 322, 47));
    TEST_ASSERT_TRUE(ih_dots_is_bright(&dots, 80, 244));
    TEST_ASSERT_TRUE(ih_dots_is_bright(&dots, 322, 244));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, 300, 244));
}

static void nothing_is_bright_outside_the_frame(void)
{
    fill8(320, 240, 255);
    find();
    TEST_ASSERT_TRUE(ih_dots_is_bright(&dots, 0, 0));
    TEST_ASSERT_TRUE(ih_dots_is_bright(&dots, 319, 239));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, -1, 0));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, 0, -1));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, 320, 0));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, 0, 240));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, IH_FRAME_WIDTH_MAX, 0));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, 0, IH_FRAME_HEIGHT_MAX));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, INT32_MIN, INT32_MAX));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, INT32_MAX, INT32_MIN));
}

/* The hardest pictures for sums and tables, at the largest size; they must end and stay sane. */
static void extreme_pictures_are_survived(void)
{
    int32_t kind, i;

    for (kind = 0; kind < 4; kind++) {
        for (i = 0; i < PIXELS_MAX; i++) {
            const int32_t u = i % IH_FRAME_WIDTH_MAX, v = i / IH_FRAME_WIDTH_MAX;
            const bool on = kind == 0   ? ((u ^ v) & 1) != 0
                            : kind == 1 ? ((u / 8 ^ v / 8) & 1) != 0
                            : kind == 2 ? u % 3 == 0
                                        : v % 5 == 0;

            grey16[i] = on ? 65535 : 0;
        }
        view(IH_FRAME_WIDTH_MAX, IH_FRAME_HEIGHT_MAX, 65535);
        params.noise_gain_q8 = kind == 1 ? 0 : 128;
        params.floor_grey_q4 = 1;
        params.ring_max_q8 = 512;
        params.side_min_q8 = -1024;
        find();
        IH_TEST_RANGE(0, IH_DOTS_MAX, dots.dot_count, "count", kind);
        for (i = 0; i < dots.dot_count; i++) {
            IH_TEST_RANGE(0, (IH_FRAME_WIDTH_MAX - 1) * 4096, dots.dot[i].u_px_q12, "u", i);
            IH_TEST_RANGE(0, (IH_FRAME_HEIGHT_MAX - 1) * 4096, dots.dot[i].v_px_q12, "v", i);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(dots_match_scipy);
    RUN_TEST(dots_with_an_ambient_frame_match_scipy);
    RUN_TEST(the_ambient_frame_takes_texture_away);
    RUN_TEST(an_ambient_frame_that_moved_does_no_harm);
    RUN_TEST(ghosts_are_no_dots);
    RUN_TEST(subtracted_blocks_stay_over_exposed);
    RUN_TEST(all_361_dots_are_found_in_order);
    RUN_TEST(full_tables_are_counted);
    RUN_TEST(flat_frames_have_no_dots);
    RUN_TEST(one_bright_pixel_is_hot);
    RUN_TEST(a_block_of_equal_pixels_is_centred_between_them);
    RUN_TEST(spots_of_all_widths_are_centred);
    RUN_TEST(over_exposed_spots_are_plateaus);
    RUN_TEST(the_threshold_itself_is_not_above);
    RUN_TEST(edges_stripes_and_boards_are_no_dots);
    RUN_TEST(texture_elsewhere_hides_no_dot);
    RUN_TEST(bit_depth_does_not_matter);
    RUN_TEST(samples_above_the_maximum_are_full_scale);
    RUN_TEST(a_stride_skips_what_lies_between_rows);
    RUN_TEST(row_by_row_is_the_same_as_the_whole_frame);
    RUN_TEST(what_was_in_memory_does_not_matter);
    RUN_TEST(no_maximum_is_passed_over);
    RUN_TEST(bright_blocks_are_those_of_a_bright_mean);
    RUN_TEST(a_turned_frame_has_turned_dots);
    RUN_TEST(bright_blocks_are_those_above_the_limit);
    RUN_TEST(nothing_is_bright_outside_the_frame);
    RUN_TEST(extreme_pictures_are_survived);
    return UNITY_END();
}
