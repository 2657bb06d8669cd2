#include "ih_health.h"

#include <string.h>

#include "ih_fix.h"

/* Labelled dots that an estimate needs, in Q8 of weight. */
#define WEIGHT_MIN_Q8 (200 << 8)
/* A rig is lost when so many dots are seen in a frame, but hardly any is labelled, or their mean distance
 * is that of any place within reach of the labels: 0.3 px. */
#define DOTS_MIN 60
#define LOST_ACROSS_PX_Q12 1024 /* 0.25 px */
/* How far dots err that do so in every frame alike. */
#define STANDING_PX_Q12 492 /* 0.12 px */
/* A turn that is worth a correction: more than this, with a chi-square of 5^2. */
#define TURN_MIN_RAD_Q30 374802 /* 0.02 degrees */
#define CHI2_MIN 25
/* No axis may be less certain than this. */
#define SIGMA_MAX_RAD_Q30 1874008 /* 0.1 degrees */
/* The prior is at least as wide as this. */
#define PRIOR_MIN_RAD_Q30 107374 /* 0.1 mrad */
/* Least determinant of the correlations: below it an axis is not seen at all. */
#define DETERMINANT_MIN_Q30 (1 << 20)
/* Sums are halved at so many frames. */
#define FRAMES_MAX 240
/* Frames of each step of settling. Dots farther from their line than reach say nothing about a turn. */
#define SETTLE_STEPS 3
static const int32_t settle_frames[SETTLE_STEPS] = {4, 4, 32};
static const int32_t settle_reach_px_q12[SETTLE_STEPS] = {4915, 2458, 1229};
#define REACH_PX_Q12 1229 /* 0.3 px */
/* Row and column of a packed entry. */
static const int8_t packed[3][3] = {{0, 1, 2}, {1, 3, 4}, {2, 4, 5}};

struct estimate {
    int32_t turn_rad_q30[3]; /* against the rig as it is */
    int32_t sigma_rad_q30[3];
    int64_t chi2;
};

static void start_look(struct ih_health *health)
{
    health->look = (struct ih_health_look){.frame_count = 0};
}

static void use_rig(struct ih_health *health, const struct ih_rig *rig)
{
    ih_turn_slopes(rig, &health->slopes);
    health->sums = (struct ih_health_sums){.frame_count = 0};
    start_look(health);
}

void ih_health_init(struct ih_health *health, const struct ih_rig *rig)
{
    memset(health, 0, sizeof *health);
    health->nominal = rig->calibration;
    health->across_px_q12 = -1;
    use_rig(health, rig);
}

/* Tukey's weight (1 - r)^2 of r = (e / reach)^2, and the derivative (1 - r) (1 - 5 r) of weight times e;
 * 0 beyond the reach. */
static void weigh(int64_t across_px_q12, int64_t reach_px_q12, int64_t *weight_q8, int64_t *rise_q8)
{
    int64_t ratio_q16 = across_px_q12 * across_px_q12 * 65536 / (reach_px_q12 * reach_px_q12);
    int64_t rest_q16 = ratio_q16 < 65536 ? 65536 - ratio_q16 : 0;
    *weight_q8 = ih_mul_shift(rest_q16, rest_q16, 24);
    *rise_q8 = ih_mul_shift(rest_q16, 65536 - 5 * ratio_q16, 24);
}

/* Weights are at most 2^8, slopes 2^18, sums of at most FRAMES_MAX frames of 361, 2^16.5: 2^60.5. A slope of
 * 2^14 px per rad is that of a dot at 45 degrees with the longest focal length; steeper ones of wider
 * patterns are left out. */
static void add_dot(struct ih_health_sums *sums, const int32_t slope_px_q4[3],
                    int64_t across_px_q12, int64_t reach_px_q12)
{
    int64_t weight_q8, rise_q8;
    weigh(across_px_q12, reach_px_q12, &weight_q8, &rise_q8);
    for (int row = 0; row < 3; row++) {
        if (ih_abs_s32(slope_px_q4[row]) > IH_RANGE_HEALTH_SLOPE_PX_Q4) {
            return;
        }
    }
    for (int row = 0; row < 3; row++) {
        int64_t part = weight_q8 * slope_px_q4[row];
        sums->right_q24[row] += part * across_px_q12;
        for (int column = row; column < 3; column++) {
            sums->normal_q16[packed[row][column]] += part * slope_px_q4[column];
        }
    }
    sums->square_q32 += weight_q8 * across_px_q12 * across_px_q12;
    sums->weight_q8 += weight_q8;
    sums->rise_q8 += rise_q8;
}

