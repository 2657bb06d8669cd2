#include "rd_parts.h"

#define FINGER_COUNT 4
/* Part of the hand's length from the wrist to the middle of the palm. */
#define PALM_FROM_WRIST 0.30

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

void rd_arm_build(const struct rd_person *person, struct rd_vec shoulder_mm, const struct rd_pose *torso,
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
