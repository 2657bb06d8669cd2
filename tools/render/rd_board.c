#include "rd_board.h"

#include <stddef.h>

#include "rd_rng.h"
#include "rd_room.h"

#define NEAR_MM 400.0
#define FAR_MM 1500.0
#define TILT_MAX_DEG 45.0
#define ROLL_MAX_DEG 25.0
#define WALL_MM 1750.0
/* Fractions of one cycle that no whole number of pictures repeats: the poses spread evenly. */
#define GOLDEN 0.61803398874989484820
#define PLASTIC 0.75487766624669276005
/* The middle of the board is aimed at points within this fraction of the frame's half sides. */
#define AIM_PART 0.75
#define DRAWS_MAX 100
#define SAMPLES_SIDE 7
#define GLARE_GREY 420.0
/* Paper is to be well lit, but not white. */
#define SKY_GREY 170.0
#define KEY_GREY 40.0

bool rd_board_make(struct rd_board *board, const struct rd_options *options)
{
    board->bitmap = rd_bitmap_load(options->board_file);
    if (board->bitmap == NULL)
        return false;
    board->half_width_mm = 0.5 * options->board_mm;
    board->half_height_mm = board->half_width_mm * board->bitmap->height / board->bitmap->width;
    return true;
}

void rd_board_end(struct rd_board *board)
{
    rd_bitmap_free(board->bitmap);
}

void rd_board_light(const struct rd_options *options, struct rd_light *light)
{
    light->sky_grey = SKY_GREY * options->exposure;
    light->key_grey = KEY_GREY * options->exposure;
    light->lamp_grey = 0.0;
    light->bars = false;
}

static double cycle(double value)
{
    return value - floor(value);
}

/* Fraction of the sheet that the frame shows. */
static double fraction_seen(const struct rd_board *board, const struct rd_rig *rig, const struct rd_pose *pose)
{
    int seen = 0;
    for (int i = 0; i < SAMPLES_SIDE * SAMPLES_SIDE; i++) {
        double x = 2.0 * (i % SAMPLES_SIDE) / (SAMPLES_SIDE - 1.0) - 1.0;
        double y = 2.0 * (i / SAMPLES_SIDE) / (SAMPLES_SIDE - 1.0) - 1.0, u, v;
        struct rd_vec point = rd_pose_out(pose, rd_v(x * board->half_width_mm, y * board->half_height_mm, 0.0));
        seen +=
            rd_rig_project(rig, point, &u, &v) && u > 0.0 && v > 0.0 && u < rig->width - 1.0 && v < rig->height - 1.0;
    }
    return (double)seen / (SAMPLES_SIDE * SAMPLES_SIDE);
}

static struct rd_pose draw_pose(const struct rd_rig *rig, struct rd_rng *rng, double start, int picture)
{
    double distance_part = cycle(start + GOLDEN * picture) + rd_rng_uniform(rng, -0.05, 0.05);
    double distance_mm = NEAR_MM * pow(FAR_MM / NEAR_MM, rd_clamp(distance_part, 0.0, 1.0));
    double axis = 2.0 * RD_PI * (cycle(start + PLASTIC * picture) + rd_rng_uniform(rng, -0.05, 0.05));
    double tilt = TILT_MAX_DEG * RD_RAD_PER_DEG * sqrt(rd_rng_uniform(rng, 0.0, 1.0));
    double roll = ROLL_MAX_DEG * RD_RAD_PER_DEG * rd_rng_uniform(rng, -1.0, 1.0);
    double u = rig->cx_px + AIM_PART * 0.5 * rig->width * rd_rng_uniform(rng, -1.0, 1.0);
    double v = rig->cy_px + AIM_PART * 0.5 * rig->height * rd_rng_uniform(rng, -1.0, 1.0);
    struct rd_vec sight = rd_rig_pixel_ray(rig, u, v);
    struct rd_rot turn = rd_rot_euler(tilt * cos(axis), tilt * sin(axis), roll);
    return (struct rd_pose){turn, rd_scale(sight, distance_mm / sight.z)};
}

/* A lamp where a point of the sheet mirrors it into the camera. */
static void mirror_lamp(const struct rd_board *board, const struct rd_pose *pose, struct rd_rng *rng,
                        struct rd_light *light)
{
    double x = rd_rng_uniform(rng, -0.7, 0.7) * board->half_width_mm;
    double y = rd_rng_uniform(rng, -0.7, 0.7) * board->half_height_mm;
    struct rd_vec view = rd_unit(rd_pose_out(pose, rd_v(x, y, 0.0)));
    light->glare_dir = rd_along(view, pose->rot.z, -2.0 * rd_dot(view, pose->rot.z));
    light->glare_grey = GLARE_GREY;
}

void rd_board_show(const struct rd_board *board, const struct rd_options *options, const struct rd_rig *rig,
                   int picture, struct rd_scene *scene, struct rd_light *light, struct rd_pose *pose)
{
    struct rd_rng room_rng = rd_rng_start(options->seed, RD_STREAM_ROOM);
    struct rd_rng start_rng = rd_rng_start(options->seed, RD_STREAM_MOTION);
    struct rd_rng rng = rd_rng_start(options->seed, RD_STREAM_MOTION + ((uint64_t)(picture + 1) << 32));
    double start = rd_rng_uniform(&start_rng, 0.0, 1.0);
    struct rd_material print = {.pattern = RD_BITMAP,
                                .albedo = 0.9,
                                .period_mm = 2.0 * board->half_width_mm / board->bitmap->width,
                                .gloss = options->glare ? 1.0 : 0.0,
                                .bitmap = board->bitmap};
    for (int draw = 0; draw < DRAWS_MAX; draw++) {
        *pose = draw_pose(rig, &rng, start, picture);
        if (fraction_seen(board, rig, pose) > 0.5)
            break;
    }
    rd_scene_clear(scene);
    rd_room_build(scene, &room_rng, RD_BACK_NEAR, WALL_MM);
    struct rd_shape sheet =
        rd_shape_wall(*pose, board->half_width_mm, board->half_height_mm, rd_scene_paint(scene, &print));
    rd_scene_add(scene, &sheet);
    scene->still_count = scene->shape_count;
    if (options->glare)
        mirror_lamp(board, pose, &rng, light);
}
