#include "rd_person.h"

#define FINGER_COUNT 4
/* Part of the hand's length from the wrist to the middle of the palm. */
#define PALM_FROM_WRIST 0.30

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

/* The elbow's position: outwards and down as far as the lengths of the two bones leave it free. */
static struct rd_vec elbow_of(struct rd_vec shoulder, struct rd_vec wrist, double upper_mm, double fore_mm,
                              struct rd_vec outwards)
{
    struct rd_vec offset = rd_sub(wrist, shoulder);
    double reach = rd_length(offset);
    struct rd_vec axis = rd_unit(offset);
    double along = (upper_mm * upper_mm - fore_mm * fore_mm + reach * reach) / (2.0 * reach);
    double aside = sqrt(fmax(0.0, upper_mm * upper_mm - along * along));
    struct rd_vec free_direction = rd_unit(rd_along(outwards, axis, -rd_dot(outwards, axis)));
    return rd_along(rd_along(shoulder, axis, along), free_direction, aside);
}

/* The wrist as near to where the hand should be as the arm's length allows. */
static struct rd_vec reachable(struct rd_vec shoulder, struct rd_vec wrist, double upper_mm, double fore_mm)
{
    struct rd_vec offset = rd_sub(wrist, shoulder);
    double reach = rd_length(offset);
    double allowed = rd_clamp(reach, fabs(upper_mm - fore_mm) + 20.0, 0.985 * (upper_mm + fore_mm));
    return rd_along(shoulder, rd_unit(offset), allowed);
}

/* Two bones, bent towards the palm (-Z of the hand's frame) as the hand curls. */
static void add_finger(struct rd_vec knuckle, double aside, double length_mm, double radius_mm, double curl, int skin,
                       struct rd_scene *scene)
{
    double first = 1.3 * curl, second = 2.9 * curl;
    struct rd_vec way1 = rd_v(sin(aside) * cos(first), -cos(aside) * cos(first), -sin(first));
    struct rd_vec way2 = rd_v(sin(aside) * cos(second), -cos(aside) * cos(second), -sin(second));
    struct rd_vec joint = rd_along(knuckle, way1, 0.52 * length_mm);
    struct rd_vec tip = rd_along(joint, way2, 0.48 * length_mm - radius_mm);
    struct rd_shape bone1 = rd_shape_cone(knuckle, joint, radius_mm, 0.92 * radius_mm, skin);
    struct rd_shape bone2 = rd_shape_cone(joint, tip, 0.92 * radius_mm, 0.78 * radius_mm, skin);
    rd_scene_add(scene, &bone1);
    rd_scene_add(scene, &bone2);
}

/* In the hand's frame: fingers to -Y, palm looking to -Z, thumb at thumb_side * X. The right hand of a person who
 * faces the camera is the one at -X; palm forward and fingers up, its thumb points to +X. */
static void add_hand(const struct rd_person *p, const struct rd_hand *hand, double thumb_side, struct rd_scene *scene)
{
    static const double finger_length[FINGER_COUNT] = {0.40, 0.44, 0.41, 0.32};
    double size = p->hand_mm;
    int skin = p->paint.skin;
    struct rd_shape palm =
        rd_shape_ellipsoid(rd_pose_at(rd_v(0.0, 0.0, 0.0)), rd_v(0.23 * size, 0.30 * size, 0.085 * size), skin);
    rd_scene_add(scene, &palm);
    for (int i = 0; i < FINGER_COUNT; i++) {
        double across = thumb_side * (1.5 - i);
        struct rd_vec knuckle = rd_v(0.108 * size * across, -0.22 * size, 0.0);
        double aside = across * (0.03 + 0.15 * hand->spread);
        add_finger(knuckle, aside, finger_length[i] * size, 0.047 * size, hand->curl, skin, scene);
    }
    double out = 0.35 + 0.55 * hand->spread;
    struct rd_vec root = rd_v(thumb_side * 0.15 * size, 0.14 * size, -0.02 * size);
    struct rd_vec tip = rd_along(root, rd_v(thumb_side * sin(out), -cos(out), -0.35), 0.34 * size);
    struct rd_shape thumb = rd_shape_cone(root, tip, 0.068 * size, 0.048 * size, skin);
    rd_scene_add(scene, &thumb);
    if (hand->phone) {
        struct rd_pose before = rd_pose_at(rd_v(0.0, -0.12 * size, -0.085 * size - 5.0));
        struct rd_shape phone = rd_shape_box(before, rd_v(36.0, 75.0, 5.0), 4.0, p->gear.dark);
        rd_scene_add(scene, &phone);
    }
}

/* Upper arm, forearm and hand from the shoulder. `side` is -1 for the arm at -X and +1 for the other; a palm out
 * of reach is drawn as near to its place as the arm allows. */
static void add_arm(const struct rd_person *person, struct rd_vec shoulder_mm, const struct rd_pose *torso,
                    const struct rd_hand *hand, double side, struct rd_scene *scene)
{
    double upper = person->upper_arm_mm, fore = person->forearm_mm, girth = person->girth;
    double to_palm = PALM_FROM_WRIST * person->hand_mm;
    struct rd_vec wanted = rd_along(hand->palm_mm, hand->fingers, -to_palm);
    struct rd_vec wrist = reachable(shoulder_mm, wanted, upper, fore);
    struct rd_vec outwards = rd_turn(&torso->rot, rd_v(0.75 * side, 0.65, 0.10));
    struct rd_vec elbow = elbow_of(shoulder_mm, wrist, upper, fore, outwards);
    int cover = person->bare_arms ? person->paint.skin : person->paint.sleeve;
    struct rd_shape upper_arm = rd_shape_cone(shoulder_mm, elbow, 57.0 * girth, 45.0 * girth, person->paint.sleeve);
    struct rd_shape forearm = rd_shape_cone(elbow, wrist, 44.0 * girth, 29.0 * girth, cover);
    rd_scene_add(scene, &upper_arm);
    rd_scene_add(scene, &forearm);
    struct rd_pose pose = {rd_rot_frame(rd_scale(hand->fingers, -1.0), rd_scale(hand->facing, -1.0)),
                           rd_along(wrist, hand->fingers, to_palm)};
    int first = scene->shape_count;
    add_hand(person, hand, -side, scene);
    rd_scene_move(scene, first, &pose);
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
        add_arm(person, rd_pose_out(&posture->torso, joint), &posture->torso, &posture->hands[i], side, scene);
    }
}
