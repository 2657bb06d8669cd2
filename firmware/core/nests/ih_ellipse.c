#include "nests/ih_ellipse.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "surface/ih_surface.h"

#define FOUR_PI_Q16 823550 /* 4 pi */
#define RATIO_MAX 255
/* No polygon on the grid has its centre or its second moments beyond these; products of two of them
 * stay below 2^58. */
#define GRID_Q16 ((int64_t)IH_SURFACE_GRID << 16)
#define VARIANCE_MAX_Q16 ((int64_t)IH_SURFACE_GRID * IH_SURFACE_GRID << 16)
/* How the edge p -> q crosses the positive x axis. */
static int32_t winding_of_edge(int32_t px, int32_t py, int32_t qx, int32_t qy)
{
    if ((py <= 0) == (qy <= 0)) {
        return 0;
    }
    int64_t w = (int64_t)px * qy - (int64_t)qx * py;
    return py <= 0 ? w > 0 : -(w < 0);
}

/* Add the edge p -> q. Green's theorem: with w = px qy - qx py,
 *   2 area = sum w                        6 int x  = sum w (px + qx)
 *   12 int x^2 = sum w (px^2 + px qx + qx^2)
 *   12 int x y = sum w (2 px py + px qy + qx py + 2 qx qy) / 2
 * Coordinates are below 2^13.6, so w and its factors are below 2^29.9. */
static void add_edge(struct ih_moments *m, int32_t px, int32_t py, int32_t qx, int32_t qy)
{
    const int64_t w = px * qy - qx * py;
    m->area2_q16 += w;
    m->x_q24 += w * (px + qx);
    m->y_q24 += w * (py + qy);
    m->xx_q32 += w * (px * px + px * qx + qx * qx);
    m->yy_q32 += w * (py * py + py * qy + qy * qy);
    m->xy_q32 += w * (2 * px * py + px * qy + qx * py + 2 * qx * qy) / 2;
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
    int64_t remainder = sum_q24 % divisor_q16; /* divisor below 2^32: remainder * 256 below 2^40 */
    return whole_q8 * 256 + ih_div_round(remainder * 256, divisor_q16);
}

/* Ellipse of closed moments around (x0, y0), Q8 steps, but for its axis ratio. False when the area is
 * nothing. */
