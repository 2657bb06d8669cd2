#include "rd_things.h"

#include "rd_room.h"

#define PUMPKIN_RIBS 9
#define LEAVES 30

/* Everything that a thing is built with; lengths are given in parts of its size. */
struct kit {
    struct rd_scene *scene;
    struct rd_rng *rng;
    double size_mm;
    int paint, paint2;
};

int rd_thing_paint(struct rd_scene *scene, struct rd_rng *rng)
{
    bool dark = rd_rng_chance(rng, 0.2);
    return rd_room_paint(scene, rng, dark ? 0.02 : 0.1, dark ? 0.05 : 0.75);
}

static double between(const struct kit *kit, double low, double high)
{
    return rd_rng_uniform(kit->rng, low, high);
}

static struct rd_vec sized(const struct kit *kit, double x, double y, double z)
{
    return rd_scale(rd_v(x, y, z), kit->size_mm);
}

static void put(const struct kit *kit, struct rd_shape shape)
{
    rd_scene_add(kit->scene, &shape);
}

static void put_ellipsoid(const struct kit *kit, struct rd_vec at, struct rd_vec half, int paint)
{
    put(kit, rd_shape_ellipsoid(rd_pose_at(rd_scale(at, kit->size_mm)), rd_scale(half, kit->size_mm), paint));
}

/* The part of an ellipsoid on the inner side of a plane (in units of its semi-axes). */
static void put_shell(const struct kit *kit, struct rd_vec at, struct rd_vec half, struct rd_vec away, double limit,
                      int paint)
{
    struct rd_shape shell =
        rd_shape_ellipsoid(rd_pose_at(rd_scale(at, kit->size_mm)), rd_scale(half, kit->size_mm), paint);
    shell.clip_normal = away;
    shell.clip_limit = limit;
    put(kit, shell);
}

static void put_limb(const struct kit *kit, struct rd_vec a, struct rd_vec b, double a_radius, double b_radius,
                     int paint)
{
    double s = kit->size_mm;
    put(kit, rd_shape_cone(rd_scale(a, s), rd_scale(b, s), a_radius * s, b_radius * s, paint));
}

/* Between two heights above the foot. */
static void put_tube(const struct kit *kit, double low, double high, double low_radius, double high_radius, int paint)
{
    struct rd_pose middle = rd_pose_at(sized(kit, 0.0, -0.5 * (low + high), 0.0));
    double s = kit->size_mm;
    put(kit, rd_shape_frustum(middle, low_radius * s, high_radius * s, 0.5 * (high - low) * s, paint));
}

static void put_disc(const struct kit *kit, double height, double radius, int paint)
{
    put(kit, rd_shape_cylinder(rd_pose_at(sized(kit, 0.0, -height, 0.0)), radius * kit->size_mm, 0.01 * kit->size_mm,
                               paint));
}

static void put_box(const struct kit *kit, struct rd_rot turn, struct rd_vec at, struct rd_vec half, double round,
                    int paint)
{
    struct rd_pose pose = {turn, rd_scale(at, kit->size_mm)};
    put(kit, rd_shape_box(pose, rd_scale(half, kit->size_mm), round * kit->size_mm, paint));
}

/* A bow from a to b over a middle piece. */
static void put_handle(const struct kit *kit, struct rd_vec a, struct rd_vec a_out, struct rd_vec b_out,
                       struct rd_vec b, double radius, int paint)
{
    put_limb(kit, a, a_out, radius, radius, paint);
    put_limb(kit, a_out, b_out, radius, radius, paint);
    put_limb(kit, b_out, b, radius, radius, paint);
}

/* Each of the following builds one kind, about one unit high or wide, and returns its height in units. */

static double make_ball(const struct kit *kit)
{
    put_ellipsoid(kit, rd_v(0.0, -0.5, 0.0), rd_v(0.5, 0.5, 0.5), kit->paint);
    return 1.0;
}

static double make_melon(const struct kit *kit)
{
    double high = between(kit, 0.34, 0.5), wide = between(kit, 0.36, 0.5);
    put_ellipsoid(kit, rd_v(0.0, -high, 0.0), rd_v(0.5, high, wide), kit->paint);
    return 2.0 * high;
}

