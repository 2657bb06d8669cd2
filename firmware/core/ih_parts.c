#include "ih_parts.h"

#include "ih_fix.h"

#define POINTS IH_PARTS_POINTS
/* What is rounded of spreads, see Error in the header: 12 times the greatest distance of an ellipse's
 * centre from the middle of the outline; 18 times 49 units of Q16 of a second moment in ih_ellipse. */
#define CENTRE_ERROR (12 * 93 * 256)
#define MOMENT_ERROR 882
/* Rounded of a shape in ih_ellipse: a unit, and one of the determinant's root, which is the shape's share of
 * twice the area over 8 pi; with some more. */
#define SHAPE_ROUNDED_Q16 3
#define ROOT_ROUNDED_Q32 (1 << 21)
/* 18 / 8 pi, rounded up: see limit_shapes. */
#define CIRCLE_Q16 46938
/* Limits of the spread beyond this would overflow; then nothing is left out. */
#define SPREAD_LIMIT_MAX_Q16 (8 << 16)
/* No part has so little area, twice. */
#define AREA2_NONE_Q16 (IH_PARTS_AREA2_MIN_Q16 - 1)
/* An outline whose edges' cross products sum up to more than this many times the square of its greatest
 * distance from its middle is not judged; nor is a part of more area, twice, than that many. */
#define TANGLED_BITS 5
#define AREA2_BITS 3
/* 324 / (64 pi^2): what the determinant of an ellipse's spreads is to the cube of its area squared; and its
 * inverse, rounded down. */
#define ELLIPSE_Q20 537855
#define ELLIPSE_INVERSE_Q20 2044252
/* The weights of chord and shape in a part's merit. */
#define CHORD_COST_Q8 410 /* 1.6 */
#define SHAPE_COST 8

void ih_ellipse_params_default(struct ih_ellipse_params *params)
{
    *params = (struct ih_ellipse_params){
        .shape_max_q16 = 68485,         /* 1.045 */
        .ratio_closed_max_q16 = 124518, /* 1.9 */
        .ratio_part_max_q16 = 114688,   /* 1.75 */
        .chord_max_q16 = 27525,         /* 0.42 */
    };
}

struct ih_box ih_parts_box(const struct ih_cuts *cuts, const struct ih_contour *contour)
{
    const struct ih_vertex *vertex = &cuts->vertex[contour->first];
    struct ih_box box = {INT16_MAX, INT16_MIN, INT16_MAX, INT16_MIN};
    for (int32_t i = 0; i < contour->vertex_count; i++) {
        box.left_q9 = ih_min_s32(box.left_q9, vertex[i].x_q9);
        box.right_q9 = ih_max_s32(box.right_q9, vertex[i].x_q9);
        box.top_q9 = ih_min_s32(box.top_q9, vertex[i].y_q9);
        box.bottom_q9 = ih_max_s32(box.bottom_q9, vertex[i].y_q9);
    }
    return box;
}

bool ih_box_holds(const struct ih_box *box, struct ih_vertex place)
{
    return box->left_q9 <= place.x_q9 + 2 && box->right_q9 >= place.x_q9 - 2 &&
           box->top_q9 <= place.y_q9 + 2 && box->bottom_q9 >= place.y_q9 - 2;
}

static int32_t edge_length_q9(struct ih_vertex p, struct ih_vertex q)
{
    int64_t dx = q.x_q9 - p.x_q9;
    int64_t dy = q.y_q9 - p.y_q9;
    return (int32_t)ih_isqrt_u54((uint64_t)(dx * dx + dy * dy));
}

/* Lengths of all edges, and of the contour. A closed one has an edge back to its first vertex. */
static int32_t measure_edges(const struct ih_vertex *vertex, int32_t vertex_count,
                             struct ih_parts *out)
{
    const int32_t edges = out->closed ? vertex_count : vertex_count - 1;
    int32_t total_q9 = 0;
    for (int32_t i = 0; i < edges; i++) {
        const struct ih_vertex q = vertex[i + 1 < vertex_count ? i + 1 : 0];
        out->length_q9[i] = edge_length_q9(vertex[i], q);
        total_q9 += out->length_q9[i];
    }
    return total_q9;
}

