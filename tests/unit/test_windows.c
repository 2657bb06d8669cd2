/* ih_windows: scenes against a float64 reference; and images that are no scene at all. */
#include "ih_windows.c" /* for the score of one place */

#include "ih_test.h"

struct vector_ellipsoid {
    double middle_mm[3], axis_mm[3];
};

struct vector_window {
    double x, y, depth_mm, score;
};

struct vector_scene {
    const char *name;
    int32_t width, height, focal_px;
    double plane, plane_per_y; /* inverse depth, 1/m */
    int32_t every;             /* only every so many columns and rows are measured */
    int32_t ellipsoid_count;
    const struct vector_ellipsoid *ellipsoid;
    int32_t cell_px, spacing_px;
    int32_t window_count;
    const struct vector_window *window;
};

struct vector_noise {
    int32_t seed, focal_px, depth_mm;
    double score; /* of the place in the middle */
};

#include "windows.inc"

#define PIXELS_MAX (IH_FRAME_WIDTH_MAX * IH_FRAME_WIDTH_MAX)
#define HEAD_MM 98 /* from a head's front to its middle */

static struct ih_calibration calibration;
static struct ih_rig rig;
static struct ih_windows_params params;
static struct ih_windows windows;
static uint16_t depth_mm[PIXELS_MAX];
static struct ih_frame frame;

/* The scratch between two guards. */
static struct {
    uint8_t before[64];
    struct ih_windows_scratch scratch;
    uint8_t after[64];
} guarded;

void setUp(void)
{
    ih_windows_params_default(&params);
}

void tearDown(void)
{
}

static void use_rig(int32_t width, int32_t height, int32_t focal_px)
{
    int32_t bad_slot;

    memset(&calibration, 0, sizeof calibration);
    calibration.kind = IH_RIG_RANGE;
    calibration.width = width;
    calibration.height = height;
    calibration.fx_px_q16 = calibration.fy_px_q16 = focal_px << 16;
    calibration.cx_px_q16 = (width - 1) << 15;
    calibration.cy_px_q16 = (height - 1) << 15;
    calibration.near_mm = 400;
    calibration.far_mm = 8000;
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &calibration, &bad_slot));
    frame = (struct ih_frame){depth_mm, width, height, width * 2, 2, 0};
}

static void fill(uint16_t value)
{
    int32_t i;

    for (i = 0; i < frame.width * frame.height; i++) {
        depth_mm[i] = value;
    }
}

/* What holds for every image. */
static void find(const char *what)
{
    int32_t i;

    memset(&windows, IH_TEST_FILL, sizeof windows);
    memset(&guarded, IH_TEST_FILL, sizeof guarded);
    TEST_ASSERT_EQUAL_INT(IH_OK,
                          ih_windows_find(&frame, &rig, &params, &guarded.scratch, &windows));
    IH_TEST_RANGE(0, params.window_max, windows.window_count, what, 0);
    for (i = 0; i < windows.window_count; i++) {
        const struct ih_window *w = &windows.window[i];
        int32_t u, v;

        IH_TEST_RANGE(calibration.near_mm << 8, calibration.far_mm << 8, w->depth_mm_q8, what, i);
        IH_TEST_RANGE(params.score_min, 1000, w->score, what, i);
        IH_TEST_RANGE(windows.window[0].score - params.score_behind_max,
                      i == 0 ? 1000 : windows.window[i - 1].score, w->score, what, i);
        ih_rig_distort(&rig, w->x_q28, w->y_q28, &u, &v);
        /* The last cell may reach beyond the frame by less than itself. */
        IH_TEST_RANGE(-8, (frame.width + guarded.scratch.cell_px) * 4096, u, what, i);
        IH_TEST_RANGE(-8, (frame.height + guarded.scratch.cell_px) * 4096, v, what, i);
    }
    ih_test_untouched_at(guarded.before, sizeof guarded.before, what, __LINE__);
    ih_test_untouched_at(guarded.after, sizeof guarded.after, what, __LINE__);
    IH_TEST_UNTOUCHED(&windows.window[windows.window_count],
                      sizeof windows.window[0] * (size_t)(IH_WINDOWS_MAX - windows.window_count),
                      what);
}

