#include "points/ih_points.h"

#include <stdbool.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "points/ih_windows_survey.h"
#include "rig/ih_camera.h"
#include "rig/ih_level.h"

/* Bounds the search for a measured pixel around a lattice point. */
#define REACH_MAX_PX 32
#define LATTICE_HALF ((IH_GRID - 1) / 2)

void ih_points_params_default(struct ih_points_params *params)
{
    *params = (struct ih_points_params){
        .pitch_mm_q8 = 26 << 8, /* as the paper rig spans on a head at 0.85 m */
        .lower_q8 = 1 << 8,
    };
}

static int32_t normalised_q28(int64_t px_q12, int32_t principal_px_q16, int32_t focal_px_q16)
{
    return ih_saturate_s32(
        ih_div_round((px_q12 * 16 - principal_px_q16) * ((int64_t)1 << 28), focal_px_q16));
}

/* A point of the camera frame, whose depth is known, to the level frame. Out of view there it says nothing. */
static void set_seen(const struct ih_rig *rig, struct ih_point *point)
{
    const int32_t depth_q28 = ih_level_rotate(rig, &point->x_q28, &point->y_q28);
    const int64_t depth_mm_q8 = ih_mul_shift(point->depth_mm_q8, depth_q28, 28);
    point->depth_mm_q8 = (int32_t)ih_min_s64(depth_mm_q8, IH_DEPTH_MAX_MM << 8);
    point->state = IH_POINT_SEEN;
    if (depth_mm_q8 < 1 << 8) {
        point->depth_mm_q8 = 0;
        point->state = IH_POINT_UNKNOWN;
    }
}

static void point_of_dot(const struct ih_labels *labels, const struct ih_rig *rig, int32_t slot,
                         struct ih_point *out)
{
    const struct ih_calibration *c = &rig->calibration;
    const struct ih_line *line = &rig->line[slot];
    int64_t t = labels->t_px_q12[slot];
    /* length in Q8 over t in Q12: 12 more bits give Q8 */
    int64_t depth_q8 = ih_div_round((int64_t)line->length_px_mm_q8 * 4096, t);
    out->depth_mm_q8 = ih_clamp_s32(ih_saturate_s32(depth_q8), 1 << 8, c->far_mm << 8);
    IH_IN_RANGE(out->depth_mm_q8, 1 << 8, IH_DEPTH_MAX_MM << 8);
    out->x_q28 = normalised_q28(line->infinity_u_px_q12 + ih_mul_shift(t, line->dir_u_q30, 30),
                                c->cx_px_q16, c->fx_px_q16);
    out->y_q28 = normalised_q28(line->infinity_v_px_q12 + ih_mul_shift(t, line->dir_v_q30, 30),
                                c->cy_px_q16, c->fy_px_q16);
    set_seen(rig, out);
}

void ih_points_from_labels(const struct ih_labels *labels, const struct ih_rig *rig,
                           struct ih_points *out)
{
    out->field = rig->field;
    out->seen_count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        struct ih_point *point = &out->point[slot];
        if (labels->dot_of_slot[slot] != IH_NONE) {
            point_of_dot(labels, rig, slot, point);
        } else {
            const bool is_in_view = ih_level_dot_at(rig, slot, rig->calibration.far_mm << 8,
                                                    &point->x_q28, &point->y_q28);
            point->depth_mm_q8 = 0;
            point->state = is_in_view ? IH_POINT_MISSING : IH_POINT_UNKNOWN;
        }
        out->seen_count += point->state == IH_POINT_SEEN;
    }
}

static void place_field(const struct ih_points_params *params, const struct ih_window *window,
                        struct ih_field *out)
{
    int64_t pitch_q28 = ih_div_round((int64_t)params->pitch_mm_q8 << 28, window->depth_mm_q8);
    out->unit_q28 = (int32_t)(pitch_q28 / 2);
    IH_IN_RANGE(out->unit_q28, 1, IH_RANGE_UNIT_Q28);
    out->centre_x_q28 = window->x_q28;
    out->centre_y_q28 =
        ih_saturate_s32(window->y_q28 + ih_mul_shift(pitch_q28, params->lower_q8, 8));
}

