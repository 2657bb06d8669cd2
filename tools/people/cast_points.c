/* cast_points - the core from labels on, for tools/people/cast.py, which has cast the dots itself.
 *
 * A library for Python's ctypes: one rig, one frame at a time, each on its own. Built by make learn-pose.
 */
#include "isohead.h"

#include <stdint.h>
#include <string.h>

#define APART_US 20000000
#define FIELDS 7
/* A dot of less than this beyond the working range belongs to it, as in ih_label_lines. */
#define MARGIN_PX 0.5

static struct isohead head;
static int64_t time_us;

/* The numbers of struct ih_calibration in its order; 0 or an error of the core. */
int cast_init(const int32_t *numbers)
{
    struct ih_calibration calibration;
    int32_t bad_slot;

    memcpy(&calibration, numbers, sizeof calibration);
    time_us = 0;
    return (int)isohead_init(&head, &calibration, &bad_slot);
}

/* By slot: depth, 0 where there is no dot; by how much the dot lies beside its place on its line; its place. Out: points in
 * mm, whether they are there; of each detection centre, semi-axes in mm, log-odds. Their count. */
int cast_find(const double *depth_mm, const double *beside_px, const double *u_px,
              const double *v_px, float *point_mm, uint8_t *seen, double *found)
{
    int32_t count = 0;

    memset(&head.dots, 0, sizeof head.dots);
    memset(&head.labels, 0, sizeof head.labels);
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_line *line = &head.rig.line[slot];
        const double t_px = depth_mm[slot] > 0.0
                                ? line->length_px_mm_q8 / 256.0 / depth_mm[slot] + beside_px[slot]
                                : 0.0;

        head.labels.dot_of_slot[slot] = IH_NONE;
        if (t_px > line->t_far_px_q12 / 4096.0 - MARGIN_PX &&
            t_px <= line->t_near_px_q12 / 4096.0 + MARGIN_PX && t_px > 0.0) {
            head.dots.dot[count].u_px_q12 = (int32_t)(u_px[slot] * 4096.0);
            head.dots.dot[count].v_px_q12 = (int32_t)(v_px[slot] * 4096.0);
            head.labels.t_px_q12[slot] = (int32_t)(t_px * 4096.0);
            head.labels.dot_of_slot[slot] = (int16_t)count++;
        }
    }
    head.dots.dot_count = head.labels.labelled_count = count;
    time_us += APART_US;
    isohead_find(&head, time_us);
    for (int slot = 0; slot < IH_SLOTS; slot++) {
        const struct ih_point *point = &head.points.point[slot];
        const double depth = point->depth_mm_q8 / 256.0;

        seen[slot] = point->state == IH_POINT_SEEN;
        point_mm[3 * slot] = (float)(depth * point->x_q28 / (1 << 28));
        point_mm[3 * slot + 1] = (float)(depth * point->y_q28 / (1 << 28));
        point_mm[3 * slot + 2] = (float)depth;
    }
    for (int i = 0; i < head.detections.detection_count; i++) {
        const struct ih_detection *detection = &head.detections.detection[i];

        for (int axis = 0; axis < 3; axis++) {
            found[FIELDS * i + axis] = detection->head.centre_mm_q8[axis] / 256.0;
            found[FIELDS * i + 3 + axis] = detection->head.semi_mm_q8[axis] / 256.0;
        }
        found[FIELDS * i + 6] = detection->logit_q10 / 1024.0;
    }
    return head.detections.detection_count;
}
