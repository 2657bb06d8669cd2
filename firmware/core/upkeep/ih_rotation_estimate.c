#include "upkeep/ih_rotation_estimate.h"

#include <stddef.h>
#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "upkeep/ih_rotation_solve.h"

/* The place is wherever the next dot is. */
#define ANYWHERE INT32_MIN
/* What any number of frames on one place counts at most. */
#define FRAMES_OF_PLACE_Q8 (20 << 8)
/* What an estimate needs: dots, and slots, whose scatter is the uncertainty. */
#define WEIGHT_MIN_Q8 (200 << 8)
#define SLOTS_MIN 40
/* How far a slot errs in every frame alike: what is used to report a rotation; to decide whether
 * there is one at all; and whether it has changed, where what was calibrated badly is in both. */
#define SLOT_PX_Q12 123        /* 0.03 px */
#define UNCERTAINTY_PX_Q12 492 /* 0.12 px */
#define CHANGE_PX_Q12 246      /* 0.06 px */
#define SURE 5
/* Beyond this distance known places are of no use for a turned rig. */
#define ROTATION_MAX_PX_Q12 4096
#define PIN_MAX_PX_Q12 8192
#define PULL_MAX_Q20 (1 << 28)
/* A slot whose mean is so far from what the turn says counts half: sqrt(3 s^2 + 0.3^2 / n) px with n frames, where
 * slots scatter by s. Means are limited, too. */
#define HALF_SCATTERS 3
#define HALF_OF_ONE_PX_Q12 1229
#define LEFT_MAX_PX_Q12 4096
/* Of the trusted weight at least a third is taken to be left, see steepness_q8. */
#define STEEP_MIN_Q12 1365
/* Solutions one after the other: the first trusts all slots alike, the others as the one before says. */
#define PASSES 4
/* What is summed over slots, and how. */
struct totals {
    struct ih_rotation_sums sums;
    int64_t whole_q8; /* see whole */
    int32_t slot_count;
    int32_t uncertainty_px_q12;   /* how far a slot may err, before a turn is sure */
    int64_t half_q24;             /* 3 s^2 */
    const int32_t *about_rad_q30; /* the turn that says how far slots are trusted; NULL: all are */
};

void ih_rotation_estimate_clear(struct ih_rotation_estimate *places)
{
    memset(places, 0, sizeof *places);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        places->slot[slot].along_px_q12[0] = ANYWHERE;
        places->slot[slot].along_px_q12[1] = ANYWHERE;
    }
}

/* Slopes of 2^14 px per rad are those of dots at 45 degrees with the longest focal length; steeper ones
 * of wider patterns are left out. */
static bool is_steep(const int32_t slope_px_q4[3])
{
    return ih_abs_s32(slope_px_q4[0]) > IH_RANGE_HEALTH_SLOPE_PX_Q4 ||
           ih_abs_s32(slope_px_q4[1]) > IH_RANGE_HEALTH_SLOPE_PX_Q4 ||
           ih_abs_s32(slope_px_q4[2]) > IH_RANGE_HEALTH_SLOPE_PX_Q4;
}

/* Tukey's weight (1 - r)^2 of r = (e / reach)^2, and the derivative (1 - r) (1 - 5 r) of weight times e;
 * 0 beyond the reach. */
static void weigh(int64_t across_px_q12, int64_t reach_px_q12, int64_t *weight_q8, int64_t *rise_q8)
{
    int64_t ratio_q16 = across_px_q12 * across_px_q12 * 65536 / (reach_px_q12 * reach_px_q12);
    int64_t remainder_q16 = ratio_q16 < 65536 ? 65536 - ratio_q16 : 0;
    *weight_q8 = ih_mul_shift(remainder_q16, remainder_q16, 24);
    *rise_q8 = ih_mul_shift(remainder_q16, 65536 - 5 * ratio_q16, 24);
}

