#include "rd_stage.h"

#include <stddef.h>
#include <stdint.h>

#include "rd_furniture.h"
#include "rd_range.h"
#include "rd_rig.h"
#include "rd_rng.h"

/* From where a depth image is looked at.
 * Seed 0 stands where the depth camera stood. Every other seed draws a position for each frame, so that the same room
 * is seen in many ways: before a thing (a point of the surface, near ones more often), 0.5 to 1.4 m away and no more
 * than 0.6 m beside the depth camera's axis, turned by up to 25 degrees sideways, 15 up or down, 5 about the axis;
 * or before one of the heads, 0.6 to 1.4 m away, turned by up to 15, 10 and 4 degrees from the depth camera's
 * direction, so that the side that was measured is the one that is seen. A position is taken if nothing is nearer than
 * 350 mm, if at least 120 dots show on surfaces within 2.5 m, and at least 8 of them on the head. After 60 draws in
 * vain it is the depth camera's own. */
#define DRAWS_MAX 60
#define DOTS_MIN 120
#define HEAD_DOTS_MIN 8
#define CLOSEST_MM 350.0
#define FARTHEST_MM 2500.0
#define ASIDE_MM 600.0
/* A dot within this part of the semi-axes is on the head: hair, ears and the estimate's error are outside of 1. */
#define HEAD_SCALE 1.25
#define START_MM 1.0
#define SIGHT_SLACK_MM 0.5

/* What the camera stands before. */
struct subject {
    struct rd_vec position_mm;
    const struct rd_range_head *head; /* NULL: a thing */
    double yaw, pitch;                /* where the drawn angles start from */
};

static bool on_head(const struct rd_range_head *head, struct rd_vec point_mm)
{
    struct rd_vec away = rd_over(rd_sub(point_mm, head->centre_mm), head->semi_axes_mm);
    return rd_length(away) < HEAD_SCALE;
}

/* Whether one dot shows, and where in the depth camera's frame. */
static bool dot_shows(const struct rd_relief *relief, const struct rd_rig *rig, const struct rd_pose *camera, int index,
                      double *t_mm, struct rd_vec *position_mm)
{
    double u, v;
    struct rd_vec origin = rd_pose_out(camera, rig->projector_mm), dir = rd_turn(&camera->rot, rig->dot_rays[index]);
    *t_mm = rd_relief_hit(relief, origin, dir, START_MM, FARTHEST_MM);
    if (*t_mm < 0.0)
        return false;
    *position_mm = rd_along(origin, dir, *t_mm);
    struct rd_vec sight = rd_sub(*position_mm, camera->origin_mm);
    double length_mm = rd_length(sight);
    return rd_rig_project(rig, rd_pose_in(camera, *position_mm), &u, &v) && u >= 0.0 && v >= 0.0 &&
           u <= rig->width - 1.0 && v <= rig->height - 1.0 &&
           rd_relief_hit(relief, camera->origin_mm, rd_scale(sight, 1.0 / length_mm), START_MM,
                         length_mm - SIGHT_SLACK_MM) < 0.0;
}

static bool is_good(const struct rd_relief *relief, const struct rd_rig *rig, const struct rd_pose *camera,
                    const struct rd_range_head *head)
{
    int dot_count = 0, head_count = 0;
    struct rd_vec position_mm;
    /* In the way of the depth camera's sight there must still be room before the surface: else the camera stands
     * in a thing or behind it, where nothing is known. */
    if (rd_relief_at_point(relief, camera->origin_mm, &position_mm) && position_mm.z < camera->origin_mm.z + CLOSEST_MM)
        return false;
    for (int i = 0; i < RD_DOT_COUNT; i++) {
        double t_mm;
        bool shows = dot_shows(relief, rig, camera, i, &t_mm, &position_mm);
        if (t_mm > 0.0 && t_mm < CLOSEST_MM)
            return false;
        dot_count += shows;
        head_count += shows && head != NULL && on_head(head, position_mm);
    }
    return dot_count >= DOTS_MIN && (head == NULL || head_count >= HEAD_DOTS_MIN);
}

/* Of two points of the surface the nearer one. */
static bool draw_thing(const struct rd_relief *relief, const struct rd_relief_camera *depth_camera, struct rd_rng *rng,
                       struct rd_vec *position_mm)
{
    bool found = false;
    for (int i = 0; i < 2; i++) {
        struct rd_vec position;
        double u = rd_rng_uniform(rng, 0.1, 0.9) * depth_camera->width;
        double v = rd_rng_uniform(rng, 0.1, 0.9) * depth_camera->height;
        if (rd_relief_at_pixel(relief, u, v, &position) && (!found || position.z < position_mm->z)) {
            *position_mm = position;
            found = true;
        }
    }
    return found;
}

