#include "nests/ih_nests.h"

#include <string.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"

/* A slice's area as a part of the one before: below this the nest shrinks and ends. */
#define SHRINK_MIN_Q16 39322 /* 0.6 */
/* Beyond end_depth_mm a slice that is more than this many times, plus this many mm^2, larger than
 * the one before belongs to something else: the shoulders, a wall. */
#define JUMP_Q16 209715 /* 3.2 */
#define JUMP_MM2 2500
/* An ellipsoid of a head's size grows by this area per mm of depth at its front: 2 pi a b / c for
 * semi-axes of 78, 113 and 98 mm. */
#define FRONT_GROWTH_MM 565

void ih_nests_params_default(struct ih_nests_params *params)
{
    ih_ellipse_params_default(&params->ellipse);
    params->level_step_mm = 20;
    params->levels_behind_mm = 700;
    params->blunt_mm2 = 2000;
    params->tip_max_mm = 70;
    params->depth_max_mm = 80;
    params->end_depth_mm = 50;
    params->gap_max = 2;
    params->free_mm = 200;
    params->free_behind_mm = 80;
    params->is_tip_any = true;
    params->is_merging = true;
}

void ih_nests_params_paper(struct ih_nests_params *params)
{
    ih_nests_params_default(params);
    params->ellipse.point_count = IH_ARCS_POINTS_MAX;
    params->level_step_mm = 10;
    params->depth_max_mm = 110;
    params->gap_max = 8;
    params->free_mm = 0;
    params->is_tip_any = false;
    params->is_merging = false;
}

/* A grid step at a depth. Depth below 2^23 and unit below 2^26 (a pitch of half a radian): below
 * 2^29. */
static int64_t step_mm_q16(const struct ih_surface *surface, int32_t depth_mm_q8)
{
    return ih_div_round(ih_mul_shift(depth_mm_q8, surface->field.unit_q28, 20) *
                            IH_SURFACE_STEP_NUMERATOR,
                        IH_SURFACE_STEP_DENOMINATOR);
}

/* A minimum is nearer than its 8 neighbours; of equal nodes the first in reading order. Most nodes are none
 * by the two beside them. */
static bool is_minimum(const struct ih_surface *surface, int32_t x, int32_t y)
{
    const int32_t *row = &surface->depth_mm_q8[y][x];
    const int32_t depth = row[0];
    if (row[-1] <= depth || row[1] < depth) {
        return false;
    }
    const int32_t *above = row - IH_SURFACE_GRID, *below = row + IH_SURFACE_GRID;
    return above[0] > depth && below[0] >= depth && above[-1] > depth && above[1] > depth &&
           below[-1] >= depth && below[1] >= depth;
}

/* Keep the nearest minima, sorted by depth. */
static void add_nest(struct ih_nests *out, int32_t x, int32_t y, int32_t depth_mm_q8)
{
    if (out->nest_count == IH_NESTS_MAX) {
        out->minima_dropped++;
        if (out->nest[IH_NESTS_MAX - 1].nearest_mm_q8 <= depth_mm_q8) {
            return;
        }
        out->nest_count--;
    }
    int32_t at = out->nest_count++;
    for (; at > 0 && out->nest[at - 1].nearest_mm_q8 > depth_mm_q8; at--) {
        out->nest[at] = out->nest[at - 1];
    }
    struct ih_nest *nest = &out->nest[at];
    memset(nest, 0, sizeof *nest);
    nest->minimum = (struct ih_vertex){(int16_t)(x * 512), (int16_t)(y * 512)};
    nest->nearest_mm_q8 = depth_mm_q8;
    nest->front_mm_q8 = depth_mm_q8;
    nest->tip_level_mm_q8 = depth_mm_q8;
}

/* Does the surface fall off this way from the node, or end, within the steps? */
static bool falls_off(const struct ih_surface *surface, int32_t x, int32_t y, int32_t right,
                      int32_t down, int32_t steps, int32_t behind_mm_q8)
{
    const int32_t limit_mm_q8 = surface->depth_mm_q8[y][x] + behind_mm_q8;
    bool is_behind = false;
    for (int32_t i = 1; i <= steps && !is_behind; i++) {
        const int32_t u = x + i * right;
        const int32_t v = y + i * down;
        is_behind =
            u < 0 || u == IH_SURFACE_GRID || v < 0 || surface->depth_mm_q8[v][u] > limit_mm_q8;
    }
    return is_behind;
}

