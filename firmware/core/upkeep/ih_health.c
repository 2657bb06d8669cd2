#include "upkeep/ih_health.h"

#include <string.h>

#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "base/ih_types.h"

/* A rig is lost when so many dots are seen in a frame, but hardly any is labelled, or their mean distance
 * is that of any place within reach of the labels: 0.3 px. */
#define DOTS_MIN 60
#define LOST_ACROSS_PX_Q12 1024 /* 0.25 px */
/* Labels that may be wrong all together: those of a right turn lie 0.08 to 0.13 px from their lines, of
 * wrong ones that searches came to 0.2 px. Such a search is repeated with other frames. */
#define POOR_ACROSS_PX_Q12 655 /* 0.16 px */
#define SEARCHES_MAX 3
/* Looks until a search that was in vain is repeated: twice as many each time, up to IH_HEALTH_PAUSE. */
#define PAUSE_FIRST 1
/* A turn that is worth a correction. */
#define ROTATION_MIN_RAD_Q30 374802 /* 0.02 degrees */
/* Frames of each step of settling. Dots farther from their line than reach say nothing about a turn. */
#define SETTLE_STEPS 3
static const int32_t settle_frames[SETTLE_STEPS] = {4, 4, 24};
/* What another search takes, which the last step then has less, down to a look: a rotation is reported after 41 frames, with
 * two more searches 45. */
#define SEARCH_AGAIN_FRAMES (IH_HEALTH_SEARCH + 4 + 4)
static const int32_t settle_reach_px_q12[SETTLE_STEPS] = {4915, 2458, 1229};
#define REACH_PX_Q12 1229 /* 0.3 px */

static void start_look(struct ih_health *health)
{
    health->look = (struct ih_health_look){.frame_count = 0};
}

/* Nothing that was seen before counts any more. */
static void start_over(struct ih_health *health)
{
    ih_rotation_estimate_clear(&health->all);
    ih_rotation_estimate_clear(&health->now.late);
    health->is_doubted = false;
    start_look(health);
}

void ih_health_init(struct ih_health *health, const struct ih_rig *rig)
{
    memset(health, 0, sizeof *health);
    health->nominal = rig->calibration;
    health->across_px_q12 = -1;
    health->next_pause = PAUSE_FIRST;
    ih_rotation_vote_slopes(rig, &health->slopes);
    start_over(health);
}

static void add_look(struct ih_health_look *look, const struct ih_dots *dots,
                     const struct ih_labels *labels)
{
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        if (labels->dot_of_slot[slot] != IH_NONE) {
            look->across_px_q12 += ih_abs_s32(labels->perp_px_q12[slot]);
        }
    }
    look->dot_count += dots->dot_count;
    look->labelled_count += labels->labelled_count;
    look->frame_count++;
}

/* What a search's turn shows is apart until it is proven. */
static void add_frame(struct ih_health *health, const struct ih_dots *dots,
                      const struct ih_labels *labels, const struct ih_rig *rig)
{
    bool is_settling = health->stage == IH_HEALTH_SETTLING;
    int32_t reach_px_q12 = is_settling ? settle_reach_px_q12[health->step] : REACH_PX_Q12;
    add_look(&health->look, dots, labels);
    ih_rotation_estimate_add(&health->now.late, labels, rig, &health->slopes, reach_px_q12);
    if (!is_settling || health->step > 0) {
        ih_rotation_estimate_add(&health->all, labels, rig, &health->slopes, reach_px_q12);
    }
}

/* Turn the rig; false: beyond the limit, and the rig is as it was. */
static bool rotate_to(struct ih_health *health, const int32_t rotation_rad_q30[3],
                      struct ih_rig *rig, struct ih_health_scratch *scratch)
{
    int32_t bad_slot;
    for (int i = 0; i < 3; i++) {
        if (ih_abs_s32(rotation_rad_q30[i]) > IH_ROTATION_VOTE_MAX_RAD_Q30) {
            return false;
        }
    }
    ih_rotation_vote_calibration(&health->nominal, rotation_rad_q30, &scratch->calibration);
    if (ih_rig_init(&scratch->rig, &scratch->calibration, &bad_slot) != IH_OK) {
        return false; /* a ray turned out of what a rig may have */
    }
    *rig = scratch->rig;
    memcpy(health->rotation_rad_q30, rotation_rad_q30, sizeof health->rotation_rad_q30);
    ih_rotation_vote_slopes(rig, &health->slopes);
    return true;
}

