/* ih_windows: scenes against a float64 reference; and images that are no scene at all. */
#include <stdbool.h>
#include <stdlib.h>

#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "base/ih_types.h"
#include "points/ih_windows.h"
#include "points/ih_windows_places.h"
#include "points/ih_windows_score.h"
#include "points/ih_windows_survey.h"
#include "rig/ih_camera.h"
#include "rig/ih_rig.h"

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
    int32_t seed, fx_px, fy_px, depth_mm;
    double score; /* of the place in the middle */
};

struct vector_tilted {
    int32_t seed, fx_px, fy_px, depth_mm;
    bool stands; /* what is beside the place in the middle is a plane, and goes on below it */
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
        ih_camera_distort(&rig, w->x_q28, w->y_q28, &u, &v);
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

/* The picture of a camera that is rolled by so many quarter turns, heads' tops to the right first. */
static void roll(const struct vector_scene *scene, int quarters)
{
    static uint16_t level_mm[PIXELS_MAX];
    static const int32_t up_q30[4][2] = {
        {0, -(1 << 30)}, {1 << 30, 0}, {0, 1 << 30}, {-(1 << 30), 0}};
    const int32_t width = quarters % 2 == 0 ? scene->width : scene->height;
    const int32_t height = quarters % 2 == 0 ? scene->height : scene->width;
    int32_t bad_slot, u, v;

    memcpy(level_mm, depth_mm, sizeof level_mm);
    use_rig(width, height, scene->focal_px);
    calibration.up_q30[0] = up_q30[quarters][0];
    calibration.up_q30[1] = up_q30[quarters][1];
    TEST_ASSERT_EQUAL_INT(IH_OK, ih_rig_init(&rig, &calibration, &bad_slot));
    for (v = 0; v < height; v++) {
        for (u = 0; u < width; u++) {
            const int32_t level_u = quarters == 1   ? v
                                    : quarters == 2 ? width - 1 - u
                                                    : height - 1 - v;
            const int32_t level_v = quarters == 1   ? width - 1 - u
                                    : quarters == 2 ? height - 1 - v
                                                    : u;

            depth_mm[v * width + u] = level_mm[level_v * scene->width + level_u];
        }
    }
}

/* The same windows, in the level frame, whichever way the camera hangs. */
static void rolled_cameras_find_the_same(void)
{
    int s, i, quarters, count = 0;

    for (s = 0; s < IH_TEST_COUNT(vector_scenes); s++) {
        const struct vector_scene *scene = &vector_scenes[s];

        for (quarters = 1; quarters < 4 && scene->every == 1; quarters++) {
            draw(scene);
            roll(scene, quarters);
            find(scene->name);
            IH_TEST_EQUAL(scene->cell_px, guarded.scratch.cell_px, scene->name, quarters);
            IH_TEST_EQUAL(scene->window_count, windows.window_count, scene->name, quarters);
            for (i = 0; i < scene->window_count; i++) {
                const struct ih_window *w = &windows.window[i];
                const double cell = (double)guarded.scratch.cell_px / scene->focal_px;

                /* As above, and a cell may begin half a pixel off. */
                IH_TEST_WITHIN(1.5 * cell, scene->window[i].x, ih_test_from_q(w->x_q28, 28), "x",
                               s);
                IH_TEST_WITHIN(1.5 * cell, scene->window[i].y, ih_test_from_q(w->y_q28, 28), "y",
                               s);
                IH_TEST_WITHIN(5, scene->window[i].depth_mm, w->depth_mm_q8 / 256.0, "depth", s);
                IH_TEST_WITHIN(2 * 400.0 / 13 + 2, scene->window[i].score, w->score, "score", s);
                count++;
            }
        }
    }
    TEST_ASSERT_TRUE(count > 10);
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

    use_rig(160, 120, noise->fx_px);
    rig.calibration.fy_px_q16 = noise->fy_px << 16;
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

    TEST_ASSERT_TRUE(IH_TEST_COUNT(vector_noises) > 200);
    for (i = 0; i < IH_TEST_COUNT(vector_noises); i++) {
        const struct vector_noise *noise = &vector_noises[i];
        struct ih_windows_place place;

        draw_noise(noise);
        IH_TEST_EQUAL(0, ih_windows_survey(&frame, &rig, &guarded.scratch), "nothing is rare", i);
        IH_TEST_EQUAL(1, guarded.scratch.cell_px, "cell", i);
        place = ih_windows_place_at(&guarded.scratch, &rig, &params, 80, 60);
        /* Each of five parts is rounded down. */
        IH_TEST_WITHIN(5, noise->score, place.score, "score", noise->seed);
    }
}

/* Of the cells with a depth, but for the first column, so many have one at their left, too. */
static void connected_cells_are_counted(void)
{
    int32_t pairs, i;

    guarded.scratch.column_count = 41;
    guarded.scratch.row_count = 2;
    for (pairs = 0; pairs <= 10; pairs++) {
        memset(guarded.scratch.depth_mm, 0, sizeof guarded.scratch.depth_mm);
        for (i = 0; i < 10; i++) { /* one cell in the first row, or two side by side */
            guarded.scratch.depth_mm[4 * i + 2] = 900;
            guarded.scratch.depth_mm[4 * i + 3] = i < pairs ? 900 : 0;
        }
        guarded.scratch.depth_mm[41] = 900; /* in the first column of the next one */
        IH_TEST_EQUAL(pairs * 100 / (10 + pairs), ih_windows_connected_percent(&guarded.scratch),
                      "percent", pairs);
    }
    memset(guarded.scratch.depth_mm, 0, sizeof guarded.scratch.depth_mm);
    IH_TEST_EQUAL(100, ih_windows_connected_percent(&guarded.scratch), "without any", 0);
}

/* Depth of the measured pixel nearest to one of 160 x 120 within a square, by trying all; 0: none. The
 * last cells' middles may be beyond the frame: its last pixel stands for them. */
static int32_t nearest_mm(int32_t middle_u, int32_t middle_v, int32_t reach)
{
    const int32_t u = ih_min_s32(middle_u, 159), v = ih_min_s32(middle_v, 119);
    int32_t best = INT32_MAX, depth = 0, du, dv;

    for (dv = -reach; dv <= reach; dv++) {
        for (du = -reach; du <= reach; du++) {
            if (u + du >= 0 && v + dv >= 0 && u + du < 160 && v + dv < 120 &&
                depth_mm[(v + dv) * 160 + u + du] > 0 && du * du + dv * dv < best) {
                best = du * du + dv * dv;
                depth = depth_mm[(v + dv) * 160 + u + du];
            }
        }
    }
    return depth;
}

/* Do 70 % of the cells that have a depth, within half a cell, have one at their left, too? */
static bool cells_are_connected(int32_t cell)
{
    int32_t count = 0, connected = 0, u, v;

    for (v = cell / 2; v - cell / 2 < 120; v += cell) {
        for (u = cell + cell / 2; u - cell / 2 < 160; u += cell) {
            const int32_t reach = cell == 1 ? 1 : cell / 2;
            const bool has = nearest_mm(u, v, reach) > 0;

            count += has;
            connected += has && nearest_mm(u - cell, v, reach) > 0;
        }
    }
    return 10 * connected >= 7 * count;
}

/* One pixel in 300, anywhere: cells are doubled until they are connected; the last survey has cells of
 * half that side that look a whole side far. */
static void rare_pixels_are_surveyed_with_half_the_side(void)
{
    struct ih_test_random random = {77};
    int32_t pass, i, empty = 0;

    for (pass = 0; pass < 5; pass++) {
        int32_t spacing = 1, cell;

        use_rig(160, 120, 120);
        for (i = 0; i < 160 * 120; i++) {
            depth_mm[i] = (uint16_t)(ih_test_between(&random, 0, 299) == 0 ? 400 + i % 7600 : 0);
        }
        while (!cells_are_connected(spacing)) {
            spacing *= 2;
        }
        TEST_ASSERT_GREATER_THAN_INT32(1, spacing);
        IH_TEST_EQUAL(spacing, ih_windows_survey(&frame, &rig, &guarded.scratch), "spacing", pass);
        cell = spacing / 2;
        IH_TEST_EQUAL(cell, guarded.scratch.cell_px, "cell", pass);
        IH_TEST_EQUAL((160 + cell - 1) / cell, guarded.scratch.column_count, "columns", pass);
        IH_TEST_EQUAL((120 + cell - 1) / cell, guarded.scratch.row_count, "rows", pass);
        for (i = 0; i < guarded.scratch.column_count * guarded.scratch.row_count; i++) {
            const int32_t u = i % guarded.scratch.column_count * cell + cell / 2;
            const int32_t v = i / guarded.scratch.column_count * cell + cell / 2;

            IH_TEST_EQUAL(nearest_mm(u, v, cell), guarded.scratch.depth_mm[i], "depth", i);
            empty += guarded.scratch.depth_mm[i] == 0;
        }
    }
    TEST_ASSERT_GREATER_THAN_INT32(0, empty);
}

/* Class Tilted: a plane from which some cells are off, by less than the 40 mm that may be, or by more. */
static void draw_tilted(const struct vector_tilted *tilted)
{
    static const int32_t off_mm[32] = {[21] = 36, -36, 36, -36, 60, -60, 60, -60, 60, -60, 60};
    const int32_t across = tilted->seed * 13 % 11 - 5, down = tilted->seed * 17 % 13 - 6;
    int32_t u, v;

    use_rig(160, 120, tilted->fx_px);
    rig.calibration.fy_px_q16 = tilted->fy_px << 16;
    for (v = 0; v < 120; v++) {
        for (u = 0; u < 160; u++) {
            const double stretch = 1 + (u - 80) * across * 0.0005 + (v - 60) * down * 0.0008;
            const uint32_t which = noise_hash((uint32_t)(v * 160 + u), (uint32_t)tilted->seed) % 32;

            depth_mm[v * 160 + u] =
                (uint16_t)(floor(tilted->depth_mm / stretch + 0.5) + off_mm[which]);
        }
    }
}

static void planes_match_float64(void)
{
    int i, stands = 0;

    for (i = 0; i < IH_TEST_COUNT(vector_tilts); i++) {
        const struct vector_tilted *tilted = &vector_tilts[i];
        struct ih_windows_place place = {80, 60, 0, 0};

        draw_tilted(tilted);
        ih_windows_survey(&frame, &rig, &guarded.scratch);
        place.depth_mm = (int16_t)guarded.scratch.depth_mm[60 * 160 + 80];
        IH_TEST_EQUAL(tilted->stands, ih_windows_stands_on_plane(&guarded.scratch, &rig, &place),
                      "plane", tilted->seed);
        stands += tilted->stands;
    }
    TEST_ASSERT_TRUE(stands > 50 && stands < i - 50);
}

/* --- a place at 600 mm in an image of 5 mm a pixel --- */

#define PLACE_MM 600
#define FAR_LOSS 12 /* 20 per metre */
#define HOLE 9999   /* nothing measured */
#define CLEAR 1000  /* far behind */

/* Fills what is 600 mm away, and makes the place. */
static struct ih_windows_place flat_cells(int32_t column, int32_t row)
{
    int32_t i;

