/* ih_ray_limits - a candidate in 16 bits: the limits of ih_ray_counts' regions (ours).
 *
 * In:     rays, an ellipsoid. Limits of its size and position: ih_ray_counts.h.
 * Out:    per axis the candidate's direction and scales; limits in mm Q4, depths in mm Q1.
 */
#ifndef IH_RAY_LIMITS_H
#define IH_RAY_LIMITS_H

#include <stdbool.h>
#include <stdint.h>

#include "base/ih_fix.h"
#include "detect/ih_ellipsoid.h"
#include "detect/ih_head_model.h"
#include "detect/ih_rays.h"

#define IH_RAY_DEPTH_MIN_MM 227
#define IH_RAY_DEPTH_MAX_MM 16300
#define IH_RAY_SEMI_MIN_MM 42
#define IH_RAY_SEMI_MAX_MM 200
#define IH_RAY_SLOPE_MAX_Q20 (1 << 20)
/* Offsets are limited to this: 510 mm in Q4, 3.99 semi-axes in Q11. */
#define IH_RAY_OFFSET_MAX 8171
#define IH_RAY_MM_Q4(mm) ((mm)*16)
#define IH_RAY_OFFSET_MAX2_Q10 16000 /* below the square of 3.99 semi-axes */

/* A slope difference to an offset: clamped, times a power of two, times a factor of 2^-16. */
struct ih_ray_scale {
    int16_t limit, power, factor;
};

/* A candidate, as the loop needs it: limits in mm Q4, depths in mm Q1, else as their names say. */
struct ih_ray_limits {
    int16_t direction_q14[2];
    int16_t reach_q14[2]; /* rays farther away are in no region */
    struct ih_ray_scale mm[2], semi[2];
    int16_t margin;
    int16_t high_y, high_x, body_top_y, body_bottom_y, wide_bottom_y, semi_y;
    int16_t shoulder_top_y, shoulder_bottom_y;
    int16_t hit_q10;
    int16_t open, body_min, body_max, level_min, level_max, before;
};

/* Times depth / 2^14, in steps of `length_q8` / 2^bits. */
static inline struct ih_ray_scale ih_ray_scale_of(int32_t depth_q8, int32_t length_q8, int bits)
{
    const int64_t all = ((int64_t)depth_q8 << (bits + 2)) / length_q8; /* below 2^27 */
    const int shift = ih_max_s32(ih_bits_u64((uint64_t)all) - 15, 0);
    const int64_t factor = all > 0 ? all >> shift : 1;
    return (struct ih_ray_scale){
        .limit =
            (int16_t)ih_min_s64(((int64_t)IH_RAY_OFFSET_MAX << 16) / (factor << shift), INT16_MAX),
        .power = (int16_t)(1 << shift),
        .factor = (int16_t)factor,
    };
}

static inline int16_t ih_ray_clamp_s16(int64_t value)
{
    return (int16_t)ih_clamp_s64(value, INT16_MAX);
}

static inline int16_t ih_ray_depth_q1(int64_t mm_q8)
{
    return ih_ray_clamp_s16(mm_q8 >> 7);
}

/* False outside of the limits. */
static inline bool ih_ray_limits_set_directions(struct ih_ray_limits *candidate,
                                                const struct ih_rays *rays,
                                                const struct ih_ellipsoid *ellipsoid)
{
    const int64_t depth_q8 = (int64_t)ellipsoid->centre_mm_q8[2] - rays->origin_mm_q8[2];
    if (depth_q8 < IH_RAY_DEPTH_MIN_MM << 8 || depth_q8 > IH_RAY_DEPTH_MAX_MM << 8) {
        return false;
    }
    for (int axis = 0; axis < 2; axis++) {
        const int32_t semi_q8 = ellipsoid->semi_mm_q8[axis];
        const int64_t off_q8 = (int64_t)ellipsoid->centre_mm_q8[axis] - rays->origin_mm_q8[axis];
        if (rays->table.slope_max_q20[axis] >= IH_RAY_SLOPE_MAX_Q20 ||
            ih_abs_s64(off_q8) >= depth_q8 || semi_q8 < IH_RAY_SEMI_MIN_MM << 8 ||
            semi_q8 > IH_RAY_SEMI_MAX_MM << 8) {
            return false;
        }
        candidate->direction_q14[axis] =
            (int16_t)((off_q8 * (1 << 14) - (off_q8 < 0 ? depth_q8 - 1 : 0)) / depth_q8);
        candidate->reach_q14[axis] =
            ih_ray_clamp_s16((int64_t)semi_q8 * (IH_ELLIPSOID_REACH << 14) / depth_q8);
        candidate->mm[axis] = ih_ray_scale_of((int32_t)depth_q8, 256, 4);
        candidate->semi[axis] = ih_ray_scale_of((int32_t)depth_q8, semi_q8, 11);
    }
    const int32_t depth_mm = (int32_t)(depth_q8 >> 8);
    const int32_t shorter_mm = ih_min_s32(ellipsoid->semi_mm_q8[0], ellipsoid->semi_mm_q8[1]) >> 8;
    candidate->margin = (int16_t)(5 + depth_mm / ih_min_s32(8 * shorter_mm, 900));
    return true;
}

