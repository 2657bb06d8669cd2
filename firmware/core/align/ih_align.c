#include "align/ih_align.h"

#include <stddef.h>
#include <string.h>

#include "align/ih_align_sigma.h"
#include "base/ih_fix.h"

#define DOTS_MIN 30   /* fewer say nothing */
#define LABELS_MIN 16 /* as few labels */
/* Of dots on the lines. Before a wall beyond the working range one of ten gets a label, of another slot. */
#define LABELS_DIVISOR 4
/* A dot on its line, and those beside it that are not: the ring is twice as wide as the line. */
#define ON_PX_Q12 1229          /* 0.3 px */
#define BESIDE_FROM_PX_Q12 2458 /* 0.6 px */
#define BESIDE_TO_PX_Q12 4915   /* 1.2 px */
#define FRAMES_MAX 16           /* of the mean; from then on older ones fade */
#define FRAMES_WHOLE 4          /* are taken whole; of later ones every second slot is enough */
#define NEAR_PX_Q12 205         /* 0.05 px: a fit that moves dots by less needs no second step */
/* The rig is moved when the mean says so by more than this (root mean square over the dots). */
#define MOVE_FIRST_PX_Q12 410 /* 0.1 px: labels hold up to there */
#define MOVE_PX_Q12 205       /* 0.05 px, once it has moved */
#define DEPTH_SIGMAS 1
#define DEPTH_RAD_Q30 187402 /* 0.01 degrees, once it has moved */
/* A frame that differs from the mean by more than this starts it anew. */
#define KNOCK_PX_Q12 1229          /* 0.3 px */
#define KNOCK_DEPTH_RAD_Q30 937007 /* 0.05 degrees */
#define KNOCK_SIGMAS 5
/* Depths from before such a change are of no use. */
#define DEPTH_NEW_RAD_Q30 937007 /* 0.05 degrees */
/* Beyond this a rig has not moved but is another one. */
#define ROTATION_MAX_RAD_Q30 28110244 /* 1.5 degrees */
/* 0.8 degrees. Wrong motions ask for much depth, and learn more of it from their own labels. */
#define DEPTH_MAX_RAD_Q30 14992130
#define FOCAL_MAX_Q30 16106127 /* 1.5 % */
#define MARGIN_PX_Q12 (4 * 4096)
/* So far beyond the range a rotation of depth may put dots. With 4 px it is found frames later, with 10 px right rigs move. */
#define FAR_MARGIN_PX_Q12 (7 * 4096)
/* At first so many of the dots must lie on the lines that nobody searches; later three quarters of what was the
 * best since a search. */
#define TRUSTED_FIRST_Q8 160
/* Or so many lie on the lines, and two fifths as many beside them at most: the ring is twice as wide, so a fifth of those
 * on the lines are there by chance. */
#define CLEAR_MIN 64
/* After so many searches in vain a pause grows by a frame. */
#define VAIN_FRAMES 4
#define PAUSE_MAX 8
/* So long what a search found is questioned, in every frame; then an eighth more dots are enough, not a quarter. */
#define UNSETTLED_FRAMES_MAX 16

static bool is_none(const int32_t moved_px_q12[IH_ALIGN_AXES])
{
    static const int32_t none[IH_ALIGN_AXES];
    return memcmp(moved_px_q12, none, sizeof none) == 0;
}

static enum ih_align_state state_of(const struct ih_align *align)
{
    return is_none(align->moved_px_q12) ? IH_ALIGN_FITS : IH_ALIGN_MOVED;
}

