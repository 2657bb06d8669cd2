/* ih_align_sigma - how well it is known how the rig has moved. Private to align.
 *
 * Method: the mean's own uncertainty, how far the lines lag behind the mean, and what no number of frames shows, squared
 *         and added.
 */
#ifndef IH_ALIGN_SIGMA_H
#define IH_ALIGN_SIGMA_H

#include <stdint.h>

#include "align/ih_align.h"
#include "rig/ih_rig.h"

/* Uncertainty about the camera's axes. */
void ih_align_set_sigma(struct ih_align *align, const int32_t mean_px_q12[IH_ALIGN_AXES],
                        const int32_t sigma_px_q12[IH_ALIGN_AXES], const struct ih_rig *rig);

#endif
