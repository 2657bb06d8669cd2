/* rd_shape - the bodies that scenes are made of, and where a ray meets them.
 * Every kind lives in its own local frame (`pose`); Y is its long or upright axis, down as in the camera.
 *
 *   kind         half_mm                             further
 *   ellipsoid    semi-axes                           clip: only the part with clip_normal . u <= clip_limit,
 *                                                    u = local point / semi-axes (bowls, hair, caps)
 *   cone         x, z radii of the two end balls,    the hull of two balls: limbs, fingers, necks
 *                y their distance; starts at origin
 *   box          half edges                          round_mm: radius of its edges
 *   cylinder     x radius, y half height             closed at both ends
 *   frustum      x lower, z upper radius,            a round tube that narrows, open at both ends
 *                y half height
 *   wall         x, y half width and height          a flat rectangle at local z = 0
 *   relief                                           a measured surface, in its depth camera's frame
 */
#ifndef RD_SHAPE_H
#define RD_SHAPE_H

#include "rd_relief.h"

/* Returned where a ray misses. */
#define RD_MISS (-1.0)

enum rd_shape_kind { RD_ELLIPSOID, RD_CONE, RD_BOX, RD_CYLINDER, RD_FRUSTUM, RD_WALL, RD_RELIEF };

struct rd_ray {
    struct rd_vec origin_mm;
    struct rd_vec dir; /* unit */
};

struct rd_shape {
    enum rd_shape_kind kind;
    int material; /* index in the scene's materials */
    struct rd_pose pose;
    struct rd_vec half_mm;
    double round_mm;
    struct rd_vec clip_normal;
    double clip_limit;
    const struct rd_relief *relief;
    struct rd_pose paint;          /* frame of the material's pattern */
    struct rd_vec bound_centre_mm; /* a ball that holds the whole shape */
    double bound_radius_mm;
};

struct rd_shape rd_shape_ellipsoid(struct rd_pose pose, struct rd_vec semi_axes_mm, int material);
struct rd_shape rd_shape_ball(struct rd_vec centre_mm, double radius_mm, int material);
struct rd_shape rd_shape_cone(struct rd_vec a_mm, struct rd_vec b_mm, double a_radius_mm, double b_radius_mm,
                              int material);
struct rd_shape rd_shape_box(struct rd_pose pose, struct rd_vec half_mm, double round_mm, int material);
struct rd_shape rd_shape_cylinder(struct rd_pose pose, double radius_mm, double half_height_mm, int material);
struct rd_shape rd_shape_frustum(struct rd_pose pose, double lower_radius_mm, double upper_radius_mm,
                                 double half_height_mm, int material);
struct rd_shape rd_shape_wall(struct rd_pose pose, double half_width_mm, double half_height_mm, int material);

/* The relief must outlive the shape. */
struct rd_shape rd_shape_relief(struct rd_pose pose, const struct rd_relief *relief, int material);

/* Puts a shape that was made with respect to `outer` into outer's own surroundings. */
void rd_shape_move(struct rd_shape *shape, const struct rd_pose *outer);

/* Distance along the ray to the first surface between 0 and t_max_mm, else RD_MISS. */
double rd_shape_hit(const struct rd_shape *shape, const struct rd_ray *ray, double t_max_mm);

/* Unit normal at a point of the surface, on the outer side. */
struct rd_vec rd_shape_normal(const struct rd_shape *shape, struct rd_vec point_mm);

#endif
