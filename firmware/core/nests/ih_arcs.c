#include "nests/ih_arcs.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "nests/ih_arc_fans.h"

/* Rounding errors of spreads, see Error in the header: 12 times the largest distance of an ellipse's centre
 * from the middle of the outline; 18 times 49 units of Q16 of a second moment in ih_ellipse. */
#define CENTRE_ERROR (12 * 93 * 256)
#define MOMENT_ERROR 882
/* Rounding error of a shape in ih_ellipse, with a margin: a unit, and one unit of the determinant's root, which
 * is the shape times twice the area over 8 pi. */
#define SHAPE_ERROR_Q16 3
#define ROOT_ERROR_Q32 (1 << 21)
/* 18 / 8 pi, rounded up: see limit_shapes. */
#define CIRCLE_Q16 46938
/* A larger limit of the spread would overflow; then no arc is dropped. */
#define SPREAD_LIMIT_MAX_Q16 (8 << 16)
/* Every arc has a larger area, twice. */
#define AREA2_NONE_Q16 (IH_ARCS_AREA2_MIN_Q16 - 1)
/* Twice the area of an arc that is judged, and the edges' cross products of an outline that is not tangled, as
 * powers of two times the square of the outline's largest distance from its middle. */
#define AREA2_BITS 3
#define TANGLED_BITS 5
/* 324 / (64 pi^2): the determinant of an ellipse's spreads over the cube of its squared area; and the
 * inverse, rounded down. */
#define ELLIPSE_Q20 537855
#define ELLIPSE_INVERSE_Q20 2044252
/* Weights of chord and shape in an arc's merit. */
#define CHORD_COST_Q8 410 /* 1.6 */
#define SHAPE_COST 8

void ih_ellipse_params_default(struct ih_ellipse_params *params)
{
    *params = (struct ih_ellipse_params){
        .point_count = 32,
        .shape_max_q16 = 68485,         /* 1.045 */
        .ratio_closed_max_q16 = 124518, /* 1.9 */
        .ratio_arc_max_q16 = 114688,    /* 1.75 */
        .chord_max_q16 = 27525,         /* 0.42 */
    };
}

struct ih_box ih_arcs_box(const struct ih_contours *contours, const struct ih_contour *contour)
{
    const struct ih_vertex *vertex = &contours->vertex[contour->first];
    struct ih_box box = {INT16_MAX, INT16_MIN, INT16_MAX, INT16_MIN};
    for (int32_t i = 0; i < contour->vertex_count; i++) {
        box.left_q9 = ih_min_s32(box.left_q9, vertex[i].x_q9);
        box.right_q9 = ih_max_s32(box.right_q9, vertex[i].x_q9);
        box.top_q9 = ih_min_s32(box.top_q9, vertex[i].y_q9);
        box.bottom_q9 = ih_max_s32(box.bottom_q9, vertex[i].y_q9);
    }
    return box;
}

bool ih_box_holds(const struct ih_box *box, struct ih_vertex point)
{
    return box->left_q9 <= point.x_q9 + 2 && box->right_q9 >= point.x_q9 - 2 &&
           box->top_q9 <= point.y_q9 + 2 && box->bottom_q9 >= point.y_q9 - 2;
}

static int32_t edge_length_q9(struct ih_vertex p, struct ih_vertex q)
{
    const int32_t dx = q.x_q9 - p.x_q9;
    const int32_t dy = q.y_q9 - p.y_q9;
    return (int32_t)ih_isqrt_u32((uint32_t)(dx * dx + dy * dy)); /* up to 2 (46 * 512)^2 = 2^30.1 */
}

/* Lengths of all edges, and of the contour. A closed one has an edge back to its first vertex. */
static int32_t measure_edges(const struct ih_vertex *vertex, int32_t vertex_count,
                             struct ih_arcs *out)
{
    const int32_t edges = out->closed ? vertex_count : vertex_count - 1;
    int32_t total_q9 = 0;
    for (int32_t i = 0; i < edges; i++) {
        const struct ih_vertex q = vertex[i + 1 < vertex_count ? i + 1 : 0];
        out->edge_length_q9[i] = edge_length_q9(vertex[i], q);
        total_q9 += out->edge_length_q9[i];
    }
    return total_q9;
}

