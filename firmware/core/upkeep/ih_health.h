/* ih_health - does the rig still fit its calibration? A knock, or heat, that turned the projector is
 * found from ordinary frames and corrected.
 *
 * In:    dots and labels of every lit frame; the rig that they were labelled with.
 * Out:   the mean distance of labelled dots from their lines, the turn with its uncertainty, a
 *        state; and the rig, turned when there is reason to.
 * Method: Every IH_HEALTH_LOOK frames:
 *        1. The look against all frames since the rig last changed, slot by slot (ih_rotation_estimate): when two looks
 *           one after the other differ by more than 0.02 degrees and 5 times its uncertainty, the second
 *           alone counts from then on, and its turn is taken. What a slot errs by in all frames, from
 *           calibration or because it stands still, is in both and drops out.
 *        2. More than half of the dots without a label, or labels 0.16 px from their lines and more: maybe
 *           the lines are wrong. Over IH_HEALTH_SEARCH frames the dots vote for a turn (ih_rotation_vote), which is
 *           tried. If it gives neither a quarter more labels nor better ones than those frames had, it is
 *           taken back, with all that was known; if its labels are poor the search is repeated at once. One
 *           in vain is repeated after 1, 2, 4 .. IH_HEALTH_PAUSE looks, or when it gets worse.
 *        3. Else the turn that explains the labelled dots' distances from their lines, with all frames
 *           since the rig last changed. It is taken when it is more than 0.02 degrees and 5 times its
 *           uncertainty, about axes for which both hold.
 *        A turn that was taken is refined from the next 4 (after a search), 4 and 24 frames; from then on
 *        frames add up, and it is refined whenever a quarter more are there. A knock is so told within 46 of
 *        the frames that are looked at, however long the peace was and wherever in a look it came: at the end
 *        of 1 (then refined), of 2 after settling; later where a search is in vain first (63 seen).
 *        Not noticed: what dots do not show, docs/health.md has how much.
 *        A turn across the baseline, which is depth and which dots hardly show, is corrected for only
 *        when it is known to IH_ROTATION_ESTIMATE_SIGMA_MAX: what votes say of it alone is taken back.
 * Limits: within IH_ROTATION_VOTE_MAX_RAD_Q30 about each axis. Not seen, and not corrected: a shift of the
 *        projector along the baseline. A shift across it is taken for a turn. docs/health.md
 * Cost:  361 slots a frame; ih_rotation_vote's while searching, and ih_rig_init when the rig changes.
 * Error: against float64 on the same frames (tools/oracle/knock.py): docs/numerics.md.
 * Memory: the caller's; 63 kB with the scratch, beside struct isohead. A dot rig only.
 */
#ifndef IH_HEALTH_H
#define IH_HEALTH_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "dots/ih_dots.h"
#include "labels/ih_labels.h"
#include "rig/ih_rig.h"
#include "upkeep/ih_rotation_estimate.h"
#include "upkeep/ih_rotation_vote.h"

#define IH_HEALTH_LOOK 6   /* frames */
#define IH_HEALTH_SEARCH 3 /* frames */
#define IH_HEALTH_PAUSE 50 /* max looks until a search that found nothing is repeated */
/* Frames after which everything known about a rig that stays is as good as new, or as a check needs. */
#define IH_HEALTH_ENOUGH 60

enum ih_health_state {
    IH_HEALTH_UNKNOWN = 0, /* too little was seen yet */
    IH_HEALTH_FITS = 1,
    IH_HEALTH_ROTATED = 2, /* the projector is turned, and corrected for */
    IH_HEALTH_LOST = 3,    /* dots are seen, but hardly one lies on its line, and no turn within the
                           * limit helps */
};

/* What the last frames of a look showed. */
struct ih_health_look {
    int32_t frame_count, dot_count, labelled_count;
    int64_t across_px_q12; /* sum of distances */
};

enum ih_health_stage { IH_HEALTH_WATCHING, IH_HEALTH_SEARCHING, IH_HEALTH_SETTLING };

struct ih_health {
    enum ih_health_state state;
    int32_t across_px_q12;       /* mean distance of the last look's labelled dots; -1: none */
    int32_t rotation_rad_q30[3]; /* of the rig against the calibration; camera axes */
    /* Its uncertainty, one standard deviation; 0 before the first one, of no use while the rig is lost. */
    int32_t sigma_rad_q30[3];
    bool is_weak_known;                /* the turn across the baseline; if not, it is 0 */
    int32_t dot_count, labelled_count; /* of the last look, in all its frames */
    /* Its own. */
    struct ih_calibration nominal;
    struct ih_rotation_vote_slopes slopes;
    enum ih_health_stage stage;
    int32_t step;  /* of searching or settling */
    int32_t pause; /* looks until the next search, and after it if it is in vain */
    int32_t next_pause;
    int32_t search_count; /* one after the other */
    struct ih_health_look look;
    int32_t basis_count;          /* frames that the turn was had from */
    bool is_doubted;              /* the last look differed from those before */
    struct ih_health_look before; /* while searching, and what was known then */
    int32_t before_rad_q30[3];
    int32_t before_basis_count;
    bool was_weak_known;
    struct ih_rotation_estimate all; /* since the rig last changed by more than a refinement */
    union {
        struct ih_rotation_estimate late;    /* of the last look, or two; of a turn on trial */
        struct ih_rotation_vote_votes votes; /* while searching */
    } now;
};

struct ih_health_scratch {
    union {
        struct ih_rotation_vote_scratch rotation;
        struct ih_rotation_estimate change;
    } at;
    struct ih_calibration calibration;
    struct ih_rig rig;
};

IH_BEGIN_DECLS

/* rig: as ih_rig_init made it from the calibration. */
void ih_health_init(struct ih_health *health, const struct ih_rig *rig);

/* After each lit frame, when its points are done. True: the rig has been turned, and the next frame is
 * to be labelled with it. */
bool ih_health_frame(struct ih_health *health, const struct ih_dots *dots,
                     const struct ih_labels *labels, struct ih_rig *rig,
                     struct ih_health_scratch *scratch);

IH_END_DECLS

#endif
