#include "ih_ellipse.h"

#include "ih_fix.h"

#define FOUR_PI_Q16 823550 /* 4 pi */
#define RATIO_MAX 255
/* A part must have this much area: half a grid cell. */
#define AREA2_MIN_Q16 65536
/* No polygon on the grid has its centre or its second moments beyond these; products of two of them
 * stay below 2^58. */
#define GRID_Q16 ((int64_t)IH_SURFACE_GRID << 16)
#define VARIANCE_MAX_Q16 ((int64_t)IH_SURFACE_GRID * IH_SURFACE_GRID << 16)
/* The weights of chord and shape in a part's merit. */
#define CHORD_COST_Q8 410 /* 1.6 */
#define SHAPE_COST 8
/* No simple polygon has a shape below 1, the ellipse's: less means that the chord crosses the arc.
 * 1 / 256 is left for rounding. */
#define SHAPE_MIN_Q16 65280
/* A part has at least this many of the 56 points: fewer are no ellipse's outline. */
#define PART_EDGES_MIN 8

void ih_ellipse_params_default(struct ih_ellipse_params *params)
{
    *params = (struct ih_ellipse_params){
        .shape_max_q16 = 68485,         /* 1.045 */
        .ratio_closed_max_q16 = 124518, /* 1.9 */
        .ratio_part_max_q16 = 114688,   /* 1.75 */
        .chord_max_q16 = 27525,         /* 0.42 */
    };
}

/* How the edge p -> q crosses the positive x axis. */
static int32_t winding_of_edge(int64_t px, int64_t py, int64_t qx, int64_t qy)
{
    if ((py <= 0) == (qy <= 0)) {
        return 0;
    }
    int64_t w = px * qy - qx * py;
    return py <= 0 ? w > 0 : -(w < 0);
}

/* Add the edge p -> q. Green's theorem: with w = px qy - qx py,
 *   2 area = sum w                        6 int x  = sum w (px + qx)
 *   12 int x^2 = sum w (px^2 + px qx + qx^2)
 *   12 int x y = sum w (2 px py + px qy + qx py + 2 qx qy) / 2 */
static void add_edge(struct ih_moments *m, int64_t px, int64_t py, int64_t qx, int64_t qy)
{
    int64_t w = px * qy - qx * py;
    m->area2_q16 += w;
    m->x_q24 += w * (px + qx);
    m->y_q24 += w * (py + qy);
    m->xx_q32 += w * (px * px + px * qx + qx * qx);
    m->yy_q32 += w * (py * py + py * qy + qy * qy);
    m->xy_q32 += w * (2 * px * py + px * qy + qx * py + 2 * qx * qy) / 2;
    m->winding += winding_of_edge(px, py, qx, qy);
}

/* Axis ratio from the covariance; 0 when it is not positive definite. */
static int32_t axis_ratio_q16(int64_t xx_q16, int64_t xy_q16, int64_t yy_q16)
{
    int64_t half_difference = (xx_q16 - yy_q16) / 2;
    int64_t root = ih_isqrt_u64((uint64_t)(half_difference * half_difference + xy_q16 * xy_q16));
    int64_t major = (xx_q16 + yy_q16) / 2 + root;
    int64_t minor = (xx_q16 + yy_q16) / 2 - root;
    if (minor <= 0) {
        return 0;
    }
    int64_t square = major / minor >= RATIO_MAX * RATIO_MAX
                         ? (int64_t)RATIO_MAX * RATIO_MAX << 32
                         : (major << 32) / minor; /* below 2^28.1: minor is positive */
    return (int32_t)ih_isqrt_u64((uint64_t)square);
}

/* A Q24 sum over a Q16 sum, in Q16: whole part and remainder apart, so that 8 more fraction bits
 * need no wider product. */
static int64_t quotient_q16(int64_t sum_q24, int64_t divisor_q16)
{
    int64_t whole_q8 = sum_q24 / divisor_q16;
    int64_t rest = sum_q24 % divisor_q16; /* divisor below 2^32: rest * 256 below 2^40 */
    return whole_q8 * 256 + ih_div_round(rest * 256, divisor_q16);
}

/* Ellipse of closed moments around (x0, y0), Q8 steps, but for its axis ratio. False when the area is
 * nothing. */
