#include "align/ih_align_pairs.h"

#include "base/ih_fix.h"

#define ONE_Q14 (1 << 14)
#define ASPECT_MAX_Q14 (8 << 14)
/* Columns are looked at by so much more than is needed: positions are rounded. */
#define COLUMN_PX_Q12 4096

void ih_align_axes(const struct ih_rig *rig, struct ih_align_axes *out)
{
    const struct ih_calibration *c = &rig->calibration;
    out->along_q14[0] = (int32_t)ih_shift_round(rig->line[IH_SLOTS / 2].dir_u_q30, 16);
    out->along_q14[1] = (int32_t)ih_shift_round(rig->line[IH_SLOTS / 2].dir_v_q30, 16);
    out->aspect_q14 = (int32_t)ih_clamp_s64(
        ih_div_round((int64_t)c->fy_px_q16 * (1 << 14), c->fx_px_q16), ASPECT_MAX_Q14);
}

static int16_t slope_of(int64_t slope_q28)
{
    return (int16_t)ih_clamp_s64(slope_q28 >> 16, INT16_MAX);
}

/* A rotation (a, b, c) moves a dot at (x, y), per rad and focal length, by (-x y a + (1 + x x) b - y c,
 * -(1 + y y) a + x y b + x c); a focal length, by (x, y). |x|, |y| < 4 and an aspect of 8: all is below 2^40 in Q28. */
void ih_align_slopes(const struct ih_rig *rig, const struct ih_align_axes *axes, int32_t slot,
                     int16_t slope_q12[IH_ALIGN_AXES])
{
    const struct ih_line *line = &rig->line[slot];
    const int64_t x = line->slope_x_q20 >> 6, y = line->slope_y_q20 >> 6;
    const int64_t along_u = axes->along_q14[0], along_v = axes->along_q14[1];
    /* The line's direction; what moves along v is longer by the aspect. */
    const int64_t u = line->dir_u_q30 >> 16, v = line->dir_v_q30 >> 16;
    const int64_t u_aspect = u * axes->aspect_q14 >> 14;
    const int64_t xy = x * y >> 14, xx = ONE_Q14 + (x * x >> 14), yy = ONE_Q14 + (y * y >> 14);
    const int64_t by_a = (v * xy - u_aspect * yy) >> 14, by_b = (u_aspect * xy - v * xx) >> 14;
    slope_q12[IH_ALIGN_BASELINE] = slope_of(along_u * by_a + along_v * by_b);
    slope_q12[IH_ALIGN_DEPTH] = slope_of(along_u * by_b - along_v * by_a);
    slope_q12[IH_ALIGN_ROLL] = slope_of(u_aspect * x + v * y);
    slope_q12[IH_ALIGN_FOCAL] = slope_of(u_aspect * y - v * x);
    slope_q12[IH_ALIGN_SHIFT] = slope_of(u * along_u + v * along_v);
}

/* Of rows or columns. */
struct stretch {
    int32_t low_px_q12, high_px_q12;
};

static struct stretch stretch_of(int32_t infinity_px_q12, int32_t dir_q30, int32_t near_px_q12,
                                 int32_t far_px_q12, int32_t wider_px_q12)
{
    const int32_t near = infinity_px_q12 + (int32_t)ih_mul_shift(near_px_q12, dir_q30, 30);
    const int32_t far = infinity_px_q12 + (int32_t)ih_mul_shift(far_px_q12, dir_q30, 30);
    return (struct stretch){ih_min_s32(near, far) - wider_px_q12,
                            ih_max_s32(near, far) + wider_px_q12};
}

/* A line from the nearest depth to infinity, both widened by the margin; half a band moves its ends by at most as much. Of
 * the dots in these rows most lie in other columns. Where a dot is kept, along is between two 32-bit numbers. */
int32_t ih_align_near(const struct ih_dot_rows *rows, const struct ih_line *line,
                      struct ih_align_band band, int32_t *first,
                      struct ih_align_dot dot[IH_ALIGN_NEAR_MAX])
{
    const int32_t near = line->t_near_px_q12 + band.margin_px_q12;
    const int32_t far = -band.margin_px_q12;
    const struct stretch u = stretch_of(line->infinity_u_px_q12, line->dir_u_q30, near, far,
                                        band.half_px_q12 + COLUMN_PX_Q12);
    const struct stretch v =
        stretch_of(line->infinity_v_px_q12, line->dir_v_q30, near, far, band.half_px_q12);
    int32_t count = 0;
    *first = ih_dot_rows_count_above(rows, v.low_px_q12, *first);
    for (int32_t i = *first; rows->v_px_q12[i] <= v.high_px_q12; i++) {
        if (rows->u_px_q12[i] < u.low_px_q12 || rows->u_px_q12[i] > u.high_px_q12) {
            continue;
        }
        const int64_t along = ih_dot_rows_along_px_q12(rows, i, line);
        const int64_t across = ih_dot_rows_across_px_q12(rows, i, line);
        if (along >= far && along <= near && ih_abs_s64(across) < band.half_px_q12 &&
            count < IH_ALIGN_NEAR_MAX) {
            dot[count++] = (struct ih_align_dot){(int32_t)along, (int32_t)across};
        }
    }
    return count;
}