/* An upper bound of a hit's distance from the centre, squared, in semi-axes; above every square if it is limited. */
static inline int16_t ih_ray_hit_q10(const struct ih_ellipsoid *ellipsoid,
                                     const struct ih_ellipsoid_box *box, int32_t margin)
{
    int32_t hit_q10 = 0;
    for (int axis = 0; axis < 2; axis++) {
        const int32_t semi_q8 = ellipsoid->semi_mm_q8[axis];
        const int32_t ratio_q10 = (int32_t)(((int64_t)box->half_mm_q8[axis] << 10) / semi_q8) + 1;
        hit_q10 = ih_max_s32(hit_q10, ih_min_s32(ratio_q10, 1 << 14));
    }
    hit_q10 = ((hit_q10 * hit_q10) >> 10) + 6 * margin + 1;
    return (int16_t)(hit_q10 < IH_RAY_OFFSET_MAX2_Q10 ? hit_q10 : INT16_MAX);
}

static inline void ih_ray_limits_set_regions(struct ih_ray_limits *candidate,
                                             const struct ih_ellipsoid *ellipsoid)
{
    const int32_t *semi_q8 = ellipsoid->semi_mm_q8;
    const int64_t centre_q8 = ellipsoid->centre_mm_q8[2];
    const int16_t semi_y = (int16_t)(semi_q8[1] >> 4);
    candidate->semi_y = semi_y;
    candidate->high_y = (int16_t)(semi_q8[1] * IH_HEAD_HIGH_FROM_PERCENT / 1600);
    candidate->high_x = (int16_t)(semi_q8[0] * IH_HEAD_HIGH_ASIDE_PERCENT / 1600);
    candidate->body_top_y = (int16_t)(semi_y + IH_RAY_MM_Q4(IH_HEAD_BODY_TOP_MM));
    candidate->body_bottom_y = (int16_t)(semi_y + IH_RAY_MM_Q4(IH_HEAD_BODY_BOTTOM_MM));
    candidate->wide_bottom_y = (int16_t)(semi_y + IH_RAY_MM_Q4(IH_HEAD_WIDE_BOTTOM_MM));
    candidate->shoulder_top_y = (int16_t)(semi_q8[1] * IH_HEAD_SHOULDER_TOP_PERCENT / 1600);
    candidate->shoulder_bottom_y = (int16_t)(semi_y + IH_RAY_MM_Q4(IH_HEAD_SHOULDER_BOTTOM_MM));
    candidate->open = ih_ray_depth_q1(centre_q8 + (IH_HEAD_OPEN_MM << 8));
    candidate->body_min = ih_ray_depth_q1(centre_q8 - (IH_HEAD_BODY_BEFORE_MM << 8));
    candidate->body_max = ih_ray_depth_q1(centre_q8 + (IH_HEAD_BODY_BEHIND_MM << 8) - 1);
    candidate->level_min = ih_ray_depth_q1(centre_q8 - (IH_HEAD_LEVEL_DEPTH_MM << 8));
    candidate->level_max = ih_ray_depth_q1(centre_q8 + (IH_HEAD_LEVEL_DEPTH_MM << 8) - 1);
    candidate->before = ih_ray_depth_q1(centre_q8 - semi_q8[2] - (IH_HEAD_BEFORE_MM << 8) - 1);
}

/* box: rays that may hit the ellipsoid pass through it. False outside of the limits. */
static inline bool ih_ray_limits_set(struct ih_ray_limits *candidate, const struct ih_rays *rays,
                                     const struct ih_ellipsoid *ellipsoid,
                                     const struct ih_ellipsoid_box *box)
{
    if (!ih_ray_limits_set_directions(candidate, rays, ellipsoid)) {
        return false;
    }
    candidate->hit_q10 = ih_ray_hit_q10(ellipsoid, box, candidate->margin);
    ih_ray_limits_set_regions(candidate, ellipsoid);
    return true;
}

#endif