static double make_pumpkin(const struct kit *kit)
{
    double high = between(kit, 0.30, 0.42);
    for (int i = 0; i < PUMPKIN_RIBS; i++) {
        double angle = 2.0 * RD_PI * i / PUMPKIN_RIBS;
        struct rd_pose pose = {rd_rot_euler(angle, 0.0, 0.0), sized(kit, 0.26 * sin(angle), -high, 0.26 * cos(angle))};
        put(kit, rd_shape_ellipsoid(pose, sized(kit, 0.17, high, 0.24), kit->paint));
    }
    put_limb(kit, rd_v(0.0, -1.8 * high, 0.0), rd_v(0.05, -2.0 * high - 0.10, 0.02), 0.06, 0.035, kit->paint2);
    return 2.0 * high + 0.12;
}

static double make_vase(const struct kit *kit)
{
    double belly = between(kit, 0.24, 0.40), waist = between(kit, 0.08, 0.16), lip = between(kit, 0.10, 0.24);
    double shoulder = between(kit, 0.55, 0.75);
    put_tube(kit, 0.0, 0.2, 0.6 * belly, 0.8 * belly, kit->paint);
    put_ellipsoid(kit, rd_v(0.0, -0.5 * shoulder, 0.0), rd_v(belly, 0.48 * shoulder, belly), kit->paint);
    put_tube(kit, 0.85 * shoulder, 0.90, 1.3 * waist, waist, kit->paint);
    put_tube(kit, 0.90, 1.0, waist, lip, kit->paint);
    return 1.0;
}

static double make_teapot(const struct kit *kit)
{
    double high = between(kit, 0.26, 0.36);
    put_ellipsoid(kit, rd_v(0.0, -high, 0.0), rd_v(0.34, high, 0.34), kit->paint);
    put_ellipsoid(kit, rd_v(0.0, -1.9 * high, 0.0), rd_v(0.18, 0.06, 0.18), kit->paint);
    put_ellipsoid(kit, rd_v(0.0, -1.9 * high - 0.09, 0.0), rd_v(0.045, 0.05, 0.045), kit->paint2);
    put_limb(kit, rd_v(0.26, -0.8 * high, 0.0), rd_v(0.52, -1.7 * high, 0.0), 0.09, 0.035, kit->paint);
    put_handle(kit, rd_v(-0.26, -1.5 * high, 0.0), rd_v(-0.50, -1.5 * high, 0.0), rd_v(-0.50, -0.7 * high, 0.0),
               rd_v(-0.28, -0.6 * high, 0.0), 0.03, kit->paint2);
    return 1.9 * high + 0.14;
}

static double make_kettle(const struct kit *kit)
{
    put_tube(kit, 0.0, 0.5, 0.36, 0.26, kit->paint);
    put_ellipsoid(kit, rd_v(0.0, -0.5, 0.0), rd_v(0.26, 0.12, 0.26), kit->paint);
    put_ellipsoid(kit, rd_v(0.0, -0.64, 0.0), rd_v(0.05, 0.05, 0.05), kit->paint2);
    put_limb(kit, rd_v(0.28, -0.30, 0.0), rd_v(0.46, -0.50, 0.0), 0.07, 0.035, kit->paint);
    put_handle(kit, rd_v(-0.26, -0.48, 0.0), rd_v(-0.22, -0.85, 0.0), rd_v(0.22, -0.85, 0.0), rd_v(0.26, -0.48, 0.0),
               0.03, kit->paint2);
    return 0.88;
}

static double make_bowl(const struct kit *kit)
{
    double deep = between(kit, 0.25, 0.5);
    bool upside_down = rd_rng_chance(kit->rng, 0.4);
    put_shell(kit, rd_v(0.0, upside_down ? 0.0 : -deep, 0.0), rd_v(0.5, deep, 0.5),
              rd_v(0.0, upside_down ? 1.0 : -1.0, 0.0), 0.0, kit->paint);
    return deep;
}

