#include "rd_room.h"
#include "rd_things.h"

/* Local frame: what is at the height of a head is at the origin; floor_mm below is the floor. */
struct tall {
    struct rd_scene *scene;
    struct rd_rng *rng;
    double floor_mm;
    int paint, paint2;
};

static double between(const struct tall *tall, double low, double high)
{
    return rd_rng_uniform(tall->rng, low, high);
}

static void put(const struct tall *tall, struct rd_shape shape)
{
    rd_scene_add(tall->scene, &shape);
}

static void put_box(const struct tall *tall, struct rd_rot turn, struct rd_vec at_mm, struct rd_vec half_mm,
                    double round_mm, int paint)
{
    struct rd_pose pose = {turn, at_mm};
    put(tall, rd_shape_box(pose, half_mm, round_mm, paint));
}

static void put_post(const struct tall *tall, double x_mm, double z_mm, double top_mm, double radius_mm, int paint)
{
    double half_mm = 0.5 * (tall->floor_mm - top_mm);
    if (half_mm > 0.0)
        put(tall, rd_shape_cylinder(rd_pose_at(rd_v(x_mm, top_mm + half_mm, z_mm)), radius_mm, half_mm, paint));
}

/* The seat itself, before a back whose upper edge is top_mm below the origin, and what carries it. */
static void put_seat(const struct tall *tall, double top_mm, double half_width_mm)
{
    double seat_mm = top_mm + between(tall, 450.0, 620.0);
    put_box(tall, rd_rot_none(), rd_v(0.0, seat_mm, -200.0), rd_v(half_width_mm, 55.0, 240.0), 50.0, tall->paint);
    put_post(tall, 0.0, -150.0, seat_mm, 45.0, tall->paint2);
}

static void put_back(const struct tall *tall, double top_mm, double half_width_mm, double half_height_mm,
                     double half_thick_mm)
{
    struct rd_rot lean = rd_rot_euler(0.0, -0.12, 0.0);
    put_box(tall, lean, rd_v(0.0, top_mm + half_height_mm, 15.0), rd_v(half_width_mm, half_height_mm, half_thick_mm),
            0.9 * half_thick_mm, tall->paint);
}

static void put_wings(const struct tall *tall, double half_width_mm, double half_height_mm, double deep_mm)
{
    for (double side = -1.0; side <= 1.0; side += 2.0)
        put_box(tall, rd_rot_euler(-0.5 * side, 0.0, 0.0), rd_v(side * half_width_mm, 0.0, -0.6 * deep_mm),
                rd_v(22.0, half_height_mm, deep_mm), 20.0, tall->paint);
}

static void make_seat(const struct tall *tall)
{
    double half_x = between(tall, 85.0, 160.0), half_y = between(tall, 50.0, 120.0), deep = between(tall, 35.0, 75.0);
    double top_mm = half_y + between(tall, 0.0, 80.0), width_mm = between(tall, 190.0, 270.0);
    int kind = rd_rng_pick(tall->rng, 4);
    struct rd_rot lean = rd_rot_euler(0.0, between(tall, -0.3, 0.1), 0.0);
    struct rd_pose backrest = {lean, rd_v(0.0, 0.0, 0.0)};
    if (kind == 0)
        put(tall, rd_shape_ellipsoid(backrest, rd_v(half_x, half_y, deep), tall->paint));
    else if (kind == 1)
        put(tall, rd_shape_ellipsoid(backrest, rd_v(0.8 * half_y + 40.0, half_y, deep), tall->paint2));
    else
        put_box(tall, lean, backrest.origin_mm, rd_v(half_x, half_y, kind == 2 ? 20.0 : deep), 0.8 * deep, tall->paint);
    if (kind == 3)
        put_wings(tall, half_x, 0.9 * half_y, 0.7 * half_y);
    for (double side = -1.0; side <= 1.0; side += 2.0)
        put(tall,
            rd_shape_cone(rd_v(45.0 * side, 0.0, 5.0), rd_v(45.0 * side, top_mm + 60.0, 15.0), 8.0, 8.0, tall->paint2));
    double half_height_mm = between(tall, 250.0, 330.0), half_thick_mm = between(tall, 30.0, 70.0);
    put_back(tall, top_mm, width_mm, half_height_mm, half_thick_mm);
    put_seat(tall, top_mm, width_mm);
}

static void make_armchair(const struct tall *tall)
{
    double width_mm = between(tall, 230.0, 330.0), over_mm = between(tall, 80.0, 200.0);
    put_back(tall, -over_mm, width_mm, 0.5 * over_mm + 330.0, 75.0);
    double wing_high_mm = between(tall, 120.0, 220.0), wing_deep_mm = between(tall, 70.0, 120.0);
    if (rd_rng_chance(tall->rng, 0.5))
        put_wings(tall, width_mm, wing_high_mm, wing_deep_mm);
    put_seat(tall, 60.0, width_mm);
    for (double side = -1.0; side <= 1.0; side += 2.0)
        put_box(tall, rd_rot_none(), rd_v(side * width_mm, 420.0, -200.0), rd_v(50.0, 60.0, 250.0), 45.0, tall->paint);
    int cushion_count = 1 + rd_rng_pick(tall->rng, 2);
    for (int i = 0; i < cushion_count; i++) {
        double x = between(tall, -80.0, 80.0), y = i == 0 ? between(tall, -60.0, 60.0) : between(tall, 250.0, 380.0);
        double yaw = between(tall, -0.2, 0.2), roll = between(tall, -0.8, 0.8);
        struct rd_pose pose = {rd_rot_euler(yaw, -0.15, roll), rd_v(x, y, -110.0)};
        double half_x = between(tall, 80.0, 200.0), half_y = between(tall, 70.0, 180.0);
        put(tall, rd_shape_ellipsoid(pose, rd_v(half_x, half_y, between(tall, 40.0, 85.0)), tall->paint2));
    }
}