    use_rig(160, 120, 120);
    guarded.scratch.cell_px = 1;
    guarded.scratch.column_count = 160;
    guarded.scratch.row_count = 120;
    guarded.scratch.place_count = 0;
    for (i = 0; i < 160 * 120; i++) {
        guarded.scratch.depth_mm[i] = PLACE_MM;
    }
    return (struct ih_windows_place){(int16_t)column, (int16_t)row, PLACE_MM, 0};
}

/* What lies in an ellipse around the place (of half-axes in mm; 0: all) becomes so deep. */
static void sink(const struct ih_windows_place *place, double x_mm, double y_mm, int32_t behind_mm)
{
    int32_t i;

    for (i = 0; i < 160 * 120; i++) {
        const double x = (i % 160 - place->column) * 5, y = (i / 160 - place->row) * 5;

        if (hypot(x / x_mm, y / y_mm) < 1) {
            guarded.scratch.depth_mm[i] = (int16_t)(behind_mm == HOLE ? 0 : PLACE_MM + behind_mm);
        }
    }
}

/* Depths of the head, of what is around it and of what is below it, behind the place. */
static int32_t score_of_regions(int32_t column, int32_t row, int32_t inside_mm, int32_t around_mm,
                                int32_t below_mm)
{
    const struct ih_windows_place place = flat_cells(column, row);
    int32_t i;

    sink(&place, 1e6, 1e6, around_mm);
    for (i = 0; i < 160 * 120; i++) {
        if ((i / 160 - row) * 5 > 100) {
            guarded.scratch.depth_mm[i] = (int16_t)(below_mm == HOLE ? 0 : PLACE_MM + below_mm);
        }
    }
    sink(&place, 70, 95, inside_mm);
    return ih_windows_score(&guarded.scratch, &rig, &params, &place);
}

/* Of 1000: 350 for the head, 400 for what is around it, 150 for what is below it, 100 for its bulge, of
 * which what is not known gives half; less 20 per metre. */
static void scores_are_sums_of_their_parts(void)
{
    static const struct {
        int32_t behind_mm, percent;
    } inside[] = {{-40, 100}, {110, 100}, {-41, 0}, {111, 0}, {HOLE, 30}, {0, 100}},
      around[] = {{-100, 0}, {89, 0}, {-101, 40}, {90, 100}, {HOLE, 70}, {0, 0}},
      below[] = {{-149, 100}, {149, 100}, {-150, 0}, {150, 0}, {HOLE, 30}, {0, 100}};
    int i;

    for (i = 0; i < 6; i++) {
        /* No bulge where all of the head is equally deep. */
        const int32_t bulge = inside[i].percent == 100 ? 0 : 50;

        IH_TEST_EQUAL(350 * inside[i].percent / 100 + 400 + 150 + bulge - FAR_LOSS,
                      score_of_regions(80, 60, inside[i].behind_mm, CLEAR, 0), "inside", i);
        IH_TEST_EQUAL(350 + 400 * around[i].percent / 100 + 150 - FAR_LOSS,
                      score_of_regions(80, 60, 0, around[i].behind_mm, 0), "around", i);
        IH_TEST_EQUAL(350 + 400 + 150 * below[i].percent / 100 - FAR_LOSS,
                      score_of_regions(80, 60, 0, CLEAR, below[i].behind_mm), "below", i);
    }
}

/* What is beyond the edge counts half. Of 13 probes of the head, 13 around and 7 below it so many are
 * there, where those around and below give nothing else. */
static void what_is_beyond_the_edge_counts_half(void)
{
    static const struct {
        int32_t column, row, inside, around, below;
    } cases[] = {{80, 60, 0, 0, 0},  {80, 0, 4, 9, 0},   {80, 119, 4, 2, 7},
                 {0, 60, 4, 6, 2},   {159, 60, 4, 6, 2}, {80, 10, 1, 7, 0},
                 {80, 109, 1, 0, 7}, {8, 60, 1, 5, 2},   {151, 60, 1, 5, 2}};
    int i;

    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        const int32_t inside = 350 * (26 - cases[i].inside) / 26,
                      around = 400 * cases[i].around / 26;

        IH_TEST_EQUAL(inside + around + 150 * cases[i].below / 14 - FAR_LOSS,
                      score_of_regions(cases[i].column, cases[i].row, 0, 0, 400), "score", i);
    }
}

