#include "pose/ih_pose_look.h"

#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "detect/ih_head_model.h"
#include "pose/ih_pose_table.h"

/* Standard deviation of a dot along its line, px in Q8; of a range image's depths, mm in Q8. */
#define DOT_SIGMA_PX_Q8 33
#define RANGE_SIGMA_MM_Q8 384
/* A cell with this weight gives half of its mean depth, Q12 as after the blur. */
#define FEW_Q12 614
#define COVER_MAX_Q5 40
#define FEATURE_MAX_Q5 127
/* Dots farther apart than this show nothing of a head. */
#define SPACING_MAX_MM_Q8 (1 << 18)

/* A grid: its cells are 2^shift mm apart; depths are counted from `offset_mm` before the centre, in units of
 * 2^unit_shift mm. */
struct grid {
    int32_t rows, shift, top_mm;
    int32_t from_mm, to_mm; /* depths against the centre's */
    int32_t offset_mm, unit_shift;
};

static const struct grid head_grid = {IH_POSE_HEAD_ROWS, 5, -128, -176, 112, 32, 6};
static const struct grid body_grid = {IH_POSE_BODY_ROWS, 6, 160, -256, 256, 0, 7};

/* The camera's vertical plane through the head's centre. */
struct head_plane {
    const int32_t *centre_mm_q8;
    int64_t cos_q14, sin_q14;
    int32_t distance_mm_q8; /* on the level */
    int32_t spacing_mm_q8;  /* of neighbouring dots there */
};

static bool plane_of(const int32_t centre_mm_q8[3], const struct ih_points *points,
                     struct head_plane *out)
{
    const int64_t x = centre_mm_q8[0];
    const int64_t z = centre_mm_q8[2];
    if (z < 256) {
        return false;
    }
    const int64_t distance = ih_isqrt_u64((uint64_t)(x * x + z * z));
    *out = (struct head_plane){
        .centre_mm_q8 = centre_mm_q8,
        .cos_q14 = ih_div_round(z * 16384, distance),
        .sin_q14 = ih_div_round(x * 16384, distance),
        .distance_mm_q8 = (int32_t)distance,
        .spacing_mm_q8 = (int32_t)ih_min_s64(
            ih_mul_shift(distance, 2 * (int64_t)points->field.unit_q28, 28), SPACING_MAX_MM_Q8),
    };
    return true;
}

/* A point in the plane's frame, against the centre. */
static void place(const struct ih_point *point, const struct head_plane *plane,
                  int32_t out_mm_q8[3])
{
    const int64_t x = ih_mul_shift(point->depth_mm_q8, point->x_q28, 28) - plane->centre_mm_q8[0];
    const int64_t y = ih_mul_shift(point->depth_mm_q8, point->y_q28, 28) - plane->centre_mm_q8[1];
    const int64_t z = (int64_t)point->depth_mm_q8 - plane->centre_mm_q8[2];
    out_mm_q8[0] = ih_saturate_s32(ih_shift_round(plane->cos_q14 * x - plane->sin_q14 * z, 14));
    out_mm_q8[1] = ih_saturate_s32(y);
    out_mm_q8[2] = ih_saturate_s32(ih_shift_round(plane->sin_q14 * x + plane->cos_q14 * z, 14));
}

/* Bilinear, as far as the four cells are in the grid. */
static void spread(const int32_t place_mm_q8[3], const struct grid *grid,
                   struct ih_pose_cells *cells)
{
    const int32_t column_q8 =
        (int32_t)ih_shift_round(place_mm_q8[0], grid->shift) + (IH_POSE_COLUMNS / 2) * 256;
    const int32_t row_q8 =
        (int32_t)ih_shift_round((int64_t)place_mm_q8[1] - grid->top_mm * 256, grid->shift);
    const int32_t depth_mm_q2 = (int32_t)ih_shift_round(place_mm_q8[2], 6);
    for (int32_t corner = 0; corner < 4; corner++) {
        const int32_t column = (column_q8 >> 8) + (corner & 1);
        const int32_t row = (row_q8 >> 8) + (corner >> 1);
        const int32_t across_q8 = (corner & 1) != 0 ? column_q8 & 255 : 256 - (column_q8 & 255);
        const int32_t down_q8 = (corner & 2) != 0 ? row_q8 & 255 : 256 - (row_q8 & 255);
        if (column >= 0 && column < IH_POSE_COLUMNS && row >= 0 && row < grid->rows) {
            const int32_t weight_q8 = (across_q8 * down_q8 + 128) >> 8;
            cells->weight_q8[row * IH_POSE_COLUMNS + column] += weight_q8;
            cells->depth_mm_q10[row * IH_POSE_COLUMNS + column] += weight_q8 * depth_mm_q2;
        }
    }
}

