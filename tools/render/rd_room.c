#include "rd_room.h"

#include "rd_furniture.h"

int rd_room_paint(struct rd_scene *scene, struct rd_rng *rng, double low, double high)
{
    static const enum rd_pattern patterns[] = {RD_PLAIN, RD_PLAIN, RD_MOTTLE, RD_MOTTLE, RD_TILES, RD_STRIPES};
    struct rd_material m = {.pattern = patterns[rd_rng_pick(rng, 6)]};
    m.albedo = rd_rng_uniform(rng, low, high);
    m.albedo2 = rd_rng_uniform(rng, low, high);
    if (m.pattern == RD_TILES)
        m.albedo2 = 0.5 * m.albedo;
    m.period_mm = rd_rng_uniform(rng, 60.0, 260.0);
    m.grain = rd_rng_uniform(rng, 0.03, 0.25);
    m.grain_mm = rd_rng_uniform(rng, 6.0, 40.0);
    m.gloss = rd_rng_chance(rng, 0.25) ? rd_rng_uniform(rng, 0.1, 0.5) : 0.0;
    m.seed = rd_rng_next(rng);
    return rd_scene_paint(scene, &m);
}

static void add_wall(struct rd_scene *scene, struct rd_rng *rng, double distance_mm)
{
    double yaw = rd_rng_uniform(rng, -0.28, 0.28);
    double pitch = rd_rng_uniform(rng, -0.06, 0.06);
    double roll = rd_rng_uniform(rng, -0.1, 0.1);
    int paint = rd_room_paint(scene, rng, 0.25, 0.75);
    struct rd_pose pose = {rd_rot_euler(yaw, pitch, roll), rd_v(0.0, 0.0, distance_mm)};
    struct rd_shape wall = rd_shape_wall(pose, 4000.0, 3000.0, paint);
    rd_scene_add(scene, &wall);
}

/* A wall that runs past the seat on one side, as a car's door or a partition does. */
static void add_side_wall(struct rd_scene *scene, struct rd_rng *rng)
{
    double side = rd_rng_sign(rng);
    double yaw = rd_rng_uniform(rng, 1.15, 1.45);
    double aside = rd_rng_uniform(rng, 380.0, 750.0);
    int paint = rd_room_paint(scene, rng, 0.15, 0.6);
    struct rd_pose pose = {rd_rot_euler(side * yaw, 0.0, 0.0), rd_v(side * aside, 0.0, 1600.0)};
    struct rd_shape wall = rd_shape_wall(pose, 900.0, 2000.0, paint);
    rd_scene_add(scene, &wall);
}

static void add_thing(struct rd_scene *scene, struct rd_rng *rng, double nearest_mm, double farthest_mm)
{
    double z = rd_rng_uniform(rng, nearest_mm, farthest_mm);
    double aside = rd_rng_uniform(rng, 0.10, 0.42);
    double up = rd_rng_uniform(rng, -0.3, 0.3);
    struct rd_vec at = rd_v(rd_rng_sign(rng) * aside * z, up * z, z);
    rd_furniture_thing(scene, rng, at);
}

void rd_room_build(struct rd_scene *scene, struct rd_rng *rng, enum rd_background kind, double nearest_mm)
{
    double distance_mm =
        kind == RD_BACK_NEAR ? rd_rng_uniform(rng, 350.0, 800.0) + nearest_mm : rd_rng_uniform(rng, 1900.0, 2600.0);
    int thing_count = kind == RD_BACK_NONE ? rd_rng_pick(rng, 3) : rd_rng_pick(rng, 5);
    if (kind != RD_BACK_NONE)
        add_wall(scene, rng, distance_mm);
    if (rd_rng_chance(rng, kind == RD_BACK_NONE ? 0.1 : 0.25))
        add_side_wall(scene, rng);
    for (int i = 0; i < thing_count; i++)
        add_thing(scene, rng, nearest_mm + 100.0, distance_mm);
    if (kind == RD_BACK_FAR && rd_rng_chance(rng, 0.4))
        rd_furniture_shelf(scene, rng, rd_v(rd_rng_sign(rng) * 450.0, 0.0, distance_mm - 300.0));
}