/* The outer part of the head so far behind its inner part: 100 of the score for 15 mm. */
static void heads_bulge(void)
{
    int32_t outer_mm;

    for (outer_mm = -5; outer_mm <= 20; outer_mm++) {
        const struct ih_windows_place place = flat_cells(80, 60);
        const int32_t clamped = outer_mm < 0 ? 0 : outer_mm > 15 ? 15 : outer_mm;

        sink(&place, 70, 95, outer_mm);
        sink(&place, 38, 48, 0);
        IH_TEST_EQUAL(350 + 150 + 100 * clamped / 15 - FAR_LOSS,
                      ih_windows_score(&guarded.scratch, &rig, &params, &place), "score", outer_mm);
    }
}

/* Depth of the cell that is nearest to so many mm from the place. */
static int16_t *cell_at(const struct ih_windows_place *place, int32_t x_mm, int32_t y_mm)
{
    const int32_t column = place->column + (int32_t)floor(x_mm / 5.0 + 0.5);
    const int32_t row = place->row + (int32_t)floor(y_mm / 5.0 + 0.5);

    return &guarded.scratch.depth_mm[row * 160 + column];
}

/* Three of the outer probes must be seen for a bulge, and one of the inner ones; else it is unknown. */
static void a_bulge_needs_three_outer_probes(void)
{
    static const int32_t outer_mm[][2] = {{-40, -45}, {40, 45}, {-40, 45}, {40, -45},
                                          {-58, 0},   {58, 0},  {0, -80},  {0, 80}};
    static const int32_t inner_mm[][2] = {{0, 0}, {-35, 0}, {35, 0}, {0, -45}, {0, 45}};
    struct ih_windows_place place;
    int holes, i;

    for (holes = 0; holes <= 8; holes++) {
        place = flat_cells(80, 60);
        sink(&place, 70, 95, 15);
        sink(&place, 38, 48, 0);
        for (i = 0; i < holes; i++) {
            *cell_at(&place, outer_mm[i][0], outer_mm[i][1]) = 0;
        }
        IH_TEST_EQUAL(350 * (1300 - 70 * holes) / 1300 + 150 + (holes <= 5 ? 100 : 50) - FAR_LOSS,
                      ih_windows_score(&guarded.scratch, &rig, &params, &place), "outer", holes);
    }
    for (holes = 0; holes <= 5; holes++) {
        place = flat_cells(80, 60);
        sink(&place, 70, 95, 15);
        sink(&place, 38, 48, 0);
        for (i = 0; i < holes; i++) {
            *cell_at(&place, inner_mm[i][0], inner_mm[i][1]) = 0;
        }
        IH_TEST_EQUAL(350 * (1300 - 70 * holes) / 1300 + 150 + (holes < 5 ? 100 : 50) - FAR_LOSS,
                      ih_windows_score(&guarded.scratch, &rig, &params, &place), "inner", holes);
    }
}