/* The length of some of the steps: both factors below 2^24.7, their product below 2^30.5. */
static int32_t length_of_steps(int32_t total, int32_t steps, const struct ih_arcs *arcs)
{
    return total * steps / (arcs->closed ? arcs->point_count : arcs->point_count - 1);
}

/* The coordinate at a distance along the edge from p to q. In 32 bits: a difference is below 2^14.6, a length
 * below 2^15.1. */
static int32_t between_q8(int32_t p_q9, int32_t q_q9, int32_t distance_q9, int32_t length_q9)
{
    const int32_t product = (q_q9 - p_q9) * distance_q9;
    const int32_t half = length_q9 / 2;
    const int32_t step_q9 = (product >= 0 ? product + half : product - half) / length_q9;
    return (int32_t)ih_shift_round(p_q9 + step_q9, 1);
}

/* Sets points at equal steps along the contour, and the lengths of arcs. */
static void resample(const struct ih_contours *contours, const struct ih_contour *contour,
                     struct ih_arcs *out)
{
    const struct ih_vertex *vertex = &contours->vertex[contour->first];
    const int32_t edges = contour->closed ? contour->vertex_count : contour->vertex_count - 1;
    const int32_t total_q9 = measure_edges(vertex, contour->vertex_count, out);
    int32_t edge = 0;
    int32_t before_q9 = 0; /* length before the edge */
    for (int32_t k = 0; k < out->point_count; k++) {
        const int32_t target_q9 = length_of_steps(total_q9, k, out);
        out->length_q8[k] = length_of_steps(total_q9 / 2, k, out);
        while (edge < edges - 1 && before_q9 + out->edge_length_q9[edge] < target_q9) {
            before_q9 += out->edge_length_q9[edge];
            edge++;
        }
        const struct ih_vertex p = vertex[edge];
        const struct ih_vertex q = vertex[edge + 1 < contour->vertex_count ? edge + 1 : 0];
        const int32_t distance_q9 = ih_min_s32(target_q9 - before_q9, out->edge_length_q9[edge]);
        const int32_t length_q9 = ih_max_s32(out->edge_length_q9[edge], 1);
        out->x_q8[k] = between_q8(p.x_q9, q.x_q9, distance_q9, length_q9);
        out->y_q8[k] = between_q8(p.y_q9, q.y_q9, distance_q9, length_q9);
        IH_IN_RANGE(out->x_q8[k], 0, IH_RANGE_OFFSET_Q8);
        IH_IN_RANGE(out->y_q8[k], 0, IH_RANGE_OFFSET_Q8);
    }
    out->count = out->point_count;
    for (int32_t k = 0; k < out->point_count && out->closed; k++) {
        out->x_q8[out->count] = out->x_q8[k];
        out->y_q8[out->count++] = out->y_q8[k];
    }
}

/* Chords of arcs must be shorter. They are below 2^14.1, so a limit beyond 2^15 excludes none. */
static void limit_chords(const struct ih_ellipse_params *params, struct ih_arcs *out)
{
    for (int32_t k = IH_ARCS_STEPS_MIN; k < out->point_count; k++) {
        const int64_t max_q8 = (int64_t)params->chord_max_q16 * out->length_q8[k] >> 16;
        const int32_t end_q8 = max_q8 < 1 << 15 ? (int32_t)max_q8 + 1 : 1 << 15;
        out->chord2_end_q16[k] = end_q8 * end_q8;
    }
}

/* Limits of an ellipse's sums. */
struct limits {
    int32_t half_q8;                        /* half of the outline's longer side */
    int shift;                              /* of first moments; of second ones twice that */
    int64_t area2_max_q16;                  /* arcs with a larger area are not judged */
    int32_t error;                          /* of a spread over the area, without the moments' */
    int64_t spread_q16;                     /* over the area's cube */
    int64_t both2_q16;                      /* trace squared over determinant, from the ratio */
    int64_t shape2_min_q20, shape2_max_q20; /* determinant over the cube of the squared area */
};

