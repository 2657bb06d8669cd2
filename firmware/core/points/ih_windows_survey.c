#include "points/ih_windows_survey.h"

#include <stdbool.h>
#include <stddef.h>

#include "base/ih_fix.h"
#include "rig/ih_camera.h"
#include "rig/ih_level.h"

#define CONNECTED_MIN_PERCENT 70
#define DOUBLINGS_MAX 5

/* Depth of a pixel in the working range, else 0. */
static int32_t depth_mm_at(const struct ih_frame *frame, const struct ih_rig *rig, int32_t u,
                           int32_t v)
{
    const uint8_t *row = (const uint8_t *)frame->samples + (size_t)v * (size_t)frame->stride_bytes;
    int32_t depth = ((const uint16_t *)(const void *)row)[u];
    bool in_range = depth >= rig->calibration.near_mm && depth <= rig->calibration.far_mm;
    return in_range ? depth : 0;
}

/* A pixel that was found: its place from where the search began. */
struct found {
    int32_t du, dv, distance2, depth_mm;
};

static bool is_nearer(int32_t du, int32_t dv, const struct found *best)
{
    int32_t distance2 = du * du + dv * dv;
    bool is_before = dv < best->dv || (dv == best->dv && du < best->du);
    return distance2 < best->distance2 || (distance2 == best->distance2 && is_before);
}

/* A row of the square ring of this radius: whole at its top and bottom, else its two ends. */
static void search_row(const struct ih_frame *frame, const struct ih_rig *rig, int32_t u, int32_t v,
                       int32_t radius, int32_t dv, struct found *best)
{
    int32_t step = ih_abs_s32(dv) == radius ? 1 : 2 * radius;
    if (v + dv < 0 || v + dv >= frame->height) {
        return;
    }
    for (int32_t du = -radius; du <= radius; du += step) {
        if (u + du < 0 || u + du >= frame->width || !is_nearer(du, dv, best)) {
            continue;
        }
        int32_t depth = depth_mm_at(frame, rig, u + du, v + dv);
        if (depth > 0) {
            *best = (struct found){du, dv, du * du + dv * dv, depth};
        }
    }
}

int32_t ih_windows_pixel(const struct ih_frame *frame, const struct ih_rig *rig, int32_t reach_px,
                         int32_t *u_px, int32_t *v_px)
{
    struct found best = {0, 0, INT32_MAX, 0};
    for (int32_t radius = 0; radius <= reach_px && radius * radius <= best.distance2; radius++) {
        for (int32_t dv = -radius; dv <= radius; dv++) {
            search_row(frame, rig, *u_px, *v_px, radius, dv, &best);
        }
    }
    *u_px += best.du;
    *v_px += best.dv;
    return best.depth_mm;
}

/* The pixel in the middle of a cell; the last cell may reach beyond the frame. */
static int32_t middle_px(int32_t index, int32_t cell_px, int32_t side_px)
{
    return ih_min_s32(index * cell_px + cell_px / 2, side_px - 1);
}

int32_t ih_windows_connected_percent(const struct ih_windows_scratch *s)
{
    int32_t count = 0;
    int32_t connected = 0;
    for (int32_t cell = 0; cell < s->column_count * s->row_count; cell++) {
        bool counts = cell % s->column_count > 0 && s->depth_mm[cell] > 0;
        count += counts;
        connected += counts && s->depth_mm[cell - 1] > 0;
    }
    return count == 0 ? 100 : connected * 100 / count;
}

static int32_t direction_q28(int32_t px_q12, int32_t begin_px, int32_t focal_px_q16)
{
    const int64_t px_q16 = (px_q12 + (int64_t)begin_px * 4096) * 16;
    return ih_saturate_s32(ih_div_round(px_q16 * (1 << 28), focal_px_q16));
}

void ih_windows_direction(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                          int32_t u_px_q12, int32_t v_px_q12, int32_t *x_q28, int32_t *y_q28)
{
    if (rig->is_level) {
        ih_camera_undistort(rig, u_px_q12, v_px_q12, x_q28, y_q28);
    } else {
        *x_q28 = direction_q28(u_px_q12, s->left_px, rig->calibration.fx_px_q16);
        *y_q28 = direction_q28(v_px_q12, s->top_px, rig->calibration.fy_px_q16);
    }
}

