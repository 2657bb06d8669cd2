/* A rig's health from any labels and dots. Input: the rig; then commands: the pattern's labels, so far
 * from their lines and moving along them, for some frames; one slot; dots to vote. */
#include <string.h>

#include "upkeep/ih_health.h"
#include "upkeep/ih_rotation_vote.h"

#include "fuzz.h"
#include "fuzz_rig.h"

/* Farthest from its line that a label may be: 0.6 px, as ih_labels_params_default says. */
#define ACROSS_MAX_PX_Q12 2458
#define FRAMES_MAX 2000

struct world {
    struct ih_rig rig;
    struct ih_dots dots;
    struct ih_labels labels;
    struct ih_health health;
    struct ih_health_scratch scratch;
    int32_t frame_count;
};

static void label(struct world *world, int32_t slot, int32_t across_px_q12)
{
    struct ih_labels *labels = &world->labels;
    bool is_near = across_px_q12 >= -ACROSS_MAX_PX_Q12 && across_px_q12 <= ACROSS_MAX_PX_Q12;
    labels->dot_of_slot[slot] = is_near ? (int16_t)slot : IH_NONE;
    labels->perp_px_q12[slot] = (int16_t)(is_near ? across_px_q12 : 0);
}

/* A plane of distances with noise, over slots from one on. */
static void label_pattern(struct world *world, struct fuzz_input *input)
{
    int32_t from = fuzz_within(input, 0, IH_SLOTS - 1);
    int32_t to = fuzz_within(input, from, IH_SLOTS - 1);
    int32_t mean = fuzz_within(input, -4096, 4096);
    int32_t by_row = fuzz_within(input, -512, 512);
    int32_t by_both = fuzz_within(input, -64, 64);
    int32_t noise = fuzz_within(input, 0, 4096);
    uint32_t seed = fuzz_byte(input);
    for (int32_t slot = from; slot <= to; slot++) {
        int32_t row = slot / IH_GRID - IH_GRID / 2;
        int32_t column = slot % IH_GRID - IH_GRID / 2;
        label(world, slot,
              mean + row * by_row + row * column * by_both +
                  noise * (fuzz_noise(&seed) % 257 - 128) / 128);
    }
}

static void scatter_dots(struct world *world, struct fuzz_input *input)
{
    const struct ih_calibration *c = &world->rig.calibration;
    uint32_t seed = fuzz_byte(input);
    world->dots.dot_count = fuzz_within(input, 0, IH_DOTS_MAX);
    for (int32_t i = 0; i < world->dots.dot_count; i++) {
        world->dots.dot[i].u_px_q12 = fuzz_noise(&seed) % c->width * 4096;
        world->dots.dot[i].v_px_q12 = fuzz_noise(&seed) % c->height * 4096;
    }
}

static void check(const struct world *world, const struct ih_rig *nominal, bool has_changed)
{
    const struct ih_health *health = &world->health;
    bool is_rotated = false;
    FUZZ_CHECK(health->state >= IH_HEALTH_UNKNOWN && health->state <= IH_HEALTH_LOST);
    FUZZ_CHECK(health->across_px_q12 >= -1 && health->across_px_q12 <= ACROSS_MAX_PX_Q12);
    for (int i = 0; i < 3; i++) {
        int32_t rotation = health->rotation_rad_q30[i];
        FUZZ_CHECK(rotation >= -IH_ROTATION_VOTE_MAX_RAD_Q30 &&
                   rotation <= IH_ROTATION_VOTE_MAX_RAD_Q30);
        FUZZ_CHECK(health->sigma_rad_q30[i] >= 0);
        is_rotated = is_rotated || rotation != 0;
    }
    FUZZ_CHECK(health->state != IH_HEALTH_ROTATED || is_rotated || has_changed);
    if (!is_rotated) {
        FUZZ_CHECK(memcmp(&world->rig, nominal, sizeof *nominal) == 0);
    }
}

/* Along its line a dot goes on by so much a frame. */
static void look(struct world *world, const struct ih_rig *nominal, struct fuzz_input *input)
{
    int32_t count = fuzz_within(input, 1, 64);
    int32_t move_px_q12 = fuzz_within(input, -4096, 4096);
    for (int32_t i = 0; i < count && world->frame_count < FRAMES_MAX; i++) {
        world->labels.labelled_count = 0;
        for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
            world->labels.labelled_count += world->labels.dot_of_slot[slot] != IH_NONE;
            world->labels.t_px_q12[slot] += move_px_q12;
        }
        bool has_changed = ih_health_frame(&world->health, &world->dots, &world->labels,
                                           &world->rig, &world->scratch);
        check(world, nominal, has_changed);
        world->frame_count++;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct world world;
    struct fuzz_input input = {data, size};
    const struct ih_rig *nominal = fuzz_rig_dots(fuzz_byte(&input) % FUZZ_RIGS_DOTS);
    memset(&world, 0, sizeof world);
    memset(&world.scratch, 0xa5, sizeof world.scratch);
    world.rig = *nominal;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        label(&world, slot, 0);
    }
    world.dots.dot_count = IH_SLOTS;
    ih_health_init(&world.health, &world.rig);
    while (input.left > 0 && world.frame_count < FRAMES_MAX) {
        uint8_t command = fuzz_byte(&input) % 4;
        if (command == 0) {
            label_pattern(&world, &input);
        } else if (command == 1) {
            scatter_dots(&world, &input);
        } else if (command == 2) {
            int32_t slot = fuzz_within(&input, 0, IH_SLOTS - 1);
            label(&world, slot, fuzz_within(&input, -4096, 4096));
        } else {
            look(&world, nominal, &input);
        }
    }
    return 0;
}
