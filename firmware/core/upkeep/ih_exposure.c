#include "upkeep/ih_exposure.h"

#include <stdbool.h>

#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "dots/ih_bandpass.h"

#define ONE_Q8 256
#define STEP_MIN_Q8 205 /* 0.8 */
#define STEP_MAX_Q8 320 /* 1.25 */
#define NEIGHBOURS_MIN 3
#define NEIGHBOURS_REACH 2

void ih_exposure_params_default(struct ih_exposure_params *params)
{
    *params = (struct ih_exposure_params){
        .exposure_min_us = 100,
        .exposure_max_us = 20000,
        .duty_min_q8 = 16,
        .duty_max_q8 = 256,
        .weak_grey_q4 = 12 * 16,   /* well above the noise of bright rooms */
        .strong_grey_q4 = 96 * 16, /* a dot of full scale on black has 108 */
        .lost_max = 6,
    };
}

static int32_t scaled(int32_t value, int32_t factor_q8, int32_t low, int32_t high)
{
    return ih_clamp_s32((int32_t)ih_mul_shift(value, factor_q8, 8), low, high);
}

void ih_exposure_start(const struct ih_exposure_params *params, int32_t exposure_us,
                       int32_t duty_q8, struct ih_exposure *state)
{
    *state = (struct ih_exposure){
        .exposure_us = ih_clamp_s32(exposure_us, params->exposure_min_us, params->exposure_max_us),
        .duty_q8 = ih_clamp_s32(duty_q8, params->duty_min_q8, params->duty_max_q8),
        .ceiling_us = params->exposure_max_us,
        .ceiling_frames = 0,
    };
}

static int32_t peak_of(const struct ih_dots *dots, const struct ih_labels *labels, int32_t slot)
{
    int32_t dot = labels->dot_of_slot[slot];
    return dot == IH_NONE ? IH_NONE : dots->dot[dot].peak;
}

/* The peak of this rank, from 0, among the labelled dots: by halving the range of values. */
static int32_t peak_of_rank(const struct ih_dots *dots, const struct ih_labels *labels,
                            int32_t rank)
{
    int32_t low = 0;
    int32_t high = INT16_MAX;
    while (low < high) {
        int32_t middle = (low + high) / 2;
        int32_t at_most = 0;
        for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
            int32_t peak = peak_of(dots, labels, slot);
            at_most += peak != IH_NONE && peak <= middle;
        }
        if (at_most > rank) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    return low;
}

/* Would this slot's dot lie where the frame is over-exposed? */
static bool is_lost(const struct ih_dots *dots, const struct ih_labels *labels, int32_t slot)
{
    int32_t count = 0;
    int64_t sum_u = 0;
    int64_t sum_v = 0;
    for (int32_t d_row = -NEIGHBOURS_REACH; d_row <= NEIGHBOURS_REACH; d_row++) {
        for (int32_t d_column = -NEIGHBOURS_REACH; d_column <= NEIGHBOURS_REACH; d_column++) {
            int32_t row = slot / IH_GRID + d_row;
            int32_t column = slot % IH_GRID + d_column;
            if (row < 0 || row >= IH_GRID || column < 0 || column >= IH_GRID) {
                continue;
            }
            int32_t dot = labels->dot_of_slot[row * IH_GRID + column];
            if (dot != IH_NONE) {
                count++;
                sum_u += dots->dot[dot].u_px_q12;
                sum_v += dots->dot[dot].v_px_q12;
            }
        }
    }
    return count >= NEIGHBOURS_MIN &&
           ih_dots_is_bright(dots, (int32_t)(sum_u / count >> 12), (int32_t)(sum_v / count >> 12));
}

/* Over-exposed blocks as a fraction of the frame, in slots, an eighth of it. */
static int32_t bright_slots(const struct ih_dots *dots, int32_t width, int32_t height)
{
    int32_t bright = 0;
    int32_t blocks = 0;
    for (int32_t v = 0; v < height; v += IH_DOTS_BLOCK) {
        for (int32_t u = 0; u < width; u += IH_DOTS_BLOCK) {
            bright += ih_dots_is_bright(dots, u, v);
            blocks++;
        }
    }
    return bright * IH_SLOTS / (8 * ih_max_s32(blocks, 1));
}

void ih_exposure_look(const struct ih_dots *dots, const struct ih_labels *labels, int32_t width,
                      int32_t height, struct ih_exposure_look *out)
{
    const int32_t bright = bright_slots(dots, width, height);
    *out =
        (struct ih_exposure_look){.labelled_count = labels->labelled_count, .lost_count = bright};
    if (labels->labelled_count < IH_EXPOSURE_LABELLED_MIN) {
        return;
    }
    out->weak = peak_of_rank(dots, labels, labels->labelled_count / 4);
    out->strong = peak_of_rank(dots, labels, labels->labelled_count * 9 / 10);
    int32_t lost = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        lost += labels->dot_of_slot[slot] == IH_NONE && is_lost(dots, labels, slot);
    }
    out->lost_count = ih_max_s32(lost, bright);
}

