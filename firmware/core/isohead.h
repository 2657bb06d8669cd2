/* isohead - find a person's head in 3-D from one frame of 361 laser dots.
 *
 * A library in three calls:
 *
 *     static struct isohead head;              // the only memory there is
 *     isohead_init(&head, &calibration, &bad); // checks the rig once
 *     isohead_frame(&head, &frame, NULL, time_us); // every frame: dots .. heads
 *     head.result ...                          // every stage's output is a member, too
 *
 * The frame is a camera frame for a dot rig, a depth image for a range rig. Integer arithmetic
 * only; the same frame gives the same bytes on every processor. Not thread-safe per struct; two
 * structs are independent. It is aligned for vectors, to 32 bytes: allocate it on a heap with
 * aligned_alloc, as malloc aligns to less. C++ can include this header.
 *
 * The calls may come in any order: memory of zeros and a refused rig take no frame. A frame that is
 * NULL is malformed, no other pointer may be NULL; params stay within their headers' bounds.
 *
 * Method: M. Clabian, H. Roetzer, H. Bischof, W. G. Kropatsch, "Head detection and localization
 * from sparse 3D data", DAGM 2002. Each stage's header names its section.
 */
#ifndef ISOHEAD_H
#define ISOHEAD_H

#include <stdbool.h>
#include <stdint.h>

#include "align/ih_align.h"
#include "base/ih_config.h"
#include "base/ih_types.h"
#include "detect/ih_detections.h"
#include "dots/ih_dot_rows.h"
#include "dots/ih_dots.h"
#include "labels/ih_labels.h"
#include "nests/ih_hypotheses.h"
#include "nests/ih_nests.h"
#include "points/ih_points.h"
#include "points/ih_windows.h"
#include "pose/ih_pose.h"
#include "rig/ih_rig.h"
#include "surface/ih_samples.h"
#include "surface/ih_surface.h"
#include "surface/ih_surface_scratch.h"
#include "tracks/ih_result.h"
#include "tracks/ih_tracks.h"

#define ISOHEAD_VERSION "0.1.0"

/* RAM for the whole state, the frame itself not included. */
#define IH_RAM_MAX (192 * 1024)

struct ih_params {
    bool is_paper; /* the paper's method alone, from the first frame on; nests judged by limits */
    struct ih_dots_params dots;
    struct ih_labels_params labels;
    struct ih_windows_params windows;
    struct ih_points_params points;
    struct ih_samples_params samples;
    struct ih_surface_params surface;
    struct ih_nests_params nests;
    struct ih_hypotheses_params hypotheses;
    struct ih_detections_params detections;
    struct ih_tracks_params tracks;
    struct ih_pose_params pose;
};

/* Working memory from dots to labels. */
union ih_rows_work {
    struct ih_align_scratch align;
    struct ih_labels_scratch labels;
};

struct ih_rows_scratch {
    struct ih_dot_rows rows;
    union ih_rows_work at;
};

struct isohead {
    struct ih_rig rig;
    struct ih_params params;
    /* From the frames before. */
    struct ih_tracks tracks;
    struct ih_align align;
    struct ih_pose pose;
    /* The stages' outputs of the last frame, in order. */
    struct ih_dots dots;
    struct ih_labels labels;
    struct ih_expected expected; /* by the tracks */
    struct ih_windows windows;
    struct ih_points points;
    struct ih_samples samples;
    struct ih_surface surface;
    struct ih_nests nests;
    struct ih_hypotheses hypotheses;
    struct ih_detections detections;
    struct ih_predicted predicted; /* by the tracks */
    struct ih_result result;
    /* Working memory; stages never run at the same time, so they share it. */
    union {
        struct ih_dots_scratch dots;
        struct ih_rows_scratch labels;
        struct ih_windows_scratch windows;
        struct ih_surface_scratch surface;
        struct ih_nests_scratch nests;
        struct ih_detections_scratch detections;
        struct ih_pose_scratch pose;
    } scratch;
};

IH_BEGIN_DECLS

void ih_params_default(struct ih_params *params);
/* The paper's method alone: is_paper set, a finer surface, and each nest judged by its own shape. */
void ih_params_paper(struct ih_params *params);

/* Check the calibration, derive the rig, set default parameters. After an error every frame is
 * refused. */
enum ih_err isohead_init(struct isohead *head, const struct ih_calibration *calibration,
                         int32_t *bad_slot) __attribute__((warn_unused_result));

/* Process one frame that was taken at time_us, which may have any origin. ambient: the last frame
 * that was taken with the laser off, or NULL; it is subtracted as ambient light and should be as fresh
 * as possible. A range rig ignores it. IH_ERR_SIZE when one of them is not of the rig's size or its
 * view is malformed, IH_ERR_KIND when it does not have 1 or 2 bytes per sample, or a range rig's not
 * 2; then the outputs are those of an empty frame, and tracks stay as they were. */
enum ih_err isohead_frame(struct isohead *head, const struct ih_frame *frame,
                          const struct ih_frame *ambient, int64_t time_us)
    __attribute__((warn_unused_result));

/* isohead_frame in two halves, for a dot rig whose caller does not know whether the dots were on
 * when the frame was taken, and decides from head->labels whether it is used. isohead_label fills
 * head->dots and head->labels, leaves all other outputs empty and the tracks as they were; a range
 * rig is IH_ERR_KIND. It may be called again, with an ambient frame this time. Labels move the rig's
 * lines: before a second call, and after a frame that is not used, put back what head->rig and
 * head->align were before. isohead_find goes on from there, once per frame that is used; without a dot
 * rig it does nothing, and after isohead_init or a refused frame it finds what is in an empty one. */
enum ih_err isohead_label(struct isohead *head, const struct ih_frame *frame,
                          const struct ih_frame *ambient) __attribute__((warn_unused_result));
void isohead_find(struct isohead *head, int64_t time_us);

IH_END_DECLS

#endif
