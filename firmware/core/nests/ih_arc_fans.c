#include "nests/ih_arc_fans.h"

#include "base/ih_fix.h"
#include "base/ih_range.h"
#include "simd/ih_pair.h"
#include "simd/ih_simd.h"

/* The sums fit 32 bits up to this many points, with 1 % to spare: docs/numerics.md. */
_Static_assert(IH_ARCS_POINTS_MAX <= 56, "second moments of fans need more bits");

/* Units of a step. */
#define FAN_STEP 24
/* Fans do not judge when a chord may be a larger fraction of its arc. */
#define FAN_CHORD_MAX_Q16 (1 << 15)
/* Nor an outline that is longer than this many times half its longer side: so curled, rounding matters. */
#define FAN_CURLS 10
#define FAN_COORDINATE_MAX 1024
#define FAN_COORDINATE_FAR 16384
/* Margins for rounding: of twice an area, for each step; of the limit of the spread, a fraction; of a chord. */
#define FAN_AREA_ERROR 4
#define FAN_SPREAD_ERROR 128
#define FAN_CHORD_ERROR 4
/* Second moments are summed without their lowest bits. */
#define FAN_TRACE_BITS 9

/* For arcs of fewer steps than end: the shifts that bring a fan's sums to 15 bits, three times the second moments.
 * Twice the shift of x and y is one less than the two others and FAN_TRACE_BITS together, so that both sides
 * of the comparison have the same unit. */
struct octave {
    int32_t end;
    int area2, xy, trace;
};
static const struct octave octaves[] = {
    {14, 1, 9, 9}, {28, 3, 12, 13}, {IH_ARCS_POINTS_MAX, 5, 15, 17}};
#define OCTAVES ((int)(sizeof octaves / sizeof octaves[0]))

/* Coordinates of the points as pairs. Points after the last one are far away: no chord to them is short. */
static void scale_points(struct ih_arcs *arcs)
{
    const int32_t steps = arcs->point_count - 1;
    const int32_t scale_q16 = FAN_STEP * steps * 65536 / ih_max_s32(arcs->length_q8[steps], 1);
    for (int32_t k = 0; k < arcs->count; k++) {
        const int32_t x = (arcs->dx_q8[k] * scale_q16 + 32768) >> 16;
        const int32_t y = (arcs->dy_q8[k] * scale_q16 + 32768) >> 16;
        IH_IN_RANGE(x, -FAN_COORDINATE_MAX, FAN_COORDINATE_MAX);
        IH_IN_RANGE(y, -FAN_COORDINATE_MAX, FAN_COORDINATE_MAX);
        arcs->fan[k] = ih_pair_make(x, y);
        arcs->normal[k] = ih_pair_make(-y, x);
    }
    const int32_t end = ih_min_s32(arcs->count + arcs->point_count, IH_ARCS_FAN);
    for (int32_t k = arcs->count; k < end; k++) {
        arcs->fan[k] = ih_pair_make(FAN_COORDINATE_FAR, FAN_COORDINATE_FAR);
        arcs->normal[k] = 0;
    }
}

/* Chords that fans of k steps must keep below. Returns half the limit of a spread over the area's cube; 0 when
 * fans do not judge the outline. */
static int32_t limit_fans(const struct ih_arc_fans_limits *limits, struct ih_arcs *arcs)
{
    const int32_t length_q8 = arcs->length_q8[arcs->point_count - 1];
    if (limits->chord_max_q16 > FAN_CHORD_MAX_Q16 || limits->half_q8 * FAN_CURLS < length_q8 ||
        length_q8 <
            2 * limits->vertex_count) { /* edges of few units, whose lengths are truncated */
        return 0;
    }
    const int64_t cube_q15 = limits->spread_q16 / 4 + limits->spread_q16 / (4 * FAN_SPREAD_ERROR);
    const int32_t chord_q16 = ih_max_s32(limits->chord_max_q16, 0);
    for (int32_t k = IH_ARCS_STEPS_MIN; k < arcs->point_count; k++) {
        const int32_t chord = (chord_q16 * FAN_STEP >> 8) * k / 256 + FAN_CHORD_ERROR;
        arcs->chord2_end[k] = chord * chord;
    }
    return cube_q15 <= INT16_MAX ? (int32_t)cube_q15 : 0;
}

/* The error that rounded coordinates can make of twice an area of k steps, as it is shifted. */
static inline int32_t area_error(const struct octave *o, int32_t k)
{
    return (FAN_AREA_ERROR * k >> o->area2) + 1;
}