static void limit_shapes(const struct ih_ellipse_params *params, struct limits *out)
{
    int64_t ratio_q16 = ih_max_s32(params->ratio_arc_max_q16, 1 << 16);
    int64_t both_q16 = ratio_q16 + ((int64_t)1 << 32) / ratio_q16 + 1;
    int64_t limit_q16 =
        ih_mul_shift(ih_mul_shift(both_q16, params->shape_max_q16, 16), CIRCLE_Q16, 16);
    out->spread_q16 = limit_q16 + limit_q16 / 1024 + 1;
    if (out->spread_q16 > SPREAD_LIMIT_MAX_Q16) {
        out->area2_max_q16 = 0; /* none is judged: the products below might overflow */
        return;
    }
    int64_t shape_q16 = ih_max_s32(params->shape_max_q16, 0);
    out->both2_q16 = ih_mul_shift(both_q16, both_q16, 16);
    out->both2_q16 += out->both2_q16 / 128;
    out->shape2_max_q20 = ih_mul_shift(ih_mul_shift(shape_q16, shape_q16, 16), ELLIPSE_Q20, 16);
    out->shape2_max_q20 += out->shape2_max_q20 / 512 + 1;
    out->shape2_min_q20 = ELLIPSE_Q20 - ELLIPSE_Q20 / 100;
}

/* Sets coordinates from the middle of the outline, and the limits of its arcs. */
static void measure_extent(const struct ih_ellipse_params *params, struct ih_arcs *arcs,
                           struct limits *out)
{
    int32_t left = arcs->x_q8[0], right = left, top = arcs->y_q8[0], bottom = top;
    for (int32_t k = 0; k < arcs->point_count; k++) {
        left = ih_min_s32(left, arcs->x_q8[k]);
        right = ih_max_s32(right, arcs->x_q8[k]);
        top = ih_min_s32(top, arcs->y_q8[k]);
        bottom = ih_max_s32(bottom, arcs->y_q8[k]);
    }
    const int32_t middle_x_q8 = (left + right) / 2, middle_y_q8 = (top + bottom) / 2;
    for (int32_t k = 0; k < arcs->count; k++) {
        arcs->dx_q8[k] = arcs->x_q8[k] - middle_x_q8;
        arcs->dy_q8[k] = arcs->y_q8[k] - middle_y_q8;
        arcs->square_q16[k] = arcs->dx_q8[k] * arcs->dx_q8[k] + arcs->dy_q8[k] * arcs->dy_q8[k];
    }
    const int32_t half_q8 = (ih_max_s32(right - left, bottom - top) + 1) / 2;
    const int bits = ih_bits_u64((uint64_t)half_q8);
    out->half_q8 = half_q8;
    out->shift = ih_max_s32(0, 3 * bits - 24);
    out->area2_max_q16 = (int64_t)1 << (2 * bits + AREA2_BITS);
    out->error = (CENTRE_ERROR >> out->shift) + 7;
    limit_shapes(params, out);
}

/* Sets the bits of arcs that may be ellipses: those that fans leave, or all where fans cannot judge. */
static void find_promising(const struct ih_ellipse_params *params, const struct limits *limits,
                           int32_t vertex_count, struct ih_arcs *out)
{
    const struct ih_arc_fans_limits fans = {.chord_max_q16 = params->chord_max_q16,
                                            .spread_q16 = limits->spread_q16,
                                            .half_q8 = limits->half_q8,
                                            .vertex_count = vertex_count};
    if (limits->area2_max_q16 != 0 && ih_arc_fans_find(&fans, out)) {
        return;
    }
    for (int32_t from = 0; from < out->point_count; from++) {
        const int32_t end = ih_min_s32(out->count - from, out->point_count);
        const uint64_t all = (((uint64_t)1 << end) - 1) >> IH_ARCS_STEPS_MIN << IH_ARCS_STEPS_MIN;
        out->low[from] = (uint32_t)(all & UINT32_MAX);
        out->high[from] = (uint32_t)(all >> 32);
    }
}