/* 2.5 cells for 150 mm at 60 px: 3600 mm away, to the 65536th part of a cell. */
static void templates_have_a_least_width(void)
{
    struct ih_windows_place place = flat_cells(80, 60);

    rig.calibration.fx_px_q16 = rig.calibration.fy_px_q16 = 60 << 16;
    place.depth_mm = 3596;
    TEST_ASSERT_GREATER_THAN_INT32(0, ih_windows_score(&guarded.scratch, &rig, &params, &place));
    place.depth_mm = 3601;
    TEST_ASSERT_EQUAL_INT32(0, ih_windows_score(&guarded.scratch, &rig, &params, &place));
}

static bool near_within(struct ih_windows_place a, struct ih_windows_place b, int32_t mm)
{
    const bool is_near = ih_windows_are_near(&guarded.scratch, &rig, &a, &b, mm);

    TEST_ASSERT_TRUE(is_near == ih_windows_are_near(&guarded.scratch, &rig, &b, &a, mm));
    return is_near;
}

/* At 600 mm a cell is 5 mm wide and, with twice the focal length, 2.5 mm high. */
static void places_are_near_in_all_three_directions(void)
{
    static const struct {
        struct ih_windows_place other;
        int32_t mm;
    } cases[] = {{{94, 60, PLACE_MM, 0}, 70},      {{66, 60, PLACE_MM, 0}, 70},
                 {{80, 88, PLACE_MM, 0}, 70},      {{80, 32, PLACE_MM, 0}, 70},
                 {{80, 60, PLACE_MM + 70, 0}, 70}, {{84, 72, PLACE_MM + 60, 0}, 70},
                 {{86, 68, PLACE_MM + 60, 0}, 70}, {{92, 68, PLACE_MM + 30, 0}, 70},
                 {{120, 60, PLACE_MM, 0}, 200},    {{80, 60, PLACE_MM, 0}, 0}};
    const struct ih_windows_place place = flat_cells(80, 60);
    int i;

    rig.calibration.fy_px_q16 = 240 << 16;
    for (i = 0; i < IH_TEST_COUNT(cases); i++) {
        IH_TEST_EQUAL(false, near_within(place, cases[i].other, cases[i].mm), "as far", i);
        IH_TEST_EQUAL(true, near_within(place, cases[i].other, cases[i].mm + 1), "nearer", i);
    }
}

