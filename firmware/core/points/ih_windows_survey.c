#include "points/ih_windows_survey.h"

#include <stdbool.h>
#include <stddef.h>

#include "base/ih_fix.h"

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

static void survey(const struct ih_frame *frame, const struct ih_rig *rig, int32_t cell_px,
                   int32_t reach_px, struct ih_windows_scratch *s)
{
    s->cell_px = cell_px;
    s->column_count = (frame->width + cell_px - 1) / cell_px;
    s->row_count = (frame->height + cell_px - 1) / cell_px;
    for (int32_t cell = 0; cell < s->column_count * s->row_count; cell++) {
        int32_t u = middle_px(cell % s->column_count, cell_px, frame->width);
        int32_t v = middle_px(cell / s->column_count, cell_px, frame->height);
        s->depth_mm[cell] = (uint16_t)ih_windows_pixel(frame, rig, reach_px, &u, &v);
    }
}

int32_t ih_windows_survey(const struct ih_frame *frame, const struct ih_rig *rig,
                          struct ih_windows_scratch *s)
{
    int32_t min_px = 1;
    while (((frame->width + min_px - 1) / min_px) * ((frame->height + min_px - 1) / min_px) >
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
