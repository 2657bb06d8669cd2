#include "detect/ih_ray_counts.h"

#include <string.h>

#include "base/ih_fix.h"
#include "simd/ih_lane16.h"

#define DEPTH_MIN_MM 227
#define DEPTH_MAX_MM 16300
#define SEMI_MIN_MM 42
#define SEMI_MAX_MM 200
/* Offsets are cut at this: 510 mm in Q4, 3.99 semi-axes in Q11. */
#define CUT 8171
#define CUT2_Q10 16000 /* below 3.99^2 */
#define MM(mm) ((mm)*16)
#define RING_INNER2_Q10 1600 /* 1.25^2 */
#define RING_OUTER2_Q10 3697 /* 1.9^2 = 3696.6 */
#define AROUND2_Q10 6400     /* 2.5^2 */
#define BELOW_Q15 29491      /* 0.9 */
#define ABOVE_Q15 26214      /* 0.8 */

void ih_ray_counts_prepare(const struct ih_rays *space, struct ih_ray_counts_scratch *out)
{
    memset(out, 0, sizeof *out);
    ih_rays_slope_max(space, out->slope_max_q20);
    out->is_usable =
        IH_LANE_COUNT > 1 && out->slope_max_q20[0] < 1 << 20 && out->slope_max_q20[1] < 1 << 20;
    for (int32_t slot = 0; out->is_usable && slot < IH_SLOTS; slot++) {
        const struct ih_ray *ray = &space->ray[slot];
        const int32_t depth_q1 = ih_clamp_s32(ray->point_mm_q8[2] >> 7, INT16_MIN, INT16_MAX);
        out->slope_q14[0][slot] = (int16_t)(ray->slope_x_q20 >> 6);
        out->slope_q14[1][slot] = (int16_t)(ray->slope_y_q20 >> 6);
        out->depth_mm_q1[slot] = (int16_t)depth_q1;
        out->seen[slot] = ray->state == IH_RAY_SEEN ? -1 : 0;
        out->empty[slot] = ray->state == IH_RAY_EMPTY ? -1 : 0;
    }
}

/* Every ray of which something is known. */
static void leave_all(const struct ih_rays *space, struct ih_ray_counts_scratch *scratch)
{
    for (int32_t slot = 0; slot < IH_SLOTS; slot++) {
        const bool is_known = space->ray[slot].state != IH_RAY_UNKNOWN;
        scratch->flag[slot] = is_known ? IH_RAY_COUNTS_UNSURE | IH_RAY_COUNTS_HIT : 0;
    }
}

#if IH_LANE_COUNT > 1

/* A slope difference to an offset: differences are cut, times a power of two, times a share of 2^16. */
struct scale {
    int16_t cut, times, share;
};

/* A candidate, as the loop needs it: limits in mm Q4, depths in mm Q1, else as their names say. */
struct frame {
    int16_t direction_q14[2];
    int16_t reach_q14[2]; /* farther away nothing is looked at */
    struct scale mm[2], semi[2];
    int16_t margin;
    int16_t high_y, high_x, chin_y, body_y, wide_y, semi_y, shoulder_y, shoulder_max_y;
    int16_t hit_q10;
    int16_t open, body_min, body_max, level_min, level_max, before;
};

/* Times depth / 2^14, in steps of which one is `length_q8` / 2^bits. */
static struct scale scale_of(int32_t depth_q8, int32_t length_q8, int bits)
{
    const int64_t all = ((int64_t)depth_q8 << (bits + 2)) / length_q8; /* below 2^27 */
    const int shift = ih_max_s32(ih_bits_u64((uint64_t)all) - 15, 0);
    const int64_t share = all > 0 ? all >> shift : 1;
    return (struct scale){
        .cut = (int16_t)ih_min_s64(((int64_t)CUT << 16) / (share << shift), INT16_MAX),
        .times = (int16_t)(1 << shift),
        .share = (int16_t)share,
    };
}

static int16_t limit_s16(int64_t value)
{
    return (int16_t)ih_clamp_s64(value, INT16_MAX);
}

/* Is what is farther than this depth above it? */
static int16_t limit_depth_q1(int64_t mm_q8)
{
    return limit_s16(mm_q8 >> 7);
}

