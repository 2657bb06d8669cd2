/* ih_dots against scipy.ndimage, on frames that both sides make by the same formula. */
#include "ih_dots.h"

#include "ih_test.h"

struct vector_spot {
    int32_t u_q4, v_q4, radius_q4, height;
};

struct vector_box {
    int32_t u_first, v_first, u_last, v_last, height;
};

/* Makes a frame: see pixel(). */
struct vector_spec {
    const char *name;
    int32_t width, height, maximum, background, noise, slope_u, slope_v, seed;
    int32_t tile_width, tile_height;
    int32_t floor_grey_q4, noise_gain_q8;
    int32_t spot_count;
    const struct vector_spot *spot;
    int32_t box_count;
    const struct vector_box *box;
};

struct vector_dot {
    double u, v, peak;
};

struct vector_frame {
    struct vector_spec spec;
    int32_t median, threshold, small_count, large_count, dot_count;
    const struct vector_dot *dot;
};

struct vector_crowd {
    struct vector_spec spec;
    int32_t dot_count, runs_over;
};

#include "dots.inc"

#define PIXELS_MAX (IH_FRAME_WIDTH_MAX * IH_FRAME_HEIGHT_MAX)

static int32_t marks[PIXELS_MAX];
static uint8_t grey8[PIXELS_MAX];
static uint16_t grey16[PIXELS_MAX];
static struct ih_frame frame;
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

static void mark_spots(const struct vector_spec *spec)
{
    int32_t i, u, v;

    for (i = 0; i < spec->spot_count; i++) {
        const struct vector_spot *s = &spec->spot[i];
        const int32_t radius2 = s->radius_q4 * s->radius_q4;

        for (v = (s->v_q4 - s->radius_q4) / 16; v <= (s->v_q4 + s->radius_q4) / 16; v++) {
            for (u = (s->u_q4 - s->radius_q4) / 16; u <= (s->u_q4 + s->radius_q4) / 16; u++) {
                const int32_t du = 16 * u - s->u_q4, dv = 16 * v - s->v_q4;

                if (u >= 0 && v >= 0 && u < spec->tile_width && v < spec->tile_height &&
                    du * du + dv * dv < radius2) {
                    marks[v * spec->tile_width + u] +=
                        s->height * (radius2 - du * du - dv * dv) / radius2;
                }
            }
        }
    }
}

static void mark_boxes(const struct vector_spec *spec)
{
    int32_t i, u, v;

    for (i = 0; i < spec->box_count; i++) {
        const struct vector_box *b = &spec->box[i];

        for (v = b->v_first; v <= b->v_last; v++) {
            for (u = b->u_first; u <= b->u_last; u++) {
                marks[v * spec->tile_width + u] += b->height;
            }
        }
    }
}

static int32_t hash_noise(const struct vector_spec *spec, int32_t u, int32_t v)
{
    uint32_t h =
        (uint32_t)u * 73856093u ^ (uint32_t)v * 19349663u ^ (uint32_t)spec->seed * 83492791u;

    h ^= h >> 13;
    h *= 0x5bd1e995u;
    h ^= h >> 15;
    return (int32_t)(h % (uint32_t)(2 * spec->noise + 1)) - spec->noise;
}

static int32_t pixel(const struct vector_spec *spec, int32_t u, int32_t v)
{
    const int32_t slope = spec->slope_u * u + spec->slope_v * v;
    const int32_t floor256 = (slope - (slope % 256 + 256) % 256) / 256;
    const int32_t mark = marks[v % spec->tile_height * spec->tile_width + u % spec->tile_width];
    const int32_t value = spec->background + floor256 + hash_noise(spec, u, v) + mark;

    return value < 0 ? 0 : value > spec->maximum ? spec->maximum : value;
}

static void view(int32_t width, int32_t height, int32_t maximum)
{
    const bool wide = maximum > 255;

    frame.samples = wide ? (const void *)grey16 : (const void *)grey8;
    frame.width = width;
    frame.height = height;
    frame.bytes_per_sample = wide ? 2 : 1;
    frame.stride_bytes = width * frame.bytes_per_sample;
    frame.maximum = maximum;
}