static void add_frame(struct ih_health *health, const struct ih_dots *dots,
                      const struct ih_labels *labels)
{
    struct ih_health_look *look = &health->look;
    int64_t reach_px_q12 =
        health->stage == IH_HEALTH_SETTLING ? settle_reach_px_q12[health->step] : REACH_PX_Q12;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (labels->dot_of_slot[slot] != IH_NONE) {
            int64_t across_px_q12 = labels->perp_px_q12[slot];
            look->across_px_q12 += ih_abs_s64(across_px_q12);
            add_dot(&health->sums, health->slopes.px_q4[slot], across_px_q12, reach_px_q12);
        }
    }
    look->dot_count += dots->dot_count;
    look->labelled_count += labels->labelled_count;
    look->frame_count++;
    health->sums.frame_count++;
}

/* What was long ago counts less: the rig may drift. */
static void forget(struct ih_health_sums *sums)
{
    if (sums->frame_count < FRAMES_MAX) {
        return;
    }
    sums->frame_count /= 2;
    for (int i = 0; i < 6; i++) {
        sums->normal_q16[i] /= 2;
    }
    for (int i = 0; i < 3; i++) {
        sums->right_q24[i] /= 2;
    }
    sums->square_q32 /= 2;
    sums->weight_q8 /= 2;
    sums->rise_q8 /= 2;
}

/* The equations in units in which the diagonal is 1, and their cofactors. */
struct equations {
    int64_t root_q8[3]; /* of the diagonal: px per rad and root of the dots' number */
    int64_t right_px_q16[3];
    int64_t cofactor_q30[3][3];
    int64_t determinant_q30;
};

static void fill_cofactors(const int64_t c_q30[3][3], struct equations *out)
{
    for (int row = 0; row < 3; row++) {
        int r1 = (row + 1) % 3;
        int r2 = (row + 2) % 3;
        for (int column = 0; column < 3; column++) {
            int c1 = (column + 1) % 3;
            int c2 = (column + 2) % 3;
            out->cofactor_q30[row][column] =
                ih_shift_round(c_q30[r1][c1] * c_q30[r2][c2] - c_q30[r1][c2] * c_q30[r2][c1], 30);
        }
    }
    out->determinant_q30 = 0;
    for (int column = 0; column < 3; column++) {
        out->determinant_q30 += ih_mul_shift(c_q30[0][column], out->cofactor_q30[0][column], 30);
    }
}

/* Where all dots move by d, their weighted mean moves by less, as the weights move too: by rise / weight.
 * At least a third, else the weights have lost the dots. */
static int64_t whole_q24(const struct ih_health_sums *sums, int64_t right_q24)
{
    int64_t rise_q8 = sums->rise_q8 * 3 > sums->weight_q8 ? sums->rise_q8 : sums->weight_q8 / 3;
    return ih_div_round(right_q24 * 256, ih_div_round(rise_q8 * 256, sums->weight_q8));
}

/* Sums with a prior of that precision about the calibration, from which the rig is turned already. An
 * entry of the matrix is at most the product of its roots, so entries over roots stay below 2^31. */
static void scale(const struct ih_health *health, int64_t precision_q16, struct equations *out)
{
    const struct ih_health_sums *sums = &health->sums;
    int64_t c_q30[3][3];
    for (int i = 0; i < 3; i++) {
        int64_t diagonal_q16 = sums->normal_q16[packed[i][i]] + precision_q16;
        int64_t pull_q24 = ih_mul_shift(precision_q16 >> 8, health->turn_rad_q30[i], 14);
        out->root_q8[i] = (int64_t)ih_isqrt_u64((uint64_t)diagonal_q16) + 1;
        out->right_px_q16[i] =
            ih_div_round(whole_q24(sums, sums->right_q24[i]) - pull_q24, out->root_q8[i]);
    }
    for (int row = 0; row < 3; row++) {
        c_q30[row][row] = (int64_t)1 << 30;
        for (int column = row + 1; column < 3; column++) {
            int64_t part_q8 =
                ih_div_round(sums->normal_q16[packed[row][column]], out->root_q8[row]);
            c_q30[row][column] = ih_div_round(part_q8 * ((int64_t)1 << 30), out->root_q8[column]);
            c_q30[column][row] = c_q30[row][column];
        }
    }
    fill_cofactors(c_q30, out);
}

