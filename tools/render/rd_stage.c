#include "rd_stage.h"

#include "rd_clutter.h"
#include "rd_furniture.h"
#include "rd_view.h"

#define FRAME_US 100000
#define ARRANGEMENT_FRAMES 10
#define ARRANGEMENT_US 10000000
/* Frames without the person, of fifty. */
#define EMPTY_OF_50 4
#define PATTERN_HALF (RD_DOT_ROWS / 2)

static bool somebody_comes(const struct rd_options *options)
{
    return options->scene == RD_SCENE_PERSON || options->scene == RD_SCENE_TURNING;
}

static void plan_absence(struct rd_stage *stage)
{
    struct rd_rng rng = rd_rng_start(stage->options.seed, RD_STREAM_SCHEDULE);
    int frame_count = stage->frame_count;
    int empty_count = (frame_count * EMPTY_OF_50 + 25) / 50;
    int place = rd_rng_pick(&rng, 3);
    int first = place == 0 ? 0 : place == 1 ? frame_count / 2 : frame_count - empty_count;
    stage->empty_first = first;
    stage->empty_end = first + empty_count;
    if (!somebody_comes(&stage->options)) {
        stage->empty_first = 0;
        stage->empty_end = frame_count;
    }
}

static struct rd_vec draw_head_place(struct rd_rng *rng, bool turning)
{
    struct rd_vec at;
    at.x = rd_rng_uniform(rng, -45.0, 45.0);
    at.y = rd_rng_uniform(rng, -80.0, 0.0);
    at.z = turning ? rd_rng_uniform(rng, 850.0, 1250.0) : rd_rng_uniform(rng, 730.0, 1060.0);
    return at;
}

static enum rd_background background_of(const struct rd_options *options, struct rd_rng *rng)
{
    double drawn = rd_rng_uniform(rng, 0.0, 1.0);
    if (options->background != RD_BACK_VARIED)
        return options->background;
    /* Who turns on an office chair mostly sits in the open. */
    if (options->scene == RD_SCENE_TURNING)
        drawn = 0.3 + 0.7 * drawn;
    return drawn < 0.45 ? RD_BACK_NEAR : drawn < 0.75 ? RD_BACK_FAR : RD_BACK_NONE;
}

static void make_seated(struct rd_stage *stage)
{
    const struct rd_options *options = &stage->options;
    bool turning = options->scene == RD_SCENE_TURNING;
    struct rd_rng person_rng = rd_rng_start(options->seed, RD_STREAM_PERSON);
    struct rd_rng room_rng = rd_rng_start(options->seed, RD_STREAM_ROOM);
    struct rd_rng seat_rng = rd_rng_start(options->seed, RD_STREAM_SEAT);
    struct rd_vec head_mm = draw_head_place(&person_rng, turning);
    rd_person_make(&stage->person, &person_rng);
    rd_person_dress(&stage->person, &stage->scene, &person_rng);
    rd_motion_make(&stage->motion, &stage->person, options->seed, options->frame_count, head_mm, turning,
                   options->sequence == 2);
    rd_room_build(&stage->scene, &room_rng, background_of(options, &room_rng), head_mm.z + 350.0);
    if (turning)
        rd_chair_make(&stage->chair, &stage->scene, &seat_rng);
    else
        rd_seat_build(&stage->scene, &seat_rng, head_mm);
}

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
    stage->still_changed = true;
    rd_scene_clear(&stage->scene);
    rd_light_make(&stage->light, options);
    if (options->range_dir != NULL)
        return open_range(stage);
    plan_absence(stage);
    if (!has_arrangements(options))
        make_seated(stage);
    stage->scene.still_count = stage->scene.shape_count;
    return true;
}

static void add_truth(struct rd_truth *truth, const struct rd_person *person, const struct rd_posture *posture)
{
    const struct rd_rot *rot = &posture->head.rot;
    truth->heads[truth->head_count++] = (struct rd_head_truth){
        .centre_mm = posture->head.origin_mm,
        .semi_axes_mm = person->head_axes_mm,
        .angles_known = true,
        /* Yaw, pitch and roll of rd_rot_euler, read back from the axes. */
        .yaw_deg = atan2(rot->z.x, rot->z.z) / RD_RAD_PER_DEG,
        .pitch_deg = asin(rd_clamp(-rot->z.y, -1.0, 1.0)) / RD_RAD_PER_DEG,
        .roll_deg = atan2(rot->x.y, rot->y.y) / RD_RAD_PER_DEG,
    };
}

