/* rd_relief - the surface that a depth image shows, as something a ray can meet.
 * In:    depth in mm by pixel, 0 = no measurement, and the pinhole camera that took it.
 * Out:   points and normals in that camera's frame.
 * Method: Over the pixels a plane is linear in inverse depth, and so is a ray. Each pixel gets the plane that fits its
 *        neighbourhood, which takes most of the sensor's noise away; neighbouring pixels whose inverse depths are
 *        close are joined by triangles, steps are not bridged. A ray walks over the image along its own projection:
 *        over blocks of pixels first, over the pixels of those whose depths it passes.
 * Cost:  60 ms to make one of 640x480 pixels, about 0.3 us per ray.
 */
#ifndef RD_RELIEF_H
#define RD_RELIEF_H

#include <stdbool.h>
#include <stdint.h>

#include "rd_vec.h"

struct rd_relief;

struct rd_relief_camera {
    int width, height; /* 2 or more each */
    double fx_px, fy_px, cx_px, cy_px;
};

/* Depths row by row. NULL: out of memory. */
struct rd_relief *rd_relief_new(const struct rd_relief_camera *camera, const uint16_t *depth_mm);
void rd_relief_free(struct rd_relief *relief);

/* Distance along a ray (unit direction) to the surface between t_min_mm and t_max_mm, else negative. */
double rd_relief_hit(const struct rd_relief *relief, struct rd_vec origin_mm, struct rd_vec dir, double t_min_mm,
                     double t_max_mm);

/* Unit normal at a point of the surface, towards the depth camera. */
struct rd_vec rd_relief_normal(const struct rd_relief *relief, struct rd_vec point_mm);

/* Where the line of sight of a pixel or of a point meets the surface. False: nothing was measured there. */
bool rd_relief_at_pixel(const struct rd_relief *relief, double u_px, double v_px, struct rd_vec *position_mm);
bool rd_relief_at_point(const struct rd_relief *relief, struct rd_vec point_mm, struct rd_vec *position_mm);

#endif
