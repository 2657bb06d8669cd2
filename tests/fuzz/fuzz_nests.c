/* Cuts, ellipses, hypotheses and heads of any grid of depths. Input: rig, field, what the grid looks
 * like, a level and a place, samples. */
#include <string.h>

#include "fuzz_check.h"
#include "fuzz_rig.h"

#define MIN_Q8 (1 << 8)
#define MAX_Q8 (IH_SURFACE_DEPTH_MAX_MM << 8)
#define BUMPS_MAX 8
#define NODES_MAX 64

static void raise_node(struct ih_surface *surface, int32_t x, int32_t y, int64_t by_q8)
{
    int64_t depth = surface->depth_mm_q8[y][x] + by_q8;
    surface->depth_mm_q8[y][x] = (int32_t)(depth < MIN_Q8   ? MIN_Q8
                                           : depth > MAX_Q8 ? MAX_Q8
                                                            : depth);
}

static void fill_plain(struct fuzz_input *input, struct ih_surface *surface)
{
    int32_t base = fuzz_within(input, MIN_Q8, MAX_Q8);
    int32_t slope_x = fuzz_within(input, -8192, 8191), slope_y = fuzz_within(input, -8192, 8191);
    int32_t noise = fuzz_within(input, 0, 255 << 8), board = fuzz_within(input, 0, 255 << 8);
    uint32_t seed = fuzz_byte(input);
    for (int32_t i = 0; i < IH_SURFACE_GRID * IH_SURFACE_GRID; i++) {
        int32_t x = i % IH_SURFACE_GRID, y = i / IH_SURFACE_GRID;
        surface->depth_mm_q8[y][x] = base;
        raise_node(surface, x, y,
                   (int64_t)slope_x * x + (int64_t)slope_y * y + (x + y) % 2 * board +
                       (int64_t)noise * fuzz_noise(&seed) / 65536);
    }
}

/* A paraboloid that is nearer, or farther, than what is around. */
static void add_bump(struct fuzz_input *input, struct ih_surface *surface)
{
    int32_t middle_x = fuzz_within(input, 0, IH_SURFACE_GRID - 1);
    int32_t middle_y = fuzz_within(input, 0, IH_SURFACE_GRID - 1);
    int32_t radius_x = fuzz_within(input, 1, 32), radius_y = fuzz_within(input, 1, 32);
    int32_t height_q8 = fuzz_within(input, -(400 << 8), 400 << 8);
    for (int32_t i = 0; i < IH_SURFACE_GRID * IH_SURFACE_GRID; i++) {
        int32_t x = i % IH_SURFACE_GRID, y = i / IH_SURFACE_GRID;
        int32_t dx = x - middle_x, dy = y - middle_y;
        int64_t inside_q10 =
            1024 - dx * dx * 1024 / (radius_x * radius_x) - dy * dy * 1024 / (radius_y * radius_y);
        if (inside_q10 > 0) {
            raise_node(surface, x, y, -height_q8 * inside_q10 / 1024);
        }
    }
}

static void fill_surface(struct fuzz_input *input, struct ih_surface *surface)
{
    memset(surface, 0, sizeof *surface);
    fuzz_tables_field(input, &surface->field);
    fill_plain(input, surface);
    for (int32_t count = fuzz_byte(input) % (BUMPS_MAX + 1); count > 0; count--) {
        add_bump(input, surface);
    }
    for (int32_t count = fuzz_byte(input) % (NODES_MAX + 1); count > 0; count--) {
        int32_t x = fuzz_within(input, 0, IH_SURFACE_GRID - 1);
        int32_t y = fuzz_within(input, 0, IH_SURFACE_GRID - 1);
        surface->depth_mm_q8[y][x] = fuzz_within(input, MIN_Q8, MAX_Q8);
    }
    surface->valid = true;
    surface->nearest_mm_q8 = INT32_MAX;
    for (int32_t i = 0; i < IH_SURFACE_GRID * IH_SURFACE_GRID; i++) {
        int32_t depth = surface->depth_mm_q8[i / IH_SURFACE_GRID][i % IH_SURFACE_GRID];
        surface->nearest_mm_q8 = depth < surface->nearest_mm_q8 ? depth : surface->nearest_mm_q8;
    }
}

/* Every contour of a level, as an ellipse and in parts, around a place anywhere on the grid. */
static void cut(struct fuzz_input *input, const struct ih_surface *surface,
                const struct ih_ellipse_params *params)
{
    static struct ih_contours contours;
    static struct ih_arcs parts;
    static struct ih_ellipse_scratch scratch;
    struct ih_ellipse ellipse;
    int64_t level = surface->nearest_mm_q8 + (int64_t)fuzz_within(input, -256, 2000 << 8);
    ih_contours_level(surface, (int32_t)(level > MAX_Q8 ? MAX_Q8 : level), &contours);
    fuzz_check_contours(&contours);
    struct ih_vertex place = {(int16_t)fuzz_within(input, 0, (IH_SURFACE_GRID - 1) * 512),
                              (int16_t)fuzz_within(input, 0, (IH_SURFACE_GRID - 1) * 512)};
    for (int32_t i = 0; i < contours.contour_count; i++) {
        const struct ih_contour *contour = &contours.contour[i];
        int32_t winding = ih_ellipse_winding(&contours, contour, place);
        FUZZ_CHECK(!contour->closed || abs(winding) <= 1);
        if (ih_ellipse_of_contour(&contours, contour, &ellipse)) {
            FUZZ_CHECK(ellipse.area_q16 != 0 && ellipse.shape_q16 > 0);
            FUZZ_CHECK(ellipse.ratio_q16 >= 65535 && ellipse.ratio_q16 <= 255 << 16);
        }
        if (ih_arcs_make(&contours, contour, params, &parts) &&
            ih_ellipse_of_part(&parts, place, params, &scratch, &ellipse)) {
            FUZZ_CHECK(ellipse.area_q16 > 0 && ellipse.shape_q16 <= params->shape_max_q16);
            FUZZ_CHECK(ellipse.ratio_q16 <= params->ratio_arc_max_q16);
        }
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct ih_surface surface;
    static struct ih_samples samples;
    static struct ih_nests nests;
    static struct ih_nests_scratch scratch;
    static struct ih_hypotheses hypotheses;
    struct fuzz_input input = {data, size};
    struct ih_params params;
    const struct ih_rig *rig = fuzz_tables_rig(&input);
    fill_surface(&input, &surface);
    const struct fuzz_input remaining = input;
    for (int variant = 0; variant < 2; variant++) {
        if (variant == 0) {
            ih_params_default(&params);
        } else {
            ih_params_paper(&params);
        }
        input = remaining;
        cut(&input, &surface, &params.nests.ellipse);
        ih_nests_find(&surface, &params.nests, &scratch, &nests);
        fuzz_check_hypotheses(&nests, &surface, &params.nests);
        fuzz_tables_samples(&input, &samples);
        ih_hypotheses_select(&nests, &surface, &samples, rig, &params.hypotheses, &hypotheses);
        fuzz_check_heads(&hypotheses, &nests, &samples);
    }
    return 0;
}