static void put(int32_t column, int32_t row, int32_t score)
{
    const struct ih_windows_place place = {(int16_t)column, (int16_t)row, PLACE_MM, (int16_t)score};

    ih_windows_remember(&guarded.scratch, &rig, &place, &windows);
}

static void expect_places(int count, const int32_t score[], const char *what)
{
    int i;

    IH_TEST_EQUAL(count, guarded.scratch.place_count, what, -1);
    for (i = 0; i < count; i++) {
        IH_TEST_EQUAL(score[i], guarded.scratch.place[i].score, what, i);
    }
}

/* Within 70 mm, 14 cells, the better one stays, the first of equals. */
static void of_near_places_the_best_is_remembered(void)
{
    (void)flat_cells(0, 0);
    put(50, 50, 800);
    put(63, 50, 799);
    put(50, 63, 800);
    expect_places(1, (const int32_t[]){800}, "worse ones");
    IH_TEST_EQUAL(50, guarded.scratch.place[0].column, "the first of equals", 0);
    put(64, 50, 790);
    put(36, 50, 810);
    put(50, 36, 800);
    expect_places(4, (const int32_t[]){810, 800, 800, 790}, "apart");
    IH_TEST_EQUAL(50, guarded.scratch.place[1].row, "the first of equals", 1);
    put(57, 50, 805); /* in the place of two, 7 cells from each; 21 from the best */
    expect_places(3, (const int32_t[]){810, 805, 800}, "better");
    TEST_ASSERT_EQUAL_INT32(0, windows.places_dropped);
}