#if IH_I16_LANES > 0
#define FAN_LANES IH_I32_LANES

/* Fans from adjacent points: their last points, their sums. */
struct fans {
    ih_i16 point, normal;
    ih_i32 square;
    ih_i32 area2, sum_x, sum_y, trace;
};

static inline ih_i16 load_pairs(const uint32_t *from)
{
    return (ih_i16)ih_i32_load((const int32_t *)from);
}

static inline void extend_fans(struct fans *f, ih_i16 point, ih_i16 normal, ih_i32 square)
{
    const ih_i32 w = ih_i16_madd_pairs(f->normal, point);
    const ih_i32 both =
        ih_i32_add(ih_i32_add(f->square, square), ih_i16_madd_pairs(f->point, point));
    const ih_i32 sum = (ih_i32)ih_i16_add(f->point, point);
    const ih_i32 y = (ih_i32)ih_u32_shift_right((ih_u32)sum, 16);
    const ih_i32 trace = (ih_i32)ih_u32_shift_right((ih_u32)both, FAN_TRACE_BITS);
    f->area2 = ih_i32_add(f->area2, w);
    f->sum_x = ih_i32_add(f->sum_x, ih_i32_mul_low(w, sum & 0xffff));
    f->sum_y = ih_i32_add(f->sum_y, ih_i32_mul_low(w, y));
    f->trace = ih_i32_add(f->trace, ih_i32_mul_low(w, trace));
    f->point = point;
    f->normal = normal;
    f->square = square;
}

/* Fans without an area, or too spread for it: 3 a trace > x^2 + y^2 + c a^3, in the units of the octave. */
static inline ih_i32 are_spread(const struct fans *f, const struct octave *o, int32_t k,
                                int32_t cube_q15)
{
    const ih_i16 area2 = (ih_i16)ih_i32_shift_right(f->area2, o->area2);
    const ih_i32 trace = ih_i32_shift_right(f->trace, o->trace);
    const ih_i32 x = ih_i32_shift_right(f->sum_x, o->xy) & 0xffff;
    const ih_i32 y = ih_i32_shift_left(ih_i32_shift_right(f->sum_y, o->xy), 16);
    const ih_i16 error = (ih_i16)ih_i32_all(area_error(o, k));
    const ih_i32 min = (ih_i32)ih_i16_sub(area2, error);
    const ih_i32 max = (ih_i32)ih_i16_add(area2, error);
    const ih_i32 left = ih_i32_mul_low(ih_i32_add(ih_i32_add(trace, trace), trace), min);
    const ih_u32 square = ih_u32_shift_right((ih_u32)ih_i32_mul_low(max, max), 15);
    const ih_u32 cube = (ih_u32)ih_i32_mul_low(max, ih_i32_all(cube_q15));
    const ih_i32 fraction = (ih_i32)ih_u32_shift_right(cube, 15);
    const ih_i32 right = ih_i32_add(ih_i16_madd_pairs((ih_i16)(x | y), (ih_i16)(x | y)),
                                    ih_i32_mul_low((ih_i32)square, fraction));
    return (left > right) | (f->area2 < 1);
}

static void find_fans(struct ih_arcs *arcs, int32_t from, int32_t end, int32_t cube_q15)
{
    const ih_i16 start = load_pairs(&arcs->fan[from]);
    const ih_i16 start_normal = load_pairs(&arcs->normal[from]);
    struct fans f = {0};
    ih_i32 low = {0}, high = {0};
    int32_t k = 1;
    for (; k < IH_ARCS_STEPS_MIN; k++) {
        const ih_i16 point = ih_i16_sub(start, load_pairs(&arcs->fan[from + k]));
        const ih_i16 normal = ih_i16_sub(start_normal, load_pairs(&arcs->normal[from + k]));
        extend_fans(&f, point, normal, ih_i16_madd_pairs(point, point));
    }
    for (int i = 0; i < OCTAVES; i++) {
        for (; k < octaves[i].end && k < end; k++) {
            const ih_i16 point = ih_i16_sub(start, load_pairs(&arcs->fan[from + k]));
            const ih_i16 normal = ih_i16_sub(start_normal, load_pairs(&arcs->normal[from + k]));
            const ih_i32 square = ih_i16_madd_pairs(point, point);
            extend_fans(&f, point, normal, square);
            const ih_i32 is_short = square < arcs->chord2_end[k];
            if (!ih_i16_any((ih_i16)is_short)) {
                continue;
            }
            const ih_i32 bit = ih_i32_all(IH_WRAPS(int32_t, (uint32_t)1 << (k & 31)));
            const ih_i32 bits = ~are_spread(&f, &octaves[i], k, cube_q15) & is_short & bit;
            if (k < 32) {
                low |= bits;
            } else {
                high |= bits;
            }
        }
    }
    ih_i32_store((int32_t *)&arcs->low[from], low);
    ih_i32_store((int32_t *)&arcs->high[from], high);
}

