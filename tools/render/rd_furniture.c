#include "rd_furniture.h"

#include "rd_room.h"
#include "rd_things.h"

#define SHELF_BOARDS 4
#define BOOKS_PER_BOARD 6
#define LEAVES 22
/* Of clutter. */
#define THINGS_MAX 8
#define PLACE_DRAWS 20
#define NEAREST_MM 500.0
#define FARTHEST_MM 1500.0
/* Seats reach half a metre towards the camera. */
#define NEAREST_TALL_MM 750.0
/* A table's front edge keeps away from the camera. */
#define EDGE_MM 350.0

static void put(struct rd_scene *scene, struct rd_shape shape)
{
    rd_scene_add(scene, &shape);
}

static struct rd_rot upright_turn(struct rd_rng *rng)
{
    return rd_rot_euler(rd_rng_uniform(rng, -RD_PI, RD_PI), 0.0, 0.0);
}

static struct rd_vec draw_vec(struct rd_rng *rng, double low, double high)
{
    struct rd_vec v;
    v.x = rd_rng_uniform(rng, low, high);
    v.y = rd_rng_uniform(rng, low, high);
    v.z = rd_rng_uniform(rng, low, high);
    return v;
}

void rd_furniture_thing(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec at_mm)
{
    int paint = rd_room_paint(scene, rng, 0.1, 0.7);
    struct rd_vec angles = draw_vec(rng, -0.6, 0.6);
    struct rd_pose pose = {rd_rot_euler(angles.x, 0.3 * angles.y, 0.5 * angles.z), at_mm};
    struct rd_vec half_mm = draw_vec(rng, 50.0, 200.0);
    switch (rd_rng_pick(rng, 4)) {
    case 0:
        put(scene, rd_shape_box(pose, half_mm, 8.0, paint));
        break;
    case 1:
        half_mm.z = 15.0;
        put(scene, rd_shape_box(pose, half_mm, 4.0, paint));
        break;
    case 2:
        put(scene, rd_shape_ball(at_mm, 0.7 * half_mm.x, paint));
        break;
    default:
        put(scene, rd_shape_cylinder(pose, 0.25 * half_mm.x, 3.0 * half_mm.y, paint));
        break;
    }
}

void rd_furniture_shelf(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec at_mm)
{
    int wood = rd_room_paint(scene, rng, 0.25, 0.6);
    int books[3];
    for (int i = 0; i < 3; i++)
        books[i] = rd_room_paint(scene, rng, 0.06, 0.7);
    for (int board = 0; board < SHELF_BOARDS; board++) {
        double y = at_mm.y - 450.0 + 320.0 * board, x = at_mm.x - 360.0;
        put(scene, rd_shape_box(rd_pose_at(rd_v(at_mm.x, y, at_mm.z + 140.0)), rd_v(400.0, 11.0, 140.0), 2.0, wood));
        for (int book = 0; book < BOOKS_PER_BOARD; book++) {
            double thick_mm = rd_rng_uniform(rng, 12.0, 55.0), tall_mm = rd_rng_uniform(rng, 80.0, 140.0);
            double back_mm = rd_rng_uniform(rng, 90.0, 180.0);
            int paint = books[rd_rng_pick(rng, 3)];
            x += thick_mm;
            put(scene, rd_shape_box(rd_pose_at(rd_v(x, y - 11.0 - tall_mm, at_mm.z + back_mm)),
                                    rd_v(thick_mm, tall_mm, 80.0), 3.0, paint));
            x += thick_mm + rd_rng_uniform(rng, 0.0, 90.0);
        }
    }
    for (double side = -1.0; side <= 1.0; side += 2.0)
        put(scene, rd_shape_box(rd_pose_at(rd_v(at_mm.x + side * 400.0, at_mm.y + 30.0, at_mm.z + 140.0)),
                                rd_v(11.0, 520.0, 140.0), 2.0, wood));
}

/* The lower half of an ellipsoid; its foot stands at `foot_mm`. */
static void put_bowl(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec foot_mm, int paint)
{
    double radius_mm = rd_rng_uniform(rng, 60.0, 140.0);
    double deep_mm = radius_mm * rd_rng_uniform(rng, 0.45, 0.9);
    bool upside_down = rd_rng_chance(rng, 0.3);
    struct rd_vec middle = rd_along(foot_mm, rd_v(0.0, -1.0, 0.0), upside_down ? 0.0 : deep_mm);
    struct rd_shape bowl = rd_shape_ellipsoid(rd_pose_at(middle), rd_v(radius_mm, deep_mm, radius_mm), paint);
    bowl.clip_normal = rd_v(0.0, upside_down ? 1.0 : -1.0, 0.0);
    bowl.clip_limit = 0.0;
    put(scene, bowl);
}