static void a_full_table_drops_the_worst(void)
{
    int32_t i;

    (void)flat_cells(0, 0);
    memset(&windows, 0, sizeof windows);
    for (i = 0; i < IH_WINDOWS_PLACES_MAX; i++) {
        put(i % 8 * 20, i / 8 * 15, 900 - 2 * i);
    }
    IH_TEST_EQUAL(0, windows.places_dropped, "dropped", 0);
    put(0, 119, 700); /* 14 cells below the last row */
    put(0, 119, 900 - 2 * (IH_WINDOWS_PLACES_MAX - 1));
    IH_TEST_EQUAL(2, windows.places_dropped, "dropped", 1);
    IH_TEST_EQUAL(140, guarded.scratch.place[IH_WINDOWS_PLACES_MAX - 1].column, "last", 0);
    put(0, 119, 901 - 2 * (IH_WINDOWS_PLACES_MAX - 1));
    IH_TEST_EQUAL(3, windows.places_dropped, "dropped", 2);
    IH_TEST_EQUAL(IH_WINDOWS_PLACES_MAX, guarded.scratch.place_count, "places", 0);
    IH_TEST_EQUAL(0, guarded.scratch.place[IH_WINDOWS_PLACES_MAX - 1].column, "last", 1);
    put(0, 119, 999);
    IH_TEST_EQUAL(3, windows.places_dropped, "one in place of another", 3);
    IH_TEST_EQUAL(999, guarded.scratch.place[0].score, "best", 0);
}