/* Right sides are below 2^7.5 px times the root of the dots' number, 2^24 in Q16; three products with
 * cofactors of up to 2 in Q30: 2^57. */
static void solve(const struct equations *e, int32_t turn_rad_q30[3])
{
    for (int i = 0; i < 3; i++) {
        int64_t sum_q46 = 0;
        for (int k = 0; k < 3; k++) {
            sum_q46 += e->cofactor_q30[i][k] * e->right_px_q16[k];
        }
        int64_t part_px_q16 = ih_div_round(sum_q46, e->determinant_q30);
        turn_rad_q30[i] =
            ih_clamp_s32(ih_saturate_s32(ih_div_round(part_px_q16 * (1 << 22), e->root_q8[i])),
                         -2 * IH_TURN_MAX_RAD_Q30, 2 * IH_TURN_MAX_RAD_Q30);
    }
}

/* Standard deviation of a dot's distance, with what does not average out over frames. */
static int64_t noise_px_q12(const struct ih_health_sums *sums)
{
    int64_t own2_q24 = ih_div_round(sums->square_q32, sums->weight_q8);
    int64_t standing2_q24 =
        (int64_t)STANDING_PX_Q12 * STANDING_PX_Q12 * ih_max_s32(sums->frame_count, 1);
    return (int64_t)ih_isqrt_u64((uint64_t)(own2_q24 + standing2_q24)) + 1;
}

static int64_t length_rad_q30(const int32_t a_rad_q30[3], const int32_t b_rad_q30[3])
{
    int64_t sum = 0;
    for (int i = 0; i < 3; i++) {
        int64_t part = (int64_t)a_rad_q30[i] + b_rad_q30[i];
        sum += part * part;
    }
    return (int64_t)ih_isqrt_u64((uint64_t)sum);
}

/* sigma: the root of the inverse's diagonal. chi2: how much of the dots' squares the turn explains. */
static void judge(const struct ih_health_sums *sums, const struct equations *e, int64_t noise_q12,
                  struct estimate *out)
{
    int64_t explained_q38 = 0;
    for (int i = 0; i < 3; i++) {
        int64_t inverse_q20 = ih_div_round(e->cofactor_q30[i][i] * (1 << 20), e->determinant_q30);
        int64_t root_q10 = (int64_t)ih_isqrt_u64((uint64_t)(inverse_q20 < 0 ? 0 : inverse_q20));
        out->sigma_rad_q30[i] =
            ih_saturate_s32(ih_div_round(noise_q12 * root_q10 * (1 << 16), e->root_q8[i]));
        explained_q38 += ih_shift_round(sums->right_q24[i], 16) * out->turn_rad_q30[i];
    }
    out->chi2 = ih_div_round(ih_shift_round(explained_q38, 14), noise_q12 * noise_q12);
}

/* False: too few dots, or an axis that they do not show. The prior is wide at first, then as wide as the
 * whole turn that was found with it. */
static bool find_turn(const struct ih_health *health, struct estimate *out)
{
    const int32_t none[3] = {0, 0, 0};
    const int32_t limit[3] = {IH_TURN_MAX_RAD_Q30, IH_TURN_MAX_RAD_Q30, IH_TURN_MAX_RAD_Q30};
    const struct ih_health_sums *sums = &health->sums;
    if (sums->weight_q8 < WEIGHT_MIN_Q8) {
        return false;
    }
    int64_t noise_q12 = noise_px_q12(sums);
    int64_t prior_rad_q30 = length_rad_q30(limit, none);
    for (int i = 0; i < 3; i++) {
        struct equations equations;
        int64_t root_q8 = ih_div_round(noise_q12 * (1 << 26), prior_rad_q30);
        scale(health, root_q8 * root_q8, &equations);
        if (equations.determinant_q30 < DETERMINANT_MIN_Q30) {
            return false;
        }
        solve(&equations, out->turn_rad_q30);
        judge(sums, &equations, noise_q12, out);
        prior_rad_q30 = length_rad_q30(health->turn_rad_q30, out->turn_rad_q30);
        prior_rad_q30 = prior_rad_q30 > PRIOR_MIN_RAD_Q30 ? prior_rad_q30 : PRIOR_MIN_RAD_Q30;
    }
    return out->sigma_rad_q30[0] <= SIGMA_MAX_RAD_Q30 &&
           out->sigma_rad_q30[1] <= SIGMA_MAX_RAD_Q30 && out->sigma_rad_q30[2] <= SIGMA_MAX_RAD_Q30;
}

