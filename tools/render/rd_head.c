#include "rd_person.h"

#include <stddef.h>

#define BAND_PIECES 8

/* Where an ellipsoid belongs: centre in units of the head's semi-axes, size in mm. */
struct lump {
    struct rd_vec at;
    struct rd_vec half_mm;
};

static struct rd_vec in_head(const struct rd_person *p, double x, double y, double z)
{
    return rd_v(x * p->head_axes_mm.x, y * p->head_axes_mm.y, z * p->head_axes_mm.z);
}

/* Adds an ellipsoid in the head's frame, painted with the face's pattern. */
static void add_lump(const struct rd_person *p, struct lump lump, int material, struct rd_scene *scene)
{
    struct rd_pose pose = rd_pose_at(in_head(p, lump.at.x, lump.at.y, lump.at.z));
    struct rd_shape shape = rd_shape_ellipsoid(pose, lump.half_mm, material);
    shape.paint = rd_pose_at(rd_v(0.0, 0.0, 0.0));
    rd_scene_add(scene, &shape);
}

/* The skull fills the upper part of the ellipsoid, face and jaw the lower front part. */
static void add_skull(const struct rd_person *p, struct rd_scene *scene)
{
    int face = p->paint.face;
    double jaw = p->jaw_width;
    struct lump lumps[] = {
        {rd_v(0.0, -0.22, 0.0), in_head(p, 1.0, 0.78, 1.0)},                   /* skull */
        {rd_v(0.0, 0.27, -0.22), in_head(p, 0.84 * jaw, 0.68, 0.72)},          /* face */
        {rd_v(0.0, 0.62, -0.30), in_head(p, 0.68 * jaw, 0.34, 0.54)},          /* jaw */
        {rd_v(0.0, 0.83, -0.58), rd_v(31.0 * jaw, 17.0, 18.0)},                /* chin */
        {rd_v(0.0, -0.18, -0.86), rd_v(0.60 * p->head_axes_mm.x, 12.0, 15.0)}, /* brow */
        {rd_v(0.0, 0.56, -0.80), rd_v(26.0, 15.0, 13.0)},                      /* lips */
        {rd_v(-0.36, 0.20, -0.63), rd_v(24.0, 22.0, 14.0)},                    /* cheeks */
        {rd_v(0.36, 0.20, -0.63), rd_v(24.0, 22.0, 14.0)},
    };
    for (size_t i = 0; i < sizeof lumps / sizeof lumps[0]; i++)
        add_lump(p, lumps[i], face, scene);
}

static void add_nose_and_ears(const struct rd_person *p, struct rd_scene *scene)
{
    double b = p->head_axes_mm.y, c = p->head_axes_mm.z;
    struct rd_shape nose = rd_shape_cone(rd_v(0.0, -0.06 * b, -0.95 * c), rd_v(0.0, 0.27 * b, -c - p->nose_mm + 11.0),
                                         7.0, 11.0, p->paint.face);
    nose.paint = rd_pose_at(rd_v(0.0, 0.0, 0.0));
    rd_scene_add(scene, &nose);
    for (double side = -1.0; side <= 1.0; side += 2.0) {
        struct rd_pose pose = {rd_rot_euler(side * 0.4, 0.0, 0.0), in_head(p, side * 0.99, 0.06, 0.10)};
        struct rd_shape ear = rd_shape_ellipsoid(pose, rd_v(8.0, 31.0, 18.0), p->paint.skin);
        rd_scene_add(scene, &ear);
    }
}

/* A cap of hair or felt: the part of a larger ellipsoid on one side of a plane. */
static void add_cap(const struct rd_person *p, double larger, struct rd_vec away, double limit, int material,
                    struct rd_scene *scene)
{
    struct rd_vec semi_axes_mm = rd_scale(p->head_axes_mm, larger);
    struct rd_shape cap = rd_shape_ellipsoid(rd_pose_at(rd_v(0.0, 0.0, 0.0)), semi_axes_mm, material);
    cap.clip_normal = away;
    cap.clip_limit = limit;
    rd_scene_add(scene, &cap);
}