static void put_bottle(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec foot_mm, int paint)
{
    double radius_mm = rd_rng_uniform(rng, 28.0, 55.0), half_mm = rd_rng_uniform(rng, 60.0, 120.0);
    struct rd_vec top = rd_along(foot_mm, rd_v(0.0, -1.0, 0.0), 2.0 * half_mm);
    struct rd_vec neck = rd_along(top, rd_v(0.0, -1.0, 0.0), 2.2 * radius_mm);
    struct rd_vec middle = rd_along(foot_mm, rd_v(0.0, -1.0, 0.0), half_mm);
    put(scene, rd_shape_cylinder(rd_pose_at(middle), radius_mm, half_mm, paint));
    put(scene, rd_shape_cone(top, neck, 0.95 * radius_mm, 0.35 * radius_mm, paint));
}

static void put_plant(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec foot_mm, double size)
{
    int clay = rd_room_paint(scene, rng, 0.2, 0.5), green = rd_room_paint(scene, rng, 0.15, 0.4);
    double high_mm = size * rd_rng_uniform(rng, 150.0, 260.0);
    struct rd_vec crown = rd_along(foot_mm, rd_v(0.0, -1.0, 0.0), size * 150.0 + high_mm);
    put(scene, rd_shape_cylinder(rd_pose_at(rd_along(foot_mm, rd_v(0.0, -1.0, 0.0), 75.0 * size)), 80.0 * size,
                                 75.0 * size, clay));
    put(scene, rd_shape_cone(foot_mm, crown, 12.0 * size, 7.0 * size, green));
    for (int i = 0; i < LEAVES; i++) {
        struct rd_vec offset = draw_vec(rng, -1.0, 1.0);
        struct rd_vec hint = draw_vec(rng, -1.0, 1.0);
        double away_mm = size * rd_rng_uniform(rng, 40.0, 150.0);
        struct rd_vec y = rd_unit(offset);
        struct rd_pose pose = {rd_rot_frame(y, hint), rd_along(crown, y, away_mm)};
        put(scene, rd_shape_ellipsoid(pose, rd_v(24.0 * size, 65.0 * size, 3.0), green));
    }
}

static void put_on_table(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec foot_mm)
{
    struct rd_vec up = rd_v(0.0, -1.0, 0.0);
    struct rd_vec half_mm = draw_vec(rng, 30.0, 110.0);
    struct rd_rot turn = upright_turn(rng);
    int kind = rd_rng_pick(rng, 8);
    if (kind == 7) {
        put_plant(scene, rng, foot_mm, rd_rng_uniform(rng, 0.5, 0.9));
        return;
    }
    int paint = rd_room_paint(scene, rng, 0.1, 0.75);
    struct rd_pose middle = {turn, rd_along(foot_mm, up, half_mm.y)};
    if (kind <= 1)
        put_bowl(scene, rng, foot_mm, paint);
    else if (kind == 2)
        put_bottle(scene, rng, foot_mm, paint);
    else if (kind == 3)
        put(scene, rd_shape_box(middle, half_mm, 5.0, paint));
    else if (kind == 4)
        put(scene, rd_shape_ball(middle.origin_mm, half_mm.y, paint));
    else if (kind == 5)
        put(scene, rd_shape_ellipsoid(middle, half_mm, paint));
    else
        put(scene, rd_shape_cylinder(middle, 0.6 * half_mm.x, half_mm.y, paint));
}

