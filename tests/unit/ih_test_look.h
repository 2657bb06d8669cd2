/* ih_test_look - points around heads that tools/oracle/pose.py wrote, and a rig that they are seen with. A test includes
 * it once. */
#ifndef IH_TEST_LOOK_H
#define IH_TEST_LOOK_H

#include "base/ih_config.h"
#include "points/ih_points.h"
#include "pose/ih_pose_look.h"
#include "rig/ih_rig.h"

#include "ih_test.h"

struct vector_look {
    int32_t kind, length_px_mm_q8, unit_q28;
    struct ih_ellipsoid head;
    const struct ih_point *point;
    const double *feature, *log2; /* of all features and outputs */
};

#include "pose.inc"

static struct ih_points points;
static struct ih_rig rig;

static inline void use_look(const struct vector_look *vector)
{
    rig.calibration.kind = (enum ih_rig_kind)vector->kind;
    rig.line[IH_SLOTS / 2].length_px_mm_q8 = vector->length_px_mm_q8;
    points.field.unit_q28 = vector->unit_q28;
    memcpy(points.point, vector->point, sizeof points.point);
}

#endif