/* What is within 40 mm of a plane is on it. A place stands on it when two of the probes below it are
 * seen, and two thirds of these are on it. */
static void a_plane_goes_on_below_where_two_thirds_are_on_it(void)
{
    static const int32_t below_mm[][2] = {{0, 150}, {0, 200},    {-60, 230}, {60, 230},
                                          {0, 260}, {-150, 260}, {150, 260}};
    int seen, on, i;

    for (seen = 0; seen <= 7; seen++) {
        for (on = 0; on <= seen; on++) {
            const struct ih_windows_place place = flat_cells(80, 60);

            for (i = 0; i < 7; i++) {
                /* The largest depth within 40 mm of 600, or the smallest beyond it. */
                const int32_t depth = i < on ? PLACE_MM + 40 : PLACE_MM + 41;

                *cell_at(&place, below_mm[i][0], below_mm[i][1]) = (int16_t)(i < seen ? depth : 0);
            }
            IH_TEST_EQUAL(seen >= 2 && 3 * on >= 2 * seen,
                          ih_windows_stands_on_plane(&guarded.scratch, &rig, &place), "seen, on it",
                          10 * seen + on);
        }
    }
}

/* Cells that 70 mm are; -1 where that is too near to a half. Scales are rounded down to Q16. */
static double mean_reach(int32_t focal_px, int32_t depth)
{
    const double cells = 70.0 * focal_px / depth;

    return floor(cells + 0.5) == floor(cells * (1 - 2e-4) + 0.5) ? floor(cells + 0.5) : -1;
}

/* The mean of the places around, weighted by how much better they are than 80 less than the best, as
 * far as 70 mm and 80 mm in depth: in double, over the whole image, from the cells' own scores. */
static void a_window_is_the_mean_of_good_places(void)
{
    int i, k, moved = 0;

    for (i = 0; i < IH_TEST_COUNT(vector_noises); i += 3) {
        const int32_t columns[] = {80, 3, 157, 80, 80}, rows[] = {60, 60, 60, 2, 118};

        draw_noise(&vector_noises[i]);
        ih_windows_survey(&frame, &rig, &guarded.scratch);
        for (k = 0; k < IH_TEST_COUNT(columns); k++) {
            const struct ih_windows_place best =
                ih_windows_place_at(&guarded.scratch, &rig, &params, columns[k], rows[k]);
            const double reach_u = mean_reach(vector_noises[i].fx_px, best.depth_mm);
            const double reach_v = mean_reach(vector_noises[i].fy_px, best.depth_mm);
            double weights = 0, u = 0, v = 0, z = 0;
            struct ih_window window;
            int32_t cell;

            if (best.depth_mm == 0 || best.score == 0 || reach_u < 0 || reach_v < 0) {
                continue;
            }
            for (cell = 0; cell < 160 * 120; cell++) {
                struct ih_windows_place place;

                if (abs(cell % 160 - columns[k]) > reach_u || abs(cell / 160 - rows[k]) > reach_v) {
                    continue;
                }
                place =
                    ih_windows_place_at(&guarded.scratch, &rig, &params, cell % 160, cell / 160);
                if (place.score > best.score - 80 && abs(place.depth_mm - best.depth_mm) <= 80) {
                    const double weight = place.score - best.score + 80;

                    weights += weight;
                    u += weight * place.column;
                    v += weight * place.row;
                    z += weight * place.depth_mm;
                }
            }
            ih_windows_mean(&guarded.scratch, &rig, &params, &best, &window);
            /* Half a unit of Q12, and of Q28 and Q8. */
            IH_TEST_WITHIN(0.5 / 4096 / vector_noises[i].fx_px + 1e-8,
                           (u / weights - 79.5) / vector_noises[i].fx_px,
                           ih_test_from_q(window.x_q28, 28), "x", i);
            IH_TEST_WITHIN(0.5 / 4096 / vector_noises[i].fy_px + 1e-8,
                           (v / weights - 59.5) / vector_noises[i].fy_px,
                           ih_test_from_q(window.y_q28, 28), "y", i);
            IH_TEST_WITHIN(0.51 / 256, z / weights, window.depth_mm_q8 / 256.0, "depth", i);
            IH_TEST_EQUAL(best.score, window.score, "score", i);
            moved += fabs(u / weights - columns[k]) > 0.1;
        }
    }
    TEST_ASSERT_TRUE(moved > 20);
}

