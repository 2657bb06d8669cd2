#include "points/ih_windows_score.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"

#define HEAD_WIDTH_MM 150
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
    int32_t fraction_percent; /* of the score */
    int32_t low_mm, high_mm;
    int32_t worth_percent[WHERE_COUNT];
    int32_t probe_count;
    int16_t probe_mm[PROBES_MAX][2];
};

enum { INSIDE, AROUND, BELOW, GROUP_COUNT };

/* The inner ones of INSIDE come first, for the bulge. */
#define INNER_COUNT 5
#define OUTER_MIN 3
#define BULGE_FRACTION_PERCENT 10
#define BULGE_MM 15

static const struct group group[GROUP_COUNT] = {
    [INSIDE] = {.fraction_percent = 35,
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
    [AROUND] = {.fraction_percent = 40,
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
    [BELOW] = {.fraction_percent = 15,
               .low_mm = -149,
               .high_mm = 149,
               .worth_percent = {[OUTSIDE] = 50, [MISSING] = 30, [WITHIN] = 100},
               .probe_count = 7,
               .probe_mm =
                   {{0, 150}, {0, 200}, {-60, 230}, {60, 230}, {0, 260}, {-150, 260}, {150, 260}}},
};

struct ih_windows_scale ih_windows_scale_at(const struct ih_windows_scratch *s,
                                            const struct ih_rig *rig, int32_t depth_mm)
{
    struct ih_windows_scale scale = {rig->calibration.fx_px_q16 / (depth_mm * s->cell_px),
                                     rig->calibration.fy_px_q16 / (depth_mm * s->cell_px)};
    IH_IN_RANGE(scale.u_q16, 0, IH_RANGE_SCALE_Q16);
    IH_IN_RANGE(scale.v_q16, 0, IH_RANGE_SCALE_Q16);
    return scale;
}

/* Depth of the cell under a probe, 0 where nothing was measured, IH_NONE beyond the edge. */
static int32_t probe_mm(const struct ih_windows_scratch *s, const struct ih_windows_place *at,
                        struct ih_windows_scale scale, const int16_t offset_mm[2])
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
                           struct ih_windows_scale scale, const struct group *g)
{
    int32_t worth_percent = 0;
    for (int32_t i = 0; i < g->probe_count; i++) {
        int32_t depth_mm = probe_mm(s, at, scale, g->probe_mm[i]);
        worth_percent += g->worth_percent[where_is(depth_mm, at->depth_mm, g)];
    }
    return worth_percent * g->fraction_percent / (10 * g->probe_count);
}

/* The same for the bulge: how far the outer part of the head lies behind its inner part. */
static int32_t bulge_score(const struct ih_windows_scratch *s, const struct ih_windows_place *at,
                           struct ih_windows_scale scale)
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
        return BULGE_FRACTION_PERCENT * 10 / 2;
    }
    int32_t bulge_mm = sum_mm[1] / count[1] - sum_mm[0] / count[0];
    return ih_clamp_s32(bulge_mm, 0, BULGE_MM) * BULGE_FRACTION_PERCENT * 10 / BULGE_MM;
}

int32_t ih_windows_score(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                         const struct ih_windows_params *params, const struct ih_windows_place *at)
{
    struct ih_windows_scale scale = ih_windows_scale_at(s, rig, at->depth_mm);
    if ((int64_t)HEAD_WIDTH_MM * scale.u_q16 < (int64_t)params->width_min_q8 * 256) {
        return 0;
    }
    int32_t score = bulge_score(s, at, scale) - at->depth_mm * SCORE_PER_METRE / 1000;
    for (int32_t i = 0; i < GROUP_COUNT; i++) {
        score += group_score(s, at, scale, &group[i]);
    }
    return ih_max_s32(score, 0);
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
                       struct ih_windows_scale scale, struct plane *plane)
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

bool ih_windows_stands_on_plane(const struct ih_windows_scratch *s, const struct ih_rig *rig,
                                const struct ih_windows_place *at)
{
    const struct group *g = &group[BELOW];
    struct ih_windows_scale scale = ih_windows_scale_at(s, rig, at->depth_mm);
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
