#include "rd_ambient.h"

#include <stdlib.h>
#include <string.h>

#define TILE_PX 16
/* A pixel that differs from a neighbour by this, grey levels, is on an edge. */
#define EDGE_GREY 4.0f
#define EDGE_SIDE 4
#define BLUR_SIGMAS 3.0

/* A tile's view: all its rays lie within an angle of one axis. */
struct tile {
    struct rd_vec axis;
    double cosine, sine;
};

struct rd_ambient {
    int width, height, tile_columns, tile_rows;
    struct rd_vec *rays; /* by pixel */
    struct tile *tiles;
    float *still_grey;
    float *still_t_mm; /* distance of the still surface; RD_FAR_AWAY_MM where there is none */
    float *row_copy;   /* three rows, for the softening */
};

static void make_rays(struct rd_ambient *a, const struct rd_rig *rig)
{
    for (int v = 0; v < a->height; v++) {
        for (int u = 0; u < a->width; u++)
            a->rays[v * a->width + u] = rd_rig_pixel_ray(rig, u, v);
    }
}

static int tile_end(int tile_index, int size_px)
{
    int end = (tile_index + 1) * TILE_PX;
    return end < size_px ? end : size_px;
}

static struct tile tile_of(const struct rd_ambient *a, int column, int row)
{
    int u0 = column * TILE_PX, v0 = row * TILE_PX;
    int u1 = tile_end(column, a->width) - 1, v1 = tile_end(row, a->height) - 1;
    struct tile tile = {.axis = a->rays[(v0 + v1) / 2 * a->width + (u0 + u1) / 2], .cosine = 1.0};
    int corners[4] = {v0 * a->width + u0, v0 * a->width + u1, v1 * a->width + u0, v1 * a->width + u1};
    for (int i = 0; i < 4; i++)
        tile.cosine = fmin(tile.cosine, rd_dot(tile.axis, a->rays[corners[i]]));
    tile.cosine -= 1e-6; /* its edges bulge a little between the corners */
    tile.sine = sqrt(1.0 - tile.cosine * tile.cosine);
    return tile;
}

struct rd_ambient *rd_ambient_new(const struct rd_rig *rig)
{
    struct rd_ambient *a = calloc(1, sizeof *a);
    size_t pixel_count = (size_t)rig->width * (size_t)rig->height;
    if (a == NULL)
        return NULL;
    a->width = rig->width;
    a->height = rig->height;
    a->tile_columns = (rig->width + TILE_PX - 1) / TILE_PX;
    a->tile_rows = (rig->height + TILE_PX - 1) / TILE_PX;
    a->rays = malloc(pixel_count * sizeof *a->rays);
    a->tiles = malloc((size_t)a->tile_columns * (size_t)a->tile_rows * sizeof *a->tiles);
    a->still_grey = malloc(pixel_count * sizeof *a->still_grey);
    a->still_t_mm = malloc(pixel_count * sizeof *a->still_t_mm);
    a->row_copy = malloc(3 * (size_t)rig->width * sizeof *a->row_copy);
    if (a->rays == NULL || a->tiles == NULL || a->still_grey == NULL || a->still_t_mm == NULL || a->row_copy == NULL) {
        rd_ambient_free(a);
        return NULL;
    }
    make_rays(a, rig);
    for (int row = 0; row < a->tile_rows; row++) {
        for (int column = 0; column < a->tile_columns; column++)
            a->tiles[row * a->tile_columns + column] = tile_of(a, column, row);
    }
    return a;
}

void rd_ambient_free(struct rd_ambient *ambient)
{
    if (ambient == NULL)
        return;
    free(ambient->rays);
    free(ambient->tiles);
    free(ambient->still_grey);
    free(ambient->still_t_mm);
    free(ambient->row_copy);
    free(ambient);
}

/* Whether the cone of rays may meet the shape's bounding ball: the angle between their axes is at most the sum of
 * the cone's and the ball's. */