/* The last place that is one less than the best by score_behind_max, or as good as score_min. */
static void windows_end_where_they_are_too_weak(void)
{
    static struct ih_windows all;

    TEST_ASSERT_EQUAL_STRING("three", vector_scenes[2].name);
    draw(&vector_scenes[2]);
    find("all");
    all = windows;
    TEST_ASSERT_EQUAL_INT32(3, all.window_count);
    params.score_behind_max = all.window[0].score - all.window[2].score;
    find("as weak as may be");
    TEST_ASSERT_EQUAL_INT32(3, windows.window_count);
    params.score_behind_max--;
    find("weaker");
    TEST_ASSERT_EQUAL_INT32(2, windows.window_count);
    ih_windows_params_default(&params);
    params.score_min = all.window[2].score;
    find("as low as may be");
    TEST_ASSERT_EQUAL_INT32(3, windows.window_count);
    params.score_min++;
    find("lower");
    TEST_ASSERT_EQUAL_INT32(2, windows.window_count);
}

/* Both lie at the working range's very ends. */
static void depths_at_the_ends_of_the_range_are_measured(void)
{
    static const uint16_t depth[] = {399, 400, 8000, 8001};
    int i;

    use_rig(64, 64, 60);
    for (i = 0; i < IH_TEST_COUNT(depth); i++) {
        int32_t u = 5, v = 6;

        fill(depth[i]);
        IH_TEST_EQUAL(depth[i] == 400 || depth[i] == 8000 ? depth[i] : 0,
                      ih_windows_pixel(&frame, &rig, 0, &u, &v), "depth", i);
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
    RUN_TEST(rolled_cameras_find_the_same);
    RUN_TEST(scores_match_float64);
    RUN_TEST(every_head_has_its_window);
    RUN_TEST(connected_cells_are_counted);
    RUN_TEST(rare_pixels_are_surveyed_with_half_the_side);
    RUN_TEST(planes_match_float64);
    RUN_TEST(scores_are_sums_of_their_parts);
    RUN_TEST(what_is_beyond_the_edge_counts_half);
    RUN_TEST(heads_bulge);
    RUN_TEST(a_bulge_needs_three_outer_probes);
    RUN_TEST(templates_have_a_least_width);
    RUN_TEST(places_are_near_in_all_three_directions);
    RUN_TEST(of_near_places_the_best_is_remembered);
    RUN_TEST(a_full_table_drops_the_worst);
    RUN_TEST(a_plane_goes_on_below_where_two_thirds_are_on_it);
    RUN_TEST(a_window_is_the_mean_of_good_places);
    RUN_TEST(windows_end_where_they_are_too_weak);
    RUN_TEST(depths_at_the_ends_of_the_range_are_measured);
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
