/* Labels, points, samples and exposure from any table of dots. Input: the rig; then entries: a dot
 * anywhere in the frame, or the pattern's dots at some depth, a little off. */
#include <string.h>

#include "rig/ih_camera.h"
#include "upkeep/ih_exposure.h"

#include "fuzz_check.h"
#include "fuzz_rig.h"

#define PEAK_MAX 18648

static void add_dot(struct ih_dots *dots, const struct ih_rig *rig, int32_t u, int32_t v,
                    int32_t peak)
{
    if (dots->dot_count < IH_DOTS_MAX && ih_camera_sees(rig, u, v)) {
        dots->dot[dots->dot_count++] = (struct ih_dot){u, v, peak};
    }
}

/* The dots from one slot to another at a depth. */
static void add_pattern(struct ih_dots *dots, const struct ih_rig *rig, struct fuzz_input *input)
{
    int32_t from = fuzz_within(input, 0, IH_SLOTS - 1);
    int32_t count = fuzz_within(input, 0, IH_SLOTS);
    int32_t depth_mm_q8 = fuzz_within(input, 100 << 8, 4000 << 8);
    int32_t slope_q8 = fuzz_within(input, -8192, 8191); /* from slot to slot */
    int32_t off_px_q12 = fuzz_within(input, 0, 8192);
    uint32_t seed = fuzz_byte(input);
    for (int32_t slot = from; slot < from + count && slot < IH_SLOTS; slot++) {
        int32_t x_q28 = 0, y_q28 = 0, u = 0, v = 0;
        int32_t depth = depth_mm_q8 + slope_q8 * (slot % IH_GRID);
        ih_rig_dot_at(rig, slot, depth > 256 ? depth : 256, &x_q28, &y_q28);
        ih_camera_distort(rig, x_q28, y_q28, &u, &v);
        u += off_px_q12 * (fuzz_noise(&seed) % 257 - 128) / 128;
        v += off_px_q12 * (fuzz_noise(&seed) % 257 - 128) / 128;
        add_dot(dots, rig, u, v, 1 + fuzz_noise(&seed) % PEAK_MAX);
    }
}

static void fill(struct ih_dots *dots, const struct ih_rig *rig, struct fuzz_input *input)
{
    const struct ih_calibration *c = &rig->calibration;
    memset(dots, 0, sizeof *dots);
    while (input->left > 0) {
        uint8_t command = fuzz_byte(input) % 4;
        if (command == 0) {
            add_pattern(dots, rig, input);
        } else if (command == 1) {
            uint32_t row = fuzz_word(input);
            dots->bright[row % IH_DOTS_BLOCKS_Y][row / 256 % ((IH_DOTS_BLOCKS_X + 31) / 32)] ^=
                fuzz_word(input);
        } else {
            int32_t u = fuzz_within(input, 0, (c->width - 1) * 4096);
            int32_t v = fuzz_within(input, 0, (c->height - 1) * 4096);
            add_dot(dots, rig, u, v, fuzz_within(input, 1, PEAK_MAX));
        }
    }
}

static void check_exposure(const struct ih_dots *dots, const struct ih_labels *labels,
                           const struct ih_rig *rig)
{
    const struct ih_calibration *c = &rig->calibration;
    struct ih_exposure_params params;
    struct ih_exposure_look look;
    struct ih_exposure state;
    ih_exposure_params_default(&params);
    ih_exposure_look(dots, labels, c->width, c->height, &look);
    FUZZ_CHECK(look.labelled_count == labels->labelled_count);
    FUZZ_CHECK(look.lost_count >= 0 && look.lost_count <= IH_SLOTS);
    FUZZ_CHECK(look.weak >= 0 && look.weak <= look.strong && look.strong <= PEAK_MAX);
    ih_exposure_start(&params, 1000, 128, &state);
    for (int i = 0; i < 20; i++) {
        struct ih_exposure before = state;
        ih_exposure_next(&params, &look, &state);
        FUZZ_CHECK(state.exposure_us >= params.exposure_min_us);
        FUZZ_CHECK(state.exposure_us <= params.exposure_max_us);
        FUZZ_CHECK(state.duty_q8 >= params.duty_min_q8 && state.duty_q8 <= params.duty_max_q8);
        FUZZ_CHECK(state.exposure_us <= before.exposure_us ||
                   state.exposure_us <= state.ceiling_us);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct ih_dots dots;
    static struct ih_labels labels;
    static struct ih_labels_scratch scratch;
    static struct ih_dot_rows rows;
    static struct ih_points points;
    static struct ih_samples samples;
    struct ih_labels_params params;
    struct ih_samples_params samples_params;
    struct fuzz_input input = {data, size};
    const struct ih_rig *rig = fuzz_rig_dots(fuzz_byte(&input) % FUZZ_RIGS_DOTS);
    fill(&dots, rig, &input);
    memset(&scratch, 0xa5, sizeof scratch);
    ih_labels_params_default(&params);
    ih_samples_params_default(&samples_params);
    ih_dot_rows_fill(&dots, rig, &rows);
    ih_labels_assign(&dots, &rows, rig, &params, &scratch, &labels);
    fuzz_check_labels(&labels, &dots, rig, &params);
    ih_points_from_labels(&labels, rig, &points);
    /* Out of a level camera's view a dot is none of its points. */
    FUZZ_CHECK(points.seen_count <= labels.labelled_count);
    FUZZ_CHECK(!rig->is_level || points.seen_count == labels.labelled_count);
    fuzz_check_points(&points, rig);
    ih_samples_select(&points, &dots, rig, &samples_params, &samples);
    fuzz_check_samples(&samples, &points);
    check_exposure(&dots, &labels, rig);
    return 0;
}
