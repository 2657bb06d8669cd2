#include "rd_person.h"

#include "rd_parts.h"

static void draw_body(struct rd_person *p, struct rd_rng *rng)
{
    p->head_axes_mm.x = rd_clamp(78.0 + 4.0 * rd_rng_normal(rng), 69.0, 87.0);
    p->head_axes_mm.y = rd_clamp(115.0 + 5.0 * rd_rng_normal(rng), 103.0, 127.0);
    p->head_axes_mm.z = rd_clamp(98.0 + 4.0 * rd_rng_normal(rng), 88.0, 108.0);
    p->jaw_width = rd_rng_uniform(rng, 0.90, 1.06);
    p->nose_mm = rd_rng_uniform(rng, 15.0, 26.0);
    p->neck_radius_mm = rd_rng_uniform(rng, 48.0, 64.0);
    p->neck_length_mm = rd_rng_uniform(rng, 30.0, 60.0);
    p->torso_mm = rd_rng_uniform(rng, 400.0, 470.0);
    p->shoulder_mm = rd_rng_uniform(rng, 150.0, 190.0);
    p->shoulder_drop_mm = rd_rng_uniform(rng, 30.0, 70.0);
    p->girth = rd_rng_uniform(rng, 0.85, 1.15);
    p->upper_arm_mm = rd_rng_uniform(rng, 275.0, 320.0);
    p->forearm_mm = rd_rng_uniform(rng, 235.0, 275.0);
    p->hand_mm = rd_rng_uniform(rng, 170.0, 200.0);
}

static void draw_looks(struct rd_person *p, struct rd_rng *rng)
{
    static const enum rd_hair_style styles[] = {RD_HAIR_SHORT, RD_HAIR_SHORT, RD_HAIR_FULL,
                                                RD_HAIR_FULL,  RD_HAIR_LONG,  RD_HAIR_BUN};
    p->hair = styles[rd_rng_pick(rng, 6)];
    p->hat = rd_rng_chance(rng, 0.15);
    p->beard = p->hair != RD_HAIR_BUN && rd_rng_chance(rng, 0.25);
    p->glasses = rd_rng_chance(rng, 0.25);
    p->mask = rd_rng_chance(rng, 0.06);
    p->bare_arms = rd_rng_chance(rng, 0.35);
}

void rd_person_make(struct rd_person *person, struct rd_rng *rng)
{
    *person = (struct rd_person){.build = 1.0};
    draw_body(person, rng);
    draw_looks(person, rng);
}

/* Mostly dark, some brown, some grey or fair. */
static double hair_albedo(struct rd_rng *rng)
{
    double kind = rd_rng_uniform(rng, 0.0, 1.0);
    return kind < 0.65   ? rd_rng_uniform(rng, 0.05, 0.11)
           : kind < 0.88 ? rd_rng_uniform(rng, 0.14, 0.24)
                         : rd_rng_uniform(rng, 0.30, 0.45);
}

static struct rd_material cloth(struct rd_rng *rng)
{
    static const enum rd_pattern patterns[] = {RD_PLAIN, RD_PLAIN, RD_STRIPES, RD_CHECKS, RD_MOTTLE};
    struct rd_material m = {.grain = 0.12, .grain_mm = 6.0};
    m.pattern = patterns[rd_rng_pick(rng, 5)];
    m.albedo = rd_rng_uniform(rng, 0.08, 0.55);
    m.albedo2 = rd_rng_uniform(rng, 0.10, 0.65);
    m.period_mm = rd_rng_uniform(rng, 18.0, 90.0);
    m.seed = rd_rng_next(rng);
    return m;
}

void rd_person_dress(struct rd_person *person, struct rd_scene *scene, struct rd_rng *rng)
{
    double skin_albedo = rd_rng_uniform(rng, 0.34, 0.66);
    double hair = hair_albedo(rng);
    bool bald = person->hair == RD_HAIR_SHORT && rd_rng_chance(rng, 0.2);
    double hairline = rd_rng_uniform(rng, -0.66, -0.46);
    struct rd_material skin = {.albedo = skin_albedo, .grain = 0.06, .grain_mm = 9.0, .gloss = 0.08};
    skin.seed = rd_rng_next(rng);
    struct rd_material face = skin;
    face.pattern = RD_FACE;
    face.face = (struct rd_face_paint){.axes_mm = person->head_axes_mm,
                                       .hairline = bald || person->bald ? -2.5 : hairline,
                                       .hair_albedo = hair,
                                       .beard_albedo = person->beard ? 1.2 * hair : 0.0,
                                       .glasses = person->glasses,
                                       .mask = person->mask};
    struct rd_material strands = {.albedo = hair, .grain = 0.45, .grain_mm = 5.0, .gloss = 0.05};
    strands.seed = rd_rng_next(rng);
    struct rd_material hat = cloth(rng);
    struct rd_material shirt = cloth(rng);
    hat.pattern = RD_PLAIN;
    person->paint.face = rd_scene_paint(scene, &face);
    person->paint.skin = rd_scene_paint(scene, &skin);
    person->paint.hair = rd_scene_paint(scene, &strands);
    person->paint.hat = rd_scene_paint(scene, &hat);
    person->paint.cloth = rd_scene_paint(scene, &shirt);
    person->paint.sleeve = person->paint.cloth;
}