/* Depth of an ellipsoid's front on a ray, INFINITY beside it. */
static double ellipsoid_depth_mm(const struct vector_ellipsoid *e, double x, double y)
{
    const double ray[3] = {x, y, 1};
    double a = 0, b = 0, c = -1, root;
    int i;

    for (i = 0; i < 3; i++) {
        const double axis2 = e->axis_mm[i] * e->axis_mm[i];

        a += ray[i] * ray[i] / axis2;
        b += ray[i] * e->middle_mm[i] / axis2;
        c += e->middle_mm[i] * e->middle_mm[i] / axis2;
    }
    root = b * b - a * c;
    return root > 0 ? (b - sqrt(root)) / a : (double)INFINITY;
}

static void draw(const struct vector_scene *scene)
{
    int32_t i, k;

    use_rig(scene->width, scene->height, scene->focal_px);
    for (i = 0; i < scene->width * scene->height; i++) {
        const int32_t u = i % scene->width, v = i / scene->width;
        const double x = (u - (scene->width - 1) / 2.0) / scene->focal_px;
        const double y = (v - (scene->height - 1) / 2.0) / scene->focal_px;
        const double inverse = (scene->plane + scene->plane_per_y * y) / 1000;
        double depth = inverse > 1.0 / 16000 ? 1 / inverse : (double)INFINITY;

        for (k = 0; k < scene->ellipsoid_count; k++) {
            depth = fmin(depth, ellipsoid_depth_mm(&scene->ellipsoid[k], x, y));
        }
        depth_mm[i] = (uint16_t)(depth < 16000 ? floor(depth + 0.5) : 0);
        if (u % scene->every != 0 || v % scene->every != 0) {
            depth_mm[i] = 0;
        }
    }
}

static void windows_match_float64(void)
{
    int s, i;

    for (s = 0; s < IH_TEST_COUNT(vector_scenes); s++) {
        const struct vector_scene *scene = &vector_scenes[s];

        draw(scene);
        find(scene->name);
        IH_TEST_EQUAL(scene->cell_px, guarded.scratch.cell_px, scene->name, 0);
        IH_TEST_EQUAL(scene->window_count, windows.window_count, scene->name, 1);
        for (i = 0; i < scene->window_count; i++) {
            const struct ih_window *w = &windows.window[i];
            /* A probe is placed to 1/250 of a cell, so one of 33 may hit the cell beside the right
             * one: 400/13 of the score. The mean place moves by less than a cell then. */
            const double cell = (double)guarded.scratch.cell_px / scene->focal_px;

            IH_TEST_WITHIN(cell, scene->window[i].x, ih_test_from_q(w->x_q28, 28), "x", s);
            IH_TEST_WITHIN(cell, scene->window[i].y, ih_test_from_q(w->y_q28, 28), "y", s);
            IH_TEST_WITHIN(5, scene->window[i].depth_mm, w->depth_mm_q8 / 256.0, "depth", s);
            IH_TEST_WITHIN(400.0 / 13 + 2, scene->window[i].score, w->score, "score", s);
            IH_TEST_EQUAL(scene->spacing_px, w->spacing_px, "spacing", s);
        }
    }
}

/* Class Noise of tools/oracle/windows.py: wherever a probe is a cell off, or a limit a millimetre,
 * some score is another. */
static uint32_t noise_hash(uint32_t number, uint32_t seed)
{
    uint32_t h = number * 2654435761u + seed * 40503u;

    h = (h ^ h >> 15) * 1103515245u;
    return h ^ h >> 13;
}