void rd_furniture_table(struct rd_scene *scene, struct rd_rng *rng)
{
    double look_down = rd_rng_uniform(rng, 0.30, 0.95);
    double distance_mm = rd_rng_uniform(rng, 750.0, 1250.0);
    double top_y_mm = distance_mm * sin(look_down), middle_z_mm = distance_mm * cos(look_down);
    double turn = rd_rng_uniform(rng, -0.7, 0.7);
    int count = 3 + rd_rng_pick(rng, 8);
    int first = scene->shape_count;
    int floor_paint = rd_room_paint(scene, rng, 0.15, 0.6), wood = rd_room_paint(scene, rng, 0.2, 0.7);
    struct rd_pose floor_pose = {rd_rot_euler(0.0, -0.5 * RD_PI, 0.0), rd_v(0.0, top_y_mm + 720.0, 1500.0)};
    put(scene, rd_shape_wall(floor_pose, 4000.0, 4000.0, floor_paint));
    if (rd_rng_chance(rng, 0.6)) {
        double behind_mm = rd_rng_uniform(rng, 500.0, 2500.0);
        int wall_paint = rd_room_paint(scene, rng, 0.2, 0.7);
        put(scene, rd_shape_wall(rd_pose_at(rd_v(0.0, 0.0, middle_z_mm + behind_mm)), 4000.0, 3000.0, wall_paint));
    }
    struct rd_pose top = {rd_rot_euler(turn, 0.0, 0.0), rd_v(0.0, top_y_mm + 15.0, middle_z_mm)};
    put(scene, rd_shape_box(top, rd_v(600.0, 15.0, 420.0), 4.0, wood));
    for (int i = 0; i < count; i++) {
        double x = rd_rng_uniform(rng, -300.0, 300.0), z = rd_rng_uniform(rng, -280.0, 280.0);
        put_on_table(scene, rng, rd_v(x, top_y_mm, middle_z_mm + z));
    }
    struct rd_pose camera = {rd_rot_euler(0.0, look_down, 0.0), rd_v(0.0, 0.0, 0.0)};
    rd_scene_move(scene, first, &camera);
}

static void put_chair(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec foot_mm)
{
    int wood = rd_room_paint(scene, rng, 0.1, 0.6);
    struct rd_pose pose = {upright_turn(rng), foot_mm};
    bool slats = rd_rng_chance(rng, 0.5);
    int first = scene->shape_count;
    put(scene, rd_shape_box(rd_pose_at(rd_v(0.0, -450.0, 0.0)), rd_v(215.0, 22.0, 210.0), 15.0, wood));
    if (!slats)
        put(scene, rd_shape_box(rd_pose_at(rd_v(0.0, -740.0, 215.0)), rd_v(205.0, 180.0, 18.0), 15.0, wood));
    for (int i = 0; slats && i < 3; i++)
        put(scene, rd_shape_box(rd_pose_at(rd_v(0.0, -590.0 - 130.0 * i, 215.0)), rd_v(200.0, 32.0, 12.0), 8.0, wood));
    for (int i = 0; i < 4; i++) {
        double x = i % 2 == 0 ? -195.0 : 195.0, z = i / 2 == 0 ? -190.0 : 215.0;
        double top_mm = z > 0.0 ? 920.0 : 450.0;
        put(scene, rd_shape_cylinder(rd_pose_at(rd_v(x, -0.5 * top_mm, z)), 17.0, 0.5 * top_mm, wood));
    }
    rd_scene_move(scene, first, &pose);
}

static void put_lamp(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec foot_mm)
{
    int metal = rd_room_paint(scene, rng, 0.1, 0.5), shade = rd_room_paint(scene, rng, 0.4, 0.8);
    double high_mm = rd_rng_uniform(rng, 800.0, 1300.0), radius_mm = rd_rng_uniform(rng, 80.0, 170.0);
    put(scene, rd_shape_cylinder(rd_pose_at(rd_along(foot_mm, rd_v(0.0, -1.0, 0.0), 0.5 * high_mm)), 13.0,
                                 0.5 * high_mm, metal));
    struct rd_vec top = rd_along(foot_mm, rd_v(0.0, -1.0, 0.0), high_mm);
    if (rd_rng_chance(rng, 0.5))
        put(scene, rd_shape_ball(top, radius_mm, shade));
    else
        put(scene, rd_shape_cylinder(rd_pose_at(top), radius_mm, 0.9 * radius_mm, shade));
}

static void put_sofa(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec foot_mm)
{
    int cover = rd_room_paint(scene, rng, 0.1, 0.6), cushion = rd_room_paint(scene, rng, 0.2, 0.7);
    struct rd_pose pose = {rd_rot_euler(rd_rng_uniform(rng, -0.6, 0.6), 0.0, 0.0), foot_mm};
    int first = scene->shape_count;
    put(scene, rd_shape_box(rd_pose_at(rd_v(0.0, -210.0, 0.0)), rd_v(600.0, 210.0, 380.0), 50.0, cover));
    put(scene, rd_shape_box(rd_pose_at(rd_v(0.0, -600.0, 300.0)), rd_v(600.0, 260.0, 110.0), 70.0, cover));
    for (int i = 0; i < 2; i++) {
        double x = rd_rng_uniform(rng, -400.0, 400.0);
        struct rd_pose leaning = {rd_rot_euler(0.0, -0.35, rd_rng_uniform(rng, -0.6, 0.6)), rd_v(x, -590.0, 150.0)};
        put(scene, rd_shape_ellipsoid(leaning, rd_v(200.0, 190.0, 75.0), cushion));
    }
    rd_scene_move(scene, first, &pose);
}

