#include "ih_parts.h"

#include "ih_fix.h"

#define POINTS IH_PARTS_POINTS
/* Parts of less area, twice, are all looked at closely: 4 grid cells. */
#define AREA2_JUDGED_Q16 (8 << 16)
/* 18 / 8 pi, rounded up: see spread_limit_q16. */
#define CIRCLE_Q16 46938
/* Limits beyond this would overflow; then nothing is left out. */
#define SPREAD_LIMIT_MAX_Q16 (8 << 16)
/* First moments of a simple polygon are below this, see the header: 2^30.3. */
#define FIRST_MAX ((int64_t)5 << 28)

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

/* Points at equal steps along the contour. */
static void resample(const struct ih_cuts *cuts, const struct ih_contour *contour,
                     struct ih_parts *out)
{
    const struct ih_vertex *vertex = &cuts->vertex[contour->first];
    int32_t edges = contour->closed ? contour->vertex_count : contour->vertex_count - 1;
    int32_t steps = contour->closed ? POINTS : POINTS - 1;
    int32_t total_q9 = 0;
    for (int32_t i = 0; i < edges; i++) {
        total_q9 += edge_length_q9(cuts, contour, i);
    }
    for (int32_t k = 0; k < POINTS; k++) {
        out->arc_q8[k] = (int32_t)((int64_t)(total_q9 / 2) * k / steps);
    }
    int32_t edge = 0;
    int32_t before_q9 = 0; /* length up to the edge */
    int32_t length_q9 = edge_length_q9(cuts, contour, 0);
    for (int32_t k = 0; k < POINTS; k++) {
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
        int64_t x_q9 = p.x_q9 + ih_div_round((int64_t)(q.x_q9 - p.x_q9) * part_q9, divisor);
        int64_t y_q9 = p.y_q9 + ih_div_round((int64_t)(q.y_q9 - p.y_q9) * part_q9, divisor);
        out->x_q8[k] = (int32_t)ih_shift_round(x_q9, 1);
        out->y_q8[k] = (int32_t)ih_shift_round(y_q9, 1);
        IH_IN_RANGE(out->x_q8[k], 0, IH_RANGE_OFFSET_Q8);
        IH_IN_RANGE(out->y_q8[k], 0, IH_RANGE_OFFSET_Q8);
    }
    out->count = POINTS;
    for (int32_t k = 0; k < POINTS && out->closed; k++) {
        out->x_q8[out->count] = out->x_q8[k];
        out->y_q8[out->count++] = out->y_q8[k];
    }
}

/* Chords are below 2^14.1: a limit beyond 2^15 is none. */
static void limit_chords(const struct ih_ellipse_params *params, struct ih_parts *out)
{
    for (int32_t k = 0; k < POINTS; k++) {
        int64_t most_q8 = (int64_t)params->chord_max_q16 * out->arc_q8[k] >> 16;
        int32_t end_q8 = most_q8 < 1 << 15 ? (int32_t)most_q8 + 1 : 1 << 15;
        out->chord2_end_q16[k] = end_q8 * end_q8;
    }
}

/* Most that a part's spread may be, over its area's cube, both as in may_be_ellipse. The trace of its
 * second moments is its spread over 18 times the square of twice its area. */
static int64_t spread_limit_q16(const struct ih_ellipse_params *params)
{
    int64_t ratio_q16 = ih_max_s32(params->ratio_part_max_q16, 1 << 16); /* no ratio is less */
    int64_t both_q16 = ratio_q16 + ((int64_t)1 << 32) / ratio_q16 + 1;
    int64_t limit_q16 =
        ih_mul_shift(ih_mul_shift(both_q16, params->shape_max_q16, 16), CIRCLE_Q16, 16);
    return limit_q16 + limit_q16 / 64 + 1;
}

/* Sums over the edges of a part, relative to its first point. */
struct part_sums {
    int64_t area2_q16;
    int64_t x_q24, y_q24; /* 6 times the first moments */
    int64_t trace_q32;    /* 12 times the second ones, x and y together */
};