static void draw_noise(const struct vector_noise *noise)
{
    static const int32_t offset_mm[] = {0,  -40, -41, 110, 111,  -100, -101,
                                        89, 90,  149, 150, -149, -150, 400};
    const uint32_t seed = (uint32_t)noise->seed;
    uint32_t u, v;

    use_rig(160, 120, noise->focal_px);
    for (v = 0; v < 120; v++) {
        for (u = 0; u < 160; u++) {
            const uint32_t which = noise_hash(v * 160 + u, seed) % IH_TEST_COUNT(offset_mm);
            const bool hole = noise_hash(1000000 + v / 4 * 160 + u / 4, seed) % 6 == 0;

            depth_mm[v * 160 + u] = (uint16_t)(hole ? 0 : noise->depth_mm + offset_mm[which]);
        }
    }
}

static void scores_match_float64(void)
{
    int i;

    TEST_ASSERT_TRUE(IH_TEST_COUNT(vector_noises) > 60);
    for (i = 0; i < IH_TEST_COUNT(vector_noises); i++) {
        const struct vector_noise *noise = &vector_noises[i];
        struct ih_windows_place place;

        draw_noise(noise);
        IH_TEST_EQUAL(0, survey_frame(&frame, &rig, &guarded.scratch), "nothing is rare", i);
        IH_TEST_EQUAL(1, guarded.scratch.cell_px, "cell", i);
        place = place_at(&guarded.scratch, &rig, &params, 80, 60);
        /* Each of five parts is rounded down. */
        IH_TEST_WITHIN(5, noise->score, place.score, "score", noise->seed);
    }
}

/* Every person of a scene has a window, and nothing else has: the heads' middles are in the scene.
 * People are three ellipsoids each, the head first. */
static void every_head_has_its_window(void)
{
    int s, i, k;

    for (s = 0; s < IH_TEST_COUNT(vector_scenes); s++) {
        const struct vector_scene *scene = &vector_scenes[s];

        draw(scene);
        find(scene->name);
        for (i = 0; i + 2 < scene->ellipsoid_count; i += 3) {
            const double *head = scene->ellipsoid[i].middle_mm;
            double best = INFINITY;

            for (k = 0; k < windows.window_count; k++) {
                const struct ih_window *w = &windows.window[k];
                const double z = w->depth_mm_q8 / 256.0 + HEAD_MM;
                const double x = ih_test_from_q(w->x_q28, 28) * z;
                const double y = ih_test_from_q(w->y_q28, 28) * z;

                best =
                    fmin(best, sqrt((x - head[0]) * (x - head[0]) + (y - head[1]) * (y - head[1]) +
                                    (z - head[2]) * (z - head[2])));
            }
            IH_TEST_WITHIN(60, 0, best, scene->name, i);
        }
        IH_TEST_EQUAL(scene->ellipsoid_count / 3, windows.window_count, scene->name, s);
    }
}

static void images_without_shape_have_no_window(void)
{
    static const uint16_t value[] = {0, 1, 399, 400, 1000, 8000, 8001, 65535};
    static const int32_t size[][2] = {{64, 64}, {320, 240}, {1280, 800}, {64, 1280}, {1280, 1280}};
    int i, k;

    for (i = 0; i < IH_TEST_COUNT(value); i++) {
        for (k = 0; k < IH_TEST_COUNT(size); k++) {
            use_rig(size[k][0], size[k][1], size[k][1]);
            fill(value[i]);
            find("flat");
            IH_TEST_EQUAL(0, windows.window_count, "flat", value[i]);
        }
    }
}

/* One measured pixel is no head, wherever it is. */
static void one_pixel_is_no_head(void)
{
    static const int32_t place[] = {0, 1, 63, 64, 64 * 32 + 32, 64 * 63, 64 * 64 - 1};
    int i;

    use_rig(64, 64, 60);
    for (i = 0; i < IH_TEST_COUNT(place); i++) {
        fill(0);
        depth_mm[place[i]] = 700;
        find("one pixel");
        IH_TEST_EQUAL(0, windows.window_count, "one pixel", i);
    }
}