static void put_in_room(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec foot_mm)
{
    switch (rd_rng_pick(rng, 6)) {
    case 0:
    case 1:
        put_chair(scene, rng, foot_mm);
        break;
    case 2:
        put_plant(scene, rng, foot_mm, rd_rng_uniform(rng, 0.9, 2.6));
        break;
    case 3:
        put_lamp(scene, rng, foot_mm);
        break;
    case 4:
        put_sofa(scene, rng, foot_mm);
        break;
    default:
        rd_furniture_shelf(scene, rng, rd_along(foot_mm, rd_v(0.0, -1.0, 0.0), 900.0));
        break;
    }
}

void rd_furniture_room(struct rd_scene *scene, struct rd_rng *rng)
{
    double floor_y_mm = rd_rng_uniform(rng, 550.0, 1150.0), wall_z_mm = rd_rng_uniform(rng, 1700.0, 4800.0);
    double pitch = rd_rng_uniform(rng, -0.05, 0.35);
    double wall_yaw = rd_rng_uniform(rng, -0.5, 0.5);
    int count = 2 + rd_rng_pick(rng, 4), thing_count = rd_rng_pick(rng, 4);
    int first = scene->shape_count;
    int floor_paint = rd_room_paint(scene, rng, 0.15, 0.6), wall_paint = rd_room_paint(scene, rng, 0.25, 0.75);
    struct rd_pose floor_pose = {rd_rot_euler(0.0, -0.5 * RD_PI, 0.0), rd_v(0.0, floor_y_mm, 2500.0)};
    struct rd_pose wall_pose = {rd_rot_euler(wall_yaw, 0.0, 0.0), rd_v(0.0, 0.0, wall_z_mm)};
    put(scene, rd_shape_wall(floor_pose, 5000.0, 5000.0, floor_paint));
    put(scene, rd_shape_wall(wall_pose, 5000.0, 3000.0, wall_paint));
    for (int i = 0; i < count; i++) {
        double z = rd_rng_uniform(rng, 950.0, fmin(2800.0, wall_z_mm)), x = rd_rng_uniform(rng, -0.4, 0.4) * z;
        put_in_room(scene, rng, rd_v(x, floor_y_mm, z));
    }
    for (int i = 0; i < thing_count; i++) {
        double z = rd_rng_uniform(rng, 800.0, 2200.0), x = rd_rng_uniform(rng, -0.35, 0.35) * z;
        rd_furniture_thing(scene, rng, rd_v(x, rd_rng_uniform(rng, -0.3, 0.3) * z, z));
    }
    struct rd_pose camera = {rd_rot_euler(0.0, pitch, 0.0), rd_v(0.0, 0.0, 0.0)};
    rd_scene_move(scene, first, &camera);
}

struct clutter {
    struct rd_scene *scene;
    struct rd_rng *rng;
    struct rd_rot camera; /* turns the room's vectors into the camera's frame */
    double floor_mm;      /* below the camera */
    struct rd_vec positions_mm[THINGS_MAX];
    int count;
};

static double between(const struct clutter *c, double low, double high)
{
    return rd_rng_uniform(c->rng, low, high);
}

/* In the room's frame: somewhere in the pattern, not in the middle of what is there, if that can be found. */
static struct rd_vec draw_place(const struct clutter *c, double nearest_mm)
{
    struct rd_vec position = {0.0, 0.0, FARTHEST_MM};
    for (int draw = 0; draw < PLACE_DRAWS; draw++) {
        double z = between(c, nearest_mm, FARTHEST_MM), x = between(c, -0.24, 0.24), y = between(c, -0.22, 0.20);
        bool is_free = true;
        position = rd_turn_back(&c->camera, rd_v(x * z, y * z, z));
        for (int i = 0; i < c->count; i++)
            is_free = is_free && rd_length(rd_sub(position, c->positions_mm[i])) > 280.0;
        if (is_free && position.y < c->floor_mm - 200.0)
            break;
    }
    return position;
}