/* The rig's lines where the five numbers say. */
static void move_rig(struct ih_align *align, const int32_t moved_px_q12[IH_ALIGN_AXES],
                     struct ih_rig *rig)
{
    const int64_t along = ih_align_rad_q30(moved_px_q12[IH_ALIGN_BASELINE], rig);
    const int64_t depth = ih_align_rad_q30(moved_px_q12[IH_ALIGN_DEPTH], rig);
    const int64_t shift = moved_px_q12[IH_ALIGN_SHIFT];
    const int32_t *e = align->axes.along_q14;
    struct ih_alignment *now = &align->now;
    memcpy(align->moved_px_q12, moved_px_q12, sizeof align->moved_px_q12);
    now->rotation_rad_q30[0] = (int32_t)ih_shift_round(along * e[0] - depth * e[1], 14);
    now->rotation_rad_q30[1] = (int32_t)ih_shift_round(along * e[1] + depth * e[0], 14);
    now->rotation_rad_q30[2] = ih_align_rad_q30(moved_px_q12[IH_ALIGN_ROLL], rig);
    now->focal_q30 = ih_align_rad_q30(moved_px_q12[IH_ALIGN_FOCAL], rig);
    now->shift_px_q12[0] = (int32_t)ih_shift_round(-shift * e[1], 14);
    now->shift_px_q12[1] = (int32_t)ih_shift_round(shift * e[0], 14);
    struct ih_rig_motion motion = {.focal_q30 = now->focal_q30};
    memcpy(motion.rotation_rad_q30, now->rotation_rad_q30, sizeof motion.rotation_rad_q30);
    memcpy(motion.shift_px_q12, now->shift_px_q12, sizeof motion.shift_px_q12);
    ih_rig_move(rig, align->ray_q30, &motion);
}

void ih_align_init(struct ih_align *align, const struct ih_rig *rig)
{
    memset(align, 0, sizeof *align);
    memcpy(align->ray_q30, rig->calibration.ray_q30, sizeof align->ray_q30);
    ih_align_axes(rig, &align->axes);
    ih_align_prior(rig, align->prior_px_q12);
    align->now.across_px_q12 = -1;
    align->trusted_q8 = TRUSTED_FIRST_Q8;
}

/* So much that chance is no explanation. */
static int32_t excess_min(int32_t dot_count)
{
    return 12 + dot_count / 8;
}

/* How many dots lie on the rig's lines, and beside them; of these, how many near the working range. */
struct sight {
    int32_t on, beside;
    int32_t near_on, near_beside;
};

/* More than chance puts there. */
static int32_t excess_of(int32_t on, int32_t beside)
{
    return on - beside / 2;
}

static void judge(struct ih_align_dot dot, int32_t far_px_q12, struct sight *sight)
{
    const int32_t off = ih_abs_s32(dot.across_px_q12);
    const bool is_on = off < ON_PX_Q12;
    const bool is_beside = off > BESIDE_FROM_PX_Q12 && off < BESIDE_TO_PX_Q12;
    const bool is_near = dot.along_px_q12 >= far_px_q12;
    sight->on += is_on;
    sight->beside += is_beside;
    sight->near_on += is_on && is_near;
    sight->near_beside += is_beside && is_near;
}

/* At every step-th slot, and as if the others were like these. */
static struct sight look(const struct ih_dot_rows *rows, const struct ih_rig *rig, int32_t step)
{
    const struct ih_align_band band = {BESIDE_TO_PX_Q12, MARGIN_PX_Q12};
    struct sight sight = {0, 0, 0, 0};
    int32_t first = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot += step) {
        struct ih_align_dot dot[IH_ALIGN_NEAR_MAX];
        const int32_t count = ih_align_near(rows, &rig->line[slot], band, &first, dot);
        const int32_t far_px_q12 = rig->line[slot].t_far_px_q12 - FAR_MARGIN_PX_Q12;
        for (int32_t i = 0; i < count; i++) {
            judge(dot[i], far_px_q12, &sight);
        }
    }
    sight.on *= step;
    sight.beside *= step;
    sight.near_on *= step;
    sight.near_beside *= step;
    return sight;
}

static bool is_clear(struct sight sight)
{
    return sight.on >= CLEAR_MIN && sight.beside * 5 <= sight.on * 2;
}

