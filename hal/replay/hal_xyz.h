/* hal_xyz - read a list of points as text.
 *
 * In:    a whole file in memory: a line per point, `x y z` in mm in the camera frame (X right, Y
 *        down, Z forward), apart by white space. Empty lines, and lines whose first character that
 *        is no white space is #, are skipped, and so is a byte-order mark before all. A list without
 *        points is a frame that shows nothing.
 * Out:   the points in the order of the file, in 1/256 mm.
 * Error: anything else, with the number of the line: more or fewer than three numbers, one that is
 *        not decimal, not finite or beyond HAL_XYZ_MAX_MM, a zero byte; no memory.
 */
#ifndef HAL_XYZ_H
#define HAL_XYZ_H

#include <stddef.h>

#include "hal.h"

/* Longest file: two million points of thirty characters. */
#define HAL_XYZ_FILE_MAX ((size_t)64 << 20)
/* Largest coordinate, so that it fits 32 bits with eight below the point. */
#define HAL_XYZ_MAX_MM 8000000

struct hal_xyz {
    int32_t (*point_mm_q8)[3]; /* to be freed by the caller */
    int32_t point_count;
};

/* text: size bytes and a zero byte behind them. False: *error says why, and there is nothing to
 * free. */
bool hal_xyz_decode(const char *text, size_t size, struct hal_xyz *xyz, struct hal_error *error);

#endif