static bool ellipse_of_moments(const struct ih_moments *m, int32_t x0_q8, int32_t y0_q8,
                               struct ih_ellipse *out)
{
    int64_t sign = m->area2_q16 < 0 ? -1 : 1;
    int64_t area2_q16 = sign * m->area2_q16;
    if (area2_q16 < AREA2_MIN_Q16) {
        return false;
    }
    int64_t x_q16 = quotient_q16(sign * m->x_q24, 3 * area2_q16);
    int64_t y_q16 = quotient_q16(sign * m->y_q24, 3 * area2_q16);
    if (ih_abs_s64(x_q16) > GRID_Q16 || ih_abs_s64(y_q16) > GRID_Q16) {
        return false; /* a chord that crosses its arc: hardly any area, its centre far outside */
    }
    int64_t xx_q16 = ih_div_round(sign * m->xx_q32, 6 * area2_q16) - ih_mul_shift(x_q16, x_q16, 16);
    int64_t yy_q16 = ih_div_round(sign * m->yy_q32, 6 * area2_q16) - ih_mul_shift(y_q16, y_q16, 16);
    int64_t xy_q16 = ih_div_round(sign * m->xy_q32, 6 * area2_q16) - ih_mul_shift(x_q16, y_q16, 16);
    if (ih_abs_s64(xx_q16) > VARIANCE_MAX_Q16 || ih_abs_s64(yy_q16) > VARIANCE_MAX_Q16 ||
        ih_abs_s64(xy_q16) > VARIANCE_MAX_Q16) {
        return false;
    }
    out->area_q16 = ih_saturate_s32(sign * (area2_q16 / 2));
    out->x_q16 = (int32_t)(x_q16 + x0_q8 * 256);
    out->y_q16 = (int32_t)(y_q16 + y0_q8 * 256);
    out->xx_q16 = (int32_t)xx_q16;
    out->yy_q16 = (int32_t)yy_q16;
    out->xy_q16 = (int32_t)xy_q16;
    int64_t determinant_q32 = xx_q16 * yy_q16 - xy_q16 * xy_q16;
    if (determinant_q32 <= 0) {
        return false;
    }
    int64_t root_q16 = ih_isqrt_u64((uint64_t)determinant_q32);
    /* 4 pi sqrt(det) / area; the factor 2 because area2 is twice the area */
    out->shape_q16 = ih_saturate_s32(ih_div_round(2 * FOUR_PI_Q16 * root_q16, area2_q16));
    out->merit_q8 = 0;
    return true;
}

static bool set_ratio(struct ih_ellipse *ellipse)
{
    ellipse->ratio_q16 = axis_ratio_q16(ellipse->xx_q16, ellipse->xy_q16, ellipse->yy_q16);
    IH_IN_RANGE(ellipse->ratio_q16, 0, RATIO_MAX << 16);
    IH_IN_RANGE(ellipse->ratio_q16 != 0 ? ellipse->xx_q16 : 0, 0, IH_RANGE_MOMENT_Q16);
    IH_IN_RANGE(ellipse->ratio_q16 != 0 ? ellipse->yy_q16 : 0, 0, IH_RANGE_MOMENT_Q16);
    return ellipse->ratio_q16 != 0;
}

static int32_t half_q9(int32_t value_q9)
{
    return (int32_t)ih_shift_round(value_q9, 1);
}

static struct ih_moments contour_moments(const struct ih_cuts *cuts,
                                         const struct ih_contour *contour, struct ih_vertex place)
{
    const struct ih_vertex *vertex = &cuts->vertex[contour->first];
    struct ih_moments m = {0};
    for (int32_t i = 0; i < contour->vertex_count; i++) {
        struct ih_vertex p = vertex[i];
        struct ih_vertex q = vertex[i + 1 < contour->vertex_count ? i + 1 : 0];
        add_edge(&m, half_q9(p.x_q9 - place.x_q9), half_q9(p.y_q9 - place.y_q9),
                 half_q9(q.x_q9 - place.x_q9), half_q9(q.y_q9 - place.y_q9));
    }
    return m;
}