/* Are dots on the lines as they were, or so many that they can be on no others? */
static bool is_where_it_was(const struct ih_align *align, struct sight sight, int32_t dot_count)
{
    const int32_t excess = excess_of(sight.on, sight.beside);
    const bool is_as_before = excess * 256 / dot_count >= align->trusted_q8 * 3 / 4;
    return (is_clear(sight) || is_as_before) && excess >= excess_min(dot_count);
}

/* What is less than its uncertainty says nothing of depth. A rig that has moved needs less than one that fits. */
static bool is_depth_seen(const struct ih_align *align, int32_t depth_px_q12,
                          int32_t depth_sigma_px_q12, const struct ih_rig *rig)
{
    const bool is_first = state_of(align) == IH_ALIGN_FITS;
    const int32_t min_px_q12 =
        ih_align_px_q12(is_first ? IH_ALIGN_DEPTH_MIN_RAD_Q30 : DEPTH_RAD_Q30, rig);
    const int32_t sigmas = is_first ? IH_ALIGN_DEPTH_SIGMAS : DEPTH_SIGMAS;
    return ih_abs_s32(depth_px_q12) > ih_max_s32(sigmas * depth_sigma_px_q12, min_px_q12);
}

static bool is_within_limits(const int32_t moved_px_q12[IH_ALIGN_AXES], const struct ih_rig *rig)
{
    bool is_within = true;
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        const int32_t max_q30 = k == IH_ALIGN_FOCAL   ? FOCAL_MAX_Q30
                                : k == IH_ALIGN_DEPTH ? DEPTH_MAX_RAD_Q30
                                                      : ROTATION_MAX_RAD_Q30;
        is_within = is_within && ih_abs_s32(ih_align_rad_q30(moved_px_q12[k], rig)) <= max_q30;
    }
    return is_within;
}

static void forget(struct ih_align *align)
{
    memset(&align->mean, 0, sizeof align->mean);
    align->frame_count = 0;
}

/* Of depth; then tracks are of no use. */
static void note_change(struct ih_align *align, int32_t before_px_q12, const struct ih_rig *rig)
{
    const int64_t change = (int64_t)align->moved_px_q12[IH_ALIGN_DEPTH] - before_px_q12;
    align->is_depth_new =
        align->is_depth_new || ih_abs_s64(change) > ih_align_px_q12(DEPTH_NEW_RAD_Q30, rig);
}

/* Where a rig that has moved would put its lines: is that better? If not, they go back. Returns the excess. */
static int32_t try_motion(struct ih_align *align, const struct ih_dots *dots,
                          const int32_t moved_px_q12[IH_ALIGN_AXES], int32_t excess_wanted,
                          struct ih_rig *rig, struct ih_dot_rows *rows)
{
    int32_t before_px_q12[IH_ALIGN_AXES];
    memcpy(before_px_q12, align->moved_px_q12, sizeof before_px_q12);
    move_rig(align, moved_px_q12, rig);
    ih_dot_rows_fill(dots, rig, rows);
    const struct sight sight = look(rows, rig, 1);
    const int32_t excess = excess_of(sight.on, sight.beside);
    if (excess >= excess_wanted) {
        align->excess = excess;
        align->near_excess = excess_of(sight.near_on, sight.near_beside);
        return excess;
    }
    move_rig(align, before_px_q12, rig);
    ih_dot_rows_fill(dots, rig, rows);
    return 0;
}