/* May a head be in front here? */
static bool is_free(const struct ih_surface *surface, int32_t x, int32_t y,
                    const struct ih_nests_params *params)
{
    if (params->free_mm == 0) {
        return true;
    }
    const int64_t step_q16 = step_mm_q16(surface, surface->depth_mm_q8[y][x]);
    const int64_t reach = ((int64_t)params->free_mm << 16) / (step_q16 > 0 ? step_q16 : 1);
    const int32_t steps = ih_min_s32(ih_saturate_s32(reach), IH_SURFACE_GRID);
    const int32_t behind_mm_q8 = params->free_behind_mm << 8;
    return falls_off(surface, x, y, -1, 0, steps, behind_mm_q8) &&
           falls_off(surface, x, y, 1, 0, steps, behind_mm_q8) &&
           falls_off(surface, x, y, 0, -1, steps, behind_mm_q8);
}

static void find_minima(const struct ih_surface *surface, const struct ih_nests_params *params,
                        struct ih_nests *out)
{
    for (int32_t y = 1; y < IH_SURFACE_GRID - 1; y++) {
        for (int32_t x = 1; x < IH_SURFACE_GRID - 1; x++) {
            if (is_minimum(surface, x, y) && is_free(surface, x, y, params)) {
                add_nest(out, x, y, surface->depth_mm_q8[y][x]);
            }
        }
    }
}

/* Area of an ellipse at a depth in mm^2: the square of a step below 2^42 in Q16, for areas below
 * 2^(11 + 16). Real ones are 2^20 times smaller. */
static int32_t area_mm2(const struct ih_surface *surface, int32_t level_mm_q8, int64_t area_q16)
{
    int64_t step_q16 = step_mm_q16(surface, level_mm_q8);
    int64_t square_q16 = ih_mul_shift(step_q16, step_q16, 16);
    return ih_saturate_s32(ih_mul_wide_shift(square_q16, (uint32_t)area_q16, 32));
}

/* What a contour is for every nest that it surrounds. */
struct study {
    bool whole;  /* a closed contour that is an ellipse */
    bool is_tip; /* a closed contour that may have any shape, but supports a nest's tip alone */
    bool is_searched;
    struct ih_ellipse ellipse;
};

static struct study study_contour(const struct ih_surface *surface,
                                  const struct ih_contour *contour,
                                  const struct ih_nests_params *params,
                                  struct ih_nests_scratch *scratch)
{
    struct study study = {.is_searched = false};
    if (contour->closed && ih_ellipse_of_contour(&scratch->contours, contour, &study.ellipse)) {
        study.whole = study.ellipse.shape_q16 <= params->ellipse.shape_max_q16 &&
                      study.ellipse.ratio_q16 <= params->ellipse.ratio_closed_max_q16;
        study.is_tip = !study.whole && params->is_tip_any && study.ellipse.area_q16 > 0 &&
                       area_mm2(surface, scratch->contours.level_mm_q8, study.ellipse.area_q16) <
                           params->blunt_mm2;
    }
    if (!study.whole && !study.is_tip) {
        study.is_searched =
            ih_arcs_make(&scratch->contours, contour, &params->ellipse, &scratch->arcs);
    }
    return study;
}

/* May the contour support a nest at this minimum? An open one winds round nothing by itself. */
static bool surrounds(const struct ih_contours *contours, const struct ih_contour *contour,
                      const struct ih_box *box, struct ih_vertex minimum)
{
    return ih_box_holds(box, minimum) &&
           (!contour->closed || ih_ellipse_winding(contours, contour, minimum) == 1);
}

static void take_support(const struct study *study, int32_t contour,
                         const struct ih_nests_params *params, struct ih_nests_scratch *scratch,
                         const struct ih_nest *nest, struct ih_support *support)
{
    struct ih_ellipse arc;
    if (study->whole || (study->is_tip && nest->slice_count == 0)) {
        *support = (struct ih_support){.wanted = true,
                                       .found = true,
                                       .whole = true,
                                       .contour = contour,
                                       .ellipse = study->ellipse};
    } else if (study->is_searched &&
               ih_ellipse_of_part(&scratch->arcs, nest->minimum, &params->ellipse,
                                  &scratch->ellipse, &arc) &&
               (!support->found || arc.merit_q8 > support->ellipse.merit_q8)) {
        *support =
            (struct ih_support){.wanted = true, .found = true, .contour = contour, .ellipse = arc};
    }
}

