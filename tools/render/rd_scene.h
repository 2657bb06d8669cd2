/* rd_scene - everything that light can meet, behind one intersect function.
 * The first `still_count` shapes stay as they are from frame to frame (room, seat); those after them are set anew
 * for every frame (person).
 */
#ifndef RD_SCENE_H
#define RD_SCENE_H

#include <stdbool.h>
#include <stdint.h>

#include "rd_material.h"
#include "rd_shape.h"

#define RD_SHAPES_MAX 512
#define RD_MATERIALS_MAX 64
/* Farther surfaces do not count as hits. */
#define RD_FAR_AWAY_MM 1e5

struct rd_scene {
    struct rd_shape shapes[RD_SHAPES_MAX];
    int shape_count, still_count;
    struct rd_material materials[RD_MATERIALS_MAX];
    int material_count;
};

struct rd_hit {
    double t_mm;
    struct rd_vec point_mm;
    struct rd_vec normal; /* unit, turned towards where the ray came from */
    double albedo;
    double gloss;
};

void rd_scene_clear(struct rd_scene *scene);
/* Returns the material's index. */
int rd_scene_paint(struct rd_scene *scene, const struct rd_material *material);
void rd_scene_add(struct rd_scene *scene, const struct rd_shape *shape);
/* Moves the shapes from index `first` on as one body. */
void rd_scene_move(struct rd_scene *scene, int first, const struct rd_pose *outer);

/* The first surface along the ray nearer than t_max_mm. False: nothing there. */
bool rd_scene_hit(const struct rd_scene *scene, const struct rd_ray *ray, double t_max_mm, struct rd_hit *hit);
/* The same among some of the shapes only; indices NULL: among the first index_count. */
bool rd_scene_hit_among(const struct rd_scene *scene, const int16_t *indices, int index_count, const struct rd_ray *ray,
                        double t_max_mm, struct rd_hit *hit);
/* Whether anything stands between `from` and `to`. */
bool rd_scene_blocked(const struct rd_scene *scene, struct rd_vec from_mm, struct rd_vec to_mm);

#endif