static bool may_see(const struct tile *tile, const struct rd_shape *shape)
{
    double distance = rd_length(shape->bound_centre_mm), radius = shape->bound_radius_mm;
    if (distance <= radius)
        return true;
    double sine = radius / distance, cosine = sqrt(1.0 - sine * sine);
    double between = rd_dot(tile->axis, shape->bound_centre_mm) / distance;
    return between >= tile->cosine * cosine - tile->sine * sine;
}

static int list_shapes(const struct tile *tile, const struct rd_scene *scene, int first, int end, int16_t *indices)
{
    int count = 0;
    for (int i = first; i < end; i++) {
        if (may_see(tile, &scene->shapes[i]))
            indices[count++] = (int16_t)i;
    }
    return count;
}

static void still_tile(struct rd_ambient *a, const struct rd_scene *scene, const struct rd_light *light, int column,
                       int row)
{
    int16_t indices[RD_SHAPES_MAX];
    int count = list_shapes(&a->tiles[row * a->tile_columns + column], scene, 0, scene->still_count, indices);
    for (int v = row * TILE_PX; v < tile_end(row, a->height); v++) {
        for (int u = column * TILE_PX; u < tile_end(column, a->width); u++) {
            int i = v * a->width + u;
            struct rd_ray ray = {rd_v(0.0, 0.0, 0.0), a->rays[i]};
            struct rd_hit hit;
            bool seen = rd_scene_hit_among(scene, indices, count, &ray, RD_FAR_AWAY_MM, &hit);
            a->still_grey[i] = (float)(seen ? rd_light_grey(light, scene, &hit, ray.dir) : light->nothing_grey);
            a->still_t_mm[i] = (float)(seen ? hit.t_mm : RD_FAR_AWAY_MM);
        }
    }
}

void rd_ambient_still(struct rd_ambient *ambient, const struct rd_scene *scene, const struct rd_light *light)
{
    for (int row = 0; row < ambient->tile_rows; row++) {
        for (int column = 0; column < ambient->tile_columns; column++)
            still_tile(ambient, scene, light, column, row);
    }
}

static bool on_edge(const struct rd_ambient *a, int u, int v)
{
    float low = a->still_grey[v * a->width + u], high = low;
    for (int y = v > 0 ? v - 1 : 0; y <= v + 1 && y < a->height; y++) {
        for (int x = u > 0 ? u - 1 : 0; x <= u + 1 && x < a->width; x++) {
            low = fminf(low, a->still_grey[y * a->width + x]);
            high = fmaxf(high, a->still_grey[y * a->width + x]);
        }
    }
    return high - low > EDGE_GREY;
}

static double mean_grey(const struct rd_rig *rig, const struct rd_scene *scene, const struct rd_light *light, int u,
                        int v)
{
    double sum = 0.0;
    for (int i = 0; i < EDGE_SIDE * EDGE_SIDE; i++) {
        double right = (i % EDGE_SIDE + 0.5) / EDGE_SIDE - 0.5, down = (i / EDGE_SIDE + 0.5) / EDGE_SIDE - 0.5;
        struct rd_ray ray = {rd_v(0.0, 0.0, 0.0), rd_rig_pixel_ray(rig, u + right, v + down)};
        struct rd_hit hit;
        bool seen = rd_scene_hit(scene, &ray, RD_FAR_AWAY_MM, &hit);
        sum += seen ? rd_light_grey(light, scene, &hit, ray.dir) : light->nothing_grey;
    }
    return sum / (EDGE_SIDE * EDGE_SIDE);
}