/* The ellipses that support the nests at this level: the closed contour around a minimum when it is
 * one, else the best elliptical part of that contour or of an open one. A contour is studied when
 * the first nest asks for it. */
static void find_supports(const struct ih_surface *surface, const struct ih_nests *nests,
                          const struct ih_nests_params *params, struct ih_nests_scratch *scratch)
{
    const struct ih_contours *contours = &scratch->contours;
    for (int32_t c = 0; c < contours->contour_count; c++) {
        const struct ih_contour *contour = &contours->contour[c];
        const struct ih_box box = ih_arcs_box(contours, contour);
        struct study study;
        bool is_studied = false;
        for (int32_t i = 0; i < nests->nest_count; i++) {
            struct ih_support *support = &scratch->support[i];
            const struct ih_nest *nest = &nests->nest[i];
            if (!support->wanted || support->whole ||
                !surrounds(contours, contour, &box, nest->minimum)) {
                continue;
            }
            if (!is_studied) {
                study = study_contour(surface, contour, params, scratch);
                is_studied = true;
            }
            take_support(&study, c, params, scratch, nest, support);
        }
    }
}

/* Does the slice continue the nest? */
static bool continues(const struct ih_nest *nest, const struct ih_slice *slice,
                      const struct ih_nests_params *params)
{
    if (nest->slice_count == 0) {
        return true;
    }
    int64_t last = nest->slice[nest->slice_count - 1].area_mm2;
    bool shrinks = slice->area_mm2 < ih_mul_shift(last, SHRINK_MIN_Q16, 16);
    bool jumps = slice->behind_mm_q8 >= params->end_depth_mm << 8 &&
                 slice->area_mm2 > ih_mul_shift(last, JUMP_Q16, 16) + JUMP_MM2;
    return !shrinks && !jumps;
}

/* The first slice that is not the tip's: the front lies where the area passed blunt_mm2 on the way
 * here, less the depth that a head needs to grow so wide. */
static void set_front(const struct ih_nests_params *params, int32_t level_mm_q8,
                      int32_t area_mm2_here, struct ih_nest *nest)
{
    /* tip_area < blunt <= area here, so the divisor is positive; spans below 2^15 in Q8 */
    int64_t span_q8 = level_mm_q8 - nest->tip_level_mm_q8;
    int64_t passed_q8 = ih_div_round(span_q8 * (params->blunt_mm2 - nest->tip_area_mm2),
                                     area_mm2_here - nest->tip_area_mm2);
    int64_t front_q8 = nest->tip_level_mm_q8 + passed_q8 -
                       ih_div_round((int64_t)params->blunt_mm2 * 256, FRONT_GROWTH_MM);
    nest->front_mm_q8 = ih_max_s32((int32_t)front_q8, nest->nearest_mm_q8);
}

/* Slices up to here belong to the tip; too long a tip ends the nest. */
static void extend_tip(const struct ih_nests_params *params, int32_t level_mm_q8,
                       int32_t area_mm2_here, struct ih_nest *nest)
{
    nest->tip_level_mm_q8 = level_mm_q8;
    nest->tip_area_mm2 = area_mm2_here;
    nest->ended = level_mm_q8 - nest->nearest_mm_q8 > params->tip_max_mm << 8;
}

static void add_slice(struct ih_slice *slice, int32_t level_mm_q8,
                      const struct ih_nests_params *params, struct ih_nest *nest)
{
    if (nest->slice_count == 0) {
        if (slice->area_mm2 < params->blunt_mm2) {
            extend_tip(params, level_mm_q8, slice->area_mm2, nest);
            return;
        }
        set_front(params, level_mm_q8, slice->area_mm2, nest);
    }
    slice->behind_mm_q8 = level_mm_q8 - nest->front_mm_q8;
    IH_IN_RANGE(slice->behind_mm_q8, 0, params->depth_max_mm << 8);
    if (continues(nest, slice, params)) {
        nest->slice[nest->slice_count++] = *slice;
    } else {
        nest->ended = true;
    }
}

/* Is the nest still open at this level? One that has become too deep or too long ends here. */
static bool is_open(int32_t level_mm_q8, const struct ih_nests_params *params, struct ih_nest *nest)
{
    if (level_mm_q8 <= nest->nearest_mm_q8 || nest->ended) {
        return false;
    }
    nest->ended =
        (nest->slice_count > 0 && level_mm_q8 - nest->front_mm_q8 > params->depth_max_mm << 8) ||
        nest->slice_count == IH_NESTS_SLICES_MAX;
    return !nest->ended;
}