static void make_frame(const struct vector_spec *spec)
{
    int32_t u, v;

    memset(marks, 0, sizeof marks);
    mark_spots(spec);
    mark_boxes(spec);
    for (v = 0; v < spec->height; v++) {
        for (u = 0; u < spec->width; u++) {
            const int32_t value = pixel(spec, u, v);

            grey8[v * spec->width + u] = (uint8_t)value;
            grey16[v * spec->width + u] = (uint16_t)value;
        }
    }
    view(spec->width, spec->height, spec->maximum);
    params.floor_grey_q4 = spec->floor_grey_q4;
    params.noise_gain_q8 = spec->noise_gain_q8;
}

static void find(void)
{
    ih_dots_find(&frame, &params, &scratch, &dots);
}

/* Does a grey level of this frame come to a whole number of the 12-bit ones? */
static bool exact_grey(const struct vector_spec *spec)
{
    return 4080 % spec->maximum == 0;
}

static void thresholds_match_scipy(void)
{
    int i;

    for (i = 0; i < IH_TEST_COUNT(vector_frames); i++) {
        const struct vector_frame *v = &vector_frames[i];
        int32_t noise;

        make_frame(&v->spec);
        noise = ih_dots_noise(&frame, &scratch);
        /* Rounded up to the next bin. Deeper greys are rounded to 12 bits by a multiplication: half
         * a level off here and there moves a median by less than a bin. */
        IH_TEST_RANGE(v->median - (exact_grey(&v->spec) ? 0 : IH_DOTS_NOISE_BIN),
                      v->median + 2 * IH_DOTS_NOISE_BIN, noise, v->spec.name, i);
        find();
        IH_TEST_RANGE(v->threshold - (exact_grey(&v->spec) ? 0 : IH_DOTS_NOISE_BIN * 7),
                      v->threshold + (exact_grey(&v->spec) ? 0 : IH_DOTS_NOISE_BIN * 7),
                      dots.threshold, v->spec.name, i);
    }
}

static void dots_match_scipy(void)
{
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(vector_frames); i++) {
        const struct vector_frame *v = &vector_frames[i];

        make_frame(&v->spec);
        memset(&dots, IH_TEST_FILL, sizeof dots);
        find();
        IH_TEST_EQUAL(v->dot_count, dots.dot_count, v->spec.name, i);
        IH_TEST_EQUAL(v->small_count, dots.small_count, v->spec.name, i);
        IH_TEST_EQUAL(v->large_count, dots.large_count, v->spec.name, i);
        IH_TEST_EQUAL(0, dots.dots_dropped, v->spec.name, i);
        IH_TEST_EQUAL(0, dots.runs_dropped, v->spec.name, i);
        for (k = 0; k < v->dot_count; k++) {
            /* 0.01 px as the header promises. */
            IH_TEST_WITHIN(0.01, v->dot[k].u, ih_test_from_q(dots.dot[k].u_px_q12, 12),
                           v->spec.name, k);
            IH_TEST_WITHIN(0.01, v->dot[k].v, ih_test_from_q(dots.dot[k].v_px_q12, 12),
                           v->spec.name, k);
            /* Integers all the way, but for the rounding of deeper greys: 81 x 16 per level. */
            IH_TEST_WITHIN(exact_grey(&v->spec) ? 0 : IH_DOTS_RESPONSE_UNIT, v->dot[k].peak,
                           dots.dot[k].peak, v->spec.name, k);
        }
        IH_TEST_UNTOUCHED(&dots.dot[dots.dot_count],
                          (size_t)(IH_DOTS_MAX - dots.dot_count) * sizeof dots.dot[0],
                          v->spec.name);
    }
}

static void all_361_dots_are_found_in_order(void)
{
    int k;

    make_frame(&vector_frames[IH_TEST_COUNT(vector_frames) - 1].spec);
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

        make_frame(&v->spec);
        find();
        IH_TEST_EQUAL(v->runs_over, dots.runs_dropped, v->spec.name, i);
        if (v->runs_over == 0) {
            IH_TEST_EQUAL(IH_DOTS_MAX, dots.dot_count, v->spec.name, i);
            IH_TEST_EQUAL(v->dot_count - IH_DOTS_MAX, dots.dots_dropped, v->spec.name, i);
        }
        IH_TEST_RANGE(0, IH_DOTS_MAX, dots.dot_count, v->spec.name, i);
    }
}

