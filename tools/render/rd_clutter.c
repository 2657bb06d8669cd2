#include "rd_clutter.h"

#include "rd_room.h"
#include "rd_things.h"

#define THINGS_MAX 8
#define PLACE_DRAWS 20
#define NEAREST_MM 500.0
#define FARTHEST_MM 1500.0
/* Seats reach half a metre towards the camera. */
#define NEAREST_TALL_MM 750.0
/* A table's front edge keeps away from the camera. */
#define EDGE_MM 350.0

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

static void put(const struct clutter *c, struct rd_shape shape)
{
    rd_scene_add(c->scene, &shape);
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
        put(c, rd_shape_cylinder(rd_pose_at(rd_along(foot, down, half_mm)), radius_mm, half_mm, paint));
        put(c, rd_shape_cylinder(rd_pose_at(rd_along(foot, down, 6.0)), radius_mm + between(c, 0.0, 90.0), 6.0, paint));
    } else if (kind == 1) {
        double half_x = between(c, 90.0, 200.0), half_z = between(c, 90.0, 150.0);
        put(c, rd_shape_box(rd_pose_at(rd_along(foot, down, half_mm)), rd_v(half_x, half_mm, half_z), 8.0, paint));
    } else {
        double half_x = between(c, 250.0, 700.0), back_mm = between(c, 120.0, 500.0),
               front_mm = between(c, 120.0, 350.0);
        double thick_mm = between(c, 8.0, 25.0);
        front_mm = fmin(front_mm, fmax(foot.z - EDGE_MM, 60.0));
        struct rd_vec middle = rd_add(foot, rd_v(between(c, -150.0, 150.0), thick_mm, 0.5 * (back_mm - front_mm)));
        put(c, rd_shape_box(rd_pose_at(middle), rd_v(half_x, thick_mm, 0.5 * (back_mm + front_mm)), 4.0, paint));
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
        put(c, rd_shape_wall(pose, 4000.0, 4000.0, floor_paint));
    }
    if (rd_rng_chance(c->rng, 0.65)) {
        int paint = rd_room_paint(c->scene, c->rng, 0.2, 0.75);
        struct rd_pose pose = {rd_rot_euler(yaw, 0.0, 0.0), rd_v(0.0, 0.0, behind_mm)};
        put(c, rd_shape_wall(pose, 4000.0, 3000.0, paint));
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
