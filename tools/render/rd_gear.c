#include "rd_parts.h"

#define BAND_PIECES 8

static void make_child(struct rd_person *p, struct rd_rng *rng)
{
    p->head_axes_mm = rd_scale(p->head_axes_mm, rd_rng_uniform(rng, 0.90, 0.94));
    p->build = rd_rng_uniform(rng, 0.65, 0.78);
    p->shoulder_mm = rd_rng_uniform(rng, 120.0, 150.0);
    p->shoulder_drop_mm = rd_rng_uniform(rng, 20.0, 45.0);
    p->torso_mm = rd_rng_uniform(rng, 290.0, 360.0);
    p->neck_radius_mm = rd_rng_uniform(rng, 34.0, 44.0);
    p->neck_length_mm = rd_rng_uniform(rng, 25.0, 45.0);
    p->nose_mm = rd_rng_uniform(rng, 11.0, 16.0);
    p->girth *= 0.8;
    p->upper_arm_mm *= 0.72;
    p->forearm_mm *= 0.72;
    p->hand_mm *= 0.76;
    p->lower_mm = rd_rng_uniform(rng, 40.0, 110.0);
    p->beard = false;
}

void rd_person_make_kind(struct rd_person *p, enum rd_person_kind kind, struct rd_rng *rng)
{
    p->gear.bulk = rd_rng_uniform(rng, 0.0, 1.0);
    p->gear.hat = (enum rd_hat_kind)rd_rng_pick(rng, 4);
    switch (kind) {
    case RD_PERSON_VARIED:
        break;
    case RD_PERSON_CHILD:
        make_child(p, rng);
        break;
    case RD_PERSON_HAT:
        p->hat = true;
        p->gear.own_hat = true;
        break;
    case RD_PERSON_MASK:
        p->mask = true;
        p->gear.cup = true;
        break;
    case RD_PERSON_BEARD:
        p->beard = true;
        p->mask = false;
        p->gear.thick_beard = true;
        break;
    case RD_PERSON_LONG_HAIR:
        p->hair = RD_HAIR_LONG;
        p->hat = false;
        break;
    case RD_PERSON_BALD:
        p->hair = RD_HAIR_SHORT;
        p->hat = false;
        p->bald = true;
        break;
    case RD_PERSON_GLASSES:
        p->glasses = true;
        p->gear.frames = true;
        p->gear.dark_lenses = rd_rng_chance(rng, 0.5);
        break;
    case RD_PERSON_HEADPHONES:
        p->hat = false;
        p->gear.headphones = true;
        break;
    }
}

void rd_gear_dress(struct rd_person *p, struct rd_scene *scene, struct rd_rng *rng)
{
    struct rd_material plastic = {.albedo = rd_rng_uniform(rng, 0.03, 0.5), .gloss = 0.3, .seed = rd_rng_next(rng)};
    struct rd_material dark = {.albedo = rd_rng_uniform(rng, 0.015, 0.04), .gloss = 0.4, .seed = rd_rng_next(rng)};
    p->gear.plastic = rd_scene_paint(scene, &plastic);
    p->gear.dark = rd_scene_paint(scene, &dark);
}

static struct rd_vec in_head(const struct rd_person *p, double x, double y, double z)
{
    return rd_v(x * p->head_axes_mm.x, y * p->head_axes_mm.y, z * p->head_axes_mm.z);
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

void rd_gear_build(const struct rd_person *p, struct rd_scene *scene)
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