/* A top of a table, a board, a stool or a post under a thing's foot. */
static void put_support(const struct clutter *c, struct rd_vec foot)
{
    int paint = rd_thing_paint(c->scene, c->rng);
    int kind = rd_rng_pick(c->rng, 4);
    double half_mm = 0.5 * (c->floor_mm - foot.y);
    struct rd_vec down = rd_v(0.0, 1.0, 0.0);
    if (kind == 0 || half_mm < 60.0) {
        double radius_mm = between(c, 10.0, 45.0);
        put(c->scene, rd_shape_cylinder(rd_pose_at(rd_along(foot, down, half_mm)), radius_mm, half_mm, paint));
        put(c->scene,
            rd_shape_cylinder(rd_pose_at(rd_along(foot, down, 6.0)), radius_mm + between(c, 0.0, 90.0), 6.0, paint));
    } else if (kind == 1) {
        double half_x = between(c, 90.0, 200.0), half_z = between(c, 90.0, 150.0);
        put(c->scene,
            rd_shape_box(rd_pose_at(rd_along(foot, down, half_mm)), rd_v(half_x, half_mm, half_z), 8.0, paint));
    } else {
        double half_x = between(c, 250.0, 700.0), back_mm = between(c, 120.0, 500.0),
               front_mm = between(c, 120.0, 350.0);
        double thick_mm = between(c, 8.0, 25.0);
        front_mm = fmin(front_mm, fmax(foot.z - EDGE_MM, 60.0));
        struct rd_vec middle = rd_add(foot, rd_v(between(c, -150.0, 150.0), thick_mm, 0.5 * (back_mm - front_mm)));
        put(c->scene, rd_shape_box(rd_pose_at(middle), rd_v(half_x, thick_mm, 0.5 * (back_mm + front_mm)), 4.0, paint));
    }
}

static void add_thing(struct clutter *c)
{
    struct rd_vec position = draw_place(c, NEAREST_MM);
    struct rd_pose foot = {rd_rot_euler(between(c, -RD_PI, RD_PI), 0.0, 0.0), position};
    int first = c->scene->shape_count;
    double high_mm = rd_thing_put(c->scene, c->rng, &foot);
    /* Its middle belongs at the position, its foot on what carries it. */
    struct rd_pose lower = rd_pose_at(rd_v(0.0, fmin(0.5 * high_mm, c->floor_mm - position.y), 0.0));
    rd_scene_move(c->scene, first, &lower);
    put_support(c, rd_add(position, lower.origin_mm));
    c->positions_mm[c->count++] = position;
}

static void add_tall(struct clutter *c)
{
    struct rd_vec position = draw_place(c, NEAREST_TALL_MM);
    bool from_behind = rd_rng_chance(c->rng, 0.15);
    double turn = between(c, -0.7, 0.7);
    struct rd_pose top = {rd_rot_euler(from_behind ? turn + RD_PI : turn, 0.0, 0.0), position};
    rd_thing_put_tall(c->scene, c->rng, &top, c->floor_mm - position.y);
    c->positions_mm[c->count++] = position;
}

static void add_walls(const struct clutter *c)
{
    int floor_paint = rd_room_paint(c->scene, c->rng, 0.15, 0.6);
    double behind_mm = between(c, 1200.0, 2800.0), yaw = between(c, -0.4, 0.4);
    if (rd_rng_chance(c->rng, 0.7)) {
        struct rd_pose pose = {rd_rot_euler(0.0, -0.5 * RD_PI, 0.0), rd_v(0.0, c->floor_mm, 1500.0)};
        put(c->scene, rd_shape_wall(pose, 4000.0, 4000.0, floor_paint));
    }
    if (rd_rng_chance(c->rng, 0.65)) {
        int paint = rd_room_paint(c->scene, c->rng, 0.2, 0.75);
        struct rd_pose pose = {rd_rot_euler(yaw, 0.0, 0.0), rd_v(0.0, 0.0, behind_mm)};
        put(c->scene, rd_shape_wall(pose, 4000.0, 3000.0, paint));
    }
}

void rd_clutter_build(struct rd_scene *scene, struct rd_rng *rng)
{
    struct clutter c = {.scene = scene, .rng = rng};
    bool level = rd_rng_chance(rng, 0.5);
    double look_down = between(&c, 0.0, 40.0) * RD_RAD_PER_DEG;
    int count = 2 + rd_rng_pick(rng, THINGS_MAX - 1);
    int first = scene->shape_count;
    c.camera = rd_rot_euler(0.0, level ? 0.0 : look_down, 0.0);
    c.floor_mm = between(&c, 800.0, 1500.0);
    add_walls(&c);
    for (int i = 0; i < count; i++) {
        if (rd_rng_chance(rng, 0.3))
            add_tall(&c);
        else
            add_thing(&c);
    }
    struct rd_pose camera = {c.camera, rd_v(0.0, 0.0, 0.0)};
    rd_scene_move(scene, first, &camera);
}