/* Cloth that hangs from its collar at top_mm: sloping shoulders, a flat body, two empty sleeves. */
static void put_coat(const struct tall *tall, double top_mm, double half_width_mm, double long_mm)
{
    double drop_mm = between(tall, 30.0, 110.0), thick_mm = between(tall, 45.0, 90.0);
    struct rd_vec collar = rd_v(0.0, top_mm, 0.0);
    for (double side = -1.0; side <= 1.0; side += 2.0) {
        struct rd_vec shoulder = rd_v(side * half_width_mm, top_mm + drop_mm, 0.0);
        double swing = between(tall, -60.0, 60.0), reach_mm = between(tall, 0.65, 0.95) * long_mm;
        struct rd_vec cuff = rd_v(side * (half_width_mm + 35.0), top_mm + drop_mm + reach_mm, swing);
        put(tall, rd_shape_cone(collar, shoulder, 0.8 * thick_mm, 0.7 * thick_mm, tall->paint));
        put(tall, rd_shape_cone(shoulder, cuff, 0.7 * thick_mm, 0.55 * thick_mm, tall->paint));
    }
    put(tall, rd_shape_ellipsoid(rd_pose_at(rd_v(0.0, top_mm + 0.52 * long_mm, 0.0)),
                                 rd_v(0.95 * half_width_mm, 0.55 * long_mm, 1.1 * thick_mm), tall->paint));
}

/* What is where a head would be above a coat: nothing, its hood, a hat, or a round headrest. */
static void put_above_coat(const struct tall *tall)
{
    double half_mm = between(tall, 55.0, 110.0);
    int kind = rd_rng_pick(tall->rng, 4);
    struct rd_shape hat = rd_shape_ellipsoid(rd_pose_at(rd_v(0.0, 40.0, 0.0)), rd_v(95.0, 120.0, 105.0), tall->paint2);
    if (kind == 1) {
        put(tall,
            rd_shape_ellipsoid(rd_pose_at(rd_v(0.0, 60.0, 10.0)), rd_v(half_mm, half_mm, 0.6 * half_mm), tall->paint));
    } else if (kind == 2) {
        hat.clip_normal = rd_v(0.0, 1.0, 0.0);
        hat.clip_limit = -0.2;
        put(tall, hat);
        put(tall, rd_shape_cylinder(rd_pose_at(rd_v(0.0, 16.0, 0.0)), between(tall, 95.0, 160.0), 4.0, tall->paint2));
    } else if (kind == 3) {
        put(tall,
            rd_shape_ellipsoid(rd_pose_at(rd_v(0.0, 20.0, 20.0)), rd_v(1.2 * half_mm, half_mm, 50.0), tall->paint2));
    }
}

static void make_coat_on_chair(const struct tall *tall)
{
    double width_mm = between(tall, 150.0, 210.0), top_mm = between(tall, 90.0, 150.0);
    put_above_coat(tall);
    put_coat(tall, top_mm, width_mm, between(tall, 350.0, 550.0));
    put_back(tall, top_mm + 40.0, width_mm, 260.0, 22.0);
    put_seat(tall, top_mm, 1.1 * width_mm);
}

static void make_coat_on_stand(const struct tall *tall)
{
    double top_mm = between(tall, 60.0, 140.0), half_width_mm = between(tall, 70.0, 200.0);
    double long_mm = between(tall, 600.0, 950.0), post_mm = between(tall, -150.0, 40.0);
    put_above_coat(tall);
    put_coat(tall, top_mm, half_width_mm, long_mm);
    put_post(tall, 0.0, 50.0, post_mm, between(tall, 12.0, 25.0), tall->paint2);
}

static void make_lamp(const struct tall *tall)
{
    double radius_mm = between(tall, 60.0, 190.0), narrow = between(tall, 0.4, 1.0),
           half_mm = between(tall, 60.0, 150.0);
    put_post(tall, 0.0, 0.0, 0.0, between(tall, 8.0, 20.0), tall->paint2);
    if (rd_rng_chance(tall->rng, 0.4))
        put(tall, rd_shape_ball(rd_v(0.0, 0.0, 0.0), radius_mm, tall->paint));
    else
        put(tall,
            rd_shape_frustum(rd_pose_at(rd_v(0.0, 0.0, 0.0)), radius_mm, narrow * radius_mm, half_mm, tall->paint));
}

void rd_thing_put_tall(struct rd_scene *scene, struct rd_rng *rng, const struct rd_pose *top, double floor_mm)
{
    static void (*const kinds[])(const struct tall *) = {make_seat,          make_seat,          make_armchair,
                                                         make_coat_on_chair, make_coat_on_stand, make_lamp};
    int kind = rd_rng_pick(rng, (int)(sizeof kinds / sizeof kinds[0]));
    struct tall tall = {.scene = scene, .rng = rng, .floor_mm = floor_mm};
    tall.paint = rd_thing_paint(scene, rng);
    tall.paint2 = rd_thing_paint(scene, rng);
    int first = scene->shape_count;
    kinds[kind](&tall);
    rd_scene_move(scene, first, top);
}
