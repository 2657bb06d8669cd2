/* ih_dot_rows - the dots of a frame by row, undistorted, so that a line visits only some of them.
 *
 * In:    dots in any order, rig.
 * Out:   undistorted pixels in the order of rows, with the index of each in ih_dots. With a rig that has moved
 *        (ih_rig_move), positions are those that the camera of the rig's file would see.
 * Cost:  the camera's step for each dot; dots come nearly in order of rows.
 */
#ifndef IH_DOT_ROWS_H
#define IH_DOT_ROWS_H

#include <stdint.h>

#include "base/ih_config.h"
#include "base/ih_fix.h"
#include "dots/ih_dots.h"
#include "rig/ih_rig.h"

struct ih_dot_rows {
    int32_t dot_count;
    int32_t u_px_q12[IH_DOTS_MAX];
    int32_t v_px_q12[IH_DOTS_MAX + 1]; /* INT32_MAX behind the last one: there every search ends */
    int16_t dot[IH_DOTS_MAX];
};

IH_BEGIN_DECLS

void ih_dot_rows_fill(const struct ih_dots *dots, const struct ih_rig *rig,
                      struct ih_dot_rows *out);

/* How many of the dots lie above a row. The search starts at a guess: the count of the slot before is near. */
int32_t ih_dot_rows_count_above(const struct ih_dot_rows *rows, int32_t v_px_q12, int32_t guess);

IH_END_DECLS

/* Position of a dot along a line, from infinity. Positions are within 2^27 in Q12, those at infinity within 2^27.6: a
 * difference of 2^28.4 times a Q30 unit vector, two products, below 2^59.4. */
static inline int64_t ih_dot_rows_along_px_q12(const struct ih_dot_rows *rows, int32_t at,
                                               const struct ih_line *line)
{
    const int64_t du = rows->u_px_q12[at] - line->infinity_u_px_q12;
    const int64_t dv = rows->v_px_q12[at] - line->infinity_v_px_q12;
    return ih_shift_round(du * line->dir_u_q30 + dv * line->dir_v_q30, 30);
}

/* Distance across the line. */
static inline int64_t ih_dot_rows_across_px_q12(const struct ih_dot_rows *rows, int32_t at,
                                                const struct ih_line *line)
{
    const int64_t du = rows->u_px_q12[at] - line->infinity_u_px_q12;
    const int64_t dv = rows->v_px_q12[at] - line->infinity_v_px_q12;
    return ih_shift_round(dv * line->dir_u_q30 - du * line->dir_v_q30, 30);
}

#endif
