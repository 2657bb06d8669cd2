/* The calls of isohead.h in any order, with arguments that fit and that do not. Input: commands, each a byte and its
 * arguments:
 *   0      isohead_init          3, 4  grey: nothing, noise, or dots on a wall   9, 10  isohead_frame
 *   1      default parameters    5, 6  isohead_label
 *   2      the paper's           7, 8  isohead_find
 */
#include <string.h>

#include "rig/ih_camera.h"

#include "fuzz_check.h"
#include "fuzz_rig.h"

#define COMMANDS 11
#define COMMANDS_MAX 128
/* Of whole frames and halves that are taken. */
#define LOOKS_MAX 12
#define GREY_DOT 150

struct caller {
    struct isohead core;
    struct ih_calibration calibration; /* of the last isohead_init */
    int64_t time_us;
    int looks;
    bool has_begun; /* isohead_init was called */
    uint16_t samples[IH_FRAME_WIDTH_MAX *
                     IH_FRAME_WIDTH_MAX]; /* a depth image may be higher than wide */
};

static bool is_dots(const struct caller *caller)
{
    return caller->core.rig.calibration.kind == IH_RIG_DOTS;
}

static bool is_refused(const struct caller *caller)
{
    return caller->core.rig.calibration.width == 0;
}

/* A good rig, or one with a word that is wrong. */
static void init(struct caller *caller, struct fuzz_input *input)
{
    const uint8_t flags = fuzz_byte(input);
    const struct isohead *good =
        (flags & 4) != 0 ? fuzz_rig_range_core(flags & 1) : fuzz_rig_dots_core(flags & 3);
    int32_t bad_slot = 0;
    caller->calibration = good->rig.calibration;
    const bool is_wrong = (flags & 24) == 24;
    if (is_wrong) {
        int32_t *wrong[6] = {&caller->calibration.width,     &caller->calibration.height,
                             &caller->calibration.fx_px_q16, &caller->calibration.near_mm,
                             &caller->calibration.k1_q24,    &caller->calibration.ray_q30[7][2]};
        *wrong[fuzz_byte(input) % 6] = fuzz_int32(input);
    }
    const enum ih_err err = isohead_init(&caller->core, &caller->calibration, &bad_slot);
    caller->has_begun = true;
    FUZZ_CHECK((is_wrong || err == IH_OK) && is_refused(caller) == (err != IH_OK));
    fuzz_check_empty(&caller->core);
}

static void set_default(struct caller *caller, struct fuzz_input *input)
{
    ih_params_default(&caller->core.params);
    caller->core.params.tracks.side = fuzz_byte(input) % 3;
}

static void set_paper(struct caller *caller, struct fuzz_input *input)
{
    (void)input;
    ih_params_paper(&caller->core.params);
}

/* Samples of one or two bytes lie in the same memory: whatever is looked at is a frame. */
static struct ih_frame good_frame(const struct caller *caller)
{
    const struct ih_calibration *c = &caller->core.rig.calibration;
    return (struct ih_frame){caller->samples, c->width, c->height, 2 * c->width, 2, 65535};
}

/* Which frame a call gets: half of them fit. NULL is a malformed one, too. */
static const struct ih_frame *choose(const struct caller *caller, struct fuzz_input *input,
                                     struct ih_frame *frame)
{
    *frame = good_frame(caller);
    switch (fuzz_byte(input) % 12) {
    case 0:
        return NULL;
    case 1:
        frame->samples = NULL;
        break;
    case 2:
        frame->samples = (const uint8_t *)frame->samples + 1;
        break;
    case 3:
        frame->width += 1 + fuzz_byte(input);
        break;
    case 4:
        frame->height = fuzz_int32(input);
        frame->height = frame->height == caller->core.rig.calibration.height ? -1 : frame->height;
        break;
    case 5:
        frame->bytes_per_sample = 3 + fuzz_byte(input);
        break;
    default:
        break;
    }
    return frame;
}

/* True when all members are those of good_frame: one of these must be taken. */
static bool fits(const struct caller *caller, const struct ih_frame *frame)
{
    const struct ih_frame good = good_frame(caller);
    return frame != NULL && frame->samples == good.samples && frame->width == good.width &&
           frame->height == good.height && frame->bytes_per_sample == 2 && !is_refused(caller);
}