/* False: out of the limits. */
static bool set_frame(struct frame *frame, const struct ih_rays *space,
                      const struct ih_ellipsoid *ellipsoid, const struct ih_ellipsoid_box *box)
{
    const int64_t depth_q8 = (int64_t)ellipsoid->centre_mm_q8[2] - space->origin_mm_q8[2];
    if (depth_q8 < DEPTH_MIN_MM << 8 || depth_q8 > DEPTH_MAX_MM << 8) {
        return false;
    }
    int32_t hit_q10 = 0;
    for (int axis = 0; axis < 2; axis++) {
        const int32_t semi_q8 = ellipsoid->semi_mm_q8[axis];
        const int64_t off_q8 = (int64_t)ellipsoid->centre_mm_q8[axis] - space->origin_mm_q8[axis];
        if (ih_abs_s64(off_q8) >= depth_q8 || semi_q8 < SEMI_MIN_MM << 8 ||
            semi_q8 > SEMI_MAX_MM << 8) {
            return false;
        }
        frame->direction_q14[axis] =
            (int16_t)((off_q8 * (1 << 14) - (off_q8 < 0 ? depth_q8 - 1 : 0)) / depth_q8);
        frame->reach_q14[axis] =
            limit_s16((int64_t)semi_q8 * (IH_ELLIPSOID_REACH << 14) / depth_q8);
        frame->mm[axis] = scale_of((int32_t)depth_q8, 256, 4);
        frame->semi[axis] = scale_of((int32_t)depth_q8, semi_q8, 11);
        const int32_t ratio_q10 = (int32_t)(((int64_t)box->half_mm_q8[axis] << 10) / semi_q8) + 1;
        hit_q10 = ih_max_s32(hit_q10, ih_min_s32(ratio_q10, 1 << 14));
    }
    const int32_t depth_mm = (int32_t)(depth_q8 >> 8);
    const int32_t lesser_mm = ih_min_s32(ellipsoid->semi_mm_q8[0], ellipsoid->semi_mm_q8[1]) >> 8;
    frame->margin = (int16_t)(5 + depth_mm / ih_min_s32(8 * lesser_mm, 900));
    hit_q10 = ((hit_q10 * hit_q10) >> 10) + 6 * frame->margin + 1;
    frame->hit_q10 =
        (int16_t)(hit_q10 < CUT2_Q10 ? hit_q10 : INT16_MAX); /* above any that is cut */
    return true;
}

static void set_limits(struct frame *frame, const struct ih_ellipsoid *ellipsoid)
{
    const int32_t *semi_q8 = ellipsoid->semi_mm_q8;
    const int64_t centre_q8 = ellipsoid->centre_mm_q8[2];
    frame->semi_y = (int16_t)(semi_q8[1] >> 4);
    frame->high_y = (int16_t)(semi_q8[1] * 19 / 160);
    frame->high_x = (int16_t)(semi_q8[0] * 16 / 160);
    frame->chin_y = (int16_t)(frame->semi_y + 40 * 16);
    frame->body_y = (int16_t)(frame->semi_y + 260 * 16);
    frame->wide_y = (int16_t)(frame->semi_y + 240 * 16);
    frame->shoulder_y = (int16_t)(semi_q8[1] * 9 / 160);
    frame->shoulder_max_y = (int16_t)(frame->semi_y + 160 * 16);
    frame->open = limit_depth_q1(centre_q8 + (60 << 8));
    frame->body_min = limit_depth_q1(centre_q8 - (220 << 8));
    frame->body_max = limit_depth_q1(centre_q8 + (200 << 8) - 1);
    frame->level_min = limit_depth_q1(centre_q8 - (150 << 8));
    frame->level_max = limit_depth_q1(centre_q8 + (150 << 8) - 1);
    frame->before = limit_depth_q1(centre_q8 - semi_q8[2] - (60 << 8) - 1);
}

static inline ih_lane scaled(ih_lane difference, const struct scale *scale)
{
    /* The 1: or gcc takes the sign from the product of 32 bits, in ten times the instructions. */
    const ih_lane cut = ih_lane_within(difference, scale->cut);
    return ih_lane_wrap(ih_lane_high_half(ih_lane_wrap(cut * scale->times), scale->share) + 1);
}