/* Depth in the level frame at a place in the picture; IH_NONE outside of the frame. */
static int32_t level_depth_mm(const struct ih_windows_scratch *s, const struct ih_frame *frame,
                              const struct ih_rig *rig, int32_t reach_px, int32_t u, int32_t v)
{
    int32_t x_q28, y_q28, u_px_q12, v_px_q12;
    ih_windows_direction(s, rig, u * 4096, v * 4096, &x_q28, &y_q28);
    const int32_t depth_q28 = ih_level_rotate_back(rig, &x_q28, &y_q28);
    ih_camera_distort(rig, x_q28, y_q28, &u_px_q12, &v_px_q12);
    if (depth_q28 == 0 || !ih_camera_sees(rig, u_px_q12, v_px_q12)) {
        return IH_NONE;
    }
    u = (u_px_q12 + 2048) >> 12;
    v = (v_px_q12 + 2048) >> 12;
    const int64_t camera_mm = ih_windows_pixel(frame, rig, reach_px, &u, &v);
    const int64_t depth_mm =
        ih_min_s64(ih_div_round(camera_mm * (1 << 28), depth_q28), IH_DEPTH_MAX_MM);
    return depth_mm < IH_DEPTH_MIN_MM ? 0 : (int32_t)depth_mm;
}

/* Begin and length of what a level camera would see of the frame: of its corners and the middles of its sides. */
static void frame_picture(const struct ih_rig *rig, struct ih_windows_scratch *s)
{
    const struct ih_calibration *c = &rig->calibration;
    int32_t min_q28[2] = {INT32_MAX, INT32_MAX}, max_q28[2] = {INT32_MIN, INT32_MIN};
    for (int i = 0; i < 9; i++) {
        int32_t at_q28[2];
        ih_camera_undistort(rig, (c->width - 1) * 2048 * (i % 3), (c->height - 1) * 2048 * (i / 3),
                            &at_q28[0], &at_q28[1]);
        (void)ih_level_rotate(rig, &at_q28[0], &at_q28[1]);
        for (int axis = 0; axis < 2; axis++) {
            min_q28[axis] = ih_min_s32(min_q28[axis], at_q28[axis]);
            max_q28[axis] = ih_max_s32(max_q28[axis], at_q28[axis]);
        }
    }
    s->left_px = (int32_t)ih_mul_shift(min_q28[0], c->fx_px_q16, 44);
    s->top_px = (int32_t)ih_mul_shift(min_q28[1], c->fy_px_q16, 44);
    s->width_px = (int32_t)ih_mul_shift((int64_t)max_q28[0] - min_q28[0], c->fx_px_q16, 44) + 1;
    s->height_px = (int32_t)ih_mul_shift((int64_t)max_q28[1] - min_q28[1], c->fy_px_q16, 44) + 1;
}

static void survey(const struct ih_frame *frame, const struct ih_rig *rig, int32_t cell_px,
                   int32_t reach_px, struct ih_windows_scratch *s)
{
    s->cell_px = cell_px;
    s->column_count = (s->width_px + cell_px - 1) / cell_px;
    s->row_count = (s->height_px + cell_px - 1) / cell_px;
    for (int32_t cell = 0; cell < s->column_count * s->row_count; cell++) {
        int32_t u = middle_px(cell % s->column_count, cell_px, s->width_px);
        int32_t v = middle_px(cell / s->column_count, cell_px, s->height_px);
        s->depth_mm[cell] =
            (int16_t)(rig->is_level ? ih_windows_pixel(frame, rig, reach_px, &u, &v)
                                    : level_depth_mm(s, frame, rig, reach_px, u, v));
    }
}

int32_t ih_windows_survey(const struct ih_frame *frame, const struct ih_rig *rig,
                          struct ih_windows_scratch *s)
{
    int32_t min_px = 1;
    s->left_px = 0;
    s->top_px = 0;
    s->width_px = frame->width;
    s->height_px = frame->height;
    if (!rig->is_level) {
        frame_picture(rig, s);
    }
    while (((s->width_px + min_px - 1) / min_px) * ((s->height_px + min_px - 1) / min_px) >
           IH_WINDOWS_CELLS_MAX) {
        min_px++;
    }
    int32_t cell_px = min_px;
    survey(frame, rig, cell_px, ih_max_s32(1, cell_px / 2), s);
    for (int32_t i = 0;
         i < DOUBLINGS_MAX && ih_windows_connected_percent(s) < CONNECTED_MIN_PERCENT; i++) {
        cell_px *= 2;
        survey(frame, rig, cell_px, cell_px / 2, s);
    }
    if (cell_px == min_px) {
        return 0;
    }
    survey(frame, rig, cell_px / 2, cell_px / 2, s);
    return cell_px;
}
