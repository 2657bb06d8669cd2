#include "nests/ih_hypotheses.h"

#include <stdbool.h>
#include <stddef.h>

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "nests/ih_ellipse.h"
#include "rig/ih_level.h"

/* Slices up to this depth behind the front make the curvature. */
#define CURVATURE_DEPTH_MM 70
/* Slices from this depth on make the centre and the proportions: nearer ones are the nose's. */
#define CENTRE_DEPTH_MM 30
/* Ring around the last ellipse in which its surroundings are looked at: squares of the sizes,
 * Q4. */
#define RING_INNER2_Q4 23 /* 1.2^2 */
#define RING_OUTER2_Q4 58 /* 1.9^2 */

void ih_hypotheses_params_default(struct ih_hypotheses_params *params)
{
    *params = (struct ih_hypotheses_params){
        .area_min_mm2 = 12000,
        .area_max_mm2 = 56000,
        .curvature_min_mm = 60,
        .curvature_max_mm = 800,
        .extent_min_mm = 65,
        .upright_min_q16 = 62259, /* 0.95 */
        .points_min = 13,
        .jump_mm = 75,
        .above_min_percent = 76,
        .beside_min_percent = 40,
        .below_min_percent = 45,
        .merge_mm = 80,
        .centre_behind_mm = 108,
    };
}

const char *ih_reject_text(int32_t reject)
{
    switch (reject) {
    case IH_REJECT_AREA:
        return "area";
    case IH_REJECT_CURVATURE:
        return "curvature";
    case IH_REJECT_SHAPE:
        return "shape";
    case IH_REJECT_OUTLINE:
        return "outline";
    case IH_REJECT_SCORE:
        return "score";
    default:
        return NULL;
    }
}

static int32_t widest_area_mm2(const struct ih_nest *nest)
{
    int32_t area = 0;
    for (int32_t i = 0; i < nest->slice_count; i++) {
        area = ih_max_s32(area, nest->slice[i].area_mm2);
    }
    return area;
}

/* k = sum(A t) / sum(t^2): the slope of the line through the origin that fits A(t) best. A below
 * 2^31, t below 2^15 in Q8, 16 slices: below 2^50. */
static int32_t curvature_mm_q8(const struct ih_nest *nest)
{
    int64_t at_q8 = 0;
    int64_t tt_q16 = 0;
    for (int32_t i = 0; i < nest->slice_count; i++) {
        int64_t t_q8 = nest->slice[i].behind_mm_q8;
        if (t_q8 <= CURVATURE_DEPTH_MM << 8) {
            at_q8 += nest->slice[i].area_mm2 * t_q8;
            tt_q16 += t_q8 * t_q8;
        }
    }
    /* slices at the front, or none in reach, must not divide by zero */
    int64_t divisor = tt_q16 >> 3 > 0 ? tt_q16 >> 3 : 1;
    return ih_saturate_s32(ih_div_round(at_q8 << 13, divisor));
}

/* Do the slice's centre and proportions count? The last one always does. */
static bool is_deep(const struct ih_nest *nest, int32_t index)
{
    return nest->slice[index].behind_mm_q8 >= CENTRE_DEPTH_MM << 8 ||
           index == nest->slice_count - 1;
}

/* Vertical over horizontal second moments, summed over the deeper slices: wide ones count most. */
static int32_t upright_q16(const struct ih_nest *nest)
{
    int64_t vertical_q16 = 0;
    int64_t horizontal_q16 = 1;
    for (int32_t i = 0; i < nest->slice_count; i++) {
        if (is_deep(nest, i)) {
            vertical_q16 += nest->slice[i].ellipse.yy_q16;
            horizontal_q16 += nest->slice[i].ellipse.xx_q16;
        }
    }
    return ih_saturate_s32(ih_div_round(vertical_q16 * 65536, horizontal_q16));
}

/* Centre of the nest on the grid: mean over its deeper slices, by area. */
static void nest_centre_q16(const struct ih_nest *nest, int32_t *x_q16, int32_t *y_q16)
{
    int64_t x = 0;
    int64_t y = 0;
    int64_t weight = 0;
    for (int32_t i = 0; i < nest->slice_count; i++) {
        if (is_deep(nest, i)) {
            const struct ih_ellipse *ellipse = &nest->slice[i].ellipse;
            int64_t area = (ellipse->area_q16 >> 8) + 1; /* below 2^22.8; never 0 */
            x += area * ellipse->x_q16;
            y += area * ellipse->y_q16;
            weight += area;
        }
    }
    *x_q16 = (int32_t)ih_div_round(x, weight);
    *y_q16 = (int32_t)ih_div_round(y, weight);
}

