/* app_rig - rig.json to the core's calibration.
 *
 * In:    JSON as OpenCV's FileStorage writes it (docs/contract.md); a matrix may also be an array of its rows, or of
 *        all its numbers row by row. Unknown fields are ignored.
 * Out:   the numbers rounded to the formats of struct ih_calibration, nothing else: near_mm is
 *        rounded down and far_mm up, so that the range never shrinks.
 * Error: one line that names field, value and expectation. What can be seen in one number (missing, there twice,
 *        wrong type or shape, not finite, beyond its format) is found here; what makes a rig is
 *        judged by the core (ih_rig_init), and app_rig_explain words its verdict.
 */
#ifndef APP_RIG_H
#define APP_RIG_H

#include "base/ih_types.h"
#include "hal.h"
#include "rig/ih_rig.h"
#include "rig/ih_rig_blob.h"

/* Largest rig.json; 361 rays in full precision need 30 kB. */
#define APP_RIG_FILE_MAX ((size_t)4 << 20)

/* mm per unit of a range frame. */
#define APP_RIG_SCALE_ONE (1 << 20)
#define APP_RIG_SCALE_MIN 0.01
#define APP_RIG_SCALE_MAX 1000.0

/* scale_q20: depth_scale. text has a zero byte at its end, which size does not count. False: *error says why. */
bool app_rig_parse(const char *text, size_t size, struct ih_calibration *calibration,
                   int32_t *scale_q20, struct hal_error *error);
/* The same with a file. */
bool app_rig_load_scaled(const char *path, struct ih_calibration *calibration, int32_t *scale_q20,
                         struct hal_error *error);

/* For frames in mm: another depth_scale is refused. */
bool app_rig_load(const char *path, struct ih_calibration *calibration, struct hal_error *error);

/* As ih_rig_blob_encode; a rig that does not say which way is up hangs level, and its blob says so. */
enum ih_err app_rig_to_blob(const struct ih_calibration *calibration,
                            uint8_t blob[IH_RIG_BLOB_BYTES]);

/* app_rig_explain.c: why the core refuses a calibration, in terms of rig.json. err and bad_slot as from
 * ih_rig_init. *error names field, value and expectation. */
void app_rig_explain(const struct ih_calibration *calibration, enum ih_err err, int32_t bad_slot,
                     struct hal_error *error);

#endif