/* The points on a grid are spread over its cells; returns how many lie on its middle cells. */
static int32_t fill(const struct ih_points *points, const struct head_plane *plane,
                    const struct grid *grid, struct ih_pose_cells *cells)
{
    const int32_t aside_mm_q8 = (IH_POSE_COLUMNS + 1) / 2 << (grid->shift + 8);
    int32_t count = 0;
    memset(cells, 0, sizeof *cells);
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        int32_t at_mm_q8[3];
        if (points->point[slot].state != IH_POINT_SEEN) {
            continue;
        }
        place(&points->point[slot], plane, at_mm_q8);
        const int32_t below_mm_q8 = ih_saturate_s32((int64_t)at_mm_q8[1] - grid->top_mm * 256);
        if (at_mm_q8[2] > grid->from_mm * 256 && at_mm_q8[2] < grid->to_mm * 256 &&
            at_mm_q8[0] > -aside_mm_q8 && at_mm_q8[0] < aside_mm_q8 &&
            below_mm_q8 > -(256 << grid->shift) && below_mm_q8 < grid->rows << (grid->shift + 8)) {
            spread(at_mm_q8, grid, cells);
            count++;
        }
    }
    return count;
}

/* 1-2-1 along a line of cells, in place. */
static void blur_line(int32_t *cell, int32_t count, int32_t step)
{
    int32_t before = 0;
    for (int32_t i = 0; i < count; i++) {
        const int32_t here = cell[i * step];
        const int32_t after = i + 1 < count ? cell[(i + 1) * step] : 0;
        cell[i * step] = before + 2 * here + after;
        before = here;
    }
}

static void blur(int32_t *cell, int32_t rows)
{
    for (int32_t column = 0; column < IH_POSE_COLUMNS; column++) {
        blur_line(&cell[column], rows, IH_POSE_COLUMNS);
    }
    for (int32_t row = 0; row < rows; row++) {
        blur_line(&cell[row * IH_POSE_COLUMNS], IH_POSE_COLUMNS, 1);
    }
}

static int8_t feature(int64_t value_q5)
{
    return (int8_t)ih_clamp_s64(value_q5, FEATURE_MAX_Q5);
}

/* A grid's features, depths first, as seen and mirrored; returns where the next ones go. */
static int32_t add_grid(const struct grid *grid, const struct head_plane *plane,
                        struct ih_pose_look_scratch *scratch, int32_t first)
{
    const int32_t *weight_q12 = scratch->cells.weight_q8; /* Q12 once they are blurred */
    const int32_t *depth_mm_q14 = scratch->cells.depth_mm_q10;
    const int32_t count = grid->rows * IH_POSE_COLUMNS;
    const int64_t spacing2_q16 = (int64_t)plane->spacing_mm_q8 * plane->spacing_mm_q8;
    blur(scratch->cells.weight_q8, grid->rows);
    blur(scratch->cells.depth_mm_q10, grid->rows);
    for (int32_t i = 0; i < count; i++) {
        const int32_t mirrored =
            i - i % IH_POSE_COLUMNS + IH_POSE_COLUMNS - 1 - i % IH_POSE_COLUMNS;
        const int64_t depth_q14 = depth_mm_q14[i] + (int64_t)grid->offset_mm * 4 * weight_q12[i];
        const int8_t depth = feature(
            ih_div_round(depth_q14 * 8, ((int64_t)weight_q12[i] + FEW_Q12) << grid->unit_shift));
        /* weight / (cell / spacing)^2: Q28 of mm^2 over 2^(2 shift) mm^2, to Q5 */
        const int64_t cover_q5 = ih_shift_round(weight_q12[i] * spacing2_q16, 23 + 2 * grid->shift);
        const int8_t cover = (int8_t)ih_min_s64(cover_q5, COVER_MAX_Q5);
        scratch->feature_q5[0][first + i] = depth;
        scratch->feature_q5[1][first + mirrored] = depth;
        scratch->feature_q5[0][first + count + i] = cover;
        scratch->feature_q5[1][first + count + mirrored] = cover;
    }
    return first + 2 * count;
}