static double make_bottles(const struct kit *kit)
{
    int count = 1 + rd_rng_pick(kit->rng, 4);
    for (int i = 0; i < count; i++) {
        struct kit one = *kit;
        int first = kit->scene->shape_count;
        double radius = between(kit, 0.10, 0.16), neck = between(kit, 0.03, 0.05), shoulder = between(kit, 0.5, 0.7);
        struct rd_pose aside = rd_pose_at(sized(kit, 0.3 * (i - 0.5 * (count - 1)), 0.0, between(kit, -0.15, 0.15)));
        one.paint = i % 2 == 0 ? kit->paint : kit->paint2;
        put_tube(&one, 0.0, shoulder, radius, radius, one.paint);
        put_tube(&one, shoulder, shoulder + 0.15, radius, neck, one.paint);
        put_tube(&one, shoulder + 0.15, 1.0, neck, neck, one.paint);
        put_disc(&one, 1.0, 1.2 * neck, kit->paint2);
        rd_scene_move(kit->scene, first, &aside);
    }
    return 1.0;
}

static double make_helmet(const struct kit *kit)
{
    bool open_face = rd_rng_chance(kit->rng, 0.5);
    /* Cut off below, and where the face looks out; a visor behind the opening. */
    put_shell(kit, rd_v(0.0, -0.42, 0.0), rd_v(0.42, 0.44, 0.50), rd_v(0.0, 0.80, -0.60), 0.45, kit->paint);
    if (open_face) {
        struct rd_pose pose = {rd_rot_euler(0.0, -0.2, 0.0), sized(kit, 0.0, -0.48, -0.46)};
        put(kit, rd_shape_ellipsoid(pose, sized(kit, 0.36, 0.025, 0.24), kit->paint));
    } else {
        put_shell(kit, rd_v(0.0, -0.42, 0.0), rd_v(0.40, 0.42, 0.48), rd_v(0.0, 1.0, 0.0), 0.5, kit->paint2);
        put_shell(kit, rd_v(0.0, -0.20, -0.10), rd_v(0.38, 0.20, 0.46), rd_v(0.0, -1.0, 0.0), 0.3, kit->paint);
    }
    return 0.86;
}

static double make_backpack(const struct kit *kit)
{
    double high = between(kit, 0.42, 0.5), wide = between(kit, 0.30, 0.38), lean = between(kit, -0.25, 0.1);
    struct rd_rot turn = rd_rot_euler(0.0, lean, 0.0);
    put_box(kit, turn, rd_v(0.0, -high, 0.0), rd_v(wide, high, 0.18), 0.17, kit->paint);
    put_box(kit, turn, rd_v(0.0, -0.62 * high, -0.20), rd_v(0.75 * wide, 0.5 * high, 0.08), 0.07, kit->paint2);
    put_handle(kit, rd_v(-0.08, -1.95 * high, 0.08), rd_v(-0.07, -2.1 * high, 0.1), rd_v(0.07, -2.1 * high, 0.1),
               rd_v(0.08, -1.95 * high, 0.08), 0.02, kit->paint2);
    return 2.1 * high;
}

static double make_boxes(const struct kit *kit)
{
    int count = 1 + rd_rng_pick(kit->rng, 3);
    double top = 0.0;
    for (int i = 0; i < count; i++) {
        double half_x = between(kit, 0.22, 0.5), half_y = between(kit, 0.12, 0.3), half_z = between(kit, 0.2, 0.4);
        struct rd_rot turn = rd_rot_euler(between(kit, -0.6, 0.6), 0.0, 0.0);
        put_box(kit, turn, rd_v(0.0, -top - half_y, 0.0), rd_v(half_x, half_y, half_z), 0.01,
                i % 2 == 0 ? kit->paint : kit->paint2);
        top += 2.0 * half_y;
    }
    return top;
}