bool ih_ellipse_of_contour(const struct ih_cuts *cuts, const struct ih_contour *contour,
                           struct ih_ellipse *out)
{
    struct ih_vertex place = cuts->vertex[contour->first];
    place.x_q9 = (int16_t)(place.x_q9 & ~1); /* a whole Q8 number */
    place.y_q9 = (int16_t)(place.y_q9 & ~1);
    struct ih_moments m = contour_moments(cuts, contour, place);
    return ellipse_of_moments(&m, place.x_q9 / 2, place.y_q9 / 2, out) && set_ratio(out);
}

int32_t ih_ellipse_winding(const struct ih_cuts *cuts, const struct ih_contour *contour,
                           struct ih_vertex place)
{
    return contour_moments(cuts, contour, place).winding;
}

static int32_t edge_length_q9(const struct ih_cuts *cuts, const struct ih_contour *contour,
                              int32_t i)
{
    const struct ih_vertex *vertex = &cuts->vertex[contour->first];
    struct ih_vertex p = vertex[i];
    struct ih_vertex q = vertex[i + 1 < contour->vertex_count ? i + 1 : 0];
    int64_t dx = q.x_q9 - p.x_q9;
    int64_t dy = q.y_q9 - p.y_q9;
    return (int32_t)ih_isqrt_u64((uint64_t)(dx * dx + dy * dy));
}

/* Points at equal steps along the contour, relative to the place. Returns the contour's length. */
static int32_t resample(const struct ih_cuts *cuts, const struct ih_contour *contour,
                        struct ih_vertex place, struct ih_ellipse_scratch *scratch)
{
    const struct ih_vertex *vertex = &cuts->vertex[contour->first];
    int32_t edges = contour->closed ? contour->vertex_count : contour->vertex_count - 1;
    int32_t steps = contour->closed ? IH_ELLIPSE_POINTS : IH_ELLIPSE_POINTS - 1;
    int32_t total_q9 = 0;
    for (int32_t i = 0; i < edges; i++) {
        total_q9 += edge_length_q9(cuts, contour, i);
    }
    int32_t edge = 0;
    int32_t before_q9 = 0; /* length up to the edge */
    int32_t length_q9 = edge_length_q9(cuts, contour, 0);
    for (int32_t k = 0; k < IH_ELLIPSE_POINTS; k++) {
        int32_t target_q9 = (int32_t)((int64_t)total_q9 * k / steps);
        while (edge < edges - 1 && before_q9 + length_q9 < target_q9) {
            before_q9 += length_q9;
            edge++;
            length_q9 = edge_length_q9(cuts, contour, edge);
        }
        struct ih_vertex p = vertex[edge];
        struct ih_vertex q = vertex[edge + 1 < contour->vertex_count ? edge + 1 : 0];
        int32_t part_q9 = ih_min_s32(target_q9 - before_q9, length_q9);
        int64_t divisor = length_q9 > 0 ? length_q9 : 1;
        int64_t x_q9 =
            p.x_q9 - place.x_q9 + ih_div_round((int64_t)(q.x_q9 - p.x_q9) * part_q9, divisor);
        int64_t y_q9 =
            p.y_q9 - place.y_q9 + ih_div_round((int64_t)(q.y_q9 - p.y_q9) * part_q9, divisor);
        scratch->x_q8[k] = half_q9((int32_t)x_q9);
        scratch->y_q8[k] = half_q9((int32_t)y_q9);
        IH_IN_RANGE(scratch->x_q8[k], -IH_RANGE_OFFSET_Q8, IH_RANGE_OFFSET_Q8);
        IH_IN_RANGE(scratch->y_q8[k], -IH_RANGE_OFFSET_Q8, IH_RANGE_OFFSET_Q8);
    }
    return total_q9 / 2;
}

/* Prefix sums of the moments; a closed contour goes round twice. */
static int32_t accumulate(const struct ih_contour *contour, struct ih_ellipse_scratch *scratch)
{
    int32_t count = contour->closed ? 2 * IH_ELLIPSE_POINTS : IH_ELLIPSE_POINTS;
    for (int32_t k = IH_ELLIPSE_POINTS; k < count; k++) {
        scratch->x_q8[k] = scratch->x_q8[k - IH_ELLIPSE_POINTS];
        scratch->y_q8[k] = scratch->y_q8[k - IH_ELLIPSE_POINTS];
    }
    scratch->prefix[0] = (struct ih_moments){0};
    for (int32_t k = 1; k < count; k++) {
        scratch->prefix[k] = scratch->prefix[k - 1];
        add_edge(&scratch->prefix[k], scratch->x_q8[k - 1], scratch->y_q8[k - 1], scratch->x_q8[k],
                 scratch->y_q8[k]);
    }
    return count;
}