#else
#define FAN_LANES 1

/* Sums wrap; those of arcs with short chords do not pass 2^31. */
struct fan {
    uint32_t point; /* the last one, relative to the first: a pair */
    uint32_t area2, sum_x, sum_y, trace;
};

IH_WRAPPING static inline void extend_fan(struct fan *f, uint32_t point)
{
    const uint32_t sum = ih_pair_add(f->point, point);
    const int32_t both = ih_pair_dot(sum, sum) - ih_pair_dot(f->point, point);
    const int32_t area2 = ih_pair_cross(f->point, point);
    const int32_t w = ih_pair_first(IH_WRAPS(uint32_t, area2));
    f->area2 += IH_WRAPS(uint32_t, area2);
    f->sum_x += IH_WRAPS(uint32_t, w * ih_pair_first(sum));
    f->sum_y += IH_WRAPS(uint32_t, w * ih_pair_second(sum));
    f->trace += IH_WRAPS(uint32_t, w * ih_pair_first((uint32_t)both >> FAN_TRACE_BITS));
    f->point = point;
}

IH_WRAPPING static inline bool is_spread(const struct fan *f, const struct octave *o, int32_t k,
                                         int32_t cube_q15)
{
    const int32_t area2 = IH_WRAPS(int32_t, f->area2);
    const uint32_t shifted = IH_WRAPS(uint32_t, area2 >> o->area2);
    const uint32_t error = (uint32_t)area_error(o, k);
    const int32_t trace =
        ih_pair_first(3 * IH_WRAPS(uint32_t, IH_WRAPS(int32_t, f->trace) >> o->trace));
    const int32_t x = ih_pair_first(IH_WRAPS(uint32_t, IH_WRAPS(int32_t, f->sum_x) >> o->xy));
    const int32_t y = ih_pair_first(IH_WRAPS(uint32_t, IH_WRAPS(int32_t, f->sum_y) >> o->xy));
    const int32_t min = ih_pair_first(shifted - error);
    const int32_t max = ih_pair_first(shifted + error);
    const int32_t square = ih_pair_first((uint32_t)(max * max) >> 15);
    const int32_t fraction = ih_pair_first(IH_WRAPS(uint32_t, max * cube_q15) >> 15);
    const uint32_t right =
        (uint32_t)(x * x) + (uint32_t)(y * y) + IH_WRAPS(uint32_t, square * fraction);
    return area2 <= 0 || trace * min > IH_WRAPS(int32_t, right);
}

static void find_fans(struct ih_arcs *arcs, int32_t from, int32_t end, int32_t cube_q15)
{
    const uint32_t *point = &arcs->fan[from];
    const int32_t *chord2_end = arcs->chord2_end;
    struct fan f = {0, 0, 0, 0, 0};
    uint32_t half[2] = {0, 0};
    int32_t k = 1;
    for (; k < IH_ARCS_STEPS_MIN && k < end; k++) {
        extend_fan(&f, ih_pair_sub(point[0], point[k]));
    }
    for (int i = 0; i < OCTAVES; i++) {
        const int32_t end_here = ih_min_s32(octaves[i].end, end);
        for (; k < end_here; k++) {
            extend_fan(&f, ih_pair_sub(point[0], point[k]));
            if (ih_pair_dot(f.point, f.point) < chord2_end[k] &&
                !is_spread(&f, &octaves[i], k, cube_q15)) {
                half[k >> 5] |= (uint32_t)1 << (k & 31);
            }
        }
    }
    arcs->low[from] = half[0];
    arcs->high[from] = half[1];
}
#endif

bool ih_arc_fans_find(const struct ih_arc_fans_limits *limits, struct ih_arcs *arcs)
{
    const int32_t cube_q15 = limit_fans(limits, arcs);
    if (cube_q15 <= 0) {
        return false;
    }
    scale_points(arcs);
    for (int32_t from = 0; from < arcs->point_count; from += FAN_LANES) {
        find_fans(arcs, from, ih_min_s32(arcs->count - from, arcs->point_count), cube_q15);
    }
    return true;
}