static void extend_nest(const struct ih_surface *surface, int32_t level_mm_q8,
                        const struct ih_nests_params *params, const struct ih_support *support,
                        struct ih_nest *nest)
{
    if (!support->found) {
        nest->gap++;
        nest->ended = nest->gap > params->gap_max;
        return;
    }
    nest->gap = 0;
    struct ih_slice slice = {.ellipse = support->ellipse, .whole = support->whole};
    IH_IN_RANGE(slice.ellipse.area_q16, 1, IH_RANGE_AREA_Q16);
    IH_IN_RANGE(level_mm_q8, -IH_RANGE_LEVEL_MM_Q8, IH_RANGE_LEVEL_MM_Q8);
    slice.area_mm2 = area_mm2(surface, level_mm_q8, slice.ellipse.area_q16);
    add_slice(&slice, level_mm_q8, params, nest);
}

/* Which nests want a support at this level? False: none. */
static bool open_nests(int32_t level_mm_q8, const struct ih_nests_params *params,
                       struct ih_support support[IH_NESTS_MAX], struct ih_nests *out)
{
    bool any = false;
    for (int32_t i = 0; i < out->nest_count; i++) {
        support[i] = (struct ih_support){.wanted = is_open(level_mm_q8, params, &out->nest[i])};
        any = any || support[i].wanted;
    }
    return any;
}

/* Has the level the same ellipse for both? A part has the same area about any place. */
static bool are_same(const struct ih_support *a, const struct ih_support *b)
{
    return a->found && b->found && a->contour == b->contour &&
           a->ellipse.area_q16 == b->ellipse.area_q16;
}

/* Nests are sorted by depth: the first of several goes on. */
static void merge_nests(const struct ih_support support[IH_NESTS_MAX], struct ih_nests *out)
{
    for (int32_t i = 1; i < out->nest_count; i++) {
        struct ih_nest *nest = &out->nest[i];
        for (int32_t k = 0; k < i && !nest->ended; k++) {
            if (!out->nest[k].ended && are_same(&support[i], &support[k])) {
                nest->ended = true;
                nest->slice_count = 0;
                nest->front_mm_q8 = nest->nearest_mm_q8;
            }
        }
    }
}

static void extend_nests(const struct ih_surface *surface, int32_t level_mm_q8,
                         const struct ih_nests_params *params, struct ih_nests_scratch *scratch,
                         struct ih_nests *out)
{
    find_supports(surface, out, params, scratch);
    for (int32_t i = 0; i < out->nest_count; i++) {
        if (scratch->support[i].wanted) {
            extend_nest(surface, level_mm_q8, params, &scratch->support[i], &out->nest[i]);
        }
    }
    if (params->is_merging) {
        merge_nests(scratch->support, out);
    }
}

bool ih_nests_level(const struct ih_surface *surface, const struct ih_nests_params *params,
                    int32_t index, int32_t *level_mm_q8)
{
    int32_t behind_mm = (index + 1) * params->level_step_mm;
    *level_mm_q8 = surface->nearest_mm_q8 + (behind_mm << 8);
    return surface->valid && index >= 0 && behind_mm <= params->levels_behind_mm;
}

/* Is any nest still waiting for this level or a later one? */
static bool any_alive(const struct ih_nests *nests)
{
    for (int32_t i = 0; i < nests->nest_count; i++) {
        if (!nests->nest[i].ended) {
            return true;
        }
    }
    return false;
}

void ih_nests_find(const struct ih_surface *surface, const struct ih_nests_params *params,
                   struct ih_nests_scratch *scratch, struct ih_nests *out)
{
    out->nest_count = 0;
    out->minima_dropped = 0;
    out->contours_dropped = 0;
    if (!surface->valid) {
        return;
    }
    find_minima(surface, params, out);
    int32_t level_mm_q8;
    for (int32_t index = 0; ih_nests_level(surface, params, index, &level_mm_q8) && any_alive(out);
         index++) {
        if (!open_nests(level_mm_q8, params, scratch->support, out)) {
            continue; /* between two nests */
        }
        ih_contours_level(surface, level_mm_q8, &scratch->contours);
        out->contours_dropped += scratch->contours.contours_dropped;
        extend_nests(surface, level_mm_q8, params, scratch, out);
    }
}