/* Around the rig file's lines. Where that gives no more than the rig's lines gave, they stay. Returns the excess. */
static int32_t search(struct ih_align *align, const struct ih_dots *dots, int32_t excess_before,
                      struct ih_rig *rig, struct ih_dot_rows *rows,
                      struct ih_align_scratch *scratch)
{
    static const int32_t none[IH_ALIGN_AXES];
    int32_t before_px_q12[IH_ALIGN_AXES];
    const int32_t more = excess_before / (align->unsettled_frames > 0 ? 8 : 4) + 1;
    const int32_t enough = ih_max_s32(excess_min(rows->dot_count), excess_before + more);
    const int32_t trusted = rows->dot_count * align->trusted_q8 * 3 / 4 / 256;
    const int32_t near_excess_before = align->near_excess;
    memcpy(before_px_q12, align->moved_px_q12, sizeof before_px_q12);
    int32_t excess =
        is_none(before_px_q12) ? 0 : try_motion(align, dots, none, INT32_MIN, rig, rows);
    if (excess < ih_max_s32(enough, trusted)) {
        int32_t moved_px_q12[IH_ALIGN_AXES];
        excess = 0;
        if (ih_align_search(&align->axes, align->prior_px_q12, rig, rows, scratch, moved_px_q12) &&
            is_within_limits(moved_px_q12, rig)) {
            excess = try_motion(align, dots, moved_px_q12, enough, rig, rows);
        }
    }
    if (excess >= enough) {
        if (align->unsettled_frames == 0) {
            memcpy(align->settled_px_q12, before_px_q12, sizeof before_px_q12);
        }
        align->unsettled_frames = 1;
        note_change(align, before_px_q12[IH_ALIGN_DEPTH], rig);
        forget(align);
        return excess;
    }
    if (!is_none(before_px_q12)) { /* else the lines are back already */
        move_rig(align, before_px_q12, rig);
        ih_dot_rows_fill(dots, rig, rows);
    }
    align->near_excess = near_excess_before;
    return excess_before;
}

/* A wrong motion may have had the most dots in the one frame that was searched, and fits the labels that it makes; in other
 * frames the right one has more. Unless dots can be on no other lines: back to the motion before? If not, another search
 * is due. */
static bool question(struct ih_align *align, const struct ih_dots *dots, struct ih_rig *rig,
                     struct ih_dot_rows *rows)
{
    const struct sight sight = look(rows, rig, 1);
    align->excess = excess_of(sight.on, sight.beside);
    align->near_excess = excess_of(sight.near_on, sight.near_beside);
    if (align->unsettled_frames > UNSETTLED_FRAMES_MAX || is_clear(sight)) {
        align->unsettled_frames = 0;
        return false;
    }
    /* Not 0 yet: what this frame's search finds is compared with the same motion. */
    align->unsettled_frames++;
    const int32_t before_px_q12 = align->moved_px_q12[IH_ALIGN_DEPTH];
    const int32_t enough = ih_max_s32(excess_min(rows->dot_count), align->excess);
    if (try_motion(align, dots, align->settled_px_q12, enough, rig, rows) > 0) {
        align->unsettled_frames = 0;
        align->trusted_q8 = 0;
        note_change(align, before_px_q12, rig);
        forget(align);
        return false;
    }
    return true;
}

/* Labels are short where dots lie on their lines and not far beyond the working range: a rotation of depth that no plane
 * shows. False: it is not that. */
static bool search_depth(struct ih_align *align, const struct ih_dots *dots, struct ih_rig *rig,
                         struct ih_dot_rows *rows, struct ih_align_scratch *scratch)
{
    int32_t moved_px_q12[IH_ALIGN_AXES];
    const int32_t before_px_q12 = align->moved_px_q12[IH_ALIGN_DEPTH];
    if (!ih_align_search_depth(&align->axes, align->prior_px_q12, rig, rows, scratch,
                               moved_px_q12)) {
        return false;
    }
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        moved_px_q12[k] += align->moved_px_q12[k];
    }
    const int32_t enough = ih_max_s32(excess_min(rows->dot_count), align->excess);
    const bool is_depth = is_within_limits(moved_px_q12, rig) &&
                          try_motion(align, dots, moved_px_q12, enough, rig, rows) > 0;
    if (is_depth) {
        note_change(align, before_px_q12, rig);
        forget(align);
    }
    return is_depth;
}

