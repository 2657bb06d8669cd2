/* isohead_init with any calibration, then a frame that fits it. Input: bit flags, then the
 * calibration's words; a flag replaces what follows by what a good rig of fuzz_rig has, so that
 * every check is reached. */
#include <string.h>

#include "app_rig.h"

#include "fuzz_rig.h"
#include "rig/ih_camera.h"

#define WORDS (sizeof(struct ih_calibration) / sizeof(int32_t))
/* Of words that are changed one by one. */
#define CHANGES_MAX 8
#define PROBES 16

_Static_assert(sizeof(struct ih_calibration) % sizeof(int32_t) == 0, "words, all of them");

/* The whole of it, or a good one with some words replaced. */
static void make(struct fuzz_input *input, struct ih_calibration *calibration)
{
    int32_t word[WORDS];
    uint8_t flags = fuzz_byte(input);
    const struct isohead *good =
        (flags & 4) != 0 ? fuzz_rig_range_core(flags & 1) : fuzz_rig_dots_core(flags & 3);
    memcpy(word, &good->rig.calibration, sizeof word);
    if ((flags & 8) != 0) {
        for (size_t i = 0; i < WORDS && input->left > 0; i++) {
            word[i] = fuzz_int32(input);
        }
    }
    for (int i = 0; i < CHANGES_MAX && input->left > 0; i++) {
        size_t at = (size_t)fuzz_within(input, 0, (int32_t)WORDS - 1);
        int32_t change = fuzz_int32(input);
        word[at] = (flags & 16) != 0 ? (int32_t)((int64_t)word[at] + change % 65536 > INT32_MAX
                                                     ? INT32_MAX
                                                     : word[at] / 2 + change / 2)
                                     : change;
    }
    memcpy(calibration, word, sizeof *calibration);
}

static void check_line(const struct ih_line *line)
{
    int64_t length2_q60 =
        (int64_t)line->dir_u_q30 * line->dir_u_q30 + (int64_t)line->dir_v_q30 * line->dir_v_q30;
    int64_t off_q60 = length2_q60 - ((int64_t)1 << 60);
    FUZZ_CHECK(llabs(off_q60) < (int64_t)1 << 48);
    FUZZ_CHECK(line->length_px_mm_q8 > 0);
    FUZZ_CHECK(line->t_far_px_q12 >= 0 && line->t_far_px_q12 <= line->t_near_px_q12);
}

/* Places all over the frame and beyond: in the format's range, and back within 0.005 px inside. */
static void check_lens(const struct ih_rig *rig)
{
    const struct ih_calibration *c = &rig->calibration;
    for (int32_t i = 0; i < PROBES * PROBES; i++) {
        int32_t u = (c->width + 20) * 4096 / PROBES * (i % PROBES) - 10 * 4096;
        int32_t v = (c->height + 20) * 4096 / PROBES * (i / PROBES) - 10 * 4096;
        int32_t x = 0, y = 0, back_u = 0, back_v = 0;
        ih_camera_undistort(rig, u, v, &x, &y);
        FUZZ_CHECK(llabs(x) <= (int64_t)IH_RIG_TAN_MAX << 28);
        FUZZ_CHECK(llabs(y) <= (int64_t)IH_RIG_TAN_MAX << 28);
        ih_camera_distort(rig, x, y, &back_u, &back_v);
        (void)ih_camera_sees(rig, back_u, back_v);
    }
}

static void check_refused(struct isohead *core, const struct ih_calibration *calibration,
                          enum ih_err err, int32_t bad_slot)
{
    struct hal_error error = {""};
    static uint16_t sample;
    struct ih_frame frame = {
        &sample, calibration->width, calibration->height, calibration->width, 1, 255};
    FUZZ_CHECK(err < 0 && strcmp(ih_err_text(err), "unknown error") != 0);
    FUZZ_CHECK(bad_slot == IH_NONE || err == IH_ERR_RAY || err == IH_ERR_BASELINE);
    app_rig_explain(calibration, err, bad_slot, &error);
    FUZZ_CHECK(error.text[0] != 0 && memchr(error.text, 0, sizeof error.text) != NULL);
    FUZZ_CHECK(isohead_frame(core, &frame, NULL, 0) < 0);
}

/* A frame with nothing in it, or with noise. */
static void run_frame(struct isohead *core, uint32_t seed)
{
    static uint16_t samples[IH_FRAME_WIDTH_MAX * IH_FRAME_WIDTH_MAX];
    const struct ih_calibration *c = &core->rig.calibration;
    struct ih_frame frame = {samples, c->width, c->height, 2 * c->width, 2, 65535};
    for (int32_t i = 0; i < c->width * c->height; i++) {
        samples[i] = seed == 0 ? 0 : (uint16_t)fuzz_noise(&seed);
    }
    FUZZ_CHECK(isohead_frame(core, &frame, NULL, 0) == IH_OK);
    FUZZ_CHECK(core->result.entry_count >= 0 && core->result.entry_count <= IH_RESULT_MAX);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct isohead core;
    struct fuzz_input input = {data, size};
    struct ih_calibration calibration;
    int32_t bad_slot = 12345;
    uint8_t frame = fuzz_byte(&input);
    make(&input, &calibration);
    enum ih_err err = isohead_init(&core, &calibration, &bad_slot);
    FUZZ_CHECK(bad_slot == IH_NONE || (bad_slot >= 0 && bad_slot < IH_SLOTS));
    if (err != IH_OK) {
        check_refused(&core, &calibration, err, bad_slot);
        return 0;
    }
    check_lens(&core.rig);
    for (int32_t slot = 0; slot < IH_SLOTS && calibration.kind == IH_RIG_DOTS; slot++) {
        check_line(&core.rig.line[slot]);
    }
    FUZZ_CHECK(calibration.kind == IH_RIG_RANGE || core.rig.field.unit_q28 > 0);
    if (frame < 16) {
        run_frame(&core, frame);
    }
    return 0;
}
