/* moved_rig - dots of a projector that was rotated, before a camera that was refocused, in double. Shares nothing with
 * the core but its structs and the lens (ih_camera_distort). */
#ifndef MOVED_RIG_H
#define MOVED_RIG_H

#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "rig/ih_camera.h"
#include "rig/ih_rig.h"
#include "ih_test.h"

#define Q30 1073741824.0
#define DEG 0.017453292519943295

/* Against the rig's file. */
struct moved_rig {
    double rotation_deg[3];
    double focal; /* relative change */
};

/* A wall with waves of 100 mm. */
struct moved_scene {
    double wall_mm, noise_px;
    double seen;       /* fraction of the dots */
    int32_t any_count; /* dots anywhere besides */
};

/* By Rodrigues' formula. */
static inline void moved_ray(const struct ih_calibration *c, int slot, const double rotation_deg[3],
                             double ray[3])
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
        const int next = (axis + 1) % 3, last = (axis + 2) % 3;

        ray[axis] = r[axis] * cos(angle) + (n[next] * r[last] - n[last] * r[next]) * sin(angle) +
                    n[axis] * along * (1 - cos(angle));
    }
}

/* Normalised coordinates of a dot at a depth. */
static inline void moved_dot_at(const struct ih_calibration *c, const struct moved_rig *moved,
                                int slot, double depth_mm, double at[2])
{
    const double origin_z = c->origin_mm_q16[2] / 65536.0;
    double ray[3];

    moved_ray(c, slot, moved->rotation_deg, ray);
    for (int axis = 0; axis < 2; axis++) {
        const double origin = c->origin_mm_q16[axis] / 65536.0;

        at[axis] = (origin + (depth_mm - origin_z) * ray[axis] / ray[2]) / depth_mm;
    }
}

static inline void add_dot(double u_px_q12, double v_px_q12, int slot, int16_t slot_of_dot[],
                           struct ih_dots *out)
{
    if (out->dot_count < IH_DOTS_MAX) {
        slot_of_dot[out->dot_count] = (int16_t)slot;
        out->dot[out->dot_count++] =
            (struct ih_dot){(int32_t)lround(u_px_q12), (int32_t)lround(v_px_q12), 10000};
    }
}

/* A frame's dots; the waves are elsewhere in each call. slot_of_dot: IH_NONE for those that are anywhere. */
static inline void see_dots(const struct ih_calibration *c, const struct moved_rig *moved,
                            const struct moved_scene *scene, struct ih_test_random *random,
                            int16_t slot_of_dot[IH_DOTS_MAX], struct ih_dots *out)
{
    static struct ih_rig lens;
    const double phase = 6.28 * ih_test_unit(random);

    lens.calibration = *c;
    lens.calibration.fx_px_q16 = (int32_t)lround(c->fx_px_q16 * (1 + moved->focal));
    lens.calibration.fy_px_q16 = (int32_t)lround(c->fy_px_q16 * (1 + moved->focal));
    memset(out, 0, sizeof *out);
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        const double depth_mm =
            scene->wall_mm + 100 * sin(phase + slot % IH_GRID * 0.7 + slot / IH_GRID * 0.4);
        double at[2];
        int32_t u, v;

        moved_dot_at(c, moved, slot, depth_mm, at);
        ih_camera_distort(&lens, (int32_t)lround(ldexp(at[0], 28)),
                          (int32_t)lround(ldexp(at[1], 28)), &u, &v);
        if (ih_camera_sees(&lens, u, v) && ih_test_unit(random) < scene->seen) {
            const double off_u_px = scene->noise_px * ih_test_normal(random);
            const double off_v_px = scene->noise_px * ih_test_normal(random);

            add_dot(u + 4096 * off_u_px, v + 4096 * off_v_px, slot, slot_of_dot, out);
        }
    }
    for (int32_t i = 0; i < scene->any_count; i++) {
        const double u_px = (c->width - 1) * ih_test_unit(random);
        const double v_px = (c->height - 1) * ih_test_unit(random);

        add_dot(4096 * u_px, 4096 * v_px, IH_NONE, slot_of_dot, out);
    }
}

#endif