/* Sums over the edges, twice round a closed outline. Of a tangled one no arc is judged. */
IH_WRAPPING static void sum_edges(struct ih_arcs *arcs, struct limits *limits)
{
    struct ih_arcs_sums *s = &arcs->sums;
    uint32_t area2 = 0;
    int64_t x = 0, y = 0, trace = 0, xx = 0, xy = 0, tangle = 0;
    const int32_t points = arcs->point_count;
    const int32_t edges = arcs->closed ? points : points - 1;
    for (int32_t k = 0; k <= edges; k++) {
        s->area2_q16[k] = area2;
        s->x_q24[k] = x;
        s->y_q24[k] = y;
        s->trace_q32[k] = trace;
        s->xx_q32[k] = xx;
        s->xy_q32[k] = xy;
        if (k == edges) {
            break;
        }
        const int64_t px = arcs->dx_q8[k], py = arcs->dy_q8[k];
        const int64_t qx = arcs->dx_q8[k + 1], qy = arcs->dy_q8[k + 1];
        const int64_t w = px * qy - qx * py;
        const int64_t in_x = px * (px + qx) + qx * qx, in_y = py * (py + qy) + qy * qy;
        tangle += ih_abs_s64(w);
        area2 += IH_WRAPS(uint32_t, w);
        x += w * (px + qx);
        y += w * (py + qy);
        trace += w * (in_x + in_y);
        xx += w * in_x;
        xy += w * (2 * (px * py + qx * qy) + px * qy + qx * py);
    }
    for (int32_t k = points + 1; k < arcs->count; k++) {
        s->area2_q16[k] = area2 + s->area2_q16[k - points];
        s->x_q24[k] = x + s->x_q24[k - points];
        s->y_q24[k] = y + s->y_q24[k - points];
        s->trace_q32[k] = trace + s->trace_q32[k - points];
        s->xx_q32[k] = xx + s->xx_q32[k - points];
        s->xy_q32[k] = xy + s->xy_q32[k - points];
    }
    if (tangle >> (TANGLED_BITS - AREA2_BITS) > limits->area2_max_q16) {
        limits->area2_max_q16 = 0;
    }
}

/* Sums of an arc closed by its chord, shifted by limits.shift. */
struct arc_sums {
    int32_t px, py, qx, qy, chord_q16; /* end, beginning, their cross product */
    int32_t area2_q16;                 /* twice the area */
    int32_t x, y;
    int32_t error;      /* rounding error of a spread, over the area */
    int64_t area4;      /* area2 squared, shifted once */
    int64_t spread;     /* trace of the second moments, times 18 area2^2 */
    int64_t spread_max; /* the limit, with the rounding error */
};

static inline int64_t times(int32_t a, int32_t b)
{
    return (int64_t)a * b;
}

IH_WRAPPING static struct arc_sums sum_area(const struct ih_arcs *arcs, int32_t from, int32_t to)
{
    const uint32_t *sum = arcs->sums.area2_q16;
    struct arc_sums sums = {.px = arcs->dx_q8[to],
                            .py = arcs->dy_q8[to],
                            .qx = arcs->dx_q8[from],
                            .qy = arcs->dy_q8[from]};
    sums.chord_q16 = sums.px * sums.qy - sums.qx * sums.py;
    sums.area2_q16 = IH_WRAPS(int32_t, sum[to] - sum[from] + IH_WRAPS(uint32_t, sums.chord_q16));
    return sums;
}