/* A length that a part of the steps has: both below 2^24.7, their product below 2^30.5. */
static int32_t length_of_steps(int32_t total, int32_t steps, bool closed)
{
    return closed ? total * steps / POINTS : total * steps / (POINTS - 1);
}

/* From p towards q, both Q9, by so much of the edge's length. In 32 bits: a difference is below 2^14.6, a
 * length below 2^15.1. Q8. */
static int32_t between_q8(int32_t p_q9, int32_t q_q9, int32_t part_q9, int32_t length_q9)
{
    const int32_t way = (q_q9 - p_q9) * part_q9;
    const int32_t half = length_q9 / 2;
    const int32_t step_q9 = (way >= 0 ? way + half : way - half) / length_q9;
    return (int32_t)ih_shift_round(p_q9 + step_q9, 1);
}

/* Points at equal steps along the contour. */
static void resample(const struct ih_cuts *cuts, const struct ih_contour *contour,
                     struct ih_parts *out)
{
    const struct ih_vertex *vertex = &cuts->vertex[contour->first];
    const int32_t edges = contour->closed ? contour->vertex_count : contour->vertex_count - 1;
    const int32_t total_q9 = measure_edges(vertex, contour->vertex_count, out);
    int32_t edge = 0;
    int32_t before_q9 = 0; /* length up to the edge */
    for (int32_t k = 0; k < POINTS; k++) {
        const int32_t target_q9 = length_of_steps(total_q9, k, contour->closed);
        out->arc_q8[k] = length_of_steps(total_q9 / 2, k, contour->closed);
        while (edge < edges - 1 && before_q9 + out->length_q9[edge] < target_q9) {
            before_q9 += out->length_q9[edge];
            edge++;
        }
        const struct ih_vertex p = vertex[edge];
        const struct ih_vertex q = vertex[edge + 1 < contour->vertex_count ? edge + 1 : 0];
        const int32_t part_q9 = ih_min_s32(target_q9 - before_q9, out->length_q9[edge]);
        const int32_t length_q9 = ih_max_s32(out->length_q9[edge], 1);
        out->x_q8[k] = between_q8(p.x_q9, q.x_q9, part_q9, length_q9);
        out->y_q8[k] = between_q8(p.y_q9, q.y_q9, part_q9, length_q9);
        IH_IN_RANGE(out->x_q8[k], 0, IH_RANGE_OFFSET_Q8);
        IH_IN_RANGE(out->y_q8[k], 0, IH_RANGE_OFFSET_Q8);
    }
    out->count = POINTS;
    for (int32_t k = 0; k < POINTS && out->closed; k++) {
        out->x_q8[out->count] = out->x_q8[k];
        out->y_q8[out->count++] = out->y_q8[k];
    }
}

/* Bit k of each point: the chord over k steps from it is short enough. Chords are below 2^14.1: a limit
 * beyond 2^15 is none. */
static void find_short_chords(const struct ih_ellipse_params *params, struct ih_parts *out)
{
    for (int32_t from = 0; from < POINTS; from++) {
        out->short_low[from] = 0;
        out->short_high[from] = 0;
    }
    for (int32_t k = IH_PARTS_STEPS_MIN; k < POINTS; k++) {
        const int64_t most_q8 = (int64_t)params->chord_max_q16 * out->arc_q8[k] >> 16;
        const int32_t end_q8 = most_q8 < 1 << 15 ? (int32_t)most_q8 + 1 : 1 << 15;
        const int32_t end_q16 = end_q8 * end_q8;
        const int32_t from_count = ih_min_s32(out->count - k, POINTS);
        const uint32_t bit = (uint32_t)1 << (k & 31);
        uint32_t *of_point = k < 32 ? out->short_low : out->short_high;
        for (int32_t from = 0; from < from_count; from++) {
            of_point[from] |= ih_parts_chord2_q16(out, from, from + k) < end_q16 ? bit : 0;
        }
    }
}