/* Standard deviation of a depth there. */
static int64_t sigma_mm_q8(const struct ih_rig *rig, const struct head_plane *plane)
{
    if (rig->calibration.kind == IH_RIG_RANGE) {
        return RANGE_SIGMA_MM_Q8;
    }
    const int64_t distance = plane->distance_mm_q8;
    const int64_t length_q8 = ih_max_s32(rig->line[IH_SLOTS / 2].length_px_mm_q8, 1);
    return ih_min_s64(
        ih_div_round(ih_shift_round(distance * distance, 8) * DOT_SIGMA_PX_Q8, length_q8), 1 << 24);
}

static void add_others(const struct ih_rig *rig, const struct ih_ellipsoid *head,
                       const struct head_plane *plane, struct ih_pose_look_scratch *scratch,
                       int32_t first)
{
    const int64_t sigma = sigma_mm_q8(rig, plane);
    const int8_t other_q5[] = {
        feature(ih_div_round((int64_t)head->centre_mm_q8[1] * 96, plane->distance_mm_q8)),
        feature(ih_shift_round(plane->distance_mm_q8, 13) - 32),
        feature(ih_div_round(64 * sigma, sigma + 8 * 256) - 32),
        feature(ih_shift_round(head->semi_mm_q8[0] - IH_HEAD_SEMI_X_MM * 256, 7)),
        feature(ih_shift_round(head->semi_mm_q8[1] - IH_HEAD_SEMI_Y_MM * 256, 7)),
    };
    memcpy(scratch->feature_q5[0] + first, other_q5, sizeof other_q5);
    memcpy(scratch->feature_q5[1] + first, other_q5, sizeof other_q5);
}

bool ih_pose_look_features(const struct ih_points *points, const struct ih_rig *rig,
                           const struct ih_ellipsoid *head, int32_t points_min,
                           struct ih_pose_look_scratch *scratch)
{
    struct head_plane plane;
    if (!plane_of(head->centre_mm_q8, points, &plane) ||
        fill(points, &plane, &head_grid, &scratch->cells) < points_min) {
        return false;
    }
    int32_t next = add_grid(&head_grid, &plane, scratch, 0);
    (void)fill(points, &plane, &body_grid, &scratch->cells);
    next = add_grid(&body_grid, &plane, scratch, next);
    add_others(rig, head, &plane, scratch, next);
    return true;
}

static int32_t log2_q10(const struct ih_pose_means *means, int32_t mean, const int8_t *feature_q5)
{
    const int8_t *line_q5 = means->line_q5[mean];
    const int8_t *square_q5 = means->square_q5[mean];
    int32_t sum_q15 = 0;
    for (int32_t i = 0; i < IH_POSE_FEATURES; i++) {
        sum_q15 += feature_q5[i] * (line_q5[i] * 32 + square_q5[i] * feature_q5[i]);
    }
    return means->bias_q10[mean] + (int32_t)ih_shift_round(sum_q15, 5);
}

void ih_pose_look_weigh(const struct ih_pose_means *means,
                        const struct ih_pose_look_scratch *scratch, struct ih_pose_likelihood *out)
{
    const int32_t half = IH_POSE_YAWS / 2;
    for (int32_t i = 0; i < half; i++) {
        out->log2_q10[i] = log2_q10(means, i, scratch->feature_q5[0]);
        out->log2_q10[IH_POSE_YAWS - 1 - i] = log2_q10(means, i, scratch->feature_q5[1]);
    }
    for (int32_t i = 0; i < IH_POSE_PITCHES; i++) {
        out->log2_q10[IH_POSE_YAWS + i] = log2_q10(means, half + i, scratch->feature_q5[0]);
    }
}
