#include "rd_ambient.h"

#include <stdlib.h>
#include <string.h>

#define TILE_PX 16

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