/* The first searches that find nothing follow each other; later there are up to PAUSE_MAX frames between them. */
static void pause_search(struct ih_align *align)
{
    if (align->pause < 0) {
        align->vain_count = ih_min_s32(align->vain_count + 1, PAUSE_MAX * VAIN_FRAMES);
        align->pause = align->vain_count / VAIN_FRAMES;
    }
}

void ih_align_find(struct ih_align *align, const struct ih_dots *dots, struct ih_rig *rig,
                   struct ih_dot_rows *rows, struct ih_align_scratch *scratch)
{
    ih_dot_rows_fill(dots, rig, rows);
    if (rows->dot_count < DOTS_MIN) {
        align->excess = 0;
        align->near_excess = 0;
        return;
    }
    struct sight sight = look(rows, rig, 2);
    if (!is_where_it_was(align, sight, rows->dot_count)) {
        sight = look(rows, rig, 1);
    }
    align->excess = excess_of(sight.on, sight.beside);
    align->near_excess = excess_of(sight.near_on, sight.near_beside);
    const bool is_doubtful = align->is_short && align->now.state != IH_ALIGN_LOST;
    const bool is_depth = is_doubtful && search_depth(align, dots, rig, rows, scratch);
    bool is_due = false;
    if (!is_depth && !is_where_it_was(align, sight, rows->dot_count)) {
        align->pause--;
        is_due = align->pause < 0;
    } else if (!is_depth && align->unsettled_frames > 0) {
        is_due = question(align, dots, rig, rows);
    }
    if (is_due) {
        align->excess = search(align, dots, align->excess, rig, rows, scratch);
        align->trusted_q8 = 0;
    }
    align->trusted_q8 = ih_max_s32(align->trusted_q8, align->excess * 256 / rows->dot_count);
    if (align->excess >= excess_min(rows->dot_count)) {
        align->now.state = state_of(align);
        align->vain_count = 0;
        align->pause = 0;
    } else {
        align->now.state = IH_ALIGN_LOST;
        pause_search(align);
    }
}

/* Labelled dots as pairs, and how far they lie from their lines in the mean. After the first frames every second slot is
 * enough. */
static void take_labels(struct ih_align *align, const struct ih_labels *labels,
                        const struct ih_rig *rig, struct ih_align_pairs *out)
{
    const bool is_half = align->frame_count >= FRAMES_WHOLE;
    int32_t sum = 0, count = 0;
    align->odd = is_half ? 1 - align->odd : 0;
    out->count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (labels->dot_of_slot[slot] != IH_NONE) {
            sum += ih_abs_s32(labels->perp_px_q12[slot]);
            count++;
            if (!is_half || slot % 2 == align->odd) {
                struct ih_align_pair *pair = &out->pair[out->count++];
                ih_align_slopes(rig, &align->axes, slot, pair->slope_q12);
                pair->across_px_q12 = labels->perp_px_q12[slot];
            }
        }
    }
    align->now.across_px_q12 = count == 0 ? -1 : (sum + count / 2) / count;
}

/* Sums of a frame are of what its labels leave; those of the mean are of all that the rig has moved by. */
static void add_moved(struct ih_align_sums *frame, const int32_t moved_px_q12[IH_ALIGN_AXES])
{
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        for (int l = 0; l < IH_ALIGN_AXES; l++) {
            frame->right_px_q24[k] +=
                ih_mul_shift(ih_align_entry(frame, k, l), moved_px_q12[l], 12);
        }
    }
}