/* What a part's sums must keep to be an ellipse's. */
struct limits {
    int shift;                              /* of first moments; second ones twice that */
    int64_t area2_most_q16;                 /* beyond it none is judged */
    int64_t error;                          /* of a spread, over the area */
    int64_t spread_q16;                     /* over the area's cube */
    int64_t both2_q16;                      /* trace squared over determinant, by the ratio */
    int64_t shape2_min_q20, shape2_max_q20; /* determinant over the area's cube squared */
};

static void limit_shapes(const struct ih_ellipse_params *params, struct limits *out)
{
    int64_t ratio_q16 = ih_max_s32(params->ratio_part_max_q16, 1 << 16); /* no ratio is less */
    int64_t both_q16 = ratio_q16 + ((int64_t)1 << 32) / ratio_q16 + 1;
    int64_t limit_q16 =
        ih_mul_shift(ih_mul_shift(both_q16, params->shape_max_q16, 16), CIRCLE_Q16, 16);
    out->spread_q16 = limit_q16 + limit_q16 / 1024 + 1;
    if (out->spread_q16 > SPREAD_LIMIT_MAX_Q16) {
        out->area2_most_q16 = 0; /* none is judged, and what follows might overflow */
        return;
    }
    int64_t shape_q16 = ih_max_s32(params->shape_max_q16, 0);
    out->both2_q16 = ih_mul_shift(both_q16, both_q16, 16);
    out->both2_q16 += out->both2_q16 / 128;
    out->shape2_max_q20 = ih_mul_shift(ih_mul_shift(shape_q16, shape_q16, 16), ELLIPSE_Q20, 16);
    out->shape2_max_q20 += out->shape2_max_q20 / 512 + 1;
    out->shape2_min_q20 = ELLIPSE_Q20 - ELLIPSE_Q20 / 100;
}

/* Middle of the outline; limits of its parts. */
static void measure_extent(const struct ih_ellipse_params *params, struct ih_parts *parts,
                           struct limits *out)
{
    int32_t left = parts->x_q8[0], right = left, top = parts->y_q8[0], bottom = top;
    for (int32_t k = 0; k < POINTS; k++) {
        left = ih_min_s32(left, parts->x_q8[k]);
        right = ih_max_s32(right, parts->x_q8[k]);
        top = ih_min_s32(top, parts->y_q8[k]);
        bottom = ih_max_s32(bottom, parts->y_q8[k]);
    }
    const int32_t middle_x_q8 = (left + right) / 2, middle_y_q8 = (top + bottom) / 2;
    for (int32_t k = 0; k < parts->count; k++) {
        parts->dx_q8[k] = parts->x_q8[k] - middle_x_q8;
        parts->dy_q8[k] = parts->y_q8[k] - middle_y_q8;
        parts->square_q16[k] =
            parts->dx_q8[k] * parts->dx_q8[k] + parts->dy_q8[k] * parts->dy_q8[k];
    }
    const int32_t half_q8 = (ih_max_s32(right - left, bottom - top) + 1) / 2;
    const int bits = ih_bits_u64((uint64_t)half_q8);
    out->shift = ih_max_s32(0, 3 * bits - 24);
    out->error = (CENTRE_ERROR >> out->shift) + 6;
    out->area2_most_q16 = (int64_t)1 << (2 * bits + AREA2_BITS);
    limit_shapes(params, out);
}