static struct rd_pose draw_pose(const struct subject *subject, struct rd_rng *rng)
{
    bool person = subject->head != NULL;
    double side_deg = person ? 15.0 : 25.0, up_deg = person ? 10.0 : 15.0, roll_deg = person ? 4.0 : 5.0;
    double aim_deg = person ? 5.0 : 9.0;
    double yaw = subject->yaw + rd_rng_uniform(rng, -side_deg, side_deg) * RD_RAD_PER_DEG;
    double pitch = subject->pitch + rd_rng_uniform(rng, -up_deg, up_deg) * RD_RAD_PER_DEG;
    double roll = rd_rng_uniform(rng, -roll_deg, roll_deg) * RD_RAD_PER_DEG;
    double distance_mm = rd_rng_uniform(rng, person ? 600.0 : 500.0, 1400.0);
    double across = tan(rd_rng_uniform(rng, -aim_deg, aim_deg) * RD_RAD_PER_DEG);
    double down = tan(rd_rng_uniform(rng, -aim_deg, aim_deg) * RD_RAD_PER_DEG);
    struct rd_pose camera = {rd_rot_euler(yaw, pitch, roll), subject->position_mm};
    struct rd_vec sight = rd_turn(&camera.rot, rd_unit(rd_v(across, down, 1.0)));
    camera.origin_mm = rd_along(camera.origin_mm, sight, -distance_mm);
    return camera;
}

static bool draw_subject(const struct rd_relief *relief, const struct rd_range_frame *frame, struct rd_rng *rng,
                         struct subject *subject)
{
    *subject = (struct subject){.head = NULL};
    if (frame->head_count == 0)
        return draw_thing(relief, &frame->camera, rng, &subject->position_mm);
    subject->head = &frame->heads[rd_rng_pick(rng, frame->head_count)];
    subject->position_mm = subject->head->centre_mm;
    struct rd_vec offset = rd_unit(subject->position_mm);
    subject->yaw = atan2(offset.x, offset.z);
    subject->pitch = -asin(offset.y);
    return true;
}

/* The camera's pose in the depth camera's frame. */
static struct rd_pose draw_view(const struct rd_relief *relief, const struct rd_range_frame *frame,
                                const struct rd_rig *rig, uint64_t seed, uint64_t frame_index)
{
    struct rd_rng rng = rd_rng_start(seed, RD_STREAM_MOTION + ((frame_index + 1) << 32));
    for (int draw = 0; seed != 0 && draw < DRAWS_MAX; draw++) {
        struct subject subject;
        if (!draw_subject(relief, frame, &rng, &subject))
            continue;
        struct rd_pose camera = draw_pose(&subject, &rng);
        bool aside = fabs(camera.origin_mm.x) > ASIDE_MM || fabs(camera.origin_mm.y) > ASIDE_MM;
        if ((subject.head != NULL || !aside) && is_good(relief, rig, &camera, subject.head))
            return camera;
    }
    return rd_pose_at(rd_v(0.0, 0.0, 0.0));
}

#define FRAME_US 100000
#define ARRANGEMENT_FRAMES 10
#define ARRANGEMENT_US 10000000
#define PATTERN_HALF (RD_DOT_ROWS / 2)

static void arrange(struct rd_stage *stage, int arrangement)
{
    uint64_t stream = RD_STREAM_ROOM + ((uint64_t)(arrangement + 1) << 32);
    struct rd_rng rng = rd_rng_start(stage->options.seed, stream);
    rd_scene_clear(&stage->scene);
    if (stage->options.scene == RD_SCENE_TABLE)
        rd_furniture_table(&stage->scene, &rng);
    else if (stage->options.scene == RD_SCENE_CLUTTER)
        rd_clutter_build(&stage->scene, &rng);
    else
        rd_furniture_room(&stage->scene, &rng);
    if (stage->options.away_mm != 0.0) {
        struct rd_pose away = rd_pose_at(rd_v(0.0, 0.0, stage->options.away_mm));
        rd_scene_move(&stage->scene, 0, &away);
    }
    stage->scene.still_count = stage->scene.shape_count;
    stage->arrangement = arrangement;
    stage->still_changed = true;
}

static bool open_range(struct rd_stage *stage)
{
    bool good = rd_range_open(&stage->range, stage->options.range_dir);
    stage->frame_count = stage->range.frame_count * stage->options.frame_count;
    return good;
}