/* A place on the grid (steps) to normalised coordinates. */
static int32_t to_normalised_q28(int32_t place_q16, int32_t centre_q28, int32_t unit_q28)
{
    int64_t steps_q16 = (int64_t)place_q16 - ((IH_SURFACE_GRID - 1) / 2) * 65536;
    int64_t offset = ih_div_round(steps_q16 * unit_q28 * IH_SURFACE_STEP_NUMERATOR,
                                  (int64_t)IH_SURFACE_STEP_DENOMINATOR * 65536);
    return ih_saturate_s32(centre_q28 + offset);
}

static int32_t surface_depth_mm_q8(const struct ih_surface *surface, int32_t x_q16, int32_t y_q16)
{
    int32_t x = ih_clamp_s32(x_q16, 0, (IH_SURFACE_GRID - 1) * 65536 - 1);
    int32_t y = ih_clamp_s32(y_q16, 0, (IH_SURFACE_GRID - 1) * 65536 - 1);
    int64_t fx = x & 0xffff;
    int64_t fy = y & 0xffff;
    const int32_t *near_row = &surface->depth_mm_q8[y >> 16][x >> 16];
    const int32_t *far_row = &surface->depth_mm_q8[(y >> 16) + 1][x >> 16];
    int64_t top = near_row[0] * (65536 - fx) + near_row[1] * fx;
    int64_t bottom = far_row[0] * (65536 - fx) + far_row[1] * fx;
    return (int32_t)ih_shift_round(
        ih_shift_round(top, 16) * (65536 - fy) + ih_shift_round(bottom, 16) * fy, 16);
}

/* Covariance on the grid, at that place, to an ellipse in pixels. A unit below 2^25.5 (a pitch of a third of a radian) at
 * 8192 px is below 2^11. */
static void fill_axes(const struct ih_ellipse *ellipse, const struct ih_surface *surface,
                      const struct ih_rig *rig, int32_t x_q28, int32_t y_q28,
                      struct ih_hypothesis *out)
{
    const int32_t unit_q28 = surface->field.unit_q28;
    const struct ih_level_place place = {.x_q28 = x_q28,
                                         .y_q28 = y_q28,
                                         .step_q28 = {unit_q28, unit_q28, 0},
                                         .multiple = IH_SURFACE_STEP_NUMERATOR,
                                         .divisor = IH_SURFACE_STEP_DENOMINATOR};
    const int32_t moment_q16[3][3] = {
        {ellipse->xx_q16, ellipse->xy_q16, 0}, {ellipse->xy_q16, ellipse->yy_q16, 0}, {0, 0, 0}};
    const struct ih_level_ellipse axes = ih_level_ellipse(rig, &place, moment_q16);
    out->a_px_q12 = axes.a_px_q12;
    out->b_px_q12 = axes.b_px_q12;
    out->angle_mdeg = axes.angle_mdeg;
}

/* Where a sample lies relative to an ellipse: the ellipse's normalised radius squared, Q4, and the
 * offset in grid steps, Q8. With q = yy dx^2 - 2 xy dx dy + xx dy^2 and det = xx yy - xy^2 the
 * radius squared is q / (4 det). Offsets below 2^15.3 in Q8, moments below 2^27.2 in Q16: the
 * three terms below 2^59 each; only the ratio to 4 det matters, limited to 255. */
struct placed {
    int64_t dx_q8, dy_q8;
    int32_t radius2_q4;
};

static struct placed place_sample(const struct ih_sample *sample, const struct ih_ellipse *ellipse)
{
    const int32_t middle_q8 = (IH_SURFACE_GRID - 1) / 2 * 256;
    struct placed p;
    /* field units in Q16 to grid steps in Q8 */
    p.dx_q8 = ih_div_round((int64_t)sample->x_q16 * IH_SURFACE_STEP_DENOMINATOR,
                           IH_SURFACE_STEP_NUMERATOR * 256) +
              middle_q8 - ih_shift_round(ellipse->x_q16, 8);
    p.dy_q8 = ih_div_round((int64_t)sample->y_q16 * IH_SURFACE_STEP_DENOMINATOR,
                           IH_SURFACE_STEP_NUMERATOR * 256) +
              middle_q8 - ih_shift_round(ellipse->y_q16, 8);
    int64_t xx = ellipse->xx_q16, xy = ellipse->xy_q16, yy = ellipse->yy_q16;
    int64_t determinant_q32 = xx * yy - xy * xy;
    int64_t q_q32 = yy * p.dx_q8 * p.dx_q8 - 2 * xy * p.dx_q8 * p.dy_q8 + xx * p.dy_q8 * p.dy_q8;
    int64_t quarter = determinant_q32 / 4 + 1; /* 4 det in sixteenths */
    p.radius2_q4 = (int32_t)(q_q32 / quarter > 4080 ? 4080 : q_q32 / quarter);
    return p;
}