static void scale_sums(struct ih_dot_place_sums *sums, int64_t part, int64_t whole)
{
    sums->weight_q8 = (int32_t)ih_rotation_div_round(sums->weight_q8 * part, whole);
    sums->pull_q20 = (int32_t)ih_rotation_div_round(sums->pull_q20 * part, whole);
}

/* Of n frames on a place n / (1 + n / 20); the same fraction of the rest. */
static void add_place(const struct ih_dot_place_sums *place, struct ih_dot_place_sums *to)
{
    struct ih_dot_place_sums sums = *place;
    scale_sums(&sums, FRAMES_OF_PLACE_Q8, FRAMES_OF_PLACE_Q8 + place->weight_q8);
    to->weight_q8 += sums.weight_q8;
    to->pull_q20 += sums.pull_q20;
}

/* Everything known of a slot. */
static struct ih_dot_place_sums sum_of(const struct ih_dot_place *place)
{
    struct ih_dot_place_sums sum = place->at[IH_ROTATION_ESTIMATE_KNOWN];
    for (int i = 0; i < IH_ROTATION_ESTIMATE_KNOWN; i++) {
        add_place(&place->at[i], &sum);
    }
    return sum;
}

static bool is_at(const struct ih_dot_place *place, int which, int32_t along_px_q12)
{
    return ih_abs_s64((int64_t)along_px_q12 - place->along_px_q12[which]) <=
           IH_ROTATION_ESTIMATE_MOVE_PX_Q12;
}

/* A dot elsewhere begins a place instead of the one with fewer frames: a wall stays known while an arm passes. */
static struct ih_dot_place_sums *place_at(struct ih_dot_place *place, int32_t along_px_q12)
{
    int which = !is_at(place, 0, along_px_q12) &&
                (is_at(place, 1, along_px_q12) || place->at[1].weight_q8 < place->at[0].weight_q8);
    if (!is_at(place, which, along_px_q12)) {
        add_place(&place->at[which], &place->at[IH_ROTATION_ESTIMATE_KNOWN]);
        place->at[which] = (struct ih_dot_place_sums){.weight_q8 = 0};
        place->along_px_q12[which] = along_px_q12;
    }
    return &place->at[which];
}

/* Where in the image, in the line's direction: where the line begins, and t from there. Unlike t it stays as it is
 * when the rig is turned, which moves no dot. Beginnings of 2^27.6 on each axis times a unit vector: 2^58.1, or
 * 2^28.1; with t of 2^27.9 below 2^29. */
static int32_t along_image(const struct ih_line *line, int32_t t_px_q12)
{
    int64_t begin_q42 = (int64_t)line->infinity_u_px_q12 * line->dir_u_q30 +
                        (int64_t)line->infinity_v_px_q12 * line->dir_v_q30;
    int32_t along_px_q12 = (int32_t)ih_shift_round(begin_q42, 30) + t_px_q12;
    IH_IN_RANGE(along_px_q12, -IH_RANGE_ALONG_PX_Q12, IH_RANGE_ALONG_PX_Q12);
    return along_px_q12;
}

void ih_rotation_estimate_add(struct ih_rotation_estimate *places, const struct ih_labels *labels,
                              const struct ih_rig *rig,
                              const struct ih_rotation_vote_slopes *slopes, int32_t reach_px_q12)
{
    /* A dot's weight is at most 2^8, times its distance at most 0.29 of the reach: in IH_ROTATION_ESTIMATE_FRAMES_MAX
     * frames 2^17.9 and 2^26.4 with a reach of 0.3 px. */
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (labels->dot_of_slot[slot] == IH_NONE || is_steep(slopes->px_q4[slot])) {
            continue;
        }
        int64_t across_px_q12 = labels->perp_px_q12[slot];
        int64_t weight_q8, rise_q8;
        weigh(across_px_q12, reach_px_q12, &weight_q8, &rise_q8);
        if (weight_q8 > 0) {
            struct ih_dot_place_sums *place = place_at(
                &places->slot[slot], along_image(&rig->line[slot], labels->t_px_q12[slot]));
            place->weight_q8 += (int32_t)weight_q8;
            place->pull_q20 += (int32_t)(weight_q8 * across_px_q12);
        }
        places->square_q32 += weight_q8 * across_px_q12 * across_px_q12;
        places->weight_q8 += weight_q8;
        places->rise_q8 += rise_q8;
    }
    places->frame_count++;
}

