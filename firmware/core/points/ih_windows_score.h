/* ih_windows_score - how well a cell fits the template of a head, the second step of ih_windows.
 *
 * Private to points and its tests.
 */
#ifndef IH_WINDOWS_SCORE_H
#define IH_WINDOWS_SCORE_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "points/ih_windows.h"
#include "rig/ih_rig.h"

/* Cells per mm at a depth. */
struct ih_windows_scale {
    int32_t u_q16, v_q16;
};

IH_BEGIN_DECLS

struct ih_windows_scale ih_windows_scale_at(const struct ih_windows_scratch *s,
                                            const struct ih_rig *rig, int32_t depth_mm);

/* 0 .. 1000, of a place with a depth; its own score is not used. */
int32_t ih_windows_score(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                         const struct ih_windows_params *params, const struct ih_windows_place *at);

/* Does a plane that is seen beside the place go on below it? */
bool ih_windows_stands_on_plane(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                                const struct ih_windows_place *at);

IH_END_DECLS

#endif