/* Places around a head. */
enum place {
    HIGH,
    BELOW,
    ABOVE,
    LEFT,
    RIGHT,
    BODY,
    WIDE,
    LEVEL,
    SHOULDER_LEFT,
    SHOULDER_RIGHT,
    BEFORE,
    PLACES
};

/* How many rays are in each place, and of how many of them what is asked is true. */
struct sums {
    ih_lane all[PLACES], part[PLACES];
    ih_lane nothing, before;
};

struct offset {
    ih_lane dx_q14, dy_q14;
    ih_lane x, y; /* mm Q4 */
    ih_lane ex_q11, ey_q11, ee_q10;
    ih_lane ring, down; /* room in the ring, by how much more down than aside */
};

static inline struct offset offset_of(const struct frame *frame,
                                      const struct ih_ray_counts_scratch *scratch, int32_t i)
{
    struct offset at;
    at.dx_q14 = ih_lane_wrap(scratch->slope_q14[0][i] - frame->direction_q14[0]);
    at.dy_q14 = ih_lane_wrap(scratch->slope_q14[1][i] - frame->direction_q14[1]);
    at.x = scaled(at.dx_q14, &frame->mm[0]);
    at.y = scaled(at.dy_q14, &frame->mm[1]);
    at.ex_q11 = scaled(at.dx_q14, &frame->semi[0]);
    at.ey_q11 = scaled(at.dy_q14, &frame->semi[1]);
    const ih_lane ex_q13 = ih_lane_wrap(at.ex_q11 * 4);
    const ih_lane ey_q13 = ih_lane_wrap(at.ey_q11 * 4);
    at.ee_q10 = ih_lane_wrap(ih_lane_high_half(ex_q13, ex_q13) + ih_lane_high_half(ey_q13, ey_q13));
    const ih_lane aside_q12 = ih_lane_wrap(ih_lane_size(at.ex_q11) * 2);
    at.ring = ih_lane_wrap(ih_lane_min(ih_lane_wrap(at.ee_q10 - RING_INNER2_Q10),
                                       ih_lane_wrap(RING_OUTER2_Q10 - at.ee_q10)) >>
                           2);
    at.down = ih_lane_wrap(ih_lane_wrap(at.ey_q11 - ih_lane_high_half(aside_q12, BELOW_Q15)) >> 1);
    return at;
}

static inline ih_lane least3(ih_lane a, ih_lane b, ih_lane c)
{
    return ih_lane_min(ih_lane_min(a, b), c);
}

/* How much room a ray has to the limits of each place. */
static inline void find_rooms_around(const struct frame *frame, const struct offset *at,
                                     ih_lane room[PLACES])
{
    const ih_lane aside_q12 = ih_lane_wrap(ih_lane_size(at->ex_q11) * 2);
    const ih_lane up = ih_lane_wrap(
        ih_lane_wrap(-ih_lane_wrap(at->ey_q11 + ih_lane_high_half(aside_q12, ABOVE_Q15))) >> 1);
    const ih_lane beside = ih_lane_min(at->ring, ih_lane_wrap(-at->down));
    const ih_lane side = ih_lane_min(beside, ih_lane_wrap(-up));
    room[HIGH] = least3(ih_lane_wrap(-ih_lane_wrap(at->y + frame->high_y)),
                        ih_lane_wrap(frame->high_x - ih_lane_size(at->x)),
                        ih_lane_wrap(frame->reach_q14[1] - ih_lane_size(at->dy_q14)));
    room[BELOW] = ih_lane_min(at->ring, at->down);
    room[ABOVE] = ih_lane_min(beside, up);
    room[LEFT] = ih_lane_min(side, ih_lane_wrap(-at->ex_q11));
    room[RIGHT] = ih_lane_min(side, at->ex_q11);
    room[BEFORE] = ih_lane_wrap(ih_lane_wrap(AROUND2_Q10 - at->ee_q10) >> 2);
}