void ih_rotation_estimate_forget(struct ih_rotation_estimate *places)
{
    if (places->frame_count < IH_ROTATION_ESTIMATE_FRAMES_MAX) {
        return;
    }
    places->frame_count -= places->frame_count / 4;
    places->square_q32 -= places->square_q32 / 4;
    places->weight_q8 -= places->weight_q8 / 4;
    places->rise_q8 -= places->rise_q8 / 4;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        struct ih_dot_place *place = &places->slot[slot];
        for (int i = 0; i <= IH_ROTATION_ESTIMATE_KNOWN; i++) {
            scale_sums(&place->at[i], 3, 4);
        }
    }
}

/* What a turn moves a dot across its line. Slopes of 2^18, turns of 2^24.5: 2^44.1. */
static int64_t move_px_q12(const int32_t slope_px_q4[3], const int32_t rotation_rad_q30[3])
{
    int64_t sum_q34 = 0;
    for (int i = 0; i < 3; i++) {
        sum_q34 += (int64_t)slope_px_q4[i] * rotation_rad_q30[i];
    }
    return ih_shift_round(sum_q34, 22);
}

/* Where all dots move by d, their weighted mean moves by less, as the weights move too: by rise / weight.
 * At least a third, else the weights have lost the dots. */
static int64_t fraction_q8(const struct ih_rotation_estimate *places)
{
    int64_t rise_q8 =
        places->rise_q8 * 3 > places->weight_q8 ? places->rise_q8 : places->weight_q8 / 3;
    return ih_rotation_div_round(rise_q8 * 256, places->weight_q8);
}

static int64_t whole(int64_t value, int64_t fraction)
{
    return ih_rotation_div_round(value * 256, fraction);
}

/* What a turn leaves of a slot's pull, as if the weights stayed. Weights of 2^18, moves of 2^22.7: 2^40.7. */
static int64_t left_of_q20(const struct ih_dot_place_sums *sum, const struct totals *totals,
                           const int32_t slope_px_q4[3], const int32_t rotation_rad_q30[3])
{
    return whole(sum->pull_q20, totals->whole_q8) -
           sum->weight_q8 * move_px_q12(slope_px_q4, rotation_rad_q30);
}

/* How far from what the turn says a slot's mean is, up to 1 px. */
static int64_t mean_left_q12(const struct ih_dot_place_sums *sum, const struct totals *totals,
                             const int32_t slope_px_q4[3], const int32_t rotation_rad_q30[3])
{
    return ih_rotation_limit(
        ih_rotation_div_round(left_of_q20(sum, totals, slope_px_q4, rotation_rad_q30),
                              sum->weight_q8),
        LEFT_MAX_PX_Q12);
}

/* Everything known of a slot, as far as it is trusted: of what the turn leaves of its mean, Cauchy's weight
 * 1 / (1 + (r / h)^2). Pulls of 2^28.4 times h of 2^28.6, or 1229^2 in Q8: 2^57. */
static struct ih_dot_place_sums trusted_sum_of(const struct ih_dot_place *place,
                                               const int32_t slope_px_q4[3],
                                               const struct totals *totals)
{
    const int64_t one_q32 = (int64_t)HALF_OF_ONE_PX_Q12 * HALF_OF_ONE_PX_Q12 * 256;
    struct ih_dot_place_sums sum = sum_of(place);
    if (sum.weight_q8 > 0 && totals->about_rad_q30 != NULL) {
        int64_t mean_q12 = mean_left_q12(&sum, totals, slope_px_q4, totals->about_rad_q30);
        int64_t half_q24 = totals->half_q24 + ih_rotation_div_round(one_q32, sum.weight_q8);
        scale_sums(&sum, half_q24, half_q24 + mean_q12 * mean_q12);
    }
    return sum;
}

