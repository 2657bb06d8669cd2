/* The rig's alignment from dots of several frames, and what labels say of them. Input: the rig; then commands: the
 * pattern's dots of a rig that was moved, at some depth and a little off; a dot; dots anywhere; the next frame. */
#include <string.h>

#include "align/ih_align.h"
#include "rig/ih_camera.h"

#include "fuzz_check.h"
#include "fuzz_rig.h"

#define PEAK_MAX 18648
#define FRAMES_MAX 24
/* Two axes at their limit of 1.5 degrees; the focal length's 1.5 %. */
#define ROTATION_MAX_RAD_Q30 39754000
#define FOCAL_MAX_Q30 16106128
#define MOVE_MAX_RAD_Q30 30000000 /* 1.6 degrees */

struct world {
    struct ih_rig rig;
    struct ih_rig seen; /* where the rig is */
    struct ih_dots dots;
    struct ih_dot_rows rows;
    struct ih_labels_params params;
    struct ih_labels labels;
    struct ih_labels_scratch labels_scratch;
    struct ih_align align;
    struct ih_align_scratch scratch;
};

static void add_dot(struct world *world, int32_t u, int32_t v)
{
    struct ih_dots *dots = &world->dots;
    if (dots->dot_count < IH_DOTS_MAX && ih_camera_sees(&world->rig, u, v)) {
        dots->dot[dots->dot_count] = (struct ih_dot){u, v, 1 + dots->dot_count % PEAK_MAX};
        dots->dot_count++;
    }
}

static void move(struct world *world, const struct ih_rig *file, struct fuzz_input *input)
{
    struct ih_rig_motion motion = {{0}, 0, {0}};
    for (int axis = 0; axis < 3; axis++) {
        motion.rotation_rad_q30[axis] = fuzz_within(input, -MOVE_MAX_RAD_Q30, MOVE_MAX_RAD_Q30);
    }
    world->seen = *file;
    ih_rig_move(&world->seen, file->calibration.ray_q30, &motion);
}

/* Dots of the rig that was moved, from one slot to another, on a slope. */
static void add_pattern(struct world *world, struct fuzz_input *input)
{
    int32_t from = fuzz_within(input, 0, IH_SLOTS - 1);
    int32_t count = fuzz_within(input, 0, IH_SLOTS);
    int32_t depth_mm_q8 = fuzz_within(input, 100 << 8, 4000 << 8);
    int32_t slope_q8 = fuzz_within(input, -8192, 8191);
    int32_t off_px_q12 = fuzz_within(input, 0, 8192);
    uint32_t seed = fuzz_byte(input);
    for (int32_t slot = from; slot < from + count && slot < IH_SLOTS; slot++) {
        int32_t x_q28 = 0, y_q28 = 0, u = 0, v = 0;
        int32_t depth = depth_mm_q8 + slope_q8 * (slot % IH_GRID);
        ih_rig_dot_at(&world->seen, slot, depth > 256 ? depth : 256, &x_q28, &y_q28);
        ih_camera_distort(&world->seen, x_q28, y_q28, &u, &v);
        add_dot(world, u + off_px_q12 * (fuzz_noise(&seed) % 257 - 128) / 128,
                v + off_px_q12 * (fuzz_noise(&seed) % 257 - 128) / 128);
    }
}

static void scatter(struct world *world, struct fuzz_input *input)
{
    const struct ih_calibration *c = &world->rig.calibration;
    int32_t count = fuzz_within(input, 0, IH_DOTS_MAX);
    uint32_t seed = fuzz_byte(input);
    for (int32_t i = 0; i < count; i++) {
        int32_t u = fuzz_noise(&seed) % c->width * 4096;
        add_dot(world, u, fuzz_noise(&seed) % c->height * 4096);
    }
}

static void check_rows(const struct world *world)
{
    const struct ih_dot_rows *rows = &world->rows;
    bool taken[IH_DOTS_MAX] = {false};
    FUZZ_CHECK(rows->dot_count == world->dots.dot_count);
    for (int32_t i = 0; i < rows->dot_count; i++) {
        FUZZ_CHECK(rows->dot[i] >= 0 && rows->dot[i] < rows->dot_count);
        FUZZ_CHECK(!taken[rows->dot[i]]);
        taken[rows->dot[i]] = true;
        FUZZ_CHECK(i == 0 || rows->v_px_q12[i - 1] <= rows->v_px_q12[i]);
    }
}

static void check(const struct world *world, const struct ih_rig *file)
{
    const struct ih_alignment *now = &world->align.now;
    bool is_moved = now->focal_q30 != 0 || now->shift_px_q12[0] != 0 || now->shift_px_q12[1] != 0;
    FUZZ_CHECK(now->state >= IH_ALIGN_UNKNOWN && now->state <= IH_ALIGN_LOST);
    FUZZ_CHECK(now->across_px_q12 >= -1 && now->across_px_q12 <= world->params.perp_max_px_q12);
    FUZZ_CHECK(now->focal_q30 >= -FOCAL_MAX_Q30 && now->focal_q30 <= FOCAL_MAX_Q30);
    FUZZ_CHECK(now->depth_sigma_rad_q30 >= 0);
    for (int axis = 0; axis < 3; axis++) {
        int32_t rotation = now->rotation_rad_q30[axis];
        FUZZ_CHECK(rotation >= -ROTATION_MAX_RAD_Q30 && rotation <= ROTATION_MAX_RAD_Q30);
        FUZZ_CHECK(now->sigma_rad_q30[axis] >= 0);
        is_moved = is_moved || rotation != 0;
    }
    if (!is_moved) {
        FUZZ_CHECK(memcmp(&world->rig, file, sizeof *file) == 0);
    }
}

static void finish_frame(struct world *world, const struct ih_rig *file)
{
    ih_align_find(&world->align, &world->dots, &world->rig, &world->rows, &world->scratch);
    check_rows(world);
    check(world, file);
    ih_labels_assign(&world->dots, &world->rows, &world->rig, &world->params,
                     &world->labels_scratch, &world->labels);
    fuzz_check_labels(&world->labels, &world->dots, &world->rig, &world->params);
    ih_align_learn(&world->align, &world->labels, &world->rig, &world->scratch);
    check(world, file);
    world->dots.dot_count = 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct world world;
    struct fuzz_input input = {data, size};
    const struct ih_rig *file = fuzz_rig_dots(fuzz_byte(&input) % FUZZ_RIGS_DOTS);
    int32_t frame_count = 0;
    memset(&world, 0xa5, sizeof world);
    world.rig = *file;
    world.seen = *file;
    world.dots.dot_count = 0;
    ih_labels_params_default(&world.params);
    ih_align_init(&world.align, &world.rig);
    while (input.left > 0 && frame_count < FRAMES_MAX) {
        uint8_t command = fuzz_byte(&input) % 8;
        if (command == 0) {
            move(&world, file, &input);
        } else if (command < 3) {
            add_pattern(&world, &input);
        } else if (command == 3) {
            scatter(&world, &input);
        } else if (command == 4) {
            int32_t u = fuzz_within(&input, 0, (file->calibration.width - 1) * 4096);
            add_dot(&world, u, fuzz_within(&input, 0, (file->calibration.height - 1) * 4096));
        } else {
            finish_frame(&world, file);
            frame_count++;
        }
    }
    finish_frame(&world, file);
    return 0;
}