static void count_around(const struct placed *p, bool is_behind, struct ih_outline *out)
{
    if (2 * p->dy_q8 < -ih_abs_s64(p->dx_q8)) {
        out->above++;
        out->above_behind += is_behind;
    } else if (p->dy_q8 > ih_abs_s64(p->dx_q8)) {
        out->below++;
        out->below_near += !is_behind;
    } else {
        out->beside++;
        out->beside_behind += is_behind;
    }
}

static void fill_outline(const struct ih_nest *nest, const struct ih_samples *samples,
                         const struct ih_hypotheses_params *params, struct ih_outline *out)
{
    const struct ih_slice *last = &nest->slice[nest->slice_count - 1];
    int64_t behind_q8 = (int64_t)nest->front_mm_q8 + last->behind_mm_q8 + (params->jump_mm << 8);
    for (int32_t i = 0; i < samples->sample_count; i++) {
        const struct ih_sample *sample = &samples->sample[i];
        struct placed p = place_sample(sample, &last->ellipse);
        if (p.radius2_q4 < 16) {
            out->inside += !sample->is_filled;
        } else if (p.radius2_q4 > RING_INNER2_Q4 && p.radius2_q4 < RING_OUTER2_Q4) {
            count_around(&p, sample->is_filled || sample->depth_mm_q8 > behind_q8, out);
        }
    }
}

/* Does what the samples show look like a head that stands out? */
static bool stands_out(const struct ih_outline *o, const struct ih_hypotheses_params *params)
{
    return o->inside >= params->points_min &&
           o->above_behind * 100 >= o->above * params->above_min_percent &&
           o->beside_behind * 100 >= o->beside * params->beside_min_percent &&
           o->below_near * 100 >= o->below * params->below_min_percent;
}

static int32_t ray_length_q28(int32_t x_q28, int32_t y_q28)
{
    /* The field may reach beyond the frame: limited to 4, the root of 33 still fits Q28. */
    int64_t x = ih_clamp_s32(x_q28, -(1 << 30), 1 << 30) / 4;
    int64_t y = ih_clamp_s32(y_q28, -(1 << 30), 1 << 30) / 4;
    int64_t root_q26 = ih_isqrt_u64((uint64_t)(x * x + y * y) + ((uint64_t)1 << 52));
    return (int32_t)(root_q26 * 4);
}

static void fill_place(const struct ih_nest *nest, const struct ih_surface *surface,
                       const struct ih_rig *rig, const struct ih_hypotheses_params *params,
                       struct ih_hypothesis *out)
{
    const struct ih_slice *last = &nest->slice[nest->slice_count - 1];
    int32_t x_q16, y_q16;
    nest_centre_q16(nest, &x_q16, &y_q16);
    int32_t x_q28 = to_normalised_q28(x_q16, surface->field.centre_x_q28, surface->field.unit_q28);
    int32_t y_q28 = to_normalised_q28(y_q16, surface->field.centre_y_q28, surface->field.unit_q28);
    (void)ih_level_sees(rig, x_q28, y_q28, &out->u_px_q12, &out->v_px_q12);
    fill_axes(&last->ellipse, surface, rig, x_q28, y_q28, out);
    out->distance_mm_q8 = ih_saturate_s32(
        ih_mul_shift(surface_depth_mm_q8(surface, x_q16, y_q16), ray_length_q28(x_q28, y_q28), 28));
    int64_t depth_q8 = nest->front_mm_q8 + (int64_t)(params->centre_behind_mm << 8);
    out->centre_mm_q8[0] = ih_saturate_s32(ih_mul_shift(depth_q8, x_q28, 28));
    out->centre_mm_q8[1] = ih_saturate_s32(ih_mul_shift(depth_q8, y_q28, 28));
    out->centre_mm_q8[2] = ih_saturate_s32(depth_q8);
    IH_IN_RANGE(out->distance_mm_q8, 1, IH_RANGE_SURFACE_DISTANCE_MM_Q8);
    IH_IN_RANGE(out->centre_mm_q8[0], -IH_RANGE_CENTRE_MM_Q8, IH_RANGE_CENTRE_MM_Q8);
    IH_IN_RANGE(out->centre_mm_q8[1], -IH_RANGE_CENTRE_MM_Q8, IH_RANGE_CENTRE_MM_Q8);
    IH_IN_RANGE(out->centre_mm_q8[2], -IH_RANGE_CENTRE_MM_Q8, IH_RANGE_CENTRE_MM_Q8);
}