/* Noise of every density and size: nothing beyond the bounds, and what find() checks. */
static void noise_is_survived(void)
{
    static const int32_t size[][2] = {{64, 64}, {333, 241}, {241, 333}, {1280, 800}};
    struct ih_test_random random = {7};
    int pass, k;
    int32_t i;

    for (pass = 0; pass < 6; pass++) {
        for (k = 0; k < IH_TEST_COUNT(size); k++) {
            const int64_t density = (int64_t)1 << (2 * pass);

            use_rig(size[k][0], size[k][1], 100 + 300 * k);
            for (i = 0; i < frame.width * frame.height; i++) {
                const bool measured = ih_test_between(&random, 1, density) == 1;

                depth_mm[i] = (uint16_t)(measured ? ih_test_between(&random, 0, 65535) : 0);
            }
            find("noise");
            for (i = 0; i < frame.width * frame.height; i++) {
                const int64_t near = 700 + 4 * (i % frame.width % 40) + 400 * (i / frame.width % 3);

                depth_mm[i] = (uint16_t)(depth_mm[i] > 0 ? near : 0);
            }
            find("stripes");
        }
    }
}

/* The ends of what a rig may be: the longest and the shortest focal length. */
static void extreme_lenses_are_survived(void)
{
    struct ih_test_random random = {8};
    int pass;
    int32_t i;

    for (pass = 0; pass < 4; pass++) {
        use_rig(pass % 2 == 0 ? 64 : 1280, pass % 2 == 0 ? 64 : 1280,
                pass < 2        ? IH_RIG_FOCAL_MAX_PX
                : pass % 2 == 0 ? 17
                                : 321);
        rig.calibration.near_mm = IH_DEPTH_MIN_MM;
        rig.calibration.far_mm = IH_DEPTH_MAX_MM;
        calibration = rig.calibration;
        for (i = 0; i < frame.width * frame.height; i++) {
            depth_mm[i] = (uint16_t)ih_test_between(&random, 0, 200 << (2 * (i / 4096 % 4)));
        }
        find("lens");
        fill(IH_DEPTH_MIN_MM);
        find("near");
        fill(IH_DEPTH_MAX_MM);
        find("far");
    }
}

/* Twenty people side by side: the best eight, or as many as are asked for, the nearest first. */
static void windows_are_at_most_as_many_as_asked_for(void)
{
    static struct vector_ellipsoid crowd[60];
    const struct vector_scene scene = {"crowd", 1280, 200, 640, 0, 0, 1, 60, crowd, 0, 0, 0, NULL};
    int i, k;

    for (i = 0; i < 20; i++) {
        const double x = (i - 9.5) * 240, z = 3000 - (i * 7 % 20) * 20;

        crowd[3 * i] = (struct vector_ellipsoid){{x, -200, z}, {78, 113, 98}};
        crowd[3 * i + 1] = (struct vector_ellipsoid){{x, -80, z + 25}, {58, 110, 62}};
        crowd[3 * i + 2] = (struct vector_ellipsoid){{x, 200, z + 45}, {110, 235, 115}};
    }
    draw(&scene);
    for (k = 0; k <= IH_WINDOWS_MAX; k++) {
        params.window_max = k;
        find("crowd");
        IH_TEST_EQUAL(k, windows.window_count, "crowd", k);
    }
    for (i = 0; i < IH_WINDOWS_MAX; i++) {
        for (k = 0; k < i; k++) {
            const double z = windows.window[i].depth_mm_q8 / 256.0;

            TEST_ASSERT_TRUE(fabs(ih_test_from_q(
                                 windows.window[i].x_q28 - (int64_t)windows.window[k].x_q28, 28)) *
                                 z >
                             150);
        }
    }
}

/* Many places that are hardly heads: those that find no room are counted, and the best one is the
 * same as without them. */