/* Half of the way from what is to what should be, as a factor. */
static int32_t damped_q8(int32_t wanted, int32_t is)
{
    int32_t factor_q8 = ih_saturate_s32(ih_div_round((int64_t)wanted * ONE_Q8, ih_max_s32(is, 1)));
    return ih_clamp_s32(ONE_Q8 + (ih_min_s32(factor_q8, 4 * ONE_Q8) - ONE_Q8) / 2, STEP_MIN_Q8,
                        STEP_MAX_Q8);
}

static void raise_light(const struct ih_exposure_params *params, int32_t factor_q8,
                        bool exposure_too, struct ih_exposure *state)
{
    /* One more at least: a small number would be rounded back. */
    if (state->duty_q8 < params->duty_max_q8) {
        state->duty_q8 =
            ih_max_s32(ih_min_s32(state->duty_q8 + 1, params->duty_max_q8),
                       scaled(state->duty_q8, factor_q8, params->duty_min_q8, params->duty_max_q8));
    } else if (exposure_too && state->exposure_us < params->exposure_max_us) {
        int32_t high = ih_min_s32(params->exposure_max_us, state->ceiling_us);
        int32_t more = ih_max_s32(state->exposure_us + 1,
                                  scaled(state->exposure_us, factor_q8, params->exposure_min_us,
                                         params->exposure_max_us));
        state->exposure_us = ih_max_s32(state->exposure_us, ih_min_s32(more, high));
    }
}

static void lower_light(const struct ih_exposure_params *params, int32_t factor_q8,
                        struct ih_exposure *state)
{
    if (state->duty_q8 > params->duty_min_q8) {
        state->duty_q8 =
            scaled(state->duty_q8, factor_q8, params->duty_min_q8, params->duty_max_q8);
    } else {
        state->exposure_us =
            scaled(state->exposure_us, factor_q8, params->exposure_min_us, params->exposure_max_us);
    }
}

/* Less ambient light; the laser makes up for it as far as it can. */
static void shorten(const struct ih_exposure_params *params, struct ih_exposure *state)
{
    state->exposure_us =
        scaled(state->exposure_us, STEP_MIN_Q8, params->exposure_min_us, params->exposure_max_us);
    state->duty_q8 = scaled(state->duty_q8, STEP_MAX_Q8, params->duty_min_q8, params->duty_max_q8);
    state->ceiling_us = state->exposure_us;
    state->ceiling_frames = IH_EXPOSURE_RETRY;
}

static void forget_ceiling(const struct ih_exposure_params *params, struct ih_exposure *state)
{
    if (state->ceiling_frames > 0) {
        state->ceiling_frames--;
    }
    if (state->ceiling_frames == 0) {
        state->ceiling_us = params->exposure_max_us;
    }
}

/* Losing the rest of the dots for those that over-exposure takes is no gain. */
static bool can_shorten(const struct ih_exposure_params *params,
                        const struct ih_exposure_look *look, int32_t weak_aim,
                        const struct ih_exposure *state)
{
    return look->labelled_count < IH_EXPOSURE_LABELLED_MIN ||
           state->duty_q8 < params->duty_max_q8 || 2 * look->weak >= weak_aim;
}

void ih_exposure_next(const struct ih_exposure_params *params, const struct ih_exposure_look *look,
                      struct ih_exposure *state)
{
    const int32_t weak_aim = (int32_t)ih_mul_shift(params->weak_grey_q4, IH_BANDPASS_UNIT, 4);
    const int32_t strong_aim = (int32_t)ih_mul_shift(params->strong_grey_q4, IH_BANDPASS_UNIT, 4);
    forget_ceiling(params, state);
    if (look->lost_count > params->lost_max && can_shorten(params, look, weak_aim, state)) {
        shorten(params, state);
    } else if (look->labelled_count < IH_EXPOSURE_LABELLED_MIN) {
        raise_light(params, STEP_MAX_Q8, true, state);
    } else if (8 * look->weak < 7 * weak_aim && 8 * look->strong < 7 * strong_aim) {
        raise_light(params, damped_q8(weak_aim, look->weak),
                    2 * look->lost_count <= params->lost_max, state);
    } else if (8 * look->strong > 9 * strong_aim && 8 * look->weak > 9 * weak_aim) {
        lower_light(params, damped_q8(strong_aim, look->strong), state);
    }
    IH_IN_RANGE(state->exposure_us, params->exposure_min_us, params->exposure_max_us);
    IH_IN_RANGE(state->duty_q8, params->duty_min_q8, params->duty_max_q8);
}