static void add_long_hair(const struct rd_person *p, struct rd_scene *scene)
{
    for (double side = -1.0; side <= 1.0; side += 2.0) {
        struct rd_shape lock = rd_shape_cone(in_head(p, side * 0.86, -0.10, 0.15), in_head(p, side * 0.98, 1.15, 0.15),
                                             28.0, 33.0, p->paint.hair);
        rd_scene_add(scene, &lock);
    }
    struct lump fall = {rd_v(0.0, 0.45, 0.72), in_head(p, 0.95, 0.95, 0.38)};
    add_lump(p, fall, p->paint.hair, scene);
}

static void add_hair(const struct rd_person *p, struct rd_scene *scene)
{
    struct rd_vec front_down = rd_v(0.0, 0.75, -0.66);
    if (p->hair == RD_HAIR_SHORT)
        return;
    add_cap(p, p->hair == RD_HAIR_FULL ? 1.10 : 1.05, front_down, 0.02, p->paint.hair, scene);
    if (p->hair == RD_HAIR_LONG)
        add_long_hair(p, scene);
    if (p->hair == RD_HAIR_BUN) {
        struct lump bun = {rd_v(0.0, -0.62, 0.92), rd_v(38.0, 36.0, 36.0)};
        add_lump(p, bun, p->paint.hair, scene);
    }
}

static void add_hat(const struct rd_person *p, struct rd_scene *scene)
{
    add_cap(p, 1.12, rd_v(0.0, 1.0, -0.15), -0.30, p->paint.hat, scene);
    struct rd_pose pose = {rd_rot_euler(0.0, -0.15, 0.0), in_head(p, 0.0, -0.36, -1.0)};
    struct rd_shape brim = rd_shape_ellipsoid(pose, in_head(p, 0.92, 0.05, 0.62), p->paint.hat);
    rd_scene_add(scene, &brim);
}

/* An ellipsoid in the head's frame whose pattern is the head's too. */
static void put_ellipsoid(struct rd_scene *scene, struct rd_vec at_mm, struct rd_vec half_mm, int material)
{
    struct rd_shape shape = rd_shape_ellipsoid(rd_pose_at(at_mm), half_mm, material);
    shape.paint = rd_pose_at(rd_v(0.0, 0.0, 0.0));
    rd_scene_add(scene, &shape);
}

static void put_rod(struct rd_scene *scene, struct rd_vec a_mm, struct rd_vec b_mm, double radius_mm, int material)
{
    struct rd_shape rod = rd_shape_cone(a_mm, b_mm, radius_mm, radius_mm, material);
    rd_scene_add(scene, &rod);
}

static void add_headphones(const struct rd_person *p, struct rd_scene *scene)
{
    double wide = p->hair == RD_HAIR_SHORT ? 1.06 : 1.14, thick_mm = 16.0 + 10.0 * p->gear.bulk;
    struct rd_vec before = in_head(p, -wide, 0.0, 0.10);
    for (int i = 1; i <= BAND_PIECES; i++) {
        double angle = RD_PI * i / BAND_PIECES;
        struct rd_vec here = in_head(p, -wide * cos(angle), -wide * sin(angle), 0.10);
        put_rod(scene, before, here, 7.0 + 4.0 * p->gear.bulk, p->gear.plastic);
        before = here;
    }
    for (double side = -1.0; side <= 1.0; side += 2.0) {
        struct rd_vec at_mm = rd_add(in_head(p, side * 1.04, 0.06, 0.10), rd_v(side * 0.5 * thick_mm, 0.0, 0.0));
        put_ellipsoid(scene, at_mm, rd_v(thick_mm, 42.0, 36.0), p->gear.plastic);
    }
}

static void add_frames(const struct rd_person *p, struct rd_scene *scene)
{
    for (double side = -1.0; side <= 1.0; side += 2.0) {
        struct rd_vec hinge = in_head(p, side * 0.76, -0.08, -0.84), ear = in_head(p, side * 1.03, -0.06, 0.10);
        put_rod(scene, hinge, ear, 2.5, p->gear.dark);
        if (p->gear.dark_lenses)
            put_ellipsoid(scene, in_head(p, side * 0.42, -0.04, -0.97), rd_v(27.0, 20.0, 4.0), p->gear.dark);
    }
}

