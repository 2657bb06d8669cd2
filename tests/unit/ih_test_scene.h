/* ih_test_scene - spaces made from the scenes that tools/oracle/scenes.py wrote: the same integers
 * on both sides. A test includes it once. */
#ifndef IH_TEST_SCENE_H
#define IH_TEST_SCENE_H

#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "detect/ih_rays.h"

#include "ih_test.h"

struct vector_rays {
    int32_t origin_mm_q8[3];
    const int32_t (*slope_q20)[2];
};

struct vector_scene {
    const char *name;
    const struct vector_rays *rays;
    const int32_t *depth;            /* by slot: Q8 mm, 0 not known, -1 empty */
    double centre_mm[3], semi_mm[3]; /* the head; semi-axes 0: there is none */
};

#include "scenes.inc"

#define SCENE_COUNT IH_TEST_COUNT(vector_scenes)

static struct ih_rays rays;

/* The ray of a slot meets something at a depth. */
static inline void see(int32_t slot, int32_t depth_mm_q8)
{
    struct ih_ray *ray = &rays.ray[slot];
    const int64_t along = (int64_t)depth_mm_q8 - rays.origin_mm_q8[2];

    ray->state = IH_RAY_SEEN;
    ray->point_mm_q8[0] =
        (int32_t)(rays.origin_mm_q8[0] + ih_mul_shift(along, ray->slope_x_q20, 20));
    ray->point_mm_q8[1] =
        (int32_t)(rays.origin_mm_q8[1] + ih_mul_shift(along, ray->slope_y_q20, 20));
    ray->point_mm_q8[2] = depth_mm_q8;
}

/* The ray of a slot meets nothing, or nobody knows. */
static inline void lose(int32_t slot, enum ih_ray_state state)
{
    struct ih_ray *ray = &rays.ray[slot];

    ray->state = (int32_t)state;
    ray->point_mm_q8[0] = ray->point_mm_q8[1] = ray->point_mm_q8[2] = 0;
}

static inline void make_rays(const struct vector_rays *from)
{
    int32_t slot;

    memcpy(rays.origin_mm_q8, from->origin_mm_q8, sizeof rays.origin_mm_q8);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot].slope_x_q20 = from->slope_q20[slot][0];
        rays.ray[slot].slope_y_q20 = from->slope_q20[slot][1];
        lose(slot, IH_RAY_UNKNOWN);
    }
}

static inline void make_scene(const struct vector_scene *scene)
{
    int32_t slot;

    make_rays(scene->rays);
    for (slot = 0; slot < IH_SLOTS; slot++) {
        if (scene->depth[slot] > 0) {
            see(slot, scene->depth[slot]);
        } else if (scene->depth[slot] < 0) {
            lose(slot, IH_RAY_EMPTY);
        }
    }
}

static inline const struct vector_scene *scene_named(const char *name)
{
    int i;

    for (i = 0; i < SCENE_COUNT; i++) {
        if (strcmp(vector_scenes[i].name, name) == 0) {
            return &vector_scenes[i];
        }
    }
    TEST_FAIL_MESSAGE(name);
    return NULL;
}

/* The scene in a mirror: left is right. */
static inline void mirror_rays(void)
{
    int32_t slot;

    rays.origin_mm_q8[0] = -rays.origin_mm_q8[0];
    for (slot = 0; slot < IH_SLOTS; slot++) {
        rays.ray[slot].slope_x_q20 = -rays.ray[slot].slope_x_q20;
        rays.ray[slot].point_mm_q8[0] = -rays.ray[slot].point_mm_q8[0];
    }
}

/* The whole scene, projector and all, elsewhere. */
static inline void move_rays(const int32_t by_mm_q8[3])
{
    int32_t slot;
    int axis;

    for (axis = 0; axis < 3; axis++) {
        rays.origin_mm_q8[axis] += by_mm_q8[axis];
        for (slot = 0; slot < IH_SLOTS; slot++) {
            if (rays.ray[slot].state == IH_RAY_SEEN) {
                rays.ray[slot].point_mm_q8[axis] += by_mm_q8[axis];
            }
        }
    }
}

static inline double distance_mm(const int32_t a_mm_q8[3], const double b_mm[3])
{
    double sum = 0;
    int axis;

    for (axis = 0; axis < 3; axis++) {
        const double d = ih_test_from_q(a_mm_q8[axis], 8) - b_mm[axis];

        sum += d * d;
    }
    return sqrt(sum);
}

#endif
