/* ih_cloud - draw a list of points into a depth image (ours).
 *
 * In:    points in the camera frame, Q8 mm; a range rig.
 * Out:   a depth image of the rig's size, without padding, that is a frame for isohead_frame: each
 *        point in the pixel where the camera would see it, of several in one pixel the nearest,
 *        everything else 0; and what became of the points.
 * Method: (x / z, y / z) through lens and camera matrix, rounded to the pixel; z rounded to mm.
 * Cost:  two divisions and the lens a point. The image has no surfaces where points are rare:
 *        ih_windows looks farther there.
 * Error: 0.5 px, 0.5 mm; a place that close to a pixel's edge may fall into the next one.
 * Bounds: coordinates 2^31, times 2^28 before the division: 2^59.
 */
#ifndef IH_CLOUD_H
#define IH_CLOUD_H

#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_types.h"
#include "rig/ih_rig.h"

/* All points add up to these. */
struct ih_cloud {
    int32_t drawn;   /* pixels that have a depth now */
    int32_t hidden;  /* another point is at least as near in the same pixel */
    int32_t near;    /* nearer than the working range, or behind the camera */
    int32_t far;     /* farther */
    int32_t outside; /* beside the image */
};

IH_BEGIN_DECLS

/* depth_mm has room for width x height. IH_ERR_KIND when the rig is for no depth images. */
enum ih_err ih_cloud_draw(const int32_t (*point_mm_q8)[3], int32_t point_count,
                          const struct ih_rig *rig, uint16_t *depth_mm, struct ih_cloud *out)
    __attribute__((warn_unused_result));

IH_END_DECLS

#endif
