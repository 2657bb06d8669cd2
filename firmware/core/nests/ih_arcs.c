#include "nests/ih_arcs.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"

/* Products of pairs of 16 bits, and comparisons that end in bits: compilers do not find them by themselves. */
#if defined __x86_64__ && defined __SSE2__
#include <immintrin.h>
#elif defined __ARM_FEATURE_SIMD32
#include <arm_acle.h>
#endif

/* What fans sum up fits its bits up to here, with 1 % to spare: docs/numerics.md. */
_Static_assert(IH_ARCS_POINTS_MAX <= 56, "second moments of fans need more bits");
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
#define AREA2_NONE_Q16 (IH_ARCS_AREA2_MIN_Q16 - 1)
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
        .point_count = 32,
        .shape_max_q16 = 68485,         /* 1.045 */
        .ratio_closed_max_q16 = 124518, /* 1.9 */
        .ratio_part_max_q16 = 114688,   /* 1.75 */
        .chord_max_q16 = 27525,         /* 0.42 */
    };
}

struct ih_box ih_arcs_box(const struct ih_contours *cuts, const struct ih_contour *contour)
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
    const int32_t dx = q.x_q9 - p.x_q9;
    const int32_t dy = q.y_q9 - p.y_q9;
    return (int32_t)ih_isqrt_u32(
        (uint32_t)(dx * dx + dy * dy)); /* at most 2 (46 * 512)^2 = 2^30.1 */
}