static void fill8(int32_t width, int32_t height, uint8_t value)
{
    memset(grey8, value, (size_t)(width * height));
    view(width, height, 255);
}

static void flat_frames_have_no_dots(void)
{
    static const uint8_t levels[] = {0, 1, 127, 200, 254, 255};
    int i;

    for (i = 0; i < IH_TEST_COUNT(levels); i++) {
        fill8(640, 480, levels[i]);
        find();
        IH_TEST_EQUAL(0, dots.dot_count, "dots", levels[i]);
        IH_TEST_EQUAL(0, dots.small_count + dots.large_count, "blobs", levels[i]);
        IH_TEST_EQUAL(0, dots.runs_dropped + dots.dots_dropped, "dropped", levels[i]);
        IH_TEST_EQUAL(levels[i] > params.bright_grey, ih_dots_is_bright(&dots, 639, 479), "bright",
                      levels[i]);
    }
}

/* Closed form: one pixel of height h at (u, v) gives R = 81 * 4 h - 16 h at itself, 81 * 2 h - 16 h
 * beside it, 81 h - 16 h at the corners; a symmetric blob, whose centre is the pixel. */
static void one_bright_pixel_is_centred_on_itself(void)
{
    const int32_t grey_q4 = 100 * 16;

    fill8(320, 240, 0);
    grey8[100 * 320 + 200] = 100;
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.dot_count);
    TEST_ASSERT_EQUAL_INT32(200 * 4096, dots.dot[0].u_px_q12);
    TEST_ASSERT_EQUAL_INT32(100 * 4096, dots.dot[0].v_px_q12);
    TEST_ASSERT_EQUAL_INT32((81 * 4 - 16) * grey_q4, dots.dot[0].peak);
}

/* A 2x1 block lies between its pixels. */
static void two_equal_pixels_are_centred_between_them(void)
{
    fill8(320, 240, 0);
    grey8[100 * 320 + 200] = grey8[100 * 320 + 201] = 80;
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.dot_count);
    TEST_ASSERT_EQUAL_INT32(200 * 4096 + 2048, dots.dot[0].u_px_q12);
    TEST_ASSERT_EQUAL_INT32(100 * 4096, dots.dot[0].v_px_q12);
}

/* R > threshold, strictly: a hot pixel's corner response 65 h against a threshold of just that. */
static void the_threshold_itself_is_not_above(void)
{
    fill8(320, 240, 0);
    grey8[100 * 320 + 200] = 81; /* corners: 65 * 81 * 16 = 65 * 1296: 65 12-bit levels */
    params.noise_gain_q8 = 0;
    params.floor_grey_q4 = 65;
    params.area_min_px = 5;
    params.area_max_px = 5;
    find();
    TEST_ASSERT_EQUAL_INT32(65 * IH_DOTS_RESPONSE_UNIT, dots.threshold);
    TEST_ASSERT_EQUAL_INT32(1, dots.dot_count); /* the corners are out: 5 px */
    params.floor_grey_q4 = 64;
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.large_count); /* the corners are in: 9 px */
}

static void area_and_extent_limits_are_inclusive(void)
{
    fill8(320, 240, 0);
    grey8[100 * 320 + 200] = 100; /* a blob of 3 x 3 */
    params.area_min_px = params.area_max_px = 9;
    params.extent_max_px = 3;
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.dot_count);
    params.area_min_px = 10;
    params.area_max_px = 100;
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.small_count);
    params.area_min_px = 1;
    params.area_max_px = 8;
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.large_count);
    params.area_max_px = 9;
    params.extent_max_px = 2;
    find();
    TEST_ASSERT_EQUAL_INT32(1, dots.large_count);
    TEST_ASSERT_EQUAL_INT32(0, dots.dot_count);
}