static void a_full_table_keeps_the_best_places(void)
{
    static const struct vector_ellipsoid person[] = {{{0, -100, 1200}, {78, 113, 98}},
                                                     {{0, 20, 1225}, {58, 110, 62}},
                                                     {{0, 300, 1245}, {215, 235, 115}}};
    const struct vector_scene scene = {"noise", 640, 480, 280, 0, 0, 1, 3, person, 0, 0, 0, NULL};
    struct ih_test_random random = {31};
    struct ih_window best;
    int32_t i;

    draw(&scene);
    find("a person");
    TEST_ASSERT_EQUAL_INT32(0, windows.places_dropped);
    TEST_ASSERT_EQUAL_INT32(1, windows.window_count);
    best = windows.window[0];
    for (i = 0; i < 640 * 480;
         i += 640 * 8) { /* the outer columns are noise now, 8 x 8 pixels each */
        int32_t u, k;

        for (u = 0; u < 640; u += 8) {
            const uint16_t depth = (uint16_t)ih_test_between(&random, 2600, 7900);

            for (k = 0; k < 64 && (u < 128 || u >= 512); k++) {
                depth_mm[i + u + k / 8 * 640 + k % 8] = depth;
            }
        }
    }
    params.score_min = 1;
    params.width_min_q8 = 0;
    find("noise");
    TEST_ASSERT_TRUE(windows.places_dropped > 0);
    TEST_ASSERT_EQUAL_INT32(IH_WINDOWS_PLACES_MAX, guarded.scratch.place_count);
    for (i = 1; i < IH_WINDOWS_PLACES_MAX; i++) {
        IH_TEST_RANGE(params.score_min, guarded.scratch.place[i - 1].score,
                      guarded.scratch.place[i].score, "best first", i);
    }
    TEST_ASSERT_EQUAL_MEMORY(&best, &windows.window[0], sizeof best);
}

/* An object that would be a head in the air is none where the table goes on below it. */
static void what_stands_on_a_table_is_no_head(void)
{
    static const struct vector_ellipsoid object[] = {{{0, 0, 800}, {78, 113, 70}}};
    struct vector_scene scene = {"table", 320, 240, 280, 0, 0, 1, 1, object, 0, 0, 0, NULL};

    draw(&scene);
    find("in the air");
    TEST_ASSERT_EQUAL_INT32(1, windows.window_count);
    scene.plane = 1.1;
    scene.plane_per_y = 0.9;
    draw(&scene);
    find("on a table");
    TEST_ASSERT_EQUAL_INT32(0, windows.window_count);
    draw(&scene);
    memset(&depth_mm[320 * 130], 0, sizeof depth_mm[0] * 320 * 110);
    find("a table that is not seen below");
    TEST_ASSERT_EQUAL_INT32(1, windows.window_count);
}

/* High shoulders before a far wall, and a chest that comes nearer: a plane through what is beside
 * the head would meet the chest, but it goes through nothing of what is beside. */
static void what_is_beside_must_be_a_plane(void)
{
    static const struct vector_ellipsoid head = {{0, 0, 835}, {78, 113, 98}};
    int32_t i;

    use_rig(320, 240, 280);
    for (i = 0; i < 320 * 240; i++) {
        const double x = (i % 320 - 159.5) / 280, y = (i / 320 - 119.5) / 280;
        const double y_mm = y * 737;
        const double body = y_mm > 115  ? 1 / (6.98e-4 + (y_mm + 25) * 2.52e-6)
                            : y_mm > 25 ? 987
                                        : 1687;

        depth_mm[i] = (uint16_t)lround(fmin(body, ellipsoid_depth_mm(&head, x, y)));
    }
    find("high shoulders");
    TEST_ASSERT_TRUE(windows.window_count > 0);
    IH_TEST_WITHIN(0.04, 0, ih_test_from_q(windows.window[0].x_q28, 28), "x", 0);
    IH_TEST_WITHIN(0.04, 0, ih_test_from_q(windows.window[0].y_q28, 28), "y", 0);
}