static void add_frame(struct ih_align *align, const struct ih_align_sums *frame)
{
    struct ih_align_sums *mean = &align->mean;
    align->frame_count = ih_min_s32(align->frame_count + 1, FRAMES_MAX);
    for (int i = 0; i < IH_ALIGN_ENTRIES; i++) {
        mean->normal_q24[i] += (frame->normal_q24[i] - mean->normal_q24[i]) / align->frame_count;
    }
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        mean->right_px_q24[k] +=
            (frame->right_px_q24[k] - mean->right_px_q24[k]) / align->frame_count;
    }
}

/* What the frames so far say. */
static void solve_mean(const struct ih_align *align, const struct ih_align_sums *mean,
                       int32_t mean_px_q12[IH_ALIGN_AXES], int32_t sigma_px_q12[IH_ALIGN_AXES])
{
    const uint32_t noise2 = IH_ALIGN_NOISE_PX_Q12 * IH_ALIGN_NOISE_PX_Q12;
    const int32_t noise_px_q12 =
        (int32_t)ih_isqrt_u32(noise2 / (uint32_t)ih_max_s32(align->frame_count, 1));
    ih_align_solve(mean, align->prior_px_q12, noise_px_q12, mean_px_q12, sigma_px_q12);
}

/* Does a frame say something else than those before? */
static bool is_knock(const struct ih_align *align, const struct ih_align_sums *frame,
                     const int32_t frame_px_q12[IH_ALIGN_AXES],
                     const int32_t frame_sigma_px_q12[IH_ALIGN_AXES], const struct ih_rig *rig)
{
    int32_t mean_px_q12[IH_ALIGN_AXES], sigma_px_q12[IH_ALIGN_AXES];
    int32_t difference_px_q12[IH_ALIGN_AXES];
    solve_mean(align, &align->mean, mean_px_q12, sigma_px_q12);
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        difference_px_q12[k] = frame_px_q12[k] + align->moved_px_q12[k] - mean_px_q12[k];
    }
    const int64_t a = frame_sigma_px_q12[IH_ALIGN_DEPTH], b = sigma_px_q12[IH_ALIGN_DEPTH];
    const int32_t depth_px_q12 = ih_abs_s32(difference_px_q12[IH_ALIGN_DEPTH]);
    return ih_align_rms_px_q12(frame, difference_px_q12) > KNOCK_PX_Q12 ||
           (depth_px_q12 > ih_align_px_q12(KNOCK_DEPTH_RAD_Q30, rig) &&
            depth_px_q12 > KNOCK_SIGMAS * (int64_t)ih_isqrt_u64((uint64_t)(a * a + b * b)));
}

/* Is the mean so far from the rig's lines that they move? Depth stays where dots do not show it; then the others are what
 * they are with that. */
static bool is_to_move(const struct ih_align *align, const struct ih_align_sums *frame,
                       const struct ih_rig *rig, int32_t depth_sigma_px_q12,
                       int32_t mean_px_q12[IH_ALIGN_AXES])
{
    int32_t difference_px_q12[IH_ALIGN_AXES];
    struct ih_align_sums held;
    if (is_depth_seen(align, mean_px_q12[IH_ALIGN_DEPTH] - align->moved_px_q12[IH_ALIGN_DEPTH],
                      depth_sigma_px_q12, rig)) {
        return true;
    }
    held = align->mean;
    ih_align_sums_hold(&held, IH_ALIGN_DEPTH, align->moved_px_q12[IH_ALIGN_DEPTH]);
    solve_mean(align, &held, mean_px_q12, NULL);
    for (int k = 0; k < IH_ALIGN_AXES; k++) {
        difference_px_q12[k] = mean_px_q12[k] - align->moved_px_q12[k];
    }
    return ih_align_rms_px_q12(frame, difference_px_q12) >
           (state_of(align) == IH_ALIGN_FITS ? MOVE_FIRST_PX_Q12 : MOVE_PX_Q12);
}

