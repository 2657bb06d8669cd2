#include "dots/ih_dot_rows.h"

#include <stdbool.h>

#include "base/ih_fix.h"
#include "rig/ih_camera.h"

/* Where the file's camera would see it. Before the lens is taken off, which is one of angles. */
static int32_t restored_px_q12(int32_t px_q12, int32_t principal_px_q16, int64_t scale_q30,
                               int32_t shift_px_q12)
{
    const int64_t principal_px_q12 = ih_shift_round(principal_px_q16, 4);
    const int64_t off_px_q12 = px_q12 - principal_px_q12 - shift_px_q12;
    return (int32_t)(principal_px_q12 + ih_mul_shift(off_px_q12, scale_q30, 30));
}

static void insert(struct ih_dot_rows *rows, int32_t dot, int32_t u_px_q12, int32_t v_px_q12)
{
    int32_t at = dot;
    for (; at > 0 && rows->v_px_q12[at - 1] > v_px_q12; at--) {
        rows->u_px_q12[at] = rows->u_px_q12[at - 1];
        rows->v_px_q12[at] = rows->v_px_q12[at - 1];
        rows->dot[at] = rows->dot[at - 1];
    }
    rows->u_px_q12[at] = u_px_q12;
    rows->v_px_q12[at] = v_px_q12;
    rows->dot[at] = (int16_t)dot;
}

void ih_dot_rows_fill(const struct ih_dots *dots, const struct ih_rig *rig, struct ih_dot_rows *out)
{
    const struct ih_calibration *c = &rig->calibration;
    const bool is_moved =
        rig->focal_q30 != 0 || rig->shift_px_q12[0] != 0 || rig->shift_px_q12[1] != 0;
    const int64_t scale_q30 =
        ih_div_round((int64_t)1 << 60, ((int64_t)1 << 30) + rig->focal_q30); /* 1 stays 1 */
    out->dot_count = dots->dot_count;
    for (int32_t i = 0; i < dots->dot_count; i++) {
        int32_t u_px_q12 = dots->dot[i].u_px_q12, v_px_q12 = dots->dot[i].v_px_q12;
        if (is_moved) {
            u_px_q12 = restored_px_q12(u_px_q12, c->cx_px_q16, scale_q30, rig->shift_px_q12[0]);
            v_px_q12 = restored_px_q12(v_px_q12, c->cy_px_q16, scale_q30, rig->shift_px_q12[1]);
        }
        ih_camera_undistort_pixel(rig, u_px_q12, v_px_q12, &u_px_q12, &v_px_q12);
        insert(out, i, u_px_q12, v_px_q12);
    }
    out->v_px_q12[dots->dot_count] = INT32_MAX;
}

int32_t ih_dot_rows_count_above(const struct ih_dot_rows *rows, int32_t v_px_q12, int32_t guess)
{
    int32_t at = guess;
    while (at > 0 && rows->v_px_q12[at - 1] >= v_px_q12) {
        at--;
    }
    while (rows->v_px_q12[at] < v_px_q12) {
        at++;
    }
    return at;
}