/* Adds centre and spread. */
static void add_spread(const struct ih_arcs *arcs, const struct limits *limits, int32_t from,
                       int32_t to, struct arc_sums *out)
{
    const struct ih_arcs_sums *s = &arcs->sums;
    const int shift = limits->shift;
    const int32_t w = out->chord_q16, area2 = out->area2_q16;
    const int32_t both_q16 =
        arcs->square_q16[to] + arcs->square_q16[from] + out->px * out->qx + out->py * out->qy;
    const int64_t x_q24 = s->x_q24[to] - s->x_q24[from] + times(w, out->px + out->qx);
    const int64_t y_q24 = s->y_q24[to] - s->y_q24[from] + times(w, out->py + out->qy);
    const int64_t trace_q32 = s->trace_q32[to] - s->trace_q32[from] + times(w, both_q16);
    out->x = (int32_t)(x_q24 >> shift);
    out->y = (int32_t)(y_q24 >> shift);
    out->area4 = times(area2, area2) >> shift;
    out->error = limits->error + (int32_t)(times(area2, MOMENT_ERROR) >> (2 * shift));
    out->spread = 3 * area2 * (trace_q32 >> (2 * shift)) -
                  2 * (times(out->x, out->x) + times(out->y, out->y));
    out->spread_max = ((out->area4 * limits->spread_q16 >> (16 + shift)) + out->error) * area2;
}

/* Bounds of the determinant, scaled with the cube of the squared area so that products fit. */
struct roundness {
    int64_t determinant_min, determinant_max;
    int64_t trace2, cube2;
};

/* False: no ellipse. */
static bool find_roundness(const struct ih_arcs *arcs, const struct limits *limits, int32_t from,
                           int32_t to, const struct arc_sums *sums, struct roundness *out)
{
    const struct ih_arcs_sums *s = &arcs->sums;
    const int32_t px = sums->px, py = sums->py, qx = sums->qx, qy = sums->qy;
    const int32_t w = sums->chord_q16, area2 = sums->area2_q16, shift = limits->shift;
    const int64_t xx_q32 = s->xx_q32[to] - s->xx_q32[from] + times(w, px * (px + qx) + qx * qx);
    const int64_t xy_q32 =
        s->xy_q32[to] - s->xy_q32[from] + times(w, 2 * (px * py + qx * qy) + px * qy + qx * py);
    const int64_t xx = 3 * area2 * (xx_q32 >> (2 * shift)) - 2 * times(sums->x, sums->x);
    const int64_t xy = 3 * area2 * (xy_q32 >> (2 * shift + 1)) - 2 * times(sums->x, sums->y);
    const int64_t yy = sums->spread - xx;
    const int64_t max = sums->spread_max;
    const int64_t error =
        4 * ((int64_t)ih_abs_s32(sums->x) + ih_abs_s32(sums->y)) + 8 + times(area2, sums->error);
    if (xx < -error || yy < -error || ih_abs_s64(xy) > max + error) {
        return false;
    }
    const int drop = ih_max_s32(0, ih_bits_u64((uint64_t)max) - 29);
    const int32_t p = (int32_t)(xx >> drop);
    const int32_t q = (int32_t)(yy >> drop);
    const int32_t m = (int32_t)(xy >> drop);
    const int32_t near = (int32_t)(error >> drop) + 2;
    const int first = ih_min_s32(shift, 10); /* then the product is below 2^62 */
    const int32_t cube = (int32_t)((sums->area4 >> first) * area2 >> (shift - first + drop));
    const int64_t slack = 4 * times(near, (int32_t)(max >> drop) + near + 1);
    const int64_t determinant = times(p, q) - times(m, m);
    out->determinant_min = determinant - slack;
    out->determinant_max = determinant + slack;
    out->trace2 = times(p + q, p + q);
    out->cube2 = times(cube, cube);
    return true;
}

/* A lower bound of the arc's shape; 0: no ellipse. */
static int32_t min_shape_q16(const struct ih_arcs *arcs, const struct limits *limits, int32_t from,
                             int32_t to, const struct arc_sums *sums)
{
    struct roundness r;
    if (!find_roundness(arcs, limits, from, to, sums, &r) ||
        r.determinant_max < (r.cube2 >> 20) * limits->shape2_min_q20 ||
        r.determinant_min > ((r.cube2 >> 20) + 1) * limits->shape2_max_q20 ||
        r.trace2 >> 4 > ((r.determinant_max >> 20) + 1) * limits->both2_q16) {
        return 0;
    }
    const int64_t above =
        (r.determinant_min >> 20) * ELLIPSE_INVERSE_Q20 - r.cube2; /* squared, minus 1 */
    if (above <= 0) {
        return IH_ARCS_SHAPE_MIN_Q16;
    }
    /* sqrt(1 + u) >= 1 + u / 2 - u^2 / 8 */
    const int64_t u_q16 = ih_min_s32(ih_saturate_s32(above / ((r.cube2 >> 16) + 1)), 1 << 16);
    return (int32_t)(65536 + u_q16 / 2 - (u_q16 * u_q16 >> 19) - SHAPE_ERROR_Q16 -
                     ROOT_ERROR_Q32 / sums->area2_q16);
}