static enum ih_reject test(const struct ih_hypothesis *h, const struct ih_hypotheses_params *params)
{
    if (h->area_mm2 < params->area_min_mm2 || h->area_mm2 > params->area_max_mm2) {
        return IH_REJECT_AREA;
    }
    if (h->curvature_mm_q8 < params->curvature_min_mm << 8 ||
        h->curvature_mm_q8 > params->curvature_max_mm << 8 ||
        h->extent_mm_q8 < params->extent_min_mm << 8) {
        return IH_REJECT_CURVATURE;
    }
    if (h->upright_q16 < params->upright_min_q16) {
        return IH_REJECT_SHAPE;
    }
    return stands_out(&h->outline, params) ? IH_ACCEPTED : IH_REJECT_OUTLINE;
}

static struct ih_hypothesis judge(const struct ih_nest *nest, const struct ih_surface *surface,
                                  const struct ih_samples *samples, const struct ih_rig *rig,
                                  const struct ih_hypotheses_params *params)
{
    struct ih_hypothesis h = {0};
    const struct ih_slice *last = &nest->slice[nest->slice_count - 1];
    h.area_mm2 = widest_area_mm2(nest);
    h.curvature_mm_q8 = curvature_mm_q8(nest);
    h.extent_mm_q8 = last->behind_mm_q8;
    fill_place(nest, surface, rig, params, &h);
    fill_outline(nest, samples, params, &h.outline);
    h.upright_q16 = upright_q16(nest);
    h.rejected = (int32_t)test(&h, params);
    return h;
}

/* Accepted before rejected, then the greater extent, then the nearer. */
static bool is_better(const struct ih_hypothesis *a, const struct ih_hypothesis *b)
{
    bool a_accepted = a->rejected == IH_ACCEPTED;
    bool b_accepted = b->rejected == IH_ACCEPTED;
    if (a_accepted != b_accepted) {
        return a_accepted;
    }
    if (a->extent_mm_q8 != b->extent_mm_q8) {
        return a->extent_mm_q8 > b->extent_mm_q8;
    }
    return a->nest < b->nest;
}

static bool is_same_thing(const struct ih_hypothesis *a, const struct ih_hypothesis *b,
                          int32_t merge_mm)
{
    int64_t limit = (int64_t)merge_mm << 8;
    return ih_distance2_s32(a->centre_mm_q8, b->centre_mm_q8) < limit * limit;
}

/* Drop what lies too near to a better one; the list is sorted. */
static void merge(struct ih_hypotheses *hypotheses, int32_t merge_mm)
{
    int32_t kept = 0;
    for (int32_t i = 0; i < hypotheses->hypothesis_count; i++) {
        bool same = false;
        for (int32_t k = 0; k < kept && !same; k++) {
            same = is_same_thing(&hypotheses->hypothesis[i], &hypotheses->hypothesis[k], merge_mm);
        }
        if (!same) {
            hypotheses->hypothesis[kept++] = hypotheses->hypothesis[i];
        }
    }
    hypotheses->hypothesis_count = kept;
}

void ih_hypotheses_select(const struct ih_nests *nests, const struct ih_surface *surface,
                          const struct ih_samples *samples, const struct ih_rig *rig,
                          const struct ih_hypotheses_params *params, struct ih_hypotheses *out)
{
    out->hypothesis_count = 0;
    out->head_count = 0;
    for (int32_t i = 0; i < nests->nest_count; i++) {
        if (nests->nest[i].slice_count == 0) {
            continue;
        }
        struct ih_hypothesis h = judge(&nests->nest[i], surface, samples, rig, params);
        h.nest = i;
        int32_t at = out->hypothesis_count++;
        for (; at > 0 && is_better(&h, &out->hypothesis[at - 1]); at--) {
            out->hypothesis[at] = out->hypothesis[at - 1];
        }
        out->hypothesis[at] = h;
    }
    merge(out, params->merge_mm);
    for (int32_t i = 0; i < out->hypothesis_count; i++) {
        if (out->hypothesis[i].rejected == IH_ACCEPTED) {
            out->head[out->head_count++] = i;
        }
    }
}