static bool rotate_by(struct ih_health *health, const int32_t by_rad_q30[3], struct ih_rig *rig,
                      struct ih_health_scratch *scratch)
{
    int32_t rotation_rad_q30[3];
    for (int i = 0; i < 3; i++) {
        rotation_rad_q30[i] = health->rotation_rad_q30[i] + by_rad_q30[i];
    }
    return rotate_to(health, rotation_rad_q30, rig, scratch);
}

static bool is_rotated(const struct ih_health *health)
{
    return health->rotation_rad_q30[0] != 0 || health->rotation_rad_q30[1] != 0 ||
           health->rotation_rad_q30[2] != 0;
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

static bool is_poor(const struct ih_health_look *look)
{
    return look->across_px_q12 > (int64_t)POOR_ACROSS_PX_Q12 * look->labelled_count;
}

/* Lost now, or a quarter less labels among the dots. */
static bool is_worse(const struct ih_health_look *look, const struct ih_health_look *before)
{
    return (is_lost(look) && !is_lost(before)) || look->labelled_count * before->dot_count * 4 <
                                                      before->labelled_count * look->dot_count * 3;
}

/* Most dots without a label, or poor labels; and no search was in vain lately when things were as they are. */
static bool is_search_due(struct ih_health *health)
{
    const struct ih_health_look *look = &health->look;
    bool is_needed = look->dot_count >= DOTS_MIN * look->frame_count &&
                     (look->labelled_count * 2 < look->dot_count || is_poor(look));
    bool is_other = !is_needed || is_worse(look, &health->before);
    health->pause = is_other ? 0 : ih_max_s32(health->pause - 1, 0);
    health->next_pause = is_other ? PAUSE_FIRST : health->next_pause;
    return is_needed && health->pause == 0;
}

static void begin_search(struct ih_health *health)
{
    health->search_count++;
    memcpy(health->before_rad_q30, health->rotation_rad_q30, sizeof health->before_rad_q30);
    health->before_basis_count = health->basis_count;
    health->was_weak_known = health->is_weak_known;
    memset(&health->now.votes, 0, sizeof health->now.votes);
    begin_stage(health, IH_HEALTH_SEARCHING);
}

/* A search was in vain: what was known before it holds. */
static void give_up(struct ih_health *health)
{
    ih_rotation_estimate_clear(&health->now.late);
    health->pause = health->next_pause;
    health->next_pause = ih_min_s32(2 * health->next_pause, IH_HEALTH_PAUSE);
    begin_stage(health, IH_HEALTH_WATCHING);
}

static void conclude(struct ih_health *health, const struct ih_health_look *look, bool is_known)
{
    if (is_lost(look)) {
        health->state = IH_HEALTH_LOST;
    } else if (is_rotated(health)) {
        health->state = IH_HEALTH_ROTATED;
    } else if (is_known) {
        health->state = IH_HEALTH_FITS;
    }
}

/* Chance gives every turn its votes, with a wide baseline half of what the right one has. The winner needs three
 * quarters more than the mean; and of what is beyond the mean half more than no turn has: chance in sunlight gives a
 * quarter more. Where labels are poor or hardly there, there is nothing to keep, and rigs that fit give a fortieth
 * more: an eighth, as to a rig turned by a step, or by 0.5 px, no turn still gives four fifths of the winner's votes.
 * Where a search is repeated, any more. */
static bool is_elected(const struct ih_rotation_vote_winner *winner,
                       const struct ih_health_look *look, int32_t search_count)
{
    int32_t min = search_count > 1 ? 8 : is_poor(look) || is_lost(look) ? 9 : 12;
    return winner->vote * 4 > winner->vote_mean * 7 &&
           (winner->vote - winner->vote_mean) * 8 >
               (winner->vote_of_none - winner->vote_mean) * min;
}

/* The turn that most votes are for goes on trial. The frames of the votes say what it has to be better than: the
 * last look may have begun before a knock. */
static bool elect(struct ih_health *health, struct ih_rig *rig, struct ih_health_scratch *scratch)
{
    struct ih_rotation_vote_winner winner;
    ih_rotation_vote_elect(&health->now.votes, rig, &winner);
    bool is_rotated_now = is_elected(&winner, &health->look, health->search_count) &&
                          rotate_by(health, winner.rotation_rad_q30, rig, scratch);
    health->before = health->look;
    health->is_weak_known = health->is_weak_known && !is_rotated_now;
    health->basis_count = is_rotated_now ? 0 : health->basis_count;
    ih_rotation_estimate_clear(&health->now.late);
    if (is_rotated_now) {
        begin_stage(health, IH_HEALTH_SETTLING);
    } else {
        give_up(health);
    }
    return is_rotated_now;
}

static bool search(struct ih_health *health, const struct ih_dots *dots,
                   const struct ih_labels *labels, struct ih_rig *rig,
                   struct ih_health_scratch *scratch)
{
    add_look(&health->look, dots, labels);
    ih_rotation_vote_vote(dots, rig, &health->slopes, &scratch->at.rotation, &health->now.votes);
    health->step++;
    return health->step >= IH_HEALTH_SEARCH && elect(health, rig, scratch);
}

static bool find(const struct ih_health *health, const struct ih_rig *rig,
                 struct ih_rotation_estimate_result *out)
{
    return ih_rotation_estimate_find(&health->all, rig, &health->slopes, health->rotation_rad_q30,
                                     health->is_weak_known, out);
}

/* Uncertainties. Of a turn across the baseline that is not seen: as they were when it was, else the limit. */
static void keep_sigma(struct ih_health *health, const struct ih_rig *rig,
                       const struct ih_rotation_estimate_result *found)
{
    int32_t axis_q30[2][2];
    ih_rotation_vote_axes(rig, axis_q30);
    health->is_weak_known = health->is_weak_known || found->is_weak_seen;
    for (int i = 0; i < 3; i++) {
        int64_t component_q30 = i < 2 ? ih_abs_s32(axis_q30[1][i]) : 0;
        int32_t min = health->is_weak_known
                          ? health->sigma_rad_q30[i]
                          : (int32_t)ih_mul_shift(IH_ROTATION_VOTE_MAX_RAD_Q30, component_q30, 30);
        health->sigma_rad_q30[i] = found->is_weak_seen ? found->sigma_rad_q30[i]
                                                       : ih_max_s32(found->sigma_rad_q30[i], min);
    }
}

/* The turn as it now seems to be, into state and rig; what was seen stays, against the new lines.
 * False: not taken. */
static bool take(struct ih_health *health, const struct ih_rotation_estimate_result *found,
                 struct ih_rig *rig, struct ih_health_scratch *scratch)
{
    ih_rotation_estimate_rotate(&health->all, &health->slopes, found->rotation_rad_q30);
    ih_rotation_estimate_rotate(&health->now.late, &health->slopes, found->rotation_rad_q30);
    if (!rotate_by(health, found->rotation_rad_q30, rig, scratch)) {
        start_over(health);
        return false;
    }
    keep_sigma(health, rig, found);
    health->basis_count = health->all.frame_count;
    return true;
}

/* More than chance, and than what does no harm. */
static bool is_worth_it(const struct ih_rotation_estimate_result *found)
{
    return found->sure_rad_q30 >= ROTATION_MIN_RAD_Q30;
}

/* Two looks one after the other both differ surely from what was seen before: from now on the second alone
 * counts. Dots' noise is another in each look, so that chance does not do it twice. */
static bool is_knocked(struct ih_health *health, const struct ih_rig *rig,
                       struct ih_health_scratch *scratch)
{
    struct ih_rotation_estimate_result change;
    bool was_doubted = health->is_doubted;
    bool is_doubted = ih_rotation_estimate_change(&health->now.late, &health->all, rig,
                                                  &health->slopes, &scratch->at.change, &change) &&
                      is_worth_it(&change);
    bool is_sure = is_doubted && was_doubted;
    if (is_sure) {
        health->all = health->now.late;
        health->basis_count = 0;
        health->is_weak_known = false;
    }
    ih_rotation_estimate_clear(&health->now.late);
    health->is_doubted = is_doubted && !is_sure;
    return is_sure;
}

/* Of a rig that is turned: more is known by a quarter, or for the first time. */
static bool is_refined(const struct ih_health *health,
                       const struct ih_rotation_estimate_result *found)
{
    int32_t frame_count = health->all.frame_count;
    return is_rotated(health) && (frame_count * 4 >= health->basis_count * 5 ||
                                  frame_count >= IH_ROTATION_ESTIMATE_FRAMES_MAX ||
                                  (found->is_weak_seen && !health->is_weak_known));
}

static bool watch(struct ih_health *health, struct ih_rig *rig, struct ih_health_scratch *scratch)
{
    const struct ih_health_look look = health->look;
    struct ih_rotation_estimate_result found;
    bool has_changed = false;
    bool is_late = is_knocked(health, rig, scratch);
    if (is_search_due(health) && !is_late) {
        health->search_count = 0;
        begin_search(health);
        return false;
    }
    bool is_known = find(health, rig, &found);
    bool is_new = is_known && (is_late || is_worth_it(&found));
    if (is_new && health->is_weak_known) {
        health->is_weak_known = false; /* nor is what is known across the baseline true any more */
        is_known = find(health, rig, &found);
    }
    if (is_new || (is_known && is_refined(health, &found))) {
        has_changed = take(health, &found, rig, scratch);
    } else if (is_known) {
        keep_sigma(health, rig, &found);
    }
    conclude(health, &look, is_known && health->is_weak_known);
    if (is_new && !has_changed) {
        health->state = IH_HEALTH_LOST; /* turned beyond the limit */
    }
    begin_stage(health, is_new && has_changed ? IH_HEALTH_SETTLING : IH_HEALTH_WATCHING);
    if (health->stage == IH_HEALTH_SETTLING) {
        health->step = 1; /* the first one is a search's */
        health->search_count = 0;
        start_over(health);
    }
    ih_rotation_estimate_forget(&health->all);
    return has_changed;
}

/* So many quarters of the labels before. */
static bool has_labels(const struct ih_health_look *look, const struct ih_health_look *before,
                       int32_t quarters)
{
    return look->labelled_count * before->frame_count * 4 >=
           before->labelled_count * look->frame_count * quarters;
}

/* A search's turn has to give labels that are better than chance, unless those before were not: nearer to their
 * lines by a quarter, or more by a quarter; poor ones, as chance finds them in sunlight, twice as many. */
static bool is_proven(const struct ih_health_look *before, const struct ih_health_look *look)
{
    return !is_lost(look) && (is_lost(before) || has_labels(look, before, is_poor(look) ? 8 : 5) ||
                              look->across_px_q12 * before->labelled_count * 4 <=
                                  before->across_px_q12 * look->labelled_count * 3);
}

/* Without the part of a search's turn that nothing has shown since. */
static bool drop_weak(struct ih_health *health, struct ih_rig *rig,
                      struct ih_health_scratch *scratch)
{
    int32_t by_rad_q30[3];
    ih_rotation_estimate_hold(rig, health->rotation_rad_q30, by_rad_q30);
    start_over(health);
    return rotate_by(health, by_rad_q30, rig, scratch);
}

/* Refine what was taken; or take it back. */
static bool settle(struct ih_health *health, struct ih_rig *rig, struct ih_health_scratch *scratch)
{
    const struct ih_health_look look = health->look;
    struct ih_rotation_estimate_result found;
    bool is_last = health->step == SETTLE_STEPS - 1;
    if (health->step == 0 && !is_proven(&health->before, &look)) {
        give_up(health);
        health->is_weak_known = health->was_weak_known;
        health->basis_count = health->before_basis_count;
        return rotate_to(health, health->before_rad_q30, rig, scratch);
    }
    if (health->step == 0) {
        health->all = health->now.late;
    }
    bool is_known = find(health, rig, &found);
    bool has_changed = is_known && take(health, &found, rig, scratch);
    if (health->step == 1 && health->search_count > 0 && health->search_count < SEARCHES_MAX &&
        is_poor(&look)) {
        begin_search(health);
    } else if (is_last) {
        has_changed =
            is_known || health->is_weak_known ? has_changed : drop_weak(health, rig, scratch);
        conclude(health, &look, is_known && health->is_weak_known);
        ih_rotation_estimate_clear(&health->now.late);
        begin_stage(health, IH_HEALTH_WATCHING);
    } else {
        health->step++;
        start_over(health);
    }
    return has_changed;
}

static int32_t look_frames(const struct ih_health *health)
{
    if (health->stage != IH_HEALTH_SETTLING) {
        return IH_HEALTH_LOOK;
    }
    bool is_last = health->step == SETTLE_STEPS - 1;
    int32_t again_count = health->search_count - 1;
    int32_t again_frames = SEARCH_AGAIN_FRAMES * ih_max_s32(again_count, 0);
    return is_last ? ih_max_s32(settle_frames[health->step] - again_frames, IH_HEALTH_LOOK)
                   : settle_frames[health->step];
}

bool ih_health_frame(struct ih_health *health, const struct ih_dots *dots,
                     const struct ih_labels *labels, struct ih_rig *rig,
                     struct ih_health_scratch *scratch)
{
    const struct ih_health_look *look = &health->look;
    if (health->stage == IH_HEALTH_SEARCHING) {
        return search(health, dots, labels, rig, scratch);
    }
    add_frame(health, dots, labels, rig);
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