static void add_edge(struct part_sums *sums, int64_t px, int64_t py, int64_t qx, int64_t qy)
{
    const int64_t w = px * qy - qx * py;
    sums->area2_q16 += w;
    sums->x_q24 += w * (px + qx);
    sums->y_q24 += w * (py + qy);
    sums->trace_q32 += w * (px * (px + qx) + qx * qx + py * (py + qy) + qy * qy);
}

/* Is the trace small enough for the area, or is that for others to say? */
static bool may_be_ellipse(const struct part_sums *sums, int64_t limit_q16)
{
    const int64_t area2_q16 = sums->area2_q16;
    if (area2_q16 < AREA2_JUDGED_Q16 || limit_q16 > SPREAD_LIMIT_MAX_Q16) {
        return area2_q16 >= IH_PARTS_AREA2_MIN_Q16;
    }
    const int bits = ih_bits_u64((uint64_t)area2_q16);
    const int drop = bits - 15;
    const int64_t x = sums->x_q24 >> drop;
    const int64_t y = sums->y_q24 >> drop;
    const int64_t trace = sums->trace_q32 >> (2 * drop);
    if (ih_abs_s64(x) > FIRST_MAX || ih_abs_s64(y) > FIRST_MAX || trace < 0 ||
        trace > (int64_t)1 << (61 - bits)) {
        return true; /* it crosses itself */
    }
    /* Both products are below 2^62.7 and not negative. */
    const int64_t spread = 3 * area2_q16 * trace - 2 * (x * x + y * y);
    const int64_t square = area2_q16 * area2_q16 >> (2 * drop);
    return spread <= (square * limit_q16 >> 16) * area2_q16;
}

/* Bit k: the chord over k steps from a point is short enough. */
static uint64_t short_chords(const struct ih_parts *parts, int32_t from)
{
    const int32_t most = ih_min_s32(parts->count - 1 - from, POINTS - 1);
    uint64_t short_ones = 0;
    for (int32_t k = IH_PARTS_STEPS_MIN; k <= most; k++) {
        bool is_short = ih_parts_chord2_q16(parts, from, from + k) < parts->chord2_end_q16[k];
        short_ones |= (uint64_t)is_short << k;
    }
    return short_ones;
}

/* Of the parts from a point whose chords are short enough those that may be ellipses. */
static uint64_t sift(const struct ih_parts *parts, int32_t from, uint64_t short_ones,
                     int64_t limit_q16)
{
    const int32_t x0 = parts->x_q8[from], y0 = parts->y_q8[from];
    struct part_sums sums = {0};
    uint64_t may_be = 0;
    int64_t px = 0, py = 0;
    for (int32_t k = 1; short_ones >> k != 0; k++) {
        const int64_t qx = parts->x_q8[from + k] - x0, qy = parts->y_q8[from + k] - y0;
        add_edge(&sums, px, py, qx, qy);
        if ((short_ones >> k & 1) != 0 && may_be_ellipse(&sums, limit_q16)) {
            may_be |= (uint64_t)1 << k;
        }
        px = qx;
        py = qy;
    }
    return may_be;
}

bool ih_parts_make(const struct ih_cuts *cuts, const struct ih_contour *contour,
                   const struct ih_ellipse_params *params, struct ih_parts *out)
{
    if (contour->vertex_count > IH_PARTS_VERTICES_MAX ||
        contour->vertex_count < IH_PARTS_STEPS_MIN) {
        return false;
    }
    out->closed = contour->closed;
    resample(cuts, contour, out);
    limit_chords(params, out);
    const int64_t limit_q16 = spread_limit_q16(params);
    uint64_t any = 0;
    for (int32_t from = 0; from < POINTS; from++) {
        out->may_be[from] = sift(out, from, short_chords(out, from), limit_q16);
        any |= out->may_be[from];
    }
    out->has_parts = any != 0;
    return true;
}