/* Sums over the edges, of a closed outline twice round. When it is too tangled none is judged. */
IH_WRAPPING static void sum_edges(struct ih_parts *parts, struct limits *limits)
{
    struct ih_parts_sums *s = &parts->sums;
    uint32_t area2 = 0;
    int64_t x = 0, y = 0, trace = 0, xx = 0, xy = 0, tangle = 0;
    const int32_t edges = parts->closed ? POINTS : POINTS - 1;
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
        const int64_t px = parts->dx_q8[k], py = parts->dy_q8[k];
        const int64_t qx = parts->dx_q8[k + 1], qy = parts->dy_q8[k + 1];
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
    for (int32_t k = POINTS + 1; k < parts->count; k++) {
        s->area2_q16[k] = area2 + s->area2_q16[k - POINTS];
        s->x_q24[k] = x + s->x_q24[k - POINTS];
        s->y_q24[k] = y + s->y_q24[k - POINTS];
        s->trace_q32[k] = trace + s->trace_q32[k - POINTS];
        s->xx_q32[k] = xx + s->xx_q32[k - POINTS];
        s->xy_q32[k] = xy + s->xy_q32[k - POINTS];
    }
    if (tangle >> (TANGLED_BITS - AREA2_BITS) > limits->area2_most_q16) {
        limits->area2_most_q16 = 0;
    }
}

/* A part, as it is looked at. Sums are shifted as limits.shift says. */
struct look {
    int32_t from, to;
    int64_t area2_q16; /* twice */
    int64_t x, y;
    int64_t spread;       /* the trace of the second moments, times 18 area2^2 */
    int64_t spread_limit; /* over the area */
};

/* Where all parts of a sifting begin: its place from the middle, and the sums up to it. */
struct beginning {
    int64_t x_q8, y_q8, square_q16; /* of the distance */
    int64_t x_q24, y_q24, trace_q32;
};

static struct beginning begin_at(const struct ih_parts *parts, int32_t from)
{
    return (struct beginning){
        .x_q8 = parts->dx_q8[from],
        .y_q8 = parts->dy_q8[from],
        .square_q16 = parts->square_q16[from],
        .x_q24 = parts->sums.x_q24[from],
        .y_q24 = parts->sums.y_q24[from],
        .trace_q32 = parts->sums.trace_q32[from],
    };
}

static void look_at_spread(const struct ih_parts *parts, const struct beginning *q, int shift,
                           struct look *look)
{
    const struct ih_parts_sums *s = &parts->sums;
    const int32_t to = look->to;
    const int64_t px = parts->dx_q8[to], py = parts->dy_q8[to];
    const int64_t w = px * q->y_q8 - q->x_q8 * py; /* of the chord, from the end to the beginning */
    const int64_t both_q16 = parts->square_q16[to] + q->square_q16 + px * q->x_q8 + py * q->y_q8;
    const int64_t x = (s->x_q24[to] - q->x_q24 + w * (px + q->x_q8)) >> shift;
    const int64_t y = (s->y_q24[to] - q->y_q24 + w * (py + q->y_q8)) >> shift;
    const int64_t trace = (s->trace_q32[to] - q->trace_q32 + w * both_q16) >> (2 * shift);
    look->x = x;
    look->y = y;
    look->spread = 3 * look->area2_q16 * trace - 2 * (x * x + y * y);
}

/* What is known of the determinant and of the area's cube squared, where both may be multiplied. */
struct roundness {
    int64_t determinant_least, determinant_most;
    int64_t trace2, cube2;
};

