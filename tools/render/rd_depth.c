#include "rd_depth.h"

#include <math.h>
#include <stdlib.h>

#include "rd_rng.h"

/* Disparity comes in steps of 1/8 pixel. */
#define STEPS (8.0 * RD_DEPTH_SQUARE)
/* A step of disparity that is an edge, in squares. */
#define EDGE 1.5
/* So much light is enough, and the darkest surface that gives it at 1.2 m. */
#define LIGHT_ENOUGH 0.22
#define LIGHT_SPREAD 0.12
#define ALBEDO_ENOUGH 0.06
#define LIGHT_MM 1200.0
/* Noise is shared over so many squares; edges are ragged and holes are patches of so many. */
#define NOISE_SQUARES 2.5
#define EDGE_SQUARES 4.0
#define HOLE_SQUARES 5.0

bool rd_depth_make(struct rd_depth *depth, const struct rd_options *options, const struct rd_rig *rig)
{
    struct rd_rng rng = rd_rng_start(options->rig_seed, RD_STREAM_SENSOR + ((uint64_t)1 << 32));
    depth->columns = (rig->width + RD_DEPTH_SQUARE - 1) / RD_DEPTH_SQUARE;
    depth->rows = (rig->height + RD_DEPTH_SQUARE - 1) / RD_DEPTH_SQUARE;
    depth->product = rig->fx_px / RD_DEPTH_SQUARE * rd_rng_uniform(&rng, 55.0, 80.0);
    depth->noise = rd_rng_uniform(&rng, 0.0, 0.14) / RD_DEPTH_SQUARE;
    depth->dark_loss = rd_rng_uniform(&rng, 0.3, 1.0);
    depth->near_mm = rd_rng_uniform(&rng, 400.0, 520.0);
    depth->far_mm = rd_rng_uniform(&rng, 4000.0, 9000.0);
    depth->side = rd_rng_sign(&rng) > 0.0 ? 1 : -1;
    depth->edge = rd_rng_pick(&rng, 3);
    depth->seed = options->seed;
    size_t count = (size_t)depth->columns * (size_t)depth->rows;
    depth->disparity = calloc(count, sizeof *depth->disparity);
    depth->light = calloc(count, sizeof *depth->light);
    return depth->disparity != NULL && depth->light != NULL;
}

void rd_depth_free(struct rd_depth *depth)
{
    free(depth->disparity);
    free(depth->light);
}

static void look(struct rd_depth *depth, const struct rd_rig *rig, const struct rd_scene *scene, int row, int column)
{
    double middle = 0.5 * (RD_DEPTH_SQUARE - 1);
    struct rd_vec dir = rd_rig_pixel_ray(rig, column * RD_DEPTH_SQUARE + middle, row * RD_DEPTH_SQUARE + middle);
    struct rd_ray ray = {rd_v(0.0, 0.0, 0.0), dir};
    struct rd_hit hit;
    int at = row * depth->columns + column;
    depth->disparity[at] = 0.0f;
    depth->light[at] = 0.0f;
    if (rd_scene_hit(scene, &ray, RD_FAR_AWAY_MM, &hit)) {
        double bright = fmin(1.0, hit.albedo / ALBEDO_ENOUGH) * fabs(rd_dot(hit.normal, dir));
        depth->disparity[at] = (float)(depth->product / hit.point_mm.z);
        depth->light[at] = (float)(bright * LIGHT_MM / fmax(hit.point_mm.z, 0.4 * LIGHT_MM));
    }
}

/* -1 .. 1, smooth over so many squares, other in each frame; standard deviation about 0.35. */
static double smooth(const struct rd_depth *depth, int row, int column, double squares, int frame, uint64_t what)
{
    return 2.0 * rd_noise3(column / squares, row / squares, frame * 7.37, depth->seed + (what << 32)) - 1.0;
}

/* The largest disparity within the spread of an edge. */
static double spread_at(const struct rd_depth *depth, int row, int column)
{
    double max = 0.0;
    for (int c = column - depth->edge; c <= column + depth->edge; c++) {
        if (c >= 0 && c < depth->columns)
            max = fmax(max, (double)depth->disparity[row * depth->columns + c]);
    }
    return max;
}

/* Z in mm, 0: not known. `shadow`: the projector's light does not get there. */
static double measure(const struct rd_depth *depth, int row, int column, bool shadow, int frame)
{
    int at = row * depth->columns + column;
    double disparity = (double)depth->disparity[at], spread = spread_at(depth, row, column);
    bool ragged = spread - disparity > EDGE;
    if (ragged && smooth(depth, row, column, EDGE_SQUARES, frame, 1) < 0.1)
        return 0.0;
    double weak = depth->dark_loss * (LIGHT_ENOUGH + LIGHT_SPREAD * smooth(depth, row, column, HOLE_SQUARES, frame, 2));
    if (disparity <= 0.0 || shadow || (double)depth->light[at] < weak)
        return 0.0;
    disparity = ragged ? spread : disparity;
    disparity += 3.0 * depth->noise * smooth(depth, row, column, NOISE_SQUARES, frame, 3);
    double z_mm = depth->product / fmax(1e-3, floor(disparity * STEPS + 0.5) / STEPS);
    return z_mm < depth->near_mm || z_mm > depth->far_mm ? 0.0 : z_mm;
}

static void fill_square(const struct rd_rig *rig, int row, int column, double z_mm, uint16_t *depth_mm)
{
    for (int i = 0; i < RD_DEPTH_SQUARE * RD_DEPTH_SQUARE; i++) {
        int v = row * RD_DEPTH_SQUARE + i / RD_DEPTH_SQUARE, u = column * RD_DEPTH_SQUARE + i % RD_DEPTH_SQUARE;
        if (v < rig->height && u < rig->width)
            depth_mm[v * rig->width + u] = (uint16_t)floor(z_mm + 0.5);
    }
}

void rd_depth_expose(struct rd_depth *depth, const struct rd_rig *rig, const struct rd_scene *scene, int frame,
                     uint16_t *depth_mm)
{
    for (int row = 0; row < depth->rows; row++) {
        for (int column = 0; column < depth->columns; column++)
            look(depth, rig, scene, row, column);
        /* From the projector's side on, what lies at a place of its picture that was passed is covered. */
        double passed = -1e9;
        for (int i = 0; i < depth->columns; i++) {
            int column = depth->side > 0 ? i : depth->columns - 1 - i;
            double place = i + (double)depth->disparity[row * depth->columns + column];
            bool shadow = place < passed - 1.0;
            passed = fmax(passed, place);
            fill_square(rig, row, column, measure(depth, row, column, shadow, frame), depth_mm);
        }
    }
}
