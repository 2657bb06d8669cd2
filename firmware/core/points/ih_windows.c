#include "points/ih_windows.h"

#include <stdbool.h>
#include <stddef.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "rig/ih_camera.h"

#define HEAD_WIDTH_MM 150
#define CONNECTED_MIN_PERCENT 70
#define DOUBLINGS_MAX 5
/* Places nearer than this to a better one are not remembered. */
#define MERGE_MM 70
/* What counts for the mean of a place: this near to it, at most this much worse. */
#define MEAN_REACH_MM 70
#define MEAN_BEHIND_MM 80
#define MEAN_SCORE_LESS 80
/* A metre farther away is worth this much less. */
#define SCORE_PER_METRE 20

/* Probes for the plane, and the sums of their squares in x, and in y about PLANE_Y_MM. */
#define PLANE_PROBES 8
#define PLANE_Y_MM (-25)
#define PLANE_X2_MM2 145800
#define PLANE_Y2_MM2 25000
static const int16_t beside_mm[PLANE_PROBES][2] = {
    {-135, 50}, {135, 50}, {-135, 0}, {135, 0}, {-135, -50}, {135, -50}, {-135, -100}, {135, -100}};
/* This far from a plane is on it; less seen below says nothing. */
#define PLANE_OFF_MM 40
#define PLANE_SEEN_MIN 2

enum where { OUTSIDE, MISSING, BEFORE, WITHIN, BEHIND, WHERE_COUNT };

#define PROBES_MAX 13

/* Probes that should see the same: places in mm from the middle of a head's front, x right, y down;
 * what is from low_mm to high_mm behind that front is "within". */
struct group {
    int32_t share_percent; /* of the score */
    int32_t low_mm, high_mm;
    int32_t worth_percent[WHERE_COUNT];
    int32_t probe_count;
    int16_t probe_mm[PROBES_MAX][2];
};

enum { INSIDE, AROUND, BELOW, GROUP_COUNT };

/* The inner ones of INSIDE come first, for the bulge. */
#define INNER_COUNT 5
#define OUTER_MIN 3
#define BULGE_SHARE_PERCENT 10
#define BULGE_MM 15

static const struct group group[GROUP_COUNT] = {
    [INSIDE] = {.share_percent = 35,
                .low_mm = -40,
                .high_mm = 110,
                .worth_percent = {[OUTSIDE] = 50, [MISSING] = 30, [WITHIN] = 100},
                .probe_count = 13,
                .probe_mm = {{0, 0},
                             {-35, 0},
                             {35, 0},
                             {0, -45},
                             {0, 45},
                             {-40, -45},
                             {40, 45},
                             {-40, 45},
                             {40, -45},
                             {-58, 0},
                             {58, 0},
                             {0, -80},
                             {0, 80}}},
    /* Something before the head may hide what is beside it. */
    [AROUND] = {.share_percent = 40,
                .low_mm = -100,
                .high_mm = 89,
                .worth_percent = {[OUTSIDE] = 50, [MISSING] = 70, [BEFORE] = 40, [BEHIND] = 100},
                .probe_count = 13,
                .probe_mm = {{-135, 50},
                             {-135, 0},
                             {-135, -50},
                             {-120, -100},
                             {-80, -145},
                             {-40, -165},
                             {0, -170},
                             {40, -165},
                             {80, -145},
                             {120, -100},
                             {135, -50},
                             {135, 0},
                             {135, 50}}},
    [BELOW] = {.share_percent = 15,
               .low_mm = -149,
               .high_mm = 149,
               .worth_percent = {[OUTSIDE] = 50, [MISSING] = 30, [WITHIN] = 100},
               .probe_count = 7,
               .probe_mm =
                   {{0, 150}, {0, 200}, {-60, 230}, {60, 230}, {0, 260}, {-150, 260}, {150, 260}}},
};

