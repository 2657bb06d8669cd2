/* ih_detections - every candidate head of a frame, each with its probability (ours).
 *
 * In:     nests and their hypotheses (ih_hypotheses), points, dots, rig, and where a head is
 *         expected (tracks).
 * Out:    detections, the most probable first, at least spacing_mm apart.
 * Method: candidates are the centres of the scan, those of the nests, the expected heads, and the last sure places
 *         of heads that the frame before left in doubt, in this order. Nests that promise too little (ih_surroundings),
 *         centres near a head that is found, and starts within apart_mm of one before, are passed over. Each
 *         other one is fitted for a step (ih_fit), measured (ih_evidence) and scored (ih_score). Those that are not
 *         hopeless are fitted to the end, moved to where their surroundings say that the centre is (ih_surroundings),
 *         measured and scored again, expected and last sure ones at once; with a step_count of 0 or 1 none is moved.
 *         What is hopeless after a step stays there; a few of these would be heads at the end, and a track may keep on
 *         one that is just below. A range frame has several windows: begin once a frame, add once a window.
 *         For an expected head that is not found there is what its rays met (views): whether it is
 *         hidden, or gone.
 *         Of two within spacing_mm the more probable stays, of equals the first; it replaces all that
 *         are near it.
 * Full table: the less probable drop and count in dropped_count.
 * Overflow: points are below 2^25 in Q8 (16 m, slopes up to 8), nests' centres below 2^26.01, expected
 *         ones at most 2^26, last sure ones 2^26.01; a fit moves 240 mm, its surroundings 1000:
 *         centres below 2^27, squares of differences 2^57.6.
 * Cost:   up to IH_DETECTIONS_STARTS_MAX = 38 fits a window. Usually 2 to 4 candidates are fitted,
 *         1 or 2 of them to the end; one more for a head that is hidden.
 */
#ifndef IH_DETECTIONS_H
#define IH_DETECTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_evidence.h"
#include "detect/ih_fit.h"
#include "detect/ih_fit_equations.h"
#include "detect/ih_rays.h"
#include "detect/ih_scan.h"
#include "detect/ih_surroundings.h"
#include "dots/ih_dots.h"
#include "nests/ih_hypotheses.h"
#include "nests/ih_nests.h"
#include "points/ih_points.h"
#include "rig/ih_rig.h"

/* Detections kept; each costs 136 bytes. */
#define IH_DETECTIONS_MAX 16
/* Expected heads that are tried, and so the tracks; each costs a track and a detection. */
#define IH_DETECTIONS_EXPECTED_MAX 8
/* Starts of a window: each expected head may have two. */
#define IH_DETECTIONS_STARTS_MAX (IH_SCAN_MAX + IH_NESTS_MAX + 2 * IH_DETECTIONS_EXPECTED_MAX)

enum ih_source { IH_SOURCE_SCAN, IH_SOURCE_NEST, IH_SOURCE_EXPECTED };

struct ih_detections_params {
    struct ih_rays_params rays;
    struct ih_scan_params scan;
    struct ih_fit_params fit;
    int32_t apart_mm;           /* a start nearer than this to one before is not tried */
    int32_t found_mm;           /* nor is a centre nearer than this to a detection */
    int32_t found_logit_q10;    /* of at least these log-odds */
    int32_t hopeless_logit_q10; /* minimum after the first step, of what is not expected */
    int32_t spacing_mm;         /* of two detections */
    int32_t nest_max;           /* of them this many are candidates themselves */
    int32_t expected_max; /* of the expected heads, and of the last sure places, this many are */
    int32_t front_min_mm; /* no head is nearer than this: the lens is there */
    int32_t move_max_mm;  /* of a centre fitted to the end, down and away each: 0 (none) to 1000 */
};

struct ih_detection {
    struct ih_ellipsoid head;
    struct ih_evidence evidence;
    int32_t logit_q10;
    int32_t probability_q16;
    int32_t source; /* enum ih_source */
    /* Its outline in the frame, as in ih_hypothesis. */
    int32_t u_px_q12, v_px_q12;
    int32_t a_px_q12, b_px_q12;
    int32_t angle_mdeg;
    int32_t distance_mm_q8;
};

struct ih_detections {
    int32_t detection_count;
    int32_t dropped_count;
    int32_t seen_count; /* points, over all windows */
    struct ih_detection detection[IH_DETECTIONS_MAX];
    struct ih_view view[IH_DETECTIONS_EXPECTED_MAX]; /* by expected head, summed over windows */
};

/* Heads that are expected, and the last sure places of those that the frame before left in doubt. */
struct ih_expected {
    int32_t count;
    struct ih_ellipsoid head[IH_DETECTIONS_EXPECTED_MAX];
    int32_t last_sure_count;
    struct ih_ellipsoid last_sure[IH_DETECTIONS_EXPECTED_MAX];
};

/* Centres from where fits have begun. */
struct ih_detections_starts {
    int32_t count;
    int32_t centre_mm_q8[IH_DETECTIONS_STARTS_MAX][3];
};

struct ih_detections_scratch {
    struct ih_detections_starts starts;
    struct ih_rays rays;
    struct ih_scan scan;
    struct ih_scan_scratch scan_scratch;
    struct ih_fit_scratch fit;
    struct ih_surroundings surroundings;
};

IH_BEGIN_DECLS

void ih_detections_params_default(struct ih_detections_params *params);

void ih_detections_begin(struct ih_detections *out);

/* Add the detections of one set of points. */
void ih_detections_add(const struct ih_points *points, const struct ih_dots *dots,
                       const struct ih_hypotheses *hypotheses, const struct ih_expected *expected,
                       const struct ih_rig *rig, const struct ih_detections_params *params,
                       struct ih_detections_scratch *scratch, struct ih_detections *out);

/* The outline of an ellipsoid in the frame; fills the detection from u_px_q12 on. It is the ellipse of
 * the cross-section at the centre's depth, which the true one exceeds: by 2 % at 500 mm and 0.6 % at
 * 900 mm, and at a slope s from the axis by up to 0.8 s^2 more in that direction, 8 % at 0.3; there
 * its long axis is tilted by up to 10 degrees, and its centre lies s (98 / Z)^2 of a focal length
 * farther out (11 px at 500 mm, 3 px at 900 mm and s = 0.3). The lens bends the centre only. The
 * distance assumes a head as deep from every side: 2 mm short at s = 0.3; it is 0 where the
 * camera would be inside the head. */
void ih_detections_outline(const struct ih_rig *rig, struct ih_detection *detection);

IH_END_DECLS

#endif