/* How far around a slot's place a measured pixel is looked for. */
struct reach {
    int32_t seen_px;  /* one this near is the slot's point */
    int32_t known_px; /* none this near: a surface there would have been seen */
};

static struct reach reach_of(const struct ih_rig *rig, const struct ih_field *field,
                             const struct ih_window *window)
{
    int32_t quarter_px =
        (int32_t)ih_mul_shift(field->unit_q28 / 2, rig->calibration.fx_px_q16, 28 + 16);
    bool is_rare = window->spacing_px > 0;
    struct reach reach = {ih_clamp_s32(is_rare ? 2 * quarter_px : quarter_px, 1, REACH_MAX_PX), 0};
    reach.known_px = ih_max_s32(reach.seen_px, window->spacing_px * 5 / 4);
    return reach;
}

/* What was measured around the pixel where a slot stands, which is in the frame. */
static void measure(const struct ih_frame *frame, const struct ih_rig *rig,
                    const struct reach *reach, int32_t u, int32_t v, struct ih_point *out)
{
    int32_t found_u = u;
    int32_t found_v = v;
    int32_t depth_mm = ih_windows_pixel(frame, rig, reach->known_px, &found_u, &found_v);
    int32_t du = found_u - u;
    int32_t dv = found_v - v;
    if (depth_mm == 0) {
        out->state = IH_POINT_MISSING;
    } else if (du * du + dv * dv <= reach->seen_px * reach->seen_px) {
        out->depth_mm_q8 = depth_mm << 8;
        if (du != 0 || dv != 0 || !rig->is_level) {
            ih_camera_undistort(rig, found_u * 4096, found_v * 4096, &out->x_q28, &out->y_q28);
        }
        set_seen(rig, out);
    }
}

static void point_of_range(const struct ih_frame *frame, const struct ih_rig *rig,
                           const struct ih_field *field, const struct reach *reach, int32_t slot,
                           struct ih_point *out)
{
    int64_t column = slot % IH_GRID - LATTICE_HALF;
    int64_t row = slot / IH_GRID - LATTICE_HALF;
    out->x_q28 = ih_saturate_s32(field->centre_x_q28 + column * 2 * field->unit_q28);
    out->y_q28 = ih_saturate_s32(field->centre_y_q28 + row * 2 * field->unit_q28);
    out->depth_mm_q8 = 0;
    out->state = IH_POINT_UNKNOWN;
    int32_t u, v;
    bool in_view = ih_abs_s64(out->x_q28) < (int64_t)IH_RIG_TAN_MAX << 28 &&
                   ih_abs_s64(out->y_q28) < (int64_t)IH_RIG_TAN_MAX << 28;
    if (in_view && ih_level_sees(rig, out->x_q28, out->y_q28, &u, &v)) {
        measure(frame, rig, reach, (int32_t)ih_shift_round(u, 12), (int32_t)ih_shift_round(v, 12),
                out);
    }
}

enum ih_err ih_points_from_range(const struct ih_frame *frame, const struct ih_rig *rig,
                                 const struct ih_points_params *params,
                                 const struct ih_window *window, struct ih_points *out)
{
    if (rig->calibration.kind != IH_RIG_RANGE || frame->bytes_per_sample != 2) {
        return IH_ERR_KIND;
    }
    place_field(params, window, &out->field);
    struct reach reach = reach_of(rig, &out->field, window);
    out->seen_count = 0;
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        point_of_range(frame, rig, &out->field, &reach, slot, &out->point[slot]);
        out->seen_count += out->point[slot].state == IH_POINT_SEEN;
    }
    return IH_OK;
}