/* Turn the rig; false: beyond the limit, and the rig is as it was. */
static bool turn_to(struct ih_health *health, const int32_t turn_rad_q30[3], struct ih_rig *rig,
                    struct ih_health_scratch *scratch)
{
    int32_t bad_slot;
    for (int i = 0; i < 3; i++) {
        if (ih_abs_s32(turn_rad_q30[i]) > IH_TURN_MAX_RAD_Q30) {
            return false;
        }
    }
    ih_turn_calibration(&health->nominal, turn_rad_q30, &scratch->calibration);
    if (ih_rig_init(&scratch->rig, &scratch->calibration, &bad_slot) != IH_OK) {
        return false; /* a ray turned out of what a rig may have */
    }
    *rig = scratch->rig;
    memcpy(health->turn_rad_q30, turn_rad_q30, sizeof health->turn_rad_q30);
    use_rig(health, rig);
    return true;
}

static bool turn_by(struct ih_health *health, const int32_t by_rad_q30[3], struct ih_rig *rig,
                    struct ih_health_scratch *scratch)
{
    int32_t turn_rad_q30[3];
    for (int i = 0; i < 3; i++) {
        turn_rad_q30[i] = health->turn_rad_q30[i] + by_rad_q30[i];
    }
    return turn_to(health, turn_rad_q30, rig, scratch);
}

static bool is_turned(const struct ih_health *health)
{
    return health->turn_rad_q30[0] != 0 || health->turn_rad_q30[1] != 0 ||
           health->turn_rad_q30[2] != 0;
}

static void begin_stage(struct ih_health *health, enum ih_health_stage stage)
{
    health->stage = stage;
    health->step = 0;
    start_look(health);
}

/* Wrong lines pass by dots as often as right ones, but anywhere within reach of the labels. */
static bool is_lost(const struct ih_health_look *look)
{
    return look->dot_count >= DOTS_MIN * look->frame_count &&
           (look->labelled_count * 5 < look->dot_count ||
            look->across_px_q12 > (int64_t)LOST_ACROSS_PX_Q12 * look->labelled_count);
}

/* Most dots without a label, or labels that are no better than chance; and no search was in vain lately. */
static bool is_search_due(struct ih_health *health)
{
    const struct ih_health_look *look = &health->look;
    health->pause = ih_max_s32(health->pause - 1, 0);
    return health->pause == 0 && look->dot_count >= DOTS_MIN * look->frame_count &&
           (look->labelled_count * 2 < look->dot_count || is_lost(look));
}

static void begin_search(struct ih_health *health)
{
    health->before = health->look;
    memcpy(health->before_rad_q30, health->turn_rad_q30, sizeof health->before_rad_q30);
    memset(&health->votes, 0, sizeof health->votes);
    begin_stage(health, IH_HEALTH_SEARCHING);
}

static void conclude(struct ih_health *health, const struct ih_health_look *look, bool is_known)
{
    if (is_lost(look)) {
        health->state = IH_HEALTH_LOST;
    } else if (is_turned(health)) {
        health->state = IH_HEALTH_TURNED;
    } else if (is_known) {
        health->state = IH_HEALTH_FITS;
    }
}

static bool search(struct ih_health *health, const struct ih_dots *dots, struct ih_rig *rig,
                   struct ih_health_scratch *scratch)
{
    struct ih_turn_winner winner;
    ih_turn_vote(dots, rig, &health->slopes, &scratch->turn, &health->votes);
    health->step++;
    if (health->step < IH_HEALTH_SEARCH) {
        return false;
    }
    ih_turn_elect(&health->votes, rig, &winner);
    bool is_turned_now = (int64_t)winner.vote * 4 > (int64_t)winner.vote_of_none * 5 &&
                         turn_by(health, winner.turn_rad_q30, rig, scratch);
    health->pause = IH_HEALTH_PAUSE;
    begin_stage(health, is_turned_now ? IH_HEALTH_SETTLING : IH_HEALTH_WATCHING);
    return is_turned_now;
}

