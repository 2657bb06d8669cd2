/* app_rig_explain - why the core refuses a calibration, in terms of rig.json. */
#ifndef APP_RIG_EXPLAIN_H
#define APP_RIG_EXPLAIN_H

#include "hal.h"
#include "base/ih_types.h"
#include "rig/ih_rig.h"

/* err and bad_slot as from ih_rig_init. *error names field, value and expectation. */
void app_rig_explain(const struct ih_calibration *calibration, enum ih_err err, int32_t bad_slot,
                     struct hal_error *error);

#endif
