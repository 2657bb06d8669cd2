/* ih_result - the result of a frame: its hypotheses, which of them are heads, and which one is
 * selected.
 *
 * In:    either the nests' hypotheses (the paper's method alone), or detections and the tracks'
 *        verdicts; the rig, as they are in the level frame.
 * Out:   one list in one form. Rejected hypotheses stay in it with the reason.
 * With the paper's method alone no head is selected where several are accepted.
 */
#ifndef IH_RESULT_H
#define IH_RESULT_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_detections.h"
#include "nests/ih_hypotheses.h"
#include "rig/ih_rig.h"
#include "tracks/ih_tracks.h"

#define IH_RESULT_MAX (IH_DETECTIONS_MAX + IH_TRACKS_MAX)

/* Where a head looks, by ih_pose: 0, 0 is straight back along the camera's Z axis. Yaw is positive when the face
 * turns towards +X, pitch when it looks up. */
struct ih_head_pose {
    bool is_known;
    int32_t yaw_mdeg, pitch_mdeg; /* yaw: -179999 .. 180000 */
    int32_t yaw_sigma_mdeg, pitch_sigma_mdeg;
};

struct ih_result_entry {
    int32_t u_px_q12, v_px_q12; /* centre of the ellipse in the frame (distorted pixels) */
    int32_t a_px_q12, b_px_q12; /* semi-axes, a >= b */
    int32_t angle_mdeg;         /* of a, from +u towards +v, 0 .. 179999 */
    int32_t distance_mm_q8;     /* camera's centre to the surface at the ellipse's centre */
    int32_t centre_mm_q8[3];    /* of the head's volume, camera frame */
    int32_t rejected;           /* enum ih_reject */
    /* Not with the paper's method alone. */
    bool has_probability;
    int32_t probability_q16;       /* that it is a head, by its track; without one by this frame */
    int32_t frame_probability_q16; /* by this frame alone; of a predicted one 0 */
    int32_t track_id;              /* 0: none */
    int32_t sigma_mm_q8;      /* of the centre up and down, its least known axis; with a track */
    bool is_predicted;        /* not detected in this frame, but predicted by its track */
    struct ih_head_pose pose; /* of a head with a track; else 0 and not known */
};

struct ih_result {
    int32_t entry_count;
    int32_t head_count;
    int32_t head[IH_RESULT_MAX]; /* indices of the accepted ones, best first */
    int32_t selected;            /* index of the head, or IH_NONE */
    struct ih_result_entry entry[IH_RESULT_MAX];
};

IH_BEGIN_DECLS

/* Nothing. */
void ih_result_clear(struct ih_result *out);

void ih_result_from_hypotheses(const struct ih_hypotheses *hypotheses, const struct ih_rig *rig,
                               struct ih_result *out);

void ih_result_from_tracks(const struct ih_detections *detections, const struct ih_tracks *tracks,
                           const struct ih_predicted *predicted, const struct ih_rig *rig,
                           struct ih_result *out);

IH_END_DECLS

#endif