/* Moments of the points from..to closed by their chord. False when they do not wind round the place
 * once: that is known before the sums are. */
static bool part_moments(const struct ih_ellipse_scratch *scratch, int32_t from, int32_t to,
                         struct ih_moments *out)
{
    struct ih_moments m = {.winding = scratch->prefix[to].winding - scratch->prefix[from].winding};
    const int64_t px = scratch->x_q8[to], py = scratch->y_q8[to];
    const int64_t qx = scratch->x_q8[from], qy = scratch->y_q8[from];
    if (m.winding + winding_of_edge(px, py, qx, qy) != 1) {
        return false;
    }
    const struct ih_moments *after = &scratch->prefix[to];
    const struct ih_moments *before = &scratch->prefix[from];
    m.area2_q16 = after->area2_q16 - before->area2_q16;
    m.x_q24 = after->x_q24 - before->x_q24;
    m.y_q24 = after->y_q24 - before->y_q24;
    m.xx_q32 = after->xx_q32 - before->xx_q32;
    m.xy_q32 = after->xy_q32 - before->xy_q32;
    m.yy_q32 = after->yy_q32 - before->yy_q32;
    add_edge(&m, px, py, qx, qy);
    *out = m;
    return true;
}

/* Square of the chord from one point to another, Q16. */
static int32_t chord2_q16(const struct ih_ellipse_scratch *scratch, int32_t from, int32_t to)
{
    int32_t dx = scratch->x_q8[to] - scratch->x_q8[from];
    int32_t dy = scratch->y_q8[to] - scratch->y_q8[from];
    return dx * dx + dy * dy; /* at most 2 (46 * 256)^2 = 2^28.1 */
}

/* A part's merit. */
static int32_t merit_q8(int32_t arc_q8, int32_t chord_q8, int32_t shape_q16)
{
    int64_t shape_cost_q8 = ih_mul_shift((int64_t)SHAPE_COST * (shape_q16 - 65536), arc_q8, 16);
    return ih_saturate_s32(arc_q8 - ih_mul_shift(CHORD_COST_Q8, chord_q8, 8) - shape_cost_q8);
}

/* Is the part an ellipse around the place, of at least so much merit? */
static bool test_part(const struct ih_ellipse_scratch *scratch, int32_t from, int32_t to,
                      int32_t arc_q8, int32_t least_q8, struct ih_vertex place,
                      const struct ih_ellipse_params *params, struct ih_ellipse *out)
{
    struct ih_moments m;
    if (!part_moments(scratch, from, to, &m) ||
        !ellipse_of_moments(&m, half_q9(place.x_q9), half_q9(place.y_q9), out) ||
        out->area_q16 <= 0 || out->shape_q16 < SHAPE_MIN_Q16 ||
        out->shape_q16 > params->shape_max_q16 || !set_ratio(out) ||
        out->ratio_q16 > params->ratio_part_max_q16) {
        return false;
    }
    int32_t chord_q8 = (int32_t)ih_isqrt_u64((uint64_t)chord2_q16(scratch, from, to));
    out->merit_q8 = merit_q8(arc_q8, chord_q8, out->shape_q16);
    return out->merit_q8 >= least_q8;
}

/* Is the place inside the box around the contour? Outside nothing winds round it. One step is left
 * for what resampling rounds. */
static bool is_place_inside(const struct ih_cuts *cuts, const struct ih_contour *contour,
                            struct ih_vertex place)
{
    const struct ih_vertex *vertex = &cuts->vertex[contour->first];
    bool left = false, right = false, above = false, below = false;
    for (int32_t i = 0; i < contour->vertex_count; i++) {
        left |= vertex[i].x_q9 <= place.x_q9 + 2;
        right |= vertex[i].x_q9 >= place.x_q9 - 2;
        above |= vertex[i].y_q9 <= place.y_q9 + 2;
        below |= vertex[i].y_q9 >= place.y_q9 - 2;
    }
    return left && right && above && below;
}