/* False: no ellipse. */
static bool look_at_shape(const struct ih_parts *parts, const struct limits *limits,
                          const struct look *look, struct roundness *out)
{
    const struct ih_parts_sums *s = &parts->sums;
    const int32_t to = look->to, from = look->from, shift = limits->shift;
    const int64_t px = parts->dx_q8[to], py = parts->dy_q8[to];
    const int64_t qx = parts->dx_q8[from], qy = parts->dy_q8[from];
    const int64_t area2 = look->area2_q16, w = px * qy - qx * py;
    const int64_t xx_q32 = s->xx_q32[to] - s->xx_q32[from] + w * (px * (px + qx) + qx * qx);
    const int64_t xy_q32 =
        s->xy_q32[to] - s->xy_q32[from] + w * (2 * (px * py + qx * qy) + px * qy + qx * py);
    const int64_t xx = 3 * area2 * (xx_q32 >> (2 * shift)) - 2 * look->x * look->x;
    const int64_t xy = 3 * area2 * (xy_q32 >> (2 * shift + 1)) - 2 * look->x * look->y;
    const int64_t yy = look->spread - xx;
    const int64_t most = look->spread_limit * area2;
    const int64_t square = area2 * area2 >> shift;
    const int64_t error = 4 * (ih_abs_s64(look->x) + ih_abs_s64(look->y)) + 3 * area2 + 8 +
                          (square * MOMENT_ERROR >> shift);
    if (xx < -error || yy < -error || ih_abs_s64(xy) > most + error) {
        return false;
    }
    const int drop = ih_max_s32(0, ih_bits_u64((uint64_t)most) - 29);
    const int64_t p = xx >> drop, q = yy >> drop, m = xy >> drop;
    const int64_t near = (error >> drop) + 2;
    const int first = ih_min_s32(shift, 10); /* then the product is below 2^62 */
    const int64_t cube = ((square >> first) * area2 >> (shift - first)) >> drop;
    const int64_t slack = 4 * near * ((most >> drop) + near + 1);
    const int64_t determinant = p * q - m * m;
    out->determinant_least = determinant - slack;
    out->determinant_most = determinant + slack;
    out->trace2 = (p + q) * (p + q);
    out->cube2 = cube * cube;
    return true;
}

/* The least shape that the part may have; 0 when it is no ellipse. */
static int32_t least_shape_q16(const struct ih_parts *parts, const struct limits *limits,
                               const struct look *look)
{
    struct roundness r;
    if (!look_at_shape(parts, limits, look, &r) ||
        r.determinant_most < (r.cube2 >> 20) * limits->shape2_min_q20 ||
        r.determinant_least > ((r.cube2 >> 20) + 1) * limits->shape2_max_q20 ||
        r.trace2 >> 4 > ((r.determinant_most >> 20) + 1) * limits->both2_q16) {
        return 0;
    }
    const int64_t above =
        (r.determinant_least >> 20) * ELLIPSE_INVERSE_Q20 - r.cube2; /* squared, less 1 */
    if (above <= 0) {
        return IH_PARTS_SHAPE_MIN_Q16;
    }
    /* sqrt(1 + u) >= 1 + u / 2 - u^2 / 8 */
    const int64_t u_q16 = ih_min_s32(ih_saturate_s32(above / ((r.cube2 >> 16) + 1)), 1 << 16);
    return (int32_t)(65536 + u_q16 / 2 - (u_q16 * u_q16 >> 19) - SHAPE_ROUNDED_Q16 -
                     ROOT_ROUNDED_Q32 / (int32_t)look->area2_q16);
}

int32_t ih_parts_merit_q8(int32_t arc_q8, int32_t chord_q8, int32_t shape_q16)
{
    int64_t shape_cost_q8 = ih_mul_shift((int64_t)SHAPE_COST * (shape_q16 - 65536), arc_q8, 16);
    return ih_saturate_s32(arc_q8 - ih_mul_shift(CHORD_COST_Q8, chord_q8, 8) - shape_cost_q8);
}

static void add_part(struct ih_parts *parts, int32_t from, int32_t steps, int32_t shape_q16)
{
    const uint64_t chord2_q16 = (uint64_t)ih_parts_chord2_q16(parts, from, from + steps);
    const int32_t chord_q8 = (int32_t)ih_isqrt_u54(chord2_q16);
    parts->part[parts->part_count++] = (struct ih_part){
        .merit_max_q8 = ih_parts_merit_q8(parts->arc_q8[steps], chord_q8, shape_q16),
        .from = (uint8_t)from,
        .steps = (uint8_t)steps,
    };
}