static double make_plant(const struct kit *kit)
{
    double pot = between(kit, 0.18, 0.3), stem = between(kit, 0.0, 0.35), radius = between(kit, 0.2, 0.32);
    double middle = pot + stem + 0.8 * radius;
    put_tube(kit, 0.0, pot, 0.14, 0.19, kit->paint2);
    put_disc(kit, 0.9 * pot, 0.17, kit->paint2);
    put_limb(kit, rd_v(0.0, -0.8 * pot, 0.0), rd_v(0.0, -middle, 0.0), 0.03, 0.02, kit->paint2);
    put_ellipsoid(kit, rd_v(0.0, -middle, 0.0), rd_v(0.8 * radius, 0.75 * radius, 0.8 * radius), kit->paint);
    for (int i = 0; i < LEAVES; i++) {
        double turn = between(kit, -RD_PI, RD_PI), up = between(kit, -1.0, 1.0), flap = between(kit, -1.0, 1.0);
        double side = sqrt(1.0 - up * up);
        struct rd_vec offset = rd_v(side * cos(turn), up, side * sin(turn));
        struct rd_pose pose = {rd_rot_frame(offset, rd_v(flap, 0.3, 1.0)),
                               rd_scale(rd_along(rd_v(0.0, -middle, 0.0), offset, 0.85 * radius), kit->size_mm)};
        put(kit, rd_shape_ellipsoid(pose, sized(kit, 0.05, 0.11, 0.012), kit->paint));
    }
    return middle + 1.1 * radius;
}

static double make_animal(const struct kit *kit)
{
    double head = between(kit, 0.19, 0.25), ear = between(kit, 0.05, 0.10), ear_high = between(kit, 1.0, 2.2) * ear;
    double middle = 0.46 + 0.75 * head;
    put_ellipsoid(kit, rd_v(0.0, -0.26, 0.0), rd_v(0.24, 0.27, 0.20), kit->paint);
    put_ellipsoid(kit, rd_v(0.0, -middle, 0.0), rd_v(head, 0.92 * head, 0.9 * head), kit->paint);
    put_ellipsoid(kit, rd_v(0.0, -middle + 0.25 * head, -0.8 * head), rd_v(0.45 * head, 0.36 * head, 0.4 * head),
                  kit->paint2);
    for (double side = -1.0; side <= 1.0; side += 2.0) {
        put_ellipsoid(kit, rd_v(0.75 * side * head, -middle - 0.7 * head - 0.6 * ear_high, 0.0),
                      rd_v(ear, ear_high, 0.4 * ear), kit->paint);
        put_limb(kit, rd_v(0.20 * side, -0.42, -0.02), rd_v(0.28 * side, -0.22, -0.16), 0.075, 0.07, kit->paint);
        put_limb(kit, rd_v(0.14 * side, -0.08, -0.08), rd_v(0.22 * side, -0.08, -0.32), 0.085, 0.075, kit->paint);
    }
    return middle + head + ear_high;
}

static double make_bucket(const struct kit *kit)
{
    double low = between(kit, 0.28, 0.36), high = between(kit, 0.36, 0.46), tall = between(kit, 0.7, 0.95);
    bool upside_down = rd_rng_chance(kit->rng, 0.25);
    put_tube(kit, 0.0, tall, upside_down ? high : low, upside_down ? low : high, kit->paint);
    put_disc(kit, upside_down ? tall : 0.02, low, kit->paint);
    if (!upside_down)
        put_handle(kit, rd_v(-high, -tall, 0.0), rd_v(-0.5 * high, -tall + 0.02, -0.8 * high),
                   rd_v(0.5 * high, -tall + 0.02, -0.8 * high), rd_v(high, -tall, 0.0), 0.012, kit->paint2);
    return tall;
}

static double make_pillow(const struct kit *kit)
{
    double high = between(kit, 0.34, 0.5), thick = between(kit, 0.12, 0.2), lean = between(kit, -0.5, 0.0);
    double roll = between(kit, -0.3, 0.3);
    struct rd_pose pose = {rd_rot_euler(0.0, lean, roll), sized(kit, 0.0, -0.95 * high, 0.0)};
    put(kit, rd_shape_ellipsoid(pose, sized(kit, 0.5, high, thick), kit->paint));
    put(kit, rd_shape_box(pose, sized(kit, 0.42, 0.84 * high, 0.4 * thick), 0.3 * thick * kit->size_mm, kit->paint));
    return 1.9 * high;
}

