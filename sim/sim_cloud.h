/* sim_cloud - the frame that the core is given: the camera's own, a depth image in mm, or a list of points drawn. */
#ifndef SIM_CLOUD_H
#define SIM_CLOUD_H

#include "hal.h"
#include "base/ih_types.h"
#include "rig/ih_rig.h"

struct sim_cloud {
    uint16_t *depth_mm; /* NULL while nothing was converted */
    int32_t scale_q20;  /* mm per unit of a depth image (app_rig.h); lists of points are in mm */
};

/* False when not one of a list's points can be seen: *error says where they are. */
bool sim_cloud_view(struct sim_cloud *cloud, const struct hal_frame *frame,
                    const struct ih_rig *rig, struct ih_frame *view, struct hal_error *error);
void sim_cloud_free(struct sim_cloud *cloud);

#endif
