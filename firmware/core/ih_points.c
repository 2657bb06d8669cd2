#include "ih_points.h"

#include <stddef.h>

#include "ih_fix.h"

/* A range image is surveyed at about this many pixels along its longer side. */
#define SURVEY_SIDE 160
#define SURVEY_BIN_MM 64
#define SURVEY_BINS (IH_DEPTH_MAX_MM / SURVEY_BIN_MM + 1)
/* Bounds the search for a measured pixel around a lattice point. */
#define SAMPLE_REACH_MAX_PX 8
#define LATTICE_HALF ((IH_GRID - 1) / 2)

void ih_points_params_default(struct ih_points_params *params)
{
    *params = (struct ih_points_params){
        .pitch_mm_q8 = 29 << 8, /* the paper rig spans 26 mm on a head at 0.85 m */
        .reach_mm = 350,
        .headroom_q8 = 3 << 8,
        .top_width_mm = 60,
    };
}

static int32_t normalised_q28(int64_t px_q12, int32_t principal_px_q16, int32_t focal_px_q16)
{
    return ih_saturate_s32(
        ih_div_round((px_q12 * 16 - principal_px_q16) * ((int64_t)1 << 28), focal_px_q16));
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
    out->x_q28 = normalised_q28(line->infinity_u_px_q12 + ih_mul_shift(t, line->dir_u_q30, 30),
                                c->cx_px_q16, c->fx_px_q16);
    out->y_q28 = normalised_q28(line->infinity_v_px_q12 + ih_mul_shift(t, line->dir_v_q30, 30),
                                c->cy_px_q16, c->fy_px_q16);
    out->state = IH_POINT_SEEN;
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
            out->seen_count++;
        } else {
            ih_rig_dot_at(rig, slot, rig->calibration.far_mm << 8, &point->x_q28, &point->y_q28);
            point->depth_mm_q8 = 0;
            point->state = IH_POINT_MISSING;
        }
    }
}

/* Depth of a pixel in the working range, else 0. */
static int32_t depth_mm_at(const struct ih_frame *frame, const struct ih_rig *rig, int32_t u,
                           int32_t v)
{
    const uint8_t *row = (const uint8_t *)frame->samples + (size_t)v * (size_t)frame->stride_bytes;
    int32_t depth = ((const uint16_t *)(const void *)row)[u];
    bool in_range = depth >= rig->calibration.near_mm && depth <= rig->calibration.far_mm;
    return in_range ? depth : 0;
}

static int32_t survey_step(const struct ih_frame *frame)
{
    return 1 + ih_max_s32(frame->width, frame->height) / SURVEY_SIDE;
}

/* The depth of the nearest tenth of what is measured, mm; 0 when nothing is. */
static int32_t near_depth_mm(const struct ih_frame *frame, const struct ih_rig *rig)
{
    uint16_t histogram[SURVEY_BINS] = {0};
    int32_t step = survey_step(frame);
    int32_t count = 0;
    for (int32_t v = 0; v < frame->height; v += step) {
        for (int32_t u = 0; u < frame->width; u += step) {
            int32_t depth = depth_mm_at(frame, rig, u, v);
            if (depth > 0) {
                histogram[depth / SURVEY_BIN_MM]++; /* at most 160^2 in all */
                count++;
            }
        }
    }
    int32_t bin = 0;
    for (int32_t below = 0; bin < SURVEY_BINS && below + histogram[bin] <= count / 10; bin++) {
        below += histogram[bin];
    }
    return count == 0 ? 0 : bin * SURVEY_BIN_MM + SURVEY_BIN_MM / 2;
}

/* The first run of near pixels in a row that is at least width_px long. */
static bool find_near_run(const struct ih_frame *frame, const struct ih_rig *rig, int32_t v,
                          int32_t far_mm, int32_t width_px, int32_t *first_px, int32_t *last_px)
{
    int32_t step = survey_step(frame);
    int32_t first = IH_NONE;
    int32_t last = IH_NONE;
    for (int32_t u = 0; u < frame->width; u += step) {
        int32_t depth = depth_mm_at(frame, rig, u, v);
        bool is_near = depth > 0 && depth <= far_mm;
        if (!is_near && first != IH_NONE && last - first >= width_px) {
            break;
        }
        first = !is_near ? IH_NONE : first == IH_NONE ? u : first;
        last = u;
    }
    *first_px = first;
    *last_px = last;
    return first != IH_NONE && last - first >= width_px;
}

/* Where a head would be among what is near: the highest row that is near over the width of a head,
 * and the middle of its first run. False when there is none. */