static double make_monitor(const struct kit *kit)
{
    double high = between(kit, 0.28, 0.34), foot = between(kit, 0.12, 0.3), lean = between(kit, -0.15, 0.05);
    put_disc(kit, 0.01, 0.2, kit->paint2);
    put_limb(kit, rd_v(0.0, 0.0, 0.05), rd_v(0.0, -foot - high, 0.05), 0.04, 0.04, kit->paint2);
    put_box(kit, rd_rot_euler(0.0, lean, 0.0), rd_v(0.0, -foot - high, 0.0), rd_v(0.5, high, 0.025), 0.01, kit->paint);
    return foot + 2.0 * high;
}

static double make_towels(const struct kit *kit)
{
    int count = 1 + rd_rng_pick(kit->rng, 3);
    bool upright = rd_rng_chance(kit->rng, 0.4);
    double radius = between(kit, 0.14, 0.24);
    for (int i = 0; i < count; i++) {
        double position = 1.95 * radius * (i - 0.5 * (count - 1)), half = between(kit, 0.35, 0.5);
        bool on_top = !upright && i == 2;
        struct rd_vec at = upright  ? rd_v(position, -half, 0.0)
                           : on_top ? rd_v(0.0, -2.7 * radius, 0.0)
                                    : rd_v(position, -radius, 0.0);
        struct rd_pose pose = {rd_rot_euler(0.0, upright ? 0.0 : 0.5 * RD_PI, 0.0), rd_scale(at, kit->size_mm)};
        put(kit,
            rd_shape_cylinder(pose, radius * kit->size_mm, half * kit->size_mm, i == 1 ? kit->paint2 : kit->paint));
    }
    return upright ? 0.85 : 2.0 * radius;
}

static double make_lamp(const struct kit *kit)
{
    double shade = between(kit, 0.18, 0.32), low = between(kit, 0.45, 0.6), narrow = between(kit, 0.45, 1.0);
    put_disc(kit, 0.01, 0.15, kit->paint2);
    put_limb(kit, rd_v(0.0, 0.0, 0.0), rd_v(0.0, -low, 0.0), 0.02, 0.02, kit->paint2);
    put_ellipsoid(kit, rd_v(0.0, -0.35 * low, 0.0), rd_v(0.10, 0.3 * low, 0.10), kit->paint2);
    if (rd_rng_chance(kit->rng, 0.3))
        put_ellipsoid(kit, rd_v(0.0, -low - 0.8 * shade, 0.0), rd_v(shade, shade, shade), kit->paint);
    else
        put_tube(kit, low, 1.0, shade, narrow * shade, kit->paint);
    return 1.0;
}

double rd_thing_put(struct rd_scene *scene, struct rd_rng *rng, const struct rd_pose *foot)
{
    static const struct {
        double (*make)(const struct kit *kit);
        double low_mm, high_mm;
    } kinds[] = {
        {make_ball, 100.0, 300.0},     {make_melon, 140.0, 320.0},   {make_pumpkin, 150.0, 350.0},
        {make_vase, 180.0, 400.0},     {make_teapot, 180.0, 300.0},  {make_kettle, 200.0, 320.0},
        {make_bowl, 120.0, 320.0},     {make_bottles, 180.0, 350.0}, {make_helmet, 240.0, 320.0},
        {make_backpack, 300.0, 400.0}, {make_boxes, 120.0, 350.0},   {make_plant, 220.0, 400.0},
        {make_animal, 180.0, 400.0},   {make_bucket, 200.0, 330.0},  {make_pillow, 300.0, 400.0},
        {make_monitor, 330.0, 400.0},  {make_towels, 200.0, 400.0},  {make_lamp, 280.0, 400.0},
    };
    int kind = rd_rng_pick(rng, (int)(sizeof kinds / sizeof kinds[0]));
    struct kit kit = {.scene = scene, .rng = rng};
    kit.size_mm = rd_rng_uniform(rng, kinds[kind].low_mm, kinds[kind].high_mm);
    kit.paint = rd_thing_paint(scene, rng);
    kit.paint2 = rd_thing_paint(scene, rng);
    int first = scene->shape_count;
    double high = kinds[kind].make(&kit);
    rd_scene_move(scene, first, foot);
    return high * kit.size_mm;
}