/* The means go to the rows above the one that is looked at, when no neighbour needs those any more. */
void rd_ambient_edges(struct rd_ambient *ambient, const struct rd_rig *rig, const struct rd_scene *scene,
                      const struct rd_light *light)
{
    int w = ambient->width;
    float *before = ambient->row_copy, *here = before + w;
    for (int v = 0; v < ambient->height; v++) {
        for (int u = 0; u < w; u++)
            here[u] =
                on_edge(ambient, u, v) ? (float)mean_grey(rig, scene, light, u, v) : ambient->still_grey[v * w + u];
        if (v > 0)
            memcpy(ambient->still_grey + (v - 1) * w, before, (size_t)w * sizeof *before);
        float *free_row = before;
        before = here;
        here = free_row;
    }
    memcpy(ambient->still_grey + (ambient->height - 1) * w, before, (size_t)w * sizeof *before);
}

/* One line of `count` samples, `step` apart, through a copy of it. */
static void blur_line(float *line, int count, int step, double sigma_px, float *copy)
{
    int reach = (int)(BLUR_SIGMAS * sigma_px + 1.0);
    for (int i = 0; i < count; i++)
        copy[i] = line[i * step];
    for (int i = 0; i < count; i++) {
        double sum = 0.0, weights = 0.0;
        for (int k = i > reach ? i - reach : 0; k <= i + reach && k < count; k++) {
            double weight = exp(-0.5 * (k - i) * (k - i) / (sigma_px * sigma_px));
            sum += weight * (double)copy[k];
            weights += weight;
        }
        line[i * step] = (float)(sum / weights);
    }
}

void rd_ambient_blur(struct rd_ambient *ambient, double sigma_px, float *grey)
{
    for (int v = 0; v < ambient->height; v++)
        blur_line(grey + v * ambient->width, ambient->width, 1, sigma_px, ambient->row_copy);
    for (int u = 0; u < ambient->width; u++)
        blur_line(grey + u, ambient->height, ambient->width, sigma_px, ambient->row_copy);
}

static void moving_tile(const struct rd_ambient *a, const struct rd_scene *scene, const struct rd_light *light,
                        int column, int row, float *grey)
{
    int16_t indices[RD_SHAPES_MAX];
    const struct tile *tile = &a->tiles[row * a->tile_columns + column];
    int count = list_shapes(tile, scene, scene->still_count, scene->shape_count, indices);
    if (count == 0)
        return;
    for (int v = row * TILE_PX; v < tile_end(row, a->height); v++) {
        for (int u = column * TILE_PX; u < tile_end(column, a->width); u++) {
            int i = v * a->width + u;
            struct rd_ray ray = {rd_v(0.0, 0.0, 0.0), a->rays[i]};
            struct rd_hit hit;
            if (rd_scene_hit_among(scene, indices, count, &ray, (double)a->still_t_mm[i], &hit))
                grey[i] = (float)rd_light_grey(light, scene, &hit, ray.dir);
        }
    }
}

/* 1-2-1 in both directions: no lens resolves single pixels. The border stays as it is. */
static void soften(struct rd_ambient *a, float *grey)
{
    int w = a->width;
    size_t row_bytes = (size_t)w * sizeof *grey;
    float *above = a->row_copy, *here = above + w, *below = here + w;
    memcpy(above, grey, row_bytes);
    memcpy(here, grey + w, row_bytes);
    for (int v = 1; v < a->height - 1; v++) {
        float *row = grey + v * w;
        memcpy(below, row + w, row_bytes);
        for (int u = 1; u < w - 1; u++)
            row[u] = 0.0625f * (above[u - 1] + above[u + 1] + below[u - 1] + below[u + 1]) +
                     0.125f * (above[u] + below[u] + here[u - 1] + here[u + 1]) + 0.25f * here[u];
        float *free_row = above;
        above = here;
        here = below;
        below = free_row;
    }
}

void rd_ambient_frame(struct rd_ambient *ambient, const struct rd_scene *scene, const struct rd_light *light,
                      float *grey)
{
    memcpy(grey, ambient->still_grey, (size_t)ambient->width * (size_t)ambient->height * sizeof *grey);
    for (int row = 0; row < ambient->tile_rows; row++) {
        for (int column = 0; column < ambient->tile_columns; column++)
            moving_tile(ambient, scene, light, column, row, grey);
    }
    soften(ambient, grey);
}