static bool ellipse_of_moments(const struct ih_moments *m, int32_t x0_q8, int32_t y0_q8,
                               struct ih_ellipse *out)
{
    int64_t sign = m->area2_q16 < 0 ? -1 : 1;
    int64_t area2_q16 = sign * m->area2_q16;
    if (area2_q16 < IH_ARCS_AREA2_MIN_Q16) {
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

static struct ih_moments contour_moments(const struct ih_contours *contours,
                                         const struct ih_contour *contour, struct ih_vertex place)
{
    const struct ih_vertex *vertex = &contours->vertex[contour->first];
    struct ih_moments m = {0};
    for (int32_t i = 0; i < contour->vertex_count; i++) {
        struct ih_vertex p = vertex[i];
        struct ih_vertex q = vertex[i + 1 < contour->vertex_count ? i + 1 : 0];
        add_edge(&m, half_q9(p.x_q9 - place.x_q9), half_q9(p.y_q9 - place.y_q9),
                 half_q9(q.x_q9 - place.x_q9), half_q9(q.y_q9 - place.y_q9));
    }
    return m;
}

bool ih_ellipse_of_contour(const struct ih_contours *contours, const struct ih_contour *contour,
                           struct ih_ellipse *out)
{
    struct ih_vertex place = contours->vertex[contour->first];
    place.x_q9 = (int16_t)(place.x_q9 & ~1); /* a whole Q8 number */
    place.y_q9 = (int16_t)(place.y_q9 & ~1);
    struct ih_moments m = contour_moments(contours, contour, place);
    return ellipse_of_moments(&m, place.x_q9 / 2, place.y_q9 / 2, out) && set_ratio(out);
}

int32_t ih_ellipse_winding(const struct ih_contours *contours, const struct ih_contour *contour,
                           struct ih_vertex place)
{
    const struct ih_vertex *vertex = &contours->vertex[contour->first];
    struct ih_vertex p = vertex[contour->vertex_count - 1];
    int32_t winding = 0;
    for (int32_t i = 0; i < contour->vertex_count; i++) {
        struct ih_vertex q = vertex[i];
        winding += winding_of_edge(half_q9(p.x_q9 - place.x_q9), half_q9(p.y_q9 - place.y_q9),
                                   half_q9(q.x_q9 - place.x_q9), half_q9(q.y_q9 - place.y_q9));
        p = q;
    }
    return winding;
}

/* A point of the outline, seen from a place. */
struct spot {
    int32_t x_q8, y_q8;
};

static struct spot seen_from(const struct ih_arcs *arcs, int32_t k, struct ih_vertex place)
{
    return (struct spot){arcs->x_q8[k] - half_q9(place.x_q9), arcs->y_q8[k] - half_q9(place.y_q9)};
}

static void accumulate_winding(const struct ih_arcs *arcs, struct ih_vertex place,
                               struct ih_ellipse_scratch *scratch)
{
    const int32_t y_q8 = half_q9(place.y_q9);
    int32_t winding = 0;
    bool was_above = arcs->y_q8[0] <= y_q8;
    for (int32_t k = 0; k < arcs->count; k++) {
        const bool is_above = arcs->y_q8[k] <= y_q8;
        if (is_above != was_above) { /* else nothing is crossed */
            const struct spot p = seen_from(arcs, k - 1, place), q = seen_from(arcs, k, place);
            winding += winding_of_edge(p.x_q8, p.y_q8, q.x_q8, q.y_q8);
            was_above = is_above;
        }
        scratch->winding[k] = winding;
    }
}

/* Does the arc, closed by its chord, wind round the place once? */
static bool winds_round(const struct ih_arcs *arcs, const struct ih_arc *arc,
                        struct ih_vertex place, const struct ih_ellipse_scratch *scratch)
{
    const int32_t from = arc->from, to = arc->from + arc->steps;
    const struct spot p = seen_from(arcs, to, place);
    const struct spot q = seen_from(arcs, from, place);
    return scratch->winding[to] - scratch->winding[from] +
               winding_of_edge(p.x_q8, p.y_q8, q.x_q8, q.y_q8) ==
           1;
}

/* What add_edge cuts off of an edge's term for x y, in halves: of an odd one its sign. The factor beside the
 * edge's cross product is odd if that is. */
static inline int32_t odd_half(int32_t px, int32_t py, int32_t qx, int32_t qy)
{
    const int32_t w = px * qy - qx * py;
    const int32_t beside = 2 * (px * py + qx * qy) + px * qy + qx * py;
    const int32_t sign = (w ^ beside) < 0 ? -1 : 1;
    return (w & 1) != 0 ? sign : 0;
}

/* All that is cut off for an arc; compilers turn the loop into vectors. */
static int32_t odd_halves(const struct ih_arcs *arcs, const struct ih_arc *arc,
                          struct ih_vertex place)
{
    const int32_t x_q8 = half_q9(place.x_q9);
    const int32_t y_q8 = half_q9(place.y_q9);
    const int32_t *x = &arcs->x_q8[arc->from];
    const int32_t *y = &arcs->y_q8[arc->from];
    const int32_t steps = arc->steps;
    int32_t sum = odd_half(x[steps] - x_q8, y[steps] - y_q8, x[0] - x_q8, y[0] - y_q8);
    for (int32_t k = 0; k < steps; k++) {
        sum += odd_half(x[k] - x_q8, y[k] - y_q8, x[k + 1] - x_q8, y[k + 1] - y_q8);
    }
    return sum;
}

/* Moments of the arc, closed by its chord, about the middle of the outline: but for x y, which is twice as
 * much. */
IH_WRAPPING static struct ih_moments middle_moments(const struct ih_arcs *arcs,
                                                    const struct ih_arc *arc)
{
    const struct ih_arcs_sums *s = &arcs->sums;
    const int32_t from = arc->from, to = arc->from + arc->steps;
    const int64_t px = arcs->dx_q8[to], py = arcs->dy_q8[to];
    const int64_t qx = arcs->dx_q8[from], qy = arcs->dy_q8[from];
    const int64_t w = px * qy - qx * py;
    const int64_t in_x = px * (px + qx) + qx * qx, in_y = py * (py + qy) + qy * qy;
    struct ih_moments m;
    m.area2_q16 = IH_WRAPS(int32_t, s->area2_q16[to] - s->area2_q16[from] + IH_WRAPS(uint32_t, w));
    m.x_q24 = s->x_q24[to] - s->x_q24[from] + w * (px + qx);
    m.y_q24 = s->y_q24[to] - s->y_q24[from] + w * (py + qy);
    m.xx_q32 = s->xx_q32[to] - s->xx_q32[from] + w * in_x;
    m.yy_q32 = s->trace_q32[to] - s->trace_q32[from] + w * (in_x + in_y) - m.xx_q32;
    m.xy_q32 = s->xy_q32[to] - s->xy_q32[from] + w * (2 * (px * py + qx * qy) + px * qy + qx * py);
    return m;
}

/* Moments of the arc, closed by its chord, about the place: what add_edge sums up. The place is c from the
 * middle, as near as the outline, 2^12.6: with twice the area below 2^31 first moments are below 2^45.2, and
 * all terms together below 2^62. */
static struct ih_moments part_moments(const struct ih_arcs *arcs, const struct ih_arc *arc,
                                      struct ih_vertex place)
{
    const struct ih_moments middle = middle_moments(arcs, arc);
    const int64_t cx = half_q9(place.x_q9) - (arcs->x_q8[0] - arcs->dx_q8[0]);
    const int64_t cy = half_q9(place.y_q9) - (arcs->y_q8[0] - arcs->dy_q8[0]);
    const int64_t area2 = middle.area2_q16, x = middle.x_q24, y = middle.y_q24;
    const int64_t xy = middle.xy_q32 - 4 * (cx * y + cy * x) + 12 * cx * cy * area2;
    return (struct ih_moments){
        .area2_q16 = area2,
        .x_q24 = x - 3 * cx * area2,
        .y_q24 = y - 3 * cy * area2,
        .xx_q32 = middle.xx_q32 - 4 * cx * x + 6 * cx * cx * area2,
        .yy_q32 = middle.yy_q32 - 4 * cy * y + 6 * cy * cy * area2,
        .xy_q32 = (xy - odd_halves(arcs, arc, place)) / 2,
    };
}

/* Is the arc, which winds round the place, an ellipse? */
static bool measure_part(const struct ih_arcs *arcs, const struct ih_arc *arc,
                         struct ih_vertex place, const struct ih_ellipse_params *params,
                         struct ih_ellipse *out)
{
    const struct ih_moments m = part_moments(arcs, arc, place);
    if (!ellipse_of_moments(&m, half_q9(place.x_q9), half_q9(place.y_q9), out) ||
        out->area_q16 <= 0 || out->shape_q16 < IH_ARCS_SHAPE_MIN_Q16 ||
        out->shape_q16 > params->shape_max_q16 || !set_ratio(out) ||
        out->ratio_q16 > params->ratio_arc_max_q16) {
        return false;
    }
    const int32_t chord2_q16 = ih_arcs_chord2_q16(arcs, arc->from, arc->from + arc->steps);
    out->merit_q8 = ih_arcs_merit_q8(arcs->length_q8[arc->steps],
                                     (int32_t)ih_isqrt_u64((uint64_t)chord2_q16), out->shape_q16);
    IH_IN_RANGE(out->merit_q8, INT32_MIN, arc->merit_max_q8);
    return true;
}

/* The part that may have the most merit of those that wind round the place; IH_NONE when none does. */
static int32_t max_promising(const struct ih_arcs *arcs, struct ih_vertex place,
                             const struct ih_ellipse_scratch *scratch)
{
    int32_t max = IH_NONE;
    for (int32_t i = 0; i < arcs->arc_count; i++) {
        const struct ih_arc *arc = &arcs->arc[i];
        if ((max == IH_NONE || arc->merit_max_q8 > arcs->arc[max].merit_max_q8) &&
            winds_round(arcs, arc, place, scratch)) {
            max = i;
        }
    }
    return max;
}

bool ih_ellipse_of_part(const struct ih_arcs *arcs, struct ih_vertex place,
                        const struct ih_ellipse_params *params, struct ih_ellipse_scratch *scratch,
                        struct ih_ellipse *out)
{
    if (arcs->arc_count == 0) {
        return false;
    }
    accumulate_winding(arcs, place, scratch);
    const int32_t first = max_promising(arcs, place, scratch);
    if (first == IH_NONE) {
        return false;
    }
    int32_t found = measure_part(arcs, &arcs->arc[first], place, params, out) ? first : IH_NONE;
    for (int32_t i = 0; i < arcs->arc_count; i++) {
        const struct ih_arc *arc = &arcs->arc[i];
        struct ih_ellipse ellipse;
        if (i != first && (found == IH_NONE || arc->merit_max_q8 >= out->merit_q8) &&
            winds_round(arcs, arc, place, scratch) &&
            measure_part(arcs, arc, place, params, &ellipse) &&
            (found == IH_NONE || ellipse.merit_q8 > out->merit_q8 ||
             (ellipse.merit_q8 == out->merit_q8 && i < found))) {
            *out = ellipse;
            found = i;
        }
    }
    if (found != IH_NONE) {
        scratch->arc = arcs->arc[found];
    }
    return found != IH_NONE;
}