int32_t ih_arcs_merit_q8(int32_t length_q8, int32_t chord_q8, int32_t shape_q16)
{
    int64_t shape_cost_q8 = ih_mul_shift((int64_t)SHAPE_COST * (shape_q16 - 65536), length_q8, 16);
    return ih_saturate_s32(length_q8 - ih_mul_shift(CHORD_COST_Q8, chord_q8, 8) - shape_cost_q8);
}

static void add_arc(struct ih_arcs *arcs, int32_t from, int32_t steps, int32_t shape_q16)
{
    const uint32_t chord2_q16 = (uint32_t)ih_arcs_chord2_q16(arcs, from, from + steps);
    const int32_t chord_q8 = (int32_t)ih_isqrt_u32(chord2_q16);
    arcs->arc[arcs->arc_count++] = (struct ih_arc){
        .merit_max_q8 = ih_arcs_merit_q8(arcs->length_q8[steps], chord_q8, shape_q16),
        .from = (uint8_t)from,
        .steps = (uint8_t)steps,
    };
}

/* The same, of an arc that fans left. */
static int32_t judge_arc(const struct ih_arcs *arcs, int32_t from, int32_t k,
                         const struct limits *limits)
{
    const int32_t to = from + k;
    struct arc_sums sums = sum_area(arcs, from, to);
    if (sums.area2_q16 <= AREA2_NONE_Q16) {
        return 0;
    }
    if (sums.area2_q16 > limits->area2_max_q16) {
        return IH_ARCS_SHAPE_MIN_Q16;
    }
    add_spread(arcs, limits, from, to, &sums);
    if (sums.spread > sums.spread_max) {
        return 0;
    }
    return min_shape_q16(arcs, limits, from, to, &sums);
}

/* Adds those of the promising arcs from a point that may be ellipses. */
static void add_ellipses(struct ih_arcs *arcs, int32_t from, const struct limits *limits)
{
    for (int32_t half = 0; half < 2; half++) {
        uint32_t bits = half == 0 ? arcs->low[from] : arcs->high[from];
        for (; bits != 0; bits &= bits - 1) {
            const int32_t k = 32 * half + __builtin_ctz(bits);
            if (ih_arcs_chord2_q16(arcs, from, from + k) >= arcs->chord2_end_q16[k]) {
                continue;
            }
            const int32_t shape_q16 = judge_arc(arcs, from, k, limits);
            if (shape_q16 != 0) {
                add_arc(arcs, from, k, shape_q16);
            }
        }
    }
}

bool ih_arcs_make(const struct ih_contours *contours, const struct ih_contour *contour,
                  const struct ih_ellipse_params *params, struct ih_arcs *out)
{
    if (contour->vertex_count > IH_ARCS_VERTICES_MAX || contour->vertex_count < IH_ARCS_STEPS_MIN) {
        return false;
    }
    struct limits limits = {0};
    out->closed = contour->closed;
    out->point_count =
        ih_clamp_s32(params->point_count, IH_ARCS_POINTS_MIN, IH_ARCS_POINTS_MAX) & ~7;
    out->arc_count = 0;
    resample(contours, contour, out);
    limit_chords(params, out);
    measure_extent(params, out, &limits);
    find_promising(params, &limits, contour->vertex_count, out);
    sum_edges(out, &limits);
    for (int32_t from = 0; from < out->point_count; from++) {
        add_ellipses(out, from, &limits);
    }
    return true;
}