static bool has_arrangements(const struct rd_options *options)
{
    return options->scene == RD_SCENE_TABLE || options->scene == RD_SCENE_ROOM || options->scene == RD_SCENE_CLUTTER;
}

bool rd_stage_make(struct rd_stage *stage, const struct rd_options *options, const struct rd_rig *rig)
{
    stage->options = *options;
    stage->rig = rig;
    stage->frame_count = options->frame_count;
    stage->arrangement = -1;
    rd_scene_clear(&stage->scene);
    rd_light_make(&stage->light, options);
    if (options->range_dir != NULL)
        return open_range(stage);
    if (options->scene == RD_SCENE_BOARD) {
        rd_board_light(options, &stage->light);
        return rd_board_make(&stage->board, options);
    }
    if (!has_arrangements(options))
        rd_company_make(&stage->company, options, rig, &stage->scene);
    stage->scene.still_count = stage->scene.shape_count;
    return true;
}

static bool load_relief(struct rd_stage *stage, int index)
{
    if (index != stage->arrangement) {
        rd_relief_free(stage->relief);
        stage->relief = rd_range_load(&stage->range.frames[index]);
        stage->arrangement = index;
    }
    return stage->relief != NULL;
}

static void show_relief(struct rd_stage *stage, const struct rd_range_frame *from, int frame)
{
    uint64_t seed = stage->options.seed;
    struct rd_rng rng = rd_rng_start(seed, RD_STREAM_ROOM + ((uint64_t)(stage->arrangement + 1) << 32));
    struct rd_pose camera = draw_view(stage->relief, from, stage->rig, seed, (uint64_t)frame);
    struct rd_pose back = rd_pose_inverse(&camera);
    rd_scene_clear(&stage->scene);
    struct rd_shape surface = rd_shape_relief(back, stage->relief, rd_room_paint(&stage->scene, &rng, 0.15, 0.75));
    rd_scene_add(&stage->scene, &surface);
    stage->scene.still_count = stage->scene.shape_count;
    stage->truth = (struct rd_truth){.head_count = from->head_count, .several = from->head_count > 1};
    for (int i = 0; i < from->head_count; i++)
        stage->truth.heads[i] = (struct rd_head_truth){.centre_mm = rd_pose_out(&back, from->heads[i].centre_mm),
                                                       .semi_axes_mm = from->heads[i].semi_axes_mm};
    rd_company_choose(&stage->truth, stage->rig, PATTERN_HALF);
}

static bool show_range(struct rd_stage *stage, int frame)
{
    int index = frame / stage->options.frame_count;
    const struct rd_range_frame *from = &stage->range.frames[index];
    if (!load_relief(stage, index))
        return false;
    show_relief(stage, from, frame);
    stage->still_changed = true;
    stage->source = from->source;
    stage->time_us = (int64_t)frame * ARRANGEMENT_US;
    return true;
}

static void show_arrangement(struct rd_stage *stage, int frame)
{
    int arrangement = frame / ARRANGEMENT_FRAMES;
    stage->time_us += (int64_t)arrangement * ARRANGEMENT_US;
    stage->truth = (struct rd_truth){.head = RD_NOBODY};
    if (arrangement != stage->arrangement)
        arrange(stage, arrangement);
}

static void show_board(struct rd_stage *stage, int frame)
{
    int picture = stage->options.alternate ? frame / 2 : frame;
    stage->still_changed = picture != stage->arrangement;
    stage->truth = (struct rd_truth){.head = RD_NOBODY, .board_known = true};
    rd_board_show(&stage->board, &stage->options, stage->rig, picture, &stage->scene, &stage->light,
                  &stage->truth.board);
    stage->arrangement = picture;
}

bool rd_stage_frame(struct rd_stage *stage, int frame)
{
    if (stage->options.range_dir != NULL)
        return show_range(stage, frame);
    stage->time_us = (int64_t)frame * FRAME_US;
    stage->still_changed = frame == stage->options.first_frame;
    if (stage->options.scene == RD_SCENE_BOARD) {
        show_board(stage, frame);
    } else if (has_arrangements(&stage->options)) {
        show_arrangement(stage, frame);
    } else {
        stage->scene.shape_count = stage->scene.still_count;
        rd_company_frame(&stage->company, frame, &stage->scene, &stage->truth);
    }
    return true;
}

void rd_stage_end(struct rd_stage *stage)
{
    rd_board_end(&stage->board);
    rd_relief_free(stage->relief);
    rd_range_close(&stage->range);
}