/* Mean square of what a turn leaves of slots' means. Weights of 2^17.9, squares of 2^24, slots: 2^50.4. */
static int64_t scatter_q24(const struct ih_rotation_estimate *places,
                           const struct ih_rotation_vote_slopes *slopes,
                           const struct totals *totals, const int32_t rotation_rad_q30[3])
{
    int64_t square_q32 = 0;
    int64_t weight_q8 = 1;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        struct ih_dot_place_sums sum = sum_of(&places->slot[slot]);
        if (sum.weight_q8 > 0) {
            int64_t mean_q12 = mean_left_q12(&sum, totals, slopes->px_q4[slot], rotation_rad_q30);
            square_q32 += sum.weight_q8 * mean_q12 * mean_q12;
            weight_q8 += sum.weight_q8;
        }
    }
    return ih_rotation_div_round(square_q32, weight_q8);
}

/* Weights of a slot are at most 2^17.9, slopes 2^18, slots 2^8.5: 2^62.4; of the right side, with pulls of 2^28.4,
 * 2^54.9, and 2^62.9 on its way through whole. */
static void add_up(const struct ih_rotation_estimate *places,
                   const struct ih_rotation_vote_slopes *slopes, struct totals *out)
{
    memset(out->sums.normal_q16, 0, sizeof out->sums.normal_q16);
    memset(out->sums.right_q24, 0, sizeof out->sums.right_q24);
    out->whole_q8 = fraction_q8(places);
    out->slot_count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int32_t *slope = slopes->px_q4[slot];
        struct ih_dot_place_sums sum = trusted_sum_of(&places->slot[slot], slope, out);
        for (int row = 0; row < 3; row++) {
            out->sums.right_q24[row] += (int64_t)sum.pull_q20 * slope[row];
            for (int column = row; column < 3; column++) {
                out->sums.normal_q16[ih_rotation_packed[row][column]] +=
                    (int64_t)sum.weight_q8 * slope[row] * slope[column];
            }
        }
        out->slot_count += sum.weight_q8 > 0;
    }
    for (int row = 0; row < 3; row++) {
        out->sums.right_q24[row] = whole(out->sums.right_q24[row], out->whole_q8);
    }
}

/* Holds the turn about an axis in the camera's X and Y where offset puts it; the rest is then against
 * that. A quarter of what is known of X and Y holds what is hardly seen, and no more: 2^62.9 with it. Moves are
 * limited to 2 px: sums of 2^57.4. */
static void pin(const struct ih_rotation_estimate *places,
                const struct ih_rotation_vote_slopes *slopes, const int32_t axis_q30[2],
                const int32_t offset_rad_q30[3], struct totals *sums)
{
    int64_t hold_q36 = (sums->sums.normal_q16[0] / 4 + sums->sums.normal_q16[3] / 4) >> 20;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int32_t *slope = slopes->px_q4[slot];
        int64_t move = ih_rotation_limit(move_px_q12(slope, offset_rad_q30), PIN_MAX_PX_Q12);
        struct ih_dot_place_sums sum = trusted_sum_of(&places->slot[slot], slope, sums);
        for (int row = 0; row < 3; row++) {
            sums->sums.right_q24[row] -= sum.weight_q8 * move * slope[row];
        }
    }
    for (int row = 0; row < 2; row++) {
        for (int column = row; column < 2; column++) {
            int64_t both_q20 = ih_mul_shift(axis_q30[row], axis_q30[column], 40);
            sums->sums.normal_q16[ih_rotation_packed[row][column]] += hold_q36 * both_q20;
        }
    }
}

/* Root of the sum of squares, px in Q16 below 2^31. */
static int64_t with_standing_q16(uint64_t square_q32, uint64_t weight_q32, int64_t standing_px_q12)
{
    int64_t standing_q16 = ih_mul_shift(ih_isqrt_u64(weight_q32), standing_px_q12, 12);
    return (int64_t)ih_isqrt_u64(square_q32 + (uint64_t)(standing_q16 * standing_q16)) + 1;
}