/* Twice the areas of all parts from a point: they fit into 32 bits, the sums they are of need not. */
IH_WRAPPING static void find_areas(const struct ih_parts *parts, int32_t from,
                                   int32_t area2_q16[POINTS])
{
    const int32_t x0 = parts->dx_q8[from], y0 = parts->dy_q8[from];
    const uint32_t before = parts->sums.area2_q16[from];
    const int32_t *x = &parts->dx_q8[from], *y = &parts->dy_q8[from];
    const uint32_t *sum = &parts->sums.area2_q16[from];
    const int32_t count = ih_min_s32(parts->count - from, POINTS);
    for (int32_t k = 0; k < count; k++) {
        const uint32_t chord = IH_WRAPS(uint32_t, x[k] * y0 - x0 * y[k]);
        area2_q16[k] = IH_WRAPS(int32_t, sum[k] - before + chord);
    }
}

/* What may be rounded of a spread, over the area. */
static int64_t spread_error(const struct limits *limits, int64_t area2)
{
    return limits->error + (area2 * MOMENT_ERROR >> (2 * limits->shift));
}

/* How spread may the part be, over its area, with what is rounded? */
static int64_t spread_limit(const struct limits *limits, int64_t area2)
{
    const int shift = limits->shift;
    return ((area2 * area2 >> shift) * limits->spread_q16 >> (16 + shift)) +
           spread_error(limits, area2);
}

/* Up to which area are parts too spread, when this one is, and the next ones hold it? Over the area they
 * are as spread at least, and the limit grows with the area's square at most. So it is the root of what
 * this one is above the limit, for which stands 2 t / (1 + t), which is less. */
static int64_t spread_until(const struct look *look, const struct limits *limits)
{
    const int64_t error = spread_error(limits, look->area2_q16);
    const int64_t most = look->spread_limit * look->area2_q16;
    const int64_t least = look->spread - error * look->area2_q16;
    if (least <= most) {
        return look->area2_q16;
    }
    return look->area2_q16 * (2 * least / ((least + most) / 65536 + 1)) / 65536;
}

/* Of the parts from a point whose chords are short enough those that may be ellipses. */
static void sift(struct ih_parts *parts, int32_t from, const struct limits *limits)
{
    const uint64_t short_ones =
        (uint64_t)parts->short_high[from] << 32 | (uint64_t)parts->short_low[from];
    if (short_ones == 0) {
        return;
    }
    int32_t area2_q16[POINTS];
    find_areas(parts, from, area2_q16);
    const struct beginning beginning = begin_at(parts, from);
    int64_t before_q16 = 0;
    int64_t none_until_q16 = AREA2_NONE_Q16; /* while it grows */
    for (int32_t k = __builtin_ctzll(short_ones); short_ones >> k != 0; k++) {
        const int64_t area2 = area2_q16[k];
        none_until_q16 = area2 < before_q16 ? AREA2_NONE_Q16 : none_until_q16;
        before_q16 = area2;
        if (area2 <= none_until_q16 || (short_ones >> k & 1) == 0) {
            continue;
        }
        if (area2 > limits->area2_most_q16) {
            add_part(parts, from, k, IH_PARTS_SHAPE_MIN_Q16);
            continue;
        }
        struct look look = {.from = from, .to = from + k, .area2_q16 = area2};
        look.spread_limit = spread_limit(limits, area2);
        look_at_spread(parts, &beginning, limits->shift, &look);
        if (look.spread > look.spread_limit * area2) {
            none_until_q16 = spread_until(&look, limits);
            continue;
        }
        const int32_t shape_q16 = least_shape_q16(parts, limits, &look);
        if (shape_q16 != 0) {
            add_part(parts, from, k, shape_q16);
        }
    }
}

bool ih_parts_make(const struct ih_cuts *cuts, const struct ih_contour *contour,
                   const struct ih_ellipse_params *params, struct ih_parts *out)
{
    if (contour->vertex_count > IH_PARTS_VERTICES_MAX ||
        contour->vertex_count < IH_PARTS_STEPS_MIN) {
        return false;
    }
    struct limits limits = {0};
    out->closed = contour->closed;
    out->part_count = 0;
    resample(cuts, contour, out);
    find_short_chords(params, out);
    measure_extent(params, out, &limits);
    sum_edges(out, &limits);
    for (int32_t from = 0; from < POINTS; from++) {
        sift(out, from, &limits);
    }
    return true;
}
