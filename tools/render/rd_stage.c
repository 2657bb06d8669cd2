#include "rd_stage.h"

#include "rd_clutter.h"
#include "rd_furniture.h"
#include "rd_view.h"

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
    struct rd_pose camera = rd_view_draw(stage->relief, from, stage->rig, seed, (uint64_t)frame);
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