/* Of a slot's trusted weight w v, what is left of it when its mean moves: v less as it falls, w v (2 v - 1). */
static int64_t steepness_q8(int64_t weight_q8, int64_t trusted_q8)
{
    return weight_q8 > 0
               ? ih_rotation_div_round(2 * trusted_q8 * trusted_q8, weight_q8) - trusted_q8
               : 0;
}

/* What slots leave unexplained is held below 2^28, times a lever of 2^32: 2^60. Squares of 2^26 add up to 2^60.5.
 * Weights of 2^17.9 and slots in Q12: 2^38.4. */
static void judge(const struct ih_rotation_estimate *places,
                  const struct ih_rotation_vote_slopes *slopes,
                  const struct ih_rotation_equations *e, const struct totals *sums,
                  const int32_t offset_rad_q30[3], struct ih_rotation_estimate_result *out)
{
    int32_t rotation_rad_q30[3];
    uint64_t square_q32[3] = {0, 0, 0};
    uint64_t weight_q32[3] = {0, 0, 0};
    int64_t trusted_q8 = 0;
    int64_t steep_q8 = 0;
    for (int i = 0; i < 3; i++) {
        rotation_rad_q30[i] = out->rotation_rad_q30[i] + offset_rad_q30[i];
    }
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const int32_t *slope = slopes->px_q4[slot];
        struct ih_dot_place_sums sum = trusted_sum_of(&places->slot[slot], slope, sums);
        steep_q8 += steepness_q8(sum_of(&places->slot[slot]).weight_q8, sum.weight_q8);
        trusted_q8 += sum.weight_q8;
        int64_t left_q20 = ih_rotation_limit(left_of_q20(&sum, sums, slope, rotation_rad_q30),
                                             (int64_t)PULL_MAX_Q20);
        for (int i = 0; sum.weight_q8 > 0 && i < 3; i++) {
            int64_t lever = ih_rotation_lever_q26(e, slope, i);
            int64_t left_q16 = ih_rotation_limit(ih_shift_round(left_q20 * lever, 30), 1 << 26);
            int64_t own_q16 = ih_rotation_limit(ih_shift_round(sum.weight_q8 * lever, 18), 1 << 26);
            square_q32[i] += (uint64_t)(left_q16 * left_q16);
            weight_q32[i] += (uint64_t)(own_q16 * own_q16);
        }
    }
    int64_t sure = 0;
    int64_t steep_q12 = ih_rotation_div_round(steep_q8 * 4096, trusted_q8 + 1);
    int64_t unit_q22 = ih_rotation_div_round((int64_t)1 << 34,
                                             steep_q12 > STEEP_MIN_Q12 ? steep_q12 : STEEP_MIN_Q12);
    for (int i = 0; i < 3; i++) {
        int64_t sigma_q16 = with_standing_q16(square_q32[i], weight_q32[i], SLOT_PX_Q12);
        int64_t uncertainty_q16 =
            with_standing_q16(square_q32[i], weight_q32[i], sums->uncertainty_px_q12);
        int64_t uncertainty_rad_q30 =
            ih_rotation_div_round(uncertainty_q16 * unit_q22, e->root_q8[i]);
        int64_t part_rad_q30 = ih_abs_s32(out->rotation_rad_q30[i]);
        out->sigma_rad_q30[i] =
            ih_saturate_s32(ih_rotation_div_round(sigma_q16 * unit_q22, e->root_q8[i]));
        sure += part_rad_q30 >= SURE * uncertainty_rad_q30 ? part_rad_q30 * part_rad_q30 : 0;
    }
    out->sure_rad_q30 = (int32_t)ih_isqrt_u64((uint64_t)sure);
}