static struct rd_vec neck_base(const struct rd_person *p)
{
    return rd_v(0.0, -p->torso_mm, 0.0);
}

struct rd_pose rd_person_head_pose(const struct rd_person *person, const struct rd_pose *torso, double yaw,
                                   double pitch, double roll)
{
    /* The head turns about the top of the spine, which lies below and a little behind its middle. */
    struct rd_pose neck = {rd_rot_euler(yaw, pitch, roll), neck_base(person)};
    double up_mm = person->neck_length_mm + 0.80 * person->head_axes_mm.y;
    struct rd_pose middle = rd_pose_at(rd_v(0.0, -up_mm, -22.0));
    struct rd_pose head = rd_pose_mul(&neck, &middle);
    return rd_pose_mul(torso, &head);
}

/* Chest, belly, collar and the muscles from neck to shoulders, in the torso's frame. */
static void add_trunk(const struct rd_person *p, struct rd_scene *scene)
{
    double g = p->girth, b = p->build, top = -p->torso_mm, wide = p->shoulder_mm;
    int cloth_index = p->paint.cloth;
    struct rd_shape chest = rd_shape_ellipsoid(rd_pose_at(rd_v(0.0, top + 210.0 * b, 6.0)),
                                               rd_v(0.92 * wide * g, 230.0 * b, 104.0 * g), cloth_index);
    struct rd_shape collar = rd_shape_ellipsoid(rd_pose_at(rd_v(0.0, top + 95.0 * b, 6.0)),
                                                rd_v(0.98 * wide, 100.0 * b, 80.0 * g), cloth_index);
    struct rd_shape belly = rd_shape_ellipsoid(rd_pose_at(rd_v(0.0, -70.0, -15.0)),
                                               rd_v(160.0 * g * b, 190.0 * b, 130.0 * g * b), cloth_index);
    struct rd_pose whole = rd_pose_at(rd_v(0.0, 0.0, 0.0));
    chest.paint = collar.paint = belly.paint = whole;
    rd_scene_add(scene, &chest);
    rd_scene_add(scene, &collar);
    rd_scene_add(scene, &belly);
    for (double side = -1.0; side <= 1.0; side += 2.0) {
        struct rd_shape muscle =
            rd_shape_cone(rd_v(side * 28.0 * b, top + 2.0, 14.0), rd_v(side * wide, top + p->shoulder_drop_mm, 8.0),
                          52.0 * b, 56.0 * g, cloth_index);
        muscle.paint = whole;
        rd_scene_add(scene, &muscle);
    }
}

static void add_neck(const struct rd_person *p, const struct rd_posture *posture, struct rd_scene *scene)
{
    struct rd_vec above = rd_v(0.0, 0.50 * p->head_axes_mm.y, 0.12 * p->head_axes_mm.z);
    struct rd_vec below = rd_add(neck_base(p), rd_v(0.0, 30.0, 0.0));
    struct rd_shape neck = rd_shape_cone(rd_pose_out(&posture->head, above), rd_pose_out(&posture->torso, below),
                                         p->neck_radius_mm, 1.08 * p->neck_radius_mm, p->paint.skin);
    rd_scene_add(scene, &neck);
}

void rd_person_build(const struct rd_person *person, const struct rd_posture *posture, struct rd_scene *scene)
{
    int first = scene->shape_count;
    add_trunk(person, scene);
    rd_scene_move(scene, first, &posture->torso);
    add_neck(person, posture, scene);
    rd_head_build(person, &posture->head, scene);
    for (int i = 0; i < 2; i++) {
        double side = i == 0 ? -1.0 : 1.0;
        struct rd_vec joint = rd_v(side * person->shoulder_mm, person->shoulder_drop_mm - person->torso_mm, 8.0);
        rd_arm_build(person, rd_pose_out(&posture->torso, joint), &posture->torso, &posture->hands[i], side, scene);
    }
}