/* More than chance, and than what does no harm. */
static bool is_significant(const struct estimate *found)
{
    const int32_t none[3] = {0, 0, 0};
    return found->chi2 >= CHI2_MIN && length_rad_q30(found->turn_rad_q30, none) >= TURN_MIN_RAD_Q30;
}

/* The turn as it now seems to be, into state and rig. False: not taken. */
static bool take(struct ih_health *health, const struct estimate *found, struct ih_rig *rig,
                 struct ih_health_scratch *scratch)
{
    int32_t basis_count = health->sums.frame_count;
    memcpy(health->sigma_rad_q30, found->sigma_rad_q30, sizeof health->sigma_rad_q30);
    if (!turn_by(health, found->turn_rad_q30, rig, scratch)) {
        return false;
    }
    health->basis_count = basis_count;
    return true;
}

static bool watch(struct ih_health *health, struct ih_rig *rig, struct ih_health_scratch *scratch)
{
    const struct ih_health_look look = health->look;
    struct estimate found;
    bool has_changed = false;
    if (is_search_due(health)) {
        begin_search(health);
        return false;
    }
    bool is_known = find_turn(health, &found);
    bool is_new = is_known && is_significant(&found);
    bool is_better = is_turned(health) && health->sums.frame_count >= 2 * health->basis_count;
    if (is_new || (is_known && is_better)) {
        has_changed = take(health, &found, rig, scratch);
    } else if (is_known) {
        memcpy(health->sigma_rad_q30, found.sigma_rad_q30, sizeof health->sigma_rad_q30);
    }
    conclude(health, &look, is_known);
    if (is_new && !has_changed) {
        health->state = IH_HEALTH_LOST; /* turned beyond the limit */
    }
    begin_stage(health, is_new && has_changed ? IH_HEALTH_SETTLING : IH_HEALTH_WATCHING);
    health->step = health->stage == IH_HEALTH_SETTLING; /* the first one is a search's */
    forget(&health->sums);
    return has_changed;
}

/* A search's turn has to give labels that are better than chance, and a quarter more than before unless
 * those were not. */
static bool is_proven(const struct ih_health_look *before, const struct ih_health_look *look)
{
    return !is_lost(look) &&
           (is_lost(before) || look->labelled_count * before->frame_count * 4 >=
                                   before->labelled_count * look->frame_count * 5);
}

/* Refine what was taken; or take it back. */
static bool settle(struct ih_health *health, struct ih_rig *rig, struct ih_health_scratch *scratch)
{
    const struct ih_health_look look = health->look;
    struct estimate found;
    if (health->step == 0 && !is_proven(&health->before, &look)) {
        begin_stage(health, IH_HEALTH_WATCHING);
        return turn_to(health, health->before_rad_q30, rig, scratch);
    }
    bool is_known = find_turn(health, &found);
    bool has_changed = is_known && take(health, &found, rig, scratch);
    if (health->step == SETTLE_STEPS - 1) {
        conclude(health, &look, is_known);
        begin_stage(health, IH_HEALTH_WATCHING);
    } else {
        health->step++;
        start_look(health);
    }
    return has_changed;
}

static int32_t look_frames(const struct ih_health *health)
{
    return health->stage == IH_HEALTH_SETTLING ? settle_frames[health->step] : IH_HEALTH_LOOK;
}

bool ih_health_frame(struct ih_health *health, const struct ih_dots *dots,
                     const struct ih_labels *labels, struct ih_rig *rig,
                     struct ih_health_scratch *scratch)
{
    const struct ih_health_look *look = &health->look;
    if (health->stage == IH_HEALTH_SEARCHING) {
        return search(health, dots, rig, scratch);
    }
    add_frame(health, dots, labels);
    if (look->frame_count < look_frames(health)) {
        return false;
    }
    health->dot_count = look->dot_count;
    health->labelled_count = look->labelled_count;
    health->across_px_q12 = look->labelled_count == 0
                                ? -1
                                : (int32_t)ih_div_round(look->across_px_q12, look->labelled_count);
    return health->stage == IH_HEALTH_WATCHING ? watch(health, rig, scratch)
                                               : settle(health, rig, scratch);
}