/* held: the axis about which the turn is what offset says, or NULL. Judged with the wide prior: a narrow one holds
 * what no dot shows near 0, where it scatters little and may be all wrong. False: an axis is not seen, or less
 * certain than it may be. */
static bool estimate(const struct ih_rotation_estimate *places,
                     const struct ih_rotation_vote_slopes *slopes, int32_t uncertainty_px_q12,
                     const int32_t rotated_rad_q30[3], const int32_t *held_q30,
                     const int32_t offset_rad_q30[3], struct ih_rotation_estimate_result *out)
{
    int64_t noise_q12 =
        (int64_t)ih_isqrt_u64((uint64_t)(places->square_q32 / places->weight_q8)) + 1;
    int32_t from_rad_q30[3], about_rad_q30[3];
    struct ih_rotation_equations wide;
    struct totals sums = {.about_rad_q30 = NULL, .uncertainty_px_q12 = uncertainty_px_q12};
    for (int i = 0; i < 3; i++) {
        from_rad_q30[i] = rotated_rad_q30[i] + offset_rad_q30[i];
    }
    for (int pass = 0; pass < PASSES; pass++) {
        add_up(places, slopes, &sums);
        if (held_q30 != NULL) {
            pin(places, slopes, held_q30, offset_rad_q30, &sums);
        }
        if (sums.slot_count < SLOTS_MIN ||
            !ih_rotation_solve(&sums.sums, noise_q12, from_rad_q30, &wide, out->rotation_rad_q30)) {
            return false;
        }
        for (int i = 0; i < 3 && pass < PASSES - 1; i++) {
            about_rad_q30[i] = out->rotation_rad_q30[i] + offset_rad_q30[i];
        }
        if (pass == 0) {
            sums.half_q24 = HALF_SCATTERS * scatter_q24(places, slopes, &sums, about_rad_q30);
        }
        sums.about_rad_q30 = about_rad_q30;
    }
    judge(places, slopes, &wide, &sums, offset_rad_q30, out);
    for (int i = 0; i < 3; i++) {
        out->rotation_rad_q30[i] += offset_rad_q30[i];
    }
    return out->sigma_rad_q30[0] <= IH_ROTATION_ESTIMATE_SIGMA_MAX_RAD_Q30 &&
           out->sigma_rad_q30[1] <= IH_ROTATION_ESTIMATE_SIGMA_MAX_RAD_Q30 &&
           out->sigma_rad_q30[2] <= IH_ROTATION_ESTIMATE_SIGMA_MAX_RAD_Q30;
}

void ih_rotation_estimate_hold(const struct ih_rig *rig, const int32_t rotated_rad_q30[3],
                               int32_t back_rad_q30[3])
{
    int32_t axis_q30[2][2];
    ih_rotation_vote_axes(rig, axis_q30);
    int64_t part_rad_q30 = -ih_shift_round((int64_t)axis_q30[1][0] * rotated_rad_q30[0] +
                                               (int64_t)axis_q30[1][1] * rotated_rad_q30[1],
                                           30);
    back_rad_q30[0] = (int32_t)ih_mul_shift(part_rad_q30, axis_q30[1][0], 30);
    back_rad_q30[1] = (int32_t)ih_mul_shift(part_rad_q30, axis_q30[1][1], 30);
    back_rad_q30[2] = 0;
}

static bool find(const struct ih_rotation_estimate *places, const struct ih_rig *rig,
                 const struct ih_rotation_vote_slopes *slopes, const int32_t rotated_rad_q30[3],
                 bool is_weak_known, int32_t uncertainty_px_q12,
                 struct ih_rotation_estimate_result *out)
{
    const int32_t none[3] = {0, 0, 0};
    int32_t offset_rad_q30[3] = {0, 0, 0};
    int32_t axis_q30[2][2];
    if (places->weight_q8 < WEIGHT_MIN_Q8) {
        return false;
    }
    out->is_weak_seen =
        estimate(places, slopes, uncertainty_px_q12, rotated_rad_q30, NULL, none, out);
    if (out->is_weak_seen) {
        return true;
    }
    ih_rotation_vote_axes(rig, axis_q30);
    if (!is_weak_known) {
        ih_rotation_estimate_hold(rig, rotated_rad_q30, offset_rad_q30);
    }
    return estimate(places, slopes, uncertainty_px_q12, rotated_rad_q30, axis_q30[1],
                    offset_rad_q30, out);
}