void rd_seat_build(struct rd_scene *scene, struct rd_rng *rng, struct rd_vec head_mm)
{
    int cover = rd_room_paint(scene, rng, 0.05, 0.4);
    int metal = rd_room_paint(scene, rng, 0.2, 0.5);
    double gap_mm = rd_rng_uniform(rng, 40.0, 110.0);
    double tilt = rd_rng_uniform(rng, 0.08, 0.32);
    double headrest_y_mm = rd_rng_uniform(rng, -45.0, 25.0);
    double headrest_half_x_mm = rd_rng_uniform(rng, 95.0, 150.0);
    double headrest_half_y_mm = rd_rng_uniform(rng, 60.0, 105.0);
    double back_half_mm = rd_rng_uniform(rng, 200.0, 270.0);
    double back_top_mm = rd_rng_uniform(rng, 150.0, 200.0);
    bool headrest = rd_rng_chance(rng, 0.85);
    bool bolsters = rd_rng_chance(rng, 0.5);
    /* Leaning back as seats do; the frame's origin is the headrest's middle. */
    struct rd_pose seat = {rd_rot_euler(0.0, -tilt, 0.0),
                           rd_add(head_mm, rd_v(rd_rng_uniform(rng, -25.0, 25.0), headrest_y_mm, 145.0 + gap_mm))};
    int first = scene->shape_count;
    if (headrest) {
        struct rd_shape cushion = rd_shape_box(rd_pose_at(rd_v(0.0, 0.0, 0.0)),
                                               rd_v(headrest_half_x_mm, headrest_half_y_mm, 48.0), 40.0, cover);
        rd_scene_add(scene, &cushion);
        for (double side = -1.0; side <= 1.0; side += 2.0) {
            struct rd_shape post = rd_shape_cylinder(rd_pose_at(rd_v(side * 55.0, 140.0, 5.0)), 7.0, 110.0, metal);
            rd_scene_add(scene, &post);
        }
    }
    struct rd_shape back =
        rd_shape_box(rd_pose_at(rd_v(0.0, back_top_mm + 330.0, 15.0)), rd_v(back_half_mm, 330.0, 60.0), 55.0, cover);
    rd_scene_add(scene, &back);
    for (double side = -1.0; bolsters && side <= 1.0; side += 2.0) {
        struct rd_shape bolster =
            rd_shape_cone(rd_v(side * (back_half_mm - 40.0), back_top_mm + 90.0, -35.0),
                          rd_v(side * back_half_mm, back_top_mm + 650.0, -60.0), 48.0, 60.0, cover);
        rd_scene_add(scene, &bolster);
    }
    rd_scene_move(scene, first, &seat);
}

void rd_chair_make(struct rd_chair *chair, struct rd_scene *scene, struct rd_rng *rng)
{
    chair->headrest = rd_rng_chance(rng, 0.12);
    chair->back_half_width_mm = rd_rng_uniform(rng, 190.0, 250.0);
    chair->back_half_height_mm = rd_rng_uniform(rng, 190.0, 280.0);
    chair->back_behind_mm = rd_rng_uniform(rng, 140.0, 185.0);
    chair->back_above_mm = rd_rng_uniform(rng, 90.0, 210.0);
    chair->cover = rd_room_paint(scene, rng, 0.05, 0.4);
    chair->metal = rd_room_paint(scene, rng, 0.1, 0.5);
}

void rd_chair_build(const struct rd_chair *chair, struct rd_scene *scene, struct rd_vec hips_mm, double turn,
                    double torso_mm)
{
    struct rd_pose pose = {rd_rot_euler(turn, 0.0, 0.0), hips_mm};
    int first = scene->shape_count;
    struct rd_pose behind = {rd_rot_euler(0.0, -0.12, 0.0), rd_v(0.0, -chair->back_above_mm, chair->back_behind_mm)};
    struct rd_shape back =
        rd_shape_box(behind, rd_v(chair->back_half_width_mm, chair->back_half_height_mm, 30.0), 28.0, chair->cover);
    struct rd_shape post =
        rd_shape_cylinder(rd_pose_at(rd_v(0.0, 60.0, chair->back_behind_mm + 40.0)), 25.0, 300.0, chair->metal);
    struct rd_shape seat =
        rd_shape_box(rd_pose_at(rd_v(0.0, 130.0, -60.0)), rd_v(240.0, 40.0, 240.0), 35.0, chair->cover);
    rd_scene_add(scene, &back);
    rd_scene_add(scene, &post);
    rd_scene_add(scene, &seat);
    if (chair->headrest) {
        struct rd_pose above = rd_pose_at(rd_v(0.0, -torso_mm - 130.0, chair->back_behind_mm + 60.0));
        struct rd_shape headrest = rd_shape_box(above, rd_v(125.0, 75.0, 32.0), 30.0, chair->cover);
        struct rd_shape bar = rd_shape_cylinder(rd_pose_at(rd_v(0.0, -torso_mm + 40.0, chair->back_behind_mm + 65.0)),
                                                16.0, 160.0, chair->metal);
        rd_scene_add(scene, &headrest);
        rd_scene_add(scene, &bar);
    }
    rd_scene_move(scene, first, &pose);
}
