/* rotated_rig - dots that a rotated projector casts on a bumpy wall, in double: what ih_rotation_vote and ih_health
 * are tested with. Shares nothing with the core but its structs and the lens (ih_camera_distort). */
#ifndef ROTATED_RIG_H
#define ROTATED_RIG_H

#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "rig/ih_camera.h"
#include "rig/ih_rig.h"
#include "ih_test.h"

#define Q30 1073741824.0
#define DEG 0.017453292519943295

/* Unused in one of the two tests. */
static inline void rotation_of(const double rotation_deg[3], int32_t rotation_rad_q30[3])
{
    for (int axis = 0; axis < 3; axis++) {
        rotation_rad_q30[axis] = (int32_t)lround(rotation_deg[axis] * DEG * Q30);
    }
}

/* By Rodrigues' formula. */
static inline void rotated_ray(const struct ih_calibration *c, int slot,
                               const double rotation_deg[3], double ray[3])
{
    double angle = 0, along = 0, r[3], n[3];
    for (int axis = 0; axis < 3; axis++) {
        r[axis] = c->ray_q30[slot][axis] / Q30;
        angle += rotation_deg[axis] * rotation_deg[axis];
    }
    angle = sqrt(angle);
    for (int axis = 0; axis < 3; axis++) {
        n[axis] = angle > 0 ? rotation_deg[axis] / angle : 0;
        along += n[axis] * r[axis];
    }
    angle *= DEG;
    for (int axis = 0; axis < 3; axis++) {
        int next = (axis + 1) % 3, last = (axis + 2) % 3;
        ray[axis] = r[axis] * cos(angle) + (n[next] * r[last] - n[last] * r[next]) * sin(angle) +
                    n[axis] * along * (1 - cos(angle));
    }
}

/* Undistorted pixel of a dot far away. */
static inline void place_at_infinity(const struct ih_calibration *c, int slot,
                                     const double rotation_deg[3], double place_px[2])
{
    double ray[3];
    rotated_ray(c, slot, rotation_deg, ray);
    place_px[0] = (c->fx_px_q16 * ray[0] / ray[2] + c->cx_px_q16) / 65536.0;
    place_px[1] = (c->fy_px_q16 * ray[1] / ray[2] + c->cy_px_q16) / 65536.0;
}

/* A frame's dots on a wall with waves of 100 mm that are elsewhere in each call; noise on both axes. */
static inline void see_dots(const struct ih_calibration *c, const double rotation_deg[3],
                            double wall_mm, double noise_px, struct ih_test_random *random,
                            struct ih_dots *out)
{
    static struct ih_rig lens;
    double phase = 6.28 * ih_test_unit(random);
    lens.calibration = *c;
    memset(out, 0, sizeof *out);
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        double ray[3], point[3];
        int32_t u, v;
        rotated_ray(c, slot, rotation_deg, ray);
        double depth = wall_mm + 100 * sin(phase + slot % IH_GRID * 0.7 + slot / IH_GRID * 0.4);
        double far = (depth - c->origin_mm_q16[2] / 65536.0) / ray[2];
        for (int axis = 0; axis < 3; axis++) {
            point[axis] = c->origin_mm_q16[axis] / 65536.0 + far * ray[axis];
        }
        ih_camera_distort(&lens, (int32_t)lround(point[0] / point[2] * 268435456.0),
                          (int32_t)lround(point[1] / point[2] * 268435456.0), &u, &v);
        if (ih_camera_sees(&lens, u, v)) {
            struct ih_dot *dot = &out->dot[out->dot_count++];
            dot->u_px_q12 = u + (int32_t)lround(4096 * noise_px * ih_test_normal(random));
            dot->v_px_q12 = v + (int32_t)lround(4096 * noise_px * ih_test_normal(random));
        }
    }
}

#endif