static inline void find_rooms_below(const struct frame *frame, const struct offset *at,
                                    ih_lane room[PLACES])
{
    const ih_lane aside = ih_lane_size(at->x);
    const ih_lane under = ih_lane_wrap(at->y - frame->chin_y);
    const ih_lane shoulder = ih_lane_min(least3(ih_lane_wrap(at->y - frame->shoulder_y),
                                                ih_lane_wrap(frame->shoulder_max_y - at->y),
                                                ih_lane_wrap(aside - MM(100))),
                                         ih_lane_wrap(MM(260) - aside));
    room[BODY] = least3(under, ih_lane_wrap(frame->body_y - at->y), ih_lane_wrap(MM(180) - aside));
    room[WIDE] = ih_lane_min(
        least3(under, ih_lane_wrap(frame->wide_y - at->y), ih_lane_wrap(aside - MM(300))),
        ih_lane_wrap(frame->reach_q14[0] - ih_lane_size(at->dx_q14)));
    room[LEVEL] = least3(ih_lane_wrap(frame->semi_y - ih_lane_size(at->y)),
                         ih_lane_wrap(aside - MM(170)), ih_lane_wrap(MM(330) - aside));
    room[SHOULDER_LEFT] = ih_lane_min(shoulder, ih_lane_wrap(-at->x));
    room[SHOULDER_RIGHT] = ih_lane_min(shoulder, at->x);
}

/* What is asked of the rays of a place; a depth as good as on a limit is not sure. */
struct answers {
    ih_lane known, empty, is_open, is_body, is_level, is_before, unsure;
};

static inline ih_lane is_equal(ih_lane a, ih_lane b)
{
    return a == b ? -1 : 0;
}

static inline struct answers answers_of(const struct frame *frame,
                                        const struct ih_ray_counts_scratch *scratch, int32_t i)
{
    const ih_lane seen = scratch->seen[i];
    const ih_lane empty = scratch->empty[i];
    const ih_lane depth = scratch->depth_mm_q1[i];
    const ih_lane on_limit =
        ih_lane_wrap(is_equal(depth, frame->open) | is_equal(depth, frame->body_min) |
                     is_equal(depth, frame->body_max) | is_equal(depth, frame->level_min) |
                     is_equal(depth, frame->level_max) | is_equal(depth, frame->before));
    return (struct answers){
        .known = ih_lane_wrap(seen | empty),
        .empty = empty,
        .is_open = ih_lane_wrap(empty | ih_lane_is_above(depth, frame->open)),
        .is_body = ih_lane_wrap(seen & ih_lane_is_above(depth, frame->body_min) &
                                ~ih_lane_is_above(depth, frame->body_max)),
        .is_level = ih_lane_wrap(seen & ih_lane_is_above(depth, frame->level_min) &
                                 ~ih_lane_is_above(depth, frame->level_max)),
        .is_before = ih_lane_wrap(seen & ~ih_lane_is_above(depth, frame->before)),
        .unsure = ih_lane_wrap(seen & on_limit),
    };
}

/* A ray that is not sure of one place counts nowhere here. */
static inline ih_lane find_unsure(const ih_lane room[PLACES], ih_lane margin,
                                  const struct answers *answers)
{
    ih_lane nearest = ih_lane_size(room[0]);
    for (int place = 1; place < PLACES; place++) {
        nearest = ih_lane_min(nearest, ih_lane_size(room[place]));
    }
    return ih_lane_wrap(answers->known & (answers->unsure | ~ih_lane_is_above(nearest, margin)));
}

/* counted: where what is asked is true of a ray that is sure, as all its rooms are. */
static inline void add(struct sums *sums, enum place place, ih_lane room, ih_lane counts,
                       ih_lane counted)
{
    const ih_lane is_in = ih_lane_is_above(room, 0);
    sums->all[place] = ih_lane_wrap(sums->all[place] - (is_in & counts));
    sums->part[place] = ih_lane_wrap(sums->part[place] - (is_in & counted));
}

