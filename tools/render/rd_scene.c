#include "rd_scene.h"

#include <assert.h>
#include <stddef.h>

/* A sight line may end this much before its target: the target's own surface does not hide it. */
#define SIGHT_SLACK_MM 0.5

void rd_scene_clear(struct rd_scene *scene)
{
    scene->shape_count = 0;
    scene->still_count = 0;
    scene->material_count = 0;
}

int rd_scene_paint(struct rd_scene *scene, const struct rd_material *material)
{
    assert(scene->material_count < RD_MATERIALS_MAX);
    scene->materials[scene->material_count] = *material;
    return scene->material_count++;
}

void rd_scene_add(struct rd_scene *scene, const struct rd_shape *shape)
{
    assert(scene->shape_count < RD_SHAPES_MAX);
    scene->shapes[scene->shape_count++] = *shape;
}

void rd_scene_move(struct rd_scene *scene, int first, const struct rd_pose *outer)
{
    for (int i = first; i < scene->shape_count; i++)
        rd_shape_move(&scene->shapes[i], outer);
}

static void describe(const struct rd_scene *scene, const struct rd_shape *shape, const struct rd_ray *ray, double t_mm,
                     struct rd_hit *hit)
{
    const struct rd_material *material = &scene->materials[shape->material];
    hit->t_mm = t_mm;
    hit->point_mm = rd_along(ray->origin_mm, ray->dir, t_mm);
    hit->normal = rd_shape_normal(shape, hit->point_mm);
    if (rd_dot(hit->normal, ray->dir) > 0.0)
        hit->normal = rd_scale(hit->normal, -1.0);
    hit->albedo = rd_material_albedo(material, rd_pose_in(&shape->paint, hit->point_mm));
    hit->gloss = material->gloss;
}

bool rd_scene_hit_among(const struct rd_scene *scene, const int16_t *indices, int index_count, const struct rd_ray *ray,
                        double t_max_mm, struct rd_hit *hit)
{
    const struct rd_shape *nearest = NULL;
    for (int i = 0; i < index_count; i++) {
        const struct rd_shape *shape = &scene->shapes[indices != NULL ? indices[i] : i];
        double t = rd_shape_hit(shape, ray, t_max_mm);
        if (t > 0.0) {
            t_max_mm = t;
            nearest = shape;
        }
    }
    if (nearest != NULL)
        describe(scene, nearest, ray, t_max_mm, hit);
    return nearest != NULL;
}

bool rd_scene_hit(const struct rd_scene *scene, const struct rd_ray *ray, double t_max_mm, struct rd_hit *hit)
{
    return rd_scene_hit_among(scene, NULL, scene->shape_count, ray, t_max_mm, hit);
}

bool rd_scene_blocked(const struct rd_scene *scene, struct rd_vec from_mm, struct rd_vec to_mm)
{
    struct rd_vec offset = rd_sub(to_mm, from_mm);
    double length_mm = rd_length(offset);
    struct rd_ray ray = {from_mm, rd_scale(offset, 1.0 / length_mm)};
    for (int i = 0; i < scene->shape_count; i++) {
        if (rd_shape_hit(&scene->shapes[i], &ray, length_mm - SIGHT_SLACK_MM) > 0.0)
            return true;
    }
    return false;
}