/* Cloth over nose and mouth, painted as the face below is. */
static void add_cup(const struct rd_person *p, struct rd_scene *scene)
{
    struct rd_vec half_mm = rd_v(0.62 * p->head_axes_mm.x, 0.34 * p->head_axes_mm.y, 26.0 + 14.0 * p->gear.bulk);
    put_ellipsoid(scene, in_head(p, 0.0, 0.48, -0.80), half_mm, p->paint.face);
}

static void add_thick_beard(const struct rd_person *p, struct rd_scene *scene)
{
    double long_mm = 30.0 + 60.0 * p->gear.bulk;
    put_ellipsoid(scene, rd_add(in_head(p, 0.0, 0.76, -0.58), rd_v(0.0, 0.4 * long_mm, 0.0)), rd_v(46.0, long_mm, 34.0),
                  p->paint.hair);
    for (double side = -1.0; side <= 1.0; side += 2.0)
        put_rod(scene, in_head(p, side * 0.74, 0.30, -0.30), in_head(p, side * 0.42, 0.78, -0.55), 22.0, p->paint.hair);
}

static void put_cap(const struct rd_person *p, double larger, struct rd_vec away, double limit, struct rd_scene *scene)
{
    struct rd_shape cap =
        rd_shape_ellipsoid(rd_pose_at(rd_v(0.0, 0.0, 0.0)), rd_scale(p->head_axes_mm, larger), p->paint.hat);
    cap.clip_normal = away;
    cap.clip_limit = limit;
    rd_scene_add(scene, &cap);
}

static void add_own_hat(const struct rd_person *p, struct rd_scene *scene)
{
    double bulk = p->gear.bulk;
    switch (p->gear.hat) {
    case RD_HAT_PEAKED:
        put_cap(p, 1.13, rd_v(0.0, 1.0, -0.15), -0.25, scene);
        put_ellipsoid(scene, in_head(p, 0.0, -0.34, -1.05), in_head(p, 0.85, 0.05, 0.5 + 0.3 * bulk), p->paint.hat);
        break;
    case RD_HAT_KNITTED:
        put_cap(p, 1.13 + 0.07 * bulk, rd_v(0.0, 0.95, -0.30), 0.0, scene);
        if (bulk > 0.5)
            put_ellipsoid(scene, in_head(p, 0.0, -1.25, 0.1), rd_v(32.0, 32.0, 32.0), p->gear.plastic);
        break;
    case RD_HAT_WIDE:
        put_cap(p, 1.14, rd_v(0.0, 1.0, 0.0), -0.3, scene);
        put_ellipsoid(scene, in_head(p, 0.0, -0.36, 0.0), in_head(p, 1.7 + 0.8 * bulk, 0.05, 1.6 + 0.7 * bulk),
                      p->paint.hat);
        break;
    case RD_HAT_HOOD:
        put_cap(p, 1.18 + 0.12 * bulk, rd_v(0.0, 0.35, -0.94), 0.30, scene);
        break;
    }
}

/* What the person wears, in the head's frame. */
static void add_gear(const struct rd_person *p, struct rd_scene *scene)
{
    if (p->gear.headphones)
        add_headphones(p, scene);
    if (p->gear.frames)
        add_frames(p, scene);
    if (p->gear.cup)
        add_cup(p, scene);
    if (p->gear.thick_beard)
        add_thick_beard(p, scene);
    if (p->gear.own_hat)
        add_own_hat(p, scene);
}

void rd_head_build(const struct rd_person *person, const struct rd_pose *head, struct rd_scene *scene)
{
    int first = scene->shape_count;
    add_skull(person, scene);
    add_nose_and_ears(person, scene);
    add_hair(person, scene);
    if (person->hat && !person->gear.own_hat)
        add_hat(person, scene);
    add_gear(person, scene);
    rd_scene_move(scene, first, head);
}