/* A loop without a branch: compilers turn it into vectors. */
static void count_rays(const struct frame *frame, struct ih_ray_counts_scratch *scratch,
                       struct sums *out)
{
    struct sums sums = {.nothing = 0};
    ih_lane nothing = 0;
    ih_lane before = 0;
    const ih_lane margin = frame->margin;
    for (int32_t i = 0; i < IH_RAY_COUNTS_RAYS; i++) {
        ih_lane room[PLACES];
        const struct offset at = offset_of(frame, scratch, i);
        const struct answers answers = answers_of(frame, scratch, i);
        find_rooms_around(frame, &at, room);
        find_rooms_below(frame, &at, room);
        const ih_lane unsure = find_unsure(room, margin, &answers);
        const ih_lane counts = ih_lane_wrap(answers.known & ~unsure);
        const ih_lane open = ih_lane_wrap(counts & answers.is_open);
        const ih_lane body = ih_lane_wrap(counts & answers.is_body);
        const ih_lane beside = ih_lane_is_above(ih_lane_min(at.ring, ih_lane_wrap(-at.down)), 0);
        const ih_lane around = ih_lane_is_above(room[BEFORE], 0);
        add(&sums, HIGH, room[HIGH], counts, open);
        add(&sums, BELOW, room[BELOW], counts, open);
        add(&sums, ABOVE, room[ABOVE], counts, open);
        add(&sums, LEFT, room[LEFT], counts, open);
        add(&sums, RIGHT, room[RIGHT], counts, open);
        add(&sums, BODY, room[BODY], counts, body);
        add(&sums, WIDE, room[WIDE], counts, body);
        add(&sums, LEVEL, room[LEVEL], counts, ih_lane_wrap(counts & answers.is_level));
        add(&sums, SHOULDER_LEFT, room[SHOULDER_LEFT], counts, body);
        add(&sums, SHOULDER_RIGHT, room[SHOULDER_RIGHT], counts, body);
        nothing = ih_lane_wrap(nothing - (beside & counts & answers.empty));
        before = ih_lane_wrap(before - (around & counts & answers.is_before));
        const ih_lane is_hit = ih_lane_is_above(frame->hit_q10, at.ee_q10);
        scratch->flag[i] = ih_lane_wrap(
            (unsure & IH_RAY_COUNTS_UNSURE) | (answers.known & is_hit & IH_RAY_COUNTS_HIT) |
            (ih_lane_is_above(room[BODY], 0) & body & IH_RAY_COUNTS_BODY));
    }
    sums.nothing = nothing;
    sums.before = before;
    *out = sums;
}

static struct ih_ray_counts_share share_of(const struct sums *sums, enum place place)
{
    return (struct ih_ray_counts_share){.part = sums->part[place], .all = sums->all[place]};
}

static bool try_count(const struct ih_rays *space, const struct ih_ellipsoid *ellipsoid,
                      const struct ih_ellipsoid_box *box, struct ih_ray_counts_scratch *scratch,
                      struct ih_ray_counts *out)
{
    struct frame frame;
    struct sums sums;
    if (!scratch->is_usable || !set_frame(&frame, space, ellipsoid, box)) {
        return false;
    }
    set_limits(&frame, ellipsoid);
    count_rays(&frame, scratch, &sums);
    *out = (struct ih_ray_counts){
        .above = share_of(&sums, ABOVE),
        .left = share_of(&sums, LEFT),
        .right = share_of(&sums, RIGHT),
        .below = share_of(&sums, BELOW),
        .high = share_of(&sums, HIGH),
        .nothing = {.part = sums.nothing,
                    .all = sums.all[ABOVE] + sums.all[LEFT] + sums.all[RIGHT]},
        .body = share_of(&sums, BODY),
        .wide = share_of(&sums, WIDE),
        .level = share_of(&sums, LEVEL),
        .shoulder = {share_of(&sums, SHOULDER_LEFT), share_of(&sums, SHOULDER_RIGHT)},
        .before = sums.before,
    };
    return true;
}

#endif

void ih_ray_counts_count(const struct ih_rays *space, const struct ih_ellipsoid *ellipsoid,
                         const struct ih_ellipsoid_box *box, struct ih_ray_counts_scratch *scratch,
                         struct ih_ray_counts *out)
{
    *out = (struct ih_ray_counts){.before = 0};
#if IH_LANE_COUNT > 1
    if (try_count(space, ellipsoid, box, scratch, out)) {
        return;
    }
#else
    (void)ellipsoid;
    (void)box;
#endif
    leave_all(space, scratch);
}