/* What the labels of a frame say. Where they lie near their lines, one step is enough. */
static void fit_frame(const struct ih_align *align, const struct ih_align_pairs *pairs,
                      struct ih_align_sums *frame, int32_t frame_px_q12[IH_ALIGN_AXES],
                      int32_t sigma_px_q12[IH_ALIGN_AXES])
{
    memset(frame_px_q12, 0, IH_ALIGN_AXES * sizeof *frame_px_q12);
    ih_align_step(pairs, align->prior_px_q12, IH_ALIGN_FIRST_SCALE_PX_Q12, frame, frame_px_q12,
                  sigma_px_q12);
    if (ih_align_rms_px_q12(frame, frame_px_q12) > NEAR_PX_Q12) {
        ih_align_step(pairs, align->prior_px_q12, IH_ALIGN_SCALE_PX_Q12, frame, frame_px_q12,
                      sigma_px_q12);
    }
}

/* A mean that is hardly anything is nothing: the rig fits again. */
static void round_to_file(const struct ih_align *align, const struct ih_align_sums *frame,
                          const struct ih_rig *rig, int32_t mean_px_q12[IH_ALIGN_AXES])
{
    if (state_of(align) == IH_ALIGN_MOVED &&
        ih_abs_s32(mean_px_q12[IH_ALIGN_DEPTH]) < ih_align_px_q12(DEPTH_RAD_Q30, rig) &&
        ih_align_rms_px_q12(frame, mean_px_q12) < MOVE_PX_Q12) {
        memset(mean_px_q12, 0, IH_ALIGN_AXES * sizeof *mean_px_q12);
    }
}

void ih_align_learn(struct ih_align *align, const struct ih_labels *labels, struct ih_rig *rig,
                    struct ih_align_scratch *scratch)
{
    struct ih_align_pairs *pairs = &scratch->at.pairs;
    struct ih_align_sums frame;
    int32_t frame_px_q12[IH_ALIGN_AXES], mean_px_q12[IH_ALIGN_AXES];
    int32_t sigma_px_q12[IH_ALIGN_AXES], next_px_q12[IH_ALIGN_AXES];
    align->is_short = 4 * labels->labelled_count < 3 * align->near_excess;
    if (align->is_short) {
        align->now.is_depth_known = false;
        align->now.depth_sigma_rad_q30 =
            ih_max_s32(align->now.depth_sigma_rad_q30,
                       ih_align_rad_q30(align->prior_px_q12[IH_ALIGN_DEPTH], rig));
    }
    take_labels(align, labels, rig, pairs);
    if (pairs->count < LABELS_MIN || align->now.state == IH_ALIGN_LOST || align->excess == 0 ||
        LABELS_DIVISOR * labels->labelled_count < align->excess) {
        return;
    }
    const bool was_depth_new = align->is_depth_new;
    fit_frame(align, pairs, &frame, frame_px_q12, sigma_px_q12);
    if (align->frame_count > 0 && is_knock(align, &frame, frame_px_q12, sigma_px_q12, rig)) {
        forget(align);
    }
    add_moved(&frame, align->moved_px_q12);
    add_frame(align, &frame);
    solve_mean(align, &align->mean, mean_px_q12, sigma_px_q12);
    memcpy(next_px_q12, mean_px_q12, sizeof next_px_q12);
    const bool is_moving =
        is_to_move(align, &frame, rig, sigma_px_q12[IH_ALIGN_DEPTH], next_px_q12);
    if (is_within_limits(next_px_q12, rig)) {
        const int32_t before_px_q12 = align->moved_px_q12[IH_ALIGN_DEPTH];
        round_to_file(align, &frame, rig, next_px_q12);
        if (is_moving || is_none(next_px_q12)) {
            move_rig(align, next_px_q12, rig);
        }
        note_change(align, before_px_q12, rig);
        align->now.state = state_of(align);
    }
    ih_align_set_sigma(align, mean_px_q12, sigma_px_q12, rig);
    if (align->is_depth_new && !was_depth_new) {
        forget(align); /* labels were of another depth, and fewer */
    }
}