/* Lengths of all edges, and of the contour. A closed one has an edge back to its first vertex. */
static int32_t measure_edges(const struct ih_vertex *vertex, int32_t vertex_count,
                             struct ih_arcs *out)
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
static int32_t length_of_steps(int32_t total, int32_t steps, const struct ih_arcs *parts)
{
    return total * steps / (parts->closed ? parts->point_count : parts->point_count - 1);
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
static void resample(const struct ih_contours *cuts, const struct ih_contour *contour,
                     struct ih_arcs *out)
{
    const struct ih_vertex *vertex = &cuts->vertex[contour->first];
    const int32_t edges = contour->closed ? contour->vertex_count : contour->vertex_count - 1;
    const int32_t total_q9 = measure_edges(vertex, contour->vertex_count, out);
    int32_t edge = 0;
    int32_t before_q9 = 0; /* length up to the edge */
    for (int32_t k = 0; k < out->point_count; k++) {
        const int32_t target_q9 = length_of_steps(total_q9, k, out);
        out->arc_q8[k] = length_of_steps(total_q9 / 2, k, out);
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
    out->count = out->point_count;
    for (int32_t k = 0; k < out->point_count && out->closed; k++) {
        out->x_q8[out->count] = out->x_q8[k];
        out->y_q8[out->count++] = out->y_q8[k];
    }
}

/* Chords of parts must be shorter. They are below 2^14.1: a limit beyond 2^15 is none. */
static void limit_chords(const struct ih_ellipse_params *params, struct ih_arcs *out)
{
    for (int32_t k = IH_ARCS_STEPS_MIN; k < out->point_count; k++) {
        const int64_t max_q8 = (int64_t)params->chord_max_q16 * out->arc_q8[k] >> 16;
        const int32_t end_q8 = max_q8 < 1 << 15 ? (int32_t)max_q8 + 1 : 1 << 15;
        out->chord2_end_q16[k] = end_q8 * end_q8;
    }
}

/* What a part's sums must keep to be an ellipse's. */
struct limits {
    int32_t half_q8;                        /* of the outline's greater side */
    int shift;                              /* of first moments; second ones twice that */
    int64_t area2_max_q16;                  /* beyond it none is judged */
    int32_t error;                          /* of a spread, over the area; more by the moments' */
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
        out->area2_max_q16 = 0; /* none is judged, and what follows might overflow */
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
static void measure_extent(const struct ih_ellipse_params *params, struct ih_arcs *parts,
                           struct limits *out)
{
    int32_t left = parts->x_q8[0], right = left, top = parts->y_q8[0], bottom = top;
    for (int32_t k = 0; k < parts->point_count; k++) {
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
    out->half_q8 = half_q8;
    out->shift = ih_max_s32(0, 3 * bits - 24);
    out->area2_max_q16 = (int64_t)1 << (2 * bits + AREA2_BITS);
    out->error = (CENTRE_ERROR >> out->shift) + 7;
    limit_shapes(params, out);
}

/* Fans, see the header: units of a step; chords longer than that much of the arc are not judged; an outline of
 * which half the greater side is less than 1 / FAN_CURLS of its length is curled so much that rounding may
 * count. */
#define FAN_STEP 24
#define FAN_CHORD_MAX_Q16 (1 << 15)
#define FAN_CURLS 10
#define FAN_PLACE_MAX 1024
#define FAN_PLACE_OUT 16384
/* What is allowed for rounding: of twice an area, for each step; of the limit of the spread; of a chord. */
#define FAN_ERROR 4
#define FAN_SHARE 128
#define FAN_CHORD_ERROR 4
/* Second moments are summed without these bits. */
#define FAN_TRACE_BITS 9

/* For parts of less steps than end: what a fan's sums are shifted by to have 15 bits, second moments three times.
 * Twice that of x and y is one less than the others and FAN_TRACE_BITS together, so that both sides of the
 * comparison have the same unit. */
struct octave {
    int32_t end;
    int area2, xy, trace;
};
static const struct octave octaves[] = {
    {14, 1, 9, 9}, {28, 3, 12, 13}, {IH_ARCS_POINTS_MAX, 5, 15, 17}};
#define OCTAVES ((int)(sizeof octaves / sizeof octaves[0]))

/* Two numbers in the halves of a word, the first one lower. */
static inline uint32_t pair_of(int32_t first, int32_t second)
{
    return (IH_WRAPS(uint32_t, first) & 0xffff) | (IH_WRAPS(uint32_t, second) & 0xffff) << 16;
}

/* The places of the points, and what their cross product takes. Behind the last one no chord is short. */
static void scale_points(struct ih_arcs *parts)
{
    const int32_t steps = parts->point_count - 1;
    const int32_t scale_q16 = FAN_STEP * steps * 65536 / ih_max_s32(parts->arc_q8[steps], 1);
    for (int32_t k = 0; k < parts->count; k++) {
        const int32_t x = (parts->dx_q8[k] * scale_q16 + 32768) >> 16;
        const int32_t y = (parts->dy_q8[k] * scale_q16 + 32768) >> 16;
        IH_IN_RANGE(x, -FAN_PLACE_MAX, FAN_PLACE_MAX);
        IH_IN_RANGE(y, -FAN_PLACE_MAX, FAN_PLACE_MAX);
        parts->fan[k] = pair_of(x, y);
        parts->turned[k] = pair_of(-y, x);
    }
    const int32_t end = ih_min_s32(parts->count + parts->point_count, IH_ARCS_FAN);
    for (int32_t k = parts->count; k < end; k++) {
        parts->fan[k] = pair_of(FAN_PLACE_OUT, FAN_PLACE_OUT);
        parts->turned[k] = 0;
    }
}

/* Chords that fans of k steps must keep below. Returns half of what a spread may be over the area's cube; 0 when
 * the outline is not judged by fans. */
static int32_t limit_fans(const struct ih_ellipse_params *params, const struct limits *limits,
                          int32_t vertex_count, struct ih_arcs *out)
{
    const int32_t arc_q8 = out->arc_q8[out->point_count - 1];
    if (limits->area2_max_q16 == 0 || params->chord_max_q16 > FAN_CHORD_MAX_Q16 ||
        limits->half_q8 * FAN_CURLS < arc_q8 ||
        arc_q8 < 2 * vertex_count) { /* edges of a few units, whose lengths are cut off */
        return 0;
    }
    const int64_t cube_q15 = limits->spread_q16 / 4 + limits->spread_q16 / (4 * FAN_SHARE);
    const int32_t chord_q16 = ih_max_s32(params->chord_max_q16, 0);
    for (int32_t k = IH_ARCS_STEPS_MIN; k < out->point_count; k++) {
        const int32_t chord = (chord_q16 * FAN_STEP >> 8) * k / 256 + FAN_CHORD_ERROR;
        out->chord2_end[k] = chord * chord;
    }
    return cube_q15 <= INT16_MAX ? (int32_t)cube_q15 : 0;
}

/* What rounded places may do to twice an area of k steps, as it is shifted. */
static inline int32_t area_error(const struct octave *o, int32_t k)
{
    return (FAN_ERROR * k >> o->area2) + 1;
}

#if defined __AVX2__
#define FAN_LANES 8
typedef __m256i lanes;
#define OP(name) _mm256_##name
#define BITS(name) _mm256_##name##_si256
#elif defined __x86_64__ && defined __SSE2__
#define FAN_LANES 4
typedef __m128i lanes;
#define OP(name) _mm_##name
#define BITS(name) _mm_##name##_si128
#endif

#ifdef FAN_LANES
/* Fans from points side by side: their last points, their sums. */
struct fans {
    lanes place, turned, square;
    lanes area2, sum_x, sum_y, trace;
};

static inline lanes load(const uint32_t *at)
{
    return BITS(loadu)((const lanes *)(const void *)at);
}

static inline void extend_fans(struct fans *f, lanes place, lanes turned, lanes square)
{
    const lanes w = OP(madd_epi16)(f->turned, place);
    const lanes both =
        OP(add_epi32)(OP(add_epi32)(f->square, square), OP(madd_epi16)(f->place, place));
    const lanes sum = OP(add_epi16)(f->place, place);
    const lanes sum_x = BITS(and)(sum, OP(set1_epi32)(0xffff));
    const lanes sum_y = OP(srli_epi32)(sum, 16);
    f->area2 = OP(add_epi32)(f->area2, w);
    f->sum_x = OP(add_epi32)(f->sum_x, OP(madd_epi16)(w, sum_x));
    f->sum_y = OP(add_epi32)(f->sum_y, OP(madd_epi16)(w, sum_y));
    f->trace = OP(add_epi32)(f->trace, OP(madd_epi16)(w, OP(srli_epi32)(both, FAN_TRACE_BITS)));
    f->place = place;
    f->turned = turned;
    f->square = square;
}

/* Which have no area, or are too spread for it: 3 a trace > x^2 + y^2 + c a^3, in the units of the octave. */
static inline lanes are_spread(const struct fans *f, const struct octave *o, int32_t k,
                               int32_t cube_q15)
{
    const lanes area2 = OP(srai_epi32)(f->area2, o->area2);
    const lanes trace = OP(srai_epi32)(f->trace, o->trace);
    const lanes x = BITS(and)(OP(srai_epi32)(f->sum_x, o->xy), OP(set1_epi32)(0xffff));
    const lanes y = OP(slli_epi32)(OP(srai_epi32)(f->sum_y, o->xy), 16);
    const lanes xy = BITS(or)(x, y);
    const lanes error = OP(set1_epi32)(area_error(o, k));
    const lanes min = OP(sub_epi16)(area2, error);
    const lanes max = OP(add_epi16)(area2, error);
    const lanes left = OP(madd_epi16)(OP(add_epi32)(OP(add_epi32)(trace, trace), trace), min);
    const lanes square = OP(srli_epi32)(OP(madd_epi16)(max, max), 15);
    const lanes share = OP(srli_epi32)(OP(madd_epi16)(max, OP(set1_epi32)(cube_q15)), 15);
    const lanes right = OP(add_epi32)(OP(madd_epi16)(xy, xy), OP(madd_epi16)(square, share));
    return BITS(or)(OP(cmpgt_epi32)(left, right), OP(cmpgt_epi32)(OP(set1_epi32)(1), f->area2));
}

static void find_fans(struct ih_arcs *parts, int32_t from, int32_t end, int32_t cube_q15)
{
    const lanes start = load(&parts->fan[from]);
    const lanes start_turned = load(&parts->turned[from]);
    const lanes none = BITS(setzero)();
    lanes low = none, high = none;
    struct fans f = {none, none, none, none, none, none, none};
    int32_t k = 1;
    for (; k < IH_ARCS_STEPS_MIN; k++) {
        const lanes place = OP(sub_epi16)(start, load(&parts->fan[from + k]));
        const lanes turned = OP(sub_epi16)(start_turned, load(&parts->turned[from + k]));
        extend_fans(&f, place, turned, OP(madd_epi16)(place, place));
    }
    for (int i = 0; i < OCTAVES; i++) {
        for (; k < octaves[i].end && k < end; k++) {
            const lanes place = OP(sub_epi16)(start, load(&parts->fan[from + k]));
            const lanes turned = OP(sub_epi16)(start_turned, load(&parts->turned[from + k]));
            const lanes square = OP(madd_epi16)(place, place);
            extend_fans(&f, place, turned, square);
            const lanes is_short = OP(cmpgt_epi32)(OP(set1_epi32)(parts->chord2_end[k]), square);
            if (OP(movemask_epi8)(is_short) == 0) {
                continue;
            }
            const lanes bits = BITS(andnot)(
                are_spread(&f, &octaves[i], k, cube_q15),
                BITS(and)(is_short, OP(set1_epi32)(IH_WRAPS(int32_t, (uint32_t)1 << (k & 31)))));
            if (k < 32) {
                low = BITS(or)(low, bits);
            } else {
                high = BITS(or)(high, bits);
            }
        }
    }
    BITS(storeu)((lanes *)(void *)&parts->low[from], low);
    BITS(storeu)((lanes *)(void *)&parts->high[from], high);
}
#else
#define FAN_LANES 1

struct fan {
    uint32_t place;                      /* its last point, from the first one: a pair */
    uint32_t area2, sum_x, sum_y, trace; /* modulo 2^32: more than that is no short part's */
};

/* The lower half, as products of vectors take it. */
static inline int32_t lower_half(uint32_t value)
{
    return IH_WRAPS(int16_t, value);
}

#ifdef __ARM_FEATURE_SIMD32
static inline uint32_t sum_of(uint32_t a, uint32_t b)
{
    return (uint32_t)__sadd16((int16x2_t)a, (int16x2_t)b);
}

static inline uint32_t difference_of(uint32_t a, uint32_t b)
{
    return (uint32_t)__ssub16((int16x2_t)a, (int16x2_t)b);
}

static inline int32_t product_of(uint32_t a, uint32_t b)
{
    return __smuad((int16x2_t)a, (int16x2_t)b);
}

static inline int32_t cross_product_of(uint32_t a, uint32_t b)
{
    return __smusdx((int16x2_t)a, (int16x2_t)b);
}
#else
static inline int32_t upper_half(uint32_t value)
{
    return lower_half(value >> 16);
}

static inline uint32_t sum_of(uint32_t a, uint32_t b)
{
    return pair_of(lower_half(a) + lower_half(b), upper_half(a) + upper_half(b));
}

static inline uint32_t difference_of(uint32_t a, uint32_t b)
{
    return pair_of(lower_half(a) - lower_half(b), upper_half(a) - upper_half(b));
}

static inline int32_t product_of(uint32_t a, uint32_t b)
{
    return lower_half(a) * lower_half(b) + upper_half(a) * upper_half(b);
}

static inline int32_t cross_product_of(uint32_t a, uint32_t b)
{
    return lower_half(a) * upper_half(b) - upper_half(a) * lower_half(b);
}
#endif

IH_WRAPPING static inline void extend_fan(struct fan *f, uint32_t place)
{
    const uint32_t sum = sum_of(f->place, place);
    const int32_t both = product_of(sum, sum) - product_of(f->place, place);
    const int32_t area2 = cross_product_of(f->place, place);
    const int32_t w = lower_half(IH_WRAPS(uint32_t, area2));
    f->area2 += IH_WRAPS(uint32_t, area2);
    f->sum_x += IH_WRAPS(uint32_t, w * lower_half(sum));
    f->sum_y += IH_WRAPS(uint32_t, w * lower_half(sum >> 16));
    f->trace += IH_WRAPS(uint32_t, w * lower_half((uint32_t)both >> FAN_TRACE_BITS));
    f->place = place;
}

IH_WRAPPING static inline bool is_spread(const struct fan *f, const struct octave *o, int32_t k,
                                         int32_t cube_q15)
{
    const int32_t area2 = IH_WRAPS(int32_t, f->area2);
    const uint32_t part = IH_WRAPS(uint32_t, area2 >> o->area2);
    const uint32_t error = (uint32_t)area_error(o, k);
    const int32_t trace =
        lower_half(3 * IH_WRAPS(uint32_t, IH_WRAPS(int32_t, f->trace) >> o->trace));
    const int32_t x = lower_half(IH_WRAPS(uint32_t, IH_WRAPS(int32_t, f->sum_x) >> o->xy));
    const int32_t y = lower_half(IH_WRAPS(uint32_t, IH_WRAPS(int32_t, f->sum_y) >> o->xy));
    const int32_t min = lower_half(part - error);
    const int32_t max = lower_half(part + error);
    const int32_t square = lower_half((uint32_t)(max * max) >> 15);
    const int32_t share = lower_half(IH_WRAPS(uint32_t, max * cube_q15) >> 15);
    const uint32_t right =
        (uint32_t)(x * x) + (uint32_t)(y * y) + IH_WRAPS(uint32_t, square * share);
    return area2 <= 0 || trace * min > IH_WRAPS(int32_t, right);
}

static void find_fans(struct ih_arcs *parts, int32_t from, int32_t end, int32_t cube_q15)
{
    const uint32_t *place = &parts->fan[from];
    const int32_t *chord2_end = parts->chord2_end;
    struct fan f = {0, 0, 0, 0, 0};
    uint32_t half[2] = {0, 0};
    int32_t k = 1;
    for (; k < IH_ARCS_STEPS_MIN && k < end; k++) {
        extend_fan(&f, difference_of(place[0], place[k]));
    }
    for (int i = 0; i < OCTAVES; i++) {
        const int32_t end_here = ih_min_s32(octaves[i].end, end);
        for (; k < end_here; k++) {
            extend_fan(&f, difference_of(place[0], place[k]));
            if (product_of(f.place, f.place) < chord2_end[k] &&
                !is_spread(&f, &octaves[i], k, cube_q15)) {
                half[k >> 5] |= (uint32_t)1 << (k & 31);
            }
        }
    }
    parts->low[from] = half[0];
    parts->high[from] = half[1];
}
#endif

/* Bit k of each point: the part over k steps is worth a closer look; all parts where fans are not judged. */
static void find_promising(const struct ih_ellipse_params *params, const struct limits *limits,
                           int32_t vertex_count, struct ih_arcs *out)
{
    const int32_t cube_q15 = limit_fans(params, limits, vertex_count, out);
    if (cube_q15 > 0) {
        scale_points(out);
        for (int32_t from = 0; from < out->point_count; from += FAN_LANES) {
            find_fans(out, from, ih_min_s32(out->count - from, out->point_count), cube_q15);
        }
        return;
    }
    for (int32_t from = 0; from < out->point_count; from++) {
        const int32_t end = ih_min_s32(out->count - from, out->point_count);
        const uint64_t all = (((uint64_t)1 << end) - 1) >> IH_ARCS_STEPS_MIN << IH_ARCS_STEPS_MIN;
        out->low[from] = (uint32_t)(all & UINT32_MAX);
        out->high[from] = (uint32_t)(all >> 32);
    }
}

/* Sums over the edges, of a closed outline twice round. When it is too tangled none is judged. */
IH_WRAPPING static void sum_edges(struct ih_arcs *parts, struct limits *limits)
{
    struct ih_arcs_sums *s = &parts->sums;
    uint32_t area2 = 0;
    int64_t x = 0, y = 0, trace = 0, xx = 0, xy = 0, tangle = 0;
    const int32_t points = parts->point_count;
    const int32_t edges = parts->closed ? points : points - 1;
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
    for (int32_t k = points + 1; k < parts->count; k++) {
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

/* A part, as it is looked at. Sums are shifted as limits.shift says. */
struct look {
    int32_t px, py, qx, qy, chord_q16; /* its end and beginning; their cross product */
    int32_t area2_q16;                 /* twice */
    int32_t x, y;
    int32_t error;      /* what is rounded of a spread, over the area */
    int64_t area4;      /* its square, shifted once */
    int64_t spread;     /* the trace of the second moments, times 18 area2^2 */
    int64_t spread_max; /* what is rounded with it */
};

static inline int64_t times(int32_t a, int32_t b)
{
    return (int64_t)a * b;
}

/* Its area. */
IH_WRAPPING static struct look look_at_area(const struct ih_arcs *parts, int32_t from, int32_t to)
{
    const uint32_t *sum = parts->sums.area2_q16;
    struct look look = {.px = parts->dx_q8[to],
                        .py = parts->dy_q8[to],
                        .qx = parts->dx_q8[from],
                        .qy = parts->dy_q8[from]};
    look.chord_q16 = look.px * look.qy - look.qx * look.py;
    look.area2_q16 = IH_WRAPS(int32_t, sum[to] - sum[from] + IH_WRAPS(uint32_t, look.chord_q16));
    return look;
}

/* Its centre and spread. */
static void look_at_spread(const struct ih_arcs *parts, const struct limits *limits, int32_t from,
                           int32_t to, struct look *look)
{
    const struct ih_arcs_sums *s = &parts->sums;
    const int shift = limits->shift;
    const int32_t w = look->chord_q16, area2 = look->area2_q16;
    const int32_t both_q16 =
        parts->square_q16[to] + parts->square_q16[from] + look->px * look->qx + look->py * look->qy;
    const int64_t x_q24 = s->x_q24[to] - s->x_q24[from] + times(w, look->px + look->qx);
    const int64_t y_q24 = s->y_q24[to] - s->y_q24[from] + times(w, look->py + look->qy);
    const int64_t trace_q32 = s->trace_q32[to] - s->trace_q32[from] + times(w, both_q16);
    look->x = (int32_t)(x_q24 >> shift);
    look->y = (int32_t)(y_q24 >> shift);
    look->area4 = times(area2, area2) >> shift;
    look->error = limits->error + (int32_t)(times(area2, MOMENT_ERROR) >> (2 * shift));
    look->spread = 3 * area2 * (trace_q32 >> (2 * shift)) -
                   2 * (times(look->x, look->x) + times(look->y, look->y));
    look->spread_max = ((look->area4 * limits->spread_q16 >> (16 + shift)) + look->error) * area2;
}

/* What is known of the determinant and of the area's cube squared, where both may be multiplied. */
struct roundness {
    int64_t determinant_min, determinant_max;
    int64_t trace2, cube2;
};

/* False: no ellipse. */
static bool look_at_shape(const struct ih_arcs *parts, const struct limits *limits, int32_t from,
                          int32_t to, const struct look *look, struct roundness *out)
{
    const struct ih_arcs_sums *s = &parts->sums;
    const int32_t px = look->px, py = look->py, qx = look->qx, qy = look->qy;
    const int32_t w = look->chord_q16, area2 = look->area2_q16, shift = limits->shift;
    const int64_t xx_q32 = s->xx_q32[to] - s->xx_q32[from] + times(w, px * (px + qx) + qx * qx);
    const int64_t xy_q32 =
        s->xy_q32[to] - s->xy_q32[from] + times(w, 2 * (px * py + qx * qy) + px * qy + qx * py);
    const int64_t xx = 3 * area2 * (xx_q32 >> (2 * shift)) - 2 * times(look->x, look->x);
    const int64_t xy = 3 * area2 * (xy_q32 >> (2 * shift + 1)) - 2 * times(look->x, look->y);
    const int64_t yy = look->spread - xx;
    const int64_t max = look->spread_max;
    const int64_t error =
        4 * ((int64_t)ih_abs_s32(look->x) + ih_abs_s32(look->y)) + 8 + times(area2, look->error);
    if (xx < -error || yy < -error || ih_abs_s64(xy) > max + error) {
        return false;
    }
    const int drop = ih_max_s32(0, ih_bits_u64((uint64_t)max) - 29);
    const int32_t p = (int32_t)(xx >> drop);
    const int32_t q = (int32_t)(yy >> drop);
    const int32_t m = (int32_t)(xy >> drop);
    const int32_t near = (int32_t)(error >> drop) + 2;
    const int first = ih_min_s32(shift, 10); /* then the product is below 2^62 */
    const int32_t cube = (int32_t)((look->area4 >> first) * area2 >> (shift - first + drop));
    const int64_t slack = 4 * times(near, (int32_t)(max >> drop) + near + 1);
    const int64_t determinant = times(p, q) - times(m, m);
    out->determinant_min = determinant - slack;
    out->determinant_max = determinant + slack;
    out->trace2 = times(p + q, p + q);
    out->cube2 = times(cube, cube);
    return true;
}

/* The least shape that the part may have; 0 when it is no ellipse. */
static int32_t min_shape_q16(const struct ih_arcs *parts, const struct limits *limits, int32_t from,
                             int32_t to, const struct look *look)
{
    struct roundness r;
    if (!look_at_shape(parts, limits, from, to, look, &r) ||
        r.determinant_max < (r.cube2 >> 20) * limits->shape2_min_q20 ||
        r.determinant_min > ((r.cube2 >> 20) + 1) * limits->shape2_max_q20 ||
        r.trace2 >> 4 > ((r.determinant_max >> 20) + 1) * limits->both2_q16) {
        return 0;
    }
    const int64_t above =
        (r.determinant_min >> 20) * ELLIPSE_INVERSE_Q20 - r.cube2; /* squared, less 1 */
    if (above <= 0) {
        return IH_ARCS_SHAPE_MIN_Q16;
    }
    /* sqrt(1 + u) >= 1 + u / 2 - u^2 / 8 */
    const int64_t u_q16 = ih_min_s32(ih_saturate_s32(above / ((r.cube2 >> 16) + 1)), 1 << 16);
    return (int32_t)(65536 + u_q16 / 2 - (u_q16 * u_q16 >> 19) - SHAPE_ROUNDED_Q16 -
                     ROOT_ROUNDED_Q32 / look->area2_q16);
}

int32_t ih_arcs_merit_q8(int32_t arc_q8, int32_t chord_q8, int32_t shape_q16)
{
    int64_t shape_cost_q8 = ih_mul_shift((int64_t)SHAPE_COST * (shape_q16 - 65536), arc_q8, 16);
    return ih_saturate_s32(arc_q8 - ih_mul_shift(CHORD_COST_Q8, chord_q8, 8) - shape_cost_q8);
}

static void add_part(struct ih_arcs *parts, int32_t from, int32_t steps, int32_t shape_q16)
{
    const uint32_t chord2_q16 = (uint32_t)ih_arcs_chord2_q16(parts, from, from + steps);
    const int32_t chord_q8 = (int32_t)ih_isqrt_u32(chord2_q16);
    parts->part[parts->part_count++] = (struct ih_arc){
        .merit_max_q8 = ih_arcs_merit_q8(parts->arc_q8[steps], chord_q8, shape_q16),
        .from = (uint8_t)from,
        .steps = (uint8_t)steps,
    };
}

/* The part's least shape; 0 when it is no ellipse. */
static int32_t sift_part(const struct ih_arcs *parts, int32_t from, int32_t k,
                         const struct limits *limits)
{
    const int32_t to = from + k;
    struct look look = look_at_area(parts, from, to);
    if (look.area2_q16 <= AREA2_NONE_Q16) {
        return 0;
    }
    if (look.area2_q16 > limits->area2_max_q16) {
        return IH_ARCS_SHAPE_MIN_Q16;
    }
    look_at_spread(parts, limits, from, to, &look);
    if (look.spread > look.spread_max) {
        return 0;
    }
    return min_shape_q16(parts, limits, from, to, &look);
}

/* Of the promising parts from a point those that may be ellipses. */
static void sift(struct ih_arcs *parts, int32_t from, const struct limits *limits)
{
    for (int32_t half = 0; half < 2; half++) {
        uint32_t left = half == 0 ? parts->low[from] : parts->high[from];
        for (; left != 0; left &= left - 1) {
            const int32_t k = 32 * half + __builtin_ctz(left);
            if (ih_arcs_chord2_q16(parts, from, from + k) >= parts->chord2_end_q16[k]) {
                continue;
            }
            const int32_t shape_q16 = sift_part(parts, from, k, limits);
            if (shape_q16 != 0) {
                add_part(parts, from, k, shape_q16);
            }
        }
    }
}

bool ih_arcs_make(const struct ih_contours *cuts, const struct ih_contour *contour,
                  const struct ih_ellipse_params *params, struct ih_arcs *out)
{
    if (contour->vertex_count > IH_ARCS_VERTICES_MAX || contour->vertex_count < IH_ARCS_STEPS_MIN) {
        return false;
    }
    struct limits limits = {0};
    out->closed = contour->closed;
    out->point_count =
        ih_clamp_s32(params->point_count, IH_ARCS_POINTS_MIN, IH_ARCS_POINTS_MAX) & ~7;
    out->part_count = 0;
    resample(cuts, contour, out);
    limit_chords(params, out);
    measure_extent(params, out, &limits);
    find_promising(params, &limits, contour->vertex_count, out);
    sum_edges(out, &limits);
    for (int32_t from = 0; from < out->point_count; from++) {
        sift(out, from, &limits);
    }
    return true;
}