/* Of the frames that choose gives only one fits. */
static void check_taken(const struct caller *caller, enum ih_err err, const struct ih_frame *frame,
                        const struct ih_frame *ambient, bool has_ambient)
{
    const bool is_good = fits(caller, frame) && (!has_ambient || fits(caller, ambient));
    FUZZ_CHECK(is_good == (err == IH_OK));
    if (err != IH_OK) {
        fuzz_check_empty(&caller->core);
    }
}

static void label(struct caller *caller, struct fuzz_input *input)
{
    struct ih_frame lit, ambient;
    const bool has_ambient = (fuzz_byte(input) & 1) != 0;
    const struct ih_frame *const first = choose(caller, input, &lit);
    const struct ih_frame *const second = choose(caller, input, &ambient);
    const enum ih_err err = isohead_label(&caller->core, first, has_ambient ? second : NULL);
    caller->looks += err == IH_OK;
    if (is_dots(caller)) {
        check_taken(caller, err, first, second, has_ambient && second != NULL);
    } else {
        FUZZ_CHECK(err == IH_ERR_KIND);
        fuzz_check_empty(&caller->core);
    }
}

static void find(struct caller *caller, struct fuzz_input *input)
{
    const bool is_used = is_dots(caller) && !is_refused(caller);
    caller->time_us = fuzz_next_time_us(input, caller->time_us);
    caller->looks += is_used;
    isohead_find(&caller->core, caller->time_us);
    if (is_used) {
        fuzz_check_core(&caller->core);
    } else if (is_refused(caller) && caller->has_begun) {
        fuzz_check_empty(&caller->core);
    }
}

static void frame(struct caller *caller, struct fuzz_input *input)
{
    struct ih_frame view, ambient;
    const bool has_ambient = (fuzz_byte(input) & 1) != 0;
    const struct ih_frame *const first = choose(caller, input, &view);
    const struct ih_frame *const second = choose(caller, input, &ambient);
    const bool is_used = has_ambient && second != NULL && is_dots(caller);
    caller->time_us = fuzz_next_time_us(input, caller->time_us);
    const enum ih_err err =
        isohead_frame(&caller->core, first, has_ambient ? second : NULL, caller->time_us);
    caller->looks += err == IH_OK;
    check_taken(caller, err, first, second, is_used);
    if (err == IH_OK) {
        fuzz_check_core(&caller->core);
    }
}

static void paint_dots(struct caller *caller, int32_t depth_mm)
{
    const struct ih_rig *rig = &caller->core.rig;
    const int32_t width = rig->calibration.width;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        int32_t x_q28 = 0, y_q28 = 0, u_px_q12 = 0, v_px_q12 = 0;
        ih_rig_dot_at(rig, slot, depth_mm * 256, &x_q28, &y_q28);
        ih_camera_distort(rig, x_q28, y_q28, &u_px_q12, &v_px_q12);
        for (int32_t i = 0; i < 9 && ih_camera_sees(rig, u_px_q12, v_px_q12); i++) {
            const int32_t u = u_px_q12 / 4096 + i % 3 - 1, v = v_px_q12 / 4096 + i / 3 - 1;
            if (u >= 0 && v >= 0 && u < width && v < rig->calibration.height) {
                caller->samples[v * width + u] = (uint16_t)(GREY_DOT * (i == 4 ? 257 : 128));
            }
        }
    }
}

static void paint(struct caller *caller, struct fuzz_input *input)
{
    const uint8_t what = fuzz_byte(input);
    const int32_t depth_mm = fuzz_within(input, 100, 2500);
    uint32_t seed = what;
    const struct ih_calibration *c = &caller->core.rig.calibration;
    for (int32_t i = 0; i < c->width * c->height; i++) {
        caller->samples[i] = what % 4 == 1 ? (uint16_t)fuzz_noise(&seed) : 0;
    }
    if (what % 4 > 1 && is_dots(caller) && !is_refused(caller)) {
        paint_dots(caller, depth_mm);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static struct caller caller;
    static void (*const call[COMMANDS])(struct caller *, struct fuzz_input *) = {
        init, set_default, set_paper, paint, paint, label, label, find, find, frame, frame};
    struct fuzz_input input = {data, size};
    memset(&caller, 0, sizeof caller); /* as static memory that no call has seen */
    for (int i = 0; i < COMMANDS_MAX && input.left > 0 && caller.looks < LOOKS_MAX; i++) {
        call[fuzz_byte(&input) % COMMANDS](&caller, &input);
    }
    return 0;
}