/* The head nearest the pattern's middle whose centre lies within the pattern. */
static void choose_head(struct rd_truth *truth, const struct rd_rig *rig)
{
    double least = 1e9;
    truth->head = RD_NOBODY;
    for (int i = 0; i < truth->head_count; i++) {
        double row, column;
        bool ahead = rd_rig_pattern_place(rig, truth->heads[i].centre_mm, &row, &column);
        if (!ahead || fmax(fabs(row), fabs(column)) > PATTERN_HALF || hypot(row, column) >= least)
            continue;
        least = hypot(row, column);
        truth->head = i;
    }
}

static bool show_range(struct rd_stage *stage, int frame)
{
    int index = frame / stage->options.frame_count;
    const struct rd_range_frame *from = &stage->range.frames[index];
    struct rd_rng rng = rd_rng_start(stage->options.seed, RD_STREAM_ROOM + ((uint64_t)(index + 1) << 32));
    if (index != stage->arrangement) {
        rd_relief_free(stage->relief);
        stage->relief = rd_range_load(from);
        stage->arrangement = index;
    }
    if (stage->relief == NULL)
        return false;
    struct rd_pose camera = rd_view_draw(stage->relief, from, stage->rig, stage->options.seed, (uint64_t)frame);
    struct rd_pose back = rd_pose_inverse(&camera);
    rd_scene_clear(&stage->scene);
    struct rd_shape surface = rd_shape_relief(back, stage->relief, rd_room_paint(&stage->scene, &rng, 0.15, 0.75));
    rd_scene_add(&stage->scene, &surface);
    stage->scene.still_count = stage->scene.shape_count;
    stage->still_changed = true;
    stage->source = from->source;
    stage->time_us = (int64_t)frame * ARRANGEMENT_US;
    stage->truth = (struct rd_truth){.head_count = from->head_count, .several = from->head_count > 1};
    for (int i = 0; i < from->head_count; i++)
        stage->truth.heads[i] = (struct rd_head_truth){.centre_mm = rd_pose_out(&back, from->heads[i].centre_mm),
                                                       .semi_axes_mm = from->heads[i].semi_axes_mm};
    choose_head(&stage->truth, stage->rig);
    return true;
}

/* An empty chair stays as it was left, or as it will be found. */
static void add_chair(struct rd_stage *stage, int frame)
{
    if (stage->truth.head == RD_NOBODY)
        frame = stage->empty_first > 0 ? stage->empty_first - 1 : stage->empty_end;
    double turn = rd_motion_turn(&stage->motion, frame);
    rd_chair_build(&stage->chair, &stage->scene, stage->motion.hips_mm, turn, stage->person.torso_mm);
}

bool rd_stage_frame(struct rd_stage *stage, int frame)
{
    if (stage->options.range_dir != NULL)
        return show_range(stage, frame);
    bool somebody = frame < stage->empty_first || frame >= stage->empty_end;
    stage->truth = (struct rd_truth){.head = somebody ? 0 : RD_NOBODY};
    stage->time_us = (int64_t)frame * FRAME_US;
    stage->still_changed = frame == 0;
    if (has_arrangements(&stage->options)) {
        int arrangement = frame / ARRANGEMENT_FRAMES;
        stage->time_us += (int64_t)arrangement * ARRANGEMENT_US;
        if (arrangement != stage->arrangement)
            arrange(stage, arrangement);
        return true;
    }
    stage->scene.shape_count = stage->scene.still_count;
    if (stage->options.scene == RD_SCENE_TURNING)
        add_chair(stage, frame);
    if (somebody) {
        struct rd_posture posture;
        rd_motion_posture(&stage->motion, &stage->person, frame, &posture);
        rd_person_build(&stage->person, &posture, &stage->scene);
        add_truth(&stage->truth, &stage->person, &posture);
    }
    return true;
}

void rd_stage_end(struct rd_stage *stage)
{
    rd_relief_free(stage->relief);
    rd_range_close(&stage->range);
}