static bool find_top(const struct ih_frame *frame, const struct ih_rig *rig, int32_t near_mm,
                     const struct ih_points_params *params, int32_t *u_px, int32_t *v_px)
{
    int32_t width_px =
        (int32_t)(((int64_t)rig->calibration.fx_px_q16 * params->top_width_mm / near_mm) >> 16);
    for (int32_t v = 0; v < frame->height; v += survey_step(frame)) {
        int32_t first, last;
        if (find_near_run(frame, rig, v, near_mm + params->reach_mm, width_px, &first, &last)) {
            *u_px = (first + last) / 2;
            *v_px = v;
            return true;
        }
    }
    return false;
}

static void place_field(const struct ih_frame *frame, const struct ih_rig *rig,
                        const struct ih_points_params *params, struct ih_field *out)
{
    int32_t near_mm = ih_max_s32(near_depth_mm(frame, rig), rig->calibration.near_mm);
    int64_t pitch_q28 = ih_div_round((int64_t)params->pitch_mm_q8 * (1 << 20), near_mm);
    int32_t u = frame->width / 2;
    int32_t v = frame->height / 2;
    bool found = find_top(frame, rig, near_mm, params, &u, &v);
    out->unit_q28 = (int32_t)(pitch_q28 / 2);
    ih_rig_undistort(rig, u * 4096, v * 4096, &out->centre_x_q28, &out->centre_y_q28);
    if (found) {
        int64_t down_q28 =
            pitch_q28 * LATTICE_HALF - ih_mul_shift(pitch_q28, params->headroom_q8, 8);
        out->centre_y_q28 = ih_saturate_s32(out->centre_y_q28 + down_q28);
    }
}

/* The nearest measured pixel within reach of (u, v); the first of equals in reading order. */
static int32_t sample_depth_mm(const struct ih_frame *frame, const struct ih_rig *rig, int32_t u,
                               int32_t v, int32_t reach_px)
{
    int32_t best_mm = 0;
    int32_t best_d2 = reach_px * reach_px + 1;
    for (int32_t dv = -reach_px; dv <= reach_px; dv++) {
        for (int32_t du = -reach_px; du <= reach_px; du++) {
            int32_t d2 = du * du + dv * dv;
            bool inside =
                u + du >= 0 && v + dv >= 0 && u + du < frame->width && v + dv < frame->height;
            int32_t depth = inside && d2 < best_d2 ? depth_mm_at(frame, rig, u + du, v + dv) : 0;
            if (depth > 0) {
                best_mm = depth;
                best_d2 = d2;
            }
        }
    }
    return best_mm;
}

static void point_of_range(const struct ih_frame *frame, const struct ih_rig *rig, int32_t slot,
                           int32_t reach_px, struct ih_points *out)
{
    struct ih_point *point = &out->point[slot];
    int64_t column = slot % IH_GRID - LATTICE_HALF;
    int64_t row = slot / IH_GRID - LATTICE_HALF;
    point->x_q28 = ih_saturate_s32(out->field.centre_x_q28 + column * 2 * out->field.unit_q28);
    point->y_q28 = ih_saturate_s32(out->field.centre_y_q28 + row * 2 * out->field.unit_q28);
    point->depth_mm_q8 = 0;
    point->state = IH_POINT_UNKNOWN;
    int32_t u, v;
    ih_rig_distort(rig, point->x_q28, point->y_q28, &u, &v);
    bool in_view = ih_abs_s64(point->x_q28) < (int64_t)IH_RIG_TAN_MAX << 28 &&
                   ih_abs_s64(point->y_q28) < (int64_t)IH_RIG_TAN_MAX << 28;
    if (in_view && ih_rig_inside(rig, u, v)) {
        int32_t depth = sample_depth_mm(frame, rig, (int32_t)ih_shift_round(u, 12),
                                        (int32_t)ih_shift_round(v, 12), reach_px);
        point->state = depth > 0 ? IH_POINT_SEEN : IH_POINT_MISSING;
        point->depth_mm_q8 = depth << 8;
        out->seen_count += depth > 0;
    }
}

enum ih_err ih_points_from_range(const struct ih_frame *frame, const struct ih_rig *rig,
                                 const struct ih_points_params *params, struct ih_points *out)
{
    if (rig->calibration.kind != IH_RIG_RANGE || frame->bytes_per_sample != 2) {
        return IH_ERR_KIND;
    }
    place_field(frame, rig, params, &out->field);
    out->seen_count = 0;
    int64_t quarter_pitch_px =
        ih_mul_shift(out->field.unit_q28 / 2, rig->calibration.fx_px_q16, 28 + 16);
    int32_t reach_px = ih_clamp_s32((int32_t)quarter_pitch_px, 1, SAMPLE_REACH_MAX_PX);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        point_of_range(frame, rig, slot, reach_px, out);
    }
    return IH_OK;
}
