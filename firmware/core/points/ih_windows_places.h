/* ih_windows_places - the list of the best places, the third step of ih_windows.
 *
 * Private to points and its tests.
 */
#ifndef IH_WINDOWS_PLACES_H
#define IH_WINDOWS_PLACES_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_config.h"
#include "points/ih_windows.h"
#include "rig/ih_rig.h"

IH_BEGIN_DECLS

/* A cell as a place with its score. */
struct ih_windows_place ih_windows_place_at(const struct ih_windows_scratch *s,
                                            const struct ih_rig *rig,
                                            const struct ih_windows_params *params, int32_t column,
                                            int32_t row);

/* Are two places, both seen at the depth of the nearer one, less than this apart? */
bool ih_windows_are_near(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                         const struct ih_windows_place *a, const struct ih_windows_place *b,
                         int32_t apart_mm);

/* Insert a place into the list, unless a better one is near; worse ones that are near are removed. */
void ih_windows_remember(struct ih_windows_scratch *s, const struct ih_rig *rig,
                         const struct ih_windows_place *place, struct ih_windows *out);

/* The weighted mean of the places around the best one; spacing_px is not set. */
void ih_windows_mean(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                     const struct ih_windows_params *params, const struct ih_windows_place *best,
                     struct ih_window *out);

IH_END_DECLS

#endif