/* The same scene at 8 and at 16 bits: 65535 = 257 * 255 exactly. */
static void bit_depth_does_not_matter(void)
{
    static struct ih_dots eight;
    int32_t i;

    make_frame(&vector_frames[0].spec);
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

    make_frame(&vector_frames[1].spec); /* maximum 1023 */
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

    make_frame(&vector_frames[0].spec);
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

static void row_by_row_is_the_same_as_the_whole_frame(void)
{
    static struct ih_dots whole;
    int32_t noise, v;

    make_frame(&vector_frames[IH_TEST_COUNT(vector_frames) - 2].spec);
    find();
    whole = dots;
    noise = ih_dots_noise(&frame, &scratch);
    memset(&dots, 0, sizeof dots);
    ih_dots_begin(&scratch, &dots, &params, frame.width, frame.height, noise);
    for (v = 0; v < frame.height; v++) {
        ih_dots_row(&scratch, &dots, &grey8[v * frame.width], 1, 255);
    }
    ih_dots_end(&scratch, &dots);
    TEST_ASSERT_EQUAL_INT32(whole.dot_count, dots.dot_count);
    TEST_ASSERT_EQUAL_INT32(whole.threshold, dots.threshold);
    TEST_ASSERT_EQUAL_INT32(whole.small_count, dots.small_count);
    TEST_ASSERT_EQUAL_MEMORY(whole.dot, dots.dot, (size_t)dots.dot_count * sizeof dots.dot[0]);
}

/* Turned by 180 degrees, a picture has the same dots at the mirrored places. */
static void a_turned_frame_has_turned_dots(void)
{
    static struct ih_dots upright;
    int32_t i, last;

    make_frame(&vector_frames[4].spec); /* no noise: the sample for the median is another one */
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
        const struct ih_dot *turned = &dots.dot[dots.dot_count - 1 - i];

        /* A unit each: halves are rounded away from zero on both sides. */
        IH_TEST_RANGE((frame.width - 1) * 4096 - upright.dot[i].u_px_q12 - 1,
                      (frame.width - 1) * 4096 - upright.dot[i].u_px_q12 + 1, turned->u_px_q12, "u",
                      i);
        IH_TEST_RANGE((frame.height - 1) * 4096 - upright.dot[i].v_px_q12 - 1,
                      (frame.height - 1) * 4096 - upright.dot[i].v_px_q12 + 1, turned->v_px_q12,
                      "v", i);
        IH_TEST_EQUAL(upright.dot[i].peak, turned->peak, "peak", i);
    }
}

static void paint_block(int32_t u, int32_t v, int32_t width, int32_t height, uint8_t grey)
{
    int32_t i;

    for (i = v; i < v + height; i++) {
        memset(&grey8[i * frame.width + u], grey, (size_t)width);
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
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, INT32_MIN, INT32_MAX));
    TEST_ASSERT_FALSE(ih_dots_is_bright(&dots, INT32_MAX, INT32_MIN));
}

/* The hardest pictures for sums and tables, at the greatest size; they must end and stay sane. */
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
        params.area_max_px = 1024;
        params.extent_max_px = 1280;
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
    RUN_TEST(thresholds_match_scipy);
    RUN_TEST(dots_match_scipy);
    RUN_TEST(all_361_dots_are_found_in_order);
    RUN_TEST(full_tables_are_counted);
    RUN_TEST(flat_frames_have_no_dots);
    RUN_TEST(one_bright_pixel_is_centred_on_itself);
    RUN_TEST(two_equal_pixels_are_centred_between_them);
    RUN_TEST(the_threshold_itself_is_not_above);
    RUN_TEST(area_and_extent_limits_are_inclusive);
    RUN_TEST(bit_depth_does_not_matter);
    RUN_TEST(samples_above_the_maximum_are_full_scale);
    RUN_TEST(a_stride_skips_what_lies_between_rows);
    RUN_TEST(row_by_row_is_the_same_as_the_whole_frame);
    RUN_TEST(a_turned_frame_has_turned_dots);
    RUN_TEST(bright_blocks_are_those_above_the_limit);
    RUN_TEST(nothing_is_bright_outside_the_frame);
    RUN_TEST(extreme_pictures_are_survived);
    return UNITY_END();
}