void ih_windows_params_default(struct ih_windows_params *params)
{
    *params = (struct ih_windows_params){
        .window_max = IH_WINDOWS_MAX,
        .apart_mm = 200,
        .score_min = 720,
        .score_behind_max = 130,
        .width_min_q8 = 640,
    };
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

/* Percent of the cells with a depth, the first column left out, that have one at their left too. */
static int32_t connected_percent(const struct ih_windows_scratch *s)
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

/* Returns how far apart measured pixels are, as ih_window has it. */
static int32_t survey_frame(const struct ih_frame *frame, const struct ih_rig *rig,
                            struct ih_windows_scratch *s)
{
    int32_t min_px = 1;
    while (((frame->width + min_px - 1) / min_px) * ((frame->height + min_px - 1) / min_px) >
           IH_WINDOWS_CELLS_MAX) {
        min_px++;
    }
    int32_t cell_px = min_px;
    survey(frame, rig, cell_px, ih_max_s32(1, cell_px / 2), s);
    for (int32_t i = 0; i < DOUBLINGS_MAX && connected_percent(s) < CONNECTED_MIN_PERCENT; i++) {
        cell_px *= 2;
        survey(frame, rig, cell_px, cell_px / 2, s);
    }
    if (cell_px == min_px) {
        return 0;
    }
    survey(frame, rig, cell_px / 2, cell_px / 2, s);
    return cell_px;
}

/* Cells per mm at a depth. */
struct scale {
    int32_t u_q16, v_q16;
};

static struct scale scale_at(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                             int32_t depth_mm)
{
    struct scale scale = {rig->calibration.fx_px_q16 / (depth_mm * s->cell_px),
                          rig->calibration.fy_px_q16 / (depth_mm * s->cell_px)};
    IH_IN_RANGE(scale.u_q16, 0, IH_RANGE_SCALE_Q16);
    IH_IN_RANGE(scale.v_q16, 0, IH_RANGE_SCALE_Q16);
    return scale;
}

/* Depth of the cell under a probe, 0 where nothing was measured, IH_NONE beyond the edge. */
static int32_t probe_mm(const struct ih_windows_scratch *s, const struct ih_windows_place *at,
                        struct scale scale, const int16_t offset_mm[2])
{
    int32_t column = at->column + (int32_t)ih_shift_round((int64_t)offset_mm[0] * scale.u_q16, 16);
    int32_t row = at->row + (int32_t)ih_shift_round((int64_t)offset_mm[1] * scale.v_q16, 16);
    bool inside = column >= 0 && row >= 0 && column < s->column_count && row < s->row_count;
    return inside ? s->depth_mm[row * s->column_count + column] : IH_NONE;
}

static enum where where_is(int32_t depth_mm, int32_t front_mm, const struct group *g)
{
    if (depth_mm <= 0) {
        return depth_mm == 0 ? MISSING : OUTSIDE;
    }
    int32_t behind_mm = depth_mm - front_mm;
    return behind_mm < g->low_mm ? BEFORE : behind_mm > g->high_mm ? BEHIND : WITHIN;
}

/* Per mille of a head's full score that a group gives. */
static int32_t group_score(const struct ih_windows_scratch *s, const struct ih_windows_place *at,
                           struct scale scale, const struct group *g)
{
    int32_t worth_percent = 0;
    for (int32_t i = 0; i < g->probe_count; i++) {
        int32_t depth_mm = probe_mm(s, at, scale, g->probe_mm[i]);
        worth_percent += g->worth_percent[where_is(depth_mm, at->depth_mm, g)];
    }
    return worth_percent * g->share_percent / (10 * g->probe_count);
}

/* The same for the bulge: how far the outer part of the head lies behind its inner part. */
static int32_t bulge_score(const struct ih_windows_scratch *s, const struct ih_windows_place *at,
                           struct scale scale)
{
    const struct group *g = &group[INSIDE];
    int32_t sum_mm[2] = {0, 0};
    int32_t count[2] = {0, 0};
    for (int32_t i = 0; i < g->probe_count; i++) {
        int32_t depth_mm = probe_mm(s, at, scale, g->probe_mm[i]);
        if (where_is(depth_mm, at->depth_mm, g) == WITHIN) {
            sum_mm[i >= INNER_COUNT] += depth_mm;
            count[i >= INNER_COUNT]++;
        }
    }
    if (count[0] == 0 || count[1] < OUTER_MIN) {
        return BULGE_SHARE_PERCENT * 10 / 2;
    }
    int32_t bulge_mm = sum_mm[1] / count[1] - sum_mm[0] / count[0];
    return ih_clamp_s32(bulge_mm, 0, BULGE_MM) * BULGE_SHARE_PERCENT * 10 / BULGE_MM;
}

static int32_t score_of(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                        const struct ih_windows_params *params, const struct ih_windows_place *at)
{
    struct scale scale = scale_at(s, rig, at->depth_mm);
    if ((int64_t)HEAD_WIDTH_MM * scale.u_q16 < (int64_t)params->width_min_q8 * 256) {
        return 0;
    }
    int32_t score = bulge_score(s, at, scale) - at->depth_mm * SCORE_PER_METRE / 1000;
    for (int32_t i = 0; i < GROUP_COUNT; i++) {
        score += group_score(s, at, scale, &group[i]);
    }
    return ih_max_s32(score, 0);
}

/* Are two places, both seen at the depth of the nearer one, less than this apart? */
static bool are_near(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                     const struct ih_windows_place *a, const struct ih_windows_place *b,
                     int32_t apart_mm)
{
    int64_t near_mm_q16 = (int64_t)ih_min_s32(a->depth_mm, b->depth_mm) * s->cell_px * 65536;
    int64_t x_mm = (a->column - b->column) * near_mm_q16 / rig->calibration.fx_px_q16;
    int64_t y_mm = (a->row - b->row) * near_mm_q16 / rig->calibration.fy_px_q16;
    int64_t z_mm = a->depth_mm - b->depth_mm;
    return x_mm * x_mm + y_mm * y_mm + z_mm * z_mm < (int64_t)apart_mm * apart_mm;
}

/* Put a place where it belongs, unless a better one is near; worse ones that are near go. */
static void remember(struct ih_windows_scratch *s, const struct ih_rig *rig,
                     const struct ih_windows_place *place, struct ih_windows *out)
{
    int32_t kept = 0;
    for (int32_t i = 0; i < s->place_count; i++) {
        bool is_near = are_near(s, rig, &s->place[i], place, MERGE_MM);
        if (is_near && s->place[i].score >= place->score) {
            return; /* nothing was moved yet: better ones come first */
        }
        if (!is_near) {
            s->place[kept++] = s->place[i];
        }
    }
    s->place_count = kept;
    if (kept == IH_WINDOWS_PLACES_MAX) {
        out->places_dropped++;
        if (s->place[kept - 1].score >= place->score) {
            return;
        }
        s->place_count--;
    }
    int32_t at = s->place_count++;
    for (; at > 0 && s->place[at - 1].score < place->score; at--) {
        s->place[at] = s->place[at - 1];
    }
    s->place[at] = *place;
}

/* A cell as a place with its score. */
static struct ih_windows_place place_at(const struct ih_windows_scratch *s,
                                        const struct ih_rig *rig,
                                        const struct ih_windows_params *params, int32_t column,
                                        int32_t row)
{
    struct ih_windows_place place = {(int16_t)column, (int16_t)row,
                                     (int16_t)s->depth_mm[row * s->column_count + column], 0};
    if (place.depth_mm > 0) {
        place.score = (int16_t)score_of(s, rig, params, &place);
        IH_IN_RANGE(place.score, 0, IH_RANGE_WINDOW_SCORE);
    }
    return place;
}

static void collect_places(struct ih_windows_scratch *s, const struct ih_rig *rig,
                           const struct ih_windows_params *params, struct ih_windows *out)
{
    s->place_count = 0;
    for (int32_t row = 0; row < s->row_count; row++) {
        for (int32_t column = 0; column < s->column_count; column++) {
            struct ih_windows_place place = place_at(s, rig, params, column, row);
            if (place.score >= params->score_min && place.score > 0) {
                remember(s, rig, &place, out);
            }
        }
    }
}

static int32_t mean_px_q12(int64_t weighted, int64_t weight, const struct ih_windows_scratch *s)
{
    return (int32_t)ih_div_round(weighted * s->cell_px * 4096, weight) + s->cell_px / 2 * 4096;
}

static void place_window(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                         const struct ih_windows_params *params,
                         const struct ih_windows_place *best, struct ih_window *out)
{
    struct scale scale = scale_at(s, rig, best->depth_mm);
    int32_t reach_u = (int32_t)ih_shift_round((int64_t)MEAN_REACH_MM * scale.u_q16, 16);
    int32_t reach_v = (int32_t)ih_shift_round((int64_t)MEAN_REACH_MM * scale.v_q16, 16);
    int32_t last_u = ih_min_s32(best->column + reach_u, s->column_count - 1);
    int32_t last_v = ih_min_s32(best->row + reach_v, s->row_count - 1);
    int64_t weights = 0;
    int64_t u = 0;
    int64_t v = 0;
    int64_t depth_mm = 0;
    for (int32_t row = ih_max_s32(best->row - reach_v, 0); row <= last_v; row++) {
        for (int32_t column = ih_max_s32(best->column - reach_u, 0); column <= last_u; column++) {
            struct ih_windows_place place = place_at(s, rig, params, column, row);
            int32_t weight = place.score - best->score + MEAN_SCORE_LESS;
            if (weight <= 0 || ih_abs_s32(place.depth_mm - best->depth_mm) > MEAN_BEHIND_MM) {
                continue;
            }
            weights += weight;
            u += (int64_t)weight * column;
            v += (int64_t)weight * row;
            depth_mm += (int64_t)weight * place.depth_mm;
        }
    }
    ih_camera_undistort(rig, mean_px_q12(u, weights, s), mean_px_q12(v, weights, s), &out->x_q28,
                        &out->y_q28);
    out->depth_mm_q8 = (int32_t)ih_div_round(depth_mm * 256, weights);
    IH_IN_RANGE(out->depth_mm_q8, IH_DEPTH_MIN_MM << 8, IH_DEPTH_MAX_MM << 8);
    out->score = best->score;
}

/* Inverse depth at probes, which is linear in x and y where a plane is seen: 2^30 per mm, in x and
 * y per mm of the template and times 65536. */
struct plane {
    int64_t middle_q30, x_q46, y_q46;
};

/* Is what a probe saw on the plane? */
static bool is_on_plane(const struct plane *plane, const int16_t probe_mm[2], int32_t depth_mm)
{
    int64_t inverse_q30 =
        plane->middle_q30 + (plane->x_q46 * probe_mm[0] + plane->y_q46 * probe_mm[1]) / 65536;
    return inverse_q30 > 0 && ih_abs_s64((1 << 30) / inverse_q30 - depth_mm) <= PLANE_OFF_MM;
}

/* The plane on which all probes beside a head lie; false where there is none. There are as many
 * left as right, and their rows are symmetric about PLANE_Y_MM: least squares are sums. */
static bool find_plane(const struct ih_windows_scratch *s, const struct ih_windows_place *at,
                       struct scale scale, struct plane *plane)
{
    int32_t depth_mm[PLANE_PROBES];
    int64_t sum = 0;
    int64_t sum_x = 0;
    int64_t sum_y = 0;
    for (int32_t i = 0; i < PLANE_PROBES; i++) {
        depth_mm[i] = probe_mm(s, at, scale, beside_mm[i]);
        if (depth_mm[i] <= 0) {
            return false;
        }
        int64_t inverse_q30 = (1 << 30) / depth_mm[i];
        sum += inverse_q30;
        sum_x += inverse_q30 * beside_mm[i][0];
        sum_y += inverse_q30 * (beside_mm[i][1] - PLANE_Y_MM);
    }
    plane->x_q46 = sum_x * 65536 / PLANE_X2_MM2;
    plane->y_q46 = sum_y * 65536 / PLANE_Y2_MM2;
    plane->middle_q30 = sum / PLANE_PROBES - PLANE_Y_MM * plane->y_q46 / 65536;
    for (int32_t i = 0; i < PLANE_PROBES; i++) {
        if (!is_on_plane(plane, beside_mm[i], depth_mm[i])) {
            return false;
        }
    }
    return true;
}

/* Does a plane that is seen beside the place go on below it? */
static bool stands_on_plane(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                            const struct ih_windows_place *at)
{
    const struct group *g = &group[BELOW];
    struct scale scale = scale_at(s, rig, at->depth_mm);
    struct plane plane;
    int32_t seen = 0;
    int32_t on_plane = 0;
    if (!find_plane(s, at, scale, &plane)) {
        return false;
    }
    for (int32_t i = 0; i < g->probe_count; i++) {
        int32_t depth_mm = probe_mm(s, at, scale, g->probe_mm[i]);
        seen += depth_mm > 0;
        on_plane += depth_mm > 0 && is_on_plane(&plane, g->probe_mm[i], depth_mm);
    }
    return seen >= PLANE_SEEN_MIN && 3 * on_plane >= 2 * seen;
}

/* Is one of the better places, a window or not, the same thing? */
static bool has_better(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                       const struct ih_windows_params *params, int32_t index)
{
    for (int32_t i = 0; i < index; i++) {
        if (are_near(s, rig, &s->place[i], &s->place[index], params->apart_mm)) {
            return true;
        }
    }
    return false;
}

enum ih_err ih_windows_find(const struct ih_frame *frame, const struct ih_rig *rig,
                            const struct ih_windows_params *params,
                            struct ih_windows_scratch *scratch, struct ih_windows *out)
{
    out->window_count = 0;
    out->places_dropped = 0;
    if (rig->calibration.kind != IH_RIG_RANGE || frame->bytes_per_sample != 2) {
        return IH_ERR_KIND;
    }
    int32_t spacing_px = survey_frame(frame, rig, scratch);
    collect_places(scratch, rig, params, out);
    for (int32_t i = 0; i < scratch->place_count && out->window_count < params->window_max; i++) {
        const struct ih_windows_place *place = &scratch->place[i];
        bool is_good = scratch->place[0].score - place->score <= params->score_behind_max;
        if (is_good && !has_better(scratch, rig, params, i) &&
            !stands_on_plane(scratch, rig, place)) {
            struct ih_window *window = &out->window[out->window_count++];
            place_window(scratch, rig, params, place, window);
            window->spacing_px = spacing_px;
        }
    }
    return IH_OK;
}