/* What belongs to an arc of k steps. */
struct arcs {
    int32_t length_q8[IH_ELLIPSE_POINTS];
    int32_t merit_most_q8[IH_ELLIPSE_POINTS]; /* with the best shape and no chord */
    int32_t chord_end_q8[IH_ELLIPSE_POINTS];  /* from here on a chord is too long */
    /* or the part has too little merit: in squares, no root is needed */
    int32_t chord2_end_q16[IH_ELLIPSE_POINTS];
};

static void measure_arcs(int32_t length_q8, int32_t steps, const struct ih_ellipse_params *params,
                         struct arcs *arcs)
{
    for (int32_t k = 0; k < IH_ELLIPSE_POINTS; k++) {
        int32_t part_q8 = (int32_t)((int64_t)length_q8 * k / steps);
        arcs->length_q8[k] = part_q8;
        arcs->merit_most_q8[k] = merit_q8(part_q8, 0, SHAPE_MIN_Q16);
        arcs->chord_end_q8[k] = (int32_t)((int64_t)params->chord_max_q16 * part_q8 >> 16) + 1;
    }
}

/* A chord costs 1.6 of its length: 160 / 256 is more than its inverse, 2 for what was rounded.
 * Chords are below 2^14.1, so a limit beyond 2^15 is none. */
static void limit_chords(struct arcs *arcs, int32_t least_q8)
{
    for (int32_t k = 0; k < IH_ELLIPSE_POINTS; k++) {
        int64_t spare_q8 = (int64_t)arcs->merit_most_q8[k] - least_q8;
        int64_t end_q8 = spare_q8 < 0 ? 0 : (spare_q8 * 160 >> 8) + 2;
        end_q8 = end_q8 < arcs->chord_end_q8[k] ? end_q8 : arcs->chord_end_q8[k];
        int32_t bounded_q8 = ih_min_s32((int32_t)end_q8, 1 << 15);
        arcs->chord2_end_q16[k] = bounded_q8 * bounded_q8;
    }
}

/* Has any part from a point to one of first..last a chord that is short enough? */
static bool any_chord(const struct ih_ellipse_scratch *scratch, const struct arcs *arcs,
                      int32_t from, int32_t first, int32_t last)
{
    uint32_t any = 0;
    for (int32_t to = first; to <= last; to++) {
        any |= chord2_q16(scratch, from, to) < arcs->chord2_end_q16[to - from];
    }
    return any != 0;
}

bool ih_ellipse_of_part(const struct ih_cuts *cuts, const struct ih_contour *contour,
                        struct ih_vertex place, const struct ih_ellipse_params *params,
                        struct ih_ellipse_scratch *scratch, struct ih_ellipse *out)
{
    if (contour->vertex_count > IH_ELLIPSE_VERTICES_MAX || contour->vertex_count < PART_EDGES_MIN ||
        !is_place_inside(cuts, contour, place)) {
        return false;
    }
    struct arcs arcs;
    int32_t length_q8 = resample(cuts, contour, place, scratch);
    int32_t count = accumulate(contour, scratch);
    measure_arcs(length_q8, contour->closed ? IH_ELLIPSE_POINTS : IH_ELLIPSE_POINTS - 1, params,
                 &arcs);
    limit_chords(&arcs, INT32_MIN);
    bool found = false;
    /* Of equal ones the first, the shortest of those, is taken. Long ones, which have more merit,
     * are looked at first. */
    for (int32_t from = 0; from < IH_ELLIPSE_POINTS; from++) {
        const int32_t first = from + PART_EDGES_MIN;
        const int32_t last = ih_min_s32(count - 1, from + IH_ELLIPSE_POINTS - 1);
        bool found_here = false;
        if (!any_chord(scratch, &arcs, from, first, last)) {
            continue;
        }
        for (int32_t to = last; to >= first; to--) {
            if (chord2_q16(scratch, from, to) >= arcs.chord2_end_q16[to - from]) {
                continue;
            }
            int32_t least_q8 = !found ? INT32_MIN : out->merit_q8 + (found_here ? 0 : 1);
            struct ih_ellipse part;
            if (test_part(scratch, from, to, arcs.length_q8[to - from], least_q8, place, params,
                          &part)) {
                *out = part;
                found = true;
                found_here = true;
                limit_chords(&arcs, part.merit_q8);
            }
        }
    }
    return found;
}