/* Of pixels at the same distance the first in reading order, else the nearest: by trying all. */
static void a_pixel_is_the_nearest(void)
{
    struct ih_test_random random = {9};
    int pass;
    int32_t i;

    use_rig(64, 64, 60);
    for (pass = 0; pass < 3000; pass++) {
        const int32_t at_u = (int32_t)ih_test_between(&random, 0, 63);
        const int32_t at_v = (int32_t)ih_test_between(&random, 0, 63);
        const int32_t reach = (int32_t)ih_test_between(&random, 0, 12);
        int32_t best = INT32_MAX, best_i = 0, u = at_u, v = at_v, found;

        if (pass % 20 == 0) {
            for (i = 0; i < 64 * 64; i++) {
                const bool measured = ih_test_between(&random, 0, 1 + 4 * (pass / 20)) == 0;

                depth_mm[i] = (uint16_t)(measured ? 400 + i : ih_test_between(&random, 0, 399));
            }
        }
        for (i = 0; i < 64 * 64; i++) {
            const int32_t du = i % 64 - at_u, dv = i / 64 - at_v;
            const bool near = du >= -reach && du <= reach && dv >= -reach && dv <= reach;

            if (depth_mm[i] >= 400 && near && du * du + dv * dv < best) {
                best = du * du + dv * dv;
                best_i = i;
            }
        }
        found = ih_windows_pixel(&frame, &rig, reach, &u, &v);
        IH_TEST_EQUAL(best == INT32_MAX ? 0 : depth_mm[best_i], found, "depth", pass);
        IH_TEST_EQUAL(best == INT32_MAX ? at_u : best_i % 64, u, "u", pass);
        IH_TEST_EQUAL(best == INT32_MAX ? at_v : best_i / 64, v, "v", pass);
    }
}

/* Rows that stand apart in memory, and nothing read beyond the frame. */
static void the_stride_is_followed(void)
{
    static struct ih_windows tight;
    int32_t i;

    draw(&vector_scenes[0]);
    find("tight");
    tight = windows;
    for (i = frame.height - 1; i >= 0; i--) {
        memmove(&depth_mm[i * 500], &depth_mm[i * frame.width], (size_t)frame.width * 2);
        memset(&depth_mm[i * 500 + frame.width], 0x02, (size_t)(500 - frame.width) * 2);
    }
    frame.stride_bytes = 1000;
    find("wide");
    TEST_ASSERT_EQUAL_MEMORY(&tight, &windows, sizeof windows);
}

static void the_wrong_kind_is_refused(void)
{
    use_rig(64, 64, 60);
    frame.bytes_per_sample = 1;
    TEST_ASSERT_EQUAL_INT(IH_ERR_KIND,
                          ih_windows_find(&frame, &rig, &params, &guarded.scratch, &windows));
    TEST_ASSERT_EQUAL_INT32(0, windows.window_count);
    use_rig(64, 64, 60);
    rig.calibration.kind = IH_RIG_DOTS;
    TEST_ASSERT_EQUAL_INT(IH_ERR_KIND,
                          ih_windows_find(&frame, &rig, &params, &guarded.scratch, &windows));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(windows_match_float64);
    RUN_TEST(scores_match_float64);
    RUN_TEST(every_head_has_its_window);
    RUN_TEST(images_without_shape_have_no_window);
    RUN_TEST(one_pixel_is_no_head);
    RUN_TEST(noise_is_survived);
    RUN_TEST(extreme_lenses_are_survived);
    RUN_TEST(windows_are_at_most_as_many_as_asked_for);
    RUN_TEST(a_full_table_keeps_the_best_places);
    RUN_TEST(what_stands_on_a_table_is_no_head);
    RUN_TEST(what_is_beside_must_be_a_plane);
    RUN_TEST(a_pixel_is_the_nearest);
    RUN_TEST(the_stride_is_followed);
    RUN_TEST(the_wrong_kind_is_refused);
    return UNITY_END();
}