bool ih_rotation_estimate_find(const struct ih_rotation_estimate *places, const struct ih_rig *rig,
                               const struct ih_rotation_vote_slopes *slopes,
                               const int32_t rotated_rad_q30[3], bool is_weak_known,
                               struct ih_rotation_estimate_result *out)
{
    return find(places, rig, slopes, rotated_rad_q30, is_weak_known, UNCERTAINTY_PX_Q12, out);
}

/* The difference of two means has the weight w v / (w + v). Weights of 2^18, pulls of 2^28.4: 2^47.4. */
static void subtract(const struct ih_dot_place *late, const struct ih_dot_place *all,
                     struct ih_dot_place *out)
{
    struct ih_dot_place_sums of_late = sum_of(late);
    struct ih_dot_place_sums of_all = sum_of(all);
    *out = (struct ih_dot_place){.along_px_q12 = {ANYWHERE, ANYWHERE}};
    if (of_late.weight_q8 > 0 && of_all.weight_q8 > 0) {
        int64_t both_q8 = (int64_t)of_late.weight_q8 + of_all.weight_q8;
        int64_t pull_q28 = (int64_t)of_late.pull_q20 * of_all.weight_q8 -
                           (int64_t)of_all.pull_q20 * of_late.weight_q8;
        out->at[IH_ROTATION_ESTIMATE_KNOWN].weight_q8 =
            (int32_t)ih_rotation_div_round((int64_t)of_late.weight_q8 * of_all.weight_q8, both_q8);
        out->at[IH_ROTATION_ESTIMATE_KNOWN].pull_q20 =
            (int32_t)ih_rotation_limit(ih_rotation_div_round(pull_q28, both_q8), PULL_MAX_Q20);
    }
}

bool ih_rotation_estimate_change(const struct ih_rotation_estimate *late,
                                 const struct ih_rotation_estimate *all, const struct ih_rig *rig,
                                 const struct ih_rotation_vote_slopes *slopes,
                                 struct ih_rotation_estimate *scratch,
                                 struct ih_rotation_estimate_result *out)
{
    const int32_t none[3] = {0, 0, 0};
    scratch->frame_count = late->frame_count;
    scratch->weight_q8 = late->weight_q8;
    scratch->rise_q8 = late->rise_q8;
    scratch->square_q32 = late->square_q32;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        subtract(&late->slot[slot], &all->slot[slot], &scratch->slot[slot]);
    }
    return find(scratch, rig, slopes, none, true, CHANGE_PX_Q12, out);
}

void ih_rotation_estimate_rotate(struct ih_rotation_estimate *places,
                                 const struct ih_rotation_vote_slopes *slopes,
                                 const int32_t by_rad_q30[3])
{
    if (places->weight_q8 == 0) {
        return;
    }
    int64_t fraction = fraction_q8(places);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        struct ih_dot_place *place = &places->slot[slot];
        if (sum_of(place).weight_q8 == 0) {
            continue;
        }
        int64_t move = move_px_q12(slopes->px_q4[slot], by_rad_q30);
        if (ih_abs_s64(move) > ROTATION_MAX_PX_Q12) {
            ih_rotation_estimate_clear(places);
            return;
        }
        for (int i = 0; i <= IH_ROTATION_ESTIMATE_KNOWN; i++) {
            struct ih_dot_place_sums *sums = &place->at[i];
            int64_t left_q20 =
                sums->pull_q20 - ih_shift_round(sums->weight_q8 * move * fraction, 8);
            sums->pull_q20 = (int32_t)ih_rotation_limit(left_q20, PULL_MAX_Q20);
        }
    }
}
